"""Expected motion of a table that a gyro controls: rate at an angle, time of a turn, angle at which it stays.

    theta' = omega_d - omega_E,x        omega_d = drift(X, Y, Z) at the angle theta      [MEAS-SERVO; Hu 1981, eq. 3-59]

The drift is that of the gyro in the slot, as far as its part tells it; random drift and the turn-on bias are not in it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gyrobench import drift, frames, units
from gyrobench.arrays import Array
from gyrobench.attitudes import on_servo_table
from gyrobench.units import ARCSEC

POINTS = 720  # of a turn at which its rate is looked at


@dataclass(frozen=True)
class Expected:
    """Site and drift of a gyro on a servo table.

    latitude (rad), earth_rate (rad/s), g (g/g0); drift: coefficient -> rad/s per g0^n, those of gyrobench.drift.
    """

    latitude: float
    earth_rate: float = frames.EARTH_RATE
    g: float = 1.0
    drift: Mapping[str, float] = field(default_factory=dict)

    def rates(self, attitude: str, angle: ArrayLike = 0.0) -> tuple[Array, Array]:
        """Return the drift and the Earth rate along the input axis (n,), rad/s, in an attitude at table angles (n,)."""
        a = np.atleast_1d(np.asarray(angle, dtype=float))
        axes = on_servo_table(attitude, self.latitude)
        x, y, z = axes @ np.array([0.0, 0.0, -self.g])
        c, s = np.cos(a), np.sin(a)
        X = drift.regressors(np.column_stack([np.full_like(a, x), c * y + s * z, c * z - s * y]), drift.NAMES)
        earth = axes[0] @ frames.earth_rate_local(self.latitude, self.earth_rate)
        return X @ np.array([self.drift.get(n, 0.0) for n in drift.NAMES]), np.full_like(a, earth)

    def table_rate(self, attitude: str, angle: ArrayLike = 0.0) -> Array:
        """Return the rate of the table against its base (n,), rad/s."""
        omega_d, earth = self.rates(attitude, angle)
        return omega_d - earth

    def travel_time(self, attitude: str, start: float, travel: float) -> float:
        """Return the s that ``travel`` rad from the angle ``start`` take; inf where the table comes to rest before."""
        if not travel > 0.0:
            return 0.0
        way, first = self._way(attitude, start, travel)
        rate = self.table_rate(attitude, start + first * way)
        return math.inf if np.min(first * rate) <= 0.0 else float(np.mean(1.0 / np.abs(rate)) * travel)

    def rest_angle(self, attitude: str, start: float, travel: float) -> float:
        """Return the angle, rad, at which drift and Earth rate balance on the way of :meth:`travel_time`."""
        way, first = self._way(attitude, start, travel)
        angle = start + first * way
        return float(angle[int(np.argmax(first * self.table_rate(attitude, angle) <= 0.0))])

    def _way(self, attitude: str, start: float, travel: float) -> tuple[Array, float]:
        """Return middles of equal steps of the way, and the sense in which it begins."""
        n = max(16, math.ceil(POINTS * travel / (2.0 * math.pi)))
        first = float(self.table_rate(attitude, start)[0])
        return (np.arange(n) + 0.5) * travel / n, math.copysign(1.0, first)


def capture_problems(
    parameters: Mapping[str, Any], rates: Mapping[str, tuple[float, float]], table: str = "table"
) -> list[str]:
    """Return why a table would not capture its gyro: the tachometer and friction hold it out of capture_angle.

    rates: where -> drift and Earth rate along the input axis, rad/s.  [CTRL-CAPTURE]
    """
    names = ("J", "capture", "capture_rate", "capture_damping", "capture_angle", "friction")
    values = [parameters.get(f"{table}.{n}") for n in names]
    if None in values:
        return []
    J, capture, natural, damping, limit, friction = (float(v) for v in values)  # type: ignore[arg-type]
    if not capture:
        return []
    away = {}
    for where, (omega_d, earth) in rates.items():
        torque = -friction * math.copysign(1.0, omega_d - earth)
        away[where] = abs(torque / (J * natural**2) - 2.0 * damping * omega_d / natural)
    where = max(away, key=lambda n: away[n], default="")
    if not where or away[where] <= limit:
        return []
    return [
        f"{where}: {table} would not capture the gyro: a drift of {rates[where][0] / units.DPH:.3g} °/h and friction "
        f"keep it {away[where] / ARCSEC:.3g}″ from null, {table}.capture_angle = {limit / ARCSEC:.3g}″ is allowed; "
        f"raise {table}.capture_rate, or lower {table}.capture_damping"
    ]
