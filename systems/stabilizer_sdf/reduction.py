"""Reduction of stabilizer_sdf: what the axis did under the torque, beside the closed form of its kind of gyro."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.loop_summary import isolation, margins
from gyrobench.reduction.loops.loop_toolkit import Account, Gate, LoopFindings, LoopReduction, told, trace
from gyrobench.reduction.loops.platform_measures import level_drift
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.result import Table
from gyrobench.units import ARCMIN, DPH

from . import closed
from .closed import StabilizedAxis

SHOWN = 500  # points of a drawn curve
EQUATIONS = {
    "integrating": "J_0 dot.double(alpha) + H cos beta dot(beta) = M, quad "
    "J dot.double(beta) - H cos beta dot(alpha) = 0",
    "rate-integrating": "J_0 dot.double(alpha) + H cos beta dot(beta) = M, quad "
    "J dot.double(beta) + C dot(beta) - H cos beta dot(alpha) = 0",
    "rate": "J_0 dot.double(alpha) + H cos beta dot(beta) = M, quad "
    "J dot.double(beta) + C dot(beta) + K beta - H cos beta dot(alpha) = 0",
}


class Reduction(LoopReduction):
    """Load, drift, command, margins and isolation of an axis that its gyro stabilizes."""

    def measure(self) -> Account:
        run, found = self.run, self.found
        self.kind = kind = str(run.options.get("kind"))
        if kind not in closed.FORMS:
            raise ReductionError(f"the record does not say the kind of gyro: one of {', '.join(closed.FORMS)}")
        self.load = self._load()
        held = float(np.mean(np.cos(self.load["gyro.b"])))
        self.plant = p = plant(run, held)
        t = self.load.t - self.load.t[0]
        idle = run.parameters.get("stabilizer.K") == 0.0  # another stabilizer has no K, and a torque of its own
        self.free = idle and not run.options.get("viscous")
        found.tables.append(_derived(p, kind, held))
        if self.free:
            _closed_forms(found, p, kind, str(run.options.get("form")), self.load, t, run.step)
        else:
            found.step(self.load, "platform.attitude", scale=ARCMIN, unit="arcmin", y_name="platform angle")
            text = "The closed forms know neither motor nor friction: the figures are of the run alone."
            found.warn("stabilizer_sdf.no_closed", text)
            end, last = coupling(p, t[-1], run.step) / 3**0.5, self.load["platform.attitude"][-1]
            found.measure("a(T)", "platform angle at the end of the load", "arcmin", last, end, scale=ARCMIN)
        late = math.degrees(p.M * run.step / p.H) / 3**0.5
        largest = math.degrees(np.abs(self.load["gyro.b"]).max())
        found.measure("b_max", "largest angle of the float", "°", largest, late)
        if self.free:  # a motor brings a slow pole in that is not in the fit beside the nutation
            _drift(found, p, kind)
            _command(found, p, kind)
        for step in found.of("command", 1, "step"):
            found.step(step, "platform.omega[1]", scale=1e-6, unit="µrad/s", y_name="platform rate")
        found.open_loop("stabilizer", "stabilizer.e", "exciter.test[1]")
        found.ratio("isolation", "motion", 1, "platform.attitude", "exciter.motion_angle[1]",
                    caption="Angle of the platform over that of the base.")  # fmt: skip
        return Account(
            method="Load step on the axis in the co-simulation, platform and gyro coupled by their momentum, against "
            "the closed form",
            sources=["STAB-SDF-INT, STAB-SDF-RATEINT, STAB-SDF-RATE; GSP ch. 5, eq. 5-27..5-43, corrected by EG9-EG13"],
            title=f"Stabilizer with a gyro of one degree of freedom: {kind} gyro",
            equation=EQUATIONS[kind],
            conventions=[
                "alpha is the inertial angle of the platform, beta the angle of the float in its case; both positive "
                "for a positive torque.",
                f"The closed forms hold cos(beta), here at its mean over the load, {plain(held, 6)}: H stands for "
                "H cos(beta).",
                "u: scatter of the fit and, as a rectangular distribution, what the exchange once a step may do.",
            ],
        )

    def _load(self) -> Gate:
        loads = self.found.of("torque", 1, "step")
        if not loads:
            raise ReductionError("the phase 'load' is not whole in this record: the run ended before")
        return loads[0]

    def summary(self) -> list[str]:
        ends = next((c for c in self.found.coefficients if c.name == "a(T)"), None)
        if ends is None:
            return []
        gate, p = self.load, self.plant
        beside = f" (closed form {plain(ends.closed, 4)} arcmin)" if ends.closed is not None else ""
        return [
            *margins(self.found),
            *isolation(self.found, "isolation", "platform.attitude"),
            *told(
                self.found.coefficients,
                f"After {plain(gate.t[-1] - gate.t[0], 4)} s of {p.M:g} N·m the platform leans by {{a(T)}}{beside}.",
                f"The float then stands at {plain(math.degrees(gate['gyro.b'][-1]), 3)}°; it was never beyond "
                f"{{b_max}}.",
                SAID[self.kind](p) if self.free else "",
            ),
        ]


SAID = {
    "integrating": lambda p: f"The gyro holds the axis like a spring of {plain(p.stiffness, 4)} N·m/rad.",
    "rate-integrating": lambda p: f"The axis creeps with M C/H² = {plain(p.M * p.C / p.H**2 / ARCMIN, 4)} arcmin/s.",
    "rate": lambda p: f"The axis feels like an inertia of {plain(p.inertia, 5)} kg·m² instead of {plain(p.J0, 5)}.",
}


def plant(run: RunDocument, held: float = 1.0) -> StabilizedAxis:
    """Return the axis as the parts had it, with H times the cos(b) that the closed forms hold."""
    q = run.parameters
    names = ("platform.J", "gyro.J", "gyro.H", "gyro.C", "gyro.K")
    missing = [n for n in names if n not in q]
    if missing:
        raise ReductionError([f"the record does not say {n}" for n in missing])
    j0, j, spin, c, k = (float(q[n]) for n in names)
    return StabilizedAxis(j0, j, spin * held, c, k, float(run.options["M"]))


def coupling(p: StabilizedAxis, t: Array | float, step: float) -> Any:
    """Return what the held exchange may do to the platform's angle, rad: one step of torque late or early, M h t/J0."""
    return p.M * step * np.asarray(t) / p.J0


