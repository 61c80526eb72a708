/* Four numbers where a part has one: `double` of the generated C becomes `lane`, each operation that of all four.
 *
 * A condition that is not the same in all lanes is counted in `diverged`, where a real form would mask or go on lane by
 * lane.  Random numbers are drawn lane by lane, by the scalar code, which makes four of a stream at a time already.
 */
typedef double v4 __attribute__((vector_size(32)));
typedef long long m4 __attribute__((vector_size(32)));
static long diverged;

struct mask {
    m4 m;
    operator bool() const {
        const int k = __builtin_ia32_movmskpd256((v4)m);
        if (__builtin_expect(k != 0 && k != 15, 0)) diverged++;
        return k == 15;
    }
};

struct lane {
    v4 x;
    lane() = default;
    lane(v4 a) : x(a) {}
    lane(double a) { x = v4{a, a, a, a}; }
    lane(int a) : lane((double)a) {}
    lane(unsigned a) : lane((double)a) {}
    lane(long a) : lane((double)a) {}
    lane(bool a) : lane((double)a) {}
    lane(mask a) { x = (v4)(a.m & (m4)v4{1, 1, 1, 1}); }
    explicit operator int() const { return (int)x[0]; }
    explicit operator long() const { return (long)x[0]; }
    explicit operator unsigned long() const { return (unsigned long)x[0]; }
    explicit operator bool() const { return x[0] != 0; }
};

#define OPERATOR(o) static inline lane operator o(lane a, lane b) { return a.x o b.x; }
#define COMPARISON(o) static inline mask operator o(lane a, lane b) { return {(m4)(a.x o b.x)}; }
OPERATOR(+) OPERATOR(-) OPERATOR(*) OPERATOR(/)
COMPARISON(<) COMPARISON(>) COMPARISON(<=) COMPARISON(>=) COMPARISON(==) COMPARISON(!=)
static inline lane operator-(lane a) { return -a.x; }
static inline lane &operator+=(lane &a, lane b) { a.x += b.x; return a; }

static inline lane pick(m4 m, v4 a, v4 b) { return (v4)((m & (m4)a) | (~m & (m4)b)); }
static inline lane f_fabs(lane a) { return pick((m4)(a.x < v4{0, 0, 0, 0}), -a.x, a.x); }
static inline lane f_minimum(lane a, lane b) { return pick((m4)(a.x < b.x), a.x, b.x); }
static inline lane f_maximum(lane a, lane b) { return pick((m4)(a.x > b.x), a.x, b.x); }
static inline lane f_clip(lane a, lane low, lane high) {
    return pick((m4)(a.x < low.x), low.x, pick((m4)(a.x > high.x), high.x, a.x).x);
}
static inline lane f_sign(lane a) {
    const v4 zero = {0, 0, 0, 0};
    return pick((m4)(a.x > zero), zero + 1, pick((m4)(a.x < zero), zero - 1, zero).x);
}
static inline lane fabs(lane a) { return (v4)((m4)a.x & 0x7FFFFFFFFFFFFFFFLL); }

#define EACH(name, scalar) \
    static inline lane name(lane a) { return v4{scalar(a.x[0]), scalar(a.x[1]), scalar(a.x[2]), scalar(a.x[3])}; }
EACH(f_tan, ::f_tan) EACH(f_asin, ::f_asin) EACH(f_atan, ::f_atan) EACH(f_exp, ::f_exp) EACH(f_log, ::f_log)
EACH(f_tanh, ::f_tanh) EACH(floor, __builtin_floor) EACH(ceil, __builtin_ceil) EACH(sqrt, __builtin_sqrt)
static inline lane f_atan2(lane a, lane b) {
    return v4{::f_atan2(a.x[0], b.x[0]), ::f_atan2(a.x[1], b.x[1]), ::f_atan2(a.x[2], b.x[2]), ::f_atan2(a.x[3], b.x[3])};
}

/* Sine and cosine: elementary.h with four numbers, or lane by lane where one of them is far or tiny. */
struct turned4 { v4 k, r, error; int hard; };
static inline turned4 turn4(v4 x) {
    const v4 k = (x * EF_STEPS + EF_TO_WHOLE) - EF_TO_WHOLE, first = x - k * EF_STEP_1, second = k * EF_STEP_2;
    const v4 r = first - second, b = r - first, error = (first - (r - b)) - (second + b);
    const v4 third = k * EF_STEP_3, rest = r - third, ax = fabs(lane(x)).x;
    const m4 easy = (m4)(ax < v4{} + 12800.0) & (m4)(fabs(lane(rest)).x >= fabs(lane(k)).x * 0x1p-67)
                  & (m4)(ax >= v4{} + 0x1p-27);
    return {k, rest, ((r - rest) - third) + error, __builtin_ia32_movmskpd256((v4)easy) != 15};
}
static inline v4 sine4(turned4 t, int quarter) {
    v4 high, low, near, more;
    m4 sign;
    for (int i = 0; i < 4; i++) {
        const int n = (int)t.k[i] + quarter;
        const double *row = turn_table[n & 127];
        high[i] = row[0], low[i] = row[1], near[i] = row[2], more[i] = row[3];
        sign[i] = n & 128 ? (long long)(1ULL << 63) : 0;
    }
    const v4 r = t.r, z = r * r, cosine = near + more, straight = near * r, s = high + straight;
    const v4 odd = (cosine * (r * z)) * (-1.0 / 6.0 + z * (1.0 / 120.0 - z * (1.0 / 5040.0)));
    const v4 even = (high * z) * (-0.5 + z * (1.0 / 24.0 - z * (1.0 / 720.0)));
    const v4 rest = ((straight - (s - high)) + (low + (more * r + cosine * t.error))) + (odd + even);
    return (v4)((m4)s ^ sign) + (v4)((m4)rest ^ sign);
}
#define OF_ANGLE(name, quarter) \
    __attribute__((const, noinline)) static v4 name##4(v4 a) { \
        const turned4 t = turn4(a); \
        if (__builtin_expect(t.hard, 0)) return v4{::name(a[0]), ::name(a[1]), ::name(a[2]), ::name(a[3])}; \
        return sine4(t, quarter); \
    } \
    static inline lane name(lane a) { return name##4(a.x); }
OF_ANGLE(f_sin, 0)
OF_ANGLE(f_cos, 64)
static inline lane f_paired_sin(lane a) { return f_sin(a); }
static inline lane f_paired_cos(lane a) { return f_cos(a); }

static inline int all_are_finite(lane a) {
    return __builtin_isfinite(a.x[0]) && __builtin_isfinite(a.x[1]) && __builtin_isfinite(a.x[2]) && __builtin_isfinite(a.x[3]);
}
#undef isfinite
#define isfinite all_are_finite
static inline double plain(lane a) { return a.x[0]; }

struct keys { uint64_t k[4]; };
static inline keys key_of(lane seed, int port) {
    keys of;
    for (int i = 0; i < 4; i++) of.k[i] = ::key_of((uint64_t)seed.x[i], port);
    return of;
}
static inline void normals(keys key, uint64_t count, lane out[AHEAD]) {
    double drawn[4][AHEAD];
    for (int i = 0; i < 4; i++) ::normals(key.k[i], count, drawn[i]);
    for (int k = 0; k < AHEAD; k++) out[k].x = v4{drawn[0][k], drawn[1][k], drawn[2][k], drawn[3][k]};
}
