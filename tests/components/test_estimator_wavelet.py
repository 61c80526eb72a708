"""The streaming filter bank against scipy's filters and PyWavelets, its delay, its thresholds, its refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from estimating import play
from native_parts import make
from scipy.signal import lfilter

from gyrobench.component import ComponentError
from gyrobench.component.blocks import wavelet_bank as block
from gyrobench.packaging import load_part

pywt = pytest.importorskip("pywt")
SIGMA, C = 1.643e-3, 3.7232973
NUMBER = {name: k for k, name in enumerate(block.NAMES, 1)}
# delay of J levels: (L - 1)(2^J - 1) for L = 2, 8, 8, 24; bior1.5: (10 + 2)/2 - 1 = 5 for each, instead of 9
DELAY = {"haar": 1, "db4": 7, "sym4": 7, "coif4": 23, "bior1.5": 5}
BANKS = [(w, J) for w in block.NAMES for J in (1, 2, 3, 4, 5, 6) if (w, J) != ("coif4", 6)]


def stretched(taps: list[float], j: int) -> np.ndarray:
    out = np.zeros((len(taps) - 1) * 2**j + 1)
    out[:: 2**j] = taps
    return out


def details(x: np.ndarray, wavelet: str, J: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Undecimated details, finest first, and what is left; zeros before the record."""
    w, a, found = pywt.Wavelet(wavelet), x, []
    for j in range(J):
        found.append(lfilter(stretched(w.dec_hi, j), [1.0], a))
        a = lfilter(stretched(w.dec_lo, j), [1.0], a)
    return found, a


def bank(x: np.ndarray, wavelet: str, J: int, thresholds: list) -> np.ndarray:
    """Undecimated bank with pywt's filters, shifted by the zeros of pywt's bior1.5: 4 of the 9 readings a level."""
    w = pywt.Wavelet(wavelet)
    kept, a = details(x, wavelet, J)
    delay = 0
    for j in reversed(range(J)):
        soft = np.sign(kept[j]) * np.maximum(np.abs(kept[j]) - thresholds[j], 0.0)
        d = np.concatenate([np.zeros(delay), soft])[: x.size]
        a = 0.5 * (lfilter(stretched(w.rec_lo, j), [1.0], a) + lfilter(stretched(w.rec_hi, j), [1.0], d))
        delay += (w.dec_len - 1) * 2**j
    return a[delay - DELAY[wavelet] * (2**J - 1) :]


def signal(n: int = 1500) -> np.ndarray:
    t = np.arange(n) * 1e-3
    z = 0.01 * np.sin(2.0 * math.pi * t) + np.random.default_rng(4).normal(size=n) * SIGMA
    z[0] = 0.0  # then the lines, filled with the first reading, are those of a bank that begins with zeros
    return z


def norms(wavelet: str, J: int) -> list[float]:
    """Standard deviation of each detail of white noise of 1: norms of the filters from the readings to it."""
    w, low, found = pywt.Wavelet(wavelet), np.ones(1), []
    for j in range(J):
        found.append(float(np.linalg.norm(np.convolve(low, stretched(w.dec_hi, j)))))
        low = np.convolve(low, stretched(w.dec_lo, j))
    return found


@pytest.mark.parametrize("wavelet", block.NAMES)
def test_filters_are_those_of_pywavelets(wavelet):
    """All four of the part, from the block's one."""
    w, one = pywt.Wavelet(wavelet), load_part("estimator_wavelet")(wavelet=NUMBER[wavelet])
    one.initialize()
    for name, taps in (("low", w.dec_lo), ("high", w.dec_hi), ("low_back", w.rec_lo), ("high_back", w.rec_hi)):
        kept = np.trim_zeros(np.array(taps))
        found = np.array(getattr(one, name))
        assert found[: kept.size] == pytest.approx(kept, abs=1e-17) and not found[kept.size :].any(), name
    assert [block.low_pass(NUMBER[wavelet], m) for m in range(24)] == [*w.dec_lo, *[0.0] * (24 - w.dec_len)]


