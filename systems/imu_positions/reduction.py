"""Reduction of positions and turns of an inertial measurement unit: six instruments, each a linear fit of its own.

    accelerometer i   f_read_i - f_i = ba_i + sum_k Sa_ik f_k                                   windows at rest
    gyro i            rate_i - w_i   = bg_i + sum_k Sg_ik w_k + sum_k G_ik f_k/g0               all windows

w and f are the means over a window of inertial rate and specific force in axes of the case, from the angles of the
table that were read, the site and the Earth rate; the noise of each instrument (white, Gauss-Markov or both) is
estimated from the same record.  Turns about each axis show the columns of Sg; those that the record does not show are
taken as zero and are a line of the budget.  [IMU-POSITIONS; IEEE 1559]

Not modelled: nonlinearity but for squares of the accelerometers, asymmetry, lever arms (accelerometers are read at
rest), bias that changes other than by a trend or by its noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from gyrobench import frames
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.estimation.nuisances import BOTH
from gyrobench.reduction.estimation.unshown_columns import intervals_with
from gyrobench.reduction.setup.rate_gyro_bias import word_error
from gyrobench.reduction.setup.sources import Source
from gyrobench.reduction.toolkit import (
    Account,
    Array,
    Candidate,
    Coefficient,
    DriftReduction,
    DriftTestResult,
    Effect,
    Findings,
    Group,
    Reason,
    Record,
    Regression,
    RunDocument,
    Table,
    plain,
    window_problems,
)
from gyrobench.units import DPH

from . import geometry, mistakes, table_errors, tables
from .budget import ImuSetup, Kinematics
from .channels import BY_NAME, CHANNELS, UG, overview
from .compensation import truth_of
from .hand import UNKNOWN, HandReduction
from .log import UP_DOWN
from .sources import GYRO_SCALE
from .thermal import Thermal, narrow_temperatures, quantity
from .updown import UpDownReduction

COLUMNS = ("phase", "t_start", "t_end", *geometry.ANGLES, *(f"mean_{c.name}" for c in CHANNELS))
LEAST_SPAN = 3.0  # K, from which on a record is one over temperature
POWERS = ("", "", "²", "³", "⁴")
PRODUCTS = (
    "Products of two components of the specific force, which residuals need not show, widen the intervals. Take more "
    "positions."
)
COUNTS = 0.3  # of u of a bias: an error of a reading that is told
ROUNDING = 1e-9  # of the departures of the readings, which are themselves some 1e-4 of them


class ImuChannel(DriftReduction[ImuSetup]):
    """One gyro or accelerometer; kinematics: those of the record, shared by all."""

    def __init__(self, windows: Mapping[str, Array], setup: ImuSetup, channel: str, kinematics: Kinematics) -> None:
        super().__init__(windows, setup)
        self.channel, self.kinematics = BY_NAME[channel], kinematics
        self.rows = np.ones(kinematics.motion.length.size, dtype=bool)
        if not self.channel.gyro:
            self.rows = kinematics.motion.at_rest
        self.seen = geometry.rates_seen(kinematics.felt[0]) if self.channel.gyro else (0, 1, 2)
        self.thermal: Thermal | None = None
        if setup.thermal:
            bias, scale, width, reference = setup.thermal
            self.thermal = Thermal.of(windows, reference, width, (bias, scale)).rows(self.rows)

    @property
    def scaled(self) -> bool:
        """True where a scale factor over the temperature is shown."""
        return self.channel.axis in self.seen

    def design(self, omega: Array, force: Array, constant: float = 1.0) -> Array:
        """Return the regressors for rates and specific forces (n, 3); constant: of those that follow neither."""
        c = self.channel
        gyro = c.gyro
        columns = geometry.gyro_columns(omega, force, self.seen) if gyro else geometry.accelerometer_columns(force)
        columns[:, 0] = constant
        if self.thermal is None:
            return columns
        bias, scale = self.thermal.columns((omega if c.gyro else force)[:, c.axis], self.scaled)
        return np.column_stack([columns, constant * bias, scale])

    def regression(self) -> Regression:
        s, c, w = self.setup, self.channel, self.windows
        omega, force = (v[self.rows] for v in self.kinematics.felt)
        read = np.asarray(w[f"mean_{c.name}"], dtype=float)[self.rows]
        y = read - (omega if c.gyro else force)[:, c.axis]
        quantities = [c.quantity(n, s.truth or {}) for n in c.names(self.seen)]
        if self.thermal is not None:
            quantities += [quantity(c, *e, s.truth or {}) for e in self.thermal.endings(self.scaled)]
        t0, t1 = (np.asarray(w[n], dtype=float)[self.rows] for n in ("t_start", "t_end"))
        phase = np.asarray(w["phase"], dtype=float)[self.rows]
        shown = [Group(c.words, np.arange(y.size), phase, "number of the phase", "")]
        unit = ("departure of the rate", "°/h", DPH) if c.gyro else ("departure of the specific force", "µg", UG)
        weighed = self._candidates() if s.nuisances else []
        self.model = X, y = self.design(omega, force), y
        return Regression(
            quantities, X, y, t0, t1, shown, *unit, limit=geometry.LIMIT, candidates=weighed,
            ideal=ROUNDING,
        )  # fmt: skip

    def _candidates(self) -> list[Candidate]:
        """Return trend and temperature of the bias, the square of what an accelerometer feels; over temperature the
        power beyond its order.
        """
        c = self.channel
        taken = "temperature" if self.thermal is not None else "-"  # the model has more of it
        rows = {n: np.asarray(v)[self.rows] for n, v in self.windows.items() if not n.startswith(taken)}
        of = nuisances.DRIFT if c.gyro else nuisances.FORCE
        found = [f for f in nuisances.common(rows, f" {c.name}", of) if c.gyro or not f.scatter]
        if not c.gyro:
            own = self.kinematics.felt[1][self.rows, c.axis]
            words = f"square of the specific force in the bias of the {c.words}"
            found.append(Candidate(f"K2_{c.letter}", words, "µg/g²", UG / frames.G0**2, own**2))
        return found if self.thermal is None else [*found, *self._powers(self.thermal, of)]

    def _powers(self, thermal: Thermal, of: nuisances.Read) -> list[Candidate]:
        """Return the powers of bias and scale factor beyond their orders: what a lower one would take for its own."""
        c, (bias, scale) = self.channel, thermal.orders
        own = self.kinematics.felt[0 if c.gyro else 1][self.rows, c.axis]
        kinds = [("b", "bias", bias + 1, of.unit, of.scale, thermal.higher())]
        if self.scaled:
            kinds.append(("S", "scale factor", scale + 1, "ppm", 1e-6, thermal.grown(own)))
        return [
            Candidate(
                f"{kind}{c.kind}T{n if n > 1 else ''}_{c.letter}", f"{word} of the {c.words} by T to the power of {n}",
                f"{unit}/K{POWERS[n]}", size, columns[:, 0],
            )
            for kind, word, n, unit, size, columns in kinds
        ]  # fmt: skip

    def error(self, found: Findings, omega: Array, force: Array) -> Array:
        """Return the error of the data where rate and specific force are other ones by these (n, 3)."""
        c = self.channel
        own = (omega if c.gyro else force)[self.rows, c.axis]
        return found.error(own, -self.design(omega[self.rows], force[self.rows], 0.0))

    def errors(self, found: Findings) -> list[tuple[Source, Array]]:
        """Return each source with what one unit of it does to the data (n,) or (parts, n)."""
        return [
            (source, np.array([self.error(found, *part) for part in zip(omega, force, strict=True)])
             if omega.ndim == 3 else self.error(found, omega, force))
            for source, (omega, force) in self.kinematics.changes
        ]  # fmt: skip

    def effects(self, found: Findings) -> list[Effect]:
        out = [source.effect(self.setup, error) for source, error in self.errors(found)]
        lost = [k for k in range(3) if k not in self.seen]
        if lost:
            names = [f"Sg_{self.channel.letter}{'xyz'[k]}" for k in lost]
            truth = tuple((self.setup.truth or {}).get(n, 0.0) for n in names)
            columns = self.kinematics.felt[0][:, lost].T
            source = GYRO_SCALE.of()
            out.append(source.effect(self.setup, columns, parts=tuple(names), simulated=truth if any(truth) else ()))
        return out

    def test(self, found: Findings) -> None:
        """Add an F test of constants of each phase: errors of single positions, nonlinearity; over temperature those of
        plays of another width, of higher powers, of misalignments that follow it.
        """
        c, phase = self.channel, np.asarray(self.windows["phase"])[self.rows]
        block = np.array([phase == p for p in np.unique(phase)], dtype=float).T
        found.f_test(
            "phases.agree", "constants of the phases", block, "errors of single positions, nonlinearity",
            "the phases differ from the model by more than the noise", "the phases agree within the noise",
        )  # fmt: skip
        if not c.gyro:
            force = self.kinematics.felt[1][self.rows] / frames.G0
            found.f_test(
                "square", "squares of the accelerometers",
                np.column_stack([force**2, self.products]), "quadratic nonlinearity",
                "the readings hold squares of the specific force, which the biases are off by",
                "no squares of the specific force are in the residuals",
            )  # fmt: skip
        if self.thermal is not None:
            found.f_test(
                "hysteresis.width", "hysteresis of another width", self.thermal.others,
                "plays of a third and of three times the width",
                "the hysteresis has another width than is stated (hysteresis_width), or the temperature is late",
                "no hysteresis of another width is in the residuals",
            )  # fmt: skip
            more = "take narrower temperatures, or higher orders"
            omega, force = (v[self.rows] for v in self.kinematics.felt)
            own, seen = (omega if c.gyro else force)[:, c.axis], [k for k in self.seen if k != c.axis]
            found.f_test(
                "thermal.bias", "higher powers of the bias", self.thermal.higher(), "powers beyond bias_order",
                f"the bias follows the temperature by more than powers of this order; {more}",
                "no higher powers of the bias are in the residuals",
            )  # fmt: skip
            if self.scaled:
                found.f_test(
                    "thermal.scale", "other terms of the scale factor", self.thermal.grown(own),
                    "powers beyond scale_order, hysteresis, rate of change",
                    f"the scale factor follows the temperature by more than powers of this order; {more}",
                    "no other terms of the scale factor are in the residuals",
                )  # fmt: skip
            found.f_test(
                "thermal.axes", "axes over the temperature",
                self.thermal.turned(np.column_stack([omega[:, seen], force]) if c.gyro else force[:, seen]),
                "misalignments, g-sensitivity that follow the temperature",
                "misalignments or g-sensitivity change with the temperature, which the model has as constant",
                "misalignments and g-sensitivity do not follow the temperature",
            )  # fmt: skip

    @property
    def products(self) -> Array:
        """Return the products (n, 3) of two components of the specific force, g²."""
        force = self.kinematics.felt[1][self.rows] / frames.G0
        return np.asarray(force * np.roll(force, 1, axis=1))

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Say what the coefficients of an accelerometer may be with products of the specific force, and where too few
        temperatures tell a hysteresis of the scale factor from what it does with T.
        """
        c = self.channel
        if not c.gyro and (intervals := intervals_with(*self.model, self.products, result.coefficients)):
            reason = Reason("products.with", PRODUCTS, BOTH, severity="condition", intervals=intervals)
            result = replace(result, reasons=[*result.reasons, reason])
        own = self.kinematics.felt[0 if c.gyro else 1][self.rows, c.axis]
        if self.thermal is None or not self.scaled or self.thermal.told(own, self.found.X):
            return result
        text = (
            f"A scale factor of the {c.words} that has a hysteresis, or follows the rate of change of the temperature, "
            "is not told from its powers by so few temperatures: these may be off by more than u. Take more cycles, "
            "half of them while it is heated and half while it is cooled."
        )
        names = tuple(k.name for k in result.coefficients if k.name.startswith("S") and k.name[-1] == c.letter)
        return replace(result, reasons=[*result.reasons, Reason("thermal.few", text, BOTH, names)])

    def account(self, found: Findings) -> Account:
        c, s = self.channel, self.setup
        if c.gyro:
            equation = (
                f'omega_"read,{c.letter}" - omega_{c.letter} = b_g + sum_k S_(g,k) omega_k + sum_k G_k f_k \\/ g_0'
            )
        else:
            equation = f'f_"read,{c.letter}" - f_{c.letter} = b_a + sum_k S_(a,k) f_k'
        more = [
            "Scale factors are those at the forces of the positions, up to 1 g: a cubic is in them and not in their "
            "uncertainties; vibration_rectification shows it."
        ]
        if c.gyro:
            more = [
                "Scale factors are those at the rates of the turns: what of them changes with the rate is in them and "
                "not in their uncertainties; rate_table_test shows it."
            ]
        if self.thermal is not None:
            equation += " + sum_n b_n T^n + b_H z + b_R dot(T) + sum_n s_n T^n times upright(input)"
            more += [
                "T: temperature above that of the coefficients, even within a window; z: a play within −1 … 1, 1 while "
                "it rises; the last terms are those of bias and scale factor over the temperature [IMU-THERMAL]."
            ]
        return Account(
            method="Positions and turns of an inertial measurement unit on a table with two axes; least squares of "
            "each instrument under an estimated noise model [IMU-POSITIONS]",
            sources=[
                "IMU-POSITIONS; IEEE 1559 (terms); Tedaldi 2014 (model of a triad)",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation=equation,
            conventions=[
                "Coefficients are departures of the readings: reading = input + bias + matrix · input.",
                "Specific force f = a − g: an axis that points up reads +1 g; g0 = 9.80665 m/s².",
                "Axes x, y, z of the case are those of the plate, which carries it; local frame east, north, up; outer "
                "table axis level and east, table angles right-handed.",
                f"Gravity {s.gravity:.6f} m/s² and Earth rate are taken as known; the accelerometers are read at rest.",
                *more,
            ],
            reasons=[Reason("rates.unseen", t) for t in geometry.unseen_rates(self.seen)] if c.gyro else [],
            random="noise of the instrument",
        )  # fmt: skip

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence(), *found.nuisance_sentences()]


