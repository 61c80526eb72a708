/* The floor for a tumble run: the equations of the standard tumble system in one hand-written loop.
 *
 * Same physics as the six parts (site constants, rate table, float equation exact for held inputs,
 * Gauss-Markov and white drift, pickoff noise, PI rebalance with limit, measured current with noise, trapezoid
 * window means with their spread), same plan (two dwells, two turns), no FMI, no parameters, no checks.
 * Prints windows, a checksum and the CPU seconds it took.
 */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static uint64_t counter = 12345;
static double uniform(void) {
    uint64_t z = (counter += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return ((double)((z ^ (z >> 31)) >> 11) + 0.5) * 0x1p-53;
}
static double normal(void) { /* Marsaglia polar method */
    static double spare;
    static int have;
    double u, v, s;
    if (have) { have = 0; return spare; }
    do {
        u = 2.0 * uniform() - 1.0;
        v = 2.0 * uniform() - 1.0;
        s = u * u + v * v;
    } while (s >= 1.0);
    s = sqrt(-2.0 * log(s) / s);
    spare = v * s;
    have = 1;
    return u * s;
}

typedef struct { double face[3][3], rate, dwell, window; } Phase;

int main(int argc, char **argv) {
    const double turn = 6.283185307179586, deg_h = 4.84813681109536e-6, h = 1e-3, earth = 7.2921159e-5, g = 9.80665;
    const double latitude = 45.75 * turn / 360.0, c = cos(latitude), s = sin(latitude), rate = -10.0 * earth;
    const double fraction = argc > 1 ? atof(argv[1]) : 1.0; /* of the full plan */
    const double H = 0.2, J = 2e-4, C = 0.2, K_sg = 10.0, k = 17200.0 * deg_h, i_max = 0.15;
    const double K_p = 20.0 / (K_sg * H * k), K_i = 200.0 / (K_sg * H * k);
    const double white = 0.0178 * deg_h / sqrt(h), markov = 0.002 * deg_h, decay = exp(-h / 300.0);
    const double fresh = markov * sqrt(1.0 - decay * decay), pickoff = 5e-8 / sqrt(h), meter = 1e-7 / sqrt(h);
    const double D[9] = {-.3 * deg_h, -.9 * deg_h, .1 * deg_h, -.7 * deg_h, -.05 * deg_h, .04 * deg_h, -.03 * deg_h, -.02 * deg_h, -.15 * deg_h};
    const double e = exp(-C / J * h), p1 = (1.0 - e) * J / C; /* exact step of J r' = -C r + T, b' = r */
    const double tb = (h - p1) / C, tr = (1.0 - e) / C;
    Phase plan[4] = {
        {{{1, 0, 0}, {0, c, s}, {0, -s, c}}, 0.0, 1200.0, 120.0},
        {{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}, rate, turn / -rate, turn / -rate / 72.0},
        {{{1, 0, 0}, {0, -c, -s}, {0, s, -c}}, 0.0, 1200.0, 120.0},
        {{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, rate, turn / -rate, turn / -rate / 72.0},
    };
    double b = 0.0, r = 0.0, q = 0.0, i = 0.0, wander = markov * normal(), sum = 0.0;
    long windows = 0, steps = 0;
    struct timespec t0, t1;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t0);
    for (int n = 0; n < 4; n++) {
        const Phase *p = &plan[n];
        long total = (long)(p->dwell * fraction / h + 0.5), every = (long)(p->window * fraction / h + 0.5), in = 0;
        double area = 0.0, squares = 0.0, all = 0.0, x0 = 0.0, before = 0.0;
        for (long m = 0; m < total; m++) {
            const double angle = p->rate * ((m + 1) * h), ca = cos(angle), sa = sin(angle);
            const double wy = earth * 0.0, wz = earth + p->rate, fx = sa * g * c, fy = ca * g * c, fz = g * s;
            const double w[3] = {sa * wy, ca * wy, wz}, f[3] = {fx, fy, fz};
            double om[3], sf[3], al[3];
            for (int a = 0; a < 3; a++) {
                om[a] = p->face[a][0] * w[0] + p->face[a][1] * w[1] + p->face[a][2] * w[2];
                al[a] = (p->face[a][0] * w[1] - p->face[a][1] * w[0]) * p->rate;
                sf[a] = p->face[a][0] * f[0] + p->face[a][1] * f[1] + p->face[a][2] * f[2];
            }
            const double x = -sf[0] / g, y = -sf[1] / g, z = -sf[2] / g;
            wander = decay * wander + fresh * normal();
            const double drift = D[0] + D[1] * x + D[2] * y + D[3] * z + D[4] * x * x + D[5] * z * z + D[6] * x * y
                               + D[7] * y * z + D[8] * x * z + wander + white * normal();
            const double torque = H * (om[0] * cos(b) - om[2] * sin(b) - drift - k * i) - J * al[1];
            b += p1 * r + tb * torque;
            r = e * r + tr * torque;
            double u = K_sg * b + pickoff * normal();
            u = u < -0.1 ? -0.1 : u > 0.1 ? 0.1 : u;
            q += h * u;
            i = K_p * u + K_i * q;
            i = i < -i_max ? -i_max : i > i_max ? i_max : i;
            const double read = i + meter * normal();
            if (in == 0) x0 = read;
            const double d = read - x0;
            area += 0.5 * (before + d);
            before = d;
            all += d;
            squares += d * d;
            if (++in == every) {
                sum += x0 + area / in + 1e-9 * sqrt((squares - all * all / in) / (in - 1));
                windows++;
                in = 0;
                area = squares = all = before = 0.0;
            }
            steps++;
        }
    }
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t1);
    printf("{\"windows\": %ld, \"steps\": %ld, \"sum\": %.6g, \"seconds\": %.6f}\n", windows, steps, sum,
           (t1.tv_sec - t0.tv_sec) + 1e-9 * (t1.tv_nsec - t0.tv_nsec));
    return 0;
}
