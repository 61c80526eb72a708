from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter
from gyrobench.component.math import clip


class StabilizerPower(Component):
    """Correction motor of a power gyro stabilizer: precession angle in, torque out.  [STAB-POWER-2DOF]

        e = polarity u + test,     polarity u = k_u b     potentiometer on the precession axis
        v = -k_i e,       limited to +-v_max              amplifier
        M = ratio k_m v + M_load                          motor behind its reducer, on the stabilised axis

    In the linear range M = -K_m b + M_load with K_m = ratio k_u k_i k_m (N.m/rad).  k_u is given for a check of the
    loop: with the gyro's H, J_x, J_y, C_x, C_y given too (H_g > 0), a K_m beyond the Routh limit

        K_m < (C_x / J_x + C_y / J_y) (H + C_x C_y / H)

    is refused unless allow_unstable = 1.  M_load is what else acts on the axis, added here because the axis of the gyro
    takes one torque.

    Not modelled: motor time constant, back EMF, friction and play of the reducer (its inertia belongs to J_x).
    Source: GSP ch. 5, eq. 5-5, 5-7, 5-20..5-23; the limit in its exact form (STAB-POWER-2DOF).
    """

    version = "1.0.0"

    k_u = Parameter(10.0, "V/rad", "potentiometer: voltage per precession angle (of the gyro's pickoff)", above=0.0)
    polarity = Parameter(1, int, "1: u = +k_u b; -1: u = -k_u b, the pickoff of a gyro", min=-1, max=1)
    k_i = Parameter(10.0, "1", "amplifier: voltage per voltage", above=0.0)
    k_m = Parameter(0.01, "N.m/V", "motor: torque per voltage", above=0.0)
    ratio = Parameter(100.0, "1", "reducer: torque on the axis per torque of the motor", above=0.0)
    v_max = Parameter(27.0, "V", "largest voltage of the amplifier", above=0.0)
    H_g = Parameter(0.0, "N.m.s", "gyro: spin angular momentum; 0: the loop is not checked", min=0.0)
    J_x = Parameter(0.5, "kg.m2", "gyro: inertia about the stabilised axis, with the load", above=0.0)
    J_y = Parameter(0.02, "kg.m2", "gyro: inertia about the precession axis", above=0.0)
    C_x = Parameter(0.0, "N.m.s/rad", "gyro: damping about the stabilised axis", min=0.0)
    C_y = Parameter(0.0, "N.m.s/rad", "gyro: damping about the precession axis", min=0.0)
    allow_unstable = Parameter(0, int, "1: a K_m beyond the Routh limit is allowed", min=0, max=1)

    u = Input(0.0, "V", "potentiometer voltage, +-k_u b")
    test = Input(0.0, "V", "test signal")
    M_load = Input(0.0, "N.m", "what else acts on the stabilised axis")

    v = Output("V", "voltage of the motor")
    e = Output("V", "polarity u + test")
    M = Output("N.m", "torque on the stabilised axis: motor and load")
    saturated = Output("1", "1 while the voltage is limited")

    K_m = Discrete(0.0, "N.m/rad", "stiffness of the correction")
    limit = Discrete(0.0, "N.m/rad", "its Routh limit")

    def start(self) -> None:
        self.refuse(self.polarity == 0.0, "polarity must be 1 or -1")
        self.K_m = self.ratio * self.k_u * self.k_i * self.k_m
        if self.H_g > 0.0:
            self.limit = (self.C_x / self.J_x + self.C_y / self.J_y) * (self.H_g + self.C_x * self.C_y / self.H_g)
            self.refuse(
                self.K_m >= self.limit and self.allow_unstable == 0.0,
                "K_m = ratio k_u k_i k_m = {K_m} N.m/rad is at or beyond the Routh limit {limit} N.m/rad: the loop "
                "is unstable; lower a gain, add damping, or set allow_unstable = 1",
            )

    def outputs(self) -> None:
        self.e = self.polarity * self.u + self.test
        unlimited = -self.k_i * self.e
        self.v = clip(unlimited, -self.v_max, self.v_max)
        self.M = self.ratio * self.k_m * self.v + self.M_load
        self.saturated = 1.0 if self.v != unlimited else 0.0
