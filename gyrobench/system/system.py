"""Systems: slots, wires, options, plan and reduction, declared in ``systems/<name>/system.py``.

    class Tumble(System):
        \"\"\"Single-axis tumble of a floated gyro.\"\"\"
        title = "Single-axis tumble test"
        spec = ("TEST-TUMBLE1-SDF",)
        slots = {"site": Slot("Site", "site"), "gyro": Slot("SdfGyro", "floated_gyro"), ...}
        wires = '''
            site.f -> table.f_local
            gyro.u -> rebalance.u
        '''
        step = 1e-3
        options = {"latitude": Option("45.75deg", "rad", "geographic latitude")}
        windows = Windows("sampler.count", {"mean": "sampler.mean", ...})
        done = "sequencer.done"
        channels = ["gyro.u", "rebalance.i"]
        noises = ("gyro.white", "rebalance.meter")          # set to 0 by --check-step
        measured_data = MeasuredData(TEMPLATE, read)        # gyrobench reduce: an empty file, and its reader

        def plan(self): return Plan([...])
        def parameters(self, parts): return {**self.plan().parameters(), "site.latitude": self["latitude"]}
        def check(self): return [...]

Its reduction is the class Reduction of a file reduction.py beside it, unless it names another one.

An instance holds one set of values: ``system.set("latitude", "45.75deg")``, ``system.set("gyro.H", 0.3)``.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from gyrobench.bench import UsageError, suggest_names
from gyrobench.record.csv_reader import WINDOW_COLUMNS
from gyrobench.system.configurable import (
    Configurable,
    InvalidConfigurationError,
    Option,
    lacking_methods,
    load_configurable,
)
from gyrobench.system.loop_plan import LoopPlan
from gyrobench.system.plan import Plan
from gyrobench.system.sockets import Socket
from gyrobench.system.values import InvalidValueError, flatten

if TYPE_CHECKING:
    from gyrobench.record.record import Record
    from gyrobench.result import Reason, Result, Specification, StepCheck
    from gyrobench.system.part_values import PartValues

__all__ = [
    "InvalidConfigurationError", "MeasuredData", "OnRequest", "Option", "Slot", "System", "Windows", "load_system",
]  # fmt: skip


@dataclass(frozen=True)
class Slot:
    """A place in a system: its socket and the name of the part that is there unless another one is given.

    socket: the name of one of gyrobench.system.sockets, or a Socket of the system's own.  part: "" in a family, where
    the system names it, see :meth:`System.with_parts`.  quantities: what signals stand for in this system, connector ->
    "angle" or "rate"; a part that declares another one does not fit.
    """

    socket: str | Socket
    part: str = ""
    quantities: Mapping[str, str] = field(default_factory=dict)


SAMPLED = "t_start t_end angle_start angle_end mean std n flagged"


@dataclass(frozen=True)
class Windows:
    """Windows of a record: a row is written when ``watch`` changes; column name -> "slot.output"."""

    watch: str
    columns: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, slot: str = "sampler", names: str = SAMPLED, **more: str) -> Windows:
        """The columns ``names`` of the Sampler socket, all by default, and ``more``: mean_y="sampler_y.mean"."""
        own = {n: f"{slot}.{n}" for n in names.split()}
        return cls(f"{slot}.count", {"phase": f"{slot}.window_phase", **own, **more})


@dataclass(frozen=True)
class OnRequest:
    """Slots that a system has only where they are asked for: a part is put into the first, or a parameter of it is set.

    Without them the system is the one it was: no FMU, no wire, no column more.  columns: further ones of the windows.
    instead_of: the lines of the system's wires that theirs replace.
    """

    slots: Mapping[str, Slot]
    wires: str
    columns: Mapping[str, str] = field(default_factory=dict)
    channels: tuple[str, ...] = ()
    instead_of: str = ""


@dataclass(frozen=True)
class MeasuredData:
    """Template and reader of a laboratory's record of a test.

    template: an empty record with its explanations, printed by ``gyrobench reduce SYSTEM --template``.
    read: (system, file, values) -> record; see gyrobench.system.lab_record for one that fits most tests.
    progress: the reader takes files of any length, Parquet as it is, and a fourth argument, which gets its progress.
    samples: header of a file of samples that the reader takes too, where attitudes are unknown.
    """

    template: str
    read: Callable[..., Record]
    progress: bool = False
    samples: str = ""


class System(Configurable):
    """Base class of the systems; see the module for how to declare one."""

    slots: ClassVar[Mapping[str, Slot]] = {}
    wires: ClassVar[str] = ""
    on_request: ClassVar[Mapping[str, OnRequest]] = {}  # by the name of their first slot
    open: ClassVar[tuple[str, ...]] = ()  # "slot.input" left at its start value on purpose: no note says so
    #: of wires: "a.y -> b.u" -> factor, SI to SI (rad/s into A, too), or a function of the parts that gives it
    factors: ClassVar[Mapping[str, float | Callable[[PartValues], float]]] = {}
    offsets: ClassVar[Mapping[str, float]] = {}  # of wires: added after the factor, SI
    raw: ClassVar[Mapping[str, Any]] = {}  # "slot.variable" -> start value in the FMU's own unit
    windows: ClassVar[Windows | None] = None
    done: ClassVar[str | None] = None  # "slot.output": the run ends when it is not 0
    channels: ClassVar[Iterable[str]] = ()  # "slot.output" recorded every channel_period
    #: channels that a report draws, a panel an entry: names, of a vector without its index; (): the first ones
    shown: ClassVar[Iterable[str]] = ()
    channel_period: float = 1.0  # s
    bodies: ClassVar[str] = ""  # what moves, as the record tells it: gyrobench.system.moving_bodies
    loops: ClassVar[Mapping[str, str]] = {}  # name -> "slot.input" where it is opened, see gyrobench.linear
    #: the figures depend on the communication step as those of loops do: the step check runs unless it is refused
    closed_loop: ClassVar[bool] = False
    #: a class, or the module beside system.py that has it as Reduction; its from_record(record) returns the findings;
    #: where a class names and inherits none, the module reduction.py if there is one
    reduction: ClassVar[str | type] = ""
    #: module beside system.py, its protocol_of(system, record) offers the test to gyrobench.design
    protocol: ClassVar[str] = ""
    #: part -> its slot, and the module beside system.py whose values_of(result) are parameter -> (value, standard
    #: uncertainty, unit), SI: for --fit-to
    fitted: ClassVar[Mapping[str, tuple[str, str]]] = {}
    noises: ClassVar[tuple[str, ...]] = ()  # "slot.parameter": with all of them 0 the run has no noise
    #: another system -> what its result says of options of this one, as texts; LookupError says what is missing
    takes: ClassVar[Mapping[str, Callable[[Result], Mapping[str, str]]]] = {}
    measured_data: ClassVar[MeasuredData | None] = None  # how a laboratory's record of this test is read
    #: "slot.parameter" whose value, of the system or the part, the method assumes; "?": of parts that have it
    assumed: ClassVar[tuple[str, ...]] = ()
    sampled_gyro: ClassVar[bool] = False  # a gyro with an output rate is read by its samples, each once
    maps: ClassVar[Mapping[str, Path]] = {}  # mapping files of the parts that an archive brings
    seed: int = 1  # of a run that names none
    instrument: str = ""  # of whose data sheet its gyro is; "": the part is named
    step: float = 1e-3  # s, communication step
    coupling: str = ""  # "parallel": every wire carries the value of the communication step before (Jacobi)
    stop: float | None = None  # s, or a property; None: only `done` ends the run

    def __init_subclass__(cls, **more: Any) -> None:
        super().__init_subclass__(**more)
        if "reduce" in vars(cls):
            raise TypeError(
                f"{cls.__name__}.reduce: what a record says, without limits and verdict, is returned by "
                "findings(record); reduce judges it, for every system alike"
            )
        file = getattr(sys.modules.get(cls.__module__), "__file__", None)
        if not cls.reduction and file and Path(file).with_name("reduction.py").is_file():
            cls.reduction = "reduction"
        if isinstance(cls.reduction, type):
            from gyrobench.system.declared_sources import take_sources

            take_sources(cls, cls.reduction)

    def __init__(self) -> None:
        super().__init__()
        self.overrides: dict[str, Any] = {}  # "slot.parameter" -> value as given
        #: the same as designs see it, of a design that is held at nominal values; None: it follows the parts
        self.nominal: dict[str, Any] | None = None

    def set(self, name: str, value: Any) -> None:
        """Set an option or, as "slot.parameter", a parameter of a part.  Raises InvalidValueError."""
        slot, dot, _ = name.partition(".")
        if dot:
            self.request(slot)
        if name in self.options:
            super().set(name, value)
        elif slot in self.slots and dot:
            self.overrides[name] = value  # parsed when the part and so the unit is known
            self._was_given(name)
        elif dot:
            raise InvalidValueError(f"{name}: no slot '{slot}'; {suggest_names(slot, self.all_slots())}")
        else:
            import difflib

            if name == "type_b":
                raise InvalidValueError(
                    "type_b: what measured data say of the set-up's uncertainties (reduce --data); the set-up of a run "
                    "is as ideal as its parameters, and the options u_... state what is not"
                )
            near = difflib.get_close_matches(name, list(self.options), n=3, cutoff=0.4) or list(self.options)
            raise InvalidValueError(
                f"{name}: no such option of {self.name}; options: {', '.join(near) or 'none'}; a parameter of a part "
                f"is written slot.parameter, slots: {', '.join(self.slots)}"
            )

    def request(self, slot: str) -> None:
        """Add the slots that :attr:`on_request` has under this name; nothing for any other, or where they are there."""
        wanted = self.on_request.get(slot)
        if wanted is None or slot in self.slots:
            return
        more: dict[str, Any] = {
            "slots": {**self.slots, **wanted.slots},
            "wires": f"{_without(self.wires, wanted.instead_of)}\n{wanted.wires}",
            "channels": (*self.channels, *wanted.channels),
        }
        if self.windows is not None:
            more["windows"] = replace(self.windows, columns={**self.windows.columns, **wanted.columns})
        vars(self).update(more)

    def place(self, slot: str, part: str | Path, bench: Path | None = None) -> None:
        """Make room for a part, the name of one of the bench or the file of an FMU, before it is put into its slot."""
        self.request(slot)

    def all_slots(self) -> dict[str, Slot]:
        """Return the slots, and those that can be asked for."""
        return {**self.slots, **{n: r.slots[n] for n, r in self.on_request.items() if n not in self.slots}}

    @classmethod
    def with_parts(cls, **parts: str) -> dict[str, Slot]:
        """Return the slots of a family with the parts of a system: ``RebalanceTest.with_parts(gyro="floated_gyro")``.

        Raises InvalidConfigurationError for a slot that the family does not have.
        """
        unknown = [
            f"no slot '{n}' in {cls.__name__}; slots: {', '.join(cls.slots)}" for n in parts if n not in cls.slots
        ]
        if unknown:
            raise InvalidConfigurationError(cls.__name__, unknown)
        return {name: replace(slot, part=parts.get(name, slot.part)) for name, slot in cls.slots.items()}

    def owned(self) -> dict[str, Any]:
        """Return the parameters that options own: "slot.parameter" -> value of the option."""
        return {name: self[key] for key, option in self.options.items() for name in option.sets.split()}

    # ------------------------------------------------------------ to be given by the system
    def plan(self) -> Plan | LoopPlan:
        """The phases; a system without a sequencer or an exciter has none."""
        return Plan()

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        """Return the parameters that follow from plan, options and parts: "slot.parameter" -> SI value or nested list.

        parts: the values that the parts in the slots have, ``parts["gyro.k"]``, for gains and plans that follow them.
        A scalar named "slot.parameter?" is set where the part has it, and not missed where it has not.
        """
        return {}

    def crossovers(self) -> dict[str, float]:
        """Return the crossover (Hz) that the options ask for, by loop; the linear model is held against it."""
        return {}

    def check(self) -> list[str]:
        """Return what makes a run with these values impossible or meaningless (the run is refused), as sentences."""
        return []

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        """Return problems as :meth:`check` does, from all parameters: {"slot.name": SI value, arrays nested}."""
        return []

    def warnings(self) -> list[str]:
        """Return what the user should know about these values, as sentences."""
        return []

    def reduction_object(self) -> Any:
        """Return what reduces a record (``from_record``): a class Reduction, or a module."""
        reduction: Any = self.reduction
        if not isinstance(reduction, str):
            return reduction
        from gyrobench.system.declared_sources import require_options

        module = self._beside("reduction", reduction)
        found = getattr(module, "Reduction", module)
        require_options(self, found, module.__name__)
        return found

    def _beside(self, declared: str, module: str) -> Any:
        """Return a module beside the system.py of the class that declares something."""
        owner = next(cls for cls in type(self).__mro__ if declared in vars(cls))
        return importlib.import_module(f".{module}", owner.__module__)

    def values_for(self, part: str, result: Result) -> tuple[str, Mapping[str, tuple[Any, Any, str]]]:
        """Return the slot of a part of :attr:`fitted`, and the values that a result gives it.  Raises UsageError."""
        slot, module = self.fitted[part]
        return slot, self._beside("fitted", module).values_of(result)

    def findings(self, record: Record) -> Result:
        """Return what a record says, without limits and verdict: estimates, and the reasons against them.

        By the reduction that the system names, unless a system overrides this method.  Raises UsageError for a system
        with neither, and for a record that lacks a column that is needed.
        """
        if not self.reduction:
            raise UsageError(f"{self.name} has no reduction")
        try:
            found: Result = self.reduction_object().from_record(record)
        except KeyError as error:
            if error.args[0] in record.windows or error.args[0] not in {c.name for c in WINDOW_COLUMNS}:
                raise
            raise UsageError(f"column '{error.args[0]}' is missing in the windows of the record") from None
        return found

    def reduce(
        self,
        record: Record,
        limits: Specification | None = None,
        step_check: StepCheck | None = None,
        reasons: Sequence[Reason] = (),
    ) -> Result:
        """Return the result of a record: its findings, judged.  Raises as :meth:`findings`.

        limits: coefficient -> low, high.  step_check: what the communication step does, to be part of u.  reasons:
        beside those of the findings.
        """
        from gyrobench.reduction.estimation.verdict import conclude
        from gyrobench.system.wire_text import parse_wires

        found = self.findings(record)
        wires = [] if record.run.measured else [f"{a}.{x} -> {b}.{y}" for a, x, b, y in parse_wires(self.wires)]
        drawn = {} if record.run.measured else {"wires": wires, "shown": list(self.shown)}
        return conclude(
            found, record, limits, step_check, system=self.name, title=found.title or self.title,
            provenance={**record.run.as_dict(), **drawn}, reasons=[*found.reasons, *reasons],
        )  # fmt: skip

    @property
    def has_reduction(self) -> bool:
        """False for a system whose runs end with the record."""
        return bool(self.reduction) or type(self).findings is not System.findings

    def read_measured(self, data: Path, values: Mapping[str, str]) -> Record:
        """Return a laboratory's file as a record; ``values``: options, and comments of the file, which they replace.

        Raises UsageError for a system that declares no measured data, and what the reader raises.
        """
        if self.measured_data is None:
            raise UsageError(f"{self.name} has no reduction of measured data")
        return self.measured_data.read(self, data, values)

    # ------------------------------------------------------------ used by the bench
    def unfinished(self) -> list[str]:
        lacks = super().unfinished()
        if empty := [slot for slot, s in self.slots.items() if not s.part]:
            parts = ", ".join(f'{slot}="..."' for slot in empty)
            lacks.append(f"slot {', '.join(empty)}: no part; name it by with_parts({parts})")
        named = self.reduction if isinstance(self.reduction, str) else ""
        lacks += [] if isinstance(self.reduction, str) else lacking_methods(self.reduction)
        if named and self.folder and not (self.folder / f"{named}.py").is_file():
            missing = f'reduction = "{named}": no file {named}.py in {self.folder}'
            lacks.append(f"{missing}; write a class Reduction with from_record(record) there")
        return lacks

    def refuse(self) -> None:
        """Raises InvalidConfigurationError when the plan or the values are impossible."""
        from gyrobench.system.declared_sources import misnamed_sources

        plan = self.plan()
        problems = [*(plan.problems() if plan.phases else []), *self.check(), *misnamed_sources(self)]
        if not (length := plan.duration()) < 1e12 * self.step:  # weeks at a million a second
            problems.append(f"{length:.3g} s in steps of {self.step:.3g} s: more than 1e+12 steps")
        if problems:
            raise InvalidConfigurationError(self.name, problems)

    def flat_parameters(self, parts: PartValues) -> dict[str, Any]:
        """Return :meth:`parameters` element by element: {"sequencer.mode[1]": 2, ...}."""
        return {k: v for name, value in self.parameters(parts).items() for k, v in flatten(name, value).items()}


def _without(wires: str, lines: str) -> str:
    gone = [line.split() for line in lines.splitlines()]
    return "\n".join(x for x in wires.splitlines() if not x.split() or x.split() not in gone)


def load_system(name: str, bench: Path | None = None) -> System:
    """Return the system ``name`` of a bench (see :class:`gyrobench.bench.Bench`) with its default values.

    Raises as :func:`gyrobench.system.configurable.load_configurable`, and UsageError for a suite.
    """
    system = load_configurable(name, bench)
    if not isinstance(system, System):
        raise UsageError(f"{name} is a suite of tests; gyrobench show {name} names them")
    return system
