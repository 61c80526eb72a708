"""What attitudes can and cannot tell, and how long a level one lasts.  [SERVO-C1, SERVO-C2]"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gyrobench import drift
from gyrobench.arrays import Array
from gyrobench.attitudes import LEVEL, SERVO_ATTITUDES, UP, VERTICAL

LIMIT = math.radians(1.0)  # of the angle in a level attitude
#: in the order in which they are kept while the attitudes tell more
TERMS = ("D_F", "D_I", "D_S", "D_O", "D_II", "D_SS")
CROSS = ("D_IO", "D_OS", "D_IS")


def gravity_along(name: str) -> Array:
    """Return SF/g along x, y, z at angle 0: +1 along an axis that points down."""
    x, y = SERVO_ATTITUDES[name]
    axis = 0 if abs(x) == UP else 1 if abs(y) == UP else 2
    out = np.zeros(3)
    out[axis] = 1.0 if name.endswith("down") else -1.0
    return out


@dataclass(frozen=True)
class Seen:
    """names: coefficients that are estimated.  mixed: of each the others it holds, with sign and power of gamma.
    lost: those that are not seen at all.
    """

    names: tuple[str, ...]
    mixed: Mapping[str, tuple[tuple[str, int, int], ...]]
    lost: tuple[str, ...]

    def shown(self, name: str) -> str:
        """Return D_F + γ² D_II; "" where a coefficient stands for itself."""
        words = [f"{'+' if s > 0 else '−'} {('', 'γ ', 'γ² ')[k]}{n}" for n, s, k in self.mixed[name]]
        return " ".join([name, *words]) if words else ""

    def combination(self, name: str, g: float) -> dict[str, float]:
        """Return what an ideal record gives for ``name``: coefficients with their factors, per g0^n."""
        return {name: 1.0} | {n: s * g**k for n, s, k in self.mixed[name]}

    def truth(self, name: str, true: Mapping[str, float], g: float) -> float:
        """Return what an ideal record gives for ``name``, rad/s per g0^n."""
        return sum(x * true.get(n, 0.0) for n, x in self.combination(name, g).items())


def seen(attitudes: Sequence[str]) -> Seen:
    """Return what the attitudes tell apart.  A coefficient that adds no rank is held by those before it, exactly."""
    rows = drift.regressors(np.array([gravity_along(n) for n in attitudes]), TERMS)
    kept: list[int] = []
    mixed: dict[str, list[tuple[str, int, int]]] = {}
    lost = list(CROSS)
    for j, name in enumerate(TERMS):
        column = rows[:, j]
        if not np.any(column):
            lost.append(name)
            continue
        share, *_ = np.linalg.lstsq(rows[:, kept], column, rcond=None) if kept else (np.zeros(0),)
        if np.allclose(rows[:, kept] @ share, column, atol=1e-9):
            for k, s in zip(kept, share.round().astype(int).tolist(), strict=True):
                if s:
                    mixed[TERMS[k]].append((name, s, drift.order(name) - drift.order(TERMS[k])))
        else:
            kept.append(j)
            mixed[name] = []
    return Seen(tuple(TERMS[k] for k in kept), {n: tuple(v) for n, v in mixed.items()}, tuple(lost))


def unseen(attitudes: Sequence[str]) -> list[str]:
    """Return what cannot be seen, said before the run, in the names of a floated gyro."""
    known = [n for n in attitudes if n in SERVO_ATTITUDES]
    if not known:
        return []
    found = seen(known)
    together = [words for n in found.names if (words := found.shown(n))]
    out = [f"These attitudes tell only combinations: {'; '.join(together)} (γ = g/g0)."] if together else []
    return [*out, f"Not seen at all, and taken as zero at angles other than 0: {', '.join(found.lost)}."]


def option_problems(
    attitudes: Sequence[str], rates: Mapping[str, float], time: float, what: str = "the Earth turns"
) -> list[str]:
    """Return what is wrong with attitudes and times.  rates: at which ``what`` the table of the level attitudes,
    rad/s.
    """
    known = (*VERTICAL, *LEVEL)
    unknown = [n for n in attitudes if n not in known]
    if unknown or not attitudes:
        return [f"attitude {', '.join(unknown) or 'none'}: there are {'; '.join(known)}"]
    found = []
    for name, rate in rates.items():
        if abs(rate) * time / 2.0 > LIMIT:
            most = 2.0 * LIMIT / abs(rate)
            found.append(
                f"{name}: {what} the table by {math.degrees(abs(rate) * time):.3g}° in settle and dwell of "
                f"{time:g} s; 1° either side of level allows {most:.0f} s"
            )
    return found
