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
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench import frames, units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.drift import window_regressors
from gyrobench.reduction.drift.pulses import Pulses
from gyrobench.reduction.estimation import nuisances, uncertainty
from gyrobench.reduction.estimation.effects import Effect, with_set_up
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.setups import SiteSetup, scale_factor_problems
from gyrobench.reduction.setup.sources import (
    ANGLE_ONCE,
    ANGLE_TWICE,
    AXIS_VERTICAL_EAST,
    AXIS_VERTICAL_NORTH,
    CURRENT_OFFSET,
    INPUT_TO_OUTPUT,
    INPUT_TO_SPIN,
    TIME_BASE,
    TORQUER_SCALE,
    WOBBLE,
    Source,
)
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import Coefficient, DriftTestResult, Specification, Table
from gyrobench.system.families.table_test import FACE, ON_TABLE

from .measured import REST, TURNING
from .truth import NAMES, true_values

DPH, ARCSEC, MA = units.factor("deg/h"), units.factor("arcsec"), 1e-3
NO_QUANTUM = 1e-10  # A, below this readings are not quantized but rounded
LEVEL = np.eye(3)  # table axes in (E, N, U)
SMALL = 1e-5  # rad, step of the geometric perturbations
MEANINGS = {
    "I_0": ("bias: mean current at the reading 0", "uA"),
    "κ": ("scale-factor error: mean current over reading, less 1", "ppm"),
    "κ_±": ("scale-factor asymmetry: half the difference of the positive and the negative one", "ppm"),
    "κ_2": ("quadratic nonlinearity at the largest rate", "ppm"),
    "κ_3": ("cubic nonlinearity at the largest rate", "ppm"),
}


@dataclass(frozen=True, kw_only=True)
class Setup(SiteSetup):
    """k: torquer scale factor, rad/s/A.  largest: rate of the test, rad/s.  gate: length of a reading, s.  labels: of
    the phases; rest: those at rest.  full: largest current of the rebalance, A (0: not known).
    """

    k: float
    largest: float
    gate: float
    labels: Mapping[int, str]
    rest: frozenset[int]
    full: float = 0.0
    pulses: Pulses | None = None
    u_drift: float = 0.0
    u_axis: float = 0.0
    u_mount: float = 0.0
    u_wobble: float = 0.0
    u_angle1: float = 0.0
    u_angle2: float = 0.0
    u_scale_factor: float = 0.0
    u_current: float = 0.0
    u_time: float = 0.0


def reduce(windows: Mapping[str, Array], setup: Setup) -> DriftTestResult:
    """Return the values of a loop from the windows of a record: t_start, t_end, angle_start, angle_end, mean, std.

    Raises ReductionError with everything that is wrong with setup or record.
    """
    problems = scale_factor_problems(setup.k) + window_problems(windows)
    if problems:
        raise ReductionError(problems)
    phase = np.asarray(windows["phase"]).astype(int)
    t0, t1, a0, a1, x = (
        np.asarray(windows[n], dtype=float) for n in ("t_start", "t_end", "angle_start", "angle_end", "mean")
    )
    std = np.asarray(windows.get("std", np.zeros(x.size)), dtype=float)
    at_rest = np.isin(phase, list(setup.rest))
    if missing := [label for p, label in setup.labels.items() if p not in phase]:
        raise ReductionError(f"no readings of {', '.join(missing)}")
    face = np.broadcast_to(np.asarray(ON_TABLE), (x.size, 3, 3))
    turning = window_regressors.Turning(a0, a1, t0, t1, face)
    rate = window_regressors.axis_rate(turning, LEVEL, setup.latitude, setup.earth_rate)
    full = setup.largest / setup.k
    X = design(x, std, full)
    line = np.linspace(-full, full, 201)
    curve = (line / MA, design(line, np.full_like(line, float(np.median(std))), full))
    groups = [Group("all rates", np.arange(x.size), x / MA, "reading", "mA", curve)]
    found = fit(
        [_quantity(setup, n) for n in NAMES], X, rate / setup.k - x, t0, t1, groups, "input current less reading", "µA",
        1e-6, candidates=nuisances.common(windows) if setup.nuisances else (),
    )  # fmt: skip
    found = with_set_up(found, lambda f: _effects(setup, f, turning, rate), setup.corrections)
    result = linear_result(
        found,
        system="rebalance_loop_test",
        title="Rebalance loop test",
        method="Readings of the rebalance current at rest and at known rates in both senses; least squares under an "
        "estimated noise model [TEST-REBAL-LOOP]",
        sources=["TEST-REBAL-LOOP, REBAL-PWM, REBAL-PULSE; Hu 1981, eq. 5-62..5-76, corrected by ET16..ET18"],
        equation='omega/k - x = I_0 + kappa x + kappa_"±" abs(x) + kappa_2 x^2/I + kappa_3 x^3/I^2',
        conventions=[
            f"k = {setup.k * MA / DPH:.6g} °/h/mA; positive current precesses positively; x is the reading, "
            "I_0 + (1 + κ) x + … the mean current that flows.",
            f"Nonlinearities are given at the largest rate, {setup.largest / DPH:.6g} °/h, I = {full / MA:.6g} mA.",
            "The drift rate of the gyro is in the bias.",
        ],
        effects=_effects(setup, found, turning, rate),
        **setup.reported(),
        random="noise of the loop, random drift",
    )
    _append(result, _at_rest(setup, windows, at_rest, x))
    result.tables.insert(0, _levels(setup, phase, rate, x, found))
    result.summary = _summary(result, found, setup)
    return result


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


