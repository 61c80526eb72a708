"""Record of a motor run on a free table -> constants of motor and axis, by the known torque that is hung on it.

Over two pieces of equal length T of a phase the angle x obeys, exactly,

    y = x(T) - 2 x(0) + x(-T) = 1/J <M + M_h - D w - M_C sgn w>        <f> = integral of (T - |t|) f(t)

so that no rate has to be differentiated: y is linear in K_t/J (or K/J), 1/J, D/J and M_C/J, with the readings of the
current (or of the voltage) and of the angle in <>.  White random torque correlates neighbouring y by 1/4; its density
follows from the residuals, the rounding of the counts is known.  Voltages are fitted window by window, the winding and
the lag from steps of torque.  [MOTOR-TEST; own design]

Not modelled: errors of the regressors (noise of a mean current is a ten-thousandth of it), cogging and torque ripple,
which average out over the ways of the runs where these are whole periods.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import integrate, optimize, stats

from gyrobench.record.record import Record
from gyrobench.record.run_document import LinearModels
from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.loop_summary import told
from gyrobench.reduction.window_checks import ReductionError
from gyrobench.result import LoopResult, Specification

Array = NDArray[np.float64]
ANGLE, VOLTAGE, CURRENT = "reader.angle_read", "voltmeter.reading", "ammeter.reading"
PIECE = 0.05  # s, length T
SLOW = 0.05  # rad/s: a window with a slower end may have been at rest, where friction is what the load is
SEEN = 10.0  # standard errors: a current that is read at all
WOUND = "J w' = K_t i + M_h - D w - M_C \"sgn\"(w), quad U = R i + K_e w + L i'"
SQUARE_LAW = 'J w\' = K V abs(V) + M_h - D w - M_C "sgn"(w), quad V = U - K_e w'
QUANTUM = 2.0 * math.pi / 7.2e6
NO_LIMIT = "the voltage does not come to its limit in the steps: take a larger torque"
EDGE = 0.9  # of the largest voltage: at its limit; of the change: the voltage has begun to move


@dataclass(frozen=True)
class Window:
    """Two pieces of a phase, from -T to T: samples in the middle of time, SI.

    phase: number of the phase, neighbours in it overlap by T.  motor, hung: demanded and known torque.  rate: at each
    sample, linear in time.  weight: (T - |t|) times the sampling interval, halved at the ends.
    """

    phase: int
    y: float
    rate: Array
    turned: float  # <w>, from the angles
    voltage: Array
    current: Array
    weight: Array
    motor: float
    hung: float

    @property
    def sense(self) -> float:
        return float(np.sign(self.rate[0]))

    def integral(self, f: Array | float) -> float:
        return float(np.sum(self.weight * f))


@dataclass(frozen=True)
class Solution:
    """Values with their covariance and degrees of freedom."""

    value: Array
    covariance: Array
    dof: int
    residual: Array
    torque_density: float = 0.0

    def of(self, f: Callable[[Array], float]) -> tuple[float, float]:
        """Return a function of the values and its u: half of the 95 % interval over 1.96."""
        step = 1e-5 * np.sqrt(np.diag(self.covariance))
        slopes = np.array([(f(self.value + d) - f(self.value - d)) / 2.0 for d in np.diag(step)]) / step
        k = float(stats.t.ppf(0.975, self.dof)) / NORMAL
        return float(f(self.value)), k * math.sqrt(float(slopes @ self.covariance @ slopes))


def from_record(record: Record, specification: Specification | None = None) -> LoopResult:
    """The Result.  Raises ReductionError for a record in which the table did not turn as planned."""
    record.run.linear = record.run.linear or LinearModels()  # there is no loop
    found = LoopFindings(record)
    runs = [g for g in found.gates if not g.label.startswith("step")]
    steps = [g for g in found.gates if g.label.startswith("step")]
    windows = [w for g in runs for w in cut(g)]
    driven = [w for w in windows if w.motor]
    if len({w.hung for w in windows}) < 3 or len(driven) < 4:
        raise ReductionError(
            "the table must turn under the motor and under the hung torque to either side; there are "
            f"{len(windows)} windows of {2.0 * PIECE:g} s in which it turns faster than {SLOW:g} rad/s"
        )
    means = np.array([float(np.mean(w.current)) for w in driven])
    errors = np.array([float(np.std(w.current)) / math.sqrt(w.current.size) for w in driven])
    wound = bool(np.median(np.abs(means)) > SEEN * np.median(errors))
    o = record.run.options
    u_M, u_U, u_I = (float(o.get(f"u_{n}", 0.0)) for n in ("hung", "voltage", "current"))
    p = record.run.parameters

    def add(name: str, meaning: str, unit: str, value: tuple[float, float], relative: float, truth: str,
            scale: float = 1.0) -> None:  # fmt: skip
        known = p.get(truth)
        u = math.hypot(value[1], relative * value[0])
        found.measure(name, meaning, unit, value[0] / scale, u / scale, limits=specification,
                      truth=None if known is None else float(known) / scale)  # fmt: skip

    quantum = float(p.get("reader.quantum", QUANTUM))
    if wound:
        mechanics = solve(windows, quantum, lambda w: w.integral(w.current), ())
        electric = _voltages(windows)
        R, K_e = float(electric.value[0]), float(electric.value[1])
        add("K_t", "torque constant", "N·m/A", mechanics.of(lambda v: v[0] / v[1]), math.hypot(u_M, u_I),
            "drive.motor_K_t")  # fmt: skip
        add("K_e", "back EMF constant", "V·s/rad", electric.of(lambda v: v[1]), u_U, "drive.motor_K_e")
        add("R", "resistance of the winding", "Ω", electric.of(lambda v: v[0]), math.hypot(u_U, u_I), "drive.motor_R")
        rises = [x for g in steps if (x := _inductance(g, R, K_e)) is not None]
        if len(rises) > 3:
            add("L", "inductance of the winding", "mH", _mean(rises), math.hypot(u_U, u_I), "drive.motor_L", 1e-3)
        else:
            found.measure("L", "inductance of the winding", "mH", None,
                          no_value=NO_LIMIT)  # fmt: skip
        first = 2
    else:
        start = float(np.median([abs(w.voltage).max() for w in driven]))
        mechanics = solve(windows, quantum, _square_law, (0.0, start))
        add("K", "torque over the square of the voltage", "N·m/kV²", mechanics.of(lambda v: v[0] / v[2]),
            math.hypot(u_M, 2.0 * u_U), "drive.motor_K", 1e-6)  # fmt: skip
        add("K_e", "back EMF constant", "V·s/rad", mechanics.of(lambda v: v[1]), u_U, "drive.motor_K_e")
        shaper = _shaper(windows)
        add("K_s", "demanded torque over the square of the shaper's voltage", "N·m/kV²",
            shaper.of(lambda v: v[0] ** -2), 2.0 * u_U, "drive.motor_K", 1e-6)  # fmt: skip
        add("U_0", "voltage of the shaper at the demand 0: mistrim", "V", shaper.of(lambda v: v[1]), u_U,
            "drive.motor_offset")  # fmt: skip
        add(
            "lag", "time constant of the amplifier", "ms", _mean([_lag(g) for g in steps]), 0.0, "drive.motor_lag", 1e-3
        )
        first = 3
    one = first - 1  # 1/J
    add("J", "inertia of table and load", "kg·m²", mechanics.of(lambda v: 1.0 / v[one]), u_M, "body.axis_J")
    add("D", "viscous drag", "N·m·s/rad", mechanics.of(lambda v: v[first] / v[one]), u_M, "body.axis_viscous")
    add("M_C", "Coulomb friction", "N·m", mechanics.of(lambda v: v[first + 1] / v[one]), u_M, "body.axis_friction")
    add_table(found, mechanics, windows)
    silent = [f"u_{n}" for n in ("hung", "voltage", "current")[: 2 + wound] if not float(o.get(f"u_{n}", 0.0))]
    if silent:
        names = ", ".join(silent)
        found.warnings.append(f"Not stated: {names}. Errors of these standards are not in u. Set {names}.")
    result = found.result(
        title="Motor of a turntable",
        method="Runs of a free table by the motor and by a known torque, coasting, steps of torque",
        sources=["MOTOR-TEST, MOTOR-DC, MOTOR-SQUARELAW; Hu 1981, eq. 5-1 with ET1, 5-7"],
        equation=WOUND if wound else SQUARE_LAW,
        conventions=[
            "Torques turn the table to larger angles. The known torque M_h is the standard of all torques and of J.",
            "U_0 and R are as the meters read them: a zero of the voltmeter is in U_0.",
        ],
        specification=specification,
    )  # fmt: skip
    result.summary = told(
        found.coefficients,
        "Torque constant {K_t}, back EMF constant {K_e}." if wound else "Torque over the square of the voltage {K}.",
        "Winding: {R}, {L}." if wound else "The root shaper is off by {U_0} at null.",
        "The axis has an inertia of {J} and Coulomb friction of {M_C}.",
    )
    return result


def add_table(found: LoopFindings, mechanics: Solution, windows: Sequence[Window]) -> None:
    """Add how many windows there are of each kind, and what they leave."""
    kinds = {"motor": [w.motor != 0.0 for w in windows], "hung torque": [w.hung != 0.0 for w in windows]}
    kinds["coasting"] = [not a and not b for a, b in zip(*kinds.values(), strict=True)]
    rows: list[list[Any]] = []
    for name, of in kinds.items():
        r = mechanics.residual[np.array(of)] / PIECE**2
        rows.append([name, int(r.size), float(np.sqrt(np.mean(r**2))) if r.size else None])
    caption = (
        f"Windows of {2.0 * PIECE:g} s. Random torque on the axis: {mechanics.torque_density:.2g} N·m/√Hz, from the "
        "residuals."
    )
    columns = ["phase", "windows", "rms of the residual / (rad/s²)"]
    found.tables.append({"title": "Windows", "caption": caption, "columns": columns, "rows": rows})


def cut(gate: Gate) -> list[Window]:
    """Return the windows of a phase in which the table turns one way, faster than SLOW."""
    dt = float(gate.t[1] - gate.t[0])
    n = round(PIECE / dt)
    x = gate[ANGLE]
    found = []
    offset = np.arange(-n, n + 1)
    weight = (n - np.abs(offset)) * dt * dt
    for middle in range(n, x.size - n, n):
        part = slice(middle - n, middle + n + 1)
        before, after = x[middle] - x[middle - n], x[middle + n] - x[middle]
        ends = (1.5 * before - 0.5 * after) / PIECE, (1.5 * after - 0.5 * before) / PIECE
        if ends[0] * ends[1] <= 0.0 or min(map(abs, ends)) < SLOW:
            continue
        halves = (np.trapezoid(x[s], dx=dt) for s in (slice(middle, middle + n + 1), slice(middle - n, middle + 1)))
        right, left = (float(v) for v in halves)
        torque = [gate.amplitude if gate.kind == "torque" and gate.axis == k else 0.0 for k in (1, 2)]
        found.append(
            Window(gate.row.phase, float(after - before), np.linspace(*ends, offset.size), right - left,
                   gate[VOLTAGE][part], gate[CURRENT][part], weight, *torque)
        )  # fmt: skip
    return found


@dataclass(frozen=True)
class Block:
    """The windows of one phase: what random torque (density 1, J = 1) and the rounding of counts make of their y."""

    rows: slice
    white: Array
    rounding: Array

    def inverse(self, density: float) -> Array:
        return np.asarray(np.linalg.inv(density * self.white + self.rounding))


def blocks(windows: Sequence[Window], quantum: float) -> list[Block]:
    """Return the windows phase by phase; between phases there is no correlation."""
    phase = np.array([w.phase for w in windows])
    starts = [0, *(np.flatnonzero(np.diff(phase)) + 1).tolist(), phase.size]
    found = []
    for a, b in pairwise(starts):
        bands = [np.eye(b - a, k=d) + np.eye(b - a, k=-d) for d in (1, 2)]
        white = PIECE**3 / 6.0 * (4.0 * np.eye(b - a) + bands[0])
        rounding = quantum**2 / 12.0 * (6.0 * np.eye(b - a) - 4.0 * bands[0] + bands[1])
        found.append(Block(slice(a, b), white, rounding))
    return found


def _square_law(w: Window, K_e: float) -> tuple[float, float]:
    """Return <V |V|> and its derivative by K_e."""
    V = w.voltage - K_e * w.rate
    return w.integral(V * np.abs(V)), -2.0 * w.integral(np.abs(V) * w.rate)


def solve(windows: Sequence[Window], quantum: float, torque: Callable[..., Any], search: Sequence[float]) -> Solution:
    """Return K/J, (K_e,) 1/J, D/J, M_C/J by generalized least squares.

    torque: the regressor of the motor; with a search it depends on K_e, from which the first value begins, and gives
    its derivative too.
    """
    y = np.array([w.y for w in windows])
    others = np.array([[w.hung * PIECE**2, -w.turned, -w.sense * PIECE**2] for w in windows])
    parts = blocks(windows, quantum)
    K_e = search[0] if search else 0.0
    density, value, residual, covariance = 1e-6, np.zeros(0), y, np.zeros((0, 0))
    for _ in range(30):
        if search:
            of, slope = np.array([torque(w, K_e) for w in windows]).T
            size = (
                value[0] if value.size else float(np.linalg.lstsq(np.column_stack([of, others]), y, rcond=None)[0][0])
            )
            X = np.column_stack([of, size * slope, others])
            target = y + size * slope * K_e
        else:
            X, target = np.column_stack([[torque(w) for w in windows], others]), y
        weighted = np.vstack([p.inverse(density) @ X[p.rows] for p in parts])
        covariance = np.linalg.inv(X.T @ weighted)
        last, value = value, covariance @ weighted.T @ target
        residual = target - X @ value
        dof = y.size - value.size
        density = _density(residual, parts, dof)
        if search:
            K_e = float(value[1])
        if last.size and np.all(np.abs(value - last) < 1e-4 * np.sqrt(np.diag(covariance))):
            break
    J = 1.0 / float(value[2 if search else 1])
    return Solution(value, covariance, dof, residual, J * math.sqrt(density))


def _density(residual: Array, parts: Sequence[Block], dof: int) -> float:
    """Return the density of the random torque (over J2) for which the residuals are as large as they should be."""

    def excess(logarithm: float) -> float:
        of = ((residual[p.rows], p.inverse(math.exp(logarithm))) for p in parts)
        return sum(float(r @ W @ r) for r, W in of) / dof - 1.0

    low, high = -60.0, 10.0
    return math.exp(low) if excess(low) < 0.0 else math.exp(float(optimize.brentq(excess, low, high, xtol=1e-3)))


def _linear(X: Array, y: Array) -> Solution:
    covariance = np.linalg.inv(X.T @ X)
    value = covariance @ X.T @ y
    residual = y - X @ value
    dof = y.size - value.size
    return Solution(value, covariance * float(residual @ residual) / dof, dof, residual)


def _voltages(windows: Sequence[Window]) -> Solution:
    """Return R, K_e and the zero of the voltmeter: U = R i + K_e w + zero, means of every other window, L i' = 0."""
    rows = [(float(np.mean(w.current)), float(np.mean(w.rate)), float(np.mean(w.voltage))) for w in _apart(windows)]
    i, w, U = np.array(rows).T
    return _linear(np.column_stack([i, w, np.ones(i.size)]), U)


