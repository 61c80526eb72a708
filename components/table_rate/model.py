from __future__ import annotations

from gyrobench.component import IDENTITY, Input, Output, Parameter, sampled
from gyrobench.component.blocks.table import AxisTable, SegmentMotion
from gyrobench.component.math import cos, fabs, floor, sin, vector
from gyrobench.component.set_up import harmonic


class TableRate(AxisTable):
    """Turntable with one driven axis, kinematic: hold, index and rate.  [TABLE-RATE, TABLE-POSITION]

    The table follows its command without error.  From the moment a command (mode, target) changes, the motion
    is a chain of five segments of constant acceleration, each in closed form from its own start,

        x = x_k + v_k (t - t_k) + a_k (t - t_k)2 / 2,     v = v_k + a_k (t - t_k)

      mode 0 hold    brake to rest, stay
      mode 1 index   brake to rest, then trapezoid (acceleration, index_rate) to the angle `target`, stay
      mode 2 rate    accelerate to the rate `target`, keep it

    so that days at constant rate add no error.  Ripple (n cycles per turn, relative amplitude r) and true angle:

        angle = x + (r / n) sin n x     rate = v (1 + r cos n x)     acc = a (1 + r cos n x) - r n v2 sin n x

    angle_read = angle + a_1 sin(angle + p_1) + a_2 sin(2 angle + p_2), rounded to the quantum.  With B = tilted base
    (rows: table axes in ENU at angle 0, the axis is the third), Rz = passive rotation by the angle,
    w = Rz B omega_local:

        f     = face Rz B f_local
        omega = face (w + (0, 0, rate))
        alpha = face ((w_y rate, -w_x rate, acc) + Rz B alpha_local)   the derivative of omega: d(omega)/dt = alpha

    tilt[1], tilt[2] turn the base about its first and then its new second axis, B = R2 R1 base.

    Not modelled: servo error and bandwidth, axis wobble, bearing torque, acceleration of the mounted
    instrument (it stands on the axis), time of a change of mount.
    Source: Hu 1981, sections 5.4 (two-2), 5.5 (two-1), 6.1; frames: CONV-FRAMES.
    """

    version = "1.1.0"

    angle0 = Parameter(0.0, "rad", "angle at the start")
    acceleration = Parameter(0.1, "rad/s2", "acceleration of every move", above=0.0)
    index_rate = Parameter(0.1, "rad/s", "rate of an index move", above=0.0)
    rate_max = Parameter(10.0, "rad/s", "largest rate that may be commanded", above=0.0)
    ripple = Parameter(0.0, "1", "rate ripple, relative amplitude r", min=-0.1, max=0.1)
    ripple_cycles = Parameter(36, int, "ripple cycles per turn n", min=1, max=100000)
    simulates = (harmonic(("encoder_amplitude",), ("encoder_phase",), ("angle.once", "angle.twice")),)
    encoder_amplitude = Parameter([0.0, 0.0], "rad", "encoder error of orders 1 and 2")
    encoder_phase = Parameter([0.0, 0.0], "rad", "their phases at angle 0")
    quantum = Parameter(0.0, "rad", "quantum of angle_read; 0: none", min=0.0)

    mode = Input(0.0, "1", "0 hold, 1 index, 2 rate")
    target = Input(0.0, "1", "angle in rad (index) or rate in rad/s (rate)")
    face = Input(IDENTITY, "1", "mount: rows are the gyro axes in table axes")

    alpha_local = Input([0.0, 0.0, 0.0], "rad/s2", "derivative of omega_local: ground that moves, ENU")

    in_position = Output("1", "1 when the target angle or rate is reached")

    motion = SegmentMotion()

    def start(self) -> None:
        self.motion.rest(self.angle0)

    @sampled(every=1)
    def tick(self) -> None:
        if self.motion.commanded(self.mode, self.target):
            self.refuse(
                not (self.mode == 0.0 or self.mode == 1.0 or self.mode == 2.0),
                "mode = {mode} must be 0 hold, 1 index or 2 rate",
            )
            self.refuse(
                self.mode == 2.0 and fabs(self.target) > self.rate_max,
                "rate {target} rad/s exceeds rate_max = {rate_max} rad/s",
            )
            self.motion.plan(self.mode, self.target, self.acceleration, self.index_rate)
        self.motion.advance()

    def outputs(self) -> None:
        angle = self.motion.x
        rate = self.motion.v
        acc = self.motion.a
        if self.ripple != 0.0:
            n = self.ripple_cycles
            rs = self.ripple * sin(n * angle)
            rc = self.ripple * cos(n * angle)
            acc = acc * (1.0 + rc) - n * rate * rate * rs
            angle = angle + rs / n
            rate = rate * (1.0 + rc)
        read = angle
        for k in range(2):
            if self.encoder_amplitude[k] != 0.0:
                read = read + self.encoder_amplitude[k] * sin((k + 1) * angle + self.encoder_phase[k])
        if self.quantum > 0.0:
            read = self.quantum * floor(read / self.quantum + 0.5)
        c = cos(angle)
        s = sin(angle)
        self.feel(c, s, self.tilted[2] @ self.omega_local + rate, rate, acc)
        if self.alpha_local[0] != 0.0 or self.alpha_local[1] != 0.0 or self.alpha_local[2] != 0.0:
            b = self.tilted @ self.alpha_local
            self.alpha = self.alpha + self.face @ vector([c * b[0] + s * b[1], c * b[1] - s * b[0], b[2]])
        self.angle = angle
        self.rate = rate
        self.angle_read = read
        self.in_position = self.motion.arrived
