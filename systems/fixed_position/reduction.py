"""Reduction of the fixed-position test: one composite drift, its noise, its stability over repeats.

    omega_d = omega_IA - k i,   omega_IA = W I . (0, cos phi, sin phi)          a rate gyro: its rate instead of k i

mean over the readings under a noise model estimated from them.  One attitude: no coefficient can be told from another.
Repeats on several days are reduced day by day and then together (gyrobench.reduction.estimation.repeatability).
[TEST-FIXED; Hu 1981, ch. 3 par. 2.2; RED-GLS]

Not modelled: drift slower than the record beyond a linear trend, change of the attitude under load.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift.drift_terms import EARTH_ONLY, attitude_effects
from gyrobench.reduction.drift.supplies import Supplies, rebalanced
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.repeatability import reduce_days
from gyrobench.reduction.series.noise_coefficients_table import noise_coefficients_table
from gyrobench.reduction.setup.rate_gyro_bias import bias_is_all, doubts_at_rest, unanswered, word_error
from gyrobench.reduction.setup.run_metadata import rate_per_reading, reads_rate, truth_of
from gyrobench.reduction.setup.setups import SiteSetup, attitude_of, scale_factor_problems
from gyrobench.reduction.setup.sources import (
    CURRENT_OFFSET,
    CURRENT_RESOLUTION,
    GYRO_WORD,
    LATITUDE,
    TORQUER_SCALE,
    Effect,
)
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Findings, Group, Quantity, Record, plain, told
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table
from gyrobench.units import DPH

LEAST = 8  # readings
MOST = 100.0  # Earth rates that a torquer may hold at rest in a sound record
QUIETEST = 2e-6  # deg/sqrt(h), a twentieth of the best gyros' angle random walk
#: what else a reading of the Earth rate is wrong by
SCALES = ("scale", "asymmetry", "dead_band", "reset_error", "phase_error", "readout_mismatch")
RATE_SCALE = replace(TORQUER_SCALE, id="gyro.scale_factor", name="scale factor of the rate gyro", large=())


@dataclass(frozen=True, kw_only=True)
class FixedPositionSetup(SiteSetup):
    """attitude: rows I, O, S in (E, N, U).  k: torquer scale factor, rad/s/A, 1 where a rate is read.  quantum:
    resolution of the current reading.  bias: true drift of a simulated rate gyro, rad/s.
    """

    k: float
    rate: bool = False
    bias: float | None = None
    attitude: Array = field(default_factory=lambda: np.eye(3))
    quantum: float = 0.0
    supplies: Supplies = field(default_factory=Supplies)

    @property
    def xyz(self) -> Array:
        """(X, Y, Z) = -f/g0 along I, O, S."""
        return np.asarray(self.attitude @ -frames.U * self.gravity / frames.G0)

    @property
    def input_rate(self) -> float:
        """Earth rate along the input axis, rad/s."""
        return float(self.attitude[0] @ frames.earth_rate_local(self.latitude, self.earth_rate))


class Reduction(DriftReduction[FixedPositionSetup]):
    """Composite drift of one attitude, of one day or of several."""

    handling = staticmethod(handling_candidates.at_rest)

    @classmethod
    def setup_of(cls, run: RunDocument) -> FixedPositionSetup:
        return FixedPositionSetup.of(
            run,
            attitude=attitude_of(run),
            k=rate_per_reading(run),
            rate=reads_rate(run),
            bias=_true_drift(run),
            truth=truth_of(run, drift.NAMES),
            quantum=float(run.parameters.get("rebalance.resolution", 0.0)),
            supplies=Supplies() if reads_rate(run) else Supplies.of(run),
        )

    def problems(self) -> list[str]:
        s, still = self.setup, np.zeros(len(self.windows.get("mean", ())))
        problems = s.site_problems()
        problems += scale_factor_problems(s.k) + frames.rotation_problems({"attitude": s.attitude})
        problems += window_problems({"phase": still, "angle_start": still, "angle_end": still, **self.windows})
        if not problems and still.size < LEAST:
            problems.append(f"{still.size} readings: at least {LEAST} are needed to estimate the noise")
        return problems

    def regression(self) -> Regression:
        s = self.setup
        columns = ("t_start", "t_end", "mean")
        self.t0, self.t1, self.current = (np.asarray(self.windows[n], dtype=float) for n in columns)
        y = s.input_rate - s.k * self.current
        true = s.bias if s.rate else None if s.truth is None else float(drift.drift(s.xyz, s.truth))
        self.book = float(np.average(y, weights=self.t1 - self.t0))
        self.middle = (self.t0 + self.t1) / 2.0
        shown = Group("composite drift", np.arange(y.size), (self.middle - self.t0[0]) / 3600.0, "time", "h")
        meaning = "composite drift along the input axis in this attitude"
        share = dict(zip(drift.terms(9), drift.regressors(s.xyz, drift.terms(9)).tolist(), strict=True))
        wanted = replace(Quantity.of("ω_d", meaning, "deg/h", true, self.book), combination=share)
        candidates = nuisances.common(self.windows) if s.nuisances else ()
        return Regression([wanted], np.ones((y.size, 1)), y, self.t0, self.t1, [shown], candidates=candidates)

    def effects(self, found: Findings) -> list[Effect]:
        s, small = self.setup, 1e-5
        by_latitude = s.earth_rate * float(
            s.attitude[0] @ (frames.pole(s.latitude + small) - frames.pole(s.latitude - small)) / (2.0 * small)
        )
        offset, scale = found.error(-s.k), RATE_SCALE if s.rate else TORQUER_SCALE
        of_site = [
            *attitude_effects(s, found, EARTH_ONLY),
            LATITUDE.effect(s, found.error(by_latitude)),
            scale.effect(s, found.error(-s.k * self.current)),
        ]
        if s.rate:
            return [*of_site, GYRO_WORD.effect(word_error(s.parameters), offset)]
        torque = s.k * self.current
        readings = rebalanced(np.full_like(torque, s.input_rate), torque)
        return [
            *of_site,
            *s.supplies.effects(found, readings, s.xyz, self.middle),
            CURRENT_OFFSET.effect(s, offset),
            CURRENT_RESOLUTION.effect(s.quantum / 12.0**0.5, offset),
        ]

    def test(self, found: Findings) -> None:
        self.trend = _trend(found, self.middle)

    def account(self, found: Findings) -> Account:
        s, trend = self.setup, self.trend
        return Account(
            method=f"{'Rate gyro' if s.rate else 'Torque rebalance'} in one attitude; mean of the readings under an "
            "estimated noise model [TEST-FIXED]",
            sources=["TEST-FIXED; Hu 1981, ch. 3 par. 2.2", "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23"],
            equation=f'omega_d = omega_"IA" - {"omega_g" if s.rate else "k i"}, '
            'quad omega_"IA" = omega_E (I_N cos phi + I_U sin phi)',
            conventions=_conventions(s),
            closed_caption="Least squares under the noise model; closed: ω_IA − "
            + ("the mean rate" if s.rate else "k times the mean current"),
            tables=[_table(s, self.current, self.t0, self.t1, self.book)],
            reasons=[*self._of_unit(found), *doubts_at_rest(s.parameters), *unanswered(s.parameters)],
            repeatability={} if trend is None else {
                "trend over the record / (°/h)": trend[0] / DPH, "u of it / (°/h)": trend[1] / DPH,
                "record / s": float(np.ptp(self.middle)),
            },
        )  # fmt: skip

    def _of_unit(self, found: Findings) -> list[Reason]:
        """Return that a torque, or its noise, is that of no gyro: of a current in A given as mA, or the other way."""
        s = self.setup
        if s.rate or s.truth is not None or found.ideal:
            return []
        torque = abs(s.k * float(np.mean(self.current)))
        walk = found.residual_std * math.sqrt(float(np.mean(self.t1 - self.t0)) / 3600.0)
        if torque > MOST * s.earth_rate:
            rate, times = plain(torque / DPH, 3), plain(torque / s.earth_rate, 3)
            said = f"The torquer holds {rate} °/h at rest, {times} times the Earth rate"
        elif walk < QUIETEST:
            walks = f"an angle random walk of {plain(walk, 1)} °/√h"
            said = f"The readings scatter as {walks} does, less than that of any gyro"
        else:
            return []
        text = f"{said}. Is the current in the unit that is given (mA, not A), and k the scale factor of this torquer?"
        return [Reason("current.unit", text, ("pass", "fail"), severity="doubt")]

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [
            *told(coefficients, "Composite drift ω_d = {ω_d} in one attitude."),
            "The bias of the gyro is −ω_d; what depends on g is in it, which other attitudes part."
            if self.setup.rate
            else "Constant drift, unbalance and compliance are in it together; other attitudes part them.",
            found.noise_sentence("readings"),
            *found.nuisance_sentences(),
        ]

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        setup = cls.setup_of(record.run)
        return reduce_days(record, lambda windows: cls.reduce(windows, setup))

    @classmethod
    def from_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says; a long one has a table of its noise coefficients."""
        result = super().from_record(record)
        return replace(result, tables=[*result.tables, *noise_coefficients_table(result, record)])


