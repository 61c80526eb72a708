"""Names that the reduction of a drift or calibration test needs: ``from gyrobench.reduction.toolkit import ...``.

Each name is explained where it is defined; docs/guides/write_a_system.md leads through a reduction.
"""

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.drift_test import DriftReduction
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.fit_result import Account
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.reported import Group
from gyrobench.reduction.estimation.sentences import Sentence, plain, plus_minus, told
from gyrobench.reduction.setup.run_metadata import Location, number, truth_of
from gyrobench.reduction.setup.setups import RebalanceSetup, Setup, SiteSetup, attitude_of
from gyrobench.reduction.setup.sources import Effect, Source
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table

__all__ = [
    "Account", "Array", "Candidate", "Coefficient", "DriftReduction", "DriftTestResult", "Effect", "Findings", "Group",
    "Location", "Quantity", "Reason", "RebalanceSetup", "Record", "ReductionError", "Regression", "RunDocument",
    "Sentence", "Setup", "SiteSetup", "Source", "Table", "attitude_of", "number", "plain", "plus_minus", "told",
    "truth_of", "window_problems",
]  # fmt: skip
