"""Figures of a frequency response from its points: gain at low frequency, -3 dB, 90 degrees, delay, equivalent order.

    H(s) = K exp(-s T) / [(1 + s/a) ... (1 + 2 z s/b + (s/b)2) ...]                      0 to 5 poles

by weighted least squares of ln H; the number of poles by the least Bayesian information criterion, and so whether a
resonance of a suspension stands in the band, a pair of poles with a pair of zeros near it, x = s/b:

    [1 + (2 z + c) x + (1 - a) x2] / [1 + 2 z x + x2]

Of a gyro that holds a sample for the time P the curve is times sinc(f P) exp(-s P/2), which is known and no pole's.
The figures are those of this curve: the first frequencies with |H| = K/sqrt(2) and with arg H = -90 degrees, the delay
-d arg H / d w at frequency zero, the order -2 d ln |H| / d ln f at -3 dB, n of a Butterworth low-pass of order n.

The uncertainty is that of the points, widened by sqrt(chi2 / degrees of freedom) where the curve does not fit them, and
what one pole more changes beyond what noise explains.  [TEST-BANDWIDTH; Schwarz 1978; MacKinnon 1985]
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from gyrobench.arrays import Array

Complex = NDArray[np.complexfloating[Any, Any]]
POLES = 5
ROOT = math.sqrt(0.5)
DENSE = 2000  # frequencies at which crossings are looked for
LIMIT = 60.0  # of the logarithm of a corner, rad/s
GOOD = 2.0  # chi2 over degrees of freedom below which no other start is tried
SEEN = 3.0  # u: what a resonance makes at a frequency that shows it
DAMPING = (0.003, 0.01, 0.03, 0.1, 0.3)  # of a resonance that is looked for
LEVERAGE = 0.02  # least share of a point's noise that its residual holds
WIDE = 1e3  # of the highest frequency: slower and faster poles than this are none


@dataclass(frozen=True)
class GyroResponse:
    """Frequencies f (Hz, rising), natural logarithm of the gain, unwrapped phase (rad), u of both (n,); time for which
    the gyro holds a sample (s).
    """

    f: Array
    gain: Array
    phase: Array
    u: Array
    held: float = 0.0
    known: bool = True  # u; else only how the points compare

    @classmethod
    def of(cls, f: Array, value: Complex, u: Array, held: float = 0.0, known: bool = True) -> GyroResponse:
        """Return the response of complex points, of samples at their own times where they are held; the phase is
        continuous (_continuous), that of the lowest within half a turn.
        """
        order = np.argsort(f)
        f, value, u = f[order], value[order], u[order]
        angle = np.asarray(np.angle(value), dtype=float)
        gain, phase = np.vstack([np.log(np.abs(value)), _continuous(f, angle)]) + hold(f, held)
        return cls(f, gain, phase, u, held, known)

    def moved(self, change: Complex) -> GyroResponse:
        """Return the response times exp(change), change complex (n,)."""
        return replace(self, gain=self.gain + change.real, phase=self.phase + change.imag)

    @property
    def value(self) -> Complex:
        out: Complex = np.exp(self.gain + 1j * self.phase)
        return out

    def at(self, factor: float) -> GyroResponse:
        """Return the response with all frequencies times a factor."""
        return replace(self, f=self.f * factor, held=self.held / factor)


def _continuous(f: Array, phase: Array) -> Array:
    """Return the phase with the turns that wrapping took off: each as near as it comes to the one before times the
    ratio of the frequencies, which a delay makes of it, however many turns there are from point to point.

    Counted from the phase at frequency zero, a multiple of 90 degrees: of a rate, of another sense, of an angle.
    """
    near = np.unwrap(phase[:3])
    out = phase.copy()
    zero = 0.5 * math.pi * round(float(np.polyval(np.polyfit(f[:3], near, 1), 0.0)) / (0.5 * math.pi))
    for k in range(1, f.size):
        expected = zero + (out[k - 1] - zero) * f[k] / f[k - 1]
        out[k] += 2.0 * math.pi * round((expected - out[k]) / (2.0 * math.pi))
    return out


def hold(f: Array, time: float) -> Array:
    """Return ln |H| and arg H, rows (2, n), of a signal that is held for a time, s, from sample to sample."""
    return np.vstack([np.log(np.abs(np.sinc(f * time))), -np.pi * f * time])


def logarithm(p: Array, f: Array, held: float = 0.0, resonant: bool = False) -> Array:
    """Return ln |H| and arg H, rows (2, n), continuous in f.  p: ln K, T, then of each pair of poles ln b and ln z, and
    ln a of a single one; of a resonance, at the end, ln b, ln z, a, c.
    """
    s = 2j * np.pi * f
    gain, phase = np.full(f.size, p[0]), -2.0 * np.pi * f * p[1]
    rest = np.clip(p[2:-4] if resonant else p[2:], -LIMIT, LIMIT)
    factors = [_pair(s, *rest[k : k + 2]) for k in range(0, rest.size - 1, 2)]
    if rest.size % 2:
        factors.append(1.0 + s / np.exp(rest[-1]))
    if resonant:
        b, z = np.clip(p[-4:-2], -LIMIT, LIMIT)
        below = _pair(s, b, z)
        factors += [below, 1.0 / (below + p[-2:] @ _zeros(s, b))]
    for factor in factors:
        gain, phase = gain - np.log(np.abs(factor)), phase - np.angle(factor)
    out: Array = np.vstack([gain, phase]) + hold(f, held)
    return out


def _pair(s: Complex, b: Array, z: Array) -> Complex:
    """Return 1 + 2 z x + x2, x = s/b, of ln b and ln z."""
    x = s / np.exp(b)
    return np.asarray(1.0 + 2.0 * np.exp(z) * x + x * x)


def _zeros(s: Complex, b: Array) -> Complex:
    """Return what a and c add to the numerator of a resonance, in that order."""
    x = s / np.exp(b)
    return np.array([-x * x, x])


Logarithm = Callable[[Array], Array]  # frequencies (n,), Hz -> ln |H| and arg H, rows (2, n), continuous


def read_off(of: Logarithm, highest: float) -> Array:
    """Return K, f3, f90, delay, order of a response; NaN for what it does not reach up to the highest frequency, Hz."""
    tiny = 1e-6 * highest
    at_zero = of(np.array([tiny]))[:, 0]
    grid = np.geomspace(1e-3 * highest, highest, DENSE)
    gain, phase = of(grid)
    f3 = _crossing(of, 0, grid, gain, at_zero[0] + math.log(ROOT))
    f90 = _crossing(of, 1, grid, phase, -0.5 * math.pi)
    order = math.nan
    if math.isfinite(f3):
        near = of(f3 * np.array([1.0 - 1e-4, 1.0 + 1e-4]))[0]
        order = -2.0 * float(near[1] - near[0]) / 2e-4
    return np.array([math.exp(min(at_zero[0], LIMIT)), f3, f90, -at_zero[1] / (2.0 * math.pi * tiny), order])


def _crossing(of: Logarithm, row: int, grid: Array, y: Array, level: float) -> float:
    below = np.flatnonzero((y[1:] < level) & (y[:-1] >= level))
    if not below.size:
        return math.nan
    k = int(below[0])
    off = lambda f: float(of(np.array([f]))[row, 0]) - level  # noqa: E731
    return float(optimize.brentq(off, grid[k], grid[k + 1], xtol=1e-12, rtol=1e-12))


@dataclass(frozen=True)
class PoleCurve:
    """A fitted response with n poles and, perhaps, a resonance: parameters p and their covariance, chi2, degrees of
    freedom, criterion.
    """

    poles: int
    p: Array
    cov: Array
    chi2: float
    dof: int
    criterion: float
    highest: float  # Hz
    held: float = 0.0  # s
    resonant: bool = False

    @property
    def shape(self) -> tuple[int, bool]:
        return self.poles, self.resonant

    @property
    def resonance(self) -> float:
        """Frequency of the resonance, Hz."""
        return math.exp(min(self.p[-4], LIMIT)) / (2.0 * math.pi) if self.resonant else math.nan

    def at(self, f: Array, p: Array | None = None) -> Array:
        """Return ln |H| and arg H, rows (2, n), of other parameters where they are given."""
        return logarithm(self.p if p is None else p, f, self.held, self.resonant)

    @property
    def size(self) -> Array:
        """Return of what size the parameters are at least."""
        out = np.ones(self.p.size)
        out[1] = 1.0 / self.highest
        return out

    def values(self, p: Array) -> Array:
        """Return K, f3, f90, delay, order of parameters p."""
        return read_off(lambda f: self.at(f, p), self.highest)

    def variances(self) -> Array:
        """Return the variances of the values by those of the points: to first order; where a resonance bends them the
        mean square of the changes to n points p + sqrt(n) L and n points p - sqrt(n) L, cov = L L'.
        """
        more = max(1.0, self.chi2 / max(self.dof, 1))
        if self.resonant:
            size, along = np.linalg.eigh(self.cov * more * self.p.size)  # singular of a pole that nothing shows
            steps = (along * np.sqrt(np.maximum(size, 0.0))).T
            moved = np.array([self.values(self.p + d) for d in (*steps, *-steps)])
            away = np.nan_to_num(moved - self.values(self.p))
            return np.asarray(np.sum(away * away, axis=0) / np.maximum(np.sum(np.isfinite(moved), axis=0), 1))
        steps = np.diag(1e-5 * np.where(self.size < 1.0, self.size, np.maximum(np.abs(self.p), 1.0)))
        J = np.column_stack([(self.values(self.p + d) - self.values(self.p - d)) / (2.0 * d.sum()) for d in steps])
        out: Array = np.einsum("ij,jk,ik->i", J, self.cov, J) * more
        return out


def fitted(r: GyroResponse, poles: int, start: Array | None = None) -> PoleCurve | None:
    """Return the response with so many poles; None where there are too few points for it, or it does not converge.

    start: of a curve with a resonance, all of its parameters.
    """
    resonant = start is not None
    free = poles + (6 if resonant else 2)
    dof = 2 * r.f.size - free
    if dof < 3:
        return None
    f, measured, u = r.f, np.vstack([r.gain, r.phase]), r.u
    top = float(f[-1])
    units = np.ones(free)
    units[1] = 1.0 / top

    def off(x: Array) -> Array:
        return ((logarithm(x * units, f, r.held, resonant) - measured) / u).ravel()

    best = None
    for begin in _starts(r, poles) if start is None else [start / units]:
        try:
            found = optimize.least_squares(off, begin, method="lm", x_scale="jac", max_nfev=40 * (free + 1))
        except (ValueError, np.linalg.LinAlgError):
            continue
        if np.all(np.isfinite(found.x)) and (best is None or found.cost < best.cost):
            best = found
        if best is not None and 2.0 * best.cost < GOOD * dof:
            break
    if best is None or _absent(best.x[2 : 2 + poles], top):
        return None
    scale = np.linalg.norm(best.jac, axis=0)
    if not np.all(scale > 0.0) or np.linalg.cond(best.jac / scale) > 1e7:
        return None
    cov = _covariance(best.jac / scale, best.fun, r.known) / np.outer(scale, scale)
    chi2 = 2.0 * float(best.cost)
    p, cov = best.x * units, cov * np.outer(units, units)
    curve = PoleCurve(poles, p, cov, chi2, dof, _criterion(r, chi2, free), top, r.held, resonant)
    return None if resonant and not _shown(r, curve) else curve


def _covariance(J: Array, left: Array, known: bool) -> Array:
    """Return the covariance of parameters of slopes J (2 n, p): by u of the points, or by what each leaves (2 n,) of a
    fit without it (HC3), as where the noise of each is not known.
    """
    inverse = np.linalg.inv(J.T @ J)
    gain = inverse @ J.T
    own = (left / np.maximum(1.0 - np.sum(J.T * gain, axis=0), LEVERAGE)) ** 2
    both = np.tile(np.mean(own.reshape(2, -1), axis=0), 2)  # gain and phase of a point are alike
    return np.asarray(inverse if known else (gain * both) @ gain.T)


def _criterion(r: GyroResponse, chi2: float, free: int) -> float:
    """Return the Bayesian information criterion; where u is not known, with the scatter as one unknown more."""
    n = 2 * r.f.size
    return (chi2 if r.known else n * math.log(max(chi2, 1e-300))) + free * math.log(n)


def _shown(r: GyroResponse, c: PoleCurve) -> bool:
    """Return whether the resonance is in the band and no wild point: three frequencies show it."""
    made = np.hypot(*(c.at(r.f) - logarithm(c.p[:-4], r.f, r.held))) / (r.u * math.sqrt(max(c.chi2 / c.dof, 1e-12)))
    return bool(r.f[0] < c.resonance < r.f[-1] and np.count_nonzero(made > SEEN) >= 3)


def _starts(r: GyroResponse, poles: int) -> Iterator[list[float]]:
    """Yield first parameters, the delay over the time of the highest frequency: corners about the first -3 dB."""
    low = float(np.mean(r.gain[:3]))
    fallen = np.flatnonzero(r.gain < low + math.log(ROOT))
    corner = math.log(2.0 * math.pi * float(r.f[fallen[0]] if fallen.size else r.f[-1]))
    for spread in (0.3, -0.3, 1.0):
        start = [low, 0.0]
        for k in range(poles // 2):
            start += [corner + spread * (k + 0.3), math.log(0.7) - 0.5 * k]
        yield start + ([corner + 2.0 * abs(spread)] if poles % 2 else [])


def _tangents(r: GyroResponse, c: PoleCurve) -> Array:
    """Return an orthonormal basis (2 n, parameters) of what the parameters of a curve change, over u of the points."""
    steps = np.diag(1e-5 * c.size)
    J = np.column_stack([((c.at(r.f, c.p + d) - c.at(r.f, c.p - d)) / d.sum() / r.u).ravel() for d in steps])
    out: Array = np.linalg.qr(J / np.linalg.norm(J, axis=0))[0]
    return out


def _with_resonance(r: GyroResponse, c: PoleCurve, least: float) -> PoleCurve | None:
    """Return a curve with the resonance that its residuals show best; None where none promises a criterion below least.

    Small a and c are linear in them: of each frequency and damping by least squares beside the curve's own parameters.
    """
    left = ((np.vstack([r.gain, r.phase]) - c.at(r.f)) / r.u).ravel()
    own = _tangents(r, c)
    corners = np.log(2.0 * math.pi * np.geomspace(r.f[0], r.f[-1], 4 * r.f.size))
    b, z = (v.reshape(-1, 1) for v in np.meshgrid(corners, np.log(DAMPING)))
    s = 2j * np.pi * r.f
    made = _zeros(s, b) / _pair(s, b, z)  # (2, k, n) of a and c, of each of k resonances
    X = np.concatenate([made.real / r.u, made.imag / r.u], axis=2)
    X -= (X @ own) @ own.T
    square, seen = np.einsum("ikn,jkn->kij", X, X), X @ left
    square += 1e-9 * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    a = np.linalg.solve(square, seen.T[..., None])[..., 0]
    gained = np.sum(a * seen.T, axis=1)
    k = int(np.argmax(gained))
    if not _criterion(r, max(c.chi2 - float(gained[k]), 0.0), c.p.size + 4) < least:
        return None
    return fitted(r, c.poles, np.array([*c.p, *b[k], *z[k], *a[k]]))


def _next_pole(r: GyroResponse, c: PoleCurve, f3: float) -> float:
    """Return the change of the order at f3, Hz, by the pole far above that the noise leaves room for: of one standard
    uncertainty of q in the gain (1 + q w2)^-1/2, whose phase is that of a delay.  NaN where f3 is.
    """
    column = np.concatenate([-2.0 * (math.pi * r.f) ** 2 / r.u, np.zeros(r.f.size)])
    own = _tangents(r, c)
    size = float(np.linalg.norm(column - own @ (own.T @ column)))
    return 2.0 * (2.0 * math.pi * f3) ** 2 * math.sqrt(max(1.0, c.chi2 / c.dof)) / size


def _absent(rest: Array, top: float) -> bool:
    """Return whether a pole is so far above the frequencies measured that it is none."""
    far = math.log(2.0 * math.pi * top * WIDE)
    corners = [*rest[0 : 2 * (rest.size // 2) : 2], *([rest[-1]] if rest.size % 2 else [])]
    return any(c > far for c in corners)


@dataclass(frozen=True)
class Figures:
    """value, u by noise, u by the shape: (5,) of K, f3 (Hz), f90 (Hz), delay (s), order; the curve they are of."""

    value: Array
    noise: Array
    shape: Array
    curve: PoleCurve

    @property
    def u(self) -> Array:
        out: Array = np.hypot(self.noise, self.shape)
        return out


def curves(r: GyroResponse) -> list[PoleCurve]:
    """Return the curves of 0 to POLES poles that can be fitted, up to two beyond the least criterion, and those with a
    resonance that it may take.
    """
    found: list[PoleCurve] = []
    for poles in range(POLES + 1):
        best = min(found, key=lambda c: c.criterion).poles if found else poles
        curve = fitted(r, poles) if poles <= best + 2 else None
        found += [curve] if curve is not None else []
    least = min((c.criterion for c in found), default=0.0)
    resonant = [c for c in (_with_resonance(r, c, least) for c in found) if c is not None]
    widest = min(resonant, key=lambda c: c.criterion, default=None)
    while widest and (more := _one_more(r, widest)):  # one pole more beside it, until it is no better
        resonant.append(more)
        widest = more if more.criterion < widest.criterion else None
    return [*found, *resonant]


def _one_more(r: GyroResponse, c: PoleCurve) -> PoleCurve | None:
    """Return a curve with a resonance with one pole more, from one three times above the frequencies on."""
    rest, far = c.p[2:-4], math.log(6.0 * math.pi * float(r.f[-1]))
    if rest.size % 2:  # two single poles are a pair
        half = float(np.clip(0.5 * (far - rest[-1]), -LIMIT, LIMIT))
        rest = np.array([*rest[:-1], rest[-1] + half, math.log(math.cosh(half))])
    else:
        rest = np.append(rest, far)
    return fitted(r, c.poles + 1, np.array([*c.p[:2], *rest, *c.p[-4:]])) if c.poles < POLES else None


def figures(r: GyroResponse, choose: Callable[[list[PoleCurve]], PoleCurve] | None = None) -> Figures | None:
    """Return the figures of a response; None where no curve can be fitted.  choose: not the least criterion."""
    every = curves(r)
    if not every:
        return None
    best = choose(every) if choose else min(every, key=lambda c: c.criterion)
    value, variance = best.values(best.p), best.variances()
    more = next((c for c in every if c.shape == (best.poles + 1, best.resonant)), None)
    shape = np.zeros(value.size)
    if more is not None:
        other, wider = more.values(more.p), more.variances()
        beyond = (other - value) ** 2 - np.maximum(wider - variance, 0.0)
        shape = np.sqrt(np.maximum(np.nan_to_num(beyond), 0.0))
    if best.shape == (1, False):  # whose order is 1 whatever its corner
        shape[4] = math.hypot(shape[4], _next_pole(r, best, float(value[1])))
    student = 1.0 if r.known else float(special.stdtrit(best.dof, 0.975) / special.ndtri(0.975))
    return Figures(value, student * np.sqrt(variance), shape, best)
