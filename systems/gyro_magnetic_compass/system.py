"""Gyro-magnetic compass: a directional gyro slaved to a flux valve, in sines, in a turn and in a disturbed field."""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.connectors import Socket, inp, limit_flag, out
from gyrobench.system.families.loop_test import FLOWN, LoopTest, by_phase
from gyrobench.system.families.option_groups import MOVING
from gyrobench.system.loop_plan import LoopPhase, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot
from gyrobench.units import DEG

from .field import Field, FieldError, field_at

MOST = 85.0 * DEG  # latitude

GYRO = Socket(
    "DirectionalGyro",
    "keeps a direction in azimuth",
    (
        inp("omega", "rad/s", "inertial rate of the vehicle, vehicle axes", 3),
        inp("angle", "rad", "pitch, roll, heading counter-clockwise of the vehicle", 3, optional=True),
        inp("rate", "rad/s", "precession asked for, clockwise"),
        inp("disturbance", "rad/s", "drift to be added, clockwise", optional=True),
        out("psi", "rad", "heading shown, clockwise"),
    ),
)
SENSOR = Socket(
    "MagneticSensor",
    "magnetic heading of a vehicle",
    (
        inp("angle", "rad", "pitch, roll, heading counter-clockwise of the vehicle", 3),
        inp("f", "m/s2", "specific force, vehicle axes", 3, optional=True),
        inp("disturbance", "rad", "error of the heading by a disturbed field", optional=True),
        out("psi", "rad", "magnetic heading, clockwise"),
    ),
)
SLAVING = Socket(
    "Slaving",
    "turns a gyro to a magnetic heading",
    (
        inp("psi", "rad", "heading of the gyro, clockwise"),
        inp("psi_m", "rad", "magnetic heading, clockwise"),
        inp("turn", "rad/s", "turn rate of the vehicle", optional=True),
        out("rate", "rad/s", "precession asked for, clockwise"),
        out("error", "rad", "magnetic heading less heading, -pi to pi"),
        out("cut", "1", "1 while the slaving is cut off", optional=True, whole=True),
        limit_flag("limited", "1 while its rate is at the limit"),
    ),
)


