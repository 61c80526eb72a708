"""Reduction of the multi-position test: the polynomial of an accelerometer from its currents under gravity.

    lambda i/g0 = k0 + k1 X + k2 X2 + k3 X3 + k4 X Y + k5 X Z,       (X, Y, Z) at theta + theta_0, see geometry.py

All readings of one visit of a position are one datum (an error of the position is common to them).  Least squares over
both mounts, by Gauss-Newton in the two theta_0, all else being linear; the closed formulas of each mount stand beside
it.  k are multiples of g0 = 9.80665 m/s2 (per g0^n).  [TEST-ACC-MULTI; Hu 1981, eq. 3-38..3-46]

A tilt of the axis of the head and a mount error other than theta_0 are in the budget (budget.py), to first order.

Not modelled: their squares, a change of the coefficients during the test.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench.frames import G0
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.diagnosis.scale_mistakes import FORCES, factor_sentence
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.setup.run_metadata import Location, number, phases, truth_of
from gyrobench.reduction.setup.setups import weighed
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Effect, Findings, Group, Quantity, plain, told
from gyrobench.result import Coefficient, DriftTestResult, Harmonic, Reason, Table
from gyrobench.units import ARCSEC

from . import budget, closed
from .geometry import zero_angle
from .model import MultipointSetup, Polynomial, Visits, visits
from .refusals import four_positions, position_problems, record_problems, setup_problems, zero_problems
from .sources import PLACES

UG = 1e-6
FAR = 0.1  # of the scale, from which on something else than the accelerometer is meant
KS = ("k0", "k1", "k2", "k3", "k4", "k5")
MEANING = {
    "k0": ("bias", "µg", UG),
    "k1": ("scale factor against λ", "g/g", 1.0),
    "k2": ("second order in the specific force along the input axis", "µg/g²", UG),
    "k3": ("third order in the specific force along the input axis", "µg/g³", UG),
    "k4": ("cross term of input and output axis", "µg/g²", UG),
    "k5": ("cross term of input and pendulum axis", "µg/g²", UG),
}
SEEN = {  # what four positions see, see closed.py
    ("a",): {"k0": "k0 + ½k5γ² tan 2θ₀", "k2": "k2 − k5 tan 2θ₀"},
    ("b",): {"k0": "k0 − ½k4γ² tan 2θ₀", "k2": "k2 + k4 tan 2θ₀"},
    ("a", "b"): {"k0": "k0 + ¼γ²(k5 tan 2θ₀a − k4 tan 2θ₀b)", "k2": "k2 − ½(k5 tan 2θ₀a − k4 tan 2θ₀b)"},
}
ROUNDING = 1e-12  # of gravity; the noise of an accelerometer is less than 1e-6 of it
CUBIC = "k1 + k3γ²"
TURNS = "turns.agree"  # id of the test
WRONG_SIGN = (
    "the current is positive with the input axis up, the sign of Hu 1981 is the opposite: turn its sign round (or the "
    "sense of the angle)"
)


class Reduction(DriftReduction[MultipointSetup]):
    """The polynomial of an accelerometer from the windows of a record (columns as in setup.window_checks)."""

    handling = staticmethod(handling_candidates.head)

    @classmethod
    def setup_of(cls, run: RunDocument) -> MultipointSetup:
        """Return the setup that a run.json describes.  Truth only where the accelerometer has the coefficients."""
        site = Location.of(run)
        mounts = {p: row.face for p, row in phases(run, ("a", "b")).items()}
        truth, zeros = truth_of(run, KS, "accelerometer"), None
        if truth is not None and set(truth) == set(KS):
            axes = run.parameters.get("accelerometer.mount", np.eye(3))
            zeros = {m: zero_angle(m, axes) for m in sorted(set(mounts.values()))}
        return MultipointSetup.of(
            run,
            gravity=site.gravity,
            scale=number(run, "scale", "accelerometer.scale", "scale λ"),
            mounts=mounts,
            truth=truth if zeros is not None else None,
            zeros=zeros,
            nuisances=weighed(run),
            places_stated=not run.measured or run.type_b == "none" or not run.type_b_stated,
            quantum=float(run.parameters.get("accelerometer.resolution", 0.0)),
            site={"gravity / (m/s²)": site.gravity} if run.measured else site.shown(),
        )

    def problems(self) -> list[str]:
        return setup_problems(self.setup) + window_problems(self.windows) or record_problems(self.setup, self.windows)

    def regression(self) -> Regression:
        s, gamma = self.setup, self.setup.gamma
        self.v = v = visits(self.windows, s)
        if problems := position_problems(v.mount, v.angle):
            raise ReductionError(problems)
        if np.all(v.y == v.y[0]):
            raise ReductionError("the current is the same in all positions: no accelerometer was read")
        self.four = four_positions(v.mount, v.angle)
        self.model = Polynomial(v.mounts, self.four)
        self.zeros, self.k = self.model.solve(v, gamma)
        if all(abs(z) > 0.5 * math.pi for z in self.zeros.values()):
            raise ReductionError(WRONG_SIGN)
        if problems := zero_problems(self.zeros):
            raise ReductionError(problems)
        self.book, self.fits, self.no_closed = self._closed()
        # theta_0 enters as a correction to where the model is linearized, so that the data stay the data
        steps = [*self.model.terms, *(f"correction of θ₀ {m}" for m in self.model.mounts)]
        groups = [self._group(m) for m in self.model.mounts]
        # four positions see combinations that differ a little from mount to mount: equal weights, as the formulas
        noise = "white" if self.four else "estimated"
        X = self._columns(v)
        back = budget.places(v, X[:, len(self.model.terms) :].sum(axis=1)) if s.nuisances and not PLACES.size(s) else []
        unit = ("λi/g₀", "µg", UG)
        return Regression(steps, X, v.y, v.t_start, v.t_end, groups, *unit, noise, candidates=back, ideal=ROUNDING)

    def _columns(self, v: Visits) -> Array:
        where = (v, self.zeros, self.setup.gamma)
        return np.column_stack([self.model.columns(*where), self.model.slopes(*where, self.k)])

    def _group(self, m: str) -> Group:
        rows = np.flatnonzero(self.v.mount == m)
        dense = np.radians(np.arange(0.0, 361.0, 3.0))
        many = Visits(np.full(dense.size, m), dense, dense, dense, np.zeros_like(dense), math.nan)
        shown = np.degrees(np.mod(self.v.angle[rows] + closed.EQUAL, 2.0 * math.pi) - closed.EQUAL)
        return Group(f"mount {m}", rows, shown, "angle of the head", "°", (np.degrees(dense), self._columns(many)))

    def _closed(self) -> tuple[dict[str, float], dict[str, dict[str, float]], str]:
        """Return the closed formulas: the mean of the mounts, those of each mount, and why there are none."""
        fits, v, s = {}, self.v, self.setup
        for m in v.mounts:
            mine = v.mount == m
            n, uneven = closed.spacing(v.angle[mine])
            if uneven:
                return {}, {}, f"the positions of mount {m} are not equally spaced ({uneven})"
            if not self.four and n < closed.LEAST:
                return {}, {}, f"mount {m} has {n} positions, three harmonics need {closed.LEAST} [ACC-MINPTS]"
            if self.four:
                fits[m] = closed.four_points(v.angle[mine], v.y[mine], s.gamma)
            else:
                fits[m] = closed.formulas(closed.harmonics(v.angle[mine], v.y[mine]), m, s.gamma)
        out = {f"θ₀ {m}": f["theta0"] for m, f in fits.items()}
        means = {n: [f[n] for f in fits.values() if n in f] for n in KS}
        return out | {n: float(np.mean(values)) for n, values in means.items() if values}, fits, ""

    def derived(self, found: Findings) -> Findings:
        """Return the fit with theta_0 itself in place of its correction."""
        s, model, book = self.setup, self.model, self.book
        truth: dict[str, float] = dict(s.truth or {})
        shown, note = {}, ""
        if self.four:
            if truth:
                truth |= closed.stands_for(truth, {m: (s.zeros or {}).get(m, 0.0) for m in model.mounts}, s.gamma)
            shown, note = {**SEEN[tuple(model.mounts)], "k1": CUBIC}, ", as four positions see it"
        quantities = []
        for name in model.terms:
            meaning, unit, size = MEANING[name]
            known = truth.get(name), book.get(name)
            quantities.append(Quantity(name, meaning + note, unit, size, *known, shown.get(name, "")))
        for m in model.mounts:
            meaning = f"zero of the head and error of the input axis, mount {m}"
            known = (s.zeros or {}).get(m), book.get(f"θ₀ {m}")
            quantities.append(Quantity(f"θ₀ {m}", meaning, "″", ARCSEC, *known))
        start = np.concatenate([np.zeros(len(model.terms)), [self.zeros[m] for m in model.mounts]])
        self.linear = found
        return found.derive(quantities, lambda b: start + b)

    def effects(self, found: Findings) -> list[Effect]:
        return budget.effects(found, self.model, self.v, self.zeros, self.k, self.setup)

    def test(self, found: Findings) -> None:
        """Add F tests of harmonics beyond the third, and of turn against turn, as far as the data allow."""
        columns, later, v = [], [], self.v
        for m in v.mounts:
            mine = v.mount == m
            n, uneven = closed.spacing(v.angle[mine])
            for h in range(4, min(6, (n - 1) // 2) + 1):
                columns += [np.where(mine, f(h * v.angle), 0.0) for f in (np.cos, np.sin)]
            if not uneven:
                turn = np.cumsum(mine) - 1
                for k in range(1, int(mine.sum()) // n):
                    here = mine & (turn // n == k)
                    later += [np.where(here, f, 0.0) for f in (np.ones_like(v.y), np.cos(v.angle), np.sin(v.angle))]
        empty = np.empty((v.y.size, 0))
        found.f_test(
            "harmonics.high", "harmonics 4 and higher", np.column_stack(columns) if columns else empty,
            "errors of the head's positions and terms beyond the third order",
            "something goes with the angle that the model does not hold", "no more than noise",
        )  # fmt: skip
        found.f_test(
            TURNS, "turn to turn", np.column_stack(later) if later else empty,
            "change of bias and scale factor between turns", "the turns differ by more than the noise",
            "the turns agree within the noise",
        )  # fmt: skip

    def account(self, found: Findings) -> Account:
        v, s, model = self.v, self.setup, self.model
        mounts = "mounts a and b" if len(v.mounts) == 2 else f"mount {v.mounts[0]}"
        cross = {"k4": " + k_4 X Y", "k5": " + k_5 X Z"}
        more = "" if self.four else " + k_3 X^3" + "".join(cross[k] for k in model.terms[4:])
        return Account(
            method=f"{closed.spacing(v.angle)[0]} positions about a horizontal axis, {mounts}; least squares over all "
            "positions [TEST-ACC-MULTI]",
            sources=[
                "TEST-ACC-MULTI, ACC-EXACT; Hu 1981, eq. 3-38..3-46",
                "RED-OLS, RED-GLS; Hu 1981, eq. 4-64..4-88, corrected by ER23",
            ],
            equation=f"(lambda i)/g_0 = k_0 + k_1 X + k_2 X^2{more}, quad X = -gamma sin(theta + theta_0)",
            conventions=[
                "X, Y, Z = −f/g0 along input, output and pendulum axis (sign of Hu 1981: an axis that points up reads "
                "−γ); g0 = 9.80665 m/s². Against +f/g0 k1 and k3 change sign; k0, k2, k4, k5 do not.",
                f"k are multiples of g0 with λ = {plain(s.scale / G0 * 1e-3, 9)} g0/mA; γ = g/g0 = {s.gamma:.7f}.",
                "θ counts from where the input axis is level, in the sense in which it rises; θ₀ is the zero of the "
                "head and the error of the input axis together, which no multi-position test separates.",
                "All readings of one visit of a position are one datum.",
                *(
                    f"k{4 if m == 'a' else 5} is not seen in mount {m} and not estimated."
                    for m in model.mounts
                    if len(model.mounts) == 1 and not self.four
                ),
            ],
            no_closed=self.no_closed,
            closed_caption="From the same data; where both mounts give a coefficient, the mean of the two",
            tables=_mounts_apart(self.fits),
            repeatability=self._repeatability(found),
            reasons=self._reasons(),
            random="noise of the accelerometer and scatter of the positions",
        )

    def _repeatability(self, found: Findings) -> dict[str, Any]:
        out: dict[str, Any] = {}
        for test in (t for t in found.tests if t.id == TURNS):
            out |= {"F": test.statistic, "p": test.p, "finding": test.finding}
        if math.isfinite(self.v.within):
            out["scatter of the readings within a position / µg"] = self.v.within / UG
        return out

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Return the result with the harmonics of each mount; a scale that is 10 % off is that of no accelerometer."""
        k1 = next((c.estimate for c in result.coefficients if c.name.startswith("k1")), 1.0)
        far = []
        if not abs(k1 - 1.0) < FAR:
            far = [Reason("force.factor", factor_sentence(k1, FORCES), ("pass", "fail"), severity="doubt")]
        return replace(result, harmonics=self._harmonics(), reasons=[*result.reasons, *far])

    def _harmonics(self) -> list[Harmonic]:
        out = []
        for m in self.v.mounts:
            mine = self.v.mount == m
            n, uneven = closed.spacing(self.v.angle[mine])
            if uneven or n < closed.LEAST:
                continue
            h = closed.harmonics(self.v.angle[mine], self.v.y[mine])
            u = self.linear.residual_std / math.sqrt(mine.sum())
            for n in range(4):
                b = h[f"B{n}"] / UG if n else None
                size = u * (math.sqrt(2.0) if n else 1.0)
                out.append(Harmonic(f"mount {m}", n, h[f"A{n}"] / UG, b, size, "µg"))
        return out

    def _reasons(self) -> list[Reason]:
        if self.four:
            text = (
                "Four positions: the third order is in k1 (k1 + k3 γ²), and k0 and k2 hold the cross term times "
                "tan 2θ₀; 8 positions or more tell them apart."
            )
            return [Reason("positions.four", text)]
        if PLACES.size(self.setup) > 0.0:
            text = "Errors of the head with sin θ look like k4 and k5, those with cos θ like k0 and k2: see the budget."
            return [Reason("head.aliased", text)]
        return []

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        bias, scale = coefficients[0].name, coefficients[1].name
        higher = [c for c in coefficients if "/g" in c.unit and "µ" in c.unit]
        largest = max(higher, key=lambda c: abs(c.estimate)).name
        return [
            *told(
                coefficients,
                f"Bias {bias} = {{{bias}}}; scale factor {scale} = {{{scale}}}.",
                f"Largest nonlinearity: {largest} = {{{largest}}}.",
            ),
            found.noise_sentence("positions"),
            *found.nuisance_sentences(),
        ]


def _mounts_apart(fits: Mapping[str, Mapping[str, float]]) -> list[Table]:
    if len(fits) < 2:
        return []
    rows: list[list[Any]] = []
    for name in ("k0", "k1", "k2", "k3"):
        if name in fits["a"]:
            unit, offset = (MEANING[name][1], 0.0) if name != "k1" else ("µg/g", 1.0)
            a, b = (fits["a"][name] - offset) / UG, (fits["b"][name] - offset) / UG
            rows.append(["k1 − 1" if offset else name, a, b, a - b, unit])
    caption = "Closed formulas of each mount alone: the difference should be scatter"
    head = ["coefficient", "mount a", "mount b", "difference", "unit"]
    return [Table("mounts.apart", "The two mounts apart", caption, head, rows)]