@pytest.mark.parametrize(("wavelet", "J"), BANKS)
def test_perfect_reconstruction_after_the_stated_delay(wavelet, J):
    """pywt's sym4 is orthonormal to 1e-12 only."""
    z = np.random.default_rng(J).normal(size=1200)
    found = play("estimator_wavelet", z, ["estimate", "latency"], wavelet=NUMBER[wavelet], J=J, sigma=0.0)
    delay = round(found[0, 1] / 1e-3)
    assert delay == DELAY[wavelet] * (2**J - 1)
    rounding = 1e-11 if wavelet == "sym4" else 1e-14
    assert np.abs(found[delay:, 0] - z[: z.size - delay]).max() < rounding
    assert np.abs(found[:delay, 0] - z[0]).max() < rounding  # before: the first reading


@pytest.mark.parametrize(("wavelet", "J"), [("haar", 3), ("haar", 6), *[(w, J) for w, J in BANKS if J in (1, 4, 5)]])
def test_stream_is_the_bank_of_scipy(wavelet, J):
    z = signal()
    expected = bank(z, wavelet, J, [C * SIGMA * x for x in norms(wavelet, J)])
    found = play("estimator_wavelet", z, wavelet=NUMBER[wavelet], J=J)[: expected.size]
    assert np.abs(found - expected).max() < 1e-15
    quiet = play("estimator_wavelet", z, wavelet=NUMBER[wavelet], J=J, sigma=0.0)[: expected.size]
    assert np.abs(found - quiet).max() > 1e-3


@pytest.mark.parametrize(("wavelet", "J"), [(w, J) for w, J in BANKS if J in (1, 3, 5)])
def test_stream_is_the_stationary_transform_of_pywavelets_late(wavelet, J):
    """pywt.swt of the same window, soft thresholds of pywt.threshold, pywt.iswt: inside, where the ends of the window
    (periodic there) are not felt, the part gives the same, DELAY (2^J - 1) readings later.
    """
    n = 4096
    z = 0.01 * np.sin(2.0 * math.pi * np.arange(n) * 1e-3) + np.random.default_rng(5).normal(size=n) * SIGMA
    levels = pywt.swt(z, wavelet, level=J)  # coarsest first
    thresholds = [C * SIGMA * x for x in norms(wavelet, J)][::-1]
    kept = [(a, pywt.threshold(d, t, "soft")) for (a, d), t in zip(levels, thresholds, strict=True)]
    expected = pywt.iswt(kept, wavelet)
    found = play("estimator_wavelet", z, wavelet=NUMBER[wavelet], J=J)
    delay, end = DELAY[wavelet] * (2**J - 1), 2 * pywt.Wavelet(wavelet).dec_len * 2**J
    assert np.abs(found[delay:] - expected[: n - delay])[end : n - end - delay].max() < 1e-12
    assert np.abs(found - expected)[end : n - end].max() > 1e-3  # without the delay another signal


def test_the_printed_rule_is_another_one():
    """sign(w)(w - thr) makes -2 with a threshold of 1 to +3, the soft rule to -1: the part follows the soft one."""
    d = np.array([-2.0, -0.5, 0.5, 2.0])
    soft, printed = pywt.threshold(d, 1.0, "soft"), np.where(np.abs(d) >= 1.0, np.sign(d) * (d - 1.0), 0.0)
    assert soft.tolist() == [-1.0, 0.0, 0.0, 1.0] and printed[0] == 3.0
    # Haar, one level, readings 0, ..., 0, x: d = -x/sqrt(2) (dec_hi begins with -1/sqrt(2)), a = x/sqrt(2), and the
    # estimate is (h1 a + g1 w)/2 = (x/sqrt(2) + w)/(2 sqrt(2)), with w = -(x/sqrt(2) - thr)
    x, thr = 2.0 * math.sqrt(2.0), 1.0
    found = play("estimator_wavelet", [0.0, 0.0, x], wavelet=1, J=1, sigma=1.0, c=thr)[-1]
    assert found == pytest.approx((2.0 - 1.0) / (2.0 * math.sqrt(2.0)), abs=1e-14)


