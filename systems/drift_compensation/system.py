"""Compensation of a gyro's random drift: its drift is estimated from the table's angle and cancelled by the torquer."""

from __future__ import annotations

from typing import Any

from gyrobench.component.blocks.gyro import DEG_H
from gyrobench.system.connectors import Socket, inp, limit_flag, out
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System
from gyrobench.units import ARCSEC

TABLE = Socket(
    "DriftingTable",
    "table held by a gyro, which its drift turns: torquer current in, angle out, truth beside it",
    (
        inp("i", "A", "torquer current"),
        out("theta_read", "rad", "table angle as read"),
        out("restart", "1", "1 in the step in which a record begins", whole=True),
        out("record", "1", "number of the record, from 1", whole=True),
        out("M", "rad/s", "drift, without its white part"),
        out("alpha", "rad", "angle commanded by the gyro"),
        out("theta", "rad", "table angle"),
        out("theta_free", "rad", "table angle without compensation"),
    ),
)
COMPENSATOR = Socket(
    "DriftCompensator",
    "estimates the drift of a gyro from the angle of its table and cancels it: angle in, torquer current out",
    (
        inp("z", "rad", "table angle as read"),
        inp("valid", "1", "0 marks a reading to be left out", optional=True, whole=True),
        inp("restart", "1", "1: the table is at zero, begin anew", whole=True),
        out("estimate", "rad/s", "estimated drift"),
        out("u", "rad/s", "rate by the torquer, as commanded"),
        out("i", "A", "torquer current"),
        out("alpha", "rad", "estimated angle commanded by the gyro", optional=True),
        out("theta", "rad", "estimated table angle", optional=True),
        out("covariance", "1", "covariance of drift, alpha, theta, in units of rms, sigma, sigma", 3, 3, optional=True),
        out("nis", "1", "normalized innovation squared", optional=True),
        limit_flag("saturated", "1 while the torquer is at its limit"),
    ),
)


class DriftCompensation(System):
    """The random drift of a gyro turns the table that it holds; a filter estimates it from the readings of the table's
    angle and cancels it by the torquer.  Residual rate and angle over many records, against those without compensation.

    [COMP-RANDOM-DRIFT; Hu 1981, section 6.2, eq. 6-24..6-31]
    """

    title = "Compensation of random drift"
    spec = ("COMP-RANDOM-DRIFT",)
    slots = {"table": Slot(TABLE, "drifting_table"), "compensator": Slot(COMPENSATOR, "drift_compensator")}
    wires = """
        table.theta_read -> compensator.z
        table.restart -> compensator.restart
        compensator.i -> table.i
    """
    open = ("compensator.valid",)
    options = {
        "records": Option(60, int, "records, each beginning with the table at zero", 3, 2000),
        "length": Option("6h", "s", "length of a record", 0.0, sets="table.length"),
        "rms": Option(0.01 * DEG_H, "rad/s", "rms of the drift", 0.0, sets="table.drift compensator.rms"),
        "tau": Option(3600.0, "s", "correlation time of the drift", 0.0, sets="table.drift_tau compensator.tau"),
        "white": Option(0.0, "rad/s/sqrt(Hz)", "white drift density", 0.0, sets="table.white compensator.white"),
        "sigma": Option(0.2 * ARCSEC, "rad", "standard deviation of an angle reading", 0.0,
                        sets="table.reading compensator.sigma"),
        "lag": Option(1.0, "s", "time constant of the table servo", 0.0, sets="table.lag compensator.lag"),
        "Ts": Option(10.0, "s", "time between two readings", 0.0, sets="compensator.Ts"),
        "T_c": Option(300.0, "s", "time in which the angle is taken back; 0: the rate alone is compensated", 0.0,
                      sets="compensator.T_c"),
    }  # fmt: skip
    noises = ("table.drift", "table.white", "table.reading")
    channels = (
        "table.record", "table.restart", "table.M", "table.alpha", "table.theta", "table.theta_free",
        "compensator.estimate", "compensator.u", "compensator.alpha", "compensator.theta", "compensator.nis",
        "compensator.saturated", *(f"compensator.covariance[{i},{j}]" for i in (1, 2, 3) for j in (1, 2, 3) if i <= j),
    )  # fmt: skip
    shown = ("table.M compensator.estimate", "table.theta_free", "table.theta", "compensator.u")
    step = 10.0

    @property
    def stop(self) -> float:  # type: ignore[override]
        return float(self["records"] * self["length"])

    @property
    def channel_period(self) -> float:  # type: ignore[override]
        return float(self["Ts"])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        """Return the options' parameters; the compensator knows the torquer of the table."""
        return {**self.owned(), "compensator.k?": parts["table.k"]}

    def check(self) -> list[str]:
        positive = ("length", "rms", "tau", "sigma", "lag", "Ts")
        if found := [f"{n} = {self[n]:g}: must be > 0" for n in positive if self[n] <= 0.0]:
            return found
        readings, steps = self["length"] / self["Ts"], self["Ts"] / self.step
        if abs(readings - round(readings)) > 1e-9 * readings:
            found.append(f"length = {self['length']:g} s: must be a whole multiple of Ts = {self['Ts']:g} s")
        elif readings < 100:
            found.append(f"length = {self['length']:g} s: at least 100 readings, {self['Ts']:g} s apart, are needed")
        if steps < 0.5 or abs(steps - round(steps)) > 1e-9 * steps:
            found.append(f"Ts = {self['Ts']:g} s: must be a whole multiple of the step, {self.step:g} s")
        return found

    def warnings(self) -> list[str]:
        if self["length"] < 3.0 * self["tau"]:
            return [
                f"A record of {self['length']:g} s is shorter than three correlation times of the drift, tau = "
                f"{self['tau']:g} s. Its records are not independent and the stated u are too small. Take longer ones."
            ]
        return []
