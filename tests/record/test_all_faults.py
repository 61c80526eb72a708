"""All faults of a measured file are in one list, with their rows."""

from __future__ import annotations

from pathlib import Path

import pytest
from openpyxl import Workbook

from gyrobench.record.column_proposal import find_layout
from gyrobench.record.csv_reader import DataError
from gyrobench.system.system import load_system
from gyrobench.workflow.measured_run import reduce_measured


def problems(system: str, file: Path, text: str) -> list[str]:
    file.write_text(text, encoding="utf-8")
    with pytest.raises(DataError) as error:
        load_system(system).read_measured(file, {})
    return error.value.problems


def test_windows(tmp_path: Path) -> None:
    """Ten faults: of a key, a value, a circumstance, the header (three), and the rows (four)."""
    text = """# latitud = 45deg
# k = 17mm
t_start [s],t_end [kg],mean,day,stdd [mA],flagged
0,60,0.1,1,0,0
60,120,0.2,one,0,0
120,180,0.3,2,0,
100,160,0.4,2,0,0
240,300,0.5,2,0
"""
    said = problems("open_loop_drift", tmp_path / "a.csv", text.replace("mean,day", "angel [deg],u [V]"))
    wanted = [
        "row 1: '# latitud = 45deg': unknown key 'latitud'; did you mean 'latitude'",
        "unknown key 'k'",
        "column 't_end': wrong unit [kg]",
        "column 'angle [rad]' is missing",
        "row 8: 5 cells, the header has 6",
        "row 5, column 'u': 'one' is not a finite number",
        "row 6, column 'flagged': a cell is empty",
        "row 7: t_start = 100 s does not come after 120 s (row 6)",
        "'latitude' is not given",
        "'attitude' is not given",
    ]
    assert len(said) == len(wanted) and all(w in s for w, s in zip(wanted, said, strict=True)), said


def test_time_series(tmp_path: Path) -> None:
    head = "# latitude = 45deg\n# k = 17.2deg/h/mA\n# atitude = E U -N\n# window = 5s\n# u_current = 5arcsec\n"
    rows = [f"{k},0.5,21" for k in range(40)]
    rows[3], rows[7], rows[9], rows[20], rows[30] = "3,off,21", "7,0.5", "9,0.5,", "17.5,0.5,21", "# note = late"
    said = problems("fixed_position", tmp_path / "a.csv", head + "time [s],current [mA],temperature [deg]\n"
                    + "\n".join(rows))  # fmt: skip
    wanted = [
        "row 3: '# atitude = E U -N': unknown key 'atitude'; did you mean 'attitude' or 'latitude'",
        "row 5: u_current: '5arcsec'",
        "'attitude' is not given",
        "column 'temperature': wrong unit [deg]",
        "row 37: '# note = late' stands among the rows",
        "a row has not the 3 cells of the header; the first: '7,0.5' (row 14)",
        "column 'current': 1 cell is not a number, the first: 'off' "
        "(a missing value? column map: absent = ['off']; row 10)",
        "time does not increase in 1 row, the first: '17.5' (row 27)",
    ]
    assert len(said) == len(wanted) and all(w in s for w, s in zip(wanted, said, strict=True)), said


@pytest.mark.parametrize("stated", ["", "# latitud = 45deg\n"])
def test_phases_without_an_attitude_are_named_beside_wrong_rows(tmp_path: Path, stated: str) -> None:
    """Windows with a row out of order; time series with one, and with a key that is wrong, too."""
    head = f"{stated}# latitude = 45deg\n# k = 17.2deg/h/mA\n# phase 2 = mount 1\n"
    windows = "1,0,9,0,0,0.1\n2,30,40,0,9,0.2\n2,20,30,9,18,0.3\n3,50,60,0,0,0.1\n"
    angles = "angle_start [deg],angle_end [deg]"
    of_windows = problems("tumble_single_axis", tmp_path / "w.csv",
                          f"{head}phase,t_start [s],t_end [s],{angles},mean [mA]\n{windows}")  # fmt: skip
    series = "1,0,0,0.1\n0,1,0,0.1\n2,2,9,0.2\n2,1.5,9,0.3\n3,3,0,0.1\n"
    of_series = problems("tumble_single_axis", tmp_path / "s.csv",
                         f"{head}phase,time [s],angle [deg],current [mA]\n{series}")  # fmt: skip
    for said, order in ((of_windows, "t_start = 20 s does not come after 30 s"), (of_series, "time does not increase")):
        named = [s[:7] for s in said if "its attitude is not given" in s]
        assert named == ["phase 1", "phase 3"], said
        assert sum(order in s for s in said) == 1 and len(said) == 3 + bool(stated), said


