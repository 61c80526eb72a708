/* The native engine: the loop of reference_engine.py on arrays of function pointers of FMI 2 and FMI 3 or, where LINKED
   is defined, on the values of the instances: system.h, written by linked_system.py, has the wires between them.

   For each part in execution order: set its inputs from `out`, doStep, get the outputs that others need into `out`.
   Same order and same arithmetic as the reference engine, so the records are equal bit for bit.  The structures are
   mirrored in native_engine.py and run_board.py.  Called in chunks: returns when k_end is reached, when a block of rows
   is full, when the done output is not 0, or when a call fails.  The status is written before each call, for the process
   that supervises this one: it says which call of which part did not return. */

#ifndef _WIN32
#define _POSIX_C_SOURCE 199309L
#endif
#include <fenv.h>
#include <stdbool.h>
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

enum { MORE = 0, DONE = 1, FULL = 2, FAILED = 3 };
enum { CALL_SET = 1, CALL_STEP = 15, CALL_GET = 16 };   /* the first and the last plus the code of the type; 0: none */
enum { TIMED_EVERY = 1009, TIMED_FIRST = 504 };
enum { NO_PROGRESS = 100, ENDED = 101, OUT_OF_RANGE = 102 }; /* beside the statuses of FMI */
enum { BLOCK = 4096 }; /* steps */
#define REST 1e-9 /* of a step: a remainder below it counts as done */
#define EXACT 9007199254740992.0 /* 2^53: a double holds every whole number up to it */

/* Types of FMI 2, then of FMI 3: code, C type, smallest and largest value (the list of program.py). */
#define WHOLE_TYPES(DO)                                                                                               \
    DO(1, int32_t, -2147483648.0, 2147483647.0) DO(2, int32_t, -2147483648.0, 2147483647.0)                           \
    DO(5, int8_t, -128.0, 127.0) DO(6, uint8_t, 0.0, 255.0) DO(7, int16_t, -32768.0, 32767.0)                         \
    DO(8, uint16_t, 0.0, 65535.0) DO(9, int32_t, -2147483648.0, 2147483647.0) DO(10, uint32_t, 0.0, 4294967295.0)     \
    DO(11, int64_t, -EXACT, EXACT - 1.0) DO(12, uint64_t, 0.0, EXACT - 1.0)
enum { REAL = 0, FLOAT64 = 3, FLOAT32 = 4, BOOLEAN3 = 13 };

typedef int (*step2_function)(void *, double, double, int);
typedef int (*linked_function)(void *, double, double); /* gyrobench_step and gyrobench_quick_step of instance.c */
typedef int (*finite_function)(void *); /* gyrobench_finite of instance.c */
typedef int (*get_state_function)(void *, void **); /* frees, too */
typedef int (*set_state_function)(void *, void *);
typedef int (*step3_function)(void *, double, double, bool, bool *, bool *, bool *, double *);
typedef int (*values2_function)(void *, const unsigned int *, size_t, void *);
typedef int (*values3_function)(void *, const unsigned int *, size_t, void *, size_t);

typedef struct {            /* one get or set call */
    int64_t kind, n_references, n;
    void (*call)(void);
    const unsigned int *references;
    void *values;
    double *numbers;        /* the values as doubles: `values` itself where the type is double */
    double *out;            /* get: where the values belong */
    const int32_t *source;  /* set: places in `out` */
    int64_t n_scaled;
    const int32_t *scaled;
    const double *factor;
    int64_t n_shifted;
    const int32_t *shifted;
    const double *offset;
} group;

typedef struct {
    void *component;
    void (*step)(void);
    int64_t fmi3;
    int64_t n_sets, n_gets, n_channel_gets, n_window_gets;
    group *sets, *gets, *channel_gets, *window_gets;
    void (*quick_step)(void), (*finite)(void), (*get_state)(void), (*set_state)(void), (*free_state)(void); /* linked */
    void *state;
} part;

