"""What a report shows of an alignment: figures, stages, time to be ready against accuracy, budget."""

from __future__ import annotations

from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.result import BudgetLine, Response, Table

from . import plans
from .record import ARCMIN, ARCSEC, DEG, K, Run

GOALS = (60.0, 30.0, 15.0, 10.0, 5.0, 3.0, 2.0, 1.0, 0.5)  # ′
SHOWN = 700  # points of a drawn line


def figures(run: Run, fine: int) -> list[Response]:
    """Heading error with its interval, from the coarse heading on and in the gyrocompass; tilt; standard deviation."""
    north = run.first(plans.TO_NORTH)
    assert north is not None
    pick = np.unique(np.linspace(north, run.t.size - 1, min(SHOWN, run.t.size - north)).astype(int))
    t = run.t[pick].tolist()

    def curve(label: str, y: Array) -> dict[str, Any]:
        return {"label": label, "x": t, "y": y[pick].tolist(), "phase": []}

    error, half = run.error / ARCMIN, K * run.sigma / ARCMIN
    caption = (
        "Heading as computed less the true one, and the 95 % interval of the controller about 0, from the coarse "
        "heading on: turn to north, gyrocompass."
    )
    curves = [curve("error", error), curve("interval, high", half), curve("interval, low", -half)]
    y = error[pick].tolist()
    drawn = [
        Response("heading error", "time", caption, t, "time", "s", y, "heading error", "′", curves=curves),
    ]
    span = np.unique(np.linspace(0, run.t.size - 1, min(SHOWN, run.t.size)).astype(int))
    x = run.t[span].tolist()

    def decades(label: str, y: Array) -> dict[str, Any]:
        size = np.log10(np.maximum(np.hypot(*y.T) / ARCSEC, 1e-3))[span]
        return {"label": label, "x": x, "y": size.tolist(), "phase": []}

    both = [decades("true tilt", run.lean), decades("standard deviation", run.sigma_tilt)]
    caption = (
        "Tilt of the platform, common logarithm of arcseconds, and its standard deviation: levelling, then what the "
        "accelerometers leave."
    )
    name = "log₁₀ of the tilt in ″"
    drawn.append(Response("tilt", "time", caption, x, "time", "s", both[0]["y"], name, "1", curves=both))
    drawn.append(_against(run, fine))
    return drawn


def _reached(run: Run, goal: float) -> int | None:
    """Return the row from which the standard deviation of the heading at north stays at the goal (rad); None: never."""
    bad = run.sigma > goal
    if run.north is None or bad[-1]:
        return None
    stays = int(run.t.size - np.argmax(bad[::-1])) if bad.any() else 0
    return max(stays, run.north)


def _against(run: Run, fine: int) -> Response:
    """Time to be ready against the standard deviation wanted."""
    goals = np.geomspace(max(run.sigma[fine:].min(), 1e-9), run.sigma[fine:].max(), 60)
    rows = [(g / ARCMIN, float(run.t[k])) for g in goals for k in [_reached(run, float(g))] if k is not None]
    x, y = [r[0] for r in rows], [r[1] for r in rows]
    caption = "Time from switch-on to a standard deviation of the heading that is then kept, against that deviation."
    curves = [{"label": "this run", "x": x, "y": y, "phase": []}]
    name = "standard deviation wanted"
    return Response("ready time", "time", caption, x, name, "′", y, "time to be ready", "s", curves=curves)


def tables(
    record: Record, run: Run, settings: plans.Settings, sensors: plans.Sensors, h: plans.History | None
) -> list[Table]:
    found = [_stages(run, settings)]
    if h is None:
        return found
    sigma, truth = h.sigma(settings, sensors)[:, 2], not record.run.measured
    rows: list[list[Any]] = []
    for goal in GOALS:
        at = _reached(run, goal * ARCMIN)
        expected = plans.ready_after(h, sigma, goal * ARCMIN)
        error = run.error[at] / ARCMIN if at is not None and truth else None
        rows.append([goal, float(run.t[at]) if at is not None else None, expected, error])
    found.append(
        Table(
            "time_to_be_ready_against",
            "Time to be ready against accuracy",
            "From switch-on until the platform is at north and the standard deviation of its heading stays at "
            "the one wanted, within this run; by the controller and by the error model; true error at that time",
            ["standard deviation wanted / ′", "ready / s", "by the error model / s", "true error / ′"],
            rows,
        )
    )
    return found


def _stages(run: Run, settings: plans.Settings) -> Table:
    """When each stage began, its frequency and poles, and what it left."""
    rows: list[list[Any]] = []
    for stage in range(plans.LEVEL, plans.SLOW + 1):
        inside = np.flatnonzero(run.mode == stage)
        if not inside.size:
            continue
        w = {plans.FAST: settings.fast_frequency, plans.SLOW: settings.slow_frequency}.get(
            stage, settings.level_frequency
        )
        poles = ", ".join(_pole(p) for p in settings.poles(stage, w) if p.imag >= 0.0)
        last = inside[-1]
        known = run.sigma[last] < 3.0
        rows.append([plans.STAGES[stage - 1], float(run.t[inside[0]]), float(run.t[last] - run.t[inside[0]]), w, poles,
                     run.sigma[last] / ARCMIN if known else None, run.error[last] / ARCMIN if known else None,
                     float(np.hypot(*run.lean[last])) / ARCSEC])  # fmt: skip
    return Table(
        "stages",
        "Stages",
        "Natural frequency (of the falling one: the last) and poles of the levelling or gyrocompass loop; "
        "standard deviation and true error of the heading and true tilt at the end of each stage",
        ["stage", "from / s", "time / s", "ω / (rad/s)", "poles / (rad/s)", "σ(ψ) / ′", "error / ′", "tilt / ″"],
        rows,
    )


def _pole(p: complex) -> str:
    text = f"{p.real:.3g}" + (f" ± {p.imag:.3g}j" if p.imag else "")
    return text.replace("-", "−")


def budget(
    h: plans.History, run: Run, at: int, settings: plans.Settings, sensors: plans.Sensors, velocity: float
) -> list[BudgetLine]:
    """Sources of the heading's uncertainty at the instant it is stated for, by the error model.

    velocity: rms of a base that vibrates, m/s; its line is what the controller's variance has beyond the others.
    """
    lines = []
    for source, (size, unit, response) in h.sources(settings, sensors).items():
        effect = float(np.interp(run.t[at], h.t, response[:, 2])) / DEG
        if size > 0.0:
            shown = {"rad/s": (plans.DPH, "°/h"), "m/s2": (1e-6 * 9.80665, "µg"), "rad": (DEG, "°"), "1": (1.0, "1")}
            scale, name = shown[unit]
            note = "sign: of the error, computed less true"
            slope = effect / (size / scale)
            line = BudgetLine(source, size / scale, name, slope, f"°/({name})", abs(effect), "°", "ψ", note=note)
            lines.append(line)
        elif effect > 0.0:
            lines.append(BudgetLine(source, effect, "°", 1.0, "1", effect, "°", "ψ"))
    rest = run.sigma[at] ** 2 - sum((x.contribution * DEG) ** 2 for x in lines)
    if velocity > 0.0 and rest > 0.0:
        effect, size = float(np.sqrt(rest)) / DEG, 1e3 * velocity
        note = "by the controller: its variance less that of the other sources"
        lines.append(
            BudgetLine(
                "vibration_of_the_base",
                "vibration of the base",
                size,
                "mm/s",
                effect / size,
                "°/(mm/s)",
                effect,
                "°",
                "ψ",
                note=note,
            )
        )
    return sorted(lines, key=lambda x: -x.contribution)
