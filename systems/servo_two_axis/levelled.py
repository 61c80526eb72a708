"""Both table angles kept at 0 by the torquers: one composite drift in each mount and channel.  [SERVO2-LEVELLED]

    omega_x - k_y i_y = omega_dx        omega_y - k_x i_x = omega_dy        omega: inertial rates of eq. 3-97

The gyro stands still against the Earth, so that the regular part of its drift is constant and the torquers' rate is the
Earth's less the drift (Hu 1981, section 3.3 item 6-3); mean, scatter and correlation are those of eq. 3-91..3-93.  The
motion of the table that is left is in the data.  What the current is made of, a constant or an angle, is all the same.

Not modelled: change of the drift with the angles that are left, within :data:`LIMIT`: the composite drift is that at
their means.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gyrobench import drift
from gyrobench.reduction.drift import composite, drift_terms
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Effect, Findings, Quantity, Regression, plain
from gyrobench.result import Coefficient, Table
from gyrobench.units import DPH

from . import budget

if TYPE_CHECKING:
    from .reduction import Reduction, TwoAxisServoSetup

LIMIT = math.radians(0.1)  # of both angles: 1 deg/h/g makes 0.0017 deg/h of it
OTHER = {"x": "y", "y": "x"}  # about whose axis the torquer stands that precesses about this one


def torqued(setup: TwoAxisServoSetup, windows: dict[str, Array]) -> Array:
    """Return the precession by the torquers about x and y (n, 2), rad/s."""
    return np.column_stack([setup.torquers[a] * np.asarray(windows[f"current_{a}"], dtype=float) for a in "xy"])


def problems(angles: dict[str, Array]) -> list[str]:
    """Return angles that are not level; ``angles``: at the starts and ends of the windows, rad."""
    found = []
    for name, values in angles.items():
        worst = float(np.max(np.abs(values)))
        if worst > LIMIT:
            found.append(
                f"{name.partition('_')[0]} angle reaches {plain(math.degrees(worst), 3)}°: levelled it stays within "
                f"{math.degrees(LIMIT):g}°; raise the gain from the angle, or reduce without levelled"
            )
    return found


class LevelChannel(DriftReduction["TwoAxisServoSetup"]):
    """One channel of a levelled record."""

    def __init__(self, whole: Reduction, channel: str) -> None:
        super().__init__(whole.windows, whole.setup)
        self.whole, self.channel, self.axis = whole, channel, "xy".index(channel)
        self.mounts = list(dict.fromkeys(whole.mount.tolist()))

    def regression(self) -> Regression:
        s, w, seen = self.setup, self.whole, self.whole.seen
        self.torqued = w.torqued[:, self.axis]
        y = seen.inertial(s.place)[:, self.axis] - self.torqued
        X = np.equal.outer(w.mount, self.mounts).astype(float)
        terms = drift.NAMES_2DOF[self.channel]
        self.terms = seen.design(s.place, terms)
        length = seen.t_end - seen.t_start
        quantities = []
        for k, m in enumerate(self.mounts):
            at = dict(zip(terms, np.average(self.terms, axis=0, weights=length * X[:, k]).tolist(), strict=True))
            true = None if s.truth is None else sum(v * s.truth.get(n, 0.0) for n, v in at.items())
            book = float(np.average(y, weights=length * X[:, k]))
            meaning = f"composite drift about {self.channel} in mount {m}"
            q = Quantity.of(f"ω_d{self.channel}_{m}", meaning, "deg/h", true, book)
            quantities.append(q)
        rows = {n: np.asarray(v)[w.held] for n, v in w.windows.items()}
        end = f",{self.channel}"
        weighed = [*nuisances.common(rows, end)]
        if len(s.labels) > len(self.mounts):
            weighed.append(nuisances.scatter("mount", w.phase.tolist(), end))
        return Regression(
            quantities, X, y, seen.t_start, seen.t_end, [self.whole.group(p) for p in s.labels],
            noise="readings", candidates=weighed if s.nuisances else (),
        )  # fmt: skip

    def effects(self, found: Findings) -> list[Effect]:
        s, w = self.setup, self.whole
        geometric = budget.effects(self.axis, found, w.seen, w.phase, None, s)
        scale, _, zero, _ = drift_terms.torquer_sources(OTHER[self.channel])
        k = s.torquers[self.channel]
        by_torquer = [
            scale.effect(s, found.error(-self.torqued)), zero.effect(s, found.error(np.full_like(self.torqued, -k)))
        ]  # fmt: skip
        return [*geometric, *by_torquer]

    def account(self, found: Findings) -> Account:
        c, o = self.channel, OTHER[self.channel]
        return Account(
            method="The gyro holds a two-axis table that its torquers keep level; composite drift of each mount and "
            "channel under an estimated noise model with shared angle readings [SERVO2-LEVELLED]",
            sources=[
                "SERVO2-LEVELLED, SERVO2-KIN; Hu 1981, ch. 3 par. 3, eq. 3-97",
                "TEST-COMPOSITE; Hu 1981, eq. 3-91..3-93, corrected by E45, E46",
            ],
            equation=f"omega_{c} - k_{o} i_{o} = omega_\"d{c}\"",
            conventions=(
                "Drift ω_d in precession sign: inertial rate of the plate along the gyro's x and y axes less the "
                "rate by the torquer; ω_M of Hu 1981 is −ω_dx.",
                "One attitude a mount: constant drift, unbalance and compliance are in it together.",
            ),
            closed_caption="Mean over the windows of a mount (eq. 3-91)",
        )  # fmt: skip

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [found.noise_sentence(), *found.nuisance_sentences()]


def tables(whole: Reduction) -> list[Table]:
    """Return where the table stood and what the torquers did, and the composite drift of each mount and channel."""
    s, seen = whole.setup, whole.seen
    rows: list[list[Any]] = []
    statistics: dict[str, composite.Composite | str] = {}
    y = seen.inertial(s.place)[:, :2] - whole.torqued
    for p, label in s.labels.items():
        k = whole.phase == p
        angles = np.degrees(np.mean(seen.angle[k], axis=(0, 1))) * 3600.0
        rate = np.mean(whole.torqued[k], axis=0) / DPH
        time = float(seen.t_end[k][-1] - seen.t_start[k][0]) / 3600.0
        rows.append([label, p, int(k.sum()), time, *angles.tolist(), *rate.tolist()])
        for axis, c in enumerate("xy"):
            rates, times = y[k, axis], (seen.t_start[k], seen.t_end[k])
            wrong = composite.problems(rates, *times)
            statistics[f"{s.name(p)}, {c}"] = "; ".join(wrong) if wrong else composite.composite(rates, *times)
    head = ["mount", "phase", "windows", "time / h", "outer / ″", "inner / ″", "x torqued / (°/h)", "y torqued / (°/h)"]
    caption = "Mean angles, and mean rates by the torquers: those of the Earth less the drift"
    return [Table("mounts", "Mounts", caption, head, rows), *composite.tables(statistics, DPH, "°/h")]
