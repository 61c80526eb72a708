"""Another gyro in the slot: a vendor's FMU with its own names and units, one that does not fit, one that fails."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from tumbling import DPH, NAME, NAMES, SHORT, gyro, lag, load, quiet

from gyrobench.record.record import Record

Foreign = Callable[[str], Path]
MAPPING = Path(__file__).parents[1] / "foreign" / "vendor_gyro.toml"


def words(values: dict[str, Any]) -> list[str]:
    return [w for k, v in values.items() for w in ("--set", f"{k}={v!r}")]


@pytest.mark.long
def test_vendor_gyro_gives_its_coefficients(command: Command, foreign: Foreign, tmp_path: Path) -> None:
    """Rates in deg/h, load in g with the opposite sign, current in mA, pickoff in mV, k = 20 deg/h/mA: mapped by a
    file, it gives what it was built with, and so does ours with the same truth.

    The vendor's float (T = 0.8 ms, exact for held inputs) and ours (1 ms) differ in the terms above s2 only; both
    have H/C = 1, but the loop gain goes with k: the lag of tumbling.lag is 1e-3 (17.2/20) n2 rate2 in the vendor's.
    """
    truth = gyro(np.random.default_rng(50))
    values = {**SHORT, **truth, "latitude": -0.6}
    vendor = [
        "--part", f"gyro={foreign('vendor_gyro')}", "--map", f"gyro={MAPPING}", "--set", "rebalance.meter=0",
    ]  # fmt: skip
    found = {}
    for kind, extra in (("vendor", vendor), ("ours", words(quiet(load())))):
        code, out, err = command("run", NAME, *words(values), *extra, "--out", tmp_path / kind)
        assert code == 0, err
        assert "D_OS" in out
        result = json.loads((tmp_path / kind / "result.json").read_text("utf-8"))
        found[kind] = {c["name"]: c for c in result["coefficients"]}
        if kind == "vendor":
            assert result["provenance"]["parts"]["gyro"]["name"] == "Vendor RIG-7"
            assert result["provenance"]["parts"]["gyro"]["target"] == "foreign"
    by_hand = lag(values)
    for name in NAMES:
        ours, theirs = found["ours"][name], found["vendor"][name]
        true = truth[f"gyro.{name}"] / DPH
        assert theirs["truth"] == pytest.approx(true, rel=1e-9)
        assert abs(theirs["estimate"] - true) < 1e-6 and abs(ours["estimate"] - true) < 1e-6
        assert theirs["estimate"] - true == pytest.approx(17.2 / 20.0 * by_hand[name], rel=2e-3, abs=5e-9), name
        assert abs(theirs["estimate"] - ours["estimate"]) < 0.2 * abs(by_hand[name]) + 1e-8


def test_vendor_gyro_without_its_mapping(command: Command, foreign: Foreign, tmp_path: Path) -> None:
    """Every connector of the socket that is missing is named, with what the FMU has to offer."""
    code, out, err = command("run", NAME, "--part", f"gyro={foreign('vendor_gyro')}", "--out", tmp_path / "run")
    assert code == 2 and out == ""
    for connector in ("omega", "f", "i", "u"):
        assert f"input '{connector}'" in err or f"output '{connector}'" in err or f"'{connector}" in err, connector
    for offered in ("W_IA", "I_TORQUE", "V_PICKOFF"):
        assert offered in err, err
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('"W_SRA"', '"W_SPIN"', ["omega", "W_SPIN", "W_SRA"]),
        ('"I_TORQUE"', '"V_PICKOFF"', ["i", "V_PICKOFF", "input"]),
        ('unit = "mV"', 'unit = "mA"', ["u", "mA", "V"]),
        ('name = "SCALE", unit = "deg/h/mA"', 'name = "SCALES", unit = "deg/h/mA"', ["k", "SCALES", "SCALE"]),
        ('name = "I_TORQUE"', 'name = "I_TORQUE"\nfactors = 2', ["i: mapping entry must be", "factor"]),
    ],
)
def test_wrong_mapping(
    command: Command, foreign: Foreign, tmp_path: Path, old: str, new: str, expected: list[str]
) -> None:
    file = tmp_path / "map.toml"
    text = MAPPING.read_text("utf-8")
    assert old in text
    file.write_text(text.replace(old, new), encoding="utf-8")
    code, out, err = command(
        "run", NAME, "--part", f"gyro={foreign('vendor_gyro')}", "--map", f"gyro={file}", "--out", tmp_path / "run"
    )
    assert code == 2 and out == "" and "Traceback" not in err, err
    for word in expected:
        assert word in err, err
    assert not (tmp_path / "run").exists()


def test_other_misfits(command: Command, tmp_path: Path) -> None:
    """A part of the bench that is no gyro; a slot, a part and a file that do not exist."""
    for part, expected in (
        ("gyro=sampler", ["gyro", "omega", "u"]),
        ("gyros=floated_gyro", ["gyros", "gyro"]),
        ("gyro=floatedgyro", ["floatedgyro", "floated_gyro"]),
        ("gyro=nowhere.fmu", ["nowhere.fmu"]),
    ):
        code, _, err = command("run", NAME, "--part", part, "--out", tmp_path / "run")
        assert code == 2 and "Traceback" not in err, err
        for word in expected:
            assert word in err, err


@pytest.mark.parametrize(
    ("fault", "expected"),
    [(1, "its process crashed (SIGSEGV)"), (2, "no answer within 2 s"), (3, "the wheel has stopped")],
)
@pytest.mark.long
def test_failing_gyro(command: Command, foreign: Foreign, tmp_path: Path, fault: int, expected: str) -> None:
    """Crash, hang and error in step 1500 of the tumble: exit code 3, and two windows of the first dwell are kept.

    The first dwell has two windows of 0.35 s (a sixth of a turn at 3 rad/s); its gate opens at 0.3 s.
    """
    hasty = {"windows": 6, "dwell": 0.7, "settle": 0.3}
    limit = "2s" if expected.startswith("no answer") else "60s"
    code, out, err = command(
        "run", NAME, "--part", f"gyro={foreign('faulty')}", "--timeout", limit, *words(hasty), "--set", "rate=3rad/s",
        "--set", "k=0.08",
        "--set", f"gyro.fault={fault}", "--set", "gyro.at=1500", "--set", "rebalance.K_p=0", "--set", "rebalance.K_i=0",
        "--out", tmp_path / "run",
    )  # fmt: skip
    assert code == 3 and out == "" and "Traceback" not in err, err
    assert expected in err and "gyro: doStep failed at t = 1.5 s" in err, err
    assert f"the record until then is kept in {tmp_path / 'run'}" in err
    record = Record.load(tmp_path / "run")
    assert not record.complete
    assert record.run.stopped_at == pytest.approx(1.5)
    assert record.windows["phase"].tolist() == [1, 1]
    assert expected in record.run.problem


@pytest.mark.long
def test_gyro_that_crashes_in_initialization(command: Command, foreign: Foreign, tmp_path: Path) -> None:
    code, _, err = command(
        "run", NAME, "--part", f"gyro={foreign('faulty')}", "--set", "gyro.fault=5",
        "--set", "k=0.08", "--out", tmp_path / "run",
    )  # fmt: skip
    assert code == 3 and "its process crashed" in err and "Traceback" not in err, err
