"""Mistakes of those who come with a platform, a stabilizer or an estimator: what is said, that nothing is lost."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from commanding import Command

from gyrobench.commands import cli
from gyrobench.report.result_json import content_hash

BENCH = ["run", "estimator_bench", "--set", "samples=13000"]
PLATFORM = ["run", "platform_single_axis"]
POWER = ["run", "stabilizer_power_2dof"]


PROFILES = {
    "unsorted": "time [s],roll [deg]\n0,0\n1,1\n0.5,2\n",
    "gap": "time [s],roll [deg]\n0,0\n1,\n2,2\n",
    "bare": "time,roll\n0,0\n1,1\n2,2\n",
    "metre": "time [s],roll [m]\n0,0\n1,1\n2,2\n",
}
REFUSED = [
    (
        [*POWER, "--set", "K_m=2000"],
        "stabilizer does not start: K_m = ratio k_u k_i k_m = 2000 N.m/rad is at or beyond",
    ),
    ([*POWER, "--set", "K_m=-5"], "K_m = -5: must be >= 0 N.m/rad\n"),
    ([*POWER, "--set", "profile=unsorted.csv"], "row 4: time = 0.5 s does not come after 1 s (row 3)"),
    ([*POWER, "--set", "profile=gap.csv"], "row 3, column 'roll': a cell is empty"),
    ([*POWER, "--set", "profile=bare.csv"], "column 'time': no unit; write 'time [s]'"),
    ([*POWER, "--set", "profile=metre.csv"], "column 'roll': wrong unit [m]: units that fit: rad"),
    ([*PLATFORM, "--set", "platform.J=0"], "platform does not start: parameter J = 0 kg.m2 must be > 0"),
    ([*PLATFORM, "--set", "hold=-60s"], "hold = -60s: must be >= 10 s"),
    (["run", "servo_polar", "--set", "latitude=95deg"], "latitude = 95deg: must be <= 1.5708 rad (90deg)"),
    ([*PLATFORM, "--set", "hold=60deg"], "units that fit: s, ms"),
    ([*PLATFORM, "--part", "stabilizer=estimator_none"], "does not fit socket Stabilizer"),
    ([*PLATFORM, "--part", "gyro=gyro_2dof"], "i: missing (input, A: torquer current)"),
    ([*PLATFORM, "--part", "estimator=xyz"], "no part 'xyz'; gyrobench list shows all"),
    ([*PLATFORM, "--step", "0"], "--step = 0: must be > 0"),
    ([*BENCH, "--part", "estimator=estimator_kalman_ar", "--set", "estimator.phi=[1.2,0.3,0.1]"], "not stationary"),
    ([*BENCH, "--part", "estimator=estimator_sage_husa", "--set", "estimator.b=1.5"], "parameter b = 1.5 "),
    (["run", "table_position_test", "--set", "mounts=0 inf"], "angles in deg with spaces between are expected"),
    (["run", "table_position_test", "--set", f"positions=[{10**400}]"], "a number is expected, or a text with number"),
    (["run", "servo_polar", "--set", f"latitude=1{'(' * 120}"], "((((...': 120 letters; a unit has at most 100"),
    (["run", "servo_polar", "--set", f"latitude={'[' * 250}{']' * 250}"], "JSON of more than 200 levels"),
    (["run", "servo_polar", "--timeout", "[1, 2]"], "--timeout = [1, 2]: one number is expected, not a list"),
    (["sweep", "servo_polar", "--over", "latitude=0..1:9999999999"], "a grid has 2 to 1000000 points"),
    (["run", "servo_two_axis", "--set", f"mounts={'9' * 100}"], "mounts"),
    (["run", "nothing.ssp"], "nothing.ssp refuses to run:\n  - no such file"),
    (["run", "vertical_gyro", "--set", "phases=erection rst"], "'rst' is none of erection"),
    (["run", "stabilizer_sdf", "--set", "J0=0kg.m2"], "J0 = 0 kg.m2: must be > 0"),
    # options of the reduction alone: found after the run before, whose record then had no way to a report
    (["run", "tumble_single_axis", "--set", "tilt=maybe"], "--set tilt = maybe: unknown; available: auto, yes, no"),
    (["run", "servo_polar", "--set", "nuisances=aut"], "--set nuisances = aut: unknown; available: auto, none"),
    (["run", "servo_polar", "--set", "supply_terms=D=3"], "--set supply_terms: 'D' is not one of D_pickoff"),
    (["run", "servo_polar", "--set", "corrections=foo"], "'foo' is not of the form 'SOURCE = VALUE(U) UNIT; ...'"),
    (["reduce", "drift_record", "rest.csv"], "rest.csv: not usable:\n  - no such file"),
    (["reduce", "platform_single_axis", "--template"], "no reduction of measured data; there is one for acc"),
]


@pytest.mark.parametrize(("words", "message"), REFUSED, ids=[" ".join(w[1:]) for w, _ in REFUSED])
def test_refused(gyrobench: Command, tmp_path: Path, words: list[str], message: str) -> None:
    for name, text in PROFILES.items():
        (tmp_path / f"{name}.csv").write_text(text, encoding="utf-8")
    code, out, err = gyrobench(*words)
    assert code == 2 and message in err and "Traceback" not in err
    assert out == "" and "note:" not in err, "notes that nobody can act on hide the message"


@pytest.mark.long
def test_a_part_of_the_users_own_is_told_what_it_leaves_open(gyrobench: Command) -> None:
    """The standard stabilizer has no i_motor either: that is the system's own choice, and no news."""
    assert "note:" not in gyrobench("show", "platform_single_axis")[1]
    assert gyrobench("init", "own", "--copy", "stabilizer_lead_lag")[0] == 0
    source = Path("own/components/stabilizer_lead_lag")
    source.rename("own/components/mine")
    code, out, err = gyrobench("build", "stabilizer_lead_lag", "--out", ".")
    assert code == 0, err
    Path("stabilizer_lead_lag.fmu").rename("mine.fmu")
    out = gyrobench("show", "platform_single_axis", "--part", "stabilizer=mine.fmu")[1]
    assert "stabilizer has no 'i_motor' (optional); not connected" in out


