"""Whether the readings contradict one another, and which mistake undone would have them agree.

Polygon and second head: orders that both tell are fitted by the autocollimator alone and by the heads alone; an F test
of their differences.  Mounts: places and faces, each with an error of its own, make up what the visits of a place in a
mount have in common, whatever the orders; an F test of the rest against the scatter of the visits.  A mistake that
leaves both as they are is not seen, nor one in an order that only one reading tells.  [TABLE-POSITION; derived]
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from scipy import special

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_toolkit import ARCSEC, Array
from gyrobench.reduction.loops.scale_errors import waves

from .places_fit import PlacesFit, least_squares, visits, walk
from .readings import SEPARATED, Readings, faces_of

LEVEL, AGREES = 1e-3, 0.05  # of the F test: a contradiction; what a mistake undone must leave
ANGLES = np.radians(np.arange(15.0, 360.0, 15.0))  # heads that stand elsewhere


def contradicted(r: Readings) -> str:
    """Return that both contradict each other, and what was mistaken; "" where they agree, or share no order."""
    found = _compared(r)
    if found is None or found[0] >= LEVEL:
        return ""
    p, orders, by_polygon, by_heads = found
    k = int(np.argmax(np.abs(by_polygon - by_heads)))
    name = f"E{orders[k // 2]} {('cos', 'sin')[k % 2]}"
    ways = sorted(((_compared(other) or (0.0,))[0], words) for words, other in _mistakes(r))
    cures = [words for p_cure, words in reversed(ways) if p_cure > AGREES][:3]
    text = (
        f"Polygon and second head contradict each other in what both tell of the position: {name} is "
        f"{plain(by_polygon[k] / ARCSEC, 3)}″ by the autocollimator and {plain(by_heads[k] / ARCSEC, 3)}″ by the heads "
        f"(p {'< 0.001' if p < 1e-3 else f'= {plain(p, 3)}'})."
    ).replace("-", "−")
    if cures:
        return f"{text} They agree with {', or '.join(cures)}: was that mistaken?"
    return f"{text} Check sign and scale of both readings, the angle between the heads and the mounts."


def misplaced(r: Readings) -> str:
    """Return that places and faces do not explain the mounts, and what was mistaken; "" where they do."""
    p = _explained(r)
    if p >= LEVEL:
        return ""
    text = (
        "Errors of the places and of the faces do not explain what the autocollimator read in all mounts (p < 0.001)."
    )
    cures = [words for words, other in _mounts(r) if _explained(other) > AGREES][:3]
    if cures:
        return f"{text} They do with {', or '.join(cures)}: was that mistaken?"
    return f"{text} Check the azimuths of the mounts, and the readings that lie off in the figures."


def _explained(r: Readings) -> float:
    """Return p of the F test; 1 where the mounts have nothing to explain."""
    cell = r.mount * r.faces + r.place
    cells = (cell[:, None] == np.unique(cell)).astype(float)
    way = np.column_stack([r.sense, r.drifts(), r.unknown_ways()]) if r.both_senses else r.drifts()
    model = np.column_stack([*((x[:, None] == np.unique(x)).astype(float) for x in (r.mount, r.place, r.face)), way])
    y = r.deviation + r.tracking
    squares, free = zip(*(_left(X, y) for X in (model, np.column_stack([cells, way]))), strict=True)
    more = free[0] - free[1]
    if more < 1 or free[1] < 1 or not squares[1] > 0.0:
        return 1.0
    return float(special.fdtrc(more, free[1], (squares[0] - squares[1]) / more / (squares[1] / free[1])))


def _left(X: Array, y: Array) -> tuple[float, int]:
    """Return the sum of squares that least squares leave, and its degrees of freedom."""
    found, _, rank, _ = np.linalg.lstsq(X, y, rcond=1e-10)
    left = y - X @ found
    return float(left @ left), y.size - int(rank)


def _mounts(r: Readings) -> Iterator[tuple[str, Readings]]:
    """Yield the readings with mounts turned the other way, two of them exchanged, or one a face or more elsewhere."""
    pitch = 2.0 * math.pi / r.faces
    each = np.array([r.azimuth[r.mount == m][0] for m in range(r.mounts)])
    yield "mounts turned the other way", _turned(r, -r.azimuth)
    name = [f"{math.degrees(b):g}°" for b in each]
    for a, b in combinations(range(r.mounts), 2):
        other = each.copy()
        other[[a, b]] = each[[b, a]]
        yield f"mounts {name[a]} and {name[b]} exchanged", _turned(r, other[r.mount])
    for m in range(1, r.mounts):
        for k in range(1, r.faces):
            azimuth = np.where(r.mount == m, r.azimuth + k * pitch, r.azimuth)
            yield f"mount {name[m]} at {math.degrees(each[m] + k * pitch) % 360.0:g}°", _turned(r, azimuth)


def _turned(r: Readings, azimuth: Array) -> Readings:
    """Return the readings with mounts at other azimuths."""
    other = copy.copy(r)
    other.azimuth = azimuth
    other.face = np.round((r.theta + azimuth) / (2.0 * math.pi / r.faces)).astype(np.int64) % r.faces
    other.seen = np.unique(other.face)
    return other


def _compared(r: Readings) -> tuple[float, list[int], Array, Array] | None:
    """Return p, the orders that both tell, and their harmonics by the polygon and by the heads, rad."""
    mounts = np.unique(r.azimuth) - r.azimuth[0]
    told = [n for n in range(1, r.orders + 1) if np.max(np.abs(1.0 - np.exp(1j * n * mounts))) > SEPARATED]
    heads = [n for n in range(1, r.orders + 1) if abs(1.0 - np.exp(1j * n * r.head)) > SEPARATED]
    both = [n for n in told if n in heads]
    if not both:
        return None
    own = waves(told, r.theta)
    zeros = (r.mount[:, None] == np.arange(r.mounts)).astype(float)
    sense = [0.5 * r.sense, r.unknown_ways(), r.drifts()] if r.both_senses else []
    first = np.column_stack([own, *sense, zeros, -faces_of(r)])
    second = np.column_stack([waves(heads, r.theta) - waves(heads, r.theta + r.head), np.ones(r.theta.size)])
    if any(np.linalg.matrix_rank(X) < X.shape[1] or X.shape[1] >= len(X) for X in (first, second)):
        return None
    rows = slice(0, r.theta.size)
    polygon = least_squares(first, r.deviation + r.tracking, [*visits(rows, r.place), walk(rows, r.t, r.mount)])
    other = least_squares(second, r.second + r.tracking, visits(rows, r.place, r.rounding))
    at, at_heads = (_columns(both, of) for of in (told, heads))
    d = polygon.value[at] - other.value[at_heads]
    covariance = _covariance(polygon, at) + _covariance(other, at_heads)
    square = float(d @ np.linalg.solve(covariance, d)) / d.size
    dof = min(_freedom(((polygon, a), (other, b))) for a, b in zip(at, at_heads, strict=True))
    return float(special.fdtrc(d.size, dof, square)), both, polygon.value[at], other.value[at_heads]


def _columns(orders: list[int], of: list[int]) -> list[int]:
    return [2 * of.index(n) + j for n in orders for j in (0, 1)]


def _freedom(values: Sequence[tuple[PlacesFit, int]]) -> float:
    """Return the degrees of freedom of the difference of two values (Welch and Satterthwaite)."""
    u2 = [float(fit.u[k]) ** 2 for fit, k in values]
    return sum(u2) ** 2 / sum(u**2 / fit.freedom(fit.gain[k]) for u, (fit, k) in zip(u2, values, strict=True))


def _covariance(fit: PlacesFit, at: list[int]) -> Array:
    gain = fit.gain[at]
    return np.asarray(gain @ fit.V @ gain.T)


def _mistakes(r: Readings) -> Iterator[tuple[str, Readings]]:
    """Yield the readings with each likely mistake undone."""

    def changed(**values: Array | float) -> Readings:
        other = copy.copy(r)
        for name, value in values.items():
            setattr(other, name, value)
        return other

    yield "the autocollimator's sign reversed", changed(deviation=-r.deviation)
    yield "half of the autocollimator's reading (it reads twice the angle)", changed(deviation=0.5 * r.deviation)
    yield "twice the autocollimator's reading", changed(deviation=2.0 * r.deviation)
    yield "the sign of the tracking error reversed", changed(tracking=-r.tracking)
    yield "the sign of the second head reversed", changed(second=-r.second - 2.0 * r.tracking)
    yield "mounts turned the other way", _turned(r, -r.azimuth)
    for angle in ANGLES[np.abs(ANGLES - r.head) > 1e-3]:
        yield f"heads {math.degrees(angle):.0f}° apart", changed(head=float(angle))
