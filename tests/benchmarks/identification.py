"""Identified loops against loops of one's own (scipy): how often intervals hold the truth, how far margins are off.

    python tests/benchmarks/identification.py --runs 100                 # random platforms, multisine
    python tests/benchmarks/identification.py --runs 100 --excitation chirp      # or random
    python tests/benchmarks/identification.py --runs 40 --friction       # the truth is the best linear approximation

A line for each response and each margin: how many of the intervals held the truth, the rms error (degrees, dB, relative
else), the median of U and the largest error over its own U.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter, defaultdict
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy import signal

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from friction_loops import MeasuredLoop, random_friction
from own_loops import PLACES, H, margins_of, odd_multisine, random_platform

from gyrobench.errors import GyrobenchError
from gyrobench.identification.identify_loop import identify_record
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.identification.plant_fit import fit_plant
from gyrobench.identification.written_identification import Identification

BAND = (1.0, 150.0)  # Hz
PERIOD = 4000  # samples
UNITS = {"excitation": "N.m", "input": "N.m", "output": "rad/s"}


class Count:
    """Intervals that held the truth, errors, U."""

    def __init__(self) -> None:
        self.held: Counter[str] = Counter()
        self.all: Counter[str] = Counter()
        self.errors: dict[str, list[float]] = defaultdict(list)
        self.U: dict[str, list[float]] = defaultdict(list)
        self.seed = 0
        self.worst: dict[str, tuple[float, int]] = {}  # largest error over U, its seed
        self.seconds: list[float] = []
        self.notes: Counter[str] = Counter()

    def responses(self, found, truth) -> None:
        for name, value in truth.items():
            g = found.responses[name]
            good = g.determined & (g.u < 0.5)
            low, high = g.gain()
            below, above = g.phase()
            turn = np.angle(value / np.where(g.value, g.value, 1.0))
            self.held[f"{name}, gain"] += int(np.sum(((low <= np.abs(value)) & (np.abs(value) <= high))[good]))
            self.held[f"{name}, phase"] += int(np.sum(((below <= turn) & (turn <= above))[good]))
            for part in ("gain", "phase"):
                self.all[f"{name}, {part}"] += int(good.sum())

    def parameters(self, record, found, truth) -> None:
        self.all["plant fitted"] += 1
        try:
            fit = fit_plant(record, found.responses["P"], ["J", "viscous", "delay", "mode", "held"])
        except GyrobenchError:
            return
        self.held["plant fitted"] += 1
        self.all["model describes the plant"] += 1
        self.held["model describes the plant"] += not fit.lacks
        if fit.lacks:  # said, and nothing of it is used
            return
        for name, value in truth.items():
            low, high = fit.interval(name)
            self.all[name] += 1
            self.held[name] += low <= value <= high
            self.errors[name].append(fit.values[name] / value - 1.0)
            self.U[name].append(0.5 * (high - low) / abs(value))

    def margins(self, found, truth) -> None:
        self.seconds.append(found.seconds)
        self.notes.update(n.partition(":")[0] for n in found.notes)
        for m in found.margins:
            if m.name not in truth:
                self.all[f"{m.name} (no such truth)"] += 1
                continue
            self.all[m.name] += 1
            self.held[m.name] += truth[m.name] in m
            scale = {"rad": np.degrees(1.0), "factor": 20.0 / np.log(10.0) / m.value}.get(m.unit, 1.0 / m.value)
            self.errors[m.name].append(scale * (m.value - truth[m.name]))
            self.U[m.name].append(scale * 0.5 * (m.high - m.low))
            self.worst[m.name] = max(
                self.worst.get(m.name, (0.0, 0)), (abs(self.errors[m.name][-1]) / self.U[m.name][-1], self.seed)
            )

    def show(self) -> None:
        for name, count in self.all.items():
            line = f"{name:34s} {self.held[name] / count:.3f} of {count}"
            if name in self.errors:
                errors, U = np.array(self.errors[name]), np.array(self.U[name])
                line += f"   rms {np.sqrt(np.mean(errors**2)):.3g}  U {np.median(U):.3g}"
                line += f"  largest error / U {np.max(np.abs(errors) / U):.1f}"
            line += f" (seed {self.worst[name][1]})" if name in self.worst else ""
            print(line)
        print(f"seconds each: mean {np.mean(self.seconds):.2f}, largest {np.max(self.seconds):.2f}")
        print(dict(self.notes))


def excitation(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Return 60 s of excitation of rms 1, of multisines a whole number of periods."""
    if kind == "multisine":
        return np.tile(odd_multisine(PERIOD, rng, *BAND), 15)
    if kind == "chirp":
        return signal.chirp(np.arange(60000) * H, BAND[0] / 2.0, 60.0, BAND[1], method="logarithmic")
    return signal.lfilter(*signal.butter(2, 0.3), rng.standard_normal(60000)) * 1.8


