"""Diagnosis of handling errors: which mistake in taking or labelling a measured record makes its residuals ordinary.

    result = examined(record, reduce, candidates)      # candidates: record -> the mistakes that make sense in this test

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

Not seen: mistakes that leave the residuals as they are and change the estimates alone; what a record does not show is
asked for (unshown.py).  Such are reversed current or
rotation throughout a tumble, or a wrong unit of its current, where the input axis sees no rate (coefficients reversed
or scaled); positions 5 to 8 among themselves with six terms of the eight positions; attitudes that are taken once each
and are as many as the coefficients (vertical and level servo test: coefficients of the size of the Earth rate); sign,
latitude and unit in one attitude; latitude of the other sign in the servo tests.  Coefficients of the size of the Earth
rate, which some of them leave, are pointed out (plausibility.py).  Two mistakes at once.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from scipy import special

from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import asked
from gyrobench.reduction.estimation.findings import RAW, WHITENED
from gyrobench.reduction.estimation.fit_result import UNSTATED
from gyrobench.reduction.estimation.nuisances import BOTH, NUISANCES, InTheModel
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.result import Autocorrelation, DriftTestResult, Reason, Table

Reduce = Callable[[Record], DriftTestResult]
DIAGNOSIS = "handling.diagnosis"  # id of the table
HANDLING = "handling.error"
FACTOR = 3.0  # least ratio of the residual scatters
LEVEL = 1e-3  # of the F test, all mistakes together
SLOW = 10.0  # the same where they are correlated
FEW = 10.0  # degrees of freedom below which the tests of the residuals say nothing
SHOWN = 6  # mistakes in the table
#: options without unknowns for small errors of the set-up, which may take a mistake for one
PLAIN = {"nuisances": "none", "tilt": "no"}
IMPOSSIBLE = (GyrobenchError, ValueError, ArithmeticError)  # of a record that a mistake undone makes nonsense of


@dataclass(frozen=True)
class HandlingCandidate:
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


def with_diagnosis(
    record: Record, result: DriftTestResult, reduce: Reduce, candidates: Callable[[Record], Iterable[HandlingCandidate]]
) -> DriftTestResult:
    """Return the result with the mistake that explains its residuals named, where they are not ordinary."""
    reference, simple = result, record
    if _hides(result, record):
        simple = with_options(record, PLAIN)
        reference = undone(reduce, simple) or result
    if not _suspicious(reference):
        return result
    return _diagnosed(result, reference, reduce, list(candidates(simple)))


def _hides(result: DriftTestResult, record: Record) -> bool:
    """True where small errors of the set-up are among the unknowns."""
    nuisances = any(t.kind == NUISANCES for t in result.tables)
    return nuisances or record.run.options.get("tilt") in (True, "yes")


def with_options(record: Record, options: Mapping[str, Any]) -> Record:
    """Return the record with other options in its run.json."""
    run = record.run.model_copy(update={"options": {**record.run.options, **options}})
    return Record(record.windows, record.channels, run)


def _contradicted(result: DriftTestResult) -> bool:
    return any(r.severity == "doubt" and not r.id.endswith(UNSTATED) for r in result.reasons)


def _suspicious(result: DriftTestResult) -> bool:
    if result.residual_std <= 0.0 or result.ideal:
        return False
    return _contradicted(result) or _correlated(result) or result.dof < FEW


def _correlated(result: DriftTestResult) -> bool:
    return any(t.id.partition(":")[0] in (RAW, WHITENED) and t.p is not None and t.p < 1e-3 for t in result.tests)


def undone(reduce: Reduce, record: Record) -> DriftTestResult | None:
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
    acf = result.acf or Autocorrelation([], [], [])
    for rho, bound in zip(acf.rho[1:], acf.bound[1:], strict=True):
        if rho < bound:
            break
        total += rho
    return max(windows - result.rank, 1.0) / (1.0 + 2.0 * total)


def cures(reduce: Reduce, candidates: Iterable[HandlingCandidate]) -> str:
    """Return the mistakes without which a record that is refused is an ordinary one; "" where there are several ways
    or none.
    """
    words = []
    for c in candidates:
        found = undone(reduce, c.record)
        if found is not None and not _contradicted(found) and found.dof >= FEW:
            words.append(c.words)
    return " or ".join(words) if len(words) <= 3 else ""


def _diagnosed(
    result: DriftTestResult, reference: DriftTestResult, reduce: Reduce, candidates: list[HandlingCandidate]
) -> DriftTestResult:
    """Return the result with what undoing each mistake does to the residuals, and those that explain them named.

    reference: the record as labelled, without unknowns for errors of the set-up.
    """
    tried = []
    for c in candidates:
        found = undone(reduce, c.record)
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
        return result
    if not named and not _contradicted(reference) and not _correlated(reference):  # few data, no sign of a mistake
        return result
    unit = reference.residual_unit
    table = Table(
        DIAGNOSIS, "Diagnosis of handling errors",
        f"The record reduced again with each of {len(candidates)} mistakes undone; scatter in the scale of the record "
        f"as labelled; p: F test against it, times {len(candidates)}",
        ["with", f"residual scatter / ({unit})", "residuals", "p"],
        [["as labelled", reference.residual_std, "not ordinary", None], *(t.row for t in tried[:SHOWN])],
    )  # fmt: skip
    result = replace(result, tables=[table, *result.tables])
    if not named:
        text = (
            f"The residuals hold more than noise: with {better[0].words} their scatter is "
            f"{plain(better[0].scatter, 3)} {unit}, as labelled {plain(reference.residual_std, 3)} {unit}; no mistake "
            "that was tried explains them."
        ) if better else ""  # fmt: skip
        reasons = [Reason("handling.unexplained", text, BOTH, severity="doubt")] if better else []
        return replace(result, reasons=[*reasons, *result.reasons])
    as_labelled, best = (plain(x, 3) for x in (reference.residual_std, named[0].scatter))
    scatters = f"residual scatter {as_labelled} {unit} as labelled, {best} {unit} with "
    names = [t.words for t in named[:4]] + ([f"{len(named) - 4} more"] if len(named) > 4 else [])
    several = " The record cannot tell which of these." if len(named) > 1 else ""
    hidden = " As reduced, it is taken for an error of the set-up." if explained else ""
    error = ", or ".join(names)
    wrong = "The coefficients are wrong until the record is corrected."
    reasons = [
        Reason(HANDLING, f"Handling error: {scatters}{error}.{several}{hidden} {wrong}", severity="error"),
        Reason(HANDLING, f"A handling error explains the residuals: {error}.", BOTH, severity="doubt"),
    ]
    summary = [text for text in result.summary if not isinstance(text, InTheModel)]
    return replace(result, reasons=[*reasons, *result.reasons], summary=summary)
