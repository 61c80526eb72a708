"""Common parts of stabilized platforms: passive rotations, motors, bearings with stiction, rate-servo gimbals."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import sampled
from gyrobench.component.declarations import Discrete, Input, Output, Parameter, State
from gyrobench.component.math import Number, Vector, clip, cos, fabs, sin, vector

NONE = [0.0, 0.0, 0.0]
PITCH, ROLL, AZ = 0, 1, 2  # the A order
X, Y, Z = 0, 1, 2


# ------------------------------------------------------------------------------------------- rotations
def turned_on(c: Number, s: Number, by: Number) -> Vector:
    """Return cosine and sine of an angle that has turned by `by` since they were c and s.

    The stages of a step turn little, and sines of small angles are cheap.
    """
    cb = cos(by)
    sb = sin(by)
    return vector([c * cb - s * sb, s * cb + c * sb])


def about_x(c: Number, s: Number, v: Vector) -> Vector:
    """Return v in axes turned about x by the angle with cosine c and sine s (passive)."""
    return vector([v[X], c * v[Y] + s * v[Z], c * v[Z] - s * v[Y]])


def about_y(c: Number, s: Number, v: Vector) -> Vector:
    """Return v in axes turned about y."""
    return vector([c * v[X] - s * v[Z], v[Y], s * v[X] + c * v[Z]])


def about_z(c: Number, s: Number, v: Vector) -> Vector:
    """Return v in axes turned about z."""
    return vector([c * v[X] + s * v[Y], c * v[Y] - s * v[X], v[Z]])


def gimbal_x(c: Number, s: Number, dq: Number, ddq: Number, w: Vector, a: Vector) -> Vector:
    """Return rate and angular acceleration (rows) of a gimbal that turns about x in what has w and a."""
    v = about_x(c, s, w)
    b = about_x(c, s, a)
    return vector([[v[X] + dq, v[Y], v[Z]], [b[X] + ddq, b[Y] + v[Z] * dq, b[Z] - v[Y] * dq]])


def gimbal_y(c: Number, s: Number, dq: Number, ddq: Number, w: Vector, a: Vector) -> Vector:
    """Return rate and angular acceleration (rows) of a gimbal that turns about y."""
    v = about_y(c, s, w)
    b = about_y(c, s, a)
    return vector([[v[X], v[Y] + dq, v[Z]], [b[X] - v[Z] * dq, b[Y] + ddq, b[Z] + v[X] * dq]])


def gimbal_z(c: Number, s: Number, dq: Number, ddq: Number, w: Vector, a: Vector) -> Vector:
    """Return rate and angular acceleration (rows) of a gimbal that turns about z."""
    v = about_z(c, s, w)
    b = about_z(c, s, a)
    return vector([[v[X], v[Y], v[Z] + dq], [b[X] + v[Y] * dq, b[Y] - v[X] * dq, b[Z] + ddq]])


def rigid(inertia: Vector) -> Number:
    """Return 1 where three moments can be those of a rigid body: none above the sum of the other two."""
    half = 0.5 * (inertia[X] + inertia[Y] + inertia[Z])
    return 1.0 if inertia[X] <= half and inertia[Y] <= half and inertia[Z] <= half else 0.0


def euler_torque(inertia: Vector, a: Vector, w: Vector) -> Vector:
    """Return I a + w x I w of a body with principal inertias."""
    x = inertia[X] * a[X] + (inertia[Z] - inertia[Y]) * w[Y] * w[Z]
    y = inertia[Y] * a[Y] + (inertia[X] - inertia[Z]) * w[Z] * w[X]
    z = inertia[Z] * a[Z] + (inertia[Y] - inertia[X]) * w[X] * w[Y]
    return vector([x, y, z])


def with_unbalance(n: Vector, u: Vector, f: Vector) -> Vector:
    """Return n + u x f, u = mass times offset of a body."""
    x = n[X] + u[Y] * f[Z] - u[Z] * f[Y]
    y = n[Y] + u[Z] * f[X] - u[X] * f[Z]
    z = n[Z] + u[X] * f[Y] - u[Y] * f[X]
    return vector([x, y, z])


# --------------------------------------------------------------------------------------- base motion
# Sources run first: what a part is given for a communication step belongs to the end of that step.  Held over it, the
# base would turn half a step ahead of joints that are integrated.  A master that hands over the values of the beginning
# of the step moves the base one step late.
def left(t: Number, start: Number, end: Number) -> Number:
    """Return the share of the communication step that is still to come, 0 at its end and outside it."""
    return (end - t) / (end - start) if t < end else 0.0


def moved_base(y: Number, step: Number, before: Number, rise: Number, now: Number, slope: Number) -> Vector:
    """Return (rate, acceleration) where a share y of the step is left, from both at its ends: Hermite's cubic.

    Its acceleration integrates to the change of the rate: a body free of torques keeps its inertial rate whatever the
    step, and where the rate jumps too.
    """
    bend = 3.0 * (before - now) + step * (2.0 * slope + rise)
    kink = 2.0 * (now - before) - step * (slope + rise)
    rate = now - y * (step * slope - y * (bend + y * kink))
    return vector([rate, slope - y * (2.0 * bend + 3.0 * y * kink) / step])


# ---------------------------------------------------------------------------------------------- motors
def motor_current(
    i: Number, i_max: Number, v: Number, v_max: Number, emf: Number, resistance: Number, inductance: Number
) -> Number:
    """Return the current of a motor: its state, or without inductance the static current, within i_max."""
    if inductance > 0.0:
        return i
    return clip((clip(v, -v_max, v_max) - emf) / resistance, -i_max, i_max)


def motor_slope(
    i: Number, i_max: Number, v: Number, v_max: Number, emf: Number, resistance: Number, inductance: Number
) -> Number:
    """Return the derivative of the current, L i' = v - R i - emf, |v| <= v_max; 0 at the limit of the current."""
    if inductance == 0.0:
        return 0.0
    di = (clip(v, -v_max, v_max) - resistance * i - emf) / inductance
    return 0.0 if (i >= i_max and di > 0.0) or (i <= -i_max and di < 0.0) else di


