"""Allan deviations of 10^7 samples against allantools; deviations of 10^8 in bounded memory.

python tests/benchmarks/deviations.py [--samples 1e7] [--long 1e8]
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable

import allantools
import numpy as np
from asked import asked

from gyrobench.reduction.series.deviations import KINDS, DeviationAccumulator, deviations

BLOCK = 1_000_000


def seconds(what: Callable[[], object]) -> float:
    """Return the processor time of a call without arguments, the smaller of two."""
    took = []
    for _ in range(2):
        begin = time.process_time()
        what()
        took.append(time.process_time() - begin)
    return min(took)


if __name__ == "__main__":
    given = asked(__doc__, samples=1e7, long=1e8)
    rng = np.random.default_rng(1)

    begin = time.process_time()
    curves = DeviationAccumulator(0.01, KINDS)
    for _ in range(round(given.long / BLOCK)):
        curves.add(rng.standard_normal(BLOCK))
    longest = curves.result()["allan"].tau[-1]
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"{given.long:.0e} samples in blocks: three deviations to {longest:.3g} s, with the making of the noise")
    print(f"{time.process_time() - begin:.1f} s; peak memory {peak:.0f} MB")

    x = rng.standard_normal(round(given.samples))
    ours, all_three = seconds(lambda: deviations(x, 0.01)), seconds(lambda: deviations(x, 0.01, KINDS))
    peer = seconds(lambda: allantools.oadev(x, rate=100.0, data_type="freq", taus="octave"))
    print(
        f"{x.size} samples, octaves: Allan with intervals {ours:.2f} s, with modified and Hadamard {all_three:.2f} s,"
    )
    print(f"allantools.oadev without intervals {peer:.2f} s: {peer / ours:.1f} times as long")
