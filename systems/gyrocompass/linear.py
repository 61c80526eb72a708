"""Gyrocompass in small tilts: roots, settled heading error, response to a manoeuvre, rolling error.  [GYROCOMPASS]

    az' = w_U - (w_N cos az - V_N/R sin az) el - (mgl a - C x)/H       a = (f_U el + f_N cos az + f_E sin az)/g0
    el' = V_N/R cos az + w_N sin az - D a/H + (mgl a - C x) s/H        x' = (a - x)/T

a is the apparent tilt, s the swing of the element under the specific force across the axis.  The roots are those of
small azimuths.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, optimize

from gyrobench.arrays import Array
from gyrobench.frames import G0

Roots = NDArray[np.complex128]


LIQUID = 0.45  # largest damping ratio that a liquid gives


@dataclass(frozen=True)
class Steaming:
    """Course (rad, clockwise), speed (m/s) and latitude (rad) of a ship."""

    course: float
    speed: float
    latitude: float

    @property
    def north(self) -> float:
        return self.speed * math.cos(self.course)

    @property
    def east(self) -> float:
        return self.speed * math.sin(self.course)


def liquid_share(damping_ratio: float) -> float:
    """Return C/(mgl + H w_N) of a liquid with T = 1/Omega that gives this damping ratio to the oscillation.

    With z = s/Omega: z^3 + z^2 + z + 1 - C/(mgl + H w_N) = 0.
    """

    def excess(share: float) -> float:
        roots = _liquid_roots(share)
        z = roots[np.argmax(roots.imag)]
        return float(-z.real / abs(z)) - damping_ratio

    return float(optimize.brentq(excess, 0.0, 0.95)) if damping_ratio < LIQUID else 0.95


def liquid_decay(share: float) -> float:
    """Return the slowest decay rate of such a compass over Omega."""
    return float(np.min(-_liquid_roots(share).real))


def _liquid_roots(share: float) -> Roots:
    return np.asarray(np.roots([1.0, 1.0, 1.0, 1.0 - share]), dtype=complex)


@dataclass(frozen=True)
class LinearCompass:
    """A compass on a ship, of the values of its part and of the ship's; SI."""

    H: float
    mgl: float
    D: float
    C: float
    T: float
    drift_az: float
    drift_el: float
    swing_period: float  # undamped
    swing_damping: float
    latitude_correction: float  # 1: on
    speed_correction: float
    latitude: float  # as set
    earth_rate: float
    radius: float
    gravity: float

    @classmethod
    def of(cls, p: Mapping[str, Any]) -> LinearCompass | None:
        """Return the compass of the parameters of a run; None where the part in the slot has other ones."""
        ship = ("earth_rate", "radius", "gravity")
        names = [f"{'ship' if f.name in ship else 'compass'}.{f.name}" for f in fields(cls)]
        return None if any(n not in p for n in names) else cls(*(float(p[n]) for n in names))

    @property
    def swing(self) -> float:
        """rad/s, undamped"""
        return 2.0 * math.pi / self.swing_period

    def rates(self, at: Steaming) -> tuple[float, float, float]:
        """Return w_N, w_U of the level axes of a steaming ship, and 2 w sin L + V_E tan L/R of its Coriolis force."""
        over = at.east * math.tan(at.latitude) / self.radius
        up = self.earth_rate * math.sin(at.latitude)
        return self.earth_rate * math.cos(at.latitude) + at.east / self.radius, up + over, 2.0 * up + over

    def roots(self, at: Steaming) -> Roots:
        """Return the roots s (rad/s) of the damped oscillation: two, or three with a liquid."""
        w_n = self.rates(at)[0]
        k, c, d = self.mgl / self.H + w_n, self.C / self.H, self.D / self.H
        cubic = [self.T, 1.0 + d * self.T, d + w_n * k * self.T, w_n * (k - c)]
        return np.asarray(np.roots([1.0, d, w_n * k] if c == 0.0 else cubic), dtype=complex)

    def omega(self, at: Steaming) -> float:
        """Return the frequency of the oscillation without damping, rad/s; the liquid is shut."""
        w_n = self.rates(at)[0]
        return math.sqrt((self.mgl / self.H + w_n) * w_n)

    def settled(self, at: Steaming) -> tuple[float, float]:
        """Return azimuth and tilt in which the axis comes to rest; the azimuth in full, not of small angles."""
        w_n, w_u, coriolis = self.rates(at)
        f_n, swing = coriolis * at.east, -coriolis * at.north / G0
        stiffness = (self.mgl - self.C) / self.H
        apparent = (w_u + self.drift_az + w_n * f_n / G0) / (w_n + stiffness)
        east = -at.north / self.radius
        pull = ((self.D / self.H - stiffness * swing) * apparent - self.drift_el) / math.hypot(w_n, east)
        azimuth = math.atan2(east, w_n) + math.asin(max(-1.0, min(1.0, pull)))
        return azimuth, apparent - f_n / G0

    def shown(self, azimuth: Array | float, at: Steaming) -> Any:
        """Return the heading shown less the true one, with the corrections that are on."""
        error = -np.asarray(azimuth)
        north = self.earth_rate * math.cos(self.latitude)
        if self.latitude_correction > 0.5:
            error = error + self.D * math.tan(self.latitude) / (self.mgl + self.H * north)
        if self.speed_correction > 0.5:
            sine = at.speed * np.cos(at.course + error) / (self.radius * north)
            error = error - np.arcsin(np.clip(sine, -1.0, 1.0))
        return error

    def settled_error(self, at: Steaming) -> float:
        return float(self.shown(self.settled(at)[0], at))

    def response(
        self, t: Array, course: Array, speed: Array, latitude: float, start: Array, cut: bool = False
    ) -> Array:
        """Return azimuth, tilt and liquid (n, 3), rad, of a ship with these courses and speeds from a state on."""
        north, east = speed * np.cos(course), speed * np.sin(course)
        gained_n, gained_e = np.gradient(north, t), np.gradient(east, t)
        open_, n = 0.0 if cut else 1.0, self.swing

        def flow(now: float, y: Array) -> list[float]:
            v_n, v_e, a_n, a_e = (float(np.interp(now, t, x)) for x in (north, east, gained_n, gained_e))
            w_n, w_u, coriolis = self.rates(Steaming(math.atan2(v_e, v_n), math.hypot(v_n, v_e), latitude))
            f_n, f_e = a_n + coriolis * v_e, a_e - coriolis * v_n
            c, s = math.cos(y[0]), math.sin(y[0])
            a = (self.gravity * y[1] + f_n * c + f_e * s) / G0
            torque = (self.mgl * a - self.C * y[2]) / self.H
            return [
                w_u - (w_n * c - v_n / self.radius * s) * y[1] - torque + self.drift_az,
                v_n / self.radius * c + w_n * s - open_ * self.D / self.H * a + torque * y[3] + self.drift_el,
                open_ * (a - y[2]) / self.T,
                y[4],
                n * n * ((f_e * c - f_n * s) / G0 - y[3]) - 2.0 * self.swing_damping * n * y[4],
            ]

        first = [*start, -self.rates(Steaming(course[0], speed[0], latitude))[2] * north[0] / G0, 0.0]
        longest = float(t[-1] - t[0]) / 100.0
        way = integrate.solve_ivp(flow, (t[0], t[-1]), first, t_eval=t, rtol=1e-8, atol=1e-12, max_step=longest)
        return np.asarray(way.y[:3].T)

    def rolling(self, at: Steaming, acceleration: float, frequency: float) -> float:
        """Return the azimuth at rest under a sine of acceleration across the ship (amplitude, m/s2; Hz).

        The element swings by s = Re G a_e/g in phase with a_e, so that the pendulum's torque has the mean mgl <a_h s>/g
        about the vertical, and with the one of the damping the azimuth moves by -(mgl/H w_N)(1 + (D/mgl)^2) <a_h s>/g;
        a_h, a_e along the axis and across it, as it then lies.
        """
        w, n, rest = 2.0 * math.pi * frequency, self.swing, self.settled(at)[0]
        in_phase = float((n * n / (n * n - w * w + 2j * self.swing_damping * n * w)).real)
        size = self.mgl / (self.H * self.rates(at)[0]) * (1.0 + (self.D / self.mgl) ** 2)
        size *= 0.25 * (acceleration / G0) ** 2 * in_phase

        def moved(azimuth: float) -> float:
            return rest + size * math.sin(2.0 * (at.course - azimuth)) - azimuth

        return float(optimize.brentq(moved, rest - abs(size) - 1e-9, rest + abs(size) + 1e-9))
