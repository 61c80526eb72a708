"""Coning test of a strapdown unit: what gyros, output and algorithm of its user make of a motion without turn."""

from __future__ import annotations

from typing import Any

import numpy as np

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families import strapdown_motion
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, type_b
from gyrobench.system.families.table_test import sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, Windows

from . import sources
from .closed import Chain
from .measured import MEASURED

TABLE = strapdown_motion.motion_table(
    "ConingTable",
    "table whose plate cones about the vertical: rates and forces of the case, attitude as read",
    inp("half_angle_wanted", "", "half-angle of the cone, rad"),
)
USER_OF_ANGLES = Socket(
    "StrapdownUser",
    "attitude from angle increments; by how much it changes against the reference",
    (
        *strapdown_motion.USER,
        inp("gate", "1", "0: the error is not counted", whole=True),
        out("drift", "rad/s", "change of the error over the step, by the step", 3),
    ),
)


class ConingTest(strapdown_motion.StrapdownMotion):
    """A table moves one axis of a strapdown unit round a cone, at one frequency after another.  The case comes back to
    where it was, the attitude that its user computes does not: the drift against the rest between the cones shows what
    filter, output rate, coning terms, scale factors and misalignments cost him.

    [TEST-CONING; Goodman 1958, Bortz 1971, Savage 1998]
    """

    title = "Coning test of a strapdown unit"
    spec = ("TEST-CONING", "IMU-POSITIONS")
    kind, amplitude, updated, senses = "axis of the cone vertical", "half_angle", "attitude", True
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot(TABLE, "table_coning"),
        "imu": Slot(
            Socket(
                "StrapdownGyros", "three gyros: inertial rate and specific force in, rates out", strapdown_motion.UNIT
            ),
            "imu",
        ),
        "increments": Slot(
            Socket(
                "AngleIncrements",
                "rates in, angle increments at the output rate of the unit out",
                strapdown_motion.INCREMENTS,
            ),
            "angle_increments",
        ),
        "user": Slot(USER_OF_ANGLES, "strapdown_attitude"),
        **{f"sampler_{a}": Slot("Sampler", "sampler") for a in strapdown_motion.AXES},
    }
    wires = f"""
        site -> table: f=f_local omega=omega_local
        sequencer -> table: phase target=frequency_wanted target_y=half_angle_wanted
        table -> sequencer: angle in_position
        table -> imu: omega f
        imu -> increments: rate
        increments -> user: dtheta number
        table -> user: attitude closing=align
        site -> user: omega=omega_local
        sequencer -> user: gate
        user.drift[1] -> sampler_x.x
        user.drift[2] -> sampler_y.x
        user.drift[3] -> sampler_z.x
        {"".join(sampled(f"sampler_{a}", "table: angle") for a in strapdown_motion.AXES)}
    """
    options = (
        SITE
        | {
            "axis": Option("z", str, "axis of the case along that of the cone: x, y or z"),
            "half_angle": Option("0.5deg", "rad", "half-angle of the cone", 1e-6, 0.5),
            "frequencies": Option("2 5 10 20 40", str, "of the cones, Hz; negative: the other sense"),
            "bandwidth": Option("200Hz", "Hz", "3 dB of its filter; 0: none", 0.0, sets="increments.bandwidth"),
            "coning": Option(True, bool, "its increments are rotation vectors, with coning", sets="increments.coning"),
        }
        | strapdown_motion.GONE_THROUGH
        | NUISANCES
        | CORRECTIONS
        | type_b("time", mount="standard uncertainty of the case about each of its axes on the plate")
        | type_b(sources)
    )
    noises = tuple(f"imu.{a}_{n}" for a in strapdown_motion.AXES for n in ("gyro", "gyro_bias"))
    measured_data = MEASURED
    windows = Windows.of(
        "sampler_x", "t_start t_end n", **{f"drift_{a}": f"sampler_{a}.mean" for a in strapdown_motion.AXES}
    )
    channels = tuple(f"user.error[{k}]" for k in (1, 2, 3))

    def chain(self) -> Chain:
        """Return the chain from rates to attitude as it is stated."""
        return Chain.of(self.values, self.step)

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        face = strapdown_motion.FACES.get(self["axis"], np.eye(3)).tolist()
        return {
            **self.plan().parameters(),
            **self.owned(),
            "table.ramp": strapdown_motion.RAMP,
            "table.face": face,
            "user.face": face,
            **{f"sampler_{a}.integrated?": 1 for a in strapdown_motion.AXES},
        }

    def warnings(self) -> list[str]:
        if self["coning"] and self["samples"] == 2:
            return ["coning and samples = 2: the coning within the increments is computed twice"]
        return []
