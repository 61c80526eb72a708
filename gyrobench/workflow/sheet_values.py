"""From the figures of a data sheet to parameters of parts and to what a test believes.  [GYRO-SHEET, TABLE-PRESETS]

A limit of an error says nothing about one instrument and sets no parameter; of a turntable it is what one believes of
its errors, u = limit/sqrt 3.  Not modelled: figures that no part has (vibration, ageing, size, load).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gyrobench.bench import UsageError
from gyrobench.frames import G0

if TYPE_CHECKING:
    from gyrobench.workflow.instruments import Instrument

#: figure -> its unit of a rate gyro and of the accelerometers of a unit; "": it has none
RATES_AND_FORCES = {
    "range": ("rad/s", "m/s2"),
    "resolution": ("rad/s", "m/s2"),
    "bandwidth": ("Hz", "Hz"),
    "output_rate": ("Hz", "Hz"),
    "noise_density": ("rad/s/sqrt(Hz)", "m/s2/sqrt(Hz)"),
    "angle_random_walk": ("rad/sqrt(s)", ""),
    "velocity_random_walk": ("", "m/s/sqrt(s)"),
    "bias_instability": ("rad/s", "m/s2"),
    "bias": ("rad/s", "m/s2"),
    "bias_temperature": ("rad/s/K", "m/s2/K"),
    "scale_error": ("1", "1"),
    "scale_temperature": ("1/K", "1/K"),
    "nonlinearity": ("1", "1"),
    "misalignment": ("rad", "rad"),
    "cross_axis": ("1", "1"),
    "g_sensitivity": ("rad.s/m", ""),
}
RATE_GYRO, ACCELEROMETERS = ({n: units[k] for n, units in RATES_AND_FORCES.items() if units[k]} for k in (0, 1))
#: figure of a floated gyro -> its unit and parameter
COEFFICIENTS = tuple(f"D_{n}" for n in ("F", "I", "O", "S", "II", "OO", "SS", "IO", "OS", "IS"))
FLOATED: dict[str, tuple[str, str]] = {
    **{n: ("rad/s", n) for n in COEFFICIENTS},
    "angular_momentum": ("N.m.s", "H"),
    "float_inertia": ("kg.m2", "J"),
    "float_damping": ("N.m.s/rad", "C"),
    "torquer": ("rad/s/A", "k"),
    "pickoff_gain": ("V/rad", "K_sg"),
    "turn_on": ("rad/s", "turn_on"),
    "random_drift": ("rad/s", "markov"),
    "temperature": ("rad/s/K", "D_T"),
    "field": ("rad/s/T", "D_B"),
    "field_difference": ("rad/s/T", "D_dB"),
}
#: figure of a turntable -> its unit, the parameter that it sets and the option that its limit states
TURNTABLE: dict[str, tuple[str, str, str]] = {
    "rate_max": ("rad/s", "rate_max", ""),
    "resolution": ("rad", "quantum", ""),
    "torque": ("N.m", "torque_max", ""),
    "servo_stiffness": ("N.m/rad", "stiffness", ""),
    "friction": ("N.m", "friction", ""),
    "wobble": ("rad", "wobble", "u_wobble"),
    "axis_accuracy": ("rad", "", "u_axis"),
    "position_accuracy": ("rad", "", "u_angle1"),
    "perpendicularity": ("rad", "squareness", ""),
    "servo_error": ("rad", "", ""),
    "sector_accuracy": ("rad", "", ""),
    "repeatability": ("rad", "", ""),
    "tilt_wobble": ("rad", "", ""),
    "tilt_range": ("rad", "", ""),
    "azimuth_range": ("rad", "", ""),
    "height": ("m", "", ""),
    "tilt_height": ("m", "", ""),
    "plate_diameter": ("m", "", ""),
    "mass": ("kg", "", ""),
    "axial_load": ("kg", "", ""),
    "radial_load": ("kg", "", ""),
    "angular_stiffness": ("N.m/rad", "", ""),
    "radial_stiffness": ("N/m", "", ""),
    "slip_rings": ("1", "", ""),
}
#: kind -> figure -> unit
FIGURES: dict[str, dict[str, str]] = {
    **dict.fromkeys(("fibre", "laser", "vibrating"), RATE_GYRO),
    "accelerometers": ACCELEROMETERS,
    "floated": {n: unit for n, (unit, _) in FLOATED.items()},
    "turntable": {n: unit for n, (unit, _, _) in TURNTABLE.items()},
}
#: no errors: a limit of one is what it is
SETTINGS = ("range", "resolution", "bandwidth", "output_rate", "rate_max", "torque", "servo_stiffness")
SIGNED = COEFFICIENTS
#: network 2 of table_servo, which crosses over at 50 Hz: K_T (N.m/rad) of its inertia (kg.m2)
STIFFNESS, INERTIA = 2.672e5, 2.56
#: least Allan deviation over the coefficient B of flicker noise, (2 ln 2 / pi)^0.5
FLOOR = math.sqrt(2.0 * math.log(2.0) / math.pi)
#: largest Allan deviation of a Gauss-Markov process over its rms, at 1.89 correlation times
MARKOV_FLOOR = 0.6174
#: figure -> parameter of a part, of each axis where it has two
DIRECT = {
    "range": "range_max",
    "bandwidth": "bandwidth",
    "resolution": "resolution",
    "bias": "turn_on",
    "bias_temperature": "bias_T",
    "scale_error": "scale",
    "scale_temperature": "scale_T",
}


def density(sheet: Instrument) -> float | None:
    """Return N of a rate gyro or of accelerometers, the two-sided density of the white noise; None without one."""
    known = FIGURES[sheet.kind]
    if "noise_density" not in known:
        return None
    walk = sheet.si("velocity_random_walk" if "velocity_random_walk" in known else "angle_random_walk")
    noise = sheet.si("noise_density")
    return walk if walk is not None else None if noise is None else noise / math.sqrt(2.0)


def rate_gyro(sheet: Instrument, part: type) -> dict[str, Any]:
    """Return the parameters of the part, SI; sizes of errors are set positive, on both axes.

    angle random walk, or the one-sided noise density over sqrt 2: white noise.  bias instability, the least Allan
    deviation: flicker noise of that floor.  bias: rms of the turn-on bias.  nonlinearity, largest departure from the
    best line over the range: a cubic, whose least-squares line over +-range leaves 0.4 c range3 at the ends.  The
    output rate sets nothing here: in means over windows a sample held over one step or two counts once or twice, and
    819.2 Hz in steps of 1 ms would make the noise 5.6 % larger; `gyro.period` is set for a test that takes each sample
    once (instruments.output_period).
    Raises UsageError for a part that takes no data sheets.
    """
    white = getattr(part, "white_noise", "")
    if not white:
        raise UsageError(f"{sheet.title}: the part {sheet.part} takes no data sheets: it names no white_noise")
    declarations: Mapping[str, Any] = part.declarations  # type: ignore[attr-defined]
    found: dict[str, Any] = {}
    if (noise := density(sheet)) is not None:
        found |= {white: noise, **part.without_own_noise}  # type: ignore[attr-defined]
    if (floor := sheet.si("bias_instability")) is not None:
        found |= {"flicker_x": floor / FLOOR, "flicker_y": floor / FLOOR}
    for name, parameter in DIRECT.items():
        declared = declarations.get(parameter)
        if declared is not None and declared.unit == RATE_GYRO[name] and sheet.si(name) is not None:
            found[parameter] = [sheet.si(name)] * 2 if declared.shape else sheet.si(name)
    if (g := sheet.si("g_sensitivity")) is not None:
        found["g"] = [[g, 0.0, 0.0], [0.0, g, 0.0]]
    if (nonlinearity := sheet.si("nonlinearity")) is not None and (full := sheet.si("range")) is not None:
        found["cubic"] = nonlinearity / 0.4 / full**2
    if lean := sheet.si("misalignment") or sheet.si("cross_axis"):
        found["axes"] = [[1.0, lean, 0.0], [0.0, 1.0, lean]]
    return found


def accelerometers(sheet: Instrument, declarations: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a part that is three such accelerometers, SI; {} for one that takes no data sheets.

    As :func:`rate_gyro`; sizes of errors are set positive, on all axes, and the sheet is the whole of the drift.
    """
    if not {"white", "x_flicker", "range_max"} <= declarations.keys():
        return {}
    found: dict[str, Any] = {} if (noise := density(sheet)) is None else {"white": noise}
    for axis in "xyz":
        found |= {f"{axis}_flicker": (sheet.si("bias_instability") or 0.0) / FLOOR, f"{axis}_walk": 0.0}
    for name, parameter in DIRECT.items():
        declared = declarations.get(parameter)
        if declared is not None and (value := sheet.si(name)) is not None:
            found[parameter] = [value] * 3 if declared.shape else value
    if (nonlinearity := sheet.si("nonlinearity")) is not None and (full := sheet.si("range")) is not None:
        found["cubic"] = nonlinearity / 0.4 / full**2
    if lean := sheet.si("misalignment") or sheet.si("cross_axis"):
        found["axes"] = [[1.0, lean, 0.0], [0.0, 1.0, lean], [lean, 0.0, 1.0]]
    return found


