"""Bias and scale factor that follow the temperature, as further columns of each instrument's fit.

    reading - input = ... + bT T + bT2 T2 + bT3 T3 + bH z + bR T' + (ST T + ST2 T2) input               [IMU-THERMAL]

T above the temperature of the coefficients, T' its rate of change, z how far it is through a hysteresis: a play of the
width that is stated.  All are means over a window in which T changes evenly.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.interpolate import PchipInterpolator, make_smoothing_spline

from gyrobench.arrays import Array
from gyrobench.reduction.estimation.nuisances import BOTH
from gyrobench.reduction.estimation.quantity import Quantity
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.result import Coefficient, Reason
from gyrobench.units import DPH

from .budget import ImuSetup
from .channels import UG, ImuInstrument

PLACES = (np.arange(8) + 0.5) / 8.0  # of a window, at which the play is taken
OTHER_WIDTHS = (1.0 / 3.0, 3.0)  # of the hysteresis, that a test looks for
NARROW = 2.0  # widths of the hysteresis, that temperatures span at least
APART = 0.1  # least share of one more power, hysteresis and rate of a scale factor, of two of them, that is left
#: ending of a coefficient -> parameter of the parts, size of its unit over that of the bias, unit, meaning
BIAS = {
    "T": ("bias_T", 1.0, "/K", "change of the bias of the {} per kelvin"),
    "T2": ("bias_T2", 1.0, "/K²", "change of the bias of the {} per kelvin squared"),
    "T3": ("bias_T3", 1.0, "/K³", "change of the bias of the {} per kelvin cubed"),
    "H": ("hysteresis", 1.0, "", "bias of the {} while the temperature rises, less the mean of both ways"),
    "R": ("ramp", 60.0, "/(K/min)", "bias of the {} per rate of change of the temperature"),
}
SCALE = {
    "T": ("scale_T", 1e-6, "ppm/K", "change of the scale factor of the {} per kelvin"),
    "T2": ("scale_T2", 1e-6, "ppm/K²", "change of the scale factor of the {} per kelvin squared"),
}
#: printed unit -> SI, beside those of channels.SCALES
SCALES = {
    **{f"{unit}{more}": size * si for unit, si in (("°/h", DPH), ("µg", UG)) for _, size, more, _ in BIAS.values()},
    **{unit: size for _, size, unit, _ in SCALE.values()},
}


@dataclass(frozen=True)
class Thermal:
    """Temperature of the windows: T, T2, T3, z, T' (n,), and the orders of bias and scale factor.

    others (n, 2): z of a third and of three times the width.
    """

    powers: tuple[Array, Array, Array]
    way: Array
    slope: Array
    orders: tuple[int, int]
    others: Array

    @classmethod
    def of(cls, windows: Mapping[str, Any], reference: float, width: float, orders: tuple[int, int]) -> Thermal:
        """Return the temperatures of windows above the reference; width (K): of the hysteresis.

        Within a window the temperature changes evenly, between the ends that the means of its neighbours give it; its
        rate of change is that of a smoothing spline (generalized cross-validation), for a thermometer's noise,
        differenced, is as large as that of a slow ramp, and a fit that takes drift off compares all but the slow part.
        """
        t0, t1, mean = (np.asarray(windows[n], dtype=float) for n in ("t_start", "t_end", "temperature"))
        middle = 0.5 * (t0 + t1)
        between = PchipInterpolator(middle, mean - reference, extrapolate=True)
        smooth = PchipInterpolator(middle, make_smoothing_spline(middle, mean)(middle), extrapolate=True)
        start, end = between(t0), between(t1)
        path = start[:, None] + (end - start)[:, None] * PLACES
        first, second, third = ((path**k).mean(axis=1) for k in (1, 2, 3))
        way, *others = (_play(start, path, end, f * width) for f in (1.0, *OTHER_WIDTHS))
        return cls((first, second, third), way, (smooth(t1) - smooth(t0)) / (t1 - t0), orders, np.column_stack(others))

    def rows(self, kept: Array) -> Thermal:
        """Return the temperatures of some of the windows."""
        first, second, third = (p[kept] for p in self.powers)
        changed = {n: getattr(self, n)[kept] for n in ("way", "slope", "others")}
        return replace(self, powers=(first, second, third), **changed)

    def endings(self, scaled: bool) -> list[tuple[str, str]]:
        """Return kind and ending of the coefficients; scaled: whether those of the scale factor are shown."""
        bias, scale = self.orders
        found = [("b", e) for e in ("T", "T2", "T3")[:bias]] + [("b", "H"), ("b", "R")]
        return found + ([("S", e) for e in ("T", "T2")[:scale]] if scaled else [])

    def columns(self, own: Array, scaled: bool) -> tuple[Array, Array]:
        """Return what the coefficients of bias (n, p) and scale factor (n, q) multiply; own: the input (n,)."""
        bias, scale = self.orders
        constant = np.column_stack([*self.powers[:bias], self.way, self.slope])
        grown = [own * p for p in self.powers[:scale]] if scaled else []
        return constant, np.column_stack(grown) if grown else np.empty((own.size, 0))

    def higher(self) -> Array:
        """Return two powers more of the bias (n, 2)."""
        return np.column_stack([self.powers[0] ** (self.orders[0] + k) for k in (1, 2)])

    def grown(self, own: Array) -> Array:
        """Return two powers more, hysteresis and rate of change of the scale factor (n, 4); own: the input (n,)."""
        T, n = self.powers[0], self.orders[1]
        return np.column_stack([own * x for x in (T ** (n + 1), T ** (n + 2), self.way, self.slope)])

    def told(self, own: Array, X: Array) -> bool:
        """Return whether a hysteresis of the scale factor is told from one more power of it; X (n, p): the model."""
        more, unit = (v / np.linalg.norm(v, axis=0) for v in (self.grown(own)[:, [0, 2, 3]], X))
        left = more - unit @ np.linalg.lstsq(unit, more, rcond=None)[0]
        return bool(np.linalg.svd(left, compute_uv=False)[1] > APART)

    def turned(self, inputs: Array) -> Array:
        """Return columns (n, k) of misalignments, or g-sensitivities, that change with T: inputs (n, k)."""
        return np.asarray(self.powers[0][:, None] * inputs)


def _play(start: Array, path: Array, end: Array, width: float) -> Array:
    """Return the mean of a play within -1 ... 1 over each window, 0 at the first start."""
    z, before, out = 0.0, float(start[0]), []
    for first, inside, last in zip(start, path, end, strict=True):
        seen = []
        for T in (first, *inside, last):
            z = min(max(z + 2.0 * (float(T) - before) / width, -1.0), 1.0)
            before = float(T)
            seen.append(z)
        out.append(float(np.mean(seen[1:-1])))
    return np.array(out)


def name_of(channel: ImuInstrument, kind: str, ending: str) -> str:
    """Return the name of a coefficient: bgT_x, SaT2_z."""
    return f"{kind}{channel.kind}{ending}_{channel.letter}"


def quantity(channel: ImuInstrument, kind: str, ending: str, truth: Mapping[str, float]) -> Quantity:
    """Return a coefficient with its meaning and unit."""
    name = name_of(channel, kind, ending)
    _, size, unit, meaning = (BIAS if kind == "b" else SCALE)[ending]
    if kind == "b":
        unit, size = ("°/h" + unit, size * DPH) if channel.gyro else ("µg" + unit, size * UG)
    return Quantity(name, meaning.format(channel.words), unit, size, truth.get(name))


def parameters() -> dict[str, tuple[str, str]]:
    """Return parameter of imu and imu_compensator -> its coefficients without the axis, and its unit."""
    found: dict[str, tuple[str, str]] = {}
    for kind, word, unit, per_rate in (("g", "gyro", "rad/s", "rad/K"), ("a", "acc", "m/s2", "m/s/K")):
        ends = {"T": f"{unit}/K", "T2": f"{unit}/K2", "T3": f"{unit}/K3", "H": unit, "R": per_rate}
        found |= {f"{word}_{BIAS[e][0]}": (f"b{kind}{e}", u) for e, u in ends.items()}
        found |= {f"{word}_{SCALE[e][0]}": (f"S{kind}{e}", u) for e, u in (("T", "1/K"), ("T2", "1/K2"))}
    return found


def narrow_temperatures(windows: Mapping[str, Any], setup: ImuSetup, found: Sequence[Coefficient]) -> list[Reason]:
    """Return that the temperatures need not go through a hysteresis of another width than is stated."""
    if not setup.thermal:
        return []
    span, width = float(np.ptp(windows["temperature"])), setup.thermal[2]
    if span >= NARROW * width:
        return []
    text = (
        f"The temperatures span {plain(span, 3)} K, less than twice the width of the hysteresis, {plain(width, 3)} K: "
        "where it is a little wider no residual shows that bT and bR hold it. Take wider temperatures, or state a "
        "narrower hysteresis that is known (hysteresis_width)."
    )
    names = tuple(c.name for c in found if c.name[0] == "b" and c.name.partition("_")[0][2:] in ("T", "H", "R"))
    return [Reason("thermal.narrow", text, BOTH, names, severity="doubt")]
