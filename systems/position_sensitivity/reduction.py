"""Reduction of the position sensitivity test: stiffness of the suspension in each channel, from currents and angles.

    x channel   omega_x - k_y i_y - omega_z psi_y = omega_dx + Kx_q psi_y - Kx_phi psi_x + noise
    y channel   omega_y - k_x i_x + omega_z psi_x = omega_dy - Ky_q psi_x - Ky_phi psi_y + noise      psi = -u / K_sg

omega: Earth rate along the gyro's axes.  The rotor stands still in the case, so that the rate about the spin axis turns
with the angle as a spring does; it is known and taken out.  [TEST-POSITION, GYRO-POSITION; Hu 1981, eq. 5-68]

The springs are harmless where they leave a tenth of the accuracy: psi < 0.1 a / kappa, kappa2 = K_q2 + K_phi2.  A loop
without integral leaves psi = omega / (k K_sg K_p), which asks for the gain; one with an integral leaves the null of its
pickoff.  Hu 1981 asks for 1 arcsec at Earth rate, a gain of 15.0 1/s.

Not modelled: drift per g that the angle turns (1e-4 of it at 20 arcsec), springs that are not linear.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.diagnosis import handling_candidates
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.channel_tests import ChannelTests
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.run_metadata import number, truth_of
from gyrobench.reduction.setup.setups import SiteSetup, attitude_of, scale_factor_problems
from gyrobench.reduction.setup.sources import CURRENT_OFFSET_OF, TORQUER_SCALE_OF, TURNED, Effect
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Findings, Group, Quantity, Regression, told
from gyrobench.result import Coefficient, DriftTestResult, Table
from gyrobench.units import ARCSEC, DPH

from .sources import PICKOFF

COLUMNS = ("t_start", "t_end", "mean_x", "mean_y", "u_x", "u_y")
OTHER = {"x": "y", "y": "x"}
LEAST = 9  # readings
SHARE = 0.1  # of the accuracy that the springs may take
SMALL = 1e-5  # rad


@dataclass(frozen=True, kw_only=True)
class PositionSetup(SiteSetup):
    """attitude: rows x, y, z in (E, N, U).  k, K_sg: by axis, rad/s/A and V/rad.  K_p, K_i: of the loop that feeds the
    torquer about an axis; none where unknown.  accuracy: drift that matters, rad/s.
    """

    attitude: Array
    k: Mapping[str, float]
    K_sg: Mapping[str, float]
    accuracy: float
    K_p: Mapping[str, float] = field(default_factory=dict)
    K_i: Mapping[str, float] = field(default_factory=dict)

    @property
    def earth(self) -> Array:
        """Earth rate along x, y, z, rad/s."""
        return np.asarray(self.attitude @ frames.earth_rate_local(self.latitude, self.earth_rate))


class PositionChannel(DriftReduction[PositionSetup]):
    """One channel, with the current of the torquer about the other axis."""

    def __init__(self, windows: Mapping[str, Array], setup: PositionSetup, channel: str) -> None:
        super().__init__(windows, setup)
        self.channel, self.torquer = channel, OTHER[channel]
        self.row = "xyz".index(channel)
        self.psi = {a: -np.asarray(windows[f"u_{a}"], dtype=float) / setup.K_sg[a] for a in "xy"}
        self.current = np.asarray(windows[f"mean_{self.torquer}"], dtype=float)

    def names(self) -> tuple[str, str, str]:
        c = self.channel
        return f"ω_d{c}", f"K{c}_q", f"K{c}_φ"

    def columns(self) -> Array:
        """Return the regressors (n, 3) of drift, quadrature and in-phase stiffness."""
        sign, own, across = (1.0, "x", "y") if self.channel == "x" else (-1.0, "y", "x")
        return np.column_stack([np.ones_like(self.current), sign * self.psi[across], -self.psi[own]])

    def regression(self) -> Regression:
        s, c, X = self.setup, self.channel, self.columns()
        k, w = s.k[self.torquer], s.earth
        y = w[self.row] - k * self.current - w[2] * X[:, 1]
        t0, t1 = (np.asarray(self.windows[n], dtype=float) for n in ("t_start", "t_end"))
        true = s.truth or {}
        drifting, q, phi = self.names()
        quantities = [
            Quantity.of(drifting, f"composite drift of the {c} channel at null", "deg/h", true.get(drifting)),
            Quantity.of(q, f"quadrature stiffness, {c} channel", "1/s", true.get(q)),
            Quantity.of(phi, f"in-phase stiffness, {c} channel", "1/s", true.get(phi)),
        ]
        candidates = nuisances.common(self.windows) if s.nuisances else ()
        return Regression(quantities, X, y, t0, t1, self._groups(), candidates=candidates)

    def _groups(self) -> list[Group]:
        """Return the readings with the rotor off null about the channel's own axis, and the others, over that angle."""
        own = np.abs(self.psi[self.channel])
        off = own > 0.5 * float(own.max())
        each = ((OTHER[self.channel], ~off), (self.channel, off))
        return [
            Group(f"off null about {a}", np.flatnonzero(rows), self.psi[a][rows] / ARCSEC, f"angle about {a}", "″")
            for a, rows in each
            if rows.any()
        ]

    def effects(self, found: Findings) -> list[Effect]:
        s, k, turned = self.setup, self.setup.k[self.torquer], []
        for j, axis in enumerate("xyz"):
            R = frames.rotation(np.eye(3)[j], SMALL).T @ s.attitude
            rate = float((R[self.row] - s.attitude[self.row]) @ frames.earth_rate_local(s.latitude, s.earth_rate))
            source = replace(TURNED[axis], option="u_attitude", note="the Earth's rate only")
            turned.append(source.effect(s, found.error(-rate / SMALL)))
        stretched = self.columns() * np.array([0.0, 1.0, 1.0])
        full = f"{plain(float(np.max(np.abs(self.current))) * 1e3, 3)} mA"
        return [
            *turned,
            PICKOFF.effect(s, found.error(-s.earth[2] * stretched[:, 1], stretched)),
            TORQUER_SCALE_OF.of(axis=self.torquer, full=full).effect(s, found.error(-k * self.current)),
            CURRENT_OFFSET_OF.of(axis=self.torquer, full=full).effect(s, found.error(-k)),
        ]

    def account(self, found: Findings) -> Account:
        c, o = self.channel, self.torquer
        sign = ("+", "-") if c == "x" else ("-", "+")
        return Account(
            method="Currents of both rebalance loops at angles off null, gyro at rest; least squares of each channel "
            "under an estimated noise model [TEST-POSITION]",
            sources=[
                "TEST-POSITION, GYRO-POSITION; Hu 1981, eq. 5-67, 5-68",
                "RED-GLS; Hu 1981, eq. 4-79..4-88, corrected by ER23",
            ],
            equation=f"omega_{c} - k_{o} i_{o} {sign[1]} omega_z psi_{o} = "
            f'omega_"d{c}" {sign[0]} K_"{c}q" psi_{o} - K_"{c}φ" psi_{c}',
            conventions=[
                "ψ: angle of the rotor axis against the case, −u/K_sg of the pickoff; the current i_y measures the x "
                "channel and i_x the y channel.",
                "1 /s is 1 °/h for each arcsec.",
            ],
        )

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence("readings"), *found.nuisance_sentences()]


