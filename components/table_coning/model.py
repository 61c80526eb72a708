from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, Rotation, sampled
from gyrobench.component.math import Vector, clip, cos, cross, fabs, pi, sin, vector
from gyrobench.component.set_up import each

NONE = [0.0, 0.0, 0.0]
WIDEST = 0.5  # rad


class TableConing(Component):
    """Table whose plate cones about the vertical: an axis of the case goes round a cone, the case does not turn.

        rotation vector of the plate in table axes (east, north, up)    theta n,   n = (cos psi, sin psi, 0)
        w = theta' n + sin(theta) n' - (1 - cos theta) n x n'           body rate          [TEST-CONING; Bortz 1971]
        omega = face (mean of w over the step + C Earth rate + C (0, 0, twist)),   f = face C f_local

    psi = 2 pi frequency (t - begin of the phase); theta opens from 0 to (1 + angle_gain) half_angle by (1 - cos)/2
    within ramp, and closes by the same law when the phase is over, before that of the next one opens.  The mean of w is
    exact while the half-angle is constant: sin(theta) (n2 - n1) and -(1 - cos theta)(psi2 - psi1) over h.  attitude is
    the quaternion of the plate without face, as the table reads it: a twist about the axis of the cone while it is open
    is not in it.
    Not modelled: servo and resonances of the table, distance of the instrument from the tip of the cone, what twist
    does to the direction of gravity and Earth rate.
    Source: Goodman 1958; Bortz 1971; own form.
    """

    version = "1.0.0"

    simulates = (each("twist", ("table.twist",)), each("angle_gain", ("table.angle_gain",)))

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    face = Rotation("rows: axes x, y, z of the case in table axes")
    ramp = Parameter(0.5, "s", "time in which the cone opens, and closes", above=0.0)
    angle_gain = Parameter(0.0, "1", "relative error of the half-angle", above=-1.0)
    twist = Parameter(0.0, "rad/s", "turn about the axis of an open cone that the table does not read")

    f_local = Input([0.0, 0.0, 9.80665], "m/s2", "specific force at the site, ENU")
    omega_local = Input(NONE, "rad/s", "Earth rate at the site, ENU")
    phase = Input(1.0, "1", "running phase: another one opens another cone")
    frequency_wanted = Input(0.0, "Hz", "frequency of the cone in this phase; negative: the other sense")
    half_angle_wanted = Input(0.0, "rad", "its half-angle, up to 0.5 rad")

    omega = Output("rad/s", "inertial rate, mean of the step, axes of the case", shape=(3,))
    f = Output("m/s2", "specific force, axes of the case", shape=(3,))
    attitude = Output("1", "quaternion of the plate in table axes, as read", shape=(4,))
    half_angle = Output("rad", "half-angle of the cone")
    closing = Output("1", "1 while the cone of the phase before closes")
    angle = Output("rad", "angle of the plate about the vertical: none")
    in_position = Output("1", "1: there is nowhere to go to")

    part = Discrete(1.0, "1", "phase whose cone is open")
    frequency = Discrete(0.0, "Hz", "its frequency")
    size = Discrete(0.0, "rad", "its half-angle")
    t_begin = Discrete(0.0, "s", "begin of its cone")
    t_end = Discrete(-1.0, "s", "begin of its end; -1: goes on")
    theta = Discrete(0.0, "rad", "half-angle at the sample")
    psi = Discrete(0.0, "rad", "angle of the axis about the vertical")
    mean = Discrete(NONE, "rad/s", "mean rate of the step, plate axes, without the Earth's")
    earth = Discrete(NONE, "rad/s", "Earth rate and twist at the sample, plate axes")
    steady = Discrete(NONE, "rad/s", "their mean over the step")

    def start(self) -> None:
        self.open()
        self.earth = self.omega_local
        self.steady = self.earth

    def open(self) -> None:
        """Begin the cone of the running phase."""
        self.part = self.phase
        self.frequency = self.frequency_wanted
        self.size = clip((1.0 + self.angle_gain) * self.half_angle_wanted, 0.0, WIDEST)
        self.t_begin = self.t
        self.t_end = -1.0

    def seen(self, v: Vector) -> Vector:
        """Return a vector of table axes in plate axes: v - sin(theta) n x v + (1 - cos theta) n x (n x v)."""
        n = vector([cos(self.psi), sin(self.psi), 0.0])
        once = cross(n, v)
        return vector(v - sin(self.theta) * once + (1.0 - cos(self.theta)) * cross(n, once))

    def opened(self) -> None:
        """Set half-angle and angle of the axis at the sample."""
        since = self.t - self.t_begin
        w = 1.0
        if since < self.ramp:
            w = 0.5 - 0.5 * cos(pi * since / self.ramp)
        if self.t_end >= 0.0:
            gone = self.t - self.t_end
            w = w * (0.5 + 0.5 * cos(pi * gone / self.ramp)) if gone < self.ramp else 0.0
        self.theta = self.size * w
        self.psi = 2.0 * pi * self.frequency * since

    @sampled(every=1)
    def tick(self) -> None:
        theta = self.theta
        psi = self.psi
        if self.t_end < 0.0 and fabs(self.phase - self.part) > 0.5:
            self.t_end = self.t
        if self.t_end >= 0.0 and self.t - self.t_end > self.ramp:
            self.open()
            psi = 0.0  # the cone is closed: its axis has no direction
        self.opened()
        s1 = sin(theta)
        s2 = sin(self.theta)
        slip = 0.5 * (self.theta - theta)
        c1 = 1.0 - cos(theta)
        c2 = 1.0 - cos(self.theta)
        self.mean[0] = ((s2 + slip * c2) * cos(self.psi) - (s1 - slip * c1) * cos(psi)) / self.h
        self.mean[1] = ((s2 + slip * c2) * sin(self.psi) - (s1 - slip * c1) * sin(psi)) / self.h
        self.mean[2] = -0.5 * (c1 + c2) * (self.psi - psi) / self.h
        before = vector(self.earth)
        twist = self.twist * self.theta / self.size if self.size > 0.0 else 0.0
        self.earth = self.seen(vector(self.omega_local) + vector([0.0, 0.0, twist]))
        self.steady = 0.5 * (before + self.earth)

    def outputs(self) -> None:
        self.omega = self.face @ (vector(self.mean) + self.steady)
        self.f = self.face @ self.seen(vector(self.f_local))
        half = sin(0.5 * self.theta)
        self.attitude = vector([cos(0.5 * self.theta), half * cos(self.psi), half * sin(self.psi), 0.0])
        self.half_angle = self.theta
        self.closing = 1.0 if self.t_end >= 0.0 else 0.0
        self.angle = 0.0
        self.in_position = 1.0
