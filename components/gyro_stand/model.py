from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import clip, fabs, maximum, minimum


class GyroStand(Component):
    """Electrical side of a gyro on its stand: wheel with its supply, excitation of the pickoff, voltage reference.

    Hysteresis motor with the torque M (U/U_0)^2 at any slip, drag D n; where the torque suffices at the synchronous
    speed n_s it locks there, and falls out where it does not any more:                             [TEST-START-UP]

        J_w n' = M (U/U_0)^2 - D n                 on, not locked; from rest n_s is reached after
                                                   t = -(J_w/D) ln(1 - D n_s / (M (U/U_0)^2))
        n = n_s                                    locked
        J_w n' = -D n - M_b                        off, brake on: at rest after t = (J_w/D) ln(1 + D n / M_b)
        current = (U/U_0) (I_0 + I_M m),   m = 1 while slipping, locked the share D n_s / (M (U/U_0)^2) of the torque

    Pickoff: u_out = u + offset + noise with excitation, offset + noise without.  U is the share `supply` of U_0,
    `drop` after it was switched on the share `dropped`.  The torquer gets i_out = polarity i, -1: leads reversed.

    Not modelled: hunting of the wheel, phases of the supply, heat of the wheel, momentum of the gyro that grows with n
    (the gyro in the slot has the whole H from the start), rise time of the excitation.
    Source: Hu 1981, section 6.1 (item 4); hysteresis motor: standard; sizes are our own.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    J_w = Parameter(8e-5, "kg.m2", "inertia of the wheel", above=0.0)
    M = Parameter(8e-3, "N.m", "torque of the motor at the nominal voltage", above=0.0)
    D = Parameter(1e-6, "N.m.s/rad", "drag of the wheel", above=0.0)
    n_s = Parameter(2500.0, "rad/s", "synchronous speed", above=0.0)
    M_b = Parameter(4e-3, "N.m", "torque of the brake", min=0.0)
    I_0 = Parameter(0.05, "A", "magnetizing current", min=0.0)
    I_M = Parameter(0.25, "A", "current of the whole torque", min=0.0)
    supply = Parameter(1.0, "1", "supply voltage over the nominal one", min=0.0, max=2.0)
    drop = Parameter(1e9, "s", "time on after which the supply gives the share `dropped`", min=0.0)
    dropped = Parameter(1.0, "1", "supply voltage from then on, over the nominal one", min=0.0, max=2.0)
    offset = Parameter(0.0, "V", "offset of the pickoff's amplifier")
    V_ref = Parameter(5.0, "V", "voltage of the reference")
    polarity = Parameter(1, int, "of the torquer's leads; -1: reversed", min=-1, max=1)
    pickoff = Noise(2e-6, "V", "noise of a reading of the pickoff", per="step")
    reading = Noise(2e-4, "V", "noise of a reading of the reference", per="step")
    ammeter = Noise(5e-4, "A", "noise of a reading of the wheel's current", per="step")

    wheel = Input(0.0, "1", "other than 0: the wheel is supplied")
    brake = Input(0.0, "1", "other than 0, and no supply: the wheel is braked")
    excitation = Input(0.0, "1", "other than 0: the pickoff is excited")
    u = Input(0.0, "V", "pickoff voltage of the gyro")
    i = Input(0.0, "A", "current for the torquer")

    i_out = Output("A", "current of the torquer")
    u_out = Output("V", "pickoff voltage as read")
    wheel_current = Output("A", "current of the wheel as read")
    wheel_speed = Output("rad/s", "speed of the wheel, by the frequency of what it generates")
    reference = Output("V", "voltage of the reference as read")
    synchronous = Output("1", "1 while the wheel is locked to its supply (diagnostic)")

    n = State(0.0, "rad/s", "speed of the wheel")
    on = Discrete(0.0, "s", "time for which the wheel was supplied")
    locked = Discrete(0.0, "1", "1: synchronous")
    voltage = Discrete(0.0, "1", "supply voltage over the nominal one")
    torque = Discrete(0.0, "N.m", "torque of the motor")

    def flow(self) -> None:
        self.der.n = 0.0
        if self.locked == 0.0:
            braked = self.M_b if self.brake != 0.0 and self.wheel == 0.0 else 0.0
            self.der.n = (self.torque - self.D * self.n - braked * clip(self.n, 0.0, 1.0)) / self.J_w

    @sampled(every=1)
    def tick(self) -> None:
        self.on = self.on + self.h if self.wheel != 0.0 else 0.0
        self.voltage = self.dropped if self.on > self.drop else self.supply
        if self.wheel == 0.0:
            self.voltage = 0.0
        self.torque = self.M * self.voltage * self.voltage
        enough = self.torque >= self.D * self.n_s
        self.locked = 1.0 if enough and self.n >= self.n_s * (1.0 - 1e-9) else 0.0
        if self.locked > 0.0:
            self.n = self.n_s

    def outputs(self) -> None:
        self.i_out = self.polarity * self.i
        share = 1.0
        if self.locked > 0.0:
            share = minimum(self.D * self.n_s / maximum(self.torque, 1e-300), 1.0)
        self.wheel_current = self.voltage * (self.I_0 + self.I_M * share) + self.noise.ammeter
        self.wheel_speed = fabs(self.n)
        self.synchronous = self.locked
        self.u_out = self.offset + self.noise.pickoff
        if self.excitation != 0.0:
            self.u_out = self.u_out + self.u
        self.reference = self.V_ref + self.noise.reading
