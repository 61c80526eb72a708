"""Plans that are run to be designed by: the run, the predictions of its fits, the count of a plan."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.bench import UsageError, suggest_names
from gyrobench.design.designed_test import DesignedValue
from gyrobench.design.predicted_uncertainty import predict
from gyrobench.engine.session import Session
from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis import unshown
from gyrobench.reduction.estimation.drift_test import DriftReduction
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.fit_result import observed_fits
from gyrobench.system.system import System


class DesignError(GyrobenchError):
    """A wanted uncertainty that no plan of the test reaches, or a test that offers no plans."""

    exit_code = 2


@dataclass(frozen=True)
class Stated:
    """Predicted u, error and least of a value, u of type B, in ``unit``, which is ``scale`` in SI."""

    u: float
    error: float
    least: float
    type_b: float
    unit: str
    scale: float

    @property
    def size(self) -> float:
        """Return what a wanted uncertainty is compared with: u or, where the reduction understates it, the error."""
        return max(self.u, math.hypot(self.error, self.type_b))


@dataclass(frozen=True)
class Trial:
    """A plan that was run: what is predicted of its values, its time (s), effects that it does not show."""

    values: Mapping[str, Stated]
    time: float
    hidden: tuple[str, ...]


Covariances = Callable[[Sequence[Findings], Record], Sequence[Array]]  # of the data of each fit of a run


class Workbench:
    """The system that is designed for, loaded once for each set of parts; runs plans of it.  A context manager."""

    def __init__(
        self, system: System, parts: Mapping[str, str], maps: Mapping[str, Path], engine: str | None, seed: int,
        given: Mapping[str, str],
    ) -> None:  # fmt: skip
        self.system, self.seed, self.given = system, seed, given
        self._open = functools.partial(Session, parts=parts, maps=maps, engine=engine)
        self._sessions: dict[tuple[str, ...], Session] = {}

    def __enter__(self) -> Workbench:
        return self

    def __exit__(self, *_: object) -> None:
        for session in self._sessions.values():
            session.close()

    def run(self, values: Mapping[str, Any], seed: int | None = None) -> tuple[Record, list[tuple[Findings, Array]]]:
        """Return the record of a plan and the fits of its reduction."""
        system = self.system.with_values(values)
        key = tuple(slot.part for slot in system.slots.values())
        if key not in self._sessions:
            self._sessions[key] = self._open(system)
        record = self._sessions[key].run(values, self.seed if seed is None else seed)
        with observed_fits() as fits:
            system.reduce(record)
        return record, fits

    def trial(self, values: Mapping[str, Any], covariances: Covariances, draws: int) -> Trial:
        """Run a plan and predict its values."""
        return trial_of(*self.run(values), covariances, draws)

    def unseen(self, known: Sequence[str], values: Mapping[str, Any]) -> tuple[str, ...]:
        """Return what a plan does not determine or show: known, and mistakes in taking it (diagnosis.unshown)."""
        return tuple(dict.fromkeys([*known, *mistakes_unshown(self.system.with_values(values), self.run(values)[0])]))

    def count(self, values: Mapping[str, Any], names: Sequence[str], count: int) -> dict[str, tuple[float, float, int]]:
        """Return mean u and standard deviation of the estimates over ``count`` runs of a plan, and their number."""
        u: dict[str, list[float]] = {n: [] for n in names}
        error: dict[str, list[float]] = {n: [] for n in names}
        for k in range(count):
            for fit, type_b in self.run(values, 1000 + k)[1]:
                b = np.sqrt(np.sum(type_b**2, axis=0)) if len(type_b) else np.zeros(fit.value.size)
                for j, q in enumerate(fit.quantities):
                    if q.name in u:
                        u[q.name].append(math.hypot(float(fit.u[j]), float(b[j])) / q.scale)
                        error[q.name].append(float(fit.value[j]) / q.scale)
        return {n: (float(np.mean(u[n])), float(np.std(error[n], ddof=1)), len(u[n])) for n in names if len(u[n]) > 1}


def trial_of(record: Record, fits: Sequence[tuple[Findings, Array]], covariances: Covariances, draws: int) -> Trial:
    """Return what is predicted from the fits of a run."""
    each = covariances([f for f, _ in fits], record)
    found = [predict(fit, type_b, V, draws) for (fit, type_b), V in zip(fits, each, strict=True)]
    values = {
        n: Stated(
            float(p.u[k]), float(p.error[k]), float(p.least[k]), float(p.type_b[k]), p.units[k], float(p.scale[k])
        )
        for p in found
        for k, n in enumerate(p.names)
    }
    return Trial(values, last_time(record), tuple(dict.fromkeys(h for p in found for h in p.hidden)))


def last_time(record: Record) -> float:
    """Return the end of the last window, s."""
    return float(np.asarray(record.windows["t_end"])[-1])


def wanted_sizes(wants: Mapping[str, str | float], own: Trial, known: Sequence[str]) -> dict[str, float]:
    """Return what is wanted, SI; without wants the u of the system's own plan.  Raises UsageError."""
    given: Mapping[str, str | float] = wants or {n: own.values[n].size for n in known}
    out = {}
    for name, size in given.items():
        if name not in known:
            raise UsageError(f"--want {name}: no such value of this test; {suggest_names(name, list(known))}")
        value = own.values[name]
        try:
            number = float(size) if not isinstance(size, str) else units.parse_quantity(size, value.unit, per_g0=True)
        except units.UnitError as error:
            raise UsageError(f"--want {name}={size}: {error}") from None
        if not number > 0.0:
            raise UsageError(f"--want {name}={size}: a standard uncertainty above 0 is expected")
        out[name] = number * value.scale
    return out


def refuse_type_b(wanted: Mapping[str, float], trial: Trial) -> None:
    """Raise DesignError for a wanted uncertainty that the sources of type B alone exceed."""
    for name, size in wanted.items():
        ratio = trial.values[name].type_b * trial.values[name].scale / size
        if ratio >= 1.0:
            raise DesignError(
                f"{name}: the sources of type B alone make u = {ratio:.3g} times the wanted one; no plan is long "
                "enough, only a better set-up helps (the budget of a report lists its sources)"
            )


def designed_values(
    trial: Trial, own: Trial, wanted: Mapping[str, float], asked: Collection[str]
) -> dict[str, DesignedValue]:
    """Return the values of a plan beside those of the system's own; wanted: SI."""
    return {
        n: DesignedValue(
            n, v.unit, wanted[n] / v.scale if n in asked else None, v.u, v.error,
            own.values[n].u if n in own.values else math.nan,
        )
        for n, v in trial.values.items()
    }  # fmt: skip


def mistakes_unshown(system: System, record: Record) -> list[str]:
    """Return mistakes that no residual of a plan would show, of tests whose record is one fit."""
    reduction = system.reduction_object()
    if not (isinstance(reduction, type) and issubclass(reduction, DriftReduction)) or reduction.handling is None:
        return []
    regression_of = reduction.regression_of()
    if regression_of is None:
        return []  # each mistake would be a reduction of its own
    return unshown.sentences(record, reduction.of_record(record), reduction.of_record, regression_of)