def _closed_forms(
    found: LoopFindings, p: StabilizedAxis, kind: str, form: str, gate: Gate, t: Array, step: float
) -> None:
    """Measure the coefficients of the kind, and show the two curves and how far they are apart."""
    a, b = gate["platform.attitude"] - gate["platform.attitude"][0], gate["gyro.b"] - gate["gyro.b"][0]
    wanted_a, wanted_b = closed.light(p, t) if form == "light" else closed.FORMS[kind](p, t)
    end = float(coupling(p, t[-1], step))
    found.measure("a(T)", "platform angle at the end of the load", "arcmin", a[-1], end / 3**0.5, scale=ARCMIN,
                  closed=wanted_a[-1])  # fmt: skip
    found.measure("b(T)", "float angle at the end of the load", "°", math.degrees(b[-1]),
                  math.degrees(p.M * step / p.H) / 3**0.5, closed=math.degrees(wanted_b[-1]))  # fmt: skip
    {"integrating": _integrating, "rate-integrating": _rate_integrating, "rate": _rate}[kind](found, p, t, a, b, step)
    apart = float(np.abs(a - wanted_a).max()), float(np.abs(b - wanted_b).max())
    caption = (
        f"Over the whole load. The exchange once a step of {step:g} s may shift platform and float by M h t/J0 and "
        "M h/H; both shrink with the step. The rest is cos(b) and, with form=light, that form."
    )
    columns = ["angle", "largest difference", "expected of the exchange", "largest value", "unit"]
    rows = [
        ["platform", apart[0] / ARCMIN, end / ARCMIN, float(np.abs(a).max()) / ARCMIN, "arcmin"],
        ["float", math.degrees(apart[1]), math.degrees(p.M * step / p.H), math.degrees(np.abs(b).max()), "°"],
    ]
    found.tables.append(Table("load.closed", "Co-simulation against the closed form", caption, columns, rows))
    label = "closed form, light damping" if form == "light" else "closed form"
    caption = f"angle from the beginning of the load on: co-simulation, and the {label}."
    float_angle, wanted_angle = np.degrees(b), np.degrees(wanted_b)
    found.responses += [
        trace("load", f"The platform {caption}", t, a / ARCMIN, "platform angle", "arcmin", {label: wanted_a / ARCMIN},
              SHOWN),
        trace("load, float", f"The float {caption}", t, float_angle, "float angle", "°", {label: wanted_angle}, SHOWN),
    ]  # fmt: skip


