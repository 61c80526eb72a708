"""Runs and records to results, as tests of systems want them."""

from __future__ import annotations

from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.result import Coefficient
from gyrobench.system.system import load_system


def named(result: Any) -> dict[str, Coefficient]:
    return {c.name: c for c in result.coefficients}


def reduced_run(session: Session, values: dict[str, Any], seed: int = 1) -> Any:
    """Return the result of a run with these options and parameters."""
    return session.system.with_values(values).reduce(session.run(values, seed=seed))


def with_options(record: Record, **options: Any) -> Any:
    """Return the result of the windows of a record, as if its run had had these options."""
    run = record.run.replace(options={**record.run.options, **options})
    return load_system(run.system).reduce(Record(record.windows, {}, run))


def turned(axis: int, angle: float) -> list[list[float]]:
    """Return the mount of a gyro turned about one of its axes."""
    rows: list[list[float]] = frames.rotation(np.eye(3)[axis], angle).T.tolist()
    return rows
