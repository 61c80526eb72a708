/* A gyro as a vendor would deliver it: other names, other units, signs of its own.

   Rates in deg/h along IA, OA, SRA; ACC is the load in g along the same axes, that is minus the specific force;
   current in mA; pickoff in mV.  Float with time constant T: with target = G (w_I - w_S b - w_d - k i) held over the
   step, rate and angle follow exactly  r' = (target - r) / T,  b' = r.  Drift w_d in deg/h with ten static terms of the
   load.  Not modelled: output axis acceleration (no input for it), noise, saturation. */

enum { W_I, W_O, W_S, ACC_I, ACC_O, ACC_S, CURRENT, PICKOFF, T_FLOAT, GAIN, SCALE, SENS, BIAS, MU_I, MU_O, MU_S,
       A_II, A_OO, A_SS, A_IO, A_OS, A_IS, NV };
#include "fmu.h"

#define DEG_H 4.84813681109535993590e-6 /* rad/s */

static const double start[NV] = {[T_FLOAT] = 0.8, [GAIN] = 1.0, [SCALE] = 20.0, [SENS] = 10000.0};

static fmi2Status initialize(instance *m) {
    if (!(m->v[T_FLOAT] > 0.0)) return say(m, fmi2Error, "T_FLOAT = %g ms must be positive", m->v[T_FLOAT]);
    return fmi2OK;
}

static fmi2Status step(instance *m, double h) {
    const double *v = m->v;
    const double x = v[ACC_I], y = v[ACC_O], z = v[ACC_S];
    const double drift = v[BIAS] + v[MU_I] * x + v[MU_O] * y + v[MU_S] * z + v[A_II] * x * x + v[A_OO] * y * y
                       + v[A_SS] * z * z + v[A_IO] * x * y + v[A_OS] * y * z + v[A_IS] * x * z;
    const double angle = m->state[0], rate = m->state[1], tau = 1e-3 * v[T_FLOAT];
    const double target = v[GAIN] * DEG_H * (v[W_I] - v[W_S] * angle - drift - v[SCALE] * v[CURRENT]);
    const double decay = exp(-h / tau);
    m->state[0] = angle + target * h + (rate - target) * tau * (1.0 - decay);
    m->state[1] = target + (rate - target) * decay;
    return fmi2OK;
}

static void outputs(instance *m) { m->v[PICKOFF] = m->v[SENS] * m->state[0]; }
