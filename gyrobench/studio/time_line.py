"""The plan of a test as a time line: a bar for each phase, as long as it takes, with its settling."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape

from nicegui import ui

from gyrobench.errors import GyrobenchError
from gyrobench.studio.words import say, spoken
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.plan import Phase
from gyrobench.system.system import System
from gyrobench.workflow.progress_words import format_duration

NARROW = 0.1  # share of the whole below which a bar has no text in it


class TimeLine:
    """The time line of a system's plan, and the phases as a table."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.bars = ui.html("", sanitize=False).classes("full")
        with ui.expansion(say("Phases")).props("dense").classes("full") as self.phases:
            self.table = ui.html("", sanitize=False).classes("scroll")
        self.show({})

    def show(self, values: Mapping[str, str]) -> None:
        """Draw the plan with these options; what is no plan (yet) leaves the last one."""
        own = {name: text for name, text in values.items() if name in self.system.options}
        try:
            plan = self.system.with_values(own).plan()
            phases: list[Phase | LoopPhase] = [*plan.phases]
        except (GyrobenchError, ValueError, ArithmeticError):
            return
        self.phases.set_visibility(bool(phases))
        if not phases:
            said = say("Its parts decide while it runs what comes when: there is no plan to draw.")
            self.bars.set_content(f'<p class="soft">{escape(said)}</p>')
            return
        times = [max(0.0, p.duration()) for p in phases]
        whole = sum(times) or 1.0
        modes = [getattr(p, "mode", "") or getattr(p, "kind", "") for p in phases]
        order = list(dict.fromkeys(modes))
        bars, rows = [], []
        for k, (phase, mode, time) in enumerate(zip(phases, modes, times, strict=True), 1):
            label = say(phase.label, self.system.name)
            words = f"{k} {label}: {say(mode)}, {_time(time)}"
            settled = min(100.0, 100.0 * phase.settle / time) if time else 0.0
            text = escape(label) if time > NARROW * whole else ""
            bars.append(
                f'<span class="phase mode{order.index(mode) % 6}" style="flex-grow:{max(time, 0.003 * whole):.6g}" '
                f'title="{escape(words)}"><i style="width:{settled:.3g}%"></i><b>{text}</b></span>'
            )
            cells = (str(k), label, say(mode), _time(phase.settle), _time(time))
            rows.append("<tr>" + "".join(f"<td>{escape(c)}</td>" for c in cells) + "</tr>")
        legend = "".join(
            f'<span><span class="key mode{i % 6}"></span> {escape(say(m))}</span>' for i, m in enumerate(order)
        )
        total = say(f"{len(phases)} phases, {_time(whole)} without the transitions between them")
        if len(phases) == 1:
            total = say(f"1 phase, {_time(whole)}")
        settles = f'<span><span class="key"><i></i></span> {escape(say("settling"))}</span>'
        self.bars.set_content(
            f'<div class="plan" role="img" {spoken(f"Plan over time: {total}")}>{"".join(bars)}'
            f'</div><p class="soft keys">{escape(total)}. {legend}{settles}</p>'
        )
        heads = "".join(f"<th>{escape(say(h))}</th>" for h in ("", "Phase", "Mode", "Settling", "Time"))
        self.table.set_content(f'<table class="runs"><tr>{heads}</tr>{"".join(rows)}</table>')


def _time(seconds: float) -> str:
    """Return a time in words: short ones to three digits."""
    return f"{seconds:.3g} s" if seconds < 60.0 else format_duration(seconds)
