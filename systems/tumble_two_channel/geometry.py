"""Mounts and models of the two-channel tumble.  [TUM2A-GEOM, TUM2B-GEOM; Hu 1981, eq. 3-22..3-36]

The spin axis z lies along the table axis, and that along the pole p; table axes at angle 0: E, p x E, p.  Rows of a
face: gyro axes x, y, z (outer gimbal, inner gimbal, spin) in table axes.  With theta = -angle (against the Earth),
c = cos phi, s = sin phi and gravity g = gamma g0, the drift's arguments (X, Y, Z) = -f/g0 are

    simple   mount 1  z = +p, y(0) = -E    gamma (c cos theta, +c sin theta, -s)
             mount 2  z = -p, y(0) = +E    gamma (c cos theta, -c sin theta, +s)
    nine     mount 1  z = +p, x(0) = -E    gamma (c sin theta, -c cos theta, -s)
             mount 2  z = -p, x(0) = -E    gamma (c sin theta, +c cos theta, +s)
             static 3 x = E, y = U         gamma (0, -1, 0)
             static 4 x = E, y = -U        gamma (0, +1, 0)
"""

from __future__ import annotations

import math

import numpy as np

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.reduction.estimation import regression

MODELS = ("simple", "nine")
TILT = {"x": "ε_xz", "y": "ε_yz"}  # tilt of a measuring axis towards the spin axis, as an unknown
AXIS = {"x": 0, "y": 1}
#: of the simple model, in the order of the R, u, u_z, Q of Hu 1981
SIMPLE = {"x": ("Dx_0", "Dx_x", "Dx_z", "Dx_xz"), "y": ("Dy_0", "Dy_y", "Dy_z", "Dy_yz")}

SQUARES = {"x": "Dx_yy", "y": "Dy_xx"}  # of each channel, what cannot be told from the others at constant |g|


def terms(model: str, channel: str) -> tuple[str, ...]:
    """Return the coefficient names of a channel (x, y) in a model (simple, nine)."""
    return SIMPLE[channel] if model == "simple" else drift.terms_2dof(channel, 9)


def faces(model: str, latitude: float) -> dict[str, Array]:
    """Return the mounts by name, rows x, y, z in table axes at angle 0."""
    x, y, z = np.eye(3)
    if model == "simple":
        return {"mount 1": np.array([y, -x, z]), "mount 2": np.array([y, x, -z])}
    rest = frames.tumble_faces(latitude)
    return {
        "mount 1": np.array([-x, -y, z]),
        "mount 2": np.array([-x, y, -z]),
        "static 3": rest["static 3"],
        "static 4": rest["static 4"],
    }


def design(model: str, channel: str, latitude: float, points: int = 36) -> Array:
    """Return the regressors of a channel in ``points`` attitudes a mount and both dwells, gamma = 1."""
    base, rows = frames.polar_base(latitude), []
    for name, face in faces(model, latitude).items():
        turn = np.arange(points) * 2.0 * math.pi / points if name.startswith("mount") else [0.0]
        rows += [frames.to_face(-frames.U, face, base, a) for a in turn]
    return drift.regressors(np.array(rows), terms(model, channel))


def refusals(latitude: float, model: str) -> list[str]:
    """Return why a test at ``latitude`` (rad) cannot give the coefficients of ``model``, as sentences; [TUM2B-SING]."""
    if model not in MODELS:
        return [f"model = {model}: no such model; there are {' and '.join(MODELS)}"]
    if problems := frames.latitude_problems(latitude):
        return problems
    if 10.0 <= round(abs(math.degrees(latitude)), 9) <= 80.0:
        return []
    seen = {c: regression.examine(design(model, c, latitude), terms(model, c)) for c in "xy"}
    short = any(found.short for found in seen.values())
    words = [f"{c} channel: {found.weakness}" for c, found in seen.items() if found.short or not short]
    return [f"latitude {math.degrees(latitude):.4g}° (10° to 80° north or south is possible): {'; '.join(words)}"]


def cautions(latitude: float) -> list[str]:
    """Return what to expect outside 20 to 70 degrees."""
    size = abs(math.degrees(latitude))
    if 20.0 <= round(size, 9) <= 70.0:
        return []
    where = f"Latitude {math.degrees(latitude):.4g}°, outside 20° to 70°: "
    if size < 45.0:
        return [where + "sin φ is small, the spin axis is nearly level; what comes from its share of gravity is weak."]
    return [where + "cos φ is small, little gravity turns about the table axis; what comes from it is weak."]
