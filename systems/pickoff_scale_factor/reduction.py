"""Reduction of the pickoff test: slope, zero and straightness of the pickoff voltage over the angle of the case.

    u = u_0 + S c(alpha) + q (t - t_m) + r (t - t_m)2 / 2 + noise        S = K_sg H/C        q = -S omega_d

u_0 and S are that line; q, the mean drift of the free float during the test, and r, its even change, are estimated
where the angles are gone over twice in opposite order; otherwise the drift is bounded.  The two passes are one cycle of
a square wave: what changes slowly looks like S, and r takes most of it.  The float sees the table rate by the cosine of
its angle, b' = (H/C) cos(b) alpha', so that its angle is gd(H/C alpha), the Gudermannian function: c = gd(g alpha)/g,
g = H/C, which falls short of alpha by a sixth of the cube (6e-6 of 20 arcmin).  The line of Hu 1981, beside it, takes
c = alpha.
[TEST-PICKOFF; Hu 1981, appendix 1 of chapter 3]

Not modelled: drift that changes otherwise during the test is noise; an angle of the float at table angle 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gyrobench import drift as drift_model
from gyrobench import frames, units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates, handling_errors
from gyrobench.reduction.estimation import noise as noise_model
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.effects import Effect, with_set_up
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.setups import Setup
from gyrobench.reduction.setup.sources import (
    ANGLE_ONCE,
    ANGLE_TWICE,
    AXIS_LEVEL_POLE,
    INPUT_TO_OUTPUT,
    VOLTMETER,
    Source,
)
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import Coefficient, DriftTestResult, Specification

from .levels import Levels
from .refusals import drift_problems, record_problems

__all__ = ["PickoffSetup", "ReductionError", "from_record", "reduce"]

DPH, ARCSEC, ARCMIN = units.factor("deg/h"), units.factor("arcsec"), units.factor("arcmin")
EARTH_ONLY = "the Earth's rate only; the drift itself changes with the attitude by its g coefficients"
SMALL = 1e-5  # rad, step of the sensitivities to the angle readings
NEGLIGIBLE = 0.3  # of what white noise leaves in the mean drift of a test
TOLD_APART = 0.9  # largest correlation of angle and time at which the drift is estimated


@dataclass(frozen=True)
class PickoffSetup(Setup):
    """gain: H/C.  drift: largest to be expected, rad/s.  truth: S (V/rad), K_sg (V/rad), drift (rad/s).  u_gain,
    u_angle, u_voltage: relative.  site: as the report shows it.
    """

    gain: float
    drift: float
    earth_rate: float = frames.EARTH_RATE
    u_gain: float = 0.0
    u_angle: float = 0.0
    u_angle1: float = 0.0
    u_angle2: float = 0.0
    u_voltage: float = 0.0
    u_axis: float = 0.0
    u_mount: float = 0.0
    site: Mapping[str, Any] = field(default_factory=dict)


def float_angle(angle: Array, gain: float) -> Array:
    """What the angle of the case (rad) is to a free float of the gain H/C, over that gain: gd(gain angle)/gain."""
    out: Array = 2.0 * np.arctan(np.tanh(gain * angle / 2.0)) / gain
    return out


def reduce(windows: Mapping[str, Array], setup: PickoffSetup) -> DriftTestResult:
    """Scale factor, zero, straightness and drift; raises ReductionError with everything that is wrong."""
    s = setup
    problems = window_problems(windows) or record_problems(windows)
    if not (math.isfinite(s.gain) and s.gain > 0.0):
        problems.append(f"gain H/C = {s.gain:g}: a finite positive number is expected")
    if problems:
        raise ReductionError(problems)
    angle, t0, t1, u = (np.asarray(windows[c], dtype=float) for c in ("angle_start", "t_start", "t_end", "mean"))
    span, duration = float(np.ptp(angle)), float(t1[-1] - t0[0])
    if problems := drift_problems(s.drift, duration, span):
        raise ReductionError(problems)
    t = (t0 + t1) / 2.0
    both = abs(float(np.corrcoef(angle, t)[0, 1])) < TOLD_APART
    seen, dt, centre = float_angle(angle, s.gain), np.diff(t), (t[0] + t[-1]) / 2.0
    # differences from reading to reading: the float's random drift adds up, so that the levels are not independent
    steps = (np.diff(seen) / dt)[:, None]
    X = np.column_stack([steps, np.ones_like(dt), (t[1:] + t[:-1]) / 2.0 - centre]) if both else steps
    group = Group("from reading to reading", np.arange(dt.size), np.arange(dt.size) + 1.0, "step", "1")
    linear = fit(
        ["S", "q", "r"] if both else ["S"], X, np.diff(u) / dt, t[:-1], t[1:], [group], "change of the voltage", "mV/s",
        1e-3, noise="readings",
    )  # fmt: skip
    if linear.value[0] <= 0.0:
        raise ReductionError("the voltage falls as the angle rises: turn the sign of one of them round")
    truth = s.truth or {}
    line = np.polyfit(angle, u, 1)
    wanted = [
        Quantity("S", "scale factor per angle of the case, K_sg H/C", "V/rad", 1.0, truth.get("S"), float(line[0])),
        Quantity(
            "K_sg", "scale factor per angle of the float", "V/rad", 1.0, truth.get("K_sg"), float(line[0]) / s.gain
        ),
    ]
    if both:
        meaning = "drift of the gyro, with random drift that is slower than half the test, precession sign"
        wanted.append(Quantity("drift", meaning, "°/h", DPH, truth.get("drift")))

    def derived(b: Array) -> list[float]:
        return [b[0], b[0] / s.gain, *([-b[1] / b[0]] if both else [])]

    def sources(f: Findings) -> list[Effect]:
        return _effects(f, s, both, angle, dt)

    found = with_set_up(linear.derive(wanted, derived), sources, s.corrections)
    found.f_test(
        "square_and_cube_of_the", "square and cube of the angle",
        np.column_stack([np.diff((angle / span) ** p) / dt for p in (2, 3)]),
        "curvature of the pickoff", "the pickoff is not straight", "no curvature beyond the scatter",
    )  # fmt: skip
    bound = s.drift * duration
    away = t - centre
    line_and_drift = found.est.beta
    moved = line_and_drift[1] * away + line_and_drift[2] * away**2 / 2.0 if both else np.zeros_like(t)
    levels = Levels.of(angle, seen, t, u, moved, 2 if both else 0)
    result = linear_result(
        found, system="pickoff_scale_factor", title="Pickoff scale factor of a gyro",
        method="Line through the pickoff voltage over the angle of the table, float free; slope from the differences "
        "of the readings [TEST-PICKOFF]",
        sources=["TEST-PICKOFF, PICKOFF; Hu 1981, appendix 1 of chapter 3",
                 "GYRO-DYN-1; Hu 1981, eq. 2-50..2-56"],
        equation="u = u_0 + S c(alpha)" + (" - S omega_d (t - t_m) + r (t - t_m)^2\\/2" if both else "")
        + ', quad c = g^(-1) "gd"(g alpha), quad S = K_"sg" g, quad g = H\\/C',
        conventions=_conventions(s, both), effects=sources(found), specification=s.specification,
        site=s.site, instrument=s.instrument, simulated=s.truth is not None,
        closed_caption="The closed formula is the line of Hu 1981 through the readings, without drift",
        tables=[levels.table()], warnings=_warnings(both, bound, span), random="pickoff noise and random drift",
        errors=s.errors,
    )  # fmt: skip
    dense = np.linspace(angle.min(), angle.max(), 61)
    result.series.insert(0, levels.series(dense, float_angle(dense, s.gain)))
    for c in levels.coefficients(dict(s.specification or {})):
        _append(result, c)
    _judge_no_drift(result)
    result.verdict = uncertainty.worst_verdict(c.verdict for c in result.coefficients)
    result.summary = [
        f"Pickoff scale factor S = {plus_minus(result.coefficients[0])} per angle of the case, "
        f"K_sg = {plus_minus(result.coefficients[1])}.",
        f"Largest departure from the line {abs(result.coefficients[-1].estimate):.2g} % of the span of "
        f"{span / ARCMIN:.4g}′.",
        f"The test took {duration:.3g} s: a drift of {s.drift / DPH:.3g} °/h is at most {bound / ARCSEC:.3g}″, "
        f"{bound / span * 100:.2g} % of the span.",
    ]
    return result


def _effects(found: Findings, s: PickoffSetup, both: bool, angle: Array, dt: Array) -> list[Effect]:
    """All sources with their sensitivities; angle (n,) of the readings, dt (n-1,) between them.

    An encoder that is off once a turn is off in proportion to a small angle, so the sine is an error of the scale.  The
    axis of the table and the input axis see Earth rate as they lean towards the pole: a constant drift.
    """
    slope = float(found.est.beta[0])
    only = np.zeros(found.value.size)
    only[1] = -found.value[1]  # K_sg = S/gain
    wrong = np.zeros_like(found.X)
    wrong[:, 0] = found.X[:, 0]

    def misread(n: int) -> Array:  # readings that are too large by sin n angle, and by cos n angle
        out = []
        for f in (np.sin, np.cos):
            dX = np.zeros_like(found.X)
            shifted = float_angle(angle + SMALL * f(n * angle), s.gain) - float_angle(angle, s.gain)
            dX[:, 0] = np.diff(shifted) / dt / SMALL
            out.append(found.error(dX=dX))
        return np.array(out)

    earth = found.error(slope * s.earth_rate)
    effects = [
        Source("gain_h_c", "gain H/C", "1", "u_gain").effect(s, note="relative", values=only),
        Source("angle_scale_of_the_table", "angle scale of the table", "1", "u_angle").effect(
            s, found.error(dX=wrong), note="relative"
        ),
        ANGLE_ONCE.effect(s, misread(1)),
        ANGLE_TWICE.effect(s, misread(2)),
        VOLTMETER.effect(s, found.error(found.y)),
        AXIS_LEVEL_POLE.effect(s, earth, note=EARTH_ONLY),
        INPUT_TO_OUTPUT.effect(s, earth, note=EARTH_ONLY),
    ]
    if not both:
        note = "not told from the slope by angles gone over once; bound taken as two standard uncertainties"
        effects.append(
            Source("drift_during_the_test", "drift during the test", "rad/s").effect(
                s.drift / 2.0, found.error(slope), note=note
            )
        )
    return effects


def _judge_no_drift(result: DriftTestResult) -> None:
    """Seconds of a test do not tell the drift of a gyro from its slow random drift: no pass or fail on it."""
    for k, c in enumerate(result.coefficients):
        if c.name == "drift" and c.limit is not None:
            result.coefficients[k] = replace(c, verdict="inconclusive")
            result.warnings.append(
                "Drift: inconclusive. It is the mean of this test alone, with the random drift of these seconds in it; "
                "open_loop_drift, fixed_position or a servo test tell the drift of the gyro."
            )


def _append(result: DriftTestResult, c: Coefficient) -> None:
    """One more line in the table; correlation with the others is not given."""
    result.coefficients.append(c)
    n = len(result.correlation)
    result.correlation = [[*row, 0.0] for row in result.correlation] + [[*([0.0] * n), 1.0]]


def _conventions(s: PickoffSetup, both: bool) -> list[str]:
    found = [
        "Table angle right-handed about the input axis; the float follows it with the gain H/C "
        f"= {s.gain:.9g}, so that S = K_sg H/C.",
        "The table axis is at right angles to the pole and sees no Earth rate.",
        "The zero holds whatever angle the free float had taken before the test.",
    ]
    if both:
        found.append("Drift in precession sign; a drifting float turns against it, u = −S ω_d t.")
    return found


def _warnings(both: bool, bound: float, span: float) -> list[str]:
    if both:
        return []
    return [
        f"The angles were gone over once: drift cannot be told from slope; by the bound on it, S may be wrong by up to "
        f"{bound / span * 100:.2g} %. Going back over the same angles tells it."
    ]


def setup_of(record: Record, specification: Specification | None = None) -> PickoffSetup:
    """The setup that the run.json of a record describes: options and the parameters of the gyro."""
    run, options = record.run, record.run.options
    site = run_metadata.Site.of(run)
    known = run_metadata.truth_of(run, ("H", "C", "K_sg"))
    gain = float(options.get("gain") or 0.0)
    truth: dict[str, float] | None = None
    if known is not None and set(known) == {"H", "C", "K_sg"}:
        own = known["H"] / known["C"]
        gain = gain or own
        truth = {"S": known["K_sg"] * own, "K_sg": known["K_sg"]}
        static = run_metadata.truth_of(run, drift_model.NAMES)
        time = float(record.windows["t_end"][-1] - record.windows["t_start"][0])  # with the moves, unlike the plan's
        if static is not None and not _random_drift_lasts(run, time):
            # output axis on the pole, spin axis on east x pole: X = 0, Y = -g sin, Z = -g cos of the latitude
            xyz = np.array([0.0, -site.g * math.sin(site.latitude), -site.g * math.cos(site.latitude)])
            row = drift_model.regressors(xyz, tuple(static))
            truth["drift"] = float(sum(r * v for r, v in zip(row, static.values(), strict=True)))
    if not gain:
        raise ReductionError("gain H/C unknown: the gyro has no parameters H and C; give the option gain")
    return PickoffSetup.of(
        run,
        specification,
        gain=gain,
        drift=float(options["drift"]),
        earth_rate=site.earth_rate,
        truth=truth,
        site={} if run.measured else site.shown(),
    )


def _random_drift_lasts(run: RunDocument, time: float) -> bool:
    """True for a simulated gyro with random drift that is slower than any in the interval and not small beside its
    white noise: it is in the estimate, and the parameters are not its truth.
    """
    noise = run_metadata.truth_of(run, ("turn_on", "markov", "markov_tau", "white")) or {}
    lasts = noise.get("markov_tau", 0.0) > noise_model.LONGEST * time
    flicker, walk = (float(run.parameters.get(f"gyro.{n}") or 0.0) for n in ("flicker", "walk"))
    slow = math.hypot(noise.get("turn_on", 0.0), noise.get("markov", 0.0) * lasts, flicker, walk * math.sqrt(time))
    return slow > NEGLIGIBLE * noise.get("white", 0.0) / math.sqrt(time)


@handling_errors.examined(handling_candidates.readings)
def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a gyrobench.record.record.Record, with its run.json as provenance."""
    return run_metadata.finish(reduce(record.windows, setup_of(record, specification)), record)
