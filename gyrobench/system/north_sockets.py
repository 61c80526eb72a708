"""Sockets of north finders: rate gyro, accelerometers, the estimator of the heading.

Head axes: x right, y forward (the axis whose heading is wanted), z up, at table angle 0; the table turns anticlockwise
about z seen from above, headings count clockwise from north.  [NORTH-COMMON]
"""

from __future__ import annotations

from gyrobench.system.connectors import EXPOSED, Socket, inp, limit_flag, out

NORTH: tuple[Socket, ...] = (
    Socket(
        "RateGyro",
        "gyro with its loop closed inside: inertial rate in, measured rate out",
        (
            inp("omega", "rad/s", "inertial rate, head axes", 3),
            inp("f", "m/s2", "specific force, head axes", 3, optional=True),
            inp("dT", "K", "temperature differences along x, y, z", 3, optional=True),
            *EXPOSED,
            out("rate", "rad/s", "measured rate along x and y", 2),
            out("density", "rad/s/sqrt(Hz)", "two-sided density of its white noise (diagnostic)", optional=True),
            limit_flag("saturated", "1 while a rate is beyond the range"),
        ),
    ),
    Socket(
        "Accelerometers",
        "accelerometers with their loops closed inside: specific force in, measured specific force out",
        (
            inp("f", "m/s2", "specific force, head axes", 3),
            out("f_read", "m/s2", "measured specific force along x, y, z", 3),
        ),
    ),
    Socket(
        "NorthFinder",
        "estimator of a heading from rates, specific force and the angle of the head",
        (
            inp("rate", "rad/s", "measured rate along x and y", 2),
            inp("f", "m/s2", "measured specific force along x, y, z", 3),
            inp("angle", "rad", "table angle as read, anticlockwise from above"),
            inp("gate", "1", "0 closed; samples count while it is open", whole=True),
            inp("phase", "1", "number of the running phase", whole=True),
            inp("finished", "1", "1 when the plan is finished", whole=True),
            inp("target", "rad", "angle that the plan asks of the head", optional=True),
            out("heading", "rad", "heading of the axis y at table angle 0"),
            out("sigma", "rad", "its standard deviation, as the finder has it"),
            out("command", "rad", "angle that the head is to take, of a finder that turns it", optional=True),
            out("bias", "rad/s", "bias of the gyro along y", optional=True),
            out("horizontal", "rad/s", "horizontal Earth rate as measured", optional=True),
            out("pitch", "rad", "pitch of the head, up positive", optional=True),
            out("roll", "rad", "roll of the head, right side down positive", optional=True),
            out("status", "1", "0 none, 1 valid, 2 ill-conditioned, 3 rate wrong, 4 base moves", whole=True),
            out("done", "1", "1 when the heading is final and has stood for a second: the run ends", whole=True),
        ),
    ),
)
