"""Mistakes in taking a frequency response, named by what they do to it: senses, units, angle for rate, rows."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gyrobench.reduction.diagnosis.scale_mistakes import AMPLITUDES, factor_sentence
from gyrobench.reduction.loops.response_errors import ROUNDING
from gyrobench.reduction.toolkit import Reason, plain

from .response import Figures, GyroResponse, curves, fitted

FAR = 0.1  # error of the gain at low frequency from which on something else than the gyro is meant
STEEP = 0.2  # of a slope of 1 or -1, and of a right angle, rad
SCATTER = 0.01  # least robust scatter of the residuals, over u, which an outlier widens where it is not stated
OFF = 6.0  # u: a point further from the curve
ROUGH = 0.01  # rms of the residuals, ln gain and rad: more than a gyro leaves
LEAD = 0.2  # rad, at the end of the pass band: more than any gyro, or a late reading of the table, makes
BETTER = 0.1  # of chi2 that is left when two rows are exchanged back


def mistakes(r: GyroResponse, found: Figures) -> Iterator[Reason]:
    """Yield why nothing may pass or fail, with the likely mistake."""
    blocked = ("pass", "fail")
    near = slice(0, min(4, r.f.size))
    slope = float(np.polyfit(np.log(r.f[near]), r.gain[near], 1)[0])
    phase = float(np.mean(r.phase[near]))
    for sense in (1.0, -1.0):
        if abs(slope + sense) < STEEP and abs(phase + sense * 0.5 * math.pi) < STEEP:
            given = "an integral of the rate" if sense > 0.0 else "a derivative of the rate"
            text = (
                f"From the lowest frequency on the gain goes as {'1/f' if sense > 0.0 else 'f'} and the phase is near "
                f"{'−' if sense > 0.0 else '+'}90°: that is {given}. Was an angle given in place of a rate?"
            )
            yield Reason("response.angle", text, blocked, severity="doubt")
            return
    if math.cos(phase) < -0.5:
        text = (
            f"The phase at low frequency is {plain(math.degrees(phase), 3)}°. The sense of the gyro or of the table is "
            "reversed. Check which sense is positive."
        )
        yield Reason("response.sense", text.replace("-", "−"), blocked, severity="doubt")
        return
    if abs(found.value[0] - 1.0) > FAR:
        yield Reason("response.factor", factor_sentence(float(found.value[0]), AMPLITUDES), blocked, severity="doubt")
    late = r.phase[r.gain > r.gain[0] - 0.5 * math.log(2.0)]
    if late[-1] > LEAD:
        text = (
            "The gyro leads the table more and more with frequency, which no gyro does. Are the phases given with the "
            "opposite sign? A lag is negative."
        )
        yield Reason("response.lead", text, blocked, severity="doubt")
    if _in_radians(r, found):
        text = (
            "Gain and phase belong to one response where the phases are 57.3 times as large. Are they in rad and were "
            "given as °?"
        )
        yield Reason("response.radians", text, blocked, severity="doubt")
        return
    yield from _rows(r, found)


def _in_radians(r: GyroResponse, found: Figures) -> bool:
    """Return whether gain and phase are of one curve, as they are not as given, where the phases are larger by 57.3."""
    left = np.vstack([r.gain, r.phase]) - found.curve.at(r.f)
    if float(np.sqrt(np.mean(left * left))) < ROUGH:
        return False
    again = curves(replace(r, phase=np.degrees(r.phase)))
    return any(c.chi2 < BETTER * found.curve.chi2 for c in again)


def _rows(r: GyroResponse, found: Figures) -> Iterator[Reason]:
    """Name two rows that are exchanged, or a point that is far off."""
    left = (np.vstack([r.gain, r.phase]) - found.curve.at(r.f)) / r.u
    spread = max(SCATTER, 1.4826 * float(np.median(np.abs(left))))
    off = np.hypot(*left) / spread
    worst = np.argsort(off)[::-1][:4]
    if off[worst[0]] < OFF or off[worst[0]] * spread * r.u[worst[0]] < ROUNDING:
        return
    for i, j in ((a, b) for k, a in enumerate(worst) for b in worst[k + 1 :]):
        gain, phase = r.gain.copy(), r.phase.copy()
        gain[[i, j]], phase[[i, j]] = gain[[j, i]], phase[[j, i]]
        c = found.curve
        again = fitted(replace(r, gain=gain, phase=phase), c.poles, c.p if c.resonant else None)
        if again is not None and again.chi2 < BETTER * found.curve.chi2:
            a, b = sorted((float(r.f[i]), float(r.f[j])))
            points = f"The points at {plain(a, 4)} Hz and {plain(b, 4)} Hz"
            text = f"{points} seem exchanged: the curve then fits. Check these rows."
            yield Reason("response.exchanged", text, ("pass", "fail"), severity="doubt")
            return
    text = (
        f"The point at {plain(float(r.f[worst[0]]), 4)} Hz is {plain(off[worst[0]])} standard deviations off the "
        "curve. Check it; u of all figures is widened."
    )
    yield Reason("response.outlier", text)
