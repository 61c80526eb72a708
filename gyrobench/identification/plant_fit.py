"""Physical parameters of a plant from its measured response: values, covariance, test of the model.

Weighted least squares over all frequencies.  A weight is of the noise of the lines beside, relative to the gain of the
model, not of the line itself: else lines that the noise has made small count more, and the gain comes out low.  The
covariance is that of first order, by each line's own noise.  What is left, over its noise, is chi-squared where the
model describes the plant; more of it (p < 0.001) is lack of fit: the uncertainties are widened by Birge's ratio, and
the frequency is named at which the model is furthest off.
Source: Pintelon 2012, 9.11 (least squares in the frequency domain) and 11.3 (test of the cost).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.special import fdtrc

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.bench import UsageError, suggest_names
from gyrobench.identification.loop_curve import PARABOLA, noise_level
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.identification.plant_model import (
    MODE,
    NEEDED,
    OF_PLATFORM,
    OUTPUTS,
    PARAMETERS,
    SIGNED,
    PlantModel,
    unit_of,
)
from gyrobench.identification.ratios import MeasuredResponse
from gyrobench.record.csv_reader import DataError
from gyrobench.record.frequency_response import Complex
from gyrobench.reduction.estimation.uncertainty import NORMAL

HELD = "held"
LACK = 0.001
LARGEST_U = 0.3
ALIKE = 1e-7  # smallest over largest singular value of the sensitivities: below it two parameters act alike
FREQUENCIES = 60  # at which a mode is looked for
TRIES = 5  # of the best of them
SPARE = 6  # numbers more than parameters
OTHERS = np.where(np.arange(PARABOLA.size) == PARABOLA.size // 2, 0.0, PARABOLA)
OTHERS = OTHERS / OTHERS.sum()  # the noise of a line by its neighbours alone
WILD = 3.0
WEIGHINGS = 3  # with the noise at the gain of the model


@dataclass(frozen=True)
class PlantFit:
    """Values, SI, of parameters that were found, with covariance (of their values); known: those that were stated.

    p: that the model describes the plant; worst: dB and Hz where it is furthest off; f, value: its response.
    """

    values: Mapping[str, float]
    covariance: Array
    known: Mapping[str, float]
    model: PlantModel
    square: float
    p: float
    worst: tuple[float, float]
    f: Array = field(repr=False)
    value: Complex = field(repr=False)

    @property
    def lacks(self) -> bool:
        """Return whether the model does not describe the plant."""
        return self.p < LACK

    def u(self, name: str) -> float:
        """Return the standard uncertainty of a value."""
        k = list(self.values).index(name)
        return math.sqrt(self.covariance[k, k])

    def interval(self, name: str) -> tuple[float, float]:
        """Return the 95 % interval of a value."""
        return self.values[name] - NORMAL * self.u(name), self.values[name] + NORMAL * self.u(name)

    @property
    def sentence(self) -> str:
        """Return whether the model describes the plant."""
        if not self.lacks:
            return f"the model describes the plant (p = {self.p:.2g})"
        off, at = self.worst
        return (
            f"lack of fit: the model is off by {off:.2g} dB at {at:.4g} Hz, more than the noise; the intervals are "
            f"{math.sqrt(self.square):.2g} times wider and may not hold the truth. A mode, a delay or a held input may "
            "be missing"
        )

    def as_dict(self) -> dict[str, object]:
        """Return plain JSON values, SI."""
        return {
            "values": {n: {"value": v, "u": self.u(n), "unit": PARAMETERS[n][0]} for n, v in self.values.items()},
            "known": dict(self.known),
            "covariance": self.covariance.tolist(),
            "mean_square": self.square,
            "p": self.p,
            "sign": self.model.sign,
            "held": self.model.held,
        }

    def toml(self, source: str) -> str:
        """Return the values that a platform of the bench has, as a file for --set @FILE."""
        every = {**self.known, **self.values}
        lines = [f"# plant of {source}" + (": the model does not describe it (lack of fit)" if self.lacks else "")]
        others = [n for n in every if n not in OF_PLATFORM]
        lines += [f"# {n} = {every[n]:.6g} {PARAMETERS[n][0]}" for n in others]
        lines += [
            "[platform]",
            *(f'{n} = "{max(every[n], 0.0):.9g}{PARAMETERS[n][0]}"' for n in OF_PLATFORM if n in every),
        ]
        return "\n".join(lines) + "\n"


def shown_values(fit: PlantFit) -> list[list[str]]:
    """Return rows of name, value and 95 % interval with as many digits as the uncertainty bears."""
    rows = []
    for name, value in fit.values.items():
        digits = max(1 - math.floor(math.log10(fit.u(name) or abs(value) * 1e-6)), 0) if value else 3
        unit = units.display(PARAMETERS[name][0]) if PARAMETERS[name][0] != "1" else ""
        low, high = fit.interval(name)
        texts = [f"{x:.{digits}f}".replace("-", "−") for x in (value, low, high)]
        rows.append([name, f"{texts[0]} {unit}".rstrip(), f"{texts[1]} to {texts[2]}"])
    return rows + [
        [name, f"{value:.6g} {units.display(PARAMETERS[name][0])}", "stated"] for name, value in fit.known.items()
    ]


def parse_fit(texts: Sequence[str]) -> tuple[list[str], dict[str, float], bool]:
    """Return the parameters to find, those that are known, and whether the input is held.  Raises UsageError."""
    free: list[str] = []
    known: dict[str, float] = {}
    held = False
    for text in texts:
        name, given, value = (x.strip() for x in text.partition("="))
        names = MODE if name == "mode" else (name,)
        if name == HELD and not given:
            held = True
            continue
        if names[0] not in PARAMETERS or (given and len(names) > 1):
            raise UsageError(f"--fit {text}: no such parameter; {suggest_names(name, [*PARAMETERS, 'mode', HELD])}")
        if given:
            try:
                known[name] = units.parse_quantity(value, PARAMETERS[name][0])
            except units.UnitError as error:
                raise UsageError(f"--fit {text}: {error}") from None
        else:
            free += names
    if twice := {n for n in free if free.count(n) > 1 or n in known}:
        raise UsageError(f"--fit {', '.join(sorted(twice))}: named twice")
    if not free:
        raise UsageError("--fit: every parameter is known; name one without a value, such as --fit J")
    return free, known, held


def _model(record: LoopRecord, free: Sequence[str], known: Mapping[str, float], held: bool) -> PlantModel:
    column = "input" if "input" in record.shown else "controller"
    drive = unit_of(record.shown[column], tuple(NEEDED))
    output = unit_of(record.shown["output"], tuple(OUTPUTS))
    if not drive or not output:
        raise UsageError(
            f"--fit: the plant leads from [{record.shown[column]}] to [{record.shown['output']}]; a platform "
            "leads from N.m, A or V to rad/s or rad"
        )
    given = {*free, *known}
    lacking = [n for n in ("J", "viscous", *NEEDED[drive]) if n not in given]
    if lacking:
        raise UsageError(
            f"--fit: with an input in {drive} {', '.join(lacking)} must be named, to be found (--fit {lacking[0]}) or "
            f"known (--fit {lacking[0]}=...{PARAMETERS[lacking[0]][0]})"
        )
    if extra := [n for n in OF_PLATFORM if n in given and n not in ("J", "viscous", *NEEDED[drive])]:
        raise UsageError(f"--fit: with an input in {drive} {', '.join(extra)} has no effect; leave it out")
    if 0 < len(mode := given & set(MODE)) < len(MODE):
        raise UsageError(
            f"--fit: a mode has {', '.join(MODE)}; {', '.join(n for n in MODE if n not in mode)} is missing"
        )
    return PlantModel(drive, OUTPUTS[output], record.step if held else 0.0)


@dataclass(frozen=True)
class _PlantProblem:
    """Parameters ``names`` of a model, the others ``known``, and the response that it should have.

    Coordinates are logarithms, but of SIGNED parameters.
    """

    model: PlantModel
    known: Mapping[str, float]
    names: Sequence[str]
    f: Array
    value: Complex

    def coordinates(self, values: Mapping[str, float]) -> Array:
        return np.array([values[n] if n in SIGNED else math.log(values[n]) for n in self.names])

    def sizes(self, x: Array) -> Array:
        """Return how large changes of the coordinates are that matter."""
        least = {"delay": 1e-4, "mode_share": 0.01}
        return np.array(
            [max(abs(v), least.get(n, 1e-12)) if n in SIGNED else 1.0 for n, v in zip(self.names, x, strict=True)]
        )

    def values(self, x: Array) -> dict[str, float]:
        bounded = [
            float(v) if n in SIGNED else math.exp(min(max(v, -60.0), 60.0)) for n, v in zip(self.names, x, strict=True)
        ]
        return dict(zip(self.names, bounded, strict=True))

    def response(self, x: Array) -> Complex:
        return self.model.response({**self.known, **self.values(x)}, self.f)

    def rest(self, x: Array, sigma: Array | None) -> Array:
        """Return the residuals over their noise; where sigma is None those of the logarithms."""
        g = self.response(x)
        with np.errstate(divide="ignore", invalid="ignore"):
            z = (g - self.value) / sigma if sigma is not None else np.log(g / self.value)
        z = np.where(np.isfinite(z), z, 1e6)
        return np.concatenate([z.real, z.imag])

    def square(self, x: Array, sigma: Array | None) -> float:
        """Return the sum of squares of the residuals."""
        return float(np.sum(self.rest(x, sigma) ** 2))

    def solved(self, x: Array, sigma: Array | None) -> Array:
        """Return the coordinates of the nearest least squares; robust ones without sigma."""
        found = least_squares(
            lambda y: self.rest(y, sigma), x, x_scale=self.sizes(x),
            loss="soft_l1" if sigma is None else "linear", xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=200,
        )  # fmt: skip
        return np.asarray(found.x)

    def sensitivity(self, x: Array, sigma: Array) -> Array:
        """Return the derivatives of the residuals by the coordinates, by central differences."""
        columns = []
        for k, size in enumerate(self.sizes(x)):
            step = np.zeros(x.size)
            step[k] = 1e-6 * size
            z = (self.response(x + step) - self.response(x - step)) / (2.0 * step[k]) / sigma
            columns.append(np.concatenate([z.real, z.imag]))
        return np.stack(columns, axis=1)


def _found(problem: _PlantProblem, sigma: Array) -> tuple[_PlantProblem, Array]:
    """Return the problem with the sign of its plant, and the coordinates of the best fit.

    A rigid platform is fitted first, on logarithms, with either sign; then a mode is looked for at many frequencies.
    """
    rigid, known, f = [n for n in problem.names if n not in MODE], problem.known, problem.f
    searched = "mode_f" in problem.names
    base = {n: v for n, v in known.items() if n not in MODE} if searched else known
    guess = _rough(problem)
    fits = []
    for sign in (1.0, -1.0):
        stiff = replace(problem, model=replace(problem.model, sign=sign), known=base, names=rigid)
        x = stiff.solved(stiff.coordinates(guess), None)
        fits.append((stiff.square(x, None), stiff, x))
    _, stiff, x = min(fits, key=lambda m: m[0])
    problem = replace(problem, model=stiff.model)
    if not searched:
        return problem, problem.solved(x, sigma)
    values = {**stiff.values(x), **known}
    tries = []
    for at in np.geomspace(f[0], f[-1], FREQUENCIES + 2)[1:-1]:
        modes = [{"mode_f": float(at), "mode_damping": damping, "mode_share": share}
                 for damping in (0.01, 0.05) for share in (0.3, 0.1, -0.1)]  # fmt: skip
        starts = [problem.coordinates({**values, **mode, **known}) for mode in modes]
        tries.append(min(((problem.square(x, None), x) for x in starts), key=lambda t: t[0]))
    tries.sort(key=lambda t: t[0])
    ends = [problem.solved(problem.solved(start, None), sigma) for _, start in tries[:TRIES]]
    return problem, min(ends, key=lambda x: problem.square(x, sigma))


def _rough(problem: _PlantProblem) -> dict[str, float]:
    """Return values from which to search, of an inertia that has the gain in the middle of the frequencies."""
    model, known, f, value = problem.model, problem.known, problem.f, problem.value
    k = f.size // 2
    turn = abs(value[k]) * (2.0 * np.pi * f[k]) ** (1 + model.integrations)
    R = known.get("R", 1.0)
    over = {"N.m": 1.0, "A": 1.0, "V": R}[model.input]
    J = known.get("J", (1.0 if model.input == "N.m" else known.get("k_t", 1.0)) / over / turn)
    k_t = known.get("k_t", J * turn * over)
    return {"J": J, "viscous": J * np.pi * f[0], "k_t": k_t, "k_e": k_t, "R": R, "L": 1e-3 * R, "delay": 1e-3}


def _chosen(plant: MeasuredResponse, lines: NDArray[np.bool_]) -> MeasuredResponse:
    return MeasuredResponse(*(getattr(plant, n)[lines] for n in ("f", "value", "u", "dof", "center", "radius")))


def _relative_noise(plant: MeasuredResponse) -> Array:
    """Return the noise of each line over its gain, from the lines beside it; inf where its input is not determined.

    Its own gain must not decide on its weight, nor whether it is used: what the noise has made small would count more
    (or less).  A line whose own noise is WILD times as large keeps that.
    """
    there = np.isfinite(plant.radius) & np.isfinite(plant.u)
    noise = np.full(there.size, np.inf)
    if np.any(there):
        lines = _chosen(plant, there)
        relative = replace(lines, value=np.ones_like(lines.value))  # the noise of a resonance is as large as its gain
        beside = np.sqrt(noise_level(relative, OTHERS) / 2.0)
        noise[there] = np.where(lines.u > WILD * beside, lines.u, beside)
    return noise


def fit_plant(record: LoopRecord, plant: MeasuredResponse, texts: Sequence[str]) -> PlantFit:
    """Return the parameters of a measured plant; texts as of :func:`parse_fit`.  Raises UsageError and DataError."""
    free, known, held = parse_fit(texts)
    model = _model(record, free, known, held)
    noise = _relative_noise(plant)
    good = noise < LARGEST_U
    if 2 * int(good.sum()) < len(free) + SPARE:
        said = f"{int(good.sum())} frequencies with a plant above the noise are too few to find {len(free)} parameters"
        raise DataError(record.name, [said])
    kept, noise = _chosen(plant, good), noise[good]
    f, value = kept.f, kept.value
    sigma = noise * np.abs(value)
    problem, x = _found(_PlantProblem(model, known, free, f, value), sigma)
    for _ in range(WEIGHINGS):
        sigma = noise * np.abs(problem.response(x))
        x = problem.solved(x, sigma)
    by = problem.sensitivity(x, sigma)
    size = np.linalg.norm(by, axis=0)
    singular, right = np.linalg.svd(by / np.where(size > 0.0, size, 1.0))[1:]
    if not np.all(size > 0.0) or singular[-1] < ALIKE * singular[0]:
        alike = [n for n, s in zip(free, np.abs(right[-1]), strict=True) if s > 0.1]
        why = "act alike in this record and cannot be told apart" if len(alike) > 1 else "has no effect in this record"
        raise UsageError(
            f"--fit: {' and '.join(alike)} {why}; state {'one of them' if len(alike) > 1 else 'it'} "
            f"(--fit {alike[0]}=...{PARAMETERS[alike[0]][0]})"
        )
    spare = 2 * f.size - len(free)
    square = problem.square(x, sigma) / spare
    p = float(fdtrc(spare, float(kept.dof.sum()), square))
    values = problem.values(x)
    scale = np.array([1.0 if n in SIGNED else values[n] for n in free])
    inverse = np.linalg.inv(by.T @ by)
    own = np.tile(kept.u * np.abs(value) / sigma, 2)  # beside a resonance the noise of a line is not that of its weight
    covariance = np.asarray(inverse @ (by.T * own**2) @ by @ inverse, float) * np.outer(scale, scale)
    covariance *= max(square, 1.0) if p < LACK else 1.0
    g = problem.response(x)
    k = int(np.argmax(np.abs((value - g) / sigma)))
    worst = 20.0 * math.log10(1.0 + abs(value[k] / g[k] - 1.0)), float(f[k])
    return PlantFit(values, covariance, known, problem.model, square, p, worst, f, g)
