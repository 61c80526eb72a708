from __future__ import annotations

from gyrobench.component import Discrete, Parameter, sampled
from gyrobench.component.blocks.lead_lag import LeadLag
from gyrobench.component.math import Number, clip


class TrackingController(LeadLag):
    """Controller of a tracking loop: image error in, commanded rate of the line of sight out.  [TRACK-LOOP]

        e = u + test                    v = -G(s) e, limited to +-v_max, its slope to +-slope_max
        G = K (1 + tau1 s)(1 + tau2 s) / ((1 + T1 s)(1 + T2 s)) (1 + integral / s)

    1 V of u is 1 rad, 1 V of v is 1 rad/s.  The stabilized line of sight integrates its rate: with integral = 0 the
    tracking loop is of type 1 (error rate / K), with integral > 0 of type 2 (error acceleration / (K integral)).  While
    v is limited and e pushes further, the integral waits (no wind-up); it does not for the slope.

    Not modelled: prediction over the delay of the image (see optical_tracker), sampling of the controller (see
    stabilizer_lti).
    Source: Masten 2008, Hilkert 2008 (structure); types and error coefficients: Franklin 2010, section 4.2.
    """

    version = "1.0.0"

    K = Parameter(9.42, "1", "gain, rad/s per rad; 0: the loop is open", min=0.0)
    tau1 = Parameter(1.0, "s", "lag: time constant of the numerator", min=0.0)
    T1 = Parameter(1.0, "s", "lag: time constant of the denominator", above=0.0)
    tau2 = Parameter(0.01, "s", "lead: time constant of the numerator", min=0.0)
    T2 = Parameter(0.01, "s", "lead: time constant of the denominator", above=0.0)
    v_max = Parameter(1.0, "V", "largest rate commanded (1 V is 1 rad/s)", above=0.0)
    slope_max = Parameter(50.0, "V/s", "largest acceleration commanded (1 V/s is 1 rad/s2)", above=0.0)

    before = Discrete(0.0, "V", "v at the end of the step before")
    now = Discrete(0.0, "V", "v at the end of the present step")

    def start(self) -> None:
        self.before = 0.0
        self.now = 0.0

    def sloped(self, wish: Number) -> Number:
        """Return v that the slope allows."""
        most = self.slope_max * self.h
        return clip(wish, self.before - most, self.before + most)

    @sampled(every=1)
    def tick(self) -> None:
        self.before = self.now
        self.now = self.sloped(clip(self.unlimited(), -self.v_max, self.v_max))

    def outputs(self) -> None:
        wish = self.v
        self.v = self.sloped(wish)
        self.saturated = 1.0 if self.v != self.unlimited() or self.waited > 0.5 else 0.0
