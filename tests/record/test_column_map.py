"""Column maps: rows of any layout as those of the bench, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.bench import UsageError
from gyrobench.record.column_map import MappedRows, read_map, translate
from gyrobench.record.column_proposal import find_encoding, find_layout
from gyrobench.record.csv_reader import DataError
from gyrobench.system.system import load_system
from gyrobench.workflow.fit_columns import propose_columns, write_columns
from gyrobench.workflow.measured_run import reduce_measured


def mapped(folder: Path, text: str, columns: str, encoding: str = "utf-8") -> tuple[list[str], MappedRows]:
    """Return the lines of a file under a map."""
    (folder / "data.txt").write_bytes(text.encode(encoding))
    (folder / "map.toml").write_text(columns, encoding="utf-8")
    done = translate(folder / "data.txt", read_map(folder / "map.toml"), folder / "out.csv")
    return (folder / "out.csv").read_text(encoding="utf-8").splitlines(), done


def test_rows_keep_their_numbers(tmp_path: Path) -> None:
    """Line for line: header block, names, units, an empty line, a row without a value, one with the value above it."""
    text = "Lab\n\nt;I;Lage\ns;nA;\n0;1,5;1\n\n10;-;\n20;−2,5e1;2\n"
    columns = """delimiter = ";"
decimal = ","
skip = 2
below = 1
empty = "skip"
[columns.t_start]
from = "t"
unit = "s"
[columns.t_end]
next = "t_start"
last = "0.5min"
[columns.mean]
from = 2
unit = "nA"
factor = -2
[columns.phase]
from = "Lage"
empty = "previous"
"""
    lines, done = mapped(tmp_path, text, columns)
    assert lines == [
        "#", "#", "t_start [s],t_end [s],mean [nA],phase", "#", "0,10,-3.0,1", "#", "#", "20,50.0,50.0,2",
    ]  # fmt: skip
    assert done.skipped == [7] and done.problems() == []
    assert done.before["phase"] == "2"


def test_dates_and_clock_times(tmp_path: Path) -> None:
    """Seconds since the first row: over midnight without a date, over a month with one, from a zone to another."""
    column = '[columns.{}]\nfrom = "{}"\ntime = "%H:%M:%S"\n'
    clock = f'delimiter = ";"\n{column.format("t_start", "a")}{column.format("t_end", "b")}'
    lines, _ = mapped(tmp_path, "a;b\n23:59:50;00:00:00\n00:00:00;00:00:10\n11:00:00;11:30:00\n", clock)
    assert lines[1:] == ["0.0,10.0", "10.0,20.0", "39610.0,41410.0"]
    _, done = mapped(tmp_path, "a;b\n12:00:00;12:00:10\n11:59:00;12:01:00\n", clock)
    assert done.problems() == [
        "row 3: '11:59:00': column 't_start': runs back, or after half a day and more: a date is needed"
    ]
    following = '[columns.t_start]\nfrom = "a"\n[columns.t_end]\nnext = "t_start"\n'
    _, done = mapped(tmp_path, "a,b\n0,0\n5,0\n4,0\n", following)
    assert done.problems() == ["row 3: '5': column 't_start': the next row has 4"]
    dated = '[columns.time]\nfrom = ["d", "t"]\ntime = "%d.%m.%Y %H:%M:%S,%f"\n'
    lines, _ = mapped(tmp_path, 'd,t\n31.01.2026,"23:59:59,500"\n01.02.2026,"00:00:00,250"\n', dated)
    assert lines == ["time [s]", "0.0", "0.75"]
    zone = '[columns.time]\nfrom = "t"\ntime = "%Y-%m-%dT%H:%M:%S%z"\n'
    lines, _ = mapped(tmp_path, "t\n2026-03-29T01:59:59+0100\n2026-03-29T03:00:01+0200\n", zone)
    assert lines[1:] == ["0.0", "2.0"]


def test_a_local_clock_that_is_set(tmp_path: Path) -> None:
    """Readings of a minute each from 01:57 on: at two o'clock the clock shows three, in autumn two once more.  The
    reading before then would last 61 minutes, and -59."""
    columns = '[columns.t_start]\nfrom = "a"\ntime = "%H:%M"\n[columns.t_end]\nnext = "t_start"\n'
    _, done = mapped(tmp_path, "a\n01:57\n01:58\n01:59\n03:00\n03:01\n03:02\n", columns)
    assert done.problems() == [] and done.lengths[4] == 61 * 60.0
    assert [n.partition(": ")[2][:20] for n in done.notes() if n.startswith("Readings that last")] == [
        "row 4. A pause is in"
    ]
    autumn = columns.replace("%H:%M", "%d %H:%M")
    _, done = mapped(tmp_path, "a\n25 02:58\n25 02:59\n25 02:00\n25 02:01\n", autumn)
    said = "the next row has 25 02:00: a clock that was set back? Times in UTC or with their zone are needed"
    assert done.problems() == [f"row 3: '60.0 s': column 't_start': {said}"]


@pytest.mark.parametrize("encoding", ["cp1252", "utf-16", "utf-16-le", "utf-8-sig", "latin-1"])
def test_encodings(encoding: str, tmp_path: Path) -> None:
    columns = f'encoding = "{encoding}"\n[columns.x]\nfrom = "Größe"\n'
    assert mapped(tmp_path, "Größe,b\n1,2\n", columns, encoding)[0] == ["x", "1"]
    with pytest.raises(DataError, match="after row 0: not text in utf-8"):
        mapped(tmp_path, "Größe,b\n1,2\n", columns.replace(encoding, "utf-8"), "cp1252")
    found = find_encoding(("Größe,b\n" + "1,2\n" * 50).encode(encoding))
    assert found == {"latin-1": "cp1252", "utf-8-sig": "utf-8"}.get(encoding, encoding)


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ("", "columns: field required"),
        ("colums = 1\n[columns.a]\nfrom = 1", "colums: unknown key; did you mean columns?"),
        ("[columns.a]\nfrom = 1\nfacter = 2", "columns.a.facter: unknown key; did you mean factor?"),
        ("[columns.a]\nfrom = 1\nunit = 'furlong'", "columns.a.unit: unit 'furlong': unknown symbol"),
        ("[columns.a]\nfrom = 1\nunit = 's'\n[columns.b]\nnext = 'a'\nlast = '2 mm'\n", "columns.b.last: '2 mm'"),
        (
            "[columns.a]\nfrom = 1\nunit = 'mA'\n[columns.b]\nnext = 'a'\nlast = '1s'",
            "only beside next = a column of times",
        ),
        ("[columns.a]\nunit = 's'", "columns.a: either 'from' or 'next' is expected"),
        ("[columns.a]\nnext = 'b'", "next = b: no column of this map with 'from'"),
        ("[columns.a]\nfrom = [1, 2]", "several columns are joined for a date and a clock time: time is missing"),
        ("[columns.a]\nfrom = 1\ntime = '%H:%M'\nunit = 's'", "time gives seconds; leave out unit and factor"),
        ("[columns.a]\nfrom = 1\ntime = '%H:%M'\n[columns.b]\nfrom = 2\ntime = '%d.%m.%Y'", "all with a date or none"),
        ("encoding = 'klingon'\n[columns.a]\nfrom = 1", "encoding = klingon: unknown"),
        ("decimal = ','\n[columns.a]\nfrom = 1", "delimiter and decimal are both ','"),
        ("skip = '9'\n[columns.a]\nfrom = 1", "skip = '9': input should be a valid integer"),
        ("empty = 'drop'\n[columns.a]\nfrom = 1", "empty = 'drop': input should be 'missing', 'skip' or 'previous'"),
        ("names = false\n[columns.a]\nfrom = 'x'", "columns.a: from: where names = false, the number of the column"),
        ("names = false\nbelow = 1\n[columns.a]\nfrom = 1", "below: nothing stands between names and rows"),
        ("[columns.'a [s]']\nfrom = 1", "a name of the bench has no unit, comma or quote"),
    ],
)
def test_maps_that_are_refused(columns: str, words: str, tmp_path: Path) -> None:
    (tmp_path / "map.toml").write_text(columns, encoding="utf-8")
    with pytest.raises(UsageError) as error:
        read_map(tmp_path / "map.toml")
    assert words in str(error.value), str(error.value)


def test_columns_that_the_file_does_not_have(tmp_path: Path) -> None:
    columns = "[columns.a]\nfrom = 'Stromm'\n[columns.b]\nfrom = 'x'\n[columns.c]\nfrom = 7\n"
    with pytest.raises(DataError) as error:
        mapped(tmp_path, "Strom,x,x\n1,2,3\n", columns)
    assert error.value.problems == [
        "columns.a: from = 'Stromm': no such column in row 1; did you mean Strom?",
        "columns.b: from = 'x': several columns have this name: give its number in row 1",
        "columns.c: from = 7: the file has 3 columns",
    ]
    with pytest.raises(DataError, match="no names of columns in row 4"):
        mapped(tmp_path, "a\n1\n", "skip = 3\n[columns.a]\nfrom = 1\n")


def test_all_faults_of_a_mapped_file_are_in_one_list(tmp_path: Path) -> None:
    """Of the map's own (a date, a point, cells) and of the reader's (text, unit, circumstances), rows of the file."""
    rows = (
        "01.01.2026 00:00;0,1",
        "32.01.2026 00:00;0,2",
        "03.01.2026 00:00;1.234",
        "04.01.2026 00:00;aus",
        ";",
        "1;2;3",
    )
    text = "\n".join(["Kopf", "Zeit;Strom", *rows, ""])
    columns = """delimiter = ";"
