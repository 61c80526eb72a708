"""Bodies with full inertia matrices on two gimbals, and the axes in which both orders of the gimbals are one."""

from __future__ import annotations

from gyrobench.component.math import Number, Vector, vector

X, Y, Z = 0, 1, 2


def ordered(form: Number, v: Vector) -> Vector:
    """Return v in axes whose third is that of the outer joint and whose first is that of the inner one.

    form 0, yaw outside: v itself.  form 1, pitch outside: (z, -y, x), a rotation that is its own inverse.
    """
    if form == 0.0:
        return vector([v[X], v[Y], v[Z]])
    return vector([v[Z], -v[Y], v[X]])


def ordered_matrix(form: Number, m: Vector) -> Vector:
    """Return a symmetric matrix in the axes of :func:`ordered`."""
    if form == 0.0:
        return vector([[m[X][X], m[X][Y], m[X][Z]], [m[X][Y], m[Y][Y], m[Y][Z]], [m[X][Z], m[Y][Z], m[Z][Z]]])
    return vector([[m[Z][Z], -m[Y][Z], m[X][Z]], [-m[Y][Z], m[Y][Y], -m[X][Y]], [m[X][Z], -m[X][Y], m[X][X]]])


def positive(m: Vector, slack: Number) -> Number:
    """Return 1 where a symmetric matrix has no eigenvalue below about -slack, by its principal minors."""
    a = m[X][X] + slack
    b = m[Y][Y] + slack
    c = m[Z][Z] + slack
    p = a * b - m[X][Y] * m[X][Y]
    q = b * c - m[Y][Z] * m[Y][Z]
    r = a * c - m[X][Z] * m[X][Z]
    cross = m[X][Y] * m[Y][Z] * m[X][Z]
    det = a * b * c + 2.0 * cross - a * m[Y][Z] * m[Y][Z] - b * m[X][Z] * m[X][Z] - c * m[X][Y] * m[X][Y]
    return 1.0 if a > 0.0 and b > 0.0 and c > 0.0 and p > 0.0 and q > 0.0 and r > 0.0 and det > 0.0 else 0.0


def rigid_matrix(m: Vector) -> Number:
    """Return 1 where a matrix can be the inertia of a rigid body: symmetric, positive, no moment above the others' sum.

    The last is that (trace / 2) 1 - I, the second moments of the mass, has no negative eigenvalue.
    """
    size = m[X][X] + m[Y][Y] + m[Z][Z]
    xy = m[X][Y] - m[Y][X]
    yz = m[Y][Z] - m[Z][Y]
    xz = m[X][Z] - m[Z][X]
    askew = xy * xy + yz * yz + xz * xz > 1e-18 * size * size
    half = 0.5 * size
    moments = vector(
        [
            [half - m[X][X], -m[X][Y], -m[X][Z]],
            [-m[X][Y], half - m[Y][Y], -m[Y][Z]],
            [-m[X][Z], -m[Y][Z], half - m[Z][Z]],
        ]
    )
    return 1.0 if not askew and positive(m, 0.0) and positive(moments, 1e-9 * size) else 0.0


def body_torque(m: Vector, a: Vector, w: Vector) -> Vector:
    """Return I a + w x I w of a body with the inertia matrix I.  [Newton-Euler]"""
    h = m @ w
    n = m @ a
    x = n[X] + w[Y] * h[Z] - w[Z] * h[Y]
    y = n[Y] + w[Z] * h[X] - w[X] * h[Z]
    z = n[Z] + w[X] * h[Y] - w[Y] * h[X]
    return vector([x, y, z])
