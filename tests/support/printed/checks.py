"""What pages promise beyond exit codes and files: values of their Python, and what single commands leave.

Functions of names run at the end of a page's script, in its process, where gyrobench is the installed one.
"""

from __future__ import annotations

import json
import math
import re
import tomllib
from collections.abc import Callable
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from printed.reader import Done, Reader

Names = dict[str, Any]


def text_of(page: str) -> str:
    return Path(page).read_text(encoding="utf-8")


# ------------------------------------------------------------------------------------- names of a script
def six_positions(names: Names, page: str) -> None:
    """The table of the guide: z of plain least squares and of the reduction, over five runs."""
    import numpy as np

    text = text_of(page)
    plain, model = np.abs(names["z_plain"]), np.abs(names["z_model"])
    assert f"| rms of z | {names['rms_plain']:.1f} | {names['rms_model']:.1f} |" in text
    assert f"| largest absolute z | {plain.max():.1f} | {model.max():.1f} |" in text
    assert f"of 30 (expected: 1 or 2) | {(plain > 2.0).sum()} | {(model > 2.0).sum()} |" in text
    hit = [[c.interval[0] <= c.truth <= c.interval[1] for c in run.result.coefficients] for run in names["runs"]]
    assert sorted(row.count(False) for row in hit) == [0, 0, 0, 1, 1]
    assert {t.name: t.p for t in names["runs"][0].result.tests}["Ljung-Box, residuals"] < 1e-3
    assert model.shape == (5, 6) and names["rms_plain"] > 3.0 * names["rms_model"]


def drift_record(names: Names, page: str) -> None:
    """The table of coefficients and intervals; the noise that was put into the simulated gyro."""
    text, result = text_of(page), names["reduced"].result
    rows = re.findall(r"^\| ([NBKRQ]\w*) \| ([^|]+) \| ([^|]+) to ([^|]+) \| ([^|]+) \| ([^|]*) \|$", text, re.M)
    assert [r[0] for r in rows] == result.names
    for name, estimate, low, high, unit, truth in rows:
        c = result[name]
        assert c.unit == unit and (estimate == "not determined") == bool(c.no_value)
        printed = [float(v.replace("−", "-")) for v in (low, high)]
        assert all(math.isclose(a, b, rel_tol=0.006) for a, b in zip(printed, c.interval, strict=True)), name
        assert c.no_value or math.isclose(float(estimate), c.estimate, rel_tol=0.006)
        if truth != "–":
            assert printed[0] <= float(truth) <= printed[1], "the interval holds the true value"
    slope, _ = result.columns[0].tables["regression"][0].rows  # of the temperature, then of its rate of change
    assert f"explains {slope[1]:.4f}".rstrip("0") in text and abs(slope[1] - 0.05) < 2.0 * slope[2]
    N = result["N"].estimate
    values = tomllib.loads(Path("fitted/floated_gyro.toml").read_text(encoding="utf-8"))["gyro"]
    assert math.isclose(values["white"], math.radians(N) / 60.0, rel_tol=1e-9) and values["ramp"] == 0.0
    simulated = json.loads(Path("simulated/run.json").read_text(encoding="utf-8"))["parameters"]
    assert {n: simulated[f"gyro.{n}"] for n in values} == values
    again = json.loads(Path("simulated/result.json").read_text(encoding="utf-8"))["coefficients"][0]
    assert math.isclose(again["truth"], N, rel_tol=0.02), "the noise of the record"
    assert (Path(page).parent / "drift_record" / "gyro.csv").stat().st_size < 300_000


def sweep(names: Names, page: str) -> None:
    assert len(names["spread"]) == 3 and names["units"]["in.latitude"] == "°"


def notebook(names: Names, page: str) -> None:
    """Every cell shows something; the normalized errors at the end are those of valid uncertainties."""
    shown, inner = names["SHOWN"], names["NAMES"]
    assert len(shown) == len(names["CELLS"]) and all(shown)
    assert "mass unbalance" in shown[1] and "<svg" in shown[1] and "significant" in shown[6]
    assert inner["run"].result.warnings == [], "the first result is without an alarm"
    assert 0.5 < float(inner["np"].sqrt((inner["z"] ** 2).mean().mean())) < 2.0
    assert {f.name for f in Path("first_report").iterdir()} >= {"report.html", "report.pdf", "run.json"}


def from_python(names: Names, page: str) -> None:
    """The script of the guide: what it writes, and the value that it has set."""
    assert {f.name for f in Path("folder").iterdir()} >= {"result.json", "report.html", "report.pdf"}
    assert math.isclose(names["run"].result["D_I"].truth, 0.9)


def bearing(names: Names, page: str) -> None:
    """Half of the clearance carries more than the whole, and the gap for a stiffness has it."""
    one = names["bearing"]
    assert one.load(0.5) > 0.0 and math.isclose(one.with_stiffness(1e9).stiffness(), 1e9, rel_tol=1e-3)


