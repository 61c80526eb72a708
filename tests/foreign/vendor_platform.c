/* A three-gimbal platform (pitch outside, roll, azimuth) as a vendor would deliver it: other names, other units.

   Angles in deg, rates in deg/s, load in g and that is minus the specific force, commands in mV, motor currents in mA.
   Rate servos with a lag, exact for a command held over the step; joint angles by the midpoint rule, one step each
   communication step.  The gimbals give the platform the rate that the servos ask for, each up to RATE_MAX.  Below
   |cos(roll)| = 1e-3 it refuses: gimbal lock. */

enum { CMD, TQ = CMD + 3, BASE = TQ + 3, BACC = BASE + 3, LOAD = BACC + 3, ANG = LOAD + 3, RATE = ANG + 3,
       W = RATE + 3, ACC = W + 3, TURN = ACC + 3, OUT = TURN + 3, AMP = OUT + 3, LOCKED = AMP + 3, LIMIT, START,
       GAIN = START + 3, LAG, DRAG, RATE_MAX, STIFF, SERVO, NV = SERVO + 3 };
#include "fmu.h"

#define DEG 0.01745329251994329577
#define P 0
#define R 1
#define A 2

static const double start[NV] = {[LOAD + 2] = -1.0, [GAIN] = 50.0, [LAG] = 3.0, [DRAG] = 100.0, [RATE_MAX] = 200.0,
                                 [STIFF] = 12.0};

static double clip(double x, double top) { return x > top ? top : x < -top ? -top : x; }

static fmi2Status initialize(instance *m) {
    if (!(m->v[LAG] > 0.0)) return say(m, fmi2Error, "LAG = %g ms must be positive", m->v[LAG]);
    for (int k = 0; k < 3; k++) m->v[ANG + k] = m->v[START + k];
    return fmi2OK;
}

/* joint rates and platform rate, deg/s, for joint angles q (deg) and servo rates s (deg/s) */
static int move(instance *m, const double q[3], const double s[3], double joint[3], double w[3]) {
    const double *b = m->v + BASE, top = m->v[RATE_MAX];
    const double cp = cos(DEG * q[P]), sp = sin(DEG * q[P]), cr = cos(DEG * q[R]), sr = sin(DEG * q[R]);
    const double ca = cos(DEG * q[A]), sa = sin(DEG * q[A]);
    const double y = cp * b[1] + sp * b[2], z0 = cp * b[2] - sp * b[1];
    const double x = cr * b[0] - sr * z0, z = sr * b[0] + cr * z0;
    if (fabs(cr) < 1e-3) return 0;
    joint[P] = clip(s[P] - x / cr, top);
    joint[R] = clip(s[R] - y, top);
    joint[A] = clip(s[A] - z - sr * joint[P], top);
    const double wx = x + cr * joint[P], wy = y + joint[R];
    w[0] = ca * wx + sa * wy;
    w[1] = ca * wy - sa * wx;
    w[2] = z + sr * joint[P] + joint[A];
    return 1;
}

static fmi2Status step(instance *m, double h) {
    double *v = m->v, half[3], middle[3], joint[3], w[3], wish[3];
    const double tau = 1e-3 * v[LAG], decay = exp(-h / tau), soft = exp(-0.5 * h / tau);
    for (int k = 0; k < 3; k++) {
        wish[k] = 1e-3 * v[GAIN] * v[CMD + k] + v[TQ + k] / v[DRAG] / DEG;
        middle[k] = wish[k] + (v[SERVO + k] - wish[k]) * soft;
    }
    if (!move(m, v + ANG, v + SERVO, joint, w)) return say(m, fmi2Error, "gimbal lock at %g deg of roll", v[ANG + R]);
    for (int k = 0; k < 3; k++) half[k] = v[ANG + k] + 0.5 * h * joint[k];
    if (!move(m, half, middle, joint, w)) return say(m, fmi2Error, "gimbal lock at %g deg of roll", half[R]);
    for (int k = 0; k < 3; k++) {
        v[ANG + k] += h * joint[k];
        v[TURN + k] += h * w[k];
        v[SERVO + k] = wish[k] + (v[SERVO + k] - wish[k]) * decay;
    }
    if (!move(m, v + ANG, v + SERVO, v + RATE, w)) return say(m, fmi2Error, "gimbal lock at %g deg of roll", v[ANG + R]);
    v[LIMIT] = 0.0;
    for (int k = 0; k < 3; k++) {
        v[ACC + k] = (w[k] - v[W + k]) / h;
        v[W + k] = w[k];
        if (fabs(v[RATE + k]) >= v[RATE_MAX]) v[LIMIT] = 1.0;
    }
    return fmi2OK;
}

static void outputs(instance *m) {
    double *v = m->v;
    const double cp = cos(DEG * v[ANG + P]), sp = sin(DEG * v[ANG + P]), cr = cos(DEG * v[ANG + R]);
    const double sr = sin(DEG * v[ANG + R]), ca = cos(DEG * v[ANG + A]), sa = sin(DEG * v[ANG + A]);
    const double y = cp * v[LOAD + 1] + sp * v[LOAD + 2], z0 = cp * v[LOAD + 2] - sp * v[LOAD + 1];
    const double x = cr * v[LOAD] - sr * z0;
    v[OUT] = ca * x + sa * y;
    v[OUT + 1] = ca * y - sa * x;
    v[OUT + 2] = sr * v[LOAD] + cr * z0;
    v[LOCKED] = fabs(cr) < sin(5.0 * DEG) ? 1.0 : 0.0;
    for (int k = 0; k < 3; k++) v[AMP + k] = 1e3 * v[SERVO + k] * DEG / v[STIFF];
}
