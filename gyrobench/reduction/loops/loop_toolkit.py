"""Names that the reduction of a loop test needs: ``from gyrobench.reduction.loops.loop_toolkit import ...``."""

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.fit_result import Account
from gyrobench.reduction.estimation.sentences import Sentence, told
from gyrobench.reduction.loops.loop_curves import line, over_time, thinned, trace
from gyrobench.reduction.loops.loop_drift import Drift, drift
from gyrobench.reduction.loops.loop_measures import Gate, Point, wrapped
from gyrobench.reduction.loops.loop_reduction import LoopReduction, MeasureReduction
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import DRIFTS, isolation, margins
from gyrobench.reduction.loops.measure_findings import MeasureFindings
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Coefficient, LoopResult, Reason, Response, Table, Test
from gyrobench.units import ARCMIN, ARCSEC, DEG, DPH

__all__ = [
    "ARCMIN", "ARCSEC", "DEG", "DPH", "DRIFTS", "Account", "Array", "Coefficient", "Drift", "Gate", "LoopFindings",
    "LoopReduction", "LoopResult", "MeasureFindings", "MeasureReduction", "Point", "Reason", "Record", "ReductionError",
    "Response", "RunDocument", "Sentence", "Table", "Test", "drift", "isolation", "line", "margins", "over_time",
    "thinned", "told", "trace", "wrapped",
]  # fmt: skip
