"""Consistency of what several tests say of one quantity: normalized errors, weighted mean, consistency test.

    a, b: values with standard uncertainties of type A (t, dof degrees of freedom) and type B
    E_n = |a - b| / sqrt(U_a^2 + U_b^2)         U: expanded uncertainties, 95 %      agree when E_n <= 1
    mean = sum w x, w of least squares under the whole covariance;  Q = (x - mean)' C^-1 (x - mean)
    Birge ratio = sqrt(Q / (M - 1));  p: of Q against chi^2 with M - 1 degrees of freedom where u are known well, else
    of Welch's F, which knows that they are estimated.

An error that two tests share (the scale factor of the one torquer, the latitude of the one site) is not counted as
independent: it stands in C off the diagonal, and what is the same in both drops out of U of the difference.
Sources: E_n, ISO 13528; Birge, Phys. Rev. 40 (1932) 207; Welch, Biometrika 38 (1951) 330; Meier, Biometrics 9 (1953)
59 (weights that are estimated).

Not modelled: tests that share a part of their random error, as two reductions of the same record do.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations as pairs_of

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.uncertainty import NORMAL

LEVEL = 0.05  # of the consistency test


@dataclass(frozen=True)
class MethodValue:
    """Value of a quantity by one test, in its printed unit.

    u_a: standard uncertainty of type A with ``dof`` degrees of freedom.  u_b: of type B, of this test alone.  shared:
    source -> standard uncertainties, with sign, of the errors (m,) that other tests have too.
    """

    label: str
    estimate: float
    u_a: float
    u_b: float = 0.0
    dof: float = math.inf
    shared: Mapping[str, Array] = field(default_factory=dict)
    truth: float | None = None
    reported: str = ""  # the test's own name of it; "" where it is put together from several of its estimates

    @property
    def own(self) -> float:
        """Variance of what this test shares with no other."""
        return self.u_a**2 + self.u_b**2

    @property
    def u_shared(self) -> float:
        return math.sqrt(sum(float(s @ s) for s in self.shared.values()))

    @property
    def u(self) -> float:
        return math.sqrt(self.own + self.u_shared**2)

    @property
    def k_a(self) -> float:
        return float(special.stdtrit(self.dof, 0.975)) if math.isfinite(self.dof) else NORMAL

    @property
    def U(self) -> float:
        """Expanded, 95 %: t of type A, 1.96 of type B, as squares."""
        return math.sqrt((self.k_a * self.u_a) ** 2 + NORMAL**2 * (self.u**2 - self.u_a**2))


@dataclass(frozen=True)
class Pair:
    a: str
    b: str
    difference: float  # a - b
    U: float  # of the difference
    E_n: float


@dataclass(frozen=True)
class Agreement:
    """Weighted mean of two tests or more, and their consistency.

    weights: in the order of the values; they may be negative where tests share an error of different size.  p: of the
    consistency test.
    """

    mean: float
    u: float
    U: float
    u_a: float
    dof: float
    weights: Array
    Q: float
    birge: float
    p: float
    pairs: tuple[Pair, ...]


def normalized_error(a: MethodValue, b: MethodValue) -> Pair:
    """Return E_n of two values; a source that both share counts with the difference of what it does to them."""
    square = (a.k_a * a.u_a) ** 2 + (b.k_a * b.u_a) ** 2 + NORMAL**2 * (a.u_b**2 + b.u_b**2)
    for source in {**a.shared, **b.shared}:
        one, other = a.shared.get(source), b.shared.get(source)
        if one is not None and other is not None and one.shape == other.shape:
            square += NORMAL**2 * float(np.sum((one - other) ** 2))
        else:
            square += NORMAL**2 * sum(float(s @ s) for s in (one, other) if s is not None)
    difference, U = a.estimate - b.estimate, math.sqrt(square)
    return Pair(a.label, b.label, difference, U, abs(difference) / U if U > 0.0 else math.inf)


def covariance(values: Sequence[MethodValue]) -> Array:
    """Return the covariance (M, M) of the values, shared errors off the diagonal."""
    C = np.diag([v.own for v in values])
    for source in dict.fromkeys(s for v in values for s in v.shared):
        size = max(v.shared[source].size for v in values if source in v.shared)
        rows = np.array([np.resize(v.shared[source], size) if source in v.shared else np.zeros(size) for v in values])
        C += rows @ rows.T
    return np.asarray(C, dtype=float)


def combine_values(values: Sequence[MethodValue]) -> Agreement:
    """Return weighted mean and consistency of values.  Raises ValueError for fewer than two and one without own u."""
    if len(values) < 2:
        raise ValueError(f"{len(values)} value: at least two are needed to compare")
    without_u = [v.label for v in values if not v.own > 0.0]
    if without_u:
        raise ValueError(f"{', '.join(without_u)}: no uncertainty of its own, nothing to weigh with")
    x, C = np.array([v.estimate for v in values]), covariance(values)
    inverse = np.linalg.inv(C)
    total = float(np.sum(inverse))
    w = inverse.sum(axis=1) / total
    mean = float(w @ x)
    deviation = x - mean
    Q, m = float(deviation @ inverse @ deviation), len(values)
    u_a2 = np.array([v.u_a**2 for v in values])
    nu = np.array([v.dof * (v.u**2 / v.u_a**2) ** 2 if v.u_a > 0.0 else math.inf for v in values])  # of the whole u
    few = np.where(np.isfinite(nu), 1.0 / nu, 0.0)
    meier = 1.0 + 4.0 * float(np.sum(few * np.clip(w * (1.0 - w), 0.0, None)))  # the weights are estimated too
    of_a = float(np.sum(w * w * u_a2)) * meier
    square = meier / total
    u_a = math.sqrt(of_a)
    terms = np.array([(a * wi * wi) ** 2 / v.dof for a, wi, v in zip(u_a2, w, values, strict=True)])
    dof = float(np.sum(w * w * u_a2)) ** 2 / float(np.sum(terms)) if np.sum(terms) > 0.0 else math.inf
    k = float(special.stdtrit(dof, 0.975)) if math.isfinite(dof) else NORMAL
    U = math.sqrt((k * u_a) ** 2 + NORMAL**2 * max(square - of_a, 0.0))
    return Agreement(
        mean, math.sqrt(square), U, u_a, dof, w, Q, math.sqrt(Q / (m - 1)), probability(Q, m, few, w),
        tuple(normalized_error(a, b) for a, b in pairs_of(values, 2)),
    )  # fmt: skip


def probability(Q: float, m: int, few: Array, w: Array) -> float:
    """Return p of Q from m values; few: 1/degrees of freedom of each.  Without any it is chi^2, for two Welch's t."""
    spread = float(np.sum(few * (1.0 - w) ** 2))
    if spread == 0.0:
        return float(special.chdtrc(m - 1, Q))
    F = Q / (m - 1) / (1.0 + 2.0 * (m - 2) * spread / (m * m - 1))
    return float(special.fdtrc(m - 1, (m * m - 1) / (3.0 * spread), F))


def outlier(values: Sequence[MethodValue]) -> tuple[str, float] | None:
    """Return the one test without which the others agree, and their p then.

    None for fewer than three, or where there is none or more than one.
    """
    if len(values) < 3:
        return None
    p_without = [(v.label, combine_values([o for o in values if o is not v]).p) for v in values]
    cured = [(label, p) for label, p in p_without if p >= LEVEL]
    return cured[0] if len(cured) == 1 else None
