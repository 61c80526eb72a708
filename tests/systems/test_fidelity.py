"""Dynamic co-simulation against the quasi-static model, for every test method: noise off, a short plan.

The quasi-static model gives the true coefficients back to 1e-9 (tests/spec: reducers from ideal input).  So what a
co-simulation's estimate is off from the truth, which every report of a simulated run shows beside it, is what the
dynamics do: less than 1e-6 deg/h, or the effect that is named here.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import pytest
from servoing import DAY50
from servoing_two_axes import day

from gyrobench.engine.session import run
from gyrobench.system.suite import load_test
from gyrobench.system.system import load_system

ERU = 7.2921159e-5


@dataclass(frozen=True)
class Case:
    """values: a short plan; limit: deg/h (per g^n), or relative for quantities in other units; effect: why not 1e-6.

    without: noises of other parts of a slot.
    """

    values: dict[str, Any] = field(default_factory=dict)
    limit: float = 1e-6
    effect: str = ""
    without: tuple[str, ...] = ()


TUMBLE = {"rate": 100 * ERU, "windows": 36, "dwell": 20.0, "settle": 3.0}
NO_CROSS = {"gyro.D_IO": 0.0, "gyro.D_OS": 0.0, "gyro.D_IS": 0.0}
CASES = {
    "tumble_single_axis": Case(TUMBLE),
    "tumble_two_channel": Case({**TUMBLE, "table.acceleration": 20.0}),
    "tumble_two_axis": Case(
        {
            "positions": 25, "dwell": 4.0, "settle": 3.0, "inner_rate": 0.05, "rebalance.i_max": 1.0,
            "table.index_rate[1]": 1.0, "table.acceleration": [1.0, 1.0],
        }
    ),
    "eight_position": Case({"cycles": 2, "readings": 2, "dwell": 4.0, "settle": 3.0}),
    "fixed_position": Case({"readings": 10, "dwell": 20.0, "settle": 3.0}),
    "open_loop_drift": Case({"pairs": 5, "wait": 6.0, "dwell": 0.1}, 5e-6, "the rate of a move is held over each step"),
    "accelerometer_multipoint": Case({}),
    "position_sensitivity": Case({"cycles": 2, "dwell": 10.0}),
    "servo_polar": Case({**DAY50, "gyro.J": 2e-5}),
    "servo_vertical_level": Case({"dwell": 60.0, "settle": 2.0, **NO_CROSS}),
    "servo_two_axis": Case(day(50.0)),
    "pickoff_scale_factor": Case({}, 6e-3, "drift: the attitude changes by the step"),
    "rebalance_loop_test": Case(
        {"gate": 0.5, "rest": 6, "readings": 4}, 0.6, "ppm and uA: a count of a reading is 0.8 uA", ("rebalance.meter",)
    ),
    "north_finder": Case({"time": 30.0}, 2e-5, "angles of a window and rates sampled each millisecond"),
    "accelerometer_four": Case({"dwell": 1.0, "settle": 0.5}, 3e-4, "1e-9 V, of coefficients of some microvolts"),
    "imu_positions": Case({}),
    "rate_table_test": Case(
        {"gyro.scale[1]": 3e-4},
        without=tuple(f"gyro.{n}" for n in (
            "optical", "electronics", "crossings", "quantum", "turn_on_x", "turn_on_y", "markov_x", "markov_y",
            "white_x", "white_y",
        )),
    ),
    "torquer_scale_factor": Case({"currents": "5 10 20 40 70 100", "range": "0.5deg", "range_large": "5deg"}),
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
@pytest.mark.long
def test_dynamic_is_quasi_static(name: str) -> None:
    case = CASES[name]
    system = load_system(name)
    values = {**{n: 0.0 for n in system.noises if n not in case.without}, **case.values}
    result = system.with_values(values).reduce(run(name, values=values))
    known = [c for c in result.coefficients if c.truth is not None]
    assert known, "no truth in the report"
    off = {}
    for c in known:
        scale = 1.0 if "°/h" in c.unit or c.truth == 0.0 else abs(c.truth)
        off[c.name] = abs(c.estimate - c.truth) / scale
    assert max(off.values()) < case.limit, off
    assert case.limit <= 1e-6 or case.effect


NOISE_IS_THE_RESULT = {"drift_record"}  # without noise there is nothing to estimate
#: their own tests put errors in and get them back; nothing is quasi-static about a table, or a vibration
TABLES = {
    "angle_system_test",
    "coning_test",
    "gyro_bandwidth",
    "gyro_dynamics",
    "sculling_test",
    "stand_alignment",
    "table_position_test",
    "table_rate_test",
    "turn_on_repeatability",
    "vibration_rectification",
}


def test_every_method_is_here() -> None:
    from gyrobench.bench import Bench, standard_folder

    methods = {n for n in Bench(standard_folder()).systems() if getattr(load_test(n), "measured_data", None)}
    assert methods == set(CASES) | NOISE_IS_THE_RESULT | TABLES