def test_one_sigma_serves_all_levels_of_an_orthonormal_bank():
    """White noise has its own standard deviation in every detail; in those of bior1.5 up to 9 % more."""
    for wavelet in block.NAMES[:4]:
        assert norms(wavelet, 6) == pytest.approx([1.0] * 6, abs=1e-11)
    one = load_part("estimator_wavelet")(wavelet=5, J=6, sigma=1.0)
    one.initialize()
    assert one.sigmas == pytest.approx(norms("bior1.5", 6), abs=1e-15) and one.sigmas[5] > 1.08


# -------------------------------------------------------------------------------------- running sigma
def running_sigmas(z: np.ndarray, wavelet: str, J: int) -> list[np.ndarray]:
    """Of each level at each reading: median of the last WINDOW/2^(j+1) (31 at least, odd) of |d_j| that the decimated
    transform takes, the first that are all readings on; SIGMA times the norm before 31 are there.
    """
    w, found = pywt.Wavelet(wavelet), []
    for j, (d, norm) in enumerate(zip(details(z, wavelet, J)[0], norms(wavelet, J), strict=True)):
        step, wanted = 2 ** (j + 1), max(1024 >> (j + 1), 31) | 1
        zeros = (4 if wavelet == "bior1.5" else 0) * 2**j  # pywt's before dec_hi: its details come later
        low = np.trim_zeros(np.array(w.dec_lo)).size - 1
        span = low * (2**j - 1) + (np.trim_zeros(np.array(w.dec_hi)).size - 1) * 2**j
        sigma, taken = np.full(z.size, SIGMA * norm), []
        for k in range(span, z.size - zeros):
            if (k + 1) % step == 0:
                taken.append(abs(d[k + zeros]))
            if len(taken) >= 31:
                sigma[k] = np.median(taken[-wanted:]) / 0.6745
        found.append(sigma)
    return found


@pytest.mark.parametrize(("wavelet", "J"), [("haar", 2), ("db4", 4), ("sym4", 3), ("coif4", 2), ("bior1.5", 3)])
def test_running_sigma_is_the_median_of_the_decimated_details(wavelet, J):
    """Noise three times as large from reading 2000 on.  Thresholds of pywt's bior1.5 belong to 4 2^j later ones."""
    z = signal(4000)
    z[2000:] += np.random.default_rng(6).normal(size=2000) * math.sqrt(8.0) * SIGMA
    sigmas = running_sigmas(z, wavelet, J)
    zeros = 4 if wavelet == "bior1.5" else 0
    thresholds = [C * np.concatenate([np.full(zeros * 2**j, s[0]), s])[: z.size] for j, s in enumerate(sigmas)]
    expected = bank(z, wavelet, J, thresholds)
    found = play("estimator_wavelet", z, ["estimate", "sigma_hat"], wavelet=NUMBER[wavelet], J=J, running=1)
    n = expected.size - 64  # bior1.5: the last of pywt's details are not there yet
    assert np.abs(found[:n, 1] - sigmas[0][:n]).max() < 1e-15
    assert np.abs(found[:n, 0] - expected[:n]).max() < 2e-15
    # after 1024 readings all of the window is the new noise; u of a median of 513: 1.17/sqrt(2 513) = 3.6 %
    assert found[1990:2000, 1].mean() == pytest.approx(SIGMA, rel=0.12)
    assert found[3100:, 1].mean() == pytest.approx(3.0 * SIGMA, rel=0.12)


