"""The optical tracking loop outside of the three loops of Xia 2008: its line of sight is y of the inner element.

    target -> tracker (on the inner element) -> track_pitch, track_yaw -> commands (T2) -> servo_three_loop

The parts are those of gimbal_tracking; the rates are commanded about x and z of the inner element, the one about y
stays the exciter's.  [TRACK-LOOP, TRACK-IMAGE, SERVO-3LOOP; Xia 2008, section 1.3.2, fig. 1.3]
"""

from __future__ import annotations

import math
from typing import Any

from gyrobench.system.families import loop_test as loop
from gyrobench.system.loop_plan import LoopPhase, sweep
from gyrobench.system.system import Slot

from . import rate_loops

SIGHT = {"pitch": (1, 1), "yaw": (2, 3)}  # element of the tracker, and of the exciter and the platform
LOOPS = {f"track {axis}": f"track_{axis}.u" for axis in SIGHT}
CORNER = 6.0  # crossover over the corner of the integral
TONES = (0.35, 0.6, 0.8, 1.0, 1.25, 1.7, 2.5, 3.6)  # of the crossover
TEST = 4e-4  # V (rad), of the test sines
#: s, between samples of the record; no part of the time between images: samples meet a held error at all of its ages
CHANNEL_PERIOD = 1.3e-3
RATES = [1e-3, 5e-3]  # rad/s, of the target about x and z
FACTORS: dict[str, Any] = {
    # a target above the line of sight is the line of sight below it; 1 V for 1 rad and 1 rad/s
    **{f"tracker.error[{two}] -> track_{axis}.u": -1.0 for axis, (two, _) in SIGHT.items()},
    **{f"exciter.command[{k}] -> track_{axis}.test": 1.0 for axis, (_, k) in SIGHT.items()},
    **{f"track_{axis}.v -> commands.u[{k}]": 1.0 for axis, (_, k) in SIGHT.items()},
}
INSTEAD = tuple(f"exciter.command[{k}] -> commands.u[{k}]" for _, k in SIGHT.values())
WIRES = "\n".join([
    "exciter.phase -> target.phase",
    "target -> tracker: direction omega=omega_target alpha=alpha_target",
    "platform -> tracker: omega alpha",
    *FACTORS,
])  # fmt: skip
CHANNELS = (
    "exciter.command[1]", "exciter.command[3]", "tracker.lost",
    *(f"tracker.{n}[{k}]" for n in ("error", "miss", "rate") for k in (1, 2)),
    *(f"track_{axis}.{n}" for axis in SIGHT for n in ("e", "v")),
)  # fmt: skip


def slots() -> dict[str, Slot]:
    """Return the slots beside those of the rate loops."""
    return {
        "target": Slot("Target", "moving_target"),
        "tracker": Slot("Tracker", "optical_tracker"),
        **{f"track_{axis}": loop.stabilizer("tracking_controller", "angle") for axis in SIGHT},
    }


def wires(outside: str) -> str:
    """Return wires and those of the optical loop, without the commands that it replaces."""
    kept = [line for line in outside.splitlines() if line.strip() not in INSTEAD]
    return "\n".join([*kept, WIRES])


def phases(track: float, hold: float, sweeps: bool) -> list[LoopPhase]:
    """Return test sines of both tracking loops and the ride, in which the target moves."""
    found = []
    for axis, (_, k) in SIGHT.items() if sweeps else ():
        tones = [track * x for x in TONES]
        found += sweep(f"loop track {axis}", "command", tones, TEST, axis=k, settle=2.0, periods=12)
    return [*found, LoopPhase("ride", "hold", settle=3.0 + 3.0 / track, dwell=hold)]


def design(crossover: float, track: float, first: int) -> dict[str, Any]:
    """Return the parameters of target and tracking controllers of type 2, which cross at ``track``, Hz.

    crossover: of the rate loops, Hz, whose closed response is that of their design with its lags.  first: number of
    the phase in which the target begins to move.
    """
    wc = 2.0 * math.pi * track
    corner, s = wc / CORNER, 1j * wc
    K = wc / abs((1.0 + corner / s) * rate_loop(s, crossover))
    found: dict[str, Any] = {"target.first?": first, "target.kind?": 1}
    found |= {f"target.rate[{k}]?": x for k, x in enumerate(RATES, 1)}
    for axis in SIGHT:
        found |= {f"track_{axis}.K?": K, f"track_{axis}.integral?": corner}
    return found


def rate_loop(s: complex, crossover: float) -> complex:
    """Return rate over commanded rate of an axis by the design of its loops: F/(1 + F H), H the lag of the gyro."""
    wc = 2.0 * math.pi * crossover
    corner = rate_loops.CORNER * wc
    gyro, current = (1.0 / (1.0 + s / (2.0 * math.pi * f)) for f in (rate_loops.REBALANCE, rate_loops.CURRENT))
    ahead = wc / s * (1.0 + corner / s) / abs(1.0 + corner / (1j * wc)) * current
    return ahead / (1.0 + ahead * gyro)
