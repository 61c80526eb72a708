from __future__ import annotations

import pytest
from reading import Written
from simulated import tumble

from gyrobench import report


@pytest.fixture(scope="session")
def written(tmp_path_factory) -> Written:
    return Written(report.write(tumble(), tmp_path_factory.mktemp("report")))


@pytest.fixture(scope="session")
def compared(tmp_path_factory) -> Written:
    runs = [("standard", tumble()), ("other gyro", tumble(seed=2, sigma=0.02, offset=0.05)), ("third", tumble(seed=3))]
    runs[1][1].provenance["parameters"]["gyro.J"] = 3e-4
    runs[2][1].provenance["parameters"]["gyro.C"] = 0.21  # else it would be one candidate with the first: two seeds
    return Written(report.compare(runs, tmp_path_factory.mktemp("comparison")))