decimal = ","
skip = 1
[columns.t_start]
from = "Zeit"
time = "%d.%m.%Y %H:%M"
[columns.t_end]
next = "t_start"
last = "1h"
[columns.mean]
from = "Strom"
unit = "mV"
[set]
latitude = "45deg"
"""
    (tmp_path / "data.csv").write_text(text, encoding="utf-8")
    (tmp_path / "map.toml").write_text(columns, encoding="utf-8")
    with pytest.raises(DataError) as error:
        reduce_measured(
            load_system("fixed_position"), tmp_path / "data.csv", {"k": "17deg/h/mA"}, in_memory=True,
            columns=tmp_path / "map.toml",
        )  # fmt: skip
    wanted = [
        "row 4: '32.01.2026 00:00': column 't_start': not of the form %d.%m.%Y %H:%M",
        "row 5: '1.234': column 'mean': a point, where the decimal sign is a comma",
        "row 8: '1 2 3': not the 2 cells of the names in row 2",
        "column 'mean': wrong unit [mV]",
        "row 4, column 't_start': '32.01.2026 00:00' is not a finite number",
        "row 3, column 't_end': '32.01.2026 00:00' is not a finite number",
        "'attitude' is not given",
    ]
    said = error.value.problems
    assert str(error.value).startswith(f"{tmp_path / 'data.csv'}: not usable")
    assert len(said) == len(wanted) and all(w in s for w, s in zip(wanted, said, strict=True)), said


def proposed(folder: Path, text: str, system: str) -> tuple[str, list[str]]:
    (folder / "log.txt").write_text(text, encoding="utf-8")
    return write_columns(folder / "log.txt", system, None)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.long
def test_proposal_for_a_drift_record_of_a_logger(tmp_path: Path) -> None:
    """Units in a row of their own, a blank as separator; the rates in dps become those of the record."""
    gx = np.random.default_rng(1).normal(size=600).round(3).tolist()
    rows = "".join(f"{0.01 * k:.2f} {x:.3f} {0.002 * (k % 5 - 2):.3f} 21.5\n" for k, x in enumerate(gx))
    text, problems = proposed(tmp_path, f"Logger 3\nt gx gy T\ns dps dps degC\n{rows}", "drift_record")
    assert problems == []
    (tmp_path / "map.toml").write_text(text, encoding="utf-8")
    outcome = reduce_measured(
        load_system("drift_record"), tmp_path / "log.txt", {"type_b": "none"}, in_memory=True,
        columns=tmp_path / "map.toml",
    )  # fmt: skip
    w = outcome.record.windows
    assert {"gx", "gy"} <= set(w)
    assert w["gx"][:3] == pytest.approx([x * 3.14159265358979 / 180.0 for x in gx[:3]], rel=1e-12)
    assert outcome.record.run.series["unused"] == []


def test_proposal_with_a_form_of_dates_in_the_row_of_units(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    rows = "".join(f"{k};02.03.2026 22:15:{k:02d};10,{k};23,5;OK\n" for k in range(9))
    head = "Messprotokoll;;;;\n\nNr.;Uhrzeit;Omega, roh (°/h);Temp. in °C;Status\n;TT.MM.JJJJ hh:mm:ss;°/h;°C;-\n"
    log.write_text(head + rows, encoding="cp1252")
    layout = find_layout(log)
    assert (layout.skip, layout.below, layout.decimal) == (2, 1, ",")
    assert [(c.name, c.unit) for c in layout.columns][1:4] == [
        ("Uhrzeit", ""),
        ("Omega, roh", "°/h"),
        ("Temp.", "degC"),
    ]


def test_proposal_for_columns_without_units(tmp_path: Path) -> None:
    """Their units are not guessed: each is asked for."""
    rows = "".join(f"{0.01 * k:.2f},{k % 7},{k % 5},{20 + k % 3}\n" for k in range(600))
    text, problems = proposed(tmp_path, f"time,gyro_x,acc_x,temperature\n{rows}", "drift_record")
    assert "[columns.time]" in text and '[columns.gyro_x]\nfrom = "gyro_x"\n# unit = "deg/s"' in text
    assert '[columns.acc_x]\nfrom = "acc_x"\n# unit = "m/s2"' in text and "# Not used: none" in text
    assert [p.split(";")[0] for p in problems] == [
        f"column '{n}': its unit: the file tells none" for n in ("time", "gyro_x", "acc_x", "temperature")
    ]
    assert ["of counts" in p for p in problems] == [False, True, True, False]
    _, problems = proposed(tmp_path, "a,b\n1,2\n3,4\n", "drift_record")
    none, entry, unused = problems[1].split("; ")
    assert (none, unused) == ("column 'rate': none of the file fits by name and unit", "not used so far: 'a', 'b'")
    counts = "(of counts: unit and factor = the size of one)"
    assert entry == f'write [columns.rate] with from = "ITS NAME" and unit = "deg/s" {counts}' and len(problems) == 2


def test_day_and_month_are_asked_for_where_both_orders_fit(tmp_path: Path) -> None:
    """The 28th of a month tells them, the 5th does not; names spell their units out."""
    for day, form, asked in (("03/28", "%m/%d", False), ("28/03", "%d/%m", False), ("05/03", "%d/%m", True)):
        rows = "".join(f"{day}/2026,12:{k:02d}:00,0.{k + 10}\n" for k in range(30))
        text, problems = proposed(tmp_path, f"Datum,Uhrzeit (Sec.),Strom (Milliampere)\n{rows}", "fixed_position")
        assert f'time = "{form}/%Y %H:%M:%S"' in text and 'unit = "mA"' in text
        assert bool(problems) == any("may be exchanged" in p for p in problems) == asked, problems
    text, problems = proposed(tmp_path, "Beginn (Sec.),Ende (seconds),Strom [A]\n0,1,2\n1,2,3\n", "fixed_position")
    assert text.count('unit = "s"') == 2 and problems == []
    text, problems = proposed(tmp_path, "t [s],Rate [Grad/Std]\n0,1\n1,2\n", "drift_record")
    assert 'unit = "deg/h"' in text and problems == []


def test_a_temperature_is_not_blamed_for_a_rate_without_unit(tmp_path: Path) -> None:
    """The column that could be the rate is named, not the one in degrees, under whatever name."""
    file = tmp_path / "log.csv"
    rows = "".join(f"{k},{k % 7},{20 + k % 3}\n" for k in range(600))
    file.write_text(f"time [s],Drehrate,Gehäuse [degC]\n{rows}", encoding="utf-8")
    with pytest.raises(gb.GyrobenchError, match="column 'Drehrate': no unit") as refused:
        gb.reduce("drift_record", file)
    assert "Gehäuse" not in str(refused.value)


def test_proposal_for_a_tumble_names_what_it_lacks(tmp_path: Path) -> None:
    """One angle for two columns, a unit that the bench does not know: said, not guessed."""
    rows = "".join(f"1,{60 * k},{60 * k + 60},{k},{0.1 + 0.01 * k}\n" for k in range(20))
    text, problems = proposed(
        tmp_path, f"Phase,Beginn [s],Ende [s],Winkel [deg],Strom [Digits]\n{rows}", "tumble_single_axis"
    )
    for line in ('[columns.t_start]\nfrom = "Beginn [s]"', '[columns.t_end]\nfrom = "Ende [s]"', "[columns.phase]"):
        assert line in text
    assert any(p.startswith("column 'mean': its unit: 'Digits' is unknown; write unit = \"mA\"") for p in problems)
    assert any(p.startswith("column 'angle_end': none of the file fits") for p in problems)


def test_proposal_takes_long_files_for_time_series(tmp_path: Path) -> None:
    rows = "".join(f"{0.5 * k};{k % 3}\n" for k in range(2500))
    text, problems = proposed(tmp_path, f"Zeit [s];Strom [mA]\n{rows}", "fixed_position")
    assert problems == [] and "[columns.time]" in text and "[columns.current]" in text and "t_end" not in text


@pytest.mark.parametrize("text", ["", "only words\nand more\n", "a,b\n1,2,3\n4,5,6\n"])
def test_files_without_a_table_are_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    with pytest.raises(UsageError, match=r"row of (names|as many names)"):
        find_layout(tmp_path / "a.csv")


@pytest.mark.parametrize("above", ["", "Logger 3\n", "# t x\n\n"])
def test_a_file_without_names(above: str, tmp_path: Path, command: Any) -> None:
    """Columns by their numbers, all rows read, as those of the same file with names."""
    x = np.random.default_rng(2).normal(size=600).round(3).tolist()
    rows = "".join(f"{k / 50:.2f}\t{v:.3f}\t21.{k % 2}\n" for k, v in enumerate(x))
    file, bench_map = written(tmp_path / "log.txt", above + rows), tmp_path / "map.toml"
    code, _, err = command("reduce", "drift_record", "--data", file)
    assert code == 2 and "gyrobench fit" in err, err
    _, err = command("fit", file, "--system", "drift_record", "--out", bench_map)[1:]
    assert "from = ITS NUMBER" in err, err
    text = bench_map.read_text(encoding="utf-8")
    assert f"skip = {above.count(chr(10))}  #" in text and "names = false" in text
    assert f"# column_2: {x[0]:.3f}, {x[1]:.3f}, {x[2]:.3f} ...\n" in text
    assert '[columns.time]\nfrom = 1\n# unit = "s"' in text
    written(bench_map, text.replace('# unit = "s"', 'unit = "s"') + '[columns.gx]\nfrom = 2\nunit = "deg/s"\n')
    values = {"type_b": "none"}
    outcome = reduce_measured(load_system("drift_record"), file, values, in_memory=True, columns=bench_map)
    assert outcome.record.windows["gx"] == pytest.approx([v * 3.14159265358979 / 180.0 for v in x], rel=1e-12)
    written(file, above + rows.replace("0.06", "0,06", 1))  # the fourth row
    with pytest.raises(DataError) as refused:
        reduce_measured(load_system("drift_record"), file, values, in_memory=True, columns=bench_map)
    place, of_rows = refused.value.problems
    assert f"row {above.count(chr(10)) + 5})" in place and "one more than in the file" in of_rows


def test_a_record_of_one_column_is_a_rate(tmp_path: Path) -> None:
    text, problems = proposed(tmp_path, "0.1\n0.3\n-0.2\n0.15\n", "drift_record")
    assert '[columns.rate]\nfrom = 1\n# unit = "deg/s"' in text
    assert [p.split(";")[0] for p in problems] == [
        "column 'rate': its unit: the file tells none",
        'no column of times: write [columns.time], or sampling = "100Hz" below [set]',
    ]


def test_names_behind_the_mark_of_a_comment(tmp_path: Path) -> None:
    """As numpy.savetxt writes them."""
    text = "# time[s] gx[deg/s]\n" + "".join(f"{k} 0.{k}\n" for k in range(9))
    lines, done = mapped(tmp_path, text, 'delimiter = " "\n[columns.gx]\nfrom = "gx[deg/s]"\nunit = "deg/s"\n')
    assert [c.name for c in find_layout(written(tmp_path / "a.txt", text)).columns] == ["time", "gx"]
    assert lines == ["gx [deg/s]", *(f"0.{k}" for k in range(9))] and not done.problems()


def test_spreadsheets_are_refused_with_a_word(tmp_path: Path) -> None:
    (tmp_path / "a.xlsx").write_bytes(b"PK\x03\x04" + bytes(100))
    with pytest.raises(UsageError, match="not a text file; save the table as CSV"):
        find_layout(tmp_path / "a.xlsx")


PLAIN = """delimiter = ";"
decimal = ","
skip = 1
[columns.t_start]
from = "t"
unit = "s"
[columns.mean]
from = 3
unit = "nA"
factor = -0.5
"""
ROWS = ["0;x;1,5e-3;", "10;y;-2,25;", "20;z;0,1;"]


def test_plain_numbers_go_the_quick_way_to_the_same_values(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """-0.5 * 1.5e-3 = -0.00075, -0.5 * -2.25 = 1.125, -0.5 * 0.1 = -0.05; a remark stays above the names."""
    text = "\n".join(["# operator = A", "t;text;I;", *ROWS, ""])
    monkeypatch.setattr(MappedRows, "_row", None)  # the way row by row cannot be gone
    lines, done = mapped(tmp_path, text, PLAIN)
    assert lines[:2] == ["# operator = A", "t_start [s],mean [nA]"] and not done.problems()
    assert [[float(c) for c in line.split(",")] for line in lines[2:]] == [[0, -0.00075], [10, 1.125], [20, -0.05]]


@pytest.mark.parametrize(
    "row", ["30;;−1;", "30;;;", "# a remark", "30;;1.5;", "", "30;;nan;", "30;;1;;7", '30;"a\nb";1;']
)
def test_what_is_not_plain_goes_row_by_row(row: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = "\n".join(["lab", "t;text;I;", *ROWS, row, "40;;2;", ""])
    found = mapped(tmp_path, text, PLAIN)
    monkeypatch.setattr("gyrobench.record.column_map._quick", lambda *of: False)
    lines, done = mapped(tmp_path, text, PLAIN)
    assert (found[0], found[1].problems()) == (lines, done.problems())


def test_units_at_the_end_of_a_name_and_the_way_to_a_map(tmp_path: Path, command: Any) -> None:
    """A header of its own is refused with the command that reads it; no unit: a bare s or c, the mg of a magnet."""
    text = (
        "fw 2\nts_us,gx_dps,Gyro_Y_rad_s,az_m_s2,die_temp_C,axis_c,mode_s,mag_x_mg,acc_y_mg\n"
        + "1,0.1,0.2,9.8,21.5,1,2,3,4\n" * 9
    )
    names = [(c.name, c.unit) for c in find_layout(written(tmp_path / "a log.csv", text)).columns]
    assert names == [("ts", "us"), ("gx", "dps"), ("Gyro_Y", "rad/s"), ("az", "m/s2"), ("die_temp", "degC"),
                     ("axis_c", ""), ("mode_s", ""), ("mag_x_mg", ""), ("acc_y", "mg")]  # fmt: skip
    code, _, err = command("reduce", "drift_record", "--data", tmp_path / "a log.csv")
    fit = next(line for line in err.splitlines() if "gyrobench fit" in line)
    assert code == 2 and f"gyrobench fit '{tmp_path / 'a log.csv'}' --system drift_record --out 'a log.toml'" in fit
    code, _, err = command("fit", tmp_path / "a log.csv", "--system", "drift_record", "--out", tmp_path / "m.toml")
    assert code == 0 and f"--columns {tmp_path / 'm.toml'}" in err and "by hand" not in err
    assert (tmp_path / "m.toml").read_text(encoding="utf-8").count("unit = ") == 6
    own = "# type_b = none\ntime [s],rate [deg/h]\n0,x\n1,2\n"  # the names of the bench: a map would change nothing
    code, _, err = command("reduce", "drift_record", "--data", written(tmp_path / "own.csv", own))
    assert code == 2 and "gyrobench fit" not in err, err


def test_what_belongs_to_a_rate_and_is_none(tmp_path: Path) -> None:
    """Columns without units, as evaluation boards and autopilots call them."""
    text = (
        "Sample,Time,X_GYRO_OUT,Z_ACCL_OUT,TEMP_OUT,gyro_integral_dt,acc_count,gyro_status\n" + "1,2,3,4,5,6,7,8\n" * 9
    )
    found = propose_columns(written(tmp_path / "log.csv", text), "drift_record").found
    assert set(found) == {"time", "X_GYRO_OUT", "Z_ACCL_OUT", "TEMP_OUT"}


def written(file: Path, text: str) -> Path:
    file.write_text(text, encoding="utf-8")
    return file
