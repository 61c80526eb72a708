"""Sources of error that are this test's own."""

from __future__ import annotations

from gyrobench.reduction.setup.sources import Source

TWIST = Source(
    "table.twist", "steady turn of the table about the axis of the cone", "rad/s", "u_twist",
    doc="std. unc. of a steady turn of the table about the axis of the cone",
)  # fmt: skip
