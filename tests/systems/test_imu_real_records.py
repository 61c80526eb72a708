"""Real records of inertial measurement units, where their folder is there: hand-held positions of an Xsens MTi, a ring
laser and a small unit up and down.  Their README names instruments, sources and licences."""

from __future__ import annotations

import importlib
import math
import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from gyrobench.system.system import load_system

NEAR = (p / "shared" / "data" for p in Path(__file__).parents)
FOLDER = Path(os.environ.get("GYROBENCH_REAL_RECORDS") or next((p for p in NEAR if p.is_dir()), "shared/data"))
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason=f"no real records in {FOLDER}")
room = type(load_system("imu_positions")).__module__
reduction: Any = importlib.import_module(".reduction", room)
hand: Any = importlib.import_module(".hand", room)


def columns(name: str) -> dict[str, Any]:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(FOLDER / f"{name}.parquet")
    return {n: np.asarray(table.column(n), dtype=float) for n in table.column_names}


def reduced(path: Path, head: str, data: dict[str, Any]) -> Any:
    body = "\n".join(",".join(f"{v:.12g}" for v in row) for row in np.column_stack(list(data.values())).tolist())
    path.write_text(f"{head}{','.join(data)}\n{body}\n", encoding="utf-8")
    system = load_system("imu_positions")
    record = system.measured_data.read(system, path, {})
    return reduction.Reduction.from_record(record), record


