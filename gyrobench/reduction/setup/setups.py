"""Where and how a record was taken: what the reductions of several tests must know beside its windows.

@dataclass(frozen=True)
class TwoAxisSetup(RebalanceSetup):
    k: float
    m: int = 5
setup = TwoAxisSetup.of(record.run, k=..., m=...)
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np

from gyrobench import drift, frames, units
from gyrobench.arrays import Array
from gyrobench.attitudes import parse
from gyrobench.component.set_up import Errors
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.run_metadata import Location, Remount, phases, remount_of, sizes
from gyrobench.reduction.setup.simulated_errors import simulated_errors
from gyrobench.reduction.setup.stops import REST, stop_problems
from gyrobench.reduction.setup.window_checks import ReductionError

STEPS = ("resolution", "counting", "dead_band", "lock_in")  # parameters of parts: size of steps and bands, 0: none


@dataclass(frozen=True, kw_only=True)
class Setup:
    """truth: simulated values, SI (of coefficients rad/s per g0^n).  errors: of a simulated set-up, by source.
    corrections: measured errors of the set-up (estimation.effects).  robust: a robust fit is shown beside.

    sizes: standard uncertainties of type B, SI, by option, "u_axis"; a source takes its own (:meth:`Source.size`).
    parameters: of the parts of a simulated run, SI, for sources that name one.  simulated: by a run, whose truth may
    not be known.
    """

    simulated: bool = False
    truth: Mapping[str, float] | None = None
    instrument: str = ""
    errors: Errors = field(default_factory=dict)
    corrections: str = ""
    robust: bool = False
    site: Mapping[str, Any] = field(default_factory=dict)  # as printed
    remount: Remount | None = None  # drift from mount to mount; None: the test has no mounts
    sizes: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        """Return the setup that a run.json describes; ``own``: the fields that are the test's own."""
        shared: dict[str, Any] = {"instrument": run.instrument, "corrections": run.options.get("corrections", "")}
        shared["errors"] = simulated_errors(run)
        shared["robust"] = bool(run.options.get("robust", False))
        shared["sizes"] = sizes(run.options)
        shared["parameters"] = {} if run.measured else run.parameters
        shared["simulated"] = not run.measured
        return cls(**{**shared, **own})

    @property
    def shown(self) -> dict[str, Any]:
        """Return the site as a report prints it."""
        return dict(self.site)

    @property
    def in_steps(self) -> bool:
        """True where a part of a simulated run reads in steps or leaves rates unanswered, which may take all noise from
        its data.
        """
        steps = (v for n, v in self.parameters.items() if n.rpartition(".")[2] in STEPS)
        return any(float(np.max(v)) > 0.0 for v in steps)

    def stated(self) -> dict[str, Any]:
        """Return the fields of a result that say where, and of which instrument."""
        return {"site": self.shown, "instrument": self.instrument}


@dataclass(frozen=True, kw_only=True)
class SiteSetup(Setup):
    """A test at a site: latitude rad, gravity m/s2, earth_rate rad/s.  nuisances: set-up effects that may be in the
    data are weighed (gyrobench.reduction.estimation.nuisances).
    """

    latitude: float
    gravity: float
    earth_rate: float = frames.EARTH_RATE
    nuisances: bool = True

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        site = Location.of(run)
        place: dict[str, Any] = {"latitude": site.latitude, "gravity": site.gravity, "earth_rate": site.earth_rate}
        place["nuisances"] = weighed(run)
        return super().of(run, **{**place, **own})

    @property
    def place(self) -> Location:
        return Location(self.latitude, self.gravity, self.earth_rate)

    def site_problems(self) -> list[str]:
        """Return what is wrong with latitude and gravity, as sentences."""
        return frames.latitude_problems(self.latitude) + frames.gravity_problems(self.gravity)

    @property
    def shown(self) -> dict[str, Any]:
        return self.place.shown()

    @property
    def gamma(self) -> float:
        """Gravity in multiples of g0."""
        return self.gravity / frames.G0


