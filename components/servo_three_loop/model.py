from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.math import Number, clip, floor


class ServoThreeLoop(Component):
    """Servo of one axis with three loops: current, rate by a gyro, position of the joint.  [SERVO-3LOOP]

        e = u + test                          u = K_u times the inertial rate (rate gyro, or gyro in rebalance)
        w_error = e / K_u - command - w_track
        i_wish  = -(K_w w_error + q),         limited to +-i_max,     q' = K_wi w_error
        v       = K_c (i_wish - i_motor) + p, limited to +-v_max,     p' = K_ci (i_wish - i_motor)
        w_track = K_p (theta_wish - theta),   limited to +-w_max, sampled every track_period (a multiple of the step)

    Innermost the current loop (to be taken 500 Hz and more), then the rate loop, outermost the position loop, slower
    than a fifth of the rate loop.  K_p = 0 leaves the axis to the gyro (stabilization); K_p > 0 makes it follow its
    joint angle (cage, track).  Current and rate loop run at the communication step, their integrals exact for held
    inputs; each integral waits while its own output is limited and the error pushes further.

    The defaults fit a motor of 2 Ohm, 4 mH, 1 N.m/A on 2 kg.m2: the current loop cancels L/R and crosses 500 Hz (so a
    step of 0.2 ms or shortfall), the rate loop crosses 10 Hz, the position loop has 1 Hz.

    Not modelled: delay of a computer beside that of the exchange, resolution of the measurements.
    Source: Xia 2008, section 1.3.2 (structure; it gives no gains); SERVO-3LOOP.
    """

    version = "1.0.0"

    K_u = Parameter(1.0, "V.s/rad", "gyro signal per rate", above=0.0)
    K_w = Parameter(125.66370614359172, "A.s/rad", "rate loop: proportional gain (10 Hz with 2 kg.m2)", above=0.0)
    K_wi = Parameter(1579.1367041742974, "A/rad", "rate loop: integral gain (corner at 2 Hz)", min=0.0)
    i_max = Parameter(24.0, "A", "largest current commanded", above=0.0)
    K_c = Parameter(12.566370614359172, "V/A", "current loop: proportional gain (500 Hz with 4 mH)", above=0.0)
    K_ci = Parameter(6283.185307179586, "V/(A.s)", "current loop: integral gain (cancels 4 mH / 2 Ohm)", min=0.0)
    v_max = Parameter(48.0, "V", "largest voltage", above=0.0)
    K_p = Parameter(0.0, "1/s", "position loop: gain; 0: no position loop", min=0.0)
    theta_wish = Parameter(0.0, "rad", "position loop: joint angle to be held")
    w_max = Parameter(1.0, "rad/s", "position loop: largest rate", above=0.0)
    track_period = Parameter(5e-3, "s", "position loop: sampling period", above=0.0)

    u = Input(0.0, "V", "gyro signal", quantity="rate")
    test = Input(0.0, "V", "test signal added to it")
    command = Input(0.0, "rad/s", "rate commanded to the platform")
    i_motor = Input(0.0, "A", "motor current")
    theta = Input(0.0, "rad", "measured joint angle")

    v = Output("V", "voltage of the torque motor")
    e = Output("V", "the signal inside the loop, u + test")
    i_wish = Output("A", "current commanded")
    saturated = Output("1", "1 while current or voltage is limited")

    q = State(0.0, "A", "integral of the rate loop")
    p = State(0.0, "V", "integral of the current loop")

    track = Discrete(0.0, "rad/s", "rate from the position loop")
    count = Discrete(0.0, "1", "internal steps since it was sampled")

    def start(self) -> None:
        self.track = clip(self.K_p * (self.theta_wish - self.theta), -self.w_max, self.w_max)
        self.count = 0.0

    def rate_error(self) -> Number:
        return (self.u + self.test) / self.K_u - self.command - self.track

    def flow(self) -> None:
        error = self.rate_error()
        unlimited = -(self.K_w * error + self.q)
        self.der.q = self.K_wi * error
        if (unlimited > self.i_max and error < 0.0) or (unlimited < -self.i_max and error > 0.0):
            self.der.q = 0.0
        shortfall = clip(unlimited, -self.i_max, self.i_max) - self.i_motor
        volts = self.K_c * shortfall + self.p
        self.der.p = self.K_ci * shortfall
        if (volts > self.v_max and shortfall > 0.0) or (volts < -self.v_max and shortfall < 0.0):
            self.der.p = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.K_p > 0.0:
            many = floor(self.track_period / self.h + 0.5)
            odd = (
                many < 1.0
                or many * self.h > self.track_period * 1.000001
                or many * self.h < self.track_period * 0.999999
            )
            self.refuse(odd, "track_period = {track_period} s is not a multiple of the internal step")
            self.count = self.count + 1.0
            if self.count >= many:
                self.count = 0.0
                self.track = clip(self.K_p * (self.theta_wish - self.theta), -self.w_max, self.w_max)

    def outputs(self) -> None:
        self.e = self.u + self.test
        unlimited = -(self.K_w * self.rate_error() + self.q)
        amps = clip(unlimited, -self.i_max, self.i_max)
        volts = self.K_c * (amps - self.i_motor) + self.p
        self.i_wish = amps
        self.v = clip(volts, -self.v_max, self.v_max)
        self.saturated = 1.0 if amps != unlimited or self.v != volts else 0.0
