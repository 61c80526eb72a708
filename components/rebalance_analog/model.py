from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Noise, Output, Parameter, State, sampled
from gyrobench.component.math import clip, floor


class RebalanceAnalog(Component):
    """Analogue torque rebalance of a floated gyro: PI with current limit.  [LOOP-REBALANCE, REBAL-ANALOG]

        i = K_p u + K_i q limited to +-i_max,   q' = u
        q' = 0 while the limit is reached and u pushes further (conditional integration: no wind-up)
        i_read = i_flowed + noise, rounded to the resolution

    i is what flows from now on, i_flowed what flowed during the step that ends now: that is what an integrating
    meter reads, and what balanced the gyro up to now.  Read so, the exchange of u and i once a step does not
    shift the reading against the table angle (read as i it is one step early).  One internal step is one
    communication step (`step` is large for that reason); q is exact for a held u.

    The pickoff gives u = K_sg b and the torquer gives -H k i on the float, so the loop of LOOP-REBALANCE,
    M = -20 b - 200 (integral of b) in N.m, is K_p = 20 / (K_sg H k), K_i = 200 / (K_sg H k).  With
    K_sg = 10 V/rad, H = 0.2 N.m.s and k = 17.2 deg/h/mA = 0.083387953 rad/s/A, K_sg H k = 0.16677591 and
    K_p = 119.921 A/V, K_i = 1199.21 A/(V.s).  Closed with J = 2e-4 kg.m2, C = 0.2 N.m.s the poles are -11.25,
    -100 and -888.7 1/s.  The loop has two integrations (float and q): in the steady state u = 0 and
    k i = omega_IA - omega_d exactly.

    Not modelled: bandwidth and drift of the current source, heating of the torquer, pulse-width operation.
    Source: Hu 1981, ch. 5, eq. 5-62..5-68.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    K_p = Parameter(119.92139898087, "A/V", "proportional gain", min=0.0)
    K_i = Parameter(1199.2139898087, "A/(V.s)", "integral gain", min=0.0)
    i_max = Parameter(0.05, "A", "current limit", above=0.0)
    resolution = Parameter(0.0, "A", "resolution of the measured current; 0: none", min=0.0)
    meter = Noise(1e-7, "A/sqrt(Hz)", "noise density of the current measurement")

    u = Input(0.0, "V", "pickoff voltage")

    i = Output("A", "torquer current")
    i_read = Output("A", "torquer current as measured")
    saturated = Output("1", "1 while the current is limited")

    q = State(0.0, "V.s", "integral of the pickoff voltage")

    present = Discrete(0.0, "A", "current from now on")
    flowed = Discrete(0.0, "A", "current during the last step")

    def start(self) -> None:
        self.present = clip(self.K_p * self.u + self.K_i * self.q, -self.i_max, self.i_max)
        self.flowed = self.present

    def flow(self) -> None:
        unlimited = self.K_p * self.u + self.K_i * self.q
        self.der.q = self.u
        if (unlimited > self.i_max and self.u > 0.0) or (unlimited < -self.i_max and self.u < 0.0):
            self.der.q = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        self.flowed = self.present
        self.present = clip(self.K_p * self.u + self.K_i * self.q, -self.i_max, self.i_max)

    def outputs(self) -> None:
        unlimited = self.K_p * self.u + self.K_i * self.q
        self.i = clip(unlimited, -self.i_max, self.i_max)
        read = self.flowed + self.noise.meter
        if self.resolution > 0.0:
            read = self.resolution * floor(read / self.resolution + 0.5)
        self.i_read = read
        self.saturated = 1.0 if self.i != unlimited else 0.0
