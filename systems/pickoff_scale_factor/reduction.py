"""Reduction of the pickoff test: slope, zero and straightness of the pickoff voltage over the angle of the case.

    u = u_0 + S c(alpha) + q (t - t_m) + r (t - t_m)2 / 2 + noise        S = K_sg H/C        q = -S omega_d

u_0 and S are that line; q, the mean drift of the free float during the test, and r, its even change, are estimated
where the angles are gone over twice in opposite order; otherwise the drift is bounded.  The two passes are one cycle of
a square wave: what changes slowly looks like S, and r takes most of it.  The float sees the table rate by the cosine of
its angle, b' = (H/C) cos(b) alpha', so that its angle is gd(H/C alpha), the Gudermannian function: c = gd(g alpha)/g,
g = H/C, which falls short of alpha by a sixth of the cube (6e-6 of 20 arcmin).  The line of Hu 1981, beside it, takes
c = alpha.  The rotor of a two-degree-of-freedom gyro whose other axis is locked keeps its direction: c = alpha, g = 1.
[TEST-PICKOFF; Hu 1981, appendix 1 of chapter 3]

Not modelled: drift that changes otherwise during the test is noise; an angle of the float at table angle 0.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from gyrobench import drift as drift_model
from gyrobench import frames, units
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift import channels
from gyrobench.reduction.drift.drift_terms import EARTH_ONLY
from gyrobench.reduction.estimation import noise as noise_model
from gyrobench.reduction.estimation.fit_result import Account, with_values
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.setup import sources
from gyrobench.reduction.setup.run_metadata import Location, truth_of
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.reduction.toolkit import Array, DriftReduction, Findings, Group, Quantity, Record, Setup, plain, told
from gyrobench.result import Coefficient, DriftTestResult, Reason
from gyrobench.system.families.servo_channel import own_name
from gyrobench.units import ARCSEC, DPH

from .levels import Levels
from .refusals import drift_problems, record_problems
from .sources import DRIFT, GAIN, SCALE

ARCMIN = units.factor("arcmin")
SMALL = 1e-5  # rad, step of the sensitivities to the angle readings
NEGLIGIBLE = 0.3  # of what white noise leaves in the mean drift of a test
TOLD_APART = 0.9  # largest correlation of angle and time at which the drift is estimated
SHORT = (
    "It is the mean of this test alone, with the random drift of these seconds in it; open_loop_drift, fixed_position "
    "or a servo test tell the drift of the gyro."
)


@dataclass(frozen=True)
class PickoffSetup(Setup):
    """gain: H/C.  drift: largest to be expected, rad/s.  truth: S (V/rad), K_sg (V/rad), drift (rad/s).
    channel: of a two-degree-of-freedom gyro, x or y; its gain is 1.
    """

    gain: float
    drift: float
    channel: str = ""
    earth_rate: float = frames.EARTH_RATE


def float_angle(angle: Array, gain: float, channel: str = "") -> Array:
    """Return what an angle of the case (rad) is to a free float of the gain H/C, over the gain: gd(gain angle)/gain; to
    the rotor of a two-degree-of-freedom gyro it is that angle.
    """
    if channel:
        return angle
    return np.asarray(2.0 * np.arctan(np.tanh(gain * angle / 2.0)) / gain)


class Reduction(DriftReduction[PickoffSetup]):
    """Scale factor, zero, straightness and drift from pickoff voltages at angles of the case."""

    handling = staticmethod(handling_candidates.readings)

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        return cls.reduce(record.windows, setup_of(record))

    def problems(self) -> list[str]:
        s, problems = self.setup, window_problems(self.windows) or record_problems(self.windows)
        if not (math.isfinite(s.gain) and s.gain > 0.0):
            problems.append(f"gain H/C = {s.gain:g}: a finite positive number is expected")
        if problems:
            return problems
        columns = ("angle_start", "t_start", "t_end", "mean")
        self.angle, t0, t1, self.u = (np.asarray(self.windows[c], dtype=float) for c in columns)
        self.t, self.dt = (t0 + t1) / 2.0, np.diff((t0 + t1) / 2.0)
        self.span, self.duration = float(np.ptp(self.angle)), float(t1[-1] - t0[0])
        return drift_problems(s.drift, self.duration, self.span)

    def regression(self) -> Regression:
        t, dt = self.t, self.dt
        self.both = abs(float(np.corrcoef(self.angle, t)[0, 1])) < TOLD_APART
        self.seen, self.centre = float_angle(self.angle, self.setup.gain, self.setup.channel), (t[0] + t[-1]) / 2.0
        # differences from reading to reading: the float's random drift adds up, so that the levels are not independent
        steps = (np.diff(self.seen) / dt)[:, None]
        middle = (t[1:] + t[:-1]) / 2.0 - self.centre
        X = np.column_stack([steps, np.ones_like(dt), middle]) if self.both else steps
        group = Group("from reading to reading", np.arange(dt.size), np.arange(dt.size) + 1.0, "step", "1")
        return Regression(
            ["S", "q", "r"] if self.both else ["S"], X, np.diff(self.u) / dt, t[:-1], t[1:], [group],
            "change of the voltage", "mV/s", 1e-3, "readings",
        )  # fmt: skip

    def derived(self, found: Findings) -> Findings:
        gain, both, truth = self.setup.gain, self.both, self.setup.truth or {}
        if found.value[0] <= 0.0:
            raise ReductionError("the voltage falls as the angle rises: turn the sign of one of them round")
        line = float(np.polyfit(self.angle, self.u, 1)[0])
        slope, of_float = "scale factor per angle of the case, K_sg H/C", "scale factor per angle of the float"
        wanted = [
            Quantity("S", slope, "V/rad", 1.0, truth.get("S"), line),
            Quantity("K_sg", of_float, "V/rad", 1.0, truth.get("K_sg"), line / gain),
        ]
        if both:
            meaning = "drift of the gyro, with random drift that is slower than half the test, precession sign"
            wanted.append(Quantity("drift", meaning, "°/h", DPH, truth.get("drift")))
        return found.derive(wanted, lambda b: [b[0], b[0] / gain, *([-b[1] / b[0]] if both else [])])

    def effects(self, found: Findings) -> list[sources.Effect]:
        """Return all sources with their sensitivities.

        An encoder that is off once a turn is off in proportion to a small angle, so the sine is an error of the scale.
        The axis of the table and the input axis see Earth rate as they lean towards the pole: a constant drift.
        """
        s, angle, slope = self.setup, self.angle, float(found.est.beta[0])
        only = np.zeros(found.value.size)
        only[1] = -found.value[1]  # K_sg = S/gain

        def stretched(steps: Array) -> Array:
            dX = np.zeros_like(found.X)
            dX[:, 0] = steps
            return found.error(dX=dX)

        def misread(n: int) -> Array:  # readings that are too large by sin n angle, and by cos n angle
            wrong = (float_angle(angle + SMALL * f(n * angle), s.gain, s.channel) for f in (np.sin, np.cos))
            return np.array([stretched(np.diff(w - self.seen) / self.dt / SMALL) for w in wrong])

        earth = found.error(slope * s.earth_rate)
        return [
            GAIN.effect(s, values=only),
            SCALE.effect(s, stretched(found.X[:, 0])),
            sources.ANGLE_ONCE.effect(s, misread(1)),
            sources.ANGLE_TWICE.effect(s, misread(2)),
            sources.VOLTMETER.effect(s, found.error(found.y)),
            sources.AXIS_LEVEL_POLE.effect(s, earth, note=EARTH_ONLY),
            sources.INPUT_TO_OUTPUT.effect(s, earth, note=EARTH_ONLY),
            *([] if self.both else [DRIFT.effect(s.drift / 2.0, found.error(slope))]),
        ]

    def test(self, found: Findings) -> None:
        found.f_test(
            "curvature", "square and cube of the angle",
            np.column_stack([np.diff((self.angle / self.span) ** p) / self.dt for p in (2, 3)]),
            "curvature of the pickoff", "the pickoff is not straight", "no curvature beyond the scatter",
        )  # fmt: skip

    @property
    def bound(self) -> float:
        """Angle that the largest drift to be expected makes of the test, rad."""
        return self.setup.drift * self.duration

    def account(self, found: Findings) -> Account:
        away, beta = self.t - self.centre, found.est.beta
        moved = beta[1] * away + beta[2] * away**2 / 2.0 if self.both else np.zeros_like(away)
        self.levels = Levels.of(self.angle, self.seen, self.t, self.u, moved, 2 if self.both else 0)
        once = (
            "The angles were gone over once: drift cannot be told from slope; by the bound on it, S may be wrong by up "
            f"to {plain(self.bound / self.span * 100)} %. Going back over the same angles tells it."
        )
        drifting = " - S omega_d (t - t_m) + r (t - t_m)^2\\/2" if self.both else ""
        return Account(
            method="Line through the pickoff voltage over the angle of the table, float free; slope from the "
            "differences of the readings [TEST-PICKOFF]",
            sources=["TEST-PICKOFF, PICKOFF; Hu 1981, appendix 1 of chapter 3", "GYRO-DYN-1; Hu 1981, eq. 2-50..2-56"],
            equation=f"u = u_0 + S alpha{drifting}"
            if self.setup.channel
            else f'u = u_0 + S c(alpha){drifting}, quad c = g^(-1) "gd"(g alpha), quad S = K_"sg" g, quad g = H\\/C',
            conventions=[
                self._follows(),
                "The table axis is at right angles to the pole and sees no Earth rate.",
                "The zero holds whatever angle the free float had taken before the test.",
                *(["Drift in precession sign; a drifting float turns against it, u = −S ω_d t."] if self.both else []),
            ],
            closed_caption="The closed formula is the line of Hu 1981 through the readings, without drift",
            tables=[self.levels.table()],
            reasons=[
                Reason("drift.short", SHORT, ("pass", "fail"), ("drift",), severity="condition")
                if self.both
                else Reason("drift.bound", once)
            ],
            random="pickoff noise and random drift",
        )

    def _follows(self) -> str:
        """Return what the float or the rotor makes of the table angle."""
        if c := self.setup.channel:
            other = "y" if c == "x" else "x"
            return (
                f"Table angle right-handed about the {c} axis; the rotor keeps its direction, u_{c} is the angle of "
                f"the case against it and S = K_sg. The {other} axis is locked by its rebalance loop."
            )
        return (
            "Table angle right-handed about the input axis; the float follows it with the gain H/C "
            f"= {plain(self.setup.gain, 9)}, so that S = K_sg H/C."
        )

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Return the result with zero, straightness and the readings."""
        dense = np.linspace(self.angle.min(), self.angle.max(), 61)
        drawn = self.levels.series(dense, float_angle(dense, self.setup.gain, self.setup.channel))
        return replace(with_values(result, self.levels.coefficients()), series=[drawn, *result.series])

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [
            *told(coefficients, "Pickoff scale factor S = {S} per angle of the case, K_sg = {K_sg}."),
            f"Largest departure from the line {plain(abs(coefficients[-1].estimate))} % of the span of "
            f"{plain(self.span / ARCMIN, 4)}′.",
            f"The test took {plain(self.duration, 3)} s: a drift of {plain(self.setup.drift / DPH, 3)} °/h is at most "
            f"{plain(self.bound / ARCSEC, 3)}″, {plain(self.bound / self.span * 100)} % of the span.",
        ]


