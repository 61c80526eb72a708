from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import SampledEstimator
from gyrobench.component.math import fabs, floor, index, maximum, sign, sqrt

# rings of the largest bank (db4, 6 levels), one after the other in `lines`: of a_j, 7 2^j + 1 readings each, from 0;
# of r_{j+1}, as long; of w_j, 7 (64 - 2^j) + 1 readings each
RECONSTRUCTED = 447
DETAILS = 894


class EstimatorWavelet(SampledEstimator):
    """Wavelet denoising as a stream: undecimated filter bank, soft threshold, exact delay.  [EST-WAVELET-ONLINE]

        a_0 = z;   j = 0 ... J-1, m = 0 ... L-1, the filters stretched by s = 2^j
            d_j(k)     = sum_m g_m a_j(k - s m),      a_{j+1}(k) = sum_m h_m a_j(k - s m)
            w          = sign(d) max(|d| - c sigma, 0)                             soft threshold
        r_J = a_J;   j = J-1 ... 0
            r_j(k)     = 1/2 sum_m [ h_{L-1-m} r_{j+1}(k - s m) + g_{L-1-m} w_j(k - delay_j - s m) ]
            delay_j    = (L - 1)(2^J - 2^{j+1})            the details wait for the levels above
        estimate = r_0 = the reading of (L - 1)(2^J - 1) samples ago, if no threshold acts

    h, g: orthonormal analysis filters (pywt dec_lo, dec_hi), Haar (L = 2) or db4 (L = 8).  White noise of the readings
    has the same standard deviation sigma in every d_j, for the filters of every level have norm 1: one threshold
    c sigma serves all levels, c = sqrt(2 ln 1024) by default.  A threshold of 0 reconstructs perfectly.

    The printed rule sign(w)(w - thr) turns negative coefficients round and enlarges them.

    Choose J with 1/(2^(J+1) Ts) >= 4 f_signal.  The delay is output as `latency`; in a loop of crossover f_c it costs
    360 f_c latency degrees: 5 degrees at 10 Hz are 1.4 ms, so that this filter belongs outside the loop.
    The first reading fills the lines.  A missing reading (valid = 0) is replaced by the one before.

    Not modelled: thresholds estimated from the details (sigma is a parameter), other wavelets, other thresholding.
    Source: EST-WAVELET, EST-WAVELET-ONLINE; Xia 2008, eq. 4.3.1-4.3.8 (corrected).
    """

    version = "1.0.0"

    moments = Parameter(1, int, "wavelet, by its vanishing moments: 1 Haar, 4 db4", min=1, max=4)
    J = Parameter(3, int, "levels", min=1, max=6)
    sigma = Parameter(1.643e-3, "1", "standard deviation of the white noise of a reading, unit of z", min=0.0)
    c = Parameter(3.7232973, "1", "threshold over sigma, sqrt(2 ln 1024)", min=0.0)

    latency = Output("s", "delay of the estimate")

    taps = Discrete(0.0, "1", "L")
    low = Discrete([0.0] * 8, "1", "h")
    high = Discrete([0.0] * 8, "1", "g")
    count = Discrete(0.0, "1", "readings so far, with the missing ones")
    last = Discrete(0.0, "1", "last reading that was not missing")
    lines = Discrete([0.0] * 3147, "1", "rings of a_j, of r_{j+1} and of w_j")
    r = Discrete(0.0, "1", "reconstruction")

    def start(self) -> None:
        self.refuse(
            self.moments != 1.0 and self.moments != 4.0,
            "moments = {moments}: the wavelets are 1 (Haar) and 4 (db4)",
        )
        for m in range(8):
            self.low[m] = 0.0
            self.high[m] = 0.0
        if self.moments == 1.0:
            self.taps = 2.0
            self.low[0] = sqrt(0.5)
            self.low[1] = sqrt(0.5)
        else:
            self.taps = 8.0
            self.low[0] = -0.010597401785069032
            self.low[1] = 0.0328830116668852
            self.low[2] = 0.030841381835560764
            self.low[3] = -0.18703481171909309
            self.low[4] = -0.027983769416859854
            self.low[5] = 0.6308807679298589
            self.low[6] = 0.7148465705529157
            self.low[7] = 0.2303778133088965
        sense = -1.0
        for m in range(index(self.taps)):
            self.high[m] = sense * self.low[index(self.taps - 1.0 - m)]
            sense = -sense
        self.count = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            if self.valid > 0.5:
                self.last = self.z
            if self.valid > 0.5 or self.count > 0.0:
                if self.count == 0.0:  # as if the first reading had always been there: a_j = 2^(j/2) z, no details
                    level = self.last
                    s = 1.0
                    first = 0.0
                    for _ in range(index(self.J)):
                        for k in range(index(7.0 * s + 1.0)):
                            self.lines[index(first + k)] = level
                            self.lines[index(RECONSTRUCTED + first + k)] = sqrt(2.0) * level
                        first = first + 7.0 * s + 1.0
                        s = 2.0 * s
                        level = sqrt(2.0) * level
                    self.r = self.last
                # analysis, from fine to coarse
                a = self.last
                s = 1.0  # 2^j
                first = 0.0  # ring of a_j
                late = DETAILS + 0.0  # ring of w_j
                for _ in range(index(self.J)):
                    length = 7.0 * s + 1.0
                    head = self.count - length * floor(self.count / length)
                    self.lines[index(first + head)] = a
                    a = 0.0
                    d = 0.0
                    for m in range(index(self.taps)):
                        place = head - s * m
                        if place < 0.0:
                            place = place + length
                        reading = self.lines[index(first + place)]
                        a = a + self.low[m] * reading
                        d = d + self.high[m] * reading
                    first = first + length
                    length = 7.0 * (64.0 - s) + 1.0
                    head = self.count - length * floor(self.count / length)
                    self.lines[index(late + head)] = sign(d) * maximum(fabs(d) - self.c * self.sigma, 0.0)
                    late = late + length
                    s = 2.0 * s
                # synthesis, from coarse to fine
                delay = 0.0  # of the levels above
                for _ in range(index(self.J)):
                    s = 0.5 * s
                    long = 7.0 * (64.0 - s) + 1.0
                    late = late - long
                    now = self.count - long * floor(self.count / long)
                    length = 7.0 * s + 1.0
                    first = first - length
                    head = self.count - length * floor(self.count / length)
                    self.lines[index(RECONSTRUCTED + first + head)] = a
                    a = 0.0
                    for m in range(index(self.taps)):
                        place = head - s * m
                        if place < 0.0:
                            place = place + length
                        a = a + self.low[index(self.taps - 1.0 - m)] * self.lines[index(RECONSTRUCTED + first + place)]
                        place = now - delay - s * m
                        if place < 0.0:
                            place = place + long
                        a = a + self.high[index(self.taps - 1.0 - m)] * self.lines[index(late + place)]
                    a = 0.5 * a
                    delay = delay + (self.taps - 1.0) * s
                self.r = a
                self.count = self.count + 1.0

    def outputs(self) -> None:
        self.estimate = self.r
        span = 1.0
        for _ in range(index(self.J)):
            span = 2.0 * span
        self.latency = (self.taps - 1.0) * (span - 1.0) * self.Ts
