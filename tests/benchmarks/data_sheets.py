"""Figures of all data sheets of rate gyros against what the tests find of their parts: docs/data_sheets.md.

    python tests/benchmarks/data_sheets.py [--write] [NAME ...]

Each sheet becomes a part; `drift_record` (an hour, 0.1 s), `rate_table_test`, `gyro_bandwidth` and
`vibration_rectification` measure it, `imu_positions` with a chamber a unit of three of it; of its accelerometers
`drift_record` and the unit; noise off where the figure
is none of noise, so that a difference is one of the way from the sheet to the part and of the test.  --write: the table
of docs/data_sheets.md anew; some minutes for all.
"""

from __future__ import annotations

import logging
import math
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from asked import asked

from gyrobench.bench import Bench, standard_folder
from gyrobench.engine.session import Session
from gyrobench.frames import G0
from gyrobench.packaging import load_part
from gyrobench.system.families.rate_reading import RATE_NOISES
from gyrobench.system.system import load_system
from gyrobench.workflow.instruments import (
    FORCES,
    Instrument,
    find_instrument,
    output_period,
    parameters,
    settings,
    with_instruments,
)
from gyrobench.workflow.sheet_values import FIGURES, FLOOR, SETTINGS

PAGE = standard_folder() / "docs" / "data_sheets.md"
DEG = math.pi / 180.0
ARCSEC = DPH = DEG / 3600.0
UG = 1e-6 * G0
NEAR = 0.05
SECONDS = {"s": 1.0, "ms": 1e-3, "µs": 1e-6}
KINDS = ("fibre", "laser", "vibrating")
ROOM = 0.8  # of the range, up to which the table turns
NOT_TESTED = {
    "output_rate": "no test takes accelerometers' samples once each: a sample each communication step",
    "range": "the part clips there; readings beyond it are refused",
    "resolution": "steps of the word are averaged out by the noise",
}
NOT_OF_FORCES = {
    "bandwidth": "no test shakes accelerometers; sculling_test takes it as its option",
    "nonlinearity": "no test goes beyond 1 g, a small part of the range",
}


@dataclass(frozen=True)
class Row:
    """A figure: as printed, the test, found over expected, or why there is none."""

    sheet: str
    figure: str
    printed: str
    test: str
    ratio: float | None = None
    why: str = ""

    @property
    def near(self) -> bool:
        return self.ratio is not None and abs(self.ratio - 1.0) <= NEAR

    def line(self) -> str:
        found = "" if self.ratio is None else f"{self.ratio:.3f}"
        return f"| {self.sheet} | {self.figure} | {self.printed} | {self.test} | {found} | {self.why} |"


def slot_of(sheet: Instrument) -> str:
    return FORCES if sheet.kind == FORCES else "gyro"


class Tests:
    """Sessions of the tests by part, kept open."""

    def __init__(self) -> None:
        self.open: dict[tuple[str, str], Session] = {}
        self.units: dict[str, dict[str, Any]] = {}

    def result(self, test: str, sheet: Instrument, options: dict[str, Any], more: dict[str, Any], quiet: bool) -> Any:
        """Return what a test finds; quiet: without noise."""
        key = (test, sheet.part)
        if key not in self.open:
            self.open[key] = Session(test, {slot_of(sheet): sheet.part})
        declared = load_part(sheet.part).declarations
        off = {n: 0.0 for n in RATE_NOISES if quiet and n.removeprefix("gyro.") in declared}
        record = self.open[key].run({**options, **settings(sheet, slot_of(sheet)), **off, **more}, seed=3)
        reading = {"reading": "force"} if sheet.kind == FORCES else {}
        return load_system(test).with_values({**options, **reading}).reduce(record)

    def unit(self, name: str) -> dict[str, Any]:
        """Return the coefficients of a unit of a sheet at positions over temperature, without noise; once."""
        if name not in self.units:
            test = load_system("imu_positions")
            test.request("chamber")
            _, values = with_instruments(name, {}, test)
            key = ("imu_positions", "")
            if key not in self.open:
                self.open[key] = Session("imu_positions", {"chamber": "thermal_chamber"})
            options = {"nuisances": "none"}
            record = self.open[key].run({**options, **values, **dict.fromkeys(test.noises, 0.0)}, seed=3)
            self.units[name] = coefficients(test.with_values(options).reduce(record))
        return self.units[name]


def coefficients(result: Any) -> dict[str, Any]:
    return {c.name: c for c in result.coefficients}


Test = Callable[[Tests, str, Instrument], Iterator[Row]]


