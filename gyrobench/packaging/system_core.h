/* A system of native parts as one component: the same interface as core.h, for instance.c and the FMI faces.
 *
 * model.c defines `Vars` (the values that are exposed: parameters, inputs, outputs), `Parts` (the parts themselves), the
 * counts and tables used here, the wires, and includes this file.  The order of all operations is that of the engines
 * (gyrobench/engine/reference_engine.py): initial outputs are propagated before and after the end of initialization, a
 * communication step is one or several steps of the system, each at t0 + k STEP.
 */
#undef CAN_BE_LINKED /* the parts are, here */

typedef struct {
    Vars v;
    double running, dirty, t0, steps;
    Parts parts;
} Numbers; /* all that decides the future */

typedef struct { double step; int settled, keyed; } Kept;

typedef struct {
    Numbers n;
    Kept kept;
    int failed;
    char name[128];
    char message[1024];
} Part;

static double *value(Part *p) { return p->n.v.x; }

static COLD void vfail(Part *p, const char *format, va_list a) {
    char text[896];
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

static int broken(Part *p) { /* whether a part has failed */
    const char *why = reason(&p->n.parts);
    if (why) fail(p, "%s", why);
    return p->failed;
}

static COLD void propagate(Part *p) { /* outputs to inputs in execution order, until nothing changes */
    double before[N_WIRED] = {0.0}, after[N_WIRED] = {0.0};
    int pass;
    read_all(&p->n.parts);
    for (pass = 0; pass < N_SLOTS + 1 && !broken(p); pass++) {
        take_wired(&p->n.parts, before);
        write_and_read_all(&p->n.parts);
        take_wired(&p->n.parts, after);
        if (memcmp(before, after, sizeof before) == 0) break;
    }
}

static COLD void evaluate_start(Part *p) {
    begin_parts(&p->n.parts, p->n.v.t);
    set_parameters(&p->n.parts, value(p));
    set_inputs(&p->n.parts, value(p));
    propagate(p);
    if (!p->failed) get_outputs(&p->n.parts, value(p));
    p->n.dirty = 0.0;
}

/* Outputs follow inputs at the next step only, once the system runs. */
static void refresh(Part *p) {
    if (p->n.dirty != 0.0 && p->n.running == 0.0) evaluate_start(p);
    p->n.dirty = 0.0;
}

static int inputs_are_finite(Part *p) {
    int i;
    for (i = U0; i < U0 + N_U; i++)
        if (!isfinite(value(p)[i])) fail(p, "input %s is %g at t = %.9g s", names[i], plain(value(p)[i]), p->n.v.t);
    return !p->failed;
}

static COLD void initialize(Part *p, double t0) {
    p->n.v.t = p->n.t0 = t0;
    p->n.steps = 0.0;
    if (!inputs_are_finite(p)) return;
    evaluate_start(p);
    if (p->failed) return;
    initialize_parts(&p->n.parts, t0);
    if (broken(p)) return;
    propagate(p);
    if (p->failed) return;
    get_outputs(&p->n.parts, value(p));
    p->n.running = 1.0;
}

/* Parameters have been set between steps, see core.h: each part takes its own. */
static COLD void tune(Part *p, Numbers *room) {
    tune_parts(&p->n.parts, &room->parts, value(p));
    (void)broken(p);
}

static void proceed(Part *p, double t, double step) {
    const double expected = p->n.t0 + p->n.steps * STEP, n = floor(step / STEP + 0.5);
    double k;
    if (step > 0.0 && step <= ROUNDING * STEP) return; /* rounding of a master that sums up the time: no step */
    if (!(n >= 1.0 && fabs(step - n * STEP) <= 1e-6 * STEP)) {
        fail(p, "a step of %.9g s: it must be a multiple of the system's step of %.9g s", plain(step), STEP);
        return;
    }
    if (!(fabs(t - expected) <= 0.5 * STEP)) {
        fail(p, "a step from t = %.9g s, but the last one ended at %.9g s", plain(t), expected);
        return;
    }
    set_inputs(&p->n.parts, value(p));
    for (k = 0.0; k < n; k = k + 1.0) {
        if (step_parts(&p->n.parts, p->n.t0 + p->n.steps * STEP, STEP) >= 0) {
            broken(p);
            return;
        }
        p->n.steps = p->n.steps + 1.0;
    }
    p->n.v.t = p->n.t0 + p->n.steps * STEP;
    get_outputs(&p->n.parts, value(p));
    p->n.dirty = 0.0;
}

static int do_step(Part *p, double t, double step) {
    if (inputs_are_finite(p)) proceed(p, t, step);
    return p->failed ? 3 : 0;
}

static COLD void begin(Part *p, const char *name) { /* as instantiated */
    memset(p, 0, sizeof *p);
    snprintf(p->name, sizeof p->name, "%s", name ? name : "");
    memcpy(value(p), starts, N_REFERENCES * sizeof(double));
    p->n.dirty = 1.0;
}

static void flow_d(Part *p, Vars *seed) {
    (void)seed;
    fail(p, "directional derivatives are not offered");
}
static void outputs_d(Part *p, Vars *seed) { (void)p; (void)seed; }
