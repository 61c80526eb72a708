"""Alignment of a gyro platform from switch-on: levelled, a coarse heading, gyrocompassed by its own instruments."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from gyrobench import drift, frames
from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.families import loop_test as loop
from gyrobench.system.families.loop_test import AXES, three
from gyrobench.system.families.moving_bases import BASES, velocity
from gyrobench.system.families.option_groups import SITE
from gyrobench.system.families.three_gyros import MOUNTS, commands
from gyrobench.system.families.three_gyros import design as three_gyros
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot, System

from . import planning, plans

DEG = math.pi / 180.0
MOST = 85.0 * DEG  # latitude
COMMANDS = commands("controller.command")
CONTROLLER = Socket(
    "AlignmentController",
    "levels a platform and finds its heading: specific force in, rates of the platform out",
    (
        inp("f", "m/s2", "measured specific force, platform axes", 3),
        out("command", "rad/s", "rate asked for, platform axes", 3),
        out("heading", "rad", "heading of the platform axis y as computed, clockwise"),
        out("sigma", "rad", "its standard deviation"),
        out("tilt", "rad", "tilt about x and y as measured", 2, optional=True),
        out("sigma_tilt", "rad", "standard deviation of the true tilt about x and y", 2, optional=True),
        out("correction", "rad/s", "rates beside those of the Earth", 3, optional=True),
        out("mode", "1", "1 levelling, 2 coarse, 3 turn, 4 second window, 5 to north, 6, 7 gyrocompass", whole=True),
        out("status", "1", "0 no heading, 1 valid, 2 rates contradict, 3 not level", whole=True),
        out("ready", "1", "1 while the heading is ready for use", whole=True),
        out("ready_time", "s", "since when; -1: it is not"),
        out("done", "1", "1 at the end", whole=True),
    ),
)


class PlatformAlignment(System):
    """The three-axis platform with three floated gyros and three accelerometers aligns itself: levelling, coarse
    heading in one or two positions, turn to north, gyrocompass of second or third order.

    [ALIGN-GYRO, PLATFORM-3AXIS-DYN, DECOUPLE-T2]
    """

    title = "Alignment of a gyro platform"
    spec = ("ALIGN-GYRO", "PLATFORM-3AXIS-DYN", "DECOUPLE-T2")
    reduction = "reduction"
    slots = {
        "site": Slot("Site", "site"),
        "platform": Slot("Platform", "platform_three_axis"),
        **{gyro: Slot("SdfGyro", "floated_gyro") for gyro in MOUNTS},
        "accelerometers": Slot("Accelerometers", "accelerometer_triad"),
        "controller": Slot(CONTROLLER, "alignment_controller"),
        "decoupler": Slot("Decoupler", "decoupler_t2"),
        **{axis: loop.stabilizer("stabilizer_lead_lag") for axis in AXES},
    }
    wires = """
        site -> platform: omega=omega_b alpha=alpha_b f=f_b
        platform -> decoupler: theta
        platform -> accelerometers: f
        accelerometers -> controller: f_read=f
        """ + "\n".join(COMMANDS) + "".join(
        f"""
        platform -> {gyro}: omega alpha f
        {gyro}.M_react[{k}] -> platform.M_gyro[{k}]
        {gyro}.u -> decoupler.u[{k}]
        decoupler.u_axes[{k}] -> {axis}.u
        {axis}.v -> platform.v[{k}]
        """
        for k, (gyro, axis) in enumerate(zip(MOUNTS, AXES, strict=True), 1)
    )  # fmt: skip
    open = ("platform.M_load", *(f"{axis}.test" for axis in AXES), *(f"{axis}.command" for axis in AXES))
    factors = COMMANDS
    options = SITE | {
        "grade": Option("navigation", str, f"grade of gyros and accelerometers: {', '.join(plans.GRADES)}"),
        "gyro_drift": Option(0.0, "rad/s", "constant drift of each gyro (rms); 0: of the grade", 0.0),
        "gyro_markov": Option(0.0, "rad/s", "Gauss-Markov drift of each gyro (rms); 0: of the grade", 0.0),
        "gyro_white": Option(0.0, "rad/s/sqrt(Hz)", "white drift of each gyro; 0: of the grade", 0.0),
        "accelerometer": Option(0.0, "m/s2", "bias of each accelerometer (rms); 0: of the grade", 0.0),
        "wanted": Option("5arcmin", "rad", "standard deviation of the heading that is ready for use", 1e-6),
        "positions": Option(1, int, "windows of the coarse heading: 1, or 2 half a turn apart", 1, 2),
        "order": Option(3, int, "order of the gyrocompass loop", 2, 3),
        "coarse_time": Option(0.0, "s", "length of a window of the coarse heading; 0: by what is wanted", 0.0, 3600.0),
        "fast": Option(0.0, "rad/s", "natural frequency of the gyrocompass at first; 0: by what is wanted", 0.0, 0.3),
        "fast_time": Option(-1.0, "s", "time for which it stays there; below 0: by the frequency", -1.0),
        "slow": Option(0.0, "rad/s", "natural frequency to which it falls; 0: by what is wanted", 0.0, 0.3),
        "hold": Option(120.0, "s", "time for which the heading is held ready", 0.0),
        "time": Option(1800.0, "s", "time after which the run ends, ready or not", 100.0, 36000.0),
        "heading": Option("40deg", "rad", "heading of the platform at switch-on (simulated)", -math.pi, math.pi),
        "pitch": Option("2deg", "rad", "angle of the middle gimbal at switch-on (simulated)", -30 * DEG, 30 * DEG),
        "roll": Option("-1.5deg", "rad", "angle of the outer gimbal at switch-on (simulated)", -30 * DEG, 30 * DEG),
        "base": Option("rest", str, f"what the platform stands on (simulated): {', '.join(BASES)}"),
        "crossover": Option(5.0, "Hz", "crossover of the stabilizer loops", 1.0, 15.0),
        "u_latitude": Option(0.0, "rad", "standard uncertainty of the latitude", 0.0),
        "u_scale": Option(0.0, "1", "relative std. unc. of the scale factor of the azimuth torquer", 0.0),
    }
    noises = (
        *loop.noises(MOUNTS), *(f"accelerometers.white_{a}" for a in "xyz"), "site.local_e", "site.local_n",
    )  # fmt: skip
    step = 1e-3
    done = "controller.done"
    channels = (
        *three("platform.theta"), "controller.heading", "controller.sigma",
        "controller.tilt[1]", "controller.tilt[2]", "controller.sigma_tilt[1]", "controller.sigma_tilt[2]",
        *three("controller.correction"), "controller.mode", "controller.status", "controller.ready",
        "controller.ready_time", "platform.lock", "platform.saturated",
        *(f"{slot}.saturated" for slot in (*MOUNTS, *AXES)),
    )  # fmt: skip
    shown = ("platform.theta", "controller.tilt", "controller.heading", "controller.sigma", "controller.mode",
             "controller.status controller.ready")  # fmt: skip
    channel_period = 1.0
    bodies = """
        roll gimbal: y platform.theta[2]
        pitch gimbal: roll gimbal, x platform.theta[1]
        inner element: pitch gimbal, z platform.theta[3]
    """

    def set(self, name: str, value: Any) -> None:
        """Set an option; a moving base puts its ground into the slot site, and its tilt into the record."""
        super().set(name, value)
        if name == "base":
            moving = self["base"] != "rest"
            site = replace(self.slots["site"], part="ground_motion" if moving else "site")
            tilts = three("site.tilt") if moving else ()
            own = type(self)
            vars(self).update(slots={**self.slots, "site": site}, channels=(*own.channels, *tilts))
            vars(self)["noises"] = own.noises if moving else own.noises[:-2]

    @property
    def stop(self) -> float:  # type: ignore[override]
        """Return a time past the end by ``time``, which the controller says, s."""
        return float(self["time"]) + 1.0

    @property
    def sensors(self) -> plans.Sensors:
        """Return what the controller is told of its sensors: the grade, what is given beside it, and type B."""
        grade = plans.GRADES.get(self["grade"], plans.GRADES["navigation"])
        own = {"bias": "gyro_drift", "markov": "gyro_markov", "white": "gyro_white", "accelerometer": "accelerometer"}
        given = {n: self[option] for n, option in own.items() if self[option]}
        return replace(grade, **given, latitude=self["u_latitude"], scale=self["u_scale"])

    def settings(self, psi: float = math.pi / 2.0) -> plans.Settings:
        """Return the settings of the controller; psi: rough heading at switch-on, for the time of the turns."""
        gravity = self["gravity"] or frames.normal_gravity(self["latitude"], self["height"])
        given = plans.Settings(
            self["latitude"], gravity, positions=self["positions"], coarse_time=self["coarse_time"],
            order=self["order"], fast_frequency=self["fast"], fast_time=self["fast_time"], slow_frequency=self["slow"],
        )  # fmt: skip
        return planning.designed(given, self.sensors, self["wanted"], psi, self["time"])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        sensors = self.sensors
        noise = {"turn_on": "bias", "markov": "markov", "white": "white", "markov_tau": "tau"}
        return {
            **self.owned(),
            **BASES.get(self["base"], {}),
            "platform.theta_0": [self["pitch"], self["roll"], -self["heading"]],
            **three_gyros(parts, self["crossover"]),
            **{f"{slot}.{n}?": getattr(sensors, field) for slot in MOUNTS for n, field in noise.items()},
            **{f"accelerometers.{n}?": sensors.force for n in ("white", "white_x", "white_y", "white_z")},
            **self._controller(parts),
        }

    def _controller(self, parts: PartValues) -> dict[str, Any]:
        c, s = self.settings(), self.sensors
        values = {
            "latitude": c.latitude, "gravity": c.gravity, "positions": c.positions, "coarse_time": c.coarse_time,
            "order": c.order, "damping": c.damping, "level_frequency": c.level_frequency, "rate_max": c.rate_max,
            "fast_frequency": c.fast_frequency, "fast_time": c.fast_time, "slow_frequency": c.slow_frequency,
            "wanted": self["wanted"], "hold": self["hold"], "time_limit": self["time"],
            "errors_bias": s.bias, "errors_markov": s.markov, "errors_tau": s.tau, "errors_white": s.white,
            "errors_accelerometer": s.accelerometer, "errors_force": s.force, "errors_latitude": s.latitude,
            "errors_scale": s.scale,
        }  # fmt: skip
        if self["base"] in BASES and self["base"] != "rest":
            period = float(parts.get("controller.period", 0.2))
            values["errors_vibration"] = velocity(self["base"], parts, period)
        known = {f"controller.drift[{k}]?": x for k, x in enumerate(_level_drift(parts, c.gravity), 1)}
        return {f"controller.{n}?": x for n, x in values.items()} | known

    def check(self) -> list[str]:
        problems = frames.gravity_problems(self["gravity"]) if self["gravity"] else []
        for name, known in (("grade", plans.GRADES), ("base", BASES)):
            if self[name] not in known:
                problems.append(f"{name} = {self[name]}: must be one of {', '.join(known)}")
        if abs(self["latitude"]) > MOST:
            problems.append(
                f"latitude = {math.degrees(self['latitude']):.4g}°: within 5° of a pole the horizontal Earth rate is "
                "below 9 % of that at the equator; no gyrocompass"
            )
        if self["slow"] and self["fast"] and self["slow"] > self["fast"]:
            problems.append(f"slow = {self['slow']:g} rad/s: must be at most fast = {self['fast']:g} rad/s")
        if self["fast"] > 0.3 or 2.0 * math.pi * self["crossover"] * self.step > 0.1:
            problems.append(
                f"crossover = {self['crossover']:g} Hz: the stabilizers are closed through a delay of one step, "
                f"{self.step:g} s, which wants a crossover up to {0.1 / (2.0 * math.pi * self.step):.3g} Hz"
            )
        return problems

    def warnings(self) -> list[str]:
        found = []
        if abs(self["latitude"]) > 80.0 * DEG:
            factor = math.cos(40.0 * DEG) / math.cos(self["latitude"])
            found.append(f"Latitude above 80°: the error of the heading is {factor:.2g} times that at 40°.")
        if self.check():
            return found
        c, s = self.settings(), self.sensors
        reached, sigma = planning.predicted(c, s, math.pi / 2.0, self["time"])
        if planning.ready_after(reached, sigma, self["wanted"]) is None:
            arcmin = DEG / 60.0
            h = plans.history(c, math.pi / 2.0, self["time"], s.tau)
            sources = {n: float(np.abs(v[-1, 2])) for n, (_, _, v) in h.sources(c, s).items()}
            worst, most = max(sources.items(), key=lambda x: x[1])
            found.append(
                f"A standard deviation of {self['wanted'] / arcmin:.3g}′ is not expected within {self['time']:g} s: "
                f"{sigma[-1] / arcmin:.3g}′ then, {most / arcmin:.3g}′ of it by {plans.SOURCES[worst]}. Take two "
                "positions, better sensors, or more time."
            )
        return found


def _level_drift(parts: PartValues, gravity: float) -> list[float]:
    """Return the static drift of each gyro on the level platform, from the coefficients that the parts have."""
    found = []
    for slot, mount in MOUNTS.items():
        values = {n: float(parts.get(f"{slot}.{n}", 0.0)) for n in drift.NAMES}
        load = -np.asarray(mount, dtype=float) @ [0.0, 0.0, gravity / frames.G0]
        found.append(float(drift.drift(load, values)))
    return found
