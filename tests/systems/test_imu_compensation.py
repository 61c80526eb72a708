"""An IMU is calibrated, its compensator gets the values, and a second run proves what is left.  [IMU-POSITIONS]"""

from __future__ import annotations

import importlib
import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imu_world import Unit

import gyrobench as gb
from gyrobench.bench import UsageError
from gyrobench.commands.arguments import read_settings
from gyrobench.system.system import load_system
from gyrobench.workflow.fitted_values import refuse_unfitted, write_fitted

room = type(load_system("imu_positions")).__module__
compensation: Any = importlib.import_module(".compensation", room)
tables: Any = importlib.import_module(".tables", room)
PLAN: dict[str, Any] = {"positions": 6, "dwell": 10.0, "settle": 1.0, "turns": 1, "rate": 1.0, "nuisances": "none"}


def unit_values(unit: Unit) -> dict[str, Any]:
    names = {"gyro_bias": unit.bg, "gyro_scale": unit.Sg, "g_sensitivity": unit.G, "acc_bias": unit.ba,
             "acc_scale": unit.Sa}  # fmt: skip
    return {f"imu.{n}": v.tolist() for n, v in names.items()}


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory: pytest.TempPathFactory) -> Any:
    unit = Unit.drawn(np.random.default_rng(21), 5e-3)
    run = gb.load("imu_positions", PLAN | unit_values(unit)).run(seed=1, check_step=False)
    folder = tmp_path_factory.mktemp("calibrated")
    return unit, run, write_fitted(load_system("imu_positions"), run.result, run.record, "imu_compensator", folder)


@pytest.mark.long
def test_a_second_run_proves_the_compensation(calibrated: Any) -> None:
    """Behind the compensator 33 coefficients are left: each truth within 4.5 U/1.96 of the first run, none of the 5e-3
    that were there, and the second run's estimates agree with them.
    """
    unit, run, files = calibrated
    again = gb.load("imu_positions", PLAN | unit_values(unit) | read_settings(files[0]))
    found = again.run(seed=2, check_step=False).result
    first = {c.name: c for c in run.result.coefficients}
    for c in found.coefficients:
        si, before = tables.SCALES[c.unit], first[c.name]
        assert c.truth is not None and abs(c.truth * si) < 4.5 * before.u * si + 1e-7 * abs(before.estimate * si)
        assert abs(c.estimate - c.truth) < 4.5 * c.u
    largest = max(abs(c.estimate) for c in found.coefficients if c.unit == "ppm")
    assert largest < 0.05 * max(abs(c.estimate) for c in first.values() if c.unit == "ppm")


def test_what_is_left_is_that_of_plain_numpy() -> None:
    """Readings of random instruments, compensated by random values: a least squares fit gives what is left."""
    rng = np.random.default_rng(3)
    unit, believed = Unit.drawn(rng, 0.05), Unit.drawn(rng, 0.05)
    w, f = rng.normal(size=(2, 60, 3))
    rate = w + w @ unit.Sg.T + unit.bg + f @ unit.G.T / 9.80665
    force = np.linalg.solve(np.eye(3) + believed.Sa, (f + f @ unit.Sa.T + unit.ba - believed.ba).T).T
    omega = np.linalg.solve(np.eye(3) + believed.Sg, (rate - believed.bg - force @ believed.G.T / 9.80665).T).T
    names = {"gyro_bias": believed.bg, "gyro_scale": believed.Sg, "g_sensitivity": believed.G,
             "acc_bias": believed.ba, "acc_scale": believed.Sa}  # fmt: skip
    left = compensation.left(unit.coefficients(), {f"compensator.{n}": v for n, v in names.items()})
    X = np.column_stack([np.ones(60), w, f / 9.80665])
    fitted = np.linalg.lstsq(X, omega - w, rcond=None)[0]
    own = np.linalg.lstsq(np.column_stack([np.ones(60), f]), force - f, rcond=None)[0]
    for i, a in enumerate("xyz"):
        assert left[f"bg_{a}"] == pytest.approx(fitted[0, i], abs=1e-12)
        assert left[f"ba_{a}"] == pytest.approx(own[0, i], abs=1e-12)
        for k, b in enumerate("xyz"):
            assert left[f"Sg_{a}{b}"] == pytest.approx(fitted[1 + k, i], abs=1e-12)
            assert left[f"G_{a}{b}"] == pytest.approx(fitted[4 + k, i], abs=1e-12)
            assert left[f"Sa_{a}{b}"] == pytest.approx(own[1 + k, i], abs=1e-12)


@pytest.mark.long
def test_the_same_values_for_other_tools(calibrated: Any, tmp_path: Path) -> None:
    _, run, (toml, document, header) = calibrated
    held = json.loads(document.read_text(encoding="utf-8"))["parameters"]
    first = {c.name: c for c in run.result.coefficients}
    assert held["acc_scale"]["value"][0][2] == first["Sa_xz"].estimate * tables.SCALES[first["Sa_xz"].unit]
    assert held["gyro_bias"]["u"][1] == first["bg_y"].u * tables.SCALES[first["bg_y"].unit]
    settings = read_settings(toml)
    assert {n: json.loads(v) for n, v in settings.items()} == {f"compensator.{n}": v["value"] for n, v in held.items()}
    source = tmp_path / "main.c"
    source.write_text(
        f'#include <stdio.h>\n#include "{header}"\nint main(void) '
        '{printf("%.17g\\n", imu_compensator_gyro_scale[1][2]); return 0;}\n', encoding="utf-8",
    )  # fmt: skip
    flags = ["-Wall", "-Wno-unused-variable", "-Werror"]
    subprocess.run(["cc", *flags, str(source), "-o", str(tmp_path / "a")], check=True)
    printed = subprocess.run([tmp_path / "a"], capture_output=True, text=True, check=True).stdout
    assert float(printed) == held["gyro_scale"]["value"][1][2]


def test_parts_that_a_test_does_not_fit_are_named() -> None:
    with pytest.raises(UsageError, match="imu_positions gives values for imu_compensator"):
        refuse_unfitted(load_system("imu_positions"), "floated_gyro")
    with pytest.raises(UsageError, match="it has no parameters white, flicker"):
        refuse_unfitted(load_system("drift_record"), "imu_compensator")
