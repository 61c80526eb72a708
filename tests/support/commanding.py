"""The type of the fixtures that run a gyrobench command."""

from __future__ import annotations

from collections.abc import Callable

Command = Callable[..., tuple[int, str, str]]  # words -> exit code, standard output, standard error
