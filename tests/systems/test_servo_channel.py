"""An axis of a two-degree-of-freedom gyro on a servo table, the other axis locked: coefficients, pickoff, torquer.

The drift of the two channels, (I, O, S) = (x, y, z) and (y, -x, z), is written out here once more, from the part's
equations (GYRO-DYN-2DOF), not from the names that the reduction translates.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from servoing import DAY50, DPH, held, latitude

from gyrobench import drift, frames
from gyrobench.engine.session import Session
from gyrobench.reduction.drift.channels import errors_in, words
from gyrobench.system.families.servo_channel import in_channel, own_name
from gyrobench.system.system import System, load_system

ARCSEC = math.pi / 648000.0
KU = 1e3 * DPH
OTHER = {"x": "y", "y": "x"}
LIMIT = 1e-6  # deg/h per g^n


def system(name: str, channel: str) -> System:
    loaded = load_system(name)
    loaded.set("channel", channel)
    if name == "servo_polar":
        loaded.step = 2e-3
    return loaded


def gyro(rng: np.random.Generator) -> dict[str, float]:
    """Both channels and both torquers, SI."""
    found = {f"gyro.{n}": float(rng.uniform(-0.6, 0.6)) * DPH for c in "xy" for n in drift.terms_2dof(c, 9)}
    return found | {f"gyro.k_{a}": float(rng.uniform(15.0, 19.0)) * KU for a in "xy"}


def quiet(loaded: System) -> dict[str, Any]:
    return {**dict.fromkeys(loaded.noises, 0.0), "nuisances": "none"}


@pytest.fixture(scope="module", params=["x", "y"])
def polar(request: pytest.FixtureRequest) -> Iterator[tuple[str, Session, dict[str, Any]]]:
    loaded = system("servo_polar", request.param)
    with Session(loaded) as prepared:
        yield request.param, prepared, {**DAY50, **quiet(loaded), "lock.i_max": 1.0}


@pytest.mark.long
def test_random_gyros(polar: Any) -> None:
    """Nine coefficients of the axis come back, whatever the other axis drifts; its torquer reads the other axis."""
    channel, session, values = polar
    rng = np.random.default_rng(28)
    values = {**values, **gyro(rng), "latitude": latitude(rng)}
    record = session.run(values)
    result = load_system("servo_polar").reduce(record)
    assert {c.name for c in result.coefficients} == set(drift.terms_2dof(channel, 9)) and result.rank == 9
    for c in result.coefficients:
        true = values[f"gyro.{c.name}"] / DPH
        assert c.estimate == pytest.approx(true, abs=LIMIT), c.name
        assert c.truth == pytest.approx(true, rel=1e-12)
        assert c.closed == pytest.approx(true, abs=1e-4), c.name  # the dwells of the formulas are at angle 0
    # 3-95 in the names of Hu 1981: -omega_dx = R_x + U_z g_x ..., omega_dy = R_y - U_z g_y ...
    book = {row[0]: row[1] for row in next(t for t in result.tables if t.id == "notation_of_hu_1981").rows}
    assert book[f"R_{channel}"] == pytest.approx(
        values[f"gyro.D{channel}_0"] / DPH * (-1 if channel == "x" else 1), abs=LIMIT
    )
    _locked_axis_reads(channel, record, values)


def _locked_axis_reads(channel: str, record: Any, values: dict[str, Any]) -> None:
    """In the polar mounts both axes across the pole see no Earth rate, so that k i = -omega_d of the locked channel.

    Its axes at the angle a of mount S, from the attitude's table: x_T, y_T, z_T = O, S, I with I = -p, O(0) = -E.
    """
    other = OTHER[channel]
    k = values[f"gyro.k_{channel}"]  # the torquer about x nulls u_y
    windows, rows = held(record)
    labels = {r.phase: r.label for r in record.run.plan}
    S = np.array([labels[p] == "polar S" for p in record.windows["phase"][rows].astype(int).tolist()])
    a = (windows.angle_start + windows.angle_end) / 2.0
    phi = record.run.options["latitude"]
    g = frames.normal_gravity(phi) / frames.G0
    I, O, Z = (g * f for f in (math.sin(phi), math.cos(phi) * np.sin(a), math.cos(phi) * np.cos(a)))  # noqa: E741
    x, y = (I, O) if channel == "x" else (-O, I)
    D = {n: values[f"gyro.{n}"] for n in drift.terms_2dof(other, 9)}
    along, across = (x, y) if other == "x" else (y, x)
    o, n = other, OTHER[other]
    cross = D["Dx_xy"] if other == "x" else D["Dy_xy"]
    omega_d = (
        D[f"D{o}_0"] + D[f"D{o}_{o}"] * along + D[f"D{o}_{n}"] * across + D[f"D{o}_z"] * Z
        + D[f"D{o}_{o}{o}"] * along**2 + D[f"D{o}_zz"] * Z**2 + cross * along * across
        + D[f"D{o}_{n}z"] * across * Z + D[f"D{o}_{o}z"] * along * Z
    )  # fmt: skip
    read = record.windows["locked"][rows] * k
    assert np.max(np.abs(read + omega_d)[S]) / DPH < 2e-3  # middle of a window of 2.5 degrees for its mean


@pytest.mark.long
def test_a_turned_gyro_is_off_as_predicted(polar: Any) -> None:
    """60 arcsec about the gyro's x, y, z: what the report predicts is what happens, with the axes of this channel."""
    channel, session, values = polar
    seen = {"x": (1, 2), "y": (0, 2)}[channel]  # about its own axis nothing happens
    for axis in seen:
        R = frames.rotation(np.eye(3)[axis], 60.0 * ARCSEC)
        mount = {f"gyro.mount[{i + 1},{j + 1}]": float(R[i, j]) for i in range(3) for j in range(3)}
        result = load_system("servo_polar").reduce(session.run({**values, **mount}))
        predicted = {r[0]: r[1] for r in next(t for t in result.tables if "Predicted" in t.title).rows}
        off = {c.name: c.estimate - c.truth for c in result.coefficients}
        worst = max(map(abs, off.values()))
        assert worst > 0.1
        for name, shift in predicted.items():
            assert off[name] == pytest.approx(shift, abs=2e-2 * worst), (axis, name)


