"""Record of a capture -> time to null, overshoot, largest rate; without value where the table does not come to rest."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_toolkit import ARCSEC, Account, Array, LoopReduction, ReductionError, told, trace

SERVO = 2.0  # phase of the plan
LATE = 0.2  # share of the servo phase that must be at null
NEAR = 60.0 * ARCSEC  # from here on the angle is drawn in arcsec


class Reduction(LoopReduction):
    """Servo mode from an offset of the float, capture law and fine loop."""

    slot = "sequencer"
    linearized = False

    def measure(self) -> Account:
        found, options, channels = self.found, self.run.options, self.record.channels
        inside = channels["sequencer.phase"] == SERVO
        if np.count_nonzero(inside) < 2:
            raise ReductionError("the run ended before servo mode began")
        t = channels["time"][inside] - channels["time"][inside][0]
        ratio = float(options["C"]) / float(options["H"])  # of the table angle to the float angle
        angle, rate = ratio * channels["gyro.b"][inside], channels["table.omega[1]"][inside]
        fine, limited = channels["table.in_position"][inside] > 0.5, channels["table.saturated"][inside] > 0.5
        limit, null, u = float(options["limit"]), float(options["null"]), float(t[1] - t[0]) / math.sqrt(12.0)
        self.reason = why = _unsettled(t, angle, fine, limited, null)
        outside = np.flatnonzero(np.abs(angle) > null)
        reached = float(t[outside[-1] + 1]) if outside.size and outside[-1] + 1 < t.size else None
        closed, none = (float(t[np.argmax(fine)]), "") if fine.any() else (None, "the fine loop is not closed")
        found.measure("t_fine", "time until the fine loop is closed", "s", closed, u, no_value=none)
        meaning = f"time to null, within {plain(null / ARCSEC, 3)}″"
        found.measure("t_null", meaning, "s", reached, u, unsettled=why, limit=(None, limit))
        past, u_past = _peak(-angle * np.sign(angle[0]))
        meaning = "largest table angle beyond null"
        found.measure("overshoot", meaning, "″", max(0.0, past), u_past, scale=ARCSEC, unsettled=why)
        w_max, u_max = map(math.degrees, _peak(np.abs(rate)))
        found.measure("w_max", "largest rate of the table", "°/s", w_max, u_max, unsettled=why)
        shown = t <= (2.0 * reached if reached is not None else t[-1])
        self._draw("table angle", t[shown], angle[shown], "angle from null", "°")
        self._draw("table rate", t[shown], rate[shown], "table rate", "°/s")
        near = shown & (t >= t[np.argmax(np.abs(angle) < NEAR)])
        if reached is not None and np.count_nonzero(near) > 1:
            self._draw("near null", t[near], angle[near], "angle near null", "″")
        return Account(
            method="Servo mode from an offset of the float, capture law and fine loop",
            sources=["CTRL-CAPTURE; Hu 1981, sections 5.5 (one-1), 6.1 (item 6)"],
            equation='M = -k_d (w + "sign"(e) (sqrt(2 a abs(e)) - k e_l))'
            if options.get("law") == "time-optimal"
            else 'M = "clip"(-k_p u, plus.minus k_d v_"lim") - k_d w',
            conventions=[
                "Angles are those of the table against the gyro, the float angle times C/H. Time counts from servo "
                "mode on. The figures are of this run; u: sampling of the record and communication step.",
                f"Requirement: null within {limit:g} s, and there to stay.",
            ],
        )

    def summary(self) -> list[str]:
        return [f"No value: {self.reason}."] if self.reason else told(
            self.found.coefficients,
            "The table is at null after {t_null}; the fine loop is closed after {t_fine}.",
            "On the way the rate reaches {w_max}; it overshoots by {overshoot}.",
        )  # fmt: skip

    def _draw(self, name: str, t: Array, y: Array, y_name: str, unit: str) -> None:
        caption = f"{y_name[:1].upper()}{y_name[1:]}; servo mode begins at t = 0."
        y = y / ARCSEC if unit == "″" else np.degrees(y)
        self.found.responses.append(trace(f"capture, {name}", caption, t, y, y_name, unit))


def _peak(y: Array) -> tuple[float, float]:
    """Return the largest sample and its u: between samples near it, a plateau and its ends included, a parabola through
    three neighbours is higher by at most an eighth of their second difference.
    """
    top = float(np.max(y))
    bend = np.abs(np.diff(y, 2))[y[1:-1] > 0.99 * top]
    return top, float(np.max(bend, initial=0.0)) / 8.0 / math.sqrt(3.0)


def _unsettled(t: Array, angle: Array, fine: NDArray[np.bool_], limited: NDArray[np.bool_], null: float) -> str:
    """Return why the table has not come to null, "" where it has."""
    late = t > (1.0 - LATE) * float(t[-1])
    worst = float(np.max(np.abs(angle[late])))
    largest = math.degrees(worst)
    if not fine.any():
        return f"the capture does not end: after {plain(t[-1], 3)} s the table is {plain(largest, 3)}° from null"
    if worst <= null:
        return ""
    share = 100.0 * float(np.mean(limited[late]))
    if share > 10.0:
        return (
            f"the loop does not settle: at the end it swings by {plain(largest, 3)}°, with the motor at its limit for "
            f"{share:.0f} % of the time, which lowers the gain of a conditionally stable loop below its lower limit"
        )
    return f"the table does not stay at null: at the end it is up to {plain(largest * 3600.0, 3)}″ away"