@dataclass(frozen=True, kw_only=True)
class RebalanceSetup(SiteSetup):
    """A gyro in torque rebalance under gravity of one size.

    fold: squares that cannot be told apart may be there and are folded into others.  polarity: "project" k i = omega_IA
    - omega_d, or "book" k i = omega_d - omega_IA.
    """

    fold: bool = False
    polarity: str = "project"
    remount: Remount | None = field(default_factory=Remount)

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        options: dict[str, Any] = {"fold": bool(run.options.get("fold", False)), "polarity": run.polarity or "project"}
        options["remount"] = remount_of(run)
        return super().of(run, **{**options, **own})

    def problems(self, folding: bool = True) -> list[str]:
        """Return what is wrong with gravity and polarity, and, with ``folding``, with squares that are simulated."""
        problems = frames.gravity_problems(self.gravity)
        if self.polarity not in ("project", "book"):
            known = "'project' (k i = ω_IA − ω_d) and 'book' (k i = ω_d − ω_IA)"
            problems.append(f"polarity '{self.polarity}' unknown; there are {known}")
        return problems + (drift.fold_problems(self.truth or {}) if folding and not self.fold else [])

    def sign_conventions(self, k: float) -> list[str]:
        """Return how signs are meant, as sentences of a report; k: torquer scale factor, rad/s/A."""
        book = "k i = ω_d − ω_IA as in Hu 1981, sign inverted at entry"
        sign = "k i = ω_IA − ω_d" if self.polarity == "project" else book
        return [
            "Drift ω_d in precession sign; for the sign of an indicated rate invert the sign of all coefficients.",
            "X, Y, Z = −f/g0 along the input, output and spin reference axes (sign of Hu 1981: a body axis that "
            "points up reads −1); g0 = 9.80665 m/s². Against +f/g0 the linear coefficients change sign.",
            f"Torquer current: {sign}; k = {plain(k * 1e-3 / units.DPH, 6)} °/h/mA.",
        ]


