"""The icon of an FMU, drawn from the kind of the part: a grey PNG of 128 x 128 pixels on a transparent ground.

The kind is that of a word in the name of the part, its bases or its blocks; a part of no known kind, and a system, are
boxes with arrows.
"""

from __future__ import annotations

import functools
import re
import struct
import zlib
from collections.abc import Iterable
from itertools import pairwise

import numpy as np

from gyrobench.component import Component

SIZE, HALF_WIDTH = 128, 2.6  # pixels; of a stroke
#: lines by their corners, x y x y ..., and arcs "@" x y radius_x radius_y first last; percent, degrees, y upwards
PICTURES = {
    "compass": "@ 50 50 40 40 0 360, 50 84 60 50 50 16 40 50 50 84, 40 50 60 50",
    "accelerometer": "10 30 90 30 90 70 10 70 10 30, 45 40 65 40 65 60 45 60 45 40, "
    "10 50 17 50 21 58 27 42 33 58 38 50 45 50, 65 50 90 50",
    "unit": "16 16 66 16 66 66 16 66 16 16, 16 66 34 84 84 84 66 66, 84 84 84 34 66 16, @ 41 41 14 14 0 360",
    "platform": "@ 50 50 40 40 0 360, @ 50 50 40 14 0 360, @ 50 50 14 40 0 360, 4 50 10 50, 90 50 96 50",
    "estimator": "8 30 16 62 25 28 33 70 43 40 52 80 62 48 71 82 82 60 92 86, 8 22 92 62",
    "controller": "@ 26 50 12 12 0 360, 2 50 14 50, 7 55 14 50 7 45, 50 34 82 34 82 66 50 66 50 34, 38 50 50 50, "
    "43 55 50 50 43 45, 82 50 98 50, 90 50 90 14 26 14 26 38",
    "motor": "@ 50 50 34 34 0 360, 36 34 36 66 50 46 64 66 64 34, 84 50 98 50",
    "plan": "12 90 12 12 92 12, 12 20 30 20 30 60 52 60 52 36 72 36 72 80 92 80",
    "source": "@ 50 50 40 40 0 360, @ 36 50 14 18 0 180, @ 64 50 14 18 180 360",
    "place": "@ 50 50 40 40 0 360, @ 50 50 16 40 0 360, 10 50 90 50, @ 50 50 35 10 180 360",
    "reader": "@ 50 40 40 40 0 180, 10 40 90 40, 50 40 72 68, @ 50 40 5 5 0 360",
    "gyro": "@ 50 50 14 30 0 360, 50 50 90 50, 10 50 36 50, 10 12 90 12 90 88 10 88 10 12",
    "table": "@ 50 62 38 14 0 360, 50 48 50 16, 25 16 75 16, 50 62 80 70",
    "system": "8 58 40 58 40 86 8 86 8 58, 60 58 92 58 92 86 60 86 60 58, 34 14 66 14 66 42 34 42 34 14, 40 72 60 72, "
    "53 77 60 72 53 67, 76 58 76 28 66 28, 34 28 24 28 24 58",
    "part": "24 24 76 24 76 76 24 76 24 24, 2 50 24 50, 17 55 24 50 17 45, 76 50 98 50, 91 55 98 50 91 45",
}
#: the first that holds is taken
WORDS = (
    ("compass", "compass|north"), ("estimator", "estimator|kalman|attitude|mekf|compensator"),
    ("accelerometer", "accelerometer"), ("unit", "imu|inertial"),
    ("table", "table_(?!command|program)|table$|fixture|index|bracket|wobble"), ("platform", "platform|gimbal"),
    ("controller", "controller|stabilizer|rebalance|servo|decoupler|cage|slaving|current|coupling"),
    ("plan", "sequencer|program|command|supervisor|sampler|monitor|earth_follower"),
    ("motor", "motor|slipring|bearing|tachometer"),
    ("reader", "meter|tracker|increments|inductosyn|gate|inverse|averager|reference|reading|sensor|card|theodolite"),
    ("place", "site|ground|surroundings|foundation|thermostat|chamber"),
    ("source", "source|supply|target|offset|turn_on|exciter|motion|manoeuvre|torque|vibration"),
    ("gyro", "gyro"),
)  # fmt: skip


def kind_of(cls: type[Component]) -> str:
    """Return the kind of a part, a key of PICTURES."""
    blocks = [type(p.block).__name__ for p in cls.placed.values()]
    for names in ([cls.__name__], [b.__name__ for b in cls.__mro__[1:-2]], blocks):
        text = " ".join(re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", n).lower() for n in names)
        for kind, words in WORDS:
            if re.search(words, text):
                return kind
    return "part"


def _corners(stroke: str) -> Iterable[tuple[float, float]]:
    """Return the corners of a stroke, in pixels from above left."""
    if stroke.startswith("@"):
        x, y, rx, ry, first, last = map(float, stroke[1:].split())
        angles = np.radians(np.linspace(first, last, 49))
        points = np.column_stack([x + rx * np.cos(angles), y + ry * np.sin(angles)])
    else:
        points = np.array(stroke.split(), dtype=float).reshape(-1, 2)
    return ((px * SIZE / 100.0, SIZE - py * SIZE / 100.0) for px, py in points)


@functools.cache
def picture(kind: str) -> bytes:
    """Return the PNG of a kind: strokes with soft edges, by the distance of each pixel from them."""
    y, x = np.mgrid[0:SIZE, 0:SIZE] + 0.5
    nearest = np.full((SIZE, SIZE), np.inf)
    for stroke in PICTURES[kind].split(", "):
        for (ax, ay), (bx, by) in pairwise(_corners(stroke)):
            dx, dy = bx - ax, by - ay
            along = np.clip(((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy or 1.0), 0.0, 1.0)
            nearest = np.minimum(nearest, np.hypot(x - ax - along * dx, y - ay - along * dy))
    alpha = np.round(255.0 * np.clip(HALF_WIDTH + 0.5 - nearest, 0.0, 1.0)).astype(np.uint8)
    grey = np.full_like(alpha, 60)
    rows = np.dstack([grey, alpha]).reshape(SIZE, 2 * SIZE)
    return png(SIZE, rows.tobytes())


def png(size: int, pixels: bytes) -> bytes:
    """Return a square PNG of 8-bit grey and alpha."""
    width = 2 * size
    lines = b"".join(b"\0" + pixels[k * width : (k + 1) * width] for k in range(size))

    def chunk(name: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    head = struct.pack(">IIBBBBB", size, size, 8, 4, 0, 0, 0)
    parts: Iterable[bytes] = (chunk(b"IHDR", head), chunk(b"IDAT", zlib.compress(lines, 9)), chunk(b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def icon(kind: str, fmi: int) -> dict[str, bytes]:
    """Return the icon as an entry of an FMU, where its FMI version has it."""
    return {"model.png" if fmi == 2 else "terminalsAndIcons/icon.png": picture(kind)}
