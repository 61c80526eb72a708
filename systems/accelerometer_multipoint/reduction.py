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
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.frames import G0
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.estimation.effects import Effect, with_set_up
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import DriftTestResult, Specification, Table
from gyrobench.units import ARCSEC

from . import closed
from .budget import effects
from .geometry import zero_angle
from .model import Model, Setup, Visits, visits
from .refusals import four_positions, position_problems, record_problems, setup_problems, zero_problems

__all__ = ["ReductionError", "Setup", "from_record", "reduce"]

UG = 1e-6
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
for _shown in SEEN.values():
    _shown["k1"] = "k1 + k3γ²"
SOURCES = [
    "TEST-ACC-MULTI, ACC-EXACT; Hu 1981, eq. 3-38..3-46",
    "RED-OLS, RED-GLS; Hu 1981, eq. 4-64..4-88, corrected by ER23",
]


def reduce(windows: Mapping[str, Array], setup: Setup) -> DriftTestResult:
    """Coefficients with uncertainties from the windows of a record (columns as in setup.window_checks, SI).

    Raises ReductionError with everything that is wrong with setup or record.
    """
    problems = setup_problems(setup) + window_problems(windows)
    if not problems:
        problems = record_problems(setup, windows)
    if problems:
        raise ReductionError(problems)
    v, gamma = visits(windows, setup), setup.gamma
    if problems := position_problems(v.mount, v.angle):
        raise ReductionError(problems)
    if np.all(v.y == v.y[0]):
        raise ReductionError("the current is the same in all positions: no accelerometer was read")
    four = four_positions(v.mount, v.angle)
    model = Model(v.mounts, four)
    zeros, k = model.solve(v, gamma)
    if all(abs(z) > 0.5 * math.pi for z in zeros.values()):
        raise ReductionError(
            "the current is positive with the input axis up, the sign of Hu 1981 is the opposite: turn its sign round "
            "(or the sense of the angle)"
        )
    if problems := zero_problems(zeros):
        raise ReductionError(problems)
    C, D = model.columns(v, zeros, gamma), model.slopes(v, zeros, gamma, k)
    # theta_0 enters as a correction to where the model is linearized, so that the data stay the data
    steps = [*model.terms, *(f"correction of θ₀ {m}" for m in model.mounts)]
    # four positions see combinations that differ a little from mount to mount: equal weights, as the formulas have them
    noise = "white" if four else "estimated"
    book, fits, why = _closed(v, setup, four)
    linear = fit(
        steps, np.column_stack([C, D]), v.y, v.t_start, v.t_end, _groups(v, model, zeros, gamma, k), "λi/g₀", "µg", UG,
        noise=noise,
    )  # fmt: skip
    start = np.concatenate([np.zeros(C.shape[1]), [zeros[m] for m in model.mounts]])
    found = linear.derive(_quantities(setup, model, book), lambda b: start + b)

    def sources(f: Findings) -> list[Effect]:
        return effects(f, model, v, zeros, k, setup)

    found = with_set_up(found, sources, setup.corrections)
    _f_tests(found, v)
    result = linear_result(
        found, system="accelerometer_multipoint", title="Multi-position test of a pendulous accelerometer",
        method=f"{closed.spacing(v.angle)[0]} positions about a horizontal axis, {_mounts(v)}; least squares over all "
        "positions [TEST-ACC-MULTI]",
        sources=SOURCES, equation=_equation(model), conventions=_conventions(setup, model),
        effects=sources(found), specification=setup.specification, site=setup.site,
        instrument=setup.instrument, simulated=setup.truth is not None, no_closed=why, errors=setup.errors,
        closed_caption="From the same data; where both mounts give a coefficient, the mean of the two",
        tables=_tables(fits), harmonics=_harmonics(v, four, linear), repeatability=_repeatability(found, v),
        warnings=_warnings(model, setup), random="noise of the accelerometer and scatter of the positions",
    )  # fmt: skip
    result.summary = _summary(result, found)
    return result


def _mounts(v: Visits) -> str:
    return "mounts a and b" if len(v.mounts) == 2 else f"mount {v.mounts[0]}"


