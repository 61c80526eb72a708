"""The linear model of a part that samples every n communication steps (its parameter Component.sampling_parameter).

Its step repeats after n, x+ = A_i x + B_i u, y = C_i x+ + D_i u in phase i.  Two models follow.

``steps``     of the phases.  Where B is 0 in all but one, a loop that is opened at an input of the part is that of the
              samples: from the instant at which it takes one to the next, everything else steps n times.  Exact.
``baseband``  at the communication step, the mean of the part over all n instants at which it could have begun, with
              one copy of it in each phase: X_i+ = A_i X_(i-1) + B_i u,  y = 1/n sum_i C_i X_i+ + D_i u.  It gives
              sines at their own frequency; what the sampler makes of others (aliases) is not in it.

Not modelled: parts with several periods.
Source: Astrom 1997, sections 2.3 and 7.2 (sampling in a loop; own derivation of the mean over the beginnings).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gyrobench.component import Component, ComponentError
from gyrobench.linear.sampled_model import ALIKE, DELTA, MAX_DISCRETE, SETTLED, SampledStep, differences
from gyrobench.record.frequency_response import reached

TRIED = 12  # periods with random inputs, and as many after them
MOST = 200  # communication steps in it


@dataclass
class MultirateStep:
    """Steps by phase; tick: number of that which alone takes the inputs, None where they act in several."""

    steps: list[SampledStep]
    tick: int | None

    @property
    def every(self) -> int:
        return len(self.steps)

    def baseband(self) -> SampledStep:
        """Return the step of the mean over all beginnings; states: of the copies, by phase."""
        n, m = self.every, len(self.steps[0].names)
        a = np.zeros((n * m, n * m))
        for i, step in enumerate(self.steps):
            before = (i - 1) % n
            a[i * m : (i + 1) * m, before * m : (before + 1) * m] = step.a
        b, c = np.vstack([s.b for s in self.steps]), np.hstack([s.c for s in self.steps]) / n
        names = [f"{name} (phase {i})" for i in range(1, n + 1) for name in self.steps[0].names]
        return SampledStep(names, a, b, c, np.mean([s.d for s in self.steps], axis=0))


def multirate_step(part: Component, inputs: list[str], outputs: list[str], step: float) -> MultirateStep | None:
    """Return the steps of a part whose sampling period is several communication steps; None for any other part.

    Raises ValueError (the text says why) for a part whose steps do not repeat after it.
    """
    known = {s.name for s in part.layout if s.section == "parameter"}
    n = round(float(part.get(part.sampling_parameter)) / step) if part.sampling_parameter in known else 0
    if n < 2 or not inputs:
        return None
    if n > MOST:
        raise ValueError(f"its period is {n} communication steps: {MOST} at most")
    twin = type(part)(part.instance)
    twin.set_state(part.get_state())
    try:
        _run(twin, n, step)
        names = _reached(twin, inputs, n, step)
        if len(names) > MAX_DISCRETE:
            raise ValueError(f"keeps {len(names)} values in memory")
        first, after = (_period(twin, inputs, outputs, step, names, n) for _ in range(2))
        if not _alike(first, after, ALIKE / SETTLED):
            _run(twin, n * -(-SETTLED // n), step)
            first, after = (_period(twin, inputs, outputs, step, names, n) for _ in range(2))
            if not _alike(first, after, ALIKE):
                raise ValueError("its steps do not repeat after its period (a memory, or several periods)")
        after = _between(after)
        if not _follows(twin, inputs, outputs, step, after):
            raise ValueError("its steps do not repeat after its period (a memory, or several periods)")
    except ComponentError as error:
        raise ValueError(str(error)) from error
    ticks = [k for k, s in enumerate(after) if np.any(s.b)]
    return MultirateStep(after, ticks[0] if len(ticks) == 1 else None)


def _between(steps: list[SampledStep]) -> list[SampledStep]:
    """Return the steps with those states alone that the inputs reach and that reach an output."""
    a = np.sum([np.abs(s.a) for s in steps], axis=0)
    b, c = np.hstack([s.b for s in steps]), np.vstack([s.c for s in steps])
    use = reached(a, b) & reached(a.T, c.T)
    return [
        SampledStep(
            [n for n, u in zip(s.names, use, strict=True) if u], s.a[np.ix_(use, use)], s.b[use], s.c[:, use], s.d
        )
        for s in steps
    ]


def _follows(twin: Component, inputs: list[str], outputs: list[str], step: float, steps: list[SampledStep]) -> bool:
    """Return whether the part's own outputs are those of the steps, for small random inputs and after their end.

    What the part keeps where the differences have not looked (a ring of readings) shows here.
    """
    still, moved = (type(twin)(twin.instance) for _ in range(2))
    for other in (still, moved):
        other.set_state(twin.get_state())
    rng = np.random.default_rng(1)
    rest = np.array([twin.get(name) for name in inputs])
    size = DELTA * np.maximum(1.0, np.abs(rest))
    x, off, most = np.zeros(len(steps[0].names)), 0.0, 0.0
    for k in range(2 * TRIED * len(steps)):
        u = size * rng.uniform(-1.0, 1.0, rest.size) * (k < TRIED * len(steps))
        for name, value in zip(inputs, rest + u, strict=True):
            moved.set(name, value)
        for other in (still, moved):
            other.do_step(other.t, step)
            other.flow()
        now = steps[k % len(steps)]
        x = now.a @ x + now.b @ u
        y = np.array([moved.get(name) - still.get(name) for name in outputs])
        off = max(off, float(np.abs(y - now.c @ x - now.d @ u).max(initial=0.0)))
        most = max(most, float(np.abs(y).max(initial=0.0)))
    return off <= ALIKE * most


def _run(twin: Component, count: int, step: float) -> None:
    for _ in range(count):
        twin.do_step(twin.t, step)


def _reached(part: Component, inputs: list[str], n: int, step: float) -> list[str]:
    """Return the discrete values that depend on the inputs or on the states within two periods."""
    discrete = [s.name for s in part.layout if s.section == "discrete"]
    values = []
    for size in (0.0, DELTA):
        twin = type(part)(part.instance)
        twin.set_state(part.get_state())
        for name in [*inputs, *(s.name for s in part.states)]:
            twin.set(name, twin.get(name) + size)
        _run(twin, 2 * n, step)
        values.append([twin.get(name) for name in discrete])
    return [name for name, a, b in zip(discrete, *values, strict=True) if a != b]


def _period(
    twin: Component, inputs: list[str], outputs: list[str], step: float, names: list[str], n: int
) -> list[SampledStep]:  # fmt: skip
    found = []
    for _ in range(n):
        found.append(differences(twin, inputs, outputs, step, names))
        twin.do_step(twin.t, step)
    return found


def _alike(one: list[SampledStep], other: list[SampledStep], change: float) -> bool:
    return all(a.is_like(b, change) for a, b in zip(one, other, strict=True))
