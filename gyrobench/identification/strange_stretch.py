"""A stretch of a record that is not of the loop of the rest, of an excitation that goes on alike: random, periodic.

What the ORDER samples before predict (by least squares over the record) of the output, of output and excitation, and of
the input, of all three and of output and excitation at its own sample, leaves noise.  The sum of its squares over ORDER
samples is chi-squared of ORDER degrees of freedom; at a place at which samples are missing, however random the
excitation, where a signal was at a limit, or a blow struck, it is far larger.  A controller that computes its output
from the recorded samples leaves next to nothing, and shows every such place.

Noise that comes in bursts, as that of friction (three times the sum that one stretch in twenty exceeds) and as a
nonlinear loop makes it of a quiet input (ten times), has larger sums everywhere: the limit is BURSTS times that sum,
and where rounding alone is left the one of LEVEL.  Not seen: a jump of both signals at one sample by less than 38 times
the normal noise that is left (the root of BURSTS times 36.4, chi-squared of ORDER), over ORDER samples by less than 8.
"""

from __future__ import annotations

import numpy as np
from scipy.special import chdtri

from gyrobench.arrays import Array
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.identification.missing_blocks import LEAST, ORDER, left_over

LEVEL = 1e-3  # of a record
BURSTS = 40.0  # times the sum that one stretch in twenty exceeds
RANDOM = 0.05  # of the rms: an excitation that its past predicts better is not random
LEAST_SAMPLES = 50 * ORDER  # of which there are 74 numbers to find
STRANGE = "a stretch of the record is not of the loop of the rest"


def is_random(record: LoopRecord) -> bool:
    """Return whether the excitation is random, not a sweep, steps, or sines one after the other."""
    return float(np.std(left_over(record.r, record.r[:, None]))) > RANDOM * float(np.std(record.r))


def strange_stretch(record: LoopRecord) -> str:
    """Return where input or output are not what the rest of the record predicts, or ""."""
    r, u, y = (x - x.mean() for x in (record.r, record.u, record.y))
    if r.size < LEAST_SAMPLES:
        return ""
    both = np.column_stack([y, r])
    rests = {
        "output": left_over(y, both) / np.std(y),
        "input": left_over(u, np.column_stack([u, both]), both) / np.std(u),
    }
    found = {name: at for name, rest in rests.items() if (at := _beyond(rest)).size}
    if not found:
        return ""
    first, last = (float(f(np.concatenate(list(found.values())))) * record.step for f in (np.min, np.max))
    return (
        f"{STRANGE}: between {first:.6g} s and {last:.6g} s after the first sample the {' and the '.join(found)} leave "
        "what the rest predicts. Samples are missing there, a signal was at a limit, or a blow struck: cut the record"
    )


def _beyond(rest: Array) -> Array:
    """Return the first and last sample of stretches whose sum of squares is beyond the limit; none: empty."""
    scale = max(float(np.median(np.abs(rest))) / 0.6745, LEAST)
    sums = np.convolve((rest / scale) ** 2, np.ones(ORDER), "valid")
    limit = max(float(chdtri(ORDER, LEVEL / rest.size)), BURSTS * float(np.quantile(sums, 0.95)))
    at = np.flatnonzero(sums > limit)
    return np.array([at[0] + 2 * ORDER - 1, at[-1] + ORDER], dtype=float) if at.size else np.zeros(0)
