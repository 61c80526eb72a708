"""What the report says of the noise model: terms, Gauss-Markov processes, minimum of the deviation, agreement."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.reduction.noise_model.agreement import ENOUGH
from gyrobench.reduction.noise_model.constancy import changing
from gyrobench.reduction.noise_model.noise_model import NoiseModel
from gyrobench.reduction.noise_model.rate_pulses import MOST
from gyrobench.reduction.series.channel_units import ChannelUnits
from gyrobench.reduction.series.motion import TIMES
from gyrobench.reduction.series.noise_coefficients import Estimate
from gyrobench.reduction.toolkit import Array, Table, plain
from gyrobench.report.numbers import write_number, write_p

EVEN, SWING = 1e-6, 0.1  # probability and size of a change of the noise level from which on it is said
CHANGED = {"white": "white noise behind its filter", "readout": "white noise of the reading",
           "gauss_markov": "σ of the Gauss-Markov drift"}  # fmt: skip
WEAK = 1e-4  # probability of so little of the slowest noise below which it is said
STEEP = 0.03  # probability of a fall of the slow drift below which it is said
FEW_CYCLES, SLOWEST = 50.0, 1e-3  # of a line; part of the record from which on the tau of a process is slow
SHOWN = 6  # wild samples or steps that are listed
NAMES = {
    "white": "white noise", "readout": "white noise of the reading", "quantization": "angle noise of a reading",
    "flicker": "flicker", "walk": "rate random walk",
}  # fmt: skip


def number(x: float, u: float | None = None) -> str:
    return write_number(x, u, 3).text


def range_text(e: Estimate, si: float = 1.0) -> str:
    """Return a value with its interval, "25.3 (24.1 to 27.0)"; alone where that is the value itself."""
    if e.low == e.value == e.high:
        return number(e.value / si)
    u = (e.high - e.low) / (2.0 * 1.96 * si) if math.isfinite(e.high) and e.high > e.low else None
    return f"{number(e.value / si, u)} ({number(e.low / si, u)} to {number(e.high / si, u)})"


def absent(term: str, noise: NoiseModel) -> str:
    """Return why a coefficient has no value, and what stands in its place."""
    if term == "K" and any(t.name == "walk" for t in noise.shape[0]):
        return "not determined: the record does not tell a random walk from slow Gauss-Markov drift"
    sure = [g for g in noise.processes if g.tau.determined]
    if term in ("B", "K") and sure:
        of = ", ".join(f"{number(g.tau.value)} s" for g in sure)
        return f"not determined: slow drift here is Gauss-Markov, correlation time {of}"
    return "not determined: the record is too short or other noise covers it"


def contradicted(noise: NoiseModel) -> str:
    """Return why no coefficient is stated."""
    return f"not determined: {_disagreement(noise)}"


def _disagreement(noise: NoiseModel) -> str:
    if noise.slower:
        return (
            f"the changes between rows vanish and come back after {number(noise.slower)} rows, values of a slower "
            "record that were held or interpolated"
        )
    t = noise.treatment
    if t.restless:
        return (
            f"in {_percent(t.restless)} of the record the readings move by {TIMES:g} times the noise of the rest, "
            "or turn by 10 °/s, and more: the instrument was not at rest, or its noise is not one"
        )
    if noise.rounded_away:
        return (
            f"{_percent(t.alike)} of the samples are the same as the one before: the noise is below the step of "
            "the values, and where they change tells where the step is"
        )
    a = min(noise.agreements, key=lambda a: a.share)
    if a.holds:
        return (
            f"what {noise.treatment.filled + noise.treatment.wild.size} missing or wild samples would add to the noise "
            "at low frequencies cannot be told from the others"
        )
    tau, ratio = a.worst
    of = "record" if a is noise.agreement else "record without lines, steps and wild samples"
    return (
        f"the deviation of the best model leaves the 95 % interval of that of the {of} at {_percent(1.0 - a.share)} of "
        f"{a.tau.size} averaging times, at {number(tau)} s it is {number(ratio)} times that"
    )


def _percent(x: float) -> str:
    return f"{plain(100.0 * x, 3)} %"


def agreement_text(noise: NoiseModel) -> str:
    """Return how far the deviation that the model implies is the record's own."""
    if not noise.agrees:
        text = _disagreement(noise)
        return f"{text[0].upper()}{text[1:]}."
    a = noise.agreement
    return (
        f"The deviation that the whole model implies lies in the record's own 95 % interval at {_percent(a.share)} of "
        f"{a.tau.size} averaging times from {number(a.tau[0])} s to {number(a.tau[-1])} s, a tenth of the record."
    )


