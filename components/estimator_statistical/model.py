from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import SampledEstimator
from gyrobench.component.math import fabs, index

MOST = 256


class EstimatorStatistical(SampledEstimator):
    """Mean of the last N readings, each weighted by how many of them lie near it (frequency of its value).

        n_i = number of j with |z_j - z_i| <= width          estimate = sum n_i z_i / sum n_i       [EST-STATISTICAL]

    An outlier alone has the weight 1, a reading among the others that of all that are within the width.  Of normal
    white noise it leaves *more* than the plain mean: with small widths, over many readings, 8/sqrt(27) = 1.54 of its
    variance, with large ones 1.  What it is good for is outliers.  latency = (N - 1) Ts / 2: that of a ramp that
    stays within the width.  Until N readings are there, those that are count.  A reading with valid = 0 is left out.

    Not modelled: a width that follows the noise.
    Source: Xia 2008, ch. 4, introduction (in words), with EX32.
    """

    version = "1.0.0"

    N = Parameter(16, int, "number of readings", min=1, max=MOST)
    width = Parameter(1e-3, "1", "readings no further apart are near each other, unit of z", min=0.0)

    latency = Output("s", "delay of the estimate")

    last = Discrete([0.0] * MOST, "1", "the last N readings, as a ring")
    near = Discrete([0.0] * MOST, "1", "how many lie near each")
    place = Discrete(0.0, "1", "where the next one goes")
    count = Discrete(0.0, "1", "readings in the ring")
    mean = Discrete(0.0, "1", "their weighted mean")

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5 and self.valid > 0.5:
            old = self.last[index(self.place)]
            full = self.count >= self.N
            mine = 0.0
            for k in range(index(self.count)):
                if full and fabs(self.last[k] - old) <= self.width:
                    self.near[k] = self.near[k] - 1.0
                if (not full or k != self.place) and fabs(self.last[k] - self.z) <= self.width:
                    self.near[k] = self.near[k] + 1.0
                    mine = mine + 1.0
            self.last[index(self.place)] = self.z
            self.near[index(self.place)] = mine + 1.0
            if not full:
                self.count = self.count + 1.0
            self.place = self.place + 1.0
            if self.place >= self.N:
                self.place = 0.0
            total = 0.0
            weights = 0.0
            for k in range(index(self.count)):
                total = total + self.near[k] * self.last[k]
                weights = weights + self.near[k]
            self.mean = total / weights

    def outputs(self) -> None:
        self.estimate = self.mean
        self.latency = 0.5 * (self.N - 1.0) * self.Ts
