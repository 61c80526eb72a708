"""Record of the compass -> alignment, error at rest, complementary filter, error in the turn, in a disturbed field."""

from __future__ import annotations

import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.loops.estimator_metrics import rms
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import told
from gyrobench.result import LoopResult, Response, Specification, Table

from .field import FieldError, field_at

DEG = math.pi / 180.0


def wrapped(angle: Array) -> Array:
    """Return angles in -pi to pi."""
    return np.asarray(angle - 2.0 * np.pi * np.floor(angle / (2.0 * np.pi) + 0.5))


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """Result of one run.  Raises ReductionError for a record without a whole phase."""
    found = LoopFindings(record)
    p, o = record.run.parameters, record.run.options
    declination = float(p.get("sensor.declination") or 0.0)
    wanted = float(p.get("slaving.declination") or 0.0) - declination
    k = float(p.get("slaving.k") or o["k"])

    def error(gate: Gate, channel: str = "gyro.psi") -> Array:
        """Heading shown less the heading that is wanted, rad: true, or magnetic without declination."""
        return wrapped(gate[channel] + gate["motion.angle[3]"] - wanted)

    for gate in found.gates:
        if gate.label == "alignment":
            _alignment(found, gate, error(gate), k)
        elif gate.label == "rest":
            _rest(found, gate, error(gate), k)
        elif gate.label == "turn":
            magnetic = wrapped(gate["sensor.psi"] + gate["motion.angle[3]"] + declination)
            _largest(found, "magnetic error in the turn", "of the magnetic heading, largest", magnetic, None)
            _largest(found, "error in the turn", "of the heading shown, largest", error(gate), None)
            _figure(found, "turn", "Error of the heading shown in the turn.", gate, error(gate))
        elif gate.label == "after the turn":
            _largest(found, "error after the turn", "of the heading shown, largest afterwards", error(gate), None)
            _figure(found, "after the turn", "Error of the heading shown after the turn.", gate, error(gate))
        elif gate.label == "field":
            rest = wrapped(gate.rest("gyro.psi") + gate.rest("motion.angle[3]") - wanted)
            before = float(rest[-max(1, rest.size // 50) :].mean())
            _largest(found, "error in the disturbed field", "of the heading shown, largest change",
                     error(gate) - before, _moved(found, gate, k))  # fmt: skip
    found.open_loop("slaving", "slaving.error", "exciter.test[1]")
    found.ratio(
        "magnetic path", "test", 1, "gyro.psi", "exciter.test[1]",
        caption="Errors of the magnetic heading pass the low-pass k/(s + k).",
    )  # fmt: skip
    found.ratio(
        "gyro path", "command", 1, "gyro.psi", "exciter.command[1]", unit="s",
        caption="A drift of the gyro passes 1/(s + k), its error in heading the high-pass s/(s + k).",
    )  # fmt: skip
    _field(found)
    result = found.result(
        title="Gyro-magnetic compass",
        method="Heading of a slaved gyro against the true one: alignment, rest, sines, turn, disturbed field",
        sources=["GYRO-MAGNETIC-COMPASS; GSP ch. 5, section 5.3.2, fig. 5-19 (no equations)"],
        equation='dot(psi) = omega_d + k (psi_"m" - psi), quad psi = k\\/(s + k) psi_"m" + 1\\/(s + k) omega_d',
        conventions=[
            "Headings are clockwise from north. Error: heading shown less the one wanted, magnetic or true.",
            "L is the open loop of the slaving, k/s: its crossover k/2 pi is the cut-off of both filters.",
        ],
        ranked_by="error after the turn",
        specification=specification,
    )
    result.site = {"latitude / °": float(o["latitude"]) / DEG}
    result.summary = result.summary or told(
        found.coefficients,
        "At rest the heading is off by {error at rest}; noise {heading noise}.",
        "The turn brings the magnetic heading off by up to {magnetic error in the turn}, the heading shown by "
        "{error in the turn}, and {error after the turn} afterwards.",
        "A disturbed field moves it by {error in the disturbed field}.",
    )
    return result


def _alignment(found: LoopFindings, gate: Gate, error: Array, k: float) -> None:
    """Add the time constant of the last part of the alignment, where the rate is no longer limited.

    e' = k (n - e) + w with white noises n of the magnetic heading and w of the gyro: what they leave in the heading
    decays as the step does, an autoregression of first order, e_j+1 = a e_j + b + white, a = exp(-k dt).
    """
    p = found.record.run.parameters
    end = float(np.mean(error[-error.size // 10 :]))
    left = np.abs(error - end)
    slow = float(p["slaving.limit"]) / k if "slaving.limit" in p else math.inf
    first = int(np.argmax(left < 0.5 * slow))  # the noise of the magnetic heading must not meet the limit either
    _figure(
        found,
        "alignment",
        "Heading shown less the one before the step of the magnetic heading, in the alignment.",
        gate,
        error,
    )
    if error.size - first < 20:
        return
    dt, x, y = float(gate.t[1] - gate.t[0]), error[first:-1], error[first + 1 :]
    far = x - x.mean()
    a = float(far @ y) / float(far @ far)
    rest = y - y.mean() - a * far
    u_a = math.sqrt(float(rest @ rest) / (rest.size - 2) / float(far @ far))
    if not 0.0 < a < 1.0:
        found.measure("time constant", "of the slaving, from the alignment", "s", None,
                      no_value="the heading does not decay to a rest in the alignment")  # fmt: skip
        return
    time = -dt / math.log(a)
    found.measure("time constant", "of the slaving, from the alignment", "s", time, time**2 * u_a / (a * dt),
                  closed=1.0 / k)  # fmt: skip


def _field(found: LoopFindings) -> None:
    """Add the table of the field of day and site, where the run had one, with what its model leaves open."""
    o = found.record.run.options
    if not o.get("date"):
        return
    site = (float(o["latitude"]), float(o["longitude"]), float(o["height"]))
    try:
        field = field_at(str(o["date"]), *site)
    except FieldError:  # a record from elsewhere, reduced without the model
        return
    rows = [
        ["declination, clockwise / °", field.declination / DEG, field.u_declination / DEG],
        ["inclination, down / °", field.inclination / DEG, field.u_inclination / DEG],
        ["horizontal field / µT", field.horizontal * 1e6, field.u_horizontal * 1e6],
    ]
    found.tables.append(
        Table(
            "magnetic_field_of_the_site",
            "Magnetic field of the site",
            f"{field.model} on {o['date']} at latitude {site[0] / DEG:.4f}°, longitude {site[1] / DEG:.4f}°, "
            f"{site[2]:g} m. u: of the model, one sigma, without local anomalies. The sensor of the run "
            "has the model's own field; a true heading on the site has the u of the declination beside the errors found.",
            ["", "value", "u"],
            rows,
        )
    )


def _drift(found: LoopFindings) -> float:
    """Return the known drift of the heading without slaving, rad/s."""
    p = found.record.run.parameters
    earth = float(p.get("motion.earth_rate") or 0.0) * math.sin(float(p.get("motion.latitude") or 0.0))
    return float(p.get("gyro.drift") or 0.0) + float(p.get("slaving.correction") or 0.0) - earth


def _moved(found: LoopFindings, gate: Gate, k: float) -> float | None:
    """Return by how much a step of the magnetic heading moves the heading; None where the limit acts for a part."""
    p, T = found.record.run.parameters, gate.row.dwell
    limit = float(p["slaving.limit"]) if "slaving.limit" in p else math.inf
    if k * abs(gate.amplitude) + abs(_drift(found)) <= limit:
        return abs(gate.amplitude) * (1.0 - math.exp(-k * T))
    moved = (limit + math.copysign(_drift(found), gate.amplitude * _drift(found))) * T
    return moved if k * (abs(gate.amplitude) - moved) > limit + abs(_drift(found)) else None


def _rest(found: LoopFindings, gate: Gate, error: Array, k: float) -> None:
    noise = rms(error - error.mean())
    # of a filter with the time constant 1/k the mean over T has the variance 2/(k T) of the heading's, itself lowered
    share = 2.0 / (k * float(gate.t[-1] - gate.t[0]))
    u = noise.value * math.sqrt(share / max(1.0 - share, 0.1))
    found.measure("error at rest", "of the heading shown, mean", "°", float(error.mean()) / DEG, u / DEG,
                  closed=_drift(found) / k / DEG)  # fmt: skip
    found.measure("heading noise", "of the heading shown at rest, rms", "°", noise.value / DEG, noise.u / DEG)


def _largest(found: LoopFindings, name: str, meaning: str, error: Array, closed: float | None) -> None:
    """Add the largest error of a phase.  u: noise of a sample, and the slow noise of the heading as it is at rest."""
    worst = error[int(np.argmax(np.abs(error)))]
    fast = float(np.std(np.diff(error, 2))) / math.sqrt(6.0) / DEG  # what a parabola through neighbours leaves
    slow = 0.0 if name.startswith("magnetic") else found.estimates.get("heading noise", 0.0)
    found.measure(name, meaning, "°", abs(float(worst)) / DEG, math.hypot(fast, slow),
                  closed=None if closed is None else closed / DEG)  # fmt: skip


def _figure(found: LoopFindings, name: str, caption: str, gate: Gate, error: Array) -> None:
    pick = np.unique(np.linspace(0, error.size - 1, min(600, error.size)).astype(int))
    t = gate.t - gate.t[0]
    found.responses.append(
        Response(name, "step", caption, t[pick].tolist(), "time", "s", (error[pick] / DEG).tolist(), "error", "°")
    )
