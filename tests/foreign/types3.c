/* Inputs and outputs of every type of FMI 3.0 that holds a number; `copy` repeats the inputs as an array of doubles.

   After k steps the outputs are k/10 (Float64 and Float32), -k, 200 + k, -30000 - k, 60000 + k, -2^31 + k, 2^32 - 1 - k,
   k - 2^53, 2^53 - 1 - k (plus the parameter `more` for the last two), and k odd.  `vector` is an input array, `sum` its
   elements weighted 1, 10, 100.  With `pieces` = n each step takes n calls, with `end_at` the FMU ends there. */

enum { N = 11, IN = 0, OUT = N, COPY = 2 * N, VECTOR = 3 * N, SUM = VECTOR + 3, CALLS, MORE, PIECES, END_AT, STUCK, NV };
enum { NR = 2 * N + 9 };
#include "fmu3.h"

static const double start[NV] = {[VECTOR] = 1.0, [VECTOR + 1] = 2.0, [VECTOR + 2] = 3.0, [PIECES] = 1.0, [END_AT] = 1e9};
static const int first[NR + 1] = {0,  0,  1,  2,  3,  4,  5,  6,    7,      8,   9,     10,   11,     12,     13,   14,
                                  15, 16, 17, 18, 19, 20, 21, COPY, VECTOR, SUM, CALLS, MORE, PIECES, END_AT, STUCK, NV};

static fmi3Status initialize(instance *m) { (void)m; return fmi3OK; }

static double step(instance *m, double t, double h) {
    if (t >= m->v[END_AT]) m->ended = true;
    if (m->v[STUCK] != 0.0 && m->steps >= 5) {
        m->early = true;
        return t;
    }
    if (m->v[PIECES] == 1.0) return t + h;
    if (m->state[0] == 0.0) m->state[1] = t, m->state[2] = h;
    m->state[0] += 1.0;
    m->early = m->state[0] < m->v[PIECES];
    if (m->early) return m->state[1] + m->state[2] * m->state[0] / m->v[PIECES];
    m->state[0] = 0.0;
    return t + h;
}

static void outputs(instance *m) {
    double *v = m->v, k = (double)m->steps;
    const double out[N] = {0.1 * k, 0.1 * k, -k, 200 + k, -30000 - k, 60000 + k, k - 2147483648.0, 4294967295.0 - k,
                           k - 9007199254740992.0 - v[MORE], 9007199254740991.0 - k + v[MORE], (double)(m->steps % 2)};
    memcpy(v + OUT, out, sizeof out);
    memcpy(v + COPY, v + IN, N * sizeof *v);
    v[SUM] = v[VECTOR] + 10.0 * v[VECTOR + 1] + 100.0 * v[VECTOR + 2];
    v[CALLS] = (double)m->calls;
}
