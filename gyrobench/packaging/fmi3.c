/* FMI 3.0 co-simulation face of a native component: with the model in one unit, or APART (see instance.h).
 *
 * The time has the value reference 0; after it come the variables in the order of the FMI 2.0 face.  An array has the
 * reference of its first element, and those of the others are of no variable.
 */
#ifndef APART
#include "instance.c"
#endif
#include "instance.h"

#include "fmi3Functions.h"

#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wunused-parameter" /* of the functions that only say they are not offered */
#endif

#define NOT_OFFERED(name) { return wrong((Instance *)m, #name ": not offered by this FMU"); }

static void say(const Face *face, const char *message) {
    ((fmi3LogMessageCallback)face->logger)(face->environment, fmi3Error, "logStatusError", message);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance m, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    return fmi3OK; /* the reasons of failures are always told */
}

/* ---------------------------------------------------------------------------------- instantiation */
static fmi3Instance none(fmi3LogMessageCallback logger, void *environment, const char *why) {
    if (logger) logger(environment, fmi3Error, "logStatusError", why);
    return NULL;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean eventMode, fmi3Boolean earlyReturn,
                                         const fmi3ValueReference required[], size_t nRequired,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                         fmi3IntermediateUpdateCallback update) {
    if (!token || strcmp(token, guid) != 0) return none(logger, environment, "the instantiation token is not this FMU's");
    if (nRequired) return none(logger, environment, "no intermediate variables are offered");
    return new_instance(name, &(Face){.first = 1, .extents = model.extents, .say = say, .logger = (void (*)(void))logger,
                                      .environment = environment});
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger) {
    return none(logger, environment, "only co-simulation is offered");
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                               fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback logger, fmi3ClockUpdateCallback clock,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
    return none(logger, environment, "only co-simulation is offered");
}

void fmi3FreeInstance(fmi3Instance m) { if (m) free(face_of(m)); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance m, fmi3Boolean toleranceDefined, fmi3Float64 tolerance,
                                       fmi3Float64 startTime, fmi3Boolean stopTimeDefined, fmi3Float64 stopTime) {
    *face_of(m)->time = startTime;
    return fmi3OK;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance m) { return run((Instance *)m); }

fmi3Status fmi3Terminate(fmi3Instance m) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance m) { reset((Instance *)m); return fmi3OK; }
fmi3Status fmi3EnterStepMode(fmi3Instance m) { return fmi3OK; }
fmi3Status fmi3EnterConfigurationMode(fmi3Instance m) { return fmi3OK; }
fmi3Status fmi3ExitConfigurationMode(fmi3Instance m) { return fmi3OK; }

/* -------------------------------------------------------------------------------------- variables */
static int n_values(Instance *m, unsigned reference) { /* the time has one */
    return reference ? extent(face_of(m), reference) : 1;
}

static int miscounted(Instance *m, const fmi3ValueReference vr[], size_t n, size_t given) {
    size_t i, expected = 0;
    for (i = 0; i < n; i++) {
        if (!n_values(m, vr[i])) return missing(m, vr[i]);
        expected += (size_t)n_values(m, vr[i]);
    }
    if (given == expected) return 0;
    return wrong(m, "%u values for variables of %u values", (unsigned)given, (unsigned)expected);
}

#define GETTER(Name, Type, expression)                                                                               \
    fmi3Status fmi3Get##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, Type out[], size_t n_out) {    \
        Instance *m = (Instance *)c;                                                                                 \
        size_t i, j = 0;                                                                                             \
        int k;                                                                                                       \
        if (miscounted(m, vr, n, n_out)) return fmi3Error;                                                           \
        if (*face_of(m)->dirty != 0.0) freshen(m, vr, n);                                                            \
        for (i = 0; i < n; i++) {                                                                                    \
            const double *const v = vr[i] ? (double *)c + place(face_of(m), vr[i]) : face_of(m)->time;               \
            for (k = 0; k < n_values(m, vr[i]); k++) {                                                               \
                const double x = v[k];                                                                               \
                out[j++] = expression;                                                                               \
            }                                                                                                        \
        }                                                                                                            \
        return told(m);                                                                                              \
    }
#define SETTER(Name, Type, refuse)                                                                                   \
    fmi3Status fmi3Set##Name(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const Type in[], size_t n_in) {\
        Instance *m = (Instance *)c;                                                                                 \
        const unsigned first = first_settable(face_of(m)), count = model.n_references - first;                       \
        size_t i, j = 0;                                                                                             \
        int k;                                                                                                       \
        if (miscounted(m, vr, n, n_in)) return fmi3Error;                                                            \
        for (i = 0; i < n; i++) {                                                                                    \
            const unsigned at = place(face_of(m), vr[i]);                                                            \
            if (!in_range(at, first, count)) return refuse;                                                          \
            for (k = 0; k < extent(face_of(m), vr[i]); k++) ((double *)c)[at + k] = (double)in[j++];                 \
        }                                                                                                            \
        *face_of(m)->dirty = 1.0;                                                                                    \
        return fmi3OK;                                                                                               \
    }
