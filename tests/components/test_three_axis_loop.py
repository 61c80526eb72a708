"""Platform and decoupler in their loop: stability over azimuth, cross axes, isolation, the 83-mil bench.

Gyros (mounting of GYRO-OA-COUPLING-Y2) and controllers are written here, exact for held inputs; 0.5 ms exchange.
"""

import math

import control
import numpy as np
import pytest
from native_parts import make
from scipy.linalg import expm
from scipy.signal import cont2discrete, detrend, lfilter

DEG = math.pi / 180.0
MIL = 2 * math.pi / 6000  # 83 mil = 4.98 deg
WC = 2 * math.pi * 10
H, D, J = 0.02, 0.02, 2.5e-5  # gyro: N.m.s, N.m.s, kg.m2
STEP = 5e-4
NEUTRAL = np.array([1.0, 2.0, 0.7])  # pitch, roll, azimuth: each drive is normalized by its inertia


def held(a, b, h):
    """x+ = A x + B u for u held over h."""
    n, m = b.shape
    whole = expm(np.block([[a, b], [np.zeros((m, n + m))]]) * h)
    return whole[:n, :n], whole[:n, n:]


def network():
    """F(s) K / J with |L(j wc)| = 1 for J = 1 behind the gyro: PLATFORM-1AXIS, PM 53.6 deg."""
    s = control.tf("s")
    f = (1 + WC / 15 / s) * (1 + 4 * s / WC) / (1 + s / (4 * WC))
    return control.ss(f / abs((f * (H / D) / (s * (J / D * s + 1)) / s)(1j * WC)))


def fly(theta, seconds, decoupled, command=lambda t: np.zeros(3), base=lambda t: (np.zeros(3), np.zeros(3))):
    """Attitude over time of the closed loop from these joint angles (A order), or None where it ran off."""
    platform = make("platform_three_axis", "native")
    part = make("decoupler_t2" if decoupled else "decoupler_none", "native")
    vector = lambda name: [f"{name}[{k}]" for k in (1, 2, 3)]  # noqa: E731
    motor = {n: x for k in (1, 2, 3) for n, x in ((f"L[{k}]", 0.0), (f"k_e[{k}]", 0.0), (f"R[{k}]", 1.0))}
    limits = {f"{n}[{k}]": 1e6 for n in ("v_max", "i_max") for k in (1, 2, 3)}
    platform.set(motor | limits | dict(zip(vector("theta_0"), theta, strict=True)))
    if decoupled:
        part.set({"theta_f_max": 80 * DEG})
    platform.initialize(), part.initialize()
    ga, gb = held(np.array([[0.0, 1.0], [0.0, -D / J]]), np.array([[0.0], [1.0]]), STEP)
    f = network()
    fa, fb = held(f.A, f.B, STEP)
    gyro, filt, rows = np.zeros((2, 3)), np.zeros((f.nstates, 3)), []
    names = [n for x in ("theta", "omega", "alpha", "attitude") for n in vector(x)]
    x = np.array(platform.get(names))
    for k in range(round(seconds / STEP)):
        t = k * STEP
        y2 = np.array([x[7], -x[8], x[7]])  # alpha_y, -alpha_z, alpha_y on the output axes
        gyro = ga @ gyro + gb * ((H * (x[3:6] - command(t)) + J * y2) / J)
        part.set(dict(zip(vector("u"), gyro[0], strict=True)) | dict(zip(vector("theta"), x[:3], strict=True)))
        part.step(t, STEP)
        u = np.array(part.get(vector("u_axes")))
        v = -NEUTRAL * ((f.C @ filt)[0] + f.D[0, 0] * u)
        filt = fa @ filt + fb * u
        wb, ab = base(t)
        inputs = {"v": v, "omega_b": wb, "alpha_b": ab}
        platform.set({n: float(e) for name, a in inputs.items() for n, e in zip(vector(name), a, strict=True)})
        platform.step(t, STEP)
        x = np.array(platform.get(names))
        rows.append(x[9:12])
        if not np.max(np.abs(x[3:6])) < 5.0:
            rows = None
            break
    platform.free(), part.free()
    return None if rows is None else np.array(rows)


@pytest.mark.parametrize("azimuth", [40.0, 60.0, 80.0])
@pytest.mark.long
def test_stability_over_azimuth(azimuth):
    """F16: margin 53.6 deg less 2 deg of exchange: stable at 40, unstable at 60, 80 deg; with T2 always stable."""

    def pulse(t):
        return np.array([0.01 if t < 0.1 else 0.0, 0.0, 0.0])

    for decoupled, stable in ((False, azimuth < 50), (True, True)):
        path = fly([0.0, 0.0, azimuth * DEG], 1.6, decoupled, pulse)
        if path is None:
            assert not stable
            continue
        rate = np.linalg.norm(np.diff(path, axis=0), axis=1)
        early, late = np.sqrt(np.mean(rate[400:800] ** 2)), np.sqrt(np.mean(rate[-400:] ** 2))
        assert (late < 0.5 * early) if stable else (late > 2 * early)


