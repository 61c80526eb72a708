from __future__ import annotations

from gyrobench.component import Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.blocks.platform import AZ, PITCH, ROLL, RateServoGimbals, X, Y, Z, about_x, about_y, about_z
from gyrobench.component.math import Number, clip, cos, fabs, pi, sign, sin, vector, where

SECANT, SIGN = 0, 1  # gains of the servo of the fourth gimbal; 2: constant


class PlatformFourGimbal(RateServoGimbals):
    """Platform with a fourth gimbal that keeps the inner three away from lock: kinematics.  [PLATFORM-4GIMBAL]

    From outside: g4 outer roll about y, g3 pitch about x, g2 inner roll about y, g1 azimuth about z; base x right, y
    forward, z up.  C_b^a = R3(g1) R2(g2) R1(g3) R2(g4).  A order of drives and joints: (1) g3, (2) g2, (3) g1.

        g4' = k G(g3) g2, limited to rate_max,   G = 1 / cos g3 within +-cap (gain 0), sign(cos g3) (1), 1 (2)

    turns the fourth gimbal so that g2 goes to zero: with the platform held, near g2 = 0, g2' = -cos g3 g4'.  The inner
    three are the rate servos and the kinematics of platform_three_gimbal_2dof (mount 1) on the fourth: they give the
    platform the inertial rate T1 s whatever base and fourth gimbal do, each limited to rate_max.

    At pitch 90 deg the servo has no authority (`lock` is 1 within 5 deg of it, and while g4 is locked).  A locked
    fourth gimbal (lock_4 = 1, or launch = 1 from the start) is released by itself once lock_4 is 0 and |cos g3| is
    beyond that of `release`.  Refused: g2 at its stop; a servo with gain 0 or 2 within 5 deg of pitch 90 deg, unless
    allow_vertical = 1; a release while |g2| > 5 deg.

    `theta_dot`, `theta_4_dot`, `omega`, `alpha` are those at the end of the step, under the inputs given for
    it; within it the base turns at omega_b + alpha_b (t - end of the step).

    Not modelled: gimbal inertia against base motion (isolation is perfect but for limits), friction, back EMF, dynamics
    of the fourth servo, reaction of the gyros (alpha is the difference of omega over the step).
    Source: GSP ch. 5, section 5.2.2, fig. 5-14..5-17; equations of PLATFORM-4GIMBAL, axes of CONV-GIMBALS.
    """

    version = "1.1.0"

    k = Parameter(30.0, "1/s", "servo of the fourth gimbal", above=0.0)
    gain = Parameter(0, int, "its gain, 0: capped secant of pitch, 1: sign of cos(pitch), 2: constant 1", min=0, max=2)
    cap = Parameter(10.0, "1", "largest secant", min=1.0)
    release = Parameter(
        80.0 * pi / 180.0, "rad", "pitch below which a locked fourth gimbal is released", above=0.0, below=pi / 2.0
    )
    launch = Parameter(0, int, "1: starts with the fourth gimbal locked", min=0, max=1)
    allow_vertical = Parameter(0, int, "1: any gain allowed at pitch 90 deg, 0: only the sign", min=0, max=1)
    g2_stop = Parameter(60.0 * pi / 180.0, "rad", "stop of the inner roll gimbal", above=0.0, below=pi / 2.0)
    theta_4_0 = Parameter(0.0, "rad", "angle of the fourth gimbal at the start")

    lock_4 = Input(0.0, "1", "1 locks the fourth gimbal")

    theta_4 = Output("rad", "angle of the fourth gimbal")
    theta_4_dot = Output("rad/s", "its rate")
    omega = Output("rad/s", "inertial rate of the platform, platform axes", shape=(3,))
    alpha = Output("rad/s2", "its mean derivative over the step", shape=(3,))
    f = Output("m/s2", "specific force, platform axes", shape=(3,))
    attitude = Output("rad", "integral of omega", shape=(3,))
    lock = Output("1", "1 while the fourth gimbal is locked or without authority")
    locked_4 = Output("1", "1 while it is locked")
    saturated = Output("1", "1 while a gimbal is at rate_max")

    q4 = State(0.0, "rad", "angle of the fourth gimbal")

    held = Discrete(0.0, "1", "1 while the fourth gimbal is locked")
    pitch = Discrete(0.0, "rad", "pitch, for messages")
    inner = Discrete(0.0, "rad", "inner roll, for messages")

    def start(self) -> None:
        self.q4 = self.theta_4_0
        self.held = 1.0 if self.launch == 1.0 or self.lock_4 > 0.5 else 0.0
        self.inner = self.theta_0[ROLL]
        beyond = fabs(self.inner) >= self.g2_stop
        self.refuse(beyond, "theta_0[2] = {inner} rad must be within the stop of the inner roll gimbal, {g2_stop} rad")

    def servo(self, g3: Number, g2: Number) -> Number:
        if self.held == 1.0:
            return 0.0
        c = cos(g3)
        g = 1.0
        if self.gain == SECANT:
            g = where(fabs(c) * self.cap < 1.0, where(c < 0.0, -self.cap, self.cap), 1.0)
            if fabs(c) * self.cap >= 1.0:
                g = 1.0 / c
        if self.gain == SIGN:
            g = sign(c)
        return clip(self.k * g * g2, -self.rate_max, self.rate_max)

    def flow(self) -> None:
        r4 = self.servo(self.q[PITCH], self.q[ROLL])
        self.der.q4 = r4
        cr = cos(self.q[ROLL])
        sr = sin(self.q[ROLL])
        top = self.rate_max
        # rates of the fourth gimbal, its own axes; then e in the axes of the inner roll gimbal without inner rates
        b = about_y(cos(self.q4), sin(self.q4), self.base_rate())
        b[Y] = b[Y] + r4
        e = about_y(cr, sr, about_x(cos(self.q[PITCH]), sin(self.q[PITCH]), b))
        mid = clip(self.s[ROLL] - e[Y], -top, top)
        out = clip((cr * self.s[PITCH] - e[X]) / cr, -top, top)
        az = clip(self.s[AZ] - e[Z] - sr * out, -top, top)
        self.der.q = vector([out, mid, az])
        w = vector([e[X] + cr * out, e[Y] + mid, e[Z] + sr * out + az])
        self.der.turned = about_z(cos(self.q[AZ]), sin(self.q[AZ]), w)

    @sampled(every=1)
    def tick(self) -> None:
        self.pitch = self.q[PITCH]
        self.inner = self.q[ROLL]
        stopped = fabs(self.inner) >= self.g2_stop
        self.refuse(stopped, "inner roll is {inner} rad, at its stop {g2_stop} rad, with pitch {pitch} rad")
        c = fabs(cos(self.pitch))
        if self.lock_4 > 0.5:
            self.held = 1.0
        elif self.held == 1.0 and c > cos(self.release):
            wide = fabs(self.inner) > pi / 36.0
            self.refuse(wide, "inner roll is {inner} rad: the fourth gimbal is released within 5 deg (0.0873 rad) only")
            self.held = 0.0
        blind = self.held == 0.0 and self.gain != SIGN and self.allow_vertical == 0.0 and c < sin(pi / 36.0)
        self.refuse(
            blind,
            "pitch {pitch} rad is within 5 deg of 90 deg, where gain = {gain} turns the fourth gimbal over: lock it, "
            "take gain = 1, or allow_vertical = 1",
        )

    def outputs(self) -> None:
        if fabs(self.der.q4) >= self.rate_max:
            self.saturated = 1.0
        self.theta_4 = self.q4
        self.theta_4_dot = self.der.q4
        self.locked_4 = self.held
        cf = cos(self.q[PITCH])
        self.lock = 1.0 if self.held == 1.0 or fabs(cf) < sin(pi / 36.0) else 0.0
        f = about_x(cf, sin(self.q[PITCH]), about_y(cos(self.q4), sin(self.q4), self.f_b))
        f = about_y(cos(self.q[ROLL]), sin(self.q[ROLL]), f)
        self.f = about_z(cos(self.q[AZ]), sin(self.q[AZ]), f)
