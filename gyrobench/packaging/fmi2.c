/* FMI 2.0 co-simulation face of a native component: with the model in one unit, or APART (see instance.h). */
#ifndef APART
#include "instance.c"
#endif
#include "instance.h"

#include "fmi2Functions.h"

static void say(const Face *face, const char *message) {
    char format[2048];
    size_t i = 0;
    for (; *message && i < sizeof format - 2; message++) { /* the logger takes a printf format */
        if (*message == '%') format[i++] = '%';
        format[i++] = *message;
    }
    format[i] = 0;
    ((fmi2CallbackLogger)face->logger)(face->environment, face->name, fmi2Error, "logStatusError", format);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)c; (void)on; (void)n; (void)categories; /* the reasons of failures are always told */
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token, fmi2String location,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    const char *why = type != fmi2CoSimulation ? "only co-simulation is offered"
                      : !token || strcmp(token, guid) != 0 ? "the GUID is not this FMU's" : NULL;
    (void)location; (void)visible; (void)logging;
    if (!why) {
        Face face = {.say = say};
        if (callbacks) {
            face.logger = (void (*)(void))callbacks->logger;
            face.environment = callbacks->componentEnvironment;
        }
        return new_instance(name, &face);
    }
    if (callbacks && callbacks->logger)
        callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "logStatusError", why);
    return NULL;
}

void fmi2FreeInstance(fmi2Component c) { if (c) free(face_of(c)); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real startTime,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    (void)toleranceDefined; (void)tolerance; (void)stopTimeDefined; (void)stopTime;
    *face_of(c)->time = startTime;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return fmi2OK; }

fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return run((Instance *)c); }

fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { reset((Instance *)c); return fmi2OK; }

/* ------------------------------------------------------------------------------------ variables */
#define GETTER(Name, Type, expression)                                                                            \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, Type out[]) {              \
        const double *const values = (const double *)c;                                                           \
        const unsigned count = model.n_references;                                                                \
        size_t i;                                                                                                 \
        if (*face_of(c)->dirty != 0.0) freshen((Instance *)c, vr, n);                                             \
        for (i = 0; i < n; i++) {                                                                                 \
            double x;                                                                                             \
            if (!in_range(vr[i], 0, count)) return missing((Instance *)c, vr[i]);                                 \
            x = values[vr[i]];                                                                                    \
            out[i] = expression;                                                                                  \
        }                                                                                                         \
        return told((Instance *)c);                                                                               \
    }
#define SETTER(Name, Type, refuse)                                                                                \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const Type in[]) {         \
        double *const values = (double *)c;                                                                       \
        const unsigned first = first_settable(face_of(c)), count = model.n_references - first;                    \
        size_t i;                                                                                                 \
        for (i = 0; i < n; i++) {                                                                                 \
            if (!in_range(vr[i], first, count)) return refuse;                                                    \
            values[vr[i]] = (double)in[i];                                                                        \
        }                                                                                                         \
        *face_of(c)->dirty = 1.0;                                                                                 \
        return fmi2OK;                                                                                            \
    }

GETTER(Real, fmi2Real, x)
GETTER(Integer, fmi2Integer, (fmi2Integer)floor(x + 0.5))
GETTER(Boolean, fmi2Boolean, x != 0.0)
SETTER(Real, fmi2Real, tune_values((Instance *)c, vr, n, in))
SETTER(Integer, fmi2Integer, unsettable((Instance *)c, vr[i]))
SETTER(Boolean, fmi2Boolean, unsettable((Instance *)c, vr[i]))

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String out[]) {
    (void)vr; (void)out;
    return n == 0 ? fmi2OK : wrong((Instance *)c, "this FMU has no string variables");
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String in[]) {
    (void)vr; (void)in;
    return n == 0 ? fmi2OK : wrong((Instance *)c, "this FMU has no string variables");
}

/* --------------------------------------------------------------------------------------- stepping */
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean noSetPrior) {
    (void)noSetPrior;
    return step((Instance *)c, t, h);
}

fmi2Status fmi2CancelStep(fmi2Component c) { return wrong((Instance *)c, "fmi2CancelStep: no step is asynchronous"); }

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                       const fmi2Real in[]) {
    (void)vr; (void)n; (void)order; (void)in;
    return wrong((Instance *)c, "fmi2SetRealInputDerivatives: inputs are held, not interpolated");
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer order[],
                                        fmi2Real out[]) {
    (void)vr; (void)n; (void)order; (void)out;
    return wrong((Instance *)c, "fmi2GetRealOutputDerivatives: not offered");
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *s) { (void)c; (void)k; (void)s; return fmi2Discard; }
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind k, fmi2Real *x) {
    if (k != fmi2LastSuccessfulTime) return fmi2Discard;
    *x = *face_of(c)->time;
    return fmi2OK;
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, fmi2Integer *x) { (void)c; (void)k; (void)x; return fmi2Discard; }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *x) { (void)c; (void)k; (void)x; return fmi2Discard; }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String *x) { (void)c; (void)k; (void)x; return fmi2Discard; }

/* --------------------------------------------------------------------------- states, derivatives */
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { return get_state((Instance *)c, state); }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return set_state((Instance *)c, state); }
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    (void)c; (void)state;
    *size = model.saved;
    return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    return save((Instance *)c, state, bytes, size);
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    return load((Instance *)c, bytes, size, state);
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real dv[], fmi2Real out[]) {
    return derivative((Instance *)c, unknown, n_unknown, known, n_known, dv, out);
}
