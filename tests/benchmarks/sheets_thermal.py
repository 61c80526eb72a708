"""Files of an inertial unit in a chamber, written from the equations, and mistakes that they may have."""

from __future__ import annotations

import numpy as np
import test_imu_thermal
from instrument_sheets import UNITS, A, Columns, G, Mistake, Sheet, exchange, times

T = "temperature [degC]"
REFERENCE, LAG, STEP = 25.0, 300.0, 5.0  # degC, s


def in_chamber() -> Columns:
    w, _ = test_imu_thermal.heated(5, 6, test_imu_thermal.white(5))
    return {n + u: np.asarray(w[n], dtype=float) for n, u in UNITS.items()} | {T: w["temperature"] + REFERENCE}


def late(c: Columns) -> None:
    """The thermometer of the chamber: the unit follows it late, as one of first order."""
    t = 0.5 * (c["t_start [s]"] + c["t_end [s]"])
    fine = np.arange(t[0], t[-1], STEP)
    unit = np.interp(fine, t, c[T])
    c[T] = np.interp(t, fine, unit + LAG * np.gradient(unit, STEP))  # what the unit follows


def elsewhere(c: Columns) -> None:
    c[T] = REFERENCE + 0.8 * (c[T] - REFERENCE)


def fahrenheit(c: Columns) -> None:
    c[T] = 1.8 * c[T] + 32.0


def of_the_room(c: Columns) -> None:
    c[T] = 22.0 + 0.3 * np.random.default_rng(3).normal(size=c[T].size)


def mirrored(c: Columns) -> None:
    c[T] = 2.0 * REFERENCE - c[T]


def exchanged_ramps(c: Columns) -> None:
    """The temperatures of the way up stand where those of the way down were, and the other way round."""
    c[T] = c[T][::-1].copy()


def second_cycle(c: Columns) -> None:
    """Two positions of the second cycle in the other order than written down: their readings exchanged."""
    rows = np.flatnonzero(np.diff(c["phase"], prepend=-1) != 0)
    first, second = rows[6 * 2], rows[6 * 2 + 3]  # twelve phases a cycle: x to y
    for n in (*G, *A):
        for k in range(2):
            c[n][first + k], c[n][second + k] = c[n][second + k], c[n][first + k]


def clock(c: Columns) -> None:
    """The clock of the thermometer is ten minutes late."""
    t = 0.5 * (c["t_start [s]"] + c["t_end [s]"])
    c[T] = np.interp(t - 600.0, t, c[T])


def zero_of_thermometer(c: Columns) -> None:
    c[T] = c[T] + 3.0


THERMAL = Sheet(
    "imu_thermal", "imu_positions",
    f"# latitude = 40.10704566deg\n# gravity = 9.805m/s2\n# thermal = true\n# reference = {REFERENCE:g}degC\n"
    "# nuisances = none\n",
    in_chamber,
    (
        Mistake("not settled", "the unit follows the thermometer 300 s late", "late", late),
        Mistake("temperature", "the thermometer stood where it changes by 0.8", "temperature", elsewhere),
        Mistake("temperature", "its zero off by 3 K", "temperature", zero_of_thermometer),
        Mistake("temperature", "that of the room was read", "of the room", of_the_room),
        Mistake("unit", "°F under °C", "°F", fahrenheit),
        Mistake("sign", "the temperatures reversed about the reference", "temperature", mirrored),
        Mistake("row late", "heating and cooling exchanged", "temperature", exchanged_ramps),
        Mistake("row late", "the clock of the thermometer 10 min late", "temperature", clock),
        Mistake("row late", "positions 13 and 16 of the second cycle exchanged", "positions", second_cycle),
        Mistake("axis exchanged", "gyros x and y exchanged", "x and y are exchanged", exchange((G[0], G[1]))),
        Mistake("left-handed", "gyro z reversed", "left-handed", times(-1.0, G[2])),
        Mistake("unit", "t in min under s", "time", times(1.0 / 60.0, "t_start [s]", "t_end [s]")),
    ),
)  # fmt: skip
