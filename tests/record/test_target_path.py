"""Recorded paths of a target: directions against a fly-by in plain vectors, length, units, faults in one list."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gyrobench.record.csv_reader import DataError
from gyrobench.record.target_path import POINTS, along, read_path

T = np.arange(0.0, 300.0, 0.02)  # 15,000 rows
PLACE = np.column_stack([-2000.0 + 15.0 * T, 800.0 + 0.0 * T, 300.0 + 5.0 * T])  # m, east, north, up
WITHIN = 1e-5


def written(folder: Path, t: np.ndarray, place: np.ndarray, units: tuple[str, str] = ("deg", "deg")) -> Path:
    """Write the directions to a place; angles in degrees, mrad or rad."""
    size = {"deg": np.degrees(1.0), "mrad": 1e3, "rad": 1.0}
    azimuth = np.arctan2(-place[:, 0], place[:, 1]) % (2.0 * np.pi) * size[units[0]]
    elevation = np.arctan2(place[:, 2], np.hypot(place[:, 0], place[:, 1])) * size[units[1]]
    rows = (f"{a:.3f},{b:.9g},{c:.9g}" for a, b, c in zip(t, azimuth, elevation, strict=True))
    file = folder / "path.csv"
    file.write_text(f"time [s],azimuth [{units[0]}],elevation [{units[1]}]\n" + "\n".join(rows))
    return file


def test_a_long_flight_in_the_axes_of_its_first_direction(tmp_path: Path) -> None:
    """It begins at 68 degrees of azimuth, 20 m/s past at 854 m: through north, where azimuth jumps by 360 degrees.

    The axes by vectors alone: y the first direction, x = y x up.  Rates by u x u'.
    """
    path = read_path(written(tmp_path, T, PLACE, ("mrad", "deg")), WITHIN)
    assert path.rows == T.size and path.t.size < POINTS and path.off < WITHIN
    u = PLACE / np.linalg.norm(PLACE, axis=1)[:, None]
    x = np.cross(u[0], [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    own = u @ np.array([x, u[0], np.cross(x, u[0])]).T
    (a, b), (da, db) = (y.T for y in along(path.t, path.angles, T))
    made = np.column_stack([-np.sin(b) * np.cos(a), np.cos(b) * np.cos(a), np.sin(a)])
    assert np.max(np.abs(made - own)) < 1.5 * WITHIN
    n = np.column_stack([np.cos(b), np.sin(b), 0.0 * b])
    w = da[:, None] * n + db[:, None] * (np.array([0.0, 0.0, 1.0]) - np.sin(a)[:, None] * made)
    v = np.array([15.0, 0.0, 5.0])
    true = np.cross(PLACE, v) / np.sum(PLACE**2, axis=1)[:, None] @ np.array([x, u[0], np.cross(x, u[0])]).T
    inside = (T > 10.0) & (T < 290.0)  # at both ends it rests
    assert np.max(np.abs(w - true)[inside]) < 0.02 * np.max(np.abs(true))


def test_few_rows_are_all_kept(tmp_path: Path) -> None:
    path = read_path(written(tmp_path, T[:5], PLACE[:5]), 1e-12)
    assert path.t.size == 5 and path.off == 0.0 and path.parameters()["target.points"] == 5
    assert path.t[0] == 0.0 and path.angles[0] == pytest.approx([0.0, 0.0], abs=1e-12)


def test_a_path_that_400_rows_do_not_pass(tmp_path: Path) -> None:
    """Noise of 1 mrad on every row."""
    rng = np.random.default_rng(1)
    noisy = PLACE + rng.normal(0.0, 1e-3, PLACE.shape) * 2000.0
    with pytest.raises(
        DataError, match=r"15000 rows: 400 of them pass the path within .* µrad only, 10 µrad are wanted"
    ):
        read_path(written(tmp_path, T, noisy), WITHIN)


def test_faults_in_one_list(tmp_path: Path) -> None:
    file = tmp_path / "bad.csv"
    file.write_text("time [s],azimuth [deg],elevation [deg]\n0,1,95\n1,2,0\n2,3,0\n9,4,0\n")
    with pytest.raises(DataError) as caught:
        read_path(file, WITHIN)
    assert "a gap of 7 s after time = 2 s" in str(caught.value)
    assert "elevation of 95 deg at time = 0 s: beyond 90" in str(caught.value)
    file.write_text("time [s],azimuth [deg],elevation [m]\n0,x,0\n1,2,0\n1,3,0\n")
    with pytest.raises(DataError) as caught:
        read_path(file, WITHIN)
    for text in ("elevation", "'x'", "time"):
        assert text in str(caught.value)
    file.write_text("time [s],azimuth [deg],elevation [deg]\n0,0,0\n1,0,40\n2,0,89\n")
    with pytest.raises(DataError, match="89 deg above its first direction; 85 deg at most"):
        read_path(file, WITHIN)
