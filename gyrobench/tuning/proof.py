"""Proof of a tuned loop in co-simulation: test sines through noise, friction and limits as they are, and a load step.

Measured L = (r - e)/e at the sines is read as the linear model's is; what the interpolation between the sines does is
found on the model at the same frequencies and counts to the uncertainty.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.engine.session import Session
from gyrobench.record.frequency_response import Complex
from gyrobench.record.record import Record
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.jitter import spectra
from gyrobench.reduction.loops.loop_measures import Gate, Point, gates
from gyrobench.reduction.loops.margins import interpolate_response, measured_values
from gyrobench.reduction.loops.open_loop import friction_of, limits_hit, open_loop_point
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.system import System
from gyrobench.tuning.loop_ports import STABILIZER, LoopPorts
from gyrobench.tuning.own_controllers import own_controller, own_values
from gyrobench.tuning.robustness import bandwidth_limit, crossovers, gain_limits, measured
from gyrobench.tuning.wishes import JITTER, Wish

SINES = 14  # beside those at the limits
DRIVEN = 0.3  # of the largest voltage, at most, is taken by a test sine
SMALLER = (0.2, 0.04)  # times that, where a part was at a limit all the same
LOUDER = 5.0  # times the amplitude of the system's own plan, where noise hides what is wanted
PERIODS = 32  # of a sine; a third of them of one that is slower by SLOWER than the fastest
SLOWER = 40.0
SLOWEST = 300.0  # below the crossover over this no sine is made for the bandwidth or a limit of the gain
NEXT = 1.5  # times the smallest gain margin: limits of the gain up to it are measured, however slow
HIGHEST = 0.2  # of the frequency of the steps: of a sine
ENOUGH = 0.9  # of 1 over the gain margin that is wanted: down to it L is measured where no limit is told
SAMPLES = 24  # of a period of the fastest sine
AMPLITUDE = 1e-3  # of the test sines, where the system's own plan has none
DIFFERENT = 0.05  # of a measure: less difference from the linear model has no consequence
REST = "rest"  # phase without a test signal
CUT = 1e-3  # of the time: more is said
LOOSE = 0.25  # of what is wanted: with a larger U a measure tells nothing of it, unless all of its interval fulfils it
STANDS = 3.0  # times what noise turns the platform by: less of a load step is not seen
FEW = 6  # sines that count: fewer are no measurement


@dataclass(frozen=True)
class ProvenWish:
    """A wish's measure in the co-simulation: value, expanded uncertainty, and that of the linear model there.

    bound: the value is as far as the sines above the noise reach; what is beyond is better than it.
    """

    wish: Wish
    value: float
    U: float
    expected: float
    bound: bool = False

    @property
    def kept(self) -> bool:
        """True where what is measured, with its uncertainty, is not below the wish."""
        return self._fulfils(1.0)

    @property
    def told(self) -> bool:
        """False where noise leaves open whether the wish is kept: within less than LOOSE of it, or a bound below."""
        return self._fulfils(-1.0) or (not self.bound and LOOSE * self.wish.value >= self.U)

    def _fulfils(self, sign: float) -> bool:
        """Return whether the better end of the interval fulfils the wish, or the worse one (sign -1)."""
        end = self.value + (sign if self.wish.least else -sign) * self.U
        return self.wish.ratio(end) >= 1.0 - 1e-9

    @property
    def verdict(self) -> str:
        """Return "" where the wish is kept, else how it is not."""
        if not self.told:
            return "not told: noise leaves open whether it is what is wanted"
        return "" if self.kept else f"{'below' if self.wish.least else 'above'} what is wanted"

    @property
    def agrees(self) -> bool:
        """True where it is what the linear model says, within U and 5 %."""
        if self.bound and self.expected >= self.value:
            return True
        if np.isinf(self.expected) or np.isinf(self.value):
            return self.value >= self.expected or self.wish.name in ("gain margin", "delay margin", "phase margin")
        return abs(self.value - self.expected) <= max(self.U, DIFFERENT * abs(self.expected))


@dataclass(frozen=True)
class ExpectedJitter:
    """Jitter to be measured: phase of the system's plan, lowest frequency (Hz), rms of the linear model (rad), channel
    of the angle, and of what is 1 while the target is lost ("": there is none).
    """

    ride: str
    lowest: float
    rms: float
    angle: str
    lost: str = ""


@dataclass(frozen=True)
class LoadStep:
    """Angle of the platform, rad, after a step of torque, N.m; noise: what noise alone turns it by in as long."""

    t: Array
    angle: Array
    torque: float
    noise: float

    @property
    def seen(self) -> bool:
        """True where the platform turns by more than noise turns it."""
        return float(np.abs(self.angle).max()) > STANDS * self.noise

    def __str__(self) -> str:
        peak = float(np.abs(self.angle).max())
        noise = f"noise alone turns the platform by about {float(f'{1e6 * self.noise:.2g}'):g} µrad in as long"
        if not self.seen:
            return f"a load of {self.torque:g} N·m is not seen: {noise}"
        more = f"; {noise}" if self.noise > DIFFERENT * peak else ""
        return f"a load of {self.torque:g} N·m turns the platform by up to {1e6 * peak:.4g} µrad{more}"


@dataclass(frozen=True)
class Proof:
    """Measures of a run at a point of the spread.  why_not: why nothing was, else "".

    cut: part of the time in which noise alone has the voltage at its limit.  lost: part of the ride in which the target
    was lost.
    """

    values: Mapping[str, float]
    wishes: tuple[ProvenWish, ...]
    points: tuple[Point, ...]
    counted: int
    limits: str  # parts that were at a limit in the test sines
    friction: str
    step: LoadStep | None
    why_not: str = ""
    cut: float = 0.0
    lost: float = 0.0

    @property
    def holds(self) -> bool:
        return not self.why_not and not self.lost and not any(w.verdict for w in self.wishes)


def sine_frequencies(f: Array, L: Complex, wishes: Sequence[Wish], step: float) -> list[float]:
    """Return the sines, Hz: about the crossovers, the limits and the largest |S - 1/2|."""
    crossed = [at for at, _ in crossovers(f, L)]
    upper = max(crossed, default=float(f[len(f) // 2]))
    gains = [(at, g) for at, g in gain_limits(f, L) if at < HIGHEST / step]
    least = min((max(g, 1.0 / g) for _, g in gains), default=np.inf)
    limits = [at for at, g in gains if at > upper / 20.0]
    slow_limits = [at for at, g in gains if upper / SLOWEST < at <= upper / 20.0 and max(g, 1.0 / g) < NEXT * least]
    hump = float(f[np.argmax(np.abs(1.0 / (1.0 + L) - 0.5))])
    wanted = next((w.value for w in wishes if w.name == "gain margin"), 0.0)
    told = not wanted or any(g > 1.0 for _, g in gains)
    reach: Array = f[(f > upper) & (np.abs(L) * wanted < ENOUGH)][: 0 if told else 1]
    low, high = upper / 8.0, min(max([2.5 * upper, 1.3 * hump, *reach, *(1.2 * x for x in limits)]), HIGHEST / step)
    at = [x * q for x in (*crossed, *limits, hump) for q in (0.93, 1.0, 1.07)]
    own = [w.f for w in wishes if w.f]
    if any(w.name == "gain margin" for w in wishes):
        own += [x * q for x in slow_limits for q in (0.93, 1.0, 1.07)]
    if any(w.name == "bandwidth" for w in wishes):
        slow = bandwidth_limit(f, np.abs(1.0 / (1.0 + L)))[1]
        own += [x for x in (0.93 * slow, slow, 1.07 * slow) if x > max(upper / SLOWEST, float(f[0]))]
    asked = [*np.geomspace(low, high, SINES), *at, *own]
    found: list[float] = []
    for x in sorted(float(x) for x in asked if upper / 20.0 <= x <= HIGHEST / step or x in own):
        if not found or x > 1.02 * found[-1]:
            found.append(x)
    return found


def loop_plan(
    system: System, frequencies: Sequence[float], largest: Callable[[float], float], axis: int = 1, ride: str = "",
    kind: str = "test", loud: float = 1.0,
) -> tuple[LoopPlan, float]:  # fmt: skip
    """Return the plan of a proof and the torque of its load step, N.m.

    The sines have ``loud`` times the amplitude of the system's own plan, and at most ``largest`` at a frequency: no
    limit is met.
    """
    own = system.plan()  # by a recorded motion it is the ride alone
    phases = list(getattr(system, "phases", list)() if system.values.get("profile") else getattr(own, "phases", []))
    sines = [p for p in phases if p.kind == kind and p.shape == "sine" and p.amplitude and p.axis == axis]
    load = next((p for p in phases if p.kind == "torque" and p.shape == "step" and p.axis == axis), None)

    def amplitude(f: float) -> float:
        near = min(sines, key=lambda p: abs(np.log(p.frequency / f)), default=None)
        return min(loud * (float(near.amplitude) if near else AMPLITUDE), largest(f))

    slowest = min(frequencies)
    rest = LoopPhase(REST, "hold", settle=0.5 / slowest, dwell=1.0 / slowest)
    steps = [replace(load, dwell=min(load.dwell, 20.0 / slowest), settle=2.0 / slowest)] if load else []
    fast = [f for f in frequencies if f * SLOWER > max(frequencies)]
    slow = [f for f in frequencies if f not in fast]
    sines_ahead = [
        *sweep("loop", kind, slow, amplitude, axis=axis, periods=PERIODS // 3, settle=0.5 / slowest),
        *sweep("loop", kind, fast, amplitude, axis=axis, periods=PERIODS, settle=0.5 / slowest),
    ]
    plan = LoopPlan([rest, *sines_ahead, *steps, *(p for p in phases if ride and p.label == ride)])
    return plan, float(load.amplitude) if load else 0.0


def proof_of(
    session: Session, settings: Mapping[str, Any], at: Mapping[str, float], f: Array, L: Complex, G: Complex,
    wishes: Sequence[Wish], seed: int = 1, ports: LoopPorts = STABILIZER,
    sight: ExpectedJitter | None = None,
) -> Proof:  # fmt: skip
    """Run the loop test at a point of the spread.  L, G: loop and controller at this point over f.  Raises RunError."""
    system = session.system
    step = system.step
    chosen = sine_frequencies(f, L, wishes, step)
    known = session.prepare(settings, seed)[2].parameters
    v_max = known_limit(known, ports)
    own = own_controller(known, ports.slot)
    effort = np.abs(G / (1.0 + L)) * (own.per_added(own_values(known, ports.slot), f) if own else 1.0)
    period = step * max(1, int(1.0 / (SAMPLES * max(chosen) * step)))

    def tried(share: float, loud: float = 1.0) -> Proof:
        def size(x: float) -> float:
            return share * DRIVEN * v_max / float(np.interp(x, f, effort))

        plan, load = loop_plan(system, chosen, size, ports.axis, sight.ride if sight else "", ports.kind, loud)
        record = _run(session, settings, at, plan, period, seed)
        return _read(ports.measured(record), at, f, L, wishes, load, ports, sight)

    found = tried(1.0)
    if not found.limits and (found.why_not or not all(w.told for w in found.wishes)):
        louder = tried(1.0, LOUDER)
        return found if louder.limits else louder
    for share in SMALLER:
        if not found.limits or found.cut > CUT:
            break  # what noise does alone no smaller sine takes away
        smaller = tried(share)
        if smaller.why_not:
            break
        found = found if smaller.limits else smaller
    return found


def _run(
    session: Session, settings: Mapping[str, Any], at: Mapping[str, float], plan: LoopPlan, period: float, seed: int
) -> Record:  # fmt: skip
    """Run a plan at a point of the spread in the place of the system's own; period: of the channels, s."""
    system = session.system
    kept = dict(vars(system))
    vars(system).update(plan=lambda: plan, channel_period=period, nominal={})
    try:
        return session.run({**settings, **at}, seed)
    finally:
        vars(system).clear()
        vars(system).update(kept)


