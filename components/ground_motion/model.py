from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.place import NoisePeak, Place
from gyrobench.component.math import cos, cross, fabs, pi, sin, vector

LINES = 8
NONE = [[0.0, 0.0, 0.0]] * LINES
LIMIT = 0.01  # rad


class GroundMotion(Place):
    """Site whose ground moves: waves, tides, tilt and seismic noise on gravity and Earth rate.  [ENV-DISTURBANCE]

    Fits every slot of the socket Site.  Up to 8 periodic motions, each along or about E, N, U with a period and phase,
    s = sin(2 pi t / period + phase), and given by its displacement x, its acceleration or, about the axes, its tilt:

        a = sum of  -(2 pi / period)2 x s  or  acceleration s      (+ noise)
        q = sum of  tilt s  + tilt_ramp t

    What stands on the ground turns by the small angles q against ENU; in its axes, g and W of the site,

        f = (0, 0, g) + a - q x ((0, 0, g) + a)        omega = W - q x W + q'        alpha = q'' - q' x W

    to first order in q.  Noise: two peaks for each axis, microseism (`seismic`, 0.2 Hz) and traffic and machines
    (`local`, 5 Hz), independent of each other.

    Refused: a motion given by displacement and acceleration both, tilts that can exceed 0.01 rad.
    Not modelled: rotation that belongs to the waves (give it as tilt), propagation, soil, foundation,
    change of the gravity with the displacement (3e-6 per metre).
    Source: Hu 1981, section 5.6, Tables 5-4..5-6.
    """

    version = "1.1.0"

    period = Parameter([1.0] * LINES, "s", "periods of the motions", above=0.0)
    phase = Parameter([0.0] * LINES, "rad", "their phases at t = 0")
    displacement = Parameter(NONE, "m", "amplitudes along E, N, U, given as displacement")
    acceleration = Parameter(NONE, "m/s2", "amplitudes along E, N, U, given as acceleration")
    tilt_amplitude = Parameter(NONE, "rad", "amplitudes of the tilt about E, N, U")
    tilt_ramp = Parameter([0.0, 0.0, 0.0], "rad/s", "steady tilting about E, N, U")
    seismic_frequency = Parameter(0.2, "Hz", "peak of the seismic noise", above=0.0)
    seismic_damping = Parameter(0.3, "1", "its width: damping ratio", min=0.01, max=0.9)
    local_frequency = Parameter(5.0, "Hz", "peak of the noise of traffic and machines", above=0.0)
    local_damping = Parameter(0.3, "1", "its width: damping ratio", min=0.01, max=0.9)

    seismic_e = NoisePeak("seismic noise along E", "seismic_frequency", "seismic_damping")
    seismic_n = NoisePeak("seismic noise along N", "seismic_frequency", "seismic_damping")
    seismic_u = NoisePeak("seismic noise along U", "seismic_frequency", "seismic_damping")
    local_e = NoisePeak("noise of traffic and machines along E", "local_frequency", "local_damping")
    local_n = NoisePeak("noise of traffic and machines along N", "local_frequency", "local_damping")
    local_u = NoisePeak("noise of traffic and machines along U", "local_frequency", "local_damping")

    a = Output("m/s2", "acceleration of the ground, ENU", shape=(3,))
    tilt = Output("rad", "tilt of the ground about E, N, U", shape=(3,))
    tilt_rate = Output("rad/s", "derivative of the tilt", shape=(3,))
    tilt_acceleration = Output("rad/s2", "derivative of that", shape=(3,))
    alpha = Output("rad/s2", "derivative of omega", shape=(3,))

    last = Discrete(0.0, "1", "number of the last motion that is given")
    line = Discrete(0.0, "1", "motion under check, from 1")

    def start(self) -> None:
        self.last = 0.0
        sizes = vector([0.0, 0.0, 0.0])
        for k in range(LINES):
            given = 0.0
            for j in range(3):
                self.line = k + 1.0
                sizes[j] = sizes[j] + fabs(self.tilt_amplitude[k][j])
                if self.displacement[k][j] != 0.0:
                    given = 1.0
            for j in range(3):
                self.refuse(
                    given > 0.0 and self.acceleration[k][j] != 0.0,
                    "motion {line} is given by displacement and by acceleration: give one of them",
                )
                if given > 0.0 or self.acceleration[k][j] != 0.0 or self.tilt_amplitude[k][j] != 0.0:
                    self.last = k + 1.0
        for j in range(3):
            self.refuse(sizes[j] > LIMIT, "tilt_amplitude: tilts add up to more than 0.01 rad, which is not small")

    @sampled(every=1)
    def tick(self) -> None:
        for j in range(3):
            self.refuse(
                fabs(self.t * self.tilt_ramp[j]) > LIMIT,
                "tilt_ramp: the ground has tilted by 0.01 rad; the model is for small tilts",
            )

    def outputs(self) -> None:
        motion = vector(
            [
                self.seismic_e_value + self.local_e_value,
                self.seismic_n_value + self.local_n_value,
                self.seismic_u_value + self.local_u_value,
            ]
        )
        turned = self.t * vector(self.tilt_ramp)
        turning = vector(self.tilt_ramp)
        bend = vector([0.0, 0.0, 0.0])
        for k in range(LINES):
            if k < self.last:
                w = 2.0 * pi / self.period[k]
                s = sin(w * self.t + self.phase[k])
                c = cos(w * self.t + self.phase[k])
                motion = motion + s * (vector(self.acceleration[k]) - w * w * vector(self.displacement[k]))
                turned = turned + s * vector(self.tilt_amplitude[k])
                turning = turning + (w * c) * vector(self.tilt_amplitude[k])
                bend = bend - (w * w * s) * vector(self.tilt_amplitude[k])
        earth = vector([0.0, self.north, self.up])
        force = motion + vector([0.0, 0.0, self.local_g])
        self.f = force - cross(turned, force)
        self.omega = earth - cross(turned, earth) + turning
        self.alpha = bend - cross(turning, earth)
        self.a = motion
        self.tilt = turned
        self.tilt_rate = turning
        self.tilt_acceleration = bend
