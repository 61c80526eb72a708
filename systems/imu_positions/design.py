"""The test as choices of positions and of the share of turning, each with the time averaged in the positions.

The choices are compared by generalized least squares of all six instruments on the windows that the plan would have,
their noise known; the best few are run.  [IMU-POSITIONS]
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.design.choice_search import shortest
from gyrobench.design.option_protocol import Choice, OptionProtocol
from gyrobench.design.visit_protocol import GUARD, DataNoise, random_terms
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import System
from gyrobench.system.visits import format_time

from . import geometry, plans
from .budget import ImuSetup
from .channels import CHANNELS, ImuInstrument
from .geometry import TURN, Motion
from .hand import UNKNOWN

SHARES = (0.05, 0.15, 0.4, 1.0)  # of the time of turning against that in the positions
LEAST = 1.0  # s in a position
LONGEST = 1e6  # s
TRIED = 3  # choices that are run
DRIFT = tuple(f"{a}_{n}" for a in "xyz" for n in ("flicker", "walk"))


def protocol_of(system: System, record: Record) -> OptionProtocol:
    """Return numbers of positions and shares of turning; the length is the time averaged in the positions, s."""
    p = record.run.parameters
    noise = {c.name: noise_of(c, p) for c in CHANNELS}

    def covariances(fits: Sequence[Findings], record: Record) -> list[Array]:
        return [noise[_channel(f)].covariance(f.t_start, f.t_end) for f in fits]

    setup = ImuSetup.of(record.run)
    candidates = _Candidates(system, setup, noise)
    names = tuple(n for c in CHANNELS for n in candidates.names(c))
    unseen = [f"{n} is not in the noise model of the design" for n in random_terms(p, "accelerometers", DRIFT)]
    if system["attitudes"] == UNKNOWN:
        return OptionProtocol((candidates.own,), covariances, (), ("attitudes = unknown: of hands, not of a plan",))
    return OptionProtocol((candidates.own,), covariances, names, tuple(unseen), propose=candidates.proposals)


def noise_of(channel: ImuInstrument, parameters: Mapping[str, Any]) -> DataNoise:
    """Return the noise of an instrument, of the part imu or of accelerometers of their own."""
    kind, p = ("gyro" if channel.gyro else "acc"), parameters
    if not channel.gyro and "accelerometers.bias" in p:
        return DataNoise(float(p.get("accelerometers.white", p.get(f"accelerometers.white_{channel.letter}", 0.0))))
    name = f"imu.{channel.letter}_{kind}"
    tau = float(p.get(f"imu.{kind}_bias_tau", 1.0))
    return DataNoise(float(p.get(name, 0.0)), float(p.get(f"{name}_bias", 0.0)), tau)


def _channel(fit: Findings) -> str:
    """Return the name of the instrument of a fit, from its first coefficient: bg_x is of gx."""
    first = fit.quantities[0].name
    return first[1] + first[3]


@dataclass(frozen=True)
class _Candidates:
    """Plans of a system; see the module.  noise: by the name of the instrument."""

    system: System
    setup: ImuSetup
    noise: Mapping[str, DataNoise]

    @property
    def seen(self) -> tuple[int, ...]:
        """Axes about which the plan turns."""
        times = self.system.times()  # type: ignore[attr-defined]
        return tuple(k for k, a in enumerate("xyz") if times.rates and a in times.axes)

    def names(self, channel: ImuInstrument) -> list[str]:
        """Return the coefficients of an instrument that the plan shows."""
        return channel.names(self.seen if channel.gyro else (0, 1, 2))

    @property
    def own(self) -> Choice:
        """The system's own plan, longer or shorter."""
        s = self.system
        visits = s.visits()  # type: ignore[attr-defined]
        length = float(sum(v.dwell for v in visits))
        share = self._turning(int(s["turns"])) / length if self.seen else 0.0
        if s["visits"]:
            texts = [" ".join(f"{math.degrees(a):.10g}deg" for a in v.place) for v in visits]

            def visiting(total: float) -> Mapping[str, Any]:
                each = (f"{t} {format_time(v.dwell / length * total)}" for t, v in zip(texts, visits, strict=True))
                return {"visits": "; ".join(each), "turns": self._turns(share * total)}

            return Choice("the positions given", visiting, length, LEAST * len(visits))
        return self.choice(int(s["positions"]), share, length)

    def choice(self, count: int, share: float, start: float) -> Choice:
        turning = f", turning {share:.2g} of it" if self.seen else ""
        options = functools.partial(self.options, count, share)
        return Choice(f"{count} positions{turning}", options, start, LEAST * count)

    def options(self, count: int, share: float, length: float) -> dict[str, Any]:
        """Return the options of a plan that averages for ``length`` (s) in so many positions."""
        turns = {"turns": self._turns(share * length)} if self.seen else {}
        return {"positions": count, "dwell": format_time(length / count), **turns}

    def _turning(self, turns: int) -> float:
        """Return the time of so many turns in each sense about each axis, s."""
        return 2.0 * len(self.seen) * turns * TURN / float(self.system["rate"])

    def _turns(self, time: float) -> int:
        return min(max(1, round(time / self._turning(1))), 100) if self.seen else 0

    def proposals(self, wanted: Mapping[str, float], time: float | None, criterion: str) -> list[Choice]:
        """Return the few plans that reach what is wanted (SI) soonest, or are best in a given time (s), noise known."""
        ranked = []
        for count in geometry.POSITIONS:
            for share in SHARES if self.seen else (0.0,):
                length = self._length(count, share, wanted, time, criterion)
                if math.isfinite(length):
                    merit, end = self._judged(count, share, length, wanted, criterion)
                    ranked.append((end if time is None else merit, count, share, length))
        best = sorted(ranked)[:TRIED]
        return [self.choice(count, share, length) for _, count, share, length in best]

    def _length(
        self, count: int, share: float, wanted: Mapping[str, float], time: float | None, criterion: str
    ) -> float:
        """Return the length with which a plan reaches what is wanted, or takes the given time; inf where none does."""

        def enough(length: float) -> bool:
            merit, end = self._judged(count, share, length, wanted, criterion)
            return merit <= 1.0 if time is None else end >= time

        return shortest(enough, LEAST * count, LONGEST, 8)

    def _judged(
        self, count: int, share: float, length: float, wanted: Mapping[str, float], criterion: str
    ) -> tuple[float, float]:
        """Return the criterion of (u/wanted)^2 of a plan, inf where a value is not determined, and its end, s."""
        omega, force, t0, t1, rest = self._windows(self.options(count, share, length))
        squares = []
        for c in CHANNELS:
            names = self.names(c)
            asked = [names.index(n) for n in names if n in wanted]
            if not asked:
                continue
            rows = slice(None) if c.gyro else rest
            X = geometry.gyro_columns(omega, force, self.seen) if c.gyro else geometry.accelerometer_columns(force)
            Z = np.linalg.solve(np.linalg.cholesky(self.noise[c.name].covariance(t0[rows], t1[rows])), X[rows])
            size = np.linalg.norm(Z, axis=0)
            if np.linalg.matrix_rank(Z / size) < len(names):
                return math.inf, float(t1[-1])
            variance = np.diag(np.linalg.inv((Z / size).T @ (Z / size))) / size**2
            squares += [float(variance[k]) / wanted[names[k]] ** 2 for k in asked]
        return (max(squares) if criterion == "minimax" else sum(squares) / len(squares)), float(t1[-1])

    def _windows(self, options: Mapping[str, Any]) -> tuple[Array, Array, Array, Array, Any]:
        """Return rate and specific force (n, 3), start and end (n,) of the windows of a plan, and which are at rest."""
        planned = self.system.with_values(options).plan()
        assert isinstance(planned, Plan)
        t, at, speed = 0.0, np.zeros(2), np.zeros(2)
        rows: list[tuple[float, ...]] = []
        for phase in planned.phases:
            target, before = np.array([phase.target, phase.target_y]), speed
            if phase.mode == "index":
                t += plans.move_time(float(np.max(np.abs(target - at))))
                at, speed = target, np.zeros(2)
            else:
                speed = target
            t += phase.settle + GUARD + float(np.max(np.abs(speed - before))) / plans.ACCELERATION
            for _ in range(_count(phase)):
                after = at + speed * phase.window
                rows.append((t, t + phase.window, *at, *after))
                t, at = t + phase.window, after
        t0, t1, x0, y0, x1, y1 = np.array(rows).T
        motion = Motion((x0, x1), (y0, y1), t1 - t0)
        s = self.setup
        return *motion.felt(s.latitude, s.gravity, s.earth_rate), t0, t1, motion.at_rest


def _count(phase: Phase) -> int:
    return max(1, round(phase.dwell / phase.window))
