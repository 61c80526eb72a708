"""Sampled loop with an axis given as data: a transfer function with delay, or a measured response.  [SAMPLED-PLANT]"""

from __future__ import annotations

import csv
import math
from pathlib import Path

import numpy as np

from gyrobench.linear.sampled_loop import AnalogPlant, DigitalLoop, MeasuredPlant, SampledLoopError
from gyrobench.result import Table

from . import closed_form

COLUMNS = ("frequency_hz", "gain", "phase_deg")
__all__ = ["SampledLoopError", "margins_table", "plant_of"]


def plant_of(text: str) -> AnalogPlant | MeasuredPlant | None:
    """Return the plant of the option: "num | den | delay", falling powers of s, rad/(N.m) and s, or a CSV file with
    columns frequency_hz, gain (rad/(N.m)), phase_deg; None for "".  Raises SampledLoopError.
    """
    if not text.strip():
        return None
    if text.strip().endswith(".csv"):
        return _measured(Path(text.strip()))
    fields = [f.split() for f in text.split("|")]
    try:
        num, den, *rest = ([float(x) for x in f] for f in fields)
        delay = rest[0][0] if rest else 0.0
    except (ValueError, IndexError):
        raise SampledLoopError(
            f"plant = {text!r}: numbers by falling powers of s, as in '1 | 2.56 0.4 0 | 0.002', or a file .csv"
        ) from None
    return AnalogPlant.of_polynomials(num, den, delay)


def _measured(path: Path) -> MeasuredPlant:
    """Return the plant of a table of its response.  Raises SampledLoopError."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.DictReader(file))
        f, gain, phase = (np.array([float(r[n]) for r in rows]) for n in COLUMNS)
    except (OSError, KeyError, ValueError, TypeError) as problem:
        text = f"plant = {path}: a table with columns {', '.join(COLUMNS)} is needed: {problem}"
        raise SampledLoopError(text) from None
    return MeasuredPlant(2.0 * math.pi * f, gain * np.exp(1j * np.radians(phase)))


def margins_table(text: str, loop: closed_form.SampledLoop | None) -> Table | None:
    """Return margins and poles of the controller's law with the axis of the option; None without either."""
    plant = plant_of(text)
    if plant is None or loop is None:
        return None
    b, g, a, scale = loop.gains()
    if isinstance(plant, AnalogPlant):
        late: AnalogPlant | MeasuredPlant = AnalogPlant(plant.A, plant.B, plant.C, plant.delay + loop.delay)
    else:
        late = MeasuredPlant(plant.w, plant.values * np.exp(-1j * plant.w * loop.delay))
    sampled = DigitalLoop(late, (scale * g, -scale * a), (1.0, -b), loop.T)
    m = sampled.margins()
    finite = [x if math.isfinite(x) else None for x in (m.gain, math.degrees(m.phase), m.crossover / 2.0 / math.pi)]
    row: list[float | None] = [*finite, m.modulus, None, None]
    if isinstance(plant, AnalogPlant):
        delay = sampled.delay_margin()
        row[4] = float(np.abs(sampled.poles()).max())
        row[5] = 1e3 * delay if math.isfinite(delay) else None
    head = ["gain margin", "phase margin / °", "crossover / Hz", "distance to −1", "largest pole", "delay margin / ms"]
    caption = "The law of the controller before the axis given, exactly sampled; a pole of 1 or more: unstable."
    return Table("rates.plant", "Sampled loop with the axis as data", caption, head, [row])
