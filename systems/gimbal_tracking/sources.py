"""What moves a tracking error beside the base: noise of the images, motion of the target."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.target_path import along
from gyrobench.reduction.loops import sight_quantities as of_gimbal
from gyrobench.result import SetBy
from gyrobench.system.line_of_sight import Density

TARGET = "motion of the target"
NOISE, RESOLUTION = "noise of the images", "resolution of the images"
FULL = 0.3  # of a pixel: noise from which the remainders of rounding are uniform, and independent of each other


def image_noises(noise: float, pixel: float) -> dict[str, float]:
    """Return source -> rms of an image's error, rad; those of the resolution only where noise covers its steps."""
    found = {NOISE: noise, RESOLUTION: pixel / 12.0**0.5 if noise > FULL * pixel else 0}
    return {name: sigma for name, sigma in found.items() if sigma}


def set_by(source: str, p: Mapping[str, Any]) -> list[SetBy]:
    """Return the quantities that set a source; those of the images within where noise covers the resolution."""
    noise, pixel = (float(p.get(f"tracker.{n}", 0.0)) for n in ("image_noise", "pixel"))
    if source == NOISE:
        return [of_gimbal.of_parameter(p, "tracker.image_noise", "urad", (FULL * pixel, None))]
    if source == RESOLUTION:
        return [of_gimbal.of_parameter(p, "tracker.pixel", "urad", (None, noise / FULL))]
    return of_gimbal.set_by(source, p)


def image_density(period: float, sigma: float) -> Density:
    """Return the density of independent errors that are held from image to image: 2 T sigma2 sinc2(f T)."""
    return lambda f: 2.0 * period * sigma**2 * np.sinc(f * period) ** 2


def prediction(parameters: Mapping[str, Any], f: Array) -> Array:
    """Return the response of the prediction of an error from image to image, 1 without one; f: Hz."""
    p = {n: float(parameters.get(f"tracker.{n}", 0.0)) for n in ("order", "ahead", "bandwidth")}
    if p["order"] < 0.5:
        return np.ones(np.shape(f), complex)
    s, x = 2j * np.pi * f / p["bandwidth"], p["bandwidth"] * p["ahead"]
    if p["order"] < 1.5:
        return np.asarray((1.0 + (2.0**0.5 + x) * s) / (1.0 + 2.0**0.5 * s + s**2))
    ahead = 1.0 + (2.0 + x) * s + (2.0 + 2.0 * x + 0.5 * x * x) * s**2
    return np.asarray(ahead / (1.0 + 2.0 * s + 2.0 * s**2 + s**3))


def target_rates(parameters: Mapping[str, Any], t: Array) -> Array:
    """Return the inertial rates of the direction to the target about x and z, rad/s (2, times).

    parameters: of a run, "target.kind" and so on (components/moving_target); t: s since the motion began.
    """
    p = {n.removeprefix("target."): v for n, v in parameters.items() if n.startswith("target.")}
    kind = round(float(p.get("kind", 0.0)))
    if kind == 3:
        n = int(p["points"])
        angles, rates = along(np.asarray(p["path_t"], float)[:n], np.asarray(p["path"], float)[:n], t)
        return _about(angles[:, 0], angles[:, 1], rates[:, 0], rates[:, 1])
    if kind == 1:
        w = 2.0 * np.pi * float(p["frequency"])
        (r1, r2), (a1, a2), lead = p["rate"], p["amplitude"], float(p["lead"])
        a = r1 * t + a1 * np.sin(w * t)
        b = r2 * t + a2 * (np.sin(w * t + lead) - np.sin(lead))
        da, db = r1 + w * a1 * np.cos(w * t), r2 + w * a2 * np.cos(w * t + lead)
        return _about(a, b, da, db)
    if kind == 2:
        v = np.asarray(p["velocity"], float)
        place = np.array([0.0, float(p["distance"]), 0.0])[:, None] + v[:, None] * t
        return np.asarray(np.cross(place, v, axisa=0).T / np.sum(place**2, axis=0))[[0, 2]]
    return np.zeros((2, t.size))


def _about(a: Array, b: Array, da: Array, db: Array) -> Array:
    """Return the rates about x and z of turns a about x and b about z, which a target that turns with them has."""
    return np.array([da * np.cos(b) + 0.5 * db * np.sin(2.0 * a) * np.sin(b), db * np.cos(a) ** 2])
