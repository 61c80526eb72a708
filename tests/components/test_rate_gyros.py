"""gyro_fog, gyro_laser, gyro_mems, and what all rate gyros share: closed forms and limits against derivations and
integrations that use no code of the parts.  [GYRO-FOG, GYRO-LOCK-IN, GYRO-LASER, GYRO-MEMS]"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wired import Native

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

C, E = 299792458.0, 1.602176634e-19
DEG = math.pi / 180.0
FOG_QUIET = {"optical": 0.0}
LASER_QUIET = {"crossings": 0.0, "counting": 0.0}
MEMS_QUIET = {"white": 0.0}
QUIET = {
    "gyro_fog": FOG_QUIET,
    "gyro_laser": {**LASER_QUIET, "lock_in": 0.0},
    "gyro_mems": MEMS_QUIET,
    "gyro_vibratory": {"white": 0.0},
    "gyro_hemispherical": {"white": 0.0, "damping_difference": 0.0, "frequency_difference": 0.0},
}
PARTS = list(QUIET)


def rates(name: str, omega: Any, steps: int = 1, h: float = 1e-3, **given: Any) -> np.ndarray:
    """Measured rates along x and y after each step at a constant rate."""
    inputs = {n: given.pop(n) for n in ("temperature", "B", "f") if n in given}
    part = Native(name, **given)
    part.omega = list(omega)
    for n, x in inputs.items():
        setattr(part, n, x)
    part.initialize()
    out = np.empty((steps, 2))
    for k in range(steps):
        part.do_step(k * h, h)
        out[k] = part.rate
    return out


# ------------------------------------------------------------------------------------------------ common part
@pytest.mark.parametrize("name", PARTS)
def test_scale_bias_temperature_field_mount(name):
    """By hand: mount swaps x and y and turns z; scale 1 % + 1e-4/K 20 K + 0.2 %/2 (positive), bias and its terms."""
    mount = [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]]
    found = rates(
        name, [0.02, 0.03, 0.5], **QUIET[name], mount=mount, scale=[0.01, -0.02], scale_T=1e-4, asymmetry=2e-3,
        bias=[1e-3, 2e-3], bias_T=[1e-5, -1e-5], magnetic=[[1.0, 0.0, 0.0], [0.0, 0.0, 2.0]], temperature=20.0,
        B=[1e-5, 2e-5, 3e-5],
    )[0]  # fmt: skip
    x = 0.03 * (1 + 0.01 + 2e-3 + 1e-3) + 1e-3 + 2e-4 + 2e-5  # gyro x is head y; field along gyro x is B_y
    y = 0.02 * (1 - 0.02 + 2e-3 + 1e-3) + 2e-3 - 2e-4 - 2.0 * 3e-5  # field along gyro z is -B_z
    assert found == pytest.approx([x, y], rel=1e-9 if name != "gyro_fog" else 1e-8)
    negative = rates(name, [-0.02, -0.03, 0.0], **QUIET[name], asymmetry=2e-3)[0]
    assert negative == pytest.approx([-0.02 * 0.999, -0.03 * 0.999], rel=1e-8)


@pytest.mark.parametrize("name", PARTS)
def test_a_step_halved_is_the_same_mean(name):
    whole = rates(name, [0.01, -0.02, 0.0], 40, 2e-3, **QUIET[name])
    halved = rates(name, [0.01, -0.02, 0.0], 80, 1e-3, **QUIET[name])
    assert whole[-1] == pytest.approx(halved[-1], rel=1e-12)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("gyro_fog", {"power": 2e-8}),
        ("gyro_laser", {"counting": 0.0}),
        ("gyro_mems", {"bandwidth": 80.0}),
        ("gyro_vibratory", {"bandwidth": 80.0, "pickoff": 5e-6}),
        ("gyro_hemispherical", {"white": 1e-3}),
    ],
)
@pytest.mark.long
def test_white_noise_has_the_density_that_is_shown(name, given):
    """Means of 0.5 s of 400 records: variance N2/T, chi2 of 800 degrees of freedom, 5 % standard deviation."""
    part = Native(name, **given)
    part.initialize()
    n, m, h = 400, 250, 2e-3
    means = np.empty((n, 2))
    for j in range(n):
        total = np.zeros(2)
        for k in range(m):
            part.do_step((j * m + k) * h, h)
            total += part.rate
        means[j] = total / m
    assert np.mean(means**2) * m * h == pytest.approx(part.density**2, rel=0.2)
    assert abs(np.corrcoef(means.T)[0, 1]) < 0.2  # the axes are independent
    assert part.density > 0.0


@pytest.mark.parametrize("name", PARTS)
def test_range(name):
    part = Native(name, **QUIET[name], range_max=0.1)
    part.omega = [0.2, -0.05, 0.0]
    part.initialize()
    part.do_step(0.0, 1e-3)
    assert part.rate == pytest.approx([0.1, -0.05], rel=1e-9)
    assert part.saturated == 1.0


@pytest.mark.parametrize(("name", "size"), [("gyro_fog", {"resolution": 1e-5}), ("gyro_laser", {"counting": 4.0})])
def test_counts_lose_no_angle(name, size):
    """The counts of 1 s differ from the angle by half a count at most; each is a whole number of them."""
    quiet = {n: x for n, x in QUIET[name].items() if n != "counting"}
    found = rates(name, [1.2345e-3, -3.21e-4, 0.0], 1000, **quiet, **size)
    # laser: 1/(4 K), K = 4 A/(lambda L)
    one = 1e-5 if name == "gyro_fog" else 632.8e-9 * 0.3 / (4.0 * 4.33e-3) / 4.0
    counts = found * 1e-3 / one
    assert counts == pytest.approx(np.rint(counts), abs=1e-6)
    assert np.abs(found.sum(axis=0) * 1e-3 - [1.2345e-3, -3.21e-4]).max() <= 0.5 * one * (1 + 1e-9)


@pytest.mark.long
def test_flicker_walk_and_turn_on_are_in_the_rate():
    one = rates("gyro_mems", [0, 0, 0], 200, white=0.0, flicker_x=1e-4)
    assert np.ptp(one[:, 0]) > 0.0 and not one[:, 1].any()
    two = rates("gyro_mems", [0, 0, 0], 200, white=0.0, walk_y=1e-4)
    assert np.ptp(two[:, 1]) > 0.0 and not two[:, 0].any()
    start = [rates("gyro_fog", [0, 0, 0], optical=0.0, turn_on=1e-3, seed=s)[0] for s in range(200)]
    assert np.std(start) == pytest.approx(1e-3, rel=0.2)  # 5 % standard deviation of it


# ------------------------------------------------------------------------------------------------ fibre
def fog(w: float, **given: Any) -> float:
    return float(rates("gyro_fog", [w, 0.0, 0.0], **FOG_QUIET, **given)[0, 0])


def test_sagnac_factor_from_the_path_difference():
    """A loop of radius a turned by w: c dt = 4 A w/c for an area A a turn; dphi = 2 pi c dt/lambda; L = pi D turns."""
    length, diameter, wavelength, w = 500.0, 0.08, 1.31e-6, 0.1
    turns = length / (math.pi * diameter)
    dt = 4.0 * math.pi * (0.5 * diameter) ** 2 * turns * w / C**2
    part = Native("gyro_fog", **FOG_QUIET, length=length, diameter=diameter, wavelength=wavelength)
    part.omega = [w, 0.0, 0.0]
    part.initialize()
    part.do_step(0.0, 1e-3)
    assert part.phase[0] == pytest.approx(2.0 * math.pi * C * dt / wavelength, rel=1e-12)


def test_scale_factor_follows_the_coil_not_the_surroundings():
    """The coil starts at the temperature of its surroundings; 30 K more reach it as 1 - exp(-t/lag)."""
    part = Native("gyro_fog", **FOG_QUIET, coil_T=2e-6, wavelength_T=7e-6, lag=10.0, gradient=0.0)
    part.omega = [0.1, 0.0, 0.0]
    part.temperature = 5.0
    part.initialize()
    part.do_step(0.0, 0.1)
    assert part.rate[0] == pytest.approx(0.1 * (1 - 5e-6 * 5.0), rel=1e-12)
    part.temperature = 35.0
    for k in range(1, 101):
        part.do_step(0.1 * k, 0.1)
    assert part.rate[0] == pytest.approx(0.1 * (1 - 5e-6 * (5.0 + 30.0 * (1 - math.exp(-1.0)))), rel=1e-12)


def test_shupe_from_its_integral():
    """n/(L D) (dn/dT + n alpha) times the integral of T'(z) (L - 2 z), T' falling linearly along the fibre."""
    length, diameter, gradient, lag = 800.0, 0.12, 2e-3, 50.0
    z = np.linspace(0.0, length, 100_001)
    warming = 30.0 / lag  # K/s, at the beginning
    integral = np.trapezoid(warming * gradient * (1 - z / length) * (length - 2 * z), z)
    part = Native("gyro_fog", **FOG_QUIET, length=length, diameter=diameter, gradient=gradient, lag=lag, index=1.46)
    part.initialize()
    part.temperature = 30.0
    part.do_step(0.0, 1e-6)
    assert part.rate[0] == pytest.approx(1.46 * 1e-5 / (length * diameter) * integral, rel=1e-6)


def test_open_loop_is_a_sine_that_folds():
    S = 2.0 * math.pi * 1000.0 * 0.1 / (1.55e-6 * C)
    assert fog(0.3, closed=0.0) == pytest.approx(math.sin(0.3 * S) / S, rel=1e-12)
    assert fog(0.3, closed=0.0, depth=2.0, depth_error=0.1, power_error=-0.2) == pytest.approx(
        0.8 * math.sin(2.2) / math.sin(2.0) * math.sin(0.3 * S) / S, rel=1e-12
    )
    part = Native("gyro_fog", **FOG_QUIET, closed=0.0)
    part.omega = [2.0, 0.0, 0.0]  # phase 2.7 rad
    part.initialize()
    part.do_step(0.0, 1e-3)
    assert part.saturated == 1.0
    assert fog(2.0) == pytest.approx(2.0, rel=1e-12)  # closed loop


def test_reset_error_from_a_ramp_that_is_reset():
    """A ramp of one step a transit time, reset by 2 pi (1 + e): the loop integrates the phase that is left.

    Each transit time: left = phi - step, in the transit of a reset phi - step + 2 pi e more; step += 0.2 sin(left).
    """
    phi, error, gain = 0.4321, 0.01, 0.02
    step, ramp, flown, steps = 0.0, 0.0, 0.0, 0
    total, n = 0.0, 400_000
    for k in range(n):
        ramp += step
        left = phi - step
        if ramp > 2.0 * math.pi:  # the voltage falls by 2 pi (1 + e); 2 pi of it are no phase
            ramp -= 2.0 * math.pi
            left += 2.0 * math.pi * error
            flown += 1
        step += gain * math.sin(left)
        if k >= n // 4:
            total, steps = total + step, steps + 1
    assert flown > 10_000
    assert total / steps == pytest.approx(phi / (1.0 - error), rel=2e-4)
    S = 2.0 * math.pi * 1000.0 * 0.1 / (1.55e-6 * C)
    assert fog(phi / S, reset_error=error) == pytest.approx(phi / S / (1.0 - error), rel=1e-12)


def test_dead_band():
    assert fog(0.9e-3, dead_band=1e-3) == 0.0
    assert fog(-2e-3, dead_band=1e-3) == pytest.approx(-math.sqrt(3.0) * 1e-3, rel=1e-12)


def test_shot_noise_from_photons():
    """Electrons of each half period of the modulation by chance; the phase is half their difference over the slope."""
    rng = np.random.default_rng(4)
    power, depth, half, n = 3e-6, 2.0, 1e-6, 200_000
    per_half = 0.5 * power * (1 + math.cos(depth)) * half / E
    plus, minus = rng.poisson(per_half, n), rng.poisson(per_half, n)
    slope = 0.5 * power * math.sin(depth) * half / E  # electrons per rad
    phase = (plus - minus) / (2.0 * slope)
    part = Native("gyro_fog", power=power, depth=depth, load=1e15, linewidth=1.0)
    part.initialize()
    S = 2.0 * math.pi * 1000.0 * 0.1 / (1.55e-6 * C)
    assert part.density * S == pytest.approx(phase.std() * math.sqrt(2.0 * half), rel=0.01)  # 0.16 % its sd


def test_thermal_and_excess_noise():
    """Johnson current 4 k T/R one-sided, half of it two-sided; thermal light has the variance of its mean a coherence
    time: relative density lambda2/(c dlambda), by I0 = (P/2)(1 + cos) over the slope (P/2) sin."""
    S = 2.0 * math.pi * 1000.0 * 0.1 / (1.55e-6 * C)
    depth, power = 1.8, 1e-3
    shot = 2.0 * E / (power * (1 - math.cos(depth)))
    slope = 0.5 * power * math.sin(depth)
    thermal = Native("gyro_fog", power=power, depth=depth, load=1.0, linewidth=1.0)
    thermal.initialize()
    johnson = 0.5 * 4.0 * 1.380649e-23 * 300.0 / 1.0 / slope**2
    assert (thermal.density * S) ** 2 == pytest.approx(johnson + shot, rel=1e-3)
    excess = Native("gyro_fog", power=power, depth=depth, load=1e15)
    excess.initialize()
    relative = (1.55e-6) ** 2 / (C * 3e-8) * ((1 + math.cos(depth)) / math.sin(depth)) ** 2
    assert (excess.density * S) ** 2 == pytest.approx(relative + shot, rel=1e-9)


# ------------------------------------------------------------------------------------------------ ring laser
def beat(w, k: float, band: float, until: float, psi: np.ndarray, dither=lambda t: 0.0) -> np.ndarray:
    """Phase at the end of psi' = k (w + dither - band sin psi)."""
    found = solve_ivp(
        lambda t, y: k * (w + dither(t) - band * np.sin(y)), (0.0, until), psi, method="DOP853", rtol=1e-9, atol=1e-9
    )
    return found.y[:, -1]


