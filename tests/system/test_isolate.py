"""Foreign FMUs that crash, hang or refuse: the message says where, and the record until then is kept."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from gyrobench.engine.session import RunError, run
from gyrobench.record.record import Record
from gyrobench.system.execution_order import AlgebraicLoopError
from gyrobench.system.system import System

Make = Callable[[str], Path]


@pytest.mark.parametrize(
    ("fault", "words"),
    [(1, "its process crashed (SIGSEGV)"), (2, "no answer within 1 s"), (3, "the wheel has stopped after 150 steps")],
)
def test_fault_under_isolation(small: System, make: Make, tmp_path: Path, fault: int, words: str) -> None:
    # step 150 begins at t = 0.15 s: the channels every 10 ms then have rows at 0, 0.01 ... 0.15
    with pytest.raises(RunError) as caught:
        run(
            small,
            parts={"gyro": make("faulty")},
            values={"gyro.fault": fault, "gyro.at": 150, "rebalance.K_p": 0.0, "rebalance.K_i": 0.0},
            isolate=["gyro"],
            timeout=1.0,
            out=tmp_path / "run",
        )
    text = str(caught.value)
    assert words in text
    assert "gyro: doStep failed at t = 0.15 s" in text
    assert str(tmp_path / "run") in text
    assert caught.value.exit_code == 3
    record = Record.load(tmp_path / "run")
    assert not record.complete
    assert record.run.stopped_at == pytest.approx(0.15)
    assert record.channels["time"].tolist() == [k * 10 * 1e-3 for k in range(16)]


def test_crash_in_initialization(small: System, make: Make) -> None:
    with pytest.raises(RunError, match=r"gyro: enterInitializationMode failed: its process crashed|gyro: initialize"):
        run(small, parts={"gyro": make("faulty")}, values={"gyro.fault": 5}, isolate=["gyro"])


@pytest.mark.parametrize("engine", ["native", "reference"])
def test_error_with_message_in_process(small: System, make: Make, engine: str) -> None:
    with pytest.raises(
        RunError, match=r"gyro: doStep failed at t = 0.15 s: status 3 \(Error\)\n.*the wheel has stopped"
    ):
        run(
            small,
            parts={"gyro": make("faulty")},
            values={"gyro.fault": 3, "gyro.at": 150, "rebalance.K_p": 0.0},
            engine=engine,
        )


def test_isolated_run_is_bit_equal(small: System) -> None:
    values = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0}
    inside = run(small, values=values, engine="native", seed=4)
    outside = run(small, values=values, isolate=["gyro"], seed=4)
    assert inside.same_data(outside)
    assert outside.run.isolated == ["gyro"]


def test_undeclared_dependencies_make_an_algebraic_loop(small: System, make: Make) -> None:
    with pytest.raises(AlgebraicLoopError, match=r"gyro\.u -> rebalance\.u -> rebalance\.i -> gyro\.i -> gyro\.u"):
        run(small, parts={"gyro": make("loose")})
