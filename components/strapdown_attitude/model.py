from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, Rotation, sampled
from gyrobench.component.blocks.attitude import turned
from gyrobench.component.math import Vector, atan2, cos, cross, fabs, sin, sqrt, vector

NONE = [0.0, 0.0, 0.0]
UPRIGHT = [1.0, 0.0, 0.0, 0.0]


def conjugate(q: Vector) -> Vector:
    """Return the inverse of a unit quaternion."""
    return vector([q[0], -q[1], -q[2], -q[3]])


def product(a: Vector, b: Vector) -> Vector:
    """Return the quaternion a b."""
    return vector(
        [
            a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
            a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] + a[2] * b[0] + a[3] * b[1] - a[1] * b[3],
            a[0] * b[3] + a[3] * b[0] + a[1] * b[2] - a[2] * b[1],
        ]
    )


class StrapdownAttitude(Component):
    """The user of a strapdown unit: attitude and velocity from increments, and by how much they are off.

        phi = dtheta                                                                samples = 1
        phi = first + second + 2/3 first x second                                   samples = 2 (Miller 1983)
        q  <- exp(-Earth rate T) q exp(phi),   T: time since the last update
        p  = q q_reference^-1,   error: rotation vector of p p_0^-1 along the mean axes of the case
        drift: change of error over the step, by the step, + Earth rate x (rotation vector of p)    [TEST-CONING]

        dv = dvelocity                                                              samples = 1
        dv = first + second + 2/3 (phi_1 x second + first x phi_2)                  samples = 2 (Savage 1998b)
        dV = q [dv + (1 - cos p)/p^2 a x dv + (1 - sin p/p)/p^2 a x (a x dv)]       q of the update before; a: sum of
        acceleration = (dV - f_local T)/h at an update, else 0                      the increments, p = |a|
                                                                                    [TEST-SCULLING]
    While align = 1 the attitude is the reference, then it is the user's own.  The error is that of the last update; p_0
    is p as the gate opens, so that an oscillation of p (a filter is late) leaves nothing after whole periods.
    Not modelled: position (scrolling), velocity by Coriolis and transport rate, errors of the reference, delay of the
    computer.
    Source: Miller 1983; Savage 1998, 1998b; Bortz 1971.
    """

    version = "1.2.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    face = Rotation("rows: axes x, y, z of the case in table axes")
    samples = Parameter(1, int, "increments of one update: 1, or 2 with the coning between them", min=1, max=2)

    dtheta = Input(NONE, "rad", "angle increments, axes of the case")
    dvelocity = Input(NONE, "m/s", "velocity increments, axes of the case")
    number = Input(0.0, "1", "increments since the start")
    attitude = Input(UPRIGHT, "1", "reference: quaternion of the case without face, in table axes")
    omega_local = Input(NONE, "rad/s", "Earth rate, table axes")
    f_local = Input(NONE, "m/s2", "specific force at rest, table axes")
    align = Input(0.0, "1", "1: take the reference; 0: integrate")
    gate = Input(0.0, "1", "0: the error is not counted; else it is, from the first sample on")

    q = Discrete(UPRIGHT, "1", "attitude of the user, of the last update")
    p = Discrete(UPRIGHT, "1", "attitude against the reference, of the last update")
    p_0 = Discrete(UPRIGHT, "1", "that as the gate opened")
    counted = Discrete(0.0, "1", "1 while the error is counted")
    off = Discrete(NONE, "rad", "error of the attitude")
    change = Discrete(NONE, "rad/s", "its change over the step, by the step, but for what the Earth's rate turns")
    seen = Discrete(0.0, "1", "increments seen")
    first = Discrete(NONE, "rad", "first increment of two")
    first_velocity = Discrete(NONE, "m/s", "first velocity increment of two")
    gained = Discrete(NONE, "m/s2", "velocity beyond that of f_local in the step, by the step")
    waiting = Discrete(0.0, "1", "1: the first of two increments is there")
    t_update = Discrete(0.0, "s", "time of the last update")

    error = Output("rad", "error of the attitude, mean axes of the case", shape=(3,))
    drift = Output("rad/s", "its change over the step, by the step, but for what the Earth's rate turns", shape=(3,))
    acceleration = Output("m/s2", "velocity gained beyond f_local in the step, by the step, table axes", shape=(3,))

    def start(self) -> None:
        self.q = self.attitude
        self.seen = self.number
        self.t_update = self.t

    def plate(self, v: Vector) -> Vector:
        """Return a vector of case axes in those of the plate."""
        out = vector([0.0, 0.0, 0.0])
        for j in range(3):
            out[j] = self.face[0][j] * v[0] + self.face[1][j] * v[1] + self.face[2][j] * v[2]
        return vector(out)

    def gain(self, angle: Vector, dv: Vector) -> None:
        """Take the velocity of an update in the axes of its begin: that of a constant rate and force, exactly."""
        p2 = angle @ angle
        once = cross(angle, dv)
        first = 0.5
        second = 1.0 / 6.0
        if p2 > 1e-8:
            p = sqrt(p2)
            first = (1.0 - cos(p)) / p2
            second = (1.0 - sin(p) / p) / p2
        body = vector(dv + first * once + second * cross(angle, once))
        rest = (self.t - self.t_update) * vector(self.f_local)
        whole = product(product(vector(self.q), vector([0.0, body[0], body[1], body[2]])), conjugate(vector(self.q)))
        self.gained = (vector([whole[1], whole[2], whole[3]]) - rest) / self.h

    def update(self, phi: Vector) -> None:
        """Turn the attitude by phi (axes of the plate), and the reference frame by the Earth's rate."""
        away = turned(vector(UPRIGHT), (self.t_update - self.t) * vector(self.omega_local))
        self.q = product(away, turned(vector(self.q), phi))
        if self.align > 0.5:
            self.q = self.attitude
        self.t_update = self.t
        self.p = product(vector(self.q), conjugate(vector(self.attitude)))

    @sampled(every=1)
    def tick(self) -> None:
        before = vector(self.off)
        self.gained = vector(NONE)
        if self.number > self.seen:
            self.seen = self.number
            now = self.plate(vector(self.dtheta))
            dv = self.plate(vector(self.dvelocity))
            if self.samples < 1.5:
                self.gain(now, dv)
                self.update(now)
            elif self.waiting > 0.5:
                self.waiting = 0.0
                one = vector(self.first)
                v = vector(self.first_velocity)
                self.gain(vector(one + now), vector(v + dv + (2.0 / 3.0) * (cross(one, dv) + cross(v, now))))
                self.update(vector(one + now + (2.0 / 3.0) * cross(one, now)))
            else:
                self.waiting = 1.0
                self.first = now
                self.first_velocity = dv
        if self.counted < 0.5 or self.gate < 0.5:
            self.p_0 = self.p
            before = vector(NONE)
        self.counted = self.gate
        wrong = product(vector(self.p), conjugate(vector(self.p_0)))
        axis = vector([wrong[1], wrong[2], wrong[3]])
        size = sqrt(axis @ axis)
        grown = 2.0
        if size > 1e-8:
            grown = 2.0 * atan2(size, fabs(wrong[0])) / size
        grown = -grown if wrong[0] < 0.0 else grown
        self.off = self.face @ (grown * axis)
        whole = 2.0 * vector([self.p[1], self.p[2], self.p[3]])
        whole = -whole if self.p[0] < 0.0 else whole
        turned_along = self.face @ cross(vector(self.omega_local), whole)
        self.change = (vector(self.off) - before) / self.h + turned_along

    def outputs(self) -> None:
        self.error = self.off
        self.drift = self.change
        self.acceleration = self.gained
