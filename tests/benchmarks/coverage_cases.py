"""Cases of coverage.py: test systems on shortened plans, random instruments, supplies, latitudes, and their noise."""

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


@dataclass(frozen=True)
class Noise:
    """One instrument, as noise.NoiseGrid has it, on windows of the length ``window`` (s)."""

    tau: float
    share: float
    reading: float
    window: float

    @property
    def flickers(self) -> bool:
        return self.tau < 0.0

    def flicker(self, size: float) -> float:
        """B of flicker that scatters a window of 1/LASTING of its longest correlation time by ``size``: the mean over T
        has the variance (B^2/pi) (ln(3.17 tau/T) + 3/2 - 0.5772) (docs/methods/north-finders.md).
        """
        if not self.flickers:
            return 0.0
        return size * math.sqrt((1.0 - self.reading) * self.share * math.pi / (math.log(3.17 * LASTING) + 0.9228))

    def white(self, size: float) -> float:
        """Density (unit/sqrt(Hz)) of the white part where a window scatters by ``size``."""
        return size * math.sqrt((1.0 - self.reading) * (1.0 - self.share) * self.window)

    def markov(self, size: float) -> float:
        if self.flickers:
            return 0.0
        v = float(mean_variance(np.array(self.window / self.tau)))
        return size * math.sqrt((1.0 - self.reading) * self.share / v)

    def error(self, size: float) -> float:
        """Standard deviation of one reading."""
        return size * self.window * math.sqrt(self.reading / 2.0)


LASTING = 200.0  # windows: longest correlation time of flicker
#: Corners of the population: correlation time in windows (-1: flicker in its place), share, reading.
CORNERS = {
    "white": (1.0, 0.0, 0.0),
    "markov-1": (1.0, 1.0, 0.0),
    "markov-5": (5.0, 1.0, 0.0),
    "both-3": (3.0, 0.5, 0.0),
    "hidden-8": (8.0, 0.3, 0.0),
    "slow-8": (8.0, 1.0, 0.0),
    "slow-20": (20.0, 0.5, 0.0),
    "slow-1000": (1000.0, 1.0, 0.0),
    "flicker": (-1.0, 1.0, 0.0),
    "flicker-white": (-1.0, 0.5, 0.0),
}


# ---------------------------------------------------------------------------------------------- instruments
def sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


def latitude(low: float, high: float) -> Callable[[Rng], float]:
    return lambda rng: math.radians(rng.uniform(low, high)) * sign(rng)


SIZES = (0.55, 1.3, 0.1)  # deg/h per g^n


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


SIMPLE = [f"{c}_{t}" for c in "xy" for t in ("0", "z", c, f"{c}z")]


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


# ---------------------------------------------------------------------------------------------- noise of the parts
def lasting(n: Noise, sizes: Values) -> Values:
    """Return the sizes with the correlation time of the drift that there is."""
    if n.flickers:
        return {**sizes, "flicker_tau": LASTING * n.window}
    return {**{k: v for k, v in sizes.items() if not k.startswith("flicker")}, "markov_tau": n.tau}


def of_gyro(n: Noise, _: Values, size: float = 0.02 * DPH) -> Values:
    own = {"white": n.white(size), "markov": n.markov(size), "pickoff": 5e-9, "flicker": n.flicker(size)}
    return {f"gyro.{k}": v for k, v in lasting(n, own).items()}


def of_two_channels(n: Noise, _: Values) -> Values:
    size = 0.02 * DPH
    each = {"white": n.white(size), "markov": n.markov(size), "pickoff": 5e-9, "flicker": n.flicker(size)}
    found = lasting(n, {f"{k}_{c}": v for k, v in each.items() for c in "xy"})
    return {f"gyro.{k}": v for k, v in found.items()}


def of_accelerometer(n: Noise, _: Values) -> Values:
    size = 20e-6 * G0
    own = lasting(n, {"white": n.white(size), "markov": n.markov(size)})
    return {f"accelerometer.{k}": v for k, v in own.items()}


def of_encoder(n: Noise, values: Values) -> Values:
    """Errors of the angle readings are quanta."""
    return {**of_gyro(n, values), "table.quantum": n.error(0.02 * DPH) * math.sqrt(12.0)}


def of_encoder_2dof(n: Noise, values: Values) -> Values:
    return {**of_two_channels(n, values), "table.quantum": n.error(0.02 * DPH) * math.sqrt(12.0)}


