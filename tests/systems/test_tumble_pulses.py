"""The tumble with pulse-width rebalance: exact counts, shifts by errors of the pulses predicted by the budget."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from reducing import with_options as reduced
from tumbling import NAME, SHORT, gyro

from gyrobench.engine.session import Session
from gyrobench.errors import GyrobenchError
from gyrobench.record.record import Record
from gyrobench.result import DriftTestResult
from gyrobench.system.system import load_system

I = 3e-3  # noqa: E741  A, full scale 51.6 deg/h
PULSES = {**SHORT, "rebalance.I": I}


@pytest.fixture(scope="module")
def session() -> Any:
    with Session(NAME, {"rebalance": "rebalance_pwm"}) as opened:
        yield opened


@pytest.fixture(scope="module")
def clean(session: Session) -> Record:
    return session.run({**PULSES, **gyro(np.random.default_rng(5))}, seed=7)


def predicted(result: DriftTestResult) -> dict[str, float]:
    """Coefficient -> sum of the predicted shifts, in its unit."""
    (table,) = [t for t in result.tables if t.title.startswith("Predicted shifts")]
    column = table.columns.index("sum")
    return {row[0]: row[column] for row in table.rows}


def test_windows_are_differences_of_the_counts(clean: Record) -> None:
    """Mean over I times clocks of the window is n+ - n-: even whole numbers."""
    w = clean.windows
    counts = w["mean"] / I * (w["t_end"] - w["t_start"]) * 1e6 / 2.0
    assert np.abs(counts - np.round(counts)).max() < 1e-4
    assert np.abs(counts).min() > 1000.0


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_shifts_are_predicted(session: Session, clean: Record, seed: int) -> None:
    """Errors of 1 % of the currents and 5 us of the switching, drawn with both signs: the budget of the run names each
    and predicts the shift of every coefficient (asked are 10 % where it is above a tenth of u).
    """
    draw = np.random.default_rng(seed).normal
    # the mean of the currents too, which shifts all coefficients in proportion
    errors = {"rebalance.dI_plus": I * (0.02 + 0.01 * draw()), "rebalance.dI_minus": I * (0.02 + 0.01 * draw())}
    late = [5e-6 * draw(), 5e-6 * draw() + 2e-5, 1e-5 * draw()]
    record = session.run({**PULSES, **gyro(np.random.default_rng(5)), **errors, "rebalance.dT": late}, seed=7)
    result, before = reduced(record), reduced(clean)
    shift = predicted(result)
    seen = 0
    for c in result.coefficients:
        if c.truth is None:
            continue
        moved = c.estimate - before[c.name].estimate
        assert moved == pytest.approx(shift[c.name], rel=0.03, abs=0.02 * c.u), c.name
        seen += abs(shift[c.name]) > 0.1 * c.u
    assert seen >= 5  # D_F, D_I, D_S, D_O ... of nine
    named = {e.parameter for e in record.run.setup_errors}
    assert named == {"rebalance.dI_plus", "rebalance.dI_minus", "rebalance.dT"}


def test_a_measured_asymmetry_is_corrected(session: Session, clean: Record) -> None:
    """Stated with its uncertainty it neither biases nor hides: D_F is true again, and what is left is in the budget."""
    record = session.run({**PULSES, **gyro(np.random.default_rng(5)), "rebalance.dI_plus": 0.02 * I}, seed=7)
    stated = "asymmetry of the pulse currents = 0.06 (0.001) mA; mean of the pulse currents = 0.03 (0) mA"
    result = reduced(record, corrections=stated)
    for c in result.coefficients:
        assert c.z is None or abs(c.z) < 4.0, c.name
    assert abs(predicted(result)["D_F"]) < 1e-9
    line = next(b for b in result.budget if b.source == "asymmetry of the pulse currents" and b.coefficient == "D_F")
    # k/2 for 1 A: 17.2 deg/h/mA / 2, times 1 uA
    assert line.sensitivity == pytest.approx(8600.0, rel=1e-3) and line.contribution == pytest.approx(8.6e-3, rel=1e-3)


def test_resolution_and_stated_uncertainties_are_lines_of_the_budget(clean: Record) -> None:
    result = reduced(clean, u_pulse=1e-6, u_switching=1e-8)
    lines = {b.source: b for b in result.budget if b.coefficient == "D_F"}
    assert lines["asymmetry of the pulse currents"].contribution == pytest.approx(8.6e-3, rel=1e-3)
    # 2 k I f_s dT = 2 x 51.6 deg/h x 1e3 Hz x 1e-8 s
    assert lines["switching time of the pulses"].contribution == pytest.approx(1.032e-3, rel=1e-3)
    assert 0.0 < lines["resolution of the counts"].contribution < 1e-4
    assert "Predicted shifts by simulated errors" not in [t.title for t in result.tables]


def test_refuses_a_loop_too_fast_for_the_saw(session: Session) -> None:
    # K_v = K_sg H k K_p / C = 10 x 0.0834 x 1000 = 834 1/s = 133 Hz
    with pytest.raises(GyrobenchError, match="crosses over at 133 Hz, the saw must be at least ten times faster"):
        session.run({**PULSES, "rebalance.K_p": 1000.0}, seed=1)


def shifts(name: str, parts: dict[str, str], values: dict[str, Any], errors: dict[str, Any]) -> tuple[Any, Any, Any]:
    """Shifts measured with one seed, predicted (all tables together), and u; in the units of the report."""
    system = load_system(name)
    with Session(name, parts) as session:
        before, after = (system.reduce(session.run({**values, **e}, seed=4)) for e in ({}, errors))
    tables = [t for t in after.tables if t.title.startswith("Predicted shifts")]
    said = {row[0]: row[t.columns.index("sum")] for t in tables for row in t.rows}
    names = [c.name for c in before.coefficients if c.name in said and c.truth is not None]
    moved = [after[n].estimate - before[n].estimate for n in names]
    return np.array(moved), np.array([said[n] for n in names]), np.array([before[n].u for n in names])


@pytest.mark.long
def test_two_axis_tumble() -> None:
    """A current of 1 A lets the inner axis turn quickly; a clock of 10 MHz keeps the counts fine."""
    plan = {"positions": 25, "dwell": 4.0, "settle": 3.0, "inner_rate": 0.05, "table.index_rate[1]": 1.0}
    values = {**plan, "table.acceleration": [1.0, 1.0], "rebalance.I": 1.0, "rebalance.f_q": 1e7}
    errors = {"rebalance.dI_plus": 2e-2, "rebalance.dI_minus": 1.99e-2, "rebalance.dT": [-2e-8, 3e-5, 0.0]}
    moved, said, u = shifts("tumble_two_axis", {"rebalance": "rebalance_pwm"}, values, errors)
    assert moved.size == 9 and np.abs(said[0]) > 0.1 * u[0]
    assert np.all(np.abs(moved - said) < 0.05 * np.abs(said) + 0.1 * u), (moved, said, u)


@pytest.mark.long
def test_eight_positions() -> None:
    """Each loop has errors of its own; the mean of the currents is found as a scale factor."""
    values = {"cycles": 2, "readings": 6, "dwell": 6.0, "settle": 3.0, **{f"rebalance_{c}.f_q": 1e7 for c in "xy"}}
    parts = {"rebalance_x": "rebalance_pwm", "rebalance_y": "rebalance_pwm"}
    errors = {"rebalance_x.dI_plus": 1e-4, "rebalance_y.dI_minus": 3e-4, "rebalance_y.dT": [2e-7, 0.0, 0.0]}
    moved, said, u = shifts("eight_position", parts, values, errors)
    assert moved.size >= 10 and np.sum(np.abs(said) > u) >= 2
    assert np.all(np.abs(moved - said) < 0.05 * np.abs(said) + 0.1 * u), (moved, said, u)


@pytest.mark.long
@pytest.mark.usefixtures("fewer_weights")
def test_two_channels() -> None:
    """The loop of the torquer about x shifts the y channel, that about y the x channel.  Without nuisances, whose
    weights change with the data.
    """
    values = {**SHORT, "nuisances": "none", **{f"rebalance_{c}.f_q": 1e7 for c in "xy"}}
    parts = {"rebalance_x": "rebalance_pwm", "rebalance_y": "rebalance_pwm"}
    errors = {"rebalance_x.dI_plus": 1e-4, "rebalance_y.dT": [-1e-7, 2e-5, 0.0]}
    moved, said, u = shifts("tumble_two_channel", parts, values, errors)
    assert moved.size == 18 and np.sum(np.abs(said) > u) >= 4
    assert np.all(np.abs(moved - said) < 0.05 * np.abs(said) + 0.1 * u), (moved, said, u)
