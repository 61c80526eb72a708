"""The test as choices of mounts, each with the time in a mount.

Which mounts are worth a run is found without one: along the path that the gyro's drift and the Earth make the table
take, the reduction's own regressors and a trend of the drift, which it cannot exclude, give the information of each
mount, that of several mounts is its sum, and all sets of the twelve are compared.  Neglected there: noise that is
common to two mounts, constants that differ from mount to mount.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from gyrobench import drift
from gyrobench.arrays import Array
from gyrobench.design.option_protocol import Choice, OptionProtocol
from gyrobench.design.visit_protocol import DataNoise, gyro_noise, gyro_unseen
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.system.system import System
from gyrobench.system.visits import format_time

from . import geometry, refusals
from .windows import NODES, Track

TURN = 2.0 * math.pi
WINDOWS = 24  # least number in a mount
SHORTEST, LONGEST, TIMES = 1.0 / 96.0, 2.0, 32  # times in a mount that are compared, in days of the simulated Earth
SLACK = 1.1  # a mount is proposed for a time only if it stays clear of gimbal lock for so much longer
PROPOSED, TRIED = 3, 10  # sets of mounts; of one number, until one is not refused


def protocol_of(system: System, record: Record) -> OptionProtocol:
    """Return the mounts of the system's plan and what else is worth a run; the length is the time in a mount."""
    test = TestModel.of(system, record)
    choices = (test.choice(test.own, float(system["time"])),)
    names = tuple(n for c in "xy" for n in drift.terms_2dof(c, test.terms))

    def covariances(fits: Sequence[Findings], record: Record) -> list[Array]:
        w = record.windows
        out = []
        for c, fit in zip("xy", fits, strict=True):
            inner = np.interp((fit.t_start + fit.t_end) / 2.0, w["t_start"], w["inner_start"])
            out.append(test.covariance(c, fit.t_start, fit.t_end, inner))
        return out

    unseen = ("friction, ripple and wobble of the tables", *gyro_unseen(record.run.parameters, ("_x", "_y")))
    return OptionProtocol(choices, covariances, names, unseen, propose=test.proposals)


