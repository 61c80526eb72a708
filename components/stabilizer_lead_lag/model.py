from __future__ import annotations

from gyrobench.component import Output
from gyrobench.component.blocks.lead_lag import LeadLag


class StabilizerLeadLag(LeadLag):
    """Stabilizer loop: lag and lead network with amplifier, gyro signal in, motor voltage out.  [STAB-FLOATED-2DOF]

        e = u + test                    v = -G(s) (e - K_u command), limited to +-v_max
        G = K (1 + tau1 s)(1 + tau2 s) / ((1 + T1 s)(1 + T2 s)) (1 + integral / s)

    The lag (tau1 < T1) keeps the gain at rest and takes it back by tau1/T1 above; the lead (tau2 > T2) lifts the phase
    about the crossover.  The printed order is T1 > tau1 > tau2 > T2; `unordered` is 1 where it does not hold.  With a
    finite T1 the error at rest is not zero (as GSP ch. 5 says) but M / (K_m K_x K): that takes integral > 0.  With
    tau1 = T1 and tau2 = T2 what is left is K (1 + integral / s).  While v is limited and e pushes further, the integral
    waits (no wind-up).

    K_u is for a rate signal (rate gyro, or gyro in rebalance); one whose signal is an angle is turned by its torquer.

    Not modelled: bandwidth, offset and noise of the amplifier.
    Source: GSP ch. 5, eq. 5-25, 5-26; STAB-FLOATED-2DOF; integral: F of PLATFORM-1AXIS.
    """

    version = "1.1.0"

    unordered = Output("1", "1 where T1 > tau1 > tau2 > T2 does not hold")

    def outputs(self) -> None:
        self.unordered = 0.0 if self.tau1 < self.T1 and self.tau2 < self.tau1 and self.tau2 > self.T2 else 1.0
