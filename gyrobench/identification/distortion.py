"""Nonlinearity of a loop from the harmonics that a periodic excitation leaves out.

An odd multisine excites odd harmonics alone, and not all of them.  What a linear loop shows at the others is noise;
what is more at even ones comes from even nonlinearities (u2, backlash with an offset), at odd ones from odd ones
(friction, saturation).  Odd ones also fall on the excited harmonics, where no averaging over periods takes them away:
there the response is the best linear approximation for this excitation, and their level, read beside it, is part of
its uncertainty.  Source: Pintelon 2012, 4.3 (best linear approximation, robust and fast method by detection lines).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import fdtrc

from gyrobench.arrays import Array
from gyrobench.identification.line_spectrum import LineAmplitudes

LEAST = 4  # lines left out, for a statement
NEIGHBOURS = 8  # lines left out whose mean is the level at an excited one
COURSE = 12  # lines left out, for a level that changes over frequency
SIGNIFICANT = 1e-3
SIGNALS = ("input", "output")


@dataclass(frozen=True)
class Distortion:
    """Content of the harmonics of one kind ("odd", "even") that are left out, beside noise.

    level: rms over that at the excited lines, of the signal where it is larger; floor: the same of the noise.  p: that
    noise alone gives so much.  f, size: each line's amplitude of the output, its own noise in it.
    """

    kind: str
    count: int
    level: float
    floor: float
    p: float
    signal: str
    f: Array
    size: Array

    @property
    def significant(self) -> bool:
        return self.p < SIGNIFICANT and self.level > 0.0


def harmonics(lines: LineAmplitudes, period: float) -> np.ndarray[tuple[int, ...], np.dtype[np.intp]]:
    """Return the numbers of the harmonics."""
    return np.round(lines.f * period).astype(int)


def is_odd(excited: LineAmplitudes, period: float) -> bool:
    """Return whether odd harmonics alone are excited."""
    return bool(np.all(harmonics(excited, period) % 2 == 1))


def distortions(excited: LineAmplitudes, omitted: LineAmplitudes, period: float) -> list[Distortion]:
    """Return what odd and even harmonics show that are left out; nothing of a kind with too few lines."""
    if not is_odd(excited, period):
        return []
    number = harmonics(omitted, period)
    kinds = (("odd", omitted.take(number % 2 == 1)), ("even", omitted.take(number % 2 == 0)))
    return [_of(kind, lines, excited) for kind, lines in kinds if lines.f.size >= LEAST]


def _of(kind: str, lines: LineAmplitudes, excited: LineAmplitudes) -> Distortion:
    best: tuple[float, float, float, str] | None = None
    for k, name in ((1, SIGNALS[0]), (2, SIGNALS[1])):
        power, noise = np.abs(lines.z[:, k]) ** 2, lines.cov[:, k, k].real
        mean = lines.dof / np.maximum(lines.dof - 1.0, 1.0)  # of F with 2 and 2 dof degrees of freedom
        test = float(np.mean(power / np.maximum(noise, 1e-300) / mean))
        p = min(1.0, 2.0 * float(fdtrc(2.0 * lines.f.size, 2.0 * float(lines.dof.sum()), test)))
        whole = float(np.mean(np.abs(excited.z[:, k]) ** 2))
        found = (
            p,
            math.sqrt(max(float(np.mean(power - noise)), 0.0) / whole),
            math.sqrt(float(noise.mean()) / whole),
            name,
        )
        if best is None or (found[0], -found[1]) < (best[0], -best[1]):
            best = found
    assert best is not None
    p, level, floor, name = best
    return Distortion(kind, lines.f.size, level, floor, p, name, lines.f, np.abs(lines.z[:, 2]))


def with_distortion(excited: LineAmplitudes, omitted: LineAmplitudes, period: float) -> LineAmplitudes:
    """Return the excited lines with the level of the odd ones left out beside them as their covariance, where it is
    above their own noise.

    Over frequency the level goes as a parabola of its logarithm, about which the lines beside one are averaged.
    """
    odd = omitted.take(harmonics(omitted, period) % 2 == 1)
    size = np.abs(odd.z)
    log = np.log(np.maximum(size, 1e-12 * size.max(axis=0) + 1e-300))
    course = np.polynomial.polynomial.polyfit(np.log(odd.f), log, 2 if odd.f.size >= COURSE else 0)
    inside = np.clip(excited.f, odd.f[1], odd.f[-2])  # beyond its last lines the parabola is not asked
    here, there = (np.exp(np.polynomial.polynomial.polyval(np.log(x), course)).T for x in (inside, odd.f))
    level = odd.z / there
    products = level[:, :, None] * np.conj(level[:, None, :])
    count = min(NEIGHBOURS, odd.f.size)
    near = np.argsort(np.abs(np.log(excited.f)[:, None] - np.log(odd.f)[None, :]), axis=1)[:, :count]
    cov = products[near].mean(axis=1) * here[:, :, None] * here[:, None, :]
    diagonal, own = (np.einsum("nkk->nk", c).real[:, 1:] for c in (cov, excited.cov))
    above = np.mean(diagonal / np.maximum(own, 1e-300), axis=1) > 1.0
    return replace(
        excited, cov=np.where(above[:, None, None], cov, excited.cov), dof=np.where(above, float(count), excited.dof)
    )
