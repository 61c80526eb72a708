"""Line of sight that follows a target: a gimbal of two axes with two rate loops, a tracker, two tracking loops."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.record.target_path import TargetPath, read_path
from gyrobench.result import SetBy
from gyrobench.system.families import loop_test as loop
from gyrobench.system.families.sight_test import AXES, MOVED_STEP, SightTest
from gyrobench.system.line_of_sight import Density, LineOfSight, SightSource
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot

from .sources import TARGET, image_density, image_noises, prediction, set_by, target_rates

TARGETS = ("rest", "constant", "sine", "circle", "flyby")
TYPES = (1, 2)
PREDICTED = ("none", "rate", "acceleration")
CORNER = 6.0  # crossover of a tracking loop over the corner of its integral
TONES = (0.3, 0.5, 0.7, 0.85, 1.0, 1.2, 1.6, 2.2, 3.0, 4.0)  # of the crossover
IMAGE_TEST = 4e-4  # V (rad), of the test sines of the tracking loops
TIMES = ("period", "exposure", "processing")
ODD = 1e-3  # of a time: less than that it is changed without a word
SAMPLES = 10.0  # images in a period of the crossover, or more
KEPT = 0.05  # of the wanted accuracy: a recorded path is off by it at most
SLOWER = 0.25  # of the rate loop's crossover: that of the tracking loop


class TrackingPlan(LoopPlan):
    """A plan whose commands are errors of the image."""

    def rows(self) -> list[dict[str, Any]]:
        return [row | ({"unit": "rad"} if row["mode"] == "command" else {}) for row in super().rows()]


class GimbalTracking(SightTest):
    """A tracker on the inner gimbal measures how far the target is from the line of sight, frame by frame; a controller
    of each axis makes a commanded rate of it, which the rate loops follow, the outer one with 1/cos of the inner angle.

    [TRACK-LOOP, TRACK-IMAGE, LOS-TARGET, GIMBAL-2AXIS, LOS-JITTER, BASE-PSD; Masten 2008, Hilkert 2008]
    """

    title = "Line of sight that follows a target"
    spec = ("TRACK-LOOP", "TRACK-IMAGE", "LOS-TARGET", "GIMBAL-2AXIS", "LOS-JITTER", "BASE-PSD")
    reduction = "reduction"
    test = 0.02
    slots = SightTest.with_parts(
        motion="base_motion",
        load="load_torque",
        vibration="base_vibration",
        platform="gimbal_two_axis",
        gyro="gyro_mems",
        decoupler="decoupler_los",
        pitch="stabilizer_lti",
        yaw="stabilizer_lti",
    ) | {
        "target": Slot("Target", "moving_target"),
        "tracker": Slot("Tracker", "optical_tracker"),
        **{f"track_{axis}": loop.stabilizer("tracking_controller", "angle") for axis in AXES},
    }
    wires = SightTest.wires + """
        exciter.phase -> target.phase
        target -> tracker: direction omega=omega_target alpha=alpha_target
        platform -> tracker: omega alpha
        """ + "".join(
        f"""
        tracker.error[{two}] -> track_{axis}.u
        exciter.command[{three}] -> track_{axis}.test
        track_{axis}.v -> decoupler.command[{two}]
        """
        for axis, (two, three) in AXES.items()
    )  # fmt: skip
    factors = {
        # a target above the line of sight is the line of sight below it; 1 V for 1 rad and 1 rad/s
        f"tracker.error[{two}] -> track_{axis}.u": -1.0
        for axis, (two, _) in AXES.items()
    } | {
        wire: 1.0
        for axis, (two, three) in AXES.items()
        for wire in (f"exciter.command[{three}] -> track_{axis}.test", f"track_{axis}.v -> decoupler.command[{two}]")
    }
    loops = SightTest.loops | {f"track {axis}": f"track_{axis}.u" for axis in AXES}
    #: s, no part of the time between images: samples meet a held error at all of its ages
    channel_period = 6e-4
    options = SightTest.options | {
        "track": Option(1.5, "Hz", "crossover of both tracking loops, for the gains", 0.05, 20.0),
        "type": Option(2, int, "type of the tracking loops: 1 proportional, 2 with an integral", 1, 2),
        "rate_max": Option(1.0, "rad/s", "largest rate commanded", 1e-3, sets="track_pitch.v_max track_yaw.v_max"),
        "acceleration_max": Option(100.0, "rad/s2", "largest acceleration commanded", 1e-3,
                                   sets="track_pitch.slope_max track_yaw.slope_max"),
        "frames": Option(100.0, "Hz", "images in a second", 1.0, 5000.0),
        "exposure": Option(4e-3, "s", "time of exposure", 0.0, 1.0),
        "processing": Option(10e-3, "s", "time from the end of the exposure to the error", 0.0, 5.0),
        "pixel": Option(2e-5, "rad", "resolution of the error; 0: none", 0.0, sets="tracker.pixel"),
        "image_noise": Option(2e-5, "rad", "noise of each image and axis, rms", 0.0),
        "prediction": Option("none", str, f"of the error over the delay of its image: {', '.join(PREDICTED)}"),
        "index": Option(0.3, "1", "prediction: Kalata's tracking index, motion in an image over noise", 1e-6, 100.0),
        "field": Option(0.02, "rad", "field of view, full angle", 1e-5, 2.9, sets="tracker.field"),
        "target": Option("constant", str, f"motion of the target in the ride: {', '.join(TARGETS)}"),
        "path": Option("", str, "CSV file with the recorded path of the target (time, azimuth, elevation)"),
        "target_pitch": Option(1e-3, "rad/s", "target: constant rate about x, up"),
        "target_yaw": Option(5e-3, "rad/s", "target: constant rate about z, to the left"),
        "amplitude": Option(0.02, "rad", "target: amplitude of sine and circle", 0.0, 1.0),
        "frequency": Option(0.1, "Hz", "target: frequency of sine and circle", 1e-3, 20.0),
        "distance": Option(1500.0, "m", "fly-by: distance at the start", 1.0),
        "passing": Option(500.0, "m", "fly-by: distance where it is nearest", 0.1),
        "speed": Option(60.0, "m/s", "fly-by: speed, to the right", 0.0),
        "accuracy": Option(2e-4, "rad", "wanted: error of the line of sight, both axes together, below this", 1e-7),
        "acquire": Option(2e-3, "rad", "step of the wanted direction, each axis; 0: none", 0.0),
    }  # fmt: skip
    noises = (*SightTest.noises, "tracker.image_noise")
    channels = (
        *SightTest.channels, "exciter.command[1]", "exciter.command[3]",
        *(f"tracker.{n}[{k}]" for n in ("error", "miss", "rate", "acceleration") for k in (1, 2)), "tracker.lost",
        *(f"track_{axis}.{n}" for axis in AXES for n in ("e", "v")),
    )  # fmt: skip
    shown = ("tracker.miss", "tracker.error", "tracker.rate", "track_pitch.v track_yaw.v", "platform.theta",
             "vibration.omega")  # fmt: skip

    def phases(self) -> list[LoopPhase]:
        """Return loads, test sines of the four loops, steps of the wanted direction, base sines, and the ride."""
        *others, ride = super().phases()
        first = next((k for k, p in enumerate(others) if p.kind == "motion"), len(others))
        found, f = [], self["track"]
        for axis, (_, k) in AXES.items() if self["sweeps"] else ():
            tones = [f * x for x in TONES]
            found += sweep(f"loop track {axis}", "command", tones, IMAGE_TEST, axis=k, settle=2.0, periods=12)
        for axis, (_, k) in AXES.items() if self["acquire"] else ():
            time = 6.0 / f
            found.append(LoopPhase(f"acquire {axis}", "command", "step", k, self["acquire"], settle=time, dwell=time))
        return [*others[:first], *found, *others[first:], ride]

    def plan(self) -> LoopPlan:
        return TrackingPlan(super().plan().phases)

    def ride(self) -> LoopPhase:
        """Return the ride, in which the target moves and the base vibrates; measured after the loops have settled."""
        return LoopPhase("ride", "hold", settle=3.0 + 3.0 / self["track"], dwell=self["ride"])

    def times(self) -> dict[str, float]:
        """Return period, exposure and processing of an image, s, in whole communication steps."""
        wanted = (1.0 / self["frames"], self["exposure"], self["processing"])
        steps = [round(t / self.step) for t in wanted]
        steps[2] += max(0, 3 - steps[1] - steps[2])
        return {name: k * self.step for name, k in zip(TIMES, steps, strict=True)}

    def design(self, parts: PartValues) -> dict[str, Any]:
        found = super().design(parts)
        found |= {f"tracker.{n}": t for n, t in self.times().items()} | self.moves()
        found["tracker.image_noise?"] = self["image_noise"]
        found |= self.ahead()
        found["target.first?"] = found["vibration.first?"]
        for k, axis in enumerate(AXES):
            wc = 2.0 * math.pi * self["track"]
            corner = wc / CORNER if self["type"] == 2 else 0.0
            ahead = complex(prediction(self.ahead(), self["track"]))
            found[f"track_{axis}.K?"] = wc / abs((1.0 + corner / (1j * wc)) * self.closed(k, parts, 1j * wc) * ahead)
            found[f"track_{axis}.integral?"] = corner
        return found

    def ahead(self) -> dict[str, float]:
        """Return the parameters of the prediction: over the delay, with the filter of the tracking index."""
        order = PREDICTED.index(self["prediction"]) if self["prediction"] in PREDICTED else 0
        times = self.times()
        delay = 0.5 * times["exposure"] + times["processing"] + 0.5 * times["period"]
        bandwidth = self["index"] ** (1.0 / (order + 1)) / times["period"]
        return {"tracker.order": order, "tracker.ahead": delay, "tracker.bandwidth": bandwidth}

    def closed(self, k: int, parts: PartValues, s: complex) -> complex:
        """Return the closed rate loop of an axis, rate over commanded rate."""
        L = self.shape(k, parts, s) / abs(self.shape(k, parts, 2j * math.pi * self["crossover"]))
        return L / (1.0 + L)

    def line_of_sight(self, parameters: Mapping[str, Any]) -> LineOfSight:
        """Return what makes the tracking error jitter: base, target, gyro, images."""
        of_gimbal = super().line_of_sight(parameters)
        p = {n: float(parameters.get(f"tracker.{n}", 0.0)) for n in ("period", "image_noise", "pixel")}

        def images(sigma: float) -> Density:
            held = image_density(p["period"], sigma)
            return lambda f: held(f) * np.abs(prediction(parameters, f)) ** 2

        more = [
            SightSource(name, "command", k, images(sigma), f"track {axis}")
            for axis, (_, k) in AXES.items()
            for name, sigma in image_noises(p["image_noise"], p["pixel"]).items()
        ]
        ride = self.ride()
        t = np.arange(0.0, ride.settle + ride.dwell, MOVED_STEP)
        rates = target_rates(parameters, t)
        inside = t >= ride.settle
        # u = (-b, 1, a): a turn about x is its third element, one about z its first
        for element, rate in zip((3, 1), rates, strict=True):
            more.append(SightSource(TARGET, "direction", element, self.moved(rate[inside])))
        turned = np.array(parameters["platform.theta_0"])[:, None] + np.cumsum(rates, axis=1) * MOVED_STEP
        about = np.sqrt(np.mean(turned[:, inside] ** 2, axis=1)) * np.sign(turned[:, inside].mean(axis=1))
        angles = {loop: f"tracker.miss[{AXES[loop.split()[-1]][0]}]" for loop in self.loops}
        return replace(
            of_gimbal, sources=[*of_gimbal.sources, *more], angles=angles, moved_by=("target",), lost="tracker.lost",
            riding={"platform.theta_0": about.tolist()},
        )  # fmt: skip

    def set_by(self, source: str, parameters: Mapping[str, Any]) -> list[SetBy]:
        return set_by(source, parameters)

    def moves(self) -> dict[str, Any]:
        """Return the parameters of the moving target.  Raises DataError and OSError, of a recorded path."""
        if self["path"]:
            return self.recorded().parameters()
        kind = str(self["target"])
        if kind == "flyby":
            across = min(1.0, self["passing"] / self["distance"])
            v = [self["speed"] * across, -self["speed"] * math.sqrt(1.0 - across * across), 0.0]
            return {"target.kind?": 2, "target.distance?": self["distance"], **elements("velocity", v)}
        size = self["amplitude"]
        return {
            "target.kind?": 0 if kind == "rest" else 1,
            **elements("rate", [self["target_pitch"], self["target_yaw"]] if kind == "constant" else [0.0, 0.0]),
            **elements("amplitude", {"sine": [0.0, size], "circle": [size, size]}.get(kind, [0.0, 0.0])),
            "target.frequency?": self["frequency"],
            "target.lead?": 0.5 * math.pi if kind == "circle" else 0.0,
        }

    def recorded(self) -> TargetPath:
        """Return the recorded path of the target.  Raises DataError and OSError."""
        return read_path(Path(self["path"]), KEPT * self["accuracy"])

    def crossovers(self) -> dict[str, float]:
        """Return those of the tracking loops; that of a rate loop is asked for with its tracking loop open."""
        return {f"track {axis}": self["track"] for axis in AXES}

    def check(self) -> list[str]:
        problems = [*super().check(), *self.no_choice(target=TARGETS, prediction=PREDICTED)]
        period = 1.0 / self["frames"]
        if self["exposure"] > period * (1.0 + 1e-9):
            problems.append(f"exposure = {self['exposure']:g} s: longer than {period:g} s from image to image")
        if self["processing"] > 7.0 * period:
            problems.append(f"processing = {self['processing']:g} s: {7.0 * period:g} s (7 images) at most")
        if period < 2.0 * self.step:
            problems.append(f"frames = {self['frames']:g} Hz: {0.5 / self.step:g} Hz at most with this step")
        if self["target"] == "flyby" and self["passing"] > self["distance"]:
            problems.append(f"passing = {self['passing']:g} m: farther than distance = {self['distance']:g} m")
        if self["track"] > SLOWER * self["crossover"]:
            problems.append(
                f"track = {self['track']:g} Hz: a tracking loop stays below a quarter of the rate loop's crossover, "
                f"{SLOWER * self['crossover']:g} Hz here"
            )
        return problems

    def warnings(self) -> list[str]:
        found = super().warnings()
        wanted = {"frames": 1.0 / self["frames"], "exposure": self["exposure"], "processing": self["processing"]}
        for (name, time), taken in zip(wanted.items(), self.times().values(), strict=True):
            if abs(taken - time) > ODD * max(time, self.step):
                found.append(
                    f"{name}: {1e3 * time:.5g} ms is no whole number of steps of {1e3 * self.step:g} ms; "
                    f"{1e3 * taken:.5g} ms is taken"
                )
        if self["path"]:
            path, ride = self.recorded(), self.ride()
            if path.rows > path.t.size:
                found.append(
                    f"path: {path.t.size} of {path.rows} rows are taken; between them it is off by "
                    f"{1e6 * path.off:.2g} µrad at most"
                )
            if path.t[-1] < ride.settle + ride.dwell:
                found.append(
                    f"path: it ends after {path.t[-1]:.4g} s, and the ride takes {ride.settle + ride.dwell:.4g} s from "
                    "its start: the target rests then; shorten the ride"
                )
        if self["frames"] < SAMPLES * self["track"]:
            found.append(
                f"frames = {self['frames']:g} Hz: fewer than {SAMPLES:g} images in a period of the crossover, "
                f"{self['track']:g} Hz; the linear model takes their averages and delay, not their aliases"
            )
        return found


def elements(name: str, values: Sequence[float]) -> dict[str, float]:
    """Return the elements of a parameter of the target, of a part that has it."""
    return {f"target.{name}[{k}]?": float(x) for k, x in enumerate(values, 1)}
