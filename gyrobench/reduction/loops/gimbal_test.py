"""The skeleton of a test of a gimballed platform of rate servos: a flight of the base, load steps, loops, rest.

class Reduction(GimbalTest):
    loaded = "platform.attitude[{axis}]", "platform about {axis}"
    def flown(self, flight): ...          # what the flight did, as sentences
    def stiff(self, step, gate): ...      # what a load step shows
    def account(self): ...
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

import numpy as np

from gyrobench.reduction.estimation.fit_result import Account
from gyrobench.reduction.estimation.sentences import told
from gyrobench.reduction.loops.gimbals import DEG, Flight, rate_servo_limits
from gyrobench.reduction.loops.loop_drift import drift
from gyrobench.reduction.loops.loop_limits import bandwidth
from gyrobench.reduction.loops.loop_measures import Gate, Step
from gyrobench.reduction.loops.loop_reduction import LoopReduction
from gyrobench.reduction.loops.loop_summary import margins
from gyrobench.reduction.loops.platform_measures import stiffness
from gyrobench.units import ARCSEC

AXES = ("pitch", "roll", "azimuth")
DRIFTS = "At rest it drifts by {drift x}, {drift y} and {drift z} about x, y and z."


class GimbalTest(LoopReduction):
    """One reduction of one record; phases without excitation beside the drift hold are legs of the flight."""

    ranked_by = "platform error"
    loaded: ClassVar[str]  # channel of what a load step turns, with {axis} for 1, 2, 3
    left: ClassVar[str]  # warning of a flight in which a pickoff was saturated

    def flown(self, flight: Flight) -> list[str]:
        """Measure what the flight did; return it as sentences."""
        raise NotImplementedError

    def stiff(self, step: Step, gate: Gate) -> None:
        """Measure what a load step shows."""
        raise NotImplementedError

    def turned(self, gate: Gate) -> str:
        """Return what the figure calls what a load step turns."""
        raise NotImplementedError

    def account(self) -> Account:
        """Measure what the test has beside flight, loads and loops; return what it says of itself."""
        raise NotImplementedError

    def measure(self) -> Account:
        found, self.rest = self.found, self.found.at_rest
        legs = [g for g in found.of("hold") if g is not self.rest]
        self.flown_said = self._flight(Flight(legs, "platform.attitude", self.rest)) if legs else []
        for gate in found.of("torque", shape="step"):
            output = self.loaded.format(axis=gate.axis)
            rate, y_name = self.own_rate(output), self.turned(gate)
            step = found.step(gate, output, scale=ARCSEC, unit="″", y_name=y_name, drift=rate, quiet=self.rest)
            self.stiff(step, gate)
        for k, axis in enumerate(AXES, 1):
            found.open_loop(axis, f"{axis}.e", f"exciter.test[{k}]", k)
        return self.account()

    def summary(self) -> list[str]:
        found, lag = self.found, {"servo": float(self.run.parameters.get("platform.lag", 0.0))}
        lags = bandwidth(found, {axis: lag for axis in AXES})
        return [*self.flown_said, *margins(found, *AXES), *lags, *told(found.coefficients, DRIFTS)]

    def own_rate(self, output: str) -> float:
        """Return the rate of an angle at rest, rad/s; 0 without a drift hold."""
        return drift(self.rest.t, self.rest[output]).rate if self.rest is not None else 0.0

    def servo_stiffness(self, step: Step, gate: Gate, feedback: float | None) -> float | None:
        """Measure the stiffness of a servo, which yields by M / (drag feedback), drag being the platform's; return its
        closed form.
        """
        drag = self.run.parameters.get("platform.drag")
        closed = drag * feedback if drag and feedback else None
        stiffness(self.found, f"S {AXES[gate.axis - 1]}", "stiffness, torque over angle that it leaves",
                  gate.amplitude, step, closed)  # fmt: skip
        return closed

    def _flight(self, flight: Flight) -> list[str]:
        found, error, u = self.found, flight.error, flight.u(self.run.step)
        meaning = "largest in the flight, drift taken off"
        found.measure("platform error", meaning, "°", float(error.max()), u, scale=DEG)
        found.measure("error at the end", "of the flight", "°", float(error[-1]), flight.noise, scale=DEG)
        said = self.flown(flight)
        saturated = any(np.any(flight[f"{g}.saturated"] > 0.5) for g in ("gyro_a", "gyro_b"))
        found.warn("gyro.saturated", self.left if saturated else "")
        return said

    def servo_limits(self, flight: Flight, rates: Sequence[str]) -> list[str]:
        """Return what lets the motion of the base through, as a sentence."""
        return rate_servo_limits(flight, rates, self.run.parameters.get("platform.rate_max"))
