"""Sculling test of a strapdown unit: what increments and algorithm make of a vibration in phase with an angle."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families.option_groups import CORRECTIONS, NUISANCES, SITE, type_b
from gyrobench.system.families.table_test import sampled
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, Slot, System, Windows
from gyrobench.system.values import InvalidValueError
from gyrobench.units import DEG

from .closed import FACES
from .measured import MEASURED

UPRIGHT = "axis of the drift vertical"
TABLE = Socket(
    "ScullingTable",
    "table that rocks about one horizontal axis and shakes along the other: rates and forces of the case, attitude",
    (
        inp("f_local", "m/s2", "specific force at the site, ENU", 3),
        inp("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
        inp("phase", "1", "running phase", whole=True),
        inp("frequency_wanted", "", "frequency of the motion, Hz"),
        inp("angle_wanted", "", "amplitude of the angle, rad"),
        out("omega", "rad/s", "inertial rate, axes of the case", 3),
        out("f", "m/s2", "specific force, axes of the case", 3),
        out("attitude", "1", "quaternion of the plate in table axes", 4),
        out("closing", "1", "1 while the motion of the phase before closes", whole=True),
        out("angle", "rad", "angle of the plate about the vertical"),
        out("in_position", "1", "1: the table is where it should be", whole=True),
    ),
)
IMU = Socket(
    "StrapdownUnit",
    "three gyros and three accelerometers: inertial rate and specific force in, readings out",
    (
        inp("omega", "rad/s", "inertial rate, axes of the plate", 3),
        inp("f", "m/s2", "specific force, axes of the plate", 3),
        out("rate", "rad/s", "rates that the gyros x, y, z read", 3),
        out("f_read", "m/s2", "specific force that the accelerometers x, y, z read", 3),
    ),
)
INCREMENTS = Socket(
    "Increments",
    "rates and specific force in, angle and velocity increments at the output rate of the unit out",
    (
        inp("rate", "rad/s", "rates that the gyros x, y, z read", 3),
        inp("f_read", "m/s2", "specific force that the accelerometers x, y, z read", 3),
        out("dtheta", "rad", "angle increments of the last output", 3),
        out("dvelocity", "m/s", "velocity increments of the last output", 3),
        out("number", "1", "outputs since the start", whole=True),
    ),
)
USER = Socket(
    "StrapdownVelocity",
    "velocity from angle and velocity increments: by how much it changes beyond gravity",
    (
        inp("dtheta", "rad", "angle increments", 3),
        inp("dvelocity", "m/s", "velocity increments", 3),
        inp("number", "1", "increments since the start", whole=True),
        inp("attitude", "1", "reference", 4),
        inp("omega_local", "rad/s", "Earth rate", 3),
        inp("f_local", "m/s2", "specific force at rest", 3),
        inp("align", "1", "1: take the reference", whole=True),
        out("acceleration", "m/s2", "change of the velocity over the step, by the step, table axes", 3),
    ),
)
RAMP = 0.5  # s in which the motion opens, and closes
WHOLE = 1e-6  # of a ratio that is to be a whole number


class ScullingTest(System):
    """A table rocks a strapdown unit about one horizontal axis and shakes it along the other, in phase, at one
    frequency after another.  The case stays where it was, the velocity that its user computes does not: its change
    along the vertical against that at rest shows what filters, output rate, sculling terms and lever arms cost him.

    [TEST-SCULLING; Savage 1998b, Roscoe 2001]
    """

    title = "Sculling test of a strapdown unit"
    spec = ("TEST-SCULLING", "TEST-CONING")
    reduction = "reduction"
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot(TABLE, "table_sculling"),
        "imu": Slot(IMU, "imu"),
        "increments": Slot(INCREMENTS, "angle_increments"),
        "user": Slot(USER, "strapdown_attitude"),
        "sampler": Slot("Sampler", "sampler"),
    }
    wires = f"""
        site -> table: f=f_local omega=omega_local
        sequencer -> table: phase target=frequency_wanted target_y=angle_wanted
        table -> sequencer: angle in_position
        table -> imu: omega f
        imu -> increments: rate f_read
        increments -> user: dtheta dvelocity number
        table -> user: attitude closing=align
        site -> user: omega=omega_local f=f_local
        user.acceleration[3] -> sampler.x
        {sampled("sampler", "table: angle")}
    """
    options = (
        SITE
        | {
            "axis": Option("z", str, "axis of the case along the vertical: x, y or z"),
            "angle": Option("0.5deg", "rad", "amplitude of the angle, about the axis after it", 1e-6, 0.5),
            "vibration": Option(5.0, "m/s2", "amplitude of the vibration along the third axis", sets="table.vibration"),
            "frequencies": Option("5 10 20 40", str, "of both, Hz"),
            "window": Option(2.0, "s", "time of a reading; frequencies are rounded to whole periods in it", 1e-3),
            "readings": Option(8, int, "readings at each frequency, and at rest", 2, 1000),
            "cycles": Option(2, int, "times the frequencies are gone through, up and down by turns", 1, 8),
            "settle": Option(2.0, "s", "wait before the readings, in which the motion opens and closes", 1.5),
            "interval": Option(0.01, "s", "time between two outputs of the unit", 1e-4, sets="increments.period"),
            "bandwidth": Option("200Hz", "Hz", "3 dB of the filter of the gyros; 0: none", 0.0,
                                sets="increments.bandwidth"),
            "acc_bandwidth": Option("100Hz", "Hz", "3 dB of that of the accelerometers; 0: none", 0.0,
                                    sets="increments.acc_bandwidth"),
            "sculling": Option(True, bool, "its velocity increments have sculling", sets="increments.sculling"),
            "samples": Option(1, int, "increments the user takes for one update: 1 or 2", 1, 2, sets="user.samples"),
            "size": Option(0.0, "m", "height of the third axis' accelerometer above that of the vertical"),
        }
        | NUISANCES
        | CORRECTIONS
        | type_b("time")
        | {
            "u_angle": Option(0.0, "1", "relative standard uncertainty of the amplitude of the angle", 0.0),
            "u_vibration": Option(0.0, "1", "relative standard uncertainty of that of the vibration", 0.0),
            "u_phase": Option(0.0, "rad", "standard uncertainty of the phase between both", 0.0),
        }
    )  # fmt: skip
    noises = tuple(f"imu.{a}_{n}" for a in "xyz" for n in ("gyro", "gyro_bias", "acc", "acc_bias"))
    assumed = ("imu.mount",)
    measured_data = MEASURED
    done = "sequencer.done"
    step = 5e-4
    windows = Windows(
        "sampler.count",
        {
            "phase": "sampler.window_phase",
            **{n: f"sampler.{n}" for n in ("t_start", "t_end", "n")},
            "acceleration": "sampler.mean",
        },
    )
    channels = ("sampler.mean",)
    channel_period = 0.5
    bodies = ""

    def periods(self) -> list[float]:
        """Return the frequencies in whole periods of a reading, Hz.  Raises InvalidValueError."""
        try:
            given = [float(x) for x in str(self["frequencies"]).replace(",", " ").split()]
        except ValueError:
            given = []
        if not given or not all(0.0 < f < math.inf for f in given):
            raise InvalidValueError(f"frequencies = {self['frequencies']}: positive numbers in Hz are expected, 5 10")
        return [round(f * self["window"]) / self["window"] for f in given]

    def plan(self) -> Plan:
        """Return rest, frequencies upwards, rest, downwards, rest ..."""
        rising, phases = self.periods(), [self._phase(0.0)]
        for k in range(self["cycles"]):
            phases += [self._phase(f) for f in (rising if k % 2 == 0 else rising[::-1])] + [self._phase(0.0)]
        return Plan(phases, {UPRIGHT: FACES.get(self["axis"], np.eye(3))})

    def _phase(self, f: float) -> Phase:
        label = f"{f:g} Hz, {self['angle'] / DEG:.4g}°" if f else "at rest"
        window = self["window"]
        return Phase(label, "hold", UPRIGHT, target=f, target_y=self["angle"] if f else 0.0, settle=self["settle"],
                     dwell=self["readings"] * window, window=window)  # fmt: skip

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        face = FACES.get(self["axis"], np.eye(3))
        levers = self["size"] * np.outer(face[:, 1], face[:, 2])
        return {
            **self.plan().parameters(),
            **self.owned(),
            "table.ramp": RAMP,
            "table.face": face.tolist(),
            "table.levers": levers.tolist(),
            "user.face": face.tolist(),
            "sampler.integrated?": 1,
        }

    def check(self) -> list[str]:
        problems = [] if self["axis"] in FACES else [f"axis = {self['axis']}: x, y or z is expected"]
        step, interval, window = self.step, self["interval"], self["window"]
        updates = self["samples"] * interval
        for name, long, short, unit in (
            ("interval", interval, step, f"steps of {step:g} s"),
            ("window", window, updates, "updates of the velocity"),
        ):  # fmt: skip
            if round(long / short) < 1 or abs(long / short - round(long / short)) > WHOLE * long / short:
                problems.append(f"{name} = {long:g} s: must be a whole number of {unit}")
        for f in self.periods():
            if f == 0.0:
                problems.append(f"frequencies: each needs at least one period in a reading of {window:g} s")
            if f * updates > 0.49:
                problems.append(f"frequencies: {f:g} Hz: a period needs more than two updates, {updates:g} s apart")
        return problems

    def warnings(self) -> list[str]:
        if self["sculling"] and self["samples"] == 2:
            return ["sculling and samples = 2: the sculling within the increments is computed twice"]
        return []
