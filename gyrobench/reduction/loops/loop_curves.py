"""Curves of the figures of a loop: Bode plots of points and models, step response of a model at a gate's times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.run_document import LinearModel
from gyrobench.reduction.loops.loop_measures import Gate, Point
from gyrobench.result import Curve, Response

CURVE = 241  # points of a drawn curve
SHOWN = 600  # points of a drawn step response


def curve(label: str, f: Array, values: Any) -> Curve:
    """Return a model's curve, thinned for drawing; phase unwrapped, degrees."""
    phase = np.degrees(np.unwrap(np.angle(values)))
    pick = np.unique(np.linspace(0, len(f) - 1, CURVE).astype(int))
    return Curve(label, np.asarray(f)[pick].tolist(), np.abs(values)[pick].tolist(), phase[pick].tolist())


def bode(
    name: str, kind: str, caption: str, points: Sequence[Point], curves: list[Curve], y_name: str, unit: str
) -> Response:
    """Return the Bode plot of measured points with the curves of models."""
    return Response(
        name=name,
        kind=kind,
        caption=caption,
        x=[p.f for p in points],
        x_name="frequency",
        x_unit="Hz",
        y=[abs(p.value) for p in points],
        y_name=y_name,
        y_unit=unit,
        phase=np.degrees(np.unwrap(np.angle([p.value for p in points]))).tolist(),
        u=[p.u for p in points],
        coherence=[p.coherence for p in points],
        curves=curves,
    )


def step_figure(
    gate: Gate, y: Array, line: Array | None, label: str, scale: float, what: str, unit: str
) -> Response:  # fmt: skip
    """Return the figure of a step phase.  y, line: measured and of a linear model, SI; scale: SI per printed unit."""
    t = gate.t - gate.t[0]
    pick = np.unique(np.linspace(0, t.size - 1, min(SHOWN, t.size)).astype(int))
    curves = [] if line is None else [
        Curve(label, t[pick].tolist(), (line[pick] / scale).tolist())
    ]  # fmt: skip
    size = f"{gate.amplitude:g}".replace("-", "−")
    cause = f"{size} {units.display(gate.row.unit)} on axis {gate.axis} from t = 0 on"
    return Response(
        name=f"{gate.label}, {what}",
        kind="step",
        caption=f"{gate.label[:1].upper()}{gate.label[1:]}: {what}, {cause}. Points: measured; line: linear model.",
        x=t[pick].tolist(),
        x_name="time",
        x_unit="s",
        y=(y[pick] / scale).tolist(),
        y_name=what,
        y_unit=unit,
        curves=curves,
    )


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
