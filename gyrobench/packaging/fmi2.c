/* FMI 2.0 co-simulation face of a native component.  Compiled as one unit: model.c is generated. */
#include <stdlib.h>

#include "model.c"

#include "fmi2Functions.h"

typedef struct {
    Part part;
    Numbers fresh; /* as instantiated, for fmi2Reset */
    fmi2CallbackLogger logger;
    fmi2ComponentEnvironment environment;
    int initializing;
} Instance;

static fmi2Status told(Instance *m) { /* the reason of a failure goes to the caller's log, once */
    char format[2 * sizeof m->part.message];
    size_t i = 0;
    const char *c;
    if (!m->part.failed) return fmi2OK;
    for (c = m->part.message; *c; c++) { /* the logger takes a printf format */
        if (*c == '%') format[i++] = '%';
        format[i++] = *c;
    }
    format[i] = 0;
    if (m->part.failed == 1 && m->logger)
        m->logger(m->environment, m->part.name, fmi2Error, "logStatusError", format);
    m->part.failed = 2;
    return fmi2Error;
}

/* A wrong call: it is told, and leaves the instance as it was. */
static fmi2Status wrong(Instance *m, const char *format, ...) {
    const int before = m->part.failed;
    va_list a;
    va_start(a, format);
    m->part.failed = 0;
    vfail(&m->part, format, a);
    va_end(a);
    told(m);
    m->part.failed = before;
    return fmi2Error;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    (void)c; (void)on; (void)n; (void)categories;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String location,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
    Instance *m;
    (void)location; (void)visible; (void)logging;
    if (type != fmi2CoSimulation || !guid || strcmp(guid, MODEL_GUID) != 0) {
        if (callbacks && callbacks->logger)
            callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "logStatusError", "%s",
                              type != fmi2CoSimulation ? "only co-simulation is offered" : "the GUID is not this FMU's");
        return NULL;
    }
    m = (Instance *)calloc(1, sizeof *m);
    if (!m) return NULL;
    snprintf(m->part.name, sizeof m->part.name, "%s", name ? name : "");
    if (callbacks) {
        m->logger = callbacks->logger;
        m->environment = callbacks->componentEnvironment;
    }
    memcpy(value(&m->part), starts, sizeof starts);
    m->part.n.dirty = 1.0;
    m->fresh = m->part.n;
    return m;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean toleranceDefined, fmi2Real tolerance, fmi2Real start_time,
                               fmi2Boolean stopTimeDefined, fmi2Real stopTime) {
    (void)toleranceDefined; (void)tolerance; (void)stopTimeDefined; (void)stopTime;
    ((Instance *)c)->part.n.v.t = start_time;
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    ((Instance *)c)->initializing = 1;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Instance *m = (Instance *)c;
    m->initializing = 0;
    m->part.failed = 0;
    initialize(&m->part, m->part.n.v.t);
    return told(m);
}

fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return fmi2OK; }

fmi2Status fmi2Reset(fmi2Component c) {
    Instance *m = (Instance *)c;
    m->part.n = m->fresh;
    m->part.failed = 0;
    m->initializing = 0;
    return fmi2OK;
}

/* ------------------------------------------------------------------------------------ variables */
static const char *const no_such = "no variable has the value reference %u";
#define HAS(k) ((k) >= 0 && (k) < N_REFERENCES)

static int has(Instance *m, const fmi2ValueReference vr[], size_t n) {
    size_t i;
    for (i = 0; i < n; i++)
        if (!HAS((int)vr[i])) {
            wrong(m, no_such, vr[i]);
            return 0;
        }
    return 1;
}

#define GETTER(Name, Type, expression)                                                                   \
    fmi2Status fmi2Get##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, Type out[]) {      \
        Instance *m = (Instance *)c;                                                                     \
        size_t i;                                                                                        \
        for (i = 0; i < n; i++) {                                                                        \
            const int k = (int)vr[i];                                                                    \
            double x;                                                                                    \
            if (!HAS(k)) return wrong(m, no_such, vr[i]);                                                \
            if (k >= Y0 && k < Y0 + N_Y) refresh(&m->part);                                              \
            x = value(&m->part)[k];                                                                      \
            out[i] = expression;                                                                         \
        }                                                                                                \
        return told(m);                                                                                  \
    }
