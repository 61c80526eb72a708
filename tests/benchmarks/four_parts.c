/* The floor for the masters that run four trivial parts: the equations of bench/ in one hand-written loop.
 *
 * PI controller -> actuator lag -> damped plant -> sensor lag -> back, every part exact for an input held over the step,
 * in the order actuator, plant, sensor, controller; two channels every ten steps.
 * Prints the microseconds of processor time a step and the plant's position at 1 s.
 */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

int main(int argc, char **argv) {
    const long steps = argc > 1 ? atol(argv[1]) : 10000000, rows = steps / 10;
    const double h = 1e-3, K_p = 2.0, K_i = 5.0, reference = 1.0, w = 10.0, z = 0.5;
    const double lag = 1.0 - exp(-h / 0.02), late = 1.0 - exp(-h / 0.005);
    const double wd = w * sqrt(1.0 - z * z), e = exp(-z * w * h), c = e * cos(wd * h), s = e * sin(wd * h) / wd;
    double force = 0.0, x = 0.0, v = 0.0, y = 0.0, q = 0.0, u = K_p * reference;
    double *record = malloc((size_t)(rows + 1) * 3 * sizeof *record);
    struct timespec t0, t1;
    if (!record) return 1;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t0);
    for (long k = 1; k <= steps; k++) {
        force += lag * (u - force);
        const double d = x - force, before = v;
        x = force + (c + z * w * s) * d + s * before;
        v = (c - z * w * s) * before - w * w * s * d;
        y += late * (x - y);
        q += h * (reference - y);
        u = K_p * (reference - y) + K_i * q;
        if (k % 10 == 0) {
            double *row = record + 3 * (k / 10 - 1);
            row[0] = (double)k * h;
            row[1] = x;
            row[2] = u;
        }
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t1);
    const double seconds = (double)(t1.tv_sec - t0.tv_sec) + 1e-9 * (double)(t1.tv_nsec - t0.tv_nsec);
    printf("{\"us\": %.6f, \"at_1s\": %.9g}\n", 1e6 * seconds / (double)steps, rows >= 100 ? record[3 * 99 + 1] : 0.0);
    free(record);
    return 0;
}
