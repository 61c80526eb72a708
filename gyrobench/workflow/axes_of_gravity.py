"""Three accelerometers of a file, told by gravity: their unit, and which columns without names they are."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from gyrobench.record.column_proposal import FileColumn

GRAVITY = {"m/s2": 9.81, "g": 1.0, "mg": 1000.0}
EXACT = 1e-3  # of the squares of a quaternion from 1
NEAR = 0.15  # a bias of a poor accelerometer, of g


def unit_of(triad: Sequence[FileColumn]) -> str:
    """Return the unit in which three columns read gravity, "" where they do in none."""
    size = math.sqrt(sum(c.level**2 for c in triad)) if len(triad) == 3 else math.nan
    return next((unit for unit, g in GRAVITY.items() if abs(size / g - 1.0) < NEAR), "")


def triads(columns: Sequence[FileColumn]) -> tuple[list[FileColumn], list[FileColumn]]:
    """Return the first three columns side by side that are axes of one name, or have none, and read gravity, and three
    others if there are just three; [].
    """
    fours = [columns[k : k + 4] for k in range(len(columns) - 3)]
    quaternions = {c.sources for q in fours if abs(sum(c.level**2 for c in q) - 1.0) < EXACT for c in q}
    threes = [list(columns[k : k + 3]) for k in range(len(columns) - 2)]
    alike = [t for t in threes if len({_stem(c) for c in t}) == 1 and not quaternions & {c.sources for c in t}]
    # one may be angles or a field by chance, and a thousand anything
    forces = next((t for unit in ("m/s2", "g") for t in alike if unit_of(t) == unit), [])
    rates = [c for c in columns if c not in forces]
    return forces, rates if forces and len(rates) == 3 else []


def _stem(column: FileColumn) -> str:
    """Return a name without its axis; of a magnetometer, whose field may be 1, the name."""
    name = column.name.casefold()
    return name if re.match("m_?[xyz]|mag", name) else re.sub(r"[xyz]$|^[xyz](?=_)|\d+$", "", name)
