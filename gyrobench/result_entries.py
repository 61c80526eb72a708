"""Entries of a result: coefficients, tests, tables, budget lines, reasons, figures.

Numbers are in surface units, the unit beside them.  What logic looks for has an ``id``; names, titles and sentences are
for readers alone and may be reworded or translated.  Nothing here computes, and nothing is changed after it is made.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

from gyrobench import units
from gyrobench.result_content import EMPTY

NO_VERDICT = "no specification given"
Limit = tuple[float | None, float | None]  # low and high, in the unit of the report; None: that side is open
Specification = Mapping[str, Limit]  # coefficient -> limit: what a result is judged by
Column = tuple[Iterable[float], str, str]  # values, name and unit


class StatedLimit(tuple[float | None, float | None]):
    """A limit of a file, in the unit that is written there; ``entry``: of which file and coefficient."""

    unit: str
    entry: str

    @classmethod
    def of(cls, low: float | None, high: float | None, unit: str, entry: str) -> StatedLimit:
        limit = cls((low, high))
        limit.unit, limit.entry = unit, entry
        return limit

    def in_unit(self, unit: str) -> Limit:
        """Return the limit in another unit of the same dimension.  Raises UnitError."""
        low, high = self
        if units.display(self.unit) == units.display(unit):
            return low, high
        try:
            ends = [None if v is None else units.convert(v, self.unit, unit) for v in (low, high)]
        except units.UnitError as error:
            raise units.UnitError(
                f"{self.entry} is given in {self.unit!r}; the report uses {unit!r}, which is of another kind: {error}"
            ) from None
        return ends[0], ends[1]


@dataclass(frozen=True)
class Coefficient:
    """One estimated quantity, or one inseparable combination under the combination's name."""

    name: str  # "D_I"; a combination: "D_F + D_OO·X²"
    meaning: str
    unit: str  # "°/h/g"
    estimate: float
    u: float  # combined standard uncertainty
    k: float  # coverage factor of the 95 % interval
    interval: tuple[float, float]
    t: float | None = None  # estimate / u of type A
    p: float | None = None  # two-sided p of t
    u_a: float | None = None  # type A part of u
    dof: float | None = None
    closed: float | None = None  # the source's closed formula (corrected), same unit
    truth: float | None = None  # simulated runs only
    z: float | None = None  # (estimate - truth) / u
    limit: Limit | None = None
    verdict: str = NO_VERDICT  # pass | fail | inconclusive | void | no specification given
    no_value: str = ""  # why there is none: estimate and u are then NaN, and the interval where it has no bound
    combination: dict[str, float] = field(default_factory=dict)  # of model coefficients, printed units; {}: its name
    stands_for: str = ""  # the coefficient whose name a limit may have, too; "": no other name
    #: that of the linear models of a loop: with the communication step, without
    models: tuple[float, float] | None = None


@dataclass(frozen=True)
class Series:
    """A measured quantity against a position or a time, with its fit."""

    label: str  # "mount 1: output axis along the pole"
    x: list[float]
    x_name: str  # "table angle"
    x_unit: str  # "°"
    y: list[float]
    fit: list[float]
    residual: list[float]
    y_name: str  # "drift rate"
    y_unit: str  # "°/h"
    t: list[float] = field(default_factory=list)  # mid time of each window, s
    shown_fit_x: list[float] = field(default_factory=list)  # dense curve for the plot
    shown_fit_y: list[float] = field(default_factory=list)

    @classmethod
    def of(
        cls, label: str, x: Column, y: Column, fit: Iterable[float], residual: Iterable[float],
        t: Iterable[float] = (), curve: tuple[Iterable[float], Iterable[float]] = ((), ()),
    ) -> Series:  # fmt: skip
        """Return the series of columns as arrays; curve: x and y of the dense one."""
        at, measured, fitted, left, time, *dense = (list(map(float, c)) for c in (x[0], y[0], fit, residual, t, *curve))
        first = cls(label, at, x[1], x[2], measured, fitted, left, y[1], y[2])
        return replace(first, t=time, shown_fit_x=dense[0], shown_fit_y=dense[1])


