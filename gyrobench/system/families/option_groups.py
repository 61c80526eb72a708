"""Options that several tests have, each with its default once: ``options = SITE | TORQUER | type_b("current")``."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from types import ModuleType

from gyrobench.reading import shorten
from gyrobench.reduction.setup.sources import SHARED, Source, stating
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
    )
}
#: of a vehicle that moves on the turning Earth
MOVING = {
    "latitude": Option("40deg", "rad", "geographic latitude", -90 * DEG, 90 * DEG, sets="motion.latitude"),
    "earth_rate": Option(7.2921159e-5, "rad/s", "Earth rate; 0: none", 0.0, sets="motion.earth_rate"),
}
TORQUER = {"k": Option(0.0, "rad/s/A", "torquer scale factor for the reduction; 0: the parameter k of the gyro", 0.0)}


def one_of(name: str, *known: str) -> Callable[[str], str]:
    """Return the form of an option that is one of some words."""
    return partial(_one_of, name, known)


def _one_of(name: str, known: Sequence[str], text: str) -> str:
    return "" if text.lower() in known else f"{name} = {shorten(text)}: unknown; available: {', '.join(known)}"


def _of_corrections(text: str) -> str:
    from gyrobench.reduction.estimation.effects import misstated  # list and help need none of it

    return misstated(text)


def _of_supplies(text: str) -> str:
    from gyrobench.reduction.drift.supplies import misstated

    return misstated(text)


NUISANCES = {
    "nuisances": Option(
        "auto",
        str,
        "set-up effects (trend, temperature ...): weighed by the data (auto), or none",
        form=one_of("nuisances", "auto", "none"),
    ),
    "robust": Option(False, bool, "show a robust fit beside the plain one"),
}
TILTED = one_of("tilt", "auto", "yes", "no", "true", "false")
TILT = {
    "tilt": Option(
        "auto", str, "input-axis misalignment: estimated (yes), zero (no), or weighed by the data (auto)", form=TILTED
    )
}
CORRECTIONS = {
    "corrections": Option(
        "", str, "measured set-up errors, names as in the budget: SOURCE = VALUE(U) UNIT; ...", form=_of_corrections
    )
}
FOLD = {"fold": Option(False, bool, "accept that D_OO is folded into D_F, D_II and D_SS")}
SETTLE = {"settle": Option(10.0, "s", "wait before averaging, after each move", 0.0)}
ATTITUDE = {"attitude": Option("E U", str, "I and O (and S) axes: E, N, U, P, Q or minus these, or a matrix of rows")}


def type_b(*sources: str | Source | ModuleType, **meanings: str) -> dict[str, Option]:
    """Return the options u_NAME of sources: sizes of uncertainties of type B, SI, 0 unless a source says otherwise.

    sources: declared ones, the name of the option of a shared one without u_ (reduction.setup.sources), or a module of
    sources.  meanings: names whose meaning in this test is another one: ``axis="of each mount, about each axis"``.
    """
    known: list[Source] = []
    for s in sources:
        one = SHARED[f"u_{s}"] if isinstance(s, str) else s
        known += stating(vars(one)).values() if isinstance(one, ModuleType) else [one]
    known += [replace(SHARED[f"u_{n}"], doc=text) for n, text in meanings.items()]
    return {s.option: Option(s.default, s.unit.replace("²", "2"), s.meaning, 0.0) for s in known}


#: electrical supplies of the gyro  [GYRO-SUPPLY]
SUPPLY = {
    "supply_terms": Option(
        "",
        str,
        "what supplies do to the gyro (D_pickoff=0.1deg/h, D_US=1deg/h/g ...); empty: as set",
        form=_of_supplies,
    )
} | type_b("wheel_frequency", "wheel_voltage", "wheel_phase", "pickoff_excitation", "torquer_excitation")
