"""The definition of a campaign: what is run, from a TOML file, the command line or Python.

    name = "latitudes"                      # default: the name of the file
    question = "Up to which latitude does the tumble determine D_I?"
    system = "..."                          # a system or a suite
    seeds = 20                              # seeds 1 to 20 at each point; or a list
    keep = "failures"                       # records and reports: all, failures, extremes, none

    [set]                                   # values of all runs, as of gyrobench run --set @FILE
    latitude = "45.75deg"

    [over]                                  # axes, see gyrobench.campaign.execution.axes
    latitude = "0deg..80deg:9"
    "gyro.D_I" = "uniform(-1, 1) deg/h/g"

    [parts]                                 # a list is an axis
    gyro = ["floated", "vendor.fmu"]

Every point of an axis is combined with every point of the others.  Distributions are drawn together, ``runs`` points by
``design`` ("random", "lhs", "sobol") and ``design_seed``.  ``table``: a CSV file, one row a point, columns
"name [unit]", and "seed" if it is given; or "FILE.py:function", which returns such rows as dictionaries (values in SI
or texts), called with the ``arguments``.  ``data``: pattern of measured files, one run a file; ``columns``: their
column map.

fixed_design: what a system derives from its parts (the gain of a loop from an inertia) is derived once, at the values
of ``set`` and of the parts; else it follows the parts to every point, which is then a design of its own.

Noise: at the points of grids and lists each seed is used once a point, so that points are compared under equal noise;
points that are drawn, and rows of a table, have seeds of their own.
"""

from __future__ import annotations

import glob
import importlib.util
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from gyrobench import reading
from gyrobench.bench import UsageError, suggest_names
from gyrobench.campaign.execution.axes import (
    DESIGNS,
    MOST,
    Axis,
    AxisValue,
    Distribution,
    check_value,
    draw,
    parse_axis,
)
from gyrobench.campaign.execution.definition_files import as_texts, flat, memory, plain, problem_of, read_table
from gyrobench.errors import GyrobenchError
from gyrobench.reading import shorten
from gyrobench.system.values import parse_number

KEEP = ("all", "failures", "extremes", "none")


def _plain_text(value: str | Path) -> str | Path:
    if "\0" in str(value):
        raise ValueError("a null character, which no name has")
    return value


Text = Annotated[str, AfterValidator(_plain_text)]
File = Annotated[str | Path, AfterValidator(_plain_text)]
#: a value, or a table of them: what it means is found when the test is known
Values = dict[str, Annotated[Any, AfterValidator(check_value)]]
Count = Annotated[int, Field(ge=0, le=MOST)]


class CampaignFile(BaseModel):
    """The keys of a definition and the types of their values."""

    model_config = ConfigDict(extra="forbid")

    system: Text
    name: Text = ""
    question: str = ""
    set: Values = {}
    over: Values = {}
    parts: dict[str, Text | list[Text]] = {}
    maps: dict[str, File] = {}
    seeds: Any = 1  # a number of seeds, or a list: see Definition.seed_list
    runs: Count = 0
    design: Text = "random"
    design_seed: Annotated[int, Field(ge=0, lt=1 << 32)] = 1
    table: File | list[dict[str, Any]] | tuple[dict[str, Any], ...] | None = None
    arguments: dict[str, Any] = {}
    data: File | list[File] | None = None
    columns: File | None = None
    step: float | str | None = None
    check_step: bool | None = None
    fixed_design: Any = False  # Definition checks it
    spec: File | None = None
    keep: Text = "failures"
    time_limit: float | str = "1h"
    memory_limit: float | str | None = None
    retries: Count = 2
    out: File | None = None


