"""Set-up effects that may or may not be in the data: which combinations of them are weighed, and how likely each is.

An effect has columns of its own in the design, y = X a + Z c + noise, and is there or not with even odds beforehand.
If it is there:

* a single effect (a misalignment, a trend): c is flat, with the weight of a normal prior of :data:`SIZE` times the
  standard uncertainty with which the record determines it (S = Z' (R^-1 - R^-1 X (X' R^-1 X)^-1 X' R^-1) Z):
      log weight = 1/2 log det S - k log SIZE;
* a scatter (one constant a mount, say): c ~ N(0, s^2 I), s in :data:`SCATTERS` times the standard uncertainty of one
  constant with all else known, each with the weight OCTAVE.  Even steps of ln s: of m contrasts that the rest leaves
  the estimates then are t of m degrees of freedom where s is well above that uncertainty, as of the means of the groups
  alone.

No threshold chooses between models: estimates are mixtures over the combinations (noise_mixture_fit), so the
intervals allow for effects too small to be seen.  In these mixtures the odds of a single effect count :data:`FAVOUR`
times.  By its odds alone the intervals of a coefficient that it widens w times would hold 0.98 where it is absent and
0.885 where it is two standard uncertainties large (w >> 1; 0.904, w = 2): 95 % in the mean of the prior, but of no
effect that there is.  A model that has the effect always holds 0.95 of any size, and is hardly wider, as an effect that
may be there widens the interval already.  FAVOUR = 5 lies between: 0.935 to 0.968 for every w and every size, with
intervals 0.97 of those of that model in clean records (1: 0.89).

SCATTERS begin with 2: a scatter of 1 widens an interval by sqrt(2) and is not told from none, and with it among those
weighed six contrasts held 0.979 without a scatter and 0.938 with one of two standard uncertainties.  From 2 on, with
OCTAVE = 0.6, six to twelve contrasts hold 0.929 to 0.969 of every size.  Of two or three contrasts 0.99 hold without a
scatter and 0.947 or more with any: intervals that are never narrower than under a known noise cannot do both.
tests/benchmarks/price_of_choice.py calculates, tests/benchmarks/setup_effects.py counts.
Not modelled: effects that are there only together; scatters of different size in one block.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from gyrobench.arrays import Array

SIZE = 1.5
FAVOUR = 5.0
SCATTERS = (2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0)
OCTAVE = 0.6
MOST = 64  # combinations; beyond, effects are weighed one at a time and in pairs


@dataclass(frozen=True)
class NuisanceBlock:
    """Columns (n, k) of one possible effect; scatter: its constants share one variance."""

    name: str
    columns: Array
    scatter: bool = False


@dataclass(frozen=True)
class NuisanceState:
    """One combination: numbers of its columns among those of all effects, and for each noise model (G) the precision
    of the prior of each of them (0: flat), in units of the noise, and the log weight; scatter: standard deviation (G,)
    of each block.  favour: by which its log weight is larger in estimates and intervals.
    """

    blocks: tuple[bool, ...]
    extra: list[int]
    precision: Array  # (G, len(extra))
    log_weight: Array  # (G,)
    flat: int  # columns of single effects
    scatter: dict[int, Array]
    favour: float

    def index(self, p: int) -> list[int]:
        """Numbers of all its columns, p coefficients before those of the effects."""
        return [*range(p), *(p + e for e in self.extra)]


def states(
    blocks: Sequence[NuisanceBlock], scale: Array, S: Array, square: Array, likely: Array, sigma: float
) -> Iterator[NuisanceState]:
    """The combinations of ``blocks``, whose columns are divided by scale (k,).

    S (G, k, k): of the docstring above, of all columns; square (G, k): sums of squares of the whitened columns.

    likely (G,), sigma: weights of the noise models and mean standard deviation of unit weight, when all single effects
    are in.  They give the size of the priors, the same for all models: one that followed each model, or the noise left
    by each combination, would favour the quick noises.
    """
    models, places, at = len(S), [], 0
    for b in blocks:
        places.append(list(range(at, at + b.columns.shape[1])))
        at += b.columns.shape[1]
    options = [(0.0, *SCATTERS) if b.scatter else (0.0, SIZE) for b in blocks]
    most = len(blocks) if math.prod(len(o) for o in options) <= MOST else 2
    alone = []  # of each block: log weight of a single effect, standard deviation of a scatter in SCATTERS
    for b, own in zip(blocks, places, strict=True):
        if b.scatter:
            one = np.median(square[:, own] * scale[own] ** 2, axis=1)
            alone.append(math.exp(-0.5 * float(likely @ np.log(one))))
        else:
            unit = SIZE * sigma * math.sqrt(2.0 * math.pi)
            alone.append(0.5 * float(likely @ np.linalg.slogdet(S[:, own][:, :, own])[1]) - len(own) * math.log(unit))
    for chosen in product(*options):
        if sum(c > 0.0 for c in chosen) > most:
            continue
        extra: list[int] = []
        flat, favour, precision = 0, 0.0, [np.zeros((models, 0))]
        weight = np.full(models, len(blocks) * math.log(0.5))
        scatter: dict[int, Array] = {}
        for j, (b, size, own) in enumerate(zip(blocks, chosen, places, strict=True)):
            if not size:
                continue
            extra += own
            if b.scatter:
                scatter[j] = np.full(models, size * alone[j])
                precision.append(1.0 / np.square(np.outer(scatter[j], scale[own])))
                weight += 0.5 * np.sum(np.log(precision[-1]), axis=1) + math.log(OCTAVE)
            else:
                weight += alone[j]
                precision.append(np.zeros((models, len(own))))
                flat += len(own)
                favour += math.log(FAVOUR)
        there = tuple(c > 0.0 for c in chosen)
        yield NuisanceState(there, extra, np.concatenate(precision, axis=1), weight, flat, scatter, favour)
