"""Position test of a table: errors of the position by harmonics, wobble, tilt of the axis, squareness of the plate."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.system.connectors import Socket, inp, limit_flag, out
from gyrobench.system.families.option_groups import SITE, type_b
from gyrobench.system.families.table_test import sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, System, Windows
from gyrobench.system.table_program import MotionProgram, read_program
from gyrobench.system.values import InvalidValueError

from . import sources
from .measured import MEASURED

REFERENCE = Socket(
    "PositionReference",
    "reference of a position test: table angle in, deviation from the nominal position and level out",
    (
        inp("angle", "rad", "table angle"),
        inp("f", "m/s2", "specific force, table axes", 3),
        inp("face", "1", "mount: rows are the axes of the reference in table axes", 3, 3),
        out("deviation", "rad", "deviation from the nominal position"),
        out("level_x", "rad", "tilt, x of the reference"),
        out("level_y", "rad", "tilt, y of the reference"),
        limit_flag("lost", "1 while the deviation is beyond its range"),
    ),
)
WOBBLE = Socket(
    "AxisWobble",
    "wobble of the table axis: specific force and rate of the base in, of the wobbling axis out",
    (
        inp("angle", "rad", "table angle"),
        inp("f_base", "m/s2", "specific force, ENU", 3),
        inp("omega_base", "rad/s", "inertial rate, ENU", 3),
        out("f", "m/s2", "specific force along the axes that wobble", 3),
        out("omega", "rad/s", "inertial rate along them", 3),
    ),
)
SAMPLED = {  # sampler -> what it averages
    "sampler": "reference.deviation",
    "level_x": "reference.level_x",
    "level_y": "reference.level_y",
    "tracking": "controller.e",
    "second": "reader_2.angle_read",
    "true": "body.angle",
}


class TablePositionTest(System):
    """A table goes to equal positions both ways; polygon and level are read in several mounts, with a second head.

    [TABLE-POSITION, TABLE-PROGRAM, ANGLE-INDUCTOSYN; Hu 1981, sections 5.4, 6.1]
    """

    title = "Position test of a table"
    spec = ("TABLE-POSITION", "TABLE-PROGRAM", "ANGLE-INDUCTOSYN")
    measured_data = MEASURED
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "command": Slot("TableCommand", "table_command"),
        "wobble": Slot(WOBBLE, "axis_wobble"),
        "body": Slot("TableBody", "table_body"),
        "reader": Slot("AngleReader", "inductosyn"),
        "reader_2": Slot("AngleReader", "inductosyn"),
        "controller": Slot("TableController", "controller_sampled"),
        "drive": Slot("Drive", "motor_square_law"),
        "reference": Slot(REFERENCE, "position_reference"),
        **{name: Slot("Sampler", "sampler") for name in SAMPLED},
    }
    wires = (
        """
        site -> wobble: f=f_base omega=omega_base
        wobble -> body: f=f_local omega=omega_local
        body.angle -> wobble.angle
        sequencer -> command: mode target way move_rate
        command -> controller: count=count_command angle=angle_command rate=rate_command acc=acc_command
        body -> reader: angle rate
        body -> reader_2: angle rate
        reader -> controller: count angle_read
        body.rate -> controller.tacho
        controller -> drive: demand
        body -> drive: rate
        drive -> body: torque
        body -> reference: angle f
        sequencer -> reference: face
        reader.angle_read -> sequencer.angle
        command.arrived -> sequencer.in_position
        reference.lost -> sampler.flag
        """
        + "".join(f"{source} -> {name}.x\n" for name, source in SAMPLED.items())
        + "".join(sampled(name, angle="reader: angle_read") for name in SAMPLED)
    )
    open = ("body.M_load", "body.face")
    options = SITE | {
        "positions": Option(12, int, "positions in a turn: faces of the polygon", 3, 72),
        "mounts": Option("0 30 180", str, "azimuths of polygon and level on the table, deg, whole faces"),
        "orders": Option(3, int, "harmonics of the position error", 1, 35),
        "both_ways": Option(True, bool, "back over the same positions"),
        "move_rate": Option("1deg/s", "rad/s", "rate between positions", sets="command.reference_index_rate"),
        "head": Option(math.pi, "rad", "angle between the two reading heads", sets="reader_2.head"),
        "pole": Option(0.5, "1", "closed-loop poles of a sampled controller", 0.0, 0.99),
        "program": Option("", str, "CSV or JSON file with a program of positions, for --part sequencer=table_program"),
        "settle": Option(2.0, "s", "wait after each move", 0.0),
        "dwell": Option(2.0, "s", "time averaged at each position", 0.01),
        "quantum": Option(0.0, "rad", "angle of a count, of measured data; 0: of the readers", 0.0),
        **type_b(sources),
    }
    windows = Windows.of("sampler", **{n: f"{n}.mean" for n in SAMPLED if n != "sampler"})
    done = "sequencer.done"
    channels = (
        "command.angle", "controller.e", "reference.deviation", "reference.level_x", "drive.torque", "body.angle",
    )  # fmt: skip
    bodies = """
        table: base body.base, x body.tilt[1], y body.tilt[2], z body.angle
    """
    channel_period = 0.1
    noises = ("reference.optical", "reference.level_x_noise", "reference.level_y_noise")

    def azimuths(self) -> list[float]:
        """Return the mounts of the reference, rad."""
        with contextlib.suppress(ValueError):
            angles = [math.radians(float(x)) for x in str(self["mounts"]).split()]
            if all(map(math.isfinite, angles)):
                return angles
        text = f"mounts = {self['mounts']!r}: angles in deg with spaces between are expected, as in '0 30 180'"
        raise InvalidValueError(text)

    def program(self) -> MotionProgram | None:
        """Return the program of the file, if one is given."""
        return read_program(Path(self["program"])) if self["program"] else None

    def plan(self) -> Plan:
        """The positions in each mount, or those of the program in the first one."""
        program = self.program()
        if program is not None:
            name = f"mount {math.degrees(self.azimuths()[0]):g}°"
            rows = [
                Phase(
                    f"{math.degrees(e.target):g}°", e.mode, name, e.target, self["settle"], e.time, window=self["dwell"]
                )
                for e in program.entries
            ]
            return Plan(rows, {name: mount(self.azimuths()[0])})
        n, phases, faces = int(self["positions"]), [], {}
        there = list(range(n))
        for b in self.azimuths():
            name = f"mount {math.degrees(b):g}°"
            faces[name] = mount(b)
            for k in there + ([n, *there[::-1]] if self["both_ways"] else []):
                phases.append(
                    Phase(f"{360.0 * k / n:g}°", "index", name, 2.0 * math.pi * k / n, self["settle"], self["dwell"],
                          window=self["dwell"])
                )  # fmt: skip
        return Plan(phases, faces)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        quantum = parts["reader.quantum"]
        errors = {n: parts[f"reader.encoder_{n}"] for n in SCALE}
        program = self.program()
        planned = self.plan().parameters()
        if program is not None:
            planned = program.parameters() | {
                "sequencer.settle": self["settle"],
                "sequencer.window_time": self["dwell"],
                "sequencer.face_mount": mount(self.azimuths()[0]),
                "sequencer.move_rate_most": self["move_rate"],
            }
        return {
            **planned,
            **self.owned(),
            # one scale, two heads
            **{f"reader_2.encoder_{n}?": x for n, x in errors.items()},
            "reference.faces?": self["positions"],
            "command.reference_quantum?": quantum,
            "controller.quantum?": quantum,
            "controller.law_quantum?": quantum,
            "controller.law_p?": self["pole"],
            "controller.law_J?": parts["body.axis_J"],
            "controller.law_J_ff?": parts["body.axis_J"],
            "controller.bank_J?": parts["body.axis_J"],
            "command.J?": parts["body.axis_J"],
            "wobble.axis?": 3,
        }

    def check(self) -> list[str]:
        azimuths, n = self.azimuths(), int(self["positions"])
        found = []
        if not 1 <= len(azimuths) <= 12:
            found.append(f"mounts: {len(azimuths)} are given, 1 to 12 are possible")
        pitch = 2.0 * math.pi / n
        odd = [f"{math.degrees(b):g}" for b in azimuths if abs(b / pitch - round(b / pitch)) > 1e-9]
        if odd:
            found.append(f"mounts = {', '.join(odd)} deg: must be whole faces of {360.0 / n:g} deg")
        if 2 * int(self["orders"]) >= n:
            found.append(f"orders = {self['orders']}: at most {(n - 1) // 2} harmonics follow from {n} positions")
        program = self.program()
        if program is not None:
            off = [
                e
                for e in program.entries
                if e.mode != "index" or abs(e.target / pitch - round(e.target / pitch)) > 1e-9
            ]
            if program.kind != "positions" or off:
                found.append(
                    f"program: index moves to whole faces of {360.0 / n:g} deg are expected, of kind positions"
                )
        elif self["positions"] * len(azimuths) * (1 + bool(self["both_ways"])) + len(azimuths) > 99:
            found.append(
                f"{len(self.plan().phases)} positions: at most 99 are possible; take fewer positions or mounts, or "
                "both_ways = false"
            )
        return found

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        beyond = parameters.get("command.reference_limit", 0.0)
        if beyond and beyond < 2.0 * math.pi:
            return [f"command.reference_limit = {beyond:g} rad: the test goes through a whole turn"]
        return []


SCALE = (
    "eccentricity", "eccentricity_phase", "tilt", "tilt_phase", "pitch", "pitch_order", "pitch_phase",
    "interpolation", "interpolation_phase", "d0", "de", "e3", "e5",
)  # fmt: skip


def mount(b: float) -> NDArray[np.float64]:
    """Return the mount at an azimuth: rows are the axes of the reference in table axes."""
    c, s = math.cos(b), math.sin(b)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
