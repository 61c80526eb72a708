"""The shortest plan of a test for wanted uncertainties, or the best plan in a given time, by running what is proposed.

    found = design_test(system, {"k2": "0.5ug/g2"})
    found.options, found.time, found.book_time, found.bound, found.values["k2"].u

1. The system runs once with its own plan: its fits give the ratio of the stated to the least possible uncertainty.
2. Approximate design and exact plans of several lengths under the noise model (plan_search.py), or the choices of
   options that a test offers (choice_search.py).
3. Plans of each length run, are reduced and predicted (predicted_uncertainty.py): few visits leave few degrees of
   freedom, and only the reduction knows their effect.  The dwell follows, until the predicted u is the wanted one.
"""

from __future__ import annotations

import contextlib
import importlib
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gyrobench.arrays import Array
from gyrobench.bench import Bench, UsageError
from gyrobench.design import plan_search
from gyrobench.design.approximate_design import CRITERIA, ApproximateDesign, SingularDesignError
from gyrobench.design.choice_search import search_choices
from gyrobench.design.designed_test import DesignedTest
from gyrobench.design.option_protocol import OptionProtocol
from gyrobench.design.plan_runs import (
    Covariances,
    DesignError,
    Trial,
    Workbench,
    designed_values,
    refuse_type_b,
    trial_of,
    wanted_sizes,
)
from gyrobench.design.plan_search import ExactPlan, Search, Want
from gyrobench.design.predicted_uncertainty import effective
from gyrobench.design.visit_protocol import DataNoise, VisitProtocol
from gyrobench.errors import Advice, GyrobenchError
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import noise as noise_model
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.estimation.fit_result import observed_fits
from gyrobench.system.system import System, load_system

CANDIDATES = 2  # plans that are run until their dwell is settled
CLOSE = 0.01  # of the dwell
ROUNDS = 12  # runs in which the dwell of a plan is found
FINAL, ROUGH = 160, 40  # draws of a prediction
WEAK = 10.0  # times the u of the system's own plan that a value may have of which nothing is wanted
WINDOW = 60.0  # s, over which the noise of a population of instruments is that of the nominal one
Settled = tuple[float, ExactPlan, Trial, Search]  # cost, plan, its run, the search with what the reduction makes of it


def protocol_of(system: System, record: Record) -> VisitProtocol | OptionProtocol:
    """Return what a system with a protocol offers to design, from a run of it as it is."""
    owner = next(cls for cls in type(system).__mro__ if "protocol" in vars(cls))
    module = importlib.import_module(f".{system.protocol}", owner.__module__)
    found: VisitProtocol | OptionProtocol = module.protocol_of(system, record)
    return found


def designed_tests() -> list[str]:
    """Return the systems of the bench that offer plans."""
    found = []
    for name in sorted(Bench.find().systems()):
        with contextlib.suppress(GyrobenchError):
            system = load_system(name)
            if isinstance(system, System) and system.protocol:
                found.append(name)
    return found