class Reduction(ChannelTests[PositionSetup]):
    """Both channels from windows with :data:`COLUMNS`, and what they ask of the loops."""

    handling = staticmethod(handling_candidates.at_rest)
    channel = PositionChannel

    @classmethod
    def setup_of(cls, run: RunDocument) -> PositionSetup:
        p = run.parameters
        k = {a: number(run, f"k_{a}", f"gyro.k_{a}", f"scale factor of the torquer about {a}") for a in "xy"}
        K_sg = {a: number(run, f"K_sg_{a}", f"gyro.K_sg_{a}", f"gain of the {a} pickoff") for a in "xy"}
        loops = {
            n: {a: float(p[f"rebalance_{a}.{n}"]) for a in "xy" if f"rebalance_{a}.{n}" in p} for n in ("K_p", "K_i")
        }
        made = PositionSetup.of(
            run, attitude=attitude_of(run), k=k, K_sg=K_sg, accuracy=float(run.options["accuracy"]), **loops
        )
        return replace(made, truth=true_values(run, made))

    def problems(self) -> list[str]:
        s, w = self.setup, self.windows
        still = np.zeros(len(w.get("t_start", ())))
        problems = s.site_problems()
        problems += [text for a, k in s.k.items() for text in scale_factor_problems(k, f"k_{a}")]
        problems += [f"K_sg_{a} = {v:g} V/rad: must be > 0" for a, v in s.K_sg.items() if not v > 0.0]
        problems += window_problems({"phase": still, "angle_start": still, "angle_end": still, **w}, COLUMNS)
        if problems:
            return problems
        if still.size < LEAST:
            return [f"{still.size} readings: at least {LEAST} are needed"]
        return [
            f"u_{a} is the same in all readings: hold the rotor at several angles about {a}"
            for a in "xy"
            if float(np.ptp(np.asarray(w[f"u_{a}"], dtype=float))) <= 1e-12
        ]

    def tables(self, coefficients: Sequence[Coefficient]) -> list[Table]:
        """Return what angle and loop gain the springs allow, and what the loops have."""
        s, by_name = self.setup, {c.name: c for c in coefficients}
        rows: list[list[Any]] = []
        for c in "xy":
            q, phi = by_name[f"K{c}_q"], by_name[f"K{c}_φ"]
            most = math.hypot(*(max(map(abs, x.interval)) for x in (q, phi)))
            allowed = SHARE * s.accuracy / most if most > 0.0 else None
            gain = None if allowed is None else s.earth_rate / allowed
            rows.append(
                [c, math.hypot(q.estimate, phi.estimate), most, None if allowed is None else allowed / ARCSEC, gain]
            )
        caption = (
            f"A tenth of {plain(s.accuracy / DPH, 3)} °/h is left to the springs, at the upper end of their intervals; "
            "the gain is that of a loop without integral, at Earth rate"
        )
        head = ["channel", "κ / (1/s)", "κ, upper end / (1/s)", "angle allowed / ″", "loop gain needed / (1/s)"]
        found = [Table("springs.allowed", "What the springs allow", caption, head, rows)]
        return [*found, *self._loops([row[2] for row in rows])]

    def _loops(self, most: Sequence[float]) -> list[Table]:
        """Return the gain of each loop, the angle that it leaves at Earth rate, and the drift of that."""
        s, rows = self.setup, list[list[Any]]()
        if set(s.K_p) != {"x", "y"}:
            return []
        for c in "xy":
            o = OTHER[c]
            gain = s.k[o] * s.K_sg[c] * s.K_p[o]
            integral = s.K_i.get(o, 0.0) > 0.0
            if not gain > 0.0:
                continue
            angle = 0.0 if integral else s.earth_rate / gain
            within = "yes" if angle <= ARCSEC else "no"
            rows.append([c, gain, "yes" if integral else "no", angle / ARCSEC, max(most) * angle / DPH, within])
        need = s.earth_rate / ARCSEC
        caption = (
            "k K_sg K_p of the loop that nulls the pickoff; Hu 1981 asks for 1″ at Earth rate, a gain of "
            f"{plain(need, 3)} 1/s without integral; with one the angle that stays is the null of the pickoff"
        )
        head = [
            "pickoff", "loop gain / (1/s)", "integral", "angle at Earth rate / ″", "drift of it / (°/h)", "within 1″",
        ]  # fmt: skip
        return [Table("springs.loops", "The loops", caption, head, rows)]

    def overview(self, results: Mapping[str, DriftTestResult]) -> list[str]:
        every = [c for r in results.values() for c in r.coefficients]
        stiff = "Quadrature stiffness {Kx_q} and {Ky_q}, in phase {Kx_φ} and {Ky_φ}."
        return told(every, stiff, "Composite drift at null {ω_dx} and {ω_dy}.")


def true_values(run: RunDocument, s: PositionSetup) -> dict[str, float] | None:
    """Return the true values of a simulated gyro; its drift at the null of the pickoffs has the springs in it."""
    p = truth_of(run, ("K_q", "K_phi", "null_x", "null_y"))
    if p is None or "K_q" not in p:
        return None
    q, phi = p["K_q"], p["K_phi"]
    xyz = s.attitude @ -frames.U * s.gravity / frames.G0
    static = {c: truth_of(run, drift.NAMES_2DOF[c]) or {} for c in "xy"}
    null = {a: p.get(f"null_{a}", 0.0) for a in "xy"}
    across = q + float(s.earth[2])  # angles count from the null of the pickoff: the rate about z turns with it too
    springs = {"x": across * null["y"] - phi * null["x"], "y": -across * null["x"] - phi * null["y"]}
    found = {f"ω_d{c}": float(drift.drift(xyz, static[c])) + springs[c] for c in "xy"}
    return found | {f"K{c}_q": q for c in "xy"} | {f"K{c}_φ": phi for c in "xy"}
