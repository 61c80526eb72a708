"""Mapping files: constants, offsets, feedthrough and delays, against loops by hand; proposals, and the command fit."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from commanding import Command
from fmpy import read_model_description

from gyrobench.engine.session import Session, run
from gyrobench.exchange.container import export_container
from gyrobench.exchange.ssp_export import ExportError, export_ssp
from gyrobench.exchange.ssp_import import read_ssp
from gyrobench.record.record import Record
from gyrobench.system.binding import SocketMismatchError, fit
from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.execution_order import AlgebraicLoopError
from gyrobench.system.sockets import SOCKETS, socket
from gyrobench.system.system import Slot, System

Foreign = Callable[[str], Path]
FOREIGN = Path(__file__).parents[1] / "foreign"
GAUGE = Socket(
    "Gauge",
    "a lag with a temperature, and what some lags do not have",
    (
        inp("u", "K", "temperature of the surroundings"),
        inp("hold", "1", "1 holds the value", whole=True),
        out("y", "K", "temperature"),
        out("valid", "1", "1 while it is valid", whole=True),
    ),
)


class Chain(System):
    """a -> b, and back: temperatures."""

    title = "chain"
    slots: ClassVar = {n: Slot(GAUGE, "lag") for n in "ab"}
    wires = """
        a.y -> b.u
        b.y -> a.u
        a.valid -> b.hold
    """
    step = 0.01
    stop = 0.5
    channels = ("a.y", "b.y", "a.valid")
    channel_period = 0.01


def chain(foreign: Foreign, tmp_path: Path, text: dict[str, str], **more: Any) -> list[Record]:
    """Run in both engines and in a child process; the mapping files of a and b."""
    files = {}
    for slot, lines in text.items():
        files[slot] = tmp_path / f"{slot}.toml"
        files[slot].write_text(lines)
    parts = {n: foreign("lag") for n in "ab"}
    both = [run(Chain(), parts, files, engine=e, **more) for e in ("native", "reference")]
    both.append(run(Chain(), parts, files, child=True, **more))
    assert both[0].same_data(both[1])
    assert both[0].same_data(both[2])
    return both


@pytest.mark.long
def test_offsets_and_constants_against_a_loop_by_hand(foreign: Foreign, tmp_path: Path) -> None:
    # a gives degC: y[K] = v + 273.15; b works in degF above 100 K: u[K] = 5/9 v + 100; a is held by constant inputs
    text = {
        "a": 'y = {name = "y", unit = "degC"}\nu = {name = "u", unit = "K"}\n'
        'hold = {name = "hold", constant = 0}\nvalid = {constant = 0}',
        "b": 'u = {name = "u", factor = 0.5, offset = "100K"}\ny = {name = "y"}\nhold = {name = "hold"}\n'
        "[valid]\nconstant = 1",
    }
    found = chain(foreign, tmp_path, text, values={"a.y0": 20.0})[0]
    e = -math.expm1(-0.01 / 0.1)
    a, b = 20.0, 0.0
    rows = [[a + 273.15, b]]
    for _ in range(50):
        a += (b - a) * e  # b.y -> a.u is cut: the value of the previous step
        b += (((a + 273.15) - 100.0) / 0.5 - b) * e
        rows.append([a + 273.15, b])
    np.testing.assert_allclose(np.column_stack([found.channels["a.y"], found.channels["b.y"]]), rows, rtol=1e-13)
    assert set(found.channels["a.valid"].tolist()) == {0.0}
    # 1 holds b at its start value from the first step on
    still = chain(
        foreign, tmp_path, {**text, "a": text["a"].replace("valid = {constant = 0}", "valid = {constant = 1}")}
    )
    assert set(still[0].channels["b.y"].tolist()) == {0.0}
    # an input held at a constant of the mapping file
    held = chain(foreign, tmp_path, {**text, "a": text["a"].replace("constant = 0}\nv", "constant = 1}\nv")})[0]
    assert set(held.channels["a.y"].tolist()) == {273.15}


@pytest.mark.long
def test_delay_is_one_step_whatever_the_order(foreign: Foreign, tmp_path: Path) -> None:
    one = '[u]\nname = "u"\n%s[hold]\nconstant = 0\n[valid]\nconstant = 0\n'
    found = chain(foreign, tmp_path, {"a": one % "", "b": one % "delay = 1\n"}, values={"a.y0": 20.0})[0]
    assert "a.y -> b.u: one step delay (stated in the mapping file)" in found.run.cuts
    assert found.run.delays["a.y -> b.u"] == 0.01
    e = -math.expm1(-0.01 / 0.1)
    a, b = 20.0, 0.0
    rows = [[a, b]]
    for _ in range(50):
        b += (a - b) * e  # first, from the value of a before the step
        a += (b - a) * e
        rows.append([a, b])
    np.testing.assert_allclose(np.column_stack([found.channels["a.y"], found.channels["b.y"]]), rows, rtol=1e-13)
    # without the wire back, a comes first in the order, and b sees its value before the step all the same
    alone = (one % "").replace('"u"', '"u"\nconstant = 0')
    found = chain(foreign, tmp_path, {"a": alone, "b": one % "delay = 1\n"}, values={"a.y0": 20.0})[0]
    assert found.run.order == ["a", "b"]
    a, b = 20.0, 0.0
    rows = [[a, b]]
    for _ in range(50):
        a, b = a - a * e, b + (a - b) * e
        rows.append([a, b])
    np.testing.assert_allclose(np.column_stack([found.channels["a.y"], found.channels["b.y"]]), rows, rtol=1e-13)


def test_a_pythonfmu_gyro(small: System, foreign: Foreign) -> None:
    """It declares no dependencies; with that in the mapping file it runs, and the gyro in C gives the same windows."""
    maps = {"gyro": FOREIGN / "python_gyro.toml"}
    values = {"dwell": 0.2, "turns": 0.01, "table.index_rate": 50.0, "rebalance.meter": 0.0}
    found = run(small, {"gyro": foreign("python_gyro")}, maps, values)
    old = run(small, {"gyro": foreign("vendor_gyro")}, {"gyro": FOREIGN / "vendor_gyro.toml"}, values)
    assert "rebalance.i -> gyro.i: one step delay (no output of gyro depends on it at once)" in found.run.cuts
    assert found.run.cuts == old.run.cuts
    np.testing.assert_allclose(found.windows["mean"], old.windows["mean"], rtol=1e-9, atol=1e-15)


def test_an_algebraic_loop_says_which_lines_open_it(small: System, foreign: Foreign, tmp_path: Path) -> None:
    with pytest.raises(AlgebraicLoopError) as caught:
        run(small, {"gyro": foreign("python_gyro")}, {"gyro": _without(tmp_path, "python_gyro.toml", "feedthrough")})
    assert "gyro: pickoff declares no dependencies" in str(caught.value)
    assert "    [u]\n    feedthrough = false" in str(caught.value)
    # a gyro that does follow the current within the step: a delay is an error that is stated
    text = '[u]\nname = "u"\ndelay = 1\n'
    (tmp_path / "loose.toml").write_text(text)
    with Session(small, {"gyro": foreign("loose")}, {"gyro": tmp_path / "loose.toml"}) as session:
        cuts = [str(c) for c in session.assembly.order.cuts]
    assert cuts[-1] == "gyro.u -> rebalance.u: one step delay (stated in the mapping file)"
    pytest.importorskip("fmu_manipulation_toolbox")
    with pytest.raises(ExportError, match=r"cannot .* the delay of gyro\.u -> rebalance\.u"):
        export_container(small, tmp_path / "x.fmu", {"gyro": foreign("loose")}, {"gyro": tmp_path / "loose.toml"})


def _without(folder: Path, name: str, word: str) -> Path:
    lines = [x for x in (FOREIGN / name).read_text().splitlines() if not x.startswith(word)]
    (folder / name).write_text("\n".join(lines))
    return folder / name


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ({"name": "u", "feedthrough": True}, "u: feedthrough = True in the mapping: false is the only value"),
        ({"name": "u", "delay": 2}, "u: delay = 2 in the mapping: 1 is the only value, one communication step"),
        ({"name": "u", "delay": True}, "u: delay = True in the mapping"),
        ({"name": "u", "offset": "3m"}, "u: in the mapping: offset"),
        ({"name": "u", "offset": math.inf}, "u: in the mapping: offset = inf: must be finite"),
        ({"name": "u", "factor": "x"}, "u: in the mapping: factor"),
        ({"name": "u", "constant": 1.0, "factor": 2.0}, "u: a constant in the mapping goes with name and unit only"),
        ({"name": "wrong", "constant": 1.0}, "u: missing: no variable 'wrong'"),
        ({"constant": [1.0, 2.0]}, "u: 2 constants in the mapping for 1 elements"),
        ({"name": "u", "offest": 1.0}, "u: mapping entry must be a table with name or names, unit, factor, offset"),
    ],
)
def test_mapping_entries_that_are_wrong(foreign: Foreign, entry: dict[str, Any], words: str) -> None:
    description = read_model_description(str(foreign("lag")))
    rest = {"hold": {"constant": 0}, "valid": {"constant": 1}}
    with pytest.raises(SocketMismatchError) as caught:
        fit(GAUGE, description, {"u": entry, **rest})
    assert len(caught.value.problems) == 1
    assert words in caught.value.problems[0]


def test_proposals(foreign: Foreign) -> None:
    """The vendor's mapping by names and units alone; what is left is said: units that are not declared, signs."""
    description = read_model_description(str(foreign("vendor_gyro")))
    with pytest.raises(SocketMismatchError) as caught:
        fit(socket("SdfGyro"), description, {}, "gyro")
    proposed = tomllib.loads("\n".join(caught.value.proposal))
    vendor = tomllib.loads((FOREIGN / "vendor_gyro.toml").read_text())
    assert {k: (v.get("name"), v.get("names")) for k, v in proposed.items()} == {
        k: (v.get("name"), v.get("names")) for k, v in vendor.items() if k != "parameters"
    }
    assert "mapping lines that may fit (check units, signs and axes):" in str(caught.value)
    assert fit(socket("SdfGyro"), description, proposed, "gyro").inputs["omega[2]"].variable == "W_OA"
    # only what is missing is proposed, from what is free
    with pytest.raises(SocketMismatchError) as caught:
        fit(socket("SdfGyro"), description, {k: v for k, v in vendor.items() if k != "i"}, "gyro")
    assert list(tomllib.loads("\n".join(caught.value.proposal))) == ["i"]


