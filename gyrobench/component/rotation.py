"""A rotation matrix as a declaration that checks itself."""

from __future__ import annotations

from gyrobench.component.composition import Block
from gyrobench.component.declarations import Parameter
from gyrobench.component.math import cross, dot, fabs

IDENTITY = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


class Rotation(Block):
    """A parameter that must be a rotation matrix (rows: body axes in the outer frame), checked at the start.

    mount = Rotation("rows: gyro axes I, O, S in case axes")      ->  v_gyro = self.mount @ v_case
    """

    suffixes = {"matrix": ""}
    matrix = Parameter(IDENTITY, "1", "rotation matrix")

    def __init__(self, doc: str, start: list[list[float]] = IDENTITY) -> None:
        super().__init__(matrix=Parameter(start, "1", doc))

    def start(self) -> None:
        for i in range(3):
            for j in range(3):
                self.refuse(
                    fabs(dot(self.matrix[i], self.matrix[j]) - (1.0 if i == j else 0.0)) > 1e-9,
                    "{self} is not a rotation matrix: its rows must be orthonormal to 1e-9",
                )
        self.refuse(
            dot(self.matrix[0], cross(self.matrix[1], self.matrix[2])) < 0.0,
            "{self} is left-handed (determinant -1): reverse one row",
        )
