"""Attitudes of what moves, against what the parts themselves make of gravity and Earth rate."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gyrobench as gb
from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.bench import Bench
from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.record.run_document import RunDocument
from gyrobench.system.moving_bodies import attitudes, parse_bodies
from gyrobench.system.system import System
from gyrobench.workflow.inputs import load_test

SHORT: dict[str, dict[str, Any]] = {
    "tumble_single_axis": {"rate": "30deg/s", "dwell": "2s", "settle": "0.5s", "windows": 12, "latitude": "20deg"},
    "tumble_two_channel": {"rate": "30deg/s", "dwell": "2s", "settle": "0.5s", "windows": 12},
    "accelerometer_multipoint": {"settle": "1s", "dwell": "1s"},
    "accelerometer_four": {"settle": "1s", "dwell": "1s"},
    "tumble_two_axis": {"positions": 12},
    "north_finder": {},
    "pickoff_scale_factor": {},
    "rebalance_loop_test": {},
    "torquer_scale_factor": {},
    "servo_polar": {"mounts": "S N", "time": "200s", "turns": 0, "dwell": "60s", "window": "20s"},
    "servo_vertical_level": {"attitudes": "all", "cycles": 1, "dwell": "100s", "windows": 8},
}


def run(name: str, values: dict[str, Any], *channels: str) -> Record:
    """Return the record of a run with further channels, ten rows a second or more."""
    test = gb.load(name, values)
    test.system.channels = tuple(dict.fromkeys((*test.system.channels, *channels)))
    if test.system.channel_period > 0.1:
        test.system.channel_period = 0.1
    try:
        return test.run(check_step=False).record
    except GyrobenchError as error:  # too short for its reduction
        found: Record = error.record  # type: ignore[attr-defined]
        return found


def vector(record: Record, name: str) -> Array:
    return np.column_stack([record.channels[f"{name}[{k}]"] for k in (1, 2, 3)])


@pytest.mark.parametrize("name", SHORT)
@pytest.mark.long
def test_the_instrument_feels_gravity_where_its_axes_are(name: str) -> None:
    """f = C (0, 0, g) with the axes in east, north, up as rows of C; the table gives f in the axes of the instrument.

    Rows within a second of a change of mount are left out: the sequencer changes it between two rows.
    """
    record = run(name, SHORT[name], *(f"table.f[{k}]" for k in (1, 2, 3)))
    time = record.channels["time"]
    found = attitudes(parse_bodies(gb.load(name).system.bodies), record, np.arange(len(time)))
    axes = found["instrument"]
    assert np.allclose(axes @ np.swapaxes(axes, 1, 2), np.eye(3), atol=1e-12)
    f = vector(record, "table.f")
    away = np.min(np.abs(time[:, None] - np.asarray(record.windows["t_end"])[None, :]), axis=1) > 0.15
    assert away.sum() > 20 and np.ptp(record.channels[next(c for c in record.channels if "angle" in c)]) > 1e-3
    expected = np.linalg.norm(f[0]) * axes[:, :, 2]
    assert np.abs(f - expected)[away].max() < 1e-9 * np.linalg.norm(f[0])


@pytest.mark.long
def test_the_table_turns_earth_rate_as_its_axes_say() -> None:
    """omega = C omega_E + mount (0, 0, rate): the part about the vertical, which gravity does not show."""
    name, rate = "tumble_single_axis", [f"table.omega[{k}]" for k in (1, 2, 3)]
    record = run(name, SHORT[name], *rate, "table.rate")
    time = record.channels["time"]
    found = attitudes(parse_bodies(gb.load(name).system.bodies), record, np.arange(len(time)))
    mount = found["instrument"] @ np.swapaxes(found["table"], 1, 2)
    earth = frames.earth_rate_local(float(record.run.parameters["site.latitude"]))
    expected = found["instrument"] @ earth + mount[:, :, 2] * record.channels["table.rate"][:, None]
    away = np.min(np.abs(time[:, None] - np.asarray(record.windows["t_end"])[None, :]), axis=1) > 0.15
    assert np.abs(vector(record, "table.omega") - expected)[away].max() < 1e-12


@pytest.mark.parametrize(
    ("name", "slot", "values"),
    [("table_capture", "table", {}), ("table_rate_test", "body", {"rates": "1 100", "least": 20, "dwell": "5s"})],
)
@pytest.mark.long
def test_a_servo_table_turns_as_its_axes_say(name: str, slot: str, values: dict[str, Any]) -> None:
    """omega = C omega_E + mount (0, 0, rate), f = C (0, 0, g): the mount by the phase that the sequencer records."""
    record = run(name, values, *(f"{slot}.{what}[{k}]" for what in ("omega", "f") for k in (1, 2, 3)), f"{slot}.rate")
    bodies = parse_bodies(gb.load(name).system.bodies)
    found = attitudes(bodies, record, np.arange(len(record.channels["time"])))
    axes, f = found["instrument"], vector(record, f"{slot}.f")
    mount = axes @ np.swapaxes(found["table"], 1, 2)
    earth = frames.earth_rate_local(float(record.run.parameters["site.latitude"]))
    expected = axes @ earth + mount[:, :, 2] * record.channels[f"{slot}.rate"][:, None]
    assert np.ptp(record.channels[f"{slot}.angle"]) > 0.01
    assert np.abs(vector(record, f"{slot}.omega") - expected).max() < 1e-12
    assert np.abs(f - np.linalg.norm(f[0]) * axes[:, :, 2]).max() < 1e-9 * np.linalg.norm(f[0])


@pytest.mark.long
def test_the_inner_element_feels_the_force_of_its_base() -> None:
    """f of the platform is that of the base through roll, pitch and azimuth gimbal; of the base, C (0, 0, g)."""
    names = [f"{slot}.f[{k}]" for slot in ("platform", "motion") for k in (1, 2, 3)]
    record = run("platform_three_axis", {"hold": "5s"}, *names)
    bodies = parse_bodies(gb.load("platform_three_axis").system.bodies)
    found = attitudes(bodies, record, np.arange(len(record.channels["time"])))
    base, inner = found["base"], found["inner element"]
    f_base, f_inner = vector(record, "motion.f"), vector(record, "platform.f")
    g = np.linalg.norm(f_base[0])
    assert np.ptp(record.channels["platform.theta[1]"]) > 1e-3
    assert np.abs(f_base - g * base[:, :, 2]).max() < 1e-9 * g
    turned = np.einsum("nij,nj->ni", inner @ np.swapaxes(base, 1, 2), f_base)
    assert np.abs(f_inner - turned).max() < 1e-6 * g  # the force is that of the step before


@pytest.mark.parametrize(
    ("name", "values"),
    [("platform_four_gimbal", {"load": 0.0}), ("platform_three_gimbal", {"mount": 0, "roll": "40deg", "yaw": "20deg"})],
)
@pytest.mark.long
def test_the_platform_stays_where_its_rates_leave_it(
    name: str, values: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Through base and all gimbals, in the order of ``mount``: its turns from the start are the integral of its rates.

    They are small, e < 7e-3 rad: R - 1 is -[e x] but for e^2 / 2 < 3e-5.
    """
    test = gb.load(name, values)
    monkeypatch.setattr(type(test.system), "stop", 31.0 if "four" in name else 22.0)
    record = test.run(check_step=False).record
    found = attitudes(parse_bodies(test.system.bodies), record, np.arange(len(record.channels["time"])))
    assert np.ptp(found["base"], axis=0).max() > 0.5, "the base turns"
    turn = found["inner element"] @ found["inner element"][0].T
    small = np.stack([turn[:, 1, 2], turn[:, 2, 0], turn[:, 0, 1]], axis=1)
    attitude = vector(record, "platform.attitude")
    assert np.abs(attitude).max() < 7e-3
    assert np.abs(small - (attitude - attitude[0])).max() < 3e-5


