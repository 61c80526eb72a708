"""The plant of a controller inside of a part, whose signal has ways beside it (the reaction of a float on its table).

Any step of such a part is affine in the gain g of a controller without dynamics, x+ = (A0 + g A1) x + (B0 + g B1) u, so
two of its steps give A0 and A1.  A second copy of the part, x2, drives the controller alone:

    x1+ = A0 x1 + A1 x2 + B0 u + B1 c     x2+ = A0 x2 + B0 c     y = C0 x1 + C1 x2 + D0 u + D1 c

Opened at c it is what comes back by the controller, at u by all other ways; their sum is the loop before the part.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gyrobench.arrays import Array
from gyrobench.linear.linear_model import Linear
from gyrobench.linear.sampled_model import SampledStep
from gyrobench.record.run_document import LinearModel

COPY = "behind the summing point"  # input of the copy


def opened_inside(one: Linear, two: Linear, slot: str, port: str, gain: float) -> tuple[LinearModel, LinearModel]:
    """Return the loop by a controller of gain 1, and what comes back beside it.

    one, two: the system with a controller of this gain, and of twice as much.  The part's input is ``port``.
    """
    first, second = _step(one, slot), _step(two, slot)
    low = [m - (n - m) for m, n in zip(first, second, strict=True)]
    rise = [(n - m) / gain for m, n in zip(first, second, strict=True)]
    a0, b0, c0, d0 = low
    a1, b1, c1, d1 = rise
    inputs = one.blocks[slot].inputs
    k = inputs.index(port)
    n = len(a0)
    names = one.sampled[slot].names if slot in one.sampled else one.blocks[slot].states
    one.sampled[slot] = SampledStep(
        [*names, *(f"{n} ({COPY})" for n in names)],
        np.block([[a0, a1], [np.zeros((n, n)), a0]]),
        np.block([[b0, b1[:, k : k + 1]], [np.zeros_like(b0), b0[:, k : k + 1]]]),
        np.hstack([c0, c1]),
        np.hstack([d0, d1[:, k : k + 1]]),
    )
    one.multirate.pop(slot, None)
    row = one.inputs.index(f"{slot}.{port}")
    last = row - k + len(inputs)
    one.inputs.insert(last, f"{slot}.{COPY}")
    one.blocks[slot] = replace(one.blocks[slot], inputs=[*inputs, COPY])  # what there is may be shared
    one.w = np.insert(one.w, last, 0.0, axis=0)
    wired = np.insert(one.k, last, one.k[row], axis=0)
    models = []
    for opened, still in ((last, row), (row, last)):
        one.k = wired.copy()
        one.k[still] = 0.0
        models.append(one.discrete(one.inputs[opened]))
    return models[0], models[1]


def _step(linear: Linear, slot: str) -> tuple[Array, Array, Array, Array]:
    """Return a part's step x+ = a x + b u, y = c x+ + d u."""
    sampled, block = linear.sampled.get(slot), linear.blocks[slot]
    if sampled is not None:
        return sampled.a, sampled.b, sampled.c, sampled.d
    return (*block.held(linear.step), block.c, block.d)
