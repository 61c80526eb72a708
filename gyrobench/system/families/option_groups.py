"""Options that several tests have, each with its default once: ``options = SITE | TORQUER | type_b("current")``."""

from __future__ import annotations

import math

from gyrobench.system.configurable import Option
from gyrobench.units import DEG

#: noise ports of a gyro, of each channel
GYRO_NOISES = ("turn_on", "markov", "white", "pickoff", "flicker", "walk", "quantization")
SITE = {
    "latitude": Option(
        "45.75deg", "rad", "geographic latitude, north positive", -math.pi / 2, math.pi / 2, sets="site.latitude"
    ),
    "height": Option(0.0, "m", "height above the ellipsoid", sets="site.height"),
    "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity", sets="site.gravity"),
}
#: of a table that stands still on its vertical axis
VERTICAL_AXIS = {
    "latitude": Option(
        "45.75deg", "rad", "latitude; the table axis is vertical", -math.pi / 2, math.pi / 2, sets="site.latitude"
    ),
}
#: of a vehicle that moves on the turning Earth
MOVING = {
    "latitude": Option("40deg", "rad", "geographic latitude", -90 * DEG, 90 * DEG, sets="motion.latitude"),
    "earth_rate": Option(7.2921159e-5, "rad/s", "Earth rate; 0: none", 0.0, sets="motion.earth_rate"),
}
TORQUER = {
    "k": Option(0.0, "rad/s/A", "torquer scale factor for the reduction; 0: the parameter k of the gyro", 0.0),
}
NUISANCES = {
    "nuisances": Option("auto", str, "set-up effects (trend, temperature ...): weighed by the data (auto), or none"),
    "robust": Option(False, bool, "show a robust fit beside the plain one"),
}
TILT = {
    "tilt": Option("auto", str, "input-axis misalignment: estimated (yes), zero (no), or weighed by the data (auto)"),
}
CORRECTIONS = {
    "corrections": Option("", str, "measured set-up errors, names as in the budget: SOURCE = VALUE(U) UNIT; ..."),
}
FOLD = {"fold": Option(False, bool, "accept that D_OO is folded into D_F, D_II and D_SS")}
SETTLE = {"settle": Option(10.0, "s", "wait before averaging, after each move", 0.0)}
ATTITUDE = {
    "attitude": Option("E U", str, "I and O (and S) axes: E, N, U, P, Q or minus these, or a matrix of rows"),
}
#: name without u_ -> unit and meaning
_TYPE_B = {
    "attitude": ("rad", "standard uncertainty of the attitude about each gyro axis"),
    "axis": ("rad", "standard uncertainty of the table axis against the pole"),
    "square": ("rad", "standard uncertainty of the right angle between the table axes"),
    "mount": ("rad", "standard uncertainty of the gyro axes against the fixture"),
    "remount": ("rad/s", "std. unc. of the drift from mount to mount, where the plan does not show it"),
    "wobble": ("rad", "wobble of a table axis twice a turn, std. unc. of its amplitude"),
    "angle1": ("rad", "error of the angle readings once a turn, std. unc. of its amplitude"),
    "angle2": ("rad", "error of the angle readings twice a turn, std. unc. of its amplitude"),
    "unbalance": ("rad", "angle by unbalance of the table at 1 g over the stiffness, std. unc."),
    "latitude": ("rad", "standard uncertainty of the latitude"),
    "scale_factor": ("1", "relative standard uncertainty of the torquer scale factor"),
    "nonlinearity": ("1", "relative torquer nonlinearity at the largest current, standard unc."),
    "current": ("A", "standard uncertainty of the zero of the current meter"),
    "pulse": ("A", "standard uncertainty of the positive less the negative current of a pulse rebalance"),
    "switching": ("s", "standard uncertainty of the switching time of a pulse rebalance"),
    "time": ("1", "relative standard uncertainty of the time base"),
    "wheel_frequency": ("1", "relative std. unc. of the wheel's frequency, and of its change over the record"),
    "wheel_voltage": ("1", "relative std. unc. of the wheel's voltage, and of its change over the record"),
    "wheel_phase": ("rad", "std. unc. of the phases of the wheel's supply, and of its change over the record"),
    "pickoff_excitation": ("1", "relative std. unc. of the pickoff's excitation, and of its change over the record"),
    "torquer_excitation": ("1", "the same of the excitation of torquer or suspension"),
}


def type_b(*names: str, **meanings: str) -> dict[str, Option]:
    """Return the options u_NAME, sizes of uncertainties of type B (0 unless set), of the sources of these names.

    meanings: names whose meaning in this test is another one: ``axis="of each mount, about each of its axes"``.
    """
    known = {**{n: _TYPE_B[n][1] for n in names}, **meanings}
    return {f"u_{n}": Option(0.0, _TYPE_B[n][0], text, 0.0) for n, text in known.items()}


#: electrical supplies of the gyro  [GYRO-SUPPLY]
SUPPLY = {
    "supply_terms": Option(
        "", str, "what supplies do to the gyro (D_pickoff=0.1deg/h, D_US=1deg/h/g ...); empty: as set"
    ),
} | type_b("wheel_frequency", "wheel_voltage", "wheel_phase", "pickoff_excitation", "torquer_excitation")
