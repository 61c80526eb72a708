"""Error model of an alignment: covariance of heading, tilt and what drives them, under the law of each stage.

Errors, platform axes x, y, z: phi, small rotation from the axes as computed to the true ones; J, the rates that are
added to the Earth's along x and y; I, the integral of the azimuth channel; V, the mean of the command in a window with
the weight w.  Omega: rate of the computed axes (Earth and turning), t: tilt as measured, k: gains of the stage:

    phi' = u + d + m + kappa c_z z + white + phi x Omega           t = phi + a + white
    u_x = J_x - k t_x     u_y = J_y - k t_y     u_z = I + k_z y,  y' = (t_x - y)/lag
    J' = -(k_Jx t_x, k_Jy t_y)     I' = k_I t_x     V' = w ((J in the first window) - k t)

d, a, kappa: constant drift, tilt by accelerometer bias, error of the azimuth torquer; m: Gauss-Markov drift.  A base
that vibrates with the velocity v adds (v_n - v_n-1)/(g h) to t, the mean over a period h; its steps cancel one another.
[ALIGN-GYRO]
"""

from __future__ import annotations

from gyrobench.component.blocks.gyro import DEG_H
from gyrobench.component.composition import Block
from gyrobench.component.declarations import Discrete, Parameter
from gyrobench.component.math import Number, Vector, cos, exp, index, maximum, sin, sqrt

N = 18
PHI, JX, JY, INTEGRAL, V, D, M, A, KAPPA, Y = 0, 3, 4, 5, 6, 8, 11, 14, 16, 17  # places of the errors, in this order
EMPTY = [0.0] * N
UG = 9.80665e-6  # m/s2


class SensorErrors(Block):
    """Errors of gyros, accelerometers and place that an alignment assumes."""

    bias = Parameter(0.01 * DEG_H, "rad/s", "rms of the constant drift of a gyro (0.01 deg/h)", min=0.0)
    markov = Parameter(0.002 * DEG_H, "rad/s", "rms of its Gauss-Markov drift (0.002 deg/h)", min=0.0)
    tau = Parameter(300.0, "s", "correlation time of that", above=0.0)
    white = Parameter(0.0178 * DEG_H, "rad/s/sqrt(Hz)", "white drift density (0.0178 deg/h/sqrt(Hz))", min=0.0)
    accelerometer = Parameter(20.0 * UG, "m/s2", "rms of the bias of an accelerometer (20 ug)", min=0.0)
    force = Parameter(10.0 * UG, "m/s2/sqrt(Hz)", "white noise density of an accelerometer (10 ug/sqrt(Hz))", min=0.0)
    latitude = Parameter(0.0, "rad", "standard uncertainty of the latitude", min=0.0)
    scale = Parameter(0.0, "1", "relative standard uncertainty of the azimuth torquer's scale factor", min=0.0)
    vibration = Parameter(0.0, "m/s", "rms horizontal velocity of a base that vibrates, at the periods", min=0.0)


