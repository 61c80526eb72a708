"""Tracking error of a ride: mean, rms, share inside an accuracy, lag and its coefficients, each with its uncertainty.

Slow motion of the target makes e = c1 w + c2 w' + c3 w'', 1/(1 + L) = c1 s + c2 s2 + c3 s3 + ...: for type 1 K_v =
1/c1, for type 2 c1 = 0 and K_a = 1/c2.  Uncertainties come from the scatter of stretches of the ride, from which this
lag has been taken away; they hold noise that is faster than a stretch.  [TRACK-LOOP; Franklin 2010, section 4.2]
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.record.frequency_response import model_response
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.estimator_metrics import UncertainValue
from gyrobench.reduction.loops.jitter import root

STRETCHES = 12
SLOW = 300.0  # crossover over the frequency at which the coefficients are taken
SLIGHT = 1e-4  # of a slope's regressor over its mean: less is constant


@dataclass(frozen=True)
class ErrorCoefficients:
    """c1 (s), c2 (s2), c3 (s3) of the error by rate, acceleration and jerk of the target."""

    c1: float
    c2: float
    c3: float

    def lag(self, rate: Array, acceleration: Array, dt: float) -> Array:
        """Return the error that a motion makes, rad."""
        return self.c1 * rate + self.c2 * acceleration + self.c3 * np.gradient(acceleration, dt)


def error_coefficients(loop: LinearModel, crossover: float) -> ErrorCoefficients:
    """Return the coefficients of an open loop that crosses at ``crossover``, Hz, from its response far below."""
    f = crossover / SLOW * np.array([1.0, 2.0])
    w = 2.0 * np.pi * f
    S = 1.0 / (1.0 + model_response(loop, f)[:, 0, 0])
    odd, even = S.imag / w, -S.real / w**2
    c3 = float((odd[0] - odd[1]) / (w[1] ** 2 - w[0] ** 2))
    return ErrorCoefficients(float(odd[0] + c3 * w[0] ** 2), float((4.0 * even[0] - even[1]) / 3.0), c3)


@dataclass(frozen=True)
class TrackingError:
    """e: error about pitch and yaw, (2, samples), rad.  lag: what of it follows the target, alike."""

    e: Array
    lag: Array

    def mean(self, k: int) -> UncertainValue:
        """Return the mean of an axis."""
        return UncertainValue(float(self.e[k].mean()), *_scatter(self.e[k] - self.lag[k]))

    def rms(self, k: int | None = None) -> UncertainValue:
        """Return the root mean square of an axis, None: of both together."""
        rows = [0, 1] if k is None else [k]
        square = float(np.sum(np.mean(self.e[rows] ** 2, axis=1)))
        made = np.sum(self.e[rows] ** 2 - self.lag[rows] ** 2, axis=0)
        return root(UncertainValue(square, *_scatter(made)))

    @property
    def size(self) -> Array:
        return np.asarray(np.hypot(*self.e))

    @property
    def peak(self) -> float:
        """Return the largest error of both axes together."""
        return float(self.size.max())

    def inside(self, wanted: float) -> tuple[float, float, tuple[float, float]]:
        """Return the share of the time with an error below ``wanted``, its u and its interval, %.

        With all or none of it inside the interval is that of Clopper and Pearson for as many readings as are
        independent by the autocorrelation of the squared error.
        """
        inside = (self.size < wanted).astype(float)
        share = float(inside.mean())
        if share in (0.0, 1.0):
            edge = 100.0 * (1.0 - 0.025 ** (1.0 / self._independent()))
            interval = (100.0 - edge, 100.0) if share else (0.0, edge)
            return 100.0 * share, 0.5 * edge / 1.96, interval
        u, dof = _scatter(inside)
        half = float(special.stdtrit(dof, 0.975)) * u
        return 100.0 * share, 100.0 * u, (100.0 * max(0.0, share - half), 100.0 * min(1.0, share + half))

    def _independent(self) -> float:
        y = self.size**2
        y = y - y.mean()
        n = y.size
        spectrum = np.abs(np.fft.rfft(y, 2 * n)) ** 2
        rho = np.fft.irfft(spectrum)[:n]
        if not rho[0] > 0.0:
            return 1.0
        rho = rho / rho[0]
        end = int(np.argmax(rho < 0.0)) or n
        return max(1.0, n / (1.0 + 2.0 * float(np.sum(rho[1:end]))))

    def slope(self, k: int, of: Array, *others: Array) -> UncertainValue | None:
        """Return the error per unit of a motion, beside a constant and other motions; None where it is constant.

        A motion that is constant makes error over motion, without a constant.
        """
        kept = [x for x in (of, *others) if np.std(x) > SLIGHT * np.max(np.abs(x), initial=0.0)]
        if not kept or kept[0] is not of:
            if not np.any(of):
                return None
            columns = np.column_stack([of])
        else:
            columns = np.column_stack([*kept, np.ones(of.size)])
        columns = columns / np.max(np.abs(columns), axis=0)
        scale = 1.0 / float(np.max(np.abs(of)))
        whole = float(np.linalg.lstsq(columns, self.e[k], rcond=None)[0][0])
        left_out = []
        for part in _parts(of.size):
            use = np.ones(of.size, bool)
            use[part] = False
            left_out.append(float(np.linalg.lstsq(columns[use], self.e[k][use], rcond=None)[0][0]))
        n = len(left_out)
        u = math.sqrt((n - 1) / n * float(np.sum((np.array(left_out) - np.mean(left_out)) ** 2)))
        return UncertainValue(whole * scale, u * scale, n - 1)


def _parts(n: int) -> list[slice]:
    edges = np.linspace(0, n, STRETCHES + 1).astype(int)
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def _scatter(y: Array) -> tuple[float, float]:
    """Return the standard uncertainty of the mean of a series, and its degrees of freedom."""
    means = np.array([y[p].mean() for p in _parts(y.size)])
    return float(np.std(means, ddof=1)) / math.sqrt(means.size), means.size - 1