typedef struct {            /* where the run is */
    int64_t k, channel_rows, window_rows, part, call;
} status;

typedef struct {            /* rows [t, columns...] in a block */
    int64_t n, capacity;
    const int32_t *source;
    const double *gain, *offset;
    double *block;
} table;

typedef struct {
    status *at;
    part *parts;
    int64_t n_parts;
    double *out;
    double t0, h;
    int64_t every, watch, done;
    double last;
    table channel, window;
    double *timed_seconds, *laps;  /* a value for each part */
    void *const *instances;
    int64_t n_delays;
    const int32_t *delayed, *origin; /* places in `out`: copied before each step */
    int64_t timed, failed_status, repeated; /* repeated: blocks of the linked form */
} run;

static inline int call(const group *g, void *component) {
    if (g->kind >= FLOAT64)
        return ((values3_function)g->call)(component, g->references, (size_t)g->n_references, g->values, (size_t)g->n);
    return ((values2_function)g->call)(component, g->references, (size_t)g->n_references, g->values);
}

static int to_doubles(const group *g) {
    switch (g->kind) {
    case FLOAT32:
        for (int64_t j = 0; j < g->n; j++) g->out[j] = (double)((const float *)g->values)[j];
        return MORE;
    case BOOLEAN3:
        for (int64_t j = 0; j < g->n; j++) g->out[j] = (double)((const bool *)g->values)[j];
        return MORE;
#define READ(code, type, low, high)                                                                                   \
    case code:                                                                                                        \
        for (int64_t j = 0; j < g->n; j++) {                                                                          \
            const double x = (double)((const type *)g->values)[j];                                                    \
            if (!(x >= low && x <= high)) return OUT_OF_RANGE;                                                        \
            g->out[j] = x;                                                                                            \
        }                                                                                                             \
        return MORE;
    WHOLE_TYPES(READ)
    }
    return MORE;
}

static int from_doubles(const group *g) {
    switch (g->kind) {
    case FLOAT32:
        for (int64_t j = 0; j < g->n; j++) ((float *)g->values)[j] = (float)g->numbers[j];
        return MORE;
    case BOOLEAN3:
        for (int64_t j = 0; j < g->n; j++) {
            const double x = g->numbers[j];
            if (!(x >= -2147483648.0 && x <= 2147483647.0)) return OUT_OF_RANGE;
            ((bool *)g->values)[j] = (int32_t)x != 0;
        }
        return MORE;
#define WRITE(code, type, low, high)                                                                                  \
    case code:                                                                                                        \
        for (int64_t j = 0; j < g->n; j++) {                                                                          \
            const double x = g->numbers[j];                                                                           \
            if (!(x >= low && x <= high)) return OUT_OF_RANGE;                                                        \
            ((type *)g->values)[j] = (type)x;                                                                         \
        }                                                                                                             \
        return MORE;
    WHOLE_TYPES(WRITE)
    }
    return MORE;
}

static inline int get(const group *g, void *component) {
    const int status = call(g, component);
    if (g->kind == REAL || g->kind == FLOAT64 || status > 1) return status; /* doubles are in `out` already */
    const int range = to_doubles(g);
    return range ? range : status;
}

static inline int set(const group *g, void *component, const double *out) {
    const int32_t *source = g->source;
    const int64_t n = g->n;
    double *numbers = g->numbers;
    for (int64_t j = 0; j < n; j++) numbers[j] = out[source[j]];
    for (int64_t j = 0; j < g->n_scaled; j++) numbers[g->scaled[j]] *= g->factor[j];
    for (int64_t j = 0; j < g->n_shifted; j++) numbers[g->shifted[j]] += g->offset[j];
    if (g->kind != REAL && g->kind != FLOAT64) {
        const int range = from_doubles(g);
        if (range) return range;
    }
    return call(g, component);
}