def least_squares(columns: Array, y: Array) -> tuple[Array, Array]:
    """Return coefficients and their standard uncertainties by ordinary least squares."""
    size = np.abs(columns).max(axis=0)
    x, *_ = np.linalg.lstsq(columns / size, y, rcond=None)
    rest = y - columns / size @ x
    inverse = np.linalg.inv((columns / size).T @ (columns / size))
    u = np.sqrt(np.diag(inverse) * (rest @ rest) / max(1, y.size - x.size))
    return x / size, u / size


def _integrating(found: LoopFindings, p: StabilizedAxis, t: Array, a: Array, b: Array, step: float) -> None:
    """Fit a = A (1 - cos n t) + slope t and a sine for what the exchange adds; n by search about the closed form."""
    from scipy.optimize import minimize_scalar

    def columns(n: float) -> Array:
        return np.column_stack([1.0 - np.cos(n * t), np.sin(n * t), t])

    def misfit(n: float) -> float:
        x, *_ = np.linalg.lstsq(columns(n), a, rcond=None)
        return float(np.sum((a - columns(n) @ x) ** 2))

    width = min(0.2 * p.n, math.pi / t[-1])
    n = float(minimize_scalar(misfit, bounds=(p.n - width, p.n + width), method="bounded", options={"xatol": 1e-9}).x)
    x, u = least_squares(columns(n), a)
    stiff = p.M / x[0]
    found.measure("S", "stiffness of the axis", "N.m/rad", stiff, stiff * u[0] / abs(x[0]), closed=p.stiffness)
    # the held exchange shifts the frequency by its second order, n2 h2/24 and less
    found.measure("n", "nutation frequency", "rad/s", n, n * (n * step) ** 2 / 12.0 + 1e-9 * n, closed=p.n)
    y, v = least_squares(np.column_stack([t, np.sin(n * t), 1.0 - np.cos(n * t)]), b)
    found.measure("db/dt", "runaway of the float", "°/s", math.degrees(y[0]), math.degrees(v[0]),
                  closed=math.degrees(p.M / p.H))  # fmt: skip


def _rate_integrating(found: LoopFindings, p: StabilizedAxis, t: Array, a: Array, b: Array, step: float) -> None:
    """Fit a = o + r t and the transient, b = line and transient."""
    columns = np.column_stack([np.ones(t.size), t, p.transient(t)])
    x, u = least_squares(columns, a)
    o, r = closed.line(p)
    slide = p.M * step / p.J0 / 3**0.5
    creep, late = math.hypot(u[1], slide), p.M * step / p.H / 3**0.5
    found.measure("da/dt", "creep of the platform", "arcmin/s", x[1], creep, scale=ARCMIN, closed=r)
    off = math.hypot(u[0], r * step / 3**0.5)
    found.measure("o", "offset of the platform's line", "arcmin", x[0], off, scale=ARCMIN, closed=o)
    damping = p.M / x[1]
    found.measure("H²/C", "damping that the axis feels", "N.m.s/rad", damping, damping * creep / abs(x[1]),
                  closed=p.H**2 / p.C)  # fmt: skip
    y, v = least_squares(columns, b)
    found.measure("b_o", "offset of the float's line, -J0 C M/H³", "arcmin", y[0], math.hypot(v[0], late),
                  scale=ARCMIN, closed=-p.J0 * p.C * p.M / p.H**3)  # fmt: skip


