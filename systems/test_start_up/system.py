"""Start, self-test, test and shutdown of a gyro by a program; with a fault put in, the start is broken off by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.option_groups import VERTICAL_AXIS
from gyrobench.system.families.table_test import SDF_NOISES
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System, Windows
from gyrobench.units import ARCSEC

PROGRAM = Socket(
    "TestProgram",
    "program of a gyro test: switches what is on, tests it, and stops at what is wrong",
    (
        inp("temperature", "K", "temperature of the gyro"),
        inp("wheel_current", "A", "current of the wheel"),
        inp("wheel_speed", "rad/s", "speed of the wheel"),
        inp("reference", "V", "voltage of the reference"),
        inp("u", "V", "pickoff voltage as read"),
        inp("i_loop", "A", "current that the rebalance loop wants"),
        inp("i_read", "A", "current of the loop as measured"),
        inp("angle_read", "rad", "table angle as read"),
        inp("in_position", "1", "1 when the table has reached its target"),
        out("heater", "1", "1: heater on"),
        out("wheel", "1", "1: wheel supplied"),
        out("brake", "1", "1: wheel braked"),
        out("excitation", "1", "1: pickoff excited"),
        out("i", "A", "current of the torquer"),
        out("mode", "1", "mode of the table"),
        out("target", "rad", "target of the table"),
        out("state", "1", "running step", whole=True),
        out("reason", "1", "why the start was broken off", whole=True),
        out("count", "1", "rows that are written", whole=True),
        out("row_step", "1", "step of the row", whole=True),
        out("row_value", "1", "what it found"),
        out("row_begun", "s", "its begin"),
        out("row_ended", "s", "its end"),
        out("row_last", "1", "1: it ends the step", whole=True),
        out("done", "1", "1 at the end", whole=True),
    ),
)
STAND = Socket(
    "GyroStand",
    "wheel with its supply, excitation of the pickoff, reference",
    (
        inp("wheel", "1", "other than 0: the wheel is supplied"),
        inp("brake", "1", "other than 0: the wheel is braked"),
        inp("excitation", "1", "other than 0: the pickoff is excited"),
        inp("u", "V", "pickoff voltage of the gyro"),
        inp("i", "A", "current for the torquer"),
        out("i_out", "A", "current of the torquer"),
        out("u_out", "V", "pickoff voltage as read"),
        out("wheel_current", "A", "current of the wheel as read"),
        out("wheel_speed", "rad/s", "speed of the wheel"),
        out("reference", "V", "voltage of the reference as read"),
    ),
)
HEATER = Socket(
    "Heater",
    "thermostat of a gyro that can be switched",
    (inp("on", "1", "0: the heaters are off"), out("temperature", "K", "temperature of the gyro")),
)

#: faults that can be put in: parameter, its value from that of the part without a fault (or alone)
Change = tuple[str, Callable[[Any], Any]]
FAULTS: dict[str, tuple[Change, ...]] = {
    "none": (),
    "heater weak": (("heater.power", lambda _: [150.0, 100.0, 46.0]),),
    "wheel drag": (("stand.D", lambda x: 4.0 * x),),
    "wheel voltage": (("stand.supply", lambda x: 0.5 * x),),
    "wheel voltage lost": (("stand.dropped", lambda _: 0.5),),
    "reference": (("stand.V_ref", lambda x: 1.002 * x),),
    "pickoff null": (("stand.offset", lambda x: x + 2e-4),),
    "pickoff range": (("gyro.D_F", lambda x: x + 1e-3),),
    "torquer polarity": (("stand.polarity", lambda _: -1),),
    "torquer scale": (("gyro.k", lambda x: 0.9 * x),),
    "loop hunting": (("rebalance.K_p", lambda x: 20.0 * x),),
    "loop dead": (("rebalance.i_max", lambda x: 1e-6 * x),),
    "loop slow": (("rebalance.K_p", lambda x: 0.01 * x), ("rebalance.K_i", lambda x: 1e-4 * x)),
    "table angle": (("table.encoder_amplitude", lambda _: [30.0 * ARCSEC, 0.0]),),
    "wheel brake": (("stand.M_b", lambda _: 0.0),),
}
COUNT = 0.036 * ARCSEC  # rad, of the table's angle


class TestStartUp(System):
    """A program starts a floated gyro (heater, wheel, excitation, loop), tests what it switches on, runs the test and
    shuts down; a fault that is put in must break the start off by its name.

    [TEST-START-UP; Hu 1981, section 6.1 (items 4 to 6)]
    """

    title = "Start, self-test and shutdown by program"
    spec = ("TEST-START-UP", "TABLE-PROGRAM", "THERMOSTAT", "LOOP-REBALANCE")
    slots = {
        "site": Slot("Site", "site"),
        "program": Slot(PROGRAM, "test_program"),
        "heater": Slot(HEATER, "thermostat"),
        "table": Slot("Table", "table_rate"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "stand": Slot(STAND, "gyro_stand"),
        "rebalance": Slot("Rebalance", "rebalance_analog"),
    }
    wires = """
        site -> table: f=f_local omega=omega_local
        program -> table: mode target
        table -> program: angle_read in_position
        table -> gyro: omega alpha f
        heater.temperature -> gyro.temperature
        heater.temperature -> program.temperature
        gyro.u -> stand.u
        stand.u_out -> program.u
        stand.u_out -> rebalance.u
        stand -> program: wheel_current wheel_speed reference
        rebalance.i -> program.i_loop
        rebalance.i_read -> program.i_read
        program.i -> stand.i
        stand.i_out -> gyro.i
        program.heater -> heater.on
        program -> stand: wheel brake excitation
    """
    open = ("table.face",)
    options = {
        "fault": Option("none", str, "what is put out of order: " + ", ".join(FAULTS)),
        "repeats": Option(5, int, "repeats of each self-test", 3, 20, sets="program.repeats"),
        "t_heat": Option("5min", "s", "longest time until temperature is reached", 1.0, sets="program.t_heat"),
        "t_wheel": Option("1min", "s", "longest time until the wheel is synchronous", 1.0, sets="program.t_wheel"),
        "t_close": Option("20s", "s", "longest time until the float is captured", 1.0, sets="program.t_close"),
        "t_brake": Option("1min", "s", "longest time until the wheel is at rest", 1.0, sets="program.t_brake"),
        "scale": Option("5%", "1", "tolerance of the torquer's scale factor", 1e-4, 0.5,
                        sets="program.scale_tolerance"),
        "angle": Option("3arcsec", "rad", "tolerance of the table angle", 1e-7, sets="program.angle_most"),
        "dwell": Option("1min", "s", "length of the test", 1.0, sets="program.dwell"),
        **VERTICAL_AXIS,
    }  # fmt: skip
    windows = Windows(
        "program.count",
        {
            "step": "program.row_step",
            "value": "program.row_value",
            "begun": "program.row_begun",
            "ended": "program.row_ended",
            "last": "program.row_last",
            "reason": "program.reason",
        },
    )
    done = "program.done"
    closed_loop = True
    channel_period = 0.1
    channels = (
        "program.state", "program.reason", "heater.temperature", "stand.wheel_speed", "stand.wheel_current",
        "stand.u_out", "program.i", "table.angle",
    )  # fmt: skip
    bodies = """
        table: base table.base, x table.tilt[1], y table.tilt[2], z table.angle
        instrument: table
    """
    shown = (
        "program.state", "heater.temperature", "stand.wheel_speed", "stand.wheel_current", "stand.u_out", "program.i",
        "table.angle",
    )  # fmt: skip
    noises = (*SDF_NOISES, "rebalance.meter", "stand.pickoff", "stand.reading", "stand.ammeter")

    @property
    def stop(self) -> float:  # type: ignore[override]
        """Return the longest time that the program can take, s."""
        waits = sum(float(self[n]) for n in ("t_heat", "t_wheel", "t_close", "t_brake", "dwell"))
        return float(waits + 20.0 * self["repeats"] + 30.0)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        nominal = {
            "program.gain": parts["gyro.K_sg"] * parts["gyro.H"] * parts["gyro.k"] / parts["gyro.C"],
            "heater.stages": 1,
            "heater.power": [150.0, 100.0, 150.0],
            "heater.cold": True,
            "heater.tau": 20.0,
            "table.quantum": COUNT,
            "stand.drop": self["t_wheel"],
            "program.window": self["dwell"] / 6.0,
        }
        values = {**self.owned(), **nominal}
        for name, change in FAULTS.get(str(self["fault"]), ()):
            base = values.get(name)
            values[name] = change(parts[name] if base is None else base)
        return values

    def check(self) -> list[str]:
        fault = str(self["fault"])
        return [] if fault in FAULTS else [f"fault = {fault}: unknown; available faults: {', '.join(FAULTS)}"]
