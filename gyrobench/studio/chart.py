"""Signals of a record over time, drawn by ECharts from views of a few thousand samples."""

from __future__ import annotations

import asyncio
import contextvars
import functools
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from nicegui import ui

from gyrobench.record.record import Record
from gyrobench.record.signal_view import SignalPyramid
from gyrobench.report.channel_figure import scaled
from gyrobench.studio.job_process import stored
from gyrobench.studio.words import say, spoken

POINTS = 2000  # of a signal
PANEL, GAP, TOP, BOTTOM = 170, 54, 30, 70  # px
COLOURS = ("#1f77b4", "#d9730d", "#2a8c4a", "#b3333b", "#7a4fb0", "#8a6d3b", "#c2579a", "#4d5b68")
TEXT, GRID = "#7b8791", "rgba(128, 140, 150, 0.3)"  # read on light and on dark ground
REDRAW = 1.0  # s between two drawings of a run under way
RECORDS = 3  # kept open
OPENING = threading.Lock()  # a record that two tabs ask for is read once
#: threads of their own: a page does not wait for one behind the pyramids of long records, which take seconds
DRAWING = ThreadPoolExecutor(2, "chart")
Drawn = TypeVar("Drawn")


async def drawn(work: Callable[[], Drawn]) -> Drawn:
    """Return what a chart needs, worked out in one of its threads."""
    return await asyncio.get_running_loop().run_in_executor(DRAWING, contextvars.copy_context().run, work)


class RecordSignals:
    """The channels of a record, and a pyramid of each that was looked at."""

    def __init__(self, record: Record) -> None:
        self.record = record
        self.time = record.channels["time"] if "time" in record.channels else np.empty(0)
        self.names = [n for n in record.channels if n != "time"]
        self._pyramids: dict[str, SignalPyramid] = {}
        self._turn = threading.Lock()

    @property
    def span(self) -> tuple[float, float]:
        """First and last time, s."""
        return (float(self.time[0]), float(self.time[-1])) if len(self.time) else (0.0, 0.0)

    def unit(self, name: str) -> str:
        """Return the SI unit of a channel."""
        return self.record.run.units.get(name, "") or "1"

    def pyramid(self, name: str) -> SignalPyramid:
        """Return the pyramid of a channel."""
        with self._turn:  # two tabs that ask at once have one pyramid
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
    with OPENING:
        return _signals(folder, (folder / "run.json").stat().st_mtime_ns)


@functools.lru_cache(maxsize=RECORDS)
def _signals(folder: Path, _changed: int) -> RecordSignals:
    return RecordSignals(Record.load(folder, on_request=True))


def panels(titles: Sequence[str], begin: float, end: float) -> dict[str, Any]:
    """Return the options of a chart over time, s: a panel for each title, one above the other, without series."""
    top = [TOP + k * (PANEL + GAP) for k in range(len(titles))]
    last = len(titles) - 1
    begin, end = float(f"{begin:.12g}"), float(f"{end:.12g}")  # the axis writes them with all their digits
    return {
        "animation": False, "color": list(COLOURS), "backgroundColor": "transparent",
        "textStyle": {"color": TEXT},
        "legend": {"type": "scroll", "top": 0, "textStyle": {"color": TEXT}}, "tooltip": {"trigger": "axis"},
        "axisPointer": {"link": [{"xAxisIndex": "all"}]},
        "grid": [{"left": 64, "right": 18, "top": t + 24, "height": PANEL} for t in top],
        "title": [
            {"text": text, "top": t, "left": 0, "textStyle": {"fontSize": 12, "color": TEXT}}
            for text, t in zip(titles, top, strict=True)
        ],
        "xAxis": [
            {"type": "value", "gridIndex": k, "min": begin, "max": end, "name": say("time in s") if k == last else "",
             "nameLocation": "middle", "nameGap": 24, "axisLabel": {"show": k == last, "color": TEXT},
             "splitLine": {"lineStyle": {"color": GRID}}}
            for k in range(len(titles))
        ],
        "yAxis": [{"type": "value", "gridIndex": k, "scale": True, "splitNumber": 4, "axisLabel": {"color": TEXT},
             "splitLine": {"lineStyle": {"color": GRID}}} for k in range(len(titles))],
    }  # fmt: skip