def _quantity(s: Setup, name: str) -> Quantity:
    meaning, unit = MEANINGS[name]
    return Quantity.of(name, meaning, unit, (s.truth or {}).get(name))


def _effects(s: Setup, found: Findings, turning: window_regressors.Turning, rate: Array) -> list[Effect]:
    one = np.ones_like(rate)
    along_o, along_s = np.eye(3)[1:]

    def geometry(base: Array, turned: window_regressors.Turning) -> Array:
        there = window_regressors.axis_rate(turned, base, s.latitude, s.earth_rate)
        return found.error((there - rate) / s.k) / SMALL

    def axis(direction: Array) -> Array:  # the reduction believes the axis to be where it is not
        return -geometry(LEVEL @ frames.rotation(direction, SMALL).T, turning)

    def mount(direction: Array) -> Array:
        return geometry(LEVEL, replace(turning, face=frames.rotation(direction, SMALL) @ turning.face))

    def angles(n: int) -> Array:  # an encoder that reads too much by sin n theta, and by cos n theta
        return np.array([geometry(LEVEL, wrong) for wrong in window_regressors.misread(turning, n, SMALL)])

    cone = window_regressors.wobbles(turning, LEVEL, s.site, (), SMALL)
    wobbling = np.array([found.error(-rates[:, 0] / s.k) for rates, _ in cone])
    return [
        AXIS_VERTICAL_EAST.effect(s, axis(LEVEL[0])),
        AXIS_VERTICAL_NORTH.effect(s, axis(LEVEL[1])),
        INPUT_TO_OUTPUT.effect(s, mount(along_s)),
        INPUT_TO_SPIN.effect(s, mount(-along_o)),
        WOBBLE.effect(s, wobbling),
        ANGLE_ONCE.effect(s, angles(1)),
        ANGLE_TWICE.effect(s, angles(2)),
        TORQUER_SCALE.effect(s, found.error(-rate / s.k), note="relative, where it is stated"),
        Source("drift_rate_of_the_gyro", "drift rate of the gyro", "rad/s", "u_drift").effect(
            s, found.error(one / s.k)
        ),
        CURRENT_OFFSET.effect(s, found.error(-one)),
        TIME_BASE.effect(s, found.error(-rate / s.k), note="relative, seconds read too long"),
    ]


def _levels(s: Setup, phase: Array, rate: Array, x: Array, found: Findings) -> Table:
    residual = found.y - found.X @ found.est.beta[: found.X.shape[1]]
    rows = []
    for label in dict.fromkeys(s.labels.values()):
        mine = np.isin(phase, [p for p, name in s.labels.items() if name == label])
        scatter = float(np.std(x[mine], ddof=1)) if np.sum(mine) > 1 else 0.0
        rows.append(
            [label, float(np.mean(rate[mine])) / DPH, float(np.mean(x[mine])) / MA, scatter / 1e-6,
             float(np.mean(residual[mine])) / 1e-6, int(np.sum(mine))]
        )  # fmt: skip
    return Table(
        "readings",
        "Readings",
        "Means of each rate; departure: mean of the residuals of the fit",
        ["rate", "input / (°/h)", "reading / mA", "std of a reading / µA", "departure / µA", "readings"],
        rows,
    )


