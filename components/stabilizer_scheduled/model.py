from __future__ import annotations

from components.stabilizer_lti.model import StabilizerLti
from gyrobench.component import Discrete, Input, Output, Parameter, State
from gyrobench.component.math import Number, Vector, clip, index

POINTS = 9  # most
NONE = [0.0] * POINTS
ONES = [1.0] * POINTS


class StabilizerScheduled(StabilizerLti):
    """Stabilizer loop whose gain and integral follow a signal, before a linear controller as data.  [GAIN-SCHEDULE]

        r = k (e - K_u command) + s,   s' = k w_i (e - K_u command)              k, w_i: of the signal sigma
        v = -G r, limited to +-v_max,  G as in stabilizer_lti (form, num, den, A, B, C, D, Ts ...; 1 without them)

    gain and corner (1/s; 0: no integral) are given at rising values `at` of sigma, the first `points` of each, and are
    interpolated linearly; beyond the ends those of the ends hold, and `beyond` is 1.  They act before the states, so
    that a change of gain moves neither the integral's voltage nor that of G: with k constant it is k (1 + w_i/s) G.
    While v is limited and the error pushes further, s waits.

    sigma is what the system gives to this slot (the joint angle in the platforms and gimbals); not connected, it is a
    value that is set (a temperature).  The linear model of a run is that of the sigma it begins with.

    Not modelled: derivatives of sigma in the law, a table of several signals, smooth interpolation; a Ts with a corner
    (give that integral as num / den).
    Source: Rugh 2000 (interpolated gains); STABILIZER-LTI.
    """

    version = "1.0.0"

    points = Parameter(1, int, "values of sigma in the tables", min=1, max=POINTS)
    at = Parameter(NONE, "1", "these values, rising, in the unit of sigma (SI)")
    gain = Parameter(ONES, "1", "gain k at each", min=0.0)
    corner = Parameter(NONE, "1/s", "corner w_i of the integral part at each; all 0: none", min=0.0)

    schedule = Input(0.0, "1", "scheduling signal sigma, SI")

    scale = Output("1", "gain k in use")
    beyond = Output("1", "1 while sigma is beyond the table")

    s = State(0.0, "V", "integral part")
    integrates = Discrete(0.0, "1", "1: a corner is not 0")

    def start(self) -> None:
        unsorted = 0.0
        self.integrates = 0.0
        for i in range(POINTS):
            if i < self.points and self.corner[i] > 0.0:
                self.integrates = 1.0
        for i in range(POINTS - 1):
            if i + 1 < self.points and self.at[i + 1] <= self.at[i]:
                unsorted = 1.0
        self.refuse(unsorted > 0.5, "at does not rise: its first {points} values must each be above the one before")
        self.refuse(
            self.integrates > 0.5 and self.Ts > 0.0,
            "a corner takes a continuous controller, Ts = 0: give the integral of a sampled one as num and den",
        )

    def scheduled(self, table: Vector) -> Number:
        """Return the value of a table at sigma."""
        found = table[0]
        for i in range(POINTS - 1):
            if i + 1 < self.points and self.schedule > self.at[i]:
                share = clip((self.schedule - self.at[i]) / (self.at[i + 1] - self.at[i]), 0.0, 1.0)
                found = table[i] + share * (table[i + 1] - table[i])
        return found

    def plain_error(self) -> Number:
        return self.u + self.test - self.K_u * self.command

    def error(self) -> Number:
        return self.scheduled(self.gain) * self.plain_error() + self.s

    def flow(self) -> None:
        r = self.scheduled(self.gain) * self.scheduled(self.corner) * self.plain_error()
        y = self.now()
        self.der.s = r
        if (y > self.v_max and r > 0.0) or (y < -self.v_max and r < 0.0):
            self.der.s = 0.0
        if self.integrates < 0.5:
            self.der.s = -self.s  # stays 0, and leaves no pole at 0 in the linearization

    def outputs(self) -> None:
        self.scale = self.scheduled(self.gain)
        last = self.at[index(self.points - 1.0)]
        self.beyond = 1.0 if self.points > 1.5 and (self.schedule < self.at[0] or self.schedule > last) else 0.0
