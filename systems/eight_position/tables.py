"""Tables of the eight-position test: positions, spreads inside the means, cycles, the equivalent drift coefficients."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.reduction.estimation import repeatability as repeats
from gyrobench.result import DriftTestResult, Table

from . import model, positions

Table = dict[str, Any]
DPH, KU = units.factor("deg/h"), units.factor("deg/h/mA")
ORDER = ("k_x", "k_y", "R_x", "u_x", "u_zx", "R_y", "u_y", "u_zy")  # as in Table 3-1


def left_over(channel: str, terms: int) -> tuple[int, ...]:
    """Positions whose own offset is the test of the model: as many as it leaves free, eight less the unknowns.

    x: 1, 2, 3, 4 give k and u (two too many); the upright ones give R, u_z, q and s.  y likewise.
    """
    free = (2, 4) if channel == "x" else (1, 3)
    return free if terms == 6 else (*free, *((6, 7) if channel == "x" else (5, 8)))


def scale(name: str) -> float:
    return KU if name.startswith("k") else DPH


def cycles(position: NDArray[np.int_], cycle: NDArray[np.int_], mean: Mapping[str, Array], s: model.Setup) -> Table:
    """Closed formulas of every cycle that has all eight positions: name -> values (SI)."""
    found: dict[str, list[float]] = {n: [] for n in ORDER}
    for c in np.unique(cycle):
        by = {ch: _by_position(position[cycle == c], mean[ch][cycle == c]) for ch in "xy"}
        if len(by["x"]) < 8:
            continue
        try:
            values = positions.closed(by["x"], by["y"], s.earth_rate, s.latitude)
        except ZeroDivisionError:
            continue
        for n in ORDER:
            found[n].append(values[n])
    return found


def _by_position(position: NDArray[np.int_], value: Array) -> dict[int, float]:
    return {n: float(np.mean(value[position == n])) for n in positions.ATTITUDES if np.any(position == n)}


def repeatability(
    position: NDArray[np.int_], cycle: NDArray[np.int_], mean: Mapping[str, Array], s: model.Setup
) -> dict[str, Any]:
    """Standard deviation (n - 1) of the closed formulas over the cycles; empty for a single cycle."""
    found = cycles(position, cycle, mean, s)
    if len(found["k_x"]) < 2:
        return {}
    out: dict[str, Any] = {"finding": f"closed formulas of {len(found['k_x'])} cycles", "cycles": len(found["k_x"])}
    for n in ORDER:
        unit = "°/h/mA" if n.startswith("k") else "°/h"
        out[f"σ of {n} over the cycles / ({unit})"] = repeats.statistics(found[n]).sigma / scale(n)
    return out


def all_of(
    position: NDArray[np.int_], cycle: NDArray[np.int_], mean: Mapping[str, Array], s: model.Setup,
    each: Mapping[str, DriftTestResult],
) -> list[Table]:  # fmt: skip
    return [
        _positions(position, cycle, mean),
        _spreads(position, mean, s),
        *_cycles(position, cycle, mean, s),
        _book_fit(position, mean, s),
        _coefficients(s, each),
    ]


def _positions(position: NDArray[np.int_], cycle: NDArray[np.int_], mean: Mapping[str, Array]) -> Table:
    """Mean and standard deviation over the cycles of each position's current."""
    rows = []
    for n in positions.ATTITUDES:
        row: list[Any] = [n]
        for c in "xy":
            here = position == n
            each = [float(np.mean(mean[c][here & (cycle == k)])) for k in np.unique(cycle[here])]
            found = repeats.statistics(each)
            row += [found.mean * 1e3, found.sigma * 1e3 if len(each) > 1 else None]
        rows.append([*row, int(np.unique(cycle[position == n]).size)])
    return Table(
        "currents_by_position",
        "Currents by position",
        "Mean over the cycles and standard deviation (n − 1) of the cycles' means",
        ["position", "I_x / mA", "σ(I_x) / mA", "I_y / mA", "σ(I_y) / mA", "cycles"],
        rows,
    )