def _read(
    record: Record, at: Mapping[str, float], f: Array, L: Complex, wishes: Sequence[Wish], load: float,
    ports: LoopPorts, sight: ExpectedJitter | None,
) -> Proof:  # fmt: skip
    phases = gates(record)
    sines = [g for g in phases if g.kind == ports.kind and g.shape == "sine"]
    judged = [open_loop_point(g, ports.inside, ports.test) for g in sines]
    points = sorted((p for p, counts in judged if counts), key=lambda p: p.f)
    limit = known_limit(record.run.parameters, ports)
    own = own_controller(record.run.parameters, ports.slot)
    name, most = ("saturated", 1.0) if own else ("v", limit)
    cut = _at_rest(phases, f"{ports.slot}.{name}", most)
    what, unit = ("output", own.unit) if own else ("voltage", "V")
    at_limit = f"at the limit of {limit:.3g} {unit} {100.0 * cut:.2g} % of the time"
    noise = f"{ports.slot} (noise alone has its {what} {at_limit})"
    more = [noise + ", which takes gain from the loop"] if cut > CUT else []
    friction, limits = friction_of(record.run), ", ".join([*limits_hit(sines), *more])
    step = next((_step(g, ports.angle, load) for g in phases if g.kind == "torque" and ports.angle in g.channels), None)
    if len(points) < FEW:
        why = f"{len(points)} of {len(judged)} test sines stand above the noise ({FEW} are needed)"
        why += f"; the friction ({friction}) may hold the platform" if friction else ""
        return Proof(at, (), tuple(points), len(points), limits, friction, step, why, cut)
    lost = [p.f for p, counts in judged if not counts]
    of_loop = [
        _gain_margin(w, points, lost, f, L) if w.name == "gain margin" else _proven(w, points, f, L)
        for w in wishes
        if w.name != JITTER
    ]
    jitter = [_jitter(w, phases, sight) for w in wishes if w.name == JITTER and sight]
    lost_part = _lost(phases, sight) if sight else 0.0
    return Proof(at, (*of_loop, *jitter), tuple(points), len(points), limits, friction, step, cut=cut, lost=lost_part)


