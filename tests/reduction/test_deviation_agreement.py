"""Agreement of a noise model with the deviation of a record: which averaging times take part.  [DRIFT-NOISE-MODEL]"""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.reduction.noise_model.agreement import compare
from gyrobench.reduction.series.deviations import deviations


@pytest.mark.parametrize("missing", [0.0, 0.1])
def test_averaging_times_of_few_differences_take_no_part(missing: float) -> None:
    """Complete, differences over a tenth of the record begin over eight averaging times of ten.  Among a tenth missing
    those of the longest averaging times begin at a few places, and all are off together.
    """
    rng, n = np.random.default_rng(1), 50_000
    x = rng.normal(size=n)
    x[rng.random(n) < missing] = np.nan
    own = deviations(x, 1.0, ("allan",), fine=True)["allan"]
    found = compare(own, own.tau**-0.5, n)
    left_out = own.tau[(own.tau >= 2.0) & (own.tau <= 0.1 * n) & ~np.isin(own.tau, found.m)]
    assert (left_out.size > 0) == (missing > 0.0)
    few = {m: c for m, c in zip(own.tau.tolist(), own.count.tolist(), strict=True) if m in left_out}
    assert all(c < 3.0 * m for m, c in few.items())
