"""Protocol of a test whose plan is a choice of options: methods, rates, numbers of positions, each with one length."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gyrobench.arrays import Array
from gyrobench.design.visit_protocol import DataNoise
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.findings import Findings


@dataclass(frozen=True)
class Choice:
    """options: values of the system for a length (s), from ``least`` on.  windows: design matrix and times of the
    windows (X, t_start, t_end) of a length without a run; None where a run is as quick.
    """

    label: str
    options: Callable[[float], Mapping[str, Any]]
    start: float  # length of the first run, s
    least: float = 1.0
    windows: Callable[[float], tuple[Array, Array, Array]] | None = None


@dataclass(frozen=True)
class OptionProtocol:
    """choices: the system's own plan first.  covariances: of the data of each fit of a run of any of them, from the
    noise of the parts.  names: of the values of which something may be wanted.  unseen: as of VisitProtocol.
    propose: further choices that are worth a run, of wanted uncertainties (name -> SI), a given time (s) or None, and a
    criterion; for a test that has too many to list.
    """

    choices: tuple[Choice, ...]
    covariances: Callable[[Sequence[Findings], Record], Sequence[Array]]
    names: tuple[str, ...]
    unseen: tuple[str, ...] = ()
    noise: DataNoise | None = None  # of choices with known windows
    propose: Callable[[Mapping[str, float], float | None, str], Sequence[Choice]] | None = None
