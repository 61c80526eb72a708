"""Reduction: the axis of a stand against the pole, from sights of Polaris, of a mirror and of an inclinometer.

With the face f = +-1, A, h azimuth and altitude of the star at the time of the sight, v the lean of the vertical axis
across the line of sight by the plate level,

    star    R + v tan h - A = -o + f (c/cos h + i tan h)
    mirror  R               = a/cos phi - o + f c
    axis    R - phi         = e + f z
    head    R - psi         = -o + f c          in place of the star: a mirror on the head of a north finder

e, a: rotation of the axis off the pole p about east, and about p x east; c collimation, i tilt of the trunnion axis,
o azimuth of the circle's zero, z zero of the inclinometer, psi azimuth of the mirror as the north finder found it; i is
not estimated without a star.  Least squares with equal weights.  [STAND-ALIGNMENT]
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.setups import Setup
from gyrobench.reduction.setup.window_checks import window_problems
from gyrobench.reduction.toolkit import Account, DriftReduction, Effect, Findings, Group, Quantity, Regression, told
from gyrobench.result import Coefficient, Reason, Table
from gyrobench.units import ARCSEC, DEG, EARTH_RATE

from . import polaris
from .sources import CIRCLE, CLOCK, HEADING, LATITUDE, LEANING, LEVEL, NORMAL, PLACE

STAR, MIRROR, AXIS, HEAD = 1, 2, 3, 4
NAMES = {STAR: "star", MIRROR: "mirror", AXIS: "axis", HEAD: "head"}
#: name -> meaning, unit, name of its true value
FITTED = {
    "about east": ("axis off the pole, about east: too high", "arcsec", "elevation"),
    "about p × east": ("axis off the pole, about p × east: to the east", "arcsec", "across"),
    "collimation": ("collimation of the theodolite", "arcsec", "collimation"),
    "trunnion": ("tilt of its trunnion axis", "arcsec", "trunnion"),
    "circle zero": ("azimuth of the zero of its circle", "deg", "circle_zero"),
    "inclinometer zero": ("zero of the inclinometer", "arcsec", "inclinometer_zero"),
}
LARGE = 120.0 * ARCSEC  # of the theodolite's errors, whose square is 0.07 arcsec
ZERO = "circle zero"  # what is fitted of it counts from a first value


@dataclass(frozen=True, kw_only=True)
class AlignmentSetup(Setup):
    """latitude, longitude rad; jd: Julian date (UTC) of t = 0; air: pressure (Pa) and temperature (K); heading: rad."""

    latitude: float
    longitude: float
    jd: float
    ut1_utc: float = 0.0
    air: tuple[float, float] = (101325.0, 283.15)
    heading: float = 0.0


class Reduction(DriftReduction[AlignmentSetup]):
    """Axis of a stand from windows: t_start, t_end (s from the date), angle_start (target), mean (rad), level (rad)."""

    @classmethod
    def setup_of(cls, run: RunDocument) -> AlignmentSetup:
        o, p = run.options, run.parameters
        names = ("elevation", "azimuth", "collimation", "trunnion", "circle_zero", "inclinometer_zero")
        known = None if run.measured else {n: p.get(f"theodolite.{n}") for n in names}
        truth = None if known is None or None in known.values() else {n: float(v) for n, v in known.items()}  # type: ignore[arg-type]
        latitude = float(o["latitude"])
        return AlignmentSetup.of(
            run, latitude=latitude, longitude=float(o["longitude"]), jd=polaris.julian(str(o["start"])),
            ut1_utc=float(o["ut1_utc"]), air=(float(o["pressure"]), float(o["air"])), truth=truth,
            heading=float(o["heading"]),
            site={"latitude / °": latitude / DEG, "longitude / °": float(o["longitude"]) / DEG},
        )  # fmt: skip

    def problems(self) -> list[str]:
        problems = window_problems(self.windows)
        if "level" not in self.windows:
            problems.append("column level is missing: the plate level is read with every sight")
        if problems:
            return problems
        code = np.rint(np.asarray(self.windows["angle_start"], dtype=float)).astype(int)
        self.kind, self.face = np.abs(code), np.sign(code)
        if odd := sorted({int(k) for k in self.kind} - NAMES.keys()):
            return [f"target {odd[0]}: 1 star, 2 mirror, 3 axis, 4 head, negative with face right"]
        both = {STAR, HEAD} & set(self.kind.tolist())
        if len(both) != 1:
            return ["the azimuth is from one of both: sights of a star (1), or of a north finder's head (4)"]
        self.by = both.pop()
        self.names = [n for n in FITTED if n != "trunnion" or self.by == STAR]
        for kind in (self.by, MIRROR, AXIS):
            name = NAMES[kind]
            left, right = (int(np.sum((self.kind == kind) & (self.face == f))) for f in (1, -1))
            if left != right or left < 2:
                problems.append(f"{name}: {left} sights left, {right} right: as many of each are needed, two at least")
        return problems

    def _sky(self) -> None:
        """Azimuth, altitude and their derivatives at the middle of every window."""
        s, w = self.setup, self.windows
        self.t = (np.asarray(w["t_start"], dtype=float) + np.asarray(w["t_end"], dtype=float)) / 2.0
        H0, self.de = polaris.hour_angle(s.jd, s.longitude, s.ut1_utc)
        H = H0 + EARTH_RATE * self.t
        self.A, true = polaris.azimuth(H, self.de, s.latitude)
        self.h = np.where(self.kind == STAR, true + polaris.refraction(true, *s.air), 0.0)
        d, place = 1e-5, polaris.azimuth
        self.by_H = (place(H + d, self.de, s.latitude)[0] - place(H - d, self.de, s.latitude)[0]) / (2.0 * d)
        self.by_de = (place(H, self.de + d, s.latitude)[0] - place(H, self.de - d, s.latitude)[0]) / (2.0 * d)
        self.by_phi = (place(H, self.de, s.latitude + d)[0] - place(H, self.de, s.latitude - d)[0]) / (2.0 * d)

    def regression(self) -> Regression:
        self._sky()
        s, f = self.setup, self.face.astype(float)
        star, mirror, axis, head = (np.where(self.kind == k, 1.0, 0.0) for k in (STAR, MIRROR, AXIS, HEAD))
        level = np.asarray(self.windows["level"], dtype=float)
        sights = self.kind != AXIS
        self.level_zero = float(np.mean(level[sights]))
        self.v = np.where(sights, f * (level - self.level_zero), 0.0)
        read = np.asarray(self.windows["mean"], dtype=float)
        y = read + star * (self.v * np.tan(self.h) - self.A) - head * s.heading - axis * s.latitude
        self.zero = -float(np.median(y[self.kind == MIRROR]))  # of the circle, nearly: what is fitted is small
        sighted = star + mirror + head
        y = y + sighted * self.zero
        columns = {
            "about east": axis,
            "about p × east": mirror / math.cos(s.latitude),
            "collimation": f * (star / np.cos(self.h) + mirror + head),
            "trunnion": f * star * np.tan(self.h),
            ZERO: -sighted,
            "inclinometer zero": f * axis,
        }
        X = np.column_stack([columns[n] for n in self.names])
        groups = [
            Group(f"{name}, {side}", np.flatnonzero((self.kind == k) & (self.face == g)),
                  self.t[(self.kind == k) & (self.face == g)] / 60.0, "time", "min")
            for k, name in NAMES.items() if k in (self.by, MIRROR, AXIS) for g, side in ((1, "left"), (-1, "right"))
        ]  # fmt: skip
        return Regression(self.names, X, y, None, None, groups, "circle less its zero", "″", ARCSEC, "white")

    def derived(self, found: Findings) -> Findings:
        true, phi = dict(self.setup.truth or {}), self.setup.latitude
        if "azimuth" in true:
            true["across"] = true["azimuth"] * math.cos(phi)
        rows = [(n, *FITTED[n]) for n in self.names]
        quantities = [Quantity.of(n, text, unit, true.get(key)) for n, text, unit, key in rows]
        zero = np.array([self.zero if n == ZERO else 0.0 for n in self.names])
        return found.derive(quantities, lambda b: b[: len(zero)] + zero)

    def effects(self, found: Findings) -> list[Effect]:
        s, star = self.setup, np.where(self.kind == STAR, 1.0, 0.0)
        mirror, axis, head = (np.where(self.kind == k, 1.0, 0.0) for k in (MIRROR, AXIS, HEAD))
        read = np.asarray(self.windows["mean"], dtype=float)
        sighted = star + mirror + head
        once = np.stack([sighted * np.sin(read), sighted * np.cos(read)])
        place = np.stack([-star * self.by_de, -star * self.by_H / math.cos(self.de)])
        of_star = [
            CLOCK.effect(s, found.error(-star * self.by_H * EARTH_RATE)),
            PLACE.effect(s, place),
            LEVEL.effect(s, found.error(star * self.v * np.tan(self.h))),
        ]
        return [
            *(of_star if self.by == STAR else [HEADING.effect(s, found.error(-head))]),
            LATITUDE.effect(s, found.error(-star * self.by_phi - axis)),
            CIRCLE.effect(s, once),
            NORMAL.effect(s, found.error(mirror)),
            LEANING.effect(s, found.error(axis)),
        ]

    def account(self, found: Findings) -> Account:
        return Account(
            method=("Polaris" if self.by == STAR else "A north finder")
            + " and a mirror by theodolite in both faces, the axis by an inclinometer turned round; least squares "
            "[STAND-ALIGNMENT]",
            sources=["STAND-ALIGNMENT, ALIGN-ERRORS; Hu 1981, section 5.7; Meeus 1998; Capitaine 2003"],
            equation="R + v tan h - A = -o + f (c/cos h + i tan h), quad R = a/cos phi - o + f c, "
            "quad R - phi = e + f z",
            conventions=[
                "Azimuth from north to east; face right readings less half a turn; p: the pole.",
                "Apparent place of Polaris of the date, diurnal aberration in the azimuth, refraction in the altitude.",
            ],
            tables=[self._sights(found)],
            reasons=self._large(found),
            random="noise of the sights",
        )

    def _large(self, found: Findings) -> list[Reason]:
        """Return that an error of the theodolite is so large that its square counts."""
        both = ("collimation", "trunnion")
        fitted = {n: float(found.est.beta[self.names.index(n)]) for n in both if n in self.names}
        sizes = {**fitted, "lean": float(np.max(np.abs(self.v)))}
        large = [f"{n} {abs(float(x)) / ARCSEC:.0f}″" for n, x in sizes.items() if abs(float(x)) > LARGE]
        if not large:
            return []
        text = (
            f"Errors of the theodolite are taken to first order; of {', '.join(large)} the squares are "
            f"{plain(max(abs(float(x)) for x in sizes.values()) ** 2 / ARCSEC)}″ and not in u: adjust it."
        )
        return [Reason("theodolite.large_errors", text, ("pass",), ("about p × east", *fitted))]

    def _sights(self, found: Findings) -> Table:
        """Return the star at the first and the last sight, the azimuth of the axis, and the level."""
        across, phi = found.est.beta[1], self.setup.latitude
        u = float(found.est.u[1])
        rows: list[list[object]] = [["heading of the north finder's mirror", self.setup.heading / DEG, None, "°"]]
        if self.by == STAR:
            ends = list(zip(("first", "last"), np.flatnonzero(self.kind == STAR)[[0, -1]], strict=True))
            rows = [[f"azimuth of Polaris, {name} sight", float(self.A[k]) / DEG, None, "°"] for name, k in ends]
            rows += [[f"its altitude, {name} sight", float(self.h[k]) / DEG, None, "°"] for name, k in ends]
        rows += [
            ["azimuth of the axis", float(across) / math.cos(phi) / ARCSEC, u / math.cos(phi) / ARCSEC, "″"],
            ["zero of the plate level", self.level_zero / ARCSEC, None, "″"],
            [f"lean across the {NAMES[self.by]}", float(np.mean(self.v[self.kind == self.by])) / ARCSEC, None, "″"],
        ]
        caption = "Star with refraction and diurnal aberration; u of type A."
        return Table("alignment.sights", "Star, azimuth and level", caption, ["quantity", "value", "u", "unit"], rows)

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        return [
            *told(coefficients, "Axis off the pole: {about east} about east, {about p × east} across."),
            f"Residual standard deviation {plain(found.residual_std, 3)}″ of a sight.",
        ]
