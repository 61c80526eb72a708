"""The attitude of an instrument from words: ``E U -N``, or a matrix of direction cosines."""

from __future__ import annotations

import json
import math

import numpy as np
from numpy.typing import NDArray

from gyrobench import frames
from gyrobench.frames import E, N, U

Array = NDArray[np.float64]


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
            rows = np.array(json.loads(text), dtype=float)
        except (ValueError, TypeError):
            raise ValueError(
                f"attitude = {text}: no 3x3 matrix of numbers; write [[a, b, c], [d, e, f], [g, h, i]]"
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
