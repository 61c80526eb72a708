"""Servo loop of a turntable that a gyro on it holds still: stiffness, margins, what load and slip rings do to it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench.system.families.loop_test import LoopTest, data_sheet, hold, torquer
from gyrobench.system.families.option_groups import VERTICAL_AXIS
from gyrobench.system.families.servo_channel import gyro_on_table
from gyrobench.system.families.table_test import SDF_NOISES
from gyrobench.system.loop_plan import LoopPhase, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.sockets import element_names
from gyrobench.system.system import Option, Slot

from .closed import GCM, loop_of

ALONG = (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0)  # rows of the face: input axis along the table axis
TAU = {1: 4e-4, 2: 1e-3}  # s, of the gyro for which a network is made; 3 and 4: undamped
TESTS = (4.0, 6.0, 9.0, 13.0, 20.0, 30.0, 40.0, 50.0, 62.0, 80.0, 105.0, 140.0, 175.0, 220.0)  # Hz, at 50 Hz crossover
WEIGHTS = (1.0, 2.0, -1.0)  # hung torques, in units of `load`
RINGS = 8.0  # s: the leads of the follower take up their angle
UNDAMPED = 1e-7  # damping of a gyro that is taken for undamped, as a share of H


class TableServoLoop(LoopTest):
    """Servo table mode: the pickoff of the gyro drives the torque motor until the table stands still in inertial space.

        L(s) = G K_g H_g C(s) / ( s [(J s + D)(J_g s + C_g) + H_g2] (1 + lag s) )        K_T = G K_g H_g / C_g

    A hung torque M turns the table by M / K_T; a current through the torquer of the gyro injects a rate into the loop.
    Bearing and slip rings load the axis: brushes on it (follower = false) or on a shaft that follows.

    [TABLE-SERVO, MOTOR-SQUARELAW, SLIPRING-FOLLOWER, BEARING-AIR; Hu 1981, eq. 5-7..5-21, 3-54, 3-55]
    """

    title = "Servo loop of a turntable"
    spec = ("TABLE-SERVO", "MOTOR-SQUARELAW", "SLIPRING-FOLLOWER")
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "site": Slot("Site", "site"),
        "bearing": Slot("TableLoad", "bearing_air"),
        "rings": Slot("TableLoad", "slipring_follower"),
        "table": Slot("ServoTable", "table_servo"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
    }
    wires = """
        exciter.torque[1] -> bearing.torque
        bearing.M -> rings.torque
        rings.M -> table.torque
        table -> bearing: angle rate
        table -> rings: angle rate
        site -> table: f=f_local omega=omega_local
        table -> gyro: omega alpha f
        gyro.u -> table.u
        exciter.command[1] -> gyro.i
    """
    factors = {"exciter.command[1] -> gyro.i": torquer("gyro.k", 9)}
    raw = {"table.mode": 3.0} | dict(zip(element_names("table.face", (3, 3)), ALONG, strict=True))
    options = {
        "network": Option(2, int, "1: gyro of 0.4 ms, 2: of 1 ms, 3 and 4: undamped gyro", 1, 4),
        "crossover": Option(0.0, "Hz", "gain crossover; 0: 50 Hz (networks 1, 2), 10 Hz (3, 4)", 0.0),
        "J": Option(2.56, "kg.m2", "inertia of table and load", sets="table.J"),
        "load": Option(0.0, "N.m", "hung torque, doubled and reversed too; 0: 1 N.m, or 500 g.cm (undamped gyro)", 0.0),
        "shaper": Option(True, bool, "root shaper before the square-law motor", sets="table.shaper"),
        "follower": Option(True, bool, "slip rings on a shaft that follows; false: on the table axis",
                           sets="rings.ring_follower"),
        "friction": Option("1400g.cm", "N.m", "friction of the slip rings", 0.0, sets="rings.ring_friction"),
        "turning": Option("0.1deg/s", "rad/s", "rate to either side, which shows the torque of the rings"),
        **VERTICAL_AXIS,
        "test": Option("0.4arcsec", "rad", "amplitude of test sines, as an angle; tenfold with an undamped gyro", 1e-9),
        **hold(60.0),
    }  # fmt: skip
    noises = (*SDF_NOISES, "table.rumble")
    step = 1e-4
    channel_period = 5e-4
    channels = (
        "exciter.phase", "exciter.gate", "exciter.torque[1]", "exciter.command[1]", "table.angle", "table.omega[1]",
        "gyro.u", "gyro.b", "rings.M",
    )  # fmt: skip
    bodies = """
        table: base table.base, x table.tilt[1], y table.tilt[2], z table.angle
        instrument: table, base table.face
    """
    shown = ("table.angle", "gyro.u", "exciter.torque", "exciter.command", "rings.M", "table.saturated gyro.saturated")

    open = ("table.mode", "table.target", "table.face")

    @property
    def loops(self) -> dict[str, str]:  # type: ignore[override]
        """Return the loop for the linear model; none about the null of a motor without gain there."""
        return {"stabilizer": "table.u"} if self["shaper"] else {}

    @property
    def damped(self) -> bool:
        return self["network"] in TAU

    def wanted(self) -> float:
        """Return the gain crossover, Hz."""
        return float(self["crossover"] or (50.0 if self.damped else 10.0))

    def hung(self) -> float:
        """Return the hung torque, N.m; an undamped gyro holds it by a large angle of its float."""
        return float(self["load"] or (1.0 if self.damped else 500.0 * GCM))

    def phases(self) -> list[LoopPhase]:
        """Return rest, hung torques, turning both ways, test sines through the torquer, sines of torque."""
        share = self.wanted() / 50.0
        slow = 1.0 / share  # s: the slowest pole, about w_c / 12 (network 2), leaves exp(-12) in half of it
        frequencies = [f * share for f in TESTS]
        long: Any = {"periods": 20, "settle": 0.5 / share, "dwell": 1.0 / share}
        weights = [
            LoopPhase(
                f"torque {w:g} M".replace("-", "−"), "torque", "step", 1, w * self.hung(), settle=slow, dwell=slow
            )
            for w in WEIGHTS
        ]
        turns = [
            LoopPhase(f"turning {way}", "command", "step", 1, sign * self["turning"], settle=slow, dwell=RINGS)
            for way, sign in (("forth", 1.0), ("back", -1.0))
        ]
        return [
            LoopPhase("drift", "hold", settle=RINGS + slow, dwell=self["hold"]),
            *weights,
            *sweep("loop", "command", frequencies, self.injected, **long),
            *sweep("torque", "torque", frequencies[:9:2], self.hung(), **long),
            *turns,
        ]  # fmt: skip

    def injected(self, f: float) -> float:
        """Return the rate whose angle is `test`, and grows below the crossover, where the loop leaves less of it."""
        size = self["test"] * (1.0 if self.damped else 10.0)
        return float(size * 2.0 * math.pi * f * max(1.0, 0.4 * self.wanted() / f) ** 1.5)

    def design(self, parts: PartValues) -> dict[str, Any]:
        gyro: dict[str, Any] = {}
        if self.damped:
            gyro["gyro.J"] = parts.given("gyro.J", TAU[self["network"]] * parts["gyro.C"])
        else:
            gyro["gyro.C"] = parts.given("gyro.C", UNDAMPED * parts["gyro.H"])
        told = gyro_on_table(parts) | {f"table.{n}_g": v for n, v in ((k[-1], x) for k, x in gyro.items())}
        return {
            **told,
            **gyro,
            "gyro.k": data_sheet(parts["gyro.k"]),
            "table.network": parts.given("table.network", self["network"]),
            "table.crossover": 2.0 * math.pi * self.wanted(),
            "table.capture": 0,
        }

    def crossovers(self) -> dict[str, float]:
        return {"stabilizer": self.wanted()}

    def check(self) -> list[str]:
        problems = self.not_positive("J", "turning", "test")
        if self.wanted() * 8.0 * self.step > 0.25:
            problems.append(
                f"crossover = {self.wanted():g} Hz: the test sines of four times it need a step of "
                f"{1.0 / (32.0 * self.wanted()):.2g} s or less, not {self.step:g} s"
            )
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        """Refuse what the motor or the pickoff cannot hold."""
        problems = []
        most = parameters.get("table.torque_max")
        if most is not None and 2.0 * self.hung() > 0.9 * float(most):
            problems.append(
                f"load = {self.hung():g} N.m: twice it is hung too, and the motor gives {float(most):g} N.m"
            )
        loop = loop_of(parameters)
        if loop is not None and "gyro.u_max" in parameters:
            float_angle = 2.0 * self.hung() / (loop.gain * loop.K_g)
            limit = float(parameters["gyro.u_max"]) / loop.K_g
            if float_angle > 0.9 * limit:
                problems.append(
                    f"load = {self.hung():g} N.m: twice it turns the float by {float_angle:.2g} rad, the pickoff reads "
                    f"{limit:.2g} rad"
                )
        return problems

    def warnings(self) -> list[str]:
        return [] if self["shaper"] else ["without root shaper the loop is not linear: margins do not describe it"]
