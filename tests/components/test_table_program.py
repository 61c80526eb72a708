"""Program of a table: times of positions and commands, gates, health, files, refusals before motion."""

import json
import math

import pytest
from wired import BENCH

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part
from gyrobench.record.csv_reader import DataError
from gyrobench.system.table_program import read_program

TableProgram = load_part("table_program", BENCH)
DEG = math.pi / 180


def program(entries, **parameters):
    """Columns of (mode, target, rate, way, time)."""
    names = ("modes", "targets", "rates", "ways", "times")
    columns = {n: list(c) for n, c in zip(names, zip(*entries, strict=True), strict=True)}
    fill = {"modes": 1, "targets": 0.0, "rates": 0.0, "ways": 0, "times": 60.0}
    padded = {n: c + [fill[n]] * (99 - len(c)) for n, c in columns.items()}
    return TableProgram(entries=len(entries), **padded, **parameters)


def run(part, time, arrives, h=0.5, health=lambda t: 1.0):
    """Rows (t, phase, mode, target, gate, done, state, left); arrives: s after each new entry."""
    part.initialize()
    rows, since, last = [], 0.0, 1.0
    for k in range(round(time / h)):
        part.in_position = 1.0 if since >= arrives - 1e-9 else 0.0
        part.health = health(k * h)
        part.do_step(k * h, h)
        since = since + h if part.phase == last else 0.0
        last = part.phase
        rows.append(((k + 1) * h, part.phase, part.mode, part.target, part.gate, part.done, part.state, part.left))
    return rows


def spans(rows, column, value):
    """First and last time at which a column has a value, one pair a stretch."""
    out, inside = [], False
    for row in rows:
        if row[column] == value:
            out = [*out[:-1], (out[-1][0], row[0])] if inside else [*out, (row[0], row[0])]
        inside = row[column] == value
    return out


def test_positions_dwell_from_the_end_of_the_move():
    part = program([(1, 1.0, 0.0, 0, 60.0), (1, 2.0, 0.01, 2, 90.0)], settle=10.0, window_time=5.0)
    rows = run(part, 230.0, arrives=20.0)
    (first, second) = spans(rows, 4, 1.0)
    assert first[0] == pytest.approx(20.5 + 10.0) and first[1] == pytest.approx(20.5 + 60.0 + 1.0)  # two guard samples
    assert second[1] - second[0] == pytest.approx(90.0 - 10.0 + 1.0)
    assert rows[-1][5] == 1.0 and rows[-1][2] == 0.0 and rows[-1][6] == 4.0
    at = {row[0]: row for row in rows}
    assert at[40.5][7] == pytest.approx(60.0 - 20.0)  # time left of the dwell that is shown
    part.do_step(230.0, 0.5)
    assert (part.way, part.move_rate) == (2.0, 0.01)


def test_commands_come_by_the_clock():
    entries = [(1, 0.1, 0.05, 0, 30.0), (2, 7e-4, 0.0, 0, 20.0), (1, 0.0, 0.05, 1, 40.0)]
    rows = run(program(entries, kind=1, settle=2.0, window_time=5.0), 95.0, arrives=5.0)
    begins = [t for t, *_ in (next(r for r in rows if r[1] == k) for k in (2.0, 3.0))]
    assert begins == [30.0, 50.0]
    assert [r[2] for r in rows if r[0] in (20.0, 40.0, 60.0)] == [1.0, 2.0, 1.0]
    assert next(r[0] for r in rows if r[5] == 1.0) == 90.0
    gates = spans(rows, 4, 1.0)
    assert [round(b - a, 1) for a, b in gates] == [22.0, 12.0, 32.0]  # step - arrival - settle - what a sample adds


def test_health_stops_a_running_program():
    part = program([(1, 1.0, 0.0, 0, 60.0), (1, 2.0, 0.0, 0, 60.0)], window_time=5.0)
    rows = run(part, 60.0, arrives=5.0, health=lambda t: 0.0 if t >= 30.0 else 1.0)
    last = [r for r in rows if r[0] > 30.5]
    assert all((r[2], r[4], r[5], r[6]) == (0.0, 0.0, 1.0, 5.0) for r in last)


GOOD = (1, 0.1, 0.05, 0, 60.0)


