/* y' = (u - y) / T, exact for u held over the step; for the engine tests and benchmarks.  count (Integer) and odd
   (Boolean) count the steps; hold (Boolean input) freezes y, add (Integer input) is added to u. */

enum { IN, OUT, T, Y0, COUNT, ODD, HOLD, ADD, NV };
#include "fmu.h"

static const double start[NV] = {[T] = 0.1};

static fmi2Status initialize(instance *m) {
    m->state[0] = m->v[Y0];
    return fmi2OK;
}

static fmi2Status step(instance *m, double h) {
    if (h != m->state[2]) {
        m->state[2] = h;
        m->state[1] = -expm1(-h / m->v[T]);
    }
    if (m->v[HOLD] == 0.0) m->state[0] += (m->v[IN] + m->v[ADD] - m->state[0]) * m->state[1];
    return fmi2OK;
}

static void outputs(instance *m) {
    m->v[OUT] = m->state[0];
    m->v[COUNT] = (double)m->steps;
    m->v[ODD] = (double)(m->steps % 2);
}
