"""Reduction of an alignment: heading with interval against time, tilt, time to be ready, budget of the heading.

Heading and its standard deviation are those of the controller; what they are worth is held against the true attitude
of a simulated run, against the error model of :mod:`plans`, and against the tilt that the accelerometers show.
[ALIGN-GYRO]

Not modelled: what a wrong statement of the sensors' errors does to the interval beyond those two checks.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gyrobench import units
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.fit_result import plus_minus
from gyrobench.reduction.setup import run_metadata
from gyrobench.result import Coefficient, LoopResult, Specification

from . import plans, shown
from .record import ARCMIN, K, Run, read

AT_LIMIT = 0.1  # share of the second half of the gyrocompass with a limit active
RESTLESS = 2.0  # rms of the tilt as measured over the one expected, beyond which the platform moves more than is stated
DOUBT = 4.0  # standard deviations by which a simulated heading may be off before the run says so
SETTLING = 0.5  # largest departure of the controller's standard deviation from that of the error model


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """Result of a record.  Raises ReductionError for a run that was stopped before its platform was level."""
    run = read(record)
    settings, sensors = told(record)
    fine = run.first(plans.FAST)
    reasons = problems(record, run, settings, sensors)
    heading = run.first(plans.TO_NORTH)
    final = _final(run)
    rows: list[Coefficient] = []
    none = "" if final is not None else "the platform never came to the gyrocompass"
    void = next((text for text, kind in reasons if kind == "void"), "")
    at = final if final is not None else run.t.size - 1
    rows.append(_value("ψ", _heading_meaning(run, at), "deg", run.psi[at], run.sigma[at], run.true[at],
                       none or void, specification))  # fmt: skip
    if heading is not None:
        rows.append(_value("ψ_coarse", "heading of the axis y by the coarse stage", "deg", run.psi[heading],
                           run.sigma[heading], run.true[heading], void, specification))  # fmt: skip
    for k, axis in enumerate("xy"):
        rows.append(_value(f"tilt_{axis}", f"tilt of the platform about {axis}", "arcsec", 0.0, run.sigma_tilt[at, k],
                           run.lean[at, k], none or void, specification))  # fmt: skip
    h = _history(run, settings, sensors) if fine is not None else None
    rows.append(_ready(run, h, settings, sensors, record, void, specification))
    result = LoopResult(
        system="platform_alignment",
        title="Alignment of a gyro platform",
        method="Levelling, coarse heading and gyrocompass by the platform's own gyros and accelerometers; standard "
        "deviations of the linear error model in closed loop",
        sources=["ALIGN-GYRO; GSP ch. 5, section 5.3.2 (windows and positions), own derivation (loops and errors)"],
        equation="dot(phi)_x = u_x + d_x + U phi_y - N phi_z, quad dot(phi)_y = u_y + d_y - U phi_x, quad "
        'dot(phi)_z = u_z + d_z + N phi_x, quad psi - psi_"true" = phi_z',
        conventions=[
            "Headings ψ of the platform axis y are clockwise from north. Error: heading as computed less the true one.",
            "N, U: north and up component of the Earth rate. Tilt about x positive: y points up; about y: x down.",
            "Drift d in precession sign, what is left after the known drift; b: bias of an accelerometer.",
        ],
        coefficients=rows,
        responses=shown.figures(run, fine) if fine is not None else [],
        tables=shown.tables(record, run, settings, sensors, h),
        budget=shown.budget(h, run, at, settings, sensors, shaken(record)) if h is not None else [],
        warnings=[text[:1].upper() + text[1:] + "." * (text[-1] != ".") for text, _ in reasons] + _limits(record),
        decision_rule=uncertainty.DECISION_RULE,
        verdict=uncertainty.worst_verdict(c.verdict for c in rows),
        instrument=record.run.instrument,
        simulated=not record.run.measured,
        site=run_metadata.Site.of(record.run).shown(),
        ranked_by="ready time",
    )
    result.summary = _summary(result, run, settings, heading, final)
    return uncertainty.withhold(run_metadata.finish(result, record), [t for t, kind in reasons if kind == "doubt"])


def told(record: Record) -> tuple[plans.Settings, plans.Sensors]:
    """Return the settings of the controller and what it was told of its sensors."""
    p = record.run.parameters

    def of(name: str, default: float) -> float:
        return float(p.get(f"controller.{name}", default))

    s = plans.Settings(of("latitude", float(record.run.options["latitude"])))
    settings = plans.Settings(
        s.latitude, of("gravity", s.gravity), of("earth_rate", s.earth_rate), int(of("positions", 1)),
        of("coarse_time", s.coarse_time), int(of("order", 3)), of("damping", s.damping),
        of("level_frequency", s.level_frequency), of("fast_frequency", s.fast_frequency), of("fast_time", s.fast_time),
        of("slow_frequency", s.slow_frequency), of("rate_max", s.rate_max),
    )  # fmt: skip
    g = plans.GRADES["navigation"]
    sensors = plans.Sensors(
        of("errors_bias", g.bias), of("errors_markov", g.markov), of("errors_white", g.white),
        of("errors_accelerometer", g.accelerometer), of("errors_force", g.force), of("errors_tau", g.tau),
        of("errors_latitude", 0.0), of("errors_scale", 0.0),
    )  # fmt: skip
    return settings, sensors


def shaken(record: Record) -> float:
    """Return the rms velocity of the base that the controller is told of, m/s."""
    return float(record.run.parameters.get("controller.errors_vibration", 0.0))


def _final(run: Run) -> int | None:
    """Return the row that the heading is stated for: where it became ready for good, else the last one."""
    if run.first(plans.FAST) is None:
        return None
    if run.ready[-1] == 1.0:
        return int(run.t.size - np.argmax(run.ready[::-1] == 0.0)) if not run.ready.all() else 0
    return int(run.t.size - 1)


def _heading_meaning(run: Run, at: int) -> str:
    return f"heading of the axis y {'when it is ready' if run.ready[at] == 1.0 else 'at the end, not ready'}"


def _value(
    name: str, meaning: str, unit: str, value: float, u: float, true: float, no_value: str,
    specification: Specification | None, closed: float | None = None,
) -> Coefficient:  # fmt: skip
    scale = units.factor(unit)
    estimate, size, limit = value / scale, u / scale, (specification or {}).get(name)
    truth = estimate + math.remainder(true - value, 2.0 * math.pi) / scale
    if no_value:
        nan = math.nan
        return Coefficient(name, meaning, units.display(unit), nan, nan, K, (nan, nan), limit=limit, verdict="void",
                           no_value=no_value)  # fmt: skip
    return Coefficient(
        name, meaning, units.display(unit), estimate, size, K, (estimate - K * size, estimate + K * size), truth=truth,
        z=(estimate - truth) / size if size > 0.0 else None, limit=limit, closed=closed,
        verdict=uncertainty.assess_conformity(estimate, K * size, limit),
    )  # fmt: skip


def _ready(
    run: Run, h: plans.History | None, settings: plans.Settings, sensors: plans.Sensors, record: Record, void: str,
    specification: Specification | None,
) -> Coefficient:  # fmt: skip
    """The time to be ready; closed: by the error model.  No value where the heading was not held ready."""
    wanted = float(record.run.options["wanted"])
    limit = (specification or {}).get("ready time")
    expected = None if h is None else plans.ready_after(h, h.sigma(settings, sensors)[:, 2], wanted)
    meaning = f"from switch-on to a standard deviation of {wanted / ARCMIN:.3g}′, held to the end"
    if void or run.ready[-1] != 1.0:
        nan = math.nan
        why = void or f"not ready: {_why_not(run, wanted)}"
        return Coefficient("ready time", meaning, "s", nan, nan, K, (nan, nan), limit=limit, verdict="void",
                           no_value=why)  # fmt: skip
    t = float(np.asarray(record.channels["controller.ready_time"])[-1])
    return Coefficient("ready time", meaning, "s", t, 0.0, K, (t, t), closed=expected, limit=limit,
                       verdict=uncertainty.assess_conformity(t, 0.0, limit))  # fmt: skip


def _why_not(run: Run, wanted: float) -> str:
    words = {2.0: "the rates contradict the Earth rate", 3.0: "the platform is not level"}
    if run.status[-1] in words:
        return words[float(run.status[-1])]
    if run.mode[-1] < plans.FAST:
        return f"the run ended in the stage {plans.STAGES[int(run.mode[-1]) - 1]}"
    return f"standard deviation {run.sigma[-1] / ARCMIN:.3g}′ at the end, {wanted / ARCMIN:.3g}′ wanted"


def _history(run: Run, settings: plans.Settings, sensors: plans.Sensors) -> plans.History:
    """Return the error model along this run: its levelling time and its coarse heading."""
    first = run.first(plans.COARSE)
    north = run.first(plans.TO_NORTH)
    assert first is not None and north is not None
    psi = float(run.psi[north]) + (math.pi if settings.positions == 2 else 0.0)
    level = max(float(run.t[first]), 1.0)
    return plans.history(
        replace(settings, level=level), math.remainder(psi, 2.0 * math.pi), float(run.t[-1]), sensors.tau
    )


def problems(record: Record, run: Run, settings: plans.Settings, sensors: plans.Sensors) -> list[tuple[str, str]]:
    """Return sentences with "void" (no figure has a value) or "doubt" (no verdict)."""
    found: list[tuple[str, str]] = []
    fine = run.first(plans.FAST)
    if not np.all(np.isfinite(run.sigma)) or not np.all(np.isfinite(run.psi)):
        return [("the controller's heading is not finite", "void")]
    if fine is None:
        text = f"the run ended in the stage {plans.STAGES[int(run.mode[-1]) - 1]}, before the gyrocompass"
        return [(text, "void")]
    if run.status[-1] == 2.0:
        text = (
            "unsettled: the rates that the loops have found contradict the Earth rate of this latitude and the stated "
            "drift; latitude, drift, torquer or an axis is wrong"
        )
        found.append((text, "void"))
    if run.status[-1] == 3.0:
        found.append(("unsettled: the platform is not level at the end", "void"))
    late = slice(max(fine, run.t.size - (run.t.size - fine) // 2), None)
    for name in (n for n in record.channels if n.endswith(".saturated")):
        share = float(np.mean(np.asarray(record.channels[name])[late] > 0.5))
        if share > AT_LIMIT:
            slot = name.partition(".")[0]
            found.append((f"unsettled: {slot} is at its limit for {100.0 * share:.0f} % of the gyrocompass", "void"))
    ratio = _restless(run, settings, sensors, shaken(record), late)
    if ratio > RESTLESS:
        text = (
            f"The specific force moves the gyrocompass {ratio:.2g} times as much as the stated noise of gyros and "
            "accelerometers does. The standard deviation of the heading may be too small; the base moves, or a sensor "
            "is noisier than stated."
        )
        found.append((text, "doubt"))
    h = _history(run, settings, sensors)
    model = float(np.interp(run.t[-1], h.t, h.sigma(settings, sensors)[:, 2]))
    if abs(run.sigma[-1] / model - 1.0) > SETTLING:
        text = (
            f"The standard deviation of the controller, {run.sigma[-1] / ARCMIN:.3g}′, is not that of the error model, "
            f"{model / ARCMIN:.3g}′."
        )
        found.append((text, "doubt"))
    if not record.run.measured:
        z = float(abs(run.error[-1]) / max(run.sigma[-1], 1e-12))
        if z > DOUBT:
            text = (
                f"Simulated: the heading is off by {z:.1f} standard deviations. An error is simulated that the "
                "controller is not told of."
            )
            found.append((text, "doubt"))
    return found


def _restless(run: Run, settings: plans.Settings, sensors: plans.Sensors, velocity: float, late: slice) -> float:
    """Return the rms of the tilt as measured, in the gyrocompass's band, over the one that the stated noise gives.

    Means over blocks of 0.5/w, of which neighbours are subtracted: what is slower than the loop is its own motion.
    Without noise, or with fewer than six blocks, 0.
    """
    period = float(run.t[1] - run.t[0])
    size = max(int(0.5 / settings.slow_frequency / period), 5)
    tilt = run.tilt[late]
    n = tilt.shape[0] // size
    time = size * period
    lean = sensors.force / settings.gravity / math.sqrt(time)
    moved = math.sqrt(3.0) * velocity / (settings.gravity * time)  # difference of the velocities at the ends of blocks
    expected = math.sqrt(2.0) * math.hypot(lean, sensors.white * math.sqrt(time), sensors.markov * time, moved)
    if n < 6 or expected == 0.0:
        return 0.0
    means = tilt[: n * size].reshape(n, size, 2).mean(axis=1)
    return float(np.sqrt(np.mean(np.diff(means, axis=0) ** 2))) / expected


def _limits(record: Record) -> list[str]:
    c = record.channels
    hit = [n.partition(".")[0] for n in c if n.endswith(".saturated") and np.any(np.asarray(c[n]) > 0.5)]
    return [f"At a limit during the run: {', '.join(hit)}. The alignment took longer for it."] if hit else []


def _summary(
    result: LoopResult, run: Run, settings: plans.Settings, heading: int | None, final: int | None
) -> list[str]:
    by_name = {c.name: c for c in result.coefficients}
    psi, ready = by_name["ψ"], by_name["ready time"]
    if psi.no_value:
        return [f"No heading: {psi.no_value}."]
    found = [f"Heading {plus_minus(psi)}, clockwise from north, {psi.meaning.partition('axis y ')[2]}."]
    found.append(
        f"Ready {ready.estimate:.0f} s after switch-on." if not ready.no_value else f"{ready.no_value}.".capitalize()
    )
    if heading is not None and final is not None:
        found.append(f"Standard deviation: {run.sigma[heading] / ARCMIN:.3g}′ by the coarse stage after "
                     f"{run.t[heading]:.0f} s, {run.sigma[final] / ARCMIN:.3g}′ by the gyrocompass after "
                     f"{run.t[final]:.0f} s.")  # fmt: skip
    if result.budget:
        first = result.budget[0]
        found.append(f"Largest contribution: {first.source}, {60.0 * first.contribution:.2g}′.")
    return found
