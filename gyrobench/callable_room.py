"""Packages that have the name of a function of the library: ``gyrobench.design(...)`` calls it, imported or not."""

from __future__ import annotations

import importlib
from types import ModuleType
from typing import Any


class CallableRoom(ModuleType):
    """A package as a function.  In its ``__init__.py``: ``sys.modules[__name__].__class__ = CallableRoom``."""

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call the function of :mod:`gyrobench.library` of the package's name."""
        return getattr(importlib.import_module("gyrobench.library"), self.__name__.rpartition(".")[2])(*args, **named)
