"""Reduction of a north finding: heading, horizontal Earth rate and bias from the windows of a method.

    w_y = A cos(psi - angle) + bias        A = W cos(latitude)

by least squares under a noise model estimated from the windows; the heading is a function of the unknowns, its interval
that of first order; that of two positions, cos psi = c/A, reaches as far as c does.  What the finder in the run says
stands beside it.  [NORTH-COMMON; GSP ch. 5, section 5.3.2]

Two positions have two headings, psi and -psi: the rough heading, which no residual shows to be wrong, chooses.

With drift_order = n the bias is a polynomial of that degree in time, estimated with the heading.  [NORTH-DRIFT]

Not modelled: without it, a drift of the bias unless the nuisance model finds a trend; motion of the base.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from scipy import special

from gyrobench import frames
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import nuisances
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.level_shift import jumped
from gyrobench.reduction.estimation.linear_fit import Regression
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.setup.rate_gyro_bias import bias_is_all
from gyrobench.reduction.setup.setups import SiteSetup
from gyrobench.reduction.setup.sources import LATITUDE, Effect
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.reduction.toolkit import Account, Array, DriftReduction, Group, Location, Quantity, Record, plain, told
from gyrobench.result import Coefficient, DriftTestResult, Reason, Table
from gyrobench.units import ARCMIN, DEG, DPH

from . import after, plans
from .model import LocalEarth, at_null, attitude, of_windows
from .sources import FORCE_BIAS, FORCE_NOISE, GYRO_BIAS, TILT, ZERO

NEAR = 0.2  # largest departure of the horizontal rate from that of the latitude
LEVEL = 1e-3  # of the test of that departure
MANY = 3.0  # standard deviations of the horizontal rate, at least
MOST = 3.0  # standard uncertainties by which a heading and the rough one may differ
DRIFTS = (
    "linear drift of the bias, at the end",
    "quadratic drift of the bias, at the end",
    "cubic drift of the bias, at the end",
)
STATUS = {2.0: "is ill-conditioned", 3.0: "contradicts the latitude", 4.0: "is of a moving base"}  # of the finder
UNDETERMINED = (
    "the rates do not determine the heading: their horizontal part is below three times its uncertainty; take a longer "
    "time"
)
SAME = 0.02  # rad: angles of the head that are one position
ONCE = Reason(
    "positions.once",
    "Each position was taken once: a bias that jumps between two of them (it is touched, heated, switched) turns the "
    "heading, and no residual shows it. Take the first position once more at the end.",
)
THIRD = "take a third position, at 90° to the two (method four or several), which tells them apart"


@dataclass(frozen=True, kw_only=True)
class NorthFinderSetup(SiteSetup):
    """method: a key of plans.PARTS.  rough: rough heading, rad, sigma_rough: its standard uncertainty, 0 if not stated;
    rough_stated: the run is simulated, and knows its heading.  finder: what the estimator of the run says.  unbiased:
    the gyro is simulated without bias, or it is declared that there is none.

    drift_order: highest power of time of a drift of the bias that is estimated with the heading.
    density of the white rate noise (rad/s/sqrt(Hz); 0: unknown), total time and settling (s): for the comparison of the
    methods.  instruments: parameters of those of a run, for heading and level after a time.
    """

    method: str
    rough: float = 0.0
    sigma_rough: float = 0.0
    rough_stated: bool = True
    finder: Mapping[str, float] | None = None
    density: float = 0.0
    time: float = 0.0
    settle: float = 0.0
    drift_order: int = 0
    unbiased: bool = False
    instruments: Mapping[str, Any] | None = None

    @classmethod
    def of(cls, run: RunDocument, **own: Any) -> Self:
        o, p = run.options, run.parameters
        stated: dict[str, Any] = {n: float(o.get(n, 0.0)) for n in ("rough", "sigma_rough", "settle", "density")}
        stated["density"] = stated["density"] or float(p.get("finder.density", 0.0))
        unbiased = run.type_b == "none" or (not np.any(p.get("gyro.bias", 1.0)) and bias_is_all(p))
        return super().of(
            run, method=method_of(run), rough_stated=not run.measured, drift_order=int(o.get("drift_order", 0)),
            unbiased=unbiased, instruments=None if run.measured else p, **stated, **own,
        )  # fmt: skip

    @property
    def earth(self) -> LocalEarth:
        _, north, up = frames.earth_rate_local(self.latitude, self.earth_rate)
        return LocalEarth(float(north), float(up), self.gravity, self.rough)


class Reduction(DriftReduction[NorthFinderSetup]):
    """Heading from windows: those of a drift test, mean along y, and, by method, mean_x (rad/s), f_x, f_y (m/s2)."""

    @classmethod
    def of_record(cls, record: Record) -> DriftTestResult:
        return cls.reduce(record.windows, setup_of(record))

    def problems(self) -> list[str]:
        s = self.setup
        problems = s.site_problems()
        if s.method not in plans.PARTS:
            problems.append(f"method = {s.method}: must be one of {', '.join(plans.PARTS)}")
        problems += after.lost(s.method, GYRO_BIAS.size(s), s.latitude)
        problems += window_problems(self.windows)
        if s.method == "null" and not problems:
            near = at_null(self.windows)
            self.windows = {n: np.asarray(v)[near] for n, v in self.windows.items()}
        return problems

    def regression(self) -> Regression:
        s = self.setup
        self.north = s.earth.north
        self.model = p = of_windows(s.method, self.windows, s.earth, s.drift_order)
        two = p.X.shape[0] > len(self.windows["mean"])
        weighed = nuisances.common(self.windows) if s.nuisances and not two else []
        if s.drift_order:
            weighed = [c for c in weighed if c.name != "trend"]
        turning = s.method in plans.TURNING
        clockwise = np.degrees(np.unwrap(p.along)) if turning else np.degrees(p.along)
        dense = None
        if not turning and not s.method.startswith("strapdown"):
            grid = np.linspace(0.0, 360.0, 181)
            curve = [np.cos(np.radians(grid)), -np.sin(np.radians(grid)), np.ones_like(grid)]
            drifts = [np.zeros_like(grid)] * s.drift_order
            dense = (grid, np.column_stack([*(curve[::2] if p.names[0] == "c" else curve), *drifts]))
        shown = [
            Group(f"rate along {name}", np.flatnonzero(p.axis == a), clockwise[p.axis == a], "head angle", "°", dense)
            for name, a in (("y", 1.0), ("x", 0.0))
            if np.any(p.axis == a)
        ]
        return Regression(p.names, p.X, p.y, p.t_start, p.t_end, shown, "rate", candidates=weighed)

    def unknowns(self, found: Findings) -> Array:
        """Return the unknowns of the method, without those of nuisances."""
        return found.est.beta[: self.model.X.shape[1]]

    def derived(self, found: Findings) -> Findings:
        """Return the fit as heading, horizontal rate and bias.  Raises ReductionError where first order does not hold,
        or where the rate is not the Earth's.
        """
        p, s, truth = self.model, self.setup, self.setup.truth or {}
        psi, A = p.heading(self.unknowns(found))
        if math.isnan(A):
            self.slope, cosine = self._slope(found, psi), float(self.unknowns(found)[0])
        elif not found.ideal and not MANY * float(np.max(np.asarray(found.u)[: self.model.X.shape[1]][:2])) < A:
            raise ReductionError(UNDETERMINED)
        if abs(A / self.north - 1.0) > NEAR:
            small = ", or the gyro answers it in part (dead band, lock-in, steps of its word)" * bool(self.north > A)
            raise ReductionError(
                f"horizontal Earth rate {plain(A / DPH, 4)} °/h, at this latitude it is {plain(self.north / DPH, 4)} "
                f"°/h: latitude, unit or axes are wrong, or the base moves{small}"
            )

        def near(angle: float) -> float:  # no jump at the south
            return psi + math.remainder(angle - psi, 2.0 * math.pi)

        def values(a: Array) -> list[float]:
            heading, rate = p.heading(a)
            if math.isnan(A):
                heading = psi + self.slope * (float(a[0]) - cosine) / self.north
            every = (near(heading), rate, float(a[p.bias]), *(float(d) for d in a[p.bias + 1 :][: s.drift_order]))
            return [v for v, seen in zip(every, there, strict=True) if seen]

        there = (True, not math.isnan(A), p.bias >= 0, *[True] * s.drift_order)
        true = near(truth["ψ"]) if "ψ" in truth else None
        wanted = (
            Quantity.of("ψ", "heading of the axis y, clockwise from north", "deg", true),
            Quantity.of("A", "horizontal Earth rate", "deg/h", truth.get("A")),
            Quantity.of("b", "bias of the gyro along y", "deg/h", truth.get("b")),
            *(Quantity.of(f"d_{k}", DRIFTS[k - 1], "deg/h", truth.get(f"d_{k}")) for k in range(1, s.drift_order + 1)),
        )
        return found.derive([q for q, seen in zip(wanted, there, strict=True) if seen], values)

    def _slope(self, found: Findings, psi: float) -> float:
        """Return the slope d psi/d cos psi, of two positions, at which an interval of first order reaches as far as the
        heading does when its cosine is off by U: -1/sin psi, near north and south less steep.  Raises ReductionError
        for a cosine beyond 1.
        """
        s, x = self.setup, float(self.unknowns(found)[0]) / self.north
        psi = math.remainder(psi - self.model.zero, 2.0 * math.pi)
        half = 0.0 if found.ideal else float(found.reported.half_width[0]) / self.north
        b = (TILT.size(s) * s.earth.up / self.north, LATITUDE.size(s) * math.tan(s.latitude))
        U = math.sqrt(half**2 + NORMAL**2 * sum(v * v for v in b))
        if abs(x) > 1.0 + max(MOST * U, NEAR):
            raise ReductionError(
                f"the rates of the two positions differ by {plain(abs(x), 3)} of what the Earth's can at this "
                "latitude: latitude, unit or axes are wrong, or the base moves"
            )
        x, sense = max(-1.0, min(1.0, x)), -math.copysign(1.0, psi)
        if U < 1e-9:
            return sense / max(abs(math.sin(psi)), 1e-9)
        ends = (math.acos(max(-1.0, min(1.0, x + d))) for d in (U, -U))
        return sense * max(abs(end - abs(psi)) for end in ends) / U

    def effects(self, found: Findings) -> list[Effect]:
        """Return the sources of type B, by the change of the rates, or of the heading where they act on it directly."""
        s, p, psi = self.setup, self.model, float(found.value[0])
        one = np.eye(found.value.size)[0]
        out = [ZERO.effect(s, values=one)]
        if p.force is None:
            towards = psi + p.along
            tilts = {"east": np.cos(towards), "north": -np.sin(towards)}
            out += [TILT.of(axis=n).effect(s, found.error(s.earth.up * c)) for n, c in tilts.items()]
        if s.method == "strapdown":
            axes = {"x": 0.0, "y": 1.0}
            out += [GYRO_BIAS.of(axis=n).effect(s, found.error((p.axis == a) * 1.0)) for n, a in axes.items()]
        if p.force is not None:
            for n, u, moved in (("x", p.force.u_x, (1.0, 0.0)), ("y", p.force.u_y, (0.0, 1.0))):
                values = self._moved(found, force=moved)
                out.append(FORCE_NOISE.of(axis=n).effect(u, values=values))
                if s.method == "strapdown":  # two positions and a turning head take it out
                    out.append(FORCE_BIAS.of(axis=n).effect(s, values=values))
            out.append(LATITUDE.effect(s, values=self._moved(found, latitude=1.0)))
        elif s.method in plans.SIDED:  # cos(psi - zero) = c / A
            by_latitude = self.slope * math.tan(s.latitude) * math.cos(psi - p.zero)
            out.append(LATITUDE.effect(s, values=by_latitude * one))
        return out

    def _moved(self, found: Findings, force: tuple[float, float] = (0.0, 0.0), latitude: float = 0.0) -> Array:
        """Return the change (q,) of the values for a unit of the force along x and y as read, or of the latitude."""
        p, step = self.model, 1e-6
        a, earth, read = self.unknowns(found), p.earth, p.force
        assert read is not None

        def at(sign: float) -> Array:
            x, y = (f + sign * step * d for f, d in zip((read.x, read.y), force, strict=True))
            up = earth.up + sign * step * latitude * earth.north
            return np.array(replace(p, earth=replace(earth, up=up), force=replace(read, x=x, y=y)).heading(a))

        change = at(1.0) - at(-1.0)
        change[0] = math.remainder(change[0], 2.0 * math.pi)
        return np.concatenate([change / (2.0 * step), np.zeros(found.value.size - 2)])

    def account(self, found: Findings) -> Account:
        s, (psi, A) = self.setup, self.model.heading(self.unknowns(found))
        return Account(
            method=f"Method {s.method}: least squares over the angles of the head under an estimated noise model "
            "[NORTH-COMMON]",
            sources=["NORTH-COMMON, NORTH-2POS, NORTH-4POS, NORTH-CONT, NORTH-TILT, NORTH-STRAPDOWN; GSP ch. 5, "
                     "eq. 5-44..5-65, corrected"],
            equation='w_y = A cos(psi - "angle") + b, quad A = omega_E cos phi',
            conventions=[
                "Heading ψ of the axis y of the head at table angle 0, clockwise from north; table angles "
                "anticlockwise.",
                "At rest the specific force points up: nose up makes f_y positive, right side down f_x negative.",
            ],
            tables=[
                self._integrity(psi, A), *after.methods_table(s.density, s.time, s.settle, s.latitude, psi),
                *after.table(s.instruments or {}, s.latitude, s.gravity, GYRO_BIAS.size(s)),
            ],
            reasons=jumped(found),
        )  # fmt: skip

    def completed(self, result: DriftTestResult) -> DriftTestResult:
        """Return the result with what speaks against its heading."""
        s, reasons = self.setup, []
        if "A" in result.names:
            A = result["A"]
            off = abs(A.estimate - self.north / DPH) / A.u if A.u > 0.0 else 0.0
            if 2.0 * float(special.ndtr(-off)) < LEVEL:
                departs = f"departs from that of the latitude by {off:.1f} standard uncertainties"
                reasons.append(_doubt("earth_rate.departs", f"The horizontal Earth rate {departs}."))
        if s.method in plans.SIDED:
            reasons += self._side(result["ψ"])
        if s.finder and s.finder["status"] != 1.0:
            words = STATUS.get(s.finder["status"], "is not there")
            reasons.append(_doubt("finder.status", f"The finder says that the heading {words}."))
        if s.method == "strapdown" and not GYRO_BIAS.size(s) and not s.unbiased:
            turned = math.degrees(0.1 * DPH / self.north)
            text = (
                "One position leaves the bias of the gyro in the heading, which 0.1 °/h turn by up to "
                f"{plain(turned)}°. It is not in u. State u_bias, or take the method strapdown two."
            )
            reasons.append(Reason("gyro.bias.unstated", text, severity="error"))
            reasons.append(_doubt("gyro.bias", "The bias of the gyro is in the heading, and not in u.", "pass"))
        if s.instruments is None and self._once():
            reasons.append(ONCE)
        return replace(result, reasons=[*result.reasons, *reasons])

    def _once(self) -> bool:
        """Return whether two to four positions are taken, each once: a heading makes what a jump of the bias does."""
        start, end = (np.asarray(self.windows[f"angle_{n}"], dtype=float) for n in ("start", "end"))
        taken = start[np.concatenate([[True], np.abs(np.diff(start)) > SAME])]
        apart = np.abs(np.exp(1j * taken[:, None]) - np.exp(1j * taken)) + np.eye(taken.size)
        return bool(np.all(np.abs(end - start) < SAME) and 1 < taken.size < 5 and np.min(apart) > SAME)

    def _other(self, psi: float) -> float:
        """Return the other heading with the same rates of two positions, rad."""
        return math.remainder(2.0 * self.model.zero - psi, 2.0 * math.pi)

    def _side(self, psi: Coefficient) -> list[Reason]:
        """Return what speaks against the heading that the rough one chose, of the two that two positions have."""
        s, second = self.setup, self._other(psi.estimate * DEG) / DEG
        both = f"Two positions have two headings, {plain(psi.estimate, 4)}° and {plain(second, 4)}°"
        if not s.sigma_rough:
            chosen = (
                f"{both}; the rough one, {plain(s.rough / DEG, 4)}°, chose, and nothing in the record would show that "
                "it "
            )
            text = f"{chosen}lies on the wrong side. State its standard uncertainty, sigma_rough, or {THIRD}."
            return [] if s.rough_stated else [_doubt("rough.unstated", text, "pass")]
        u = math.hypot(s.sigma_rough, psi.u * DEG)
        here, other = (abs(math.remainder(x * DEG - s.rough, 2.0 * math.pi)) / u for x in (psi.estimate, second))
        rough = f"the rough one is {plain(s.rough / DEG, 4)}° ± {plain(s.sigma_rough / DEG)}°"
        if here > MOST:
            return [_doubt("rough.contradicts", f"{both}; {rough} (u), {here:.1f} standard uncertainties from it.")]
        if other < MOST and not psi.interval[0] < second < psi.interval[1]:
            return [
                _doubt("rough.open", f"{both}; {rough} (u), which does not choose one. Know it better, or {THIRD}.")
            ]
        return []

    def summary(self, found: Findings, coefficients: Sequence[Coefficient]) -> list[str]:
        psi, expected = coefficients[0], self.north / DPH
        decimals = max(0, 1 - math.floor(math.log10(psi.k * psi.u))) if psi.u > 0.0 else 3
        compass = f"{round(psi.estimate % 360.0, decimals) % 360.0:.{decimals}f}"
        rate = f"Horizontal Earth rate {{A}}; the latitude gives {plain(expected, 5)} °/h."
        return [
            *told(coefficients, f"Heading ψ = {{ψ}}, clockwise from north; on the compass {compass}°."),
            *found.nuisance_sentences(),
            *told(coefficients, rate),
        ]

    def _integrity(self, psi: float, A: float) -> Table:
        s, p = self.setup, self.model
        rows: list[list[Any]] = []
        if not math.isnan(A):
            rows += [
                ["horizontal Earth rate of the latitude", self.north / DPH, "°/h"],
                ["measured less this, relative", (A / self.north - 1.0) * 100.0, "%"],
            ]
        if math.isnan(A):
            rows.append(["the other heading with these rates", self._other(psi) / DEG, "°"])
        if p.force is not None:
            theta, gamma = attitude(p.force.x, p.force.y, s.gravity)
            rows += [["pitch, up positive", theta / DEG, "°"], ["roll, right side down positive", gamma / DEG, "°"]]
        if s.finder:
            rows += [
                ["heading of the finder in the run", s.finder["heading"] / DEG, "°"],
                ["its standard deviation, by white noise alone", s.finder["sigma"] / ARCMIN, "′"],
                ["its status (1 valid, 2 ill-conditioned, 3 rate wrong, 4 base moves)", s.finder["status"], "1"],
            ]
        caption = "What speaks for the heading besides its interval"
        return Table("integrity", "Integrity", caption, ["quantity", "value", "unit"], rows)


def _doubt(id: str, text: str, *blocks: str) -> Reason:
    return Reason(id, text, blocks or ("pass", "fail"), severity="doubt")


def setup_of(record: Record) -> NorthFinderSetup:
    """Return the setup that a record describes."""
    run, windows = record.run, record.windows
    names = {n: f"finder.{n}" for n in ("heading", "sigma", "status")}
    there = all(c in record.channels for c in names.values())
    finder = {n: float(np.asarray(record.channels[c])[-1]) for n, c in names.items()} if there else None
    begin = float(windows["t_start"][0]) if run.measured else 0.0
    time = float(windows["t_end"][-1]) - begin
    return NorthFinderSetup.of(run, truth=_truth(run, windows), finder=finder, time=time)


def method_of(run: RunDocument) -> str:
    """Return the method of a run; of auto the one that was chosen."""
    method = str(run.options.get("method", "four"))
    return plans.shortest(run.options, float(run.step or 1e-3))[1] if method == "auto" else method


def _truth(run: RunDocument, windows: Mapping[str, Array]) -> dict[str, float] | None:
    if run.measured:
        return None
    site, p = Location.of(run), run.parameters
    truth = {"ψ": float(run.options["heading"]), "A": site.earth_rate * math.cos(site.latitude)}
    order = int(run.options.get("drift_order", 0))
    if "gyro.bias" in p and bias_is_all(p):
        bias, ramp, curve = (float(np.ravel(p.get(f"gyro.{n}", [0.0, 0.0]))[1]) for n in ("bias", "ramp", "curve"))
        if order >= 2 or (curve == 0.0 and (order == 1 or ramp == 0.0)):
            # bias + ramp t + curve t2 over t = middle + half x; x2 = (2 P_2 + 1)/3
            first, last = (float(x) for x in (windows["t_start"][0], windows["t_end"][-1]))
            middle, half = (first + last) / 2.0, (last - first) / 2.0
            truth["b"] = bias + ramp * middle + curve * (middle**2 + half**2 / 3.0)
            terms = (half * (ramp + 2.0 * curve * middle), 2.0 / 3.0 * curve * half**2, 0.0)
            truth |= {f"d_{k + 1}": x for k, x in enumerate(terms[:order])}
    return truth
