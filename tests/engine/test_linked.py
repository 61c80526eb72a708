"""The linked form: the same bits as FMI calls in every system; failures, checkpoints, when it is used."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from gyrobench.bench import Bench, standard_folder
from gyrobench.engine import engine_library, linked_system
from gyrobench.engine.native_engine import NativeEngine
from gyrobench.engine.run_errors import RunError, RunInterrupted
from gyrobench.engine.session import Session, run
from gyrobench.packaging import CompilerError
from gyrobench.record.record import Record
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import System, load_system
from gyrobench.system.values import InvalidValueError

STEPS = 64
QUICK = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0}
FOREIGN = Path(__file__).parents[1] / "foreign"
SYSTEMS = sorted(n for n in Bench(standard_folder()).systems() if not isinstance(load_test(n), Suite))


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.long
def test_the_linked_form_gives_the_same_bits_in_every_system(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first steps, each a row of the channels, and all wired values after the last one."""
    found: list[tuple[Record, bytes]] = []
    with Session(name, engine="linked", bench=standard_folder()) as session:
        system, step = type(session.system), session.system.step
        for attribute, value in {"stop": STEPS * step, "channel_period": step, "loops": ()}.items():
            monkeypatch.setattr(system, attribute, value)
        for engine in ("linked", "native", "reference"):
            session.engine, session.linkable = engine, engine == "linked"
            found.append((session.run(seed=7), session.program.out.tobytes()))
    (linked, values), *others = found
    assert linked.run.steps == STEPS
    assert [r.run.linked for r, _ in found] == [True, False, False]
    assert all(linked.same_data(r) and values == v for r, v in others)


def test_a_whole_plan_with_windows(small: System) -> None:
    linked, native = (run(small, values=QUICK, engine=e, seed=5) for e in ("linked", "native"))
    assert len(linked.windows["mean"]) > 4
    assert linked.same_data(native)
    assert linked.run.steps == native.run.steps
    assert set(linked.run.timing) == set(native.run.timing) == set(small.slots)
    assert all(0.0 < s < 1.0 for s in linked.run.timing.values())  # sampled, as by FMI calls


def test_a_part_that_fails_tells_why(small: System) -> None:
    # the float reaches its stop of 1e-6 rad
    messages = []
    for engine in ("linked", "native", "reference"):
        with pytest.raises(RunError) as failed:
            run(small, values={**QUICK, "gyro.stop": 1e-6}, engine=engine)
        messages.append(str(failed.value))
        assert failed.value.record is not None
    assert "gyro: doStep failed at t = " in messages[0]
    assert "stop" in messages[0]
    assert messages[0] == messages[1] == messages[2]


