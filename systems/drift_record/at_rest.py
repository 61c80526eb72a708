"""Gravity and the Earth's rate in the means of an instrument at rest: a check of units and of the attitude.

    |f| = g,  |ω| = Ω,  sin φ = ω·f/(|ω| |f|)     of three accelerometers and three gyros with axes x, y, z

f points up and does not depend on the attitude, so that |f| far from g is a unit, a scale factor or an instrument that
is not at rest.  |ω| is the Earth's rate alone where the bias is small beside it; then the angle between both is 90°
less the latitude.  u is that of the means by the noise model of each channel; biases and scale factors are in the
difference from g and Ω, not in u.  [IMU-HAND: the same sizes]

Not modelled: misalignment of the axes, which 1 % of lets |f| stay the same to 10⁻⁴.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.series.channel_units import FORCE, RATE
from gyrobench.result import Reason, Table
from gyrobench.units import DPH, EARTH_RATE, G0

from .channels import RecordChannel, mean_of, triads
from .noise_tables import number

NEAR = 0.1  # of g, bias and scale factor of a triad that is at rest and in its unit
NOTHING = 0.01  # of g: the means were taken out
SEEN = 0.1  # of the Earth's rate: |ω| so near to it is the Earth's
#: true value over the one that was read -> what was mistaken
FORCE_UNITS: Mapping[float, str] = {
    G0: "the values are in g, not in m/s²", 1.0 / G0: "the values are in m/s², not in g",
    1e-3 * G0: "the values are in mg, not in m/s²", 1e-3: "the values are in mg, not in g",
    1e3: "the values are in g, not in mg", 1e-6: "the values are in µg, not in g",
    1e3 / G0: "the values are in m/s², not in mg",
}  # fmt: skip
RATE_UNITS: Mapping[float, str] = {
    math.radians(1.0): "°/s read as rad/s", math.degrees(1.0): "rad/s read as °/s", 1.0 / 3600.0: "°/h read as °/s",
    3600.0: "°/s read as °/h", DPH: "°/h read as rad/s", 1.0 / DPH: "rad/s read as °/h",
}  # fmt: skip


def check(channels: Sequence[RecordChannel], run: RunDocument) -> tuple[list[Table], list[Reason], list[str]]:
    """Return the table of gravity and Earth's rate, warnings of units, and sentences for the summary."""
    rows: list[list[Any]] = []
    reasons, words = list[Reason](), list[str]()
    stated = (run.series or {}).get("stated", [])
    forces = triads(channels, FORCE.words)
    up: Array | None = None
    for triad in forces:
        f, u = mean_of(triad)
        row, reason, direction = _gravity(triad, f, u, run, stated)
        rows += row
        reasons += reason
        up = direction if up is None else up
    if not forces:
        reasons += _single(channels)
    for triad in triads(channels, RATE.words):
        row, said = _earth(triad, up if len(forces) == 1 else None, run, stated)
        rows += row
        words += said
    head = ["quantity", "measured", "u by noise", "expected", "unit", "finding"]
    caption = (
        "Means of the record beside gravity and the Earth's rate; biases and scale factors are in the difference, u is "
        "that of the noise alone"
    )
    return ([Table("at_rest", "Gravity and Earth's rate", caption, head, rows)] if rows else []), reasons, words


def _names(triad: Sequence[RecordChannel]) -> str:
    return ", ".join(c.name for c in triad)


def _gravity(
    triad: Sequence[RecordChannel], f: Array, u: Array, run: RunDocument, stated: Sequence[str]
) -> tuple[list[list[Any]], list[Reason], Array | None]:
    """Return the rows of a triad of accelerometers, warnings, and the direction of up in its axes."""
    size = float(np.linalg.norm(f))
    u_size = float(np.linalg.norm(f * u)) / size if size > 0.0 else 0.0
    g, of = G0, "standard gravity, no site was stated"
    if "gravity" in stated:
        g, of = float(run.options["gravity"]), "gravity as stated"
    elif "latitude" in stated:
        height = float(run.options.get("height", 0.0))
        g, of = frames.normal_gravity(float(run.options["latitude"]), height), "normal gravity of the latitude"
    ratio = size / g
    if abs(ratio - 1.0) < NEAR:
        finding = f"{number(1e3 * (size - g) / G0)} mg from {of}: bias and scale factor"
        up = f / size
        slope = ", ".join(f"{c.name} {number(math.degrees(math.asin(x)))}°" for c, x in zip(triad, up, strict=True))
        rows: list[list[Any]] = [[f"|f| of {_names(triad)}", size, u_size, g, "m/s²", finding],
                ["elevation of the axes", None, None, None, "°", f"{slope}; 1 mg of bias is 3.4′"]]  # fmt: skip
        return rows, [], up
    finding = _mistaken(ratio, FORCE_UNITS)
    other = "the mean was taken out" if ratio < NOTHING else "not gravity"
    text = f"|f| of {_names(triad)} is {number(size)} m/s², {number(ratio)} times gravity: "
    if finding:
        text += f"{finding}? Correct it in the file or the column map: "
        text += "the coefficients of these channels are off by as much."
    elif ratio < NOTHING:
        text += f"{other}, so that nothing checks their unit and the attitude."
    else:
        text += f"{other}. Check unit, scale and names of the axes; if they are right it was not at rest."
    row = [f"|f| of {_names(triad)}", size, u_size, g, "m/s²", finding or other]
    return [row], [_reason("gravity", text, triad)], None


