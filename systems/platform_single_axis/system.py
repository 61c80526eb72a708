"""Single-axis platform: a floated gyro in rebalance, an estimator in the loop, a motor that holds the platform."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.families.loop_test import PROFILE, OneAxisTest, data_sheet, noises, stabilizer
from gyrobench.system.loop_plan import LoopPhase, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import OnRequest, Option, Slot

from .contest import ANGLE_NOISE, BRACKET, CHANNEL, REFERENCE, TAKEN_BACK, Contest

PICKOFF_NOISE = 5e-8  # V/sqrt(Hz)
REBALANCE = 100.0  # Hz, bandwidth of the rebalance loop: the float follows with 2 pi this
LAG = 50.0  # s, time constant that stands for the integration of the rate


class PlatformSingleAxisLoop(OneAxisTest):
    """A floated gyro on the platform is held at zero by its torquer; the torquer current, which is the measured rate,
    passes an estimator, and a stabilizer drives the motor so that the platform keeps its attitude.

    [PLATFORM-1AXIS, GYRO-REBALANCE; Xia 2008, section 4.1, fig. 4.1.1 rebuilt]
    """

    title = "Stabilized platform on one axis, estimator in the loop"
    spec = ("PLATFORM-1AXIS", "GYRO-REBALANCE", "EST-KF-GEN")
    reduction = "reduction"
    slots = OneAxisTest.with_parts(motion="base_motion", load="load_torque", platform="platform_single_axis") | {
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "rebalance": Slot("Rebalance", "rebalance_analog"),
        "estimator": Slot("Estimator", "estimator_none"),
        "stabilizer": stabilizer("stabilizer_lead_lag", "rate"),
    }
    wires = OneAxisTest.wires + """
        exciter.command[1] -> stabilizer.command
        platform.alpha -> gyro.alpha
        gyro.M_react[1] -> platform.M_gyro
        gyro.u -> rebalance.u
        rebalance.i -> gyro.i
        rebalance.i_read -> estimator.z
        estimator.estimate -> stabilizer.u
        platform.i_motor -> stabilizer.i_motor
        platform.theta -> stabilizer.theta
        platform.theta -> stabilizer.schedule
    """  # fmt: skip
    on_request = {
        "channel": OnRequest(
            {"channel": Slot(CHANNEL, "reading_channel")},
            """
            rebalance.i_read -> channel.z
            exciter.phase -> channel.phase
            channel.y -> estimator.z
            channel.valid -> estimator.valid
            """,
            instead_of="rebalance.i_read -> estimator.z",
        ),
        "bracket": OnRequest(
            {"bracket": Slot(BRACKET, "gyro_bracket")},
            """
            platform.f -> gyro.f
            platform.omega -> bracket.omega
            bracket.omega_gyro -> gyro.omega
            """,
            instead_of="platform -> gyro: omega f",
        ),
        "reference": OnRequest(
            {"reference": Slot(REFERENCE, "angle_reference")},
            """
            platform.attitude -> reference.theta
            exciter.phase -> reference.phase
            reference.angle -> estimator.angle
            reference.new -> estimator.angle_new
            """,
            channels=("reference.off",),
        ),
    }
    options = {
        "crossover": Option(10.0, "Hz", "crossover for which the gain of the stabilizer is set", 0.5, 20.0),
        "load_step": Option(1.0, "N.m", "disturbance torque of the step"),
        "command": Option(1e-3, "rad/s", "rate commanded in the command step"),
        "base": Option("1deg", "rad", "amplitude of the base at and below the frequency of the ride", 0.0),
        "ride": Option(1.0, "Hz", "frequency of the ride, the sine of the base for the platform error", 0.1, 5.0),
        "hold": Option(60.0, "s", "time of ride, and of the drift hold", 10.0, 3600.0),
        "reading_noise": Option(1e-5, "A/sqrt(Hz)", "noise density of the current that is read", 0.0),
        **PROFILE,
        "contest": Option(False, bool, "the plan that compares estimators: bending, line, noise, gaps, wild, aiding"),
    }
    noises = (*noises(), "rebalance.meter", "channel.white", "reference.reading")
    step = 5e-4
    channels = (
        *OneAxisTest.channels, "rebalance.i_read", "estimator.estimate", "estimator.latency", "stabilizer.e",
        "stabilizer.v",
    )  # fmt: skip
    shown = (
        "platform.attitude", "platform.omega", "rebalance.i_read estimator.estimate", "stabilizer.v",
        "exciter.motion_angle", "exciter.torque", "platform.saturated rebalance.saturated",
    )  # fmt: skip
    channel_period = 1e-3

    def set(self, name: str, value: Any) -> None:
        super().set(name, value)
        if self["contest"]:
            for slot in self.on_request:
                self.request(slot)

    def phases(self) -> list[LoopPhase]:
        """Return step of torque, step of commanded rate, test sines for the loop, sines of the base, ride, drift."""
        fc = self["crossover"]
        if self["contest"]:
            return self.contest().phases()
        return [
            LoopPhase("load step", "torque", "step", amplitude=self["load_step"], settle=2.0, dwell=4.0),
            LoopPhase("command step", "command", "step", amplitude=self["command"], settle=6.0, dwell=2.0),
            *sweep("loop", "test", [fc * x for x in (0.2, 0.4, 0.7, 1.0, 1.4, 2.0, 3.0, 4.5)], 0.02, periods=40),
            *sweep("base", "motion", [0.5, 1.0, 2.0, 5.0, 10.0], self.amplitude, dwell=8.0),
            LoopPhase("ride", "motion", "sine", 1, self["base"], self["ride"], 2.0 / self["ride"], self._whole()),
            LoopPhase("drift", "hold", settle=5.0, dwell=self["hold"]),
        ]

    def check(self) -> list[str]:
        if self["contest"] and self["profile"]:
            return ["contest and profile: a recorded motion is one ride; leave out one of the two"]
        return []

    def contest(self) -> Contest:
        """Return the rides that compare estimators."""
        return Contest(self["crossover"], self["base"], self["ride"], self._whole(), self["reading_noise"])

    def amplitude(self, f: float) -> float:
        """Return that of the base, rad: falls with the square of the frequency above the ride's."""
        return float(self["base"] * min(1.0, (self["ride"] / f) ** 2))

    def _whole(self) -> float:
        return float(math.ceil(self["hold"] * self["ride"]) / self["ride"])

    def stabilizer(self, parts: PartValues, k: float, wr: float) -> dict[str, float]:
        """Return lag (an integration of the rate), lead and integral for the crossover wanted.

        |L(j wc)| = 1 with L = 1/k R(s) K G(s) M(s)/(J s): R = wr/(s + wr) the rebalance, M = k_t/(R + L s) with the
        back EMF the motor, k the torquer of the gyro.
        """
        wc = 2.0 * math.pi * self["crossover"]
        s = 1j * wc
        found = {"tau1": 4.0 / wc, "T1": LAG, "tau2": 0.25 / wc, "T2": 1.0 / (6.0 * wc), "integral": wc / 15.0}
        g = (1 + found["tau1"] * s) * (1 + found["tau2"] * s) / (1 + LAG * s) / (1 + found["T2"] * s)
        names = ("J", "J_motor", "ratio", "viscous", "k_t", "k_e", "R", "L")
        J, J_motor, n, viscous, k_t, k_e, R, L = (parts[f"platform.{name}"] for name in names)
        motor = n * k_t / ((L * s + R) * ((J + n * n * J_motor) * s + viscous) + n * n * k_t * k_e)
        loop = g * (1.0 + found["integral"] / s) / k * wr / (s + wr) * motor
        observed = {"gain": abs(g) / abs(loop), "observer": wc / 10.0, "J": J + n * n * J_motor, "k_t": n * k_t, "R": R}
        return {"K": 1.0 / abs(loop), **found, **observed}

    def design(self, parts: PartValues) -> dict[str, Any]:
        k = parts.given("gyro.k", data_sheet(parts["gyro.k"]))
        wanted = 2.0 * math.pi * REBALANCE / (k * parts["gyro.K_sg"]) * (parts["gyro.C"] / parts["gyro.H"])
        gain = parts.given("rebalance.K_p", wanted)  # A/V
        variance = (self["reading_noise"] ** 2 + (gain * PICKOFF_NOISE) ** 2) / self.step
        wide = (2.0 * math.pi * 5.0 * self["crossover"]) ** 4  # the filter follows five times faster than the loop
        stabilizer = self.stabilizer(parts, k, 2.0 * math.pi * REBALANCE * (gain / wanted))
        return {
            "gyro.reaction": True,
            "gyro.k": k,
            "gyro.pickoff": PICKOFF_NOISE,
            "rebalance.K_p": gain,
            "rebalance.K_i": 0.0,
            "rebalance.i_max": 0.5,
            "rebalance.meter": self["reading_noise"],
            "estimator.Ts?": self.step,
            "estimator.R?": variance,
            "estimator.R0?": variance,
            "estimator.q?": wide * variance * self.step,
            "estimator.sigma?": math.sqrt(variance),
            "estimator.k?": k,
            "estimator.sigma_angle?": ANGLE_NOISE,
            "estimator.T_c?": TAKEN_BACK,
            **{f"stabilizer.{name}?": x for name, x in stabilizer.items()},
            "stabilizer.K_u?": 1.0 / k,
            **(self.contest().parameters() if self["contest"] else {}),
        }
