/* A system in a web page: the same component as in its FMU, with the few calls that page.js makes. */
#include "instance.c"

#define EXPORT(name) __attribute__((export_name(#name)))

static void say(const Face *face, const char *message) { (void)face; (void)message; } /* the page asks for it */

EXPORT(create) Instance *page_create(void) {
    Face face = {.say = say};
    return new_instance("page", &face);
}
EXPORT(rows) double *page_rows(unsigned n) { return (double *)malloc(n * (N_Y + 1) * sizeof(double)); }
EXPORT(renew) void page_renew(Instance *m) { reset(m); }
EXPORT(set) void page_set(Instance *m, unsigned reference, double x) {
    value(&m->part)[reference] = x;
    m->part.n.dirty = 1.0;
}
EXPORT(reason) const char *page_reason(Instance *m) { return m->part.message; }

/* The time and the outputs; out has 1 + N_Y places. */
static void row(Instance *m, double *out) {
    *out = m->part.n.v.t;
    memcpy(out + 1, value(&m->part) + Y0, N_Y * sizeof(double));
}

/* The end of initialization: 0, or 1 with a reason. */
EXPORT(start) int page_start(Instance *m, double *out) {
    if (run(m)) return 1;
    row(m, out);
    return 0;
}

/* n rows, each ``every`` steps of the system after the one before; the number of rows made, fewer where a part fails. */
EXPORT(advance) unsigned page_advance(Instance *m, unsigned n, unsigned every, double *out) {
    unsigned i;
    for (i = 0; i < n; i++, out += N_Y + 1) {
        if (step(m, m->part.n.v.t, every * STEP)) return i;
        row(m, out);
    }
    return n;
}
