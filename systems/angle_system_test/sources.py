"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import RELATIVE, Source

TABLE_RATE = Source(
    "table.rate", "rate of the table", RELATIVE, "u_rate", "relative",
    doc="relative standard uncertainty of the table's rate",
)  # fmt: skip
