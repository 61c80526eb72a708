"""Reduction of the rate table test: scale factor error, asymmetry, cubic, hysteresis, bias; threshold, repeatability.

    y - w = b + e w + a abs(w)/2 + c w (w/R)2 + h d + noise          w = table rate + Earth rate along the axis

d is 1 where a rate was reached from below, -1 from above; R the largest rate.  By least squares under a noise model
estimated from the readings, with a trend and temperature weighed by the data.  Small rates are left out; of them the
ratio of response to rate says where the gyro begins to respond (threshold: half of it).  Where one of them is not
answered the readings at rest are left out, too: there the gyro does not answer the Earth rate.  Beside the fit the
line alone, the departures of each level from it, and the scale factor of each cycle.
[TEST-RATE-GYRO; IEEE 952, IEEE 647, IEEE 1431; RED-GLS]

Not modelled: hysteresis that is not the same at all rates, response of the gyro to the changes of rate, Earth rate
across the axis that a leaning input axis feels (it averages out over whole turns).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.reduction.drift import small_rates
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.level_shift import jumped
from gyrobench.reduction.estimation.unshown_columns import heating, intervals_with
from gyrobench.reduction.setup.rate_gyro_bias import bias_is_all, dithered, whole_angle, worded
from gyrobench.reduction.setup.sources import ANGLE_ONCE, ANGLE_TWICE, AXIS_VERTICAL_EAST, COSINE, LATITUDE, TIME_BASE
from gyrobench.reduction.toolkit import (
    Account,
    Array,
    Coefficient,
    DriftReduction,
    DriftTestResult,
    Effect,
    Findings,
    Group,
    Quantity,
    Record,
    Regression,
    RunDocument,
    SiteSetup,
    plain,
    told,
    window_problems,
)
from gyrobench.result import Reason
from gyrobench.units import DEG, DPH

from . import handling, residuals, tables
from .steps import cycle_of, direction, levels

LEAST = 8  # readings of the sweep
SHOWN = 0.01  # probability of a shape by chance, below which the report says what it changes
PERIOD = 0.5 * math.pi  # of the drift of a whole-angle gyro, in the angle of its pattern


@dataclass(frozen=True, kw_only=True)
class RateTableSetup(SiteSetup):
    """steps: of the plan of a run, 0 of a measured record, whose cycles are a column.  cosine: simulated, less 1.
    pattern: turn of the pattern of a simulated whole-angle gyro over that of its case, 0 of others.
    """

    steps: int = 0
    cosine: float = 0.0
    pattern: float = 0.0

    @property
    def earth(self) -> float:
        """Earth rate along the axis, rad/s."""
        return self.earth_rate * math.sin(self.latitude)


class Reduction(DriftReduction[RateTableSetup]):
    """Scale factor and its errors of a rate gyro."""

    handling = staticmethod(handling.candidates)

    @classmethod
    def setup_of(cls, run: RunDocument) -> RateTableSetup:
        steps = 0 if run.measured else int(run.options["steps"])
        mount = np.reshape(run.parameters.get("gyro.mount", np.eye(3)), (3, 3))
        gain = float(run.parameters.get("gyro.gain", 0.0)) if whole_angle(run.parameters) else 0.0
        return RateTableSetup.of(run, truth=truth_of(run), steps=steps, cosine=float(mount[0, 0]) - 1.0, pattern=gain)

    def problems(self) -> list[str]:
        s = self.setup
        problems = frames.latitude_problems(s.latitude)
        names = ("t_start", "t_end", "mean", *(("rate",) if "rate" in self.windows else ("angle_start", "angle_end")))
        problems += window_problems(self.windows, names)
        if problems:
            return problems
        self._read()
        if np.count_nonzero(self.large) < LEAST:
            problems.append(f"{np.count_nonzero(self.large)} readings of the sweep: at least {LEAST} are needed")
        elif np.unique(np.round(self.w[self.large] / self.full, 3)).size < 3:
            problems.append("fewer than three rates: no scale factor with its errors can be told from them")
        elif not (np.any(self.w > 0.1 * self.full) and np.any(self.w < -0.1 * self.full)):
            problems.append("rates of one sense only: the asymmetry needs both")
        return problems

    def _read(self) -> None:
        w = self.windows
        self.t0, self.t1, self.y = (np.asarray(w[n], dtype=float) for n in ("t_start", "t_end", "mean"))
        if "rate" in w:
            self.table = np.asarray(w["rate"], dtype=float)
        else:
            self.table = (np.asarray(w["angle_end"]) - np.asarray(w["angle_start"])) / (self.t1 - self.t0)
        self.w = self.table + self.setup.earth
        self.full = float(np.max(np.abs(self.table)))
        still = np.abs(self.table) < 1e-9 * max(self.full, 1e-12)
        self.large = still | (np.abs(self.table) > small_rates.SMALL * self.full)
        phase = np.asarray(w["phase"]).astype(int) if self.setup.steps else small_rates.phases(self.w)
        self.small = small_rates.SmallRates.of(self.w[~self.large], self.y[~self.large], phase[~self.large])
        if self.small.silent:
            self.large &= ~still
        if self.setup.steps:
            self.cycle = cycle_of(np.asarray(w["phase"]).astype(int), self.setup.steps)
        else:
            self.cycle = np.asarray(w.get("cycle", np.ones(self.y.size))).astype(int)

    def regression(self) -> Regression:
        w, y, R, truth = self.w[self.large], self.y[self.large], self.full, self.setup.truth or {}
        self.d = direction(self.table)[self.large]
        line = np.polyfit(w, y - w, 1)
        rows: list[tuple[str, str, str, Array]] = [
            ("e", "scale factor error, of both senses together, at small rates", "ppm", w),
            ("a", "asymmetry: scale factor of positive less that of negative rates", "ppm", np.abs(w) / 2.0),
            ("c", f"change of the scale factor from 0 to {plain(R / DEG, 6)} °/s, as its square", "ppm", w**3 / R**2),
            ("h", "hysteresis: half of what a rate reached from below reads more than from above", "deg/h", self.d),
            ("b", "bias, without the Earth rate", "deg/h", np.ones_like(w)),
        ]  # fmt: skip
        closed = {"e": float(line[0]), "b": float(line[1])}
        wanted = [Quantity.of(n, m, unit, truth.get(n), closed.get(n)) for n, m, unit, _ in rows]
        self.X = X = np.column_stack([column for *_, column in rows])
        ways = {"reached from below": self.d >= 0.0, "reached from above": self.d < 0.0}
        shown = [Group(f"rate error, {n}", at, w[at] / DEG, "rate", "°/s") for n, at in ways.items() if at.any()]
        kept = {n: np.asarray(v)[self.large] for n, v in self.windows.items()}
        weighed = [*nuisances.common(kept), *self._dead_band(), *self._scale_trend(w)]
        candidates = weighed if self.setup.nuisances else ()
        return Regression(
            wanted, X, y - w, self.t0[self.large], self.t1[self.large], shown, "rate error", candidates=candidates
        )

    @property
    def sense(self) -> Array:
        """Sense of the rates of the sweep: 1, -1, 0 at rest."""
        table = self.table[self.large]
        return np.where(np.abs(table) > small_rates.SMALL * self.full, np.sign(table), 0.0)

    def _dead_band(self) -> list[nuisances.Candidate]:
        """Return what a gyro with a dead band lacks at all rates, which would pass for scale factor and cubic; where
        every small rate is answered, nothing.
        """
        if self.small.answered:
            return []
        return [
            nuisances.Candidate.of("dead band", "rate lacking at large rates in either sense", "deg/h", -self.sense)
        ]

    def _with(
        self, found: DriftTestResult, id: str, text: str, more: Array, severity: str = "condition"
    ) -> list[Reason]:
        """Return that a verdict must hold with the columns (n, k) in the model, too."""
        intervals = intervals_with(self.X, self.y[self.large] - self.w[self.large], more, found.coefficients)
        return [Reason(id, text, ("pass", "fail"), severity=severity, intervals=intervals)] if intervals else []

    def _unshown(self, result: DriftTestResult) -> list[Reason]:
        """Return what the coefficients may be with what the readings hardly show: a dead band and a lock-in without
        small rates, a shape beyond asymmetry and cubic (a warning where its F test sees it), heat of the turning.
        """
        w, found = self.w[self.large], list[Reason]()
        if not self.small.rate.size:
            still = self.sense == 0.0
            text = (
                "No small rates were measured, and a dead band or a lock-in that the others do not show moves e, a, c "
                "and b. Measure small rates."
            )
            lock = np.where(still, 0.0, 1.0 / np.where(still, 1.0, w))
            found += self._with(result, "threshold.unmeasured", text, np.column_stack([self.sense, lock, still]))
        told = next((t.p for t in self.found.tests if t.id == "fifth"), None)
        severity = "warning" if told is not None and told < SHOWN else "condition"
        text = (
            "e, a and c may hold a square or a fifth power of the rate: their intervals are wider with them. Take more "
            "rates, or a smaller largest one."
        )
        found += self._with(result, "shape.with", text, self.beyond, severity)
        if "temperature" not in self.windows:
            warm = heating((self.table / self.full) ** 2, self.t0, self.t1)[self.large]
            text = (
                "What turning heats, and what cools at small rates, changes scale factor and bias like an asymmetry or "
                "a hysteresis. Record the temperature of the gyro."
            )
            found += self._with(result, "heat.with", text, np.column_stack([w[:, None] * warm, warm]))
        return found

    @property
    def beyond(self) -> Array:
        """Return the columns (n, 2) of a shape beyond asymmetry and cubic: square and fifth power of the rate."""
        x = self.w[self.large] / self.full
        return np.column_stack([x * x, x**5])

    def _scale_trend(self, w: Array) -> list[nuisances.Candidate]:
        """Return a scale factor that changes in time, where each sense comes once and only the shape tells it from an
        asymmetry; where they come again an F test looks for it.
        """
        if np.count_nonzero(np.diff(self.sense[self.sense != 0.0])) > 1:
            return []
        hours = nuisances.trend(self.t0[self.large], self.t1[self.large]).columns
        return [nuisances.Candidate.of("scale trend", "change of the scale factor in time", "ppm/h", w * hours)]

    def effects(self, found: Findings) -> list[Effect]:
        """Return the sources: what the stated rate is wrong by, times 1 + e, is in the data."""
        s, large = self.setup, self.large
        table, dt = self.table[large], (self.t1 - self.t0)[large]
        across = s.earth_rate * math.cos(s.latitude)
        lean = math.sqrt(2.0) * COSINE.size(s) ** 2  # rms of (x2 + y2)/2
        encoder = []
        if "angle_start" in self.windows:
            a0, a1 = (np.asarray(self.windows[n])[large] for n in ("angle_start", "angle_end"))
            for source, n in ((ANGLE_ONCE, 1), (ANGLE_TWICE, 2)):
                misread = [(f(n * a1) - f(n * a0)) / dt for f in (np.sin, np.cos)]
                encoder.append(source.effect(s, np.array([found.error(-x) for x in misread])))
        return [
            TIME_BASE.effect(s, found.error(-table)),
            COSINE.effect(lean, found.error(self.w[large]), simulated=(s.cosine,) if s.simulated else ()),
            AXIS_VERTICAL_EAST.effect(s, found.error(-across)),
            LATITUDE.effect(s, found.error(-across)),
            *encoder,
        ]

    def test(self, found: Findings) -> None:
        x = self.w[self.large] / self.full
        found.f_test(
            "fifth", "square and fifth power of the rate", self.beyond,
            "shape of the scale factor", "the scale factor has a shape beyond asymmetry and cubic",
            "no shape beyond asymmetry and cubic",
        )  # fmt: skip
        if self.small.answered:
            found.f_test(
                "dead_band", "sense of the rate", self.sense[:, None], "dead band",
                "the gyro lacks a rate in either sense, as by a dead band: e and c are not of small rates; measure "
                "small rates, too",
                "no dead band",
            )  # fmt: skip
        found.f_test(
            "hysteresis.rate", "way to the rate times the rate", (self.d * np.abs(x))[:, None],
            "hysteresis", "the hysteresis changes with the rate: h is their mean",
            "no hysteresis that changes with the rate",
        )  # fmt: skip
        with_time = [(self.t0 + self.t1)[self.large], *(np.asarray(v)[self.large] for n, v in self.windows.items()
                                                        if n.startswith("temperature"))]  # fmt: skip
        found.f_test(
            "scale.time", "rate times time and temperature",
            np.column_stack([x * (v - np.mean(v)) for v in with_time if np.ptp(v) > 0.0]),
            "constancy of the scale factor", "the scale factor changes with time or temperature: e is of their means",
            "no scale factor that changes with time or temperature",
        )  # fmt: skip
        residuals.add_tests(found, self.table[self.large], levels(self.table)[self.large], self.d)

    def account(self, found: Findings) -> Account:
        large = self.large
        w, y = self.w[large], self.y[large]
        noise = found.residual_std * found.y_scale
        self.departures = tables.Departures.of(w, y, levels(self.table[large]), self.d, self.full, noise)
        self.cycles = tables.Cycles.of(w, y, self.cycle[large], noise)
        return Account(
            method="Rates in steps through both senses; least squares under an estimated noise model [TEST-RATE-GYRO]",
            sources=[
                "TEST-RATE-GYRO; IEEE 952; IEEE 647; IEEE 1431",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation="y - w = b + e w + a/2 abs(w) + c w (w/R)^2 + h d",
            conventions=[
                f"w: rate of the table and the Earth rate along its axis, {plain(self.setup.earth / DPH, 6)} °/h.",
                f"R = {plain(self.full / DEG, 6)} °/s, the largest rate; d = 1 where a rate was reached from below, −1 "
                "from above.",
                "e is the error of the scale factor that the gyro is read with: 0 where that is right.",
            ],
            closed_caption="Least squares under the noise model; closed: the straight line alone, unweighted",
            tables=[self.departures.table(), *self.cycles.table(), *self.small.table()],
            reasons=[*jumped(found), *self._pattern(), *dithered(self.setup.parameters)],
            repeatability=self.cycles.shown(),
            random="random drift and noise of the readings",
        )  # fmt: skip

    def _once(self, h: Coefficient) -> list[Reason]:
        """Return that a hysteresis of rates that are read once may be a gyro that had not settled."""
        if np.any(np.diff(levels(self.table)) == 0) or h.interval[0] <= 0.0 <= h.interval[1]:
            return []
        text = (
            "Each rate is read once: a gyro that had not settled, or a reading begun before the table had its rate, "
            "is in h, and no residual shows it. Read each rate twice or more."
        )
        return [Reason("rate.once", text, names=("h",))]

    def _tail(self, e: Coefficient) -> list[Reason]:
        """Return that what a band d takes off all rates, d2/(2 w2) of the smallest, is more than U of e."""
        low, high = self.small.bounds or (0.0, math.inf)
        if not low or math.isinf(high):
            return []
        least = float(np.min(np.abs(self.w[self.large][self.sense != 0.0])))
        off = 0.75 * (0.5 * (low + high) / least) ** 2 / 2.0  # the threshold is d/sqrt(3/4)
        if not off > 1e-6 * e.k * e.u:
            return []
        text = (
            f"A gyro with this threshold that passes √(w² − d²) lacks {plain(1e6 * off, 3)} ppm of the smallest rate "
            "of the sweep, and less of larger ones: e and c hold that in part, their u does not. Take larger steps."
        )
        return [Reason("threshold.tail", text, ("pass", "fail"), ("e", "c"), severity="doubt")]

    def _pattern(self) -> list[Reason]:
        """Return that the drift of a whole-angle gyro, which goes round with its pattern, does not average out."""
        dt, turning = (self.t1 - self.t0)[self.large], self.sense != 0.0
        turn = np.abs(self.w[self.large] * self.setup.pattern) * dt
        if not self.setup.pattern or not np.any(short := turning & (turn < PERIOD)):
            return []
        slow, longest = float(np.min(np.abs(self.w[self.large][short]))), PERIOD / self.setup.pattern
        text = (
            "The drift of a whole-angle gyro goes round with its pattern, and readings that turn it by less than 90° "
            "hold that of the angles they were taken at, which comes back in each cycle: u does not hold it. Take "
            f"windows of {plain(longest / slow)} s and more at {plain(slow / DEG, 3)} °/s."
        )
        return [Reason("rate.pattern", text, ("pass", "fail"), severity="doubt")]

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        truth = (self.setup.truth or {}).get("threshold")
        added = self.small.coefficient(truth)
        e, _, _, _, b = result.coefficients[:5]
        reasons = [*handling.implausible(*result.coefficients[:2]), *worded(self.setup.parameters, b.u * DPH)]
        reasons += [*self._tail(e), *self._once(result.coefficients[3]), *self._unshown(result)]
        return replace(
            result,
            coefficients=[*result.coefficients, *([added] if added else [])],
            correlation=result.correlation,
            reasons=[*result.reasons, *reasons],
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [
            *told(coefficients, "Scale factor error {e}, asymmetry {a}, cubic {c}, hysteresis {h}; bias {b}."),
            self.departures.sentence(),
            *self.cycles.sentence(),
            *self.small.sentence(),
            found.noise_sentence("readings"),
            *found.nuisance_sentences(),
        ]

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        return cls.reduce(record.windows, cls.setup_of(record.run))


reduce = Reduction.reduce


def truth_of(run: RunDocument) -> dict[str, float] | None:
    """Return what the parameters of a simulated gyro make of the coefficients, SI; None where they do not say it.

    A gyro with a dead band or lock-in passes sqrt(r2 - d2): it begins to answer with half of a rate at d/sqrt(3/4), and
    its scale factor depends on the rate in a way that is not that of the model; nor is that of a ring laser beyond the
    rate of its dither, or of a gyro whose hysteresis is wider than a step of the plan.
    """
    p: dict[str, Any] = dict(run.parameters)
    if "gyro.scale" not in p or run.measured:
        return None
    locks = 0.0 if p.get("gyro.dither") else float(p.get("gyro.lock_in", 0.0))
    band = float(p.get("gyro.dead_band", 0.0)) or locks
    out = {"threshold": band / math.sqrt(0.75)} if band else {}
    if whole_angle(p):  # its drift goes round with the pattern
        return None
    seen = math.cos(float(np.ravel(p.get("gyro.phase_error", 0.0))[0]))  # of a vibrating gyro
    if bias_is_all(p):
        out["b"] = float(np.ravel(p["gyro.bias"])[0]) * seen
    if p.get("gyro.closed", 1.0) < 0.5:  # fibre: a sine of the rate; vibrating: its modes
        return out
    full = float(run.options["full_scale"])
    if float(p.get("gyro.hysteresis", 0.0)) and float(p["gyro.hysteresis_width"]) > full / float(run.options["steps"]):
        return out  # a step of the rates does not go through it
    out["h"] = float(p.get("gyro.hysteresis", 0.0))
    if not band and not 0.0 < float(p.get("gyro.dither", 0.0)) < full:
        reset = float(p.get("gyro.reset_error", 0.0))
        out["a"] = float(p.get("gyro.asymmetry", 0.0)) * seen
        out["e"] = (1.0 + float(np.ravel(p["gyro.scale"])[0])) * seen / (1.0 - reset) - 1.0
        out["c"] = float(p.get("gyro.cubic", 0.0)) * full**2
    return out