def known_limit(parameters: Mapping[str, Any], ports: LoopPorts) -> float:
    """Return the largest signal, V: of the controller, of the platform that it drives and its current, what is least.

    Of a part with a controller of its own: its largest output.
    """
    own = own_controller(parameters, ports.slot)
    if own is not None:
        return own.limit(own_values(parameters, ports.slot))
    found = [parameters.get(f"{ports.slot}.v_max", np.inf)]
    if ports.kind == "test":
        p = {n: np.asarray(parameters.get(f"platform.{n}", np.inf), float) for n in ("v_max", "i_max", "R")}
        found += [p["v_max"], p["i_max"] * p["R"]]  # at rest the current is v/R
    return min(float(np.min(x)) for x in found)


def _at_rest(phases: Sequence[Gate], name: str, most: float) -> float:
    """Return the part of the time without a test signal in which the size of a channel is at its most."""
    gate = next((g for g in phases if g.label == REST and name in g.channels), None)
    return float(np.mean(np.abs(gate[name]) >= (1.0 - 1e-9) * most)) if gate else 0.0


def _jitter(wish: Wish, phases: Sequence[Gate], sight: ExpectedJitter) -> ProvenWish:
    gate = next((g for g in phases if g.label == sight.ride), None)
    found = spectra(float(gate.t[1] - gate.t[0]), gate[sight.angle], sight.lowest) if gate is not None else None
    if found is None:
        return ProvenWish(wish, np.inf, 0.0, sight.rms)
    v = found.rms(sight.lowest)
    return ProvenWish(wish, v.value, v.k * v.u, sight.rms)


