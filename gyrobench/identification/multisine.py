"""Odd multisines with lines left out and a small peak: the excitation that identification likes best.

Odd harmonics of 1/period between two frequencies, of one amplitude; of each group of four one is left out, at random,
so that distortion shows there.  Phases: Schroeder's or random ones, then the time signal is clipped again and again and
the amplitudes are restored, until the peak does not fall any more; the best of several starts.
Source: Pintelon 2012, 4.3 (random grid), 5.2 (crest factor); Schroeder 1970; Ouderaa 1988.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.bench import UsageError
from gyrobench.files import write_whole

GROUP = 4
LEAST = 12  # lines
STARTS = 6
ROUNDS = 150
CLIP = (0.75, 0.97)  # of the peak, from the first round to the last
TOP = 0.4  # of the rate


@dataclass(frozen=True)
class Multisine:
    """signal: one period, SI; lines: its harmonics; unit: of the file."""

    step: float
    signal: Array
    lines: NDArray[np.intp]
    unit: str

    @property
    def crest(self) -> float:
        """Return the largest value over the rms."""
        return float(np.abs(self.signal).max() / np.sqrt(np.mean(self.signal**2)))

    @property
    def rms(self) -> float:
        """Return the rms, SI."""
        return float(np.sqrt(np.mean(self.signal**2)))

    def write(self, file: str | Path, periods: int = 10) -> Path:
        """Write so many periods as CSV, columns time and excitation, and return the path."""
        factor = units.unit(self.unit).factor
        r = np.tile(self.signal, periods) / factor
        head = f"# period = {self.signal.size * self.step:.9g}s\ntime [s],excitation [{self.unit}]\n"
        rows = "\n".join(f"{k * self.step:.9g},{x:.9g}" for k, x in enumerate(r))
        path = Path(file)
        write_whole(path, f"{head}{rows}\n".encode())
        return path

    def __str__(self) -> str:
        period = self.signal.size * self.step
        f = self.lines / period
        sizes = np.array([self.rms, np.abs(self.signal).max()]) / units.unit(self.unit).factor
        size, top = (units.format_quantity(float(f"{x:.4g}"), self.unit) for x in sizes)
        return (
            f"{self.lines.size} odd lines from {f[0]:.4g} Hz to {f[-1]:.4g} Hz, period {period:.6g} s, rms {size}, "
            f"peak {top}, crest factor {self.crest:.3g}"
        )


def multisine(
    low: float, high: float, period: float, rate: float, peak: float, unit: str = "1", seed: int = 1
) -> Multisine:
    """Return an odd multisine between two frequencies, Hz; period: s; rate: samples a second; peak: SI.

    Raises UsageError for what cannot be had.
    """
    samples = round(period * rate)
    if not (min(low, period, rate, peak) > 0.0 and high > low):
        raise UsageError("multisine: band, period, rate and peak must be above 0, the band must rise")
    if abs(samples - period * rate) > 1e-6 * samples:
        raise UsageError(f"multisine: a period of {period:g} s is {period * rate:.6g} samples, not a whole number")
    if high > TOP * rate:
        raise UsageError(f"multisine: {high:g} Hz needs a rate of {high / TOP:.4g} Hz and more, {rate:g} Hz is given")
    rng = np.random.default_rng(seed)
    odd = np.arange(1, samples // 2, 2)
    odd = odd[(odd >= low * period - 1e-9) & (odd <= high * period + 1e-9)]
    groups = [odd[k : k + GROUP] for k in range(0, odd.size - GROUP + 1, GROUP)]
    rest = odd[len(groups) * GROUP :]
    lines = np.concatenate([*(np.delete(g, rng.integers(GROUP)) for g in groups), rest]).astype(np.intp)
    if lines.size < LEAST:
        raise UsageError(
            f"multisine: {lines.size} odd lines from {low:g} Hz to {high:g} Hz; at least {LEAST} are needed: a period "
            f"of {2.0 * LEAST * GROUP / (GROUP - 1) / (high - low):.3g} s and more gives them"
        )
    starts = [np.pi * np.arange(lines.size) ** 2 / lines.size, *(2.0 * np.pi * rng.random((STARTS, lines.size)))]
    best = min((_flattened(samples, lines, np.exp(1j * p)) for p in starts), key=lambda x: np.abs(x).max() / x.std())
    return Multisine(1.0 / rate, best * (peak / np.abs(best).max()), lines, unit)


def _flattened(samples: int, lines: NDArray[np.intp], turn: NDArray[np.complex128]) -> Array:
    """Return the signal of unit amplitudes whose peak is smallest on the way of clipping from these phases."""
    best, least = np.zeros(samples), np.inf
    for share in np.linspace(*CLIP, ROUNDS):
        spectrum = np.zeros(samples // 2 + 1, complex)
        spectrum[lines] = turn
        x = np.fft.irfft(spectrum, samples)
        top = float(np.abs(x).max())
        if top < least:
            best, least = x, top
        clipped = np.fft.rfft(np.clip(x, -share * top, share * top))[lines]
        turn = clipped / np.abs(clipped)
    return best


def parse_multisine(band: str, peak: str, period: str, rate: str, seed: int = 1) -> Multisine:
    """Return a multisine of texts with units.  Raises UsageError."""
    low, dots, high = band.partition("..")
    number = re.fullmatch(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(.*?)\s*", peak)
    unit = number[2] if number and number[2] else "1"
    try:
        if not dots:
            raise units.UnitError(f"{band}: write LOW..HIGH, such as 0.5Hz..80Hz")
        limits = units.parse_quantity(low, "Hz"), units.parse_quantity(high, "Hz")
        seconds, samples = units.parse_quantity(period, "s"), units.parse_quantity(rate, "Hz")
        largest = units.parse_quantity(peak, unit) * units.unit(unit).factor
        return multisine(*limits, seconds, samples, largest, unit, seed)
    except units.UnitError as error:
        raise UsageError(f"multisine: {error}") from None
