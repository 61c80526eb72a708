"""Records and results outside of reports: data frames, and HTML that a notebook shows by itself."""

from __future__ import annotations

from collections.abc import Mapping
from functools import singledispatch
from typing import TYPE_CHECKING, Any

from gyrobench.errors import GyrobenchError

if TYPE_CHECKING:
    import pandas


class MissingPackageError(GyrobenchError):
    """A package that gyrobench does not need itself is not installed; the text says how to get it."""


@singledispatch
def html(shown: object) -> str | None:
    """Return an object as an HTML fragment; None: the notebook shows its text.

    The forms of records, results and comparisons are registered by :mod:`gyrobench.report.notebook_html`.
    """
    return None


class Displayed:
    """Base of what a notebook shows by itself."""

    def _repr_html_(self) -> str | None:
        return html(self)


def data_frame(columns: Mapping[str, Any], units: Mapping[str, str], index: str = "") -> pandas.DataFrame:
    """Return columns (arrays or lists) as a pandas data frame; ``attrs["units"]`` holds the units that are known.

    index: the column that names the rows.  Raises MissingPackageError without pandas.
    """
    try:
        import pandas
    except ImportError:
        raise MissingPackageError(
            "data frames need pandas, which is not installed: pip install pandas, or pip install "
            "'gyrobench[notebook]'; the same values are there as numpy arrays"
        ) from None
    frame = pandas.DataFrame(dict(columns))
    if index:
        frame = frame.set_index(index)
    frame.attrs["units"] = {name: unit for name, unit in units.items() if unit}
    return frame
