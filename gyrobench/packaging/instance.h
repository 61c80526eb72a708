/* What the FMI 2 and FMI 3 faces share: an instance, its log, values by reference, states, derivatives.
 *
 * Included after model.c.  `Logger` is the type of the FMI version's log callback, `say` its call, FIRST_REFERENCE the
 * value reference of the first variable, EXTENT(place) the number of values of the variable at a place of `Vars`: 0
 * where none begins, within an array.
 * The results are FMI status values: 0 OK, 3 error, the same in both versions.
 */
#include <stdlib.h>

typedef struct {
    Part part;
    Numbers fresh; /* as instantiated, for reset */
    Logger logger;
    void *environment;
} Instance;

static COLD void say(Instance *m, const char *message);

static COLD Instance *new_instance(const char *name, Logger logger, void *environment) {
    Instance *m = (Instance *)calloc(1, sizeof *m);
    if (!m) return NULL;
    begin(&m->part, name);
    m->logger = logger;
    m->environment = environment;
    m->fresh = m->part.n;
    return m;
}

static COLD void reset(Instance *m) {
    m->part.n = m->fresh;
    m->part.kept.settled = m->part.kept.keyed = 0;
    m->part.kept.step = 0.0;
    m->part.failed = 0;
}

/* --------------------------------------------------------------------------------------- failures */
static COLD int tell(Instance *m) { /* the reason of a failure goes to the caller's log, once */
    if (m->part.failed == 1 && m->logger) say(m, m->part.message);
    m->part.failed = 2;
    return 3;
}

static inline int told(Instance *m) { return m->part.failed ? tell(m) : 0; }

static COLD int wrong(Instance *m, const char *format, ...) { /* a wrong call leaves the instance as it was */
    const int before = m->part.failed;
    va_list a;
    va_start(a, format);
    m->part.failed = 0;
    vfail(&m->part, format, a);
    va_end(a);
    told(m);
    m->part.failed = before;
    return 3;
}

/* ---------------------------------------------------------------------------------------- values */
static COLD int missing(Instance *m, unsigned reference) {
    return wrong(m, "no variable has the value reference %u", reference);
}

static inline int in_range(unsigned reference, int first, int n) {
    return reference - (unsigned)first < (unsigned)n; /* below the first it wraps round */
}

static inline unsigned place(unsigned reference) { return reference - FIRST_REFERENCE; }

static inline int extent(unsigned reference) { /* the number of its values; 0 where there is no such variable */
    return in_range(place(reference), 0, N_REFERENCES) ? EXTENT(place(reference)) : 0;
}

static inline int has(unsigned reference) { return extent(reference) > 0; }

static COLD int has_all(Instance *m, const unsigned references[], size_t n) {
    size_t i;
    for (i = 0; i < n; i++)
        if (!has(references[i])) return missing(m, references[i]) == 0;
    return 1;
}

/* To be called before values are read: outputs follow inputs that were set since the last step. */
static NEVER_INLINE void freshen(Instance *m, const unsigned references[], size_t n) {
    size_t i;
    for (i = 0; i < n; i++)
        if (in_range(place(references[i]), Y0, N_Y)) refresh(&m->part);
}

/* Where the values of a variable are; NULL where there is no such variable. */
static inline const double *values_of(Instance *m, unsigned reference) {
    if (has(reference)) return value(&m->part) + place(reference);
    missing(m, reference);
    return NULL;
}

/* The same, to be set; NULL where it may not be set now. */
static inline double *settable(Instance *m, unsigned reference) {
    const char *name;
    if (!has(reference)) {
        missing(m, reference);
        return NULL;
    }
    if ((int)place(reference) >= U0 || m->part.n.running == 0.0) return value(&m->part) + place(reference);
    name = names[place(reference)];
    wrong(m, "parameter %.*s is fixed once initialization has ended: reset first",
          (int)(extent(reference) > 1 ? strcspn(name, "[") : strlen(name)), name);
    return NULL;
}

static int step(Instance *m, double t, double h) {
    if (m->part.n.running == 0.0) return wrong(m, "a step before initialization has succeeded");
    if (!m->part.failed) do_step(&m->part, t, h);
    return told(m);
}

#ifdef CAN_BE_LINKED /* for the linked form of a system; where a step fails, doStep tells why */
#ifdef _WIN32
#define LINKED_FORM __declspec(dllexport)
#elif defined(__GNUC__)
#define LINKED_FORM __attribute__((visibility("default")))
#else
#define LINKED_FORM
#endif
LINKED_FORM int gyrobench_step(void *c, double t, double h) { return linked_step(&((Instance *)c)->part, t, h); }
LINKED_FORM int gyrobench_quick_step(void *c, double t, double h) { return quick_step(&((Instance *)c)->part, t, h); }
LINKED_FORM int gyrobench_finite(void *c) { return tell_finite(&((Instance *)c)->part); }
#endif

/* Derivatives of outputs and state derivatives with respect to inputs, states and parameters. */
static COLD int derivative(Instance *m, const unsigned unknown[], size_t n_unknown, const unsigned known[], size_t n_known,
                      const double dv[], double out[]) {
    Vars seed;
    const Vars before = m->part.n.v; /* asking changes nothing: outputs may read the derivatives of the last step */
    size_t i, j = 0;
    int k;
    memset(&seed, 0, sizeof seed);
    if (!has_all(m, unknown, n_unknown) || !has_all(m, known, n_known)) return 3;
    for (i = 0; i < n_known; i++)
        for (k = 0; k < extent(known[i]); k++) ((double *)&seed)[place(known[i]) + k] = dv[j++];
    flow_d(&m->part, &seed);
    outputs_d(&m->part, &seed);
    m->part.n.v = before;
    for (i = j = 0; i < n_unknown; i++)
        for (k = 0; k < extent(unknown[i]); k++) out[j++] = ((double *)&seed)[place(unknown[i]) + k];
    return told(m);
}

/* ---------------------------------------------------------------------------------------- states */
typedef struct {
    char guid[40]; /* a state of another FMU is refused */
    Numbers n;
} Saved;

static COLD int get_state(Instance *m, void **state) {
    if (!*state) *state = malloc(sizeof(Numbers));
    if (!*state) return wrong(m, "out of memory");
    memcpy(*state, &m->part.n, sizeof(Numbers));
    return 0;
}

static COLD int set_state(Instance *m, const void *state) {
    if (!state) return wrong(m, "no state is given");
    memcpy(&m->part.n, state, sizeof(Numbers));
    m->part.kept.settled = m->part.kept.keyed = 0;
    m->part.kept.step = 0.0;
    m->part.failed = 0;
    return 0;
}

static COLD int save(Instance *m, const void *state, void *bytes, size_t size) {
    static const char guid[40] = MODEL_GUID;
    if (!state || size < sizeof(Saved)) return wrong(m, "a saved state has %u bytes", (unsigned)sizeof(Saved));
    memcpy(bytes, guid, sizeof guid);
    memcpy((char *)bytes + offsetof(Saved, n), state, sizeof(Numbers));
    return 0;
}

static COLD int load(Instance *m, const void *bytes, size_t size, void **state) {
    static const char guid[40] = MODEL_GUID;
    if (size != sizeof(Saved) || memcmp(bytes, guid, sizeof guid) != 0)
        return wrong(m, "these bytes are not a state of this FMU");
    if (!*state) *state = malloc(sizeof(Numbers));
    if (!*state) return wrong(m, "out of memory");
    memcpy(*state, (const char *)bytes + offsetof(Saved, n), sizeof(Numbers));
    return 0;
}
