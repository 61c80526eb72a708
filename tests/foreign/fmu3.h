/* The FMI 3.0 co-simulation interface around an array of numbers, for the foreign FMUs of the tests.

   An FMU defines NV (number of values), NR (number of value references), `first[NR + 1]` (place of the first value of
   each reference; the next one is where it ends), `start[NV]`, and the functions `initialize`, `step` and `outputs`.
   All types share the values, as doubles. */

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "fmi3Functions.h"

typedef struct {
    double v[NV];
    double state[8];
    double time;
    long steps, calls;
    bool early; /* step() sets it where it ends before the communication point */
    bool ended;
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
} instance;

static const int first[NR + 1];
static const double start[NV];
static fmi3Status initialize(instance *m);
static double step(instance *m, double t, double h); /* returns the time that is reached, NaN for an error */
static void outputs(instance *m);

static fmi3Status say(instance *m, const char *text) {
    m->log(m->environment, fmi3Error, "logStatusError", text);
    return fmi3Error;
}

const char *fmi3GetVersion(void) { return fmi3Version; }
fmi3Status fmi3SetDebugLogging(fmi3Instance m, fmi3Boolean on, size_t n, const fmi3String names[]) { return fmi3OK; }
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String where, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n, fmi3InstanceEnvironment e,
                                         fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update) {
    if (events || update || n) return NULL; /* the bench uses neither event mode nor intermediate update */
    instance *m = calloc(1, sizeof *m);
    if (!m) return NULL;
    memcpy(m->v, start, sizeof m->v);
    m->environment = e;
    m->log = log;
    return m;
}
void fmi3FreeInstance(fmi3Instance m) { free(m); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, double tol, double t0, fmi3Boolean sd, double t1) {
    ((instance *)c)->time = t0;
    return initialize(c);
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance m) { return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance m) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance m) { return fmi3Error; }

#define ACCESS(Name)                                                                                                  \
    fmi3Status fmi3Get##Name(fmi3Instance c, const unsigned vr[], size_t n, fmi3##Name x[], size_t count) {            \
        size_t k = 0;                                                                                                 \
        outputs(c);                                                                                                   \
        for (size_t i = 0; i < n; i++)                                                                                \
            for (int j = first[vr[i]]; j < first[vr[i] + 1]; j++) x[k++] = (fmi3##Name)((instance *)c)->v[j];         \
        return k == count ? fmi3OK : say(c, "as many values as the arrays have elements are expected");               \
    }                                                                                                                 \
    fmi3Status fmi3Set##Name(fmi3Instance c, const unsigned vr[], size_t n, const fmi3##Name x[], size_t count) {      \
        size_t k = 0;                                                                                                 \
        for (size_t i = 0; i < n; i++)                                                                                \
            for (int j = first[vr[i]]; j < first[vr[i] + 1]; j++) ((instance *)c)->v[j] = (double)x[k++];             \
        return k == count ? fmi3OK : say(c, "as many values as the arrays have elements are expected");               \
    }
ACCESS(Float64)
ACCESS(Float32)
ACCESS(Int8)
ACCESS(UInt8)
ACCESS(Int16)
ACCESS(UInt16)
ACCESS(Int32)
ACCESS(UInt32)
ACCESS(Int64)
ACCESS(UInt64)
ACCESS(Boolean)

fmi3Status fmi3DoStep(fmi3Instance c, double t, double h, fmi3Boolean no_set, fmi3Boolean *event, fmi3Boolean *ended,
                      fmi3Boolean *early, double *last) {
    instance *m = c;
    m->early = m->ended = *event = false;
    *last = step(m, t, h);
    m->time = *last;
    m->calls++;
    if (!m->early) m->steps++;
    *early = m->early;
    *ended = m->ended;
    return isnan(*last) ? fmi3Error : fmi3OK;
}

#define UNUSED(name, ...)                                                                                             \
    fmi3Status name(__VA_ARGS__) { return fmi3Error; }
#define VR const fmi3ValueReference vr[], size_t n
fmi3Instance fmi3InstantiateModelExchange(fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e,
                                          fmi3InstanceEnvironment f, fmi3LogMessageCallback g) { return NULL; }
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String a, fmi3String b, fmi3String c, fmi3Boolean d, fmi3Boolean e,
                                               fmi3InstanceEnvironment f, fmi3LogMessageCallback g,
                                               fmi3ClockUpdateCallback h, fmi3LockPreemptionCallback i,
                                               fmi3UnlockPreemptionCallback j) { return NULL; }
