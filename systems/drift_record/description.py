"""What the report of a drift record says of a column: tables of each section, sentences, warnings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from textwrap import shorten
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.record import sampling
from gyrobench.record.drift_columns import ANGLE, DIRECT, FORCE, VELOCITY, harmonic_names
from gyrobench.reduction.noise_model.noise_model import NoiseModel
from gyrobench.reduction.series.channel_units import ChannelUnits, units_of
from gyrobench.reduction.series.deviations import Deviation
from gyrobench.reduction.series.motion import TIMES
from gyrobench.reduction.series.noise_coefficients import slopes
from gyrobench.reduction.series.quantization import folded
from gyrobench.reduction.toolkit import Reason, RunDocument, Table, plain
from gyrobench.units import ARCSEC

from . import noise_tables
from .noise_tables import number
from .preparation import Columns, Prepared

KIND_NAMES = {FORCE: "specific force"}  # where the word is another one
NOTHING = 1e-9  # of the standard deviation of a rate: rounding
MOTIONS = 6  # that are listed
MORE_DIGITS = "Record more digits."
FINER_ANGLE = "Read a finer angle, or reduce one row in several: the change within a sample must be larger."


def acquisition(p: Prepared, run: RunDocument) -> Table:
    about: Mapping[str, Any] = run.series["acquisition"] if run.series else {}
    step = about.get("step", p.step)
    rows: list[list[Any]] = [
        ["sampling interval", step, "s"],
        ["samples", about.get("samples", int(np.count_nonzero(np.isfinite(p.rate)))), "1"],
        ["length", (p.time[-1] - p.time[0] + p.step) / 3600.0, "h"],
        [f"mean {p.units.words}", float(np.nanmean(p.rate)) / p.units.level_si, p.units.level],
        [
            f"standard deviation of a {'sample' if p.step == step else 'mean'}",
            float(np.nanstd(p.rate)) / p.units.si,
            p.units.unit,
        ],
    ]
    if run.series:
        rows[:0], more = _column_rows(p.name, p.units, run.series)
        rows += more
    if filled := p.noise.treatment.filled:
        rows.append(["missing samples completed by what the noise around says of them", filled, "1"])
    rows.append(["longest stretch without a gap of a thousand samples", p.stretch.size * p.step / 3600.0, "h"])
    return Table(
        "acquisition", "Acquisition", "What was recorded, and what is missing", ["quantity", "value", "unit"], rows
    )


def _column_rows(name: str, units: ChannelUnits, series: Mapping[str, Any]) -> tuple[list[list[Any]], list[list[Any]]]:
    about, column = series["acquisition"], series["columns"][name]
    kind = column["kind"]
    rows = [["gaps", about["gaps"], "1"], ["samples missing in gaps", about["missing"], "1"]]
    rows += [["longest gap", about["longest"][1], "s"]] if about["longest"][1] else []
    rows += [["rows without a value", about["incomplete"], "1"]] if about["incomplete"] else []
    rows += [["samples flagged", about["flagged"], "1"]] if about["flagged"] else []
    if kind == ANGLE:
        rows.append(["resets of the angle or counter", about["resets"].get(name, 0), "1"])
        rows.append(["turns or overflows unwrapped", about["wraps"].get(name, 0), "1"])
    if series["factor"] > 1:
        rows.append(["samples in a mean that is analysed", series["factor"], "1"])
    if q := column["resolution"]:
        si, unit = (units.si, units.unit) if kind in DIRECT else (1e-3, "mm/s") if kind == VELOCITY else (ARCSEC, "″")
        rows.append(["resolution of the values", q / si, unit])
    rows.append(["jitter of time stamps, rms, of a step", 0.0 if about["rounded"] else round(about["jitter"], 9), "1"])
    return [["column", f"{name}: {KIND_NAMES.get(kind, kind)} [{column['unit'] or '1'}]", ""]], rows


def acquisition_texts(p: Prepared, run: RunDocument) -> list[str]:
    """Return what sampling did to the rate, and what of the file was left out."""
    if run.series is None:
        reading = run.options.get("reading", "current")
        read = KIND_NAMES.get(str(reading), str(reading))
        return [f"A sample is the mean of the {read} over a window, as an integrating meter reads it."]
    unused = run.series.get("unused", [])
    out = [
        f"Columns of the file that were not used: {shorten(', '.join(unused), 200)}. One that the rate may follow is "
        "taken out by '# regressors = NAME'."
    ] if unused else []  # fmt: skip
    if run.series["columns"][p.name]["kind"] not in DIRECT:
        out.append(
            "A value is what angle or velocity gain within a step, over the step, which is the mean over the step: a "
            "sine of frequency f has its amplitude times sin(π f T)/(π f T), 0.637 at half the sampling rate. The "
            "noise coefficients and the model curves allow for it."
        )
    elif not run.series["samples"] and not run.options.get("bandwidth") and _flat(p, run):
        out.append(
            f"The spectrum is flat to half the sampling rate of {plain(1.0 / run.series['acquisition']['step'], 3)} "
            "Hz. That of point samples of a faster signal is too: if they are points, N holds what is folded. To say "
            "what they are: '# samples = means', or '# bandwidth = ...Hz'."
        )
    return out


def regression(p: Prepared) -> list[Table]:
    rows, turns = [], list[list[Any]]()
    by = {r.name: r for r in p.regressions}
    for r in p.regressions:
        unit = f"{p.units.unit} per {units.display(r.unit)}" if r.unit != "1" else p.units.unit
        si = p.units.si
        share = [float(f"{100.0 * s:.3g}") for s in r.share]
        rows.append([r.name, r.slope / si, r.u / si, r.full[0] / si, r.full[1] / si, unit, r.p, *share,
                     "taken out" if r.kept else "not significant, left in"])  # fmt: skip
    names = harmonic_names(len(by))
    for n, (c, s) in enumerate(zip(names[::2], names[1::2], strict=True), 1):
        if c in by and s in by:
            a, b = by[c], by[s]
            size = math.hypot(a.slope, b.slope)
            u = math.hypot(a.slope * a.u, b.slope * b.u) / size if size else math.hypot(a.u, b.u)
            turns.append([n, size / p.units.si, u / p.units.si, math.degrees(math.atan2(a.slope, b.slope)), a.p])
    head = ["column", "slope", "u", "all: from", "all: to", "unit", "p", "share / %", "share from", "share to", "use"]
    caption = (
        "Slope of the rate over other columns, under noise estimated from the residuals. The least significant column "
        "left, again and again, until all of the rest were significant (5 % for all together); p is that of its last "
        "test. Selection makes p and u of what stays too small; 'all' is the 95 % interval with every column. Share: "
        "of the variance of the samples, slope² times the variance of the column, with its 95 % interval"
    )
    out = [Table("regression", "Regression", caption, head, rows)] if rows else []
    caption = "C sin(n θ + φ), θ the angle of the table; u of C from those of its cosine and sine"
    head = ["harmonic n", f"C / ({p.units.unit})", f"u(C) / ({p.units.unit})", "φ / °", "p"]
    return out + ([Table("harmonics", "Harmonics over the angle", caption, head, turns)] if turns else [])


def slope_readings(noise: NoiseModel, allan: Deviation, units: ChannelUnits) -> Table:
    """Return the coefficients beside those read from the slopes of the Allan deviation."""
    read = slopes(allan)
    rows = []
    for term, (unit, si, _) in units.terms.items():
        row: list[Any] = [term, unit]
        for e in (noise[term], read[term]):
            row += [e.value / si if e.determined else None, e.low / si if e.determined else None, abs(e.high) / si]
        rows.append(row)
    head = ["coefficient", "unit", "model", "95 % from", "95 % to", "slopes", "from (slopes)", "to (slopes)"]
    caption = (
        "The noise model, which is reported, beside the reading of the Allan deviation where its "
        "slope is that of the term; 95 % intervals; without an estimate: below the upper end. The slopes take each "
        "term as if alone: their intervals need not cover"
    )
    return Table("two_ways", "Two ways to the coefficients", caption, head, rows)


def lines(p: Prepared) -> list[Table]:
    rows = [
        [k, x.frequency, x.u_frequency, x.amplitude / p.units.si, x.u_amplitude / p.units.si, x.false_alarm]
        for k, x in enumerate(p.lines.lines, 1)
    ]
    head = ["line", "frequency / Hz", "u(f) / Hz", f"amplitude / ({p.units.unit})", f"u(A) / ({p.units.unit})", "p"]
    use = "taken out before the noise model" if p.noise.treatment.lines else "left in (remove_lines = false)"
    caption = f"Sines, {use}; p: probability of a line as clear in a record without any"
    return [Table("lines", "Lines", caption, head, rows)] if rows else []


def line_texts(p: Prepared) -> list[str]:
    found = p.lines
    if not found.lines:
        return [f"No line stands out of the spectrum at a false-alarm probability of {found.level:g} for the record."]
    return [] if found.complete else ["The search for lines ended at its limit: there may be more."]


def coarse_text(name: str, run: RunDocument) -> str:
    """Return that the values of a column are rounded too coarsely; "" where they are not."""
    column: Mapping[str, Any] = run.series["columns"][name] if run.series else {}
    if not column or column["white"]:
        return ""
    q = column["resolution"]
    if column["kind"] in DIRECT:
        own = units_of(run.window_units.get(name, ""))
        return (
            f"The values are rounded to {number(q / own.si)} {own.unit}, more than twice the noise of a sample: the "
            "error of rounding is not white, and N is that of the rounding."
        )
    what = f"velocity is rounded to {number(q / 1e-3)} mm/s" if column["kind"] == VELOCITY else ""
    return (
        f"The {what or f'angle is rounded to {number(q / ARCSEC)}″'}, more than 2.5 times its random change within a "
        "sample: errors of the rounding follow from one another, and the coefficients are off by more than their "
        "intervals say."
    )


def explained_text(p: Prepared) -> str:
    """Return that lines and other columns explain the rate to the rounding of its numbers; "" where they do not."""
    left, of = float(np.nanstd(p.clean)), float(np.nanstd(p.rate))
    if p.clean is p.rate or left > NOTHING * of:
        return ""
    return (
        f"Lines or other columns explain all of the rate but {plain(left / of, 1)} of its standard deviation: the "
        "coefficients are those of what is left of it by rounding."
    )


def saturated_text(p: Prepared, run: RunDocument) -> str:
    """Return that values are at an end of the range; "" where they are not."""
    about: Mapping[str, Any] = run.series["acquisition"] if run.series else {}
    column: Mapping[str, Any] = run.series["columns"][p.name] if run.series else {}
    ends = about["stuck"].get(p.name, 0) if about and column["kind"] != ANGLE and column["white"] else 0
    if not ends:
        return ""
    return (
        f"{ends} samples are at the largest or smallest value of the file: the converter may have been at its limit. "
        "The coefficients are too small then. Use a larger range."
    )


def doubts(p: Prepared, run: RunDocument) -> dict[str, str]:
    """Return why no limit can be judged by the coefficients: the model or the readings are not as assumed."""
    noise = p.noise
    found = {"misfit": "" if noise.agrees else noise_tables.agreement_text(noise), "coarse": coarse_text(p.name, run),
             "explained": explained_text(p), "saturated": saturated_text(p, run), "frozen": frozen_text(p, run),
             "level": noise_tables.levels_text(noise), "rows": rows_text(p, run)}  # fmt: skip
    return {f"drift_record.{id}": text for id, text in found.items() if text}


def warnings(p: Prepared, run: RunDocument) -> list[Reason]:
    about: Mapping[str, Any] = run.series["acquisition"] if run.series else {}
    column: Mapping[str, Any] = run.series["columns"][p.name] if run.series else {}
    out = list[Reason]()

    def say(id: str, text: str) -> None:
        out.append(Reason(f"drift_record.{id}", text))

    noise = p.noise
    if not noise.agrees:
        look = "See the figures; look for lines that wander, steps, or noise that changes with time."
        look = "Reduce the parts at rest one by one." if noise.treatment.restless else look
        look = MORE_DIGITS if noise.rounded_away else look
        look = "Take the record as it was sampled." if noise.slower else look
        say("misfit", f"{noise_tables.agreement_text(noise)} No coefficient is stated. {look}")
    found = {"wild": noise_tables.wild_text(noise, p.time, p.units),
             "step": noise_tables.steps_text(noise, p.time, p.units), "jumps": noise_tables.jumps_text(noise),
             "pulse": noise_tables.pulses_text(noise, p.time, p.units),
             "settling": noise_tables.settling_text(noise, p.units),
             "swings": noise_tables.swings_text(noise, p.units), "curve": noise_tables.curve_text(noise),
             "taken_off": taken_off_text(p),
             "level": noise_tables.levels_text(noise), "changes": noise_tables.over_time_text(noise),
             "rows": rows_text(p, run)}  # fmt: skip
    for id, text in found.items():
        if text:
            say(id, text)
    if about and about["jitter"] > 0.01 and not about["rounded"]:
        say(
            "jitter",
            f"The time stamps are off an even grid by {plain(100.0 * about['jitter'])} % of a step, rms. Spectrum and "
            "models take the samples as even. Sample by a clock, or resample.",
        )
    if saturated := saturated_text(p, run):
        say("saturated", saturated)
    if frozen := frozen_text(p, run):
        say("frozen", frozen)
    if rounding := coarse_text(p.name, run):
        say("coarse", f"{rounding} {MORE_DIGITS if column['kind'] in DIRECT else FINER_ANGLE}")
    if explained := explained_text(p):
        remedy = " Leave out what was computed from the rate." if any(r.kept for r in p.regressions) else ""
        say("explained", explained + remedy)
    bandwidth = float(run.options.get("bandwidth") or 0.0)
    means = (run.series or {}).get("samples") == "means"
    if about and bandwidth and not means and (excess := folded(about["step"], bandwidth)).ratio > 1.0:
        say(
            "folded",
            f"Point samples every {plain(about['step'], 3)} s of a signal of {plain(bandwidth, 3)} Hz alias: N² is up "
            f"to {plain(excess.decibels)} dB too large. Sample every {plain(excess.longest)} s or faster, or take "
            "means.",
        )
    return out


def taken_off_text(p: Prepared) -> str:
    """Return that slow drift is taken off before the record; "" where it is not, or columns of the file explain it."""
    return "" if any(r.kept for r in p.regressions) else noise_tables.taken_off_text(p.noise)


def in_short(p: Prepared, run: RunDocument) -> str:
    """Return lines, changes of the level, wild and frozen samples of a channel in a few words."""
    t = p.noise.treatment
    counts = ((len(p.lines.lines), "line"), (len(t.steps), "step"), (len(t.pulses), "pulse"), (t.wild.size, "wild"))
    said = [f"{n} {word}{'s' if n > 1 and word != 'wild' else ''}" for n, word in counts if n]
    said += [*["settles"] * bool(t.settling), *["swings"] * bool(t.swings)]
    said += [f"Gauss-Markov {noise_tables.number(g.sigma.value / p.units.si)} {p.units.unit}, "
             f"{noise_tables.number(g.tau.value)} s" for g in p.noise.processes if g.tau.determined]  # fmt: skip
    said += ["frozen"] if frozen_text(p, run) else []
    said += ["at its range"] if saturated_text(p, run) else []
    said += ["coarse"] if coarse_text(p.name, run) else []
    changes = noise_tables.levels_text(p.noise) or noise_tables.over_time_text(p.noise)
    said += ["level changes"] if changes else []
    return ", ".join(said)


def frozen_text(p: Prepared, run: RunDocument) -> str:
    """Return that the channel stays at one value; "" where it does not, or its coarse steps make that."""
    about: Mapping[str, Any] = run.series["acquisition"] if run.series else {}
    if p.name not in about.get("frozen", {}) or coarse_text(p.name, run):
        return ""
    length, when = about["frozen"][p.name]
    return (
        f"{length} samples from {number(when)} s on are the same value, which the noise does not make: the channel was "
        "frozen. They count as samples of the noise: the coefficients are too small. Leave them out by a column flag."
    )


def rows_text(p: Prepared, run: RunDocument) -> str:
    """Return that every second row of a file is not as the rows between; "" where they are alike."""
    if not run.series or run.series["factor"] > 1:
        return ""
    found = p.rows
    if found.noise_differs:
        return (
            f"The noise of every second row is {number(max(found.ratio, 1.0 / found.ratio))} times that of the rows "
            "between: rows that were interpolated, or those of two instruments in one column. The coefficients are "
            "those of the mixture; take one row of two."
        )
    if found.levels_differ:
        return (
            f"Every second row is {number(abs(found.level) / p.units.si)} {p.units.unit} off the rows between: rows of "
            "two instruments in one column, a multiplexer, or a line at half the sampling rate. The coefficients are "
            "those of the mixture; take one row of two."
        )
    return ""


def of_motion(columns: Columns) -> list[Reason]:
    """Return when the instrument was moved."""
    if columns.moved is None:
        return []
    edges = np.flatnonzero(np.diff(columns.moved.astype(np.int8), prepend=0, append=0)).reshape(-1, 2)
    spans = [f"{number(columns.step * a)}–{number(columns.step * b)} s" for a, b in edges[:MOTIONS].tolist()]
    more = ", …" if len(edges) > MOTIONS else ""
    return [
        Reason(
            "drift_record.moved",
            f"The instrument was not at rest at {', '.join(spans)}{more}: its readings move by {TIMES:g} times their "
            f"noise, or turn by 10 °/s, and more. {number(columns.step * columns.moved.sum())} s are left out.",
        )
    ]


def of_rows(run: RunDocument) -> list[Reason]:
    """Return that rows were written twice."""
    about: Mapping[str, Any] = run.series["acquisition"] if run.series else {}
    if not (repeated := about.get("repeated", 0)):
        return []
    return [
        Reason(
            "drift_record.repeated",
            f"{repeated} of {about['samples']} rows repeat the row before in every channel: the logger writes faster "
            "than the instrument samples, or again what it missed. The noise between samples is too small and N that "
            "of the log; keep one row of each sample.",
        )
    ]


def _flat(p: Prepared, run: RunDocument) -> bool:
    if not run.series or run.series["factor"] > 1 or run.series["columns"][p.name]["kind"] not in DIRECT:
        return False
    seen = sampling.Successive()
    seen.add(p.stretch)
    return seen.independent


def conventions() -> list[str]:
    return [
        "N, B, K, R, Q as in IEEE 952 with S two-sided; N in °/√h is the density in °/h/√Hz over 60, towards frequency "
        "0. B is flicker without cutoff, its floor in the Allan deviation 0.664 B; B_min is the least Allan deviation "
        "of the whole model, whatever makes it.",
        "Gauss-Markov process: dx/dt = −x/τ + w, variance σ², density of w two-sided, q = 2 σ²/τ.",
        "Spectrum figures are one-sided: 2 S.",
        "Not determined: the 95 % interval of the coefficient holds zero; its upper end is stated.",
        "Lines, columns that the rate follows significantly, wild samples and changes of the level are taken out of it "
        "before coefficients and deviations; the deviation of the record as it was judges the model.",
    ]


def summary(name: str, noise: NoiseModel, units: ChannelUnits, several: bool) -> list[str]:
    of = f"{name}: " if several else ""
    if not noise.agrees:
        return [f"{of}{noise_tables.agreement_text(noise)} No coefficient is stated."]
    known, lacking = [], []
    for term, (unit, si, _) in units.terms.items():
        e = noise[term]
        if e.determined:
            known.append(f"{term} = {noise_tables.range_text(e, si)} {unit}")
        else:
            lacking.append(f"{term} (below {number(max(abs(e.low), abs(e.high)) / si)} {unit})")
    least = noise.minimum
    if least.reached:
        known.append(f"least Allan deviation {noise_tables.range_text(least.deviation, units.si)} {units.unit} at "
                     f"{noise_tables.range_text(least.tau)} s")  # fmt: skip
    known += [f"Gauss-Markov drift of {noise_tables.range_text(g.sigma, units.si)} {units.unit} rms, correlation time "
              f"{noise_tables.range_text(g.tau)} s" for g in noise.processes if g.tau.determined]  # fmt: skip
    out = [f"{of}{'; '.join(known)}; 95 % intervals."] if known else []
    return out + ([f"{of}The record does not determine {', '.join(lacking)}."] if lacking else [])
