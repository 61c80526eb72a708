"""Statements and signature lines of a report.  [ISO/IEC 17025, 7.8.2]"""

from __future__ import annotations

from typing import Any

from gyrobench.record.run_document import ABOUT
from gyrobench.report.page_model import Signatures
from gyrobench.report.result_json import Report
from gyrobench.result import Result

ROLES = ("Tested by", "Checked by", "Approved by")


def signing(report: Report[Result]) -> list[Any]:
    """Return the statements and the signature lines, the operator's name on the first."""
    run, instrument = report.about, report.result.instrument
    about = f" ({instrument})" if instrument else ""
    statements = [
        f"The results relate only to the item tested{about}, in its condition at the time of the test.",
        "U is the combined standard uncertainty u multiplied by the stated coverage factor k, for a coverage "
        "probability of about 95 % [GUM].",
        "This report shall not be reproduced except in full without approval of the laboratory.",
    ]
    missing = [name for name in ("operator", *ABOUT) if name != "customer" and not getattr(run, name)]
    if report.result.simulated:
        statements[0] = (
            f"The results relate only to {instrument or 'the simulated instrument'}, with the parameters stated."
        )
        statements.insert(0, "All data are simulated; no item was tested and no traceability is claimed.")
    elif missing:
        statements.append(f"Missing before signature: {', '.join(missing)}.")
    return [Signatures(statements, list(zip(ROLES, (run.operator, "", ""), strict=True)))]
