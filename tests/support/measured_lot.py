"""Measured files of a lot of floated gyros, as a laboratory writes them, a few with the mistakes laboratories make.

    python tests/support/measured_lot.py FOLDER [--count 100] [--seed 1]

Each file is a co-simulated tumble of one gyro of the lot (short turns at 0.02 rad/s), written in units of a laboratory.
Five are wrong, spread over the lot: the current in microampere under the head mA; the two mounts exchanged; the angle
column in another unit than its head says; the file torn in the middle of a row; the head of the current without unit.
"""

from __future__ import annotations

import argparse
import csv
import io
import math
from collections.abc import Callable
from datetime import date, timedelta
from pathlib import Path

import numpy as np

from gyrobench import drift
from gyrobench.engine.session import Session
from gyrobench.record.record import Record

SYSTEM = "tumble_single_axis"
PLAN = {"rate": 0.02, "windows": 36, "dwell": 20.0, "settle": 3.0}
LATITUDE = 45.75  # deg
DPH = math.pi / 648000.0
#: mean and standard deviation of the lot, deg/h per g^n
LOT = {"D_F": (0.1, 0.1), "D_I": (0.5, 0.2), "D_O": (-0.3, 0.2), "D_S": (0.4, 0.2), "D_IS": (0.05, 0.02)}
SQUARES = (0.02, 0.01)
UNITS = {"t": ("s", 1.0), "angle": ("deg", math.pi / 180.0), "mean": ("mA", 1e-3)}
WRONG = ("current in another unit", "exchanged mounts", "angle in another unit", "torn", "no unit")


def instrument(k: int) -> str:
    """Return the name of gyro k."""
    return f"FG-{k:03d}"


def wrong(count: int) -> dict[int, str]:
    """Return the gyros whose files are wrong, and how."""
    return {(2 * i + 1) * count // (2 * len(WRONG)): what for i, what in enumerate(WRONG)}


def write_lot(folder: Path, count: int, seed: int = 1) -> list[Path]:
    """Write the files of a lot; return them in their order."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    files = []
    with Session(SYSTEM) as session:
        for k in range(count):
            drawn = {n: rng.normal(*LOT.get(n, SQUARES)) * DPH for n in drift.terms(9)}
            values = {**PLAN, "latitude": math.radians(LATITUDE), **{f"gyro.{n}": v for n, v in drawn.items()}}
            record = session.run(values, seed=1000 * seed + k)
            files.append(folder / f"{instrument(k)}.csv")
            files[-1].write_text(MISTAKES[wrong(count).get(k, "")](sheet(record, k)), encoding="utf-8")
    return files


def sheet(record: Record, k: int) -> str:
    """Return the record of gyro k as a laboratory would write it."""
    out = io.StringIO()
    said = {"latitude": f"{LATITUDE}deg", "k": "17.2deg/h/mA", "instrument": instrument(k), "operator": "A. Tester"}
    said |= {"date": f"{date(2026, 3, 2) + timedelta(days=k)}", "u_scale_factor": "1e-4", "u_axis": "2arcsec"}
    for key, value in {**said, "u_remount": "2e-3deg/h", "arrangement": "checked"}.items():
        out.write(f"# {key} = {value}\n")
    for p in record.run.plan:
        out.write(f"# phase {p.phase} = {p.face}\n")
    names = {"t_start": "t", "t_end": "t", "angle_start": "angle", "angle_end": "angle", "mean": "mean"}
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["phase", *(f"{n} [{UNITS[kind][0]}]" for n, kind in names.items())])
    w = record.windows
    for j in range(len(w["mean"])):
        writer.writerow([int(w["phase"][j]), *(f"{w[n][j] / UNITS[kind][1]:.9g}" for n, kind in names.items())])
    return out.getvalue()


# ------------------------------------------------------------------------------------------------- mistakes
def scaled(text: str, columns: tuple[int, ...], factor: float) -> str:
    """Return the text with columns times a factor under the old head."""
    lines = text.splitlines()
    first = next(i for i, line in enumerate(lines) if line.startswith("phase,"))
    for i in range(first + 1, len(lines)):
        cells = lines[i].split(",")
        for c in columns:
            cells[c] = f"{float(cells[c]) * factor:.9g}"
        lines[i] = ",".join(cells)
    return "\n".join(lines) + "\n"


def exchanged(text: str) -> str:
    return text.replace("= mount 1", "= mount X").replace("= mount 2", "= mount 1").replace("= mount X", "= mount 2")


MISTAKES: dict[str, Callable[[str], str]] = {
    "": lambda text: text,
    "current in another unit": lambda text: scaled(text, (5,), 1000.0),
    "exchanged mounts": exchanged,
    "angle in another unit": lambda text: scaled(text, (3, 4), math.pi / 180.0),
    "torn": lambda text: text[: int(0.7 * len(text))].rsplit(",", 2)[0] + ",",
    "no unit": lambda text: text.replace("mean [mA]", "mean"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    files = write_lot(given.folder, given.count, given.seed)
    print(f"{len(files)} files in {given.folder}; wrong: {', '.join(map(instrument, wrong(given.count)))}")


if __name__ == "__main__":
    main()
