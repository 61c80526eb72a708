"""Controllers that are computed from the plant: LQG with an integral, H-infinity by mixed sensitivity.

    lqg     P (s + w_i)/s:  u = -F x',  F of  min E int y2 + rho u2,  x' by the Kalman filter for noise at the input
            rho = |P|2 at the crossover that is asked for, filter as fast as `recovery` times that (LTR: the more, the
            more L is that of the regulator alone)
    hinf    min || (W1 S, W2 K S, W3 T) ||:  W1 = (s/M + w)/(s + floor w),  W2 = effort / |P(jw)|,
            W3 = x/(1 + x/100), x = s/(rolloff w)

A search chooses the few numbers of these weights.  The plant is the nominal one of the communication step, in the
w-plane s = (2/h)(z - 1)/(z + 1), where its step and delays are rational; plant and controller are reduced by balanced
truncation of (A - e I), which leaves integrators and what is slower than e alone.

Not modelled: the spread of the parts in the synthesis itself (the search over it judges each controller).
Source: Doyle 1979 (recovery), SLICOT 2020 (examples), Skogestad 2005, sections 2.7.2, 9.2.2 and 11.3.
H-infinity takes slycot (SB10AD).
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from scipy import linalg

from gyrobench.arrays import Array
from gyrobench.bench import UsageError
from gyrobench.errors import GyrobenchError
from gyrobench.tuning.plant import Plant
from gyrobench.tuning.structures import Controller, ControllerStructure, rounded

HIGHEST = 8  # order of a controller
PLANT = 6  # states of the plant that is designed for
SLOW = 1e-2  # of the crossover: e of the reduction
SMALL = 1e-7  # of the largest Hankel singular value: states below it are left out
SHIFT = 1e-3  # of the crossover: poles of the plant on the imaginary axis are moved into the left half plane
FASTEST = 1e8  # rad/s: zeros beyond are at infinity
LARGEST = 1e4  # norm from which the search for the least one begins
ACCURACY = 1e-3  # of it
RANGES = {
    "lqg": ((-1.5, -0.2), (0.0, 2.0)),  # w_i, recovery
    "hinf": ((0.08, 0.8), (-4.0, -1.0), (-5.0, 0.0), (0.0, 2.0)),  # M, floor, effort, rolloff
}
ALIASES = {"mixsyn": "hinf"}


class SynthesisError(GyrobenchError, ArithmeticError):
    """No controller exists for these weights, or none that numbers can hold."""


@dataclass(frozen=True)
class StateSpace:
    """x' = a x + b u, y = c x + d u: one input, one output."""

    a: Array
    b: Array
    c: Array
    d: float

    def response(self, s: complex) -> complex:
        return complex((self.c @ np.linalg.solve(s * np.eye(len(self.a)) - self.a, self.b))[0, 0]) + self.d


def w_plane(plant: Plant) -> StateSpace:
    """Return a plant of steps h in s = (2/h)(z - 1)/(z + 1), exactly."""
    h, n = plant.step, len(plant.a)
    back = np.linalg.inv(plant.a + np.eye(n))
    root = 2.0 / np.sqrt(h)
    direct = -(plant.c @ back @ plant.b)[0, 0]
    return StateSpace(2.0 / h * (plant.a - np.eye(n)) @ back, root * back @ plant.b, root * plant.c @ back, direct)


