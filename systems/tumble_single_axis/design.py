"""The test as choices of turns and of the dwell's share, each with the time of turning, or of rests at stops."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gyrobench import drift
from gyrobench.arrays import Array
from gyrobench.design.option_protocol import Choice, OptionProtocol
from gyrobench.design.visit_protocol import GUARD, gyro_noise, gyro_unseen
from gyrobench.frames import EARTH_RATE
from gyrobench.record.record import Record
from gyrobench.reduction.drift.window_regressors import Turning, regressors
from gyrobench.reduction.estimation.findings import Findings
from gyrobench.system.system import System
from gyrobench.system.visits import format_time

from .reduction import Reduction, TumbleSetup

TURN = 2.0 * math.pi
TURNS = (1, 2, 4)
SHARES = (0.05, 0.1, 0.2, 0.35, 0.6, 1.0)  # of a dwell against the turning of a mount
FASTEST = 60.0 * EARTH_RATE  # of the table; the errors of its axis grow with its rate


def protocol_of(system: System, record: Record) -> OptionProtocol:
    """Return turns in each mount and shares of the dwells; the length is the time of turning in a mount, s.

    Faster turning costs no time and lifts the signal above slow drift; the rate is kept below 60 Earth rates.
    """
    setup, p = Reduction.setup_of(record.run), record.run.parameters
    noise = gyro_noise(p)

    def covariances(fits: Sequence[Findings], record: Record) -> list[Array]:
        return [noise.covariance(f.t_start, f.t_end) for f in fits]

    names = drift.terms(9 if setup.terms == 10 else setup.terms)
    unseen = ("D_OO, which constant |g| folds into D_F, D_II and D_SS", *gyro_unseen(p))
    choices = [_stopping(system)] if system["stops"] else _turning(system, setup)
    return OptionProtocol(tuple(choices), covariances, names, unseen, noise)


def _stopping(system: System) -> Choice:
    """Return the plan with stops; the length is the time of averaging at the stops of a mount, s."""
    stops = int(system["stops"]) * int(system["turns"]) * (2 if system["both_senses"] else 1)
    start = stops * float(system["stop_dwell"])
    share = float(system["dwell"]) / start

    def options(length: float) -> Mapping[str, Any]:
        return {"stop_dwell": format_time(length / stops), "dwell": format_time(share * length)}

    return Choice(f"{system['stops']} stops a turn, dwells {share:.2g} of a mount's", options, start, float(stops))


def _turning(system: System, setup: TumbleSetup) -> list[Choice]:
    """Return turns in each mount and shares of the dwells; the length is the time of turning in a mount, s."""
    share = float(system["dwell"] * system["rate"] / (TURN * system["turns"]))
    own = (int(system["turns"]), share)
    each = [own, *((n, s) for n in TURNS for s in SHARES if (n, s) != own)]
    if system["both_senses"]:
        each = [own]  # its plan has four turnings, which the windows below do not
    choices = []
    for turns, part in each:
        options = functools.partial(_options, turns, part)
        start = TURN * turns / float(system["rate"])
        known = functools.partial(_windows, system, setup, turns, part) if (turns, part) != own else None
        label = f"{turns} turn{'s' if turns > 1 else ''}, dwells {part:.2g} of a mount's turning"
        choices.append(Choice(label, options, start, TURN * turns / FASTEST, known))
    return choices


def _options(turns: int, share: float, length: float) -> Mapping[str, Any]:
    rate = math.degrees(TURN * turns / length)
    return {"turns": turns, "rate": f"{rate:.8g}deg/s", "dwell": format_time(share * length)}


def _windows(system: System, setup: TumbleSetup, turns: int, share: float, length: float) -> tuple[Array, Array, Array]:
    """Return design matrix and times of the windows of the plan, the table's run-up left out."""
    n, settle, dwell = int(system["windows"]) * turns, float(system["settle"]), share * length
    still = max(1, round(dwell / (length / n)))
    t0, t1, a0, a1, faces = [], [], [], [], []
    t, angle = 0.0, 0.0
    for phase in sorted(setup.faces):
        t += settle + GUARD
        turning = setup.turns(phase)
        count, width = (n, length / n) if turning else (still, dwell / still)
        step = -TURN * turns / n if turning else 0.0
        k = np.arange(count)
        t0.append(t + width * k)
        t1.append(t + width * (k + 1))
        first = angle + step * settle / width  # where the gate opens
        a0.append(first + step * k)
        a1.append(first + step * (k + 1))
        faces += [np.asarray(setup.faces[phase], dtype=float)] * count
        t, angle = t + width * count, angle + step * count
    start, end, before, after = (np.concatenate(x) for x in (t0, t1, a0, a1))
    turned = Turning(before, after, start, end, np.array(faces))
    names = drift.terms(9 if setup.terms == 10 else setup.terms)
    return regressors(turned, setup.base, setup.gravity, names), start, end
