"""Reduction of a north finding: heading, horizontal Earth rate and bias from the windows of a method.

    w_y = A cos(psi - angle) + bias        A = W cos(latitude)

by least squares under a noise model estimated from the windows; the heading is a function of the unknowns, its interval
that of first order.  What the finder in the run says stands beside it.  [NORTH-COMMON; GSP ch. 5, section 5.3.2]

Not modelled: linear drift of the bias unless the nuisance model finds it, motion of the base, heading intervals of
two positions near north and south, where first order does not hold (no value is stated there).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy import special

from gyrobench import frames, units
from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation import nuisances, uncertainty
from gyrobench.reduction.estimation.effects import Effect
from gyrobench.reduction.estimation.findings import Findings, Group
from gyrobench.reduction.estimation.fit_result import linear_result, plus_minus
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.setup import run_metadata
from gyrobench.reduction.setup.setups import SiteSetup
from gyrobench.reduction.setup.sources import LATITUDE, Source
from gyrobench.reduction.setup.window_checks import ReductionError, window_problems
from gyrobench.result import DriftTestResult, Specification, Table

from . import plans
from .model import Place, Problem, attitude, of_windows, tilted_heading

__all__ = ["ReductionError", "Setup", "from_record", "reduce"]

DPH, DEG, ARCMIN = units.factor("deg/h"), units.factor("deg"), units.factor("arcmin")
NEAR = 0.2  # largest departure of the horizontal rate from that of the latitude
LEVEL = 1e-3  # of the test of that departure
MANY = 3.0  # standard deviations of the horizontal rate, at least
APART = 4.0  # of two positions: of the heading from north or south.  psi2 = 2 (1 - cos): the cosine is then 2 u from 1


@dataclass(frozen=True, kw_only=True)
class Setup(SiteSetup):
    """method: a key of plans.PARTS.  rough: rough heading, rad.  finder: what the estimator of the run says.

    density of the white rate noise (rad/s/sqrt(Hz); 0: unknown), total time and settling (s): for the comparison of the
    methods.
    """

    method: str
    rough: float = 0.0
    finder: Mapping[str, float] | None = None
    density: float = 0.0
    time: float = 0.0
    settle: float = 0.0
    u_latitude: float = 0.0
    u_angle: float = 0.0
    u_level: float = 0.0
    u_accelerometer: float = 0.0
    u_bias: float = 0.0
    unbiased: bool = False  # the gyro is simulated without bias, or it is declared that there is none

    @property
    def place(self) -> Place:
        _, north, up = frames.earth_rate_local(self.latitude, self.earth_rate)
        return Place(float(north), float(up), self.gravity, self.rough)


def reduce(windows: Mapping[str, Array], setup: Setup) -> DriftTestResult:
    """Heading from windows: phase, t_start, t_end (s), angle_start, angle_end (rad), mean (rad/s, along y), and, by
    method, mean_x (rad/s), f_x, f_y (m/s2).  Raises ReductionError with everything that is wrong.
    """
    problems = frames.latitude_problems(setup.latitude) + frames.gravity_problems(setup.gravity)
    if setup.method not in plans.PARTS:
        problems.append(f"method = {setup.method}: must be one of {', '.join(plans.PARTS)}")
    problems += window_problems(windows)
    if problems:
        raise ReductionError(problems)
    place = setup.place
    p = of_windows(setup.method, windows, place)
    found = _fitted(setup, p, windows)
    if not _determined(found, p):
        raise ReductionError(
            "the rates do not determine the heading: their horizontal part is below three times its uncertainty, or, "
            "with two positions, the heading is within four standard uncertainties of north or south; take four "
            "positions, or a longer time"
        )
    psi, A = p.heading(found.est.beta[: p.X.shape[1]])
    if abs(A / place.north - 1.0) > NEAR:
        raise ReductionError(
            f"horizontal Earth rate {A / DPH:.4g} °/h, at this latitude it is {place.north / DPH:.4g} °/h: latitude, "
            "unit or axes are wrong, or the base moves"
        )
    truth = setup.truth or {}
    result = linear_result(
        _derived(found, p, truth),
        system="north_finder",
        title="North finding by gyro",
        method=f"Method {setup.method}: least squares over the angles of the head under an estimated noise model "
        "[NORTH-COMMON]",
        sources=["NORTH-COMMON, NORTH-2POS, NORTH-4POS, NORTH-CONT, NORTH-TILT, NORTH-STRAPDOWN; GSP ch. 5, "
                 "eq. 5-44..5-65, corrected"],
        equation='w_y = A cos(psi - "angle") + b, quad A = omega_E cos phi',
        conventions=[
            "Heading ψ of the axis y of the head at table angle 0, clockwise from north; table angles anticlockwise.",
            "At rest the specific force points up: nose up makes f_y positive, right side down f_x negative.",
        ],
        effects=_effects(setup, _derived(found, p, truth), p),
        **setup.reported(),
        tables=_tables(setup, p, psi, A),
    )  # fmt: skip
    return _judged(result, setup, p)


def _fitted(s: Setup, p: Problem, windows: Mapping[str, Array]) -> Findings:
    two = p.X.shape[0] > len(windows["mean"])
    weighed = nuisances.common(windows) if s.nuisances and not two else []
    clockwise = np.degrees(np.unwrap(p.along)) if s.method in plans.TURNING else np.degrees(p.along)
    grid = np.linspace(0.0, 360.0, 181)
    curve = [np.cos(np.radians(grid)), -np.sin(np.radians(grid)), np.ones_like(grid)]
    smooth = {2: (grid, np.column_stack([curve[0], curve[2]])), 3: (grid, np.column_stack(curve))}.get(p.X.shape[1])
    dense = None if s.method.startswith("strapdown") or s.method in plans.TURNING else smooth
    shown = [
        Group(f"rate along {name}", np.flatnonzero(p.axis == a), clockwise[p.axis == a], "head angle", "°", dense)
        for name, a in (("y", 1.0), ("x", 0.0))
        if np.any(p.axis == a)
    ]
    return fit(list(p.names), p.X, p.y, p.t_start, p.t_end, shown, "rate", "°/h", DPH, candidates=weighed)


def _function(found: Findings, p: Problem) -> tuple[Any, float]:
    middle = p.heading(found.est.beta[: p.X.shape[1]])[0]

    def values(a: Array) -> list[float]:
        psi, A = p.heading(a)
        out = [middle + math.remainder(psi - middle, 2.0 * math.pi)]  # no jump at the south
        if not math.isnan(A):
            out.append(A)
        return out + ([float(a[p.bias])] if p.bias >= 0 else [])

    return values, middle


def _derived(found: Findings, p: Problem, truth: Mapping[str, float]) -> Findings:
    values, middle = _function(found, p)
    true = truth.get("ψ")
    near = None if true is None else middle + math.remainder(true - middle, 2.0 * math.pi)
    quantities = [Quantity.of("ψ", "heading of the axis y, clockwise from north", "deg", near)]
    if not math.isnan(p.heading(found.est.beta[: p.X.shape[1]])[1]):
        quantities.append(Quantity.of("A", "horizontal Earth rate", "deg/h", truth.get("A")))
    if p.bias >= 0:
        quantities.append(Quantity.of("b", "bias of the gyro along y", "deg/h", truth.get("b")))
    return found.derive(quantities, values)


def _determined(found: Findings, p: Problem) -> bool:
    """Whether first order holds: the horizontal part, or with two positions 1 - |cos psi|, is beyond its noise."""
    if found.ideal:
        return True
    u = np.asarray(found.u)[: p.X.shape[1]]
    psi, A = p.heading(found.est.beta[: p.X.shape[1]])
    if math.isnan(A):
        north = abs(float(found.est.beta[0])) / max(abs(math.cos(psi)), 1e-9)
        return abs(math.sin(psi)) > APART * float(u[0]) / max(north, 1e-12) / max(abs(math.sin(psi)), 1e-9)
    return MANY * float(np.max(u[:2])) < A


def _effects(s: Setup, found: Findings, p: Problem) -> list[Effect]:
    """Sources of type B, by the change of the rates, or of the heading where they act on it directly."""
    q = found.value.size
    psi = float(found.value[0])
    on_heading = np.zeros(q)
    on_heading[0] = 1.0
    out = [
        Source("zero_of_the_head_against", "zero of the head against the reference", "rad", "u_angle").effect(
            s, values=on_heading
        )
    ]
    if p.force is None:
        towards = psi + p.along
        out += [
            Source(f"tilt_of_the_head_about:{n}", f"tilt of the head about {n}", "rad", "u_level").effect(
                s, found.error(s.place.up * c), note="right-handed"
            )
            for n, c in (("east", np.cos(towards)), ("north", -np.sin(towards)))
        ]
    if s.method == "strapdown":
        for name, axis in (("x", 0.0), ("y", 1.0)):
            out.append(
                Source(f"bias_of_the_gyro_along:{name}", f"bias of the gyro along {name}", "rad/s", "u_bias").effect(
                    s, found.error((p.axis == axis) * 1.0)
                )
            )
    if p.force is not None:
        f = p.force
        for name, u, moved in (("x", f.u_x, (1.0, 0.0)), ("y", f.u_y, (0.0, 1.0))):
            values = _by_heading(s, found, p, force=moved)
            out.append(
                Source(
                    f"noise_of_the_accelerometers_along:{name}", f"noise of the accelerometers along {name}", "m/s2"
                ).effect(u, values=values)
            )
            if s.method == "strapdown":  # two positions and a turning head take it out
                size = s.u_accelerometer
                out.append(
                    Source(
                        f"bias_of_the_accelerometer_along:{name}", f"bias of the accelerometer along {name}", "m/s2"
                    ).effect(size, values=values)
                )
        out.append(_latitude(s, _by_heading(s, found, p, latitude=1.0)))
    elif s.method == "two":
        on_heading = np.zeros(q)
        on_heading[0] = -math.tan(s.latitude) * math.cos(psi) / math.sin(psi)  # cos psi = c / A
        out.append(_latitude(s, on_heading))
    return out


def _latitude(s: Setup, values: Array) -> Effect:
    return LATITUDE.effect(s, values=values)


def _by_heading(
    s: Setup, found: Findings, p: Problem, force: tuple[float, float] = (0.0, 0.0), latitude: float = 0.0
) -> Array:
    """Change (q,) of the values for a unit of the force along x and y as read, or of the latitude as stated."""
    assert p.force is not None and p.rates is not None
    rates, step = p.rates(found.est.beta[: p.X.shape[1]]), 1e-6

    def at(sign: float) -> Array:
        place = replace(s.place, up=s.place.up + sign * step * latitude * s.place.north)
        x, y = (f + sign * step * d for f, d in zip((p.force.x, p.force.y), force, strict=True))  # type: ignore[union-attr]
        return np.array(tilted_heading(rates, x, y, place))

    change = (at(1.0) - at(-1.0)) / (2.0 * step)
    change[0] = math.remainder(change[0] * 2.0 * step, 2.0 * math.pi) / (2.0 * step)
    return np.concatenate([change, np.zeros(found.value.size - 2)])


def _tables(s: Setup, p: Problem, psi: float, A: float) -> list[Table]:
    rows: list[list[Any]] = []
    if not math.isnan(A):
        rows += [
            ["horizontal Earth rate of the latitude", s.place.north / DPH, "°/h"],
            ["measured less this, relative", (A / s.place.north - 1.0) * 100.0, "%"],
        ]
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
    integrity = Table("integrity", "Integrity", caption, ["quantity", "value", "unit"], rows)
    return [integrity, *_methods(s, psi)]


def _methods(s: Setup, psi: float) -> list[Table]:
    """What each method reaches in the same total time with the noise of this gyro."""
    if not s.density > 0.0 or not s.time > 0.0:
        return []
    rows: list[list[Any]] = []
    for method in plans.PARTS:
        reading = s.time - plans.overhead(method, 12, False, s.settle, 1e-3)
        sigma = plans.reached(method, s.density, s.latitude, psi, reading) / ARCMIN if reading > 0.0 else None
        needs = "one gyro axis" if not method.startswith("strapdown") else "two gyro axes"
        bias = "stays in the heading" if method == "strapdown" else "removed"
        level = "measured" if method == "tilt" or method.startswith("strapdown") else "taken for level"
        rows.append([method, reading, sigma, needs, bias, level])
    caption = (
        f"Standard deviation of the heading by white noise of {s.density / DPH:.3g} °/h/√Hz, closed form, in the same "
        "total time, moves of the head included"
    )
    head = ["method", "time of readings / s", "σ(ψ) / ′", "needs", "bias of the gyro", "tilt of the head"]
    return [Table("methods_in_the_same_time", "Methods in the same time", caption, head, rows)]


def _judged(result: DriftTestResult, s: Setup, p: Problem) -> DriftTestResult:
    """Say the heading in words, and withhold a verdict where the horizontal rate contradicts the latitude."""
    by_name = {c.name: c for c in result.coefficients}
    psi, A = by_name["ψ"], by_name.get("A")
    text = f"Heading ψ = {plus_minus(psi)}, clockwise from north; on the compass {psi.estimate % 360.0:.3f}°."
    result.summary = [text, *result.summary]
    reasons = []
    if A is not None:
        expected = s.place.north / DPH
        result.summary.append(f"Horizontal Earth rate {plus_minus(A)}; the latitude gives {expected:.5g} °/h.")
        off = abs(A.estimate - expected) / A.u if A.u > 0.0 else 0.0
        if 2.0 * float(special.ndtr(-off)) < LEVEL:
            reasons.append(
                f"The horizontal Earth rate departs from that of the latitude by {off:.1f} standard uncertainties."
            )
    if s.finder and s.finder["status"] != 1.0:
        words = {2.0: "is ill-conditioned", 3.0: "contradicts the latitude", 4.0: "is of a moving base"}
        reasons.append(f"The finder says that the heading {words.get(s.finder['status'], 'is not there')}.")
    uncertainty.withhold(result, reasons)
    if s.method == "strapdown" and not s.u_bias and not s.unbiased:
        turned = math.degrees(0.1 * DPH / s.place.north)
        text = (
            f"One position leaves the bias of the gyro in the heading, which 0.1 °/h turn by up to {turned:.2g}°. It "
            "is not in u. State u_bias, or take the method strapdown two."
        )
        uncertainty.withhold(result, [text], ["pass"])
        if not any(text in w for w in result.warnings):
            result.warnings.insert(0, text)
    return result


def setup_of(record: Record, specification: Specification | None = None) -> Setup:
    """Return the setup that a record describes."""
    run, o = record.run, record.run.options
    windows = record.windows
    time = float(windows["t_end"][-1]) - (0.0 if not run.measured else float(windows["t_start"][0]))
    return Setup.of(
        run, specification, method=method_of(run), rough=float(run.options.get("rough", 0.0)),
        finder=_last(record), truth=_truth(run), time=time, settle=float(o.get("settle", 0.0)),
        density=float(o.get("density", 0.0)) or float(run.parameters.get("gyro.white_y", 0.0)),
        unbiased=run.type_b == "none" or not np.any(run.parameters.get("gyro.bias", 1.0)),
    )  # fmt: skip


def method_of(run: RunDocument) -> str:
    """The method of a run; of auto the one that was chosen."""
    o = run.options
    if o.get("method") != "auto":
        return str(o.get("method", "four"))
    return plans.shortest(
        float(o["wanted"]), float(o["density"]), float(o["latitude"]), float(o["rough"]), bool(o["level"]),
        int(o["axes"]), float(o["settle"]), float(run.step or 1e-3),
    ).method  # fmt: skip


def _last(record: Record) -> dict[str, float] | None:
    names = {n: f"finder.{n}" for n in ("heading", "sigma", "status")}
    channels = record.channels
    if not all(n in channels for n in names.values()):
        return None
    return {n: float(np.asarray(channels[c])[-1]) for n, c in names.items()}


def _truth(run: RunDocument) -> dict[str, float] | None:
    if run.measured:
        return None
    o, p = run.options, run.parameters
    site = run_metadata.Site.of(run)
    truth = {"ψ": float(o["heading"]), "A": site.earth_rate * math.cos(site.latitude)}
    bias = p.get("gyro.bias")
    if bias is not None and not np.any(np.asarray(p.get("gyro.ramp", 0.0))):
        truth["b"] = float(np.asarray(bias)[1])
    return truth


def from_record(record: Record, specification: Specification | None = None) -> DriftTestResult:
    """:func:`reduce` of a record with its run.json as provenance."""
    return run_metadata.finish(reduce(record.windows, setup_of(record, specification)), record)
