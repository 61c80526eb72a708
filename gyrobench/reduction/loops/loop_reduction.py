"""The skeletons of tests whose figures are measured one by one: of a loop, and of anything else.

    class Reduction(LoopReduction):
        def measure(self):                         # phases -> coefficients, figures, reasons
            self.found.open_loop("stabilizer", "stabilizer.e", "exciter.test[1]")
            return Account(method=..., sources=[...], equation=..., conventions=[...])

        def summary(self): return margins(self.found)

A run that was unstable or did not come to rest has no values, whatever the test measures (validity).
"""

from __future__ import annotations

from typing import ClassVar

from gyrobench.record.record import Record
from gyrobench.reduction.estimation.fit_result import Account
from gyrobench.reduction.estimation.sentences import told
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.measure_findings import MeasureFindings
from gyrobench.result import LoopResult


class MeasureReduction:
    """One reduction of one record; see the module."""

    part: ClassVar[str] = ""  # slot of the part that the test is of; "": the instrument that the record names
    ranked_by: str = ""  # the coefficient that ranks runs in a comparison, smallest first
    said: ClassVar[tuple[str, ...]] = ()  # the numbers that matter, as sentences with coefficients in braces
    found: MeasureFindings

    def __init__(self, record: Record) -> None:
        self.record, self.run = record, record.run
        self.found = self.findings()
        if self.part:
            self.name = self.run.parts[self.part].name if self.part in self.run.parts else ""
            self.found.facts["instrument"] = self.name or self.run.instrument

    def findings(self) -> MeasureFindings:
        """Return what collects the figures, empty."""
        return MeasureFindings(self.record)

    def measure(self) -> Account:
        """Measure what the record shows; return what the test says of itself.  May raise ReductionError."""
        raise NotImplementedError

    def summary(self) -> list[str]:
        """Return the numbers that matter, as sentences, of a run that has values."""
        return told(self.found.coefficients, *self.said)

    @classmethod
    def from_record(cls, record: Record) -> LoopResult:
        """Return what a record says.  Raises ReductionError."""
        test = cls(record)
        account = test.measure()
        return test.found.result(account, [] if test.found.unstable else test.summary(), test.ranked_by)


class LoopReduction(MeasureReduction):
    """A test of phases that an exciter makes.  slot, by_neighbours, linearized: of :class:`LoopFindings`."""

    slot: ClassVar[str] = "exciter"
    by_neighbours: ClassVar[bool] = False
    linearized: ClassVar[bool] = True
    found: LoopFindings

    def findings(self) -> LoopFindings:
        return LoopFindings(self.record, self.slot, self.by_neighbours, self.linearized)
