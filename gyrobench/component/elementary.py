"""sin, cos, tan, asin, atan, atan2, exp, log, tanh: the same bits in Python and in C, on every platform.

``packaging/elementary.h`` repeats this file operation by operation.  Only + - * / and square roots, which IEEE 754
rounds correctly, exact scalings and whole numbers are used.  Each function splits its argument into a tabulated point
and a small rest, carries what the leading terms lose in a second double, and rounds once at the end: the error is below
0.6 ulp for every double (``tests/packaging/test_elementary.py`` measures it against mpmath).

Sources: the splitting of a product, Dekker, Numer. Math. 18 (1971); the reduction of large angles, Payne and Hanek,
SIGNUM Newsl. 18 (1983); tables with a rest, Tang, ACM TOMS 15 (1989) and 16 (1990).

As ``math`` does, a function stops with ValueError outside its domain and with OverflowError beyond the largest double,
where C gives NaN or infinity, which the check of the numbers finds.
"""

from __future__ import annotations

import math
from math import copysign, frexp, ldexp, sqrt

from gyrobench.component import elementary_constants as table

TO_WHOLE = 6755399441055744.0  # 1.5 * 2^52: adding and subtracting it rounds to a whole number
SPLITTER = 134217729.0  # 2^27 + 1


def product_error(a: float, b: float, p: float) -> float:
    """Return a b - p exactly, where p is the rounded product."""
    t = SPLITTER * a
    ah = t - (t - a)
    al = a - ah
    t = SPLITTER * b
    bh = t - (t - b)
    bl = b - bh
    return ((ah * bh - p) + ah * bl + al * bh) + al * bl


def far_turn(x: float) -> tuple[int, float, float]:
    """Return what :func:`turn` does by whole numbers: for large angles and those next to a multiple of the step."""
    mantissa, exponent = frexp(abs(x))
    m, e = int(ldexp(mantissa, 53)), exponent - 53
    if e < -224:  # no multiple of the step is so small
        return 0, x, 0.0
    window = (table.CIRCLE >> (table.CIRCLE_BITS - 224 - e)) & ((1 << 256) - 1)
    y = m * window & ((1 << 256) - 1)  # x / STEP in units of 2^-224, without multiples of 2^32
    n, sign = y >> 224, 1.0
    y &= (1 << 224) - 1
    if y >> 223:
        n, y, sign = n + 1, (1 << 224) - y, -1.0
    high, low, unit = 0.0, 0.0, 2.0**-32
    for k in range(6, 1, -1):
        t = low + float((y >> 32 * k) & 0xFFFFFFFF) * unit
        s = high + t
        low = t - (s - high)
        high = s
        unit = unit * 2.0**-32
    p = high * table.STEP[0]
    q = product_error(high, table.STEP[0], p) + (high * table.STEP[1] + low * table.STEP[0])
    r = p + q
    rest = q - (r - p)
    if x < 0.0:
        n, sign = -n, -sign
    return n & 255, sign * r, sign * rest


def turn(x: float) -> tuple[int, float, float]:
    """Return n modulo 256, r and its rounding error, so that x = n pi / 128 + r + error."""
    k = (x * table.STEPS + TO_WHOLE) - TO_WHOLE
    first = x - k * table.STEP_1
    second = k * table.STEP_2
    r = first - second
    b = r - first
    error = (first - (r - b)) - (second + b)
    third = k * table.STEP_3
    rest = r - third
    error = ((r - rest) - third) + error
    if abs(x) < 12800.0 and abs(rest) >= abs(k) * 2.0**-67:
        return int(k) & 255, rest, error
    if not math.isfinite(x):
        if x != x:
            return 0, x, 0.0
        raise ValueError("math domain error")
    return far_turn(x)


def sine(n: int, r: float, error: float) -> tuple[float, float]:
    """Return sin(n pi / 128 + r + error) as a double and a small rest."""
    high, low, near, more = table.TURN[n & 127]
    z = r * r
    cosine = near + more
    straight = near * r
    s = high + straight
    odd = (cosine * (r * z)) * (-1.0 / 6.0 + z * (1.0 / 120.0 - z * (1.0 / 5040.0)))
    even = (high * z) * (-0.5 + z * (1.0 / 24.0 - z * (1.0 / 720.0)))
    rest = ((straight - (s - high)) + (low + (more * r + cosine * error))) + (odd + even)
    return (-s, -rest) if n & 128 else (s, rest)


