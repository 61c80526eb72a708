"""What a fit reports: estimates as arrays, and the groups of data that are drawn together."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from gyrobench.arrays import Array


@dataclass(frozen=True)
class Group:
    """Rows of the data that belong together, with what they are drawn against (in the printed unit)."""

    label: str  # "mount 1, against the Earth"
    rows: ArrayLike  # indices of the rows, or a mask
    x: ArrayLike  # one for each row
    x_name: str  # "table angle"
    x_unit: str  # "°"
    dense: tuple[ArrayLike, ArrayLike] | None = None  # x and rows of X of the plotted curve


@dataclass(frozen=True)
class Estimates:
    """What is reported, in SI, in the order of the quantities; see NoiseEstimate."""

    value: Array
    covariance: Array
    u: Array
    half_width: Array
    p: Array
    dof: Array
    gain: Array  # (q, n): value = gain y, of changes if the values are derived
