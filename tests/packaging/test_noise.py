"""The noise generator: its distribution, its density, its independence; all with fixed seeds."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from statistics import NormalDist

import numpy as np
import pytest
import scipy.signal
import scipy.special
import scipy.stats
from toybench import TOYS

from gyrobench.component.numerics import normal
from gyrobench.packaging import compiler, load_part, native_target
from gyrobench.packaging.source import SubsetError

N = 20000


@pytest.fixture(scope="module")
def in_c(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    """The normal numbers and the quantile of noise.h, called directly."""
    folder = tmp_path_factory.mktemp("noise")
    for name, text in native_target.source_files(load_part("noisy", TOYS), "guid", 2).items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "ask.c").write_text(
        '#include "model.c"\n'
        '#define SEEN __attribute__((visibility("default")))\n'
        "SEEN double ask_quantile(double p) {\n"
        "    double at[AHEAD], x[AHEAD];\n"
        "    for (int i = 0; i < AHEAD; i++) at[i] = i == 7 ? p : 0.01 * (i + 1);\n"
        "    quantiles(at, x);\n"
        "    return x[7];\n"
        "}\n"
        "SEEN double ask_normal(uint64_t s, int port, uint64_t k, int ahead) {\n"
        "    double out[AHEAD];\n"
        "    normals(key_of(s, port), k, out);\n"
        "    return out[ahead];\n"
        "}\n",
        encoding="utf-8",
    )
    compiler.compile_library(folder / "ask.c", folder / "ask.so", (folder,), compiler.this_platform())
    library = ctypes.CDLL(str(folder / "ask.so"))
    library.ask_quantile.restype = library.ask_normal.restype = ctypes.c_double
    library.ask_quantile.argtypes = [ctypes.c_double]
    library.ask_normal.argtypes = [ctypes.c_uint64, ctypes.c_int, ctypes.c_uint64, ctypes.c_int]
    return library


@pytest.mark.long
def test_quantile(in_c: ctypes.CDLL) -> None:
    """All three branches of AS 241: bit-equal with Python's, and with scipy to 1e-14 relative."""
    small = [10.0**-k for k in range(1, 300, 7)] + [2.0**-54]
    points = [*np.linspace(0.0005, 0.9995, 1999), *small, *(1.0 - 10.0**-k for k in range(1, 16))]
    inverse = NormalDist().inv_cdf
    for p in map(float, points):
        x = in_c.ask_quantile(p)
        assert x == inverse(p)
        assert x == pytest.approx(float(scipy.special.ndtri(p)), rel=1e-14, abs=1e-14)


def test_normal_is_the_same_in_c(in_c: ctypes.CDLL) -> None:
    for seed in (0, 1, 7, 2**31 - 1):
        for port in (0, 1, 5):
            for count in (0, 1, 2, 12345, 2**40):
                for ahead in range(64):
                    assert in_c.ask_normal(seed, port, count, ahead) == normal(seed, port, count + ahead)


@pytest.fixture(scope="module")
def draws() -> dict[tuple[int, int], np.ndarray]:
    keys = [(seed, port) for seed in (0, 1, 2, 1000) for port in (0, 1)]
    return {k: np.array([normal(*k, n) for n in range(N)]) for k in keys}


@pytest.mark.long
def test_distribution(draws: dict[tuple[int, int], np.ndarray]) -> None:
    """Kolmogorov-Smirnov, mean, variance, and neighbours uncorrelated: each within 4.5 sigma of its law."""
    for x in draws.values():
        assert scipy.stats.kstest(x, "norm").pvalue > 1e-4
        assert abs(x.mean()) < 4.5 / math.sqrt(N)
        assert abs(x.var() - 1.0) < 4.5 * math.sqrt(2.0 / N)
        for lag in (1, 2, 3, 10):
            assert abs(np.mean(x[lag:] * x[:-lag])) < 4.5 / math.sqrt(N)


def test_seeds_and_ports_are_independent(draws: dict[tuple[int, int], np.ndarray]) -> None:
    keys = list(draws)
    for i, a in enumerate(keys):
        for b in keys[:i]:
            for shift in (0, 1, 2):  # neighbouring seeds are not shifted copies of each other
                r = np.mean(draws[a][shift:] * draws[b][: N - shift])
                assert abs(r) < 4.5 / math.sqrt(N), (a, b, shift)


def series(one: object, h: float, n: int) -> np.ndarray:
    one.initialize()
    rows = []
    for k in range(n):
        one.step(k * h, h)
        rows.append(one.get(["a", "b", "c", "d"]))
    return np.array(rows)


