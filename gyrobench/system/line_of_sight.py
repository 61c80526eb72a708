"""Sources of the jitter of a line of sight, as a system states them for a jitter that is wanted of a loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from gyrobench.arrays import Array
from gyrobench.result import SetBy

#: one-sided power spectral density over frequencies in Hz
Density = Callable[[Array], Array]


@dataclass(frozen=True)
class SightSource:
    """A random signal that moves a line of sight, at an input of the linear model and independent of all others.

    name: in words; the squares of those with one name are added.  kind, axis: excitation "motion" (angle of the base,
    rad), "test" or "command" (signal of a loop, V), or an output of a part of ``LineOfSight.moved_by`` with its
    element.  density: of it, its unit squared per Hz.  loop: the loop whose sensor makes it, at its summing point; "".
    """

    name: str
    kind: str
    axis: int
    density: Density
    loop: str = ""


@dataclass(frozen=True)
class LineOfSight:
    """Sources of the jitter of a line of sight, from ``lowest`` Hz on.  f: Hz, with which the densities are followed.
    set_by: source and parameters of the parts -> quantities that set it.

    ride: label of the phase of the plan in which base and target move.  angles: loop -> channel of the angle whose
    jitter it is; {}: that which a load turns.  moved_by: slots of parts whose outputs are inputs of the linear model.
    riding: parameters of parts about which they move in the ride.  lost: channel that is 1 while a tracker sees no
    target; "".  free: parameters of parts without the dry friction that slips in the ride, for margins; slipping: with
    the viscous friction that makes torques as large, for the jitter.  {}: as they are.
    """

    lowest: float
    sources: Sequence[SightSource]
    f: Array
    set_by: Callable[[str, Mapping[str, Any]], list[SetBy]]
    ride: str = "ride"
    angles: Mapping[str, str] = field(default_factory=dict)
    moved_by: Sequence[str] = ()
    riding: Mapping[str, Any] = field(default_factory=dict)
    lost: str = ""
    free: Mapping[str, Any] = field(default_factory=dict)
    slipping: Mapping[str, Any] = field(default_factory=dict)
