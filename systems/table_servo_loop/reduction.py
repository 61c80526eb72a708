"""Record of a servo table -> stiffness, margins, compliance and torque of the slip rings.  [TABLE-SERVO]"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_drift import Drift, drift
from gyrobench.reduction.loops.loop_toolkit import Account, Array, Gate, LoopReduction, Point, Table, margins, told
from gyrobench.reduction.loops.margins import measured_values
from gyrobench.reduction.loops.platform_measures import lower_limit
from gyrobench.units import ARCSEC

from .closed import GCM, ServoLoop, loop_of, sense_torque

ANGLE, TORQUE, COMMAND, RATE = "table.angle", "exciter.torque[1]", "exciter.command[1]", "table.omega[1]"
ERROR = "gyro.rate_error"  # rate that the float integrates: command less table rate
WIDE = 1e-4  # m: a gap above it is rather one given in another unit
BLOCKS = 20  # of a phase, for the uncertainty of a mean
NO_CLOSED = "No closed forms: they are those of the networks 1 to 4 of table_servo."
NO_SHAPER = (
    "The motor has no root shaper: its gain vanishes at null, so the stiffness depends on the torque and the linear "
    "models do not hold. Set shaper=true."
)


class Reduction(LoopReduction):
    """Hung torques, sines of rate through the torquer of the gyro, sines of torque, turning both ways."""

    by_neighbours = True

    def __init__(self, record: Record) -> None:
        if COMMAND in record.channels and RATE in record.channels:
            error = record.channels[COMMAND] - record.channels[RATE]
            record = replace(record, channels={**record.channels, ERROR: error})
        super().__init__(record)
        self.loop, self.shaper = loop_of(self.run.parameters), bool(self.run.options.get("shaper", True))
        self.damped = int(self.run.options.get("network", 2)) in (1, 2)
        self.hold = self.found.at_rest

    def measure(self) -> Account:
        found = self.found
        found.warn("table_servo.no_closed", NO_CLOSED if self.loop is None else "")
        found.warn("table_servo.no_shaper", "" if self.shaper else NO_SHAPER)
        own = drift(self.hold.t, self.hold[ANGLE]) if self.hold is not None else None
        if self.shaper:
            self._hung(own or Drift(0.0, 0.0, None, None))
            self._limits(found.open_loop("stabilizer", ERROR, COMMAND, kind="command"))
        else:
            self._square_law()
        self._compliance()
        for name in ("gap", "thrust_gap"):
            gap = float(self.run.parameters.get(f"bearing.air_{name}", 0.0))
            text = f"bearing.air_{name} = {gap * 1e6:g} µm is wide for an air bearing (10 to 25 µm). Check its unit."
            found.warn("bearing.wide", text if gap > WIDE else "")
        turns = found.of("command", 1, "step")
        if len(turns) == 2 and self.loop is not None and self.shaper:
            self._rings(turns, self.loop)
        return Account(
            method="Hung torques, sines of rate through the torquer of the gyro, sines of torque, turning both ways",
            sources=[
                "TABLE-SERVO, MOTOR-SQUARELAW, SLIPRING-FOLLOWER; Hu 1981, eq. 5-7..5-21, 5-35, corrected by ET1..ET6"
            ],
            equation='L(s) = (G K_g H C(s)) / (s [(J s + D)(J_g s + c) + H^2] (1 + "lag" s)), quad K_T = G K_g H / c',
            conventions=[
                "θ: inertial angle of the table, positive like the torque M that turns it by M/K_T. A constant torque "
                "gives no rate error, a change ΔM within T the error ΔM/(K_T T).",
                "Loop gain L = −(signal that comes back) / (signal put in): rate of the table over command less rate.",
                "A lower gain limit below 1: the loop becomes unstable when its gain falls to this share.",
            ],
        )

    def summary(self) -> list[str]:
        undamped = "Under a constant torque the table returns to its angle; the float holds the torque with {b(M)}."
        return [
            *margins(self.found),
            *told(
                self.found.coefficients,
                "Static stiffness {K_T}.",
                "The hung torque turns the table by {θ(M)}." if self.shaper else "The hung torque turns the float by "
                "{b(M)}.",
                "" if self.damped or not self.shaper else undamped,
                "Bearing and slip rings put {M_r} on the turning table.",
            ),
        ]  # fmt: skip

    def _hung(self, own: Drift) -> None:
        """Measure the angle under each hung torque, and the stiffness by least squares through all of them."""
        found, loop, damped = self.found, self.loop, self.damped
        rows: list[list[Any]] = []
        moved: list[tuple[float, float, float]] = []
        unsettled = ""
        for gate in found.of("torque", 1, "step"):
            step = found.step(gate, ANGLE, scale=ARCSEC, unit="″", y_name="table angle", drift=own.rate,
                              quiet=self.hold)  # fmt: skip
            u = math.hypot(step.u_change, own.u * gate.row.dwell)  # of the rate taken off
            closed = 0.0 if not damped else None if loop is None else loop.at_rest(gate.amplitude)
            why = step.unsettled if damped else ""
            unsettled = unsettled or why
            moved.append((gate.amplitude, step.change, u))
            shown = None if closed is None else closed / ARCSEC
            rows.append([gate.amplitude / GCM, step.change / ARCSEC, u / ARCSEC, shown])
            if gate.label == "torque 1 M":
                meaning = f"table angle under {plain(gate.amplitude, 4)} N·m"
                found.measure("θ(M)", meaning, "″", step.change, u, scale=ARCSEC, closed=closed, unsettled=why)
                self._float(gate)
        if not moved:
            return
        caption = "Change of the inertial table angle; u: noise of the loop and of the drift rate taken off."
        columns = ["torque / (g·cm)", "angle / ″", "u / ″", "closed form / ″"]
        found.tables.append(Table("torques.hung", "Hung torques", caption, columns, rows))
        if not damped:
            why = "an undamped gyro integrates: the static table angle is 0"
            found.measure("K_T", "static stiffness", "N·m/rad", None, no_value=why)
            return
        slope, relative = _slope(*(np.array(x) for x in zip(*moved, strict=True)))
        found.measure("K_T", "static stiffness of the servo", "N·m/rad", 1.0 / slope, relative / abs(slope),
                      closed=None if loop is None else loop.stiffness, unsettled=unsettled)  # fmt: skip

    def _float(self, gate: Gate) -> None:
        step = self.found.step(gate, "gyro.b", scale=ARCSEC, unit="″", y_name="float angle", quiet=self.hold)
        closed = None if self.loop is None else gate.amplitude / (self.loop.gain * self.loop.K_g)
        self.found.measure("b(M)", f"float angle under {plain(gate.amplitude, 4)} N·m", "″", step.change, step.u_change,
                           scale=ARCSEC, closed=closed, unsettled=step.unsettled)  # fmt: skip

    def _square_law(self) -> None:
        """Measure the float angle under the hung torque to either side: at null the motor has no gain, a rest there
        means nothing.
        """
        ends, loop = {}, self.loop
        for gate in self.found.of("torque", 1, "step"):
            ends[gate.label] = gate.amplitude, *_mean(gate["gyro.b"][-gate.t.size // 5 :], 1)
            self.found.step(gate, "gyro.b", scale=ARCSEC, unit="″", y_name="float angle")
        forth, back = ends.get("torque 1 M"), ends.get("torque −1 M")
        if forth is None or back is None:
            return
        closed = None if loop is None else math.sqrt(abs(forth[0]) * loop.torque_max) / (loop.gain * loop.K_g)
        self.found.measure("b(M)", f"float angle under {plain(forth[0], 4)} N·m, without root shaper", "″",
                           0.5 * (forth[1] - back[1]), 0.5 * math.hypot(forth[2], back[2]), scale=ARCSEC,
                           closed=closed)  # fmt: skip

    def _limits(self, points: list[Point]) -> None:
        """Measure the lower gain limit, and show all limits of the closed form."""
        found, loop = self.found, self.loop
        if loop is None:
            return
        model = found.margins.get("stabilizer", {}).get("discrete", [None] * 6)
        values = measured_values(points, found.excluded.get("stabilizer", [])) if points else {}
        if model[4] is not None:
            lower_limit(found, values, 10.0 ** (model[4] / 20.0), model[5])
        rows = [
            [f, g, 20.0 * math.log10(g), "yes" if float(loop.poles(1.05 * g).real.max()) > 0.0 else "no"]
            for f, g in loop.limits()
        ]
        caption = (
            f"All phase crossovers of L (python-control); phase margin {plain(loop.phase_margin(), 3)}° at "
            f"{plain(loop.w_c / (2.0 * math.pi), 4)} Hz. A loop with a factor below 1 is conditionally stable."
        )
        columns = ["phase crossover / Hz", "factor on the gain", "factor / dB", "unstable 5 % above it"]
        found.tables.append(Table("loop.limits", "Gain limits of the closed form", caption, columns, rows))
        resonance = loop.H / math.sqrt(loop.J * loop.J_g)
        if loop.network in (3, 4) and loop.w_c < 2.0 * resonance:
            text = (
                "The crossover is below twice the resonance of table and float, "
                f"{plain(resonance / (2.0 * math.pi), 3)} Hz: the loop is poorly damped. Raise the crossover."
            )
            found.warn("loop.poorly_damped", text)

    def _compliance(self) -> None:
        """Measure the table angle per torque over frequency."""
        found = self.found
        points = found.ratio(
            "compliance", "torque", 1, ANGLE, TORQUE, scale=ARCSEC, unit="″/(N·m)",
            caption="Table angle over disturbance torque. Points: measured; line: linear model.",
        )  # fmt: skip
        if not points:
            return
        worst = max(points, key=lambda q: abs(q.value))
        model = found.excited("discrete", "torque", 1, ANGLE, [worst.f])  # with step, delays and the leads of the rings
        closed = None
        if model is not None:
            closed = abs(complex(model[0]))
        elif self.loop is not None and self.shaper:
            closed = abs(self.loop.compliance(2j * math.pi * worst.f))
        meaning = f"table angle per torque at {plain(worst.f, 4)} Hz, the largest measured"
        size = abs(worst.value)
        found.measure("compliance", meaning, "″/(N·m)", size, size * (worst.u or 0.0), scale=ARCSEC, closed=closed)

    def _rings(self, turns: list[Gate], loop: ServoLoop) -> None:
        """Measure the torque of the slip rings: half the difference of what the motor gives while the table turns forth
        and back.
        """
        p = self.run.parameters
        K_s, k_w = float(p.get("rings.ring_K_s", math.inf)), float(p.get("rings.ring_k_w", 0.0))
        if p.get("rings.ring_follower") and K_s < 9.0 * k_w:
            text = (
                f"The follower is soft: K_s = {K_s:g} N·m/rad is below 9 k_w = {9.0 * k_w:g}, so more than a tenth of "
                "the friction of the slip rings reaches the table. Raise rings.ring_K_s or take softer leads."
            )
            self.found.warn("rings.soft", text)
        # the load torque that the motor balances, G u, in the last three quarters of a phase
        forth, back = (_mean(loop.gain * g["gyro.u"][g.t.size // 4 :], BLOCKS) for g in turns)
        meaning = "torque on the table that changes with the sense of rotation"
        u, closed = 0.5 * math.hypot(forth[1], back[1]), sense_torque(p, abs(turns[0].amplitude))
        self.found.measure("M_r", meaning, "N·m", 0.5 * (back[0] - forth[0]), u, closed=closed)


def _slope(M: Array, theta: Array, sigma: Array) -> tuple[float, float]:
    """Return the slope of angles over torques and its relative u, which their scatter may widen."""
    weight = float(np.sum((M / sigma) ** 2)) if np.all(sigma > 0.0) else 0.0
    slope = float(np.sum(M * theta / sigma**2)) / weight if weight else float(np.sum(M * theta) / np.sum(M * M))
    chi = float(np.sum(((theta - slope * M) / sigma) ** 2)) / (M.size - 1) if weight and M.size > 1 else 1.0
    return slope, math.sqrt(max(1.0, chi) / weight) / abs(slope) if weight else 0.0


def _mean(y: Array, independent: int) -> tuple[float, float]:
    """Return a mean and its u from the scatter of BLOCKS blocks, of which so many are independent."""
    blocks = np.array([b.mean() for b in np.array_split(y, BLOCKS)])
    return float(y.mean()), float(np.std(blocks, ddof=1) / math.sqrt(independent))