UNUSED(fmi3EnterEventMode, fmi3Instance m)
UNUSED(fmi3GetString, fmi3Instance m, VR, fmi3String x[], size_t k)
UNUSED(fmi3SetString, fmi3Instance m, VR, const fmi3String x[], size_t k)
UNUSED(fmi3GetBinary, fmi3Instance m, VR, size_t s[], fmi3Binary x[], size_t k)
UNUSED(fmi3SetBinary, fmi3Instance m, VR, const size_t s[], const fmi3Binary x[], size_t k)
UNUSED(fmi3GetClock, fmi3Instance m, VR, fmi3Clock x[])
UNUSED(fmi3SetClock, fmi3Instance m, VR, const fmi3Clock x[])
UNUSED(fmi3GetNumberOfVariableDependencies, fmi3Instance m, fmi3ValueReference vr, size_t *n)
UNUSED(fmi3GetVariableDependencies, fmi3Instance m, fmi3ValueReference vr, size_t a[], fmi3ValueReference b[],
       size_t c[], fmi3DependencyKind d[], size_t n)
UNUSED(fmi3GetFMUState, fmi3Instance m, fmi3FMUState *s)
UNUSED(fmi3SetFMUState, fmi3Instance m, fmi3FMUState s)
UNUSED(fmi3FreeFMUState, fmi3Instance m, fmi3FMUState *s)
UNUSED(fmi3SerializedFMUStateSize, fmi3Instance m, fmi3FMUState s, size_t *n)
UNUSED(fmi3SerializeFMUState, fmi3Instance m, fmi3FMUState s, fmi3Byte b[], size_t n)
UNUSED(fmi3DeserializeFMUState, fmi3Instance m, const fmi3Byte b[], size_t n, fmi3FMUState *s)
UNUSED(fmi3GetDirectionalDerivative, fmi3Instance m, const unsigned a[], size_t n, const unsigned b[], size_t k,
       const double x[], size_t nx, double y[], size_t ny)
UNUSED(fmi3GetAdjointDerivative, fmi3Instance m, const unsigned a[], size_t n, const unsigned b[], size_t k,
       const double x[], size_t nx, double y[], size_t ny)
UNUSED(fmi3EnterConfigurationMode, fmi3Instance m)
UNUSED(fmi3ExitConfigurationMode, fmi3Instance m)
UNUSED(fmi3GetIntervalDecimal, fmi3Instance m, VR, double x[], fmi3IntervalQualifier q[])
UNUSED(fmi3GetIntervalFraction, fmi3Instance m, VR, fmi3UInt64 a[], fmi3UInt64 b[], fmi3IntervalQualifier q[])
UNUSED(fmi3GetShiftDecimal, fmi3Instance m, VR, double x[])
UNUSED(fmi3GetShiftFraction, fmi3Instance m, VR, fmi3UInt64 a[], fmi3UInt64 b[])
UNUSED(fmi3SetIntervalDecimal, fmi3Instance m, VR, const double x[])
UNUSED(fmi3SetIntervalFraction, fmi3Instance m, VR, const fmi3UInt64 a[], const fmi3UInt64 b[])
UNUSED(fmi3SetShiftDecimal, fmi3Instance m, VR, const double x[])
UNUSED(fmi3SetShiftFraction, fmi3Instance m, VR, const fmi3UInt64 a[], const fmi3UInt64 b[])
UNUSED(fmi3EvaluateDiscreteStates, fmi3Instance m)
UNUSED(fmi3UpdateDiscreteStates, fmi3Instance m, fmi3Boolean *a, fmi3Boolean *b, fmi3Boolean *c, fmi3Boolean *d,
       fmi3Boolean *e, double *t)
UNUSED(fmi3EnterContinuousTimeMode, fmi3Instance m)
UNUSED(fmi3CompletedIntegratorStep, fmi3Instance m, fmi3Boolean a, fmi3Boolean *b, fmi3Boolean *c)
UNUSED(fmi3SetTime, fmi3Instance m, double t)
UNUSED(fmi3SetContinuousStates, fmi3Instance m, const double x[], size_t n)
UNUSED(fmi3GetContinuousStateDerivatives, fmi3Instance m, double x[], size_t n)
UNUSED(fmi3GetEventIndicators, fmi3Instance m, double x[], size_t n)
UNUSED(fmi3GetContinuousStates, fmi3Instance m, double x[], size_t n)
UNUSED(fmi3GetNominalsOfContinuousStates, fmi3Instance m, double x[], size_t n)
UNUSED(fmi3GetNumberOfEventIndicators, fmi3Instance m, size_t *n)
UNUSED(fmi3GetNumberOfContinuousStates, fmi3Instance m, size_t *n)
UNUSED(fmi3EnterStepMode, fmi3Instance m)
UNUSED(fmi3GetOutputDerivatives, fmi3Instance m, VR, const fmi3Int32 o[], double x[], size_t k)
UNUSED(fmi3ActivateModelPartition, fmi3Instance m, fmi3ValueReference vr, double t)
