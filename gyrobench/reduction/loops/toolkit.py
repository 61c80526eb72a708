"""Names that the reduction of a loop test needs: ``from gyrobench.reduction.loops.toolkit import ...``."""

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.fit_result import Account
from gyrobench.reduction.estimation.sentences import Sentence, told
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import isolation, margins
from gyrobench.reduction.loops.loop_test import LoopTest
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Coefficient, LoopResult, Reason, Response, Table

__all__ = [
    "Account",
    "Array",
    "Coefficient",
    "Gate",
    "LoopFindings",
    "LoopResult",
    "LoopTest",
    "Reason",
    "Record",
    "ReductionError",
    "Response",
    "RunDocument",
    "Sentence",
    "Table",
    "isolation",
    "margins",
    "told",
]
