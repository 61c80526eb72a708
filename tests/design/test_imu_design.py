"""The design of imu_positions: the windows that it expects are those of a run, its u those of the closed forms."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.record.record import Record
from gyrobench.system.system import load_system

room = type(load_system("imu_positions")).__module__
design: Any = importlib.import_module(".design", room)
budget: Any = importlib.import_module(".budget", room)
channels: Any = importlib.import_module(".channels", room)
VALUES = {"positions": 6, "dwell": 4.0, "settle": 1.0, "turns": 1, "rate": 1.0}
ACC = 5e-4  # m/s2/sqrt(Hz)


@pytest.fixture(scope="module")
def record() -> Record:
    return gb.load("imu_positions", VALUES).run(seed=1, check_step=False).record


def candidates(record: Record) -> Any:
    system = load_system("imu_positions").with_values(VALUES)
    noise = {c.name: design.DataNoise(3e-6 if c.gyro else ACC) for c in channels.CHANNELS}
    return design._Candidates(system, budget.ImuSetup.of(record.run), noise)


@pytest.mark.long
def test_windows_are_those_of_a_run(record: Record) -> None:
    """Times to a second over eleven moves; rates and forces at rest to rounding, turning to what a turn begins with."""
    omega, force, t0, t1, rest = candidates(record)._windows({})
    w = record.windows
    assert t0.size == len(w["t_start"]) and np.abs(t0 - w["t_start"]).max() < 1.0
    assert t1 - t0 == pytest.approx(np.asarray(w["t_end"]) - w["t_start"], abs=0.02)
    kinematics = budget.Kinematics(w, budget.ImuSetup.of(record.run))
    assert omega == pytest.approx(kinematics.felt[0], abs=0.02)
    assert force[rest] == pytest.approx(kinematics.felt[1][kinematics.motion.at_rest], abs=1e-3)


@pytest.mark.parametrize("count", [12, 18, 20, 26, 36])
def test_uncertainty_is_the_closed_form(record: Record, count: int) -> None:
    """Positions spread evenly over all directions, T in all: u(ba) = N/sqrt T, u(Sa_ik) = N sqrt 3/(g sqrt T), white
    noise N.  (None of the sets has a third moment; all but 26 have equal second ones, and so has 26 by its symmetry.)
    """
    system = load_system("imu_positions").with_values({**VALUES, "rate_axes": ""})
    setup = budget.ImuSetup.of(record.run)
    noise = {c.name: design.DataNoise(3e-6 if c.gyro else ACC) for c in channels.CHANNELS}
    test = design._Candidates(system, setup, noise)
    for name, u in (("ba_x", ACC / math.sqrt(720.0)), ("Sa_yz", ACC * math.sqrt(3.0 / 720.0) / setup.gravity)):
        merit, _ = test._judged(count, 0.0, 720.0, {name: u}, "minimax")
        assert merit == pytest.approx(1.0, rel=1e-4)  # dwells of whole milliseconds


@pytest.mark.long
def test_proposals_turn_no_longer_than_is_wanted(record: Record) -> None:
    """Only scale factors of gyros: the plan turns most of the time; only of accelerometers: as little as can be."""
    test = candidates(record)
    turning, resting = (test.proposals({n: 2e-6}, 600.0, "minimax")[0] for n in ("Sg_xx", "Sa_xx"))
    of = {c.label: c.options(c.start) for c in (turning, resting)}
    shares = [of[c.label]["turns"] * 12.0 * math.pi / c.start for c in (turning, resting)]
    assert shares[0] > 0.3 and shares[1] < 0.2
    assert all(len(p.label) for p in (turning, resting))
