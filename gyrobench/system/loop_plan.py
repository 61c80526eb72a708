"""The plan of a loop test: a labelled list of excitations, run inside the co-simulation by the exciter part.

LoopPlan([
    LoopPhase("load step", "torque", "step", amplitude=1.0, settle=1.0, dwell=2.0),
    *sweep("base", "motion", frequencies=[0.5, 1.0, 2.0], amplitude=0.01),
    LoopPhase("drift", "hold", dwell=60.0),
])
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from gyrobench.system.plan import LIMIT

KINDS = {"hold": 0, "torque": 1, "command": 2, "test": 3, "motion": 4}
SHAPES = {"constant": 0, "step": 1, "sine": 2}
UNITS = {"hold": "", "torque": "N.m", "command": "rad/s", "test": "V", "motion": "rad"}


@dataclass(frozen=True)
class LoopPhase:
    """One phase: one signal on one axis.  See the exciter for what it looks like in time.

    kind: "hold" (none), "torque" (N.m), "command" (rad/s), "test" (V), "motion" (rad, of the base).
    shape: "constant", from the start of the phase; "step", while the gate is open; "sine".
    axis: 1 x_f pitch, 2 y_r roll, 3 z_a azimuth.  amplitude: SI.  frequency: Hz of a sine, or 1 / time of the turn of
    a motion step.  settle: s before the gate opens (a sine fades in, and out again afterwards).  dwell: s measured.
    """

    label: str
    kind: str = "hold"
    shape: str = "constant"
    axis: int = 1
    amplitude: float = 0.0
    frequency: float = 0.0
    settle: float = 0.0
    dwell: float = 0.0

    def duration(self) -> float:
        """s, with the fading of a sine."""
        fade = 0.5 * self.settle if self.shape == "sine" and self.kind != "hold" else 0.0
        return self.settle + self.dwell + fade


@dataclass
class LoopPlan:
    """Phases of a loop test, in their order."""

    phases: list[LoopPhase] = field(default_factory=list)

    def problems(self) -> list[str]:
        """Return what is wrong with the plan, as sentences; the exciter itself refuses what is left."""
        found = []
        if not 1 <= len(self.phases) <= LIMIT:
            found.append(f"the plan has {len(self.phases)} phases: 1 to {LIMIT} are possible")
        for k, p in enumerate(self.phases, 1):
            where = f"phase {k} '{p.label}'"
            if p.kind not in KINDS:
                found.append(f"{where}: kind '{p.kind}' is none of {', '.join(KINDS)}")
            if p.shape not in SHAPES:
                found.append(f"{where}: shape '{p.shape}' is none of {', '.join(SHAPES)}")
            if p.axis not in (1, 2, 3):
                found.append(f"{where}: axis {p.axis}: must be 1, 2 or 3")
            if not p.dwell > 0.0:
                found.append(f"{where}: dwell = {p.dwell:g} s: must be > 0")
            if not p.settle >= 0.0:
                found.append(f"{where}: settle = {p.settle:g} s: must be >= 0")
            if p.shape == "sine" and not p.frequency > 0.0:
                found.append(f"{where}: frequency = {p.frequency:g} Hz: a sine needs one > 0")
            elif p.shape == "sine" and p.dwell * p.frequency < 1.0 - 1e-9:
                found.append(f"{where}: dwell = {p.dwell:g} s is less than one period of {p.frequency:g} Hz")
        return found

    def parameters(self, slot: str = "exciter") -> dict[str, Any]:
        """The parameters of the exciter in ``slot`` that carry this plan."""
        columns: dict[str, list[Any]] = {
            "kinds": [KINDS[p.kind] for p in self.phases],
            "shapes": [SHAPES[p.shape] for p in self.phases],
            "axes": [p.axis for p in self.phases],
            "amplitudes": [float(p.amplitude) for p in self.phases],
            "frequencies": [float(p.frequency) for p in self.phases],
            "settle": [float(p.settle) for p in self.phases],
            "dwell": [float(p.dwell) for p in self.phases],
        }
        return {f"{slot}.phases": len(self.phases), **{f"{slot}.{k}": v for k, v in columns.items()}}

    def duration(self) -> float:
        """Sum of the phases, s."""
        return sum(p.duration() for p in self.phases)

    def rows(self) -> list[dict[str, Any]]:
        """JSON-able rows, numbered from 1 as in the record; ``mode`` is the kind."""
        return [
            {
                "phase": k,
                "label": p.label,
                "mode": p.kind,
                "shape": p.shape,
                "axis": p.axis,
                "amplitude": p.amplitude,
                "unit": UNITS[p.kind],
                "frequency": p.frequency,
                "settle": p.settle,
                "dwell": p.dwell,
            }
            for k, p in enumerate(self.phases, 1)
        ]


def sweep(
    label: str,
    kind: str,
    frequencies: Sequence[float],
    amplitude: float | Callable[[float], float],
    *,
    axis: int = 1,
    periods: int = 6,
    settle: float = 0.0,
    dwell: float = 0.0,
) -> list[LoopPhase]:
    """One sine phase for each frequency (Hz).

    amplitude: SI, or a function of the frequency.  It is measured over ``periods`` or as many whole ones as fill
    ``dwell`` s, after as many periods as fill ``settle`` s, two at least.
    """
    found = []
    for f in frequencies:
        size = amplitude(f) if callable(amplitude) else amplitude
        before, during = max(2, -int(-settle * f // 1)), max(periods, -int(-dwell * f // 1))
        name = f"{label} {f:.4g} Hz"
        found.append(LoopPhase(name, kind, "sine", axis, size, f, settle=before / f, dwell=during / f))
    return found
