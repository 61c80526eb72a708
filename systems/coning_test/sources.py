"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import Source

HALF_ANGLE = Source(
    "table.angle_gain", "half-angle of the cones", "1", "u_half_angle", "relative, positive where it is larger",
    doc="relative standard uncertainty of the half-angle",
)  # fmt: skip
TWIST = Source(
    "table.twist", "steady turn of the table about the axis of the cone", "rad/s", "u_twist",
    doc="std. unc. of a steady turn of the table about the axis of the cone",
)  # fmt: skip
LEANING = Source(
    "cone.leaning", "g-sensitivity of gyros that lean by the half-angle", "rad/s",
    note="as if all the drift at rest were it; times 1 − cos θ",
)  # fmt: skip
