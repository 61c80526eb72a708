"""Heading and level after a time, from the random errors of the instruments: closed forms.  [NORTH-AFTER]

    one position     s_w2 = b2 + N2/T + (B2/pi)(ln(3.17 tau/T) + 3/2 - gamma) + K2 T/3        variance of the mean rate
    two positions    s_w2 = s_A2(T/2)/2,   s_A2(t) = N2/t + (2 ln 2/pi) B2 + K2 t/3      the bias goes out, half a turn
    heading          s_psi = s_w/(W cos latitude), in one position with tan(latitude) s_tilt
    level            s_tilt = s_f/g,   s_f2 as s_w2 of one position, of the accelerometer
    free running     s2(t) = s2(0) + t2 s_r2(T, t)            s_r: rate of the time t against that of the alignment T
    s_r2(T, t) = N2 (1/T + 1/t) + (B2/pi) F(T, t) + K2 (T + t)/3,   F(T, T) = 4 ln 2
    d' = -W x d + e:  across W the errors e of the axes turn into each other, along it they do not
    position         p = int R (1 - cos v (t - s)) e ds + int sin(v (t - s))/v a ds,   v2 = g/R

b: rms of the bias at switch-on, N, B, K: white noise, flicker, random walk; a Gauss-Markov part by its correlation.
Not modelled: errors of scale factor and axes, temperature, motion of the base, more than two positions.
[IEEE 952, annex C; GSP ch. 5, section 5.3.2]
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from gyrobench import units
from gyrobench.reduction.toolkit import Array, Table, plain
from gyrobench.units import ARCMIN, DEG, DPH

from . import plans

MINUTES = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 60.0)
MOST = 0.5  # rad, heading beyond which a standard deviation says nothing
GOALS = (1.0, 0.1)  # deg
LONGEST = 86400.0  # s, looked at
#: the slowest relaxation of a part's flicker stands for those beyond it, too: half a ratio of 4, and a third of one
BEYOND = 2.0 * 4.0 ** (1.0 / 3.0)
CELLS = 200  # of a time, over which readings are taken as even
EULER = 0.5772156649015329
RADIUS = 6371008.8  # m, mean of the axes of WGS84, (2 a + b)/3
WHITE = ("white_y", "white", "electronics", "quantum", "white_x")
OWN = ("optical", "lock_in")  # noise that a part computes of its physics: its density is not a parameter


@dataclass(frozen=True)
class RandomErrors:
    """Errors of one axis, SI of rate or force: bias (rms at switch-on), white (N), flicker (B) up to the correlation
    time tau (s), walk (K), markov (rms) with its correlation time (s).
    """

    white: float
    bias: float = 0.0
    flicker: float = 0.0
    tau: float = 1e5
    walk: float = 0.0
    markov: float = 0.0
    markov_tau: float = 300.0

    @classmethod
    def of(cls, parameters: Mapping[str, Any], axis: str = "y") -> Self | None:
        """Return those that the parameters of an instrument state, along an axis; None where its noise is not one."""
        k = "xyz".index(axis)

        def size(*names: str) -> float:
            """Return the root of the sum of squares of parameters that are there."""
            given = [np.ravel(np.asarray(parameters.get(n, 0.0), dtype=float)) for n in names]
            return math.sqrt(sum(float(v[min(k, v.size - 1)]) ** 2 for v in given))

        white = [n for n in WHITE if n in parameters]
        if not white or size(*OWN) > 0.0:
            return None
        return cls(
            size(*white[:1]), size("bias", "turn_on", f"turn_on_{axis}"), size(f"flicker_{axis}", f"{axis}_flicker"),
            size("flicker_tau") or 1e5, size(f"walk_{axis}", f"{axis}_walk"), size(f"markov_{axis}"),
            size("markov_tau") or 300.0,
        )  # fmt: skip

    def mean(self, T: float) -> float:
        """Return the variance of the mean over the first T seconds, against the true value."""
        slow = max(math.log(BEYOND * self.tau / T) + 1.5 - EULER, 0.0)
        x = T / self.markov_tau
        return (
            self.bias**2
            + self.white**2 / T
            + self.flicker**2 / math.pi * slow
            + self.walk**2 * T / 3.0
            + self.markov**2 * 2.0 * (x + math.expm1(-x)) / x**2
        )

    def change(self, T: float, t: float) -> float:
        """Return the variance of the mean over t less that over the T before."""
        H = [0.5 * x * x * (math.log(x) - 1.5) for x in (T + t, T, t)]
        flicker = 3.0 - math.log(T) - math.log(t) + 2.0 * (H[0] - H[1] - H[2]) / (T * t)
        x, y = T / self.markov_tau, t / self.markov_tau
        own = sum(2.0 * (v + math.expm1(-v)) / v**2 for v in (x, y))
        markov = own - 2.0 * math.expm1(-x) * math.expm1(-y) / (x * y)
        return (
            self.white**2 * (1.0 / T + 1.0 / t)
            + self.flicker**2 / math.pi * flicker
            + self.walk**2 * (T + t) / 3.0
            + self.markov**2 * markov
        )

    def turned(self, T: float, t: float, turn: float) -> float:
        """Return the variance of an angle that grows for t after T of alignment, across the axis about which all axes
        turn at the rate turn (rad/s); with errors of this size on each.  turn = 0: t2 times :meth:`change`.
        """
        return self.weighed(T, t, lambda s: np.exp(1j * turn * s))

    def weighed(self, T: float, t: float, kernel: Callable[[Array], Any]) -> float:
        """Return the variance of the integral over t after T of alignment of the kernel (of the times since then, s,
        SI) times what readings have changed since, real or complex.

        By weights of readings that sum to zero, -1/2 sum w_i w_j* D(s_i - s_j), D the structure function; a cell's own
        mean of ln and of the lag in closed form.
        """
        cells = np.array([T, t]) / CELLS
        middle = np.arange(CELLS) + 0.5
        s = np.concatenate([cells[0] * middle - T, cells[1] * middle])
        grown = kernel(s[CELLS:]) * cells[1]
        w = np.concatenate([np.full(CELLS, -grown.sum() / CELLS), grown])
        own = np.repeat(cells, CELLS)
        lag = np.abs(s[:, None] - s[None, :])
        far = ~np.eye(s.size, dtype=bool)
        log = np.log(lag, out=np.diag(np.log(own) - 1.5), where=far)
        mean = np.where(far, lag, np.diag(own / 3.0))
        D = 2.0 * self.flicker**2 / math.pi * log + self.walk**2 * mean
        D -= 2.0 * self.markov**2 * np.expm1(-mean / self.markov_tau)
        white = self.white**2 * (np.sum(np.abs(grown) ** 2) / cells[1] + abs(complex(grown.sum())) ** 2 / T)
        return float(white - 0.5 * np.real(w @ D @ np.conj(w)))

    def reversed(self, T: float) -> float:
        """Return the variance of half the difference of two positions half a turn apart, T/2 each."""
        return self.change(0.5 * T, 0.5 * T) / 4.0


def level(force: RandomErrors, gravity: float, T: float) -> float:
    """Return the standard deviation of the tilt after T seconds in one position, rad."""
    return math.sqrt(force.mean(T)) / gravity


def heading(rate: RandomErrors, latitude: float, T: float, *, two: bool = True, tilt: float = 0.0) -> float:
    """Return the standard deviation of the heading after T seconds in one position or two, rad, of small errors."""
    north = units.EARTH_RATE * math.cos(latitude)
    if two:
        return math.sqrt(rate.reversed(T)) / north
    return math.hypot(math.sqrt(rate.mean(T)) / north, tilt * math.tan(latitude))


def reached_after(rate: RandomErrors, latitude: float, goal: float, *, two: bool = True) -> float | None:
    """Return the time after which the heading has the standard deviation goal (rad), s; None: never, in a day."""
    times = np.geomspace(1.0, LONGEST, 2000)
    good = [t for t in times if heading(rate, latitude, float(t), two=two) <= goal]
    return float(good[0]) if good else None


def running(rate: RandomErrors, start: float, T: float, t: float, latitude: float | None = None) -> float:
    """Return the standard deviation of a heading t seconds after an alignment of T seconds that left start, rad.

    The rate of the alignment is taken for the bias, so that what changes since counts.  latitude: the Earth's rate
    turns the errors of the three axes, of one size, into each other; None: an axis by itself, 5 % more in six hours.
    """
    growth = t * t * rate.change(T, t)
    if latitude is not None:  # the vertical has cos of it across the Earth's rate
        across = rate.turned(T, t, units.EARTH_RATE) / rate.turned(T, t, 0.0)
        growth *= 1.0 - math.cos(latitude) ** 2 * (1.0 - across)
    return math.hypot(start, math.sqrt(growth))


def position(rate: RandomErrors, force: RandomErrors | None, gravity: float, T: float, t: float) -> float:
    """Return the standard deviation of a coordinate t seconds after an alignment of T seconds to level, m.

    The level follows the vertical over a sphere (period of 84 minutes): what the rate about the other horizontal axis
    has changed since tilts it, what the force has changed since moves it.  The force of the alignment is level for it,
    so that its bias moves nothing.  force: None, left out.  Not modelled: the turning of the axes by the Earth's rate.
    """
    v = math.sqrt(gravity / RADIUS)
    variance = rate.weighed(T, t, lambda s: RADIUS * (1.0 - np.cos(v * (t - s))))
    if force is not None:
        variance += force.weighed(T, t, lambda s: np.sin(v * (t - s)) / v)
    return math.sqrt(variance)


def lost(method: str, u_bias: float, latitude: float) -> list[str]:
    """Return why one position determines no heading: three times the u of the bias is above the Earth rate; [] else."""
    north = units.EARTH_RATE * math.cos(latitude)
    if method != "strapdown" or 3.0 * u_bias <= north:
        return []
    return [
        f"u_bias = {plain(u_bias / DPH, 4)} °/h: one position determines no heading where three times this is above "
        f"the horizontal Earth rate, {plain(north / DPH, 4)} °/h; take the method strapdown two"
    ]


def in_words(time: float | None) -> str:
    """Return a time until a goal is reached."""
    if time is None:
        return "never"
    for unit, size in (("h", 3600.0), ("min", 60.0)):
        if time >= 2.0 * size:
            return f"after {plain(time / size)} {unit}"
    return f"after {plain(time, 3)} s"


def table(p: Mapping[str, Any], latitude: float, gravity: float, bias: float = 0.0) -> list[Table]:
    """Return heading and level after minutes with the instruments of a run, from its parameters; [] without errors.

    bias: stated standard uncertainty of that of a gyro, rad/s, which may be more than the parameters of this one say.
    """
    rate, force = (
        RandomErrors.of({n.removeprefix(f"{slot}."): v for n, v in p.items() if n.startswith(f"{slot}.")}, axis)
        for slot, axis in (("gyro", "y"), ("accelerometers", "x"))
    )
    if rate is None or not rate.mean(60.0):
        return []
    rate = replace(rate, bias=max(rate.bias, bias))
    rows: list[list[Any]] = []
    for minutes in MINUTES:
        T = 60.0 * minutes
        tilt = level(force, gravity, T) if force else None
        values = [heading(rate, latitude, T, two=False, tilt=tilt or 0.0), heading(rate, latitude, T)]
        shown: list[Any] = [x / DEG if x < MOST else None for x in values]
        rows.append([minutes, *shown, tilt / ARCMIN if tilt is not None else None])
    caption = (
        "Standard deviations by bias, white noise, flicker and random walk of the instruments, closed form, of "
        f"readings without moves; empty: beyond {plain(MOST / DEG, 3)}°"
    )
    head = ["t / min", "σ(ψ), one position / °", "σ(ψ), two positions / °", "σ(tilt), one position / ′"]
    times: list[list[Any]] = []
    for goal in GOALS:
        found = [reached_after(rate, latitude, goal * DEG, two=two) for two in (False, True)]
        times.append([goal, *(None if t is None else t / 60.0 for t in found)])
    return [
        Table("after", "Heading and level after minutes", caption, head, rows),
        Table("after.reached", "Time to a heading", "By the same errors; empty: never, in a day",
              ["σ(ψ) / °", "one position / min", "two positions / min"], times),
    ]  # fmt: skip


def methods_table(density: float, time: float, settle: float, latitude: float, psi: float) -> list[Table]:
    """Return what each method reaches in the same total time (s) with the white noise of this gyro; [] without both."""
    if not density > 0.0 or not time > 0.0:
        return []
    rows: list[list[Any]] = []
    for method in plans.PARTS:
        reading = time - plans.overhead(method, 12, False, settle, 1e-3)
        sigma = plans.reached(method, density, latitude, psi, reading) / ARCMIN if reading > 0.0 else None
        strapdown = method.startswith("strapdown")
        needs = "two gyro axes" if strapdown else "one gyro axis"
        bias = "stays in the heading" if method == "strapdown" else "removed"
        tilt = "measured" if strapdown or method == "tilt" else "taken for level"
        rows.append([method, reading, sigma, needs, bias, tilt])
    caption = (
        f"Standard deviation of the heading by white noise of {plain(density / DPH, 3)} °/h/√Hz, closed form, in the "
        "same total time, moves of the head included"
    )
    head = ["method", "time of readings / s", "σ(ψ) / ′", "needs", "bias of the gyro", "tilt of the head"]
    return [Table("methods", "Methods in the same time", caption, head, rows)]
