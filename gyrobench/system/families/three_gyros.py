"""Three floated gyros on the inner element of three gimbals, and their stabilizers: what systems of them share.

[GYRO-OA-COUPLING-Y2, PLATFORM-1AXIS]
"""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.families.loop_test import AXES, data_sheet, torquer
from gyrobench.system.part_values import PartValues

# rows: gyro axes I, O, S in platform axes [GYRO-OA-COUPLING-Y2]
MOUNTS = {
    "gyro_x": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "gyro_y": [[0, 1, 0], [0, 0, 1], [1, 0, 0]],
    "gyro_z": [[0, 0, 1], [0, -1, 0], [1, 0, 0]],
}
GYRO = {"H": 0.02, "J": 2.5e-5, "C": 0.02, "K_sg": 10.0, "u_max": 0.2}  # of these systems [GYRO-SDF-EOM]
MOTOR = {"k_t": 1.0, "R": 1.0, "L": 0.0, "k_e": 0.0}  # driven by current: 1 N.m a volt, no back EMF
LIMIT = 48.0  # A, V


def commands(source: str) -> dict[str, Any]:
    """Return the wires from commanded rates ("exciter.command") to the torquers, with their factors."""
    return {f"{source}[{k}] -> {gyro}.i": torquer(f"{gyro}.k", 9) for k, gyro in enumerate(MOUNTS, 1)}


def design(parts: PartValues, crossover: float) -> dict[str, Any]:
    """Return the parameters of motors, gyros and stabilizers whose loops cross at ``crossover``, Hz."""
    found: dict[str, Any] = {
        **parts.all_given({f"platform.{n}": [x] * 3 for n, x in MOTOR.items()}),
        "platform.i_max": [LIMIT] * 3,
    }
    for k, (axis, (slot, mount)) in enumerate(zip(AXES, MOUNTS.items(), strict=True)):
        gyro = {n: parts.given(f"{slot}.{n}", x) for n, x in GYRO.items()}
        found |= {f"{slot}.mount": mount, f"{slot}.reaction": True, **{f"{slot}.{n}": x for n, x in gyro.items()}}
        found[f"{slot}.k"] = data_sheet(parts[f"{slot}.k"])
        motor = found["platform.k_t"][k] / found["platform.R"][k]
        law = stabilizer(crossover, neutral_inertia(parts)[k], motor, gyro)
        found |= {f"{axis}.{n}?": x for n, x in law.items()}
    return found


def neutral_inertia(parts: PartValues) -> list[float]:
    """Return the inertia about each motor axis (A order) at joint angles 0, to which each drive is normalized."""
    roll, pitch, inner = (parts[f"platform.{name}"] for name in ("I_r", "I_f", "I_a"))
    return [pitch[0] + inner[0], roll[1] + pitch[1] + inner[1], inner[2]]


def stabilizer(crossover: float, inertia: float, motor: float, gyro: dict[str, float]) -> dict[str, float]:
    """Return F of PLATFORM-1AXIS: (1 + wc/(15 s))(1 + 4 s/wc)/(1 + s/(4 wc)), K so that the loop crosses at wc.

    L = K F K_sg (H/C)/(s (tau s + 1)) k_t/R / (J s), J the neutral inertia of the axis; motor: k_t/R.
    """
    wc = 2.0 * math.pi * crossover
    s = 1j * wc
    f = (1 + 1 / 15j) * (1 + 4j) / (1 + 0.25j)
    sensor = gyro["K_sg"] * gyro["H"] / gyro["C"] / (s * (gyro["J"] / gyro["C"] * s + 1))
    K = 1.0 / abs(f * sensor / (inertia * s)) / motor
    return {"K": K, "tau1": 1.0, "T1": 1.0, "tau2": 4 / wc, "T2": 0.25 / wc, "integral": wc / 15, "v_max": LIMIT}
