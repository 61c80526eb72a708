"""Frequency responses and stability margins, of linear models and of measured points alike.

A model is what gyrobench.linear.linear_model writes into run.json.  Margins are found on a dense frequency response,
for models and for points interpolated between measured frequencies: what is compared is found in one way.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.frequency_response import model_response
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.loop_measures import Point

Complex = NDArray[np.complex128]
DENSE = 2000  # points of a response on which margins are looked for


def excitation_response(model: LinearModel, kind: str, axis: int, output: str, f: Sequence[float] | Array) -> Complex:
    """Return the response (frequency,) of a channel to an excitation of an axis; see :func:`excitation_responses`."""
    return excitation_responses(model, kind, (axis,), (output,), f)[:, 0, 0]


def excitation_responses(
    model: LinearModel, kind: str, axes: Sequence[int], outputs: Sequence[str], f: Sequence[float] | Array
) -> Complex:
    """Return the responses (frequency, output, axis) of channels ("slot.output") to an excitation.

    kind: torque, command, test, or motion (angle of the base), which moves angle, rate and acceleration at once; they
    are summed as 1, s, s^2.  Raises KeyError where the model has no such output or the excitation is not wired.
    """
    names = ("motion_angle", "motion_rate", "motion_acceleration") if kind == "motion" else (kind,)
    for output in outputs:
        if output not in model.outputs:
            there = ", ".join(model.outputs)
            raise KeyError(f"{output}: unknown channel of the linear model; available: {there}")
    every = model_response(model, f)[:, [model.outputs.index(o) for o in outputs], :]
    s = 2j * np.pi * np.asarray(f, float)
    total = np.zeros((s.size, len(outputs), len(axes)), complex)
    for k, axis in enumerate(axes):
        wired = [(power, j) for power, name in enumerate(names) for j, x in enumerate(model.inputs)
                 if x.partition(".")[2] == f"{name}[{axis}]"]  # fmt: skip
        if not wired:
            raise KeyError(f"{kind} on axis {axis} is not connected in this system")
        for power, j in wired:
            total[:, :, k] += (s**power)[:, None] * every[:, :, j]
    return total


def grid(low: float, high: float, count: int = DENSE) -> Array:
    """Return frequencies equally spaced in the logarithm."""
    return np.geomspace(low, high, count)


def decibel(factor: float | None) -> float | None:
    """Return a gain in dB; None of None."""
    return None if factor is None else 20.0 * math.log10(factor)


@dataclass(frozen=True)
class Margins:
    """Points at which |L| = 1 and at which the phase of L is -180 degrees.

    crossovers: (Hz, phase margin in degrees).  gains: (Hz, factor on the gain that brings the loop to its limit).
    upper, lower: smallest factor above 1 and largest below 1, None where there is none; a loop with a lower one is
    conditionally stable: it becomes unstable when its gain falls, too.
    """

    crossovers: list[tuple[float, float]] = field(default_factory=list)
    gains: list[tuple[float, float]] = field(default_factory=list)

    @property
    def crossover(self) -> float | None:
        """Return the frequency (Hz) of the smallest phase margin."""
        return min(self.crossovers, key=lambda c: abs(c[1]))[0] if self.crossovers else None

    @property
    def phase(self) -> float | None:
        return min((c[1] for c in self.crossovers), key=abs) if self.crossovers else None

    @property
    def upper(self) -> float | None:
        return min((g for _, g in self.gains if g > 1.0), default=None)

    @property
    def lower(self) -> float | None:
        return max((g for _, g in self.gains if 0.0 < g < 1.0), default=None)

    def limit(self, side: str) -> float | None:
        """Return "upper" or "lower" in dB."""
        return decibel(self.upper if side == "upper" else self.lower)

    def near(self, f: float) -> tuple[float | None, float | None]:
        """Return the crossover (Hz) next to f, and its phase margin (degrees)."""
        return min(self.crossovers, key=lambda c: abs(math.log(c[0] / f)), default=(None, None))

    @property
    def f_lower(self) -> float | None:
        """Return the frequency (Hz) of the lower limit."""
        return next((f for f, g in self.gains if g == self.lower), None)

    def row(self, name: str) -> list[Any]:
        """Return the row of a table with :data:`COLUMNS`."""
        at = {g: f for f, g in self.gains}
        upper, lower = self.upper, self.lower
        sides = (decibel(upper), at.get(upper or 0.0), decibel(lower), at.get(lower or 0.0))
        return [name, self.crossover, self.phase, *sides]


COLUMNS = [
    "open loop",
    "gain crossover / Hz",
    "phase margin / °",
    "gain margin / dB",
    "phase crossover / Hz",
    "gain-reduction margin / dB",
    "phase_crossover_Hz",  # shown as the other one; names of columns differ
]


def margins(f: Array, gain: Complex) -> Margins:
    """Return margins of a loop gain given densely (some hundred points) over rising frequencies.

    Crossings are bracketed between neighbours and refined on the cubic spline through all points, as
    control.stability_margins does with smooth frequency response data.  Two crossings between neighbours are not seen.
    """
    from scipy.interpolate import CubicSpline
    from scipy.optimize import brentq

    w, L = 2.0 * np.pi * np.asarray(f, float), np.asarray(gain, complex)
    curve = CubicSpline(w, np.column_stack([L.real, L.imag]))

    def crossings(values: Array, of: Callable[[Array], float]) -> list[tuple[float, complex]]:
        above = values >= 0.0
        roots = []
        for k in np.flatnonzero(above[1:] != above[:-1]):
            w0 = brentq(lambda x: of(curve(x)), w[k], w[k + 1])
            roots.append((float(w0), complex(*curve(w0))))
        return roots

    unity = crossings(np.abs(L) - 1.0, lambda z: math.hypot(z[0], z[1]) - 1.0)
    real = [(w0, z) for w0, z in crossings(L.imag, lambda z: float(z[1])) if z.real < 0.0]
    return Margins(
        [(w0 / (2.0 * math.pi), (math.degrees(cmath.phase(z)) % 360.0) - 180.0) for w0, z in unity],
        [(w0 / (2.0 * math.pi), 1.0 / abs(z)) for w0, z in real],
    )


def interpolate_response(points: Sequence[Point], f: Array, spline: bool = False) -> Complex:
    """Return measured points interpolated in log gain and unwrapped phase over log frequency, monotone between points.

    Consecutive points must not turn by more than 180 degrees; f must lie inside their range.  spline: by a cubic spline
    instead, which is smoother and may overshoot.
    """
    from scipy.interpolate import CubicSpline, PchipInterpolator

    known = sorted(points, key=lambda p: p.f)
    x = np.log([p.f for p in known])
    curve = CubicSpline if spline else PchipInterpolator
    size = curve(x, np.log([abs(p.value) for p in known]))(np.log(f))
    turn = curve(x, np.unwrap(np.angle([p.value for p in known])))(np.log(f))
    return np.asarray(np.exp(size + 1j * turn))


def measured_margins(points: Sequence[Point]) -> Margins:
    """Return the margins inside the range of the measured frequencies (4 points at least, else none).

    None either of a response that is 0 somewhere, as of a model through a part that has no slope.
    """
    if len(points) < 4 or not all(p.value for p in points):
        return Margins()
    f = grid(min(p.f for p in points), max(p.f for p in points))
    return margins(f, interpolate_response(points, f))


def measured_values(points: Sequence[Point], excluded: Sequence[float] = ()) -> dict[str, tuple[float, float]]:
    """Return what measured points say of the loop's limits: name -> (value, standard uncertainty).

    crossover (Hz) and phase (degrees) of the smallest phase margin; upper and f_upper, lower and f_lower: the factors
    on the gain to the next limits, and their frequencies (Hz).  Missing where the range of the points has none, where
    the gain (the phase) cannot be told from 1 (-180 degrees) up to an end of that range, and where a frequency of
    ``excluded``, at which a measurement did not count, lies beside the limit.

    The uncertainty holds that of the points (as far as the gain cannot be told from 1 within 1.96 u the crossover may
    lie, and the phase turns over that range; limits: propagated) and the difference of two interpolations between them.
    """
    if len(points) < 4:
        return {}
    f = grid(min(p.f for p in points), max(p.f for p in points))
    curve, spline = interpolate_response(points, f), interpolate_response(points, f, spline=True)
    shown, other = margins(f, curve), margins(f, spline)
    u = _relative_u(points, f)
    size, turn = np.log(np.abs(curve)), np.unwrap(np.angle(curve))
    values: dict[str, tuple[float, float]] = {}
    if shown.crossovers:
        cross, phase = min(shown.crossovers, key=lambda c: abs(c[1]))
        inside = _undecided(f, size, u, cross)
        if _bounded(inside, points, excluded, cross):
            twin = min(other.crossovers, key=lambda c: abs(c[0] - cross), default=(cross, phase))
            values["crossover"] = cross, math.hypot(_spread(f, f, inside, cross), twin[0] - cross)
            own = math.hypot(_interpolated_u(points, cross), _spread(f, turn, inside, cross))
            values["phase"] = phase, math.hypot(math.degrees(own), twin[1] - phase)
    for name, factor in (("upper", shown.upper), ("lower", shown.lower)):
        if factor is None:
            continue
        at = next(x for x, g in shown.gains if g == factor)
        beyond = turn - float(np.interp(at, f, turn))
        inside = _undecided(f, beyond, u, at)
        if _bounded(inside, points, excluded, at):
            same = min(other.gains, key=lambda g: abs(g[0] - at), default=(at, factor))
            u_f, u_factor = _propagated(points, f, at, factor)
            values[name] = factor, math.hypot(u_factor, same[1] - factor)
            values[f"f_{name}"] = at, math.hypot(u_f, same[0] - at)
    return values


def beside(model: Margins | None, values: Mapping[str, tuple[float, float]]) -> tuple[float | None, float | None]:
    """Return crossover and phase margin of the model; of several crossovers the one next to the measured."""
    if model is None:
        return None, None
    return model.near(values["crossover"][0]) if "crossover" in values else (model.crossover, model.phase)


def _propagated(points: Sequence[Point], f: Array, at: float, factor: float) -> tuple[float, float]:
    """Return the u of the frequency and of the factor of a limit: each neighbouring point moved by its u, in gain and
    in phase; the interpolation is local, two points to either side.
    """
    squares = np.zeros(2)
    for k in sorted(range(len(points)), key=lambda k: abs(math.log(points[k].f / at)))[:4]:
        for part in (1.0, 1j):
            moved = list(points)
            moved[k] = replace(points[k], value=points[k].value * cmath.exp(part * (points[k].u or 0.0)))
            gains = margins(f, interpolate_response(moved, f)).gains
            same = min(gains, key=lambda g: abs(math.log(g[0] / at)), default=(at, factor))
            squares += np.square([same[0] - at, same[1] - factor])
    return float(math.sqrt(squares[0])), float(math.sqrt(squares[1]))


def unity_range(points: Sequence[Point]) -> tuple[float, float] | None:
    """Return the range (Hz) over which the gain of measured points cannot be told from 1; None where it always can."""
    f = grid(min(p.f for p in points), max(p.f for p in points))
    near = np.abs(np.log(np.abs(interpolate_response(points, f)))) < NORMAL * _relative_u(points, f)
    return (float(f[near][0]), float(f[near][-1])) if np.any(near) else None


def _relative_u(points: Sequence[Point], f: Array) -> Array:
    """Return the relative uncertainty of the points over frequency; of the larger one of two neighbours."""
    known = sorted(points, key=lambda p: p.f)
    u = np.array([p.u or 0.0 for p in known])
    k = np.clip(np.searchsorted([p.f for p in known], f), 1, u.size - 1)
    return np.asarray(np.maximum(u[k - 1], u[k]))


def _interpolated_u(points: Sequence[Point], at: float) -> float:
    """Return the relative uncertainty of an interpolated value: of its two neighbours, by their distance in log f."""
    known = sorted(points, key=lambda p: p.f)
    k = int(np.clip(np.searchsorted([p.f for p in known], at), 1, len(known) - 1))
    low, high = known[k - 1], known[k]
    x = math.log(at / low.f) / math.log(high.f / low.f)
    return math.hypot((1.0 - x) * (low.u or 0.0), x * (high.u or 0.0))


def _undecided(f: Array, value: Array, u: Array, at: float) -> tuple[float, float]:
    """Return the range of frequencies about ``at`` at which a value cannot be told from 0 within U.

    A conditionally stable loop has two such ranges; the other one does not count.
    """
    far = f[np.abs(value) >= NORMAL * u]
    near = f[(f > np.max(far[far < at], initial=0.0)) & (f < np.min(far[far > at], initial=math.inf))]
    low, high = float(np.min(near, initial=at)), float(np.max(near, initial=at))
    if low < at < high:
        return low, high
    slope = abs(float(np.interp(at * 1.01, f, value) - np.interp(at * 0.99, f, value))) / 0.02
    half = NORMAL * float(np.interp(at, f, u)) / slope if slope else 0.0  # finer than the grid
    return min(low, at * (1.0 - half)), max(high, at * (1.0 + half))


def _bounded(
    inside: tuple[float, float], points: Sequence[Point], excluded: Sequence[float], at: float
) -> bool:  # fmt: skip
    """Return whether a range ends inside that of the points, without an excluded one in it or up to the next point."""
    known = [p.f for p in points]
    low = max((x for x in known if x <= min(at, inside[0])), default=None)
    high = min((x for x in known if x >= max(at, inside[1])), default=None)
    return low is not None and high is not None and not any(low < x < high for x in excluded)


def _spread(f: Array, value: Array, inside: tuple[float, float], at: float) -> float:
    """Return the standard uncertainty of a value over frequency from the range in which ``at`` may lie at 95 %."""
    at_ends = np.interp(inside, f, value)
    between = value[(f >= inside[0]) & (f <= inside[1])]
    return float(np.max(np.abs(np.append(between, at_ends) - np.interp(at, f, value)))) / NORMAL


def deviation(points: Sequence[Point], model: Complex, up_to: float) -> tuple[float, float]:
    """Return the largest difference (dB, degrees) of points to a model at their frequencies, up to a frequency."""
    ratios = [p.value / m for p, m in zip(points, model, strict=True) if p.f <= up_to * (1.0 + 1e-9)]
    if not ratios:
        return 0.0, 0.0
    return (
        max(abs(20.0 * math.log10(abs(r))) for r in ratios),
        max(abs(math.degrees(math.atan2(r.imag, r.real))) for r in ratios),
    )
