"""Parallel coupling: each wire carries the value of the step before; what the record and the report say of it."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest
from archives import LAG, bound, real, write_archive
from commanding import Command
from exported import record_from_series
from masters import run_in

import gyrobench as gb
from gyrobench.engine.session import run
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.system import Slot, System

Foreign = Callable[[str], Path]
LAG_SOCKET = Socket("Lag", "a lag", (inp("u", "1", "in", whole=False), out("y", "1", "out")))
QUICK = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0}


class Ring(System):
    """a -> b -> c -> a."""

    title = "ring"
    slots: ClassVar = {n: Slot(LAG_SOCKET, "lag") for n in "abc"}
    wires = "a.y -> b.u\nb.y -> c.u\nc.y -> a.u"
    step = 0.01
    stop = 0.5
    channels = ("a.y", "b.y", "c.y")
    channel_period = 0.01


def test_every_part_takes_the_values_before_the_step(foreign: Foreign) -> None:
    system = Ring()
    system.coupling = "parallel"
    found = run(system, dict.fromkeys("abc", foreign("lag")), values={"a.y0": 20.0})
    e, y = -math.expm1(-0.01 / 0.1), np.array([20.0, 0.0, 0.0])
    rows = [y]
    for _ in range(50):
        y = y + (np.roll(y, 1) - y) * e  # a takes c, b takes a, c takes b: all of them old
        rows.append(y)
    np.testing.assert_allclose(np.column_stack([found.channels[f"{n}.y"] for n in "abc"]), rows, rtol=1e-13)
    assert found.run.coupling == "parallel"
    assert found.run.delays == dict.fromkeys(system.wires.split("\n"), 0.01)
    assert found.run.cuts[0] == "a.y -> b.u: one step delay (parallel coupling)"


@pytest.mark.long
def test_libcosim_couples_alike(small: System, tmp_path: Path) -> None:
    """Noise off; what is left is rounding of the time.  In the order of the bench the windows are others."""
    pytest.importorskip("libcosimpy")
    quiet = dict.fromkeys(("gyro.white", "gyro.markov", "gyro.pickoff", "rebalance.meter"), 0.0)
    system = small.with_values({**QUICK, **quiet})
    export_ssp(system, tmp_path / "s.ssp")
    assert system.windows is not None
    names = {n: tuple(n.split(".", 1)) for n in (system.windows.watch, *system.windows.columns.values())}
    series, _, _ = run_in("libcosimpy", tmp_path / "s.ssp", names, 1e-3, 4000)
    theirs = record_from_series(small, series).windows
    ordered = run(system).windows
    system.coupling = "parallel"
    ours = run(system).windows
    for name, column in ours.items():
        np.testing.assert_allclose(column, theirs[name], rtol=1e-5, atol=1e-12, err_msg=name)
    assert np.max(np.abs(ordered["mean"] / theirs["mean"] - 1.0)) > 1e-3


@pytest.mark.long
def test_the_report_of_a_loop_that_is_coupled_in_parallel(tmp_path: Path, command: Command) -> None:
    """The step check runs by itself, the report names the coupling, the run is another one than in order."""
    words = ("run", "fixed_position", *(f"--set={x}" for x in ("readings=8", "dwell=4s", "settle=1s")), "--no-report")
    code, _, err = command(*words, "--coupling", "parallel", "--out", tmp_path / "p", default_check=True)
    assert code == 0, err
    document = json.loads((tmp_path / "p" / "run.json").read_text())
    assert document["coupling"] == "parallel"
    assert set(document["delays"].values()) == {1e-3} and len(document["delays"]) > 15
    result = json.loads((tmp_path / "p" / "result.json").read_text())
    assert result["step_check"]["step"] == 1e-3 and result["step_check"]["rows"]
    code, _, err = command(*words, "--out", tmp_path / "p")
    assert code == 2 and "holds another run (its coupling differ)" in err
    code, _, err = command("run", "drift_test_suite", "--coupling", "parallel")
    assert code == 2 and "--coupling: drift_test_suite is a suite" in err
    code, out, _ = command("show", "fixed_position", "--coupling", "parallel")
    assert code == 0 and "parallel coupling" in out
    with pytest.raises(gb.GyrobenchError, match="coupling = 'jacobi': one of sequential, parallel"):
        gb.load("fixed_position", coupling="jacobi")
    assert gb.load("fixed_position", coupling="parallel").system.coupling == "parallel"


@pytest.mark.long
def test_an_archive_says_what_its_step_does(foreign: Foreign, tmp_path: Path, command: Command) -> None:
    """Two lags feed one another, the first from 1: half the step moves the second by what is written here by hand."""
    elements = LAG.format("a", bound(real("y0", 1.0))) + LAG.format("b", "")
    link = '<ssd:Connection startElement="a" startConnector="y" endElement="b" endConnector="u"/>'
    back = '<ssd:Connection startElement="b" startConnector="y" endElement="a" endConnector="u"/>'
    path = write_archive(tmp_path / "x.ssp", {"resources/lag.fmu": foreign("lag")}, elements, link + back)
    code, _, err = command(
        "run", path, "--step", "0.25", "--coupling", "parallel", "--out", tmp_path / "run", default_check=True
    )
    assert code == 0, err

    def rows(steps: int) -> list[float]:  # b at 0.25 s and at 0.5 s
        e, (a, b), found = -math.expm1(-0.25 / steps / 0.1), (1.0, 0.0), []
        for _ in range(2):
            for _ in range(steps):
                a, b = a + (b - a) * e, b + (a - b) * e
            found.append(b)
        return found

    most = max(abs(x - y) for x, y in zip(rows(1), rows(2), strict=True))
    notes = json.loads((tmp_path / "run" / "run.json").read_text())["notes"]
    (said,) = [n for n in notes if "changes b.y" in n]
    assert said.startswith(f"Half the step changes b.y by up to {most:.3g} (")
    assert said in err
