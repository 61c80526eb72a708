"""Results of a laboratory's file for certificates: readings of a gyro in one attitude, reduced, nothing written."""

from __future__ import annotations

import dataclasses
import functools
import tempfile
from pathlib import Path
from typing import Any

from messy_file import messy

from gyrobench.report.certificate_page import Certified
from gyrobench.report.result_json import Report
from gyrobench.result import Result
from gyrobench.workflow.fit_columns import write_columns
from gyrobench.workflow.inputs import load_test
from gyrobench.workflow.measured_run import reduce_measured

STATED = {"latitude": "45.75deg", "k": "17.2deg/h/mA", "attitude": "E U -N", "type_b": "none", "date": "2026-03-12"}


@functools.cache
def _measured() -> Result:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "messung.csv").write_bytes(messy()[0])
        write_columns(folder / "messung.csv", "fixed_position", folder / "map.toml")
        done = reduce_measured(
            load_test("fixed_position"), folder / "messung.csv", STATED, in_memory=True, columns=folder / "map.toml"
        )
    assert done.result is not None
    return done.result


def certified(number: int, **changes: Any) -> Certified:
    """Return what a certificate is made of: the result of instrument KG-number, with other fields."""
    return Certified(Report.of(dataclasses.replace(_measured(), instrument=f"KG-{number}", **changes)), "ab" * 32)