def reduced(system: StateSpace, order: int, e: float) -> StateSpace:
    """Return the balanced truncation of (a - e I, b, c) with e added again: states slower than e all count alike.

    e: rad/s; more where a pole is farther right.  Raises SynthesisError.
    """
    n = len(system.a)
    if n == 0:
        return system
    e = max(e, 1.5 * float(np.linalg.eigvals(system.a).real.max()))
    a = system.a - e * np.eye(n)
    reach = linalg.solve_continuous_lyapunov(a, -system.b @ system.b.T)
    seen = linalg.solve_continuous_lyapunov(a.T, -system.c.T @ system.c)
    roots = []
    for gramian in (reach, seen):
        size, axes = np.linalg.eigh(0.5 * (gramian + gramian.T))
        roots.append(axes * np.sqrt(np.maximum(size, 0.0)))
    left, hankel, right = np.linalg.svd(roots[1].T @ roots[0])
    if not np.all(np.isfinite(hankel)) or not hankel[0] > 0.0:
        raise SynthesisError("the gramians are not finite")
    k = min(order, int(np.sum(hankel > SMALL * hankel[0])))
    scale = 1.0 / np.sqrt(hankel[:k])
    into, out = roots[0] @ right[:k].T * scale, (roots[1] @ left[:, :k] * scale).T
    return StateSpace(out @ a @ into + e * np.eye(k), out @ system.b, system.c @ into, system.d)


def regulator_gain(a: Array, b: Array, q: Array, r: float) -> Array:
    """Return F of u = -F x that minimizes int x'q x + r u'u, (inputs, n).  Raises SynthesisError."""
    try:
        return np.asarray(b.T @ linalg.solve_continuous_are(a, b, q, r * np.eye(b.shape[1])) / r)
    except (ValueError, linalg.LinAlgError) as error:
        raise SynthesisError(str(error)) from None


def filter_gain(a: Array, c: Array, w: Array, v: float) -> Array:
    """Return the gain of the Kalman filter for intensities w of the states and v of each reading, (n, readings)."""
    return regulator_gain(a.T, c.T, w, v).T


def lqg(plant: StateSpace, w: float, integral: float, recovery: float) -> StateSpace:
    """Return the controller of the plant, without the integral: regulator and filter for P (s + integral)/s.

    w: rad/s, where |P| without control cost would cross; recovery: crossover of the filter over w.
    """
    n = len(plant.a)
    a = np.zeros((n + 1, n + 1))
    a[:n, :n], a[:n, n:] = plant.a, plant.b * integral
    b = np.vstack([plant.b, [[1.0]]])
    c = np.hstack([plant.c, [[plant.d * integral]]])
    size = [abs(plant.response(1j * x) * (1.0 + integral / (1j * x))) for x in (w, w * recovery)]
    if not min(size) > 0.0:
        raise SynthesisError("the plant has no gain at the crossover")
    F = regulator_gain(a, b, c.T @ c, size[0] ** 2)
    H = filter_gain(a, c, b @ b.T, size[1] ** 2)
    return StateSpace(a - b @ F - H @ c + H @ F * plant.d, H, F, 0.0)


def mixed_sensitivity(
    plant: StateSpace, weights: Sequence[tuple[Array, Array] | None], accuracy: float = ACCURACY
) -> tuple[StateSpace, float]:  # fmt: skip
    """Return the controller that makes || (W1 S, W2 K S, W3 T) || least, and this norm.

    weights: numerator and denominator by falling powers of s; None: none.  accuracy: of the norm, absolute.  Raises
    SynthesisError.
    """
    import control
    from slycot import sb10ad

    g = control.ss(plant.a, plant.b, plant.c, [[plant.d]])
    of_s = [None if x is None else control.tf2ss(control.tf(*x)) for x in weights]
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            p = control.augw(g, *of_s)
            gamma, a, b, c, d, *_ = sb10ad(
                len(p.A), p.B.shape[1], p.C.shape[0], 1, 1, LARGEST, p.A, p.B, p.C, p.D, job=1, gtol=accuracy
            )
    except Exception as error:  # slycot has its own errors and warnings, one for each thing that can go wrong
        raise SynthesisError(str(error)) from None
    return StateSpace(np.asarray(a), np.asarray(b), np.asarray(c), float(d[0, 0])), float(gamma)


def h_infinity(
    plant: StateSpace, w: float, M: float, floor: float, effort: float, rolloff: float
) -> tuple[StateSpace, float]:  # fmt: skip
    """Return the controller for the weights of the module, and gamma."""
    moved = StateSpace(plant.a - SHIFT * w * np.eye(len(plant.a)), plant.b, plant.c, plant.d)
    size = abs(plant.response(1j * w))
    if not size > 0.0:
        raise SynthesisError("the plant has no gain at the crossover")
    corner = rolloff * w
    weights = [
        (np.array([1.0 / M, w]), np.array([1.0, floor * w])),
        (np.array([effort / size]), np.array([1.0])),
        (np.array([1.0 / corner, 0.0]), np.array([0.01 / corner, 1.0])),
    ]
    return mixed_sensitivity(moved, weights)


