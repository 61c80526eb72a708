"""Attitudes of what moves in a system, from its record: tables, gimbals, instruments.

    bodies = '''
        table: base table.base, x table.tilt[1], y table.tilt[2], z table.angle
        instrument: table, faces sequencer
        inner gimbal: outer gimbal, x platform.theta[1]
    '''

A line is a body: what it stands on ("ENU" where none of the bodies is named), then turns, each about an axis of the
body as it is turned so far, passive and right-handed (CONV-GIMBALS): "x CHANNEL" by an angle of the record, or by a
parameter of a part where no channel has this name; "base PARAMETER", a matrix whose rows are its axes on what it stands
on; "faces SLOT", the mounts of the plan of this sequencer, phase by phase; "mounts SLOT",
those of a stand that turns the whole table, in east, north, up; "outer SLOT" and "middle SLOT", the gimbals of a
platform whose parameter ``mount`` says which is outside, 0: roll about y by theta[2], 1: pitch about x by theta[1].
"z CHANNEL or windows": where the record lacks the channel, the angle that its windows begin and end with, which
is that of a table that rests or turns evenly within a window; between two windows it is interpolated.

Not modelled: what the record does not hold (wobble of an axis, bending), and where the bodies are.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gyrobench import frames
from gyrobench.arrays import AnyArray, Array
from gyrobench.record.record import Record
from gyrobench.system.values import nest

ROOT = "ENU"
TURN = re.compile(r"(x|y|z|base|faces|mounts|outer|middle)\s+([\w.]+(?:\[\d+\])?)(\s+or windows)?")


@dataclass(frozen=True)
class MovingBody:
    """A body: its name, what it stands on, and its turns: (kind, name of a channel, a parameter or a slot).

    windows: channels whose place the angles of the windows take.
    """

    name: str
    on: str
    turns: tuple[tuple[str, str], ...]
    windows: tuple[str, ...] = ()


def parse_bodies(text: str) -> list[MovingBody]:
    """Return the bodies of a declaration, each behind what it stands on.  Raises ValueError naming the line."""
    found: list[MovingBody] = []
    for line in filter(None, map(str.strip, text.splitlines())):
        name, colon, rest = (x.strip() for x in line.partition(":"))
        words = [w.strip() for w in rest.split(",")] if rest else []
        known = {b.name for b in found}
        on = words.pop(0) if words and words[0] in {*known, ROOT} else ROOT
        turns = [TURN.fullmatch(w) for w in words]
        if not (name and colon) or name in {*known, ROOT} or not all(turns):
            raise ValueError(
                f"bodies: '{line}': write NAME: [BODY,] x|y|z CHANNEL [or windows], base PARAMETER, faces, mounts, "
                "outer or middle SLOT"
            )
        matched = [m for m in turns if m]
        windows = tuple(m[2] for m in matched if m[3])
        found.append(MovingBody(name, on, tuple((m[1], m[2]) for m in matched), windows))
    return found


def attitudes(bodies: list[MovingBody], record: Record, at: AnyArray) -> dict[str, Array]:
    """Return the axes of each body in east, north, up: body -> array (rows of ``at``, 3, 3), rows: its x, y, z axes.

    at: rows of the channels.  A body whose channels or parameters the record lacks is left out, and what stands on it.
    """
    found: dict[str, Array] = {ROOT: np.broadcast_to(np.eye(3), (len(at), 3, 3))}
    for body in bodies:
        if body.on not in found:
            continue
        turns = [_turn(kind, name, record, at, name in body.windows) for kind, name in body.turns]
        known = [t for t in turns if t is not None]
        if len(known) == len(turns):
            axes = found[body.on]
            for turn in known:
                axes = turn @ axes
            found[body.name] = axes
    return {name: axes for name, axes in found.items() if name != ROOT}


def _turn(kind: str, name: str, record: Record, at: AnyArray, windows: bool) -> Array | None:
    """Return the passive rotations of a turn, an array that broadcasts to (rows, 3, 3); None where it is not known."""
    if kind == "faces":
        return _faces(name, record, at)
    if kind == "mounts":
        return _mounts(name, record, at)
    if kind == "base":
        base = record.run.parameters.get(name)
        return None if base is None else np.asarray(base, dtype=float).reshape(3, 3)
    if kind in ("outer", "middle"):
        mount = record.run.parameters.get(f"{name}.mount")
        pitch = (mount == 1) == (kind == "outer")
        kind, name = ("x", f"{name}.theta[1]") if pitch else ("y", f"{name}.theta[2]")
        if mount is None:
            return None
    if name in record.channels:
        return frames.passive("xyz".index(kind), np.asarray(record.channels[name], dtype=float)[at])
    if windows and (angles := _window_angles(record, at)) is not None:
        return frames.passive("xyz".index(kind), angles)
    value = _parameter(record.run.parameters, name)
    return None if value is None else frames.passive("xyz".index(kind), np.asarray([value]))


def _window_angles(record: Record, at: AnyArray) -> Array | None:
    """Return the angle, rad, at rows of the channels, by those at begin and end of the windows; None without them."""
    edges = ("t_start", "t_end", "angle_start", "angle_end")
    if not set(edges) <= set(record.windows) or not len(record.windows["t_start"]):
        return None
    begin, end, first, last = (np.asarray(record.windows[e], dtype=float) for e in edges)
    times, angles = np.stack([begin, end], axis=1).ravel(), np.stack([first, last], axis=1).ravel()
    order = np.argsort(times, kind="stable")
    rows = np.asarray(record.channels["time"], dtype=float)[at]
    return np.asarray(np.interp(rows, times[order], angles[order]), dtype=float)


def _parameter(parameters: Mapping[str, object], name: str) -> float | None:
    """Return a parameter, or an element of one: ``table.tilt[1]``; None where there is none."""
    whole, _, index = name.partition("[")
    held = parameters.get(name, parameters.get(whole))
    if isinstance(held, list | tuple) and index:
        held = held[int(index[:-1]) - 1]
    return float(held) if isinstance(held, int | float) else None


def _faces(slot: str, record: Record, at: AnyArray) -> Array | None:
    """Return the mounts of the plan at rows of the channels."""
    parameters = nest(record.run.parameters)
    faces, order = parameters.get(f"{slot}.faces"), parameters.get(f"{slot}.face_of")
    phases = _phases(slot, record, at)
    if not faces or not order or phases is None:
        return None
    mounts = np.asarray(faces, dtype=float).reshape(-1, 3, 3)
    return np.asarray(mounts[np.asarray(order, dtype=int)[phases - 1] - 1])


def _mounts(slot: str, record: Record, at: AnyArray) -> Array | None:
    """Return the axes of what stands on a stand at rows of the channels: the phase is the number of its mount."""
    parameters = nest(record.run.parameters)
    numbers, latitude = parameters.get(f"{slot}.mounts"), parameters.get(f"{slot}.latitude")
    phases = _phases(slot, record, at)
    if not numbers or latitude is None or phases is None:
        return None
    pole = frames.pole(float(latitude))
    directions = np.array([frames.E, frames.N, frames.U, pole, np.cross(frames.E, pole)])
    chosen = np.asarray(numbers, dtype=int)  # of x and y, negative: the opposite direction
    x, y = (np.sign(n)[:, None] * directions[np.abs(n) - 1] for n in chosen.T)
    held = np.stack([x, y, np.cross(x, y)], axis=1) @ np.reshape(parameters[f"{slot}.base"], (3, 3)).T
    for axis, angle in enumerate(parameters[f"{slot}.misalignment"]):
        held = frames.passive(axis, np.asarray([angle])) @ held
    return np.asarray(held[phases - 1])


def _phases(slot: str, record: Record, at: AnyArray) -> AnyArray | None:
    """Return the phase of each row of the channels, as the slot says or until the end of its last window, or None."""
    said = record.channels.get(f"{slot}.phase")
    if said is not None:
        own: AnyArray = np.maximum(np.asarray(said)[at].astype(int), 1)
        return own
    if not {"phase", "t_end"} <= set(record.windows) or not len(record.windows["phase"]):
        return None
    phases = np.asarray(record.windows["phase"], dtype=int)
    ends = np.asarray(record.windows["t_end"], dtype=float)
    rows = np.minimum(np.searchsorted(ends, np.asarray(record.channels["time"], dtype=float)[at]), len(ends) - 1)
    found: AnyArray = phases[rows]
    return found
