"""Sources of error of the test, in the order of its options."""

from dataclasses import replace

from gyrobench.reduction.setup import sources as shared
from gyrobench.reduction.setup.sources import Source

SCALE = Source("accelerometer.scale", "scale λ", "1", "u_scale", "relative", doc="relative standard uncertainty of λ")
ZERO = replace(shared.CURRENT_OFFSET, name="zero of the current meter")
RESOLUTION = replace(shared.CURRENT_RESOLUTION, name="resolution of the current meter")
GRAVITY = shared.GRAVITY
PLACES = Source(
    "head.positions", "positions of the head", "rad", "u_angle", "independent, the same in each turn and mount",
    doc="standard uncertainty of a position of the head that comes back each turn",
)  # fmt: skip
ANGLE_ONCE, ANGLE_TWICE = shared.ANGLE_ONCE, shared.ANGLE_TWICE
AXIS = Source(
    "head.axis", "axis of the head above the horizon", "rad", "u_axis",
    doc="standard uncertainty of the axis of the head against the horizon",
)  # fmt: skip
TURNED = Source(
    "accelerometer.mount.{k}", "accelerometer turned about its {axis} axis", "rad", "u_mount",
    doc="standard uncertainty of the accelerometer about each of its axes in the mount",
)  # fmt: skip
