"""What tumbles about the pole share: one gyro axis in torque rebalance on a table that turns, and stands in dwells.

    class Reduction(TurningTest[MySetup]):
        terms, k = ..., ...                    # of the drift model; torquer scale factor, rad/s/A
        def closed(self, y): ...               # formulas of the source

Every window is a row; regressors and rates are averaged over it as the current is (window_regressors).  Type B: each
source's effect on the data by exact perturbation of what the reduction believes (geometry) or reads (current).  For
the ideal geometry of a single-degree-of-freedom gyro this gives the known sensitivities: input axis tilted towards
the output axis by eps: eps W sin(phi)/gamma in D_O and nothing else [TUM1-SENS-IA]; table axis off the pole by delta:
W delta/(gamma cos phi) in D_I or 2 W delta/(gamma^2 sin 2 phi) in D_OS [TUM1-SENS-AXIS].

Not modelled: an independent tilt of each mount, wobble and encoder errors of other orders.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.drift import drift_terms, harmonic, window_regressors
from gyrobench.reduction.drift.pulses import CurrentWindows, Pulses
from gyrobench.reduction.drift.turns import Turns
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.drift_test import DriftReduction
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.nuisances import Candidate
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.regression import Fit
from gyrobench.reduction.estimation.reported import Group
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup import setups, sources
from gyrobench.reduction.setup.sources import Effect, Source
from gyrobench.reduction.setup.stops import whole_stops

T = TypeVar("T", bound=setups.TurningSetup)
Formulas = tuple[dict[str, float], dict[str, Fit], str]


class TurningTest(DriftReduction[T]):
    """A tumble about the pole, of one measuring axis; see the module.

    axis: of the gyro, that is measured.  across: towards which it may lean, by an angle called ``tilt``.  held: highest
    harmonic of the model.  mounting: sources of the mount, with the axis (and its sense) that the gyro is turned about.
    channel, torquer: of a gyro with two channels, which one, and the axis of the torquer that measures it.  rotates,
    upright: name of the gyro axis along that of the turning table, and of the one that is vertical in dwells; mixed,
    lost: what one mount mixes, and what dwells of one sense leave together.
    """

    axis: int = 0
    across: int = 1
    tilt: str = "ε_IO"
    tilt_meaning: str = "misalignment of the input axis towards the output axis"
    held: int = 2
    rotates = upright = "output axis"
    mixed = "D_I, D_IO and D_S, D_OS mix"
    lost = "D_F cannot be told from D_II + D_SS"
    channel: str = ""
    torquer: str = ""
    mounting: ClassVar[Sequence[tuple[Source, int, float]]] = ()
    terms: tuple[str, ...]
    k: float
    quantum: float
    pulses: Pulses | None

    def closed(self, y: Array) -> Formulas:
        """Return coefficients by the formulas of the source from drift rates (n,), the harmonics of each mount, and why
        not ("" when all is well).
        """
        raise NotImplementedError

    def quantity(self, name: str) -> Quantity:
        """Return a coefficient of ``terms`` with its truth and its value ``self.book`` by the formulas."""
        raise NotImplementedError

    # ------------------------------------------------------------------------------ windows
    @cached_property
    def phase(self) -> NDArray[np.int_]:
        return np.asarray(self.windows["phase"]).astype(int)

    @cached_property
    def turning(self) -> window_regressors.Turning:
        face = np.array([np.asarray(self.setup.faces[p], dtype=float) for p in self.phase.tolist()])
        columns = ("angle_start", "angle_end", "t_start", "t_end")
        a0, a1, t0, t1 = (np.asarray(self.windows[c], dtype=float) for c in columns)
        return window_regressors.Turning(a0, a1, t0, t1, face)

    @cached_property
    def read(self) -> CurrentWindows:
        """Torquer currents, A, with the sign of the precession convention."""
        end, t = f"_{self.torquer}" if self.torquer else "", self.turning
        mean = np.asarray(self.windows[f"mean{end}"], dtype=float)
        mean = mean if self.setup.polarity == "project" else -mean
        spread = np.asarray(self.windows.get(f"std{end}", np.zeros_like(mean)), dtype=float)
        return CurrentWindows(mean, spread, t.t_end - t.t_start)

    @property
    def names(self) -> tuple[str, ...]:
        """The unknowns: with the tilt where it is estimated whatever the data say of it."""
        return (*self.terms, self.tilt) if self.setup.tilt else self.terms

    def rate(self, turning: window_regressors.Turning, base: Array | None = None, axis: int | None = None) -> Array:
        """Return the mean inertial rate (n,) along a gyro axis, rad/s."""
        s = self.setup
        base, axis = s.base if base is None else base, self.axis if axis is None else axis
        return window_regressors.axis_rate(turning, base, s.latitude, s.earth_rate, axis)

    def design(self, turning: window_regressors.Turning, base: Array | None = None) -> Array:
        """Return the window means (n, p) of the regressors; the column of the tilt is minus the rate across, rad/s."""
        base = self.setup.base if base is None else base
        X = window_regressors.regressors(turning, base, self.setup.gravity, self.terms)
        return np.column_stack([X, -self.rate(turning, base, self.across)]) if self.setup.tilt else X

    def plan_problems(self, dwells: bool = True) -> list[str]:
        """Return missing phases and mounts, tables that stand still, windows too wide; with ``dwells`` missing ones."""
        s, problems = self.setup, self.setup.table_problems(self.windows)
        if len(s.sides(self.across)) < 2:
            problems.append(f"only one mount: two are needed, {self.rotates} along +pole and −pole ({self.mixed})")
        found = s.dwells()
        if dwells and len(set(found.values())) < 2:
            few = "only one dwell" if found else "no dwells"
            problems.append(f"{few} with the {self.upright} vertical, up and down are needed: {self.lost}")
        return problems

    # ------------------------------------------------------------------------------ fit
    def regression(self) -> Regression:
        t, s = self.turning, self.setup
        rate, X = self.rate(t), self.design(t)
        y = rate - self.k * self.read.mean
        self.book, self.fits, self.no_closed = self.closed(y)
        tilt = Quantity.of(self.tilt, self.tilt_meaning, "arcsec")
        quantities = [tilt if n == self.tilt else self.quantity(n) for n in self.names]
        groups = [self._group(X, p) for p in s.faces]
        candidates = self._candidates(nuisances.fitted(rate, X, y)) if s.nuisances else []
        return Regression(quantities, X, y, t.t_start, t.t_end, groups, candidates=candidates)

    def _candidates(self, torque: Array) -> list[Candidate]:
        """Return set-up effects that a tumble may have: tilt of the measuring axis, trend, temperature, torquer (its
        rate ``torque``, rad/s), constants from mount to mount and from turn-on to turn-on.
        """
        s, end = self.setup, f",{self.channel}" if self.channel else ""
        tilt = Candidate.of(self.tilt, self.tilt_meaning, "arcsec", -self.rate(self.turning, axis=self.across))
        return [
            *([tilt] if s.tilt is None else []),
            *nuisances.common(self.windows, end),
            *nuisances.torquer(torque, self.torquer),
            nuisances.scatter("mount", nuisances.mounts(self.phase, s.faces), end),
        ]

    def _group(self, X: Array, p: int) -> Group:
        """Return drift against table angle where the table turns, against time in a dwell."""
        s, t, mine = self.setup, self.turning, self.phase == p
        if not s.turns(p):
            middle = (t.t_start + t.t_end) / 2.0
            return Group(s.label(p), mine, middle[mine] - t.t_start[mine][0], "time in the dwell", "s")
        angle = np.degrees(np.mod(((t.angle_start + t.angle_end) / 2.0)[mine], 2.0 * math.pi))
        dense = np.radians(np.arange(0.0, 361.0, 3.0))
        face = np.broadcast_to(np.asarray(s.faces[p], dtype=float), (dense.size, 3, 3))
        curve = self.design(window_regressors.Turning(dense, dense, 0.0 * dense, np.ones_like(dense), face))
        if s.tilt:
            curve[:, -1] = float(np.mean(X[mine, -1]))  # the table turns, the plotted one does not
        return Group(s.label(p), mine, angle, "table angle", "°", (np.degrees(dense), curve))

    def test(self, found: Findings) -> None:
        """Add F tests of the harmonics that the model does not hold and of turn against turn, over theta = -angle."""
        s, t = self.setup, self.turning
        phases = [(s.label(p), self.phase == p) for p in s.faces if s.turns(p)]
        self.turns = Turns(found, phases, -t.angle_start, -t.angle_end, self.held)
        self.turns.test()

    def harmonics_of(self, y: Array, attitudes: Mapping[str, Array]) -> tuple[dict[str, Fit], dict[str, float], str]:
        """Return the harmonics of drift rates (n,) over theta = -angle in each mount, the mean of each dwell, and why
        not ("" when all is well); attitudes: the ideal ones by name, those called "static ..." dwells.
        """
        t, fits, means = self.turning, {}, {}
        roles = {
            p: next((n for n, ideal in attitudes.items() if np.allclose(face, ideal, atol=1e-6)), "")
            for p, face in self.setup.faces.items()
        }
        if odd := [str(p) for p, role in roles.items() if not role]:
            return {}, {}, f"phase {', '.join(odd)} is not one of the attitudes of Hu 1981; least squares only"
        for name in attitudes:
            mine = [p for p, role in roles.items() if role == name]
            rows = np.isin(self.phase, mine)
            if name.startswith("static"):
                means[name] = float(np.average(y[rows], weights=self.read.length[rows]))
                continue
            for p in mine:
                start, end = t.angle_start[self.phase == p], t.angle_end[self.phase == p]
                if self.setup.stops(p):
                    if not whole_stops(start, end):
                        return {}, {}, f"phase {p}: its stops are not equally spaced; least squares only"
                    continue
                if harmonic.whole_turns(start, end) is None:
                    turned = math.degrees(float(np.sum(np.abs(end - start))))
                    covers = f"phase {p} covers {plain(turned, 4)}°"
                    return {}, {}, f"{covers}, no whole turns without gap; least squares only"
            fits[name] = harmonic.fit(-t.angle_start[rows], -t.angle_end[rows], y[rows])
        return fits, means, ""

    # ------------------------------------------------------------------------------ budget
    def effects(self, found: Findings) -> list[Effect]:
        """Return all sources with their sensitivities; sizes come from the setup and may be 0."""
        s, t, X, rate = self.setup, self.turning, found.X, self.rate(self.turning)

        def error(turned: window_regressors.Turning, base: Array) -> Array:
            return found.error(self.rate(turned, base) - rate, self.design(turned, base) - X)

        believed = window_regressors.BelievedGeometry(t, s.base, error)

        def wobble() -> Array:  # at the phases 0 and 90 degrees
            errors = []
            for rates, dX in window_regressors.wobbles(t, s.base, s.place, self.terms):
                wrong = np.column_stack([dX, rates[:, self.across]]) if s.tilt else dX
                errors.append(found.error(-rates[:, self.axis], wrong))
            return np.array(errors)

        return [
            sources.AXIS_POLE_EAST.effect(s, believed.axis(0)),
            sources.AXIS_POLE_NORMAL.effect(s, believed.axis(1)),
            *(source.effect(s, believed.mount(k, sense)) for source, k, sense in self.mounting),
            sources.WOBBLE.effect(s, wobble()),
            sources.ANGLE_ONCE.effect(s, believed.angles(1)),
            sources.ANGLE_TWICE.effect(s, believed.angles(2)),
            *drift_terms.torquer_effects(s, found, self.k, self.read, self.quantum, self.pulses, self.torquer),
        ]