@dataclass(frozen=True, kw_only=True)
class TurningSetup(RebalanceSetup):
    """A tumble on a table whose axis lies along the pole; matrices with rows = axes.

    base: table axes in (E, N, U) at angle 0.  faces: phase -> gyro axes in table axes.  modes: phase -> "rate", "step"
    (at rest at one angle after the other) or "dwell" (None: by the direction of the second gyro axis).  tilt: small
    angles of the gyro are estimated with the coefficients (True), taken as zero (False), or among the nuisances, which
    the data weigh (None).
    """

    faces: Mapping[int, Array]
    base: Array = field(default_factory=lambda: np.empty((0, 0)))  # empty: table axis on the pole
    labels: Mapping[int, str] = field(default_factory=dict)
    modes: Mapping[int, str] | None = None
    tilt: bool | None = None

    def __post_init__(self) -> None:
        if np.size(self.base) == 0 and not frames.latitude_problems(self.latitude):
            object.__setattr__(self, "base", frames.polar_base(self.latitude))

    @classmethod
    def of_plan(cls, run: RunDocument, faces: Mapping[str, Array], **own: Any) -> Self:
        """Return the setup with the plan of run.json; faces: its mounts by name."""
        plan = phases(run, faces)
        of_run = {
            "faces": {p: faces[row.face] for p, row in plan.items()},
            "labels": {p: row.label for p, row in plan.items()},
            "modes": {p: row.mode if row.mode in ("rate", "step") else "dwell" for p, row in plan.items()},
            "tilt": TILTS[choice(run, "tilt", tuple(TILTS), "auto")],
        }
        return cls.of(run, **of_run, **own)

    def label(self, phase: int) -> str:
        return self.labels.get(phase, f"phase {phase}")

    def turns(self, phase: int) -> bool:
        """True where the table goes through its angles, turning or from stop to stop: by ``modes``, or where the second
        gyro axis is nearer to its axis than to the vertical.
        """
        if self.modes is not None and phase in self.modes:
            return self.modes[phase] != "dwell"
        second = np.asarray(self.faces[phase])[1]
        return bool(abs(second[2]) >= abs(second @ (np.asarray(self.base) @ frames.U)))

    def stops(self, phase: int) -> bool:
        """True where the table rests at one angle after the other."""
        return self.modes is not None and self.modes.get(phase) == "step"

    @property
    def intermittent(self) -> bool:
        """True where the table rests at its angles in every mount."""
        return all(self.stops(p) for p in self.faces if self.turns(p))

    def problems(self, folding: bool = True) -> list[str]:
        mounts = {f"mount of {self.label(p)}": face for p, face in self.faces.items()}
        return super().problems(folding) + frames.rotation_problems({"table base": self.base, **mounts})

    def sides(self, axis: int) -> set[float]:
        """Return the senses (1, -1) in which a gyro axis lies along the axis of the turning table."""
        return {float(np.sign(np.asarray(f)[axis, 2])) for p, f in self.faces.items() if self.turns(p)}

    def dwells(self) -> dict[int, float]:
        """Return the phases in which the table stands, with the sense (1 up, -1 down) of the second gyro axis."""
        up = np.asarray(self.base) @ frames.U
        return {p: float(np.sign(np.asarray(f)[1] @ up)) for p, f in self.faces.items() if not self.turns(p)}

    def table_problems(self, windows: Mapping[str, Array]) -> list[str]:
        """Missing phases, a table that stands still or turns where it should not, windows too wide."""
        phase = np.asarray(windows["phase"]).astype(int)
        present = set(phase.tolist())
        problems = [f"phase {p} ({self.label(p)}) is missing in the record" for p in self.faces if p not in present]
        problems += [
            f"phase {p} is in the record, but its mount is not given" for p in sorted(present - set(self.faces))
        ]
        start, end = (np.asarray(windows[f"angle_{e}"], dtype=float) for e in ("start", "end"))
        width = np.abs(end - start)
        times = [np.asarray(windows[f"t_{e}"], dtype=float) for e in ("start", "end")]
        for p in self.faces:
            largest = float(np.max(width[phase == p], initial=0.0))
            where = f"phase {p} ({self.label(p)}): "
            if p not in present:
                continue
            if self.stops(p):
                problems += [where + text for text in stop_problems(*(c[phase == p] for c in (start, end, *times)))]
            elif not self.turns(p):
                if largest > 1e-2:
                    problems.append(f"{where}the table turns by {plain(math.degrees(largest), 3)}° in a dwell")
            elif largest < 1e-3:
                text = f"{where}the table angle does not move, expected a turning table (rate 0?)"
                if np.ptp(start[phase == p]) > REST:
                    text += "; of a table that rested at each of these angles state stops = N, their number in a turn"
                problems.append(text)
            elif largest > 2.0 * math.pi / 5.0 * 1.001:
                problems.append(
                    f"{where}{plain(2 * math.pi / largest)} windows a turn, at least 5 are needed for two harmonics"
                )
        return problems


#: option tilt -> TurningSetup.tilt
TILTS = {"auto": None, "yes": True, "no": False, "true": True, "false": False}


def choice(run: RunDocument, option: str, known: tuple[str, ...], default: str) -> str:
    """Return an option that is one of some words.  Raises ReductionError."""
    word = str(run.options.get(option, default)).lower()
    if word not in known:
        raise ReductionError(f"{option} = {word}: unknown; available: {', '.join(known)}")
    return word


def weighed(run: RunDocument) -> bool:
    """Return the option nuisances: whether set-up effects are weighed.  Raises ReductionError."""
    return choice(run, "nuisances", ("auto", "none"), "auto") == "auto"


def scale_factor_problems(k: float, name: str = "k") -> list[str]:
    """Return what is wrong with the scale factor of a torquer, rad/s/A."""
    if math.isfinite(k) and k > 0.0:
        return []
    return [f"scale factor {name} = {k:g} rad/s/A: a finite positive number is expected; signs are in the readings"]


def attitude_of(run: RunDocument) -> Array:
    """Return the option attitude of a run as rows I, O, S in (E, N, U).  Raises ReductionError."""
    try:
        return parse(str(run.options.get("attitude", "")), Location.of(run).latitude)
    except ValueError as error:
        raise ReductionError(str(error)) from None
