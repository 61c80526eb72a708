"""Drift record of a gyro at rest, long enough for its noise model."""

from __future__ import annotations

from typing import Any

from gyrobench.attitudes import attitude_problems, parse
from gyrobench.system.families.option_groups import ATTITUDE, SITE, TORQUER, type_b
from gyrobench.system.families.rate_reading import RateReading
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import Option
from gyrobench.units import ARCSEC, DPH

from .measured import ATTITUDE as FACE
from .measured import MEASURED

#: of the gyro unless set: B 0.005 deg/h, K 0.03 deg/h/sqrt(h), Q 0.02 arcsec; N is that of the part
FLICKER, WALK, ANGLE = 0.005 * DPH, 0.03 * DPH / 60.0, 0.02 * ARCSEC


class DriftRecord(RateReading):
    """A gyro at rest in torque rebalance, or a rate gyro; the mean current or rate of each window becomes an evenly
    sampled drift rate, and that the model of the random drift: N, B, K, R, Q.

    [DRIFT-STATS-RUNS, DRIFT-AR-BURG, DAQ-DRIFT; Xia 2008, ch. 3; IEEE 952]
    """

    title = "Drift record"
    spec = ("DRIFT-RANDOM-CLASSES", "DAQ-DRIFT", "RED-RATE", "GYRO-DYN-1", "LOOP-REBALANCE")
    reduction = "reduction"
    slots = RateReading.with_parts(table="table_rate", gyro="floated_gyro", rebalance="rebalance_analog")
    rate_gyro = "gyro_rate"
    options = (
        SITE
        | ATTITUDE
        | RateReading.reads
        | {
            "duration": Option("8h", "s", "length of the record", 60.0),
            "window": Option(1.0, "s", "averaging time of a sample", 0.01),
            "settle": Option(10.0, "s", "wait before the record", 1.0),
            "channel": Option("", str, "measured data: columns to reduce; empty: every rate, angle and force"),
            "scale": Option("", str, "measured data: rate or angle of one unit of a column, as 0.5arcsec"),
            "sampling": Option(0.0, "Hz", "measured data without a column time: sampling rate", 0.0),
            "counts": Option("cumulative", str, "measured angles and counts: cumulative, or increments"),
            "regressors": Option("", str, "measured data: columns taken out by regression, beside temperatures"),
            "angle": Option("", str, "measured data: column of the table angle, for harmonics of the rate over it"),
            "harmonics": Option(2, int, "highest harmonic over the angle", 1, 20),
            "remove_lines": Option(True, bool, "lines of the spectrum are taken out before the noise model"),
            "bandwidth": Option(0.0, "Hz", "bandwidth of the signal before it was sampled; 0: not known", 0.0),
        }
        | TORQUER
        | type_b("scale_factor")
    )
    measured_data = MEASURED

    def plan(self) -> Plan:
        """One phase; the mount is the attitude itself, as the table stands level at angle 0."""
        try:
            face = parse(self["attitude"], self["latitude"])
        except ValueError:
            return Plan()  # check() says why
        phase = Phase(
            label=FACE, mode="index", face=FACE, target=0.0, settle=self["settle"], dwell=self["duration"],
            window=self["window"],
        )  # fmt: skip
        return Plan([phase], {FACE: face})

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        """The random drift of the gyro has the five terms, of sizes that a day shows; other noise is off unless set."""
        noise = {"markov": 0.0, "pickoff": 0.0, "flicker": FLICKER, "walk": WALK, "quantization": ANGLE}
        return {
            **super().parameters(parts),
            **{f"gyro.{n}?": v for n, v in noise.items()},
            "gyro.quantization_tau?": 0.2,
        }

    def check(self) -> list[str]:
        return attitude_problems(self["attitude"], self["latitude"]) + self._options() + super().check()

    def _options(self) -> list[str]:
        samples = self["duration"] / self["window"]
        problems = [] if samples >= 512.0 else [
            f"duration = {self['duration']:g} s: {samples:.0f} samples of {self['window']:g} s; at least 512 are needed"
        ]  # fmt: skip
        if self["counts"] not in ("cumulative", "increments"):
            problems.append(f"counts = {self['counts']}: must be 'cumulative' or 'increments'")
        return problems
