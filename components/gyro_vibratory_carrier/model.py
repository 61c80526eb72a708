from __future__ import annotations

from gyrobench.component import Parameter, State, sampled
from gyrobench.component.blocks.vibratory import VibratoryGyro
from gyrobench.component.math import maximum, pi, vector


class GyroVibratoryCarrier(VibratoryGyro):
    """Two-axis Coriolis vibratory gyro at its carrier: drive and sense modes oscillate, for minutes.  [GYRO-VIBRATORY]

        x'' + w_x2 x = start_up (1 - x2 - (x'/w_x)2) x' - 2 coupling2 w q'              drive mode, amplitude 1
        q'' + (2/tau) q' + w_y2 q = 2 (W + white) x' - 2 w_x (W_q + white) x - force    sense mode, q = -y / coupling
        w = exp(-i phi) ((q - i q'/w_x) (x + i x'/w_x) + pickoff)                       demodulated
        v and the loop as in gyro_vibratory;   force = 2 w_x Re(i exp(i phi) v (x - i x'/w_x))
        rate = Re v through the output filter, sampled (FilteredRateGyro)

    The same parameters as gyro_vibratory, from which it differs by the terms of the averaging.  The drive mode keeps
    itself at its resonance with the amplitude 1 (velocity fed back); its motion is the reference of the demodulator,
    which reads displacement and velocity, so that it leaves no ripple of twice the frequency.
    Refused: carriers of fewer than 60 substeps a cycle (an internal step has 16), a sense mode far from the drive mode.
    Not modelled: noise of the drive loop, amplitude control other than by velocity, low-pass of a demodulator that
    reads displacement alone, centrifugal force and angular acceleration.
    Source: Shkel 2006; IEEE 1431; derivation in GYRO-VIBRATORY.
    """

    version = "1.0.0"
    integrator = "rk4"
    rk4_substeps = 16

    step = Parameter(1e-5, "s", "largest internal step, of 16 substeps", above=0.0)
    start_up = Parameter(100.0, "1/s", "rate at which the drive mode takes up its amplitude", above=0.0)

    x = State([1.0, 1.0], "1", "drive motion over its amplitude, of the resonators of x and y")
    xd = State([0.0, 0.0], "1/s", "its derivative")
    q = State([0.0, 0.0], "rad", "sense motion over coupling and drive amplitude, sign reversed: rate times time")
    qd = State([0.0, 0.0], "rad/s", "its derivative")
    ir = State([0.0, 0.0], "rad.s", "integral of the demodulated motion in phase, of x and y")
    ii = State([0.0, 0.0], "rad.s", "at right angles to it")

    def start(self) -> None:
        fastest = 2.0 * pi * (self.frequency + maximum(self.split, 0.0))
        self.refuse(
            fastest * self.step / 16.0 > 2.0 * pi / 60.0,
            "step = {step} s: a cycle of {frequency} Hz needs 60 substeps, of which an internal step has 16",
        )
        here = self.in_phase()
        across = self.at_right_angles()
        for j in range(2):
            self.x[j] = 1.0
            self.xd[j] = 0.0
            v0 = self.c[j] * here[j] + self.s[j] * across[j]
            v1 = self.c[j] * across[j] - self.s[j] * here[j]
            if self.closed > 0.5:
                self.q[j] = 0.0
                self.qd[j] = 0.0
                size = self.gain * (self.rate_0 * self.rate_0 + self.delta_0 * self.delta_0)
                self.ir[j] = (v0 * self.rate_0 - v1 * self.delta_0) / size
                self.ii[j] = (v1 * self.rate_0 + v0 * self.delta_0) / size
            else:
                p2 = (self.decay * self.decay + self.delta * self.delta) / self.reach
                zr = (here[j] * self.decay - across[j] * self.delta) / p2
                zi = (across[j] * self.decay + here[j] * self.delta) / p2
                self.q[j] = zr
                self.qd[j] = -self.drive * zi
                v0 = self.rate_0 * (self.c[j] * zr + self.s[j] * zi) + self.delta_0 * (self.c[j] * zi - self.s[j] * zr)
                v0 = v0 / self.reach_0
            self.y[j] = v0

    def flow(self) -> None:
        here = self.in_phase()
        across = self.at_right_angles()
        turned = self.mount @ self.omega
        read = vector([0.0, 0.0])
        sense = (self.drive + self.delta) * (self.drive + self.delta)
        for j in range(2):
            wr = self.noise.pickoff[j]
            wi = self.noise.pickoff[j + 2]
            a = self.x[j]
            b = self.xd[j] / self.drive
            qv = self.qd[j] / self.drive
            zr = self.q[j] * a + qv * b + wr
            zi = self.q[j] * b - qv * a + wi
            wr = self.c[j] * zr + self.s[j] * zi
            wi = self.c[j] * zi - self.s[j] * zr
            force = 0.0
            self.der.ir[j] = 0.0
            self.der.ii[j] = 0.0
            if self.closed > 0.5:
                vr = self.gain * (wr + self.rate_0 * self.ir[j] + self.delta_0 * self.ii[j])
                vi = self.gain * (wi + self.rate_0 * self.ii[j] - self.delta_0 * self.ir[j])
                ur = self.c[j] * vr - self.s[j] * vi
                ui = self.c[j] * vi + self.s[j] * vr
                force = 2.0 * self.drive * (ur * b - ui * a)
                self.der.ir[j] = wr
                self.der.ii[j] = wi
                read[j] = vr
            else:
                read[j] = (self.rate_0 * wr + self.delta_0 * wi) / self.reach_0
            w = here[j] + self.noise.white[j]
            back = 2.0 * self.coupling * self.coupling * turned[j] * self.qd[j]
            grow = self.start_up * (1.0 - a * a - b * b)
            self.der.x[j] = self.xd[j]
            self.der.xd[j] = grow * self.xd[j] - self.drive * self.drive * a - back
            forcing = 2.0 * w * self.xd[j] - 2.0 * self.drive * (across[j] + self.noise.white[j + 2]) * a
            self.der.q[j] = self.qd[j]
            self.der.qd[j] = forcing - force - 2.0 * self.decay * self.qd[j] - sense * self.q[j]
        self.filter_rates(read)

    @sampled(every=1)
    def tick(self) -> None:
        if self.temperature != self.T_seen:
            self.tune(self.temperature)
        self.read_out()

    def outputs(self) -> None:
        self.residual = vector([0.0, 0.0])
        if self.closed > 0.5:
            for j in range(2):
                b = self.xd[j] / self.drive
                qv = self.qd[j] / self.drive
                wi = self.c[j] * (self.q[j] * b - qv * self.x[j]) - self.s[j] * (self.q[j] * self.x[j] + qv * b)
                self.residual[j] = self.gain * (wi + self.rate_0 * self.ii[j] - self.delta_0 * self.ir[j])
