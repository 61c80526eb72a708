"""Motor of a table: its constants, friction and inertia of the axis, from runs of a free table at known torque."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.loop_test import LoopTest
from gyrobench.system.families.option_groups import VERTICAL_AXIS
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.part_values import PartValues
from gyrobench.system.sockets import element_names
from gyrobench.system.system import Option, Slot

METER = Socket(
    "Meter",
    "voltmeter or ammeter: a signal in, its reading out",
    (inp("x", "", "signal"), out("reading", "", "signal as it is read")),
)
ALONG = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)  # face: nothing is mounted, any will do
METERS = {"voltmeter": "drive.voltage", "ammeter": "drive.current"}
RUMBLE = 1e-3  # N.m/sqrt(Hz), random torque on the axis
STEPS = 16  # of torque, one after the other, for the winding or the lag
STEP_TIME = 0.02  # s of each: some time constants of a winding
REST = 0.05  # s before a torque is measured: currents are steady


class TableMotorTest(LoopTest):
    """The motor runs a free table up, both ways and at two torques; between the runs it coasts, and a known torque,
    hung on the table, brakes it.  Voltage, current and angle are read.

        J w' = M(i or U, w) + M_h - D w - M_C sgn w        M = K_t i,  U = R i + K_e w + L i'        or  M = K V |V|

    The known torque M_h gives the inertia, and so the scale of all torques.

    [MOTOR-TEST, MOTOR-DC, MOTOR-SQUARELAW; Hu 1981, eq. 5-1, 5-7]
    """

    title = "Motor of a turntable"
    spec = ("MOTOR-TEST", "MOTOR-DC", "MOTOR-SQUARELAW")
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "site": Slot("Site", "site"),
        "drive": Slot("Drive", "motor_dc"),
        "body": Slot("TableBody", "table_body"),
        "reader": Slot("AngleReader", "inductosyn"),
        **{name: Slot(METER, "meter") for name in METERS},
    }
    wires = """
        site -> body: f=f_local omega=omega_local
        exciter.torque[1] -> drive.demand
        exciter.torque[2] -> body.M_load
        body.rate -> drive.rate
        drive.torque -> body.torque
        body -> reader: angle rate
        """ + "".join(f"{source} -> {name}.x\n" for name, source in METERS.items())
    raw = dict(zip(element_names("body.face", (3, 3)), ALONG, strict=True))
    options = {
        "torque": Option(4.0, "N.m", "demanded torque of the runs; half of it too", 1e-3),
        "hung": Option(1.0, "N.m", "known torque, hung on the table to either side", 1e-3),
        "rate": Option(0.8, "rad/s", "rate to which the table is run up", 0.1),
        "J": Option(2.56, "kg.m2", "inertia of table and load, from which the times of the runs follow", 1e-3,
                    sets="body.axis_J"),
        "coast": Option(2.0, "s", "time of each coasting", 0.2),
        "friction": Option(0.1, "N.m", "Coulomb friction of the axis", 0.0, sets="body.axis_friction"),
        "viscous": Option(0.03, "N.m.s/rad", "viscous drag of the axis", 0.0, sets="body.axis_viscous"),
        "u_hung": Option(0.0, "1", "relative standard uncertainty of the hung torque", 0.0),
        "u_voltage": Option(0.0, "1", "relative standard uncertainty of the voltmeter", 0.0),
        "u_current": Option(0.0, "1", "relative standard uncertainty of the ammeter", 0.0),
        **VERTICAL_AXIS,
    }  # fmt: skip
    assumed = ("voltmeter.scale_error", "ammeter.scale_error")
    noises = ("body.axis_rumble", "voltmeter.noise_rms", "ammeter.noise_rms", "reader.encoder_reading")
    step = 2e-5
    channel_period = 1e-4
    channels = (
        "exciter.phase", "exciter.gate", "exciter.torque[1]", "exciter.torque[2]", "reader.angle_read",
        "voltmeter.reading", "ammeter.reading", "drive.saturated",
    )  # fmt: skip
    bodies = """
        table: base body.base, x body.tilt[1], y body.tilt[2], z reader.angle_read
        instrument: table, base body.face
    """
    shown = ("reader.angle_read", "voltmeter.reading", "ammeter.reading", "exciter.torque")

    def phases(self) -> list[LoopPhase]:
        """Return, at two torques: up, coast, brake through zero by the hung torque and back, down; then steps."""
        J, rate = self["J"], self["rate"]
        phases = []

        def push(name: str, axis: int, torque: float, change: float) -> None:
            shown = f"{name} {torque:+.4g} N·m".replace("-", "−")
            phases.append(LoopPhase(shown, "torque", "constant", axis, torque, settle=REST,
                                    dwell=max(2.0 * REST, J * change / abs(torque) - REST)))  # fmt: skip
            phases.append(LoopPhase("coasting", settle=REST, dwell=self["coast"]))

        for k, size in enumerate((self["torque"], 0.5 * self["torque"])):
            push("motor", 1, size, rate if k == 0 else 2.0 * rate)
            push("hung", 2, -self["hung"], 2.0 * rate)
            push("hung", 2, self["hung"], 2.0 * rate)
            push("motor", 1, -size, 2.0 * rate)
        for k in range(STEPS):
            sign = 1.0 if k % 2 == 0 else -1.0
            phases.append(LoopPhase(f"step {k + 1}", "torque", "constant", 1, sign * 2.0 * self["torque"],
                                    dwell=STEP_TIME))  # fmt: skip
        return phases

    def design(self, parts: PartValues) -> dict[str, Any]:
        noise = {"body.axis_rumble?": RUMBLE, "voltmeter.noise_rms?": 0.05, "ammeter.noise_rms?": 2e-3}
        # a multiplier loop lags by 4 alpha / K_v2, 0.1 mrad in the steps: counted without it
        return {**noise, "reader.rate_max?": 4.0 * self["rate"], "reader.loop_type?": 0}

    def check(self) -> list[str]:
        problems = []
        for name in ("torque", "hung"):
            if self[name] < 4.0 * self["friction"] * (2.0 if name == "torque" else 1.0):
                problems.append(
                    f"{name} = {self[name]:g} N.m: friction of {self['friction']:g} N.m takes more than a quarter of "
                    f"{'half of it' if name == 'torque' else 'it'}; take a larger torque"
                )
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        names = {"drive.motor_i_max": "drive.motor_K_t", "drive.motor_U_max": "drive.motor_K"}
        for limit, constant in names.items():
            if limit in parameters and constant in parameters:
                power = 1.0 if limit.endswith("i_max") else 2.0
                most = float(parameters[constant]) * float(parameters[limit]) ** power
                if 2.0 * self["torque"] > 0.95 * most:
                    return [
                        f"torque = {self['torque']:g} N.m: the steps take twice as much, the motor gives {most:.4g} N.m"
                    ]
        if parameters.get("drive.motor_shaper") == 0.0:
            return ["drive.motor_shaper = 0: the constants of a shaper are sought; take drive.motor_shaper = 1"]
        return []