def height_of(count: int) -> str:
    """Return the style of a chart with so many panels."""
    return f"height: {TOP + BOTTOM + max(1, count) * (PANEL + GAP)}px"


class LiveChart:
    """Signals of a run while it is under way, from the file that its process writes."""

    def __init__(self, file: Path) -> None:
        self.file, self.read, self.drawn = file, 0, 0.0
        self.chart = ui.echart({"series": []}).classes("chart").props("role=img").props(spoken("Signals so far"))
        self.chart.set_visibility(False)

    def look(self, last: bool = False) -> None:
        """Draw the signals where there are new ones, at most once in ``REDRAW``; the last ones at once."""
        if time.monotonic() < self.drawn + REDRAW and not last:
            return
        try:
            changed = self.file.stat().st_mtime_ns
        except OSError:
            return
        options = _live(self.file, changed, say.code) if changed != self.read else None
        if options is None:
            return
        self.read, self.drawn = changed, time.monotonic()
        self.chart.set_visibility(True)
        self.chart.style(height_of(len(options["series"])))
        self.chart.options.clear()
        self.chart.options.update(options)
        self.chart.update()


@functools.lru_cache(maxsize=8)
def _live(file: Path, _changed: int, _language: str) -> dict[str, Any] | None:
    """Return the options of a chart of the signals so far, made once for all tabs that look at them."""
    content = stored(file)
    if content is None or not content["time"]:
        return None
    names, time = content["names"], content["time"]
    scales = [
        scaled([x for x in values if x is not None], unit or "1")
        for values, unit in zip(content["values"], content["units"], strict=True)
    ]
    options = panels([f"{n}, {unit or '1'}" for n, (_, unit) in zip(names, scales, strict=True)], time[0], time[-1])
    options["legend"] = {"show": False}
    options["series"] = [
        {"type": "line", "name": n, "id": n, "showSymbol": False, "xAxisIndex": k, "yAxisIndex": k,
         "lineStyle": {"width": 1.2},
         "data": [[t, None if x is None else factor * x] for t, x in zip(time, values, strict=True)]}
        for k, (n, values, (factor, _)) in enumerate(zip(names, content["values"], scales, strict=True))
    ]  # fmt: skip
    return options


class SignalChart:
    """Panels of signals of one or several records, a panel a unit; zoomed stretches are read anew."""

    def __init__(self, records: dict[str, RecordSignals]) -> None:
        self.records = records
        self.names: list[str] = []
        self.begin = min((s.span[0] for s in records.values() if len(s.time)), default=0.0)
        self.end = max((s.span[1] for s in records.values() if len(s.time)), default=0.0)
        self.view = (self.begin, self.end)
        self.chart = ui.echart({"series": []}).classes("chart").props("role=img").props(spoken("Signals over time"))
        self.chart.on("chart:datazoom", self._zoomed, ["batch", "start", "end"], throttle=0.25, leading_events=False)

    async def show(self, names: Sequence[str]) -> None:
        """Draw these signals over the whole record."""
        self.names = list(names)
        self.view = (self.begin, self.end)
        options = await drawn(self.options)
        self.chart.style(height_of(len(options["grid"])))
        self.chart.options.clear()
        self.chart.options.update(options)
        self.chart.update()

    def options(self) -> dict[str, Any]:
        """Return the options of the chart: a panel for each unit, the series of a view of each signal."""
        units = list(dict.fromkeys(self._unit(n) for n in self.names))
        scales = {u: self._scale(u) for u in units}
        chart = panels([say(f"in {scales[u][1] or '1'}") for u in units], self.begin, self.end)
        axes = list(range(len(units)))
        chart["dataZoom"] = [
            {"type": "inside", "xAxisIndex": axes, "filterMode": "none"},
            {"type": "slider", "xAxisIndex": axes, "filterMode": "none", "bottom": 8, "height": 22},
        ]
        return {**chart, "series": self._series(units, scales)}

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
        series = await drawn(lambda: self._series(units, {u: self._scale(u) for u in units}))
        self.chart.run_chart_method("setOption", {"series": series})
