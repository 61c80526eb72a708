"""Sources of error that are this test's own."""

from __future__ import annotations

from gyrobench.reduction.setup.sources import Source

CONTROL = Source("table.control.gain", "control accelerometer", "1", "u_gain", "relative, positive where it reads more")