def design_test(
    system: System, wants: Mapping[str, str | float], *, time: float | None = None, criterion: str = "minimax",
    instruments: int = 1, noise_of: Path | None = None, parts: Mapping[str, str] | None = None,
    maps: Mapping[str, Path] | None = None, engine: str | None = None, seed: int = 1, count: int = 0,
    given: Mapping[str, str] | None = None, only_known: bool = False,
) -> DesignedTest:  # fmt: skip
    """Return the plan that reaches ``wants`` (name -> standard uncertainty with unit) soonest, or, with ``time`` (s),
    comes nearest to them.

    Without wants the u of the system's own plan are wanted.  criterion: of the ratios u/wanted: "minimax" (all are
    reached), "A" (their mean square is 1), "D" (the volume of the ellipsoid).  instruments: number of noise models
    drawn from the population of gyrobench.reduction.estimation.noise with the nominal variance over a minute; the plan
    is for the worst of them.  noise_of: folder of a run whose estimated noise replaces that of the parts.  count: runs
    in which the prediction is counted.  given: values of the system as texts, for the command that is printed.
    only_known: wants of values that the test does not have are passed over, if it has one of them.
    Raises DesignError, UsageError and what a run raises.
    """
    if criterion not in CRITERIA:
        raise UsageError(f"criterion '{criterion}': one of {', '.join(CRITERIA)}")
    if not system.protocol:
        able = Advice("design", f"design works for {', '.join(designed_tests())} and drift_test_suite")
        raise DesignError(f"{system.name} offers no plans to choose from").advised(able)
    with Workbench(system, parts or {}, maps or {}, engine, seed, dict(given or {})) as bench:
        record, fits = bench.run({})
        protocol = protocol_of(system, record)
        if only_known:
            wants = _known(wants, protocol, system)
        if isinstance(protocol, OptionProtocol):
            if instruments > 1 or noise_of is not None or criterion == "D":
                raise UsageError(
                    f"{system.name} offers choices of options: criterion minimax or A, one instrument, noise of parts"
                )
            own = trial_of(record, fits, protocol.covariances, ROUGH)
            return search_choices(bench, protocol, own, wants, time, criterion, count)
        if noise_of is not None:
            if count:
                raise UsageError("--noise and --count: runs have the noise of the parts; give it to them with --set")
            protocol = _with_noise_of(protocol, noise_of, system)
        own = trial_of(record, fits, _covariances(protocol, [j for j, _ in protocol.book]), ROUGH)
        places = {n: (k, j) for k, c in enumerate(protocol.channels) for j, n in enumerate(c.names)}
        sizes = wanted_sizes(wants, own, list(places))
        refuse_type_b(sizes, own)
        asked = frozenset(sizes)
        if wants and criterion != "D":  # the reduction estimates all its unknowns: a plan must determine them
            sizes = {n: sizes.get(n, v * WEAK) for n, v in wanted_sizes({}, own, list(places)).items()}
        wanted = {n: Want(*places[n], size) for n, size in sizes.items()}
        return _searched(bench, protocol, own, wanted, asked, time, criterion, instruments, count)


def _known(
    wants: Mapping[str, str | float], protocol: VisitProtocol | OptionProtocol, system: System
) -> dict[str, str | float]:
    """Return the wants of values that a test has.  Raises DesignError where it has none of them."""
    visits = isinstance(protocol, VisitProtocol)
    names = {n for c in protocol.channels for n in c.names} if visits else set(protocol.names)  # type: ignore[union-attr]
    found = {n: u for n, u in wants.items() if n in names}
    if not found:
        raise DesignError(f"{system.name} determines none of {', '.join(wants)}")
    return found


def _searched(
    bench: Workbench, protocol: VisitProtocol, own: Trial, wanted: dict[str, Want], asked: Collection[str],
    time: float | None, criterion: str, instruments: int, count: int,
) -> DesignedTest:  # fmt: skip
    nominal = tuple(c.noise for c in protocol.channels)
    everybody = (nominal, *_population(nominal, instruments - 1))
    search = Search(protocol, tuple(_calibrated(wanted, own)), everybody, criterion, len(asked))
    if lost := plan_search.determined(search, wanted):
        raise DesignError(f"{', '.join(lost)}: no plan of {bench.system.name} determines it")
    design = search.approximate(nominal, 2.0 * protocol.settle + 1.0)
    plans = [plan_search.search_plan(search, design, n, time) for n in plan_search.numbers_of_visits(search)]
    plans = sorted((p for p in plans if math.isfinite(p.duration)), key=lambda p: p.cost(time is not None))
    plans = [p for p in (*_different(plans), plan_search.book_plan(search, time)) if math.isfinite(p.duration)]
    if not plans:
        raise DesignError(_unreachable(search, wanted, time))
    best = _best_of(bench, search, wanted, plans, time)
    final = _settled(bench, best[3], wanted, best[1], time, FINAL)
    _, plan, trial, judged = min((final, *_bettered(bench, wanted, design, best, time)), key=lambda x: x[0])
    book = plan_search.book_plan(replace(judged, wants=tuple(_calibrated(wanted, own)), _maps={}), time)
    ideal = replace(judged, wants=tuple(replace(w, inflation=1.0) for w in judged.wants), _maps={})
    if time is not None and math.isfinite(book.duration):  # beside which the plan is shown
        own = bench.trial(protocol.options(book.visits), _covariances(protocol, book.places), ROUGH)
    bound, optimum = plan_search.shortest_time(ideal, nominal)
    options = protocol.options(plan.visits)
    sizes = {n: w.u for n, w in wanted.items()}
    return DesignedTest(
        bench.system.name, dict(bench.given), options, tuple((protocol.labels[j], t) for j, t in plan.visits),
        trial.time, book.duration, bound, _efficiency(ideal, optimum, plan), time is not None, criterion,
        designed_values(trial, own, sizes, asked), bench.unseen([*protocol.unseen, *trial.hidden], options),
        bench.count(options, list(trial.values), count),
    )  # fmt: skip


