from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, Rotation

NONE = [0.0, 0.0, 0.0]
UG = 9.80665e-6  # m/s2


class AccelerometerTriad(Component):
    """Three accelerometers with their loops closed inside, quick form: the specific force of the head.  [NORTH-TILT]

        f_read_j = (1 + scale_j) (mount f)_j + bias_j + white

    Not modelled: dynamics, nonlinearity, cross terms other than by the mount (see accelerometer_pendulous).
    Source: GSP ch. 5, eq. 5-60..5-62, as specific force.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    scale = Parameter(NONE, "1", "relative errors of the scale factors", min=-0.1, max=0.1)
    bias = Parameter(NONE, "m/s2", "bias of each axis")
    mount = Rotation("rows: accelerometer axes x, y, z in head axes")
    white_x = Noise(10.0 * UG, "m/s2/sqrt(Hz)", "white noise along x (10 ug/sqrt(Hz))")
    white_y = Noise(10.0 * UG, "m/s2/sqrt(Hz)", "white noise along y (10 ug/sqrt(Hz))")
    white_z = Noise(10.0 * UG, "m/s2/sqrt(Hz)", "white noise along z (10 ug/sqrt(Hz))")

    f = Input([0.0, 0.0, 9.80665], "m/s2", "specific force, head axes")

    f_read = Output("m/s2", "measured specific force along x, y, z", shape=(3,))

    def outputs(self) -> None:
        a = self.mount @ self.f
        self.f_read[0] = (1.0 + self.scale[0]) * a[0] + self.bias[0] + self.noise.white_x
        self.f_read[1] = (1.0 + self.scale[1]) * a[1] + self.bias[1] + self.noise.white_y
        self.f_read[2] = (1.0 + self.scale[2]) * a[2] + self.bias[2] + self.noise.white_z
