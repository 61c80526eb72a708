"""Positions of an inertial measurement unit in unknown attitudes: setup, readings at rest, and the solutions that all
of its instruments share: sizes of gravity, turns, heading of the Earth rate.  [IMU-HAND]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.record.record import Record

from . import norms, turns
from .budget import ImuSetup
from .channels import AXES, CHANNELS
from .compensation import truth_of
from .norms import Triad
from .turns import Turn

COLUMNS = ("phase", "t_start", "t_end", *(f"mean_{c.name}" for c in CHANNELS))
SAMPLES = tuple(f"imu.rate[{k}]" for k in (1, 2, 3))
COMPENSATED = tuple(f"compensator.omega[{k}]" for k in (1, 2, 3))  # in their place, where there are any
ROUNDS = 3  # of turns and heading
LEAST_TURNS = 6  # two data each for nine unknowns
GAP = 5.5  # steps between two samples from which on a turn is not integrated


@dataclass(frozen=True, kw_only=True)
class HandSetup(ImuSetup):
    """rest: phases in which the case stood still; empty: all.  counts: letters of the triads (a, g) that read counts of
    an unknown scale.  samples: time (m,) and readings of the gyros (m, 3) while it was turned; none: no turns.
    """

    rest: frozenset[int] = frozenset()
    counts: str = ""
    samples: tuple[Array, Array] | None = field(default=None, repr=False)

    @classmethod
    def of_record(cls, record: Record) -> HandSetup:
        """Return the setup of a run or of a file."""
        run, counts = record.run, ""
        for kind in "ag":
            unit = run.window_units.get(f"mean_{kind}x", "") if run.measured else ""
            counts += kind if unit == "1" else ""
        names = COMPENSATED if COMPENSATED[0] in record.channels else SAMPLES
        there = all(n in record.channels for n in ("time", *names))
        samples = None
        if there:
            read = np.column_stack([np.asarray(record.channels[n], dtype=float) for n in names])
            samples = np.asarray(record.channels["time"], dtype=float), read
        rest = frozenset(row.phase for row in run.plan if row.mode == "index")
        truth = None if run.measured else truth_of(run.parameters)
        return cls.of(run, truth=own_axes(truth) if truth else None, rest=rest, counts=counts, samples=samples)


def own_axes(truth: Mapping[str, float]) -> dict[str, float]:
    """Return coefficients in the axes of the accelerometers: 1 + Sa = L Q with L lower triangular, Q a rotation."""

    def matrix(name: str) -> Array:
        return np.array([[truth[f"{name}_{a}{b}"] for b in AXES] for a in AXES])

    q, r = np.linalg.qr((np.eye(3) + matrix("Sa")).T)
    q = q * np.sign(np.diag(r))
    found = {n: v for n, v in truth.items() if n.startswith("b")}
    for name, value in (
        ("Sa", (np.eye(3) + matrix("Sa")) @ q - np.eye(3)),
        ("Sg", (np.eye(3) + matrix("Sg")) @ q - np.eye(3)),
        ("G", matrix("G") @ q),
    ):
        found |= {f"{name}_{a}{b}": float(value[i, j]) for i, a in enumerate(AXES) for j, b in enumerate(AXES)}
    return found


@dataclass(frozen=True)
class TurnSolution:
    """Turns with the Earth rate in them; S (3, 3) of the gyros; two level directions (2, 3) at each position; level
    Earth rate there (n, 3), rad/s, and the standard uncertainty of its components.
    """

    turned: list[Turn]
    matrix: Array
    level: list[Array]
    rate: Array
    u: float


class Positions:
    """Readings at rest, one row a position, and the solutions that all instruments share."""

    def __init__(self, windows: Mapping[str, Array], setup: HandSetup) -> None:
        self.setup = s = setup
        phase = np.asarray(windows["phase"]).astype(int)
        rest = np.isin(phase, list(s.rest)) if s.rest else np.ones(phase.size, dtype=bool)
        mine = [c for c in CHANNELS if f"mean_{c.name}" in windows]
        w = {n: np.asarray(windows[n], dtype=float)[rest] for n in COLUMNS if n in windows}
        new = np.concatenate([[True], np.diff(phase[rest]) != 0])
        group = np.cumsum(new) - 1
        length = w["t_end"] - w["t_start"]
        total = np.bincount(group, length)
        self.start, self.end = w["t_start"][new], w["t_end"][np.concatenate([new[1:], [True]])]
        read = {c.name: np.bincount(group, length * w[f"mean_{c.name}"]) / total for c in mine}
        self.acc = np.column_stack([read[f"a{a}"] for a in AXES])
        #: readings of the gyros; (n, 0) where there are none
        self.gyro = np.array([v for n, v in read.items() if n[0] == "g"]).reshape(-1, len(self.acc)).T

    @cached_property
    def scale_a(self) -> tuple[Array, Array]:
        """D of the accelerometers, readings per m/s2, and the start of their bias, readings."""
        if "a" in self.setup.counts:
            D, middle = norms.nominal(self.acc, self.setup.gravity)
            return D, middle
        return np.ones(3), np.zeros(3)

    @cached_property
    def triad(self) -> Triad:
        D, middle = self.scale_a
        return norms.solve(self.acc / D, self.setup.gravity, np.concatenate([np.zeros(6), middle / D]))

    @cached_property
    def force(self) -> Array:
        """Specific force (n, 3), m/s2, axes of the case."""
        return self.triad.force(self.acc / self.scale_a[0])

    @cached_property
    def own(self) -> Array:
        """Regressors (n, 4) of a gyro at rest: bias, and what the forces do by its g-sensitivity."""
        return np.column_stack([np.ones(len(self.force)), self.force / frames.G0])

    @cached_property
    def up(self) -> Array:
        return np.asarray(self.force / np.linalg.norm(self.force, axis=1)[:, None])

    @cached_property
    def vertical(self) -> Array:
        """Vertical part of the Earth rate (n, 3), rad/s."""
        return self.setup.earth_rate * math.sin(self.setup.latitude) * self.up

    @cached_property
    def raw_turns(self) -> list[Turn]:
        """Turns between neighbouring positions, readings less those at rest, before a scale factor is known: the
        longest row of turns of which no sample is missing, as the heading is lost where one is.
        """
        if self.setup.samples is None:
            return []
        time, read = self.setup.samples
        found = []
        for k in range(len(self.start) - 1):
            rows = slice(np.searchsorted(time, self.end[k] - 1e-9), np.searchsorted(time, self.start[k + 1] + 1e-9))
            steps = np.diff(time[rows])
            if steps.size > 1 and np.max(steps) < GAP * np.median(steps):
                bias = 0.5 * (self.gyro[k] + self.gyro[k + 1])
                found.append(Turn(time[rows], read[rows] - bias, self.up[k], self.up[k + 1], k))
        cuts = [0, *(k + 1 for k, (a, b) in enumerate(pairwise(found)) if b.at != a.at + 1), len(found)]
        return max((found[a:b] for a, b in pairwise(cuts)), key=len)

    @cached_property
    def carried(self) -> NDArray[np.bool_]:
        """Positions (n,) whose heading the turns carry on from one to the other."""
        inside = np.zeros(len(self.start), dtype=bool)
        if self.enough:
            inside[self.raw_turns[0].at : self.raw_turns[-1].at + 2] = True
        return inside

    @cached_property
    def labels(self) -> tuple[float, Array]:
        """Scale factor of the gyros, and the permutation of their axes that turns the case as gravity says."""
        return turns.nominal(self.raw_turns, "g" not in self.setup.counts)

    @property
    def scale_g(self) -> float:
        """D of the gyros, readings per rad/s; 1 where there are no turns."""
        return self.labels[0] if self.enough else 1.0

    @property
    def enough(self) -> bool:
        return len(self.raw_turns) >= LEAST_TURNS

    @cached_property
    def found(self) -> TurnSolution:
        """Return the matrix of the gyros and the level Earth rate, which need one another: in three rounds."""
        level, matrix, rate, u = [turns.across(u) for u in self.up], np.zeros((3, 3)), np.zeros(2), self.level_size
        if not self.enough:
            return TurnSolution([], matrix, level, np.zeros_like(self.up), u)
        for _ in range(ROUNDS):
            earth = self.vertical + self._along(level, rate)
            inverse = np.asarray(np.linalg.inv(np.eye(3) + matrix), dtype=float)
            G = self._sensitivity(earth, matrix)
            turned = [self._turn(t, earth, rate @ level[t.at], G, inverse) for t in self.raw_turns]
            matrix = turns.solve(turned, matrix)
            first = turned[0].at
            known = turns.headings(turned, np.asarray(np.linalg.inv(np.eye(3) + matrix)), self.up[first])
            level[first : first + len(known)] = known
            rate, u = self._level_rate(level, matrix)
        return TurnSolution(turned, matrix, level, self._along(level, rate), u)

    def _along(self, level: list[Array], rate: Array) -> Array:
        """Return the level Earth rate (n, 3) with these parts along the level directions, 0 where none are known."""
        return np.array([rate @ d for d in level]) * self.carried[:, None]

    def _sensitivity(self, earth: Array, matrix: Array) -> Array:
        """Return the g-sensitivity (3, 3), rad/s per g0, from the readings at rest; earth: Earth rate there (n, 3)."""
        y = self.gyro / self.scale_g - earth @ (np.eye(3) + matrix).T
        return np.asarray(np.linalg.lstsq(self.own, y, rcond=None)[0][1:].T)

    def _left(self, rates: Array, rows: slice | NDArray[np.bool_] = slice(None)) -> Array:
        """Return what bias and g-sensitivity leave of rates (n, k) at rest, in these rows."""
        own, rates = self.own[rows], rates[rows]
        return np.asarray(rates - own @ np.linalg.lstsq(own, rates, rcond=None)[0])

    def _turn(self, t: Turn, earth: Array, level: Array, G: Array, inverse: Array) -> Turn:
        """Return a turn with readings over D, the Earth rate (n, 3) of the positions in them; level (3,): at the start.

        The bias is what is read at rest less the Earth rate there; the turning Earth carries the start along.  Gravity
        turns with the case, and what the gyros read of it (G) changes against its mean at both ends, which the bias
        holds.
        """
        k, span = t.at, float(t.time[-1] - t.time[0])
        rate = t.rate / self.scale_g + 0.5 * (earth[k] + earth[k + 1])
        up = Turn(t.time, rate, t.before, t.after).path(inverse)
        change = (self.setup.gravity * up - 0.5 * (self.force[k] + self.force[k + 1])) / frames.G0
        return replace(t, rate=rate - change @ G.T, before=t.before + span * np.cross(level, t.before))

    def level_by_others(self, axis: int) -> tuple[Array, float]:
        """Return the level Earth rate (n, 3) at each position as the two other gyros show it, and its u: the fit of
        this one weighs it by its own readings, which would count twice.
        """
        found = self.found
        if not self.enough:
            return found.rate, found.u
        rate, u = self._level_rate(found.level, found.matrix, [k for k in range(3) if k != axis])
        return self._along(found.level, rate), u

    def _level_rate(self, level: list[Array], matrix: Array, gyros: Sequence[int] = (0, 1, 2)) -> tuple[Array, float]:
        """Return the level Earth rate along both level directions (2,), and the standard uncertainty of each: from what
        these gyros read at rest, and from its size, which is known.
        """
        n, K = int(np.count_nonzero(self.carried)), np.eye(3) + matrix

        def left(v: Array) -> Array:
            return self._left(v[:, list(gyros)], self.carried).T.ravel()

        data = left(self.gyro / self.scale_g - self.vertical @ K.T)
        X = np.column_stack([left(d @ K.T) for d in np.swapaxes(np.array(level), 0, 1)])
        alone = np.linalg.lstsq(X, data, rcond=None)[0]
        variance = float(np.sum((data - X @ alone) ** 2)) / max(len(gyros) * (n - 4) - 2, 1)
        precision = X.T @ X / variance + np.eye(2) / self.level_size**2
        covariance = np.linalg.inv(precision)
        return covariance @ (X.T @ data) / variance, float(np.sqrt(np.max(np.diag(covariance))))

    @cached_property
    def noise_a(self) -> float:
        """Standard deviation of a reading of an accelerometer at rest, m/s2, from what is left of the sizes."""
        left = np.linalg.norm(self.force, axis=1) - self.setup.gravity
        return math.sqrt(float(left @ left) / max(len(left) - len(norms.NAMES), 1))

    @cached_property
    def noise_g(self) -> float:
        """Standard deviation of a reading of a gyro at rest, rad/s, from what is left of bias and g-sensitivity."""
        left = self._left(self.gyro / self.scale_g - self.vertical - self.found.rate)
        return math.sqrt(float(np.sum(left**2)) / max(3 * (len(left) - 4), 1))

    @property
    def level_size(self) -> float:
        """Standard uncertainty of each component of the level Earth rate: its heading is anything."""
        return self.setup.earth_rate * max(abs(math.cos(self.setup.latitude)), 1e-3) / math.sqrt(2.0)