@dataclass(frozen=True)
class Test:
    """A statistical test of the residuals or of repeatability."""

    __test__: ClassVar[bool] = False  # pytest: not a class of tests

    id: str  # "ljung_box.raw"
    name: str
    statistic: float
    p: float | None
    what: str  # what it looks for, in words
    finding: str  # what it says here, in words


@dataclass(frozen=True)
class Table:
    """A table of the method's own.  id: "budget.predicted"; several alike: with what each belongs to, after a colon."""

    id: str
    title: str
    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]

    @property
    def kind(self) -> str:
        """The id without what the table belongs to."""
        return self.id.partition(":")[0]


@dataclass(frozen=True)
class SetBy:
    """A quantity that sets the amplitude a of a source: it goes with a^power, within ``holds``."""

    name: str  # "platform.stiction"
    now: float
    unit: str  # printed
    power: float = 1.0
    holds: Limit = (None, None)


@dataclass(frozen=True)
class VarianceShare:
    """How a mean square, by rising powers of a factor on the amplitude of one source, goes with that; squared unit."""

    of: str  # the coefficient whose square it is
    source: str
    square: list[float]
    set_by: list[SetBy] = field(default_factory=list)


@dataclass(frozen=True)
class Reason:
    """A limit to a result: a sentence for the reader, and the verdicts that it takes away.

    blocks: these verdicts of the coefficients ``names`` (none named: all) become ``becomes``.  intervals: a verdict
    stands only where it holds for these too (name -> low, high, printed unit).  severity: "error" (not to be used as it
    is; said first), "doubt" (listed; said first where it takes a verdict away), "warning", "condition" (said only where
    it takes a verdict away).
    """

    id: str  # "type_b.unstated"
    text: str
    blocks: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    becomes: str = "inconclusive"
    severity: str = "warning"
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict, hash=False)


@dataclass(frozen=True)
class BudgetLine:
    """One line of the error budget; contribution = |sensitivity| * size, all as standard uncertainties.

    sensitivity: the change of the estimate for one unit by which the set-up is off, with its sign; a source of several
    independent errors has none.
    """

    id: str  # of its source, "torquer.scale_factor"
    source: str
    size: float
    size_unit: str
    sensitivity: float
    sensitivity_unit: str
    contribution: float
    unit: str
    coefficient: str  # which coefficient it touches
    note: str = ""


@dataclass(frozen=True)
class TypeB:
    """Effect of one standard uncertainty of a source on all estimates: a row for each of its independent parts."""

    id: str  # of the source
    source: str
    changes: list[list[float]]


@dataclass(frozen=True)
class Autocorrelation:
    """Autocorrelation of residuals or innovations at lags in windows, with the 95 % bound of white noise."""

    lag: list[float]
    rho: list[float]
    bound: list[float]


@dataclass(frozen=True)
class AllanSlope:
    """Slope of the Allan deviation on logarithmic axes between two averaging times, s."""

    begin: float = field(metadata={"key": "from"})
    to: float
    slope: float


@dataclass(frozen=True)
class AllanDeviation:
    """Allan deviation with its 95 % interval over averaging times in s."""

    tau: list[float]
    dev: list[float]
    lo: list[float]
    hi: list[float]
    slopes: list[AllanSlope] = field(default_factory=list)
    tau_unit: str = "s"
    unit: str = ""


@dataclass(frozen=True)
class PowerSpectrum:
    """One-sided power spectral density over frequencies in Hz."""

    f: list[float]
    S: list[float]
    f_unit: str = "Hz"
    unit: str = ""


@dataclass(frozen=True)
class Harmonic:
    """a cos(n θ) + b sin(n θ) of a series, both with u; b: None of n = 0."""

    series: str
    n: int
    a: float
    b: float | None
    u: float | None
    unit: str


