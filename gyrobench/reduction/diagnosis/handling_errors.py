"""Diagnosis of handling errors: which mistake in taking or labelling a measured record makes its residuals ordinary.

    @handling_errors.examined(candidates)          # candidates: record -> the mistakes that make sense in this test
    def from_record(record, specification=None): ...

A measured record is examined where its residuals are not ordinary: a test of the fit contradicts model or noise, they
are correlated (a mistake may hide in what is taken for slow noise) or too few to say.  It is then reduced again
with each mistake undone, and without the unknowns that are there for small errors of the set-up: a misalignment of
minutes of arc can take a mistake in.  A mistake is named when

1. the residual scatter with it undone is at least :data:`FACTOR` times smaller; :data:`SLOW` times where what is left
   is correlated, for it may be the rest of another mistake, taken for slow noise;
2. an F test of the two scatters has p < :data:`LEVEL` over the number of mistakes tried (Bonferroni), with degrees of
   freedom of independent residuals, that is reduced by the autocorrelation of what is left;
3. no test of the fit with it undone contradicts model or noise.

Where 2 holds with :data:`FACTOR` but no mistake is named, there is more than noise in the residuals: inconclusive.

A true record is fitted by the true design up to noise; a wrong design adds to its scatter.  That it takes away
8/9 of the variance of the noise, and leaves the rest white under the noise model, does not happen by chance; FACTOR
keeps this so where slow noise leaves few independent residuals.  Mistakes whose scatter is not larger than the least
by an F test are named with it: a tumble with its mounts exchanged has the residuals of one with its dwells exchanged.

Not seen: mistakes that leave the residuals as they are and change the estimates alone.  Such are reversed current or
rotation throughout a tumble, or a wrong unit of its current, where the input axis sees no rate (coefficients reversed
or scaled); positions 5 to 8 among themselves with six terms of the eight positions; attitudes that are taken once each
and are as many as the coefficients (vertical and level servo test: coefficients of the size of the Earth rate); sign,
latitude and unit in one attitude; latitude of the other sign in the servo tests.  Coefficients of the size of the Earth
rate, which some of them leave, are pointed out (plausibility.py).  Two mistakes at once.
"""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from scipy import special

from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis import plausibility
from gyrobench.reduction.estimation import asked, uncertainty
from gyrobench.reduction.estimation.effects import UNSTATED
from gyrobench.reduction.setup.run_metadata import NO_TYPE_B, Site
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import DriftTestResult, Specification

Reduce = Callable[..., DriftTestResult]
FACTOR = 3.0  # least ratio of the residual scatters
LEVEL = 1e-3  # of the F test, all mistakes together
SLOW = 10.0  # the same where they are correlated
FEW = 10.0  # degrees of freedom below which the tests of the residuals say nothing
SHOWN = 6  # mistakes in the table
#: options without unknowns for small errors of the set-up, which may take a mistake for one
PLAIN = {"nuisances": "none", "tilt": "no"}
IMPOSSIBLE = (GyrobenchError, ValueError, ArithmeticError)  # of a record that a mistake undone makes nonsense of


@dataclass(frozen=True)
class Candidate:
    """A mistake that may have been made.  record: with the mistake undone.  scale: by what undoing it multiplies the
    data and their noise: scatters are compared in the scale of the record as labelled.
    """

    words: str  # "mount 1 and mount 2 exchanged"
    record: Record
    scale: float = 1.0


@dataclass(frozen=True)
class _Tried:
    words: str
    scatter: float
    ordinary: bool
    nu: float  # degrees of freedom
    p: float  # of the F test, times the number of mistakes
    factor: float  # least ratio

    @property
    def row(self) -> list[Any]:
        return [self.words, self.scatter, "ordinary" if self.ordinary else "not ordinary", self.p]


def examined(candidates: Callable[[Record], Iterable[Candidate]]) -> Callable[[Reduce], Reduce]:
    """Return a decorator for the from_record of a test, which adds the diagnosis to its result."""

    def decorate(reduce: Reduce) -> Reduce:
        @functools.wraps(reduce)
        def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
            if not record.run.measured:  # a simulated one knows its truth, and its set-up errors by name
                return reduce(record, specification)
            try:
                result = reduce(record, specification)
            except GyrobenchError as error:
                if named := _cures(reduce, candidates(record)):
                    hint = f"it can be reduced, with ordinary residuals, with {named}: was that mistaken?"
                    raise ReductionError([*getattr(error, "problems", [str(error)]), hint]) from None
                raise
            if "latitude" in record.run.options:
                result.warnings += plausibility.earth_rate_warnings(result, Site.of(record.run))
            reference, plain = result, record
            if _hides(result, record):
                plain = with_options(record, PLAIN)
                reference = _undone(reduce, plain) or result
            if _suspicious(reference):
                _diagnose(result, reference, reduce, list(candidates(plain)))
            return result

        return from_record

    return decorate


def _hides(result: DriftTestResult, record: Record) -> bool:
    """True where small errors of the set-up are among the unknowns."""
    nuisances = any(t["title"].startswith("Nuisance model") for t in result.tables)
    return nuisances or record.run.options.get("tilt") in (True, "yes")


