"""Error budget of the ride by source, from the linear model of the run: rms of the platform's angle for each of them.

A base that swings moves the platform by the ways of :func:`gyrobench.reduction.loops.loop_summary.base_torques`.  Noise
of density S passes to the angle by

    drift rate of the gyro     T/s,  T = L/(1 + L)
    reading of the current     G E,  G: angle for a test signal at the stabilizer's input, E: the estimator
    pickoff                    G E K_p s/(s + w_r),  w_r = K_p K_sg k H/C, the rebalance without integral

and is taken less its running mean, as the platform error is: var = 2 int |H|^2 S^2 (1 - D)^2 df, two-sided S.

Not modelled: dry friction that slips, limits, the Gauss-Markov drift (slow against the running mean).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.record.frequency_response import model_response
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops import margins as m
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import base_ways
from gyrobench.result import Table
from gyrobench.units import ARCSEC

LOWEST = 0.02  # Hz, where the integral over the noise begins: the running mean takes what is slower
WRONG = 0.2  # relative: a measured ride that differs more from the computed one is not the linear model's


def ride_budget(found: LoopFindings, ride: Gate, angle: str, mean: int) -> dict[str, float]:
    """Add the table; return source -> rms of the platform's angle, rad, of what is in the ride; {} without a model.

    mean: samples of the running mean.
    """
    model = found.linear.closed.discrete
    loop = found.linear.loops.get("stabilizer")
    if model is None or loop is None or loop.discrete is None or not ride.f:
        return {}
    rms = ride.amplitude / math.sqrt(2.0)
    total = found.excited("discrete", "motion", 1, angle, [ride.f])
    across = found.excited("discrete", "motion", 2, angle, [ride.f])
    if total is None:
        return {}
    ways = base_ways(found, angle, ride.f) or {"all ways together": abs(complex(total[0]))}
    degrees = math.degrees(ride.amplitude)
    noise = _noise(found, model.step, angle, mean, float(ride.t[1] - ride.t[0]))
    base = rms * abs(complex(total[0]))
    whole = math.hypot(base, *(size for *_, size in noise.values()))
    measured = found.estimates["platform error"]
    if not whole or abs(measured * ARCSEC / whole - 1.0) > WRONG:
        text = (
            f"No error budget by source: the linear model gives {plain(whole / ARCSEC, 3)}″ for the ride, measured are "
            f"{plain(measured, 3)}″ (friction that slips, or a limit)."
        )
        found.warn("budget.not_linear", text)
        return {}
    swings: list[list[Any]] = [[f"base about x, by {way}", degrees, "°", rms * size] for way, size in ways.items()]
    # the ways add as phasors: each has its share of the sum's square
    rows = [[*row, (base / whole) ** 2 * row[3] / sum(r[3] for r in swings)] for row in swings if ride.amplitude]
    rows += [[name, density, unit, size, (size / whole) ** 2] for name, (density, unit, size) in noise.items()]
    rows.sort(key=lambda row: -row[4])
    shown = [[*row[:3], row[3] / ARCSEC, 100.0 * row[4]] for row in rows]
    shown.append(["together", None, "", whole / ARCSEC, None])
    shown.append(["platform error, measured", None, "", measured, None])
    if across is not None:
        size = rms * abs(complex(across[0])) / ARCSEC
        shown.append(["not in the ride: base about y, output-axis coupling", degrees, "°", size, None])
    caption = (
        f"Angle of the platform computed from the linear model for the ride at {ride.f:g} Hz, and its share of the "
        "variance. Size: amplitude of the base, or density of the noise (two-sided). The ways of the base add as "
        "phasors and share its variance as their sizes, noise adds by squares."
    )
    columns = ["source", "size", "unit", "angle, rms / ″", "share / %"]
    found.tables.append(Table("budget.sources", "Error budget of the ride, by source", caption, columns, shown))
    return {row[0]: row[3] for row in rows}


def _noise(found: LoopFindings, step: float, angle: str, mean: int, dt: float) -> dict[str, tuple[float, str, float]]:
    """Return source -> density, its unit, and rms of the platform's angle less its running mean, rad."""
    p = found.record.run.parameters
    f = m.grid(LOWEST, 0.5 / step)
    s = 2j * np.pi * f
    loop = found.linear.loops["stabilizer"].discrete
    test, estimate, reading = (
        found.excited("discrete", "test", 1, name, f) for name in (angle, "estimator.estimate", "rebalance.i_read")
    )
    if loop is None or test is None or estimate is None or reading is None:
        return {}
    L = model_response(loop, f)[:, 0, 0]
    kept = np.abs(1.0 - np.sin(np.pi * f * mean * dt) / (mean * np.sin(np.pi * f * dt)))
    read = test * estimate / reading

    def size(way: Any) -> float:
        return math.sqrt(2.0 * float(np.trapezoid((np.abs(way) * kept) ** 2, f)))

    found_noise = {}
    ways = {
        "drift rate of the gyro, white": ("gyro.white", "rad/s/√Hz", L / (1.0 + L) / s),
        "reading of the current": ("rebalance.meter", "A/√Hz", read),
    }
    names = ("rebalance.K_p", "gyro.K_sg", "gyro.k", "gyro.H", "gyro.C")
    if all(n in p for n in names) and not p.get("rebalance.K_i"):
        K_p, K_sg, k, H, C = (float(p[n]) for n in names)
        ways["pickoff of the gyro"] = ("gyro.pickoff", "V/√Hz", read * K_p * s / (s + K_p * K_sg * k * H / C))
    for name, (parameter, unit, way) in ways.items():
        density = float(p.get(parameter) or 0.0)
        if density > 0.0:
            found_noise[name] = density, unit, density * size(way)
    return found_noise
