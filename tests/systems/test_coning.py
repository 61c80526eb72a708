"""Coning test: parts against SciPy's rotations, the closed form, files, mistakes, refusals.  [TEST-CONING]"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from scipy.spatial.transform import Rotation

from gyrobench.engine.session import Session
from gyrobench.linear.butterworth import butterworth_gain
from gyrobench.packaging import load_part
from gyrobench.system.system import load_system
from systems.coning_test.closed import Chain
from systems.coning_test.reduction import ConingSetup, Reduction

NAME = "coning_test"
DPH = math.pi / 648000.0
DEG = math.pi / 180.0
SHORT: dict[str, Any] = {"readings": 2, "cycles": 1, "window": 1.0, "nuisances": "none"}


# ------------------------------------------------------------------------------------------------ parts
def test_the_table_comes_back_to_where_it_was() -> None:
    """Its mean rates, with the commutation of a step by steps of 10 us, turn the plate into the attitude it reads."""
    h, f, theta = 1e-5, 40.0, 0.1
    table = load_part("table_coning")(ramp=0.01)
    table.frequency_wanted, table.half_angle_wanted = f, theta
    table.initialize()
    plate = Rotation.identity()
    for k in range(4000):
        table.do_step(k * h, h)
        plate = plate * Rotation.from_rotvec(h * np.array(table.omega))
    w, x, y, z = table.attitude
    assert table.half_angle == theta
    assert (plate * Rotation.from_quat([x, y, z, w]).inv()).magnitude() < 1e-6
    # a gyro on the axis of the cone: -w (1 - cos theta); across it w sin theta
    assert table.omega[2] == pytest.approx(-2.0 * math.pi * f * (1.0 - math.cos(theta)), rel=1e-9)
    assert math.hypot(*table.omega[:2]) == pytest.approx(2.0 * math.pi * f * math.sin(theta), rel=1e-6)
    up = Rotation.from_quat([x, y, z, w]).inv().apply([0.0, 0.0, 9.80665])
    assert table.f == pytest.approx(up, abs=1e-9)


def test_the_user_composes_rotations() -> None:
    """Random rotation vectors; Earth rate; the error is that of SciPy against a reference that stands still."""
    rng = np.random.default_rng(4)
    user = load_part("strapdown_attitude")()
    earth = np.array([1e-3, 2e-3, -3e-3])
    user.omega_local, user.gate = earth.tolist(), 1.0
    user.initialize()
    own = Rotation.identity()
    first = None
    for k in range(20):
        phi = 0.05 * rng.normal(size=3)
        user.dtheta, user.number = phi.tolist(), k + 1.0
        user.do_step(0.1 * k, 0.1)
        own = Rotation.from_rotvec(-0.1 * earth) * own * Rotation.from_rotvec(phi)
        first = own if first is None else first
        assert user.error == pytest.approx((own * first.inv()).as_rotvec(), abs=1e-12)


def test_counts_lose_no_angle() -> None:
    unit = load_part("angle_increments")(bandwidth=0.0, period=0.01, coning=False, resolution=1e-4)
    unit.rate = [0.01234, -0.2, 0.0]
    unit.initialize()
    total = np.zeros(3)
    for k in range(1000):
        before = unit.number
        unit.do_step(1e-3 * k, 1e-3)
        total += np.array(unit.dtheta) * (unit.number - before)
    assert total == pytest.approx([0.01234, -0.2, 0.0], abs=0.5001e-4)


# ------------------------------------------------------------------------------------------------ closed form
def test_the_share_that_is_computed() -> None:
    """Small half-angles: sin x/x of integrals, with 2/3 of pairs sin 2x/(2x) + 8/3 sin2(x/2) sin x/x; a filter: its
    squared gain 1/(1 + (f/b)^4); increments with coning of fine samples: 1.
    """
    for f in (3.0, 17.0, 35.0):
        x = 2.0 * math.pi * f * 0.01
        plain = Chain(0.01, 0.0, 0.0, False, 1).kappa(f, 1e-4)
        pairs = Chain(0.01, 0.0, 0.0, False, 2).kappa(f, 1e-4)
        assert plain == pytest.approx(math.sin(x) / x, abs=1e-6)
        two = math.sin(2.0 * x) / (2.0 * x) + 8.0 / 3.0 * math.sin(0.5 * x) ** 2 * math.sin(x) / x
        assert pairs == pytest.approx(two, abs=1e-6)
        assert Chain(0.01).kappa(f, 1e-4) == pytest.approx(1.0, abs=1e-5)
        assert Chain(0.01, 0.0, 50.0).kappa(f, 1e-4) == pytest.approx(1.0 / (1.0 + (f / 50.0) ** 4), abs=1e-5)
        assert abs(butterworth_gain(f, 50.0, 1e-5)) == pytest.approx((1.0 + (f / 50.0) ** 4) ** -0.5, rel=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_random_units_drift_as_the_closed_form_says(session: Session, seed: int) -> None:
    """Scale factors, misalignments, filter, algorithm and axis by chance, noise off; to first order of 1 % by hand.

    What is left: bias and g-sensitivity (10 and 2 deg/h) times the squared half-angle, 1e-3 deg/h; rotations of some
    arc minutes in the readings of a cone, which do not quite commute, 1e-5 of the rate of the cone.
    """
    rng = np.random.default_rng(seed)
    S = rng.uniform(-1e-2, 1e-2, size=(3, 3))
    axis = seed % 3
    values: dict[str, Any] = {
        "axis": "xyz"[axis], "frequencies": "5 -12 21", "half_angle": 0.5 * DEG, "samples": 1 + seed % 2,
        "coning": seed != 1, "bandwidth": (0.0, 90.0, 150.0)[seed],
    }  # fmt: skip
    quiet = dict.fromkeys(load_system(NAME).noises, 0.0)
    record = session.run({**SHORT, **values, **quiet, "imu.gyro_scale": S.tolist()})
    system = load_system(NAME).with_values({**SHORT, **values})
    result = system.reduce(record)
    found = {c.name: c for c in result.coefficients}
    chain = Chain(0.01, 5e-4, values["bandwidth"], values["coning"], values["samples"])
    for f in (5.0, -12.0, 21.0):
        c = 2.0 * math.pi * f * (1.0 - math.cos(0.5 * DEG))
        e = np.eye(3)[axis]
        kappa = chain.kappa(f, 0.5 * DEG)
        hand = c * ((kappa - 1.0) * e + (kappa * (np.trace(S) * np.eye(3) - S.T) - S) @ e)
        for k, a in enumerate("xyz"):
            name = f"d_{a}({f:g} Hz)".replace("-", "−")
            assert found[name].estimate == pytest.approx(found[name].truth, abs=1e-3 + 1e-5 * abs(c) / DPH)
            assert found[name].truth == pytest.approx(hand[k] / DPH, abs=2e-4 * abs(c) / DPH)


def test_an_error_that_has_grown_turns_with_the_earth(session: Session) -> None:
    """618 deg/h about the cone are 3.0e-3 rad/s: each second of them tilts the Earth's rate, 15.04 deg/h, by so much:
    0.045 deg/h across the cone, 7.3e-5 of the drift, that no closed form of the gyros has.
    """
    quiet = dict.fromkeys(load_system(NAME).noises, 0.0)
    values = {**SHORT, "frequencies": "20", "coning": False, "half_angle": 0.014, "latitude": 0.0}
    exact = {"imu.gyro_scale": [[0.0] * 3] * 3, "imu.gyro_bias": [0.0] * 3, "imu.g_sensitivity": [[0.0] * 3] * 3}
    record = session.run({**values, **quiet, **exact})
    found = {c.name: c.estimate for c in load_system(NAME).with_values(values).reduce(record).coefficients}
    for a in "xy":
        assert abs(found[f"d_{a}(20 Hz)"]) < 1.5e-5 * abs(found["d_z(20 Hz)"])


def test_set_up_errors_are_predicted(session: Session) -> None:
    """A case turned by 1 arc minute about x, a table that twists by 0.2 deg/h: in the budget's table of shifts."""
    turn = Rotation.from_rotvec([1.0 / 60.0 * DEG, 0.0, 0.0]).as_matrix().T
    quiet = dict.fromkeys(load_system(NAME).noises, 0.0)
    values = {**SHORT, "frequencies": "5 31", "coning": False, "half_angle": DEG}
    exact = {"imu.gyro_scale": [[0.0] * 3] * 3, "imu.gyro_bias": [0.0] * 3, "imu.g_sensitivity": [[0.0] * 3] * 3}
    record = session.run({**values, **quiet, **exact, "imu.mount": turn.tolist(), "table.twist": 0.2 * DPH})
    result = load_system(NAME).with_values(values).reduce(record)
    found = {c.name: c for c in result.coefficients}
    shift = {row[0]: row[-3] for t in result.tables if t.id.startswith("budget.predicted") for row in t.rows}
    assert len(shift) >= 4
    for name in ("d_z(5 Hz)", "d_z(31 Hz)", "d_y(5 Hz)", "d_y(31 Hz)"):
        assert found[name].estimate - found[name].truth == pytest.approx(shift[name], abs=1e-2)
    assert found["d_y(31 Hz)"].estimate == pytest.approx(found["d_z(31 Hz)"].estimate * 1.0 / 60.0 * DEG, rel=1e-2)


