"""Scale factor and linearity of a torquer from measured servo-table rates; no co-simulation."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from gyrobench.reduction.result import Result
from gyrobench.system.measured import Column, read_measured
from gyrobench.system.record import Record
from gyrobench.system.system import Option, System

TEMPLATE = """\
# Torquer of a gyro on a servo table: one row for each current, both senses over the same angle range.
# instrument = type and number of the gyro
# operator = who took the data
#
# current: magnitude.  rate_plus, rate_minus: magnitudes of the table rate with positive and negative current.
# range_plus, range_minus: angle ranges; optional, they weigh the rows.  Units may be others of the same kind.
current [mA],rate_plus [deg/h],rate_minus [deg/h],range_plus [deg],range_minus [deg]
"""
COLUMNS = (
    Column("current", "A", "magnitude of the torquer current"),
    Column("rate_plus", "rad/s", "table rate with positive current, magnitude"),
    Column("rate_minus", "rad/s", "table rate with negative current, magnitude"),
    Column("range_plus", "rad", "angle range with positive current", required=False),
    Column("range_minus", "rad", "angle range with negative current", required=False),
)
TEXTS = ("title", "source", "made", "note", "instrument", "operator", "date", "report")


class TorquerScaleFactor(System):
    """The gyro holds a servo table on the axis its torquer precesses about; the table rate over the current is the
    scale factor, its spread over the currents the linearity.

    [TEST-TORQUER; 000_791234d3afc34a0c.txt eq. A3-1..A3-6]
    """

    title = "Torquer scale factor and linearity"
    spec = ("TEST-TORQUER", "SF-APP1", "LIN-TABLE")
    options = {"u_current": Option(0.0, "1", "relative standard uncertainty of the ammeter", 0.0)}

    def check(self) -> list[str]:
        return ["torquer_scale_factor reduces measured data: gyrobench reduce torquer_scale_factor --data FILE"]

    def template(self) -> str:
        return TEMPLATE

    def measured(self, data: Path, values: Mapping[str, str]) -> Record:
        """The CSV as a record.  Raises DataError, and ValueProblem for an option that does not fit."""
        rows, comments = read_measured(data, COLUMNS, time=None)
        for name, value in {**{k: v for k, v in comments.items() if k in self.options}, **values}.items():
            if name not in TEXTS:
                self.set(name, value)
        said = {**comments, **values}
        meta = {
            "system": self.name, "title": self.title, "spec": list(self.spec), "measured": True, "complete": True,
            "options": dict(self.values), "parameters": {}, "plan": [], **{n: said[n] for n in TEXTS if n in said},
        }  # fmt: skip
        return Record(rows, {}, meta)

    def reduce(
        self, record: Record, specification: Mapping[str, tuple[float | None, float | None]] | None = None
    ) -> Result:
        from .reduction import from_record

        return from_record(record, specification)
