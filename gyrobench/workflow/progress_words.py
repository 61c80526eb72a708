"""Progress of a run in words."""

from __future__ import annotations

from typing import Any


def format_duration(seconds: float) -> str:
    """Return a duration for people: 75 s is "1 min 15 s"."""
    if not seconds < 1e6:
        return "unknown"
    total = round(seconds)
    hours, minutes, seconds_left = total // 3600, total // 60 % 60, total % 60
    if hours:
        return f"{hours} h {minutes:02d} min"
    return f"{minutes} min {seconds_left:02d} s" if minutes else f"{seconds_left} s"


def format_status(status: Any) -> str:
    """Return simulated time, rate and time left of a :class:`gyrobench.engine.run_driver.ProgressReport`.

    The progress of anything else has its own ``words``.
    """
    if hasattr(status, "words"):
        return str(status.words)
    rate = status.steps / max(status.elapsed, 1e-9)
    speed = f"{rate / 1e6:.2f} M steps/s" if rate >= 1e5 else f"{rate:,.0f} steps/s"
    if status.time >= status.total:  # the transitions between the phases of a plan are not known beforehand
        return f"t = {status.time:,.0f} s, {speed}, finishing"
    return f"t = {status.time:,.0f} of {status.total:,.0f} s, {speed}, {format_duration(status.eta)} left"
