"""Foundation of a table: a block on springs, what stands on it, and who walks on it."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import sampled
from gyrobench.component.declarations import Input, Output, Parameter, State
from gyrobench.component.math import Number, cross, fabs, pi, sin, vector

NONE = [0.0, 0.0, 0.0]
LIMIT = 0.01  # rad


class Foundation(Component):
    """Common part of the foundations: a rigid block of six degrees of freedom on springs and dampers.

        z = x - x_ground    z' = v    v' = -2 d w v - w2 z - a + push      a_block = v' + a    w = 2 pi frequency
        r = q_block - q     r' = u    u' = -2 d w u - w2 r - q'' + M/J     q_block = q + r     of rocking

    About up, the block turns with the ground.  In the axes of the block, to first order in the tilts, with g and the
    Earth's rate of the site,

        f = (0, 0, g) + a_block - q_block x (...)     omega = omega_g - r x (omega_g - q') + u
        alpha = alpha_g - u x (omega_g - q') + u'

    A person of weight P walks to and fro on the floor, of which the share `floor` reaches the block: at
    s = reach sin(2 pi t / period) from its middle, in the direction `walk` from east to north, the tread k of the
    weight at the frequency of the steps,

        p = floor P (1 + k sin(2 pi steps t))    M = (-p s sin walk, p s cos walk, 0)    push_up = -(p - floor P)/mass

    The springs lie in the plane of the block's mass centre: sway and rocking are apart.

    Refused: a block that moves by more than `travel` against the ground, or tilts by more than 0.01 rad.
    Not modelled: modes of the block itself, turning about up, the sag under the standing weight, soil, air springs that
    leak, gravity that acts on a leaning block as a spring.
    Source: Hu 1981, section 5.6 (three-2), fig. 5-45; base excitation of one degree of freedom.  [ENV-FOUNDATION]
    """

    frequency = Parameter(3.5, "Hz", "natural frequency of the block along E, N, U", above=0.0)
    damping = Parameter(0.1, "1", "its damping ratio", min=0.001, max=2.0)
    rock_frequency = Parameter(3.5, "Hz", "natural frequency of rocking about E and N", above=0.0)
    rock_damping = Parameter(0.1, "1", "its damping ratio", min=0.001, max=2.0)
    mass = Parameter(1.7e5, "kg", "mass of the block with what stands on it", above=0.0)
    inertia = Parameter(5.7e5, "kg.m2", "its moment of inertia about a horizontal axis", above=0.0)
    travel = Parameter(0.05, "m", "largest way of the block against the ground", above=0.0)
    person = Parameter(0.0, "kg", "mass of a person who walks on the floor", min=0.0)
    floor = Parameter(
        1.0, "1", "share of the person that reaches the block: 0 for a floor on the walls", min=0.0, max=1.0
    )
    reach = Parameter(2.0, "m", "largest distance of the person from the middle of the block", min=0.0)
    period = Parameter(20.0, "s", "time to walk to and fro", above=0.0)
    walk = Parameter(0.0, "rad", "direction of the walk, from east to north")
    tread = Parameter(0.3, "1", "share of the weight that the steps add and take away", min=0.0, max=1.0)
    steps = Parameter(2.0, "Hz", "frequency of the steps", above=0.0)

    g = Input(9.80665, "m/s2", "local gravity")
    a = Input(NONE, "m/s2", "acceleration of the ground, ENU")
    tilt = Input(NONE, "rad", "tilt of the ground about E, N, U")
    tilt_rate = Input(NONE, "rad/s", "its derivative")
    tilt_acceleration = Input(NONE, "rad/s2", "derivative of that")
    omega = Input(NONE, "rad/s", "inertial rate of the ground in its axes")
    alpha = Input(NONE, "rad/s2", "its derivative")

    f_block = Output("m/s2", "specific force on the block, in its axes", shape=(3,))
    omega_block = Output("rad/s", "inertial rate of the block in its axes", shape=(3,))
    alpha_block = Output("rad/s2", "its derivative", shape=(3,))
    a_block = Output("m/s2", "acceleration of the block, ENU", shape=(3,))
    tilt_block = Output("rad", "tilt of the block about E, N, U", shape=(3,))

    z = State(NONE, "m", "place of the block against the ground")
    v = State(NONE, "m/s", "its derivative")
    r = State(NONE, "rad", "tilt of the block against the ground")
    u = State(NONE, "rad/s", "its derivative")

    def servo(self) -> Number:
        """Return the force of a servo over the mass, m/s2 along E, N, U."""
        return vector([0.0, 0.0, 0.0])

    def weight(self) -> Number:
        """Return the person's force on the block, N."""
        return self.floor * self.person * self.g * (1.0 + self.tread * sin(2.0 * pi * self.steps * self.t))

    def drive(self) -> Number:
        """Return the acceleration of the block by springs, dampers, servo and steps, ENU."""
        w = 2.0 * pi * self.frequency
        pressed = (self.weight() - self.floor * self.person * self.g) / self.mass
        held = -2.0 * self.damping * w * vector(self.v) - w * w * vector(self.z)
        return held + self.servo() - vector([0.0, 0.0, pressed])

    def rocking(self) -> Number:
        """Return the angular acceleration of the block against the ground."""
        w = 2.0 * pi * self.rock_frequency
        arm = self.reach * sin(2.0 * pi * self.t / self.period) * self.weight() / self.inertia
        turned = arm * vector([-sin(self.walk), sin(self.walk + 0.5 * pi), 0.0])
        back = -2.0 * self.rock_damping * w * vector(self.u) - w * w * vector(self.r)
        free = back + turned - vector(self.tilt_acceleration)
        return vector([free[0], free[1], 0.0])

    def start(self) -> None:
        for j in range(3):
            self.z[j] = 0.0
            self.v[j] = 0.0
            self.r[j] = 0.0
            self.u[j] = 0.0

    def flow(self) -> None:
        self.der.z = vector(self.v)
        self.der.v = self.drive() - vector(self.a)
        self.der.r = vector(self.u)
        self.der.u = self.rocking()

    @sampled(every=1)
    def tick(self) -> None:
        for j in range(3):
            self.refuse(
                fabs(self.z[j]) > self.travel,
                "the block has moved by its travel of {travel} m: its servo follows a tilt of the ground, or the "
                "ground moves by more",
            )
            self.refuse(
                fabs(self.tilt[j] + self.r[j]) > LIMIT, "the block tilts by more than 0.01 rad, which is not small"
            )

    def outputs(self) -> None:
        moved = self.drive()
        leaning = vector(self.tilt) + vector(self.r)
        inertial = vector(self.omega) - vector(self.tilt_rate)
        force = vector([0.0, 0.0, self.g]) + moved
        self.a_block = moved
        self.tilt_block = leaning
        self.f_block = force - cross(leaning, force)
        self.omega_block = vector(self.omega) - cross(vector(self.r), inertial) + vector(self.u)
        self.alpha_block = vector(self.alpha) - cross(vector(self.u), inertial) + self.rocking()
