from __future__ import annotations

from gyrobench.component import Component, Discrete, Input, Output, Parameter, sampled
from gyrobench.component.blocks.gyro import DEG_H
from gyrobench.component.math import Number, cos, dot, exp, fabs, log, maximum, pi, sin, sqrt, vector

H = 5  # harmonics: mean, cos, sin, cos 2, sin 2
N = 7  # states: these, the drift that wanders, the error of the last angle reading
W, E = 5, 6  # places of the last two
NOTHING = [0.0] * N
NO_MATRIX = [[0.0] * N] * N
NO_GAIN = [[0.0] * 3] * N
UNIT = [[1.0 if i == j else 0.0 for j in range(N)] for i in range(N)]
ARCSEC = pi / 648000.0
LIMIT = 3.2905  # of a unit normal, exceeded to one of both sides with the probability 0.001


def window_variance(r: Number) -> Number:
    """Return 2 r - 3 + 4 e^-r - e^-2r, by its series where the terms cancel."""
    if r < 0.01:
        return r * r * r * (2.0 / 3.0 - r * (0.5 - r * (7.0 / 30.0 - r / 12.0)))
    return 2.0 * r - 3.0 + 4.0 * exp(-r) - exp(-2.0 * r)


class EstimatorCoefficients(Component):
    """Kalman filter of the drift over the angle of a table that its gyro holds.  [EST-KF-COEFF]

    A window of the length T, between two angle readings, gives the mean rate; with the Earth rate along the axis

        z = (angle_end - angle_start)/T + omega_E = h' A + mean of w + mean of n + (e_end - e_start)/T
        h = means over the window of (1, cos, sin, cos 2, sin 2) of the angle: middle value times sinc(k travel / 2)

    A constant; w Gauss-Markov drift (rms, tau), n white drift (white), e white errors of the readings (sigma), which
    neighbouring windows share.  State (A, w, e), exactly, with r = T/tau, phi = e^-r:

        w_end = phi w + u_1,   mean of w = (1 - phi)/r w + u_2,   var u_1 = rms2 (1 - phi2)
        var u_2 = rms2 (2 r - 3 + 4 phi - phi2)/r2,   cov = rms2 (1 - phi)2/r
        y = z - H x,   S = H P H' + D U D',   K = (F P H' + G U D')/S
        x = F x + K y,   P = (F - K H) P (F - K H)' + (G - K D) U (G - K D)'       (Joseph form, noise correlated)

    with H = (h, (1 - phi)/r, -1/T), F = diag(1, phi, 0), u = (u_1, u_2 + mean of n, e_end).  The end is generalized
    least squares over all windows.  A gap (t_start after the last t_end, or windows with valid = 0) lets w decay by
    e^(-gap/tau) and takes a new reading error.  A new phase begins anew.

    sd: standard deviations of A.  may_stop = 1 once every sd is at or below its `wanted` (0: not asked for), the record
    and not the prior gives A (`determined`: all variances below 1/100 of their prior) and the filter is `consistent`:
    mean nis of the phase within its bounds of 99.9 % (chi-square, Wilson and Hilferty), and so the correlation of
    neighbouring innovations.  A drift taken to be faster than it is has a mean nis below 1 and an sd that is far too
    small: both bounds count.  correlation: the largest between two coefficients.

    Sign: omega_d = theta' + omega_E,x, precession sign.  (4-136 of Hu 1981 has Omega = -omega_d.)

    Not modelled: coefficients that change, errors of the angle that go with the angle (they are in A), noise other than
    these three.  sd rests on tau, rms, white, sigma as given; few windows do not show that they are wrong.
    Source: EST-KF-COEFF; Hu 1981, eq. 4-127..4-140 (corrected); means over windows and shared readings: derived.
    """

    version = "1.0.0"

    step = Parameter(1e9, "s", "largest internal step: one for each communication step", above=0.0)
    tau = Parameter(300.0, "s", "correlation time of the drift that wanders", above=0.0)
    rms = Parameter(0.002 * DEG_H, "rad/s", "its standard deviation (0.002 deg/h)", min=0.0)
    white = Parameter(0.0178 * DEG_H, "rad/s/sqrt(Hz)", "white drift density (0.0178 deg/h/sqrt(Hz))", min=0.0)
    sigma = Parameter(0.0, "rad", "standard deviation of an angle reading", min=0.0)
    prior = Parameter(
        [20.0 * DEG_H] * H, "rad/s", "standard deviation of each coefficient at the start (20 deg/h)", above=0.0
    )
    wanted = Parameter(
        [0.001 * DEG_H] * H, "rad/s", "standard deviation wanted of each coefficient (0.001 deg/h); 0: none", min=0.0
    )

    count = Input(0.0, "1", "windows completed so far")
    window_phase = Input(0.0, "1", "phase of the last window")
    angle_start = Input(0.0, "rad", "angle at its start")
    angle_end = Input(0.0, "rad", "angle at its end")
    t_start = Input(0.0, "s", "its start")
    t_end = Input(0.0, "s", "its end")
    omega_E = Input(0.0, "rad/s", "Earth rate along the table axis")
    valid = Input(1.0, "1", "0: this window is missing")

    A = Output("rad/s", "mean, cos, sin, cos 2, sin 2 of the drift over the angle", shape=(H,))
    sd = Output("rad/s", "their standard deviations, as the filter has them", shape=(H,))
    w = Output("rad/s", "drift that wanders, at the end of the window")
    innovation = Output("rad/s", "rate less its prediction; 0 where the window is missing")
    nis = Output("1", "innovation squared over its variance; 0 where the window is missing")
    correlation = Output("1", "largest correlation between two coefficients, with its sign")
    windows = Output("1", "windows used in this phase")
    mean_nis = Output("1", "mean nis of these")
    neighbours = Output("1", "correlation of neighbouring innovations")
    consistent = Output("1", "1: mean nis and correlation of neighbours within their bounds of 99.9 %")
    determined = Output("1", "1: the record gives every coefficient")
    may_stop = Output("1", "1: every coefficient is known as well as wanted, by a consistent filter")

    x = Discrete(NOTHING, "rad/s", "state; the error of the reading in rad")
    P = Discrete(NO_MATRIX, "rad2/s2", "its covariance")
    seen = Discrete(0.0, "1", "windows completed at the last look")
    part = Discrete(-1.0, "1", "phase of the estimate")
    t_last = Discrete(0.0, "s", "end of the last window used")
    n = Discrete(0.0, "1", "windows used in this phase")
    total = Discrete(0.0, "1", "sum of nis")
    y = Discrete(0.0, "rad/s", "last innovation")
    e = Discrete(0.0, "1", "last nis")
    scaled = Discrete(0.0, "1", "last innovation over its standard deviation")
    product = Discrete(0.0, "1", "sum of products of these, each with the one before")
    score = Discrete(0.0, "1", "mean nis as a unit normal")
    score_next = Discrete(0.0, "1", "correlation of neighbours as a unit normal")
    deviation = Discrete([0.0] * H, "rad/s", "standard deviations of the coefficients")
    largest = Discrete(0.0, "1", "largest correlation between two of them")
    known = Discrete(0.0, "1", "1: the record gives all of them")
    reached = Discrete(0.0, "1", "1: all of them are known as well as wanted")

    def start(self) -> None:
        self.refuse(
            self.rms == 0.0 and self.white == 0.0 and self.sigma == 0.0,
            "rms, white and sigma are all 0: a window without noise has no variance to weigh it with",
        )
        pointless = 0.0
        for k in range(H):
            if self.wanted[k] >= self.prior[k]:
                pointless = 1.0
        self.refuse(pointless > 0.5, "wanted must be below prior: it would be reached before the first window")
        self.seen = 0.0
        self.part = -1.0
        self.n = 0.0
        self.begin()

    def begin(self) -> None:
        """Know nothing but the prior and the noise."""
        self.x = vector(NOTHING)
        self.P = vector(NO_MATRIX)
        for k in range(H):
            self.P[k][k] = self.prior[k] * self.prior[k]
        self.P[W][W] = self.rms * self.rms
        self.P[E][E] = self.sigma * self.sigma
        self.n = 0.0
        self.total = 0.0
        self.scaled = 0.0
        self.product = 0.0
        self.score = 0.0
        self.score_next = 0.0
        self.judge()

    def bridge(self, gap: Number) -> None:
        """Let a time without windows pass; the reading after it is a new one."""
        phi = exp(-gap / self.tau)
        for k in range(N):
            self.P[W][k] = self.P[W][k] * phi
            self.P[k][E] = 0.0
            self.P[E][k] = 0.0
        for k in range(N):
            self.P[k][W] = self.P[k][W] * phi
        self.x[W] = self.x[W] * phi
        self.x[E] = 0.0
        self.P[W][W] = self.P[W][W] + self.rms * self.rms * (1.0 - phi * phi)
        self.P[E][E] = self.sigma * self.sigma

    def take(self, T: Number) -> None:
        """Take a window of the length T."""
        r = T / self.tau
        phi = exp(-r)
        share = (1.0 - phi) / r
        q = self.rms * self.rms
        middle = 0.5 * (self.angle_start + self.angle_end)
        half = 0.5 * (self.angle_end - self.angle_start)
        one = sin(half) / half if fabs(half) > 1e-9 else 1.0
        two = sin(2.0 * half) / (2.0 * half) if fabs(half) > 1e-9 else 1.0
        h = vector(
            [
                1.0,
                one * cos(middle),
                one * sin(middle),
                two * cos(2.0 * middle),
                two * sin(2.0 * middle),
                share,
                -1.0 / T,
            ]
        )
        D = vector([0.0, 1.0, 1.0 / T])
        c = q * (1.0 - phi) * (1.0 - phi) / r
        noise = q * window_variance(r) / (r * r) + self.white * self.white / T
        U = vector([[q * (1.0 - phi * phi), c, 0.0], [c, noise, 0.0], [0.0, 0.0, self.sigma * self.sigma]])
        L = vector(UNIT)  # F, then F - K H
        L[W][W] = phi
        L[E][E] = 0.0
        Q = U @ D
        Ph = self.P @ h
        S = dot(h, Ph) + dot(D, Q)
        self.y = (self.angle_end - self.angle_start) / T + self.omega_E - dot(h, self.x)
        self.e = self.y * self.y / S
        K = L @ Ph
        K[W] = K[W] + Q[0]
        K[E] = K[E] + Q[2]
        K = K / S
        self.x = L @ self.x + K * self.y
        M = vector(NO_GAIN)  # G - K D
        for i in range(N):
            for j in range(N):
                L[i][j] = L[i][j] - K[i] * h[j]
            for j in range(3):
                M[i][j] = -K[i] * D[j]
        M[W][0] = M[W][0] + 1.0
        M[E][2] = M[E][2] + 1.0
        P = L @ self.P @ L.T + M @ U @ M.T
        self.P = (P + P.T) * 0.5

    @sampled(every=1)
    def tick(self) -> None:
        if self.count > self.seen + 0.5:
            self.refuse(self.t_end <= self.t_start, "t_end = {t_end} s is not after t_start = {t_start} s: no window")
            if self.window_phase != self.part:
                self.part = self.window_phase
                self.t_last = self.t_start
                self.begin()
            self.y = 0.0
            self.e = 0.0
            if self.valid > 0.5:
                gap = self.t_start - self.t_last
                if gap > 1e-6 * (self.t_end - self.t_start):
                    self.bridge(gap)
                self.take(self.t_end - self.t_start)
                self.t_last = self.t_end
                self.n = self.n + 1.0
                self.total = self.total + self.e
                before = self.scaled
                self.scaled = sqrt(self.e) if self.y > 0.0 else -sqrt(self.e)
                self.product = self.product + before * self.scaled
                self.score_next = self.product / sqrt(maximum(self.n - 1.0, 1.0))
                # cube root of a chi-square variable over its degrees of freedom: nearly normal (Wilson and Hilferty)
                spread = 2.0 / (9.0 * self.n)
                self.score = (exp(log(maximum(self.total / self.n, 1e-300)) / 3.0) - 1.0 + spread) / sqrt(spread)
                self.judge()
        self.seen = self.count

    def judge(self) -> None:
        """Take standard deviations, the largest correlation and the verdicts from the covariance."""
        self.known = 1.0
        self.reached = 1.0
        self.largest = 0.0
        for k in range(H):
            self.deviation[k] = sqrt(self.P[k][k])
            if self.P[k][k] > 0.01 * self.prior[k] * self.prior[k]:
                self.known = 0.0
            if self.wanted[k] > 0.0 and self.deviation[k] > self.wanted[k]:
                self.reached = 0.0
            for j in range(H):
                if j < k:
                    rho = self.P[k][j] / (self.deviation[k] * self.deviation[j])
                    if fabs(rho) > fabs(self.largest):
                        self.largest = rho

    def outputs(self) -> None:
        self.A = self.x[0:H]
        self.sd = vector(self.deviation)
        self.w = self.x[W]
        self.innovation = self.y
        self.nis = self.e
        self.correlation = self.largest
        self.windows = self.n
        self.mean_nis = self.total / maximum(self.n, 1.0)
        self.neighbours = self.product / maximum(self.n - 1.0, 1.0)
        self.consistent = 1.0 if fabs(self.score) <= LIMIT and fabs(self.score_next) <= LIMIT else 0.0
        self.determined = self.known
        self.may_stop = 1.0 if self.known > 0.5 and self.reached > 0.5 and self.consistent > 0.5 else 0.0
