"""Bandwidth of a rate gyro: points of unknown noise, notches, bands that begin too high; written from the equations."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from gyrobench.system.system import load_system

NAME = "gyro_bandwidth"
RESPONSE: Any = importlib.import_module(".response", type(load_system(NAME)).__module__)


def butterworth(f: np.ndarray, order: int, bandwidth: float) -> np.ndarray:
    b, a = signal.butter(order, 2.0 * math.pi * bandwidth, analog=True)
    return np.asarray(signal.freqs(b, a, 2.0 * math.pi * f)[1])


def figures(value: np.ndarray, f: np.ndarray) -> Any:
    """Figures of points that state no u, as of a record: by their scatter, in two passes."""
    r = RESPONSE.GyroResponse.of(f, value, np.full(f.size, 1e-3), 0.0, False)
    first = RESPONSE.figures(r).curve
    return RESPONSE.figures(replace(r, u=r.u * math.sqrt(first.chi2 / first.dof)))


@pytest.mark.long
def test_noise_that_grows_with_the_frequency_and_that_nobody_states() -> None:
    """0.01 % at low frequency, 0.9 % at 200 Hz: by one scatter for all points u of f_90, 50 Hz of a Butterworth of
    order 2, was 3.3 times too small (rms of z), of the order 2.0 times, of f_3dB 1.8 times.
    """
    f = np.geomspace(1.0, 200.0, 16)
    true = np.array([1.0, 50.0, 50.0, math.sqrt(2.0) / (100.0 * math.pi), 2.0])
    z = []
    for seed in range(30):
        rng = np.random.default_rng(seed)
        noise = 1e-4 * (1.0 + (f / 10.0) ** 1.5) * (rng.normal(size=16) + 1j * rng.normal(size=16))
        r = figures(butterworth(f, 2, 50.0) * np.exp(noise), f)
        z.append((r.value - true) / r.u)
    rms = np.sqrt(np.mean(np.square(z), axis=0))
    assert np.all(rms < 1.3) and np.all(rms > 0.4)


def test_a_notch_beside_five_poles() -> None:
    """(1 + 0.06 x + x2)/(1 + 0.6 x + x2), x = s/100 Hz: poles by twos left it with the curve of four, 130 noises off.

    Its delay is 0.54/(2 pi 100) s, and that of the five poles (2 (0.809 + 0.309) + 1)/(2 pi 60) s = 3.236/(2 pi 60) s.
    """
    rng, f = np.random.default_rng(1), np.geomspace(2.0, 130.0, 21)
    x = 1j * f / 100.0
    notch = (1.0 + 0.06 * x + x * x) / (1.0 + 0.6 * x + x * x)
    value = butterworth(f, 5, 60.0) * notch * np.exp(1e-4 * (rng.normal(size=21) + 1j * rng.normal(size=21)))
    r = RESPONSE.figures(RESPONSE.GyroResponse.of(f, value, np.full(21, 1e-4)))
    assert r.curve.shape == (5, True) and r.curve.chi2 < 2.0 * r.curve.dof
    delay = 3.23607 / (120.0 * math.pi) + 0.54 / (200.0 * math.pi)
    assert r.value[3] == pytest.approx(delay, abs=4.0 * r.u[3]) and r.u[3] < 1e-6


@pytest.mark.parametrize(("lowest", "said"), [(1.0, False), (60.0, True)])
def test_a_gain_at_low_frequency_that_no_point_has(tmp_path: Path, lowest: float, said: bool) -> None:
    """A filter of 50 Hz, measured from 60 Hz on: K and f_3dB are those of the curve alone."""
    rng, f = np.random.default_rng(2), np.geomspace(lowest, 300.0, 16)
    h = butterworth(f, 2, 50.0) * np.exp(1e-3 * (rng.normal(size=16) + 1j * rng.normal(size=16)))
    rows = np.column_stack([f, np.full(16, 10.0), 10.0 * np.abs(h), np.degrees(np.unwrap(np.angle(h)))])
    file = tmp_path / "r.csv"
    head = "# type_b = none\n# arrangement = checked\nfrequency [Hz],table [deg/s],gyro [deg/s],phase [deg]"
    np.savetxt(file, rows, "%.9g", ",", header=head, comments="")
    system = load_system(NAME)
    result = system.reduce(system.read_measured(file, {}))
    assert ("response.loose" in {r.id for r in result.reasons if r.severity == "doubt"}) == said
