from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.recorded_path import parabola, quintic
from gyrobench.component.math import Number, Vector, cos, cross, dot, index, pi, sin, sqrt, vector

REST, ANGLES, FLIGHT, PATH = 0.0, 1.0, 2.0, 3.0
NONE = [0.0, 0.0, 0.0]


class MovingTarget(Component):
    """Direction of a moving target against a fixed frame, its angular rate and acceleration.  [LOS-TARGET]

    The fixed frame is that of the tracker at the start: x right, y along the line of sight, z up.  With s the time
    since the motion began and u the unit vector to the target,

        kind 1  a = rate_1 s + amplitude_1 sin(2 pi f s)                        about x, up
                b = rate_2 s + amplitude_2 (sin(2 pi f s + lead) - sin lead)    about z, to the left
                u = (-sin b cos a, cos b cos a, sin a)
        kind 2  p = (0, distance, 0) + velocity s,  u = p / |p|                    straight flight, a crossing fly-by
        kind 3  a, b a recorded path of `points` instants, between them quintics as base_motion has them; beyond both
                ends the target rests

        omega = u x u',  alpha = u x u''     of a flight: omega = p x v / |p|2,  alpha = -2 omega (p v) / |p|2

    Motion begins in the phase `first`.  With both amplitudes alike and lead = 90 degrees the target goes in a circle.

    Not modelled: size and shape of the target, time of flight of the light, a curved flight but as a recorded path.
    Source: kinematics; line of sight of an inertially stabilized platform: Hilkert 2008.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one sample for each communication step", above=0.0)
    kind = Parameter(REST, int, "0 at rest, 1 angles, 2 straight flight, 3 recorded path", min=0, max=3)
    rate = Parameter([0.0, 0.0], "rad/s", "kind 1: constant rates about x and z")
    amplitude = Parameter([0.0, 0.0], "rad", "kind 1: sines about x and z")
    frequency = Parameter(0.1, "Hz", "kind 1: their frequency", above=0.0)
    lead = Parameter(0.0, "rad", "kind 1: phase by which the sine about z leads")
    distance = Parameter(1000.0, "m", "kind 2: distance at the start, along the line of sight", above=0.0)
    velocity = Parameter(NONE, "m/s", "kind 2: velocity along x, y, z")
    points = Parameter(0, int, "kind 3: number of points", min=0, max=400)
    path_t = Parameter([0.0] * 400, "s", "kind 3: times from 0 on, rising")
    path = Parameter([[0.0, 0.0]] * 400, "rad", "kind 3: angles a and b")
    first = Parameter(0, int, "number of the phase in which the motion begins; 0: at the start", min=0)

    phase = Input(0.0, "1", "number of the running phase")

    direction = Output("1", "unit vector to the target, fixed frame", shape=(3,))
    omega = Output("rad/s", "inertial rate of that direction, fixed frame", shape=(3,))
    alpha = Output("rad/s2", "its derivative", shape=(3,))

    since = Discrete(-1.0, "s", "time at which the motion began; -1: not yet")

    piece = Discrete(0.0, "1", "point of the path that was passed last, from 0")
    bad_point = Discrete(0.0, "1", "point under check")

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
        self.piece = 0.0
        if self.kind == PATH:
            self.refuse(self.points < 3.0, "a recorded path needs 3 points or more, points = {points}")
            self.refuse(self.path_t[0] != 0.0, "recorded path: its times begin with 0")
            for k in range(1, index(self.points)):
                self.bad_point = k + 1.0
                self.refuse(
                    self.path_t[k] <= self.path_t[index(k - 1.0)],
                    "recorded path: the time of point {bad_point} is not after that of the point before it",
                )

    @sampled(every=1)
    def tick(self) -> None:
        if self.since < 0.0 and self.phase >= self.first:
            self.since = self.t
        s = self.t - self.since if self.since >= 0.0 else 0.0
        between = self.kind == PATH and self.piece < self.points - 1.0
        if between and s >= self.path_t[index(self.piece + 1.0)]:
            for k in range(index(self.points)):
                if self.path_t[k] <= s:
                    self.piece = k

    def bend(self, k: Number, i: Number) -> Vector:
        """Return slope and curvature of angle i at a point of the path; 0 at both ends."""
        if k <= 0.0 or k >= self.points - 1.0:
            return vector([0.0, 0.0])
        before = self.path_t[index(k)] - self.path_t[index(k - 1.0)]
        after = self.path_t[index(k + 1.0)] - self.path_t[index(k)]
        p0 = self.path[index(k - 1.0)][index(i)]
        p1 = self.path[index(k)][index(i)]
        return parabola(before, after, p0, p1, self.path[index(k + 1.0)][index(i)])

    def recorded(self, s: Number, i: Number) -> Vector:
        """Return angle i of the path, its rate and its acceleration."""
        p0 = self.path[index(self.piece)][index(i)]
        if self.piece >= self.points - 1.0:
            return vector([p0, 0.0, 0.0])
        d = self.path_t[index(self.piece + 1.0)] - self.path_t[index(self.piece)]
        x = (s - self.path_t[index(self.piece)]) / d
        first = self.bend(self.piece, i)
        last = self.bend(self.piece + 1.0, i)
        end = self.path[index(self.piece + 1.0)][index(i)]
        return quintic(x, d, p0, end, first[0], first[1], last[0], last[1])

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
            w0 = 2.0 * pi * self.frequency
            x = w0 * s
            a = self.rate[0] * s + self.amplitude[0] * sin(x)
            b = self.rate[1] * s + self.amplitude[1] * (sin(x + self.lead) - sin(self.lead))
            da = self.rate[0] + w0 * self.amplitude[0] * cos(x)
            db = self.rate[1] + w0 * self.amplitude[1] * cos(x + self.lead)
            dda = -w0 * w0 * self.amplitude[0] * sin(x)
            ddb = -w0 * w0 * self.amplitude[1] * sin(x + self.lead)
            if self.kind == PATH:
                p = self.recorded(s, 0.0)
                q = self.recorded(s, 1.0)
                a = p[0]
                da = p[1]
                dda = p[2]
                b = q[0]
                db = q[1]
                ddb = q[2]
            on = on if self.kind != REST else 0.0
            a = on * a
            b = on * b
            da = on * da
            db = on * db
            dda = on * dda
            ddb = on * ddb
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
