"""Tables of the eight-position test: positions, spreads inside the means, cycles, the equivalent drift coefficients."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.reduction.estimation.repeatability import statistics
from gyrobench.result import Coefficient, Table
from gyrobench.units import DPH

from . import model, positions

KU = units.factor("deg/h/mA")
ORDER = ("k_x", "k_y", "R_x", "u_x", "u_zx", "R_y", "u_y", "u_zy")  # as in Table 3-1


def left_over(channel: str, terms: int) -> tuple[int, ...]:
    """Return positions whose own offset tests the model: as many as it leaves free, eight less the unknowns.

    x: 1, 2, 3, 4 give k and u (two too many); the upright ones give R, u_z, q and s.  y likewise.
    """
    free = (2, 4) if channel == "x" else (1, 3)
    return free if terms == 6 else (*free, *((6, 7) if channel == "x" else (5, 8)))


def scale(name: str) -> float:
    """Return the size of the printed unit of a coefficient in SI."""
    return KU if name.startswith("k") else DPH


class PositionReadings:
    """Readings of both currents: position, cycle (n,); mean: about x and y (n,), A."""

    def __init__(
        self, position: NDArray[np.int_], cycle: NDArray[np.int_], mean: Mapping[str, Array],
        setup: model.EightPositionSetup,
    ) -> None:  # fmt: skip
        self.position, self.cycle, self.mean, self.setup = position, cycle, mean, setup
        self.by = {c: positions.means(position, mean[c]) for c in "xy"}

    def closed(self, by: Mapping[str, Mapping[int, float]]) -> dict[str, float]:
        """Return the closed formulas of currents by position, SI.  Raises ZeroDivisionError."""
        return positions.closed(by["x"], by["y"], self.setup.earth_rate, self.setup.latitude)

    @cached_property
    def cycles(self) -> dict[str, list[float]]:
        """Closed formulas of every cycle that has all eight positions: name -> values (SI)."""
        found: dict[str, list[float]] = {n: [] for n in ORDER}
        for k in np.unique(self.cycle):
            now = self.cycle == k
            by = {c: positions.means(self.position[now], self.mean[c][now]) for c in "xy"}
            if len(by["x"]) < 8:
                continue
            try:
                values = self.closed(by)
            except ZeroDivisionError:
                continue
            for n in ORDER:
                found[n].append(values[n])
        return found

    def repeatability(self) -> dict[str, Any]:
        """Return the standard deviation (n - 1) of the closed formulas over the cycles; empty for a single cycle."""
        count = len(self.cycles["k_x"])
        if count < 2:
            return {}
        out: dict[str, Any] = {"finding": f"closed formulas of {count} cycles", "cycles": count}
        for n in ORDER:
            unit = "°/h/mA" if n.startswith("k") else "°/h"
            out[f"σ of {n} over the cycles / ({unit})"] = statistics(self.cycles[n]).sigma / scale(n)
        return out

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        """Return the tables of both channels, whose coefficients these are."""
        return [self._positions(), self._spreads(), *self._cycles(), self._book_fit(), self._drift(coefficients)]

    def _positions(self) -> Table:
        rows: list[list[Any]] = []
        for n in positions.ATTITUDES:
            here = self.position == n
            row: list[Any] = [n]
            for c in "xy":
                each = [float(np.mean(self.mean[c][here & (self.cycle == k)])) for k in np.unique(self.cycle[here])]
                found = statistics(each)
                row += [found.mean * 1e3, found.sigma * 1e3 if len(each) > 1 else None]
            rows.append([*row, int(np.unique(self.cycle[here]).size)])
        caption = "Mean over the cycles and standard deviation (n − 1) of the cycles' means"
        head = ["position", "I_x / mA", "σ(I_x) / mA", "I_y / mA", "σ(I_y) / mA", "cycles"]
        return Table("positions.currents", "Currents by position", caption, head, rows)

    def _spreads(self) -> Table:
        values = positions.estimates(self.by["x"], self.by["y"], self.setup.earth_rate, self.setup.latitude)
        rows = [
            [n, *(values[n][j] / DPH if j < len(values[n]) else None for j in range(4)),
             (max(values[n]) - min(values[n])) / DPH]
            for n in ORDER if not n.startswith("k")
        ]  # fmt: skip
        caption = (
            "The single values of eq. 3-11 in °/h; what parts them is compliance (the two values of R and u_z) "
            "and error of attitude (the four of u)"
        )
        head = ["coefficient", "first", "second", "third", "fourth", "spread"]
        return Table("positions.spread", "Spread inside each mean", caption, head, rows)

    def _cycles(self) -> list[Table]:
        count = len(self.cycles["k_x"])
        if count < 2:
            return []
        each = {n: statistics(self.cycles[n]) for n in ORDER}
        rows: list[list[Any]] = [[str(k + 1), *(self.cycles[n][k] / scale(n) for n in ORDER)] for k in range(count)]
        rows.append(["mean", *(each[n].mean / scale(n) for n in ORDER)])
        rows.append(["σ (n − 1)", *(each[n].sigma / scale(n) for n in ORDER)])
        caption = "Closed formulas of each cycle; k in °/h/mA, all others in °/h"
        return [Table("cycles", "Cycle by cycle", caption, ["cycle", *ORDER], rows)]

    def _book_fit(self) -> Table:
        """Return least squares with four unknowns a channel beside the closed formulas.  [POS8-LS]"""
        s, closed = self.setup, self.closed(self.by)
        d = model.directions(np.array(list(positions.ATTITUDES)), s.latitude)
        rows = []
        for c in "xy":
            A = np.column_stack([model.rate(c, d, s.earth_rate) / s.earth_rate, -model.drift_columns(c, d, 4)])
            current = np.array([self.by[c][n] for n in positions.ATTITUDES])
            beta, *_ = np.linalg.lstsq(A, current, rcond=None)
            k = s.earth_rate / float(beta[0])
            residual = float(np.sqrt(np.sum((current - A @ beta) ** 2) / 4.0)) * k / DPH
            for n, v in zip(positions.UNKNOWNS[c], (k, *(beta[1:] * k).tolist()), strict=True):
                rows.append([n, v / scale(n), closed[n] / scale(n), (v - closed[n]) / scale(n), residual])
        caption = (
            "Least squares of the eight mean currents in (1/k, R/k, u/k); residual standard deviation in °/h. "
            "Compliance parts the two columns"
        )
        head = ["coefficient", "least squares", "closed formula", "difference", "residual / (°/h)"]
        return Table("fit.four_unknowns", "Four unknowns a channel", caption, head, rows)

    def _drift(self, coefficients: Sequence[Coefficient]) -> Table:
        """Return the same findings as coefficients of gyrobench.drift."""
        c, g = {c.name: c for c in coefficients}, self.setup.gamma
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
        caption = f"Precession sign, per multiple of g0; γ = g/g0 = {g:.6f}"
        return Table(
            "drift.equivalent", "As drift coefficients", caption, ["coefficient", "estimate", "u", "unit"], rows
        )
