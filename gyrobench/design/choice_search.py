"""The shortest of a few choices of options, each with its length set by what its own reduction makes of it.

Choices whose windows are known without a run are compared first, by generalized least squares; the best of them and
all others are run, predicted, and lengthened or shortened until they reach what is wanted.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from gyrobench.design.designed_test import DesignedTest
from gyrobench.design.option_protocol import Choice, OptionProtocol
from gyrobench.design.plan_runs import DesignError, Trial, Workbench, designed_values, refuse_type_b, wanted_sizes
from gyrobench.errors import GyrobenchError

ROUNDS, RUN = 5, 3  # runs of a choice; choices of known windows that are run
CLOSE = 0.005  # of the wanted uncertainties
FINAL, ROUGH = 160, 40  # draws of a prediction
LONGEST = 1e7  # s


def search_choices(
    bench: Workbench, protocol: OptionProtocol, own: Trial, wants: Mapping[str, str | float], time: float | None,
    criterion: str, count: int,
) -> DesignedTest:  # fmt: skip
    """Return the best of the choices of a test.  Raises DesignError and UsageError."""
    wanted = wanted_sizes(wants, own, [n for n in protocol.names if n in own.values])
    refuse_type_b(wanted, own)

    def merit(trial: Trial) -> float:
        """Return the criterion of (u/wanted)^2, type B kept, inf where a value is not determined."""
        if any(n not in trial.values for n in wanted):
            return math.inf
        squares = [(trial.values[n].size * trial.values[n].scale / size) ** 2 for n, size in wanted.items()]
        return max(squares) if criterion == "minimax" else sum(squares) / len(squares)

    book, *others = protocol.choices
    reasons: list[str] = []
    found: list[tuple[float, Choice, float, Trial]] = []
    if protocol.propose is not None:
        others += protocol.propose(wanted, time, criterion)
    for choice in [book, *_promising(others, protocol, wanted, time)]:
        try:
            length, trial, value = _settled(bench, protocol, choice, merit, time, ROUGH)
            found.append((value if time is not None else trial.time, choice, length, trial))
        except GyrobenchError as error:
            reasons.append(f"{choice.label}: {error}")
    reached = [f for f in found if math.isfinite(f[0])]
    if not reached:
        raise DesignError("; ".join(dict.fromkeys(reasons)) or f"{', '.join(wanted)}: reached by no choice of options")
    _, choice, length, _ = min(reached, key=lambda f: f[0])
    again = replace(choice, start=length)
    length, trial, _ = _settled(bench, protocol, again, merit, time, FINAL)
    options = choice.options(length)
    of_book = trial if choice is book else next((t for _, c, _, t in found if c is book), None)
    own_time = math.inf if of_book is None else of_book.time
    if time is not None and of_book is not None:
        own = of_book
    return DesignedTest(
        bench.system.name, dict(bench.given), options, ((choice.label, length),), trial.time,
        trial.time if time is not None else own_time, math.nan, math.nan, time is not None, criterion,
        designed_values(trial, own, wanted, frozenset(wanted)),
        bench.unseen([*protocol.unseen, *trial.hidden], options), bench.count(options, list(trial.values), count),
        tuple((c.label, t.time if time is None else math.sqrt(v)) for v, c, _, t in sorted(found, key=lambda f: f[0])),
    )  # fmt: skip


def _settled(
    bench: Workbench, protocol: OptionProtocol, choice: Choice, merit: Callable[[Trial], float], time: float | None,
    draws: int,
) -> tuple[float, Trial, float]:  # fmt: skip
    """Return length, run and criterion of a choice that takes ``time``, or reaches what is wanted.

    The criterion falls as 1/length under white noise; two runs give the power that it really falls by.
    Raises DesignError for one that does not get there.
    """
    length, power = max(choice.start, choice.least), 1.0
    before: tuple[float, float] | None = None
    tried: list[tuple[float, Trial, float]] = []
    for _ in range(ROUNDS):
        trial = bench.trial(choice.options(length), protocol.covariances, draws)
        value = merit(trial)
        if time is not None:
            if abs(trial.time / time - 1.0) < CLOSE:
                return length, trial, value
            following = (
                length * time / trial.time
                if before is None
                else length + (time - trial.time) * ((length - before[0]) / (trial.time - before[1] or 1e-9))
            )
            before = length, trial.time
        else:
            if abs(math.sqrt(value) - 1.0) < CLOSE or (value < 1.0 and length <= choice.least):
                return length, trial, value
            if before is not None and abs(math.log(length / before[0])) > 1e-6:
                power = -math.log(value / before[1]) / math.log(length / before[0])
                power = min(max(power, 0.2), 3.0)
            before = length, value
            tried.append((length, trial, value))
            following = length * value ** (1.0 / power)
        if not following < LONGEST:
            raise DesignError("not reached in any time: slow drift does not average out")
        length = max(following, choice.least)
    if time is not None:
        return before[0] if before else length, trial, value
    # which effects a fit weighs changes from run to run, and u with it: the shortest run that got there counts
    reached = [t for t in tried if math.sqrt(t[2]) <= 1.0 + 4.0 * CLOSE]
    if not reached:
        raise DesignError(f"u/wanted stays at {math.sqrt(value):.3g}")
    return min(reached, key=lambda t: t[1].time)


def _promising(
    choices: Sequence[Choice], protocol: OptionProtocol, wanted: Mapping[str, float], time: float | None
) -> list[Choice]:
    """Return the choices to be run: of those with known windows the best few, their start at the promised length."""
    ranked = []
    for choice in choices:
        if choice.windows is None:
            continue
        length = _promised(choice, protocol, wanted, time)
        if math.isfinite(length):
            assert choice.windows is not None
            ranked.append((float(choice.windows(length)[2][-1]), replace(choice, start=length)))
    best = [c for _, c in sorted(ranked, key=lambda r: r[0])[:RUN]]
    return [*best, *(c for c in choices if c.windows is None)]


def shortest(enough: Callable[[float], bool], least: float, longest: float, halvings: int) -> float:
    """Return the length from which on it is enough, no less than ``least``, by bisection; inf beyond ``longest``."""
    low = high = least
    while not enough(high):
        low, high = high, 2.0 * high
        if high > longest:
            return math.inf
    for _ in range(halvings):
        middle = math.sqrt(low * high)
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


def _promised(choice: Choice, protocol: OptionProtocol, wanted: Mapping[str, float], time: float | None) -> float:
    """Return the length at which a choice reaches what is wanted with its noise known, by bisection; inf where not."""
    assert choice.windows is not None
    index = [protocol.names.index(n) for n in wanted]
    sizes = np.array(list(wanted.values()))

    def enough(length: float) -> bool:
        assert choice.windows is not None and protocol.noise is not None
        X, t0, t1 = choice.windows(length)
        if time is not None:
            return bool(t1[-1] > time)
        Z = np.linalg.solve(np.linalg.cholesky(protocol.noise.covariance(t0, t1)), X)
        scale = np.linalg.norm(Z, axis=0)
        inverse = np.linalg.pinv((Z / scale).T @ (Z / scale), hermitian=True)
        u = np.sqrt(np.diag(inverse))[index] / scale[index]
        return bool(np.all(u <= sizes))

    return shortest(enough, choice.least, LONGEST, 12)
