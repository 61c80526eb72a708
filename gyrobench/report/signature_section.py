"""What makes a report one that can be signed: what it holds for, and room for those who answer for it.  [ISO/IEC 17025,
7.8.2]"""

from __future__ import annotations

from typing import Any

from gyrobench.record.run_document import ABOUT
from gyrobench.report.page_model import Signatures

Json = dict[str, Any]
ROLES = ("Tested by", "Checked by", "Approved by")


def signing(doc: Json) -> list[Any]:
    """Statements and signature lines; the operator's name stands on the first."""
    run = doc["provenance"]
    item = doc["instrument"] or "the instrument tested"
    said = [
        f"The results hold for {item} alone, as it was when tested, under the conditions stated.",
        "Uncertainties are expanded to 95 % where U or an interval is given; u is a standard uncertainty [GUM].",
        "This report may be copied as a whole only.",
    ]
    missing = [name for name in ("operator", *ABOUT) if name != "customer" and not run.get(name)]
    if doc["simulated"]:
        said.insert(0, "All data are simulated: no instrument was tested, and nothing here is traceable to a standard.")
    elif missing:
        said.append(f"Not stated, and wanted before signing: {', '.join(missing)}.")
    names = [str(run.get("operator") or ""), "", ""]
    return [Signatures(said, list(zip(ROLES, names, strict=True)))]
