"""gyro_hemispherical: the Bryan factor by kinetic energies, its slow equations by an integration of both modes with
their loops, drift by pattern angle, threshold.  No code of the part is used.  [GYRO-WHOLE-ANGLE]"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp
from wired import Native, run

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

EVEN = {"white": 0.0, "damping_difference": 0.0, "frequency_difference": 0.0}


def gyro(omega: Any = (0.0, 0.0, 0.0), **given: Any) -> Any:
    part = Native("gyro_hemispherical", **{**EVEN, **given})
    part.omega = list(omega)
    part.initialize()
    return part


# ------------------------------------------------------------------------------------------------ Bryan factor
def bryan(shape: Any, n: int, end: float) -> float:
    """Turn of the pattern over that of the body, of displacements (u along the meridian, v, w outward) cos n phi.

    Lagrange's equations of two patterns at right angles: M q1'' = 2 W G q2' ..., so that alpha' = -(G/M) W, theta =
    alpha/n; G = 2 * integral of the horizontal radial displacement times v, M = integral of u2 + v2 + w2.
    """

    def horizontal(s: float) -> float:
        u, v, w = shape(s)
        return (w * math.sin(s) + u * math.cos(s)) * v * math.sin(s)

    cross = quad(horizontal, 0.0, end)[0]
    mass = quad(lambda s: sum(x * x for x in shape(s)) * math.sin(s), 0.0, end)[0]
    return abs(2.0 * cross / mass) / n


def test_bryan_factor_of_ring_and_hemisphere() -> None:
    """Ring, v = -w/n: 2/(n2 + 1) = 0.4.  Hemisphere, Rayleigh's bending without extension: 0.277, the default."""
    ring = abs(2.0 * 1.0 * (-0.5) / (1.0 + 0.25)) / 2
    assert ring == pytest.approx(2.0 / (2**2 + 1))

    def rayleigh(s: float, n: int = 2) -> tuple[float, float, float]:
        t = math.tan(0.5 * s) ** n
        return math.sin(s) * t, math.sin(s) * t, -(n + math.cos(s)) * t

    hemisphere = bryan(rayleigh, 2, 0.5 * math.pi)
    assert load_part("gyro_hemispherical")().gain == pytest.approx(hemisphere, abs=6e-4)


# ------------------------------------------------------------------------------------------------ slow equations
@pytest.mark.long
def test_against_both_modes_with_their_loops() -> None:
    """x'' + D x' + K x = 4 k W S x' + forces, 20 Hz, by scipy; pattern angle and quadrature after 4 s.

    The forces follow the orbit: along the pattern as much as holds the amplitude, turned by drive_angle; across it
    -gain q, its phase off by quadrature_phase.  The averaging leaves terms of (1/tau, W)/w, 0.3 %.
    """
    w0, tau, d, split, k = 2.0 * math.pi * 20.0, 5.0, 0.15, 0.05, 0.277
    a_d, a_f, gain, chi, epsilon, rate, start = 0.3, 0.5, 3.0, 0.1, 0.02, 0.3, 0.2

    def tensor(angle: float) -> np.ndarray:  # of an axis at this pattern angle
        c, s = math.cos(4.0 * angle), math.sin(4.0 * angle)
        return np.array([[c, s], [s, -c]])

    damping = 2.0 / tau * np.eye(2) + d * tensor(a_d)
    wf = 2.0 * math.pi * split
    stiffness = w0**2 * np.eye(2) + w0 * wf * tensor(a_f)
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])

    def orbit(s: np.ndarray) -> tuple[complex, float, float, float]:
        z = s[:2] - 1j * s[2:] / w0
        phase = np.sqrt(z @ z + 0j)
        phase /= abs(phase)
        e = z / phase  # a e_r + i q e_t
        alpha = math.atan2(e.real[1], e.real[0])
        r, t = np.array([math.cos(alpha), math.sin(alpha)]), np.array([-math.sin(alpha), math.cos(alpha)])
        return phase, alpha, float(e.real @ r), float(e.imag @ t)

    def motion(_: float, s: np.ndarray) -> np.ndarray:
        phase, alpha, a, q = orbit(s)
        r, t = np.array([math.cos(alpha), math.sin(alpha)]), np.array([-math.sin(alpha), math.cos(alpha)])
        held = 1.0 / tau + 0.5 * d * math.cos(2.0 * (alpha - 2.0 * a_d))
        held += -0.5 * wf * math.sin(2.0 * (alpha - 2.0 * a_f)) * q + 30.0 * (1.0 - a)
        slow = phase * ((held + 0j) * (r + math.tan(epsilon) * t) - 1j * gain * q * np.exp(1j * chi) * t)
        force = (2j * w0 * slow).real
        x, v = s[:2], s[2:]
        return np.concatenate([v, -damping @ v - stiffness @ x + 4.0 * k * rate * (turn @ v) + force])

    alpha = 2.0 * start
    q = -0.5 * wf * math.sin(2.0 * (alpha - 2.0 * a_f)) / (1.0 / tau + gain * math.cos(chi))
    r, t = np.array([math.cos(alpha), math.sin(alpha)]), np.array([-math.sin(alpha), math.cos(alpha)])
    z = r + 1j * q * t
    found = solve_ivp(motion, (0.0, 4.0), np.concatenate([z.real, -w0 * z.imag]), rtol=1e-8, atol=1e-9).y[:, -1]
    _, alpha, _, q = orbit(found)
    part = gyro(omega=(rate, 0.0, 0.0), gain=k, tau=tau, damping_difference=d, damping_axis=[a_d, 0.0],
                frequency_difference=split, frequency_axis=[a_f, 0.0], quadrature_gain=gain, quadrature_phase=chi,
                drive_angle=epsilon, angle=[start, 0.0])  # fmt: skip
    read = run(part, 4.0)
    assert part.pattern[0] == pytest.approx(0.5 * alpha, abs=1e-3)
    assert part.q[0] == pytest.approx(q, abs=2e-3)
    free = start - k * rate * 4.0
    assert abs(part.pattern[0] - free) > 0.02  # what the loops and the axes do is twenty times as much
    assert read[:, 0].sum() * 1e-3 == pytest.approx((start - part.pattern[0]) / k, rel=1e-12)


