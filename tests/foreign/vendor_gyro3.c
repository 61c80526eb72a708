/* The gyro of vendor_gyro.c as FMI 3.0: rates as one array of doubles, load as one of floats, current a float,
   coefficients of the load as an array parameter.  With T_EVENT > 0 (ms) it returns early where a multiple of it falls
   into a step. */

enum { W = 0, ACC = 3, CURRENT = 6, PICKOFF, T_FLOAT, GAIN, SCALE, SENS, BIAS, MU, T_EVENT = MU + 3, NV };
enum { NR = 12 };
#include "fmu3.h"

#define DEG_H 4.84813681109535993590e-6 /* rad/s */

/* 0 is the time, which is not kept here */
static const int first[NR + 1] = {0, W, ACC, CURRENT, PICKOFF, T_FLOAT, GAIN, SCALE, SENS, BIAS, MU, T_EVENT, NV};
static const double start[NV] = {[T_FLOAT] = 0.8, [GAIN] = 1.0, [SCALE] = 20.0, [SENS] = 10000.0};

static fmi3Status initialize(instance *m) {
    return m->v[T_FLOAT] > 0.0 ? fmi3OK : say(m, "T_FLOAT must be positive");
}

static double step(instance *m, double t, double h) {
    const double *v = m->v;
    double end = t + h;
    const double period = 1e-3 * v[T_EVENT];
    if (period > 0.0) {
        const double event = (floor(t / period + 1e-9) + 1.0) * period;
        if (event < end - 1e-12) {
            end = event;
            h = end - t;
            m->early = true;
        }
    }
    const double drift = v[BIAS] + v[MU] * v[ACC] + v[MU + 1] * v[ACC + 1] + v[MU + 2] * v[ACC + 2];
    const double angle = m->state[0], rate = m->state[1], tau = 1e-3 * v[T_FLOAT];
    const double target = v[GAIN] * DEG_H * (v[W] - v[W + 2] * angle - drift - v[SCALE] * v[CURRENT]);
    const double decay = exp(-h / tau);
    m->state[0] = angle + target * h + (rate - target) * tau * (1.0 - decay);
    m->state[1] = target + (rate - target) * decay;
    return end;
}

static void outputs(instance *m) {
    m->v[PICKOFF] = m->v[SENS] * m->state[0];
}