@pytest.mark.parametrize("channel", ["x", "y"])
def test_pickoff_and_torquer(channel: str) -> None:
    """K_sg of the axis along the table axis, and the scale factor of the torquer that precesses about it."""
    rng = np.random.default_rng(7)
    values = {**gyro(rng), "gyro.K_sg_x": 8.3, "gyro.K_sg_y": 9.1}
    loaded = system("pickoff_scale_factor", channel)
    with Session(loaded) as session:
        record = session.run({**values, **dict.fromkeys(loaded.noises, 0.0)})
    found = {c.name: c for c in load_system("pickoff_scale_factor").reduce(record).coefficients}
    assert found["S"].estimate == pytest.approx(values[f"gyro.K_sg_{channel}"], rel=2e-7)
    assert found["S"].truth == values[f"gyro.K_sg_{channel}"]
    assert found["drift"].estimate == pytest.approx(found["drift"].truth, abs=6e-3)  # D_S, D_O times 20 arcmin
    loaded = system("torquer_scale_factor", channel)
    short = {"currents": "5 20 70", "range": "0.5deg", "range_large": "2deg"}
    with Session(loaded) as session:
        record = session.run({**values, **dict.fromkeys(loaded.noises, 0.0), **short})
    found = {c.name: c for c in load_system("torquer_scale_factor").reduce(record).coefficients}
    true = values[f"gyro.k_{OTHER[channel]}"] / KU  # it sits on the other axis
    assert found["K"].estimate == pytest.approx(true, rel=1e-9) and found["K"].truth == pytest.approx(true, rel=1e-12)


def test_level_attitudes_in_the_names_of_the_channel() -> None:
    loaded = system("servo_vertical_level", "y")
    values = {"attitudes": "vertical", "cycles": 1, "dwell": 60.0, **quiet(loaded), **gyro(np.random.default_rng(1))}
    with Session(loaded) as session:
        result = load_system("servo_vertical_level").reduce(session.run(values))
    assert [c.name for c in result.coefficients] == ["Dy_0 + γ² Dy_yy", "Dy_y"]
    assert all(c.estimate == pytest.approx(c.truth, abs=LIMIT) for c in result.coefficients)
    assert any("Dy_xy, Dy_xz, Dy_yz" in w for w in result.warnings)


