"""Curves of the figures of a loop: Bode plots of points and models, step response of a model at a gate's times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.loop_measures import Gate, Point
from gyrobench.result import Curve, Response

CURVE = 241  # points of a drawn curve
SHOWN = 600  # points of a drawn step response
ENVELOPE = 700  # points of a drawn line of a flight


def curve(label: str, f: Array, values: Any) -> Curve:
    """Return a model's curve, thinned for drawing; phase unwrapped, degrees."""
    phase = np.degrees(np.unwrap(np.angle(values)))
    pick = thinned(len(f), CURVE)
    return Curve(label, np.asarray(f)[pick].tolist(), np.abs(values)[pick].tolist(), phase[pick].tolist())


def thinned(n: int, most: int) -> NDArray[np.int_]:
    """Return at most so many of n samples, evenly spread, with the first and the last one."""
    return np.unique(np.linspace(0, n - 1, min(most, n)).astype(int))


def line(label: str, x: Array, y: Array) -> Curve:
    """Return a curve of a figure against time."""
    return Curve(label, x.tolist(), y.tolist())


def trace(
    name: str, caption: str, t: Array, y: Array, y_name: str, y_unit: str, lines: Mapping[str, Array] | None = None,
    shown: int = SHOWN, marked: int | None = None,
) -> Response:  # fmt: skip
    """Return the figure of a signal against time (s), with lines at the same times over it.

    shown: at most so many points of the lines, marked: of the signal; None: as many.
    """
    pick, few = thinned(t.size, shown), thinned(t.size, marked or shown)
    curves = [line(label, t[pick], np.asarray(x)[pick]) for label, x in (lines or {}).items()]
    return Response(name, "step", caption, t[few].tolist(), "time", "s", y[few].tolist(), y_name, y_unit, curves=curves)


def over_time(
    name: str, t: Array, lines: Mapping[str, Array], *, unit: str = "°", y_name: str = "", caption: str = "",
    shown: int = ENVELOPE, envelope: bool = True, x_unit: str = "s", compared: str = "",
) -> Response:  # fmt: skip
    """Return the figure of several quantities (printed units) over time; runs are compared by ``compared``, "": the
    first one.

    Of more points than ``shown`` each stretch of samples is drawn by its smallest and largest value; without
    ``envelope``, by one of them.
    """
    drawn = {}
    for label, y in lines.items():
        pick = _envelope(y, shown) if envelope else thinned(t.size, shown)
        drawn[label] = line(label, t[pick], y[pick])
    first = drawn[compared or next(iter(drawn))]
    return Response(
        name, "time", caption or f"{name[:1].upper()}{name[1:]} over time.", first.x, "time", x_unit, first.y,
        y_name or name, unit, curves=[*drawn.values()],
    )  # fmt: skip


def _envelope(y: Array, shown: int) -> NDArray[np.int_]:
    if y.size <= shown:
        return np.arange(y.size)
    pick = []
    for a, b in pairwise(np.linspace(0, y.size, shown // 2 + 1).astype(int)):
        pick += sorted({a + int(np.argmin(y[a:b])), a + int(np.argmax(y[a:b]))})
    return np.array(pick)


def bode(
    name: str, kind: str, caption: str, points: Sequence[Point], curves: list[Curve], y_name: str, unit: str
) -> Response:
    """Return the Bode plot of measured points with the curves of models."""
    f, gain = [p.f for p in points], [abs(p.value) for p in points]
    measured = Response(name, kind, caption, f, "frequency", "Hz", gain, y_name, unit)
    return replace(
        measured,
        phase=np.degrees(np.unwrap(np.angle([p.value for p in points]))).tolist(),
        u=[p.u for p in points],
        coherence=[p.coherence for p in points],
        curves=curves,
    )


def step_figure(
    gate: Gate, y: Array, model: Array | None, label: str, scale: float, what: str, unit: str
) -> Response:  # fmt: skip
    """Return the figure of a step phase.  y, model: measured and of a linear model, SI; scale: SI per printed unit."""
    t = gate.t - gate.t[0]
    pick = thinned(t.size, SHOWN)
    curves = [] if model is None else [line(label, t[pick], model[pick] / scale)]
    size = f"{gate.amplitude:g}".replace("-", "−")
    cause = f"{size} {units.display(gate.row.unit)} on axis {gate.axis} from t = 0 on"
    return Response(
        name=f"{gate.label}, {what}", kind="step",
        caption=f"{gate.label[:1].upper()}{gate.label[1:]}: {what}, {cause}. Points: measured; line: linear model.",
        x=t[pick].tolist(), x_name="time", x_unit="s", y=(y[pick] / scale).tolist(), y_name=what, y_unit=unit,
        curves=curves,
    )  # fmt: skip


def simulated(model: LinearModel, gate: Gate, output: str) -> Array | None:
    """Return response of a channel to a unit step of the excitation at the gate's opening, at the gate's times; SI."""
    name = f"{gate.kind}[{gate.axis}]"
    wired = [j for j, n in enumerate(model.inputs) if n.partition(".")[2] == name]
    if gate.shape != "step" or gate.kind == "motion" or output not in model.outputs or not wired:
        return None
    row = model.outputs.index(output)
    n = len(model.states)
    a, c = np.reshape(model.A, (n, n)), np.reshape(model.C, (-1, n))[row : row + 1]
    b = np.reshape(model.B, (n, -1))[:, wired].sum(axis=1, keepdims=True)
    d = np.reshape(model.D, (-1, len(model.inputs)))[row : row + 1, wired].sum(axis=1, keepdims=True)
    count = round((gate.t[-1] - gate.t[0]) / model.step) + 1
    # the input is constant, so a power of [[A, B], [0, 1]] moves all rows known so far: twice as many each time
    power = np.block([[a, b], [np.zeros((1, n)), np.ones((1, 1))]])
    rows = np.zeros((n + 1, count))
    rows[-1, 0] = gate.amplitude
    known = 1
    while known < count:
        new = min(known, count - known)
        rows[:, known : known + new] = power @ rows[:, :new]
        known, power = known + new, power @ power
    y = (np.hstack([c, d]) @ rows)[0]
    at = np.minimum(np.round((gate.t - gate.t[0]) / model.step).astype(int), count - 1)
    return np.asarray(y[at])
