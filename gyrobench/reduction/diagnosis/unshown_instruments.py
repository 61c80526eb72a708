"""Mistakes of tests of rate gyros and inertial units that no residual shows: on a shaker, of a thermometer, of a unit
on a table or put up by hand.

As those of :mod:`gyrobench.reduction.diagnosis.unshown`, which joins them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from gyrobench.arrays import Array
from gyrobench.frames import EARTH_RATE
from gyrobench.record.record import Record
from gyrobench.reduction.diagnosis.handling_candidates import TIMES, changed
from gyrobench.reduction.diagnosis.handling_errors import HandlingCandidate, with_options
from gyrobench.reduction.drift.late_temperature import following
from gyrobench.reduction.estimation.sentences import plain
from gyrobench.reduction.setup.conditions import SHAKEN
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.units import DEG

LEAN, TOO_LARGE, SMALL = DEG, 1.02, 1e-3
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


def inertial(record: Record) -> Iterator[HandlingCandidate]:
    """Three gyros and three accelerometers: gravity off; on a table the case turned on its plate, the clock off by so
    little that the Earth rate does not show it.
    """
    w, options = record.windows, record.run.options
    if "mean_ax" not in w:
        return
    if not options.get("u_gravity"):
        gravity = {"gravity": (1.0 + SMALL) * Location.of(record.run).gravity}
        yield HandlingCandidate("gravity, or the accelerometers, wrong by 0.1 %", with_options(record, gravity))
    if "outer_start" not in w:
        return
    if not options.get("u_mount"):
        c, s = math.cos(LEAN), math.sin(LEAN)
        pairs = [(np.asarray(w[f"mean_{k}x"]), np.asarray(w[f"mean_{k}y"]), k) for k in "ga"]
        turned = {f"mean_{k}{a}": v for x, y, k in pairs for a, v in (("x", c * x + s * y), ("y", c * y - s * x))}
        yield HandlingCandidate("the case turned by 1° on its plate", changed(record, **turned))
    if not options.get("u_time"):
        times = {n: (1.0 + SMALL) * np.asarray(w[n], dtype=float) for n in TIMES}
        yield HandlingCandidate("the times wrong by 0.1 %", changed(record, **times))


def by_hand(record: Record) -> Iterator[HandlingCandidate]:
    """The same unit as a logger has it, means and the gyros' samples alike: columns exchanged or reversed, scale and
    clock off.
    """
    w, run = record.windows, record.run
    samples = [f"imu.rate[{k}]" for k in (1, 2, 3)]

    def read(kind: str, triad: Array, times: float = 1.0) -> Record:
        means = [f"mean_{kind}{a}" for a in "xyz"]
        windows = {**w, **dict(zip(means, triad @ np.array([w[n] for n in means]), strict=True))}
        windows |= {n: times * np.asarray(w[n], dtype=float) for n in TIMES}
        channels = {**record.channels, "time": times * np.asarray(record.channels["time"], dtype=float)}
        if kind == "g":
            channels |= dict(zip(samples, triad @ np.array([record.channels[n] for n in samples]), strict=True))
        return Record(windows, channels, run)

    for kind, what in (("g", "gyros"), ("a", "accelerometers")):
        for order in ((1, 0, 2), (0, 2, 1), (2, 1, 0)):
            a, b = (kind + "xyz"[k] for k in range(3) if order[k] != k)
            yield HandlingCandidate(f"the columns {a} and {b} exchanged", read(kind, np.eye(3)[list(order)]))
        yield HandlingCandidate(f"the {what} reversed", read(kind, -np.eye(3)))
    if not run.options.get("u_time"):
        counts = run.window_units.get("mean_gx") == "1"  # whose scale no one states, but that of their times
        other = read("g", np.eye(3), TOO_LARGE) if counts else read("g", TOO_LARGE * np.eye(3))
        yield HandlingCandidate("the gyros, or their times, wrong by 2 %", other)
    yield from inertial(record)


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
    other[f"an instrument {plain(tau, 3)} s behind the temperature"] = following(w, tau)
    for words, read in other.items():
        yield HandlingCandidate(words, changed(record, temperature=read))
