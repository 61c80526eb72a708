"""Wavelets of parts: filters, thresholds, noise of the details from a running median."""

from __future__ import annotations

from gyrobench.component.component import Component
from gyrobench.component.declarations import Discrete
from gyrobench.component.math import Number, fabs, floor, index, maximum, minimum, sign

NAMES = ("haar", "db4", "sym4", "coif4", "bior1.5")  # as PyWavelets has them; in parts 1 to 5
LONGEST = 24  # taps
MEDIAN = 0.6745  # of |d| over the standard deviation of a normal variate
WINDOW = 1024  # readings, least of a running median
COEFFICIENTS = 31  # least in a running median, on deep levels
LEVELS = 6
STORED = 1028  # coefficients in the running medians: (513 + 257 + 129 + 65 + 33 + 31), odd numbers


def low_pass(wavelet: Number, m: Number) -> Number:
    """Return the tap m of the analysis low-pass filter h (pywt dec_lo) of wavelet 1 to 5, 0 beyond the last.

    [EST-WAVELET; PyWavelets]
    """
    # one after the other: Haar, db4, sym4, coif4, bior1.5
    taps = [
        0.7071067811865476, 0.7071067811865476,
        -0.010597401785069032, 0.0328830116668852, 0.030841381835560764, -0.18703481171909309,
        -0.027983769416859854, 0.6308807679298589, 0.7148465705529157, 0.2303778133088965,
        -0.07576571478927333, -0.02963552764599851, 0.49761866763201545, 0.8037387518059161,
        0.29785779560527736, -0.09921954357684722, -0.012603967262037833, 0.0322231006040427,
        -1.7849909144933469e-06, -3.259647940030751e-06, 3.1229861599195265e-05, 6.233885431278719e-05,
        -0.0002599743371222568, -0.0005890202246332165, 0.0012665610789256603, 0.0037514346971460866,
        -0.0056582838001308835, -0.015211728187697211, 0.02508225333794961, 0.03933442260558915,
        -0.09622042453595264, -0.06662747236681717, 0.43438603311435653, 0.7822389344242826,
        0.41530842700068227, -0.05607731960356926, -0.08126671024919373, 0.02668230466960483,
        0.01606894713157503, -0.007346167936268051, -0.001629492425226786, 0.000892313902537003,
        0.016572815184059706, -0.016572815184059706, -0.12153397801643785, 0.12153397801643785, 0.7071067811865476,
        0.7071067811865476, 0.12153397801643785, -0.12153397801643785, -0.016572815184059706, 0.016572815184059706,
    ]  # fmt: skip
    first = [0.0, 2.0, 10.0, 18.0, 42.0, 52.0]
    place = first[index(wavelet - 1.0)] + m
    value = 0.0
    if place < first[index(wavelet)]:
        value = taps[index(place)]
    return value


def taps(wavelet: Number) -> Number:
    """Return how many taps the longer filters of a wavelet have: h and that of the details on the way back."""
    length = [2.0, 8.0, 8.0, 24.0, 10.0]
    return length[index(wavelet - 1.0)]


def short_taps(wavelet: Number) -> Number:
    """Return how many taps the other two filters have: as many, but for bior1.5, whose eight zeros are left out."""
    return 2.0 if wavelet == 5.0 else taps(wavelet)


def soft(d: Number, threshold: Number) -> Number:
    """Return sign(d) max(|d| - threshold, 0).  [EST-WAVELET; Xia 2008, eq. 4.3.8 with EX23]"""
    return sign(d) * maximum(fabs(d) - threshold, 0.0)


class RunningMedians(Component):
    """Median of the last |d| of each level: sorted as they come, the oldest taken out.

    Level j = 0 ... 5 keeps WINDOW/2^(j+1) coefficients, 31 at least and an odd number, one for each 2^(j+1) readings:
    those that the decimated transform of a record of WINDOW readings would have.  [EST-WAVELET-ONLINE]
    """

    recent = Discrete([0.0] * STORED, "1", "last |d| of every level, as rings")
    sorted = Discrete([0.0] * STORED, "1", "the same, smallest first")
    kept = Discrete([0.0] * LEVELS, "1", "size of a ring")
    first = Discrete([0.0] * LEVELS, "1", "its place")
    taken = Discrete([0.0] * LEVELS, "1", "coefficients so far")

    def start(self) -> None:
        place = 0.0
        span = 0.5 * WINDOW
        for j in range(LEVELS):
            size = maximum(span, COEFFICIENTS)
            size = size + 1.0 if size == 2.0 * floor(0.5 * size) else size
            self.first[j] = place
            self.kept[j] = size
            self.taken[j] = 0.0
            place = place + size
            span = floor(0.5 * span)

    def below(self, first: Number, count: Number, x: Number) -> Number:
        """Return how many of the sorted values are below x, by halving."""
        low = 0.0
        high = count
        for _ in range(10):  # of 513 at most
            if low < high:
                middle = floor(0.5 * (low + high))
                if self.sorted[index(first + middle)] < x:
                    low = middle + 1.0
                else:
                    high = middle
        return low

    def take(self, j: Number, x: Number) -> None:
        """Put |d| = x of level j in, and the oldest out."""
        first = self.first[index(j)]
        size = self.kept[index(j)]
        taken = self.taken[index(j)]
        head = first + taken - size * floor(taken / size)
        count = minimum(taken, size)
        gap = count  # place that becomes free
        if taken >= size:
            gap = self.below(first, count, self.recent[index(head)])
        to = self.below(first, count, x)
        if to > gap:  # those between move down
            for k in range(index(first + gap), index(first + to - 1.0)):
                self.sorted[k] = self.sorted[k + 1]
            self.sorted[index(first + to - 1.0)] = x
        else:  # up
            carried = x
            for k in range(index(first + to), index(first + gap + 1.0)):
                next = self.sorted[k]
                self.sorted[k] = carried
                carried = next
        self.recent[index(head)] = x
        self.taken[index(j)] = taken + 1.0

    def median(self, j: Number) -> Number:
        """Return the median of level j."""
        first = self.first[index(j)]
        count = minimum(self.taken[index(j)], self.kept[index(j)])
        low = self.sorted[index(first + floor(0.5 * (count - 1.0)))]
        return 0.5 * (low + self.sorted[index(first + floor(0.5 * count))])
