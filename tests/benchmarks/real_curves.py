"""Published Allan deviations matched by models that are fitted to the curves: docs/real_records.md.

    python tests/benchmarks/real_curves.py FOLDER [--write]

FOLDER: deviations_*.csv with sensor, axis, tau, deviation and its 95 % interval, the rate in the first line.  A curve
is fitted by the terms of the noise model, sampled at that rate: of white noise, angle noise, flicker, random walk,
ramp, Gauss-Markov processes and oscillators that one is added which lowers chi squared most, all parameters anew, while
it lowers it by more than PRICE for each of its parameters; at most as many parameters as three less than points.  The
record is not there: octaves do not tell the frequency of an oscillator, nor a filter from a fast process.
"""

from __future__ import annotations

import csv
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import quoted
from real_records import put
from scipy.optimize import least_squares, nnls

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.ordinates import Model, allan, joined, split
from gyrobench.reduction.noise_model.terms import NoiseTerm
from gyrobench.reduction.series.channel_units import FORCE, RATE
from gyrobench.report.numbers import write_number
from gyrobench.units import G0

HEAD = ("τ / s", "inside / %", "N", "terms", "parameters of points")
ENOUGH = 0.95  # of the averaging times, for N
PRICE = 3.0  # of a parameter, of chi squared
SLOWEST = 0.5  # of the longest averaging time, of a process
FAST = 10.0  # samples: a faster process is the filter of the white noise
LOWEST = -9.0  # logarithm of the least frequency of an oscillator, 1/sample
TRIED = 4  # candidates of a kind that are fitted in full
WHITE, ANGLE, FLICKER, WALK, RAMP, MARKOV, SWING = (
    NoiseTerm(n) for n in ("white", "quantization", "flicker", "walk", "ramp", "gauss_markov", "resonance")
)
WORDS = {"white": "white", "quantization": "angle", "flicker": "flicker", "walk": "walk", "ramp": "ramp",
         "gauss_markov": "process", "resonance": "oscillator"}  # fmt: skip
#: file -> SI of one of its unit, of gyros and accelerometers, as far as it is known
UNITS = {"adis": (math.radians(1.0), G0)}


def variance(model: Model, p: Array, m: Array) -> Array:
    """Return the Allan variance (k,) of terms; a ramp has R^2 m^2/2."""
    parts = split(model, p)
    rest = [(t, q) for t, q in parts if t != RAMP]
    slow = sum(0.5 * math.exp(q[0]) * m * m for t, q in parts if t == RAMP)
    return np.asarray((allan(*joined(rest), m) if rest else 0.0) + slow)


class Curve:
    """A deviation (k,) at m (k,) samples with the standard deviation of its logarithm, and the fit of models to it."""

    def __init__(self, m: Array, deviation: Array, u: Array) -> None:
        self.m, self.u = m, u
        self.size = float(deviation[0])
        self.variance = (deviation / self.size) ** 2

    def misfit(self, model: Model, p: Array) -> Array:
        """Return the residuals (k,) of the logarithm of the deviation over their standard deviations."""
        return np.asarray(0.5 * np.log(variance(model, p, self.m) / self.variance) / self.u)

    def fit(self, model: Model, start: Array) -> tuple[float, Array]:
        """Return chi squared and the parameters of a model near ``start``."""
        low, high = [], []
        for t in model:
            low.append(-60.0)
            high.append(10.0)
            if t.name in ("gauss_markov", "resonance"):
                low.append(math.log(0.3))
                high.append(math.log(SLOWEST * self.m[-1]))
            if t.name == "resonance":
                low.append(LOWEST)
                high.append(math.log(math.pi))
        inner = np.clip(start, np.array(low) + 1e-6, np.array(high) - 1e-6)
        found = least_squares(lambda p: self.misfit(model, p), inner, bounds=(low, high), x_scale=1.0, max_nfev=120)
        return 2.0 * float(found.cost), found.x

    def candidates(self, term: NoiseTerm) -> Iterator[Array]:
        """Yield the parameters of a term but its size."""
        slowest = math.log(SLOWEST * self.m[-1]) - 0.1
        if term == MARKOV:
            yield from np.linspace(math.log(0.5), slowest, 24)[:, None]
        elif term == SWING:
            for f in np.linspace(LOWEST, math.log(0.98 * math.pi), 36):
                for cycles in (0.0, 2.0, 5.0):  # of its decay, logarithm
                    yield np.array([min(cycles + max(-f, 0.5), slowest), f])
        else:
            yield np.empty(0)

    def best_of(self, model: Model, p: Array, term: NoiseTerm) -> tuple[float, Model, Array]:
        """Return chi squared, model and parameters with a term more."""
        weight = 1.0 / (2.0 * self.variance * self.u)
        have = [variance((t,), q, self.m) for t, q in split(model, p)]
        scan = []
        for rest in self.candidates(term):
            A = np.column_stack([*have, variance((term,), np.append(0.0, rest), self.m)]) * weight[:, None]
            scale = np.linalg.norm(A, axis=0)
            x, miss = nnls(A / scale, self.variance * weight)
            if x[-1] > 0.0:
                scan.append((miss, np.log(np.maximum(x / scale, 1e-25)), rest))
        tried = [(math.inf, model, p)]
        for _, sizes, rest in sorted(scan, key=lambda s: s[0])[:TRIED]:
            parts = [(t, np.append(q[0] + s, q[1:])) for (t, q), s in zip(split(model, p), sizes[:-1], strict=True)]
            new, start = joined([*parts, (term, np.append(sizes[-1], rest))])
            tried.append((lambda c, q, new=new: (c, new, q))(*self.fit(new, start)))
        return min(tried, key=lambda t: t[0])

    def search(self) -> tuple[float, Model, Array]:
        """Return chi squared, model and parameters that no term more improves by its price."""
        value, p = self.fit((WHITE,), np.zeros(1))
        at: tuple[float, Model, Array] = (value, (WHITE,), p)
        while True:
            more = self.more(at)
            if not more or self.worth(more[0]) >= self.worth(at):  # a term may be worth its price beside another one
                more = [second for first in more[:2] for second in self.more(first)[:1]]
                more.sort(key=self.worth)
            if not more or self.worth(more[0]) >= self.worth(at):
                return self.pruned(at)
            at = more[0]

    def worth(self, at: tuple[float, Model, Array]) -> float:
        """Return chi squared with the price of the parameters."""
        return at[0] + PRICE * at[2].size

    def more(self, at: tuple[float, Model, Array]) -> list[tuple[float, Model, Array]]:
        """Return the fits with a term more, the best first."""
        left = self.m.size - 3 - at[2].size
        terms = [t for t in (ANGLE, FLICKER, WALK, RAMP, MARKOV, SWING) if t in (MARKOV, SWING) or t not in at[1]]
        found = [self.best_of(at[1], at[2], t) for t in terms if t.size <= left]
        return sorted((f for f in found if math.isfinite(f[0])), key=self.worth)

    def pruned(self, at: tuple[float, Model, Array]) -> tuple[float, Model, Array]:
        """Return a model without the terms that are not worth their price."""
        for i in range(len(at[1]) - 1, -1, -1):
            parts = split(at[1], at[2])
            if len(parts) > 1:
                model, p = joined(parts[:i] + parts[i + 1 :])
                value, p = self.fit(model, p)
                if value - at[0] < PRICE * parts[i][0].size:
                    at = (value, model, p)
        return at

    def white(self, model: Model, p: Array) -> float:
        """Return N^2 per sample: white noise and processes that are faster than FAST samples."""
        total = 0.0
        for t, q in split(model, p):
            if t == WHITE:
                total += math.exp(q[0])
            elif t == MARKOV and q[1] < math.log(FAST):
                z = math.exp(-math.exp(-q[1]))
                total += math.exp(q[0]) * (1.0 + z) / (1.0 - z)
        return total * self.size**2


