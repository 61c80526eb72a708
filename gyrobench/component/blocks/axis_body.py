"""The moving part of a table axis: inertia, resonance between motor and plate, friction with presliding, cables."""

from __future__ import annotations

from gyrobench.component.blocks.table import AxisTable
from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Noise, Parameter, State
from gyrobench.component.math import Number, Vector, cos, exp, fabs, sign, sin, vector
from gyrobench.component.set_up import Simulated, unbalanced

GONE = 50.0  # exp(-50) = 2e-22 changes no last digit of what it is added to
SMALL = 1e-3  # rad: below it the series of cos and sin are exact to the last digit


def further(c: Number, s: Number, way: Number) -> Vector:
    """Return cosine and sine of an angle, whose own are c and s, after a small way more."""
    q = way * way
    a = 1.0 - q * (0.5 - q / 24.0)
    b = way * (1.0 - q / 6.0)
    if fabs(way) > SMALL:
        a = cos(way)
        b = sin(way)
    return vector([c * a - s * b, s * a + c * b])


class Presliding(Block):
    """Friction torque of a contact that is elastic before it slides (LuGre).

        z' = v - |v| z / z_s(v)        z_s = g / k        g(v) = M_c + (M_s - M_c) exp(-(v / v_s)2)
        M  = -(k z + d z')             k = M_c / presliding

    v rate against the base, z deflection of the contact, M_c Coulomb and M_s break-away torque.  At a constant v the
    law of z is solved exactly over a step, z+ = +-z_s + (z -+ z_s) exp(-|dx| / z_s): stable whatever the rate.  Before
    it slides the contact is a spring k with hysteresis; a torque below M_s is held.

    Not modelled: a memory that tells closed from open hysteresis loops (LuGre creeps under a torque that vibrates).
    Source: Canudas 1995, eq. 1 to 4; [FRICTION-PRESLIDING].
    """

    suffixes = {"coulomb": ""}

    coulomb = Parameter(0.0, "N.m", "Coulomb friction; 0: none", min=0.0)
    static = Parameter(0.0, "N.m", "break-away torque; 0: the Coulomb torque", min=0.0)
    slip_rate = Parameter(1e-4, "rad/s", "rate at which break-away has turned into Coulomb friction", above=0.0)
    presliding = Parameter(5e-6, "rad", "deflection at the Coulomb torque, before it slides", above=0.0)
    damping = Parameter(0.0, "N.m.s/rad", "damping of that deflection", min=0.0)

    z = Discrete(0.0, "rad", "deflection of the contact")
    x_last = Discrete(0.0, "rad", "angle at the end of the last step")
    now = Discrete(0.0, "N.m", "torque there")
    ahead = Discrete(0.0, "N.m", "torque at the middle of the next step")
    spring = Discrete(0.0, "N.m/rad", "stiffness k before it slides")

    def start(self) -> None:
        less = self.static > 0.0 and self.static < self.coulomb
        self.refuse(less, "{self}_static = {static} N.m must be 0 or at least the Coulomb torque {coulomb} N.m")
        self.spring = self.coulomb / self.presliding

    def limit(self, v: Number) -> Number:
        """Return the deflection z_s at which the contact slides steadily at the rate v."""
        level = self.coulomb
        if self.static > self.coulomb:
            q = v / self.slip_rate
            if q * q < GONE:
                level = level + (self.static - self.coulomb) * exp(-q * q)
        return level / self.spring

    def after(self, dx: Number, limit: Number) -> Number:
        """Return z after a turn by dx, towards the limit of its mean rate."""
        end = sign(dx) * limit
        if self.z == end or fabs(dx) > GONE * limit:
            return end
        return end + (self.z - end) * exp(-fabs(dx) / limit)

    def torque(self, z: Number, v: Number, limit: Number) -> Number:
        """Return the torque on what turns at the rate v, which has that limit, with the deflection z."""
        slip = v - fabs(v) * z / limit
        return -(self.spring * z + self.damping * slip)

    def rest(self, x: Number, v: Number) -> None:
        """Begin at the angle x, free of torque, or sliding already at the rate v."""
        self.x_last = x
        self.z = 0.0
        self.ahead = 0.0
        if self.coulomb > 0.0 and v != 0.0:
            limit = self.limit(v)
            self.z = sign(v) * limit
            self.ahead = self.torque(self.z, v, limit)

    def follow(self, x: Number) -> None:
        """Take the deflection to the angle x, for a model of the contact that only looks on."""
        if self.coulomb > 0.0:
            dx = x - self.x_last
            self.z = self.after(dx, self.limit(dx / self.h))
        self.x_last = x

    def slide(self, x: Number, v: Number, acc: Number, per_J: Number) -> None:
        """Take the contact to the angle x and the rate v; acc without friction and 1 / inertia tell the next step."""
        if self.coulomb > 0.0:
            self.refuse(
                self.h * self.h * self.spring * per_J > 0.25,
                "{self}_presliding = {presliding} rad is too small for the internal step, which must be at most "
                "0.5 sqrt(J presliding / Coulomb torque): shorten the step",
            )
            dx = x - self.x_last
            self.z = self.after(dx, self.limit(dx / self.h))
            self.now = self.torque(self.z, v, self.limit(v))
            middle = v + 0.5 * self.h * (acc + self.now * per_J)
            limit = self.limit(middle)
            self.ahead = self.torque(self.after(0.25 * self.h * (v + middle), limit), middle, limit)
        self.x_last = x


