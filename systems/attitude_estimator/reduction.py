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

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.estimator_metrics import lasting_squares
from gyrobench.reduction.loops.estimator_result import consistency_test
from gyrobench.reduction.loops.loop_curves import over_time, thinned
from gyrobench.reduction.loops.loop_toolkit import Account, Array, LoopReduction, ReductionError, Table
from gyrobench.units import DEG, DPH

SHOWN = 800  # points of a drawn line
CALM = ("rest", "rocking")  # phases in which the models of the filters hold: no acceleration of the vehicle before
LEVEL = 1e-3  # p below which a filter is called inconsistent


class Reduction(LoopReduction):
    """Estimated attitude and gyro biases against the true ones, in rest, rocking, acceleration and turn."""

    part = "estimator"
    ranked_by = "attitude"
    linearized = False

    def measure(self) -> Account:
        found, c = self.found, self.record.channels
        true = vectors(c, "motion.angle")
        self.errors = errors = attitude_errors(vectors(c, "estimator.angle"), true)
        self.drift = true_bias(c) - vectors(c, "estimator.bias")
        self.calm = [g for g in found.gates if g.label in CALM]
        whole, self.rows = (np.concatenate([np.arange(0), *(np.arange(g.inside.start, g.inside.stop) for g in of)])
                            for of in (found.gates, self.calm))  # fmt: skip
        noise = _rms(errors[self.rows]) if self.calm else math.inf
        self._size("attitude", "rms rotation from the true to the estimated attitude, all phases", errors[whole], noise)
        for gate in found.gates:
            part = level_errors(errors, true)[gate.inside]
            most, name = math.inf if gate in self.calm else noise, gate.label
            self._size(f"tilt {name}", f"rms tilt error, {name}, both level axes", part[:, :2], most)
            self._size(f"heading {name}", f"rms heading error, {name}", part[:, 2:], most)
        last = found.gates[-1]
        for gate in [*self.calm[-1:], *([last] if last not in self.calm else [])]:
            half = self.drift[(gate.inside.start + gate.inside.stop) // 2 : gate.inside.stop]
            meaning = f"rms error of the gyro biases, second half of {gate.label}, three axes"
            self._size(f"bias {gate.label}", meaning, half, unit="°/h")
        self._consistency()
        found.tables.append(self._phases())
        self._figures()
        found.facts |= {"residual_std": _rms(errors[whole]) / DEG, "residual_unit": "°", "dof": float(whole.size)}
        return Account(
            method="Estimated attitude and gyro biases against the true ones, in rest, rocking, acceleration and turn",
            sources=["EST-ATTITUDE; Mahony 2008; Markley 2014, chapter 6",
                     "GYRO-STATIC-ERR, GYRO-DYNAMIC-ERR; Xia 2008, section 2.2.2, corrected by EX4, EX5"],
            equation='bold(C)_"true" = (1 - [bold(d) times]) hat(bold(C)), quad bold(f) = g bold(C) bold(u) + bold(v), '
            'quad bold(omega) = bold(omega)_"true" + bold(b) + bold(n), quad "NEES" = bold(e)^T bold(P)^(-1) '
            "bold(e)\\/6",
            conventions=[
                "C takes east, north, up to vehicle axes (x right, y forward, z up); heading counter-clockwise from "
                "above.",
                "Error: the rotation vector d by which the vehicle is turned from the estimated to the true attitude.",
                "Bias: what a gyro indicates too much after the compensation.",
                "NEES and NIS: means of the squares by their number, 1 where the stated covariance is right; "
                f"phases {' and '.join(CALM)}, without acceleration.",
            ],
        )  # fmt: skip

    def summary(self) -> list[str]:
        labels = [g.label for g in self.found.gates]
        return [
            f"{self.name or 'The estimator'}: attitude to {self._words('attitude')} over all phases.",
            *(f"Tilt error in {n}: {self._words(f'tilt {n}')}." for n in labels if n in ("acceleration", "turn")),
            *(f"Gyro biases after {g.label}: to {self._words(f'bias {g.label}')}." for g in self.calm[-1:]),
        ]

    def _words(self, name: str) -> str:
        """Return an rms with its interval: "0.0302° (rms; 95 %: 0.024 to 0.041)"."""
        c = self.found[name]
        unit = c.unit if c.unit == "°" else f" {c.unit}"
        return f"{plain(c.estimate, 3)}{unit} (rms; 95 %: {plain(c.interval[0])} to {plain(c.interval[1])})"

    def _size(self, name: str, meaning: str, x: Array, most: float = math.inf, unit: str = "°") -> None:
        """Measure the rms of the length of vectors (n, axes); u of as many independent squares as the series hold.

        most: largest u: where an acceleration makes the error, noise changes it by what it is without one.  The
        interval is that of a root of chi-square with as many degrees of freedom, k its upper side: an rms has no value
        below 0.
        """
        found, scale, value, squares = self.found, DEG if unit == "°" else DPH, _rms(x), np.mean(x * x, axis=0)
        if value == 0.0:
            found.measure(name, meaning, unit, 0.0, 0.0)
            return
        # var of a mean square of Gaussian series: sum of 2 (mean square)^2 / nu
        variance = sum(2.0 * s * s / lasting_squares(x[:, k]) for k, s in enumerate(squares) if s > 0.0)
        u = min(math.sqrt(variance) / (2.0 * value), most)
        nu = 0.5 * (value / u) ** 2
        low, high = (value * math.sqrt(nu / float(special.chdtri(nu, q))) / scale for q in (0.025, 0.975))
        found.measure(name, meaning, unit, value, u, scale=scale)
        c = found.coefficients[-1]
        found.coefficients[-1] = replace(c, interval=(low, high), k=(high - c.estimate) / c.u, dof=nu)

    def _consistency(self) -> None:
        """Test NEES and NIS in the calm phases, where the estimator states a covariance."""
        c, rows = self.record.channels, self.rows
        if rows.size and "estimator.covariance[1,1]" in c and np.any(c["estimator.covariance[1,1]"][rows] > 0.0):
            w = whitened(c, np.column_stack([self.errors, self.drift]), rows)
            # variance of a mean of six mean squares, each of its own number of independent ones: 2/nu
            nu = 36.0 / sum(1.0 / lasting_squares(w[:, k]) for k in range(6))
            self._against("NEES", "errors", float(np.mean(w * w)), nu)
        if rows.size and "estimator.nis" in c and np.any(c["estimator.used"][rows] > 0.0):
            used = float(np.sum(c["estimator.used"][rows]))
            self._against("NIS", "innovations", float(np.sum(c["estimator.nis"][rows])) / used, used)

    def _against(self, name: str, what: str, value: float, nu: float) -> None:
        below = float(special.chdtr(nu, value * nu))
        p, meaning = 2.0 * min(below, 1.0 - below), f"mean squared {what} over their stated covariance"
        self.found.measure(name, meaning, "1", value, math.sqrt(2.0 / nu), closed=1.0)
        seeks = f"mean 1 where the stated covariance is right; {nu:.0f} independent squares"
        wrong = consistency_test(self.found, name, value, 1.0, p, p >= LEVEL, seeks, what)
        calm = " and ".join(CALM)
        text = f"{name} = {plain(value, 3)} instead of 1. {wrong.capitalize()}. Its model does not hold in {calm}."
        self.found.warn(f"estimator.consistency:{name}", text if wrong else "")

    def _phases(self) -> Table:
        rows: list[list[Any]] = []
        c, e = self.record.channels, np.column_stack([self.errors, self.drift])
        stated = "estimator.covariance[1,1]" in c
        for g in self.found.gates:
            size = np.linalg.norm(self.errors[g.inside], axis=1) / DEG
            inside = np.arange(g.inside.start, g.inside.stop)
            nees = float(np.mean(whitened(c, e, inside) ** 2)) if stated else None
            aided = float(np.mean(g["estimator.aided"])) if "estimator.aided" in c else None
            rms = float(np.sqrt(np.mean(size**2)))
            rows.append([g.label, float(g.t[-1] - g.t[0]), rms, float(size.max()), aided, nees])
        caption = (
            "Aided: share of the phase in which the specific force was used. NEES: mean squared error over its "
            "stated covariance, 1 where it is right; above 1 in and after an acceleration that is taken for gravity."
        )
        columns = ["phase", "length / s", "rms error / °", "largest / °", "aided", "NEES"]
        return Table("phases", "Attitude error by phase", caption, columns, rows)

    def _figures(self) -> None:
        """Draw errors of attitude and biases; that of the attitude without acceleration, where it is small, apart."""
        c = self.record.channels
        t = np.asarray(c["time"], dtype=float)
        whole, words = np.arange(t.size), "Error of the attitude"
        axes = f"{words}: rotation vector in vehicle axes"
        figures = [("attitude", axes, self.errors / DEG, DEG, "°", 1, whole)]
        if self.rows.size:
            calm = f"{words} in {' and '.join(CALM)}, without acceleration"
            figures.append(("attitude, calm", calm, self.errors / DEG, DEG, "°", 1, self.rows))
        figures.append(("bias", "Error of the estimated gyro biases", self.drift / DPH, DPH, "°/h", 4, whole))
        for name, caption, values, scale, unit, stated, rows in figures:
            pick = rows[thinned(rows.size, SHOWN)]
            lines = {f"about {a}": values[pick, k] for k, a in enumerate("xyz")}
            key = f"estimator.covariance[{stated},{stated}]"
            if key in c and np.any(c[key] > 0.0):
                sigma = 2.0 * np.sqrt(c[key][pick]) / scale
                lines |= {"+2σ stated, x": sigma, "−2σ stated, x": -sigma}
                caption += "; twice the standard deviation stated for x"
            drawn = over_time(name, t[pick], lines, unit=unit, y_name="error", caption=f"{caption}.", shown=SHOWN)
            self.found.responses.append(drawn)


def _rms(x: Array) -> float:
    """Return the rms of the length of vectors (n, axes)."""
    return math.sqrt(float(np.mean(np.sum(x * x, axis=1))))


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


def whitened(channels: Mapping[str, Array], e: Array, rows: NDArray[np.int_]) -> Array:
    """Return L^-1 e of the rows (n, 6), P = L L': independent, of variance 1 where P is right."""
    P = np.empty((rows.size, 6, 6))
    for i in range(6):
        for j in range(6):
            P[:, i, j] = channels[f"estimator.covariance[{min(i, j) + 1},{max(i, j) + 1}]"][rows]
    scale = np.sqrt(np.einsum("nii->ni", P))
    unit = P / scale[:, :, None] / scale[:, None, :]
    return np.asarray(np.linalg.solve(np.linalg.cholesky(unit), (e[rows] / scale)[..., None])[..., 0])
