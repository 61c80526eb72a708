"""Sources of error that are this test's own."""

from gyrobench.reduction.setup.sources import RELATIVE, Source

SCALE = Source("autocollimator.scale", "scale of the autocollimator", RELATIVE, "u_scale")