@pytest.mark.long
def test_density_is_independent_of_the_step(instance: Callable) -> None:
    """Two-sided density 0.2 V/sqrt(Hz): one-sided PSD 2 x 0.04, flat, at 1 ms and at 2.5 ms.

    The mean of n independent chi-square bins scatters by sqrt(2 / n) = 0.8 % at n = 32768 samples.
    """
    for h in (1e-3, 2.5e-3):
        n = 1 << 15
        x = series(instance("noisy", "native", toy=True), h, n)
        _, p = scipy.signal.welch(x[:, 0], fs=1.0 / h, nperseg=256, detrend=False)
        assert np.mean(p[1:-1]) == pytest.approx(2 * 0.2**2, rel=4 * math.sqrt(2.0 / n))
        low, high = p[1:64].mean(), p[64:-1].mean()
        assert low / high == pytest.approx(1.0, abs=0.05)  # white
        assert np.std(x[:, 2]) == pytest.approx(0.5, rel=4 / math.sqrt(2 * n))  # per step: no matter which
        assert np.all(x[:, 3] == x[0, 3])  # per start
        assert abs(np.corrcoef(x[:, 0], x[:, 1])[0, 1]) < 4.5 / math.sqrt(n)


def test_internal_steps_keep_the_density(instance: Callable) -> None:
    """Ten internal steps a communication step: the last one is seen, with the variance of its own length."""
    one = instance("noisy", "native", toy=True)
    one.set({"step": 1e-4})
    x = series(one, 1e-3, 8000)
    assert np.std(x[:, 0]) == pytest.approx(0.2 / math.sqrt(1e-4), rel=4 / math.sqrt(2 * 8000))


@pytest.mark.parametrize("kind", ["plain", "native", "python", "native-fmi3"])
def test_a_step_of_rounding_size_holds_the_samples(kind: str, instance: Callable) -> None:
    """A master that sums up the time ends with a step of 1e-12 s, over which white noise of 0.2 V/sqrt(Hz) has 2e5 V.

    The same bits in every form, with a state that is taken in between; before and after it as ever.
    """
    one, same, plain = (instance("noisy", k, toy=True) for k in (kind, "plain", "plain"))
    names = ["a", "b", "c", "d", "e[1]", "e[3]"]
    for i in (one, same, plain):
        i.initialize()
    t, before = 0.0, [0.0] * 6
    for k, h in enumerate((1e-3, 1e-3, 1e-12, 1e-12, 1e-3, 1.1e-9, 1e-3)):  # 1.1e-9 s is a step like any other
        for i in (one, same):
            i.step(t, h)
        plain.step(k * 1e-3, 1e-3)
        if h == 1e-12:  # the second is compared with the last that was drawn, from the state too
            one.set_state(one.load(one.save(one.get_state())))
        t += h
        found = one.get(names)
        assert found == same.get(names), k
        assert (found == before) == (h == 1e-12), k
        assert (found == plain.get(names)) == (h == 1e-3), k  # the count of steps alone decides
        before = found


def test_seed_and_size(instance: Callable) -> None:
    def first(target: str, **parameters: float) -> list[float]:
        one = instance("noisy", target, toy=True)
        one.set(parameters)
        return series(one, 1e-3, 3).ravel().tolist()

    for target in ("plain", "native"):
        assert first(target) == first(target) != first(target, seed=2)
        assert first(target, first=0.0)[0] == 0.0
        doubled = np.array(first(target, first=0.4))
        assert doubled[0] == pytest.approx(2 * first(target)[0], rel=1e-15)


def test_a_port_of_several_samples(instance: Callable) -> None:
    """Each sample has the size of the port and a stream of its own, in all targets: port 4 has the streams 4 to 6."""
    got = {}
    for target in ("plain", "native", "python"):
        one = instance("noisy", target, toy=True)
        one.initialize()
        one.step(0.0, 0.25)
        saved = one.save(one.get_state())
        one.step(0.25, 0.25)
        got[target] = one.get(["e[1]", "e[2]", "e[3]"])
        one.set_state(one.load(saved))
        one.step(0.25, 0.25)
        assert one.get(["e[1]", "e[2]", "e[3]"]) == got[target]
    assert got["native"] == got["plain"] == got["python"]
    assert got["plain"] == [0.5 * normal(1, stream, 2) / math.sqrt(0.25) for stream in (4, 5, 6)]


def test_cannot_be_declared_wrong(written: Callable) -> None:
    with pytest.raises(ValueError, match='one of "start", "step", "second", "use"'):
        written("toy", '    n = Noise(1.0, "V", per="hour")\n')
    with pytest.raises(ValueError, match="of samples=n numbers"):
        written("toy2", '    n = Noise(1.0, "V", per="use")\n')


def test_made_where_read_is_for_methods_that_run_once_a_step(written: Callable) -> None:
    declared = '    y = Output("V", "y")\n    n = Noise(1.0, "V", per="use", samples=2)\n\n'
    cls = written("toy", declared + "    def outputs(self) -> None:\n        self.y = self.noise.n[1]\n")
    with pytest.raises(SubsetError, match="made where it is read: in start and sampled methods"):
        native_target.c_source(cls, "guid")
