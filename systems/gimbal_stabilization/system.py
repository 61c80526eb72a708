"""Stabilized line of sight: a gimbal of two axes, a rate gyro on the inner gimbal, two loops, a base that vibrates."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.record.vibration_spectrum import VibrationSpectrum
from gyrobench.system.families.sight_test import AXES, SightTest
from gyrobench.system.line_of_sight import Density, LineOfSight


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

    def line_of_sight(self, parameters: Mapping[str, Any]) -> LineOfSight:
        """Return what makes the line of sight jitter, for a jitter that is wanted of a loop."""
        spectrum, scale = self.spectrum(), float(parameters.get("vibration.scale", 1.0)) ** 2

        def rate(axis: int) -> Density:
            return lambda f: scale * spectrum.density("rate", axis, f) if spectrum else np.zeros(f.size)

        white = 2.0 * float(parameters.get("gyro.white", 0.0)) ** 2
        band, K = float(parameters.get("gyro.bandwidth", np.inf)), float(parameters.get("decoupler.K", 1.0))

        def noise(axis: str) -> Density:
            gain = K if axis == self.inner else K / math.cos(self[self.inner])
            return lambda f: white * gain**2 / (1.0 + (f / band) ** 4)

        free, slipping = self.slips(parameters, spectrum, math.sqrt(scale)) if spectrum else ({}, {})
        return LineOfSight(
            self["jitter_from"], (rate(0), rate(1), rate(2)), {a: noise(a) for a in AXES}, free=free, slipping=slipping
        )

    def slips(
        self, parameters: Mapping[str, Any], spectrum: VibrationSpectrum, scale: float
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the gimbal without dry friction, and with viscous friction for it; {}, {} where the joints stick.

        A line of sight at rest leaves the base's rate to the joints, v rms.  Friction M that slips makes torques of M
        rms, as viscous friction M / v does; they slip where the angle exceeds presliding.
        """
        most = np.maximum(parameters["platform.friction"], parameters["platform.stiction"])
        f = np.geomspace(spectrum.f[0], spectrum.f[-1], 2000)
        density = np.array([spectrum.density("rate", k, f) for k in range(3)]) * scale**2
        squares = [np.atleast_1d(np.trapezoid(density / x**2, f, axis=1)) for x in (1.0, 2.0 * np.pi * f)]
        k_in, k_out = (0, 2) if self.inner == "pitch" else (2, 0)
        c, s = (fun(self["yaw" if self.inner == "pitch" else "pitch"]) ** 2 for fun in (math.cos, math.sin))
        rate, angle = (np.sqrt([
            c * x[k_in] + s * x[1], x[k_out] + math.tan(self[self.inner]) ** 2 * (c * x[1] + s * x[k_in])
        ]) for x in squares)  # fmt: skip
        rate, angle = (x if self.inner == "pitch" else x[::-1] for x in (rate, angle))  # pitch, yaw
        if not np.any(most) or not np.all(angle > float(parameters["platform.presliding"])):
            return {}, {}
        free = {"platform.friction": [0.0, 0.0], "platform.stiction": [0.0, 0.0]}
        viscous = np.asarray(parameters["platform.viscous"]) + np.asarray(parameters["platform.friction"]) / rate
        return free, {**free, "platform.viscous": viscous.tolist()}
