"""Sockets: what a slot of a system asks of the FMU that is put into it.

A socket is a named set of connectors with causality, unit, shape and meaning.  Any FMU that offers them
fits, ours or a foreign one (through a mapping file, see :mod:`gyrobench.system.binding`).  Variables
beyond the socket are allowed and stay at their start values; parameters are no part of a socket.

Conventions of the connectors: SI units; vectors along I, O, S (gyro), face axes (table) or ENU (site);
``f`` is the specific force a - G, what an accelerometer reads: at rest it points up.
"""

from __future__ import annotations

from dataclasses import dataclass

Shape = tuple[int, ...]


def element_names(name: str, shape: Shape) -> list[str]:
    """FMI 2 names of the elements of an array, row by row: ``face[1,1]``, ``face[1,2]`` ..."""
    if not shape:
        return [name]
    indices = [""]
    for n in shape:
        indices = [f"{head},{i}" if head else str(i) for head in indices for i in range(1, n + 1)]
    return [f"{name}[{i}]" for i in indices]


@dataclass(frozen=True)
class Connector:
    """One variable (or array of variables) of a socket."""

    name: str
    causality: str  # "input" | "output", seen from the part in the slot
    unit: str  # "" = any: neither checked nor converted
    meaning: str
    shape: Shape = ()
    optional: bool = False
    whole: bool = False  # integer valued: an Integer or Boolean variable fits as well as a Real one

    @property
    def elements(self) -> list[str]:
        return element_names(self.name, self.shape)


@dataclass(frozen=True)
class Socket:
    """A named set of connectors."""

    name: str
    meaning: str
    connectors: tuple[Connector, ...]

    def connector(self, name: str) -> Connector | None:
        """The connector called ``name`` (without index), or None."""
        return next((c for c in self.connectors if c.name == name), None)


def _in(name: str, unit: str, meaning: str, *shape: int, optional: bool = False, whole: bool = False) -> Connector:
    return Connector(name, "input", unit, meaning, shape, optional, whole)


def _out(name: str, unit: str, meaning: str, *shape: int, optional: bool = False, whole: bool = False) -> Connector:
    return Connector(name, "output", unit, meaning, shape, optional, whole)


