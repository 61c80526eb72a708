"""Stored campaigns with known truth, written by the columns that the store documents."""

from __future__ import annotations

import hashlib
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from scipy import stats

VERDICTS = ("pass", "fail")


def write(folder: Path, columns: dict[str, Any], units: dict[str, str], **definition: Any) -> Path:
    """Write a campaign of these columns; those that every campaign has are filled in."""
    n = len(next(iter(columns.values())))
    rows: dict[str, Any] = {
        "run": [f"{k:016x}" for k in range(n)],
        "index": np.arange(n),
        "system": ["synthetic"] * n,
        "seed": np.arange(n),
        "data": [None] * n,
        "state": ["done"] * n,
        "reason": [None] * n,
        "verdict": [None] * n,
        "warnings": [[] for _ in range(n)],
        "report": [None] * n,
        "instrument": [None] * n,
        "date": [None] * n,
    } | columns
    kinds = {"index": pa.int64(), "seed": pa.int64(), "warnings": pa.list_(pa.string())}
    kinds["warning_ids"] = kinds["warnings"]
    texts = ("run", "system", "data", "state", "reason", "verdict", "report", "instrument", "date")
    fields, arrays = [], []
    for name, values in rows.items():
        kind = kinds.get(name) or (pa.string() if name in texts or isinstance(values[0], str) else pa.float64())
        if kind == pa.float64():
            values = [None if v is None or not np.isfinite(v) else float(v) for v in values]
        elif kind == pa.int64():
            values = [None if v is None else int(v) for v in values]
        unit = units.get(name)
        fields.append(pa.field(name, kind, metadata=None if unit is None else {"unit": unit}))
        arrays.append(pa.array(list(values), kind))
    (folder / "runs").mkdir(parents=True)
    content = io.BytesIO()
    pq.write_table(pa.Table.from_arrays(arrays, schema=pa.schema(fields)), content)
    (folder / "runs" / f"{hashlib.sha256(content.getvalue()).hexdigest()[:16]}.parquet").write_bytes(content.getvalue())
    document = {"schema": "gyrobench-campaign-1", "name": folder.name, "question": "", "system": "synthetic",
                "definition": {}, "axes": [], "options": {}, "parts": {}, "versions": {}, **definition}  # fmt: skip
    (folder / "campaign.json").write_text(json.dumps(document))
    return folder


def measure(name: str, estimate: Any, u: Any, truth: Any = None, k: float = 1.96) -> dict[str, Any]:
    """Return the columns of a measure with intervals estimate ± k u."""
    estimate, u = np.broadcast_arrays(np.asarray(estimate, float), np.asarray(u, float))
    found = {
        f"{name}.estimate": estimate,
        f"{name}.u": u,
        f"{name}.lo": estimate - k * u,
        f"{name}.hi": estimate + k * u,
    }
    found[f"{name}.truth"] = np.full(len(estimate), np.nan) if truth is None else np.broadcast_to(truth, len(estimate))
    return found


def units_of(names: dict[str, str]) -> dict[str, str]:
    """Return the unit of every column of measures: name -> unit."""
    return {f"{n}.{key}": unit for n, unit in names.items() for key in ("estimate", "u", "lo", "hi", "truth")}


UNITS = {"D_F": "°/h", "D_I": "°/h/g", "D_S": "°/h/g"}


