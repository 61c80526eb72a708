"""Record of the three-gimbal platform -> stiffness, margins, coupling, drift, and what the flight did to it."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops.gimbal_test import AXES, GimbalTest
from gyrobench.reduction.loops.gimbals import DEG, Flight, legs_table, lock_table, spans
from gyrobench.reduction.loops.loop_measures import Step, cross_axis, response
from gyrobench.reduction.loops.loop_toolkit import DPH, Account, Array, Gate, Table, drift, over_time
from gyrobench.reduction.loops.platform_measures import settling

COUPLING = 4.0  # Hz, where the coupling between the axes is shown
DRIFTS = ("gyro_b.drift_y", "gyro_a.drift_x", "gyro_a.drift_y")  # about x, y, z of the platform
RATES = tuple(f"platform.theta_dot[{k}]" for k in (1, 2, 3))


class Reduction(GimbalTest):
    """A flight of the base; load steps, sweeps of the loops, commanded rate and drift of two gyros' platform."""

    loaded = "platform.theta[{axis}]"
    left = "A pickoff of the gyros was saturated in the flight: the platform had left them; real ones reach a stop."

    def account(self) -> Account:
        self._coupling()
        for gate in self.found.of("command", shape="step"):
            if gate.amplitude:
                self._command(gate)
        if self.rest is not None:
            self._drift(self.rest)
        return Account(
            method="A flight of the base; load steps, sine sweeps of the loops, commanded rate, drift hold",
            sources=["PLATFORM-3GIMBAL-2DOF; GSP ch. 5, section 5.2.1 (no equations there)"],
            equation="[bold(a)_o space bold(a)_m space bold(a)_i] (dot(o), dot(m), dot(i))^T = "
            "T_1 bold(s) - bold(omega)_b, quad det = cos m, quad bold(u)_A = R(i) bold(u)",
            conventions=[
                "o, m, i: outer, middle and azimuth gimbal. Joint angles: pitch about x, roll about y, azimuth about "
                "z.",
                "Platform error: size of the integral of the platform's rate in the flight, less its drift at rest.",
                "Gimbal lock is told within 5° of m = 90°; the largest gimbal rate for a unit rate of the base is "
                "1/cos m.",
                "L: the loop opened at the input of a channel, the others closed; what comes back over what is put in.",
            ],
        )

    def turned(self, gate: Gate) -> str:
        return f"{AXES[gate.axis - 1]} gimbal"

    def stiff(self, step: Step, gate: Gate) -> None:
        """Measure stiffness, where the channel has no integral, and settling."""
        p = self.run.parameters
        gain = p.get("platform.rate_gain", 1.0)
        feedback = float(p["gyro_a.K_sg_x"]) * float(p["pitch.K"]) * gain if "pitch.K" in p else None
        if p.get("platform.drag") and feedback and not p.get("pitch.integral"):
            self.servo_stiffness(step, gate, feedback)
        settling(self.found, f" {AXES[gate.axis - 1]}", "to {band} after the load step", step, 5)

    def _coupling(self) -> None:
        points = {}
        for gate in (g for k in (1, 2, 3) for g in self.found.of("test", k, "sine") if math.isclose(g.f, COUPLING)):
            for j in (1, 2, 3):
                test, angle = gate[f"exciter.test[{gate.axis}]"], gate[f"platform.theta[{j}]"]
                points[(gate.axis, j)] = response(gate.t, test, angle, gate.f).value
        if points:
            caption = "Gimbal angles of the axes, in percent of the excited one's"
            self.found.tables.append(cross_axis(points, AXES, f"test signals at {COUPLING:g} Hz", caption))

    def _command(self, gate: Gate) -> None:
        """Measure a commanded rate less the drift that the hold showed."""
        angle = f"platform.attitude[{gate.axis}]"
        late = gate.t > gate.t[0] + 0.3 * (gate.t[-1] - gate.t[0])
        got = drift(gate.t[late], gate[angle][late])
        share, u = (got.rate - self.own_rate(angle)) / gate.amplitude, got.u / abs(gate.amplitude)
        known = not any(".k_" in name for name in self.run.changed)  # a torquer set by hand is as it is
        truth = 1.0 + float(self.run.options.get("torquer", 0.0)) if known else 1.0
        self.found.measure("rate gain", "rate of the platform over rate commanded", "1", share, u, truth=truth)

    def _drift(self, gate: Gate) -> None:
        found = self.found
        for axis, k, name in zip("xyz", (1, 2, 3), DRIFTS, strict=True):
            got = drift(gate.t, gate[f"platform.attitude[{k}]"])
            truth = float(np.mean(gate[name])) if name in gate.channels else None
            meaning = f"of the platform about {axis}"
            found.measure(f"drift {axis}", meaning, "°/h", got.rate, got.u, scale=DPH, truth=truth)
            if axis == "x":
                found.show_allan(got)
        scale = float(self.run.parameters.get("gyro_a.K_sg_y", 10.0))
        apart = drift(gate.t, (gate["gyro_b.u_x"] - gate["gyro_a.u_y"]) / scale)
        truth = float(np.mean(gate["gyro_a.drift_y"] - gate["gyro_b.drift_x"]))
        meaning = "the fourth axis against the third, both about z: difference of two drifts"
        found.measure("monitor", meaning, "°/h", apart.rate, apart.u, scale=DPH, truth=truth)

    def flown(self, flight: Flight) -> list[str]:
        found, most = self.found, float(flight.error.max())
        middle = flight[f"platform.theta[{2 if int(self.run.options.get('mount', 1)) else 1}]"]
        lock = flight["platform.lock"]
        found.tables += [_legs(flight, middle), lock_table(flight, {"lock": lock}, middle, "middle gimbal")]
        theta = {axis: flight[f"platform.theta[{k}]"] / DEG for k, axis in enumerate(AXES, 1)}
        found.responses += [
            over_time("platform error", flight.t, {"error": flight.error / DEG},
                      caption="Error of the platform in the flight: how far it has turned in space."),
            over_time("gimbal angles", flight.t, theta, y_name="joint angle", caption="Gimbal angles in the flight."),
        ]  # fmt: skip
        limits = self.servo_limits(flight, RATES)
        if not (locked := spans(lock)):
            kept = f"The platform kept its attitude to {plain(most / DEG, 3)}° in the flight; its gimbals did not lock."
            return [kept, *limits]
        a, b = locked[0]
        when, angle = plain(float(flight.t[a]), 4), plain(float(middle[a]) / DEG, 4)
        text = f"Gimbal lock from t = {when} s (leg “{flight.leg_at(a)}”) at {angle}° of the middle gimbal"
        if b < flight.t.size - 1:
            text += f", to t = {plain(flight.t[b], 4)} s"
        found.warn("flight.lock", f"{text}.", "error")
        before, after = plain(float(flight.error[: a + 1].max()) / DEG), plain(most / DEG, 5)
        dragged = f"the platform was dragged along by up to {after}°; until then it was kept to {before}°."
        return [f"{text}: {dragged}", *limits]


def _legs(flight: Flight, middle: Array) -> Table:
    def rings(s: slice) -> float:
        return max(float(np.abs(flight[name][s]).max()) for name in RATES) / DEG

    def steepest(s: slice) -> float:
        return 1.0 / max(1e-3, float(np.min(np.abs(np.cos(middle[s])))))

    caption = "1/cos m: gimbal rate for a unit rate of the base along the normal of the ring plane, at most 1000"
    return legs_table(flight, caption, {"gimbal rate / (°/s)": rings, "largest 1/cos m": steepest})
