"""Frequency response of the rate gyros of the bench in closed form, as a run on this table shows it.

The table gives the mean rate of each step h: sinc(f h) of the amplitude.  A gyro with states holds it over the step,
sinc(f h) once more; one that shows the mean of the step that ends is late by h/2.  One that gives a sample each
period T and holds it is late by T/2 more, sinc(f T) of the amplitude.  [GYRO-VIBRATORY, GYRO-MEMS]
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.run_document import RunDocument
from gyrobench.reduction.setup.sources import READING_GAIN, READING_LAG

from .response import Logarithm, hold, read_off

MEANS = ("GyroRate", "GyroFog", "GyroLaser")
FILTERED = ("GyroMems", "GyroVibratory", "GyroVibratoryCarrier")


def true_values(run: RunDocument, highest: float, read: Collection[str] = ()) -> Array | None:
    """Return K, f3, f90, delay, order of the gyro of a run; None where its response is not known in closed form.

    read: sources of the table reading (``READING_GAIN.id``, ``READING_LAG.id``) that the response is to have.
    """
    of = response_of(run)
    if of is None:
        return None
    gain, lag = (
        float(run.parameters.get(name, 0.0)) if source.id in read else 0.0
        for name, source in (("table.read_gain", READING_GAIN), ("table.read_lag", READING_LAG))
    )

    def chain(f: Array) -> Array:  # rate_read = (1 + gain) (rate - lag acc)
        reading = (1.0 + gain) * (1.0 - 2j * np.pi * f * lag)
        out: Array = of(f) - np.vstack([np.log(np.abs(reading)), np.angle(reading)])
        return out

    return read_off(chain, highest)


def response_of(run: RunDocument) -> Logarithm | None:
    """Return ln |H| and arg H over f (Hz) of the gyro of a run; None for another gyro, and one that is not linear."""
    p: dict[str, Any] = {n.removeprefix("gyro."): v for n, v in run.parameters.items() if n.startswith("gyro.")}
    name = run.parts["gyro"].name if "gyro" in run.parts else ""
    h = float(run.step or 0.0)
    straight = np.array_equal(np.reshape(p.get("mount", np.eye(3)), (3, 3)), np.eye(3))
    if run.measured or not straight or not h or name not in MEANS + FILTERED or _bent(p):
        return None
    scale = math.log((1.0 + float(np.ravel(p["scale"])[0])) * math.cos(float(np.ravel(p.get("phase_error", 0.0))[0])))
    if "reset_error" in p:
        scale -= math.log(1.0 - float(p["reset_error"]))

    T = float(p.get("period") or 0.0)

    def of(f: Array) -> Array:
        s = 2j * np.pi * f
        out = np.vstack([np.full(f.size, scale) + np.log(np.sinc(f * h)), np.zeros(f.size)])
        if h < T:  # a sample is held
            out += hold(f, T)
        if name in MEANS:
            out[1] -= np.pi * f * h
            return out
        out[0] += np.log(np.sinc(f * h))
        x = s / (2.0 * math.pi * float(p["bandwidth"]))
        _divide(out, 1.0 + math.sqrt(2.0) * x + x * x)
        if "closed" in p and float(p["closed"]) > 0.5:
            _divide(out, 1.0 + s / (2.0 * math.pi * float(p["loop"])))
        elif "closed" in p:
            decay, delta = _modes(p)
            _divide(out, ((s + decay) ** 2 + delta**2) / (decay**2 + delta**2))
            _divide(out, (decay**2 + delta**2) / (s * decay + decay**2 + delta**2))
        return out

    return of


def _divide(out: Array, factor: np.ndarray[Any, Any]) -> None:
    out[0] -= np.log(np.abs(factor))
    out[1] -= np.angle(factor)


def _modes(p: Mapping[str, Any]) -> tuple[float, float]:
    """Return 1/tau and delta of the sense mode at the temperature of the coefficients."""
    return math.pi * (float(p["frequency"]) + float(p["split"])) / float(p["Q"]), 2.0 * math.pi * float(p["split"])


def _bent(p: Mapping[str, Any]) -> bool:
    """Return whether a gyro is not linear, so that it has no transfer function."""
    open_fibre = "depth" in p and float(p.get("closed", 1.0)) < 0.5
    turned = (
        "closed" in p and "split" in p and float(p["closed"]) < 0.5 and np.any(np.asarray(p.get("phase_error", 0.0)))
    )
    known = ("cubic", "hysteresis", "asymmetry", "dead_band", "lock_in", "resolution", "counting")
    return bool(open_fibre or turned) or any(float(p.get(n, 0.0)) != 0.0 for n in known)
