"""A sampled controller before any linear plant: exact discretization, margins, poles, responses.  [SAMPLED-PLANT]

    loop = DigitalLoop(AnalogPlant.of_polynomials([1.0], [2.56, 0.4, 0.0], delay=2e-3), [g, -a], [1.0, -b], T=5e-3)
    loop.poles(), loop.margins()
    DigitalLoop(MeasuredPlant(frequency, response), ...)             # a table that was measured

The plant hangs behind a zero-order hold of period T.  One given by polynomials or matrices, with a delay, is exact:

    x+ = e^(A T) x + G_1 u(k-d-1) + G_0 u(k-d),   delay = d T + m,   0 <= m < T
    G_0 = int_0^(T-m) e^(A s) ds B,   G_1 = e^(A (T-m)) int_0^m e^(A s) ds B

One given by its response P(j w) has that of its samples by the sum over the aliases,

    W(e^(j w T)) = sum_k P(j w_k) (1 - e^(-j w T)) / (j w_k T),   w_k = w + 2 pi k / T

P between the points by log modulus and phase over log w, beyond the last one by the slope and phase of the end.

Not modelled: counts (they are in the co-simulation), several inputs, jitter of the sampling.
Source: Hu 1981, eq. 6-1..6-18 with ET22; Astrom 1997, sections 2.3 and 3.2 (sampling of a delay, aliases).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gyrobench.arrays import Array
from gyrobench.errors import GyrobenchError
from gyrobench.linear.held_input import held

Complex = NDArray[np.complex128]
GRID = 2000  # frequencies of a curve
ALIASES = 400  # to either side


class SampledLoopError(GyrobenchError):
    """A plant that cannot be sampled, a loop that cannot be closed."""


@dataclass(frozen=True)
class AnalogPlant:
    """x' = A x + B u(t - delay), y = C x; one input, one output, strictly proper."""

    A: Array
    B: Array
    C: Array
    delay: float = 0.0

    @classmethod
    def of_polynomials(cls, num: ArrayLike, den: ArrayLike, delay: float = 0.0) -> AnalogPlant:
        """Return num(s)/den(s) e^(-s delay), coefficients from the highest power of s on.  Raises SampledLoopError."""
        n, d = np.trim_zeros(np.atleast_1d(num), "f"), np.trim_zeros(np.atleast_1d(den), "f")
        if not (np.isfinite(n).all() and np.isfinite(d).all() and math.isfinite(delay) and delay >= 0.0):
            raise SampledLoopError("plant: coefficients must be finite and the delay must be 0 s or more")
        if n.size == 0 or n.size >= d.size:
            raise SampledLoopError(
                f"plant: numerator of degree {n.size - 1} over denominator of degree {d.size - 1}; the "
                "denominator must be of higher degree, as the angle of a table does not jump"
            )
        order = d.size - 1
        A = np.zeros((order, order))
        A[:-1, 1:] = np.eye(order - 1)
        A[-1] = -d[:0:-1] / d[0]
        B, C = np.zeros(order), np.zeros(order)
        B[-1] = 1.0
        C[: n.size] = n[::-1] / d[0]
        return cls(A, B, C, float(delay))

    def response(self, w: ArrayLike) -> Complex:
        """Return P(j w), w in rad/s."""
        s = 1j * np.atleast_1d(np.asarray(w, dtype=float))
        eye = np.eye(self.A.shape[0])
        values = [self.C @ np.linalg.solve(x * eye - self.A, self.B) * np.exp(-x * self.delay) for x in s]
        return np.array(values, dtype=complex)

    def step(self, T: float) -> tuple[Array, Array, Array]:
        """Return (F, G, C) of x+ = F x + G u, y = C x at the period T, s; past inputs are states of it."""
        n, d = self.A.shape[0], math.floor(self.delay / T * (1.0 + 1e-12))
        m = max(self.delay - d * T, 0.0)
        forward, early = held(self.A, self.B, T - m)
        late = forward @ held(self.A, self.B, m)[1]
        past = d + 1 if m > 1e-12 * T else d
        F, G = np.zeros((n + past, n + past)), np.zeros(n + past)
        F[:n, :n] = held(self.A, self.B, T)[0]
        for k, column in ((d, early), (d + 1, late)):  # u(k) back: the newest past input is the last state
            if k == 0:
                G[:n] = column
            elif k <= past:
                F[:n, n + past - k] = column
        for k in range(past - 1):
            F[n + k, n + k + 1] = 1.0
        if past:
            G[-1] = 1.0
        return F, G, np.concatenate([self.C, np.zeros(past)])

    def sampled(self, w: ArrayLike, T: float) -> Complex:
        """Return W(e^(j w T))."""
        F, G, C = self.step(T)
        z, eye = np.exp(1j * np.atleast_1d(np.asarray(w, dtype=float)) * T), np.eye(F.shape[0])
        return np.array([C @ np.linalg.solve(x * eye - F, G) for x in z], dtype=complex)


