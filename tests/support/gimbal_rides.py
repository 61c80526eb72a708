"""Rides of the stabilized gimbal for its tests."""

from __future__ import annotations

from typing import Any

from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.system.system import load_system

RIDE = {"sweeps": False, "base": 0.0, "load_step": 0.0}


def ridden(
    parameters: dict[str, Any] | None = None, of: str = "gimbal_stabilization", **options: Any
) -> tuple[Any, Record]:
    """Return result and record of a ride alone, or of what the options ask for."""
    system: Any = load_system(of)
    for name, value in (RIDE | options).items():
        system.set(name, value)
    with Session(system) as session:
        record = session.run(parameters or {}, seed=3)
    return system.reduce(record), record


def rows(result: Any) -> dict[str, list[Any]]:
    """Return the budget: source -> pitch, yaw (µrad), share (%)."""
    return {row[0]: list(row[1:]) for t in result.tables if t.id == "budget.sources" for row in t.rows}
