"""Record of a capture -> time to null, overshoot, largest rate; without value where the table does not come to rest."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import LinearModels
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import told
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import LoopResult, Response, Specification
from gyrobench.units import ARCSEC

SERVO = 2.0  # phase of the plan
LATE = 0.2  # share of the servo phase that must be at null
SHOWN = 600  # points of a figure
NEAR = 60.0 * ARCSEC  # from here on the angle is drawn in arcsec


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The Result.  Raises ReductionError for a record that ends before servo mode."""
    run, channels = record.run, record.channels
    run.linear = run.linear or LinearModels()  # there is no linear model of a capture
    found = LoopFindings(record, slot="sequencer")
    inside = channels["sequencer.phase"] == SERVO
    if np.count_nonzero(inside) < 2:
        raise ReductionError("the run ended before servo mode began")
    t = channels["time"][inside] - channels["time"][inside][0]
    ratio = float(run.options["C"]) / float(run.options["H"])  # of the table angle to the float angle
    angle, rate = ratio * channels["gyro.b"][inside], channels["table.omega[1]"][inside]
    fine, limited = channels["table.in_position"][inside] > 0.5, channels["table.saturated"][inside] > 0.5
    limit, null, dt = float(run.options["limit"]), float(run.options["null"]), float(t[1] - t[0])
    reason = _unsettled(t, angle, fine, limited, null)
    u = dt / math.sqrt(12.0)
    switched = float(t[np.argmax(fine)]) if fine.any() else None
    outside = np.flatnonzero(np.abs(angle) > null)
    reached = float(t[outside[-1] + 1]) if outside.size and outside[-1] + 1 < t.size else None
    found.measure("t_fine", "time until the fine loop is closed", "s", switched, u,
                  no_value="" if switched is not None else "the fine loop is not closed")  # fmt: skip
    found.measure("t_null", f"time to null, within {null / ARCSEC:.3g}″", "s", reached, u,
                  limits={"t_null": (None, limit)}, unsettled=reason)  # fmt: skip
    past, u_past = _peak(-angle * np.sign(angle[0]))
    found.measure("overshoot", "largest table angle beyond null", "″", max(0.0, past) / ARCSEC, u_past / ARCSEC,
                  unsettled=reason)  # fmt: skip
    fastest, u_fastest = _peak(np.abs(rate))
    found.measure("w_max", "largest rate of the table", "°/s", math.degrees(fastest), math.degrees(u_fastest),
                  unsettled=reason)  # fmt: skip
    shown = t <= (2.0 * reached if reached is not None else t[-1])
    found.responses += [
        _figure("capture, table angle", t[shown], np.degrees(angle[shown]), "angle from null", "°"),
        _figure("capture, table rate", t[shown], np.degrees(rate[shown]), "table rate", "°/s"),
    ]
    near = shown & (t >= t[np.argmax(np.abs(angle) < NEAR)])
    if reached is not None and np.count_nonzero(near) > 1:
        found.responses.append(_figure("capture, near null", t[near], angle[near] / ARCSEC, "angle near null", "″"))
    result = found.result(
        title="Capture of a servo table",
        method="Servo mode from an offset of the float, capture law and fine loop",
        sources=["CTRL-CAPTURE; Hu 1981, sections 5.5 (one-1), 6.1 (item 6)"],
        equation='M = "clip"(-k_p u, plus.minus k_d v_"lim") - k_d w',
        conventions=[
            "Angles are those of the table against the gyro, the float angle times C/H. Time counts from servo mode "
            "on. The figures are of this run; u: sampling of the record and communication step.",
            f"Requirement: null within {limit:g} s, and there to stay.",
        ],
        specification=specification,
    )
    result.summary = [f"No value: {reason}."] if reason else told(
        found.coefficients,
        "The table is at null after {t_null}; the fine loop is closed after {t_fine}.",
        "On the way the rate reaches {w_max}; it overshoots by {overshoot}.",
    )  # fmt: skip
    return result


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
    largest = math.degrees(float(np.max(np.abs(angle[late]))))
    if not fine.any():
        return f"the capture does not end: after {t[-1]:.3g} s the table is {largest:.3g}° from null"
    if float(np.max(np.abs(angle[late]))) <= null:
        return ""
    share = 100.0 * float(np.mean(limited[late]))
    if share > 10.0:
        return (
            f"the loop does not settle: at the end it swings by {largest:.3g}°, with the motor at its limit for "
            f"{share:.0f} % of the time, which lowers the gain of a conditionally stable loop below its lower limit"
        )
    return f"the table does not stay at null: at the end it is up to {largest * 3600.0:.3g}″ away"


def _figure(name: str, t: Array, y: Array, y_name: str, unit: str) -> Response:
    pick = np.unique(np.linspace(0, t.size - 1, min(SHOWN, t.size)).astype(int))
    return Response(
        name=name, kind="step", caption=f"{y_name[:1].upper()}{y_name[1:]}; servo mode begins at t = 0.",
        x=t[pick].tolist(), x_name="time", x_unit="s", y=y[pick].tolist(), y_name=y_name, y_unit=unit, curves=[],
    )  # fmt: skip