def _true_drift(run: RunDocument) -> float | None:
    """Return the drift of a simulated rate gyro in precession sign, where its bias is all that it adds."""
    p = run.parameters
    mount = np.reshape(p.get("gyro.mount", np.eye(3)), (3, 3))
    axis = np.reshape(p.get("gyro.axes", np.eye(2, 3)), (2, 3))[0] @ mount
    straight = np.array_equal(axis, [1.0, 0.0, 0.0])
    known = straight and bias_is_all(p) and not any(np.any(p.get(f"gyro.{n}", 0.0)) for n in SCALES)
    if run.measured or not reads_rate(run) or "gyro.bias" not in p or not known or p.get("gyro.closed", 1.0) < 0.5:
        return None
    if p.get("gyro.lock_in", 0.0) and not p.get("gyro.dither", 0.0):
        return None
    return -float(np.ravel(p["gyro.bias"])[0])


def _trend(found: Findings, middle: Array) -> tuple[float, float] | None:
    """Return the change of the drift over the record and its u, rad/s: of the nuisance model where the trend is in it,
    else of an F test, which is added; None for ideal data.
    """
    span = max(float(np.ptp(middle)), 1e-9)
    names = [q.name for q in found.quantities]
    if "trend" in names:
        j, hours = names.index("trend"), span / 3600.0
        return float(found.value[j]) * hours, float(found.u[j]) * hours
    tested = found.f_test(
        "trend", "trend", ((middle - middle.mean()) / span)[:, None], "drift that changes with time",
        "the drift changes over the record; its mean holds for this record only", "no trend beyond the noise",
    )  # fmt: skip
    return None if tested is None else (float(tested[0][0]), float(tested[1][0]))