def _groups(v: Visits, model: Model, zeros: Mapping[str, float], gamma: float, k: Array) -> list[Group]:
    out = []
    for m in model.mounts:
        rows = np.flatnonzero(v.mount == m)
        dense = np.radians(np.arange(0.0, 361.0, 3.0))
        many = Visits(np.full(dense.size, m), dense, dense, dense, np.zeros_like(dense), math.nan)
        X = np.column_stack([model.columns(many, zeros, gamma), model.slopes(many, zeros, gamma, k)])
        shown = np.degrees(np.mod(v.angle[rows] + closed.EQUAL, 2.0 * math.pi) - closed.EQUAL)
        out.append(Group(f"mount {m}", rows, shown, "angle of the head", "°", (np.degrees(dense), X)))
    return out


def _closed(v: Visits, s: Setup, four: bool) -> tuple[dict[str, float], dict[str, dict[str, float]], str]:
    """Closed formulas: the mean of the mounts, those of each mount, and why there are none ("" when there are)."""
    fits = {}
    for m in v.mounts:
        mine = v.mount == m
        n, uneven = closed.spacing(v.angle[mine])
        if uneven:
            return {}, {}, f"the positions of mount {m} are not equally spaced ({uneven})"
        if not four and n < closed.LEAST:
            return {}, {}, f"mount {m} has {n} positions, three harmonics need {closed.LEAST} [ACC-MINPTS]"
        if four:
            fits[m] = closed.four_points(v.angle[mine], v.y[mine], s.gamma)
        else:
            fits[m] = closed.formulas(closed.harmonics(v.angle[mine], v.y[mine]), m, s.gamma)
    out = {f"θ₀ {m}": f["theta0"] for m, f in fits.items()}
    for name in KS:
        values = [f[name] for f in fits.values() if name in f]
        if values:
            out[name] = float(np.mean(values))
    return out, fits, ""


def _quantities(s: Setup, model: Model, book: Mapping[str, float]) -> list[Quantity]:
    truth: dict[str, float] = dict(s.truth or {})
    zeros = {m: (s.zeros or {}).get(m, 0.0) for m in model.mounts}
    shown: Mapping[str, str] = {}
    note = ""
    if model.four:
        if truth:
            truth |= closed.stands_for(truth, zeros, s.gamma)
        shown = SEEN[tuple(model.mounts)]
        note = ", as four positions see it"
    out = []
    for name in model.terms:
        meaning, unit, size = MEANING[name]
        out.append(Quantity(name, meaning + note, unit, size, truth.get(name), book.get(name), shown.get(name, "")))
    for m in model.mounts:
        meaning = f"zero of the head and error of the input axis, mount {m}"
        out.append(Quantity(f"θ₀ {m}", meaning, "″", ARCSEC, (s.zeros or {}).get(m), book.get(f"θ₀ {m}")))
    return out


def _f_tests(found: Findings, v: Visits) -> None:
    """Harmonics beyond the third, and turn against turn, as far as the data allow."""
    columns, later = [], []
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
        "harmonics_4_and_higher", "harmonics 4 and higher", np.column_stack(columns) if columns else empty,
        "errors of the head's positions and terms beyond the third order",
        "something goes with the angle that the model does not hold", "no more than noise",
    )  # fmt: skip
    found.f_test(
        "turn_to_turn",
        "turn to turn",
        np.column_stack(later) if later else empty,
        "change of bias and scale factor between turns",
        "the turns differ by more than the noise",
        "the turns agree within the noise",
    )


def _repeatability(found: Findings, v: Visits) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for test in found.tests:
        if test.name == "turn to turn":
            out |= {"F": test.statistic, "p": test.p, "finding": test.finding}
    if math.isfinite(v.within):
        out["scatter of the readings within a position / µg"] = v.within / UG
    return out


def _harmonics(v: Visits, four: bool, linear: Findings) -> list[dict[str, Any]]:
    out: list[dict[str, Any]] = []
    for m in v.mounts:
        mine = v.mount == m
        n, uneven = closed.spacing(v.angle[mine])
        if uneven or n < closed.LEAST:
            continue
        h = closed.harmonics(v.angle[mine], v.y[mine])
        u = linear.residual_std / math.sqrt(mine.sum())
        for n in range(4):
            b = h[f"B{n}"] / UG if n else None
            size = u * (math.sqrt(2.0) if n else 1.0)
            out.append({"series": f"mount {m}", "n": n, "a": h[f"A{n}"] / UG, "b": b, "u": size, "unit": "µg"})
    return out