def laser(w: float, **given: Any) -> float:
    return float(rates("gyro_laser", [w, 0.0, 0.0], **LASER_QUIET, **given)[0, 0])


@pytest.mark.parametrize("ratio", [0.5, 1.05, 1.5, 4.0])
def test_lock_in_rate_by_integration(ratio):
    """From psi = 0, three whole beats in the time that the closed form gives them."""
    band, k = 1e-3, 1e4
    w = ratio * band
    expected = laser(w, lock_in=band, dither=0.0)
    if ratio < 1.0:
        end = beat(w, k, band, 5.0, np.array([0.0]))[0]
        assert expected == 0.0 and end == pytest.approx(math.asin(ratio), abs=1e-6)
        return
    period = 2.0 * math.pi / (k * math.sqrt(w * w - band * band))
    turned = beat(w, k, band, 3.0 * period, np.array([0.0]))[0]
    assert turned == pytest.approx(6.0 * math.pi, abs=1e-5)
    assert expected == pytest.approx(2.0 * math.pi / (k * period), rel=1e-12)
    assert laser(-w, lock_in=band, dither=0.0) == -expected


@pytest.mark.long
def test_random_walk_of_dithered_lock_in_by_integration():
    """1000 rings, 10 cycles, amplitude of each cycle by chance: variance of the angle N2 t, 4.5 % its deviation.

    A small rate turns the beat phase by 2.4 rad a cycle, as any input does: without it the phase settles where lock-in
    acts least, and the walk is smaller.
    """
    rng = np.random.default_rng(11)
    k, band, dither, cycles, rings = 2.0 * math.pi * 100.0, 0.01, 1.0, 10, 1000
    psi = rng.uniform(0.0, 2.0 * math.pi, rings)
    start = psi.copy()
    for _ in range(cycles):
        amplitude = dither * (1.0 + 0.1 * rng.normal(size=rings))
        psi = beat(2.4 / k, k, band, 1.0, psi, lambda t, a=amplitude: a * math.cos(2.0 * math.pi * t))
    variance = np.var((psi - start) / k)
    # the same ring: area and perimeter that give k, f = 1 Hz
    area = k * 632.8e-9 * 0.3 / (8.0 * math.pi)
    part = Native("gyro_laser", area=area, lock_in=band, dither=dither, dither_f=1.0, dither_noise=0.1)
    part.initialize()
    assert part.density**2 * cycles == pytest.approx(variance, rel=0.2)


