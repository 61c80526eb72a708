from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, Rotation, sampled
from gyrobench.component.blocks.rate_errors import ALONG_Y, ALONG_Z, RateErrors
from gyrobench.component.math import exp

ZEROS = [0.0, 0.0, 0.0]


class GyroErrorCompensator(Component):
    """Takes the known errors of three gyros off their rates: static drift and errors by angular motion.

    [GYRO-STATIC-ERR, GYRO-DYNAMIC-ERR]

        rate = indicated + omega_d(f) - delta(w, a)          for each of the gyros x, y, z

    f is that of accelerometers, f = a - G: the drift polynomial takes -f/g0, so the linear coefficients keep their sign
    (a polynomial in F = -f that is fed with accelerometer outputs has all linear terms wrong).  w: the indicated rates,
    static drift taken off; a: their derivative, differences over a communication step through a lag tau_a:

        a+ = e a + (1 - e) (w+ - w)/h,   e = exp(-h/tau_a)

    The difference belongs to the middle of the step: a comes h/2 + tau_a late, the delay of the gyro itself comes on
    top.  That bounds what is left of -J a_O: 2 pi f (delay) of it at the frequency f.

    Not modelled: scale factor, misalignment, terms of second order in the float angle.
    Source: GYRO-STATIC-ERR, GYRO-DYNAMIC-ERR; Xia 2008, eq. 2.2.1..2.2.11, corrected by EX4, EX5.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    tau_a = Parameter(0.0, "s", "time constant of the angular acceleration; 0: plain differences", min=0.0)
    mount_x = Rotation("rows: axes I, O, S of the gyro x in vehicle axes")
    mount_y = Rotation("rows: axes I, O, S of the gyro y in vehicle axes", ALONG_Y)
    mount_z = Rotation("rows: axes I, O, S of the gyro z in vehicle axes", ALONG_Z)
    x = RateErrors()
    y = RateErrors()
    z = RateErrors()

    indicated = Input(ZEROS, "rad/s", "rates that the gyros x, y, z indicate")
    f = Input(ZEROS, "m/s2", "specific force a - G that accelerometers read, vehicle axes")

    omega = Output("rad/s", "rate, vehicle axes", shape=(3,))
    static = Output("rad/s", "static drift that was added to the indicated rates", shape=(3,))
    dynamic = Output("rad/s", "errors by angular motion that were taken off", shape=(3,))
    alpha = Output("rad/s2", "angular acceleration as derived", shape=(3,))

    a = Discrete(ZEROS, "rad/s2", "angular acceleration")
    before = Discrete(ZEROS, "rad/s", "rates of the step before")
    known = Discrete(0.0, "1", "1 once there was a step before")
    drift = Discrete(ZEROS, "rad/s", "static drift, omega_d")
    delta = Discrete(ZEROS, "rad/s", "errors by angular motion")
    out = Discrete(ZEROS, "rad/s", "rate")

    @sampled(every=1)
    def tick(self) -> None:
        self.drift[0] = self.x.static(self.mount_x @ self.f)
        self.drift[1] = self.y.static(self.mount_y @ self.f)
        self.drift[2] = self.z.static(self.mount_z @ self.f)
        w = self.indicated + self.drift
        if self.known > 0.5:
            keep = exp(-self.h / self.tau_a) if self.tau_a > 0.0 else 0.0
            self.a = keep * self.a + (1.0 - keep) * ((w - self.before) / self.h)
        self.before = w
        self.known = 1.0
        self.delta[0] = self.x.dynamic(self.mount_x @ w, self.mount_x @ self.a)
        self.delta[1] = self.y.dynamic(self.mount_y @ w, self.mount_y @ self.a)
        self.delta[2] = self.z.dynamic(self.mount_z @ w, self.mount_z @ self.a)
        self.out = w - self.delta

    def outputs(self) -> None:
        self.omega = self.out
        self.static = self.drift
        self.dynamic = self.delta
        self.alpha = self.a
