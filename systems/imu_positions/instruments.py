"""Wires from the table through the instruments to the samplers: the unit, accelerometers of their own, compensator."""

from __future__ import annotations

from collections.abc import Container

from gyrobench.system.families.table_test import sampled

from .channels import CHANNELS

ACCELEROMETERS, COMPENSATOR, CHAMBER = "accelerometers", "compensator", "chamber"  # slots on request


def wires(slots: Container[str] = ()) -> str:
    """Return the wires of the test with these slots on request.

    Every sampler averages one channel; the first brings the outer angle, the second the inner one.
    """
    forces = ACCELEROMETERS if ACCELEROMETERS in slots else "imu"
    angles = [f"table: angle_{'y' if k == 1 else 'x'}_read" for k in range(len(CHANNELS))]
    lines = [
        "site -> table: f=f_local omega=omega_local",
        "sequencer -> table: mode=mode_x mode=mode_y target=target_x target_y face",
        "table -> sequencer: angle_x_read=angle in_position",
        "table -> imu: omega f",
        *(sampled(f"sampler_{c.name}", angle) for c, angle in zip(CHANNELS, angles, strict=True)),
    ]
    if forces != "imu":
        lines.append(f"table -> {forces}: f")
    if COMPENSATOR in slots:
        lines += [f"imu -> {COMPENSATOR}: rate", f"{forces} -> {COMPENSATOR}: f_read"]
    if CHAMBER in slots:
        warm = ("imu", *(s for s in (ACCELEROMETERS, COMPENSATOR) if s in slots))
        lines += [f"{CHAMBER} -> {s}: temperature" for s in warm]
        lines += [f"{CHAMBER} -> thermometer: temperature=x", sampled("thermometer", angles[0])]
    for c in CHANNELS:
        source = f"imu.{c.output}" if c.gyro else f"{forces}.{c.output}"
        if COMPENSATOR in slots:
            source = f"{COMPENSATOR}.{'omega' if c.gyro else 'f'}"
        lines.append(f"{source}[{c.axis + 1}] -> sampler_{c.name}.x")
    return "\n".join(lines)
