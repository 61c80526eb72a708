"""Sources of error of the set-up: each is declared once, with all that the bench knows of it.

    class Reduction(RestTest):                                  # a source of one test, in one place
        @Source("fixture.level", "fixture off level, about east", "rad", "u_level", parameter="table.tilt[1]")
        def level(self, found): return -self.believed(found, leaning)      # error of the data for one unit

    TORQUER_SCALE.effect(setup, fit.error(-k * current))        # of several tests: declared below, used in effects()

A source has an id; a name and a unit for the reader; the sign (note) of an error of one unit; the option that states
its standard uncertainty, with its meaning; the parameter of a part that simulates it, or a part that names its id
(gyrobench.component.set_up); and the handling errors that are its large form (gyrobench.reduction.diagnosis).  From
these follow, for every test that names the source: the option, the lines of the budget, the correction of a measured
error, the weights of the fit, and the predicted shift of a simulated error.
docs/guides/errors_of_the_set_up.md explains them to a metrologist.

The way of a statement ``--set u_axis=60arcsec``:

1. The option is that of the source: of one that a reduction declares by itself (System.options); of a shared one, or of
   a reduction in a module of its own, by ``type_b("axis")`` or ``type_b(SOURCE)`` (system.families.option_groups).
   ``Setup.of`` (setups) takes all of them, SI, into ``sizes``.
2. The source is paired with what one unit does to the data: :meth:`Source.effect`.
3. ``with_set_up`` (estimation.effects) puts size times error into the covariance of the data, but for a source that is
   relative to the reading, and takes corrections out of the data.
4. ``fit_result`` (estimation): gain of the fit times error (:meth:`Effect.changes`) times size joins u and interval;
   ``budget_lines`` prints it.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from gyrobench.component.set_up import SINES

if TYPE_CHECKING:
    from gyrobench.arrays import Array
    from gyrobench.component.set_up import Errors
    from gyrobench.reduction.estimation.findings import Findings

Sensitivity = TypeVar("Sensitivity", bound=Callable[..., Any])
PHASES = ("phase 0°", "phase 90°")  # of a wobble
#: unit of a source that is relative to the reading (scale factor, nonlinearity, time base): its error holds the noise
#: of the data, which a covariance would take for information about it
RELATIVE = "1"
STATED = "positive where the stated one is too large"


@dataclass(frozen=True)
class Source:
    """A source of error of the set-up.

    id, name, note, doc: may hold fields in braces, of several sources that are alike (:meth:`of`).  option: whose
    value, SI, is the standard uncertainty; "" where the test states it.  parts: of several independent errors of one
    size.  large: handling errors (diagnosis.handling_candidates) that are its large form.  doc, default: of the option;
    without doc it states the standard uncertainty of the name.
    parameter: "slot.name" or "slot.name[k]" whose value is the error, of a part that does not name the id itself.
    """

    id: str
    name: str
    unit: str
    option: str = ""
    note: str = ""
    parts: tuple[str, ...] = ()
    large: tuple[str, ...] = ()
    doc: str = ""
    default: float | str = 0.0
    parameter: str = ""

    def names(self, text: str) -> bool:
        """Return whether a text is a name or an id of it, of one that is alike, or of a part of it."""
        ends = "|".join(map(re.escape, self.parts)) or ".+"
        forms = {self.name: rf"(, .+)?( \(({ends})\))?", self.id: r"(\..+)?"}
        return any(re.fullmatch(re.sub(r"\\{\w+\\}", ".+", re.escape(n)) + end, text) for n, end in forms.items())

    def of(self, **named: str) -> Source:
        """Return one of several sources that are alike: its fields filled in."""
        return replace(self, **{n: getattr(self, n).format(**named) for n in ("id", "name", "note", "doc")})

    def __call__(self, sensitivity: Sensitivity) -> Sensitivity:
        """Declare a method (self, found) of a reduction as what an error of one unit does to the data of its test."""
        sensitivity.source = self  # type: ignore[attr-defined]
        return sensitivity

    @property
    def meaning(self) -> str:
        """What the option states."""
        return self.doc or f"{'relative ' * (self.unit == RELATIVE)}standard uncertainty of the {self.name}"

    def effect(self, sizes: Any, error: Array | None = None, **more: Any) -> Effect:
        """Return the source with what it does to the data of a test; see gyrobench.reduction.estimation.effects.

        sizes: the setup of the test, a mapping of its options, or the standard uncertainty itself, SI.
        """
        if self.parameter:
            more = {"simulated": self._simulated(getattr(sizes, "parameters", {})), **more}
        return Effect(self, self.size(sizes), error, **{"note": self.note, "parts": self.parts, **more})

    def size(self, sizes: Any) -> float:
        """Return the standard uncertainty that is stated, SI; 0 where none is."""
        if isinstance(sizes, (int, float)):
            return float(sizes)
        stated: Mapping[str, float] = sizes if isinstance(sizes, Mapping) else sizes.sizes
        return float(stated.get(self.option, 0.0))

    def _simulated(self, parameters: Mapping[str, Any]) -> tuple[float, ...]:
        """Return the error that :attr:`parameter` has in a simulated run, SI; () where it has none."""
        name, _, index = self.parameter.partition("[")
        if name not in parameters:
            return ()
        value = parameters[name]
        return (float(np.ravel(value)[int(index.rstrip("]")) - 1]),) if index else tuple(np.ravel(value).tolist())


def declared(reduction: Any) -> dict[str, Source]:
    """Return the sources that a class declares by itself or inherits: name of the method -> source, in their order."""
    found: dict[str, Source] = {}
    for klass in reversed(getattr(reduction, "__mro__", ())):
        for name, value in vars(klass).items():
            if isinstance(source := getattr(value, "source", None), Source):
                found[name] = source
    return found


def known(reduction: Any, package: str) -> list[Source]:
    """Return the sources that a reduction declares, and those in the modules of its package and of the bench."""
    modules = [m for n, m in [*sys.modules.items()] if n.startswith(("gyrobench.reduction", package))]
    there = [v for m in modules for v in vars(m).values()]
    there += [v for group in there if isinstance(group, dict) for v in group.values()]
    return [*declared(reduction).values(), *(v for v in there if isinstance(v, Source))]


@dataclass(frozen=True)
class Effect:
    """What one source does to the data of a test: its standard uncertainty, and the error of the data for one unit.

    error: (n,), as :meth:`Findings.error` gives it, with the sign of a set-up that is off by one unit while the
    reduction knows nothing of it, or of a reading or a stated value (scale factor, latitude) that is too large by one;
    (m, n) for m errors of this size that have nothing to do with one another, which ``parts`` names.  values: (q,)
    change of the reported values, of a source that is not in the data.  simulated: the error of each part that a
    simulated set-up has, where no part of the bench declares it.  needed: why nothing passes without its size; "" where
    it may be left out.
    """

    kind: Source
    size: float
    error: Array | None
    note: str = ""
    parts: tuple[str, ...] = ()
    values: Array | None = None
    simulated: tuple[float, ...] = ()
    needed: str = ""

    @property
    def id(self) -> str:
        return self.kind.id

    @property
    def source(self) -> str:
        """Name of the source."""
        return self.kind.name

    @property
    def unit(self) -> str:
        return self.kind.unit

    def changes(self, fit: Findings) -> Array:
        """Return the change (m, q) of the reported values for one unit of each part, SI."""
        if self.error is None:
            return np.atleast_2d(np.zeros(fit.value.size) if self.values is None else self.values)
        return np.asarray(np.atleast_2d(self.error) @ fit.gain.T)

    @property
    def names(self) -> list[str]:
        """Names of the parts, as a correction uses them; none for parts that have no name."""
        return self._each(self.source, " ({})")

    @property
    def ids(self) -> list[str]:
        """Return the ids of the parts, as :attr:`names`."""
        return self._each(self.id, ".{}")

    def _each(self, whole: str, part: str) -> list[str]:
        if self.error is None:
            return []
        return [whole] if np.ndim(self.error) == 1 else [whole + part.format(p) for p in self.parts]

    def errors(self, simulated: Errors) -> list[float]:
        """Return the error of each part that is simulated, SI: by the effect itself, or by a part of the bench."""
        if self.simulated:
            return list(self.simulated)
        given = simulated.get(self.id, 0.0)
        if self.error is None or self.error.ndim == 1:
            return [given if isinstance(given, float) else 0.0]
        return [given.get(p, 0.0) if isinstance(given, dict) else given for p in self.parts]


# ------------------------------------------------------------------------------------------------ the table
AXIS_POLE_EAST = Source(
    "table.axis.pole.east", "table axis off the pole, about east", "rad", "u_axis",
    doc="standard uncertainty of the table axis against the pole",
)  # fmt: skip
AXIS_POLE_NORMAL = Source("table.axis.pole.normal", "table axis off the pole, about p × east", "rad", "u_axis")
AXIS_VERTICAL_EAST = Source("table.axis.vertical.east", "table axis off the vertical, about east", "rad", "u_axis")
AXIS_VERTICAL_NORTH = Source("table.axis.vertical.north", "table axis off the vertical, about north", "rad", "u_axis")
AXIS_LEVEL_POLE = Source("table.axis.level.pole", "table axis towards the pole", "rad", "u_axis")
AXIS_SERVO = Source("table.axis.servo.{axis}", "table axis about {axis}", "rad", "u_axis")  # of each phase
ATTITUDE_SERVO = Source("table.attitude", "attitude about the table axis", "rad", "u_axis")
OUTER_POLE_EAST = Source("outer.axis.pole.east", "outer axis off the pole, about east", "rad", "u_axis")
OUTER_POLE_NORMAL = Source("outer.axis.pole.normal", "outer axis off the pole, about p × east", "rad", "u_axis")
SQUARE = Source(
    "table.square", "table axes out of the right angle", "rad", "u_square",
    doc="standard uncertainty of the right angle between the table axes",
)  # fmt: skip
INNER_SQUARE = Source("inner.axis.square", "right angle of the table axes", "rad", "u_square")
WOBBLE = Source(
    "table.wobble", "wobble of the table axis, twice a turn", "rad", "u_wobble", parts=PHASES,
    doc="wobble of a table axis twice a turn, std. unc. of its amplitude",
)  # fmt: skip
WOBBLE_OF = Source(
    "{axis}.wobble", "wobble of the {axis} axis, twice a turn", "rad", "u_wobble", "unknown phase", PHASES
)
ROTATION = ("rotation", "angle_unit")
ANGLE_ONCE = Source(
    "angle.once", "angle error, once a turn", "rad", "u_angle1", "encoder", SINES, ROTATION,
    "error of the angle readings once a turn, std. unc. of its amplitude",
)  # fmt: skip
ANGLE_TWICE = Source(
    "angle.twice", "angle error, twice a turn", "rad", "u_angle2", "encoder", SINES,
    doc="error of the angle readings twice a turn, std. unc. of its amplitude",
)  # fmt: skip
ANGLE_ONCE_OF = Source("{axis}.angle.once", "{axis} angle error, once a turn", "rad", "u_angle1", "encoder", SINES)
ANGLE_TWICE_OF = Source("{axis}.angle.twice", "{axis} angle error, twice a turn", "rad", "u_angle2", "encoder", SINES)
ANGLE_OF = {"once": ANGLE_ONCE_OF, "twice": ANGLE_TWICE_OF}
UNBALANCE = Source(
    "servo.unbalance", "unbalance over stiffness", "rad", "u_unbalance", "angle at 1 g across the axis",
    ("mass along z", "mass along y"), doc="angle by unbalance of the table at 1 g over the stiffness, std. unc.",
)  # fmt: skip
TIME_BASE = Source("time_base", "time base", RELATIVE, "u_time", "relative", large=("time_unit",))

# ------------------------------------------------------------------------------------------------ the instrument on it
INPUT_TO_OUTPUT = Source(
    "mount.3", "input axis towards output axis", "rad", "u_mount",
    doc="standard uncertainty of the gyro axes against the fixture",
)  # fmt: skip
INPUT_TO_SPIN = Source("mount.input_to_spin", "input axis towards spin axis", "rad", "u_mount")
TURNED = {
    axis: Source(f"mount.{k}", f"gyro turned about its {axis} axis", "rad", "u_mount")
    for axes in (("input", "output", "spin"), ("x", "y", "z"))
    for k, axis in enumerate(axes, 1)
}
#: the same of a gyro that stands in one attitude
IN_ATTITUDE = {
    axis: replace(source, option="u_attitude", doc="standard uncertainty of the attitude about each gyro axis")
    for axis, source in TURNED.items()
}
REMOUNT = Source(
    "mount.scatter", "drift from mount to mount", "rad/s", "u_remount", "of each mount by itself",
    doc="std. unc. of the drift from mount to mount, where the plan does not show it",
)  # fmt: skip
LATITUDE = Source("latitude", "latitude", "rad", "u_latitude", STATED, large=("hemisphere",))
GRAVITY = Source("gravity", "gravity", "m/s²", "u_gravity", doc="standard uncertainty of gravity")

# ------------------------------------------------------------------------------------------------ its supplies
#: departure of each at the start of the record; its drift over the record is a source beside it: :func:`drifting`
_SUPPLIES = {
    "frequency": ("frequency of the wheel supply", RELATIVE, "u_wheel_frequency", "relative std. unc. of the wheel's "
                  "frequency, and of its change over the record"),
    "voltage": ("voltage of the wheel supply", RELATIVE, "u_wheel_voltage", "relative std. unc. of the wheel's "
                "voltage, and of its change over the record"),
    "phase": ("phases of the wheel supply", "rad", "u_wheel_phase", "std. unc. of the phases of the wheel's supply, "
              "and of its change over the record"),
    "pickoff": ("excitation of the pickoff", RELATIVE, "u_pickoff_excitation", "relative std. unc. of the pickoff's "
                "excitation, and of its change over the record"),
    "torquer": ("excitation of torquer or suspension", RELATIVE, "u_torquer_excitation", "the same of the excitation "
                "of torquer or suspension"),
}  # fmt: skip
SUPPLIES = {
    name: Source(f"supply.{name}", title, unit, option, "departure from the nominal value, at the start", doc=doc)
    for name, (title, unit, option, doc) in _SUPPLIES.items()
}


def drifting(source: Source) -> Source:
    """Return the drift of a supply, whose change over the record is as uncertain as its departure at the start."""
    unit, note = "rad/s" if source.unit == "rad" else "1/s", "over the record as uncertain as at the start"
    return replace(source, id=f"{source.id}.drift", name=f"{source.name}, drift", unit=unit, option="", note=note)


# ------------------------------------------------------------------------------------------------ current and readings
TORQUER_SCALE = Source(
    "torquer.scale_factor",
    "torquer scale factor",
    RELATIVE,
    "u_scale_factor",
    f"relative, {STATED}",
    large=("current_unit",),
)
TORQUER_NONLINEARITY = Source(
    "torquer.nonlinearity", "torquer nonlinearity", RELATIVE, "u_nonlinearity",
    "relative departure from proportionality at {full}",
    doc="relative torquer nonlinearity at the largest current, standard unc.",
)  # fmt: skip
CURRENT_OFFSET = Source(
    "current.offset", "offset of the current reading", "A", "u_current", large=("current_sign",),
    doc="standard uncertainty of the zero of the current meter",
)  # fmt: skip
CURRENT_RESOLUTION = Source("current.resolution", "resolution of the current reading", "A", note="as if never dithered")
GYRO_WORD = Source("gyro.word", "word of the gyro", "rad/s", note="as far as its noise does not dither it")
#: of a gyro with two channels: the torquer about an axis, and the meter of its current
TORQUER_SCALE_OF = replace(
    TORQUER_SCALE, id="torquer.{axis}.scale_factor", name="scale factor of the torquer about {axis}"
)
TORQUER_NONLINEARITY_OF = replace(
    TORQUER_NONLINEARITY, id="torquer.{axis}.nonlinearity", name="nonlinearity of the torquer about {axis}"
)
CURRENT_OFFSET_OF = replace(CURRENT_OFFSET, id="current.{axis}.offset", name="zero of the {axis} current meter")
CURRENT_RESOLUTION_OF = replace(
    CURRENT_RESOLUTION, id="current.{axis}.resolution", name="resolution of the {axis} current meter"
)
VOLTMETER = Source("voltmeter.scale", "voltmeter", RELATIVE, "u_voltage", "relative")

#: reading of the rate of a vibrating table; input axis of a gyro on it
READING_GAIN = Source(
    "table.reading.gain", "gain of the reading of the table rate", "1", "u_gain", "reading too large",
    doc="relative standard uncertainty of the reading of the table rate",
)  # fmt: skip
READING_LAG = Source(
    "table.reading.lag", "lag of the reading of the table rate", "s", "u_lag", "reading late",
    doc="standard uncertainty of the time by which that reading is late",
)  # fmt: skip
COSINE = Source("mount.cosine", "cosine of the input axis against the table axis", "1", "u_mount", "second order")

# ------------------------------------------------------------------------------------------------ pulses of a rebalance
PULSE_ASYMMETRY = Source(
    "pulse.asymmetry", "asymmetry of the pulse currents", "A", "u_pulse", "positive less negative current",
    doc="standard uncertainty of the positive less the negative current of a pulse rebalance",
)  # fmt: skip
PULSE_MEAN = Source("pulse.mean", "mean of the pulse currents", "A", note="part of the torquer scale factor")
PULSE_LATE = Source(
    "pulse.late", "switching time of the pulses", "s", "u_switching", "edges too late",
    doc="standard uncertainty of the switching time of a pulse rebalance",
)  # fmt: skip
PULSE_GROWING = Source(
    "pulse.growing", "switching time, proportional to the current", "s", "u_switching", "at full current"
)
PULSE_CURVED = Source(
    "pulse.curved", "switching time, by the square of the current", "s", "u_switching", "at full current"
)
PULSE_RESOLUTION = Source("pulse.resolution", "resolution of the counts", "1")
PULSES = (PULSE_ASYMMETRY, PULSE_MEAN, PULSE_LATE, PULSE_GROWING, PULSE_CURVED, PULSE_RESOLUTION)


def stating(names: Mapping[str, Any]) -> dict[str, Source]:
    """Return the first source of each option that a module's names hold, or tables of them: option -> source."""
    found: dict[str, Source] = {}
    for value in names.values():
        for s in value.values() if isinstance(value, dict) else (value,):
            if isinstance(s, Source) and s.option:
                found.setdefault(s.option, s)
    return found


SHARED = stating(dict(vars()))
