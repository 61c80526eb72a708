"""Measures that stabilized platforms have in common: steps, isolation, what their gyro drifts by, limits that were hit.

Each takes the findings of a record and adds its rows; SI inside.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.loops.loop_measures import Gate, Point, Step, step_noise_std
from gyrobench.reduction.loops.loop_result import LoopFindings

DECIBEL = 8.686  # of a relative uncertainty
LEVEL = ("D_F", "D_S", "D_SS")


def late_noise(y: Array) -> float:
    """Return the standard deviation of the white noise in the last tenth of a signal."""
    return float(np.std(np.diff(y[..., -y.shape[-1] // 10 :]))) / math.sqrt(2.0)


def peak_noise(at_rest: Array | None, before: int, at: int, y: Array) -> float:
    """Return the standard deviation that noise gives an angle ``at`` samples after a baseline, the mean of ``before``.

    at_rest: the angle in a hold; noise of any colour is in it, as a platform's random walk.  Without one, or with too
    short a one, it is that of white noise in the end of the signal y, too small where the noise is slow.
    """
    u = None if at_rest is None else step_noise_std(at_rest, before, max(at, 1), 1)
    return late_noise(y) if u is None else u


def command_step(
    found: LoopFindings, gate: Gate, output: str, settling: tuple[str, str], *, y_name: str, quiet: Gate | None = None,
    restless: bool = False,
) -> None:  # fmt: skip
    """Add what a platform makes of a commanded rate: rate gain, overshoot, settling (its name and meaning).

    restless: a rate that does not settle has no settling time, and says why.
    """
    step = found.step(gate, output, scale=1e-3, unit="mrad/s", y_name=y_name, quiet=quiet)
    why = step.unsettled
    share, u = step.change / gate.amplitude, step.u_change / abs(gate.amplitude)
    found.measure("rate gain", "rate reached over rate commanded", "1", share, u, closed=1.0, unsettled=why)
    meaning = "of the rate after the command"
    found.measure("overshoot", meaning, "%", 100.0 * step.overshoot, 100.0 * u, unsettled=why)
    none = step.restless if restless else ""
    found.measure(*settling, "s", step.settled_5, step.u_settled, unsettled=why, no_value=none)


def isolation_near(
    found: LoopFindings, points: Sequence[Point], closed: Callable[[float], complex | None]
) -> None:  # fmt: skip
    """Add the measured isolation next to 1 Hz, in dB, beside the closed form; nothing without points."""
    if not points:
        return
    nearest = min(points, key=lambda q: abs(q.f - 1.0))
    size, form = (None if not x else 20.0 * math.log10(abs(x)) for x in (nearest.value, closed(nearest.f)))
    meaning = f"platform over base at {nearest.f:g} Hz"
    found.measure("isolation", meaning, "dB", size, DECIBEL * (nearest.u or 0.0), closed=form)


def level_drift(p: Mapping[str, Any]) -> float | None:
    """Return the static drift of a gyro with x level and z up, (X, Y, Z) = (0, 0, -1), rad/s; None where unknown."""
    if any(f"gyro.{n}" not in p for n in LEVEL):
        return None
    fixed, along, squared = (float(p[f"gyro.{n}"]) for n in LEVEL)
    return fixed - along + squared


def stiffness(
    found: LoopFindings, name: str, meaning: str, torque: float, step: Step, closed: float | None = None
) -> None:  # fmt: skip
    """Add the torque of a step over the angle that it leaves; nothing where it leaves none."""
    if step.change:
        u = abs(torque / step.change**2) * step.u_change
        found.measure(name, meaning, "N·m/rad", torque / step.change, u, closed=closed, unsettled=step.unsettled)


def settling(found: LoopFindings, key: str, what: str, step: Step, *bands: int) -> None:
    """Add the times to stay within bands of 5 or 2 % of a change."""
    for band in bands:
        time = step.settled_5 if band == 5 else step.settled_2
        meaning = f"settling {what.format(band=f'{band} %')}"
        found.measure(f"t_{band}{key}", meaning, "s", time, step.u_settled, unsettled=step.unsettled)


def lower_limit(
    found: LoopFindings, values: Mapping[str, tuple[float, float]], share: float | None, f: float | None
) -> None:  # fmt: skip
    """Add the limit to which the gain of a conditionally stable loop may fall, and the frequency there.

    values: of margins.measured_values; nothing without "lower" in them.  share, f: closed forms, f in Hz.
    """
    if "lower" in values:
        meaning = "share of the gain at which the loop becomes unstable"
        found.measure("lower limit", meaning, "1", *values["lower"], closed=share)
        found.measure("f_lower", "frequency at that limit", "Hz", *values["f_lower"], closed=f)
        found.modelled("lower limit", "stabilizer", lambda limits: limits.lower)
        found.modelled("f_lower", "stabilizer", lambda limits: limits.f_lower)
