"""Noise models of real records beside their own deviation and published figures: docs/real_records.md.

    python tests/benchmarks/real_records.py FOLDER [PART_OF_A_NAME ...] [--write]

FOLDER: Parquet files of records at rest, one column a channel; a column ``time`` (s) or 100 Hz.  ``--write`` puts a row
for each channel into docs/figures.toml and the page.  Every channel is taken alone, in the unit of UNITS.
"""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import quoted
from quoted import figures

from gyrobench import units
from gyrobench.reduction.noise_model.constancy import changing
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.noise_model.noise_model import NoiseModel
from gyrobench.reduction.noise_model.terms import PEAKS
from gyrobench.reduction.series.channel_units import ChannelUnits, units_of
from gyrobench.reduction.series.checks import SeriesError
from gyrobench.report.numbers import write_number

PAGE = Path(__file__).parents[2] / "docs" / "real_records.md"
MOVED = "imu_tk"  # records of moved instruments
#: beginning of a file's name -> units of its gyros and accelerometers, as its source states or as is inferred
UNITS = {"adis16405": ("deg/s", "g"), "adi_mems": ("deg/s", "m/s2"), "ln100": ("deg/s", "m/s2"),
         "mpu6050": ("deg/s", "g"), "mtig": ("rad/s", "m/s2")}  # fmt: skip
#: beginning of a channel -> published N in the unit of the table, its source
PUBLISHED = {"adis16405 gyro": "2.0 (sheet)", "mpu6050 gyro": "0.30 (sheet)"}
HEAD = ("τ / s", "inside / %", "stated", "N", "N, published", "remarks", "changes over the quarters")


def unit_of(name: str, channel: str) -> str:
    """Return the unit of a channel of a file."""
    gyros, forces = next(u for start, u in UNITS.items() if name.startswith(start))
    return gyros if channel.startswith("gyro") else forces


def values_of(model: NoiseModel, of: ChannelUnits, published: str) -> dict[str, str]:
    """Return the row of a channel, as it is printed."""
    whole, clean = model.agreements
    unit, si, _ = of.terms["N"]
    N, t = model["N"], model.treatment
    low, high = (write_number(v / si, (N.high - N.low) / (4.0 * si)).text for v in (N.low, N.high))
    white = f"{write_number(N.value / si, (N.high - N.low) / (4.0 * si)).text} ({low} to {high}) {unit}"
    counts = ((t.wild.size, "wild"), (len(t.steps), "step"), (len(t.pulses), "pulse"), (len(t.lines), "line"))
    changes = [f"{c.coefficient or c.term.name.replace('_', '-')} {c.rms.min():.3f} to {c.rms.max():.3f}"
               for c in changing(model.over_time) if c.term.name not in PEAKS]  # fmt: skip
    bands = sum(c.term.name in PEAKS for c in changing(model.over_time))
    changes += [f"{bands} band{'s' if bands > 1 else ''}"] if bands else []
    remarks = [f"{n} {word}{'s' * (n > 1 and word != 'wild')}" for n, word in counts if n]
    remarks += ["jumps"] * t.jumps
    remarks += [*["settles"] * bool(t.settling), *["swings"] * bool(t.swings)]
    tau = " to ".join(write_number(x, significant=2).text for x in (whole.tau[0], whole.tau[-1]))
    return {
        "τ / s": tau,
        "inside / %": f"{100.0 * whole.share:.1f}, {100.0 * clean.share:.1f}",
        "stated": "yes" if model.agrees else "no",
        "N": "–" if not model.agrees else white if N.determined else f"below {high} {unit}",
        "N, published": published or "–",
        "remarks": ", ".join(remarks) or "–",
        "changes over the quarters": ", ".join(changes) or "–",
    }


def rows_of(file: Path) -> dict[str, dict[str, str]]:
    """Return the rows of a file by channel; those that cannot be reduced are named and left out."""
    table = pq.read_table(file)
    names = [n for n in table.schema.names if not n.startswith(("time", "t_", "temp")) and n != "t"]
    clock = next((n for n in table.schema.names if n.startswith("time") or n == "t"), "")
    stamps = table[clock].to_numpy() if clock else 0.01 * np.arange(table.num_rows)
    step = float(stamps[-1] - stamps[0]) / (table.num_rows - 1)  # stamps may be uneven
    out = {}
    for name in names:
        unit = units.unit(unit_of(file.stem, name))
        try:
            model = fit_noise(unit.factor * table[name].to_numpy().astype(float), step, means=False)
        except SeriesError as error:
            print(f"{file.stem} {name}: {error}")
            continue
        kind = f"{file.stem.split('_')[0]} {name.split('_')[0]}"
        out[name] = values_of(model, units_of(unit.dimension), PUBLISHED.get(kind, ""))
    return out


def put(group: str, head: Sequence[str]) -> None:
    """Write the rows of a group of docs/figures.toml into the page, between its marks."""
    lines = [f"| record, channel | {' | '.join(head)} |", "|---" * (len(head) + 1) + "|"]
    for key, entry in sorted(figures.load().items()):
        if key.startswith(f"{group}."):
            record, _, channel = key.removeprefix(f"{group}.").partition("-")
            cells = " | ".join(entry["value"][h] for h in head)
            lines.append(f"| {record} {channel.replace('-', ' ')} <!--row {key}--> | {cells} |")
    marks = re.compile(rf"(<!--{group}-->\n\n).*?(\n\n<!--end of {group}-->)", re.S)
    page = PAGE.read_text(encoding="utf-8")
    PAGE.write_text(marks.sub(lambda m: m[1] + "\n".join(lines) + m[2], page), encoding="utf-8")


def main(folder: Path, parts: list[str], write: bool) -> None:
    began, every = time.process_time(), dict[str, dict[str, str]]()
    for file in sorted(folder.glob("*.parquet")):
        if MOVED in file.name or (parts and not any(p in file.name for p in parts)):
            continue
        for channel, values in rows_of(file).items():
            every[f"{file.stem} {channel}"] = values
            print(f"| {file.stem} {channel} | {' | '.join(values[h] for h in HEAD)} |", flush=True)
            if write:
                quoted.record(f"real.{file.stem}-{channel}", values, "", "tests/benchmarks/real_records.py FOLDER")
    if write:
        put("real", HEAD)
    stated = sum(v["stated"] == "yes" for v in every.values())
    print(f"stated for {stated} of {len(every)} channels, {time.process_time() - began:.0f} s of CPU")


if __name__ == "__main__":
    names = [a for a in sys.argv[1:] if a != "--write"]
    main(Path(names[0]), names[1:], "--write" in sys.argv)