class AlignmentCovariance(Block):
    """Covariance P of the 18 errors above, carried along by the second-order transition of the stage's linear model."""

    nonlinear = True
    P = Discrete([EMPTY] * N, "1", "covariance, SI units of the errors")
    F = Discrete([EMPTY] * N, "1", "their linear model")
    T = Discrete([EMPTY] * N, "1", "their transition over a period, or what a window makes of them")
    c = Discrete(EMPTY, "1", "what white noise at one place does")
    shaken = Discrete([EMPTY, EMPTY], "1", "what the last velocity of the base has done, along x and y, over s v/g")
    TP = Discrete([EMPTY] * N, "1", "T P")

    def begin(self, tilt: Number, north: Number, drift: Vector, markov: Number, lean: Number, scale: Number) -> None:
        """Set P: rms of the first tilt, of the missing Earth rate (over each axis), and of what is constant."""
        for i in range(N):
            self.shaken[0][i] = 0.0
            self.shaken[1][i] = 0.0
            for j in range(N):
                self.P[i][j] = 0.0
        for i in range(2):
            self.P[PHI + i][PHI + i] = tilt * tilt
            self.P[JX + i][JX + i] = 0.5 * north * north
            self.P[A + i][A + i] = lean * lean
        for i in range(3):
            self.P[D + i][D + i] = drift[i] * drift[i]
            self.P[M + i][M + i] = markov * markov
        self.P[KAPPA][KAPPA] = scale * scale

    def law(
        self,
        omega: Vector,
        k: Vector,
        k_j: Vector,
        k_z: Number,
        k_i: Number,
        lag: Number,
        kept: Number,
        weight: Number,
        c_z: Number,
    ) -> None:
        """Set F.  omega: of the computed axes; k, k_j: gains of x and y; k_z, k_i, lag: of the azimuth; c_z: its
        command.

        weight: of the window; kept: 1 where J is in V.
        """
        for i in range(N):
            for j in range(N):
                self.F[i][j] = 0.0
        self.F[0][1] = omega[2]
        self.F[0][2] = -omega[1]
        self.F[1][0] = -omega[2]
        self.F[1][2] = omega[0]
        self.F[2][0] = omega[1]
        self.F[2][Y] = k_z
        self.F[2][1] = -omega[0]
        for i in range(3):
            self.F[i][D + i] = 1.0
            self.F[i][M + i] = 1.0
        for i in range(2):
            self.F[i][i] = -k[i]
            self.F[i][A + i] = -k[i]
            self.F[i][JX + i] = 1.0
            self.F[JX + i][i] = -k_j[i]
            self.F[JX + i][A + i] = -k_j[i]
            self.F[V + i][i] = -weight * k[i]
            self.F[V + i][A + i] = -weight * k[i]
            self.F[V + i][JX + i] = weight * kept
        self.F[Y][0] = 1.0 / lag
        self.F[Y][A] = 1.0 / lag
        self.F[Y][Y] = -1.0 / lag
        self.F[2][INTEGRAL] = 1.0
        self.F[2][KAPPA] = c_z
        self.F[INTEGRAL][0] = k_i
        self.F[INTEGRAL][A] = k_i

    def carry(self, h: Number, white: Number, lean: Number, markov: Number, tau: Number, shake: Number) -> None:
        """Carry P over the time h.  white: gyro density; lean: density of the tilt as measured; shake: rms v/g."""
        e = exp(-h / tau)
        for i in range(N):
            for j in range(N):
                self.T[i][j] = 0.0
            for k in range(N):
                if self.F[i][k] != 0.0:  # as a tenth of them
                    for j in range(N):
                        self.T[i][j] = self.T[i][j] + self.F[i][k] * self.F[k][j]
            for j in range(N):
                self.T[i][j] = h * self.F[i][j] + 0.5 * h * h * self.T[i][j]
            self.T[i][i] = self.T[i][i] + 1.0
        for i in range(3):
            self.T[M + i][M + i] = e
        self.update()
        for i in range(3):
            self.disturb(h, D + i, white)
            self.P[M + i][M + i] = self.P[M + i][M + i] + (1.0 - e * e) * markov * markov
        for i in range(2):
            self.disturb(h, A + i, lean)
            self.vibrate(i, shake)

    def vibrate(self, axis: Number, shake: Number) -> None:
        """Add to P what the velocity of the base at the end of the period does less that at its beginning."""
        square = shake * shake
        for i in range(N):
            for j in range(N):
                crossed = self.shaken[index(axis)][i] * self.c[j] + self.c[i] * self.shaken[index(axis)][j]
                self.P[i][j] = self.P[i][j] + square * (2.0 * self.c[i] * self.c[j] - crossed)
        for i in range(N):
            self.shaken[index(axis)][i] = self.c[i]

    def disturb(self, h: Number, place: Number, density: Number) -> None:
        """Add to P what white noise does over the time h that enters as the error at ``place`` does."""
        for i in range(N):
            self.c[i] = 0.0
            for k in range(N):
                if self.F[i][k] != 0.0:
                    self.c[i] = self.c[i] + 0.5 * h * self.F[i][k] * self.F[k][index(place)]
            self.c[i] = self.c[i] + self.F[i][index(place)]
        for i in range(N):
            for j in range(N):
                self.P[i][j] = self.P[i][j] + h * density * density * self.c[i] * self.c[j]

    def update(self) -> None:
        """Make P the covariance of T errors."""
        for axis in range(2):
            for i in range(N):
                self.c[i] = 0.0
                for k in range(N):
                    self.c[i] = self.c[i] + self.T[i][k] * self.shaken[axis][k]
            for i in range(N):
                self.shaken[axis][i] = self.c[i]
        for i in range(N):
            for j in range(N):
                self.TP[i][j] = 0.0
            for k in range(N):
                if self.T[i][k] != 0.0:
                    for j in range(N):
                        self.TP[i][j] = self.TP[i][j] + self.T[i][k] * self.P[k][j]
        for j in range(N):
            for i in range(N):
                self.P[i][j] = 0.0
            for k in range(N):
                if self.T[j][k] != 0.0:
                    for i in range(N):
                        self.P[i][j] = self.P[i][j] + self.TP[i][k] * self.T[j][k]

    def sigma(self, place: Number) -> Number:
        """Return the standard deviation of the error at a place."""
        return sqrt(maximum(self.P[index(place)][index(place)], 0.0))

    def first_heading(self, psi: Number, north: Number) -> None:
        """Let heading and J follow from the mean command of the first window; V is emptied."""
        s = sin(psi)
        c = cos(psi)
        self.empty_window()
        self.T[2][2] = 0.0
        self.T[2][V] = -c / north
        self.T[2][V + 1] = -s / north
        self.T[JX][JX] = 0.0
        self.T[JY][JY] = 0.0
        self.T[JX][V] = s * s
        self.T[JX][V + 1] = -s * c
        self.T[JY][V] = -s * c
        self.T[JY][V + 1] = c * c
        self.update()

    def second_heading(self, psi: Number, north: Number) -> None:
        """Take half the mean command of the second window into heading and J; V is emptied."""
        self.empty_window()
        self.T[2][V] = -0.5 * cos(psi) / north
        self.T[2][V + 1] = -0.5 * sin(psi) / north
        self.T[JX][V] = 0.5
        self.T[JY][V + 1] = 0.5
        self.update()

    def forget(self) -> None:
        """Let J along x be 0, not what the window gave."""
        self.shaken[0][JX] = 0.0
        self.shaken[1][JX] = 0.0
        for i in range(N):
            self.P[i][JX] = 0.0
            self.P[JX][i] = 0.0

    def empty_window(self) -> None:
        """Set T to the unit matrix, V to 0."""
        for i in range(N):
            for j in range(N):
                self.T[i][j] = 1.0 if i == j and i != V and i != V + 1 else 0.0
