"""Noise models of real records: share of averaging times whose deviation the model implies, N, time.

    python tests/benchmarks/real_records.py FOLDER [PART_OF_A_NAME ...]

FOLDER: Parquet files of records at rest, one column a channel; a column ``time`` (s) or 100 Hz.  Every other column is
taken as it is, in its own unit.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.series.checks import SeriesError

MOVED = "imu_tk"  # records of moved instruments


def main(folder: Path, parts: list[str]) -> None:
    head = "record | channel | samples | within, as recorded | cleaned | stated | N / (unit·√s) | wild | steps | lines"
    print(f"| {head} | CPU / s |")
    print("|---|---|---|---|---|---|---|---|---|---|---|")
    for file in sorted(folder.glob("*.parquet")):
        if MOVED in file.name or (parts and not any(p in file.name for p in parts)):
            continue
        table = pq.read_table(file)
        names = [n for n in table.schema.names if not n.startswith(("time", "t_", "temp")) and n != "t"]
        clock = next((n for n in table.schema.names if n.startswith("time") or n == "t"), "")
        stamps = table[clock].to_numpy() if clock else 0.01 * np.arange(table.num_rows)
        step = float(stamps[-1] - stamps[0]) / (table.num_rows - 1)  # stamps may be uneven
        for name in names:
            began = time.process_time()
            try:
                model = fit_noise(table[name].to_numpy().astype(float), step, means=False)
            except SeriesError as error:
                print(f"| {file.stem} | {name} | | | | {error} | | | | | |")
                continue
            whole, clean = model.agreements
            n = model["N"]
            white = f"{n.value:.4g} ({n.low:.4g} to {n.high:.4g})" if n.determined else f"below {n.high:.3g}"
            t = model.treatment
            print(
                f"| {file.stem} | {name} | {t.samples} | {whole.share:.3f} | {clean.share:.3f} | "
                f"{'yes' if model.agrees else 'no'} | {white} | {t.wild.size} | {len(t.steps)} | {len(t.lines)} | "
                f"{time.process_time() - began:.1f} |",
                flush=True,
            )


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
