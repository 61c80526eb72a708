"""All channels of a record with several: tables, Allan deviations in one figure, correlation over averaging times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from gyrobench.report import style
from gyrobench.report.page_model import Picture, Section, pictures
from gyrobench.report.plots import plain_log, short
from gyrobench.report.result_json import Report
from gyrobench.report.tables import method_table
from gyrobench.result import DriftColumn, DriftRecordResult, Table

COLOURS = (style.BLUE, style.VERMILION, style.GREEN, style.ORANGE, style.PURPLE, style.SKY)
MARKS = ("o", "s", "^", "D", "v", "P")
BY_TIME = "correlation_by_time"
WIDE_HEADS = ("finding", "remarks", "amplitudes", "quantity")
ROWS = 24  # pairs of a figure


def sections(report: Report[DriftRecordResult]) -> list[Section]:
    """Return the section of all channels, none of a record with one."""
    result = report.result
    if not result.tables:
        return []
    shown: dict[str, list[Any]] = {}
    for k, table in enumerate(result.tables):
        shown[table.id] = method_table(report.document, ("tables", k), table, WIDE_HEADS)
    by_time = next((t for t in result.tables if t.id == BY_TIME), None)
    allan = Picture(
        "all-deviations", deviations(result.columns, "all-deviations"),
        "Allan deviations of all channels (points, without columns, lines, steps and wild samples) and of their models "
        "(lines of the same colour).", "Allan deviations of all channels with their models, logarithmic axes",
    )  # fmt: skip
    over_time = Picture(
        "correlation-by-time", correlation(by_time, "correlation-by-time") if by_time else "",
        "Correlation of the channels in hundredths over averaging times; empty: not told from zero (5 % for all "
        "pairs and times together).",
        "Correlation of each pair of channels against averaging time",
    )  # fmt: skip
    first = [b for id in ("gyros", "accelerometers") for b in shown.pop(id, [])]
    shown.pop(BY_TIME, None)  # as a figure; its values are in result.json
    rest = [b for blocks in shown.values() for b in blocks]
    blocks = [*first, *pictures(allan), *rest, *pictures(over_time)]
    return [Section("All channels", "channels", blocks)]


def deviations(columns: Sequence[DriftColumn], key: str) -> str:
    """Return the Allan deviations with the models, a panel for each unit."""
    units = list(dict.fromkeys(c.unit for c in columns))
    fig, axes = style.figure(style.WIDE, 84, ncols=len(units))
    drawn = False
    for ax, unit in zip(axes[0], units, strict=True):
        ax.set_xscale("log")
        ax.set_yscale("log")
        every: list[float] = []
        for k, c in enumerate(c for c in columns if c.unit == unit):
            colour, mark = COLOURS[k % len(COLOURS)], MARKS[k % len(MARKS)]
            d = c.deviations[0]
            points = [(t, v) for t, v in zip(d.tau, d.dev, strict=True) if v > 0.0]
            every += [v for _, v in points]
            ax.plot(*zip(*points, strict=True), mark, color=colour, markersize=3.0, markeredgewidth=0, label=c.name)
            if c.model:
                ax.plot(c.model.tau, c.model.dev, "-", color=colour, linewidth=0.9)
        if every:
            ax.set_ylim(0.5 * min(every), 2.0 * max(every))
            plain_log(ax, 4.0 * max(every) / min(every))
            drawn = True
        ax.set_xlabel(style.axis_label("averaging time", "s"))
        ax.set_ylabel(style.axis_label("Allan deviation", unit))
        ax.legend(loc="best", frameon=False)
    return style.svg(fig, key) if drawn else ""


def correlation(table: Table, key: str) -> str:
    """Return the correlations of pairs over averaging times as a map; head: times, rows: pair, values or None."""
    from matplotlib.patches import Rectangle

    shown = table.rows[:ROWS]
    if not shown:
        return ""
    fig, ax = style.chart(style.WIDE, 16 + 4.6 * len(shown))
    ax.grid(False)
    for i, row in enumerate(shown):
        for j, r in enumerate(row[1:]):
            if r is None:
                continue
            colour, depth = (style.BLUE if r > 0.0 else style.VERMILION), 0.7 * min(1.0, abs(r))
            ax.add_patch(Rectangle((j - 0.47, i - 0.44), 0.94, 0.88, facecolor=colour, alpha=depth, linewidth=0))
            text = f"{100.0 * r:.0f}".replace("-", "−")
            ax.text(j, i, "0" if text == "−0" else text, ha="center", va="center", color=style.INK, fontsize=6.5)
    ax.set_xlim(-0.5, len(table.columns) - 1.5)
    ax.set_ylim(len(shown) - 0.5, -0.5)
    ax.set_xticks(range(len(table.columns) - 1), [str(h).removesuffix(" s") for h in table.columns[1:]])
    ax.set_yticks(range(len(shown)), [short(str(row[0]), 28) for row in shown])
    ax.set_xlabel(style.axis_label("averaging time", "s"))
    return style.svg(fig, key)