def test_a_half_angle_that_is_another_one(session: Session) -> None:
    """0.1 % wider, stated as u: theta sin theta/(1 - cos theta) = 2 - theta^2/6 of it, 0.2 % of the drift of all axes;
    by the same part the budget has it in u."""
    quiet = dict.fromkeys(load_system(NAME).noises, 0.0)
    values = {**SHORT, "frequencies": "31", "coning": False, "half_angle": DEG, "u_half_angle": 1e-3}
    record = session.run({**values, **quiet, "imu.gyro_bias": [0.0] * 3, "table.angle_gain": 1e-3})
    result = load_system(NAME).with_values(values).reduce(record)
    found = {c.name: c for c in result.coefficients}
    shift = {row[0]: row[-3] for t in result.tables if t.id.startswith("budget.predicted") for row in t.rows}
    c = found["d_z(31 Hz)"]
    assert c.u == pytest.approx(2e-3 * abs(c.estimate), rel=1e-2)
    assert shift["d_z(31 Hz)"] == pytest.approx(2e-3 * c.estimate, rel=1e-2)
    assert c.estimate - c.truth == pytest.approx(2e-3 * c.truth, rel=1e-2)


# ------------------------------------------------------------------------------------------------ files
def rows(axis: int = 2, noise: float = 0.05, sense: float = 1.0, factor: float = 1.0) -> list[list[float]]:
    """Drifts (deg/h) of increments taken for rotations, 10 ms: c (sin x/x - 1) about the axis of the cone, by hand."""
    rng = np.random.default_rng(7)
    out, t = [], 0.0
    for f in (0.0, 4.0, 9.0, 0.0, 15.0, 25.0, 0.0):
        for _ in range(5):
            x = 2.0 * math.pi * f * 0.01
            c = 2.0 * math.pi * f * (1.0 - math.cos(0.3 * DEG)) / DPH
            drift = np.array([3.0, -2.0, 1.0]) + rng.normal(0.0, noise, 3)
            drift[axis] += sense * c * (math.sin(x) / x - 1.0) if f else 0.0
            out.append([t, t + 4.0, f, 0.3 * factor if f else 0.0, *drift])
            t += 5.0
    return out


