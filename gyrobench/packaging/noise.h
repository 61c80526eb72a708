/* The noise of a native component: counter-based, so that a number depends on seed, port and count alone.
 *
 * Included by functions.h.  The numbers are those of gyrobench/component/numerics.py bit for bit; they are made AHEAD at a time,
 * because the rare branch of the quantile would stop the processor at each one.
 */
static uint64_t mix(uint64_t z) { /* SplitMix64 output function */
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
}

static inline uint64_t key_of(uint64_t seed, int port) {
    return mix(mix((seed + 1) * GAMMA) + (uint64_t)(port + 1) * GAMMA);
}

/* The normal quantile of p, Wichura, AS 241 (PPND16), for |q| <= 0.425 and beyond; q = p - 0.5. */
#ifdef __GNUC__
typedef double lanes __attribute__((vector_size(32))); /* four numbers at a time: the same operations on each */
#else
typedef double lanes;
#endif
/* Two forms in one library, the wider for the processors that have it; no operation is contracted in either. */
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__)
#define BY_PROCESSOR __attribute__((target_clones("avx2", "default")))
#else
#define BY_PROCESSOR
#endif
enum { LANES = sizeof(lanes) / sizeof(double) };

static inline void quantile_middle(lanes *at) { /* by address: a vector that is passed depends on the processor */
    const lanes q = *at, r = 0.180625 - q * q;
    *at = (((((((2.5090809287301226727e+3 * r + 3.3430575583588128105e+4) * r + 6.7265770927008700853e+4) * r
                + 4.5921953931549871457e+4) * r + 1.3731693765509461125e+4) * r + 1.9715909503065514427e+3) * r
             + 1.3314166789178437745e+2) * r + 3.3871328727963666080e+0) * q
         / (((((((5.2264952788528545610e+3 * r + 2.8729085735721942674e+4) * r + 3.9307895800092710610e+4) * r
                + 2.1213794301586595867e+4) * r + 5.3941960214247511077e+3) * r + 6.8718700749205790830e+2) * r
             + 4.2313330701600911252e+1) * r + 1.0);
}

static inline void quantile_tail(lanes *at) { /* of r = sqrt(-log(min(p, 1 - p))) <= 5: its absolute value */
    const lanes r = *at - 1.6;
    *at = (((((((7.74545014278341407640e-4 * r + 2.27238449892691845833e-2) * r + 2.41780725177450611770e-1) * r
                + 1.27045825245236838258e+0) * r + 3.64784832476320460504e+0) * r + 5.76949722146069140550e+0) * r
             + 4.63033784615654529590e+0) * r + 1.42343711074968357734e+0)
         / (((((((1.05075007164441684324e-9 * r + 5.47593808499534494600e-4) * r + 1.51986665636164571966e-2) * r
                + 1.48103976427480074590e-1) * r + 6.89767334985100004550e-1) * r + 1.67638483018380384940e+0) * r
             + 2.05319162663775882187e+0) * r + 1.0);
}

static double quantile_end(double r) { /* the same beyond 5: once in 4e10 numbers */
    r = r - 5.0;
    return (((((((2.01033439929228813265e-7 * r + 2.71155556874348757815e-5) * r + 1.24266094738807843860e-3) * r
                + 2.65321895265761230930e-2) * r + 2.96560571828504891230e-1) * r + 1.78482653991729133580e+0) * r
             + 5.46378491116411436990e+0) * r + 6.65790464350110377720e+0)
         / (((((((2.04426310338993978564e-15 * r + 1.42151175831644588870e-7) * r + 1.84631831751005468180e-5) * r
                + 7.86869131145613259100e-4) * r + 1.48753612908506148525e-2) * r + 1.36929880922735805310e-1) * r
             + 5.99832206555887937690e-1) * r + 1.0);
}

/* The normal quantiles of p[i]: those of the middle all at once, then the others again, none by a branch that half take. */
static inline void quantiles(const double p[AHEAD], double out[AHEAD]) {
    double root[AHEAD], tail[AHEAD];
    int rare[AHEAD], n = 0, i;
    for (i = 0; i < AHEAD; i += LANES) {
        lanes q;
        memcpy(&q, p + i, sizeof q);
        q -= 0.5;
        quantile_middle(&q);
        memcpy(out + i, &q, sizeof q);
    }
    for (i = 0; i < AHEAD; i++) {
        rare[n] = i;
        n += !(fabs(p[i] - 0.5) <= 0.425);
    }
    for (i = 0; i < n; i++) {
        const double below = p[rare[i]], above = 1.0 - below;
        /* logarithm, not f_log: a call from code for newer processors into other code stops some of them, 50 ns */
        root[i] = sqrt(-logarithm(below < above ? below : above));
    }
    for (; i % LANES != 0; i++) root[i] = 2.0; /* no one reads these */
    for (i = 0; i < n; i += LANES) {
        lanes x;
        memcpy(&x, root + i, sizeof x);
        quantile_tail(&x);
        memcpy(tail + i, &x, sizeof x);
    }
    for (i = 0; i < n; i++)
        out[rare[i]] = copysign(root[i] <= 5.0 ? tail[i] : quantile_end(root[i]), p[rare[i]] - 0.5);
}

static inline double uniform(uint64_t key, uint64_t count) {
    return ((double)(int64_t)(mix(key + count * GAMMA) >> 11) + 0.5) * 0x1p-53;
}

/* The normal numbers of count, count + 1, ... */
BY_PROCESSOR static void normals(uint64_t key, uint64_t count, double out[AHEAD]) {
    double p[AHEAD];
    int i;
    for (i = 0; i < AHEAD; i++) p[i] = uniform(key, count + (uint64_t)i);
    quantiles(p, out);
}

/* Of one count the numbers p of neighbouring streams, and their normal quantiles where those are of the middle. */
BY_PROCESSOR static void side_by_side(uint64_t seed, int stream, uint64_t count, double p[LANES], double out[LANES]) {
    lanes q;
    int i;
    for (i = 0; i < LANES; i++) p[i] = uniform(key_of(seed, stream + i), count);
    memcpy(&q, p, sizeof q);
    q -= 0.5;
    quantile_middle(&q);
    memcpy(out, &q, sizeof q);
}

static NEVER_INLINE double quantile_rare(double p) {
    const double above = 1.0 - p, root = sqrt(-logarithm(p < above ? p : above));
    lanes x = {0.0};
    double tail[LANES];
    x += root;
    quantile_tail(&x);
    memcpy(tail, &x, sizeof x);
    return copysign(root <= 5.0 ? tail[0] : quantile_end(root), p - 0.5);
}
