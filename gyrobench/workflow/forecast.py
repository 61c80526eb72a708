"""Forecast of a long run, after its first seconds: how long it will take, what makes it shorter, what Ctrl-C keeps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from gyrobench.engine.checkpoint import resume_obstacle
from gyrobench.errors import GyrobenchError
from gyrobench.system.system import System
from gyrobench.workflow.feedback import Feedback, Progress
from gyrobench.workflow.progress_words import format_duration

if TYPE_CHECKING:
    from gyrobench.engine.run_driver import ProgressReport
    from gyrobench.engine.session import Session

MEASURED = 5.0  # s of wall time from which the rest is told
LONG = 120.0  # s of wall time that are left, from which a run is a long one
WORTH = 0.1  # of the plan: what an option has to save to be named


def forecasting(
    progress: Progress | None, session: Session, step: float, kept: bool, checked: bool, feedback: Feedback
) -> Progress:
    """Return a progress that gives the forecast of a long run as a note, once.

    step: s.  kept: whether the run has a folder, where Ctrl-C leaves its record.  checked: whether whole runs for
    the effect of the step follow.
    """
    told = False

    def reported(report: ProgressReport) -> None:
        nonlocal told
        if progress is not None:
            progress(report)
        if told or report.elapsed < MEASURED:
            return
        told = True
        if report.eta > LONG:
            feedback.notes([f"{session.system.name}: {_sentences(report, session, step, kept, checked)}"])

    return reported


def _sentences(report: ProgressReport, session: Session, step: float, kept: bool, checked: bool) -> str:
    descriptions = session.assembly.descriptions
    why = f"{report.total / step:,.0f} steps of {step:g} s, {report.steps / report.elapsed:,.0f} a second"
    if slow := [s for s, d in descriptions.items() if d.coSimulation.needsExecutionTool]:
        why += f"; not native code: {', '.join(slow)}"
    words = " ".join(f"--set {name}={value}" for name, value in shorter(session.system).items())
    instead = f"{words}, or " if words else ""
    text = (
        f"the run takes {format_duration(report.eta)} more ({why}); "
        f"shorter: {instead}a coarser step where the parts take it, --step {2.0 * step:g}s"
    )
    if checked:  # a run with half the step, and for coefficients one with the step, both without noise
        text += f"; --check-step then takes {'three times' if session.system.has_reduction else 'twice'} as long"
    if kept:
        obstacle = resume_obstacle(descriptions)
        text += f"; Ctrl-C keeps {'the record until then' if obstacle else 'a checkpoint, --resume goes on from it'}"
    return text


def shorter(system: System) -> dict[str, str]:
    """Return options of the plan with half their values, as texts, that together shorten the test; {} where none do.

    A test may last as long as the longest of several options asks for, so all are halved, and those kept that count.
    """
    halves: dict[str, Any] = {}
    for name, option in system.options.items():
        if name == "settle":  # what it leaves would be in the data
            continue
        value = system[name]
        if option.unit == "s" and isinstance(value, float) and value > 0.0:
            halves[name] = 0.5 * value
        elif option.unit is int and value > 0:
            halves[name] = value // 2
        if name in halves and option.min is not None and halves[name] < option.min:
            del halves[name]

    def length(without: str = "") -> float:
        """Return the length of the plan with the halves but one, s; infinite where the system refuses them."""
        try:
            other = system.with_values({n: v for n, v in halves.items() if n != without})
            other.refuse()
        except GyrobenchError:
            return math.inf
        return other.plan().duration()

    spared = WORTH * system.plan().duration()
    least = length()
    if not least < system.plan().duration() - spared:
        return {}
    needed = {n: v for n, v in halves.items() if length(n) > least + spared}
    return {n: str(v) if isinstance(v, int) else f"{v:g}s" for n, v in needed.items()}
