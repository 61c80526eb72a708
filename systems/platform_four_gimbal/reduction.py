"""Record of the four-gimbal platform -> loops, drift, and where the flight left its inner element and its rings."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.gimbal_test import GimbalTest
from gyrobench.reduction.loops.gimbals import DEG, Flight, legs_table, lock_table, spans
from gyrobench.reduction.loops.loop_measures import Step
from gyrobench.reduction.loops.loop_toolkit import ARCSEC, DPH, Account, Array, Gate, drift, over_time

STEEP = math.sin(5.0 * DEG)  # |cos(pitch)| below which the fourth gimbal has no authority
KEPT = 0.01  # deg: up to this the inner element counts as kept
PITCH, INNER, AZIMUTH, OUTER = "platform.theta[1]", "platform.theta[2]", "platform.theta[3]", "platform.theta_4"
RINGS = {"g4 outer roll": OUTER, "g3 pitch": PITCH, "g2 inner roll": INNER, "g1 azimuth": AZIMUTH}
RATES = (*(f"platform.theta_dot[{k}]" for k in (1, 2, 3)), "platform.theta_4_dot")


class Reduction(GimbalTest):
    """Load steps, sweeps of the loops, drift hold, and a flight of the base."""

    loaded = "platform.attitude[{axis}]"
    left = "A pickoff of the gyros was saturated in the flight: the platform has left them."

    def account(self) -> Account:
        if self.rest is not None:
            for k, axis in enumerate("xyz", 1):
                got = drift(self.rest.t, self.rest[f"platform.attitude[{k}]"])
                meaning = f"of the platform about {axis}, at rest"
                self.found.measure(f"drift {axis}", meaning, "°/h", got.rate, got.u, scale=DPH)
        return Account(
            method="Load steps and sine sweeps of the loops, drift hold, and a flight of the base",
            sources=["PLATFORM-4GIMBAL; GSP ch. 5, section 5.2.2 (no equations there)"],
            equation='dot(g)_4 = k G(g_3) g_2, quad G = sec g_3 \\, "sign" cos g_3 \\, 1, '
            "quad dot(g)_2 = -dot(g)_4 cos g_3",
            conventions=[
                "Gimbals from outside: g4 outer roll about y, g3 pitch about x, g2 inner roll about y, g1 azimuth "
                "about z.",
                "Platform error: size of the integral of the platform's rate in the flight, less its drift at rest.",
                "The servo of the fourth gimbal nulls g2; within 5° of pitch 90° it has no authority (told as lock).",
            ],
        )

    def turned(self, gate: Gate) -> str:
        return f"platform about {'xyz'[gate.axis - 1]}"

    def stiff(self, step: Step, gate: Gate) -> None:
        """Measure the stiffness; at rest gimbals and platform have the same axes."""
        self.servo_stiffness(step, gate, self.run.options.get("feedback"))

    def flown(self, flight: Flight) -> list[str]:
        found, travel = self.found, float(np.ptp(flight[OUTER]))
        g2 = float(np.abs(flight[INNER]).max())
        meaning = "largest less smallest angle of the fourth gimbal"
        found.measure("ring 4 travel", meaning, "°", travel, self._moved(flight, RATES[3]), scale=DEG)
        found.measure("g2 max", "largest inner roll", "°", g2, self._moved(flight, RATES[1]), scale=DEG)
        # locked: lock is told and the servo, which sees an inner roll, stands
        stands = (flight["platform.theta_4_dot"] == 0.0) & (flight[INNER] != 0.0)
        held = (flight["platform.lock"] > 0.5) & stands
        steep = (np.abs(np.cos(flight[PITCH])) < STEEP) & ~held
        kinds = {"fourth gimbal locked": np.asarray(held, float), "pitch within 5° of the vertical": steep}
        columns = {
            "ring 4 travel / °": lambda s: float(np.ptp(flight[OUTER][s])) / DEG,
            "largest g2 / °": lambda s: float(np.abs(flight[INNER][s]).max()) / DEG,
        }
        legs = legs_table(flight, "What the rings did, and the error of the inner element", columns)
        found.tables += [lock_table(flight, kinds, flight[PITCH], "pitch gimbal"), legs]
        found.responses += [
            over_time("platform error", flight.t, {"error": flight.error / ARCSEC}, unit="″",
                      caption="Error of the inner element in the flight."),
            over_time("ring angles", flight.t, {label: flight[name] / DEG for label, name in RINGS.items()},
                      y_name="ring angle", caption="Angles of the four gimbals in the flight."),
            over_time("inner roll", flight.t, {"g2": flight[INNER] / DEG}, y_name="inner roll g2",
                      caption="The angle that the servo of the fourth gimbal keeps at zero."),
        ]  # fmt: skip
        fast = max(float(np.abs(flight[name]).max()) for name in RATES)
        top = self.run.parameters.get("platform.rate_max")
        if top and fast >= float(top) * (1.0 - 1e-9):
            text = f"A gimbal was at its largest rate, {plain(float(top) / DEG, 4)}°/s, in the flight."
            found.warn("gimbal.rate_max", text)
        return [*_said(flight, travel / DEG, steep), *self.servo_limits(flight, RATES)]

    def _moved(self, flight: Flight, rate: str) -> float:
        """Return the standard uncertainty of a ring's angle, rad: what it moves in a step at its fastest,
        rectangular.
        """
        return float(np.abs(flight[rate]).max()) * self.run.step / math.sqrt(12.0)


def _said(flight: Flight, travel: float, steep: Array) -> list[str]:
    error = flight.error / DEG
    worst = int(np.argmax(error))
    if error[worst] <= KEPT:
        first = f"The inner element was kept within {plain(error[worst])}° all through the flight."
    else:
        a, b = spans(error > KEPT)[0]
        again = f"; from {plain(flight.t[b], 4)} s on it is below again." if b < error.size - 1 else "."
        first = (
            f"The inner element was not kept: from t = {plain(flight.t[a], 4)} s (leg “{flight.leg_at(a)}”, pitch "
            f"gimbal {plain(flight[PITCH][a] / DEG, 4)}°) its error is above {KEPT:g}°, at most "
            f"{plain(error[worst], 3)}° at t = {plain(flight.t[worst], 4)} s{again}"
        )
    if not np.any(steep):
        return [first]
    if travel > 150.0:
        return [first, f"The fourth gimbal turned over: it travelled {plain(travel, 4)}°."]
    return [first, f"The fourth gimbal travelled {plain(travel, 4)}° in a flight that passed the vertical."]
