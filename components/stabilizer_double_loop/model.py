from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter, State
from gyrobench.component.blocks.drive import TachometerReading
from gyrobench.component.math import Number, clip


class StabilizerDoubleLoop(Component):
    """Stabilizer of two loops: gyro signal into a wished rate, tachometer into the motor voltage.  [STAB-TWO-LOOP]

        e = u + test                       w = -K_p (e + q),  limited to +-w_max         q' = integral e
        v = K_v (w - reading),  limited to +-v_max            reading: block TachometerReading of the joint rate

    Outside the position loop, closed by a gyro whose signal is an angle; inside the rate loop, closed by the
    tachometer.  While w or v is limited and e pushes further, the integral waits (no wind-up).  The tachometer stands
    between platform and base: it drags the platform along with a moving base, by K_v for each rate of it.

    Not modelled: noise and lag of the tachometer, bandwidth of the amplifier.
    Source: GSP ch. 5, end of section 5.1.4, which has no equations; STAB-TWO-LOOP.
    """

    version = "1.0.0"

    tacho = TachometerReading()

    K_p = Parameter(6.5, "rad/s/V", "position loop: wished rate per gyro signal; 0: rate loop alone", min=0.0)
    integral = Parameter(0.0, "1/s", "position loop: corner of the integral part; 0: none", min=0.0)
    w_max = Parameter(1.0, "rad/s", "position loop: largest wished rate", above=0.0)
    K_v = Parameter(1256.0, "V.s/rad", "rate loop: voltage per error of the rate", above=0.0)
    v_max = Parameter(27.0, "V", "largest voltage", above=0.0)

    u = Input(0.0, "V", "gyro signal, an angle", quantity="angle")
    test = Input(0.0, "V", "test signal added to it")
    rate = Input(0.0, "rad/s", "joint rate, at the tachometer")
    theta = Input(0.0, "rad", "joint angle, for the ripple of the tachometer")

    v = Output("V", "voltage of the torque motor")
    e = Output("V", "the signal inside the position loop, u + test")
    wished = Output("rad/s", "rate that the position loop wishes")
    saturated = Output("1", "1 while rate or voltage is limited")

    q = State(0.0, "V", "integral part")

    def unlimited_rate(self) -> Number:
        return -self.K_p * (self.u + self.test + self.q)

    def unlimited(self) -> Number:
        wished = clip(self.unlimited_rate(), -self.w_max, self.w_max)
        return self.K_v * (wished - self.tacho.read(self.rate, self.theta))

    def flow(self) -> None:
        e = self.u + self.test
        w = self.unlimited_rate()
        v = self.unlimited()
        self.der.q = self.integral * e
        if (w > self.w_max and e < 0.0) or (w < -self.w_max and e > 0.0):
            self.der.q = 0.0
        if (v > self.v_max and e < 0.0) or (v < -self.v_max and e > 0.0):
            self.der.q = 0.0
        if self.integral == 0.0:
            self.der.q = -self.q  # stays 0, and leaves no pole at 0 in the linearization

    def outputs(self) -> None:
        self.e = self.u + self.test
        w = self.unlimited_rate()
        self.wished = clip(w, -self.w_max, self.w_max)
        volts = self.unlimited()
        self.v = clip(volts, -self.v_max, self.v_max)
        self.saturated = 1.0 if self.v != volts or self.wished != w else 0.0
