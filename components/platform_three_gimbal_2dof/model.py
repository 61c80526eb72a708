from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.math import clip, cos, fabs, pi, sin

NONE = [0.0, 0.0, 0.0]
PITCH, ROLL, AZ = 0, 1, 2  # the A order
X, Y, Z = 0, 1, 2
DET = 1e-3  # |cos| of the middle angle below which the ring plane's normal is out of reach


class PlatformThreeGimbal2dof(Component):
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

    `theta_dot`, `omega`, `alpha` are those at the end of the step, under the inputs held during it (0 at the start).

    Not modelled: gimbal inertia against base motion (isolation is perfect but for lock and limits), friction, back EMF,
    gimbal stops, reaction of the gyros; alpha_b is not used (alpha is the difference of omega over the step).
    Source: GSP ch. 5, section 5.2.1, fig. 5-12, 5-13; equations of PLATFORM-3GIMBAL-2DOF, axes of CONV-GIMBALS.
    """

    version = "1.0.0"
    integrator = "rk4"
    rk4_substeps = 1

    mount = Parameter(0, int, "outer gimbal, 0: roll, 1: pitch", min=0, max=1)
    rate_gain = Parameter(1.0, "rad/s/V", "rate of a servo for a volt", above=0.0)
    lag = Parameter(2e-3, "s", "lag of a servo", above=0.0)
    drag = Parameter(200.0, "N.m.s/rad", "torque for which a servo yields a unit rate", above=0.0)
    rate_max = Parameter(5.0, "rad/s", "largest rate of a gimbal", above=0.0)
    allow_lock = Parameter(0, int, "1: goes on in gimbal lock, 0: refuses it", min=0, max=1)
    theta_0 = Parameter(NONE, "rad", "joint angles at the start, A order")

    v = Input(NONE, "V", "voltages of the servos, A order")
    M_load = Input(NONE, "N.m", "disturbance torques about the motor axes, A order")
    omega_b = Input(NONE, "rad/s", "inertial rate of the base, base axes")
    alpha_b = Input(NONE, "rad/s2", "its derivative; not used")
    f_b = Input([0.0, 0.0, 9.80665], "m/s2", "specific force, base axes")

    theta = Output("rad", "joint angles, A order", shape=(3,))
    theta_dot = Output("rad/s", "joint rates, A order", shape=(3,))
    omega = Output("rad/s", "inertial rate of the platform, platform axes", shape=(3,))
    alpha = Output("rad/s2", "its mean derivative over the step", shape=(3,))
    f = Output("m/s2", "specific force, platform axes", shape=(3,))
    attitude = Output("rad", "integral of omega", shape=(3,))
    condition = Output("1", "1 / abs(cos m), at most 1000")
    lock = Output("1", "1 within 5 deg of gimbal lock")
    lock_time = Output("s", "when it was last raised; -1: never")
    lock_angle = Output("rad", "middle angle then")
    saturated = Output("1", "1 while a gimbal is at rate_max")

    q = State(NONE, "rad", "joint angles, A order")
    s = State(NONE, "rad/s", "rates of the servos, A order")
    turned = State(NONE, "rad", "integral of the inertial rate, platform axes")

    before = Discrete(NONE, "rad/s", "inertial rate at the end of the step before")
    change = Discrete(NONE, "rad/s2", "mean derivative over the last step")
    near = Discrete(0.0, "1", "1 within 5 deg of lock")
    since = Discrete(-1.0, "s", "when it was last raised")
    at_angle = Discrete(0.0, "rad", "middle angle then")
    middle = Discrete(0.0, "rad", "middle angle, for messages")

    def start(self) -> None:
        late = self.step > self.lag
        self.refuse(late, "step = {step} s must be <= lag = {lag} s")
        for k in range(3):
            self.q[k] = self.theta_0[k]
        self.middle = self.theta_0[PITCH] if self.mount == 0.0 else self.theta_0[ROLL]
        locked = fabs(cos(self.middle)) < DET and self.allow_lock == 0.0
        self.refuse(
            locked, "gimbal lock: |cos| of the middle angle {middle} rad is below 1e-3 (allow_lock = 1 goes on)"
        )

    def flow(self) -> None:
        for k in range(3):
            self.der.s[k] = (self.rate_gain * self.v[k] + self.M_load[k] / self.drag - self.s[k]) / self.lag
        cf = cos(self.q[PITCH])
        sf = sin(self.q[PITCH])
        cr = cos(self.q[ROLL])
        sr = sin(self.q[ROLL])
        bx = self.omega_b[X]
        by = self.omega_b[Y]
        bz = self.omega_b[Z]
        top = self.rate_max
        # in the axes of the middle gimbal: base rate e, rate wanted d; rate w that comes out
        if self.mount == 0.0:
            ex = cr * bx - sr * bz
            z = sr * bx + cr * bz
            ey = cf * by + sf * z
            ez = cf * z - sf * by
            need = cf * self.s[ROLL] - ey
            up = self.s[AZ] - ez
            mid = clip(self.s[PITCH] - ex, -top, top)
            out = -0.5 * sf * up
            if fabs(cf) >= DET:
                out = clip(need / cf, -top, top)
            az = clip(up + sf * out, -top, top)
            wx = ex + mid
            wy = ey + cf * out
            wz = ez - sf * out + az
            self.der.q[PITCH] = mid
            self.der.q[ROLL] = out
        else:
            ey = cf * by + sf * bz
            z = cf * bz - sf * by
            ex = cr * bx - sr * z
            ez = sr * bx + cr * z
            need = cr * self.s[PITCH] - ex
            up = self.s[AZ] - ez
            mid = clip(self.s[ROLL] - ey, -top, top)
            out = 0.5 * sr * up
            if fabs(cr) >= DET:
                out = clip(need / cr, -top, top)
            az = clip(up - sr * out, -top, top)
            wx = ex + cr * out
            wy = ey + mid
            wz = ez + sr * out + az
            self.der.q[PITCH] = out
            self.der.q[ROLL] = mid
        self.der.q[AZ] = az
        ca = cos(self.q[AZ])
        sa = sin(self.q[AZ])
        self.der.turned[X] = ca * wx + sa * wy
        self.der.turned[Y] = ca * wy - sa * wx
        self.der.turned[Z] = wz

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
        for k in range(3):
            self.change[k] = (self.der.turned[k] - self.before[k]) / self.h
            self.before[k] = self.der.turned[k]

    def outputs(self) -> None:
        full = 0.0
        for k in range(3):
            self.theta[k] = self.q[k]
            self.theta_dot[k] = self.der.q[k]
            self.omega[k] = self.der.turned[k]
            self.alpha[k] = self.change[k]
            self.attitude[k] = self.turned[k]
            if fabs(self.der.q[k]) >= self.rate_max:
                full = 1.0
        self.saturated = full
        cf = cos(self.q[PITCH])
        sf = sin(self.q[PITCH])
        cr = cos(self.q[ROLL])
        sr = sin(self.q[ROLL])
        ca = cos(self.q[AZ])
        sa = sin(self.q[AZ])
        if self.mount == 0.0:
            fx = cr * self.f_b[X] - sr * self.f_b[Z]
            z = sr * self.f_b[X] + cr * self.f_b[Z]
            fy = cf * self.f_b[Y] + sf * z
            fz = cf * z - sf * self.f_b[Y]
        else:
            fy = cf * self.f_b[Y] + sf * self.f_b[Z]
            z = cf * self.f_b[Z] - sf * self.f_b[Y]
            fx = cr * self.f_b[X] - sr * z
            fz = sr * self.f_b[X] + cr * z
        self.f[X] = ca * fx + sa * fy
        self.f[Y] = ca * fy - sa * fx
        self.f[Z] = fz
        c = fabs(cf) if self.mount == 0.0 else fabs(cr)
        self.condition = 1.0 / c if c > DET else 1.0 / DET
        self.lock = 1.0 if c < sin(pi / 36.0) else 0.0
        self.lock_time = self.since
        self.lock_angle = self.at_angle
