"""Reduction of the two-axis tumble: nine drift coefficients of a floated gyro from currents averaged at rest.

    y = omega_IA - k i = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_SS Z2 + D_IO XY + D_OS YZ + D_IS XZ + noise

Least squares on X, Y, Z themselves, from the angles that were read: any positions will do that have rank 9.  The
harmonic route stands beside it where ratio and positions allow it.  The noise (white, Gauss-Markov or both) is
estimated from the same record.  [TEST-TUMBLE2-SDF, TUM2AX-LS; Hu 1981, eq. 3-47..3-53]

Not modelled: change of the drift with time, torquer nonlinearity (a line of the budget).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.drift.pulses import Pulses, Windows
from gyrobench.reduction.estimation import nuisances, regression
from gyrobench.reduction.estimation.effects import Effect, with_set_up
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.setups import RebalanceSetup, scale_factor_problems
from gyrobench.reduction.setup.sources import (
    ANGLE_OF,
    CURRENT_OFFSET,
    CURRENT_RESOLUTION,
    OUTER_POLE_EAST,
    OUTER_POLE_NORMAL,
    SQUARE,
    TORQUER_NONLINEARITY,
    TORQUER_SCALE,
    TURNED,
    WOBBLE_OF,
)
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import DriftTestResult, Specification, Table
from gyrobench.units import DPH

from . import closed, geometry
from .geometry import ANGLES

__all__ = ["ReductionError", "TwoAxisSetup", "from_record", "reduce"]

COLUMNS = ("phase", "t_start", "t_end", *ANGLES, "mean")
STILL = 1e-4  # rad that a table may move while the current is averaged (20 arcsec: encoders jitter)
SMALL = 1e-5  # rad, step of the geometric perturbations (they are linear to 1e-10)
FOLDED = {"D_F": "D_F + γ² D_OO", "D_II": "D_II − D_OO", "D_SS": "D_SS − D_OO"}


@dataclass(frozen=True, kw_only=True)
class TwoAxisSetup(RebalanceSetup):
    """k: torquer scale factor, rad/s/A.  m, n: ratio of the angles.  harmonic: the harmonic route is insisted on.
    path: the positions lie on the path of this ratio, and not anywhere.
    quantum: resolution of the current reading.  pulses: those of a pulse-width rebalance, where it was counted.
    """

    k: float
    m: int = 5
    n: int = 1
    harmonic: bool = False
    path: bool = True
    quantum: float = 0.0
    pulses: Pulses | None = None
    u_pulse: float = 0.0
    u_switching: float = 0.0
    u_square: float = 0.0
    u_angle1: float = 0.0
    u_angle2: float = 0.0
    u_wobble: float = 0.0


def cautions(latitude: float, m: int, n: int, positions: int) -> list[str]:
    """What to expect of positions that are allowed but weak."""
    if geometry.refusals(latitude, m, n, positions):
        return []
    seen = regression.examine(geometry.design(latitude, m, n, positions), geometry.NAMES)
    return [f"Condition {seen.condition:.3g}: hardly seen is {seen.weakest}."] if seen.condition > 100.0 else []


def reduce(windows: Mapping[str, Array], setup: TwoAxisSetup) -> DriftTestResult:
    """Coefficients with uncertainties from the windows of a record (SI).

    Columns phase (number of the position), t_start, t_end, outer_start, outer_end, inner_start, inner_end, mean.
    Raises ReductionError with everything that is wrong with setup or record.
    """
    s = setup
    problems = _setup_problems(s) + window_problems(windows, COLUMNS)
    if not problems:
        problems = _position_problems(windows)
    if problems:
        raise ReductionError(problems)
    w = {c: np.asarray(windows[c], dtype=float) for c in COLUMNS}
    outer, inner = ((w[f"{a}_start"] + w[f"{a}_end"]) / 2.0 for a in ("outer", "inner"))
    current = w["mean"] if s.polarity == "project" else -w["mean"]
    spread = np.asarray(windows.get("std", np.zeros_like(current)), dtype=float)
    readings = Windows(current, spread, w["t_end"] - w["t_start"])
    C = geometry.attitude(s.latitude, outer, inner)
    rate = C[:, 0] @ frames.earth_rate_local(s.latitude, s.earth_rate)
    y = rate - s.k * current
    X = _design(s, C)
    weighed = _candidates(s, windows, C, rate, X, y) if s.nuisances else []
    theta, book, harmonics, ties, why = _harmonic_route(s, w["phase"], w["t_end"] - w["t_start"], outer, inner, y)
    if s.harmonic and why:
        raise ReductionError(why)
    found = fit(
        [_quantity(s, n, book) for n in geometry.NAMES], X, y, w["t_start"], w["t_end"],
        [_group(s, theta) if s.path else _visited(w["phase"])],
        "drift rate", "°/h", DPH, candidates=weighed,
    )  # fmt: skip
    found = with_set_up(found, lambda f: _effects(s, f, outer, inner, C, readings), s.corrections)
    if s.path:
        _model_test(found, theta)
        _cycle_test(found, theta)
    warnings = []
    if s.fold:
        warnings.append(
            "D_OO is folded: at constant |g| only D_F + γ² D_OO, D_II − D_OO and D_SS − D_OO can be had (γ = g/g0 = "
            f"{s.gravity / frames.G0:.6f}); separating them needs |f| ≠ 1 g, a centrifuge."
        )
    result = linear_result(
        found,
        system="tumble_two_axis",
        title="Two-axis tumble test of a floated gyro",
        method=f"Torque-rebalance tumble on two axes {_where(s)}, averaged at rest; least squares over "
        "all windows under an estimated noise model [TEST-TUMBLE2-SDF]",
        sources=[
            "TEST-TUMBLE2-SDF, TUM2AX-REDUCE, TUM2AX-LS; Hu 1981, eq. 3-47..3-53, corrected by E30-E34",
            "GYRO-STATIC-9; Hu 1981, eq. 2-36, 2-47",
            "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
        ],
        equation='omega_"IA" - k i = omega_d = D_F + D_I X + D_O Y + D_S Z + D_"II" X^2 + D_"SS" Z^2 + D_"IO" X Y + '
        'D_"OS" Y Z + D_"IS" X Z',
        conventions=_conventions(s),
        effects=_effects(s, found, outer, inner, C, readings),
        **s.reported(),
        no_closed="; ".join(why),
        closed_caption="From the means of the positions; the harmonic route fits 25 amplitudes where nine would do",
        tables=ties,
        harmonics=harmonics,
        warnings=warnings,
    )
    linear = max((c for c in result.coefficients if c.unit == "°/h/g"), key=lambda c: abs(c.estimate))
    first = result.coefficients[0]
    result.summary = [
        f"Constant drift {first.name} = {plus_minus(first)}.",
        f"Largest drift per g: {linear.name} = {plus_minus(linear)}.",
        found.noise_sentence(),
        *found.nuisance_sentences(),
    ]
    return result


def _setup_problems(s: TwoAxisSetup) -> list[str]:
    problems = frames.latitude_problems(s.latitude)
    if not problems and abs(math.degrees(s.latitude)) > 85.0:
        problems = geometry.refusals(s.latitude, 5, 1, 36)
    return problems + s.problems() + scale_factor_problems(s.k)


def _position_problems(w: Mapping[str, Array]) -> list[str]:
    """Tables that move while sampling, too few positions, a position at two places."""
    found = []
    for axis in ("outer", "inner"):
        moved = np.abs(np.asarray(w[f"{axis}_end"]) - np.asarray(w[f"{axis}_start"]))
        bad = np.flatnonzero(moved > STILL)
        if bad.size:
            found.append(
                f"row {int(bad[0]) + 1}{f' and {bad.size - 1} more' if bad.size > 1 else ''}: the {axis} axis moves by "
                f"{math.degrees(moved[bad[0]]):.3g}° while the current is averaged; its rate enters the reading: "
                "average at rest only"
            )
    turn = 2.0 * math.pi
    places = {
        (round(float(a) % turn, 3) % round(turn, 3), round(float(b) % turn, 3) % round(turn, 3))
        for a, b in zip(w["outer_start"], w["inner_start"], strict=True)
    }
    if not found and len(places) < len(geometry.NAMES):
        found.append(
            f"{len(places)} different positions for {len(geometry.NAMES)} coefficients: at least {len(geometry.NAMES)}"
        )
    return found


def _design(s: TwoAxisSetup, C: Array) -> Array:
    """Regressors (k, 9) in attitudes (k, 3, 3)."""
    return drift.regressors(-C @ frames.U * (s.gravity / frames.G0), geometry.NAMES)


def _candidates(
    s: TwoAxisSetup, windows: Mapping[str, Array], C: Array, rate: Array, X: Array, y: Array
) -> list[Candidate]:
    """Set-up effects: misalignments of the input axis, trend, temperature, torquer.  Turned about the inner axis,
    output and spin axis see the Earth rate by the cosine and the sine of its angle; the drift that the axis sees with
    them is that of least squares.
    """
    earth, start = frames.earth_rate_local(s.latitude, s.earth_rate), np.linalg.lstsq(X, y, rcond=None)[0]

    def misalignment(k: int) -> Array:
        other = frames.rotation(np.eye(3)[k], SMALL) @ C
        out: Array = (other[:, 0] @ earth - rate - (_design(s, other) - X) @ start) / SMALL
        return out

    text = "misalignment of the input axis towards the"
    return [
        Candidate.of("ε_IO", f"{text} output axis", "arcsec", misalignment(2)),
        Candidate.of("ε_IS", f"{text} spin axis", "arcsec", -misalignment(1)),
        *nuisances.common(windows),
        *nuisances.torquer(nuisances.fitted(rate, X, y)),
    ]


def _quantity(s: TwoAxisSetup, name: str, book: Mapping[str, float]) -> Quantity:
    truth = None
    if s.truth is not None:
        oo = s.truth.get("D_OO", 0.0)
        extra = {"D_F": oo * (s.gravity / frames.G0) ** 2, "D_II": -oo, "D_SS": -oo}.get(name, 0.0)
        truth = s.truth.get(name, 0.0) + extra
    q = Quantity.drift(name, truth, book.get(name))
    if s.fold and name in FOLDED:
        q = replace(q, shown=FOLDED[name], meaning=f"{q.meaning}, with D_OO folded in")
    return q


def _where(s: TwoAxisSetup) -> str:
    return f"in the ratio {s.m}:{s.n}" if s.path else "in positions chosen one by one"


def _visited(phase: Array) -> Group:
    """Drift against the number of the visit, where the positions lie on no path."""
    return Group("positions", np.arange(phase.size), phase, "number of the position", "")


def _group(s: TwoAxisSetup, theta: Array) -> Group:
    dense = np.radians(np.arange(0.0, 360.5, 0.5))
    curve = _design(s, geometry.attitude(s.latitude, s.m * dense, s.n * dense))
    x = np.degrees(np.mod(theta + 1e-9, 2.0 * math.pi))
    return Group(f"positions {s.m}:{s.n}", np.arange(theta.size), x, "θ", "°", (np.degrees(dense), curve))


# --------------------------------------------------------------------------------------------- harmonic route
def _harmonic_route(
    s: TwoAxisSetup, phase: Array, length: Array, outer: Array, inner: Array, y: Array
) -> tuple[Array, dict[str, float], list[dict[str, Any]], list[dict[str, Any]], list[str]]:
    """theta of each window, coefficients by the formulas of Hu 1981, amplitudes, table of checks, and why not."""
    theta = outer / s.m
    if not s.path:
        return theta, {}, [], [], ["the positions do not lie on a path"]
    turn = 2.0 * math.pi
    numbers = np.unique(phase)
    rows = [phase == p for p in numbers]
    at = np.array([float(np.mean(theta[r])) for r in rows])
    mean = np.array([float(np.average(y[r], weights=length[r])) for r in rows])
    places = np.unique(np.round(np.mod(at + 1e-5, turn), 4))
    why = geometry.harmonic_problems(s.latitude, s.m, s.n, places.size)
    off = np.angle(np.exp(1j * (inner - s.n * theta)))
    if np.max(np.abs(off)) > 1e-3:
        why.append(
            f"the inner angle is not {s.n}/{s.m} of the outer: off by up to {math.degrees(np.max(np.abs(off))):.3g}°"
        )
    gaps = np.diff(np.append(places, places[0] + turn))
    each = [int(np.sum(np.abs(np.angle(np.exp(1j * (at - p + 1e-5)))) < 1e-3)) for p in places]
    if np.ptp(gaps) > 1e-3 or len(set(each)) > 1:
        why.append("the positions are not equally spaced over whole cycles")
    if why:
        return theta, {}, [], [], why
    A, B = closed.amplitudes(at, mean, s.m, s.n)
    label = f"positions {s.m}:{s.n}"
    harmonics = [{"series": label, "n": 0, "a": float(A[0]) / DPH, "b": None, "u": None, "unit": "°/h"}] + [
        {"series": label, "n": f, "a": float(A[j]) / DPH, "b": float(B[j]) / DPH, "u": None, "unit": "°/h"}
        for j, f in enumerate(geometry.frequencies(s.m, s.n), 1)
    ]
    value = {"A": A / DPH, "B": B / DPH}
    checks = [[f"{a}{i} − ({'−' if sign < 0 else ''}{b}{j})", value[a][i], value[a][i] - sign * value[b][j]]
              for a, i, sign, b, j in closed.TIES]  # fmt: skip
    checks += [[f"B{j}", value["B"][j], value["B"][j]] for j in (5, 9)]
    caption = "Differences that the model makes zero; compare them with the residual scatter"
    table = Table(
        "consistency_of_the_harmonics",
        "Consistency of the harmonics",
        caption,
        ["check", "amplitude / (°/h)", "difference / (°/h)"],
        checks,
    )
    return theta, closed.separate(A, B, s.latitude, s.gravity), harmonics, [table], []


# --------------------------------------------------------------------------------------------- tests and budget
def _model_test(found: Findings, theta: Array) -> None:
    """F test of what is periodic in theta and outside the nine terms."""
    places = np.unique(np.round(np.mod(theta + 1e-5, 2.0 * math.pi), 4)).size
    top = min((places - 1) // 2, 12)
    block = np.concatenate([f(j * theta)[:, None] for j in range(1, top + 1) for f in (np.cos, np.sin)], axis=1)
    found.f_test(
        "harmonics_of_the_positions", "harmonics of the positions", block, "model errors periodic in the position",
        "something goes with the positions that the model does not hold", "no more than noise",
    )  # fmt: skip


def _cycle_test(found: Findings, theta: Array) -> None:
    """F test: do further cycles differ from the first?"""
    cycle = np.floor((theta - theta.min()) / (2.0 * math.pi) + 1e-5).astype(int)
    blocks = [np.where((cycle == k)[:, None], found.X, 0.0) for k in range(1, int(cycle.max()) + 1)]
    if blocks and np.linalg.matrix_rank(np.concatenate([found.X, *blocks], axis=1)) == 9 * (1 + len(blocks)):
        found.f_test(
            "cycle_to_cycle",
            "cycle to cycle",
            np.concatenate(blocks, axis=1),
            "change of the drift between successive cycles",
            "the cycles differ by more than the noise",
            "the cycles agree within the noise",
        )


def _effects(s: TwoAxisSetup, found: Findings, outer: Array, inner: Array, C: Array, readings: Windows) -> list[Effect]:
    current = readings.mean
    earth = frames.earth_rate_local(s.latitude, s.earth_rate)

    def believed(other: Array) -> Array:  # the gyro axes are C, and are taken for these
        return found.error((other - C)[:, 0] @ earth, _design(s, other) - found.X) / SMALL

    def tilted(direction: Array) -> Array:
        return -believed(C @ frames.rotation(direction, SMALL).T)

    def mounted(direction: Array) -> Array:
        return believed(frames.rotation(direction, SMALL) @ C)

    def read(axis: int, n: int) -> Array:  # an encoder that reads too much by sin n q, and by cos n q
        q = (outer, inner)[axis]
        wrong = [q + SMALL * wave(n * q) for wave in (np.sin, np.cos)]
        both = [(w, inner) if axis == 0 else (outer, w) for w in wrong]
        return np.array([believed(geometry.attitude(s.latitude, *angles)) for angles in both])

    def wobbling(axis: int) -> Array:
        sizes = (SMALL * (axis == 0), SMALL * (axis == 1))
        turned = [geometry.attitude(s.latitude, outer, inner, 0.0, sizes, p) for p in (0.0, math.pi / 2.0)]
        return -np.array([believed(one) for one in turned])

    axes = geometry.base(s.latitude)
    square = -believed(geometry.attitude(s.latitude, outer, inner, SMALL))
    names = ("outer", "inner")
    full, one = float(np.max(np.abs(current))) or 1.0, np.ones_like(current)
    return [
        OUTER_POLE_EAST.effect(s, tilted(axes[2])),
        OUTER_POLE_NORMAL.effect(s, tilted(-axes[1])),
        SQUARE.effect(s, square),
        *(TURNED[n].effect(s, mounted(d)) for n, d in zip(("input", "output", "spin"), np.eye(3), strict=True)),
        *(
            ANGLE_OF[often].of(axis=name).effect(size, read(k, n))
            for n, often, size in ((1, "once", s.u_angle1), (2, "twice", s.u_angle2))
            for k, name in enumerate(names)
        ),
        *(WOBBLE_OF.of(axis=name).effect(s, wobbling(k)) for k, name in enumerate(names)),
        TORQUER_SCALE.effect(s, found.error(-s.k * current)),
        TORQUER_NONLINEARITY.effect(
            s,
            found.error(-s.k * current * np.abs(current) / full),
            note=f"relative departure from proportionality at {full * 1e3:.3g} mA",
        ),
        CURRENT_OFFSET.effect(s, found.error(-s.k * one)),
        CURRENT_RESOLUTION.effect(s.quantum / 12.0**0.5, found.error(-s.k * one)),
        *(s.pulses.effects(found, s.k, readings, s.u_pulse, s.u_switching) if s.pulses else ()),
    ]


def _conventions(s: TwoAxisSetup) -> list[str]:
    return [
        *s.sign_conventions(s.k),
        "Gyro axes I, O, S right-handed; local frame east, north, up; table angles right-handed, outer axis along the "
        f"pole{f': outer angle {s.m} θ, inner angle {s.n} θ' if s.path else ''}.",
        *([] if s.fold else ["D_OO is taken as zero; if it is not, D_F holds γ² D_OO, D_II and D_SS hold −D_OO."]),
    ]


def setup_of(run: RunDocument, specification: Specification | None = None) -> TwoAxisSetup:
    """Return the setup a run.json describes.  Scale factor: option ``k``, else the gyro's parameter ``k``."""
    return TwoAxisSetup.of(
        run,
        specification,
        k=run_metadata.number(run, "k", "gyro.k", "torquer scale factor"),
        m=int(run.options.get("m", 5)),
        n=int(run.options.get("n", 1)),
        harmonic=bool(run.options.get("harmonic", False)),
        path=not run.options.get("visits", ""),
        truth=run_metadata.truth_of(run, drift.NAMES),
        quantum=float(run.parameters.get("rebalance.resolution", 0.0)),
        pulses=Pulses.of(run),
    )


@handling_errors.examined(handling_candidates.two_axes)
def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a gyrobench.record.record.Record, with its run.json as provenance."""
    return run_metadata.finish(reduce(record.windows, setup_of(record.run, specification)), record)