@pytest.mark.long
def test_windows_say_where_a_table_stands_whose_angle_is_not_recorded() -> None:
    """Within windows the same as by the angle itself, at rest and at even rates; and f = C (0, 0, g)."""
    record = run("rate_table_test", {}, "table.angle", *(f"table.f[{k}]" for k in (1, 2, 3)))
    bodies = parse_bodies(gb.load("rate_table_test").system.bodies)
    time, w = record.channels["time"], record.windows
    inside = ((time[:, None] > w["t_start"]) & (time[:, None] < w["t_end"])).any(axis=1)
    assert inside.sum() > 1000 and np.ptp(record.channels.pop("table.angle")) > 10.0
    axes = attitudes(bodies, record, np.arange(len(time)))["instrument"]
    f = vector(record, "table.f")
    assert np.abs(f - np.linalg.norm(f[0]) * axes[:, :, 2])[inside].max() < 1e-9 * np.linalg.norm(f[0])
    again = run("rate_table_test", {}, "table.angle")
    true = attitudes(bodies, again, np.arange(len(time)))["table"]
    assert np.abs(attitudes(bodies, record, np.arange(len(time)))["table"] - true)[inside].max() < 1e-9


#: systems without a moving picture -> why
STILL = {
    "coning_test": "turns by fractions of a degree many times a second, its angle is not recorded",
    "drift_compensation": "one axis that moves by seconds of arc",
    "estimator_bench": "nothing turns",
    "gyro_bandwidth": "the rate of the table is recorded, not its angle",
    "gyro_dynamics": "the rate of the table is recorded, not its angle",
    "gyrocompass": "roll of the ship and tilt of the compass are recorded in part",
    "platform_single_axis": "one axis that moves by seconds of arc",
    "sculling_test": "turns by fractions of a degree many times a second, its angle is not recorded",
    "stabilizer_floated_2dof": "one axis that moves by seconds of arc",
    "stabilizer_power_2dof": "one axis that moves by seconds of arc",
    "stabilizer_power_two_axis": "two axes that move by seconds of arc",
    "stabilizer_sdf": "one axis that moves by seconds of arc",
    "stand_alignment": "readings of a theodolite at marks, nothing moves between them",
    "vibration_rectification": "the table shakes along a line",
}


