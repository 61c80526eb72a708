"""Reduction of the position test: errors by harmonics, separated from the polygon's; wobble, tilt, squareness.

Readings y of the autocollimator, corrected for the tracking error e of the counts, and y2 of the second head:

    y  + e = E(theta) - p_k + zero of the mount + direction h/2          k: face that is seen, sum of p = 0
    y2 + e = E(theta) - E(theta + head) + constant                       E = sum of a_n cos n theta + b_n sin n theta

The scale has one error, -E, for both heads.  An order n is told from the polygon where n times the angle between two
mounts, or between the heads, is not a whole turn.  Level: P e^(-j b) + zero,
P = plate + T e^(-j theta) + W e^(j theta).
[TABLE-POSITION]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import special

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.fit_result import plus_minus
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import Coefficient, LoopResult, Series, Specification, Table
from gyrobench.units import ARCSEC

SEPARATED = 0.1  # least |1 - exp(j n angle)| at which an order is estimated
JITTER = 0.005  # of the variance of a rounding is left where the loop moves the table by a count while it is read
HEADS = ("reader", "reader_2")
NEEDED = ("level_x", "level_y", "tracking", "second")


@dataclass(frozen=True)
class Readings:
    """One row a position; angles in rad."""

    theta: Array  # commanded
    azimuth: Array  # of the reference
    mount: NDArray[np.int64]
    sense: Array  # +1 on the way up, -1 back
    deviation: Array
    level: NDArray[np.complex128]
    tracking: Array
    second: Array  # reading of the second head less theta
    true: Array | None  # true position less theta
    faces: int
    head: float
    orders: int
    rounding: float  # variance of the difference of two counted readings, rad2

    @property
    def face(self) -> NDArray[np.int64]:
        """Return the number of the polygon's face that is seen."""
        out: NDArray[np.int64] = np.round(self.faces * (self.theta + self.azimuth) / (2 * math.pi)).astype(np.int64)
        return out % self.faces

    @property
    def seen(self) -> NDArray[np.int64]:
        """Return the faces that are seen at all, rising."""
        return np.unique(self.face)

    @property
    def both_senses(self) -> bool:
        """Return whether a place was reached from both sides: lost motion looks like a face's error otherwise."""
        return any(np.ptp(self.sense[self.place == x]) > 0.0 for x in np.unique(self.place))

    @property
    def place(self) -> NDArray[np.int64]:
        """Return the number of the position, 0 .. faces - 1."""
        out: NDArray[np.int64] = np.round(self.faces * self.theta / (2 * math.pi)).astype(np.int64)
        return out % self.faces

    def separated(self, n: int) -> bool:
        """Return whether an order is told from the errors of the polygon."""
        apart = [b - self.azimuth[0] for b in np.unique(self.azimuth)] + [self.head]
        return bool(max(abs(1.0 - np.exp(1j * n * b)) for b in apart) > SEPARATED)