@dataclass
class Definition:
    """A campaign as it is asked for; see the module for the keys of a file.

    folder: that relative paths start from.  time_limit: s of one run.  memory_limit: bytes of a worker.  retries: how
    often a run is repeated whose worker ended.
    """

    system: str
    name: str = ""
    question: str = ""
    set: dict[str, Any] = field(default_factory=dict)
    over: dict[str, Any] = field(default_factory=dict)
    parts: dict[str, Any] = field(default_factory=dict)
    maps: dict[str, str] = field(default_factory=dict)
    seeds: Any = 1
    runs: int = 0
    design: str = "random"
    design_seed: int = 1
    table: Any = None
    arguments: dict[str, Any] = field(default_factory=dict)
    data: Any = None
    columns: str | None = None
    step: Any = None
    check_step: bool | None = None
    fixed_design: bool = False
    spec: str | None = None
    keep: str = "failures"
    time_limit: Any = "1h"
    memory_limit: Any = None
    retries: int = 2
    out: str | None = None
    folder: Path = field(default_factory=Path.cwd)

    def __post_init__(self) -> None:
        if self.keep not in KEEP:
            raise UsageError(f"keep = {self.keep}: {suggest_names(str(self.keep), KEEP)}")
        if self.design not in DESIGNS:
            raise UsageError(f"design = {self.design}: {suggest_names(str(self.design), DESIGNS)}")
        if not isinstance(self.fixed_design, bool):
            raise UsageError(f"fixed_design = {self.fixed_design}: true or false is expected")
        if not isinstance(self.retries, int) or self.retries < 0:
            raise UsageError(f"retries = {self.retries}: a whole number from 0 on is expected")
        self.time_limit = parse_number("time_limit", self.time_limit, "s")
        self.memory_limit = None if self.memory_limit is None else memory(self.memory_limit)
        self.step = None if self.step is None else parse_number("step", self.step, "s")
        self.set, self.over = flat(self.set), flat(self.over)
        self.name = self.name or self.system

    def path(self, name: str | Path) -> Path:
        """Return a path as it is meant in the file of the campaign."""
        return self.folder / name

    def as_given(self) -> dict[str, Any]:
        """Return what was given, as plain JSON."""
        own = {f.name: plain(getattr(self, f.name)) for f in fields(self) if f.name not in ("folder", "out")}
        if isinstance(self.table, list | tuple):
            own["table"] = f"{len(self.table)} rows"
        standard = {f.name: f.default for f in fields(self)}
        return {k: v for k, v in own.items() if v != standard[k] and v not in ({}, None)}

    # ------------------------------------------------------------------------------------------ points
    def axes(self, slots: Sequence[str]) -> tuple[list[Axis], list[Distribution]]:
        """Return the axes and the distributions; a name of ``over`` that is a slot is an axis of parts."""
        found = [parse_axis(name, given) for name, given in self.over.items() if name not in slots]
        swapped = {**{n: v for n, v in self.over.items() if n in slots}, **self.parts}
        lists = {s: _names(s, v) for s, v in swapped.items()}
        parts = [
            Axis(slot, "part", "", tuple(AxisValue(p.strip(), p.strip()) for p in names))
            for slot, names in lists.items()
            if len(names) > 1
        ]
        axes = [a for a in found if isinstance(a, Axis)]
        if clash := {a.name for a in axes} & set(self.set):
            raise UsageError(f"{sorted(clash)[0]}: both in [set] and in [over]; leave out one")
        return [*axes, *parts], [a for a in found if isinstance(a, Distribution)]

    def fixed_parts(self, slots: Sequence[str]) -> dict[str, str]:
        """Return the part of each slot that has one for all runs."""
        given = {**{n: v for n, v in self.over.items() if n in slots}, **self.parts}
        lists = {s: _names(s, v) for s, v in given.items()}
        return {slot: names[0].strip() for slot, names in lists.items() if len(names) == 1}

    def drawn(self, axes: Sequence[Distribution]) -> list[Mapping[str, AxisValue]]:
        """Return the points of all distributions; one without values where there is none."""
        if not axes:
            if self.runs:
                raise UsageError(f"runs = {self.runs}: nothing is drawn; write a distribution: uniform(0, 1) deg/h")
            return [{}]
        if self.runs < 1:
            raise UsageError(f"{axes[0].name}: how many points are drawn?  runs = 100 (--runs 100)")
        return draw(axes, self.runs, self.design, self.design_seed)

    def seed_list(self) -> list[int]:
        """Return the seeds of a point."""
        if isinstance(self.seeds, int) and not isinstance(self.seeds, bool) and 0 < self.seeds <= MOST:
            return list(range(1, self.seeds + 1))
        if isinstance(self.seeds, list | tuple | range) and self.seeds:
            seeds = list(self.seeds)
            if all(type(s) is int and 0 <= s < 1 << 63 for s in seeds) and len(set(seeds)) == len(seeds):
                return seeds
        given = shorten(str(self.seeds))
        raise UsageError(
            f"seeds = {given}: a number of seeds from 1 to {MOST}, or a list of different ones, is expected"
        )

    def files(self) -> list[Path]:
        """Return the measured files, in the order of their names.  Raises UsageError where there are none."""
        if self.data is None:
            return []
        patterns = [self.data] if isinstance(self.data, str | Path) else list(self.data)
        found: list[Path] = []
        for pattern in patterns:
            names = sorted(glob.glob(str(self.path(pattern)), recursive=True))
            if not names:
                raise UsageError(f"data = {pattern}: no such file")
            found += [Path(n) for n in names]
        return list(dict.fromkeys(found))

    def rows(self) -> tuple[list[Axis], list[tuple[Mapping[str, AxisValue], int | None]]]:
        """Return the columns of the table as axes without points, and its rows with their seeds."""
        if self.table is None:
            return [], [({}, None)]
        if isinstance(self.table, str | Path) and ".py:" in str(self.table):
            content = self._called(str(self.table))
        elif isinstance(self.table, str | Path):
            content = read_table(self.path(self.table))
        else:
            try:
                content = [dict(row) for row in self.table]
            except (TypeError, ValueError):
                raise UsageError(f"table = {shorten(str(self.table))}: rows of names and values are expected") from None
        if not content:
            raise UsageError(f"table = {self.table}: has no rows")
        seeds = [_row_seed(k, row.pop("seed", None)) for k, row in enumerate(content, 1)]
        names = list(dict.fromkeys(name for row in content for name in row))
        axes = {}
        for name in names:
            axis = parse_axis(name, [row[name] for row in content if row.get(name) is not None])
            assert isinstance(axis, Axis)
            axes[name] = iter(axis.points), Axis(name, "table", axis.unit, ())
        rows: list[tuple[Mapping[str, AxisValue], int | None]] = [
            ({n: next(axes[n][0]) for n in names if row.get(n) is not None}, s)
            for row, s in zip(content, seeds, strict=True)
        ]
        return [axis for _, axis in axes.values()], rows

    def _called(self, where: str) -> list[dict[str, Any]]:
        """Return the rows that a function of a Python file makes."""
        name, _, function = where.rpartition(":")
        file = self.path(name)
        if not file.is_file():
            raise UsageError(f"table = {where}: no such file {file}")
        import sys

        spec = importlib.util.spec_from_file_location(f"gyrobench_table_{file.stem}", file)
        assert spec is not None and spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module  # its dataclasses look for it
        try:
            spec.loader.exec_module(module)
            if not hasattr(module, function):
                raise UsageError(f"table = {where}: no function {function} in {file}")
            return [dict(row) for row in getattr(module, function)(**self.arguments)]
        except GyrobenchError:
            raise
        except (Exception, SystemExit) as error:  # of the user's code
            raise UsageError(f"table = {where}: {type(error).__name__}: {error}") from error


