"""Four-gimbal platform: an outer roll gimbal with its own servo keeps the inner three away from lock, where it can."""

from __future__ import annotations

from typing import Any

from gyrobench.system import flight_plan
from gyrobench.system.families.loop_test import AXES, TwoGyroTest, three
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot

from .flights import FLIGHTS

LAWS = ("secant", "sign", "constant")  # the part's gain 0, 1, 2


class PlatformFourGimbalSystem(TwoGyroTest):
    """Gimbals from outside: 4 roll, 3 pitch, 2 inner roll, 1 azimuth.  The inner three are held by two gyros, resolver
    and three channels; the servo of the fourth nulls the inner roll, g4' = k G(g3) g2.

    First the loops and the drift at rest, then one of the flights.
    [PLATFORM-4GIMBAL; GSP ch. 5, section 5.2.2]
    """

    title = "Four-gimbal platform"
    spec = ("PLATFORM-4GIMBAL", "PLATFORM-3GIMBAL-2DOF")
    reduction = "reduction"
    tones = (2.5, 5.0, 7.0, 10.0, 14.0)  # Hz
    slots = TwoGyroTest.with_parts(
        motion="manoeuvre", load="load_torque", gyro_a="gyro_2dof", gyro_b="gyro_2dof",
        decoupler="decoupler_t2", **dict.fromkeys(AXES, "stabilizer_lead_lag"),
    ) | {"platform": Slot("FourGimbalPlatform", "platform_four_gimbal")}  # fmt: skip
    open = ("gyro_a.i_x", "gyro_a.i_y", "gyro_b.i_x", "gyro_b.i_y")  # left at their start values
    options = TwoGyroTest.options | {
        "flight": Option("crossing", str, f"what is flown: {', '.join(FLIGHTS)}"),
        "law": Option("sign", str, f"gain of the fourth servo: {', '.join(LAWS)}"),
        "locked": Option(False, bool, "the fourth gimbal starts locked; it is released off the vertical"),
        "release": Option("80deg", "rad", "pitch below which a locked fourth gimbal is released"),
        "allow_vertical": Option(True, bool, "secant and constant gain at pitch 90 deg too; false: refused there"),
        "k": Option(30.0, "1/s", "servo of the fourth gimbal: rate for an angle", 0.1),
        "rate_max": Option(5.0, "rad/s", "largest rate of a gimbal", 0.1),
        "load": Option(50.0, "N.m", "disturbance torque of the steps; 0: none, and no sweeps"),
    }
    channels = (
        *three("platform.attitude"), "platform.theta_4", *three("platform.theta"), "exciter.phase", "exciter.gate",
        *three("exciter.torque", "exciter.test", "motion.omega", "motion.angle", "platform.theta_dot"),
        "platform.theta_4_dot",
        "platform.lock", "pitch.e", "roll.e", "azimuth.e",
    )  # fmt: skip
    shown = (
        "platform.attitude", "platform.theta platform.theta_4", "platform.theta_dot platform.theta_4_dot",
        "motion.omega", "pitch.e roll.e azimuth.e", "platform.lock gyro_a.saturated gyro_b.saturated",
    )  # fmt: skip

    bodies = """
        base: z motion.angle[3], x motion.angle[1], y motion.angle[2]
        fourth gimbal: base, y platform.theta_4
        pitch gimbal: fourth gimbal, x platform.theta[1]
        inner roll gimbal: pitch gimbal, y platform.theta[2]
        inner element: inner roll gimbal, z platform.theta[3]
    """

    def flown(self) -> Any:
        return FLIGHTS.get(self["flight"], FLIGHTS["crossing"])

    def at_rest(self) -> list[LoopPhase]:
        """Return steps and sweeps, with a load, and the hold; the hold alone before a flight out of the null."""
        return [*(self.steps() if self["load"] != 0.0 and not self.flown().inner else []), self.drift()]

    def phases(self) -> list[LoopPhase]:
        """Return what is done at rest, then the flight, but where it begins out of the null, which would not wait."""
        legs = flight_plan.phases(self.flown().legs)
        return [*legs, *self.at_rest()] if self.flown().inner else [*self.at_rest(), *legs]

    def design(self, parts: PartValues) -> dict[str, Any]:
        flown = self.flown()
        return {
            **super().design(parts),
            **flight_plan.parameters(flown.legs, self.plan().phases),
            "motion.start_angle[1]?": flown.pitch,
            "platform.gain": LAWS.index(self["law"]) if self["law"] in LAWS else 0,
            "platform.k": self["k"],
            "platform.launch": int(self["locked"]),
            "platform.release": self["release"],
            "platform.allow_vertical": int(self["allow_vertical"]),
            "platform.theta_0": [-flown.pitch, flown.inner, 0.0],
            "decoupler.mount?": 1,
        }

    def check(self) -> list[str]:
        return [*self.no_choice(flight=FLIGHTS, law=LAWS), *super().check()]

    def warnings(self) -> list[str]:
        if self.flown().vertical and not self["locked"] and self["law"] != "sign":
            return [f"law = {self['law']} at pitch 90°: the fourth gimbal turns over there (law=sign does not)"]
        return []
