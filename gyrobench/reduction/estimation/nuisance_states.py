"""Set-up effects that may or may not be in the data: which combinations of them are weighed, and how likely each is.

An effect has columns of its own in the design, y = X a + Z c + noise, and is there or not with even odds beforehand.
If it is there:

* a single effect (a misalignment, a trend): c is flat, with the weight of a normal prior of :data:`SIZE` times the
  standard uncertainty with which the record determines it (S = Z' (R^-1 - R^-1 X (X' R^-1 X)^-1 X' R^-1) Z):
      log weight = 1/2 log det S - k log SIZE;
* a scatter (one constant a mount, say): c ~ N(0, s^2 I), s in :data:`SCATTERS` times the standard uncertainty of one
  constant with all else known, each with the weight OCTAVE.  Even steps of ln s: of m contrasts that the rest leaves
  the estimates then are t of m degrees of freedom where s is well above that uncertainty, as of the means of the groups
  alone.  The weight is that with which a single contrast of two standard uncertainties, z = 2, is as likely a scatter
  as a single effect,
      sum over SCATTERS of OCTAVE (1 + s^2)^(-1/2) exp(z^2/2 s^2/(1 + s^2)) = exp(z^2/2)/SIZE,     OCTAVE = 0.66.
  Sizes with weights that add up to one (OCTAVE = 1/7) take a scatter of few groups for absent, or for drift as long as
  a mount, where it happens to be small, and the intervals hold what it moves too rarely (0.92 of twelve mounts).

No threshold chooses between models: estimates are mixtures over the combinations (noise_mixture_fit), so the
intervals allow for effects too small to be seen.  With SIZE = 1.5 an effect of two standard uncertainties comes in
with weight 0.8; larger values (n^(1/2), as the BIC has it) take it for absent, and the intervals of what it moves hold
the truth too rarely.  tests/benchmarks/setup_effects.py counts.
Not modelled: effects that are there only together; scatters of different size in one block.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
SIZE = 1.5
SCATTERS = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
OCTAVE = 0.66
MOST = 64  # combinations; beyond, effects are weighed one at a time and in pairs


@dataclass(frozen=True)
class Block:
    """Columns (n, k) of one possible effect; scatter: its constants share one variance."""

    name: str
    columns: Array
    scatter: bool = False


@dataclass(frozen=True)
class State:
    """One combination: indices of its columns among all, and for each noise model (G) the precision of the prior of
    each column (0: flat), in units of the noise, and the log weight; scatter: standard deviation (G,) of each block.
    """

    blocks: tuple[bool, ...]
    index: list[int]
    precision: Array  # (G, len(index))
    log_weight: Array  # (G,)
    flat: int  # columns of single effects
    scatter: dict[int, Array]


def states(blocks: Sequence[Block], scale: Array, M: Array, p: int, likely: Array, sigma: float) -> Iterator[State]:
    """The combinations of ``blocks``, whose columns, divided by scale (k,), follow p others in the moments M (G, p+k,
    p+k) of the whitened columns.

    likely (G,), sigma: weights of the noise models and mean standard deviation of unit weight, when all single effects
    are in.  They give the size of the priors, the same for all models: one that followed each model, or the noise left
    by each combination, would favour the quick noises.
    """
    places, at = [], p
    for b in blocks:
        places.append(list(range(at, at + b.columns.shape[1])))
        at += b.columns.shape[1]
    options = [(0.0, *SCATTERS) if b.scatter else (0.0, SIZE) for b in blocks]
    most = len(blocks) if math.prod(len(o) for o in options) <= MOST else 2
    inside = np.linalg.inv(M[:, :p, :p])
    alone = []  # of each block: log weight of a single effect, standard deviation of a scatter in SCATTERS
    for b, own in zip(blocks, places, strict=True):
        if b.scatter:
            one = np.median(M[:, own, own] * scale[[o - p for o in own]] ** 2, axis=1)
            alone.append(math.exp(-0.5 * float(likely @ np.log(one))))
        else:
            cross = M[:, own, :p]
            S = M[:, own][:, :, own] - cross @ inside @ cross.transpose(0, 2, 1)
            unit = SIZE * sigma * math.sqrt(2.0 * math.pi)
            alone.append(0.5 * float(likely @ np.linalg.slogdet(S)[1]) - len(own) * math.log(unit))
    for chosen in product(*options):
        if sum(c > 0.0 for c in chosen) > most:
            continue
        index, flat = list(range(p)), 0
        precision = [np.zeros((M.shape[0], p))]
        weight = np.full(M.shape[0], len(blocks) * math.log(0.5))
        scatter: dict[int, Array] = {}
        for j, (b, size, own) in enumerate(zip(blocks, chosen, places, strict=True)):
            if not size:
                continue
            index += own
            if b.scatter:
                scatter[j] = np.full(M.shape[0], size * alone[j])
                precision.append(1.0 / np.square(np.outer(scatter[j], scale[[o - p for o in own]])))
                weight += 0.5 * np.sum(np.log(precision[-1]), axis=1) + math.log(OCTAVE)
            else:
                weight += alone[j]
                precision.append(np.zeros((M.shape[0], len(own))))
                flat += len(own)
        yield State(tuple(c > 0.0 for c in chosen), index, np.concatenate(precision, axis=1), weight, flat, scatter)