@pytest.mark.long
def test_a_step_check_that_fails_costs_no_report_and_compare_wants_something_in_common(gyrobench: Command) -> None:
    """The bench of estimators has one step only, that of its readings."""
    code, out, err = gyrobench(*BENCH, "--check-step", "--out", "a", pages=True)
    assert code == 3 and "step check: " in err and "the report is without it" in err
    assert "a/report.html" in out and Path("a/report.html").is_file()

    document = json.loads(Path("a/result.json").read_text(encoding="utf-8"))
    for folder, system, rename in (("b", "vertical_gyro", "of b: "), ("c", "other", "")):
        changed = [{**c, "name": rename + c["name"]} for c in document["coefficients"]]
        Path(folder).mkdir()
        other = {**document, "system": system, "coefficients": changed}
        digest = content_hash({k: v for k, v in other.items() if k not in ("schema", "report_id")})
        text = json.dumps({**other, "report_id": digest})
        Path(folder, "result.json").write_text(text, encoding="utf-8")
    code, _, err = gyrobench("compare", "a", "b")
    assert code == 2
    assert "b (vertical_gyro) and a (estimator_bench) have no coefficient in common: nothing to compare" in err
    code, _, err = gyrobench("compare", "a", "c")
    assert code == 0 and "runs of different systems (estimator_bench, other)" in err
    code, out, err = gyrobench("compare", "c", "a", figures=False)
    rows = out[out.index("ratio to the smallest") :].splitlines()[1:3]
    assert code == 0 and ["c" in rows[0].split(), "a" in rows[1].split()] == [True, True]


def test_init_copies_a_part_and_a_system_of_one_name(gyrobench: Command) -> None:
    code, out, _ = gyrobench("init", "own", "--copy", "vertical_gyro")
    assert code == 0 and "change its model.py" in out and "change its system.py" in out
    assert Path("own/components/vertical_gyro/model.py").is_file()
    assert Path("own/systems/vertical_gyro/system.py").is_file()


@pytest.mark.long
def test_a_run_that_breaks_off_says_once_where_its_record_is(gyrobench: Command) -> None:
    values = ["--set", "float_stop=0.01deg", "--set", "time=5s"]
    code, _, err = gyrobench("run", "stabilizer_sdf", *values, "--out", "a")
    assert code == 3 and "the float" in err and err.count("the record until then is kept in a") == 1
    assert Path("a/run.json").is_file()


def test_a_table_as_a_spreadsheet_saves_it(gyrobench: Command) -> None:
    reduce = ["reduce", "torquer_scale_factor", "--data", "t.csv"]
    head = "current [mA];rate_plus [deg/h];rate_minus [deg/h]\n"
    for data, message in (
        (("# operator = M\xfcller\n" + head).encode("latin-1"), "row 1: not UTF-8 text; save the table as CSV (UTF-8)"),
        ((head + "1;17\n").encode("utf-16"), "row 1: not UTF-8 text"),
        ((head + "1,5;17;17\n").encode(), "1 currents: at least 3 are needed"),  # a decimal comma is one
        (
            (head + "1;17\n" * 30).encode(),
            "rows 2, 3, 4, 5, 6, 7, 8, 9 and 22 more (30 rows): 2 cells, the header has 3\n",
        ),
    ):
        Path("t.csv").write_bytes(data)
        code, out, err = gyrobench(*reduce)
        assert code == 2 and message in err and not out and "Traceback" not in err


@pytest.mark.long
def test_python_dash_m(tmp_path: Path) -> None:
    path = str(Path(cli.__file__).parents[2])
    words = [sys.executable, "-m", "gyrobench", "show", "nothing"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, env={**os.environ, "PYTHONPATH": path})
    assert done.returncode == 2 and done.stderr.startswith("gyrobench: no system 'nothing'")
