"""Reduction of four accelerometers on one head: one least squares for the sensors and the angle errors of the head.

    U_i = K_F + K_I a_I + K_O a_O + K_IO a_I a_O + K_II a_I2 + K_I a_O D(alpha)          i = 1 ... 4

Unknowns: five coefficients of each sensor and D at the harmonics 2 ... n/2 (41 with 24 positions and 96 readings).
The first harmonic of D, which no reading tells from K_F, K_IO and K_II, is taken from an autocollimator; its constant
and the misalignments of the sensors stay in K_O.  The columns of D hold K_I: the fit is made again with the new one.
[TEST-ACCEL4; Dong 2014, eq. 14-31, corrected by EA1 to EA13]

Not modelled: third order, changes between the turns, harmonics beyond half the number of positions (24 readings cannot
tell harmonic k from 24 - k and 24 + k: measure D1 in the same positions, so that it holds the alias).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gyrobench import frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.sources import GRAVITY, VOLTMETER, Effect
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Findings, Group, Location, Quantity, Setup, told
from gyrobench.result import Coefficient, Reason, Table
from gyrobench.units import ARCSEC

from . import chain, geometry
from .sources import FIRST

COLUMNS = ("mean", "mean_2", "mean_3", "mean_4")
MEANING = {
    "K_F": ("bias", "V"),
    "K_I": ("scale factor", "V/g"),
    "K_O": ("output axis, as K_O + K_I (η + D₀)", "V/g"),
    "K_IO": ("cross term", "V/g²"),
    "K_II": ("square term", "V/g²"),
}
NAMES = [(i, k) for i in geometry.SENSORS for k in geometry.TERMS]  # of the coefficients, in their order
BIASED = ("K_F", "K_IO", "K_II")  # by the first harmonic of the head
POSITION = math.radians(0.1)  # largest departure of an angle from its position
VOLTAGES = "relative, of all voltages"


@dataclass(frozen=True, kw_only=True)
class FourSetup(Setup):
    """gravity: m/s2.  D1: first harmonic of the head, cosine and sine, rad; None: unknown."""

    gravity: float
    points: int = 24
    D1: tuple[float, float] | None = None

    @property
    def gamma(self) -> float:
        """Gravity in multiples of g0."""
        return self.gravity / frames.G0


class Reduction(DriftReduction[FourSetup]):
    """Coefficients of four sensors from windows: t_start, t_end (s), angle_start, angle_end (rad, nominal), mean,
    mean_2, mean_3, mean_4 (V).
    """

    @classmethod
    def setup_of(cls, run: RunDocument) -> FourSetup:
        o = run.options
        gravity = float(o["gravity"]) if run.measured else Location.of(run).gravity
        D1 = None if o.get("d1_unknown") else (float(o["D1c"]), float(o["D1s"]))
        site = {"gravity / (m/s²)": gravity}
        return FourSetup.of(run, gravity=gravity, points=int(o["points"]), truth=sensor_truth(run), D1=D1, site=site)

    def problems(self) -> list[str]:
        s, w = self.setup, self.windows
        problems = frames.gravity_problems(s.gravity) + window_problems(w)
        if missing := [n for n in COLUMNS[1:] if n not in w]:
            problems.append(f"column {', '.join(missing)} is missing: the four sensors are read together")
        if problems:
            return problems
        self.alpha = np.asarray(w["angle_start"], dtype=float)
        self.U = np.column_stack([np.asarray(w[n], dtype=float) for n in COLUMNS])
        problems = _position_problems(self.alpha, np.asarray(w["angle_end"], dtype=float), s.points)
        if not problems and np.any(np.ptp(self.U, axis=0) == 0.0):
            problems.append("a voltage is the same in all positions: no accelerometer was read")
        return problems

    def regression(self) -> Regression:
        self.single, self.s_single = chain.alone(self.alpha, self.U, self.setup.gamma)
        scale = self.single[:, 1]
        if np.any(scale <= 0.0):
            raise ReductionError(
                f"scale factors {', '.join(f'{plain(k, 4)}' for k in scale)} V/g: must be positive; turn the sign of a "
                "voltage round, or the sense of the angle, or sensors stand in another order"
            )
        first = joint(self.alpha, self.U, self.setup, scale).fit()
        return joint(self.alpha, self.U, self.setup, first.est.beta[1:20:5])

    def derived(self, found: Findings) -> Findings:
        truth, self.joint = self.setup.truth or {}, found
        quantities = [
            Quantity(f"{k},{i}", f"{MEANING[k][0]}, sensor {i}", MEANING[k][1], 1.0, truth.get(f"{k},{i}"))
            for i, k in NAMES
        ]
        return found.derive(quantities, lambda b: b[:20])

    def effects(self, found: Findings) -> list[Effect]:
        s, beta = self.setup, found.est.beta
        scale = beta[1:20:5] * s.gamma
        tangent = [scale[j] * geometry.axes(i, self.alpha)[1] for j, i in enumerate(geometry.SENSORS)]
        lines = [np.concatenate([-t * f(self.alpha) for t in tangent]) for f in (np.cos, np.sin)]
        power = np.tile([0.0, 1.0, 1.0, 2.0, 2.0], 4)  # of 1/gravity in the coefficients
        both = zip(("cosine", "sine"), lines, strict=True) if s.D1 is not None else ()
        return [
            VOLTMETER.effect(s, found.error(self.U.T.ravel()), note=VOLTAGES),
            GRAVITY.effect(s, values=-power * beta[:20] / s.gravity),
            *(FIRST.of(kind=kind).effect(s, found.error(line)) for kind, line in both),
        ]

    def account(self, found: Findings) -> Account:
        points, unknowns = self.setup.points, found.X.shape[1]
        return Account(
            method=f"{points} positions, four sensors read together; joint least squares of 20 coefficients and "
            f"{unknowns - 20} harmonics of the head [TEST-ACCEL4]",
            sources=["TEST-ACCEL4, ACCEL-MODEL; Dong 2014, eq. 1-31, corrected by EA1 to EA13"],
            equation='U_i = K_F + K_I a_I + K_O a_O + K_"IO" a_I a_O + K_"II" a_I^2 + K_I a_O D(alpha)',
            conventions=[
                "a in g0 = 9.80665 m/s²; specific force: an axis that points up reads +1.",
                "Sensor 1 is level at angle 0 and rises with the angle; sensors 2, 3, 4 are 90°, 180°, 270° ahead.",
                "No third order. Misalignment and the zero of the head are in K_O.",
            ],
            tables=[self._compared(), self._head()],
            reasons=self._biased(),
            random="noise of the voltages",
        )

    def _biased(self) -> list[Reason]:
        """Return that the first harmonic of the head is in the coefficients, where it was not measured."""
        if self.setup.D1 is not None:
            return []
        scale = float(np.mean(self.joint.est.beta[1:20:5]))
        text = (
            f"The first harmonic of the head is not known: {', '.join(BIASED)} of each sensor are biased by K_I D1, "
            f"{plain(scale * ARCSEC)} V for each arcsecond; the residuals do not show it. Measure it in the same "
            "positions."
        )
        names = tuple(f"{k},{i}" for i, k in NAMES if k in BIASED)
        return [Reason("head.first_harmonic_unknown", text, ("pass", "fail"), names)]

    def _compared(self) -> Table:
        s, beta, u = self.setup, self.joint.est.beta, self.joint.est.u
        three = chain.three_steps(self.alpha, self.U, s.gamma)
        if s.D1 is not None:
            three = three + _first_harmonic(beta[1:20:5], s.D1)
        each = zip(NAMES, beta[:20], u[:20], three.ravel(), self.single.ravel(), strict=True)
        rows = [[f"{k},{i}", *map(float, values), MEANING[k][1]] for (i, k), *values in each]
        scatter = ", ".join(plain(v, 3) for v in self.s_single)
        caption = (
            "Chain: D4 and higher, D2, D3 taken out one after the other, corrected by EA3 to EA5, same D1. "
            f"Alone: five terms of each sensor, errors of the head in them. Residuals of the sensors alone: {scatter} "
            f"V, of the joint fit {plain(self.joint.residual_std, 3)} V."
        )
        head = ["coefficient", "joint", "u, type A", "chain", "alone", "unit"]
        return Table("fits.compared", "Joint fit, chain of the source, each sensor alone", caption, head, rows)

    def _head(self) -> Table:
        s, beta, u = self.setup, self.joint.est.beta, self.joint.est.u
        rows = [
            [k, kind, float(beta[20 + m]) / ARCSEC, float(u[20 + m]) / ARCSEC]
            for m, (k, kind) in enumerate(geometry.orders(s.points))
        ]
        known = zip(("cos", "sin"), s.D1 or (), strict=False)
        rows = [[1, kind, v / ARCSEC, FIRST.size(s) / ARCSEC] for kind, v in known] + rows
        caption = "Positions minus their nominal angles; the first harmonic is that of the autocollimator"
        head = ["harmonic", "of", "amplitude / ″", "u / ″"]
        return Table("head.harmonics", "Angle errors of the head by harmonics", caption, head, rows)

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        scales = "; ".join(f"sensor {i} {{K_I,{i}}}" for i in geometry.SENSORS)
        scatter, dof = self.joint.residual_std, self.joint.dof
        return [
            *told(coefficients, f"Scale factors: {scales}."),
            f"Residual standard deviation {plain(scatter, 3)} V with {dof:.0f} degrees of freedom.",
        ]


def estimate(alpha: Array, U: Array, setup: FourSetup, scale: Array) -> Findings:
    """Return the joint fit of voltages U (n, 4) at the nominal angles; scale (4,): first scale factors, V/g."""
    first = joint(alpha, U, setup, scale).fit()
    return joint(alpha, U, setup, first.est.beta[1:20:5]).fit()


def joint(alpha: Array, U: Array, s: FourSetup, scale: Array) -> Regression:
    """Return the regression of all voltages with the columns of D of these scale factors."""
    n, basis = alpha.size, geometry.harmonics(alpha, s.points)
    X = np.zeros((4 * n, 20 + basis.shape[1]))
    y = U.T.ravel().copy()
    first = s.D1 or (0.0, 0.0)
    D1 = first[0] * np.cos(alpha) + first[1] * np.sin(alpha)
    groups = []
    dense = np.radians(np.arange(0.0, 361.0, 3.0))
    shown = np.degrees(np.mod(alpha + 1e-6, 2.0 * math.pi) - 1e-6)
    for j, i in enumerate(geometry.SENSORS):
        rows, own = slice(j * n, (j + 1) * n), slice(5 * j, 5 * j + 5)
        tangent = scale[j] * s.gamma * geometry.axes(i, alpha)[1]
        X[rows, own] = chain.design(i, alpha, s.gamma)
        X[rows, 20:] = basis * tangent[:, None]
        y[rows] -= tangent * D1
        curve = np.zeros((dense.size, X.shape[1]))
        curve[:, own] = chain.design(i, dense, s.gamma)
        drawn = (np.degrees(dense), curve)
        groups.append(Group(f"sensor {i}", np.arange(n) + j * n, shown, "angle of the head", "°", drawn))
    names = [*(f"{k},{i}" for i, k in NAMES), *(f"D{k}{kind[0]}" for k, kind in geometry.orders(s.points))]
    return Regression(names, X, y, None, None, groups, "voltage", "V", 1.0, "white")


def _position_problems(alpha: Array, end: Array, points: int) -> list[str]:
    step = 2.0 * math.pi / points
    number = np.rint(alpha / step)
    off = np.flatnonzero((np.abs(alpha - number * step) > POSITION) | (np.abs(end - alpha) > POSITION))
    if off.size:
        a, b = (math.degrees(float(x[off[0]])) for x in (alpha, end))
        return [f"row {off[0] + 1}: {plain(a, 6)}° to {plain(b, 6)}° is not one of {points} equally spaced positions"]
    counts = np.bincount(np.mod(number, points).astype(int), minlength=points)
    if np.any(counts != counts[0]) or counts[0] == 0:
        few = int(np.argmin(counts))
        where = plain(math.degrees(few * step), 4)
        return [f"position {where}° is read {counts[few]} times, others {counts.max()}: whole turns are needed"]
    return [] if 16 <= points <= 24 else [f"points = {points}: 16 to 24 positions"]


def _first_harmonic(scale: Array, D1: tuple[float, float]) -> Array:
    """Return what takes the first harmonic out of terms (4, 5) fitted with it.  [Dong 2014, eq. 27, 28, by EA8]"""
    c, s = D1
    of_unit = np.array([[-c, 0, 0, -s, c], [s, 0, 0, c, -s], [c, 0, 0, s, -c], [-s, 0, 0, -c, s]])
    return np.asarray(scale[:, None] * of_unit)


def sensor_truth(run: RunDocument) -> dict[str, float] | None:
    """Return the coefficients of simulated sensors about the axes of the head: misalignment and zero turned in."""
    p = run.parameters
    if run.measured or not all(f"accelerometer_{i}.K_I" in p for i in geometry.SENSORS):
        return None
    zero = float(np.mean(np.asarray(p["table.error"])[: int(run.options["points"])]))
    site = Location.of(run)
    found: dict[str, float] = {}
    for i in geometry.SENSORS:
        F, I, O, IO, II = (float(p[f"accelerometer_{i}.{k}"]) for k in geometry.TERMS)  # noqa: E741
        turn = float(p.get(f"accelerometer_{i}.eta", 0.0)) + zero
        c, s = math.cos(turn), math.sin(turn)
        values = (
            F + site.g**2 * (IO * c * s + II * s * s), I * c - O * s, O * c + I * s,
            IO * (c * c - s * s) + 2.0 * c * s * II, II * (c * c - s * s) - 2.0 * c * s * IO,
        )  # fmt: skip
        found |= {f"{k},{i}": v for k, v in zip(geometry.TERMS, values, strict=True)}
    return found
