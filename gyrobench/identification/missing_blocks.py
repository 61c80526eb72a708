"""Samples between which a block of the record is missing, though its times go on: excitation and output jump together.

The excitation jumps where it is not what its last ORDER values predict; it may do so of itself (a step, the begin of a
sweep).  The output of a loop does not follow within the same sample.  So where it is not what the ORDER values before
it, of output and excitation, predict, at the very sample at which the excitation jumps, samples between are missing.

Predictors by least squares over the record; what is usual are medians, so that a few jumps do not count.

Not seen: a block where the excitation goes on as if nothing were missing (whole periods of it), or is as random as from
one sample to the next: these are for :mod:`gyrobench.identification.strange_stretch`.  Where the noise is as large as
the jump of the output, the excitation alone jumps: that is in doubt.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from gyrobench.arrays import Array
from gyrobench.identification.loop_record import LoopRecord

ORDER = 24
ROWS = 50_000  # of the record, that the predictors are fitted to
JUMP = 30.0  # times the median of what the excitation is off its prediction
ALONE = 5.0  # times what it is off in the samples before: the end of a sweep is off in all of them
NOISE = 5.0  # standard deviations of what the output is off: one in a million, of MOST samples that are asked
LEAST = 1e-6  # of the rms: rounding
MOST = 5  # jumps: more are of an excitation that jumps of itself, and each is asked for


def missing_blocks(record: LoopRecord) -> tuple[list[int], list[int]]:
    """Return the first samples behind missing blocks, and those at which the excitation alone jumps; MOST at most."""
    r, y = record.r, record.y
    if r.size < 8 * ORDER:
        return [], []
    alone = left_over(r, r[:, None])
    size = np.abs(alone)
    limit = max(JUMP * float(np.median(size)), LEAST * float(np.std(r)))
    jumps = _heads(np.flatnonzero(size > limit)) + ORDER
    if not 0 < jumps.size <= MOST:
        return [], []
    rest = left_over(y, np.column_stack([y, r]))
    usual = max(float(np.median(np.abs(rest))) / 0.6745, LEAST * float(np.std(y)))
    both = np.abs(rest[jumps - ORDER]) > NOISE * usual
    alike = [size[max(k - 2 * ORDER, 0) : k - ORDER].max(initial=0.0) * ALONE > size[k - ORDER] for k in jumps]
    return jumps[both].tolist(), jumps[~both & ~np.array(alike)].tolist()


def _heads(at: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the first of each run of samples that share a prediction's past."""
    return at[np.diff(at, prepend=-2 * ORDER) > ORDER]


def left_over(x: Array, past: Array, now: Array | None = None) -> Array:
    """Return x from ORDER on less what the ORDER rows of ``past`` before, and that of ``now``, predict of it.

    By least squares over the record.
    """
    rows = np.arange(ORDER, x.size, max(1, -(-(x.size - ORDER) // ROWS)))
    same = np.zeros((x.size, 0)) if now is None else now
    before = np.concatenate([past[rows - k] for k in range(1, ORDER + 1)] + [same[rows]], axis=1)
    scale = np.linalg.norm(before, axis=0) + 1e-300
    weights = np.linalg.lstsq(before / scale, x[rows], rcond=None)[0] / scale
    count = ORDER * past.shape[1]
    found = x[ORDER:] - same[ORDER:] @ weights[count:]
    for j, w in enumerate(weights[:count].reshape(ORDER, -1).T):
        found -= signal.lfilter(w, [1.0], past[:, j])[ORDER - 1 : -1]
    return np.asarray(found)
