"""What the parameters of simulated turn-ons say of the figures that are reported."""

from __future__ import annotations

from typing import Any

import numpy as np

from gyrobench.record.run_document import RunDocument

from .warming import Warming

QUIET = ("flicker_x", "walk_x", "white_x", "markov_x")  # noises of a gyro that move biases beyond the noise model


def true_values(run: RunDocument) -> dict[str, float] | None:
    """Return what the parameters of simulated turn-ons say, SI; None where they are not the bench's own."""
    p: dict[str, Any] = dict(run.parameters)
    if "switched.between_turn_ons" not in p:
        return None
    size = np.array([float(p[f"switched.warm_{k}"]) for k in (1, 2)])
    tau = np.array([float(p[f"switched.tau_{k}"]) for k in (1, 2)])
    there = np.flatnonzero(size)
    order = there[np.argsort(tau[there])]
    found: dict[str, float] = {}
    if order.size:  # what is one exponential to the record may be two
        found |= {"A": float(size.sum()), "τ": Warming(size[order], tau[order]).time_constant(1e9)}
    if order.size == 2:
        for k, j in enumerate(order.tolist(), 1):
            found |= {f"A_{k}": float(size[j]), f"τ_{k}": float(tau[j])}
    found["t_w"] = Warming(size[order], tau[order]).time_until(float(run.options["limit"]), 1e9)
    if not any(float(p.get(f"gyro.{n}", 0.0)) for n in QUIET):
        found |= {"σ_on": float(p["switched.between_turn_ons"]), "σ_day": float(p["switched.between_days"])}
    scale = 1.0 + float(np.ravel(p.get("gyro.scale", 0.0))[0])
    if "gyro.bias_T" in p:
        found["b_T"] = float(np.ravel(p["gyro.bias_T"])[0])
    return found | {"E": float(p["switched.scale_warm"]) * scale, "τ_E": float(p["switched.scale_tau"])}