def wander(sheet: Instrument) -> float:
    """Return the rms of a Gauss-Markov bias whose largest Allan deviation is the bias instability, 0 without one."""
    return (sheet.si("bias_instability") or 0.0) / MARKOV_FLOOR


def turn_on(sheet: Instrument) -> float:
    """Return the bias at switch-on: as stated, or of a limit what one believes; without both the bias instability."""
    return believed_bias(sheet) or sheet.si("bias_instability") or 0.0


def believed_bias(sheet: Instrument) -> float:
    """Return the standard uncertainty of the bias at switch-on: as stated, or of a limit; 0 without both."""
    return sheet.si("bias") or (sheet.limit("bias") or 0.0) / math.sqrt(3.0)


def unit(sheet: Instrument, declarations: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a unit of three such gyros, SI, those that it declares; see :func:`unit_forces`.

    The sheet is the whole of the errors of the gyros: what it does not state is 0.  Sizes of errors are set positive,
    on all axes.  A bias instability is a Gauss-Markov bias; a bias joins it where a unit has no steady one.
    """
    scale, lean = sheet.si("scale_error") or 0.0, sheet.si("misalignment") or sheet.si("cross_axis") or 0.0
    bias, g = sheet.si("bias") or 0.0, (sheet.si("g_sensitivity") or 0.0) * G0
    found: dict[str, Any] = {
        "gyro_bias": [bias] * 3,
        "gyro_scale": [[scale if i == j else lean for j in range(3)] for i in range(3)],
        "g_sensitivity": [[g if i == j else 0.0 for j in range(3)] for i in range(3)],
        "gyro_bias_T": [sheet.si("bias_temperature") or 0.0] * 3,
        "gyro_scale_T": [sheet.si("scale_temperature") or 0.0] * 3,
    }
    for axis in "xyz":
        found |= {f"{axis}_gyro_bias": wander(sheet), f"noise_{axis}_bias": math.hypot(bias, wander(sheet))}
        found |= dict.fromkeys((f"{axis}_gyro", f"noise_{axis}_gyro"), density(sheet) or 0.0)
    return {n: v for n, v in found.items() if n in declarations}


def unit_forces(sheet: Instrument, declarations: Mapping[str, Any]) -> dict[str, Any]:
    """Return the same of the accelerometers of a unit; their white noise stays where their sheet has none."""
    scale, lean = sheet.si("scale_error") or 0.0, sheet.si("misalignment") or sheet.si("cross_axis") or 0.0
    bias, noise = sheet.si("bias") or 0.0, density(sheet)
    found: dict[str, Any] = {
        "acc_bias": [bias] * 3,
        "acc_scale": [[scale if i == j else lean for j in range(3)] for i in range(3)],
        "acc_bias_T": [sheet.si("bias_temperature") or 0.0] * 3,
        "acc_scale_T": [sheet.si("scale_temperature") or 0.0] * 3,
    }
    for axis in "xyz":
        found |= {f"{axis}_acc_bias": wander(sheet), f"noise_{axis}_acc_bias": math.hypot(bias, wander(sheet))}
        if noise is not None:
            found |= dict.fromkeys((f"{axis}_acc", f"noise_{axis}_acc"), noise)
    return {n: v for n, v in found.items() if n in declarations}


def drifts(sheet: Instrument) -> dict[str, float]:
    """Return the options of a system that takes the drift of its gyros by size, not a part: constant, wandering, white.

    A sheet without a bias is taken to have one of the size of its bias instability, at least.
    """
    return {"gyro_drift": turn_on(sheet), "gyro_markov": wander(sheet), "gyro_white": density(sheet) or 0.0}


def floated(sheet: Instrument) -> dict[str, Any]:
    """Return the parameters of a floated gyro, SI: the sheet is the whole of its drift.

    Drift coefficients that it lacks are 0, and so is the random drift beside the one that it states, an rms that the
    part has as Gauss-Markov drift; sizes per field are set along each axis.
    """
    found: dict[str, Any] = dict.fromkeys(COEFFICIENTS, 0.0)
    if sheet.si("D_OO"):
        found["terms"] = 10
    if "random_drift" in sheet.figures:
        found |= {"white": 0.0, "flicker": 0.0, "walk": 0.0}
    for name, (_, parameter) in FLOATED.items():
        if (value := sheet.si(name)) is not None:
            found[parameter] = [value] * 3 if parameter in ("D_B", "D_dB") else value
    return found


def turntable(sheet: Instrument, declarations: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parameters of a part that is a table, SI: those that it declares, of each axis where it has two.

    A stiffness sets the inertia, too, which no sheet has: that which keeps the crossover of the loop where it is; and
    the capture ends where the fine loop is linear, within torque / stiffness.
    """
    found: dict[str, Any] = {}
    for name, (unit, parameter, _) in TURNTABLE.items():
        declared = declarations.get(parameter)
        if declared is not None and declared.unit == unit and (value := sheet.si(name)) is not None:
            found[parameter] = [value] * declared.shape[0] if declared.shape else value
    if "stiffness" in found and "J" in declarations:
        found["J"] = found["stiffness"] * INERTIA / STIFFNESS
    if "torque_max" in found and (capture := declarations.get("capture_angle")) is not None:
        found["capture_angle"] = min(capture.start, found["torque_max"] / found.get("stiffness", STIFFNESS))
    return found


def beliefs(sheet: Instrument) -> dict[str, float]:
    """Return options u_... of the limits of a turntable: even between plus and minus the limit, limit / sqrt 3."""
    found = {}
    for name, (_, _, option) in TURNTABLE.items():
        if option and (limit := sheet.limit(name)) is not None:
            found[option] = limit / math.sqrt(3.0)
    return found
