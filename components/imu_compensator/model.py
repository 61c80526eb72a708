from __future__ import annotations

from gyrobench.component import Input, Output, Parameter
from gyrobench.component.blocks.thermal import TemperatureHistory, ThermalErrors
from gyrobench.component.math import Number, Vector, cross, dot, fabs, vector

G0 = 9.80665  # m/s2
NONE = [0.0, 0.0, 0.0]
ZERO = [NONE, NONE, NONE]
FEW = 0.1  # least determinant of 1 + S


def determinant(m: Vector) -> Number:
    """Return the determinant of a matrix (3, 3)."""
    return dot(vector(m[0]), cross(vector(m[1]), vector(m[2])))


def solved(m: Vector, y: Vector) -> Vector:
    """Return x of m x = y, m (3, 3), by cross products of the rows:

    x = (y_0 r_1 x r_2 + y_1 r_2 x r_0 + y_2 r_0 x r_1) / (r_0 . r_1 x r_2)
    """
    r0 = vector(m[0])
    r1 = vector(m[1])
    r2 = vector(m[2])
    a = cross(r1, r2)
    b = cross(r2, r0)
    c = cross(r0, r1)
    return vector((1.0 / dot(r0, a)) * (y[0] * a + y[1] * b + y[2] * c))


def grown(s: Vector, more: Vector) -> Vector:
    """Return 1 + s + diag(more), s (3, 3)."""
    out = vector([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) + s
    for j in range(3):
        out[j][j] = out[j][j] + more[j]
    return vector(out)


class ImuCompensator(TemperatureHistory):
    """Takes the known errors of an inertial measurement unit off its readings: what imu_positions has found.

        f     = (1 + acc_scale + diag sa(T))^-1 (f_read - acc_bias - ba(T))
        omega = (1 + gyro_scale + diag sg(T))^-1 (rate - gyro_bias - bg(T) - g_sensitivity f/g0)      [IMU-POSITIONS]

    The parameters are those of the part imu, in axes of the case; with equal ones and the same temperature its inputs
    come back exactly.
    Refused: matrices 1 + S with a determinant below 0.1.
    Not modelled: nonlinearity, a delay between rate, specific force and temperature, an error of the thermometer.
    Source: IMU-POSITIONS; IEEE 1559 (terms).
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    gyro_bias = Parameter(NONE, "rad/s", "bias of each gyro")
    gyro_scale = Parameter(ZERO, "1", "gyros: scale factor errors (diagonal) and misalignments")
    g_sensitivity = Parameter(ZERO, "rad/s", "rate of each gyro per g0 of specific force along x, y, z")
    acc_bias = Parameter(NONE, "m/s2", "bias of each accelerometer")
    acc_scale = Parameter(ZERO, "1", "accelerometers: scale factor errors (diagonal) and misalignments")

    gyro = ThermalErrors("rad/s", "rad/K", "gyros")
    acc = ThermalErrors("m/s2", "m/s/K", "accelerometers")

    rate = Input(NONE, "rad/s", "rates that the gyros x, y, z read")
    f_read = Input([0.0, 0.0, G0], "m/s2", "specific force that the accelerometers x, y, z read")

    omega = Output("rad/s", "inertial rate, axes of the case", shape=(3,))
    f = Output("m/s2", "specific force, axes of the case", shape=(3,))

    def start(self) -> None:
        unit = vector([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
        self.refuse(fabs(determinant(unit + self.gyro_scale)) < FEW, "gyro_scale: 1 + S has no inverse")
        self.refuse(fabs(determinant(unit + self.acc_scale)) < FEW, "acc_scale: 1 + S has no inverse")

    def outputs(self) -> None:
        T = self.temperature
        bias = self.acc_bias + self.acc.bias_at(T, self.way, self.slope)
        force = solved(grown(self.acc_scale, self.acc.scale_at(T)), self.f_read - bias)
        self.f = force
        bias = self.gyro_bias + self.gyro.bias_at(T, self.way, self.slope) + self.g_sensitivity @ force * (1.0 / G0)
        self.omega = solved(grown(self.gyro_scale, self.gyro.scale_at(T)), self.rate - bias)
