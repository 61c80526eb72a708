"""Coverage of the noise model on simulated records: intervals of N, Gauss-Markov processes, K, Q; absent terms stated.

    python tests/benchmarks/noise_model_coverage.py RECORDS SAMPLES [FAULT ...] [part of a name]
    python tests/benchmarks/noise_model_coverage.py RECORDS 1e4..1e6 any [part of a name]

RECORDS: how many, or a range such as 200..399 of their seeds.  SAMPLES: a number, or a range in which the logarithm is
even.  any: nothing or one of the first five faults by chance, each as likely.

Truths are white noise, as it is or through a low-pass or a mean, up to three Gauss-Markov processes, K, Q, angles that
swing (rms, angular frequency, decay of each); unit time is a sample.  digital: order and cutoff, over half the sampling
rate, of a Butterworth filter that white noise and flicker B pass, before a readout of 0.003.  all: numerator and
denominator of another one that they pass.
behind: processes that pass what "all" does.  rounded: to a multiple of.
Faults, wild: a thousandth of samples off by 20 standard deviations; step: of one; line: of 0.3 at 0.2317 of the rate;
missing: a tenth of the samples; gaps: a tenth, of 100 on average; slow: a warm-up of 3 standard deviations, a fifteenth
of the record long, and three cycles of one.  "slow" stated: records with either taken out.

drawn: another truth for each record, of what laboratories' instruments show: white noise, as it is or through a
low-pass or a mean; none to three processes, tau even in the logarithm from 8 samples to a quarter of the record, the
spectrum at zero over the white one from 0.1 to 10,000, tau a factor of three apart; in one record of five each a walk,
angle noise, flicker.

K is of the walk and of processes slower than a tenth of the record together, which drift as one within it.

Of a process that is found tau and sigma are those of the true one nearest in log tau, each counted once; "sigma
together" is of all true ones within its interval of tau.
agree: part of the records whose model agrees with them, so that something is stated; the rest is counted over those.
"""

from __future__ import annotations

import math
import sys
import time
from collections import defaultdict
from typing import Any

import numpy as np
from scipy.signal import butter, fftconvolve, lfilter

from gyrobench.arrays import Array
from gyrobench.reduction.noise_model.fit import fit_noise

_a = np.real(np.poly(np.exp(np.roots([1.0, 0.5, 0.25]))))
POLES = ([_a.sum()], _a)  # recursive, natural frequency and damping 0.5
TRUTHS: dict[str, dict[str, Any]] = {
    "white noise": {"N": 1.0},
    "a walk beside it": {"N": 1.0, "K": 0.01},
    "low-pass, one process, walk": {"N": 1.0, "lag": 0.56, "markov": [(0.05, 200.0)], "K": 3e-4},
    "one process": {"N": 1.0, "markov": [(0.0444, 270.0)]},
    "mean of 3, three processes": {"N": 1.0, "mean": 3, "markov": [(0.3, 12.0), (0.15, 150.0), (0.15, 1500.0)]},
    "a ramp over white noise and a drift": {"N": 1.0, "markov": [(0.0444, 270.0)], "R": 2e-4},
    "angle noise, one process": {"N": 0.1, "Q": 1.0, "markov": [(0.02, 100.0)]},
    "ring laser": {"N": 0.005, "Q": 1.0, "swings": [(2.0, 2.94, 400.0), (0.3, 0.9, 1000.0), (0.1, 1.9, 100.0)]},
    "flicker, barely seen in 3,600 samples": {"N": 1.0, "B": 0.12},
    "all noise through a mean of 3, flicker": {"N": 1.0, "B": 0.12, "all": (np.full(3, 1.0 / 3.0), [1.0])},
    "digital low-pass, flicker": {"N": 1.0, "B": 0.2, "digital": (2, 0.15)},
    "recursive low-pass, flicker": {"N": 1.0, "B": 0.15, "all": POLES},
    "low-pass of 10 samples, flicker": {"N": 1.0, "B": 0.15, "all": ([1.0 - math.exp(-0.1)], [1.0, -math.exp(-0.1)])},
    "two means over 4": {"N": 1.0, "all": (np.convolve(np.ones(4), np.ones(4)) / 16.0, [1.0])},
    "two means over 4, one process": {
        "N": 1.0,
        "all": (np.convolve(np.ones(4), np.ones(4)) / 16.0, [1.0]),
        "behind": [(0.1, 100.0)],
    },
    "two means over 8, flicker": {"N": 1.0, "B": 0.15, "all": (np.convolve(np.ones(8), np.ones(8)) / 64.0, [1.0])},
    "mean of 2, rounded": {"N": 1.0, "mean": 2, "markov": [(0.125, 100.0), (0.042, 3000.0)], "rounded": 0.042},
}
DRAWN = "drawn"

FINE = 8  # steps of an oscillator to a sample
KINDS = ("wild", "step", "line", "missing", "gaps", "slow")
MIXED, AMONG = "any", ["", *KINDS[:5]]


