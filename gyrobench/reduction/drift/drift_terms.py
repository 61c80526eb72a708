"""What every test of drift coefficients in torque rebalance or servo mode shares: quantities, equation, torquer.

[GYRO-STATIC-9; Hu 1981, eq. 2-36, 2-47]
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from gyrobench import drift, frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.drift import pulses as pulse_sources
from gyrobench.reduction.drift.pulses import CurrentWindows, Pulses
from gyrobench.reduction.drift.supplies import Supplies
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup import sources
from gyrobench.reduction.setup.run_metadata import number, truth_of
from gyrobench.reduction.setup.setups import RebalanceSetup, scale_factor_problems
from gyrobench.result import Reason

NO_OO = "D_OO is taken as zero; if it is not, D_F holds γ² D_OO, D_II and D_SS hold −D_OO."
EARTH_ONLY = "the Earth's rate only; the drift itself changes with the attitude by its g coefficients"
SMALL = 1e-5  # rad
AXES = {"I": "X", "O": "Y", "S": "Z"}


@dataclass(frozen=True, kw_only=True)
class OneLoopSetup(RebalanceSetup):
    """One rebalance loop.  k: torquer scale factor, rad/s/A.  quantum: resolution of the current reading.  pulses:
    those of a pulse-width rebalance, where the current was counted.  supplies: what the gyro's supplies do.
    """

    k: float
    quantum: float = 0.0
    pulses: Pulses | None = None
    supplies: Supplies = field(default_factory=Supplies)

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        """Return the setup that a run.json describes.  Scale factor: option ``k``, else the gyro's parameter ``k``."""
        shared: dict[str, Any] = {"k": number(run, "k", "gyro.k", "torquer scale factor")}
        shared["truth"] = truth_of(run, drift.NAMES)
        shared["quantum"] = float(run.parameters.get("rebalance.resolution", 0.0))
        shared["pulses"] = Pulses.of(run)
        shared["supplies"] = Supplies.of(run)
        return super().of(run, **{**shared, **own})

    def problems(self, folding: bool = True) -> list[str]:
        return super().problems(folding) + scale_factor_problems(self.k)


def quantity(s: RebalanceSetup, name: str, closed: Mapping[str, float], square: str = "D_OO") -> Quantity:
    """Return a coefficient of the model at one |g|, where a square cannot be told from others: it is in their truth.

    square: D_OO, or of a channel Dx_yy or Dy_xx; "" where the model has no squares.
    """
    into = drift.FOLDED.get(square, ())
    constant, truth = name == into[0] if into else False, None
    if s.truth is not None:
        extra = s.truth.get(square, 0.0) * (s.gamma**2 if constant else -1.0) if name in into else 0.0
        truth = s.truth.get(name, 0.0) + extra
    q = Quantity.drift(name, truth, closed.get(name))
    if not s.fold or name not in into:
        return q
    shown = f"{name} + γ² {square}" if constant else f"{name} − {square}"
    return replace(q, meaning=f"{q.meaning}, with {square} folded in", shown=shown)


def folded(s: RebalanceSetup, square: str = "D_OO") -> list[Reason]:
    """Return that a square is folded into others, where it is."""
    a, b, c = drift.FOLDED[square]
    text = (
        f"{square} is folded: at constant |g| only {a} + γ² {square}, {b} − {square} and {c} − {square} can be had "
        f"(γ = g/g0 = {s.gamma:.6f}); separating them needs |f| ≠ 1 g, a centrifuge."
    )
    return [Reason("drift.folded", text)] if s.fold else []


def left_out(truth: Mapping[str, float] | None, names: Iterable[str], every: Iterable[str], model: str) -> list[Reason]:
    """Return that terms of ``every`` are simulated (truth) which a model does not have; names: its unknowns."""
    known = set(names)
    missing = [n for n in every if n not in known and (truth or {}).get(n, 0.0)]
    text = f"{', '.join(missing)} is simulated but not in the {model} model: the others are biased."
    return [Reason("drift.left_out", text)] if missing else []


def equation(left: str, names: Iterable[str]) -> str:
    """Return the measurement equation in Typst math: ``left``, then the polynomial of the terms ``names``."""
    parts = []
    for n in names:
        index = n[2:]
        if n == "D_F":
            parts.append("D_F")
        elif len(index) == 2 and index[0] == index[1]:
            parts.append(f'D_"{index}" {AXES[index[0]]}^2')
        else:
            parts.append((f"D_{index} " if len(index) == 1 else f'D_"{index}" ') + " ".join(AXES[a] for a in index))
    return left + " + ".join(parts)


def attitude_effects(s: Any, found: Findings, note: str = "") -> list[sources.Effect]:
    """Return what a gyro turned about its output and spin axes does to drift rates in one attitude: the Earth's rate.

    s: a setup with attitude (rows I, O, S in E, N, U), latitude and earth_rate.
    """
    earth, turned = frames.earth_rate_local(s.latitude, s.earth_rate), []
    for axis, name in ((1, "output"), (2, "spin")):
        R = frames.rotation(np.eye(3)[axis], SMALL).T @ s.attitude
        rate = float((R[0] - s.attitude[0]) @ earth) / SMALL
        turned.append(sources.IN_ATTITUDE[name].effect(s, found.error(-rate), note=note))
    return turned


def torquer_sources(axis: str = "", full: str = "") -> list[sources.Source]:
    """Return scale factor and nonlinearity of a torquer, offset and resolution of the reading of its current.

    axis: of one of two torquers.  full: the largest current of the record, for the note.
    """
    every = (sources.TORQUER_SCALE, sources.TORQUER_NONLINEARITY, sources.CURRENT_OFFSET, sources.CURRENT_RESOLUTION)
    each = (
        sources.TORQUER_SCALE_OF,
        sources.TORQUER_NONLINEARITY_OF,
        sources.CURRENT_OFFSET_OF,
        sources.CURRENT_RESOLUTION_OF,
    )
    return [s.of(axis=axis, full=full) for s in (each if axis else every)]


def elsewhere(axis: str) -> list[str]:
    """Return names and ids of the sources of one of two torquers, which the other channel lacks."""
    own = [*torquer_sources(axis), *(pulse_sources.of_loop(s, axis) for s in sources.PULSES)]
    return [word for s in own for word in (s.name, s.id)]


def torquer_effects(
    s: RebalanceSetup, found: Findings, k: float, read: CurrentWindows, quantum: float, pulses: Pulses | None = None,
    axis: str = "",
) -> list[sources.Effect]:  # fmt: skip
    """Return what errors of torquer and current reading do to drift rates omega_IA - k i.

    k: rad/s/A.  read: currents with the sign of the precession convention.  quantum: resolution of the reading, A.
    axis: of one of two torquers.
    """
    current = read.mean
    full = float(np.max(np.abs(current))) or 1.0
    scale, nonlinearity, zero, resolution = torquer_sources(axis, f"{plain(full * 1e3, 3)} mA")
    offset = found.error(-k * np.ones_like(current))
    return [
        scale.effect(s, found.error(-k * current)),
        nonlinearity.effect(s, found.error(-k * current * np.abs(current) / full)),
        zero.effect(s, offset),
        resolution.effect(quantum / 12.0**0.5, offset),
        *(pulses.effects(found, k, read, s, axis) if pulses else ()),
    ]