def reduced(command: Command, folder: Path, table: list[list[float]], code: int = 0) -> Any:
    head = [
        "# axis = z",
        "# interval = 10ms",
        "# bandwidth = 0Hz",
        "# coning = false",
        "# samples = 1",
        "# type_b = none",
    ]
    names = "t_start [s],t_end [s],frequency [Hz],half_angle [deg],drift_x [deg/h],drift_y [deg/h],drift_z [deg/h]"
    file = folder / "cones.csv"
    file.write_text("\n".join([*head, names, *(",".join(f"{v:.9g}" for v in row) for row in table)]) + "\n")
    found, _, err = command("reduce", NAME, "--data", str(file), "--out", str(folder / "r"), "--force")
    assert found == code, err
    return json.loads((folder / "r" / "result.json").read_text()) if code == 0 else err


def test_a_laboratorys_file(command: Command, tmp_path: Path) -> None:
    result = reduced(command, tmp_path, rows())
    found = {c["name"]: c for c in result["coefficients"]}
    for f in (4.0, 9.0, 15.0, 25.0):
        x = 2.0 * math.pi * f * 0.01
        true = 2.0 * math.pi * f * (1.0 - math.cos(0.3 * DEG)) / DPH * (math.sin(x) / x - 1.0)
        low, high = found[f"d_z({f:g} Hz)"]["interval"]
        assert low < true < high and high - low < 0.3
    stated = next(t for t in result["tables"] if t["id"] == "coning.expected")["rows"]
    assert all(abs(row[6]) < 4.0 * row[4] for row in stated)
    assert not any(r["id"] == "coning.implausible" for r in result["reasons"])


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (rows(axis=0), "axes exchanged"),
        (rows(sense=-1.0), "reversed"),
        (rows(factor=0.1), "more than without any"),
        # at 25 Hz sin x/x - 1 = -0.363 of the true cone, a quarter of it, -0.091, of one of twice the half-angle
        (rows(factor=2.0), "not the full angle"),
        # 2 pi times the frequency: at 25 Hz -0.058 of the cone that is stated, whose sin x/x - 1 is about -1
        ([[*row[:2], 2.0 * math.pi * row[2], *row[3:]] for row in rows()], "not rad/s"),
    ],
)
def test_mistakes_are_named(given: list[list[float]], said: str) -> None:
    names = ("t_start", "t_end", "frequency", "half_angle", "drift_x", "drift_y", "drift_z")
    units = (1.0, 1.0, 1.0, DEG, DPH, DPH, DPH)
    windows = {n: np.array(v) * u for n, v, u in zip(names, zip(*given, strict=True), units, strict=True)}
    setup = ConingSetup(axis="z", chain=Chain(0.01, 0.0, 0.0, False, 1))
    reasons = [r.text for r in Reduction.reduce(windows, setup).reasons if r.id.startswith("coning.")]
    assert reasons and said in reasons[0]


