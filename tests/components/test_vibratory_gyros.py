"""gyro_vibratory, gyro_vibratory_carrier: phasors, closed forms and an integration of both modes that use no code of
the parts.  [GYRO-VIBRATORY]"""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wired import Native, run

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

DEG = math.pi / 180.0
F, SPLIT, Q = 15e3, 100.0, 1e4  # the defaults


def gyro(name: str = "gyro_vibratory", omega: Any = (0.0, 0.0, 0.0), temperature: float = 0.0, **given: Any) -> Any:
    part = Native(name, **{"white": 0.0, **given})
    part.omega = list(omega)
    part.temperature = temperature
    part.initialize()
    return part


def sense(omega: float, quadrature: float, split: float, q: float, f: float = F) -> complex:
    """Phasor of the sense motion over the drive motion of amplitude 1, by the equation of motion at w_x.

    y'' + (w_y/Q) y' + w_y2 y = -2 K (W x' + i ... ): per coupling and with the sign reversed, q = -y/K:
    (w_y2 - w_x2 + i w_x w_y/Q) q = 2 i w_x W - 2 w_x W_q
    """
    wx, wy = 2.0 * math.pi * f, 2.0 * math.pi * (f + split)
    return (2j * wx * omega - 2.0 * wx * quadrature) / (wy**2 - wx**2 + 1j * wx * wy / q)


# ------------------------------------------------------------------------------------------------ steady state
@pytest.mark.parametrize("phi", [0.0, 0.03, -0.2])
def test_quadrature_leaks_by_the_sine_of_the_phase_error(phi: float) -> None:
    """Rebalance: W cos phi + W_q sin phi.  The force on the sense mode is W + i W_q whatever the split is."""
    part = gyro(omega=(0.1, -0.2, 0.0), quadrature=[2.0, -1.0], phase_error=[phi, -phi])
    assert run(part, 0.5)[-1] == pytest.approx(
        [0.1 * math.cos(phi) + 2.0 * math.sin(phi), -0.2 * math.cos(phi) + math.sin(phi)], rel=1e-9
    )
    assert part.residual[0] == pytest.approx(2.0 * math.cos(phi) - 0.1 * math.sin(phi), rel=1e-9)


@pytest.mark.parametrize("split", [100.0, -60.0, 0.0])
def test_open_loop_against_the_phasor(split: float) -> None:
    """Demodulated at the phase of the nominal answer to a rate: warmer by 20 K, the split and Q are not nominal."""
    q, phi = (1e4, 0.02) if split else (500.0, 0.02)
    part = gyro(omega=(0.1, 0.1, 0.0), temperature=20.0, closed=0.0, split=split, split_T=0.5, Q=q, Q_T=-2e-3,
                frequency_T=0.0, quadrature=[0.3, -0.3], phase_error=[phi, phi])  # fmt: skip
    found = run(part, 0.01)[-1]
    unit = sense(1.0, 0.0, split, q)
    for k, quadrature in enumerate((0.3, -0.3)):
        answer = sense(0.1, quadrature, split + 10.0, q * 0.96)
        expected = (answer / unit * cmath.exp(-1j * phi)).real
        assert found[k] == pytest.approx(expected, rel=1e-3, abs=1e-3)  # damping at the two frequencies: split/f


def test_scale_factor_over_temperature_open_and_closed() -> None:
    """Split 100 Hz that grows by 1 Hz/K: 10 K leave 1/1.1 of the open loop, all of the rebalanced scale."""
    common = {"omega": (0.5, 0.0, 0.0), "temperature": 10.0, "split_T": 1.0, "frequency_T": 0.0}
    wide = run(gyro(closed=0.0, **common), 0.01)[-1, 0] / 0.5
    ratio = ((F + 100.0) ** 2 - F**2) / ((F + 110.0) ** 2 - F**2)  # stiffness less inertia at w_x
    assert wide == pytest.approx(ratio, rel=1e-4)  # 1/Q is left: (1/(tau delta))2 = 6e-5
    assert run(gyro(closed=1.0, **common), 0.5)[-1, 0] == pytest.approx(0.5, rel=1e-9)


def test_damping_anisotropy_makes_a_rate() -> None:
    """Damping matrix (2/tau) 1 + D [[cos 2a, sin 2a], [sin 2a, -cos 2a]]: -D sin 2a x' beside -2 K W x'."""
    d, a, k = 0.2, 0.3, 0.8
    rate = d * math.sin(2.0 * a) / (2.0 * k)
    part = gyro(damping_difference=d, damping_axis=[a, -a], coupling=k)
    assert run(part, 0.01)[-1] == pytest.approx([rate, -rate], rel=1e-9)
    warm = gyro(damping_difference=d, damping_axis=[a, -a], coupling=k, Q_T=-4e-3, temperature=50.0)
    assert run(warm, 0.01)[-1, 0] == pytest.approx(rate / 0.8, rel=1e-9)  # Q is 0.8 of what it was


