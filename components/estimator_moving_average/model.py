from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import SampledEstimator
from gyrobench.component.math import index


class EstimatorMovingAverage(SampledEstimator):
    """Mean of the last N readings.

        estimate_k = (z_k + z_{k-1} + ... + z_{k-N+1}) / N,   latency = (N - 1) Ts / 2

    Of white noise it leaves the fraction 1/N of the variance; of a sine of frequency f it leaves the amplitude
    sin(pi f N Ts) / (N sin(pi f Ts)), late by the latency exactly (linear phase).  Until N readings are there the
    mean is of those that are.  A reading with valid = 0 is left out.

    One reading is taken every Ts, at the ends of the communication steps k Ts, k = 1, 2 ... from the start.

    Not modelled: weights other than equal.
    Source: standard filter; a comparison filter of BENCH-DYN-SINE.
    """

    version = "1.0.0"

    N = Parameter(16, int, "number of readings averaged", min=1, max=512)

    latency = Output("s", "delay of the estimate")

    last = Discrete([0.0] * 512, "1", "the last N readings, as a ring")
    place = Discrete(0.0, "1", "where the next one goes")
    count = Discrete(0.0, "1", "readings in the ring")
    mean = Discrete(0.0, "1", "their mean")

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5 and self.valid > 0.5:
            self.last[index(self.place)] = self.z
            self.place = self.place + 1.0
            if self.place >= self.N:
                self.place = 0.0
            if self.count < self.N:
                self.count = self.count + 1.0
            total = 0.0
            for k in range(index(self.count)):
                total = total + self.last[k]
            self.mean = total / self.count

    def outputs(self) -> None:
        self.estimate = self.mean
        self.latency = 0.5 * (self.N - 1.0) * self.Ts
