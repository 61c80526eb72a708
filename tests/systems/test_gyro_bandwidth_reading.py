"""Bandwidth of a rate gyro: gain and lag of the table reading, stated and not."""

from __future__ import annotations

import pytest
from test_gyro_bandwidth import QUIET, SHORT, found, reduced

from gyrobench.result import Result


@pytest.fixture(scope="module")
def wrong() -> Result:
    """A reading 1 % too large and 0.2 ms late."""
    return reduced("gyro_vibratory", {**SHORT, **QUIET, "table.read_gain": 0.01, "table.read_lag": 2e-4, "u_gain": 0.01,
                                      "u_lag": 2e-4})  # fmt: skip


@pytest.mark.long
def test_set_up_errors_do_what_is_predicted(wrong: Result) -> None:
    c = found(wrong)
    assert c["K"].estimate == pytest.approx(1.0 / 1.01, rel=1e-3)
    assert c["delay"].estimate == pytest.approx(c["delay"].truth - 0.2, abs=0.01)  # ms
    rows = {r[0]: r for r in next(t for t in wrong.tables if t.id == "budget.predicted").rows}
    assert rows["K"][3] == pytest.approx(-0.01, rel=0.02)
    assert rows["delay"][3] == pytest.approx(-0.2, rel=0.02)
    assert rows["f_90"][3] == pytest.approx(c["f_90"].estimate - c["f_90"].truth, rel=0.15)


@pytest.mark.long
def test_stated_uncertainties_are_in_u(wrong: Result) -> None:
    c = found(wrong)
    assert c["K"].u == pytest.approx(0.01, rel=0.05) and c["delay"].u == pytest.approx(0.2, rel=0.05)
    assert {b.id for b in wrong.budget} == {"table.reading.gain", "table.reading.lag"}
    assert abs(c["K"].z) < 1.1 and abs(c["delay"].z) < 1.1


@pytest.mark.long
def test_what_is_not_stated_of_the_reading_is_in_the_figures(wrong: Result) -> None:
    """They are those of gyro and reading together, K over 1.01 and the delay less 0.2 ms, as their meaning says."""
    stated, c = found(wrong), found(reduced("gyro_vibratory", {**SHORT, **QUIET, "table.read_gain": 0.01,
                                                               "table.read_lag": 2e-4}))  # fmt: skip
    shared = {"K": stated["K"].truth / 1.01, "delay": stated["delay"].truth - 0.2, "f_90": None}
    for name, coefficient in c.items():
        assert coefficient.meaning.endswith("instrument and table reading together") is (name in shared), name
        assert not stated[name].meaning.endswith("together")
    assert all(c[n].truth == pytest.approx(x, rel=1e-9) for n, x in shared.items() if x)
    assert c["f_90"].truth > stated["f_90"].truth and all(abs(c[n].z) < 4.0 for n in ("K", "delay", "f_90"))