@pytest.mark.long
def test_fit_command(foreign: Foreign, tmp_path: Path, command: Command) -> None:
    file = tmp_path / "gyro.toml"
    arguments = ("fit", foreign("python_gyro"), "--slot", "tumble_single_axis.gyro")
    code, _, err = command(*arguments, "--out", file)
    assert (code, err) == (0, "")
    written = file.read_text()
    vendor = tomllib.loads((FOREIGN / "python_gyro.toml").read_text())
    proposed = tomllib.loads(written)
    parameters = proposed.pop("parameters")
    assert parameters["k"]["name"] == "k_torquer" == vendor.pop("parameters")["k"]["name"]
    assert {k: (v.get("name"), v.get("names")) for k, v in proposed.items()} == {
        k: (v.get("name"), v.get("names")) for k, v in vendor.items()
    }
    assert "# pickoff: no dependencies are declared" in written
    assert command(*arguments, "--out", file)[0] == 2  # not over what is there
    servo = command("fit", foreign("python_gyro"), "--slot", "servo_polar.gyro")[1]
    assert "k_torquer" not in servo, "the test needs no k, and what says something of k (k_T, k_E) is not k"
    code, text, err = command("fit", foreign("lag"), "--slot", "Rebalance")
    assert code == 0
    assert "# [i]  # torquer current, A: name the FMU's output, or state the value" in text
    assert "to be completed by hand:\n  - i: missing" in err
    code, _, err = command("fit", foreign("lag"), "--slot", "tumble_single_axis.gyroscope")
    assert code == 2
    assert "no slot 'gyroscope'; did you mean gyro" in err