/* One communication step; where an FMU of FMI 3 returns early, on from there with the same inputs. */
static inline int do_step(const part *p, double t, double h) {
    if (!p->fmi3) return ((step2_function)p->step)(p->component, t, h, 1);
    const double end = t + h;
    for (double start = t, left = h;;) {
        bool event = false, ended = false, early = false;
        double last = end;
        const int status = ((step3_function)p->step)(p->component, start, left, true, &event, &ended, &early, &last);
        if (status > 1) return status;
        if (ended) return ENDED;
        if (early && !(last > start)) return NO_PROGRESS;
        left = end - last;
        if (!early || !(left > REST * h)) return status;
        start = last;
    }
}

/* OK and warning go on; a status that the standard does not know is a failure too */
static inline int failed(run *r, int status) {
    if ((unsigned)status <= 1u) return 0;
    r->failed_status = status;
    return 1;
}

/* One step of all parts; laps: when each was done, not NULL in a step that is timed; quick: nothing looks whether the
   numbers are finite. */
#ifdef LINKED
EXPORT const int gyrobench_linked = 1;
#define LAP(i) if (laps) laps[i] = seconds()
#include "system.h"
#else
EXPORT const int gyrobench_linked = 0;
static inline double watched(const run *r, void *const instances[]) { (void)instances; return r->out[r->watch]; }
static inline double done(const run *r, void *const instances[]) { (void)instances; return r->out[r->done]; }
static inline void take_outputs(void *const instances[], double *out) { (void)instances; (void)out; }

static inline int step_part(run *r, status *at, int64_t i, double t) {
    const part *p = &r->parts[i];
    at->part = i;
    for (int64_t j = 0; j < p->n_sets; j++) {
        at->call = CALL_SET + p->sets[j].kind;
        if (failed(r, set(&p->sets[j], p->component, r->out))) return FAILED;
    }
    at->call = CALL_STEP;
    if (failed(r, do_step(p, t, r->h))) return FAILED;
    for (int64_t j = 0; j < p->n_gets; j++) {
        at->call = CALL_GET + p->gets[j].kind;
        if (failed(r, get(&p->gets[j], p->component))) return FAILED;
    }
    return MORE;
}

static inline int step_all(run *r, status *at, void *const instances[], double t, double *laps, int quick) {
    (void)instances;
    (void)quick;
    for (int64_t j = 0; j < r->n_delays; j++) r->out[r->delayed[j]] = r->out[r->origin[j]];
    for (int64_t i = 0; i < r->n_parts; i++) {
        if (step_part(r, at, i, t)) return FAILED;
        if (laps) laps[i] = seconds();
    }
    return MORE;
}
#endif

