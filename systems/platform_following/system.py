"""Platform that follows the level and north of a moving base by the torquers of its two gyros, open loop."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.loop_test import AXES, MOVED, ThreeAxisTest, TwoGyroTest, commanded
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot
from gyrobench.units import EARTH_RATE

FOLLOWER = Socket(
    "EarthFollower",
    "commands a platform the rates of level, north-pointing axes on a moving base",
    (
        inp("extra", "rad/s", "rate commanded besides, platform axes", 3, optional=True),
        out("command", "rad/s", "commanded rate, platform axes", 3),
        out("rate", "rad/s", "inertial rate of the level, north-pointing axes", 3),
        out("turned", "rad", "integral of rate", 3),
    ),
)
TERMS = ("x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz")  # of the static drift, per g and g2: compensated
COMMANDS = commanded("follower.command")


class PlatformFollowing(TwoGyroTest):
    """The platform of two gyros with their rotors at right angles, on a base that moves and sways.  The torquers turn
    it with the level and north of the place, by latitude and velocity as believed; nothing brings it back.

        w = (-v_N/(M + h), W cos L + v_E/(N + h), W sin L + v_E tan L/(N + h)),   platform x east, y north, z up

    What is left is its drift against level and north, with a budget of what makes it.
    [PLATFORM-FOLLOWING; GSP ch. 5, section 5.2.1]
    """

    title = "Platform that follows the Earth"
    spec = ("PLATFORM-FOLLOWING", "PLATFORM-3GIMBAL-2DOF")
    reduction = "reduction"
    slots = TwoGyroTest.with_parts(
        motion="base_motion", load="load_torque", platform="platform_three_gimbal_2dof", gyro_a="gyro_2dof",
        gyro_b="gyro_2dof", decoupler="decoupler_t2", **dict.fromkeys(AXES, "stabilizer_lead_lag"),
    ) | {"follower": Slot(FOLLOWER, "earth_follower")}  # fmt: skip
    wires = "\n".join(
        (MOVED + ThreeAxisTest.wires + TwoGyroTest.sensed, "exciter.command -> follower.extra", *COMMANDS)
    )
    factors = COMMANDS
    options = {
        "latitude": Option(
            "45.75deg", "rad", "latitude at the start, north positive", -1.4, 1.4, sets="follower.latitude"
        ),
        "height": Option(0.0, "m", "height above the ellipsoid", sets="follower.height"),
        "east": Option(200.0, "m/s", "velocity over ground, east", -1000.0, 1000.0),
        "north": Option(100.0, "m/s", "velocity over ground, north", -1000.0, 1000.0),
        "base": Option(4, int, "sway of the base: 0 none, 1 to 3 sea, 4 and 5 aircraft (presets of base_motion)", 0, 5),
        "time": Option(600.0, "s", "time for which the platform follows", 10.0, 7200.0),
        "feedback": Option(40.0, "1/s", "rate of a servo for an angle of the platform", 1.0),
        "rate_max": Option("60deg/s", "rad/s", "largest rate of a gimbal", 0.1),
        "mounting": Option("3arcmin", "rad", "mounting error of the gyros, about each of their axes", -0.1, 0.1),
        "residual": Option("0.01deg/h", "rad/s", "drift that compensation leaves of each axis of the gyros"),
        "torquer": Option(1e-4, "1", "error of the torquers' scale factors", -0.1, 0.1),
        "quantum": Option(
            "1e-3deg/h", "rad/s", "resolution of the commanded rate; 0: none", 0.0, sets="follower.quantum"
        ),
        "latitude_error": Option(
            "0deg", "rad", "latitude as believed less the true one", sets="follower.latitude_error"
        ),
        "velocity_error": Option(0.0, "m/s", "velocity as believed less the true one, east and north"),
        "u_mounting": Option("3arcmin", "rad", "standard uncertainty of the mounting of a gyro, about each axis", 0.0),
        "u_torquer": Option(1e-4, "1", "relative standard uncertainty of the torquers' scale factors", 0.0),
        "u_drift": Option("0.01deg/h", "rad/s", "standard uncertainty of the drift of a gyro", 0.0),
        "u_latitude": Option("1arcmin", "rad", "standard uncertainty of the latitude", 0.0),
        "u_velocity": Option(1.0, "m/s", "standard uncertainty of either velocity", 0.0),
    }
    step = 5e-4
    channel_period = 0.02
    channels = (
        "exciter.phase", "exciter.gate", *(f"platform.attitude[{k}]" for k in (1, 2, 3)),
        *(f"follower.turned[{k}]" for k in (1, 2, 3)), *(f"follower.rate[{k}]" for k in (1, 2, 3)),
        *(f"platform.theta[{k}]" for k in (1, 2, 3)), "motion.angle[1]", "motion.angle[2]", "motion.angle[3]",
    )  # fmt: skip
    shown = ("platform.attitude", "follower.turned", "platform.theta", "motion.angle", "platform.saturated")

    def phases(self) -> list[LoopPhase]:
        return [LoopPhase("follow", "hold", settle=max(10.0, 2 * self.wait), dwell=self["time"])]

    def design(self, parts: PartValues) -> dict[str, Any]:
        found = super().design(parts) | {
            "motion.preset?": self["base"],
            "motion.earth_rate?": EARTH_RATE,
            "motion.latitude?": self["latitude"],
            "follower.velocity": [self["east"], self["north"]],
            "follower.velocity_error": [self["velocity_error"]] * 2,
        }
        for gyro in self.mounts:
            found |= {f"{gyro}.D{c}_{n}?": 0.0 for c in "xy" for n in TERMS}
            found |= {f"{gyro}.D{c}_0?": self["residual"] for c in "xy"}
        return found | self.misplaced(parts)

    def check(self) -> list[str]:
        problems = super().check()
        way = abs(self["north"]) * self["time"] / 6.3e6
        if abs(self["latitude"]) + way > math.radians(85.0):
            problems.append(
                f"latitude = {math.degrees(self['latitude']):g} deg, north = {self['north']:g} m/s for "
                f"{self['time']:g} s: within 5 deg of a pole north has no direction to follow"
            )
        return problems
