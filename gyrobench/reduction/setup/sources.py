"""Sources of error of the set-up: each is declared once, with all that the bench knows of it.

    TORQUER_SCALE.effect(setup, fit.error(-k * current))        # in a test: what an error of one unit does to its data

A source has an id; a name and a unit for the reader; the sign (note) of an error of one unit; the option that states
its standard uncertainty; and the handling errors that are its large form (gyrobench.reduction.diagnosis).  A part that
simulates it names its id (gyrobench.component.set_up).  From these follow, for every test that names the source: the
lines of the budget, the correction of a measured error, the weights of the fit, and the predicted shift of a simulated
error.  docs/guides/errors_of_the_set_up.md explains them to a metrologist.

A system has sources of its own by declaring them in its folder, in the same way.

The way of a statement ``--set u_axis=60arcsec``:

1. ``type_b("axis")`` (system.families.option_groups) makes the option; ``Setup.of`` (setups) takes its value, SI, into
   the field of the same name, which the setup of the test must have.
2. ``effects`` of the test pairs it with what one unit does to the data: :meth:`Source.effect`.
3. ``with_set_up`` (estimation.effects) puts size times error into the covariance of the data, but for a source that is
   relative to the reading, and takes corrections out of the data.
4. ``fit_result`` (estimation): gain of the fit times error (:meth:`Effect.changes`) times size joins u and interval;
   ``budget_lines`` prints it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from gyrobench.component.set_up import SINES
from gyrobench.reduction.setup.window_checks import ReductionError

if TYPE_CHECKING:
    from gyrobench.arrays import Array
    from gyrobench.component.set_up import Errors
    from gyrobench.reduction.estimation.findings import Findings

PHASES = ("phase 0°", "phase 90°")  # of a wobble
#: unit of a source that is relative to the reading (scale factor, nonlinearity, time base): its error holds the noise
#: of the data, which a covariance would take for information about it
RELATIVE = "1"
STATED = "positive where the stated one is too large"


@dataclass(frozen=True)
class Source:
    """A source of error of the set-up.

    id, name, note: may hold fields in braces, of several sources that are alike (:meth:`of`).  option: whose value, SI,
    is the standard uncertainty; "" where the test states it.  parts: of several independent errors of one size.  large:
    handling errors (diagnosis.handling_candidates) that are its large form.
    """

    id: str
    name: str
    unit: str
    option: str = ""
    note: str = ""
    parts: tuple[str, ...] = ()
    large: tuple[str, ...] = ()

    def of(self, **named: str) -> Source:
        """Return one of several sources that are alike: its fields filled in."""
        return replace(self, **{n: getattr(self, n).format(**named) for n in ("id", "name", "note")})

    def effect(self, sizes: Any, error: Array | None = None, **more: Any) -> Effect:
        """Return the source with what it does to the data of a test; see gyrobench.reduction.estimation.effects.

        sizes: the setup of the test, a mapping of its options, or the standard uncertainty itself, SI.
        """
        return Effect(self, self.size(sizes), error, **{"note": self.note, "parts": self.parts, **more})

    def size(self, sizes: Any) -> float:
        """Return the standard uncertainty that is stated, SI; 0 where none is."""
        if isinstance(sizes, (int, float)):
            return float(sizes)
        if isinstance(sizes, Mapping):
            return float(sizes.get(self.option, 0.0))
        if not hasattr(sizes, self.option):
            kind = type(sizes).__name__
            raise ReductionError(
                f"the source of error {self.id} takes its uncertainty from {self.option}, and the set-up {kind} has no "
                f"such field: write `{self.option}: float = 0.0` in {kind}"
            )
        return float(getattr(sizes, self.option))


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
        out: Array = np.atleast_2d(self.error) @ fit.gain.T
        return out

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
AXIS_POLE_EAST = Source("table.axis.pole.east", "table axis off the pole, about east", "rad", "u_axis")
AXIS_POLE_NORMAL = Source("table.axis.pole.normal", "table axis off the pole, about p × east", "rad", "u_axis")
AXIS_VERTICAL_EAST = Source("table.axis.vertical.east", "table axis off the vertical, about east", "rad", "u_axis")
AXIS_VERTICAL_NORTH = Source("table.axis.vertical.north", "table axis off the vertical, about north", "rad", "u_axis")
AXIS_LEVEL_POLE = Source("table.axis.level.pole", "table axis towards the pole", "rad", "u_axis")
AXIS_SERVO = Source("table.axis.servo.{axis}", "table axis about {axis}", "rad", "u_axis")  # of each phase
ATTITUDE_SERVO = Source("table.attitude", "attitude about the table axis", "rad", "u_axis")
OUTER_POLE_EAST = Source("outer.axis.pole.east", "outer axis off the pole, about east", "rad", "u_axis")
OUTER_POLE_NORMAL = Source("outer.axis.pole.normal", "outer axis off the pole, about p × east", "rad", "u_axis")
SQUARE = Source("table.square", "table axes out of the right angle", "rad", "u_square")
INNER_SQUARE = Source("inner.axis.square", "right angle of the table axes", "rad", "u_square")
WOBBLE = Source("table.wobble", "wobble of the table axis, twice a turn", "rad", "u_wobble", parts=PHASES)
WOBBLE_OF = Source(
    "{axis}.wobble", "wobble of the {axis} axis, twice a turn", "rad", "u_wobble", "unknown phase", PHASES
)
ROTATION = ("rotation", "angle_unit")
ANGLE_ONCE = Source("angle.once", "angle error, once a turn", "rad", "u_angle1", "encoder", SINES, ROTATION)
ANGLE_TWICE = Source("angle.twice", "angle error, twice a turn", "rad", "u_angle2", "encoder", SINES)
ANGLE_ONCE_OF = Source("{axis}.angle.once", "{axis} angle error, once a turn", "rad", "u_angle1", "encoder", SINES)
ANGLE_TWICE_OF = Source("{axis}.angle.twice", "{axis} angle error, twice a turn", "rad", "u_angle2", "encoder", SINES)
ANGLE_OF = {"once": ANGLE_ONCE_OF, "twice": ANGLE_TWICE_OF}
UNBALANCE = Source(
    "servo.unbalance", "unbalance over stiffness", "rad", "u_unbalance", "angle at 1 g across the axis",
    ("mass along z", "mass along y"),
)  # fmt: skip
TIME_BASE = Source("time_base", "time base", RELATIVE, "u_time", "relative", large=("time_unit",))

# ------------------------------------------------------------------------------------------------ the instrument on it
INPUT_TO_OUTPUT = Source("mount.3", "input axis towards output axis", "rad", "u_mount")
INPUT_TO_SPIN = Source("mount.input_to_spin", "input axis towards spin axis", "rad", "u_mount")
TURNED = {
    axis: Source(f"mount.{k}", f"gyro turned about its {axis} axis", "rad", "u_mount")
    for axes in (("input", "output", "spin"), ("x", "y", "z"))
    for k, axis in enumerate(axes, 1)
}
REMOUNT = Source("mount.scatter", "drift from mount to mount", "rad/s", "u_remount", "of each mount by itself")
LATITUDE = Source("latitude", "latitude", "rad", "u_latitude", STATED, large=("hemisphere",))
GRAVITY = Source("gravity", "gravity", "m/s²", "u_gravity")

# ------------------------------------------------------------------------------------------------ its supplies
#: departure of each at the start of the record; its drift over the record is a source beside it: :func:`drifting`
SUPPLIES = {
    name: Source(f"supply.{name}", title, unit, option, "departure from the nominal value, at the start")
    for name, title, unit, option in (
        ("frequency", "frequency of the wheel supply", RELATIVE, "u_wheel_frequency"),
        ("voltage", "voltage of the wheel supply", RELATIVE, "u_wheel_voltage"),
        ("phase", "phases of the wheel supply", "rad", "u_wheel_phase"),
        ("pickoff", "excitation of the pickoff", RELATIVE, "u_pickoff_excitation"),
        ("torquer", "excitation of torquer or suspension", RELATIVE, "u_torquer_excitation"),
    )
}


def drifting(source: Source) -> Source:
    """Return the drift of a supply, whose change over the record is as uncertain as its departure at the start."""
    unit, note = "rad/s" if source.unit == "rad" else "1/s", "over the record as uncertain as at the start"
    return replace(source, id=f"{source.id}.drift", name=f"{source.name}, drift", unit=unit, option="", note=note)


# ------------------------------------------------------------------------------------------------ current and readings
TORQUER_SCALE = Source(
    "torquer.scale_factor", "torquer scale factor", RELATIVE, "u_scale_factor", f"relative, {STATED}",
    large=("current_unit",),
)  # fmt: skip
TORQUER_NONLINEARITY = Source(
    "torquer.nonlinearity", "torquer nonlinearity", RELATIVE, "u_nonlinearity",
    "relative departure from proportionality at {full}",
)  # fmt: skip
CURRENT_OFFSET = Source("current.offset", "offset of the current reading", "A", "u_current", large=("current_sign",))
CURRENT_RESOLUTION = Source("current.resolution", "resolution of the current reading", "A", note="as if never dithered")
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
