"""What an estimator costs and saves in the loop: effort of the motor, delay, error under a disturbed reading."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.reduction.loops.estimator_metrics import UncertainValue, rms
from gyrobench.reduction.loops.loop_measures import Gate, Point, phasor, segment_phasors
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.open_loop import open_loop_point
from gyrobench.units import ARCSEC

from .contest import BENDING, GAP_PERIOD, LINE, RIDES, WILD_PERIOD

ANGLE, VOLTAGE = "platform.attitude", "stabilizer.v"
ROUNDING = 1e-9  # degrees: no more than the rounding of a response
PERIODS = {RIDES["gaps"]: GAP_PERIOD, RIDES["wild"]: WILD_PERIOD}
#: coefficient -> what the smallest is the choice for
PURPOSES = {
    "motor voltage": "For a motor that must stay cool and quiet",
    "line voltage": "Where the reading carries a vibration line",
    "bending gain": "Where the structure bends",
    "error, more noise": "Where the noise grows in the run",
    "error, gaps": "Where readings are missing",
    "peak voltage, wild readings": "Where readings are wild",
    "error, aided": "Where an angle reference aids the platform",
}


def jitter(y: Array, n: int) -> Array:
    """Return y less its running mean over n samples, without the ends: the gyro's wander is no error of the loop."""
    slow = np.convolve(y, np.full(n, 1.0 / n), "valid")
    first = (n - 1) // 2
    return np.asarray(y[first : first + slow.size] - slow)


def level(y: Array, stretches: int = 10) -> UncertainValue:
    """Return the rms of a ride by a sine, with noise; u from the scatter of the mean squares of ten stretches."""
    squares = [float(np.mean(part * part)) for part in np.array_split(y, stretches)]
    whole = math.sqrt(float(np.mean(y * y)))
    u = float(np.std(squares, ddof=1)) / math.sqrt(stretches) / (2.0 * whole) if whole else 0.0
    return UncertainValue(whole, u, stretches - 1)


def period(ride: Gate) -> float:
    """Return the time between two samples, s."""
    return float(ride.t[1] - ride.t[0])


def effort(found: LoopFindings, ride: Gate) -> None:
    """Add what the motor has to do in the ride: voltage, its part faster than the loop, time at a limit."""
    size = level if ride.f else rms  # a recorded motion is random
    v = ride[VOLTAGE]
    total = size(v - v.mean())
    found.measure("motor voltage", "voltage of the motor in the ride, rms about its mean", "V", *total.pair)
    crossover = float(found.record.run.options["crossover"])
    fast = size(jitter(v, max(2, round(1.0 / (crossover * period(ride))))))
    meaning = "the same about the running mean over one period of the crossover asked for"
    found.measure("voltage ripple", meaning, "V", *fast.pair)
    flags = [ride[n] for n in ("platform.saturated", "stabilizer.saturated") if n in ride.channels]
    limited = np.any(np.array([np.zeros(v.size), *flags]) > 0.5, axis=0)
    shares = [float(part.mean()) for part in np.array_split(limited, 10)]
    found.measure("time at a limit", "share of the ride in which motor or stabilizer is at a limit", "%",
                  100.0 * float(limited.mean()), 100.0 * float(np.std(shares, ddof=1)) / math.sqrt(10.0))  # fmt: skip


def lag(found: LoopFindings, points: list[Point]) -> None:
    """Add the phase that the estimator takes from the loop at its crossover, from its response at the test sines."""
    crossover = found.estimates.get("f_c")
    points = sorted(points, key=lambda p: p.f)
    if crossover is None or not points or not points[0].f <= crossover <= points[-1].f:
        return
    f = np.log([p.f for p in points])
    phase = np.degrees(np.unwrap(np.angle([p.value for p in points])))
    near = [p.u or 0.0 for p in points if abs(math.log(p.f / crossover)) <= math.log(2.0)]
    taken, u = -float(np.interp(math.log(crossover), f, phase)), math.degrees(max(near, default=0.0))
    if max(abs(taken), u) < ROUNDING:  # an estimator that hands the reading on
        taken = u = 0.0
    found.measure("lag", "phase that the estimator takes at the crossover", "°", taken, u)


def bending(found: LoopFindings) -> None:
    """Add the largest gain of the open loop at the sines about the bending mode."""
    gates = [g for g in found.of("test", 1, "sine") if g.label.startswith(BENDING)]
    points = [open_loop_point(g, "stabilizer.e", "exciter.test[1]")[0] for g in gates]
    if not points:
        return
    peak = max(points, key=lambda p: abs(p.value))
    found.measure("bending gain", "largest gain of the open loop about the bending mode: 1 and more may be unstable",
                  "1", abs(peak.value), abs(peak.value) * (peak.u or 0.0))  # fmt: skip


def disturbed(found: LoopFindings) -> None:
    """Add the errors of the rides with a disturbed reading, and what a line does to the motor."""
    for ride in found.of("motion", 1, "sine"):
        if ride.label == RIDES["line"]:
            size = abs(phasor(ride.t, ride[VOLTAGE], LINE))
            (parts,) = segment_phasors(ride.t, LINE, ride[VOLTAGE])
            u = float(np.std(np.abs(parts), ddof=1)) / math.sqrt(parts.size)
            found.measure("line voltage", "amplitude of the line in the voltage of the motor", "V", size, u)
        elif ride.label == RIDES["aided"]:
            off = level(ride["reference.off"])
            meaning = "angle from the direction of the reference in the ride with one, rms: the wander counts"
            found.measure("error, aided", meaning, "″", *off.pair, scale=ARCSEC)
        elif ride.label in RIDES.values():
            what = ride.label.removeprefix("ride, ")
            error = level(jitter(ride[ANGLE], round(2.0 / ride.f / period(ride))))
            meaning = f"platform error in the ride with {what} in the reading"
            found.measure(f"error, {what}", meaning, "″", *error.pair, scale=ARCSEC)
            if every := PERIODS.get(ride.label):
                peak = peaks(ride.t, ride[VOLTAGE], every)
                meaning = f"largest voltage of the motor from one of the {what} to the next, mean"
                found.measure(f"peak voltage, {what}", meaning, "V", *peak.pair)


def peaks(t: Array, v: Array, every: float) -> UncertainValue:
    """Return the mean of the largest |v| in each whole period of ``every`` s, which are those of multiples of it."""
    number = np.floor(t / every + 1e-9).astype(int)
    whole = range(number[0] + 1, number[-1])
    largest = np.array([np.max(np.abs(v[number == k])) for k in whole])
    return UncertainValue(float(largest.mean()), float(largest.std(ddof=1)) / math.sqrt(largest.size), largest.size - 1)