def _tables(fits: Mapping[str, Mapping[str, float]]) -> list[Table]:
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
    return [Table("the_two_mounts_apart", "The two mounts apart", caption, head, rows)]


def _equation(model: Model) -> str:
    cross = {"k4": " + k_4 X Y", "k5": " + k_5 X Z"}
    more = "" if model.four else " + k_3 X^3" + "".join(cross[k] for k in model.terms[4:])
    return "(lambda i)/g_0 = k_0 + k_1 X + k_2 X^2" + more + ", quad X = -gamma sin(theta + theta_0)"


def _conventions(s: Setup, model: Model) -> list[str]:
    return [
        "X, Y, Z = −f/g0 along input, output and pendulum axis (sign of Hu 1981: an axis that points up reads −γ); "
        "g0 = 9.80665 m/s². Against +f/g0 k1 and k3 change sign; k0, k2, k4, k5 do not.",
        f"k are multiples of g0 with λ = {s.scale / G0 * 1e-3:.9g} g0/mA; γ = g/g0 = {s.gamma:.7f}.",
        "θ counts from where the input axis is level, in the sense in which it rises; θ₀ is the zero of the head and "
        "the error of the input axis together, which no multi-position test separates.",
        "All readings of one visit of a position are one datum.",
        *(f"k{4 if m == 'a' else 5} is not seen in mount {m} and not estimated." for m in model.mounts
          if len(model.mounts) == 1 and not model.four),
    ]  # fmt: skip


def _warnings(model: Model, s: Setup) -> list[str]:
    out = []
    if model.four:
        out.append(
            "Four positions: the third order is in k1 (k1 + k3 γ²), and k0 and k2 hold the cross term times tan 2θ₀; "
            "8 positions or more tell them apart."
        )
    if s.u_angle > 0.0 and not model.four:
        out.append(
            "Errors of the head with sin θ look like k4 and k5, those with cos θ like k0 and k2: see the budget."
        )
    return out


def _summary(result: DriftTestResult, found: Findings) -> list[str]:
    by = {c.name.split(" ")[0]: c for c in result.coefficients}
    third = max((c for c in result.coefficients if "/g" in c.unit and "µ" in c.unit), key=lambda c: abs(c.estimate))
    return [
        f"Bias {by['k0'].name} = {plus_minus(by['k0'])}; scale factor {by['k1'].name} = {plus_minus(by['k1'])}.",
        f"Largest nonlinearity: {third.name} = {plus_minus(third)}.",
        found.noise_sentence("positions"),
    ]


def setup_of(run: RunDocument, specification: Specification | None = None) -> Setup:
    """Return the setup a run.json describes.  Truth only where the accelerometer has the coefficients."""
    site = run_metadata.Site.of(run)
    mounts = {p: row.face for p, row in run_metadata.phases(run, ("a", "b")).items()}
    truth = run_metadata.truth_of(run, KS, "accelerometer")
    zeros = None
    if truth is not None and set(truth) == set(KS):
        axes = run.parameters.get("accelerometer.mount", np.eye(3))
        zeros = {m: zero_angle(m, axes) for m in sorted(set(mounts.values()))}
    return Setup.of(
        run,
        specification,
        gravity=site.gravity,
        scale=run_metadata.number(run, "scale", "accelerometer.scale", "scale λ"),
        mounts=mounts,
        truth=truth if zeros is not None else None,
        zeros=zeros,
        quantum=float(run.parameters.get("accelerometer.resolution", 0.0)),
        site={"gravity / (m/s²)": site.gravity} if run.measured else site.shown(),
    )


@handling_errors.examined(handling_candidates.head)
def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a gyrobench.record.record.Record, with its run.json as provenance."""
    return run_metadata.finish(reduce(record.windows, setup_of(record.run, specification)), record)
