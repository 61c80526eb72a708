from __future__ import annotations

from gyrobench.component import Discrete, Output, Parameter, sampled
from gyrobench.component.blocks.estimator import SampledEstimator
from gyrobench.component.blocks.wavelet_bank import (
    COEFFICIENTS,
    LEVELS,
    LONGEST,
    MEDIAN,
    RunningMedians,
    low_pass,
    short_taps,
    soft,
    taps,
)
from gyrobench.component.math import Number, fabs, floor, index, sqrt

LINES = 4408  # readings in the rings of the largest bank: coif4, 5 levels


class EstimatorWavelet(RunningMedians, SampledEstimator):
    """Wavelet denoising as a stream: undecimated filter bank, soft threshold, exact delay.  [EST-WAVELET-ONLINE]

        a_0 = z;   j = 0 ... J-1, the filters stretched by s = 2^j
            d_j(k)     = sum_m g_m a_j(k - s m),      a_{j+1}(k) = sum_m h_m a_j(k - s m)
            w          = sign(d) max(|d| - c sigma_j, 0)                           soft threshold
        r_J = a_J;   j = J-1 ... 0
            r_j(k)     = 1/2 sum_m [ h'_m r_{j+1}(k - s m) + g'_m w_j(k - delay_j - s m) ]
            delay_j    = D (2^J - 2^{j+1})                 the details wait for the levels above
        estimate = r_0 = the reading of D (2^J - 1) samples ago, if no threshold acts

    h, g; h', g': filters of analysis and synthesis (pywt dec_lo, dec_hi; rec_lo, rec_hi), g_m = (-1)^(m+1) h'_m,
    g'_m = (-1)^m h_m.  Haar, db4, sym4, coif4: orthonormal, L = 2, 8, 8, 24 taps, h' is h backwards, D = L - 1.
    bior1.5: 10 taps h and g', 2 taps g and h' (the zeros of pywt's are left out), D = 5.

    White noise of the readings has the same standard deviation sigma in every d_j of an orthonormal bank, for the
    filters of every level have norm 1; for bior1.5 sigma_j = sigma times their norms.  c = sqrt(2 ln 1024) by default.
    running: sigma_j = median|d_j|/0.6745 of the last 1024 readings, which the threshold follows when the noise changes;
    until a level has 31 coefficients it is that of sigma.  A threshold of 0 reconstructs perfectly.

    The printed rule sign(w)(w - thr) turns negative coefficients round and enlarges them.

    Choose J with 1/(2^(J+1) Ts) >= 4 f_signal.  The delay is output as `latency`; in a loop of crossover f_c it costs
    360 f_c latency degrees: 5 degrees at 10 Hz are 1.4 ms, so that this filter belongs outside the loop.
    The first reading fills the lines: it stands for all before it.  A missing reading (valid = 0) is replaced by the
    one before.  The bank is causal: nothing is mirrored.

    Not modelled: other wavelets, hard thresholds, decimated transforms.
    Source: EST-WAVELET, EST-WAVELET-ONLINE; Xia 2008, eq. 4.3.1-4.3.8 (corrected).
    """

    version = "1.1.0"

    wavelet = Parameter(0, int, "0: by moments; 1 Haar, 2 db4, 3 sym4, 4 coif4, 5 bior1.5", min=0, max=5)
    moments = Parameter(1, int, "wavelet = 0: by its vanishing moments, 1 Haar, 4 db4", min=1, max=4)
    J = Parameter(3, int, "levels; coif4 up to 5", min=1, max=6)
    sigma = Parameter(1.643e-3, "1", "standard deviation of the white noise of a reading, unit of z", min=0.0)
    c = Parameter(3.7232973, "1", "threshold over sigma, sqrt(2 ln 1024)", min=0.0)
    running = Parameter(False, bool, "1: sigma of each level from the last 1024 readings")

    latency = Output("s", "delay of the estimate")
    sigma_hat = Output("1", "standard deviation of the noise, as the finest level has it now, unit of z")

    long = Discrete(0.0, "1", "taps of h and g'")
    short = Discrete(0.0, "1", "taps of g and h'")
    D = Discrete(0.0, "1", "delay of one level, in readings")
    low = Discrete([0.0] * LONGEST, "1", "h")
    high = Discrete([0.0] * LONGEST, "1", "g")
    low_back = Discrete([0.0] * LONGEST, "1", "h'")
    high_back = Discrete([0.0] * LONGEST, "1", "g'")
    sigmas = Discrete([0.0] * LEVELS, "1", "standard deviation of the noise in d_j, unit of z")
    count = Discrete(0.0, "1", "readings so far, with the missing ones")
    last = Discrete(0.0, "1", "last reading that was not missing")
    lines = Discrete([0.0] * LINES, "1", "rings of a_j, of r_{j+1} and of w_j")
    back = Discrete(0.0, "1", "place of the first ring of r_{j+1}")
    details = Discrete(0.0, "1", "place of the first ring of w_j")
    r = Discrete(0.0, "1", "reconstruction")

    def start(self) -> None:
        kind = self.wavelet
        if kind == 0.0:
            self.refuse(
                self.moments != 1.0 and self.moments != 4.0,
                "moments = {moments}: the wavelets are 1 (Haar) and 4 (db4); others by wavelet",
            )
            kind = 1.0 if self.moments == 1.0 else 2.0
        self.refuse(
            kind == 4.0 and self.J > 5.0, "J = {J}: coif4 (wavelet = 4) has 5 levels at most, 713 readings late"
        )
        self.long = taps(kind)
        self.short = short_taps(kind)
        self.D = 0.5 * (self.long + self.short) - 1.0
        sense = 1.0
        for m in range(LONGEST):
            self.low[m] = low_pass(kind, m)
            self.high_back[m] = sense * self.low[m]
            sense = -sense
        sense = -1.0
        for m in range(LONGEST):
            self.low_back[m] = 0.0
            if m < self.short:
                self.low_back[m] = low_pass(1.0 if kind == 5.0 else kind, self.short - 1.0 - m)
            self.high[m] = sense * self.low_back[m]
            sense = -sense
        # of the filters from the readings to d_j of bior1.5
        norms = [1.0, 1.0335556611462686, 1.071695513197379, 1.084057218758057, 1.087304149020162, 1.0881253005386244]
        self.back = 0.0
        self.details = 0.0
        s = 1.0
        for j in range(LEVELS):
            self.sigmas[j] = norms[j] * self.sigma if kind == 5.0 else self.sigma
            if j < self.J:
                self.back = self.back + (self.long - 1.0) * s + 1.0
                self.details = self.details + (self.short - 1.0) * s + 1.0
            s = 2.0 * s
        self.details = self.back + self.details
        self.count = 0.0

    @sampled(every=1)
    def tick(self) -> None:
        if self.reading > 0.5:
            if self.valid > 0.5:
                self.last = self.z
            if self.valid > 0.5 or self.count > 0.0:
                if self.count == 0.0:
                    self.fill()
                self.filter()
                self.count = self.count + 1.0

    def fill(self) -> None:
        """Fill the lines as if the first reading had always been there: a_j = 2^(j/2) z, no details."""
        level = self.last
        s = 1.0
        first = 0.0
        back = self.back
        for _ in range(index(self.J)):
            for k in range(index((self.long - 1.0) * s + 1.0)):
                self.lines[index(first + k)] = level
            first = first + (self.long - 1.0) * s + 1.0
            for k in range(index((self.short - 1.0) * s + 1.0)):
                self.lines[index(back + k)] = sqrt(2.0) * level
            back = back + (self.short - 1.0) * s + 1.0
            s = 2.0 * s
            level = sqrt(2.0) * level
        for k in range(index(self.details), LINES):
            self.lines[k] = 0.0
        self.r = self.last

    def filter(self) -> None:
        """Take the reading `last` through the bank."""
        # analysis, from fine to coarse
        a = self.last
        s = 1.0  # 2^j
        first = 0.0  # ring of a_j
        late = self.details + 0.0  # ring of w_j
        wait = self.D * (self.span() - 1.0)  # of all levels, then of those above
        for j in range(index(self.J)):
            length = (self.long - 1.0) * s + 1.0
            head = self.count - length * floor(self.count / length)
            self.lines[index(first + head)] = a
            a = 0.0
            d = 0.0
            for m in range(index(self.long)):
                place = head - s * m
                if place < 0.0:
                    place = place + length
                reading = self.lines[index(first + place)]
                a = a + self.low[m] * reading
                if m < self.short:
                    d = d + self.high[m] * reading
            first = first + length
            wait = wait - self.D * s
            length = wait + (self.long - 1.0) * s + 1.0
            head = self.count - length * floor(self.count / length)
            if self.running > 0.5:
                self.observe(j, s, fabs(d))
            self.lines[index(late + head)] = soft(d, self.c * self.sigmas[j])
            late = late + length
            s = 2.0 * s
        # synthesis, from coarse to fine
        back = self.details + 0.0
        for _ in range(index(self.J)):
            s = 0.5 * s
            long = wait + (self.long - 1.0) * s + 1.0
            late = late - long
            now = self.count - long * floor(self.count / long)
            length = (self.short - 1.0) * s + 1.0
            back = back - length
            head = self.count - length * floor(self.count / length)
            self.lines[index(back + head)] = a
            a = 0.0
            for m in range(index(self.long)):
                if m < self.short:
                    place = head - s * m
                    if place < 0.0:
                        place = place + length
                    a = a + self.low_back[m] * self.lines[index(back + place)]
                place = now - wait - s * m
                if place < 0.0:
                    place = place + long
                a = a + self.high_back[m] * self.lines[index(late + place)]
            a = 0.5 * a
            wait = wait + self.D * s
        self.r = a

    def observe(self, j: Number, s: Number, size: Number) -> None:
        """Take |d_j| into the running median, once in 2^(j+1) readings and not before all readings in it are real."""
        turn = self.count + 1.0
        before = (self.long - 1.0) * (s - 1.0) + (self.short - 1.0) * s
        if self.count >= before and turn == 2.0 * s * floor(0.5 * turn / s):
            self.take(j, size)
            if self.taken[index(j)] >= COEFFICIENTS:
                self.sigmas[index(j)] = self.median(j) / MEDIAN

    def span(self) -> Number:
        """Return 2^J."""
        span = 1.0
        for _ in range(index(self.J)):
            span = 2.0 * span
        return span

    def outputs(self) -> None:
        self.estimate = self.r
        self.latency = self.D * (self.span() - 1.0) * self.Ts
        self.sigma_hat = self.sigmas[0]
