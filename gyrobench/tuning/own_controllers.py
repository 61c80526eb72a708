"""Controllers that a part has for good, with a few numbers of their own, told by the names of its parameters.

    correction motor   G = k_i k_m ratio                           k_m is set
    slaving            G = k                                       k is set
    networks           G = K (1 + s/zero)/(1 + s/pole) ...         zeros and poles of three, K as static stiffness

No other part fits the place of such a part, so its structure is the one that it can have.  In the linear model it stays
where it is: the plant is the loop opened before it, over this gain.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from gyrobench.arrays import Array
from gyrobench.bench import UsageError
from gyrobench.tuning.structures import Controller, ControllerStructure

Values = Mapping[str, Any]  # parameters of the part by name


@dataclass(frozen=True)
class OwnController(ABC):
    """One kind.  names: parameters by which it is told; structure: that it has where none is asked for; unit: of its
    output.
    """

    names: ClassVar[tuple[str, ...]]
    structure: ClassVar[str] = "gain"
    has: ClassVar[str] = "one number, its gain"
    unit: ClassVar[str] = "N·m"
    own: ClassVar[tuple[str, ...]] = ()  # parameters that no spread may have; (): all of the part
    started: ClassVar[int] = 0  # steps after which one step of the part is like the next

    @abstractmethod
    def gain(self, q: Values) -> float:
        """Return the gain, output per signal."""

    @abstractmethod
    def limit(self, q: Values) -> float:
        """Return the largest output."""

    @abstractmethod
    def settings(self, controller: Controller, q: Values) -> dict[str, Any]:
        """Return the parameters that make this controller."""

    def per_added(self, q: Values, f: Array) -> Array:
        """Return the signal at the controller per what a test adds to it, at frequencies in Hz."""
        return np.ones_like(f)

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


class InnerOwnController(OwnController):
    """One with no communication step between it and what it drives."""

    @abstractmethod
    def small(self, q: Values) -> float:
        """Return a gain with which it may run without dynamics, and with twice as much."""

    @abstractmethod
    def blank(self, q: Values, gain: float) -> dict[str, Any]:
        """Return the parameters that make it a gain alone."""


class TableNetworks(InnerOwnController):
    """Three networks in a turntable, between its demodulator and its motor; the part knows its gyro by H_g ... K_g."""

    names = ("network", "zeros", "poles", "stiffness", "torque_max")
    structure = "lag+lead+lead"
    has = "three networks: lag and lead, joined by +, at most three"
    own = ("network", "zeros", "poles", "stiffness", "crossover", "H_g", "J_g", "C_g", "K_g", "polarity")
    started = 3  # mode, capture, fine
    COUNT = 3
    SLOW = 0.1  # of what is slowest in the plant: its crossover with a small gain
    IDLE = 1e3  # rad/s: of a network that does nothing

    def per_added(self, q: Values, f: Array) -> Array:
        s = 2j * np.pi * f  # a rate, by the float
        return np.asarray(np.abs(q["K_g"] * q["H_g"] / (s * (q["J_g"] * s + q["C_g"]))))

    def small(self, q: Values) -> float:
        """Return a gain, N.m/V, that holds the loop stable without networks, and twice it too."""
        d = (q["viscous"] * q["C_g"] + q["H_g"] ** 2, q["J"] * q["C_g"] + q["viscous"] * q["J_g"], q["J"] * q["J_g"])
        w = self.SLOW * min(d[0] / d[1], math.sqrt(d[0] / d[2]), d[1] / d[2])
        return float(w * d[0] / (q["K_g"] * q["H_g"]))

    def blank(self, q: Values, gain: float) -> dict[str, Any]:
        return self._networks([], gain, q)

    def gain(self, q: Values) -> float:
        return float(q["stiffness"] * q["C_g"] / (q["K_g"] * q["H_g"]))

    def limit(self, q: Values) -> float:
        return float(q["torque_max"])

    def settings(self, controller: Controller, q: Values) -> dict[str, Any]:
        v = controller.values
        found = [(1.0 / v[n], 1.0 / v["T" + n.removeprefix("tau")]) for n in v if n.startswith("tau")]
        return self._networks(found, v["K"], q)

    def fits(self, shape: ControllerStructure) -> bool:
        blocks = shape.blocks
        return shape.name == "gain" or (0 < len(blocks) <= self.COUNT and set(blocks) <= {"lag", "lead"})

    def _networks(self, pairs: list[tuple[float, float]], gain: float, q: Values) -> dict[str, Any]:
        """Return the parameters of networks (zero, pole) in rad/s with a gain in N.m/V."""
        whole = np.array([*pairs, *[(self.IDLE, self.IDLE)] * (self.COUNT - len(pairs))])
        return {
            "network": 0,
            "zeros": whole[:, 0].tolist(),
            "poles": whole[:, 1].tolist(),
            "stiffness": gain * q["K_g"] * q["H_g"] / q["C_g"],
        }


KINDS: tuple[OwnController, ...] = (CorrectionMotor(), SlavingGain(), TableNetworks())


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