def test_optional_connectors_are_marked() -> None:
    latency = SOCKETS["Estimator"].connector("latency")
    assert latency is not None
    assert latency.optional


@pytest.mark.long
def test_offsets_and_constants_survive_an_archive(foreign: Foreign, tmp_path: Path) -> None:
    text = {
        "a": 'y = {name = "y", unit = "degC"}\nu = {name = "u", unit = "K"}\n'
        "hold = {constant = 0}\nvalid = {constant = 1}",
        "b": 'u = {name = "u", factor = 0.5, offset = "100K"}\ny = {name = "y"}\nhold = {name = "hold"}\n'
        "[valid]\nconstant = 1",
    }
    maps = {}
    for slot, lines in text.items():
        maps[slot] = tmp_path / f"{slot}.toml"
        maps[slot].write_text(lines)
    parts = {n: foreign("lag") for n in "ab"}
    for held in (True, False):
        maps["a"].write_text(text["a"].replace("valid = {constant = 1}", f"valid = {{constant = {int(held)}}}"))
        export_ssp(Chain(), tmp_path / "chain.ssp", parts, maps, {"a.y0": 20.0})
        ours = run(Chain(), parts, maps, {"a.y0": 20.0})
        system = read_ssp(tmp_path / "chain.ssp", 0.01)
        system.stop = 0.5
        type(system).channels, type(system).channel_period = ("a.y", "b.y"), 0.01
        theirs = run(system)
        np.testing.assert_allclose(theirs.channels["a.y"] + 273.15, ours.channels["a.y"], rtol=1e-14)  # the FMU's degC
        np.testing.assert_allclose(theirs.channels["b.y"], ours.channels["b.y"], rtol=1e-13)
        assert (theirs.channels["b.y"][-1] == theirs.channels["b.y"][0]) == held
