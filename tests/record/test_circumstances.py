"""Comments of measured files: a misprint of a key must not leave a value at its default."""

from __future__ import annotations

import time
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gyrobench.bench import standard_folder
from gyrobench.record.circumstances import Keys, faults, statement, values_of
from gyrobench.record.csv_reader import DataError, read_statements
from gyrobench.system.lab_record import POLARITY, WITH_POLARITY
from gyrobench.system.suite import load_test
from gyrobench.system.system import System, load_system
from gyrobench.system.values import InvalidValueError
from gyrobench.workflow.empty_record import empty_record

CORPUS = Path(__file__).parents[1] / "corpus"
RECORDS = {f.stem: f for f in sorted(CORPUS.glob("*.csv"))}
DRIFT = Path(__file__).parents[2] / "docs/guides/drift_record/gyro.csv"
RECORDS["drift_record"] = DRIFT
MEASURED = sorted(
    f.name for f in (standard_folder() / "systems").iterdir()
    if (f / "system.py").exists() and getattr(load_test(f.name), "measured_data", None)
)  # fmt: skip


def problems(system: str, file: Path, text: str) -> list[str]:
    file.write_text(text, encoding="utf-8")
    with pytest.raises(DataError) as error:
        load_system(system).read_measured(file, {})
    return error.value.problems


def record_of(name: str) -> str:
    """A record of the corpus, or the template of the test with a row."""
    if name in RECORDS:
        return RECORDS[name].read_text(encoding="utf-8")
    template = empty_record(load_system(name))
    width = template.strip().rsplit("\n", 1)[-1].count(",") + 1
    return template + ",".join(["1", "0", "1", "0", "0", "0.1", "0.01", *["0"] * width][:width]) + "\n"


def known(system: System) -> Keys:
    return Keys((*system.options, *WITH_POLARITY, "samples", "window", "bandwidth"), phases=True)


@pytest.mark.parametrize("name", MEASURED)
def test_misprint_is_refused_with_the_nearest_key_by_every_reader(name: str, tmp_path: Path) -> None:
    """The file as it is states known keys only; with a letter less in one of its options, with one of them twice, it
    is refused."""
    text, system = record_of(name), load_system(name)
    (tmp_path / "good.csv").write_text(text, encoding="utf-8")
    assert faults(read_statements(tmp_path / "good.csv"), known(system)) == []
    option = max(system.options, key=len)
    (said,) = problems(name, tmp_path / "a.csv", f"# {option[:2]}{option[3:]} = 1\n{text}")
    assert said.startswith(f"row 1: '# {option[:2]}{option[3:]} = 1': unknown key")
    assert f"did you mean '{option}'?" in said
    (said,) = problems(name, tmp_path / "b.csv", f"# equipment = A\n# a remark\n# equipment = B\n{text}")
    assert said.startswith("rows 1 and 3: 'equipment' is given twice")


@pytest.mark.parametrize("name", MEASURED)
def test_polarity_is_taken_only_where_it_turns_readings_round(name: str, tmp_path: Path) -> None:
    """Elsewhere it was taken and had no effect.  The three tumbles read it (RebalanceSetup)."""
    text = "\n".join(line for line in record_of(name).splitlines() if not line.startswith(f"# {POLARITY}")) + "\n"
    file = tmp_path / "a.csv"
    if name.startswith("tumble_"):
        file.write_text(f"# polarity = left\n{text}", encoding="utf-8")
        assert load_system(name).read_measured(file, {}).run.polarity == "left"
        return
    (said,) = problems(name, file, f"# polarity = book\n{text}")
    assert said.startswith("row 1: '# polarity = book': this test does not turn its readings round")
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidValueError, match="polarity: this test does not turn"):
        load_system(name).read_measured(file, {POLARITY: "book"})


def test_misprint_of_the_issue(tmp_path: Path) -> None:
    """u_attitude stayed 0 in the report before.  A letter less than either: both are named."""
    text = RECORDS["fixed_position"].read_text(encoding="utf-8").replace("# type_b = none\n", "# u_atitude = 5arcsec\n")
    (said,) = problems("fixed_position", tmp_path / "a.csv", text)
    assert said == (
        "row 2: '# u_atitude = 5arcsec': unknown key 'u_atitude'; did you mean 'u_attitude' or 'u_latitude'? (a remark "
        "is a comment line without 'key =')"
    )


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("# Latitude = 45deg", "did you mean 'latitude'?"),
        ("# - u latitude = 5arcsec", "did you mean 'u_latitude'?"),
        ("#phase3 = static 4", "did you mean 'phase 3'?"),
        ("# phase 03 = static 4", "did you mean 'phase 3'?"),
        ("# zzz = 1", "there are: latitude, u_latitude, equipment, polarity"),
        ("# u_latitude: 5 arcsec", "states nothing, though it names 'u_latitude': write '# u_latitude = 5 arcsec'"),
        ("# polarity: book", "write '# polarity = book'"),
        ("# as certified, u_latitude = 5arcsec", "write '# u_latitude = 5arcsec' on a line of its own"),
        ("# equipment = table 3, latitude = 45deg", "states 'latitude' too: write a line for each key"),
    ],
)
def test_lines_that_look_like_statements(line: str, words: str) -> None:
    keys = Keys(("latitude", "u_latitude", "equipment", "polarity"), phases=True)
    (said,) = faults([s for s in [statement(line, 7)] if s], keys)
    assert said.startswith("row 7: ") and words in said


