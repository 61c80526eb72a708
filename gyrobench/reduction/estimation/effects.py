"""Effects of the sources of error on a test, and measured errors, which are taken out of its data.

    effects = [TORQUER_SCALE.effect(setup, fit.error(-k * current))]
    fit = with_set_up(fit, lambda f: [...], "torquer scale factor = 1.2e-4(2e-5)")

A correction is linear in the error, as the budget is; what the data are wrong by is taken from them and the fit made
again, noise model included, so a known error neither biases the coefficients nor widens their intervals.  An error of
which only the standard uncertainty is stated is in the covariance of the data (known_errors): what it leaves in the
residuals is not taken for noise, which would count it a second time.  (Not one that is relative to the reading.)
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.component.set_up import Errors
from gyrobench.reading import shorten
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.linear_fit import without
from gyrobench.reduction.setup.run_metadata import Remount
from gyrobench.reduction.setup.sources import RELATIVE, REMOUNT, Effect, Source
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Table

FORM = "'SOURCE = VALUE(U) UNIT; ...', such as 'angle error, once a turn (sine) = 12(2) arcsec'"
_ONE = re.compile(r"\s*(?P<source>.+?)\s*=\s*(?P<value>[-+\d.eE]+)\s*\(\s*(?P<u>[\d.eE+-]+)\s*\)\s*(?P<unit>\S*)\s*")
UNSTATED = (
    "each mount is taken once, so drift from mount to mount is in the estimates and not in u. State u_remount, repeat "
    "the mounts, or declare type_b = none."
)
TOUCHED = 0.1  # of what the mounts differ by: least change of a coefficient that rests on them alike
PREDICTED = "budget.predicted"  # id of the table of shifts by simulated errors
CORRECTIONS = "budget.corrections"
APART = 2  # parts of a source up to which each has a line of its own


@dataclass(frozen=True)
class Correction:
    """A measured error of the set-up, SI, with its standard uncertainty, which replaces that of its source."""

    source: str
    value: float
    u: float
    unit: str


def with_set_up(
    found: Findings, effects_of: Callable[[Findings], Sequence[Effect]], text: str = "", elsewhere: Sequence[str] = (),
    remount: Remount | None = None,
) -> Findings:  # fmt: skip
    """Return the fit of the data less the errors that ``text`` states, :data:`FORM`, with those that have a standard
    uncertainty only in the covariance of the data, but for :data:`RELATIVE` ones; effects_of: the test's sources,
    remount: another.

    elsewhere: sources of another channel, whose corrections are left to it.  The same fit where nothing is stated.
    Raises ReductionError for text of another form, and for a source or unit that the test does not have.
    """
    effects = [*effects_of(found), *(remounts(found, remount) if remount else [])]
    taken = _corrections(effects, text, elsewhere)
    errors = {n: row for e in effects if e.names for n, row in zip(e.names, np.atleast_2d(e.error), strict=True)}  # type: ignore[arg-type]
    rows = [(e, np.atleast_2d(e.error)) for e in effects if e.error is not None and e.unit != RELATIVE]
    known = [_standard_sizes(e, len(error), taken)[:, None] * error for e, error in rows]
    every = np.vstack([np.zeros((0, found.y.size)), *known])
    every = every[np.any(every, axis=1)]
    if not taken and not len(every):
        return found
    error = sum((c.value * errors[c.source] for c in taken), np.zeros(found.y.size))
    again = without(found, error, every if len(every) else None)
    return replace(again, corrections=tuple(taken), known_tests=again.made_tests)


def misstated(text: str) -> str:
    """Return what is wrong with the form of an option corrections, "" for nothing.  Its sources the fit knows."""
    wrong = [one for one in text.split(";") if one.strip() and not _ONE.fullmatch(" ".join(one.split()))]
    return f"corrections: '{shorten(wrong[0].strip())}' is not of the form {FORM}" if wrong else ""


def unknown_sources(text: str, known: Sequence[Source]) -> list[str]:
    """Return what is wrong with the sources that an option corrections names, as far as it is known before a run:
    those that none of the known is called.  Which of the others a test has its data tell.
    """
    stated = [" ".join(one.rpartition("=")[0].split()) for one in text.split(";") if one.strip()]
    names = [f"{s.name} ({part})" if part else s.name for s in known for part in s.parts or ("",)]
    return [_no_source(n, names) for n in stated if not any(s.names(n) for s in known)]


def _no_source(source: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(source, list(known), 1, 0.4)
    return f"corrections: no source '{source}'" + (f"; meant is perhaps '{near[0]}'" if near else "")


def _corrections(effects: Sequence[Effect], text: str, elsewhere: Sequence[str]) -> list[Correction]:
    if not text.strip():
        return []
    unit = {n: e.unit for e in effects for n in e.names}
    by_id = {i: n for e in effects for i, n in zip(e.ids, e.names, strict=True)}
    stated = [one for one in text.split(";") if one.strip()]
    taken = [_read(one, unit, by_id) for one in stated if one.rpartition("=")[0].strip() not in elsewhere]
    if len({c.source for c in taken}) < len(taken):
        raise ReductionError(f"corrections: a source stands twice in '{text}'")
    return taken


def _read(text: str, unit: Mapping[str, str], by_id: Mapping[str, str]) -> Correction:
    text = " ".join(text.split())  # the pattern would go through long runs of spaces again and again
    match = _ONE.fullmatch(text)
    if match is None:
        raise ReductionError(f"corrections: '{shorten(text)}' is not of the form {FORM}")
    source = by_id.get(match["source"], match["source"])
    if source not in unit:
        raise ReductionError(f"{_no_source(source, unit)}; this test has: {'; '.join(unit)}")
    try:
        given = [units.parse_quantity(f"{match[k]}{match['unit']}", unit[source]) for k in ("value", "u")]
    except ValueError as error:
        raise ReductionError(f"corrections: {source}: {error}") from None
    if not given[1] >= 0.0:
        raise ReductionError(f"corrections: {source}: its standard uncertainty {match['u']} must not be negative")
    return Correction(source, given[0], given[1], unit[source])


def remounts(found: Findings, remount: Remount) -> list[Effect]:
    """Return the drift from mount to mount as a source where the plan does not show it: each mount is taken once, and
    what a constant of its own does to the data is what some coefficients do.  Where it is weighed there is none.
    """
    each = [h.candidate.block.columns.T for h in found.hidden if h.candidate.kind == "mount"]
    needed = "" if remount.stated else UNSTATED
    return [REMOUNT.effect(remount.size, e, needed=needed) for e in each]


def one_by_one(error: Array, group: NDArray[np.int_]) -> Array:
    """Return an error (n,) of the data as errors (m, n) of its m groups of rows, each by itself; ``group``: (n,)."""
    return np.array([np.where(group == g, error, 0.0) for g in np.unique(group)])


def standard_changes(fit: Findings, effect: Effect) -> Array:
    """Return the changes (m, q) by one standard uncertainty of each part: the source's, or that of its correction."""
    changes = effect.changes(fit)
    return np.asarray(changes * _standard_sizes(effect, len(changes), fit.corrections)[:, None])


