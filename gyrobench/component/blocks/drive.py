"""Drives of a table axis: square-law motor with root shaper, DC torque motor with current loop, tachometer."""

from __future__ import annotations

from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Parameter
from gyrobench.component.math import Number, clip, exp, fabs, sign, sin, sqrt


class SquareLawMotor(Block):
    """AC torque motor, whose torque goes with the square of its voltage, and its root shaper.

        M = K V |V|        V = U - K_e rate        lag U' = U_d - U        |U_d| <= U_max
        U_d = sgn(d) sqrt(|d| / K) + offset        shaper = 1: M = demand d up to K U_max2
        U_d = d / (K U_max)                        shaper = 0: M = d |d| / (K U_max2), no gain about zero

    The demand is held over a step and U follows exactly.  Root, lag and square together are homogeneous of degree one:
    the phase does not depend on the amplitude.  About d = 0 none of them has a derivative, so a linear model taken at
    null shows no gain.

    Not modelled: the carrier (a lag stands for it), ripple at twice its frequency, heating.
    Source: Hu 1981, eq. 5-1 with ET1; [MOTOR-SQUARELAW].
    """

    K = Parameter(9.80665e-4, "N.m/V2", "torque per square of the voltage", above=0.0)
    U_max = Parameter(100.0, "V", "largest voltage", above=0.0)
    K_e = Parameter(0.0, "V.s/rad", "back EMF constant", min=0.0)
    lag = Parameter(5e-4, "s", "lag of amplifier and carrier", above=0.0)
    shaper = Parameter(1, int, "root shaper: 1 torque = demand, 0 none, square law", min=0, max=1)
    offset = Parameter(0.0, "V", "error of a mistrimmed root shaper, added to its voltage")

    U = Discrete(0.0, "V", "voltage of the motor")
    M = Discrete(0.0, "N.m", "torque at the end of the step")
    M_mean = Discrete(0.0, "N.m", "torque at the mean voltage of the step")
    limited = Discrete(0.0, "1", "1: the voltage is at its limit")
    h_last = Discrete(0.0, "s", "internal step of the two values below")
    stay = Discrete(1.0, "1", "share of a voltage that is left after a step")
    mean = Discrete(1.0, "1", "mean share over the step")

    def shaped(self, demand: Number) -> Number:
        """Return the voltage, without its limit, for a demanded torque."""
        if self.shaper == 1.0:
            return sign(demand) * sqrt(fabs(demand) / self.K) + self.offset
        return demand / (self.K * self.U_max)

    def torque(self, voltage: Number, rate: Number) -> Number:
        net = voltage - self.K_e * rate
        return self.K * net * fabs(net)

    def advance(self, demand: Number, rate: Number) -> None:
        """Move the motor over one internal step with this demand and this rate against the base."""
        if self.h != self.h_last:
            self.h_last = self.h
            self.stay = exp(-self.h / self.lag)
            self.mean = (1.0 - self.stay) * self.lag / self.h
        wanted = self.shaped(demand)
        goal = clip(wanted, -self.U_max, self.U_max)
        self.limited = 1.0 if wanted != goal else 0.0
        self.M_mean = self.torque(goal + self.mean * (self.U - goal), rate)
        self.U = goal + self.stay * (self.U - goal)
        self.M = self.torque(self.U, rate)