def curves(file: Path) -> Iterator[tuple[str, str, float, Array]]:
    """Yield sensor, axis, rate in Hz and the columns tau, deviation, low, high (4, k) of each curve."""
    text = file.read_text(encoding="utf-8")
    found = re.search(r"rate \[(?:np\.float64\()?([\d.]+)", text)
    assert found, f"{file}: no rate"
    rows = list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))
    for sensor, axis in dict.fromkeys((r["sensor"], r["axis"]) for r in rows):
        mine = [r for r in rows if (r["sensor"], r["axis"]) == (sensor, axis)]
        columns = np.array([[float(r[n]) for r in mine] for n in ("tau [s]", "adev", "low", "high")])
        yield sensor, axis, float(found[1]), columns


def words_of(model: Model) -> str:
    """Return the terms of a model in words."""
    names = [WORDS[t.name] for t in model]
    return ", ".join(f"{names.count(n)} {n}" + ("s" if n == "oscillator" else "es") if names.count(n) > 1 else n
                     for n in dict.fromkeys(names))  # fmt: skip


def main(folder: Path, write: bool) -> None:
    stated = count = 0
    for file in sorted(folder.glob("deviations_*.csv")):
        name = file.stem.removeprefix("deviations_")
        for sensor, axis, rate, (tau, dev, low, high) in curves(file):
            gyro = sensor == "Gyroscope"
            curve = Curve(np.rint(tau * rate), dev, (high - low) / (3.92 * dev))
            _, model, p = curve.search()
            shown = tau <= tau[-1] / 2.5  # a tenth of the record: the longest of the curve is a quarter
            implied = curve.size * np.sqrt(variance(model, p, curve.m))
            inside = float(np.mean(((implied >= low) & (implied <= high))[shown]))
            si = UNITS.get(name, (1.0, 1.0))[not gyro]
            unit, factor, _ = (RATE if gyro else FORCE).terms["N"]
            N = math.sqrt(curve.white(model, p) / rate)
            stated, count = stated + (inside >= ENOUGH), count + 1
            values = {
                "τ / s": f"{tau[0]:.2g} to {tau[shown][-1]:.3g}", "inside / %": f"{100.0 * inside:.1f}",
                "N": f"{write_number(N * si / factor, significant=3).text} {unit}" if inside >= ENOUGH and N else "–",
                "terms": words_of(model), "parameters of points": f"{p.size} of {tau.size}",
            }  # fmt: skip
            print(f"| {name} {sensor} {axis} | {' | '.join(values[h] for h in HEAD)} |", flush=True)
            if write:
                quoted.record(f"curve.{name}-{sensor}-{axis}", values, "", "tests/benchmarks/real_curves.py FOLDER")
    if write:
        put("curve", HEAD)
    print(f"matched: {stated} of {count} curves")


if __name__ == "__main__":
    main(Path(sys.argv[1]), "--write" in sys.argv)
