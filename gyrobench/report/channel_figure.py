"""The figure of the recorded channels: a panel for each quantity, the elements of a vector together."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench import units as printed
from gyrobench.arrays import Array
from gyrobench.record.run_document import PlanRow
from gyrobench.report.numbers import superscript
from gyrobench.report.style import CYCLE, SHADE, WIDE, axis_label, envelope, figure, span_labels, svg, time_axis

MOST = 6  # panels of a system that does not say which channels it shows
DASHES: tuple[Any, ...] = ("-", (0, (6, 1.2)), (0, (2, 0.8)), (0, (6, 1, 1, 1)))

# what is recorded in SI and read in other units
_SHOWN = {"rad": ("°", 180.0 / math.pi), "rad/s": ("°/h", 648000.0 / math.pi)}
_PREFIXES = {-9: "n", -6: "µ", -3: "m", 3: "k", 6: "M"}
#: what the base, the load, the command and the test signal of a loop's exciter are called over the figure
_MODES = {"torque": "load", "command": "command", "test": "test", "motion": "base"}


def panels(
    record: Mapping[str, Any], units: Mapping[str, str], declared: Iterable[str] = (), most: int = MOST
) -> list[list[str]]:
    """Return the channels to draw, a list for each panel; those that never move are left out.

    declared: ``System.shown``, an entry for each panel: names, of a vector without its index.  Without it, the first
    ``most`` quantities of the record, counters and flags after the others; all of them where there are no more.
    """
    vectors: dict[str, list[str]] = {}
    columns = {name: np.asarray(values, dtype=float) for name, values in record.items()}
    for name in record:
        if name != "time":
            vectors.setdefault(re.sub(r"\[[\d,]+\]$", "", name), []).append(name)
    if declared:
        named = [[n for name in entry.split() for n in vectors.get(name, [])] for entry in declared]
        moving = [[n for n in names if _moves(columns[n])] for names in named]
        return [names for names in moving if names]
    if len(vectors) <= most:
        return list(vectors.values())

    def dull(base: str) -> bool:
        return all(_counts(columns[n], units.get(n, "")) or not _moves(columns[n]) for n in vectors[base])

    chosen = sorted(vectors, key=dull)[:most]
    return [names for base, names in vectors.items() if base in chosen]


def _moves(values: Array) -> bool:
    known = values[~np.isnan(values)]
    return known.size > 0 and bool(known.min() != known.max())


def _counts(values: Array, unit: str) -> bool:
    return unit == "1" and bool(np.all(np.isfinite(values) & (values == np.floor(values))))


def scaled(values: Sequence[float] | Array, unit: str) -> tuple[float, str]:
    """Factor and unit in which values recorded in an SI unit are easy to read: °, °/h, µV, mA, or 10⁻⁶ of the unit."""
    shown, factor = _SHOWN.get(unit, (printed.display(unit), 1.0))
    largest = float(np.abs(values).max(initial=0.0))
    if unit == "rad/s" and largest > printed.FAST:
        shown, factor = "°/s", 180.0 / math.pi
    size = factor * largest
    exponent = 3 * math.floor(math.log10(size) / 3.0) if size > 0.0 else 0
    if 1e-2 <= size < 1e5:
        return factor, shown
    if shown in ("V", "A", "N", "m", "s", "W") and exponent in _PREFIXES:
        return factor * 10.0**-exponent, _PREFIXES[exponent] + shown
    return factor * 10.0**-exponent, f"10{superscript(exponent)} {shown}"


def draw(
    record: Mapping[str, Any], shown: Sequence[Sequence[str]], units: Mapping[str, str], key: str,
    plan: Sequence[PlanRow] = (),
) -> str:  # fmt: skip
    """Channels against time, panels one above the other, decimated by their min-max envelope; "" where there are none.

    plan: of run.json; where the exciter recorded its phase, they are shaded by what was excited.
    """
    time = np.asarray(record["time"], dtype=float)
    if time.size < 3 or not shown:
        return ""
    divisor, time_unit = time_axis((float(time.min()), float(time.max())))
    spans = [(a / divisor, b / divisor, label) for a, b, label in _phases(record, plan)]
    strip = [0.12] if spans else []  # over the panels, for the names of the phases
    heights = [*strip, *[1.0] * len(shown)]
    fig, axes = figure(
        WIDE, 14 + 27 * len(shown) + 8 * len(strip), nrows=len(heights), sharex=True, height_ratios=heights
    )
    for ax, names in zip(axes[len(strip) :, 0], shown, strict=True):
        columns = [_finite(time, np.asarray(record[n], dtype=float)) for n in names]
        factor, unit = scaled(np.concatenate([y for _, y in columns]), units.get(names[0], "SI"))
        for k, (name, (t, y)) in enumerate(zip(names, columns, strict=True)):
            ax.plot(
                *envelope(t / divisor, y * factor), linestyle=DASHES[k % 4], color=CYCLE[k % len(CYCLE)], linewidth=0.8,
                label=name,
            )  # fmt: skip
        common = names[0] if len(names) == 1 else _common(names)
        ax.set_title(axis_label(common.rstrip("."), unit) if common else f"in {unit}", pad=3)
        if len(names) > 1:
            ax.legend(
                [n.removeprefix(common) for n in names], loc="lower right", bbox_to_anchor=(1.0, 1.0),
                ncols=len(names), borderaxespad=0.0, borderpad=0.1, handlelength=1.6, columnspacing=1.2,
            )  # fmt: skip
        ax.margins(x=0.01)
        ax.locator_params(axis="y", nbins=4)
    axes[-1, 0].set_xlabel(axis_label("time", time_unit))
    if spans:
        axes[0, 0].set_axis_off()
        axes[0, 0].margins(x=0.01)
        span_labels(axes[0, 0], spans)
        for ax in axes[1:, 0]:
            for start, end, _ in spans[::2]:
                ax.axvspan(start, end, color=SHADE, linewidth=0, zorder=0)
    return svg(fig, key, zoom=axes[-1, 0])


def _finite(t: Array, y: Array) -> tuple[Array, Array]:
    keep = np.isfinite(t) & np.isfinite(y)
    return t[keep], y[keep]


def _common(names: Sequence[str]) -> str:
    """Return what the names begin with: slot and variable of a vector's elements, else the slot, else nothing."""
    for pattern in (r"\[[\d,]+\]$", r"(?<=\.).*$"):
        heads = {re.sub(pattern, "", n) for n in names}
        if len(heads) == 1:
            return heads.pop()
    return ""


def _phases(record: Mapping[str, Any], plan: Sequence[PlanRow]) -> list[tuple[float, float, str]]:
    """Return begin and end, s, and name of what the exciter did; phases alike that follow one another are one."""
    numbers = next((record[n] for n in record if n.endswith(".phase")), None)
    words = {row.phase: _MODES.get(row.mode, row.label) for row in plan}
    spans: list[tuple[float, float, str]] = []
    if numbers is None:
        return []
    changes = np.flatnonzero(np.diff(numbers)) + 1
    for first, after in zip([0, *changes], [*changes, len(numbers)], strict=True):
        word = words.get(int(numbers[first]))
        if word is None:
            continue
        start = spans.pop()[0] if spans and spans[-1][2] == word else float(record["time"][first])
        spans.append((start, float(record["time"][after - 1]), word))
    return spans
