"""Agreement of a noise model with the record: the deviation that it implies beside the record's own."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.ordinates import Model, spectrum
from gyrobench.reduction.noise_model.sensor_filters import Grid
from gyrobench.reduction.series.deviations import Deviation

ENOUGH = 0.95  # of the averaging times
PART = 0.1  # of the record: longest averaging time
SHORTEST = 2  # samples: least averaging time
COVERED = 3  # averaging times over which differences begin, at least; missing samples leave fewer
NARROW = 0.5  # rad, phase over an averaging time below which a cell is narrow against its frequency
LOW_CELLS, CELLS = 4000, 1 << 15  # of the spectrum that decides the degrees of freedom: equal logarithms, equal width
ORDERS = np.arange(1.0, 5.0)[:, None]  # of the waves whose sum sin^8 is


@dataclass(frozen=True)
class DeviationAgreement:
    """Averaging times of m (k,) samples, from SHORTEST to PART of the record; tau0: of a sample, s.

    deviation, low, high (k,): of the record with its interval of 95 %; implied (k,): of the model.
    """

    m: Array
    deviation: Array
    low: Array
    high: Array
    implied: Array
    tau0: float = 1.0

    @property
    def tau(self) -> Array:
        return self.m * self.tau0

    def scaled(self, size: float, tau0: float) -> DeviationAgreement:
        """Return the agreement in another unit of the rate, for samples of tau0 s."""
        return DeviationAgreement(
            self.m, self.deviation * size, self.low * size, self.high * size, self.implied * size, tau0
        )  # fmt: skip

    @property
    def octave(self) -> NDArray[np.bool_]:
        """Return which averaging times are 2, 4, 8 ... samples."""
        out: NDArray[np.bool_] = np.log2(self.m) % 1.0 == 0.0
        return out

    @property
    def inside(self) -> NDArray[np.bool_]:
        inside: NDArray[np.bool_] = (self.low <= self.implied) & (self.implied <= self.high)
        return inside

    @property
    def share(self) -> float:
        """Return the part of the averaging times at which the implied deviation lies in the interval."""
        return float(np.mean(self.inside)) if self.m.size else 1.0

    @property
    def octaves(self) -> float:
        """Return that part of the averaging times 2, 4, 8 ... samples alone."""
        return float(np.mean(self.inside[self.octave])) if self.octave.any() else 1.0

    @property
    def holds(self) -> bool:
        return self.share >= ENOUGH

    @property
    def holds_at_octaves(self) -> bool:
        """Return whether it holds at 2, 4, 8 ... samples too: of so few one may be outside by chance."""
        return min(self.share, self.octaves) >= ENOUGH

    @property
    def worst(self) -> tuple[float, float]:
        """Return the averaging time where the deviations differ most for their interval, and implied over own there."""
        up, down = self.implied / self.high, self.low / np.maximum(self.implied, 1e-300)
        k = int(np.argmax(np.maximum(up, down)))
        return float(self.tau[k]), float(self.implied[k] / self.deviation[k])


def compare(own: Deviation, implied: Array, samples: int) -> DeviationAgreement:
    """Return the agreement of a deviation with the implied one (k,) at its tau, in samples.

    Where few differences are left among missing samples, neighboring averaging times are of the same few, all of them
    off together: they tell of one chance, not of several.
    """
    k = (own.tau >= SHORTEST - 1e-9) & (own.tau <= PART * samples * (1.0 + 1e-9)) & (own.count >= COVERED * own.tau)
    return DeviationAgreement(own.tau[k], own.deviation[k], own.low[k], own.high[k], implied[k])


def with_spectrum(own: Deviation, squares: Array, spread: float = 1.0) -> Deviation:
    """Return a deviation with the intervals that a spectrum allows, where it is narrower than a power law.

    squares (k,): of :func:`squares_of_spectrum` at its tau, or more.  spread: variance of the mean square of the noise
    over that of even normal noise; as many times fewer degrees of freedom.
    """
    edf = np.minimum(own.edf, own.count * own.deviation**4 / squares[: own.tau.size])
    edf = np.maximum(edf / max(spread, 1.0), 1.0)
    low, high = (own.deviation * np.sqrt(edf / special.chdtri(edf, p)) for p in (0.025, 0.975))
    return replace(own, low=low, high=high, edf=edf)


def squares_of_spectrum(tau: Array, model: Model, p: Array) -> Array:
    """Return <(S H)^2> (k,) of the spectrum S of a model, H that of the differences over tau.

    Of n differences there are n <S H>^2/<(S H)^2> degrees of freedom, sigma^2 = <S H>: a resonance, or noise that
    rises more steeply than a power law, makes fewer of them.
    """
    longest = 4.0 * float(tau[-1])
    edges = np.unique(np.concatenate([np.geomspace(np.pi / longest, np.pi, LOW_CELLS), np.linspace(0.0, np.pi, CELLS)]))
    omega, width = 0.5 * (edges[1:] + edges[:-1]), np.diff(edges)
    y = spectrum(model, p, Grid(omega)) / np.sin(0.5 * omega) ** 2
    out = np.empty(tau.size)
    for i, m in enumerate(tau.tolist()):
        # the mean of sin^8(m omega/2) over each cell, which may hold many of its periods
        wave = _cosines(m * omega) * _sines(0.5 * m * width) / (0.5 * m * width * ORDERS)
        eighth = (35.0 - 56.0 * wave[0] + 28.0 * wave[1] - 8.0 * wave[2] + wave[3]) / 128.0
        # at low frequency the sum cancels to rounding errors, which y of a random walk magnifies; the cells are narrow
        eighth = np.where(m * omega < NARROW, np.sin(0.5 * m * omega) ** 8, np.maximum(eighth, 0.0))
        out[i] = float(np.sum(width * y * y * eighth)) * 4.0 / (np.pi * m**4)
    return out


def _cosines(x: Array) -> Array:
    """Return cos(k x) (4, b), k = 1 to 4."""
    one = np.cos(x)
    two = 2.0 * one * one - 1.0
    return np.array([one, two, one * (2.0 * two - 1.0), 2.0 * two * two - 1.0])


def _sines(x: Array) -> Array:
    """Return sin(k x) (4, b), k = 1 to 4."""
    one, cos = np.sin(x), np.cos(x)
    two = 2.0 * one * cos
    return np.array([one, two, one * (3.0 - 4.0 * one * one), 2.0 * two * (1.0 - 2.0 * one * one)])
