"""Sockets of stabilizer loops: excitation, motion, load, platforms, decoupler, stabilizer, estimator.

Conventions, beside those of :mod:`gyrobench.system.sockets`.  Base axes: x right, y forward, z up.  Gimbals from
outside: roll about y, pitch about x, azimuth about z.  Every array of three drives, joint angles or gyro signals along
motor axes comes in the A order: (1) x_f pitch, (2) y_r roll, (3) z_a azimuth.  Rates, accelerations and attitudes of
the platform, the innermost element, are along its own axes x, y, z.  A system with one axis uses element 1.

Sign round a loop: a gyro's u is positive for a positive inertial rate about its input axis; the stabilizer carries
the minus (v = -K F(s) e); a positive voltage makes a positive motor torque.  [CONV-GIMBALS]
"""

from __future__ import annotations

from gyrobench.system.connectors import Connector, Socket, inp, limit_flag, out


def _platform(*shape: int) -> tuple[Connector, ...]:
    """Connectors of a stabilized platform whose drives have this shape: () one axis, (3,) three in A order."""
    axes = ", A order" if shape else ""
    return (
        inp("v", "V", f"voltage of the torque motor{axes}", *shape),
        inp("M_load", "N.m", f"disturbance torque about the motor axis{axes}", *shape),
        inp("M_gyro", "N.m", "torque of the gyros on the platform, platform axes", *shape, optional=True),
        inp("omega_b", "rad/s", "inertial rate of the base, base axes", 3),
        inp("alpha_b", "rad/s2", "angular acceleration of the base, base axes", 3, optional=True),
        inp("f_b", "m/s2", "specific force of the base, base axes", 3, optional=True),
        out("theta", "rad", f"joint angle{axes}", *shape),
        out("theta_dot", "rad/s", f"joint rate{axes}", *shape),
        out("omega", "rad/s", "inertial rate of the platform, platform axes", 3),
        out("alpha", "rad/s2", "angular acceleration of the platform, platform axes", 3),
        out("f", "m/s2", "specific force of the platform, platform axes", 3, optional=True),
        out("attitude", "rad", "small rotation of the platform from its start: integral of omega", *shape),
        out("i_motor", "A", f"motor current{axes}", *shape, optional=True),
        limit_flag("saturated", "1 while a motor is at its limit"),
        limit_flag("at_stop", "1 while a gimbal is at its stop"),
    )


_THREE_AXES = (*_platform(3), out("lock", "1", "1 while the gimbals are locked or too near to it", whole=True))