#define SETTER(Name, Type)                                                                               \
    fmi2Status fmi2Set##Name(fmi2Component c, const fmi2ValueReference vr[], size_t n, const Type in[]) { \
        Instance *m = (Instance *)c;                                                                     \
        size_t i;                                                                                        \
        for (i = 0; i < n; i++) {                                                                        \
            const int k = (int)vr[i];                                                                    \
            if (!HAS(k)) return wrong(m, no_such, vr[i]);                                                \
            if (k < U0 && m->part.n.running != 0.0)                                                      \
                return wrong(m, "parameter %s is fixed once initialization has ended: reset first", names[k]); \
            value(&m->part)[k] = (double)in[i];                                                          \
        }                                                                                                \
        m->part.n.dirty = 1.0;                                                                           \
        return fmi2OK;                                                                                   \
    }

GETTER(Real, fmi2Real, x)
GETTER(Integer, fmi2Integer, (fmi2Integer)floor(x + 0.5))
GETTER(Boolean, fmi2Boolean, x != 0.0)
SETTER(Real, fmi2Real)
SETTER(Integer, fmi2Integer)
SETTER(Boolean, fmi2Boolean)

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String out[]) {
    (void)vr; (void)out;
    return n == 0 ? fmi2OK : wrong((Instance *)c, "this FMU has no string variables");
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String in[]) {
    (void)vr; (void)in;
    return n == 0 ? fmi2OK : wrong((Instance *)c, "this FMU has no string variables");
}

/* --------------------------------------------------------------------------------------- stepping */
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real step, fmi2Boolean noSetPrior) {
    Instance *m = (Instance *)c;
    (void)noSetPrior;
    if (m->part.n.running == 0.0) return wrong(m, "a step before initialization has succeeded");
    if (m->part.failed) return fmi2Error;
    do_step(&m->part, t, step);
    return told(m);
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
    *x = ((Instance *)c)->part.n.v.t;
    return fmi2OK;
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, fmi2Integer *x) { (void)c; (void)k; (void)x; return fmi2Discard; }
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *x) { (void)c; (void)k; (void)x; return fmi2Discard; }
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String *x) { (void)c; (void)k; (void)x; return fmi2Discard; }

/* ------------------------------------------------------------------------------------------ state */
fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(Numbers));
    if (!*state) return wrong((Instance *)c, "fmi2GetFMUstate: out of memory");
    memcpy(*state, &((Instance *)c)->part.n, sizeof(Numbers));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    if (!state) return wrong((Instance *)c, "fmi2SetFMUstate: no state given");
    memcpy(&((Instance *)c)->part.n, state, sizeof(Numbers));
    ((Instance *)c)->part.failed = 0;
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    (void)c;
    free(*state);
    *state = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    (void)c; (void)state;
    *size = sizeof(Saved);
    return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    if (size < sizeof(Saved)) return wrong((Instance *)c, "fmi2SerializeFMUstate: the buffer is too small");
    save((const Numbers *)state, (char *)bytes);
    return fmi2OK;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    if (!saved_here(bytes, size)) return wrong((Instance *)c, "these bytes are not a state of this FMU");
    if (!*state) *state = malloc(sizeof(Numbers));
    if (!*state) return wrong((Instance *)c, "fmi2DeSerializeFMUstate: out of memory");
    memcpy(*state, bytes + offsetof(Saved, n), sizeof(Numbers));
    return fmi2OK;
}

/* Derivatives of outputs and state derivatives with respect to inputs, states and parameters. */
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real dv[], fmi2Real out[]) {
    Instance *m = (Instance *)c;
    Vars seed;
    size_t i;
    memset(&seed, 0, sizeof seed);
    if (!has(m, unknown, n_unknown) || !has(m, known, n_known)) return fmi2Error;
    for (i = 0; i < n_known; i++) ((double *)&seed)[known[i]] = dv[i];
    flow_d(&m->part, &seed);
    outputs_d(&m->part, &seed);
    for (i = 0; i < n_unknown; i++) out[i] = ((double *)&seed)[unknown[i]];
    return told(m);
}
