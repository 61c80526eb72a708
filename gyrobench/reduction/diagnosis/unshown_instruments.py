"""Mistakes of tests of rate gyros and inertial units that no residual shows: on a shaker, and of a thermometer.

As those of :mod:`gyrobench.reduction.diagnosis.unshown`, which joins them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from gyrobench.arrays import Array
from gyrobench.frames import EARTH_RATE
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis.handling_candidates import changed
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate
from gyrobench.reduction.drift.late_temperature import following
from gyrobench.reduction.setup.conditions import SHAKEN
from gyrobench.units import DEG

LEAN, TOO_LARGE = DEG, 1.02
ICE, FREEZING, STEPS = 273.15, 32.0, 1.8  # K, °F, °F of a kelvin


def shaken(record: Record) -> Iterator[HandlingCandidate]:
    """A gyro and an accelerometer on a shaker: turned over the other way, lying where the Earth rate is another one,
    its readings in another scale, leaning with the axis up alone.
    """
    w, options = record.windows, record.run.options
    rate_name, level = SHAKEN
    if level not in w or "up" not in w:
        return
    up, latitude = np.asarray(w["up"], dtype=float), float(options["latitude"])
    if np.unique(up).size == 2 and "force" not in w:  # whose scale factor names it
        yield HandlingCandidate("up and down exchanged", changed(record, up=-up))
    if rate_name in w:
        rate = np.asarray(w[rate_name], dtype=float)
        if options.get("axis") == "x":
            vertical = EARTH_RATE * math.sin(latitude)
            words = "the axis x of the gyro level, or the Earth rate taken off before"
            yield HandlingCandidate(words, changed(record, **{rate_name: rate + vertical * up}))
        else:
            for words, sign in (("", np.ones_like(up)), (", down to the south", up)):
                found = changed(record, **{rate_name: rate - EARTH_RATE * math.cos(latitude) * sign})
                yield HandlingCandidate(f"the axis x of the gyro to the north{words}", found)
        yield HandlingCandidate("the rates wrong by 2 %", changed(record, **{rate_name: TOO_LARGE * rate}))
    if options.get("u_lean"):
        return
    seen = max(math.cos(latitude), 0.0 if options.get("axis") == "x" else abs(math.sin(latitude)))
    moved: dict[str, Array] = {}
    if rate_name in w:
        moved[rate_name] = np.asarray(w[rate_name], dtype=float) - math.sin(LEAN) * EARTH_RATE * seen * (up > 0.0)
    if "force" in w:
        moved["force"] = np.asarray(w["force"], dtype=float) * np.where(up > 0.0, math.cos(LEAN), 1.0)
    yield HandlingCandidate("a lean of the instruments by 1° with the axis up", changed(record, **moved))


def moved(record: Record) -> Iterator[HandlingCandidate]:
    """A gyro that is read from turn-on to turn-on, and stands otherwise from the middle one on."""
    w = record.windows
    numbers = list(dict.fromkeys(np.asarray(w["turn_on"]).tolist())) if "turn_on" in w and "mean" in w else []
    if len(numbers) > 1:
        first = numbers[len(numbers) // 2]
        later = np.isin(w["turn_on"], numbers[len(numbers) // 2 :])
        mean = np.asarray(w["mean"], dtype=float) + math.sin(LEAN) * EARTH_RATE * later
        yield HandlingCandidate(f"another attitude, by 1°, from turn-on {first:g} on", changed(record, mean=mean))


def warmed(record: Record) -> Iterator[HandlingCandidate]:
    """A thermometer on which coefficients over the temperature rest: in °F, reversed about the reference, standing
    where the changes are other ones, ahead of the instrument.
    """
    w, options = record.windows, record.run.options
    if "temperature" not in w or not (options.get("thermal") or "since" in w):
        return
    T = np.asarray(w["temperature"], dtype=float)
    reference = float(options.get("reference", 0.0)) or float(np.mean(T))
    other = {
        "the temperatures in °F and given as °C": (T - ICE - FREEZING) / STEPS + ICE,
        "the changes of the temperature wrong by 2 %": reference + TOO_LARGE * (T - reference),
    }
    if "since" in w:
        tau = float(np.max(w["since"]))
    else:
        other["the temperature wrong by 1 K"] = T + 1.0
        other["the sign of the changes of the temperature reversed"] = 2.0 * reference - T
        tau = float(np.median(np.diff(w["t_start"])))
    other[f"an instrument {tau:.3g} s behind the temperature"] = following(w, tau)
    for words, read in other.items():
        yield HandlingCandidate(words, changed(record, temperature=read))
