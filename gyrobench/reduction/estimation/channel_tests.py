"""The skeleton of a test with several channels: each is a drift test of its own, and all are reported as one.

    class MyChannel(DriftReduction[MySetup]): ...            # made with windows, setup, "x" or "y"
    class Reduction(ChannelTests[MySetup]):
        channel = MyChannel

The noise of different ones is taken as uncorrelated, errors of the set-up that several name are one (merge_channels).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, TypeVar

from gyrobench.reduction.estimation.drift_test import DriftReduction
from gyrobench.reduction.estimation.merge_channels import merge
from gyrobench.reduction.estimation.sentences import told
from gyrobench.reduction.setup.setups import Setup
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table

S = TypeVar("S", bound=Setup)


class ChannelTests(DriftReduction[S]):
    """Channels of one record, those of a gyro of two degrees of freedom unless ``names`` says others; see the module.

    label: of a channel in the report.
    """

    names: ClassVar[Sequence[str]] = ("x", "y")
    channel: ClassVar[Any]  # windows, setup, one of names -> the test of a channel
    label: ClassVar[str] = "{} channel"

    def of_channel(self, name: str) -> DriftReduction[S]:
        """Return the test of a channel."""
        test: DriftReduction[S] = type(self).channel(self.windows, self.setup, name)
        return test

    def equation(self) -> str | None:
        """Return the equation of all channels, Typst math; None: those of the channels below one another."""
        return None

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        """Return tables of all channels together."""
        return []

    def reasons(self) -> list[Reason]:
        """Return what limits all channels."""
        return []

    def overview(self, results: Mapping[str, DriftTestResult]) -> list[str]:
        """Return the numbers that matter, as sentences: the first coefficients, the largest drift per g."""
        first = [r.coefficients[0].name for r in results.values()]
        every = [c for r in results.values() for c in r.coefficients]
        linear = max((c for c in every if c.unit == "°/h/g"), key=lambda c: abs(c.estimate)).name
        constant = " and ".join(f"{n} = {{{n}}}" for n in first)
        return told(every, f"Constant drift {constant}.", f"Largest drift per g: {linear} = {{{linear}}}.")

    def result(self) -> DriftTestResult:
        """Return what all channels say, without the checks of :meth:`problems`."""
        self.each = {c: self.of_channel(c) for c in self.names}
        results = {self.label.format(c): test.result() for c, test in self.each.items()}
        own = [f"{name}: {text}" for name, r in results.items() for text in r.summary]
        coefficients = [c for r in results.values() for c in r.coefficients]
        return merge(
            results, equation=self.equation(), summary=[*self.overview(results), *own],
            tables=self.tables(coefficients), reasons=self.reasons(),
        )  # fmt: skip
