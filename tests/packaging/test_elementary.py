"""The elementary functions: one set of bits in Python and in C, within 0.6 ulp of the truth, right where it is hard."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable, Sequence

import mpmath as mp
import numpy as np
import pytest

from gyrobench.component import elementary
from gyrobench.component import elementary_constants as c
from gyrobench.packaging import compiler
from gyrobench.packaging.native_target import runtime_files

N = 25_000  # of each range below, in both languages: a million in all
SMALLEST = 5e-324
WORST = 6381956970095103.0 * 2.0**797  # the double that is nearest to a multiple of pi / 2
Many = Callable[..., np.ndarray]


@pytest.fixture(scope="module")
def in_c(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Many]:
    """The functions of elementary.h, called with arrays."""
    folder = tmp_path_factory.mktemp("elementary")
    for name, text in runtime_files().items():
        (folder / name).write_text(text, encoding="utf-8")
    loops = [
        f"SEEN void many_{f}(const double *x, const double *y, double *out, int n) {{\n"
        f"    (void)y; for (int i = 0; i < n; i++) out[i] = f_{f}(x[i]{', y[i]' if f == 'atan2' else ''});\n}}\n"
        for f in RANGES
    ]
    head = '#include "functions.h"\n#define SEEN __attribute__((visibility("default")))\n'
    (folder / "ask.c").write_text(head + "".join(loops), encoding="utf-8")
    compiler.compile_library(folder / "ask.c", folder / "ask.so", (folder,), compiler.this_platform())
    library = ctypes.CDLL(str(folder / "ask.so"))

    def function(name: str) -> Many:
        def many(*arguments: Sequence[float]) -> np.ndarray:
            arrays = [np.ascontiguousarray(a, dtype=float) for a in arguments]
            out = np.empty_like(arrays[0])
            pointers = [a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (*arrays, arrays[0], out)]
            getattr(library, f"many_{name}")(pointers[0], pointers[1], pointers[-1], len(out))
            return out

        return many

    return function


def uniform(low: float, high: float) -> Callable[[np.random.Generator], tuple[np.ndarray, ...]]:
    return lambda rng: (rng.uniform(low, high, N),)


def binary(low: float, high: float, positive: bool = False) -> Callable[[np.random.Generator], tuple[np.ndarray, ...]]:
    """Numbers of both signs whose logarithm to the base 2 is uniform."""
    return lambda rng: (np.exp2(rng.uniform(low, high, N)) * (1.0 if positive else rng.choice([-1.0, 1.0], N)),)


def both(of: Callable, other: Callable) -> Callable[[np.random.Generator], tuple[np.ndarray, ...]]:
    return lambda rng: (of(rng)[0], other(rng)[0])


ANGLES = [
    uniform(-4.0, 4.0),
    uniform(-13e3, 13e3),
    binary(-40, 5),
    binary(13, 1023.99),
    lambda rng: (np.pi / 2 * rng.integers(-8000, 8000, N),),  # next to the zeros
    lambda rng: (np.pi / 256 * rng.integers(-9999, 9999, N),),  # next to the points of the table and halfway
]
RANGES: dict[str, list[Callable[[np.random.Generator], tuple[np.ndarray, ...]]]] = {
    "sin": ANGLES,
    "cos": ANGLES,
    "tan": ANGLES,
    "asin": [uniform(-1, 1), binary(-40, 0), lambda rng: (1.0 - binary(-53, -3, True)(rng)[0],)],
    "atan": [uniform(-2, 2), binary(-1070, 1020)],
    "atan2": [both(uniform(-1, 1), uniform(-1, 1)), both(binary(-30, 30), binary(-30, 30)),
              both(binary(-1070, 1020), binary(-1070, 1020)), both(uniform(0.0, 0.07), uniform(1.0, 1.0))],
    "exp": [uniform(-2, 2), uniform(-745, 709.7), uniform(-745, -707), binary(-40, 3)],
    "log": [uniform(0.5, 2), uniform(0.97, 1.03), binary(-1073, 1023, True),
            lambda rng: (1.0 + binary(-50, -5)(rng)[0],)],
    "tanh": [uniform(-2, 2), uniform(-25, 25), binary(-40, -4)],
}  # fmt: skip


def arguments(name: str) -> list[tuple[np.ndarray, ...]]:
    rng = np.random.default_rng(sum(map(ord, name)))
    found = [of(rng) for of in RANGES[name]]
    return [*found, (np.array([WORST, -WORST]),)] if RANGES[name] is ANGLES else found


def ulp_errors(name: str, xs: tuple[np.ndarray, ...], got: np.ndarray) -> list[float]:
    """The distances from the truth in units of the last digit at the truth."""
    errors = []
    for k, y in enumerate(got):
        with mp.workprec(1250 if abs(xs[0][k]) > 1e5 else 140):
            truth = getattr(mp, name)(*(mp.mpf(float(x[k])) for x in xs))
            _, exponent = mp.frexp(truth)
            errors.append(abs(float((mp.mpf(float(y)) - truth) / mp.mpf(2) ** max(int(exponent) - 53, -1074))))
    return errors


@pytest.mark.parametrize("name", RANGES)
def test_python_has_the_bits_of_c(in_c: Callable[[str], Many], name: str) -> None:
    function = getattr(elementary, name)
    for xs in arguments(name):
        python = np.array([function(*x) for x in zip(*(x.tolist() for x in xs), strict=True)])
        assert python.tobytes() == in_c(name)(*xs).tobytes()


@pytest.mark.parametrize("name", RANGES)
def test_error_below_six_tenths_of_the_last_digit(in_c: Callable[[str], Many], name: str) -> None:
    for xs in arguments(name):
        some = tuple(x[:400] for x in xs)
        assert max(ulp_errors(name, some, in_c(name)(*some))) < 0.6


@pytest.mark.skipif(np.finfo(np.longdouble).nmant < 63, reason="no wider floating point on this platform")
@pytest.mark.parametrize(("name", "ranges"), [("sin", 3), ("cos", 3), ("exp", 2), ("log", 3), ("atan", 1), ("tanh", 1)])
def test_error_of_many_arguments(in_c: Callable[[str], Many], name: str, ranges: int) -> None:
    """As above, against NumPy's functions of 64 digits, whose own errors are a thousandth of the last digit of 53."""
    function = {"atan": np.arctan}.get(name) or getattr(np, name)
    for (x,) in arguments(name)[:ranges]:
        truth = function(x.astype(np.longdouble))
        y = in_c(name)(x)
        assert np.max(np.abs((y - truth) / np.spacing(np.abs(y))).astype(float)) < 0.6


