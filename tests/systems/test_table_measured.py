"""A laboratory's records of the tests of a table: written from the equations, reduced, the values come back; errors."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest

import gyrobench as gb
from gyrobench.bench import standard_folder
from gyrobench.record.record import Record
from gyrobench.system.system import load_system

ARCSEC = math.pi / 648000
ERU = 7.2921159e-5
Q = 0.18 * ARCSEC


def template(name: str) -> str:
    measured = load_system(name).measured_data
    assert measured is not None
    return measured.template


def counted(x: np.ndarray) -> np.ndarray:
    return Q * np.round(x / Q)


def write(path: Path, head: str, rows: list[list[float]], swap: tuple[str, str] = ("", "")) -> Path:
    text = head + "\n".join(",".join(f"{x:.12g}" for x in row) for row in rows) + "\n"
    path.write_text(text.replace(*swap) if swap[0] else text, encoding="utf-8")
    return path


def follows_the_schema(name: str, file: Path) -> None:
    """The record of a file is saved with a run.json of the published form, and read back."""
    record = load_system(name).read_measured(file, {"operator": "A. Tester"})
    folder = record.save(file.parent / "saved")
    schema = json.loads((standard_folder() / "reports" / "run.schema.json").read_text(encoding="utf-8"))
    document = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(schema).validate(document)
    assert document["measured"] and document["operator"] == "A. Tester" and Record.load(folder).run == record.run


# ------------------------------------------------------------------------------------------- rates
def rate_rows(clock: float = 8e-6) -> list[list[float]]:
    """Counts of a table that turns faster by `clock`, errors of the scale 0.3 and 0.15 arcsec once and twice a turn."""
    rng, rows, t0 = np.random.default_rng(2), [], 0.0
    for phase, rate in enumerate((20.0, -20.0, 500.0, -500.0), 1):
        t = t0 + 2.0 + 6.0 * np.arange(11)
        angle = rate * ERU * (1.0 + clock) * (t - t0) + 0.1 * ARCSEC * rng.standard_normal(t.size)
        read = counted(angle + ARCSEC * (0.3 * np.sin(angle + 1.0) + 0.15 * np.sin(2.0 * angle)))
        rows += [
            [phase, t[k], t[k + 1], rate, *np.degrees(read[k : k + 2]), 0.02, 0.1 + 0.01 * rng.standard_normal()]
            for k in range(10)
        ]
        t0 = t[-1]
    return rows


def test_rates_of_a_laboratory(tmp_path: Path) -> None:
    file = write(tmp_path / "rates.csv", template("table_rate_test"), rate_rows())
    follows_the_schema("table_rate_test", file)
    result = gb.reduce("table_rate_test", file).result
    assert not result.simulated
    clock = result["time base"]
    assert abs(clock.estimate - 8.0) < 4.0 * clock.u
    # a reading errs by motion and rounding, sqrt(0.1^2 + 0.18^2/12) arcsec, and by what a line leaves of the errors of
    # the scale over 125 deg, which this table does not follow: of 500 ERU over 54 s, 406 100 arcsec, both senses
    variance = 0.0
    for rate in (500.0, -500.0):
        a = rate * ERU * (2.0 + 6.0 * np.arange(1.0, 11.0))
        e = 0.3 * np.sin(a + 1.0) + 0.15 * np.sin(2.0 * a)
        variance += (0.1**2 + 0.18**2 / 12.0 + float(np.sum((e - np.polyval(np.polyfit(a, e, 1), a)) ** 2)) / 8.0) / 2.0
    assert clock.u == pytest.approx(math.sqrt(variance) / 0.4061, rel=0.25)  # of 16 degrees of freedom
    asked = [r for r in result.reasons if r.id == "arrangement.unstated"]  # a log's clock is in no residual
    assert [r.blocks for r in asked] == [("pass",)] and "the angles wrong by 2 % (time base by" in asked[0].text
    checked = gb.reduce("table_rate_test", file, arrangement="checked").result
    assert not [r for r in checked.reasons if r.id == "arrangement.unstated"]
    said = result.summary[0]
    assert "from 4 runs" in said and said.endswith(" ppm (95 %).") and "1e" not in said
    for rate in (20, 500):  # both senses; the fast one over an angle of 125 deg
        c = result[f"error {rate} ERU"]
        assert abs(c.estimate - 8.0) < 4.0 * c.u and c.u < {20: 30.0, 500: 1.2}[rate]
        assert result[f"ripple {rate} ERU"].estimate == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize(
    ("swap", "text"),
    [
        (("# quantum = 0.18arcsec", "#"), "'quantum' is not given"),
        (
            ("rate [ERU]", "rate [deg/s]"),
            "the angles turn at 19.9992 ERU and not at 4786.89 ERU; check units and sense",
        ),
        (("rate [ERU]", "rate [ERU/s]"), "unit"),
        (("\n2,64,", "\n1,64,"), "phase 1: one rate that is not 0 is expected"),
    ],
)
def test_errors_of_rates(tmp_path: Path, swap: tuple[str, str], text: str) -> None:
    file = write(tmp_path / "rates.csv", template("table_rate_test"), rate_rows(), swap)
    with pytest.raises(gb.GyrobenchError, match=text):
        gb.reduce("table_rate_test", file)


# ------------------------------------------------------------------------------------------- positions
def position_rows(every: float = 5.0, drift: float = 0.0, lost: float = 0.1, level: float = 0.0) -> list[list[float]]:
    """y + e = E - p_k + z + h/2, y2 + e = E(x) - E(x + 180 deg), level P e^-jb + T e^-j(x+b) + W e^j(x-b); arcsec.

    every: s from reading to reading.  drift, level: of autocollimator and level, arcsec/s.  lost: h; all places are
    reached from below but those on the way back, the first of each mount, too.
    """
    rng, rows, t = np.random.default_rng(4), [], 0.0
    polygon = rng.standard_normal(12)
    polygon -= polygon.mean()

    def E(x: float) -> float:
        return 0.7 * math.cos(x) - 0.4 * math.sin(2 * x) + 0.2 * math.cos(3 * x)

    for b, zero in ((0, 3.0), (30, -2.0), (180, 1.0)):
        for k in [*range(12), *range(12, -1, -1)]:
            x, sense = math.radians(30 * k), 1.0 if len(rows) % 25 < 13 else -1.0
            jb = math.radians(b)
            plate = (2.0 - 1.0j) + 3.0 * np.exp(-1j * x) + 0.5j * np.exp(1j * x)
            tilt = plate * np.exp(-1j * jb) + 4.0 + (1.0 - 2.0j) * level * t
            track, noise = 0.02 * rng.standard_normal(), 0.03 * rng.standard_normal(4)
            y = E(x) - polygon[(k + b // 30) % 12] + zero + lost / 2.0 * sense - track + noise[0] + drift * t
            second = E(x) - E(x + math.pi) + 7.0 - track + noise[1]
            rows.append([t, t + 2.0, b, 30 * k, y, track, 30 * k + second / 3600.0, tilt.real + noise[2],
                         tilt.imag + noise[3]])  # fmt: skip
            t += every
    return rows


POSITIONS = {"E1 cos": 0.7, "E1 sin": 0.0, "E2 cos": 0.0, "E2 sin": -0.4, "E3 cos": 0.2, "lost motion": 0.1,
             "repeatability": 0.03, "squareness x": 2.0, "squareness y": -1.0, "tilt 2": -3.0, "tilt 1": 0.0,
             "wobble cos": 0.5}  # fmt: skip


def test_positions_of_a_laboratory(tmp_path: Path) -> None:
    file = write(tmp_path / "positions.csv", template("table_position_test"), position_rows())
    follows_the_schema("table_position_test", file)
    result = gb.reduce("table_position_test", file).result
    for name, value in POSITIONS.items():
        c = result[name]
        assert abs(c.estimate - value) < 4.0 * c.u and c.u < 0.05, name


def test_drift_of_the_autocollimator_is_not_lost_motion(tmp_path: Path) -> None:
    """1 arcsec in 1000 s: a place is seen 12.5 x 32.8 s = 410 s later on the way back, on average, 0.41 arcsec of lost
    motion that is none.  The level drifts, too: by 1 arcsec from the first mount to the last.
    """
    rows = position_rows(every=32.8, drift=1e-3, level=1e-3)
    result = gb.reduce("table_position_test", write(tmp_path / "p.csv", template("table_position_test"), rows)).result
    for name, value in POSITIONS.items():
        c = result[name]
        assert abs(c.estimate - value) < 4.0 * c.u and c.u < 0.05, name


def test_the_way_to_a_first_position_is_not_in_the_record(tmp_path: Path) -> None:
    """2 arcsec of lost motion: the first reading of a mount, taken to be of the way back, would scatter by as much."""
    file = write(tmp_path / "p.csv", template("table_position_test"), position_rows(lost=2.0))
    result = gb.reduce("table_position_test", file).result
    for name, value in {**POSITIONS, "lost motion": 2.0}.items():
        c = result[name]
        assert abs(c.estimate - value) < 4.0 * c.u and c.u < 0.05, name


def test_positions_that_do_not_tell_drift_from_lost_motion_say_so(tmp_path: Path) -> None:
    """One mount, and one place alone from both sides: drift and the twelve faces explain any lost motion.  Without
    drift, 14 readings determine 14 values of the autocollimator, which leaves nothing to state a u from.
    """
    rows = [row for k, row in enumerate(position_rows()[:25]) if k in range(13) or k == 24]
    result = gb.reduce("table_position_test", write(tmp_path / "p.csv", template("table_position_test"), rows)).result
    assert [r.id for r in result.reasons if r.id == "lost_motion.drift"] == ["lost_motion.drift"]
    assert "often enough" in result["lost motion"].no_value and not result["E1 cos"].no_value


DEVIATION, MOUNT, SECOND = 4, 2, 6  # columns of position_rows


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (lambda row: None, ""),
        (
            lambda row: row.__setitem__(DEVIATION, -row[DEVIATION]),
            "contradict.*autocollimator's sign reversed",
        ),
        (lambda row: row.__setitem__(DEVIATION, 2.0 * row[DEVIATION]), "contradict each other.*twice the angle"),
        (lambda row: row.__setitem__(MOUNT, -row[MOUNT] % 360), "all mounts.*turned the other way"),
        (lambda row: row.__setitem__(MOUNT, {180: 210}.get(row[MOUNT], row[MOUNT])), "mount 210° at 180°"),
    ],
    ids=["none", "sign", "twice", "other way", "face"],
)
def test_readings_of_a_table_that_contradict_one_another(
    tmp_path: Path, change: Callable[[list[float]], None], text: str
) -> None:
    """Autocollimator reversed: E3 was -0.2 for 0.2 arcsec or the mean of both, up to 100 u off, without a word."""
    rows = position_rows()
    for row in rows:
        change(row)
    file = write(tmp_path / "p.csv", template("table_position_test"), rows)
    reasons = [r for r in gb.reduce("table_position_test", file).result.reasons if r.id.startswith("position.")]
    assert all(r.blocks == ("pass", "fail") for r in reasons)
    assert not reasons if not text else re.search(text, " ".join(r.text for r in reasons))


def test_the_scale_of_the_autocollimator_is_stated_or_asked_for(tmp_path: Path) -> None:
    """Order 2 is told by the polygon alone: of -0.4 arcsec, 5 % are 0.02, beside u of the noise."""

    def reduced(said: str) -> Any:
        head = template("table_position_test").replace("# u_scale = 0\n", said)
        return gb.reduce("table_position_test", write(tmp_path / "p.csv", head, position_rows())).result

    plain, stated, checked = (reduced(x) for x in ("", "# u_scale = 0.05\n", "# arrangement = checked\n"))
    assert stated["E2 sin"].u == pytest.approx(math.hypot(plain["E2 sin"].u, 0.05 * 0.4), rel=0.03)
    assert stated["E2 sin"].estimate == plain["E2 sin"].estimate
    (line,) = [b for b in stated.budget if b.coefficient == "E2 sin" and b.id == "autocollimator.scale"]
    assert line.contribution == pytest.approx(0.02, rel=0.05) and line.sensitivity == pytest.approx(-0.4, rel=0.05)
    said = [[r.text for r in x.reasons if r.id == "arrangement.unstated"] for x in (plain, stated, checked)]
    assert "scale of the autocollimator wrong by 2 %" in said[0][0] and said[1:] == [[], []]


def test_single_counts_leave_their_rounding_at_a_place(tmp_path: Path) -> None:
    """A second head that is read in single counts of a table at rest: 0.18 arcsec / sqrt(12) = 0.052 arcsec a place, of
    twelve places and waves of 2 E: sqrt(2/12) 0.052 / 2 = 0.011 arcsec.  u was 0.002 to 0.005, and E3 up to 8 u off.
    """
    rows = position_rows()
    for row in rows:  # without the 0.03 arcsec of noise: E(x) - E(x + 180 deg) + 7 - e
        x = math.radians(row[3])
        exact = 2.0 * (0.7 * math.cos(x) + 0.2 * math.cos(3 * x)) + 7.0 - row[5]
        row[SECOND] = row[3] + 0.18 * round(exact / 0.18) / 3600.0
        row[DEVIATION] += 0.3 * math.sin(1e3 * row[0])  # an autocollimator that tells little
    result = gb.reduce("table_position_test", write(tmp_path / "p.csv", template("table_position_test"), rows)).result
    for name, value in {"E1 cos": 0.7, "E1 sin": 0.0, "E3 cos": 0.2, "E3 sin": 0.0}.items():
        assert abs(result[name].estimate - value) < 3.0 * result[name].u and 0.008 < result[name].u < 0.014


@pytest.mark.parametrize(
    ("swap", "text"),
    [
        (("# positions = 12\n", ""), "'positions' is not given"),
        (("# positions = 12\n", "# positions = 8\n"), "position: 30 deg in row 2 of .* is not a whole face of 45 deg"),
        (("deviation [arcsec]", "deviation [deg]"), "deviation: .* readings are more than 0.57 deg"),
        (("# orders = 3", "# orders = 6"), "orders = 6: at most 5 follow"),
        ((",second [deg]", ",third [deg]"), "column 'second"),
    ],
)
def test_errors_of_positions(tmp_path: Path, swap: tuple[str, str], text: str) -> None:
    file = write(tmp_path / "positions.csv", template("table_position_test"), position_rows(), swap)
    with pytest.raises(gb.GyrobenchError, match=text):
        gb.reduce("table_position_test", file)


# ------------------------------------------------------------------------------------------- angles
HEAD = math.radians(50.1)
SCALE = {1: (0.3, -0.2), 2: (0.1, 0.15)}  # cos, sin, arcsec


def scale(x: np.ndarray) -> np.ndarray:
    return ARCSEC * sum(a * np.cos(k * x) + b * np.sin(k * x) for k, (a, b) in SCALE.items())


def angle_rows(reversal: bool = False, zero: float = 0.0) -> list[list[float]]:
    """Positions all around read by one or two heads, the reference with 0.25 cos; rates with a lag of 40 us.

    zero: what the scale reads at the zero of the table, rad.
    """
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    rows: list[list[float]] = []
    for turned in (False, True) if reversal else (False,):
        x = 2 * math.pi * (np.arange(60) + (np.arange(60) * golden + 0.3 * turned) % 1.0) / 60
        reference = counted(x + 0.25 * ARCSEC * np.cos(x) + 0.4)
        one, two = counted(x + scale(x) + zero), counted(x + scale(x + HEAD) + 0.1 + zero)
        for k in range(60):
            read = [two[k] if turned else one[k]] if reversal else [one[k], two[k]]
            cells = [len(rows) + 1, 10.0 * len(rows), 10.0 * len(rows) + 0.1, 0.0, math.degrees(x[k]), float(turned)]
            rows.append([*cells, *np.degrees([*read, reference[k]])])
    for n, rate in enumerate((500.0, -500.0)):
        t = rows[-1][2] + 3.0 + np.arange(40)
        x = rate * ERU * (t - t[0])
        late = x - 40e-6 * rate * ERU
        reads = [counted(late + scale(late) + zero)]
        reads += [] if reversal else [counted(late + scale(late + HEAD) + 0.1 + zero)]
        reads.append(counted(x + 0.25 * ARCSEC * np.cos(x) + 0.4))
        phase = 121 if reversal else 61
        rows += [[phase + n, t[k] - 0.1, t[k], rate, 0.0, 0.0, *np.degrees([r[k] for r in reads])] for k in range(40)]
    return rows


@pytest.mark.parametrize("zero", [0.0, 0.9], ids=["", "zero"])
@pytest.mark.parametrize("reversal", [False, True], ids=["two heads", "reversal"])
def test_angles_of_a_laboratory(tmp_path: Path, reversal: bool, zero: float) -> None:
    """A scale that reads 0.9 rad at the zero of the table has the errors of the same places."""
    head = template("angle_system_test")
    if reversal:
        head = head.replace("method = two_heads", "method = reversal").replace(",reading_2 [deg]", "")
    file = write(tmp_path / "angles.csv", head, angle_rows(reversal, zero))
    follows_the_schema("angle_system_test", file)
    result = gb.reduce("angle_system_test", file).result
    for k, parts in SCALE.items():
        for name, value in zip((f"cos_{k}", f"sin_{k}"), parts, strict=True):
            c = result[name]
            assert abs(c.estimate - value) < 4.0 * c.u and c.u < 0.05, name
    assert abs(result["ref_cos_1"].estimate - 0.25) < 4.0 * result["ref_cos_1"].u
    assert abs(result["delay"].estimate - 40.0) < 4.0 * result["delay"].u < 20.0


@pytest.mark.parametrize(
    ("swap", "text"),
    [
        (("# head = 50.1deg", "#"), "'head' is not given"),
        ((",reading_2 [deg]", ",other [deg]"), "reading_2"),
        (("\n2,10,", "\n1,10,"), "phase 1: its rows have several rates or positions"),
        (("method = two_heads", "method = reversal"), "positions with turned = 0 and with turned = 1"),
        (("method = two_heads", "method = three"), "method = three: two_heads or reversal"),
        (("reading_2 [deg],", "reading_2 [rad],"), "reading_2: does not follow the position"),
        (
            ("rate [ERU]", "rate [deg/h]"),
            "phase 61: .* reference turns at 500 ERU, rate says 33.24 ERU",
        ),
    ],
)
def test_errors_of_angles(tmp_path: Path, swap: tuple[str, str], text: str) -> None:
    file = write(tmp_path / "angles.csv", template("angle_system_test"), angle_rows(), swap)
    with pytest.raises(gb.GyrobenchError, match=text):
        gb.reduce("angle_system_test", file)


def test_a_reading_that_lies_outside_is_named(tmp_path: Path) -> None:
    """5 arcsec in one reading of the scale: harmonics were off by up to 3.6 u without a word."""
    rows = angle_rows()

    def said() -> list[str]:
        file = write(tmp_path / "angles.csv", template("angle_system_test"), rows)
        return [r.text for r in gb.reduce("angle_system_test", file).result.reasons if r.id == "outliers"]

    assert not said()
    rows[17][6] += 5.0 / 3600.0
    (text,) = said()
    assert f"at {rows[17][4]:.2f}° (+4.9" in text and "more" not in text


@pytest.mark.parametrize(("columns", "text"), [((7,), "second reading of the scale"), ((6, 7), "scale drifts against")])
def test_readings_that_drift_are_named(tmp_path: Path, columns: tuple[int, ...], text: str) -> None:
    """0.5 arcsec by the 600 s of the positions, which follow one another around the turn: cos_1 was off by 8 u."""
    rows = angle_rows()
    for row in rows[:60]:
        for k in columns:
            row[k] += 0.5 * (1.0 - math.exp(-row[1] / 300.0)) / 3600.0
    result = gb.reduce("angle_system_test", write(tmp_path / "a.csv", template("angle_system_test"), rows)).result
    (reason,) = [r for r in result.reasons if r.id == "readings.drift"][:1]
    assert text in reason.text and reason.blocks == ("pass", "fail")
    assert float(reason.text.split("by +")[1].split("″")[0]) == pytest.approx(0.43, abs=0.15)  # 0.5 (1 - e^-2)


def test_what_two_readings_of_a_scale_do_not_show_is_asked_for(tmp_path: Path) -> None:
    """Each is fitted as well as the truth; a reversal has no second head that could be exchanged or drift."""
    said = []
    for reversal in (False, True):
        head = template("angle_system_test")
        if reversal:
            head = head.replace("method = two_heads", "method = reversal").replace(",reading_2 [deg]", "")
        result = gb.reduce("angle_system_test", write(tmp_path / "a.csv", head, angle_rows(reversal))).result
        (text,) = [r.text for r in result.reasons if r.id == "arrangement.unstated"]
        said.append(text)
        assert not [r for r in result.reasons if r.id == "readings.drift"]
        for words in ("scale and reference exchanged", "sign of the head angle reversed"):
            assert words in text
    for words in ("the two heads exchanged", "further apart by a count"):
        assert words in said[0] and words not in said[1]


def test_a_rate_of_the_other_sense_is_refused(tmp_path: Path) -> None:
    """It was a lag of the other sign, 100 u from the true one."""
    rows = [[*row[:3], -row[3], *row[4:]] for row in angle_rows()]
    file = write(tmp_path / "angles.csv", template("angle_system_test"), rows)
    with pytest.raises(gb.GyrobenchError, match=r"phase 62: .* turns at -500 ERU, rate says 500 ERU"):
        gb.reduce("angle_system_test", file)


@pytest.mark.parametrize("name", ["table_rate_test", "table_position_test", "angle_system_test"])
def test_an_empty_template(tmp_path: Path, name: str) -> None:
    file = tmp_path / "empty.csv"
    file.write_text(template(name), encoding="utf-8")
    with pytest.raises(gb.GyrobenchError, match="no rows"):
        gb.reduce(name, file)
