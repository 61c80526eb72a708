"""Record of a platform that follows the Earth -> its drift against level and north, beside the budget.

[PLATFORM-FOLLOWING; GSP ch. 5, section 5.2.1]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_toolkit import ARCMIN, DPH, Account, Gate, LoopReduction, Table, drift, over_time
from gyrobench.reduction.loops.slow_drift import slow_drift
from gyrobench.units import display

from .closed import MovingPlace, SourceOfDrift, budget, led
from .size import size_of

#: what measures about x, y, z of the platform: the gyro, the row of its mount, its channel
ROWS = (("gyro_b", 1, "y"), ("gyro_a", 0, "x"), ("gyro_a", 1, "y"))
UNITS = {"rad": (ARCMIN, "′"), "rad/s": (DPH, "°/h")}
NAMES = ("east", "north", "up")
HOUR = 3600.0  # s


class Reduction(LoopReduction):
    """Drift of the platform against level and north, its budget, and where it leads."""

    linearized = False
    ranked_by = "drift"

    def measure(self) -> Account:
        o = self.run.options
        self.place = MovingPlace(*(float(o[n]) for n in ("latitude", "height", "east", "north")))
        u = {n: float(o[f"u_{n}"]) for n in ("mounting", "torquer", "drift", "latitude", "velocity")}
        self.lines = budget(self.place, u, float(o["quantum"]))
        for gate in self.found.gates:
            self._follow(gate)
        return Account(
            method="Drift of a platform that is turned with level and north by the torquers of its gyros",
            sources=["PLATFORM-FOLLOWING; GSP ch. 5, section 5.2.1 (no equations there)"],
            equation="bold(omega) = (-v_N/(M+h), Omega cos L + v_E/(N+h), Omega sin L + v_E/(N+h) tan L), quad "
            "dot(bold(e)) = bold(delta) - bold(omega) times bold(e)",
            conventions=[
                "Platform axes x east, y north, z up; e: small rotation of the platform against them.",
                "Drift δ: inertial rate of the platform in its axes less the rate of level and north in theirs.",
                "u of the drift: noise, and what slow drift of the gyros (turn-on, Gauss-Markov, flicker, random walk) "
                "moves its mean over the record away from the constant drift.",
                "After an hour: e with δ constant, by its closed solution; nothing brings the platform back.",
            ],
        )

    def _follow(self, gate: Gate) -> None:
        found = self.found
        apart = [gate[f"platform.attitude[{k}]"] - gate[f"follower.turned[{k}]"] for k in (1, 2, 3)]
        truth = self._truth(gate)
        delta = np.zeros(3)
        spread = np.zeros(3)
        for k, axis in enumerate("xyz"):
            got = drift(gate.t, apart[k])
            gyro, _, channel = ROWS[k]
            slow = slow_drift(self.run.parameters, gyro, f"_{channel}", gate.t)
            delta[k], spread[k] = got.rate, math.hypot(got.u, slow)
            told = None if truth is None else float(truth[k])
            found.measure(f"drift {axis}", f"against {NAMES[k]}", "°/h", got.rate, spread[k], scale=DPH, truth=told)
        total = None if truth is None else float(np.linalg.norm(truth))
        meaning = "of the platform against level and north, size"
        self._size("drift", meaning, "°/h", delta, np.diag(spread**2), scale=DPH, truth=total)
        rate = self.place.rate()
        leads = np.column_stack([led(axis, rate, HOUR) for axis in np.eye(3)])  # e after an hour, of a unit drift
        hour, cov = leads @ delta, leads @ np.diag(spread**2) @ leads.T
        then = None if truth is None else leads @ truth
        true = None if then is None else math.hypot(then[0], then[1])
        self._size("tilt 1 h", "tilt error after an hour", "′", hour[:2], cov[:2, :2], scale=ARCMIN, truth=true)
        true = None if then is None else float(then[2])
        u = math.sqrt(cov[2, 2])
        found.measure("heading 1 h", "heading error after an hour", "′", float(hour[2]), u, scale=ARCMIN, truth=true)
        found.tables.append(self._budget(delta))
        curves = {f"{axis}": (a - a[0]) / ARCMIN for axis, a in zip("xyz", apart, strict=True)}
        caption = "Platform less level and north: what it has turned too far about its axes."
        found.responses.append(over_time("platform error", gate.t, curves, caption=caption, unit="′"))

    def _size(self, name: str, meaning: str, unit: str, x: Any, cov: Any, *, scale: float, truth: float | None) -> None:
        """Measure the size of a vector with covariance cov, SI; scale: SI per printed unit."""
        u, ends = size_of(x, cov)
        interval = ends[0] / scale, ends[1] / scale
        size = float(np.linalg.norm(x))
        self.found.measure(name, meaning, unit, size, u, scale=scale, truth=truth, interval=interval)

    def _truth(self, gate: Gate) -> Any:
        """Return what the simulated errors make of it: R w = (1 + e) w_believed + d, exact; None of other parts."""
        p = self.run.parameters
        if any(f"{g}.mount" not in p for g in ("gyro_a", "gyro_b")) or "follower.velocity" not in p:
            return None
        if any(".k_" in name for name in self.run.changed):
            return None  # a torquer set by hand is as it is
        rows = np.array([np.asarray(p[f"{gyro}.mount"], float)[row] for gyro, row, _ in ROWS])
        middle = 0.5 * float(gate.t[0] + gate.t[-1])
        ramps = np.array([float(p.get(f"{gyro}.ramp_{channel}", 0.0)) for gyro, _, channel in ROWS])
        drifts = np.array([_static(p, gyro, channel) for gyro, _, channel in ROWS]) + ramps * middle
        rate = np.array([float(np.mean(gate[f"follower.rate[{k}]"])) for k in (1, 2, 3)])
        off = np.asarray(p["follower.velocity_error"], float)
        east, north = self.place.by_velocity()
        believed = (
            rate + self.place.by_latitude() * float(p["follower.latitude_error"]) + east * off[0] + north * off[1]
        )
        scale = 1.0 + float(self.run.options["torquer"])
        return np.linalg.solve(rows, scale * believed + drifts) - rate

    def _budget(self, delta: Any) -> Table:
        rows = [self._row(line) for line in self.lines]
        total = np.sqrt(sum(line.drift**2 for line in self.lines))
        rows.append(["root sum of squares", None, "", *(float(x) / DPH for x in total)])
        rows.append(["measured", None, "", *(float(x) / DPH for x in delta)])
        caption = "One standard uncertainty of each source, and the drift that it makes about the axes of the platform"
        columns = ["source", "u", "unit", "x / (°/h)", "y / (°/h)", "z / (°/h)"]
        return Table("following.budget", "Budget of the drift", f"{caption}.", columns, rows)

    @staticmethod
    def _row(line: SourceOfDrift) -> list[Any]:
        scale, unit = UNITS.get(line.unit, (1.0, display(line.unit)))
        return [line.source, line.size / scale, unit, *(float(x) / DPH for x in line.drift)]

    def summary(self) -> list[str]:
        total = math.sqrt(sum(float(line.drift @ line.drift) for line in self.lines)) / DPH
        c = {c.name: c for c in self.found.coefficients}
        drift_, tilt, heading = (c[n].estimate for n in ("drift", "tilt 1 h", "heading 1 h"))
        return [
            f"The platform drifts against level and north by {plain(drift_, 3)} °/h; the budget allows for "
            f"{plain(total, 3)} °/h.",
            f"After an hour it would be {plain(tilt, 3)}′ off level and {plain(abs(heading), 3)}′ off north.",
        ]


def _static(p: Mapping[str, Any], gyro: str, channel: str) -> float:
    """Return the static drift of a channel on a level platform, rad/s: X, Y, Z are those of the vertical."""
    x, y, z = -np.asarray(p[f"{gyro}.mount"], float)[:, 2]
    products = {
        "0": 1.0,
        "x": x,
        "y": y,
        "z": z,
        "xx": x * x,
        "yy": y * y,
        "zz": z * z,
        "xy": x * y,
        "yz": y * z,
        "xz": x * z,
    }
    return float(sum(float(p.get(f"{gyro}.D{channel}_{n}", 0.0)) * value for n, value in products.items()))