def test_g_and_g_squared() -> None:
    part = Native("gyro_vibratory", white=0.0, g=[[1e-4, 0.0, 0.0], [0.0] * 3], g2=[[0.0, 0.0, 2e-5], [0.0, 1e-5, 0.0]])
    part.f = [2.0, -3.0, 9.8]
    part.initialize()
    assert run(part, 0.01)[-1] == pytest.approx([2e-4 + 2e-5 * 9.8**2, 9e-5], rel=1e-9)


# ------------------------------------------------------------------------------------------------ dynamics
def answer_at(part: Any, f: float, h: float = 1e-4, cycles: int = 8) -> complex:
    """Complex gain of the rate to a table rate cos(2 pi f t).

    Held from k h on it is, but for its steps, cos(2 pi f (t - h/2)); the rate is read at (k + 1) h.
    """
    n = round(1.0 / (f * h))
    rows = np.empty(cycles * n)
    for k in range(len(rows)):
        part.omega = [0.1 * math.cos(2.0 * math.pi * k / n), 0.0, 0.0]
        part.do_step(k * h, h)
        rows[k] = part.rate[0]
    last = rows[-n:]
    return complex(2.0 * np.mean(last * np.exp(-2j * np.pi * (np.arange(n) + 0.5) / n)) / 0.1)


@pytest.mark.parametrize("split", [100.0, 0.0])
def test_rebalance_bandwidth(split: float) -> None:
    """loop/(s + loop): the zero of the controller is the pole of the sense mode; at its 3 dB half the power, 45 deg."""
    part = gyro(split=split, loop=40.0, bandwidth=1e5)
    found = answer_at(part, 40.0)
    assert abs(found) == pytest.approx(math.sqrt(0.5), rel=2e-3)
    assert cmath.phase(found) == pytest.approx(-math.pi / 4.0, abs=5e-3)


def test_open_loop_transfer_function() -> None:
    """(s/tau + abs(p)2)/((s + 1/tau)2 + delta2), 1/tau = w_y/(2 Q)."""
    decay, delta = math.pi * (F + SPLIT) / 200.0, 2.0 * math.pi * SPLIT
    for f in (25.0, 50.0, 80.0):
        s = 2j * math.pi * f
        expected = (s * decay + decay**2 + delta**2) / ((s + decay) ** 2 + delta**2)
        found = answer_at(gyro(closed=0.0, Q=200.0, bandwidth=1e5), f)
        assert found == pytest.approx(expected, rel=5e-3)


def test_a_step_halved() -> None:
    """The states are those of held inputs, exact: two half steps are one."""
    wide = {"omega": (0.1, 0.2, 0.0), "quadrature": [1.0, 1.0], "phase_error": [0.05, 0.0]}
    for closed in (0.0, 1.0):
        one, two = gyro(closed=closed, **wide), gyro(closed=closed, **wide)
        one.omega = two.omega = [0.4, -0.3, 0.0]
        assert run(one, 0.05, 2e-3)[-1] == pytest.approx(run(two, 0.05, 1e-3)[-1], rel=1e-9)


@pytest.mark.parametrize(("closed", "given"), [(1.0, {}), (0.0, {"Q": 300.0})])
def test_white_noise_of_force_and_pick_off(closed: float, given: dict[str, float]) -> None:
    """Means of 0.5 s of 300 records: variance N2/T by `density`, white2 + abs(p)2 pickoff2; 600 degrees of freedom."""
    part = gyro(closed=closed, white=1e-3, pickoff=1.5e-6, bandwidth=100.0, **given)
    p = complex(math.pi * (F + SPLIT) / given.get("Q", Q), 2.0 * math.pi * SPLIT) * (1.0 + 0.5 * SPLIT / F)
    assert part.density == pytest.approx(math.hypot(1e-3, abs(p) * 1.5e-6), rel=1e-9)
    run(part, 1.0)
    means = run(part, 150.0, 2e-3).reshape(300, 250, 2).mean(axis=1)
    assert np.mean(means**2) * 0.5 == pytest.approx(part.density**2, rel=0.25)


