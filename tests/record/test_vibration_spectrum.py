"""Files with spectra of a vibrating base."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from gyrobench.record.csv_reader import DataError
from gyrobench.record.vibration_spectrum import read_spectrum


def test_units_and_missing_columns(tmp_path: Path) -> None:
    file = tmp_path / "mast.csv"
    file.write_text("frequency [Hz],rate_x [deg2/s2/Hz],acceleration_z [m2/s4/Hz]\n1,4,0.1\n10,1,0.2\n")
    found = read_spectrum(file)
    degree = math.radians(1.0)
    assert found.rate[0] == pytest.approx([4 * degree**2, degree**2])
    assert not found.rate[1:].any() and found.acceleration[2] == pytest.approx([0.1, 0.2])
    # halfway in the logarithm between 1 and 10 Hz: the root of 4 and 1
    assert found.density("rate", 0, np.array([math.sqrt(10.0), 0.5, 20.0])) == pytest.approx([2 * degree**2, 0.0, 0.0])
    # S = 4 f^-log10(4): the integral by hand
    p = math.log10(4.0)
    assert found.rms("rate", 0) == pytest.approx(degree * math.sqrt(4 * (10 ** (1 - p) - 1) / (1 - p)), rel=1e-5)
    values = found.parameters()
    assert values["vibration.points"] == 2 and len(values["vibration.frequency"]) == 24


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("frequency [Hz]\n1\n2\n", "no density"),
        ("frequency [Hz],rate_x [rad2/s2/Hz]\n1,1\n", "1 points: 2 to 24"),
        ("frequency [Hz],rate_x [rad2/s2/Hz]\n0,1\n2,1\n", "first frequency must be above 0"),
        ("frequency [Hz],rate_x [rad2/s2/Hz]\n1,1\n2,-1\n", "never below 0"),
        ("frequency [Hz],rate_x [rad/s]\n1,1\n2,1\n", "rate_x"),
        ("frequency [Hz],rate_x [rad2/s2/Hz]\n2,1\n1,1\n", "frequency"),
    ],
)
def test_refused(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "mast.csv"
    file.write_text(text)
    with pytest.raises(DataError, match=message):
        read_spectrum(file)
