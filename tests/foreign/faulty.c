/* A gyro with a fault: at step AT it crashes (1), hangs (2), returns fmi2Error with a message (3), or gives NaN (4);
   fault 5 crashes in initialization.  Otherwise the pickoff is u = 2 i + f_I, with direct feedthrough of f. */

enum { W1, W2, W3, F1, F2, F3, CURRENT, U, FAULT, AT, NV };
#include <threads.h>

#include "fmu.h"

static const double start[NV] = {[AT] = 100};

static void crash(void) {
    volatile int *nowhere = NULL;
    *nowhere = 1;
}

static fmi2Status initialize(instance *m) {
    if (m->v[FAULT] == 5) crash();
    return fmi2OK;
}

static fmi2Status step(instance *m, double h) {
    volatile int waiting = 1;
    (void)h;
    if (m->steps == (long)m->v[AT]) {
        if (m->v[FAULT] == 1) crash();
        while (m->v[FAULT] == 2 && waiting) thrd_sleep(&(struct timespec){.tv_sec = 1}, NULL); /* leaves the core to others */
        if (m->v[FAULT] == 3) return say(m, fmi2Error, "the wheel has stopped after %g steps", m->v[AT]);
    }
    m->state[0] = 2.0 * m->v[CURRENT];
    return fmi2OK;
}

static void outputs(instance *m) {
    m->v[U] = m->state[0] + m->v[F1];
    if (m->v[FAULT] == 4 && m->steps > (long)m->v[AT]) m->v[U] = NAN;
}