# ------------------------------------------------------------------------------------------------ both modes
@pytest.mark.long
def test_against_an_integration_of_both_modes() -> None:
    """x'' and y'' with matrices of damping and stiffness by scipy, a step of the rate, open loop; carrier 500 Hz.

    Demodulated: mean of q exp(-i w t) times 2 over whole cycles.  The envelope leaves terms of abs(p)/w_x = 2 %, of the
    motion that a rate makes; they are what the carrier is for.
    """
    f, split, quality, k, step = 500.0, 10.0, 150.0, 0.8, 0.4
    wx, wy = 2.0 * math.pi * f, 2.0 * math.pi * (f + split)
    d, a = 0.6, 0.4  # damping: off-diagonal D sin 2a
    kxy = 2.0 * k * wx * 0.3  # -K_xy x against -2 K W_q w_x x: W_q = 0.3, sign of q reversed

    def motion(t: float, s: np.ndarray) -> list[float]:
        y, v = s
        x, xd = math.cos(wx * t), -wx * math.sin(wx * t)
        return [v, -wy / quality * v - wy**2 * y - (2.0 * k * step + d * math.sin(2.0 * a)) * xd + kxy * x]

    end, rows = 0.25, 12500
    t = (np.arange(rows) + 0.5) * end / rows
    y = solve_ivp(motion, (0.0, end), [0.0, 0.0], t_eval=t, rtol=1e-9, atol=1e-12, max_step=1e-4).y[0]
    z = (2.0 * (-y / k) * np.exp(-1j * wx * t)).reshape(125, 100).mean(axis=1)  # of each cycle of 2 ms
    p = wy / (2.0 * quality) - 1j * (wy - wx)
    expected = (z * p * (wy + wx) / (2.0 * wx)).real
    part = gyro(closed=0.0, frequency=f, split=split, Q=quality, coupling=k, bandwidth=1e5, frequency_T=0.0,
                damping_difference=0.0)  # fmt: skip
    part.omega = [step + d * math.sin(2.0 * a) / (2.0 * k), 0.0, 0.0]
    part.quadrature = [0.3, 0.0]
    found = run(part, end, 1e-3)[:, 0][0::2]  # after 1, 3, 5 ms: the middle of each cycle
    assert np.abs(found - expected).max() < 0.03 * np.abs(expected).max()
    assert found[-10:].mean() == pytest.approx(expected[-10:].mean(), rel=5e-3)


CASES = [(1.0, {}), (1.0, {"split": 0.0, "Q": 500.0}), (0.0, {"split": -80.0}), (0.0, {})]


@pytest.mark.parametrize(("closed", "given"), CASES)
def test_carrier_against_envelope(closed: float, given: dict[str, float]) -> None:
    """A step of the rate, quadrature, phase error, damping: within 1 % of the step at each time, in fact 0.1 %."""
    common = {"closed": closed, "quadrature": [1.0, 0.5], "phase_error": [0.02, 0.0], "damping_difference": 0.1,
              "damping_axis": [0.5, 0.0], "omega": (0.3, -0.2, 0.0), **given}  # fmt: skip
    parts = [gyro(**common), gyro("gyro_vibratory_carrier", **common)]
    before = [run(part, 0.05) for part in parts]
    for part in parts:
        part.omega = [1.0, 0.5, 0.0]
    after = [run(part, 0.15) for part in parts]
    for one, other in (before, after):
        assert np.abs(one - other).max() < 2e-3 * 0.7
    assert list(parts[1].residual) == pytest.approx(list(parts[0].residual), abs=5e-3)


def test_carrier_with_half_the_step() -> None:
    parts = [gyro("gyro_vibratory_carrier", closed=0.0, step=step) for step in (1e-5, 5e-6)]
    for part in parts:
        part.omega = [1.0, 0.5, 0.0]
    one, two = (run(part, 0.1) for part in parts)
    assert np.abs(one - two).max() < 1e-4


def test_carrier_keeps_its_amplitude() -> None:
    part = gyro("gyro_vibratory_carrier", omega=(5.0, 0.0, 0.0))
    run(part, 0.1)
    energy = part.x[0] ** 2 + (part.xd[0] / (2.0 * math.pi * F)) ** 2
    assert energy == pytest.approx(1.0, abs=1e-3)


# ------------------------------------------------------------------------------------------------ targets, refusals
def test_a_changing_temperature_is_the_same_in_both_targets() -> None:
    """The modes are taken anew; the rate of a warm gyro is that of one which started warm."""
    given = {"white": 1e-4, "split_T": 0.5, "quadrature_T": [0.1, 0.0], "phase_T": 1e-3, "closed": 0.0}
    native, plain = Native("gyro_vibratory", **given), load_part("gyro_vibratory")(**given)
    for part in (native, plain):
        part.omega = [0.1, 0.2, 0.0]
        part.initialize()
        for k in range(40):
            part.temperature = 0.3 * k
            part.do_step(k * 1e-3, 1e-3)
    assert list(native.rate) == list(plain.rate)
    one = gyro(omega=(0.5, 0.0, 0.0), split_T=0.5, closed=0.0, Q=200.0)
    one.temperature = 10.0
    other = gyro(omega=(0.5, 0.0, 0.0), split_T=0.5, closed=0.0, Q=200.0, temperature=10.0)
    assert run(one, 0.5)[-1] == pytest.approx(run(other, 0.5)[-1], rel=1e-9)


@pytest.mark.parametrize(
    ("name", "given", "said"),
    [
        ("gyro_vibratory", {"split": 2e4}, "between half and twice"),
        ("gyro_vibratory", {"split": -8e3}, "between half and twice"),
        ("gyro_vibratory_carrier", {"step": 1e-3}, "60 substeps"),
    ],
)
def test_refused(name: str, given: dict[str, float], said: str) -> None:
    with pytest.raises(ComponentError, match=said):
        load_part(name)(**given).initialize()


def test_a_quality_that_the_temperature_takes_away_is_refused() -> None:
    part = load_part("gyro_vibratory")(Q_T=-5e-3)
    part.initialize()
    part.temperature = 190.0
    with pytest.raises(ComponentError, match="less than a tenth"):
        part.do_step(0.0, 1e-3)
