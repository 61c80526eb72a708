"""Uncertainty of type B of measured data: stated, declared absent, or no verdict "pass"."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from commanding import Command
from test_tumble_measured import laboratory
from tumbling import NAME, SHORT, load

from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.result import NO_VERDICT

LIMITS = '[coefficients.D_I]\nunit = "deg/h/g"\nmin = -2.0\nmax = 0.0\n'  # D_I is -0.9 deg/h/g
FAR = LIMITS.replace("0.0", "-1.5")


@pytest.fixture(scope="module")
def record() -> Record:
    with Session(NAME) as session:
        return session.run({**SHORT, "rate": 0.1, "turns": 2}, seed=5)


def reduced(
    command: Command, folder: Path, record: Record, *more: str, limits: str = LIMITS, pages: bool = True
) -> tuple[int, dict[str, Any], str]:
    """Exit code of --strict, result.json, and the page of the report (pages), its figures blank."""
    text = laboratory(record).replace("latitude = -33.9deg", "latitude = 45.75deg")
    (folder / "lab.csv").write_text(text, encoding="utf-8")
    (folder / "limits.toml").write_text(limits, encoding="utf-8")
    out = folder / "out"
    spec = ("--spec", folder / "limits.toml", "--strict", "--force")
    code, _, err = command(
        "reduce", NAME, "--data", folder / "lab.csv", "--out", out, *spec, *more, pages=pages, figures=False
    )
    assert code in (0, 1), err
    page = (out / "report.html").read_text("utf-8") if pages else ""
    return code, json.loads((out / "result.json").read_text("utf-8")), page


@pytest.mark.long
def test_without_a_statement_nothing_passes(command: Command, record: Record, tmp_path: Path) -> None:
    code, found, page = reduced(command, tmp_path, record)
    assert code == 1 and found["verdict"] == "inconclusive"
    judged = next(c for c in found["coefficients"] if c["name"] == "D_I")
    assert judged["verdict"] == "inconclusive" and judged["interval"][1] < 0.0  # the figures alone would pass
    assert all(c["verdict"] == NO_VERDICT for c in found["coefficients"] if c is not judged)
    assert "instead of pass: D_I. Type B is not stated" in found["warnings"][0]
    assert "type A only: no statement of type B" in page


def test_a_fail_needs_no_statement(command: Command, record: Record, tmp_path: Path) -> None:
    assert reduced(command, tmp_path, record, limits=FAR, pages=False)[1]["verdict"] == "fail"


@pytest.mark.long
def test_stated_or_declared_absent(command: Command, record: Record, tmp_path: Path) -> None:
    code, found, page = reduced(command, tmp_path, record, "--set", "u_scale_factor=1e-4", pages=False)
    assert code == 1 and found["verdict"] == "inconclusive"  # each mount is taken once
    assert "State u_remount" in found["warnings"][0]
    both = ("--set", "u_scale_factor=1e-4", "--set", "u_remount=1e-4deg/h")
    code, found, page = reduced(command, tmp_path, record, *both)
    assert code == 0 and found["verdict"] == "pass" and not found["withheld"]
    assert "u: combined standard uncertainty" in page
    code, found, page = reduced(command, tmp_path, record, "--set", "type_b=none")
    assert code == 0 and found["verdict"] == "pass" and found["provenance"]["type_b"] == "none"
    assert "type A only: type B is declared absent" in page


@pytest.mark.parametrize(("said", "word"), [(("type_b=some",), "'none' or nothing"),
                                            (("type_b=none", "u_axis=5arcsec"), "but u_axis given")])  # fmt: skip
def test_a_statement_that_contradicts_itself(
    command: Command, record: Record, tmp_path: Path, said: tuple[str, ...], word: str
) -> None:
    (tmp_path / "lab.csv").write_text(laboratory(record), encoding="utf-8")
    values = [v for text in said for v in ("--set", text)]
    code, _, err = command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out", *values)
    assert code == 2 and word in err, err


def test_a_simulated_run_needs_none(record: Record) -> None:
    assert load().reduce(record, {"D_I": (-2.0, 0.0)}).verdict == "pass"