@pytest.mark.parametrize(
    ("name", "xs", "expected"),
    [
        ("sin", (0.0,), 0.0), ("sin", (-0.0,), -0.0), ("sin", (SMALLEST,), SMALLEST), ("sin", (math.nan,), math.nan),
        ("cos", (0.0,), 1.0), ("cos", (math.nan,), math.nan), ("tan", (-0.0,), -0.0), ("tan", (-1e-320,), -1e-320),
        ("asin", (-0.0,), -0.0), ("asin", (1.0,), math.pi / 2), ("asin", (-1.0,), -math.pi / 2),
        ("atan", (-0.0,), -0.0), ("atan", (math.inf,), math.pi / 2), ("atan", (-math.inf,), -math.pi / 2),
        ("atan2", (0.0, 1.0), 0.0), ("atan2", (-0.0, 1.0), -0.0), ("atan2", (0.0, -0.0), math.pi),
        ("atan2", (-0.0, -2.0), -math.pi), ("atan2", (1.0, 0.0), math.pi / 2), ("atan2", (-0.0, 0.0), -0.0),
        ("atan2", (math.inf, math.inf), math.pi / 4), ("atan2", (-math.inf, -math.inf), -3 * math.pi / 4),
        ("atan2", (-1.0, math.inf), -0.0), ("atan2", (1.0, -math.inf), math.pi), ("atan2", (math.nan, 1.0), math.nan),
        ("atan2", (math.inf, 5.0), math.pi / 2), ("atan2", (SMALLEST, 1e300), 0.0), ("atan2", (1e-300, 1e10), 1e-310),
        ("exp", (0.0,), 1.0), ("exp", (-math.inf,), 0.0), ("exp", (math.inf,), math.inf), ("exp", (-746.0,), 0.0),
        ("exp", (-745.0,), SMALLEST), ("exp", (709.782712893384,), 1.7976931348622732e308),
        ("log", (1.0,), 0.0), ("log", (math.inf,), math.inf), ("log", (SMALLEST,), -744.4400719213812),
        ("tanh", (-0.0,), -0.0), ("tanh", (math.inf,), 1.0), ("tanh", (-400.0,), -1.0), ("tanh", (math.nan,), math.nan),
    ],
)  # fmt: skip
def test_special_values(in_c: Callable[[str], Many], name: str, xs: tuple[float, ...], expected: float) -> None:
    for y in (getattr(elementary, name)(*xs), float(in_c(name)(*([x] for x in xs))[0])):
        assert (repr(y) if y == y else "nan") == repr(expected)  # repr tells 0 from -0