# -------------------------------------------------------------------------------------------- bearings
# An elastic contact that slips (Prandtl element): a spring from an anchor, with damping; beyond break-away the anchor
# is dragged along with the Coulomb torque until the motion reverses.  deflection: angle from the anchor; reach: that at
# Coulomb friction; slipping: 0 sticking, else the sense of slip.
def contact_torque(
    spring: Number,
    damping: Number,
    presliding: Number,
    reach: Number,
    deflection: Number,
    rate: Number,
    slipping: Number,
) -> Number:
    """Return the torque of the contact, against the motion."""
    if slipping == 0.0:
        most = spring * presliding
        return clip(spring * deflection + damping * rate, -most, most)
    return spring * clip(deflection, -reach, reach)


def contact_moved(
    spring: Number, damping: Number, presliding: Number, reach: Number,
    angle: Number, rate: Number, anchor: Number, slipping: Number,
) -> Vector:  # fmt: skip
    """Return (anchor, slipping) after a step."""
    deflection = angle - anchor
    if slipping == 0.0:
        push = deflection + damping / spring * rate
        if fabs(push) > presliding:
            sense = 1.0 if push > 0.0 else -1.0
            return vector([angle - sense * reach, sense])
    elif deflection * slipping >= reach:
        return vector([angle - slipping * reach, slipping])
    return vector([anchor, 0.0])


# --------------------------------------------------------------------------------------------- gimbals
class RateServoGimbals(Component):
    """Three gimbals driven by rate servos, A order (1) pitch, (2) roll, (3) azimuth:

        lag s' = rate_gain v + M_load / drag - s

    The parts write the derivatives of q and turned, and declare omega, alpha, f, attitude and saturated; alpha is the
    mean derivative of omega over the step.  Within a communication step the rate of the base is
    omega_b + alpha_b (t - end of the step).
    """

    integrator = "rk4"
    rk4_substeps = 1

    rate_gain = Parameter(1.0, "rad/s/V", "rate of a servo for a volt", above=0.0)
    lag = Parameter(2e-3, "s", "lag of a servo", above=0.0)
    drag = Parameter(200.0, "N.m.s/rad", "torque that changes the rate of a servo by one unit", above=0.0)
    rate_max = Parameter(5.0, "rad/s", "largest rate of a gimbal", above=0.0)
    theta_0 = Parameter(NONE, "rad", "joint angles at the start, A order")

    v = Input(NONE, "V", "voltages of the servos, A order")
    M_load = Input(NONE, "N.m", "disturbance torques about the motor axes, A order")
    omega_b = Input(NONE, "rad/s", "inertial rate of the base, base axes")
    alpha_b = Input(NONE, "rad/s2", "its derivative")
    f_b = Input([0.0, 0.0, 9.80665], "m/s2", "specific force, base axes")

    theta = Output("rad", "joint angles, A order", shape=(3,))
    theta_dot = Output("rad/s", "joint rates, A order", shape=(3,))

    q = State(NONE, "rad", "joint angles, A order")
    s = State(NONE, "rad/s", "rates of the servos, A order")
    turned = State(NONE, "rad", "integral of the inertial rate, platform axes")

    before = Discrete(NONE, "rad/s", "inertial rate at the end of the step before")
    change = Discrete(NONE, "rad/s2", "mean derivative over the last step")

    def start(self) -> None:
        self.refuse(self.step > self.lag, "step = {step} s must be <= lag = {lag} s")
        self.q = self.theta_0

    def base_rate(self) -> Vector:
        """Return the inertial rate of the base at the present instant."""
        return vector(self.omega_b + (self.t - self.step_end) * self.alpha_b)

    def flow(self) -> None:
        self.der.s = (self.rate_gain * self.v + self.M_load / self.drag - self.s) / self.lag

    @sampled(every=1)
    def differentiate(self) -> None:
        self.change = (self.der.turned - self.before) / self.h
        self.before = self.der.turned

    def outputs(self) -> None:
        self.theta = self.q
        self.theta_dot = self.der.q
        self.omega = self.der.turned
        self.alpha = self.change
        self.attitude = self.turned
        self.saturated = 0.0
        for k in range(3):
            if fabs(self.der.q[k]) >= self.rate_max:
                self.saturated = 1.0