def _standard_sizes(effect: Effect, parts: int, corrections: Sequence[Correction]) -> Array:
    """Return the standard uncertainty (parts,) of each part."""
    own = {c.source: c.u for c in corrections}
    return np.array([own.get(name, effect.size) for name in effect.names or [""] * parts])


def budget_rows(fit: Findings, effect: Effect) -> Iterator[tuple[str, float, Array, str]]:
    """Yield name, standard uncertainty, sensitivity (q,) with its sign, and note of each line of the budget.

    Many parts share a line, whose sensitivity is their root sum of squares and has no sign.
    """
    changes = effect.changes(fit)
    own = {c.source: c for c in fit.corrections}
    if len(effect.names) != len(changes) or (len(changes) > APART and not own.keys() & set(effect.names)):
        together = f"root sum of squares of {len(changes)} independent errors"
        note = "; ".join(filter(None, [effect.note, together if len(changes) > 1 else ""]))
        yield effect.source, effect.size, np.sqrt(np.sum(changes**2, axis=0)) if len(changes) > 1 else changes[0], note
        return
    for name, change in zip(effect.names, changes, strict=True):
        size = own[name].u if name in own else effect.size
        yield name, size, change, "; ".join(filter(None, [effect.note, "corrected" if name in own else ""]))


def correction_table(fit: Findings) -> list[Table]:
    """Return the table of the corrections; none without."""
    if not fit.corrections:
        return []
    caption = (
        "Measured errors of the set-up, whose effect was taken out of the data before the fit; the closed formulas use "
        "the data as they are."
    )
    rows = [[c.source, c.value, c.u, c.unit] for c in fit.corrections]
    return [Table(CORRECTIONS, "Corrections", caption, ["source", "value", "u", "unit"], rows)]


def simulated_table(fit: Findings, effects: Sequence[Effect], simulated: Errors | None = None) -> list[Table]:
    """Return the table of the shifts by simulated errors of the set-up; none where the effects have no such error.

    A shift is sensitivity times error, less what a correction has taken out; it is known before anything is measured.
    """
    taken = {c.source: c.value for c in fit.corrections}
    known: list[tuple[str, float, str, Array]] = []
    for e in effects:
        for name, value, change in zip(e.names, e.errors(simulated or {}), e.changes(fit), strict=False):
            if value:
                known.append((name, value, e.unit, (value - taken.get(name, 0.0)) * change))
    if not known:
        return []
    shifts = [(q.title, [float(shift[j]) / q.scale for *_, shift in known], float(fit.u[j]) / q.scale, q.unit)
              for j, q in enumerate(fit.quantities)]  # fmt: skip
    return [shifts_table([e[:3] for e in known], shifts)]


def shifts_table(
    errors: Sequence[tuple[str, float, str]], shifts: Iterable[tuple[str, Sequence[float], float, str]]
) -> Table:
    """Return the table of the shifts by errors (name, SI, its unit): of each figure name, shift by each, u, unit."""
    said = [f"({n}) {name}, {units.format_quantity(x, unit)}" for n, (name, x, unit) in enumerate(errors, 1)]
    caption = (
        "Change of each estimate against a set-up without these errors, sensitivity of the budget times error: "
        f"{'; '.join(said)}."
    )
    columns = ["coefficient", *(f"({n + 1})" for n in range(len(errors))), "sum", "u", "unit"]
    rows = [[name, *each, sum(each), u, unit] for name, each, u, unit in shifts]
    return Table(PREDICTED, "Predicted shifts by simulated errors", caption, columns, rows)