@pytest.mark.parametrize(
    ("name", "x", "in_c_it_is", "error"),
    [
        ("sin", math.inf, math.nan, ValueError), ("cos", -math.inf, math.nan, ValueError),
        ("tan", math.inf, math.nan, ValueError), ("asin", 1.5, math.nan, ValueError),
        ("log", -1.0, math.nan, ValueError), ("log", 0.0, -math.inf, ValueError),
        ("exp", 709.8, math.inf, OverflowError), ("exp", 1e300, math.inf, OverflowError),
    ],
)  # fmt: skip
def test_outside_the_domain(
    in_c: Callable[[str], Many], name: str, x: float, in_c_it_is: float, error: type[Exception]
) -> None:
    """C goes on with NaN or infinity, which the check of the numbers finds; Python stops, as its own functions do."""
    assert str(in_c(name)([x])[0]) == str(in_c_it_is)
    with pytest.raises(error):
        getattr(elementary, name)(x)


def test_constants() -> None:
    """Every table and constant against mpmath, to the last digit that its two doubles hold."""
    with mp.workprec(1400):
        assert int(mp.floor(128 / mp.pi * mp.mpf(2) ** c.CIRCLE_BITS)) == c.CIRCLE

        def near(parts: Sequence[float], truth: mp.mpf, places: int) -> bool:
            return abs(sum(map(mp.mpf, parts)) - truth) <= mp.mpf(2) ** -places

        assert near([c.STEP_1, c.STEP_2, c.STEP_3], mp.pi / 128, 126)
        assert near([c.LN2_1, c.LN2_2], mp.log(2), 95)
        assert near([c.LN2_STEP_1, c.LN2_STEP_2], mp.log(2) / 128, 95)
        assert near(c.STEP, mp.pi / 128, 110) and near(c.HALF_PI, mp.pi / 2, 106) and near(c.WHOLE_PI, mp.pi, 105)
        assert float(128 / mp.pi) == c.STEPS and float(128 / mp.log(2)) == c.LN2_STEPS
        assert float(mp.sqrt(0.5)) == c.ROOT_HALF
        for j, (s, low, near_cosine, rest) in enumerate(c.TURN):
            assert near([s, low], mp.sin(j * mp.pi / 128), 106)
            cosine = mp.cos(j * mp.pi / 128)
            assert near([near_cosine, rest], cosine, 53) and abs(rest) <= 0.5
        for j, parts in enumerate(c.POWER):
            assert near(parts, mp.mpf(2) ** (mp.mpf(j) / 128), 105)
        for j, (inverse, *parts) in enumerate(c.LOG, c.LOG_FIRST):
            assert abs(inverse * j / 128 - 1) < 0.0014 and (inverse * 512).is_integer()
            assert near(parts, -mp.log(inverse), 94) and (parts[0] * 2.0**42).is_integer()
        for j, parts in enumerate(c.ANGLE):
            assert near(parts, mp.atan(mp.mpf(j) / 256), 106)
        assert (c.STEP_1 * 2.0**39).is_integer() and (c.STEP_2 * 2.0**73).is_integer()


def test_the_hardest_angle() -> None:
    """cos of 6381956970095103 2^797 is -4.687e-19: 61 binary digits cancel in the reduction."""
    assert elementary.cos(WORST) == pytest.approx(-4.687165924254624e-19, rel=1e-14)
