"""Data sheets of instruments, ``instruments/NAME.toml``, and the parameters of a part that they make.

    title = "ADIS16405"
    maker = "Analog Devices"
    kind = "vibrating"                     # fibre, laser, vibrating
    part = "gyro_mems"                     # the part that takes the figures
    source = "data sheet ADIS16400/ADIS16405"
    date = "2009"                          # of the source

    [figures.noise_density]                # the figures that FIGURES knows
    value = "0.05 deg/s/sqrt(Hz)"          # as printed, with its unit
    reading = "typical"                    # typical, one_sigma, maximum, minimum, or limit: plus or minus, of all units
    note = "rms in 1 Hz, one-sided"

What becomes of the figures is written in :func:`parameters`.  A limit of an error says nothing about one instrument and
sets nothing.  Not modelled: figures that no part has (vibration, ageing).  [GYRO-SHEET]
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from gyrobench import reading
from gyrobench.bench import Bench, UsageError, suggest_names
from gyrobench.boundary import faults_of
from gyrobench.packaging import load_part
from gyrobench.system.values import InvalidValueError, parse_number

#: figure -> unit
FIGURES: dict[str, str] = {
    "range": "rad/s",
    "resolution": "rad/s",
    "bandwidth": "Hz",
    "output_rate": "Hz",
    "noise_density": "rad/s/sqrt(Hz)",
    "angle_random_walk": "rad/sqrt(s)",
    "bias_instability": "rad/s",
    "bias": "rad/s",
    "bias_temperature": "rad/s/K",
    "scale_error": "1",
    "scale_temperature": "1/K",
    "nonlinearity": "1",
    "misalignment": "rad",
    "cross_axis": "1",
    "g_sensitivity": "rad.s/m",
}
SETTINGS = ("range", "resolution", "bandwidth", "output_rate")  # no errors: a limit of one is what it is
#: least Allan deviation over the coefficient B of flicker noise, (2 ln 2 / pi)^0.5
FLOOR = math.sqrt(2.0 * math.log(2.0) / math.pi)
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


class Figure(BaseModel):
    """A figure of a data sheet as it is printed."""

    model_config = ConfigDict(extra="forbid", strict=True)

    value: str = Field(min_length=1)
    reading: Literal["typical", "one_sigma", "maximum", "minimum", "limit"]
    note: str = ""


class Instrument(BaseModel):
    """The keys of a data sheet; see the module."""

    model_config = ConfigDict(extra="forbid", strict=True)

    title: str = Field(min_length=1)
    maker: str = Field(min_length=1)
    kind: Literal["fibre", "laser", "vibrating"]
    part: str = Field(min_length=1)
    source: str = Field(min_length=1)
    date: str = Field(min_length=4)
    figures: dict[str, Figure] = Field(min_length=1)

    def si(self, name: str) -> float | None:
        """Return a figure in SI; None where the sheet has none, or only a limit of an error."""
        figure = self.figures.get(name)
        if figure is None or (figure.reading == "limit" and name not in SETTINGS):
            return None
        return float(parse_number(name, figure.value, FIGURES[name]))

    @property
    def density(self) -> float | None:
        """Return N, the two-sided density of the white noise: the angle random walk, or the density over sqrt 2."""
        walk, density = self.si("angle_random_walk"), self.si("noise_density")
        return walk if walk is not None else None if density is None else density / math.sqrt(2.0)


def find_instrument(name: str) -> Instrument:
    """Return a data sheet of the bench or of a file.  Raises UsageError, naming all that is wrong."""
    bench = Bench.find()
    known = bench.instruments()
    file = Path(name) if name.endswith(".toml") else known.get(name)
    if file is None or not file.is_file():
        raise UsageError(f"instrument {name}: no such data sheet; {suggest_names(name, known)}")
    return read_instrument(file)


def read_instrument(file: Path) -> Instrument:
    """Return the data sheet of a TOML file.  Raises UsageError naming all that is wrong with it."""
    data = reading.toml(reading.read_text(file, UsageError), file, UsageError)
    try:
        sheet = Instrument.model_validate(data)
    except ValidationError as error:
        found = faults_of(error, lambda place: Figure if place[0] == "figures" and len(place) > 2 else Instrument)
        raise UsageError("\n".join([f"{file}: not a data sheet:", *(f"  - {p}" for p in found)])) from None
    problems = [f"figures.{n}: unknown; {suggest_names(n, FIGURES)}" for n in sheet.figures if n not in FIGURES]
    for name, figure in sheet.figures.items():
        if name in FIGURES:
            try:
                value = float(parse_number(f"figures.{name}", figure.value, FIGURES[name]))
                if not value > 0.0:
                    problems.append(f"figures.{name} = {figure.value}: a size is expected, above 0")
            except (InvalidValueError, TypeError, ValueError) as error:
                problems.append(str(error))
    if problems:
        raise UsageError("\n".join([f"{file}: not a data sheet:", *(f"  - {p}" for p in problems)]))
    return sheet


def parameters(sheet: Instrument) -> dict[str, Any]:
    """Return the parameters of the part, SI: those that it has; sizes of errors are set positive, on both axes.

    angle random walk, or the one-sided noise density over sqrt 2: white noise.  bias instability, the least Allan
    deviation: flicker noise of that floor.  bias: rms of the turn-on bias.  nonlinearity, largest departure from the
    best line over the range: a cubic, whose least-squares line over +-range leaves 0.4 c range3 at the ends.  The
    output rate sets nothing: a sample is taken every communication step (held over several, `gyro.period`, samples are
    used twice here and there).
    Raises UsageError for a part that takes no data sheets.
    """
    part = load_part(sheet.part, Bench.find().folder)
    white = getattr(part, "white_noise", "")
    if not white:
        raise UsageError(f"{sheet.title}: the part {sheet.part} takes no data sheets: it names no white_noise")
    found: dict[str, Any] = {}
    if (density := sheet.density) is not None:
        found |= {white: density, **part.without_own_noise}  # type: ignore[attr-defined]
    if (floor := sheet.si("bias_instability")) is not None:
        found |= {"flicker_x": floor / FLOOR, "flicker_y": floor / FLOOR}
    for name, parameter in DIRECT.items():
        declared = part.declarations.get(parameter)
        if declared is not None and declared.unit == FIGURES[name] and sheet.si(name) is not None:
            found[parameter] = [sheet.si(name)] * 2 if declared.shape else sheet.si(name)
    if (g := sheet.si("g_sensitivity")) is not None:
        found["g"] = [[g, 0.0, 0.0], [0.0, g, 0.0]]
    if (nonlinearity := sheet.si("nonlinearity")) is not None and (full := sheet.si("range")) is not None:
        found["cubic"] = nonlinearity / 0.4 / full**2
    if lean := sheet.si("misalignment") or sheet.si("cross_axis"):
        found["axes"] = [[1.0, lean, 0.0], [0.0, 1.0, lean]]
    return {n: v for n, v in found.items() if n in part.declarations}


def settings(sheet: Instrument, slot: str = "gyro") -> Mapping[str, Any]:
    """Return the parameters as values of a system: "gyro.white" -> value."""
    return {f"{slot}.{n}": v for n, v in parameters(sheet).items()}


def with_instrument(name: str, parts: dict[str, str]) -> tuple[str, dict[str, Any]]:
    """Put the part of a data sheet into the slot gyro; return what a report calls it, and the values of its parameters.

    Raises UsageError.
    """
    sheet = find_instrument(name)
    if parts.setdefault("gyro", sheet.part) != sheet.part:
        raise UsageError(f"the data sheet {name} puts {sheet.part} into the slot gyro: name no part for it")
    return f"{sheet.maker} {sheet.title} ({sheet.source}, {sheet.date}), simulated", dict(settings(sheet))
