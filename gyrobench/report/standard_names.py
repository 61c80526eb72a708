"""Names of coefficients in standards, where both an IEEE one and a Chinese one define the quantity that is estimated.

By the meaning of the coefficient, which is for readers, as these names are.  Left out where a standard defines another
quantity under a like name: GJB 2426A has a nonlinearity over points, not the coefficient of a square; its bias
stability is no bias instability.  [IEEE 528; IEEE 952; IEEE 1293; GJB 2426A; GJB 1037A]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gyrobench.report.page_model import PageTable, Row, columns, text_cell
from gyrobench.result import Coefficient


@dataclass(frozen=True)
class StandardName:
    """ieee, gjb: standard and its name of the quantity; the Chinese name itself is in the catalogue."""

    ieee: tuple[str, str]
    gjb: tuple[str, str]


GYRO, ACCELEROMETER = "GJB 2426A-2015", "GJB 1037A-2004"
#: meaning of a coefficient -> its names
NAMES = {
    "angle random walk": StandardName(("IEEE Std 952", "angle random walk"), (GYRO, "random walk coefficient")),
    "bias, without the Earth rate": StandardName(("IEEE Std 528", "bias"), (GYRO, "gyro bias")),
    "asymmetry: scale factor of positive less that of negative rates": StandardName(
        ("IEEE Std 528", "scale factor asymmetry"), (GYRO, "degree of scale factor asymmetry")
    ),
    "bias": StandardName(("IEEE Std 1293", "bias"), (ACCELEROMETER, "accelerometer bias")),
    "scale factor against λ": StandardName(("IEEE Std 1293", "scale factor"), (ACCELEROMETER, "scale factor")),
    "second order in the specific force along the input axis": StandardName(
        ("IEEE Std 1293", "second-order coefficient"), (ACCELEROMETER, "second-order nonlinearity coefficient")
    ),
    "third order in the specific force along the input axis": StandardName(
        ("IEEE Std 1293", "third-order coefficient"), (ACCELEROMETER, "third-order nonlinearity coefficient")
    ),
}


def names_table(coefficients: Sequence[Coefficient]) -> list[PageTable]:
    """Return the names of coefficients in standards as a table; none where no coefficient has both."""
    rows = [
        Row([text_cell(c.name, "strong"), *(text_cell(t, own=k < 3) for k, t in enumerate((*n.ieee, *n.gjb)))])
        for c in coefficients
        if (n := NAMES.get(c.meaning))
    ]
    heads = columns("quantity", "standard", "name there", "standard", "name there", wide=("name there",))
    return [PageTable(heads, rows, "Names of the quantities in standards.", small=True)] if rows else []