#define NO_TYPE(Name)                                                                                                \
    fmi3Status fmi3Get##Name(fmi3Instance m, const fmi3ValueReference vr[], size_t n, fmi3##Name out[], size_t k)    \
        NOT_OFFERED(fmi3Get##Name)                                                                                   \
    fmi3Status fmi3Set##Name(fmi3Instance m, const fmi3ValueReference vr[], size_t n, const fmi3##Name in[], size_t k) \
        NOT_OFFERED(fmi3Set##Name)

GETTER(Float64, fmi3Float64, x)
GETTER(Int32, fmi3Int32, (fmi3Int32)floor(x + 0.5))
GETTER(Boolean, fmi3Boolean, x != 0.0)
SETTER(Float64, fmi3Float64, tune_values(m, vr, n, in))
SETTER(Int32, fmi3Int32, unsettable(m, vr[i]))
SETTER(Boolean, fmi3Boolean, unsettable(m, vr[i]))
NO_TYPE(Float32)
NO_TYPE(Int8)
NO_TYPE(UInt8)
NO_TYPE(Int16)
NO_TYPE(UInt16)
NO_TYPE(UInt32)
NO_TYPE(Int64)
NO_TYPE(UInt64)
NO_TYPE(String)

fmi3Status fmi3GetBinary(fmi3Instance m, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary values[], size_t k)
    NOT_OFFERED(fmi3GetBinary)
fmi3Status fmi3SetBinary(fmi3Instance m, const fmi3ValueReference vr[], size_t n, const size_t sizes[],
                         const fmi3Binary values[], size_t k) NOT_OFFERED(fmi3SetBinary)
fmi3Status fmi3GetClock(fmi3Instance m, const fmi3ValueReference vr[], size_t n, fmi3Clock values[]) NOT_OFFERED(fmi3GetClock)
fmi3Status fmi3SetClock(fmi3Instance m, const fmi3ValueReference vr[], size_t n, const fmi3Clock values[]) NOT_OFFERED(fmi3SetClock)

/* --------------------------------------------------------------------------------------- stepping */
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean noSetPrior, fmi3Boolean *eventNeeded,
                      fmi3Boolean *terminate, fmi3Boolean *earlyReturn, fmi3Float64 *lastTime) {
    const int status = step((Instance *)c, t, h);
    *eventNeeded = *terminate = *earlyReturn = fmi3False;
    *lastTime = status ? t : t + h;
    return status;
}

/* --------------------------------------------------------------------------- states, derivatives */
fmi3Status fmi3GetFMUState(fmi3Instance m, fmi3FMUState *state) { return get_state((Instance *)m, state); }
fmi3Status fmi3SetFMUState(fmi3Instance m, fmi3FMUState state) { return set_state((Instance *)m, state); }
fmi3Status fmi3FreeFMUState(fmi3Instance m, fmi3FMUState *state) {
    free(*state);
    *state = NULL;
    return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance m, fmi3FMUState state, size_t *size) {
    *size = model.saved;
    return fmi3OK;
}
fmi3Status fmi3SerializeFMUState(fmi3Instance m, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    return save((Instance *)m, state, bytes, size);
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance m, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    return load((Instance *)m, bytes, size, state);
}
fmi3Status fmi3GetDirectionalDerivative(fmi3Instance m, const fmi3ValueReference unknown[], size_t n_unknown,
                                        const fmi3ValueReference known[], size_t n_known, const fmi3Float64 seed[],
                                        size_t n_seed, fmi3Float64 out[], size_t n_out) {
    if (miscounted((Instance *)m, known, n_known, n_seed) || miscounted((Instance *)m, unknown, n_unknown, n_out)) return 3;
    return derivative((Instance *)m, unknown, n_unknown, known, n_known, seed, out);
}

/* ------------------------------------------------------------------------------------ not offered */
fmi3Status fmi3GetAdjointDerivative(fmi3Instance m, const fmi3ValueReference u[], size_t nu, const fmi3ValueReference k[],
                                    size_t nk, const fmi3Float64 seed[], size_t ns, fmi3Float64 s[], size_t n)
    NOT_OFFERED(fmi3GetAdjointDerivative)
fmi3Status fmi3GetOutputDerivatives(fmi3Instance m, const fmi3ValueReference vr[], size_t n, const fmi3Int32 orders[],
                                    fmi3Float64 values[], size_t k) NOT_OFFERED(fmi3GetOutputDerivatives)
fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance m, fmi3ValueReference vr, size_t *n)
    NOT_OFFERED(fmi3GetNumberOfVariableDependencies)
