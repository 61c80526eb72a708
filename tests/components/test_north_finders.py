"""North finders against headings that are put in: without noise exact, with noise as their sigma says.

The rates are written from v_b = C v_ENU with scipy's rotations, no code of the parts.
[NORTH-COMMON, NORTH-2POS, NORTH-4POS, NORTH-CONT, NORTH-TILT, NORTH-STRAPDOWN; GSP ch. 5, eq. 5-44..5-65]
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gyrobench.packaging import load_part
from gyrobench.packaging.instance import InstanceError, Plain

W, G = 7.2921159e-5, 9.80665
DPH = math.pi / 648000.0
PLANS = {
    "two_position": [0.0, math.pi],
    "four_position": [-k * math.pi / 2 for k in range(4)],
    "multi_position": [0.0, -1.0, -2.2, -3.3, -4.9],
    "strapdown": [0.0, math.pi],
}


def seen(heading: float, pitch: float, roll: float, latitude: float, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Rate and specific force along the axes of a head turned by ``angle`` about its z axis."""
    C = Rotation.from_euler("ZXY", [-heading, pitch, roll]).as_matrix().T
    turned = Rotation.from_euler("z", angle).as_matrix().T @ C
    return turned @ [0.0, W * math.cos(latitude), W * math.sin(latitude)], turned @ [0.0, 0.0, G]


def find(
    part: str, heading: float, latitude: float, *, pitch: float = 0.0, roll: float = 0.0,
    bias: tuple[float, float] = (0.0, 0.0), accelerometer: float = 0.0, drift: float = 0.0,
    angles: list[float] | None = None, noise: float = 0.0, seed: int = 0, dwell: int = 20, power: int = 1,
    word: float = 0.0, **parameters: float,
) -> dict[str, float]:  # fmt: skip
    """Outputs of a finder after its plan: positions of ``dwell`` steps of 0.1 s, or one turn of 360 steps."""
    h = 0.1
    rng = np.random.default_rng(seed)
    plain = Plain(load_part(f"northfinder_{part}"))
    plain.set({"latitude": latitude, "gravity": G, "every": 1e9, **parameters})
    positions = angles if angles is not None else PLANS.get(part)
    turning = positions is None
    rows = []
    for k, a in enumerate(positions if positions is not None else [0.0]):
        for j in range((360 if turning else dwell) + 1):
            rows.append((k + 1, -j * 2 * math.pi / 360 if turning else a))
    plain.initialize(0.0)
    for n, (phase, angle) in enumerate(rows):
        w, f = seen(heading, pitch, roll, latitude, angle)
        rate = w[:2] + np.array(bias) + drift * (n * h) ** power + noise / math.sqrt(h) * rng.normal(size=2)
        rate = np.round(rate / word) * word if word else rate
        last = float(n == len(rows) - 1)
        plain.set({"rate[1]": rate[0], "rate[2]": rate[1], "f[1]": f[0] + accelerometer, "f[2]": f[1] + accelerometer,
                   "f[3]": f[2], "angle": angle, "gate": 1.0, "phase": float(phase), "finished": last})  # fmt: skip
        plain.step(n * h, h)
    names = ("heading", "sigma", "bias", "horizontal", "status")
    return dict(zip(names, plain.get(names), strict=True))


def apart(a: float, b: float) -> float:
    return math.remainder(a - b, 2.0 * math.pi)


@pytest.mark.parametrize("part", [*PLANS, "continuous", "tilt"])
def test_exact_without_noise(part: str) -> None:
    rng = np.random.default_rng(3)
    for _ in range(4):
        latitude = float(rng.uniform(-1.3, 1.3))
        heading = float(rng.uniform(0.6, 2.5) if part == "two_position" else rng.uniform(-math.pi, math.pi))
        attitude = (
            {"pitch": float(rng.uniform(-1, 1)), "roll": float(rng.uniform(-1, 1))} if part == "strapdown" else {}
        )
        bias = (0.3 * DPH, -0.2 * DPH)
        found = find(part, heading, latitude, bias=bias, **attitude)
        assert abs(apart(found["heading"], heading)) < 1e-9
        assert found["status"] == 1.0
        if part != "strapdown" or not attitude:
            assert found["bias"] == pytest.approx(bias[1], abs=1e-12)
        assert found["horizontal"] == pytest.approx(W * math.cos(latitude), rel=1e-9)


