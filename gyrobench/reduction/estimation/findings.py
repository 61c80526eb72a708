"""What a linear fit of averaged data has found, with everything a report shows beside the coefficients.

Where what is wanted is a function of what the data are linear in (R = (R/k)/(1/k)), :meth:`Findings.derive` turns
the one into the other with uncertainties to first order.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import known_errors, normal_equations, nuisances
from gyrobench.reduction.estimation import noise as noise_model
from gyrobench.reduction.estimation import residual_series as series
from gyrobench.reduction.estimation.mixture import equivalent_dof
from gyrobench.reduction.estimation.noise_estimate import Evidence, NoiseEstimate
from gyrobench.reduction.estimation.nuisances import Candidate, Hidden
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.reported import Estimates
from gyrobench.reduction.estimation.sentences import p_text, plain
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.result import AllanDeviation, Autocorrelation, PowerSpectrum, Reason, Series, Table, Test

if TYPE_CHECKING:
    from gyrobench.reduction.estimation.linear_fit import Regression

RAW, WHITENED = "ljung_box.raw", "ljung_box.whitened"  # ids of tests of the residuals
RUNS, NORMAL_RESIDUALS = "runs", "shapiro_wilk"
CONTRADICTED = 0.01  # probability that the tests of a clean record speak against its model or noise


@dataclass
class Findings:
    """A fit and what its residuals say; made by :meth:`Regression.fit`.

    Data in SI, what is shown in the unit of the data.
    """

    data: Regression
    quantities: tuple[Quantity, ...]
    est: NoiseEstimate  # of the linear unknowns
    reported: Estimates
    candidates: Sequence[Candidate] = ()  # of the nuisance model, in the order of est.evidence
    hidden: Sequence[Hidden] = ()
    known_tests: list[Test] | None = None  # of the same fit, reported otherwise
    function: Callable[[Array], ArrayLike] | None = None  # of derive()
    corrections: tuple[Any, ...] = ()  # what was taken out of the data, see gyrobench.reduction.estimation.effects
    known: Array | None = None  # (m, n): errors of known size in the data

    def __post_init__(self) -> None:
        dof = self.dof
        residual = self.est.residual / self.y_scale
        self.residual_std = math.sqrt(float(np.sum(self.est.residual**2)) / dof) / self.y_scale
        self.stretches = series.stretches(self.t_start, self.t_end, residual)
        self.ideal = self.residual_std * self.y_scale <= 1e-12 * float(np.max(np.abs(self.y)))

    @property
    def X(self) -> Array:
        """(n, p): the design matrix."""
        return self.data.X

    @property
    def y(self) -> Array:
        """(n,): the data."""
        return self.data.y

    @property
    def t_start(self) -> Array:
        return np.asarray(self.data.t_start)

    @property
    def t_end(self) -> Array:
        return np.asarray(self.data.t_end)

    @property
    def y_unit(self) -> str:
        return self.data.y_unit

    @property
    def y_scale(self) -> float:
        return self.data.y_scale

    @property
    def weights(self) -> Array | None:
        return self.data.weights

    @property
    def white(self) -> bool:
        """True where the noise is assumed, not estimated."""
        return self.data.noise == "white"

    @functools.cached_property
    def tests(self) -> list[Test]:
        """Tests of the residuals, made when they are asked for (a fit without some rows is hardly ever); others may be
        added.
        """
        return self._residual_tests() if self.known_tests is None else list(self.known_tests)

    @property
    def titles(self) -> list[str]:
        return [q.title for q in self.quantities]

    @property
    def made_tests(self) -> list[Test] | None:
        """A copy of the tests, if they have been made."""
        made = self.__dict__.get("tests", self.known_tests)
        return None if made is None else list(made)

    @property
    def dof(self) -> int:
        """Data less coefficients, those of effects that joined among them."""
        flat = sum(e.value.size for c, e in self.joined if not c.scatter)
        return int(self.y.size) - int(self.X.shape[1]) - flat

    @property
    def joined(self) -> list[tuple[Candidate, Evidence]]:
        """Effects of the nuisance model that are reported."""
        return nuisances.reported(self.candidates, self.est)

    @property
    def value(self) -> Array:
        return self.reported.value

    @property
    def u(self) -> Array:
        return self.reported.u

    @property
    def gain(self) -> Array:
        """(q, n): how the reported values change with the data."""
        return self.reported.gain

    def error(self, dy: Array | float = 0.0, dX: Array | None = None) -> Array:
        """What the data (n,) are wrong by, to first order, when data and design X are wrong by dy, dX."""
        error = np.broadcast_to(np.asarray(dy, dtype=float), self.y.shape)
        return error if dX is None else error - dX @ self.est.beta[: dX.shape[1]]

    def derive(self, quantities: Sequence[Quantity], function: Callable[[Array], ArrayLike]) -> Findings:
        """The same fit reported as ``function`` (of the linear unknowns, SI) with uncertainties to first order.

        Effects that joined the model follow as they are.
        """
        r, p = self.est, self.X.shape[1]
        after = self.quantities[p:]
        value, own = self.linearized(function, r.beta[:p])
        if value.size != len(quantities):
            raise ValueError(f"{len(quantities)} quantities for {value.size} values")
        J = np.zeros((value.size, r.beta.size))
        J[:, :p] = own
        sd, half = r.mixture.spread(J)
        u = np.minimum(sd, half / NORMAL)
        size = u / np.maximum(np.sqrt(np.maximum(np.diag(J @ r.covariance @ J.T), 0.0)), 1e-300)
        covariance = (J @ r.covariance @ J.T) * np.outer(size, size)
        dof = equivalent_dof(half / np.maximum(u, 1e-300))
        outside = np.where(u > 0.0, r.mixture.outside(J, np.abs(value)), 0.0)
        reported = Estimates(value, covariance, u, half, outside, dof, J @ r.gain)
        if after:
            reported = _behind(reported, self.reported, p)
        return replace(
            self, quantities=(*quantities, *after), reported=reported, known_tests=self.made_tests, function=function
        )

    def reported_alike(self, other: Findings) -> Findings:
        """Return another fit of the same unknowns, reported as this one."""
        if self.function is None:
            return other
        return other.derive(self.quantities[: len(self.quantities) - len(self.joined)], self.function)

    def linearized(self, function: Callable[[Array], ArrayLike], beta: Array) -> tuple[Array, Array]:
        """Return ``function`` of the linear unknowns beta (p,) and its derivatives (q, p)."""
        size = np.sqrt(np.sum(self.y**2) / np.sum(self.X**2, axis=0))  # of an unknown that makes all the data
        value = np.atleast_1d(np.asarray(function(beta), dtype=float))
        J = np.empty((value.size, beta.size))
        for j in range(beta.size):
            step = np.zeros_like(beta)
            step[j] = 1e-5 * (max(abs(float(beta[j])), float(size[j])) or 1.0)
            high, low = np.asarray(function(beta + step)), np.asarray(function(beta - step))
            J[:, j] = (high - low) / (2.0 * step[j])
        return value, J

    def if_slow(self) -> tuple[float, Array]:
        """Return the probability of slow drift in the noise, and by how much it would widen the interval of each value
        (q,); 1 where it hardly is there.
        """
        beta, p = self.est.beta, self.X.shape[1]
        own = np.eye(p) if self.function is None else self.linearized(self.function, beta[:p])[1]
        J = np.column_stack([own, np.zeros((len(own), beta.size - p))])
        probability, half = self.est.mixture.if_slow(J)
        ratio = np.maximum(half / np.maximum(self.est.mixture.spread(J)[1], 1e-300), 1.0)
        return probability, np.concatenate([ratio, np.ones(max(self.value.size - ratio.size, 0))])

    def nuisance_tables(self) -> list[Table]:
        """Return the table of the nuisance model (none without candidates)."""
        return [] if self.ideal else nuisances.table(self.candidates, self.hidden, self.est, self.titles)

    def nuisance_sentences(self) -> list[str]:
        values = zip(self.value.tolist(), self.u.tolist(), strict=True)
        return nuisances.sentences(self.candidates, self.est, dict(zip(self.titles, values, strict=True)))

    def implausible_nuisances(self) -> list[Reason]:
        return nuisances.implausible(self.candidates, self.est)

    # ------------------------------------------------------------------------------------------ plots
    def series(self) -> list[Series]:
        """Data against what each group is drawn against, with fit, residual and the dense curve."""
        out = []
        fitted, middle = self.y - self.est.residual, (self.t_start + self.t_end) / 2.0
        for g in self.data.groups:
            rows = np.asarray(g.rows)
            rows = np.flatnonzero(rows) if rows.dtype == bool else rows
            x = np.asarray(g.x, dtype=float)
            turn = np.argsort(x, kind="stable")
            x, rows = x[turn], rows[turn]
            curve = np.empty(0), np.empty(0)
            if g.dense is not None:
                shown = np.asarray(g.dense[1], dtype=float) @ self.est.beta[: self.X.shape[1]]
                curve = np.asarray(g.dense[0], dtype=float), shown / self.y_scale
            y, fit, residual = (v[rows] / self.y_scale for v in (self.y, fitted, self.est.residual))
            at, measured = (x, g.x_name, g.x_unit), (y, self.data.y_name, self.y_unit)
            out.append(Series.of(g.label, at, measured, fit, residual, middle[rows], curve))
        return out

    def _parts(self, values: Array) -> list[Array]:
        """Stretches of neighbouring windows; readings that all stand alone count as one, in the order taken."""
        parts = [v for _, v in series.stretches(self.t_start, self.t_end, values)]
        return [values] if self.white or max(p.size for p in parts) < 3 else parts

    def acf(self) -> Autocorrelation:
        parts = self._parts(self.est.residual / self.y_scale)
        return series.autocorrelation(parts, min(40, max(max(p.size for p in parts) // 2, 1)))

    def allan(self) -> AllanDeviation | None:
        values = None if self.ideal else series.allan(self.stretches)
        return values and replace(values, unit=self.y_unit)

    def psd(self) -> PowerSpectrum | None:
        values = None if self.ideal else series.spectrum(self.stretches)
        return values and replace(values, unit=f"({self.y_unit})²/Hz")

    # ------------------------------------------------------------------------------------------ noise
    def noise(self) -> dict[str, Any]:
        """Return the noise model of the estimation; units in the keys."""
        e, unit, scale = self.est.noise, self.y_unit, self.y_scale
        if self.white:
            parameters: dict[str, Any] = {"model": "none (ideal data)" if self.ideal else "white (assumed)"}
            return {**parameters, f"standard deviation / ({unit})": self.residual_std}
        share, drift = e.best[1], "power-law drift" if e.slope else "Gauss-Markov"
        model = "white" if share == 0.0 else drift if share == 1.0 else f"white and {drift}"
        model += " with reading errors" if e.best[2] > 0.0 else ""
        parameters = {
            "model": "none (ideal data)" if self.ideal else model,
            "weight of white noise alone": e.white,
            f"white density / ({unit}/√Hz)": e.density[0] / scale,
            f"white density, 90 % range / ({unit}/√Hz)": [v / scale for v in e.density[1:]],
            f"Gauss-Markov rms / ({unit})": e.sigma[0] / scale,
            f"Gauss-Markov rms, 90 % range / ({unit})": [v / scale for v in e.sigma[1:]],
        }
        if e.slope:
            del parameters[f"Gauss-Markov rms / ({unit})"], parameters[f"Gauss-Markov rms, 90 % range / ({unit})"]
            parameters["exponent a of the spectrum 1/fᵃ"] = e.slope
            parameters[f"power-law drift of a window, rms / ({unit})"] = e.law[0] / scale
            parameters[f"power-law drift of a window, rms, 90 % range / ({unit})"] = [v / scale for v in e.law[1:]]
        if e.sigma_reading[2] > 0.0:
            parameters[f"reading error, standard deviation / ({unit}·s)"] = e.sigma_reading[0] / scale
            parameters[f"reading error, 90 % range / ({unit}·s)"] = [v / scale for v in e.sigma_reading[1:]]
        if e.white < 0.5 and (share > 0.0 or e.best[2] == 0.0) and not self.ideal and not e.slope:
            parameters["correlation time / s"] = e.tau[0]
            parameters["correlation time, 90 % range / s"] = list(e.tau[1:])
        return parameters

    def noise_sentence(self, what: str = "windows") -> str:
        """Return the residual standard deviation and its noise model as a sentence, for the summary."""
        text = f"Residual standard deviation of the {what}: {plain(self.residual_std, 3)} {self.y_unit}"
        if self.ideal or self.white:
            return text + (", rounding only." if self.ideal else ", treated as white noise.")
        return f"{text}{self.est.noise.words(bool(self.broken()))}."

    # ------------------------------------------------------------------------------------------ tests
    def _residual_tests(self) -> list[Test]:
        if self.ideal:
            return []
        e = self.est
        lags = min(20, max(self.y.size // 5, 3))
        null = series.fitted_noise(e.X)
        q, p = series.ljung_box_of_fit(self._parts(e.residual), lags, null)
        text = (
            "no significant autocorrelation"
            if p >= 0.05
            else "the residuals are autocorrelated; the coverage intervals, which assume white noise, are too narrow"
            if self.white
            else "the residuals are autocorrelated; ordinary least squares would understate the uncertainties"
        )
        tests = [Test(RAW, "Ljung-Box, residuals", q, p, f"autocorrelation up to lag {lags}", text)]
        whitened = ", residuals" if self.white else ", whitened residuals"
        null = series.fitted_noise(e.likeliest.fitted)
        if not self.white:
            q, p = series.ljung_box_of_fit(self._parts(e.likeliest.whitened), lags, null)
            text = "autocorrelation remains" if p < 0.05 else "the noise model explains the autocorrelation"
            tests.append(Test(WHITENED, "Ljung-Box" + whitened, q, p, "autocorrelation outside the noise model", text))
        z, p = series.runs_test(e.likeliest.whitened, null)
        text = "neighbours have the same sign too often" if p < 0.05 else "compatible with random signs"
        tests.append(Test(RUNS, "runs" + whitened, z, p, "trends and steps", text))
        w, p = series.normality(e.likeliest.whitened)
        text = (
            "the residuals are not normal; check for outliers" if p < 0.05 else "compatible with a normal distribution"
        )
        tests.append(Test(NORMAL_RESIDUALS, "Shapiro-Wilk" + whitened, w, p, "outliers and skewness", text))
        return tests

    def broken(self) -> list[Test]:
        """Return the tests that contradict the fit: p below CONTRADICTED over their number, so that a clean record has
        none with a probability of 1 - CONTRADICTED.  That of autocorrelation that the noise model includes is not one.
        """
        tests = [t for t in self.tests if t.p is not None and (self.white or t.id != RAW)]
        return [t for t in tests if t.p is not None and t.p * len(tests) < CONTRADICTED]

    def warnings(self) -> list[Reason]:
        """Return what :meth:`broken` tests, and the fit itself, say against its u."""
        broken = [(t.id, f"{t.name}: {p_text(t.p or 0.0)}, {t.finding}. The stated u may be too small.")
                  for t in self.broken()]  # fmt: skip
        return [
            *([Reason("noise.unbounded", text)] if (text := self.est.noise.unbounded) else []),
            *(Reason(*b) for b in broken),
        ]

    def f_test(
        self, id: str, name: str, extra: Array, what: str, bad: str, good: str, minimum: int = 5
    ) -> tuple[Array, Array] | None:
        """Adds an F test of ``extra`` columns (n, k): do they explain more than noise?  ``bad`` is said when they do.

        F is that of the likeliest noise model, p the mean over all, weighted by their probabilities: what a slower
        noise than the likeliest may do by chance is no effect.  Returns the amplitudes of the columns and their
        standard uncertainties (SI).  Of columns that the fit holds in part only the rest is tested.  None, without a
        test, for ideal data, fewer than ``minimum`` degrees of freedom, or columns that the fit holds all.
        """
        basis = self._basis()
        norm = np.linalg.norm(extra, axis=0)
        size = np.where(norm > 0.0, norm, 1.0)  # a column of nothing has no amplitude
        new, s, turned = np.linalg.svd((extra - basis @ (basis.T @ extra)) / size, full_matrices=False)
        there = s > 1e-6
        dof = self.y.size - basis.shape[1] - (k := int(np.count_nonzero(there)))
        if self.ideal or not k or dof < minimum:
            return None
        square, own, squares, weight = self.beside(new[:, there])
        amplitude = np.linalg.solve(square, own[..., None])[..., 0]
        left = np.maximum(squares - np.einsum("gk,gk->g", amplitude, own), 1e-300)
        f = ((squares - left) / k) / (left / dof)
        probability = float(weight @ special.fdtrc(k, dof, f))
        self.tests.append(Test(id, name, float(f[0]), probability, what, bad if probability < 0.05 else good))
        back = turned[there].T / s[there] / size[:, None]
        covariance = back @ np.linalg.inv(square[0]) @ back.T * (left[0] / dof)
        return back @ amplitude[0], np.sqrt(np.maximum(np.diag(covariance), 0.0))

    def beside(self, extra: Array) -> tuple[Array, Array, Array, Array]:
        """Return what the fit leaves of ``extra`` columns (n, k), by noise model: their moments (g, k, k), those
        with the data (g, k), the squares of the data (g,), probabilities (g,): fits of one amplitude add theirs.
        """
        basis = self._basis()
        left = [v - basis @ (basis.T @ v) for v in (extra, self.y)]
        moments = self._whitened_moments(np.column_stack([basis, *left]))
        return *normal_equations.beside(*moments, basis.shape[1]), self.est.noise.models[:, 3]

    def _basis(self) -> Array:
        """Return what the fit holds as orthonormal columns: of what joined some may be alike."""
        basis, s, _ = np.linalg.svd(self.est.X, full_matrices=False)
        return np.asarray(basis[:, s > 1e-9 * s[0]])

    def _whitened_moments(self, columns: Array) -> tuple[Array, Array, Array]:
        """X'X (g, c, c), X'y and y'y of the whitened columns (y the last) for each of the noise models that count."""
        if not self.white:
            e = self.est
            tau, share, reading, weight = e.noise.models.T
            grid, n = noise_model.NoiseGrid(tau, share, weight, reading), self.y.size
            every = np.column_stack([columns[:, :-1], e.likeliest.known, columns[:, -1]])
            moments = normal_equations.moments(self.t_start, self.t_end, every, grid)
            found = known_errors.absorb(moments, columns.shape[1] - 1, n, e.likeliest.variance)
            return found.square, found.own, found.data
        Z = columns if self.weights is None else columns * np.sqrt(self.weights)[:, None]
        square = (Z.T @ Z)[None]
        return square[:, :-1, :-1], square[:, :-1, -1], square[:, -1, -1]


def _behind(first: Estimates, of: Estimates, p: int) -> Estimates:
    """``first`` with all but the first p of ``of`` behind it, as uncorrelated with it."""
    n = first.value.size
    size = n + of.value.size - p
    covariance = np.zeros((size, size))
    covariance[:n, :n], covariance[n:, n:] = first.covariance, of.covariance[p:, p:]
    rest = (np.concatenate([getattr(first, k), getattr(of, k)[p:]]) for k in ("u", "half_width", "p", "dof", "gain"))
    return Estimates(np.concatenate([first.value, of.value[p:]]), covariance, *rest)
