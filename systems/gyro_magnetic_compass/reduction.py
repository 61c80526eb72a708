"""Record of the compass -> alignment, error at rest, complementary filter, error in the turn, in a disturbed field."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.record.record import Record
from gyrobench.reduction.loops.estimator_metrics import rms
from gyrobench.reduction.loops.toolkit import DEG, Account, Array, Gate, LoopTest, Table, trace, wrapped

from .field import FieldError, field_at

SHOWN = "heading shown"


class Reduction(LoopTest):
    """Heading of a slaved gyro against the true one: alignment, rest, sines, turn, disturbed field."""

    said = (
        "At rest the heading is off by {error at rest}; noise {heading noise}.",
        "The turn brings the magnetic heading off by up to {magnetic error in the turn}, the heading shown by "
        "{error in the turn}, and {error after the turn} afterwards.",
        "A disturbed field moves it by {error in the disturbed field}.",
    )
    ranked_by = "error after the turn"

    def __init__(self, record: Record) -> None:
        super().__init__(record)
        p, o = self.run.parameters, self.run.options
        self.declination = float(p.get("sensor.declination") or 0.0)
        self.wanted = float(p.get("slaving.declination") or 0.0) - self.declination
        self.k = float(p.get("slaving.k") or o["k"])
        self.limit = float(p["slaving.limit"]) if "slaving.limit" in p else math.inf
        self.latitude = float(o["latitude"])
        earth = float(p.get("motion.earth_rate") or 0.0) * math.sin(float(p.get("motion.latitude") or 0.0))
        #: known drift of the heading without slaving, rad/s
        self.drift = float(p.get("gyro.drift") or 0.0) + float(p.get("slaving.correction") or 0.0) - earth

    def measure(self) -> Account:
        found = self.found
        phases = {
            "alignment": self._alignment, "rest": self._rest, "turn": self._turn, "after the turn": self._after,
            "field": self._disturbed,
        }  # fmt: skip
        for gate in found.gates:
            if gate.label in phases:
                phases[gate.label](gate, self._error(gate))
        found.open_loop("slaving", "slaving.error", "exciter.test[1]")
        found.ratio(
            "magnetic path", "test", 1, "gyro.psi", "exciter.test[1]",
            caption="Errors of the magnetic heading pass the low-pass k/(s + k).",
        )  # fmt: skip
        found.ratio(
            "gyro path", "command", 1, "gyro.psi", "exciter.command[1]", unit="s",
            caption="A drift of the gyro passes 1/(s + k), its error in heading the high-pass s/(s + k).",
        )  # fmt: skip
        self._field()
        found.facts["site"] = {"latitude / °": self.latitude / DEG}
        return Account(
            method="Heading of a slaved gyro against the true one: alignment, rest, sines, turn, disturbed field",
            sources=["GYRO-MAGNETIC-COMPASS; GSP ch. 5, section 5.3.2, fig. 5-19 (no equations)"],
            equation='dot(psi) = omega_d + k (psi_"m" - psi), quad psi = k\\/(s + k) psi_"m" + 1\\/(s + k) omega_d',
            conventions=[
                "Headings are clockwise from north. Error: heading shown less the one wanted, magnetic or true.",
                "L is the open loop of the slaving, k/s: its crossover k/2 pi is the cut-off of both filters.",
            ],
        )

    def _error(self, gate: Gate) -> Array:
        """Return the heading shown less the heading that is wanted, rad: true, or magnetic without declination."""
        return wrapped(gate["gyro.psi"] + gate["motion.angle[3]"] - self.wanted)

    def _alignment(self, gate: Gate, error: Array) -> None:
        """Measure the time constant of the last part of the alignment, where the rate is no longer limited.

        e' = k (n - e) + w with white noises n of the magnetic heading and w of the gyro: what they leave in the heading
        decays as the step does, an autoregression of first order, e_j+1 = a e_j + b + white, a = exp(-k dt).
        """
        left = np.abs(error - float(np.mean(error[-error.size // 10 :])))
        # the noise of the magnetic heading must not meet the limit either
        first = int(np.argmax(left < 0.5 * self.limit / self.k))
        self._figure(
            "alignment", "Heading shown less the one before the step of the magnetic heading, in the alignment.", gate,
            error,
        )  # fmt: skip
        if error.size - first < 20:
            return
        dt, x, y = float(gate.t[1] - gate.t[0]), error[first:-1], error[first + 1 :]
        far = x - x.mean()
        a = float(far @ y) / float(far @ far)
        rest = y - y.mean() - a * far
        u_a = math.sqrt(float(rest @ rest) / (rest.size - 2) / float(far @ far))
        decays = 0.0 < a < 1.0
        none = "" if decays else "the heading does not decay to a rest in the alignment"
        time = -dt / math.log(a) if decays else 0.0
        closed = 1.0 / self.k if decays else None
        self.found.measure("time constant", "of the slaving, from the alignment", "s", time, time**2 * u_a / (a * dt),
                           closed=closed, no_value=none)  # fmt: skip

    def _rest(self, gate: Gate, error: Array) -> None:
        found, noise = self.found, rms(error - error.mean())
        # of a filter with the time constant 1/k the mean over T has the variance 2/(k T) of the heading's, itself lower
        share = 2.0 / (self.k * float(gate.t[-1] - gate.t[0]))
        u = noise.value * math.sqrt(share / max(1.0 - share, 0.1))
        found.measure("error at rest", f"of the {SHOWN}, mean", "°", float(error.mean()), u, scale=DEG,
                      closed=self.drift / self.k)  # fmt: skip
        found.measure("heading noise", f"of the {SHOWN} at rest, rms", "°", *noise.pair, scale=DEG)

    def _turn(self, gate: Gate, error: Array) -> None:
        magnetic = wrapped(gate["sensor.psi"] + gate["motion.angle[3]"] + self.declination)
        self._largest("magnetic error in the turn", "of the magnetic heading, largest", magnetic, slow=False)
        self._largest("error in the turn", f"of the {SHOWN}, largest", error)
        self._figure("turn", "Error of the heading shown in the turn.", gate, error)

    def _after(self, gate: Gate, error: Array) -> None:
        self._largest("error after the turn", f"of the {SHOWN}, largest afterwards", error)
        self._figure("after the turn", "Error of the heading shown after the turn.", gate, error)

    def _disturbed(self, gate: Gate, error: Array) -> None:
        rest = wrapped(gate.rest("gyro.psi") + gate.rest("motion.angle[3]") - self.wanted)
        before = float(rest[-max(1, rest.size // 50) :].mean())
        meaning = f"of the {SHOWN}, largest change"
        self._largest("error in the disturbed field", meaning, error - before, self._moved(gate))

    def _moved(self, gate: Gate) -> float | None:
        """Return by how much a step of the magnetic heading moves the heading; None where the limit acts for a part."""
        k, T, size, drift = self.k, gate.row.dwell, gate.amplitude, self.drift
        if k * abs(size) + abs(drift) <= self.limit:
            return abs(size) * (1.0 - math.exp(-k * T))
        moved = (self.limit + math.copysign(drift, size * drift)) * T
        return moved if k * (abs(size) - moved) > self.limit + abs(drift) else None

    def _largest(self, name: str, meaning: str, error: Array, closed: float | None = None, slow: bool = True) -> None:
        """Measure the largest error of a phase.  u: noise of a sample, and, ``slow``, that of the heading at rest."""
        worst = float(np.max(np.abs(error))) / DEG
        fast = float(np.std(np.diff(error, 2))) / math.sqrt(6.0) / DEG  # what a parabola through neighbours leaves
        wander = self.found.estimates.get("heading noise", 0.0) if slow else 0.0
        form = None if closed is None else closed / DEG
        self.found.measure(name, meaning, "°", worst, math.hypot(fast, wander), closed=form)

    def _field(self) -> None:
        """Show the field of day and site, where the run had one, with what its model leaves open."""
        o = self.run.options
        if not o.get("date"):
            return
        site = (self.latitude, float(o["longitude"]), float(o["height"]))
        try:
            field = field_at(str(o["date"]), *site)
        except FieldError:  # a record from elsewhere, reduced without the model
            return
        rows = [
            ["declination, clockwise / °", field.declination / DEG, field.u_declination / DEG],
            ["inclination, down / °", field.inclination / DEG, field.u_inclination / DEG],
            ["horizontal field / µT", field.horizontal * 1e6, field.u_horizontal * 1e6],
        ]
        caption = (
            f"{field.model} on {o['date']} at latitude {site[0] / DEG:.4f}°, longitude {site[1] / DEG:.4f}°, "
            f"{site[2]:g} m. u: of the model, one sigma, without local anomalies. The sensor of the run has the "
            "model's own field; a true heading on the site has the u of the declination beside the errors found."
        )
        table = Table("site.field", "Magnetic field of the site", caption, ["", "value", "u"], rows)
        self.found.tables.append(table)

    def _figure(self, name: str, caption: str, gate: Gate, error: Array) -> None:
        self.found.responses.append(trace(name, caption, gate.t - gate.t[0], error / DEG, "error", "°"))
