/* The fixed part of every native component: numbers, noise, integration, stepping.
 *
 * model.c defines `Vars` (every variable of the part, all double, in the order of the value references),
 * the counts and the tables used here, includes this file, and goes on with the equations.  Each operation below
 * stands in the same order in component.py, integration.py and numerics.py of gyrobench/component: bit for bit.
 */
#include "functions.h"
#define CAN_BE_LINKED /* see instance.c */

typedef struct {
    Vars v;
#if N_X > 0
    double phi[N_X][N_X]; /* phi1(h A), column after column */
#endif
    double phi_h; /* the h it was made for */
    double drawn; /* the h of the last samples of noise, 0 before the first */
    double running, dirty;
} Numbers; /* all that decides the future */

#if N_X > 0
typedef double Square[N_X][N_X];
#endif

typedef struct { /* what follows from the numbers, kept because it seldom changes */
    double step, largest, h, root; /* a communication step, cut in n internal steps h; sqrt(h) */
    int held; /* h is of rounding size: the last samples of noise hold */
    int n, keyed; /* keyed: what follows belongs to the values */
    int n_drawn; /* the streams that are drawn in steps; of each: where its sample stands, whether it is a density */
    struct { int sample, density; double size; uint64_t key; } drawn[N_STREAMS + 1];
    int used_first; /* the numbers of a step that were made last for ports of which each is made where it is read */
    double used_tick, used_p[LANES], used[LANES];
    uint64_t first;
    double ahead[AHEAD * (N_STREAMS + 1)]; /* size times normal number of the counts first, first + 1, ...: rows of n_drawn */
    double seen[N_FOLLOWED > 0 ? N_FOLLOWED : 1]; /* what the outputs were last made from, while `settled` */
#if N_X > 0
    int phi_known; /* phi was made from the matrix z */
    Square z;
#endif
    int settled, changes, anew; /* changes: steps since the outputs were last found as they were; anew: made in this step */
} Kept;

typedef struct {
    Numbers n;
    Kept kept;
    int failed;
    char name[128];
    char message[768];
} Part;

static inline void start(Part *part); /* inline: a part without states does not use all of them */
static inline void flow(Part *part);
static inline void outputs(Part *part);
static inline void ticks(Part *part);
static inline void flow_d(Part *part, Vars *seed);
static inline void outputs_d(Part *part, Vars *seed);

static double *value(Part *p) { return (double *)&p->n.v; }

/* ------------------------------------------------------------------------------------- refusals */
static COLD void vfail(Part *p, const char *format, va_list a) {
    char text[512];
    if (p->failed) return; /* the first reason is the reason */
    vsnprintf(text, sizeof text, format, a);
    snprintf(p->message, sizeof p->message, "%s: %s", p->name, text);
    p->failed = 1;
}

static COLD void fail(Part *p, const char *format, ...) {
    va_list a;
    va_start(a, format);
    vfail(p, format, a);
    va_end(a);
}

/* An index that is known only when it runs. */
static inline int at(Part *p, int i, int n) {
    if (i >= 0 && i < n) return i;
    fail(p, "an index is %d, not in 0 to %d (t = %.9g s)", i, n - 1, p->n.v.t);
    return 0;
}

/* ------------------------------------------------------------------------------------------ noise */
/* The streams that are drawn in steps: those of ports that are not off, with a sample of 0 already.  Sizes and seed do
   not change while the part runs. */
static COLD void prepare_noise(Part *p) {
    p->kept.keyed = 1;
    p->kept.n_drawn = 0;
    p->kept.first = (uint64_t)1 << 63; /* none made: far from every count */
    p->kept.used_tick = -1.0;
#if N_PORTS > 0
    const double *a = value(p);
    int i, j;
    for (i = 0; i < N_PORTS; i++)
        for (j = 0; j < ports[i].streams; j++) {
            const double size = a[ports[i].parameter];
            if (ports[i].per == ONCE || (size == 0.0 && a[ports[i].sample + j] == 0.0)) continue;
            p->kept.drawn[p->kept.n_drawn].sample = ports[i].sample + j;
            p->kept.drawn[p->kept.n_drawn].density = ports[i].per == PER_SECOND;
            p->kept.drawn[p->kept.n_drawn].size = size;
            p->kept.drawn[p->kept.n_drawn].key = key_of((uint64_t)p->n.v.seed, ports[i].stream + j);
            p->kept.n_drawn++;
        }
#endif
}

static void make_noise(Part *p, uint64_t count) {
    double numbers[AHEAD];
    const int n = p->kept.n_drawn;
    int i, k;
    for (i = 0; i < n; i++) {
        const double size = p->kept.drawn[i].size;
        if (size != 0.0) normals(p->kept.drawn[i].key, count, numbers);
        for (k = 0; k < AHEAD; k++) p->kept.ahead[k * n + i] = size != 0.0 ? size * numbers[k] : 0.0;
    }
    p->kept.first = count;
}