@pytest.fixture
def repeated(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Returns the blocks that the engines of this process went through again, with a look at each number."""
    counts: list[int] = []
    close = NativeEngine.close

    def count(engine: NativeEngine) -> None:
        counts.append(int(engine.run.repeated))
        close(engine)

    monkeypatch.setattr(NativeEngine, "close", count)
    return counts


@pytest.mark.parametrize(
    ("ramp", "what"),
    [(1e308, "drift is inf at t = 1.798 s"), (1.5e308, "b is -inf at t = 0.003 s"), (2e307, "b is -inf at t = 4.")],
)
@pytest.mark.long
def test_a_number_that_is_not_finite_ends_the_run_at_its_step(
    small: System, ramp: float, what: str, repeated: list[int], tmp_path: Path
) -> None:
    """A double ends at 1.7977e308: the drift of the first, ramp t, there at 1.7977 s; the float angle of the third,
    H/C = 1 times ramp t2 / 2, at 4.24 s, in the second block of steps.  The float rate of the second at 1 ms is
    -(1 - 1/e) ramp 1 ms (C/J = 1000 1/s), its derivative at 2 ms -1000 1/s (2 ms - 0.632 ms) ramp = -2.1e308: infinite.
    """
    told, records = [], []
    for engine in ("linked", "native", "reference"):
        with Session(small, engine=engine, child=False) as session, pytest.raises(RunError) as failed:
            session.run({**QUICK, "dwell": 2.0, "gyro.ramp": ramp}, seed=5, out=tmp_path / engine)
        told.append(str(failed.value).replace(engine, "ENGINE"))
        records.append(failed.value.record)
    assert f"output {what}" in told[0]
    assert told[0] == told[1] == told[2]
    linked, native, reference = (r for r in records if r is not None)
    assert linked.run.steps == native.run.steps == reference.run.steps > (4096 if "4." in what else 0)
    assert linked.same_data(native)
    assert linked.same_data(reference)
    linked_blocks, by_calls = repeated  # the reference engine has no such count
    assert linked_blocks > by_calls == 0


@pytest.mark.long
def test_an_input_that_its_factor_takes_beyond_a_double_ends_the_run_at_its_step(
    repeated: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A step of 2 rad/s times 1e308 is infinite; in a block of quick steps nothing looks at the input itself."""
    system = load_system("stabilizer_sdf", standard_folder())
    phase = LoopPhase("step", "command", "step", amplitude=2.0, settle=0.01, dwell=0.01)
    monkeypatch.setattr(type(system), "plan", lambda self: LoopPlan([phase]))
    for key, value in {"factors": {"exciter.command[1] -> gyro.i": 1e308}, "loops": ()}.items():
        monkeypatch.setattr(type(system), key, value)
    told = []
    for engine in ("linked", "native"):
        with Session(system, engine=engine, child=False) as session, pytest.raises(RunError) as failed:
            session.run(seed=5)
        told.append(str(failed.value).replace(engine, "ENGINE"))
    assert "input i is inf at t = 0.009 s" in told[0]  # the step that ends at 10 ms
    assert told[0] == told[1]
    assert repeated == [1, 0]


SPILL = """
    spilled = Discrete(0.0, "1", "1 where a product is beyond what a double holds")

    @sampled(every=1)
    def spill(self) -> None:
        self.spilled = 1.0 if self.t * 1e308 * 1e10 > 1e300 else 0.0
"""


@pytest.mark.long
def test_a_flag_without_a_number_that_is_not_finite_changes_nothing(
    small: System, tmp_path: Path, repeated: list[int]
) -> None:
    """A product in a comparison overflows in each step: the flag of the processor is raised, no value is infinite."""
    model = (Bench(standard_folder()).part_folder("site") / "model.py").read_text(encoding="utf-8")
    folder = tmp_path / "components" / "site"
    folder.mkdir(parents=True)
    head = "from gyrobench.component import Discrete, sampled\n"
    place = "from gyrobench.component.blocks.place import Place\n"
    assert place in model
    (folder / "model.py").write_text(model.replace(place, head + place) + SPILL, encoding="utf-8")
    for room in ("systems", "reports"):
        (tmp_path / room).mkdir()
    records = []
    for engine in ("linked", "native"):
        with Session(small, engine=engine, child=False, bench=tmp_path) as session:
            records.append(session.run({**QUICK, "dwell": 8.0}, seed=5))  # four blocks of 4096 steps and more
    with Session(small, engine="linked", child=False) as session:
        records.append(session.run({**QUICK, "dwell": 8.0}, seed=5))
    assert records[0].run.steps > 4 * 4096
    assert all(r.same_data(records[0]) for r in records)
    flagged, by_calls, standard = repeated
    assert flagged > 0
    assert by_calls == standard == 0


@pytest.mark.long
def test_a_run_is_continued_in_the_other_form(small: System, tmp_path: Path) -> None:
    whole = run(small, values=QUICK, engine="native", seed=2)
    for first, second in (("linked", "native"), ("native", "linked")):
        out = tmp_path / first
        with pytest.raises(RunInterrupted):
            run(small, values=QUICK, engine=first, seed=2, out=out, stop_at=0.333)
        assert run(small, values=QUICK, engine=second, seed=2, out=out, resume=True).same_data(whole)


@pytest.mark.long
def test_it_is_used_where_it_is_there_or_worth_it(
    small: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    library = tmp_path / "linked.so"
    monkeypatch.setattr(linked_system, "library_path", lambda name, source: library)
    # some 2000 steps of 6 parts save 0.1 ms, which is less than the compiler takes
    assert not run(small, values=QUICK).run.linked
    assert not library.exists()
    with monkeypatch.context() as cheap:
        cheap.setattr(linked_system, "COMPILATION", 1e-6)
        assert run(small, values=QUICK).run.linked
    assert library.exists()
    assert run(small, values=QUICK).run.linked  # it is there
    assert not run(small, values=QUICK, engine="native").run.linked


def test_many_short_runs_are_worth_it_together(small: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    library = tmp_path / "linked.so"
    monkeypatch.setattr(linked_system, "library_path", lambda name, source: library)
    with Session(small, child=False) as session:
        records = [session.run(QUICK)]
        # worth a run and a half; that this one has moves, which its plan does not count, is known after it
        worth = 1.5 * records[0].run.steps * len(session.program.parts) * linked_system.SAVED
        monkeypatch.setattr(linked_system, "COMPILATION", worth)
        records += [session.run(QUICK) for _ in range(3)]
    assert [r.run.linked for r in records] == [False, False, True, True]
    assert all(r.same_data(records[0]) for r in records)


def test_without_a_compiler_a_long_run_is_not_linked(
    small: System, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on a worker to which FMUs and engine were sent."""

    def none(*_: object) -> None:
        raise CompilerError("no C compiler")

    monkeypatch.setattr(linked_system, "library_path", lambda name, source: tmp_path / "linked.so")
    monkeypatch.setattr(linked_system, "COMPILATION", 0.0)
    monkeypatch.setattr(engine_library.compiler, "compile_library", none)
    assert not run(small, values=QUICK).run.linked
    with pytest.raises(CompilerError):
        run(small, values=QUICK, engine="linked")


@pytest.mark.long
def test_foreign_and_python_parts_are_not_linked(small: System, foreign: Callable[[str], Path]) -> None:
    with Session(small, target="python") as session:
        assert not session.linkable
    setup = {"parts": {"gyro": foreign("vendor_gyro")}, "maps": {"gyro": FOREIGN / "vendor_gyro.toml"}}
    with Session(small, **setup) as session:  # type: ignore[arg-type]
        assert not session.linkable
    with pytest.raises(InvalidValueError, match="engine 'linked': gyro: not a native part of this bench"):
        Session(small, engine="linked", **setup)  # type: ignore[arg-type]


def test_an_fmu_of_other_sources_is_not_linked(small: System, monkeypatch: pytest.MonkeyPatch) -> None:
    # its instance may have another layout
    monkeypatch.setattr(linked_system, "native_guid", lambda name, cls: f"other {name}")
    with pytest.raises(InvalidValueError, match=r"site.*files of the part have changed since its FMU was built"):
        Session(small, engine="linked")
