"""Empty record of a test: the columns that a laboratory's file is read by."""

from __future__ import annotations

from gyrobench.bench import Bench, UsageError
from gyrobench.system.suite import Suite
from gyrobench.system.system import MeasuredData, System
from gyrobench.workflow.inputs import load_test


def empty_record(test: System | Suite) -> str:
    """Return an empty CSV with the columns that ``gyrobench reduce`` reads, and what each means.  Raises UsageError."""
    from gyrobench.system.lab_record import explained

    if isinstance(test, Suite):
        raise UsageError(f"{test.name} compares runs: reduce each record by its own test, then give it their folders")
    return explained(measured_data(test).template, test.options)


def measured_data(system: System) -> MeasuredData:
    """Return how a laboratory's record is read.  Raises UsageError for a system without, naming those that have one."""
    if system.measured_data is None:
        tests = {name: load_test(name) for name in Bench.find().systems()}
        known = [n for n, t in tests.items() if not isinstance(t, Suite) and t.measured_data is not None]
        raise UsageError(f"{system.name} has no reduction of measured data; there is one for {', '.join(known)}")
    return system.measured_data
