"""Positions at rest in a series of samples: one written after the other, held by a hand, with samples missing."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import numpy as np
from imu_world import Unit, handled, own_axes, poses
from test_imu_by_hand import ACC, GYRO, estimates, hand, record, tables, write

from gyrobench.system.system import load_system

room = type(load_system("imu_positions")).__module__
still: Any = importlib.import_module(".still", room)
turns: Any = importlib.import_module(".turns", room)


def test_rests_that_are_written_one_after_the_other() -> None:
    """Twelve of two seconds at 100 Hz each, nothing between them: half of the windows of one second have a step of a
    thousand times the noise in them, and each sample is in one that has none.  It was one position of 24 s.  The first
    and the last lose an edge of 0.25 s, as something may have moved before and after the record."""
    rng = np.random.default_rng(2)
    level = np.repeat(np.arange(12.0), 200)[:, None]
    found, _ = still.at_rest(np.arange(2400) / 100.0, level + 1e-3 * rng.normal(size=(2400, 3)), 10)
    assert found == [(25, 200), *((200 * k, 200 * k + 200) for k in range(1, 11)), (2200, 2375)]


def test_rests_that_a_hand_held() -> None:
    """Half a minute on a table, then eleven rests of 3 s in a hand that shakes five times as much as the table, moved
    for 2 s between them: no stretch in the hand is quiet by twice the noise of the table, all are by eight times."""
    rng = np.random.default_rng(3)
    parts, size = [np.zeros(3000)], [np.full(3000, 1.0)]
    for k in range(11):
        parts += [np.linspace(0.0, 1e4, 200) * (-1) ** k, np.full(300, 100.0 * k)]
        size += [np.full(200, 1.0), np.full(300, 5.0)]
    x = np.concatenate(parts)[:, None] + np.concatenate(size)[:, None] * rng.normal(size=(8500, 3))
    found, loud = still.at_rest(np.arange(8500) / 100.0, x, 10)
    assert len(found) == 12 and loud == 8.0
    assert all(a >= 3175 + 500 * k and b <= 3525 + 500 * k for k, (a, b) in enumerate(found[1:]))
    assert len(still.at_rest(np.arange(8500) / 100.0, x, 1)[0]) == 1  # the table alone


def test_a_gap_in_one_turn_leaves_the_others(tmp_path: Path) -> None:
    """16 positions, and a second without samples in the turn behind the fifth, at 28 to 30 s: the ten turns from the
    sixth on give the matrix of the gyros, all positions the accelerometers, biases and g-sensitivities.  It was: no
    turns at all."""
    rng = np.random.default_rng(15)
    unit = Unit.drawn(rng)
    time, gyro, acc = handled(unit, poses(rng, 16), rng, gyro=GYRO, acc=ACC)
    there = ~((time > 28.3) & (time < 29.5))
    result = hand.HandReduction.of_record(record(write(tmp_path / "log.csv", time[there], gyro[there], acc[there])))
    assert [r.text for r in result.reasons if r.id == "turns.some"] == [
        "Samples of turns are missing: Sg rests on those from position 6 to 16 alone."
    ]
    found, truth = estimates(result), own_axes(unit)
    u = {c.name: c.u * tables.SCALES[c.unit] for c in result.coefficients}
    for k, a in enumerate("xyz"):
        for i, b in enumerate("xyz"):
            assert abs(found[f"Sg_{a}{b}"] - truth[f"Sg_{a}{b}"]) < 4.5 * u[f"Sg_{a}{b}"] < 0.05, (k, i)
            assert abs(found[f"G_{a}{b}"] - truth[f"G_{a}{b}"]) < 4.5 * u[f"G_{a}{b}"]
    apart = [line for line in result.budget if "where turns lack samples" in line.source]
    assert apart and all(line.size > 0.0 for line in apart)


def test_a_turn_in_few_steps_turns_as_far(tmp_path: Path) -> None:
    """Two seconds at 100 Hz, 1.2 rad about axes that change: in steps of 7 samples, the last one shorter, the turn is
    the same to a hundredth of the 0.15 rad that a guess may be off, and rates that are constant are kept."""
    time = np.arange(201) / 100.0
    rate = np.column_stack([0.6 * np.ones(201), 0.5 * np.sin(3.0 * time), 0.4 * np.cos(2.0 * time)])
    up = np.array([0.0, 0.0, 1.0])
    turn = turns.Turn(time, rate, up, up)
    coarse = turn.thinned(30)
    assert coarse.time.size == 31 and coarse.time[[0, -1]].tolist() == [0.0, 2.0]
    np.testing.assert_allclose(coarse.rate[:, 0], 0.6, rtol=1e-12)
    np.testing.assert_allclose(coarse.rotation(np.eye(3)), turn.rotation(np.eye(3)), atol=1.5e-3)
    assert turn.thinned(200) is turn
