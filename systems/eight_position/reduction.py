"""Reduction of the eight-position test: scale factors, constant drifts and unbalances of both channels.

As in Hu 1981 the readings of a position are averaged to one datum of the cycle (with fewer than four cycles each
reading is a datum).  The data are rows of two fits, current about x and current about y, under a noise model estimated
from the same record; with six unknowns a channel the estimates are its closed formulas whenever all positions
weigh alike.  Repeats on several days are reduced day by day and then together.
[TEST-8POS, POS8-MODEL+REDUCE, POS8-LS; Hu 1981, eq. 3-1..3-11, Table 3-1, corrected by E17-E19]

Not modelled: products of two components of gravity (no position shows them), drift that changes over the cycles
otherwise than evenly or as noise, motion between the positions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from gyrobench import frames, units
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.drift import drift_terms
from gyrobench.reduction.drift.pulses import CurrentWindows, Pulses
from gyrobench.reduction.estimation import nuisances, residual_series
from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.estimation.effects import one_by_one
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.repeatability import reduce_days
from gyrobench.reduction.setup.run_metadata import phases, truth_of
from gyrobench.reduction.setup.sources import LATITUDE, TURNED, Effect, Source
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.reduction.toolkit import Account, Array, Candidate, DriftReduction, Findings, Group, Record, plain, told
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table
from gyrobench.units import DPH

from . import model, positions, refusals, tables
from .model import EightPositionSetup

ATTITUDE = Source(
    "position.attitude", "attitude of each position", "rad", "u_attitude",
    "about each axis, the positions independent of one another",
)  # fmt: skip
IN_FIXTURE = {n: replace(TURNED[n], name=f"{TURNED[n].name} in the fixture") for n in "xyz"}
AVERAGED = 4  # cycles from which on the readings of a position are averaged first
COLUMNS = ("position", "cycle", "t_start", "t_end", "mean_x", "mean_y")
ALONE = {"x": ("1", "3"), "y": ("2", "4")}  # positions whose difference is the scale factor
SHORT = (
    'k_x I_x = omega_y - R_x + u_"zx" gamma_y - u_y gamma_z{x} \\ '
    'k_y I_y = omega_x + R_y + u_"zy" gamma_x - u_x gamma_z{y}'
)
LONG = {"x": " - q_y gamma_y^2 - s_y gamma_x", "y": " - q_x gamma_x^2 - s_x gamma_y"}


class CurrentChannel(DriftReduction[EightPositionSetup]):
    """One current, of the torquer about ``channel``, which measures the drift about the other axis."""

    def __init__(self, windows: Mapping[str, Array], setup: EightPositionSetup, channel: str) -> None:
        super().__init__(windows, setup)
        self.channel = channel
        self.elsewhere = drift_terms.elsewhere({"x": "y", "y": "x"}[channel])

    def regression(self) -> Regression:
        c, s, w = self.channel, self.setup, self.windows
        data = w if np.unique(w["cycle"]).size < AVERAGED else averaged(w)
        self.position = position = np.asarray(data["position"]).astype(int)
        current, t0, t1 = (np.asarray(data[n], dtype=float) for n in (f"mean_{c}", "t_start", "t_end"))
        spread = np.asarray(data.get(f"std_{c}", np.zeros_like(current)), dtype=float)
        self.read = CurrentWindows(current, spread, t1 - t0)
        d = model.directions(position, s.latitude)
        self.linear = model.linear(c, current, d, s)
        self.wanted = model.quantities(c, s, closed_formulas(w, s))
        order = np.argsort(position, kind="stable")
        jitter = 0.4 * (np.arange(position.size) / max(position.size - 1, 1) - 0.5)  # side by side, by time
        shown = Group(f"current about {c}", order, (position + jitter)[order], "position", "")
        steps = ["k − k0", *(q.name for q in self.wanted[1:])]
        weighed = self._candidates(data, d) if s.nuisances else ()
        return Regression(steps, self.linear.X, self.linear.y, t0, t1, [shown], candidates=weighed)

    def _candidates(self, data: Mapping[str, Array], d: Array) -> list[Candidate]:
        """Return set-up effects of a current: misalignment of its measuring axis towards the other one, trend,
        temperature, asymmetry of its torquer, constants of the turn-ons and, where the single readings are data, of the
        standings.

        Readings averaged by position and cycle hold one datum of each standing, whose scatter is in their white noise.
        """
        s, c, lin = self.setup, self.channel, self.linear
        axes = "yx" if c == "x" else "xy"  # the current about x measures the y channel
        across = s.earth_rate * d[:, 0, "xyz".index(axes[1])]
        text = f"misalignment of the {axes[0]} axis towards the {axes[1]} axis"
        found = [Candidate.of(f"ε_{axes}", text, "arcsec", -across), *nuisances.common(data, f",{c}")]
        found.append(nuisances.torquer(lin.k0 * lin.X[:, 0], c)[0])  # the scale factor is a result
        standing = list(zip(np.asarray(data["cycle"]).tolist(), self.position.tolist(), strict=True))
        if len(set(standing)) < len(standing):
            found.append(nuisances.scatter("mount", standing, f",{c}"))
        return found

    def effects(self, found: Findings) -> list[Effect]:
        """Return all sources with their sensitivities; sizes come from the setup and may be 0.

        An attitude error turns the gyro by a small angle about one of its axes in one position (independent: the
        squares of the eight add up; an error of the index head is one of them) or in all of them (mount).  Largest: W
        eps, 7.3e-4 deg/h for 10 arcsec.  A latitude stated too large by delta changes k by -tan(latitude) delta
        relative.  Not modelled: products of gravity components that an attitude error lets in (D_xy eps and the like),
        drift of the meters.
        """
        c, s, lin, position, current = self.channel, self.setup, self.linear, self.position, self.read.mean
        pulses, every = s.pulses.get(c), tuple(positions.ATTITUDES)
        wrong = {a: model.turned(a, model.SMALL, every) for a in "xyz"}
        turns = {a: model.attitude_error(c, s, found, lin, position, w) / model.SMALL for a, w in wrong.items()}
        d0, d1 = (model.directions(position, x) for x in (s.latitude, s.latitude + model.SMALL))
        dw = model.rate(c, d1, s.earth_rate) - model.rate(c, d0, s.earth_rate)
        full = float(np.max(np.abs(current))) or 1.0
        offset = found.error(-lin.k0)
        _, nonlinearity, zero, resolution = drift_terms.torquer_sources(
            c, f"{plain(full * 1e3, 3)} mA"
        )  # the scale factor is a result
        parts = tuple(f"position {n} about {axis}" for axis in turns for n in np.unique(position))
        return [
            ATTITUDE.effect(s, np.vstack([one_by_one(turn, position) for turn in turns.values()]), parts=parts),
            *(IN_FIXTURE[axis].effect(s, turn) for axis, turn in turns.items()),
            LATITUDE.effect(s, found.error(dw) / model.SMALL),
            zero.effect(s, offset),
            resolution.effect(s.quantum.get(c, 0.0) / math.sqrt(12.0), offset),
            nonlinearity.effect(s, found.error(-lin.k0 * current * np.abs(current) / full)),
            *(pulses.effects(found, lin.k0, self.read, s, c) if pulses else ()),
        ]

    def test(self, found: Findings) -> None:
        each = [(self.position == n).astype(float) for n in tables.left_over(self.channel, self.setup.terms)]
        found.f_test(
            "positions.agree", "positions", np.column_stack(each),
            "differences between positions that the model does not hold",
            "the positions differ by more than the model and the noise: attitude errors or terms left out",
            "the model explains all eight positions",
        )  # fmt: skip

    def finished(self, found: Findings, effects: Sequence[Effect]) -> DriftTestResult:
        """Return the result with k in place of k - k0."""
        found, c = model.reported(found, self.wanted, self.setup, self.linear.k0), self.channel
        k, u = float(found.value[0]), float(found.u[0])
        if abs(k) < 3.0 * u:
            a, b = ALONE[c]
            raise ReductionError(
                f"I_{c}{a} = I_{c}{b} within the noise: no scale factor k_{c} (relative uncertainty "
                f"{plain(u / abs(k))}); longer readings or a lower latitude are needed"
            )
        return super().finished(found, self.all_effects(found))

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Return the result with Allan deviation and spectrum within the positions, from the single readings less their
        position's mean.
        """
        w, off = self.windows, np.zeros(len(self.windows["position"]))
        k = result[f"k_{self.channel}"].estimate * units.factor("deg/h/mA")
        current, position = np.asarray(w[f"mean_{self.channel}"], dtype=float), np.asarray(w["position"]).astype(int)
        for n in positions.ATTITUDES:
            off[position == n] = -k * (current[position == n] - np.mean(current[position == n])) / DPH
        if float(np.max(np.abs(off))) < 1e-9:  # ideal data
            return result
        parts = residual_series.stretches(np.asarray(w["t_start"], float), np.asarray(w["t_end"], float), off)
        allan, psd = residual_series.allan(parts), residual_series.spectrum(parts)
        return replace(
            result,
            allan=None if allan is None else replace(allan, unit="°/h"),
            psd=None if psd is None else replace(psd, unit="(°/h)²/Hz"),
        )

    def account(self, found: Findings) -> Account:
        s, true = self.setup, model.truth(self.setup)
        left = [n for n in model.EXTRA[self.channel] if s.terms == 4 and true.get(n, 0.0) != 0.0]
        text = f"{', '.join(left)} simulated but not in the 4-term model: the others are biased; terms=6 has them."
        return Account(
            method="Torque rebalance of both channels in eight positions; least squares over all cycles under an "
            "estimated noise model [TEST-8POS]",
            sources=[
                "TEST-8POS, POS8-MODEL+REDUCE; Hu 1981, eq. 3-1..3-11, corrected by E17, E18",
                "POS8-LS, POS8-QUAD; GYRO-STATIC-2DOF; Hu 1981, eq. 2-29..2-46, corrected by E7-E9",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation="",
            conventions=_conventions(s),
            closed_caption="Mean of the readings of each position in the corrected formulas 3-10, 3-11",
            reasons=[Reason("drift.left_out", text)] if left else [],
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence("readings"), *found.nuisance_sentences()]


class Reduction(ChannelTests[EightPositionSetup]):
    """Both currents from readings in the order of time, columns :data:`COLUMNS`: position (1..8), mean_x, mean_y (A,
    about x and y); flagged_x, flagged_y are optional.
    """

    handling = staticmethod(handling_candidates.positions)
    channel = CurrentChannel
    label = "{}"

    @classmethod
    def setup_of(cls, run: RunDocument) -> EightPositionSetup:
        known = all(f"gyro.{n}" in run.parameters for n in ("Dx_0", "Dy_0"))
        return EightPositionSetup.of(
            run,
            terms=int(run.options.get("terms", 6)),
            sigma=bool(run.options.get("sigma", True)),
            truth=truth_of(run, model.TRUE) if known else None,
            quantum={c: float(run.parameters.get(f"rebalance_{c}.resolution", 0.0)) for c in "xy"},
            pulses={c: Pulses.of(run, f"rebalance_{c}") for c in "xy"},
        )

    def equation(self) -> str:
        return SHORT.format(**LONG) if self.setup.terms == 6 else SHORT.format(x="", y="")

    def problems(self) -> list[str]:
        s, w = self.setup, self.windows
        found = refusals.latitude(s.latitude) + frames.gravity_problems(s.gravity)
        if s.terms not in (4, 6):
            found.append(f"terms = {s.terms}: no such model; a channel has 4 or 6 unknowns")
        missing = [n for n in COLUMNS if n not in w]
        if missing:
            return [*found, f"column {', '.join(missing)} is missing"]
        still = np.zeros(len(w["position"]))
        for c in "xy":
            rows = {"phase": w["position"], "t_start": w["t_start"], "t_end": w["t_end"], "angle_start": still,
                    "angle_end": still, "mean": w[f"mean_{c}"]}  # fmt: skip
            if f"flagged_{c}" in w:
                rows["flagged"] = w[f"flagged_{c}"]
            found += [p for p in (f"{c} current: {p}" for p in window_problems(rows)) if p not in found]
        position, cycle = (np.asarray(w[n]).astype(int) for n in ("position", "cycle"))
        return found or refusals.record(position, cycle, s.sigma)

    def result(self) -> DriftTestResult:
        position, cycle = (np.asarray(self.windows[n]).astype(int) for n in ("position", "cycle"))
        mean = {c: np.asarray(self.windows[f"mean_{c}"], dtype=float) for c in "xy"}
        self.readings = tables.PositionReadings(position, cycle, mean, self.setup)
        return replace(super().result(), repeatability=self.readings.repeatability())

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        return self.readings.tables(coefficients)

    def reasons(self) -> list[Reason]:
        return [Reason("latitude.weak", text) for text in refusals.near_pole(self.setup.latitude)]

    def overview(self, results: Mapping[str, DriftTestResult]) -> list[str]:
        every = [c for r in results.values() for c in r.coefficients]
        unbalances = [c for c in every if c.name in ("u_x", "u_y", "u_zx", "u_zy")]
        worst = max(sorted(unbalances, key=lambda c: c.name), key=lambda c: abs(c.estimate)).name
        return told(
            every,
            "Scale factors k_x = {k_x}, k_y = {k_y}.",
            "Constant terms R_x = {R_x}, R_y = {R_y}.",
            f"Largest unbalance {worst} = {{{worst}}}.",
        )

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        """Return what a record says, of one day or of several; a plan row names the position as its face.

        Raises ReductionError for a face that is no position.
        """
        setup, plan = cls.setup_of(record.run), phases(record.run, positions.NUMBERS)
        place, turn, seen = {}, {}, dict[tuple[str, int], int]()
        for phase, row in plan.items():
            key = row.day, positions.NUMBERS[row.face]
            seen[key] = seen.get(key, 0) + 1
            place[phase], turn[phase] = key[1], row.cycle or seen[key]
        of_rows = np.asarray(record.windows["phase"]).astype(int).tolist()
        if stray := sorted(set(of_rows) - set(place)):
            raise ReductionError(f"phase {', '.join(map(str, stray))} is in the record, but not in its plan")
        if not of_rows:
            raise ReductionError("the record holds no windows")
        columns = {n: np.array([of[p] for p in of_rows]) for n, of in (("position", place), ("cycle", turn))}
        numbered = Record({**record.windows, **columns}, {}, record.run)
        return reduce_days(numbered, lambda windows: cls.reduce(windows, setup))


def closed_formulas(windows: Mapping[str, Array], s: EightPositionSetup) -> dict[str, float]:
    """Return the formulas of Hu 1981 of all readings; empty where they divide by zero (the fit says why)."""
    position = np.asarray(windows["position"]).astype(int)
    by = {c: positions.means(position, np.asarray(windows[f"mean_{c}"], dtype=float)) for c in "xy"}
    try:
        return positions.closed(by["x"], by["y"], s.earth_rate, s.latitude)
    except ZeroDivisionError:
        return {}


def averaged(windows: Mapping[str, Array]) -> dict[str, Array]:
    """Return the readings of each position in each cycle as one, weighted by their length."""
    keys = np.stack([np.asarray(windows[n]).astype(int) for n in ("cycle", "position")], axis=1)
    _, first, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    t0, t1 = (np.asarray(windows[n], dtype=float) for n in ("t_start", "t_end"))
    means = ["mean_x", "mean_y", *(n for n in windows if n.startswith(("std_", "temperature", "turn_on")))]
    found: dict[str, list[float]] = {n: [] for n in ("cycle", "position", "t_start", "t_end", *means)}
    for k in np.argsort(first):
        mine = np.flatnonzero(group.ravel() == k)
        found["cycle"].append(int(keys[mine[0], 0]))
        found["position"].append(int(keys[mine[0], 1]))
        found["t_start"].append(float(t0[mine].min()))
        found["t_end"].append(float(t1[mine].max()))
        for n in means:
            found[n].append(float(np.average(windows[n][mine], weights=(t1 - t0)[mine])))
    return {n: np.array(v) for n, v in found.items()}


def _conventions(s: EightPositionSetup) -> list[str]:
    empirical = " Empirical Dx_yy and Dy_xx are folded into R, u and the g² differences." if s.terms == 6 else ""
    return [
        "γ = (γ_x, γ_y, γ_z) is the unit vector of gravity (down) in gyro axes x (outer gimbal), y (inner gimbal), z "
        "(spin); coefficients u are at the local g.",
        "Currents: positive current precesses positively, k_x I_x = ω_y − ω_dy and k_y I_y = ω_x − ω_dx with the drift "
        "ω_d in precession sign; the current about x measures the y channel.",
        "R_x = M_x/H is the drift about y, R_y = M_y/H minus that about x.",
        "The scale factors come from the Earth's rate, W cos φ, and from nothing else.",
        "Compliance: k, R, u_zx and u_zy are free of it; u_x holds −K_xz g², u_y −K_yz g² (z is only "
        f"seen with gravity along −z).{empirical}",
        *(["4-term model: differences of g² terms and cross unbalances are taken as zero."] if s.terms == 4 else []),
    ]
