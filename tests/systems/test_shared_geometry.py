"""Errors of the set-up that both channels of a two-channel test share: one error, the same for all estimates."""

from __future__ import annotations

import math

import numpy as np
import pytest
from servoing_two_axes import day
from test_setup_effects import reduced
from two_channels import SHORT

from gyrobench import frames
from gyrobench.engine.session import Session

ARCSEC = math.pi / 648000.0
TURN = 1.0 * ARCSEC  # small: a step from mount to mount is weighed as slow noise


def turned(axis: int) -> list[list[float]]:
    """Rows: gyro axes in case axes, turned by TURN about one of them."""
    found: list[list[float]] = frames.rotation(np.eye(3)[axis], TURN).T.tolist()
    return found


def agrees(system: str, values: dict, source: str, sign: float) -> None:
    """A run with the gyro turned about z in its mount against one without, the same noise: the estimates of both
    channels move by the one row of the source, times one and the same factor."""
    with Session(system) as session:
        plain = session.run({**values, "u_mount": TURN}, seed=1)
        moved = session.run({**values, "u_mount": TURN, "gyro.mount": turned(2)}, seed=1)
    a, b = (reduced(r, nuisances="none") for r in (plain, moved))
    entries = [e for e in a.type_b if e.source == source]
    assert len(entries) == 1
    (row,) = np.array(entries[0].changes)
    shift = b.array("estimate") - a.array("estimate")
    weight = 1.0 / a.array("u_a")
    half = len(row) // 2
    for own in (slice(0, half), slice(half, None)):  # the weights of the noise models follow the data, too
        one, other = (weight * row)[own], (weight * shift)[own]
        assert float(one @ other / (one @ one)) == pytest.approx(sign, abs=0.1)
        assert abs(one @ other) > 0.98 * np.linalg.norm(one) * np.linalg.norm(other)
    assert len(row) == 18 and np.any(row[:half]) and np.any(row[half:])
    covariance = a.covariance()
    together = sum(np.array(e.changes).T @ np.array(e.changes) for e in a.type_b)
    np.testing.assert_allclose(covariance[:half, half:], together[:half, half:], rtol=1e-6)


@pytest.mark.long
@pytest.mark.usefixtures("fewer_weights")
def test_tumble_of_two_channels() -> None:
    agrees("tumble_two_channel", SHORT, "gyro turned about its z axis", 1.0)


@pytest.mark.long
def test_two_axis_servo() -> None:
    agrees("servo_two_axis", day(500.0), "gyro on the plate, about z", 1.0)