def _names(slot: str, given: Any) -> list[str]:
    """Return the parts of a slot.  Raises UsageError for anything but names."""
    names = given.split(",") if isinstance(given, str) else given
    if not isinstance(names, list | tuple) or not names or not all(isinstance(n, str) for n in names):
        raise UsageError(f"{slot} = {shorten(repr(given))}: the name of a part or the file of an FMU is expected")
    return list(names)


def _row_seed(row: int, given: Any) -> int | None:
    if given is None:
        return None
    try:
        seed = int(given)
    except (TypeError, ValueError):
        seed = -1
    if not 0 <= seed < 1 << 63:
        raise UsageError(f"row {row} of the table: seed = {shorten(str(given))}: a whole number from 0 is expected")
    return seed


def read_definition(file: Path) -> Definition:
    """Return the definition in a TOML file.  Raises UsageError."""
    content = reading.toml(reading.read_text(file, UsageError), file, UsageError)
    content.setdefault("name", file.stem)
    for table in {"set", "over"} & content.keys():
        content[table] = as_texts(content[table])
    return from_mapping(content, file.parent, str(file))


def from_mapping(content: Mapping[str, Any], folder: Path | None = None, where: str = "campaign") -> Definition:
    """Return the definition in a dictionary with the keys of a file.  Raises UsageError."""
    known = [f.name for f in fields(Definition) if f.name != "folder"]
    content = dict(content)
    if "suite" in content:
        content["system"] = content.pop("suite")
    for key in content:
        if key not in known:
            raise UsageError(f"{where}: unknown key '{key}'; {suggest_names(str(key), known)}")
    if not isinstance(content.get("system"), str):
        raise UsageError(f'{where}: what is run?  system = "NAME", see gyrobench list')
    try:
        typed = CampaignFile.model_validate(content).model_dump(exclude_unset=True)
        return Definition(**typed, folder=folder or Path.cwd())
    except ValidationError as error:
        raise UsageError(f"{where}: {problem_of(error)}") from None
    except UsageError as error:
        raise UsageError(f"{where}: {error}") from None