class AxisBody(Block):
    """Motion of a table axis under the torque of its motor and its loads, w inertial rate, e that of the base.

        rigid:       J w' = T + M - viscous v - cable (x - cable_zero) + friction         x' = v = w - e
        resonance:   (J - J_m) w' = k s + d s' + M - ...        J_m (w' + s'') = T - k s - d s'        J_m = share J

    s is the angle of the motor against the plate, k and d follow from the frequency and the damping ratio of the free
    pair.  The part hands over T, M and e as numbers: `turn` in its flow, then `settle` in its sampled method, which
    takes the friction of the next step at its middle (second order) so that it stays out of the linearization.  All
    else is linear and exact over a step.

    Not modelled: motion of the axis in its bearing, backlash, Coulomb friction on the motor's side.
    Source: Hu 1981, eq. 5-7, 5-8; own design of the resonance.
    """

    J = Parameter(2.56, "kg.m2", "inertia of motor, plate and load about the axis", above=0.0)
    viscous = Parameter(0.0, "N.m.s/rad", "viscous drag of bearing and eddy currents", min=0.0)
    cable = Parameter(0.0, "N.m/rad", "stiffness of cables between base and plate", min=0.0)
    cable_zero = Parameter(0.0, "rad", "angle at which the cables pull at nothing")
    unbalance = Parameter([0.0, 0.0], "kg.m", "mass times offset along the first and second table axis")
    resonance = Parameter(0.0, "rad/s", "resonance of motor against plate; 0: rigid", min=0.0)
    resonance_damping = Parameter(0.01, "1", "its damping ratio", above=0.0)
    share = Parameter(0.1, "1", "share of the motor in J", above=0.0, below=1.0)
    rumble = Noise(0.0, "N.m/sqrt(Hz)", "random torque density (brushes, air)")
    friction = Presliding()

    x = State(0.0, "rad", "angle against the base")
    w = State(0.0, "rad/s", "inertial rate about the axis")
    twist = State(0.0, "rad", "angle s of the motor against the plate")
    twist_rate = State(0.0, "rad/s", "its rate")

    v = Discrete(0.0, "rad/s", "rate against the base at the end of the last step")
    acc = Discrete(0.0, "rad/s2", "inertial acceleration there")
    acc_mean = Discrete(0.0, "rad/s2", "mean acceleration since the start of the communication step")
    begun = Discrete(0.0, "s", "start of the communication step")
    w_begun = Discrete(0.0, "rad/s", "inertial rate there")
    w_last = Discrete(0.0, "rad/s", "inertial rate at the end of the last step")
    e = Discrete(0.0, "rad/s", "rate of the base about the axis there")
    per_plate = Discrete(0.0, "1/(kg.m2)", "1 / inertia of the plate")
    per_motor = Discrete(0.0, "1/(kg.m2)", "1 / inertia of the motor")
    spring = Discrete(0.0, "N.m/rad", "stiffness between motor and plate")
    damper = Discrete(0.0, "N.m.s/rad", "damping between motor and plate")

    def rest(self, x: Number, v: Number, e: Number) -> None:
        """Start at the angle x with the rate v against a base that turns at e."""
        self.per_motor = 1.0 / (self.share * self.J)
        self.weigh(self.J)
        if self.resonance > 0.0:
            both = self.share * (1.0 - self.share) * self.J
            self.spring = both * self.resonance * self.resonance
            self.damper = 2.0 * both * self.resonance * self.resonance_damping
        self.x = x
        self.v = v
        self.e = e
        self.w = e + v
        self.friction.rest(x, v)
        self.begun = self.t
        self.w_begun = self.w
        self.w_last = self.w

    def weigh(self, J: Number) -> None:
        """Give the body the inertia J from now on; that of the motor stays."""
        self.per_plate = 1.0 / (J - self.share * self.J) if self.resonance > 0.0 else 1.0 / J

    def unbalanced(self, c: Number, s: Number, g: Vector) -> Number:
        """Return the torque of the unbalance: c, s of the table angle, g specific force along the axes at angle 0."""
        fx = c * g[0] + s * g[1]
        fy = c * g[1] - s * g[0]
        return self.unbalance[1] * fx - self.unbalance[0] * fy

    def through(self, motor: Number) -> Number:
        """Return what of the motor torque reaches the plate."""
        if self.resonance > 0.0:
            return self.spring * self.twist + self.damper * self.twist_rate
        return motor

    def turn(self, motor: Number, load: Number, e: Number) -> None:
        """Write the derivatives; e at the end of the step, taken as its mean over it."""
        v = self.w - 0.5 * (self.e + e)
        inner = self.through(motor)
        m = inner + load + self.noise.rumble - self.viscous * v - self.cable * (self.x - self.cable_zero)
        m = m + self.friction.ahead
        self.der.x = v
        self.der.w = m * self.per_plate
        if self.resonance > 0.0:
            self.der.twist = self.twist_rate
            self.der.twist_rate = (motor - inner) * self.per_motor - m * self.per_plate
        else:  # stays 0, and leaves no pole at 0 in the linearization
            self.der.twist = -self.twist
            self.der.twist_rate = -self.twist_rate

    def settle(self, motor: Number, load: Number, e: Number) -> None:
        """Take rate, acceleration and friction at the end of an internal step.

        acc_mean is what an instrument on the plate should get as its acceleration: it turns a change of w into the
        same change of momentum.  Samples of a torque that jumps within the communication step do not.
        """
        if self.step_start != self.begun:
            self.begun = self.step_start
            self.w_begun = self.w_last
        self.w_last = self.w
        self.acc_mean = (self.w - self.w_begun) / (self.t - self.begun)
        v = self.w - e
        m = self.through(motor) + load - self.viscous * v - self.cable * (self.x - self.cable_zero)
        acc = m * self.per_plate
        self.friction.slide(self.x, v, acc, self.per_plate)
        self.acc = acc + self.friction.now * self.per_plate
        self.v = v
        self.e = e


