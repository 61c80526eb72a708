"""The plan of a campaign: its runs, each known by a hash of all that determines its result.

That is: the system's files, the content of the FMUs in its slots, mapping files and parts' sources, values and options,
seed, step, acceptance specification, the measured file, and gyrobench itself (every file that computes).  Equal values
are equal however they are written: 0.3deg/h and 0.30 deg/h are one run.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gyrobench import units
from gyrobench.bench import Bench, UsageError, suggest_names
from gyrobench.campaign.execution.axes import MOST, QUANTITY, Axis, AxisValue, Distribution
from gyrobench.campaign.execution.bundle import Assigned, Bundle, digest_of, tool_digest
from gyrobench.campaign.execution.definition import Definition
from gyrobench.files import sha256
from gyrobench.packaging.own_controller import is_controller
from gyrobench.system.lab_record import STATED
from gyrobench.system.parameters import followed
from gyrobench.system.part_files import resolve_parts
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import InvalidConfigurationError, System
from gyrobench.system.values import InvalidValueError
from gyrobench.system.wiring import Assembly, assemble
from gyrobench.workflow.inputs import check_fmu_files, find_specification, require_slots

MEASURED = -1  # in the place of a setup


@dataclass(frozen=True)
class PlannedRun:
    """One run: its hash, its place, what is given to it, and what the axes show of it."""

    run: str
    index: int
    setup: int  # number of what a worker loads for it
    values: Mapping[str, Any]
    seed: int | None
    data: str | None
    shown: Mapping[str, float | str]  # axis -> value

    def columns(self, system: str) -> dict[str, Any]:
        """Return what the plan knows of the row of the run."""
        own = {"run": self.run, "index": self.index, "system": system, "seed": self.seed, "data": self.data}
        return {**own, **{f"in.{axis}": value for axis, value in self.shown.items()}}


@dataclass
class CampaignPlan:
    """All runs; setups: member of a suite ("" of a system) -> its parts, for each number of a run's setup."""

    definition: Definition
    axes: list[dict[str, Any]]
    runs: list[PlannedRun]
    setups: list[dict[str, Assigned]]
    bundle: Bundle
    spec: str | None  # in the bundle
    columns_map: str | None  # in the bundle
    repeated: int  # points that are the same run as another one
    notes: list[str] = field(default_factory=list)

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns of the axes."""
        return {f"in.{a['name']}": a["unit"] for a in self.axes if a["unit"]}

    def columns(self) -> dict[str, dict[str, Any]]:
        """Return run -> the columns that the plan knows."""
        return {r.run: r.columns(self.definition.system) for r in self.runs}

    def document(self) -> dict[str, Any]:
        """Return the content of campaign.json."""
        from gyrobench.record.run_document import package_versions

        d = self.definition
        kind = "suite" if self.is_suite else "system"
        parts = {slot: name for setup in self.setups for a in setup.values() for slot, name in a.parts.items()}
        return {
            "name": d.name,
            "question": d.question,
            kind: d.system,
            "definition": d.as_given(),
            "axes": self.axes,
            "options": {n: str(v) for n, v in d.set.items()},
            "parts": {slot: Path(name).stem for slot, name in sorted(parts.items())},
            "versions": dict(package_versions()),
            "created_with": f"gyrobench {package_versions()['gyrobench']}, {tool_digest()[:16]}",
        }

    @property
    def nominal(self) -> dict[str, Any] | None:
        """Return the values of parts that the design is held at; None where it follows the parts."""
        d = self.definition
        return {n: v for n, v in d.set.items() if "." in n} if d.fixed_design else None

    @property
    def is_suite(self) -> bool:
        return any(name for setup in self.setups for name in setup)


def make_plan(definition: Definition) -> CampaignPlan:
    """Return the plan; FMUs are built.  Raises UsageError and what the system raises for what no run can have."""
    return _Planner(definition, Bench.find()).plan()


class _Planner:
    def __init__(self, definition: Definition, bench: Bench) -> None:
        self.definition, self.bench = definition, bench
        if definition.system.endswith(".ssp"):
            raise UsageError(f"{definition.system}: a campaign runs systems of the bench; this is an archive")
        self.test: System | Suite = load_test(definition.system, bench.folder)
        self.bundle = Bundle()
        self.bundle.add_bench(bench)
        self.notes: list[str] = []
        self.setups: dict[str, tuple[int, dict[str, Assigned], str]] = {}  # by structure: number, parts, hash
        self.hashes: dict[tuple[str, ...], str] = {}
        self.names: list[str] = []

    def plan(self) -> CampaignPlan:
        d = self.definition
        slots = self._slots()
        axes, distributions = d.axes(list(slots))
        columns, rows = d.rows()
        varied = [*(a.name for a in (*axes, *columns) if a.kind != "part"), *(x.name for x in distributions)]
        self.names, self.varied = [*d.set, *varied], varied
        self._require_names()
        if d.fixed_design:
            self._require_fixed_design([a.name for a in (*axes, *columns) if a.kind == "part"])
        spec = find_specification(d.path(d.spec) if d.spec and d.path(d.spec).is_file() else d.spec)
        in_bundle = self.bundle.add(spec) if spec else None
        files = d.files()
        self.digests = {"tool": tool_digest(), "spec": sha256(spec) if spec else None}
        columns_map = self._columns_map()
        self.data = {str(f): sha256(f) for f in files}
        if files:
            if isinstance(self.test, Suite):
                raise UsageError(f"{d.system} is a suite; measured files are reduced by one of its tests")
            if self.test.measured_data is None:
                raise UsageError(f"{d.system} has no reduction of measured data")
        points = list(self._points(axes, distributions, columns, rows, files))
        runs: dict[str, PlannedRun] = {}
        for index, (shown, given, parts, file, seed) in enumerate(points):
            run = self._run(index, shown, given, parts, file, seed)
            first = runs.setdefault(run.run, run)
            if first is not run and file is not None and first.data:
                self.notes.append(f"{file.name} holds what {Path(first.data).name} holds: the two count once")
        setups = [assigned for _, assigned, _ in self.setups.values()]
        seeds = d.seed_list()
        described = [a.as_dict() for a in axes]
        described += [
            {"name": x.name, "kind": d.design, "unit": units.display(x.unit) if x.unit else ""} for x in distributions
        ]
        described += [
            {"name": c.name, "kind": "table", "unit": units.display(c.unit) if c.unit else ""} for c in columns
        ]
        if files:
            described.append({"name": "data", "kind": "data", "unit": "", "values": [f.name for f in files]})
        elif len(seeds) > 1:
            described.append({"name": "seed", "kind": "seed", "unit": "", "values": seeds})
        repeated = len(points) - len(runs)
        return CampaignPlan(
            d, described, list(runs.values()), setups, self.bundle, in_bundle, columns_map, repeated, self.notes
        )

    def _columns_map(self) -> str | None:
        """Return the column map of the measured files in the bundle; None where there is none."""
        if self.definition.columns is None:
            return None
        from gyrobench.record.column_map import read_map

        file = self.definition.path(self.definition.columns)
        read_map(file)
        if self.definition.data is None:
            raise UsageError(f"columns = {self.definition.columns}: of measured files; data names none")
        self.digests["columns"] = sha256(file)
        return self.bundle.add(file, f"columns/{file.name}")

    # ------------------------------------------------------------------------------------------ points
    def _points(
        self, axes: list[Axis], distributions: list[Distribution], columns: list[Axis],
        rows: list[tuple[Mapping[str, AxisValue], int | None]], files: list[Path],
    ) -> Iterator[tuple[dict[str, float | str], dict[str, Any], dict[str, str], Path | None, int | None]]:  # fmt: skip
        """Yield what is shown, values, parts, measured file and seed of each run."""
        d = self.definition
        seeds = d.seed_list()
        names = [a.name for a in axes] + [x.name for x in distributions] + [c.name for c in columns]
        if twice := {n for n in names if names.count(n) > 1}:
            raise UsageError(f"{sorted(twice)[0]}: an axis of that name stands twice")
        part_axes = {a.name for a in axes if a.kind == "part"}
        fixed = d.fixed_parts(list(self._slots()))
        drawn = d.drawn(distributions)
        if any(seed is not None for _, seed in rows) and (d.seeds != 1 or distributions):
            raise UsageError("the table has seeds of its own: leave out seeds, and distributions")
        count = math.prod(len(a.points) for a in axes) * len(drawn) * len(rows) * max(len(files), 1) * len(seeds)
        if count > MOST:
            raise UsageError(f"{count} runs; a campaign has up to {MOST}: fewer points or seeds, or draw them (runs)")
        grid = list(itertools.product(*(a.points for a in axes)))
        settings = dict(d.set)
        own = bool(distributions or d.table is not None)  # each point has noise of its own
        for place, (combination, sample, (row, row_seed), file) in enumerate(
            itertools.product(grid, drawn, rows, files or [None])  # type: ignore[list-item]
        ):
            at = {**dict(zip((a.name for a in axes), combination, strict=True)), **sample, **row}
            shown = {n: p.shown for n, p in at.items()}
            parts = {**fixed, **{n: str(p.given) for n, p in at.items() if n in part_axes}}
            values = {**settings, **{n: p.given for n, p in at.items() if n not in part_axes}}
            if file is not None:
                yield shown, values, parts, file, None
                continue
            # points of a grid are compared under equal noise: of them only the other blocks count
            block = place % (len(drawn) * len(rows)) if own else 0
            for k, seed in enumerate(seeds):
                number = seed if not own else (seeds[k] + block * (max(seeds) + 1 - min(seeds)))
                yield shown, values, parts, None, row_seed if row_seed is not None else number

    def _slots(self) -> set[str]:
        if isinstance(self.test, System):
            return set(self.test.all_slots())
        return {slot for _, members in self._suites() for system in members.values() for slot in system.all_slots()}

    def _require_names(self) -> None:
        """Raise UsageError for a name that is neither an option nor of a slot."""
        said = STATED if self.definition.data is not None else ()  # of a measured record, the reader knows which
        for name in self.names:
            if name in self.test.options or name in said:
                continue
            problems = [self._problem_of(name, *suite) for suite in self._suites()] or [self._problem_of(name)]
            if all(problems):
                raise UsageError(problems[0])

    def _problem_of(self, name: str, suite: Suite | None = None, members: Mapping[str, System] | None = None) -> str:
        """Return why nothing takes a value of this name, "" where something does."""
        try:
            if suite is None or members is None:
                self._systems({name: "1"})
            else:
                suite.passed = {name: "1"}
                suite.given_to(members)
        except InvalidValueError as error:
            return str(error)
        return ""

    def _suites(self) -> list[tuple[Suite, dict[str, System]]]:
        """Return the suite with each choice of tests that the campaign makes, and these tests; [] of a system."""
        if isinstance(self.test, System):
            return []
        given = {n: v for n, v in self.definition.set.items() if n in self.test.options}
        tests = self.definition.over.get("tests")
        chosen = [{}] if tests is None else [{"tests": t} for t in ([tests] if isinstance(tests, str) else tests)]
        suites = [self.test.with_values({**given, **c}) for c in chosen]
        return [(s, s.members(self.bench.folder)) for s in suites]

    # ------------------------------------------------------------------------------------------ a run
    def _run(
        self, index: int, shown: dict[str, float | str], given: dict[str, Any], parts: dict[str, str],
        file: Path | None, seed: int | None,
    ) -> PlannedRun:  # fmt: skip
        number, what = (MEASURED, self._files_of(self.test.name)) if file is not None else self._setup(given, parts)
        d, data = self.definition, str(file) if file is not None else None
        values = {name: _canonical(value) for name, value in given.items()}
        identity: list[Any] = [
            self.digests,
            what,
            values,
            seed,
            d.step,
            d.check_step,
            self.data[data] if data else None,
        ]
        if d.fixed_design:
            identity.append({n: _canonical(v) for n, v in d.set.items()})
        key = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()[:16]
        return PlannedRun(key, index, number, given, seed, data, shown)

    def _files_of(self, *names: str) -> str:
        """Return the hash of the files of systems."""
        if names not in self.hashes:
            folders = {n: self.bench.system_folder(n) for n in names}
            files = {f"{n}/{f.relative_to(d)}": f for n, d in folders.items() for f in sorted(d.rglob("*.py"))}
            self.hashes[names] = digest_of(files)
        return self.hashes[names]

    def _setup(self, given: Mapping[str, Any], parts: dict[str, str]) -> tuple[int, str]:
        """Return the number of what a worker loads for a run, and its hash: system or tests of a suite, with parts."""
        try:
            systems = self._systems(given)
        except (InvalidConfigurationError, InvalidValueError):  # the run will be refused
            systems = self._systems({})
        key = json.dumps([sorted(parts.items()), {n: structure(s) for n, s in systems.items()}], sort_keys=True)
        if key not in self.setups:
            swaps = self.test.swaps(systems, parts) if isinstance(self.test, Suite) else {"": parts}
            made = {n: self._assign(s, swaps[n]) for n, s in systems.items()}
            what = [self._files_of(self.test.name, *filter(None, made)), {n: vars(a) for n, a in made.items()}]
            digest = hashlib.sha256(json.dumps(what, sort_keys=True).encode()).hexdigest()
            self.setups[key] = len(self.setups), made, digest
        number, _, digest = self.setups[key]
        return number, digest

    def _systems(self, given: Mapping[str, Any]) -> dict[str, System]:
        """Return what a run consists of: the system under "", or the tests of the suite by name."""
        test: System | Suite = self.test.with_values(given)
        return test.members(self.bench.folder) if isinstance(test, Suite) else {"": test}

    def _assign(self, system: System, parts: Mapping[str, str]) -> Assigned:
        """Build the parts of a system, check that they fit, and put them into the bundle."""
        require_slots(system)
        for slot, name in parts.items():
            if is_controller(name):
                fmu = f"fmus/{Path(name).stem}{'-python' if name.endswith('.py') else ''}.fmu"
                raise UsageError(f"{slot}: {name}: workers compile no files: gyrobench build {name}, and name {fmu}")
        files = {s: str(self.definition.path(p)) if p.endswith(".fmu") else p for s, p in parts.items()}
        check_fmu_files(files)
        maps = {}
        for name, file in self.definition.maps.items():
            path = self.definition.path(file)
            if not path.is_file():
                raise UsageError(f"maps: {name} = {file}: no such file")
            maps.update({s: path for s in system.slots if s == name or parts.get(s) == name})
        paths, _ = resolve_parts(system, files, "native", self.bench.folder, self.notes)
        assembly = assemble(system, paths, maps)
        if isinstance(self.test, System):
            self._require_parameters(assembly)
            self._note_design(assembly, system)
        inside = {slot: self.bundle.add(path) for slot, path in paths.items()}
        names = {s: str(files.get(s, slot.part)) for s, slot in system.slots.items()}
        built = {names[s]: inside[s] for s in paths if not names[s].endswith(".fmu")}
        given = {s: inside[s] if names[s].endswith(".fmu") else names[s] for s in files}
        return Assigned(given, built, {s: self.bundle.add(f) for s, f in maps.items()})

    def _require_fixed_design(self, swapped: list[str]) -> None:
        """Raise UsageError where there is no design to hold."""
        if isinstance(self.test, Suite) or self.definition.data is not None:
            raise UsageError("fixed design: of one system that is simulated, not of a suite or of measured files")
        if swapped:
            raise UsageError(f"fixed design: {swapped[0]} is an axis of parts; a design is held at values of one part")
        if all(name in self.test.options for name in self.varied):
            raise UsageError("fixed design: no parameter of a part is varied (slot.parameter); options are the design")

    def _note_design(self, assembly: Assembly, system: System) -> None:
        """Note the axes that the design of the system follows."""
        moved = sorted(followed(assembly, system) & {n.partition("[")[0] for n in self.varied})
        if moved and not self.definition.fixed_design:
            self.notes += [
                f"{name}: the design of {system.name} follows it, so that each point has parameters of its own (the "
                "gain of a loop, say); --fixed-design (fixed_design = true) asks what one design does at all of them"
                for name in moved
            ]

    def _require_parameters(self, assembly: Assembly) -> None:
        """Raise UsageError for a varied or fixed parameter that the part in its slot does not have."""
        for name in self.names:
            slot, dot, parameter = name.partition(".")
            if dot and slot in assembly.bindings and name not in self.test.options:
                binding = assembly.bindings[slot]
                known = {n.partition("[")[0] for n in (*binding.parameters, *binding.inputs)}
                if parameter.partition("[")[0] not in known:
                    raise UsageError(f"{name}: {slot} has no such parameter; {suggest_names(parameter, sorted(known))}")


def structure(system: System) -> list[Any]:
    """Return what a loaded session of a system rests on beside the FMUs: equal ones can share it."""
    windows = system.windows
    slots = [[n, str(s.socket), s.part, dict(s.quantities)] for n, s in system.slots.items()]
    columns = [windows.watch, dict(windows.columns)] if windows else []
    return [slots, " ".join(system.wires.split()), list(system.channels), columns, system.done]


def _canonical(value: Any) -> list[Any]:
    """Return a value as it is told from others: a number with its unit in SI, whatever the unit."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        return [float(value), ""]
    match = QUANTITY.fullmatch(str(value).strip())
    if match is None:
        return [str(value).strip()]
    name = match[2].strip()
    try:
        unit = units.unit(name) if name else None
    except units.UnitError:
        return [str(value).strip()]
    if unit is None:
        return [float(match[1]), "no unit"]  # may be questioned, where a number of Python is SI
    return [units.convert(float(match[1]), name, unit.dimension), unit.dimension]