def test_drift_by_pattern_angle() -> None:
    """Even frequencies: the rate that is read at rest is -D/(4 k) sin 4 (theta - theta_d)."""
    for theta in (0.0, 0.2, 0.5, 1.1):
        part = gyro(damping_difference=1e-4, damping_axis=[0.1, 0.3], angle=[theta, theta])
        expected = [-1e-4 / (4.0 * 0.277) * math.sin(4.0 * (theta - a)) for a in (0.1, 0.3)]
        assert run(part, 1e-3)[0] == pytest.approx(expected, rel=1e-9)


def test_threshold_of_a_gyro_that_is_not_calibrated() -> None:
    """Below D/(4 k) the pattern is caught and the mean rate is none; above, sqrt(w2 - threshold2)."""
    d = 0.1
    part = gyro(omega=(0.5 * d / (4.0 * 0.277), 0.0, 0.0), damping_difference=d)
    assert part.threshold == pytest.approx(d / (4.0 * 0.277), rel=1e-12)
    assert abs(run(part, 300.0, 0.01)[-1, 0]) < 1e-6 * part.threshold
    w = 2.0 * part.threshold
    # alpha turns by pi in this time: sin 2 alpha comes back
    period = 2.0 * math.pi / (4.0 * 0.277 * math.sqrt(w * w - part.threshold**2))
    steps = 20_000
    mean = run(gyro(omega=(w, 0.0, 0.0), damping_difference=d), period, period / steps)[:, 0].mean()
    assert mean == pytest.approx(math.sqrt(w * w - part.threshold**2), rel=1e-6)


def test_quadrature_that_is_left() -> None:
    """q = -F/2 sin 2(alpha - alpha_f)/(1/tau + gain), F = 2 pi split; with it the rate -F/(2 k) q cos/(1 - q2)."""
    split, theta = 0.01, 0.15
    part = gyro(frequency_difference=split, frequency_axis=[0.0, 0.0], angle=[theta, theta], quadrature_gain=2.0)
    rate = run(part, 1e-3)[0, 0]
    f = 2.0 * math.pi * split
    q = -0.5 * f * math.sin(4.0 * theta) / (1.0 / 400.0 + 2.0)
    assert part.q[0] == pytest.approx(q, rel=1e-5)
    assert rate == pytest.approx(-f * math.cos(4.0 * theta) * q / (1.0 - q * q) / (2.0 * 0.277), rel=1e-4)


def test_readout_mismatch() -> None:
    """tan alpha_read = (1 - e/2) sin alpha/((1 + e/2) cos alpha): -e/2 sin 2 alpha."""
    e, w = 1e-3, 0.5
    part = gyro(omega=(w, 0.0, 0.0), readout_mismatch=e)
    read = run(part, 10.0)[:, 0].sum() * 1e-3
    alpha = -2.0 * 0.277 * w * 10.0
    exact = math.atan2((1.0 - 0.5 * e) * math.sin(alpha), (1.0 + 0.5 * e) * math.cos(alpha))
    assert (-2.0 * 0.277 * read - exact + math.pi) % (2.0 * math.pi) - math.pi == pytest.approx(0.0, abs=1e-6)


def test_a_step_halved_is_four_times_as_near() -> None:
    """Second order: 40 rad/s, axes a thousand times worse than by default, against a sixteenth of the step."""
    given = {"damping_difference": 0.5, "frequency_difference": 0.02, "quadrature_phase": 0.1, "drive_angle": 0.05}
    ends = []
    for h in (4e-3, 2e-3, 2.5e-4):
        part = gyro(omega=(40.0, 0.0, 0.0), tau=5.0, **given)
        run(part, 1.0, h)
        ends.append(part.pattern[0])
    assert abs(ends[1] - ends[2]) < 0.3 * abs(ends[0] - ends[2]) < 1e-4


def test_a_quadrature_that_is_not_held_is_refused() -> None:
    part = load_part("gyro_hemispherical")(frequency_difference=0.1, quadrature_gain=0.0)
    part.initialize()
    with pytest.raises(ComponentError, match="more than the quadrature loop holds"):
        for k in range(1000):
            part.do_step(k * 0.1, 0.1)
