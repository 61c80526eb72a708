"""table_environment on a foundation: the drift follows the block, and the report says what is left of the ground."""

from __future__ import annotations

import math
from typing import Any

import pytest

from gyrobench.engine.session import Session
from gyrobench.packaging import build
from gyrobench.result import DriftTestResult
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system

NAME = "table_environment"
ARCSEC = math.pi / 648000.0
GROUND = {"site.local_e": 2e-3, "site.seismic_e": 5e-4, "site.local_frequency": 8.0}


@pytest.fixture(scope="module")
def found() -> DriftTestResult:
    with Session(NAME, {"foundation": build("foundation_passive")}) as session:
        values: dict[str, Any] = {"dwell": 1200.0, "readings": 60, **GROUND, "foundation.person": 70.0}
        result = session.system.reduce(session.run(values, seed=4))
    assert isinstance(result, DriftTestResult)
    return result


@pytest.mark.long
def test_the_drift_is_resolved_by_the_motion_of_the_block(found: DriftTestResult) -> None:
    for c in found.coefficients[:7]:
        assert c.truth is not None and c.z is not None and abs(c.z) < 3.5, c.name


@pytest.mark.long
def test_what_is_left(found: DriftTestResult) -> None:
    """Machines at 20 Hz on 3.5 Hz, damping 0.1: r = 5.714, |T| = sqrt((1 + 1.143^2)/((1 - r^2)^2 + 1.143^2)) = 0.0479.
    In the run 2e-3 m/s2 at 8 Hz and 5e-4 at 0.2 Hz: 210 ug below; the channels are 120 samples of a second."""
    left = {row[0]: row for row in next(t for t in found.tables if t.id == "foundation").rows}
    assert left["machines"][3] == pytest.approx(0.0479, abs=1e-4)
    assert left["machines"][4] == pytest.approx(0.0479 * 1e-2, rel=2e-3)
    assert left["tilt of a day"][4] == pytest.approx(1.0)
    assert left["person of 70 kg, walking 2 m from the middle"][4] == pytest.approx(1.027, abs=2e-3)
    (row,) = next(t for t in found.tables if t.id == "foundation.run").rows
    assert row[2] == pytest.approx(math.hypot(2e-3, 5e-4) / 9.80665 * 1e6, rel=2e-3)
    assert row[1] == pytest.approx(row[2], rel=0.25) and row[3] == pytest.approx(row[4], rel=0.25)
    assert 0.4 < row[5] < 0.9


def test_without_a_foundation_nothing_is_said_of_it() -> None:
    system = load_system(NAME)
    assert "foundation" not in system.slots and "site -> table: f=f_local omega=omega_local" in system.wires
    system.request("foundation")
    assert "site -> table" not in system.wires and "foundation -> table" in system.wires


def test_tilts_beyond_the_travel_are_refused() -> None:
    """900 arcsec in 40 and 28 minutes on the default servo: the block would go 0.26 m."""
    words = r"give --set tilting=85arcsec, or a longer dwell"
    with (
        Session(NAME, {"foundation": build("foundation_active")}) as session,
        pytest.raises(InvalidConfigurationError, match=words),
    ):
        session.run({}, seed=1)