def of_two_encoders(n: Noise, values: Values) -> Values:
    quantum = n.error(0.02 * DPH) * math.sqrt(12.0)
    return {**of_two_channels(n, values), "outer.quantum": quantum, "inner.quantum": quantum}


def of_pickoff(dwell: float, size: float) -> Callable[[Noise, Values], Values]:
    """Errors of the voltage readings are white noise over the dwell; H = C in the standard gyro."""

    def values(n: Noise, drawn: Values) -> Values:
        gain = drawn.get("gyro.K_sg", 10.0)  # V per rad of the case
        return {**of_gyro(n, drawn, size), "gyro.pickoff": gain * n.error(size) * math.sqrt(dwell)}

    return values


@dataclass(frozen=True)
class Case:
    """A system on a shortened plan."""

    system: str
    values: Values
    truth: Callable[[Rng], Values]
    latitude: Callable[[Rng], float]
    noise: Callable[[Noise, Values], Values] = of_gyro
    attitude: bool = False

    def drawn(self, rng: Rng) -> Values:
        found = {**self.values, **self.truth(rng), "latitude": self.latitude(rng)}
        return {**found, "attitude": attitude(rng)} if self.attitude else found


def of_sizes(sizes: dict[str, float]) -> Callable[[Rng], Values]:
    """Return draws of a floated gyro with such drift terms, deg/h."""
    return lambda rng: {**floated(rng), **{f"gyro.{n}": float(rng.uniform(-s, s)) * DPH for n, s in sizes.items()}}


def unbalanced(rng: Rng) -> Values:
    return {**floated(rng), "gyro.D_S": 50.0 * float(rng.uniform(5.0, 12.0)) * sign(rng) * DPH}


TURNING: Values = {"rate": 0.15, "windows": 24, "dwell": 17.5, "settle": 2.0}
STOPPING: Values = {"stops": 24, "stop_dwell": 1.75, "windows": 24, "dwell": 17.5, "settle": 2.0,
                    "table.index_rate": 1.0, "table.acceleration": 1.0}  # fmt: skip
FAST: Values = {"table.acceleration": 20.0}
POSITIONS: Values = {"dwell": 3.0, "settle": 2.0, "inner_rate": 0.05, "rebalance.i_max": 1.0,
                     "table.index_rate[1]": 1.0, "table.acceleration": [1.0, 1.0]}  # fmt: skip
POLAR: Values = {"site.earth_rate": 500.0 * frames.EARTH_RATE, "cage.i_max": 1.0, "time": 172.4, "window": 4.8,
                 "dwell": 48.0, "settle": 2.0}  # fmt: skip
