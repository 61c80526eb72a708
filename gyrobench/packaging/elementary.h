/* sin, cos, tan, asin, atan, atan2, exp, log, tanh: gyrobench/component/elementary.py, operation by operation.
 *
 * No library decides a bit: + - * / and sqrt are those of IEEE 754, no product may be contracted with a sum.
 * The tables are made by gyrobench/component/elementary_constants.py.
 */
#if defined(_MSC_VER) && !defined(__clang__)
#pragma fp_contract(off)
#elif defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#endif
#include "elementary_tables.h"

#define EF_TO_WHOLE 6755399441055744.0 /* 1.5 * 2^52: adding and subtracting it rounds to a whole number */
#define EF_SPLITTER 134217729.0 /* 2^27 + 1 */
#ifdef __GNUC__
#define EF_RARE(x) __builtin_expect(!!(x), 0)
#define EF_ALWAYS inline __attribute__((always_inline))
#define EF_VALUE __attribute__((noinline, const, unused)) /* const: asked once for the same arguments */
#else
#define EF_RARE(x) (x)
#define EF_ALWAYS inline
#define EF_VALUE
#endif

typedef struct { double v, rest; } doubled; /* a number as a sum; the second is small */
typedef struct { int n; double r, error; } turned; /* n pi / 128 + r + error */

static inline uint64_t bits_of(double x) { uint64_t b; memcpy(&b, &x, sizeof b); return b; }
static inline double of_bits(uint64_t b) { double x; memcpy(&x, &b, sizeof x); return x; }
static inline double power_of_two(int k) { return of_bits((uint64_t)(k + 1023) << 52); } /* -1022 <= k <= 1023 */
static inline double signed_as(double x, double like) {
    return of_bits((bits_of(x) & ~((uint64_t)1 << 63)) | (bits_of(like) & ((uint64_t)1 << 63)));
}

static inline double product_error(double a, double b, double p) {
    const double ta = EF_SPLITTER * a, ah = ta - (ta - a), al = a - ah;
    const double tb = EF_SPLITTER * b, bh = tb - (tb - b), bl = b - bh;
    return ((ah * bh - p) + ah * bl + al * bh) + al * bl;
}

static COLD turned far_turn(double x) {
    turned of = {0, 0.0, 0.0};
    uint32_t y[8] = {0}, window[8], m[2];
    uint64_t b = bits_of(x) & 0x7FFFFFFFFFFFFFFFu, sum;
    double high = 0.0, low = 0.0, unit = 0x1p-32, p, q, sign = 1.0;
    int i, j, e, shift;
    if (!(b < (uint64_t)2047 << 52)) {
        of.r = x - x; /* NaN */
        return of;
    }
    if (b >> 52 == 0) { of.r = x; return of; } /* no multiple of the step is so small */
    e = (int)(b >> 52) - 1075;
    b = (b & 0xFFFFFFFFFFFFFu) | 0x10000000000000u;
    m[0] = (uint32_t)b;
    m[1] = (uint32_t)(b >> 32);
    shift = EF_CIRCLE_BITS - 224 - e;
    if (shift > EF_CIRCLE_BITS) { of.r = x; return of; }
    for (i = 0; i < 8; i++) {
        const int at = shift / 32 + i;
        const uint64_t two = (at < EF_CIRCLE_LIMBS ? circle[at] : 0)
                           | (uint64_t)(at + 1 < EF_CIRCLE_LIMBS ? circle[at + 1] : 0) << 32;
        window[i] = (uint32_t)(two >> (shift % 32));
    }
    for (j = 0; j < 2; j++)
        for (sum = 0, i = j; i < 8; i++) {
            sum += (uint64_t)m[j] * window[i - j] + y[i];
            y[i] = (uint32_t)sum;
            sum >>= 32;
        }
    of.n = (int)(y[7] & 0xFFFFFF);
    if (y[6] >> 31) {
        of.n++;
        sign = -1.0;
        for (sum = 1, i = 0; i < 7; i++) {
            sum += (uint32_t)~y[i];
            y[i] = (uint32_t)sum;
            sum >>= 32;
        }
    }
    for (i = 6; i > 1; i--) {
        const double t = low + (double)y[i] * unit, s = high + t;
        low = t - (s - high);
        high = s;
        unit = unit * 0x1p-32;
    }
    p = high * EF_STEP_HIGH;
    q = product_error(high, EF_STEP_HIGH, p) + (high * EF_STEP_LOW + low * EF_STEP_HIGH);
    of.r = p + q;
    of.error = q - (of.r - p);
    if (x < 0.0) { of.n = -of.n; sign = -sign; }
    of.n &= 255;
    of.r = sign * of.r;
    of.error = sign * of.error;
    return of;
}

