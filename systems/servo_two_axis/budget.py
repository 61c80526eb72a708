"""Type B lines of the two-axis servo test: what a wrong mount, table or clock does to each coefficient.

Every source is put into angles, axes or times, the data are made again from it, and the change goes through the fit:
with its sign where the readings are wrong, with the opposite one where the axes are not where the reduction has them.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.reduction.drift.held_test import HeldSetup
from gyrobench.reduction.estimation.effects import one_by_one
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.sources import ANGLE_OF, INNER_SQUARE, TIME_BASE, TURNED, WOBBLE_OF, Effect, Source

from .windows import Track

SMALL = 1e-5  # rad, size of the perturbations
AXES = ("outer", "inner")
SET_UP = Source("table.set_up.{axis}", "table set up, about {axis}", "rad", "u_axis", "each mount set up by itself")
ON_PLATE = {n: replace(TURNED[n], name=f"gyro on the plate, about {n}") for n in "xyz"}


def effects(
    channel: int, found: Findings, seen: Track, phase: NDArray[np.int_], names: tuple[str, ...] | None, setup: HeldSetup
) -> list[Effect]:
    """Return all sources with their sensitivities.  channel: 0 x, 1 y.  Each mount is set up by itself: its errors are
    independent of those of the others, and so are sine and cosine of an angle error.  names: coefficients that are
    fitted; None: composite drifts, which no geometry changes.
    """
    site = setup.place
    y = seen.inertial(site)[:, channel]

    def moved(other: Track) -> Array:
        change = other.inertial(site)[:, channel] - y
        if names is None:
            return found.error(change) / SMALL
        return found.error(change, other.design(site, names) - seen.design(site, names)) / SMALL

    def both(which: str) -> Array:
        return np.array([moved(one) for one in other[which]])

    other, mounts = _others(seen), tuple(f"mount {p}" for p in np.unique(phase))
    set_up = ((SET_UP.of(axis=a), one) for a, one in zip("XYZ", other["base"], strict=True))
    return [
        *(source.effect(setup, one_by_one(-moved(one), phase), parts=mounts) for source, one in set_up),
        *(ON_PLATE[a].effect(setup, -moved(one)) for a, one in zip("xyz", other["body"], strict=True)),
        INNER_SQUARE.effect(setup, -moved(*other["square"])),
        *(
            ANGLE_OF[often].of(axis=name).effect(setup, both(f"{name} {n}"))
            for n, often in ((1, "once"), (2, "twice"))
            for name in AXES
        ),
        *(WOBBLE_OF.of(axis=name).effect(setup, -both(f"{name} wobble")) for name in AXES),
        TIME_BASE.effect(setup, moved(*other["time"])),
    ]


@functools.lru_cache(maxsize=1)
def _others(seen: Track) -> dict[str, list[Track]]:
    """Return what is seen with each error of the size SMALL, the same for both channels and for every fit of them."""

    def read(axis: int, n: int) -> list[Track]:
        sine, cosine = np.sin(n * seen.angle[..., axis]), np.cos(n * seen.angle[..., axis])
        both = []
        for error, slope in ((sine, n * cosine), (cosine, -n * sine)):
            angle, rate = seen.angle.copy(), seen.rate.copy()
            angle[..., axis] += SMALL * error
            rate[..., axis] += SMALL * slope * seen.rate[..., axis]
            both.append(replace(seen, angle=angle, rate=rate))
        return both

    out = {
        "base": [replace(seen, base=_turned(k) @ seen.base) for k in range(3)],
        "body": [replace(seen, body=_turned(k)) for k in range(3)],
        "square": [replace(seen, square=SMALL)],
        "time": [replace(seen, rate=(1.0 - SMALL) * seen.rate)],
    }
    for k, name in enumerate(AXES):
        for n in (1, 2):
            out[f"{name} {n}"] = read(k, n)
        phases = (0.0, np.pi / 2.0)
        out[f"{name} wobble"] = [replace(seen, wobble=(SMALL * (k == 0), SMALL * (k == 1), p)) for p in phases]
    return out


def _turned(k: int) -> Array:
    """Return rows: axes turned by SMALL about the k-th of them, in what they were."""
    return frames.rotation(np.eye(3)[k], SMALL).T