def noise(tests: Tests, name: str, sheet: Instrument) -> Iterator[Row]:
    """Yield random walk and bias instability, of an hour."""
    walk_name, unit_N, unit_B = ("angle_random_walk", DEG / 60.0, DPH)
    if sheet.kind == FORCES:
        walk_name, unit_N, unit_B = ("velocity_random_walk", 1.0 / 60.0, UG)
    asked = [n for n in (walk_name, "noise_density", "bias_instability") if sheet.si(n) is not None]
    if not asked:
        return
    if sheet.density is None:
        for figure in asked:
            yield Row(name, figure, sheet.figures[figure].value, "", None, "the sheet states no white noise beside it")
        return
    found = coefficients(
        tests.result("drift_record", sheet, {"duration": 3600.0, "window": 0.1, "settle": 1.0}, {}, False)
    )
    for figure in asked:
        value = sheet.si(figure)
        assert value is not None
        if figure == "bias_instability":
            c, expected = found["B"], value / FLOOR / unit_B
        else:
            walk = value / (math.sqrt(2.0) if figure == "noise_density" else 1.0)
            c, expected = found["N"], walk / unit_N
        low, high = c.interval
        inside = low <= expected <= high
        ratio = None if c.no_value else c.estimate / expected
        why = ""
        if ratio is None:
            why = f"an hour does not tell it from the white noise: 95 % {low / expected:.2f} to {high / expected:.2f}"
        elif abs(ratio - 1.0) > NEAR:
            spread = f"95 % {low / expected:.2f} to {high / expected:.2f} of it in an hour"
            why = spread if inside else f"{spread}: does not contain it"
        if figure == "noise_density" and walk_name in asked:
            why = "the random walk of the same sheet goes before it"
        yield Row(name, figure, sheet.figures[figure].value, "drift_record", ratio, why)


def rates(tests: Tests, name: str, sheet: Instrument) -> Iterator[Row]:
    """Yield scale factor error, bias and nonlinearity, without noise, up to 0.8 of the range."""
    asked = [n for n in ("scale_error", "nonlinearity", "bias") if sheet.si(n) is not None]
    set_by = parameters(sheet)
    if not asked:
        return
    limit = sheet.si("range") or 100.0 * DEG
    full = min(ROOM * limit, 500.0 * DEG)
    options = {"full_scale": full, "steps": 10, "cycles": 1, "dwell": 0.5, "settle": 0.2, "nuisances": "none"}
    more: dict[str, Any] = {"gyro.resolution": 0.0} if "resolution" in load_part(sheet.part).declarations else {}
    if (bias := sheet.si("bias")) is not None:
        more |= {"gyro.bias": [bias, bias]}
        if "g" in set_by:  # the axis points up
            more["gyro.g"] = [[0.0] * 3] * 2
    if "axes" in set_by:
        more["gyro.axes"] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    found = coefficients(tests.result("rate_table_test", sheet, options, more, True))
    for figure in asked:
        value, printed = sheet.si(figure), sheet.figures[figure].value
        assert value is not None
        if figure == "bias":
            yield Row(name, figure, printed, "rate_table_test", found["b"].estimate * DPH / value,
                      "rms of the turn-on bias, here as a bias of that size")  # fmt: skip
        elif figure == "scale_error":
            if "scale" not in set_by:
                yield Row(name, figure, printed, "", None, f"{sheet.part} has no scale factor error")
            else:
                yield Row(name, figure, printed, "rate_table_test", found["e"].estimate * 1e-6 / value)
        elif "cubic" not in set_by:
            why = "no range printed" if sheet.si("range") is None else f"{sheet.part} has no such nonlinearity"
            yield Row(name, figure, printed, "", None, f"sets nothing: {why}")
        else:  # 0.4 c R^2, the departure from the best line over the whole range
            c = found["c"].estimate * 1e-6 * (limit / full) ** 2
            yield Row(name, figure, printed, "rate_table_test", 0.4 * c / value)


def bandwidth(tests: Tests, name: str, sheet: Instrument) -> Iterator[Row]:
    value = sheet.si("bandwidth")
    if value is None:
        return
    if "bandwidth" not in parameters(sheet):
        yield Row(name, "bandwidth", sheet.figures["bandwidth"].value, "", None, f"{sheet.part} has no filter")
        return
    highest = min(2.0 * value, 490.0)
    options = {"lowest": max(value / 20.0, 1.0), "highest": highest, "points": 14, "dwell": 0.2, "settle": 0.1}
    more = {"gyro.resolution": 0.0}
    c = coefficients(tests.result("gyro_bandwidth", sheet, options, more, True))["f_3dB"]
    printed = sheet.figures["bandwidth"].value
    if c.no_value:
        yield Row(name, "bandwidth", printed, "gyro_bandwidth", None, f"above {highest:g} Hz, the highest of the test")
    else:
        yield Row(name, "bandwidth", printed, "gyro_bandwidth", c.estimate / value)


