"""Files of tests of rate gyros and inertial units, written from the equations, and mistakes that they may have."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).parents[1] / "systems"))
import test_coning
import test_gyro_bandwidth
import test_imu_positions
import test_imu_up_down
import test_rate_table
import test_sculling
import test_turn_on_repeatability
import test_vibration_rectification
from imu_world import EDGES, FACES, Unit, World, handled, plan, poses
from scipy.spatial.transform import Rotation

from gyrobench.frames import G0

KINDS = ("axis exchanged", "left-handed", "sign", "unit", "position forgotten", "row late", "not settled", "bump")
Columns = dict[str, np.ndarray]
Change = Callable[[Columns], None]


@dataclass(frozen=True)
class Mistake:
    """kind: of KINDS.  what: said in the table.  words: pattern of the reason that names it, or asks for it."""

    kind: str
    what: str
    words: str
    change: Change


@dataclass(frozen=True)
class Sheet:
    """A test, how its clean file is written, and the mistakes that it may have."""

    name: str
    system: str
    head: str
    columns: Callable[[], Columns]
    mistakes: tuple[Mistake, ...]


# ------------------------------------------------------------------------------------------------ changes
def times(factor: float, *names: str) -> Change:
    def change(c: Columns) -> None:
        for n in names:
            c[n] = factor * c[n]

    return change


def exchange(*pairs: tuple[str, str]) -> Change:
    def change(c: Columns) -> None:
        for a, b in pairs:
            c[a], c[b] = c[b], c[a]

    return change


def copied(first: int, source: int, count: int, *names: str) -> Change:
    """Rows from first on read as those from source on, but for noise of theirs: half as much beside."""

    def change(c: Columns) -> None:
        rng = np.random.default_rng(1)
        for n in names:
            own = c[n][source : source + count]
            c[n][first : first + count] = own + 0.5 * np.std(own) * rng.normal(size=count)

    return change


def knocked(first: int, by: float, name: str) -> Change:
    """The level of a column is another one from a row on."""

    def change(c: Columns) -> None:
        c[name][first:] += by

    return change


def table_of(names: str, rows: Any) -> Columns:
    return {n.strip(): np.array(v, dtype=float) for n, v in zip(names.split(","), np.transpose(rows), strict=True)}


# ------------------------------------------------------------------------------------------------ the tests
def rate_table() -> Columns:
    rate, mean = test_rate_table.lab(np.random.default_rng(2))
    k = 5.0 * np.arange(rate.size)
    return table_of(test_rate_table.HEAD, np.column_stack([k, k + 5.0, rate, mean]))


def other_gyro(c: Columns) -> None:
    c["mean [deg/s]"] = 1e-3 * c["mean [deg/s]"] + 0.01 * np.random.default_rng(4).normal(size=c["mean [deg/s]"].size)


def part_before(c: Columns) -> None:
    y = c["mean [deg/s]"]
    y[12] += 0.3 * (y[11] - y[12])


RATE = Sheet(
    "rate_table_test", "rate_table_test", "# latitude = 30deg\n", rate_table,
    (
        Mistake("axis exchanged", "the gyro of another axis was read", "times the rate", other_gyro),
        Mistake("sign", "readings reversed", "reversed", times(-1.0, "mean [deg/s]")),
        Mistake("unit", "rad/s under °/s", "rad/s", times(math.pi / 180.0, "mean [deg/s]")),
        Mistake("position forgotten", "a rate left out: the table stayed", "of the rate before",
                copied(12, 10, 2, "mean [deg/s]")),
        Mistake("bump", "the bias another one from row 21 on, by 10 standard deviations", "level of the record",
                knocked(20, 0.1, "mean [deg/s]")),
        Mistake("row late", "a mean that holds 0.3 of the rate before", "row 13 left out .held is 0.3 of the",
                part_before),
    ),
)  # fmt: skip


def turn_ons() -> Columns:
    rows = [row for row in test_turn_on_repeatability.rows(on=0.05) if row[4] < 160.0]
    return table_of(",".join(test_turn_on_repeatability.NAMES), rows)


def stayed_on(c: Columns) -> None:
    """The fourth turn-on was none: no warm-up in it."""
    here = c["turn_on"] == 4
    c["mean [deg/h]"] = np.where(here, c["mean [deg/h]"] - 2.0 * np.exp(-c["since [s]"] / 60.0), c["mean [deg/h]"])


def late_stamp(c: Columns) -> None:
    c["since [s]"] = c["since [s]"] + 10.0


def began_warm(c: Columns) -> None:
    """Of the third turn-on half of the warm-up is gone."""
    half = np.where(c["turn_on"] == 3, np.exp(-c["since [s]"] / 60.0), 0.0)
    c["mean [deg/h]"] = c["mean [deg/h]"] - half


def other_bias(c: Columns) -> None:
    c["mean [deg/h]"] = -7.0 + 0.5 * c["mean [deg/h]"]


TURN_ONS = Sheet(
    "turn_on_repeatability", "turn_on_repeatability", "# limit = 0.2deg/h\n", turn_ons,
    (
        Mistake("axis exchanged", "the gyro of another axis was read, at rest", "another axis", other_bias),
        Mistake("sign", "readings reversed", "reading reversed", times(-1.0, "mean [deg/h]")),
        Mistake("unit", "since in min under s", "unit", times(1.0 / 60.0, "since [s]")),
        Mistake("position forgotten", "a turn-on that was none: it had stayed on", "turn-on 4", stayed_on),
        Mistake("row late", "stamps of the turn-on late by a reading", "short by one reading", late_stamp),
        Mistake("not settled", "a turn-on began before the gyro was cold", "before the gyro was cold", began_warm),
    ),
)  # fmt: skip


def response() -> Columns:
    return table_of(test_gyro_bandwidth.HEAD, test_gyro_bandwidth.rows_of(noise=1e-4))


def _response(k: int) -> str:
    return str(test_gyro_bandwidth.HEAD.split(",")[k])


def phase_turned(c: Columns) -> None:
    c[_response(3)] = c[_response(3)] + 180.0


def sample_late(c: Columns) -> None:
    c[_response(3)] = c[_response(3)] - 360.0 * 1e-3 * c[_response(0)]


def table_falls(c: Columns) -> None:
    c[_response(2)] = c[_response(2)] * (1.0 + 0.04 * (c[_response(0)] / 200.0) ** 2)


BANDWIDTH = Sheet(
    "gyro_bandwidth", "gyro_bandwidth", "", response,
    (
        Mistake("axis exchanged", "the gyro of another axis was read", "times", times(1e-3, _response(2))),
        Mistake("sign", "readings reversed", "reversed", phase_turned),
        Mistake("sign", "a lag given as positive", "opposite sign", times(-1.0, _response(3))),
        Mistake("unit", "°/h under °/s", "°/h", times(3600.0, _response(2))),
        Mistake("unit", "phases in rad under °", "in rad", times(math.pi / 180.0, _response(3))),
        Mistake("unit", "frequencies in rad/s under Hz", "rad/s given as Hz", times(2.0 * math.pi, _response(0))),
        Mistake("row late", "a sample of 1 ms late", "a reading late by", sample_late),
        Mistake("set-up", "amplitude of the table 4 % off at 200 Hz", "an amplitude wrong", table_falls),
        Mistake("position forgotten", "a frequency left out: the generator stayed", "Hz is",
                copied(14, 13, 1, _response(2), _response(3))),
    ),
)  # fmt: skip

CONE = "t_start [s],t_end [s],frequency [Hz],half_angle [deg],drift_x [deg/h],drift_y [deg/h],drift_z [deg/h]"
DRIFTS = tuple(f"drift_{a} [deg/h]" for a in "xyz")
CONING = Sheet(
    "coning_test", "coning_test",
    "# axis = z\n# interval = 10ms\n# bandwidth = 0Hz\n# coning = false\n# samples = 1\n",
    lambda: table_of(CONE, test_coning.rows()),
    (
        Mistake("axis exchanged", "drifts of x and z exchanged", "exchanged", exchange((DRIFTS[0], DRIFTS[2]))),
        Mistake("axis exchanged", "drifts of x and y exchanged", "drift_x and drift_y|x and y exchanged",
                exchange((DRIFTS[0], DRIFTS[1]))),
        Mistake("left-handed", "z reversed alone", "reversed", times(-1.0, DRIFTS[2])),
        Mistake("sign", "all drifts reversed", "reversed", times(-1.0, *DRIFTS)),
        Mistake("unit", "full angle under half-angle", "full angle", times(2.0, "half_angle [deg]")),
        Mistake("unit", "rad/s under Hz", "rad/s", times(2.0 * math.pi, "frequency [Hz]")),
        Mistake("unit", "°/s under °/h", "and drift in the units", times(1.0 / 3600.0, *DRIFTS)),
        Mistake("position forgotten", "a cone left out: the table stayed at rest", "drifts by",
                copied(20, 0, 5, *DRIFTS)),
        Mistake("bump", "the bias of x another one from row 18 on, by 10 standard deviations", "level of the record",
                knocked(17, 0.5, DRIFTS[0])),
    ),
)  # fmt: skip


def flat(c: Columns) -> None:
    y = c["acceleration [ug]"]
    y[:] = 50.0 + 5.0 * np.random.default_rng(2).normal(size=y.size)


SCULL = "t_start [s],t_end [s],frequency [Hz],angle [deg],vibration [m/s2],acceleration [ug]"
SCULLING = Sheet(
    "sculling_test", "sculling_test", "".join(f"# {x}\n" for x in test_sculling.HEAD),
    lambda: table_of(SCULL, test_sculling.rows()),
    (
        Mistake("axis exchanged", "the acceleration along another axis: without the rise", "computed acceleration is",
                flat),
        Mistake("sign", "acceleration positive downwards", "positive downwards", times(-1.0, "acceleration [ug]")),
        Mistake("unit", "mg under µg", "and acceleration in the units", times(1e-3, "acceleration [ug]")),
        Mistake("unit", "rad/s under Hz", "rad/s", times(2.0 * math.pi, "frequency [Hz]")),
        Mistake("unit", "peak to peak under amplitudes", "amplitudes",
                times(2.0, "angle [deg]", "vibration [m/s2]")),
        Mistake("position forgotten", "a motion left out: the table stayed at rest", "computed acceleration is",
                copied(20, 0, 5, "acceleration [ug]")),
        Mistake("bump", "the bias another one from row 18 on, by 10 standard deviations", "level of the record",
                knocked(17, 50.0, "acceleration [ug]")),
    ),
)  # fmt: skip

LEVEL = "t_start [s],t_end [s],up,level [g],rate [deg/h],force [g]"


def level_late(c: Columns) -> None:
    """A reading lacks 2 % of the step of the mean square before it."""
    s2 = c["level [g]"] ** 2
    lacks = 0.02 * np.where(np.diff(c["up"], prepend=c["up"][0]) == 0.0, np.diff(s2, prepend=s2[0]), 0.0)
    c["rate [deg/h]"] = c["rate [deg/h]"] - 3.0 * lacks
    c["force [g]"] = c["force [g]"] - 8e-5 * lacks


def gyro_north(c: Columns) -> None:
    c["rate [deg/h]"] = c["rate [deg/h]"] + 15.04 * c["up"]


VIBRATION = Sheet(
    "vibration_rectification", "vibration_rectification", "# latitude = 0deg\n# gravity = 9.80665\n# axis = y\n",
    lambda: table_of(LEVEL, test_vibration_rectification.rows()),
    (
        Mistake("axis exchanged", "the accelerometer across was read", "another axis", times(1e-3, "force [g]")),
        Mistake("sign", "up and down exchanged", "up and down", times(-1.0, "up")),
        Mistake("sign", "rates reversed", "rate reversed|reading reversed", times(-1.0, "rate [deg/h]")),
        Mistake("unit", "force in m/s² under g", "m/s²|times gravity", times(G0, "force [g]")),
        Mistake("unit", "levels in m/s² under g", "levels of vibration wrong", times(G0, "level [g]")),
        Mistake("position forgotten", "not turned over", "not turned over",
                copied(8, 0, 8, "rate [deg/h]", "force [g]")),
        Mistake("row late", "readings of a level of the level before", "Row 4 ",
                copied(3, 2, 1, "rate [deg/h]", "force [g]")),
        Mistake("not settled", "each level read before it was reached", "wait longer", level_late),
        Mistake("bump", "the bias another one from row 5 on, by 10 standard deviations", "level of the record",
                knocked(4, 1.0, "rate [deg/h]")),
        Mistake("axis exchanged", "the axis x of the gyro lay to the north", "gyro to the north",
                gyro_north),
    ),
)  # fmt: skip

UNITS = {"phase": "", "t_start": " [s]", "t_end": " [s]"} | {n: " [rad]" for n in test_imu_positions.geometry.ANGLES}
UNITS |= {f"mean_g{a}": " [rad/s]" for a in "xyz"} | {f"mean_a{a}": " [m/s2]" for a in "xyz"}
G = tuple(f"mean_g{a} [rad/s]" for a in "xyz")
A = tuple(f"mean_a{a} [m/s2]" for a in "xyz")
WORLD = World()


def positions(world: World = WORLD) -> Columns:
    rng = np.random.default_rng(10)
    w = world.windows(plan((*EDGES[4:], *EDGES[:4], *FACES)), Unit.drawn(rng), test_imu_positions.white(rng))
    return {n + u: np.asarray(w[n], dtype=float) for n, u in UNITS.items()}


def windows_of(change: Callable[[dict[str, np.ndarray]], dict[str, np.ndarray]]) -> Change:
    def altered(c: Columns) -> None:
        w = change({n: c[n + u] for n, u in UNITS.items()})
        c.update({n + u: w[n] for n, u in UNITS.items()})

    return altered


OUTER, INNER = ([f"{n}_{e} [rad]" for e in ("start", "end")] for n in ("outer", "inner"))
POSITIONS = Sheet(
    "imu_positions, table", "imu_positions",
    f"# latitude = {math.degrees(WORLD.latitude):.12g}deg\n# gravity = {WORLD.gravity}m/s2\n", positions,
    (
        Mistake("axis exchanged", "accelerometers x and y exchanged", "x and y are exchanged", exchange((A[0], A[1]))),
        Mistake("axis exchanged", "gyros y and z exchanged", "y and z are exchanged", exchange((G[1], G[2]))),
        Mistake("axis exchanged", "outer and inner angle exchanged", "outer and inner angle exchanged",
                exchange(*zip(OUTER, INNER, strict=True))),
        Mistake("left-handed", "accelerometer z reversed", "left-handed", times(-1.0, A[2])),
        Mistake("left-handed", "gyro x reversed", "left-handed", times(-1.0, G[0])),
        Mistake("sign", "outer angles reversed", "outer rotation reversed", times(-1.0, *OUTER)),
        Mistake("sign", "all accelerometers reversed", "all of them", times(-1.0, *A)),
        Mistake("unit", "g under m/s²", "readings in g", times(1.0 / G0, *A)),
        Mistake("unit", "°/s under rad/s", "readings in °/s", times(180.0 / math.pi, *G)),
        Mistake("position forgotten", "the case stayed in position 4", "position 5 forgotten",
                windows_of(test_imu_positions.stayed)),
        Mistake("row late", "positions 1 and 2 exchanged", "positions 1 and 2 exchanged",
                windows_of(test_imu_positions.exchanged)),
        Mistake("set-up", "the table 60″ out of the right angle", "out of the right angle, [56]",
                lambda c: c.update(positions(World(square=60.0 * math.pi / 648000.0)))),
        Mistake("set-up", "gravity stated 0.1 % too large", "gravity, or the acc", times(0.999, *A)),
        Mistake("set-up", "times 0.1 % too long", "the times wrong|their times, wrong",
                times(1.001, "t_start [s]", "t_end [s]")),
        Mistake("set-up", "the case turned by 1° on its plate", "the case turned",
                lambda c: c.update(positions(World(case=Rotation.from_rotvec([0.0, 0.0, math.pi / 180.0]))))),
    ),
)  # fmt: skip

LOG = ("time [s]", *(f"g{a} [rad/s]" for a in "xyz"), *(f"a{a} [m/s2]" for a in "xyz"))


def logged(time: np.ndarray, gyro: np.ndarray, acc: np.ndarray) -> Columns:
    return dict(zip(LOG, np.column_stack([time, gyro, acc]).T.copy(), strict=True))


def by_hand() -> Columns:
    rng = np.random.default_rng(5)
    return logged(*handled(Unit.drawn(rng), poses(rng, 16), rng, gyro=2e-5, acc=1e-3, rest=2.5))


def forgotten(c: Columns) -> None:
    """The last but two of the positions is not in the file, and the turn to it neither."""
    keep = (c["time [s]"] < 72.0) | (c["time [s]"] > 78.0)
    for n in c:
        c[n] = c[n][keep]


BY_HAND = Sheet(
    "imu_positions, unknown", "imu_positions",
    "# attitudes = unknown\n# latitude = 40.10704566deg\n# gravity = 9.805m/s2\n", by_hand,
    (
        Mistake("axis exchanged", "gyros x and y exchanged", "x reads y", exchange((LOG[1], LOG[2]))),
        Mistake("left-handed", "gyro z reversed", "left-handed", times(-1.0, LOG[3])),
        Mistake("sign", "accelerometer z reversed", "sign of the accelerometer z|signs of", times(-1.0, LOG[6])),
        Mistake("sign", "all accelerometers reversed", "accelerometers reversed", times(-1.0, *LOG[4:])),
        Mistake("set-up", "gravity stated 0.1 % too large", "gravity, or the acc", times(0.999, *LOG[4:])),
        Mistake("set-up", "times 1 % too long", "their times, wrong", times(1.01, LOG[0])),
        Mistake("unit", "g under m/s²", "at rest they read", times(1.0 / G0, *LOG[4:])),
        Mistake("unit", "°/s under rad/s", "°/s were taken for rad/s", times(180.0 / math.pi, *LOG[1:4])),
        Mistake("unit", "rad/s under °/s", "rad/s were taken for °/s", times(math.pi / 180.0, *LOG[1:4])),
        Mistake("position forgotten", "a position and its turn are not in the file", "gap", forgotten),
    ),
)  # fmt: skip


def upright() -> Columns:
    rng = np.random.default_rng(11)
    return logged(*test_imu_up_down.up_down(rng, Unit.drawn(rng)))


def never_turned(c: Columns) -> None:
    half = c["time [s]"].size // 2
    for n in LOG[1:]:
        c[n][half:] = c[n][:half]


UP_DOWN = Sheet(
    "imu_positions, up_down", "imu_positions",
    "# attitudes = up_down\n# latitude = 40.10704566deg\n# gravity = 9.805m/s2\n", upright,
    (
        Mistake("axis exchanged", "gyros x and z exchanged, z upright", "gx and gz exchanged",
                exchange((LOG[1], LOG[3]))),
        Mistake("axis exchanged", "accelerometers x and z exchanged", "accelerometers reversed",
                exchange((LOG[4], LOG[6]))),
        Mistake("left-handed", "gyro z reversed", "gyros reversed", times(-1.0, LOG[3])),
        Mistake("sign", "accelerometer z reversed", "accelerometers reversed", times(-1.0, LOG[6])),
        Mistake("unit", "g under m/s²", "at rest they read", times(1.0 / G0, *LOG[4:])),
        Mistake("unit", "°/s under rad/s", "the gyros, or their times, wrong", times(180.0 / math.pi, *LOG[1:4])),
        Mistake("position forgotten", "not turned over", "up and down", never_turned),
    ),
)  # fmt: skip

SHEETS = (RATE, TURN_ONS, BANDWIDTH, POSITIONS, BY_HAND, UP_DOWN, CONING, SCULLING, VIBRATION)
