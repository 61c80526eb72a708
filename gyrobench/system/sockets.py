"""Sockets: what a slot of a system asks of the FMU that is put into it.

A socket is a named set of connectors with causality, unit, shape and meaning.  Any FMU that offers them
fits, ours or a foreign one (through a mapping file, see :mod:`gyrobench.system.binding`).  Variables
beyond the socket are allowed and stay at their start values; parameters are no part of a socket.

Conventions of the connectors: SI units; vectors along I, O, S (gyro), face axes (table) or ENU (site);
``f`` is the specific force a - G, what an accelerometer reads: at rest it points up.
"""

from __future__ import annotations

from gyrobench.bench import UsageError, suggest_names
from gyrobench.component.declarations import element_names
from gyrobench.system.connectors import EXPOSED, SUPPLIED, SUPPLIES, Connector, Shape, Socket, inp, limit_flag, out
from gyrobench.system.gimbal_sockets import GIMBALS
from gyrobench.system.loop_sockets import LOOPS
from gyrobench.system.north_sockets import NORTH
from gyrobench.system.table_sockets import TABLES

__all__ = ["SOCKETS", "Connector", "Shape", "Socket", "element_names", "socket"]

TABLE = (
    inp("f_local", "m/s2", "specific force at the site, ENU", 3),
    inp("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
    inp("alpha_local", "rad/s2", "derivative of omega_local: ground that moves, ENU", 3, optional=True),
    inp("mode", "1", "0 hold, 1 index to the target angle, 2 turn at the target rate", whole=True),
    inp("target", "", "angle (rad) or rate (rad/s), by mode"),
    inp("face", "1", "rows: the gyro axes I, O, S in table axes", 3, 3),
    out("angle", "rad", "table angle, cumulative"),
    out("rate", "rad/s", "table rate relative to its base", optional=True),
    out("angle_read", "rad", "table angle as the encoder reads it, cumulative"),
    out("omega", "rad/s", "inertial rate in face axes", 3),
    out("alpha", "rad/s2", "angular acceleration in face axes", 3, optional=True),
    out("f", "m/s2", "specific force in face axes", 3),
    out("in_position", "1", "1 when the target is reached", whole=True),
)
SOCKETS: dict[str, Socket] = {
    s.name: s
    for s in (
        Socket(
            "Site",
            "where the test stands: gravity and Earth rate",
            (
                out("f", "m/s2", "specific force of a body at rest, ENU", 3),
                out("omega", "rad/s", "Earth rate, ENU", 3),
                out("g", "m/s2", "local gravity", optional=True),
                out("alpha", "rad/s2", "derivative of omega: ground that moves", 3, optional=True),
            ),
        ),
        Socket(
            "Surroundings",
            "temperature and magnetic field at the instrument",
            (
                inp("angle", "rad", "table angle, of two axes the outer one", optional=True),
                inp("angle_y", "rad", "angle of the inner axis", optional=True),
                inp("axes", "1", "rows: axes of the stand that carries the table, in ENU", 3, 3, optional=True),
                inp("face", "1", "rows: the instrument's axes in table axes", 3, 3, optional=True),
                out("temperature", "K", "mean temperature of the instrument above that of its coefficients"),
                out("room", "K", "temperature of the room above that of the coefficients", optional=True),
                out("dT", "K", "temperature differences along the instrument's axes", 3, optional=True),
                out("B", "T", "magnetic field along the instrument's axes", 3, optional=True),
                out("dB", "T", "differences of the magnetic field over the instrument", 3, optional=True),
            ),
        ),
        Socket("Supply", "electrical supplies of a gyro: departures from their nominal values", SUPPLIES),
        Socket(
            "SdfGyro",
            "single-degree-of-freedom gyro, case inputs and torquer in, pickoff out",
            (
                inp("omega", "rad/s", "inertial rate of the case along I, O, S", 3),
                inp("alpha", "rad/s2", "angular acceleration of the case along I, O, S", 3, optional=True),
                inp("f", "m/s2", "specific force along I, O, S", 3),
                inp("i", "A", "torquer current"),
                inp("dT", "K", "temperature differences along I, O, S", 3, optional=True),
                inp("v_float", "m/s", "velocity of the float against the case along I, O, S", 3, optional=True),
                *EXPOSED,
                *SUPPLIED,
                out("u", "V", "pickoff voltage"),
                out("drift", "rad/s", "drift rate, precession sign (diagnostic)", optional=True),
                out("b", "rad", "float angle (diagnostic)", optional=True),
                out("M_react", "N.m", "torque of the gyro on its mount along I, O, S", 3, optional=True),
                out("h_I", "N.m.s", "spin momentum along I, H sin b", optional=True),
                out("M_I", "N.m", "torque on the mount along I without its part -dh_I/dt", optional=True),
                limit_flag("saturated", "1 while the pickoff is saturated"),
            ),
        ),
        Socket(
            "TwoAxisGyro",
            "two-degree-of-freedom gyro, case inputs and two torquers in, two pickoffs out",
            (
                inp("omega", "rad/s", "inertial rate of the case along x, y, z (outer gimbal, inner gimbal, spin)", 3),
                inp("alpha", "rad/s2", "angular acceleration of the case along x, y, z", 3, optional=True),
                inp("alpha_b", "rad/s2", "the same, of a case that is the base of a platform", 3, optional=True),
                inp("f", "m/s2", "specific force along x, y, z", 3),
                inp("i_x", "A", "current of the torquer about x, which nulls u_y"),
                inp("i_y", "A", "current of the torquer about y, which nulls u_x"),
                inp("M_x", "N.m", "outside torque on the outer gimbal, about x", optional=True),
                inp("M_y", "N.m", "outside torque on the inner gimbal, about y", optional=True),
                inp("dT", "K", "temperature differences along x, y, z", 3, optional=True),
                inp("v_float", "m/s", "velocity of the float against the case along x, y, z", 3, optional=True),
                *EXPOSED,
                *SUPPLIED,
                out("u_x", "V", "x pickoff voltage: case against rotor about x"),
                out("u_y", "V", "y pickoff voltage: case against rotor about y"),
                out("drift_x", "rad/s", "drift rate about x, precession sign (diagnostic)", optional=True),
                out("drift_y", "rad/s", "drift rate about y, precession sign (diagnostic)", optional=True),
                out("beta", "rad", "angle of the inner gimbal (diagnostic)", optional=True),
                out("M_react", "N.m", "torque of the gyro on its mount along x, y, z", 3, optional=True),
                limit_flag("saturated", "1 while a pickoff is saturated"),
            ),
        ),
        Socket(
            "Accelerometer",
            "accelerometer with its own rebalance: specific force in, current out",
            (
                inp("f", "m/s2", "specific force along x, y, z (input, output, pendulum axis)", 3),
                out("i", "A", "rebalance current"),
                out("i_read", "A", "rebalance current as measured"),
                out("theta", "rad", "angle of the pendulum (diagnostic)", optional=True),
                limit_flag("saturated", "1 while the current is limited"),
            ),
        ),
        Socket(
            "Rebalance",
            "torque rebalance: pickoff voltage to torquer current",
            (
                inp("u", "V", "pickoff voltage"),
                inp("u_cross", "V", "pickoff voltage of the other channel", optional=True),
                out("i", "A", "torquer current"),
                out("i_read", "A", "torquer current as measured"),
                out("n_plus", "1", "clocks of positive current since the start", optional=True, whole=True),
                out("n_minus", "1", "clocks of negative current since the start", optional=True, whole=True),
                limit_flag("saturated", "1 while the current is limited"),
            ),
        ),
        Socket("Table", "turntable with one driven axis", TABLE),
        Socket(
            "ServoTable",
            "turntable with one axis that nulls the pickoff of the gyro on it in mode 3",
            (
                *TABLE,
                inp("u", "V", "pickoff voltage of the gyro"),
                inp("torque", "N.m", "disturbance torque on the table", optional=True),
                limit_flag("saturated", "1 while the motor is at its limit"),
            ),
        ),
        Socket(
            "Stand",
            "turns what the site says into the axes of the attitude of a phase",
            (
                inp("mount", "1", "number of the phase", whole=True),
                inp("f_face", "m/s2", "specific force, ENU", 3),
                inp("omega_face", "rad/s", "Earth rate, ENU", 3),
                out("f", "m/s2", "specific force, attitude axes", 3),
                out("omega", "rad/s", "Earth rate, attitude axes", 3),
                out("axes", "1", "rows: the attitude axes in ENU", 3, 3, optional=True),
            ),
        ),
        Socket(
            "Cage",
            "holds the float by the torquer outside servo mode",
            (
                inp("u", "V", "pickoff voltage"),
                inp("mode", "1", "mode of the table", whole=True),
                inp("command", "", "current wanted in servo mode, A", optional=True),
                inp("angle", "rad", "table angle as read", optional=True),
                out("i", "A", "torquer current"),
            ),
        ),
        Socket(
            "CurrentSource",
            "current through the torquer while the gyro holds the table",
            (
                inp("command", "", "current wanted in servo mode, A"),
                inp("mode", "1", "mode of the table", whole=True),
                out("i", "A", "current"),
                out("i_read", "A", "current as measured"),
            ),
        ),
        Socket(
            "TwoAxisTable",
            "turntable with an outer axis X and an inner axis Y",
            (
                inp("f_local", "m/s2", "specific force at the site, ENU", 3),
                inp("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
                inp("mode_x", "1", "outer axis: 0 hold, 1 index to the target angle, 2 turn at the rate", whole=True),
                inp("target_x", "", "outer axis: angle (rad) or rate (rad/s), by mode"),
                inp("mode_y", "1", "inner axis: mode", whole=True),
                inp("target_y", "", "inner axis: angle (rad) or rate (rad/s), by mode"),
                inp("face", "1", "rows: the gyro axes in plate axes", 3, 3),
                out("angle_x", "rad", "outer angle, cumulative"),
                out("angle_y", "rad", "inner angle, cumulative"),
                out("angle_x_read", "rad", "outer angle as the encoder reads it"),
                out("angle_y_read", "rad", "inner angle as the encoder reads it"),
                out("omega", "rad/s", "inertial rate in face axes", 3),
                out("alpha", "rad/s2", "angular acceleration in face axes", 3, optional=True),
                out("f", "m/s2", "specific force in face axes", 3),
                out("in_position", "1", "1 when both targets are reached", whole=True),
            ),
        ),
        Socket(
            "Sequencer",
            "runs the plan: one phase after another",
            (
                inp("angle", "rad", "table angle"),
                inp("in_position", "1", "1 when the table has reached its target", optional=True, whole=True),
                out("phase", "1", "number of the running phase, from 1", whole=True),
                out("mode", "1", "table mode of the phase", whole=True),
                out("target", "", "table target of the phase"),
                out("target_y", "", "target of a second axis of the table", optional=True),
                out("way", "1", "way of an index move: 1 shorter, 2 upwards, 3 downwards", optional=True, whole=True),
                out("move_rate", "rad/s", "largest rate of an index move; 0: that of the table", optional=True),
                out("face", "1", "mount of the phase", 3, 3),
                out("gate", "1", "0 closed, 1 windows by time, 2 windows by angle", whole=True),
                out("window", "", "window length, s or rad by gate"),
                out("done", "1", "1 when the plan is finished", whole=True),
            ),
        ),
        Socket(
            "Sampler",
            "averages a signal over windows of time or angle",
            (
                inp("x", "", "the signal"),
                inp("angle", "rad", "table angle"),
                inp("gate", "1", "see Sequencer", whole=True),
                inp("window", "", "window length, s or rad by gate"),
                inp("phase", "1", "number of the running phase", whole=True),
                inp("flag", "1", "1 marks a sample as suspect", optional=True, whole=True),
                out("count", "1", "windows completed so far", whole=True),
                out("window_phase", "1", "phase of the last window", whole=True),
                out("mean", "", "mean of the signal over the last window"),
                out("std", "", "standard deviation of the samples in the last window"),
                out("n", "1", "samples in the last window", whole=True),
                out("angle_start", "rad", "angle at the start of the last window"),
                out("angle_end", "rad", "angle at the end of the last window"),
                out("t_start", "s", "start of the last window"),
                out("t_end", "s", "end of the last window"),
                out("flagged", "1", "flagged samples in the last window", whole=True),
            ),
        ),
        Socket(
            "CoefficientEstimator",
            "estimates the drift over the angle of a table while the windows of a sampler come in",
            (
                inp("count", "1", "windows completed so far", whole=True),
                inp("window_phase", "1", "phase of the last window", whole=True),
                inp("angle_start", "rad", "angle at the start of the last window"),
                inp("angle_end", "rad", "angle at the end of the last window"),
                inp("t_start", "s", "start of the last window"),
                inp("t_end", "s", "end of the last window"),
                inp("omega_E", "rad/s", "Earth rate along the table axis"),
                inp("valid", "1", "0 marks a window to be left out", optional=True, whole=True),
                out("A", "rad/s", "mean, cos, sin, cos 2, sin 2 of the drift over the angle", 5),
                out("sd", "rad/s", "their standard deviations", 5),
                out("may_stop", "1", "1: every one is known as well as wanted", whole=True),
                out("mean_nis", "1", "mean normalized innovation squared of this phase"),
                out("consistent", "1", "1: the innovations are as large as stated", whole=True),
                out("nis", "1", "normalized innovation squared", optional=True),
                out("innovation", "rad/s", "rate less its prediction", optional=True),
                out("correlation", "1", "largest correlation between two of them", optional=True),
            ),
        ),
        *LOOPS,
        *GIMBALS,
        *TABLES,
        *NORTH,
    )
}


def socket(name: str | Socket) -> Socket:
    """Return the socket called ``name``, or a system's own; raises UsageError for an unknown name."""
    if isinstance(name, Socket):
        return name
    if name not in SOCKETS:
        raise UsageError(f"no socket '{name}'; {suggest_names(name, SOCKETS)}")
    return SOCKETS[name]