def _covariances(protocol: VisitProtocol, places: Sequence[int]) -> Covariances:
    """Return the covariances of the fits of a plan; places: the candidate of each visit, in their order."""

    def of(fits: Sequence[Findings], record: Record) -> list[Array]:
        out = []
        for fit, channel in zip(fits, protocol.channels, strict=True):
            repeat = np.broadcast_to(channel.repeat, (len(channel.rows),))
            independent = repeat[list(places)] if len(places) == fit.y.size else 0.0
            out.append(channel.noise.covariance(fit.t_start, fit.t_end, independent))
        return out

    return of


def _best_of(
    bench: Workbench, search: Search, wanted: Mapping[str, Want], plans: Sequence[ExactPlan], time: float | None
) -> Settled:
    """Run every plan once, a few visits and many: the cost of few degrees of freedom only the reduction tells; settle
    those that are the best by what it made of them.
    """
    reasons, tried = [], []
    for plan in plans:
        try:
            tried.append(_settled(bench, search, wanted, plan, time, ROUGH, 1))
        except GyrobenchError as error:
            reasons.append(str(error))
    tried = sorted((t for t in tried if math.isfinite(t[0])), key=lambda t: t[0])
    if not tried:
        raise DesignError("; ".join(dict.fromkeys(reasons)) or _unreachable(search, wanted, time))
    settled = []
    for _, plan, _, judged in tried[:CANDIDATES]:
        try:
            settled.append(_settled(bench, judged, wanted, plan, time, ROUGH))
        except GyrobenchError as error:
            reasons.append(str(error))
    if not settled:
        raise DesignError("; ".join(dict.fromkeys(reasons)))
    return min(settled, key=lambda t: t[0])


def _bettered(
    bench: Workbench, wanted: Mapping[str, Want], design: ApproximateDesign, best: Settled, time: float | None
) -> list[Settled]:
    """Return a plan of as many visits, searched for with what the reduction made of the best one, where it promises
    more.
    """
    cost, plan, _, judged = best
    plan = plan_search.finish(judged, plan.places, plan.weights, time)
    tried = plan_search.search_plan(judged, design, len(plan.places), time)
    better = min(plan_search.exchanged(judged, design, plan, time), tried, key=lambda p: p.cost(time is not None))
    if not better.cost(time is not None) < 0.98 * cost:
        return []
    try:
        return [_settled(bench, judged, wanted, better, time, FINAL)]
    except GyrobenchError:
        return []


def _settled(
    bench: Workbench, search: Search, wanted: Mapping[str, Want], plan: ExactPlan, time: float | None, draws: int,
    rounds: int = ROUNDS,
) -> Settled:  # fmt: skip
    """Run a plan and set its dwell by what the reduction makes of it; return cost, plan, run, search.

    With one round the plan is the one that would be next, its cost that of its promise; else the run is the plan's.
    Raises DesignError where no dwell was found that the reduction confirms.
    """
    bounds: dict[bool, tuple[float, float]] = {}  # too short, too long: ln of the last dwell, and what it lacks
    for _ in range(rounds):
        trial = bench.trial(search.protocol.options(plan.visits), _covariances(search.protocol, plan.places), draws)
        search = replace(search, wants=tuple(_calibrated(wanted, trial)), _maps={})
        again = plan_search.finish(search, plan.places, plan.weights, time)
        if time is not None or not math.isfinite(again.duration):
            return again.cost(time is not None), plan, trial, search
        lacks = math.log(again.dwell / plan.dwell)
        if abs(lacks) < CLOSE:
            return trial.time, plan, trial, search
        # u falls with the dwell faster than the noise does where the noise model has few degrees of freedom: what the
        # reduction asks for goes beyond the mark, and only between two dwells that were run is it found
        bounds[lacks > 0.0] = math.log(plan.dwell), lacks
        plan = again
        if len(bounds) == 2:
            (x0, y0), (x1, y1) = bounds.values()
            between = math.exp(x0 - y0 * (x1 - x0) / (y1 - y0))
            plan = plan_search.with_dwell(search, plan.places, plan.weights, between)
    if rounds == 1:
        return plan.duration, plan, trial, search
    why = "no dwell found at which the reduction states what is wanted; ask for a little more or less"
    raise DesignError(f"{len(plan.places)} visits: {why}")