static EF_ALWAYS turned turn(double x) {
    const double k = (x * EF_STEPS + EF_TO_WHOLE) - EF_TO_WHOLE, first = x - k * EF_STEP_1, second = k * EF_STEP_2;
    const double r = first - second, b = r - first, error = (first - (r - b)) - (second + b);
    const double third = k * EF_STEP_3, rest = r - third;
    turned of;
    if (EF_RARE(!(fabs(x) < 12800.0 && fabs(rest) >= fabs(k) * 0x1p-67))) return far_turn(x);
    of.n = (int)k;
    of.r = rest;
    of.error = ((r - rest) - third) + error;
    return of;
}

static EF_ALWAYS doubled sine(int n, double r, double error) {
    const double *row = turn_table[n & 127], high = row[0], low = row[1], near = row[2], more = row[3];
    const double z = r * r, cosine = near + more, straight = near * r, s = high + straight;
    const double odd = (cosine * (r * z)) * (-1.0 / 6.0 + z * (1.0 / 120.0 - z * (1.0 / 5040.0)));
    const double even = (high * z) * (-0.5 + z * (1.0 / 24.0 - z * (1.0 / 720.0)));
    const double rest = ((straight - (s - high)) + (low + (more * r + cosine * error))) + (odd + even);
    doubled of = {s, rest};
    if (n & 128) { of.v = -s; of.rest = -rest; }
    return of;
}

/* Below half a step of the table, n = 0: the bits that turn and sine find, without their tables and zeros. */
#define EF_NEAR_ZERO(x) (fabs(x) < 0.0122)
static EF_ALWAYS double sin_near_zero(double x) {
    const double z = x * x;
    return EF_RARE(fabs(x) < 0x1p-27) ? x : x + (x * z) * (-1.0 / 6.0 + z * (1.0 / 120.0 - z * (1.0 / 5040.0)));
}
static EF_ALWAYS double cos_near_zero(double x) {
    const double z = x * x;
    return 1.0 + z * (-0.5 + z * (1.0 / 24.0 - z * (1.0 / 720.0)));
}

static EF_VALUE double f_sin(double x) {
    if (EF_NEAR_ZERO(x)) return sin_near_zero(x);
    const turned t = turn(x);
    const doubled s = sine(t.n, t.r, t.error);
    return s.v + s.rest;
}

static EF_VALUE double f_cos(double x) {
    if (EF_NEAR_ZERO(x)) return cos_near_zero(x);
    const turned t = turn(x);
    const doubled s = sine(t.n + 64, t.r, t.error);
    return s.v + s.rest;
}

/* Sine and cosine of one reduction, as a complex number, which is a value to the compiler: it asks once for both.  As
   WebAssembly a complex number is returned in memory: there each is a value of its own. */
#if defined(__GNUC__) && !defined(__wasm__)
static EF_VALUE double _Complex pair_of(double x) {
    double _Complex of;
    if (EF_NEAR_ZERO(x)) {
        __real__ of = sin_near_zero(x);
        __imag__ of = cos_near_zero(x);
    } else {
        const turned t = turn(x);
        const doubled s = sine(t.n, t.r, t.error), c = sine(t.n + 64, t.r, t.error);
        __real__ of = s.v + s.rest;
        __imag__ of = c.v + c.rest;
    }
    return of;
}
static inline double f_paired_sin(double x) { return __real__ pair_of(x); }
static inline double f_paired_cos(double x) { return __imag__ pair_of(x); }
#else
static double f_paired_sin(double x) { return f_sin(x); }
static double f_paired_cos(double x) { return f_cos(x); }
#endif

static inline doubled quotient(doubled a, doubled b) {
    const double q = a.v / b.v, p = q * b.v;
    const doubled of = {q, (((a.v - p) - product_error(q, b.v, p)) + (a.rest - q * b.rest)) / b.v};
    return of;
}

static inline doubled normalized(double s, double rest) {
    const double t = s + rest;
    const doubled of = {t, rest - (t - s)};
    return of;
}