def _single(channels: Sequence[RecordChannel]) -> list[Reason]:
    """Return that accelerometers that are no triad read more than gravity."""
    over = [c for c in channels if c.units == FORCE and abs(c.mean) > (1.0 + NEAR) * G0]
    return [
        _reason("gravity", f"{c.name} reads {number(c.mean)} m/s² at rest, {number(abs(c.mean) / G0)} times gravity: "
                "its unit or its scale is mistaken.", [c])
        for c in over
    ]  # fmt: skip


def _rate(x: float) -> str:
    return f"{number(x / DPH)} °/h" if x < math.radians(0.1) else f"{number(math.degrees(x))} °/s"


def _mistaken(ratio: float, of: Mapping[float, str]) -> str:
    """Return which mistaken unit makes a size ``ratio`` times what it should be; "" for none."""
    return next((words for factor, words in of.items() if abs(ratio * factor - 1.0) < NEAR), "")


def _reason(id: str, text: str, of: Sequence[RecordChannel]) -> Reason:
    names = tuple(c.name for channel in of for c in channel.coefficients)
    return Reason(f"drift_record.{id}", text, ("pass", "fail"), names)


def _earth(
    triad: Sequence[RecordChannel], up: Array | None, run: RunDocument, stated: Sequence[str]
) -> tuple[list[list[Any]], list[str]]:
    """Return the rows of a triad of gyros, and what is to be said of them."""
    w, u = mean_of(triad)
    size = float(np.linalg.norm(w))
    u_size = float(np.linalg.norm(w * u)) / size if size > 0.0 else 0.0
    ratio = size / EARTH_RATE
    told = f"|ω| of {_names(triad)}"
    rows: list[list[Any]] = [[told, size / DPH, u_size / DPH, EARTH_RATE / DPH, "°/h", ""]]
    if abs(ratio - 1.0) > SEEN:
        if ratio > 1.0:
            finding = "a bias hides it, neither attitude nor latitude follows from the gyros"
        else:
            finding = "a bias against it, or a mistaken unit"
        also = f"; or {unit}" if (unit := _mistaken(ratio, RATE_UNITS)) else ""
        rows[0][-1] = f"{number(ratio)} times Ω, {finding}{also}"
        sentence = f"{told} is {_rate(size)}, {number(ratio)} times the Earth's rate: {finding}{also}."
        return rows, [sentence]
    rows[0][-1] = f"{number(ratio)} times Ω: the Earth's rate, gyros in their unit"
    words = [f"{told} is {number(size / DPH, u_size / DPH)} °/h, the Earth's rate {EARTH_RATE / DPH:.2f} °/h."]
    if up is None:
        return rows, words
    vertical = float(w @ up)
    sine = float(np.clip(vertical / size, -1.0, 1.0))
    across = up - sine * w / size  # an error of ω along it turns ω towards the vertical
    across /= max(float(np.linalg.norm(across)), 1e-12)
    latitude, spread = math.degrees(math.asin(sine)), math.degrees(float(np.linalg.norm(across * u)) / size)
    known = "latitude" in stated
    there = float(run.options["latitude"]) if known else None
    rows.append(["vertical component of ω", vertical / DPH, float(np.sqrt((up * u) @ (up * u))) / DPH,
                 None if there is None else EARTH_RATE / DPH * math.sin(there), "°/h",
                 "Ω sin φ of the latitude as stated" if known else "no latitude was stated"])  # fmt: skip
    rows.append(["latitude φ, sin φ = ω·f/(|ω| |f|)", latitude, spread,
                 None if there is None else math.degrees(there), "°", "as far as the gyros have no bias"])  # fmt: skip
    words[0] += (
        f" With the direction of gravity that is the latitude {number(latitude, spread)}°, "
        f"u = {number(spread, spread)}° by the noise alone, as far as the gyros have no bias."
    )
    return rows, words
