"""Axis stabilized by a gyro of one degree of freedom: integrating, rate-integrating or rate gyro, strongly coupled."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from gyrobench.system.families.loop_test import OneAxisTest, data_sheet, stabilizer, torquer
from gyrobench.system.loop_plan import LoopPhase, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot

from .closed import StabilizedAxis

KINDS = ("integrating", "rate-integrating", "rate")
LIGHT = 0.3  # damping up to which 5-34 may be taken
SWEEP = (0.05, 0.1, 0.2, 0.5, 1.0)  # Hz


class StabilizerSdf(OneAxisTest):
    """The gyro itself resists a torque about the axis: its float yields by b, and H b' holds the axis.  Without spring
    and damper the axis leans like a spring H²/J, with a damper it creeps by M C/H², with a spring it feels like an
    inertia J0 + H²/K.

    [STAB-SDF-INT, STAB-SDF-RATEINT, STAB-SDF-RATE; GSP ch. 5, section 5.1.4, eq. 5-27..5-43]
    """

    title = "Stabilizer with a gyro of one degree of freedom"
    spec = ("STAB-SDF-INT", "STAB-SDF-RATEINT", "STAB-SDF-RATE")
    slots = OneAxisTest.with_parts(motion="base_motion", load="load_torque", platform="platform_single_axis") | {
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "stabilizer": stabilizer("stabilizer_lead_lag"),
    }
    wires = OneAxisTest.wires + """
        exciter.command[1] -> gyro.i
        platform.alpha -> gyro.alpha
        gyro -> platform: h_I=h_gyro M_I=M_gyro
        gyro.u -> stabilizer.u
    """  # fmt: skip
    factors = {"exciter.command[1] -> gyro.i": torquer("gyro.k", 9)}
    options = {
        "kind": Option("rate-integrating", str, f"kind of gyro: {', '.join(KINDS)}"),
        "M": Option(10.0, "N.m", "disturbance torque"),
        "time": Option(100.0, "s", "how long it acts"),
        "command": Option(1e-5, "rad/s", "rate commanded by the gyro's torquer; 0: none"),
        "J0": Option(1e6, "kg.m2", "inertia of the axis without the gyro"),
        "J": Option(10.0, "kg.m2", "inertia of the gyro's float about its output axis"),
        "H": Option(1e4, "N.m.s", "spin angular momentum"),
        "C": Option(62.5, "N.m.s/rad", "damping of the float (rate-integrating and rate gyro)"),
        "K": Option(100.0, "N.m/rad", "spring of the float (rate gyro)"),
        "float_stop": Option("30deg", "rad", "stop of the float: the run ends there", sets="gyro.stop"),
        "form": Option("exact", str, "closed form of the rate-integrating gyro: exact, or light (5-34, light damping)"),
        "offload": Option(0.0, "N.m/rad", "motor torque for the float angle; 0: no motor", sets="stabilizer.K"),
        "viscous": Option(0.0, "N.m.s/rad", "friction of the axis against the base", sets="platform.viscous"),
    }
    channels = (*OneAxisTest.channels, "gyro.b", "stabilizer.e")
    shown = ("platform.attitude", "platform.omega", "gyro.b", "exciter.torque", "exciter.motion_angle")
    channel_period = 1e-2

    def axis(self) -> StabilizedAxis:
        """Return the plant of these options: C and K are those of the kind."""
        kind = self["kind"]
        c = 0.0 if kind == "integrating" else self["C"]
        k = self["K"] if kind == "rate" else 0.0
        return StabilizedAxis(self["J0"], self["J"], self["H"], c, k, self["M"])

    def phases(self) -> list[LoopPhase]:
        """Return torque, drift after it, a commanded rate; sines of the base with friction, test sines with a motor."""
        phases = [
            LoopPhase("load", "torque", "step", amplitude=self["M"], settle=0.1, dwell=self["time"]),
            LoopPhase("drift", settle=0.05 * self["time"], dwell=0.15 * self["time"]),
        ]
        if self["command"] != 0.0:
            rest = 0.1 * self["time"]
            phases.append(LoopPhase("command step", "command", "step", 1, self["command"], settle=rest, dwell=2 * rest))
        if self["viscous"] > 0.0:
            phases += sweep("base", "motion", SWEEP, 0.02, periods=4)
        if self["offload"] > 0.0:
            phases += sweep("loop", "test", SWEEP, 1e-3, periods=4)
        return phases

    def design(self, parts: PartValues) -> dict[str, Any]:
        p = self.axis()
        drifts = ("D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS", "markov", "white", "pickoff")
        return {
            "platform.J": p.J0,
            **{f"platform.{k}?": v for k, v in {"k_t": 1.0, "R": 1.0, "L": 0.0, "k_e": 0.0, "v_max": 1e9}.items()},
            "platform.i_max?": 1e9,
            "platform.step?": 1.0,
            **{f"gyro.{n}": getattr(p, n) for n in "HJCK"},
            "gyro.reaction": True,
            "gyro.k": data_sheet(parts["gyro.k"]),
            "gyro.K_sg": 1.0,
            "gyro.u_max": 1e3,
            "gyro.step?": 1.0,
            **{f"gyro.{n}?": 0.0 for n in drifts},
            **{f"stabilizer.{n}?": 1.0 for n in ("tau1", "T1")},
            **{f"stabilizer.{n}?": 0.01 for n in ("tau2", "T2")},
            "stabilizer.v_max": 1e9,
        }

    def check(self) -> list[str]:
        if problems := self.no_choice(kind=KINDS):
            return problems
        problems = self.not_positive("J0", "J", "H", "M", "time", "float_stop")
        for name in ("C", "K", "offload", "viscous"):
            if not self[name] >= 0.0:
                problems.append(f"{name} = {self[name]:g} {self.options[name].unit}: must be >= 0")
        if self["kind"] == "rate-integrating" and self["C"] == 0.0:
            problems.append("C = 0 N.m.s/rad: a rate-integrating gyro has damping (kind=integrating has none)")
        if self["kind"] == "rate" and self["K"] == 0.0:
            problems.append("K = 0 N.m/rad: a rate gyro has a spring (kind=rate-integrating has none)")
        problems += self.no_choice(form=("exact", "light"))
        if problems:
            return problems
        zeta = self.axis().zeta
        if self["form"] == "light" and self["kind"] != "rate-integrating":
            problems.append("form = light is 5-34, of the rate-integrating gyro")
        elif self["form"] == "light" and zeta > LIGHT:
            problems.append(
                f"form = light with a damping of {zeta:.3g}: 5-34 holds for light damping, up to {LIGHT:g} "
                "(its error is 4 zeta2 J M/H2 and more); take form=exact"
            )
        slow = 0.1 / self.axis().n
        if self.step > slow:
            problems.append(
                f"step = {self.step:g} s: the nutation of {self.axis().n:.4g} rad/s wants {slow:.2g} s or less"
            )
        return problems

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        missing = ", ".join(n for n in ("platform.J", *(f"gyro.{n}" for n in "JHCK")) if n not in parameters)
        text = (
            f"the parts have no {missing}: this system needs a gyro with spring and damper that gives its momentum h_I "
            "(floated_gyro), and a platform with inertia J"
        )
        return [text] if missing else []

    def warnings(self) -> list[str]:
        p = self.axis()
        runs = 0.0 if self["kind"] == "rate" or self["offload"] else p.M * self["time"] / p.H
        if runs >= self["float_stop"]:
            return [
                f"the float runs away with M/H: it will reach its stop of {math.degrees(self['float_stop']):.3g}° "
                f"after about {self['float_stop'] * p.H / p.M:.3g} s, and the run will end there"
            ]
        text = f"the float will turn to {math.degrees(runs):.3g}°: the closed forms hold cos(b) at its mean"
        return [text] if runs > 0.1 else []
