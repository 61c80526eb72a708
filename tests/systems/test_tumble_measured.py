"""Measured data: a record in a laboratory's units gives the coefficients of the record; the template is one."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from tumbling import NAME, SHORT, load

from gyrobench.engine.session import Session
from gyrobench.record.record import Record

#: Column, unit in the file, SI size of that unit.
SCALES = {
    "laboratory": {"t": ("min", 60.0), "angle": ("deg", math.pi / 180.0), "mean": ("mA", 1e-3)},
    "fine": {"t": ("ms", 1e-3), "angle": ("arcsec", math.pi / 648000.0), "mean": ("uA", 1e-6)},
    "SI": {"t": ("s", 1.0), "angle": ("rad", 1.0), "mean": ("A", 1.0)},
}


@pytest.fixture(scope="module")
def record() -> Record:
    """All noise on, 36 windows a turn, two turns in both senses, a southern site."""
    values = {**SHORT, "rate": 0.1, "turns": 2, "both_senses": True, "latitude": math.radians(-33.9)}
    with Session(NAME) as session:
        return session.run(values, seed=9)


def laboratory(record: Record, scale: str = "laboratory", polarity: str | None = None, delimiter: str = ",") -> str:
    """The record as a laboratory would write it, by its own means: no function of gyrobench writes it."""
    units = SCALES[scale]
    out = io.StringIO()
    out.write("# latitude = -33.9deg\n# k = 17.2 deg/h/mA\n# instrument = RIG 17\n# operator = A. Tester\n")
    out.write("# arrangement = checked\n")
    if polarity:
        out.write(f"# polarity = {polarity}\n")
    for p in record.run.plan:
        out.write(f"# phase {p.phase} = {p.face}\n")
    writer = csv.writer(out, delimiter=delimiter, lineterminator="\n")
    names = ("t_start", "t_end", "angle_start", "angle_end", "mean", "std")
    kinds = ("t", "t", "angle", "angle", "mean", "mean")
    header = [f"{n} [{units[k][0]}]" for n, k in zip(names, kinds, strict=True)]
    writer.writerow(["remark", *header, "phase", "n"])  # a column of the laboratory's own, another order
    sign = -1.0 if polarity == "book" else 1.0
    w = record.windows
    for j in range(len(w["mean"])):
        cells = [w[n][j] / units[k][1] * (sign if n == "mean" else 1.0) for n, k in zip(names, kinds, strict=True)]
        writer.writerow(["", *(repr(float(c)) for c in cells), int(w["phase"][j]), int(w["n"][j])])
    return out.getvalue()


def reduced(command: Command, folder: Path, text: str, *more: str) -> dict[str, Any]:
    folder.mkdir(exist_ok=True)
    file = folder / "lab.csv"
    file.write_text(text, encoding="utf-8")
    code, _, err = command("reduce", NAME, "--data", file, "--out", folder / "out", *more)
    assert code == 0, err
    found: dict[str, Any] = json.loads((folder / "out" / "result.json").read_text("utf-8"))
    return found


@pytest.mark.parametrize(
    ("scale", "polarity", "delimiter"),
    [("laboratory", None, ","), ("laboratory", "book", ";"), ("fine", "project", "\t"), ("SI", "book", ",")],
)
@pytest.mark.long
def test_laboratory_units(
    command: Command, record: Record, tmp_path: Path, scale: str, polarity: str | None, delimiter: str
) -> None:
    """Same coefficients, uncertainties and closed formulas; only the last bits of the unit conversion differ."""
    expected = load().with_values({"latitude": math.radians(-33.9)}).reduce(record)
    found = reduced(command, tmp_path, laboratory(record, scale, polarity, delimiter))
    assert [c["name"] for c in found["coefficients"]] == [c.name for c in expected.coefficients]
    for c, e in zip(found["coefficients"], expected.coefficients, strict=True):
        assert c["estimate"] == pytest.approx(e.estimate, abs=1e-9)  # deg/h: 1e-7 of u
        assert c["u"] == pytest.approx(e.u, rel=1e-6)
        assert c["interval"] == pytest.approx(list(e.interval), abs=1e-8)
        assert c["closed"] == pytest.approx(e.closed, abs=1e-9)
        assert c["truth"] is None  # nobody knows it in a laboratory
    assert found["simulated"] is False
    assert found["instrument"] == "RIG 17"
    sign = "k i = ω_d − ω_IA" if polarity == "book" else "k i = ω_IA − ω_d"
    assert any(sign in t for t in found["conventions"])
    assert found["provenance"]["data"]["file"] == "lab.csv"


@pytest.mark.long
def test_options_of_the_command_win(command: Command, record: Record, tmp_path: Path) -> None:
    """k = 34.4 deg/h/mA instead of 17.2: the input rate is 0 in every attitude, so all coefficients double."""
    text = laboratory(record)
    once, twice = (reduced(command, tmp_path / n, text, *more) for n, more in (
        ("once", ()), ("twice", ("--set", "k=34.4deg/h/mA")),
    ))  # fmt: skip
    for a, b in zip(once["coefficients"], twice["coefficients"], strict=True):
        assert b["estimate"] == pytest.approx(2.0 * a["estimate"], rel=1e-9, abs=1e-9)
        assert b["u"] == pytest.approx(2.0 * a["u"], rel=1e-6)


def test_template_is_read_back(command: Command, tmp_path: Path) -> None:
    """The template, filled below its header with the ideal windows of a known gyro, is a record."""
    code, template, err = command("reduce", NAME, "--template")
    assert code == 0, err
    header = template.splitlines()[-1]
    assert header.startswith("phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA]")
    # a gyro with D_F = -0.3 deg/h and D_I = -0.9 deg/h/g only: in mount 1 and 2, X = -gamma cos(phi) sin(theta), in
    # the dwells X = 0; k i = -omega_d and table angle = -theta.  Mean of sin over [a, b]: (cos a - cos b)/(b - a).
    gamma, c, rows, t, step = 9.8067 / 9.80665, math.cos(math.radians(45.75)), [], 0.0, 10.0
    for phase, windows in ((1, 5), (2, 36), (3, 5), (4, 36)):
        for n in range(windows):
            theta = (n * step, (n + 1) * step) if phase in (2, 4) else (0.0, 0.0)
            a, b = np.radians(theta)
            mean_x = -gamma * c * (math.cos(a) - math.cos(b)) / (b - a) if b > a else 0.0
            current = -(-0.3 - 0.9 * mean_x) / 17.2
            row = [phase, t, t + 240.0, -theta[0], -theta[1], current, 0.0, 240, 0]
            rows.append(",".join(repr(x) for x in map(float, row)))
            t += 240.0
        t += 60.0
    found = reduced(command, tmp_path, template + "\n".join(rows) + "\n")
    expected = {"D_F": -0.3, "D_I": -0.9}
    for coefficient in found["coefficients"]:
        assert coefficient["estimate"] == pytest.approx(expected.get(coefficient["name"], 0.0), abs=1e-9)
        assert coefficient["closed"] == pytest.approx(expected.get(coefficient["name"], 0.0), abs=1e-9)
    assert found["instrument"] == "type and number of the gyro"


@pytest.mark.long
def test_report_of_measured_data_can_be_made_again(command: Command, record: Record, tmp_path: Path) -> None:
    """The folder is a record like that of a run: ``gyrobench report`` gives the same numbers, in book polarity too."""
    first = reduced(command, tmp_path, laboratory(record, polarity="book"))
    code, _, err = command("report", tmp_path / "out")
    assert code == 0, err
    again = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    assert again["coefficients"] == first["coefficients"]