def sin(x: float) -> float:
    if abs(x) < 2.0**-27:
        return float(x)
    s, rest = sine(*turn(x))
    return s + rest


def cos(x: float) -> float:
    n, r, error = turn(x)
    s, rest = sine(n + 64, r, error)
    return s + rest


def quotient(a: float, a_rest: float, b: float, b_rest: float) -> tuple[float, float]:
    """Return (a + a_rest) / (b + b_rest) as a double and a small rest."""
    q = a / b
    p = q * b
    return q, (((a - p) - product_error(q, b, p)) + (a_rest - q * b_rest)) / b


def normal(s: float, rest: float) -> tuple[float, float]:
    """Return a sum as its rounded value and the error of that; the first is the larger one."""
    t = s + rest
    return t, rest - (t - s)


def tan(x: float) -> float:
    if abs(x) < 0.0625:
        z = x * x
        more = 62.0 / 2835.0 + z * (1382.0 / 155925.0 + z * (21844.0 / 6081075.0 + z * (929569.0 / 638512875.0)))
        return x + (x * z) * (1.0 / 3.0 + z * (2.0 / 15.0 + z * (17.0 / 315.0 + z * more)))
    n, r, error = turn(x)
    q, rest = quotient(*normal(*sine(n, r, error)), *normal(*sine(n + 64, r, error)))
    return q + rest


def arctan_series(z: float) -> float:
    """Return (arctan(x) - x) / x^3 for z = x^2 < 1/256."""
    more = 1.0 / 9.0 + z * (-1.0 / 11.0 + z * (1.0 / 13.0 + z * (-1.0 / 15.0)))
    return -1.0 / 3.0 + z * (1.0 / 5.0 + z * (-1.0 / 7.0 + z * more))


def angle(y: float, y_rest: float, x: float, x_rest: float, base: tuple[float, float], sign: float) -> float:
    """Return base + sign arctan((y + y_rest) / (x + x_rest)), 0 <= y <= x."""
    q = y / x
    if q < 0.0625:
        if base[0] == 0.0 and q < 2.0**-28:
            return q
        high, low = 0.0, 0.0
        p = q * x
        rest = (((y - p) - product_error(q, x, p)) + (y_rest - q * x_rest)) / x
        t, z = q, q * q
        small = rest + (t * z) * arctan_series(z)
    else:
        j = int(q * 256.0 + 0.5)
        c_j = j / 256.0
        high, low = table.ANGLE[j]
        s = SPLITTER * x
        xh = s - (s - x)
        xl = x - xh
        t = (((y - c_j * xh) - c_j * xl) + (y_rest - c_j * x_rest)) / (x + c_j * y)
        z = t * t
        small = low + (t * z) * (-1.0 / 3.0 + z * (1.0 / 5.0))
    high, t = sign * high, sign * t
    first = base[0] + high
    s = first + t
    rest = (t - (s - first)) + ((high - (first - base[0])) + (sign * small + base[1]))
    return s + rest


NONE = (0.0, 0.0)


def atan2(y: float, x: float) -> float:
    if x != x or y != y:
        return x + y
    if math.isinf(x):
        x, y = copysign(1.0, x), copysign(1.0 if math.isinf(y) else 0.0, y)
    elif math.isinf(y):
        x, y = 0.0, copysign(1.0, y)
    a, b = abs(y), abs(x)
    left = copysign(1.0, x) < 0.0
    if a == 0.0:
        return copysign(table.WHOLE_PI[0], y) if left else y
    large, small = (a, b) if a > b else (b, a)
    if large > 2.0**500:
        if not left and b == large and small / large < 2.0**-28:
            return copysign(small / large, y)
        large, small = large * 2.0**-600, small * 2.0**-600
    elif large < 2.0**-500:
        large, small = large * 2.0**600, small * 2.0**600
    if a > b:
        f = angle(small, 0.0, large, 0.0, table.HALF_PI, 1.0 if left else -1.0)
    else:
        f = angle(small, 0.0, large, 0.0, table.WHOLE_PI if left else NONE, -1.0 if left else 1.0)
    return copysign(f, y)


def atan(x: float) -> float:
    if abs(x) < 2.0**-27:
        return float(x)
    if abs(x) < 0.0625:
        z = x * x
        return x + (x * z) * arctan_series(z)
    return atan2(x, 1.0)


