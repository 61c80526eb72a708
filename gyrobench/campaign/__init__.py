"""Many runs: their plan, their execution on dask.distributed, and the store of their results.

The room has the name of a function of the library: ``gyrobench.campaign(...)`` is
:func:`gyrobench.library.many_runs.campaign`, whether this module has been imported or not.
"""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any


class _Room(ModuleType):
    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call the function of the library."""
        return importlib.import_module("gyrobench.library").campaign(*args, **named)


sys.modules[__name__].__class__ = _Room
