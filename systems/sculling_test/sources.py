"""Sources of error of a table that turns and vibrates, which are this test's own."""

from gyrobench.reduction.setup.sources import Source

ANGLE = Source("table.angle_gain", "amplitude of the angle", "1", "u_angle", "relative, positive where it is larger")
VIBRATION = Source(
    "table.force_gain", "amplitude of the vibration", "1", "u_vibration", "relative, positive where it is larger",
    doc="relative standard uncertainty of that of the vibration",
)  # fmt: skip
PHASE = Source(
    "table.phase_error", "phase of the vibration against the angle", "rad", "u_phase",
    doc="standard uncertainty of the phase between both",
)  # fmt: skip