def test_drift_record(tmp_path: Path) -> None:
    rows = [f"{k},0.5,21" for k in range(40)]
    rows[3], rows[5] = "3,off,21", "5,0.5"
    said = problems("drift_record", tmp_path / "a.csv", "# chanel = rate\n# samples = averages\n"
                    "time [s],rate [deg/h],temperature [degC]\n" + "\n".join(rows))  # fmt: skip
    wanted = [
        "row 1: '# chanel = rate': unknown key 'chanel'; did you mean 'channel'",
        "samples = averages: must be 'means'",
        "a row has not the 3 cells of the header; the first: '5,0.5' (row 9)",
        "column 'rate': 1 cell is not a number, the first: 'off' "
        "(a missing value? column map: absent = ['off']; row 7)",
    ]
    assert len(said) == len(wanted) and all(w in s for w, s in zip(wanted, said, strict=True)), said


def test_a_layout_of_its_own_is_pointed_to(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Units in a row of their own, a merged title above the names, times of day: ``fit`` reads what is refused here.
    Where names and rows are those of the bench, a map would help nothing."""
    monkeypatch.chdir(tmp_path)
    rows = [f"{60 * k},{60 * k + 60},{0.02 + 1e-4 * (k % 3)}" for k in range(12)]
    names, stamps = "t_start [s],t_end [s],mean [mA]", [f"29.11.2026 12:{k:02d}:00" for k in range(13)]
    layouts = {
        "units": ["t_start,t_end,mean", "s,s,mA", *rows],
        "merged": ["Zeit,,Strom", names, *rows],
        "stamps": [names, *(f"{stamps[k]},{stamps[k + 1]},0.0{k + 10}" for k in range(12))],
        "word": [names, *rows, "720,780,off"],
        "spelled": [names.replace("mA", "Milliampere"), *rows],
    }
    advised = {}
    for name, lines in layouts.items():
        file = tmp_path / f"{name}.csv"
        file.write_text("# operator = N. N.\n" + "\n".join(lines), encoding="utf-8")
        with pytest.raises(DataError) as error:
            reduce_measured(load_system("fixed_position"), file, {}, in_memory=True)
        advised[name] = [a.action for a in error.value.advice]
    assert advised == {"units": ["fit"], "merged": ["fit"], "stamps": ["fit"], "word": [], "spelled": ["fit"]}
    book = Workbook()
    for line in layouts["merged"]:
        book.active.append([float(c) if c[0].isdigit() else c for c in line.split(",") if c])
    book.save(tmp_path / "merged.xlsx")
    with pytest.raises(DataError) as error:
        reduce_measured(load_system("fixed_position"), tmp_path / "merged.xlsx", {}, in_memory=True)
    assert [a.action for a in error.value.advice] == ["fit"]


def test_errors_of_a_spreadsheet_are_cells_without_a_value(tmp_path: Path) -> None:
    rows = [f"{k};0,02{k};{cell}" for k, cell in enumerate(["1", "#DIV/0!", "#WERT!", "n/a", "-", "2"])]
    file = tmp_path / "a.csv"
    file.write_text("time [s];current [mA];temperature [degC]\n" + "\n".join(rows), encoding="utf-8")
    layout = find_layout(file)
    assert [c.empty for c in layout.columns] == [0, 0, 4] and layout.rows == 6