def test_every_other_system_has_a_picture() -> None:
    every = {name: load_test(name) for name in Bench.find().systems()}
    systems = {name: test for name, test in every.items() if isinstance(test, System)}
    assert {name for name, test in systems.items() if not parse_bodies(test.bodies)} == set(STILL)


def test_rotations_are_passive_and_right_handed() -> None:
    """A turn by +90 degrees about z brings x to where y was: east in the new axes is -y."""
    assert np.allclose(frames.passive(2, np.array([np.pi / 2]))[0] @ [1.0, 0.0, 0.0], [0.0, -1.0, 0.0])
    assert np.allclose(frames.passive(2, np.array([0.3]))[0], frames.passive_z(0.3))
    for axis in range(3):
        about = np.eye(3)[axis]
        assert np.allclose(frames.passive(axis, np.array([0.7]))[0], frames.rotation(about, 0.7).T)


def test_what_the_record_lacks_is_left_out() -> None:
    record = Record(
        {}, {"time": np.arange(2.0), "a.q": np.array([0.0, 0.5])}, RunDocument(parameters={"a.tilt": [0.1, 0.2]})
    )
    bodies = parse_bodies("one: x a.tilt[2], z a.q\ntwo: one, y b.q\nthree: two, x a.q\nfour: ENU, z a.tilt[1]")
    found = attitudes(bodies, record, np.arange(2))
    assert list(found) == ["one", "four"]
    assert np.allclose(found["one"][1], frames.passive(2, np.array([0.5]))[0] @ frames.passive(0, np.array([0.2]))[0])
    for text in ("one", "one: w a.q", "one: x a.q or else", "ENU: x a.q", "one: x a.q\none: x a.q", "one: two, x a.q"):
        with pytest.raises(ValueError, match="bodies: "):
            parse_bodies(text)
