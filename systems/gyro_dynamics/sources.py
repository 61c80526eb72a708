"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import STATED, Source

PICKOFF = Source("pickoff.scale", "pickoff gain", "1", "u_pickoff", STATED)
SPIN = Source(
    "gyro.spin", "spin angular momentum", "1", "u_spin", STATED,
    doc="relative standard uncertainty of the angular momentum",
)  # fmt: skip
