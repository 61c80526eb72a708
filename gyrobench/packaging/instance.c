/* An instance of a component for the FMI 2 and FMI 3 faces: its log, its steps, derivatives, states: see instance.h. */
#include "model.c"
#include "extents.h" /* generated: see Model */

#include "instance.h"

struct Instance {
    Part part;
    Numbers fresh; /* as instantiated, for reset */
};

typedef struct {
    Face face;
    Instance instance;
} Whole;
_Static_assert(offsetof(Whole, instance) == sizeof(Face), "face_of");

typedef struct {
    char guid[40]; /* a state of another FMU is refused */
    Numbers n;
} Saved;

#ifndef APART
static const char guid[40] = MODEL_GUID;
static
#endif
const Model model = {N_REFERENCES, U0, sizeof(Saved), names, extents};

COLD Instance *new_instance(const char *name, const Face *face) {
    Whole *const whole = (Whole *)calloc(1, sizeof *whole);
    Instance *m;
    if (!whole) return NULL;
    m = &whole->instance;
    begin(&m->part, name);
    m->fresh = m->part.n;
    whole->face = *face;
    whole->face.name = m->part.name;
    whole->face.time = &m->part.n.v.t;
    whole->face.running = &m->part.n.running;
    whole->face.dirty = &m->part.n.dirty;
    whole->face.failed = &m->part.failed;
    return m;
}

static COLD void restart(Instance *m, const Numbers *n) {
    m->part.n = *n;
    memset(&m->part.kept, 0, sizeof m->part.kept);
    m->part.failed = 0;
}

COLD void reset(Instance *m) { restart(m, &m->fresh); }

/* --------------------------------------------------------------------------------------- failures */
COLD int tell(Instance *m) { /* the reason of a failure goes to the caller's log, once */
    if (m->part.failed == 1 && face_of(m)->logger) face_of(m)->say(face_of(m), m->part.message);
    m->part.failed = 2;
    return 3;
}

COLD int wrong(Instance *m, const char *format, ...) { /* a wrong call leaves the instance as it was */
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

COLD int missing(Instance *m, unsigned reference) {
    return wrong(m, "no variable has the value reference %u", reference);
}

COLD int unsettable(Instance *m, unsigned reference) { /* why a variable is not set */
    const char *name;
    if (!extent(face_of(m), reference)) return missing(m, reference);
    name = names[place(face_of(m), reference)];
    return wrong(m, "parameter %.*s is fixed once initialization has ended: reset first",
                 (int)(extent(face_of(m), reference) > 1 ? strcspn(name, "[") : strlen(name)), name);
}

static COLD int has_all(Instance *m, const unsigned references[], size_t n) {
    size_t i;
    for (i = 0; i < n; i++)
        if (!extent(face_of(m), references[i])) return missing(m, references[i]) == 0;
    return 1;
}

/* Sets values while it runs, parameters among them; refused, nothing has changed. */
COLD int tune_values(Instance *m, const unsigned references[], size_t n, const double in[]) {
    const Face *const f = face_of(m);
    Part *const p = &m->part;
    const int before = p->failed;
    Numbers *room;
    int k, status = 0, changed = 0;
    size_t i, j = 0;
    for (i = 0; i < n; i++)
        if (!extent(f, references[i]) || (in_range(place(f, references[i]), 0, U0) && !tunable[place(f, references[i])]))
            return unsettable(m, references[i]);
    room = (Numbers *)malloc(2 * sizeof *room);
    if (!room) return wrong(m, "out of memory");
    room[0] = p->n;
    for (i = 0; i < n; i++)
        for (k = 0; k < extent(f, references[i]); k++, j++) {
            double *const v = value(p) + place(f, references[i]) + k;
            changed |= in_range(place(f, references[i]), 0, U0) && *v != in[j];
            *v = in[j];
        }
    p->n.dirty = 1.0;
    if (changed) {
        p->failed = 0;
        tune(p, &room[1]);
        if (p->failed) {
            p->n = room[0];
            status = tell(m);
        }
        p->failed = before;
    }
    free(room);
    return status;
}

/* ------------------------------------------------------------------------------ values and steps */
/* To be called before values are read: outputs follow inputs that were set since the last step. */
NEVER_INLINE void freshen(Instance *m, const unsigned references[], size_t n) {
    size_t i;
    for (i = 0; i < n; i++)
        if (in_range(place(face_of(m), references[i]), Y0, N_Y)) refresh(&m->part);
}

COLD int run(Instance *m) { /* the end of initialization */
    m->part.failed = 0;
    initialize(&m->part, m->part.n.v.t);
    return told(m);
}

int step(Instance *m, double t, double h) {
    if (m->part.n.running == 0.0) return wrong(m, "a step before initialization has succeeded");
    return m->part.failed || do_step(&m->part, t, h) ? tell(m) : 0;
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
COLD int derivative(Instance *m, const unsigned unknown[], size_t n_unknown, const unsigned known[], size_t n_known,
                    const double dv[], double out[]) {
    Vars seed;
    const Vars before = m->part.n.v; /* asking changes nothing: outputs may read the derivatives of the last step */
    const Face *const f = face_of(m);
    size_t i, j = 0;
    int k;
    memset(&seed, 0, sizeof seed);
    if (!has_all(m, unknown, n_unknown) || !has_all(m, known, n_known)) return 3;
    for (i = 0; i < n_known; i++)
        for (k = 0; k < extent(f, known[i]); k++) ((double *)&seed)[place(f, known[i]) + k] = dv[j++];
    flow_d(&m->part, &seed);
    outputs_d(&m->part, &seed);
    m->part.n.v = before;
    for (i = j = 0; i < n_unknown; i++)
        for (k = 0; k < extent(f, unknown[i]); k++) out[j++] = ((double *)&seed)[place(f, unknown[i]) + k];
    return told(m);
}

/* ---------------------------------------------------------------------------------------- states */
COLD int get_state(Instance *m, void **state) {
    if (!*state) *state = malloc(sizeof(Numbers));
    if (!*state) return wrong(m, "out of memory");
    memcpy(*state, &m->part.n, sizeof(Numbers));
    return 0;
}

COLD int set_state(Instance *m, const void *state) {
    if (!state) return wrong(m, "no state is given");
    restart(m, (const Numbers *)state);
    return 0;
}

COLD int save(Instance *m, const void *state, void *bytes, size_t size) {
    if (!state || size < sizeof(Saved)) return wrong(m, "a saved state has %u bytes", (unsigned)sizeof(Saved));
    memcpy(bytes, guid, sizeof guid);
    memcpy((char *)bytes + offsetof(Saved, n), state, sizeof(Numbers));
    return 0;
}

COLD int load(Instance *m, const void *bytes, size_t size, void **state) {
    if (size != sizeof(Saved) || memcmp(bytes, guid, sizeof guid) != 0)
        return wrong(m, "these bytes are not a state of this FMU");
    if (!*state) *state = malloc(sizeof(Numbers));
    if (!*state) return wrong(m, "out of memory");
    memcpy(*state, (const char *)bytes + offsetof(Saved, n), sizeof(Numbers));
    return 0;
}