static COLD void draw_start(Part *p) { /* what is drawn once, and the first samples of what is drawn per step */
#if N_PORTS > 0
    double *a = value(p), numbers[AHEAD];
    int i, j;
    for (i = 0; i < N_PORTS; i++)
        for (j = 0; ports[i].per != PER_SECOND && j < ports[i].streams; j++) {
            const double size = a[ports[i].parameter];
            if (size != 0.0) normals(key_of((uint64_t)p->n.v.seed, ports[i].stream + j), 0, numbers);
            a[ports[i].sample + j] = size != 0.0 ? size * numbers[0] : 0.0;
        }
#endif
    p->kept.keyed = 0;
    p->kept.used_tick = -1.0;
}

#if N_STREAMS > 0
/* Sample k of a port of which each is made where it is read; some of one step are read side by side. */
static inline double on_use(Part *p, double size, int stream, int k) {
    const int first = stream + k / LANES * LANES, i = k % LANES;
    if (size == 0.0) return 0.0;
    if (p->kept.used_first != first || p->kept.used_tick != p->n.v.tick) {
        side_by_side((uint64_t)p->n.v.seed, first, (uint64_t)(int64_t)p->n.v.tick, p->kept.used_p, p->kept.used);
        p->kept.used_first = first;
        p->kept.used_tick = p->n.v.tick;
    }
    return size * (fabs(p->kept.used_p[i] - 0.5) <= 0.425 ? p->kept.used[i] : quantile_rare(p->kept.used_p[i]));
}
#endif

static inline void draw(Part *p) { /* the samples of an internal step */
#if N_PORTS > 0
    const uint64_t count = (uint64_t)(int64_t)p->n.v.tick;
    const double *ahead, by[] = {1.0, p->kept.root};
    int i, n;
    if (p->kept.held) return;
    if (!p->kept.keyed) prepare_noise(p);
    n = p->kept.n_drawn;
    if (count - p->kept.first >= AHEAD) make_noise(p, count); /* unsigned: before the first too */
    ahead = p->kept.ahead + (count - p->kept.first) * n;
    for (i = 0; i < n; i++)
        value(p)[p->kept.drawn[i].sample] = ahead[i] / by[p->kept.drawn[i].density];
#else
    (void)p;
    (void)prepare_noise;
    (void)make_noise;
    (void)side_by_side;
    (void)quantile_rare;
#endif
}

#if N_X > 0
#include "integration.h"
#endif

/* --------------------------------------------------------------------------------------- stepping */
static COLD int told_finite(Part *p, int from, int n, const char *what) {
    const double *a = value(p);
    int i;
    for (i = from; i < from + n; i++)
        if (!isfinite(a[i])) {
            fail(p, "%s %s is %g at t = %.9g s", what, names[i], plain(a[i]), p->n.v.t);
            return 0;
        }
    return 1;
}

static COLD int tell_finite(Part *p) { /* all that the equations write, but for memories */
    int k, ok = told_finite(p, Y0, N_Y, "output") && told_finite(p, X0, N_X, "state");
    for (k = 0; ok && k < N_WATCHED; k++) ok = told_finite(p, watched[k].from, watched[k].n, "discrete");
    return ok;
}

/* The outputs, unless all that they follow from is as it was: 1 when they were made anew. */
static inline int renew(Part *p) {
#if N_FOLLOWED >= 0
    const double *a = value(p);
    int i = 0;
    if (p->kept.settled) {
        while (i < N_FOLLOWED && memcmp(&a[followed[i]], &p->kept.seen[i], sizeof *a) == 0) i++; /* tells 0 from -0 */
        if (i == N_FOLLOWED) {
            p->kept.changes = 0;
            return 0;
        }
        p->kept.settled = 0;
    }
    if (p->kept.changes++ % PATIENCE == 0) { /* what has changed in this step is likely to change in the next */
        for (i = 0; i < N_FOLLOWED; i++) p->kept.seen[i] = a[followed[i]];
        p->kept.settled = 1;
    }
#endif
    outputs(p);
    if (p->failed) p->kept.settled = 0;
    return 1;
}

static COLD void begin(Part *p, const char *name) { /* as instantiated */
    memset(p, 0, sizeof *p);
    snprintf(p->name, sizeof p->name, "%s", name ? name : "");
    memcpy(value(p), starts, N_REFERENCES * sizeof(double));
    p->n.dirty = 1.0;
}

static NEVER_INLINE void evaluate_start(Part *p) {
    p->n.v.tick = 0.0;
    p->kept.settled = 0;
    draw_start(p);
    start(p);
    if (!p->failed) outputs(p);
    p->n.dirty = 0.0;
}

static NEVER_INLINE void refresh(Part *p) {
    if (p->n.dirty == 0.0) return;
    if (p->n.running != 0.0) {
        p->kept.settled = 0;
        outputs(p);
        p->n.dirty = 0.0;
    } else {
        evaluate_start(p);
    }
}

