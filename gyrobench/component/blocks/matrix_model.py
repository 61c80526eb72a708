"""Linear models given as matrices, for the Kalman filters of any such model: what they declare and what they refuse."""

from __future__ import annotations

from gyrobench.component.blocks.estimator import KalmanEstimator
from gyrobench.component.declarations import Discrete, Input, Output, Parameter
from gyrobench.component.math import Number, Vector, dot, fabs, index, maximum, sqrt, vector

N, M = 6, 3  # most states, most readings
SMALL = 3  # models of so many states are computed in matrices of their own size: the same numbers without the zeros
NO_STATE = [0.0] * N
NO_READING = [0.0] * M
NO_MATRIX = [[0.0] * N] * N
NO_GAIN = [[0.0] * M] * N
NO_COVARIANCE = [[0.0] * M] * M
UNIT = [[1.0 if i == j else 0.0 for j in range(N)] for i in range(N)]
TOLERANCE = 1e-12  # of a pivot, of a matrix whose diagonal is scaled to 1
ROUNDING = 1e-9  # of a row that depends on others


def on_the_diagonal(*values: float) -> list[list[float]]:
    """Return a start value (N, N) with these numbers on its diagonal, 0 elsewhere.  For declarations."""
    return [[values[i] if i == j and i < len(values) else 0.0 for j in range(N)] for i in range(N)]


def corner(a: Vector) -> Vector:
    """Return the first SMALL elements of the first SMALL rows."""
    return vector([a[0][0:SMALL], a[1][0:SMALL], a[2][0:SMALL]])


def padded(a: Vector) -> Vector:
    """Return a matrix (SMALL, SMALL) with zeros up to (N, N)."""
    out = vector(NO_MATRIX)
    for i in range(SMALL):
        for j in range(SMALL):
            out[i][j] = a[i][j]
    return vector(out)


def tall(a: Vector) -> Vector:
    """Return a gain (SMALL, M) with zeros up to (N, M)."""
    out = vector(NO_GAIN)
    for i in range(SMALL):
        for j in range(M):
            out[i][j] = a[i][j]
    return vector(out)


def propagated(A: Vector, P: Vector) -> Vector:
    """Return A P A'."""
    return vector(A @ P @ A.T)


def propagated_states(A: Vector, P: Vector, n: Number) -> Vector:
    """Return A P A' (N, N) of a model of n states, without the zeros beyond them where there are few."""
    if n <= SMALL:
        return padded(propagated(corner(A), corner(P)))
    return propagated(A, P)


def smallest_pivot(matrix: Vector) -> Number:
    """Return the smallest pivot of a symmetric matrix scaled to a unit diagonal; -1 where it is not symmetric.

    Not below 0 (to rounding) for covariances, above 0 for regular ones.  A row of zeros is left out.
    """
    c = vector(matrix)
    for i in range(N):
        for j in range(N):
            size = sqrt(fabs(matrix[i][i])) * sqrt(fabs(matrix[j][j]))
            if matrix[i][i] < 0.0 or fabs(matrix[i][j] - matrix[j][i]) > 1e-9 * size:
                return -1.0
            if size == 0.0 and matrix[i][j] != 0.0:
                return -1.0
            c[i][j] = matrix[i][j] / size if size > 0.0 else 0.0
    smallest = 1.0
    for k in range(N):
        if matrix[k][k] > 0.0:
            pivot = c[k][k]
            if pivot < smallest:
                smallest = pivot
            for i in range(N):
                if i > k:
                    if pivot > TOLERANCE:
                        for j in range(N):
                            if j > k:
                                c[i][j] = c[i][j] - c[i][k] * c[k][j] / pivot
                    elif fabs(c[i][k]) > 1e-5:  # its square would have to be below the pivot
                        return -1.0
    return smallest


def largest(matrix: Vector) -> Number:
    """Return the largest element, by absolute value."""
    found = 0.0
    for i in range(N):
        for j in range(N):
            found = maximum(found, fabs(matrix[i][j]))
    return found


def decays(matrix: Vector) -> Number:
    """Return 1 where the powers of a matrix go to 0, every eigenvalue within the unit circle (by 1e-8), else 0."""
    x = vector(matrix)
    for _k in range(32):
        size = largest(x)
        if size > 1e100:
            return 0.0
        if size < 1e-100:
            return 1.0
        x = x @ x
    return 1.0 if largest(x) < 1e-9 else 0.0


def remainder(B: Vector, v: Vector) -> Vector:
    """Return what v has beside the orthonormal rows of B, of length 1; zeros where nothing but rounding is left."""
    length = sqrt(dot(v, v))
    u = v / length if length > 0.0 else vector(v)
    u = u - (B @ u) @ B
    size = sqrt(dot(u, u))
    if size < ROUNDING:
        return vector(u * 0.0)
    u = u / size
    u = u - (B @ u) @ B  # again: the first time leaves rounding, which grew when u was made longer
    return vector(u / sqrt(dot(u, u)))


def detectable(A: Vector, C: Vector) -> Number:
    """Return 1 where what the readings C x do not see of x+ = A x dies away by itself, else 0.

    The rows of C, and A applied to every row found, are made orthonormal one after another (Arnoldi).  With P the
    projector on what is orthogonal to all of them, the powers of P A P must go to 0.
    """
    B = vector(NO_MATRIX)
    rank = 0.0
    for i in range(M):
        u = remainder(B, C[i])
        if dot(u, u) > 0.5:
            B[index(rank)] = vector(u)
            rank = rank + 1.0
    for k in range(N):
        if k < rank:
            w = remainder(B, B[k] @ A)
            if dot(w, w) > 0.5:
                B[index(rank)] = vector(w)
                rank = rank + 1.0
    unseen = vector(UNIT) - B.T @ B
    return decays(unseen @ A @ unseen)


