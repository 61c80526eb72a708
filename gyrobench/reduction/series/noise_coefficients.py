"""Noise coefficients N, B, K, R, Q of a rate record, by restricted maximum likelihood and by slopes of the deviation.

Model of the rate [IEEE 952, annex C], S two-sided: sigma_A^2(tau) = 4 int_0^inf S sin^4(pi f tau)/(pi f tau)^2 df,

    term                      S(f)                            sigma_A^2(tau)        unit
    N  angle random walk      N^2                             N^2/tau               rad/s/sqrt(Hz) = rad/sqrt(s)
    B  bias instability       B^2/(2 pi f)                    2 ln 2 B^2/pi         rad/s
    K  rate random walk       K^2/(2 pi f)^2                  K^2 tau/3             rad/s^2/sqrt(Hz)
    Q  quantization           (2 pi f)^2 tau0 Q^2, f << 1/tau0   3 Q^2/tau^2        rad
    R  rate ramp              (deterministic, R t)            R^2 tau^2/2           rad/s^2

B is flicker at every frequency of the record, no cutoff.  A sample is the mean of the rate over tau0, a difference of
angles; Q is the standard deviation of the error of an angle, independent from reading to reading.

fit() maximizes the likelihood of :mod:`noise_likelihood`, where averaging, aliasing and the ramp are exact; slopes()
reads the Allan deviation as the standard does.  [DRIFT-COEFFICIENTS; IEEE 952, annex C]
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from scipy import optimize, special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.series.deviations import Deviation
from gyrobench.reduction.series.long_record import SHORTEST, Condensed, LongRecord
from gyrobench.reduction.series.noise_likelihood import Likelihood
from gyrobench.reduction.series.noise_spectra import folded

STEPS = 100  # of the search for a maximum, at most
DEPARTS = 0.001  # probability from which on a departure from the model is reported
RAMPS = 13  # values of K over which the interval of the ramp is a mixture
NAMES = ("N", "B", "K", "Q")  # order of the variances
FEW = 4.0  # standard uncertainties below which a determined coefficient is just determined
#: what counts say of those (tests/benchmarks/README.md: 0.60 to 0.78 of N, B, K, R hold the truth, none of seven of Q)
JUST = (
    "just determined, below 4 u: of such estimates at least one interval in four misses the truth, where 95 % says one "
    "in twenty; among them are terms that are not there at all. Repeat or lengthen the record before using them"
)


@dataclass(frozen=True)
class Estimate:
    """One coefficient; not determined: the interval of 95 % holds zero, the coefficient is below ``high``.

    The interval covers whatever the truth; among those that just exclude zero are more misses: JUST says so.
    """

    value: float
    low: float
    high: float
    determined: bool

    @property
    def just_determined(self) -> bool:
        """Whether it is below four standard uncertainties: such an interval misses more often than its 5 %."""
        return self.determined and abs(self.value) < FEW * (self.high - self.low) / (2.0 * NORMAL)


@dataclass(frozen=True)
class ModelCheck:
    """Whether the spectrum is that of the five terms.

    p: probability of so large a departure if it is; band: lower and upper frequency (Hz) of the largest, ratio: power
    over the model's there; even: powers are nearer to the model than those of noise.  line_p: probability of a single
    ordinate so large, line: its frequency (Hz); of a record of more than 2^21 samples only up to 1/(1024 tau0).
    """

    p: float
    band: tuple[float, float]
    ratio: float
    line_p: float
    line: float
    even: bool

    def finding(self) -> str:
        """Return what departs from the model with p < 0.001, or an empty string."""
        found = []
        low, high = self.band
        if self.p < DEPARTS and self.even:
            found.append("its powers are more even than those of noise, as of a step or a wild sample")
        elif self.p < DEPARTS:
            found.append(f"{low:.2g} to {high:.2g} Hz has {self.ratio:.2g} times the power of the model")
        if self.line_p < DEPARTS:
            found.append(f"a line at {self.line:.4g} Hz")
        if not found:
            return ""
        remedy = "The coefficients and their intervals are not those of the instrument; remove what is not noise"
        return f"The five terms do not describe the record (p < {DEPARTS:g}): {', '.join(found)}. {remedy}"


@dataclass(frozen=True)
class NoiseCoefficients:
    """N [rad/s/sqrt(Hz)], B [rad/s], K [rad/s^2/sqrt(Hz)], R [rad/s^2, signed], Q [rad] with intervals of 95 %.

    check: of the fit; where p is small the five terms do not describe the record and the intervals mean little.
    """

    N: Estimate
    B: Estimate
    K: Estimate
    R: Estimate
    Q: Estimate
    check: ModelCheck | None = None

    def allan(self, tau: Array) -> Array:
        """Return the Allan deviation (k,) of the determined terms over tau (s)."""
        n, b, k, r, q = (e.value if e.determined else 0.0 for e in (self.N, self.B, self.K, self.R, self.Q))
        parts = n * n / tau + 2.0 * math.log(2.0) / math.pi * b * b + k * k * tau / 3.0
        return np.asarray(np.sqrt(parts + r * r * tau**2 / 2.0 + 3.0 * q * q / tau**2))

    def spectrum(self, f: Array, tau0: float) -> Array:
        """Return the two-sided spectrum (k,) of the determined terms for samples that are means over tau0 (s).

        Averaging and aliasing included: 0 < f <= 1/(2 tau0).  The ramp has none.
        """
        n, b, k, q = (e.value if e.determined else 0.0 for e in (self.N, self.B, self.K, self.Q))
        sine = 4.0 * np.sin(np.pi * f * tau0) ** 2
        out: Array = n * n + b * b * tau0 * folded(f * tau0) + q * q / tau0 * sine
        return out + (k * tau0) ** 2 * (1.0 - sine / 6.0) / sine


@functools.cache
def _critical_table() -> tuple[Array, Array]:
    """Critical value of the likelihood ratio at 95 % for a normal estimate bounded by zero, against the true value/sd.

    1.645^2 at zero, 1.960^2 from 1.96 on; between, the ratio of a truncated estimate is accepted in 95 %.
    """
    size = np.linspace(0.0, 2.0, 41)

    def excess(c: float, mu: float) -> float:
        root = math.sqrt(c)
        lowest = mu - root if root <= mu else (mu * mu - c) / (2.0 * mu)
        return float(special.ndtr(root) - special.ndtr(lowest - mu)) - 0.95

    values = [optimize.brentq(excess, 1.0, 9.0, args=(mu,)) if mu > 0.0 else 2.705543 for mu in size]
    return size, np.array(values)


class _Fit:
    """Maximum of the likelihood and profiles of it."""

    def __init__(self, likelihood: Likelihood) -> None:
        self.f = likelihood
        self.v, self.least = self._minimum(likelihood.start(), None)
        self.scale = self._sd(self.v)

    def _sd(self, v: Array) -> Array:
        info = self.f.information(v)
        d = 1.0 / np.sqrt(np.diag(info))
        return np.asarray(d * np.sqrt(np.diag(np.linalg.pinv(info * np.outer(d, d), rcond=1e-10, hermitian=True))))

    def _minimum(self, v: Array, fixed: int | None) -> tuple[Array, float]:
        """Return v >= 0 of the least -2 log likelihood by scoring steps, one component fixed; and the value there."""
        free = np.array([i for i in range(4) if i != fixed])
        f, slope = self.f(v)
        for _ in range(STEPS):
            # the step to v + d >= 0 that minimizes slope d + d' info d, as a least squares problem of v + d
            info = 2.0 * self.f.information(v)[np.ix_(free, free)]
            size = 1.0 / np.sqrt(np.diag(info))
            root = np.linalg.cholesky(info * np.outer(size, size) + 1e-9 * np.eye(free.size))
            now = v[free] / size
            new, _ = optimize.nnls(root.T, root.T @ now - np.linalg.solve(root, slope[free] * size))
            step = np.zeros(4)
            step[free] = (new - now) * size
            gain = -float(slope @ step)
            if gain < 1e-4:
                break
            part = 1.0
            while part > 1e-6:
                trial = np.maximum(v + part * step, 0.0)
                value, changed = self.f(trial)
                if value <= f - 1e-3 * min(part * gain, 1.0):  # from far away the gain is overrated
                    break
                part *= 0.5
            else:
                break
            v, f, slope = trial, value, changed
        return v, f

    def interval(self, j: int) -> tuple[float, float]:
        """Return the ends of v_j: where the profile of the likelihood ratio reaches its critical value."""
        path = {float(self.v[j]): (self.v, self.least)}

        def excess(value: float) -> float:
            near = min(path, key=lambda known: abs(known - value))
            start = path[near][0].copy()
            start[j] = value
            path[value] = v, least = self._minimum(start, j)
            return least - self.least - float(np.interp(value / self._sd(v)[j], *_critical_table()))

        centre, step = float(self.v[j]), float(self.scale[j])
        low = 0.0
        if centre > 0.0 and excess(0.0) > 0.0:
            low = float(optimize.brentq(excess, 0.0, centre, rtol=1e-3, xtol=1e-3 * step))
        upper = centre + 2.0 * step
        while excess(upper) < 0.0:
            upper = centre + 2.0 * (upper - centre)
        high = float(optimize.brentq(excess, centre, upper, rtol=1e-3, xtol=1e-3 * step))
        return low, high

    def ramp(self) -> tuple[float, float, float]:
        """Return the ramp per sample and the ends of its interval of 95 %.

        A mixture of normals over the profile of K, which is what makes the ramp uncertain and is uncertain itself.  The
        weight falls as 1/sqrt(K): an even one covers 0.975, 1/K 0.94 (counted).
        """
        top = math.sqrt(max(self.interval(2)[1], float(self.v[2])))
        rows = []
        for i, root in enumerate(np.linspace(0.0, 1.5 * top, RAMPS)):
            start = self.v.copy()
            start[2] = root * root
            v, least = self._minimum(start, 2)
            rows.append((math.exp(0.5 * (self.least - least)) / math.sqrt(i + 0.5), *self.f.ramp(v)))
        weight, mean, sd = np.array(rows).T
        weight /= weight.sum()
        ends = float((mean - 8.0 * sd).min()), float((mean + 8.0 * sd).max())

        def quantile(p: float) -> float:
            return float(optimize.brentq(lambda r: float(weight @ special.ndtr((r - mean) / sd)) - p, *ends))

        return self.f.ramp(self.v)[0], quantile(0.025), quantile(0.975)


class CoefficientAccumulator:
    """Coefficients of a record that comes in blocks: ``add`` each, ``gap`` where the time is not known; SI.

    Up to 16 lost samples in a row (NaN) are filled if they are 1 % at most, more of them split the record.  Stretches
    of 40 samples or more, at most the 200 longest, are used as independent of each other: their means and the time
    between them are not used.  The memory is that of 2^21 samples and of one in 512.
    """

    def __init__(self, tau0: float) -> None:
        if not tau0 > 0.0:
            raise ValueError(f"tau0 = {tau0} s; it must be positive")
        self.tau0, self._record = tau0, LongRecord()
        self.add, self.gap = self._record.add, self._record.gap

    def result(self) -> NoiseCoefficients:
        """End the record; return its coefficients."""
        record = self._record.condensed()
        if not record.stretches:
            raise ValueError(f"no stretch of {SHORTEST * record.block} samples without a gap")
        size = math.sqrt(float(np.mean([np.var(np.diff(p)) for p in record.stretches])))
        if not size > 0.0:
            raise ValueError("the record is constant; it has no noise to fit")
        return _coefficients(*_without_ramp(record, size), size, self.tau0)


def fit(rate: Array | Iterable[Array], tau0: float) -> NoiseCoefficients:
    """Return the coefficients of a rate (n,), or of stretches of it, see :class:`CoefficientAccumulator`."""
    total = CoefficientAccumulator(tau0)
    for stretch in [rate] if isinstance(rate, np.ndarray) else rate:
        total.add(stretch)
        total.gap()
    return total.result()


def _without_ramp(record: Condensed, size: float) -> tuple[Condensed, float]:
    """Return the record in units of ``size`` less the line of least squares common to its stretches, and its slope.

    What is left of a ramp is small, so that it may be taken as even within a bin of ordinates.
    """
    parts = [p / size for p in record.stretches]
    times = [(np.arange(p.size) - 0.5 * (p.size - 1)) * record.block for p in parts]
    slope = sum(float(t @ p) for t, p in zip(times, parts, strict=True)) / sum(float(t @ t) for t in times)
    level = [p - slope * t for t, p in zip(times, parts, strict=True)]
    fast = record.fast * np.array([1.0, size**-2.0, 1.0, 1.0, 1.0, 1.0, 1.0])[:, None]
    return Condensed(level, record.block, fast), slope


def _coefficients(record: Condensed, line: float, size: float, tau0: float) -> NoiseCoefficients:
    found = _Fit(Likelihood(record))
    unit = {"N": size * math.sqrt(tau0), "B": size, "K": size / math.sqrt(tau0), "Q": size * tau0}
    estimates = {}
    for j, name in enumerate(NAMES):
        low, high = found.interval(j)
        value, low, high = (math.sqrt(x) * unit[name] for x in (float(found.v[j]), low, high))
        estimates[name] = Estimate(value, low, high, low > 0.0)
    slope, low, high = ((x + line) * size / tau0 for x in found.ramp())
    p, (lower, upper, ratio), line_p, line_at = found.f.check(found.v)
    band = float(lower) / tau0, float(upper) / tau0
    check = ModelCheck(2.0 * min(p, 1.0 - p), band, float(ratio), line_p, line_at / tau0, p > 0.5)
    estimates["R"] = Estimate(slope, low, high, low * high > 0.0)
    return _result(estimates, check)


#: Slope of the Allan deviation and what its value at tau is multiplied by: coefficient = factor * sigma * tau^-slope.
SLOPES = {
    "Q": (-1.0, 1.0 / math.sqrt(3.0)),
    "N": (-0.5, 1.0),
    "B": (0.0, math.sqrt(math.pi / (2.0 * math.log(2.0)))),
    "K": (0.5, math.sqrt(3.0)),
    "R": (1.0, math.sqrt(2.0)),
}


def slopes(deviation: Deviation) -> NoiseCoefficients:
    """Return the coefficients as they are read from an Allan deviation, [IEEE 952, annex C]; R without its sign.

    A straight line of the slope of the term through the pair of neighbouring tau (edf of 5 or more) whose slope is
    nearest; its interval is that of the deviation there.  No pair within 0.25 of the slope: not determined, below the
    lowest line over the upper ends of the deviation.  Terms are read as if alone: where two are of like size, the
    reading is high by up to the square root of two, and the interval does not cover.
    """
    usable = (deviation.edf >= 5.0) & (deviation.deviation > 0.0)
    tau, dev = deviation.tau[usable], deviation.deviation[usable]
    low, high = deviation.low[usable], deviation.high[usable]
    local = np.diff(np.log(dev)) / np.diff(np.log(tau))
    found = {}
    for name, (slope, factor) in SLOPES.items():
        line = factor * tau**-slope
        top = float(np.min(line * high, initial=math.inf))
        i = int(np.argmin(np.abs(local - slope))) if local.size else 0
        if not local.size or abs(local[i] - slope) > 0.25:
            found[name] = Estimate(0.0, 0.0, top, False)
            continue
        value, least, most = (math.sqrt(float(y[i] * y[i + 1])) for y in (line * dev, line * low, line * high))
        found[name] = Estimate(value, least, most, True)
    return _result(found)


def _result(found: dict[str, Estimate], check: ModelCheck | None = None) -> NoiseCoefficients:
    return NoiseCoefficients(found["N"], found["B"], found["K"], found["R"], found["Q"], check)
