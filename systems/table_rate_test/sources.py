"""Sources of error of the readings of an angle."""

from gyrobench.reduction.setup.sources import Source
from gyrobench.units import ARCSEC

ONCE = Source(
    "reader.once", "readings, once a turn", "rad", "u_angle1",
    doc="error of the readings once a turn, std. unc. of its amplitude", default=0.3 * ARCSEC,
)  # fmt: skip
TWICE = Source(
    "reader.twice", "readings, twice a turn", "rad", "u_angle2",
    doc="error of the readings twice a turn, std. unc. of its amplitude", default=0.15 * ARCSEC,
)  # fmt: skip
CYCLE = Source(
    "reader.cycle", "readings, within a cycle of the scale", "rad", "u_cycle",
    doc="error twice in a cycle of the scale, std. unc. of its amplitude", default=0.1 * ARCSEC,
)  # fmt: skip
NOISE = Source(
    "reader.noise", "noise of a reading beyond its rounding", "rad", "u_reading",
    doc="noise of a reading beyond its rounding, standard uncertainty",
)  # fmt: skip
COUNTS = Source("reader.counts", "quantization of the counts", "rad")
