from __future__ import annotations

from gyrobench.component import Component, Input, Output, Parameter
from gyrobench.component.math import cos, index, pi

DEG = pi / 180.0


class DecouplerLos(Component):
    """Rates of a line of sight, less those commanded, as signals of the joints of a two-axis gimbal.  [GIMBAL-2AXIS]

        u_axes = K (rate - command)                    of the inner axis
        u_axes = K (rate - command) / cos theta        of the outer axis, theta the inner joint angle

    Element 1 is pitch (x), 2 yaw (z).  The outer joint turns the line of sight by cos theta of its own rate: with the
    secant its loop has one gain at every theta.  Beyond theta_max the secant is held and saturated is 1 (keyhole).

    Not modelled: quantization of the angle, delay, coupling by the roll of the outer gimbal.
    Source: Hilkert 2008; Masten 2008.
    """

    version = "1.0.0"

    form = Parameter(0, int, "0 yaw-pitch (yaw outside), 1 pitch-yaw (pitch outside)", min=0, max=1)
    K = Parameter(1.0, "V.s/rad", "signal per rate", above=0.0)
    theta_max = Parameter(75.0 * DEG, "rad", "inner angle at which the secant is held", above=0.0, below=pi / 2.0)

    rate = Input([0.0, 0.0], "rad/s", "measured rates of the line of sight about x and z")
    command = Input([0.0, 0.0], "rad/s", "rates commanded to it")
    theta = Input([0.0, 0.0], "rad", "joint angles: pitch, yaw")

    u_axes = Output("V", "signals about the joints: pitch, yaw", shape=(2,))
    saturated = Output("1", "1 while the secant is held")

    def outputs(self) -> None:
        for k in range(2):
            self.u_axes[k] = self.K * (self.rate[k] - self.command[k])
        c = cos(self.theta[index(self.form)])
        least = cos(self.theta_max)
        self.saturated = 1.0 if c < least else 0.0
        o = 1.0 - self.form
        self.u_axes[index(o)] = self.u_axes[index(o)] / (least if c < least else c)
