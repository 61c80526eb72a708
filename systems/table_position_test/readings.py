"""Readings of the position test: places, faces and ways, and what rounding of the counts leaves at a place."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from gyrobench.reduction.loops.loop_toolkit import Array, RunDocument

SEPARATED = 0.1  # least |1 - exp(j n angle)| at which an order is estimated
JITTER = 0.005  # of the variance of a rounding is left where the loop moves the table by a count while it is read
WHOLE = 0.1  # counts: as far from whole ones as a printed angle may be
HEADS = ("reader", "reader_2")


def within_turn(x: Array) -> Array:
    """Return angles less the nearest whole number of turns."""
    return np.asarray(x - 2 * math.pi * np.round(x / (2 * math.pi)))


class Readings:
    """One row a position; angles in rad.

    theta: commanded.  azimuth, mount: of polygon and level, and which of them.  t: middle of the reading, s.  sense: +1
    on the way up, -1 back, 0 where the record shows no move since the reference was mounted.  second, true: reading of
    the second head, and true position, less theta.  place, face: numbers of the position and of the face that is seen,
    from 0; seen: faces seen at all.  rounding: variance of the difference of two counted readings, rad2.
    """

    def __init__(self, w: Mapping[str, Array], run: RunDocument) -> None:
        o = run.options
        self.faces, self.head, self.orders = int(o["positions"]), float(o["head"]), int(o["orders"])
        quanta = [float(run.parameters.get(f"{n}.quantum", 0.0)) for n in HEADS]
        self.rounding = sum(q**2 for q in quanta) * JITTER / 12.0
        plan = {row.phase: row for row in run.plan}
        rows = [plan[int(p)] for p in w["phase"]]
        names = list(dict.fromkeys(row.face for row in run.plan))
        azimuths = np.radians([*dict.fromkeys(map(float, str(o["mounts"]).split()))])
        self.theta = np.array([row.target for row in rows])
        self.mount = np.array([names.index(row.face) for row in rows])
        self.azimuth = azimuths[self.mount]
        self.mounts = int(self.mount.max()) + 1
        self.t = (w["t_start"] + w["t_end"]) / 2.0
        self.sense = np.zeros(self.theta.size)  # of the last move, by the cumulative reading
        for k, moved in enumerate(np.diff(w["angle_start"]), 1):
            stays = self.sense[k - 1] if self.mount[k] == self.mount[k - 1] else 0.0
            self.sense[k] = np.sign(moved) if abs(moved) > 1e-3 else stays
        self.deviation, self.tracking, self.level = w["mean"], w["tracking"], w["level_x"] + 1j * w["level_y"]
        self.second = within_turn(w["second"] - self.theta)
        self.true = within_turn(w["true"] - self.theta) if "true" in w else None
        pitch = 2 * math.pi / self.faces
        self.place = np.round(self.theta / pitch).astype(np.int64) % self.faces
        self.face = np.round((self.theta + self.azimuth) / pitch).astype(np.int64) % self.faces
        self.seen = np.unique(self.face)
        self.rounding = max(self.rounding, self._undithered(quanta[1]))

    def _undithered(self, quantum: float) -> float:
        """Return the variance of rounding that returns at a place, where single counts of the second head were read.

        Noise of d counts before the rounding leaves exp(-4 pi2 d2) of q2/12: the first harmonic of what a count errs by
        over a count.  d by the scatter of the visits, which holds the rounding of a reading as well.
        """
        if not quantum:
            return 0.0
        counts = (self.second + self.theta) / quantum
        off = counts - counts[0]
        if np.max(np.abs(off - np.round(off))) > WHOLE:
            return 0.0  # means of many counts
        y = (self.second + self.tracking) / quantum
        places = np.unique(self.place)
        left = y - (self.place[:, None] == places) @ np.array([y[self.place == x].mean() for x in places])
        scatter = float(left @ left) / max(y.size - places.size, 1)
        return float(np.exp(-4.0 * math.pi**2 * max(scatter - 1.0 / 12.0, 0.0))) * quantum**2 / 12.0

    @property
    def both_senses(self) -> bool:
        """Return whether a place was reached from both sides: lost motion looks like a face's error otherwise."""
        return any(np.ptp(self.sense[self.place == x]) > 1.0 for x in np.unique(self.place))

    def drifts(self) -> Array:
        """Return the columns of a drift of the autocollimator, even with the time in each mount: from -1 to 1."""
        columns: Array = (self.mount[:, None] == np.arange(self.mounts)).astype(np.float64)
        for of in columns.T:
            t = self.t[of > 0.0]
            of[of > 0.0] = (2.0 * t - t.min() - t.max()) / max(float(np.ptp(t)), 1e-9)
        return columns

    def unknown_ways(self) -> Array:
        """Return a column for each run of readings at a place that was reached in an unknown sense."""
        unknown = self.sense == 0.0
        run = np.cumsum(np.append(True, np.diff(self.mount) != 0)) * unknown
        return np.asarray((run[:, None] == np.unique(run[unknown])).astype(float))

    def separated(self, n: int) -> bool:
        """Return whether an order is told from the errors of the polygon."""
        apart = [b - self.azimuth[0] for b in np.unique(self.azimuth)] + [self.head]
        return bool(max(abs(1.0 - np.exp(1j * n * b)) for b in apart) > SEPARATED)


def faces_of(r: Readings) -> Array:
    """Return the columns (n, faces - 1) of the errors of the faces that were seen, whose sum is 0."""
    seen = (r.face[:, None] == r.seen).astype(float)
    return np.asarray(seen[:, :-1] - seen[:, -1:])
