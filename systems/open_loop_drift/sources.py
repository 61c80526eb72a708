"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import Source

ANGLE = Source(
    "angle.span", "angle between first and last reading", "rad", "u_angle",
    doc="standard uncertainty of the angle from the first to the last reading",
)  # fmt: skip
GAIN = Source(
    "float.gain", "float gain H/C", "1", "u_float_gain", "Earth rate along the spin axis times b",
    doc="standard uncertainty of H/C",
)  # fmt: skip
