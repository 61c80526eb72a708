"""Coverage of the intervals of N, B, K, R, Q over random records, and the slopes method beside the fit.

    python tests/benchmarks/noise_coefficients.py [--records 1000] [--seed 1] [--shortest 1e3] [--longest 1e6]

Records are written from the equations, without the reduction's parts: white noise, flicker as a sum of relaxation
processes whose means over tau0 are exact, means of a Wiener process, a ramp, errors of angles (in half of the records
where the rate changes by more than them from sample to sample, the angle is rounded to steps of sqrt(12) Q instead).
The length is log-uniform.  N = 1 if present; the tau where another term equals it is log-uniform: Q 0.3 to n/10
samples, B 1 to 3 n, K 3 to 10 n, R n/100 to 3 n; each term is absent from one record in four, so that many are hidden
or missing.  tau0 is log-uniform from 1 ms to 10 s.
"""

from __future__ import annotations

import math
import time

import numpy as np
from asked import asked
from scipy.signal import lfilter

from gyrobench.reduction.series.deviations import deviations
from gyrobench.reduction.series.noise_coefficients import NoiseCoefficients, fit, slopes

Array = np.ndarray
NAMES = ("N", "B", "K", "R", "Q")


def flicker(n: int, rng: np.random.Generator) -> Array:
    """Means over unit time of S = 1/(2 pi f), f from 1e-2/n up: relaxations of variance h/pi, tau spaced by h."""
    h = math.log(10.0) / 2.0
    out = np.zeros(n)
    for tau in 10.0 ** np.arange(-4.0, math.log10(n) + 2.01, 0.5):
        p, variance = math.exp(-1.0 / tau), h / math.pi
        gain = -tau * math.expm1(-1.0 / tau)
        step = variance * -math.expm1(-2.0 / tau)
        mean = variance * (2.0 * tau * (1.0 - gain) - gain**2) if tau < 1e3 else variance * 2.0 / (3.0 * tau)
        both = variance * tau * math.expm1(-1.0 / tau) ** 2 / math.sqrt(step)
        a, b = rng.standard_normal((2, n))
        first = math.sqrt(variance) * rng.standard_normal()
        x = lfilter([1.0], [1.0, -p], math.sqrt(step) * a, zi=[p * first])[0]
        out += gain * np.append(first, x[:-1]) + both * a + math.sqrt(max(mean - both**2, 0.0)) * b
    return out


def record(n: int, truth: dict[str, float], rounded: bool, rng: np.random.Generator) -> Array:
    """Rates (n,) over unit time."""
    rate = truth["N"] * rng.standard_normal(n) + truth["R"] * np.arange(n)
    if truth["B"]:
        rate += truth["B"] * flicker(n, rng)
    if truth["K"]:
        step, bridge = truth["K"] * rng.standard_normal((2, n))
        rate += np.cumsum(step) - step / 2.0 + bridge / math.sqrt(12.0)
    if rounded and 0.0 < truth["Q"] < 0.35 * np.diff(rate).std():  # else its errors are not independent
        size = math.sqrt(12.0) * truth["Q"]
        angle = np.concatenate([[0.0], np.cumsum(rate)]) / size + rng.random()
        return size * np.diff(np.round(angle))
    if truth["Q"]:
        rate += np.diff(truth["Q"] * rng.standard_normal(n + 1))
    return rate


def draw(n: int, rng: np.random.Generator) -> dict[str, float]:
    """Coefficients per unit time; N is 1, or it is absent and the others are as if it were."""

    def tau(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(math.log(low), math.log(high))))

    drawn = {
        "N": 1.0,
        "Q": math.sqrt(tau(0.3, n / 10.0) / 3.0),
        "B": math.sqrt(math.pi / (2.0 * math.log(2.0) * tau(1.0, 3.0 * n))),
        "K": math.sqrt(3.0) / tau(3.0, 10.0 * n),
        "R": rng.choice([-1.0, 1.0]) * math.sqrt(2.0) / tau(n / 100.0, 3.0 * n) ** 1.5,
    }
    out = {name: value * bool(rng.random() > 0.25) for name, value in drawn.items()}
    return out if out["N"] or out["Q"] else {**out, "N": 1.0}


