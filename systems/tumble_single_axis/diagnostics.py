"""What the residuals of a tumble say: plots, tests, harmonics the model does not hold, turn-to-turn repeatability."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench import drift, units
from gyrobench.reduction import attitude, correlated, harmonic, series
from gyrobench.reduction import noise as noise_model
from gyrobench.reduction.regression import Fit
from gyrobench.reduction.result import Coefficient, Series, Test

from .budget import TILT, design

if TYPE_CHECKING:
    from .reduction import TumbleSetup

Array = NDArray[np.float64]
DPH = units.factor("deg/h")
RAW = "Ljung-Box, residuals"


def plus_minus(c: Coefficient) -> str:
    """ "-0.3001 ± 0.0023 °/h (95 %)": expanded uncertainty with two digits."""
    U = c.k * c.u
    if not U > 0.0 or not math.isfinite(U):
        return f"{c.estimate:.6g} {c.unit}"
    digits = max(0, 1 - math.floor(math.log10(U)))
    return f"{c.estimate:.{digits}f} ± {U:.{digits}f} {c.unit} (95 %)"


@dataclass
class Findings:
    """Everything a report shows beside the coefficients; data y and residuals in rad/s, one for each window."""

    setup: TumbleSetup
    phase: NDArray[np.int_]
    turning: attitude.Turning
    y: Array
    X: Array
    est: correlated.Estimate
    closed: Mapping[str, float]
    fits: Mapping[str, Fit]
    warnings: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        t = self.turning
        self.middle = (t.t_start + t.t_end) / 2.0
        self.angle = (t.angle_start + t.angle_end) / 2.0
        self.turn = np.zeros(self.y.size, dtype=int)
        for p in self.setup.faces:
            mine = self.phase == p
            if self.setup.turns(p):
                way = np.abs(self.angle[mine] - t.angle_start[mine][0])
                self.turn[mine] = np.floor(way / (2.0 * math.pi)).astype(int)
        dof = self.y.size - self.X.shape[1]
        self.residual_std = math.sqrt(float(np.sum(self.est.residual**2)) / dof) / DPH
        self.parts = series.stretches(t.t_start, t.t_end, self.est.residual / DPH)
        self.ideal = self.residual_std * DPH <= 1e-12 * float(np.max(np.abs(self.y)))
        self._tests = self._run_tests()
        for test in self._tests:
            if test.p is not None and test.p < 0.001 and test.name != RAW:  # correlation is allowed for
                self.warnings.append(f"{test.name}: p = {test.p:.2g}, {test.finding}.")

    # ------------------------------------------------------------------------------------------ plots
    def series(self) -> list[Series]:
        """Drift against table angle (mounts) or time (dwells), with fit, residual and a dense curve."""
        out = []
        fitted = self.y - self.est.residual
        for p in self.setup.faces:
            rows = np.flatnonzero(self.phase == p)
            turns = self.setup.turns(p)
            if turns:
                x = np.degrees(np.mod(self.angle[rows], 2.0 * math.pi))
                rows = rows[np.argsort(x, kind="stable")]
                x = np.sort(x, kind="stable")
            else:
                x = self.middle[rows] - self.turning.t_start[rows][0]
            s = Series(
                label=self.setup.label(p), x=x.tolist(), x_name="table angle" if turns else "time in the dwell",
                x_unit="°" if turns else "s", y=(self.y[rows] / DPH).tolist(), fit=(fitted[rows] / DPH).tolist(),
                residual=(self.est.residual[rows] / DPH).tolist(), y_name="drift rate", y_unit="°/h",
                t=self.middle[rows].tolist(),
            )  # fmt: skip
            if turns:
                dense = np.radians(np.arange(0.0, 361.0, 3.0))
                face = np.broadcast_to(np.asarray(self.setup.faces[p], dtype=float), (dense.size, 3, 3))
                still = attitude.Turning(dense, dense, np.zeros_like(dense), np.ones_like(dense), face)
                X = design(self.setup, still, self.est.names)
                if TILT in self.est.names:
                    X[:, -1] = float(np.mean(self.X[rows, -1]))  # the table turns, the plotted one does not
                s.shown_fit_x = np.degrees(dense).tolist()
                s.shown_fit_y = (X @ self.est.beta / DPH).tolist()
            out.append(s)
        return out

    def acf(self) -> dict[str, list[float]]:
        longest = max(v.size for _, v in self.parts)
        return series.autocorrelation([v for _, v in self.parts], min(40, max(longest // 2, 1)))

    def allan(self) -> dict[str, Any]:
        found = {} if self.ideal else series.allan(self.parts)
        return {**found, "unit": "°/h"} if found else {}

    def psd(self) -> dict[str, Any]:
        found = {} if self.ideal else series.spectrum(self.parts)
        return {**found, "unit": "(°/h)²/Hz"} if found else {}

    # ------------------------------------------------------------------------------------------ noise
    def noise(self) -> dict[str, Any]:
        e = self.est
        share = e.best[1]
        model = "white" if share == 0.0 else "Gauss-Markov" if share == 1.0 else "white and Gauss-Markov"
        found: dict[str, Any] = {
            "model": "none (ideal data)" if self.ideal else model,
            "weight of white noise alone": e.white,
            "white density / (°/h/√Hz)": e.density[0] / DPH,
            "white density, 90 % range / (°/h/√Hz)": [v / DPH for v in e.density[1:]],
            "Gauss-Markov rms / (°/h)": e.sigma[0] / DPH,
            "Gauss-Markov rms, 90 % range / (°/h)": [v / DPH for v in e.sigma[1:]],
        }
        if e.white < 0.5 and not self.ideal:
            found["correlation time / s"] = e.tau[0]
            found["correlation time, 90 % range / s"] = list(e.tau[1:])
        return found

    def noise_sentence(self) -> str:
        """The third number that matters, in words."""
        text = f"Residual scatter of the windows {self.residual_std:.3g} °/h"
        if self.ideal:
            return text + ", rounding only."
        if self.est.best[1] == 0.0:
            return text + ", compatible with white noise."
        return text + f", correlated over about {self.est.tau[0]:.3g} s; the intervals allow for it."

    # ------------------------------------------------------------------------------------------ tests
    def tests(self) -> list[Test]:
        return self._tests

    def _run_tests(self) -> list[Test]:
        if self.ideal:
            return []
        n, e = self.y.size, self.est
        parts = [v for _, v in series.stretches(self.turning.t_start, self.turning.t_end, e.whitened)]
        lags = min(20, max(n // 5, 3))
        raw = series.autocorrelation([v for _, v in self.parts], lags)
        whitened = series.autocorrelation(parts, lags)
        found = []
        q, p = series.ljung_box(raw, n, lags)
        text = (
            "the noise is correlated; ordinary least squares would be too sure of itself"
            if p < 0.05
            else "no correlation seen"
        )
        found.append(Test(RAW, q, p, f"correlation up to lag {lags}", text))
        q, p = series.ljung_box(whitened, n, lags, 2 if e.best[1] > 0.0 else 0)
        text = "the noise model leaves some correlation" if p < 0.05 else "the noise model explains the correlation"
        found.append(Test("Ljung-Box, whitened residuals", q, p, "correlation the noise model does not hold", text))
        z, p = series.runs_test(e.whitened)
        text = "signs of the residuals do not change at random" if p < 0.05 else "signs change at random"
        found.append(Test("runs, whitened residuals", z, p, "slow trends and jumps", text))
        w, p = series.normality(e.whitened)
        text = "not normal; look for outliers" if p < 0.05 else "compatible with a normal distribution"
        found.append(Test("Shapiro-Wilk, whitened residuals", w, p, "outliers and skewness", text))
        found += self._harmonic_test()
        found += self._turn_test()
        return found

    def _whitened_fit(self, extra: Array) -> tuple[Array, Array, float, float, int]:
        """Coefficients, covariance, residual sums without and with ``extra`` columns, whitened; dof."""
        t = self.turning
        tau, share = self.est.best
        both = np.column_stack([self.X, extra, self.y])
        Z, _ = noise_model.whiten(t.t_start, t.t_end, both, np.array([tau]), np.array([share]))
        Z = Z[:, 0, :]
        z, A, p = Z[:, -1], Z[:, :-1], self.X.shape[1]
        plain = np.linalg.lstsq(A[:, :p], z, rcond=None)[0]
        q, r = np.linalg.qr(A)
        full = np.linalg.solve(r, q.T @ z)
        rss0, rss1 = float(np.sum((z - A[:, :p] @ plain) ** 2)), float(np.sum((z - A @ full) ** 2))
        dof = z.size - A.shape[1]
        inverse = np.linalg.inv(r)
        covariance = inverse @ inverse.T * (rss1 / dof)
        return full[p:], covariance[p:, p:], rss0, rss1, dof

    def _high_columns(self) -> tuple[Array, list[tuple[str, int, str]]]:
        """Cosines and sines from the third harmonic on, for each mount: columns and (mount, order, A|B)."""
        t = self.turning
        columns, labels = [], []
        for p in (p for p in self.setup.faces if self.setup.turns(p)):
            mine = self.phase == p
            width = float(np.max(np.abs(t.angle_end[mine] - t.angle_start[mine])))
            top = min(6, int(0.45 * 2.0 * math.pi / width))
            block, names = harmonic.columns(-t.angle_start, -t.angle_end, range(3, top + 1)) if top >= 3 else (None, ())
            for j, name in enumerate(names):
                assert block is not None
                columns.append(np.where(mine, block[:, j], 0.0))
                labels.append((self.setup.label(p), int(name[1:]), name[0]))
        return (np.stack(columns, axis=1) if columns else np.empty((self.y.size, 0))), labels

    def _harmonic_test(self) -> list[Test]:
        columns, labels = self._high_columns()
        k = len(labels)
        self.high: list[tuple[str, int, str, float, float]] = []
        if not k or self.y.size - self.X.shape[1] - k < 5:
            return []
        values, covariance, rss0, rss1, dof = self._whitened_fit(columns)
        u = np.sqrt(np.diag(covariance))
        self.high = [(*label, float(v) / DPH, float(s) / DPH) for label, v, s in zip(labels, values, u, strict=True)]
        f = ((rss0 - rss1) / k) / (rss1 / dof)
        p = float(special.fdtrc(k, dof, f))
        text = "something turns with the table that the model does not hold" if p < 0.05 else "no more than noise"
        return [Test("harmonics 3 and higher", f, p, "model errors periodic in the table angle", text)]

    def harmonics(self) -> list[dict[str, Any]]:
        """Amplitudes per mount with u: 0 to 2 from the book's sums, 3 and higher from the residuals; in °/h."""
        out = []
        for mount, f in self.fits.items():
            u = f.u / DPH
            for n in range(3):
                a = f.names.index(f"A{n}")
                b = float(f.beta[a + 1]) / DPH if n else None
                out.append(
                    {"series": mount, "n": n, "a": float(f.beta[a]) / DPH, "b": b, "u": float(u[a]), "unit": "°/h"}
                )
        for (mount, n, _, a, u_a), (_, _, _, b, u_b) in zip(self.high[::2], self.high[1::2], strict=True):
            out.append({"series": mount, "n": n, "a": a, "b": b, "u": max(u_a, u_b), "unit": "°/h"})
        return out

    high: list[tuple[str, int, str, float, float]] = field(default_factory=list)

    def _turn_columns(self) -> Array:
        """Five columns (harmonics 0, 1, 2) for each turn but the first of each phase that turns."""
        t = self.turning
        block, _ = harmonic.columns(-t.angle_start, -t.angle_end, range(3))
        columns = []
        for p in (p for p in self.setup.faces if self.setup.turns(p)):
            for k in range(1, int(self.turn[self.phase == p].max()) + 1):
                mine = (self.phase == p) & (self.turn == k)
                if mine.sum() >= 5:
                    columns.append(np.where(mine[:, None], block, 0.0))
        return np.concatenate(columns, axis=1) if columns else np.empty((self.y.size, 0))

    def _turn_test(self) -> list[Test]:
        columns = self._turn_columns()
        k = columns.shape[1]
        if not k or self.y.size - self.X.shape[1] - k < 5:
            return []
        _, _, rss0, rss1, dof = self._whitened_fit(columns)
        f = ((rss0 - rss1) / k) / (rss1 / dof)
        p = float(special.fdtrc(k, dof, f))
        text = "the turns differ by more than the noise" if p < 0.05 else "the turns agree within the noise"
        return [Test("turn to turn", f, p, "change of the drift between successive turns", text)]

    def repeatability(self) -> dict[str, Any]:
        """F test of the turns and the scatter of their harmonics; empty for a single turn."""
        test = next((t for t in self._tests if t.name == "turn to turn"), None)
        if test is None:
            return {}
        rows = self._turn_rows()
        scatter = {}
        for column, name in enumerate(("A0", "A1", "B1", "A2", "B2"), 2):
            spread = []
            for label in {r[0] for r in rows}:
                values = [float(r[column]) for r in rows if r[0] == label]
                if len(values) > 1:
                    spread.append(float(np.var(values, ddof=1)))
            scatter[f"scatter of {name} / (°/h)"] = math.sqrt(float(np.mean(spread))) if spread else 0.0
        return {"F": test.statistic, "p": test.p, "finding": test.finding, **scatter}

    def _turn_rows(self) -> list[list[Any]]:
        t, rows = self.turning, []
        for p in (p for p in self.setup.faces if self.setup.turns(p)):
            for k in range(int(self.turn[self.phase == p].max()) + 1):
                mine = (self.phase == p) & (self.turn == k)
                if mine.sum() > 5:
                    f = harmonic.fit(-t.angle_start[mine], -t.angle_end[mine], self.y[mine])
                    rows.append([self.setup.label(p), k + 1, *(f.beta / DPH).tolist()])
        return rows

    # ------------------------------------------------------------------------------------------ tables
    def tables(self) -> list[dict[str, Any]]:
        """Least squares beside the closed formulas; harmonics of each turn."""
        out = []
        if self.closed:
            rows = []
            for j, name in enumerate(n for n in self.est.names if n != TILT):
                a, b = float(self.est.beta[j]) / DPH, self.closed[name] / DPH
                unit = units.display(drift.surface_unit(name))
                rows.append([name, a, b, a - b, float(self.est.u[j]) / DPH, unit])
            caption = "From the same windows; the formulas weigh all windows alike, D_F and D_O rest on the dwells"
            head = ["coefficient", "least squares", "closed formula", "difference", "u", "unit"]
            out.append(
                {"title": "Least squares and closed formulas", "caption": caption, "columns": head, "rows": rows}
            )
        if int(self.turn.max()) > 0:
            head = ["series", "turn", "A0", "A1", "B1", "A2", "B2"]
            rows = self._turn_rows()
            out.append(
                {
                    "title": "Harmonics of each turn",
                    "caption": "Amplitudes in °/h over θ = −angle",
                    "columns": head,
                    "rows": rows,
                }
            )
        return out