def _lost(phases: Sequence[Gate], sight: ExpectedJitter) -> float:
    """Return the part of the ride in which the target was lost."""
    rides = [g[sight.lost] for g in phases if g.label == sight.ride and sight.lost in g.channels]
    return float(np.mean(rides[0] > 0.5)) if rides else 0.0


def _step(gate: Gate, angle: str, torque: float) -> LoadStep:
    rest = gate.rest(angle)
    t, x = gate.t - gate.t[0], gate[angle]
    if not rest.size:
        return LoadStep(t, x, torque, 0.0)
    longer = float(np.sqrt(max(x.size / rest.size, 1.0)))  # noise of a gyro walks
    return LoadStep(t, x - rest.mean(), torque, longer * float(np.ptp(rest)))


def _gain_margin(wish: Wish, points: Sequence[Point], lost: Sequence[float], f: Array, L: Complex) -> ProvenWish:
    """Read the gain margin; where a limit drowns in noise, up to the last point whose phase is told from -180.

    lost: frequencies of sines that are not above the noise, Hz.  A limit up lies where |L| < 1, a limit down where
    |L| > 1: sines lost on one side say nothing of the other.
    """
    values = measured_values(points, lost)
    found = [(max(g, 1.0 / g), NORMAL * u * max(1.0, g**-2.0), False) for name, (g, u) in values.items()
             if name in ("upper", "lower")]  # fmt: skip
    expected = float(measured([wish], f, L[None])[0, 0])
    told = [p for p in points if np.angle(-p.value) > NORMAL * (p.u or 0.0)]
    ahead, above = [p for p in told if abs(p.value) < 1.0], [p for p in told if abs(p.value) > 1.0]
    behind = any(g > 1.0 and at > points[-1].f for at, g in gain_limits(f, L))
    if "upper" not in values and ahead and (behind or max(lost, default=0.0) > ahead[0].f):
        last = ahead[-1]
        found.append(((1.0 - NORMAL * (last.u or 0.0)) / abs(last.value), 0.0, True))
    if "lower" not in values and above and min(lost, default=np.inf) < above[0].f:
        first = above[0]
        found.append(((1.0 - NORMAL * (first.u or 0.0)) * abs(first.value), 0.0, True))
    value, U, bound = min(found, default=(np.inf, 0.0, False))
    return ProvenWish(wish, float(value), float(U), expected, bound)