def agreement(noise: NoiseModel, units: ChannelUnits) -> Table:
    """Return the deviation of the record as it was beside that of the model, an octave apart."""
    a = noise.agreement
    rows: list[list[Any]] = [
        [float(t), *(float(v) / units.si for v in values), "inside" if inside else "outside"]
        for t, *values, inside, shown in zip(
            a.tau, a.deviation, a.low, a.high, a.implied, a.inside, a.octave, strict=True
        )
        if shown
    ]
    head = [
        "averaging time / s",
        f"record / ({units.unit})",
        "95 % from",
        "95 % to",
        f"model / ({units.unit})",
        "finding",
    ]
    caption = (
        "Allan deviation of the record as it was, nothing taken out but missing samples, and that of the whole model "
        f"with what was taken out; coefficients are stated where {_percent(ENOUGH)} agree"
    )
    return Table("agreement", "Record and model", caption, head, rows)


def bias_instability(noise: NoiseModel, units: ChannelUnits) -> Table:
    """Return the bias instability in its two senses."""
    least, floor = noise.minimum, math.sqrt(2.0 * math.log(2.0) / math.pi)
    b = noise["B"]
    rows: list[list[Any]] = [
        ["B", *_range(b, units.si), None, None, None,
         f"floor {number(floor * b.value / units.si)}" if b.determined else "not determined"],
        ["B_min", *_range(least.deviation, units.si), *_range(least.tau, 1.0),
         "minimum" if least.reached else "no minimum: it falls to the end"],
    ]  # fmt: skip
    head = [
        "sense",
        f"value / ({units.unit})",
        "95 % from",
        "95 % to",
        "averaging time / s",
        "from / s",
        "to / s",
        "finding",
    ]
    caption = (
        "Two figures are called bias instability: B, the coefficient of the flicker, and B_min, the least Allan "
        "deviation of all noise together, which data sheets mean"
    )
    return Table("bias_instability", "Bias instability", caption, head, rows)


def _range(e: Estimate, si: float) -> list[float | None]:
    return [e.value / si if e.determined else None, e.low / si if e.determined else None, e.high / si]


def terms(noise: NoiseModel, units: ChannelUnits) -> list[Table]:
    """Return the terms of the model but its processes, as a simulation takes them."""
    found = noise.terms
    rows: list[list[Any]] = [
        [term, found[term] / si, unit, "" if noise[term].determined else "not determined"]
        for term, (unit, si, _) in units.terms.items()
        if found[term]
    ]
    caption = (
        "With its Gauss-Markov processes and bands they make the deviation of the record, so that a simulation takes "
        "all of them: one that is not determined alone stands for what the record does not tell it from"
    )
    return [Table("terms", "Terms of the model", caption, ["term", "value", "unit", "finding"], rows)]


def gauss_markov(noise: NoiseModel, units: ChannelUnits) -> list[Table]:
    """Return the Gauss-Markov processes as a Kalman filter takes them."""
    rows: list[list[Any]] = []
    for k, g in enumerate(noise.processes, 1):
        phi, w = g.discrete(noise.scale.tau0)
        found = "determined" if g.tau.determined else f"in {_percent(g.present)} of the models"
        ends = [v / si for e, si in ((g.sigma, units.si), (g.tau, 1.0)) for v in (e.value, e.low, e.high)]
        rows.append([k, (g.sigma.value / units.si) ** 2, *ends, g.density / units.si, phi, w / units.si, found])
    head = ["process", f"variance / ({units.unit})²", f"σ / ({units.unit})", "95 % from", "95 % to",
            "τ / s", "from / s", "to / s", f"√q / ({units.unit}/√s)", "φ", f"σ(w) / ({units.unit})",
            "finding"]  # fmt: skip
    caption = (
        "dx/dt = −x/τ + w with variance σ² and two-sided density q = 2 σ²/τ of w; at the rate of the record, every "
        f"{plain(noise.scale.tau0, 4)} s, x(k+1) = φ x(k) + w(k). A filter takes all of them: the model has them all. "
        "The intervals hold for every likely number of processes: one may stand for several, then τ is of any of them "
        "with a quarter of their variance, σ of all within the interval of τ together"
    )
    return [Table("gauss_markov", "Gauss-Markov processes", caption, head, rows)] if rows else []


