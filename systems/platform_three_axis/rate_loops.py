"""The platform of Xia 2008: rebalanced rate gyros, T2, and current, rate and position loops on each axis.

    gyro -> rebalance -> (estimator) -> decoupler -> servo_three_loop -> motor          u_A = T2 u,  1 V is 1 rad/s
    exciter -> commands (T2) -> servo_three_loop.command

The floats are held by their torquers, so that the currents are the rates (k i = omega - omega_d); commanded rates pass
a T2 of their own, as the torquers are taken.  [SERVO-3LOOP, PLATFORM-3AXIS-DYN, DECOUPLE-T2; Xia 2008, sections 1.3.2,
5.2.2, fig. 1.3, 5.2.4]
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from gyrobench.system.families import loop_test as loop
from gyrobench.system.families import three_gyros
from gyrobench.system.families.loop_test import AXES
from gyrobench.system.families.three_gyros import MOUNTS, neutral_inertia
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import OnRequest, Slot

REBALANCE = 100.0  # Hz, bandwidth of the rebalance loops: the float follows with 2 pi this
CURRENT = 500.0  # Hz, crossover of the current loops
CORNER = 0.2  # of the integral of the rate loops, over their crossover
SLOWER = 0.2  # most of the crossover that a position loop may have: a fifth of the rate loop
LIMIT = 24.0  # A
RANGE = 2.0  # rad/s, of the rate gyros
GYRO = {**three_gyros.GYRO, "k": 1.0}  # a torquer that reaches it: 1 rad/s/A
NAMES = {f"rebalance_{axis}": gyro for axis, gyro in zip("xyz", MOUNTS, strict=True)}


def _volts(gyro: str) -> Callable[[PartValues], float]:
    """Return the factor from the current of a torquer to a signal of 1 V for 1 rad/s."""
    return lambda parts: float(parts.given(f"{gyro}.k", GYRO["k"]))


#: wires that turn one quantity into another, with their factors
FACTORS: dict[str, Any] = {
    **{f"{slot}.i_read -> decoupler.u[{k}]": _volts(gyro) for k, (slot, gyro) in enumerate(NAMES.items(), 1)},
    **{f"exciter.command[{k}] -> commands.u[{k}]": 1.0 for k in (1, 2, 3)},
    **{f"commands.u_axes[{k}] -> {axis}.command": 1.0 for k, axis in enumerate(AXES, 1)},
}
WIRES = "\n".join(FACTORS) + "\nplatform -> commands: theta\n" + "".join(
    f"""
    platform -> {gyro}: omega alpha f
    {gyro}.M_react[{k}] -> platform.M_gyro[{k}]
    {gyro} -> {slot}: u
    {slot} -> {gyro}: i
    platform.i_motor[{k}] -> {axis}.i_motor
    platform.theta[{k}] -> {axis}.theta
    """
    for k, (axis, (slot, gyro)) in enumerate(zip(AXES, NAMES.items(), strict=True), 1)
)  # fmt: skip


def slots(servo: str) -> dict[str, Slot]:
    """Return the slots beside those of the platform with angle gyros; servo: the part on each axis."""
    return {
        **{slot: Slot("Rebalance", "rebalance_analog") for slot in NAMES},
        "commands": Slot("Decoupler", "decoupler_t2"),
        **{axis: loop.stabilizer(servo, "rate") for axis in AXES},
    }


def on_request() -> tuple[dict[str, OnRequest], dict[str, Any]]:
    """Return the estimators, each between a rebalance and the decoupler, and the factors of their wires."""
    found, factors = {}, dict[str, Any]()
    for k, (slot, gyro) in enumerate(NAMES.items(), 1):
        name, old = f"estimator_{slot[-1]}", f"{slot}.i_read -> decoupler.u[{k}]"
        first, last = f"{slot}.i_read -> {name}.z", f"{name}.estimate -> decoupler.u[{k}]"
        factors |= {first: _volts(gyro), last: 1.0}
        found[name] = OnRequest(
            {name: Slot("Estimator", "estimator_none")},
            f"{first}\n{last}",
            channels=(f"{slot}.i_read", f"{name}.estimate"),
            instead_of=old,
        )
    return found, factors


def design(
    parts: PartValues, crossover: float, track: float, start: Sequence[float], motors: dict[str, float]
) -> dict[str, Any]:
    """Return the parameters of motors, gyros, rebalances and servos.

    crossover: of the rate loops, Hz, at the neutral inertia of each axis.  track: of the position loops, Hz; 0: none.
    start: joint angles (A order), which these hold.  motors: of the platform, unless given.  Rate loop
    K_w k_t (1 + wi/s)/(J s); the current loop cancels L s + R.
    """
    wc = 2.0 * math.pi * crossover
    found: dict[str, Any] = {**parts.all_given({f"platform.{n}": [x] * 3 for n, x in motors.items()})}
    found["platform.i_max"] = [LIMIT] * 3
    inertia = neutral_inertia(parts)
    for k, (axis, (slot, gyro), mount) in enumerate(zip(AXES, NAMES.items(), MOUNTS.values(), strict=True)):
        g = {n: parts.given(f"{gyro}.{n}", x) for n, x in GYRO.items()}
        gain = 2.0 * math.pi * REBALANCE / (g["k"] * g["K_sg"]) * (g["C"] / g["H"])
        found |= {f"{gyro}.mount": mount, f"{gyro}.reaction": True, **{f"{gyro}.{n}": x for n, x in g.items()}}
        loops = {"K_p?": gain, "K_i?": 0.0, "i_max?": RANGE / g["k"], "I?": RANGE / g["k"]}
        found |= {f"{slot}.{n}": x for n, x in loops.items()}
        k_t, R, L = (found[f"platform.{n}"][k] for n in ("k_t", "R", "L"))
        integral = CORNER * wc
        K_w = wc * inertia[k] / k_t / abs(1.0 + integral / (1j * wc))
        law = {"K_u": 1.0, "K_w": K_w, "K_wi": K_w * integral, "K_p": 2.0 * math.pi * track, "i_max": LIMIT}
        law["theta_wish"] = start[k]
        law |= {"K_c": 2.0 * math.pi * CURRENT * L, "K_ci": 2.0 * math.pi * CURRENT * R}
        found |= {f"{axis}.{n}?": x for n, x in law.items()}
    return found
