"""Drift record of a gyro at rest, long enough for its noise model."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench.attitudes import attitude_problems
from gyrobench.system.families.option_groups import ATTITUDE, SITE, TORQUER, type_b
from gyrobench.system.families.rate_reading import CURRENT, RATE, RateReading
from gyrobench.system.families.table_test import TableTest, on_table
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Plan
from gyrobench.system.system import OnRequest, Option, Slot
from gyrobench.units import ARCSEC, DPH, G0

from .measured import ATTITUDE as FACE
from .measured import MEASURED

#: of the gyro unless set: B 0.005 deg/h, K 0.03 deg/h/sqrt(h), Q 0.02 arcsec; N is that of the part
FLICKER, WALK, ANGLE = 0.005 * DPH, 0.03 * DPH / 60.0, 0.02 * ARCSEC
#: the same of accelerometers: B 20 ug, K 20 ug/sqrt(h)
BIAS_FLICKER, BIAS_WALK = 20e-6 * G0, 20e-6 * G0 / 60.0
ACCELEROMETERS, FORCE = "accelerometers", "force"
WIRES = """
    table -> accelerometers: f
    accelerometers.f_read[1] -> sampler.x
"""


class DriftRecord(RateReading):
    """A gyro at rest in torque rebalance, or a rate gyro; the mean current or rate of each window becomes an evenly
    sampled drift rate, and that the model of the random drift: N, B, K, R, Q.

    [DRIFT-STATS-RUNS, DRIFT-AR-BURG, DAQ-DRIFT; Xia 2008, ch. 3; IEEE 952]
    """

    title = "Drift record"
    spec = ("DRIFT-RANDOM-CLASSES", "DAQ-DRIFT", "RED-RATE", "GYRO-DYN-1", "LOOP-REBALANCE")
    slots = RateReading.with_parts(table="table_rate", gyro="floated_gyro", rebalance="rebalance_analog")
    rate_gyro = "gyro_rate"
    readings = (CURRENT, RATE, FORCE)
    on_request: ClassVar[Mapping[str, OnRequest]] = {
        **RateReading.on_request,
        ACCELEROMETERS: OnRequest({ACCELEROMETERS: Slot("Accelerometers", "accelerometer_mems")}, WIRES),
    }
    options = (
        SITE
        | ATTITUDE
        | {
            "reading": Option(
                CURRENT, str, "current (torque rebalance), rate (of a rate gyro, axis x), force (of accelerometers, x)"
            ),
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

    def request(self, slot: str) -> None:
        """Put accelerometers in the place of gyro and loop, where they are asked for."""
        if slot != ACCELEROMETERS:
            super().request(slot)
        elif slot not in self.slots:
            self.set("reading", FORCE)

    def arrange(self) -> None:
        super().arrange()
        if self["reading"] == FORCE:
            accelerometers = self.on_request[ACCELEROMETERS].slots[ACCELEROMETERS]
            vars(self).update(
                slots=on_table(table=self.slots["table"], accelerometers=accelerometers),
                wires=TableTest.wires + WIRES,
                channels=("accelerometers.f_read[1]",),
                noises=tuple(f"accelerometers.{n}" for n in ("turn_on", "white", "white_x", "x_flicker", "x_walk")),
                read_by={},
                assumed=("table.base", "accelerometers.mount"),
            )

    def plan(self) -> Plan:
        return self.in_attitude(FACE, self["duration"], self["window"])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        """The random drift of the gyro has the five terms, of sizes that a day shows; other noise is off unless set."""
        if self["reading"] == FORCE:
            drift = {"x_flicker": BIAS_FLICKER, "x_walk": BIAS_WALK}
            return {**super().parameters(parts), **{f"accelerometers.{n}?": v for n, v in drift.items()}}
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
        alone = [] if self["reading"] != FORCE or "surroundings" not in self.slots else [
            "surroundings: of a gyro; with reading = force there is none"
        ]  # fmt: skip
        problems = [] if samples >= 512.0 else [
            f"duration = {self['duration']:g} s: {samples:.0f} samples of {self['window']:g} s; at least 512 are needed"
        ]  # fmt: skip
        if self["counts"] not in ("cumulative", "increments"):
            problems.append(f"counts = {self['counts']}: must be 'cumulative' or 'increments'")
        return problems + alone
