"""Sources of error that are this test's own."""

from __future__ import annotations

from gyrobench.reduction.setup.sources import RELATIVE, Source

AXIS_LEVEL = Source("outer.axis.level", "outer axis out of level, about north", "rad", "u_axis")
AXIS_AZIMUTH = Source("outer.axis.azimuth", "outer axis off east, about the vertical", "rad", "u_axis")
MOUNT = Source("mount.{k}", "case turned about its {axis} axis", "rad", "u_mount")
ZERO = Source(
    "{axis}.angle.zero", "zero of the {axis} angle", "rad", "u_zero", "table stands further than it reads",
    doc="standard uncertainty of the zero of each angle, plate level",
)  # fmt: skip
HYSTERESIS = Source(
    "{axis}.angle.hysteresis", "hysteresis of the {axis} angle", "rad", "u_hysteresis",
    "half of the difference between both ways, positive where the table stands further after it turned forwards",
    doc="standard uncertainty of half the hysteresis of each angle",
)  # fmt: skip
GYRO_SCALE = Source(
    "gyro.scale.unseen", "scale factors and misalignments not shown by the plan", RELATIVE, "u_gyro_scale",
    doc="std. unc. of scale factors and misalignments of the gyros that the plan does not show",
)  # fmt: skip
