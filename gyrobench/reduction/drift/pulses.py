"""A rebalance that counts pulses of constant current: what errors of its pulses do to the readings.

With d = (n+ - n-)/(n+ + n-), read as the current I d, the mean current of a binary pulse-width loop is

    I d + (dI_plus - dI_minus)/2 + d (dI_plus + dI_minus)/2 + (2 I + dI_plus + dI_minus) f_s (dT_1 + dT_2 d + dT_3 d2)

[Hu 1981, eq. 5-74..5-76 with ET18; the product of both errors added], so the drift rate omega_IA - k I d is too large
by k times what is beside I d.  A loop with pulses on demand has those of one sign alone while the current keeps its
sign: of the reading x the mean current is

    x + x (dI_plus + dI_minus)/(2 I) + |x| (dI_plus - dI_minus)/(2 I) + x f_q dT        and the product of the errors

[REBAL-PWM, REBAL-PULSE]
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.sources import (
    PULSE_ASYMMETRY,
    PULSE_CURVED,
    PULSE_GROWING,
    PULSE_LATE,
    PULSE_MEAN,
    PULSE_RESOLUTION,
    Effect,
    Source,
)


def of_loop(source: Source, loop: str = "") -> Source:
    """Return a source of one of several loops, "x" or "y"; of the only one: ""."""
    return replace(source, id=f"{source.id}.{loop}", name=f"{source.name}, {loop} loop") if loop else source


@dataclass(frozen=True)
class CurrentWindows:
    """Readings (n,): mean and standard deviation of the current of each step (A), length of the window (s)."""

    mean: Array
    std: Array
    length: Array


@dataclass(frozen=True)
class Pulses:
    """Pulse-width rebalance of a run: current (A), data clock, saw (Hz), and the errors that are simulated (A, s).

    clocks: the resolution of a reading, in clocks of full current.
    """

    current: float
    f_q: float
    f_s: float
    d_plus: float = 0.0
    d_minus: float = 0.0
    late: tuple[float, float, float] = (0.0, 0.0, 0.0)
    clocks: float = 2.0

    @classmethod
    def of(cls, run: RunDocument, slot: str = "rebalance") -> Pulses | None:
        """Return the pulses of the part in ``slot``, on demand where it has no saw; None where it has no clock."""
        p = run.parameters
        if any(f"{slot}.{name}" not in p for name in ("I", "f_q")):
            return None
        current, f_q = float(p[f"{slot}.I"]), float(p[f"{slot}.f_q"])
        plus, minus = (float(p.get(f"{slot}.dI_{sign}", 0.0)) for sign in ("plus", "minus"))
        late = np.append(np.ravel(p.get(f"{slot}.dT", 0.0)), [0.0, 0.0]).tolist()
        if f"{slot}.f_s" not in p:
            return PulsesOnDemand(current, f_q, 0.0, plus, minus, (0.0, late[0], 0.0), clocks=1.0)
        return cls(current, f_q, float(p[f"{slot}.f_s"]), plus, minus, (late[0], late[1], late[2]))

    def effects(self, fit: Findings, k: float, read: CurrentWindows, sizes: Any, loop: str = "") -> list[Effect]:
        """Return the sources with their sensitivities.

        k: torquer scale factor, rad/s/A.  sizes: with u_pulse (A), u_switching (s), see the options.  loop: name of the
        loop where there are several.
        """
        d = read.mean / self.current
        one = np.ones_like(d)
        edge = k * (2.0 * self.current + self.d_plus + self.d_minus) * self.f_s
        square = d**2 + (read.std / self.current) ** 2  # the noise of d is rectified
        note = "two clocks, independent from window to window"
        return [
            of_loop(PULSE_ASYMMETRY, loop).effect(sizes, 0.5 * k * one, simulated=(self.d_plus - self.d_minus,)),
            of_loop(PULSE_MEAN, loop).effect(0.0, k * d, simulated=((self.d_plus + self.d_minus) / 2.0,)),
            of_loop(PULSE_LATE, loop).effect(sizes, edge * one, simulated=(self.late[0],)),
            of_loop(PULSE_GROWING, loop).effect(sizes, edge * d, simulated=(self.late[1],)),
            of_loop(PULSE_CURVED, loop).effect(sizes, edge * square, simulated=(self.late[2],)),
            of_loop(PULSE_RESOLUTION, loop).effect(12.0**-0.5, values=self._counts(fit, k, read), note=note),
        ]

    def _counts(self, fit: Findings, k: float, read: CurrentWindows) -> Array:
        """Return what the resolution, in every window anew, makes of each value."""
        each = self.clocks * k * self.current / self.f_q / read.length
        return np.asarray(np.sqrt(np.sum((fit.gain * each) ** 2, axis=1)))


class PulsesOnDemand(Pulses):
    """Rebalance by pulses on demand: one clock long each, late[1] by how much longer (s)."""

    def effects(self, fit: Findings, k: float, read: CurrentWindows, sizes: Any, loop: str = "") -> list[Effect]:
        """Return the sources with their sensitivities, as those of pulse widths; a window has pulses of one sign."""
        d = read.mean / self.current
        longer = 1.0 + self.f_q * self.late[1]
        asymmetric, late = 0.5 * k * longer * np.abs(d), k * self.current * self.f_q * d
        values, note = self._counts(fit, k, read), "a pulse at either end, independent from window to window"
        return [
            of_loop(PULSE_ASYMMETRY, loop).effect(sizes, asymmetric, simulated=(self.d_plus - self.d_minus,)),
            of_loop(PULSE_MEAN, loop).effect(0.0, k * longer * d, simulated=((self.d_plus + self.d_minus) / 2.0,)),
            of_loop(PULSE_GROWING, loop).effect(sizes, late, note="length of a pulse", simulated=(self.late[1],)),
            of_loop(PULSE_RESOLUTION, loop).effect(6.0**-0.5, values=values, note=note),
        ]
