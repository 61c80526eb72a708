"""A recorded motion between its points: quintics with the slope and curvature of parabolas through three points."""

from __future__ import annotations

from gyrobench.component.math import Number, Vector, vector


def parabola(before: Number, after: Number, p0: Number, p1: Number, p2: Number) -> Vector:
    """Return slope and curvature of the parabola through three points at the middle one; intervals before and after."""
    s0 = (p1 - p0) / before
    s1 = (p2 - p1) / after
    return vector([(s0 * after + s1 * before) / (before + after), 2.0 * (s1 - s0) / (before + after)])


def quintic(
    x: Number, d: Number, p0: Number, end: Number, slope: Number, curve: Number, slope_end: Number, curve_end: Number
) -> Vector:
    """Return value, rate and acceleration a share x into an interval d: values, slopes, curvatures at both ends."""
    p1 = slope * d
    p2 = 0.5 * curve * d * d
    rise = end - p0 - p1 - p2
    bend = slope_end * d - p1 - 2.0 * p2
    kink = 0.5 * curve_end * d * d - p2
    p3 = 10.0 * rise - 4.0 * bend + kink
    p4 = -15.0 * rise + 7.0 * bend - 2.0 * kink
    p5 = 6.0 * rise - 3.0 * bend + kink
    return vector([
        p0 + x * (p1 + x * (p2 + x * (p3 + x * (p4 + x * p5)))),
        (p1 + x * (2.0 * p2 + x * (3.0 * p3 + x * (4.0 * p4 + x * 5.0 * p5)))) / d,
        (2.0 * p2 + x * (6.0 * p3 + x * (12.0 * p4 + x * 20.0 * p5))) / (d * d),
    ])  # fmt: skip