def drawn(n: int, rng: np.random.Generator) -> dict[str, Any]:
    """Return a truth for a record of n samples, whose white noise is more than the rest at some frequency."""
    omega = math.pi * np.arange(1, n // 2 + 1) / (n // 2)
    while True:
        truth: dict[str, Any] = {"N": 1.0, "markov": []}
        S = np.ones_like(omega)
        kind, count = rng.integers(4), rng.integers(4)
        if kind == 0:
            truth["lag"] = 10.0 ** rng.uniform(-0.5, 0.7)
            a = math.exp(-1.0 / truth["lag"])
            S = (1.0 - a) ** 2 / (1.0 - 2.0 * a * np.cos(omega) + a * a)
        elif kind == 1:
            truth["mean"] = int(rng.integers(2, 9))
            S = (np.sin(0.5 * truth["mean"] * omega) / np.sin(0.5 * omega) / truth["mean"]) ** 2
        while len(truth["markov"]) < count:
            tau = 8.0 * (n / 32.0) ** rng.random()
            if all(abs(math.log(tau / t)) > math.log(3.0) for _, t in truth["markov"]):
                truth["markov"].append((math.sqrt(10.0 ** rng.uniform(-1.0, 4.0) / (2.0 * tau)), tau))
        # a walk meets the white noise at 1 to 30 cycles of the record
        sizes = {"K": 2.0 * math.pi / n * 10.0 ** rng.uniform(0.0, 1.5), "Q": 10.0 ** rng.uniform(-1.0, 0.5),
                 "B": 10.0 ** rng.uniform(-1.5, -0.3)}  # fmt: skip
        truth |= {name: size for name, size in sizes.items() if rng.random() < 0.2}
        rest = sum(2.0 * s * s * t / (1.0 + (omega * t) ** 2) for s, t in truth["markov"])
        rest = rest + truth.get("B", 0.0) ** 2 / omega + (truth.get("K", 0.0) / omega) ** 2
        if np.any(rest + (truth.get("Q", 0.0) * omega) ** 2 < S):
            return truth


def flicker(n: int, rng: np.random.Generator) -> Array:
    """Return means over a sample (n,) of noise of the spectrum 1/omega, from four times the record on."""
    omega = math.pi * np.arange(1, 2 * n + 1) / (2 * n)
    S = sum((np.sin(0.5 * omega) / (0.5 * omega + math.pi * k)) ** 2 / np.abs(omega + 2.0 * math.pi * k)
            for k in range(-8, 9))  # fmt: skip
    white = np.fft.rfft(rng.normal(size=4 * n))
    return np.fft.irfft(np.concatenate([[0.0], white[1:] * np.sqrt(S)]))[:n]


def simulated(n: int, truth: dict[str, Any], kinds: list[str], rng: np.random.Generator) -> Array:
    """Return a record (n,) of a truth."""
    x = truth["N"] * rng.normal(size=n + 500)
    if "lag" in truth:
        a = math.exp(-1.0 / truth["lag"])
        x = lfilter([1.0 - a], [1.0, -a], x)
    if count := truth.get("mean", 0):
        x = lfilter(np.full(count, 1.0 / count), [1.0], x)
    if "B" in truth and "all" not in truth and "digital" not in truth:
        x = x + np.concatenate([np.zeros(500), truth["B"] * flicker(n, rng)])
    elif "B" in truth:  # by half a difference: spectrum B^2/(2 sin(omega/2))
        k = np.arange(1.0, 2.0 * n)
        half = np.concatenate([[1.0], np.cumprod((k - 0.5) / k)])
        x = x + truth["B"] * fftconvolve(rng.normal(size=3 * n), half)[2 * n - 500 : 3 * n]
    for sigma, tau in truth.get("behind", []):
        a = math.exp(-1.0 / tau)
        x = x + lfilter([1.0], [1.0, -a], sigma * math.sqrt(1.0 - a * a) * rng.normal(size=n + 500))
    if "all" in truth:
        x = lfilter(*truth["all"], x)
    if "digital" in truth:
        x = lfilter(*butter(*truth["digital"]), x) + 0.003 * rng.normal(size=n + 500)
    x = x[500:]
    for sigma, tau in truth.get("markov", []):
        a = math.exp(-1.0 / tau)
        w = sigma * math.sqrt(1.0 - a * a) * rng.normal(size=n)
        x = x + lfilter([1.0], [1.0, -a], w, zi=[a * sigma * rng.normal()])[0]
    for rms, omega, tau in truth.get("swings", []):  # of an angle
        r = math.exp(-1.0 / (FINE * tau))
        noise = rng.normal(size=FINE * (n + 1 + round(9 * tau)))
        angle = lfilter([1.0], [1.0, -2.0 * r * math.cos(omega / FINE), r * r], noise)[::FINE]
        x = x + np.diff(rms / angle.std() * angle[-n - 1 :])
    x = x + np.cumsum(truth.get("K", 0.0) * rng.normal(size=n)) + np.diff(truth.get("Q", 0.0) * rng.normal(size=n + 1))
    x = x + truth.get("R", 0.0) * np.arange(n)
    sd = math.sqrt(0.5 * float(np.mean(np.diff(x) ** 2)))
    if "wild" in kinds:
        x = x + 20.0 * sd * rng.choice([-1.0, 1.0], n) * (rng.random(n) < 1e-3)
    if "step" in kinds:
        x = x + sd * (np.arange(n) > rng.integers(n // 10, 9 * n // 10))
    if "line" in kinds:
        x = x + 0.3 * sd * np.sin(2.0 * math.pi * 0.2317 * np.arange(n) + 1.0)
    if "slow" in kinds:
        t = np.arange(n) / n
        x = x + sd * (3.0 * np.exp(-15.0 * t) + np.sin(2.0 * math.pi * 3.1 * t + 1.0))
    if step := truth.get("rounded", 0.0):
        x = step * np.rint(x / step)
    if "missing" in kinds:
        x = np.where(rng.random(n) < 0.1, math.nan, x)
    if "gaps" in kinds:
        begin = np.flatnonzero(rng.random(n) < 1e-3)
        for a, b in zip(begin, begin + rng.geometric(0.01, begin.size), strict=True):
            x[a:b] = math.nan
    return np.asarray(x)


def main(seeds: range, lengths: tuple[float, float], kinds: list[str], only: str = "") -> None:
    for name, truth in (TRUTHS | {DRAWN: {}}).items():
        if only not in name:
            continue
        inside, stated, missed = defaultdict(list), defaultdict(list), []
        agreed, began = [], time.process_time()
        for i in seeds:
            n, these = round(lengths[0]), kinds
            if lengths[1] > lengths[0]:
                n = round(lengths[0] * (lengths[1] / lengths[0]) ** np.random.default_rng([12, i]).random())
            if MIXED in kinds:
                these = [k for k in [np.random.default_rng([13, i]).choice(AMONG)] if k]
            if name == DRAWN:
                truth = drawn(n, np.random.default_rng([14, i]))
            model = fit_noise(simulated(n, truth, these, np.random.default_rng([11, i, n])), 1.0, means=False)
            agreed.append(model.agrees)
            if not model.agrees:  # nothing is stated
                continue
            drifts = [s * s * 2.0 / t for s, t in [*truth.get("markov", []), *truth.get("behind", [])] if t > 0.1 * n]
            walk = math.sqrt(truth.get("K", 0.0) ** 2 + sum(drifts))
            for term in "NBKRQ":
                e, true = model[term], walk if term == "K" else truth.get(term, 0.0)
                inside[term].append(e.low <= true <= e.high)
                if e.determined and true:
                    inside[f"{term} stated"].append(inside[term][-1])
                if not inside[term][-1]:
                    missed.append(f"{term} {i} ({n} {' '.join(these)}: {e.low:.4g} to {e.high:.4g})")
                stated[term].append(e.determined)
                stated[f"{term} absent"].append(e.determined and not true)
            stated["filter"].append(bool(model.filter_words()))
            stated["slow"].append(bool(model.settling or model.swings))
            processes = [*truth.get("markov", []), *truth.get("behind", [])]
            left = list(processes)
            for g in (g for g in model.processes if g.tau.determined):
                if not left:
                    stated["one process too many"].append(True)
                    continue
                sigma, tau = left.pop(min(range(len(left)), key=lambda k: abs(math.log(left[k][1] / g.tau.value))))
                inside["sigma"].append(g.sigma.low <= sigma <= g.sigma.high)
                inside["tau"].append(g.tau.low <= tau <= g.tau.high)
                if those := [s for s, t in processes if g.tau.low <= t <= g.tau.high]:
                    inside["sigma together"].append(g.sigma.low <= math.hypot(*those) <= g.sigma.high)
        seconds = (time.process_time() - began) / len(seeds)
        among = f"{lengths[0]:.0f} to {lengths[1]:.0f} samples {' '.join(kinds)}"
        others = ", ".join(str(i) for i, agrees in zip(seeds, agreed, strict=True) if not agrees) or "none"
        print(f"{name}, {among}: agree {sum(agreed)} of {len(agreed)}, all but {others}; {seconds:.2f} s")
        print("   inside:", ", ".join(f"{k} {np.mean(v):.3f} ({sum(v)} of {len(v)})" for k, v in inside.items()))
        print("   missed:", ", ".join(missed) or "none")
        stating = max(sum(agreed), 1)
        print(
            "   stated:", ", ".join(f"{k} {np.sum(v) / stating:.3f} ({sum(v)})" for k, v in stated.items()), flush=True
        )


def numbers(text: str) -> tuple[float, float]:
    """Return both ends of A..B, or one number twice."""
    first, _, last = text.partition("..")
    return float(first), float(last or first)


if __name__ == "__main__":
    first, last = numbers(sys.argv[1])
    seeds = range(int(first), int(last) + 1) if ".." in sys.argv[1] else range(int(first))
    words = (*KINDS, MIXED)
    main(
        seeds,
        numbers(sys.argv[2]),
        [k for k in sys.argv[3:] if k in words],
        " ".join(k for k in sys.argv[3:] if k not in words),
    )
