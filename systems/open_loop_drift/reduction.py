"""Reduction of the open-loop test: drift from the inertial angle at which the pickoff is at its null.

An open-loop float integrates: b' = (H/C) (w_I - w_S b - omega_d), u = K_sg b.  With G = K_sg H/C the case angle of the
null at reading j and the mean drift between two readings are

    n_j = theta_j - u_j/G          omega_d = (n_(j+1) - n_j)/(t_(j+1) - t_j) + W_I - W_S b

W_I, W_S: Earth rate along input and spin axis; b = (H/C) (theta - (n_j + n_(j+1))/2) with the mean case angle theta
between the readings (the case is stepped on right after a reading).  G comes from the same readings, by least squares
of the differences of u between steps over and under the null; a hand that nulls well needs none (u = 0).  An error of
G cancels where first and last reading lie on the same side of the null.  The mean over the intervals stands under a
noise model estimated from them.  [TEST-OPEN, DYN-CROSS; Hu 1981, ch. 3 par. 1, eq. 2-50..2-56]

Not modelled: a drift that changes with the case angle, omega_d'.  The result is that at the mean attitude; between the
steps it looks like a gain, G (1 - omega_d' T/2) for steps every T, and shifts the result by (omega_d' T/2) times the
rate at which the null runs away from the hand (1e-4 of it for 0.7 deg/h/g and a minute).  Restraint of the float.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift.drift_terms import attitude_effects
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.setup.setups import SiteSetup, attitude_of
from gyrobench.reduction.setup.sources import ANGLE_ONCE, ANGLE_TWICE, LATITUDE, Effect
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Findings, Group, Quantity, plain, told, truth_of
from gyrobench.result import Coefficient, Reason, Table
from gyrobench.units import ARCSEC, DPH

from . import refusals
from .sources import ANGLE, GAIN

LEAST = 9  # readings
SMALL = 1e-5  # rad


@dataclass(frozen=True, kw_only=True)
class OpenLoopSetup(SiteSetup):
    """attitude: rows I, O, S in (E, N, U) at table angle 0; the table turns about I.  float_gain: H/C.  wait: time
    between a step of the case and the reading after it, s; None: the step takes no time.  reach: case angle at which
    the pickoff saturates, rad (None: unknown).
    """

    attitude: Array = field(default_factory=lambda: np.eye(3))
    float_gain: float = 1.0
    wait: float | None = None
    reach: float | None = None

    def earth(self, axis: int = 0) -> float:
        """Return the Earth rate along I (0), O (1) or S (2) at table angle 0, rad/s."""
        return float(self.attitude[axis] @ frames.earth_rate_local(self.latitude, self.earth_rate))

    def xyz(self, angle: float) -> Array:
        """Return X, Y, Z = -f/g0 with the case turned by ``angle`` (rad) about I."""
        c, s = math.cos(angle), math.sin(angle)
        I, O, S = self.attitude  # noqa: E741
        return np.asarray(np.array([I, c * O + s * S, c * S - s * O]) @ -frames.U * self.gravity / frames.G0)


def case_angles(theta: Array, t0: Array, t1: Array, wait: float | None) -> Array:
    """Return the mean case angle (rad) between the middles of successive readings.

    Half a reading before the step, the step at even mean rate, the rest after it.
    """
    pause = t0[1:] - t1[:-1]
    move = np.zeros_like(pause) if wait is None else np.clip(pause - wait, 0.0, pause)
    before = (t1[:-1] - t0[:-1]) / 2.0 + move / 2.0
    share = before / ((t0[1:] + t1[1:] - t0[:-1] - t1[:-1]) / 2.0)
    return np.asarray(share * theta[:-1] + (1.0 - share) * theta[1:])


def null_angles(
    theta: Array, between: Array, t: Array, u: Array, setup: OpenLoopSetup
) -> tuple[Array, float | None, Array]:
    """Return the case angle (rad, against the Earth) of the null at each reading; the gain G (V/rad; None if all u are
    0); the mean rate w_S b (rad/s) of each interval, ``between``: its mean case angle.
    """
    dt, earth = np.diff(t), setup.earth()
    spin = np.cos(between) * setup.earth(2) - np.sin(between) * setup.earth(1)

    def coupled(null: Array) -> Array:
        return np.asarray(spin * setup.float_gain * (between - (null[1:] + null[:-1]) / 2.0))

    if float(np.max(np.abs(u))) == 0.0:
        return theta, None, coupled(theta)
    G, null, cross = 0.0, theta, np.zeros_like(dt)
    for _ in range(6):  # w_S b wants the null, the null wants G: converges by a factor of w_S dt, some 1e-3
        X = np.column_stack([np.diff(theta) + (earth - cross) * dt, dt])  # differences, as drift is a random walk here
        size = np.linalg.norm(X, axis=0)
        if size[0] == 0.0 or np.linalg.cond(X / np.maximum(size, 1e-300)) > 1e3:
            raise ReductionError(
                "the gain of the pickoff cannot be found: the case never stood over and under the null; step it to "
                "both sides, or give only readings taken at the null, without the column u"
            )
        G = float(np.linalg.lstsq(X / size, np.diff(u), rcond=None)[0][0] / size[0])
        if not G > 0.0:
            raise ReductionError(f"gain of the pickoff {plain(G, 4)} V/rad: must be positive; turn the sign of u round")
        null = theta - u / G
        cross = coupled(null)
    return null, G, cross


class Reduction(DriftReduction[OpenLoopSetup]):
    """Drift from readings: t_start, t_end (s), angle_start, angle_end (rad), mean (V; pickoff), flagged (optional)."""

    handling = staticmethod(handling_candidates.followed)

    @classmethod
    def setup_of(cls, run: RunDocument) -> OpenLoopSetup:
        return OpenLoopSetup.of(
            run,
            attitude=attitude_of(run),
            float_gain=_float_gain(run),
            wait=None if run.measured else next((row.settle for row in run.plan), None),
            reach=refusals.case_range(run.parameters),
            truth=truth_of(run, drift.NAMES),
        )

    def problems(self) -> list[str]:
        s, w = self.setup, self.windows
        problems = frames.latitude_problems(s.latitude) + frames.gravity_problems(s.gravity)
        problems += frames.rotation_problems({"attitude": s.attitude})
        problems += window_problems({"phase": np.zeros(len(w.get("mean", ()))), **w})
        if not problems and len(w["mean"]) < LEAST:
            problems.append(f"{len(w['mean'])} readings: at least {LEAST} are needed to estimate the noise")
        return problems

    def _data(self, angle: Array) -> Array:
        """Return the drift (n-1,) of the intervals from readings of the angle (n,), which give the gain, too."""
        at, _, beside = null_angles(angle, self._between(angle), self.t, self.u, self.setup)
        return np.asarray(np.diff(at) / np.diff(self.t) + self.setup.earth() - beside)

    def _between(self, angle: Array) -> Array:
        return case_angles(angle, self.t0, self.t1, self.setup.wait)

    def regression(self) -> Regression:
        s = self.setup
        columns = ("t_start", "t_end", "angle_start", "angle_end", "mean")
        self.t0, self.t1, a0, a1, self.u = (np.asarray(self.windows[n], dtype=float) for n in columns)
        self.t, self.theta = (self.t0 + self.t1) / 2.0, (a0 + a1) / 2.0
        t, between = self.t, self._between(self.theta)
        self.null, self.gain, cross = null_angles(self.theta, between, t, self.u, s)
        dt, span = np.diff(t), float(t[-1] - t[0])
        y, mean_cross = self._data(self.theta), float(cross @ dt) / span
        self.used = float(np.max(np.abs(self.theta - self.null)))
        self.coupled = mean_cross / max(s.float_gain, 1e-9)
        self.book = float((self.null[-1] - self.null[0]) / span) + s.earth() - mean_cross
        true = None
        if s.truth is not None:
            true = float(np.array([drift.drift(s.xyz(a), s.truth) for a in between]) @ dt / span)
        wanted = Quantity.of("ω_d", "drift along the input axis at the mean attitude", "deg/h", true, self.book)
        names = drift.terms(9)
        share = dt @ drift.regressors(np.array([s.xyz(a) for a in between]), names) / span
        wanted = replace(wanted, combination=dict(zip(names, share.tolist(), strict=True)))
        shown = Group("drift between readings", np.arange(y.size), (t[1:] + t[:-1]) / 2.0 - t[0], "time", "s")
        warm = {n: (v[1:] + v[:-1]) / 2.0 for n, v in self.windows.items() if n.startswith("temperature")}
        weighed = nuisances.common({**warm, "t_start": t[:-1], "t_end": t[1:]}) if s.nuisances else []
        ones = np.ones((y.size, 1))  # the intervals share their readings, and so the errors of these
        return Regression([wanted], ones, y, t[:-1], t[1:], [shown], noise="readings", candidates=weighed)

    def effects(self, found: Findings) -> list[Effect]:
        s, t, local = self.setup, self.t, frames.earth_rate_local
        here, north = (local(x, s.earth_rate) for x in (s.latitude, s.latitude + SMALL))
        whole = found.error(np.full(t.size - 1, 1.0 / float(t[-1] - t[0])))

        def misread(n: int) -> Array:  # an encoder that reads too much by sin n theta, and by cos n theta
            right, waves = self._data(self.theta), (np.sin, np.cos)
            wrong = (self._data(self.theta + SMALL * f(n * self.theta)) for f in waves)
            return np.array([found.error(y - right) / SMALL for y in wrong])

        return [
            *attitude_effects(s, found),
            LATITUDE.effect(s, found.error(float((s.attitude[0] @ (north - here)) / SMALL))),
            ANGLE.effect(s, whole),
            ANGLE_ONCE.effect(s, misread(1)),
            ANGLE_TWICE.effect(s, misread(2)),
            GAIN.effect(s, found.error(-self.coupled)),
        ]

    def account(self, found: Findings) -> Account:
        return Account(
            method="Case turned about the input axis to the null of the pickoff, no loop closed; mean over the "
            "intervals between readings under an estimated noise model [TEST-OPEN]",
            sources=[
                "TEST-OPEN; Hu 1981, ch. 3 par. 1",
                "DYN-CROSS; Hu 1981, eq. 2-50..2-56",
                "RED-GLS; Hu 1981, eq. 4-79..4-88",
            ],
            equation='omega_d = (Delta theta) / (Delta t) + omega_"E,I" - omega_"E,S" b',
            conventions=[
                "Drift ω_d in precession sign; θ: table angle about the input axis, right-handed.",
                "θ is the case angle of the null: the reading of the table less u/G.",
                "Valid only while the pickoff is inside its range; flagged (saturated) readings are refused.",
            ],
            closed_caption="Least squares under the noise model; closed: angle between first and last null over the "
            "time",
            tables=[self._table()],
            reasons=self._reasons(),
        )

    def _reasons(self) -> list[Reason]:
        reach, out = self.setup.reach, []
        turned = math.degrees(float(np.ptp(self.theta)))
        if turned > 2.0:
            text = (
                f"The case turned by {plain(turned, 3)}° against gravity as it followed the sky: its drift changed on "
                "the way, and the result is some mean of it; take a shorter test, or an input axis east or west."
            )
            out.append(Reason("case.turned", text))
        if reach is not None and self.used > 0.8 * reach:
            share = f"{self.used / reach:.0%}"
            text = f"{share} of the range of the pickoff used: let the hand follow, option follow."
            out.append(Reason("pickoff.range", text))
        return out

    def _table(self) -> Table:
        s = self.setup
        rows: list[list[Any]] = [
            ["Earth rate along the input axis", s.earth() / DPH, "°/h"],
            ["angle of the null, last less first reading", float(self.null[-1] - self.null[0]) / ARCSEC, "″"],
            ["time between them", float(self.t[-1] - self.t[0]), "s"],
            ["drift of the two", self.book / DPH, "°/h"],
            ["gain of the pickoff G", self.gain, "V/rad"],
            ["case angle off the null, largest (range used)", self.used / ARCSEC, "″"],
            ["case angle at saturation", None if s.reach is None else s.reach / ARCSEC, "″"],
        ]
        head = ["quantity", "value", "unit"]
        return Table("angle_to_drift", "From angle to drift", "What the drift is made of", head, rows)

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        reach = self.setup.reach
        beyond = "" if reach is None else f" of {plain(reach / ARCSEC, 4)}″ to saturation"
        return [
            *told(coefficients, "Drift ω_d = {ω_d} in one attitude."),
            f"Range of the pickoff used: {plain(self.used / ARCSEC, 4)}″ of case angle{beyond}.",
            found.noise_sentence("intervals"),
            *found.nuisance_sentences(),
        ]


def _float_gain(run: RunDocument) -> float:
    """Return the option, else H/C of the gyro, else 1."""
    given, parameters = float(run.options.get("float_gain", 0.0)), run.parameters
    if given > 0.0 or not {"gyro.H", "gyro.C"} <= set(parameters):
        return given or 1.0
    return float(parameters["gyro.H"]) / float(parameters["gyro.C"])
