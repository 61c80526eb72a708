"""Tests of what a strapdown unit and its user make of a motion that leads nowhere: sockets, plan and checks.

class Mine(StrapdownMotion):
    kind, amplitude, updated = "axis of the cone vertical", "half_angle", "attitude"
    options = SITE | {...} | GONE_THROUGH
"""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np

from gyrobench.system.connectors import Connector, Socket, inp, out
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option, System
from gyrobench.system.values import InvalidValueError
from gyrobench.units import DEG

AXES = "xyz"
#: axis of the case along the vertical -> rows: axes x, y, z of the case in table axes
FACES = {a: np.roll(np.eye(3), k + 1, axis=0) for k, a in enumerate(AXES)}
RAMP = 0.5  # s in which the motion opens, and closes
WHOLE = 1e-6  # of a ratio that is to be a whole number


def motion_table(name: str, doc: str, amplitude: Connector) -> Socket:
    """Return the socket of a table that moves its plate at a frequency; amplitude: the input that says how far."""
    return Socket(
        name,
        doc,
        (
            inp("f_local", "m/s2", "specific force at the site, ENU", 3),
            inp("omega_local", "rad/s", "Earth rate at the site, ENU", 3),
            inp("phase", "1", "running phase", whole=True),
            inp("frequency_wanted", "", "frequency of the motion, Hz; of a cone negative: the other sense"),
            amplitude,
            out("omega", "rad/s", "inertial rate, axes of the case", 3),
            out("f", "m/s2", "specific force, axes of the case", 3),
            out("attitude", "1", "quaternion of the plate in table axes", 4),
            out("closing", "1", "1 while the motion of the phase before closes", whole=True),
            out("angle", "rad", "angle of the plate about the vertical"),
            out("in_position", "1", "1: the table is where it should be", whole=True),
        ),
    )


#: connectors of a unit, of its increments and of its user; tests of velocities have further ones
UNIT = (
    inp("omega", "rad/s", "inertial rate, axes of the plate", 3),
    inp("f", "m/s2", "specific force, axes of the plate", 3),
    out("rate", "rad/s", "rates that the gyros x, y, z read", 3),
)
INCREMENTS = (
    inp("rate", "rad/s", "rates that the gyros x, y, z read", 3),
    out("dtheta", "rad", "angle increments of the last output", 3),
    out("number", "1", "outputs since the start", whole=True),
)
USER = (
    inp("dtheta", "rad", "angle increments", 3),
    inp("number", "1", "increments since the start", whole=True),
    inp("attitude", "1", "reference", 4),
    inp("omega_local", "rad/s", "Earth rate", 3),
    inp("align", "1", "1: take the reference", whole=True),
)
GONE_THROUGH = {
    "window": Option(2.0, "s", "time of a reading; frequencies are rounded to whole periods in it", 1e-3),
    "readings": Option(8, int, "readings at each frequency, and at rest", 2, 1000),
    "cycles": Option(2, int, "times the frequencies are gone through, up and down by turns", 1, 8),
    "settle": Option(2.0, "s", "wait before the readings, in which the motion opens and closes", 1.5),
    "interval": Option(0.01, "s", "time between two outputs of the unit", 1e-4, sets="increments.period"),
    "samples": Option(1, int, "increments the user takes for one update: 1 or 2", 1, 2, sets="user.samples"),
}


class StrapdownMotion(System):
    """A table moves a strapdown unit at one frequency after another, up and down, with rests between."""

    kind: ClassVar[str]  # label of the mount
    amplitude: ClassVar[str]  # option with the angle of the motion
    updated: ClassVar[str]  # of what the user makes updates
    senses: ClassVar[bool] = False  # a frequency may be negative
    assumed = ("imu.mount",)
    done = "sequencer.done"
    step = 5e-4
    channel_period = 0.5

    def periods(self) -> list[float]:
        """Return the frequencies in whole periods of a reading, Hz.  Raises InvalidValueError."""
        try:
            given = [float(x) for x in str(self["frequencies"]).replace(",", " ").split()]
        except ValueError:
            given = []
        if not given or not all(math.isfinite(f) and (self.senses or f > 0.0) for f in given):
            which = "numbers" if self.senses else "positive numbers"
            raise InvalidValueError(f"frequencies = {self['frequencies']}: {which} in Hz are expected, as 5 10 20")
        return [round(f * self["window"]) / self["window"] for f in given]

    def plan(self) -> Plan:
        """Return rest, frequencies upwards, rest, downwards, rest ..."""
        rising, phases = self.periods(), [self._phase(0.0)]
        for k in range(self["cycles"]):
            phases += [self._phase(f) for f in (rising if k % 2 == 0 else rising[::-1])] + [self._phase(0.0)]
        return Plan(phases, {self.kind: FACES.get(self["axis"], np.eye(3))})

    def _phase(self, f: float) -> Phase:
        size, window = self[self.amplitude], self["window"]
        label = f"{f:g} Hz, {size / DEG:.4g}°".replace("-", "−") if f else "at rest"
        return Phase(label, "hold", self.kind, target=f, target_y=size if f else 0.0, settle=self["settle"],
                     dwell=self["readings"] * window, window=window)  # fmt: skip

    def check(self) -> list[str]:
        problems = [] if self["axis"] in FACES else [f"axis = {self['axis']}: x, y or z is expected"]
        step, interval, window = self.step, self["interval"], self["window"]
        updates = self["samples"] * interval
        for name, long, short, unit in (
            ("interval", interval, step, f"steps of {step:g} s"),
            ("window", window, updates, f"updates of the {self.updated}"),
        ):
            if round(long / short) < 1 or abs(long / short - round(long / short)) > WHOLE * long / short:
                problems.append(f"{name} = {long:g} s: must be a whole number of {unit}")
        for f in self.periods():
            if f == 0.0:
                problems.append(f"frequencies: each needs at least one period in a reading of {window:g} s")
            if abs(f) * updates > 0.49:
                problems.append(f"frequencies: {f:g} Hz: a period needs more than two updates, {updates:g} s apart")
        return problems
