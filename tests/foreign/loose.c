/* A gyro that declares no dependencies: u = 2 i + f_I at once, so that a rebalance makes an algebraic loop of it. */

enum { W1, W2, W3, F1, F2, F3, CURRENT, U, NV };
#include "fmu.h"

static const double start[NV] = {0};
static fmi2Status initialize(instance *m) { (void)m; return fmi2OK; }
static fmi2Status step(instance *m, double h) { (void)m; (void)h; return fmi2OK; }
static void outputs(instance *m) { m->v[U] = 2.0 * m->v[CURRENT] + m->v[F1]; }
