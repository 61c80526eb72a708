"""What was found of a loop in one record.

found = LoopFindings(record)
loop = found.open_loop("pitch", "stabilizer.e", "exciter.test[1]")          # Bode plot, margins, check against linear
found.ratio("isolation", "motion", 1, "platform.attitude", "exciter.motion_angle[1]", ...)
found.step("load step", gate, "platform.attitude", scale=ARCSEC, unit="arcsec")
found.measure("K", "stiffness", "N.m/rad", value, u, closed=H * K_m / C_b)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from gyrobench.arrays import Array
from gyrobench.record.frequency_response import TOLERANCE, model_response
from gyrobench.record.record import Record
from gyrobench.record.run_document import LinearModel, LinearModels, LinearPair, RunDocument
from gyrobench.reduction.estimation import uncertainty
from gyrobench.reduction.estimation.fit_result import Account
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops import margins as m
from gyrobench.reduction.loops.loop_curves import CURVE, bode, curve, simulated, step_figure
from gyrobench.reduction.loops.loop_drift import Drift, drift
from gyrobench.reduction.loops.loop_measures import (
    LAST,
    Gate,
    Point,
    Step,
    gates,
    response,
    short_rest,
    step,
    step_noise_std,
)
from gyrobench.reduction.loops.measure_findings import MeasureFindings
from gyrobench.reduction.loops.open_loop import (
    Twin,
    disagreement,
    excluded_words,
    friction_of,
    lead_of,
    limits_hit,
    open_loop_point,
    why_no_crossover,
)
from gyrobench.reduction.loops.slow_drift import slow_drift
from gyrobench.reduction.loops.validity import why_void
from gyrobench.result import AllanDeviation, LoopResult, Reason, Table
from gyrobench.units import DPH

AGREEMENT = "Largest deviations of the measured points from the model, up to twice the gain crossover frequency"
AGREEMENT_COLUMNS = ["model", "up to / Hz", "points", "gain / dB", "phase / °", "loop"]
DECIBEL = 20.0 / math.log(10.0)  # of a relative uncertainty
NAMES = {"discrete": "linear, with step and delays", "continuous": "linear, continuous"}


class LoopFindings(MeasureFindings):
    """Collects what was found in one record; see the module.

    slot: the exciter's.  by_neighbours: u of sines from the lines beside them, for noise that is larger at other
    frequencies (loop_measures.neighbour_noise).  linearized: False where there is no loop to be linearized.  Raises
    ReductionError, as :func:`loops.gates`.
    """

    def __init__(
        self, record: Record, slot: str = "exciter", by_neighbours: bool = False, linearized: bool = True
    ) -> None:
        super().__init__(record)
        self.slot, self.by_neighbours = slot, by_neighbours
        self.gates = gates(record, slot)
        self.linear = record.run.linear or LinearModels(missing="the record holds no linear model")
        self.margins: dict[str, dict[str, list[Any]]] = {}  # loop -> of what -> numbers of the row, see margins.COLUMNS
        self.limits: dict[str, dict[str, m.Margins]] = {}  # loop -> kind of linear model -> its margins
        self.agreement: list[list[Any]] = []  # rows of the table of linear models and measured loops
        self.allan: AllanDeviation | None = None
        self.excluded: dict[str, list[float]] = {}  # loop -> measured frequencies that do not count, Hz
        self.unstable = why_void(self.linear, self.gates)
        if self.linear.missing and linearized:
            self.warn("linear.missing", f"No linear model for comparison: {self.linear.missing}")

    def of(self, kind: str, axis: int | None = None, shape: str | None = None) -> list[Gate]:
        """Return the phases of a kind, in their order."""
        return [
            g for g in self.gates if g.kind == kind and axis in (None, g.axis) and (shape is None or g.shape == shape)
        ]

    @property
    def at_rest(self) -> Gate | None:
        """Return the drift hold, in which nothing is excited; None where it is not whole in the record."""
        return next((g for g in self.of("hold") if g.label == "drift"), None)

    # ------------------------------------------------------------------ frequency responses
    def open_loop(
        self, loop: str, inside: str, test: str, axis: int = 1, kind: str = "test",
        held: Mapping[str, float] | None = None, late: float = 0.0,
    ) -> list[Point]:  # fmt: skip
        """Return the open loop L = -(inside - test) / inside of the sines of a kind on an axis, with margins.

        loop: name of System.loops.  inside: the channel with the signal in the loop behind the summing point ("e"),
        test: what was added there.  held: slot that holds what comes back from sample to sample -> when its first
        one is there, s; the last of them counts.  late: as open_loop_point.  Adds the Bode plot, a table of margins
        (measured, and of both linear models), the agreement up to two crossovers, and the coefficients crossover
        and phase margin.  Returns the points that count.
        """
        sines = sorted(self.of(kind, axis, "sine"), key=lambda g: g.f)
        if not sines:
            return []
        lead = lead_of(self.record, held or {})
        points, counts = map(
            list, zip(*(open_loop_point(g, inside, test, self.by_neighbours, lead, late) for g in sines), strict=True)
        )
        counts = [c and not self.unstable for c in counts]
        sure = [p for p, c in zip(points, counts, strict=True) if c]
        title = f"open loop, {loop}"
        models = self.linear.loops.get(loop, LinearPair())
        caption = (
            f"Gain and phase of the {title}. Points: measured in the co-simulation, with 95 % error bars; lines: "
            "linear models."
        )
        if not all(counts):
            caption += " Grey: too noisy to count, or of an unstable run."
        curves = []
        span = m.grid(0.2 * points[0].f, 5.0 * points[-1].f)
        at = [p.f for p in sure]
        shown = m.measured_margins(sure)
        computed = self.limits[loop] = {}
        rows = {"measured": shown.row("measured")}
        for kind, label in NAMES.items():
            linear = models.of(kind)
            if linear is None:
                continue
            dense = model_response(linear, span)[:, 0, 0]
            limits = computed[kind] = m.margins(span, dense)
            rows[kind] = limits.row(label)
            curves.append(curve(label, span, dense))
            if limits.crossover is not None:
                self._agreement(sure, model_response(linear, at)[:, 0, 0], limits, (label, title))
        if computed and not self.unstable:
            self._conditional(title, computed.get("continuous") or computed["discrete"])
        drawn = bode(title, "loop", caption, points, curves, "gain", "1")
        self.responses.append(replace(drawn, counts=counts))
        self.margins[loop] = {kind: row[1:] for kind, row in rows.items()}
        note = _margin_note(self.record.run)
        self.tables.append(Table(f"margins:{loop}", f"Stability margins, {title}", note, m.COLUMNS, [*rows.values()]))
        key = "" if loop == "stabilizer" else f" {loop}"
        self.excluded[loop] = [p.f for p, c in zip(points, counts, strict=True) if not c]
        values = m.measured_values(sure, self.excluded[loop])
        closest = m.beside(computed.get("discrete"), values)
        twin = None
        if "phase" in values and models.discrete is not None:
            twin = Twin.of(models.discrete, computed["discrete"], sure, values["crossover"][0])
        widened = dict(values)
        if twin is not None:
            widened["crossover"], widened["phase"] = twin.widened(values["crossover"], values["phase"])
        before = len(self.coefficients)
        none = "" if "phase" in values or self.unstable else why_no_crossover(sure, len(points), self.record.run)
        self._crossover(loop, key, widened, closest, none)
        self._gain_margins(loop, key, values, sure, models.discrete)
        self._limited(title, sines, [c.name for c in self.coefficients[before:]])
        noisy = "" if self.unstable else excluded_words(title, points, counts)
        self.warn("loop.noisy", noisy)
        if "phase" in values:
            self._missed(title, *values["crossover"], self.linear.wanted.get(loop) if self.linear.missing else None)
        if twin is not None and twin.contradicts(values["crossover"], values["phase"]):
            causes = self._causes(sines, noisy)
            self.warn("loop.disagrees", disagreement(title, values["crossover"], values["phase"], twin, causes))
        return sure

    def _crossover(
        self, loop: str, key: str, values: Mapping[str, Any], closest: tuple[float | None, float | None], none: str
    ) -> None:
        """Add crossover and phase margin, with what the linear models have there; none: why there is no value."""
        for name, what, unit, value, closed in (
            (f"f_c{key}", "gain crossover frequency", "Hz", values.get("crossover", (None,)), closest[0]),
            (f"PM{key}", "phase margin", "°", values.get("phase", (None,)), closest[1]),
        ):
            self.measure(name, what, unit, *value, closed=closed, no_value=none)
        if "phase" in values:
            crosses = values["crossover"][0]
            self.modelled(f"f_c{key}", loop, lambda limits: limits.near(crosses)[0])
            self.modelled(f"PM{key}", loop, lambda limits: limits.near(crosses)[1])

    def _gain_margins(
        self, loop: str, key: str, values: Mapping[str, tuple[float, float]], points: Sequence[Point],
        model: LinearModel | None,
    ) -> None:  # fmt: skip
        """Add the gain margin and the gain-reduction margin, dB, of a loop whose measured points have them; what the
        interpolation does to the limits of the linear model is in u.
        """
        dense = self.limits[loop].get("discrete")
        at = [p.f for p in points]
        same = None
        if model is not None and dense is not None and ("upper" in values or "lower" in values):
            read = model_response(model, at)[:, 0, 0]
            same = m.measured_margins([Point(f, complex(v), None, 1.0) for f, v in zip(at, read, strict=True)])
        for name, side, what in (("GM", "upper", "gain margin"), ("GRM", "lower", "gain-reduction margin")):
            closed = None if dense is None else dense.limit(side)
            if side not in values:
                if side == "upper" and closed is not None and at:
                    none = f"no limit up from {plain(min(at), 3)} to {plain(max(at), 3)} Hz, the frequencies that count"
                    self.measure(f"{name}{key}", what, "dB", None, closed=closed, no_value=none)
                continue
            factor, u = values[side]
            pair = [None if x is None else getattr(x, side) for x in (dense, same)]
            between = math.log(pair[1] / pair[0]) if pair[0] and pair[1] else 0.0
            share = math.hypot(u / factor, between)
            self.measure(f"{name}{key}", what, "dB", m.decibel(factor), DECIBEL * share, closed=closed)
            self.modelled(f"{name}{key}", loop, partial(m.Margins.limit, side=side))

    def modelled(self, name: str, loop: str, of: Callable[[m.Margins], float | None]) -> None:
        """Note what the linear models of a loop have of a coefficient, with the step and without; SI is its unit."""
        pair = [of(self.limits[loop][kind]) for kind in NAMES if kind in self.limits.get(loop, {})]
        if len(pair) == len(NAMES) and None not in pair:
            models = float(pair[0] or 0.0), float(pair[1] or 0.0)
            self.coefficients = [replace(c, models=models) if c.name == name else c for c in self.coefficients]

    def _limits_reached(self) -> None:
        """Say in which phases a part was at a limit."""
        for slot in limits_hit(self.gates):
            labels = ", ".join(g.label for g in self.gates if max(g[f"{slot}.saturated"]) > 0.5)
            text = f"A limit was active in {slot}, in: {labels}. What was measured there is not linear."
            self.warn(f"limit:{slot}", text)

    def _limited(self, title: str, sines: Sequence[Gate], names: Sequence[str]) -> None:
        """Take the verdicts from margins that were measured at a limit: others hold for smaller signals."""
        if names and (slots := limits_hit(sines)):
            text = (
                f"Margins of the {title} were measured with a limit active in {', '.join(slots)}: they belong to this "
                "amplitude, not to the loop. Use smaller test signals."
            )
            self.reasons.append(Reason("loop.limited", text, ("pass", "fail"), tuple(names)))

    def _causes(self, sines: Sequence[Gate], noisy: str) -> list[str]:
        """Return what may set measured and computed margins apart."""
        limited, friction = limits_hit(sines), friction_of(self.record.run)
        causes = [f"a limit was active in {', '.join(limited)}"] if limited else []
        causes += (
            [f"dry friction ({friction}), which the linear model takes for an elastic contact"] if friction else []
        )
        return causes + (["noise: the points left out leave the range between the others open"] if noisy else [])

    def _missed(self, title: str, crossover: float, u: float, wanted: float | None) -> None:
        """Warn of a crossover that is not the one asked for, where no linear model said so before the run."""
        if wanted is not None and abs(crossover - wanted) > TOLERANCE * wanted + uncertainty.NORMAL * u:
            text = f"The {title} crosses at {plain(crossover, 3)} Hz, not at the {plain(wanted, 4)} Hz asked for."
            self.warn("loop.crossover_missed", text)

    def _agreement(self, points: Sequence[Point], model: Any, limits: m.Margins, names: tuple[str, str]) -> None:
        limit = 2.0 * float(limits.crossover or 0.0)
        db, degrees = m.deviation(points, model, limit)
        count = sum(p.f <= limit * (1.0 + 1e-9) for p in points)
        self.agreement.append([names[0], limit, count, db, degrees, names[1]])

    def _conditional(self, title: str, limits: m.Margins) -> None:
        if limits.lower is not None:
            upper = f" or rises to {plain(limits.upper, 3)}" if limits.upper is not None else ""
            falls = (
                f"falls to {plain(limits.lower, 3)}{upper} times its value. Saturation of the motor reduces the gain."
            )
            text = f"The {title} is conditionally stable: it becomes unstable when its gain {falls}"
            self.warn("loop.conditionally_stable", text)

    def ratio(
        self, name: str, kind: str, axis: int, output: str, reference: str, *, caption: str = "", scale: float = 1.0,
        unit: str = "1", plus: str | None = None,
    ) -> list[Point]:  # fmt: skip
        """Measure ``output`` over ``reference`` at the sines of a kind on an axis, with the linear curves over it.

        reference: a channel of the exciter, or another one (then the linear curve is the ratio of two).  plus: a second
        channel added to the output (all "slot.variable").  scale, unit: SI of the ratio per printed unit.  Returns the
        points, SI; adds one response of kind "ratio".
        """

        def signal(g: Gate) -> Array:
            return g[output] + (g[plus] if plus else 0.0)

        sines = [g for g in self.of(kind, axis, "sine") if g.amplitude]
        points = [response(g.t, g[reference], signal(g), g.f, self.by_neighbours) for g in sines]
        if not points:
            return []
        points.sort(key=lambda p: p.f)
        span = m.grid(0.5 * points[0].f, 2.0 * points[-1].f, CURVE)
        curves = []
        for model, label in NAMES.items():
            values = self.excited(model, kind, axis, output, span, plus)
            if values is not None and reference.partition(".")[0] != self.slot:
                base = self.excited(model, kind, axis, reference, span)
                values = None if base is None else values / base
            if values is not None:
                curves.append(curve(label, span, values / scale))
        shown = [Point(p.f, p.value / scale, p.u, p.coherence) for p in points]
        self.responses.append(bode(name, "ratio", caption or f"{name}, axis {axis}.", shown, curves, name, unit))
        return points

    def excited(
        self, which: str, kind: str, axis: int, output: str, f: Array | Sequence[float], plus: str | None = None
    ) -> Any:
        """Return the linear response ("discrete", "continuous") of a channel to an excitation, SI; None without one."""
        model = self.linear.closed.of(which)
        if model is None or output not in model.outputs:
            return None
        try:
            values = m.excitation_response(model, kind, axis, output, f)
            return values + m.excitation_response(model, kind, axis, plus, f) if plus else values
        except KeyError:
            return None

    # ------------------------------------------------------------------ steps
    def step(
        self, gate: Gate, output: str, *, scale: float = 1.0, unit: str = "1", y_name: str = "",
        plus: str | None = None, drift: float = 0.0, quiet: Gate | None = None,
    ) -> Step:  # fmt: skip
        """Return the measures of a step phase (SI) and its figure, with the response of the linear model over it.

        drift: rate (SI per s) with which the output moves without the step too; it is taken off.  quiet: a hold phase
        several times as long, from whose noise the uncertainty of the change is taken; without, it is that of white
        noise, too small where the noise is slow.
        """
        y, baseline = gate[output], gate.rest(output)
        if plus:
            y, baseline = y + gate[plus], baseline + gate.rest(plus)
        before = gate.channels["time"][gate.before]
        y, baseline = y - drift * (gate.t - gate.t[0]), baseline - drift * (before - gate.t[0])
        measures = step(gate.t, y, baseline)
        if quiet is not None:
            at_rest = quiet[output] + (quiet[plus] if plus else 0.0)
            u = step_noise_std(at_rest, baseline.size, y.size, max(2, int(LAST * y.size)))
            measures = measures if u is None else measures.with_noise(u)
            self.warn("hold.short", short_rest(quiet, baseline.size + y.size, measures))
        model = self.linear.closed.discrete
        predicted = None if model is None else simulated(model, gate, output)
        if model is not None and predicted is not None and plus:
            second = simulated(model, gate, plus)
            predicted = None if second is None else predicted + second
        line = None if predicted is None else measures.initial + predicted
        self.responses.append(step_figure(gate, y, line, NAMES["discrete"], scale, y_name or output, unit))
        return measures

    def loaded(self, gate: Gate, output: str, own: Drift | None, **figure: Any) -> Step:
        """Return :meth:`step` less the output's own drift, whose uncertainty is in that of the change."""
        if own is None:
            return self.step(gate, output, **figure)
        found = self.step(gate, output, drift=own.rate, **figure)
        return replace(found, u_change=math.hypot(found.u_change, own.u * float(gate.t[-1] - gate.t[0])))

    # ------------------------------------------------------------------ drift
    def drift(
        self, gate: Gate, output: str, *, key: str = "", truth: float | None = None, walk: float | None = None,
        gyro: tuple[str, str] | None = None,
    ) -> Drift:  # fmt: skip
        """Measure drift and random walk of an angle in a hold phase, °/h and °/√h; show the Allan deviation.

        key: appended to the names of the coefficients.  truth: of the rate, rad/s; walk: of the random walk, rad/√s.
        gyro: slot and channel ("_x", "") of the one whose drift it is; what its slow drift may add to a record of this
        length is in u.
        """
        measures = drift(gate.t, gate[output])
        u = measures.u if gyro is None else math.hypot(measures.u, slow_drift(self.run.parameters, *gyro, gate.t))
        self.show_allan(measures)
        meaning = "mean drift rate of the platform at rest"
        self.measure(f"drift{key}", meaning, "°/h", measures.rate, u, scale=DPH, truth=truth)
        if measures.walk is not None:
            size, u = (math.degrees(w) * 60.0 for w in measures.walk)
            true = math.degrees(walk) * 60.0 if walk else None
            self.measure(f"N{key}", "angle random walk", "°/√h", size, u, truth=true)
        return measures

    def show_allan(self, measures: Drift) -> None:
        """Take the Allan deviation of a drift, °/h, for the report."""
        if (a := measures.allan) is not None:
            dev, lo, hi = ([x / DPH for x in values] for values in (a.dev, a.lo, a.hi))
            self.allan = replace(a, dev=dev, lo=lo, hi=hi, unit="°/h")

    def result(self, account: Account, summary: Sequence[str] = (), ranked_by: str = "") -> LoopResult:
        """Return what was found, with what the test says of itself."""
        self._limits_reached()
        self.reasons += [*account.reasons, *(Reason("linear", w) for w in self.linear.warnings)]
        if self.agreement:
            title = "Linear models and measured loop"
            self.tables.append(Table("margins.agreement", title, AGREEMENT, AGREEMENT_COLUMNS, self.agreement))
        self.facts["allan"] = self.allan
        return super().result(replace(account, reasons=()), summary, ranked_by)


def _margin_note(run: RunDocument) -> str:
    cuts = ", ".join(f"{w.replace('->', '→')}: {s:g} s" for w, s in run.delays.items()) or "none"
    delays = f" Communication step: {run.step:g} s; delays of delayed connections: {cuts}." if run.step else ""
    meaning = "Gain margin and gain-reduction margin: changes of the gain that bring the loop to its stability limit."
    return meaning + delays
