"""Reduction of the coning test: drift of the attitude by each cone, along x, y and z, against the rest between them.

    drift_i = b_i q_i + sum_k d_ik [reading at the cone k] + noise

q is 1 at rest; on a cone the gyros lean, and of a bias cos theta is left along its axis, (1 + cos theta)/2 across it.
Each axis is a linear fit of its own under an estimated noise model, with a trend weighed by the data.  Beside the
estimates stands what the closed form makes of the stated filter, output rate and algorithm with gyros without error;
what is left of the drift are scale factors and misalignments.  [TEST-CONING; Goodman 1958]

Not modelled: cones that are no circles, drift that follows the inclination other than by the cone and that of a bias:
of a g-sensitivity as much is in u.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.estimation.level_shift import jumped
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.setup.run_metadata import with_plan
from gyrobench.reduction.setup.setups import Setup, weighed
from gyrobench.reduction.setup.sources import TIME_BASE, TURNED, Effect
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Findings, Group, Quantity, Record, plain, told
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table
from gyrobench.units import DEG, DPH

from . import mistakes
from .closed import AXES, Chain, cone_rate
from .sources import HALF_ANGLE, LEANING, TWIST

COLUMNS = ("t_start", "t_end", *(f"drift_{a}" for a in AXES))
LEAST = 2  # readings at rest, and at each cone


@dataclass(frozen=True, kw_only=True)
class ConingSetup(Setup):
    """axis: of the case along the cone's.  chain: as stated.  nuisances: trend and temperature are weighed.  truth: by
    the name of a coefficient, rad/s.
    """

    axis: str
    chain: Chain
    nuisances: bool = True


def hertz(f: float) -> str:
    """Return a frequency with its unit and sense."""
    return f"{f:g} Hz".replace("-", "−")


@dataclass(frozen=True)
class Cones:
    """Cones of a record: frequency (Hz) and half-angle (rad) of each; of each reading its number, -1 at rest."""

    cones: tuple[tuple[float, float], ...]
    number: Array

    @classmethod
    def of(cls, windows: Mapping[str, Array]) -> Cones:
        f, theta = (np.asarray(windows[n], dtype=float) for n in ("frequency", "half_angle"))
        pairs = [(float(a), float(b)) if a and b else None for a, b in zip(f, theta, strict=True)]
        cones = tuple(sorted({p for p in pairs if p}, key=lambda p: (abs(p[0]), p)))
        return cls(cones, np.array([cones.index(p) if p else -1 for p in pairs]))

    def names(self, axis: str) -> list[str]:
        """Return the coefficients along an axis: d_z(5 Hz), with the half-angle where a frequency has several."""
        alone = len({f for f, _ in self.cones}) == len(self.cones)
        angles = ["" if alone else f", {plain(theta / DEG, 4)}°" for _, theta in self.cones]
        return [f"d_{axis}({hertz(f)}{a})" for (f, _), a in zip(self.cones, angles, strict=True)]


class ConingAxis(DriftReduction[ConingSetup]):
    """Drift along one axis of the case."""

    def __init__(self, windows: Mapping[str, Array], setup: ConingSetup, axis: str) -> None:
        super().__init__(windows, setup)
        self.axis, self.cones = axis, Cones.of(windows)
        self.means = np.column_stack([np.asarray(windows[f"drift_{a}"], dtype=float) for a in AXES])

    def regression(self) -> Regression:
        s, c, number = self.setup, self.cones, self.cones.number
        truth, own = s.truth or {}, AXES.index(self.axis)
        quantities = [Quantity.of(f"b_{self.axis}", f"drift along {self.axis} at rest", "deg/h", truth.get("b"))]
        for name, (f, theta) in zip(c.names(self.axis), c.cones, strict=True):
            meaning = f"drift along {self.axis} by coning at {hertz(f)}, half-angle {plain(theta / DEG, 4)}°"
            quantities.append(Quantity.of(name, meaning, "deg/h", truth.get(name)))
        X = np.column_stack([self.mean_cosine, *(number == k for k in range(len(c.cones)))]).astype(float)
        t0, t1 = (np.asarray(self.windows[n], dtype=float) for n in ("t_start", "t_end"))
        shown = [
            Group("at rest" if k < 0 else "cones", np.flatnonzero(at), np.abs(self.frequency[at]), "frequency", "Hz")
            for k, at in ((-1, number < 0), (0, number >= 0))
        ]
        y = self.means[:, own]
        candidates = nuisances.common(self.windows, f" {self.axis}") if s.nuisances else ()
        return Regression(quantities, X, y, t0, t1, shown, "drift", candidates=candidates)

    @property
    def mean_cosine(self) -> Array:
        """Part (n,) of a bias that its axis, which goes round the cone, shows along its mean direction."""
        cosine = np.cos(np.where(self.cones.number >= 0, np.asarray(self.windows["half_angle"], dtype=float), 0.0))
        out: Array = cosine if self.axis == self.setup.axis else 0.5 * (1.0 + cosine)
        return out

    @property
    def frequency(self) -> Array:
        return np.asarray(self.windows["frequency"], dtype=float)

    @cached_property
    def by_cones(self) -> Array:
        """Drift (n, 3) of the cones alone, as the means of the readings at each have it."""
        rest = self.means[self.cones.number < 0].mean(axis=0)
        out = np.zeros_like(self.means)
        for k in range(len(self.cones.cones)):
            at = self.cones.number == k
            out[at] = self.means[at].mean(axis=0) - rest
        return out

    def effects(self, found: Findings) -> list[Effect]:
        """Return the sources: a case turned by e on its plate shows d - e x d; a twist counts while the plate cones;
        all drifts go by 1 - cos theta.
        """
        s, own, out = self.setup, AXES.index(self.axis), []
        for k, a in enumerate(AXES):
            change = -np.cross(np.eye(3)[k], self.by_cones)[:, own]
            if np.any(change):
                out.append(TURNED[a].effect(s, found.error(change)))
        if self.axis == s.axis:
            out.append(TWIST.effect(s, found.error(np.where(self.cones.number >= 0, 1.0, 0.0))))
        theta = np.asarray(self.windows["half_angle"], dtype=float)
        grown = theta / np.tan(np.where(theta, theta, 1.0) / 2.0)  # theta sin theta/(1 - cos theta)
        out.append(HALF_ANGLE.effect(s, found.error(self.by_cones[:, own] * grown)))
        rest = self.means[self.cones.number < 0].mean(axis=0)
        leans = 1.0 - np.cos(np.where(self.cones.number >= 0, theta, 0.0))
        out.append(LEANING.effect(float(np.max(np.abs(rest))), found.error(leans)))
        return [*out, TIME_BASE.effect(s, found.error(-self.means[:, own]))]

    def account(self, found: Findings) -> Account:
        s, a = self.setup, self.axis
        c = s.chain
        kind = "rotation vectors" if c.coning else "integrals of the rates"
        return Account(
            method="Cones of known half-angle and frequency; least squares of the drift along each axis under an "
            "estimated noise model [TEST-CONING]",
            sources=[
                "TEST-CONING; Goodman 1958; Bortz 1971; Miller 1983; Savage 1998",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation=f'"drift"_{a} = b_{a} + sum_k d_({a},k)',
            conventions=[
                "Drift: rotation of the computed attitude against the true one, along the mean axes of the case.",
                "A gyro on the axis of a cone reads −ω (1 − cos θ), to which no turn belongs; the coning of the two "
                "others takes it back.",
                f"Stated: filter of {c.bandwidth:g} Hz (0: none), an increment each {c.interval * 1e3:g} ms, "
                f"which are {kind}; {c.samples} of them an update.",
            ],
            reasons=jumped(found),
            random="noise of the gyros",
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence("readings"), *found.nuisance_sentences()]


class Reduction(ChannelTests[ConingSetup]):
    """Drift along three axes from windows with :data:`COLUMNS`, frequency and half_angle."""

    names = tuple(AXES)
    label = "{} axis"
    handling = staticmethod(mistakes.candidates)
    channel = ConingAxis

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        return cls.reduce(with_plan(record, frequency="target", half_angle="target_y"), cls.setup_of(record.run))

    @classmethod
    def setup_of(cls, run: RunDocument) -> ConingSetup:
        chain = Chain.of(run.options, float(run.step or 0.0))
        axis = str(run.options["axis"])
        truth = None if run.measured else true_values(run, axis)
        return ConingSetup.of(run, axis=axis, chain=chain, truth=truth, nuisances=weighed(run))

    def problems(self) -> list[str]:
        w = self.windows
        if problems := window_problems(w, COLUMNS):
            return problems
        if self.setup.axis not in AXES:
            return [f"axis = {self.setup.axis}: x, y or z is expected"]
        theta = np.asarray(w["half_angle"], dtype=float)
        if np.any(theta < 0.0) or np.any(theta > math.pi / 2):
            problems.append("half_angle: 0° to 90° are possible; the other sense is a negative frequency")
        cones = Cones.of(w)
        if np.count_nonzero(cones.number < 0) < LEAST:
            problems.append(f"fewer than {LEAST} readings at rest (frequency 0): nothing tells the bias from the cones")
        for k, (f, _) in enumerate(cones.cones):
            if np.count_nonzero(cones.number == k) < LEAST:
                problems.append(f"fewer than {LEAST} readings at {hertz(f)}")
        if not cones.cones:
            problems.append("no reading has a cone: frequency and half_angle are 0 in all rows")
        return problems

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        """Return the drift along the axis of the cone against what the closed form makes of the stated chain."""
        s, cones = self.setup, Cones.of(self.windows)
        by = {c.name: c for c in coefficients}
        rows: list[list[Any]] = []
        for name, (f, theta) in zip(cones.names(s.axis), cones.cones, strict=True):
            c, rate = by[name], cone_rate(f, theta) / DPH
            expected = float(s.chain.drift(f, theta, AXES.index(s.axis))[AXES.index(s.axis)]) / DPH
            rows.append([f, theta / DEG, rate, c.estimate, c.u, expected, c.estimate - expected, c.estimate / rate])
        caption = (
            "ω (1 − cos θ): what the gyro on the axis reads; stated: closed form for gyros without error; share: of "
            "the reading that is left as drift, −1 where no coning is computed"
        )
        head = [
            "f / Hz", "half-angle / °", "ω (1 − cos θ) / (°/h)", "drift / (°/h)", "u / (°/h)", "stated / (°/h)",
            "difference / (°/h)", "share",
        ]  # fmt: skip
        return [Table("coning.expected", "Drift along the axis of the cone", caption, head, rows)]

    def reasons(self) -> list[Reason]:
        found = list(mistakes.implausible(self.setup, Cones.of(self.windows), self.windows))
        if not found and self.setup.truth is None:
            found = list(mistakes.other_chain(self.setup, Cones.of(self.windows), self.windows))
        return found

    def overview(self, results: Mapping[str, DriftTestResult]) -> list[str]:
        """Return the largest drift along the axis of the cone, and across it."""
        every = [c for r in results.values() for c in r.coefficients if c.name.startswith("d_")]
        along = [c for c in every if c.name.startswith(f"d_{self.setup.axis}(")]
        across = [c for c in every if c not in along]
        said = [max(group, key=lambda c: abs(c.estimate)).name for group in (along, across)]
        return told(
            every, f"Largest drift along the axis of the cone: {said[0]} = {{{said[0]}}}.",
            f"Largest drift across it: {said[1]} = {{{said[1]}}}.",
        )  # fmt: skip


def true_values(run: RunDocument, axis: str) -> dict[str, float] | None:
    """Return the drift that the parameters of a simulated unit make by the closed form; None where it has none."""
    p = run.parameters
    known = ("imu.gyro_scale", *(f"increments.{n}" for n in ("bandwidth", "period", "coning")), "user.samples")
    if any(n not in p for n in known):
        return None
    chain = Chain(
        float(p["increments.period"]) or float(run.step or 0.0), float(run.step or 0.0),
        float(p["increments.bandwidth"]), bool(p["increments.coning"]), int(p["user.samples"]),
    )  # fmt: skip
    matrix = np.reshape(np.asarray(p["imu.gyro_scale"], dtype=float), (3, 3))
    cones = Cones.of({n: np.array([getattr(r, t) for r in run.plan])
                      for n, t in (("frequency", "target"), ("half_angle", "target_y"))})  # fmt: skip
    found: dict[str, float] = {}
    for k, (f, theta) in enumerate(cones.cones):
        drift = chain.drift(f, theta, AXES.index(axis), matrix)
        found |= {cones.names(a)[k]: float(d) for a, d in zip(AXES, drift, strict=True)}
    return found
