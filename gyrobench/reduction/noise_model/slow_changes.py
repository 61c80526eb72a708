"""Slow changes of the level of a stretch that are no noise: a drift that settles (a warm-up), and a swing of few cycles
(the temperature of a day), beside noise of known spectrum.

Both are generalized least squares beside level and ramp: A exp(-t/tau) from the beginning on, and a cosine and a sine
of one frequency, with tau and the frequency of the greatest likelihood ratio.  Of a geometric series a^t, t < n, the
ordinate k of the cosine transform is sqrt(1/(2 n)) (g(theta) + g(-theta)), theta = pi k/n,
g = e^(i theta/2) (1 - (-1)^k a^n)/(1 - a e^(i theta)).  Left in, a random walk is stated that another record does not
have.  [DRIFT-NOISE-MODEL; own derivation]
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import fft, optimize

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.rate_pulses import Pulse
from gyrobench.reduction.noise_model.steps import LevelStep, precision

MOST = 8192  # ordinates: the others have nothing of a change that takes a thousandth of the stretch or more
SETTLED, SHORTEST_TAU = 4.0, 32.0  # tau to the end of the stretch, and samples, at least
FEWEST, CYCLES = 0.75, 7.0  # of a swing: fewer are a ramp with a walk, more are a line
SMALL = 1e-4  # step of a derivative


@dataclass(frozen=True)
class Settling:
    """A drift that settles from the first sample of a stretch on: size exp(-t/tau), tau in samples."""

    tau: float
    u_tau: float
    size: float
    u: float

    def curve(self, n: int) -> Array:
        """Return what it adds to a stretch (n,)."""
        return np.asarray(self.size * np.exp(-np.arange(n) / self.tau))


@dataclass(frozen=True)
class Swing:
    """A swing of few cycles: size cos(2 pi t/period - phase), period in samples, t from the first sample on."""

    period: float
    u_period: float
    size: float
    u: float
    phase: float

    def curve(self, n: int) -> Array:
        """Return what it adds to a stretch (n,)."""
        return np.asarray(self.size * np.cos(2.0 * math.pi * np.arange(n) / self.period - self.phase))


LevelChange = LevelStep | Pulse | Settling | Swing


def settling(x: Array, S: Array, q2: float = 0.0) -> tuple[Settling, float]:
    """Return the drift that settles of the largest likelihood ratio in a stretch x (n,), and that ratio.

    S (n,): spectrum at omega = pi k/n, S[0] is not used; q2: variance of the error of an angle.
    """
    n = x.size
    shortest, longest = max(SHORTEST_TAU, n / 1000.0), n / SETTLED
    if longest < 2.0 * shortest:
        return Settling(longest, math.inf, 0.0, math.inf), 0.0

    def curve(log_tau: float) -> Array:
        return np.real(_geometric(math.exp(-math.exp(-log_tau)), n))[None]

    v, u, sizes, covariance, ratio = _fitted(x, S, q2, curve, np.linspace(math.log(shortest), math.log(longest), 24))
    tau = math.exp(v)
    return Settling(tau, u * tau, float(sizes[0]), math.sqrt(covariance[0, 0])), ratio


def swing(x: Array, S: Array, q2: float = 0.0) -> tuple[Swing, float]:
    """Return the swing of FEWEST to CYCLES cycles of the largest likelihood ratio, and that ratio; as above."""
    n = x.size

    def curve(cycles: float) -> Array:
        both = _geometric(np.exp(2j * math.pi * cycles / n), n)
        return np.array([both.real, both.imag])

    v, u, sizes, covariance, ratio = _fitted(x, S, q2, curve, np.arange(FEWEST, CYCLES, 0.25))
    size, turn = math.hypot(*sizes), sizes / max(math.hypot(*sizes), 1e-300)
    u_size = math.sqrt(float(turn @ covariance @ turn))
    return Swing(n / v, u * n / v**2, size, u_size, math.atan2(sizes[1], sizes[0])), ratio


def without(x: Array, changes: Sequence[LevelChange]) -> Array:
    """Return a stretch (n,) without changes of its level; its mean stays."""
    for change in changes:
        curve = change.curve(x.size)
        x = x - (curve - curve.mean())
    return x


def _geometric(a: complex, n: int) -> NDArray[np.complex128]:
    """Return the first ordinates of a^t, t < n."""
    k = np.arange(min(n, MOST))
    turn = np.exp(1j * math.pi * k / n)
    top = 1.0 - np.where(k % 2, -1.0, 1.0) * a**n

    def half(turn: NDArray[np.complex128]) -> NDArray[np.complex128]:
        below = 1.0 - a * turn
        at = np.abs(below) < 1e-12  # its own frequency: n equal terms
        return np.asarray(np.sqrt(turn) * np.where(at, n, top / np.where(at, 1.0, below)))

    return np.asarray(math.sqrt(0.5 / n) * (half(turn) + half(np.conj(turn))))


def _fitted(
    x: Array, S: Array, q2: float, curve: Callable[[float], Array], starts: Array
) -> tuple[float, float, Array, Array, float]:
    """Return the parameter of curves (m, k), given by their ordinates, of the largest likelihood ratio, its u, the
    sizes (m,) of the curves, their covariance beside the parameter, and the ratio; starts: even, from low to high.
    """
    n = x.size
    c, ramp = (fft.dct(y, norm="ortho")[:MOST] for y in (x, np.arange(n) / n))
    weigh = precision(S[:MOST], q2, n)[0]
    of_ramp = weigh(ramp)

    def beside_ramp(ordinates: Array) -> tuple[Array, Array]:
        """Return what no ramp has of ordinates (m, k), and the product of the precision with each."""
        e = ordinates - np.outer(ordinates @ of_ramp / float(ramp @ of_ramp), ramp)
        return e, np.array([weigh(row) for row in e])

    def sizes(v: float) -> tuple[Array, float]:
        e, weighed = beside_ramp(curve(v))
        b = weighed @ c
        beta = np.linalg.solve(weighed @ e.T, b)
        return beta, float(b @ beta)

    at = int(np.argmax([sizes(v)[1] for v in starts.tolist()]))
    near = (float(starts[max(at - 1, 0)]), float(starts[min(at + 1, starts.size - 1)]))
    v = float(optimize.minimize_scalar(lambda v: -sizes(v)[1], bounds=near, method="bounded").x)
    beta, ratio = sizes(v)
    slope = beta @ (curve(v + SMALL) - curve(v - SMALL)) / (2.0 * SMALL)
    e, weighed = beside_ramp(np.vstack([curve(v), slope]))
    covariance: Array = np.linalg.inv(np.asarray(weighed @ e.T, dtype=float))
    return v, math.sqrt(covariance[-1, -1]), beta, covariance[:-1, :-1], ratio
