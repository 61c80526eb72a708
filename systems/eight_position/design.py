"""The test as candidates of a plan: the eight positions, rows of the reduction's two regressions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gyrobench.design.visit_protocol import Channel, VisitProtocol, gyro_noise, gyro_unseen, phases_of
from gyrobench.record.record import Record
from gyrobench.system.system import System
from gyrobench.system.visits import format_time

from . import model, positions
from .reduction import Reduction

OTHER = {"x": "y", "y": "x"}  # the current about x measures the y channel


def protocol_of(system: System, record: Record) -> VisitProtocol:
    """Return the candidates: the positions, each in both channels; every plan has all eight.

    A change of position takes no time of its own in the simulation: state it in the option settle.
    """
    s, p = Reduction.setup_of(record.run), record.run.parameters
    true, number = model.truth(s), np.array(list(positions.ATTITUDES))
    d = model.directions(number, s.latitude)
    phases = phases_of(system)
    channels = []
    for c in "xy":
        D = model.drift_columns(c, d, s.terms)
        wanted = model.quantities(c, s, {})
        factor = np.array([1.0, 1.0, 1.0, 1.0, 1.0 / s.gamma**2, 1.0 / s.gamma])[: s.terms]
        start = np.array([true[q.name] for q in wanted])[1:] / factor[1:]
        current = (model.rate(c, d, s.earth_rate) - D @ start) / true[f"k_{c}"]
        noise = gyro_noise(p, f"gyro.k_{c}", f"rebalance_{c}.meter", f"_{OTHER[c]}")
        channels.append(Channel(tuple(q.name for q in wanted), np.column_stack([current, D]), np.diag(factor), noise))

    def options(visits: Sequence[tuple[int, float]]) -> dict[str, Any]:
        once = len(visits) == len(number)
        text = "; ".join(f"{number[j]} {format_time(t)}" for j, t in visits)
        return {"visits": text, **({"sigma": "false"} if once else {})}

    return VisitProtocol(
        tuple(positions.NAMES.values()), tuple(channels), lambda before, after: 0.0, float(system["settle"]), options,
        tuple((positions.NUMBERS[f.face] - 1, f.dwell) for f in phases), required=tuple(range(len(number))),
        unseen=(
            "Dx_yy and Dy_xx, which are folded into R, u and the differences of compliances",
            *gyro_unseen(p, ("_x", "_y")),
        ),
    )  # fmt: skip
