"""The skeleton of a loop test: a test measures the phases of its record, this makes the result.

    class Reduction(LoopTest):
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
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.result import LoopResult


class LoopTest:
    """One reduction of one record of a loop; see the module.  slot, by_neighbours: of :class:`LoopFindings`."""

    slot: ClassVar[str] = "exciter"
    by_neighbours: ClassVar[bool] = False
    ranked_by: ClassVar[str] = ""  # the coefficient that ranks runs in a comparison, smallest first

    def __init__(self, record: Record) -> None:
        self.record, self.run = record, record.run
        self.found = LoopFindings(record, self.slot, self.by_neighbours)

    def measure(self) -> Account:
        """Measure what the phases show; return what the test says of itself.  May raise ReductionError."""
        raise NotImplementedError

    def summary(self) -> list[str]:
        """Return the numbers that matter, as sentences, of a run that has values."""
        return []

    @classmethod
    def from_record(cls, record: Record) -> LoopResult:
        """Return what a record says.  Raises ReductionError."""
        test = cls(record)
        account = test.measure()
        return test.found.result(account, [] if test.found.unstable else test.summary(), cls.ranked_by)
