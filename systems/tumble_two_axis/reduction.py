"""Reduction of the two-axis tumble: nine drift coefficients of a floated gyro from currents averaged at rest.

    y = omega_IA - k i = D_F + D_I X + D_O Y + D_S Z + D_II X2 + D_SS Z2 + D_IO XY + D_OS YZ + D_IS XZ + noise

Least squares on X, Y, Z themselves, from the angles that were read: any positions will do that have rank 9.  The
harmonic route stands beside it where ratio and positions allow it.  The noise (white, Gauss-Markov or both) is
estimated from the same record.  [TEST-TUMBLE2-SDF, TUM2AX-LS; Hu 1981, eq. 3-47..3-53]

Not modelled: change of the drift with time, torquer nonlinearity (a line of the budget).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gyrobench import frames
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift import drift_terms
from gyrobench.reduction.drift.drift_terms import OneLoopSetup
from gyrobench.reduction.drift.rest_test import SMALL, RestTest
from gyrobench.reduction.setup import sources
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.reduction.toolkit import Account, Array, Effect, Findings, Group, RunDocument, plain
from gyrobench.result import Harmonic, Table
from gyrobench.units import DPH

from . import closed, geometry
from .geometry import ANGLES

COLUMNS = ("phase", "t_start", "t_end", *ANGLES, "mean")
AXES = ("outer", "inner")
STILL = 1e-4  # rad that a table may move while the current is averaged (20 arcsec: encoders jitter)
TURN = 2.0 * math.pi


@dataclass(frozen=True, kw_only=True)
class TwoAxisSetup(OneLoopSetup):
    """m, n: ratio of the angles.  harmonic: the harmonic route is insisted on.  path: the positions lie on the path of
    this ratio, and not anywhere.
    """

    m: int = 5
    n: int = 1
    harmonic: bool = False
    path: bool = True


class Reduction(RestTest[TwoAxisSetup]):
    """Nine drift coefficients from averages at rest: columns :data:`COLUMNS`; phase: number of the position."""

    handling = staticmethod(handling_candidates.two_axes)
    names = geometry.NAMES

    @classmethod
    def setup_of(cls, run: RunDocument) -> TwoAxisSetup:
        return TwoAxisSetup.of(
            run,
            m=int(run.options.get("m", 5)),
            n=int(run.options.get("n", 1)),
            harmonic=bool(run.options.get("harmonic", False)),
            path=not run.options.get("visits", ""),
        )

    def problems(self) -> list[str]:
        s = self.setup
        problems = frames.latitude_problems(s.latitude)
        if not problems and abs(math.degrees(s.latitude)) > 85.0:
            problems = geometry.refusals(s.latitude, 5, 1, 36)
        return problems + s.problems() + window_problems(self.windows, COLUMNS) or self._position_problems()

    def _position_problems(self) -> list[str]:
        """Return tables that move while sampling, too few positions."""
        w, found = self.windows, []
        for axis in AXES:
            moved = np.abs(np.asarray(w[f"{axis}_end"]) - np.asarray(w[f"{axis}_start"]))
            bad = np.flatnonzero(moved > STILL)
            if bad.size:
                found.append(
                    f"row {int(bad[0]) + 1}{f' and {bad.size - 1} more' if bad.size > 1 else ''}: the {axis} axis "
                    f"moves by {plain(math.degrees(moved[bad[0]]), 3)}° while the current is averaged; its rate enters "
                    "the reading: average at rest only"
                )
        pairs = zip(w["outer_start"], w["inner_start"], strict=True)
        places = {tuple(round(float(a) % TURN, 3) % round(TURN, 3) for a in pair) for pair in pairs}
        least = len(geometry.NAMES)
        if not found and len(places) < least:
            found.append(f"{len(places)} different positions for {least} coefficients: at least {least}")
        return found

    @cached_property
    def angles(self) -> tuple[Array, Array]:
        """Outer and inner angle, means over each window, rad."""
        w = {n: np.asarray(self.windows[n], dtype=float) for n in ANGLES}
        return (w["outer_start"] + w["outer_end"]) / 2.0, (w["inner_start"] + w["inner_end"]) / 2.0

    @property
    def attitudes(self) -> Array:
        return geometry.attitude(self.setup.latitude, *self.angles)

    @cached_property
    def theta(self) -> Array:
        """Place on the path, rad."""
        return np.asarray(self.angles[0] / self.setup.m)

    def group(self) -> Group:
        """Return drift against the path, or against the number of the visit where the positions lie on none."""
        s, phase = self.setup, np.asarray(self.windows["phase"], dtype=float)
        every = np.arange(phase.size)
        if not s.path:
            return Group("positions", every, phase, "number of the position", "")
        dense = np.radians(np.arange(0.0, 360.5, 0.5))
        curve = self.design(geometry.attitude(s.latitude, s.m * dense, s.n * dense))
        x = np.degrees(np.mod(self.theta + 1e-9, TURN))
        return Group(f"positions {s.m}:{s.n}", every, x, "θ", "°", (np.degrees(dense), curve))

    # ----------------------------------------------------------------------------------------- harmonic route
    def closed(self, y: Array) -> dict[str, float]:
        self.harmonics: list[Harmonic] = []
        self.checks: list[Table] = []
        book, self.no_closed = self._harmonic_route(y)
        if self.setup.harmonic and self.no_closed:
            raise ReductionError(self.no_closed)
        return book

    def _harmonic_route(self, y: Array) -> tuple[dict[str, float], list[str]]:
        """Return the coefficients by the formulas of Hu 1981, and why not; amplitudes and checks are kept."""
        s, theta, length, phase = self.setup, self.theta, self.read.length, np.asarray(self.windows["phase"])
        if not s.path:
            return {}, ["the positions do not lie on a path"]
        rows = [phase == p for p in np.unique(phase)]
        at = np.array([float(np.mean(theta[r])) for r in rows])
        mean = np.array([float(np.average(y[r], weights=length[r])) for r in rows])
        places = np.unique(np.round(np.mod(at + 1e-5, TURN), 4))
        why = geometry.harmonic_problems(s.latitude, s.m, s.n, places.size)
        off = float(np.max(np.abs(np.angle(np.exp(1j * (self.angles[1] - s.n * theta))))))
        if off > 1e-3:
            why.append(f"the inner angle is not {s.n}/{s.m} of the outer: off by up to {plain(math.degrees(off), 3)}°")
        gaps = np.diff(np.append(places, places[0] + TURN))
        each = [int(np.sum(np.abs(np.angle(np.exp(1j * (at - p + 1e-5)))) < 1e-3)) for p in places]
        if np.ptp(gaps) > 1e-3 or len(set(each)) > 1:
            why.append("the positions are not equally spaced over whole cycles")
        if why:
            return {}, why
        A, B = closed.amplitudes(at, mean, s.m, s.n)
        for j, f in enumerate([0, *geometry.frequencies(s.m, s.n)]):
            b = float(B[j]) / DPH if j else None
            self.harmonics.append(Harmonic(f"positions {s.m}:{s.n}", f, float(A[j]) / DPH, b, None, "°/h"))
        value = {"A": A / DPH, "B": B / DPH}
        checks = [[f"{a}{i} − ({'−' if sign < 0 else ''}{b}{j})", value[a][i], value[a][i] - sign * value[b][j]]
                  for a, i, sign, b, j in closed.TIES]  # fmt: skip
        checks += [[f"B{j}", value["B"][j], value["B"][j]] for j in (5, 9)]
        caption = "Differences that the model makes zero; compare them with the residual scatter"
        head = ["check", "amplitude / (°/h)", "difference / (°/h)"]
        self.checks.append(Table("harmonics.consistency", "Consistency of the harmonics", caption, head, checks))
        return closed.separate(A, B, s.latitude, s.gravity), []

    # ----------------------------------------------------------------------------------------- tests and budget
    def test(self, found: Findings) -> None:
        """Add F tests of what is periodic in theta and outside the nine terms, and of cycles against the first."""
        if not self.setup.path:
            return
        theta = self.theta
        places = np.unique(np.round(np.mod(theta + 1e-5, TURN), 4)).size
        top = min((places - 1) // 2, 12)
        block = np.concatenate([f(j * theta)[:, None] for j in range(1, top + 1) for f in (np.cos, np.sin)], axis=1)
        found.f_test(
            "positions.harmonics", "harmonics of the positions", block, "model errors periodic in the position",
            "something goes with the positions that the model does not hold", "no more than noise",
        )  # fmt: skip
        cycle = np.floor((theta - theta.min()) / TURN + 1e-5).astype(int)
        blocks = [np.where((cycle == k)[:, None], found.X, 0.0) for k in range(1, int(cycle.max()) + 1)]
        if blocks and np.linalg.matrix_rank(np.concatenate([found.X, *blocks], axis=1)) == 9 * (1 + len(blocks)):
            found.f_test(
                "cycles.agree", "cycle to cycle", np.concatenate(blocks, axis=1),
                "change of the drift between successive cycles", "the cycles differ by more than the noise",
                "the cycles agree within the noise",
            )  # fmt: skip

    def effects(self, found: Findings) -> list[Effect]:
        s, (outer, inner) = self.setup, self.angles

        def tilted(direction: Array) -> Array:
            return -self.believed(found, self.axes @ frames.rotation(direction, SMALL).T)

        def read(axis: int, n: int) -> Array:  # an encoder that reads too much by sin n q, and by cos n q
            both = []
            for wave in (np.sin, np.cos):
                error = SMALL * wave(n * (outer, inner)[axis])
                wrong = (outer + error, inner) if axis == 0 else (outer, inner + error)
                both.append(self.believed(found, geometry.attitude(s.latitude, *wrong)))
            return np.array(both)

        def wobbling(axis: int) -> Array:
            sizes = (SMALL * (axis == 0), SMALL * (axis == 1))
            turned = [geometry.attitude(s.latitude, outer, inner, 0.0, sizes, p) for p in (0.0, math.pi / 2.0)]
            return -np.array([self.believed(found, one) for one in turned])

        base = geometry.base(s.latitude)
        return [
            sources.OUTER_POLE_EAST.effect(s, tilted(base[2])),
            sources.OUTER_POLE_NORMAL.effect(s, tilted(-base[1])),
            sources.SQUARE.effect(s, -self.believed(found, geometry.attitude(s.latitude, outer, inner, SMALL))),
            *(
                sources.ANGLE_OF[often].of(axis=name).effect(s, read(k, n))
                for n, often in ((1, "once"), (2, "twice"))
                for k, name in enumerate(AXES)
            ),
            *(sources.WOBBLE_OF.of(axis=name).effect(s, wobbling(k)) for k, name in enumerate(AXES)),
            *super().effects(found),
        ]

    def account(self, found: Findings) -> Account:
        s = self.setup
        where = f"in the ratio {s.m}:{s.n}" if s.path else "in positions chosen one by one"
        return Account(
            method=f"Torque-rebalance tumble on two axes {where}, averaged at rest; least squares over "
            "all windows under an estimated noise model [TEST-TUMBLE2-SDF]",
            sources=[
                "TEST-TUMBLE2-SDF, TUM2AX-REDUCE, TUM2AX-LS; Hu 1981, eq. 3-47..3-53, corrected by E30-E34",
                "GYRO-STATIC-9; Hu 1981, eq. 2-36, 2-47",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation=self.equation,
            conventions=[
                *s.sign_conventions(s.k),
                "Gyro axes I, O, S right-handed; local frame east, north, up; table angles right-handed, outer axis "
                f"along the pole{f': outer angle {s.m} θ, inner angle {s.n} θ' if s.path else ''}.",
                *([] if s.fold else [drift_terms.NO_OO]),
            ],
            no_closed="; ".join(self.no_closed),
            closed_caption="From the means of the positions; the harmonic route fits 25 amplitudes where nine would do",
            tables=self.checks,
            harmonics=self.harmonics,
            reasons=drift_terms.folded(s),
        )
