"""What errors of the set-up do to rate and specific force in the positions, each by moving the model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Self

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.setup import sources
from gyrobench.reduction.setup.setups import SiteSetup
from gyrobench.reduction.setup.sources import Source

from .geometry import AXES, EXACT, Motion, SetUp
from .sources import AXIS_AZIMUTH, AXIS_LEVEL, HYSTERESIS, MOUNT, ZERO

SMALL = 1e-5  # rad, step of the perturbations (they are linear to 1e-10)


@dataclass(frozen=True, kw_only=True)
class ImuSetup(SiteSetup):
    """A table with two axes at a site; see gyrobench.reduction.setup.setups."""

    #: orders of bias and scale factor over the temperature, K of its hysteresis, temperature of the coefficients; none:
    #: nothing follows the temperature but by the nuisance model
    thermal: tuple[int, int, float, float] | None = None

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        o = run.options
        if o.get("thermal"):
            given = (int(o["bias_order"]), int(o["scale_order"]), float(o["hysteresis_width"]), float(o["reference"]))
            own = {"thermal": given, **own}
        return super().of(run, **own)


Change = tuple[Array, Array]  # of rate and specific force, (n, 3) or (parts, n, 3), for one unit


class Kinematics:
    """Rate and specific force in the windows of a record, and what each source changes them by."""

    def __init__(self, windows: Mapping[str, Array], setup: ImuSetup) -> None:
        self.motion, self.setup = Motion.of(windows), setup

    def _felt(self, motion: Motion, error: SetUp = EXACT, **site: float) -> Change:
        s = self.setup
        place = {"latitude": s.latitude, "gravity": s.gravity, "earth_rate": s.earth_rate, **site}
        return motion.felt(place["latitude"], place["gravity"], place["earth_rate"], error)

    @cached_property
    def felt(self) -> Change:
        """Rate and specific force (n, 3) of a set-up without errors."""
        return self._felt(self.motion)

    def _change(self, motion: Motion, error: SetUp = EXACT, step: float = SMALL, **site: float) -> Change:
        now = self._felt(motion, error, **site)
        return (now[0] - self.felt[0]) / step, (now[1] - self.felt[1]) / step

    @cached_property
    def changes(self) -> list[tuple[Source, Change]]:
        """Each source with the change of rate and specific force for one unit of it, SI; of a time or a site that is
        stated too large by one unit, for that.
        """
        m = self.motion
        unit = SMALL * np.eye(3)
        turned = [self._change(m, SetUp(turned=tuple(v))) for v in unit]
        mount = [self._change(m, SetUp(mount=tuple(v))) for v in unit]
        wobbles = [
            _parts([self._change(m, SetUp(wobble=(SMALL * (k == 0), SMALL * (k == 1)), phase=p))
                    for p in (0.0, math.pi / 2.0)]) for k in range(2)
        ]  # fmt: skip
        return [
            (AXIS_LEVEL, turned[1]),
            (AXIS_AZIMUTH, turned[2]),
            *((ZERO.of(axis=n), self._change(m.off(k, SMALL))) for k, n in enumerate(AXES)),
            *((HYSTERESIS.of(axis=n), self._change(m.off(k, SMALL * m.way(k)))) for k, n in enumerate(AXES)),
            (sources.SQUARE, self._change(m, SetUp(squareness=SMALL))),
            *(
                (sources.ANGLE_OF[often].of(axis=n), _parts([
                    self._change(m.read(k, order, *amplitude)) for amplitude in ((SMALL, 0.0), (0.0, SMALL))
                ]))
                for order, often in ((1, "once"), (2, "twice"))
                for k, n in enumerate(AXES)
            ),
            *((sources.WOBBLE_OF.of(axis=n), w) for n, w in zip(AXES, wobbles, strict=True)),
            *((MOUNT.of(axis=n, k=str(k)), w) for k, (n, w) in enumerate(zip("xyz", mount, strict=True), 1)),
            (sources.LATITUDE, self._change(m, step=-SMALL, latitude=self.setup.latitude + SMALL)),
            (sources.GRAVITY, (np.zeros_like(self.felt[1]), -self.felt[1] / self.setup.gravity)),
            (sources.TIME_BASE, (self._table_rate(), np.zeros_like(self.felt[1]))),
        ]  # fmt: skip

    def _table_rate(self) -> Array:
        """Return the rate of the table alone, rad/s: what a time that is read too long makes too small."""
        still = self._felt(self.motion, earth_rate=0.0)[0]
        return np.where(self.motion.at_rest[:, None], 0.0, still)


def _parts(changes: list[Change]) -> Change:
    return np.array([c[0] for c in changes]), np.array([c[1] for c in changes])
