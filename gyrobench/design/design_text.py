"""A designed test as text: what is reached, the plan as a command, time saved, what the plan does not determine."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gyrobench.design.plan_runs import DesignedTest
    from gyrobench.design.suite_design import DesignedSuite

SHOWN = 12  # places in the table of the plan


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
    lines = [f"{found.system}: {chosen}, {_time(found.time)}", "", *_table(rows), ""]
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


def _table(rows: list[list[str]]) -> list[str]:
    widths = [max(len(row[k]) for row in rows) for k in range(len(rows[0]))]
    return [
        "  ".join(
            cell.ljust(w) if k in (0, 5) else cell.rjust(w) for k, (cell, w) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]


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
