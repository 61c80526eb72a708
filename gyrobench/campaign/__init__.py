"""Many runs: their plan, their execution on dask.distributed, and the store of their results.

Called, it is :func:`gyrobench.library.many_runs.campaign`.
"""

import sys

from gyrobench.callable_room import CallableRoom

sys.modules[__name__].__class__ = CallableRoom
