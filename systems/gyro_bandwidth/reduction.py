"""Record of a vibrating table -> gain, bandwidth, 90 degree frequency, delay and equivalent order of a rate gyro.

Amplitudes and phases of gyro and table at each frequency make points, with u from the noise beside their lines; a curve
of poles and a delay is fitted to them, and the figures are those of the curve.  What an error of the set-up does is
found by moving the points and taking the figures anew.  [TEST-BANDWIDTH]
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from gyrobench.reduction.loops.curve_misfit import alike, misfit
from gyrobench.reduction.loops.loop_curves import bode, curve
from gyrobench.reduction.loops.loop_toolkit import Account, Array, MeasureReduction, Point, ReductionError, Table, told
from gyrobench.reduction.loops.response_errors import (
    GAIN_SLOPE,
    TOGETHER,
    Sensitivity,
    left_out,
    not_stated,
    predicted_shifts,
    together,
)
from gyrobench.reduction.setup.sources import COSINE, READING_GAIN, READING_LAG, TIME_BASE, Source
from gyrobench.reduction.toolkit import Reason, plain
from gyrobench.units import DEG

from .mistakes import mistakes
from .points import Points, points_of
from .response import GyroResponse, figures
from .truth import true_values

#: name, meaning, unit, SI per unit
FIGURES = (
    ("K", "gain at low frequency: rate indicated over rate of the table", "1", 1.0),
    ("f_3dB", "bandwidth: frequency at which the gain is 3 dB below that at low frequency", "Hz", 1.0),
    ("f_90", "frequency at which the gyro lags by 90°", "Hz", 1.0),
    ("delay", "delay at low frequency: lag of the phase over angular frequency", "ms", 1e-3),
    ("order", "equivalent order: of the Butterworth low-pass with this slope at −3 dB", "1", 1.0),
)
PLAIN = 1e-9  # Hz; finer than any figure
STEPS = (1e-3, 1e-5, 1e-3, 1e-3)  # of the sources, of which the sensitivities are taken
CLEAR, EARLY = 5.0, 0.01  # u, and of the delay, from which on a negative delay beside the poles is said
LOOSE = 0.2  # of K or f_3dB, a standard uncertainty from which on no first order holds
NEAR = 2.0  # steps of the frequencies from a resonance, within which a crossing rests on the model
NOT_REACHED = "not reached up to {f} Hz, the highest frequency"


class Reduction(MeasureReduction):
    """Frequency response of a rate gyro."""

    ranked_by = "f_3dB"

    def measure(self) -> Account:
        points = points_of(self.record)
        response = GyroResponse.of(points.f, points.value, points.u, points.held, points.known)
        found = figures(response)
        if found is None:
            raise ReductionError("no curve fits these points; more frequencies are needed")
        if not points.known:
            factor = math.sqrt(found.curve.chi2 / found.curve.dof)
            response = replace(response, u=response.u * max(factor, PLAIN))
            found = figures(response) or found
        self.points, self.response, self.figures = points, response, found
        self._report()
        least, most = (float(x) / DEG for x in (np.min(points.table), np.max(points.table)))
        return Account(
            method="Sines of table rate at one frequency after another; a curve of poles and a delay by weighted least "
            "squares [TEST-BANDWIDTH]",
            sources=["TEST-BANDWIDTH; IEEE 1431; IEEE 952; IEEE 647"],
            equation="H(s) = K e^(-s T) \\/ product (1 + 2 zeta s\\/omega + s^2\\/omega^2)",
            conventions=[
                "Gain and phase: rate indicated over rate of the table as read; a lag is negative.",
                f"Curve: {self._curve_named()}, of the least Bayesian information criterion.",
                f"Table rate: amplitude {plain(least, 4)} to {plain(most, 4)} °/s.",
                *_sampled(points),
                self._delayed(),
            ],
            reasons=list(mistakes(response, found)),
        )

    def summary(self) -> list[str]:
        said = ["Gain at low frequency {K}, delay {delay}."]
        if math.isfinite(self.figures.value[1]):
            said = ["Bandwidth (−3 dB) {f_3dB}, equivalent order {order}.", *said]
        if math.isfinite(self.figures.value[2]):
            said.append("The gyro lags by 90° at {f_90}.")
        return [*told(self.found.coefficients, *said), *left_out(self.found.reasons)]

    # ------------------------------------------------------------------ figures and their budget
    def _report(self) -> None:
        found, points, response, curve_of = self.found, self.points, self.response, self.figures.curve
        highest = float(points.f[-1])
        by = self._sensitivities()
        known = [k for k in range(len(FIGURES)) if math.isfinite(self.figures.value[k])]
        own = [(k, FIGURES[k][0], *FIGURES[k][2:], float(self.figures.u[k])) for k in known]
        shared = together(self.run, by, own)
        truth = true_values(self.run, highest, shared)
        for k, (name, meaning, unit, scale) in enumerate(FIGURES):
            value = float(self.figures.value[k])
            if not math.isfinite(value):
                found.measure(name, meaning, unit, None, no_value=NOT_REACHED.format(f=plain(highest, 4)))
                continue
            u = math.hypot(float(self.figures.u[k]), *(s.share(k) for s in by))
            true = float(truth[k]) if truth is not None and math.isfinite(truth[k]) else None
            of = TOGETHER if any(name in names for names in shared.values()) else ""
            found.measure(name, meaning + of, unit, value, u, scale=scale, truth=true)
            found.coefficients[-1] = replace(found.coefficients[-1], u_a=float(self.figures.u[k]) / scale)
            found.budget += [s.line(name, unit, scale, k) for s in by if s.u > 0.0]
        shifts = predicted_shifts(self.run, by, own)
        found.tables += [shifts] if shifts else []
        found.reasons += not_stated(self.run, by, own)
        self._doubts()
        span = np.geomspace(points.f[0], highest, 200)
        fitted = curve_of.at(span)
        shown = curve(self._curve_named(), span, np.exp(fitted[0] + 1j * fitted[1]))
        measured = [Point(float(f), complex(v), float(u), 1.0) for f, v, u in
                    zip(points.f, response.value, response.u, strict=True)]  # fmt: skip
        caption = (
            "Gain and phase of the gyro against the table. Points: measured, with 95 % error bars; line: fitted curve."
        )
        drawn = bode("frequency response", "loop", caption, measured, [shown], "gain", "1")
        found.responses.append(replace(drawn, coherence=[]))  # u of a point is by its periods
        found.tables.append(self._table())

    def _curve_named(self) -> str:
        c = self.figures.curve
        more = f", a delay and a resonance at {plain(c.resonance, 4)} Hz" if c.resonant else " and a delay"
        return f"{c.poles} pole{'s' * (c.poles != 1)}{more}"

    def _pure_delay(self) -> tuple[float, float]:
        """Return the delay that the gain does not explain, and its u, s: the gyro's own, or that of a late reading."""
        c = self.figures.curve
        return float(c.p[1]), float(np.sqrt(c.cov[1, 1] * max(1.0, c.chi2 / max(c.dof, 1))))

    def _delayed(self) -> str:
        T, u = (x * 1e3 for x in self._pure_delay())
        held = self.response.held * 1e3
        T = T if abs(T) > 0.1 * u else 0.0
        sign = "−" if T < 0.0 else ""
        samples = f", {sign}{plain(abs(T / held), 3)} samples of the gyro" if held else ""
        return (
            f"{sign}{plain(abs(T), 3)} ms of the delay (u = {plain(u)} ms{samples}) are no pole's, whose gain would "
            "show: the gyro's own, or those of a late reading."
        )

    def _table(self) -> Table:
        r, fitted = self.response, self.figures.curve.at(self.response.f)
        db = 20.0 / math.log(10.0)
        rows = [
            [float(f), float(a), db * float(dg), math.degrees(dp)]
            for f, a, dg, dp in zip(r.f, self.points.table / DEG, r.gain - fitted[0], r.phase - fitted[1], strict=True)
        ]
        head = ["f / Hz", "table / (°/s)", "gain less curve / dB", "phase less curve / °"]
        caption = "What the fitted curve leaves of gain and phase, at each frequency"
        return Table("response.points", "Frequency response", caption, head, rows)

    def _sources(self) -> list[tuple[Source, float, GyroResponse]]:
        """Return the sources, the step that is taken of each, and the response as an error of that size makes it."""
        r, w = self.response, 2.0 * np.pi * self.response.f
        one = np.ones(r.f.size)
        gain, lag, time, cosine = STEPS
        return [
            (READING_GAIN, gain, r.moved(-gain * one + 0j)),
            (READING_LAG, lag, r.moved(1j * lag * w)),
            (TIME_BASE, time, r.at(1.0 - time)),
            (COSINE, cosine, r.moved(cosine * one + 0j)),
            (GAIN_SLOPE, gain, r.moved(-gain * (r.f / r.f[-1]) ** 2 + 0j)),
        ]

    def _sensitivities(self) -> list[Sensitivity]:
        """Return of each source its standard uncertainty and the change (5,) of the figures for one unit of it, SI."""
        base = self.figures
        out = []
        for source, step, moved in self._sources():
            again = figures(moved, lambda curves: next((c for c in curves if c.shape == base.curve.shape), curves[-1]))
            change = np.zeros(5) if again is None else (again.value - base.value) / step
            u = float(self.run.options.get(source.option, 0.0)) if source.option in self.run.options else 0.0
            out.append(Sensitivity(source, math.sqrt(2.0) * u * u if source is COSINE else u, change))
        return out

    def _neighbours_alike(self) -> float:
        """Return the probability that the residuals of neighbours are so alike by chance."""
        r, c = self.response, self.figures.curve

        def of(p: Array) -> Array:
            out: Array = c.at(r.f, p) / r.u
            return out

        return alike(of, c.p, c.size, np.vstack([r.gain, r.phase]) / r.u - of(c.p))

    def _doubts(self) -> None:
        found, points, c = self.found, self.points, self.figures.curve
        if points.saturated:
            at = ", ".join(f"{plain(f, 3)} Hz" for f in points.saturated)
            found.doubt("gyro.saturated", f"The gyro was beyond its range at {at}. Its gain there is too small. Take a "
                                          "smaller rate.")  # fmt: skip
        found.doubt("response.misfit", misfit(points.known, c.chi2, c.dof, self._neighbours_alike))
        K, f3 = self.figures.value[:2]
        loose = max(float(u / v) for u, v in zip(self.figures.u[:2], (K, f3), strict=True) if math.isfinite(v))
        if f3 < points.f[0] or loose > LOOSE:
            text = (
                "The gain at low frequency is that of the curve, not of the points: K or f_3dB is known to "
                f"{plain(100.0 * loose)} %, or lies below the lowest frequency, and intervals hold for small changes "
                "alone. Measure lower frequencies, or with less noise."
            )
            found.doubt("response.loose", text)
        T, u = self._pure_delay()
        early = -T
        if self.run.measured and early > max(CLEAR * u, EARLY * float(self.figures.value[3])):
            text = (
                f"The phase lags by {plain(early * 1e3, 3)} ms less than the gain makes it (u = {plain(u * 1e3)} ms), "
                "as zeros of the gyro may do, or an amplitude that is wrong at high frequencies, or a late reading of "
                "the table."
            )
            found.warn("response.early", text)
        peak = float(np.max(self.response.gain) - math.log(self.figures.value[0]))
        if peak > 0.5 * math.log(2.0):
            top = float(self.response.f[int(np.argmax(self.response.gain))])
            rise = 20.0 * peak / math.log(10.0)
            more = "Measure more frequencies there."
            text = f"The gain rises to {plain(rise, 3)} dB at {plain(top, 3)} Hz: a resonance. {more}"
            found.warn("response.resonance", text)
        if c.resonant:
            step = float(np.max(np.diff(np.log(points.f))))
            f3, f90 = (
                abs(math.log(float(f) / c.resonance)) < NEAR * step for f in self.figures.value[1:3]
            )  # no NaN is
            names = (*(("f_3dB", "order") if f3 else ()), *(("f_90",) if f90 else ()))
            text = (
                f"What the response does between the points, about the resonance at {plain(c.resonance, 4)} Hz, "
                f"decides on {', '.join(names)}. Measure more frequencies there."
            )
            found.reasons += [Reason("response.between", text, ("pass", "fail"), names, severity="doubt")] * bool(names)


def _sampled(points: Points) -> list[str]:
    """Return what is taken of a gyro that gives samples, and which frequencies are left out."""
    if not points.held:
        return []
    found = [
        f"The gyro gives a sample each {plain(points.held * 1e3, 4)} ms; sines are fitted to the samples at their own "
        "times, and the curve is times that of a sample held until the next one."
    ]
    if points.folded:
        at = ", ".join(f"{plain(f, 4)} Hz" for f in points.folded)
        found.append(f"Left out: {at}, near a multiple of half the output rate, where a sine and its image are one.")
    return found
