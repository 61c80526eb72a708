"""Tests of a line of sight on a gimbal of two axes: a rate gyro on the inner gimbal, two loops, a base that vibrates.

class Mine(SightTest):
    slots = SightTest.with_parts(platform="...", ...)
    wires = SightTest.wires + ...
    options = {**SightTest.options, ...}
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.motion_profile import RECORDED, profile_rates
from gyrobench.record.vibration_spectrum import VibrationSpectrum, read_spectrum
from gyrobench.reduction.loops.jitter import shortest, spectra
from gyrobench.reduction.loops.sight_budget import BY_UNBALANCE, NOISE_OF_GYRO, OF_BASE, at_the_body, by_unbalance
from gyrobench.reduction.loops.sight_quantities import TIMES, set_by
from gyrobench.result import SetBy
from gyrobench.system.families import loop_test as loop
from gyrobench.system.families.base_spectra import SPECTRA
from gyrobench.system.families.loop_test import LoopTest
from gyrobench.system.line_of_sight import Density, LineOfSight, SightSource
from gyrobench.system.loop_plan import LoopPhase, LoopPlan, sweep
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import Option, Slot

DEG = math.pi / 180.0
FORMS = ("yaw-pitch", "pitch-yaw")
AXES = {"pitch": (1, 1), "yaw": (2, 3)}  # element of two, and of the exciter's three
ON_INNER = [[1, 0, 0], [0, 0, 1], [0, -1, 0]]  # gyro axes x, y along x (pitch) and z (yaw) of the inner gimbal
INTEGRAL = 8.0  # crossover over the corner of the integral
NOTCH = (0.1, 0.7)  # damping of its zeros and of its poles
TONES = (0.3, 0.6, 0.85, 1.0, 1.2, 1.6, 2.2, 2.6, 3.0, 3.6)  # of the crossover
SWINGS = {1.0: 40.0, 3.0: 16.0, 8.0: 16.0}  # sines of the base, Hz, and how long the gyro's noise lets each take, s
NEVER = 100  # number of a phase that no plan has
MOVED_STEP = 2e-3  # s, of what moves in the ride, for the density of its rates


class SightTest(LoopTest):
    """A rate gyro on the inner gimbal measures the rates of the line of sight; a proportional-integral controller with
    a notch on each axis holds them at 0, the outer one with 1/cos of the inner angle.

    [GIMBAL-2AXIS, LOS-JITTER, BASE-PSD; Masten 2008, Hilkert 2008]
    """

    test: ClassVar[float] = 0.3  # V (rad/s), of the test sines
    spec: ClassVar[tuple[str, ...]] = ("GIMBAL-2AXIS", "LOS-JITTER", "BASE-PSD", "GYRO-MEMS", "STABILIZER-LTI")
    bodies = """
        base: z motion.angle[3], x motion.angle[1], y motion.angle[2]
        outer gimbal: base, z platform.theta[2]
        inner gimbal: outer gimbal, x platform.theta[1]
    """
    slots = LoopTest.slots | {
        "vibration": Slot("Vibration"),
        "platform": Slot("TwoAxisGimbal"),
        "gyro": Slot("RateGyro"),
        "decoupler": Slot("LosDecoupler"),
        **{axis: loop.stabilizer(signal="rate") for axis in AXES},
    }
    wires = loop.MOVED + loop.FLOWN + LoopTest.wires + """
        exciter.phase -> vibration.phase
        motion -> vibration: omega=omega_b alpha=alpha_b f=f_b
        vibration -> platform: omega=omega_b alpha=alpha_b f=f_b
        platform -> gyro: omega f
        gyro.rate -> decoupler.rate
        platform -> decoupler: theta
        """ + "".join(
        f"""
        load.M[{three}] -> platform.M_load[{two}]
        decoupler.u_axes[{two}] -> {axis}.u
        exciter.test[{three}] -> {axis}.test
        {axis}.v -> platform.v[{two}]
        platform.theta[{3 - two}] -> {axis}.schedule
        """
        for axis, (two, three) in AXES.items()
    )  # fmt: skip
    loops: ClassVar[dict[str, str]] = {axis: f"{axis}.u" for axis in AXES}
    options: ClassVar[dict[str, Option]] = {
        "form": Option("yaw-pitch", str, f"order of the joints, the outer one first: {', '.join(FORMS)}"),
        "pitch": Option(0.0, "rad", "joint angle about x at the start", -89 * DEG, 89 * DEG),
        "yaw": Option(0.0, "rad", "joint angle about z at the start", -89 * DEG, 89 * DEG),
        "crossover": Option(12.0, "Hz", "crossover of both loops, for the gains", 0.5, 100.0),
        "bending": Option(42.0, "Hz", "mode of each motor against its gimbal; 0: rigid", 0.0),
        "stiction": Option(0.0, "N.m", "break-away torque of each joint; 0.8 of it while it slips", 0.0),
        "gyro_noise": Option("0.005deg/s/sqrt(Hz)", "rad/s/sqrt(Hz)", "one-sided noise density of the gyro", 0.0),
        "gyro_bandwidth": Option(100.0, "Hz", "bandwidth of the gyro", 1.0, sets="gyro.bandwidth"),
        "base": Option("1deg", "rad", "amplitude of the base at and below 1 Hz; falls with 1/f; 0: no sines", 0.0),
        "sweeps": Option(True, bool, "test sines for the margins of each axis"),
        "load_step": Option(0.05, "N.m", "disturbance torque of the steps; 0: none", 0.0),
        "psd": Option("vehicle", str, f"vibration of the base: {', '.join(SPECTRA)}, none, or a CSV file with spectra"),
        "psd_scale": Option(1.0, "1", "factor on the vibration", 0.0, sets="vibration.scale"),
        "ride": Option(60.0, "s", "length of the ride with vibration", 5.0, 3600.0),
        "jitter_from": Option(1.0, "Hz", "lowest frequency of the jitter: a tracker or the user takes what is slower",
                              0.05, 50.0),
        **loop.PROFILE,
    }  # fmt: skip
    noises: ClassVar[tuple[str, ...]] = (
        "gyro.white", "gyro.turn_on", "gyro.flicker_x", "gyro.flicker_y", "gyro.walk_x", "gyro.walk_y",
    )  # fmt: skip
    step = 2e-4
    channels: ClassVar[tuple[str, ...]] = (
        "exciter.phase", "exciter.gate", "exciter.motion_angle[1]", "exciter.motion_angle[3]", "exciter.torque[1]",
        "exciter.torque[3]", "exciter.test[1]", "exciter.test[3]",
        *loop.three("motion.angle", "vibration.omega", "vibration.f"),
        *(f"{n}[{k}]" for n in ("platform.los", "platform.theta") for k in (1, 2)),
        "platform.keyhole", "decoupler.saturated", *(f"{axis}.{n}" for axis in AXES for n in ("e", "v")),
    )  # fmt: skip
    shown: ClassVar[tuple[str, ...]] = (
        "platform.los", "platform.theta", "vibration.omega", "pitch.e yaw.e", "pitch.v yaw.v",
    )  # fmt: skip
    channel_period = 1e-3

    def phases(self) -> list[LoopPhase]:
        """Return loads, test sines of both loops, sines of the base about its axes, and the ride."""
        fc, found = self["crossover"], []
        for axis, (_, k) in AXES.items() if self["load_step"] else ():
            found.append(LoopPhase(f"load {axis}", "torque", "step", k, self["load_step"], settle=1.0, dwell=1.0))
        for axis, (_, k) in AXES.items() if self["sweeps"] else ():
            tones = sorted([fc * x for x in TONES] + [x for x in (0.96 * self["bending"],) if fc < x < 4.0 * fc])
            found += sweep(f"loop {axis}", "test", tones, self.test, axis=k, settle=1.0, periods=40)
        for name, k in (("x", 1), ("z", 3)) if self["base"] else ():
            for f, dwell in SWINGS.items():
                found += sweep(f"base {name}", "motion", [f], self.swing, axis=k, settle=1.0, dwell=dwell)
        return [*found, self.ride()]

    def plan(self) -> LoopPlan:
        """Return the phases, or the ride alone by a recorded motion."""
        return LoopPlan([self.ride()] if self.values.get("profile") else self.phases())

    def ride(self) -> LoopPhase:
        """Return the ride, in which the base vibrates."""
        return LoopPhase("ride", "hold", settle=3.0, dwell=self["ride"])

    def swing(self, f: float) -> float:
        """Return the amplitude of a sine of the base, rad."""
        return float(self["base"] * min(1.0, 1.0 / f))

    def spectrum(self) -> VibrationSpectrum | None:
        """Return the vibration of the base.  Raises DataError and OSError, of a file."""
        name = str(self["psd"])
        if name == "none":
            return None
        return SPECTRA[name] if name in SPECTRA else read_spectrum(Path(name))

    @property
    def inner(self) -> str:
        """Return the name of the inner joint."""
        return "pitch" if self["form"] == FORMS[0] else "yaw"

    def line_of_sight(self, parameters: Mapping[str, Any]) -> LineOfSight:
        """Return what makes the line of sight jitter, for a jitter that is wanted of a loop."""
        spectrum, scale = self.spectrum(), float(parameters.get("vibration.scale", 1.0)) ** 2
        recorded = self.recorded_rates(parameters)
        moved = [] if recorded is None else [self.moved(rate) for rate in recorded]

        def angle(axis: int) -> Density:
            def of(f: Array) -> Array:
                vibration = scale * spectrum.density("rate", axis, f) / (2.0 * np.pi * f) ** 2 if spectrum else 0.0 * f
                return vibration + moved[axis](f) if moved else vibration

            return of

        angles = [float(x) for x in parameters["platform.theta_0"]]  # pitch, yaw
        white = 2.0 * float(parameters.get("gyro.white", 0.0)) ** 2
        band, K = float(parameters.get("gyro.bandwidth", np.inf)), float(parameters.get("decoupler.K", 1.0))

        def noise(axis: str) -> Density:
            gain = K if axis == self.inner else K / math.cos(angles[FORMS.index(self["form"])])
            return lambda f: white * gain**2 / (1.0 + (f / band) ** 4)

        squares = [np.zeros(3), np.zeros(3)]  # of rates and angles of the base
        if spectrum:
            f = spectrum.frequencies()
            density = np.array([spectrum.density("rate", k, f) for k in range(3)]) * scale
            squares = [np.atleast_1d(np.trapezoid(density / x**2, f, axis=1)) for x in (1.0, 2.0 * np.pi * f)]
        if recorded is not None:
            turned = np.cumsum(recorded, axis=1) * MOVED_STEP
            squares = [old + np.var(new, axis=1) for old, new in zip(squares, (recorded, turned), strict=True)]
        free, slipping = self.slips(parameters, squares) if np.any(squares[0]) else ({}, {})
        base = [SightSource(name, "motion", k + 1, angle(k)) for k, name in enumerate(OF_BASE)]
        lever = by_unbalance(parameters, (angles[0], angles[1]))

        def torque(joint: int, base: VibrationSpectrum) -> Density:
            def of(f: Array) -> Array:
                moved = np.array([base.density("acceleration", k, f) for k in range(3)])
                return np.asarray(scale * lever[joint] ** 2 @ moved * np.abs(at_the_body(parameters, f)[:, joint]) ** 2)

            return of

        if spectrum and np.any(lever):
            base += [SightSource(BY_UNBALANCE, "torque", k, torque(two - 1, spectrum)) for two, k in AXES.values()]

        def quantities(source: str, parameters: Mapping[str, Any]) -> list[SetBy]:
            if slipping and source in OF_BASE:  # friction that slips does not go with the base
                return [SetBy("amplitude", 1.0, TIMES, holds=(1.0, 1.0))]
            return self.set_by(source, parameters)

        gyro = [SightSource(NOISE_OF_GYRO, "test", k, noise(axis), axis) for axis, (_, k) in AXES.items()]
        narrow = spectrum.frequencies() if spectrum else np.zeros(0)
        return LineOfSight(self["jitter_from"], [*base, *gyro], narrow, quantities, free=free, slipping=slipping)

    def set_by(self, source: str, parameters: Mapping[str, Any]) -> list[SetBy]:
        """Return the quantities that set a source of the line of sight's jitter."""
        return set_by(source, parameters)

    def recorded_rates(self, parameters: Mapping[str, Any]) -> Array | None:
        """Return the rates of the base by its recorded motion in the ride, rad/s, (3, times); None: there is none."""
        if int(parameters.get("motion.preset", 0)) != RECORDED:
            return None
        points, ride = int(parameters["motion.points"]), self.ride()
        t_points, angles = (np.asarray(parameters[f"motion.{n}"], float)[:points] for n in ("profile_t", "profile"))
        t = np.arange(ride.settle, ride.settle + ride.dwell, MOVED_STEP)
        return profile_rates(t_points - t_points[0], float(parameters.get("motion.scale", 1.0)) * angles, t)

    def moved(self, rate: Array) -> Density:
        """Return the density of an angle, rad2/Hz, from its rate in the ride: rad/s, every MOVED_STEP."""
        made = spectra(MOVED_STEP, rate, self["jitter_from"])
        assert made is not None  # a ride is as long as its jitter takes
        return lambda f: np.interp(f, made.f, made.mean, right=0.0) / (2.0 * np.pi * f) ** 2

    def slips(self, parameters: Mapping[str, Any], squares: Sequence[Array]) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return the gimbal without dry friction, and with viscous friction for it; {}, {} where the joints stick.

        squares: of the base's rates and angles about x, y, z.  A line of sight at rest leaves the base's rate to the
        joints, v rms.  Friction M that slips makes torques of M rms, as viscous friction M / v does; they slip where
        the angle exceeds presliding.
        """
        most = np.maximum(parameters["platform.friction"], parameters["platform.stiction"])
        k_in, k_out = (0, 2) if self.inner == "pitch" else (2, 0)
        inside, outside = (float(parameters["platform.theta_0"][k // 2]) for k in (k_in, k_out))
        c, s = (fun(outside) ** 2 for fun in (math.cos, math.sin))
        rate, angle = (np.sqrt([
            c * x[k_in] + s * x[1], x[k_out] + math.tan(inside) ** 2 * (c * x[1] + s * x[k_in])
        ]) for x in squares)  # fmt: skip
        rate, angle = (x if self.inner == "pitch" else x[::-1] for x in (rate, angle))  # pitch, yaw
        if not np.any(most) or not np.all(angle > float(parameters["platform.presliding"])):
            return {}, {}
        free = {"platform.friction": [0.0, 0.0], "platform.stiction": [0.0, 0.0]}
        viscous = np.asarray(parameters["platform.viscous"]) + np.asarray(parameters["platform.friction"]) / rate
        return free, {**free, "platform.viscous": viscous.tolist()}

    def design(self, parts: PartValues) -> dict[str, Any]:
        form = FORMS.index(self["form"])
        spectrum = self.spectrum()
        found: dict[str, Any] = {
            "platform.form?": form,
            "platform.step?": self.step,  # a mode of 60 Hz wants less than the millisecond of the part
            "decoupler.form?": form,
            "platform.theta_0": [self["pitch"], self["yaw"]],
            "platform.bending": [self["bending"]] * 2,
            "platform.stiction": [self["stiction"]] * 2,
            "platform.friction": [0.8 * self["stiction"]] * 2,
            "gyro.mount": ON_INNER,
            "gyro.white?": self["gyro_noise"] / math.sqrt(2.0),
            **(spectrum.parameters() if spectrum else {"vibration.points?": 0}),
            "vibration.first?": next((k for k, p in enumerate(self.plan().phases, 1) if p.label == "ride"), NEVER),
        }
        for k, axis in enumerate(AXES):
            found |= self.controller(axis, k, parts)
        return found

    def controller(self, axis: str, k: int, parts: PartValues) -> dict[str, Any]:
        """Return the parameters of one stabilizer: K (1 + w_i/s) N(s), N a notch at the mode; |L| = 1 at crossover."""
        wc = 2.0 * math.pi * self["crossover"]
        integral = wc / INTEGRAL
        zero, pole = self.notch()
        gain = 1.0 / abs(self.shape(k, parts, 1j * wc))
        num = gain * np.polynomial.polynomial.polymul([integral, 1.0], zero)
        den = np.polynomial.polynomial.polymul([0.0, 1.0], pole)
        return {
            f"{axis}.form?": 1,
            **{f"{axis}.{n}[{j}]?": float(x) for n, row in (("num", num), ("den", den)) for j, x in enumerate(row, 1)},
            f"{axis}.K?": gain,
            f"{axis}.integral?": integral,
            **{f"{axis}.{n}?": 1.0 for n in ("tau1", "T1", "tau2", "T2")},
            f"{axis}.v_max?": parts["platform.v_max"][k],
        }

    def notch(self) -> tuple[Array, Array]:
        """Return numerator and denominator of the notch at the mode, rising powers of s; of 1 for a rigid gimbal."""
        w = 2.0 * math.pi * self["bending"]
        zero, pole = (np.array([1.0, 2.0 * z / w, 1.0 / w**2]) if w else np.array([1.0]) for z in NOTCH)
        return zero, pole

    def shape(self, k: int, parts: PartValues, s: complex) -> complex:
        """Return the open loop of an axis over the gain of its controller, without step and delays."""
        w = 2.0 * math.pi * self["bending"]
        plant = parts["platform.k_t"][k] / parts["platform.R"][k] / (self.inertia(k, parts) * s)
        if w:
            zeta = parts["platform.bending_damping"][k]
            plant *= (1.0 + 2.0 * zeta * s / w) / (1.0 + 2.0 * zeta * s / w + (s / w) ** 2)
        ratio = s / (2.0 * math.pi * self["gyro_bandwidth"])
        gyro = 1.0 / (1.0 + math.sqrt(2.0) * ratio + ratio**2)
        of_s = np.polynomial.polynomial.polyval
        zero, pole = self.notch()
        integral = 2.0 * math.pi * self["crossover"] / INTEGRAL
        return complex(plant * gyro * (1.0 + integral / s) * of_s(s, zero) / of_s(s, pole))

    def inertia(self, k: int, parts: PartValues) -> float:
        """Return the inertia that the motor of an axis turns at the start: kg.m2."""
        form = FORMS.index(self["form"])
        motor = parts["platform.J_motor"][k]
        axis, outer, inner = 2 * k, parts["platform.I_outer"], parts["platform.I_inner"]
        if k == form:
            return float(motor + inner[axis][axis])
        angle = self["pitch"] if form == 0 else self["yaw"]
        c, s = math.cos(angle), math.sin(angle)
        cross = inner[1][axis] * (1.0 if form == 0 else -1.0)
        turned = s * s * inner[1][1] + c * c * inner[axis][axis] + 2.0 * s * c * cross
        return float(motor + outer[axis][axis] + turned)

    def check(self) -> list[str]:
        problems = self.no_choice(form=FORMS)
        if self["bending"] and self["bending"] < self["crossover"]:
            problems.append(
                f"crossover = {self['crossover']:g} Hz: above the mode at {self['bending']:g} Hz, which turns the "
                "phase by 180 degrees; take a lower one"
            )
        if self["ride"] < shortest(self["jitter_from"]):
            problems.append(
                f"ride = {self['ride']:g} s: a jitter from {self['jitter_from']:g} Hz takes "
                f"{shortest(self['jitter_from']):g} s or more"
            )
        if str(self["psd"]) not in (*SPECTRA, "none") and not Path(str(self["psd"])).is_file():
            problems.append(f"psd = {self['psd']}: none of {', '.join(SPECTRA)}, none, and not a file")
        elif self.highest() > 0.5 / self.step:
            problems.append(
                f"psd = {self['psd']}: reaches up to {self.highest():g} Hz, and steps of {self.step:g} s carry up to "
                f"{0.5 / self.step:g} Hz: cut the spectrum there"
            )
        return problems

    def highest(self) -> float:
        """Return the highest frequency of the vibration, Hz."""
        spectrum = self.spectrum()
        return float(spectrum.f[-1]) if spectrum else 0.0

    def warnings(self) -> list[str]:
        inner, found = self[self.inner], []
        if abs(inner) > 75 * DEG:
            found.append(
                f"the inner joint begins at {math.degrees(inner):.3g}°, in the keyhole: the gain of the outer loop is "
                "held at that of 75°, and its motor may reach its limit"
            )
        if self.highest() > 0.5 / self.channel_period:
            found.append(
                f"psd reaches up to {self.highest():g} Hz, and the base is recorded every {self.channel_period:g} s: "
                f"what is above {0.5 / self.channel_period:g} Hz stands in the budget by source as a slower motion"
            )
        return found