@pytest.mark.long
def test_beyond_the_dither_by_integration():
    """w above the dither amplitude: no crossing, the scale factor error of lock-in that is left."""
    k, band, dither, w = 2.0 * math.pi * 100.0, 0.05, 1.0, 1.5
    psi = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
    end = beat(w, k, band, 20.0, psi, lambda t: dither * math.cos(2.0 * math.pi * t))
    mean = np.mean(end - psi) / (20.0 * k)
    area = k * 632.8e-9 * 0.3 / (8.0 * math.pi)
    found = laser(w, area=area, lock_in=band, dither=dither, dither_f=1.0, dither_noise=0.1)
    assert found - w == pytest.approx(-(band**2) / (2.0 * math.sqrt(w * w - dither * dither)), rel=1e-9)
    assert mean - w == pytest.approx(found - w, rel=0.02)  # third order in band/w


def test_dither_left_in_the_output():
    """Mean of W cos over each step; nothing is left over whole cycles."""
    found = rates("gyro_laser", [0.0, 0.0, 0.0], 1000, 1e-4, **LASER_QUIET, lock_in=0.0, stripped=0.0, dither_f=400.0)
    assert found[3, 0] == pytest.approx(
        100.0 * DEG * (math.sin(2 * math.pi * 0.16) - math.sin(2 * math.pi * 0.12)) / (2 * math.pi * 0.04), rel=1e-9
    )
    assert abs(found[:, 0].mean()) < 1e-12 and found[:, 0].std() == pytest.approx(100 * DEG / math.sqrt(2), rel=0.01)


