/* The fixed part of every native component: numbers, noise, integration, stepping.
 *
 * model.c defines `Vars` (every variable of the part, all double, in the order of the value references),
 * the counts and the tables used here, includes this file, and goes on with the equations.  Each operation below
 * stands in the same order in gyrobench/component.py and numerics.py: the two targets agree bit for bit.
 */
#include <math.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

typedef struct {
    Vars v;
#if N_X > 0
    double phi[N_X][N_X]; /* phi1(h A) */
#endif
    double phi_h; /* the h it was made for */
    double running, dirty;
} Numbers; /* all that decides the future */

typedef struct { /* what follows from the numbers, kept because it seldom changes */
    double step, largest, h, root; /* a communication step, cut in n internal steps h; sqrt(h) */
    int n, keyed;
    double seed; /* the seed that the keys of the noise ports were made for */
    uint64_t key[N_PORTS + 1];
} Kept;

typedef struct {
    Numbers n;
    Kept kept;
    int failed;
    char name[128];
    char message[768];
} Part;

static inline void start(Part *part); /* inline: a part without states does not use all of them */
static inline void flow(Part *part);
static inline void outputs(Part *part);
static inline void ticks(Part *part);
static inline void flow_d(Part *part, Vars *seed);
static inline void outputs_d(Part *part, Vars *seed);

static double *value(Part *p) { return (double *)&p->n.v; }

/* ------------------------------------------------------------------------------------- refusals */
static double plain(double x) { return x != x ? (double)NAN : x; } /* prints "nan", never "-nan" */

static void vfail(Part *p, const char *format, va_list a) {
    char text[512];
    if (p->failed) return; /* the first reason is the reason */
    vsnprintf(text, sizeof text, format, a);
    snprintf(p->message, sizeof p->message, "%s: %s", p->name, text);
    p->failed = 1;
}

static void fail(Part *p, const char *format, ...) {
    va_list a;
    va_start(a, format);
    vfail(p, format, a);
    va_end(a);
}

/* An index that is known only when it runs. */
static inline int whole(double x) { return x > -1e9 && x < 1e9 ? (int)x : -1; }
static inline int at(Part *p, int i, int n) {
    if (i >= 0 && i < n) return i;
    fail(p, "an index is %d, not in 0 to %d (t = %.9g s)", i, n - 1, p->n.v.t);
    return 0;
}

/* -------------------------------------------------------------------------------------- functions */
static inline double f_fabs(double x) { return x < 0.0 ? -x : x; }
static inline double f_minimum(double a, double b) { return a < b ? a : b; }
static inline double f_maximum(double a, double b) { return a > b ? a : b; }
static inline double f_clip(double x, double lo, double hi) { return x < lo ? lo : (x > hi ? hi : x); }
static inline double f_sign(double x) { return x > 0.0 ? 1.0 : (x < 0.0 ? -1.0 : 0.0); }

/* A value and its derivative along one direction: see Dual in gyrobench/math.py. */
typedef struct { double v, d; } dual;
static inline dual d_con(double x) { dual r = {x, 0.0}; return r; }
static inline dual d_of(double v, double d) { dual r = {v, d}; return r; }
static inline dual d_add(dual a, dual b) { return d_of(a.v + b.v, a.d + b.d); }
static inline dual d_sub(dual a, dual b) { return d_of(a.v - b.v, a.d - b.d); }
static inline dual d_mul(dual a, dual b) { return d_of(a.v * b.v, a.d * b.v + a.v * b.d); }
static inline dual d_div(dual a, dual b) { double q = a.v / b.v; return d_of(q, (a.d - q * b.d) / b.v); }
static inline dual d_neg(dual a) { return d_of(-a.v, -a.d); }
static inline dual d_sin(dual x) { return d_of(sin(x.v), cos(x.v) * x.d); }
static inline dual d_cos(dual x) { return d_of(cos(x.v), -sin(x.v) * x.d); }
static inline dual d_tan(dual x) { double y = tan(x.v); return d_of(y, (1.0 + y * y) * x.d); }
static inline dual d_asin(dual x) { return d_of(asin(x.v), x.d / sqrt(1.0 - x.v * x.v)); }
static inline dual d_atan(dual x) { return d_of(atan(x.v), x.d / (1.0 + x.v * x.v)); }
static inline dual d_atan2(dual a, dual b) {
    return d_of(atan2(a.v, b.v), (b.v * a.d - a.v * b.d) / (b.v * b.v + a.v * a.v));
}
static inline dual d_sqrt(dual x) { double y = sqrt(x.v); return d_of(y, x.d / (2.0 * y)); }
static inline dual d_exp(dual x) { double y = exp(x.v); return d_of(y, y * x.d); }
static inline dual d_log(dual x) { return d_of(log(x.v), x.d / x.v); }
static inline dual d_tanh(dual x) { double y = tanh(x.v); return d_of(y, (1.0 - y * y) * x.d); }
static inline dual d_floor(dual x) { return d_con(floor(x.v)); }
static inline dual d_fabs(dual x) { return x.v < 0.0 ? d_neg(x) : x; }
static inline dual d_minimum(dual a, dual b) { return a.v < b.v ? a : b; }
static inline dual d_maximum(dual a, dual b) { return a.v > b.v ? a : b; }
static inline dual d_clip(dual x, dual lo, dual hi) { return x.v < lo.v ? lo : (x.v > hi.v ? hi : x); }
static inline dual d_sign(dual x) { return d_con(f_sign(x.v)); }