CASES = {
    "tumble_single_axis": Case("tumble_single_axis", TURNING, floated, latitude(12.0, 78.0)),
    "tumble_single_axis, supplies": Case("tumble_single_axis", TURNING, supplied(130.0), latitude(12.0, 78.0)),
    "tumble_single_axis, stops": Case("tumble_single_axis", STOPPING, floated, latitude(12.0, 78.0)),
    "tumble_two_channel, nine": Case(
        "tumble_two_channel", {**TURNING, **FAST}, two_channels, latitude(20.0, 70.0), of_two_channels
    ),
    "tumble_two_channel, simple": Case(
        "tumble_two_channel", {**TURNING, **FAST, "model": "simple"}, simple_channels, latitude(20.0, 70.0),
        of_two_channels,
    ),
    "tumble_two_axis": Case("tumble_two_axis", POSITIONS, floated, latitude(12.0, 78.0)),
    "eight_position": Case(
        "eight_position", {"dwell": 1.5, "settle": 1.5, "readings": 2}, lambda rng: two_channels(rng, 10),
        latitude(0.0, 70.0), of_two_channels,
    ),
    "table_environment": Case(
        "table_environment", {"dwell": 225.0, "readings": 90, "tilting": 100.0 * ARCSEC, "settle": 2.0}, exposed,
        latitude(0.0, 70.0),
    ),
    "fixed_position": Case("fixed_position", {"dwell": 60.0}, floated, latitude(0.0, 85.0), attitude=True),
    "fixed_position, supplies": Case(
        "fixed_position", {"dwell": 60.0}, supplied(60.0), latitude(0.0, 85.0), attitude=True
    ),
    "fixed_position, supplies in steps": Case(
        "fixed_position", {"dwell": 60.0}, supplied(60.0, "step"), latitude(0.0, 85.0), attitude=True
    ),
    "fixed_position, supplies with ripple": Case(
        "fixed_position", {"dwell": 60.0}, supplied(60.0, "swing"), latitude(0.0, 85.0), attitude=True
    ),
    "servo_vertical_level, supplies": Case(
        "servo_vertical_level", {"dwell": 80.0, "cycles": 1, "settle": 2.0}, supplied(550.0), latitude(0.0, 70.0),
        of_encoder,
    ),
    "open_loop_drift": Case(
        "open_loop_drift", {"wait": 2.0, "dwell": 0.1}, floated, latitude(0.0, 85.0), of_pickoff(0.1, 0.02 * DPH),
        attitude=True,
    ),
    "accelerometer_multipoint": Case(
        "accelerometer_multipoint", {"dwell": 1.0, "settle": 1.0}, accelerometer, latitude(0.0, 85.0), of_accelerometer
    ),
    "accelerometer_multipoint, 12": Case(
        "accelerometer_multipoint", {"dwell": 1.0, "settle": 1.0, "points": 12, "mounts": "a"}, accelerometer,
        latitude(0.0, 85.0), of_accelerometer,
    ),
    "servo_vertical_level": Case(
        "servo_vertical_level", {"dwell": 80.0, "cycles": 1, "settle": 2.0}, floated, latitude(0.0, 70.0), of_encoder
    ),
    "servo_polar": Case("servo_polar", POLAR, floated, latitude(12.0, 78.0), of_encoder),
    "servo_two_axis": Case(
        "servo_two_axis",
        {"site.earth_rate": 500.0 * frames.EARTH_RATE, "cage_x.i_max": 10.0, "cage_y.i_max": 10.0, "time": 172.8,
         "window": 2.4, "settle": 2.0},
        two_channels, latitude(30.0, 68.0), of_two_encoders,
    ),
    "servo_two_axis, levelled": Case(
        "servo_two_axis",
        {"levelled": True, "mounts": "1 2 8", "time": 60.0, "window": 1.0, "settle": 2.0},
        two_channels, latitude(0.0, 80.0), of_two_encoders,
    ),
    "pickoff_scale_factor": Case(
        "pickoff_scale_factor", {}, lambda rng: {**floated(rng), "gyro.K_sg": rng.uniform(8.0, 10.0)},
        latitude(0.0, 85.0), of_pickoff(0.1, 0.1 * DPH),
    ),
    "torquer_scale_factor": Case(
        "torquer_scale_factor",
        {"currents": "5 10 20 40 70 100", "range": "0.5deg", "range_large": "5deg", "windows": 10},
        torquer, latitude(0.0, 85.0), of_encoder,
    ),
    "rebalance_loop_test": Case(
        "rebalance_loop_test", {"gate": 0.5, "rest": 20, "readings": 6, "settle": 1.5}, pulses, latitude(0.0, 85.0)
    ),
}  # fmt: skip

#: counted here alone, without a short count among the tests
ALONE = {
    "tumble_two_axis, supplies": Case("tumble_two_axis", POSITIONS, supplied(310.0), latitude(12.0, 78.0)),
    "servo_polar, supplies": Case("servo_polar", POLAR, supplied(450.0), latitude(12.0, 78.0), of_encoder),
    "servo_polar, y axis": Case(
        "servo_polar",
        {**POLAR, "channel": "y", "lock.i_max": 10.0},
        two_channels, latitude(12.0, 78.0), of_encoder_2dof,
    ),
    "position_sensitivity": Case(
        "position_sensitivity", {"dwell": 10.0, "settle": 1.0}, on_springs, latitude(0.0, 85.0), of_two_channels,
        attitude=True,
    ),
}  # fmt: skip
ALL = CASES | ALONE

#: gyros of large drift, counted where they are named.  Polar: the table turns by a third to twice its mean rate; drift
#: and Earth rate fifty times larger than in a real day
ASKED = {
    "large drift, servo_vertical_level": Case(
        "servo_vertical_level", {"dwell": 80.0, "cycles": 1, "settle": 2.0},
        of_sizes({"D_F": 30.0, "D_I": 10.0, "D_S": 10.0}), latitude(0.0, 70.0), of_encoder,
    ),
    "large drift, servo_polar": Case(
        "servo_polar",
        {"site.earth_rate": 50.0 * frames.EARTH_RATE, "cage.i_max": 1.0, "time": 1724.0, "turns": 1, "window": 24.0,
         "dwell": 240.0, "settle": 2.0, "table.capture_rate": 250.0},
        unbalanced, latitude(12.0, 78.0), of_encoder,
    ),
}  # fmt: skip