@dataclass(frozen=True)
class Fit:
    """Estimates with their standard uncertainties (type A) and degrees of freedom, of each value."""

    value: Array
    u: Array
    dof: Array
    residual: Array
    gain: Array  # value = gain y
    V: Array  # covariance of y


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The result of a record; raises ReductionError where it cannot be reduced."""
    w, run = record.windows, record.run
    problems = window_problems(w) or [f"column {n} is missing" for n in NEEDED if n not in w]
    if problems:
        raise ReductionError(problems)
    return run_metadata.finish(_result(readings(w, run), run, specification or {}), record)


def within_turn(x: Array) -> Array:
    """Return angles less the nearest whole number of turns."""
    return np.asarray(x - 2 * math.pi * np.round(x / (2 * math.pi)))


def readings(w: Mapping[str, Array], run: RunDocument) -> Readings:
    """Return the rows of a record.  Raises ReductionError."""
    o = run.options
    mounts = [math.radians(float(x)) for x in str(o["mounts"]).split()]
    plan = {row.phase: row for row in run.plan}
    names = list(dict.fromkeys(row.face for row in run.plan))
    phase = np.asarray(w["phase"], dtype=int)
    rows = [plan[int(p)] for p in phase]
    theta = np.array([row.target for row in rows])
    mount = np.array([names.index(row.face) for row in rows])
    sense = np.ones(phase.size)  # of the last move, by the cumulative reading
    moved = np.diff(w["angle_start"])
    for k in range(1, phase.size):
        sense[k] = np.sign(moved[k - 1]) if abs(moved[k - 1]) > 1e-3 else sense[k - 1]
    true = within_turn(w["true"] - theta) if "true" in w else None
    return Readings(
        theta, np.array(mounts)[mount], mount, sense, w["mean"], w["level_x"] + 1j * w["level_y"], w["tracking"],
        within_turn(w["second"] - theta), true, int(o["positions"]), float(o["head"]),
        int(o["orders"]), sum(float(run.parameters.get(f"{n}.quantum", 0.0)) ** 2 for n in HEADS)
        * JITTER / 12.0,
    )  # fmt: skip


def least_squares(
    X: Array, y: Array, groups: Sequence[slice], place: NDArray[np.int64], floors: Sequence[float] = ()
) -> Fit:
    """Return the generalized least squares solution with two variances for each group of rows.

    Readings differ from visit to visit, and by an error that returns at each place (rounding of the counts, what the
    harmonics leave): V = s2 I + t2 (same place).  Both follow from the residuals r: their squares within and between
    the places have expectations linear in the variances.  floors: least t2 of each group; rounding of counts distorts a
    wave of a few counts in its own harmonics too, which the residuals do not show.  The degrees of freedom of a value
    are those of the variances that make its u (Welch and Satterthwaite); a floor is known.
    """
    n = y.size
    parts = []  # of V, and what is squared in r to estimate them: within the places, between them
    for g in groups:
        inside = np.zeros(n)
        inside[g] = 1.0
        same = (place[:, None] == place[None, :]) * np.outer(inside, inside)
        mean = same / np.maximum(same.sum(axis=1, keepdims=True), 1.0)
        parts.append((np.diag(inside), np.diag(inside) - mean))
        if np.any(same.sum(axis=1) > 1.5):
            parts.append((same, mean))
        else:
            parts[-1] = (np.diag(inside), np.diag(inside))  # no place twice: one variance
    own = np.array([np.count_nonzero(p) == np.count_nonzero(np.diag(p)) for p, _ in parts])
    variances = np.where(own, 1.0, 0.0)
    scale = float(np.var(y)) + 1e-30
    for _ in range(6):
        V = sum((v * p for v, (p, _) in zip(variances, parts, strict=True)), 1e-12 * np.eye(n))
        W = np.linalg.inv(V)
        covariance = np.linalg.inv(X.T @ W @ X)
        M = np.eye(n) - X @ covariance @ X.T @ W
        r = M @ y
        system = np.array([[np.sum((q @ M @ p) * M) for p, _ in parts] for _, q in parts])
        squares = np.array([r @ q @ r for _, q in parts])
        least = np.where(own, 1e-9, 0.0)
        if floors:  # of what returns at a place, or of all, where no place is visited twice
            chosen = ~own if np.any(~own) else own
            least[chosen] = np.maximum(least[chosen], np.array(floors) / scale)
        variances = np.maximum(np.linalg.lstsq(system, squares, rcond=None)[0] / scale, least)
    V = sum((v * p for v, (p, _) in zip(variances, parts, strict=True)), 1e-12 * np.eye(n)) * scale
    W = np.linalg.inv(V)
    covariance = np.linalg.inv(X.T @ W @ X)
    gain = covariance @ X.T @ W
    M = np.eye(n) - X @ gain
    parted = zip(variances, parts, strict=True)
    shares = np.array([v * scale * np.sum((gain @ p) * gain, axis=1) for v, (p, _) in parted])
    free = np.array([max(float(np.sum(q * M.T)), 1.0) for _, q in parts])
    found = variances > least
    u = np.sqrt(np.diag(covariance))
    dof = u**4 / np.maximum(np.sum(shares[found] ** 2 / free[found, None], axis=0), 1e-4 * u**4)
    return Fit(np.asarray(gain @ y), u, np.maximum(dof, 3.0), y - X @ gain @ y, gain, V)


def position_fit(r: Readings) -> tuple[Fit, list[int]]:
    """Return the fit (a_1, b_1, a_2 ..., h, zeros of the mounts, constant of the second head, p) and its orders."""
    orders = [n for n in range(1, r.orders + 1) if r.separated(n)]

    def harmonics(angle: Array) -> Array:
        return np.column_stack([f(n * angle) for n in orders for f in (np.cos, np.sin)] or [np.zeros((angle.size, 0))])

    n, mounts = r.theta.size, int(r.mount.max()) + 1
    both = r.both_senses
    zeros = (r.mount[:, None] == np.arange(mounts)).astype(float)
    seen = (r.face[:, None] == r.seen).astype(float)
    seen = seen[:, :-1] - seen[:, -1:]  # the sum of p is 0
    own = harmonics(r.theta)
    first = np.column_stack([own, *([0.5 * r.sense] if both else []), zeros, np.zeros(n), -seen])
    difference = own - harmonics(r.theta + r.head)
    second = np.zeros_like(first)
    second[:, : own.shape[1]] = difference
    second[:, own.shape[1] + both + mounts] = 1.0
    y = np.concatenate([r.deviation + r.tracking, r.second + r.tracking])
    place = np.tile(r.place, 2)
    X = np.vstack([first, second])
    if np.linalg.matrix_rank(X) < X.shape[1]:
        raise ReductionError(
            f"{np.unique(place).size} positions do not determine {len(orders)} harmonics and the errors of "
            f"{r.seen.size} faces: take more positions or mounts, or fewer orders"
        )
    return least_squares(X, y, [slice(0, n), slice(n, 2 * n)], place, (0.0, r.rounding)), orders


def level_fit(r: Readings) -> tuple[Fit, list[str]]:
    """Return the fit of the level, real and imaginary parts in turn, and the names of its complex terms."""
    turn = np.exp(-1j * r.azimuth)
    columns = {"axis": turn * np.exp(-1j * r.theta), "wobble": turn * np.exp(1j * r.theta), "zero": np.ones(turn.size)}
    if np.unique(r.azimuth).size > 1:
        columns["plate"] = turn
    X = np.column_stack(list(columns.values()))
    real = np.block([[X.real, -X.imag], [X.imag, X.real]])
    y = np.concatenate([r.level.real, r.level.imag])
    place = np.arange(y.size)
    return least_squares(real, y, [slice(0, y.size)], place), list(columns)


def scale_truth(p: Mapping[str, Any], n: int) -> tuple[float, float] | None:
    """Return a_n, b_n of a simulated table: less the error of its scale; None where it is not known."""
    names = {1: "eccentricity", 2: "tilt", int(p.get("reader.encoder_pitch_order", 0)): "pitch"}
    if "reader.encoder_eccentricity" not in p:
        return None
    if n not in names:
        return 0.0, 0.0
    a, phase = (float(p[f"reader.encoder_{names[n]}{end}"]) for end in ("", "_phase"))
    return -a * math.sin(phase), -a * math.cos(phase)


def _result(r: Readings, run: RunDocument, limits: Specification) -> LoopResult:
    p = run.parameters
    fit, orders = position_fit(r)
    level, terms = level_fit(r)
    found: list[Coefficient] = []

    def add(name: str, meaning: str, value: float, u: float, dof: float, truth: Any = None, none: str = "",
            at_once: int = 1) -> None:  # fmt: skip
        k = float(special.stdtrit(dof, 1.0 - 0.025 / at_once))
        x, size = (math.nan, math.nan) if none else (value / ARCSEC, u / ARCSEC)
        true = None if truth is None or none else float(truth) / ARCSEC
        limit = limits.get(name)
        found.append(
            Coefficient(
                name, meaning, "arcsec", x, size, k, (x - k * size, x + k * size), u_a=size, truth=true,
                z=(x - true) / size if true is not None and size > 0.0 else None, limit=limit, dof=dof,
                verdict=uncertainty.assess_conformity(x, k * size, limit), no_value=none,
            )
        )  # fmt: skip

    # position error of each position: the fit without its harmonics, and what it leaves
    zeros = 2 * len(orders) + r.both_senses
    mounts = int(r.mount.max()) + 1
    polygon = np.full(r.faces, np.nan)
    polygon[r.seen] = np.append(fit.value[zeros + mounts + 1 :], -float(np.sum(fit.value[zeros + mounts + 1 :])))
    error = r.deviation + polygon[r.face] - fit.value[zeros + r.mount]
    visited = np.unique(r.place)
    at = np.array([float(np.mean(error[r.place == x])) for x in visited])
    at -= np.mean(at)
    spread = float(np.std(fit.residual[: r.theta.size], ddof=1))
    worst = int(np.argmax(np.abs(at)))
    where = 360.0 * visited[worst] / r.faces
    true = None
    if r.true is not None:
        mean = np.array([float(np.mean(r.true[r.place == x])) for x in visited])
        true = mean - np.mean(mean)
    least = float(np.min(fit.dof))
    add("accuracy", f"position error of the largest magnitude, at {where:g}°", at[worst],
        _u_place(r, fit, worst, zeros), least, None if true is None else true[worst],
        at_once=visited.size)  # fmt: skip
    for n in range(1, r.orders + 1):
        truth = scale_truth(p, n)
        none = "" if n in orders else f"order {n} is the same in all mounts and at both heads: take another mount"
        for j, part in enumerate(("cos", "sin")):
            k = 2 * orders.index(n) + j if n in orders else 0
            meaning = f"position error, {part} {n if n > 1 else ''}θ"
            add(f"E{n} {part}", meaning, fit.value[k], fit.u[k], float(fit.dof[k]),
                None if truth is None else truth[j], none)  # fmt: skip
    if zeros > 2 * len(orders):
        add("lost motion", "position on the way up less that on the way back", fit.value[zeros - 1], fit.u[zeros - 1],
            float(fit.dof[zeros - 1]))  # fmt: skip
    add("repeatability", "standard deviation of a position", spread, spread / math.sqrt(2.0 * r.theta.size), least)
    _level_terms(level, terms, p, add)
    errors = p.get("reference.errors")
    tables = [_polygon(polygon, fit, zeros + mounts + 1, None if errors is None else np.asarray(errors))]
    shown = np.linspace(0.0, 2 * math.pi, 181)
    curve = np.zeros(shown.size)
    for i, n in enumerate(orders):
        curve += fit.value[2 * i] * np.cos(n * shown) + fit.value[2 * i + 1] * np.sin(n * shown)
    series = [_series(r, m, error, orders, fit, shown, curve) for m in range(mounts)]
    a = found[0]
    return LoopResult(
        system=run.system,
        title="Position test of a table",
        method="Polygon and autocollimator in several mounts, a second reading head, a level in the same mounts",
        sources=["TABLE-POSITION, ANGLE-INDUCTOSYN; Hu 1981, sections 5.4, 5.5, 6.1"],
        equation="y + e = E(theta) - p_k + z_m + h\\/2, quad y_2 + e = E(theta) - E(theta + gamma) + c, "
        "quad L = (P_0 + T e^(-j theta) + W e^(j theta)) e^(-j b) + Z",
        conventions=[
            "Position error E: true position less commanded one, without its mean; E = Σ a_n cos nθ + b_n sin nθ.",
            "The interval of the largest error holds for all positions at once (Bonferroni).",
            "The scale errs by −E, the same for both heads; y is corrected for the tracking error e of the counts.",
            "Wobble: tilt A cos(2θ + φ), A sin(2θ + φ) about the first and second axis of the base.",
            "Squareness: tilt of the plate against the axis, x and y as the level reads it.",
        ],
        coefficients=found,
        series=series,
        dof=least,
        residual_std=spread / ARCSEC,
        residual_unit="arcsec",
        tables=tables,
        summary=[
            f"Largest position error {plus_minus(a).replace(' arcsec', '″')} at {where:g}°; "
            f"repeatability {spread / ARCSEC:.2g}″ (one count: {float(p.get('reader.quantum', 0.0)) / ARCSEC:.2g}″).",
            "Orders told from the polygon: " + (", ".join(map(str, orders)) or "none") + ".",
        ],
        decision_rule=uncertainty.DECISION_RULE,
        verdict=uncertainty.worst_verdict(c.verdict for c in found),
        instrument=run.parts["body"].name if "body" in run.parts else run.instrument,
        ranked_by="accuracy",
        responses=[],
        simulated=not run.measured,
    )


def _u_place(r: Readings, fit: Fit, place: int, zeros: int) -> float:
    """Return the standard uncertainty of the mean error at a place: readings, faces and zeros of the mounts."""
    n, mounts, p = r.theta.size, int(r.mount.max()) + 1, fit.value.size

    def row(x: int) -> Array:
        of = np.flatnonzero(r.place == x)
        out = np.zeros(2 * n)
        out[of] = 1.0 / of.size
        value = np.zeros(p)
        for i in of:
            value[zeros + r.mount[i]] -= 1.0 / of.size
            faces, k = np.arange(zeros + mounts + 1, p), int(np.searchsorted(r.seen, r.face[i]))
            if k < faces.size:
                value[faces[k]] += 1.0 / of.size
            else:
                value[faces] -= 1.0 / of.size
        return np.asarray(out + fit.gain.T @ value)

    rows = np.array([row(x) for x in np.unique(r.place)])
    g = rows[place] - rows.mean(axis=0)
    return math.sqrt(float(g @ fit.V @ g))


def _level_terms(level: Fit, terms: Sequence[str], p: Mapping[str, Any], add: Any) -> None:
    """Add tilt of the axis, wobble and squareness from the complex terms of the level."""
    half = len(terms)
    z = {n: complex(level.value[i], level.value[half + i]) for i, n in enumerate(terms)}
    u = {n: (level.u[i], level.u[half + i]) for i, n in enumerate(terms)}
    tilt = p.get("body.tilt")
    dof = float(np.min(level.dof))
    add("tilt 1", "tilt of the axis about the first axis of the base", z["axis"].imag, u["axis"][1], dof,
        None if tilt is None else tilt[0])  # fmt: skip
    add("tilt 2", "tilt of the axis about the second axis of the base", -z["axis"].real, u["axis"][0], dof,
        None if tilt is None else tilt[1])  # fmt: skip
    known = p.get("wobble.order") == 2.0 and "wobble.amplitude" in p
    size, phase = (float(p["wobble.amplitude"]), float(p["wobble.phase"])) if known else (0.0, 0.0)
    add("wobble cos", "wobble twice a turn, A cos φ", z["wobble"].imag, u["wobble"][1], dof,
        size * math.cos(phase) if known else None)  # fmt: skip
    add("wobble sin", "wobble twice a turn, A sin φ", -z["wobble"].real, u["wobble"][0], dof,
        size * math.sin(phase) if known else None)  # fmt: skip
    plate, none = p.get("reference.plate"), "" if "plate" in terms else "one mount: not told from the level's zero"
    for j, axis in enumerate("xy"):
        value = (z["plate"].real, z["plate"].imag)[j] if "plate" in terms else 0.0
        add(f"squareness {axis}", f"tilt of the plate against the axis, {axis}", value,
            u["plate"][j] if "plate" in terms else 0.0, dof, None if plate is None else plate[j], none)  # fmt: skip


def _polygon(errors: Array, fit: Fit, first: int, true: Array | None) -> Table:
    seen = np.flatnonzero(np.isfinite(errors))
    known = None if true is None else true - np.mean(true[seen])
    last = math.sqrt(float(np.sum(fit.u[first:] ** 2)) / max(seen.size - 1, 1))
    rows = [
        [int(k) + 1, errors[k] / ARCSEC, (fit.u[first + i] if i < seen.size - 1 else last) / ARCSEC,
         None if known is None else known[k] / ARCSEC]
        for i, k in enumerate(seen)
    ]  # fmt: skip
    return Table(
        "errors_of_the_polygon",
        "Errors of the polygon",
        "Errors of the faces, their mean left out",
        ["face", "error / ″", "u / ″", "truth / ″"],
        rows,
    )


def _series(r: Readings, m: int, error: Array, orders: Sequence[int], fit: Fit, shown: Array, curve: Array) -> Series:
    """Return the position errors of one mount against the angle, the polygon's errors taken off."""
    of = r.mount == m
    theta = r.theta[of]
    model = sum(
        (fit.value[2 * i] * np.cos(n * theta) + fit.value[2 * i + 1] * np.sin(n * theta) for i, n in enumerate(orders)),
        np.zeros(theta.size),
    )
    return Series(
        f"mount {math.degrees(r.azimuth[of][0]):g}°", np.degrees(theta).tolist(), "table angle", "°",
        (error[of] / ARCSEC).tolist(), (model / ARCSEC).tolist(), ((error[of] - model) / ARCSEC).tolist(),
        "position error", "arcsec", shown_fit_x=np.degrees(shown).tolist(), shown_fit_y=(curve / ARCSEC).tolist(),
    )  # fmt: skip
