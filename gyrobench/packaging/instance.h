/* What the FMI 2 and FMI 3 faces know of a component, whatever its model, and what instance.c does with it.
 *
 * The sources in an FMU are one unit: fmi2.c (or fmi3.c) includes instance.c, which includes model.c.  A build compiles
 * with APART, which makes a face a unit of its own: instance.c once for both faces of a model, a face once for all models.
 */
#ifndef GYROBENCH_INSTANCE
#define GYROBENCH_INSTANCE

#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#ifndef APART
#define SHARED static
#elif defined(__GNUC__) && !defined(_WIN32)
#define SHARED extern __attribute__((visibility("hidden")))
#else
#define SHARED extern
#endif

typedef struct Instance Instance; /* begins with its values: doubles in the order of the value references */

typedef struct {
    unsigned n_references, u0; /* the number of values; the first that is no parameter */
    size_t saved;              /* bytes of a saved state */
    const char *const *names;
    const int *extents; /* the number of values of the variable that begins at a value, 0 within an array */
} Model;

typedef struct Face {
    unsigned first;     /* value reference of the first variable */
    const int *extents; /* as in Model; NULL where there are no arrays */
    void (*say)(const struct Face *face, const char *message);
    void (*logger)(void); /* the log callback of the FMI version; NULL where there is none */
    void *environment;
    const char *name;               /* of the instance; what follows is set by new_instance */
    double *time, *running, *dirty; /* running: initialized.  dirty: a value was set since the last step */
    int *failed;
} Face;

#ifdef APART
SHARED const Model model;
SHARED const char guid[40]; /* of this FMU */
#else
static const Model model;
#endif
SHARED Instance *new_instance(const char *name, const Face *face);
SHARED void reset(Instance *m);
SHARED int tell(Instance *m);
SHARED int wrong(Instance *m, const char *format, ...);
SHARED int missing(Instance *m, unsigned reference);
SHARED int unsettable(Instance *m, unsigned reference);
SHARED int tune_values(Instance *m, const unsigned references[], size_t n, const double in[]);
SHARED void freshen(Instance *m, const unsigned references[], size_t n);
SHARED int run(Instance *m);
SHARED int step(Instance *m, double t, double h);
SHARED int derivative(Instance *m, const unsigned unknown[], size_t n_unknown, const unsigned known[], size_t n_known,
                      const double dv[], double out[]);
SHARED int get_state(Instance *m, void **state);
SHARED int set_state(Instance *m, const void *state);
SHARED int save(Instance *m, const void *state, void *bytes, size_t size);
SHARED int load(Instance *m, const void *bytes, size_t size, void **state);

static inline Face *face_of(void *instance) { return (Face *)instance - 1; } /* it stands before its values */

/* Whether a place is one of n from the first on; below that it wraps round. */
static inline int in_range(unsigned place, unsigned first, unsigned n) { return place - first < n; }

static inline unsigned place(const Face *f, unsigned reference) { return reference - f->first; }

/* The number of values of a variable; 0 where there is no such variable. */
static inline int extent(const Face *f, unsigned reference) {
    if (!in_range(place(f, reference), 0, model.n_references)) return 0;
    return f->extents ? f->extents[place(f, reference)] : 1;
}

/* The first value that may be set now without more ado: no parameter once the instance runs. */
static inline unsigned first_settable(const Face *f) { return *f->running != 0.0 ? model.u0 : 0u; }

/* The status of a call: 0 OK, 3 error, the same in both versions; the reason of a failure goes to the log. */
static inline int told(Instance *m) { return *face_of(m)->failed ? tell(m) : 0; }

#endif
