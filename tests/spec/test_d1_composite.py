"""TEST-COMPOSITE: composite drift, its scatter and correlation.  STAT-ERR, E45, E46."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench import frames
from gyrobench.reduction.drift import composite
from gyrobench.reduction.setup.window_checks import ReductionError

DPH = math.pi / 180.0 / 3600.0
W = frames.EARTH_RATE


def test_composite_by_hand() -> None:
    """STAT-ERR: sums to n (E45) and less the mean (E46); hand-made series 0 2 0 2 ... about 5."""
    d = (5.0 + np.tile([-1.0, 1.0], 8)) * DPH
    t = np.arange(16) * 600.0
    c = composite.composite(d, t, t + 600.0)
    assert (c.n, c.dT) == (16, 600.0) and c.mean == pytest.approx(5.0 * DPH)
    assert c.sigma == pytest.approx(math.sqrt(16.0 / 15.0) * DPH)
    np.testing.assert_allclose(c.correlation, [1.0, -1.0, 1.0, -1.0, 1.0], rtol=1e-12)  # lags to n/4
    assert c.time == 600.0
    printed = math.sqrt(float(np.sum((d[:-1] - c.mean) ** 2)) / 15.0)  # E45: to n - 1
    assert abs(printed - c.sigma) > 0.01 * c.sigma
    raw = float(d[:-1] @ d[1:]) / 15.0 / (float(d @ d) / 16.0)  # E46: raw values
    assert raw > 0.9


def test_composite_correlation_time() -> None:
    """First lag below 1/e of a slow process; none within n/4 is said."""
    t = np.arange(40) * 60.0
    slow = np.cos(2 * math.pi * np.arange(40) / 40.0) * DPH
    c = composite.composite(slow, t, t + 60.0)
    below = np.flatnonzero(c.correlation < math.exp(-1.0))
    assert c.time == below[0] * 60.0 and 6 <= below[0] <= 9
    t = np.arange(200) * 60.0
    slower = np.cos(2 * math.pi * np.arange(200) / 1000.0)
    trend = composite.composite((slower - slower[100]) * DPH, t, t + 60.0)
    assert trend.time is None or trend.time > 1000.0
    table = composite.tables({"a": c, "b": trend, "c": "9 windows: at least 10 are needed"}, DPH, "°/h")
    assert len(table) == 2 and table[0].rows[2][-1].startswith("9 windows") and "60 s" in table[0].caption


def test_composite_refusals() -> None:
    t = np.arange(12) * 60.0
    d = np.random.default_rng(0).normal(size=12) * DPH
    good = {"t_start": t, "t_end": t + 60.0}
    with pytest.raises(ReductionError, match="9 windows: at least 10"):
        composite.composite(d[:9], t[:9], t[:9] + 60.0)
    with pytest.raises(ReductionError, match="the drift rate is constant"):
        composite.composite(np.full(12, 0.3 * DPH), **good)
    with pytest.raises(ReductionError, match="table rate against the Earth: add"):
        composite.composite(d - W, **good, earth=W)
    with pytest.raises(ReductionError, match="need one ΔT"):
        composite.composite(d, t, t + np.where(t > 300, 50.0, 60.0))
    with pytest.raises(ReductionError, match="not a finite number"):
        composite.composite(np.where(t == 60.0, math.nan, d), **good)
