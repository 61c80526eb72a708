"""Type B lines of the two-axis servo test: what a wrong mount, table or clock does to each coefficient.

Every source is put into angles, axes or times, the data are made again from it, and the change goes through the fit:
with its sign where the readings are wrong, with the opposite one where the axes are not where the reduction has them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.reduction.estimation.effects import PHASES, SINES, Effect, one_by_one
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.run_metadata import Site

from .windows import Track

Array = NDArray[np.float64]
SMALL = 1e-5  # rad, size of the perturbations
SIZES = ("u_axis", "u_square", "u_mount", "u_angle1", "u_angle2", "u_wobble", "u_time")
AXES = ("outer", "inner")


def effects(
    channel: int, found: Findings, seen: Track, phase: NDArray[np.int_], site: Site, names: tuple[str, ...],
    sizes: Mapping[str, float],
) -> list[Effect]:  # fmt: skip
    """channel: 0 x, 1 y.  Each mount is set up by itself: its errors are independent of those of the others, and so are
    sine and cosine of an angle error.
    """
    y, X = seen.inertial(site)[:, channel], seen.design(site, names)

    def moved(other: Track) -> Array:
        return found.error(other.inertial(site)[:, channel] - y, other.design(site, names) - X) / SMALL

    def mount(k: int) -> Array:
        return one_by_one(-moved(replace(seen, base=_turned(k) @ seen.base)), phase)

    def read(axis: int, error: Callable[[Array], Array], slope: Callable[[Array], Array]) -> Array:
        angle, rate = seen.angle.copy(), seen.rate.copy()
        at = seen.angle[..., axis]
        angle[..., axis] += SMALL * error(at)
        rate[..., axis] += SMALL * slope(at) * seen.rate[..., axis]
        return moved(replace(seen, angle=angle, rate=rate))

    def order(axis: int, n: int) -> Array:
        return np.array([
            read(axis, lambda a: np.sin(n * a), lambda a: n * np.cos(n * a)),
            read(axis, lambda a: np.cos(n * a), lambda a: -n * np.sin(n * a)),
        ])  # fmt: skip

    each, mounts = "each mount set up by itself", tuple(f"mount {p}" for p in np.unique(phase))
    out = [
        Effect(f"table set up, about {a}", sizes["u_axis"], "rad", mount(k), each, mounts) for k, a in enumerate("XYZ")
    ]
    out += [
        Effect(f"gyro on the plate, about {a}", sizes["u_mount"], "rad", -moved(replace(seen, body=_turned(k))))
        for k, a in enumerate("xyz")
    ]
    out.append(Effect("right angle of the table axes", sizes["u_square"], "rad", -moved(replace(seen, square=SMALL))))
    for n, often in ((1, "once"), (2, "twice")):
        out += [
            Effect(f"{name} angle error, {often} a turn", sizes[f"u_angle{n}"], "rad", order(k, n), "encoder", SINES)
            for k, name in enumerate(AXES)
        ]
    for k, name in enumerate(AXES):
        both = [replace(seen, wobble=(SMALL * (k == 0), SMALL * (k == 1), p)) for p in (0.0, np.pi / 2.0)]
        change = -np.array([moved(one) for one in both])
        out.append(
            Effect(
                f"wobble of the {name} axis, twice a turn", sizes["u_wobble"], "rad", change, "unknown phase", PHASES
            )
        )
    slow = replace(seen, rate=(1.0 - SMALL) * seen.rate)
    return [*out, Effect("time base", sizes["u_time"], "1", moved(slow), "relative")]


def _turned(k: int) -> Array:
    """Rows: axes turned by SMALL about the k-th of them, in what they were."""
    return frames.rotation(np.eye(3)[k], SMALL).T
