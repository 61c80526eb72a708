"""Reduction of the rebalance loop test: bias, scale factor and linearity of the reading, resolution, ripple, range.

With the reading x = i_read and the input rate omega along the input axis, k the scale factor of the torquer,

    y = omega/k - x = I_0 + κ x + κ_± |x| + κ_2 x2/I + κ_3 x3/I2 + noise            I = largest rate / k

so that I_0 + (1 + κ) x + ... is the true mean current.  The regressors are averaged over the window as the reading is:
its standard deviation s gives mean x2 + s2, mean x3 + 3 mean x s2 and, of |x|, the folded normal distribution.
[TEST-REBAL-LOOP; REBAL-PWM, REBAL-PULSE; Hu 1981, eq. 5-64, 5-69..5-76 with ET16..ET18]

The resolution is the largest current of which all readings at rest are whole multiples.  The ripple is the standard
deviation of the float angle in a reading at rest; a communication step of whole saws does not show that of a saw.

Not modelled: drift that changes with the rate, heating of the torquer by the current.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.drift import small_rates
from gyrobench.reduction.drift.pulses import Pulses
from gyrobench.reduction.drift.window_regressors import BelievedGeometry, Turning, axis_rate, wobbles
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.fit_result import Account, with_values
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.setup import sources
from gyrobench.reduction.setup.run_metadata import Location, number, phases
from gyrobench.reduction.setup.setups import SiteSetup, scale_factor_problems
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import Array, DriftReduction, Effect, Findings, Group, Quantity, Regression, told
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table
from gyrobench.system.families.table_test import FACE, ON_TABLE
from gyrobench.units import ARCSEC, DPH

from .measured import REST, TURNING
from .sources import DRIFT_RATE
from .truth import true_values

MA, UA = 1e-3, 1e-6  # A
NO_QUANTUM = 1e-10  # A, below this readings are not quantized but rounded
LEVEL = np.eye(3)  # table axes in (E, N, U)
NO_STD = (
    "The record has no standard deviation of the samples (column std): |x|, x² and x³ are taken at the mean of each "
    "reading. Where the current of the samples changes its sign within a reading, I_0 is off by up to 0.8 κ_± times "
    "their standard deviation."
)
MEANINGS = {
    "I_0": ("bias: mean current at the reading 0", "uA"),
    "κ": ("scale-factor error: mean current over reading, less 1", "ppm"),
    "κ_±": ("scale-factor asymmetry: half the difference of the positive and the negative one", "ppm"),
    "κ_2": ("quadratic nonlinearity at the largest rate", "ppm"),
    "κ_3": ("cubic nonlinearity at the largest rate", "ppm"),
}


@dataclass(frozen=True, kw_only=True)
class RebalanceLoopSetup(SiteSetup):
    """k: torquer scale factor, rad/s/A.  largest: rate of the test, rad/s.  gate: length of a reading, s.  labels: of
    the phases; rest: those at rest.  limit: largest current of the rebalance, A (0: not known).  has_small: readings at
    small rates are left to the threshold.
    """

    k: float
    largest: float
    gate: float
    labels: Mapping[int, str]
    rest: frozenset[int]
    limit: float = 0.0
    has_small: bool = False
    pulses: Pulses | None = None

    @property
    def full(self) -> float:
        """Current of the largest rate, A."""
        return self.largest / self.k


class Reduction(DriftReduction[RebalanceLoopSetup]):
    """Bias, scale factor and linearity of a loop from all readings; resolution, noise and ripple from those at rest."""

    @classmethod
    def setup_of(cls, run: RunDocument) -> RebalanceLoopSetup:
        k, p = number(run, "k", "gyro.k", "torquer scale factor"), run.parameters
        plan, largest = phases(run, [FACE, REST, TURNING]), float(run.options["range"])
        return RebalanceLoopSetup.of(
            run, k=k, largest=largest, gate=float(run.options["gate"]), pulses=Pulses.of(run),
            labels={n: row.label if row.face == FACE else f"{row.label}, phase {n}" for n, row in plan.items()},
            rest=frozenset(n for n, row in plan.items() if row.mode == "hold"),
            has_small=run.measured or bool(str(run.options.get("small", "")).strip()),
            limit=float(p.get("rebalance.I") or p.get("rebalance.i_max") or 0.0),
            truth=true_values(p, k, Location.of(run).g, largest / k),
        )  # fmt: skip

    def problems(self) -> list[str]:
        if problems := scale_factor_problems(self.setup.k) + window_problems(self.windows):
            return problems
        missing = [label for p, label in self.setup.labels.items() if p not in self.phase]
        if missing:
            return [f"no readings of {', '.join(missing)}"]
        self._split()
        return []

    def _split(self) -> None:
        """Leave the readings at small rates to the threshold; those at rest too, where a small rate is not answered."""
        s, w = self.setup, self.windows
        a0, a1, t0, t1 = (np.asarray(w[n], dtype=float) for n in ("angle_start", "angle_end", "t_start", "t_end"))
        felt = self._rate(Turning(a0, a1, t0, t1, np.broadcast_to(np.asarray(ON_TABLE), (a0.size, 3, 3))), LEVEL)
        resting = np.isin(self.phase, list(s.rest))
        slow = ~resting & (np.abs(felt) < small_rates.SMALL * s.largest) if s.has_small else np.zeros_like(resting)
        self.still = {n: np.asarray(v)[resting] for n, v in w.items()}  # resolution, noise, ripple
        indicated = np.asarray(w["mean"], dtype=float) * s.k
        self.small = small_rates.SmallRates.of(felt[slow], indicated[slow], self.phase[slow], "°/h", DPH)
        out = slow | (resting & self.small.silent)
        self.windows = {n: np.asarray(v)[~out] for n, v in w.items()}
        self.phase = self.phase[~out]

    @cached_property
    def phase(self) -> NDArray[np.int_]:
        return np.asarray(self.windows["phase"]).astype(int)

    @cached_property
    def std(self) -> Array:
        """(n,): standard deviations of the samples, A; NaN in a record that has none."""
        return np.asarray(self.windows.get("std", np.full(self.phase.size, math.nan)), dtype=float)

    def _rate(self, turning: Turning, base: Array) -> Array:
        return axis_rate(turning, base, self.setup.latitude, self.setup.earth_rate)

    def regression(self) -> Regression:
        s, w = self.setup, self.windows
        a0, a1, t0, t1, self.x = (
            np.asarray(w[n], dtype=float) for n in ("angle_start", "angle_end", "t_start", "t_end", "mean")
        )
        x, std = self.x, np.nan_to_num(self.std, nan=0.0)
        self.turning = Turning(a0, a1, t0, t1, np.broadcast_to(np.asarray(ON_TABLE), (x.size, 3, 3)))
        self.rate = self._rate(self.turning, LEVEL)
        line = np.linspace(-s.full, s.full, 201)
        curve = (line / MA, design(line, np.full_like(line, float(np.median(std))), s.full))
        quantities = [Quantity.of(n, *said, (s.truth or {}).get(n)) for n, said in MEANINGS.items()]
        return Regression(
            quantities, design(x, std, s.full), self.rate / s.k - x, t0, t1,
            [Group("all rates", np.arange(x.size), x / MA, "reading", "mA", curve)], "input current less reading", "µA",
            UA, candidates=nuisances.common(w, of=nuisances.Read("zero", "µA", UA)) if s.nuisances else (),
        )  # fmt: skip

    def effects(self, found: Findings) -> list[Effect]:
        s, one = self.setup, np.ones_like(self.rate)

        def error(turning: Turning, base: Array) -> Array:
            return found.error((self._rate(turning, base) - self.rate) / s.k)

        believed = BelievedGeometry(self.turning, LEVEL, error)
        cone = np.array([found.error(-rates[:, 0] / s.k) for rates, _ in wobbles(self.turning, LEVEL, s.place, ())])
        scale = found.error(-self.rate / s.k)
        return [
            sources.AXIS_VERTICAL_EAST.effect(s, believed.axis(0)),
            sources.AXIS_VERTICAL_NORTH.effect(s, believed.axis(1)),
            sources.INPUT_TO_OUTPUT.effect(s, believed.mount(2)),
            sources.INPUT_TO_SPIN.effect(s, believed.mount(1, -1.0)),
            sources.WOBBLE.effect(s, cone),
            sources.ANGLE_ONCE.effect(s, believed.angles(1)),
            sources.ANGLE_TWICE.effect(s, believed.angles(2)),
            sources.TORQUER_SCALE.effect(s, scale, note="relative, where it is stated"),
            DRIFT_RATE.effect(s, found.error(one / s.k)),
            sources.CURRENT_OFFSET.effect(s, found.error(-one)),
            sources.TIME_BASE.effect(s, scale, note="relative, seconds read too long"),
        ]

    def account(self, found: Findings) -> Account:
        s = self.setup
        return Account(
            method="Readings of the rebalance current at rest and at known rates in both senses; least squares under "
            "an estimated noise model [TEST-REBAL-LOOP]",
            sources=["TEST-REBAL-LOOP, REBAL-PWM, REBAL-PULSE; Hu 1981, eq. 5-62..5-76, corrected by ET16..ET18"],
            equation='omega/k - x = I_0 + kappa x + kappa_"±" abs(x) + kappa_2 x^2/I + kappa_3 x^3/I^2',
            conventions=[
                f"k = {plain(s.k * MA / DPH, 6)} °/h/mA; positive current precesses positively; x is the reading, "
                "I_0 + (1 + κ) x + … the mean current that flows.",
                f"Nonlinearities are given at the largest rate, {plain(s.largest / DPH, 6)} °/h, I = "
                f"{plain(s.full / MA, 6)} mA.",
                "The drift rate of the gyro is in the bias.",
            ],
            tables=[self._levels(found), *self.small.table()],
            reasons=[Reason("samples.std_missing", NO_STD)] if np.any(np.isnan(self.std)) else [],
            random="noise of the loop, random drift",
        )

    def _levels(self, found: Findings) -> Table:
        residual = found.y - found.X @ found.est.beta[: found.X.shape[1]]
        at_zero = -float(found.est.beta[0])  # reading at the rate 0
        rows, labels = [], self.setup.labels
        for label in dict.fromkeys(labels.values()):
            mine = np.isin(self.phase, [p for p, name in labels.items() if name == label])
            if not mine.any():
                continue
            n = int(np.sum(mine))
            scatter = float(np.std(self.x[mine], ddof=1)) if n > 1 else 0.0
            rate, x, left = (float(np.mean(v[mine])) for v in (self.rate, self.x, residual))
            due = rate / self.setup.k
            turned = abs(rate) > small_rates.SMALL * self.setup.largest
            K = 1e6 * ((x - at_zero) / due - 1.0) if turned else math.nan
            u = 1e6 * scatter / math.sqrt(n) / abs(due) if turned else math.nan
            rows.append([label, rate / DPH, x / MA, scatter / UA, K, u, left / UA, n])
        caption = (
            "Means of each rate; K: reading less that at the rate 0, over the part β of the largest rate, against the "
            "current of the largest rate [5-75]; departure: mean of the residuals of the fit"
        )
        head = ["rate", "input / (°/h)", "reading / mA", "std of a reading / µA", "K less 1 / ppm", "u(K) / ppm",
                "departure / µA", "readings"]  # fmt: skip
        return Table("readings", "Readings", caption, head, rows)

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Return the result with resolution, noise at rest, ripple and dynamic range."""
        s, x = self.setup, np.asarray(self.still["mean"], dtype=float)
        q, noise = quantum(x) * s.k / DPH, float(np.std(x, ddof=1)) * s.k / DPH
        u, closed = noise / math.sqrt(2.0 * (x.size - 1)), None
        if s.pulses is not None and q > 0.0:
            closed = s.pulses.clocks * s.pulses.current / s.pulses.f_q / s.gate * s.k / DPH
        reading = f"of a reading of {s.gate:g} s at rest"
        found = [
            _plain("resolution", f"quantum {reading}; 0: none", "°/h", q, closed=closed),
            _plain("noise", f"standard deviation {reading}", "°/h", noise, u),
        ]
        if "ripple" in self.still:
            ripple = np.asarray(self.still["ripple"], dtype=float) / ARCSEC
            spread = float(np.std(ripple, ddof=1)) / math.sqrt(x.size)
            meaning = "standard deviation of the float angle within a reading at rest"
            found.append(_plain("ripple", meaning, "″", float(np.mean(ripple)), spread))
        if s.limit > 0.0 and max(q, noise) > 0.0:
            ratio = s.limit * s.k / DPH / max(q, noise)
            meaning = "full scale over the larger of resolution and noise"
            found.append(_plain("dynamic range", meaning, "1", ratio, ratio * u / noise if noise > q else 0.0))
        threshold = self.small.coefficient(None)
        return with_values(result, [*found, *([threshold] if threshold else [])])

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        value = {c.name: c.estimate for c in coefficients}
        bias, q = value["I_0"] * UA * self.setup.k / DPH, value["resolution"]
        step = f"quantum {plain(q, 3)} °/h" if q else "not quantized"
        return [
            *told(coefficients, f"Bias {plain(bias, 4)} °/h, I_0 = {{I_0}}; scale-factor error κ = {{κ}}."),
            f"A reading of {self.setup.gate:g} s: {step}, standard deviation at rest {plain(value['noise'])} °/h.",
            *self.small.sentence(),
            *found.nuisance_sentences(),
        ]