@dataclass(frozen=True)
class StepChange:
    """Effect of the communication step on a measure; u: without it, ratio: of what of it is in u to that.

    taken: what of it is no longer in the estimate.
    """

    name: str
    unit: str
    change: float
    u: float | None = None
    ratio: float | None = None
    taken: float = 0.0


@dataclass(frozen=True)
class StepCheck:
    """Effect of the communication step, s, from quiet runs at it and at another one.

    seconds: of wall time.  worst: largest ratio.
    """

    step: float
    rows: list[StepChange]
    other: float | None = None
    seconds: float | None = None
    worst: float | None = None


@dataclass(frozen=True)
class Curve:
    """A line of a figure: of a linear model (phase in degrees), or of a quantity against time (without phase)."""

    label: str
    x: list[float]
    y: list[float]
    phase: list[float] = field(default_factory=list)


@dataclass(frozen=True)
class Response:
    """A measured response of a loop, with the curves of its linear models laid over it.

    kind: "loop" (open loop gain: Bode plot with margins), "ratio" (a gain against frequency), "step" (against time),
    "spectrum" (several quantities against frequency, both logarithmic: all of them in curves),
    "time" (several quantities against time: all of them in curves, y is the one that runs are compared by).
    x: Hz or s, rising.  y: gain (positive) or value.  phase: degrees, [] for a step.  u: standard uncertainty, relative
    of a gain (u rad of its phase too), in y_unit of a step; None: not known.  counts: false for a point too noisy to be
    used, []: all count.
    """

    name: str
    kind: str
    caption: str
    x: list[float]
    x_name: str
    x_unit: str
    y: list[float]
    y_name: str
    y_unit: str
    phase: list[float] = field(default_factory=list)
    u: list[float | None] = field(default_factory=list)
    coherence: list[float] = field(default_factory=list)
    counts: list[bool] = field(default_factory=list)
    curves: list[Curve] = field(default_factory=list)


# ------------------------------------------------------------------------------------------- of a drift record
@dataclass(frozen=True)
class RateBand:
    """Mean of a rate over time, s, between a lower and an upper line."""

    t: list[float]
    low: list[float]
    mean: list[float]
    high: list[float]


@dataclass(frozen=True)
class RateRecord(RateBand):
    """The rate by intervals: smallest, mean and largest value; smoothed: its drift with the 95 % band."""

    smoothed: RateBand | None = field(default=None, metadata=EMPTY)


@dataclass(frozen=True)
class DeviationCurve:
    """A deviation over averaging times with its 95 % interval; edf: equivalent degrees of freedom."""

    kind: str  # "Allan", "modified Allan", "Hadamard"
    tau: list[float]
    dev: list[float]
    low: list[float]
    high: list[float]
    edf: list[float]


@dataclass(frozen=True)
class NoiseModelCurves:
    """Allan deviation and one-sided density of the noise coefficients."""

    tau: list[float]
    dev: list[float]
    f: list[float]
    S: list[float]


@dataclass(frozen=True)
class SpectrumBand:
    """One-sided density over frequencies in Hz with its 95 % interval."""

    f: list[float]
    S: list[float]
    low: list[float]
    high: list[float]


@dataclass(frozen=True)
class SampleCorrelation:
    """Autocorrelation and partial autocorrelation of samples, with the 95 % bound of white noise."""

    lag: list[float]
    rho: list[float]
    partial: list[float]
    bound: float


@dataclass(frozen=True)
class DriftColumn:
    """One column of a drift record: what its report draws and tabulates, in printed units.

    tables, texts: section of the report -> tables, sentences.
    """

    name: str
    unit: str  # of deviations
    record: RateRecord
    deviations: list[DeviationCurve]
    model: NoiseModelCurves | None = field(default=None, metadata=EMPTY)
    spectrum: SpectrumBand | None = field(default=None, metadata=EMPTY)
    correlation: SampleCorrelation | None = field(default=None, metadata=EMPTY)
    tables: dict[str, list[Table]] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)
    quantity: str = "rate"
    level_unit: str = "°/h"  # of the record