def _spreads(position: NDArray[np.int_], mean: Mapping[str, Array], s: model.Setup) -> Table:
    by = {c: _by_position(position, mean[c]) for c in "xy"}
    values = positions.estimates(by["x"], by["y"], s.earth_rate, s.latitude)
    rows = [
        [n, *(values[n][j] / DPH if j < len(values[n]) else None for j in range(4)),
         (max(values[n]) - min(values[n])) / DPH]
        for n in ORDER if not n.startswith("k")
    ]  # fmt: skip
    return Table(
        "spread_inside_each_mean",
        "Spread inside each mean",
        "The single values of eq. 3-11 in °/h; what parts them is compliance (the two values of R and u_z) "
        "and error of attitude (the four of u)",
        ["coefficient", "first", "second", "third", "fourth", "spread"],
        rows,
    )


def _cycles(
    position: NDArray[np.int_], cycle: NDArray[np.int_], mean: Mapping[str, Array], s: model.Setup
) -> list[Table]:
    found = cycles(position, cycle, mean, s)
    count = len(found["k_x"])
    if count < 2:
        return []
    rows: list[list[Any]] = [[str(k + 1), *(found[n][k] / scale(n) for n in ORDER)] for k in range(count)]
    each = {n: repeats.statistics(found[n]) for n in ORDER}
    rows.append(["mean", *(each[n].mean / scale(n) for n in ORDER)])
    rows.append(["σ (n − 1)", *(each[n].sigma / scale(n) for n in ORDER)])
    return [
        Table(
            "cycle_by_cycle",
            "Cycle by cycle",
            "Closed formulas of each cycle; k in °/h/mA, all others in °/h",
            ["cycle", *ORDER],
            rows,
        )
    ]


def _book_fit(position: NDArray[np.int_], mean: Mapping[str, Array], s: model.Setup) -> Table:
    """Least squares with four unknowns a channel beside the closed formulas.  [POS8-LS]"""
    by = {c: _by_position(position, mean[c]) for c in "xy"}
    closed = positions.closed(by["x"], by["y"], s.earth_rate, s.latitude)
    d = model.directions(np.array(list(positions.ATTITUDES)), s.latitude)
    rows = []
    for c in "xy":
        A = np.column_stack([model.rate(c, d, s.earth_rate) / s.earth_rate, -model.drift_columns(c, d, 4)])
        current = np.array([by[c][n] for n in positions.ATTITUDES])
        beta, *_ = np.linalg.lstsq(A, current, rcond=None)
        k = s.earth_rate / float(beta[0])
        residual = float(np.sqrt(np.sum((current - A @ beta) ** 2) / 4.0)) * k / DPH
        for n, v in zip(positions.UNKNOWNS[c], (k, *(beta[1:] * k).tolist()), strict=True):
            rows.append([n, v / scale(n), closed[n] / scale(n), (v - closed[n]) / scale(n), residual])
    return Table(
        "four_unknowns_a_channel",
        "Four unknowns a channel",
        "Least squares of the eight mean currents in (1/k, R/k, u/k); residual standard deviation in °/h. "
        "Compliance parts the two columns",
        ["coefficient", "least squares", "closed formula", "difference", "residual / (°/h)"],
        rows,
    )


def _coefficients(s: model.Setup, each: Mapping[str, DriftTestResult]) -> Table:
    """The same findings as coefficients of gyrobench.drift."""
    c = {c.name: c for r in each.values() for c in r.coefficients}
    g = s.gamma
    rule = [
        ("Dx_0 + γ² Dx_yy", "R_y", -1.0, "°/h"),
        ("Dy_0 + γ² Dy_xx", "R_x", 1.0, "°/h"),
        ("Dx_x", "u_zy", -1.0 / g, "°/h/g"),
        ("Dy_y", "u_zx", -1.0 / g, "°/h/g"),
        ("Dx_z − γ (Dx_zz − Dx_yy)", "u_x", 1.0 / g, "°/h/g"),
        ("Dy_z − γ (Dy_zz − Dy_xx)", "u_y", 1.0 / g, "°/h/g"),
    ]
    rows: list[list[Any]] = [[n, f * c[m].estimate, abs(f) * c[m].u, unit] for n, m, f, unit in rule]
    rows += [[n, c[n].estimate, c[n].u, c[n].unit] for ch in "xy" for n in model.EXTRA[ch] if n in c]
    return Table(
        "as_drift_coefficients",
        "As drift coefficients",
        f"Precession sign, per multiple of g0; γ = g/g0 = {g:.6f}",
        ["coefficient", "estimate", "u", "unit"],
        rows,
    )