@pytest.mark.parametrize(
    ("part", "gain"),
    [("two_position", 1.0 / math.sin(1.2)), ("four_position", 2**0.5), ("continuous", 2**0.5), ("strapdown", 1.0)],
)
@pytest.mark.long
def test_sigma(part: str, gain: float) -> None:
    """sigma = g N / (A sqrt(T)), and the scatter of 60 runs is that within three of its standard deviations (28 %)."""
    N, latitude, heading = 0.01 * DPH, 0.7, 1.2
    found = [find(part, heading, latitude, noise=N, seed=k, density=N, dwell=10) for k in range(60)]
    T = (360 if part == "continuous" else 10 * len(PLANS[part])) * 0.1
    expected = gain * N / (W * math.cos(latitude) * math.sqrt(T))
    assert found[0]["sigma"] == pytest.approx(expected, rel=0.02)
    errors = np.array([apart(f["heading"], heading) for f in found])
    assert float(np.sqrt(np.mean(errors**2))) == pytest.approx(expected, rel=3.0 / math.sqrt(2 * 60))


@pytest.mark.parametrize(
    ("part", "heading", "arcmin"),
    [
        ("two_position", 90.0, 5.1),
        ("two_position", 60.0, 6.0),
        ("two_position", 30.001, 10.4),
        ("four_position", 17.0, 7.3),
        ("continuous", -140.0, 7.1),
        ("strapdown", 75.0, 5.1),
    ],
)
def test_sigma_of_the_table(part: str, heading: float, arcmin: float) -> None:
    """0.005 deg/sqrt(h), 300 s, 40 deg: the figures of the method within 3 %, by sigma ~ 1/sqrt(T) from a shorter plan.

    Strapdown: both axes for 300 s.
    """
    N = 0.3 * DPH  # rad/s/sqrt(Hz)
    found = find(part, math.radians(heading), math.radians(40.0), density=N)
    T = (360 if part == "continuous" else 20 * len(PLANS[part])) * 0.1
    assert found["status"] == 1.0
    assert math.degrees(found["sigma"] * math.sqrt(T / 300.0)) * 60.0 == pytest.approx(arcmin, rel=0.03)


def test_two_positions_near_north() -> None:
    """5 deg from north the errors are 66', of 100 000 headings by arccos, and 0.6 % of the cosines exceed 1; the finder
    states its heading as ill-conditioned.
    """
    psi, spread = math.radians(5.0), 0.3 * DPH / math.sqrt(300.0) / (W * math.cos(math.radians(40.0)))
    c = math.cos(psi) + spread * np.random.default_rng(6).normal(size=100_000)
    off = np.arccos(np.clip(c, -1.0, 1.0)) - psi
    assert math.degrees(float(np.sqrt(np.mean(off**2)))) * 60.0 == pytest.approx(66.0, rel=0.03)
    assert float(np.mean(c > 1.0)) == pytest.approx(0.006, abs=1e-3)
    assert find("two_position", psi, math.radians(40.0))["status"] == 2.0


def test_sigma_of_a_tilted_strapdown_head() -> None:
    """Pitch 0.5, roll -0.4: the errors of 60 runs have the sigma that is stated, larger than that of a level head."""
    N, latitude, heading = 0.01 * DPH, 0.7, 1.2
    attitude = {"pitch": 0.5, "roll": -0.4}
    found = [find("strapdown", heading, latitude, noise=N, seed=k, density=N, dwell=10, **attitude) for k in range(60)]
    # d psi = (n dE - e dN)/(e2 + n2), e, n = A cos(pitch) cos(roll) (sin, cos) psi, dE = -ct dx + sg st dy, dN = cg dy
    ct, st, cg, sg = math.cos(0.5), math.sin(0.5), math.cos(0.4), -math.sin(0.4)
    x, y = math.cos(heading) * ct, math.cos(heading) * sg * st - math.sin(heading) * cg
    expected = N / math.sqrt(2.0) * math.hypot(x, y) / (W * math.cos(latitude) * ct * cg)
    assert found[0]["sigma"] == pytest.approx(expected, rel=0.05)
    errors = np.array([apart(f["heading"], heading) for f in found])
    assert float(np.sqrt(np.mean(errors**2))) == pytest.approx(expected, rel=3.0 / math.sqrt(2 * 60))


def test_there_and_back_cancels_a_linear_drift() -> None:
    """r = 0.02 deg/h in 300 s; forwards the error is (r T/2)(cos + sin)/(2 A), here T = 8.2 s of four positions."""
    latitude, heading, r = 0.7, 0.5, 1e-3 * DPH
    there = PLANS["four_position"]
    A = W * math.cos(latitude)
    once = find("four_position", heading, latitude, drift=r)
    # means of the positions lie 2.1 s apart: w_3 - w_1 = 4.2 r, w_4 - w_2 = 4.2 r
    expected = 4.2 * r * (math.cos(heading) + math.sin(heading)) / (2.0 * A)
    assert apart(once["heading"], heading) == pytest.approx(expected, rel=1e-3)
    back = find("four_position", heading, latitude, drift=r, angles=[*there, *there[::-1]])
    assert abs(apart(back["heading"], heading)) < 1e-3 * abs(expected)


