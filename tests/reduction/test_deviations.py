"""Allan, modified and Hadamard deviation: against allantools, by hand, in blocks, with gaps."""

from __future__ import annotations

import math
import tracemalloc

import allantools
import numpy as np
import pytest

from gyrobench.reduction.series import deviations as dev

PEER = {"allan": allantools.oadev, "modified": allantools.mdev, "hadamard": allantools.ohdev}


def record(n: int, seed: int = 1) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return 3.0 + rng.normal(size=n) + 0.05 * np.cumsum(rng.normal(size=n))


def test_deviations_equal_those_of_allantools() -> None:
    x = record(3001)
    found = dev.deviations(x, 0.5, dev.KINDS)
    for kind, peer in PEER.items():
        ours = found[kind]
        tau, value, _, count = peer(x, rate=2.0, data_type="freq", taus=ours.tau)
        assert ours.tau == pytest.approx(tau, rel=1e-15) and tau[-1] > 200.0
        assert ours.deviation == pytest.approx(value, rel=1e-9), kind
        assert ours.count.tolist() == count.tolist()


def test_wider_spaced_starts_give_the_same() -> None:
    """Beyond 1024 samples the starts are spaced: within 0.4 % of all starts, where intervals are 14 % and more."""
    x = record(50000)
    found = dev.deviations(x, 1.0, dev.KINDS)
    for kind, peer in PEER.items():
        long = found[kind].tau > 1024
        value = peer(x, rate=1.0, data_type="freq", taus=found[kind].tau[long])[1]
        assert long.sum() >= 3 and found[kind].deviation[long] == pytest.approx(value, rel=4e-3)


def test_blocks_of_any_size_and_float32_give_the_same() -> None:
    x = record(20011)
    whole = dev.deviations(x, 1.0, dev.KINDS)
    total = dev.DeviationAccumulator(1.0, dev.KINDS)
    for part in np.split(x, [1, 2, 9, 700, 701, 9000]):
        total.add(part)
    for kind, found in total.result().items():
        assert found.deviation == pytest.approx(whole[kind].deviation, rel=1e-9)
        assert found.count.tolist() == whole[kind].count.tolist()
    assert dev.deviations(x.astype(np.float32), 1.0)["allan"].deviation == pytest.approx(
        whole["allan"].deviation, rel=1e-4
    )


def test_gaps_by_hand() -> None:
    """0, 1 | 3, 5 and 0, 1, missing, 3, 5: (1^2 + 2^2)/(2 * 2 differences) at tau0, nothing beyond."""
    for x in ([np.array([0.0, 1.0]), np.array([3.0, 5.0])], np.array([0.0, 1.0, math.nan, 3.0, 5.0])):
        found = dev.deviations(x, 1.0)["allan"]
        assert found.tau.tolist() == [1.0] and found.deviation == pytest.approx([math.sqrt(5.0 / 4.0)])
        assert found.count.tolist() == [2]


def test_stretches_pool_their_squares() -> None:
    x, y = record(900), record(1700, 2)
    both = dev.deviations([x, y], 1.0, ("hadamard",))["hadamard"]
    a, b = (dev.deviations(z, 1.0, ("hadamard",))["hadamard"] for z in (x, y))
    for i in range(a.tau.size):
        n, m = a.count[i], b.count[i]
        assert both.deviation[i] ** 2 == pytest.approx((n * a.deviation[i] ** 2 + m * b.deviation[i] ** 2) / (n + m))


def test_lost_samples_leave_long_tau() -> None:
    """One sample in 400 is lost: a difference is left out where more than 1 % is missing, the others change by less
    than their scatter; a gap of a tenth of the record is kept out of every difference.
    """
    x = record(60000)
    whole = dev.deviations(x, 1.0, dev.KINDS)
    lost = x.copy()
    lost[::400] = math.nan
    found = dev.deviations(lost, 1.0, dev.KINDS)
    for kind in ("allan", "hadamard"):
        assert found[kind].tau[-1] == whole[kind].tau[-1]
        at = np.isin(whole[kind].tau, found[kind].tau)
        assert found[kind].deviation == pytest.approx(whole[kind].deviation[at], rel=0.03)
    assert found["modified"].tau[-1] == 128.0  # 384 samples without a lost one
    assert found["modified"].deviation == pytest.approx(whole["modified"].deviation[:8], rel=0.05)
    broken = x + np.where(np.arange(60000) < 30000, 0.0, 1000.0)
    broken[30000:36000] = math.nan
    assert dev.deviations(broken, 1.0)["allan"].deviation[:12] == pytest.approx(whole["allan"].deviation[:12], rel=0.3)


def test_memory_does_not_grow_with_the_record() -> None:
    total, x = dev.DeviationAccumulator(1.0, dev.KINDS), record(65536)
    total.add(x)
    tracemalloc.start()
    for _ in range(12):
        total.add(x)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 6e6  # the record: 6.8e6


@pytest.mark.parametrize("walk", [0.0, 1.0])
def test_intervals_cover(walk: float) -> None:
    """White noise: sigma_A^2 = N^2/tau; means of a random walk: K^2 tau/3.  200 records, coverage at every tau."""
    rng, n, hits = np.random.default_rng(4), 500, []
    for _ in range(200):
        z = rng.normal(size=(2, n))
        x = z[0]
        if walk:  # means of a Wiener process: start + half the step + what the bridge adds, variance 1/12
            x = np.cumsum(z[0]) - z[0] / 2.0 + z[1] / math.sqrt(12.0)
        found = dev.deviations(x, 1.0)["allan"]
        truth = np.sqrt(found.tau / 3.0 if walk else 1.0 / found.tau)
        hits.append((found.low <= truth) & (truth <= found.high))
    share = np.mean(hits, axis=0)
    assert np.all((share > 0.90) & (share < 0.99)), share


def test_degrees_of_freedom_of_white_angle_noise() -> None:
    """Differences that share no angle are independent; with m = 1: 1/(1 + 2 (4/6)^2 + 2/36) = 18/35 of them."""
    assert dev.degrees_of_freedom("allan", 50, 40, 2) == pytest.approx(40.0)
    assert dev.degrees_of_freedom("allan", 1, 10**9, 2) / 1e9 == pytest.approx(18.0 / 35.0, rel=1e-6)


def test_mistakes_are_refused() -> None:
    with pytest.raises(ValueError, match="kinds are of"):
        dev.DeviationAccumulator(1.0, ("total",))
    with pytest.raises(ValueError, match="tau0 is positive"):
        dev.DeviationAccumulator(0.0)
    assert dev.deviations(np.zeros(1), 1.0)["allan"].tau.size == 0
