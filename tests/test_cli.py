"""The commands as a user meets them: what they print, their exit codes, what they leave on disk."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from commanding import Command

from gyrobench.bench import Bench, standard_folder
from gyrobench.commands import cli, progress_display
from gyrobench.commands.arguments import parse_settings
from gyrobench.commands.console import print_notes
from gyrobench.engine.run_driver import ProgressReport
from gyrobench.record.record import Record
from gyrobench.workflow.progress_words import format_duration

NAME = "tumble_single_axis"
TINY = ["--set", "rate=30deg/s", "--set", "dwell=2", "--set", "settle=0.5", "--set", "windows=12"]


# ------------------------------------------------------------------------------------------ help, list
@pytest.mark.long
def test_help_has_an_example_for_each_command(gyrobench: Command) -> None:
    code, out, _ = gyrobench("--help")
    assert code == 0 and "gyrobench run tumble_single_axis" in out
    names = [c.name or c.callback.__name__ for c in cli.app.registered_commands if c.callback]
    assert len(names) == 25
    for name in names:
        code, text, _ = gyrobench(name, "--help")
        assert code == 0
        assert f"  gyrobench {name} " in text or f"Example: gyrobench {name}" in text, name
        assert f"  {name} " in out and "..." not in next(
            line for line in out.splitlines() if line.startswith(f"  {name} ")
        )


def test_version(gyrobench: Command) -> None:
    assert gyrobench("--version")[1].startswith("gyrobench")


@pytest.mark.long
def test_list_and_help_load_nothing_heavy() -> None:
    """0.5 s of the budget go to Python and typer; numpy, scipy and matplotlib alone would take it."""
    heavy = (
        "numpy",
        "gyrobench.record.run_document",
        "scipy",
        "matplotlib",
        "fmpy",
        "pyarrow",
        "jinja2",
        "typst",
        "control",
        "statsmodels",
    )
    for words in (["list"], ["--help"], ["run", "--help"]):
        code = (
            f"import sys; sys.argv = ['gyrobench', *{words!r}]\n"
            "from gyrobench.commands.cli import main\n"
            "try: main()\nexcept SystemExit: pass\n"
            f"print(sorted(set({heavy!r}) & set(sys.modules)), file=sys.stderr)"
        )
        done = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=Path(cli.__file__).parents[2]
        )
        assert done.stderr.strip() == "[]", words


def test_list(gyrobench: Command) -> None:
    code, out, err = gyrobench("list")
    assert (code, err) == (0, "")
    for name in (*Bench(standard_folder()).parts(), NAME, "SdfGyro"):
        assert f"  {name} " in out
    found = json.loads(gyrobench("list", "--json")[1])
    assert list(found) == ["parts", "systems", "sockets", "specifications", "instruments"]


def test_list_is_narrowed_by_words(gyrobench: Command) -> None:
    """Of every kind, in name, title or method, whatever the case; each word must be there."""
    found = json.loads(gyrobench("list", "Floated", "gyro", "--json")[1])
    assert "floated_gyro" in [r["name"] for r in found["parts"]]
    assert "gyro_dynamics" in [r["name"] for r in found["systems"]]
    assert not any(r["name"] == "site" for rows in found.values() for r in rows)
    out = gyrobench("list", "TEST-TUMBLE1-SDF")[1]
    assert out.startswith("systems\n  tumble_single_axis ") and "parts" not in out.split("\n")
    code, _, err = gyrobench("list", "tumbel")
    assert code == 2 and "nothing has 'tumbel' in its name, title or method; did you mean tumble_" in err


# ------------------------------------------------------------------------------------------------ show
@pytest.mark.long
def test_show_prints_order_cuts_plan_and_options(gyrobench: Command, tmp_path: Path) -> None:
    code, out, err = gyrobench("show", NAME, "--set", "rate=2deg/s", "--set", "latitude=50deg")
    assert (code, err) == (0, "")
    slots = out.split("slots, in the order of execution; step 0.001 s\n")[1].split("\n\n")[0]
    assert [line.split()[0] for line in slots.splitlines()][:3] == ["site", "sequencer", "table"]
    assert "rebalance.i -> gyro.i: one step delay" in out
    assert "360° at -2 °/s" in out
    assert re.search(r"latitude +50°", out)
    found = json.loads(gyrobench("show", NAME, "--json")[1])
    assert found["order"][:3] == ["site", "sequencer", "table"] and len(found["plan"]) == 4
    assert gyrobench("show", NAME, "--picture", "w.svg")[:2] == (0, "w.svg\n")
    assert (tmp_path / "w.svg").read_text(encoding="utf-8").startswith("<svg")


def test_values_of_a_file(gyrobench: Command, tmp_path: Path) -> None:
    """Options at the top, parameters under their slot; a value given singly goes before that of the file."""
    (tmp_path / "v.toml").write_text(
        'latitude = "50deg"\nturns = 3\n[gyro]\nwhite = "0.05deg/h/sqrt(Hz)"\nreaction = true\n'
        '[table]\n"tilt[1]" = 1e-5\n'
    )
    assert parse_settings(["@v.toml", "turns=2"]) == {
        "latitude": "50deg", "turns": "2", "gyro.white": "0.05deg/h/sqrt(Hz)", "gyro.reaction": "true",
        "table.tilt[1]": "1e-05",
    }  # fmt: skip
    code, out, err = gyrobench("show", NAME, "--set", "@v.toml", "--set", "latitude=60deg")
    assert (code, err) == (0, "") and re.search(r"latitude +60°", out) and re.search(r"turns +3", out)
    (tmp_path / "v.toml").write_text("[gyro]\nwite = 0.0\n")
    assert "gyro has no parameter 'wite'; nearest: white" in gyrobench("show", NAME, "--set", "@v.toml")[2]
    (tmp_path / "v.toml").write_text("date = 2026-01-01\n")
    assert "--set @v.toml: date = 2026-01-01: write a number" in gyrobench("show", NAME, "--set", "@v.toml")[2]


# --------------------------------------------------------------------------------------------- refused
REFUSED = [
    (["run", "tumbl_single_axis"], "no system 'tumbl_single_axis'; did you mean tumble_single_axis?"),
    (["show", "tumble_single"], "did you mean tumble_single_axis"),
    (["show", "imu_thermal"], "no system 'imu_thermal'; that is part of imu_positions"),
    (["show", "warm_up"], "no system 'warm_up'; that is part of turn_on_repeatability"),
    (["run", NAME, "--set", "type_b=none"], "type_b: what measured data say"),
    (["run", NAME, "--set", "latitud=45deg"], "latitud: no such option of tumble_single_axis; options: latitude"),
    (["run", NAME, "--set", "gyr.D_I=3"], "--set gyr.D_I: no slot 'gyr'; did you mean gyro?"),
    (["run", NAME, "--set", "gyro.D_Q=3"], "gyro has no parameter 'D_Q'; nearest: D_"),
    (["show", NAME, "--set", "gyro.D_Q=3"], "gyro has no parameter 'D_Q'; nearest: D_"),
    (["run", NAME, "--set", "latitude=45"], "a number without unit is in rad, write for example latitude=45deg"),
    (["run", NAME, "--set", "both_senses=yes"], "--set both_senses: 'yes': true or false is expected\n"),
    (["run", NAME, "--set", "rate=30"], "write 30deg/h, or 30rad/s if that is meant\n"),
    (["run", NAME, "--set", "latitude=45m"], "'m' (m) does not convert to 'rad'"),
    (["run", NAME, "--set", "latitude"], "--set latitude: write NAME=VALUE, for example --set latitude=45.75deg"),
    (["run", NAME, "--set", "turns=1", "--set", "turns=2"], "--set turns: given twice, 1 and 2"),
    (["run", NAME, "--set", "@no.toml"], "--set @no.toml: No such file or directory"),
    (["run", NAME, "--set", "@bad.fmu"], "--set @bad.fmu: not a TOML file"),
    (["run", NAME, "--step", "1m"], "units that fit: s, ms"),
    (["run", NAME, "--part", "gyr=site"], "no slot 'gyr'; did you mean gyro?"),
    (["run", NAME, "--part", "gyro=floated_gyr"], "no part 'floated_gyr'; did you mean floated_gyro?"),
    (["run", NAME, "--part", "gyro=no.fmu"], "slot gyro: no.fmu: not a readable FMU: no such file"),
    (["run", NAME, "--part", "gyro=full"], "no part 'full', which is a folder, where a file is expected"),
    (["fit", "full", "--slot", f"{NAME}.gyro"], "full: a folder, where a file is expected"),
    (["validate", "./full"], "./full: a folder, where a file is expected"),
    (["run", NAME, "--part", "gyro=bad.fmu"], "slot gyro: bad.fmu: not a readable FMU"),
    (["run", NAME, "--part", "gyro=site"], "slot gyro: FMU 'Site' does not fit socket SdfGyro"),
    (["run", NAME, "--map", "gyro=no.toml"], "--map gyro=no.toml: no such file"),
    (["run", NAME, "--spec", "floated_gyr"], "floated_gyr: no such file or acceptance specification; did you mean"),
    (["run", NAME, "--timeout", "1V"], "--timeout"),
    (["run", NAME, "--timeout", "0s"], "--timeout = 0s: must be > 0"),
    (["run", NAME, "--step", "-1ms"], "--step = -1ms: must be > 0"),
    (["run", NAME, "--seed", "-1"], "--seed"),
    (["run", "fixed_position", "--set", "dwell=1e300s"], "1e+300 s in steps of 0.001 s: more than 1e+12 steps"),
    (["run", NAME, "--engine", "fast"], "'linked', 'reference'"),
    (["run", NAME, "--out", "full"], "full: holds other files; name a new folder, for example full/run1"),
    (["run", NAME, "--out", "bad.fmu"], "bad.fmu: is a file"),
    (["run", NAME, "--sed", "3"], "No such option: --sed"),
    (["rum", NAME], "Did you mean 'run'?"),
    (["show", NAME, "--picture", "w.png"], "write w.svg"),
    (["build"], "no part named; name one or more, or set --all; parts: "),
    (["build", "site", "sit"], "no part 'sit'; did you mean site?"),
    (["build", "site", "--platform", "win"], "--platform win: unknown platform; available: linux64"),
    (["report", "full"], "full: no run there (no run.json)"),
    (["compare", "full"], "comparison: two runs or more are needed"),
    (["compare", "full", "nothing"], "nothing: no such folder"),
    (["compare", "full", "full"], "full: no result.json; write it by gyrobench report full"),
    (["reduce", NAME], "no record named; gyrobench reduce tumble_single_axis --data FILE.csv"),
    (["reduce", NAME, "--data", "no.csv"], "no.csv: No such file"),
    (["export", NAME], "Missing option '--to'"),
    (["export", NAME, "--to", "ssp", "--out", "x.zip"], "an SSP archive ends in .ssp"),
    (["validate", "no.fmu"], "no.fmu"),
    (["init", "full"], "full exists and is not empty"),
    (["init", "new", "--copy", "gyro"], "--copy gyro: no such part or system"),
]


@pytest.mark.parametrize(("words", "message"), REFUSED, ids=[" ".join(w) for w, _ in REFUSED])
def test_refused(gyrobench: Command, tmp_path: Path, words: list[str], message: str) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    (tmp_path / "bad.fmu").write_text("nothing", encoding="utf-8")
    code, out, err = gyrobench(*words)
    assert code == 2
    assert message in err
    assert out == "" and "Traceback" not in err
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad.fmu", "full"]


# --------------------------------------------------------------------------------- completion
COMPLETED = [
    ("gyrobench run tumble_t", ["tumble_two_axis", "tumble_two_channel"]),
    (f"gyrobench run {NAME} --set lat", ["latitude="]),
    (f"gyrobench run {NAME} --set gy", ["gyro."]),
    (f"gyrobench run {NAME} --set rate=1 --set gyro.whi", ["gyro.white="]),
    (f"gyrobench run {NAME} --set gyr.D", []),
    (f"gyrobench show {NAME} --part reb", ["rebalance="]),
    (f"gyrobench run {NAME} --spec floa", ["floated_gyro"]),
    ("gyrobench show drift_test_suite --set tes", ["tests="]),
    ("gyrobench run --set lat", []),
    ("gyrobench build floated_", ["floated_gyro"]),
    ("gyrobench init x --copy eight", ["eight_position"]),
    ("gyrobench rec", ["record"]),
]


@pytest.mark.parametrize(("line", "words"), COMPLETED, ids=[line for line, _ in COMPLETED])
def test_the_shell_completes(
    line: str, words: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["gyrobench"])
    monkeypatch.setenv("_GYROBENCH_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", line)
    monkeypatch.setenv("COMP_CWORD", str(len(line.split()) - 1))
    with pytest.raises(SystemExit):
        cli.main()
    assert capsys.readouterr().out.split() == words


# ------------------------------------------------------------------------------------------- progress
def test_progress_in_lines_where_there_is_no_terminal(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress_display, "PAUSE", 0.0)
    with progress_display.ProgressDisplay("tumble") as display:
        display(ProgressReport(time=250.0, total=1000.0, steps=250_000, windows=3, rate=1e6, elapsed=2.5))
    # 250 of 1000 s are done after 2.5 s: 7.5 s are left; 250,000 steps in 2.5 s
    assert capsys.readouterr().err == "tumble: 25 %, t = 250 of 1,000 s, 0.10 M steps/s, 8 s left\n"


def test_a_note_on_several_slots_is_told_once(capsys: pytest.CaptureFixture[str]) -> None:
    print_notes(["site: slow: no compiler", "gyro: slow: no compiler", "reference engine"])
    assert capsys.readouterr().err == ("note: site, gyro: slow: no compiler\nnote: reference engine\n")


def test_progress_on_a_terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("COLUMNS", "120")
    with progress_display.ProgressDisplay("tumble") as display:
        display(ProgressReport(time=1.0, total=1000.0, steps=1000, windows=0, rate=1e6, elapsed=0.1))
        assert display.bar is None  # short runs stay silent
        display(ProgressReport(time=500.0, total=1000.0, steps=500_000, windows=3, rate=1e6, elapsed=60.0))
        assert display.bar is not None and display.bar.tasks[0].completed == 0.5
        assert "1 min 00 s left" in display.bar.tasks[0].fields["words"]
    captured = capsys.readouterr()
    assert captured.out == ""


def test_spans_of_time() -> None:
    assert [format_duration(s) for s in (0.4, 75.0, 7265.0, float("inf"))] == [
        "0 s", "1 min 15 s", "2 h 01 min", "unknown",
    ]  # fmt: skip


# ------------------------------------------------------------------------------ build, export, validate
def test_build_prints_paths_and_is_quick_the_second_time(gyrobench: Command, tmp_path: Path) -> None:
    code, out, _ = gyrobench("build", "site", "sampler", "site")
    assert (code, out) == (0, "fmus/site.fmu\nfmus/sampler.fmu\n")
    assert gyrobench("build", "site", "--target", "python", "--out", "o")[1] == "o/site-python.fmu\n"
    assert gyrobench("validate", "fmus/site.fmu")[:2] == (0, "fmus/site.fmu: no problems found\n")
    broken = tmp_path / "broken.fmu"
    broken.write_bytes(b"nothing")
    code, out, _ = gyrobench("validate", broken)
    assert code == 1 and out == f"{broken}: not a readable FMU: File is not a zip file\n"


@pytest.mark.long
def test_parts_are_built_side_by_side(gyrobench: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same files as one after the other; one that cannot be built is named, and those before it are there."""
    from gyrobench import packaging

    monkeypatch.setenv("GYROBENCH_CACHE", str(tmp_path / "a"))
    names = ["meter", "site", "sampler"]
    code, out, _ = gyrobench("build", *names, "--out", "o")
    assert (code, out) == (0, "o/meter.fmu\no/site.fmu\no/sampler.fmu\n")
    monkeypatch.setenv("GYROBENCH_CACHE", str(tmp_path / "b"))
    for name in names:
        alone = packaging.build(name, out=tmp_path / "alone")
        assert alone.read_bytes() == (tmp_path / "o" / f"{name}.fmu").read_bytes()
    assert gyrobench("init", "mine", "--copy", "site")[0] == 0
    model = tmp_path / "mine" / "components" / "site" / "model.py"
    text = model.read_text(encoding="utf-8")
    model.write_text(f"{text}        oops\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path / "mine")
    code, out, err = gyrobench("build", *names)
    line = text.count("\n") + 1
    assert code != 0 and out == "fmus/meter.fmu\n" and f"site/model.py:{line}: IndentationError" in err


@pytest.mark.long
def test_an_archive_repeats_run_and_report(
    gyrobench: Command, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """In a process that has exported nothing: what an export registers with ElementTree is not there."""
    values = (*TINY, "--set", "gyro.D_I=0.7deg/h/g")
    assert gyrobench("run", NAME, *values, "--seed", 7, "--out", "r")[0] == 0
    assert gyrobench("export", NAME, "--to", "ssp", *values, "--seed", 7)[:2] == (0, f"fmus/{NAME}.ssp\n")
    fresh = [sys.executable, "-m", "gyrobench", "run", f"fmus/{NAME}.ssp", "--out", "s", "--no-report"]
    done = subprocess.run([*fresh, "--no-check-step"], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and "changed since its export" not in done.stderr, done.stderr
    assert Record.load(tmp_path / "s").same_data(Record.load(tmp_path / "r"))
    first, again = (json.loads((tmp_path / f / "result.json").read_text(encoding="utf-8")) for f in "rs")
    assert again["coefficients"] == first["coefficients"]
    assert again["warnings"] == first["warnings"]
    # one changed value: the archive is not what was exported, and runs as it is wired
    with zipfile.ZipFile(tmp_path / "fmus" / f"{NAME}.ssp") as z:
        entries = {n: z.read(n) for n in z.namelist()}
    text = entries["resources/gyro.ssv"].decode()
    entries["resources/gyro.ssv"] = re.sub(r'(name="D_I">\s*<ssv:Real value=")[^"]*', r"\g<1>0.0", text).encode()
    assert entries["resources/gyro.ssv"] != text.encode()
    with zipfile.ZipFile(tmp_path / "changed.ssp", "w") as z:
        for name, data in entries.items():
            z.writestr(name, data)
    code, _, err = gyrobench("show", "changed.ssp")
    assert code == 0, err
    gyrobench("run", "changed.ssp", "--step", "20ms", "--out", "c")
    assert "changed.ssp was changed since its export: the archive runs as it is wired, without a reduct" in caplog.text


# ------------------------------------------------------------------------------------------- measured
@pytest.mark.long
def test_template_is_reduced_when_filled_in(gyrobench: Command, tmp_path: Path) -> None:
    code, template, _ = gyrobench("reduce", "torquer_scale_factor", "--template")
    assert code == 0 and "current [mA],rate_plus [deg/h]" in template
    # 17 °/h/mA both ways, at eight currents, by arithmetic
    rows = "".join(f"{i},{17 * i},{17 * i},360,360\n" for i in (0.5, 1, 2, 4, 6, 8, 10, 12))
    (tmp_path / "t.csv").write_text(template + rows, encoding="utf-8")
    code, out, err = gyrobench("reduce", "torquer_scale_factor", "--data", "t.csv", "--out", "r", pages=True)
    assert code == 0, err
    assert "K_LS " in out and "r/report.html" in out
    (k,) = [
        c
        for c in json.loads((tmp_path / "r" / "result.json").read_text(encoding="utf-8"))["coefficients"]
        if c["name"] == "K"
    ]
    assert (k["estimate"], k["unit"]) == (pytest.approx(17.0, rel=1e-12), "°/h/mA")
    (tmp_path / "t.csv").rename(tmp_path / "u.csv")
    code, _, err = gyrobench("reduce", "torquer_scale_factor", "--data", "u.csv", "--out", "r")
    assert code == 2 and "r: holds another run (its data differ)" in err
    assert gyrobench("reduce", "torquer_scale_factor", "--data", "u.csv", "--out", "r", "--force")[0] == 0
    assert gyrobench("report", "r")[0] == 0


def test_the_command_after_init_holds_for_a_folder_with_blanks(gyrobench: Command, tmp_path: Path) -> None:
    assert "a new bench; cd 'Prüfstand 1' and gyrobench list" in gyrobench("init", "Prüfstand 1")[1]