/* ------------------------------------------------------------------------------------------ noise */
#define GAMMA 0x9E3779B97F4A7C15u

static uint64_t mix(uint64_t z) { /* SplitMix64 output function */
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static double normal_quantile(double p) { /* Wichura, AS 241 (PPND16) */
    double q = p - 0.5, r, x;
    if (fabs(q) <= 0.425) {
        r = 0.180625 - q * q;
        return (((((((2.5090809287301226727e+3 * r + 3.3430575583588128105e+4) * r + 6.7265770927008700853e+4) * r
                    + 4.5921953931549871457e+4) * r + 1.3731693765509461125e+4) * r + 1.9715909503065514427e+3) * r
                 + 1.3314166789178437745e+2) * r + 3.3871328727963666080e+0) * q
             / (((((((5.2264952788528545610e+3 * r + 2.8729085735721942674e+4) * r + 3.9307895800092710610e+4) * r
                    + 2.1213794301586595867e+4) * r + 5.3941960214247511077e+3) * r + 6.8718700749205790830e+2) * r
                 + 4.2313330701600911252e+1) * r + 1.0);
    }
    r = q <= 0.0 ? p : 1.0 - p;
    r = sqrt(-log(r));
    if (r <= 5.0) {
        r = r - 1.6;
        x = (((((((7.74545014278341407640e-4 * r + 2.27238449892691845833e-2) * r + 2.41780725177450611770e-1) * r
                + 1.27045825245236838258e+0) * r + 3.64784832476320460504e+0) * r + 5.76949722146069140550e+0) * r
             + 4.63033784615654529590e+0) * r + 1.42343711074968357734e+0)
          / (((((((1.05075007164441684324e-9 * r + 5.47593808499534494600e-4) * r + 1.51986665636164571966e-2) * r
                + 1.48103976427480074590e-1) * r + 6.89767334985100004550e-1) * r + 1.67638483018380384940e+0) * r
             + 2.05319162663775882187e+0) * r + 1.0);
    } else {
        r = r - 5.0;
        x = (((((((2.01033439929228813265e-7 * r + 2.71155556874348757815e-5) * r + 1.24266094738807843860e-3) * r
                + 2.65321895265761230930e-2) * r + 2.96560571828504891230e-1) * r + 1.78482653991729133580e+0) * r
             + 5.46378491116411436990e+0) * r + 6.65790464350110377720e+0)
          / (((((((2.04426310338993978564e-15 * r + 1.42151175831644588870e-7) * r + 1.84631831751005468180e-5) * r
                + 7.86869131145613259100e-4) * r + 1.48753612908506148525e-2) * r + 1.36929880922735805310e-1) * r
             + 5.99832206555887937690e-1) * r + 1.0);
    }
    return q < 0.0 ? -x : x;
}

static uint64_t key_of(uint64_t seed, int port) {
    return mix(mix((seed + 1) * GAMMA) + (uint64_t)(port + 1) * GAMMA);
}

static double normal(uint64_t key, uint64_t count) {
    uint64_t z = mix(key + count * GAMMA);
    return normal_quantile(((double)(z >> 11) + 0.5) * 0x1p-53);
}

static void draw(Part *p, int per) {
#if N_PORTS > 0
    double *a = value(p);
    const uint64_t count = (uint64_t)p->n.v.tick;
    int i;
    if (!p->kept.keyed || p->kept.seed != p->n.v.seed) {
        for (i = 0; i < N_PORTS; i++) p->kept.key[i] = key_of((uint64_t)p->n.v.seed, i);
        p->kept.seed = p->n.v.seed;
        p->kept.keyed = 1;
    }
    for (i = 0; i < N_PORTS; i++) {
        double x = 0.0, size;
        if (ports[i].per != per) continue;
        size = a[ports[i].parameter];
        if (size != 0.0) {
            x = size * normal(p->kept.key[i], count);
            if (per == 2) x = x / p->kept.root;
        }
        a[ports[i].sample] = x;
    }
#else
    (void)p;
    (void)per;
    (void)normal;
    (void)key_of;
#endif
}

/* ------------------------------------------------------------------------------------ integration */
#if N_X > 0
typedef double Square[N_X][N_X];

static void product(Square a, Square b, Square out) {
    int i, j, k;
    for (i = 0; i < N_X; i++)
        for (j = 0; j < N_X; j++) {
            double total = 0.0;
            for (k = 0; k < N_X; k++) total = total + a[i][k] * b[k][j];
            out[i][j] = total;
        }
}

static void phi1(Square z, Square out) {
    Square g;
    double norm = 0.0, scale = 1.0;
    int i, j, k, s = 0;
    for (i = 0; i < N_X; i++) {
        double row = 0.0;
        for (j = 0; j < N_X; j++) row = row + fabs(z[i][j]);
        if (row > norm) norm = row;
    }
    if (!(norm < 1e300)) norm = 0.0; /* not finite: found by the check of the states */
    while (norm > 0.5) { norm = norm * 0.5; scale = scale * 0.5; s++; }
    for (i = 0; i < N_X; i++)
        for (j = 0; j < N_X; j++) { z[i][j] = z[i][j] * scale; out[i][j] = i == j ? 1.0 : 0.0; }
    for (k = 18; k > 1; k--) {
        product(z, out, g);
        for (i = 0; i < N_X; i++)
            for (j = 0; j < N_X; j++) out[i][j] = g[i][j] / k + (i == j ? 1.0 : 0.0);
    }
    for (k = 0; k < s; k++) {
        Square q;
        product(z, out, g);
        for (i = 0; i < N_X; i++)
            for (j = 0; j < N_X; j++) g[i][j] = 0.5 * g[i][j] + (i == j ? 1.0 : 0.0);
        product(out, g, q);
        memcpy(out, q, sizeof q);
        for (i = 0; i < N_X; i++)
            for (j = 0; j < N_X; j++) z[i][j] = 2.0 * z[i][j];
    }
}

static void jacobian(Part *p, Square a) {
    int i, j;
    for (j = 0; j < N_X; j++) {
        Vars seed;
        memset(&seed, 0, sizeof seed);
        ((double *)&seed)[X0 + j] = 1.0;
        flow_d(p, &seed);
        for (i = 0; i < N_X; i++) a[i][j] = ((double *)&seed)[DX0 + i];
    }
}

static void advance(Part *p, double h) {
    double *x = value(p) + X0, *f = value(p) + DX0;
    int i, j;
#if RK4_SUBSTEPS > 0
    double t = p->n.v.t, dt = h / RK4_SUBSTEPS, x0[N_X], k1[N_X], k2[N_X], k3[N_X];
    for (j = 0; j < RK4_SUBSTEPS; j++) {
        memcpy(x0, x, sizeof x0);
        p->n.v.t = t + j * dt;
        flow(p);
        memcpy(k1, f, sizeof k1);
        p->n.v.t = t + (j + 0.5) * dt;
        for (i = 0; i < N_X; i++) x[i] = x0[i] + 0.5 * dt * k1[i];
        flow(p);
        memcpy(k2, f, sizeof k2);
        for (i = 0; i < N_X; i++) x[i] = x0[i] + 0.5 * dt * k2[i];
        flow(p);
        memcpy(k3, f, sizeof k3);
        p->n.v.t = t + (j + 1) * dt;
        for (i = 0; i < N_X; i++) x[i] = x0[i] + dt * k3[i];
        flow(p);
        for (i = 0; i < N_X; i++) x[i] = x0[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + f[i]);
    }
    (void)jacobian;
    (void)phi1;
#else
    if (NONLINEAR || h != p->n.phi_h) {
        Square z;
        jacobian(p, z);
        for (i = 0; i < N_X; i++)
            for (j = 0; j < N_X; j++) z[i][j] = z[i][j] * h;
        phi1(z, p->n.phi);
        p->n.phi_h = h;
    }
    flow(p);
    for (i = 0; i < N_X; i++) {
        double dx = 0.0;
        for (j = 0; j < N_X; j++) dx = dx + p->n.phi[i][j] * f[j];
        x[i] = x[i] + h * dx;
    }
#endif
}
#endif

/* --------------------------------------------------------------------------------------- stepping */
static inline int all_finite(const double *a, int n) {
    double even = 0.0, odd = 0.0; /* NaN as soon as one is not finite; two sums, for they take turns */
    int i;
    for (i = 0; i + 1 < n; i += 2) {
        even = even + a[i] * 0.0;
        odd = odd + a[i + 1] * 0.0;
    }
    if (i < n) even = even + a[i] * 0.0;
    return even + odd == 0.0;
}

static int told_finite(Part *p, int from, int n, const char *what) {
    const double *a = value(p);
    int i;
    for (i = from; i < from + n; i++)
        if (!isfinite(a[i])) {
            fail(p, "%s %s is %g at t = %.9g s", what, names[i], plain(a[i]), p->n.v.t);
            return 0;
        }
    return 1;
}

static inline int finite(Part *p) { /* outputs, states, derivatives, discretes follow one another */
    if (all_finite(value(p) + Y0, N_REFERENCES - Y0)) return 1;
    return told_finite(p, Y0, N_Y, "output") && told_finite(p, X0, N_X, "state") && told_finite(p, Q0, N_Q, "discrete");
}

static void evaluate_start(Part *p) {
    p->n.v.tick = 0.0;
    draw(p, 0);
    draw(p, 1);
    start(p);
    if (!p->failed) outputs(p);
    p->n.dirty = 0.0;
}

static void refresh(Part *p) {
    if (p->n.dirty == 0.0) return;
    if (p->n.running != 0.0) {
        outputs(p);
        p->n.dirty = 0.0;
    } else {
        evaluate_start(p);
    }
}

static void initialize(Part *p, double t0) {
    static const char *const words[] = {">=", "<=", ">", "<"};
    const double *a = value(p);
    int i, k = 0;
    p->n.v.t = t0;
    for (i = 0; i < DX0; i++) { /* parameters, inputs, (outputs), states */
        const char *what = i < U0 ? "parameter" : i < Y0 ? "input" : "state";
        if (i < Y0 || i >= X0) {
            if (!isfinite(a[i])) {
                fail(p, "%s %s = %g %s must be finite", what, names[i], plain(a[i]), unit_names[i]);
                return;
            }
            for (; k < N_BOUNDS && bounds[k].reference < i; k++) {}
            for (; k < N_BOUNDS && bounds[k].reference == i; k++) {
                const double b = bounds[k].limit;
                const int kind = bounds[k].kind;
                const int ok = kind == 0 ? a[i] >= b : kind == 1 ? a[i] <= b : kind == 2 ? a[i] > b : a[i] < b;
                if (!ok) {
                    fail(p, "%s %s = %g %s must be %s %g", what, names[i], a[i], unit_names[i], words[kind], b);
                    return;
                }
            }
        }
    }
    evaluate_start(p);
    if (!p->failed && finite(p)) p->n.running = 1.0;
}

static void do_step(Part *p, double t, double step) {
    double largest, h;
    int k, n;
    if (!(isfinite(t) && isfinite(step) && step > 0.0)) {
        fail(p, "a step must be positive and finite, not %g s", plain(step));
        return;
    }
    p->n.v.t = t;
    if (!all_finite(value(p) + U0, N_U) && !told_finite(p, U0, N_U, "input")) return;
    largest = LARGEST_STEP(p, step);
    if (step != p->kept.step || largest != p->kept.largest) {
        n = (int)ceil(step / largest - 1e-9);
        p->kept.n = n < 1 ? 1 : n;
        p->kept.h = step / p->kept.n;
        p->kept.root = sqrt(p->kept.h);
        p->kept.step = step;
        p->kept.largest = largest;
    }
    n = p->kept.n;
    h = p->kept.h;
    p->n.v.h = h;
    for (k = 0; k < n; k++) {
        p->n.v.t = t + k * h;
        p->n.v.tick = p->n.v.tick + 1.0;
        draw(p, 1);
        draw(p, 2);
#if N_X > 0
        advance(p, h);
#endif
        p->n.v.t = t + (k + 1) * h;
        ticks(p);
        if (p->failed) return;
    }
    outputs(p);
    p->n.dirty = 0.0;
    if (!p->failed) finite(p);
}
