"""Simulated records as a laboratory would write them: the CSV files of the measured-data templates, SI units.

record = simulated("tumble_single_axis", rng)      # random instrument, latitude and noise, see coverage.py
sheet = Sheet.of(record)                           # comments and columns: here mistakes are made
result = sheet.reduce(limits)
"""

from __future__ import annotations

import math
import tempfile
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from coverage_cases import CASES, Noise

from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import noise
from gyrobench.reduction.setup.run_metadata import Location
from gyrobench.result import Result, Specification
from gyrobench.system.system import System, load_system

Array = np.ndarray[Any, Any]
UNITS = {"t": "s", "angle": "rad", "outer": "rad", "inner": "rad", "mean": "A", "current": "A", "rate": "rad/s",
         "range": "rad", "phase": "", "position": "", "cycle": "", "u": "V"}  # fmt: skip
VOLTS = ("pickoff_scale_factor",)
#: Earth rate of these cases is 500 times that of the Earth (coverage.py); no file states it
EARTH = "site.earth_rate"


@dataclass
class Sheet:
    """comments: as the lines # key = value.  columns: SI."""

    system: str
    comments: dict[str, str]
    columns: dict[str, Array]
    parameters: dict[str, float]

    @classmethod
    def of(cls, record: Record) -> Sheet:
        run = record.run
        w = {n: np.asarray(v, dtype=float) for n, v in record.windows.items()}
        p, o = run.parameters, run.options
        comments = {"latitude": f"{o['latitude']!r} rad", "type_b": "none", "arrangement": "checked"}
        servo = run.system.startswith("servo")
        rows = [row for row in run.plan if not servo or row.mode == "servo"]
        here = np.isin(w["phase"], [row.phase for row in rows])
        w = {n: v[here] for n, v in w.items()}
        names = ["phase", "t_start", "t_end", "angle_start", "angle_end"]
        if run.system.startswith(("tumble_single", "tumble_two_ch", "accelerometer")):
            comments |= {f"phase {row.phase}": row.face for row in rows}
            names += [n for n in ("mean", "mean_x", "mean_y") if n in w]
        if servo:
            comments |= {f"phase {row.phase}": row.label for row in rows}
        for a in ("k", "k_x", "k_y"):
            if f"gyro.{a}" in p and a in o:
                comments[a] = f"{p[f'gyro.{a}']!r} rad/s/A"
        for a in ("model", "m", "n", "attitude", "route", "terms"):
            if a in o:
                comments[a] = str(o[a])
        match run.system:
            case "tumble_two_axis":
                names = ["phase", "t_start", "t_end", "outer_start", "outer_end", "inner_start", "inner_end", "mean"]
            case "servo_two_axis":
                names = ["phase", "t_start", "t_end", "outer_start", "outer_end", "inner_start", "inner_end"]
            case "eight_position":
                face = {row.phase: int(row.face.split()[-1]) for row in rows}
                w["position"] = np.array([face[int(v)] for v in w["phase"]], dtype=float)
                w["cycle"] = 1.0 + (w["phase"] - w["phase"].min()) // 8
                names = ["cycle", "position", "t_start", "t_end", "mean_x", "mean_y"]
            case "fixed_position":
                names = ["t_start", "t_end", "mean"]
            case "open_loop_drift":
                w |= {"angle": w["angle_start"], "u": w["mean"]}
                names = ["t_start", "t_end", "angle", "u"]
                comments["float_gain"] = repr(p["gyro.H"] / p["gyro.C"])
            case "accelerometer_multipoint":
                comments |= {
                    "scale": f"{p['accelerometer.scale']!r} m/s2/A",
                    "gravity": f"{Location.of(run).gravity!r} m/s2",
                }
            case "pickoff_scale_factor":
                names += ["mean"]
                comments = {
                    "type_b": "none",
                    "arrangement": "checked",
                    "drift": "2deg/h",
                    "gain": repr(p["gyro.H"] / p["gyro.C"]),
                }
            case "torquer_scale_factor":
                w = import_module(".marks", type(load_system(run.system)).__module__).rows(record.windows, run.plan)
                names, comments = list(w), {"type_b": "none", "arrangement": "checked"}
        parameters = {EARTH: float(p[EARTH])} if servo and EARTH in p else {}
        return cls(run.system, comments, {n: np.array(w[n], dtype=float) for n in names}, parameters)

    def text(self) -> str:
        volts = self.system in VOLTS
        units = {n: "V" if volts and n == "mean" else UNITS[n.split("_")[0]] for n in self.columns}
        header = ",".join(f"{n} [{u}]" if u else n for n, u in units.items())
        cells = zip(*(self.columns[n].tolist() for n in self.columns), strict=True)
        rows = [",".join(repr(v) for v in row) for row in cells]
        return "\n".join([*(f"# {k} = {v}" for k, v in self.comments.items()), header, *rows, ""])

    def reduce(self, specification: Specification | None) -> Result:
        """Return the result as of ``gyrobench reduce``; raises what that refuses."""
        system = load_system(self.system)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "record.csv"
            file.write_text(self.text(), encoding="utf-8")
            record = system.read_measured(file, {})
        record.run.parameters = dict(self.parameters)
        return system.reduce(record, specification)


@dataclass
class Laboratory:
    """Records of one case, each of another instrument."""

    name: str
    seed: int

    def __post_init__(self) -> None:
        self.case = CASES[self.name]
        self.rng = np.random.default_rng(self.seed)
        self.system: System = load_system(self.case.system)
        self.session = Session(self.case.system)
        probe = self.session.run(self.case.drawn(self.rng), seed=1)
        t0, t1 = (np.asarray(probe.windows[n], dtype=float) for n in ("t_start", "t_end"))
        self.times, self.window = (t0, t1), float(np.median(t1 - t0))
        self.readings = self.case.system.startswith(("servo", "open", "pickoff", "torquer"))

    def record(self, values: dict[str, Any] | None = None) -> Record:
        noisy = Noise(*noise.sample_instrument(self.rng, *self.times, self.readings), self.window)
        drawn = {**self.case.drawn(self.rng), **(values or {})}
        return self.session.run({**drawn, **self.case.noise(noisy, drawn)}, seed=int(self.rng.integers(2**31)))

    def sheet(self, values: dict[str, Any] | None = None) -> Sheet:
        return Sheet.of(self.record(values))


def wide(result: Result) -> Specification:
    """Limits that every coefficient of a result keeps; none for the drift of the pickoff test, which never judges."""
    judged = (c.name for c in result.coefficients if math.isfinite(c.estimate))
    return {name: (-1e12, 1e12) for name in judged if (result.system, name) != ("pickoff_scale_factor", "drift")}
