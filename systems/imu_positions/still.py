"""Positions at rest in a series of samples: where all channels scatter no more than they do at their quietest."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from gyrobench.arrays import Array

WIDTH = 1.0  # s over which the scatter is taken
QUIET = 0.1  # quantile of the scatter that is the noise at rest
LOUD = (2.0, 4.0, 8.0)  # times that: moved; the later ones where too few are found, as a hand held them
LEAST = 1.0  # s of a position
EDGE = 0.25  # of the width that is left out at both ends
BLOCK = 4096  # windows at a time
CHANCE = 1e-4  # that a clean channel stands so long at one end
SHORT = 16  # samples of the width at least


def at_rest(time: Array, samples: Array, least: int) -> tuple[list[tuple[int, int]], float]:
    """Return first and one past the last sample of each stretch at rest, and how many times the quietest scatter it may
    have: the first of LOUD with as many stretches as are needed, else the first; time (n,) s, samples (n, channels).

    A gap in time of more than five steps ends a stretch, as does a step of the level: in files of rests alone, written
    one after the other, nothing moves between them.
    """
    steps = np.diff(time)
    h = float(np.median(steps))
    width = max(round(WIDTH / h), SHORT)
    if len(time) < 2 * width:
        return [], LOUD[0]
    scatter = _moving_deviation(samples, width)
    floor = np.maximum(np.quantile(scatter, QUIET, axis=0), _quantum(samples) / np.sqrt(12.0))
    ratio = np.max(scatter / np.maximum(floor, 1e-300), axis=1)
    found = [(_rests(np.flatnonzero(ratio <= loud), width, steps), loud) for loud in LOUD]
    return next((f for f in found if len(f[0]) >= least), found[0])


def _rests(first: NDArray[np.intp], width: int, steps: Array) -> list[tuple[int, int]]:
    """Return the stretches of quiet windows that begin with these samples; steps: of the time (n - 1,), s."""
    h = float(np.median(steps))
    still, one = (_covered(first + k, width - k, steps.size + 1) for k in (0, 1))  # samples; each and the one before
    one[1:] &= steps <= 5.0 * h
    edge = round(EDGE * width)
    found = []
    for start, end in _stretches(still):
        cuts = [start, *(int(b) for b in np.flatnonzero(~one[start + 1 : end]) + start + 1), end]
        for a, b in pairwise(cuts):
            a, b = a + edge * (a == start), b - edge * (b == end)  # of what moved before and after
            if (b - a) * h >= LEAST * (1.0 - 1e-9):
                found.append((a, b))
    return found


def _covered(first: NDArray[np.intp], width: int, size: int) -> NDArray[np.bool_]:
    """Return which of so many samples are in stretches of this width that begin there."""
    count = np.zeros(size + 1)
    np.add.at(count, first, 1.0)
    np.add.at(count, first + width, -1.0)
    return np.cumsum(count)[:-1] > 0.5


def labelled(number: Array) -> list[tuple[int, int]]:
    """Return the stretches of rows whose number is the same and not 0 (empty: 0)."""
    n = np.nan_to_num(number)
    change = np.flatnonzero(np.diff(n)) + 1
    ends = [0, *change.tolist(), len(n)]
    return [(a, b) for a, b in pairwise(ends) if n[a] != 0.0]


def held(samples: Array, still: NDArray[np.bool_]) -> tuple[int, int] | None:
    """Return the longest stretch in which a channel (n,) stands at one end of its values, where no chance makes it so
    long; still (n,): rows at rest.

    Neighbours are alike by the quantum of the channel, at rest more often than in motion: a stretch is compared with
    the share of such pairs among the others of its kind.
    """
    alike = np.diff(samples) == 0.0
    found = None
    for end in (np.min(samples), np.max(samples)):
        for a, b in _stretches(samples == end):
            kind = (still[:-1] == still[a]) & (samples[:-1] != end)
            share = (np.count_nonzero(alike[kind]) + 1.0) / (np.count_nonzero(kind) + 2.0)
            if share ** (b - a - 1) * samples.size < CHANCE and (found is None or b - a > found[1] - found[0]):
                found = (a, b)
    return found


def _stretches(still: NDArray[np.bool_]) -> list[tuple[int, int]]:
    ends = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    return [(int(a), int(b)) for a, b in zip(ends[::2], ends[1::2], strict=True)]


def _moving_deviation(samples: Array, width: int) -> Array:
    """Return the standard deviation of each window of ``width`` samples, taken directly: sums would lose small ones."""
    windows = sliding_window_view(samples, width, axis=0)
    parts = [windows[k : k + BLOCK].std(axis=2) for k in range(0, len(windows), BLOCK)]
    return np.concatenate(parts)


def _quantum(samples: Array) -> Array:
    """Return the smallest step of each channel that occurs."""
    steps = np.abs(np.diff(samples[: 1 << 16], axis=0))
    return np.array([float(np.min(s[s > 0.0], initial=np.inf)) if np.any(s > 0.0) else 0.0 for s in steps.T])