@pytest.fixture(scope="module")
def xsens(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Counts of an MTi moved by hand through 39 positions; gravity as the program of its authors has it."""
    acc, gyro = columns("imu_tk_xsens_acc"), columns("imu_tk_xsens_gyro")
    data = {"time [s]": acc["time"], **{f"g{a} [counts]": gyro[a] for a in "xyz"}}
    data |= {f"a{a} [counts]": acc[a] for a in "xyz"}
    head = "# attitudes = unknown\n# latitude = 45.4deg\n# gravity = 9.81744m/s2\n"
    return reduced(tmp_path_factory.mktemp("xsens") / "mti.csv", head, data)


@pytest.mark.long
def test_xsens_against_its_data_sheet(xsens: Any) -> None:
    """Data sheet, rounded to 1 count: 415, 413, 415 counts/(m/s2) and 4778, 4758, 4766 counts/(rad/s); angles between
    the input axes from its rounded misalignments of the accelerometers (1, 0, -0.01; 0.01, 1, 0.01; 0.02, 0.01, 1):
    cosines 0.010, 0.010, 0.020, each the sum of two elements rounded to 0.01.

    At the normal gravity of 45.4 degrees, 9.8065, all scale factors are 0.11 % larger: 414.9, 412.6, 415.0.
    """
    result, record = xsens
    assert record.windows["phase"].size == 39
    found = {c.name: c for c in result.coefficients}
    local = 9.81744 / 9.8065
    for a, sheet in zip("xyz", (415.0, 413.0, 415.0), strict=True):
        assert abs(found[f"ka_{a}"].estimate * local - sheet) < 0.5
    for a, sheet in zip("xyz", (4778.0, 4758.0, 4766.0), strict=True):
        c = found[f"kg_{a}"]
        assert abs(c.estimate - sheet) < 0.0025 * sheet and c.u < 2.0  # the sheet is of another day
    # the gyros read gravity: without it the turns were 2.8 to 4 times as uncertain
    assert abs(found["G_yx"].estimate) > 10.0 * found["G_yx"].u
    angles = {(row[0], row[1]): row[2] for row in next(t for t in result.tables if t.id == "imu.angles").rows}
    for axes, cosine in (("xy", 0.010), ("zx", 0.010), ("yz", 0.020)):
        assert -angles["accelerometers", axes] / 206264.8 == pytest.approx(cosine, abs=0.01)


@pytest.mark.long
def test_xsens_against_the_estimator_of_its_authors(xsens: Any) -> None:
    """Tedaldi 2014, eq. 10, written anew: f = T K (a - b), T upper triangular, minimized over the same positions; both
    have the same sizes, and scale factors that differ by products of misalignments only.  That is the solution without
    weights, about which the reported one is linear: the slow noise of the record moves it by less than 2 u."""
    result, record = xsens
    at = hand.HandReduction(record.windows, hand.HandSetup.of_record(record)).at

    def left(p: Any) -> Any:
        T = np.array([[1.0, -p[0], p[1]], [0.0, 1.0, -p[2]], [0.0, 0.0, 1.0]])
        return np.linalg.norm((p[3:6] * 1e-3 * (at.acc - 1e3 * p[6:])) @ T.T, axis=1) - 9.81744

    p = least_squares(left, [0.0, 0.0, 0.0, 2.4, 2.4, 2.4, 32.768, 32.768, 32.768], xtol=1e-14, ftol=1e-14).x
    assert at.noise_a == pytest.approx(math.sqrt(float(np.sum(left(p) ** 2)) / (39 - 9)), rel=1e-6)
    T = np.array([[1.0, -p[0], p[1]], [0.0, 1.0, -p[2]], [0.0, 0.0, 1.0]])
    rows = np.linalg.norm(np.linalg.inv(T @ np.diag(p[3:6] * 1e-3)), axis=1)  # counts per m/s2 along each input axis
    D = at.scale_a[0]
    assert D * np.linalg.norm(np.eye(3) + at.triad.matrix, axis=1) == pytest.approx(rows, rel=1e-6)
    assert at.triad.bias * D == pytest.approx(1e3 * p[6:], abs=0.02)
    found = {c.name: c for c in result.coefficients}
    for a, plain in zip("xyz", 1e3 * p[6:], strict=True):
        assert abs(found[f"ba_{a}"].estimate - plain) < 2.0 * found[f"ba_{a}"].u


def up_and_down(path: Path, name: str, shift: float) -> Any:
    down, up = columns(f"{name}_x_down"), columns(f"{name}_x_up")
    first, second = (down, up) if down["time"][0] < up["time"][0] else (up, down)
    second["time"] = second["time"] + shift
    units = {"time": "s", **{f"gyro_{a}": "deg/s" for a in "xyz"}, **{f"acc_{a}": "m/s2" for a in "xyz"}}
    short = {n: n if n == "time" else f"{n[0]}{n[-1]}" for n in units}  # gx, ax
    data = {f"{short[n]} [{u}]": np.concatenate([first[n], second[n]]) for n, u in units.items()}
    return reduced(path, "# attitudes = up_down\n# latitude = 51deg\n# type_b = none\n", data)


@pytest.mark.long
def test_ring_laser_up_and_down_sees_the_earth(tmp_path: Path) -> None:
    """LN-100, 300 s each way: half of up less down is the vertical Earth rate, 15.041 sin 51 = 11.689 deg/h, within its
    interval, which is below 0.1 deg/h; the plain half difference of the means is 11.73."""
    result, record = up_and_down(tmp_path / "ln100.csv", "ln100", 0.0)
    half = next(c for c in result.coefficients if c.name == "hg_x")
    earth = 15.0410686 * math.sin(math.radians(51.0))
    assert half.interval[0] < earth < half.interval[1] and half.interval[1] - half.interval[0] < 0.2
    assert set(np.unique(record.windows["phase"])) == {1, 2}
    assert {c.name for c in result.coefficients} == {"bg_x", "hg_x", "ba_x", "Sa_xx"}


def test_small_unit_up_and_down_has_a_sensitivity(tmp_path: Path) -> None:
    """ADI unit, 36 s each way: -4 deg/h in place of 11.7; the difference, -15.7 deg/h/g, is no Earth rate, as the
    report says.  The records overlap in time by their stamps: the second is put behind the first."""
    result, _ = up_and_down(tmp_path / "adi.csv", "adi_mems", 100.0)
    half = next(c for c in result.coefficients if c.name == "hg_x")
    assert half.interval[0] < -3.87 < half.interval[1]  # of the means: (-0.0022247 + 0.0000745)/2 deg/s
    row = next(t for t in result.tables if t.id == "imu.updown").rows[0]
    assert row[4] == pytest.approx(half.estimate - 11.689, abs=0.01) and abs(row[5]) > 5.0
