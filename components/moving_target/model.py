from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.math import cos, cross, dot, pi, sin, sqrt, vector

REST, ANGLES, FLIGHT = 0.0, 1.0, 2.0
NONE = [0.0, 0.0, 0.0]


class MovingTarget(Component):
    """Direction of a moving target against a fixed frame, its angular rate and acceleration.  [LOS-TARGET]

    The fixed frame is that of the tracker at the start: x right, y along the line of sight, z up.  With s the time
    since the motion began and u the unit vector to the target,

        kind 1  a = rate_1 s + amplitude_1 sin(2 pi f s)                        about x, up
                b = rate_2 s + amplitude_2 (sin(2 pi f s + lead) - sin lead)    about z, to the left
                u = (-sin b cos a, cos b cos a, sin a)
        kind 2  p = (0, distance, 0) + velocity s,  u = p / |p|                    straight flight, a crossing fly-by

        omega = u x u',  alpha = u x u''     of a flight: omega = p x v / |p|2,  alpha = -2 omega (p v) / |p|2

    Motion begins in the phase `first`.  With both amplitudes alike and lead = 90 degrees the target goes in a circle.

    Not modelled: size and shape of the target, time of flight of the light, flight that is not straight.
    Source: kinematics; line of sight of an inertially stabilized platform: Hilkert 2008.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    kind = Parameter(REST, int, "0 at rest, 1 angles, 2 straight flight", min=0, max=2)
    rate = Parameter([0.0, 0.0], "rad/s", "kind 1: constant rates about x and z")
    amplitude = Parameter([0.0, 0.0], "rad", "kind 1: sines about x and z")
    frequency = Parameter(0.1, "Hz", "kind 1: their frequency", above=0.0)
    lead = Parameter(0.0, "rad", "kind 1: phase by which the sine about z leads")
    distance = Parameter(1000.0, "m", "kind 2: distance at the start, along the line of sight", above=0.0)
    velocity = Parameter(NONE, "m/s", "kind 2: velocity along x, y, z")
    first = Parameter(0, int, "number of the phase in which the motion begins; 0: at the start", min=0)

    phase = Input(0.0, "1", "number of the running phase")

    direction = Output("1", "unit vector to the target, fixed frame", shape=(3,))
    omega = Output("rad/s", "inertial rate of that direction, fixed frame", shape=(3,))
    alpha = Output("rad/s2", "its derivative", shape=(3,))

    since = Discrete(-1.0, "s", "time at which the motion began; -1: not yet")

    def start(self) -> None:
        self.since = self.t if self.first == 0.0 else -1.0
        v = vector(self.velocity)
        p = vector([0.0, self.distance, 0.0])
        # distance of the closest approach, which lies ahead where the target comes nearer
        near = dot(cross(p, v), cross(p, v))
        self.refuse(
            self.kind == FLIGHT and v[1] < 0.0 and near < 1e-6 * self.distance * self.distance * dot(v, v),
            "velocity leads through the tracker: no direction there; let it pass by",
        )

    @sampled(every=1)
    def tick(self) -> None:
        if self.since < 0.0 and self.phase >= self.first:
            self.since = self.t

    def outputs(self) -> None:
        s = self.t - self.since if self.since >= 0.0 else 0.0
        on = 1.0 if self.since >= 0.0 else 0.0
        if self.kind == FLIGHT:
            v = on * vector(self.velocity)
            p = vector([0.0, self.distance, 0.0]) + s * v
            square = dot(p, p)
            self.direction = p / sqrt(square)
            w = cross(p, v) / square
            self.omega = w
            self.alpha = w * (-2.0 * dot(p, v) / square)
        else:
            on = on if self.kind == ANGLES else 0.0
            w0 = 2.0 * pi * self.frequency
            x = w0 * s
            a = on * (self.rate[0] * s + self.amplitude[0] * sin(x))
            b = on * (self.rate[1] * s + self.amplitude[1] * (sin(x + self.lead) - sin(self.lead)))
            da = on * (self.rate[0] + w0 * self.amplitude[0] * cos(x))
            db = on * (self.rate[1] + w0 * self.amplitude[1] * cos(x + self.lead))
            dda = -on * w0 * w0 * self.amplitude[0] * sin(x)
            ddb = -on * w0 * w0 * self.amplitude[1] * sin(x + self.lead)
            u = vector([-sin(b) * cos(a), cos(b) * cos(a), sin(a)])
            n = vector([cos(b), sin(b), 0.0])  # the axis of a
            z = vector([0.0, 0.0, 1.0])
            w = da * n + db * (z - sin(a) * u)
            self.direction = u
            self.omega = w
            turn = vector([-sin(b), cos(b), 0.0])
            self.alpha = (
                dda * n + da * db * turn + ddb * (z - sin(a) * u) - db * (cos(a) * da * u + sin(a) * cross(w, u))
            )
