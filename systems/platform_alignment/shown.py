"""What a report shows of an alignment: figures, stages, time to be ready against accuracy, budget."""

from __future__ import annotations

from typing import Any

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_curves import line, over_time
from gyrobench.result import BudgetLine, Response, Table
from gyrobench.units import ARCMIN, ARCSEC, DEG

from . import planning, plans
from .record import Alignment, AlignmentColumns, K

GOALS = (60.0, 30.0, 15.0, 10.0, 5.0, 3.0, 2.0, 1.0, 0.5)  # ′
UNITS = {"rad/s": (plans.DPH, "°/h"), "m/s2": (1e-6 * 9.80665, "µg"), "rad": (DEG, "°"), "1": (1.0, "1")}


def figures(run: AlignmentColumns, fine: int) -> list[Response]:
    """Return the heading error with its interval, from the coarse heading on and in the gyrocompass; tilt; standard
    deviation.
    """
    north = run.first(plans.TO_NORTH)
    assert north is not None
    error, half = run.error[north:] / ARCMIN, K * run.sigma[north:] / ARCMIN
    lines = {"error": error, "interval, high": half, "interval, low": -half}
    caption = (
        "Heading as computed less the true one, and the 95 % interval of the controller about 0, from the coarse "
        "heading on: turn to north, gyrocompass."
    )
    heading = over_time("heading error", run.t[north:], lines, unit="′", caption=caption, envelope=False)
    tilts = {"true tilt": run.lean, "standard deviation": run.sigma_tilt}
    lines = {label: np.log10(np.maximum(np.hypot(*y.T) / ARCSEC, 1e-3)) for label, y in tilts.items()}
    caption = (
        "Tilt of the platform, common logarithm of arcseconds, and its standard deviation: levelling, then what the "
        "accelerometers leave."
    )
    name = "log₁₀ of the tilt in ″"
    tilt = over_time("tilt", run.t, lines, unit="1", y_name=name, caption=caption, envelope=False)
    return [heading, tilt, _against(run, fine)]


def _reached(run: AlignmentColumns, goal: float) -> int | None:
    """Return the row from which the standard deviation of the heading at north stays at the goal (rad); None: never."""
    bad = run.sigma > goal
    if run.north is None or bad[-1]:
        return None
    stays = int(run.t.size - np.argmax(bad[::-1])) if bad.any() else 0
    return max(stays, run.north)


def _against(run: AlignmentColumns, fine: int) -> Response:
    """Return the figure of the time to be ready against the standard deviation wanted."""
    goals = np.geomspace(max(run.sigma[fine:].min(), 1e-9), run.sigma[fine:].max(), 60)
    rows = [(g / ARCMIN, float(run.t[k])) for g in goals for k in [_reached(run, float(g))] if k is not None]
    x, y = np.array([r[0] for r in rows]), np.array([r[1] for r in rows])
    caption = "Time from switch-on to a standard deviation of the heading that is then kept, against that deviation."
    curves, name = [line("this run", x, y)], "standard deviation wanted"
    return Response("ready time", "time", caption, x.tolist(), name, "′", y.tolist(), "time to be ready", "s",
                    curves=curves)  # fmt: skip


def tables(a: Alignment) -> list[Table]:
    """Return the stages, and where the gyrocompass was reached the time to be ready against accuracy."""
    run, found = a.run, [_stages(a)]
    if a.fine is None:
        return found
    rows: list[list[Any]] = []
    for goal in GOALS:
        at = _reached(run, goal * ARCMIN)
        expected = planning.ready_after(a.history, a.sigma, goal * ARCMIN)
        error = run.error[at] / ARCMIN if at is not None and not a.record.run.measured else None
        rows.append([goal, float(run.t[at]) if at is not None else None, expected, error])
    caption = (
        "From switch-on until the platform is at north and the standard deviation of its heading stays at "
        "the one wanted, within this run; by the controller and by the error model; true error at that time"
    )
    columns = ["standard deviation wanted / ′", "ready / s", "by the error model / s", "true error / ′"]
    return [*found, Table("ready_times", "Time to be ready against accuracy", caption, columns, rows)]


def _stages(a: Alignment) -> Table:
    """Return when each stage began, its frequency and poles, and what it left."""
    run, settings = a.run, a.settings
    rows: list[list[Any]] = []
    frequency = {plans.FAST: settings.fast_frequency, plans.SLOW: settings.slow_frequency}
    for stage in range(plans.LEVEL, plans.SLOW + 1):
        inside = np.flatnonzero(run.mode == stage)
        if not inside.size:
            continue
        w = frequency.get(stage, settings.level_frequency)
        poles = ", ".join(_pole(p) for p in settings.poles(stage, w) if p.imag >= 0.0)
        last = inside[-1]
        known = run.sigma[last] < 3.0
        rows.append([plans.STAGES[stage - 1], float(run.t[inside[0]]), float(run.t[last] - run.t[inside[0]]), w, poles,
                     run.sigma[last] / ARCMIN if known else None, run.error[last] / ARCMIN if known else None,
                     float(np.hypot(*run.lean[last])) / ARCSEC])  # fmt: skip
    caption = (
        "Natural frequency (of the falling one: the last) and poles of the levelling or gyrocompass loop; "
        "standard deviation and true error of the heading and true tilt at the end of each stage"
    )
    columns = ["stage", "from / s", "time / s", "ω / (rad/s)", "poles / (rad/s)", "σ(ψ) / ′", "error / ′", "tilt / ″"]
    return Table("stages", "Stages", caption, columns, rows)


def _pole(p: complex) -> str:
    text = plain(p.real, 3) + (f" ± {plain(p.imag, 3)}j" if p.imag else "")
    return text.replace("-", "−")


def budget(a: Alignment, at: int) -> list[BudgetLine]:
    """Return the sources of the heading's uncertainty at the row it is stated for, by the error model.

    The line of a base that vibrates is what the controller's variance has beyond the others.
    """
    lines = []

    def add(id: str, size: float, unit: str, effect: float, note: str = "") -> None:
        per = "1" if unit == "°" else f"°/({unit})"
        slope = 1.0 if unit == "°" else effect / size
        name = plans.SOURCES[id]
        lines.append(BudgetLine(id, name, size, unit, slope, per, abs(effect), "°", "ψ", note=note))

    for id, (size, unit, response) in a.history.sources(a.settings, a.sensors).items():
        effect = float(np.interp(a.run.t[at], a.history.t, response[:, 2])) / DEG
        if size > 0.0:
            scale, name = UNITS[unit]
            add(id, size / scale, name, effect, "sign: of the error, computed less true")
        elif effect > 0.0:
            add(id, effect, "°", effect)
    rest = a.run.sigma[at] ** 2 - sum((x.contribution * DEG) ** 2 for x in lines)
    if a.shaken > 0.0 and rest > 0.0:
        note = "by the controller: its variance less that of the other sources"
        add("base.vibration", 1e3 * a.shaken, "mm/s", float(np.sqrt(rest)) / DEG, note)
    return sorted(lines, key=lambda x: -x.contribution)
