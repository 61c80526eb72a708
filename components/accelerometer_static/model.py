from __future__ import annotations

from gyrobench.component import Component, Input, Noise, Output, Parameter, Rotation
from gyrobench.component.math import cos, sin
from gyrobench.component.set_up import turned

G0 = 9.80665


class AccelerometerStatic(Component):
    """Static model of a pendulous accelerometer with voltage output, as one of several on a head.  [ACCEL-MODEL]

        U = K_F + K_I a_I + K_O a_O + K_IO a_I a_O + K_II a_I2 + noise          a in g0

    a_I, a_O: specific force along input and output axis, those of the mount turned by eta about the pendulum axis:

        a_I = cos(eta) x + sin(eta) y,   a_O = cos(eta) y - sin(eta) x,   (x, y, z) = mount f / g0

    Refused: K_I = 0, |eta| above 10 mrad (the source's linear model then fails by more than 1e-4).
    Not modelled: dynamics, third order, the axis of the pendulum (the head's axis is horizontal).
    Source: Dong 2014, eq. 5.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    K_F = Parameter(-8.3e-4, "V", "bias")
    K_I = Parameter(1.29937, "V", "scale factor, per g0")
    K_O = Parameter(-1.2e-5, "V", "sensitivity along the output axis, per g0")
    K_IO = Parameter(-2.8e-5, "V", "cross term, per g0 squared")
    K_II = Parameter(4e-6, "V", "square term, per g0 squared")
    eta = Parameter(0.0, "rad", "misalignment about the pendulum axis", min=-0.01, max=0.01)
    simulates = (turned("mount", ("accelerometer.mount.1", "accelerometer.mount.2", "accelerometer.mount.3")),)
    mount = Rotation("rows: input, output, pendulum axis in head axes")
    white = Noise(9.5e-6, "V/sqrt(Hz)", "white noise (3 uV in a mean of 10 s)")

    f = Input([0.0, 0.0, 9.80665], "m/s2", "specific force, head axes")

    U = Output("V", "voltage")

    def start(self) -> None:
        self.refuse(self.K_I == 0.0, "K_I = 0: no accelerometer")

    def outputs(self) -> None:
        a = (1.0 / G0) * (self.mount @ self.f)
        c = cos(self.eta)
        s = sin(self.eta)
        x = c * a[0] + s * a[1]
        y = c * a[1] - s * a[0]
        self.U = self.K_F + self.K_I * x + self.K_O * y + self.K_IO * x * y + self.K_II * x * x + self.noise.white
