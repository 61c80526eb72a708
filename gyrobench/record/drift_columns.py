"""Tables of drift records: which columns are a rate, an angle, a force or counts, and their rows in blocks.

    # scale = 0.5arcsec
    time [s],counts x [1],counts y [1],temperature [degC]

CSV, Parquet (columns named "name [unit]", or the unit in the field's metadata; comments in the file's), or the folder
of a run.  A column is a rate, an angle or a specific force by its unit, or by ``scale``, what one of its
units is.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.circumstances import Statement
from gyrobench.record.csv_reader import CsvColumn, DataError, Head, for_arrow, header_places, read_head, regular
from gyrobench.record.log_files import as_text, is_log
from gyrobench.record.record import Record
from gyrobench.record.time_series import read_blocks

Blocks = Iterator[dict[str, Array]]
TIME, FLAG = "time", "flag"
ROWS = 1 << 18  # of a block of a Parquet file
BUFFER = 1 << 20  # bytes of a column read at a time
RATE, ANGLE, FORCE = "rate", "angle", "force"
KINDS = {RATE: "rad/s", ANGLE: "rad", FORCE: "m/s2"}
INCREMENT, VELOCITY = "angle of each sample", "velocity of each sample"
INCREMENTS = {RATE: "rad/s", INCREMENT: "rad", FORCE: "m/s2", VELOCITY: "m/s"}
DIRECT = (RATE, FORCE)  # what a sample reads is analysed, not its differences
#: how the angle, or the velocity, of each sample is called
OF_EACH = re.compile(r"(?i)Δ.*|.*(incr|delta|integral).*|d_?(theta|th|ang\w*|rot\w*|phi|v(el\w*)?)(_?[xyz])?")
SIGNALS = (
    "a drift record holds a rate [deg/h], an angle [arcsec], a specific force [g], or another quantity with "
    "'# scale = 17.2deg/h/mA'"
)


@dataclass(frozen=True)
class Signal:
    """A column to reduce: SI value * factor is rad/s, rad (cumulative, or of each sample), m/s2 or m/s (of each)."""

    name: str
    unit: str  # as in the file
    kind: str
    factor: float

    @property
    def reduced(self) -> str:
        """The SI unit of what is analysed."""
        return KINDS[FORCE if self.kind in (FORCE, VELOCITY) else RATE]


@dataclass(frozen=True)
class DriftTable:
    """A table of unknown length.  blocks(columns): rows in SI, missing cells as NaN; size: rows, 0 where not known."""

    source: Path
    head: Head
    size: int
    blocks: Callable[[Sequence[CsvColumn]], Blocks]

    def done(self, rows: int) -> float:
        """Return the part of the table that so many rows are."""
        return rows / self.size if self.size else 0.0


def open_table(source: Path, channel: str = "") -> DriftTable:
    """Return a CSV or Parquet file, or of a run's folder its windows, or its channels where ``channel`` is one of them.

    Raises DataError for anything else, RecordError for a folder that is not a run.
    """
    if source.is_dir():
        return _of_run(Record.load(source), source, channel)
    if not regular(source).is_file():
        raise DataError(source, ["no such file; name a CSV or Parquet file, or the folder of a run"])
    if source.stat().st_size == 0:
        raise DataError(source, ["the file is empty"])
    with source.open("rb") as file:
        parquet = file.read(4) == b"PAR1"
    if parquet or source.suffix == ".parquet":
        return _of_parquet(source)
    head = read_head(source)
    return DriftTable(source, head, _rows_of_csv(source, head), lambda columns: read_blocks(source, head, columns))


def _rows_of_csv(source: Path, head: Head) -> int:
    """Return the number of rows, from the length of the first ones; only for the progress."""
    with source.open("rb") as lines:
        for _ in range(head.line):
            next(lines)
        start = lines.tell()
        sample = lines.read(1 << 16)
    count = sample.count(b"\n")
    return int((source.stat().st_size - start) * count / len(sample)) if count else 0


def _of_parquet(source: Path) -> DriftTable:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        # neither mapped nor read ahead: both keep the whole of a long file in memory
        file = pq.ParquetFile(for_arrow(source), buffer_size=BUFFER, pre_buffer=False)
    except (pa.ArrowInvalid, OSError) as error:
        raise DataError(source, [f"not a readable Parquet file: {error}"]) from None
    schema = file.schema_arrow
    if is_log(source) and any(pa.types.is_temporal(field.type) for field in schema):  # dates become seconds
        return open_table(as_text(source))
    names, problems = [], []
    for field in schema:
        unit = (field.metadata or {}).get(b"unit", b"").decode()
        names.append(f"{field.name} [{unit}]" if unit and "[" not in field.name else field.name)
    stated = [Statement(0, k.decode("utf-8", "replace"), v.decode("utf-8", "replace"))
              for k, v in (schema.metadata or {}).items() if k not in (b"ARROW:schema", b"pandas")]  # fmt: skip
    head = Head(names, stated, 0, ",", False)

    def blocks(columns: Sequence[CsvColumn]) -> Blocks:
        places, wrong = header_places(names, {c.name: c for c in columns})
        for name, (k, _) in places.items():
            kind = schema.field(k).type
            if not (pa.types.is_integer(kind) or pa.types.is_floating(kind) or pa.types.is_boolean(kind)):
                wrong.append(f"column '{name}': holds {kind}, numbers are expected")
        if wrong:
            raise DataError(source, wrong)
        asked = [schema.field(k).name for k, _ in places.values()]
        try:
            for batch in file.iter_batches(ROWS, columns=asked):
                yield {n: f.to_si(_numbers(batch.column(schema.field(k).name))) for n, (k, f) in places.items()}
        except (pa.ArrowInvalid, OSError) as error:
            raise DataError(source, [f"not a readable Parquet file: {error}"]) from None

    if not file.metadata.num_rows:
        problems.append("no rows below the header")
    if problems:
        raise DataError(source, problems)
    return DriftTable(source, head, file.metadata.num_rows, blocks)


def _numbers(column: Any) -> Array:
    return np.asarray(column.to_numpy(zero_copy_only=False), dtype=float)


def _of_run(record: Record, source: Path, channel: str) -> DriftTable:
    """The windows of a run, which are means (time: the middle of each), or its channels, which are point samples."""
    columns, of = record.table("channels")
    if "t_start" in record.windows and not (channel and channel.replace(",", " ").split()[0] in columns):
        columns, of = record.table("windows")
        columns = {TIME: 0.5 * (columns["t_start"] + columns["t_end"]), **columns}
        of = {**of, TIME: "s"}
    heads = [f"{n} [{of[n]}]" if of.get(n) not in ("", "1", None) else n for n in columns]
    about = [Statement(0, "instrument", record.run.instrument)] if record.run.instrument else []
    head = Head(heads, about, 0, ",", False)

    def blocks(asked: Sequence[CsvColumn]) -> Blocks:
        yield {c.name: np.asarray(columns[c.name], dtype=float) for c in asked if c.name in columns}

    return DriftTable(source, head, len(next(iter(columns.values()), ())), blocks)


def harmonic_names(order: int) -> list[str]:
    """Return the names of the columns of :func:`with_harmonics`: cosθ, sinθ, cos2θ ..."""
    return [f"{f}{n if n > 1 else ''}θ" for n in range(1, order + 1) for f in ("cos", "sin")]


def with_harmonics(table: DriftTable, column: str, order: int) -> DriftTable:
    """Return the table with cos nθ and sin nθ, n = 1 ... ``order``, in place of a column of angles θ.

    Raises DataError for a column that is missing or no angle, and for angles so far apart that n θ is not followed.
    """
    there = named(table.head)
    if column not in there:
        raise DataError(table.source, [f"column '{column}' is missing; columns of the file: {', '.join(there)}"])
    unit = there[column] or "1"
    if units.unit(unit).exponents != units.unit("rad").exponents or unit == "1":
        raise DataError(table.source, [f"column '{column}': [{unit}] is no angle; write '{column} [deg]'"])
    angle, names = CsvColumn(column, "rad", "angle of the table"), harmonic_names(order)
    rest = [n for n in table.head.names if n.partition("[")[0].strip() != column]
    head = replace(table.head, names=[*rest, *(f"{n} [1]" for n in names)])

    def blocks(columns: Sequence[CsvColumn]) -> Blocks:
        own = [c for c in columns if c.name not in names]
        for block in table.blocks([*own, angle]):
            theta = block.pop(column)
            step = np.abs((np.diff(theta) + np.pi) % (2.0 * np.pi) - np.pi)
            if step.size and order * float(np.nanmedian(step)) > 0.5 * np.pi:
                raise DataError(
                    table.source,
                    [f"column '{column}': {np.degrees(np.nanmedian(step)):.3g} deg from sample to sample; harmonic "
                     f"{order} needs {90.0 / order:.3g} deg at most"],
                )  # fmt: skip
            turned = np.arange(1, order + 1)[:, None] * theta
            yield {**block, **dict(zip(names, np.stack([np.cos(turned), np.sin(turned)], 1).reshape(-1, theta.size),
                                       strict=True))}  # fmt: skip

    return replace(table, head=head, blocks=blocks)


def named(head: Head) -> dict[str, str | None]:
    """Return the columns: name -> unit, None where none is written."""
    out: dict[str, str | None] = {}
    for text in head.names:
        name, bracket, unit = text.partition("[")
        out.setdefault(name.strip(), unit.strip().rstrip("]").strip() if bracket else None)
    return out


def find_signals(table: DriftTable, channel: str, scale: str, increments: bool) -> list[Signal]:
    """Return the columns to reduce: those that ``channel`` names, or all whose unit (times scale) says so.

    scale: "0.5arcsec", "17.2deg/h/mA": one unit (of a column without one: 1) as rate or angle; "" for none.
    increments: an angle is the one of a sample, not cumulative, and a velocity is one.  Raises DataError.
    """
    there = named(table.head)
    wanted = [n for n in channel.replace(",", " ").split() if n] if channel else []
    if channel and channel.strip() in there:
        wanted = [channel.strip()]
    problems = [f"column '{n}' is missing; columns of the file: {', '.join(there)}" for n in wanted if n not in there]
    if not wanted:
        wanted = [n for n in there if n not in (TIME, FLAG) and not n.startswith(("temperature", "t_", "angle_"))]
    signals = []
    for name in wanted:
        if name not in there:
            continue
        found = _signal(name, there[name], scale, increments)
        if isinstance(found, Signal):
            signals.append(found)
        elif channel:
            problems.append(found)
    if not signals and not problems:
        readings = [n for n in wanted if channel or not _is_temperature(there[n] or "1")]  # a temperature is none
        whys = [_signal(n, there[n], scale, increments) for n in readings]
        none = f"no rate, angle or specific force among the columns of the file ({', '.join(there)}); {SIGNALS}"
        problems = [w for w in whys if isinstance(w, str)][:4] or [none]
    if problems:
        raise DataError(table.source, problems)
    return signals


def _signal(name: str, unit: str | None, scale: str, increments: bool) -> Signal | str:
    """Return the column as a signal, or why it is none."""
    try:
        own = units.unit(unit or "1")
    except units.UnitError as error:
        return f"column '{name}': {error}"
    kinds = INCREMENTS if increments else KINDS
    for kind, si in kinds.items():
        if own.exponents == units.unit(si).exponents:
            return Signal(name, unit or "", kind, 1.0)
    if own.offset:
        return f"column '{name}': [{unit}] is no rate, angle or specific force; {SIGNALS}"
    if not scale:
        what = f"[{unit}] is no rate, angle or specific force" if unit else "no unit"
        return f"column '{name}': {what}; {SIGNALS}, counts '# scale = 0.5arcsec'"
    if re.fullmatch(r"[-+.\deE\s]+", scale):
        return f"scale = {scale}: no unit; write what one unit of '{name}' is, '0.5arcsec', '0.1mg' or '17.2deg/h/mA'"
    for kind, si in kinds.items():
        try:
            factor = units.parse_quantity(scale, _per(si, unit))
        except units.UnitError:
            continue
        if not factor:
            return f"scale = {scale}: must not be 0"
        return Signal(name, unit or "", kind, factor)
    return f"column '{name}': scale = {scale} times [{unit or '1'}] is no rate, angle or specific force; {SIGNALS}"


def _per(si: str, unit: str | None) -> str:
    """Return the SI unit of a rate or angle per unit of a column."""
    if not unit or units.unit(unit).exponents == units.unit("1").exponents:
        return si
    return f"{si}/({units.unit(unit).dimension})"


def columns_of(table: DriftTable, signals: Sequence[Signal], regressors: str) -> list[CsvColumn]:
    """Return what is read: time, signals in SI of their own unit, flag, temperatures and the named regressors.

    Raises DataError for a regressor that is missing or has a wrong unit.
    """
    there = named(table.head)
    if TIME in there and there[TIME] is None:
        raise DataError(table.source, [f"column '{TIME}': no unit; write '{TIME} [s]' (or [ms], [min], [h])"])
    columns = [CsvColumn(TIME, "s", "time of the sample")] if TIME in there else []
    columns += [CsvColumn(s.name, _si(s.unit), "signal") for s in signals]
    columns += [CsvColumn(FLAG, "1", "suspect", required=False)] if FLAG in there else []
    names = [n for n, unit in there.items() if n.startswith("temperature") or (unit and _is_temperature(unit))]
    asked = [n for n in regressors.replace(",", " ").split() if n]
    problems = [f"regressor '{n}': no such column; columns of the file: {', '.join(there)}"
                for n in asked if n not in there]  # fmt: skip
    for n in dict.fromkeys([*names, *asked]):
        if n in there and n not in {s.name for s in signals}:
            try:
                columns.append(CsvColumn(n, _si(there[n] or ""), "regressor", required=False))
            except units.UnitError as error:
                problems.append(f"column '{n}': {error}")
    if problems:
        raise DataError(table.source, problems)
    return columns


def _is_temperature(unit: str) -> bool:
    try:
        return _si(unit) == "K"
    except units.UnitError:
        return False


def _si(unit: str) -> str:
    return units.unit(unit or "1").dimension
