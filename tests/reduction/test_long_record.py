"""Records of any length: blocks of 512 samples, lost samples, gaps; the coefficients are those of the whole record."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import fft

from gyrobench.reduction.estimation.noise import process_covariance
from gyrobench.reduction.series import long_record, noise_likelihood
from gyrobench.reduction.series.long_record import BLOCK, LongRecord, present
from gyrobench.reduction.series.noise_coefficients import CoefficientAccumulator, fit


def test_lost_samples_are_filled_by_those_before() -> None:
    x = np.arange(400.0)
    x[[100, 101, 300]] = math.nan
    (filled,) = present(x)
    assert filled[98:103].tolist() == [98, 99, 98, 99, 102] and filled[300] == 299.0
    x[200:220] = math.nan  # more than 16 in a row
    assert [p.size for p in present(x)] == [200, 180]
    x[::20] = math.nan  # more than 1 %
    assert present(x) == []


def test_blocks_by_hand(monkeypatch: pytest.MonkeyPatch) -> None:
    """Means and powers of blocks do not depend on how the record comes; a gap begins new blocks."""
    monkeypatch.setattr(long_record, "WHOLE", 1000)
    monkeypatch.setattr(long_record, "BLOCK", 64)
    x = np.random.default_rng(0).normal(size=10000)
    record = LongRecord()
    for part in np.split(x[:7000], [10, 999, 1100, 5000]):
        record.add(part)
    record.gap()
    record.add(x[7000:])
    found = record.condensed()
    stretches = [y[: y.size // 64 * 64].reshape(-1, 64) for y in (x[:7000], x[7000:])]
    assert [s.size for s in found.stretches] == [109, 46] and found.blocks == 155
    for mean, blocks in zip(found.stretches, stretches, strict=True):
        assert mean == pytest.approx(blocks.mean(axis=1))
    c = fft.dct(np.concatenate(stretches), norm="ortho", axis=1)[:, 1:]
    assert found.square == pytest.approx((c**2).sum(axis=0)) and found.total == pytest.approx(c.sum(axis=0), abs=1e-9)


def test_variances_of_blocks() -> None:
    """Of a block: random walk, angles (var 2, neighbours -1) and flicker, many relaxations, by their covariance."""
    i = np.arange(BLOCK)
    basis = noise_likelihood._basis_of_blocks(BLOCK)
    walk = np.minimum(i[:, None], i) + 0.5 - np.eye(BLOCK) / 6.0
    angle = 2.0 * np.eye(BLOCK) - np.eye(BLOCK, k=1) - np.eye(BLOCK, k=-1)
    edge = np.arange(BLOCK + 1.0)
    relax = sum(process_covariance(edge[:-1], edge[1:], math.exp(0.5 * j)) for j in range(-16, 35)) * 0.5 / np.pi
    for cov, row in ((walk, 2), (angle, 3)):
        assert np.diag(fft.dctn(cov, norm="ortho"))[1:] == pytest.approx(basis[row], rel=1e-9)
    assert np.diag(fft.dctn(relax, norm="ortho"))[1:] == pytest.approx(basis[1], rel=5e-3)


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