def sweep(folder: Path, runs: int, seed: int = 1, reports: tuple[int, ...] = ()) -> Path:
    """Sampled design: latitude drives u of D_F, dwell the error of D_I; those of D_S are half as wide as due."""
    rng = np.random.default_rng(seed)
    latitude, dwell = rng.uniform(0.0, 80.0, runs), rng.uniform(1.0, 20.0, runs)
    u = 0.01 / np.cos(np.radians(latitude))
    true = {n: rng.normal(0.0, 1.0, runs) for n in UNITS}
    t = stats.t.ppf(0.975, 20)
    columns: dict[str, Any] = {"in.latitude": latitude, "in.dwell": dwell}
    columns |= measure("D_F", true["D_F"] + u * rng.standard_t(20, runs), u, true["D_F"], t)
    columns |= measure("D_I", true["D_I"] + 0.02 * rng.standard_t(20, runs) + 0.004 * dwell, 0.02, true["D_I"], t)
    columns |= measure("D_S", true["D_S"] + 0.04 * rng.standard_t(20, runs), 0.02, true["D_S"], t)
    state = np.array(["done"] * runs, dtype=object)
    reason = np.array([None] * runs, dtype=object)
    for k in np.flatnonzero(rng.random(runs) < 0.03):
        state[k], reason[k] = "refused", f"rate {latitude[k]:.2f}: too close to the pole; at most 75 deg"
    if runs > 5:
        state[3], reason[3] = "hung", "no progress in 60 s"
    for name in [c for c in columns if "." in c and not c.startswith("in.")]:
        columns[name] = np.where(state == "done", columns[name], np.nan)
    columns |= {"state": state, "reason": reason, "verdict": [None if s != "done" else VERDICTS[k % 7 == 0]
                                                             for k, s in enumerate(state)]}  # fmt: skip
    columns["report"] = keep(folder, runs, reports)
    axes = [{"name": "latitude", "kind": "lhs", "unit": "°"}, {"name": "dwell", "kind": "lhs", "unit": "min"}]
    return write(folder, columns, units_of(UNITS) | {"in.latitude": "°", "in.dwell": "min"}, axes=axes,
                 question="Where does the latitude spoil the fixed drift?")  # fmt: skip


def keep(folder: Path, runs: int, reports: tuple[int, ...]) -> list[str | None]:
    """Write a report for some runs; return the column."""
    column: list[str | None] = [None] * runs
    for k in reports:
        column[k] = f"kept/{k:016x}/report.html"
        (folder / f"kept/{k:016x}").mkdir(parents=True)
        (folder / f"kept/{k:016x}/report.html").write_text(f"report {k}")
    return column


def lot(folder: Path, files: int, seed: int = 5, remark: str = "", ids: bool = True) -> Path:
    """Measured files of gyros: number 3 torn, 11 with exchanged mounts, 20 with a D_I of 9 in a lot of unit normals.

    ids: the rows have those of their warnings; false: as those of version 0.1.0.
    """
    rng = np.random.default_rng(seed)
    columns: dict[str, Any] = {
        "data": [f"lot/{k:03d}.csv" for k in range(files)],
        "instrument": [f"gyro {k}" for k in range(files)],
        "seed": [None] * files,
        "verdict": ["pass"] * files,
        "report": keep(folder, files, (20,)),
    }
    state, reason, warnings = ["done"] * files, [None] * files, [[] for _ in range(files)]
    values = {name: rng.normal(0.0, 1.0, files) for name in UNITS}
    values["D_I"][20] = 9.0
    state[3], reason[3] = "refused", "row 7: 3 cells, expected 5"  # type: ignore[call-overload]
    columns["verdict"][11], columns["verdict"][3] = "inconclusive", None
    named = [[] for _ in range(files)]
    said = ["Residuals are correlated.", "This record contradicts itself: exchanged mounts."]
    warnings[11] = said  # type: ignore[call-overload]
    named[11] = ["residuals", "handling.error"]  # type: ignore[list-item]
    if remark:  # that makes all of them inconclusive
        columns["verdict"] = ["inconclusive"] * files
        warnings = [[remark.format(k=k), *more] for k, more in enumerate(warnings)]
        named = [["type_b.unstated", *more] for more in named]
    for name, y in values.items():
        columns |= measure(name, np.where(np.array(state) == "done", y, np.nan), 0.02)
    columns |= {"state": state, "reason": reason, "warnings": warnings} | ({"warning_ids": named} if ids else {})
    axes = [{"name": "data", "kind": "data", "unit": ""}]
    return write(folder, columns, units_of(UNITS), axes=axes, question="Which gyros of the lot may be delivered?")
