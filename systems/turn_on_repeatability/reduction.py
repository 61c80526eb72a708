"""Reduction of turn-ons: warm-up of the bias (and of the scale factor), bias of each turn-on, how well they repeat.

    y_ij - w_i = b_i + sum_k A_k m(t_ij, tau_k) + E w_i m(t_ij, tau_E) + noise       m: mean of exp(-t/tau) in a reading

i: turn-on, w: rate of the table.  The time constants are found by least squares, as many exponentials as the record
tells; the model, linear about them, is then fitted under an estimated noise model.  Intervals of sizes and time
constants allow for a second exponential that is hardly seen (draws.py), those of what comes after the readings (bias
when warm, time until then) beside two for a third.  Of the biases b_i come the components of variance between turn-ons
and between days, less their noise (components.py).  A record with one reading of each turn-on has no warm-up.
[TEST-TURN-ON; IEEE 952; Weerahandi 1993]

Not modelled: a warm-up that differs from turn-on to turn-on, biases that depend on the one before.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench.reduction.estimation import asked
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.setup.rate_gyro_bias import doubts_at_rest
from gyrobench.reduction.setup.sources import TIME_BASE
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
    Setup,
    Table,
    plain,
    told,
    window_problems,
)
from gyrobench.units import DPH

from . import components, mistakes, shape, temperature
from .components import Spread, spread
from .draws import Posterior
from .labels import labelled, unknowns
from .truth import true_values
from .warming import Kind, Warming, fitted, means

CONDITION = 1e6  # exponentials that are hardly two were left out by then
FEW = 4  # readings of a turn-on from which on a warm-up is looked for
MEANT = "time constant of the warm-up: after it 1/e is left"
SECONDS = "s"
ENDLESS = "longer than the record tells"


@dataclass(frozen=True, kw_only=True)
class TurnOnSetup(Setup):
    """limit: rad/s.  exponentials: 0, 1, 2, or -1, as many as the record tells."""

    limit: float
    exponentials: int = -1


class Reduction(DriftReduction[TurnOnSetup]):
    """Windows with t_start, t_end, turn_on, since, mean, and day, rate, temperature where they are there."""

    handling = staticmethod(mistakes.candidates)

    def __init__(self, windows: Mapping[str, Array], setup: TurnOnSetup) -> None:
        super().__init__(windows, setup)
        self.tau, self.tau_E = np.zeros(0), np.zeros(0)
        self.late = False

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        return cls.reduce(labelled(record), cls.setup_of(record.run))

    @classmethod
    def setup_of(cls, run: RunDocument) -> TurnOnSetup:
        o = run.options
        truth = None if run.measured else true_values(run)
        return TurnOnSetup.of(run, truth=truth, limit=float(o["limit"]), exponentials=int(o.get("exponentials", -1)))

    def problems(self) -> list[str]:
        w = self.windows
        if problems := window_problems(w, ("t_start", "t_end", "since", "mean")):
            return problems
        self._read()
        if self.count < 2:
            problems.append("fewer than two turn-ons: nothing repeats")
        elif self.y.size < self.count + 3 and not self.single:
            problems.append(f"{self.y.size} readings of {self.count} turn-ons: give one of each, or several")
        if np.any(self.since < 0.0) or np.any(self.since < 0.45 * self.length):
            problems.append("since: the middle of a reading cannot lie before half of it has passed")
        problems += self._times()
        if "day" in w and any(np.unique(self.day[self.turn == k]).size > 1 for k in range(self.count)):
            problems.append("day: a turn-on has rows of two days")
        return problems

    def _times(self) -> list[str]:
        """Return that times since a turn-on go another way than the times of the readings."""
        same = self.turn[1:] == self.turn[:-1]
        mean = 0.5 * (np.asarray(self.windows["t_start"], dtype=float) + np.asarray(self.windows["t_end"], dtype=float))
        step, since = np.diff(mean)[same], np.diff(self.since)[same]
        if not step.size or np.all(np.abs(since - step) <= 0.05 * np.abs(step) + 1.0):
            return []
        own, other = float(np.median(since)), float(np.median(step))
        return [
            f"since: it grows by {plain(own, 4)} s from a reading to the next one of a turn-on, the times by "
            f"{plain(other, 4)} s: a unit is mistaken, or rows"
        ]

    def _read(self) -> None:
        w = self.windows
        self.y, self.since, t0, t1 = (np.asarray(w[n], dtype=float) for n in ("mean", "since", "t_start", "t_end"))
        self.length = t1 - t0
        self.read, self.longest = float(np.max(self.since + 0.5 * self.length)), 20.0 * float(np.max(self.since))
        self.numbers, self.turn = np.unique(np.asarray(w["turn_on"]).astype(int), return_inverse=True)
        self.count = self.numbers.size
        self.single = self.count == self.y.size
        self.day = np.asarray(w.get("day", np.ones(self.y.size))).astype(int)
        self.w = np.asarray(w.get("rate", np.zeros(self.y.size)), dtype=float)

    # ------------------------------------------------------------------------------ the model
    def regression(self) -> Regression:
        group = self.turn if not self.single else np.unique(self.day, return_inverse=True)[1]
        self.columns = int(group.max()) + 1
        own = np.zeros((self.y.size, self.columns))
        own[np.arange(self.y.size), group] = 1.0
        y = self.y - self.w
        most = 0 if np.min(np.bincount(self.turn)) < FEW else self.setup.exponentials
        turns = bool(np.any(self.w > 0.0) and np.any(self.w < 0.0)) and most != 0
        kinds = [Kind(np.ones_like(y), most if most >= 0 else 2, most >= 0), Kind(self.w, int(turns))]
        self.choice = fitted(y, own, self.since, self.length, kinds)
        self.tau, self.tau_E = self.choice.tau
        warm = self._exponentials(self.tau)
        scale = self.w[:, None] * self._exponentials(self.tau_E)
        X = np.column_stack([own, warm, scale])
        self.about = np.linalg.lstsq(X, y, rcond=None)[0][self.columns :]
        X = np.column_stack([X, *self._slopes(self.tau, self.tau_E, self.about)])
        names = unknowns("day" if self.single else "turn-on", self.columns, self.tau.size, self.tau_E.size)
        quantities = [Quantity.of(n, "unknown of the fit", "deg/h") for n in names]
        shown = [
            Group(f"turn-on {n}", np.flatnonzero(self.turn == k), self.since[self.turn == k], "time since turn-on", "s")
            for k, n in enumerate(self.numbers.tolist())
        ][:6]  # fmt: skip
        t0, t1 = (np.asarray(self.windows[n], dtype=float) for n in ("t_start", "t_end"))
        return Regression(quantities, X, y, t0, t1, shown, "drift", limit=CONDITION)

    def _exponentials(self, tau: Array) -> Array:
        return means(self.since, self.length, tau) if tau.size else np.zeros((self.y.size, 0))

    def _slopes(self, tau: Array, tau_E: Array, size: Array) -> list[Array]:
        """Return the columns of ln tau of each exponential, at the sizes found."""
        out = []
        for k, x in enumerate([*tau, *tau_E]):
            factor = self.w if k >= tau.size else 1.0
            high, low = (means(self.since, self.length, np.array([x * math.exp(s)]))[:, 0] for s in (1e-3, -1e-3))
            out.append(factor * size[k] * (high - low) / 2e-3)
        return out

    def derived(self, found: Findings) -> Findings:
        n, q, e = self.columns, self.tau.size, self.tau_E.size
        truth = dict(self.setup.truth or {})
        if q == 1 and "A_1" in truth:  # this fit is not of the true curve; judged by what allows for the other part
            truth = {name: x for name, x in truth.items() if name not in ("b", "A", "τ")}
        wanted = [Quantity.of("b", f"bias when warm, mean of these {self.count} turn-ons", "deg/h", truth.get("b"))]
        for k in range(q):
            word = "" if q == 1 else (", fast part", ", slow part")[k]
            name = "A" if q == 1 else f"A_{k + 1}"
            tau = "τ" if q == 1 else f"τ_{k + 1}"
            wanted.append(
                Quantity.of(name, f"bias at the turn-on, less that when warm{word}", "deg/h", truth.get(name))
            )
            meaning = f"time constant of the warm-up{word}" if word else MEANT
            wanted.append(Quantity(tau, meaning, SECONDS, 1.0, truth.get(tau)))
        if e:
            wanted.append(Quantity.of("E", "scale factor at the turn-on, less that when warm", "ppm", truth.get("E")))
            wanted.append(Quantity("τ_E", "time constant of the scale factor", SECONDS, 1.0, truth.get("τ_E")))

        def function(beta: Array) -> Array:
            out = [float(beta[:n].mean())]
            for k, tau in enumerate([*self.tau, *self.tau_E]):
                out += [float(beta[n + k]), float(tau * np.exp(np.clip(beta[n + q + e + k], -3.0, 3.0)))]
            return np.array(out)

        r = found.est
        if self.single:
            self.biases, self.shared = self.y - self.w, np.zeros((self.count, self.count))
        else:
            self.biases, self.shared = r.beta[:n], r.covariance[:n, :n]
        apart = float(self.shared.sum() - np.trace(self.shared)) / (self.count * (self.count - 1))
        self.noise = np.maximum(np.diag(self.shared) - apart, 0.0)
        return found.derive(wanted, function)

    # ------------------------------------------------------------------------------ what follows from it
    def spread(self) -> Spread:
        """Return the components of variance of the biases."""
        first = [int(np.flatnonzero(self.turn == k)[0]) for k in range(self.count)]
        warm = np.asarray(self.windows.get("temperature", []), dtype=float)
        T = np.array([warm[self.turn == k][-1] for k in range(self.count)]) if warm.size else None
        if self.single:
            return spread(self.biases, self.day[first], self.shared, T)
        m, every = self.found.est.mixture, slice(self.count)
        return spread(self.biases + m.off[:, every], self.day[first], m.covariance[:, every, every], T, m.weight)

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        truth, s = self.setup.truth or {}, self.spread()
        added = []
        meanings = (
            ("σ_on", "repeatability: standard deviation of the bias from turn-on to turn-on", s.turn_on),
            ("σ_day", "standard deviation of the bias from day to day", s.day),
        )
        for name, meaning, part in meanings:
            if part is not None:
                added.append(components.coefficient(name, meaning, part, truth.get(name)))
        if s.slope is not None:
            dof = max(self.count - np.unique(self.day).size - 1, 1)
            added.append(temperature.coefficient(s.slope, dof, self.read, self.late, truth.get("b_T")))
        own = list(result.coefficients)
        if self.tau.size + self.tau_E.size and asked.whole():
            q = self.tau.size
            self.allowed = self._draws(q + int(q > 0 > self.setup.exponentials))
            self.drawn = self.allowed if q < 2 else self._draws(q)
            self.endless = self._endless()
            own = [self._allowed(c) for c in own]
        warm = self._time(truth.get("t_w"))
        reasons = [*result.reasons, *doubts_at_rest(self.setup.parameters)]
        if warm and asked.whole() and not self.endless:
            left = self._of_each(lambda w, _: w.left(self.read), self.allowed)
            reasons += shape.extrapolated(left, self.read, self.setup.limit)
        return replace(result, coefficients=[*own, *([warm] if warm else []), *added], reasons=reasons)

    def _time(self, truth: float | None) -> Coefficient | None:
        """Return the time until the bias is within the limit; its interval holds those of the draws and of the fit."""
        q, e = self.tau.size, self.tau_E.size
        meaning = f"time until the bias is within {plain(self.setup.limit / DPH, 4)} °/h of that when warm"
        if not q:
            return None
        value = self.found.value
        warm = Warming(value[1 : 1 + 2 * q : 2], np.maximum(value[2 : 2 + 2 * q : 2], 1e-3))
        own = warm.time_until(self.setup.limit, self.longest)
        if not asked.whole():
            return Coefficient("t_w", meaning, SECONDS, own, math.nan, NORMAL, (math.nan, math.nan))
        times = np.sort(self._of_each(lambda w, t: w.time_until(self.setup.limit, t), self.allowed))
        low, high = (float(times[round(p * (times.size - 1))]) for p in (0.025, 0.975))
        if self.endless or not math.isfinite(own):
            return Coefficient("t_w", meaning, SECONDS, math.nan, math.nan, NORMAL, (low, math.inf), truth=truth,
                               no_value="not reached within the record")  # fmt: skip
        J = np.zeros((1, self.found.est.beta.size))
        J[0, self.columns + np.r_[:q, q + e : 2 * q + e]] = warm.slopes(own)
        factor = math.exp(min(float(self.found.est.mixture.spread(J)[1][0]) / own, 20.0)) if own else 1.0
        low, high = min(low, own / factor), max(high, own * factor)
        u = (high - low) / (2.0 * NORMAL)
        return Coefficient("t_w", meaning, SECONDS, own, u, NORMAL, (low, high), truth=truth)

    def _of_each(self, figure: Callable[[Warming, float], float], drawn: tuple[Array, Array, Array]) -> Array:
        """Return a figure of every fourth of the warm-ups of the bias that the record allows."""
        e, (size, tau, _) = self.tau_E.size, drawn
        return np.array([figure(Warming(size[k, e:], tau[k, e:]), self.longest) for k in range(0, len(size), 4)])

    def _draws(self, count: int) -> tuple[Array, Array, Array]:
        """Return sizes (m, e + count) and time constants of warm-ups that the record allows, those of the scale factor
        first, and mean biases (m,) when warm; count: exponentials of the bias, as many as were found or one more.

        The noise is white there; its variance makes no interval of the fit under the estimated noise model wider than
        it would be here.
        """
        q, e, n, X = self.tau.size, self.tau_E.size, self.columns, self.found.X
        left = self.found.y - X[:, : n + q + e] @ np.linalg.lstsq(X[:, : n + q + e], self.found.y, rcond=None)[0]
        variance = float(left @ left) / max(self.y.size - n - 2 * (q + e), 1)
        variance = max(variance, 1e-20 * float(np.mean(self.found.y**2)), 1e-300)
        size = np.linalg.norm(X, axis=0)
        white = np.sqrt(variance * np.diag(np.linalg.pinv((X / size).T @ (X / size)))) / size
        reported = self.found.reported.half_width[1 : 1 + 2 * (q + e)] / NORMAL
        value = self.found.value[1 : 1 + 2 * (q + e)]
        amplitude, u_tau = white[n : n + q + e], white[n + q + e : n + 2 * (q + e)]
        ratio = np.concatenate([reported[0::2] / amplitude, reported[1::2] / value[1::2] / u_tau])
        factor = max(1.0, float(np.max(ratio)))
        doubtful = float(np.max(np.abs(value[0 : 2 * q : 2]))) if count > q else None
        posterior = Posterior(self.choice.curves, [1] * e + [0] * count, factor**2 * variance, doubtful)
        start, order = np.log(np.concatenate([self.tau_E, self.tau])), np.r_[q : q + e, :q]
        drawn, log_tau, level = posterior.drawn(start, np.minimum(factor * u_tau[order], 0.5))
        return drawn, np.exp(log_tau), level

    def _endless(self) -> bool:
        """Whether the slowest part found may be slower than any that was sought: its size is not determined then."""
        q, e, (size, tau, _) = self.tau.size, self.tau_E.size, self.drawn
        if not q:
            return False
        at = np.argmax(np.abs(size[:, e:]) if q == 1 else tau[:, e:], axis=1)
        slowest = tau[np.arange(len(tau)), e + at]
        return bool(np.mean(slowest > 0.9 * math.exp(self.choice.curves.high)) > 0.05)

    def _allowed(self, c: Coefficient) -> Coefficient:
        """Return a size or a time constant of the warm-up with the interval of the warm-ups that the record allows."""
        q, e, (size, tau, _) = self.tau.size, self.tau_E.size, self.drawn
        name, _, number = c.name.partition("_")
        if name not in ("b", "A", "E", "τ") or number == "T":
            return c
        if name != "b" and "E" in (name, number):
            size, tau, k = size[:, :e], tau[:, :e], 0
        else:
            size, tau, k = size[:, e:], tau[:, e:], int(number or 1) - 1
            order = np.argsort(tau if q > 1 else -np.abs(size), axis=1)
            size, tau = (np.take_along_axis(x, order, axis=1) for x in (size, tau))
        unit = next(x.scale for x in self.found.quantities if x.name == c.name)
        if name == "b":
            sample = self.allowed[2]
        elif name == "τ":
            sample = tau[:, k]
            if q == 1 and size.shape[1] == 2 and number != "E":
                sample = self._of_each(Warming.time_constant, self.drawn)
        else:
            sample = size.sum(axis=1) if q == 1 and name == "A" else size[:, k]
        low, high = (float(v) / unit for v in np.quantile(sample, (0.025, 0.975)))
        own = c.interval
        if name == "τ":  # it was fitted in logarithms; type B below
            factor = math.exp(min(c.k * (c.u_a or c.u) / c.estimate, 20.0))
            own = c.estimate / factor, c.estimate * factor
        low, high = min(low, own[0]), max(high, own[1])  # colour of the noise weighs differently on each
        type_b = NORMAL * math.sqrt(max(c.u**2 - (c.u_a or 0.0) ** 2, 0.0))
        below, above = max(c.estimate - low, 0.0), max(high - c.estimate, 0.0)
        u_a = (below + above) / (2.0 * NORMAL)
        low, high = c.estimate - math.hypot(below, type_b), c.estimate + math.hypot(above, type_b)
        u = (high - low) / (2.0 * NORMAL)
        true = (self.setup.truth or {}).get(c.name)
        true = None if true is None else true / unit
        z = None if true is None or not u else (c.estimate - true) / u
        if self.endless and (name == "b" or (number != "E" and name != "E" and k == q - 1)):
            low, high = (low if name == "τ" else -math.inf), math.inf
            bare = replace(c, estimate=math.nan, u=math.nan, u_a=None, z=None, t=None, p=None)
            return replace(bare, k=NORMAL, interval=(low, high), truth=true, no_value=ENDLESS)
        return replace(c, u=u, u_a=u_a, k=NORMAL, interval=(low, high), truth=true, z=z)

    def effects(self, found: Findings) -> list[Effect]:
        """Return the sources: a slow clock makes the time constants too small; as a share of them, not of the data."""
        values = np.array([-v * (q.unit == SECONDS) for q, v in zip(found.quantities, found.value, strict=True)])
        return [TIME_BASE.effect(self.setup, None, values=values)]

    def test(self, found: Findings) -> None:
        if self.tau.size and not self.single and self.count > 1:
            own = found.X[:, : self.columns] * self._exponentials(self.tau[-1:])
            found.f_test("warm_up.alike", "warm-up of each turn-on", own, "turn-ons that began warm", *shape.ALIKE)
        if not self.single and np.min(np.bincount(self.turn)) >= FEW:
            words = "times since the turn-on", shape.bands(self.since), "a warm-up of another shape"
            found.f_test("warm_up.shape", *words, *shape.OTHER)
        if "temperature" not in self.windows or self.single:
            return
        columns = temperature.lags(self.windows, found.est.X, self.read)
        bad, good = temperature.LATE, "no drift within turn-ons of a gyro that follows the temperature late"
        shown = columns.size and found.f_test("late", "lag of the temperature", columns, "temperature", bad, good)
        self.late = bool(shown) and (found.tests[-1].p or 0.0) < temperature.LEVEL

    def account(self, found: Findings) -> Account:
        q = self.tau.size
        return Account(
            method="Readings from the switching on onwards, over turn-ons and days; least squares under an estimated "
            "noise model, components of variance [TEST-TURN-ON]",
            sources=[
                "TEST-TURN-ON; IEEE 952; IEEE 647; IEEE 1431; Weerahandi 1993",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation='y - omega = b_i + sum_k A_k e^(-t\\/tau_k)' if q else "y - omega = b_i",
            conventions=[
                f"Exponentials of the warm-up of the bias: {q}, the same in all turn-ons.",
                *([shape.HIDDEN] if q and self.setup.exponentials < 0 else []),
                "σ_on, σ_day: standard deviations of the population, less the noise of the biases; intervals by "
                "generalized pivotal quantities, 0 where the record shows none.",
                f"{self.count} turn-ons on {np.unique(self.day).size} days.",
            ],
            tables=[self._biases()],
            random="noise of the readings",
        )  # fmt: skip

    def _biases(self) -> Table:
        rows = []
        for k, n in enumerate(self.numbers.tolist()):
            at = int(np.flatnonzero(self.turn == k)[0])
            rows.append([n, int(self.day[at]), float(self.biases[k]) / DPH, math.sqrt(float(self.noise[k])) / DPH])
        caption = "Bias of each turn-on when warm; u: of its noise, without what all have in common"
        return Table("turn_on.biases", "Turn-ons", caption, ["turn-on", "day", "bias / (°/h)", "u / (°/h)"], rows)

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        names = {c.name for c in coefficients if not c.no_value}
        said = {
            "σ_on": "Repeatability of the bias from turn-on to turn-on {σ_on}.", "σ_day": "From day to day {σ_day}.",
            "t_w": f"Within {plain(self.setup.limit / DPH, 4)} °/h after {{t_w}}.",
        }  # fmt: skip
        sentences = told(coefficients, *(text for n, text in said.items() if n in names))
        return [*sentences, found.noise_sentence("readings")]


reduce = Reduction.reduce