def _calibrated(wanted: Mapping[str, Want], trial: Trial) -> list[Want]:
    """Return the wants with what the reduction made of the least uncertainty: the larger one of u and error counts."""
    out = []
    for name, want in wanted.items():
        v = trial.values[name]
        own = max(math.sqrt(max(v.u**2 - v.type_b**2, 0.0)), v.error)
        out.append(replace(want, inflation=own / v.least, type_b=v.type_b * v.scale))
    return out


def _unreachable(search: Search, wanted: Mapping[str, Want], time: float | None) -> str:
    if time is not None:
        return f"{time:g} s: moves and settling of the fewest visits take longer"
    slow = any(n.markov > 0.0 for n in search.instruments[0])
    cause = "; its slow drift does not average out" if slow else ""
    return f"{', '.join(wanted)}: not reached by any plan of up to {plan_search.LONGEST:g} s a visit{cause}"


def _population(nominal: Sequence[DataNoise], count: int) -> list[tuple[DataNoise, ...]]:
    """Return instruments of the population of the reductions, with the nominal variance over WINDOW."""
    rng, out = np.random.default_rng(0), []
    t0 = np.arange(0.0, 3600.0, WINDOW)
    for _ in range(count):
        tau, share, _ = noise_model.sample_instrument(rng, t0, t0 + WINDOW)
        v = float(noise_model.mean_variance(np.array(WINDOW / tau)))
        sizes = [effective(n, WINDOW) for n in nominal]
        out.append(
            tuple(DataNoise(s * math.sqrt(1.0 - share), s * math.sqrt(share / (WINDOW * v)), tau) for s in sizes)
        )
    return out


def _with_noise_of(protocol: VisitProtocol, folder: Path, system: System) -> VisitProtocol:
    """Return the protocol with the most likely noise of a run of the same system.  Raises UsageError.

    A short run shows no slow drift: what it cannot exclude is named in ``unseen``, and so is drift with a power law, in
    whose place stands the Gauss-Markov drift most like it.  Nor do its windows show the noise within them: visits are
    no shorter.
    """
    record = Record.load(folder)
    if record.run.system != system.name:
        raise UsageError(f"--noise {folder}: a run of {record.run.system}; a run of {system.name} is expected")
    with observed_fits() as fits:
        system.reduce(record)
    if any(f.ideal for f, _ in fits):
        raise UsageError(f"--noise {folder}: a run without noise; a run of the instrument, or simulated with its noise")
    estimates = [f.est.noise for f, _ in fits]
    found = [DataNoise(*e.markov) for e in estimates]
    channels = [replace(c, noise=n) for c, n in zip(protocol.channels, found, strict=True)]
    least = min(float(np.min(f.t_end - f.t_start)) for f, _ in fits)
    said = f"the noise is the likeliest one of {folder}, and visits are not shorter than its windows of {least:.3g} s"
    if all(e.density[0] > 0.0 for e in estimates):
        slow = max(e.sigma[2] / e.density[0] for e in estimates) * math.sqrt(WINDOW)
        said += (
            f"; slow drift of up to {slow:.2g} times the white noise of a minute (95 %) is as well possible there, and "
            "would ask for more or shorter visits"
        )
    slope = max(e.slope for e in estimates)
    if slope:
        said += (
            f"; the spectrum of its drift is rather 1/f^{slope:g}, in whose place the plan has the Gauss-Markov drift "
            "most like it: drift that grows with the length of the test is not in the figures"
        )
    return replace(protocol, channels=tuple(channels), unseen=(*protocol.unseen, said), least=least)


def _different(plans: Sequence[ExactPlan]) -> list[ExactPlan]:
    """Return the plans, the first of each number of visits."""
    return list({len(p.places): p for p in reversed(plans)}.values())[::-1]


def _efficiency(search: Search, optimum: ApproximateDesign, plan: ExactPlan) -> float:
    """Return how near the shares of a plan are to the best ones under white noise, 1: no better ones exist."""
    shares = np.zeros(len(search.protocol.labels))
    np.add.at(shares, list(plan.places), plan.weights / plan.weights.sum())
    try:
        return min(1.0, optimum.bound / search.value_of(shares))
    except SingularDesignError:
        return 0.0