#: what a script has -> function that gets its names
NAMES = {
    "rms_plain, rms_model": six_positions,
    'reduced.result["N"]': drift_record,
    "spread = frame": sweep,
    "CELLS = ": notebook,
    'run.report("folder")': from_python,
    "AerostaticBearing(": bearing,
}


# ------------------------------------------------------------------------------------ after a command
def coefficients(folder: Path) -> dict[str, Any]:
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return {c["name"]: c for c in result["coefficients"]}


def part_of_blocks(reader: Reader, done: Done) -> None:
    """The part and the test have the lengths that the page names; the test is the file beside the page."""
    files = {s.name: s.text for s in reader.steps if s.kind == "file"}
    text = text_of(str(reader.path))
    model, system = files["components/warm_gyro/model.py"], files["systems/six_position/system.py"]
    assert f"made of blocks in {len(model.splitlines())} lines" in text
    assert f"from a family in {len(system.splitlines())}" in text
    assert system == (reader.path.parent / "own_test" / "system.py").read_text(encoding="utf-8")


def first_mapping(reader: Reader, done: Done) -> None:
    first = (reader.here / "first.toml").read_text(encoding="utf-8")
    (shown,) = (s.text for s in reader.steps if s.kind == "shown" and s.text.startswith("# Mapping of"))
    assert first.startswith(shown) and "# pickoff: no dependencies are declared" in first


def vendors_drift(reader: Reader, done: Done) -> None:
    drift = next(iter(coefficients(reader.here / "run").values()))
    assert math.isclose(drift["estimate"], 0.5, abs_tol=1e-3)  # deg/h


def first_sweep(reader: Reader, done: Done) -> None:
    import pyarrow.parquet as pq

    table = pq.read_table(reader.here / "first" / "runs")
    assert table.num_rows == 12 and set(table["state"].to_pylist()) == {"done"}


def drawn_campaign(reader: Reader, done: Done) -> None:
    import pyarrow.parquet as pq

    assert pq.read_table(reader.here / "drift" / "runs").num_rows == 8


def shown_output(reader: Reader, done: Done) -> None:
    """The output that the page prints below the command is in its output, whatever the breaks of its lines."""
    printed = " ".join(done.out.split())
    below = reader.steps[reader.steps.index(done.step) + 1 :]
    after = takewhile(lambda s: s.kind == "shown" or s.text.endswith("...'"), below)
    shown = " ".join(word for s in after for word in s.text.split())
    for part in re.split(r" ?\.\.\.'? ?", shown):
        assert part in printed, f"{part}\n{done.out}"


def site(reader: Reader, done: Done) -> None:
    folder = "public" if "--publish public" in done.step.text else "CAMPAIGN/site"
    assert (reader.here / folder / "index.html").is_file()


def archive(reader: Reader, done: Done) -> None:
    """The archive, FMPy with the system as one FMU, and the bench itself give one result."""
    from_fmpy, from_archive = reader.runs[-3:-1]
    assert coefficients(reader.runs[-1]) == coefficients(from_archive) == coefficients(from_fmpy)


def corrected(reader: Reader, done: Done) -> None:
    """Alone the true D_I is five u off, stated and corrected it is in the interval, corrected the narrower one."""
    values = [json.loads((reader.here / n / "result.json").read_text()) for n in ("alone", "stated", "corrected")]
    alone, stated, last = (next(c for c in v["coefficients"] if c["name"] == "D_I") for v in values)
    assert alone["interval"][1] < -0.9 - 3.0 * alone["u"]
    for c in (stated, last):
        assert c["interval"][0] < -0.9 < c["interval"][1]
    assert last["u"] < 0.3 * stated["u"]


def usable(reader: Reader, done: Done) -> None:
    """Nothing speaks against the first runs of a reader: no error, estimates near their truth; judged, they pass."""
    folder = reader.here / done.step.text.split("#")[0].rpartition("--out ")[2].split()[0]
    found = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert not [r["text"] for r in found["reasons"] if r["severity"] == "error"]
    assert all(abs(c["z"]) < 4.0 for c in found["coefficients"])
    assert found["verdict"] == "pass" or folder.name != "judged"


#: pattern of a command -> check of what it leaves and says
AFTER: dict[str, Callable[[Reader, Done], None]] = {
    r"build warm_gyro$": part_of_blocks,
    r"fit vendor/VendorGyro.fmu": first_mapping,
    r"--part gyro=vendor/VendorGyro.fmu": vendors_drift,
    r"sweep fixed_position .*--out first$": first_sweep,
    r"campaign campaigns/drift.toml --out drift$": drawn_campaign,
    r"design accelerometer_multipoint .*--count 100$": shown_output,
    r"site CAMPAIGN": site,
    r"run tumble\.ssp": archive,
    r"compare alone stated corrected": corrected,
    r"run tumble_single_axis .*--out (first|judged)$": usable,
}
