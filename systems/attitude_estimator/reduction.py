"""Reduction of attitude_estimator: errors of attitude and biases against the truth, phase by phase, and consistency."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special
from scipy.spatial.transform import Rotation

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.loops.estimator_metrics import lasting_squares
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import LoopResult, Response, Specification, Table, Test
from gyrobench.units import DPH

DEG = math.pi / 180.0
SHOWN = 800  # points of a drawn line
CALM = ("rest", "rocking")  # phases in which the models of the filters hold: no acceleration of the vehicle before
LEVEL = 1e-3  # p below which a filter is called inconsistent
TILT, TURN = slice(0, 2), slice(2, 3)


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The result of a record; raises ReductionError for a record without a whole phase."""
    found = LoopFindings(record)
    found.warnings.clear()  # there is no loop to be linearized here
    c = record.channels
    errors = attitude_errors(vectors(c, "estimator.angle"), vectors(c, "motion.angle"))
    drift = true_bias(c) - vectors(c, "estimator.bias")
    calm = [g for g in found.gates if g.label in CALM]
    rows = np.concatenate([np.arange(g.inside.start, g.inside.stop) for g in calm]) if calm else np.zeros(0, int)
    noise = float(np.sqrt(np.mean(np.sum(errors[rows] ** 2, axis=1)))) if calm else math.inf
    measured = np.concatenate([np.arange(g.inside.start, g.inside.stop) for g in found.gates])
    _size(found, "attitude", "rms rotation from the true to the estimated attitude, all phases", errors[measured], "°",
          DEG, noise)  # fmt: skip
    for gate in found.gates:
        part = level_errors(errors, vectors(c, "motion.angle"))[gate.inside]
        most = math.inf if gate in calm else noise
        tilt, turn = f"tilt {gate.label}", f"heading {gate.label}"
        _size(found, tilt, f"rms tilt error, {gate.label}, both level axes", part[:, TILT], "°", DEG, most)
        _size(found, turn, f"rms heading error, {gate.label}", part[:, TURN], "°", DEG, most)
    last = found.gates[-1]
    for gate in [*calm[-1:], *([last] if last not in calm else [])]:
        half = slice((gate.inside.start + gate.inside.stop) // 2, gate.inside.stop)
        _size(found, f"bias {gate.label}", f"rms error of the gyro biases, second half of {gate.label}, three axes",
              drift[half], "°/h", DPH)  # fmt: skip
    tests = consistency(found, np.column_stack([errors, drift]), rows)
    found.tables.append(_phases(found, errors, drift))
    found.responses += _figures(c, errors, drift, rows)
    name = record.run.parts["estimator"].name if "estimator" in record.run.parts else ""
    result = found.result(
        title="Attitude estimation on a moving base",
        method="Estimated attitude and gyro biases against the true ones, in rest, rocking, acceleration and turn",
        sources=["EST-ATTITUDE; Mahony 2008; Markley 2014, chapter 6",
                 "GYRO-STATIC-ERR, GYRO-DYNAMIC-ERR; Xia 2008, section 2.2.2, corrected by EX4, EX5"],
        equation='bold(C)_"true" = (1 - [bold(d) times]) hat(bold(C)), quad bold(f) = g bold(C) bold(u) + bold(v), '
        'quad bold(omega) = bold(omega)_"true" + bold(b) + bold(n), quad "NEES" = bold(e)^T bold(P)^(-1) bold(e)\\/6',
        conventions=[
            "C takes east, north, up to vehicle axes (x right, y forward, z up); heading counter-clockwise from above.",
            "Error: the rotation vector d by which the vehicle is turned from the estimated to the true attitude.",
            "Bias: what a gyro indicates too much after the compensation.",
            "NEES and NIS: means of the squares by their number, 1 where the stated covariance is right; "
            f"phases {' and '.join(CALM)}, without acceleration.",
        ],
        summary=[],
        instrument=name,
        ranked_by="attitude",
        specification=specification,
    )  # fmt: skip
    result.tests = tests
    result.residual_std = math.sqrt(float(np.mean(np.sum(errors[measured] ** 2, axis=1)))) / DEG
    result.residual_unit, result.dof = "°", float(measured.size)
    labels = [g.label for g in found.gates]
    result.summary = [
        f"{name or 'The estimator'}: attitude to {_words(result, 'attitude')} over all phases.",
        *(f"Tilt error in {n}: {_words(result, f'tilt {n}')}." for n in labels if n in ("acceleration", "turn")),
        *(f"Gyro biases after {g.label}: to {_words(result, f'bias {g.label}')}." for g in calm[-1:]),
    ]
    return result


def _words(result: LoopResult, name: str) -> str:
    """Return an rms with its interval: "0.0302° (rms; 95 %: 0.024 to 0.041)"."""
    c = result[name]
    unit = c.unit if c.unit.startswith("°") and len(c.unit) == 1 else f" {c.unit}"
    return f"{c.estimate:.3g}{unit} (rms; 95 %: {c.interval[0]:.2g} to {c.interval[1]:.2g})"


def vectors(channels: Mapping[str, Array], name: str) -> Array:
    """Return a channel of three as (n, 3).  Raises ReductionError where it is missing."""
    names = [f"{name}[{k}]" for k in (1, 2, 3)]
    if missing := [n for n in names if n not in channels]:
        raise ReductionError(f"the record has no channel {missing[0]}")
    return np.column_stack([np.asarray(channels[n], dtype=float) for n in names])


def true_bias(channels: Mapping[str, Array]) -> Array:
    """Return what the compensated rates are off by, white noise and errors by angular motion apart (n, 3)."""
    names = ("imu.bias", "imu.static", "compensation.static")
    return np.asarray(sum(vectors(channels, n) for n in names if f"{n}[1]" in channels), dtype=float)


def matrices(angle: Array) -> Array:
    """Return C = R2(roll) R1(pitch) R3(heading) of (pitch, roll, heading) (n, 3): (n, 3, 3)."""
    (cp, cr, ch), (sp, sr, sh) = np.cos(angle).T, np.sin(angle).T
    rows = [
        [cr * ch - sr * sp * sh, cr * sh + sr * sp * ch, -sr * cp],
        [-cp * sh, cp * ch, sp],
        [sr * ch + cr * sp * sh, sr * sh - cr * sp * ch, cr * cp],
    ]
    return np.asarray(np.moveaxis(np.array(rows), 2, 0))


def attitude_errors(estimated: Array, true: Array) -> Array:
    """Return the rotation vectors d (n, 3), rad, vehicle axes: C_true = exp(-[d x]) C_estimated."""
    turned = np.einsum("nij,nkj->nik", matrices(estimated), matrices(true))  # C_est C_true' = exp([d x])
    return np.asarray(Rotation.from_matrix(turned).as_rotvec())


def level_errors(errors: Array, true: Array) -> Array:
    """Return the rotation vectors along east, north, up (n, 3)."""
    return np.asarray(np.einsum("nij,ni->nj", matrices(true), errors))


def _size(
    found: LoopFindings, name: str, meaning: str, x: Array, unit: str, scale: float, most: float = math.inf
) -> None:
    """rms of the length of vectors (n, axes); u of as many independent squares as the series hold.

    most: largest u: where an acceleration makes the error, noise changes it by what it is without one.  The interval is
    that of a root of chi-square with as many degrees of freedom, k its upper side: an rms has no value below 0.
    """
    value = math.sqrt(float(np.mean(np.sum(x * x, axis=1))))
    squares = np.mean(x * x, axis=0)
    if value == 0.0:
        found.measure(name, meaning, unit, 0.0, 0.0)
        return
    # var of a mean square of Gaussian series: sum of 2 (mean square)^2 / nu
    variance = sum(2.0 * s * s / lasting_squares(x[:, k]) for k, s in enumerate(squares) if s > 0.0)
    u = min(math.sqrt(variance) / (2.0 * value), most)
    nu = 0.5 * (value / u) ** 2
    low, high = (value * math.sqrt(nu / float(special.chdtri(nu, q))) / scale for q in (0.025, 0.975))
    found.measure(name, meaning, unit, value / scale, u / scale)
    found.coefficients[-1] = replace(
        found.coefficients[-1], interval=(low, high), k=(high - value / scale) / (u / scale), dof=nu
    )


def consistency(found: LoopFindings, e: Array, rows: NDArray[np.int_]) -> list[Test]:
    """Add NEES and NIS of the rows, where the estimator states a covariance; return their tests."""
    c = found.record.channels
    tests: list[Test] = []
    if rows.size and "estimator.covariance[1,1]" in c and np.any(c["estimator.covariance[1,1]"][rows] > 0.0):
        w = whitened(c, e, rows)
        # variance of a mean of six mean squares, each of its own number of independent ones: 2/nu
        nu = 36.0 / sum(1.0 / lasting_squares(w[:, k]) for k in range(6))
        tests.append(_against(found, "NEES", "errors", float(np.mean(w * w)), nu))
    if rows.size and "estimator.nis" in c and np.any(c["estimator.used"][rows] > 0.0):
        used = float(np.sum(c["estimator.used"][rows]))
        tests.append(_against(found, "NIS", "innovations", float(np.sum(c["estimator.nis"][rows])) / used, used))
    return tests


def whitened(channels: Mapping[str, Array], e: Array, rows: NDArray[np.int_]) -> Array:
    """Return L^-1 e of the rows (n, 6), P = L L': independent, of variance 1 where P is right."""
    P = np.empty((rows.size, 6, 6))
    for i in range(6):
        for j in range(6):
            P[:, i, j] = channels[f"estimator.covariance[{min(i, j) + 1},{max(i, j) + 1}]"][rows]
    scale = np.sqrt(np.einsum("nii->ni", P))
    unit = P / scale[:, :, None] / scale[:, None, :]
    return np.asarray(np.linalg.solve(np.linalg.cholesky(unit), (e[rows] / scale)[..., None])[..., 0])


def _against(found: LoopFindings, name: str, what: str, value: float, nu: float) -> Test:
    below = float(special.chdtr(nu, value * nu))
    p = 2.0 * min(below, 1.0 - below)
    found.measure(
        name, f"mean squared {what} over their stated covariance", "1", value, math.sqrt(2.0 / nu), closed=1.0
    )
    finding = "consistent with the stated covariance"
    if p < LEVEL:
        finding = f"inconsistent: the filter {'understates' if value > 1.0 else 'overstates'} its {what}"
        found.warnings.append(
            f"{name} = {value:.3g} instead of 1. {finding.capitalize()}. Its model does not hold in "
            f"{' and '.join(CALM)}."
        )
    return Test(name, value, p, f"mean 1 where the stated covariance is right; {nu:.0f} independent squares", finding)


def _phases(found: LoopFindings, errors: Array, drift: Array) -> Table:
    rows: list[list[Any]] = []
    c = found.record.channels
    stated = "estimator.covariance[1,1]" in c
    for g in found.gates:
        size = np.sqrt(np.sum(errors[g.inside] ** 2, axis=1)) / DEG
        inside = np.arange(g.inside.start, g.inside.stop)
        nees = float(np.mean(whitened(c, np.column_stack([errors, drift]), inside) ** 2)) if stated else None
        rows.append([g.label, float(g.t[-1] - g.t[0]), float(np.sqrt(np.mean(size**2))), float(size.max()),
                     float(np.mean(g["estimator.aided"])) if "estimator.aided" in c else None, nees])  # fmt: skip
    return Table(
        "attitude_error_by_phase",
        "Attitude error by phase",
        "Aided: share of the phase in which the specific force was used. NEES: mean squared error over its "
        "stated covariance, 1 where it is right; above 1 in and after an acceleration that is taken for gravity.",
        ["phase", "length / s", "rms error / °", "largest / °", "aided", "NEES"],
        rows,
    )


def _figures(c: Mapping[str, Array], errors: Array, drift: Array, calm: NDArray[np.int_]) -> list[Response]:
    """Errors of attitude and biases; that of the attitude without acceleration, where it is small, by itself."""
    t = np.asarray(c["time"], dtype=float)
    whole = np.arange(t.size)
    figures = [("attitude", "Error of the attitude: rotation vector in vehicle axes", errors, DEG, "°", 1, whole)]
    if calm.size:
        words = f"Error of the attitude in {' and '.join(CALM)}, without acceleration"
        figures.append(("attitude, calm", words, errors, DEG, "°", 1, calm))
    figures.append(("bias", "Error of the estimated gyro biases", drift, DPH, "°/h", 4, whole))
    made = []
    for name, caption, values, scale, unit, stated, rows in figures:
        pick = rows[np.unique(np.linspace(0, rows.size - 1, min(SHOWN, rows.size)).astype(int))]
        lines = {f"about {a}": values[pick, k] for k, a in enumerate("xyz")}
        key = f"estimator.covariance[{stated},{stated}]"
        if key in c and np.any(c[key] > 0.0):
            sigma = 2.0 * np.sqrt(c[key][pick])
            lines |= {"+2σ stated, x": sigma, "−2σ stated, x": -sigma}
            caption += "; twice the standard deviation stated for x"
        x = t[pick].tolist()
        curves = [{"label": n, "x": x, "y": (y / scale).tolist(), "phase": []} for n, y in lines.items()]
        made.append(Response(name, "time", f"{caption}.", x, "time", "s", curves[0]["y"], "error", unit, curves=curves))
    return made
