"""Runs of the small system: equal engines, initial outputs, values, seeds, records, interruption."""

from __future__ import annotations

import math
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

from gyrobench.engine.run_errors import RunError, RunInterrupted
from gyrobench.engine.session import Session, run
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.system.parameters import slot_seed
from gyrobench.system.system import InvalidConfigurationError, Slot, System
from gyrobench.system.system_description import describe
from gyrobench.system.values import InvalidValueError
from gyrobench.system.wire_text import WiringError

Foreign = Callable[[str], Path]
QUICK = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0}
FOREIGN = Path(__file__).parents[1] / "foreign"


class Ring(System):
    """Four lags in a ring: b and c see values of the same step, a the last value of d."""

    title = "ring"
    slots: ClassVar = {n: Slot("Lag", "lag") for n in "abcd"}
    wires = """
        a.y -> b.u   # comments are allowed
        b.y -> c.u
        c.y -> d.u
        d.y -> a.u
        a.count -> c.add
        b.odd -> d.hold
    """
    step = 0.01
    stop = 1.0
    channels = ("a.y", "b.y", "c.y", "d.y", "d.count", "d.odd")
    channel_period = 0.01


@pytest.fixture(autouse=True)
def lag_socket(monkeypatch: pytest.MonkeyPatch) -> None:
    from gyrobench.system import sockets

    monkeypatch.setitem(sockets.SOCKETS, "Lag", sockets.Socket("Lag", "a lag", ()))


def ring(foreign: Foreign) -> dict[str, Any]:
    return {"parts": {n: foreign("lag") for n in "abcd"}, "values": {"a.y0": 1.0, "b.T": 0.05, "a.T": "200ms"}}


def test_engines_are_bit_equal(small: System) -> None:
    one = run(small, values=QUICK, engine="native", seed=5)
    two = run(small, values=QUICK, engine="reference", seed=5)
    assert len(one.windows["mean"]) > 4
    assert one.same_data(two)
    assert (one.run.engine, two.run.engine) == ("native", "reference")
    assert one.run.order == two.run.order


def test_engines_are_bit_equal_with_a_mapped_fmu(small: System, foreign: Foreign) -> None:
    setup = {"parts": {"gyro": foreign("vendor_gyro")}, "maps": {"gyro": FOREIGN / "vendor_gyro.toml"}}
    one = run(small, values=QUICK, engine="native", **setup)
    two = run(small, values=QUICK, engine="reference", **setup)
    assert one.same_data(two)
    assert "gyro.drift" not in one.channels  # optional, not offered
    assert one.run.parts["gyro"].target == "foreign"


def test_integer_and_boolean_connections_against_a_loop_by_hand(foreign: Foreign) -> None:
    # order a b c d, d -> a is cut.  y' = (u - y)/T held over h: y += (u - y) (1 - exp(-h/T))
    found = run(Ring(), **ring(foreign), engine="native")
    assert found.same_data(run(Ring(), **ring(foreign), engine="reference"))
    assert found.run.cuts == ["d.y -> a.u: one step delay (no output of a depends on it at once)"]
    y = {"a": 1.0, "b": 0.0, "c": 0.0, "d": 0.0}
    e = {n: -math.expm1(-0.01 / t) for n, t in {"a": 0.2, "b": 0.05, "c": 0.1, "d": 0.1}.items()}
    rows = [list(y.values())]
    for k in range(100):
        y["a"] += (y["d"] - y["a"]) * e["a"]
        y["b"] += (y["a"] - y["b"]) * e["b"]
        y["c"] += (y["b"] + (k + 1) - y["c"]) * e["c"]
        if (k + 1) % 2 == 0:
            y["d"] += (y["c"] - y["d"]) * e["d"]
        rows.append(list(y.values()))
    got = np.column_stack([found.channels[f"{n}.y"] for n in "abcd"])
    np.testing.assert_allclose(got, rows, rtol=1e-13)
    assert found.channels["d.count"].tolist() == list(range(101))
    assert found.channels["time"][-1] == 1.0


def test_initial_outputs_are_propagated(foreign: Foreign) -> None:
    # the first step of b sees a.y after a's first step; a itself sees d's initial output y0 = 3, not 0
    found = run(Ring(), parts=ring(foreign)["parts"], values={"d.y0": 3.0})
    assert found.channels["a.y"][0] == 0.0
    assert found.channels["a.y"][1] == pytest.approx(3.0 * -math.expm1(-0.1), rel=1e-14)