LOOPS: tuple[Socket, ...] = (
    Socket(
        "Excitation",
        "runs the plan of a loop test: torques, rate commands, test signals and base motion",
        (
            out("torque", "N.m", "disturbance torque, A order", 3),
            out("command", "rad/s", "rate commanded to the platform, A order", 3),
            out("test", "V", "test signal added where the loop is opened, A order", 3),
            out("motion_angle", "rad", "rotation of the base, rotation vector about one axis at a time", 3),
            out("motion_rate", "rad/s", "its rate", 3),
            out("motion_acceleration", "rad/s2", "its acceleration", 3),
            out("phase", "1", "number of the running phase, from 1", whole=True),
            out("gate", "1", "1 while the phase is measured", whole=True),
            out("done", "1", "1 when the plan is finished", whole=True),
        ),
    ),
    Socket(
        "Motion",
        "motion of the base: angle, rate, acceleration and specific force that belong together",
        (
            inp("motion_angle", "rad", "rotation to be added, about one axis at a time", 3, optional=True),
            inp("motion_rate", "rad/s", "its rate", 3, optional=True),
            inp("motion_acceleration", "rad/s2", "its acceleration", 3, optional=True),
            inp(
                "phase",
                "1",
                "number of the running phase, for a motion that is told by phases",
                optional=True,
                whole=True,
            ),
            inp("gate", "1", "1 while the phase is measured", optional=True, whole=True),
            out("angle", "rad", "pitch about x, roll about y, heading about z of the base", 3),
            out("omega", "rad/s", "inertial rate of the base, base axes", 3),
            out("alpha", "rad/s2", "angular acceleration of the base, base axes", 3),
            out("f", "m/s2", "specific force of the base, base axes", 3),
        ),
    ),
    Socket(
        "Load",
        "disturbance torques about the motor axes",
        (
            inp("torque", "N.m", "torque to be added, A order", 3, optional=True),
            out("M", "N.m", "disturbance torque, A order", 3),
        ),
    ),
    Socket(
        "PlatformAxis",
        "stabilized platform with one axis, motor in, motion out",
        (
            *_platform(),
            inp("h_gyro", "N.m.s", "spin momentum of the gyro along the axis, kept in the state", optional=True),
            out("M_motor", "N.m", "motor torque", optional=True),
        ),
    ),
    Socket("Platform", "stabilized platform with three gimbals", _THREE_AXES),
    Socket(
        "FourGimbalPlatform",
        "stabilized platform with a fourth gimbal, outer roll",
        (
            *_THREE_AXES,
            inp("lock_4", "1", "1 locks the fourth gimbal", optional=True, whole=True),
            out("theta_4", "rad", "angle of the fourth gimbal"),
            out("theta_4_dot", "rad/s", "its rate"),
        ),
    ),
    Socket(
        "Decoupler",
        "turns gyro signals of the platform axes into signals of the motor axes",
        (
            inp("u", "", "signals along the platform axes", 3),
            inp("theta", "rad", "joint angles, A order", 3),
            out("u_axes", "", "signals about the motor axes, A order", 3),
            limit_flag("saturated", "1 while a gain is at its limit"),
        ),
    ),
    Socket(
        "Stabilizer",
        "stabilizer loop of one axis: gyro signal in, motor voltage out; it carries the minus",
        (
            inp("u", "V", "gyro signal"),
            inp("test", "V", "test signal added to it", optional=True),
            inp("command", "rad/s", "rate commanded to the platform", optional=True),
            inp("i_motor", "A", "motor current", optional=True),
            inp("rate", "rad/s", "measured rate", optional=True),
            inp("theta", "rad", "measured joint angle", optional=True),
            inp("M_load", "N.m", "outside torque to be added to M", optional=True),
            inp("schedule", "", "signal that the gains follow", optional=True),
            out("v", "V", "voltage of the torque motor"),
            out("e", "V", "the signal inside the loop, u + test"),
            out("M", "N.m", "torque of a correction motor that belongs to the stabilizer, and M_load", optional=True),
            limit_flag("saturated", "1 while an output is at its limit"),
        ),
    ),
    Socket(
        "VerticalGyro",
        "gyro that keeps the vertical: erection torques in, pitch, roll and lean out",
        (
            inp("omega", "rad/s", "inertial rate of the vehicle, vehicle axes", 3),
            inp("f", "m/s2", "specific force of the vehicle, vehicle axes", 3),
            inp("alpha", "rad/s2", "angular acceleration of the vehicle, vehicle axes", 3, optional=True),
            inp("T_x", "N.m", "erection torque about x of the inner element"),
            inp("T_y", "N.m", "erection torque about y of the inner element"),
            out("pitch", "rad", "pitch of the vehicle as measured"),
            out("roll", "rad", "roll of the vehicle as measured"),
            out("e_x", "rad", "lean against the apparent vertical about x of the inner element"),
            out("e_y", "rad", "lean against the apparent vertical about y of the inner element"),
            out("f_inner", "m/s2", "specific force in axes of the inner element", 3, optional=True),
            out("turn", "rad/s", "inertial rate of the vehicle along the rotor axis", optional=True),
            out("inner", "rad", "angle that the servo of the follow-up ring keeps at 0", optional=True),
            out("ring_angle", "rad", "angle of the follow-up ring", optional=True),
        ),
    ),
    Socket(
        "ErectionController",
        "erection of a vertical gyro: lean in, torques out",
        (
            inp("e_x", "rad", "lean against the apparent vertical about x"),
            inp("e_y", "rad", "lean against the apparent vertical about y"),
            inp("f_inner", "m/s2", "specific force in axes of the inner element", 3, optional=True),
            inp("turn", "rad/s", "inertial rate of the vehicle along the rotor axis", optional=True),
            out("T_x", "N.m", "torque about x of the inner element"),
            out("T_y", "N.m", "torque about y of the inner element"),
            out("cut", "1", "channels that are cut off", optional=True, whole=True),
            out("starting", "1", "1 during a fast start", optional=True, whole=True),
        ),
    ),
    Socket(
        "Estimator",
        "estimates a signal from its noisy measurement",
        (
            inp("z", "", "the measurement"),
            inp("valid", "1", "0 marks a measurement to be left out", optional=True, whole=True),
            inp("angle", "rad", "angle of a reference that aids it", optional=True),
            inp("angle_new", "1", "1 in the step in which that angle is read", optional=True, whole=True),
            out("estimate", "", "estimate of the signal"),
            out("variance", "", "its variance, square of the unit", optional=True),
            out("innovation", "", "measurement minus prediction", optional=True),
            out("nis", "1", "normalized innovation squared", optional=True),
            out("R_hat", "", "estimated variance of the measurement, square of the unit", optional=True),
            out("latency", "s", "delay of the estimate", optional=True),
        ),
    ),
    Socket(
        "InertialUnit",
        "gyros, accelerometers and heading reference on a vehicle: its motion in, readings out",
        (
            inp("omega", "rad/s", "inertial rate, vehicle axes", 3),
            inp("alpha", "rad/s2", "angular acceleration, vehicle axes", 3, optional=True),
            inp("f", "m/s2", "specific force, vehicle axes", 3),
            inp("angle", "rad", "pitch, roll, heading of the vehicle", 3, optional=True),
            out("indicated", "rad/s", "rates that the gyros indicate, mean over the communication step", 3),
            out("f_read", "m/s2", "specific force that the accelerometers read, vehicle axes", 3),
            out("heading", "rad", "heading as read last", optional=True),
            out("heading_new", "1", "1 in the step in which the heading is read", optional=True, whole=True),
            out("static", "rad/s", "static drift in the rates (diagnostic)", 3, optional=True),
            out("bias", "rad/s", "biases of the rates (diagnostic)", 3, optional=True),
        ),
    ),
    Socket(
        "RateCompensator",
        "takes known errors off the indicated rates",
        (
            inp("indicated", "rad/s", "rates that the gyros indicate", 3),
            inp("f", "m/s2", "specific force as read, vehicle axes", 3, optional=True),
            out("omega", "rad/s", "rate, vehicle axes", 3),
            out("static", "rad/s", "static drift that was added to the rates", 3, optional=True),
        ),
    ),
    Socket(
        "AttitudeEstimator",
        "attitude and gyro biases of a vehicle from rates, specific force and heading",
        (
            inp("omega", "rad/s", "inertial rate as measured, vehicle axes, mean over the communication step", 3),
            inp("f", "m/s2", "specific force as measured, vehicle axes", 3),
            inp("heading", "rad", "heading as read", optional=True),
            inp("heading_new", "1", "1 in the step in which the heading is read", optional=True, whole=True),
            out("angle", "rad", "estimated pitch, roll, heading", 3),
            out("bias", "rad/s", "estimated biases of the rates", 3),
            out("covariance", "1", "of the rotation (rad) and the biases (rad/s), vehicle axes", 6, 6, optional=True),
            out("nis", "1", "squared innovations over their variances, sum over the readings", optional=True),
            out("used", "1", "readings used in the step", optional=True, whole=True),
            limit_flag("aided", "1 while the specific force is used"),
        ),
    ),
)
