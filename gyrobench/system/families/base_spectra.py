"""Spectra of a vibrating base by name.

vehicle, ship, helicopter, aircraft: examples of our own, of a plausible size and from no source; take those of your
carrier.  truck: acceleration of a cargo on a truck on a highway, MIL-STD-810F figure 514.5C-1 (1.04, 0.20, 0.74 g rms
vertical, transverse, longitudinal), which has no angular rates.
"""

from __future__ import annotations

import math

import numpy as np

from gyrobench.arrays import Array
from gyrobench.frames import G0
from gyrobench.record.vibration_spectrum import VibrationSpectrum

DEG2 = math.radians(1.0) ** 2


def _rates(points: list[tuple[float, float, float, float]]) -> VibrationSpectrum:
    """Return the spectrum of rows Hz, and (deg/s)2/Hz about x, y, z."""
    table = np.array(points)
    return VibrationSpectrum(table[:, 0], table[:, 1:].T * DEG2)


def _truck() -> VibrationSpectrum:
    """Return g2/Hz of the three axes on the frequencies of all of them, SI."""
    axes = {
        "x": [(10, 0.00013), (20, 0.00065), (30, 0.00065), (78, 0.00002), (79, 0.00019), (120, 0.00019),
              (500, 0.00001)],
        "y": [(10, 0.0065), (20, 0.0065), (120, 0.0002), (121, 0.003), (200, 0.003), (240, 0.0015), (340, 0.00003),
              (500, 0.00015)],
        "z": [(10, 0.015), (40, 0.015), (500, 0.00015)],
    }  # fmt: skip
    f: Array = np.array(sorted({float(x) for rows in axes.values() for x, _ in rows}))
    density = [np.exp(np.interp(np.log(f), *np.log(np.array(rows)).T)) for rows in axes.values()]
    return VibrationSpectrum(f, np.zeros((3, f.size)), np.array(density) * G0**2)


SPECTRA = {
    "vehicle": _rates([(0.2, 0.5, 0.5, 0.2), (1.0, 2.0, 2.0, 0.5), (3.0, 2.0, 2.0, 0.5), (10.0, 0.05, 0.05, 0.02),
                       (30.0, 0.005, 0.005, 0.002), (100.0, 2e-4, 2e-4, 1e-4)]),
    "ship": _rates([(0.05, 1.0, 10.0, 0.2), (0.12, 20.0, 60.0, 2.0), (0.3, 0.5, 0.5, 0.1), (5.0, 1e-3, 1e-3, 1e-3),
                    (50.0, 1e-4, 1e-4, 1e-4)]),
    "helicopter": _rates([(0.1, 2.0, 3.0, 1.0), (1.0, 0.5, 0.5, 0.3), (4.5, 0.02, 0.02, 0.02), (5.0, 2.0, 2.0, 1.0),
                          (5.5, 0.02, 0.02, 0.02), (18.0, 0.01, 0.01, 0.01), (20.0, 0.5, 0.5, 0.3),
                          (22.0, 0.01, 0.01, 0.01), (100.0, 1e-3, 1e-3, 1e-3)]),
    "aircraft": _rates([(0.05, 2.0, 5.0, 1.0), (0.5, 1.0, 2.0, 0.5), (5.0, 0.01, 0.02, 0.01),
                        (100.0, 1e-4, 1e-4, 1e-4)]),
    "truck": _truck(),
}  # fmt: skip
