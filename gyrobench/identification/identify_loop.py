"""From a record of a loop to its responses and margins."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.bench import Bench, UsageError
from gyrobench.identification.amplitude import difference
from gyrobench.identification.distortion import Distortion, distortions, is_odd, with_distortion
from gyrobench.identification.line_spectrum import (
    PERIODS,
    LineAmplitudes,
    broadband_lines,
    find_period,
    misfit,
    periodic_lines,
    periods_used,
)
from gyrobench.identification.loop_curve import loop_curve
from gyrobench.identification.loop_doubts import CHANGED, LEVEL_END, halves, halves_of_bands, level_end
from gyrobench.identification.loop_margins import margins
from gyrobench.identification.loop_record import LoopRecord, read_loop
from gyrobench.identification.missing_blocks import missing_blocks
from gyrobench.identification.plant_fit import fit_plant, parse_fit
from gyrobench.identification.ratios import loop_responses
from gyrobench.identification.strange_stretch import STRANGE, is_random, strange_stretch
from gyrobench.identification.wanted_margins import parse_wanted
from gyrobench.identification.written_identification import Identification
from gyrobench.record.csv_reader import DataError

WHOLE = 0.05  # of a sample: what the last period may be off
LINES = 8
BANDS = 12
CLOCK = 0.05  # relative: a clock is not further off
LIMITED = 0.01  # of the time: nothing passes then
PILED = 3.0  # times as many samples at the largest value as at the next: not the steps of a coarse signal
AT_LIMIT = "a signal is at its limit for a part of the time"
DRIFT = 1.0  # rms of the response: more drift than that is said
KNOWN = 0.5  # of the frequencies of a band at which L is determined
OF_ITSELF = (
    "of itself, or a block is missing there whose jump of the output is within the noise; then the response at "
    "frequencies that are missing with it is that of the jump, and margins there are none of the loop"
)
STRONG = 0.01  # of the excited lines: with more distortion the margins may be others at another amplitude


def identify(
    data: str | Path,
    *,
    at: str = "",
    period: str = "",
    band: tuple[float, float] = (0.0, math.inf),
    columns: Path | None = None,
    fit: Sequence[str] = (),
    want: Sequence[str] = (),
    against: str | Path | None = None,
) -> Identification:
    """Return responses and margins of the loop of a file.

    at: where the excitation enters, period: its period; both replace what the file states.  band: frequencies, Hz.
    columns: a column map.  fit: parameters of the plant to find ("J") or known ("k_t=0.4N.m/A").  want: margins
    that the loop must have.  against: a record of the same loop at another amplitude.  Raises UsageError and DataError.
    """
    begin = time.perf_counter()
    file = Bench.find().existing(Path(data))
    if not file.exists():
        raise UsageError(f"{file}: no such file of measured data")
    record = read_loop(file, at, period, columns)
    wanted = parse_wanted(want)
    if fit:
        parse_fit(fit)  # what is asked for wrongly is said first
    found = identify_record(record, band)
    if against is not None:
        found = _compared(found, Path(against), at, period, band, columns)
    if fit:
        found = replace(found, fit=fit_plant(found.record, found.responses["P"], fit))
    found = replace(found, verdicts=[w.verdict(found.margins, found.dependent) for w in wanted])
    return replace(found, seconds=time.perf_counter() - begin)


def _compared(
    found: Identification, against: Path, at: str, period: str, band: tuple[float, float], columns: Path | None
) -> Identification:
    """Return what was found with a note of how the loop differs at another amplitude."""
    other = identify(against, at=at, period=period, band=band, columns=columns)
    ratio = float(np.std(other.record.r) / np.std(found.record.r))
    try:
        apart = difference(found.curve, other.curve)
    except ValueError as error:
        raise UsageError(f"--against {against}: {error} with {found.record.name}") from None
    begin = f"against {other.record.name}, {ratio:.3g} times the excitation: "
    if apart is None:
        return replace(found, notes=[*found.notes, f"{begin}L is the same within its uncertainty"])
    size, turn, f = apart
    text = f"L differs by {size:+.2g} dB and {turn:+.2g}° at {f:.3g} Hz; the loop depends on its amplitude"
    text = text.replace("-", "−")
    return replace(found, dependent=text, notes=[f"nonlinear: {begin}{text}", *found.notes])


def identify_record(record: LoopRecord, band: tuple[float, float] = (0.0, math.inf)) -> Identification:
    """Return responses and margins of the loop of a record, between two frequencies, Hz.  Raises DataError."""
    _check(record)
    record, pieces = _longest_piece(record)
    samples, notes = _samples_of_period(record)
    notes = pieces + notes
    kinds: list[Distortion] = []
    if samples:
        lines, omitted = periodic_lines(record, samples)
        seconds = samples * record.step
        if not lines.f.size:
            raise DataError(record.name, ["the excitation has no line that stands out of its noise"])
        kinds = distortions(lines, omitted, seconds)
        notes += _about(kinds, lines, seconds)
        if any(d.kind == "odd" and d.significant for d in kinds):
            lines = with_distortion(lines, omitted, seconds)
        lines = lines.take((lines.f >= band[0]) & (lines.f <= band[1]))
    else:
        lines, seconds = broadband_lines(record, *band), 0.0
    responses = loop_responses(lines, record.at)
    known = responses["S"].determined & (responses["S"].u < KNOWN)
    if int(known.sum()) < (LINES if samples else BANDS):
        raise DataError(record.name, [_too_few(record, samples, lines, int(known.sum()))])
    s = responses["S"]
    seen = type(s)(*(getattr(s, n)[known] for n in ("f", "value", "u", "dof", "center", "radius")))
    curve = loop_curve(seen)
    found, missing = margins(curve)
    if not record.closed:
        found, missing = [], ["the input is the excitation itself: no loop is closed, and P alone is identified"]
    limited = _clipped(record)
    notes += _drift(record, samples) + limited
    count = periods_used(record.r.size, samples) if samples else 0
    strong = [d for d in kinds if d.kind == "odd" and d.significant and d.level > STRONG]
    dependent = "odd harmonics show that the loop depends on its amplitude" if strong else ""
    random = not samples and is_random(record)
    moved = halves(record, samples, lines.f[known]) if samples else halves_of_bands(record, *band) if random else ""
    strange = strange_stretch(record) if samples or random else ""
    end, doubted = level_end(seen)
    notes = [*filter(None, (strange, moved, end)), *notes]
    dependent = dependent or (
        STRANGE if strange else CHANGED if moved else LEVEL_END if doubted else AT_LIMIT if limited else ""
    )
    return Identification(
        record, count, seconds, responses, found, kinds, curve, [*missing, *notes], np.abs(lines.z[:, 2]), dependent
    )


def _check(record: LoopRecord) -> None:
    problems = [
        f"column '{name}' does not change"
        for name, x in (("excitation", record.r), ("input", record.u), ("output", record.y))
        if not np.ptp(x) > 1e-12 * float(np.abs(x).max() or 1.0)
    ]
    if problems:
        raise DataError(record.name, problems)


def _longest_piece(record: LoopRecord) -> tuple[LoopRecord, list[str]]:
    """Return the longest piece of a record with nothing missing in it, and what there is to say of it."""
    behind, doubtful = missing_blocks(record)
    if not behind:
        at = ", ".join(f"{x * record.step:.6g} s" for x in doubtful)
        return record, [f"the excitation jumps {at} after the first sample: {OF_ITSELF}"] if doubtful else []
    edges = [0, *behind, record.r.size]
    k = int(np.argmax(np.diff(edges)))
    first, last = edges[k], edges[k + 1]
    at = ", ".join(f"{x * record.step:.6g} s" for x in behind)
    text = (
        f"excitation and output jump within one sample {at} after the first: a block of the record is missing there, "
        f"though the times go on. Its longest piece alone is reduced, from {first * record.step:.6g} s to "
        f"{last * record.step:.6g} s"
    )
    piece = replace(record, **{name: getattr(record, name)[first:last] for name in ("r", "u", "y")})
    return piece, [text]


def _samples_of_period(record: LoopRecord) -> tuple[int, list[str]]:
    """Return the samples of a period, 0 for an excitation that is not periodic; and what there is to say of it."""
    stated = record.period / record.step
    repeats = find_period(record.r)
    samples = round(stated) or repeats
    if not samples:
        return 0, []
    if record.period and repeats and samples % repeats:
        raise DataError(record.name, [_other_clock(record, repeats)])
    count = record.r.size // samples
    text = f"the excitation has a period of {stated or samples:.7g} samples"
    if count < PERIODS:
        said = f"{record.r.size / samples:.2g} periods are in the record, of {samples * record.step:.4g} s each"
        if record.period:
            raise DataError(record.name, [f"too short: {said}; at least {PERIODS} are needed, {PERIODS + 3} are good"])
        return 0, [f"{said}; reduced as an excitation without period (from {PERIODS} on the periods are compared)"]
    off = misfit(record.r, samples)
    drift = abs(stated - samples if record.period else off) * count
    if drift > WHOLE:
        found = stated if record.period else samples + off
        if record.period:
            raise DataError(
                record.name,
                [f"{text}, not a whole number: generator and recorder need one clock, or a period of "
                 f"{samples * record.step:.7g} s"],
            )  # fmt: skip
        return 0, [f"the excitation repeats every {found:.3f} samples, not a whole number of them (generator and "
                   "recorder have clocks of their own); reduced as an excitation without period"]  # fmt: skip
    return samples, []


def _other_clock(record: LoopRecord, repeats: int) -> str:
    """Return that the excitation repeats after another time than is stated; repeats: samples."""
    found = repeats * record.step
    times = max(1, round(record.period / found))  # a stated period may be several
    off = times * found / record.period - 1.0
    percent = f"{100.0 * off:.2g}".replace("-", "−")
    clock = f"the times are off by {percent} %, and frequencies, delays and parameters with them, or "
    return (
        f"the excitation repeats every {found:.6g} s by the times of the file, {repeats} samples; the period stated is "
        f"{record.period:.6g} s: {clock if abs(off) < CLOCK else ''}the period is another. Correct what is wrong"
    )


def _too_few(record: LoopRecord, samples: int, lines: LineAmplitudes, known: int) -> str:
    kind = "lines of the excitation" if samples else "bands of frequency"
    return (
        f"{known} of {lines.f.size} {kind} have a response above the noise, {LINES if samples else BANDS} are needed: "
        f"the record of {record.length:.4g} s is too short, the excitation too small or of too few frequencies"
    )


def _about(kinds: list[Distortion], lines: LineAmplitudes, period: float) -> list[str]:
    """Return what the harmonics that are left out say."""
    if not kinds:
        why = (
            "even harmonics are excited, too"
            if not is_odd(lines, period)
            else "too few odd and even harmonics are left out"
        )
        return [f"nonlinearity cannot be seen: {why}; an odd multisine with omitted lines shows it"]
    notes = []
    for d in kinds:
        level = f"{20.0 * math.log10(max(d.level, 1e-9)):.3g}".replace("-", "−")
        if d.significant:
            notes.append(
                f"nonlinear: {d.count} {d.kind} harmonics that are not excited hold {level} dB "
                f"of the {d.signal} at the excited ones, beside noise. "
                + (
                    "The responses are the best linear approximation for this excitation and amplitude (friction, "
                    "saturation, backlash); the intervals hold the distortion, at another amplitude the loop is another"
                    if d.kind == "odd"
                    else "Even nonlinearity (an offset with friction or backlash, a square) moves the mean, not the "
                    "responses at odd harmonics"
                )
            )
    return notes


def _drift(record: LoopRecord, samples: int) -> list[str]:
    length = samples or max(record.r.size // 10, 1)

    def moved(x: Array) -> float:
        """Return how far the means of the pieces lie apart, over the rms of a piece."""
        pieces = x[: x.size // length * length].reshape(-1, length)
        response = math.sqrt(float(np.mean(np.var(pieces, axis=1))))
        return float(np.ptp(pieces.mean(axis=1))) / response if response else 0.0

    if moved(record.r) > DRIFT:  # slow itself: what moves is the response
        return []
    return [
        f"the {name} drifts by {size:.2g} times its response; mean and slope are taken out, the rest is seen as noise"
        for name, x in (("input", record.u), ("output", record.y))
        if (size := moved(x)) > DRIFT
    ]


def _clipped(record: LoopRecord) -> list[str]:
    return [
        f"the {name} is at its largest or smallest value for {100.0 * share:.2g} % of the time: at a limit the loop is "
        "another"
        for name, x in (("input", record.u), ("output", record.y))
        if (share := _share_at_ends(x)) > LIMITED
    ]


def _share_at_ends(x: Array) -> float:
    """Return the share of samples at the largest or smallest value, where they are many more than at the value next
    to it: a coarse signal is as often there.
    """
    count, same = 0, 1e-9 * np.ptp(x)
    for y in (x, -x):
        at_end = y >= y.max() - same
        rest = y[~at_end]
        if np.sum(at_end) > PILED * np.sum(rest >= rest.max() - same):
            count += int(np.sum(at_end))
    return count / x.size


def parse_band(text: str) -> tuple[float, float]:
    """Return the frequencies, Hz, of "0.5Hz..80Hz"; either may be missing.  Raises UsageError."""
    if not text:
        return 0.0, math.inf
    low, dots, high = text.partition("..")
    try:
        if not dots:
            raise units.UnitError("write LOW..HIGH")
        found = (
            (units.parse_quantity(low, "Hz") if low else 0.0),
            (units.parse_quantity(high, "Hz") if high else math.inf),
        )
    except units.UnitError as error:
        raise UsageError(f"--band {text}: {error}; for example 0.5Hz..80Hz") from None
    if not 0.0 <= found[0] < found[1]:
        raise UsageError(f"--band {text}: the first frequency must be below the second")
    return found