@dataclass(frozen=True)
class TestModel:
    """What a plan of mounts is judged by.

    own: mounts of the system's plan.
    noise, reading: of channels x and y; reading: sd of an angle reading, rad.  rates: drift as a function of gravity.
    lost: s of a mount beside its windows and the way back to 0.  rate, acceleration: of moves, outer and inner axis.
    """

    own: tuple[int, ...]
    site: Location
    terms: int
    window: float
    settle: float
    lost: float
    noise: Mapping[str, DataNoise]
    reading: Mapping[str, float]
    rates: geometry.Rates
    rate: Array
    acceleration: Array

    @classmethod
    def of(cls, system: System, record: Record) -> TestModel:
        """Return that of a system from a run of it."""
        p, w = record.run.parameters, record.windows
        known = {c: drift.NAMES_2DOF[c] for c in "xy"}
        beta = {c: np.array([float(p.get(f"gyro.{n}", 0.0)) for n in known[c]]) for c in "xy"}

        def rates(at: tuple[float, float, float]) -> tuple[float, float]:
            x, y = (float(drift.regressors(at, known[c]) @ beta[c]) for c in "xy")
            return x, y

        reading = {}
        for c, slot in zip("xy", ("outer", "inner"), strict=True):
            # white noise of the pickoff through the loop: density squared times 0.8 of the crossover, 1.3 with the
            # delay of a step (network 1); a loop of first order has 0.5
            crossover = float(p.get(f"{slot}.crossover", 0.0)) or 100.0 * math.pi
            pickoff = float(p.get(f"gyro.pickoff_{c}", 0.0)) / float(p.get(f"gyro.K_sg_{c}", 1.0))
            reading[c] = math.hypot(pickoff * math.sqrt(crossover), float(p[f"{slot}.quantum"]) / math.sqrt(12.0))
        limits = [np.array([float(p[f"{s}.{n}"]) for s in ("outer", "inner")]) for n in ("index_rate", "acceleration")]
        held = np.array([r.phase for r in record.run.plan if r.mode == "servo"])
        moved = 0.0
        for phase in held[:-1]:
            end = int(np.flatnonzero(np.asarray(w["phase"]) == phase)[-1])
            moved += _way(np.array([w["outer_end"][end], w["inner_end"][end]]), *limits)
        lost = (float(w["t_end"][-1]) - held.size * float(system["time"]) - moved) / held.size
        own = tuple(refusals.numbers(str(system["mounts"])) or ())
        return cls(
            own, Location.of(record.run), int(system["terms"]), float(system["window"]), float(system["settle"]), lost,
            {c: gyro_noise(p, meter="", axis=f"_{c}") for c in "xy"}, reading, rates, *limits,
        )  # fmt: skip

    @property
    def day(self) -> float:
        return TURN / self.site.earth_rate

    def covariance(self, c: str, t0: Array, t1: Array, inner: Array) -> Array:
        """Return the covariance (n, n) of the mean rates of a channel over windows; inner: angle of the inner axis.

        Windows that follow one another share a reading of the angle; in the x channel it counts by cos y.
        """
        V = self.noise[c].covariance(t0, t1)
        error = self.reading[c] * (np.cos(inner) if c == "x" else np.ones_like(t0)) / (t1 - t0)
        shared = np.where(np.abs(t0[1:] - t1[:-1]) < 1e-6 * (t1 - t0)[1:], -error[1:] * error[:-1], 0.0)
        return np.asarray(V + np.diag(2.0 * error**2) + np.diag(shared, 1) + np.diag(shared, -1))

    # ------------------------------------------------------------------------------------------ choices
    def choice(self, mounts: Sequence[int], start: float) -> Choice:
        """Return the choice of these mounts, the last of which is the one with the longest way back to 0."""
        lengths = np.geomspace(SHORTEST * self.day, max(start, 2.0 * SHORTEST * self.day), TIMES)
        good = [not self._refused(mounts, float(t)) for t in lengths]
        first = len(good) - next((k for k, ok in enumerate(reversed(good)) if not ok), len(good))
        least = float(lengths[min(first, len(good) - 1)])
        return Choice(f"mounts {' '.join(map(str, mounts))}", functools.partial(self._options, mounts), start, least)

    def _options(self, mounts: Sequence[int], length: float) -> Mapping[str, Any]:
        """Return whole windows of whole milliseconds, the system's own where there are enough of them."""
        count = max(WINDOWS, round(length / self.window))
        window = max(round(length / count, 3), 1e-3)
        text = " ".join(map(str, mounts))
        return {"mounts": text, "time": format_time(count * window), "window": format_time(window)}

    def _refused(self, mounts: Sequence[int], time: float) -> bool:
        """Return whether the system would refuse these mounts for a gyro without drift."""
        latitude, rate = self.site.latitude, self.site.earth_rate
        most = refusals.MOST_SINGLE if len(set(mounts)) == 1 else refusals.MOST
        if refusals.condition(refusals.designs(mounts, latitude, time, self.terms, rate)) > most:
            return True
        inner = max(refusals.locked(m, latitude, time + self.settle, rate) for m in set(mounts))
        return math.cos(inner) < geometry.LEAST

    def proposals(self, wanted: Mapping[str, float], time: float | None, criterion: str) -> list[Choice]:
        """Return a few sets of mounts for what is wanted (SI) or in a given time (s): the best pair, the best others.

        Of different numbers: from three mounts on the reduction weighs constants that differ from mount to mount, which
        costs more than is promised here.
        """
        numbers = list(geometry.MOUNTS)
        lengths = np.geomspace(SHORTEST, LONGEST, TIMES) * self.day
        sets = np.array(list(itertools.product((False, True), repeat=len(numbers))))[1:]
        merit, total = np.full((2, TIMES, len(sets)), math.inf)
        paths = {m: self._path(m) for m in numbers}
        for k, length in enumerate(lengths):
            free = np.array([paths[m].free > SLACK * length + self.settle for m in numbers])
            back = np.array([paths[m].way(length + self.settle) for m in numbers])
            known = [
                self._information(paths[m], float(length)) if ok else None for m, ok in zip(numbers, free, strict=True)
            ]
            usable = ~np.any(sets & ~free, axis=1)
            if not usable.any():
                continue
            chosen = sets[usable]
            before = self._before(chosen, back, float(length))
            merit[k, usable] = self._merit(chosen, known, before, wanted, criterion)
            ways = np.where(chosen, back, 0.0)
            total[k, usable] = chosen.sum(axis=1) * (length + self.lost) + ways.sum(axis=1) - ways.max(axis=1)
        length, cost = _crossing(lengths, merit, total, time)
        alike: dict[int, list[int]] = {}  # by number of mounts, the best first
        for j in np.argsort(cost)[: int(np.isfinite(cost).sum())]:
            alike.setdefault(int(sets[j].sum()), []).append(int(j))
        out: list[Choice] = []
        for each in sorted(alike.values(), key=lambda each: (sets[each[0]].sum() != 2, cost[each[0]])):
            for j in each[:TRIED]:
                chosen = [m for m, there in zip(numbers, sets[j], strict=True) if there]
                chosen.sort(key=lambda m: paths[m].way(float(length[j]) + self.settle))
                if set(chosen) != set(self.own) and not self._refused(chosen, float(length[j])):
                    out.append(self.choice(chosen, float(length[j])))
                    break
            if len(out) == PROPOSED:
                break
        return out

    def _merit(
        self, sets: NDArray[np.bool_], known: Sequence[Mapping[str, Array] | None], before: Array,
        wanted: Mapping[str, float], criterion: str,
    ) -> Array:  # fmt: skip
        """Return the criterion of (u/wanted)^2 of each set of mounts (m, 12), inf where it does not see something.

        The last column of the information is the time in a mount; that of the whole test is later by ``before``, which
        is so much of the column of the constant (the first).
        """
        squares = []
        for c in "xy":
            names = drift.terms_2dof(c, self.terms)
            index = [names.index(n) for n in wanted if n in names]
            p = len(names) + 1
            each = np.array([np.zeros((p, p)) if k is None else k[c] for k in known])
            there = sets.astype(float)
            M = np.einsum("sm,mij->sij", there, each)
            later = np.einsum("sm,mi->si", there * before, each[:, :, 0])
            M[:, -1, -1] += 2.0 * later[:, -1] + np.einsum("sm,m->s", there * before**2, each[:, 0, 0])
            M[:, :-1, -1] += later[:, :-1]
            M[:, -1, :-1] += later[:, :-1]
            size = np.sqrt(np.maximum(np.einsum("sii->si", M), 1e-300))
            inverse = np.linalg.inv(M / (size[:, :, None] * size[:, None, :]) + 1e-12 * np.eye(p))
            variance = np.einsum("sii->si", inverse)
            seen = np.all(variance < 1e9, axis=1)  # where the rank is short, up to 1e12
            sizes = np.where(seen[:, None], size[:, index], math.nan) * np.array([wanted[names[i]] for i in index])
            squares.append(np.nan_to_num(variance[:, index] / sizes**2, nan=math.inf))
        both = np.concatenate(squares, axis=1)
        return np.asarray(both.max(axis=1) if criterion == "minimax" else both.mean(axis=1))

    def _before(self, sets: NDArray[np.bool_], back: Array, length: float) -> Array:
        """Return when each mount of each set begins (m, 12), in days: those with the shortest way back come first."""
        order = np.argsort(back)
        out = np.empty(sets.shape)
        out[:, order] = (np.cumsum(sets[:, order], axis=1) - 1) * (length + self.lost) / self.day
        return out

    # ------------------------------------------------------------------------------------------ paths
    def _path(self, mount: int) -> Path:
        most = SLACK * LONGEST * self.day + self.settle
        points = math.ceil(SLACK * LONGEST * 360.0) + 1
        t, x, y = geometry.path(mount, self.site.latitude, most, points, self.site.earth_rate, self.rates)
        near = np.flatnonzero(np.cos(y) < geometry.LEAST)
        curve = CubicSpline(t, np.column_stack([x, y]))
        return Path(mount, curve, float(t[near[0]]) if near.size else math.inf, (self.rate, self.acceleration))

    def track(self, path: Path, length: float) -> Track:
        """Return the windows of ``length`` in a mount, along its path; rates are left out."""
        count = max(WINDOWS, round(length / self.window))
        edges = self.settle + length * np.arange(count + 1) / count
        t0, t1 = edges[:-1], edges[1:]
        angle = path.curve((t0 + t1)[:, None] / 2.0 + (t1 - t0)[:, None] / 2.0 * NODES)
        base = np.broadcast_to(geometry.base(path.mount, self.site.latitude), (count, 3, 3))
        return Track(angle, np.zeros_like(angle), base, t0, t1)

    def _information(self, path: Path, length: float) -> dict[str, Array]:
        """Return the information matrix of each channel of ``length`` in a mount: coefficients, trend."""
        track, out = self.track(path, length), {}
        inner = track.angle[:, :, 1].mean(axis=1)
        for c in "xy":
            L = np.linalg.cholesky(self.covariance(c, track.t_start, track.t_end, inner))
            X = track.design(self.site, drift.terms_2dof(c, self.terms))
            Z = np.linalg.solve(L, np.column_stack([X, (track.t_start + track.t_end) / 2.0 / self.day]))
            out[c] = Z.T @ Z
        return out


