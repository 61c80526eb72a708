"""Attitude of a vehicle from rates, specific force and heading: rotations, alignment, what a Kalman filter is told.

The attitude is the quaternion q of the rotation from vehicle to ENU axes; C, its inverse as a matrix, takes ENU vectors
to vehicle axes: v = C v_ENU, C = R2(roll) R1(pitch) R3(heading)  [CONV-GIMBALS].
"""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.composition import Block, sampled
from gyrobench.component.declarations import Discrete, Input, Output, Parameter
from gyrobench.component.math import Number, Vector, asin, atan2, clip, cos, fabs, pi, sin, sqrt, vector

ZEROS = [0.0, 0.0, 0.0]


def quaternion_of(angle: Vector) -> Vector:
    """Return q of pitch, roll, heading: q_z(heading) q_x(pitch) q_y(roll)."""
    cp = cos(0.5 * angle[0])
    sp = sin(0.5 * angle[0])
    cr = cos(0.5 * angle[1])
    sr = sin(0.5 * angle[1])
    ch = cos(0.5 * angle[2])
    sh = sin(0.5 * angle[2])
    return vector(
        [
            ch * cp * cr - sh * sp * sr,
            ch * sp * cr - sh * cp * sr,
            ch * cp * sr + sh * sp * cr,
            ch * sp * sr + sh * cp * cr,
        ]
    )


def matrix_of(q: Vector) -> Vector:
    """Return C: rows are the vehicle axes in ENU."""
    w = q[0]
    x = q[1]
    y = q[2]
    z = q[3]
    first = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)]
    second = [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)]
    third = [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)]
    return vector([vector(first), vector(second), vector(third)])


def angles_of(C: Vector) -> Vector:
    """Return pitch, roll, heading; at a pitch of 90 deg roll and heading are not separate."""
    return vector([asin(clip(C[1][2], -1.0, 1.0)), atan2(-C[0][2], C[2][2]), atan2(-C[1][0], C[1][1])])


def turned(q: Vector, v: Vector) -> Vector:
    """Return q after a rotation of the vehicle by the rotation vector v (rad, vehicle axes), normalized."""
    size = sqrt(v @ v)
    half = 0.5 - size * size / 48.0  # sin(size/2)/size, to 1e-15 below 1e-3
    if size > 1e-3:
        half = sin(0.5 * size) / size
    c = cos(0.5 * size)
    x = half * v[0]
    y = half * v[1]
    z = half * v[2]
    made = vector(
        [
            q[0] * c - q[1] * x - q[2] * y - q[3] * z,
            q[1] * c + q[0] * x + q[2] * z - q[3] * y,
            q[2] * c + q[0] * y + q[3] * x - q[1] * z,
            q[3] * c + q[0] * z + q[1] * y - q[2] * x,
        ]
    )
    return vector(made / sqrt(made @ made))


class AttitudeEstimator(Component):
    """Ports of an attitude estimator, its alignment and the choice of readings; one step each communication step.

    Alignment: pitch and roll of the first specific force, the heading of the first reading, else heading_start.  Later
    the specific force counts only while its size is that of gravity, to `gate`: then usable = 1.  A slow acceleration
    of the vehicle passes any gate.
    """

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    latitude = Parameter(0.6981317007977318, "rad", "geographic latitude (40 deg)", min=-1.5708, max=1.5708)
    earth_rate = Parameter(7.2921159e-5, "rad/s", "Earth rate; 0: none", min=0.0)
    gravity = Parameter(9.80665, "m/s2", "local gravity", above=0.0)
    gate = Parameter(0.1, "m/s2", "largest difference of the specific force's size from gravity", above=0.0)
    heading_start = Parameter(0.0, "rad", "heading at the start, where none is read then")

    omega = Input(ZEROS, "rad/s", "inertial rate as measured, vehicle axes, mean over the communication step")
    f = Input([0.0, 0.0, 9.80665], "m/s2", "specific force a - G as measured, vehicle axes")
    heading = Input(0.0, "rad", "heading as read")
    heading_new = Input(0.0, "1", "1 in the step in which the heading is read")

    angle = Output("rad", "estimated pitch, roll, heading", shape=(3,))
    bias = Output("rad/s", "estimated biases of the rates", shape=(3,))
    aided = Output("1", "1 while the specific force is used")

    going = Discrete(0.0, "1", "0 before the alignment, 1 in its step, 2 after it")
    aligned = Discrete(ZEROS, "rad", "pitch, roll, heading of the alignment")
    usable = Discrete(0.0, "1", "1 while the specific force is used")
    b = Discrete(ZEROS, "rad/s", "estimated biases")

    @sampled(every=1)
    def look(self) -> None:
        size = sqrt(self.f @ self.f)
        self.usable = 1.0 if size > 0.0 and fabs(size - self.gravity) <= self.gate else 0.0
        if self.going < 0.5:
            if size > 0.0:
                self.aligned = self.level(size)
            if self.heading_new < 0.5:
                self.aligned[2] = self.heading_start
            self.going = 1.0
        else:
            self.going = 2.0

    def level(self, size: Number) -> Vector:
        """Return pitch and roll that the specific force shows, and the heading as read."""
        return vector([asin(clip(self.f[1] / size, -1.0, 1.0)), atan2(-self.f[0], self.f[2]), self.heading])

    def earth(self) -> Vector:
        """Return the Earth rate in ENU axes."""
        return vector([0.0, self.earth_rate * cos(self.latitude), self.earth_rate * sin(self.latitude)])

    def outputs(self) -> None:
        self.bias = self.b
        self.aided = self.usable if self.going > 1.5 else 0.0


class SensorNoise(Block):
    """Noise of gyros, accelerometers and heading that a Kalman filter assumes."""

    gyro = Parameter(0.05 / 60.0 * pi / 180.0, "rad/s/sqrt(Hz)", "white noise density of the rate", above=0.0)
    bias = Parameter(5.0 / 3600.0 * pi / 180.0, "rad/s", "rms of the gyro biases (5 deg/h)", min=0.0)
    tau = Parameter(3600.0, "s", "correlation time of the gyro biases", above=0.0)
    acc = Parameter(1e-3, "m/s2/sqrt(Hz)", "white noise density of the specific force", above=0.0)
    heading = Parameter(0.2 * pi / 180.0, "rad", "standard deviation of a heading reading (0.2 deg)", above=0.0)
    start = Parameter(pi / 180.0, "rad", "standard deviation of heading_start (1 deg)", above=0.0)
