"""The six instruments of an inertial measurement unit: names, and the coefficients of each with their units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gyrobench.frames import G0
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.sentences import told
from gyrobench.result import Coefficient
from gyrobench.units import ARCSEC, DPH

UG = 1e-6 * G0  # m/s2
AXES = "xyz"
#: printed unit -> SI, of coefficients that do not follow the temperature
SCALES = {
    "ppm": 1e-6, "″": ARCSEC, "°/h": DPH, "°/h/g": DPH, "µg": UG, "counts": 1.0, "counts/(rad/s)": 1.0,
    "counts/(m/s²)": 1.0,
}  # fmt: skip


@dataclass(frozen=True)
class ImuInstrument:
    """One instrument.  kind: "g" gyro or "a" accelerometer.  axis: 0, 1, 2."""

    kind: str
    axis: int

    @property
    def name(self) -> str:
        """Short name, of columns: gx, ay."""
        return self.kind + AXES[self.axis]

    @property
    def letter(self) -> str:
        return AXES[self.axis]

    @property
    def gyro(self) -> bool:
        return self.kind == "g"

    @property
    def output(self) -> str:
        """Output of the part that it is."""
        return "rate" if self.gyro else "f_read"

    @property
    def words(self) -> str:
        return f"{'gyro' if self.gyro else 'accelerometer'} {self.letter}"

    def names(self, seen: Sequence[int] = (0, 1, 2)) -> list[str]:
        """Return the coefficients: bias, row of the matrix along ``seen``, g-sensitivity of a gyro."""
        matrix = [f"S{self.kind}_{self.letter}{AXES[k]}" for k in seen]
        sensitivity = [f"G_{self.letter}{a}" for a in AXES] if self.gyro else []
        return [f"b{self.kind}_{self.letter}", *matrix, *sensitivity]

    def quantity(self, name: str, truth: Mapping[str, float]) -> Quantity:
        """Return a coefficient with its meaning and unit."""
        what, _, along = name.partition("_")
        if what.startswith("b"):
            unit = ("deg/h") if self.gyro else "ug"
            return Quantity.of(name, f"bias of the {self.words}", unit, truth.get(name))
        if what == "G":
            meaning = f"rate of the {self.words} per g along {along[1]}"
            return Quantity(name, meaning, "°/h/g", DPH, truth.get(name))
        if along[0] == along[1]:
            return Quantity.of(name, f"scale factor error of the {self.words}", "ppm", truth.get(name))
        meaning = f"input axis of the {self.words} towards {along[1]}"
        return Quantity.of(name, meaning, "arcsec", truth.get(name))


CHANNELS = tuple(ImuInstrument(kind, axis) for kind in "ga" for axis in range(3))
BY_NAME = {c.name: c for c in CHANNELS}

_PARAMETERS = {"bg": "gyro_bias", "Sg": "gyro_scale", "G": "g_sensitivity", "ba": "acc_bias", "Sa": "acc_scale"}


def instruments_of(
    parameters: Mapping[str, Any], thermal_parameters: Mapping[str, tuple[str, str]]
) -> dict[str, float] | None:
    """Return the coefficients of the simulated instruments, SI; None where they have none."""
    found: dict[str, float] = {}
    for short, long in _PARAMETERS.items():
        if f"imu.{long}" not in parameters:
            return None
        values = np.asarray(parameters[f"imu.{long}"], dtype=float)
        for i, a in enumerate(AXES):
            row = np.atleast_1d(values[i]) if values.ndim == 1 else values[i]
            names = [f"{short}_{a}"] if values.ndim == 1 else [f"{short}_{a}{b}" for b in AXES]
            found |= dict(zip(names, map(float, row), strict=True))
    for name, (short, _) in thermal_parameters.items():
        if f"imu.{name}" in parameters:
            found |= {f"{short}_{a}": float(v) for a, v in zip(AXES, parameters[f"imu.{name}"], strict=True)}
    return found | _own_accelerometers(parameters)


def _own_accelerometers(parameters: Mapping[str, Any]) -> dict[str, float]:
    """Return the coefficients of accelerometers that stand in their own slot, SI; {} where there are none."""
    if "accelerometers.bias" not in parameters:
        return {}
    bias, scale = (np.asarray(parameters[f"accelerometers.{n}"], dtype=float) for n in ("bias", "scale"))
    axes = np.reshape(np.asarray(parameters.get("accelerometers.axes", np.eye(3)), dtype=float), (3, 3))
    matrix = (1.0 + scale[:, None]) * axes - np.eye(3)
    found = {f"ba_{a}": float(b) for a, b in zip(AXES, bias, strict=True)}
    return found | {f"Sa_{a}{b}": float(matrix[i, j]) for i, a in enumerate(AXES) for j, b in enumerate(AXES)}


def overview(every: Sequence[Coefficient]) -> list[str]:
    """Return the largest coefficient of each kind, as sentences."""

    def largest(*prefixes: str, unit: str = "") -> str:
        mine = [c for c in every if c.name.split("_")[0] in prefixes and unit in c.unit]
        return max(mine, key=lambda c: abs(c.estimate)).name if mine else ""

    kinds = (
        ("Largest gyro bias", largest("bg")), ("Largest accelerometer bias", largest("ba")),
        ("Largest scale factor error", largest("Sg", "Sa", unit="ppm")),
        ("Largest misalignment", largest("Sg", "Sa", unit="″")), ("Largest g-sensitivity", largest("G")),
    )  # fmt: skip
    return told(every, *(f"{words}: {n} = {{{n}}}." for words, n in kinds if n))