fmi3Status fmi3GetVariableDependencies(fmi3Instance m, fmi3ValueReference vr, size_t elements[], fmi3ValueReference independents[],
                                       size_t others[], fmi3DependencyKind kinds[], size_t n)
    NOT_OFFERED(fmi3GetVariableDependencies)

/* event mode and clocks */
fmi3Status fmi3EnterEventMode(fmi3Instance m) NOT_OFFERED(fmi3EnterEventMode)
fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance m) NOT_OFFERED(fmi3EvaluateDiscreteStates)
fmi3Status fmi3UpdateDiscreteStates(fmi3Instance m, fmi3Boolean *update, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *timeDefined, fmi3Float64 *time)
    NOT_OFFERED(fmi3UpdateDiscreteStates)
fmi3Status fmi3GetIntervalDecimal(fmi3Instance m, const fmi3ValueReference vr[], size_t n, fmi3Float64 x[],
                                  fmi3IntervalQualifier q[]) NOT_OFFERED(fmi3GetIntervalDecimal)
fmi3Status fmi3GetIntervalFraction(fmi3Instance m, const fmi3ValueReference vr[], size_t n, fmi3UInt64 a[], fmi3UInt64 b[],
                                   fmi3IntervalQualifier q[]) NOT_OFFERED(fmi3GetIntervalFraction)
fmi3Status fmi3GetShiftDecimal(fmi3Instance m, const fmi3ValueReference vr[], size_t n, fmi3Float64 x[])
    NOT_OFFERED(fmi3GetShiftDecimal)
fmi3Status fmi3GetShiftFraction(fmi3Instance m, const fmi3ValueReference vr[], size_t n, fmi3UInt64 a[], fmi3UInt64 b[])
    NOT_OFFERED(fmi3GetShiftFraction)
fmi3Status fmi3SetIntervalDecimal(fmi3Instance m, const fmi3ValueReference vr[], size_t n, const fmi3Float64 x[])
    NOT_OFFERED(fmi3SetIntervalDecimal)
fmi3Status fmi3SetIntervalFraction(fmi3Instance m, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 a[],
                                   const fmi3UInt64 b[]) NOT_OFFERED(fmi3SetIntervalFraction)
fmi3Status fmi3SetShiftDecimal(fmi3Instance m, const fmi3ValueReference vr[], size_t n, const fmi3Float64 x[])
    NOT_OFFERED(fmi3SetShiftDecimal)
fmi3Status fmi3SetShiftFraction(fmi3Instance m, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 a[],
                                const fmi3UInt64 b[]) NOT_OFFERED(fmi3SetShiftFraction)
fmi3Status fmi3ActivateModelPartition(fmi3Instance m, fmi3ValueReference clock, fmi3Float64 t)
    NOT_OFFERED(fmi3ActivateModelPartition)

/* model exchange */
fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance m) NOT_OFFERED(fmi3EnterContinuousTimeMode)
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance m, fmi3Boolean noSet, fmi3Boolean *event, fmi3Boolean *terminate)
    NOT_OFFERED(fmi3CompletedIntegratorStep)
fmi3Status fmi3SetTime(fmi3Instance m, fmi3Float64 t) NOT_OFFERED(fmi3SetTime)
fmi3Status fmi3SetContinuousStates(fmi3Instance m, const fmi3Float64 x[], size_t n) NOT_OFFERED(fmi3SetContinuousStates)
fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance m, fmi3Float64 x[], size_t n)
    NOT_OFFERED(fmi3GetContinuousStateDerivatives)
fmi3Status fmi3GetEventIndicators(fmi3Instance m, fmi3Float64 x[], size_t n) NOT_OFFERED(fmi3GetEventIndicators)
fmi3Status fmi3GetContinuousStates(fmi3Instance m, fmi3Float64 x[], size_t n) NOT_OFFERED(fmi3GetContinuousStates)
fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance m, fmi3Float64 x[], size_t n)
    NOT_OFFERED(fmi3GetNominalsOfContinuousStates)
fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance m, size_t *n) NOT_OFFERED(fmi3GetNumberOfEventIndicators)
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance m, size_t *n) NOT_OFFERED(fmi3GetNumberOfContinuousStates)
