"""Reduction of the position test: errors by harmonics, separated from the polygon's; wobble, tilt, squareness.

Readings y of the autocollimator, corrected for the tracking error e of the counts, and y2 of the second head:

    y  + e = E(theta) - p_k + zero of the mount + direction h/2          k: face that is seen, sum of p = 0
    y2 + e = E(theta) - E(theta + head) + constant                       E = sum of a_n cos n theta + b_n sin n theta

The scale has one error, -E, for both heads.  An order n is told from the polygon where n times the angle between two
mounts, or between the heads, is not a whole turn.  Level: P e^(-j b) + zero,
P = plate + T e^(-j theta) + W e^(j theta).
[TABLE-POSITION]
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy import special

from gyrobench.reduction.loops.loop_toolkit import ARCSEC, Account, MeasureReduction, ReductionError, told
from gyrobench.reduction.loops.scale_errors import truth, waves
from gyrobench.reduction.toolkit import plain, window_problems
from gyrobench.result import BudgetLine, Series, Table

from .contradiction import contradicted, misplaced
from .places_fit import Averaged, PlacesFit, averaged_over_walk, least_squares, visits, walk
from .readings import Readings, faces_of
from .scale import unstated
from .sources import SCALE


def position_fit(r: Readings) -> tuple[PlacesFit, list[int], bool]:
    """Return the fit (a_1, b_1, a_2 ..., h, zeros of the mounts, constant of the second head, nuisances, p), its
    orders, and whether it holds a drift of the autocollimator.

    Nuisances, as far as the places tell them from the errors of the faces: a drift that is even in each mount, which
    else is taken for lost motion where all places are gone over there and back, and the readings whose way the record
    does not show.
    """
    orders = [n for n in range(1, r.orders + 1) if r.separated(n)]
    n, both = r.theta.size, r.both_senses
    zeros = (r.mount[:, None] == np.arange(r.mounts)).astype(float)
    seen = faces_of(r)
    own = waves(orders, r.theta)
    fixed = np.column_stack([own, *([0.5 * r.sense] if both else []), zeros, np.zeros(n)])
    y, place = np.concatenate([r.deviation + r.tracking, r.second + r.tracking]), np.tile(r.place, 2)
    ways = [r.unknown_ways()] if both else []
    for nuisances in ([r.drifts(), *ways], ways, []):
        first = np.column_stack([fixed, *nuisances, -seen])
        second = np.zeros_like(first)
        second[:, : own.shape[1]] = own - waves(orders, r.theta + r.head)
        second[:, fixed.shape[1] - 1] = 1.0
        X = np.vstack([first, second])
        if np.linalg.matrix_rank(X) == X.shape[1]:
            break
    else:
        raise ReductionError(
            f"{np.unique(place).size} positions do not determine {len(orders)} harmonics and the errors of "
            f"{r.seen.size} faces: take more positions or mounts, or fewer orders"
        )
    of, t, mount = slice(0, n), np.tile(r.t, 2), np.tile(r.mount, 2)
    parts = [*visits(of, place), *visits(slice(n, 2 * n), place, r.rounding), walk(of, t, mount)]
    return least_squares(X, y, parts), orders, len(nuisances) > len(ways)


def level_fit(r: Readings) -> tuple[Averaged, list[str]]:
    """Return the fit of the level, real and imaginary parts in turn, and the names of its complex terms.

    Its zero drifts evenly with the time, beside a random walk.
    """
    turn, n = np.exp(-1j * r.azimuth), r.theta.size
    columns = {"axis": turn * np.exp(-1j * r.theta), "wobble": turn * np.exp(1j * r.theta), "zero": np.ones(turn.size)}
    if np.unique(r.azimuth).size > 1:
        columns["plate"] = turn
    columns["drift"] = (r.t - r.t.mean()) / max(float(np.ptp(r.t)), 1e-9)
    X = np.column_stack(list(columns.values()))
    real = np.block([[X.real, -X.imag], [X.imag, X.real]])
    y = np.concatenate([r.level.real, r.level.imag])
    both = walk(slice(0, 2 * n), np.tile(r.t, 2), np.repeat([0, 1], n))
    return averaged_over_walk(real, y, both), list(columns)


#: complex term of the level -> its imaginary part and its real one, negated: tilts about the axes of the base
TILTS = {
    "axis": (("tilt 1", "tilt of the axis about the first axis of the base"),
             ("tilt 2", "tilt of the axis about the second axis of the base")),
    "wobble": (("wobble cos", "wobble twice a turn, A cos φ"), ("wobble sin", "wobble twice a turn, A sin φ")),
}  # fmt: skip
UNKNOWN = (None, None)
DRIFT = (
    "Lost motion cannot be told from drift of the autocollimator in these positions: it and the errors of the faces "
    "hold the drift of the whole test. Go over the positions there and back in each mount."
)


NEEDED = ("level_x", "level_y", "tracking", "second")


class Reduction(MeasureReduction):
    """Harmonics of the position error told from the polygon's, then tilt, wobble and squareness by the level."""

    part = "body"
    ranked_by = "accuracy"

    def measure(self) -> Account:
        """Measure errors of the position and of the axis.  Raises ReductionError."""
        w = self.record.windows
        if problems := window_problems(w) or [f"column {n} is missing" for n in NEEDED if n not in w]:
            raise ReductionError(problems)
        self.r = r = Readings(w, self.run)
        self.fit, self.orders, drifts = position_fit(r)
        self.slopes: dict[str, float] = {}
        fit = self.fit
        self._accuracy()
        self._harmonics()
        self._repeatability()
        if r.both_senses and not drifts:
            self.found.warn("lost_motion.drift", DRIFT)
        self.found.reasons += unstated(self.run, self.slopes, self.found)
        if self.run.measured:
            self.found.doubt("position.contradiction", contradicted(r))
            self.found.doubt("position.mounts", misplaced(r))
        self._level()
        self._polygon()
        self.found.facts |= {
            "series": [self._series(m) for m in range(r.mounts)], "dof": fit.free,
            "residual_std": math.sqrt(fit.variance) / ARCSEC, "residual_unit": "arcsec",
        }  # fmt: skip
        return Account(
            method="Polygon and autocollimator in several mounts, a second reading head, a level in the same mounts",
            sources=["TABLE-POSITION, ANGLE-INDUCTOSYN; Hu 1981, sections 5.4, 5.5, 6.1"],
            equation="y + e = E(theta) - p_k + z_m + h\\/2, quad y_2 + e = E(theta) - E(theta + gamma) + c, "
            "quad L = (P_0 + T e^(-j theta) + W e^(j theta)) e^(-j b) + Z",
            conventions=[
                "Position error E: true position less commanded one, without its mean; E = Σ a_n cos nθ + b_n sin nθ.",
                "The interval of the largest error holds for all positions at once (Bonferroni).",
                "The scale errs by −E, the same for both heads; y is corrected for the tracking error e of the counts.",
                "Wobble: tilt A cos(2θ + φ), A sin(2θ + φ) about the first and second axis of the base.",
                "Squareness: tilt of the plate against the axis, x and y as the level reads it.",
            ],
        )

    def summary(self) -> list[str]:
        count = float(self.run.parameters.get("reader.quantum", 0.0)) / ARCSEC
        return told(
            self.found.coefficients,
            f"Largest position error, at {self.where:g}°: {{accuracy}}.",
            f"Repeatability {{repeatability}}; one count is {plain(count)}″.",
            f"Orders told from the polygon: {', '.join(map(str, self.orders)) or 'none'}.",
        )

    def _add(self, name: str, meaning: str, value: float, u: float, dof: float, truth: Any = None, none: str = "",
             k: float | None = None, places: int = 1, slope: float = 0.0) -> None:  # fmt: skip
        """Measure an angle, SI; none: why it has no value.

        slope: its change by the scale of the autocollimator, SI per 1.  places: figures for which the interval holds.
        """
        share = abs(slope) * float(SCALE.size(self.run.options))
        if slope and not none:
            self.slopes[name] = slope / ARCSEC
        if share and not none:
            line = (share / abs(slope), "1", slope / ARCSEC, "arcsec", share / ARCSEC, "arcsec")
            self.found.budget.append(BudgetLine(SCALE.id, SCALE.name, *line, name, SCALE.note))
            dof *= (1.0 + (share / u) ** 2) ** 2 if u else math.inf  # Welch and Satterthwaite
            u = math.hypot(u, share)
        if places > 1:
            k = float(special.stdtrit(dof, 1.0 - 0.025 / places))
        known = None if truth is None or none else float(truth)
        self.found.measure(name, meaning, "arcsec", float(value), float(u), scale=ARCSEC, dof=dof, truth=known,
                           no_value=none, k=k)  # fmt: skip

    def _accuracy(self) -> None:
        """Measure the largest error of a position: the readings less zeros of the mounts and errors of the faces."""
        r, fit = self.r, self.fit
        n, visited = r.theta.size, np.unique(r.place)
        taken = fit.X[:n].copy()
        taken[:, : 2 * len(self.orders) + r.both_senses] = 0.0
        self.error = r.deviation - taken @ fit.value
        there = r.place == visited[:, None]
        mean = there / np.sum(there, axis=1, keepdims=True)
        mean -= mean.mean(axis=0)  # (places, readings): mean of a place, less that of all
        at = mean @ self.error
        worst = int(np.argmax(np.abs(at)))
        g = mean[worst] @ (np.eye(n, 2 * n) - taken @ fit.gain)
        dof, self.where = fit.freedom(g), 360.0 * visited[worst] / r.faces
        true = None if r.true is None else mean[worst] @ r.true
        meaning = f"position error of the largest magnitude, at {self.where:g}°"
        self._add("accuracy", meaning, at[worst], math.sqrt(float(g @ fit.V @ g)), dof, true, places=visited.size,
                  slope=float(g[:n] @ r.deviation))  # fmt: skip

    def _harmonics(self) -> None:
        """Measure the harmonics of the position error, and the lost motion behind them."""
        fit, orders, reader = self.fit, self.orders, truth(self.run.parameters, "reader")
        slopes = fit.gain[:, : self.r.theta.size] @ self.r.deviation
        for n in range(1, self.r.orders + 1):
            true = [-x for x in reader.get(n, (0.0, 0.0))] if reader else UNKNOWN  # the table errs by less its scale
            same = f"order {n} is the same in all mounts and at both heads: take another mount"
            for j, part in enumerate(("cos", "sin")):
                k, none = (2 * orders.index(n) + j, "") if n in orders else (0, same)
                meaning = f"position error, {part} {n if n > 1 else ''}θ"
                self._add(f"E{n} {part}", meaning, fit.value[k], fit.u[k], fit.freedom(fit.gain[k]), true[j], none,
                          slope=float(slopes[k]))  # fmt: skip
        if self.r.both_senses:
            k, meaning = 2 * len(orders), "position on the way up less that on the way back"
            none = "" if fit.redundant else "no place is visited often enough to show what a reading scatters by"
            self._add("lost motion", meaning, fit.value[k], fit.u[k], fit.freedom(fit.gain[k]), none=none,
                      slope=float(slopes[k]))  # fmt: skip

    def _repeatability(self) -> None:
        """Measure the standard deviation of visits, with the interval of a variance (chi-squared)."""
        fit, meaning = self.fit, "standard deviation of the visits of a position"
        none = "" if fit.variance else "not told from drift and errors that return at a place: take more visits"
        spread = math.sqrt(fit.variance) / ARCSEC
        low, high = (spread * math.sqrt(fit.free / float(special.chdtri(fit.free, p))) for p in (0.025, 0.975))
        u = spread / math.sqrt(2.0 * fit.free)
        self.found.measure("repeatability", meaning, "arcsec", spread, u, dof=fit.free, no_value=none,
                           interval=None if none else (low, high))  # fmt: skip

    def _level(self) -> None:
        """Measure tilt of the axis, wobble and squareness from the complex terms of the level."""
        level, terms = level_fit(self.r)
        p, half = self.run.parameters, len(terms)
        known = {"axis": p.get("body.tilt", UNKNOWN), "wobble": UNKNOWN}
        if p.get("wobble.order") == 2.0 and "wobble.amplitude" in p:
            size, phase = float(p["wobble.amplitude"]), float(p["wobble.phase"])
            known["wobble"] = (size * math.cos(phase), size * math.sin(phase))
        for term, names in TILTS.items():
            at = terms.index(term)
            for (name, meaning), i, sign, true in zip(names, (half + at, at), (1.0, -1.0), known[term], strict=True):
                self._add(name, meaning, sign * level.value[i], level.u[i], level.dof, true, k=float(level.k[i]))
        same = "one mount: not told from the level's zero"
        at, none = (terms.index("plate"), "") if "plate" in terms else (0, same)
        for axis, i, true in zip("xy", (at, half + at), p.get("reference.plate", UNKNOWN), strict=True):
            meaning = f"tilt of the plate against the axis, {axis}"
            self._add(
                f"squareness {axis}", meaning, level.value[i], level.u[i], level.dof, true, none, k=float(level.k[i])
            )

    def _polygon(self) -> None:
        """Show the errors of the faces that were seen, which the fit has last."""
        seen, true = self.r.seen, self.run.parameters.get("reference.errors")
        last = slice(self.fit.value.size - seen.size + 1, None)
        p, u = self.fit.value[last], self.fit.u[last]
        p, u = np.append(p, -np.sum(p)), np.append(u, math.sqrt(float(np.sum(u**2)) / max(u.size, 1)))
        known: list[Any] = [None] * seen.size
        if true is not None:
            known = list((np.asarray(true)[seen] - np.mean(np.asarray(true)[seen])) / ARCSEC)
        rows = [[int(k) + 1, x / ARCSEC, s / ARCSEC, t] for k, x, s, t in zip(seen, p, u, known, strict=True)]
        caption, head = "Errors of the faces, their mean left out", ["face", "error / ″", "u / ″", "truth / ″"]
        self.found.tables.append(Table("polygon.errors", "Errors of the polygon", caption, head, rows))

    def _series(self, m: int) -> Series:
        """Return the position errors of one mount against the angle, the polygon's errors taken off."""
        of = self.r.mount == m
        theta, dense, error = self.r.theta[of], np.linspace(0.0, 2 * math.pi, 181), self.error[of] / ARCSEC
        harmonics = self.fit.value[: 2 * len(self.orders)] / ARCSEC
        model, curve = (waves(self.orders, x) @ harmonics for x in (theta, dense))
        at, measured = (np.degrees(theta), "table angle", "°"), (error, "position error", "arcsec")
        label = f"mount {math.degrees(self.r.azimuth[of][0]):g}°"
        return Series.of(label, at, measured, model, error - model, curve=(np.degrees(dense), curve))
