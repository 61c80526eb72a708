"""Compensation of the systematic drift, tested again: coefficients in, currents out, drift measured.

[COMP-SYSTEMATIC; Hu 1981, section 6.2, item 3]

    k i = - omega_d(coefficients put in, attitude)     left: theta' + omega_E,x (less the levelling k i) = omega_d + k i

With the torquer's current read, the drift itself is measured again, theta' + omega_E,x - k i = omega_d; what is left is
that less what was put in.  Hu 1981: where systematic drift is left, the coefficients were not repeatable, wrongly
reduced, or the current was not accurate.

Not modelled: one current an attitude, of the drift at its first angle.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench import drift
from gyrobench.reduction.toolkit import Array, Findings, Table, plain
from gyrobench.system.families.servo_channel import own_name
from gyrobench.system.values import InvalidValueError, parse_number
from gyrobench.units import DPH

EXAMPLE = "D_F=-0.3deg/h, D_I=0.9deg/h/g"


def names(channel: str) -> dict[str, str]:
    """Return the gyro's names of the coefficients -> those of a floated gyro."""
    return {own_name(channel, n): n for n in drift.NAMES}


def of_folder(folder: Path, channel: str) -> str:
    """Return the coefficients of a run's result as the text of the option.  Raises InvalidValueError."""
    file = folder / "result.json"
    try:
        found = json.loads(file.read_text("utf-8"))["coefficients"]
    except (OSError, ValueError, KeyError, TypeError):
        raise InvalidValueError(f"compensate = {folder}: no result.json with coefficients; run its report") from None
    known = names(channel)
    parts = [f"{c['name']}={c['estimate']!r}deg/h" for c in found if c.get("name") in known]
    if not parts:
        raise InvalidValueError(
            f"compensate = {folder}: the result has no coefficient of this gyro alone; it has "
            f"{', '.join(str(c.get('name')) for c in found)}"
        )
    return ", ".join(parts)


def coefficients(text: str, channel: str) -> dict[str, float]:
    """Return the coefficients put in, rad/s per g0^n, in the names and signs of a floated gyro.

    Raises InvalidValueError for a name that this gyro does not have, and for one that stands twice.
    """
    known, found = names(channel), dict[str, float]()
    for entry in (e.strip() for e in re.split(r"[,;]", text) if e.strip()):
        name, sign, value = (part.strip() for part in entry.partition("="))
        if not sign or name not in known or known[name] in found:
            twice = "stands twice" if known.get(name) in found else f"is not one of {', '.join(known)}"
            raise InvalidValueError(f"compensate: '{name}' {twice}; entries are {EXAMPLE}")
        found[known[name]] = drift.sign_2dof(channel, known[name]) * parse_number(f"compensate: {name}", value, "rad/s")
    return found


def tables(
    found: Findings, put_in: Mapping[str, float], channel: str, attitudes: Mapping[str, tuple[Array, Array]]
) -> list[Table]:
    """Return what was put in, measured again and is left: of each coefficient, and of each attitude.

    put_in: of :func:`coefficients`.  attitudes: name -> drift (n,) and precession by the torquer without levelling
    (n,), rad/s.
    """
    own = {own_name(channel, n): drift.sign_2dof(channel, n) * v for n, v in put_in.items()}
    rows: list[list[Any]] = []
    for q, value, u, half in zip(found.quantities, found.value, found.u, found.reported.half_width, strict=True):
        known = q.combination or {q.name: 1.0}
        if not set(known) <= set(names(channel)):
            continue
        of_it = sum(factor * own.get(n, 0.0) for n, factor in known.items())
        left = float(value) - of_it
        beyond = "yes" if abs(left) > float(half) else "no"
        seen = [x / q.scale for x in (of_it, float(value), left, float(u))]
        rows.append([q.title, q.unit, *seen, beyond])
    head = ["coefficient", "unit", "put in", "measured again", "left", "u of type A", "left beyond its interval"]
    caption = "The drift itself, by the table and the current read, less what was put in"
    first = Table("compensation.coefficients", "Compensation: coefficients", caption, head, rows)
    each: list[list[Any]] = []
    for name, (omega_d, torqued) in attitudes.items():
        before, after = float(np.mean(omega_d)), float(np.mean(omega_d + torqued))
        each.append([name, before / DPH, float(np.mean(torqued)) / DPH, after / DPH])
    head = ["attitude", "drift / (°/h)", "by the torquer / (°/h)", "left / (°/h)"]
    caption = "Means over the windows of all dwells; by the torquer: without what levels the table"
    return [first, Table("compensation.attitudes", "Compensation: attitudes", caption, head, each)]


def sentence(found: Table) -> str:
    """Return how much of the systematic drift is left, rms over the attitudes."""
    before, after = (plain(float(np.sqrt(np.mean([row[k] ** 2 for row in found.rows]))), 3) for k in (1, 3))
    return f"Compensation leaves {after} °/h of a systematic drift of {before} °/h, rms over the attitudes."
