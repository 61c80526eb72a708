"""Tune the stabilizer of a system: linear plants over the spread, search, worst case, proof in co-simulation."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench import units
from gyrobench.bench import Bench, UsageError, suggest_names
from gyrobench.component import ComponentError
from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session
from gyrobench.errors import GyrobenchError
from gyrobench.linear.linear_model import LinearizationError, known_parts
from gyrobench.side_by_side import each
from gyrobench.system.line_of_sight import LineOfSight
from gyrobench.system.system import System
from gyrobench.system.values import flatten, with_elements
from gyrobench.tuning.controller_search import TuningProblem, box, frequencies, polished, search
from gyrobench.tuning.loop_ports import LoopPorts, loops_of
from gyrobench.tuning.own_controllers import checked_structure, own_controller
from gyrobench.tuning.plant import STICKS, Plant, modes, plants, without_friction
from gyrobench.tuning.proof import ExpectedJitter, Proof, known_limit, proof_of
from gyrobench.tuning.quietness import about, quieted
from gyrobench.tuning.reasons import reasons_of
from gyrobench.tuning.robustness import crossovers
from gyrobench.tuning.sight_allowance import allowed
from gyrobench.tuning.sight_jitter import SightModel, sight_models
from gyrobench.tuning.spread import Range, parse_spread, points
from gyrobench.tuning.structures import Controller, ControllerStructure
from gyrobench.tuning.synthesis import structure_of
from gyrobench.tuning.trade import trade, traded
from gyrobench.tuning.tuned_loop import WishResult
from gyrobench.tuning.tuned_settings import TuningError, plan_settings, quiet, settings_of
from gyrobench.tuning.tuning_notes import driven, idle, of_proofs, slips, slower, states
from gyrobench.tuning.wishes import JITTER, Wish, parse_wishes, with_margin
from gyrobench.tuning.written_loop import TunedLoop

Stated = Callable[[Mapping[str, Any]], LineOfSight]
DENSE = 1500  # frequencies of the final figures
HIGHEST = 0.4  # of the frequency of the communication steps: a wish may be there
ROUNDS = 3  # of the search for worse points between those of the spread


def tune(
    system: System,
    want: Sequence[str],
    over: Sequence[str] = (),
    structure: str = "",
    *,
    parts: Mapping[str, str] | None = None,
    maps: Mapping[str, Path] | None = None,
    seed: int = 1,
    given: Mapping[str, Any] | None = None,
    loop: str = "",
    pareto: Sequence[str] = (),
) -> TunedLoop:
    """Return the controller of a structure with the largest worst ratio of got to wanted over the spread, proven.

    want: "phase margin=40deg"; over: "platform.J=±30%".  given: the settings that ``system`` has, for the command.
    structure: factors joined by "+", or lqg, hinf; "": lead-lag, or what the part has that cannot be another one.
    loop: name of the loop, of a system that has several; the others stay as they are.
    pareto: names of two wishes whose trade is wanted.
    Raises UsageError, TuningError, and what a session raises.
    """
    wishes, implied = with_margin(parse_wishes(want))
    shape = structure_of(structure or "lead-lag")
    pair = traded(pareto, wishes)
    ports = _chosen(system, loop, parts or {})
    system = system.with_values({})
    vars(system)["channels"] = tuple(dict.fromkeys((*system.channels, *ports.channels)))  # what its own plan needs not
    began = time.perf_counter()
    system.nominal = dict(system.overrides)
    with Session(system, parts, maps, bench=Bench.find().folder, child=True) as session:
        now, _, document = session.prepare({}, seed)
        nominal = document.parameters
        own = own_controller(nominal, ports.slot)
        if own is not None:
            shape = checked_structure(own, structure_of(structure or own.structure), ports.slot)
        ranges = parse_spread(over, lambda name: _known(session, nominal, name, ports.slot))
        elements = {k: v for n, value in nominal.items() for k, v in flatten(n, value).items()}
        ranges = [r.in_steps(elements[r.name], now.step) for r in ranges]
        for w in wishes:
            if max(w.f, w.value if w.name == "bandwidth" else 0.0) >= HIGHEST / now.step:
                raise UsageError(f"--want {w.name}: the communication step of {now.step:g} s reaches up to "
                                 f"{HIGHEST / now.step:g} Hz")  # fmt: skip
        stated = _line_of_sight(now, wishes, ports)
        sources = stated(nominal) if stated else None
        wishes = [replace(w, f=sources.lowest) if w.name == JITTER and sources else w for w in wishes]
        models = _Loop(session, now, nominal, ranges, ports, stated)
        problem = models.problem(shape, wishes)
        x = search(problem)
        x = _worse_points(models, problem, x)
        exchanged = trade(problem, x, pair) if pair else None  # of the best: the quiet one has given some of it away
        quiet_one = quieted(problem, x)
        x = quiet_one.x if quiet_one else x
    try:
        controller = problem.controller(x)
    except ArithmeticError as error:
        raise TuningError(f"{system.name}: no controller of structure {shape.name} was found: {error}") from None
    seconds = time.perf_counter() - began
    held = problem.plants[0].with_controller(controller)
    poles = held.poles(problem.plants)
    f = frequencies(problem.plants, problem.box, wishes, DENSE, modes(poles.ravel(), models.step))
    responses = problem.plants[0].controller_response(controller, f)
    loops = np.array([p.response(f) * responses + p.past(f) for p in problem.plants])
    if np.max(np.abs(poles)) > 1.0 + 1e-8:
        slow = 10.0 ** problem.box[0, 0] / (2.0 * np.pi)
        raise TuningError(
            f"{system.name}: no {shape.name} that crosses at {slow:.3g} Hz or more holds the loop stable"
            f"{' over the whole spread' if ranges else ''}; want less bandwidth, or take another structure"
            f"{', or a smaller spread' if ranges else ''}"
        )
    ways = [s.at(f) for s in problem.sights]
    got = problem.measures(f, loops, ways, responses)
    results = _results(wishes, got, problem.plants)
    at_points = [p.values for p in problem.plants]
    wanted = [w for w in wishes if w.name == JITTER]
    shares = [
        x for w in wanted if sources
        for x in allowed(w, ways, responses, at_points, nominal, known_limit(nominal, ports), sources.set_by)
    ]  # fmt: skip
    part, settings = settings_of(shape, controller, nominal, system, ports.slot)
    settings |= plan_settings(system, nominal, session, settings, crossovers(f, loops[0]), ports.slot)
    had = all(r.ratio >= 1.0 for r in results)
    reasons = () if had else tuple(reasons_of(models, problem, x, results, f, loops))
    swaps = {**(parts or {}), **({ports.slot: part} if part else {})}
    worst = {n: v for n, v in min(results, key=lambda r: r.ratio).at.items() if n != STICKS}  # a run has both
    runs = [{}, worst] if worst else [{}]

    def proof(run: int) -> Proof:
        at = runs[run]
        k = next(k for k, p in enumerate(problem.plants) if dict(p.values) == dict(at))
        expected = ways[k].rms(responses) if ways else 0.0
        angle = problem.sights[0].angle if sources else ""
        sight = ExpectedJitter(sources.ride, sources.lowest, expected, angle, sources.lost) if sources else None
        with quiet(), Session(system, swaps, maps, bench=Bench.find().folder, child=True) as session:
            try:
                return proof_of(session, settings, at, f, loops[k], responses, wishes, seed, ports, sight)
            except RunError as error:
                return Proof(at, (), (), 0, "", "", None, f"the run did not end: {error}")

    proofs = each(proof, len(runs), long=True)
    return TunedLoop(
        system.name, shape, dict(given or {}), part, settings, controller, tuple(ranges),
        tuple(at_points), tuple(results), tuple(proofs), f, loops,
        swaps={slot: str(name) for slot, name in (parts or {}).items()},
        maps={slot: str(file) for slot, file in (maps or {}).items()},
        seconds=seconds, evaluations=problem.evaluations, reasons=reasons,
        best=quiet_one.ratio if quiet_one else min(r.ratio for r in results),
        notes=(*implied, *about(quiet_one), *idle(problem, ranges), *slips(sources), *states(models.sticks, nominal),
               *slower(wishes, f, loops[0]), *driven(ways, responses, nominal, ports), *of_proofs(proofs)),
        slot=ports.slot, loop=ports.loop if len(system.loops) > 1 else "", trade=exchanged, allowed=tuple(shares),
    )  # fmt: skip


class _Loop:
    """The loop of a system at its nominal parameters, and elsewhere in the spread."""

    def __init__(
        self, session: Session, system: System, nominal: Mapping[str, Any], ranges: Sequence[Range], ports: LoopPorts,
        stated: Stated | None = None,
    ) -> None:  # fmt: skip
        self.assembly, self.part_of = session.assembly, known_parts(dict(session.names), session.bench)
        self.system, self.nominal, self.ranges = system, nominal, ranges
        self.step, self.ports, self.stated = system.step, ports, stated
        #: what is free of friction in the loop that is tuned, and whether that which sticks is judged beside it
        self.free = dict(stated(nominal).free) if stated else without_friction(nominal)
        self.sticks = bool(self.free) and not stated

    def both(self, at: Sequence[Mapping[str, float]]) -> tuple[list[Plant], list[SightModel]]:
        """Return the plants and the sights at points of the spread, side by side.  Raises TuningError."""
        if self.stated is None:
            return self.plants(at), []

        def found(k: int) -> list[Any]:
            return [s.model for s in self.sights(at)] if k else self.plants(at)

        models, without_loop = each(found, 2, long=True)
        sources = [self.stated(with_elements(self.nominal, values)) for values in at]
        sights = [SightModel(m, self.ports, of) for m, of in zip(without_loop, sources, strict=True)]
        return models, sights

    def plants(self, at: Sequence[Mapping[str, float]], step: float | None = None) -> list[Plant]:
        """Return the plants at points of the spread.  Raises TuningError."""
        try:
            there = [self._there(values) for values in at]
            found = plants(self.assembly, self.nominal, self.part_of, step or self.step, there, self.ports)
            return [replace(p, values=values) for p, values in zip(found, at, strict=True)]
        except (LinearizationError, ComponentError) as error:
            raise TuningError(f"{self.system.name}: no linear model to tune: {error}") from None

    def _there(self, values: Mapping[str, float]) -> dict[str, Any]:
        """Return the parameters that differ from nominal at a point: what slips is without friction."""
        if STICKS in values:
            return {n: v for n, v in values.items() if n != STICKS}
        return {n: v for n, v in values.items() if n.partition("[")[0] not in self.free} | self.free

    def sights(self, at: Sequence[Mapping[str, float]]) -> list[SightModel]:
        """Return what moves the line of sight at points of the spread; nothing where no jitter is wanted."""
        if self.stated is None:
            return []
        return sight_models(self.assembly, self.nominal, self.part_of, self.step, at, self.ports, self.stated)

    def problem(self, shape: ControllerStructure, wishes: Sequence[Wish]) -> TuningProblem:
        at: list[dict[str, float]] = points(self.ranges)
        corners = 1 + 2 ** len(self.ranges)
        if self.sticks:
            at = [*at[:corners], *({**values, STICKS: 1.0} for values in at[:corners]), *at[corners:]]
            corners *= 2
        if self.stated:
            self.plants(at[:1]), self.sights(at[:1])  # what all points have in common comes along with the forks
        models, sights = self.both(at)
        shape = shape.of(models[0])
        wanted = self.system.crossovers().get(self.ports.loop)
        decades = box(shape, wishes, wanted, self.step)
        return TuningProblem(
            shape, wishes, models, decades, frequencies(models, decades, wishes), corners, sights=sights
        )


def _chosen(system: System, loop: str, parts: Mapping[str, str]) -> LoopPorts:
    """Return the loop to tune.  Raises UsageError for a system without one, and where one of several is not named."""
    there = loops_of(system)
    if not there:
        able = ", ".join(tunable())
        raise UsageError(f"{system.name} has no loop of a stabilizer that a run can measure; tune works for {able}")
    if loop and loop not in there:
        raise UsageError(f"--loop {loop}: {system.name} has no such loop; {suggest_names(loop, there)}")
    if not loop and len(there) > 1:
        raise UsageError(f"{system.name} has several loops: say --loop {' or --loop '.join(there)}")
    ports = there[loop or next(iter(there))]
    if ports.slot in parts:
        raise UsageError(f"--part {ports.slot}={parts[ports.slot]}: tune chooses the stabilizer")
    return ports


def _line_of_sight(system: System, wishes: Sequence[Wish], ports: LoopPorts) -> Stated | None:
    """Return how a system states what makes its line of sight jitter, where that is wanted.  Raises UsageError."""
    if not any(w.name == JITTER for w in wishes):
        return None
    stated: Stated | None = getattr(system, "line_of_sight", None)
    if stated is None:
        raise UsageError(f"--want jitter: {system.name} does not state what moves a line of sight")
    if ports.kind == "command" and not any(w.name == "bandwidth" or w.f for w in wishes if w.name != JITTER):
        raise UsageError(
            f"--want jitter: it is least with a loop {ports.loop} that does nothing, and its target is lost then; want "
            'what the loop is for, too, --want "bandwidth>1Hz" or --want "S at 0.1Hz<-40dB"'
        )
    return stated


def tunable() -> list[str]:
    """Return the systems of the bench that can be tuned."""
    from gyrobench.system.system import load_system

    found = []
    for name in sorted(Bench.find().systems()):
        with contextlib.suppress(GyrobenchError):
            system = load_system(name)
            if isinstance(system, System) and loops_of(system):
                found.append(name)
    return found


def _known(session: Session, nominal: Mapping[str, Any], name: str, slot_tuned: str) -> tuple[float, str]:
    slot, dot, parameter = name.partition(".")
    if not dot or slot not in session.assembly.bindings:
        raise UsageError(f"--over {name}: write SLOT.PARAMETER; slots: {', '.join(session.assembly.bindings)}")
    own = own_controller(nominal, slot_tuned)
    if slot == slot_tuned and (own is None or not own.own or parameter.partition("[")[0] in own.own):
        raise UsageError(f"--over {name}: the stabilizer is what is tuned")
    there = session.assembly.bindings[slot].parameters
    bound = there.get(parameter) or there.get(parameter.partition("[")[0])
    numbers = {k: v for n, v in nominal.items() if n.startswith(slot + ".") for k, v in flatten(n, v).items()}
    value = numbers.get(name)
    if bound is None or isinstance(value, bool) or not isinstance(value, int | float):
        every = [n.partition(".")[2] for n, v in numbers.items() if isinstance(v, float)]
        if inside := [n for n in every if n.partition("[")[0] == parameter]:
            raise UsageError(f"--over {name}: {parameter} has {len(inside)} numbers, name one: {inside[0]}")
        known = every if "[" in parameter else dict.fromkeys(n.partition("[")[0] for n in every)
        raise UsageError(f"--over {name}: {slot} has no such number; {suggest_names(parameter, known)}")
    unit = units.unit(bound.unit or "1")
    return float(value), unit.name if unit.factor == 1.0 and not unit.offset else unit.dimension


def _worse_points(loop: _Loop, problem: TuningProblem, x: Any) -> Any:
    """Return the controller after worse points of the spread, where there are any, were added to the problem."""
    from scipy.optimize import minimize

    elements = {k: v for n, value in loop.nominal.items() for k, v in flatten(n, value).items()}
    for _ in range(ROUNDS if loop.ranges else 0):
        controller = problem.controller(x)
        ratios = problem.judged(controller)
        k = int(np.argmin(ratios.min(axis=1)))
        start = np.array([problem.plants[k].values.get(r.name, elements[r.name]) for r in loop.ranges])
        low, high = np.array([[r.low, r.high] for r in loop.ranges]).T

        def at(share: Any) -> dict[str, float]:
            return {r.name: r.at(float(x)) for r, x in zip(loop.ranges, np.clip(share, 0.0, 1.0), strict=True)}

        def ratio(share: Any, controller: Controller = controller) -> float:
            there, sights = loop.both([at(share)])
            f = frequencies(there, problem.box, problem.wishes)
            one = TuningProblem(problem.structure, problem.wishes, there, problem.box, f, sights=sights)
            return float(one.judged(controller).min())

        found = minimize(
            ratio, np.clip((start - low) / (high - low), 0.05, 0.95), method="Nelder-Mead",
            options={"maxfev": 15 * len(low), "xatol": 0.02, "fatol": 1e-3},
        )  # fmt: skip
        if found.fun > ratios.min() - 2e-3:
            break
        problem.add(*loop.both([at(found.x)]))
        x = polished(problem, x)
    return x


def _results(wishes: Sequence[Wish], got: Any, models: Sequence[Plant]) -> list[WishResult]:
    """Return the wishes with nominal and worst values; got: (plants, wishes)."""
    found = []
    for k, wish in enumerate(wishes):
        worst = int(np.argmin([wish.ratio(g) for g in got[:, k]]))
        found.append(WishResult(wish, float(got[0, k]), float(got[worst, k]), models[worst].values))
    return found