class SynthesizedStructure(ControllerStructure):
    """Structure whose controller is computed from the nominal plant and a few numbers."""

    computed = True

    def __init__(self, name: str, plant: Plant | None = None) -> None:
        self.name = ALIASES.get(name, name)
        if self.name == "hinf" and find_spec("slycot") is None:
            raise UsageError(f"--structure {name}: takes slycot, which is not installed: pip install 'gyrobench[tune]'")
        self.blocks, self.ranges, self.plant = [], list(RANGES[self.name]), plant

    @property
    def is_lead_lag(self) -> bool:
        return False

    def of(self, plant: Plant) -> SynthesizedStructure:
        return SynthesizedStructure(self.name, plant)

    def controller(self, w: float, numbers: Sequence[float], plant_at: Callable[[float], complex]) -> Controller:
        """Return the controller for a crossover near w, rad/s.  Raises SynthesisError."""
        assert self.plant is not None
        plant = reduced(w_plane(self.plant), PLANT, SLOW * w)
        size = abs(plant.response(1j * w))
        if not size > 0.0:
            raise SynthesisError("the plant has no gain at the crossover")
        # with the crossover at 1 rad/s and a gain of 1 there: Riccati equations want numbers of one size
        unit = reduced(StateSpace(plant.a / w, plant.b / w, plant.c / size, plant.d / size), PLANT, SLOW)
        if self.name == "lqg":
            integral, recovery = numbers
            found = reduced(lqg(unit, 1.0, integral, recovery), HIGHEST - 1, SLOW)
            values = {"w": w, "integral": w * integral, "recovery": recovery}
        else:
            found, gamma = h_infinity(unit, 1.0, *numbers)
            found = reduced(found, HIGHEST, SLOW)
            values = dict(zip(("w", "M", "floor", "effort", "rolloff", "gamma"), (w, *numbers, gamma), strict=True))
        num, den = transfer_function(StateSpace(w * found.a, w * found.b, found.c / size, found.d / size))
        if self.name == "lqg":
            corner: Array = np.array([1.0, w * integral])
            num, den = np.asarray(np.polymul(num, corner), float), np.append(den, 0.0)
        return rounded(num[::-1], den[::-1], {**values, "order": float(len(den) - 1)})


def transfer_function(system: StateSpace) -> tuple[Array, Array]:
    """Return num and den by falling powers of s, from zeros and poles: their coefficients are far apart in size."""
    n = len(system.a)
    poles = np.linalg.eigvals(system.a)
    pencil = np.block([[system.a, system.b], [system.c, np.array([[system.d]])]])
    ones = np.diag([1.0] * n + [0.0])
    alpha, beta = linalg.eig(pencil, ones, right=False, homogeneous_eigvals=True)
    finite = np.abs(beta) * FASTEST > np.abs(alpha)
    zeros = alpha[finite] / beta[finite]
    zeros = zeros[np.argsort(np.abs(zeros))][: n if system.d else n - 1]
    s = 1j * float(np.median(np.abs(poles)) or 1.0)
    gain = system.response(s) * np.prod(s - poles) / np.prod(s - zeros)
    num, den = float(gain.real) * np.real(np.poly(zeros)), np.real(np.poly(poles))
    if not (np.all(np.isfinite(num)) and np.all(np.isfinite(den))):
        raise SynthesisError("the coefficients are not finite")
    return np.atleast_1d(num), np.atleast_1d(den)


def structure_of(name: str) -> ControllerStructure:
    """Return a structure by its name.  Raises UsageError."""
    return SynthesizedStructure(name) if ALIASES.get(name, name) in RANGES else ControllerStructure(name)
