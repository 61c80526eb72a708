"""Phases of a plan, found in the motion of the table: at rest at an angle, or turning at a rate, in the plan's order.

The angle is averaged over cells of equal time; the rate of a cell is that between its neighbours.  Stretches of cells
at rest or at one of the plan's rates, long enough to be a phase, are compared one by one with the plan.  Whatever does
not fit (another position, rate, length or number) is refused: a phase taken for another gives wrong coefficients.
Begin and end of a phase are then found to the sample: where the angle leaves what it does within the phase.

Not recognised: servo phases (the gyro moves the table), two axes, a phase that follows another without a motion.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.system.plan import Phase

POSITION = math.radians(1.0)  # a position may be this far from the plan's
RATE = 0.1  # a rate may differ by this part of the plan's; at rest: less than this part of the lowest
REMAINDER = 0.02  # at rest between positions: moves less than this part of their distance in a cell
LENGTH = 1.1  # a phase may last this many times the plan's
GLITCH = 3  # cells
ROUNDING = 1e-9  # rad


@dataclass(frozen=True)
class Stretch:
    """The table at rest (rate 0) or turning, from time to time (s); angles there."""

    start: float
    end: float
    rate: float
    angle: float
    end_angle: float

    def words(self) -> str:
        what = f"at rest at {math.degrees(self.angle):.4g}°" if self.rate == 0.0 else f"turning at {_rate(self.rate)}"
        return f"the table is {what} from {self.start:.6g} s to {self.end:.6g} s"


def _rate(rate: float) -> str:
    return f"{rate / units.factor('deg/h'):.4g} °/h"


def cell_width(phases: Sequence[Phase], step: float) -> float:
    """Return the length of a cell (s): an eighth of the shortest settling, or window where there is none."""
    times = [p.settle or (p.window / abs(p.target) if p.mode == "rate" else p.window) for p in phases]
    return max(min(times) / 8.0, 5.0 * step)


def cells(blocks: Iterable[Mapping[str, Array]], width: float) -> tuple[Array, Array]:
    """Return mean time and mean angle of the cells that hold samples."""
    parts, origin = [], None
    for block in blocks:
        good = np.isfinite(block["time"]) & np.isfinite(block["angle"])
        t, angle = block["time"][good], block["angle"][good]
        if not t.size:
            continue
        origin = float(t[0]) if origin is None else origin
        number = np.floor((t - origin) / width)
        first = np.flatnonzero(np.append(True, np.diff(number) != 0.0))
        sums = [np.add.reduceat(v, first) for v in (np.ones_like(t), t, angle)]
        parts.append(np.stack([number[first], *sums]))
    if not parts:
        return np.empty(0), np.empty(0)
    number, count, t_sum, angle_sum = np.concatenate(parts, axis=1)
    _, which = np.unique(number, return_inverse=True)
    n, t_all, angle_all = (np.bincount(which, weights=v) for v in (count, t_sum, angle_sum))
    return t_all / n, angle_all / n


def stretches(t: Array, angle: Array, phases: Sequence[Phase], width: float) -> list[Stretch]:
    """Return where the table rests or turns at one of the plan's rates for half a phase or longer."""
    rates = sorted({p.target for p in phases if p.mode == "rate"})
    positions = [p.target for p in phases if p.mode == "index"]
    apart = [abs(b - a) for a, b in pairwise(positions) if abs(b - a) > POSITION]
    still = min([RATE * abs(r) for r in rates] + [REMAINDER * a / width for a in apart], default=math.inf)
    v = np.gradient(angle, t) if t.size > 2 else np.zeros_like(t)
    kind = np.where(np.abs(v) <= still, 0.0, np.nan)
    for r in rates:
        kind[np.abs(v - r) <= RATE * abs(r)] = r
    found: list[Stretch] = []
    cut = 0
    for k, group in groupby(range(t.size), key=lambda j: "moving" if math.isnan(kind[j]) else float(kind[j])):
        a, b = (rows := list(group))[0], rows[-1]
        if isinstance(k, str):
            cut += len(rows)
            continue
        first, end = (float(angle[a]), float(angle[b])) if k else (float(np.median(angle[a : b + 1])),) * 2
        s = Stretch(float(t[a]), float(t[b]), k, first, end)
        last = found[-1] if found else None
        same = last is not None and last.rate == k and (k != 0.0 or abs(last.angle - s.angle) < POSITION)
        if last is not None and same and cut <= GLITCH:
            found[-1] = replace(last, end=s.end, end_angle=s.end_angle if k else last.angle)
        else:
            found.append(s)
        cut = 0
    least = 0.5 * min(p.duration() for p in phases)
    return [s for s in found if s.end - s.start >= least]


