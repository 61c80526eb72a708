"""Loops of one's own, for the proof of identification: plant, controller and truth by scipy alone.

A platform: torque in, rate out, inertia with viscous friction and a bending mode, some samples late; a PI controller of
rate.  Nothing of gyrobench is used.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from scipy import signal

H = 1e-3  # s
PLACES = ("plant input", "reference", "plant output")
UNITS = {"excitation": "N.m", "input": "N.m", "output": "rad/s"}
PERIOD = 4000  # samples


@dataclass(frozen=True)
class SampledLoop:
    """P = b/a and C = m/n, polynomials in 1/z."""

    b: np.ndarray
    a: np.ndarray
    m: np.ndarray
    n: np.ndarray
    truth: Mapping[str, float] = field(default_factory=dict)  # J, viscous ..., of the platform

    @property
    def closed(self) -> np.ndarray:
        first, second = np.convolve(self.a, self.n), np.convolve(self.b, self.m)
        size = max(first.size, second.size)
        return np.pad(first, (0, size - first.size)) + np.pad(second, (0, size - second.size))

    def stable(self) -> bool:
        return bool(np.all(np.abs(np.roots(self.closed)) < 0.999))

    def responses(self, f: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return L and P at f, Hz."""
        z = np.exp(-2j * np.pi * np.asarray(f) * H)
        b, a, m, n = (np.polynomial.polynomial.polyval(z, p) for p in (self.b, self.a, self.m, self.n))
        return b * m / (a * n), b / a

    def run(self, r: np.ndarray, at: str, torque: np.ndarray, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return u and y under excitation, a torque that disturbs, and noise of the sensor."""
        den, bn, bm, an = (self.closed, np.convolve(self.b, self.n), np.convolve(self.b, self.m),
                           np.convolve(self.a, self.n))  # fmt: skip
        y = signal.lfilter(bn, den, torque) + signal.lfilter(an, den, noise)
        num = {"plant input": bn, "reference": bm, "plant output": -bm}[at]
        y = y + signal.lfilter(num, den, r)
        e = {"plant input": -y, "reference": r - y, "plant output": -(y + r)}[at]
        u = signal.lfilter(self.m, self.n, e)
        return (u + r if at == "plant input" else u), y


def random_platform(rng: np.random.Generator) -> SampledLoop:
    """Return a loop of 5 to 20 Hz with a mode at 3 to 6 times that, damped by 2 to 8 %."""
    J, fc, late = 10.0 ** rng.uniform(-1.5, 0.5), rng.uniform(5.0, 20.0), int(rng.integers(1, 6))
    c = J * rng.uniform(0.1, 3.0)
    w0, z, share = 2.0 * np.pi * fc * rng.uniform(3.0, 6.0), rng.uniform(0.02, 0.08), rng.uniform(0.05, 0.3)
    mode = [1.0, 2.0 * z * w0, w0**2]
    num, den = np.polyadd(mode, share / J * np.polymul([1.0, 0.0], [J, c])), np.polymul([J, c], mode)
    b, a, _ = signal.cont2discrete((num, den), H, method="zoh")
    wc = 2.0 * np.pi * fc
    gain, wi = J * wc * rng.uniform(0.7, 1.0), wc / rng.uniform(4.0, 10.0)
    m, n, _ = signal.cont2discrete(([gain, gain * wi], [1.0, 0.0]), H, method="bilinear")
    truth = {
        "J": J,
        "viscous": c,
        "delay": late * H,
        "mode_f": w0 / (2.0 * np.pi),
        "mode_damping": z,
        "mode_share": share,
    }
    return SampledLoop(np.concatenate([np.zeros(late), b.ravel()]), a, m.ravel(), n, truth)


def odd_multisine(samples: int, rng: np.random.Generator, low: float, high: float, group: int = 4) -> np.ndarray:
    """Return a period of random phases: odd harmonics between two frequencies, one of each group left out; rms 1.

    group: 0: none is left out.
    """
    odd = np.arange(1, samples // 2, 2)
    odd = odd[(odd / (samples * H) >= low) & (odd / (samples * H) <= high)]
    spectrum = np.zeros(samples // 2 + 1, complex)
    spectrum[odd if group == 0 else odd[:0]] = 1.0
    for k in range(0, odd.size - group + 1, group) if group else ():
        spectrum[np.delete(odd[k : k + group], rng.integers(group))] = 1.0
    spectrum *= np.exp(2j * np.pi * rng.random(spectrum.size))
    r = np.fft.irfft(spectrum, samples)
    return np.asarray(r / r.std())


class HasResponses(Protocol):
    def responses(self, f: np.ndarray) -> tuple[np.ndarray, np.ndarray | None]: ...


def margins_of(loop: HasResponses, low: float, high: float) -> Mapping[str, float]:
    """Return margins between two frequencies, Hz, on a grid of 40000: SI, gains as factors."""
    f = np.geomspace(low, high, 40000)
    L = loop.responses(f)[0]
    g, p = np.log(np.abs(L)), np.angle(-L)
    found: dict[str, float] = {}
    crossed = [_at(f, g, k) for k in np.flatnonzero((g[1:] > 0.0) != (g[:-1] > 0.0))]
    phases = (
        list(zip(np.angle(-loop.responses(np.array(crossed))[0]).tolist(), crossed, strict=True)) if crossed else []
    )
    if phases:
        found["phase margin"], found["crossover"] = min(phases, key=lambda m: abs(m[0]))
        found["delay margin"] = min(a % (2.0 * np.pi) / (2.0 * np.pi * x) for a, x in phases)
    turned = np.flatnonzero(((p[1:] > 0.0) != (p[:-1] > 0.0)) & (np.abs(p[1:]) < 1.0) & (np.abs(p[:-1]) < 1.0))
    turns = np.array([_at(f, p, k) for k in turned])
    gains = (1.0 / np.abs(loop.responses(turns)[0])).tolist() if turns.size else []
    if up := [x for x in gains if 1.0 < x < 1e3]:
        found["gain margin"] = float(min(up))
    if down := [x for x in gains if x < 1.0]:
        found["gain-reduction margin"] = float(max(down))
    S = 1.0 / (1.0 + L)
    found["disk margin"] = 1.0 / float(np.abs(S - 0.5).max())
    found["peak S"], found["peak T"] = float(np.abs(S).max()), float(np.abs(1.0 - S).max())
    return found


def _at(f: np.ndarray, value: np.ndarray, k: int) -> float:
    share = value[k] / (value[k] - value[k + 1])
    return float(f[k] * (f[k + 1] / f[k]) ** share)
