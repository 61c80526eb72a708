"""Stabilized line of sight: a gimbal of two axes, a rate gyro on the inner gimbal, two loops, a base that vibrates."""

from __future__ import annotations

from gyrobench.system.families.sight_test import AXES, SightTest


class GimbalStabilization(SightTest):
    """A rate gyro on the inner gimbal measures the rates of the line of sight; a proportional-integral controller with
    a notch on each axis holds them at 0, the outer one with 1/cos of the inner angle.

    [GIMBAL-2AXIS, LOS-JITTER, BASE-PSD; Masten 2008, Hilkert 2008]
    """

    title = "Stabilized line of sight on a gimbal of two axes"
    reduction = "reduction"
    slots = SightTest.with_parts(
        motion="base_motion", load="load_torque", vibration="base_vibration", platform="gimbal_two_axis",
        gyro="gyro_mems", decoupler="decoupler_los", pitch="stabilizer_lti", yaw="stabilizer_lti",
    )  # fmt: skip
    wires = SightTest.wires + "".join(
        f"exciter.command[{three}] -> decoupler.command[{two}]\n" for two, three in AXES.values()
    )
