"""Records of any length: means of 512 samples, lost samples, gaps; the coefficients are those of the whole record."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gyrobench.reduction.series import long_record
from gyrobench.reduction.series.long_record import LongRecord, present
from gyrobench.reduction.series.noise_coefficients import CoefficientAccumulator, fit
from gyrobench.reduction.series.noise_spectra import FastPowers


def test_lost_samples_are_filled_by_those_before() -> None:
    x = np.arange(400.0)
    x[[100, 101, 300]] = math.nan
    (filled,) = present(x)
    assert filled[98:103].tolist() == [98, 99, 98, 99, 102] and filled[300] == 299.0
    x[200:220] = math.nan  # more than 16 in a row
    assert [p.size for p in present(x)] == [200, 180]
    x[::20] = math.nan  # more than 1 %
    assert present(x) == []


def test_means_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    """Means of blocks do not depend on how the record comes; a gap begins new ones."""
    monkeypatch.setattr(long_record, "WHOLE", 1000)
    monkeypatch.setattr(long_record, "BLOCK", 64)
    x = np.random.default_rng(0).normal(size=10000)
    record = LongRecord()
    for part in np.split(x[:7000], [10, 999, 1100, 5000]):
        record.add(part)
    record.gap()
    record.add(x[7000:])
    found = record.condensed()
    assert [s.size for s in found.stretches] == [109, 46] and found.block == 64
    for mean, y in zip(found.stretches, (x[:7000], x[7000:]), strict=True):
        assert mean == pytest.approx(y[: y.size // 64 * 64].reshape(-1, 64).mean(axis=1))


def test_fast_powers() -> None:
    """Of records written from the model, stretches of 4096 and 6000 samples: powers are those of the variances, every
    ordinate above the lowest frequency is counted, and a ramp adds nothing.
    """
    rng = np.random.default_rng(1)
    powers = FastPowers(1.0 / 128.0)
    for n in [4096] * 30 + [6000] * 30:
        white, walk, angle = rng.normal(size=n), rng.normal(size=(2, n)), rng.normal(size=n + 1)
        slow = np.cumsum(walk[0]) - walk[0] / 2.0 + walk[1] / math.sqrt(12.0)
        powers.add(white + 0.1 * slow + 0.5 * np.diff(angle) + 10.0 * np.arange(n))
    count, square, variance, frequency = powers.sums[0], powers.sums[1], powers.sums[2:6], powers.sums[6]
    assert count.sum() == 30 * (4096 - 64) + 30 * (6000 - 94)  # k / 2n >= 1/128: k >= 64, 93.75
    f = frequency / count
    assert np.all(np.diff(f) > 0.0) and f[0] > 1.0 / 128.0 and f[-1] < 0.5
    ratio = square / (np.array([1.0, 0.0, 0.01, 0.25]) @ variance)
    assert np.max(np.abs(ratio - 1.0) * np.sqrt(count / 2.0)) < 4.5 and ratio @ count / count.sum() == pytest.approx(
        1.0, abs=0.01
    )


@pytest.mark.long
def test_blocks_give_the_coefficients_of_the_record(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of 200 000 samples at once, and as means of 512 in stretches of any length: equal within half an interval,
    and intervals as wide within a tenth.
    """
    rng = np.random.default_rng(2)
    n = 200_000
    x = rng.normal(size=n) + np.diff(rng.normal(size=n + 1)) + 1e-5 * np.arange(n)
    x += 0.01 * np.cumsum(rng.normal(size=n))
    x[[5000, 70000]] = math.nan
    whole = fit(x, 0.1)
    monkeypatch.setattr(long_record, "WHOLE", 3000)
    total = CoefficientAccumulator(0.1)
    for part in np.split(x, [4000, 5001, 50000, 130001]):
        total.add(part)
    found = total.result()
    for name in "NKRQ":
        a, b = getattr(whole, name), getattr(found, name)
        half = 0.5 * (a.high - a.low)
        assert b.value == pytest.approx(a.value, abs=half) and b.high - b.low == pytest.approx(2.0 * half, rel=0.1)
    assert not found.B.determined and found.B.high == pytest.approx(whole.B.high, rel=0.1)
    with pytest.raises(ValueError, match="must be positive"):
        CoefficientAccumulator(0.0)
