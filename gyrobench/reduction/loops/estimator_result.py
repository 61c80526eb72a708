"""The measures of one estimator over one record, as coefficients and tests of its findings.

    s = Signals(time, z, estimate, truth, latency, variance, innovation, nis, R_hat)
    measure(found, s, frequency=1.0, R=2.7e-6)      # frequency: of the sine in the truth; None: a random truth

What stands there, and why: the error against the truth of the same instant ranks estimators (:data:`RANKED`), for that
is what a loop feels; noise reduction never stands without gain and phase; consistency tells whether a filter that
states a variance may be believed.  [EST-KF-AR: mandatory pair; EST-WAVELET-ONLINE: both error columns]
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops import estimator_metrics
from gyrobench.reduction.loops.estimator_metrics import Consistency, UncertainValue
from gyrobench.reduction.loops.measure_findings import MeasureFindings
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Test

RANKED = "error"  # the coefficient that ranks estimators, smallest first
LOOP = 5.0  # degrees of phase that an estimator may cost in a loop
CROSSOVER = 10.0  # Hz


@dataclass(frozen=True)
class Signals:
    """Evenly sampled series (n,) in one unit, at ``time`` s; transients are left out before.

    latency: as the estimator states it, s.  latency, variance, innovation, nis, R_hat: None where it has none.
    """

    time: Array
    z: Array
    estimate: Array
    truth: Array
    latency: float | None
    variance: Array | None = None
    innovation: Array | None = None
    nis: Array | None = None
    R_hat: Array | None = None

    def problems(self) -> list[str]:
        """Return what makes these series unfit, as sentences."""
        problems = []
        given = {k: v for k, v in vars(self).items() if isinstance(v, np.ndarray)}
        for name, x in given.items():
            if x.shape != self.time.shape:
                problems.append(f"{name} has {x.size} samples, time has {self.time.size}")
            elif not np.all(np.isfinite(x)):
                problems.append(f"{name} is not finite at {int(np.count_nonzero(~np.isfinite(x)))} samples")
        if not problems and not np.ptp(self.truth) > 0.0:
            problems.append(
                "the truth is constant: an estimate of zero would rank first, so no estimator can be ranked"
            )
        if not problems and not np.any(self.z != self.truth):
            problems.append("the readings equal the truth: there is no noise to reduce")
        if self.time.size < 400:
            problems.append(f"{self.time.size} samples: at least 400 are needed")
        else:
            steps = np.diff(self.time)
            if np.ptp(steps) > 0.01 * float(np.median(steps)) or not steps[0] > 0.0:
                problems.append("the samples are not equally spaced in time (to 1 %); record at a fixed rate")
        if self.latency is not None and not 0.0 <= self.latency < math.inf:
            problems.append(f"latency = {self.latency:g} s: must be 0 or more")
        return problems


def measure(
    found: MeasureFindings, s: Signals, frequency: float | None = None, R: float | None = None, unit: str = "1"
) -> None:
    """Add all measures; raises ReductionError with everything that is wrong with the series.

    frequency: Hz, of the sine that the truth is; None where the truth is random.  R: true variance of a reading.
    unit: of z, as printed.
    """
    if problems := s.problems():
        raise ReductionError(problems)
    step = float(s.time[1] - s.time[0])
    latency = s.latency or 0.0
    behind = estimator_metrics.delay_signal(s.time, s.truth, latency)
    known = slice(math.ceil(latency / step - 1e-9), None)  # where the truth of one latency ago is in the record
    if s.time[known].size < 400:
        raise ReductionError(f"the record is too short for the latency of {latency:g} s")
    try:
        _errors(found, s, behind, known, frequency, unit)
        _distortion(found, s, behind, known, frequency)
        most = max(3.0 * latency, 50.0 * step)
        delay = estimator_metrics.delay(s.time, s.estimate, s.truth, most)
    except ValueError as error:
        raise ReductionError(str(error)) from None
    stated = "the estimator states none" if s.latency is None else "closed form: the latency stated by the estimator"
    scale, in_unit = (1.0, "s") if step > 0.1 else (1e-3, "ms")
    meaning, closed = f"delay of the best fit to the truth; {stated}", None if s.latency is None else latency / scale
    found.add("delay", meaning, in_unit, _times(delay, 1.0 / scale), closed=closed)
    _consistency(found, s, R)
    phase = 360.0 * CROSSOVER * latency
    if phase > LOOP:
        text = (
            f"The stated delay of {plain(latency * 1e3, 4)} ms costs {plain(phase, 3)}° of phase margin at a crossover "
            f"of {CROSSOVER:g} Hz, more than the {LOOP:g}° an estimator inside a loop may take."
        )
        found.warn("estimator.delay", text)


def _errors(
    found: MeasureFindings, s: Signals, behind: Array, known: slice, frequency: float | None, unit: str
) -> None:
    """Add the errors against the truth of the same instant and of one latency ago."""

    def size(time: Array, x: Array) -> UncertainValue:
        return estimator_metrics.rms_of_sine(time, x, frequency) if frequency else estimator_metrics.rms(x)

    raw, error = estimator_metrics.rms(s.z - s.truth), s.estimate - s.truth
    found.facts |= {"dof": float(s.time.size), "residual_std": float(np.sqrt(np.mean(error**2))), "residual_unit": unit}
    now = size(s.time, error)
    found.add(RANKED, "rms error against the truth at the same time", unit, now)
    found.add("error re raw", "rms error relative to that of the readings", "dB", estimator_metrics.decibels(now, raw))
    if s.latency is None:
        return
    late = size(s.time[known], (s.estimate - behind)[known])
    against = "rms error against the delayed truth (delay-compensated), relative to that of the readings"
    found.add("late error re raw", against, "dB", estimator_metrics.decibels(late, raw))


def _times(v: UncertainValue, factor: float) -> UncertainValue:
    return UncertainValue(v.value * factor, v.u * factor, v.dof)


def _distortion(found: MeasureFindings, s: Signals, behind: Array, known: slice, frequency: float | None) -> None:
    """Add the noise reduction and the gain (and phase) that goes with it."""
    if frequency:
        r = estimator_metrics.response_to_sine(s.time, s.estimate, s.truth, frequency)
        gain = f"gain at {frequency:g} Hz"
    else:
        r = estimator_metrics.response_to_truth(s.estimate[known], behind[known])
        gain = "gain on the delayed truth (regression)"
    noise = estimator_metrics.decibels(estimator_metrics.rms(r.rest), estimator_metrics.rms(s.z - s.truth))
    meaning = "rms of the estimate without its response to the truth, relative to the error of the readings"
    found.add("noise re raw", meaning, "dB", noise)
    found.add("gain", gain, "1", r.gain)
    if r.phase is not None:
        found.add("phase", f"phase at {frequency:g} Hz, negative: lag", "°", _times(r.phase, 180.0 / math.pi))
    if not 0.9 <= r.gain.value <= 1.1:
        worse = found["error re raw"].estimate > 0.0
        so = "Part of the noise reduction is attenuation of the signal"
        so = "Its error is larger than that of the readings" if worse else so
        found.warn("estimator.gain", f"The gain of the estimator on the signal is {plain(r.gain.value, 3)}. {so}.")


def _consistency(found: MeasureFindings, s: Signals, R: float | None) -> None:
    if s.variance is not None and np.all(s.variance > 0.0):
        _against_chi_square(found, "NEES", "error", estimator_metrics.nees(s.estimate - s.truth, s.variance))
    if s.nis is not None and np.any(s.nis > 0.0):
        _against_chi_square(found, "NIS", "innovation", estimator_metrics.nis(s.nis[s.nis > 0.0]))
    if s.innovation is not None and np.any(s.innovation != 0.0):
        found.facts["acf"], q, p = estimator_metrics.whiteness(s.innovation[s.innovation != 0.0])
        white = "white: compatible with the signal model"
        white = white if p >= 0.001 else "not white: the signal model does not apply"
        what = "autocorrelation, absent for the correct model"
        found.tests.append(Test("ljung_box.innovations", "Ljung-Box, innovations", q, p, what, white))
        text = "The innovations are not white (Ljung-Box, p < 0.001). The signal model of the filter does not apply."
        found.warn("estimator.innovations", text if p < 0.001 else "")
    if s.R_hat is not None and R:
        ratio = estimator_metrics.variance_ratio(s.R_hat, R)
        found.add("R̂/R", "estimated variance of a reading divided by the true one, 1 where it is right", "1", ratio)


def _against_chi_square(found: MeasureFindings, name: str, what: str, c: Consistency) -> None:
    # 1 is not the truth of it: that is what a filter is asked, and the answer may well be no
    found.add(name, f"mean squared {what} divided by its stated variance, 1 where that is right", "1", c.value)
    low, high = plain(c.low, 3), plain(c.high, 3)
    seeks = f"stated variance of the {what}; 99.9 % bounds {low} to {high} ({c.dof:.0f} squares)"
    wrong = consistency_test(found, name, c.mean, 1.0, c.p, c.holds, seeks, f"{what} variance", "variance")
    text = f"{name} = {plain(c.mean, 3)}, outside {low} to {high}; {wrong}."
    found.warn(f"estimator.consistency:{name}", text if wrong else "")


def consistency_test(
    found: MeasureFindings, name: str, value: float, wanted: float, p: float, holds: bool, seeks: str, its: str,
    stated: str = "covariance",
) -> str:  # fmt: skip
    """Add the test whether a mean of squares is the one that a filter states; return what is wrong, "" where it holds.

    seeks: what the test looks for.  its, stated: of what the filter says too little or too much, and by what.
    """
    less = "understates" if value > wanted else "overstates"
    finding = f"consistent with the stated {stated}" if holds else f"inconsistent: the filter {less} its {its}"
    found.tests.append(Test(f"consistency:{name}", name, value, p, seeks, finding))
    return "" if holds else finding