def with_options(record: Record, options: Mapping[str, Any]) -> Record:
    """Return the record with other options in its run.json."""
    run = record.run.model_copy(update={"options": {**record.run.options, **options}})
    return Record(record.windows, {}, run)


def _contradicted(result: DriftTestResult) -> bool:
    return any(reason != NO_TYPE_B and not reason.endswith(UNSTATED) for reason in result.withheld)


def _suspicious(result: DriftTestResult) -> bool:
    if result.residual_std <= 0.0 or str(result.noise.get("model", "")).startswith("none"):
        return False
    return _contradicted(result) or _correlated(result) or result.dof < FEW


def _correlated(result: DriftTestResult) -> bool:
    return any(t.name.startswith("Ljung-Box") and t.p is not None and t.p < 1e-3 for t in result.tests)


def _undone(reduce: Reduce, record: Record) -> DriftTestResult | None:
    """Return the residuals of a record with a mistake undone (asked); None where that makes nonsense of it."""
    with warnings.catch_warnings(), asked.residuals_alone():
        warnings.simplefilter("ignore", RuntimeWarning)
        try:
            return reduce(record)
        except IMPOSSIBLE:
            return None


def _freedom(result: DriftTestResult, windows: int) -> float:
    """Return the degrees of freedom of the residuals as independent ones: over 1 + 2 sum rho, up to the first lag that
    is not significant.
    """
    total = 0.0
    for rho, bound in list(zip(result.acf.get("rho", []), result.acf.get("bound", []), strict=False))[1:]:
        if rho < bound:
            break
        total += rho
    return max(windows - result.rank, 1.0) / (1.0 + 2.0 * total)


def _cures(reduce: Reduce, candidates: Iterable[Candidate]) -> str:
    """Return the mistakes without which a record that is refused is an ordinary one; "" where there are several ways
    or none.
    """
    words = []
    for c in candidates:
        found = _undone(reduce, c.record)
        if found is not None and not _contradicted(found) and found.dof >= FEW:
            words.append(c.words)
    return " or ".join(words) if len(words) <= 3 else ""


def _diagnose(result: DriftTestResult, reference: DriftTestResult, reduce: Reduce, candidates: list[Candidate]) -> None:
    """Add to ``result`` what undoing each mistake does to the residuals, and name those that explain them.

    reference: the record as labelled, without unknowns for errors of the set-up.
    """
    tried = []
    for c in candidates:
        found = _undone(reduce, c.record)
        if found is None:
            continue
        scatter = found.residual_std / c.scale
        ratio = (reference.residual_std / scatter) ** 2 if scatter > 0.0 else math.inf
        nu = _freedom(found, len(next(iter(c.record.windows.values()))))
        p = min(float(special.fdtrc(nu, nu, ratio)) * len(candidates), 1.0)
        factor = SLOW if _correlated(found) else FACTOR
        tried.append(_Tried(c.words, scatter, not _contradicted(found), nu, p, factor))
    tried.sort(key=lambda t: t.scatter)
    better = [t for t in tried if t.p < LEVEL and FACTOR * t.scatter < reference.residual_std]
    named = [t for t in better if t.ordinary and t.factor * t.scatter < reference.residual_std]
    named = [t for t in named if float(special.fdtrc(t.nu, t.nu, (t.scatter / named[0].scatter) ** 2)) > LEVEL]
    explained = reference is not result and not _contradicted(result)  # by small errors of the set-up
    if not named and (explained or not (better or _contradicted(reference))):
        return
    if not named and not _contradicted(reference) and not _correlated(reference):  # few data, no sign of a mistake
        return
    unit = reference.residual_unit
    result.tables.insert(0, {
        "title": "Diagnosis of handling errors",
        "caption": f"The record reduced again with each of {len(candidates)} mistakes undone; scatter in the scale of "
        f"the record as labelled; p: F test against it, times {len(candidates)}",
        "columns": ["with", f"residual scatter / ({unit})", "residuals", "p"],
        "rows": [["as labelled", reference.residual_std, "not ordinary", None], *(t.row for t in tried[:SHOWN])],
    })  # fmt: skip
    if not named:
        if better:
            reason = (
                f"The residuals hold more than noise: with {better[0].words} their scatter is {better[0].scatter:.3g} "
                f"{unit}, as labelled {reference.residual_std:.3g} {unit}; no mistake that was tried explains them."
            )
            uncertainty.withhold(result, [reason])
        return
    result.summary[:] = [text for text in result.summary if not text.startswith("In the model: ")]
    scatters = f"residual scatter {reference.residual_std:.3g} {unit} as labelled, {named[0].scatter:.3g} {unit} with "
    names = [t.words for t in named[:4]] + ([f"{len(named) - 4} more"] if len(named) > 4 else [])
    several = " The record cannot tell which of these." if len(named) > 1 else ""
    hidden = " As reduced, it is taken for an error of the set-up." if explained else ""
    error = ", or ".join(names)
    uncertainty.withhold(result, [f"A handling error explains the residuals: {error}."])
    wrong = "The coefficients are wrong until the record is corrected."
    result.warnings.insert(0, f"Handling error: {scatters}{error}.{several}{hidden} {wrong}")
