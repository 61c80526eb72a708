"""Reduction of four accelerometers on one head: one least squares for the sensors and the angle errors of the head.

    U_i = K_F + K_I a_I + K_O a_O + K_IO a_I a_O + K_II a_I2 + K_I a_O D(alpha)          i = 1 ... 4

Unknowns: five coefficients of each sensor and D at the harmonics 2 ... n/2 (41 with 24 positions and 96 readings).
The first harmonic of D, which no reading tells from K_F, K_IO and K_II, is taken from an autocollimator; its constant
and the misalignments of the sensors stay in K_O.  The columns of D hold K_I: the fit is made again with the new one.
[TEST-ACCEL4; Dong 2014, eq. 14-31, corrected by EA1 to EA13]

Not modelled: third order, changes between the turns, harmonics beyond half the number of positions (24 readings cannot
tell harmonic k from 24 - k and 24 + k: measure D1 in the same positions, so that it holds the alias).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gyrobench import frames, units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.effects import Effect
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.setups import Setup
from gyrobench.reduction.setup.sources import GRAVITY, VOLTMETER, Source
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import DriftTestResult, Specification, Table

from . import chain, geometry

__all__ = ["FourSetup", "ReductionError", "from_record", "reduce"]

ARCSEC, G0 = units.factor("arcsec"), frames.G0
MEANING = {
    "K_F": ("bias", "V"),
    "K_I": ("scale factor", "V/g"),
    "K_O": ("output axis, as K_O + K_I (η + D₀)", "V/g"),
    "K_IO": ("cross term", "V/g²"),
    "K_II": ("square term", "V/g²"),
}
BIASED = ("K_F", "K_IO", "K_II")  # by the first harmonic of the head
POSITION = math.radians(0.1)  # largest departure of an angle from its position


@dataclass(frozen=True, kw_only=True)
class FourSetup(Setup):
    """gravity: m/s2.  D1: first harmonic of the head, cosine and sine, rad; None: unknown.  u_D1: of both."""

    gravity: float
    points: int = 24
    D1: tuple[float, float] | None = None
    u_D1: float = 0.0
    u_voltage: float = 0.0
    u_gravity: float = 0.0

    @property
    def gamma(self) -> float:
        return self.gravity / G0


def reduce(windows: Mapping[str, Array], setup: FourSetup) -> DriftTestResult:
    """Coefficients from windows: t_start, t_end (s), angle_start, angle_end (rad, nominal), mean, mean_2, mean_3,
    mean_4 (V).  Raises ReductionError with everything that is wrong.
    """
    problems = frames.gravity_problems(setup.gravity) + window_problems(windows)
    missing = [f"mean_{i}" for i in geometry.SENSORS[1:] if f"mean_{i}" not in windows]
    if missing:
        problems.append(f"column {', '.join(missing)} is missing: the four sensors are read together")
    if problems:
        raise ReductionError(problems)
    alpha = np.asarray(windows["angle_start"], dtype=float)
    problems = _position_problems(alpha, np.asarray(windows["angle_end"], dtype=float), setup.points)
    U = np.column_stack([np.asarray(windows[n], dtype=float) for n in ("mean", "mean_2", "mean_3", "mean_4")])
    if not problems and np.any(np.ptp(U, axis=0) == 0.0):
        problems.append("a voltage is the same in all positions: no accelerometer was read")
    if problems:
        raise ReductionError(problems)
    single, s_single = chain.alone(alpha, U, setup.gamma)
    if np.any(single[:, 1] <= 0.0):
        raise ReductionError(
            f"scale factors {', '.join(f'{k:.4g}' for k in single[:, 1])} V/g: must be positive; turn the sign of a "
            "voltage round, or the sense of the angle, or sensors stand in another order"
        )
    found = estimate(alpha, U, setup, single[:, 1])
    reported = found.derive(_quantities(setup), lambda b: b[:20])
    result = linear_result(
        reported,
        system="accelerometer_four",
        title="Four accelerometers on one indexing head",
        method=f"{setup.points} positions, four sensors read together; joint least squares of 20 coefficients and "
        f"{found.X.shape[1] - 20} harmonics of the head [TEST-ACCEL4]",
        sources=["TEST-ACCEL4, ACCEL-MODEL; Dong 2014, eq. 1-31, corrected by EA1 to EA13"],
        equation='U_i = K_F + K_I a_I + K_O a_O + K_"IO" a_I a_O + K_"II" a_I^2 + K_I a_O D(alpha)',
        conventions=[
            "a in g0 = 9.80665 m/s²; specific force: an axis that points up reads +1.",
            "Sensor 1 is level at angle 0 and rises with the angle; sensors 2, 3, 4 are 90°, 180°, 270° ahead.",
            "No third order. Misalignment and the zero of the head are in K_O.",
        ],
        effects=_effects(setup, found, reported, alpha, U),
        specification=setup.specification,
        site={"gravity / (m/s²)": setup.gravity},
        instrument=setup.instrument,
        simulated=setup.truth is not None,
        tables=_tables(setup, found, alpha, U, single, s_single),
        random="noise of the voltages",
    )  # fmt: skip
    return _judged(result, setup, found)


def estimate(alpha: Array, U: Array, setup: FourSetup, scale: Array) -> Findings:
    """Return the joint fit of voltages U (n, 4) at the nominal angles; scale (4,): first scale factors, V/g."""
    first = _fitted(alpha, U, setup, scale)
    return _fitted(alpha, U, setup, first.est.beta[1:20:5])


def _position_problems(alpha: Array, end: Array, points: int) -> list[str]:
    step = 2.0 * math.pi / points
    number = np.rint(alpha / step)
    off = np.flatnonzero((np.abs(alpha - number * step) > POSITION) | (np.abs(end - alpha) > POSITION))
    if off.size:
        return [
            f"row {off[0] + 1}: {math.degrees(float(alpha[off[0]])):.6g}° to {math.degrees(float(end[off[0]])):.6g}° "
            f"is not one of {points} equally spaced positions"
        ]
    counts = np.bincount(np.mod(number, points).astype(int), minlength=points)
    if np.any(counts != counts[0]) or counts[0] == 0:
        few = int(np.argmin(counts))
        where = math.degrees(few * step)
        return [f"position {where:.4g}° is read {counts[few]} times, others {counts.max()}: whole turns are needed"]
    return [] if 16 <= points <= 24 else [f"points = {points}: 16 to 24 positions"]


def _fitted(alpha: Array, U: Array, s: FourSetup, scale: Array) -> Findings:
    """The joint fit with the columns of D of these scale factors."""
    n, basis = alpha.size, geometry.harmonics(alpha, s.points)
    X = np.zeros((4 * n, 20 + basis.shape[1]))
    y = U.T.ravel().copy()
    first = s.D1 or (0.0, 0.0)
    D1 = first[0] * np.cos(alpha) + first[1] * np.sin(alpha)
    groups = []
    dense = np.radians(np.arange(0.0, 361.0, 3.0))
    for j, i in enumerate(geometry.SENSORS):
        rows = slice(j * n, (j + 1) * n)
        tangent = scale[j] * s.gamma * geometry.axes(i, alpha)[1]
        X[rows, 5 * j : 5 * j + 5] = chain.design(i, alpha, s.gamma)
        X[rows, 20:] = basis * tangent[:, None]
        y[rows] -= tangent * D1
        curve = np.zeros((dense.size, X.shape[1]))
        curve[:, 5 * j : 5 * j + 5] = chain.design(i, dense, s.gamma)
        shown = np.degrees(np.mod(alpha + 1e-6, 2.0 * math.pi) - 1e-6)
        groups.append(Group(f"sensor {i}", np.arange(j * n, (j + 1) * n), shown, "angle of the head", "°",
                            (np.degrees(dense), curve)))  # fmt: skip
    names = [f"{k},{i}" for i in geometry.SENSORS for k in geometry.TERMS]
    names += [f"D{k}{kind[0]}" for k, kind in geometry.orders(s.points)]
    return fit(names, X, y, None, None, groups, "voltage", "V", 1.0, noise="white")


def _quantities(s: FourSetup) -> list[Quantity]:
    truth = s.truth or {}
    return [
        Quantity(f"{k},{i}", f"{MEANING[k][0]}, sensor {i}", MEANING[k][1], 1.0, truth.get(f"{k},{i}"))
        for i in geometry.SENSORS
        for k in geometry.TERMS
    ]


def _effects(s: FourSetup, found: Findings, reported: Findings, alpha: Array, U: Array) -> list[Effect]:
    scale = found.est.beta[1:20:5] * s.gamma
    tangent = [scale[j] * geometry.axes(i, alpha)[1] for j, i in enumerate(geometry.SENSORS)]
    lines = [np.concatenate([-t * f(alpha) for t in tangent]) for f in (np.cos, np.sin)]
    power = np.tile([0.0, 1.0, 1.0, 2.0, 2.0], 4)  # of 1/gravity in the coefficients
    out = [
        VOLTMETER.effect(s, reported.error(U.T.ravel()), note="relative, of all voltages"),
        GRAVITY.effect(s, values=-power * found.est.beta[:20] / s.gravity),
    ]
    if s.D1 is not None:
        out += [
            Source(f"first_harmonic_of_the_head:{kind}", f"first harmonic of the head, {kind}", "rad", "u_D1").effect(
                s, reported.error(line), note="as measured"
            )
            for kind, line in zip(("cosine", "sine"), lines, strict=True)
        ]
    return out


def _tables(s: FourSetup, found: Findings, alpha: Array, U: Array, single: Array, s_single: Array) -> list[Table]:
    beta, u = found.est.beta, found.est.u
    three = chain.three_steps(alpha, U, s.gamma)
    if s.D1 is not None:
        three = three + _first_harmonic(beta[1:20:5], s.D1)
    rows = [
        [f"{k},{i}", *(float(v) for v in (beta[5 * j + m], u[5 * j + m], three[j, m], single[j, m])), MEANING[k][1]]
        for j, i in enumerate(geometry.SENSORS)
        for m, k in enumerate(geometry.TERMS)
    ]
    compared = Table(
        "joint_fit_chain_of_the",
        "Joint fit, chain of the source, each sensor alone",
        "Chain: D4 and higher, D2, D3 taken out one after the other, corrected by EA3 to EA5, same D1. "
        "Alone: five terms of each sensor, errors of the head in them. Residuals of the sensors alone: "
        + ", ".join(f"{v:.3g}" for v in s_single)
        + f" V, of the joint fit {found.residual_std:.3g} V.",
        ["coefficient", "joint", "u, type A", "chain", "alone", "unit"],
        rows,
    )
    head = [
        [k, kind, float(beta[20 + m]) / ARCSEC, float(u[20 + m]) / ARCSEC]
        for m, (k, kind) in enumerate(geometry.orders(s.points))
    ]
    if s.D1 is not None:
        given = zip(("cos", "sin"), s.D1, strict=True)
        head = [[1, kind, v / ARCSEC, s.u_D1 / ARCSEC] for kind, v in given] + head
    errors = Table(
        "angle_errors_of_the_head",
        "Angle errors of the head by harmonics",
        "Positions minus their nominal angles; the first harmonic is that of the autocollimator",
        ["harmonic", "of", "amplitude / ″", "u / ″"],
        head,
    )
    return [compared, errors]


def _first_harmonic(scale: Array, D1: tuple[float, float]) -> Array:
    """What takes the first harmonic out of terms (4, 5) that were fitted with it.  [Dong 2014, eq. 27, 28, by EA8]"""
    c, s = D1
    of_unit = np.array([[-c, 0, 0, -s, c], [s, 0, 0, c, -s], [c, 0, 0, s, -c], [-s, 0, 0, -c, s]])
    out: Array = scale[:, None] * of_unit
    return out


def _judged(result: DriftTestResult, s: FourSetup, found: Findings) -> DriftTestResult:
    by_name = {c.name: c for c in result.coefficients}
    scales = "; ".join(f"sensor {i} {plus_minus(by_name[f'K_I,{i}'])}" for i in geometry.SENSORS)
    result.summary = [
        f"Scale factors: {scales}.",
        f"Residual standard deviation {found.residual_std:.3g} V with {found.dof:.0f} degrees of freedom.",
    ]
    if s.D1 is None:
        names = [f"{k},{i}" for i in geometry.SENSORS for k in BIASED]
        scale = float(np.mean(found.est.beta[1:20:5]))
        text = (
            f"The first harmonic of the head is not known: {', '.join(BIASED)} of each sensor are biased by K_I D1, "
            f"{scale * ARCSEC:.2g} V for each arcsecond; the residuals do not show it. Measure it in the same "
            "positions."
        )
        result.warnings.insert(0, text)
        return uncertainty.withhold(result, [text], ["pass", "fail"], names)
    return result


def truth_of(run: RunDocument) -> dict[str, float] | None:
    """Coefficients that the simulated sensors have about the axes of the head: misalignment and zero turned in."""
    p = run.parameters
    if run.measured or not all(f"accelerometer_{i}.K_I" in p for i in geometry.SENSORS):
        return None
    zero = float(np.mean(np.asarray(p["table.error"])[: int(run.options["points"])]))
    site = run_metadata.Site.of(run)
    found: dict[str, float] = {}
    for i in geometry.SENSORS:
        F, I, O, IO, II = (float(p[f"accelerometer_{i}.{k}"]) for k in geometry.TERMS)  # noqa: E741
        turn = float(p.get(f"accelerometer_{i}.eta", 0.0)) + zero
        c, s = math.cos(turn), math.sin(turn)
        values = (
            F + site.g**2 * (IO * c * s + II * s * s), I * c - O * s, O * c + I * s,
            IO * (c * c - s * s) + 2.0 * c * s * II, II * (c * c - s * s) - 2.0 * c * s * IO,
        )  # fmt: skip
        found |= {f"{k},{i}": v for k, v in zip(geometry.TERMS, values, strict=True)}
    return found


def setup_of(run: RunDocument, specification: Specification | None = None) -> FourSetup:
    """Return the setup that a run.json describes."""
    o = run.options
    gravity = float(o["gravity"]) if run.measured else run_metadata.Site.of(run).gravity
    return FourSetup.of(
        run, specification, gravity=gravity, points=int(o["points"]), truth=truth_of(run),
        D1=None if o.get("d1_unknown") else (float(o["D1c"]), float(o["D1s"])),
    )  # fmt: skip


def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a record with its run.json as provenance."""
    return run_metadata.finish(reduce(record.windows, setup_of(record.run, specification)), record)
