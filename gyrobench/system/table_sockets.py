"""Sockets of a turntable built from its pieces: command, angle reader, controller, drive, load, body.

Conventions, beside those of :mod:`gyrobench.system.sockets`.  One axis, z of the table; angle and rate of the table
count against its base, a positive torque turns it to larger angles.  Counts are cumulative, whole and exact (a double
holds integers up to 2^53), a sampled output comes with the instant it belongs to.  Order: command, reader, controller,
drive, load, body; the body passes no torque on to its angle and rate at once, there the loop is cut.
"""

from __future__ import annotations

from gyrobench.system.connectors import Socket, inp, limit_flag, out

TABLES: tuple[Socket, ...] = (
    Socket(
        "Drive",
        "torque motor of a table axis with its power amplifier: demanded torque in, torque out",
        (
            inp("demand", "N.m", "demanded torque"),
            inp("rate", "rad/s", "rate of the shaft relative to the base"),
            out("torque", "N.m", "motor torque on the shaft"),
            out("voltage", "V", "voltage of the motor", optional=True),
            out("current", "A", "current of the motor", optional=True),
            limit_flag("saturated", "1 while the motor is at its limit"),
        ),
    ),
    Socket(
        "TableLoad",
        "torque on a table axis that depends on its motion: bearing, slip rings, cables",
        (
            inp("angle", "rad", "table angle"),
            inp("rate", "rad/s", "table rate relative to its base"),
            inp("torque", "N.m", "torque to be added", optional=True),
            out("M", "N.m", "torque on the table"),
        ),
    ),
    Socket(
        "TableBody",
        "moving part of a one-axis table: torques in, motion out",
        (
            inp("f_local", "m/s2", "specific force at the site, ENU", 3),
            inp("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
            inp("face", "1", "rows: the gyro axes I, O, S in table axes", 3, 3),
            inp("torque", "N.m", "motor torque"),
            inp("M_load", "N.m", "further torque on the table", optional=True),
            out("angle", "rad", "table angle, cumulative"),
            out("rate", "rad/s", "table rate relative to its base"),
            out("omega", "rad/s", "inertial rate in face axes", 3),
            out("alpha", "rad/s2", "angular acceleration in face axes", 3),
            out("f", "m/s2", "specific force in face axes", 3),
        ),
    ),
    Socket(
        "Foundation",
        "what a table stands on: motion of the ground in, motion of the table's base out",
        (
            inp("g", "m/s2", "local gravity", optional=True),
            inp("a", "m/s2", "acceleration of the ground, ENU", 3),
            inp("tilt", "rad", "tilt of the ground about E, N, U", 3),
            inp("tilt_rate", "rad/s", "its derivative", 3),
            inp("tilt_acceleration", "rad/s2", "derivative of that", 3),
            inp("omega", "rad/s", "inertial rate of the ground in its axes", 3),
            inp("alpha", "rad/s2", "its derivative", 3, optional=True),
            out("f_block", "m/s2", "specific force on it, in its axes", 3),
            out("omega_block", "rad/s", "its inertial rate, in its axes", 3),
            out("alpha_block", "rad/s2", "derivative of that", 3),
            out("a_block", "m/s2", "its acceleration, ENU", 3),
            out("tilt_block", "rad", "its tilt about E, N, U", 3),
        ),
    ),
    Socket(
        "AngleReader",
        "angle sensor of a table axis: angle in, cumulative counts out",
        (
            inp("angle", "rad", "table angle"),
            inp("rate", "rad/s", "table rate relative to its base"),
            out("count", "1", "cumulative count", whole=True),
            out("angle_read", "rad", "table angle as read, cumulative"),
            out("t_read", "s", "instant to which the count belongs"),
            limit_flag("lost", "1 once the reader has lost the angle"),
        ),
    ),
    Socket(
        "RateReadout",
        "rate of a table axis from counts: by gates of time or by the time of an interval of angle",
        (
            inp("count", "1", "cumulative count", whole=True),
            inp("t_read", "s", "instant to which the count belongs"),
            out("rate", "rad/s", "rate of the last interval"),
            out("valid", "1", "1 when there is one", whole=True),
            limit_flag("overflow", "1 while the interval is beyond the display"),
            out("number", "1", "intervals read since the start", whole=True),
            out("t_start", "s", "start of the last interval"),
            out("t_end", "s", "its end"),
        ),
    ),
    Socket(
        "TableCommand",
        "reference motion of a table axis: mode and target in, cumulative command counts out",
        (
            inp("mode", "1", "0 hold, 1 index to the target angle, 2 turn at the target rate", whole=True),
            inp("target", "", "angle (rad) or rate (rad/s), by mode"),
            inp("angle_read", "rad", "table angle as read, cumulative", optional=True),
            inp("way", "1", "way of an index move: 1 shorter, 2 upwards, 3 downwards", optional=True, whole=True),
            inp("move_rate", "rad/s", "largest rate of an index move; 0: that of the part", optional=True),
            out("count", "1", "cumulative command count", whole=True),
            out("angle", "rad", "reference angle, exact"),
            out("rate", "rad/s", "reference rate"),
            out("acc", "rad/s2", "reference acceleration over the coming period"),
            out("arrived", "1", "1 when the reference has reached its target", whole=True),
        ),
    ),
    Socket(
        "TableController",
        "controller of a table axis: command counts and read counts in, demanded torque out",
        (
            inp("count_command", "1", "cumulative command count", whole=True),
            inp("count", "1", "cumulative count of the angle reader", whole=True),
            inp("angle_command", "rad", "reference angle", optional=True),
            inp("rate_command", "rad/s", "reference rate", optional=True),
            inp("acc_command", "rad/s2", "reference acceleration over the coming period", optional=True),
            inp("angle_read", "rad", "table angle as read, cumulative", optional=True),
            inp("tacho", "rad/s", "table rate as the tachometer measures it", optional=True),
            inp("enable", "1", "1 closes the loop", optional=True, whole=True),
            inp("preset", "1", "1 sets the states of the controller to their start", optional=True, whole=True),
            out("demand", "N.m", "demanded torque"),
            out("e", "rad", "error: command minus reading"),
            out("in_position", "1", "1 when the target is reached", whole=True),
            limit_flag("saturated", "1 while the demanded torque is limited"),
        ),
    ),
)