def test_windows_times_and_meta(small: System, tmp_path: Path) -> None:
    record = run(small, values=QUICK, seed=2, out=tmp_path / "r")
    w = record.windows
    assert w["phase"].dtype == np.int64
    assert w["phase"].tolist() == sorted(w["phase"].tolist())
    assert set(w["phase"]) == {1, 2, 3}
    np.testing.assert_allclose(w["t_end"] - w["t_start"], w["n"] * 1e-3, rtol=1e-9)
    np.testing.assert_allclose(w["angle_end"] - w["angle_start"], [0, 0] + [0.05] * 2 + [0], atol=1e-3)
    document = record.run
    assert document.complete
    assert document.changed == list(QUICK)
    assert document.parameters["table.index_rate"] == 1.0
    assert document.parameters["site.latitude"] == pytest.approx(math.radians(45.75))
    assert document.parameters["sequencer.modes"][:3] == [0, 2, 1]
    assert len(document.parameters["gyro.mount"]) == 3
    assert document.plan[1].label == "turn"
    assert len(document.parts["gyro"].sha256) == 64
    assert set(document.timing) == set(small.slots)
    again = Record.load(tmp_path / "r")
    assert again.same_data(record)
    assert again.run == document
    assert [p.name for p in (tmp_path / "r").iterdir() if p.suffix == ".part"] == []