def test_running_details_are_those_of_a_decimated_transform():
    """pywt.wavedec of the record up to now, zeros before it: its details are those that the medians are of."""
    z = signal(1024)
    one = make("estimator_wavelet", "plain")
    one.set({"wavelet": 2.0, "J": 3.0, "running": 1.0})
    one.initialize(0.0)
    for k, x in enumerate(z):
        one.set({"z": float(x)})
        one.step(k * 1e-3, 1e-3)
    for j, expected in enumerate(pywt.wavedec(z, "db4", mode="zero", level=3)[:0:-1]):
        taken, first = int(one.part.taken[j]), int(one.part.first[j])
        found = np.array(one.part.recent[first : first + taken])
        begin = 1024 // 2 ** (j + 1) - taken  # coefficients that the start of the record is felt in
        assert found == pytest.approx(np.abs(expected[begin : begin + taken]), abs=1e-16) and begin * 2 ** (j + 1) < 60
        assert np.array(one.part.sorted[first : first + taken]) == pytest.approx(np.sort(found), abs=0.0)


def test_running_sigma_keeps_the_bank_quiet_when_the_noise_grows():
    """White noise alone, ten times what sigma says: thresholds of sigma leave most of it, running ones 2^(-J/2)."""
    z = 10.0 * SIGMA * np.random.default_rng(7).normal(size=6000)
    left = [np.std(play("estimator_wavelet", z, wavelet=3, J=4, running=r)[3000:]) / (10.0 * SIGMA) for r in (0, 1)]
    assert left[1] == pytest.approx(0.25, rel=0.15) and left[0] > 0.6


# ------------------------------------------------------------------------------------- state, readings
@pytest.mark.parametrize("wavelet", NUMBER.values())
def test_native_is_bit_equal_and_goes_on_from_a_saved_state(wavelet):
    z = signal(700).tolist()
    rows: dict[str, list] = {"plain": [], "native": [], "again": []}
    for target in ("plain", "native"):
        one = make("estimator_wavelet", target)
        one.set({"wavelet": float(wavelet), "J": 4.0, "running": 1.0})
        one.initialize(0.0)
        names = ["estimate", "sigma_hat", "latency"]
        for k, x in enumerate(z):
            if k == 400:
                saved = one.save(one.get_state())
            one.set({"z": x, "valid": float(k % 11 != 3)})
            one.step(k * 1e-3, 1e-3)
            rows[target].append(one.get(names))
        one.set_state(one.load(saved))
        again = []
        for k, x in enumerate(z[400:], 400):
            one.set({"z": x, "valid": float(k % 11 != 3)})
            one.step(k * 1e-3, 1e-3)
            again.append(one.get(names))
        assert again == rows[target][400:]
        one.free()
    assert rows["plain"] == rows["native"] and rows["native"][-1][1] != SIGMA


def test_moments_name_the_first_two():
    z = signal(600)
    for moments, wavelet in ((1, 1), (4, 2)):
        assert np.array_equal(
            play("estimator_wavelet", z, moments=moments), play("estimator_wavelet", z, wavelet=wavelet)
        )


def test_nothing_before_the_first_reading():
    valid = np.ones(60)
    valid[:10] = 0.0
    found = play("estimator_wavelet", np.full(60, 0.7), valid=valid, sigma=0.0)
    assert not found[:10].any() and np.abs(found[10:] - 0.7).max() < 1e-14


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"moments": 2}, r"moments = 2: the wavelets are 1 \(Haar\) and 4 \(db4\)"),
        ({"J": 7}, "parameter J = 7 1 must be <= 6"),
        ({"wavelet": 6}, "parameter wavelet = 6 1 must be <= 5"),
        ({"wavelet": 4, "J": 6}, r"J = 6: coif4 \(wavelet = 4\) has 5 levels at most, 713 readings late"),
        ({"sigma": -1.0}, "sigma = -1 1 must be >= 0"),
    ],
)
def test_refusals(values, text):
    with pytest.raises(ComponentError, match=text):
        load_part("estimator_wavelet")(**values).initialize()
