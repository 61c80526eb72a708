/* The native engine: the loop of engine.py on arrays of FMI 2 function pointers.

   For each part in execution order: set its inputs from `out`, doStep, get the outputs that others need into `out`.
   Same order and same arithmetic as the reference engine, so the records are equal bit for bit.  The structures are
   mirrored in native.py.  Called in chunks: returns when k_end is reached, when a block of rows is full, when the
   done output is not 0, or when a call fails. */

#ifndef _WIN32
#define _POSIX_C_SOURCE 199309L
#endif
#include <stddef.h>
#include <stdint.h>
#ifdef _WIN32
#include <windows.h>
#define EXPORT __declspec(dllexport)
static double seconds(void) {
    LARGE_INTEGER now, rate;
    QueryPerformanceCounter(&now);
    QueryPerformanceFrequency(&rate);
    return (double)now.QuadPart / (double)rate.QuadPart;
}
#else
#include <time.h>
#define EXPORT __attribute__((visibility("default")))
static double seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}
#endif

enum { REAL = 0, INTEGER = 1, BOOLEAN = 2 };
enum { MORE = 0, DONE = 1, FULL = 2, FAILED = 3 };
enum { CALL_SET = 0, CALL_STEP = 1, CALL_GET = 2 };
enum { TIMED_EVERY = 1009, TIMED_FIRST = 504 };

typedef int (*step_function)(void *, double, double, int);
typedef int (*real_function)(void *, const unsigned int *, size_t, double *);
typedef int (*int_function)(void *, const unsigned int *, size_t, int *);

typedef struct {            /* one get or set call */
    int64_t kind, n;
    void (*call)(void);
    const unsigned int *references;
    void *values;
    double *out;            /* get: where the values belong */
    const int32_t *source;  /* set: places in `out` */
    int64_t n_scaled;
    const int32_t *scaled;
    const double *factor;
} group;

typedef struct {
    void *component;
    step_function step;
    int64_t n_sets, n_gets, n_channel_gets, n_window_gets;
    group *sets, *gets, *channel_gets, *window_gets;
} part;

typedef struct {            /* rows [t, columns...] in a block */
    int64_t n, rows, capacity;
    const int32_t *source;
    const double *gain;
    double *block;
} table;

typedef struct {
    part *parts;
    int64_t n_parts;
    double *out;
    double t0, h;
    int64_t k, every, watch, done;
    double last;
    table channel, window;
    double *timed_seconds;
    int64_t timed, failed_part, failed_call, failed_kind, failed_status;
} run;

static inline int get(const group *g, void *component) {
    if (g->kind == REAL)
        return ((real_function)g->call)(component, g->references, (size_t)g->n, (double *)g->values);
    int *values = (int *)g->values;
    int status = ((int_function)g->call)(component, g->references, (size_t)g->n, values);
    for (int64_t j = 0; j < g->n; j++) g->out[j] = (double)values[j];
    return status;
}

static inline int set(const group *g, void *component, const double *out) {
    const int32_t *source = g->source;
    const int64_t n = g->n;
    if (g->kind == REAL) {
        double *values = (double *)g->values;
        for (int64_t j = 0; j < n; j++) values[j] = out[source[j]];
        for (int64_t j = 0; j < g->n_scaled; j++) values[g->scaled[j]] *= g->factor[j];
        return ((real_function)g->call)(component, g->references, (size_t)n, values);
    }
    int *values = (int *)g->values;
    for (int64_t j = 0; j < n; j++) values[j] = (int)out[source[j]];
    return ((int_function)g->call)(component, g->references, (size_t)n, values);
}

static int failed(run *r, int64_t i, int call, int64_t kind, int status) {
    r->failed_part = i;
    r->failed_call = call;
    r->failed_kind = kind;
    r->failed_status = status;
    return FAILED;
}

static inline int step_part(run *r, int64_t i, double t) {
    const part *p = &r->parts[i];
    int status;
    for (int64_t j = 0; j < p->n_sets; j++)
        if ((status = set(&p->sets[j], p->component, r->out)) > 1)
            return failed(r, i, CALL_SET, p->sets[j].kind, status);
    if ((status = p->step(p->component, t, r->h, 1)) > 1) return failed(r, i, CALL_STEP, REAL, status);
    for (int64_t j = 0; j < p->n_gets; j++)
        if ((status = get(&p->gets[j], p->component)) > 1)
            return failed(r, i, CALL_GET, p->gets[j].kind, status);
    return MORE;
}

static int add_row(run *r, table *rows, int windows, double t) {
    for (int64_t i = 0; i < r->n_parts; i++) {
        const part *p = &r->parts[i];
        const group *groups = windows ? p->window_gets : p->channel_gets;
        const int64_t n = windows ? p->n_window_gets : p->n_channel_gets;
        int status;
        for (int64_t j = 0; j < n; j++)
            if ((status = get(&groups[j], p->component)) > 1)
                return failed(r, i, CALL_GET, groups[j].kind, status);
    }
    double *row = rows->block + rows->rows * (rows->n + 1);
    row[0] = t;
    for (int64_t j = 0; j < rows->n; j++) {
        const double value = r->out[rows->source[j]];
        row[j + 1] = rows->gain[j] == 1.0 ? value : value * rows->gain[j];
    }
    rows->rows++;
    return MORE;
}

static double clock_cost(void) {    /* of one call of seconds() */
    double best = 1.0;
    for (int i = 0; i < 20; i++) {
        const double began = seconds(), took = seconds() - began;
        if (took < best) best = took;
    }
    return best;
}

EXPORT int gyrobench_run(run *r, int64_t k_end) {
    const double cost = clock_cost();
    const int64_t n = r->n_parts;
    const int channels = r->channel.n > 0;
    int64_t until_row = r->every - r->k % r->every;           /* steps to the next row of the channels */
    int64_t until_timed = (TIMED_FIRST + TIMED_EVERY - r->k % TIMED_EVERY) % TIMED_EVERY;
    while (r->k < k_end) {
        if (r->channel.rows == r->channel.capacity || r->window.rows == r->window.capacity) return FULL;
        const double t = r->t0 + (double)r->k * r->h;
        if (until_timed-- == 0) {
            until_timed = TIMED_EVERY - 1;
            r->timed++;
            for (int64_t i = 0; i < n; i++) {
                const double began = seconds();
                if (step_part(r, i, t)) return FAILED;
                r->timed_seconds[i] += seconds() - began - cost;
            }
        } else {
            for (int64_t i = 0; i < n; i++)
                if (step_part(r, i, t)) return FAILED;
        }
        r->k++;
        if (r->watch >= 0 && r->out[r->watch] != r->last) {
            r->last = r->out[r->watch];
            if (add_row(r, &r->window, 1, r->t0 + (double)r->k * r->h)) return FAILED;
        }
        if (--until_row == 0) {
            until_row = r->every;
            if (channels && add_row(r, &r->channel, 0, r->t0 + (double)r->k * r->h)) return FAILED;
        }
        if (r->done >= 0 && r->out[r->done] != 0.0) return DONE;
    }
    return MORE;
}