def scaled(found: NoiseCoefficients, tau0: float) -> Array:
    """Value, low, high, determined of N, B, K, R, Q (5, 4), per unit time."""
    unit = {"N": tau0**-0.5, "B": 1.0, "K": tau0**0.5, "R": tau0, "Q": 1.0 / tau0}
    rows = [(getattr(found, name), unit[name]) for name in NAMES]
    return np.array([(e.value * u, e.low * u, e.high * u, e.determined) for e, u in rows])


def counts(records: int, seed: int, shortest: float, longest: float) -> tuple[Array, Array, Array, Array, Array]:
    """Return lengths (m,), truth (m, 5), fit (m, 5, 4), slopes (m, 5, 4) and p of spectrum and line (m, 2)."""
    lengths, truths, fits, lines, checks = [], [], [], [], []
    begin = shown = time.monotonic()
    for i in range(records):
        rng = np.random.default_rng([seed, i])
        n = round(math.exp(rng.uniform(math.log(shortest), math.log(longest))))
        truth, tau0 = draw(n, rng), 10.0 ** rng.uniform(-3.0, 1.0)
        rate = record(n, truth, bool(rng.random() < 0.5), rng)
        lengths.append(n)
        truths.append([truth[name] for name in NAMES])
        found = fit(rate, tau0)
        assert found.check is not None
        fits.append(scaled(found, tau0))
        checks.append([found.check.p, found.check.line_p])
        lines.append(scaled(slopes(deviations(rate, tau0)["allan"]), tau0))
        if time.monotonic() - shown > 30.0:
            shown = time.monotonic()
            print(f"  {i + 1} of {records} records, {shown - begin:.0f} s", flush=True)
    return np.array(lengths), np.array(truths), np.array(fits), np.array(lines), np.array(checks)


def covered(truth: Array, found: Array) -> Array:
    """Whether the intervals hold the truth; the slopes read R without its sign."""
    return (found[..., 1] <= truth) & (truth <= found[..., 2])


def table(n: Array, truth: Array, ours: Array, lines: Array, checks: Array) -> None:
    """Print coverage, errors and widths."""
    print("95 % intervals: share that hold the truth (term present, absent), share determined (present, absent)")
    print("            all    n<1e4     <1e5     <1e6   present    absent   determined, if absent   slopes  determined")
    for j, name in enumerate(NAMES):
        t, e, s = truth[:, j], ours[:, j], lines[:, j]
        size = np.abs(t)
        inside, read = covered(t, e), covered(size, s)
        by_length = [inside[(n >= a) & (n < 10 * a)] for a in (1e3, 1e4, 1e5)]
        there = t != 0.0
        sure, claimed = e[:, 3] > 0, s[:, 3] > 0
        shares = [inside, *by_length, inside[there], inside[~there], sure[there], sure[~there], read, read[claimed]]
        print(f"    {name}  " + "  ".join(f"{x.mean():8.3f}" if x.size else "       -" for x in shares))
    print("median of |log(estimate/truth)|, median of high/low and its truth in it, where both methods determine it")
    for j, name in enumerate(NAMES):
        t, e, s = np.abs(truth[:, j]), ours[:, j], lines[:, j]
        both = (t > 0.0) & (e[:, 3] > 0) & (s[:, 3] > 0)
        value, line = np.abs(e[both, 0]), s[both, 0]
        wide = np.sort(np.abs(e[both, 1:3]), axis=1)
        closer = np.mean(np.abs(np.log(value / t[both])) < np.abs(np.log(line / t[both])))
        print(
            f"    {name}  {both.sum():4d} records: fit {np.median(np.abs(np.log(value / t[both]))):.3f}, "
            f"slopes {np.median(np.abs(np.log(line / t[both]))):.3f}, "
            f"fit closer in {closer:.2f}; width "
            f"{np.median(wide[:, 1] / wide[:, 0]):.2f} and {np.median(s[both, 2] / s[both, 1]):.2f}, coverage "
            f"{covered(truth[both, j], e[both]).mean():.3f} and {covered(t[both], s[both]).mean():.3f}"
        )
    shares = ", ".join(f"{a:g}: {np.mean(checks < a, axis=0).round(4).tolist()}" for a in (0.1, 0.01, 0.001))
    print(f"share of these records with p of the spectrum and of a line below {shares}")


if __name__ == "__main__":
    given = asked(
        __doc__, records=1000, seed=1, shortest=1e3, longest=1e6,
        save=(str, "file .npz for the figures of every record"),
    )  # fmt: skip
    figures = counts(given.records, given.seed, given.shortest, given.longest)
    if given.save:
        np.savez(given.save, *figures)
    table(*figures)
