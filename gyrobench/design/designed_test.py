"""A designed test or suite: options, time, predicted uncertainties, and its text.

The text: what is reached, the plan as a command, time saved, what the plan does not determine.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from gyrobench.report.plain_text import align_columns
from gyrobench.report.result_json import plain

SHOWN = 12  # places in the table of the plan


@dataclass(frozen=True)
class DesignedValue:
    """wanted, predicted u (as the reduction will state it), error (rms of the estimate), in ``unit``; book: u of the
    system's own plan.  None: nothing was wanted of it.
    """

    name: str
    unit: str
    wanted: float | None
    u: float
    error: float
    book: float


@dataclass(frozen=True)
class DesignedTest:
    """options: of the system, for --set.  time, book_time: s of the plan, and of the system's own at equal uncertainty
    (in a given time: the same time).  bound: s below which no plan reaches what is wanted; shares_efficiency: of the
    shares of the time among the places under white noise, 1 is optimal; NaN where options and not places are chosen:
    tried: the choices of options with their times.  counted: mean u, standard deviation of the estimates, runs.
    """

    system: str
    given: Mapping[str, Any]
    options: Mapping[str, Any]
    plan: tuple[tuple[str, float], ...]
    time: float
    book_time: float
    bound: float
    shares_efficiency: float
    timed: bool
    criterion: str
    values: Mapping[str, DesignedValue]
    unseen: tuple[str, ...]
    counted: Mapping[str, tuple[float, float, int]] = field(default_factory=dict)
    tried: tuple[tuple[str, float], ...] = ()

    @property
    def command(self) -> str:
        """Return the command that runs the plan."""
        settings = {**self.given, **self.options}
        text = " ".join(f"--set {shlex.quote(f'{n}={v}')}" for n, v in settings.items())
        return f"gyrobench run {self.system} {text}".rstrip()

    def as_dict(self) -> dict[str, Any]:
        """Return plain JSON values; infinite times and what is not known are null."""
        return {**plain(asdict(self)), "command": self.command}

    def __str__(self) -> str:
        return format_design(self)


@dataclass(frozen=True)
class DesignedSuite:
    """tests: in the order to be made.  others: designed and not needed.  left_out: test -> why it has no plan."""

    suite: str
    tests: tuple[DesignedTest, ...]
    others: tuple[DesignedTest, ...]
    left_out: Mapping[str, str]

    @property
    def time(self) -> float:
        """Return the time of all tests, s; changes from one to the next are not in it."""
        return sum(t.time for t in self.tests)

    def as_dict(self) -> dict[str, Any]:
        """Return plain JSON values."""
        named = {"tests": [t.as_dict() for t in self.tests], "others": [t.as_dict() for t in self.others]}
        return {"suite": self.suite, "time": self.time, **named, "left_out": dict(self.left_out)}

    def __str__(self) -> str:
        return format_suite_design(self)


def format_design(found: DesignedTest) -> str:
    """Return the lines that the command prints."""
    # the own plan's u: of the plan as it is; in a given time, in that time
    rows = [["value", "wanted u", "predicted u", "rms error", "own plan's u", "unit"]]
    for v in found.values.values():
        wanted = "" if v.wanted is None else f"{v.wanted:.3g}"
        rows.append([v.name, wanted, f"{v.u:.3g}", f"{v.error:.3g}", f"{v.book:.3g}", v.unit])
    if found.counted:
        number = next(iter(found.counted.values()))[2]
        rows[0] += [f"u, {number} runs", "rms error"]
        for row, name in zip(rows[1:], found.values, strict=True):
            u, error, _ = found.counted.get(name, (float("nan"), float("nan"), 0))
            row += [f"{u:.3g}", f"{error:.3g}"]
    chosen = found.plan[0][0] if found.tried else f"{len(found.plan)} visits"
    lines = [f"{found.system}: {chosen}, {_time(found.time)}", "", *align_columns(rows, {0, 5}), ""]
    if found.tried:
        each = [f"{n} {x:.3g} u/wanted" if found.timed else f"{n} {_time(x)}" for n, x in found.tried]
        lines += [f"Compared: {'; '.join(each)}.", "", _saving(found), ""]
    else:
        lines += [_places(found), "", _saving(found), _bound(found), ""]
    if found.unseen:
        lines += ["Not determined by this plan, or not in its u:", *(f"  {u}" for u in found.unseen), ""]
    return "\n".join([*lines, found.command])


def _places(found: DesignedTest) -> str:
    total: dict[str, float] = {}
    for label, t in found.plan:
        total[label] = total.get(label, 0.0) + t
    most = sorted(total.items(), key=lambda x: -x[1])
    shown = [f"{label} {t:.4g} s" for label, t in most[:SHOWN]]
    more = f", and {len(most) - SHOWN} more places" if len(most) > SHOWN else ""
    return f"Averaged at: {', '.join(shown)}{more}."


def _saving(found: DesignedTest) -> str:
    if found.timed:
        return f"All plans take {_time(found.time)}; the table compares their uncertainties."
    if found.book_time == float("inf"):
        return "The system's own plan does not reach this in any time."
    ratio = found.time / found.book_time
    return (
        f"The system's own plan, its length fitted, takes {_time(found.book_time)} for the same; this "
        f"plan takes {ratio:.2f} of it."
    )


def _bound(found: DesignedTest) -> str:
    shares = f"Shares of the time among the places: efficiency {found.shares_efficiency:.3f} under white noise"
    if found.timed:
        return f"{shares}."
    percent = max(0.0, 100.0 * (1.0 - found.bound / found.time))
    return (
        f"No plan of these places is more than {percent:.0f} % shorter: with the white part of the noise alone, known "
        f"and not estimated, and without moves it takes {_time(found.bound)}. {shares}."
    )


def _time(seconds: float) -> str:
    if seconds < 600.0:
        return f"{seconds:.4g} s"
    return f"{seconds / 60.0:.4g} min" if seconds < 7200.0 else f"{seconds / 3600.0:.4g} h"


def format_suite_design(found: DesignedSuite) -> str:
    """Return the lines that the command prints of a suite: its tests one after the other, then what was not needed."""
    names = ", then ".join(t.system for t in found.tests)
    lines = [f"{found.suite}: {names}, {_time(found.time)} in all", ""]
    for test in found.tests:
        lines += [format_design(test), ""]
    for test in found.others:
        reached = ", ".join(v.name for v in test.values.values() if v.wanted is not None)
        lines.append(f"Not needed: {test.system}, {_time(test.time)} for {reached}.")
    lines += [f"Left out: {name}: {why}." for name, why in found.left_out.items()]
    return "\n".join(lines)
