"""What a measured record does not show of the scale of its autocollimator, and must be asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from gyrobench.reduction.diagnosis.unshown import ARRANGEMENT, TOO_LARGE
from gyrobench.reduction.loops.measure_findings import MeasureFindings
from gyrobench.reduction.toolkit import Reason, RunDocument, plain

from .sources import SCALE


def unstated(run: RunDocument, slopes: Mapping[str, float], found: MeasureFindings) -> Iterator[Reason]:
    """Yield that the scale is neither stated nor said to be checked; slopes: of figures, printed units per 1."""
    if not run.measured or run.arrangement == "checked" or SCALE.size(run.options):
        return
    moved = {n: (TOO_LARGE - 1.0) * abs(s) / found[n].u for n, s in slopes.items() if found[n].u > 0.0}
    far = sorted((n for n, v in moved.items() if v > 1.0), key=lambda n: -moved[n])
    if not far:
        return
    said = ", ".join(f"{n} by {plain(moved[n])} u" for n in far[:3])
    text = (
        f"No residual of this record would show: the scale of the autocollimator wrong by 2 % ({said}). State its "
        "uncertainty (u_scale), or that units and scales were checked (arrangement = checked)."
    )
    yield Reason(ARRANGEMENT, text, ("pass",), tuple(far), severity="doubt")
