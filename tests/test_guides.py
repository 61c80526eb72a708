"""The guides as a reader follows them: every command and every line of code, from an empty folder."""

from __future__ import annotations

import ast
import json
import math
import os
import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench.bench import standard_folder
from gyrobench.commands.cli import main

GUIDES = standard_folder() / "docs" / "guides"
BLOCK = re.compile(r"^```(\w+)(?: (\S+))?\n(.*?)^```$", re.M | re.S)


@pytest.fixture
def command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Runs a line of a guide, a gyrobench command or cd, from the folder where the one before left off."""
    monkeypatch.chdir(tmp_path)

    def run(line: str) -> None:
        program, *words = shlex.split(line)
        if program == "cd":
            os.chdir(words[0])
            return
        if program == "pythonfmu":
            subprocess.run([sys.executable, "-m", program, *words], check=True, stdout=subprocess.DEVNULL)
            return
        assert program == "gyrobench", line
        monkeypatch.setattr(sys, "argv", [program, *words])
        try:
            main()
        except SystemExit as end:
            assert not end.code, line

    return run


def follow(guide: Path, command: Callable[[str], None]) -> tuple[dict[str, Any], dict[str, str]]:
    """Do what a guide says, in its order; return the names its code leaves, and the files it writes."""
    names: dict[str, Any] = {}
    files: dict[str, str] = {}
    for language, file, text in BLOCK.findall(guide.read_text(encoding="utf-8")):
        if file:
            Path(file).parent.mkdir(parents=True, exist_ok=True)
            Path(file).write_text(text, encoding="utf-8")
            files[file] = text
        elif language == "toml":
            continue
        elif language == "sh":
            for line in text.splitlines():
                command(line)
        else:
            exec(compile(text, str(guide), "exec"), names)
    return names, files


def test_a_part_a_test_and_their_noise(command: Callable[[str], None], tmp_path: Path) -> None:
    names, files = follow(GUIDES / "write_a_system.md", command)
    assert len(files["components/warm_gyro/model.py"].splitlines()) == 15
    assert files["systems/six_position/system.py"] == (GUIDES / "own_test" / "system.py").read_text(encoding="utf-8")
    bench = tmp_path / "mybench"
    assert {f.name for f in bench.iterdir() if (f / "report.html").is_file()} == {"first", "second"}
    # what the page says of the two reductions
    page = (GUIDES / "write_a_system.md").read_text(encoding="utf-8")
    plain, model = np.abs(names["z_plain"]), np.abs(names["z_model"])
    assert f"| rms of z | {names['rms_plain']:.1f} | {names['rms_model']:.1f} |" in page
    assert f"| largest absolute z | {plain.max():.1f} | {model.max():.1f} |" in page
    assert f"of 30 (expected: 1 or 2) | {(plain > 2.0).sum()} | {(model > 2.0).sum()} |" in page
    hit = [[c.interval[0] <= c.truth <= c.interval[1] for c in run.result.coefficients] for run in names["runs"]]
    assert sorted(row.count(False) for row in hit) == [0, 0, 0, 1, 1]
    whiteness = {t.name: t.p for t in names["runs"][0].result.tests}["Ljung-Box, residuals"]
    assert whiteness < 1e-3
    assert model.shape == (5, 6) and names["rms_plain"] > 3.0 * names["rms_model"]


def test_a_vendors_fmu(command: Callable[[str], None], tmp_path: Path) -> None:
    page = (GUIDES / "vendor_fmu.md").read_text(encoding="utf-8")
    follow(GUIDES / "vendor_fmu.md", command)
    first = (tmp_path / "first.toml").read_text(encoding="utf-8")
    (shown,) = re.findall(r"^```toml\n(.*?)^```$", page, re.M | re.S)
    assert first.startswith(shown)
    assert "# pickoff: no dependencies are declared" in first
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    drift = result["coefficients"][0]
    assert drift["estimate"] == pytest.approx(0.5, abs=1e-3)  # deg/h


def test_the_notebook_runs_and_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    notebook = json.loads((GUIDES / "first_runs.ipynb").read_text(encoding="utf-8"))
    cells = [c for c in notebook["cells"] if c["cell_type"] == "code"]
    assert all(c["outputs"] == [] and c["execution_count"] is None for c in cells), "its outputs are cleared"
    names: dict[str, Any] = {}
    shown = []
    for cell in cells:
        tree = ast.parse("".join(cell["source"]))
        last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, "cell", "exec"), names)
        if isinstance(last, ast.Expr):  # what a notebook shows beneath the cell
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
            shown.append(value._repr_html_() if hasattr(value, "_repr_html_") else repr(value))
    assert len(shown) == len(cells) and all(shown)
    assert "mass unbalance" in shown[1] and "<svg" in shown[1] and "significant" in shown[5]
    assert 0.5 < float(names["np"].sqrt((names["z"] ** 2).mean().mean())) < 2.0
    assert {f.name for f in (tmp_path / "first_report").iterdir()} >= {"report.html", "report.pdf", "run.json"}


def test_your_own_drift_record(command: Callable[[str], None], tmp_path: Path) -> None:
    """The worked file, its commands, and the figures that the page prints of it."""
    page = (GUIDES / "reduce_a_drift_record.md").read_text(encoding="utf-8")
    names, _ = follow(GUIDES / "reduce_a_drift_record.md", command)
    assert (tmp_path / "first" / "report.html").is_file() and (tmp_path / "first" / "report.pdf").is_file()
    again = json.loads((tmp_path / "simulated" / "result.json").read_text(encoding="utf-8"))
    N = names["reduced"].result["N"].estimate
    assert again["coefficients"][0]["truth"] == pytest.approx(N, rel=0.02), "the noise of the record"
    result = names["reduced"].result
    rows = re.findall(r"^\| ([NBKRQ]\w*) \| ([^|]+) \| ([^|]+) to ([^|]+) \| ([^|]+) \| ([^|]*) \|$", page, re.M)
    assert [r[0] for r in rows] == result.names
    for name, estimate, low, high, unit, truth in rows:
        c = result[name]
        assert c.unit == unit and (estimate == "not determined") == bool(c.no_value)
        printed = [float(v.replace("−", "-")) for v in (low, high)]
        assert printed == pytest.approx(list(c.interval), rel=0.006)
        assert c.no_value or float(estimate) == pytest.approx(c.estimate, rel=0.006)
        if truth != "–":  # N is just outside, as the page says
            assert printed[0] <= 1.01 * float(truth) <= 1.01 * printed[1], "the interval holds the true value"
    (slope,) = result.columns[0].tables["regression"][0].rows
    assert f"explains {slope[1]:.4f}".rstrip("0") in page and abs(slope[1] - 0.05) < 2.0 * slope[2]
    assert (GUIDES / "drift_record" / "gyro.csv").stat().st_size < 300_000
    values = tomllib.loads((tmp_path / "fitted" / "floated_gyro.toml").read_text(encoding="utf-8"))["gyro"]
    assert (
        values["white"] == pytest.approx(math.radians(result["N"].estimate) / 60.0, rel=1e-9) and values["ramp"] == 0.0
    )
    simulated = json.loads((tmp_path / "simulated" / "run.json").read_text(encoding="utf-8"))["parameters"]
    assert {n: simulated[f"gyro.{n}"] for n in values} == values


def test_many_runs(command: Callable[[str], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import pandas

    from gyrobench.campaign.execution import clusters

    monkeypatch.setattr(clusters, "cores", lambda: 1)  # the tests share the cores
    names, _ = follow(GUIDES / "campaigns.md", command)
    first = pandas.read_parquet(tmp_path / "first" / "runs")
    assert len(first) == 12 and set(first["state"]) == {"done"}
    assert len(pandas.read_parquet(tmp_path / "drift" / "runs")) == 8 and len(names["spread"]) == 3
    assert names["units"]["in.latitude"] == "°"