@dataclass(frozen=True)
class Path:
    """Angles of both axes over the time in a mount; free: s until gimbal lock; moves: rates, accelerations."""

    mount: int
    curve: CubicSpline
    free: float
    moves: tuple[Array, Array]

    def way(self, time: float) -> float:
        """Return the s that both axes take back to 0."""
        return _way(self.curve(min(time, float(self.curve.x[-1]))), *self.moves)


def _way(angle: Array, rate: Array, acceleration: Array) -> float:
    peak = np.minimum(rate, np.sqrt(np.abs(angle) * acceleration))
    return float(np.max(np.abs(angle) / np.maximum(peak, 1e-12) + peak / acceleration))


def _crossing(lengths: Array, merit: Array, total: Array, time: float | None) -> tuple[Array, Array]:
    """Return of each set (m,) its time in a mount, and what it costs: the whole time, or the criterion in ``time``."""
    length, cost = np.full((2, merit.shape[1]), math.inf)
    for j in range(merit.shape[1]):
        k = np.flatnonzero(np.isfinite(merit[:, j]))
        if k.size < 2:
            continue
        x, m, t = (np.log(v) for v in (lengths[k], merit[k, j], total[k, j]))
        if time is not None:
            length[j] = math.exp(np.interp(math.log(time), t, x))
            cost[j] = math.exp(np.interp(math.log(time), t, m)) if t[0] <= math.log(time) <= t[-1] else math.inf
            continue
        falling = np.minimum.accumulate(m)
        if falling[-1] > 0.0:
            continue
        if falling[0] <= 0.0:
            length[j], cost[j] = lengths[k[0]], math.exp(t[0])
            continue
        at = float(np.interp(0.0, falling[::-1], x[::-1]))
        length[j], cost[j] = math.exp(at), math.exp(np.interp(at, x, t))
    return length, cost