def test_a_bias_shows_its_cosine_while_its_axis_goes_round_the_cone() -> None:
    """100, 80 and -60 deg/h at 10 deg: cos = 0.98481 of that along the cone, half of 1.98481 of those across.  Against
    the rest alone the drifts were off by -0.76, -0.61 and 0.91 deg/h, up to 200 u.  All of 100 deg/h may be
    a g-sensitivity that leans, u is 1.52 deg/h.
    """
    rng, c = np.random.default_rng(3), math.cos(10.0 * DEG)
    chain = Chain(0.01, 0.0, 0.0, True, 1)
    f = np.repeat([0.0, 4.0, 0.0, 9.0, 0.0], 5)
    true = {x: chain.drift(x, 10.0 * DEG, 2)[2] for x in (4.0, 9.0)}
    rest = DPH * np.array([100.0, 80.0, -60.0])
    moving = rest * np.array([0.5 * (1.0 + c), 0.5 * (1.0 + c), c])
    drift = np.where(f[:, None] > 0.0, moving, rest) + 0.01 * DPH * rng.normal(size=(f.size, 3))
    drift[:, 2] += [true.get(x, 0.0) for x in f]
    windows = {f"drift_{a}": drift[:, k] for k, a in enumerate("xyz")}
    t = 5.0 * np.arange(f.size)
    windows |= {"t_start": t, "t_end": t + 4.0, "frequency": f, "half_angle": np.where(f > 0.0, 10.0 * DEG, 0.0)}
    found = {x.name: x for x in Reduction.reduce(windows, ConingSetup(axis="z", chain=chain)).coefficients}
    for a in "xyz":
        for x in (4.0, 9.0):
            d = found[f"d_{a}({x:g} Hz)"]
            assert d.estimate == pytest.approx(true[x] / DPH if a == "z" else 0.0, abs=0.05)
            assert d.u == pytest.approx(100.0 * (1.0 - c), rel=0.02)


def test_records_that_say_nothing(command: Command, tmp_path: Path) -> None:
    assert "at rest" in reduced(command, tmp_path, [r for r in rows() if r[2]], 2)
    assert "no reading has a cone" in reduced(command, tmp_path, [r for r in rows() if not r[2]], 2)


@pytest.mark.parametrize("name", [NAME, "sculling_test"])
@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"frequencies": "5 60"}, "more than two updates"),
        ({"frequencies": "0.1"}, "at least one period"),
        ({"interval": 3.3e-4}, "whole number of steps"),
        ({"window": 1.005}, "whole number of updates"),
        ({"axis": "w"}, "x, y or z"),
    ],
)
def test_refused(name: str, values: dict[str, Any], said: str) -> None:
    assert any(said in p for p in load_system(name).with_values(values).check())