class GyroMagneticCompass(LoopTest):
    """A directional gyro is slaved to a magnetic heading: alignment after an offset, rest, sines of the magnetic
    heading and of the drift of the gyro, a turn, a disturbed field.

    [GYRO-MAGNETIC-COMPASS; GSP ch. 5, section 5.3.2]
    """

    title = "Gyro-magnetic compass"
    spec = ("GYRO-MAGNETIC-COMPASS",)
    slots = {
        "exciter": Slot("Excitation", "exciter"),
        "motion": Slot("Motion", "manoeuvre"),
        "gyro": Slot(GYRO, "directional_gyro"),
        "sensor": Slot(SENSOR, "magnetic_sensor"),
        "slaving": Slot(SLAVING, "slaving"),
    }
    wires = f"""
        {FLOWN}
        motion -> gyro: omega angle
        motion -> sensor: angle f
        motion.omega[3] -> slaving.turn
        exciter.test[1] -> sensor.disturbance
        exciter.command[1] -> gyro.disturbance
        gyro.psi -> slaving.psi
        sensor.psi -> slaving.psi_m
        slaving.rate -> gyro.rate
    """
    factors = {"exciter.test[1] -> sensor.disturbance": 1.0}  # 1 rad/V
    loops = {"slaving": "slaving.psi"}
    options = {
        "k": Option(1.0 / 60.0, "1/s", "slaving rate per error", 1e-4, 1.0, sets="slaving.k"),
        "limit": Option("2deg/min", "rad/s", "largest slaving rate", 1e-6, sets="slaving.limit"),
        "cut_off": Option(1, int, "1: the slaving is cut off in turns", 0, 1, sets="slaving.cut_off"),
        "offset": Option("5deg", "rad", "heading error that is aligned", -math.pi, math.pi),
        "drift": Option("5deg/h", "rad/s", "drift of the gyro, clockwise", sets="gyro.drift"),
        "corrected": Option(1, int, "1: the Earth's rate is corrected for the latitude", 0, 1),
        "true_heading": Option(False, bool, "the declination is added: true instead of magnetic heading"),
        "declination": Option(0.0, "rad", "declination of the field, clockwise", sets="sensor.declination"),
        "date": Option("", str, "day (as 2026-07-02) whose field at the site the sensor has; empty: none"),
        "longitude": Option(0.0, "rad", "longitude of the site, east", -math.pi, math.pi),
        "height": Option(0.0, "m", "height of the site above the ellipsoid", -1e3, 1e5),
        "turn": Option("3deg/s", "rad/s", "rate of the turn, clockwise"),
        "turned": Option("180deg", "rad", "angle of the turn", 0.0),
        "speed": Option(50.0, "m/s", "speed in the turn", 0.0, sets="motion.speed"),
        "field_step": Option("10deg", "rad", "disturbance of the magnetic heading"),
        "field_time": Option(60.0, "s", "its time", 1.0),
        "random_drift": Option("0.1deg/sqrt(h)", "rad/s/sqrt(Hz)", "angle random walk", 0.0),
        "noise": Option("0.1deg/sqrt(Hz)", "rad/sqrt(Hz)", "noise of the magnetic heading", 0.0),
        **MOVING,
    }
    noises = ("gyro.white", "sensor.white")
    step = 0.1
    channels = (
        "exciter.phase", "exciter.gate", "exciter.test[1]", "exciter.command[1]",
        *(f"motion.angle[{k}]" for k in (1, 2, 3)), "gyro.psi", "sensor.psi", "slaving.error", "slaving.rate",
        "slaving.cut",
    )  # fmt: skip
    shown = ("motion.angle", "gyro.psi sensor.psi", "slaving.error", "slaving.rate", "slaving.cut")
    channel_period = 0.1
    bodies = "vehicle: z motion.angle[3], x motion.angle[1], y motion.angle[2]"

    def field(self) -> Field | None:
        """Return the field of the day and the site; None without a date.  Raises FieldError."""
        site = (float(self["latitude"]), float(self["longitude"]), float(self["height"]))
        return field_at(str(self["date"]), *site) if self["date"] else None

    def phases(self) -> list[LoopPhase]:
        """Return alignment, rest, sines about the cut-off k/2 pi, the turn and what it leaves, the disturbed field."""
        corner, wait = self["k"] / (2.0 * math.pi), 6.0 / self["k"]
        tones = [corner * x for x in (0.4, 0.7, 1.0, 1.5, 3.0)]
        aligned = abs(self["offset"]) / self["limit"] + 2.0 * wait
        return [
            LoopPhase("alignment", "test", "step", amplitude=self["offset"], settle=wait, dwell=aligned),
            LoopPhase("rest", settle=aligned, dwell=4.0 * wait),
            *sweep("magnetic", "test", tones, 1.0 * DEG, periods=3),
            *sweep("drift", "command", tones, 1.0 * DEG * self["k"], periods=3),
            LoopPhase("turn", settle=wait, dwell=self["turned"] / abs(self["turn"] or 1.0)),
            LoopPhase("after the turn", dwell=wait),
            LoopPhase("field", "test", "step", amplitude=self["field_step"], settle=wait, dwell=self["field_time"]),
        ]

    def design(self, parts: PartValues) -> dict[str, Any]:
        # the motion counts counter-clockwise
        motion = by_phase([p.label for p in self.plan().phases], ("turn",), {"turn": {"turn": -self["turn"]}})
        try:
            field = self.field()
        except FieldError:  # check() says it
            field = None
        declination = field.declination if field else self["declination"]
        of_day = {"inclination?": field.inclination, "field?": field.horizontal} if field else {}
        sensor = {f"sensor.{n}": x for n, x in {"declination": declination, **of_day}.items()} if field else {}
        correction = self["earth_rate"] * math.sin(self["latitude"]) if self["corrected"] else 0.0
        return {
            **sensor,
            "motion.turn": motion["turn"],
            "gyro.start_error?": 0.0 if self["true_heading"] else -declination,  # aligned
            "gyro.white?": self["random_drift"],
            "sensor.white?": self["noise"],
            "slaving.correction?": correction,
            "slaving.declination?": declination if self["true_heading"] else 0.0,
        }

    def crossovers(self) -> dict[str, float]:
        return {"slaving": self["k"] / (2.0 * math.pi)}

    def check(self) -> list[str]:
        problems = self.not_positive("turned")
        if self["turn"] == 0.0:
            problems.append("turn = 0: the turn must have a rate")
        if abs(self["latitude"]) > MOST:
            problems.append(
                f"latitude = {self['latitude'] / DEG:.4g}°: beyond 85° the horizontal field gives no heading"
            )
        if self["true_heading"] and "declination" not in self.given and not self["date"]:
            problems.append("true_heading: the declination of the place is missing; give declination, or date and site")
        if self["date"] and "declination" in self.given:
            problems.append(
                "declination and date are given: the date sets the declination of the site; give one of them"
            )
        try:
            self.field()
        except FieldError as e:
            problems.append(str(e))
        return problems
