"""Windows that do not belong to the rest: which rows, what the result is without them, and a robust fit beside.

Search: residuals of the fit as they are and under its likeliest noise model, r_i = (R^-1 v)_i / sqrt((R^-1)_ii) (a
group of neighbours looks like drift to that), each over its standard deviation by that model and all over their median
absolute deviation, which many outliers cannot raise together (no masking up to a fifth of the rows).  Rows beyond the
Bonferroni limit are left out, the model with its noise is fitted to the others, and each is tested against that fit:
externally studentized, t with the degrees of freedom of the others, LEVEL over the number of rows.  Those that pass
come back.  The fit itself is never changed: what is reported is the plain one, and beside it the one without them.

The robust fit, asked for by an option, is Tukey's bisquare (c = 4.685, 95 % efficient for normal noise) from a Huber
start (k = 1.345), on the problem whitened by the same noise model; u by Huber's sandwich.
[Cook 1982, ch. 2; Huber 1981, ch. 7]
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation import asked
from gyrobench.reduction.estimation import noise as noise_model
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Reason, Table

LEVEL = 0.01  # probability that any row of a clean record is named
MOST = 0.2  # share of the rows that may be outliers
FEWEST = 10  # degrees of freedom that must be left
EXACT = 2000  # rows up to which every (R^-1)_ii is computed
LISTED = 8
ENDLESS = 1e6  # standard deviations from which on the others have none: rounding of the arithmetic
MAD = 1.4826  # standard deviation of a normal distribution over its median absolute deviation


@dataclass(frozen=True)
class Outliers:
    """Rows (from 0), how far they lie from the fit to the others (unit of the data; in standard deviations), and that
    fit.
    """

    rows: NDArray[np.intp]
    distance: Array
    t: Array
    without: Findings


def find(found: Findings) -> Outliers | None:
    """Return the outliers of a fit; None where there are none, too few windows to tell, or nobody asks (asked)."""
    n = found.y.size
    most = int(min(MOST * n, found.dof - FEWEST))
    if found.ideal or most < 1 or not asked.whole():
        return None
    limit = -float(special.ndtri(LEVEL / 2.0 / n)) * MAD
    each = (
        np.abs(_decorrelated(found)),
        np.abs(found.est.residual - found.est.likeliest.set_up) / _spread(found, found),
    )
    size = np.max([r / max(float(np.median(r)), 1e-300) for r in each], axis=0)
    rows = np.flatnonzero(size > limit)
    if not rows.size:
        return None
    rows = np.sort(rows[np.argsort(-size[rows])][:most])
    for _ in range(5):
        rest = _fitted_without(found, rows)
        if rest is None:
            return None
        distance, t = _against(found, rest, rows)
        if rest.ideal and rows.size > 2 and np.ptp(np.abs(distance)) < 1e-6 * np.max(np.abs(distance)):
            return None  # all others alike, these a count off: too coarse to show a noise
        p = 2.0 * special.stdtr(rest.dof, -np.abs(t))
        if np.all(p < LEVEL / n):
            return Outliers(rows, distance / found.y_scale, t, rest)
        rows = rows[p < LEVEL / n]
        if not rows.size:
            return None
    return None


def _decorrelated(found: Findings) -> Array:
    """r (n,) of the residuals, up to a factor."""
    v = found.est.residual - found.est.likeliest.set_up
    if found.white:
        return v if found.weights is None else v * np.sqrt(found.weights)
    n = v.size
    model = found.est.noise.best
    one = tuple(np.array([m]) for m in model)
    z = noise_model.whiten(found.t_start, found.t_end, v[:, None], *one)[0][:, 0, :]
    inverse = noise_model.whiten_transposed(found.t_start, found.t_end, z, model)[:, 0]
    chosen = np.arange(n) if n <= EXACT else np.linspace(0, n - 1, 200).astype(int)
    unit = np.zeros((n, chosen.size))
    unit[chosen, np.arange(chosen.size)] = 1.0
    W = noise_model.whiten(found.t_start, found.t_end, unit, *one)[0][:, 0, :]
    diagonal = np.sum(W * W, axis=0)
    return np.asarray(inverse / np.sqrt(diagonal if n <= EXACT else np.median(diagonal)))


def _spread(found: Findings, fitted: Findings) -> Array:
    """Standard deviations (n,) of the rows by the noise of a fit, up to a factor: of short windows it is larger."""
    if found.white:
        return np.ones(found.y.size) if found.weights is None else 1.0 / np.sqrt(found.weights)
    return np.sqrt(noise_model.relative_variance(found.t_start, found.t_end, fitted.est.noise.best))


def _fitted_without(found: Findings, rows: NDArray[np.intp]) -> Findings | None:
    keep = np.ones(found.y.size, dtype=bool)
    keep[rows] = False
    try:
        few = replace(found.data, candidates=found.candidates).rows(keep)
        rest = few.fit(None if found.known is None else found.known[:, keep])
    except ReductionError:
        return None  # these rows carry a coefficient alone
    return found.reported_alike(rest)


def _against(found: Findings, rest: Findings, rows: NDArray[np.intp]) -> tuple[Array, Array]:
    """Distance (SI) of the rows from the fit to the others, and in standard deviations of a new window."""
    p = found.X.shape[1]
    X, C = found.X[rows], rest.est.covariance[:p, :p]
    model = X @ rest.est.beta[:p]
    names = {c.name: np.reshape(np.asarray(c.columns), (found.y.size, -1))[rows] for c in found.candidates}
    at = p
    for c, e in rest.joined:
        model = model + names[c.name] @ rest.est.beta[at : at + e.value.size]
        at += e.value.size
    distance = found.y[rows] - model
    spread, others = _spread(found, rest), np.delete(np.arange(found.y.size), rows)
    single = (rest.residual_std * rest.y_scale * spread[rows]) ** 2 / np.mean(spread[others] ** 2)
    variance = single + np.einsum("ij,jk,ik->i", X, C, X)
    return distance, distance / np.sqrt(variance)


def warnings(found: Findings, outliers: Outliers | None) -> list[Reason]:
    """Return which rows, and what changes most without them; where that leaves its interval, no verdict stands."""
    if outliers is None:
        return []
    rows, rest = outliers.rows, outliers.without
    each = [f"{plain(d, 3, '+')} {found.y_unit}".replace("-", "−") for d in outliers.distance]
    far = [f", {abs(t):.0f} standard deviations" if abs(t) < ENDLESS else "" for t in outliers.t]
    shown = zip(rows[:LISTED], each, far, strict=False)
    listed = "; ".join(f"{row + 1} ({off}{deviations})" for row, off, deviations in shown)
    more = f" and {rows.size - LISTED} more" if rows.size > LISTED else ""
    both = _common(found, rest)
    moves = {(a, b): abs(rest.value[b] - found.value[a]) / rest.u[b] for a, b in both if rest.u[b] > 0.0}
    a, b = max(moves, key=moves.__getitem__, default=both[0])  # u of a quantity that is none is 0
    q = found.quantities[a]
    (value, u), (value_of_all, u_of_all) = (
        (plain(x / q.scale, 6).replace("-", "−"), plain(u / q.scale))
        for x, u in ((rest.value[b], rest.u[b]), (found.value[a], found.u[a]))
    )
    values = f"{value}{q.unit and ' '}{q.unit} (u = {u}) in place of {value_of_all} (u = {u_of_all})"
    what, them = ("Row", "it") if rows.size == 1 else ("Rows", "them")
    verb = "lies" if rows.size == 1 else "lie"
    text = (
        f"{what} {listed}{more} {verb} outside the noise of the others. They are in the estimates; without {them} "
        f"{q.title} = {values}. Look for the cause, and leave {them} out only if it is one."
    )
    moved = abs(rest.value[b] - found.value[a]) > NORMAL * rest.u[b]
    return [Reason("outliers", text, ("pass", "fail") if moved else ())]


def _common(found: Findings, rest: Findings) -> list[tuple[int, int]]:
    there = {q.name: j for j, q in enumerate(rest.quantities)}
    return [(j, there[q.name]) for j, q in enumerate(found.quantities) if q.name in there]


def tables(found: Findings, outliers: Outliers | None) -> list[Table]:
    """Return the estimates with and without the outliers."""
    if outliers is None:
        return []
    rest, rows = outliers.without, []
    for a, b in _common(found, rest):
        q = found.quantities[a]
        pair = (found.value[a], found.u[a], rest.value[b], rest.u[b])
        rows.append([q.title, *(float(v) / q.scale for v in pair), q.unit])
    which = ", ".join(str(r + 1) for r in outliers.rows)
    caption = f"Rows left out: {which}. The result is that of all rows."
    head = ["coefficient", "all rows", "u", "without", "u without", "unit"]
    return [Table("outliers", "Estimates without outliers", caption, head, rows)]


# ------------------------------------------------------------------------------------------- robust fit
def robust(found: Findings) -> list[Table]:
    """Return the table of the robust fit beside the plain one; nothing for data without noise."""
    if found.ideal:
        return []
    beta, covariance, light = bisquare(found)
    p = found.X.shape[1]
    if found.function is None:
        value, u = beta, np.sqrt(np.diag(covariance))
    else:
        value, J = found.linearized(found.function, beta[:p])
        u = np.sqrt(np.einsum("qi,ij,qj->q", J, covariance[:p, :p], J))
    rows = []
    for q, a, ua, b, ub in zip(found.quantities, found.value, found.u, value, u, strict=False):
        rows.append(
            [q.title, a / q.scale, ua / q.scale, float(b) / q.scale, float(ub) / q.scale, float((b - a) / ua), q.unit]
        )
    caption = (
        "Bisquare weights on the residuals of the likeliest noise model; the result is the plain fit. "
        f"Weight below a half: {light} of {found.y.size} windows."
    )
    head = ["coefficient", "least squares", "u", "robust", "u robust", "difference / u", "unit"]
    return [Table("robust_fit", "Robust fit", caption, head, rows)]


def bisquare(found: Findings) -> tuple[Array, Array, int]:
    """Coefficients of the whitened problem, their covariance, and the number of weights below a half."""
    X = found.est.X
    columns = np.column_stack([X, found.y - found.est.likeliest.set_up])
    if found.white:
        Z = columns if found.weights is None else columns * np.sqrt(found.weights)[:, None]
    else:
        one = tuple(np.array([m]) for m in found.est.noise.best)
        Z = noise_model.whiten(found.t_start, found.t_end, columns, *one)[0][:, 0, :]
    A, z = Z[:, :-1], Z[:, -1]
    n, p = A.shape
    beta = np.linalg.lstsq(A, z, rcond=None)[0]
    for k, weigh in ((1.345, _huber), (4.685, _bisquare)):
        for _ in range(100):
            r = z - A @ beta
            s = MAD * float(np.median(np.abs(r))) * math.sqrt(n / (n - p))
            w = weigh(r / (k * s))
            root = np.sqrt(w)
            new = np.linalg.lstsq(A * root[:, None], z * root, rcond=None)[0]
            done = bool(np.linalg.norm(A @ (new - beta)) <= 1e-10 * np.linalg.norm(z))
            beta = new
            if done:
                break
    x = (z - A @ beta) / (4.685 * s)
    inside = np.abs(x) < 1.0
    psi = np.where(inside, x * (1.0 - x * x) ** 2, 0.0) * 4.685 * s
    slope = float(np.mean(np.where(inside, (1.0 - x * x) * (1.0 - 5.0 * x * x), 0.0)))
    covariance = float(np.sum(psi**2)) / (n - p) / slope**2 * np.linalg.pinv(A.T @ A)
    return beta, covariance, int(np.sum(w < 0.5))


def _huber(x: Array) -> Array:
    return np.asarray(1.0 / np.maximum(np.abs(x), 1.0))


def _bisquare(x: Array) -> Array:
    return np.asarray(np.where(np.abs(x) < 1.0, (1.0 - x * x) ** 2, 0.0))
