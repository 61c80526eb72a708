from __future__ import annotations

from gyrobench.component import Discrete, State, sampled
from gyrobench.component.blocks.vibratory import VibratoryGyro
from gyrobench.component.math import Number, Vector, fabs, vector

WARMER = 0.5  # K, after which the step takes the modes anew


class GyroVibratory(VibratoryGyro):
    """Two-axis Coriolis vibratory gyro, open loop or force rebalance: the slow envelope of its sense modes.

        sense motion = -coupling x drive amplitude x Re(z exp(i w_x t))
        z' = -p z + r (W + i W_q + white - u)            p = 1/tau - i delta, r: see VibratoryGyro  [GYRO-VIBRATORY]
        w  = exp(-i phi) (z + pickoff)                                      demodulated, phi: phase error
        open loop:  u = 0,   v = p0/r0 w                             p0, r0: p, r at the temperature of the coefficients
        rebalance:  v = 2 pi loop/r0 (w + p0 integral of w),   u = exp(i phi) v
        rate = Re v through the output filter, sampled (FilteredRateGyro)

    Steady state, rebalance: rate = W cos phi + W_q sin phi; open loop: Re[exp(-i phi) (W + i W_q) r p0/(r0 p)].
    Refused: a sense mode below half or above twice the drive frequency.
    Not modelled: terms of the averaging (of the order of abs(p)/w_x), drive loop and its noise, nonlinear springs,
    modes beside the two, limits of the force, saturation of the demodulator.
    Source: Shkel 2006; Lynch 1995; IEEE 1431; derivation in GYRO-VIBRATORY.
    """

    version = "1.0.0"
    nonlinear = "warmer"

    zr = State([0.0, 0.0], "rad", "envelope of the sense motion in phase with Coriolis' force, of x and y")
    zi = State([0.0, 0.0], "rad", "at right angles to it")
    ir = State([0.0, 0.0], "rad.s", "integral of the demodulated motion in phase, of x and y")
    ii = State([0.0, 0.0], "rad.s", "at right angles to it")

    warmer = Discrete(0.0, "1", "1 in a step after the temperature has changed")
    T_modes = Discrete(0.0, "K", "temperature of the modes of the integrator")

    def start(self) -> None:
        self.T_modes = self.temperature
        here = self.in_phase()
        across = self.at_right_angles()
        for j in range(2):
            p2 = (self.decay * self.decay + self.delta * self.delta) / self.reach
            self.zr[j] = (here[j] * self.decay - across[j] * self.delta) / p2
            self.zi[j] = (across[j] * self.decay + here[j] * self.delta) / p2
            if self.closed > 0.5:
                self.zr[j] = 0.0
                self.zi[j] = 0.0
                v0 = self.c[j] * here[j] + self.s[j] * across[j]
                v1 = self.c[j] * across[j] - self.s[j] * here[j]
                size = self.gain * (self.rate_0 * self.rate_0 + self.delta_0 * self.delta_0)
                self.ir[j] = (v0 * self.rate_0 - v1 * self.delta_0) / size
                self.ii[j] = (v1 * self.rate_0 + v0 * self.delta_0) / size
        found = self.demodulated(0.0)
        self.y = found[2]

    def demodulated(self, noise: Number) -> Vector:
        """Return rows w_r, w_i, v_r, v_i of both axes, with so much of the noise of the pick-off (1 or 0)."""
        out = vector([[0.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 0.0]])
        for j in range(2):
            zr = self.zr[j] + noise * self.noise.pickoff[j]
            zi = self.zi[j] + noise * self.noise.pickoff[j + 2]
            wr = self.c[j] * zr + self.s[j] * zi
            wi = self.c[j] * zi - self.s[j] * zr
            out[0][j] = wr
            out[1][j] = wi
            if self.closed > 0.5:
                out[2][j] = self.gain * (wr + self.rate_0 * self.ir[j] + self.delta_0 * self.ii[j])
                out[3][j] = self.gain * (wi + self.rate_0 * self.ii[j] - self.delta_0 * self.ir[j])
            else:
                out[2][j] = (self.rate_0 * wr + self.delta_0 * wi) / self.reach_0
                out[3][j] = (self.rate_0 * wi - self.delta_0 * wr) / self.reach_0
        return vector(out)

    def flow(self) -> None:
        here = self.in_phase()
        across = self.at_right_angles()
        found = self.demodulated(1.0)
        for j in range(2):
            fr = here[j] + self.noise.white[j]
            fi = across[j] + self.noise.white[j + 2]
            self.der.ir[j] = 0.0
            self.der.ii[j] = 0.0
            if self.closed > 0.5:
                fr = fr - (self.c[j] * found[2][j] - self.s[j] * found[3][j])
                fi = fi - (self.c[j] * found[3][j] + self.s[j] * found[2][j])
                self.der.ir[j] = found[0][j]
                self.der.ii[j] = found[1][j]
            self.der.zr[j] = self.reach * fr - self.decay * self.zr[j] - self.delta * self.zi[j]
            self.der.zi[j] = self.reach * fi - self.decay * self.zi[j] + self.delta * self.zr[j]
        self.filter_rates(vector(found[2]))

    @sampled(every=1)
    def tick(self) -> None:
        self.warmer = 0.0
        if self.temperature != self.T_seen:
            self.tune(self.temperature)
            if fabs(self.temperature - self.T_modes) > WARMER:
                self.T_modes = self.temperature
                self.warmer = 1.0
        self.read_out()

    def outputs(self) -> None:
        self.residual = vector([0.0, 0.0])
        if self.closed > 0.5:
            found = self.demodulated(0.0)
            self.residual = found[3]