def timed(record: LoopRecord) -> Identification:
    """Return what is identified in the band, with its seconds."""
    begin = time.perf_counter()
    found = identify_record(record, BAND)
    return replace(found, seconds=time.perf_counter() - begin)


def linear(runs: int, kind: str, noise: float, first: int) -> Count:
    """Count random platforms; noise: rms of the sensor's and of the disturbance, over that of the response."""
    counted = Count()
    for seed in range(first, first + runs):
        rng, counted.seed = np.random.default_rng(seed), seed
        loop, at = random_platform(rng), PLACES[seed % 3]
        if not loop.stable() or margins_of(loop, *BAND)["peak S"] > 4.0:
            continue
        r = excitation(kind, rng)
        none = np.zeros(r.size)
        u, y = loop.run(r, at, none, none)
        torque = signal.lfilter([1.0], [1.0, -0.98], rng.standard_normal(r.size))
        torque *= noise * u.std() / torque.std()
        sensor = noise * y.std() * (rng.standard_normal(r.size) + 0.002 * np.cumsum(rng.standard_normal(r.size)))
        record = LoopRecord("random platform", H, r, *loop.run(r, at, torque, sensor), at, UNITS)
        found = timed(record)
        L, P = loop.responses(found.f)
        counted.responses(found, {"L": L, "S": 1.0 / (1.0 + L), "T": L / (1.0 + L), "P": P})
        counted.margins(found, margins_of(loop, found.f[0], found.f[-1]))
        if kind == "multisine":
            counted.parameters(record, found, loop.truth)
    return counted


def friction(runs: int, noise: float, first: int, periods: int = 6, realizations: int = 60) -> Count:
    """Count platforms with friction: the truth is the mean of many multisines without noise."""
    rng = np.random.default_rng(first)
    counted, samples = Count(), PERIOD // 2
    platforms = random_friction(runs, rng)
    lines, means = [], []
    for _ in range(realizations):
        r = np.tile(odd_multisine(samples, rng, *BAND, group=0), 2)  # every odd line
        u, _ = platforms.run(np.repeat(r[:, None], runs, 1), *(np.zeros((r.size, runs)) for _ in range(2)))
        lines.append(np.fft.rfft(r[samples:]))
        means.append(np.fft.rfft(u[samples:], axis=0))
    x = np.stack(lines)
    S = np.einsum("mk,mkn->kn", np.conj(x), np.stack(means)) / np.maximum(np.sum(np.abs(x) ** 2, 0), 1e-9)[:, None]
    excited = np.flatnonzero(np.abs(x[0]) > 1e-6 * np.abs(x[0]).max())
    r = np.stack([np.tile(odd_multisine(samples, rng, *BAND), periods + 1) for _ in range(runs)], 1)
    u, y = platforms.run(r, np.zeros_like(r), np.zeros_like(r))
    torque, sensor = (rng.standard_normal(r.shape) * noise * s for s in (np.ones(runs), y.std(axis=0)))
    u, y = platforms.run(r, torque, sensor)
    for k in range(runs):
        counted.seed = k
        found = timed(LoopRecord("friction", H, r[:, k], u[:, k], y[:, k], "plant input", UNITS))
        s = S[np.round(found.f * samples * H).astype(int), k]
        counted.responses(found, {"L": 1.0 / s - 1.0, "S": s, "T": 1.0 - s})
        counted.all["odd distortion seen"] += 1
        counted.held["odd distortion seen"] += any(d.kind == "odd" and d.significant for d in found.distortions)
        truth = MeasuredLoop(excited / (samples * H), S[excited, k])
        counted.margins(found, margins_of(truth, found.f[0], found.f[-1]))
    return counted


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--noise", type=float, default=0.1)
    parser.add_argument("--excitation", default="multisine", choices=("multisine", "chirp", "random"))
    parser.add_argument("--friction", action="store_true")
    asked = parser.parse_args()
    if asked.friction:
        friction(asked.runs, asked.noise, asked.first).show()
    else:
        linear(asked.runs, asked.excitation, asked.noise, asked.first).show()
