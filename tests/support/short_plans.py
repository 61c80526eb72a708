"""The shortest plan of each system that its run and its report are seen with: options as they are written."""

from __future__ import annotations

TUMBLE = {"rate": "30deg/s", "dwell": "2s", "settle": "0.5s", "windows": "12"}
#: systems that are not here are short enough as they are
SHORT: dict[str, dict[str, str]] = {
    "accelerometer_four": {"dwell": "1s", "settle": "0.5s"},
    "accelerometer_multipoint": {"dwell": "1s", "settle": "0.5s"},
    "drift_record": {"duration": "600s"},
    "drift_test_suite": {"tests": "fixed_position tumble_single_axis", "rate": "30deg/s", "dwell": "20s"},
    "eight_position": {"cycles": "2", "dwell": "10s", "settle": "2s"},
    "fixed_position": {"dwell": "60s"},
    "open_loop_drift": {"pairs": "4"},
    "position_sensitivity": {"cycles": "2", "dwell": "10s"},
    "servo_polar": {"time": "12h", "turns": "0", "window": "300s", "dwell": "300s"},
    "servo_two_axis": {"time": "12h", "window": "300s"},
    "servo_vertical_level": {"cycles": "1", "dwell": "60s"},
    "table_environment": {"dwell": "1200s"},
    "torquer_scale_factor": {"range": "2deg", "range_large": "2deg"},
    "tumble_single_axis": TUMBLE,
    "tumble_two_axis": {"positions": "12", "dwell": "10s", "settle": "2s"},
    "tumble_two_channel": TUMBLE,
}
