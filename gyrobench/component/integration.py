"""Integration of the states of a part over an internal step, by the method that the part names."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gyrobench.component.numerics import phi1

if TYPE_CHECKING:
    from gyrobench.component.component import Component


def advance(part: Component, h: float) -> None:
    """Take the states over an internal step h; the time of the part is that of its equations."""
    if part.integrator == "rk4":
        _runge_kutta(part, h)
        return
    if part.integrator == "midpoint":
        part.t = part.t + 0.5 * h
    anew = getattr(part, part.nonlinear) != 0.0 if isinstance(part.nonlinear, str) else part.nonlinear
    if anew or h != part._phi_h:
        part._phi = phi1([[a * h for a in row] for row in part.jacobian()])
        part._phi_h = h
    f = part._flow()
    for s, row in zip(part.states, part._phi, strict=True):
        dx = 0.0
        for p, fj in zip(row, f, strict=True):
            dx = dx + p * fj
        part._put(s, part._at(s) + h * dx)


def _runge_kutta(part: Component, h: float) -> None:
    t, dt = part.t, h / part.rk4_substeps
    for k in range(part.rk4_substeps):
        x = [part._at(s) for s in part.states]

        def move(f: list[float], by: float, x: list[float] = x) -> None:
            for s, xi, fi in zip(part.states, x, f, strict=True):
                part._put(s, xi + by * fi)

        part.t = t + k * dt
        k1 = part._flow()
        part.t = t + (k + 0.5) * dt
        move(k1, 0.5 * dt)
        k2 = part._flow()
        move(k2, 0.5 * dt)
        k3 = part._flow()
        part.t = t + (k + 1) * dt
        move(k3, dt)
        k4 = part._flow()
        sums = [a + 2.0 * b + 2.0 * c + d for a, b, c, d in zip(k1, k2, k3, k4, strict=True)]
        move(sums, dt / 6.0)
