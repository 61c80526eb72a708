"""Scale factor and linearity of a torquer: the gyro holds a servo table while a constant current makes it precess."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from gyrobench import frames
from gyrobench.arrays import Array
from gyrobench.system.families.option_groups import CORRECTIONS, SITE, type_b
from gyrobench.system.families.servo_channel import CHANNEL, ChannelTest, gyro_on_table
from gyrobench.system.families.servo_test import GYRO_SERVO
from gyrobench.system.families.table_test import FACE, SDF_NOISES, TableTest, on_table, surroundings
from gyrobench.system.part_values import PartValues
from gyrobench.system.plan import Phase, Plan
from gyrobench.system.system import OnRequest, Option, Slot

from . import sources
from .measured import MEASURED

CAPTURE = "capture, no current"
STEADY = 1.0  # s after the current has changed


class TorquerScaleFactor(ChannelTest, TableTest):
    """The gyro holds a servo table on the axis its torquer precesses about; the table rate over the current is the
    scale factor, its spread over the currents the linearity.

    Of a two-degree-of-freedom gyro a rebalance loop locks the axis across the table's.

    [TEST-TORQUER; Hu 1981, eq. A3-1..A3-6]
    """

    title = "Torquer scale factor and linearity"
    spec = ("TEST-TORQUER", "SF-APP1", "LIN-TABLE", "LOOP-TABLE-SERVO")
    slots = on_table(
        table=Slot("ServoTable", "table_servo"), source=Slot("CurrentSource", "current_source"),
        gyro=Slot("SdfGyro", "floated_gyro"),
    )  # fmt: skip
    axis_parts: ClassVar[Mapping[str, str]] = {"gyro": "gyro_2dof", "lock": "rebalance_two_axis"}
    on_request: ClassVar[Mapping[str, OnRequest]] = surroundings()
    # in servo mode the table has no target: the sequencer's target is the current
    wires = f"""
        {TableTest.wires}
        {GYRO_SERVO}
        sequencer -> source: target=command mode
        source -> gyro: i
        source.i_read -> sampler.x
        gyro.saturated -> sampler.flag
    """
    options = (
        SITE
        | CORRECTIONS
        | CHANNEL
        | {
            "currents": Option("1 5 10 20 40 60 80 100", str, "magnitudes of the currents, mA"),
            "range": Option("10deg", "rad", "angle turned with each current up to 20 mA", 0.0),
            "range_large": Option("100deg", "rad", "angle turned with each larger current", 0.0),
            "k": Option("17.2deg/h/mA", "rad/s/A", "scale factor expected, for the times of the plan", 0.0),
            "slew": Option(0.1, "A/s", "rate at which the current is changed", 0.0, sets="source.slew"),
            "windows": Option(20, int, "readings of the angle over each range", 5, 500),
        }
        | type_b(
            sources, "angle1", "angle2", "time",
            axis="standard uncertainty of the right angle between table axis and pole",
            mount="standard uncertainty of the input axis against the table axis",
        )
    )  # fmt: skip
    noises = (*SDF_NOISES, "table.rumble", "source.meter")
    measured_data = MEASURED
    channels = ("table.angle", "source.i", "gyro.u", "table.motor")
    channel_period = 1.0

    def currents(self) -> list[float]:
        """Return the magnitudes, A; raises ValueError for what is no list of numbers."""
        return [float(x) * 1e-3 for x in self["currents"].replace(",", " ").split()]

    def plan(self) -> Plan:
        """Return capture without current; then each current in both senses, back over the same angles."""
        try:
            currents = self.currents()
        except ValueError:
            return Plan()
        phases = [Phase(CAPTURE, "servo", FACE, settle=STEADY, dwell=0.5, window=0.5)]
        before, n = 0.0, self["windows"]
        for size in currents:
            way = self["range"] if size < 0.0201 else self["range_large"]
            dwell = way / (self["k"] * size) if self["k"] * size > 0.0 else 1.0
            for i in (size, -size):
                ramp = abs(i - before) / self["slew"] if self["slew"] > 0.0 else 0.0
                label = f"{i * 1e3:+g} mA".replace("-", "−")
                phases.append(
                    Phase(label, "servo", FACE, i, settle=ramp + STEADY, dwell=dwell, travel=way, window=dwell / n)
                )
                before = i
        return Plan(phases, {FACE: self.face})

    def base(self) -> Array:
        return frames.equatorial_base(self["latitude"])

    def parameters(self, parts: PartValues) -> dict[str, Any]:
        return {**super().parameters(parts), **gyro_on_table(parts, self.channel)}

    def check(self) -> list[str]:
        try:
            found = self.currents()
        except ValueError:
            return [f"currents = {self['currents']}: numbers in mA are expected, such as 1 5 10 20 40 60 80 100"]
        problems = [f"currents: {i * 1e3:g} mA: give magnitudes, larger than zero" for i in found if not i > 0.0]
        if len(found) < 3:
            problems.append(f"{len(found)} currents: at least 3 are needed for a linearity")
        elif len(set(found)) < len(found):
            problems.append("the same current twice")
        problems += [f"{n} = 0: must be > 0" for n in ("range", "range_large", "k", "slew") if not self[n] > 0.0]
        return problems + super().check()

    def check_parameters(self, parameters: Mapping[str, Any]) -> list[str]:
        problems = super().check_parameters(parameters)
        problems += frames.equatorial_problems(parameters.get("table.base", self.base()), self["latitude"])
        limit = parameters.get("source.i_max")
        if limit is not None and max(self.currents()) > limit:
            problems.append(
                f"currents up to {max(self.currents()) * 1e3:g} mA: the source gives {limit * 1e3:g} mA at most"
            )
        return problems
