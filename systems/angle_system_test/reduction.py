"""Reduction of the angle system test: one least-squares fit of all readings, weighted by the variances of counts.

Errors of the reader and of the reference by harmonics, lag of the reader against the reference, ripple of one-phase
excitation, clocks of the rate readouts; readings off by whole fine cycles are named and taken out.
[ANGLE-INDUCTOSYN, READOUT-RATE]

Not modelled: noise that is not white, rate errors of the table.  Readings that drift against one another are named.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gyrobench import frames
from gyrobench.reduction.estimation.findings import NORMAL_RESIDUALS, Findings
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import Account, DriftReduction, Effect, Group, Quantity, Regression, RunDocument, told
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table
from gyrobench.units import ARCSEC

from . import harmonics
from .drifting import drifting
from .outlying import outlying
from .readings import CLOCKS, OTHER, RATES, SHOWN, AngleSystemSetup, assemble
from .sources import TABLE_RATE

ERU = frames.EARTH_RATE
COLUMNS = (
    *("phase", "t_start", "t_end", "reading", "t_reading", "reading_2", "reference", "t_reference"),
    *(f"{of}_{n}" for of in ("gate", "inverse") for n in ("number", "rate", "start", "end")),
)
NOTHING = (0.0, 0.0)  # cosine and sine of an order that a reader does not have
LISTED = 8  # slips that are listed by angle


class Reduction(DriftReduction[AngleSystemSetup]):
    """Errors of two scales on an axis, lag, ripple and clocks, from readings at rest and at constant rates."""

    @classmethod
    def setup_of(cls, run: RunDocument) -> AngleSystemSetup:
        return AngleSystemSetup.of(run)

    def problems(self) -> list[str]:
        return window_problems({k: v for k, v in self.windows.items() if not k.startswith("flagged")}, COLUMNS)

    def regression(self) -> Regression:
        self.rows, self.slips = assemble(self.windows, self.setup)
        self.kind, X = np.array(self.rows.kind), np.vstack(self.rows.X)
        self.seen = np.any(X != 0.0, axis=0)  # no gate, no degree: no clock
        wanted = [q for q, s in zip(quantities(self.setup), self.seen, strict=True) if s]
        y, weights, unit = np.concatenate(self.rows.y), 1.0 / np.concatenate(self.rows.variance), ("difference", "″")
        shown = (self._groups(), *unit, ARCSEC)
        return Regression(wanted, X[:, self.seen], y, None, None, *shown, noise="white", weights=weights)

    def _groups(self) -> list[Group]:
        """Return what is drawn: readings at rest against the angle, at rates against the rate (the line: zero, lag)."""
        at = self.rows.at
        angle, rate = np.degrees(at.angle) % 360.0, np.degrees(at.rate)
        rest = [(label, np.flatnonzero(self.kind == kind)) for kind, label in SHOWN.items()]
        groups = [Group(label, of, angle[of], "table angle", "°") for label, of in rest if of.size]
        turning = np.flatnonzero(self.kind == RATES)
        if turning.size:
            x = np.linspace(rate[turning].min(), rate[turning].max(), 21)
            line = np.zeros((x.size, self.seen.size))
            line[:, OTHER.index("c") - len(OTHER)] = 1.0
            line[:, OTHER.index("delay") - len(OTHER)] = -np.radians(x)
            dense = (x, line[:, self.seen])
            groups.append(Group("reader minus reference", turning, rate[turning], "rate", "°/s", dense))
        return groups

    def fitted(self) -> Findings:
        """Return the fit.  Its rows are readings at instants, no windows."""
        found, t = super().fitted(), self.rows.at.t
        return replace(found, data=replace(found.data, t_start=t, t_end=t))

    def effects(self, found: Findings) -> list[Effect]:
        """Return the rate of the table, by which gates and degrees are judged: faster than known, they show more."""
        clocks = [j for name, j in columns(found).items() if name in CLOCKS]
        return [TABLE_RATE.effect(self.setup, -found.X[:, clocks].sum(axis=1))]

    def test(self, found: Findings) -> None:
        """Leave normality out: rounding leaves bounded residuals, which says nothing of outliers."""
        found.tests[:] = [t for t in found.tests if t.id != NORMAL_RESIDUALS]

    def account(self, found: Findings) -> Account:
        a = self.setup
        second = "after the scale has been turned on its shaft" if a.reversal else "by a second head"
        return Account(
            method="Weighted least squares over readings at rest and at constant rates; two readings of one scale "
            "separate its errors from those of the reference [ANGLE-INDUCTOSYN]",
            sources=["ANGLE-INDUCTOSYN; Hu 1981, eq. 5-38..5-58 with ET10..ET13, ET15",
                     "READOUT-RATE; Hu 1981, eq. 5-2..5-6 with ET4"],
            equation='r = theta + E(theta) - dot(theta) tau, quad E = sum_k a_k cos k theta + b_k sin k theta, '
            'quad r - r_2 = E(theta) - E(theta + delta)',
            conventions=[
                f"The scale is read a second time {second}, at θ + {plain(math.degrees(a.head), 6)}°.",
                "Errors are reading minus angle; constants cannot be told from the zeros and are left out.",
                "Each reading counts at the instant that its time stamp states.",
            ],
            tables=[*self._of_reader(found), *self._slipped(), *self._readouts(found)],
            reasons=[*self._reasons(), *self._outlying(found)],
            random="counting and reading noise",
        )  # fmt: skip

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Return the result without Allan deviation and spectrum: several rows to an instant, and long gaps."""
        return replace(result, allan=None, psd=None)

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        high, low, local = self.around
        there = {c.name for c in coefficients}
        clocks = ", ".join(f"{n.removeprefix('clock_')} {{{n}}}" for n in CLOCKS if n in there)
        n = self.slips.cycles.size
        return [
            f"The error of the reader is {low:+.3f}″ to {high:+.3f}″ around a turn and varies by up to {local:.3f}″ "
            "within 1°.".replace("-", "−"),
            *told(
                coefficients,
                "Its lag behind the reference is {delay}.",
                f"Relative errors of the rate readouts' time bases: {clocks}." if clocks else "",
            ),
            f"{n} readings are off by whole fine cycles." if n else "No reading is off by a fine cycle.",
        ]

    def _of_reader(self, found: Findings) -> list[Table]:
        """Return harmonics and electrical errors of the reader, and what they make of a turn."""
        a, p = self.setup, self.setup.pole_pairs
        value = {q.name: float(v) for q, v in zip(found.quantities, found.value, strict=True)}
        each = {k: (value[f"cos_{k}"], value[f"sin_{k}"]) for k in a.orders}
        own = [
            [k, math.hypot(c, s) / ARCSEC, math.degrees(math.atan2(c, s)), harmonics.separation(k, a.head)]
            for k, (c, s) in each.items()
        ]
        caption = (
            "Amplitude and phase of a sin(kθ + φ). Separation: share of an order by which the two readings differ, of 2"
        )
        head = ["order", "amplitude / ″", "phase / °", "separation"]
        tables = [Table("reader.harmonics", "Harmonics of the reader", caption, head, own)]
        if 2 * p in each and 4 * p in each:
            electrical = [
                ["δ_0, quadrature", -2.0 * p * each[2 * p][0] * 1e3, "mrad electrical"],
                ["δ_e, amplitudes", 2.0 * p * each[2 * p][1] * 1e3, "1e-3"],
                ["e5 − e3, windings", p * each[4 * p][1] * 1e3, "1e-3"],
            ]
            title, caption = "Electrical errors of the reader", "By eq. 5-51, from orders 2p and 4p"
            tables.append(Table("reader.electrical", title, caption, ["error", "value", "unit"], electrical))
        waves = harmonics.waves(a.orders, np.linspace(0.0, 2.0 * math.pi, 7201))
        error = waves @ np.array([x for pair in each.values() for x in pair]) / ARCSEC
        local = max(float(np.ptp(error[k : k + 21])) for k in range(0, 7180, 20))
        self.around = float(error.max()), float(error.min()), local
        rows = list(map(list, zip(("largest", "smallest", "largest range within 1°"), self.around, strict=True)))
        title, caption = "Error of the reader around a turn", "By the harmonics above, constant left out"
        return [*tables, Table("reader.around", title, caption, ["quantity", "value / ″"], rows)]

    def _slipped(self) -> list[Table]:
        each = zip(np.degrees(self.slips.angle).tolist(), self.slips.cycles, self.slips.turning, strict=True)
        rows = [[x, int(n), "a rate" if turning else "rest"] for x, n, turning in each][:99]
        title, caption = "Readings off by whole fine cycles", "Carry of the coarse channel, or a lost angle"
        return [Table("readings.slipped", title, caption, ["table angle / °", "cycles", "at"], rows)] if rows else []

    def _readouts(self, found: Findings) -> list[Table]:
        """Return the table of rates by gates and by degrees, less what the errors of the scale make of them."""
        names, e = columns(found), found.est
        weights = np.ones_like(found.y) if found.weights is None else found.weights
        rate, rows = self.rows.at.rate, []
        spread = math.sqrt(float(np.sum(weights * e.residual**2)) / found.dof)
        for clock, kind in CLOCKS.items():
            for r in sorted(set(rate[self.kind == kind].tolist()), key=lambda v: (abs(v), -v)):
                use, j = (self.kind == kind) & (rate == r), names[clock]
                turned = found.X[use, j]  # -w T of gates, |w| T of degrees: both show rate / (1 + clock)
                weight = weights[use] * turned**2
                left = e.residual[use] + turned * e.beta[j]
                share = -float(np.sum(weight * left / turned) / np.sum(weight))
                u = spread / math.sqrt(float(np.sum(weight)))
                rows.append([kind, round(r / ERU, 6), share * 1e6, u * 1e6, u * abs(r) / ERU])
        caption = "Errors of the scale taken out; u: counting, LSB and noise. Type A"
        head = ["readout", "rate of the table / ERU", "rate read, deviation / 1e-6", "u / 1e-6", "u / ERU"]
        return [Table("rate_readouts", "Rate readouts", caption, head, rows)] if rows else []

    def _outlying(self, found: Findings) -> list[Reason]:
        weights = np.ones_like(found.y) if found.weights is None else found.weights
        if found.ideal:
            return []
        drifts = drifting(found.X, found.y, weights, self.kind.tolist(), self.rows.at.t)
        return [*outlying(found.X, found.y, weights, self.rows.at.angle), *drifts]

    def _reasons(self) -> list[Reason]:
        a, angles, found = self.setup, self.slips.angle, []
        if n := angles.size:
            at = ", ".join(f"{math.degrees(x):.2f}°" for x in angles[:LISTED])
            more = f" and {n - LISTED} more" if n > LISTED else ""
            text = (
                f"{n} readings are off by whole fine cycles of {180.0 / a.pole_pairs:g}°: at {at}{more}. The cycles "
                "are taken out before the fit, and rate readouts are not evaluated; the angle read there is wrong by "
                "them. Reduce the error of the coarse channel, or the rate."
            )
            doubt = f"{n} readings are off by whole fine cycles: the angle is ambiguous."
            found.append(Reason("readings.slipped", text))
            found.append(Reason("readings.slipped", doubt, ("pass", "fail"), severity="doubt"))
        if np.any(np.asarray(self.windows.get("flagged", 0.0)) > 0):
            text = "The reader reported a lost angle. Readings after that may be off by whole fine cycles."
            found.append(Reason("reader.lost", text))
        if mixed := ", ".join(str(k) for k in a.causes if k not in a.orders):
            text = (
                f"Not estimable for the reader: order {mixed}. Two readings {plain(math.degrees(a.head), 6)}° apart "
                "have nearly the same error there; only the difference to the reference is estimated, and rate "
                "readouts are not evaluated. Take another head angle."
            )
            found.append(Reason("reader.not_separated", text))
        return found