def asin(x: float) -> float:
    a = abs(x)
    if a < 0.0625 or x != x:
        z = x * x
        more = 35.0 / 1152.0 + z * (63.0 / 2816.0 + z * (231.0 / 13312.0 + z * (143.0 / 10240.0)))
        return x + (x * z) * (1.0 / 6.0 + z * (3.0 / 40.0 + z * (5.0 / 112.0 + z * more)))
    if a > 1.0:
        raise ValueError("math domain error")
    p = a * a
    h = 1.0 - p
    rest = ((1.0 - h) - p) - product_error(a, a, p)
    s = sqrt(h)
    if s == 0.0:
        return copysign(table.HALF_PI[0], x)
    p = s * s
    rest = (((h - p) - product_error(s, s, p)) + rest) / (2.0 * s)
    f = angle(a, 0.0, s, rest, NONE, 1.0) if a <= s else angle(s, rest, a, 0.0, table.HALF_PI, -1.0)
    return copysign(f, x)


def exp(x: float) -> float:
    if not abs(x) < 745.5:
        if x < 0.0 or x != x:
            return 0.0 if x < 0.0 else x
        if x == math.inf:
            return x
        raise OverflowError("math range error")
    n = (x * table.LN2_STEPS + TO_WHOLE) - TO_WHOLE
    r = (x - n * table.LN2_STEP_1) - n * table.LN2_STEP_2
    j = int(n) & 127
    k = (int(n) - j) // 128
    high, low = table.POWER[j]
    p = r + (r * r) * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0))))
    rest = low + high * p
    y = high + rest
    if k >= -1021 or (k == -1022 and y >= 1.0):
        if k == 1024:  # 2^1024 is no double
            y, k = 2.0 * y, 1023
        y = y * ldexp(1.0, k)
        if y == math.inf:
            raise OverflowError("math range error")
        return y
    scale = ldexp(1.0, k + 1022)  # a result below 2^-1022 is rounded once, at the place of its last digit
    a = high * scale
    s = 1.0 + a
    return ((s + ((a - (s - 1.0)) + rest * scale)) - 1.0) * 2.0**-1022


def log(x: float) -> float:
    if not x > 0.0:
        if x != x:
            return x
        raise ValueError("math domain error")
    if x == math.inf:
        return x
    m, k = frexp(x)
    if m < table.ROOT_HALF:
        m, k = 2.0 * m, k - 1
    c, high, low = table.LOG[int(m * 128.0 + 0.5) - table.LOG_FIRST]
    t = m + 3145728.0  # 1.5 * 2^21: leaves a multiple of 2^-31
    mh = t - 3145728.0
    a = mh * c - 1.0
    b = (m - mh) * c
    r = a + b
    error = b - (r - a)
    whole = k * table.LN2_1 + high
    s = whole + r
    inner = 1.0 / 3.0 + r * (-0.25 + r * (0.2 + r * (-1.0 / 6.0 + r * (1.0 / 7.0))))
    rest = (r - (s - whole)) + ((error + (k * table.LN2_2 + low)) + (r * r) * (-0.5 + r * inner))
    return s + rest


def tanh(x: float) -> float:
    """(e^2x - 1) / (e^2x + 1), all of it in two doubles."""
    a = abs(x)
    if a < 2.0**-27 or x != x:
        return x
    if a > 22.0:
        return copysign(1.0, x)
    z = 2.0 * a
    n = (z * table.LN2_STEPS + TO_WHOLE) - TO_WHOLE
    first = z - n * table.LN2_STEP_1
    second = n * table.LN2_STEP_2
    r = first - second
    error = (first - r) - second
    j = int(n) & 127
    scale = ldexp(1.0, (int(n) - j) // 128)
    high, low = table.POWER[j]
    p = error + (r * r) * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0)))))
    rest = scale * (low + (((high - 1.0) + low) * r + high * p))
    high, r = scale * high, scale * r
    q, rest = quotient(*beside(high, r, rest, -1.0), *beside(high, r, rest, 1.0))
    return copysign(q + rest, x)


def beside(high: float, r: float, rest: float, one: float) -> tuple[float, float]:
    """Return high + r + rest + one as a double and its rounding error; high >= 1 > r."""
    a = high + one
    b = one - (a - high)
    s = a + r
    t = s - a
    rest = ((a - (s - t)) + (r - t)) + (b + rest)
    return normal(s, rest)
