"""Closed forms of an axis with a floated two-degree-of-freedom gyro, ideal motor and lag-lead network.

    J_x th'' = M - K_m K_x G(s) th,     G = K_G (1 + tau1 s)(1 + tau2 s) / ((1 + T1 s)(1 + T2 s))

[STAB-FLOATED-2DOF; GSP ch. 5, eq. 5-24..5-26, corrected by EG7, EG8]  What 5-25 prints as theta/M,
K_m K_x / (J_x s2), is the loop gain without network; theta/M is 1/(J_x s2 + K_m K_x G).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


def crossover(gain: Callable[[complex], complex]) -> float:
    """Return the frequency, rad/s, at which |gain| falls through 1."""
    low, high = 1e-6, 1e6
    for _ in range(200):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if abs(gain(1j * middle)) > 1.0 else (low, middle)
    return low


@dataclass(frozen=True)
class LagLeadLoop:
    """J: kg.m2; K: K_m K_x K_G, torque per angle at rest, N.m/rad; time constants in s, T1 and T2 above 0."""

    J: float
    K: float
    tau1: float
    T1: float
    tau2: float
    T2: float

    @property
    def rest(self) -> float:
        """Return torque per angle at rest, N.m/rad."""
        return self.K

    def network(self, s: Any) -> Any:
        """Return G / K_G at s, rad/s."""
        return (1.0 + self.tau1 * s) * (1.0 + self.tau2 * s) / ((1.0 + self.T1 * s) * (1.0 + self.T2 * s))

    def gain(self, s: Any) -> Any:
        """Return the loop gain L = K_m K_x G / (J_x s2)."""
        return self.K * self.network(s) / (self.J * s * s)

    def compliance(self, s: Any) -> Any:
        """Return theta/M, rad/(N.m): 1 / (J_x s2 + K_m K_x G); at rest 1/K, which a lag of finite T1 leaves."""
        return 1.0 / (self.J * s * s + self.K * self.network(s))

    def isolation(self, s: Any, drag: float) -> Any:
        """Return platform over base angle, when a torque ``drag`` (N.m.s/rad) times the rate against the base acts."""
        return drag * s / (self.J * s * s + drag * s + self.K * self.network(s))

    def limit(self) -> tuple[float, float] | None:
        """Return where the phase of L is -180 degrees: frequency, rad/s, and share of K at the limit of the loop.

        G is real where (t)(1 - T w2) = (T')(1 - tau w2), t = tau1 + tau2, T' = T1 + T2, tau = tau1 tau2, T = T1 T2;
        there G/K_G = t/T'.  A share below 1: the loop is conditionally stable, unstable when its gain falls below.
        The same as the Routh table of the fourth-order equation.  None: no such frequency.
        """
        t, big = self.tau1 + self.tau2, self.T1 + self.T2
        below = big * self.tau1 * self.tau2 - t * self.T1 * self.T2
        if below == 0.0 or not (big - t) / below > 0.0 or t == 0.0:
            return None
        w = math.sqrt((big - t) / below)
        return w, self.J * w * w * big / (t * self.K)

    def stable(self) -> bool:
        """Return whether, by Routh, there is the net lead that two integrations need, and a gain above a limit."""
        t, big = self.tau1 + self.tau2, self.T1 + self.T2
        below = big * self.tau1 * self.tau2 - t * self.T1 * self.T2
        return self.K * t * below > self.J * big * (big - t)

    def margin(self) -> tuple[float, float]:
        """Return crossover (rad/s) and phase margin (degrees); |L| falls with the frequency: there is one."""
        w = crossover(self.gain)
        turn = sum(math.atan(x * w) for x in (self.tau1, self.tau2)) - sum(math.atan(x * w) for x in (self.T1, self.T2))
        return w, math.degrees(turn)

    def slope(self, w: float) -> float:
        """Return d 20 log|L| / d log10 w at w, dB per decade: -40 without the network."""
        lead = sum((x * w) ** 2 / (1.0 + (x * w) ** 2) for x in (self.tau1, self.tau2))
        lag = sum((x * w) ** 2 / (1.0 + (x * w) ** 2) for x in (self.T1, self.T2))
        return 20.0 * (lead - lag - 2.0)


@dataclass(frozen=True)
class DoubleLoop:
    """Position loop by the gyro around a rate loop by a tachometer.  [STAB-TWO-LOOP]

        J_x th'' = M - K (1 + integral/s) th - D (th' - th_b')        K = k K_v K_p K_x,  D = k K_v,  k: motor, N.m/V

    L = K (1 + integral/s) / (s (J_x s + D)).  The tachometer measures against the base: D is a drag, too.
    """

    J: float
    D: float
    K: float
    integral: float = 0.0

    @property
    def rest(self) -> float | None:
        """Return torque per angle at rest, N.m/rad; None with an integral, which leaves no angle."""
        return None if self.integral else self.K

    def network(self, s: Any) -> Any:
        """Return the integral part at s, rad/s."""
        return 1.0 + self.integral / s

    def gain(self, s: Any) -> Any:
        """Return the loop gain L of the position loop, the rate loop closed."""
        return self.K * self.network(s) / (s * (self.J * s + self.D))

    def isolation(self, s: Any, drag: float) -> Any:
        """Return platform over base angle; ``drag`` is that of friction and back EMF, beside the tachometer's D."""
        c = self.D + drag
        return c * s / (self.J * s * s + c * s + self.K * self.network(s))

    def limit(self) -> None:
        """Return None: by Routh, D/J > integral, whatever K."""
        return None

    def stable(self) -> bool:
        """Return whether D/J > integral."""
        return self.J * self.integral < self.D and self.K > 0.0

    def margin(self) -> tuple[float, float]:
        """Return crossover (rad/s) and phase margin (degrees) of the position loop."""
        w = crossover(self.gain)
        return w, 90.0 - math.degrees(math.atan(self.J * w / self.D) + math.atan(self.integral / w))

    def slope(self, w: float) -> float:
        """Return d 20 log|L| / d log10 w at w, dB per decade."""
        inertia = (self.J * w / self.D) ** 2
        return -20.0 * (1.0 + inertia / (1.0 + inertia) + self.integral**2 / (w * w + self.integral**2))


def double_gains(J: float, k: float, K_x: float, rate: float, position: float, integral: float) -> tuple[float, float]:
    """Return K_p (rad/s/V) and K_v (V.s/rad) that put the crossovers of rate and position loop (rad/s) where asked.

    k: motor, N.m/V; K_x: pickoff, V/rad; integral: corner, rad/s.
    """
    size = math.hypot(position, rate) / rate * position / math.hypot(1.0, integral / position)
    return size / K_x, J * rate / k


def rc_times(R1: float, C1: float, R2: float, C2: float) -> tuple[float, float, float, float]:
    """Return tau1, T1, tau2, T2 (s) of the RC network of fig. 5-7: R1 beside C1 in series, R2 with C2 to ground.

        G = (1 + R1 C1 s)(1 + R2 C2 s) / ((1 + R1 C1 s)(1 + R2 C2 s) + R1 C2 s)

    R: Ohm, C: F; driven by a voltage, without load.  The lag is that of R2, C2.  T1 T2 = tau1 tau2, T1 + T2 = tau1 +
    tau2 + R1 C2.
    """
    tau1, tau2 = R2 * C2, R1 * C1
    half = 0.5 * (tau1 + tau2 + R1 * C2)
    T1 = half + math.sqrt(half * half - tau1 * tau2)
    return tau1, T1, tau2, tau1 * tau2 / T1


def rc_values(tau1: float, T1: float, tau2: float, T2: float, C2: float) -> tuple[float, float, float] | None:
    """Return R1 (Ohm), C1 (F), R2 (Ohm) beside C2 of the passive network with these times.

    None where no passive one has them: T1 T2 = tau1 tau2 (to 0.1 %) and T1 + T2 > tau1 + tau2 are needed.
    """
    R1 = (T1 + T2 - tau1 - tau2) / C2
    if not R1 > 0.0 or not tau2 > 0.0 or not math.isclose(T1 * T2, tau1 * tau2, rel_tol=1e-3):
        return None
    return R1, tau2 / R1, tau1 / C2
