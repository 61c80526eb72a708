"""What cannot give an answer is refused before anything runs: exit code 2, no traceback, what would be right."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from tumbling import NAME, SHORT, load

from gyrobench.engine.session import Session
from gyrobench.record.record import Record

RUNS: list[tuple[list[str], list[str]]] = [
    # On the equator sin(2 phi) = 0: the pole is horizontal, Y = 0 while the table turns, so neither XY nor YZ moves.
    (["latitude=0deg"], ["latitude 0°", "5° to 85°", "rank 7 of 9", "D_OS", "D_IO"]),
    # On the pole gravity lies along the table axis: X = Z = 0 always, only D_F and D_O are left.
    (["latitude=90deg"], ["latitude 90°", "rank 2 of 9", "D_I;", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS"]),
    (["latitude=-90deg"], ["latitude -90°", "rank 2 of 9", "D_I;", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS"]),
    (["latitude=3deg"], ["latitude 3°", "5° to 85°", "condition", "least determined"]),
    (["latitude=100deg"], ["latitude = 100deg", "must be <= 1.5708 rad"]),
    (["rate=0"], ["rate = 0: the table does not turn", "10 ERU"]),
    (["gyro.mount=[[1,0,0],[0,1,0],[0,0,-1]]"], ["gyro.mount", "determinant is -1", "reverse one row"]),
    (["gyro.mount=[[1,0,0],[0,1,0.01],[0,0,1]]"], ["gyro.mount", "not orthonormal", "unit vector at right angles"]),
    (["gyro.mount[1,1]=0.999"], ["gyro.mount", "not orthonormal", "allowed 1e-09"]),
    (["sequencer.faces[2,1]=0.5"], ["sequencer.faces, mount 2", "not orthonormal"]),
    (["table.base[1,1]=0"], ["table.base", "not orthonormal"]),
    (["gyro.terms=7"], ["gyro.terms = 7", "3, 4, 5, 8, 9, 10"]),
    (["terms=6"], ["terms = 6", "3, 4, 5, 8 and 9"]),
    (["terms=10"], ["terms = 10: must be <= 9"]),
    (["gyro.D_OO=0.1deg/h/g2", "gyro.terms=10"], ["gyro.D_OO = 0.1 °/h/g²", "fold=true", "D_F + γ² D_OO"]),
    (["latitude=45m"], ["latitude: '45m'", "units that fit: rad"]),
    (["latitude=45.75"], ["latitude = 45.75: must be <= 1.5708 rad"]),
    (["rate=10deg"], ["rate: '10deg'", "units that fit: rad/s, deg/h, deg/s, ERU"]),
    (["gyro.D_I=0.9mA"], ["gyro.D_I: '0.9mA'", "units that fit"]),
    (["gyro.H=nan"], ["gyro.H: 'nan': a finite number"]),
    (["gyro.H=-1"], ["H = -1 N.m.s must be > 0"]),
    (["gyro.D_II2=1"], ["gyro has no parameter 'D_II2'", "nearest: D_II"]),
    (["lattitude=45deg"], ["lattitude: no such option", "latitude"]),
    (["dwell=0"], ["phase 1 'static 3': dwell = 0: must be > 0"]),
    (["windows=5"], ["windows = 5: must be >= 6"]),
]  # fmt: skip


@pytest.mark.parametrize(("values", "words"), RUNS, ids=[" ".join(v) for v, _ in RUNS])
def test_run_is_refused(refused: Callable[..., None], values: list[str], words: list[str]) -> None:
    refused(NAME, values, words)


def test_long_step_is_refused(command: Command, tmp_path: Path) -> None:
    """[LOOP-REBALANCE: refuse steps above 5 ms]"""
    code, _, err = command("run", NAME, "--step", "20ms", "--out", tmp_path / "run")
    assert code == 2
    assert "step = 0.02 s" in err and "at most 0.005 s" in err


@pytest.mark.parametrize("latitude", [0.0, 90.0, -90.0, 3.0, 88.0])
def test_lost_combinations_are_those_of_the_design(latitude: float) -> None:
    """What the message names is what the regressors of the plan cannot see: on the equator exactly D_IO and D_OS."""
    (text,) = [t for t in load().with_values({"latitude": np.radians(latitude)}).check() if "latitude" in t]
    if latitude == 0.0:
        assert sorted(text.split("not estimable: ")[1].split("; ")) == ["D_IO", "D_OS"]
    elif abs(latitude) == 90.0:
        assert sorted(text.split("not estimable: ")[1].split("; ")) == sorted(
            ["D_I", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS"]
        )
    else:
        assert "least determined" in text


# ------------------------------------------------------------------------------------- measured records
@pytest.fixture(scope="module")
def record() -> Record:
    with Session(NAME) as session:
        return session.run({**SHORT, "windows": 8, "rate": 0.2, "dwell": 8.0})


def text(record: Record, rows: Any = None, header: str | None = None, **columns: Any) -> str:
    """A laboratory's CSV of the record in SI; ``rows`` selects, ``columns`` replaces."""
    w = {k: np.asarray(columns.get(k, v)) for k, v in record.windows.items()}
    names = ("phase", "t_start", "t_end", "angle_start", "angle_end", "mean")
    lines = ["# latitude = 45.75deg", "# k = 17.2deg/h/mA"]
    lines += [f"# phase {p.phase} = {p.face}" for p in record.run.plan]
    lines += [header or "phase,t_start [s],t_end [s],angle_start [rad],angle_end [rad],mean [A]"]
    chosen = range(len(w["mean"])) if rows is None else rows
    return "\n".join([*lines, *(",".join(repr(w[n][k].item()) for n in names) for k in chosen)]) + "\n"


