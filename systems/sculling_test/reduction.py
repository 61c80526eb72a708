"""Reduction of the sculling test: mean acceleration that the user computes in each motion, against the rest between.

    a_i = b + sum_k d_k [reading in the motion k] + noise

A linear fit under an estimated noise model, with a trend weighed by the data.  Beside the estimates stands what the
closed form makes of the stated filters, output rate, algorithm and size effect with instruments without error.
[TEST-SCULLING; Savage 1998b]

Not modelled: motion along other axes, angle and vibration that are no sines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gyrobench.frames import G0
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.level_shift import jumped
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.setup.run_metadata import Location, with_plan
from gyrobench.reduction.setup.setups import Setup, weighed
from gyrobench.reduction.setup.sources import GRAVITY, TIME_BASE, Effect
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Findings, Group, Quantity, Record, plain, told
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table
from gyrobench.system.families.strapdown_motion import FACES
from gyrobench.units import DEG

from . import mistakes
from .closed import ScullingMotion, UnitErrors, VelocityChain, reading
from .sources import ANGLE, PHASE, VIBRATION

COLUMNS = ("t_start", "t_end", "frequency", "angle", "vibration", "acceleration")
LEAST = 2  # readings at rest, and in each motion
UG = 1e-6 * G0


@dataclass(frozen=True, kw_only=True)
class ScullingSetup(Setup):
    """chain: as stated.  nuisances: trend and temperature are weighed.  truth: by the name of a coefficient, m/s2."""

    chain: VelocityChain
    nuisances: bool = True


@dataclass(frozen=True)
class Motions:
    """Motions of a record; of each reading the number of its motion, -1 at rest."""

    motions: tuple[ScullingMotion, ...]
    number: Array

    @classmethod
    def of(cls, windows: Mapping[str, Array]) -> Motions:
        rows = zip(*(np.asarray(windows[n], dtype=float).tolist() for n in COLUMNS[2:5]), strict=True)
        given = [ScullingMotion(f, angle, a) if f and (angle or a) else None for f, angle, a in rows]
        motions = tuple(sorted({m for m in given if m}, key=lambda m: (m.frequency, m.angle, m.vibration)))
        return cls(motions, np.array([motions.index(m) if m else -1 for m in given]))

    def names(self) -> list[str]:
        """Return the coefficients: d(5 Hz), with the amplitudes where a frequency has several."""
        alone = len({m.frequency for m in self.motions}) == len(self.motions)
        sizes = ["" if alone else f", {plain(m.angle / DEG, 4)}°, {plain(m.vibration, 4)} m/s²" for m in self.motions]
        return [f"d({m.frequency:g} Hz{x})".replace("-", "−") for m, x in zip(self.motions, sizes, strict=True)]


class Reduction(DriftReduction[ScullingSetup]):
    """Mean accelerations from windows with :data:`COLUMNS`."""

    handling = staticmethod(mistakes.candidates)

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        return cls.reduce(labelled(record), cls.setup_of(record.run))

    @classmethod
    def setup_of(cls, run: RunDocument) -> ScullingSetup:
        gravity = G0 if run.measured else Location.of(run).gravity
        chain = VelocityChain.of(run.options, gravity, float(run.step or 0.0))
        truth = None if run.measured else true_values(run, gravity)
        return ScullingSetup.of(run, chain=chain, truth=truth, nuisances=weighed(run))

    def problems(self) -> list[str]:
        w = self.windows
        if problems := window_problems(w, COLUMNS):
            return problems
        if np.any(np.asarray(w["frequency"], dtype=float) < 0.0):
            problems.append("frequency: 0 or above; antiphase is a negative vibration")
        if np.any(np.abs(np.asarray(w["angle"], dtype=float)) > 0.5):
            problems.append("angle: an amplitude of up to 0.5 rad (28.6°) is possible")
        motions = Motions.of(w)
        if np.count_nonzero(motions.number < 0) < LEAST:
            problems.append(f"fewer than {LEAST} readings at rest (frequency 0): bias and motion cannot be separated")
        for k, m in enumerate(motions.motions):
            if np.count_nonzero(motions.number == k) < LEAST:
                problems.append(f"fewer than {LEAST} readings at {m.frequency:g} Hz")
        if not motions.motions:
            problems.append("no reading has a motion: frequency, or angle and vibration, are 0 in all rows")
        return problems

    def regression(self) -> Regression:
        s, w, motions = self.setup, self.windows, Motions.of(self.windows)
        truth, number = s.truth or {}, motions.number
        quantities = [Quantity.of("b", "acceleration at rest", "ug", truth.get("b"))]
        for name, m in zip(motions.names(), motions.motions, strict=True):
            meaning = f"acceleration by sculling at {m.frequency:g} Hz"
            quantities.append(Quantity.of(name, meaning, "ug", truth.get(name)))
        X = np.column_stack([np.ones(number.size), *(number == k for k in range(len(motions.motions)))]).astype(float)
        t0, t1, f, y = (np.asarray(w[n], dtype=float) for n in ("t_start", "t_end", "frequency", "acceleration"))
        shown = [
            Group(label, np.flatnonzero(at), f[at], "frequency", "Hz")
            for label, at in (("at rest", number < 0), ("in motion", number >= 0))
        ]
        candidates = nuisances.common(w, of=nuisances.FORCE) if s.nuisances else ()
        return Regression(quantities, X, y, t0, t1, shown, "acceleration", "µg", UG, candidates=candidates)

    def effects(self, found: Findings) -> list[Effect]:
        """Return the sources: what another motion than the stated one does, by the closed form."""
        s, motions = self.setup, Motions.of(self.windows)

        def shift(**change: float) -> Array:
            rises = [_slope(s.chain, m, **change) for m in motions.motions]
            return found.error(np.array([rises[k] if k >= 0 else 0.0 for k in motions.number]))

        return [
            ANGLE.effect(s, shift(angle=1e-3)),
            VIBRATION.effect(s, shift(vibration=1e-3)),
            PHASE.effect(s, shift(phase=1e-3)),
            TIME_BASE.effect(s, found.error(-np.asarray(self.windows["acceleration"], dtype=float))),
            GRAVITY.effect(s, found.error(-np.ones(motions.number.size))),  # what is taken off
        ]

    def account(self, found: Findings) -> Account:
        c = self.setup.chain
        kind = "with sculling" if c.sculling else "integrals of the specific force"
        return Account(
            method="Angle and vibration in phase at known frequencies; least squares of the mean computed acceleration "
            "under an estimated noise model [TEST-SCULLING]",
            sources=["TEST-SCULLING; Savage 1998b; Roscoe 2001", "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23"],
            equation='"acceleration" = b + sum_k d_k',
            conventions=[
                "Acceleration: change of the computed velocity along the vertical by the time, gravity taken off.",
                "The accelerometer along the vertical reads −½ θ a − ¼ θ² g of a motion in which nothing rises; the "
                "user takes it back by the angle and the other accelerometer.",
                f"Stated: filters of {c.bandwidth:g} Hz (gyros) and {c.acc_bandwidth:g} Hz (accelerometers; 0: none), "
                f"an increment each {c.interval * 1e3:g} ms, {kind}; {c.samples} of them an update.",
            ],
            reasons=jumped(found),
            random="noise of the accelerometers",
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        largest = max(coefficients[1:], key=lambda c: abs(c.estimate)).name
        said = told(coefficients, f"Largest acceleration by sculling: {largest} = {{{largest}}}.")
        return [*said, found.noise_sentence("readings"), *found.nuisance_sentences()]

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        motions = Motions.of(self.windows)
        reasons: list[Reason] = list(mistakes.implausible(self.setup, motions, self.windows))
        if not reasons and self.setup.truth is None:
            reasons = list(mistakes.other_chain(self.setup, motions, self.windows))
        table = self.expected(result.coefficients)
        return replace(result, tables=[table, *result.tables], reasons=[*result.reasons, *reasons])

    def expected(self, coefficients: Sequence[Coefficient]) -> Table:
        """Return the accelerations against what the closed form makes of the stated chain."""
        s, motions = self.setup, Motions.of(self.windows)
        by = {c.name: c for c in coefficients}
        rows: list[list[Any]] = []
        for name, m in zip(motions.names(), motions.motions, strict=True):
            c, read = by[name], reading(m, s.chain.gravity) / UG
            stated = s.chain.rise(m) / UG
            rows.append([m.frequency, m.angle / DEG, m.vibration, read, c.estimate, c.u, stated, c.estimate - stated,
                         c.estimate / read])  # fmt: skip
        caption = (
            "reading: what the accelerometer along the vertical makes of the motion; stated: closed form for "
            "instruments without error; share: of the reading that is left, 1 where nothing of it is taken back"
        )
        head = [
            "f / Hz", "angle / °", "vibration / (m/s²)", "reading / µg", "acceleration / µg", "u / µg", "stated / µg",
            "difference / µg", "share",
        ]  # fmt: skip
        return Table("sculling.expected", "Acceleration by sculling", caption, head, rows)


def _slope(
    chain: VelocityChain, m: ScullingMotion, *, angle: float = 0.0, vibration: float = 0.0, phase: float = 0.0
) -> float:
    """Return the change of the computed acceleration by relative errors of the amplitudes (phase: rad), by that."""
    more, less = (
        replace(m, angle=m.angle * (1 + k * angle), vibration=m.vibration * (1 + k * vibration), phase=k * phase)
        for k in (1.0, -1.0)
    )
    return (chain.rise(more) - chain.rise(less)) / (2.0 * (angle + vibration + phase))


def labelled(record: Record) -> dict[str, Array]:
    """Return the windows with frequency, angle and vibration; of a run those of the plan."""
    windows = with_plan(record, frequency="target", angle="target_y")
    if not record.run.measured:
        windows["vibration"] = np.where(windows["frequency"], float(record.run.options["vibration"]), 0.0)
    return windows


def true_values(run: RunDocument, gravity: float) -> dict[str, float] | None:
    """Return what the parameters of a simulated unit make of the motions of the plan; None where they are not known."""
    p = run.parameters
    own = ("bandwidth", "acc_bandwidth", "period", "sculling")
    known = (
        "imu.gyro_scale",
        "imu.acc_scale",
        "imu.acc_bias",
        "table.levers",
        *(f"increments.{n}" for n in own),
        "user.samples",
    )
    if any(n not in p for n in known):
        return None
    step = float(run.step or 0.0)
    chain = VelocityChain(
        float(p["increments.period"]) or step, step, float(p["increments.bandwidth"]),
        float(p["increments.acc_bandwidth"]), bool(p["increments.sculling"]), int(p["user.samples"]), gravity=gravity,
    )  # fmt: skip
    face = FACES[str(run.options["axis"])]
    gyro, acc, levers = (
        face.T @ np.reshape(np.asarray(p[n], dtype=float), (3, 3)) @ face
        for n in ("imu.gyro_scale", "imu.acc_scale", "table.levers")
    )
    bias = face.T @ np.asarray(p["imu.acc_bias"], dtype=float)
    unit = UnitErrors(np.eye(3) + gyro, np.eye(3) + acc, bias, levers)
    vibration = float(run.options["vibration"])
    frequencies = sorted({row.target for row in run.plan} - {0.0})
    angle = float(run.options["angle"])
    return {f"d({f:g} Hz)": chain.rise(ScullingMotion(f, angle, vibration), unit) for f in frequencies}
