from __future__ import annotations

from gyrobench.component import Discrete, Parameter, sampled
from gyrobench.component.blocks.angle import wrapped
from gyrobench.component.blocks.attitude import AttitudeEstimator, angles_of, matrix_of, quaternion_of, turned
from gyrobench.component.math import cross, sqrt, vector


class AttitudeComplementary(AttitudeEstimator):
    """Nonlinear complementary filter on the rotation group, with estimated gyro biases.  [EST-ATTITUDE]

        q <- q turned by (omega - b - C omega_earth + k_p e) h          b <- b - k_i e h
        e = m x n  (m = f/|f| while it is usable, n = C up)  +  (heading read last - heading then) n
        k_p = 2 zeta w_0,   k_i = w_0^2

    Above w_0 the gyros determine the attitude, below it specific force and heading.  The heading error of the last
    reading is held until the next one.  It states no variance.

    Not modelled: gains that follow the noise or the time since the start; the tilt by a slow acceleration of the
    vehicle, which is taken for gravity.
    Source: EST-ATTITUDE; Mahony 2008, explicit complementary filter with bias correction.
    """

    version = "1.0.0"

    w_0 = Parameter(0.02, "rad/s", "natural frequency of the corrections", above=0.0)
    zeta = Parameter(0.7071, "1", "their damping ratio", above=0.0)

    q = Discrete([1.0, 0.0, 0.0, 0.0], "1", "rotation from vehicle to ENU axes")
    ahead = Discrete(0.0, "rad", "error of the heading at its last reading")

    @sampled(every=1)
    def tick(self) -> None:
        if self.going < 1.5:
            self.q = quaternion_of(self.aligned)
        else:
            C = matrix_of(self.q)
            up = vector([C[0][2], C[1][2], C[2][2]])
            e = self.ahead * up
            if self.usable > 0.5:
                e = e + cross(self.f, up) / sqrt(self.f @ self.f)
            rate = vector(self.omega) - self.b - C @ self.earth() + 2.0 * self.zeta * self.w_0 * e
            self.q = turned(self.q, rate * self.h)
            self.b = self.b - self.w_0 * self.w_0 * self.h * e
            if self.heading_new > 0.5:
                now = angles_of(matrix_of(self.q))
                self.ahead = wrapped(self.heading - now[2])

    def outputs(self) -> None:
        self.angle = angles_of(matrix_of(self.q))
