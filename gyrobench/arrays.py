"""The one name for an array of double precision numbers; shapes stand in the docstrings."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
AnyArray = NDArray[Any]  # columns of a record: numbers, counts, labels
