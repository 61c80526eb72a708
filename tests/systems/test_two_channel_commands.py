"""Two-channel tumble: what is refused before it runs, a laboratory's record, the README."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from commanding import Command
from two_channels import NAME, SHORT, load

from gyrobench.engine.session import Session
from gyrobench.record.record import Record

RUNS: list[tuple[list[str], list[str]]] = [
    (["latitude=0deg"], ["latitude 0°", "10° to 80°", "x channel: rank 5 of 9", "y channel: rank 5 of 9"]),
    (["latitude=90deg"], ["latitude 90°", "x channel: rank 4 of 9"]),
    (["latitude=0deg", "model=simple"], ["x channel: rank 2 of 4", "Dx_z"]),
    (["latitude=-9deg"], ["latitude -9°", "condition", "least determined"]),
    (["latitude=81deg", "model=simple"], ["latitude 81°", "condition"]),
    (["model=eight"], ["model = eight", "simple and nine"]),
    (["rate=0"], ["rate = 0: the table does not turn"]),
    (["tilt=true"], ["tilt: at one table rate", "both_senses=true"]),
    (["gyro.mount[1,1]=0.999"], ["gyro.mount", "not orthonormal"]),
    (["sequencer.faces[2,1]=0.5"], ["sequencer.faces, mount 2", "not orthonormal"]),
    (["gyro.Dx_yy=0.1deg/h/g2", "gyro.terms_x=10"], ["gyro.Dx_yy = 0.1 °/h/g²", "fold=true", "Dx_0 + γ² Dx_yy"]),
    (["gyro.Dy_xx=0.1deg/h/g2", "gyro.terms_y=10"], ["gyro.Dy_xx = 0.1 °/h/g²", "Dy_yy − Dy_xx"]),
    (["gyro.terms_x=7"], ["terms_x = 7"]),
    (["windows=4"], ["windows = 4: must be >= 6"]),
    (["k_x=17deg/h"], ["k_x: '17deg/h'", "units that fit"]),
]  # fmt: skip


@pytest.mark.parametrize(("values", "words"), RUNS, ids=[" ".join(v) for v, _ in RUNS])
def test_run_is_refused(refused: Callable[..., None], values: list[str], words: list[str]) -> None:
    refused(NAME, values, words)


@pytest.fixture(scope="module")
def records() -> dict[str, Record]:
    """All noise on, both senses, a southern site."""
    values = {**SHORT, "rate": 0.1, "windows": 24, "both_senses": True, "latitude": math.radians(-33.9)}
    values |= {"table.index_rate": 0.003, "settle": 5.0}
    with Session(NAME) as session:
        return {m: session.run({**values, "model": m}, seed=9) for m in ("simple", "nine")}


def laboratory(record: Record, polarity: str = "project", drop: str = "") -> str:
    """The record as a laboratory would write it: minutes, degrees, milliamperes."""
    sign = -1.0 if polarity == "book" else 1.0
    w = record.windows
    lines = ["# latitude = -33.9deg", "# k_x = 17.227deg/h/mA", "# k_y = 17.180 deg/h/mA", f"# polarity = {polarity}"]
    lines += [f"# model = {record.run.options['model']}", "# instrument = DTG 4"]
    lines += [f"# phase {p.phase} = {p.face}" for p in record.run.plan]
    lines = [line for line in lines if not drop or drop not in line]
    lines.append("phase,t_start [min],t_end [min],angle_start [deg],angle_end [deg],mean_y [mA],mean_x [mA]")
    scale = {"t_start": 60.0, "t_end": 60.0, "angle_start": math.pi / 180, "angle_end": math.pi / 180}
    for j in range(len(w["phase"])):
        cells = [repr(float(w[n][j] / s)) for n, s in scale.items()]
        cells += [repr(float(sign * w[n][j] * 1e3)) for n in ("mean_y", "mean_x")]
        lines.append(",".join([str(int(w["phase"][j])), *cells]))
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(("model", "polarity"), [("simple", "book"), ("nine", "project")])
@pytest.mark.long
def test_laboratory_record(
    command: Command, records: dict[str, Record], tmp_path: Path, model: str, polarity: str
) -> None:
    record = records[model]
    expected = load().reduce(record)
    file = tmp_path / "lab.csv"
    file.write_text(laboratory(record, polarity), encoding="utf-8")
    code, _, err = command(
        "reduce", NAME, "--data", file, "--out", tmp_path / "out", pages=True, figures=model == "nine"
    )
    assert code == 0, err
    found: dict[str, Any] = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))
    assert [c["name"] for c in found["coefficients"]] == [c.name for c in expected.coefficients]
    for c, e in zip(found["coefficients"], expected.coefficients, strict=True):
        assert c["estimate"] == pytest.approx(e.estimate, abs=1e-8)
        assert c["u"] == pytest.approx(e.u, rel=1e-5) and c["truth"] is None
        assert c["closed"] == (e.closed if e.closed is None else pytest.approx(e.closed, abs=1e-8))
    assert found["simulated"] is False and found["instrument"] == "DTG 4"
    sign = "k i = ω_d − ω_IA" if polarity == "book" else "k i = ω_IA − ω_d"
    assert any(sign in t for t in found["conventions"])
    page = (tmp_path / "out" / "report.html").read_text("utf-8")
    assert "x channel" in page and ("Quantities of Hu 1981" in page) == (model == "simple")


@pytest.mark.parametrize(("drop", "word"), [
    ("latitude", "'latitude' is not given"), ("k_y", "'k_y' is not given"), ("phase 2", "phase 2: its attitude"),
    ("model", "'static 3'"),
])  # fmt: skip
def test_what_a_laboratory_forgets(
    command: Command, records: dict[str, Record], tmp_path: Path, drop: str, word: str
) -> None:
    text = laboratory(records["nine"], drop=drop)
    if drop == "model":
        text = text.replace("# latitude", "# model = simple\n# latitude", 1)
    file = tmp_path / "lab.csv"
    file.write_text(text, encoding="utf-8")
    code, out, err = command("reduce", NAME, "--data", file, "--out", tmp_path / "out")
    assert code == 2 and out == "" and word in err, err


@pytest.mark.long
def test_report_of_a_run(command: Command, tmp_path: Path) -> None:
    """A run by command gives the report; outside 20 to 70 degrees it warns."""
    values = {**SHORT, "rate": "0.1rad/s", "windows": 24, "settle": 5.0, "latitude": "75deg", "model": "simple"}
    words = [w for k, v in values.items() for w in ("--set", f"{k}={v}")]
    code, out, err = command("run", NAME, *words, "--out", tmp_path)
    assert code == 0, err
    assert "outside 20° to 70°" in out + err and "Dx_xz" in out
    result = json.loads((tmp_path / "result.json").read_text("utf-8"))
    assert sum("outside 20° to 70°" in w for w in result["warnings"]) == 1
    assert any("not in the simple model" in w for w in result["warnings"])