def _at_rest(s: Setup, w: Mapping[str, Array], at_rest: NDArray[np.bool_], x: Array) -> list[Coefficient]:
    """Return resolution, noise at rest, ripple and dynamic range."""
    n = int(np.sum(at_rest))
    q = quantum(x[at_rest]) * s.k / DPH
    noise = float(np.std(x[at_rest], ddof=1)) * s.k / DPH
    u = noise / math.sqrt(2.0 * (n - 1))
    closed = None
    if s.pulses is not None and q > 0.0:
        closed = s.pulses.clocks * s.pulses.current / s.pulses.f_q / s.gate * s.k / DPH
    found = [
        _plain(s, "resolution", f"quantum of a reading of {s.gate:g} s at rest; 0: none", "°/h", q, closed=closed),
        _plain(s, "noise", f"standard deviation of a reading of {s.gate:g} s at rest", "°/h", noise, u),
    ]
    if "ripple" in w:
        ripple = np.asarray(w["ripple"], dtype=float)[at_rest] / ARCSEC
        spread = float(np.std(ripple, ddof=1)) / math.sqrt(n)
        meaning = "standard deviation of the float angle within a reading at rest"
        found.append(_plain(s, "ripple", meaning, "″", float(np.mean(ripple)), spread))
    if s.full > 0.0 and max(q, noise) > 0.0:
        ratio = s.full * s.k / DPH / max(q, noise)
        meaning = "full scale over the larger of resolution and noise"
        found.append(_plain(s, "dynamic range", meaning, "1", ratio, ratio * u / noise if noise > q else 0.0))
    return found


def _plain(
    s: Setup, name: str, meaning: str, unit: str, value: float, u: float = 0.0, closed: float | None = None
) -> Coefficient:
    U, limit = uncertainty.NORMAL * u, (s.specification or {}).get(name)
    return Coefficient(
        name=name,
        meaning=meaning,
        unit=unit,
        estimate=value,
        u=u,
        k=uncertainty.NORMAL,
        interval=(value - U, value + U),
        u_a=u,
        closed=closed,
        limit=limit,
        verdict=uncertainty.assess_conformity(value, U, limit),
        combination={name: 1.0},
    )


def _append(result: DriftTestResult, more: Sequence[Coefficient]) -> None:
    """Put values that are not unknowns of the fit behind its coefficients, uncorrelated with them."""
    n, m = len(result.coefficients), len(more)
    correlation = np.eye(n + m)
    correlation[:n, :n] = result.correlation
    result.correlation = correlation.tolist()
    result.coefficients = [*result.coefficients, *more]
    result.verdict = uncertainty.worst_verdict(c.verdict for c in result.coefficients)


def _summary(result: DriftTestResult, found: Findings, s: Setup) -> list[str]:
    c = {c.name: c for c in result.coefficients}
    bias = c["I_0"].estimate * units.factor("uA") * s.k / DPH
    quantized = c["resolution"].estimate
    step = f"quantum {quantized:.3g} °/h, " if quantized else "not quantized, "
    return [
        f"Bias I_0 = {plus_minus(c['I_0'])}, {bias:.4g} °/h; scale-factor error κ = {plus_minus(c['κ'])}.",
        f"A reading of {s.gate:g} s: {step}standard deviation at rest {c['noise'].estimate:.2g} °/h.",
        *found.nuisance_sentences(),
    ]


def setup_of(run: RunDocument, specification: Specification | None = None) -> Setup:
    """Return the setup that a run.json describes."""
    k = run_metadata.number(run, "k", "gyro.k", "torquer scale factor")
    site = run_metadata.Site.of(run)
    plan = run_metadata.phases(run, [FACE, REST, TURNING])
    largest = float(run.options["range"])
    p = run.parameters
    return Setup.of(
        run,
        specification,
        k=k,
        largest=largest,
        gate=float(run.options["gate"]),
        labels={n: row.label if row.face == FACE else f"{row.label}, phase {n}" for n, row in plan.items()},
        rest=frozenset(n for n, row in plan.items() if row.mode == "hold"),
        full=float(p.get("rebalance.I") or p.get("rebalance.i_max") or 0.0),
        pulses=Pulses.of(run),
        truth=true_values(p, k, site.g, largest / k),
    )


def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a record, with its run.json as provenance."""
    return run_metadata.finish(reduce(record.windows, setup_of(record.run, specification)), record)
