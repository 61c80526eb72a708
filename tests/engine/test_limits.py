"""What a run that failed says of the limits that it reached before."""

import numpy as np

from gyrobench.engine.limits import limit_flags, limits_reached
from gyrobench.system.sockets import SOCKETS

CHANNELS = ["time", "platform.theta[1]", "platform.saturated", "gyro.saturated", "platform.at_stop", "platform.lock"]


def record(**active):
    """Ten rows of 0.1 s; active: slot_variable -> rows in which the flag is 1."""
    channels = {name: np.zeros(10) for name in CHANNELS}
    channels["time"] = np.arange(10) * 0.1
    for name, rows in active.items():
        channels[name.replace("_", ".", 1)][rows] = 1.0
    return channels


FLAGS = limit_flags(CHANNELS, {"platform": SOCKETS["Platform"], "gyro": SOCKETS["SdfGyro"]})


def test_flags_are_what_the_sockets_call_limits():
    assert FLAGS == {
        "platform.saturated": "a motor is at its limit",
        "gyro.saturated": "the pickoff is saturated",
        "platform.at_stop": "a gimbal is at its stop",
    }


def test_the_first_limit_is_said_first_with_its_time():
    """The motor again later, the stop last: 0.3 s gyro, 0.5 s motor, 0.9 s stop."""
    channels = record(platform_saturated=[5, 7, 8, 9], gyro_saturated=[3], platform_at_stop=[9], platform_lock=[0])
    assert limits_reached(channels, FLAGS) == (
        "limits reached before that, first: gyro.saturated at t = 0.3 s (the pickoff is saturated); then "
        "platform.saturated at t = 0.5 s (a motor is at its limit); then platform.at_stop at t = 0.9 s (a gimbal is at "
        "its stop)"
    )


def test_nothing_is_said_where_no_limit_was_reached():
    assert limits_reached(record(platform_lock=[4]), FLAGS) == ""
    assert limits_reached({}, {}) == ""
