"""Limits of a loop: the lags that take its phase margin.

    phase at the crossover = that of the ideal loop - atan(2 pi f T) for each lag T - that of the step and its delays

The step's part is the difference of the two linear models, discrete and continuous.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gyrobench.record.frequency_response import model_response
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops import margins as m
from gyrobench.reduction.loops.loop_result import LoopFindings

STEP = "communication step with its delays"


def phase_taken(found: LoopFindings, loop: str, lags: Mapping[str, float]) -> tuple[float, dict[str, float]]:
    """Return the crossover of the linear loop, Hz, and what each lag (s) and the step take of its phase there, degrees.

    {} for a loop without both linear models or without a crossover.
    """
    pair = found.linear.loops.get(loop)
    if pair is None or pair.discrete is None or pair.continuous is None:
        return 0.0, {}
    f = m.grid(0.1, 0.4 / pair.discrete.step)
    crossover = m.margins(f, model_response(pair.discrete, f)[:, 0, 0]).crossover
    if crossover is None:
        return 0.0, {}
    taken = {name: math.degrees(math.atan(2.0 * math.pi * crossover * lag)) for name, lag in lags.items() if lag > 0.0}
    held, free = (model_response(x, [crossover])[0, 0, 0] for x in (pair.discrete, pair.continuous))
    return crossover, taken | {STEP: math.degrees(-float(np.angle(held / free)))}


def bandwidth(found: LoopFindings, lags: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Return a sentence on what takes the phase margin of the loop that has the least.  lags: loop -> lag -> s."""
    margin = {loop: found.estimates[f"PM {loop}"] for loop in lags if f"PM {loop}" in found.estimates}
    if not margin:
        return []
    least = min(margin, key=lambda loop: margin[loop])
    crossover, taken = phase_taken(found, least, lags[least])
    largest = sorted(taken.items(), key=lambda i: -i[1])
    listed = [f"{plain(angle)}° ({name})" for name, angle in largest if angle >= 0.05]
    if not listed:
        return []
    words = ", ".join(listed[:-1]) + (" and " if listed[:-1] else "") + listed[-1]
    return [
        f"Lags limit the bandwidth: at the crossover of the {least} loop, {plain(crossover, 3)} Hz, they take {words} "
        "of its phase, at a higher one more."
    ]