def cross(path, hertz):
    """rms of y and z (together) against x over whole periods at the end."""
    end = path[-round(2 / hertz / STEP) :]
    x, y, z = (np.std(detrend(end[:, k])) for k in range(3))
    return math.hypot(y, z) / x


@pytest.mark.parametrize(
    "theta, hertz, spec",
    [
        ((20, 0, 30), 1.0, (0.0172, 0.00020)),
        ((40, 10, 30), 1.0, (0.0190, 0.00133)),
        ((40, 10, 30), 3.0, (0.164, 0.0112)),
    ],
)
@pytest.mark.long
def test_cross_axes_of_a_commanded_sine(theta, hertz, spec):
    """[DECOUPLE-BENCH-83MIL] x command of a third of 83 mil; cross over main with and without T2, ratio <= 0.1."""
    amplitude = 83 * MIL / 3 * 2 * math.pi * hertz

    def command(t):
        return np.array([amplitude * math.cos(2 * math.pi * hertz * t) * min(1.0, t), 0.0, 0.0])

    without, with_t2 = (cross(fly([a * DEG for a in theta], 1.0 + 3 / hertz, d, command), hertz) for d in (False, True))
    assert with_t2 <= 0.1 * without
    assert without == pytest.approx(spec[0], rel=0.02)
    assert with_t2 == pytest.approx(spec[1], rel=0.02)


@pytest.mark.long
def test_base_motion_is_isolated():
    """F17: 83-mil sines at 0.5, 0.7, 0.9 Hz about x, y, z: >= 40 dB with T2."""
    w = 2 * math.pi * np.array([0.5, 0.7, 0.9])
    size = 83 * MIL

    def base(t):
        ramp, slope = (t, 1.0) if t < 1 else (1.0, 0.0)
        rate = size * w * np.cos(w * t)
        return rate * ramp, -size * w * w * np.sin(w * t) * ramp + rate * slope

    path = fly([20 * DEG, 0.0, 30 * DEG], 5.0, True, base=base)
    left = [np.std(detrend(path[round(2 / STEP) :, k])) for k in range(3)]
    assert max(left) < size / math.sqrt(2) / 100
    assert 20 * math.log10(max(left) / (size / math.sqrt(2))) == pytest.approx(-44.8, abs=1.0)  # DECOUPLE-BENCH-83MIL


@pytest.mark.parametrize(
    "theta, without, with_t2",
    [((0, 0), (6.2, 6.2), (0.137, 0.137)), ((20, 30), (57, 58), (0.13, 0.15)), ((40, 60), (170, 173), (0.10, 0.18))],
)
def test_signal_chain_of_the_83_mil_bench(theta, without, with_t2):
    """F11: gimbal rates -> T1 -> rebalanced gyros (50 Hz, 0.7) -> T2, angles swing by 83 mil about (pitch, azimuth)."""
    h = 1e-3
    t = np.arange(0, 12, h)
    hertz = {"roll": 0.3, "pitch": 0.5, "azimuth": 0.8}
    swing = {n: 83 * MIL * np.sin(2 * math.pi * f * t) for n, f in hertz.items()}
    pitch, azimuth = theta[0] * DEG + swing["pitch"], theta[1] * DEG + swing["azimuth"]
    c, s, cf = np.cos(azimuth), np.sin(azimuth), np.cos(pitch)
    wn = 2 * math.pi * 50
    b, a, _ = cont2discrete(([wn**2], [1, 1.4 * wn, wn**2]), h, method="bilinear")
    part = make("decoupler_t2", "native")
    part.initialize()
    for drive, main in (("roll", 1), ("pitch", 0)):
        rates = np.zeros((2, t.size))
        rates[main] = np.gradient(swing[drive], h)
        gyros = lfilter(b[0], a, [c * rates[0] + cf * s * rates[1], -s * rates[0] + cf * c * rates[1]])
        out = np.zeros((2, t.size))
        for k in range(t.size):
            part.set({"u[1]": gyros[0, k], "u[2]": gyros[1, k], "theta[1]": pitch[k], "theta[3]": azimuth[k]})
            out[:, k] = part.get(["u_axes[1]", "u_axes[2]"])
        for y, (lo, hi) in ((gyros, without), (out, with_t2)):
            percent = 100 * np.std(y[1 - main, 2000:]) / np.std(y[main, 2000:])
            assert 0.98 * lo < percent < 1.02 * hi
    part.free()
