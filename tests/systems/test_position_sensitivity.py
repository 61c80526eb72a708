"""Position sensitivity in co-simulation: springs that come back, what they allow, a laboratory's file, refusals."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command

from gyrobench import drift, frames
from gyrobench.engine.session import Session
from gyrobench.system.system import load_system

NAME = "position_sensitivity"
DPH = math.pi / 648000.0
ARCSEC = math.pi / 648000.0


def values(rng: np.random.Generator) -> dict[str, Any]:
    found = {f"gyro.{n}": float(rng.uniform(-0.6, 0.6)) * DPH for c in "xy" for n in drift.terms_2dof(c, 9)}
    found |= {f"gyro.k_{a}": float(rng.uniform(15.0, 19.0)) * 1e3 * DPH for a in "xy"}
    found |= {f"gyro.K_sg_{a}": float(rng.uniform(8.0, 12.0)) for a in "xy"}
    found |= {f"gyro.null_{a}": float(rng.uniform(-9.0, 9.0)) * ARCSEC for a in "xy"}
    found |= {"gyro.K_q": float(rng.uniform(-0.05, 0.05)), "gyro.K_phi": float(rng.uniform(0.0, 0.03))}
    attitude = frames.rotation(rng.normal(size=3), rng.uniform(0.0, math.pi))
    return found | {"attitude": json.dumps(attitude.tolist()), "latitude": float(rng.uniform(-1.4, 1.4))}


@pytest.mark.parametrize("seed", range(2))
def test_random_gyros(session: Session, seed: int) -> None:
    """Stiffness of both channels to 1e-11 1/s; the composite drift is that of the null of the pickoffs, by hand."""
    given = values(np.random.default_rng(seed))
    quiet = dict.fromkeys(load_system(NAME).noises, 0.0)
    record = session.run({**given, **quiet, "nuisances": "none", "cycles": 2, "dwell": 10.0})
    result = load_system(NAME).reduce(record)
    found = {c.name: c for c in result.coefficients}
    K_q, K_phi = given["gyro.K_q"], given["gyro.K_phi"]
    for c in "xy":
        assert found[f"K{c}_q"].estimate == pytest.approx(K_q, abs=1e-11)
        assert found[f"K{c}_φ"].estimate == pytest.approx(K_phi, abs=1e-11)
        assert found[f"K{c}_q"].truth == K_q and found[f"K{c}_φ"].truth == K_phi
    # the rotor stands at the null n of its pickoffs: 0 = -omega_x + (omega_z + K_q) n_y - K_phi n_x + ... + k_y i_y
    C = np.array(json.loads(given["attitude"]))
    phi = given["latitude"]
    g = frames.normal_gravity(phi) / frames.G0
    X, Y, Z = C @ np.array([0.0, 0.0, -g])
    z = float(C[2] @ np.array([0.0, math.cos(phi), math.sin(phi)])) * frames.EARTH_RATE
    n = {a: given[f"gyro.null_{a}"] for a in "xy"}
    terms = {
        "0": 1.0,
        "x": X,
        "y": Y,
        "z": Z,
        "xx": X * X,
        "yy": Y * Y,
        "zz": Z * Z,
        "xy": X * Y,
        "yz": Y * Z,
        "xz": X * Z,
    }
    for c, springs in (
        ("x", (K_q + z) * n["y"] - K_phi * n["x"]), ("y", -(K_q + z) * n["x"] - K_phi * n["y"]),
    ):  # fmt: skip
        omega_d = sum(given.get(f"gyro.D{c}_{t}", 0.0) * v for t, v in terms.items()) + springs
        assert found[f"ω_d{c}"].estimate == pytest.approx(omega_d / DPH, abs=1e-6)
        assert found[f"ω_d{c}"].truth == pytest.approx(omega_d / DPH, abs=1e-9)


def test_what_the_springs_allow_and_what_the_loops_have(session: Session) -> None:
    """kappa = 0.05 1/s, 0.01 deg/h: a tenth is 1e-3 deg/h = 1e-3 arcsec/s, so 0.02 arcsec and a gain of W/0.02 arcsec.

    W = 15.041 arcsec/s: 752 1/s.  The loop with K_p alone, k K_sg K_p = 100 1/s, leaves 0.15 arcsec: 0.0075 deg/h.
    """
    quiet = dict.fromkeys(load_system(NAME).noises, 0.0)
    springs = {"gyro.K_q": 0.03, "gyro.K_phi": 0.04, "rebalance_x.K_i": 0.0}
    record = session.run({**springs, **quiet, "nuisances": "none", "cycles": 2, "dwell": 10.0})
    result = load_system(NAME).reduce(record)
    allowed, loops = (next(t for t in result.tables if t.id == i) for i in ("springs.allowed", "springs.loops"))
    W = frames.EARTH_RATE / ARCSEC
    for row in allowed.rows:
        assert row[1:] == [pytest.approx(v, rel=1e-6) for v in (0.05, 0.05, 0.02, W / 0.02)]
    with_integral, without = loops.rows  # the loop of the x pickoff feeds the torquer about y
    assert with_integral[2:] == ["yes", 0.0, 0.0, "yes"]
    gain = 17.227e3 * DPH * 10.0 * 119.92139898087
    assert without[1:3] == [pytest.approx(gain, rel=1e-9), "no"]
    assert without[3:] == [pytest.approx(W / gain, rel=1e-6), pytest.approx(0.05 * W / gain, rel=1e-6), "yes"]


def test_a_laboratorys_file(command: Command, tmp_path: Path) -> None:
    """Written by the equations alone, attitude E U -N at 30 deg: omega = W (0, sin, -cos) along x, y, z."""
    W, phi, rng = frames.EARTH_RATE, math.radians(30.0), np.random.default_rng(2)
    w = (0.0, W * math.sin(phi), -W * math.cos(phi))
    k = {"x": 17.0e3 * DPH, "y": 16.0e3 * DPH}
    head = ["latitude = 30deg", "attitude = E U -N", "k_x = 17deg/h/mA", "k_y = 16deg/h/mA", "K_sg_x = 9V/rad"]
    rows = [f"# {line}" for line in [*head, "K_sg_y = 11V/rad", "type_b = none"]]
    rows.append("t_start [s],t_end [s],mean_x [A],mean_y [A],u_x [V],u_y [V]")
    for j, (a, b) in enumerate([(0, 0), (1, 0), (-1, 0), (0, 0), (0, 1), (0, -1)] * 4):
        x, y = a * 40.0 * ARCSEC, b * 40.0 * ARCSEC
        noise = rng.normal(0.0, 1e-3 * DPH, 2)
        i_y = (w[0] - 0.5 * DPH - (w[2] + 0.03) * y + 0.01 * x + noise[0]) / k["y"]
        i_x = (w[1] + 0.2 * DPH + (w[2] + 0.02) * x + 0.005 * y + noise[1]) / k["x"]
        rows.append(f"{60 * j},{60 * j + 50},{i_x:.12e},{i_y:.12e},{-9 * x:.9e},{-11 * y:.9e}")
    file = tmp_path / "springs.csv"
    file.write_text("\n".join(rows) + "\n")
    code, _, err = command("reduce", NAME, "--data", str(file), "--out", str(tmp_path / "r"))
    assert code == 0, err
    found = {c["name"]: c for c in json.loads((tmp_path / "r" / "result.json").read_text())["coefficients"]}
    true = {"ω_dx": 0.5, "Kx_q": 0.03, "Kx_φ": 0.01, "ω_dy": -0.2, "Ky_q": 0.02, "Ky_φ": 0.005}
    for name, value in true.items():
        c = found[name]
        assert abs(c["estimate"] - value) < 4.0 * c["u"], name
    assert found["Kx_q"]["u"] < 3e-5


@pytest.mark.parametrize(
    ("sets", "said"),
    [
        (["offset=0"], "offset = 0: must be > 0"),
        (["offset=30arcmin"], "half of it is allowed"),
        (["gyro.terms_x=10", "gyro.Dx_yy=0.1deg/h/g2"], "gyro.Dx_yy = 0.1"),
        (["gyro.K_q=0.1", "gyro.full=1", "gyro.J_x=1e-4", "gyro.J_y=1e-4"], "K_q and K_phi are of small angles"),
    ],
)
def test_run_is_refused(refused: Callable[..., None], sets: list[str], said: str) -> None:
    refused(NAME, sets, [said])


def test_a_pickoff_that_never_moves_is_named(session: Session) -> None:
    quiet = dict.fromkeys(load_system(NAME).noises, 0.0)
    record = session.run({**quiet, "cycles": 2, "dwell": 10.0})
    record.windows["u_y"] = np.zeros_like(record.windows["u_y"])
    with pytest.raises(Exception, match="u_y is the same in all readings"):
        load_system(NAME).reduce(record)
