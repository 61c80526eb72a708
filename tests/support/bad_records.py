"""Records of the specification's tests spoilt, and what their reduction says of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from gyrobench.reduction.setup.window_checks import ReductionError

Columns = dict[str, np.ndarray]


def put(column: str, row: int, value: float) -> Callable[[Columns], None]:
    """Return what sets one value of a record."""
    return lambda w: w[column].__setitem__(row, value)


def cut(w: Columns, keep: np.ndarray) -> None:
    """Leave some rows of a record: numbers, or a truth value for each."""
    for name in w:
        w[name] = w[name][keep]


def message(reduction: Any, windows: Columns, setup: Any) -> str:
    """Return what a reduction's refusal says."""
    with pytest.raises(ReductionError) as error:
        reduction.Reduction.reduce(windows, setup)
    return str(error.value)


def differs(a: float, b: float) -> bool:
    """Return whether two numbers are more than a millionth of the larger one apart."""
    return abs(a - b) > 1e-6 * max(abs(a), abs(b))