@pytest.mark.parametrize(
    ("entries", "parameters", "text"),
    [
        ([(2, 0.01, 0.0, 0, 60.0)], {}, "entry 1: mode must be 1 index"),
        ([GOOD, (3, 0.1, 0.0, 0, 60.0)], {}, "entry 2: mode must be"),
        ([(1, 0.1, 0.0, 0, 59.0)], {}, "entry 1: a dwell must be"),
        ([(1, 0.1, 0.0, 0, 5941.0)], {}, "entry 1: a dwell must be"),
        ([GOOD, (1, 0.2, 0.05, 0, 9.0)], {"kind": 1}, "entry 2: a dwell must be .* a step of a command"),
        ([GOOD, (1, 0.2, 0.05, 0, 101.0)], {"kind": 1}, "entry 2"),
        # 3 rad at 0.05 rad/s takes 60 s
        ([(1, 3.0, 0.05, 0, 60.0)], {"kind": 1}, "entry 1: move, settle .* longer than the step"),
        # forced upwards, -0.2 rad is 6.08 rad, 122 s
        ([(1, -0.2, 0.05, 2, 60.0)], {"kind": 1}, "entry 1: move, settle"),
        ([(1, 0.1, 0.05, 0, 60.0)], {"settle": 55.0}, "longer than the dwell"),
        ([(1, 0.1, 0.2, 0, 60.0)], {}, "above rate_max"),
        # at 0.05 rad/s for 60 s the table is 3 rad away
        ([(2, 0.05, 0.0, 0, 60.0)], {"kind": 1, "limit": 2.0}, "entry 1: leads outside the range of the axis"),
        ([(1, 100 * DEG, 0.1, 0, 60.0)], {"limit": 95 * DEG}, "outside the range"),
        ([GOOD], {"health": 0.0}, "health = 0"),
    ],
)
def test_refused_before_motion(entries, parameters, text):
    health = parameters.pop("health", 1.0)
    part = program(entries, **parameters)
    part.health = health
    with pytest.raises(ComponentError, match=text):
        part.initialize()


def test_more_than_99_positions():
    with pytest.raises(ComponentError, match="entries"):
        TableProgram(entries=100).initialize()


def test_a_move_that_does_not_end_is_refused_when_its_step_is_over():
    with pytest.raises(ComponentError, match="takes longer than its step"):
        run(program([GOOD], kind=1), 70.0, arrives=100.0)


# ------------------------------------------------------------------------------------------------- files
CSV = """\
# five faces
kind,positions
mode,target,rate,way,time
index,30deg,2deg/s,shorter,1min
index,60deg,,up,90s
"""


def test_files(tmp_path):
    path = tmp_path / "program.csv"
    path.write_text(CSV)
    p = read_program(path)
    assert p.kind == "positions" and [e.time for e in p.entries] == [60.0, 90.0]
    assert p.entries[0].target == pytest.approx(30 * DEG) and p.entries[0].rate == pytest.approx(2 * DEG)
    assert [e.way for e in p.entries] == ["shorter", "up"]
    columns = p.parameters()
    assert columns["sequencer.ways"] == [1, 2] and columns["sequencer.entries"] == 2
    other = tmp_path / "program.json"
    rows = [{"mode": "rate", "target": "10ERU", "time": "60s"}, {"target": "0deg", "rate": "5deg/s", "time": 40}]
    other.write_text(json.dumps({"kind": "commands", "entries": rows}))
    p = read_program(other)
    assert p.entries[0].target == pytest.approx(10 * 7.2921159e-5) and p.entries[1].mode == "index"


@pytest.mark.parametrize(
    ("text", "problems"),
    [
        (CSV.replace("1min", "30s"), ["entry 1, time: a dwell must be 60 s to 5940 s, not 30 s"]),
        (CSV.replace("30deg", "30m"), ["entry 1, target"]),
        (CSV.replace("up", "round"), ["entry 2, way 'round'"]),
        (CSV.replace("index,60deg", "rate,6deg/s"), ["entry 2, mode 'rate': must be index"]),
        (CSV.replace("2deg/s", "-2deg/s").replace("90s", "9000s"), ["entry 1, rate", "entry 2, time"]),
        (CSV.replace("kind,positions", "kind,places"), ["kind 'places'"]),
        (CSV.replace("positions", "commands"), []),
        ("kind,positions\ntarget,time\n" + "1deg,1min\n" * 100, ["100 entries: 1 to 99 are possible"]),
        ("target,time\n1deg,1min\n", ["the first line must be"]),
        ("kind,positions\ntarget,dwell\n1deg,1min\n", ["target and time are needed"]),
    ],
)
def test_files_are_checked_as_a_whole(tmp_path, text, problems):
    path = tmp_path / "program.csv"
    path.write_text(text)
    if not problems:
        assert read_program(path).kind == "commands"
        return
    with pytest.raises(DataError) as caught:
        read_program(path)
    assert len(caught.value.problems) == len(problems)
    for told, expected in zip(caught.value.problems, problems, strict=True):
        assert expected in told