@dataclass(frozen=True)
class MeasuredPlant:
    """A plant by its response: frequencies, rad/s, rising, and complex values (rad per N.m)."""

    w: Array
    values: Complex

    def __post_init__(self) -> None:
        w, values = np.asarray(self.w, dtype=float), np.asarray(self.values, dtype=complex)
        if w.size < 4 or w.shape != values.shape or not (np.isfinite(w).all() and np.isfinite(values).all()):
            raise SampledLoopError("measured plant: at least 4 finite frequencies with a response each are needed")
        if w[0] <= 0.0 or (np.diff(w) <= 0.0).any() or (np.abs(values) == 0.0).any():
            raise SampledLoopError("measured plant: frequencies must rise from above 0, responses must not be 0")

    def response(self, w: ArrayLike) -> Complex:
        """Return P(j w) between the points and beyond; w of either sign, not 0."""
        w = np.atleast_1d(np.asarray(w, dtype=float))
        x, at = np.log(np.asarray(self.w, dtype=float)), np.log(np.abs(w))
        values = np.asarray(self.values, dtype=complex)
        size, phase = np.log(np.abs(values)), np.unwrap(np.angle(values))
        inside = np.interp(at, x, size)
        for end, near, where in ((0, 1, at < x[0]), (-1, -2, at > x[-1])):
            slope = (size[end] - size[near]) / (x[end] - x[near])
            inside = np.where(where, size[end] + slope * (at - x[end]), inside)
        found = np.exp(inside + 1j * np.interp(at, x, phase))
        return np.asarray(np.where(w < 0.0, np.conj(found), found))

    def sampled(self, w: ArrayLike, T: float) -> Complex:
        """Return W(e^(j w T)); needs points to beyond half the sampling frequency.  Raises SampledLoopError."""
        if float(self.w[-1]) < math.pi / T:
            raise SampledLoopError(
                f"measured plant: the last frequency, {self.w[-1] / (2.0 * math.pi):.4g} Hz, is below half the "
                f"sampling frequency, {0.5 / T:.4g} Hz; measure further or sample more slowly"
            )
        w = np.atleast_1d(np.asarray(w, dtype=float))
        k = np.arange(-ALIASES, ALIASES + 1)
        at = w[:, None] + 2.0 * np.pi * k[None, :] / T
        hold = (1.0 - np.exp(-1j * w * T))[:, None] / (1j * at * T)
        return np.asarray(np.sum(self.response(at.ravel()).reshape(at.shape) * hold, axis=1))


@dataclass(frozen=True)
class DigitalMargins:
    """Smallest margins of a loop: gain (above 1), phase (rad) with its crossover (rad/s), distance to -1; inf: none.

    A delay between the samples changes W in size too: :meth:`DigitalLoop.delay_margin`, not phase over crossover.
    """

    gain: float
    phase: float
    modulus: float
    crossover: float