def columns(found: Findings) -> dict[str, int]:
    """Return the columns of the design by the names of their quantities."""
    return {q if isinstance(q, str) else q.name: j for j, q in enumerate(found.data.quantities)}


def quantities(a: AngleSystemSetup) -> list[Quantity]:
    """Return what is estimated, in the order of the columns, with true values where a simulated part has them."""
    p, own, other = a.parameters, a.causes, harmonics.meanings(a.parameters, "reference")
    true, true_ref = harmonics.truth(p, "reader"), harmonics.truth(p, "reference")
    found: list[Quantity] = []

    def add(name: str, meaning: str, k: int, value: Sequence[float] | None) -> None:
        for part, v in zip(("cos", "sin"), value or (None, None), strict=True):
            found.append(Quantity.of(name.format(part, k), meaning.format(part, k), "arcsec", v))

    for k in a.orders:
        add("{}_{}", f"reader, {{}} {{}}θ: {own[k]}", k, true.get(k, NOTHING) if true else None)
    for k in a.reference_orders:
        x, y = true_ref.get(k, NOTHING), true.get(k, NOTHING)
        known = bool(true and true_ref)
        if k in own and k not in a.orders:
            meaning = "reference minus reader, {} {}θ: both readings of the scale have the same"
            add("ref_{0}_{1} - {0}_{1}", meaning, k, (x[0] - y[0], x[1] - y[1]) if known else None)
        else:
            meaning = f"reference, {{}} {{}}θ: {other.get(k, 'order of the reader')}"
            add("ref_{}_{}", meaning, k, x if known else None)
    lag, of_reference = (a.delay_of(slot) for slot in ("reader", "reference"))
    ripple = None if lag is None else a.shift("reader")
    delay = None if lag is None or of_reference is None else lag - of_reference
    return [
        *found,
        Quantity.of("zero", "reader minus reference, constant", "arcsec"),
        Quantity.of("head", "angle of the second reading beyond its nominal one", "arcsec"),
        Quantity("delay", "lag of the reader behind the reference", "µs", 1e-6, delay),
        Quantity("ripple", "dynamic error over rate, cos 2pθ: one-phase excitation", "µs", 1e-6, ripple),
        Quantity("clock_gate", "relative error of the gate's time base", "1e-6", 1e-6, p.get("gate.clock")),
        Quantity("clock_inverse", "relative error of the inverse rate's clock", "1e-6", 1e-6, p.get("inverse.clock")),
    ]