class Reduction(ChannelTests[ImuSetup]):
    """Three gyros and three accelerometers from windows with :data:`COLUMNS`, SI."""

    handling = staticmethod(mistakes.candidates)
    names = tuple(c.name for c in CHANNELS)
    label = "{}"

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says, of attitudes that the table reads or of unknown ones."""
        if record.run.options.get("attitudes") == UNKNOWN:
            return HandReduction.of_record(record)
        if record.run.options.get("attitudes") == UP_DOWN:
            return UpDownReduction.of_record(record)
        return super().of_record(record)

    @classmethod
    def from_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says.  Attitudes that nobody states are not mistaken where a value is near the Earth
        rate, and half of up less down should be near it.
        """
        result = super().from_record(record)
        if record.run.options.get("attitudes", "table") == "table":
            return result
        return replace(result, reasons=[r for r in result.reasons if r.id != "plausibility.earth_rate"])

    @classmethod
    def setup_of(cls, run: RunDocument) -> ImuSetup:
        return ImuSetup.of(run, truth=None if run.measured else truth_of(run.parameters))

    @cached_property
    def kinematics(self) -> Kinematics:
        return Kinematics(self.windows, self.setup)

    def of_channel(self, name: str) -> DriftReduction[ImuSetup]:
        return ImuChannel(self.windows, self.setup, name, self.kinematics)

    def problems(self) -> list[str]:
        s = self.setup
        if problems := s.site_problems() + window_problems(self.windows, COLUMNS):
            return problems
        force = self.kinematics.felt[1][self.kinematics.motion.at_rest]
        if problems := geometry.force_problems(_places(force) / s.gravity):
            return problems
        if s.thermal and "temperature" not in self.windows:
            return ["thermal = true: the record has no column temperature [degC]"]
        if s.thermal and (span := float(np.ptp(self.windows["temperature"]))) < LEAST_SPAN:
            return [
                f"thermal = true: the temperature changes by {plain(span, 3)} K in all, which shows nothing of it: was "
                "that of the room read, or of a chamber that stood still?"
            ]
        return self._mistaken()

    def _mistaken(self) -> list[str]:
        """Return what the matrices of the triads say of columns, signs and units."""
        omega, force = self.kinematics.felt
        rest = self.kinematics.motion.at_rest
        found = []
        read = {k: np.array([self.windows[f"mean_{k}{a}"] for a in "xyz"], dtype=float).T for k in "ag"}
        X = geometry.accelerometer_columns(force[rest])
        found += mistakes.triad_problems(np.linalg.lstsq(X, read["a"][rest], rcond=None)[0][1:4].T, "a")
        seen = geometry.rates_seen(omega)
        if len(seen) == 3:
            X = geometry.gyro_columns(omega, force, seen)
            found += mistakes.triad_problems(np.linalg.lstsq(X, read["g"], rcond=None)[0][1:4].T, "g")
        return found

    def overview(self, results: Mapping[str, DriftTestResult]) -> list[str]:
        """Return the largest of each kind."""
        return overview([c for r in results.values() for c in r.coefficients])

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        return tables.tables(coefficients)

    def result(self) -> DriftTestResult:
        found = super().result()
        off = table_errors.reasons(
            self.each, self.setup, lambda setup, name: ImuChannel(self.windows, setup, name, self.kinematics)
        )
        off += [*narrow_temperatures(self.windows, self.setup, found.coefficients), *self._words(found)]
        by_position = tables.by_position(self.windows, self.kinematics.motion, found)
        return replace(found, tables=[*found.tables, by_position], reasons=[*found.reasons, *off])

    def _words(self, found: DriftTestResult) -> list[Reason]:
        """Return that words of simulated accelerometers are not dithered by their noise, as far as it counts."""
        off = word_error(self.setup.parameters, "accelerometers")
        biases = [c for c in found.coefficients if c.name.startswith("ba_")]
        if not off > COUNTS * min((c.u * UG for c in biases), default=math.inf):
            return []
        text = (
            f"The words of the accelerometers are larger than their noise: a reading at rest is off by {off / UG:.0f} "
            "µg rms, alike in all windows of a position, which u holds in part."
        )
        return [Reason("accelerometers.words", text, BOTH, severity="doubt")]


def _places(force: Array) -> Array:
    """Return the different directions (n, 3) of specific forces, some arc minutes apart at least."""
    keys = np.round(force / np.linalg.norm(force, axis=1)[:, None] * 500.0)
    return np.asarray(force[np.sort(np.unique(keys, axis=0, return_index=True)[1])])


reduce = Reduction.reduce
