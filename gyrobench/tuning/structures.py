"""Structures of a controller: factors joined by "+", each with few numbers that a search may choose.

    pi       1 + w_i/s                              lag      (1 + tau1 s)/(1 + T1 s),  T1 > tau1
    lead     (1 + tau2 s)/(1 + T2 s),  tau2 > T2    notch    (s2 + 2 z_z w s + w2)/(s2 + 2 z_p w s + w2)
    rolloff  1/(1 + s/w_r)                          lead-lag = lag+lead+pi, a lag and a lead network with an integral

A gain is in every structure, and alone it is the structure gain; it is found from the crossover that the search chooses
with the nominal plant.  All other frequencies are chosen relative to that crossover, by their logarithm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.bench import UsageError, suggest_names

Polynomial = Array  # falling powers of s
Ratio = tuple[Polynomial, Polynomial]


@dataclass(frozen=True)
class ControllerFactor:
    """A factor of a controller.  ranges: decades of each number; build(w, numbers) -> num, den, values by name.

    neutral: a number and its decade with which the factor does nothing, or next to nothing.
    """

    ranges: tuple[tuple[float, float], ...]
    neutral: tuple[int, float]
    build: Callable[[float, Sequence[float]], tuple[Ratio, dict[str, float]]]


def _pi(w: float, x: Sequence[float]) -> tuple[Ratio, dict[str, float]]:
    corner = w * x[0]
    return (np.array([1.0, corner]), np.array([1.0, 0.0])), {"integral": corner}


def _lag(w: float, x: Sequence[float]) -> tuple[Ratio, dict[str, float]]:
    tau = 1.0 / (w * x[0])
    T = tau * x[1]
    return (np.array([tau, 1.0]), np.array([T, 1.0])), {"tau1": tau, "T1": T}


def _lead(w: float, x: Sequence[float]) -> tuple[Ratio, dict[str, float]]:
    tau, T = math.sqrt(x[1]) / (w * x[0]), 1.0 / (w * x[0] * math.sqrt(x[1]))
    return (np.array([tau, 1.0]), np.array([T, 1.0])), {"tau2": tau, "T2": T}


def _notch(w: float, x: Sequence[float]) -> tuple[Ratio, dict[str, float]]:
    w0, zp, zz = w * x[0], x[1], x[1] * x[2]
    return (
        (np.array([1.0, 2.0 * zz * w0, w0**2]), np.array([1.0, 2.0 * zp * w0, w0**2])),
        {"f_notch": w0 / (2.0 * math.pi), "depth": x[2], "damping": zp},
    )


def _rolloff(w: float, x: Sequence[float]) -> tuple[Ratio, dict[str, float]]:
    wr = w * x[0]
    return (np.array([1.0]), np.array([1.0 / wr, 1.0])), {"f_rolloff": wr / (2.0 * math.pi)}


BLOCKS = {
    "lag": ControllerFactor(((-2.0, 0.0), (0.0, 3.0)), (1, 0.0), _lag),
    "lead": ControllerFactor(((-0.7, 1.0), (0.0, 2.3)), (1, 0.0), _lead),
    "pi": ControllerFactor(((-1.5, 0.0),), (0, -1.5), _pi),
    "notch": ControllerFactor(((-0.5, 1.7), (-1.5, 0.7), (-2.0, 0.0)), (2, 0.0), _notch),
    "rolloff": ControllerFactor(((0.0, 2.0),), (0, 2.0), _rolloff),
}
COMPUTED = ("lqg", "hinf")  # whole controllers, of gyrobench.tuning.synthesis
NAMES = {"lead-lag": ["lag", "lead", "pi"], "gain": []}


@dataclass(frozen=True)
class Controller:
    """G(s) = num/den by rising powers of s, D of them first; values: of its factors by name, with the gain K."""

    num: tuple[float, ...]
    den: tuple[float, ...]
    values: dict[str, float]

    def response(self, s: Array) -> Array:
        return np.asarray(np.polyval(self.num[::-1], s) / np.polyval(self.den[::-1], s))


class ControllerStructure:
    """A structure by its name; ``ranges``: decades of the numbers behind the crossover, which is the first."""

    shortest = 0.0  # s, T2 of a lead, at least
    computed = False  # as a whole, from the plant

    def __init__(self, name: str) -> None:
        self.name = name
        self.blocks: list[str] = []
        for part in (p.strip() for p in name.split("+")):
            if part not in BLOCKS and part not in NAMES:
                known = suggest_names(part, [*NAMES, *BLOCKS, *COMPUTED])
                raise UsageError(f"--structure {name}: no factor '{part}'; {known}; join them by +")
            self.blocks += NAMES.get(part, [part])
        for once in ("pi", "rolloff"):
            if self.blocks.count(once) > 1:
                raise UsageError(f"--structure {name}: {once} stands in it twice")
        order = sum(2 if b == "notch" else 1 for b in self.blocks)
        if order > 8:
            raise UsageError(f"--structure {name}: of order {order}; 8 is the highest")
        self.ranges = [r for b in self.blocks for r in BLOCKS[b].ranges]

    def of(self, plant: Any) -> ControllerStructure:
        """Return the structure for a nominal plant: no lead has a T2 below its communication step.

        Such a lead does not reach the voltage at the ends of the steps.  Within them each change of the signal, of the
        noise too, comes tau2/T2 times as large, beyond the limit of the voltage: the loop has less gain than its linear
        model (without that limit the same).
        """
        found = copy(self)
        found.shortest = float(plant.step)
        return found

    @property
    def is_lead_lag(self) -> bool:
        """True where a lag and a lead network with an integral have it."""
        return sorted(self.blocks) == sorted(set(self.blocks)) and set(self.blocks) <= {"lag", "lead", "pi"}

    def controller(self, w: float, numbers: Sequence[float], plant_at: Callable[[float], complex]) -> Controller:
        """Return the controller whose loop crosses 1 at w (rad/s).  plant_at: nominal plant at a frequency in Hz."""
        num, den = np.array([1.0]), np.array([1.0])
        values: dict[str, float] = {}
        first = 0
        for k, name in enumerate(self.blocks):
            block = BLOCKS[name]
            own = list(numbers[first : first + len(block.ranges)])
            if name == "lead" and self.shortest > 0.0:  # T2 = 1/(w x0 sqrt x1)
                own[1] = min(own[1], max(1.0, (w * own[0] * self.shortest) ** -2.0))
            (n, d), named = block.build(w, own)
            first += len(block.ranges)
            num, den = np.convolve(num, n), np.convolve(den, d)
            again = self.blocks[:k].count(name)
            values |= {f"{key}_{again + 1}" if again else key: v for key, v in named.items()}
        size = abs(np.polyval(num, 1j * w) / np.polyval(den, 1j * w) * plant_at(w / (2.0 * math.pi)))
        K = 1.0 / size
        return rounded(K * num[::-1], den[::-1], {"K": float(K), **values})


def rounded(num: Array, den: Array, values: dict[str, float]) -> Controller:
    """Return the controller as it is printed, to nine digits: what is judged is what the user gets."""
    size = den[np.flatnonzero(den)[0]]
    nine = [[float(f"{x / size:.9g}") for x in p] for p in (num, den)]
    return Controller(tuple(nine[0]), tuple(nine[1]), values)
