"""Sockets of stabilized lines of sight: gimbal, decoupler of its rates, vibration of its base, target, tracker.

Elements of two: (1) pitch about x, (2) yaw about z; the line of sight is y of the inner gimbal.  [GIMBAL-2AXIS]
"""

from __future__ import annotations

from gyrobench.system.connectors import Socket, inp, limit_flag, out

GIMBALS: tuple[Socket, ...] = (
    Socket(
        "TwoAxisGimbal",
        "gimbal of two axes, yaw-pitch or pitch-yaw: motors in, motion of the inner gimbal out",
        (
            inp("v", "V", "voltages of the motors: pitch, yaw", 2),
            inp("M_load", "N.m", "disturbance torques about the joints: pitch, yaw", 2),
            inp("omega_b", "rad/s", "inertial rate of the base, base axes", 3),
            inp("alpha_b", "rad/s2", "angular acceleration of the base, base axes", 3, optional=True),
            inp("f_b", "m/s2", "specific force of the base, base axes", 3, optional=True),
            out("theta", "rad", "joint angles as an encoder reads them: pitch, yaw", 2),
            out("omega", "rad/s", "inertial rate of the inner gimbal, its axes", 3),
            out("alpha", "rad/s2", "angular acceleration of the inner gimbal, its axes", 3, optional=True),
            out("f", "m/s2", "specific force, axes of the inner gimbal", 3, optional=True),
            out("los", "rad", "line of sight against a fixed direction, about x and z of the inner gimbal", 2),
            limit_flag("keyhole", "1 while the inner joint is too near to 90 degrees"),
            limit_flag("saturated", "1 while a motor is at its limit"),
        ),
    ),
    Socket(
        "LosDecoupler",
        "rates of a line of sight to signals of two joints",
        (
            inp("rate", "rad/s", "measured rates of the line of sight about x and z", 2),
            inp("command", "rad/s", "rates commanded to it", 2, optional=True),
            inp("theta", "rad", "joint angles: pitch, yaw", 2),
            out("u_axes", "V", "signals about the joints: pitch, yaw", 2),
            limit_flag("saturated", "1 while a gain is at its limit"),
        ),
    ),
    Socket(
        "Vibration",
        "vibration that is added to the motion of a base",
        (
            inp("phase", "1", "number of the running phase", optional=True, whole=True),
            inp("omega_b", "rad/s", "inertial rate of the base without it, base axes", 3),
            inp("alpha_b", "rad/s2", "its derivative", 3),
            inp("f_b", "m/s2", "specific force without it, base axes", 3),
            out("omega", "rad/s", "inertial rate of the base, base axes", 3),
            out("alpha", "rad/s2", "its derivative", 3),
            out("f", "m/s2", "specific force of the base, base axes", 3),
        ),
    ),
    Socket(
        "Target",
        "direction of a target against a fixed frame, that of the tracker at the start: y along its line of sight",
        (
            inp("phase", "1", "number of the running phase", optional=True, whole=True),
            out("direction", "1", "unit vector to the target, fixed frame", 3),
            out("omega", "rad/s", "inertial rate of that direction, fixed frame", 3),
            out("alpha", "rad/s2", "its derivative", 3),
        ),
    ),
    Socket(
        "Tracker",
        "camera and image processing on a line of sight: how far the target is from it, in two axes",
        (
            inp("direction", "1", "unit vector to the target, fixed frame", 3),
            inp("omega_target", "rad/s", "inertial rate of that direction, fixed frame", 3, optional=True),
            inp("alpha_target", "rad/s2", "its derivative", 3, optional=True),
            inp("omega", "rad/s", "inertial rate of the tracker, its axes", 3),
            inp("alpha", "rad/s2", "its derivative", 3, optional=True),
            out("error", "rad", "measured error of the line of sight, about x and z; + : the target is up, left", 2),
            out("miss", "rad", "true error, about x and z", 2),
            out("rate", "rad/s", "true inertial rate of the target's direction, about x and z of the tracker", 2),
            out("acceleration", "rad/s2", "its derivative, about the same axes", 2),
            limit_flag("lost", "1 while the target is lost"),
        ),
    ),
)
