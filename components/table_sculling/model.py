from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, Rotation, sampled
from gyrobench.component.math import Vector, clip, cos, cross, fabs, pi, sin, vector
from gyrobench.component.set_up import each

NONE = [0.0, 0.0, 0.0]
WIDEST = 0.5  # rad


class TableSculling(Component):
    """Table that rocks about one horizontal axis and shakes along the other, at one frequency.  [TEST-SCULLING]

        theta = (1 + angle_gain) angle sin(psi)                          about the first axis of the table (east)
        a     = (1 + force_gain) vibration sin(psi + phase_error)        along the second (north)
        omega = face (mean of theta' + C Earth rate),   f = face C (f_local + (0, a, 0)) + size effect
        size effect of the accelerometer i, at levers[i]:   theta'' e x r + theta'^2 e x (e x r),   e: axis of theta

    psi = 2 pi frequency (t - begin of the phase); both motions open by (1 - cos)/2 within ramp and close by the same
    law when the phase is over.  f is the mean over the step (Simpson's rule), omega too; attitude is the quaternion of
    the plate without face, as the table reads it.
    Not modelled: servo and resonances of the table, motion along and about its other axes, the velocity that is left
    when the vibration has opened (no reading takes it in), the change of theta' by the opening in the size effect.
    Source: Savage 1998b (sculling, size effect); own form.
    """

    version = "1.0.0"

    simulates = (
        each("phase_error", ("table.phase_error",)),
        each("angle_gain", ("table.angle_gain",)),
        each("force_gain", ("table.force_gain",)),
    )

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    face = Rotation("rows: axes x, y, z of the case in table axes")
    ramp = Parameter(0.5, "s", "time in which the motion opens, and closes", above=0.0)
    vibration = Parameter(5.0, "m/s2", "amplitude of the vibration; none at frequency 0")
    phase_error = Parameter(0.0, "rad", "phase of the vibration against the angle")
    angle_gain = Parameter(0.0, "1", "relative error of the angle", above=-1.0)
    force_gain = Parameter(0.0, "1", "relative error of the vibration", above=-1.0)
    levers = Parameter([NONE, NONE, NONE], "m", "rows: accelerometers x, y, z from the axis of the angle, case axes")

    f_local = Input([0.0, 0.0, 9.80665], "m/s2", "specific force at the site, ENU")
    omega_local = Input(NONE, "rad/s", "Earth rate at the site, ENU")
    phase = Input(1.0, "1", "running phase: another one opens another motion")
    frequency_wanted = Input(0.0, "Hz", "frequency of the motion in this phase")
    angle_wanted = Input(0.0, "rad", "amplitude of the angle, up to 0.5 rad")

    omega = Output("rad/s", "inertial rate, mean of the step, axes of the case", shape=(3,))
    f = Output("m/s2", "specific force at the accelerometers, mean of the step, axes of the case", shape=(3,))
    attitude = Output("1", "quaternion of the plate in table axes, as read", shape=(4,))
    closing = Output("1", "1 while the motion of the phase before closes")
    angle = Output("rad", "angle of the plate about the vertical: none")
    in_position = Output("1", "1: there is nowhere to go to")

    part = Discrete(1.0, "1", "phase whose motion is open")
    frequency = Discrete(0.0, "Hz", "its frequency")
    size = Discrete(0.0, "rad", "amplitude of its angle")
    shake = Discrete(0.0, "m/s2", "amplitude of its vibration")
    t_begin = Discrete(0.0, "s", "begin of its motion")
    t_end = Discrete(-1.0, "s", "begin of its end; -1: goes on")
    theta = Discrete(0.0, "rad", "angle at the sample")
    earth = Discrete(NONE, "rad/s", "Earth rate at the sample, plate axes")
    mean = Discrete(NONE, "rad/s", "rate, mean of the step, plate axes")
    force = Discrete(NONE, "m/s2", "specific force at the sample, case axes")
    given = Discrete(NONE, "m/s2", "its mean over the step")

    def start(self) -> None:
        self.open()
        self.earth = self.omega_local
        self.mean = self.earth
        self.force = self.force_at(self.t)
        self.given = self.force

    def open(self) -> None:
        """Begin the motion of the running phase."""
        self.part = self.phase
        self.frequency = self.frequency_wanted
        moving = 1.0 if fabs(self.frequency) > 0.0 else 0.0
        self.size = moving * clip((1.0 + self.angle_gain) * self.angle_wanted, -WIDEST, WIDEST)
        self.shake = moving * (1.0 + self.force_gain) * self.vibration
        self.t_begin = self.t
        self.t_end = -1.0

    def opening(self, t: float) -> float:
        """Return the share of the motion that is open at t."""
        w = 1.0
        if t - self.t_begin < self.ramp:
            w = 0.5 - 0.5 * cos(pi * (t - self.t_begin) / self.ramp)
        if self.t_end >= 0.0:
            gone = t - self.t_end
            w = w * (0.5 + 0.5 * cos(pi * gone / self.ramp)) if gone < self.ramp else 0.0
        return w

    def seen(self, v: Vector, theta: float) -> Vector:
        """Return a vector of table axes in plate axes."""
        c = cos(theta)
        s = sin(theta)
        return vector([v[0], c * v[1] + s * v[2], c * v[2] - s * v[1]])

    def force_at(self, t: float) -> Vector:
        """Return the specific force at the accelerometers at t, case axes."""
        w = 2.0 * pi * self.frequency
        psi = w * (t - self.t_begin)
        size = self.opening(t) * self.size
        shaken = vector([0.0, self.opening(t) * self.shake * sin(psi + self.phase_error), 0.0])
        out = vector(self.face @ self.seen(vector(self.f_local) + shaken, size * sin(psi)))
        e = vector([self.face[0][0], self.face[1][0], self.face[2][0]])
        turning = -w * w * size * sin(psi)
        square = w * w * size * size * cos(psi) * cos(psi)
        for i in range(3):
            r = vector([self.levers[i][0], self.levers[i][1], self.levers[i][2]])
            across = cross(e, r)
            away = cross(e, across)
            out[i] = out[i] + turning * across[i] + square * away[i]
        return vector(out)

    @sampled(every=1)
    def tick(self) -> None:
        before = self.theta
        if self.t_end < 0.0 and fabs(self.phase - self.part) > 0.5:
            self.t_end = self.t
        if self.t_end >= 0.0 and self.t - self.t_end > self.ramp:
            self.open()
            self.force = self.force_at(self.t)
        middle = self.force_at(self.t - 0.5 * self.h)
        now = self.force_at(self.t)
        self.given = (1.0 / 6.0) * (vector(self.force) + 4.0 * middle + now)
        self.force = now
        psi = 2.0 * pi * self.frequency * (self.t - self.t_begin)
        self.theta = self.opening(self.t) * self.size * sin(psi)
        earth = self.seen(vector(self.omega_local), self.theta)
        self.mean = 0.5 * (vector(self.earth) + earth)
        self.mean[0] = self.mean[0] + (self.theta - before) / self.h
        self.earth = earth

    def outputs(self) -> None:
        half = 0.5 * self.theta
        self.omega = self.face @ vector(self.mean)
        self.f = self.given
        self.attitude = vector([cos(half), sin(half), 0.0, 0.0])
        self.closing = 1.0 if self.t_end >= 0.0 else 0.0
        self.angle = 0.0
        self.in_position = 1.0
