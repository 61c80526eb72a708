"""Single-axis platform: a floated gyro in rebalance, an estimator in the loop, a motor that holds the platform."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from gyrobench.record.motion_profile import read_profile
from gyrobench.record.record import Record
from gyrobench.result import LoopResult, Specification
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System

TORQUER = 0.083387953  # rad/s/A, scale factor of floated_gyro (17.2 deg/h/mA)
PICKOFF = 10.0  # V/rad
PICKOFF_NOISE = 5e-8  # V/sqrt(Hz)
REBALANCE = 100.0  # Hz, bandwidth of the rebalance loop: with H = C the float follows with 2 pi this
LAG = 50.0  # s, time constant that stands for the integration of the rate


class PlatformSingleAxisLoop(System):
    """A floated gyro on the platform is held at zero by its torquer; the torquer current, which is the measured rate,
    passes an estimator, and a stabilizer drives the motor so that the platform keeps its attitude.

    [PLATFORM-1AXIS, GYRO-REBALANCE; Xia 2008, section 4.1, fig. 4.1.1 rebuilt]
    """

    title = "Stabilized platform on one axis, estimator in the loop"
    spec = ("PLATFORM-1AXIS", "GYRO-REBALANCE", "EST-KF-GEN")
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "motion": Slot("Motion", "base_motion"),
        "load": Slot("Load", "load_torque"),
        "platform": Slot("PlatformAxis", "platform_single_axis"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "rebalance": Slot("Rebalance", "rebalance_analog"),
        "estimator": Slot("Estimator", "estimator_none"),
        "stabilizer": Slot("Stabilizer", "stabilizer_lead_lag"),
    }
    wires = """
        exciter.motion_angle -> motion.motion_angle
        exciter.motion_rate -> motion.motion_rate
        exciter.motion_acceleration -> motion.motion_acceleration
        exciter.torque -> load.torque
        exciter.test[1] -> stabilizer.test
        exciter.command[1] -> stabilizer.command
        motion.omega -> platform.omega_b
        motion.alpha -> platform.alpha_b
        motion.f -> platform.f_b
        load.M[1] -> platform.M_load
        platform.omega -> gyro.omega
        platform.alpha -> gyro.alpha
        platform.f -> gyro.f
        gyro.M_react[1] -> platform.M_gyro
        gyro.u -> rebalance.u
        rebalance.i -> gyro.i
        rebalance.i_read -> estimator.z
        estimator.estimate -> stabilizer.u
        platform.i_motor -> stabilizer.i_motor
        stabilizer.v -> platform.v
    """
    loops = {"stabilizer": "stabilizer.u"}
    options = {
        "crossover": Option(10.0, "Hz", "crossover for which the gain of the stabilizer is set", 0.5, 20.0),
        "load_step": Option(1.0, "N.m", "disturbance torque of the step"),
        "command": Option(1e-3, "rad/s", "rate commanded in the command step"),
        "base": Option("1deg", "rad", "amplitude of the base at and below the frequency of the ride", 0.0),
        "ride": Option(1.0, "Hz", "frequency of the ride, the sine of the base for the platform error", 0.1, 5.0),
        "profile": Option("", str, "CSV file with a recorded motion of the base: the ride instead of the whole plan"),
        "hold": Option(60.0, "s", "time of ride, and of the drift hold", 10.0, 3600.0),
        "reading_noise": Option(1e-5, "A/sqrt(Hz)", "noise density of the current that is read", 0.0),
    }
    noises = ("gyro.turn_on", "gyro.markov", "gyro.white", "gyro.pickoff", "rebalance.meter")
    step = 5e-4
    done = "exciter.done"
    channels = (
        "exciter.phase", "exciter.gate", "exciter.torque[1]", "exciter.command[1]", "exciter.test[1]",
        "exciter.motion_angle[1]", "platform.attitude", "platform.omega[1]", "platform.saturated",
        "rebalance.i_read", "rebalance.saturated", "estimator.estimate", "estimator.latency",
        "stabilizer.e", "stabilizer.v",
    )  # fmt: skip
    channel_period = 1e-3

    def plan(self) -> LoopPlan:
        """Step of torque, step of commanded rate, test sines for the loop, sines of the base, ride, drift."""
        fc = self["crossover"]
        if self["profile"]:
            return LoopPlan([LoopPhase("ride", dwell=self["hold"])])
        return LoopPlan(
            [
                LoopPhase("load step", "torque", "step", amplitude=self["load_step"], settle=2.0, dwell=4.0),
                LoopPhase("command step", "command", "step", amplitude=self["command"], settle=6.0, dwell=2.0),
                *sweep("loop", "test", [fc * x for x in (0.2, 0.4, 0.7, 1.0, 1.4, 2.0, 3.0, 4.5)], 0.02, periods=40),
                *sweep("base", "motion", [0.5, 1.0, 2.0, 5.0, 10.0], self.amplitude, dwell=8.0),
                LoopPhase("ride", "motion", "sine", 1, self["base"], self["ride"], 2.0 / self["ride"], self._whole()),
                LoopPhase("drift", "hold", settle=5.0, dwell=self["hold"]),
            ]
        )

    def amplitude(self, f: float) -> float:
        """Of the base, rad: falls with the square of the frequency above the ride's."""
        return float(self["base"] * min(1.0, (self["ride"] / f) ** 2))

    def _whole(self) -> float:
        return float(math.ceil(self["hold"] * self["ride"]) / self["ride"])

    def stabilizer(self) -> dict[str, float]:
        """Lag (an integration of the rate), lead and integral for the crossover wanted.

        |L(j wc)| = 1 with L = 1/k R(s) K G(s) M(s)/(J s): R = wr/(s + wr) the rebalance, M = k_t/(R + L s) with the
        back EMF the motor, J = 2 kg.m2: the defaults of the parts.
        """
        wc = 2.0 * math.pi * self["crossover"]
        wr = 2.0 * math.pi * REBALANCE
        s = 1j * wc
        found = {"tau1": 4.0 / wc, "T1": LAG, "tau2": 0.25 / wc, "T2": 1.0 / (6.0 * wc), "integral": wc / 15.0}
        g = (1 + found["tau1"] * s) * (1 + found["tau2"] * s) / (1 + LAG * s) / (1 + found["T2"] * s)
        motor = 1.0 / ((4e-3 * s + 2.0) * (2.0 * s + 0.05) + 1.0)
        loop = g * (1.0 + found["integral"] / s) / TORQUER * wr / (s + wr) * motor
        return {"K": 1.0 / abs(loop), **found}

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        gain = 2.0 * math.pi * REBALANCE / (TORQUER * PICKOFF)  # A/V, of the rebalance loop
        variance = (self["reading_noise"] ** 2 + (gain * PICKOFF_NOISE) ** 2) / self.step
        wide = (2.0 * math.pi * 5.0 * self["crossover"]) ** 4  # the filter follows five times faster than the loop
        return {
            **self.plan().parameters(),
            **(read_profile(Path(self["profile"])) if self["profile"] else {}),
            "gyro.reaction": True,
            "gyro.k": TORQUER,
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
            **{f"stabilizer.{k}?": x for k, x in self.stabilizer().items()},
            "stabilizer.K_u?": 1.0 / TORQUER,
        }

    def reduce(self, record: Record, specification: Specification | None = None) -> LoopResult:
        from .reduction import from_record

        return from_record(record, specification)