def match(t: Array, angle: Array, phases: Sequence[Phase], width: float) -> list[Stretch]:
    """Return the stretch of each phase.  Raises ValueError saying which phase does not fit, and what is there."""
    found = stretches(t, angle, phases, width)
    for k, (phase, s) in enumerate(zip(phases, found, strict=False), 1):
        wrong = _differs(phase, s, width)
        if wrong:
            raise ValueError(f"phase {k} '{phase.label}' is expected ({wrong}), but {s.words()}")
    if len(found) < len(phases):
        missing = phases[len(found)]
        last = found[-1].words() if found else "the table never rests or turns at a rate of the plan for long enough"
        raise ValueError(f"phase {len(found) + 1} '{missing.label}' is not there; the last that fits the plan: {last}")
    if len(found) > len(phases):
        raise ValueError(f"after the last phase of the plan, {len(phases)}, {found[len(phases)].words()}")
    return found


def refine(blocks: Iterable[Mapping[str, Array]], found: Sequence[Stretch], width: float) -> list[Stretch]:
    """Return the stretches from the first to the last sample that are as near to the line as those between."""
    most = [0.0] * len(found)  # distance from the line, rad
    edges: list[list[tuple[Array, Array]]] = [[] for _ in found]
    for block in blocks:
        good = np.isfinite(block["time"]) & np.isfinite(block["angle"])
        t, angle = block["time"][good], block["angle"][good]
        for k, s in enumerate(found):
            a, b, c, d = np.searchsorted(t, [s.start - 2.0 * width, s.start, s.end, s.end + 2.0 * width])
            slope = (s.end_angle - s.angle) / (s.end - s.start)
            off = np.abs(angle[a:d] - s.angle - slope * (t[a:d] - s.start))
            most[k] = max(most[k], float(np.max(off[b - a : c - a], initial=0.0)))
            edges[k] += [(t[a:b], off[: b - a]), (t[c:d], off[c - a :])]
    out = []
    for s, limit, parts in zip(found, most, edges, strict=True):
        t, off = (np.concatenate([p[j] for p in parts]) for j in (0, 1))
        away = t[off > 1.5 * limit + ROUNDING]
        start, end = np.max(away[away < s.start], initial=-np.inf), np.min(away[away >= s.end], initial=np.inf)
        here = t[(t > start) & (t < end)]
        out.append(replace(s, start=min(s.start, np.min(here, initial=s.start)), end=np.max(here, initial=s.end)))
    return out


def _differs(phase: Phase, s: Stretch, width: float) -> str:
    """Return what the plan has where a stretch differs from it, else ""."""
    if phase.mode == "rate" and s.rate != phase.target:
        return f"turning at {_rate(phase.target)}"
    if phase.mode != "rate" and s.rate != 0.0:
        return "at rest"
    if phase.mode == "index" and abs(math.remainder(s.angle - phase.target, 2.0 * math.pi)) > POSITION:
        return f"at rest at {math.degrees(phase.target):.4g}°, or whole turns from it"
    length, window = phase.duration(), phase.window / abs(phase.target) if phase.mode == "rate" else phase.window
    if not length - window - 2.0 * width <= s.end - s.start <= LENGTH * length + 4.0 * width:
        return f"{length:.6g} s long"
    return ""
