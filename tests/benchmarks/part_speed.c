/* Times the steps of one native FMU: inputs set, step, outputs read, through the FMI 2.0 functions alone. */
#include <stddef.h>
#include <time.h>

typedef int (*Set)(void *, const unsigned *, size_t, const double *);
typedef int (*Get)(void *, const unsigned *, size_t, double *);
typedef int (*Step)(void *, double, double, int);

/* Processor time, s: other work on the machine takes none of it. */
static double now(void) { return (double)clock() / CLOCKS_PER_SEC; }

#if defined(__GNUC__)
__attribute__((visibility("default")))
#endif
/* Seconds for n steps of h from step number `from` on; row k % rows of the inputs before step k.  < 0: status. */
double time_steps(void *part, Set set, Get get, Step step, const unsigned *in, size_t n_in, const double *inputs,
                  size_t rows, const unsigned *out, size_t n_out, double *outputs, double h, long from, long n) {
    const double begin = now();
    for (long k = from; k < from + n; k++) {
        int status = n_in ? set(part, in, n_in, inputs + (size_t)k % rows * n_in) : 0;
        if (!status) status = step(part, (double)k * h, h, 1);
        if (!status) status = get(part, out, n_out, outputs);
        if (status) return -(double)status;
    }
    return now() - begin;
}
