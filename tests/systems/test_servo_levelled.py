"""Level attitudes with a compensating current: the table stays level for hours, the drift is measured all the same."""

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

NAME = "servo_vertical_level"
DPH = math.pi / 648000.0
NORTH = "x north, y up; x north, y down; x north, z up; x north, z down"
LONG = {"attitudes": NORTH, "cycles": 1, "dwell": 1500.0, "levelled": True, "nuisances": "none"}


@pytest.mark.parametrize("channel", ["", "y"])
@pytest.mark.long
def test_random_gyros(channel: str) -> None:
    """25 min with the input axis north, where the Earth would turn the table by 4.4 deg: 1 deg is the limit.

    Without cross terms, which a level attitude does not see, the coefficients come back to 1e-6 deg/h.
    """
    system = load_system(NAME)
    system.set("channel", channel)
    system.set("levelled", True)
    rng = np.random.default_rng(3)
    names = drift.terms_2dof(channel, 9) if channel else drift.terms(9)
    true = {n: float(rng.uniform(-0.6, 0.6)) for n in names}
    true |= {n: 0.0 for n in names if len(set(n.partition("_")[2])) == 2}
    values: dict[str, Any] = {**LONG, **dict.fromkeys(system.noises, 0.0), "u_scale_factor": 1e-3}
    values |= {f"gyro.{n}": v * DPH for n, v in true.items()}
    with Session(system) as session:
        record = session.run(values)
    result = load_system(NAME).reduce(record)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(true[c.name], abs=1e-6), c.name
    earth = frames.EARTH_RATE * math.cos(math.radians(45.75))
    k = record.run.parameters["gyro.k_x" if channel else "gyro.k"]
    servo = [row.phase for row in record.run.plan if row.mode == "servo"]
    held = record.windows["current"][np.isin(record.windows["phase"], servo)]
    assert held == pytest.approx(earth / k, rel=1e-12)
    # the scale factor of the torquer, 1e-3 of it, is in the constant drift alone: 1e-3 of the Earth rate
    line = next(row for row in result.budget if "scale factor" in row.source)
    assert line.contribution == pytest.approx(1e-3 * earth / DPH, rel=1e-6)


@pytest.mark.parametrize(
    ("sets", "said"),
    [
        ([f"attitudes={NORTH}", "dwell=1500"], "1° either side of level allows"),
        ([f"attitudes={NORTH}", "dwell=1500", "levelled=true", "gyro.D_F=9deg/h"], "1° either side of level allows"),
        ([f"attitudes={NORTH}", "levelled=true", "cage.i_max=0.1mA"], "levelled, compensate: they ask for 0.61 mA"),
    ],
)
def test_run_is_refused(refused: Callable[..., None], sets: list[str], said: str) -> None:
    refused(NAME, sets, [said])


@pytest.mark.parametrize("k", ["17.2deg/h/mA", ""])
def test_a_laboratorys_file(command: Command, tmp_path: Path, k: str) -> None:
    """theta' = omega_d + k i - omega_E, with k i = 10 deg/h: written by hand, 0.3 and 0.1 deg/h with y up and down."""
    earth = frames.EARTH_RATE * math.cos(math.radians(45.75))
    rows = ["# latitude = 45.75deg", "# type_b = none", *([f"# k = {k}"] if k else [])]
    rows += ["# phase 1 = x north, y up", "# phase 2 = x north, y down"]
    rows.append("phase,t_start [s],t_end [s],angle_start [rad],angle_end [rad],current [mA]")
    rng, t = np.random.default_rng(1), 0.0
    for phase, d in ((1, 0.3), (2, 0.1)):
        rate = (d + 10.0) * DPH - earth
        for n in range(12):
            a, b = rate * 100.0 * n, rate * 100.0 * (n + 1)
            e = rng.normal(0.0, 2e-9, 2)
            rows.append(f"{phase},{t},{t + 100.0},{a + e[0]:.12e},{b + e[1]:.12e},{10.0 / 17.2:.12e}")
            t += 100.0
    file = tmp_path / "level.csv"
    file.write_text("\n".join(rows) + "\n")
    code, _, err = command("reduce", NAME, "--data", str(file), "--out", str(tmp_path / "r"))
    if not k:
        assert code != 0 and "k unknown: the record has currents of the torquer" in " ".join(err.split())
        return
    assert code == 0, err
    found = {c["name"]: c["estimate"] for c in json.loads((tmp_path / "r" / "result.json").read_text())["coefficients"]}
    constant = next(v for n, v in found.items() if n.startswith("D_F"))
    assert constant == pytest.approx(0.2, abs=3e-3)
