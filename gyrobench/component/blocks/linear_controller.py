"""Linear controllers given as data: from a transfer function to a state space, and from continuous to sampled."""

from __future__ import annotations

from gyrobench.component.math import Number, Vector, exp, fabs, index, log, maximum, vector

N = 8  # most states
NO_STATE = [0.0] * N
NO_MATRIX = [[0.0] * N] * N
UNIT = [[1.0 if i == j else 0.0 for j in range(N)] for i in range(N)]
NO_POLYNOMIAL = [0.0] * (N + 1)
TERMS = 16  # of a series: 0.5^17 / 17! is far below a last digit
HALVINGS = 60  # most, of a matrix before its series


def degree(polynomial: Vector) -> Number:
    """Return the largest k whose coefficient is not 0; 0 where there is none."""
    k = 0.0
    for i in range(N + 1):
        if polynomial[i] != 0.0:
            k = i + 0.0
    return k


def mean_size(den: Vector, n: Number) -> Number:
    """Return the geometric mean of the roots of sum den_k s^k, degree n, by size, without those at 0; 1 if all are."""
    lowest = n
    for i in range(N + 1):
        if i < lowest and den[i] != 0.0:
            lowest = i + 0.0
    if lowest == n:
        return 1.0
    return exp(log(fabs(den[index(lowest)]) / fabs(den[index(n)])) / (n - lowest))


def least_power(w: Number, n: Number) -> Number:
    """Return w^-n."""
    power = 1.0
    for i in range(N):
        if i < n:
            power = power / w
    return power


def companion(den: Vector, n: Number, w: Number) -> Vector:
    """Return A of 1 / sum den_k s^k of degree n, its time in 1/w so that no coefficient is out of proportion."""
    A = vector(NO_MATRIX)
    last = den[index(n)]
    power = least_power(w, n)
    for i in range(N - 1):
        if i + 1 < n:
            A[i][i + 1] = w
    for i in range(N):
        if i < n:
            A[index(n - 1.0)][i] = -w * den[i] / last * power
            power = power * w
    return vector(A)


def output_row(num: Vector, den: Vector, n: Number, w: Number) -> Vector:
    """Return C that belongs to :func:`companion`, of num / den without its direct part."""
    C = vector(NO_STATE)
    last = den[index(n)]
    direct = num[index(n)] / last
    power = least_power(w, n)
    for i in range(N):
        if i < n:
            C[i] = (num[i] - direct * den[i]) / last * power
            power = power * w
    return vector(C)


def inverse(matrix: Vector) -> Vector:
    """Return the inverse (Gauss, Jordan, with exchange of rows); zeros where it has none to rounding."""
    a = vector(matrix)
    b = vector(UNIT)
    for k in range(N):
        row = k + 0.0
        for i in range(N):
            if i > k and fabs(a[i][k]) > fabs(a[index(row)][k]):
                row = i + 0.0
        if fabs(a[index(row)][k]) < 1e-300:
            return vector(NO_MATRIX)
        for j in range(N):
            x = a[k][j]
            a[k][j] = a[index(row)][j]
            a[index(row)][j] = x
            y = b[k][j]
            b[k][j] = b[index(row)][j]
            b[index(row)][j] = y
        pivot = a[k][k]
        for j in range(N):
            a[k][j] = a[k][j] / pivot
            b[k][j] = b[k][j] / pivot
        for i in range(N):
            if i != k:
                share = a[i][k]
                for j in range(N):
                    a[i][j] = a[i][j] - share * a[k][j]
                    b[i][j] = b[i][j] - share * b[k][j]
    return vector(b)


def mean_transition(A: Vector, T: Number) -> Vector:
    """Return the mean of exp(A t) from 0 to T, its series for T / 2^k, doubled k times."""
    size = 0.0
    for i in range(N):
        total = 0.0
        for j in range(N):
            total = total + fabs(A[i][j])
        size = maximum(size, total * T)
    X = A * T
    halvings = 0.0
    for _k in range(HALVINGS):
        if size > 0.5:
            size = 0.5 * size
            X = X * 0.5
            halvings = halvings + 1.0
    mean = vector(UNIT)
    for k in range(TERMS):
        mean = vector(UNIT) + X @ mean * (1.0 / (TERMS + 1.0 - k))
    E = vector(UNIT) + X @ mean
    for k in range(HALVINGS):
        if k < halvings:
            mean = mean @ (E + vector(UNIT)) * 0.5
            E = E @ E
    return vector(mean)
