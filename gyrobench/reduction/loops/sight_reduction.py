"""What tests of a line of sight on a gimbal share: loads, isolation, jitter with its budget by source."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops import sight_budget
from gyrobench.reduction.loops.jitter import Spectra, root, shortest, widths
from gyrobench.reduction.loops.loop_toolkit import Gate, LoopReduction, Response, Table
from gyrobench.reduction.loops.open_loop import limits_hit
from gyrobench.reduction.loops.platform_measures import peak_noise
from gyrobench.reduction.loops.sight_quantities import coarse, set_by, shares
from gyrobench.result import Curve, SetBy

AXES = {"pitch": 1, "yaw": 3}
MICRO = 1e-6
EDGES = (3.0, 10.0, 30.0, 100.0)  # Hz, of the bands
POINTS = 250  # of a figure
WRONG = 0.2  # relative: a jitter that differs more from the linear prediction is explained
NOISY = 0.25  # relative u of a ratio beyond which its dB say nothing
ASKEW = 0.1  # tangent of the inner joint angle from which a roll of the base is warned of
DECIBEL = 20.0 / math.log(10.0)
SMALL = 0.1  # %, share of the variance below which a source has no row


class SightReduction(LoopReduction):
    """Loads and base motion of a gimbal of two axes, and the jitter of its line of sight.

    sight: channels of the angles whose jitter it is; what: their name.
    """

    sight: ClassVar[tuple[str, str]] = sight_budget.LOS
    what: ClassVar[str] = "line of sight"

    def ride(self) -> Gate | None:
        """Return the ride, in which the base vibrates; None where it is not whole in the record."""
        return next((g for g in self.found.of("hold") if g.label == "ride"), None)

    def loads_and_loops(self) -> None:
        """Measure the steps of the loads and the open loops of both axes."""
        for gate in self.found.of("torque", shape="step"):
            self.load(gate)
        for axis, k in AXES.items():
            self.found.open_loop(axis, f"{axis}.e", f"exciter.test[{k}]", k, held={"gyro": 0.0})

    def load(self, gate: Gate) -> None:
        """Measure the largest angle of the line of sight after a step of the load."""
        k = 0 if gate.axis == 1 else 1
        name = tuple(AXES)[k]
        rest = gate.rest(sight_budget.LOS[k])
        y = gate[sight_budget.LOS[k]] - (float(rest.mean()) if rest.size else 0.0)
        meaning = f"largest angle of the line of sight after {gate.amplitude:g} N·m"
        at = int(np.argmax(np.abs(y)))
        u = peak_noise(y[y.size // 2 :], 1, at, y)  # settled
        if (ride := self.ride()) is not None:
            # the gyro's random walk, which is in the long ride alone, makes the largest angle at any time of a flat top
            u = max(u, peak_noise(ride[self.sight[k]], 1, y.size - 1, y))
        self.found.measure(f"peak {name}", meaning, "µrad", abs(float(y[at])), u, scale=MICRO)
        self.found.step(gate, sight_budget.LOS[k], scale=MICRO, unit="µrad", y_name=f"line of sight, {name}")

    def isolation(self) -> None:
        """Measure the angle of the line of sight over that of the base, about x and z."""
        found = self.found
        for name, k, angle in (("x", 1, sight_budget.LOS[0]), ("z", 3, sight_budget.LOS[1])):
            still = [g for g in found.of("motion", k, "sine") if swing(g, f"motion.angle[{k}]") < 0.5 * g.amplitude]
            if still:
                meaning = f"line of sight over base, sines about {name}"
                none = "the part in motion takes no test sines: the base did not swing"
                found.measure(f"isolation {name} {still[0].f:g} Hz", meaning, "dB", None, no_value=none)
                continue
            points = found.ratio(
                f"line of sight over base about {name}", "motion", k, angle, f"motion.angle[{k}]",
                caption=f"Transmissibility: angle of the line of sight over that of the base about {name}.",
            )  # fmt: skip
            for p in points:
                size, u = abs(p.value), p.u or 0.0
                meaning = f"line of sight over base, sine of {p.f:g} Hz about {name}"
                none = ""
                if not size or u > NOISY:
                    level = 20.0 * math.log10(size * (1.0 + 2.0 * u)) if size else -math.inf
                    none = f"not above the noise: below {level:.0f} dB".replace("-", "−")
                value = 20.0 * math.log10(size) if size else None
                found.measure(f"isolation {name} {p.f:g} Hz", meaning, "dB", value, DECIBEL * u, no_value=none)

    # ------------------------------------------------------------------ jitter
    def jitter(self, gate: Gate) -> str:
        """Measure the jitter of the ride and explain it; return the largest source as words."""
        found = self.found
        lowest = float(self.run.options["jitter_from"])
        ride = sight_budget.read_ride(gate, self.run.parameters, lowest, self.sight)
        names = ("jitter pitch", "jitter yaw", "jitter")
        if ride is None:
            reason = f"the ride is shorter than the {shortest(lowest):g} s that a jitter from {lowest:g} Hz takes"
            for name in names:
                found.measure(name, self.what, "µrad", None, no_value=reason)
            return ""
        spectra = (*ride.los, ride.los[0].together(ride.los[1]))
        f = ride.los[0].f
        use = f >= lowest * (1.0 - 1e-9)
        budget = self._sources(ride, use)
        sources = budget.sources
        df = widths(f, lowest)[use]
        linear = [sum((x.part[k] for x in sources.values()), np.zeros(int(use.sum()))) for k in (0, 1)]
        squares = [max(0.0, float(x @ df)) for x in (linear[0], linear[1], linear[0] + linear[1])]
        for name, of, square in zip(names, spectra, squares, strict=True):
            words = {"jitter": "of both axes, root of the sum of squares"}.get(name, f"about {name[7:]}")
            v = of.rms(lowest)
            meaning = f"{self.what} from {lowest:g} Hz, rms {words}"
            found.add(name, meaning, "µrad", v, scale=MICRO, closed=math.sqrt(square) or None)
        self._bands(spectra[:2], linear, f[use], lowest)
        self._figures(spectra[:2], linear, f, use, df)
        return self._budget(budget, squares, df, spectra[2].rms(lowest).value)

    def more_sources(self, ride: sight_budget.Ride, use: NDArray[np.bool_]) -> sight_budget.MoreSources | None:
        """Return sources beside those of the gimbal."""
        return None

    def _sources(self, ride: sight_budget.Ride, use: NDArray[np.bool_]) -> sight_budget.JitterBudget:
        try:
            return sight_budget.by_source(self.found, ride, use, self.more_sources(ride, use))
        except (LookupError, ValueError):  # parts of another kind
            return sight_budget.JitterBudget({})

    def _bands(self, spectra: Sequence[Spectra], linear: Sequence[Array], f: Array, lowest: float) -> None:
        """Add the table of the jitter by band."""
        edges = [lowest, *(e for e in EDGES if lowest < e < f[-1]), math.inf]
        rows = []
        for a, b in pairwise(edges):
            row: list[object] = [f"{a:g} to {b:g}" if math.isfinite(b) else f"above {a:g}"]
            for of, lines in zip(spectra, linear, strict=True):
                v = root(of.mean_square(a, b))
                row += [v.value / MICRO, v.u / MICRO, math.sqrt(max(0.0, float(lines @ widths(f, a, b)))) / MICRO]
            rows.append(row)
        heads = [f"{axis}{what} / µrad" for axis in AXES for what in ("", ", u", ", linear")]
        caption = (
            "Root mean square of the angle in each band, its standard uncertainty from the scatter of the segments, "
            "and what the linear model with the sources of the budget makes of it."
        )
        self.found.tables.append(Table("jitter.bands", "Jitter by frequency", caption, ["band / Hz", *heads], rows))

    def _budget(self, budget: sight_budget.JitterBudget, squares: Sequence[float], df: Array, measured: float) -> str:
        """Add the table of sources, warn where it does not explain the ride; return the largest as words."""
        sources, square = budget.sources, squares[2]
        if not square > 0.0:
            return ""
        alone = {n: [math.sqrt(float(y @ df)) / MICRO for y in x.alone] for n, x in sources.items()}
        share = {n: 100.0 * float(np.sum(x.part @ df)) / square for n, x in sources.items()}
        rows: list[list[object]] = []
        small = [n for n in sources if abs(share[n]) < SMALL]
        for name in sorted((n for n in sources if n not in small), key=lambda n: -share[n]):
            rows.append([name, *alone[name], share[name]])
        if small:
            rows.append(["others", None, None, sum(share[n] for n in small)])
        rows.append(["together", *(math.sqrt(x) / MICRO for x in squares[:2]), None])
        rows.append(["co-simulated", *(self.found.estimates[f"jitter {axis}"] for axis in AXES), None])
        caption = (
            f"Angle of the {self.what} that each source makes by the linear model, rms of each axis, and its share of "
            "the variance of both. What the ride moves at once adds with its phases: a negative share cancels part "
            "of the others."
        )
        if sight_budget.FRICTION in sources:
            caption += " The joints slip: their dry friction is the torque that their angles make, not a spring."
        title = "Jitter budget, by source"
        self.found.tables.append(
            Table("budget.sources", title, caption, ["source", "pitch / µrad", "yaw / µrad", "share / %"], rows)
        )
        whole = math.sqrt(square)
        if abs(measured / whole - 1.0) > WRONG:
            limited = limits_hit([g for g in self.found.gates if g.label == "ride"])
            why = f"a limit was active in {', '.join(limited)}" if limited else ""
            if not why and coarse(self.run.parameters):
                why = "the steps of the gyro's output are larger than its noise"
            if not why and self._stuck():
                why = "dry friction sticks for a part of the ride and slips in another"
            text = (
                f"The jitter budget gives {plain(whole / MICRO, 3)} µrad, the co-simulation "
                f"{plain(measured / MICRO, 3)} µrad{': ' + why if why else ''}. Believe the co-simulation; no "
                "allowance by source is stated."
            )
            self.found.warn("budget.not_linear", text)
        else:
            self.found.facts["shares"] = shares(budget, df, self.run.parameters, self.set_by)
        largest = max(share, key=lambda n: share[n])
        if largest in sight_budget.OF_BASE:
            self._rolls(share[largest], largest)
        return f", {share[largest]:.0f} % of its variance by {largest}"

    def _rolls(self, share: float, source: str) -> None:
        """Warn where the inner joint stands askew, so that a roll reaches the line of sight past every bearing."""
        p = self.run.parameters
        inner = int(p["platform.form"])
        tan = abs(math.tan(float(np.asarray(p["platform.theta_0"], float)[inner])))
        if tan > ASKEW:
            axis, other = tuple(AXES)[inner], tuple(AXES)[1 - inner]
            text = (
                f"{share:.0f} % of the variance of the jitter is {source}. With {axis} at an angle, a roll of the "
                f"outer gimbal turns the line of sight whatever the bearings: the {other} motor must follow it with "
                f"{plain(tan)} times its rate, and what the loop leaves of that is jitter. It is the largest where the "
                "inner joint stands farthest from 0: a wider loop or a third axis, of roll, makes it less."
            )
            self.found.warn("roll.askew", text)

    def set_by(self, source: str, p: Mapping[str, Any]) -> list[SetBy]:
        """Return the quantities that set a source."""
        return set_by(source, p)

    def _stuck(self) -> bool:
        return any(np.any(np.asarray(self.run.parameters.get(f"platform.{n}", 0.0))) for n in ("friction", "stiction"))

    def _figures(
        self, spectra: Sequence[Spectra], linear: Sequence[Array], f: Array, use: NDArray[np.bool_], df: Array
    ) -> None:
        """Add the density and the jitter that has accumulated up to each frequency."""
        density, rising = [], []
        for axis, of, lines in zip(AXES, spectra, linear, strict=True):
            for label, values in ((f"{axis}, co-simulated", of.mean[use]), (f"{axis}, linear", lines)):
                if np.any(values):
                    x, y = _averaged(f[use], values / MICRO**2)
                    density.append(Curve(label, x, y))
                    x, y = _averaged(f[use], np.sqrt(np.maximum(0.0, np.cumsum(values * df))) / MICRO)
                    rising.append(Curve(label, x, y))
        for name, unit, curves, caption in (
            (f"density of the {self.what}", "µrad²/Hz", density,
             f"One-sided power spectral density of the {self.what} in the ride, and that of the linear model."),
            ("cumulative jitter", "µrad", rising,
             f"Root mean square of the {self.what} from the lowest frequency of the jitter up to each frequency."),
        ):  # fmt: skip
            first = curves[0]
            self.found.responses.append(
                Response(name, "spectrum", caption, first.x, "frequency", "Hz", first.y, name, unit, curves=curves)
            )

    def keyhole(self) -> None:
        """Say where the inner joint was in the keyhole."""
        keyhole = [g.label for g in self.found.gates if np.any(g["platform.keyhole"] > 0.5)]
        if keyhole:
            text = (
                f"The inner joint was in the keyhole in: {', '.join(keyhole)}. There the outer joint turns the line of "
                "sight little or not at all: its motion about the outer axis is not stabilized."
            )
            self.found.warn("keyhole", text)


def swing(gate: Gate, name: str) -> float:
    """Return the amplitude of a channel at the frequency of a phase."""
    y = gate[name]
    return 2.0 * abs(complex(np.mean((y - y.mean()) * np.exp(-2j * np.pi * gate.f * gate.t))))


def _averaged(x: Array, y: Array) -> tuple[list[float], list[float]]:
    """Return means of neighbours, as many as a logarithmic axis shows."""
    groups = np.unique(np.round(np.geomspace(1, x.size, POINTS)).astype(int)) - 1
    edges = [*groups.tolist(), x.size]
    parts = [slice(a, b) for a, b in pairwise(edges) if b > a]
    return [float(x[p].mean()) for p in parts], [float(y[p].mean()) for p in parts]
