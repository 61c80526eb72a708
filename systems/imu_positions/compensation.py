"""Values of the part imu_compensator from a result of the test, and what is left of errors behind it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.bench import UsageError
from gyrobench.frames import G0
from gyrobench.result import Result

from . import thermal
from .channels import AXES, instruments_of
from .tables import SCALES

#: parameter of imu and imu_compensator -> the coefficients of its elements
PARAMETERS = {"gyro_bias": "bg", "gyro_scale": "Sg", "g_sensitivity": "G", "acc_bias": "ba", "acc_scale": "Sa"}
BEYOND = ("bgT4", "baT4", "SgT3", "SaT3")  # powers of the temperature that the part does not have
UNITS = {"gyro_bias": "rad/s", "gyro_scale": "1", "g_sensitivity": "rad/s", "acc_bias": "m/s2", "acc_scale": "1"}


def values_of(result: Result) -> dict[str, tuple[Any, Any, str]]:
    """Return parameter -> (value, standard uncertainty, unit), SI, nested lists; 0 for what was not determined.

    Raises UsageError for a result in counts, whose scale factors are no errors.
    """
    by_name = {c.name: c for c in result.coefficients}
    if counted := [n for n in by_name if n.startswith(("kg_", "ka_"))]:
        raise UsageError(
            f"--fit-to imu_compensator: the record is in counts ({', '.join(counted)}); the part takes rad/s and m/s2. "
            "State the nominal scale factors in a column map"
        )
    if more := [n for n in by_name if n.partition("_")[0] in BEYOND]:
        raise UsageError(
            f"--fit-to imu_compensator: the record shows {', '.join(more)}, powers of the temperature that the part "
            "does not have. Reduce it with nuisances = none (the nearest lower powers), or over narrower temperatures"
        )
    if more := [n for n in by_name if n.startswith("K2_")]:
        raise UsageError(
            f"--fit-to imu_compensator: the record shows {', '.join(more)}, squares of the specific force that the "
            "part does not have. Reduce it with nuisances = none (they are then in bias and scale factor)"
        )

    def of(name: str) -> tuple[float, float]:
        c = by_name.get(name)
        return (0.0, 0.0) if c is None else (c.estimate * SCALES[c.unit], c.u * SCALES[c.unit])

    found: dict[str, tuple[Any, Any, str]] = {}
    for parameter, short in PARAMETERS.items():
        matrix = parameter in ("gyro_scale", "g_sensitivity", "acc_scale")
        names = [[f"{short}_{a}{b}" for b in AXES] if matrix else [f"{short}_{a}"] for a in AXES]
        value, u = (np.array([[of(n)[k] for n in row] for row in names]) for k in (0, 1))
        if not matrix:
            value, u = value[:, 0], u[:, 0]
        found[parameter] = value.tolist(), u.tolist(), UNITS[parameter]
    if any(n in by_name for n in ("bgH_x", "baH_x")):
        for parameter, (short, unit) in thermal.parameters().items():
            held = [of(f"{short}_{a}") for a in AXES]
            found[parameter] = [v for v, _ in held], [u for _, u in held], unit
        found["hysteresis_width"] = float(result.provenance["options"]["hysteresis_width"]), 0.0, "K"
    return found


def truth_of(parameters: Mapping[str, Any]) -> dict[str, float] | None:
    """Return the coefficients of what is read, SI: of the simulated instruments, or behind a compensator of them.

    None behind one that follows the temperature: what it leaves is no polynomial.  Without the scale factors of
    accelerometers with a cubic, which are those of no single force.
    """
    found = _truth(parameters)
    if found is None or not parameters.get("accelerometers.cubic"):
        return found
    return {n: v for n, v in found.items() if n not in ("Sa_xx", "Sa_yy", "Sa_zz")}


def _truth(parameters: Mapping[str, Any]) -> dict[str, float] | None:
    thermal_parameters = thermal.parameters()
    found = instruments_of(parameters, thermal_parameters)
    if found is None or "compensator.gyro_bias" not in parameters:
        return found
    if any(np.any(parameters.get(f"compensator.{n}", 0.0)) for n in thermal_parameters):
        return None
    return left(found, parameters)


def left(truth: Mapping[str, float], parameters: Mapping[str, Any], slot: str = "compensator") -> dict[str, float]:
    """Return the coefficients behind the compensator from those of the instruments, SI.

    f' = Ca ((1 + Sa) f + ba - b^a),   w' = Cg ((1 + Sg) w + bg + G f/g0 - b^g - G^ f'/g0),   C = (1 + S^)^-1
    """

    def of(name: str) -> Array:
        if name[0] == "b":
            return np.array([truth[f"{name}_{a}"] for a in AXES])
        return np.array([[truth[f"{name}_{a}{b}"] for b in AXES] for a in AXES])

    believed = {short: np.asarray(parameters[f"{slot}.{p}"], dtype=float) for p, short in PARAMETERS.items()}
    for short in ("Sg", "G", "Sa"):
        believed[short] = believed[short].reshape(3, 3)
    unit = np.eye(3)
    Ca, Cg = (np.linalg.inv(unit + believed[n]) for n in ("Sa", "Sg"))
    Sa, ba = Ca @ (unit + of("Sa")) - unit, Ca @ (of("ba") - believed["ba"])
    out = {
        "Sa": Sa, "ba": ba, "Sg": Cg @ (unit + of("Sg")) - unit, "G": Cg @ (of("G") - believed["G"] @ (unit + Sa)),
        "bg": Cg @ (of("bg") - believed["bg"] - believed["G"] @ ba / G0),
    }  # fmt: skip
    found = {f"{n}_{a}": float(out[n][i]) for n in ("bg", "ba") for i, a in enumerate(AXES)}
    for n in ("Sg", "G", "Sa"):
        found |= {f"{n}_{a}{b}": float(out[n][i, j]) for i, a in enumerate(AXES) for j, b in enumerate(AXES)}
    return found
