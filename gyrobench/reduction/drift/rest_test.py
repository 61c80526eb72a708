"""What tests share that average the current of one rebalance loop at rest, in attitudes that tell coefficients apart.

    class Reduction(RestTest[RestSetup]):
        names = ("D_F", "D_I", ...)
        method = "Least squares over six positions"

    y = omega_IA - k i = sum of the terms ``names`` in (X, Y, Z) = -f/g0 + noise    [GYRO-STATIC-9; Hu 1981, eq. 2-36]

From the attitudes follow data, design matrix, set-up effects that may be in the data and are weighed (misalignment,
trend, temperature, torquer), and the sources of the budget (mount of the gyro, torquer, current reading).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self, TypeVar

import numpy as np

from gyrobench import drift, frames
from gyrobench.arrays import Array
from gyrobench.attitudes import parse
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift import drift_terms, supplies
from gyrobench.reduction.drift.drift_terms import OneLoopSetup
from gyrobench.reduction.drift.pulses import CurrentWindows
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.drift_test import DriftReduction
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.fit_result import Account
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.reported import Group
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.reduction.setup.sources import TURNED, Effect
from gyrobench.reduction.setup.window_checks import window_problems

SMALL = 1e-5  # rad, step of the geometric perturbations (they are linear to 1e-10)


@dataclass(frozen=True, kw_only=True)
class RestSetup(OneLoopSetup):
    """faces: phase -> gyro axes I, O, S (rows) in east, north, up."""

    faces: Mapping[int, Array] = field(default_factory=dict)

    @classmethod
    def of_plan(cls, run: RunDocument, **own: Any) -> Self:
        """Return the setup of a plan whose faces name the attitudes, as gyrobench.attitudes.parse reads them."""
        latitude = Location.of(run).latitude
        return cls.of(run, faces={row.phase: parse(row.face, latitude) for row in run.plan}, **own)


S = TypeVar("S", bound=OneLoopSetup)


class RestTest(DriftReduction[S]):
    """Coefficients ``names`` from averages at rest; see the module."""

    handling = staticmethod(handling_candidates.positions)
    names: Sequence[str] = drift.terms(9)
    method: str = "Currents at rest, by least squares under an estimated noise model"

    @classmethod
    def setup_of(cls, run: RunDocument) -> S:
        """Return the setup of a plan whose faces name the attitudes, of a test that has no setup of its own."""
        setup: Any = RestSetup.of_plan(run)
        return setup  # type: ignore[no-any-return]

    @property
    def attitudes(self) -> Array:
        """Gyro axes I, O, S in east, north, up of each row: (n, 3, 3)."""
        faces: Any = getattr(self.setup, "faces", {})
        return np.array([faces[p] for p in np.asarray(self.windows["phase"]).astype(int).tolist()])

    @cached_property
    def axes(self) -> Array:
        return self.attitudes

    @cached_property
    def read(self) -> CurrentWindows:
        """Torquer currents, A, with the sign of the precession convention."""
        mean, t0, t1 = (np.asarray(self.windows[n], dtype=float) for n in ("mean", "t_start", "t_end"))
        spread = np.asarray(self.windows.get("std", np.zeros_like(mean)), dtype=float)
        return CurrentWindows(mean if self.setup.polarity == "project" else -mean, spread, t1 - t0)

    def problems(self) -> list[str]:
        return frames.latitude_problems(self.setup.latitude) + self.setup.problems() + window_problems(self.windows)

    def rate(self, axes: Array) -> Array:
        """Return the Earth rate (n,) along the input axes, rad/s."""
        return np.asarray(axes[:, 0] @ frames.earth_rate_local(self.setup.latitude, self.setup.earth_rate))

    def design(self, axes: Array) -> Array:
        """Return the regressors (n, p) in attitudes (n, 3, 3)."""
        return drift.regressors(-axes @ frames.U * self.setup.gamma, tuple(self.names))

    def closed(self, y: Array) -> Mapping[str, float]:
        """Return coefficients by formulas of the source from drift rates (n,)."""
        return {}

    def group(self) -> Group:
        """Return what the data are drawn against: time."""
        t = np.asarray(self.windows["t_start"], dtype=float)
        return Group("attitudes", np.arange(t.size), (t - t[0]) / 60.0, "time", "min")

    def regression(self) -> Regression:
        s, rate, X = self.setup, self.rate(self.axes), self.design(self.axes)
        y = rate - s.k * self.read.mean
        book = self.closed(y)
        quantities = [drift_terms.quantity(s, n, book) for n in self.names]
        t0, t1 = (np.asarray(self.windows[n], dtype=float) for n in ("t_start", "t_end"))
        weighed = self.candidates(rate, X, y) if s.nuisances else []
        return Regression(quantities, X, y, t0, t1, [self.group()], candidates=weighed)

    def candidates(self, rate: Array, X: Array, y: Array) -> list[Candidate]:
        """Return set-up effects: misalignments of the input axis, trend, temperature, torquer.

        Turned about the input axis, output and spin axis see the Earth rate by the cosine and the sine of its angle;
        the drift that the axis sees with them is that of least squares.
        """
        start = np.linalg.lstsq(X, y, rcond=None)[0]

        def misalignment(k: int) -> Array:
            other = frames.rotation(np.eye(3)[k], SMALL) @ self.axes
            return np.asarray((self.rate(other) - rate - (self.design(other) - X) @ start) / SMALL)

        return [
            *nuisances.misalignments(misalignment),
            *nuisances.common(self.windows),
            *nuisances.torquer(nuisances.fitted(rate, X, y)),
        ]

    def believed(self, found: Findings, other: Array) -> Array:
        """Return the error (n,) of the data per rad where the axes are taken for ``other`` ones, :data:`SMALL` away."""
        rate = (other - self.axes)[:, 0] @ frames.earth_rate_local(self.setup.latitude, self.setup.earth_rate)
        return found.error(rate, self.design(other) - found.X) / SMALL

    def effects(self, found: Findings) -> list[Effect]:
        """Return the sources that such a test has: mount of the gyro, torquer, current reading, supplies."""
        s, axes = self.setup, self.axes
        t0, t1 = (np.asarray(self.windows[n], dtype=float) for n in ("t_start", "t_end"))
        readings = supplies.rebalanced(self.rate(axes), s.k * self.read.mean)
        turned = (self.believed(found, frames.rotation(d, SMALL) @ self.axes) for d in np.eye(3))
        return [
            *(TURNED[n].effect(s, e) for n, e in zip(("input", "output", "spin"), turned, strict=True)),
            *drift_terms.torquer_effects(s, found, s.k, self.read, s.quantum, s.pulses),
            *s.supplies.effects(found, readings, -axes @ frames.U * s.gamma, (t0 + t1) / 2.0),
        ]

    def account(self, found: Findings) -> Account:
        """Return what a test says of itself that says no more than its method."""
        conventions = self.setup.sign_conventions(self.setup.k)
        return Account(method=self.method, sources=[], equation=self.equation, conventions=conventions)

    @property
    def equation(self) -> str:
        """The measurement equation, Typst math."""
        return drift_terms.equation('omega_"IA" - k i = omega_d = ', self.names)
