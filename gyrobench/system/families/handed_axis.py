"""Corrections that tests with an axis on the pole take of an alignment of it: measured errors of the set-up."""

from __future__ import annotations

from collections.abc import Callable

from gyrobench.result import Result

ABOUT = ("about east", "about p × east")  # coefficients of the alignment, and ends of the names of the sources


def pole_axis(axis: str = "table axis") -> Callable[[Result], dict[str, str]]:
    """Return the function that makes corrections of an ``axis`` off the pole of the result of an alignment.

    It raises LookupError where the alignment has no value.
    """

    def corrections(result: Result) -> dict[str, str]:
        found = {c.name: c for c in result.coefficients}
        missing = [n for n in ABOUT if n not in found or found[n].no_value]
        if missing:
            raise LookupError(f"no value of the axis {' and '.join(missing)}")
        texts = (f"{axis} off the pole, {n} = {found[n].estimate:.9g}({found[n].u:.6g}) arcsec" for n in ABOUT)
        return {"corrections": "; ".join(texts)}

    return corrections