static COLD void check_bounds(Part *p, int end) { /* of parameters, inputs, states before a place */
    static const char *const words[] = {">=", "<=", ">", "<"};
    const double *a = value(p);
    int i, k = 0;
    for (i = 0; i < end; i++) {
        const char *what = i < U0 ? "parameter" : i < Y0 ? "input" : "state";
        if (i < Y0 || i >= X0) {
            if (!isfinite(a[i])) {
                fail(p, "%s %s = %g %s must be finite", what, names[i], plain(a[i]), unit_names[i]);
                return;
            }
            for (; k < N_BOUNDS && bounds[k].reference < i; k++) {}
            for (; k < N_BOUNDS && bounds[k].reference == i; k++) {
                const double b = bounds[k].limit;
                const int kind = bounds[k].kind;
                const int ok = kind == 0 ? a[i] >= b : kind == 1 ? a[i] <= b : kind == 2 ? a[i] > b : a[i] < b;
                if (!ok) {
                    fail(p, "%s %s = %g %s must be %s %g", what, names[i], a[i], unit_names[i], words[kind], b);
                    return;
                }
            }
        }
    }
}

static COLD void initialize(Part *p, double t0) {
    p->n.v.t = p->n.v.step_start = p->n.v.step_end = t0;
    check_bounds(p, DX0);
    if (p->failed) return;
    evaluate_start(p);
    if (!p->failed && tell_finite(p)) p->n.running = 1.0;
}

/* Parameters have been set between steps: makes anew what the start makes of them alone.  room: for the numbers as they
   are.  Where it fails, the numbers are to be given up. */
static COLD void tune(Part *p, Numbers *room) {
    double *const a = value(p);
    int i;
    check_bounds(p, U0);
    *room = p->n;
    for (i = X0; i < N_REFERENCES; i++) a[i] = starts[i];
    if (!p->failed) start(p);
    for (i = 0; i < N_DERIVED; i++) ((double *)&room->v)[derived[i]] = a[derived[i]];
    p->n = *room;
    p->n.phi_h = 0.0;
    p->n.dirty = 1.0;
    p->kept.settled = 0;
}

static inline int can_step(Part *p, double t, double step) {
    if (!(step > 0.0 && (t + step) * 0.0 == 0.0)) { /* both finite */
        fail(p, "a step must be positive and finite, not %g s", plain(step));
        return 0;
    }
    p->n.v.t = t;
    return all_finite(value(p) + U0, N_U) || told_finite(p, U0, N_U, "input");
}

/* Cuts a step that is not as long as the last one; 0 where it cannot be made. */
static NEVER_INLINE int cut_step(Part *p, double t, double step, double largest) {
    int n;
    if (!can_step(p, t, step)) return 0;
    n = (int)ceil(step / largest - 1e-9);
    p->kept.n = n < 1 ? 1 : n;
    p->kept.h = step / p->kept.n;
    p->kept.root = sqrt(p->kept.h);
    p->kept.held = p->kept.h < ROUNDING * p->n.drawn;
    if (!p->kept.held) p->n.drawn = p->kept.h;
    p->kept.step = step;
    p->kept.largest = largest;
    return 1;
}

/* A step in the linked form of a system: its inputs are outputs of parts, which have checked them, but for the first,
   before which outputs may follow inputs that came after the end of initialization.  Nothing looks whether the numbers
   are finite: linked_step does, or the engine after a block of steps.  Returns 0, or 3 as FMI does.  In the form for newer
   processors floor is one instruction, and an operation leaves its operands where they are: a tenth quicker. */
BY_PROCESSOR static NEVER_INLINE int quick_step(Part *p, double t, double step) {
    const double largest = LARGEST_STEP(p, step);
    double h, end;
    int k = 0, n;
    if ((step != p->kept.step || largest != p->kept.largest) && !cut_step(p, t, step, largest)) return 3;
    n = p->kept.n;
    h = p->kept.h;
    end = t + h;
    p->n.v.h = h;
    p->n.v.t = t;
    p->n.v.step_start = t;
    p->n.v.step_end = n == 1 ? end : t + n * h;
    for (;;) {
        p->n.v.tick = p->n.v.tick + 1.0;
        draw(p);
#if N_X > 0
        advance(p, h);
#endif
        p->n.v.t = end;
        ticks(p);
        if (p->failed) return 3;
        if (++k == n) break;
        p->n.v.t = t + k * h;
        end = t + (k + 1) * h;
    }
    p->kept.anew = renew(p);
    p->n.dirty = 0.0;
    return p->failed ? 3 : 0;
}

/* The same; a number that is not finite fails. */
static inline int linked_step(Part *p, double t, double step) {
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    int k;
    if (quick_step(p, t, step)) return 3;
    if (p->kept.anew || N_X > 0) add_up(value(p) + Y0, DX0 - Y0, sum); /* outputs and states */
    for (k = 0; k < N_STEPPED; k++) add_up(value(p) + stepped[k].from, stepped[k].n, sum);
    return (finite_sum(sum) || tell_finite(p)) ? 0 : 3;
}

static inline int do_step(Part *p, double t, double step) { return can_step(p, t, step) ? linked_step(p, t, step) : 3; }
