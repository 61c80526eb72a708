"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import Source

PICKOFF = Source(
    "pickoff.gain", "gain of the pickoffs", "1", "u_pickoff", "relative, of both alike",
    doc="relative standard uncertainty of the pickoff gains",
)  # fmt: skip