def resonances(noise: NoiseModel, units: ChannelUnits) -> list[Table]:
    """Return the narrow bands of noise that are no lines."""
    rows = [[k, f, width, rms / units.si] for k, (f, width, rms) in enumerate(noise.peaks(), 1)]
    head = ["band", "frequency / Hz", "bandwidth / Hz", f"rms / ({units.unit})"]
    caption = "Noise about a frequency: a resonance, a dither that wanders; bandwidth at half the power"
    return [Table("resonances", "Bands of noise", caption, head, rows)] if rows else []


def terms_text(noise: NoiseModel) -> str:
    """Return of which terms the model is, and the filter of the sensor."""
    words = [NAMES[t.name] for t in noise.shape[0] if t.name in NAMES]
    if count := len(noise.processes):
        words.append(f"{count} Gauss-Markov process{'es' if count > 1 else ''}")
    if count := len(noise.peaks()):
        words.append(f"{count} band{'s' if count > 1 else ''} of noise")
    if noise["R"].determined:
        words.append("a ramp")
    shape = noise.filter_words()
    which = "All noise" if noise.slow_filtered else "The white noise"
    passed = f" {which} has passed a filter: {shape}." if shape else " No filter of the white noise is seen."
    return f"Terms of the model: {', '.join(words)}; {noise.models} models were compared.{passed}"


def wild_text(noise: NoiseModel, time: Array, units: ChannelUnits) -> str:
    """Return how many samples are none of the noise, and the coefficients with and without them."""
    at = noise.treatment.wild
    if not at.size:
        return ""
    many = f"{at.size} samples are wild" if at.size > 1 else "A sample is wild"
    first = ", ".join(f"{number(time[k])} s" for k in at[:SHOWN])
    both = [
        f"{term} {number(noise[term].value / si)} {unit} without them, {number(with_them / si)} with them"
        for term, (unit, si, _) in units.terms.items()
        if (with_them := noise.with_wild.get(term, 0.0)) and noise[term].determined and noise.agrees
    ]
    told = f" {'; '.join(both)}." if both else ""
    return (
        f"{many}, beyond what the noise around makes, {'the first ' if at.size > SHOWN else ''}at {first}: taken out."
        f"{told} Where they are the instrument's own, the coefficients are not all of its noise."
    )


def steps_text(noise: NoiseModel, time: Array, units: ChannelUnits) -> str:
    """Return the steps of the level that were taken out."""
    found = noise.steps
    if not found or noise.slower:
        return ""
    sizes = [(time[min(s.at, time.size - 1)], s.size / units.si, s.u / units.si) for s in found]
    said = ", ".join(f"{number(size, u)} {units.unit} at {number(t)} s" for t, size, u in sorted(sizes))
    return (
        f"The level steps by {said}: a step, which no noise of the rest makes, is taken out before the model; left in, "
        "K, B and B_min take it for theirs. Find its cause."
    )


def jumps_text(noise: NoiseModel) -> str:
    """Return that the level jumps too often for its jumps to be taken out; "" where it does not."""
    if not noise.treatment.jumps or noise.slower:
        return ""
    return (
        f"The level jumps {MOST} times or more, for good or for a while: the jumps are part of the noise (popcorn "
        "noise, or an instrument that is touched again and again). None is taken out, and slow terms are theirs; the "
        "intervals, made for normal noise, may be too narrow."
    )


def pulses_text(noise: NoiseModel, time: Array, units: ChannelUnits) -> str:
    """Return the pulses that were taken out, by their angles (velocities of accelerometers)."""
    if not noise.pulses or noise.slower:
        return ""
    unit, si, _ = units.terms["Q"]
    each = sorted((time[min(at, time.size - 1)], length, size / si, u / si) for at, length, size, u in noise.pulses)
    said = ", ".join(f"{number(size, u)} {unit} at {number(t)} s" for t, _, size, u in each)
    longest = number(max(length for _, length, _, _ in each))
    return (
        f"Pulses of {said}, within {longest} s, which no noise of the rest makes, are taken out before the model; left "
        "in, N takes them for its random walk. Look for what touched the instrument."
    )