def test_langmuir_bias():
    assert laser(0.01, lock_in=0.0, langmuir=2e-3, current_difference=1e-3) == pytest.approx(0.01 + 2e-6, rel=1e-12)


# ------------------------------------------------------------------------------------------------ data sheet form
@pytest.mark.long
def test_filter_is_a_butterworth():
    """A sine at the bandwidth comes out at 1/sqrt(2); noise rms by the noise bandwidth, pi/(2 sqrt 2) times 2 B N2."""
    part = Native("gyro_mems", **MEMS_QUIET, bandwidth=20.0)
    part.initialize()
    h, n = 1e-4, 20_000
    out = np.empty(n)
    for k in range(n):
        part.omega = [0.1 * math.sin(2 * math.pi * 20.0 * (k + 0.5) * h), 0.0, 0.0]
        part.do_step(k * h, h)
        out[k] = part.rate[0]
    assert out[n // 2 :].std() == pytest.approx(0.1 / 2.0, rel=1e-3)  # 0.1/sqrt(2) as rms, times 1/sqrt(2)
    noisy = rates("gyro_mems", [0, 0, 0], 100_000, 1e-3, white=1e-3, bandwidth=20.0)
    noise_bandwidth = math.pi / (2.0 * math.sqrt(2.0)) * 20.0
    assert noisy.std() == pytest.approx(1e-3 * math.sqrt(2.0 * noise_bandwidth), rel=0.03)


def test_sheet_terms_by_hand():
    found = rates(
        "gyro_mems", [0.5, -0.4, 0.3], **MEMS_QUIET, axes=[[1.0, 0.01, 0.02], [0.03, 1.0, 0.0]], cubic=1e-3,
        g=[[1e-4, 0.0, 0.0], [0.0, 0.0, -2e-4]], f=[2.0, 0.0, 9.8],
    )[0]  # fmt: skip
    x, y = 0.5 - 0.004 + 0.006, -0.4 + 0.015
    assert found == pytest.approx([x + 1e-3 * x**3 + 2e-4, y + 1e-3 * y**3 - 2e-4 * 9.8], rel=1e-12)


def test_word_and_output_rate():
    found = rates("gyro_mems", [0.0123, 0.0, 0.0], 1, **MEMS_QUIET, resolution=1e-3)[0]
    assert found[0] == pytest.approx(0.012, rel=1e-12)
    held = rates("gyro_mems", [0.0, 0.0, 0.0], 100, white=1e-3, period=0.01)[:, 0]
    changes = np.flatnonzero(np.diff(held)) + 1
    assert np.all(np.diff(changes) == 10)


# ------------------------------------------------------------------------------------------------ refusals
@pytest.mark.parametrize(
    ("name", "given", "said"),
    [
        ("gyro_laser", {"area": 8e-3}, "has less than perimeter2"),  # 0.3 m2/(4 pi) = 7.16e-3 m2
        ("gyro_laser", {"dither_noise": 1e-4}, "not random"),
        ("gyro_mems", {"axes": [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0]]}, "unit vector"),
        ("gyro_fog", {"mount": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]}, "left-handed"),
    ],
)
def test_refused(name, given, said):
    with pytest.raises(ComponentError, match=said):
        load_part(name)(**given).initialize()
