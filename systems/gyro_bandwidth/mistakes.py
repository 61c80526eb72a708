"""Mistakes in taking a frequency response, named by what they do to it: senses, units, angle for rate, rows."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from gyrobench.reduction.diagnosis.scale_mistakes import factor_sentence
from gyrobench.result import Reason

from .response import Figures, GyroResponse, fitted, logarithm

FAR = 0.1  # error of the gain at low frequency from which on something else than the gyro is meant
STEEP = 0.2  # of a slope of 1 or -1, and of a right angle, rad
SCATTER = 0.01  # least robust scatter of the residuals, over u, which an outlier widens where it is not stated
OFF = 6.0  # u: a point further from the curve
LEAD = 0.2  # rad, at the end of the pass band: more than any gyro, or a late reading of the table, makes
BETTER = 0.1  # of chi2 that is left when two rows are exchanged back
FITS = 0.02  # rms of ln H off the curve from which on the unit of the phases is tried


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
            f"The phase at low frequency is {math.degrees(phase):.3g}°. The sense of the gyro or of the table is "
            "reversed. Check which sense is positive."
        )
        yield Reason("response.sense", text.replace("-", "−"), blocked, severity="doubt")
        return
    if abs(found.value[0] - 1.0) > FAR:
        yield Reason("response.factor", factor_sentence(float(found.value[0])), blocked, severity="doubt")
    if unit := list(_phase_unit(r, found)):
        yield from unit
        return
    late = r.phase[r.gain > r.gain[0] - 0.5 * math.log(2.0)]
    if late[-1] > LEAD:
        text = (
            "The gyro leads the table more and more with frequency, which no gyro does. Are the phases given with the "
            "opposite sign? A lag is negative."
        )
        yield Reason("response.lead", text, blocked, severity="doubt")
    yield from _rows(r, found)


def _phase_unit(r: GyroResponse, found: Figures) -> Iterator[Reason]:
    """Name phases in the other unit of angle: the curve then fits them and the gains."""
    left = np.vstack([r.gain, r.phase]) - logarithm(found.curve.p, r.f)
    if math.sqrt(float(np.mean(left**2))) < FITS:
        return
    for words, factor in (("rad, given as °", 180.0 / math.pi), ("°, given as rad", math.pi / 180.0)):
        tried = (fitted(GyroResponse(r.f, r.gain, r.phase * factor, r.u), n) for n in (1, 2, 3, 4))
        if any(c is not None and c.chi2 < BETTER * found.curve.chi2 for c in tried):
            text = f"The phases fit the gains of no gyro; they do in {words}. Check their unit."
            yield Reason("response.phase_unit", text, ("pass", "fail"), severity="doubt")
            return


def _rows(r: GyroResponse, found: Figures) -> Iterator[Reason]:
    """Name two rows that are exchanged, or a point that is far off."""
    left = (np.vstack([r.gain, r.phase]) - logarithm(found.curve.p, r.f)) / r.u
    spread = max(SCATTER, 1.4826 * float(np.median(np.abs(left))))
    off = np.hypot(*left) / spread
    worst = np.argsort(off)[::-1][:4]
    if off[worst[0]] < OFF:
        return
    for i, j in ((a, b) for k, a in enumerate(worst) for b in worst[k + 1 :]):
        gain, phase = r.gain.copy(), r.phase.copy()
        gain[[i, j]], phase[[i, j]] = gain[[j, i]], phase[[j, i]]
        again = fitted(GyroResponse(r.f, gain, phase, r.u), found.curve.poles)
        if again is not None and again.chi2 < BETTER * found.curve.chi2:
            a, b = sorted((float(r.f[i]), float(r.f[j])))
            text = f"The points at {a:.4g} Hz and {b:.4g} Hz seem exchanged: the curve then fits. Check these rows."
            yield Reason("response.exchanged", text, ("pass", "fail"), severity="doubt")
            return
    text = (
        f"The point at {float(r.f[worst[0]]):.4g} Hz is {off[worst[0]]:.2g} standard deviations off the curve. Check "
        "it; u of all figures is widened."
    )
    yield Reason("response.outlier", text)