def settling_text(noise: NoiseModel, units: ChannelUnits) -> str:
    """Return how the drift settles from the beginning of the record on; "" where it does not."""
    s = noise.settling
    if s is None or noise.slower:
        return ""
    change, u = -s.size / units.si, s.u / units.si
    return (
        f"The drift settles from the beginning of the record on, by {number(change, u)} ± {number(u, u)} {units.unit} "
        f"with a time constant of {number(s.tau, s.u_tau)} ± {number(s.u_tau, s.u_tau)} s: taken out before the model; "
        "left in, K, R and B take it for theirs. Let the instrument warm up, or leave the beginning out."
    )


def swings_text(noise: NoiseModel, units: ChannelUnits) -> str:
    """Return the swings of few cycles that were taken out."""
    if not noise.swings or noise.slower:
        return ""
    said = [
        f"± {number(s.size / units.si, s.u / units.si)} {units.unit} in {number(s.period, s.u_period)} s"
        for s in noise.swings
    ]
    return (
        f"The level swings by {', '.join(said)}: few cycles, which no noise of the rest makes, are taken out before "
        "the model; left in, K, B and B_min take them for theirs. Record the temperature beside the rate."
    )


def curve_text(noise: NoiseModel) -> str:
    """Return why K, R and slow processes may be those of a curve that is no noise; "" where nothing says so, or none of
    them is stated.
    """
    t = noise.treatment
    slow = SLOWEST * t.samples * noise.scale.tau0
    of = [noise["K"].determined, noise["R"].determined]
    of += [g.tau.determined and g.tau.value > slow for g in noise.processes]
    if not noise.agrees or not any(of):
        return ""
    if (steep := noise.chances["steep"]) < STEEP:
        p = write_p(steep).text
        why = f"it falls faster with frequency than its terms do (p {p if p.startswith('<') else f'= {p}'})"
    elif t.settling or t.swings or any(x.frequency * t.samples < FEW_CYCLES for x in t.lines):
        why = "what was taken out of it settles or has few cycles, and need not be an exponential or a sine"
    else:
        return ""
    return (
        f"The slow drift may be a curve that is no noise: {why}. K, R and slow processes are those of this curve, and "
        "another record need not have them. Repeat the record, with the temperature beside the rate."
    )


def taken_off_text(noise: NoiseModel) -> str:
    """Return that slow drift is taken off before the record; "" where it is not, or was taken out of the record."""
    t = noise.treatment
    taken_out = t.settling or t.swings or t.steps or any(x.frequency * t.samples < FEW_CYCLES for x in t.lines)
    if taken_out or noise.chances["weak"] > WEAK:
        return ""
    return (
        "The slowest noise is less than the rest of the record makes (p < 0.0001): slow drift is taken off, by a "
        "filter or by the instrument, which corrects its bias as it runs. B, K, R and B_min are those of what is left."
    )


def one_curve_text(noise: NoiseModel) -> str:
    """Return of what K and R are, in one record; "" where neither is stated."""
    if not noise.agrees or not (noise["K"].determined or noise["R"].determined):
        return ""
    return (
        "K and R are of the one drift curve of this record: a curve that is no noise, a bend or a bump, may look the "
        "same. What stays in a second record is the instrument's."
    )


def levels_text(noise: NoiseModel) -> str:
    """Return that the level of the noise changes along the record; "" where it does not."""
    t = noise.treatment
    low, high = float(t.levels.min()), float(t.levels.max())
    if t.p_level > EVEN or high - low < SWING:
        return ""
    p = write_p(t.p_level).text
    return (
        f"The level of the noise changes: its rms is {low:.2f} to {high:.2f} of that of all in {t.levels.size} parts "
        f"of the record (p {p if p.startswith('<') else f'= {p}'}). The coefficients are those of the mean; reduce the "
        "parts one by one."
    )


def over_time_text(noise: NoiseModel) -> str:
    """Return which terms of the model change along the record; "" where none does, or no coefficient is stated."""
    found = changing(noise.over_time) if noise.agrees else []
    if not found:
        return ""
    said = []
    for t in found:
        band = f"band at {number(t.frequency / noise.scale.tau0)} Hz"
        of = band if t.frequency else t.coefficient or CHANGED[t.term.name]
        each = ", ".join(number(v, u) for v, u in zip(t.rms, t.u, strict=True))
        said.append(f"{of} {each}, each ± {number(float(np.max(t.u)))}")
    return (
        f"The noise is not the same all along the record: over its mean, in the four quarters, {'; '.join(said)}. The "
        "coefficients are those of the mean over this record, and another record is off by more than their intervals. "
        "Look for a warm-up or for what else ran, or reduce the parts one by one."
    )
