"""Random instruments, sites and noise of the cases that coverage.py counts."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.reduction.estimation.noise import mean_variance

DPH, ARCSEC, G0 = math.pi / 648000.0, math.pi / 648000.0, 9.80665
KU = 1e3 * DPH  # deg/h/mA
Values = dict[str, Any]
Rng = np.random.Generator
SIZES = (0.55, 1.3, 0.1)  # deg/h per g^n
SIMPLE = [f"{c}_{t}" for c in "xy" for t in ("0", "z", c, f"{c}z")]


@dataclass(frozen=True)
class Noise:
    """One instrument, as noise.NoiseGrid has it, on windows of the length ``window`` (s)."""

    tau: float
    share: float
    reading: float
    window: float

    def white(self, size: float) -> float:
        """Density (unit/sqrt(Hz)) of the white part where a window scatters by ``size``."""
        return size * math.sqrt((1.0 - self.reading) * (1.0 - self.share) * self.window)

    def markov(self, size: float) -> float:
        v = float(mean_variance(np.array(self.window / self.tau)))
        return size * math.sqrt((1.0 - self.reading) * self.share / v)

    def error(self, size: float) -> float:
        """Standard deviation of one reading."""
        return size * self.window * math.sqrt(self.reading / 2.0)


# ---------------------------------------------------------------------------------------------- instruments
def sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def latitude(low: float, high: float) -> Callable[[Rng], float]:
    return lambda rng: math.radians(rng.uniform(low, high)) * sign(rng)


def floated(rng: Rng) -> Values:
    return {f"gyro.{n}": rng.uniform(-1.0, 1.0) * SIZES[drift.order(n)] * DPH for n in drift.terms(9)}


def two_channels(rng: Rng, terms: int = 9) -> Values:
    found: Values = {"gyro.k_x": rng.uniform(15.0, 19.0) * KU, "gyro.k_y": rng.uniform(15.0, 19.0) * KU}
    for c in "xy":
        found[f"gyro.terms_{c}"] = terms
        for n in drift.terms_2dof(c, terms):
            found[f"gyro.{n}"] = rng.uniform(-1.0, 1.0) * SIZES[drift.order(n)] * DPH
    return found


def on_springs(rng: Rng) -> Values:
    """Two channels whose rotor is on springs, and pickoffs that are off null."""
    null = {f"gyro.null_{a}": rng.uniform(-10.0, 10.0) * ARCSEC for a in "xy"}
    return {**two_channels(rng), **null, "gyro.K_q": rng.uniform(-0.03, 0.03), "gyro.K_phi": rng.uniform(0.0, 0.03)}


def simple_channels(rng: Rng) -> Values:
    """The four terms a channel of the simple model; the others are 0."""
    return {n: v if n[6:] in SIMPLE or ".k" in n or "terms" in n else 0.0 for n, v in two_channels(rng).items()}


def attitude(rng: Rng) -> str:
    return json.dumps(frames.rotation(rng.normal(size=3), rng.uniform(0.0, math.pi)).tolist())


def accelerometer(rng: Rng) -> Values:
    k = {f"accelerometer.k{j}": rng.uniform(-2e-4, 2e-4) for j in range(6)}
    tilt = rng.uniform(-70.0, 70.0, 2) * ARCSEC
    mount = frames.rotation(np.array([0.0, tilt[0], tilt[1]]), float(np.hypot(*tilt)))
    return {**k, "accelerometer.k1": rng.uniform(0.99, 1.01), "accelerometer.mount": mount.tolist()}


def torquer(rng: Rng) -> Values:
    """Half of them are proportional: only those have a K_LS."""
    return {**floated(rng), "gyro.k": rng.uniform(17.0, 17.4) * KU, "gyro.k3": rng.uniform(-0.1, 0.1) * rng.integers(2)}


def pulses(rng: Rng) -> Values:
    """Currents wrong by some parts in a thousand, edges by some hundred ns."""
    late = rng.normal(size=3) * 3e-7
    size = 3.6 / 17.2 * 2e-3
    return {"rebalance.dI_plus": rng.normal() * size, "rebalance.dI_minus": rng.normal() * size,
            "rebalance.dT": late.tolist()}  # fmt: skip


def exposed(rng: Rng) -> Values:
    """A gyro with sensitivities of either sign, up to twice those of the test sensor of Hu 1981."""
    sizes = {"D_T": 0.02, "D_TO": 0.05, "D_B[1]": 12.0}
    return {**floated(rng), **{f"gyro.{n}": rng.uniform(-1.0, 1.0) * v * DPH for n, v in sizes.items()}}


def supplied(length: float, way: str = "ramp") -> Callable[[Rng], Values]:
    """A gyro whose supplies are off, and drift over a record of some ``length`` (s), by what is stated of them.

    way: "step" or "swing", a ripple, of the size stated in place of the drift: what the budget does not know.
    """
    supplies = {
        "frequency": ("wheel_frequency", 1e-3),
        "voltage": ("wheel_voltage", 1e-2),
        "asymmetry": ("wheel_phase", 1e-2),
        "pickoff": ("pickoff_excitation", 1e-2),
        "torquer": ("torquer_excitation", 1e-2),
    }

    def values(rng: Rng) -> Values:
        does = {
            f"gyro.{n}": rng.uniform(-1.0, 1.0) * DPH
            for n in ("D_pickoff", "D_torquer", "D_UI", "D_US", "D_PI", "D_PS")
        }
        found = {**floated(rng), **does, "gyro.k_E": rng.uniform(0.0, 0.1)}
        for name, (option, largest) in supplies.items():
            u = largest * rng.uniform()
            found |= {f"u_{option}": u, f"supply.{name}_offset": u * rng.normal()}
            found[f"supply.{name}_{way}"] = u * rng.normal() / (length if way == "ramp" else 1.0)
        if way != "ramp":
            found |= {"supply.step_time": rng.uniform(0.2, 1.0) * length, "supply.phase": rng.uniform(0.0, 6.28)}
            found["supply.period"] = length * 10.0 ** rng.uniform(-1.3, 0.5)
        return found

    return values
