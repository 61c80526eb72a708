"""Designs of tests: which positions, how long, in which order, for a wanted uncertainty.

Called, it is :func:`gyrobench.library.design`.
"""

import sys

from gyrobench.callable_room import CallableRoom

sys.modules[__name__].__class__ = CallableRoom