def test_csv_fallback_reads_back_bit_for_bit(small: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    record = run(small, values=QUICK, seed=2)
    monkeypatch.setattr("gyrobench.record.record._have_parquet", lambda: False)
    record.save(tmp_path)
    assert (tmp_path / "record.csv").exists()
    assert Record.load(tmp_path).same_data(record)


def test_seeds(small: System) -> None:
    with Session(small) as session:
        a, b, c = (session.run(QUICK, seed=s) for s in (1, 2, 1))
        fixed = session.run({**QUICK, "gyro.seed": 77}, seed=1)
    assert a.same_data(c)
    assert not a.same_data(b)
    assert not a.same_data(fixed)
    assert a.run.parameters["gyro.seed"] == slot_seed(1, "gyro") != a.run.parameters["rebalance.seed"]
    assert fixed.run.parameters["gyro.seed"] == 77


@pytest.mark.long
def test_values_are_refused_with_a_hint(small: System) -> None:
    for values, words in (
        ({"lattitude": 1}, "lattitude: no such option of smalltumble; options: latitude"),
        ({"latitude": "45 km"}, "'km' \\(m\\) does not convert to 'rad'"),
        ({"latitude": "100deg"}, "latitude = 100deg: must be <= 1.5708 rad"),
        ({"gyro.D_X": 1}, "gyro.D_X: gyro has no parameter 'D_X'; nearest: D_"),
        ({"gyro.H": "3 V"}, "gyro.H"),
        ({"gyro.mount": 3}, "gyro.mount: is an array"),
        ({"gyro.seed": 1.5}, "must be an integer"),
        ({"gyro.H": math.nan}, "must be finite"),
        ({"step.": 0}, "no slot 'step'"),
    ):
        with pytest.raises(InvalidValueError, match=words):
            run(small, values=values)
    with pytest.raises(InvalidConfigurationError, match="latitude 0: nothing to see"):
        run(small, values={"latitude": 0})
    with pytest.raises(InvalidConfigurationError, match=r"phase 1 'rest': dwell = 0: must be > 0"):
        run(small, values={"dwell": 0.0})
    with pytest.raises(InvalidValueError, match="step = 0"):
        run(small, step=0.0)


def test_per_g_coefficient_and_array_values(small: System) -> None:
    values = {**QUICK, "gyro.D_I": "0.9deg/h/g", "gyro.mount": "[[1,0,0],[0,1,0],[0,0,1]]", "gyro.mount[1,1]": 1.0}
    record = run(small, values=values)
    assert record.run.parameters["gyro.D_I"] == pytest.approx(math.radians(0.9) / 3600)


def test_part_refuses_its_parameter(small: System) -> None:
    with pytest.raises(RunError, match=r"gyro does not start: .*H.*\n  \(\w+: status 3 \(Error\)\)"):
        run(small, values={"gyro.H": -1.0})


def test_wiring_errors(small: System, foreign: Foreign) -> None:
    class Bad(type(small)):  # type: ignore[misc]
        wires = """
            site.f -> gyro.u
            site.f -> table.mode
            gyro.u -> rebalance.u
            site.g -> rebalance.u
            nowhere.x -> gyro.i
            rebalance.i -> gyro.omega[1]
        """

    with pytest.raises(WiringError) as caught:
        run(Bad())
    assert [p.split(":")[0] for p in caught.value.problems] == [
        "site.f -> gyro.u", "site.f -> table.mode", "site.g -> rebalance.u",
        "nowhere.x -> gyro.i", "rebalance.i -> gyro.omega[1]",
    ]  # fmt: skip


def test_interrupt_keeps_the_record(foreign: Foreign, tmp_path: Path) -> None:
    class Long(Ring):
        stop = 1e6
        channel_period = 100.0

    seen: list[Any] = []

    def interrupt(report: Any) -> None:
        seen.append(report)
        if report.time > 1000.0:
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(RunInterrupted) as caught:
        run(Long(), **ring(foreign), out=tmp_path, progress=interrupt)
    record = Record.load(tmp_path)
    assert not record.complete
    assert 1000.0 < record.run.stopped_at == seen[-1].time < 1e6
    assert len(record.channels["time"]) == int(record.run.stopped_at / 100.0 + 1e-9) + 1
    assert caught.value.exit_code == 3
    assert seen[-1].rate > 0.0
    assert 0.0 < seen[-1].fraction < 1.0


def test_description_is_what_runs(small: System) -> None:
    with Session(small) as session:
        shown = describe(session.assembly)
        record = session.run(QUICK)
    for key in ("order", "cuts", "delays"):
        assert shown[key] == getattr(record.run, key)
    assert [w["wire"] for w in shown["wires"] if w["cut"]] == list(shown["delays"])


def test_many_rows_do_not_overflow_the_blocks(foreign: Foreign) -> None:
    class Dense(Ring):
        stop = 500.0  # 50,000 rows

    found = run(Dense(), **ring(foreign))
    np.testing.assert_array_equal(found.channels["time"], np.arange(50001) * 0.01)


@pytest.mark.long
def test_python_and_native_parts_give_the_same_record(small: System) -> None:
    native = run(small, values=QUICK, seed=3)
    python = run(small, values=QUICK, seed=3, target="python", engine="reference")
    assert native.same_data(python)
    assert python.run.parts["gyro"].target == "python"


@pytest.mark.parametrize("engine", ["native", "reference"])
def test_nan_is_the_fault_of_the_part_that_gives_it(
    small: System, foreign: Foreign, tmp_path: Path, engine: str
) -> None:
    """The next part of the bench cannot take it; another foreign one in between passes it on."""
    wrong, values = {"gyro": foreign("faulty")}, {"gyro.fault": 4, "gyro.at": 150}
    with pytest.raises(RunError) as caught:
        run(small, wrong, values={**values, "rebalance.K_p": 0.0}, engine=engine)
    assert str(caught.value).startswith("gyro: doStep failed at t = 0.15 s: its output u is nan\n")
    assert "FMU log: rebalance does not take it: input u is nan at t = 0.15 s" in str(caught.value)
    assert caught.value.record is not None
    assert not caught.value.record.complete
    (tmp_path / "lag.toml").write_text('[i]\nname = "y"\n[i_read]\nname = "y"\n')
    with pytest.raises(RunError, match=r"gyro: doStep failed at t = 0\.15 s: its output u is nan\n.*sampler does not"):
        run(small, {**wrong, "rebalance": foreign("lag")}, {"rebalance": tmp_path / "lag.toml"}, values, engine=engine)


def test_infinite_parameter_does_not_cost_the_record(tmp_path: Path) -> None:
    record = Record({"mean": np.zeros(1)}, {}, RunDocument(parameters={"gyro.limit": math.inf}, list=[math.nan]))
    again = Record.load(record.save(tmp_path))
    assert again.run.parameters == {"gyro.limit": "inf"} and again.run.as_dict()["list"] == ["nan"]
