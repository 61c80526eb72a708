"""Supplies of a gyro off their nominal values: what their departures do to the readings of a drift test.

Of a gyro in torque rebalance, with the departures of its part (gyrobench.component.blocks.supply), to first order

    k i = (1 + f) omega_IA - omega_d - dd
    dd = 2 D_pickoff e + 2 D_torquer a + (D_UI v + D_PI p) X + (D_US v + D_PS p) Z

and the reading omega_IA - k i is too large by dd - f omega_IA + k_E a k i; of a gyro that holds its table the reading
theta' + omega_E is (omega_d + dd + k i)/(1 + f).  A departure that stays is one source, one that grows over the record
another; steps and ripple are left to the noise model.  [GYRO-SUPPLY; Hu 1981, section 5.8-2, eq. 2-39, 2-40]

Not modelled: uncertainty of the sensitivities, squares of the departures (1e-3 of their effect at 1e-3).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.reduction.setup.sources import SUPPLIES, Effect, drifting
from gyrobench.reduction.setup.window_checks import ReductionError

#: what a gyro has, and its unit: the parameters of the part
TERMS = {n: "rad/s" for n in ("D_pickoff", "D_torquer", "D_UI", "D_US", "D_PI", "D_PS")} | {"k_E": "1"}
#: the same of a channel of a two-degree-of-freedom gyro, whose axis stands for I and z for S
CHANNEL = {"D_pickoff": "pickoff", "D_torquer": "torquer", "D_UI": "voltage", "D_US": "voltage_z", "D_PI": "phase",
           "D_PS": "phase_z"}  # fmt: skip
#: source -> the terms without one of which it does nothing
NEEDED = {
    "voltage": ("D_UI", "D_US"),
    "phase": ("D_PI", "D_PS"),
    "pickoff": ("D_pickoff",),
    "torquer": ("D_torquer", "k_E"),
}


@dataclass(frozen=True)
class Supplies:
    """terms: sensitivities of the gyro, SI.  sizes: standard uncertainties by the name of the option, SI.  origin: of
    the time of the drifts, s; None: the first window.
    """

    terms: Mapping[str, float] = field(default_factory=dict)
    sizes: Mapping[str, float] = field(default_factory=dict)
    origin: float | None = None

    @classmethod
    def of(cls, run: RunDocument) -> Supplies:
        """Return those of a run: the option ``supply_terms``, else the parameters of its gyro.  Raises ReductionError
        where the size of a supply is stated and not what it does.
        """
        given = read_terms(str(run.options.get("supply_terms", "")))
        channel = str(run.options.get("channel", ""))
        own = {n: f"D{channel}_{CHANNEL[n]}" if channel and n in CHANNEL else n for n in TERMS}
        known = given or {n: float(run.parameters.get(f"gyro.{name}", 0.0)) for n, name in own.items()}
        sizes = {s.option: float(run.options.get(s.option, 0.0)) for s in SUPPLIES.values()}
        for name, terms in NEEDED.items():
            size = SUPPLIES[name].option
            if sizes[size] and run.measured and not any(known.get(n) for n in terms):
                raise ReductionError(
                    f"{size} is stated, but not what it does to the gyro; give supply_terms = {terms[-1]}=..."
                )
        return cls(known, sizes, None if run.measured else 0.0)

    def effects(self, found: Findings, readings: Mapping[str, Array], x: Array, time: Array) -> list[Effect]:
        """Return the sources, two for each supply: its departure, and its drift.

        readings: error (n,) of the readings for one unit of "frequency", of a drift rate ("drift"), of k ("torque").
        x: (X, Y, Z) of the windows (n, 3) or of all (3,).  time: middles of the windows (n,), s.
        """
        start = float(time[0]) if self.origin is None else self.origin
        span = max(float(np.ptp(time)), 1.0)
        found_effects = []
        for name, error in self._errors(readings, np.broadcast_to(x, (time.size, 3))):
            source = SUPPLIES[name]
            found_effects.append(source.effect(self.sizes, found.error(error)))
            size = source.size(self.sizes) / span
            found_effects.append(drifting(source).effect(size, found.error(error * (time - start))))
        return found_effects

    def _errors(self, readings: Mapping[str, Array], x: Array) -> Iterator[tuple[str, Array]]:
        """Yield supplies that do something, with the error (n,) of the readings for one unit of departure."""
        t, drift = {n: self.terms.get(n, 0.0) for n in TERMS}, readings["drift"]
        yield "frequency", readings["frequency"]
        of_each = {
            "voltage": drift * (t["D_UI"] * x[:, 0] + t["D_US"] * x[:, 2]),
            "phase": drift * (t["D_PI"] * x[:, 0] + t["D_PS"] * x[:, 2]),
            "pickoff": drift * 2.0 * t["D_pickoff"],
            "torquer": drift * 2.0 * t["D_torquer"] + t["k_E"] * readings["torque"],
        }
        yield from ((n, e) for n, e in of_each.items() if any(t[term] for term in NEEDED[n]))


def rebalanced(rate: Array, torque: Array) -> dict[str, Array]:
    """Return the readings of :meth:`Supplies.effects` for omega_IA - k i; rate: omega_IA, torque: k i, (n,), rad/s."""
    return {"frequency": -rate, "drift": np.ones_like(torque), "torque": torque}


def read_terms(text: str) -> dict[str, float]:
    """Return the sensitivities of the option ``supply_terms``, SI.  Raises ReductionError."""
    found: dict[str, float] = {}
    for entry in (e.strip() for e in re.split(r"[,;]", text) if e.strip()):
        name, sign, value = (part.strip() for part in entry.partition("="))
        if not sign or name not in TERMS or name in found:
            twice = "stands twice" if name in found else f"is not one of {', '.join(TERMS)}"
            raise ReductionError(
                f"supply_terms: '{name}' {twice}; entries are D_pickoff=0.1deg/h, D_US=1deg/h/g, k_E=1"
            )
        try:
            found[name] = units.parse_quantity(value, TERMS[name], per_g0=True)
        except ValueError as error:
            raise ReductionError(f"supply_terms: {name}: {error}") from None
    return found


def misstated(text: str) -> str:
    """Return what is wrong with an option ``supply_terms``, "" for nothing."""
    try:
        read_terms(text)
    except ReductionError as error:
        return error.problems[0]
    return ""
