"""What contradicts a table of currents and rates: rows and columns that no torquer makes.

The scatter of the K_n is their only noise, and few rows cannot judge their own noise; a mistaken row then goes into u,
or, with a current far from the others, determines the cubic term alone.  So each row is held against the others, and
what comes out against what a torquer can be.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy import special

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import p_text
from gyrobench.units import DPH

LEVEL = 1e-3  # probability that a clean table is contradicted by chance, of each kind
LARGEST = 0.2  # departure of a K_n from the others, of a torquer
MA = 1e-3  # A
ASYMMETRY = 0.05  # (k+ - k-)/(k+ + k-), of a torquer


def problems(rows: Mapping[str, Array]) -> list[str]:
    """Return what is wrong with the rows current (A), rate_plus, rate_minus (rad/s), range_plus, range_minus (rad,
    optional).
    """
    need = ("current", "rate_plus", "rate_minus")
    missing = [n for n in need if n not in rows]
    if missing:
        text = f"column {', '.join(missing)} is missing; each current needs current, rate_plus and rate_minus"
        if {"rate_plus", "rate_minus"} & set(missing):
            text += ": one sense alone cannot tell scale factor from drift"
        return [text]
    found = []
    columns = [n for n in (*need, "range_plus", "range_minus") if n in rows]
    data = {n: np.asarray(rows[n], dtype=float) for n in columns}
    if len({v.size for v in data.values()}) > 1:
        return ["columns of different length"]
    for n, v in data.items():
        for k in np.flatnonzero(~np.isfinite(v)):
            found.append(f"row {k + 1}: {n} is no finite number" + (" (both senses are needed)" if "rate" in n else ""))
    if found:
        return found
    i = data["current"]
    for k in np.flatnonzero(i <= 0.0):
        found.append(f"row {k + 1}: current {i[k] / MA:g} mA: give the magnitude, larger than zero")
    for n in ("rate_plus", "rate_minus"):
        for k in np.flatnonzero(data[n] <= 0.0):
            found.append(
                f"row {k + 1}: {n} = {data[n][k] / DPH:g} °/h: give magnitudes; a rate of the wrong sense is a drift "
                "larger than the precession or crossed wires"
            )
    if ("range_plus" in data) != ("range_minus" in data):
        found.append("range_plus and range_minus belong together: the angle range of each sense")
    elif "range_plus" in data:
        a, b = data["range_plus"], data["range_minus"]
        for k in np.flatnonzero((np.abs(a - b) > 0.01 * np.maximum(np.abs(a), np.abs(b))) | (a <= 0.0) | (b <= 0.0)):
            found.append(
                f"row {k + 1}: ranges {math.degrees(a[k]):g}° and {math.degrees(b[k]):g}°: both senses need the same "
                "angle range, or the drift does not cancel"
            )
    if i.size < 3:
        found.append(f"{i.size} currents: at least 3 are needed for a linearity")
    elif np.unique(i).size < i.size:
        found.append("the same current twice: average repeated measurements first")
    return found


def contradictions(i: Array, K_n: Array, half: Array, theta: Array) -> tuple[list[str], list[str]]:
    """Return why no verdict may rest on the table (sentences), and what is to be said besides.

    i (n,) A; K_n rad/s/A; half: half differences of the senses, rad/s; theta: angle ranges, which weigh as in the fit.
    """
    found = _far(K_n) or _departing(i, K_n, theta)
    a, p = asymmetry(i, K_n, half, theta)
    if p >= LEVEL:
        return found, []
    text = f"half the difference of the senses grows with the current, (K₊ − K₋)/(K₊ + K₋) = {100 * a:.3g} % "
    text = f"{text}({p_text(p)})"
    if abs(a) > ASYMMETRY:
        wrong = f"The rates of one sense are mistaken (unit, factor): {text}; a torquer differs by less than "
        return [*found, f"{wrong}{100 * ASYMMETRY:g} %."], []
    return found, [f"Asymmetry of the torquer: {text}. The drift holds what it makes at the mean current."]


def _far(K_n: Array) -> list[str]:
    middle = float(np.median(K_n))
    rows = np.flatnonzero(np.abs(K_n / middle - 1.0) > LARGEST)
    return [
        f"Row {k + 1} is mistaken (unit, factor, exchanged rows): its K_n is {K_n[k] / middle:.3g} times the median of "
        f"all; a torquer departs by less than {100 * LARGEST:g} %."
        for k in rows[:3]
    ]


def _departing(i: Array, K_n: Array, theta: Array) -> list[str]:
    """Return rows outside the noise of the others about the cubic torquer: t of the row left out, over the number of
    rows.
    """
    n = i.size
    X, w = np.column_stack([np.ones(n), (i / i.max()) ** 2]), theta / theta.max()
    if n < 5:
        return []
    worst, p_least = 0, 1.0
    for k in range(n):
        rest = np.arange(n) != k
        A = X[rest] * w[rest, None]
        inverse = np.linalg.inv(A.T @ A)
        beta = inverse @ (A.T @ (K_n[rest] * w[rest]))
        s2 = float(np.sum(((K_n[rest] - X[rest] @ beta) * w[rest]) ** 2)) / (n - 3)
        if s2 <= 1e-24 * float(np.max(K_n)) ** 2:
            continue  # computed, not measured
        u = np.sqrt(s2 * (1.0 / w[k] ** 2 + X[k] @ inverse @ X[k]))
        p = 2.0 * float(special.stdtr(n - 3, -abs(float(K_n[k] - X[k] @ beta)) / u))
        worst, p_least = (k, p) if p < p_least else (worst, p_least)
    if p_least >= LEVEL / n:
        return []
    return [f"Row {worst + 1} contradicts the others (K_n of a cubic torquer, p = {p_least * n:.1g} for {n} rows)."]


def asymmetry(i: Array, K_n: Array, half: Array, theta: Array) -> tuple[float, float]:
    """Return (K+ - K-)/(K+ + K-) and the p of its t test.

    The half differences are d + a K i + c i^2 (drift, asymmetry, even torquer) with noise proportional to i over the
    angle range, as that of the drift in the fit.
    """
    n = i.size
    if n < 5 or np.all(half == 0.0):
        return 0.0, 1.0
    w = theta / theta.max() / (i / i.max())
    A = np.column_stack([np.ones(n), i, i * i / i.max()]) * w[:, None]
    beta = np.linalg.lstsq(A, half * w, rcond=None)[0]
    s2 = float(np.sum((half * w - A @ beta) ** 2)) / (n - 3)
    size = float(np.median(K_n))
    u = float(np.sqrt(s2 * np.linalg.inv(A.T @ A)[1, 1]))
    if u <= 1e-12 * size:
        return float(beta[1]) / size, 0.0 if abs(float(beta[1])) > 1e-9 * size else 1.0
    return float(beta[1]) / size, 2.0 * float(special.stdtr(n - 3, -abs(float(beta[1])) / u))
