"""Files of warm-ups, of a g-sensitivity and of a drift record, written from the equations, and mistakes in them."""

from __future__ import annotations

import math

import numpy as np
from instrument_sheets import Columns, Mistake, Sheet, table_of, times

from gyrobench.frames import G0

NOISE = 0.02  # deg/h
WARM = "t_start [s],t_end [s],turn_on,day,since [s],mean [deg/h],temperature [degC]"
MEAN, SINCE = "mean [deg/h]", "since [s]"


def warm_up() -> Columns:
    """Eight turn-ons on four days: 5 deg/h, 12 exp(-t/60 s) when switched on, 0.1 deg/h/K."""
    rng = np.random.default_rng(21)
    out = []
    for k in range(8):
        T = 20.0 + 3.0 * rng.normal()
        own = 5.0 + 0.05 * rng.normal() + 0.1 * (T - 20.0)
        for j in range(30):
            since = 5.0 + 10.0 * j
            mean = own + 12.0 * 6.0 * (math.exp(-(since - 5.0) / 60.0) - math.exp(-(since + 5.0) / 60.0))
            t = 5000.0 * k + since
            out.append([t - 5.0, t + 5.0, k + 1, 1 + k // 2, since, mean + NOISE * rng.normal(), T])
    return table_of(WARM, out)


def counted_on(c: Columns) -> None:
    """The time since the first turn-on of each day, not reset at the second."""
    c[SINCE] = c[SINCE] + np.where(c["turn_on"] % 2 == 0, 5000.0, 0.0)


def from_first_reading(c: Columns) -> None:
    """The first minute was not read, and the time counted from the first reading."""
    keep = c[SINCE] > 60.0
    for n in c:
        c[n] = c[n][keep]
    c[SINCE] = c[SINCE] - 60.0


def clipped(c: Columns) -> None:
    c[MEAN] = np.minimum(c[MEAN], 12.0)


def fahrenheit(c: Columns) -> None:
    c["temperature [degC]"] = 1.8 * c["temperature [degC]"] + 32.0


def moved(c: Columns) -> None:
    """From the fifth turn-on on another attitude: another part of the Earth rate."""
    c[MEAN] = c[MEAN] + np.where(c["turn_on"] > 4, 2.0, 0.0)


def cut_short(c: Columns) -> None:
    keep = c[SINCE] < 60.0
    for n in c:
        c[n] = c[n][keep]


def mixed(c: Columns) -> None:
    """Rows of the second and the third turn-on in one another's place."""
    a, b = (np.flatnonzero(c["turn_on"] == k)[:8] for k in (2, 3))
    c[MEAN][a], c[MEAN][b] = c[MEAN][b], c[MEAN][a].copy()


WARM_UP = Sheet(
    "warm_up", "turn_on_repeatability", "# limit = 0.2deg/h\n", warm_up,
    (
        Mistake("sign", "readings reversed", "reading reversed", times(-1.0, MEAN)),
        Mistake("unit", "°/s under °/h", "readings wrong|unit", times(1.0 / 3600.0, MEAN)),
        Mistake("unit", "°F under °C", "°F", fahrenheit),
        Mistake("row late", "since not reset at the second turn-on of a day", "stayed on|since", counted_on),
        Mistake("not settled", "since counted from the first reading, a minute late", "since the turn-on short",
                from_first_reading),
        Mistake("saturation", "readings held at 12 °/h", "a range was reached", clipped),
        Mistake("not settled", "each turn-on left after a time constant", "longer|within the record", cut_short),
        Mistake("axis exchanged", "another attitude from the fifth turn-on on", "another attitude", moved),
        Mistake("position forgotten", "readings of two turn-ons mixed", "exchanged|from turn-on to turn-on", mixed),
    ),
)  # fmt: skip

LEVEL = "t_start [s],t_end [s],up,level [g],rate [deg/h]"
RATE = "rate [deg/h]"
EARTH, LATITUDE = 15.0411, 45.0  # deg/h, deg
VERTICAL = EARTH * math.sin(math.radians(LATITUDE))


def shaken() -> Columns:
    """The axis x up, then down: 4 + 12 f + 3 (f2 + s2) deg/h and the vertical Earth rate."""
    rng, out, t = np.random.default_rng(23), [], 0.0
    for way in (1.0, -1.0):
        for s in (0.0, 1.0, 2.0, 3.0) * 3:
            rate = 4.0 + 12.0 * way + 3.0 * (1.0 + s * s) + VERTICAL * way
            out.append([t, t + 10.0, way, s, rate + 0.1 * rng.normal()])
            t += 12.0
    return table_of(LEVEL, out)


def earth_taken_off(c: Columns) -> None:
    c[RATE] = c[RATE] - VERTICAL * c["up"]


def other_row(c: Columns) -> None:
    """The gyro about y was read, which lies level: another g-sensitivity, without the Earth rate."""
    c[RATE] = -2.0 + 5.0 * c["up"] + 1.0 * (1.0 + c["level [g]"] ** 2) + 0.1 * np.random.default_rng(5).normal(
        size=c[RATE].size
    )  # fmt: skip


def not_turned(c: Columns) -> None:
    down = c["up"] < 0.0
    c[RATE][down] = c[RATE][~down] + 0.1 * np.random.default_rng(6).normal(size=int(down.sum()))


SENSITIVITY = Sheet(
    "gyro_g_sensitivity", "vibration_rectification",
    f"# latitude = {LATITUDE:g}deg\n# gravity = {G0}\n# axis = x\n", shaken,
    (
        Mistake("axis exchanged", "the gyro about y was read", "another gyro", other_row),
        Mistake("sign", "rates reversed", "rate reversed|reading reversed", times(-1.0, RATE)),
        Mistake("sign", "up and down exchanged", "up and down", times(-1.0, "up")),
        Mistake("unit", "°/s under °/h", "readings wrong|rates wrong|unit", times(1.0 / 3600.0, RATE)),
        Mistake("unit", "levels in m/s² under g", "levels of vibration wrong", times(G0, "level [g]")),
        Mistake("position forgotten", "not turned over", "not turned over", not_turned),
        Mistake("axis exchanged", "the Earth rate had been taken off", "Earth rate", earth_taken_off),
    ),
)  # fmt: skip

DRIFT, HZ = "rate [deg/h]", 10.0


def at_rest() -> Columns:
    """Half an hour at 10 Hz: 3 deg/h, white noise of 10 deg/h a sample, Gauss-Markov drift of 1 deg/h and 60 s."""
    rng, n = np.random.default_rng(31), 18000
    slow, decay = np.empty(n), math.exp(-1.0 / (60.0 * HZ))
    slow[0] = rng.normal()
    shock = math.sqrt(1.0 - decay**2) * rng.normal(size=n)
    for k in range(1, n):
        slow[k] = decay * slow[k - 1] + shock[k]
    return {"time [s]": np.arange(n) / HZ, DRIFT: 3.0 + slow + 10.0 * rng.normal(size=n)}


def spikes(c: Columns) -> None:
    rng = np.random.default_rng(7)
    c[DRIFT][rng.choice(c[DRIFT].size, 30, replace=False)] += 300.0 * rng.choice([-1.0, 1.0], 30)


def hum(c: Columns) -> None:
    """50.3 Hz at 10 Hz, without a filter: seen at 0.3 Hz."""
    c[DRIFT] = c[DRIFT] + 5.0 * np.sin(2.0 * math.pi * 50.3 * c["time [s]"])


def coarse(c: Columns) -> None:
    c[DRIFT] = 40.0 * np.round(c[DRIFT] / 40.0)


def saturated(c: Columns) -> None:
    c[DRIFT] = np.clip(c[DRIFT], -12.0, 12.0)


def held(c: Columns) -> None:
    c[DRIFT] = np.repeat(c[DRIFT][::4], 4)[: c[DRIFT].size]


def other_header(c: Columns) -> None:
    c["time [s]"] = 2.0 * c["time [s]"]


DRIFT_RECORD = Sheet(
    "drift_record", "drift_record", "", at_rest,
    (
        Mistake("spikes", "30 wild samples of 30 standard deviations", "wild", spikes),
        Mistake("unit", "half of the true sampling rate in the times", "times wrong|sampling", other_header),
        Mistake("line", "50 Hz aliased to 0.3 Hz", "line|alias", hum),
        Mistake("rounding", "steps of four standard deviations", "round|coarse|steps", coarse),
        Mistake("saturation", "clipped at 1.2 standard deviations", "largest or smallest value", saturated),
        Mistake("row late", "each sample held for four rows", "held|repeat", held),
        Mistake("sign", "readings reversed", "reversed", times(-1.0, DRIFT)),
        Mistake("unit", "°/s under °/h", "unit", times(1.0 / 3600.0, DRIFT)),
    ),
)  # fmt: skip
