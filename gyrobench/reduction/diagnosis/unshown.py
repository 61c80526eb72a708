"""Mistakes that no residual of a measured record would show, and that change its estimates: they must be asked for.

    reasons = unshown(record, result, reduce, regression_of)       # of a record that does not state that it was checked

A tumble with mounts and dwells exchanged, a multi-position test with its mounts exchanged, the latitude of another
city, a meter that is off by a factor, two gyros of a north finder exchanged are fitted as well as the truth.  So each
of :func:`mistakes` is made in a copy of the record.  Where the copy can be fitted as well - no F test of the two
scatters with p < LEVEL - and an estimate changes by more than its u, the record rests on that mistake not having been
made, and passes only where it states so: ``arrangement = checked``.  A plan whose redundancy shows a mistake is not
asked about it.

The copies are fitted by least squares of the test's own regression, without the effects of its nuisance model: a
mistake that only these would take in is found otherwise (handling_errors).  Only those that fit are reduced,
and these only where a coefficient is no unknown of the regression.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import special

from gyrobench.frames import G0
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis import unshown_instruments
from gyrobench.reduction.diagnosis.handling_candidates import (
    ANGLES,
    attitude_name,
    changed,
    exchanged_columns,
    exchanged_labels,
    relabelled,
    reversed_columns,
    scaled,
    wrong_hemisphere,
)
from gyrobench.reduction.diagnosis.handling_errors import (
    IMPOSSIBLE,
    LEVEL,
    HandlingCandidate,
    Reduce,
    undone,
    with_options,
)
from gyrobench.reduction.estimation.fit_result import UNSTATED
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.conditions import READINGS, readings
from gyrobench.result import DriftTestResult, Reason
from gyrobench.units import DEG

ARRANGEMENT = f"arrangement{UNSTATED}"
SCALES = {"k": "u_scale_factor", "k_x": "u_scale_factor", "k_y": "u_scale_factor", "scale": "u_scale"}
OFF, TOO_LARGE = DEG, 1.02  # an angle or a latitude, a scale factor
EARLY, DAY = 0.01, 86400.0  # of the time of a reading; s
#: scales that nobody states, what begins their columns, and what states an uncertainty of them
FORCES = ("f_x", "f_y")  # of the accelerometers of a north finder
#: columns that stand beside each other in a table, and are of one kind
NEIGHBOURS = (("mean_x", "mean"), FORCES, ("drift_x", "drift_y"), ("drift_y", "drift_z"), ("drift_x", "drift_z"))
METERS = (
    ("the readings", READINGS, ("u_voltage",)),
    ("the currents", ("current",), ("u_current",)),
    ("the rates", ("rate_",), ("u_time",)),
    ("the angles", ("angle_", "outer_", "inner_", "range_"), ("u_angle",)),
    ("the levels of vibration", ("level",), ("u_gain",)),
    ("the times", ("t_",), ("u_time",)),
)
NAMED, LARGEST = 8, 3  # mistakes, and estimates of each
UNITY = 1.0  # u, least change of an estimate that counts


def mistakes(record: Record) -> Iterator[HandlingCandidate]:
    """Yield the record with each mistake made: attitudes exchanged, two pairs of them at once, signs of rotation and
    readings reversed, latitude, scale factors, scales of meters and the zero of the angles in an attitude off, readings
    begun too early, a drift by the time of day - but for what a standard uncertainty is stated of.
    """
    if "mean_gx" in record.windows and "imu.rate[1]" in record.channels and "outer_start" not in record.windows:
        yield from _site(record)
        yield from unshown_instruments.by_hand(record)
        return
    yield from exchanged_labels(record)
    yield from _two_pairs(record)
    yield from reversed_columns(record, [n for n in ANGLES if n in record.windows], "the rotation", False)
    yield from reversed_columns(record, [n for n in record.windows if n.startswith(READINGS)], "the reading", False)
    for name in (n for n in readings(record.windows) if not n.startswith(READINGS)):
        yield from reversed_columns(record, [name], f"the {name}", False)
    for a, b in NEIGHBOURS:
        yield from exchanged_columns(record, [(a, b)], f"the columns {a} and {b} exchanged")
    forces = [n for n in FORCES if n in record.windows]
    if forces:
        yield from reversed_columns(record, forces, "the specific force", False)
        yield from scaled(record, forces, {"the specific force in m/s² and given as g": 1.0 / G0})
    options = record.run.options
    yield from _site(record)
    for name, stated in SCALES.items():
        if options.get(name) and not options.get(stated):
            other = with_options(record, {name: float(options[name]) * TOO_LARGE})
            yield HandlingCandidate(f"the scale factor {name} wrong by 2 %", other)
    yield from unshown_instruments.shaken(record)
    yield from unshown_instruments.inertial(record)
    yield from _heads(record)
    yield from _meters(record)
    yield from _daily(record)
    if "mean" in record.windows and len(rate := np.asarray(record.windows.get("rate", ()), dtype=float)) > 1:
        mean = np.array(record.windows["mean"], dtype=float)
        turned = np.concatenate([[False], np.diff(rate) != 0.0])
        mean[turned] += EARLY * (rate[:-1] - rate[1:])[turned[1:]]
        words = "readings begun 1 % of their time before the table had its rate"
        yield HandlingCandidate(words, changed(record, mean=mean))
    if np.any(later := np.diff(np.asarray(record.windows.get("since", ()), dtype=float)) > 0.0):
        gap = float(np.median(np.diff(record.windows["since"])[later]))
        words = "the times since the turn-on short by one reading"
        yield HandlingCandidate(words, changed(record, since=record.windows["since"] + gap))
    yield from unshown_instruments.warmed(record)
    yield from unshown_instruments.moved(record)
    if options.get("u_mount", options.get("u_angle")) or not all(n in record.windows for n in ANGLES):
        return
    phase = np.asarray(record.windows["phase"]).astype(int)
    places = dict.fromkeys(attitude_name(row) for row in record.run.plan if attitude_name(row))
    for name in places:
        here = np.isin(phase, [row.phase for row in record.run.plan if attitude_name(row) == name])
        columns = {n: np.where(here, record.windows[n] + OFF, record.windows[n]) for n in ANGLES}
        yield HandlingCandidate(f"the zero of the angles wrong by 1° in {name}", changed(record, **columns))


def _site(record: Record) -> Iterator[HandlingCandidate]:
    options = record.run.options
    if "latitude" in options and not options.get("u_latitude"):
        latitude = float(options["latitude"])
        moved = latitude + math.copysign(OFF, -latitude)
        yield HandlingCandidate("the latitude wrong by 1°", with_options(record, {"latitude": moved}))
        yield from wrong_hemisphere(record)


def _daily(record: Record) -> Iterator[HandlingCandidate]:
    """A drift that goes with the time of day, its amplitude the scatter of a window, where a gyro that holds its table
    turns with the Earth for half a day or more: unbalances have the period of a sidereal day.
    """
    w = record.windows
    held = [row.phase for row in record.run.plan if row.mode == "servo"]
    if not held or not all(n in w for n in ANGLES):
        return
    t0, t1, a0, a1 = (np.asarray(w[n], dtype=float) for n in ("t_start", "t_end", *ANGLES))
    phase = np.asarray(w["phase"]).astype(int)
    longest = max((p for p in held if np.any(phase == p)), key=lambda p: float(np.ptp(t0[phase == p])), default=None)
    rate = ((a1 - a0) / (t1 - t0))[phase == longest]
    if rate.size < 3 or np.ptp(t0[phase == longest]) < DAY / 2.0:
        return
    turned = float(np.std(np.diff(rate, 2))) / math.sqrt(6.0) * DAY / (2.0 * math.pi)  # amplitude of the angle
    columns = {
        n: a - turned * np.cos(2.0 * math.pi * t / DAY) for n, a, t in zip(ANGLES, (a0, a1), (t0, t1), strict=True)
    }
    yield HandlingCandidate(
        "a drift by the time of day as large as the scatter of a window", changed(record, **columns)
    )


def _heads(record: Record) -> Iterator[HandlingCandidate]:
    """Two readings of one scale, an angle apart: exchanged, at another angle, moving apart by a count while the
    positions are gone through; scale and reference exchanged.
    """
    w, options = record.windows, record.run.options
    if not all(n in w for n in ("reading", "reading_2", "reference")) or "head" not in options:
        return
    head, reversal = float(options["head"]), options.get("method") == "reversal"
    both = {"reading": w["reference"], "reference": w["reading"]}
    if reversal:  # its second reading is the first one, after the scale was turned
        both["reading_2"] = w["reference"] + w["reading"] - w["reading_2"]
    yield HandlingCandidate("scale and reference exchanged", changed(record, **both))
    yield HandlingCandidate("the sign of the head angle reversed", with_options(record, {"head": -head}))
    yield HandlingCandidate("the head angle wrong by 1°", with_options(record, {"head": head + OFF}))
    if reversal:
        return
    yield from exchanged_columns(record, [("reading", "reading_2")], "the two heads exchanged")
    count = float(record.run.parameters.get("reader.quantum", 0.0))
    t, rest = np.asarray(w["t_end"], dtype=float), [row.phase for row in record.run.plan if row.mode == "index"]
    of = np.isin(np.asarray(w["phase"]).astype(int), rest)
    if count and np.any(of):
        since = (t - t[of].min()) / max(float(np.ptp(t[of])), 1e-9)
        warmed = (1.0 - np.exp(-2.0 * since)) / (1.0 - math.exp(-2.0))
        words = "the heads further apart by a count at the last position than at the first"
        moved = np.where(of, w["reading_2"] + count * warmed, w["reading_2"])
        yield HandlingCandidate(words, changed(record, reading_2=moved))


def _meters(record: Record) -> Iterator[HandlingCandidate]:
    """The scale of a meter wrong, or creeping from the first row to the last, where no scale factor of it is stated."""
    options, w = record.run.options, record.windows
    for what, beginnings, stated in METERS:
        names = [n for n in w if n.startswith(beginnings) and np.any(np.isfinite(w[n]) & (w[n] != 0.0))]
        scaled = what == "the readings" and any(n in options for n in SCALES)  # mistaken by itself, above
        if not names or scaled or any(map(options.get, stated)):
            continue
        columns = {n: TOO_LARGE * np.asarray(w[n], dtype=float) for n in names}
        yield HandlingCandidate(f"{what} wrong by 2 %", changed(record, **columns))
        if what in ("the readings", "the currents"):
            creep = np.linspace(2.0 - TOO_LARGE, TOO_LARGE, len(w[names[0]]))
            columns = {n: creep * np.asarray(w[n], dtype=float) for n in names}
            yield HandlingCandidate(f"a scale of {what} that creeps by 4 %", changed(record, **columns))


def _two_pairs(record: Record) -> Iterator[HandlingCandidate]:
    """Two pairs of attitudes exchanged at once, where a mode has two alone: mounts and dwells of a tumble."""
    modes: dict[str, list[str]] = {}
    for row in record.run.plan:
        if attitude_name(row) and attitude_name(row) not in modes.setdefault(row.mode, []):
            modes[row.mode].append(attitude_name(row))
    pairs = [names for names in modes.values() if len(names) == 2]
    for (a, b), (c, d) in combinations(pairs, 2):
        other = {a: b, b: a, c: d, d: c}
        names = {row.phase: other.get(attitude_name(row), "") for row in record.run.plan}
        yield HandlingCandidate(f"{a} and {b}, {c} and {d} exchanged", relabelled(record, names))


def unshown(
    record: Record, result: DriftTestResult, reduce: Reduce, regression_of: Callable[[Record], Regression] | None = None
) -> list[Reason]:
    """Return that the record does not state what its residuals do not show; nothing where there is no such mistake.

    regression_of: record -> the :class:`~gyrobench.reduction.estimation.linear_fit.Regression` of a test with one; None
    where the reduction has several.
    """
    found = _not_shown(record, result, reduce, regression_of)
    if not found:
        return []
    said = "; ".join(f"{words} ({_largest(moved)})" for words, moved in found[:NAMED])
    more = f"; {len(found) - NAMED} more" if len(found) > NAMED else ""
    names = tuple(n for n in result.names if any(n in moved for _, moved in found))
    text = (
        f"No residual of this record would show: {said}{more}. State that attitudes, angles and values were checked "
        "(arrangement = checked), or add positions that show them."
    )
    return [Reason(ARRANGEMENT, text, ("pass",), names, severity="doubt")]


def sentences(
    record: Record, result: DriftTestResult, reduce: Reduce, regression_of: Callable[[Record], Regression] | None
) -> list[str]:
    """Return the mistakes that the record of a simulated plan would not show: said before it is measured."""
    found = _not_shown(record, result, reduce, regression_of)
    return [f"{words}: no residual of this plan shows it ({_largest(moved)})" for words, moved in found[:NAMED]]


def _not_shown(
    record: Record, result: DriftTestResult, reduce: Reduce, regression_of: Callable[[Record], Regression] | None
) -> list[tuple[str, dict[str, float]]]:
    """Return the mistakes that leave the residuals as they are, each with by how many u it moves estimates."""
    if result.ideal:
        return []
    reference = None if regression_of is None else _Plain.of(record, regression_of)
    found: list[tuple[str, dict[str, float]]] = []
    for c in mistakes(record):
        plain = None if regression_of is None else _Plain.of(c.record, regression_of)
        if regression_of is not None and (plain is None or (reference and _shows(reference.fit, plain.fit))):
            continue
        moved = _moved_plainly(result, reference, plain)
        if moved is None:
            other = undone(reduce, c.record)
            if other is None or _shows((result.residual_std, result.dof), (other.residual_std, other.dof)):
                continue
            moved = _moved(result, {x.name: x.estimate for x in other.coefficients})
        if moved:
            found.append((c.words, moved))
    return sorted(found, key=lambda f: -max(f[1].values()))


def _largest(moved: dict[str, float]) -> str:
    first = sorted(moved, key=lambda n: -moved[n])[:LARGEST]
    return ", ".join(f"{name} by {plain(moved[name])} u" for name in first)


def _moved_plainly(result: DriftTestResult, reference: _Plain | None, plain: _Plain | None) -> dict[str, float] | None:
    """Return the same of what least squares makes of both; None where a coefficient is no unknown of the regression."""
    if (
        reference is None
        or plain is None
        or any(n not in reference.values or n not in plain.values for n in result.names)
    ):
        return None
    moved = {n: plain.values[n] - reference.values[n] for n in result.names}
    return _moved(result, {c.name: c.estimate + moved[c.name] for c in result.coefficients})


def _moved(result: DriftTestResult, there: dict[str, float]) -> dict[str, float]:
    """Return by how many u the estimates differ, of those that differ by more than UNITY."""
    each = {c.name: abs(there[c.name] - c.estimate) / c.u for c in result.coefficients if c.name in there and c.u > 0.0}
    return {n: v for n, v in each.items() if v > UNITY}


def _shows(reference: tuple[float, float], other: tuple[float, float]) -> bool:
    """Return whether the scatter of a record with a mistake, and its degrees of freedom, is beyond the record's."""
    if not reference[0] > 0.0:
        return False
    (scatter, dof), (without, before) = other, reference
    return float(special.fdtrc(max(dof, 1.0), max(before, 1.0), (scatter / without) ** 2)) < LEVEL


@dataclass(frozen=True)
class _Plain:
    """Least squares of a test's regression: residual standard deviation with its degrees of freedom, and the unknowns
    that are coefficients, in their printed units.
    """

    fit: tuple[float, float]
    values: dict[str, float]

    @classmethod
    def of(cls, record: Record, regression_of: Callable[[Record], Regression]) -> _Plain | None:
        """Return None where the record cannot be fitted."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            try:
                data = regression_of(record)
            except IMPOSSIBLE:
                return None
        weight = np.ones_like(data.y) if data.weights is None else np.sqrt(data.weights)
        X, y = data.X * weight[:, None], data.y * weight
        dof = y.size - X.shape[1]
        if not (np.all(np.isfinite(X)) and np.all(np.isfinite(y))) or dof < 1:
            return None
        size = np.linalg.norm(X, axis=0)
        size = np.where(size > 0.0, size, 1.0)
        found = np.linalg.lstsq(X / size, y, rcond=None)[0]
        left = y - X / size @ found
        units = [(q.title, q.scale) for q in data.quantities if isinstance(q, Quantity)]
        values = {n: float(b) / s for (n, s), b in zip(units, found / size, strict=False)}
        return cls((math.sqrt(float(left @ left) / dof), float(dof)), values)
