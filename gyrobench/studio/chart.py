"""Signals of a record over time, drawn by ECharts from views of a few thousand samples."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import ui

from gyrobench.record.record import Record
from gyrobench.record.signal_view import SignalPyramid
from gyrobench.report.channel_figure import scaled

POINTS = 2000  # of a signal
PANEL, GAP, TOP, BOTTOM = 170, 54, 30, 70  # px
COLOURS = ("#1f77b4", "#d9730d", "#2a8c4a", "#b3333b", "#7a4fb0", "#8a6d3b", "#c2579a", "#4d5b68")
FIRST = 4  # signals shown at first
RECORDS = 4  # kept open


class RecordSignals:
    """The channels of a record, and a pyramid of each that was looked at."""

    def __init__(self, record: Record) -> None:
        self.record = record
        self.time = record.channels.get("time", np.empty(0))
        self.names = [n for n in record.channels if n != "time"]
        self._pyramids: dict[str, SignalPyramid] = {}

    @property
    def span(self) -> tuple[float, float]:
        """First and last time, s."""
        return (float(self.time[0]), float(self.time[-1])) if len(self.time) else (0.0, 0.0)

    def unit(self, name: str) -> str:
        """Return the SI unit of a channel."""
        return self.record.run.units.get(name, "") or "1"

    def pyramid(self, name: str) -> SignalPyramid:
        """Return the pyramid of a channel."""
        if name not in self._pyramids:
            self._pyramids[name] = SignalPyramid(self.time, self.record.channels[name])
        return self._pyramids[name]

    def points(self, name: str, begin: float, end: float, factor: float) -> list[list[float | None]]:
        """Return [time, value] of a view of a channel; a gap where the value is not finite."""
        view = self.pyramid(name).view(begin, end, POINTS)
        values = view.values * factor
        finite = np.isfinite(values)
        return [
            [t, y if ok else None]
            for t, y, ok in zip(view.time.tolist(), values.tolist(), finite.tolist(), strict=True)
        ]


def signals_of(folder: Path) -> RecordSignals:
    """Return the signals of a run; a record is read once while it stays the same."""
    return _signals(folder, (folder / "run.json").stat().st_mtime_ns)


@functools.lru_cache(maxsize=RECORDS)
def _signals(folder: Path, _changed: int) -> RecordSignals:
    return RecordSignals(Record.load(folder))


def first_shown(names: Sequence[str], shown: Sequence[Any]) -> list[str]:
    """Return the signals that are drawn at first: those that the system's report draws, else the first ones."""
    wanted = [n for entry in shown for n in (entry if isinstance(entry, list | tuple) else [entry])]
    found = [n for n in names if n in wanted or n.partition("[")[0] in wanted]
    return (found or list(names))[:FIRST]


class SignalChart:
    """Panels of signals of one or several records, a panel a unit; zoomed stretches are read anew."""

    def __init__(self, records: dict[str, RecordSignals]) -> None:
        self.records = records
        self.names: list[str] = []
        self.begin = min((s.span[0] for s in records.values() if len(s.time)), default=0.0)
        self.end = max((s.span[1] for s in records.values() if len(s.time)), default=0.0)
        self.view = (self.begin, self.end)
        self.chart = ui.echart({"series": []}).classes("chart").props('role=img aria-label="Signals over time"')
        self.chart.on("chart:datazoom", self._zoomed, ["batch", "start", "end"], throttle=0.25, leading_events=False)

    async def show(self, names: Sequence[str]) -> None:
        """Draw these signals over the whole record."""
        self.names = list(names)
        self.view = (self.begin, self.end)
        options = await asyncio.to_thread(self.options)
        height = TOP + BOTTOM + max(1, len(options["grid"])) * (PANEL + GAP)
        self.chart.style(f"height: {height}px")
        self.chart.options.clear()
        self.chart.options.update(options)
        self.chart.update()

    def options(self) -> dict[str, Any]:
        """Return the options of the chart: a grid for each unit, the series of a view of each signal."""
        units = list(dict.fromkeys(self._unit(n) for n in self.names))
        scales = {u: self._scale(u) for u in units}
        top = [TOP + k * (PANEL + GAP) for k in range(len(units))]
        grids = [{"left": 64, "right": 18, "top": t + 24, "height": PANEL} for t in top]
        axes = list(range(len(units)))
        last = len(units) - 1
        return {
            "animation": False, "color": list(COLOURS), "backgroundColor": "transparent",
            "legend": {"type": "scroll", "top": 0}, "tooltip": {"trigger": "axis"},
            "axisPointer": {"link": [{"xAxisIndex": "all"}]}, "grid": grids,
            "title": [
                {"text": f"in {scales[u][1] or '1'}", "top": t, "left": 0, "textStyle": {"fontSize": 12}}
                for u, t in zip(units, top, strict=True)
            ],
            "xAxis": [
                {"type": "value", "gridIndex": k, "min": self.begin, "max": self.end, "nameLocation": "middle",
                 "name": "time in s" if k == last else "", "nameGap": 24, "axisLabel": {"show": k == last}}
                for k in axes
            ],
            "yAxis": [{"type": "value", "gridIndex": k, "scale": True, "splitNumber": 4} for k in axes],
            "dataZoom": [{"type": "inside", "xAxisIndex": axes, "filterMode": "none"},
                         {"type": "slider", "xAxisIndex": axes, "filterMode": "none", "bottom": 8, "height": 22}],
            "series": self._series(units, scales),
        }  # fmt: skip

    def _unit(self, name: str) -> str:
        return next(s.unit(name) for s in self.records.values() if name in s.names)

    def _scale(self, unit: str) -> tuple[float, str]:
        """Return factor and unit in which the signals of a unit are easy to read."""
        values = [
            s.pyramid(n).view(*self.view, 64).values
            for s in self.records.values()
            for n in self.names
            if n in s.names and s.unit(n) == unit
        ]
        finite = np.concatenate(values) if values else np.empty(0)
        return scaled(finite[np.isfinite(finite)], unit)

    def _series(self, units: list[str], scales: dict[str, tuple[float, str]]) -> list[dict[str, Any]]:
        found = []
        for run_name, signals in self.records.items():
            for name in self.names:
                if name not in signals.names:
                    continue
                at = units.index(self._unit(name))
                factor = scales[self._unit(name)][0]
                label = name if len(self.records) == 1 else f"{name}, {run_name}"
                found.append(
                    {"type": "line", "name": label, "id": label, "showSymbol": False, "xAxisIndex": at,
                     "yAxisIndex": at, "lineStyle": {"width": 1.2}, "data": signals.points(name, *self.view, factor)}
                )  # fmt: skip
        return found

    async def _zoomed(self, event: Any) -> None:
        """Read the stretch that is shown now, and put it into the chart."""
        content = event.args or {}
        found = (content.get("batch") or [content])[0]
        low, high = found.get("start"), found.get("end")
        if low is None or high is None:
            return
        span = self.end - self.begin
        self.view = (self.begin + span * low / 100.0, self.begin + span * high / 100.0)
        units = list(dict.fromkeys(self._unit(n) for n in self.names))
        series = await asyncio.to_thread(lambda: self._series(units, {u: self._scale(u) for u in units}))
        self.chart.run_chart_method("setOption", {"series": series})
