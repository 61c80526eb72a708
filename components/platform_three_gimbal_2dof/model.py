from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.platform import AZ, PITCH, ROLL, RateServoGimbals, X, Y, Z, about_x, about_y, about_z
from gyrobench.component.math import Vector, clip, cos, fabs, pi, sin, vector

DET = 1e-3  # |cos| of the middle angle taken as lock


class PlatformThreeGimbal2dof(RateServoGimbals):
    """Platform with three gimbals moved by rate servos: kinematics and gimbal lock.  [PLATFORM-3GIMBAL-2DOF]

    A order: (1) pitch about x, (2) roll about y, (3) azimuth about z, base x right, y forward, z up; o outer, m middle.

        mount 0 ("roll"):  C_b^a = R3(azimuth) R1(pitch) R2(roll)     lock at pitch 90 deg
        mount 1 ("pitch"): C_b^a = R3(azimuth) R2(roll) R1(pitch)     lock at roll 90 deg

    Each axis has a rate servo,  lag s' = rate_gain v + M_load / drag - s  (drag lag: its inertia; drag: how it yields).
    The gimbals turn so that the platform's inertial rate is T1 s whatever the base does:

        [a_o a_m a_i] (o', m', i')^T = T1 s - omega_b        det = -+cos m,  largest rate 1 / cos m for a unit rate

    each limited to rate_max (the outer one first, the azimuth allows for it).  T1 is that of the mount: without a
    decoupler the azimuth turns the signals, and the outer axis loses by cos m.  `lock` is 1 within 5 deg of m = 90 deg.
    Below |cos m| = 1e-3 the run is refused; with allow_lock = 1 the rate along the normal of the ring plane is given up
    and outer and inner gimbal share the rest: the platform is dragged along.

    `theta_dot`, `omega`, `alpha` are those at the end of the step, under the inputs given for it (0 at the
    start); within it the base turns at omega_b + alpha_b (t - end of the step).

    Not modelled: gimbal inertia against base motion (isolation is perfect but for lock and limits), friction, back EMF,
    gimbal stops, reaction of the gyros (alpha is the difference of omega over the step).
    Source: GSP ch. 5, section 5.2.1, fig. 5-12, 5-13; equations of PLATFORM-3GIMBAL-2DOF, axes of CONV-GIMBALS.
    """

    version = "1.1.0"

    mount = Parameter(0, int, "outer gimbal, 0: roll, 1: pitch", min=0, max=1)
    allow_lock = Parameter(0, int, "1: continues in gimbal lock, 0: ends the run", min=0, max=1)

    omega = Output("rad/s", "inertial rate of the platform, platform axes", shape=(3,))
    alpha = Output("rad/s2", "its mean derivative over the step", shape=(3,))
    f = Output("m/s2", "specific force, platform axes", shape=(3,))
    attitude = Output("rad", "integral of omega", shape=(3,))
    condition = Output("1", "1 / abs(cos m), at most 1000")
    lock = Output("1", "1 within 5 deg of gimbal lock")
    lock_time = Output("s", "when it was last raised; -1: never")
    lock_angle = Output("rad", "middle angle then")
    saturated = Output("1", "1 while a gimbal is at rate_max")

    near = Discrete(0.0, "1", "1 within 5 deg of lock")
    since = Discrete(-1.0, "s", "when it was last raised")
    at_angle = Discrete(0.0, "rad", "middle angle then")
    middle = Discrete(0.0, "rad", "middle angle, for messages")

    def start(self) -> None:
        self.middle = self.theta_0[PITCH] if self.mount == 0.0 else self.theta_0[ROLL]
        locked = fabs(cos(self.middle)) < DET and self.allow_lock == 0.0
        self.refuse(
            locked, "gimbal lock: |cos| of the middle angle {middle} rad is below 1e-3 (allow_lock = 1 goes on)"
        )

    def inner_gimbal(self, v: Vector) -> Vector:
        """Return what has base axes in those of the gimbal that carries the platform, azimuth 0."""
        cf = cos(self.q[PITCH])
        sf = sin(self.q[PITCH])
        cr = cos(self.q[ROLL])
        sr = sin(self.q[ROLL])
        if self.mount == 0.0:
            return about_x(cf, sf, about_y(cr, sr, v))
        return about_y(cr, sr, about_x(cf, sf, v))

    def flow(self) -> None:
        top = self.rate_max
        e = self.inner_gimbal(self.base_rate())  # base rate there; rate w that comes out
        up = self.s[AZ] - e[Z]
        if self.mount == 0.0:
            cf = cos(self.q[PITCH])
            sf = sin(self.q[PITCH])
            mid = clip(self.s[PITCH] - e[X], -top, top)
            out = -0.5 * sf * up
            if fabs(cf) >= DET:
                out = clip((cf * self.s[ROLL] - e[Y]) / cf, -top, top)
            az = clip(up + sf * out, -top, top)
            w = vector([e[X] + mid, e[Y] + cf * out, e[Z] - sf * out + az])
            self.der.q = vector([mid, out, az])
        else:
            cr = cos(self.q[ROLL])
            sr = sin(self.q[ROLL])
            mid = clip(self.s[ROLL] - e[Y], -top, top)
            out = 0.5 * sr * up
            if fabs(cr) >= DET:
                out = clip((cr * self.s[PITCH] - e[X]) / cr, -top, top)
            az = clip(up - sr * out, -top, top)
            w = vector([e[X] + cr * out, e[Y] + mid, e[Z] + sr * out + az])
            self.der.q = vector([out, mid, az])
        self.der.turned = about_z(cos(self.q[AZ]), sin(self.q[AZ]), w)

    @sampled(every=1)
    def tick(self) -> None:
        self.middle = self.q[PITCH] if self.mount == 0.0 else self.q[ROLL]
        c = fabs(cos(self.middle))
        locked = c < DET and self.allow_lock == 0.0
        self.refuse(
            locked, "gimbal lock: |cos| of the middle angle {middle} rad is below 1e-3 (allow_lock = 1 goes on)"
        )
        close = 1.0 if c < sin(pi / 36.0) else 0.0
        if close == 1.0 and self.near == 0.0:
            self.since = self.t
            self.at_angle = self.middle
        self.near = close

    def outputs(self) -> None:
        self.f = about_z(cos(self.q[AZ]), sin(self.q[AZ]), self.inner_gimbal(self.f_b))
        c = fabs(cos(self.q[PITCH])) if self.mount == 0.0 else fabs(cos(self.q[ROLL]))
        self.condition = 1.0 / c if c > DET else 1.0 / DET
        self.lock = 1.0 if c < sin(pi / 36.0) else 0.0
        self.lock_time = self.since
        self.lock_angle = self.at_angle