def test_the_record_itself_is_reduced(command: Command, record: Record, tmp_path: Path) -> None:
    file = tmp_path / "lab.csv"
    file.write_text(text(record), encoding="utf-8")
    code, out, err = command("reduce", NAME, "--data", file, "--out", tmp_path / "out")
    assert code == 0, err
    assert "D_IS" in out


def cases(record: Record) -> dict[str, tuple[str, list[str]]]:
    phase = record.windows["phase"]
    count = len(phase)
    gap = record.windows["mean"].copy()
    gap[4] = np.nan
    head = "phase,t_start [s],t_end [s],angle_start [rad],angle_end [rad],"
    short = [k for k in range(count) if phase[k] != 4]
    still = record.windows["angle_end"].copy()
    still[:] = 0.0
    good = text(record)
    return {
        "missing mount": (text(record, short), ["only one mount", "+pole and −pole"]),
        "missing dwell": (text(record, [k for k in range(count) if phase[k] != 3]), ["only one dwell", "D_F"]),
        "not finite": (text(record, mean=gap), ["row 12, column 'mean'", "not a finite number"]),
        "duplicate": (text(record, [0, 1, 2, 2, *range(3, count)]), ["the same as row"]),
        "time goes back": (text(record, [1, 0, *range(2, count)]), ["t_start", "does not come after"]),
        "wrong unit": (text(record, header=head + "mean [V]"), ["column 'mean': wrong unit [V]", "units that fit: A"]),
        "no unit": (text(record, header=head + "mean"), ["column 'mean': no unit", "mean [A]"]),
        "unknown unit": (text(record, header=head + "mean [mAmp]"), ["column 'mean'", "mAmp"]),
        "column missing": (text(record, header=head + "current [A]"), ["column 'mean [A]' is missing", "current"]),
        "table at rest": (text(record, angle_start=still, angle_end=still), ["does not move"]),
        "no latitude": (good.replace("# latitude = 45.75deg\n", ""), ["'latitude' is not given", "--set latitude="]),
        "no scale factor": (good.replace("# k = 17.2deg/h/mA\n", ""), ["'k' is not given", "--set k="]),
        "no attitude": (good.replace("# phase 2 = mount 1\n", ""), ["phase 2", "attitude is not given", "mount 1"]),
        "equator": (good.replace("45.75deg", "0deg"), ["rank 7 of 9", "D_IO"]),
        "pole": (good.replace("45.75deg", "-90deg"), ["rank 2 of 9"]),
        "wrong unit of k": (good.replace("17.2deg/h/mA", "17.2deg/h"), ["k: '17.2deg/h'", "units that fit"]),
        "empty": ("", ["no header line"]),
    }


NAMES_OF_CASES = [
    "missing mount", "missing dwell", "not finite", "duplicate", "time goes back", "wrong unit", "no unit",
    "unknown unit", "column missing", "table at rest", "no latitude", "no scale factor", "no attitude", "equator",
    "pole", "wrong unit of k", "empty",
]  # fmt: skip


@pytest.mark.parametrize("case", NAMES_OF_CASES)
def test_measured_record_is_refused(command: Command, record: Record, tmp_path: Path, case: str) -> None:
    found = cases(record)
    assert list(found) == NAMES_OF_CASES
    content, words = found[case]
    file = tmp_path / "lab.csv"
    file.write_text(content, encoding="utf-8")
    code, out, err = command("reduce", NAME, "--data", file, "--out", tmp_path / "out")
    assert code == 2, err
    assert out == "" and "Traceback" not in err
    for word in words:
        assert word in err, err
    assert not (tmp_path / "out").exists()


def test_file_that_is_not_there(command: Command, tmp_path: Path) -> None:
    code, _, err = command("reduce", NAME, "--data", tmp_path / "none.csv")
    assert code == 2
    assert "none.csv" in err
