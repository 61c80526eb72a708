from __future__ import annotations

from typing import ClassVar

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, Rotation, State, sampled
from gyrobench.component.blocks.gyro import GaussMarkov
from gyrobench.component.math import Number, clip, floor
from gyrobench.component.set_up import turned

G0 = 9.80665  # m/s2
UG = 1e-6  # in units of g0


class AccelerometerPendulous(Component):
    """Pendulous accelerometer with its own torque rebalance.  [TEST-ACC-MULTI; Hu 1981, eq. 3-38]

    Axes x, y, z are input, output (hinge) and pendulum axis, those of the mount: v_accelerometer = mount v_case.
    In the steady state the current i is, exactly, the model of Hu 1981,

        lambda i = g0 (k0 + k1 X + k2 X2 + k3 X3 + k4 X Y + k5 X Z + noise),       (X, Y, Z) = -f/g0, g0 = 9.80665 m/s2

    SIGN: X, Y, Z are the specific force of Hu 1981, which points DOWN at rest, while the connector f = a - G points up.
    So an instrument at rest with x up has f_x = +g, X = -g/g0, and i is negative (k1 > 0); x down, i positive.
    In terms of x' = f_x/g0 = -X (IEEE) k1 and k3 change sign; k0, k2, k4, k5 do not.

    The pendulum, angle th, q = integral of th, P = pendulosity (mass times length), w = the right side above:

        J th'' = -C th' - K th + P (w - lambda i)          i = K_p th + K_i q limited to +-i_max
        q' = th, or 0 while the limit is reached and th pushes further

    With J = 1e-6 kg.m2, C = 1e-3 N.m.s/rad, K = 0.01 N.m/rad, P = 1e-4 kg.m, lambda = 1 g0/mA, K_p = 0.3 A/rad,
    K_i = 20 A/(rad.s) the poles are -87.4 and -456 +- 127j 1/s.  The limit is taken at the start of each internal
    step, so that the equations stay linear within it: exact for a held f while it is not reached.
    i_read = i + current noise, rounded to the resolution.  Random part of w, in m/s2: a constant drawn once a run, a
    Gauss-Markov process, white noise by density.

    Not modelled: vibropendulous rectification (X seen under the angle th), stops of the pendulum (it leans against its
    spring while the current is limited), angular acceleration and size effects, temperature, ageing, hysteresis.
    Source: Hu 1981, ch. 3, eq. 3-38..3-46.
    """

    version = "1.0.0"
    unrounded: ClassVar[dict[str, float]] = {"resolution": 0.0}

    scale = Parameter(1e3 * G0, "m/s2/A", "specific force per current, lambda (1 g0/mA)", above=0.0)
    k0 = Parameter(50.0 * UG, "1", "bias, in g0 (50 ug)")
    k1 = Parameter(1.0, "1", "scale factor against lambda", above=0.0)
    k2 = Parameter(20.0 * UG, "1", "second order in X, g0 per g0^2 (20 ug/g2)")
    k3 = Parameter(20.0 * UG, "1", "third order in X, g0 per g0^3 (20 ug/g3)")
    k4 = Parameter(20.0 * UG, "1", "cross term X Y, g0 per g0^2 (20 ug/g2)")
    k5 = Parameter(20.0 * UG, "1", "cross term X Z, g0 per g0^2 (20 ug/g2)")
    simulates = (turned("mount", ("accelerometer.mount.1", "accelerometer.mount.2", "accelerometer.mount.3")),)
    mount = Rotation("rows: accelerometer axes x, y, z in case axes")

    J = Parameter(1e-6, "kg.m2", "inertia of the pendulum about its hinge", above=0.0)
    C = Parameter(1e-3, "N.m.s/rad", "damping", above=0.0)
    K = Parameter(0.01, "N.m/rad", "stiffness of the hinge", above=0.0)
    P = Parameter(1e-4, "kg.m", "pendulosity, mass times length", above=0.0)
    K_p = Parameter(0.3, "A/rad", "proportional gain of the rebalance", min=0.0)
    K_i = Parameter(20.0, "A/(rad.s)", "integral gain of the rebalance", above=0.0)
    i_max = Parameter(1.5e-3, "A", "current limit: the input range is scale i_max", above=0.0)
    resolution = Parameter(0.0, "A", "resolution of the measured current; 0: none", min=0.0)

    turn_on = Noise(0.0, "m/s2", "rms of the turn-on bias, one value a run", per="start")
    markov = GaussMarkov(0.0, "m/s2", "Gauss-Markov bias")
    white = Noise(5.0 * UG * G0, "m/s2/sqrt(Hz)", "white acceleration noise density (5 ug/sqrt(Hz))")
    meter = Noise(1e-9, "A/sqrt(Hz)", "noise density of the current measurement")

    f = Input([0.0, 0.0, 0.0], "m/s2", "specific force a - G, case axes")

    i = Output("A", "rebalance current")
    i_read = Output("A", "rebalance current as measured")
    theta = Output("rad", "angle of the pendulum")
    saturated = Output("1", "1 while the current is limited")

    angle = State(0.0, "rad", "angle th of the pendulum")
    rate = State(0.0, "rad/s", "its rate")
    q = State(0.0, "rad.s", "integral of the angle")

    excess = Discrete(0.0, "A", "current command beyond the limit, at the start of the internal step")
    blocked = Discrete(0.0, "rad", "angle that is not integrated (limit reached, th pushes further), likewise")

    def start(self) -> None:
        torquer = self.scale * self.P  # N.m/A
        self.refuse(
            self.C * (self.K + torquer * self.K_p) <= self.J * torquer * self.K_i,
            "the rebalance is unstable: C (K + scale P K_p) must exceed J scale P K_i; here K_p = {K_p}, K_i = {K_i}",
        )
        self.limit()

    def command(self) -> Number:
        """Return the current command of the rebalance, without its limit."""
        return self.K_p * self.angle + self.K_i * self.q

    def limit(self) -> None:
        self.excess = self.command() - clip(self.command(), -self.i_max, self.i_max)
        self.blocked = self.angle if self.excess * self.angle > 0.0 else 0.0

    def flow(self) -> None:
        g = -(self.mount @ self.f) / G0
        slope = self.k1 + self.k2 * g[0] + self.k3 * g[0] * g[0] + self.k4 * g[1] + self.k5 * g[2]
        w = G0 * (self.k0 + slope * g[0]) + self.noise.turn_on + self.markov_value + self.noise.white
        current = self.command() - self.excess
        self.der.angle = self.rate
        self.der.rate = (self.P * (w - self.scale * current) - self.C * self.rate - self.K * self.angle) / self.J
        self.der.q = self.angle - self.blocked

    @sampled(every=1)
    def tick(self) -> None:
        self.limit()

    def outputs(self) -> None:
        self.i = clip(self.command(), -self.i_max, self.i_max)
        read = self.i + self.noise.meter
        if self.resolution > 0.0:
            read = self.resolution * floor(read / self.resolution + 0.5)
        self.i_read = read
        self.theta = self.angle
        self.saturated = 1.0 if self.i != self.command() else 0.0
