"""All channels of a record together: summary, correlations, common lines.  [DRIFT-CHANNELS]"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.series.channel_correlation import LEVEL, Correlated, correlate
from gyrobench.reduction.series.channel_units import FORCE, RATE
from gyrobench.reduction.series.lines import CLUSTER, SpectralLine
from gyrobench.result import Reason, Table

from . import at_rest
from .channels import RecordChannel
from .noise_tables import number

WIDTHS = 3.0  # standard uncertainties by which the frequencies of one line may differ in two channels
MOST = 40  # pairs that are listed


def tables(
    channels: Sequence[RecordChannel], step: float, run: RunDocument
) -> tuple[list[Table], list[Reason], list[str]]:
    """Return the tables of all channels, the reasons that follow from them, and sentences for the summary."""
    checks, reasons, checked = at_rest.check(channels, run)
    found = correlations(channels, step)
    common, lines_said = common_lines(channels)
    stated = sum(c.agrees for c in channels)
    said = [
        f"Coefficients are stated for {stated} of {len(channels)} channels, those whose model implies the record's own "
        f"deviation.{_lacking(channels)}",
        *checked, correlation_text(found), lines_said,
    ]  # fmt: skip
    out = [*summary(channels), *checks, *correlation_tables(found), *common]
    return out, reasons, [s for s in said if s]


def _lacking(channels: Sequence[RecordChannel]) -> str:
    without = [c.name for c in channels if not c.agrees]
    return f" Not for {', '.join(without)}." if without else ""


def summary(channels: Sequence[RecordChannel]) -> list[Table]:
    """Return a table of the gyros and one of the accelerometers."""
    out = []
    for units, id, title in ((RATE, "gyros", "Gyros"), (FORCE, "accelerometers", "Accelerometers")):
        mine = [c for c in channels if c.units.words == units.words]
        if not mine:
            continue
        unit, si, meaning = units.terms["N"]
        explained = any(c.explained is not None for c in mine)
        rows = []
        for c in mine:
            n, least = c.N, c.minimum
            known = c.agrees and n.determined
            row: list[Any] = [c.name, n.value / si if known else None, n.low / si if known else None,
                              n.high / si if c.agrees else None]  # fmt: skip
            if units is FORCE:
                row.append(n.value / units.density_si if known else None)
            reached = c.agrees and least.reached
            row += [least.deviation.value / units.si if reached else None, least.tau.value if reached else None]
            row.append(100.0 * c.inside)
            row += [None if c.explained is None else 100.0 * c.explained] if explained else []
            rows.append([*row, c.found])
        density = [f"N / ({units.density})"] if units is FORCE else []
        head = ["channel", f"N / ({unit})", "95 % from", "95 % to", *density,
                f"B_min / ({units.unit})", "at / s", "model inside / %", *(["columns / %"] if explained else []),
                "remarks"]  # fmt: skip
        filled = [k for k in range(len(head)) if k < 4 or any(row[k] not in (None, "") for row in rows)]
        least_shown = any(head[k].startswith("B_min") for k in filled)
        caption = (
            f"N: {meaning}, with its 95 % interval. "
            f"{'B_min: least Allan deviation and its averaging time. ' if least_shown else ''}Model inside: averaging "
            "times at which the deviation that the model implies lies in the record's own 95 % interval"
        )
        if explained:
            caption += "; columns: share of the variance of the samples that temperature and other columns explain"
        rows = [[row[k] for k in filled] for row in rows]
        out.append(Table(id, title, caption, [head[k] for k in filled], rows))
    return out


# ------------------------------------------------------------------ correlations
Pairs = dict[tuple[str, str], list[Correlated]]


def correlations(channels: Sequence[RecordChannel], step: float) -> Pairs:
    """Return the correlations of all pairs whose longest stretch is the same."""
    out: Pairs = {}
    groups: dict[tuple[int, int], list[RecordChannel]] = {}
    for c in channels:
        groups.setdefault((c.first, c.ordinates.size), []).append(c)
    for mine in groups.values():
        if len(mine) > 1:
            found = correlate([c.ordinates for c in mine], step)
            out |= {(mine[i].name, mine[j].name): of for (i, j), of in found.items()}
    return out


def correlation_tables(found: Pairs) -> list[Table]:
    """Return the pairs that are correlated, each at the averaging time at which most is certain, and all values."""
    best = {pair: max(of, key=_certain) for pair, of in found.items() if any(c.p_all < LEVEL for c in of)}
    clear = sorted(best, key=lambda p: -_certain(best[p]))
    rows: list[list[Any]] = []
    for pair in clear[:MOST]:
        c = best[pair]
        times = [o.tau for o in found[pair] if o.p_all < LEVEL]
        clear_at = f"{number(min(times))} to {number(max(times))} s" if len(times) > 1 else f"{number(times[0])} s"
        rounded = [round(v, 4) for v in (c.value, c.low, c.high)]
        rows.append([" – ".join(pair), c.tau, *rounded, c.p_all, clear_at])
    columns = ["channels", "averaging time / s", "correlation", "95 % from", "95 % to", "p", "clear at"]
    text = (
        "Correlation of the noise without columns, lines, steps, wild samples and a straight line, at the averaging "
        "time at which its interval is farthest from zero; the interval holds for all averaging times of a pair "
        "together, p for all pairs and times"
    )
    if not rows:
        return []
    longest = max((found[p] for p in clear), key=len)
    every = [[" – ".join(p), *(c.value if c.p_all < LEVEL else None for c in found[p])]
             for p in clear[:MOST] if len(found[p]) == len(longest)]  # fmt: skip
    head = ["channels", *(f"{number(c.tau)} s" for c in longest)]
    caption = "An octave of the spectrum a column; without a value: not told from zero"
    return [Table("correlations", "Correlated channels", text, columns, rows),
            Table("correlation_by_time", "Correlation over averaging times", caption, head, every)]  # fmt: skip


def _certain(c: Correlated) -> float:
    """Return the least size of a correlation by its interval; below 0 where that holds 0."""
    return max(c.low, -c.high)


def correlation_text(found: Pairs) -> str:
    if not found:
        return ""
    clear = [p for p, of in found.items() if any(c.p_all < LEVEL for c in of)]
    if not clear:
        return f"No two of the channels are correlated (5 % for all {len(found)} pairs and averaging times together)."
    pair, c = max(((p, c) for p in clear for c in found[p]), key=lambda x: _certain(x[1]))
    return (
        f"{len(clear)} of {len(found)} pairs of channels are correlated (5 % for all together), most of all "
        f"{pair[0]} and {pair[1]}, {number(c.value, (c.high - c.low) / 4.0)} at {number(c.tau)} s."
    )


# ------------------------------------------------------------------ lines
def common_lines(channels: Sequence[RecordChannel]) -> tuple[list[Table], str]:
    """Return the lines that are in two channels or more, and a sentence on them."""
    groups = _grouped([(x, c) for c in channels for x in c.lines])
    rows: list[list[Any]] = []
    for group in groups:
        best = min(group, key=lambda g: g[0].u_frequency)[0]
        strongest: dict[str, SpectralLine] = {}
        for x, c in group:
            if c.name not in strongest or x.amplitude > strongest[c.name].amplitude:
                strongest[c.name] = x
        units = {c.name: c.units for _, c in group}
        sizes = [f"{n} {number(x.amplitude / units[n].si, x.u_amplitude / units[n].si)} {units[n].unit}"
                 for n, x in strongest.items()]  # fmt: skip
        rows.append([best.frequency, best.u_frequency, len(strongest), "; ".join(sizes)])
    if not rows:
        return [], "" if any(c.lines for c in channels) is False else "No line is in two channels."
    top = max((x.frequency for c in channels for x in c.lines), default=1.0)
    chance = sum(2.0 * max(a.resolution, b.resolution) * len(a.lines) * len(b.lines) / top
                 for a, b in combinations(channels, 2))  # fmt: skip
    caption = (
        "Frequencies found in two channels or more, within three standard uncertainties or a bin of the record, with "
        f"the amplitude in each; by chance {number(chance)} such would be. A frequency above half the sampling rate "
        "stands at its alias"
    )
    head = ["frequency / Hz", "u(f) / Hz", "channels", "amplitudes"]
    told = ", ".join(f"{number(r[0], r[1])} Hz" for r in rows[:4]) + (" ..." if len(rows) > 4 else "")
    return [Table("common_lines", "Common lines", caption, head, sorted(rows))], f"Lines common to channels: {told}."


def _grouped(lines: Sequence[tuple[SpectralLine, RecordChannel]]) -> list[list[tuple[SpectralLine, RecordChannel]]]:
    """Return groups of lines of one frequency, those with two channels or more."""
    groups: list[list[tuple[SpectralLine, RecordChannel]]] = []
    for x, c in sorted(lines, key=lambda line: line[0].frequency):
        last = groups[-1][-1] if groups else None
        if last is not None and x.frequency - last[0].frequency <= _width(x, c, *last):
            groups[-1].append((x, c))
        else:
            groups.append([(x, c)])
    return [g for g in groups if len({c.name for _, c in g}) > 1]


def _width(x: SpectralLine, a: RecordChannel, y: SpectralLine, b: RecordChannel) -> float:
    resolution = max(a.resolution, b.resolution)
    if not (x.steady and y.steady):
        return CLUSTER * resolution
    return max(WIDTHS * math.hypot(x.u_frequency, y.u_frequency), resolution)


# ------------------------------------------------------------------ reasons
def merged(reasons: Mapping[str, Sequence[Reason]]) -> list[Reason]:
    """Return the reasons of the channels (by their names), a sentence that several share once."""
    groups: dict[tuple[str, str, str], list[str]] = {}
    first: dict[tuple[str, str, str], list[Reason]] = {}
    for name, of in reasons.items():
        for r in of:
            key = (r.id, r.text, r.severity)
            groups.setdefault(key, []).append(name)
            first.setdefault(key, []).append(r)
    out = []
    for key, names in groups.items():
        alike = first[key]
        whose = "" if len(names) == len(reasons) else f"{', '.join(names)}: "
        blocked = tuple(dict.fromkeys(n for r in alike for n in r.names))
        out.append(Reason(key[0], whose + key[1], alike[0].blocks, blocked, severity=key[2]))
    return out
