"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import Source

GAIN = Source("float.gain", "gain H/C", "1", "u_gain", "relative", doc="relative standard uncertainty of that gain")
SCALE = Source("angle.scale", "angle scale of the table", "1", "u_angle", "relative")
DRIFT = Source(
    "drift.bound", "drift during the test", "rad/s",
    note="not told from the slope by angles gone over once; bound taken as two standard uncertainties",
)  # fmt: skip