static int add_row(run *r, table *rows, int64_t *count, int windows, double t) {
    for (int64_t i = 0; i < r->n_parts; i++) {
        const part *p = &r->parts[i];
        const group *groups = windows ? p->window_gets : p->channel_gets;
        const int64_t n = windows ? p->n_window_gets : p->n_channel_gets;
        r->at->part = i;
        for (int64_t j = 0; j < n; j++) {
            r->at->call = CALL_GET + groups[j].kind;
            if (failed(r, get(&groups[j], p->component))) return FAILED;
        }
    }
    double *row = rows->block + *count * (rows->n + 1);
    row[0] = t;
    for (int64_t j = 0; j < rows->n; j++) {
        const double value = r->out[rows->source[j]];
        row[j + 1] = rows->gain[j] == 1.0 ? value : value * rows->gain[j];
        if (rows->offset[j] != 0.0) row[j + 1] += rows->offset[j];
    }
    ++*count;
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

static int loop(run *r, void *const instances[], int64_t k_end, int quick) {
    status *const at = r->at;
    const double cost = clock_cost();
    const int channels = r->channel.n > 0;
    int64_t until_row = r->every - at->k % r->every;          /* steps to the next row of the channels */
    int64_t until_timed = (TIMED_FIRST + TIMED_EVERY - at->k % TIMED_EVERY) % TIMED_EVERY;
    while (at->k < k_end) {
        if (at->channel_rows == r->channel.capacity || at->window_rows == r->window.capacity) return FULL;
        const int timed = until_timed-- == 0;
        double began = timed ? seconds() : 0.0;
        const double t = r->t0 + (double)at->k * r->h;
        if (timed ? step_all(r, at, instances, t, r->laps, quick) : step_all(r, at, instances, t, NULL, quick))
            return FAILED;
        if (timed) {
            until_timed = TIMED_EVERY - 1;
            r->timed++;
            for (int64_t i = 0; i < r->n_parts; began = r->laps[i++]) r->timed_seconds[i] += r->laps[i] - began - cost;
        }
        const double now = r->t0 + (double)++at->k * r->h;
        if (r->watch >= 0 && watched(r, instances) != r->last) {
            r->last = watched(r, instances);
            take_outputs(instances, r->out);
            if (add_row(r, &r->window, &at->window_rows, 1, now)) return FAILED;
        }
        if (--until_row == 0) {
            until_row = r->every;
            take_outputs(instances, r->out);
            if (channels && add_row(r, &r->channel, &at->channel_rows, 0, now)) return FAILED;
        }
        if (r->done >= 0 && done(r, instances) != 0.0) return DONE;
    }
    return MORE;
}

#ifdef LINKED
/* Whether no number of a block can have been other than finite: one that comes out of finite ones raises a flag of the
   processor, which stays until it is cleared, and none is there at the end. */
static int all_finite(const run *r) {
    if (fetestexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW)) return 0;
    for (int64_t i = 0; i < r->n_parts; i++)
        if (!((finite_function)r->parts[i].finite)(r->parts[i].component)) return 0;
    return 1;
}

static int keep_states(const run *r) {
    for (int64_t i = 0; i < r->n_parts; i++) {
        part *p = &r->parts[i];
        if (((get_state_function)p->get_state)(p->component, &p->state)) return 0;
    }
    return 1;
}

static void go_back(const run *r) {
    for (int64_t i = 0; i < r->n_parts; i++) {
        const part *p = &r->parts[i];
        ((set_state_function)p->set_state)(p->component, p->state);
    }
}

/* The loop in blocks of quick steps.  Where a flag is raised or a step fails, a block is gone through again from its
   first step with a look at each number: that finds part and step, or that the flag was harmless (a number that no
   output follows).  After a harmless flag some blocks are checked at once, each time twice as many. */
static int loop_in_blocks(run *r, void *const instances[], int64_t k_end) {
    int64_t wary = 1, checked = 0; /* blocks to be checked at once: after the next harmless flag, still now */
    for (;;) {
        const int64_t end = k_end - r->at->k < BLOCK ? k_end : r->at->k + BLOCK;
        const status before = *r->at;
        const double last = r->last;
        int code;
        if (checked > 0 || !keep_states(r)) {
            checked--;
            code = loop(r, instances, end, 0);
        } else {
            feclearexcept(FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW);
            code = loop(r, instances, end, 1);
            if (code == FAILED || !all_finite(r)) {
                go_back(r);
                *r->at = before;
                r->last = last;
                r->repeated++;
                code = loop(r, instances, end, 0);
                checked = wary;
                wary = 2 * wary;
            }
        }
        if (code != MORE || r->at->k >= k_end) return code;
    }
}
#endif

EXPORT int gyrobench_run(run *r, int64_t k_end) {
#ifdef LINKED
    const int status = loop_in_blocks(r, r->instances, k_end);
    for (int64_t i = 0; i < r->n_parts; i++)
        if (r->parts[i].state) ((get_state_function)r->parts[i].free_state)(r->instances[i], &r->parts[i].state);
#else
    const int status = loop(r, r->instances, k_end, 0);
#endif
    take_outputs(r->instances, r->out);
    return status;
}
