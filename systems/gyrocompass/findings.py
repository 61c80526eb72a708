"""Findings of a gyrocompass, phase by phase: heading error, fit of the oscillation, what the phase before has left."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.loops.toolkit import DEG, Gate, LoopFindings, wrapped

from .linear import LinearCompass, Steaming
from .oscillation import Oscillation, fit

SCALES = {"h": 3600.0, "min": 60.0, "°": DEG, "1": 1.0}  # of the printed units, SI
SAMPLES = 160  # of a fit
KNOWN = 0.05  # relative, of poles between courses, where a phase holds no swing of its own


def error(gate: Gate) -> Array:
    """Return the heading shown less the true one, rad."""
    return wrapped(gate["compass.psi"] - gate["ship.heading"])


def means(gate: Gate, y: Array, block: int) -> tuple[Array, Array]:
    """Return time and mean of blocks of so many samples."""
    n = y.size // block
    return gate.t[: n * block].reshape(n, block).mean(axis=1), y[: n * block].reshape(n, block).mean(axis=1)


def steaming(gate: Gate) -> Steaming:
    """Return the mean course, speed and latitude of a phase."""
    course = gate["ship.heading"]
    return Steaming(
        math.atan2(float(np.sin(course).mean()), float(np.cos(course).mean())),
        float(gate["ship.speed"].mean()),
        float(gate["ship.latitude_now"].mean()),
    )


def wrap(angle: float) -> float:
    return float(wrapped(np.array([angle]))[0])


class CompassFindings(LoopFindings):
    """Findings of one record; after its settling each phase knows the poles and the error before it."""

    def __init__(self, record: Record) -> None:
        super().__init__(record, linearized=False)
        self.linear_compass = LinearCompass.of(record.run.parameters)
        self.poles: tuple[Array, Array] | None = None
        self.before: Oscillation | None = None  # of the settled phase before
        self.unsettled = ""

    def note(
        self, name: str, meaning: str, unit: str, value: float, u: float, closed: float | None = None, why: str = ""
    ) -> None:
        """Add a measure, SI; void after a phase that has not settled, or for a reason of its own."""
        void = self.unsettled or why
        self.measure(name, meaning, unit, value, u, scale=SCALES[unit], closed=closed, unsettled=void)

    def guess(self, at: Steaming, free: bool) -> Array:
        """Return first poles: of the linear model, else those of a Schuler-tuned compass."""
        own = self.linear_compass
        omega = own.omega(at) if own else 1.24e-3
        if free or own is None:
            return np.array([(0.01 if free else 0.3) * omega, omega])
        roots = own.roots(at)
        pair = roots[np.argmax(np.abs(roots.imag))]
        if abs(pair.imag) < 1e-9:  # it creeps: two real roots for the pair
            slow = np.sort(-roots.real)
            return np.array([0.5 * (slow[0] + slow[1]), math.sqrt(slow[0] * slow[1]), *slow[2:]])
        real = (-r.real for r in roots if abs(r.imag) < 1e-12)
        return np.array([max(-pair.real, 1e-3 * abs(pair)), abs(pair), *real])

    def fitted(self, gate: Gate, label: str, *, free: bool = False, after: float = 0.0) -> Oscillation | None:
        """Return the oscillation of a phase from ``after`` s on; with the poles of the settling, where it has none."""
        at, y, dt = steaming(gate), error(gate), float(gate.t[1] - gate.t[0])
        late = gate.t - gate.t[0] >= after
        if int(late.sum()) < SAMPLES // 2:
            return None
        first = int(np.argmax(late))
        block = self.block(dt, y.size - first)
        t, z = means(gate, np.unwrap(y), block)
        t, z = t[first // block :], z[first // block :]
        trend = bool(np.ptp(gate["ship.latitude_now"]) > 1e-9)
        known = None if free or label == "settling" else self.poles
        found = fit(t, z, self.guess(at, free) if known is None else known[0], trend=trend, known=known)
        if found is not None and found.whiteness < 1e-3:
            text = f"The residuals of {label} are correlated (p < 0.001): neither noise of the reading nor drift."
            self.doubt(f"residuals.correlated:{label}", text)
        return found

    def block(self, dt: float, n: int) -> int:
        """Return the samples of a mean: whole periods of the roll."""
        roll = max(1, round(float(self.record.run.options.get("roll_period", dt)) / dt))
        return max(1, round(n / SAMPLES / roll)) * roll if n > SAMPLES * roll else max(1, n // SAMPLES)
