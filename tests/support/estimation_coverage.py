"""Monte Carlo of the tumble's intervals: do 95 % intervals cover, the noise model being estimated from the same data?

python tests/support/estimation_coverage.py [runs]      prints coverage per coefficient and u against scatter
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator

import numpy as np

from gyrobench import drift, frames
from gyrobench.reduction.estimation import noise, noise_mixture_fit

WINDOW = 119.67  # s: 5 degrees at ten times Earth rate


def plan(turn: int, dwell: int, order: tuple[int, ...] = (3, 1, 4, 2), pause: float = 60.0, encoder: float = 0.0):
    """(t0, t1, X) of a tumble at 45.75 deg with ``turn`` windows a turn and ``dwell`` windows in each dwell.

    encoder: rad, the table stands this times the sine of its angle further.
    """
    latitude = math.radians(45.75)
    base, faces = frames.polar_base(latitude), frames.tumble_faces(latitude)
    t0, rows, t = [], [], 0.0
    for phase in order:
        t += pause
        face = faces[f"mount {phase}" if phase < 3 else f"static {phase}"]
        for k in range(turn if phase < 3 else dwell):
            angle = -(k + 0.5) * 2 * math.pi / turn if phase < 3 else 0.0
            angle += encoder * math.sin(angle)
            rows.append(drift.regressors(frames.to_face(-frames.U, face, base, angle), drift.terms(9)))
            t0.append(t)
            t += WINDOW
    start = np.array(t0)
    return start, start + WINDOW, np.array(rows)


def samples(t0, t1, tau: float, share: float, runs: int, seed: int) -> Iterator[np.ndarray]:
    """Noise of unit variance: correlation time ``tau`` windows (0: white), ``share`` of the variance correlated."""
    covariance = np.eye(t0.size) * (1.0 - share)
    if share:
        unit = noise.process_covariance(t0, t1, tau * WINDOW)
        covariance = covariance + share * unit / unit[0, 0]
    root = np.linalg.cholesky(covariance)
    rng = np.random.default_rng(seed)
    for _ in range(runs):
        yield root @ rng.standard_normal(t0.size)


def coverage(turn: int, dwell: int, tau: float, share: float, runs: int, seed: int = 1, **how) -> np.ndarray:
    """Fraction of the 95 % intervals that hold the truth, per coefficient of drift.terms(9)."""
    t0, t1, X = plan(turn, dwell, **how)
    names, truth = drift.terms(9), np.linspace(-1.0, 1.0, 9)
    hits, scatter, claimed = np.zeros(9), np.zeros(9), np.zeros(9)
    for e in samples(t0, t1, tau, share, runs, seed):
        found = noise_mixture_fit.fit(X, X @ truth + e, names, t0, t1)
        hits += np.abs(found.beta - truth) <= found.half_width
        scatter += (found.beta - truth) ** 2
        claimed += found.u**2
    coverage.ratio = np.sqrt(claimed / scatter)  # type: ignore[attr-defined]
    return hits / runs


CASES = [(0.0, 0.0), (0.5, 1.0), (1.0, 1.0), (3.0, 1.0), (8.0, 1.0), (10.0, 1.0), (3.0, 0.5), (8.0, 0.7), (8.0, 0.3)]

if __name__ == "__main__":
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    print("windows  tau/window  share " + " ".join(f"{n[2:]:>5}" for n in drift.terms(9)) + "   u/scatter")
    for turn, dwell in ((36, 5), (72, 10)):
        for tau, share in CASES:
            c = coverage(turn, dwell, tau, share, runs)
            ratio = coverage.ratio  # type: ignore[attr-defined]
            row = " ".join(f"{v:.3f}" for v in c)
            print(
                f"{turn}+{dwell:<4}  {tau:8.1f}  {share:6.1f}  {row}   {ratio.min():.2f}..{ratio.max():.2f}", flush=True
            )
