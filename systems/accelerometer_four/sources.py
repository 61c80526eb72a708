"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import Source

FIRST = Source(
    "head.first_harmonic.{kind}", "first harmonic of the head, {kind}", "rad", "u_D1", "as measured",
    doc="standard uncertainty of D1c and D1s", default="0.1arcsec",
)  # fmt: skip