def output_rate(tests: Tests, name: str, sheet: Instrument) -> Iterator[Row]:
    """Yield the output rate by the delay: a sample that is held is late by half of a period, on average."""
    value, test = sheet.si("output_rate"), load_system("gyro_bandwidth")
    if value is None or sheet.kind == FORCES:
        return
    printed, period = sheet.figures["output_rate"].value, output_period(sheet, test.step)
    if not period:
        why = f"{sheet.part} gives a sample each communication step"
        yield Row(name, "output_rate", printed, "", None, why)
        return
    options = {"lowest": 5.0, "highest": min(0.4 * value, 400.0), "points": 14, "dwell": 0.2, "settle": 0.1}
    more = {"gyro.resolution": 0.0}
    held, every = (
        coefficients(tests.result("gyro_bandwidth", sheet, options, more | p, True))["delay"] for p in (period, {})
    )
    found = 0.5 / ((held.estimate - every.estimate) * SECONDS[held.unit])
    yield Row(name, "output_rate", printed, "gyro_bandwidth", found / value)


def sensitivity(tests: Tests, name: str, sheet: Instrument) -> Iterator[Row]:
    value = sheet.si("g_sensitivity")
    if value is None:
        return
    options = {"levels": "0 0.5 1", "readings": 2, "cycles": 1, "window": 1.0, "settle": 1.0, "nuisances": "none"}
    more = {"gyro.resolution": 0.0}
    c = coefficients(tests.result("vibration_rectification", sheet, options, more, True))["G"]
    printed = sheet.figures["g_sensitivity"].value
    yield Row(name, "g_sensitivity", printed, "vibration_rectification", c.estimate * DPH / G0 / value)


#: figure -> coefficient of a unit of three, SI of its unit
OF_UNIT = {"misalignment": ("Sg_xy", ARCSEC), "cross_axis": ("Sg_xy", ARCSEC),
           "bias_temperature": ("bgT_x", DPH), "scale_temperature": ("SgT_x", 1e-6)}  # fmt: skip
OF_FORCES = {"misalignment": ("Sa_xy", ARCSEC), "cross_axis": ("Sa_xy", ARCSEC), "bias": ("ba_x", UG),
             "scale_error": ("Sa_xx", 1e-6), "bias_temperature": ("baT_x", UG),
             "scale_temperature": ("SaT_x", 1e-6)}  # fmt: skip


def unit(tests: Tests, name: str, sheet: Instrument) -> Iterator[Row]:
    """Yield what a unit of three such instruments on a table with a chamber shows."""
    there = {n: of for n, of in (OF_FORCES if sheet.kind == FORCES else OF_UNIT).items() if sheet.si(n) is not None}
    if not there:
        return
    found = tests.unit(name)
    for figure, (c, size) in there.items():
        ratio = found[c].estimate * size / (sheet.si(figure) or math.nan)
        yield Row(name, figure, sheet.figures[figure].value, "imu_positions", ratio)


def rows(tests: Tests, name: str) -> list[Row]:
    """Return a row for each figure of a sheet, in the order of FIGURES."""
    sheet = find_instrument(name)
    forces = sheet.of_accelerometers
    own = _rows(tests, name, sheet, (noise, rates, bandwidth, output_rate, sensitivity, unit), NOT_TESTED)
    if forces is None:
        return own
    forces = forces.model_copy(update={"part": "accelerometer_mems"})
    more = _rows(tests, name, forces, (noise, unit), NOT_TESTED | NOT_OF_FORCES)
    return own + [replace(r, figure=f"accelerometers: {r.figure}") for r in more]


def _rows(tests: Tests, name: str, sheet: Instrument, used: Sequence[Test], untested: dict[str, str]) -> list[Row]:
    found = {r.figure: r for test in used for r in test(tests, name, sheet)}
    for figure, printed in sheet.figures.items():
        if figure in found:
            continue
        limit = printed.reading == "limit" and figure not in SETTINGS
        why = "a limit says nothing of one unit" if limit else untested.get(figure, "no test")
        found[figure] = Row(name, figure, printed.value, "", None, why)
    return [found[n] for n in FIGURES[sheet.kind] if n in found]


def main() -> int:
    given = asked(__doc__, "names", write=False)
    logging.getLogger("gyrobench").setLevel(logging.ERROR)
    tests, every = Tests(), []
    listed = sorted(Bench(standard_folder()).instruments())
    for name in given.names or [n for n in listed if find_instrument(n).kind in KINDS]:
        every += rows(tests, name)
        print("\n".join(r.line() for r in every if r.sheet == name), flush=True)
    compared = [r for r in every if r.ratio is not None]
    away = [r for r in compared if not r.near]
    said = f"{len(every)} figures of {len({r.sheet for r in every})} sheets, {len(compared)} compared, "
    said += f"{len(compared) - len(away)} within 5 %"
    print(said)
    if given.write:
        table = ["| sheet | figure | printed | test | found/printed | reason, note |", "|---|---|---|---|---|---|"]
        body = "\n".join([said + ".", "", *table, *(r.line() for r in every)])
        text = PAGE.read_text(encoding="utf-8")
        text = re.sub(r"(<!-- table -->).*?(<!-- /table -->)", lambda m: f"{m[1]}\n{body}\n{m[2]}", text, flags=re.S)
        Path(PAGE).write_text(text, encoding="utf-8")
    return int(any(not r.why for r in away))


if __name__ == "__main__":
    sys.exit(main())