class DcMotor(Block):
    """DC torque motor with a current loop, cogging and torque ripple.

        L i' = U - R i - K_e rate        |U| <= U_max
        U = L b (i_d - i) + q            q' = R b (i_d - i)            i_d = clip(demand / K_t, +-i_max)
        M = K_t i (1 + ripple sin(n_r x + phase_r)) + cogging sin(n_c x + phase_c)

    The controller cancels the pole of the winding: i follows i_d with the bandwidth b.  Demand and rate are held over a
    step and the current is exact; while the voltage is limited, q follows R i + K_e rate (no wind-up).  K_e = K_t in
    V.s/rad for a motor without losses.

    Not modelled: switching of the amplifier, temperature of winding and magnets, static friction of brushes.
    Source: own design; torque of the outer axis: Hu 1981, section 5.4; [MOTOR-DC].
    """

    K_t = Parameter(2.98, "N.m/A", "torque constant", above=0.0)
    K_e = Parameter(2.98, "V.s/rad", "back EMF constant", min=0.0)
    R = Parameter(4.0, "Ohm", "resistance of the winding", above=0.0)
    L = Parameter(0.02, "Ohm.s", "inductance of the winding (1 H = 1 Ohm.s)", above=0.0)
    U_max = Parameter(48.0, "V", "largest voltage", above=0.0)
    i_max = Parameter(5.0, "A", "largest current", above=0.0)
    bandwidth = Parameter(3000.0, "rad/s", "bandwidth b of the current loop", above=0.0)
    cogging = Parameter(0.0, "N.m", "cogging torque, amplitude", min=0.0)
    cogging_cycles = Parameter(72, int, "its cycles per turn", min=1, max=100000)
    cogging_phase = Parameter(0.0, "rad", "its phase at angle 0")
    ripple = Parameter(0.0, "1", "torque ripple, amplitude as a share of the torque", min=0.0, below=1.0)
    ripple_cycles = Parameter(36, int, "its cycles per turn", min=1, max=100000)
    ripple_phase = Parameter(0.0, "rad", "its phase at angle 0")

    i = Discrete(0.0, "A", "current")
    q = Discrete(0.0, "V", "integral part of the controller")
    U = Discrete(0.0, "V", "voltage of the motor")
    M = Discrete(0.0, "N.m", "torque at the end of the step")
    M_mean = Discrete(0.0, "N.m", "torque with the mean current of the step")
    limited = Discrete(0.0, "1", "1: current demand or voltage is at its limit")
    h_last = Discrete(0.0, "s", "internal step of the values below")
    stay_b = Discrete(1.0, "1", "share of an error of the current that is left after a step")
    mean_b = Discrete(1.0, "1", "mean share over the step")
    stay_a = Discrete(1.0, "1", "share of a current that is left after a step without voltage")
    mean_a = Discrete(1.0, "1", "mean share over the step")

    def start(self) -> None:
        self.refuse(
            self.bandwidth * self.L < 1.5 * self.R,
            "{self}_bandwidth = {bandwidth} rad/s must be at least 1.5 R / L, R = {R} Ohm, L = {L} Ohm.s: a current "
            "loop is faster than the winding",
        )

    def torque(self, i: Number, x: Number) -> Number:
        """Return the torque of a current at the angle x."""
        m = self.K_t * i
        if self.ripple > 0.0:
            m = m * (1.0 + self.ripple * sin(self.ripple_cycles * x + self.ripple_phase))
        if self.cogging > 0.0:
            m = m + self.cogging * sin(self.cogging_cycles * x + self.cogging_phase)
        return m

    def advance(self, demand: Number, rate: Number, x: Number) -> None:
        """Move the motor over one internal step with this demand and rate against the base; x: angle at its end."""
        a = self.R / self.L
        if self.h != self.h_last:
            self.h_last = self.h
            self.stay_a = exp(-self.h * a)
            self.mean_a = (1.0 - self.stay_a) / (self.h * a)
            self.stay_b = exp(-self.h * self.bandwidth)
            self.mean_b = (1.0 - self.stay_b) / (self.h * self.bandwidth)
        wanted = demand / self.K_t
        goal = clip(wanted, -self.i_max, self.i_max)
        emf = self.K_e * rate
        off = goal - self.i
        U = self.L * self.bandwidth * off + self.q
        self.limited = 1.0 if wanted != goal or fabs(U) > self.U_max else 0.0
        before = self.i
        i_mean = before
        if fabs(U) > self.U_max:
            free = (sign(U) * self.U_max - emf) / self.R  # where the current would go at the limit
            self.i = free + self.stay_a * (before - free)
            i_mean = free + self.mean_a * (before - free)
            if (goal - self.i) * off < 0.0:  # past the goal within the step: the loop has stopped it there
                self.i = goal
                i_mean = 0.5 * (before + goal)
            self.q = self.R * self.i + emf
        else:
            lacking = self.q - self.R * before - emf
            c = lacking / (self.L * (self.bandwidth - a))
            self.i = goal - self.stay_b * off + c * (self.stay_a - self.stay_b)
            i_mean = goal - self.mean_b * off + c * (self.mean_a - self.mean_b)
            self.q = self.stay_a * lacking + self.R * self.i + emf
        self.U = clip(self.L * self.bandwidth * (goal - self.i) + self.q, -self.U_max, self.U_max)
        self.M = self.torque(self.i, x)
        self.M_mean = self.torque(i_mean, x - 0.5 * self.h * rate)


class TachometerReading(Block):
    """Tachometer of a table axis: reading = rate (1 + scale_error) (1 + ripple sin(cycles x + phase)).

    Not modelled: noise and lag of the tachometer.
    Source: own design; [TACHOMETER].
    """

    scale_error = Parameter(0.0, "1", "error of its scale factor, as a share", above=-1.0)
    ripple = Parameter(0.0, "1", "ripple, amplitude as a share of the rate", min=0.0, below=1.0)
    cycles = Parameter(72, int, "its cycles per turn", min=1, max=100000)
    phase = Parameter(0.0, "rad", "its phase at angle 0")

    def read(self, rate: Number, x: Number) -> Number:
        """Return the reading at the angle x."""
        wave = 1.0 + self.ripple * sin(self.cycles * x + self.phase) if self.ripple > 0.0 else 1.0
        return rate * (1.0 + self.scale_error) * wave
