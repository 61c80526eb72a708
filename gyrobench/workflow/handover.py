"""Values that a run hands over to another test: ``gyrobench run accelerometer_four --from-run RUN``.

A system says in ``takes`` what it takes of which other one, and how: a function of that one's result that returns
values of its own options.  What is set by hand goes before them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from gyrobench.bench import UsageError
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.workflow.run_comparison import read_result


def handed_over(test: System | Suite, runs: Sequence[Path]) -> dict[str, str]:
    """Return the values of ``test`` that the results in these folders give.

    Raises UsageError for a system that takes nothing, a run that it does not take anything of, one without a value,
    and two that give the same.
    """
    values: dict[str, str] = {}
    for folder in runs:
        taken = {} if isinstance(test, Suite) else test.takes
        if not taken:
            raise UsageError(f"--from-run: {test.name} takes no values of other runs")
        result = read_result(folder)
        if result.system not in taken:
            raise UsageError(
                f"--from-run {folder}: a run of {result.system}; {test.name} takes values of {', '.join(taken)}"
            )
        if result.verdict == "void":
            raise UsageError(f"--from-run {folder}: its result is void; gyrobench report {folder} says why")
        try:
            given = taken[result.system](result)
        except LookupError as error:
            raise UsageError(f"--from-run {folder}: {error.args[0]}") from None
        if twice := sorted(values.keys() & given):
            raise UsageError(f"--from-run {folder}: {', '.join(twice)} given by another run, too")
        values |= given
    return values
