"""Sources of error that are this test's own."""

from __future__ import annotations

from gyrobench.reduction.setup.sources import Source

CONTROL = Source("table.control.gain", "control accelerometer", "1", "u_gain", "relative, positive where it reads more")
LEAN = Source(
    "fixture.lean", "lean of the case on its fixture", "rad", "u_lean", "of each way by itself",
    doc="std. unc. of the attitude about each axis, of each way that the axis points by itself",
)  # fmt: skip
LEAN_ACROSS = Source(
    "fixture.lean.across", "gravity across the axis, by that lean", "rad", "u_lean",
    "g-sensitivity across taken as large as that along",
)  # fmt: skip
LEAN_COSINE = Source("fixture.cosine", "cosine of the axis against the vertical", "1", "u_lean", "second order")
