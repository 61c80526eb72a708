"""Filters that a search tries: where it starts, means of whole samples, what is no filter but a process."""

from __future__ import annotations

import itertools
import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.maximum import Fitted
from gyrobench.reduction.noise_model.ordinates import Model, Ordinates, joined, split
from gyrobench.reduction.noise_model.prior import FILTERS, LONGEST_MEAN, SHORTEST_TAU, Prior
from gyrobench.reduction.noise_model.sensor_filters import ALL
from gyrobench.reduction.noise_model.terms import NoiseTerm

N, W, Q, B, K, GM = (NoiseTerm(n) for n in ("white", "readout", "quantization", "flicker", "walk", "gauss_markov"))
FIRST = NoiseTerm("white", "first")
BEHIND = ("first", "shape3")
SIMPLE, SHAPES = ("none", "first", "second", "average", "average+first"), ("shape3", "shape6", "shape10")
TWICE = tuple(f"bartlett{k}" for k in range(3, 17))  # of two samples: a cascade
WHOLE = tuple(f"mean{k}" for k in range(2, 17))
AFTER_FIRST = tuple(f"{mean}+first" for mean in WHOLE)
MOST_STARTS = 8  # of means, the likeliest as they are
#: starts of the parameters of a filter
STARTS: dict[str, list[list[float]]] = {
    "none": [[]],
    "first": [[math.log(0.5)], [math.log(5.0)]],
    "second": [[0.0, -0.3], [-2.0, -0.3]],
    "average": [[math.log(w)] for w in (1.5, 2.2, 4.3, 8.4, 16.5)],
    "butterworth": [[math.log(t), math.log(2.0)] for t in (0.15, 0.6, 2.5)],
    "recursive": [[0.0, -0.3], [-2.0, -0.3]],
    "cascade": [[math.log(t), math.log(k)] for t, k in ((0.3, 2.0), (1.0, 3.0))],
    "average+first": [[math.log(w), math.log(0.5)] for w in (2.2, 4.3, 8.4)],
}
SLOWEST_POLE = math.log(FILTERS["first"][0][1])
EXPLAINED = 0.7  # of the logarithm of the variance of readout noise, by rounding
NEARLY_FIRST = 1.6  # order of a low-pass below which it is as good as one of first order, damping above which


def means_beside(best: Fitted, data: Ordinates, prior: Prior) -> list[tuple[Model, Array]]:
    """Return the likeliest means over whole numbers of samples beside the slow terms of a model.

    From an average of any width no step leads across the zeros to that of another one, and beside what fills the zeros
    noise behind a mean passes for a fast process, or a process for that noise.
    """
    level, parts = prior.level, split(best.model, best.p)
    slow = [part for part in parts if part[0] not in (W, Q) and part[0].name != "white"]
    rests = [slow]
    if fast := next((part for part in slow if part[0] == GM), None):
        rests.append([part for part in slow if part is not fast])
    if parts[0][0].filter.removesuffix(ALL) == "first":
        size, tau = parts[0][1]
        rests.append([*slow, (GM, np.array([size - math.log(2.0) - tau, max(tau, math.log(SHORTEST_TAU) + 0.1)]))])
    more = [[], [(Q, np.log(level[-1:] / 4.0))], [(W, np.array([prior.readout]))]]
    sizes = np.arange(math.log(level.min()), math.log(level.max()) + 0.5, 0.5)
    tried = list[tuple[float, Model, Array]]()
    for name, rest, one in itertools.product(WHOLE + AFTER_FIRST, rests, more):
        new = NoiseTerm("white", name)
        model, start = joined([(new, np.array([0.0, *STARTS["first"][0]])[: new.size]), *rest, *one])
        starts = np.tile(start, (sizes.size, 1))
        starts[:, 0] = sizes
        value = data.value(model, starts)
        i = int(np.argmin(value))
        tried.append((float(value[i]), model, starts[i]))
    tried.sort(key=lambda t: t[0])
    return [(model, start) for _, model, start in tried[:MOST_STARTS]]


def misnamed(found: Fitted, prior: Prior) -> bool:
    """Return whether a filter of a model is a process, or a process a filter.

    A process as fast as one may be: the filter lacks something.  A mean as long as one may be stands for slow noise.
    White noise behind a slow low-pass of first order, beside readout noise that is no rounding, has the spectrum of a
    process beside white noise, and is called that.  Without white noise a process that a low-pass may be is white noise
    behind that: its level at low frequencies is N.
    """
    parts = split(found.model, found.p)
    least, most = math.log(SHORTEST_TAU) + 1e-3, math.log(LONGEST_MEAN) - 1e-3
    if any((t == GM and q[1] < least) or (t.filter.startswith("average") and q[1] > most) for t, q in parts):
        return True
    if all(t.name != "white" for t, _ in parts):
        return any(t == GM and q[1] < SLOWEST_POLE for t, q in parts)
    readout = next((q[0] for t, q in parts if t == W), None)
    if readout is None or (prior.rounding is not None and abs(readout - prior.rounding) < EXPLAINED):
        return False
    return any(_slow_pole(t, q) > SHORTEST_TAU for t, q in parts)


def _slow_pole(term: NoiseTerm, p: Array) -> float:
    """Return the time constant, samples, of a filter of nearly first order, 0 of another one."""
    name = term.filter.removesuffix(ALL).rpartition("+")[2]
    if name == "first":
        return math.exp(p[-1])
    if name in ("butterworth", "cascade"):
        return 0.5 * math.exp(-p[1]) if math.exp(p[2]) < NEARLY_FIRST else 0.0
    if name in ("second", "recursive"):
        zeta = math.exp(p[2])
        return 1.0 / (math.exp(p[1]) * (zeta - math.sqrt(zeta**2 - 1.0))) if zeta > NEARLY_FIRST else 0.0
    return 0.0
