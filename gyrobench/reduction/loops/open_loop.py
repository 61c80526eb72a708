"""Open loops from test sines: which measured points count, and why a loop has no margins or others than its model.

The test signal r is added behind the summing point: e = S r + noise, L = 1/S - 1.  Under noise alone (r - e)/e is -1, a
gain of 1 out of nothing; the coherence with r, which holds no noise, shows it.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench.record.frequency_response import model_response
from gyrobench.record.record import Record
from gyrobench.record.run_document import LinearModel, RunDocument
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.loop_measures import (
    Gate,
    Point,
    coherence,
    neighbour_noise,
    phasor,
    response,
    segment_phasors,
)
from gyrobench.reduction.loops.margins import Margins, measured_margins, unity_range

Value = tuple[float, float]  # estimate and standard uncertainty
COHERENCE = 0.8  # least one of a point that counts
SHARE, DEGREES = 0.01, 1.0  # of crossover and phase margin: no consequence of smaller differences from the linear model
CHANCE = 0.01  # share of points of noise alone that may pass


def coherence_limit(segments: int) -> float:
    """Return the least coherence of a point that counts.

    0.8: in a segment the noise then has half the size of the sine (1/g2 - 1 = 0.25), so u of the mean of eight is 12 %,
    7 degrees, and the ratio is biased by 3 %; linear propagation ends there.  With few segments more is asked: noise
    alone exceeds 1 - q^(1/(n - 1)) with probability q.  One segment has none.
    """
    return max(COHERENCE, 1.0 - CHANCE ** (1.0 / (segments - 1))) if segments > 1 else 0.0


def open_loop_point(
    gate: Gate, inside: str, test: str, by_neighbours: bool = False, lead: float = 0.0, late: float = 0.0
) -> tuple[Point, bool]:
    """Return L = (r - e)/e at the sine of a phase, and whether it counts.  by_neighbours: as loop_measures.response.

    u is that of S = e/r, which is linear in the noise: |dL/L| = |dS| / |S (1 - S)|.  coherence: the smaller one
    of those of e and of r - e with r.  lead: s, by which samples of r - e show it too early on average.
    late: s, by which the loop itself is to be later.  Raises as loop_measures.response.
    """
    t, e, r = gate.t, gate[inside], gate[test]
    loop = response(t, e, r - e, gate.f)
    true = unled(loop.value, gate.f, lead) * cmath.exp(-2j * math.pi * gate.f * late)
    if loop.u is None:
        return replace(loop, value=true), True
    rs, es = segment_phasors(t, gate.f, r, e)
    n = rs.size
    S = complex(1.0 / (1.0 + loop.value))
    scatter = math.sqrt(float(np.sum(np.abs(es / rs - S) ** 2)) / (2.0 * n * (n - 1)))
    noise = neighbour_noise(t, e, gate.f) if by_neighbours else None
    scatter = scatter if noise is None else noise / abs(phasor(t, r, gate.f))
    least = min(coherence(rs, es), coherence(rs, rs - es))
    u = scatter / (abs(S) * abs(1.0 - S)) if S not in (0.0, 1.0) else loop.u
    return Point(loop.f, true, u, least), least >= coherence_limit(n)


def unled(L: complex, f: float, lead: float) -> complex:
    """Return the open loop of a signal y whose samples lead by a time, s, of that of the samples, L = y/(r - y)."""
    p = cmath.exp(2j * math.pi * f * lead)
    return L / (p + (p - 1.0) * L)


def lead_of(record: Record, held: Mapping[str, float]) -> float:
    """Return by how much samples of a record show a held signal earlier, on average, than those at each communication
    step do, s; 0 where none is held.

    held: slot -> time at which its first sample is there, s; the last slot with a sampling period counts.
    """
    p, h, t = record.run.parameters, record.run.step, record.channels["time"]
    found = 0.0
    for slot, first in held.items():
        period = float(p.get(f"{slot}.period") or p.get(f"{slot}.Ts") or 0.0)
        if period > 1.5 * h:
            found = h * held_lead(round(period / h), round(first / h), round(float(t[1] - t[0]) / h))
    return found


def held_lead(period: int, arrives: int, every: int) -> float:
    """Return by how many steps samples of a held signal show it earlier, on average, than samples at each step do.

    period: steps for which each value is held; arrives: step of the first; every: steps from sample to sample.  Samples
    meet the ages o, o + g, ..., g the greatest common divisor of both periods; those at each step 0, 1, 2 ...
    """
    g = math.gcd(period, every)
    return 0.5 * (g - 1.0) - (-arrives) % g


def excluded_words(title: str, points: Sequence[Point], counts: Sequence[bool]) -> str:
    """Return the warning that names the points that do not count, "" where all do."""
    out = [p for p, c in zip(points, counts, strict=True) if not c]
    if not out:
        return ""
    named = ", ".join(f"{plain(p.f, 3)} Hz ({p.coherence:.2f})" for p in out)
    return (
        f"The {title} is too noisy at {named}: the coherence with the test signal (in brackets) must be {COHERENCE:g}, "
        "where u of the gain is 12 %. These points do not count for the margins. Use a larger test signal or longer "
        "phases."
    )


def friction_of(run: RunDocument) -> str:
    """Return the dry friction of the parts as text, "" where there is none."""
    known = []
    for name, value in run.parameters.items():
        if name.rpartition(".")[2] in ("friction", "stiction"):
            size = float(np.max(np.abs(np.asarray(value, float)), initial=0.0))
            if size > 0.0:
                known.append(f"{name} = {plain(size, 3)} N·m")
    return ", ".join(known)


def limits_hit(gates: Sequence[Gate]) -> list[str]:
    """Return the slots whose parts were at a limit in phases."""
    names = [n for n in gates[0].channels if n.endswith(".saturated")] if gates else []
    return [n.partition(".")[0] for n in names if any(np.any(g[n] > 0.5) for g in gates)]


def why_no_crossover(points: Sequence[Point], measured: int, run: RunDocument) -> str:
    """Return why points that count have no gain crossover.  measured: how many there are, noisy ones included."""
    if len(points) < 4:
        return (
            f"{len(points)} of {measured} measured frequencies have a coherence of {COHERENCE:g} or more; 4 are needed"
        )
    low, high = min(points, key=lambda p: p.f), max(points, key=lambda p: p.f)
    span = f"{plain(low.f, 3)} to {plain(high.f, 3)} Hz"
    largest = max(points, key=lambda p: abs(p.value))
    if all(abs(p.value) > 1.0 for p in points):
        return f"the gain does not fall through 1 from {span}, the frequencies that count"
    if abs(largest.value) > 1.0:
        near = unity_range(points) or (low.f, high.f)
        return (
            f"the gain cannot be told from 1 between {plain(near[0], 3)} and {plain(near[1], 3)} Hz, and points there "
            "or beside are too noisy to count"
        )
    reason = f"the gain is below 1 from {span}, the frequencies that count (largest {plain(abs(largest.value))})"
    friction = friction_of(run)
    if not friction:
        return reason
    return (
        f"{reason}: the friction ({friction}) holds the platform against the test signal. The loop works against the "
        "elastic contact, and its gain depends on the amplitude (describing function)"
    )


@dataclass(frozen=True)
class Twin:
    """Margins of the linear model of the same loop, on a dense response and read as the measured ones are.

    at, margin: crossover, Hz, and phase margin, degrees, on a dense response; f, phase: the same interpolated between
    its values at the measured frequencies.
    """

    at: float
    margin: float
    f: float
    phase: float

    @classmethod
    def of(cls, model: LinearModel, dense: Margins, points: Sequence[Point], near: float) -> Twin | None:
        """Return the crossover next to ``near``, Hz; None where either way finds none."""
        values = model_response(model, [p.f for p in points])[:, 0, 0]
        same = measured_margins([Point(p.f, complex(v), None, 1.0) for p, v in zip(points, values, strict=True)])
        if not same.crossovers or not dense.crossovers:
            return None
        pick = [min(m.crossovers, key=lambda c: abs(math.log(c[0] / near))) for m in (dense, same)]
        return cls(*pick[0], *pick[1])

    def widened(self, crossover: Value, phase: Value) -> tuple[Value, Value]:
        """Return measured values with what the interpolation does to the model's in their u."""
        return (
            (crossover[0], math.hypot(crossover[1], self.f - self.at)),
            (phase[0], math.hypot(phase[1], self.phase - self.margin)),
        )

    def contradicts(self, crossover: Value, phase: Value) -> bool:
        """Return whether the measured loop differs from the model, interpolated alike, by more than U and 1 % or 1 deg.

        Below these the loop has moved from the point where it was linearized, and nobody would act on it.
        """
        f, turn = abs(crossover[0] - self.f), abs(phase[0] - self.phase)
        return f > max(NORMAL * crossover[1], SHARE * self.f) or turn > max(NORMAL * phase[1], DEGREES)


def disagreement(title: str, crossover: Value, phase: Value, twin: Twin, causes: Sequence[str]) -> str:
    """Return the warning that measured and computed margins differ, with what may explain it."""
    why = "; ".join(causes) or "unknown (no limit was active, no dry friction, no noisy point)"
    return (
        f"The {title} was measured to cross at {plain(crossover[0], 4)} Hz with a phase margin of "
        f"{plain(phase[0], 3)}°; its linear model, with step and delays, crosses at {plain(twin.at, 4)} Hz with "
        f"{plain(twin.margin, 3)}°. The difference exceeds its expanded uncertainty. Possible causes: {why}."
    )
