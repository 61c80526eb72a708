"""Scale factor and linearity of a torquer: the gyro holds a servo table while a constant current makes it precess."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench import frames, units
from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult, Specification
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.sockets import SOCKETS, Connector, Socket
from gyrobench.system.system import MeasuredData, Option, Slot, System, Windows

from . import measured

DEG = math.pi / 180.0
FACE = "input axis on the table axis"
#: rows I, O, S in table axes at angle 0: input axis on the table axis, output axis on the first
ON_TABLE = ((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
CAPTURE = "capture, no current"
STEADY = 1.0  # s after the current has changed
TOLD = {"H": "H_g", "J": "J_g", "C": "C_g", "K_sg": "K_g"}  # of the gyro -> what the table is told of it

SERVO_TABLE = Socket(
    "ServoTable",
    "turntable that nulls the pickoff of the gyro on it in mode 3",
    (*SOCKETS["Table"].connectors, Connector("u", "input", "V", "pickoff voltage of the gyro")),
)
SOURCE = Socket(
    "CurrentSource",
    "current through the torquer while the gyro holds the table",
    (
        Connector("command", "input", "", "current wanted in servo mode, A"),
        Connector("mode", "input", "1", "mode of the table", whole=True),
        Connector("i", "output", "A", "current"),
        Connector("i_read", "output", "A", "current as measured"),
    ),
)


def base(latitude: float) -> np.ndarray[Any, Any]:
    """Rows: table axes in (E, N, U) at angle 0: the pole, east x pole, east: no Earth rate along the axis."""
    p = frames.pole(latitude)
    return np.array([p, np.cross(frames.E, p), frames.E])


class TorquerScaleFactor(System):
    """The gyro holds a servo table on the axis its torquer precesses about; the table rate over the current is the
    scale factor, its spread over the currents the linearity.

    [TEST-TORQUER; Hu 1981, eq. A3-1..A3-6]
    """

    title = "Torquer scale factor and linearity"
    spec = ("TEST-TORQUER", "SF-APP1", "LIN-TABLE", "LOOP-TABLE-SERVO")
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot(SERVO_TABLE, "table_servo"),
        "source": Slot(SOURCE, "current_source"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "sampler": Slot("Sampler", "sampler"),
    }
    # in servo mode the table has no target: the sequencer's target is the current
    wires = """
        site.f -> table.f_local
        site.omega -> table.omega_local
        sequencer.mode -> table.mode
        sequencer.target -> table.target
        sequencer.face -> table.face
        sequencer.target -> source.command
        sequencer.mode -> source.mode
        table.omega -> gyro.omega
        table.alpha -> gyro.alpha
        table.f -> gyro.f
        source.i -> gyro.i
        gyro.u -> table.u
        table.angle_read -> sequencer.angle
        table.in_position -> sequencer.in_position
        source.i_read -> sampler.x
        table.angle_read -> sampler.angle
        sequencer.gate -> sampler.gate
        sequencer.window -> sampler.window
        sequencer.phase -> sampler.phase
        gyro.saturated -> sampler.flag
    """
    options = {
        "latitude": Option("45.75deg", "rad", "geographic latitude, north positive", -90 * DEG, 90 * DEG),
        "height": Option(0.0, "m", "height above the ellipsoid"),
        "gravity": Option(0.0, "m/s2", "measured gravity of the site; 0: WGS84 normal gravity"),
        "currents": Option("1 5 10 20 40 60 80 100", str, "magnitudes of the currents, mA"),
        "range": Option("10deg", "rad", "angle turned with each current up to 20 mA", 0.0),
        "range_large": Option("100deg", "rad", "angle turned with each larger current", 0.0),
        "k": Option("17.2deg/h/mA", "rad/s/A", "scale factor expected, for the times of the plan", 0.0),
        "slew": Option(0.1, "A/s", "rate at which the current is changed", 0.0),
        "windows": Option(20, int, "readings of the angle over each range", 5, 500),
        "u_current": Option(0.0, "1", "relative standard uncertainty of the ammeter", 0.0),
    }
    noises = ("gyro.turn_on", "gyro.markov", "gyro.white", "gyro.pickoff", "table.rumble", "source.meter")
    measured_data = MeasuredData(measured.TEMPLATE, measured.read)
    windows = Windows.of("sampler")
    done = "sequencer.done"
    channels = ("table.angle", "source.i", "gyro.u", "table.motor")
    channel_period = 1.0

    def currents(self) -> list[float]:
        """Magnitudes, A; raises ValueError for what is no list of numbers."""
        return [float(x) * 1e-3 for x in self["currents"].replace(",", " ").split()]

    def plan(self) -> Plan:
        """Capture without current; then each current in both senses, back over the same angles."""
        try:
            currents = self.currents()
        except ValueError:
            return Plan()
        phases = [Phase(CAPTURE, "servo", FACE, settle=STEADY, dwell=0.5, window=0.5)]
        before, n = 0.0, self["windows"]
        for size in currents:
            way = self["range"] if size < 0.0201 else self["range_large"]
            dwell = way / (self["k"] * size) if self["k"] * size > 0.0 else 1.0
            for i in (size, -size):
                ramp = abs(i - before) / self["slew"] if self["slew"] > 0.0 else 0.0
                label = f"{i * 1e3:+g} mA".replace("-", "−")
                phases.append(
                    Phase(label, "servo", FACE, i, settle=ramp + STEADY, dwell=dwell, travel=way, window=dwell / n)
                )
                before = i
        return Plan(phases, {FACE: ON_TABLE})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        told = {f"gyro.{a}": f"table.{b}" for a, b in TOLD.items()}
        return {
            **self.plan().parameters(),
            "site.latitude": self["latitude"],
            "site.height": self["height"],
            "site.gravity": self["gravity"],
            "table.base": base(self["latitude"]),
            "source.slew": self["slew"],
            **{told[n]: v for n, v in self.overrides.items() if n in told},
        }

    def check(self) -> list[str]:
        try:
            found = self.currents()
        except ValueError:
            return [f"currents = {self['currents']}: numbers in mA are expected, such as 1 5 10 20 40 60 80 100"]
        problems = [f"currents: {i * 1e3:g} mA: give magnitudes, larger than zero" for i in found if not i > 0.0]
        if len(found) < 3:
            problems.append(f"{len(found)} currents: at least 3 are needed for a linearity")
        elif len(set(found)) < len(found):
            problems.append("the same current twice")
        problems += [f"{n} = 0: must be > 0" for n in ("range", "range_large", "k", "slew") if not self[n] > 0.0]
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        found = []
        for name in ("gyro.mount", "table.base"):
            if name in parameters:
                try:
                    frames.check_rotation(parameters[name], name)
                except ValueError as error:
                    found.append(str(error))
        axis = np.asarray(parameters.get("table.base", base(self["latitude"])))[2]
        along = float(axis @ frames.pole(self["latitude"]))
        if abs(along) > DEG:
            rate = along * frames.EARTH_RATE / units.factor("deg/h")
            found.append(
                f"table.base: the axis must be at right angles to the pole (1°); it sees {rate:.3g} °/h of Earth rate"
            )
        limit = parameters.get("source.i_max")
        if limit is not None and max(self.currents()) > limit:
            found.append(
                f"currents up to {max(self.currents()) * 1e3:g} mA: the source gives {limit * 1e3:g} mA at most"
            )
        return found

    def reduce(self, record: Record, specification: Specification | None = None) -> DriftTestResult:
        from .reduction import from_record

        return from_record(record, specification)
