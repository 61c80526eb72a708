"""Validity of the run of a loop: poles of its linear model, and what the record shows at rest.

    reason = why_void(record.run.linear, gates)     # "" where the loop was stable and came to rest

A reason voids every measure of the run.  The linear model is that of the co-simulation, with the communication step and
the delays.  The record is asked in the drift holds, where nothing is excited, for what no linear model holds: growth
(parts without a linear model too), a limit cycle, a limit that is active at rest.

A run that has left an unstable start and come to rest elsewhere (a gimbal that turned over) keeps its figures.

Not modelled: an instability that only an excitation starts and that has died away again before a hold.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.frequency_response import poles, unstable
from gyrobench.record.run_document import LinearModels
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_measures import Gate

PARTS = 8  # of a hold
GROWTH = 10.0  # last eighth over first one; the rms of stationary noise does not change by that
LINE = 0.5  # share of the variance that one sine must explain in every eighth
EVEN = 0.2  # relative scatter of its amplitude: that of narrow-band noise is 0.52 (Rayleigh)
STEADY = 0.7  # length of the mean of its unit phasors; 1: the same phase throughout, about 0.35 for noise
PERIODS = 24  # in a hold, 3 in an eighth; slower is a drift
ROUNDING = 1e-9  # of a signal's largest value in the record: what is smaller at rest is rounding
AT_LIMIT = 0.1  # share of a hold with a limit active
UNDAMPED = 0.01  # damping ratio of a pole below which an oscillation at rest is the linear system's own


def why_void(linear: LinearModels, gates: Sequence[Gate]) -> str:
    """Return why the measures of a run have no value, "" where they have one."""
    growing = _growing(linear)
    if growing is not None and not _at_rest_elsewhere(gates, growing.real):
        return f"unstable, {describe(growing)}"
    for gate in (g for g in gates if g.kind == "hold" and g.label == "drift"):
        reason = _at_rest(gate, linear)
        if reason:
            return f"{reason} in phase {gate.label}, in which nothing is excited"
    return ""


def describe(pole: complex) -> str:
    """Return a growing pole (rad/s) as text: its frequency and the factor by which it grows in a second."""
    rate = math.exp(min(pole.real, 700.0))
    factor = plain(rate, 3) if rate < 1e6 else f"10^{pole.real / math.log(10.0):.0f}"
    at = (
        f"pole at {plain(abs(pole.imag) / (2.0 * math.pi), 3)} Hz"
        if pole.imag
        else f"pole at {plain(pole.real, 3, '+')} 1/s"
    )
    return f"{at}, grows by a factor of {factor} per s"


def _growing(linear: LinearModels) -> complex | None:
    """Return the fastest growing pole: of the sampled model, or slower than this resolves, of the continuous one."""
    for model in (linear.closed.discrete, linear.closed.continuous):
        growing = unstable(model) if model is not None else []
        if model is linear.closed.continuous and linear.closed.discrete is not None:
            resolved = 1e-5 / linear.closed.discrete.step
            growing = [p for p in growing if abs(p) < resolved]
        if growing:
            return growing[0]
    return None


def _at_rest_elsewhere(gates: Sequence[Gate], rate: float) -> bool:
    """Return whether the run has left the unstable point at which it began and come to rest: a gimbal that turned over.

    It had time to grow by e^20; at its end nothing is at a limit and each loop error below 1 % of its largest one.
    """
    if not gates or rate * float(gates[-1].t[-1] - gates[0].t[0]) < 20.0:
        return False
    last = gates[-1]
    end = {n: np.abs(last[n][-max(2, last.t.size // 5) :]) for n in last.channels}
    limited = any(np.any(y > 0.5) for n, y in end.items() if n.endswith(".saturated"))
    errors = [n for n in end if n.endswith(".e")]
    small = all(float(end[n].max()) <= 0.01 * float(np.max(np.abs(last.channels[n]))) for n in errors)
    return bool(errors) and small and not limited


def _at_rest(gate: Gate, linear: LinearModels) -> str:
    for name in gate.channels:
        if name.endswith(".e"):
            whole = gate.channels[name]
            moves = float(np.ptp(gate[name])) > ROUNDING * float(np.max(np.abs(whole)))
            reason = _restless(gate.t, gate[name], linear) if moves else ""
            if reason:
                return f"not settled: {name} {reason}"
    for name in (n for n in gate.channels if n.endswith(".saturated")):
        share = float(np.mean(gate[name] > 0.5))
        if share > AT_LIMIT:
            return f"not settled: {name.partition('.')[0]} is at its limit for {100.0 * share:.0f} % of the time"
    return ""


def _restless(t: Array, y: Array, linear: LinearModels) -> str:
    """Return how a signal at rest grows or oscillates, "" where it does neither."""
    n = y.size // PARTS
    if n < 16:
        return ""
    parts = [_straightened(y[k * n : (k + 1) * n]) for k in range(PARTS)]
    sizes = np.array([float(np.std(p)) for p in parts])
    if sizes[-1] > GROWTH * sizes[0] > 0.0 and np.all(np.diff(sizes) > 0.0):
        rate = math.log(sizes[-1] / sizes[0]) / float(t[(PARTS - 1) * n] - t[0])
        return f"grows by a factor of {plain(math.exp(min(rate, 700.0)), 3)} per s"
    whole = _straightened(y)
    spectrum = np.abs(np.fft.rfft(whole * np.hanning(whole.size)))
    peak = int(np.argmax(spectrum))
    if peak < PERIODS or sizes[0] == 0.0:
        return ""
    around = spectrum[peak - 1 : peak + 2] if peak + 1 < spectrum.size else spectrum[peak : peak + 1]
    share = float(np.arange(-1, 2) @ around) / float(around.sum()) if around.size == 3 else 0.0
    w = 2.0 * math.pi * (peak + share) / (whole.size * float(t[1] - t[0]))
    phasors = []
    for k, part in enumerate(parts):
        at = t[k * n : (k + 1) * n]
        columns = np.column_stack([np.cos(w * at), np.sin(w * at)])
        x = np.linalg.lstsq(columns, part, rcond=None)[0]
        if float(np.var(columns @ x)) < LINE * float(np.var(part)):
            return ""
        phasors.append(complex(x[0], -x[1]))
    amplitudes = np.abs(phasors)
    mean = float(amplitudes.mean())
    steady = abs(np.mean(np.array(phasors) / amplitudes)) > STEADY
    if not steady or float(amplitudes.std()) > EVEN * mean or _undamped(linear, w):
        return ""
    return f"oscillates by ±{plain(mean, 3)} at {plain(w / (2.0 * math.pi), 3)} Hz (limit cycle)"


def _straightened(y: Array) -> Array:
    x = np.arange(y.size) - 0.5 * (y.size - 1)
    centred = y - y.mean()
    return np.asarray(centred - x * float(x @ centred) / float(x @ x))


def _undamped(linear: LinearModels, w: float) -> bool:
    """Return whether the linear model has an undamped pole at w, rad/s: a nutation that nothing damps."""
    model = linear.closed.discrete or linear.closed.continuous
    own = poles(model) if model is not None else []
    return any(abs(p.real) < UNDAMPED * abs(p) and abs(abs(p.imag) / w - 1.0) < 0.05 for p in own)