@pytest.mark.parametrize(
    "line",
    [
        "# The room was cooled in the afternoon",
        "# latitude: needed, here or by --set",
        "# gyrobench run drift_record --seed 17 --set latitude=45deg",
        "# counts are those of one sample: '# latitude = 45deg'",
        "# at 12:30 the operator changed the table speed = 3 rpm, and back",
        "# ==========",
        "#",
    ],
)
def test_remarks_are_free(line: str) -> None:
    assert faults([s for s in [statement(line, 1)] if s], Keys(("latitude", "speed"))) == []


def test_spreadsheets_leave_delimiters() -> None:
    stated = [statement(line, 1) for line in ("# latitude = 45deg;;;;", "# equipment = A, B,,")]
    assert values_of(s for s in stated if s) == {"latitude": "45deg", "equipment": "A, B"}


@pytest.mark.parametrize("name", MEASURED)
def test_template_states_no_more_than_its_examples(name: str, tmp_path: Path) -> None:
    """The words of a template are remarks, each of its keys is known and stated once."""
    file = tmp_path / "template.csv"
    file.write_text(empty_record(load_system(name)), encoding="utf-8")
    stated = read_statements(file)
    assert faults(stated, known(load_system(name))) == []
    values = values_of(stated).keys() - load_system(name).options
    assert "instrument" in values and "samples" not in values  # a word of the remarks


def test_time_series_and_what_stands_below_the_header(tmp_path: Path) -> None:
    head = "# latitude = 45deg\n# k = 17.2deg/h/mA\n# attitude = E U -N\n# type_b = none\n"
    rows = "time [s],current [mA]\n" + "".join(f"{k},0.5\n" for k in range(10))
    file = tmp_path / "series.csv"
    (said,) = problems("fixed_position", file, f"# bandwith = 14Hz\n{head}{rows}")
    assert "did you mean 'bandwidth'?" in said
    (said,) = problems("fixed_position", file, f"{head}# window = 5s\n{rows}# u_attitude = 5arcsec\n")
    assert said == "row 17: '# u_attitude = 5arcsec' stands among the rows: write it above the header"
    (said,) = problems("drift_record", file, f"{rows.replace('current [mA]', 'rate [deg/h]')}# sampling = 1Hz\n")
    assert "stands among the rows" in said


def test_wrong_values_of_a_file_are_named_with_their_rows(tmp_path: Path) -> None:
    text = RECORDS["fixed_position"].read_text(encoding="utf-8")
    said = problems("fixed_position", tmp_path / "a.csv", f"# u_attitude = 5mm\n# hieght = 3m\n{text}")
    assert [s[:6] for s in said] == ["row 2:", "row 1:"] and "did you mean 'height'?" in said[0] and "5mm" in said[1]


def test_metadata_of_other_programs_in_parquet(tmp_path: Path) -> None:
    """Keys of other programs pass; a misprint of a known one does not."""
    table = pa.table({"time [s]": [0.1 * k for k in range(200)], "rate [deg/h]": [float(k % 7) for k in range(200)]})
    file = tmp_path / "a.parquet"
    pq.write_table(table.replace_schema_metadata({"creator": "logger 3", "instrument": "gyro 17"}), file)
    assert load_system("drift_record").read_measured(file, {}).run.instrument == "gyro 17"
    pq.write_table(table.replace_schema_metadata({"creator": "logger 3", "instrumment": "gyro 17"}), file)
    with pytest.raises(DataError, match="unknown key 'instrumment'; did you mean 'instrument'"):
        load_system("drift_record").read_measured(file, {})


def test_list_of_runs_states_nothing(tmp_path: Path) -> None:
    """Each run has its own values: what the list said was without effect."""
    file = tmp_path / "days.csv"
    file.write_text("# a remark\n# u_attitude = 5arcsec\nrun\na\nb\n", encoding="utf-8")
    with pytest.raises(DataError) as error:
        load_system("fixed_position").read_measured(file, {"u_latitude": "5arcsec"})
    assert error.value.problems[0].startswith("'u_attitude' (row 2) is given: a list of runs states nothing")
    assert error.value.problems[1].startswith("--set u_latitude is given")


@pytest.mark.parametrize("line", ["#" + " " * 30_000 + "= 0.08 rad/s/A", "#" * 30_000 + " = 1", "# -" + " " * 30_000])
def test_a_line_of_spaces_is_read_at_once(line: str) -> None:
    """Some seconds each before, by what the pattern gave back one space after the other: twenty lines took 28 s."""
    begun = time.process_time()
    statement(line, 1)
    assert time.process_time() - begun < 0.5
