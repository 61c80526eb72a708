"""Closed forms of the servo loop of a table: open loop, stiffness, compliance, gain limits.  [TABLE-SERVO, ET5]

    L(s) = G K_g H C(s) / ( s [(J s + D)(J_g s + c) + H2] (1 + lag s) )        K_T = G K_g H / c
    theta / M = (J_g s + c) / ( s [(J s + D)(J_g s + c) + H2] ) / (1 + L)      float angle at rest M / (G K_g)
    C(s) = prod (1 + s / zero) / (1 + s / pole)                               |L(j w_c)| = 1 gives G

The spin momentum H couples table and float; theta is the inertial angle of the table, M a torque on it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

GCM = 9.80665e-5  # N.m
LEAD = {1: (4.0, 4.0), 2: (5.0, 5.0), 3: (28.0, 28.0), 4: (6.5, 6.5, 6.5)}  # ratio pole / zero of the leads
LAGGING = (1, 2)  # networks with a lag-lead (1 + s / w_l) / (1 + 5 s / w_l), w_l = w_c / 12
NAMES = ("table.J", "table.viscous", "table.lag", "table.torque_max", "gyro.H", "gyro.J", "gyro.C", "gyro.K_sg")


@dataclass(frozen=True)
class ServoLoop:
    """The loop of one network (1 to 4) about its gain crossover w_c, rad/s."""

    network: int
    w_c: float
    J: float
    viscous: float
    lag: float
    torque_max: float
    H: float
    J_g: float
    c: float
    K_g: float

    def network_gain(self, s: Any) -> Any:
        """Return C(s), of a number or of control.tf("s"), as of the following."""
        value: Any = 1.0
        for r in LEAD[self.network]:
            value *= (1.0 + math.sqrt(r) * s / self.w_c) / (1.0 + s / (math.sqrt(r) * self.w_c))
        if self.network in LAGGING:
            value *= (1.0 + 12.0 * s / self.w_c) / (1.0 + 60.0 * s / self.w_c)
        return value

    def plant(self, s: Any) -> Any:
        """Return s [(J s + D)(J_g s + c) + H2]."""
        return s * ((self.J * s + self.viscous) * (self.J_g * s + self.c) + self.H**2)

    @cached_property
    def gain(self) -> float:
        """Return G, N.m/V."""
        s = 1j * self.w_c
        return float(abs(self.plant(s) * (1.0 + self.lag * s) / (self.K_g * self.H * self.network_gain(s))))

    def open_loop(self, s: Any) -> Any:
        """Return L(s)."""
        return self.gain * self.K_g * self.H * self.network_gain(s) / (self.plant(s) * (1.0 + self.lag * s))

    @property
    def stiffness(self) -> float:
        """Return K_T, N.m per rad of the table."""
        return self.gain * self.K_g * self.H / self.c

    def compliance(self, s: complex) -> complex:
        """Return table angle per torque, rad/(N.m)."""
        return complex((self.J_g * s + self.c) / self.plant(s) / (1.0 + self.open_loop(s)))

    def at_rest(self, torque: float) -> float:
        """Return the static table angle under a torque."""
        return torque / self.stiffness

    def transfer_function(self) -> Any:
        """Return L as a control.TransferFunction."""
        import control

        return self.open_loop(control.tf("s"))

    def limits(self) -> list[tuple[float, float]]:
        """Return (Hz, factor) of all gains that bring the loop to its limit, by rising frequency.

        control.stability_margins with returnall; control.margin alone would hide the lower limit of a conditionally
        stable loop.  A limit 100 dB below is an artefact of the resonance of an undamped gyro.
        """
        import control

        factors, _, _, at, _, _ = control.stability_margins(self.transfer_function(), returnall=True)
        pairs = zip(np.atleast_1d(at), np.atleast_1d(factors), strict=True)
        return sorted((float(w) / (2.0 * math.pi), float(g)) for w, g in pairs if g > 1e-5)

    def phase_margin(self) -> float:
        """Return degrees."""
        value = self.open_loop(1j * self.w_c)
        return math.degrees(math.atan2(value.imag, value.real)) % 360.0 - 180.0

    def poles(self, gain: float = 1.0) -> NDArray[np.complex128]:
        """Return the poles of the closed loop with the gain times ``gain``."""
        L = gain * self.transfer_function()
        return np.asarray((1 + L).zeros())


def loop_of(p: Mapping[str, Any]) -> ServoLoop | None:
    """Return the loop of these parameters; None where they do not have it (own networks, another table or gyro)."""
    if any(n not in p for n in NAMES) or p.get("table.stiffness") or int(p.get("table.network", 0)) not in LEAD:
        return None
    J, viscous, lag, most, H, J_g, c, K_g = (float(p[n]) for n in NAMES)
    return ServoLoop(int(p["table.network"]), float(p["table.crossover"]), J, viscous, lag, most, H, J_g, c, K_g)


def sense_torque(p: Mapping[str, Any], rate: float) -> float | None:
    """Return the torque (N.m) on a table that turns at a rate, of slip rings and bearing; None without those parts."""
    of_rings = ("K_s", "k_w", "friction", "follower")
    of_bearing = ("viscosity", "diameter", "length", "gap", "eccentricity", "inner", "outer", "thrust_gap", "eddy")
    names = [f"rings.ring_{n}" for n in of_rings] + [f"bearing.air_{n}" for n in of_bearing]
    if any(n not in p for n in names):
        return None
    K_s, k_w, friction, follower, mu, D, length, gap, eccentricity, r1, r2, faces, eddy = (float(p[n]) for n in names)
    drag = math.pi * mu * D**3 * length / (4.0 * gap * math.sqrt(1.0 - eccentricity**2))
    drag += math.pi * mu * (r2**4 - r1**4) / faces + eddy
    return friction * (k_w / (K_s + k_w) if follower else 1.0) + drag * rate