def _conventions(s: FixedPositionSetup) -> list[str]:
    rows = zip("IOS", s.attitude, strict=True)
    axes = "; ".join(f"{n} = ({', '.join(plain(v, 6) for v in row)})" for n, row in rows)
    return [
        "Drift ω_d in precession sign; the rate ω_g of axis x (input axis) is ω_IA − ω_d."
        if s.rate
        else "Drift ω_d in precession sign; k i = ω_IA − ω_d, positive current precesses positively.",
        f"Attitude, in east, north, up: {axes}.",
        *([] if s.rate else [f"k = {plain(s.k * 1e-3 / DPH, 6)} °/h/mA."]),
        "One attitude gives one number: no separation of constant, g and g² terms.",
    ]


def _table(s: FixedPositionSetup, i: Array, t0: Array, t1: Array, book: float) -> Table:
    X, Y, Z = s.xyz.tolist()
    mean = float(np.average(i, weights=t1 - t0))
    read: list[list[Any]] = (
        [["mean rate ω_g", mean / DPH, "°/h"]]
        if s.rate
        else [["mean current i", mean * 1e3, "mA"], ["k i", s.k * mean / DPH, "°/h"]]
    )
    return Table(
        "from_current_to_drift",
        "From rate to drift" if s.rate else "From current to drift",
        "Means over the record",
        ["quantity", "value", "unit"],
        [
            ["Earth rate along the input axis ω_IA", s.input_rate / DPH, "°/h"],
            *read,
            ["ω_d = ω_IA − ω_g" if s.rate else "ω_d = ω_IA − k i", book / DPH, "°/h"],
            ["X, Y, Z = −f/g0 along I, O, S", f"{X:.6f}, {Y:.6f}, {Z:.6f}", "1"],
            ["time of the readings", float(np.sum(t1 - t0)), "s"],
        ],
    )
