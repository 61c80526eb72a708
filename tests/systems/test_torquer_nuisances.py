"""Torquer and turn-on in the nuisance model: what is put into a simulated record is found and named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from test_setup_effects import DPH, candidates, holds, reduced, with_columns, worst

from gyrobench.engine.session import Session
from gyrobench.record.csv_reader import read_measured
from gyrobench.record.record import Record


def asymmetric(record: Record, **size: float) -> Record:
    """The currents of a torquer whose scale factor is k (1 + a) for positive and k (1 - a) for negative ones, column
    -> a: a rate of k i takes i / (1 +- a)."""
    means = {n: record.windows[n] / (1.0 + a * np.sign(record.windows[n])) for n, a in size.items()}
    return with_columns(record, **means)


@pytest.fixture(scope="module")
def positions() -> Record:
    """Eight positions, ten cycles of short readings."""
    with Session("eight_position") as session:
        return session.run({"dwell": 20.0, "settle": 2.0, "readings": 2, "cycles": 10}, seed=1)


@pytest.mark.long
def test_asymmetry_of_both_torquers_in_eight_positions(positions: Record) -> None:
    """0.2 % of the Earth's rate of 10 deg/h are 0.02 deg/h; the reading that is opposite to the other one shows it."""
    clean = reduced(positions)
    holds(clean)
    found = reduced(asymmetric(positions, mean_x=2e-3, mean_y=-2e-3))
    holds(found, **{"k_±,x": 0.2, "k_±,y": -0.2})
    assert any("In the model: asymmetry of the torquer about x" in s for s in found.summary)
    assert worst(reduced(asymmetric(positions, mean_x=2e-3), nuisances="none"), clean) > 5.0


@pytest.mark.long
def test_asymmetry_in_a_tumble() -> None:
    """Unbalances of 10 deg/h/g: currents of 0.6 mA of both signs tell 0.3 %.  Of the standard gyro a tenth of that
    current is left, which tells 3 % (flagrant) and no sound torquer; a scale factor is what all coefficients share."""
    unbalanced = {"gyro.D_I": -10.0 * DPH, "gyro.D_S": 10.0 * DPH}
    with Session("tumble_single_axis") as session:
        strong, standard = (session.run(v, seed=1, step=5e-3) for v in (unbalanced, {}))
    clean = reduced(strong)
    holds(clean)
    found = reduced(asymmetric(strong, mean=3e-3))
    holds(found, **{"k_±": 0.3})
    assert worst(reduced(asymmetric(strong, mean=3e-3), nuisances="none"), clean) > 5.0
    rows = candidates(reduced(standard))
    assert rows["k_±"] == "not weighed: this record determines it to 0.3 % only, more than 0.1"
    assert rows["δk"].startswith("not observable: aliased with D_F, D_I")
    holds(reduced(asymmetric(standard, mean=5e-2)), **{"k_±": 5.0})


@pytest.mark.long
def test_turn_ons_of_a_tumble() -> None:
    """Twelve turn-ons with constants of 0.035 deg/h, five times the u of D_F in one: the deviation of those drawn is in
    the interval, and so are the coefficients.  Three times the default rate, so a third of its time: u is sqrt(3) as
    large as there.
    """
    with Session("tumble_single_axis") as session:
        record = session.run({"turns": 2, "rate": 2.1876e-3}, seed=3, step=5e-3)
    count = len(record.windows["mean"])
    number = 1.0 + (12 * np.arange(count)) // count
    drawn = 0.035 * np.random.default_rng(1).normal(size=13)
    k = float(record.run.parameters["gyro.k"])
    holds(reduced(with_columns(record, turn_on=number)))
    moved = record.windows["mean"] - drawn[number.astype(int)] * DPH / k
    result = reduced(with_columns(record, mean=moved, turn_on=number))
    holds(result, σ_turn_on=float(np.std(drawn[1:], ddof=1)))
    assert any("from turn-on to turn-on" in s for s in result.summary)


def test_column_of_a_laboratory(tmp_path: Path) -> None:
    """turn_on is a column that any record may have."""
    rows = "".join(f"1,{60 * k},{60 * k + 60},0,0,0.5,{1 + k // 10}\n" for k in range(40))
    file = tmp_path / "record.csv"
    head = "phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA],turn_on\n"
    file.write_text(head + rows, encoding="utf-8")
    windows, _ = read_measured(file)
    assert windows["turn_on"].tolist() == [1.0 + k // 10 for k in range(40)]
