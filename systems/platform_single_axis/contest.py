"""Plan that compares estimators in the loop: test sines, bending mode, rides in which the reading is disturbed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from gyrobench.system.connectors import Socket, inp, out
from gyrobench.system.loop_plan import LoopPhase, sweep

CHANNEL = Socket(
    "ReadingChannel",
    "passes a reading on, disturbed",
    (
        inp("z", "", "the reading"),
        inp("phase", "1", "number of the running phase, from 1", whole=True),
        out("y", "", "the reading as it arrives"),
        out("valid", "1", "0: this reading is missing", whole=True),
    ),
)
BRACKET = Socket(
    "GyroBracket",
    "elastic mount of a gyro",
    (
        inp("omega", "rad/s", "inertial rate of the platform, platform axes", 3),
        out("omega_gyro", "rad/s", "inertial rate of the gyro's mount, platform axes", 3),
    ),
)
REFERENCE = Socket(
    "AngleReference",
    "reads the angle of a platform now and then",
    (
        inp("theta", "rad", "angle of the platform"),
        inp("phase", "1", "number of the running phase, from 1", whole=True),
        out("angle", "rad", "last reading, from the angle with which its phase began"),
        out("new", "1", "1 in the step in which the angle is read", whole=True),
        out("off", "rad", "the same without noise, in every step"),
    ),
)
TEST = 0.02  # V, of the sines: a filter that adapts must not take them for noise
MODE = 120.0  # Hz, bending mode of the gyro's bracket
LINE, LINE_SIZE = 87.0, 0.01  # Hz, A: a line that the gyro reads and the platform does not follow
LOUDER = 3.0  # times the noise of the reading that the estimators are set for
GAP_PERIOD, GAP = 0.73, 0.030  # s: not a multiple of the ride's period, so that gaps come at all its phases
WILD_PERIOD, WILD = 0.37, 0.2  # s, A
ANGLE_PERIOD, ANGLE_NOISE = 0.73, 2.0 * math.pi / 648000.0  # s, rad: an angle reference as slow as the gaps are
TAKEN_BACK = 1.0  # s, in which an aided estimator takes the angle back: 60 times slower than the loop
BENDING = "bending"
RIDES = {
    "line": "ride, line", "noise": "ride, more noise", "gaps": "ride, gaps", "wild": "ride, wild readings",
    "aided": "ride, aided",
}  # fmt: skip


@dataclass(frozen=True)
class Contest:
    """crossover, ride: Hz.  base: rad.  dwell: s of each ride.  noise: density of the reading, A/sqrt(Hz)."""

    crossover: float
    base: float
    ride: float
    dwell: float
    noise: float

    def phases(self) -> list[LoopPhase]:
        """Return sines of the loop about the crossover and the bending mode, the calm ride, the disturbed rides."""
        tones = [self.crossover * x for x in (0.4, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0, 3.0)]
        modes = [MODE * x for x in (0.92, 0.96, 1.0, 1.04, 1.08)]
        rides = ["ride", *RIDES.values()]
        return [
            *sweep("loop", "test", tones, TEST, periods=40, dwell=16.0),
            *sweep(BENDING, "test", modes, TEST, settle=0.5, dwell=10.0),
            *(LoopPhase(x, "motion", "sine", 1, self.base, self.ride, 2.0 / self.ride, self.dwell) for x in rides),
        ]

    def parameters(self) -> dict[str, Any]:
        """Return the parameters of channel, bracket and reference; each is there in its ride."""
        labels = [p.label for p in self.phases()]
        number = {key: labels.index(label) + 1 for key, label in RIDES.items()}
        return {
            "bracket.frequency": MODE,
            "channel.white": math.sqrt(LOUDER**2 - 1.0) * self.noise,
            "channel.noise_phase": number["noise"],
            "channel.line": LINE_SIZE,
            "channel.line_frequency": LINE,
            "channel.line_phase": number["line"],
            "channel.gap_period": GAP_PERIOD,
            "channel.gap_length": GAP,
            "channel.gap_phase": number["gaps"],
            "channel.wild_period": WILD_PERIOD,
            "channel.wild_size": WILD,
            "channel.wild_phase": number["wild"],
            "reference.period": ANGLE_PERIOD,
            "reference.reading": ANGLE_NOISE,
            "reference.phase_read": number["aided"],
        }
