"""The plan of a test: a labelled list of phases, run inside the co-simulation by the sequencer part."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gyrobench.record.run_document import stops

MODES = {"hold": 0, "index": 1, "rate": 2, "servo": 3, "step": 4}
LIMIT = 99  # phases
FACES = 12  # different mounts


@dataclass(frozen=True)
class Phase:
    """One phase: the table goes to its target, settles, then windows are averaged until dwell or travel is reached.

    mode "hold": stay where the table is; "index": go to the angle ``target`` (rad); "rate": turn at ``target`` (rad/s);
    "servo": the gyro holds the table, windows until ``dwell`` has passed and at least ``travel`` is turned; "step":
    index to target, target + step, ... and settle and dwell at each, until the stops have covered ``travel``.
    settle: s before the first window.  dwell: s of windows (hold, index, servo, each stop).  travel: rad of windows
    (rate).  window: length of one window, rad (rate) or s.  A rate phase without travel has windows by
    time, as the others: its second axis may turn alone.  face: name of the mount in :attr:`Plan.faces`.
    target_y: as target, of the second axis of a table that has two.  expected: s that the travel of a servo phase is
    expected to take.  step: rad from stop to stop, with its sense.
    """

    label: str
    mode: str
    face: str
    target: float = 0.0
    settle: float = 0.0
    dwell: float = 0.0
    travel: float = 0.0
    window: float = 0.0
    target_y: float = 0.0
    expected: float = 0.0
    step: float = 0.0

    @property
    def by_angle(self) -> bool:
        """True of windows by the angle of the first axis."""
        return self.mode == "rate" and self.travel > 0.0

    @property
    def stops(self) -> int:
        """Number of angles at which the table rests, 1 but in a step phase."""
        return stops(self.mode, self.travel, self.step)

    def duration(self) -> float:
        """Time of the phase without the ways to its targets, s."""
        if self.by_angle and self.target:
            return self.settle + self.travel / abs(self.target)
        return self.stops * (self.settle + max(self.dwell, self.expected))


@dataclass
class Plan:
    """Phases and the mounts they use (name -> 3x3 rotation, rows = gyro axes I, O, S in table axes)."""

    phases: list[Phase] = field(default_factory=list)
    faces: Mapping[str, ArrayLike] = field(default_factory=dict)

    def problems(self) -> list[str]:
        """Return what is wrong with the plan, as sentences; the sequencer itself refuses what is left."""
        found = []
        if not 1 <= len(self.phases) <= LIMIT:
            found.append(f"the plan has {len(self.phases)} phases: 1 to {LIMIT} are possible")
        if len(self.faces) > FACES:
            found.append(f"the plan has {len(self.faces)} faces: at most {FACES} are possible")
        for k, p in enumerate(self.phases, 1):
            where = f"phase {k} '{p.label}'"
            if p.mode not in MODES:
                found.append(f"{where}: mode '{p.mode}' is none of {', '.join(MODES)}")
            if p.face not in self.faces:
                found.append(f"{where}: face '{p.face}' is none of {', '.join(self.faces) or 'none'}")
            by_time = p.mode != "rate" or p.dwell > 0.0
            length, name = (p.dwell, "dwell") if by_time else (p.travel, "travel")
            if not length > 0.0:
                found.append(f"{where}: {name} = {length:g}: must be > 0")
            if not 0.0 < p.window <= length * (1.0 + 1e-12):
                found.append(f"{where}: window = {p.window:g}: must be > 0 and at most the {name} {length:g}")
            if p.mode == "rate" and not p.target and not (by_time and p.target_y):
                found.append(f"{where}: target rate 0: the table would never turn; use mode hold")
            if p.mode == "step" and not p.step:
                found.append(f"{where}: step 0: the table would never leave its first stop; use mode index")
        return found

    def parameters(self, slot: str = "sequencer") -> dict[str, Any]:
        """The parameters of the sequencer in ``slot`` that carry this plan."""
        names = list(self.faces)
        columns: dict[str, Any] = {
            "modes": [MODES[p.mode] for p in self.phases],
            "targets": [float(p.target) for p in self.phases],
            "windows": [float(p.window) for p in self.phases],
            "face_of": [names.index(p.face) + 1 for p in self.phases],
            "faces": [np.asarray(self.faces[n], dtype=float).ravel().tolist() for n in names],
        }
        if any(p.target_y for p in self.phases):
            columns["targets_y"] = [float(p.target_y) for p in self.phases]
        if any(p.step for p in self.phases):
            columns["steps"] = [float(p.step) for p in self.phases]
        for key in ("settle", "dwell", "travel"):
            columns[key] = [float(getattr(p, key)) for p in self.phases]
        return {f"{slot}.phases": len(self.phases), **{f"{slot}.{k}": v for k, v in columns.items()}}

    def duration(self) -> float:
        """Sum of the phases, s; the ways to the targets come on top."""
        return sum(p.duration() for p in self.phases)

    def rows(self) -> list[dict[str, Any]]:
        """JSON-able rows, numbered from 1 as in the record."""
        second = any(p.target_y for p in self.phases)
        return [
            {
                "phase": k,
                "label": p.label,
                "mode": p.mode,
                "face": p.face,
                "target": p.target,
                **({"target_y": p.target_y} if second else {}),
                "settle": p.settle,
                "dwell": p.dwell,
                "travel": p.travel,
                "window": p.window,
                **({"step": p.step} if p.step else {}),
            }
            for k, p in enumerate(self.phases, 1)
        ]
