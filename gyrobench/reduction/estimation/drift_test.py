"""The skeleton of a drift or calibration test: a test states its data and its errors, this runs the rest.

    class Tumble(DriftReduction[TumbleSetup]):
        def problems(self): ...                # what makes setup or record impossible
        def regression(self): ...              # data, design matrix, quantities, what they are drawn against
        def effects(self, found): ...          # sources of error of the set-up, with what they do to the data
        @Source(...)                           # one of its own: what an error of one unit does to the data
        def level(self, found): ...
        def account(self, found): ...          # method, equation, conventions, tables of its own

        setup_of = ...                         # run.json -> setup

    result = Tumble.reduce(windows, setup)     # or Tumble.from_record(record)

From these follow the fit under an estimated noise model with its candidates, the corrections, the weights and the
budget of the set-up, predicted shifts, tests of the residuals, outliers, closed forms beside the fit, the diagnosis of
handling errors in a measured record, and the reasons that withhold a verdict.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, ClassVar, Generic, Self, TypeVar

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.effects import remounts, with_set_up
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.fit_result import Account, fit_result
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.sentences import told
from gyrobench.reduction.setup.setups import Setup
from gyrobench.reduction.setup.sources import Effect, declared
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Coefficient, DriftTestResult

S = TypeVar("S", bound=Setup)


class DriftReduction(Generic[S]):
    """One reduction of one record; see the module.  windows: columns of the record, SI."""

    #: record -> mistakes in taking or labelling it that make sense in this test (diagnosis.handling_candidates)
    handling: ClassVar[Any] = None
    #: names and ids of sources of another channel of the same record, whose corrections are left to it
    elsewhere: Sequence[str] = ()
    found: Findings  # the fit that is reported

    def __init__(self, windows: Mapping[str, Array], setup: S) -> None:
        self.windows, self.setup = windows, setup

    # ------------------------------------------------------------------------------ what a test states
    @classmethod
    def setup_of(cls, run: RunDocument) -> S:
        """Return the setup that a run.json describes: a :class:`Setup`, of a test that has none of its own."""
        setup: Any = Setup.of(run)
        return setup  # type: ignore[no-any-return]

    def problems(self) -> list[str]:
        """Return what makes setup or record impossible, as sentences."""
        return []

    @abstractmethod
    def regression(self) -> Regression:
        """Return the data with their linear model.  May raise ReductionError."""
        raise NotImplementedError

    def fitted(self) -> Findings:
        """Return the fit of :meth:`regression`.  May raise ReductionError."""
        return self.regression().fit()

    def derived(self, found: Findings) -> Findings:
        """Return the fit reported as functions of its unknowns (:meth:`Findings.derive`)."""
        return found

    def effects(self, found: Findings) -> list[Effect]:
        """Return the sources of error of the set-up, with what they do to the data, beside the declared ones."""
        return []

    def test(self, found: Findings) -> None:
        """Add F tests of what the model leaves out (:meth:`Findings.f_test`)."""

    @abstractmethod
    def account(self, found: Findings) -> Account:
        """Return what the test says of itself, beside its figures."""
        raise NotImplementedError

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Return the result with what is not of the fit."""
        return result

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        """Return the numbers that matter, as sentences: the first coefficient, the largest drift per g, the noise."""
        first, linear = coefficients[0], [c for c in coefficients if c.unit == "°/h/g"]
        largest = max(linear, key=lambda c: abs(c.estimate), default=None)
        sentences = [f"Constant drift {first.name} = {{{first.name}}}."]
        if largest is not None:
            sentences.append(f"Largest drift per g: {largest.name} = {{{largest.name}}}.")
        return [*told(coefficients, *sentences), found.noise_sentence(), *found.nuisance_sentences()]

    # ------------------------------------------------------------------------------ what follows
    def all_effects(self, found: Findings) -> list[Effect]:
        """Return the declared sources, each with the error of the data of its method, then :meth:`effects`."""
        own = [source.effect(self.setup, getattr(self, n)(found)) for n, source in declared(type(self)).items()]
        return [*own, *self.effects(found)]

    @classmethod
    def reduce(cls, windows: Mapping[str, Array], setup: S) -> DriftTestResult:
        """Return what the windows of a record say.  Raises ReductionError with everything that is wrong."""
        return cls._checked(windows, setup).result()

    @classmethod
    def _checked(cls, windows: Mapping[str, Array], setup: S) -> Self:
        test = cls(windows, setup)
        if problems := test.problems():  # many set what the regression reads
            raise ReductionError(problems)
        return test

    def result(self) -> DriftTestResult:
        """Return what the data say, without the checks of :meth:`problems`."""
        setup = self.setup
        found = self.fitted()
        found = with_set_up(self.derived(found), self.all_effects, setup.corrections, self.elsewhere, setup.remount)
        self.test(found)
        effects = [*self.all_effects(found), *(remounts(found, setup.remount) if setup.remount else [])]
        return self.finished(found, effects)

    def finished(self, found: Findings, effects: Sequence[Effect]) -> DriftTestResult:
        """Return the result of a fit with its sources of error."""
        self.found = found
        result = self.completed(fit_result(found, self.account(found), effects, self.setup))
        return replace(result, summary=self.summary(found, result.coefficients))

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says as it is labelled: of one day, of several, of several channels."""
        return cls.reduce(record.windows, cls.setup_of(record.run))

    @classmethod
    def from_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says; a measured one is examined for handling errors where its residuals are not
        ordinary.
        """
        from gyrobench.reduction.diagnosis.examination import examined

        return examined(record, cls.of_record, cls.handling, cls.regression_of())

    @classmethod
    def regression_of(cls) -> Callable[[Record], Regression] | None:
        """Return record -> its data with their linear model; None of a test whose record is not one fit."""
        own = cls.of_record.__func__, cls.reduce.__func__  # type: ignore[attr-defined]
        base = DriftReduction.of_record.__func__, DriftReduction.reduce.__func__  # type: ignore[attr-defined]
        if own != base or cls.regression is DriftReduction.regression:
            return None
        return lambda record: cls._checked(record.windows, cls.setup_of(record.run)).regression()
