"""Record of a vibrating table -> time constant, stiffnesses and response of a floated gyro.

A curve of first or third order is fitted to amplitudes and phases of the float's angle over that of the table; steps
give the time constant by an area that no model is in.  What an error of the set-up does is found by moving the points
and taking the figures anew.  [TEST-GYRO-DYNAMICS; Hu 1981, eq. 2-57..2-67]
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.curve_misfit import alike, misfit
from gyrobench.reduction.loops.loop_curves import bode, curve, trace
from gyrobench.reduction.loops.loop_reduction import MeasureReduction
from gyrobench.reduction.loops.loop_toolkit import ARCMIN, Account, Array, Point, ReductionError, Table, told
from gyrobench.reduction.loops.response_errors import Sensitivity, left_out, not_stated, predicted_shifts
from gyrobench.reduction.setup.sources import COSINE, READING_GAIN, READING_LAG, TIME_BASE, Source

from .mistakes import mistakes
from .model import AngleResponse, DynamicFigures, figures, response, values_near
from .points import points_of
from .sources import PICKOFF, SPIN
from .steps import StepFigures, figures_of
from .truth import true_values

#: name, meaning, unit, SI per unit, in the order of model.read_off
FIGURES = (
    ("g", "angle of the float over that of the case at low frequency, H/C", "1", 1.0),
    ("tau", "time constant: lag of the float, J/C + H²/(K_I C)", "ms", 1e-3),
    ("tau_0", "time constant with stiff bearings, J/C", "ms", 1e-3),
    ("f_0", "frequency of the rotor against its bearings with the float held, √(K_I K_O)/(2π H)", "Hz", 1.0),
    ("f_3dB", "frequency at which the gain is 3 dB below that at low frequency", "Hz", 1.0),
    ("K_I", "stiffness of rotor bearing and gimbal about the input axis", "N·m/rad", 1.0),
    ("K_O", "stiffness of rotor bearing and gimbal about the output axis", "N·m/rad", 1.0),
)
OUTPUT_GAIN = "gain of the pickoff about the output axis, 1 where its scale is right"
STEP = ("tau_step", "time constant from steps: area between table and float over angle", "ms", 1e-3)
STEP_GAIN = ("g_step", "angle of the float over that of the case, from steps", "1", 1.0)
SMALL = 1e-4  # of an error, by which sensitivities are taken
LAG = 1e-6  # s, the same
NO_CURVE = ("response.angle", "response.sense")  # mistakes with which no curve of a float fits
UNSEEN = "not seen up to {f} Hz: the bearings are stiff, or higher frequencies are needed"
NOT_REACHED = "not reached up to {f} Hz, the highest frequency"
UNSURE = "the elasticity is seen, but leaves this open by more than a tenth"
ELASTIC = ("tau_0", "f_0", "K_I", "K_O")
NO_SPIN = "the angular momentum H is not given"
APART = 0.001  # probability below which sines and steps differ


class Reduction(MeasureReduction):
    """Dynamics of a floated gyro."""

    ranked_by = "tau"

    def measure(self) -> Account:
        options, parameters = self.run.options, self.run.parameters
        self.output = options.get("axis") == "output"
        self.K_sg, self.H = (float(options.get(n) or parameters.get(f"gyro.{n}") or 0.0) for n in ("K_sg", "H"))
        if not self.K_sg > 0.0:
            raise ReductionError("the pickoff gain is not known: give --set K_sg=10V/rad")
        points = self.points = points_of(self.record, self.K_sg, self.output)
        self.figures: DynamicFigures | None = None
        self.steps: StepFigures | None = figures_of(points.turns)
        none, sources = np.zeros(len(FIGURES)), (READING_GAIN, READING_LAG, TIME_BASE, COSINE, PICKOFF)
        self.by = [Sensitivity(s, self._u(s), none) for s in sources]
        self.shown: list[tuple[int, str, str, float, float]] = []  # without sines
        reasons = []
        if points.response is not None:
            reasons = list(mistakes(points.response))
            if any(reason.id in NO_CURVE for reason in reasons):
                raise ReductionError([reason.text for reason in reasons])
            self._sines(points.response)
        self._steps()
        self._doubts()
        least, most = float(np.min(points.table)) / ARCMIN, float(np.max(points.table)) / ARCMIN
        return Account(
            method="Angle of the float against that of the table, its loop open: sines, a curve by weighted least "
            "squares; steps, the area between both [TEST-GYRO-DYNAMICS]",
            sources=["TEST-GYRO-DYNAMICS; Hu 1981, eq. 2-57..2-67"],
            equation="theta_f\\/theta_O = -g (a_2 tau_0 s^3 + tau s) \\/ (a_2 tau_0 s^3 + a_2 s^2 + tau s + 1)"
            if self.output
            else "theta_f\\/theta_I = g \\/ (a_2 tau_0 s^3 + a_2 s^2 + tau s + 1)",
            conventions=[
                "Angles: float against case over case against the stars; a lag is negative.",
                f"Table: angles of {plain(least, 3)} to {plain(most, 3)} ′ about the "
                f"{'output' if self.output else 'input'} axis.",
            ],
            reasons=reasons,
        )

    def summary(self) -> list[str]:
        said = []
        names = {c.name for c in self.found.coefficients if not c.no_value}
        if "tau" in names:
            said.append("Time constant {tau}" + (", {tau_0} with stiff bearings." if "tau_0" in names else "."))
        if "tau_step" in names:
            said.append("From steps {tau_step}.")
        if "f_3dB" in names:
            said.append("The gain is 3 dB down at {f_3dB}.")
        return [*told(self.found.coefficients, *said), *left_out(self.found.reasons)]

    # ------------------------------------------------------------------ sines
    def _sines(self, r: AngleResponse) -> None:
        found = figures(r, self.H)
        if found is None:
            more = "no curve fits these points; more frequencies about the time constant are needed"
            raise ReductionError([*(reason.text for reason in mistakes(r)), more])
        if not self.points.known:
            factor = max(math.sqrt(found.fit.chi2 / found.fit.dof), 1e-9)
            r = replace(r, u=r.u * factor)
            found = figures(r, self.H) or found
        self.figures, self.response = found, r
        by, highest = self._sensitivities(r, found), float(r.f[-1])
        truth = true_values(self.run, highest, self.output)
        shown: list[tuple[int, str, str, float, float]] = []
        for k, (name, meaning, unit, scale) in enumerate(FIGURES):
            if self.output and name in ("f_3dB", "K_I", "K_O"):
                continue
            if not math.isfinite(found.value[k]) or (name in ELASTIC and found.fit.elastic and not found.determined):
                self.found.measure(name, meaning, unit, None, no_value=self._why(name, highest))
                continue
            own = float(found.u[k])
            u = math.hypot(own, *(s.share(k) for s in by))
            true = float(truth[k]) if truth is not None and math.isfinite(truth[k]) else None
            said = OUTPUT_GAIN if self.output and name == "g" else meaning
            value, spread = float(found.value[k]), None
            if name in ELASTIC:  # fitted by their logarithms
                spread = (value / scale * math.exp(-NORMAL * u / value), value / scale * math.exp(NORMAL * u / value))
            self.found.measure(name, said, unit, value, u, scale=scale, truth=true, interval=spread)
            self.found.coefficients[-1] = replace(self.found.coefficients[-1], u_a=own / scale)
            self.found.budget += [s.line(name, unit, scale, k) for s in by if s.u > 0.0]
            shown.append((k, name, unit, scale, own))
        shifts = predicted_shifts(self.run, by, shown)
        self.found.tables += [shifts] if shifts else []
        self.by, self.shown = [s for s in by if s.source is not SPIN], shown
        self._figure(r, found)

    def _why(self, name: str, highest: float) -> str:
        elastic = self.figures is not None and self.figures.fit.elastic
        if name == "f_3dB":
            return NOT_REACHED.format(f=plain(highest, 4))
        if elastic and self.figures is not None and not self.figures.determined:
            return UNSURE
        return NO_SPIN if elastic and name in ("K_I", "K_O") else UNSEEN.format(f=plain(highest, 4))

    def _u(self, source: Source) -> float:
        u = float(self.run.options.get(source.option, 0.0) or 0.0)
        return math.sqrt(2.0) * u * u if source is COSINE else u

    def _sensitivities(self, r: AngleResponse, found: DynamicFigures) -> list[Sensitivity]:
        w = 2.0 * np.pi * r.f
        moved = [
            (READING_GAIN, SMALL, r.moved(-SMALL), self.H),
            (READING_LAG, LAG, r.moved(1j * LAG * w), self.H),
            (TIME_BASE, SMALL, r.at(1.0 - SMALL), self.H),
            (COSINE, SMALL, r.moved(0.0 if self.output else SMALL), self.H),
            (PICKOFF, SMALL, r.moved(-SMALL), self.H),
            (SPIN, SMALL, r, self.H * (1.0 + SMALL)),
        ]
        base = values_near(r, self.H, found.fit)
        return [
            Sensitivity(source, self._u(source), (values_near(again, H, found.fit) - base) / size)
            for source, size, again, H in moved
        ]

    def _figure(self, r: AngleResponse, found: DynamicFigures) -> None:
        span = np.geomspace(r.f[0], r.f[-1], 200)
        order = "third" if found.fit.elastic else "first"
        lines = [curve(f"{order} order", span, response(found.fit.p, span, r.output))]
        if found.fit.elastic:
            lag = np.array([found.fit.p[0], math.log(found.value[1])])
            lines.append(curve("first order, the same time constant", span, response(lag, span, r.output)))
        measured = [Point(float(f), complex(v), float(u), 1.0) for f, v, u in zip(r.f, r.value, r.u, strict=True)]
        caption = (
            "Angle of the float over that of the case. Points: measured, with 95 % error bars; lines: fitted curve."
        )
        drawn = bode("frequency response", "loop", caption, measured, lines, "gain", "1")
        self.found.responses.append(replace(drawn, coherence=[]))  # u of a point is by its periods
        left = np.log(r.value / response(found.fit.p, r.f, r.output))
        first = response(np.array([found.fit.p[0], math.log(found.value[1])]), r.f, r.output)
        more = np.degrees(np.angle(response(found.fit.p, r.f, r.output) / first))
        db = 20.0 / math.log(10.0)
        rows = [
            [float(f), float(a), db * float(x.real), math.degrees(x.imag), float(m)]
            for f, a, x, m in zip(r.f, self.points.table / ARCMIN, left, more, strict=True)
        ]
        head = ["f / Hz", "table / ′", "gain less curve / dB", "phase less curve / °", "phase beyond first order / °"]
        caption = "What the curve leaves of gain and phase, and the phase of the curve beyond a lag of first order"
        self.found.tables.append(Table("dynamics.points", "Response of the float", caption, head, rows))

    # ------------------------------------------------------------------ steps
    def _steps(self) -> None:
        steps = self.steps
        if steps is None:
            return
        name, meaning, unit, scale = STEP
        if steps.too_short:
            self.found.measure(name, meaning, unit, None, no_value="the rests after the steps are too short")
            return
        shares = {READING_LAG: -1.0, TIME_BASE: steps.tau}
        by = [Sensitivity(s, self._u(s), np.array([size])) for s, size in shares.items()]
        truth = true_values(self.run, 1.0, False)
        u = math.hypot(steps.u_tau, *(s.share(0) for s in by))
        dof = steps.dof * (u / steps.u_tau) ** 4 if steps.u_tau > 0.0 else math.inf
        true = None if truth is None else float(truth[1])
        self.found.measure(name, meaning, unit, steps.tau, u, scale=scale, truth=true, dof=dof)
        self.found.coefficients[-1] = replace(self.found.coefficients[-1], u_a=steps.u_tau / scale)
        self.found.budget += [s.line(name, unit, scale, 0) for s in by if s.u > 0.0]
        if self.figures is None:
            gains = [Sensitivity(s, self._u(s), np.array([-steps.gain])) for s in (READING_GAIN, PICKOFF)]
            u = math.hypot(steps.u_gain, *(s.share(0) for s in gains))
            dof = steps.dof * (u / steps.u_gain) ** 4 if steps.u_gain > 0.0 else math.inf
            self.found.measure(*STEP_GAIN[:3], steps.gain, u, dof=dof)
            self.found.budget += [s.line(STEP_GAIN[0], "1", 1.0, 0) for s in gains if s.u > 0.0]
        else:
            self._agreement(steps)
        turn = self.points.turns[0]
        rise = turn.end - turn.begin
        inside = (turn.t > turn.begin - rise) & (turn.t < turn.end + 2.0 * rise)
        t = turn.t[inside] - turn.begin
        lines = {"table": turn.theta[inside] / ARCMIN}
        caption = (
            "Float after the first step of the table; the area between both, over the angle, is the time constant."
        )
        b = turn.b[inside] - turn.b[inside][t < 0.0].mean()
        self.found.responses.append(trace("first step", caption, t, b / ARCMIN, "angle", "′", lines))

    def _agreement(self, steps: StepFigures) -> None:
        """Compare sines and steps; what both share (lag of the reading, time base) is not in the difference."""
        assert self.figures is not None
        u = math.hypot(steps.u_tau, float(self.figures.u[1]))
        z = (steps.tau - float(self.figures.value[1])) / u if u > 0.0 else 0.0
        p = math.erfc(abs(z) / math.sqrt(2.0) * math.sqrt((steps.dof - 1.0) / (steps.dof + 1.0)))
        if p < APART:
            text = "Sines and steps give different time constants. A reading with a filter of its own does this."
            self.found.warn("dynamics.steps", text)

    def _neighbours_alike(self) -> float:
        """Return the probability that the residuals of neighbours are so alike by chance."""
        assert self.response is not None and self.figures is not None
        r, p = self.response, self.figures.fit.p
        top = 2.0 * math.pi * float(r.f[-1])

        def of(p: Array) -> Array:
            ratio = np.log(response(p, r.f, r.output) / r.value) / r.u
            return np.vstack([ratio.real, ratio.imag])

        return alike(of, p, np.array([1.0, 1.0, top**-2, top**-3])[: p.size], of(p))

    def _doubts(self) -> None:
        found, points = self.found, self.points
        if points.saturated:
            at = ", ".join(points.saturated)
            found.doubt("gyro.saturated", f"The pickoff was beyond its range at {at}. Take a smaller angle.")
        found.reasons += not_stated(self.run, self.by, self.shown)
        fit = self.figures.fit if self.figures else None
        if fit:
            found.doubt("response.misfit", misfit(points.known, fit.chi2, fit.dof, self._neighbours_alike))
