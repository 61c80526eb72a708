/* The FMI 2.0 co-simulation interface around an array of values, for the foreign FMUs of the tests.

   An FMU defines NV (number of variables), `start[NV]`, and the functions `initialize`, `step` and `outputs`; a value
   reference is the place in `v`, whatever the type.  `say` logs through the FMI logger.  With OWN_TERMINATE the FMU has its own
   fmi2Terminate, with NO_INSTANCE it cannot be instantiated. */

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

typedef struct {
    double v[NV];
    double state[8];
    double time;
    long steps;
    char name[64];
    fmi2CallbackFunctions callbacks;
} instance;

static const double start[NV];
static fmi2Status initialize(instance *m);
static fmi2Status step(instance *m, double h);
static void outputs(instance *m);

static fmi2Status say(instance *m, fmi2Status status, const char *text, double value) {
    m->callbacks.logger(m->callbacks.componentEnvironment, m->name, status, "logStatusError", text, value);
    return status;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String names[]) {
    (void)c; (void)on; (void)n; (void)names;
    return fmi2OK;
}
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String where,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    (void)type; (void)guid; (void)where; (void)visible; (void)logging;
#ifdef NO_INSTANCE
    return NULL;
#endif
    instance *m = calloc(1, sizeof *m);
    if (!m) return NULL;
    memcpy(m->v, start, sizeof m->v);
    strncpy(m->name, name, sizeof m->name - 1);
    m->callbacks = *callbacks;
    return m;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real tol, fmi2Real t0, fmi2Boolean sd, fmi2Real t1) {
    (void)td; (void)tol; (void)sd; (void)t1;
    ((instance *)c)->time = t0;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return initialize(c); }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }
#ifndef OWN_TERMINATE
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
#endif
fmi2Status fmi2Reset(fmi2Component c) {
    instance *m = c;
    memcpy(m->v, start, sizeof m->v);
    memset(m->state, 0, sizeof m->state);
    m->steps = 0;
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const unsigned vr[], size_t n, double value[]) {
    outputs(c);
    for (size_t i = 0; i < n; i++) value[i] = ((instance *)c)->v[vr[i]];
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const unsigned vr[], size_t n, const double value[]) {
    for (size_t i = 0; i < n; i++) ((instance *)c)->v[vr[i]] = value[i];
    return fmi2OK;
}
fmi2Status fmi2GetInteger(fmi2Component c, const unsigned vr[], size_t n, int value[]) {
    outputs(c);
    for (size_t i = 0; i < n; i++) value[i] = (int)((instance *)c)->v[vr[i]];
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const unsigned vr[], size_t n, const int value[]) {
    for (size_t i = 0; i < n; i++) ((instance *)c)->v[vr[i]] = value[i];
    return fmi2OK;
}
fmi2Status fmi2GetBoolean(fmi2Component c, const unsigned vr[], size_t n, int value[]) {
    return fmi2GetInteger(c, vr, n, value);
}
fmi2Status fmi2SetBoolean(fmi2Component c, const unsigned vr[], size_t n, const int value[]) {
    return fmi2SetInteger(c, vr, n, value);
}
fmi2Status fmi2DoStep(fmi2Component c, double t, double h, fmi2Boolean no_set) {
    instance *m = c;
    (void)no_set;
    fmi2Status status = step(m, h);
    m->steps++;
    m->time = t + h;
    return status;
}

#define UNUSED(name, ...) \
    fmi2Status name(__VA_ARGS__) { return fmi2Error; }
UNUSED(fmi2GetString, fmi2Component c, const unsigned vr[], size_t n, fmi2String value[])
UNUSED(fmi2SetString, fmi2Component c, const unsigned vr[], size_t n, const fmi2String value[])
UNUSED(fmi2GetFMUstate, fmi2Component c, fmi2FMUstate *s)
UNUSED(fmi2SetFMUstate, fmi2Component c, fmi2FMUstate s)
UNUSED(fmi2FreeFMUstate, fmi2Component c, fmi2FMUstate *s)
UNUSED(fmi2SerializedFMUstateSize, fmi2Component c, fmi2FMUstate s, size_t *n)
UNUSED(fmi2SerializeFMUstate, fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n)
UNUSED(fmi2DeSerializeFMUstate, fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
UNUSED(fmi2GetDirectionalDerivative, fmi2Component c, const unsigned a[], size_t n, const unsigned b[], size_t k,
       const double x[], double y[])
UNUSED(fmi2SetRealInputDerivatives, fmi2Component c, const unsigned vr[], size_t n, const int o[], const double x[])
UNUSED(fmi2GetRealOutputDerivatives, fmi2Component c, const unsigned vr[], size_t n, const int o[], double x[])
UNUSED(fmi2CancelStep, fmi2Component c)
UNUSED(fmi2GetStatus, fmi2Component c, const fmi2StatusKind k, fmi2Status *x)
UNUSED(fmi2GetRealStatus, fmi2Component c, const fmi2StatusKind k, double *x)
UNUSED(fmi2GetIntegerStatus, fmi2Component c, const fmi2StatusKind k, int *x)
UNUSED(fmi2GetBooleanStatus, fmi2Component c, const fmi2StatusKind k, int *x)
UNUSED(fmi2GetStringStatus, fmi2Component c, const fmi2StatusKind k, fmi2String *x)
