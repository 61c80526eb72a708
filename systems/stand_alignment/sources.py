"""Sources of error of sights and inclinometer."""

from dataclasses import replace

from gyrobench.component.set_up import SINES
from gyrobench.reduction.setup import sources as shared
from gyrobench.reduction.setup.sources import RELATIVE, Source

CLOCK = Source("clock", "clock", "s", "u_time", "positive where it is fast")
LATITUDE = replace(shared.LATITUDE, doc="standard uncertainty of the latitude, deflection of the vertical in it")
PLACE = Source(
    "star.place", "place of the star", "rad", "u_star", "each way", ("declination", "hour angle"),
    doc="standard uncertainty of the place of Polaris, each way",
)  # fmt: skip
HEADING = Source(
    "head.heading", "heading of the north finder", "rad", "u_heading", "positive where it is too large",
    doc="standard uncertainty of the heading of the north finder's mirror",
)  # fmt: skip
LEVEL = Source(
    "level.scale", "scale of the plate level", RELATIVE, "u_level", "relative, positive where it reads too much"
)
CIRCLE = Source(
    "circle.once", "circle, once a turn", "rad", "u_circle", "reads too much", SINES,
    doc="error of the circle once a turn, std. unc. of its amplitude",
)  # fmt: skip
NORMAL = Source(
    "mirror.normal", "mirror against the axis", "rad", "u_mirror", "in azimuth, to the east",
    doc="std. unc. of the mirror's normal against the axis, in azimuth",
)  # fmt: skip
LEANING = Source(
    "inclinometer", "inclinometer", "rad", "u_inclinometer", "what turning it round does not show",
    doc="std. unc. of the inclinometer that turning does not show",
)  # fmt: skip
