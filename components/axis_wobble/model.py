from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import cos, index, sin

ZERO = [0.0, 0.0, 0.0]


class AxisWobble(Component):
    """Wobble of the axis of a turntable: rate and specific force of the table's base.  [ch. 5.4; as in table_two_axis]

        v = R_m(q2) R_j(q1) v_base,   q1 = amplitude cos(order angle + phase),  q2 = amplitude sin(order angle + phase)

    j, m are the axes after `axis` in turn (1 2 3 1 ...), R passive rotations; rates go through the same rotations and
    take up q1', q2'.  The part stands before the table: `f`, `omega` go to its f_local, omega_local, its `angle` comes
    back.  q1, q2 follow the angle at the end of a step, their rates are means over it, so that their integral is exact.

    Not modelled: wobble that is not a single harmonic, runout (shift of the axis), angular acceleration.
    Source: TABLE-PRESETS (wobble 0.25 to 5 arcsec); Hu 1981, section 5.4.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    axis = Parameter(1, int, "which of the three axes is the one that wobbles", min=1, max=3)
    amplitude = Parameter(0.0, "rad", "wobble amplitude", min=0.0, max=0.1)
    order = Parameter(2, int, "its cycles per turn", min=1, max=1000)
    phase = Parameter(0.0, "rad", "its phase at angle 0")

    angle = Input(0.0, "rad", "table angle")
    f_base = Input(ZERO, "m/s2", "specific force along the axes of what carries the table")
    omega_base = Input(ZERO, "rad/s", "inertial rate along them")

    f = Output("m/s2", "specific force along the axes that wobble", shape=(3,))
    omega = Output("rad/s", "inertial rate along them", shape=(3,))

    q = Discrete([0.0, 0.0], "rad", "q1 and q2")
    rate = Discrete([0.0, 0.0], "rad/s", "their rates")

    def start(self) -> None:
        self.q[0] = self.amplitude * cos(self.order * self.angle + self.phase)
        self.q[1] = self.amplitude * sin(self.order * self.angle + self.phase)

    @sampled(every=1)
    def tick(self) -> None:
        if self.amplitude > 0.0:
            first = self.amplitude * cos(self.order * self.angle + self.phase)
            second = self.amplitude * sin(self.order * self.angle + self.phase)
            self.rate[0] = (first - self.q[0]) / self.h
            self.rate[1] = (second - self.q[1]) / self.h
            self.q[0] = first
            self.q[1] = second

    def outputs(self) -> None:
        w = [self.omega_base[0], self.omega_base[1], self.omega_base[2]]
        g = [self.f_base[0], self.f_base[1], self.f_base[2]]
        if self.amplitude > 0.0:
            for n in range(2):
                e = self.axis + n  # the axis it turns about, from 0: j, then m
                e = e - 3.0 if e > 2.0 else e
                a = e + 1.0 if e < 2.0 else 0.0  # the two that turn
                b = a + 1.0 if a < 2.0 else 0.0
                c = cos(self.q[n])
                s = sin(self.q[n])
                first = c * w[index(a)] + s * w[index(b)]
                w[index(b)] = c * w[index(b)] - s * w[index(a)]
                w[index(a)] = first
                w[index(e)] = w[index(e)] + self.rate[n]
                first = c * g[index(a)] + s * g[index(b)]
                g[index(b)] = c * g[index(b)] - s * g[index(a)]
                g[index(a)] = first
        for k in range(3):
            self.omega[k] = w[k]
            self.f[k] = g[k]
