"""Mistakes that a full matrix would take for scale factors and misalignments: columns, signs and units of a triad.

The matrix of a triad that is labelled as it stands is the unit matrix but for some percent.  One that is nearer to
another permutation of axes, with signs, or to a multiple, says what was exchanged, reversed, or read in another unit.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np

from gyrobench.frames import G0
from gyrobench.reduction.diagnosis import handling_candidates as common
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate
from gyrobench.reduction.toolkit import Array, Record, plain

from .channels import AXES, CHANNELS
from .geometry import STILL

SOUND = 0.25  # of the elements of a matrix, largest departure from the unit matrix that may be the instrument
DEG = math.pi / 180.0
#: reading over truth -> words, for accelerometers and gyros
UNITS = {
    "a": {
        1.0 / G0: "readings in g were taken for m/s²",
        G0: "readings in m/s² were taken for g",
        1e3: "the readings are too large by 1000 (mg taken for g)",
        1e-3: "the readings are too small by 1000 (g taken for mg)",
        1e3 / G0: "readings in mg were taken for m/s²",
    },
    "g": {
        DEG: "readings in rad/s were taken for °/s",
        1.0 / DEG: "readings in °/s were taken for rad/s",
        3600.0: "the readings are too large by 3600 (°/h taken for °/s)",
        1.0 / 3600.0: "the readings are too small by 3600 (°/s taken for °/h)",
        3600.0 / DEG: "readings in °/h were taken for rad/s",
        1e3: "the readings are too large by 1000 (m°/s taken for °/s)",
        1e-3: "the readings are too small by 1000 (°/s taken for m°/s)",
        0.5: "the readings are half of the rates: the times or the angles are in another unit",
        2.0: "the readings are twice the rates: the times or the angles are in another unit",
        1.0 / 60.0: "the readings are a sixtieth of the rates: the times are in min, not in s",
        60.0: "the readings are sixty times the rates: the times are in s, not in min",
    },
}
NAME = {"a": "accelerometers", "g": "gyros"}


def triad_problems(matrix: Array, kind: str) -> list[str]:
    """Return what the matrix (3, 3) of a triad, readings over rates or specific forces, says of its labels.

    kind: "a" accelerometers, "g" gyros.  Empty for the unit matrix but for :data:`SOUND`.
    """
    if np.max(np.abs(matrix - np.eye(3))) < SOUND:
        return []
    size = float(np.linalg.norm(matrix)) / math.sqrt(3.0)
    if not size > 0.0:
        return [f"{NAME[kind]}: all readings are the same: none was read"]
    best = min(signed_permutations(), key=lambda p: float(np.linalg.norm(matrix / size - p)))
    off = float(np.max(np.abs(matrix / size - best)))
    if off > SOUND:
        rows = "; ".join(" ".join(plain(x, 3) for x in row) for row in matrix)
        return [
            f"{NAME[kind]}: the readings are not those of three axes in these positions (matrix by rows: {rows}): "
            "a position, an axis or the sense of an angle is mistaken"
        ]
    return [f"{NAME[kind]}: {text}" for text in (*_permuted(best), *scaled(size, kind))]


def signed_permutations() -> Iterator[Array]:
    """Yield the matrices (3, 3) by which three axes are labelled otherwise or reversed."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            p = np.zeros((3, 3))
            p[range(3), order] = signs
            yield p


def reads(p: Array) -> str:
    """Return which axis each instrument of a signed permutation reads."""
    order, signs = np.argmax(np.abs(p), axis=1), p.sum(axis=1)
    return ", ".join(f"{a} reads {'−' if s < 0 else ''}{AXES[k]}" for a, k, s in zip(AXES, order, signs, strict=True))


def _permuted(p: Array) -> list[str]:
    order, signs = np.argmax(np.abs(p), axis=1), p.sum(axis=1)
    if np.array_equal(p, np.eye(3)):
        return []
    moved = [a for k, a in enumerate(AXES) if order[k] != k]
    if not moved:
        reversed_axes = " and ".join(a for a, s in zip(AXES, signs, strict=True) if s < 0)
        whole = " (all of them: the sense of f = a − g, or of the angles, is mistaken)" if np.all(signs < 0) else ""
        text = f"the sign of {reversed_axes} is reversed{whole}"
    elif len(moved) == 2 and np.all(signs > 0):
        text = f"{moved[0]} and {moved[1]} are exchanged"
    else:
        text = f"the axes are labelled otherwise: {reads(p)}"
    if np.linalg.det(p) < 0.0:
        return [f"{text}; so labelled the triad is left-handed"]
    return [f"{text}: the columns are mistaken, or the case is mounted so on the plate"]


def scaled(size: float, kind: str) -> list[str]:
    """Return what readings that are size times what they should be say of their unit."""
    if abs(size - 1.0) < SOUND:
        return []
    near = min(UNITS[kind], key=lambda f: abs(math.log(size / f)))
    if abs(size / near - 1.0) < SOUND:
        return [UNITS[kind][near]]
    return [f"the readings are {plain(size, 4)} times what the positions make: unit or scale factor is mistaken"]


def candidates(record: Record) -> Iterator[HandlingCandidate]:
    """Yield mistakes with angles and rows that residuals may show; none of a record without angles."""
    if "outer_start" not in record.windows:
        return
    means = [f"mean_{c.name}" for c in CHANNELS]
    pairs = list(zip(common.OUTER, common.INNER, strict=True))
    yield from common.exchanged_columns(record, pairs, "outer and inner angle exchanged")
    for columns, words in ((common.OUTER, "the outer"), (common.INNER, "the inner"), (common.BOTH, "both")):
        yield from common.reversed_columns(record, columns, f"{words} rotation", False)
    yield from common.scaled(record, common.BOTH, common.ANGLE, 0.0)
    yield from common.wrong_hemisphere(record)
    yield from common.shifted(record, means, "the readings")
    yield from common.exchanged_rows(record, common.BOTH, "positions")
    yield from forgotten(record)


def forgotten(record: Record) -> Iterator[HandlingCandidate]:
    """Yield each position at rest as one that was forgotten: the case stayed where it was, or all that follow were read
    one position further on, and the last was not read.
    """
    w = record.windows
    phase = np.asarray(w["phase"]).astype(int)
    outer, inner = (np.abs(np.asarray(w[f"{n}_end"], dtype=float) - w[f"{n}_start"]) for n in ("outer", "inner"))
    moved = {int(p) for p in phase[np.maximum(outer, inner) > STILL]}
    still = [int(p) for p in dict.fromkeys(phase.tolist()) if p not in moved]
    at = {p: {n: float(np.asarray(w[n])[phase == p][0]) for n in common.BOTH} for p in still}

    def standing(places: dict[int, int]) -> dict[str, Array]:
        out = {n: np.asarray(w[n], dtype=float).copy() for n in common.BOTH}
        for p, source in places.items():
            for n in common.BOTH:
                out[n][phase == p] = at[source][n]
        return out

    for k, p in enumerate(still[1:], 1):
        stayed = common.changed(record, **standing({p: still[k - 1]}))
        yield HandlingCandidate(f"position {p} forgotten (the case stayed in position {still[k - 1]})", stayed)
    for k, p in enumerate(still[:-1]):
        columns = {**w, **standing(dict(zip(still[k:-1], still[k + 1 :], strict=True)))}
        kept = phase != still[-1]
        rows = {n: np.asarray(v)[kept] for n, v in columns.items()}
        words = f"position {p} forgotten (from it on the next ones were read)"
        yield HandlingCandidate(words, Record(rows, {}, record.run))