@dataclass(frozen=True)
class DigitalLoop:
    """Feedback -1 around D(z) W(z); D = num(z)/den(z), coefficients from the highest power of z on."""

    plant: AnalogPlant | MeasuredPlant
    num: Sequence[float]
    den: Sequence[float]
    T: float

    def __post_init__(self) -> None:
        if not self.T > 0.0 or not len(self.num) <= len(self.den) or not self.den or self.den[0] == 0.0:
            raise SampledLoopError("sampled loop: T must be above 0 s and D(z) must not be ahead of its input")

    def open_loop(self, w: ArrayLike) -> Complex:
        """Return D(z) W(z) at z = e^(j w T)."""
        z = np.exp(1j * np.atleast_1d(np.asarray(w, dtype=float)) * self.T)
        controller = np.polyval(self.num, z) / np.polyval(self.den, z)
        return np.asarray(controller * self.plant.sampled(w, self.T))

    def closed(self) -> tuple[Array, Array, Array]:
        """Return (F, G, C) of the closed loop from the reference to the output.  Of a AnalogPlant alone."""
        if not isinstance(self.plant, AnalogPlant):
            raise SampledLoopError("measured plant: it has margins, and no poles or responses over time")
        F, G, C = self.plant.step(self.T)
        den = np.asarray(self.den, dtype=float) / self.den[0]
        num = np.concatenate([np.zeros(den.size - len(self.num)), np.asarray(self.num, dtype=float)]) / self.den[0]
        order = den.size - 1
        A, B = np.zeros((order, order)), np.zeros(order)
        if order:
            A[:-1, 1:], A[-1], B[-1] = np.eye(order - 1), -den[:0:-1], 1.0
        row = num[:0:-1] - num[0] * den[:0:-1]  # u = row c + num[0] e
        whole = np.block([[F - num[0] * np.outer(G, C), np.outer(G, row)], [-np.outer(B, C), A]])
        return whole, np.concatenate([num[0] * G, B]), np.concatenate([C, np.zeros(order)])

    def poles(self) -> Complex:
        """Return the poles of the closed loop, in z."""
        return np.asarray(np.linalg.eigvals(self.closed()[0]), dtype=complex)

    def follow(self, reference: ArrayLike) -> Array:
        """Return the output at the samples, from rest."""
        F, G, C = self.closed()
        x, out = np.zeros(F.shape[0]), []
        for r in np.asarray(reference, dtype=float):
            out.append(float(C @ x))
            x = F @ x + G * r
        return np.array(out)

    def delay_margin(self) -> float:
        """Return the delay in addition, s, from which on the loop is unstable, by its poles; inf: none up to 4 T."""
        plant = self.plant
        if not isinstance(plant, AnalogPlant):
            raise SampledLoopError("measured plant: it has margins, and no poles or responses over time")

        def stable(late: float) -> bool:
            return bool(np.abs(replace(self, plant=replace(plant, delay=plant.delay + late)).poles()).max() < 1.0)

        grid = np.linspace(0.0, 4.0 * self.T, 81)
        first = next((k for k, late in enumerate(grid) if not stable(late)), None)
        if not first:
            return math.inf if first is None else 0.0
        low, high = grid[first - 1], grid[first]
        for _ in range(30):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if stable(middle) else (low, middle)
        return float(low)

    def margins(self) -> DigitalMargins:
        """Return the smallest margins up to half the sampling frequency."""
        import control

        most = math.pi / self.T
        w = np.geomspace(1e-4 * most, most * (1.0 - 1e-6), GRID)
        found: Any = control.stability_margins(control.FRD(self.open_loop(w), w), returnall=True)
        gains, phases, moduli, _, crossings, _ = (np.atleast_1d(x) for x in found)
        up = gains[gains > 1.0]
        turn = np.radians(phases)
        best = int(np.argmin(np.abs(turn))) if turn.size else -1
        return DigitalMargins(
            float(up.min(initial=math.inf)),
            float(turn[best]) if best >= 0 else math.inf,
            float(moduli.min(initial=math.inf)),
            float(crossings[best]) if best >= 0 else math.inf,
        )