class BodyTable(AxisTable):
    """Common part of the tables with one axis that is a body under torques: block AxisBody on the tilted base.

    A part calls `turn` in its flow and `settle` in its sampled method, with the torque of its motor and its loads; the
    torque of the unbalance is added here, that of the next step at its middle.
    """

    simulates: tuple[Simulated, ...] = (unbalanced("axis_unbalance"),)

    axis = AxisBody()
    angle0 = Parameter(0.0, "rad", "angle at the start")

    pull = Discrete(0.0, "N.m", "torque of the unbalance at the middle of the next step")

    def start(self) -> None:
        self.pull = self.unbalanced(self.angle0)

    def earth(self) -> Number:
        """Return the inertial rate of the base along the axis."""
        return self.tilted[2] @ self.omega_local

    def unbalanced(self, x: Number) -> Number:
        """Return the torque of the unbalance at the angle x."""
        if self.axis_unbalance[0] == 0.0 and self.axis_unbalance[1] == 0.0:
            return 0.0
        return self.axis.unbalanced(cos(x), sin(x), self.tilted @ self.f_local)

    def turn(self, motor: Number, load: Number) -> None:
        self.axis.turn(motor, load + self.pull, self.earth())

    def settle(self, motor: Number, load: Number) -> None:
        if self.axis_unbalance[0] == 0.0 and self.axis_unbalance[1] == 0.0:
            self.axis.settle(motor, load, self.earth())
            return
        c = cos(self.axis_x)
        s = sin(self.axis_x)
        g = self.tilted @ self.f_local
        self.axis.settle(motor, load + self.axis.unbalanced(c, s, g), self.earth())
        middle = further(c, s, 0.5 * self.h * self.axis_v)
        self.pull = self.axis.unbalanced(middle[0], middle[1], g)

    def outputs(self) -> None:
        rate = self.axis_w - self.earth()
        self.feel(cos(self.axis_x), sin(self.axis_x), self.axis_w, rate, self.axis_acc_mean)
        self.angle = self.axis_x
        self.rate = rate
