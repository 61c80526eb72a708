"""Record of a motor run on a free table -> constants of motor and axis, by the known torque that is hung on it.

Over two pieces of equal length T of a phase the angle x obeys, exactly,

    y = x(T) - 2 x(0) + x(-T) = 1/J <M + M_h - D w - M_C sgn w + M_0 - c x>        <f> = integral of (T - |t|) f(t)

so that no rate has to be differentiated: y is linear in K_t/J (or K/J), 1/J, D/J, M_C/J, M_0/J and c/J, with the
readings of the current (or of the voltage) and of the angle in <>.  White random torque correlates neighbouring y by
1/4, errors of the angles by -2/3: the size of both follows from the residuals by restricted maximum likelihood, that of
the angles at least the rounding of the counts.  The noise of a meter follows from its readings alone.  Voltages are
fitted window by window, the winding and the lag from steps of torque.  [MOTOR-TEST; own design]

Not modelled: cogging and torque ripple, which average out over the ways of the runs where these are whole periods, and
errors of the scale that last longer than a window.  Other torques are sought in what is left (left_out).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import integrate, linalg, optimize, special

from gyrobench.reduction.estimation.uncertainty import NORMAL
from gyrobench.reduction.loops.loop_toolkit import ARCSEC, Account, Array, Gate, LoopReduction, Table, told
from gyrobench.reduction.toolkit import ReductionError, plain

from . import left_out
from .windows import ANGLE, CURRENT, PIECE, SLOW, VOLTAGE, Window, apart, bands, cut, meter_bands, reading_noise

SEEN = 10.0  # standard errors: a current that is read at all
WOUND = "J w' = K_t i + M_h - D w - M_C \"sgn\"(w) + M_0 - c x, quad U = R i + K_e w + L i'"
SQUARE_LAW = 'J w\' = K V abs(V) + M_h - D w - M_C "sgn"(w) + M_0 - c x, quad V = U - K_e w'
QUANTUM = 2.0 * math.pi / 7.2e6
NO_LIMIT = "the voltage does not come to its limit in the steps: take a larger torque"
AXIS = (
    ("D", "viscous drag", "N·m·s/rad", "body.axis_viscous"),
    ("M_C", "Coulomb friction", "N·m", "body.axis_friction"),
    ("M_0", "constant torque, at the angle 0", "N·m", ""),
    ("c", "torque per angle, of cables", "N·m/rad", "body.axis_cable"),
)
EDGE = 0.9  # of the largest voltage: at its limit; of the change: the voltage has begun to move


@dataclass(frozen=True)
class Solution:
    """Values with their covariance and degrees of freedom."""

    value: Array
    covariance: Array
    dof: int
    residual: Array
    torque_density: float = 0.0  # N.m/sqrt(Hz)
    angle_error: float = 0.0  # rad, standard deviation
    left_out: Sequence[left_out.Sought] = ()

    def of(self, f: Callable[[Array], float]) -> tuple[float, float]:
        """Return a function of the values and its u: half of the 95 % interval over 1.96."""
        step = 1e-5 * np.sqrt(np.diag(self.covariance))
        slopes = np.array([(f(self.value + d) - f(self.value - d)) / 2.0 for d in np.diag(step)]) / step
        k = float(special.stdtrit(self.dof, 0.975)) / NORMAL
        return float(f(self.value)), k * math.sqrt(float(slopes @ self.covariance @ slopes))

    def over(self, j: int, k: int) -> tuple[float, float]:
        """Return value j over value k and its u."""
        return self.of(lambda v: float(v[j] / v[k]))


class Reduction(LoopReduction):
    """Runs of a free table by the motor and by a known torque, coasting, steps of torque."""

    linearized = False

    def measure(self) -> Account:
        """Measure what the runs show.  Raises ReductionError where the table did not turn as planned."""
        found, o = self.found, self.run.options
        runs, self.steps = ([g for g in found.gates if g.label.startswith("step") is s] for s in (False, True))
        self.windows = windows = [w for g in runs for w in cut(g)]
        driven = [w for w in windows if w.motor]
        if len({w.hung for w in windows}) < 3 or len(driven) < 4 or len({w.sense for w in windows}) < 2:
            raise ReductionError(
                "the table must turn under the motor and under the hung torque to either side; there are "
                f"{len(windows)} windows of {2.0 * PIECE:g} s in which it turns faster than {SLOW:g} rad/s"
            )
        means = np.array([float(np.mean(w.current)) for w in driven])
        errors = np.array([float(np.std(w.current)) / math.sqrt(w.current.size) for w in driven])
        self.wound = wound = bool(np.median(np.abs(means)) > SEEN * np.median(errors))
        self.u = {n: float(o.get(f"u_{n}", 0.0)) for n in ("hung", "voltage", "current")}
        quantum = float(self.run.parameters.get("reader.quantum", QUANTUM))
        mechanics = solve(windows, quantum, _wound) if wound else solve(windows, quantum, _square_law, 0.0)
        (self._winding if wound else self._amplifier)(mechanics)
        one, of_M = 1 if wound else 2, self.u["hung"]  # 1/J
        self._add("J", "inertia of table and load", "kg·m²", mechanics.of(lambda v: 1.0 / v[one]), of_M, "body.axis_J")
        for k, (name, meaning, unit, truth) in enumerate(AXIS, one + 1):
            self._add(name, meaning, unit, mechanics.over(k, one), of_M, truth)
        self._tables(mechanics)
        said = left_out.sentence(mechanics.left_out)
        found.warn("motor.left_out", said, "error")
        found.doubt("motor.left_out", said)
        if silent := [f"u_{n}" for n, u in self.u.items() if not u and (wound or n != "current")]:
            names = ", ".join(silent)
            text = f"Not stated: {names}. Errors of these standards are not in u. Set {names}."
            found.warn("motor.standards", text)
        return Account(
            method="Runs of a free table by the motor and by a known torque, coasting, steps of torque",
            sources=["MOTOR-TEST, MOTOR-DC, MOTOR-SQUARELAW; Hu 1981, eq. 5-1 with ET1, 5-7"],
            equation=WOUND if wound else SQUARE_LAW,
            conventions=[
                "Torques turn the table to larger angles. The known torque M_h is the standard of all torques and of "
                "J.",
                "U_0 and R are as the meters read them: a zero of the voltmeter is in U_0.",
            ],
        )

    def summary(self) -> list[str]:
        constants = (
            ("Torque constant {K_t}, back EMF constant {K_e}.", "Winding: {R}, {L}.") if self.wound else
            ("Torque over the square of the voltage {K}.", "The root shaper is off by {U_0} at null.")
        )  # fmt: skip
        axis = "The axis has an inertia of {J} and Coulomb friction of {M_C}."
        return told(self.found.coefficients, *constants, axis)

    def _add(self, name: str, meaning: str, unit: str, value: tuple[float, float], relative: float, truth: str,
             scale: float = 1.0) -> None:  # fmt: skip
        """Measure a constant; relative: u of the standards it rests on; truth: parameter of the part."""
        known = self.run.parameters.get(truth)
        u = math.hypot(value[1], relative * value[0])
        true = None if known is None else float(known)
        self.found.measure(name, meaning, unit, value[0], u, scale=scale, truth=true)

    def _winding(self, mechanics: Solution) -> None:
        """Measure the constants of a winding, its inductance in the steps of torque."""
        u_M, u_U, u_I = self.u.values()
        add, electric = self._add, _voltages(self.windows)
        R, K_e = float(electric.value[0]), float(electric.value[1])
        torque = mechanics.over(0, 1)
        add("K_t", "torque constant", "N·m/A", torque, math.hypot(u_M, u_I), "drive.motor_K_t")
        add("K_e", "back EMF constant", "V·s/rad", electric.of(lambda v: v[1]), u_U, "drive.motor_K_e")
        ohmic, meaning = math.hypot(u_U, u_I), "inductance of the winding"
        add("R", "resistance of the winding", "Ω", electric.of(lambda v: v[0]), ohmic, "drive.motor_R")
        rises = [x for g in self.steps if (x := _inductance(g, R, K_e)) is not None]
        if len(rises) > 3:
            add("L", meaning, "mH", _mean(rises), ohmic, "drive.motor_L", 1e-3)
        else:
            self.found.measure("L", meaning, "mH", None, no_value=NO_LIMIT)

    def _amplifier(self, mechanics: Solution) -> None:
        """Measure the constants of a motor whose torque goes with the square of its voltage, behind a root shaper."""
        u_M, u_U, _ = self.u.values()
        add, shaper = self._add, _shaper(self.windows)
        torque, u = mechanics.over(0, 2), math.hypot(u_M, 2.0 * u_U)
        add("K", "torque over the square of the voltage", "N·m/kV²", torque, u, "drive.motor_K", 1e-6)
        add("K_e", "back EMF constant", "V·s/rad", mechanics.of(lambda v: v[1]), u_U, "drive.motor_K_e")
        demand, meaning = shaper.of(lambda v: v[0] ** -2), "demanded torque over the square of the shaper's voltage"
        add("K_s", meaning, "N·m/kV²", demand, 2.0 * u_U, "drive.motor_K", 1e-6)
        meaning = "voltage of the shaper at the demand 0: mistrim"
        add("U_0", meaning, "V", shaper.of(lambda v: v[1]), u_U, "drive.motor_offset")
        lag, meaning = _mean([_lag(g) for g in self.steps]), "time constant of the amplifier"
        add("lag", meaning, "ms", lag, 0.0, "drive.motor_lag", 1e-3)

    def _tables(self, mechanics: Solution) -> None:
        """Show how many windows there are of each kind, and what they leave; the torques sought in it."""
        windows = self.windows
        kinds = {"motor": [w.motor != 0.0 for w in windows], "hung torque": [w.hung != 0.0 for w in windows]}
        kinds["coasting"] = [not a and not b for a, b in zip(*kinds.values(), strict=True)]
        rows: list[list[Any]] = []
        for name, of in kinds.items():
            r = mechanics.residual[np.array(of)] / PIECE**2
            rows.append([name, int(r.size), float(np.sqrt(np.mean(r**2))) if r.size else None])
        caption = (
            f"Windows of {2.0 * PIECE:g} s. From the residuals: random torque on the axis "
            f"{plain(mechanics.torque_density)} N·m/√Hz, standard deviation of an angle "
            f"{plain(mechanics.angle_error / ARCSEC)}″."
        )
        columns = ["phase", "windows", "rms of the residual / (rad/s²)"]
        sought = [[s.term.meaning, s.size, s.u, s.term.unit, s.p] for s in mechanics.left_out]
        lacking = "Each as if it were in the model, with the p of chance; the model has none of them."
        self.found.tables += [
            Table("windows", "Windows", caption, columns, rows),
            Table("motor.left_out", "Torques left out", lacking, ["torque", "size", "u", "unit", "p"], sought),
        ]


def _wound(w: Window, _: float, __: float) -> tuple[float, float, Array]:
    """Return <i>, which does not depend on K_e, and its slopes by the readings."""
    return w.integral(w.current), 0.0, np.ones(w.current.size)


def _square_law(w: Window, K_e: float, noise: float) -> tuple[float, float, Array]:
    """Return <V |V|>, its derivative by K_e and its slopes by the readings.

    Normal errors of standard deviation s make of V |V| in the mean (V2 + s2) erf(V/(s sqrt 2)) + s V sqrt(2/pi)
    exp(-V2/(2 s2)): s2 sgn V more where |V| is large.  It is taken out, with the V of the window's mean.
    """
    V = w.voltage - K_e * w.rate
    mean, more = float(np.mean(V)), 0.0
    if noise > 0.0:
        r = mean / (noise * math.sqrt(2.0))
        more = (mean**2 + noise**2) * math.erf(r) - mean * abs(mean)
        more += noise * mean * math.sqrt(2.0 / math.pi) * math.exp(-r * r)
    return w.integral(V * np.abs(V) - more), -2.0 * w.integral(np.abs(V) * w.rate), 2.0 * np.abs(V)


def solve(windows: Sequence[Window], quantum: float, torque: Callable[..., Any], K_e: float | None = None) -> Solution:
    """Return K/J, (K_e,) 1/J, D/J, M_C/J, M_0/J, c/J by generalized least squares.

    torque: the regressor of the motor, its derivative by K_e and its slopes by the readings of the meter, for a window
    and K_e.  K_e: from which it is sought; None: not at all.  quantum: rad, of the angle.
    """
    y = np.array([w.y for w in windows])
    others = np.array(
        [[w.hung * PIECE**2, -w.turned, -w.sense * PIECE**2, PIECE**2, -w.integral(w.angle)] for w in windows]
    )
    parts = bands(windows)
    noise = reading_noise([w.current if K_e is None else w.voltage for w in windows])
    value, covariance, sizes, X, target = np.zeros(0), np.zeros((0, 0)), np.zeros(2), others, y
    for _ in range(30):
        of, by_K_e, slope = (np.array(v) for v in zip(*(torque(w, K_e, noise) for w in windows), strict=True))
        X = np.column_stack([of, others])
        size = float(value[0] if value.size else np.linalg.lstsq(X, y, rcond=None)[0][0])
        if K_e is not None:
            X, target = np.insert(X, 1, size * by_K_e, axis=1), y + size * by_K_e * K_e
        read = (size * noise) ** 2 * meter_bands(windows, slope)
        sizes = restricted(X, target, parts, read, quantum**2 / 12.0)
        last, (value, covariance, _) = value, weighted(X, target, np.tensordot(sizes, parts, 1) + read)
        if K_e is not None:
            K_e = float(value[1])
        if last.size and np.all(np.abs(value - last) < 1e-4 * np.sqrt(np.diag(covariance))):
            break
    J = 1.0 / float(value[-5])
    residual = target - X @ value
    terms = [np.array([w.weight @ t.columns(w.angle, w.rate) for w in windows]) for t in left_out.TERMS]
    sought = left_out.seek(X, residual, np.tensordot(sizes, parts, 1) + read, J, terms)
    return Solution(
        value, covariance, y.size - value.size, residual, J * math.sqrt(sizes[0]), math.sqrt(sizes[1]), sought
    )


def weighted(X: Array, y: Array, V: Array) -> tuple[Array, Array, float]:
    """Return the generalized least squares estimate for the covariance V (lower bands), its covariance, and -2 ln of
    the restricted likelihood of V."""
    factor = linalg.cholesky_banded(V, lower=True)
    white = linalg.solve_banded((V.shape[0] - 1, 0), factor, np.column_stack([X, y]))
    A, z = white[:, :-1], white[:, -1]
    information = A.T @ A
    covariance = np.linalg.inv(information)
    value = covariance @ (A.T @ z)
    log = 2.0 * float(np.log(factor[0]).sum()) + float(np.linalg.slogdet(information)[1])
    return value, covariance, log + float(np.sum((z - A @ value) ** 2))


def restricted(X: Array, y: Array, parts: Array, known: Array, least: float) -> Array:
    """Return the squared density of the random torque (over J2) and the variance of an angle of largest restricted
    likelihood, beside a known covariance.  least: of the variance of an angle."""
    largest = float(np.mean(y**2)) / parts[:, 0, 0]
    bounds = np.log([[1e-12 * largest[0], largest[0]], [least, max(largest[1], 2.0 * least)]])

    def minus(logarithms: Array) -> float:
        return weighted(X, y, np.tensordot(np.exp(logarithms), parts, 1) + known)[2]

    rest = y - X @ np.linalg.lstsq(X, y, rcond=None)[0]
    start = np.clip(np.log(0.5 * float(np.mean(rest**2)) / parts[:, 0, 0]), *bounds.T)
    found = optimize.minimize(
        minus, start, method="Nelder-Mead", bounds=bounds, options={"xatol": 1e-3, "fatol": 1e-4, "maxiter": 400}
    )
    return np.asarray(np.exp(found.x))


def _linear(X: Array, y: Array) -> Solution:
    covariance = np.linalg.inv(X.T @ X)
    value = covariance @ X.T @ y
    residual = y - X @ value
    dof = y.size - value.size
    return Solution(value, covariance * float(residual @ residual) / dof, dof, residual)


def _voltages(windows: Sequence[Window]) -> Solution:
    """Return R, K_e and the zero of the voltmeter: U = R i + K_e w + zero, means of every other window, L i' = 0."""
    rows = [(float(np.mean(w.current)), float(np.mean(w.rate)), float(np.mean(w.voltage))) for w in apart(windows)]
    i, w, U = np.array(rows).T
    return _linear(np.column_stack([i, w, np.ones(i.size)]), U)


def _shaper(windows: Sequence[Window]) -> Solution:
    """Return 1/sqrt(K) and the offset: U = sgn(d) sqrt(|d| / K) + offset."""
    rows = [(math.copysign(math.sqrt(abs(w.motor)), w.motor), float(np.mean(w.voltage))) for w in apart(windows)]
    d, U = np.array(rows).T
    return _linear(np.column_stack([d, np.ones(d.size)]), U)


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
    k = float(special.stdtrit(x.size - 1, 0.975)) / NORMAL
    return float(np.mean(x)), k * float(np.std(x, ddof=1)) / math.sqrt(x.size)
