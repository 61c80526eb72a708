"""Coning test of a strapdown unit: what gyros, output and algorithm of its user make of a motion without turn."""

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

from .closed import AXES, Chain
from .measured import MEASURED

CONE = "axis of the cone vertical"
#: axis of the case along that of the cone -> rows: axes x, y, z of the case in table axes
FACES = {a: np.roll(np.eye(3), k + 1, axis=0) for k, a in enumerate(AXES)}
TABLE = Socket(
    "ConingTable",
    "table whose plate cones about the vertical: rates and forces of the case, attitude as read",
    (
        inp("f_local", "m/s2", "specific force at the site, ENU", 3),
        inp("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
        inp("phase", "1", "running phase", whole=True),
        inp("frequency_wanted", "", "frequency of the cone, Hz; negative: the other sense"),
        inp("half_angle_wanted", "", "its half-angle, rad"),
        out("omega", "rad/s", "inertial rate, axes of the case", 3),
        out("f", "m/s2", "specific force, axes of the case", 3),
        out("attitude", "1", "quaternion of the plate in table axes", 4),
        out("closing", "1", "1 while the cone of the phase before closes", whole=True),
        out("angle", "rad", "angle of the plate about the vertical"),
        out("in_position", "1", "1: the table is where it should be", whole=True),
    ),
)
IMU = Socket(
    "StrapdownGyros",
    "three gyros: inertial rate and specific force in, rates out",
    (
        inp("omega", "rad/s", "inertial rate, axes of the plate", 3),
        inp("f", "m/s2", "specific force, axes of the plate", 3),
        out("rate", "rad/s", "rates that the gyros x, y, z read", 3),
    ),
)
INCREMENTS = Socket(
    "AngleIncrements",
    "rates in, angle increments at the output rate of the unit out",
    (
        inp("rate", "rad/s", "rates that the gyros x, y, z read", 3),
        out("dtheta", "rad", "angle increments of the last output", 3),
        out("number", "1", "outputs since the start", whole=True),
    ),
)
USER = Socket(
    "StrapdownUser",
    "attitude from angle increments; by how much it changes against the reference",
    (
        inp("dtheta", "rad", "angle increments", 3),
        inp("number", "1", "increments since the start", whole=True),
        inp("attitude", "1", "reference", 4),
        inp("omega_local", "rad/s", "Earth rate", 3),
        inp("align", "1", "1: take the reference", whole=True),
        inp("gate", "1", "0: the error is not counted", whole=True),
        out("drift", "rad/s", "change of the error over the step, by the step", 3),
    ),
)
RAMP = 0.5  # s in which the cone opens, and closes
WHOLE = 1e-6  # of a ratio that is to be a whole number


class ConingTest(System):
    """A table moves one axis of a strapdown unit round a cone, at one frequency after another.  The case comes back to
    where it was, the attitude that its user computes does not: the drift against the rest between the cones shows what
    filter, output rate, coning terms, scale factors and misalignments cost him.

    [TEST-CONING; Goodman 1958, Bortz 1971, Savage 1998]
    """

    title = "Coning test of a strapdown unit"
    spec = ("TEST-CONING", "IMU-POSITIONS")
    reduction = "reduction"
    slots = {
        "site": Slot("Site", "site"),
        "sequencer": Slot("Sequencer", "sequencer"),
        "table": Slot(TABLE, "table_coning"),
        "imu": Slot(IMU, "imu"),
        "increments": Slot(INCREMENTS, "angle_increments"),
        "user": Slot(USER, "strapdown_attitude"),
        **{f"sampler_{a}": Slot("Sampler", "sampler") for a in AXES},
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
        {"".join(sampled(f"sampler_{a}", "table: angle") for a in AXES)}
    """
    options = (
        SITE
        | {
            "axis": Option("z", str, "axis of the case along that of the cone: x, y or z"),
            "half_angle": Option("0.5deg", "rad", "half-angle of the cone", 1e-6, 0.5),
            "frequencies": Option("2 5 10 20 40", str, "of the cones, Hz; negative: the other sense"),
            "window": Option(2.0, "s", "time of a reading; frequencies are rounded to whole cones in it", 1e-3),
            "readings": Option(8, int, "readings at each frequency, and at rest", 2, 1000),
            "cycles": Option(2, int, "times the frequencies are gone through, up and down by turns", 1, 8),
            "settle": Option(2.0, "s", "wait before the readings, in which the cones close and open", 1.5),
            "interval": Option(0.01, "s", "time between two outputs of the unit", 1e-4, sets="increments.period"),
            "bandwidth": Option("200Hz", "Hz", "3 dB of its filter; 0: none", 0.0, sets="increments.bandwidth"),
            "coning": Option(True, bool, "its increments are rotation vectors, with coning", sets="increments.coning"),
            "samples": Option(1, int, "increments the user takes for one update: 1 or 2", 1, 2, sets="user.samples"),
        }
        | NUISANCES
        | CORRECTIONS
        | type_b("time", mount="standard uncertainty of the case about each of its axes on the plate")
        | {"u_twist": Option(0.0, "rad/s", "std. unc. of a steady turn of the table about the axis of the cone", 0.0)}
    )
    noises = tuple(f"imu.{a}_{n}" for a in AXES for n in ("gyro", "gyro_bias"))
    assumed = ("imu.mount",)
    measured_data = MEASURED
    done = "sequencer.done"
    step = 5e-4
    windows = Windows(
        "sampler_x.count",
        {
            "phase": "sampler_x.window_phase",
            **{n: f"sampler_x.{n}" for n in ("t_start", "t_end", "n")},
            **{f"drift_{a}": f"sampler_{a}.mean" for a in AXES},
        },
    )
    channels = tuple(f"user.error[{k}]" for k in (1, 2, 3))
    channel_period = 0.5
    bodies = ""

    def chain(self) -> Chain:
        """Return the chain from rates to attitude as it is stated."""
        return Chain.of(self.values, self.step)

    def cones(self) -> list[float]:
        """Return the frequencies in whole cones of a reading, Hz.  Raises InvalidValueError."""
        try:
            given = [float(x) for x in str(self["frequencies"]).replace(",", " ").split()]
        except ValueError:
            given = []
        if not given or not all(map(math.isfinite, given)):
            raise InvalidValueError(f"frequencies = {self['frequencies']}: numbers in Hz are expected, as 2 5 10")
        return [round(f * self["window"]) / self["window"] for f in given]

    def plan(self) -> Plan:
        """Return rest, cones upwards, rest, downwards, rest ..."""
        cones, phases = self.cones(), [self._phase(0.0)]
        for k in range(self["cycles"]):
            phases += [self._phase(f) for f in (cones if k % 2 == 0 else cones[::-1])] + [self._phase(0.0)]
        return Plan(phases, {CONE: FACES.get(self["axis"], np.eye(3))})

    def _phase(self, f: float) -> Phase:
        label = f"{f:g} Hz, {self['half_angle'] / DEG:.4g}°".replace("-", "−") if f else "at rest"
        size = self["half_angle"] if f else 0.0
        window = self["window"]
        return Phase(label, "hold", CONE, target=f, target_y=size, settle=self["settle"],
                     dwell=self["readings"] * window, window=window)  # fmt: skip

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        face = FACES.get(self["axis"], np.eye(3)).tolist()
        return {
            **self.plan().parameters(),
            **self.owned(),
            "table.ramp": RAMP,
            "table.face": face,
            "user.face": face,
            **{f"sampler_{a}.integrated?": 1 for a in AXES},
        }

    def check(self) -> list[str]:
        problems = [] if self["axis"] in FACES else [f"axis = {self['axis']}: x, y or z is expected"]
        step, interval, window = self.step, self["interval"], self["window"]
        updates = self["samples"] * interval
        for name, long, short, unit in (
            ("interval", interval, step, f"steps of {step:g} s"),
            ("window", window, updates, "updates of the attitude"),
        ):  # fmt: skip
            if round(long / short) < 1 or abs(long / short - round(long / short)) > WHOLE * long / short:
                problems.append(f"{name} = {long:g} s: must be a whole number of {unit}")
        for f in self.cones():
            if f == 0.0:
                problems.append(f"frequencies: each needs at least one cone in a reading of {window:g} s")
            if abs(f) * updates > 0.49:
                problems.append(f"frequencies: {f:g} Hz: a cone needs more than two updates, {updates:g} s apart")
        return problems

    def warnings(self) -> list[str]:
        if self["coning"] and self["samples"] == 2:
            return ["coning and samples = 2: the coning within the increments is computed twice"]
        return []
