"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import RELATIVE, Source

RECORDED = Source(
    "recorded.{cause}.scale", "scale of the {words}", RELATIVE, "u_scales", "relative, what is recorded",
    doc="relative standard uncertainty of the scale of each recorded cause",
)  # fmt: skip
