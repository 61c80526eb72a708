"""Reference runs: a short rich run of a part, kept beside it, which every target repeats bit for bit.

``components/<part>/reference.csv``::

    # floated_gyro 1.0.0
    # step 0.001
    # parameter seed 7
    time,omega[1],...,u,...
    0.0,0.001,...,1.2e-05,...

The comments hold the part and its version, the communication step, and every parameter that differs from its
default.  A row is one communication point: the inputs set there, and the outputs read after that; then comes
the step to the next row.  Floats are written with all their digits, which are the same on every platform.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from gyrobench.component import Component, Scalar
from gyrobench.files import write_whole
from gyrobench.packaging.instance import Instance, Plain, make
from gyrobench.packaging.loading import load_part

Signal = Callable[[float], float]  # of the time, s

#: amplitude of the generated input signals by unit; others: 1 for a quantity, none for the unit "1"
AMPLITUDES = {"rad/s": 1e-3, "rad/s2": 1e-3, "m/s2": 12.0, "A": 2e-3, "V": 2e-2, "rad": 0.5, "1": 0.0}


@dataclass
class Reference:
    """Content of a reference file: ``inputs`` and ``outputs`` by FMI name, one value a row."""

    part: str
    version: str
    step: float
    parameters: dict[str, float]
    time: list[float]
    inputs: dict[str, list[float]]
    outputs: dict[str, list[float]]


def read_reference(path: Path) -> Reference:
    """Return the content of a file.  Raises ValueError, with the path, where it is not a reference file."""
    comments: list[list[str]] = []
    lines: list[str] = []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            comments.append(line[1:].split())
        else:
            lines.append(line)
    rows = list(csv.reader(lines))
    try:
        (part, version), *settings = comments
        step = next(float(c[1]) for c in settings if c[0] == "step")
        parameters = {c[1]: float(c[2]) for c in settings if c[0] == "parameter"}
        count = next(int(c[1]) for c in settings if c[0] == "inputs")
        columns = {n: [float(r[k]) for r in rows[1:]] for k, n in enumerate(rows[0])}
    except (ValueError, StopIteration, IndexError) as e:
        raise ValueError(f"{path} is not a reference file: {e}") from e
    names = list(columns)[1:]
    return Reference(
        part,
        version,
        step,
        parameters,
        columns["time"],
        {n: columns[n] for n in names[:count]},
        {n: columns[n] for n in names[count:]},
    )


def signal(s: Scalar, place: int, duration: float) -> Signal:
    """Return the generated signal of one input: a sine, a ramp and a step about its start value."""
    size = AMPLITUDES.get(s.decl.unit, 1.0) if s.decl.type is float else 0.0
    cycles = 3.0 + 1.7 * place
    jump = (0.2 + 0.6 * ((0.37 * place) % 1.0)) * duration

    def at(t: float) -> float:
        x = 0.4 * math.sin(2.0 * math.pi * cycles * t / duration) + 0.3 * t / duration
        return s.start + size * (x + (0.3 if t >= jump else 0.0))

    return at


def run(instance: Instance, reference: Reference, outputs: Sequence[str]) -> list[list[float]]:
    """Run an instance over the inputs of a reference; return its outputs, a list for each row."""
    instance.set(reference.parameters)
    rows: list[list[float]] = []
    for k, t in enumerate(reference.time):
        if k:
            instance.step(reference.time[k - 1], reference.step)
        instance.set({n: x[k] for n, x in reference.inputs.items()})
        if not k:
            instance.initialize(t)
        rows.append(instance.get(outputs))
    return rows


def write_reference(
    part: str | type[Component],
    path: Path,
    *,
    parameters: Mapping[str, float] | None = None,
    step: float | None = None,
    rows: int = 201,
    signals: Mapping[str, Signal | Sequence[float]] | None = None,
    bench: Path | None = None,
) -> Path:
    """Write (again) the reference run of a part, made by its plain class; return the path.

    Parameters, step and inputs are those given, else those of the file that is there, else the defaults, 1 ms
    and generated signals.  ``signals`` gives inputs by FMI name, as functions of time or one value a row.
    """
    cls = load_part(part, bench) if isinstance(part, str) else part
    old = read_reference(path) if path.exists() else None
    h = step if step is not None else old.step if old else 1e-3
    count = len(old.time) if old and not signals else rows
    time = [k * h for k in range(count)]
    inputs: dict[str, list[float]] = {}
    for place, s in enumerate(x for x in cls.layout if x.section == "input"):
        given = (signals or {}).get(s.name)
        if given is None and old and not signals and s.name in old.inputs:
            given = old.inputs[s.name]
        if given is None:
            given = signal(s, place, time[-1])
        inputs[s.name] = [float(x) for x in (map(given, time) if callable(given) else given)]
    values = dict(parameters if parameters is not None else old.parameters if old else {})
    starts = {s.name: s.start for s in cls.layout}
    values = {n: float(x) for n, x in values.items() if float(x) != starts[n]}
    outputs = [s.name for s in cls.layout if s.section == "output"]
    name = part if isinstance(part, str) else path.parent.name
    new = Reference(name, cls.version, h, values, time, inputs, {})
    table = run(Plain(cls), new, outputs)

    text = io.StringIO()
    text.write(f"# {name} {cls.version}\n# step {h!r}\n# inputs {len(inputs)}\n")
    text.writelines(f"# parameter {n} {x!r}\n" for n, x in values.items())
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time", *inputs, *outputs])
    for k, t in enumerate(time):
        writer.writerow([repr(x) for x in (t, *(column[k] for column in inputs.values()), *table[k])])
    write_whole(path, text.getvalue().encode())
    return path


def compare(reference: Reference, instance: Instance, label: str) -> list[str]:
    """Repeat a reference run with an instance; return the differences, in words (empty: equal bit for bit)."""
    outputs = list(reference.outputs)
    table = run(instance, reference, outputs)
    problems: list[str] = []
    for j, name in enumerate(outputs):
        unequal = [k for k, row in enumerate(table) if row[j] != reference.outputs[name][k]]
        if unequal:
            k = unequal[0]
            problems.append(
                f"{label}: {name} at t = {reference.time[k]:.9g} s is {table[k][j]!r}, not "
                f"{reference.outputs[name][k]!r} ({len(unequal)} of {len(table)} rows differ)"
            )
    return problems


def outdated(reference: Reference, names: Mapping[str, Sequence[str]]) -> list[str]:
    """Return a message if a file has other inputs or outputs than the part now (``names``: section -> FMI names)."""
    if list(names["input"]) == list(reference.inputs) and list(names["output"]) == list(reference.outputs):
        return []
    return [f"reference.csv has other inputs or outputs than {reference.part}: write it again"]


def run_reference(
    path: Path, target: str = "plain", *, part: str | type[Component] | None = None, bench: Path | None = None
) -> list[str]:
    """Repeat a reference run in one of the targets; return the differences, in words (empty: equal bit for bit).

    ``target``: plain, python, native or native-fmi3.  The part is that of the folder the file stands in.
    """
    reference = read_reference(path)
    if part is None:
        part, bench = path.parent.name, bench or path.parent.parent.parent
    cls = load_part(part, bench) if isinstance(part, str) else part
    old = outdated(reference, {k: [s.name for s in cls.layout if s.section == k] for k in ("input", "output")})
    if old:
        return old
    instance = make(part, target, bench=bench)
    try:
        return compare(reference, instance, target)
    finally:
        instance.free()
