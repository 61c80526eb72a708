"""Positions at rest in a series of samples: one written after the other, held by a hand, with samples missing."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np

from gyrobench.system.system import load_system

room = type(load_system("imu_positions")).__module__
still: Any = importlib.import_module(".still", room)


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