def setup_of(record: Record) -> PickoffSetup:
    """Return the setup that the run.json of a record describes: options and the parameters of the gyro."""
    run, options = record.run, record.run.options
    site, channel = Location.of(run), str(options.get("channel", ""))
    gain = 1.0 if channel else float(options.get("gain") or 0.0)
    truth: dict[str, float] | None = None
    own, K_sg = _of_gyro(run, channel)
    if own and K_sg:
        gain = gain or own
        truth = {"S": K_sg * own, "K_sg": K_sg}
        static = channels.truth_in(run, channel)
        time = float(record.windows["t_end"][-1] - record.windows["t_start"][0])  # with the moves, unlike the plan's
        if static is not None and not _random_drift_lasts(run, time, channel):
            # output axis on the pole, spin axis on east x pole: X = 0, Y = -g sin, Z = -g cos of the latitude
            xyz = np.array([0.0, -site.g * math.sin(site.latitude), -site.g * math.cos(site.latitude)])
            row = drift_model.regressors(xyz, tuple(static))
            truth["drift"] = float(sum(r * v for r, v in zip(row, static.values(), strict=True)))
    if not gain:
        raise ReductionError("gain H/C unknown: the gyro has no parameters H and C; give the option gain")
    setup = PickoffSetup.of(
        run,
        gain=gain,
        drift=float(options["drift"]),
        channel=channel,
        earth_rate=site.earth_rate,
        truth=truth,
        site={} if run.measured else site.shown(),
    )
    return replace(setup, errors=channels.errors_in(setup.errors, channel))


def _of_gyro(run: RunDocument, channel: str) -> tuple[float, float]:
    """Return gain and pickoff gain (V/rad) of the simulated gyro; 0 where it does not tell them."""
    K_sg = float(run.parameters.get(f"gyro.{own_name(channel, 'K_sg')}") or 0.0)
    if channel:
        return 1.0, K_sg
    known = truth_of(run, ("H", "C")) or {}
    return (known["H"] / known["C"] if len(known) == 2 else 0.0), K_sg


def _random_drift_lasts(run: RunDocument, time: float, channel: str = "") -> bool:
    """True for a simulated gyro with random drift that is slower than any in the interval and not small beside its
    white noise: it is in the estimate, and the parameters are not its truth.
    """
    names = ("turn_on", "markov", "markov_tau", "white", "flicker", "walk")
    noise = {n: float(run.parameters.get(f"gyro.{own_name(channel, n)}") or 0.0) for n in names}
    lasts = noise["markov_tau"] > noise_model.LONGEST * time
    slow = math.hypot(noise["turn_on"], noise["markov"] * lasts, noise["flicker"], noise["walk"] * math.sqrt(time))
    return slow > NEGLIGIBLE * noise["white"] / math.sqrt(time)
