from __future__ import annotations

from gyrobench.component import Discrete, Noise, Parameter, State
from gyrobench.component.blocks.foundation import NONE, Foundation
from gyrobench.component.math import Number, cross, pi, vector


class FoundationActive(Foundation):
    """Foundation of a table whose servos hold the block by accelerometers along E, N, U.  [ENV-FOUNDATION]

    Each sees the specific force s of the block along its axis, with the gravity of a lean in it, through a lag, and
    drives a force generator between block and reaction mass; what is slower than the leak w_0 is left out:

        y' = (s + noise - y)/tau     h' = y - w_0 h     p' = y - w_0 h - w_0 p     force/mass = -A (y - w_0 h) - B p
        A = (frequency/corner)2 - 1      B = 2 corner_damping w_c (1 + A) - 2 d w      w_c = 2 pi corner
        tau = A/(2 pi servo_band)        w_0 = w_c/4

    A makes the block heavier, B holds it against inertial space.  Along an axis, with a level block,

        T = (2 d w s + w2) E/((s2 + 2 d w s + w2) E + A s4 + (A w_0 + B) s3)        E = (tau s + 1)(s + w_0)2

    Nothing of it acts on tilt: an accelerometer cannot tell a lean from an acceleration, and below the leak the servo
    would run away with the block.

    Refused: a servo that is unstable (Routh), a corner at or above the frequency of the mount, and as block Foundation.
    Not modelled: modes of structure and reaction mass, limits of the force generators, and as block Foundation.
    Source: Hu 1981, section 5.6 (three-2), fig. 5-45; the law of the servo is our own.
    """

    version = "1.0.0"

    frequency = Parameter(0.5, "Hz", "natural frequency of the block along E, N, U", above=0.0)
    rock_frequency = Parameter(0.8, "Hz", "natural frequency of rocking about E and N", above=0.0)
    corner = Parameter(0.04, "Hz", "frequency from which on the servo holds the block", above=0.0)
    corner_damping = Parameter(0.7, "1", "damping ratio there", above=0.0)
    servo_band = Parameter(30.0, "Hz", "frequency up to which the servo acts", above=0.0)
    sensor_e = Noise(0.0, "m/s2/sqrt(Hz)", "noise density of the accelerometer along E")
    sensor_n = Noise(0.0, "m/s2/sqrt(Hz)", "noise density of the accelerometer along N")
    sensor_u = Noise(0.0, "m/s2/sqrt(Hz)", "noise density of the accelerometer along U")

    y = State(NONE, "m/s2", "filtered specific force")
    slow = State(NONE, "m/s", "what of it the leak leaves out, over the leak")
    p = State(NONE, "m/s", "its integral, with leak")

    A = Discrete(0.0, "1", "mass that the servo adds, over that of the block")
    B = Discrete(0.0, "1/s", "hold against inertial space")
    tau = Discrete(1.0, "s", "lag of the servo")
    leak = Discrete(0.0, "1/s", "slowest that the servo sees")

    def start(self) -> None:
        w = 2.0 * pi * self.frequency
        w_c = 2.0 * pi * self.corner
        self.refuse(
            self.corner >= self.frequency,
            "corner = {corner} Hz must be below the frequency of the mount, {frequency} Hz",
        )
        ratio = self.frequency / self.corner
        d_1 = 2.0 * self.damping * w
        self.A = ratio * ratio - 1.0
        self.B = 2.0 * self.corner_damping * w_c * (1.0 + self.A) - d_1
        self.tau = self.A / (2.0 * pi * self.servo_band)
        self.leak = 0.25 * w_c
        for j in range(3):
            self.y[j] = 0.0
            self.slow[j] = 0.0
            self.p[j] = 0.0
        self.check_servo(d_1, w * w)

    def check_servo(self, d_1: Number, d_0: Number) -> None:
        """Refuse a servo whose characteristic polynomial a5 s5 + ... + a0 has a root that grows: Routh's table."""
        w_0 = self.leak
        e_2 = 1.0 + 2.0 * w_0 * self.tau
        e_1 = 2.0 * w_0 + self.tau * w_0 * w_0
        e_0 = w_0 * w_0
        a_5 = self.tau
        a_4 = e_2 + a_5 * d_1 + self.A
        a_3 = e_1 + e_2 * d_1 + a_5 * d_0 + self.A * w_0 + self.B
        a_2 = e_0 + e_1 * d_1 + e_2 * d_0
        a_1 = e_0 * d_1 + e_1 * d_0
        a_0 = e_0 * d_0
        b_1 = a_3 - a_5 * a_2 / a_4
        b_2 = a_1 - a_5 * a_0 / a_4
        c_1 = a_2 - a_4 * b_2 / b_1
        self.refuse(
            self.B <= 0.0 or b_1 <= 0.0 or c_1 <= 0.0 or b_2 - b_1 * a_0 / c_1 <= 0.0,
            "the servo is unstable with corner = {corner} Hz, corner_damping = {corner_damping}, servo_band = "
            "{servo_band} Hz on a mount of {frequency} Hz: raise servo_band or corner_damping",
        )

    def servo(self) -> Number:
        fast = vector(self.y) - self.leak * vector(self.slow)
        return -self.A * fast - self.B * vector(self.p)

    def flow(self) -> None:
        moved = self.drive()
        upright = vector([0.0, 0.0, self.g])
        seen = moved - cross(vector(self.tilt) + vector(self.r), upright)
        noisy = vector([self.noise.sensor_e, self.noise.sensor_n, self.noise.sensor_u])
        self.der.y = (seen + noisy - vector(self.y)) / self.tau
        self.der.slow = vector(self.y) - self.leak * vector(self.slow)
        self.der.p = vector(self.y) - self.leak * vector(self.slow) - self.leak * vector(self.p)