def whitening(S: Vector) -> Vector:
    """Return G, lower triangular, with G S G' = 1, of a covariance of M innovations; zeros where it is not regular."""
    L = vector(NO_COVARIANCE)
    G = vector(NO_COVARIANCE)
    for i in range(M):
        for j in range(M):
            if j <= i:
                x = S[i][j]
                for k in range(M):
                    if k < j:
                        x = x - L[i][k] * L[j][k]
                if i == j:
                    if x <= TOLERANCE * S[i][i]:
                        return vector(NO_COVARIANCE)
                    L[i][i] = sqrt(x)
                else:
                    L[i][j] = x / L[j][j]
    for j in range(M):  # L G = 1, column by column
        for i in range(M):
            if i >= j:
                x = 1.0 if i == j else 0.0
                for k in range(M):
                    if k < i:
                        x = x - L[i][k] * G[k][j]
                G[i][j] = x / L[i][i]
    return vector(G)


class MatrixModel(KalmanEstimator):
    """A linear model of n states and m readings, its arrays of fixed size: what lies beyond n and m is 0.

        x+ = A x + w,   cov w = W        reading i = (C x)_i + v_i

    x0, P0: of the state one period before the first reading.  What v is, the filter says that takes it.
    """

    n = Parameter(2, int, "number of states", min=1, max=N)
    m = Parameter(1, int, "number of readings", min=1, max=M)
    A = Parameter([[1.0, 1e-3, 0, 0, 0, 0], [0, 1.0, 0, 0, 0, 0], *[NO_STATE] * 4], "1", "transition, period to period")
    C = Parameter([[1.0, 0, 0, 0, 0, 0], NO_STATE, NO_STATE], "1", "rows: what each reading sees of the state")
    W = Parameter(
        [[0.5e-9 / 3.0, 0.25e-6, 0, 0, 0, 0], [0.25e-6, 0.5e-3, 0, 0, 0, 0], *[NO_STATE] * 4],
        "1",
        "covariance of what drives the state in a period",
    )
    x0 = Parameter(NO_STATE, "1", "expected state at the start")
    P0 = Parameter(on_the_diagonal(1.0, 1.0), "1", "covariance of the state at the start")

    z_2 = Input(0.0, "1", "second reading")
    z_3 = Input(0.0, "1", "third reading")
    valid_2 = Input(1.0, "1", "0: the second reading is missing")
    valid_3 = Input(1.0, "1", "0: the third reading is missing")

    estimates = Output("1", "C x: what the readings are of, without their noise", shape=(M,))
    variances = Output("1", "variances of these", shape=(M,))
    xhat = Output("1", "estimated state", shape=(N,))
    P_diag = Output("1", "variances of the state", shape=(N,))
    innovations = Output("1", "readings less their predictions; 0 where one is missing", shape=(M,))
    nis_dof = Output("1", "readings behind nis: its mean, if the model is right")

    x = Discrete(NO_STATE, "1", "state")
    P = Discrete(NO_MATRIX, "1", "its covariance")
    ys = Discrete(NO_READING, "1", "last innovations")
    told = Discrete(NO_STATE, "1", "state that the outputs tell")
    told_P = Discrete(NO_STATE, "1", "its variances")
    seen = Discrete(NO_READING, "1", "C x of it")
    seen_P = Discrete(NO_READING, "1", "variances of these")
    used = Discrete(0.0, "1", "readings behind the last nis")

    def start(self) -> None:
        beyond = 0.0
        C = vector(NO_MATRIX)  # C, padded
        for i in range(N):
            for j in range(N):
                if (i >= self.n or j >= self.n) and fabs(self.A[i][j]) + fabs(self.W[i][j]) + fabs(self.P0[i][j]) > 0.0:
                    beyond = 1.0
            if i >= self.n and self.x0[i] != 0.0:
                beyond = 1.0
        for i in range(M):
            for j in range(N):
                C[i][j] = self.C[i][j]
                if (i >= self.m or j >= self.n) and self.C[i][j] != 0.0:
                    beyond = 1.0
        self.refuse(beyond > 0.5, "A, C, W, x0 or P0 has numbers beyond n = {n} states or m = {m} readings: set to 0")
        self.refuse(smallest_pivot(self.W) < -1e-9, "W is not a covariance: symmetric, no negative eigenvalue")
        self.refuse(smallest_pivot(self.P0) < -1e-9, "P0 is not a covariance: symmetric, no negative eigenvalue")
        self.refuse(
            detectable(self.A, C) < 0.5,
            "the readings C x do not see a state that does not die away by itself (an eigenvalue of A on or outside "
            "the unit circle): its variance would never fall; give a reading of it, or leave it out of the model",
        )
        self.x = vector(self.x0)
        self.P = vector(self.P0)
        self.show(self.x, self.P)

    def show(self, x: Vector, P: Vector) -> None:
        """Keep what the outputs tell of a state and its covariance until the next reading."""
        self.told = vector(x)
        self.seen = self.C @ x
        CP = self.C @ P
        for i in range(N):
            self.told_P[i] = P[i][i]
        for i in range(M):
            self.seen_P[i] = dot(CP[i], self.C[i])

    def outputs(self) -> None:
        self.xhat = vector(self.told)
        self.P_diag = vector(self.told_P)
        self.estimates = vector(self.seen)
        self.variances = vector(self.seen_P)
        self.estimate = self.seen[0]
        self.variance = self.seen_P[0]
        self.innovations = vector(self.ys)
        self.nis_dof = self.used
