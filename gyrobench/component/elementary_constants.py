"""Constants and tables of the elementary functions, made from whole numbers alone: nobody's library decides a digit.

A real number x is held as a whole number near x 2^BITS, with an error of some units of 2^-BITS.  The series are the
definitions: Machin's formula for pi, Taylor's series of sin, exp, arctan and artanh.  C has the same numbers, by
``packaging/elementary_tables.py``; ``tests/packaging/test_elementary.py`` compares them with mpmath.
"""

from __future__ import annotations

from itertools import accumulate, repeat
from math import isqrt

BITS = 160
ONE = 1 << BITS
CIRCLE_BITS = 1216  # of 128 / pi: 1024 for the exponent of a double, 53 for its digits, the rest for the remainder


def nearest(x: int, bits: int = BITS) -> float:
    """Return x 2^-bits as a double."""
    return x / (1 << bits)  # of whole numbers: rounded correctly


def pair(x: int) -> tuple[float, float]:
    """Return x 2^-BITS as the sum of two doubles, the second the rounding error of the first."""
    high = nearest(x)
    return high, nearest(x - fixed(high))


def fixed(x: float) -> int:
    """Return a double in units of 2^-BITS."""
    above, below = x.as_integer_ratio()
    return above * ONE // below


def split(x: int, places: int) -> tuple[float, float]:
    """Return x 2^-BITS as a multiple of 2^-places, towards zero, and the rest."""
    high = (abs(x) >> (BITS - places) << (BITS - places)) * (1 if x > 0 else -1)
    return nearest(high), nearest(x - high)


def _odd_series(x: int, sign: int, one: int) -> int:
    """Return x + sign x^3 / 3 + x^5 / 5 + ... of x >= 0: arctan x (sign -1), artanh x (sign 1)."""
    power, total, k, turn = x, 0, 1, 1
    while power:
        total += turn * (power // k)
        power = power * x // one * x // one
        k, turn = k + 2, sign * turn
    return total


def pi_fixed(bits: int) -> int:
    """Return pi in units of 2^-bits, by Machin: pi / 4 = 4 arctan(1/5) - arctan(1/239)."""
    one = 1 << (bits + 32)
    return 4 * (4 * _odd_series(one // 5, -1, one) - _odd_series(one // 239, -1, one)) >> 32


PI = pi_fixed(BITS)
LN2 = 2 * _odd_series(ONE // 3, 1, ONE)  # artanh(1/3) = ln(2) / 2


def _exp(x: int) -> int:
    term, total, k = ONE, 0, 0
    while term:
        total += term
        k += 1
        term = term * x // (ONE * k)
    return total


def _sine(x: int) -> int:
    term, total, k = x, 0, 1
    while term:
        total += term if k % 4 == 1 else -term
        term = term * x // ONE * x // (ONE * (k + 1) * (k + 2))
        k += 2
    return total


def _turn_row(j: int) -> tuple[float, float, float, float]:
    """Return S, L, E, D of the angle a = j pi / 128: sin a = S + L, cos a = E + D with E = -1, 0 or 1 the nearest."""
    s, c = (SINES[j], SINES[64 - j]) if j <= 64 else (SINES[128 - j], -SINES[j - 64])
    high, low = pair(s)
    e = 1 if c > ONE // 2 else -1 if c < -ONE // 2 else 0
    return high, low, float(e), nearest(c - e * ONE)


def _log_row(j: int) -> tuple[float, float, float]:
    """Return c, H, L: c the multiple of 2^-9 nearest 128 / j, -ln c = H + L with H a multiple of 2^-42."""
    c = (2 * 128 * 512 // j + 1) // 2
    half = _odd_series(abs(c - 512) * ONE // (c + 512), 1, ONE)  # artanh((c - 1) / (c + 1)) = ln(c) / 2
    return c / 512.0, *split(-2 * half if c > 512 else 2 * half, 42)


SINES = [0, *(_sine(j * PI // 128) for j in range(1, 64)), ONE]
TURN = tuple(_turn_row(j) for j in range(128))
STEP = pair(PI // 128)
STEPS = nearest((1 << 2 * BITS) * 128 // PI)
_first, _rest = split(PI // 128, 39)
STEP_1, (STEP_2, STEP_3) = _first, split(PI // 128 - fixed(_first), 73)
CIRCLE = (1 << (2 * CIRCLE_BITS + 71)) // pi_fixed(CIRCLE_BITS + 64)  # floor(128 / pi 2^CIRCLE_BITS)
LIMBS = [(CIRCLE >> 32 * k) & 0xFFFFFFFF for k in range(CIRCLE_BITS // 32 + 1)]
HALF_PI = pair(PI // 2)
WHOLE_PI = pair(PI)

_root = _exp(LN2 // 128)
POWER = tuple(pair(x) for x in accumulate(repeat(_root, 127), lambda x, y: x * y >> BITS, initial=ONE))  # 2^(j / 128)
LN2_STEP_1, LN2_STEP_2 = split(LN2 // 128, 42)
LN2_STEPS = nearest((1 << 2 * BITS) * 128 // LN2)

LOG_FIRST = 91
LOG = tuple(_log_row(j) for j in range(LOG_FIRST, 182))
LN2_1, LN2_2 = split(LN2, 42)
ROOT_HALF = nearest(isqrt(ONE * ONE // 2))

_turns = (_odd_series(256 * ONE // (65536 + j * (j - 1)), -1, ONE) for j in range(1, 257))
ANGLE = tuple(pair(x) for x in accumulate(_turns, initial=0))  # arctan(j / 256), from the difference of neighbours
