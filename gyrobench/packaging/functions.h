/* Functions that are the same in every native component; a library of several components holds them once. */
#ifndef GYROBENCH_FUNCTIONS
#define GYROBENCH_FUNCTIONS

#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#define GAMMA 0x9E3779B97F4A7C15u
#define AHEAD 64
#define PATIENCE 8
#define ROUNDING 1e-6 /* of the step before: a shorter one is the rounding of a master that sums up the time */

/* COLD: no part of a step, so it is compiled for size, which is less work for the compiler. */
#ifdef __GNUC__
#define NEVER_INLINE __attribute__((noinline))
#define COLD __attribute__((cold, noinline))
#else
#define NEVER_INLINE
#define COLD
#endif

enum { ONCE, PER_STEP, PER_SECOND }; /* kinds of noise ports */

static double plain(double x) { return x != x ? (double)NAN : x; } /* prints "nan", never "-nan" */

/* An index that is known only when it runs. */
static inline int whole(double x) { return x > -1e9 && x < 1e9 ? (int)x : -1; }

/* Adds n numbers to sums, four, for each addition waits for the one before it. */
static inline void add_up(const double *a, int n, double sum[4]) {
    int i;
    for (i = 0; i + 3 < n; i += 4) {
        sum[0] = sum[0] + a[i];
        sum[1] = sum[1] + a[i + 1];
        sum[2] = sum[2] + a[i + 2];
        sum[3] = sum[3] + a[i + 3];
    }
    if (i < n) sum[0] = sum[0] + a[i];
    if (i + 1 < n) sum[1] = sum[1] + a[i + 1];
    if (i + 2 < n) sum[2] = sum[2] + a[i + 2];
}

/* 0 when one was not finite, or when large ones add up to more than a double holds: told_finite knows. */
static inline int finite_sum(const double sum[4]) { return ((sum[0] + sum[1]) + (sum[2] + sum[3])) * 0.0 == 0.0; }

static inline int all_finite(const double *a, int n) {
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    add_up(a, n, sum);
    return finite_sum(sum);
}

/* -------------------------------------------------------------------------------------- functions */
static inline double f_fabs(double x) { return x < 0.0 ? -x : x; }
static inline double f_minimum(double a, double b) { return a < b ? a : b; }
static inline double f_maximum(double a, double b) { return a > b ? a : b; }
static inline double f_clip(double x, double lo, double hi) { return x < lo ? lo : (x > hi ? hi : x); }
static inline double f_sign(double x) { return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0); }

#include "elementary.h"

/* A value and its derivative along one direction: see Dual in gyrobench/component/math.py. */
typedef struct { double v, d; } dual;
static inline dual d_con(double x) { dual r = {x, 0.0}; return r; }
static inline dual d_of(double v, double d) { dual r = {v, d}; return r; }
static inline dual d_add(dual a, dual b) { return d_of(a.v + b.v, a.d + b.d); }
static inline dual d_sub(dual a, dual b) { return d_of(a.v - b.v, a.d - b.d); }
static inline dual d_mul(dual a, dual b) { return d_of(a.v * b.v, a.d * b.v + a.v * b.d); }
static inline dual d_div(dual a, dual b) { double q = a.v / b.v; return d_of(q, (a.d - q * b.d) / b.v); }
static inline dual d_neg(dual a) { return d_of(-a.v, -a.d); }
static inline dual d_sin(dual x) { return d_of(f_paired_sin(x.v), f_paired_cos(x.v) * x.d); }
static inline dual d_cos(dual x) { return d_of(f_paired_cos(x.v), -f_paired_sin(x.v) * x.d); }
static inline dual d_tan(dual x) { double y = f_tan(x.v); return d_of(y, (1.0 + y * y) * x.d); }
static inline dual d_asin(dual x) { return d_of(f_asin(x.v), x.d / sqrt(1.0 - x.v * x.v)); }
static inline dual d_atan(dual x) { return d_of(f_atan(x.v), x.d / (1.0 + x.v * x.v)); }
static inline dual d_atan2(dual a, dual b) {
    return d_of(f_atan2(a.v, b.v), (b.v * a.d - a.v * b.d) / (b.v * b.v + a.v * a.v));
}
static inline dual d_sqrt(dual x) { double y = sqrt(x.v); return d_of(y, x.d / (2.0 * y)); }
static inline dual d_exp(dual x) { double y = f_exp(x.v); return d_of(y, y * x.d); }
static inline dual d_log(dual x) { return d_of(f_log(x.v), x.d / x.v); }
static inline dual d_tanh(dual x) { double y = f_tanh(x.v); return d_of(y, (1.0 - y * y) * x.d); }
static inline dual d_floor(dual x) { return d_con(floor(x.v)); }
static inline dual d_fabs(dual x) { return x.v < 0.0 ? d_neg(x) : x; }
static inline dual d_minimum(dual a, dual b) { return a.v < b.v ? a : b; }
static inline dual d_maximum(dual a, dual b) { return a.v > b.v ? a : b; }
static inline dual d_clip(dual x, dual lo, dual hi) { return x.v < lo.v ? lo : (x.v > hi.v ? hi : x); }
static inline dual d_sign(dual x) { return d_con(f_sign(x.v)); }

#include "noise.h"

#endif