static EF_VALUE double f_tan(double x) {
    turned t;
    doubled s, c;
    if (fabs(x) < 0.0625) {
        const double z = x * x;
        const double more = 62.0 / 2835.0 + z * (1382.0 / 155925.0 + z * (21844.0 / 6081075.0 + z * (929569.0 / 638512875.0)));
        return x + (x * z) * (1.0 / 3.0 + z * (2.0 / 15.0 + z * (17.0 / 315.0 + z * more)));
    }
    t = turn(x);
    s = sine(t.n, t.r, t.error);
    c = sine(t.n + 64, t.r, t.error);
    s = quotient(normalized(s.v, s.rest), normalized(c.v, c.rest));
    return s.v + s.rest;
}

static inline double arctan_series(double z) { /* (arctan(x) - x) / x^3 for z = x^2 < 1/256 */
    const double more = 1.0 / 9.0 + z * (-1.0 / 11.0 + z * (1.0 / 13.0 + z * (-1.0 / 15.0)));
    return -1.0 / 3.0 + z * (1.0 / 5.0 + z * (-1.0 / 7.0 + z * more));
}

static NEVER_INLINE double angle(double y, double y_rest, double x, double x_rest, double base, double base_rest, double sign) {
    const double q = y / x;
    double high = 0.0, t = q, small, z, first, s, rest;
    if (q < 0.0625) {
        const double p = q * x;
        if (base == 0.0 && q < 0x1p-28) return q;
        rest = (((y - p) - product_error(q, x, p)) + (y_rest - q * x_rest)) / x;
        z = q * q;
        small = rest + (t * z) * arctan_series(z);
    } else {
        const int j = (int)(q * 256.0 + 0.5);
        const double c = j / 256.0, split = EF_SPLITTER * x, xh = split - (split - x), xl = x - xh;
        high = angle_table[j][0];
        t = (((y - c * xh) - c * xl) + (y_rest - c * x_rest)) / (x + c * y);
        z = t * t;
        small = angle_table[j][1] + (t * z) * (-1.0 / 3.0 + z * (1.0 / 5.0));
    }
    high = sign * high;
    t = sign * t;
    first = base + high;
    s = first + t;
    rest = (t - (s - first)) + ((high - (first - base)) + (sign * small + base_rest));
    return s + rest;
}

static inline int is_infinite(double x) { return fabs(x) > 1.7976931348623157e308; }

static EF_VALUE double f_atan2(double y, double x) {
    double a, b, large, small, f;
    int left;
    if (x != x || y != y) return x + y;
    if (EF_RARE(is_infinite(x))) {
        y = signed_as(is_infinite(y) ? 1.0 : 0.0, y);
        x = signed_as(1.0, x);
    } else if (EF_RARE(is_infinite(y))) {
        y = signed_as(1.0, y);
        x = 0.0;
    }
    a = fabs(y);
    b = fabs(x);
    left = (int)(bits_of(x) >> 63);
    if (a == 0.0) return left ? signed_as(EF_PI_HIGH, y) : y;
    large = a > b ? a : b;
    small = a > b ? b : a;
    if (EF_RARE(large > 0x1p500)) {
        if (!left && b == large && small / large < 0x1p-28) return signed_as(small / large, y);
        large = large * 0x1p-600;
        small = small * 0x1p-600;
    } else if (EF_RARE(large < 0x1p-500)) {
        large = large * 0x1p600;
        small = small * 0x1p600;
    }
    if (a > b) f = angle(small, 0.0, large, 0.0, EF_HALF_PI_HIGH, EF_HALF_PI_LOW, left ? 1.0 : -1.0);
    else f = angle(small, 0.0, large, 0.0, left ? EF_PI_HIGH : 0.0, left ? EF_PI_LOW : 0.0, left ? -1.0 : 1.0);
    return signed_as(f, y);
}

static EF_VALUE double f_atan(double x) {
    const double z = x * x;
    if (fabs(x) < 0x1p-27) return x;
    return fabs(x) < 0.0625 ? x + (x * z) * arctan_series(z) : f_atan2(x, 1.0);
}

static EF_VALUE double f_asin(double x) {
    const double a = fabs(x);
    double p, h, rest, s, f;
    if (a < 0.0625 || x != x) {
        const double z = x * x;
        const double more = 35.0 / 1152.0 + z * (63.0 / 2816.0 + z * (231.0 / 13312.0 + z * (143.0 / 10240.0)));
        return x + (x * z) * (1.0 / 6.0 + z * (3.0 / 40.0 + z * (5.0 / 112.0 + z * more)));
    }
    if (a > 1.0) return (double)NAN;
    p = a * a;
    h = 1.0 - p;
    rest = ((1.0 - h) - p) - product_error(a, a, p);
    s = sqrt(h);
    if (s == 0.0) return signed_as(EF_HALF_PI_HIGH, x);
    p = s * s;
    rest = (((h - p) - product_error(s, s, p)) + rest) / (2.0 * s);
    f = a <= s ? angle(a, 0.0, s, rest, 0.0, 0.0, 1.0) : angle(s, rest, a, 0.0, EF_HALF_PI_HIGH, EF_HALF_PI_LOW, -1.0);
    return signed_as(f, x);
}

