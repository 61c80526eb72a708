"""What a fit under an estimated noise model has found (gyrobench.reduction.estimation.noise_mixture_fit)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.mixture import Mixture
from gyrobench.reduction.estimation.nuisance_states import NuisanceBlock
from gyrobench.reduction.estimation.regression import Design
from gyrobench.reduction.estimation.sentences import seconds

JOINED = 0.99  # probability from which on a possible effect is reported with the coefficients
Range = tuple[float, float, float]  # of the likeliest model, 5 % and 95 % point over all


def spread(w: Array, values: Array, k: int, where: NDArray[np.bool_] | None = None) -> Range:
    """Return the value of the likeliest model with the 5 % and 95 % points over all (``where``) models."""
    if where is not None:
        w = np.where(where, w, 0.0)
        k = k if where[k] else int(np.argmax(w))
    if not w.sum() > 0.0:
        return 0.0, 0.0, 0.0
    order = np.argsort(values)
    total = np.cumsum(w[order]) / w.sum()
    low, high = (float(values[order][min(int(np.searchsorted(total, q)), order.size - 1)]) for q in (0.05, 0.95))
    return float(values[k]), low, high


@dataclass(frozen=True)
class Evidence:
    """What the data say of a possible effect: probability that it is there, its constants if it is, and by how much
    the coefficients (p,) then differ from those without it.
    """

    block: NuisanceBlock
    probability: float
    value: Array  # (k,)
    u: Array
    change: Array  # (p,)
    u_without: Array
    scatter: tuple[float, float, float, float]  # of its constants: mean, standard deviation, 2.5 % and 97.5 % point

    @property
    def joined(self) -> bool:
        return self.probability >= JOINED

    @property
    def names(self) -> tuple[str, ...]:
        k = self.block.columns.shape[1]
        return (self.block.name,) if k == 1 else tuple(f"{self.block.name} {j + 1}" for j in range(k))


@dataclass(frozen=True)
class NoiseSummary:
    """Noise models that count: share of those without correlation, and what they are, in the unit of the data and s."""

    white: float = 1.0  # 0..1
    tau: Range = (0.0, 0.0, 0.0)  # correlation time, of the models with one
    sigma: Range = (0.0, 0.0, 0.0)  # rms of the Gauss-Markov part, of the models without a power law
    density: Range = (0.0, 0.0, 0.0)  # N of the white part, unit sqrt(s)
    sigma_reading: Range = (0.0, 0.0, 0.0)  # of one reading
    law: Range = (0.0, 0.0, 0.0)  # rms of the drift with a power law in a window
    markov: tuple[float, float, float] = (0.0, 0.0, 1.0)  # N, rms and tau of the likeliest model without a power law
    #: (g, 4): tau, share, reading and weight of the models that count, the most likely one first; noise.NoiseGrid
    models: Array = field(default_factory=lambda: np.array([[1.0, 0.0, 0.0, 1.0]]))
    unbounded: str = ""  # that the record does not bound the correlation time, as a sentence

    @property
    def best(self) -> tuple[float, float, float]:
        """Return tau, share of the correlated part and of reading errors of the most likely model."""
        tau, share, reading, _ = self.models[0].tolist()
        return tau, share, reading

    @property
    def slope(self) -> float:
        """Return a of the most likely model's spectrum f^-a; 0 of a model without a power law."""
        return max(-self.best[0], 0.0)

    def words(self, broken: bool) -> str:
        """Return what the noise is, as the end of a sentence; broken: the residuals contradict it."""
        if self.best[1] > 0.0:
            if self.slope:
                return f"; spectrum of the drift about 1/f^{self.slope:g}, included in the coverage intervals"
            return f"; correlation time about {seconds(self.tau[0])}, included in the coverage intervals"
        if broken:
            return ", which is not white noise alone (see the warnings)"
        return f", compatible with white noise{' and reading errors' if self.best[2] > 0.0 else ''}"


@dataclass(frozen=True)
class Likeliest:
    """The fit under the most likely model: residuals decorrelated to unit variance, the columns that they are residuals
    of, and the errors of known size beside them.
    """

    whitened: Array
    fitted: Array
    gain: Array  # (p, n): beta = gain y
    known: Array = field(default_factory=lambda: np.empty((0, 0)))  # (n, r), known_errors.columns
    variance: Array = field(default_factory=lambda: np.ones(1))  # (g,): of unit weight beside them, of each model
    set_up: Array = field(default_factory=lambda: np.zeros(1))  # (n,) or 0: what is predicted of them


@dataclass(frozen=True, kw_only=True)
class NoiseEstimate:
    """A fit under an estimated noise model; arrays follow ``names``."""

    names: tuple[str, ...]
    beta: Array
    covariance: Array  # of the mixture, scaled to ``u``
    u: Array
    half_width: Array  # of the 95 % interval, symmetric about beta
    p: Array  # two-sided probability of a true zero
    dof: Array  # of the t distribution with the same u and half width; infinite for a normal one
    residual: Array
    X: Array  # the columns of ``names``
    design: Design
    mixture: Mixture
    noise: NoiseSummary
    likeliest: Likeliest
    evidence: tuple[Evidence, ...] = ()  # of each block

    @property
    def gain(self) -> Array:
        """(p, n): beta = gain y under the most likely model."""
        return self.likeliest.gain
