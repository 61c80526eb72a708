/* How the states of a native component advance: matrix function phi1(h A), midpoint, Runge-Kutta.
 *
 * Included by core.h for a part with states; the order of the operations is that of gyrobench/component/integration.py.
 */
#ifdef __GNUC__
typedef double pair __attribute__((vector_size(16), aligned(8), may_alias));
#endif

static OF_MATRIX void product(Square a, Square b, Square out) {
    int i, j, k;
    for (i = 0; i < N_X; i++)
        for (j = 0; j < N_X; j++) {
            double total = 0.0;
            for (k = 0; k < N_X; k++) total = total + a[i][k] * b[k][j];
            out[i][j] = total;
        }
}

static OF_MATRIX void phi1(Square z, Square out) {
    Square g;
    double norm = 0.0, scale = 1.0;
    int i, j, k, s = 0;
    for (i = 0; i < N_X; i++) {
        double row = 0.0;
        for (j = 0; j < N_X; j++) row = row + fabs(z[i][j]);
        if (row > norm) norm = row;
    }
    if (!(norm < 1e300)) norm = 0.0; /* not finite: found by the check of the states */
    while (norm > 0.5) { norm = norm * 0.5; scale = scale * 0.5; s++; }
    for (i = 0; i < N_X; i++)
        for (j = 0; j < N_X; j++) { z[i][j] = z[i][j] * scale; out[i][j] = i == j ? 1.0 : 0.0; }
    for (k = 18; k > 1; k--) {
        product(z, out, g);
        for (i = 0; i < N_X; i++)
            for (j = 0; j < N_X; j++) out[i][j] = g[i][j] / k + (i == j ? 1.0 : 0.0);
    }
    for (k = 0; k < s; k++) {
        Square q;
        product(z, out, g);
        for (i = 0; i < N_X; i++)
            for (j = 0; j < N_X; j++) g[i][j] = 0.5 * g[i][j] + (i == j ? 1.0 : 0.0);
        product(out, g, q);
        memcpy(out, q, sizeof q);
        for (i = 0; i < N_X; i++)
            for (j = 0; j < N_X; j++) z[i][j] = 2.0 * z[i][j];
    }
}

static OF_MATRIX void jacobian(Part *p, Square a) {
    int i, j;
    for (j = 0; j < N_X; j++) {
        Vars seed;
        memset(&seed, 0, sizeof seed);
        ((double *)&seed)[X0 + j] = 1.0;
        flow_d(p, &seed);
        for (i = 0; i < N_X; i++) a[i][j] = ((double *)&seed)[DX0 + i];
    }
}

static inline void advance(Part *p, double h) {
    double *x = value(p) + X0, *f = value(p) + DX0;
    int i, j;
#if RK4_SUBSTEPS > 0
    double t = p->n.v.t, dt = h / RK4_SUBSTEPS, x0[N_X], k1[N_X], k2[N_X], k3[N_X];
    for (j = 0; j < RK4_SUBSTEPS; j++) { /* copied one by one, as flow has stored them: see SCALAR in compiler.py */
        p->n.v.t = t + j * dt;
        flow(p);
        p->n.v.t = t + (j + 0.5) * dt;
        for (i = 0; i < N_X; i++) { x0[i] = x[i]; k1[i] = f[i]; x[i] = x0[i] + 0.5 * dt * k1[i]; }
        flow(p);
        for (i = 0; i < N_X; i++) { k2[i] = f[i]; x[i] = x0[i] + 0.5 * dt * k2[i]; }
        flow(p);
        p->n.v.t = t + (j + 1) * dt;
        for (i = 0; i < N_X; i++) { k3[i] = f[i]; x[i] = x0[i] + dt * k3[i]; }
        flow(p);
        for (i = 0; i < N_X; i++) x[i] = x0[i] + dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + f[i]);
    }
    (void)jacobian;
    (void)phi1;
#else
#if MIDPOINT
    p->n.v.t = p->n.v.t + 0.5 * h;
#endif
    if (NONLINEAR || h != p->n.phi_h) {
        Square z, phi;
        jacobian(p, z);
        for (i = 0; i < N_X; i++)
            for (j = 0; j < N_X; j++) z[i][j] = z[i][j] * h;
        if (!p->kept.phi_known || memcmp(z, p->kept.z, sizeof z) != 0) { /* a limit changes it between two matrices */
            memcpy(p->kept.z, z, sizeof z);
            p->kept.phi_known = 1;
            phi1(z, phi);
            for (i = 0; i < N_X; i++)
                for (j = 0; j < N_X; j++) p->n.phi[j][i] = phi[i][j];
        }
        p->n.phi_h = h;
    }
    flow(p);
    i = 0;
#ifdef __GNUC__
    for (; i + 1 < N_X; i += 2) { /* two states at a time: the same sums */
        pair dx = {0.0, 0.0};
        for (j = 0; j < N_X; j++) dx = dx + *(const pair *)&p->n.phi[j][i] * f[j];
        *(pair *)&x[i] = *(pair *)&x[i] + h * dx;
    }
#endif
    for (; i < N_X; i++) {
        double dx = 0.0;
        for (j = 0; j < N_X; j++) dx = dx + p->n.phi[j][i] * f[j];
        x[i] = x[i] + h * dx;
    }
#endif
}
