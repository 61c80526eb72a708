"""Error budget of the three-axis platform by source: what turns the element while the base swings, and at rest.

Where the element rests in space, the motion of the base alone says how the joints move, and so which torque comes about
each motor axis (A order):

    viscous friction       -B theta'                 back EMF       -k_t k_e theta' / (R + L s + K_c + K_ci/s)
    dry friction           an elastic contact, theta dragged within presliding, +-friction beyond
    reaction of gimbals    -(I a + w x I w) of the roll and the pitch gimbal, which move with the base

K_c, K_ci: of a current loop about the motor, which takes the back EMF out; 0 without one.

From a torque tau_k to the angles phi of the element leads the closed linear model of the run, T.  The output axes of
the gyros feed back: a rate error (J/H) w_O' acts as a command, N = (J/H) s2 (mount, row O).  With the response C to
commands

    C_0 = C (1 + N C)^-1      T_0 = T - C_0 N T      phi = T_0 tau (the ways of the base) + C_0 N phi (output axes)

The same splits the angle about the other axes that a commanded sine leaves.  White and slow drift of the gyros pass to
the angle as commands, noise of a pickoff as the rate n s (tau s + 1) C/(K_sg H), noise of the current read of a
rebalanced gyro as k n.  Of noise, what is left about mean and slope of a window of
length D counts, x = pi f D:  1 - (sin x/x)^2 - 3 (sin x/x^2 - cos x/x)^2.

A share is the covariance of the source with the whole over the variance of the whole: shares add up to 100 %, one that
is negative cancels part of the others.

Not modelled: unbalance, the peak of stiction over friction, limits, change of the loop with the gimbal angles.
[PLATFORM-3AXIS-DYN, -KIN; GYRO-OA-COUPLING-Y2]
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.record.frequency_response import model_response
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.loops import margins as m
from gyrobench.reduction.loops.loop_measures import Gate
from gyrobench.reduction.loops.loop_result import LoopFindings
from gyrobench.reduction.loops.rides import still
from gyrobench.reduction.series.gyro_noise import slow_density
from gyrobench.result import Table
from gyrobench.units import ARCSEC

Complex = NDArray[np.complex128]
AXES = (1, 2, 3)
MOTORS = ("pitch", "roll", "azimuth")
GYROS = ("gyro_x", "gyro_y", "gyro_z")
HIGHEST = 25.0  # Hz, of the motion of a base
LOWEST = 1e-3  # Hz, where the integral over the noise begins; a window takes what is slower than it
POINTS = 400  # of it
LEAST = 1e-3  # of the variance: what is less in size and share is one row
WRONG = 0.2  # relative: a measured angle that differs more from the computed one is not the linear model's
OUTPUT_AXES = "output axes of the gyros"
CAPTION = (
    "Angle of the inner element in each motion, root sum of squares of the three axes about mean and slope (commands: "
    "the two other axes), computed from the linear model, and its share of the variance. Ways of one motion add with "
    "their phases: a negative share cancels part of the others. Without it: what would be left if this source were "
    "switched off."
)
GYRO = ("H", "J", "C", "K_sg", "mount")
SLOW = "markov markov_tau flicker flicker_tau walk quantization quantization_tau"
NOISE = ("white", "pickoff", *SLOW.split())
PLATFORM = ("viscous", "k_t", "k_e", "R", "L", "friction", "stiction", "presliding", "I_r", "I_f", "I_a")


class ElementResponses:
    """Responses of the element's angles (rows x, y, z) in the closed linear model of a run.

    slides: the joints move.  The linear model takes dry friction for its elastic contact, K_c = K + s sqrt(K J); a
    contact that slides has none: it is taken out again, T (1 - K_c Theta)^-1 with the joints' response Theta.
    Raises LookupError, ValueError or StopIteration where the model lacks one, or a part is not the bench's own.
    """

    def __init__(self, found: LoopFindings, angles: Sequence[str], slides: bool) -> None:
        model = found.linear.closed.discrete
        if model is None:
            raise LookupError("no linear model")
        self.model, self.angles = model, angles
        p = found.record.run.parameters
        self.platform = {n: np.asarray(p[f"platform.{n}"], float) for n in PLATFORM}
        for n in ("K_c", "K_ci"):
            self.platform[n] = np.array([float(p.get(f"{axis}.{n}", 0.0)) for axis in MOTORS])
        self.gyros = [{n: np.asarray(p[f"{gyro}.{n}"], float) for n in GYRO} for gyro in GYROS]
        self.noise = [{n: float(p.get(f"{g}.{n}") or 0.0) for n in NOISE} for g in GYROS]
        meters = (float(p.get(f"rebalance_{g[-1]}.meter", 0.0)) * float(p.get(f"{g}.k", 0.0)) for g in GYROS)
        for noise, meter in zip(self.noise, meters, strict=True):
            noise["meter"] = meter
        self.contact = _stiffness(self.platform) if slides else np.zeros((2, 3))
        self.f_noise = m.grid(LOWEST, 0.5 / model.step, POINTS)
        self.by_noise = self.to("command", self.f_noise)

    def to(self, kind: str, f: Array) -> Complex:
        """Return (frequency, angle, axis of the excitation)."""
        whole = model_response(self.model, f)

        def part(names: Sequence[str], kind: str) -> Complex:
            wired = [next(n for n in self.model.inputs if n.partition(".")[2] == f"{kind}[{k}]") for k in AXES]
            rows = [self.model.outputs.index(n) for n in names]
            return np.asarray(whole[:, rows][:, :, [self.model.inputs.index(n) for n in wired]])

        found = part(self.angles, kind)
        if np.any(self.contact):
            joints_ = [f"platform.theta[{k}]" for k in AXES]
            stiff = (self.contact[0] + 2j * np.pi * f[:, None] * self.contact[1])[:, :, None] * np.eye(3)
            loose = np.linalg.inv(np.eye(3) - part(joints_, "torque") @ stiff)
            found = found + part(self.angles, "torque") @ stiff @ loose @ part(joints_, kind)
        return found

    def output_axes(self, f: Array) -> Complex:
        """Return N: (frequency, gyro, axis of the element)."""
        s = 2j * np.pi * f
        rows = np.array([g["J"] / g["H"] * g["mount"][1] for g in self.gyros])
        return np.asarray(s[:, None, None] ** 2 * rows)

    def without(self, f: Array) -> tuple[Complex, Complex]:
        """Return N and C_0."""
        n, c = self.output_axes(f), self.to("command", f)
        return n, c @ np.linalg.inv(np.eye(3) + n @ c)

    def split(self, torques: Mapping[str, Array], dt: float) -> dict[str, Array]:
        """Return source -> angles (3, samples) of torques (3, samples) about the motor axes, rad.

        Samples that do not close to a period must be windowed.
        """
        count = next(iter(torques.values())).shape[1]
        f: Array = np.fft.rfftfreq(count, dt).astype(np.float64)
        use = (f > 0.0) & (f < HIGHEST)
        t = self.to("torque", f[use])
        n, c_0 = self.without(f[use])
        back = c_0 @ n
        found, whole = {}, np.zeros((3, f.size), complex)
        for name, tau in torques.items():
            spectrum = np.zeros((3, f.size), complex)
            own = t @ np.fft.rfft(tau)[:, use].T[:, :, None]
            spectrum[:, use] = (own - back @ own)[:, :, 0].T
            whole[:, use] += own[:, :, 0].T
            found[name] = np.fft.irfft(spectrum, count)
        coupled = np.zeros((3, f.size), complex)
        coupled[:, use] = (back @ whole[:, use].T[:, :, None])[:, :, 0].T
        return found | {OUTPUT_AXES: np.fft.irfft(coupled, count)}

    def of_noise(self, time: float) -> dict[str, float]:
        """Return source -> rms of the angle of all axes about mean and slope of a window of this length (s), rad."""
        f = self.f_noise
        s, x = 2j * np.pi * f, np.pi * f * time
        kept = 1.0 - np.sinc(f * time) ** 2 - 3.0 * (np.sin(x) / x**2 - np.cos(x) / x) ** 2
        ways = np.sum(np.abs(self.by_noise) ** 2, axis=1) * np.clip(kept, 0.0, None)[:, None]
        total = {"white drift of the gyros": 0.0, "slow drift of the gyros": 0.0, "noise of the pickoffs": 0.0}
        total["noise of the currents read"] = 0.0
        for k, (noise, g) in enumerate(zip(self.noise, self.gyros, strict=True)):
            lag = np.abs(s * (g["J"] / g["C"] * s + 1.0) * g["C"] / (g["K_sg"] * g["H"])) ** 2
            slow = slow_density(noise, f)
            each = (noise["white"] ** 2, slow, noise["pickoff"] ** 2 * lag, noise["meter"] ** 2)
            for name, density in zip(total, each, strict=True):
                total[name] += 2.0 * float(np.trapezoid(density * ways[:, k], f))
        return {name: math.sqrt(square) for name, square in total.items() if square > 0.0}


def _stiffness(p: Mapping[str, Array]) -> Array:
    """Return stiffness (N.m/rad) and damping of the contacts of platform_three_axis: rows, A order."""
    inner = min(p["I_a"][:2])
    least = [p["I_f"][0] + inner, p["I_r"][1] + min(p["I_f"][1] + inner, p["I_f"][2]), p["I_a"][2]]
    spring = np.maximum(p["friction"], p["stiction"]) / p["presliding"]
    return np.array([spring, np.sqrt(spring * least)])


# --------------------------------------------------------------------------------------- torques of the base
def _turn(axis: int, angle: Array) -> Array:
    """Return passive rotations (samples, 3, 3) about an axis 0, 1, 2."""
    c, s = np.cos(angle), np.sin(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    out = np.zeros((angle.size, 3, 3))
    out[:, axis, axis] = 1.0
    out[:, i, i] = out[:, j, j] = c
    out[:, i, j], out[:, j, i] = s, -s
    return out


def joints(base: Array, start: Array) -> Array:
    """Return the joint angles (3, samples; A order) of an element at rest in space; base: pitch, roll, heading."""
    of_base = _turn(1, base[1]) @ _turn(0, base[0]) @ _turn(2, base[2])
    first = [np.array([x]) for x in start]
    element = (_turn(2, first[2]) @ _turn(0, first[0]) @ _turn(1, first[1]) @ of_base[:1])[0]
    c = element @ np.swapaxes(of_base, 1, 2)
    return np.array([-np.arcsin(c[:, 2, 1]), np.arctan2(c[:, 2, 0], c[:, 2, 2]), np.arctan2(c[:, 0, 1], c[:, 1, 1])])


def torques(loop: ElementResponses, base: Array, theta: Array, dt: float) -> dict[str, Array]:
    """Return source -> torque (3, samples; A order, N.m) of the moving base about the motor axes."""
    p = loop.platform

    def rate(x: Array) -> Array:
        return np.asarray(np.gradient(x, dt, axis=-1, edge_order=2))

    speed = rate(theta)
    f = np.fft.rfftfreq(theta.shape[1], dt)
    s = np.where(f > 0.0, 2j * np.pi * f, 1e-9j)  # a steady rate: next to none, an integral takes its back EMF out
    lag = 1.0 / (p["R"][:, None] + s * p["L"][:, None] + p["K_c"][:, None] + p["K_ci"][:, None] / s)
    emf = np.fft.irfft(np.fft.rfft(speed) * lag * (p["k_t"] * p["k_e"])[:, None], theta.shape[1])
    found = {
        "viscous friction": -p["viscous"][:, None] * speed,
        "back EMF of the motors": -emf,
        "dry friction": -np.array(
            [_contact(*x, float(p["presliding"])) for x in zip(theta, p["friction"], strict=True)]
        ),
        "reaction of the gimbals": _reaction(p, base, theta, rate),
    }
    return {name: tau for name, tau in found.items() if np.any(tau)}


def _contact(theta: Array, friction: float, presliding: float) -> Array:
    """Return the torque of an elastic contact that slides: twice round, so that it begins as it ends."""
    out, anchor = np.zeros(theta.size), float(theta[0])
    if friction > 0.0:
        for k, x in enumerate([*theta, *theta]):
            anchor = min(max(anchor, x - presliding), x + presliding)
            out[k % theta.size] = friction * (x - anchor) / presliding
    return out


def _reaction(p: Mapping[str, Array], base: Array, theta: Array, rate: Any) -> Array:
    """Return the torque about the motor axes of the inertia of roll and pitch gimbal, which the base takes along."""
    (p_, r_, _), turn = base, rate(base)
    w_b = np.array([np.cos(r_) * turn[0] - np.sin(r_) * np.cos(p_) * turn[2], turn[1] + np.sin(p_) * turn[2],
                    np.sin(r_) * turn[0] + np.cos(r_) * np.cos(p_) * turn[2]])  # fmt: skip
    speed = rate(theta)
    w_r = (_turn(1, theta[1]) @ w_b.T[:, :, None])[:, :, 0].T + np.array([0, 1, 0])[:, None] * speed[1]
    w_f = (_turn(0, theta[0]) @ w_r.T[:, :, None])[:, :, 0].T + np.array([1, 0, 0])[:, None] * speed[0]
    n_r, n_f = (
        i[:, None] * rate(w) + np.cross(w, i[:, None] * w, axis=0) for i, w in ((p["I_r"], w_r), (p["I_f"], w_f))
    )
    roll = n_r[1] + np.cos(theta[0]) * n_f[1] - np.sin(theta[0]) * n_f[2]
    return np.array([-n_f[0], -roll, np.zeros(roll.size)])


# --------------------------------------------------------------------------------------- the table
def budget(found: LoopFindings, gates: Mapping[str, Gate], angles: Sequence[str]) -> dict[str, dict[str, float]]:
    """Add the table; return motion -> source -> share of the variance.  gates: name of the motion -> its phase.

    Nothing without a linear model of the bench's own parts.
    """
    try:
        loops = {slides: ElementResponses(found, angles, slides) for slides in (True, False)}
    except (LookupError, ValueError, StopIteration):
        return {}
    rows: list[list[Any]] = []
    shares: dict[str, dict[str, float]] = {}
    for name, gate in gates.items():
        dt = float(gate.t[1] - gate.t[0])
        loop = loops[any(np.ptp(gate[f"platform.theta[{k}]"]) > loops[True].platform["presliding"] for k in AXES)]
        parts, measured = (_commanded if gate.kind == "command" else _moved)(loop, gate, dt)
        noise = loop.of_noise(dt * gate.t.size)
        whole = sum(parts.values(), np.zeros((3, 1)))
        random = sum(x * x for x in noise.values())
        square = _mean(whole, whole) + random
        if not square:
            continue
        if abs(measured / math.sqrt(square) - 1.0) > WRONG + random / square:  # a random walk has few independent parts
            if gate.kind == "command":
                continue  # hardly coupled: what is left is of large angles
            text = (
                f"No error budget by source for {name}: the linear model gives "
                f"{plain(math.sqrt(square) / ARCSEC, 3)}″, measured are {plain(measured / ARCSEC, 3)}″ (a limit, "
                "unbalance, stiction, rounding, or a motion beyond it)."
            )
            found.warn(f"budget.not_linear:{name}", text)
            continue
        entries = [(n, _mean(x, x), _mean(x, whole), -2.0 * _mean(x, whole) + _mean(x, x)) for n, x in parts.items()]
        entries += [(n, x * x, x * x, -x * x) for n, x in noise.items()]
        shares[name] = {n: part / square for n, _, part, _ in entries}
        small = [e for e in entries if max(abs(e[2]), e[1]) < LEAST * square]
        for n, own, part, change in sorted((e for e in entries if e not in small), key=lambda e: -e[2]):
            left = math.sqrt(max(0.0, square + change)) / ARCSEC
            rows.append([name, n, math.sqrt(own) / ARCSEC, 100.0 * part / square, left])
        if small:
            rest = 100.0 * sum(e[2] for e in small) / square
            rows.append([name, "others", None, rest, None])
        rows.append([name, "together", math.sqrt(square) / ARCSEC, None, None])
        rows.append([name, "measured", measured / ARCSEC, None, None])
    if rows:
        columns = ["motion", "source", "angle, rms / ″", "share / %", "without it / ″"]
        title = "Error budget of the platform, by source"
        found.tables.append(Table("budget.sources", title, CAPTION, columns, rows))
    return shares


def _mean(x: Array, y: Array) -> float:
    return float(np.mean(np.sum(x * y, axis=0)))


def _moved(loop: ElementResponses, gate: Gate, dt: float) -> tuple[dict[str, Array], float]:
    """Return the parts of the base's motion (3, samples), rad, and the measured rms.

    A motion that does not close to whole periods is weighted by Hann's window, scaled to a mean square of 1.
    """
    base = np.array([gate[f"motion.angle[{k}]"] for k in AXES])
    measured = np.array([still(gate.t, gate[n]) for n in loop.angles])
    count = gate.t.size
    if gate.f:
        count = round(math.floor(count * dt * gate.f + 1e-6) / gate.f / dt)
    base, measured = base[:, :count], measured[:, :count]
    weight = np.ones(count) if gate.f else np.hanning(count) * math.sqrt(8.0 / 3.0)
    size = math.sqrt(_mean(weight * measured, weight * measured))
    if not np.ptp(base):
        return {}, size
    theta = joints(base, np.array([gate[f"platform.theta[{k}]"][0] for k in AXES]))
    of_base = {n: weight * (x - x.mean(axis=1, keepdims=True)) for n, x in torques(loop, base, theta, dt).items()}
    return loop.split(of_base, dt), size


def _commanded(loop: ElementResponses, gate: Gate, dt: float) -> tuple[dict[str, Array], float]:
    """Return the parts of the angle about the two other axes (3, samples), rad, and the measured rms of it."""
    k = gate.axis - 1
    f = np.array([gate.f])
    n, c_0 = loop.without(f)
    own, reached = c_0[0, :, k] * gate.amplitude, loop.to("command", f)[0, :, k] * gate.amplitude
    phasors = {"coupling of the axes' loops": own, OUTPUT_AXES: (c_0 @ n)[0] @ reached}
    turn = np.exp(2j * np.pi * gate.f * (gate.t - gate.t[0]))
    others = np.array([j != k for j in range(3)])[:, None]
    parts = {name: np.where(others, np.real(x[:, None] * turn), 0.0) for name, x in phasors.items()}
    measured = np.where(others, np.array([still(gate.t, gate[name]) for name in loop.angles]), 0.0)
    return parts, math.sqrt(_mean(measured, measured))
