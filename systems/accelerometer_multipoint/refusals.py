"""What makes a multi-position test impossible: number and spacing of the positions, mount, setup, record."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.arrays import Array

from .closed import spacing
from .geometry import FACES

if TYPE_CHECKING:
    from .model import MultipointSetup

ZERO = math.radians(1.0)  # largest theta_0
STILL = 1e-6  # rad, largest motion within a window


def points_problems(points: int, mounts: str = "both", turns: int = 1) -> list[str]:
    """Return why ``points`` equally spaced positions cannot give the coefficients, as sentences."""
    if points < 4:
        return [f"{points} positions a turn: at least 4 are needed, 7 for the third order"]
    if points < 7:
        if points > 4:
            return [
                f"{points} positions a turn: three harmonics need at least 7 [ACC-MINPTS]; take 8, 12 or 24, or 4 for "
                "k0, k1 + k3 γ² and k2 alone"
            ]
        if mounts != "both" and turns < 2:
            return ["4 positions of one mount, once: four data for four unknowns say nothing of their scatter; turns=2"]
    return []


def few_problems(points: int, alone: bool) -> list[str]:
    """Return why so few positions will not do, as sentences; whether they tell the terms apart is up to the fit.

    The seven of :func:`points_problems` are those of three harmonics.  The model has no cosine of the third, and both
    mounts share k0 to k3: the six positions 30°, 90°, 150° ... determine all terms of a mount, those from 0° on do not.
    """
    if alone:
        return points_problems(points, turns=2) if points < 6 else []
    return [] if points >= 3 else [f"{points} positions: at least 3 are needed in a mount"]


def zero_problems(zeros: Mapping[str, float]) -> list[str]:
    """Return mounts whose input axis is not level at angle 0; ``zeros``: mount -> theta_0, rad."""
    return [
        f"mount {m}: θ₀ = {math.degrees(z):.4g}°: the input axis must be horizontal at angle 0 to 1° (head zero and "
        "mount together); a larger angle is a mistake of the mount"
        for m, z in zeros.items()
        if abs(z) > ZERO
    ]


def setup_problems(s: MultipointSetup) -> list[str]:
    found = frames.gravity_problems(s.gravity)
    if not (math.isfinite(s.scale) and s.scale > 0.0):
        found.append(f"scale λ = {s.scale:g} m/s²/A: a finite positive number is expected")
    unknown = sorted({m for m in s.mounts.values() if m not in FACES})
    if unknown:
        found.append(f"mount {', '.join(unknown)} unknown; there are {', '.join(FACES)}")
    return found


def record_problems(s: MultipointSetup, windows: Mapping[str, Array]) -> list[str]:
    """Return the phases without a mount and windows in which the head moved; rows count from 1."""
    phase = np.asarray(windows["phase"]).astype(int)
    strange = sorted(set(phase.tolist()) - set(s.mounts))
    found = [f"phase {p}: its mount is not given" for p in strange]
    turned = np.abs(np.asarray(windows["angle_end"], dtype=float) - np.asarray(windows["angle_start"], dtype=float))
    for k in np.flatnonzero(turned > STILL)[:5]:
        found.append(
            f"row {k + 1}: the head moved by {math.degrees(float(turned[k])):.3g}° while its reading was taken; a "
            "reading belongs to one position"
        )
    return found


def position_problems(mount: NDArray[np.str_], angle: Array) -> list[str]:
    """Return mounts with too few positions, or with four that are not quarters of a turn."""
    found = []
    four, mounts = four_positions(mount, angle), sorted(set(mount.tolist()))
    for m in mounts:
        here = angle[mount == m]
        n, uneven = spacing(here)
        problems = points_problems(n, turns=2) if four else few_problems(n, len(mounts) == 1)
        if four:
            quarters = np.abs(here - np.rint(here / (math.pi / 2.0)) * (math.pi / 2.0))
            if uneven or float(quarters.max()) > ZERO:
                problems = [f"4 positions must be 0°, 90°, 180° and 270°, each as often as the others; {uneven}"]
        found += [f"mount {m}: {p}" for p in problems]
    return found


def four_positions(mount: NDArray[np.str_], angle: Array) -> bool:
    """True where every mount has four positions, which see three combinations of the coefficients."""
    return all(spacing(angle[mount == m])[0] == 4 for m in set(mount.tolist()))
