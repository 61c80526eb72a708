"""Scale factors of the currents of a run from all its windows, under an estimated noise model.

    theta' = sign K_n i_n + o_n + sum_j p_j P_j(theta) + noise

Both senses of a current share its drift o_n (an even torquer term goes there too, as into the printed half difference);
what the drift changes with the angle, the same for all currents, is a polynomial of degree 4 in the table angle,
averaged over each window as the rate is.  The noise - random drift and errors of the angle readings, which neighbours
share - is estimated from the same windows.  K_n from the times between marks (marks.py) stand beside.

Not modelled: change of the drift between the two senses of a current other than as noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import special

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.reduction.estimation.effects import with_set_up
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.mixture import equivalent_dof
from gyrobench.reduction.estimation.noise_estimate import NoiseEstimate
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.setup.sources import Effect

from .budget import TorquerSetup, effects

DEGREE = 4


@dataclass(frozen=True)
class Precession:
    """K (n,) of the n currents and their drifts o (n,), SI, with the fit they come from and its sources of type B."""

    K: Array
    drift: Array
    est: NoiseEstimate
    fit: Findings | None = None
    effects: Sequence[Effect] = ()

    def weights(self, columns: Array, of: Array | slice) -> Array:
        """Return (q, n) W of generalized least squares W values = c of ``values = columns c``, under their
        covariance.
        """
        C = self.est.covariance[of, of]
        size = np.sqrt(np.diag(C))
        A, B = columns / size[:, None], C / np.outer(size, size)
        gain = np.linalg.solve(A.T @ np.linalg.solve(B, A), np.linalg.solve(B, A).T)
        return np.asarray(gain / size)

    def u(self, of_K: Array | None = None, of_drift: Array | None = None) -> tuple[float, float]:
        """Return the standard uncertainty and degrees of freedom of a combination of the K and the drifts."""
        n, J = self.K.size, np.zeros(self.est.beta.size)
        J[:n], J[n : 2 * n] = 0.0 if of_K is None else of_K, 0.0 if of_drift is None else of_drift
        sd, half = (float(v[0]) for v in self.est.mixture.spread(J[None, :]))
        u = min(sd, half / NORMAL)
        return u, float(equivalent_dof(np.array([half / u if u > 0.0 else NORMAL]))[0])


def precession(
    windows: Mapping[str, Array], phases: Mapping[int, int], currents: Array, setup: TorquerSetup | None = None
) -> Precession:
    """Return the fit of the windows.  phases: number of a phase -> number of its current in ``currents`` (A).  setup:
    with errors of the set-up and their corrections.  Raises ReductionError.
    """
    setup = setup or TorquerSetup()
    phase = np.asarray(windows["phase"]).astype(int)
    mine = np.isin(phase, list(phases))
    t0, t1, a0, a1, i = (
        np.asarray(windows[c], dtype=float)[mine] for c in ("t_start", "t_end", "angle_start", "angle_end", "mean")
    )
    which = np.array([phases[p] for p in phase[mine].tolist()])
    n = currents.size
    own = (which[:, None] == np.arange(n)).astype(float)
    low, high = float(min(a0.min(), a1.min())), float(max(a0.max(), a1.max()))
    start, end = (2.0 * (a - low) / (high - low) - 1.0 for a in (a0, a1))
    shape = np.column_stack([_mean_legendre(j, start, end) for j in range(1, DEGREE + 1)])
    X = np.column_stack([own * i[:, None], own, shape])
    names = [f"K at {c * 1e3:g} mA" for c in currents] + [f"drift at {c * 1e3:g} mA" for c in currents]
    names += [f"P{j}" for j in range(1, DEGREE + 1)]
    found = fit(names, X, (a1 - a0) / (t1 - t0), t0, t1, [], "rate", "°/h", units.factor("deg/h"), noise="readings")

    def sources(f: Findings) -> Sequence[Effect]:
        return effects(f, n, a0, a1, setup)

    found = with_set_up(found, sources, setup.corrections)
    return Precession(found.est.beta[:n], found.est.beta[n : 2 * n], found.est, found, sources(found))


def _mean_legendre(j: int, start: Array, end: Array) -> Array:
    """Return the mean of P_j between two arguments: its integral is (P_(j+1) - P_(j-1)) / (2 j + 1)."""

    def integral(x: Array) -> Any:
        return (special.eval_legendre(j + 1, x) - special.eval_legendre(j - 1, x)) / (2.0 * j + 1.0)

    return np.asarray((integral(end) - integral(start)) / (end - start))
