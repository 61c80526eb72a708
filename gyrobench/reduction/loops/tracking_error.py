"""Tracking error of a ride: mean, rms, share inside an accuracy, lag by the linear model, each with its uncertainty.

The lag is what the linear model makes of the target's true rate, E = W S/s with S = 1/(1 + L); of slow motion
e = c1 w + c2 w' + ..., S = c1 s + c2 s2 + ...: for type 1 K_v = 1/c1, for type 2 c1 = 0 and K_a = 1/c2.  Uncertainties
come from the scatter of stretches of the ride, from which the lag has been taken away; they hold noise that is faster
than a stretch.  [TRACK-LOOP; Franklin 2010, section 4.2]
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
SLIGHT = 0.02  # of the largest lag and of the scatter of the error: a lag that scatters by less is constant
FINE = 100.0  # samples in a period of the crossover, for the lag
SETTLED = 8.0  # periods of it, in which the loop settles
DRAWN = 200  # readings of the noise, for a probability
POINTS = 600  # of the response


def error_coefficients(loop: LinearModel, crossover: float) -> tuple[float, float]:
    """Return c1 (s) and c2 (s2) of an open loop that crosses at ``crossover``, Hz, from its response far below."""
    f = crossover / SLOW * np.array([1.0, 2.0])
    w = 2.0 * np.pi * f
    S = 1.0 / (1.0 + model_response(loop, f)[:, 0, 0])
    odd, even = S.imag / w, -S.real / w**2
    return float((4.0 * odd[0] - odd[1]) / 3.0), float((4.0 * even[0] - even[1]) / 3.0)


def lag(loop: LinearModel, crossover: float, t: Array, rate: Array) -> Array:
    """Return the error that a rate of the target makes in the linear model, rad, from rest.

    t: s, from the start of the motion.  Behind its end the rate is faded out and is 0 for as long as the loop settles.
    """
    every = max(1, int(1.0 / (FINE * crossover * (t[1] - t[0]))))
    dt = float(t[1] - t[0]) * every
    few = rate[::every]
    fade = int(SETTLED / (crossover * dt)) + 1
    n = 2 ** math.ceil(math.log2(few.size + 2 * fade))
    padded = np.concatenate([few, few[-1] * 0.5 * (1.0 + np.cos(np.pi * np.arange(fade) / fade))])
    f = np.fft.rfftfreq(n, dt)
    known = np.geomspace(f[1] / 4.0, f[-1], POINTS)
    way = 1.0 / (1.0 + model_response(loop, known)[:, 0, 0]) / (2j * np.pi * known)
    from scipy.interpolate import CubicSpline

    at = np.concatenate([[0.0], CubicSpline(np.log(known), way)(np.log(f[1:]))])
    at[0] = error_coefficients(loop, crossover)[0]
    made = np.fft.irfft(np.fft.rfft(padded, n) * at, n)[: few.size]
    return np.asarray(CubicSpline(t[::every], made)(t))


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
        return float(np.max(self.size))

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
        u, dof = _scatter(inside - self._expected(wanted))
        half = float(special.stdtrit(dof, 0.975)) * u
        return 100.0 * share, 100.0 * u, (100.0 * max(0.0, share - half), 100.0 * min(1.0, share + half))

    def _expected(self, wanted: float) -> Array:
        """Return the probability at each time to be inside, where the rest of the ride's noise is about the lag."""
        noise = self.e - self.lag
        drawn = noise[:, :: max(1, noise.shape[1] // DRAWN)]
        found = np.zeros(noise.shape[1])
        for x, y in drawn.T:
            found += np.hypot(self.lag[0] + x, self.lag[1] + y) < wanted
        return np.asarray(found / drawn.shape[1])

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
        return max(1.0, float(n / (1.0 + 2.0 * np.sum(rho[1:end]))))

    def share(self, k: int) -> UncertainValue | None:
        """Return the error over the lag, beside a constant; None for a lag that does not change."""
        of = self.lag[k]
        if not np.std(of) > SLIGHT * max(float(np.max(np.abs(of))), float(np.std(self.e[k]))):
            return None

        def slope(use: Array) -> float:
            x = of[use] - of[use].mean()
            return float(x @ self.e[k][use] / (x @ x))

        every = np.ones(of.size, bool)
        left_out = []
        for part in _parts(of.size):
            use = every.copy()
            use[part] = False
            left_out.append(slope(use))
        n = len(left_out)
        u = math.sqrt((n - 1) / n * float(np.sum((np.array(left_out) - np.mean(left_out)) ** 2)))
        return UncertainValue(slope(every), u, n - 1)


def _parts(n: int) -> list[slice]:
    edges = np.linspace(0, n, STRETCHES + 1).astype(int)
    return [slice(int(a), int(b)) for a, b in pairwise(edges)]


def _scatter(y: Array) -> tuple[float, float]:
    """Return the standard uncertainty of the mean of a series, and its degrees of freedom."""
    means = np.array([y[p].mean() for p in _parts(y.size)])
    return float(np.std(means, ddof=1)) / math.sqrt(means.size), means.size - 1
