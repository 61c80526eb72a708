"""Prior of the parameters of a noise model, by what a record could show of each term."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.ordinates import Model, Ordinates, split
from gyrobench.reduction.noise_model.sensor_filters import ALL, Grid
from gyrobench.reduction.noise_model.terms import PEAKS, SLOW, NoiseTerm

GROUP = 0.12  # of the logarithm of frequency, over which the reference spectrum is smoothed
HELD_BACK = 0.1  # of a spectrum that falls by f^-2
FEWEST = 12.0  # ordinates of a group
SHORTEST_TAU = 6.0  # samples, of a Gauss-Markov process: what is faster is the filter
LONGEST_MEAN = 64.0  # samples, of a filter
APART = math.log(3.0)  # least distance of the logarithms of two tau: nearer ones are one process to any record
#: logarithms of the least and largest value of the parameters of filters; their prior is even
FILTERS = {
    "first": [(0.05, 30.0)],
    "second": [(0.03, 6.0), (0.1, 5.0)],
    "recursive": [(0.03, 6.0), (0.1, 1.0)],  # a slow pole beside a fast one would be drift
    "average": [(1.05, LONGEST_MEAN)],
    "butterworth": [(0.02, 30.0), (0.5, 12.0)],
    "cascade": [(0.02, 30.0), (0.5, 12.0)],
}
AS_KNOWN = 0.05  # of the logarithm of the variance of rounding errors, a twelfth of the square of the step
NO_ROUNDING = 0.05  # probability that an output in steps has none: sums of what was rounded, or a remainder is carried
FITS = 0.8  # of the rounding errors, what the spectrum has at least where there are any
SQRT_2PI = math.sqrt(2.0 * math.pi)
HARD = 1e3  # slope of the walls, of the square of what is beyond


class Prior:
    """Prior of the parameters of every term.

    Of a variance v: density of log v ~ v/(v + v0) up to vmax: even in log v above v0, even in v below, where v0 is what
    the record just shows (standard deviation of v about zero under a smoothed spectrum) and vmax what exceeds the
    spectrum.  log tau is even between the shortest and the length of the record.  Readout noise is the rounding of the
    output, where its step is known and its errors show: a filter does not see them, and no slow noise may stand for
    them.
    """

    def __init__(self, data: Ordinates) -> None:
        order = np.argsort(data.grid.omega)
        omega, count, power = data.grid.omega[order], data.all_count[order], data.all_power[order]
        group = np.floor(np.log(omega / omega[0]) / GROUP).astype(int)
        starts = np.flatnonzero(np.diff(group, prepend=-1))
        total, merged, held = np.add.reduceat(count, starts), [0], 0.0
        for i, c in enumerate(total.tolist()):
            held += c
            if held >= FEWEST and i + 1 < total.size:
                merged.append(i + 1)
                held = 0.0
        starts = starts[merged]
        self.count = np.add.reduceat(count, starts)
        self.level = np.maximum(np.add.reduceat(power, starts) / self.count, 1e-13)
        self.grid = Grid(np.exp(np.add.reduceat(count * np.log(omega), starts) / self.count), data.grid.means)
        # slow noise falls by f^-2 at most: what is far below that has passed a low-pass, and slow noise with it
        fall = np.maximum.accumulate(self.level * self.grid.omega**2) / self.grid.omega**2
        self.before = np.where(self.level < HELD_BACK * fall, fall, self.level)
        self._bounds: dict[Model, tuple[Array, Array]] = {}
        self.longest, self.samples = math.log(float(np.max(data.n))), data.samples
        self.taus = np.linspace(math.log(SHORTEST_TAU), self.longest, 40)
        self.markov = np.array([self._range(NoiseTerm("gauss_markov"), np.array([t])) for t in self.taus])
        self.others = {name: self._range(NoiseTerm(name), np.empty(0))
                       for name in ("white", "readout", "quantization", "flicker", "walk")}  # fmt: skip
        least, shown = float(np.min(self.level)), math.exp(self.others["readout"][0])
        self.rounding = math.log(data.rounding) if shown < data.rounding < least / FITS else None
        #: likely size of readout noise
        self.readout = math.log(least) if self.rounding is None else self.rounding

    def _range(self, term: NoiseTerm, rest: Array) -> Array:
        """Return log v0, log vmax of a term with the other parameters given."""
        unit = term.unit(rest, self.grid)
        level = self.before if term.name in SLOW else self.level
        v0 = (0.5 * float(np.sum(self.count * (unit / level) ** 2))) ** -0.5
        ratio = level / np.maximum(unit, 1e-300)  # a filter hides what is white before it
        most = 10.0 * float(np.max(ratio) if term.name == "white" else np.min(ratio))
        return np.array([math.log(v0), math.log(max(most, v0))])

    def ranges(self, term: NoiseTerm, p: Array) -> tuple[Array, Array]:
        """Return log v0 and log vmax of a term (...), p (..., size)."""
        if term.name == "gauss_markov":
            low, high = (np.interp(p[..., 1], self.taus, self.markov[:, j]) for j in (0, 1))
            return low, high
        low, high = self.others[term.name]
        return np.full(p.shape[:-1], low), np.full(p.shape[:-1], high)

    def bounds(self, model: Model) -> tuple[Array, Array]:
        """Return the least and largest value of each parameter."""
        if model in self._bounds:
            return self._bounds[model]
        limits: list[tuple[float, float]] = []
        for term in model:
            limits.append((-40.0, 40.0))
            if term.name == "gauss_markov":
                limits.append((math.log(SHORTEST_TAU), self.longest))
            elif term.name in PEAKS:
                limits += [(math.log(3.0), self.longest), (-7.0, math.log(math.pi))]
            for part in term.filter.removesuffix(ALL).split("+"):
                if part.startswith("shape"):
                    limits += [(-6.0, 6.0)] * int(part[5:])
                limits += [(math.log(a), math.log(b)) for a, b in FILTERS.get(part, [])]
        low, high = zip(*limits, strict=True)
        self._bounds[model] = np.array(low), np.array(high)
        return self._bounds[model]

    def log(self, model: Model, p: Array) -> Array:
        """Return the logarithm of the prior density (M,) of parameters (M, q), steep walls instead of ends."""
        low, high = self.bounds(model)
        beyond = np.maximum(p - high, 0.0) + np.maximum(low - p, 0.0)
        out = -HARD * np.sum(beyond**2, axis=-1)
        taus = []
        names = [t.name for t in model]
        if self.rounding is not None and any(t.filter != "none" for t in model) and "readout" not in names:
            out = out + math.log(NO_ROUNDING)  # white noise that passed no filter has it in itself
        for term, q in split(model, p):
            if term.name in PEAKS:  # anywhere
                out = out - math.log(self.samples / 20.0)
                continue
            v0, most = self.ranges(term, q)
            size = -np.log1p(np.exp(-np.clip(q[..., 0] - v0, -40.0, 40.0)))
            size = size - np.log(np.log1p(np.exp(np.minimum(most - v0, 40.0))))
            size = size - 10.0 * np.maximum(q[..., 0] - most, 0.0) ** 2
            if term.name == "readout" and self.rounding is not None:
                known = -0.5 * ((q[..., 0] - self.rounding) / AS_KNOWN) ** 2 - math.log(AS_KNOWN * SQRT_2PI)
                size = np.logaddexp(size + math.log(NO_ROUNDING), known + math.log1p(-NO_ROUNDING))
            out = out + size
            if term.name == "gauss_markov":
                taus.append(q[..., 1])
                out = out - math.log(self.longest - math.log(SHORTEST_TAU))
        for a, b in pairwise(taus):  # in their order
            out = out - HARD * np.maximum(APART - (b - a), 0.0) ** 2
        density: Array = out + float(special.gammaln(len(taus) + 1.0))
        return density
