"""Reports: what was found, whether it meets its specification, and why to believe it.

A :class:`gyrobench.result.Result` goes in; ``result.json``, ``report.html`` and ``report.pdf``
come out, rendered from one document, so that a number is the same number everywhere.  Nothing heavy is
imported before a report is written.
"""

from gyrobench.report.assets import content_dir
from gyrobench.report.report_files import FORMATS, NAMES, ReportError, compare, write
from gyrobench.report.result_json import load, report_id
from gyrobench.report.specification import SpecificationError, check_units, load_specification
from gyrobench.result_content import ResultError

__all__ = [
    "FORMATS", "NAMES", "ReportError", "ResultError", "SpecificationError", "check_units", "compare", "content_dir",
    "load", "load_specification", "report_id", "write",
]  # fmt: skip