static EF_VALUE double f_exp(double x) {
    double n, r, p, high, rest, y, scale, a, s;
    int j, k;
    if (EF_RARE(!(fabs(x) < 745.5))) return x != x ? x : x < 0.0 ? 0.0 : (double)INFINITY;
    n = (x * EF_LN2_STEPS + EF_TO_WHOLE) - EF_TO_WHOLE;
    r = (x - n * EF_LN2_STEP_1) - n * EF_LN2_STEP_2;
    j = (int)n & 127;
    k = ((int)n - j) / 128;
    high = power_table[j][0];
    p = r + (r * r) * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0))));
    rest = power_table[j][1] + high * p;
    y = high + rest;
    if (EF_RARE(k < -1021 && (k < -1022 || y < 1.0))) { /* a result below 2^-1022 is rounded once, at the place of its last digit */
        scale = power_of_two(k + 1022);
        a = high * scale;
        s = 1.0 + a;
        return ((s + ((a - (s - 1.0)) + rest * scale)) - 1.0) * 0x1p-1022;
    }
    if (EF_RARE(k >= 1024)) {
        if (k > 1024) return (double)INFINITY;
        y = 2.0 * y;
        k = 1023;
    }
    return y * power_of_two(k);
}

static EF_ALWAYS double logarithm(double x) {
    double m, c, mh, a, b, r, error, whole, s, inner, rest;
    const double *row;
    int e, k = 0;
    if (EF_RARE(!(x >= 0x1p-1022))) {
        if (x == 0.0) return -(double)INFINITY;
        if (!(x > 0.0)) return x != x ? x : (double)NAN;
        x = x * 0x1p54;
        k = -54;
    }
    if (EF_RARE(is_infinite(x))) return x;
    e = (int)((bits_of(x) - bits_of(EF_ROOT_HALF) + ((uint64_t)1023 << 52)) >> 52) - 1023;
    m = of_bits(bits_of(x) - ((uint64_t)e << 52)); /* sqrt(1/2) <= m < sqrt(2) */
    k = k + e;
    row = log_table[(int)(m * 128.0 + 0.5) - EF_LOG_FIRST];
    c = row[0];
    mh = (m + 3145728.0) - 3145728.0; /* 1.5 * 2^21: leaves a multiple of 2^-31 */
    a = mh * c - 1.0;
    b = (m - mh) * c;
    r = a + b;
    error = b - (r - a);
    whole = k * EF_LN2_1 + row[1];
    s = whole + r;
    inner = 1.0 / 3.0 + r * (-0.25 + r * (0.2 + r * (-1.0 / 6.0 + r * (1.0 / 7.0))));
    rest = (r - (s - whole)) + ((error + (k * EF_LN2_2 + row[2])) + (r * r) * (-0.5 + r * inner));
    return s + rest;
}

static EF_VALUE double f_log(double x) { return logarithm(x); }

static inline doubled beside(double high, double r, double rest, double one) { /* high + r + rest + one */
    const double a = high + one, b = one - (a - high), s = a + r, t = s - a;
    return normalized(s, ((a - (s - t)) + (r - t)) + (b + rest));
}

static EF_VALUE double f_tanh(double x) {
    const double a = fabs(x);
    double z, n, first, second, r, error, scale, high, low, p, rest;
    doubled q;
    int j;
    if (a < 0x1p-27 || x != x) return x;
    if (a > 22.0) return signed_as(1.0, x);
    z = 2.0 * a;
    n = (z * EF_LN2_STEPS + EF_TO_WHOLE) - EF_TO_WHOLE;
    first = z - n * EF_LN2_STEP_1;
    second = n * EF_LN2_STEP_2;
    r = first - second;
    error = (first - r) - second;
    j = (int)n & 127;
    scale = power_of_two(((int)n - j) / 128);
    high = power_table[j][0];
    p = error + (r * r) * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0)))));
    low = power_table[j][1];
    rest = scale * (low + (((high - 1.0) + low) * r + high * p));
    high = scale * high;
    r = scale * r;
    q = quotient(beside(high, r, rest, -1.0), beside(high, r, rest, 1.0));
    return signed_as(q.v + q.rest, x);
}
