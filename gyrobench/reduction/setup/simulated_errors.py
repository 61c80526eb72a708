"""Errors of the set-up that a simulated run has, under the ids of the sources of its budget.

The parts declare them (gyrobench.component.set_up).  With them the report says beforehand, from the sensitivities of
the budget, by how much each estimate is off (gyrobench.reduction.estimation.effects.simulated_table).
"""

from __future__ import annotations

from gyrobench.bench import Bench, UsageError
from gyrobench.component.set_up import Errors, set_up_errors
from gyrobench.errors import GyrobenchError
from gyrobench.packaging.loading import load_part
from gyrobench.record.run_document import RunDocument

AXES = ("outer", "inner")  # slots of one table on another: their errors are those of one axis each


def simulated_errors(run: RunDocument) -> Errors:
    """Return source -> error, SI, of what is set in the parts of a run; nothing of measured data.

    Of a source in several parts: part -> error.  Parts that the bench does not have say nothing.
    """
    found: Errors = {}
    if run.measured:
        return found
    folder = {name.replace("_", ""): name for name in Bench.find().parts()}  # a run names the class of a part
    for slot, info in run.parts.items():
        values = {n.removeprefix(f"{slot}."): v for n, v in run.parameters.items() if n.startswith(f"{slot}.")}
        try:
            errors = set_up_errors(load_part(folder[info.name.lower()]), values)
        except (GyrobenchError, UsageError, KeyError):
            continue  # a third-party FMU, or a part of another bench
        prefix = f"{slot}." if slot in AXES else ""
        found |= {f"{prefix}{source}": error for source, error in errors.items()}
    return {source: error for source, error in found.items() if error}