def test_ramp_takes_a_linear_drift() -> None:
    found = find("continuous", -2.0, 0.9, drift=1e-3 * DPH, ramp=1.0)
    assert abs(apart(found["heading"], -2.0)) < 1e-7


def test_seeking_the_null_of_two_positions() -> None:
    """Pairs there and back, the head at the angle commanded; turn = psi - 90 deg after a pair, sigma of three pairs."""
    latitude, psi, bias, density = 0.7, 0.3, 3e-6, 1e-7
    plain = Plain(load_part("northfinder_null_seeking"))
    plain.set({"latitude": latitude, "every": 1e9, "rough": 1.0, "density": density})
    plain.initialize(0.0)
    rows = [(p, 0.0 if (p // 2) % 2 == 0 else math.pi, float(j > 2)) for p in range(1, 9) for j in range(24)]
    angle = 0.0
    for n, (phase, target, gate) in enumerate([*rows, (8, math.pi, 0.0)]):
        rate = W * math.cos(latitude) * math.cos(psi - angle) + bias
        plain.set({"rate[2]": rate, "f[3]": G, "angle": angle, "gate": gate, "phase": float(phase), "target": target,
                   "finished": float(n == len(rows))})  # fmt: skip
        plain.step(n * 0.1, 0.1)
        angle = plain.get(["command"])[0]
        if n == 2 * 24 + 2:
            assert apart(angle, psi - math.pi / 2 + math.pi) == pytest.approx(0.0, abs=1e-9)
    heading, sigma, found, status = plain.get(["heading", "sigma", "bias", "status"])
    assert heading == pytest.approx(psi, abs=1e-9) and found == pytest.approx(bias, rel=1e-6) and status == 1.0
    time = 6 * 20 * 0.1  # three pairs; the first sample of a phase is not taken
    assert sigma == pytest.approx(density / (W * math.cos(latitude) * math.sqrt(time)), rel=1e-9)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_drift_of_any_order_is_taken_out(order: int) -> None:
    """w = A cos + b + r t^order of 1e-3 deg/h at 1 s, by the normal equations of six unknowns; sigma from numpy's."""
    turn = np.linspace(0.0, -2.0 * math.pi, 361)
    t = 0.1 * np.arange(361)
    X = np.column_stack([np.cos(turn), np.sin(turn), *(t**k for k in range(order + 1))])[1:]
    P = np.linalg.inv(0.1 * X.T @ X)
    found = find("continuous", -2.0, 0.9, drift=1e-3 * DPH, power=order, ramp=float(order), density=1e-8)
    assert abs(apart(found["heading"], -2.0)) < 1e-6
    c, s = math.cos(-2.0), math.sin(-2.0)
    A = W * math.cos(0.9)
    expected = 1e-8 * math.sqrt(s * s * P[0, 0] - 2.0 * s * c * P[0, 1] + c * c * P[1, 1]) / A
    assert found["sigma"] == pytest.approx(expected, rel=0.02)
    less = find("continuous", -2.0, 0.9, drift=1e-3 * DPH, power=order, ramp=order - 1.0)
    assert abs(apart(less["heading"], -2.0)) > 1e-5


def test_tilt_by_tangent_of_latitude() -> None:
    """10 mrad about north at 40 deg: 10e-3 tan(40 deg) = 28.85'; compensated below 0.12', with 1 mg bias as well."""
    latitude, heading, tilt = math.radians(40.0), 0.0, 0.01
    arcmin = math.radians(1.0 / 60.0)
    plain = find("continuous", heading, latitude, roll=tilt)
    assert abs(apart(plain["heading"], heading)) / arcmin == pytest.approx(28.85, rel=0.01)
    level = find("tilt", heading, latitude, roll=tilt, accelerometer=1e-3 * G)
    assert abs(apart(level["heading"], heading)) < 0.12 * arcmin
    about_east = find("continuous", heading, latitude, pitch=tilt)
    assert abs(apart(about_east["heading"], heading)) < 0.12 * arcmin


def test_biases_of_a_strapdown_head() -> None:
    """-b cos(psi) / A of the x gyro, tan(latitude) mrad for 1 mg of the x accelerometer; two positions remove both."""
    latitude, heading, b = 0.7, 0.7, 0.01 * DPH
    one = find("strapdown", heading, latitude, bias=(b, 0.0), angles=[0.0])
    assert apart(one["heading"], heading) == pytest.approx(-b * math.cos(heading) / (W * math.cos(latitude)), rel=1e-2)
    two = find("strapdown", heading, latitude, bias=(b, 5 * b), accelerometer=1e-3 * G)
    assert abs(apart(two["heading"], heading)) < 1e-9 and two["bias"] == pytest.approx(5 * b, rel=1e-9)
    north = find("strapdown", 0.0, latitude, accelerometer=1e-3 * G, angles=[0.0])
    assert abs(north["heading"]) == pytest.approx(math.tan(latitude) * 1e-3, rel=0.01)


def test_status() -> None:
    """Too few positions, a wrong latitude, a base that accelerates, two positions near north; a difference of two
    positions that no latitude gives, a head on end.
    """
    assert find("multi_position", 1.0, 0.7, angles=[0.0, -1.0])["status"] == 2.0
    assert find("four_position", 1.0, 0.7, angles=[0.0, -math.pi / 2])["status"] == 2.0
    assert find("two_position", 0.2, 0.7)["status"] == 2.0
    assert find("four_position", 1.0, 0.7, earth_rate=W * 1.3)["status"] == 3.0
    assert find("four_position", 1.0, 0.7, gravity=G * 1.01)["status"] == 4.0
    assert find("two_position", 0.2, 0.7, earth_rate=W * 0.8)["status"] == 3.0
    assert find("strapdown", 1.0, 0.7, pitch=math.radians(86.0))["status"] == 2.0
    assert find("strapdown", 1.0, 0.7, roll=math.radians(-86.0))["status"] == 2.0
    with pytest.raises(InstanceError, match="stands upright"):
        find("tilt", 1.0, 0.7, pitch=math.pi / 2.0, gravity=0.999 * G)


@pytest.mark.parametrize("part", [*PLANS, "continuous"])
def test_readings_alike_in_all_positions_give_no_heading(part: str) -> None:
    """Words of 1 deg/s read the Earth rate as zero: no heading; sigma was NaN, and the run ended with an error.  Two
    positions, which know the size of the rate, and a strapdown head, which knows the vertical one, still have one.
    """
    found = find(part, 1.0, 0.7, word=math.radians(1.0))
    assert all(math.isfinite(v) for v in found.values())
    assert (found["status"] == 1.0) == (part == "two_position")


def test_done_follows_the_last_estimate() -> None:
    """One second after the end of the plan, so that whoever records once a second has the last heading."""
    plain = Plain(load_part("northfinder_continuous"))
    plain.initialize(0.0)
    done = []
    for n in range(40):
        plain.set({"finished": float(n >= 10)})
        plain.step(n * 0.1, 0.1)
        done += plain.get(["done"])
    # finished in the step that ends at 1.1 s; 1 s later, at the end of step 20 (2.1 s)
    assert done.index(1.0) in (20, 21) and all(done[21:])


def test_latitude_near_a_pole_is_refused() -> None:
    with pytest.raises(InstanceError, match="pole"):
        find("four_position", 1.0, math.radians(86.0))


def test_rate_and_force_by_hand() -> None:
    """(1 + scale) w + bias + ramp t; a white noise of density N leaves N/sqrt(T) in a mean."""
    gyro = Plain(load_part("gyro_rate"))
    N = 1e-6
    gyro.set({"scale[2]": 0.01, "bias[2]": 3e-6, "ramp[2]": 1e-7, "white_x": N, "white_y": 0.0, "bias[1]": 0.0})
    gyro.set({"omega[1]": 1e-5, "omega[2]": 2e-5})
    gyro.initialize(0.0)
    x = []
    for k in range(4000):
        gyro.step(k * 0.01, 0.01)
        x += gyro.get(["rate[1]"])
    assert gyro.get(["rate[2]"])[0] == pytest.approx(1.01 * 2e-5 + 3e-6 + 1e-7 * 40.0, rel=1e-9)
    assert float(np.std(x)) == pytest.approx(N / 0.1, rel=0.05) and abs(np.mean(x) - 1e-5) < 4 * N / math.sqrt(40.0)
    triad = Plain(load_part("accelerometer_triad"))
    triad.set({"scale[3]": -0.01, "bias[3]": 0.5, "white_z": 0.0, "f[3]": 10.0})
    triad.initialize(0.0)
    triad.step(0.0, 0.01)
    assert triad.get(["f_read[3]"])[0] == pytest.approx(0.99 * 10.0 + 0.5, rel=1e-12)