def _shaper(windows: Sequence[Window]) -> Solution:
    """Return 1/sqrt(K) and the offset: U = sgn(d) sqrt(|d| / K) + offset."""
    rows = [(math.copysign(math.sqrt(abs(w.motor)), w.motor), float(np.mean(w.voltage))) for w in _apart(windows)]
    d, U = np.array(rows).T
    return _linear(np.column_stack([d, np.ones(d.size)]), U)


def _apart(windows: Sequence[Window]) -> list[Window]:
    """Return windows that do not overlap."""
    found: list[Window] = []
    skipped = False
    for w in windows:
        if found and not skipped and found[-1].phase == w.phase:
            skipped = True
            continue
        found.append(w)
        skipped = False
    return found


def _inductance(gate: Gate, R: float, K_e: float) -> float | None:
    """Return L from the rise of the current while the voltage is at its limit; None where it is not long enough."""
    U, i, x, dt = gate[VOLTAGE], gate[CURRENT], gate[ANGLE], float(gate.t[1] - gate.t[0])
    sign = math.copysign(1.0, gate.amplitude)
    limited = sign * U > EDGE * float(np.max(np.abs(U)))
    first = int(np.argmax(limited))
    count = int(np.argmin(limited[first:])) if not limited[first:].all() else 0
    part = slice(first + 1, first + count - 1)
    if count < 8:
        return None
    induced = U[part] - R * i[part]
    turned = x[part][-1] - x[part][0]
    way = float(integrate.simpson(induced, dx=dt)) - K_e * turned  # the current bends within a sampling interval
    change = float(i[part][-1] - i[part][0])
    return way / change if abs(change) > 0.0 else None


def _lag(gate: Gate) -> float:
    """Return the time constant of the voltage after a step, from the sum of what is lacking: D_m / (1 - e^(-h/lag))."""
    U, dt = gate[VOLTAGE], float(gate.t[1] - gate.t[0])
    lacking = U - float(np.mean(U[U.size // 2 :]))
    moving = np.abs(lacking) < EDGE * float(np.max(np.abs(lacking)))
    m = int(np.argmax(moving))
    whole = float(np.sum(lacking[m : U.size // 2]))
    return -dt / math.log(1.0 - float(lacking[m]) / whole)


def _mean(values: Sequence[float]) -> tuple[float, float]:
    """Return a mean and its u: half of the 95 % interval over 1.96."""
    x = np.array(values)
    k = float(stats.t.ppf(0.975, x.size - 1)) / NORMAL
    return float(np.mean(x)), k * float(np.std(x, ddof=1)) / math.sqrt(x.size)