def design(x: Array, std: Array, full: float) -> Array:
    """Return the window means (n, 5) of 1, x, |x|, x2/I and x3/I2 for normal x of this mean and standard deviation."""
    safe = np.maximum(std, 1e-30)
    z = x / safe
    folded = np.sqrt(2.0 / math.pi) * std * np.exp(-0.5 * z * z) + x * special.erf(z / math.sqrt(2.0))
    square, cube = x**2 + std**2, x**3 + 3.0 * x * std**2
    return np.column_stack([np.ones_like(x), x, folded, square / full, cube / full**2])


def quantum(x: Array) -> float:
    """Return the largest q of which all x (n,) are whole multiples, to 1e-12 A; 0 where it is not above NO_QUANTUM."""
    q, sizes = 0.0, np.abs(x)
    for n, value in enumerate(sizes.tolist(), 1):
        rest = value
        while rest > 1e-12:
            q, rest = rest, math.fmod(q, rest)
            if q - rest < 1e-12:  # a whole multiple but for rounding
                rest = 0.0
        if 0.0 < q < NO_QUANTUM:
            return 0.0
        if q > 0.0:  # Euclid's differences lose digits: fit the multiples found
            times = np.round(sizes[:n] / q)
            q = float(sizes[:n] @ times / (times @ times))
    return q


def _plain(
    name: str, meaning: str, unit: str, value: float, u: float = 0.0, closed: float | None = None
) -> Coefficient:
    """Return a value that is no unknown of the fit."""
    return Coefficient(
        name, meaning, unit, value, u, NORMAL, (value - NORMAL * u, value + NORMAL * u), u_a=u, closed=closed,
        combination={name: 1.0},
    )  # fmt: skip
