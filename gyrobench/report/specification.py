"""Acceptance specifications: TOML files with a limit per coefficient, in any unit that fits that of the report.

title = "Acceptance of the standard floated gyro"

[coefficients.D_I]
unit = "°/h/g"
min = -1.5
max = 1.5
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gyrobench import reading
from gyrobench.errors import GyrobenchError
from gyrobench.result_entries import StatedLimit
from gyrobench.units import UnitError

LARGEST = 1e300  # of a limit


class SpecificationError(GyrobenchError, ValueError):
    """An acceptance specification that cannot be used; says file, entry and what would be right."""


def load_specification(path: str | Path) -> dict[str, StatedLimit]:
    """Return the limits by coefficient name, ``(low, high)`` in the unit of the file; None where a side is open.

    Raises SpecificationError for a file that is no TOML, an unknown key, a missing unit or one that there is not, a
    limit that is no finite number, limits in the wrong order or an entry without a limit; FileNotFoundError when there
    is no file.  Whether the unit fits the reported coefficient is known once there are coefficients.
    """
    return {
        name: StatedLimit.of(entry.get("min"), entry.get("max"), entry["unit"], f"{path}: {name}")
        for name, entry in _entries(Path(path)).items()
    }


def check_units(path: str | Path, units: dict[str, str]) -> None:
    """Raise SpecificationError when an entry names no reported coefficient, or has a unit of another dimension.

    ``units`` maps coefficient names to the units of the report; an entry D_F also stands for a combination whose
    name begins with it, as "D_F + γ² D_OO".
    """
    units = {**{name.split(" ")[0]: unit for name, unit in units.items()}, **units}
    for name, limit in load_specification(path).items():
        if name not in units:
            known = ", ".join(units)
            raise SpecificationError(f"{path}: no coefficient {name!r} in this result; there are {known}")
        try:
            limit.in_unit(units[name])
        except UnitError as error:
            raise SpecificationError(str(error)) from None


def _entries(path: Path) -> dict[str, dict[str, Any]]:
    data = reading.toml(reading.read_text(path, SpecificationError), path, SpecificationError)
    unknown = set(data) - {"title", "note", "coefficients"}
    if unknown:
        raise SpecificationError(f"{path}: unknown key {sorted(unknown)[0]!r}; allowed are title, note, coefficients")
    entries = data.get("coefficients")
    if not isinstance(entries, dict) or not entries:
        raise SpecificationError(f"{path}: no [coefficients.NAME] table; each gives unit and min, max or both")
    for name, entry in entries.items():
        _check(path, name, entry)
    return entries


def _check(path: Path, name: str, entry: Any) -> None:
    where = f"{path}: [coefficients.{name}]"
    if not isinstance(entry, dict):
        raise SpecificationError(f"{where} must be a table with unit and min, max or both")
    unknown = set(entry) - {"unit", "min", "max", "note"}
    if unknown:
        raise SpecificationError(f"{where}: unknown key {sorted(unknown)[0]!r}; allowed are unit, min, max, note")
    if not isinstance(entry.get("unit"), str) or not entry["unit"]:
        raise SpecificationError(f'{where}: unit is missing, for example unit = "°/h"')
    for side in ("min", "max"):
        value = entry.get(side)
        if side in entry and (
            isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < LARGEST
        ):
            raise SpecificationError(f"{where}: {side} must be a finite number, not {value!r}")
        if side in entry:
            entry[side] = float(entry[side])
    if "min" not in entry and "max" not in entry:
        raise SpecificationError(f"{where}: neither min nor max")
    if "min" in entry and "max" in entry and entry["min"] >= entry["max"]:
        raise SpecificationError(f"{where}: min {entry['min']} is not below max {entry['max']}")
