"""Attitudes of an instrument at a site: from words (``E U -N``) or a matrix, and the named ones of the servo tests.

>>> C = parse("E U", latitude)              # rows I, O, S in E, N, U
>>> C = on_servo_table("x down", latitude)  # rows x, y, z with the table at angle 0
"""

from __future__ import annotations

import math

import numpy as np

from gyrobench import frames, reading
from gyrobench.arrays import Array
from gyrobench.frames import E, N, U


def directions(latitude: float) -> dict[str, Array]:
    """E east, N north, U up, P pole of the sky, Q = E x P; minus: the opposite."""
    pole = frames.pole(latitude)
    return {"E": E, "N": N, "U": U, "P": pole, "Q": np.cross(E, pole)}


def parse(text: str, latitude: float) -> Array:
    """Rows I, O, S in (E, N, U) of ``text``: two or three directions (S = I x O), or a matrix [[..], [..], [..]].

    Raises ValueError saying what is wrong: unknown words, axes not at right angles, a left-handed set.
    """
    if text.strip().startswith("["):
        try:
            rows = np.array(reading.json_value(text, "attitude", ValueError), dtype=float)
        except (ValueError, TypeError):
            raise ValueError(
                f"attitude = {reading.shorten(text)}: no 3x3 matrix of numbers; write [[a, b, c], [d, e, f], [g, h, i]]"
            ) from None
        return frames.check_rotation(rows, "attitude")
    known, found = directions(latitude), []
    words = text.replace(",", " ").split()
    for word in words:
        name = word.lstrip("+-−")
        if name not in known or len(word) - len(name) > 1:
            raise ValueError(f"attitude = '{text}': '{word}' is none of {', '.join(known)}, with or without minus")
        found.append(-known[name] if word[0] in "-−" else known[name])
    if len(found) not in (2, 3):
        raise ValueError(f"attitude = '{text}': {len(found)} directions; give those of I and O, or of I, O and S")
    if abs(float(found[0] @ found[1])) > 1e-9:
        degrees = math.degrees(math.acos(max(-1.0, min(1.0, float(found[0] @ found[1])))))
        raise ValueError(f"attitude = '{text}': I and O are {degrees:.3g}° apart, they must be at right angles")
    found = found if len(found) == 3 else [*found, np.cross(found[0], found[1])]
    return frames.check_rotation(np.array(found), f"attitude '{text}'")


def attitude_problems(text: str, latitude: float) -> list[str]:
    """Return why a text is no attitude, as a sentence; empty where it is one."""
    try:
        parse(text, latitude)
    except ValueError as error:
        return [str(error)]
    return []


# ------------------------------------------------------------------------ a gyro that holds its table
EAST, NORTH, UP, POLE, CROSS = 1, 2, 3, 4, 5  # E, N, U, P, Q as the part fixture counts them; minus: the opposite
_LEVEL = {
    f"x {name}, {axis} {way}": (x, y if way == up else -y)
    for name, x, horizontal in (("east", EAST, -NORTH), ("north", NORTH, EAST), ("west", -EAST, NORTH),
                                ("south", -NORTH, -EAST))
    for axis, y, up in (("y", UP, "up"), ("z", horizontal, "down"))
    for way in ("up", "down")
}  # fmt: skip
#: attitude -> directions of x (input axis, along the table axis) and y at angle 0; z = x cross y.  Classes 1, 2, 3 of
#: Hu 1981.
SERVO_ATTITUDES: dict[str, tuple[int, int]] = {
    "x down": (-UP, EAST), "x up": (UP, EAST), **_LEVEL, "polar S": (-POLE, -EAST), "polar N": (POLE, -EAST),
}  # fmt: skip
VERTICAL = ("x down", "x up")
LEVEL = tuple(_LEVEL)
POLAR = ("polar S", "polar N")


def axes(x: int, y: int, latitude: float) -> Array:
    """Return the rows x, y, z = x cross y in (E, N, U) of two numbered directions, minus: the opposite."""
    known = dict(enumerate(directions(latitude).values(), 1))
    first, second = (np.sign(k) * known[abs(k)] for k in (x, y))
    return np.array([first, second, np.cross(first, second)])


def on_servo_table(name: str, latitude: float) -> Array:
    """Return the rows x, y, z in (E, N, U) of a named attitude, table at angle 0.  KeyError for an unknown name."""
    return axes(*SERVO_ATTITUDES[name], latitude)