def _rate(found: LoopFindings, p: StabilizedAxis, t: Array, a: Array, b: Array, step: float) -> None:
    """Fit a = parabola and the transient."""
    x, u = least_squares(np.column_stack([0.5 * t**2, t, np.ones(t.size), p.transient(t)]), a)
    inertia = p.M / x[0]
    found.measure("J0 + H²/K", "apparent inertia of the axis", "kg.m2", inertia, inertia * u[0] / abs(x[0]),
                  closed=p.inertia)  # fmt: skip
    slide = p.M * step / p.J0 / 3**0.5
    total = p.K * p.J0 + p.H**2
    found.measure("slope", "line beside the parabola, C H² M/(K J0 + H²)²", "arcmin/s", x[1],
                  math.hypot(u[1], slide), scale=ARCMIN, closed=p.C * p.H**2 * p.M / total**2)  # fmt: skip


def _slope(p: StabilizedAxis, t: Array, a: Array) -> tuple[float, float]:
    """Return the rate of an angle beside the nutation, rad/s, and its standard uncertainty."""
    x, u = least_squares(np.column_stack([t - t[0], np.ones(t.size), p.transient(t - t[0])]), a)
    return float(x[0]), float(u[0])


def _drift(found: LoopFindings, p: StabilizedAxis, kind: str) -> None:
    """Measure how the axis follows the drift of its gyro after the load; with a rate gyro it keeps its rate."""
    own = level_drift(found.run.parameters)
    for gate in found.of("hold") if kind != "rate" else ():
        r, u = _slope(p, gate.t, gate["platform.attitude"])
        turned = None if own is None else own / float(np.mean(np.cos(gate["gyro.b"])))
        found.measure("drift", "rate of the axis after the load", "°/h", r, u, scale=DPH, closed=turned)


def _command(found: LoopFindings, p: StabilizedAxis, kind: str) -> None:
    """Measure the change of the rate by a current i in the torquer, over k i: 1/c, and with a spring the less, c =
    cos(b).

    Behind the transient, about the present b and a': J0 da' = -H c db, K db = H c da' - H a' sin(b) db - H k i, so
    da'/(k i) = H2 c / (H2 c2 + J0 (K + H a' sin b)).
    """
    spin = float(found.record.run.parameters["gyro.H"])
    for gate in found.of("command", 1, "step"):
        angle = found.record.channels["platform.attitude"]
        before, u_before = _slope(p, found.record.channels["time"][gate.before], angle[gate.before])
        after, u = _slope(p, gate.t, gate["platform.attitude"])
        b = float(np.mean(gate["gyro.b"]))
        spring = p.K + spin * before * math.sin(b) if kind == "rate" else 0.0
        c = math.cos(b)
        wanted = spin**2 * c / ((spin * c) ** 2 + p.J0 * spring)
        u_share = math.hypot(u, u_before) / abs(gate.amplitude)
        found.measure("rate gain", "change of rate over rate commanded", "1", (after - before) / gate.amplitude,
                      u_share, closed=wanted)  # fmt: skip


def _derived(p: StabilizedAxis, kind: str, held: float) -> Table:
    rows: list[list[Any]] = [
        ["cos(b) held by the closed forms, mean over the load", held, "1"],
        ["nutation without damping, √(H²/(J J0) + K/J)", p.n, "rad/s"],
        ["damping of the nutation", p.zeta, "1"],
    ]
    if kind == "integrating":
        rows.append(["quasi-spring H²/J", p.stiffness, "N.m/rad"])
    elif kind == "rate-integrating":
        rows.append(["H/C", p.H / p.C, "1"])
        rows.append(["aperiodic limit of C, 2 √(J/J0) H", 2.0 * math.sqrt(p.J / p.J0) * p.H, "N.m.s/rad"])
    else:
        rows.append(["apparent inertia J0 + H²/K", p.inertia, "kg.m2"])
    columns = ["of the closed form", "value", "unit"]
    return Table("sizes", "Sizes of the axis", "From the parameters of the run.", columns, rows)
