"""Sources of error of a head and its instruments that are this test's own."""

from gyrobench.reduction.setup.sources import Source

ZERO = Source("head.zero", "zero of the head against the reference", "rad", "u_angle")
TILT = Source(
    "head.tilt.{axis}", "tilt of the head about {axis}", "rad", "u_level", "right-handed",
    doc="std. unc. of the level of the head about each axis, not read",
)  # fmt: skip
FORCE_NOISE = Source("accelerometers.noise.{axis}", "noise of the accelerometers along {axis}", "m/s2")
FORCE_BIAS = Source(
    "accelerometers.bias.{axis}", "bias of the accelerometer along {axis}", "m/s2", "u_accelerometer",
    doc="standard uncertainty of the bias of an accelerometer",
)  # fmt: skip
GYRO_BIAS = Source(
    "gyro.bias.{axis}", "bias of the gyro along {axis}", "rad/s", "u_bias",
    doc="std. unc. of the bias of a gyro (strapdown, one position)",
)  # fmt: skip