SOCKETS: dict[str, Socket] = {
    s.name: s
    for s in (
        Socket(
            "Site",
            "where the test stands: gravity and Earth rate",
            (
                _out("f", "m/s2", "specific force of a body at rest, ENU", 3),
                _out("omega", "rad/s", "Earth rate, ENU", 3),
                _out("g", "m/s2", "local gravity", optional=True),
            ),
        ),
        Socket(
            "SdfGyro",
            "single-degree-of-freedom gyro, case inputs and torquer in, pickoff out",
            (
                _in("omega", "rad/s", "inertial rate of the case along I, O, S", 3),
                _in("alpha", "rad/s2", "angular acceleration of the case along I, O, S", 3, optional=True),
                _in("f", "m/s2", "specific force along I, O, S", 3),
                _in("i", "A", "torquer current"),
                _in("dT", "K", "temperature differences along I, O, S", 3, optional=True),
                _out("u", "V", "pickoff voltage"),
                _out("drift", "rad/s", "drift rate, precession sign (diagnostic)", optional=True),
                _out("b", "rad", "float angle (diagnostic)", optional=True),
                _out("saturated", "1", "1 while the pickoff is saturated", optional=True, whole=True),
            ),
        ),
        Socket(
            "TwoAxisGyro",
            "two-degree-of-freedom gyro, case inputs and two torquers in, two pickoffs out",
            (
                _in("omega", "rad/s", "inertial rate of the case along x, y, z (outer gimbal, inner gimbal, spin)", 3),
                _in("alpha", "rad/s2", "angular acceleration of the case along x, y, z", 3, optional=True),
                _in("f", "m/s2", "specific force along x, y, z", 3),
                _in("i_x", "A", "current of the torquer about x, which nulls u_y"),
                _in("i_y", "A", "current of the torquer about y, which nulls u_x"),
                _out("u_x", "V", "x pickoff voltage: case against rotor about x"),
                _out("u_y", "V", "y pickoff voltage: case against rotor about y"),
                _out("drift_x", "rad/s", "drift rate about x, precession sign (diagnostic)", optional=True),
                _out("drift_y", "rad/s", "drift rate about y, precession sign (diagnostic)", optional=True),
                _out("saturated", "1", "1 while a pickoff is saturated", optional=True, whole=True),
            ),
        ),
        Socket(
            "Accelerometer",
            "accelerometer with its own rebalance: specific force in, current out",
            (
                _in("f", "m/s2", "specific force along x, y, z (input, output, pendulum axis)", 3),
                _out("i", "A", "rebalance current"),
                _out("i_read", "A", "rebalance current as measured"),
                _out("theta", "rad", "angle of the pendulum (diagnostic)", optional=True),
                _out("saturated", "1", "1 while the current is limited", optional=True, whole=True),
            ),
        ),
        Socket(
            "Rebalance",
            "torque rebalance: pickoff voltage to torquer current",
            (
                _in("u", "V", "pickoff voltage"),
                _out("i", "A", "torquer current"),
                _out("i_read", "A", "torquer current as measured"),
                _out("saturated", "1", "1 while the current is limited", optional=True, whole=True),
            ),
        ),
        Socket(
            "Table",
            "turntable with one driven axis",
            (
                _in("f_local", "m/s2", "specific force at the site, ENU", 3),
                _in("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
                _in("mode", "1", "0 hold, 1 index to the target angle, 2 turn at the target rate", whole=True),
                _in("target", "", "angle (rad) or rate (rad/s), by mode"),
                _in("face", "1", "rows: the gyro axes I, O, S in table axes", 3, 3),
                _out("angle", "rad", "table angle, cumulative"),
                _out("rate", "rad/s", "table rate relative to its base", optional=True),
                _out("angle_read", "rad", "table angle as the encoder reads it, cumulative"),
                _out("omega", "rad/s", "inertial rate in face axes", 3),
                _out("alpha", "rad/s2", "angular acceleration in face axes", 3, optional=True),
                _out("f", "m/s2", "specific force in face axes", 3),
                _out("in_position", "1", "1 when the target is reached", whole=True),
            ),
        ),
        Socket(
            "TwoAxisTable",
            "turntable with an outer axis X and an inner axis Y",
            (
                _in("f_local", "m/s2", "specific force at the site, ENU", 3),
                _in("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
                _in("mode_x", "1", "outer axis: 0 hold, 1 index to the target angle, 2 turn at the rate", whole=True),
                _in("target_x", "", "outer axis: angle (rad) or rate (rad/s), by mode"),
                _in("mode_y", "1", "inner axis: mode", whole=True),
                _in("target_y", "", "inner axis: angle (rad) or rate (rad/s), by mode"),
                _in("face", "1", "rows: the gyro axes in plate axes", 3, 3),
                _out("angle_x", "rad", "outer angle, cumulative"),
                _out("angle_y", "rad", "inner angle, cumulative"),
                _out("angle_x_read", "rad", "outer angle as the encoder reads it"),
                _out("angle_y_read", "rad", "inner angle as the encoder reads it"),
                _out("omega", "rad/s", "inertial rate in face axes", 3),
                _out("alpha", "rad/s2", "angular acceleration in face axes", 3, optional=True),
                _out("f", "m/s2", "specific force in face axes", 3),
                _out("in_position", "1", "1 when both targets are reached", whole=True),
            ),
        ),
        Socket(
            "Sequencer",
            "runs the plan: one phase after another",
            (
                _in("angle", "rad", "table angle"),
                _in("in_position", "1", "1 when the table has reached its target", optional=True, whole=True),
                _out("phase", "1", "number of the running phase, from 1", whole=True),
                _out("mode", "1", "table mode of the phase", whole=True),
                _out("target", "", "table target of the phase"),
                _out("target_y", "", "target of a second axis of the table", optional=True),
                _out("face", "1", "mount of the phase", 3, 3),
                _out("gate", "1", "0 closed, 1 windows by time, 2 windows by angle", whole=True),
                _out("window", "", "window length, s or rad by gate"),
                _out("done", "1", "1 when the plan is finished", whole=True),
            ),
        ),
        Socket(
            "Sampler",
            "averages a signal over windows of time or angle",
            (
                _in("x", "", "the signal"),
                _in("angle", "rad", "table angle"),
                _in("gate", "1", "see Sequencer", whole=True),
                _in("window", "", "window length, s or rad by gate"),
                _in("phase", "1", "number of the running phase", whole=True),
                _in("flag", "1", "1 marks a sample as suspect", optional=True, whole=True),
                _out("count", "1", "windows completed so far", whole=True),
                _out("window_phase", "1", "phase of the last window", whole=True),
                _out("mean", "", "mean of the signal over the last window"),
                _out("std", "", "standard deviation of the samples in the last window"),
                _out("n", "1", "samples in the last window", whole=True),
                _out("angle_start", "rad", "angle at the start of the last window"),
                _out("angle_end", "rad", "angle at the end of the last window"),
                _out("t_start", "s", "start of the last window"),
                _out("t_end", "s", "end of the last window"),
                _out("flagged", "1", "flagged samples in the last window", whole=True),
            ),
        ),
    )
}


def socket(name: str | Socket) -> Socket:
    """The socket called ``name``, or a system's own; raises KeyError naming those that exist."""
    if isinstance(name, Socket):
        return name
    if name not in SOCKETS:
        raise KeyError(f"socket '{name}': unknown; sockets: {', '.join(SOCKETS)}")
    return SOCKETS[name]