def _proven(wish: Wish, points: Sequence[Point], f: Array, L: Complex) -> ProvenWish:
    """Read a wish's measure from measured points, with the share of noise and interpolation in U."""
    fine = np.unique(np.append(np.geomspace(points[0].f, points[-1].f, 600), [p.f for p in points]))

    def read(values: Sequence[complex]) -> float:
        moved = [replace(p, value=v) for p, v in zip(points, values, strict=True)]
        return float(measured([wish], fine, interpolate_response(moved, fine)[None])[0, 0])

    got = [p.value for p in points]
    value = read(got)
    squares = 0.0
    for k, p in enumerate(points):
        for part in (1.0, 1j):
            other = list(got)
            other[k] = p.value * cmath.exp(part * (p.u or 0.0))
            change = read(other) - value
            squares += change**2 if np.isfinite(change) else 0.0
    model = np.exp(np.interp(np.log([p.f for p in points]), np.log(f), np.log(np.abs(L)))) * np.exp(
        1j * np.interp(np.log([p.f for p in points]), np.log(f), np.unwrap(np.angle(L)))
    )
    expected = float(measured([wish], f, L[None])[0, 0])
    twin = read([complex(v) for v in model])
    apart = abs(twin - expected) if np.isfinite(twin) and np.isfinite(expected) else 0.0
    return ProvenWish(wish, value, NORMAL * float(np.sqrt(squares)) + apart, expected)
