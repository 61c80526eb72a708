"""Evidence of a turning table beside the model: harmonics the model does not hold, turns that differ from one another.

    turns = Turns(found, [("mount 1", phase == 2), ("mount 2", phase == 4)], theta_start, theta_end)
    turns.test()                                # adds its F tests to found.tests
    turns.harmonics(fits), turns.repeatability(), turns.table()

[RED-HARMONIC; Hu 1981, eq. 4-12..4-22]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.drift import harmonic
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.regression import Fit
from gyrobench.reduction.setup.stops import spacing
from gyrobench.result import Harmonic, Table

AGREE, HIGH = "turns.agree", "turns.harmonics"  # ids of the tests
HIGHEST = 6  # harmonic that is tested


@dataclass
class Turns:
    """Phases in which the table turns, over an angle theta counted on through the turns.

    phases: label and mask (n,) of the rows of each.  start, end (n,): theta at the ends of each window, rad; its sign
    is that of the reported sine amplitudes.  held: highest harmonic that the model holds.
    """

    found: Findings
    phases: Sequence[tuple[str, NDArray[np.bool_]]]
    start: Array
    end: Array
    held: int = 2
    high: list[tuple[str, int, float, float, float]] = field(default_factory=list)

    def __post_init__(self) -> None:
        middle = (self.start + self.end) / 2.0
        self.turn = np.zeros(middle.size, dtype=int)
        self.spacing = [spacing(self.start[mine], self.end[mine]) for _, mine in self.phases]
        for (_, mine), step in zip(self.phases, self.spacing, strict=True):
            way = np.abs(middle[mine] - middle[mine][0]) + step / 2.0
            self.turn[mine] = np.floor(way / (2.0 * math.pi)).astype(int)

    def test(self) -> None:
        """Test (F) the harmonics that the model does not hold and, where a phase has several, turn against turn."""
        self._harmonic_test()
        self.found.f_test(
            AGREE, "turn to turn", self._turn_columns(), "change of the drift between successive turns",
            "the turns differ by more than the noise", "the turns agree within the noise",
        )  # fmt: skip

    # ------------------------------------------------------------------------------------------ harmonics
    def _harmonic_test(self) -> None:
        columns, labels = [], []
        for (label, mine), step in zip(self.phases, self.spacing, strict=True):
            orders = range(self.held + 1, min(HIGHEST, int(0.45 * 2.0 * math.pi / step)) + 1)
            if len(orders):
                block, _ = harmonic.columns(self.start, self.end, orders)
                columns.append(np.where(mine[:, None], block, 0.0))
                labels += [(label, n) for n in orders]
        extra = self._side_by_side(columns)
        name = f"harmonics {self.held + 1} and higher"
        size = self.found.f_test(
            HIGH, name, extra, "model errors periodic in the table angle",
            "something turns with the table that the model does not hold", "no more than noise",
        )  # fmt: skip
        if size is not None:
            value, u = (v / self.found.y_scale for v in size)
            self.high = [
                (*label, float(value[2 * j]), float(value[2 * j + 1]), max(float(u[2 * j]), float(u[2 * j + 1])))
                for j, label in enumerate(labels)
            ]

    def harmonics(self, fits: Mapping[str, Fit]) -> list[Harmonic]:
        """Return amplitudes with u in the unit of the data: of ``fits``, then of the residuals the model does not hold.

        fits: label -> harmonic.fit of the data.
        """
        out, unit, scale = [], self.found.y_unit, self.found.y_scale
        for label, f in fits.items():
            u = f.u / scale
            for n in range(self.held + 1):
                j = f.names.index(f"A{n}")
                b = float(f.beta[j + 1]) / scale if n else None
                out.append(Harmonic(label, n, float(f.beta[j]) / scale, b, float(u[j]), unit))
        return out + [Harmonic(label, n, a, b, u_ab, unit) for label, n, a, b, u_ab in self.high]

    # ------------------------------------------------------------------------------------------ turns
    def _turn_columns(self) -> Array:
        """Return the harmonics the model holds for each turn but the first of each phase."""
        block, names = harmonic.columns(self.start, self.end, range(self.held + 1))
        columns = []
        for _, phase in self.phases:
            for k in range(1, int(self.turn[phase].max()) + 1):
                mine = phase & (self.turn == k)
                if mine.sum() >= len(names):
                    columns.append(np.where(mine[:, None], block, 0.0))
        return self._side_by_side(columns)

    def _side_by_side(self, columns: Sequence[Array]) -> Array:
        return np.concatenate(columns, axis=1) if columns else np.empty((self.turn.size, 0))

    def _rows(self) -> list[list[Any]]:
        rows: list[list[Any]] = []
        for label, phase in self.phases:
            for k in range(int(self.turn[phase].max()) + 1):
                mine = phase & (self.turn == k)
                if mine.sum() > 2 * self.held + 1:
                    f = harmonic.fit(self.start[mine], self.end[mine], self.found.y[mine], self.held)
                    rows.append([label, k + 1, *(f.beta / self.found.y_scale).tolist()])
        return rows

    def _names(self) -> list[str]:
        return ["A0", *(f"{c}{n}" for n in range(1, self.held + 1) for c in "AB")]

    def repeatability(self) -> dict[str, Any]:
        """Return the F test of the turns and the scatter of their harmonics; empty where no test was made."""
        test = next((t for t in self.found.tests if t.id == AGREE), None)
        if test is None:
            return {}
        rows = self._rows()
        scatter = {}
        for column, name in enumerate(self._names(), 2):
            spread = []
            for label in dict.fromkeys(r[0] for r in rows):
                values = [float(r[column]) for r in rows if r[0] == label]
                if len(values) > 1:
                    spread.append(float(np.var(values, ddof=1)))
            size = math.sqrt(float(np.mean(spread))) if spread else 0.0
            scatter[f"scatter of {name} / ({self.found.y_unit})"] = size
        return {"F": test.statistic, "p": test.p, "finding": test.finding, **scatter}

    def table(self, over: str = "θ") -> list[Table]:
        """Return the table of the harmonics of each turn; empty for single turns."""
        if not self.turn.any():
            return []
        caption = f"Amplitudes in {self.found.y_unit} over {over}"
        head = ["series", "turn", *self._names()]
        return [Table("harmonics_of_each_turn", "Harmonics of each turn", caption, head, self._rows())]
