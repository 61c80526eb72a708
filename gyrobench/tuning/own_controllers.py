"""Controllers that a part has for good, with a few numbers of their own, told by the names of its parameters.

    correction motor   G = k_i k_m ratio                           k_m is set
    slaving            G = k                                       k is set

No other part fits the place of such a part, so its structure is the one that it can have.  In the linear model it stays
where it is: the plant is the loop opened before it, over this gain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from gyrobench.bench import UsageError
from gyrobench.tuning.structures import Controller, ControllerStructure

Values = Mapping[str, Any]  # parameters of the part by name


@dataclass(frozen=True)
class OwnController:
    """One kind.  names: parameters by which it is told; structure: that it has; unit: of its output."""

    names: ClassVar[tuple[str, ...]]
    structure: ClassVar[str] = "gain"
    has: ClassVar[str] = "one number, its gain"
    unit: ClassVar[str] = "N·m"

    def gain(self, q: Values) -> float:
        """Return the gain, output per signal."""
        raise NotImplementedError

    def limit(self, q: Values) -> float:
        """Return the largest output."""
        raise NotImplementedError

    def settings(self, controller: Controller, q: Values) -> dict[str, Any]:
        """Return the parameters that make this controller."""
        raise NotImplementedError

    def fits(self, shape: ControllerStructure) -> bool:
        return shape.name == self.structure


class CorrectionMotor(OwnController):
    """Amplifier, motor and reducer of a power gyro: M = -ratio k_m k_i e."""

    names = ("k_i", "k_m", "ratio", "v_max")

    def gain(self, q: Values) -> float:
        return float(q["k_i"] * q["k_m"] * q["ratio"])

    def limit(self, q: Values) -> float:
        return float(q["v_max"] * q["k_m"] * q["ratio"])

    def settings(self, controller: Controller, q: Values) -> dict[str, Any]:
        return {"k_m": controller.values["K"] / (q["k_i"] * q["ratio"])}


class SlavingGain(OwnController):
    """Slaving of a compass: rate = k e."""

    names = ("k", "limit", "turn_cut")
    unit = "rad/s"

    def gain(self, q: Values) -> float:
        return float(q["k"])

    def limit(self, q: Values) -> float:
        return float(q["limit"])

    def settings(self, controller: Controller, q: Values) -> dict[str, Any]:
        return {"k": controller.values["K"]}


KINDS: tuple[OwnController, ...] = (CorrectionMotor(), SlavingGain())


def own_values(parameters: Values, slot: str) -> dict[str, Any]:
    """Return the parameters of the part in a slot by their names there."""
    return {n.removeprefix(slot + "."): v for n, v in parameters.items() if n.startswith(slot + ".")}


def own_controller(parameters: Values, slot: str) -> OwnController | None:
    """Return the kind of the part in a slot; None where any other part with a controller may take its place."""
    there = own_values(parameters, slot)
    return next((kind for kind in KINDS if all(n in there for n in kind.names)), None)


def checked_structure(own: OwnController, shape: ControllerStructure, slot: str) -> ControllerStructure:
    """Return the structure.  Raises UsageError where the part cannot have it."""
    if not own.fits(shape):
        raise UsageError(
            f"--structure {shape.name}: the part in slot {slot} has {own.has}; leave --structure out for "
            f"{own.structure}"
        )
    return shape
