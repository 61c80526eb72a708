from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, State, sampled
from gyrobench.component.math import Number, asin, atan2, clip, cos, cross, index, pi, sign, sin, sqrt, vector

NONE = [0.0] * 99
VERTICAL = 1e-24  # square of the cosine of a pitch that counts as 90 deg


class Manoeuvre(Component):
    """Motion of a vehicle as a list of manoeuvres, one for each phase of a plan.  [VERTICAL-GYRO, PLATFORM-4GIMBAL]

    Axes x right, y forward, z up.  While the gate is open the row of the phase acts; else the vehicle rests as it is:

        forward, right   accelerations along the heading and across it, level (m/s2)
        turn             rate about the vertical, counter-clockwise from above; brings speed * turn towards the left
        pitch, roll, yaw rates about the vehicle's x, y and z axis
        frequency        0: all of it as given; else times sin(2 pi frequency s), s since the gate opened (a wobble)

    The attitude is the quaternion of the rotation from vehicle to ENU axes; with C its inverse as a matrix:

        omega = C (0, w cos(lat), w sin(lat) + turn) + (pitch, roll, yaw)        f = C (a + (0, 0, gravity))

    angle is (pitch, roll, heading) in the order heading, pitch, roll [CONV-GIMBALS]: v = R2(roll) R1(pitch)
    R3(heading) v_ENU, pitch within +-90 deg; roll is 0 at +-90 deg.  Rates begin and end at once: alpha is their
    derivative between the jumps.

    Not modelled: flight mechanics (bank and turn are given apart), transport rate, change of speed by acceleration.
    Source: our own.
    """

    version = "1.2.0"
    integrator = "rk4"
    rk4_substeps = 1

    latitude = Parameter(0.6981317007977318, "rad", "geographic latitude (40 deg)", min=-1.5708, max=1.5708)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "Earth rate; 0: none", min=0.0)
    gravity = Parameter(9.80665, "m/s2", "local gravity", above=0.0)
    speed = Parameter(0.0, "m/s", "speed along the heading", min=0.0)
    start_angle = Parameter([0.0, 0.0, 0.0], "rad", "pitch, roll, heading at the start")
    forward = Parameter(NONE, "m/s2", "of each phase: acceleration along the heading")
    right = Parameter(NONE, "m/s2", "of each phase: acceleration to the right, level")
    turn = Parameter(NONE, "rad/s", "of each phase: rate about the vertical")
    pitch = Parameter(NONE, "rad/s", "of each phase: rate about x")
    roll = Parameter(NONE, "rad/s", "of each phase: rate about y")
    yaw = Parameter(NONE, "rad/s", "of each phase: rate about z")
    frequency = Parameter(NONE, "Hz", "of each phase: of a wobble; 0: none", min=0.0)

    phase = Input(1.0, "1", "number of the running phase, from 1")
    gate = Input(0.0, "1", "1 while the manoeuvre acts")

    angle = Output("rad", "pitch about x, roll about y, heading about z", shape=(3,))
    omega = Output("rad/s", "inertial rate, vehicle axes", shape=(3,))
    alpha = Output("rad/s2", "angular acceleration, vehicle axes, without the jumps", shape=(3,))
    f = Output("m/s2", "specific force, vehicle axes", shape=(3,))

    q = State([1.0, 0.0, 0.0, 0.0], "1", "rotation from vehicle to ENU axes")

    opened = Discrete(0.0, "s", "when the gate opened")

    def start(self) -> None:
        # q = q_z(heading) q_x(pitch) q_y(roll), half angles
        ch = cos(0.5 * self.start_angle[2])
        sh = sin(0.5 * self.start_angle[2])
        cp = cos(0.5 * self.start_angle[0])
        sp = sin(0.5 * self.start_angle[0])
        cr = cos(0.5 * self.start_angle[1])
        sr = sin(0.5 * self.start_angle[1])
        self.q[0] = ch * cp * cr - sh * sp * sr
        self.q[1] = ch * sp * cr - sh * cp * sr
        self.q[2] = ch * cp * sr + sh * sp * cr
        self.q[3] = ch * sp * sr + sh * cp * cr

    def open(self) -> Number:
        """Return the factor by which the row acts, 0 while the gate is closed."""
        f = self.frequency[index(clip(self.phase - 1.0, 0.0, 98.0))]
        return self.gated() * (sin(2.0 * pi * f * (self.t - self.opened)) if f > 0.0 else 1.0)

    def opening(self) -> Number:
        """Return its derivative, 1/s."""
        w = 2.0 * pi * self.frequency[index(clip(self.phase - 1.0, 0.0, 98.0))]
        return self.gated() * w * cos(w * (self.t - self.opened))

    def gated(self) -> Number:
        return 1.0 if self.gate > 0.5 and self.phase > 0.5 and self.phase < 99.5 else 0.0

    def flow(self) -> None:
        k = clip(self.phase - 1.0, 0.0, 98.0)
        on = self.open()
        z = on * self.turn[index(k)]
        yaw = on * self.yaw[index(k)]
        x = on * self.pitch[index(k)]
        y = on * self.roll[index(k)]
        # q' = (turn in ENU axes, from the left, and pitch, roll, yaw in vehicle axes, from the right) / 2
        self.der.q[0] = 0.5 * (-(z + yaw) * self.q[3] - x * self.q[1] - y * self.q[2])
        self.der.q[1] = 0.5 * ((yaw - z) * self.q[2] + x * self.q[0] - y * self.q[3])
        self.der.q[2] = 0.5 * ((z - yaw) * self.q[1] + x * self.q[3] + y * self.q[0])
        self.der.q[3] = 0.5 * ((z + yaw) * self.q[0] - x * self.q[2] + y * self.q[1])

    @sampled(every=1)
    def tick(self) -> None:
        self.q = self.q / sqrt(self.q @ self.q)
        if self.gate <= 0.5:
            self.opened = self.t

    def outputs(self) -> None:
        k = clip(self.phase - 1.0, 0.0, 98.0)
        on = self.open()
        w = self.q[0]
        x = self.q[1]
        y = self.q[2]
        z = self.q[3]
        # C: rows are the vehicle axes in ENU
        c = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]
        c[0][0] = 1.0 - 2.0 * (y * y + z * z)
        c[0][1] = 2.0 * (x * y + w * z)
        c[0][2] = 2.0 * (x * z - w * y)
        c[1][0] = 2.0 * (x * y - w * z)
        c[1][1] = 1.0 - 2.0 * (x * x + z * z)
        c[1][2] = 2.0 * (y * z + w * x)
        c[2][0] = 2.0 * (x * z + w * y)
        c[2][1] = 2.0 * (y * z - w * x)
        c[2][2] = 1.0 - 2.0 * (x * x + y * y)
        if c[1][0] * c[1][0] + c[1][1] * c[1][1] > VERTICAL:
            heading = atan2(-c[1][0], c[1][1])
            self.angle[0] = asin(clip(c[1][2], -1.0, 1.0))
            self.angle[1] = atan2(-c[0][2], c[2][2])
        else:  # roll and heading turn about the same axis: roll is 0; no derivative of either exists
            heading = atan2(c[0][1], c[0][0])
            self.angle[0] = 0.5 * pi * sign(c[1][2])
            self.angle[1] = 0.0
        self.angle[2] = heading
        ahead = on * self.forward[index(k)]
        across = on * (self.right[index(k)] - self.speed * self.turn[index(k)])
        east = across * cos(heading) - ahead * sin(heading)
        north = across * sin(heading) + ahead * cos(heading)
        rate_n = self.earth_rate * cos(self.latitude)
        rate_u = self.earth_rate * sin(self.latitude) + on * self.turn[index(k)]
        rises = self.opening()
        own = vector([self.pitch[index(k)], self.roll[index(k)], self.yaw[index(k)]])
        given = vector([0.0, 0.0, 0.0])  # the rate of the ENU axes and the turn; rate against the Earth
        rel = vector([0.0, 0.0, 0.0])
        for j in range(3):
            given[j] = c[j][1] * rate_n + c[j][2] * rate_u
            rel[j] = on * (c[j][2] * self.turn[index(k)] + own[j])
            self.f[j] = c[j][0] * east + c[j][1] * north + c[j][2] * self.gravity
            self.alpha[j] = rises * (c[j][2] * self.turn[index(k)] + own[j])
        self.omega = given + on * own
        self.alpha = self.alpha - cross(rel, given)