def test_names() -> None:
    assert [own_name("x", n) for n in ("K_sg", "k", "white", "D_IS", "H")] == ["K_sg_x", "k_y", "white_x", "Dx_xz", "H"]
    assert own_name("", "k") == "k"
    assert words("D_F + γ² sin²φ D_II; D_O − γ sinφ D_IO", "x") == "Dx_0 + γ² sin²φ Dx_xx; Dx_y − γ sinφ Dx_xy"
    # of the y channel D_O is -Dy_x: a sum of a positive first term with it is a difference, two of them stay a sum
    assert words("D_F + γ D_O; D_O − γ sinφ D_IO", "y") == "Dy_0 − γ Dy_x; Dy_x − γ sinφ Dy_xy"
    assert words("D_F", "") == "D_F"
    assert errors_in({"mount.1": 1.0, "mount.3": 3.0}, "y") == {
        "mount.2": -1.0, "mount.input_to_spin": 1.0, "mount.3": 3.0,
    }  # fmt: skip
    assert errors_in({"mount.1": 1.0}, "x") == {"mount.1": 1.0}
    wires = in_channel("table -> gyro: omega alpha f\ngyro -> cage: u\ncage -> gyro: i\ngyro -> sampler: u=x", "y")
    assert wires.splitlines()[:4] == [
        "table -> gyro: omega f", "gyro -> cage: u_y=u", "cage -> gyro: i=i_x", "gyro -> sampler: u_y=x",
    ]  # fmt: skip


def test_a_part_with_two_pickoffs_sets_the_channel_and_nothing_else_does() -> None:
    loaded = load_system("servo_polar")
    loaded.place("gyro", "gyro_2dof")
    assert loaded.channel == "x" and loaded.slots["lock"].part == "rebalance_two_axis"
    loaded.set("channel", "")
    assert "lock" not in loaded.slots and "gyro.u" in loaded.channels
    loaded = load_system("servo_polar")
    loaded.place("gyro", "floated_gyro")
    assert loaded.channel == "" and "lock" in loaded.all_slots()
    loaded.set("lock.i_max", 1.0)  # in any order with the channel
    assert loaded.channel == "x"
    loaded.set("channel", "y")
    assert loaded.overrides["lock.i_max"] == 1.0 and "i=i_y" in loaded.wires


@pytest.mark.parametrize(
    ("name", "values", "said"),
    [
        ("servo_polar", ["channel=z"], "channel = z: x or y of a two-degree-of-freedom gyro"),
        ("servo_polar", ["channel=y", "gyro.terms_y=10", "gyro.Dy_xx=0.1deg/h/g2"], "gyro.Dy_xx = 0.1"),
        ("pickoff_scale_factor", ["channel=x", "gain=1.1"], "gain, u_gain: of a floated gyro"),
    ],
)
def test_refused(command: Command, tmp_path: Path, name: str, values: list[str], said: str) -> None:
    sets = [part for v in values for part in ("--set", v)]
    code, _, err = command("run", name, *sets, "--out", str(tmp_path / "r"))
    assert code == 2 and said in " ".join(err.split())


def test_a_laboratorys_file_of_a_channel(tmp_path: Path, command: Command) -> None:
    """Angles written by hand, x down and up for 10 min, drift 0.2 and 0.4 deg/h: D_F + D_II = 0.3, D_I g = -0.1.

    x down sees -W sin(phi), x up +W sin(phi): theta' = drift - Earth rate.
    """
    phi, g = math.radians(45.75), 9.80665
    rows = [
        "# latitude = 45.75deg",
        "# gravity = 9.80665m/s2",
        "# channel = x",
        "# type_b = none",
        "# phase 1 = x down",
    ]
    rows += ["# phase 2 = x up", "phase,t_start [s],t_end [s],angle_start [rad],angle_end [rad]"]
    rng, t = np.random.default_rng(0), 0.0
    for phase, (rate, earth) in enumerate(((0.2, -1.0), (0.4, 1.0)), 1):
        table = rate * DPH - earth * frames.EARTH_RATE * math.sin(phi)
        for k in range(10):
            noise = rng.normal(0.0, 1e-9, 2)
            rows.append(f"{phase},{t},{t + 60},{table * 60 * k + noise[0]:.12e},{table * 60 * (k + 1) + noise[1]:.12e}")
            t += 60.0
    file = tmp_path / "level.csv"
    file.write_text("\n".join(rows) + "\n")
    code, _, err = command("reduce", "servo_vertical_level", "--data", str(file), "--out", str(tmp_path / "r"))
    assert code == 0, err
    import json

    found = {c["name"]: c for c in json.loads((tmp_path / "r" / "result.json").read_text())["coefficients"]}
    assert found["Dx_0 + γ² Dx_xx"]["estimate"] == pytest.approx(0.3, abs=2e-3)
    assert found["Dx_x"]["estimate"] == pytest.approx(-0.1 * 9.80665 / g, abs=2e-3)
