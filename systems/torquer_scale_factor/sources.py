"""Sources of error of the current that are this test's own."""

from gyrobench.reduction.setup.sources import Source

AMMETER = Source("ammeter.scale", "ammeter", "1", "u_current", "relative")
ZERO = Source("ammeter.zero", "zero of the ammeter", "A", "u_zero")
RANGES = Source("torquer.range_step", "step of K_n between the angle ranges", "rad/s/A")
