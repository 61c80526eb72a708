"""Loads of a table axis: air bearing with vortex torque and unbalance, slip rings with their follower."""

from __future__ import annotations

from gyrobench.component.blocks.axis_body import Presliding
from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Noise, Parameter, State
from gyrobench.component.math import Number, cos, pi, sin, sqrt

WIDE = 1e-4  # m: a gap above it is rather one given in another unit


class AirBearing(Block):
    """Torques of an aerostatic bearing on its axis, w the rate against the base and x the angle.

        journal  mu pi D3 L w / (4 h sqrt(1 - eps2))        two thrust faces  mu pi (r2^4 - r1^4) w / h_t
        vortex   M_2, of a sign of its own, at rest too     unbalance  M_W = U g cos(elevation) sin(x - unbalance_angle)

    M_2 is the torque of air that flows unevenly through inlets and over burrs, as in a turbine.  The source has no
    formula: a constant, and its scatter from start to start.

    Not modelled: load and stiffness (gyrobench/design/aerostatic.py), M_2 over the angle, heating of the gap.
    Source: Hu 1981, eq. 5-31..5-34, 5-36, 5-37 with ET7, ET8; [BEARING-AIR].
    """

    viscosity = Parameter(1.837e-5, "Pa.s", "viscosity of the air (25 degC)", above=0.0)
    diameter = Parameter(0.25, "m", "diameter of the journal", above=0.0)
    length = Parameter(0.158, "m", "length of the journal", above=0.0)
    gap = Parameter(2e-5, "m", "radial gap of the journal", above=0.0)
    eccentricity = Parameter(0.0, "1", "eccentricity of the journal, share of its gap", min=0.0, below=1.0)
    inner = Parameter(0.075, "m", "inner radius of the thrust faces", above=0.0)
    outer = Parameter(0.125, "m", "outer radius of the thrust faces", above=0.0)
    thrust_gap = Parameter(2e-5, "m", "gap of each thrust face", above=0.0)
    vortex = Parameter(0.0, "N.m", "vortex torque of the air on the table, at rest too")
    vortex_scatter = Noise(0.0, "N.m", "its rms from start to start", per="start")
    unbalance = Parameter(0.0, "kg.m", "mass times offset", min=0.0)
    unbalance_angle = Parameter(0.0, "rad", "table angle at which the offset points up")
    elevation = Parameter(0.5 * pi, "rad", "axis above the horizon", min=-0.5 * pi, max=0.5 * pi)
    gravity = Parameter(9.80665, "m/s2", "local gravity", min=9.7, max=9.9)

    drag = Discrete(0.0, "N.m.s/rad", "viscous torque for a rate")
    pull = Discrete(0.0, "N.m", "largest torque of the unbalance")

    def start(self) -> None:
        self.refuse(self.outer <= self.inner, "{self}_outer = {outer} m must be above {self}_inner = {inner} m")
        r1 = self.inner * self.inner
        r2 = self.outer * self.outer
        journal = self.diameter * self.diameter * self.diameter * self.length / (4.0 * self.gap)
        journal = journal / sqrt(1.0 - self.eccentricity * self.eccentricity)
        faces = (r2 * r2 - r1 * r1) / self.thrust_gap
        self.drag = self.viscosity * pi * (journal + faces)
        self.pull = self.unbalance * self.gravity * cos(self.elevation)

    def torque(self, rate: Number, x: Number) -> Number:
        """Return the torque on the table."""
        steady = self.vortex + self.noise.vortex_scatter
        return steady + self.pull * sin(x - self.unbalance_angle) - self.drag * rate


class SlipRings(Block):
    """Slip rings on a shaft of their own that follows the table, or on the table's axis (follower = 0).

        J_s y'' = (K_s + k_w) eps + K_d eps' + friction(y')        eps = x - y        torque on the table: -k_w eps

    x table, y ring angle; a pickoff and a motor make the stiffness K_s, the tachometers the damping K_d, soft leads
    between both the stiffness k_w.  At constant rate eps = M_f / (K_s + k_w): k_w / (K_s + k_w) of the friction gets
    through.  Its sign is that of the rotation: reverse the table to separate it.  follower = 0: all of it.

    Not modelled: noise of the contacts' voltage, limits of the follower's motor.
    Source: Hu 1981, section 5.4, eq. 5-35; [SLIPRING-FOLLOWER].
    """

    follower = Parameter(1, int, "1: rings on a shaft that follows, 0: on the table axis", min=0, max=1)
    J_s = Parameter(0.02, "kg.m2", "inertia of the ring shaft", above=0.0)
    K_s = Parameter(300.0, "N.m/rad", "stiffness of the follower", above=0.0)
    K_d = Parameter(4.0, "N.m.s/rad", "damping of the follower, by tachometers", above=0.0)
    k_w = Parameter(30.0, "N.m/rad", "stiffness of the leads", min=0.0)
    travel = Parameter(0.1, "rad", "largest angle between the shafts that the leads allow", above=0.0)
    noise_torque = Noise(0.0, "N.m/sqrt(Hz)", "random friction torque on the ring shaft")
    friction = Presliding(coulomb=0.137, presliding=1e-4)

    y = State(0.0, "rad", "angle of the ring shaft")
    y_dot = State(0.0, "rad/s", "its rate")

    eps = Discrete(0.0, "rad", "table ahead of the ring shaft, at the end of the step")
    M = Discrete(0.0, "N.m", "torque on the table there")

    def rest(self, x: Number, rate: Number) -> None:
        """Begin with the ring shaft at the angle x of the table and at its rate."""
        self.y = x
        self.y_dot = rate
        self.eps = 0.0
        self.friction.rest(x, rate)

    def follow(self, x: Number, rate: Number) -> None:
        """Write the derivatives, x and rate of the table at the middle of the internal step."""
        if self.follower == 1.0:
            pull = (self.K_s + self.k_w) * (x - self.y) + self.K_d * (rate - self.y_dot)
            self.der.y = self.y_dot
            self.der.y_dot = (pull + self.friction.ahead + self.noise.noise_torque) / self.J_s
        else:
            self.der.y = x - self.y
            self.der.y_dot = rate - self.y_dot

    def settle(self, x: Number, rate: Number) -> None:
        """Take friction and torque at the end of an internal step, where the table has x and rate."""
        if self.follower == 1.0:
            self.eps = x - self.y
            far = self.eps > self.travel or self.eps < -self.travel
            self.refuse(far, "the ring shaft is {eps} rad from the table, {self}_travel is {travel} rad")
            acc = ((self.K_s + self.k_w) * self.eps + self.K_d * (rate - self.y_dot)) / self.J_s
            self.friction.slide(self.y, self.y_dot, acc, 1.0 / self.J_s)
            self.M = -self.k_w * self.eps
        else:
            self.friction.slide(x, rate, 0.0, 0.0)
            self.M = self.friction.ahead + self.noise.noise_torque
