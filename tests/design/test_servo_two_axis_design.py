"""Design of the two-axis servo test: what is known of mounts without a run is what runs and their reduction have."""

from __future__ import annotations

import importlib
import math
from typing import Any

import numpy as np
import pytest

from gyrobench import frames
from gyrobench.design.plan_runs import last_time
from gyrobench.engine.session import Session
from gyrobench.reduction.estimation.fit_result import observed_fits
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "servo_two_axis"
ROOM = type(load_system(NAME)).__module__
design: Any = importlib.import_module(".design", ROOM)
#: a day in two hundred
FAST: dict[str, Any] = {
    "site.earth_rate": 200.0 * frames.EARTH_RATE, "time": 432.0, "window": 12.0, "settle": 2.0, "cage_x.i_max": 10.0,
    "cage_y.i_max": 10.0, "gyro.markov_tau": 1.5, "outer.index_rate": 0.5, "inner.index_rate": 0.5,
}  # fmt: skip


@pytest.fixture(scope="module")
def session() -> Any:
    with Session(load_system(NAME).with_values(FAST)) as opened:
        yield opened


@pytest.fixture(scope="module")
def made(session: Any) -> Any:
    """A run of the system's own plan: record, its fits, what a design knows."""
    record = session.run(FAST, 3)
    system = load_system(NAME).with_values(FAST)
    with observed_fits() as fits:
        system.reduce(record)
    return record, fits, design.TestModel.of(system, record)


@pytest.mark.long
def test_the_expected_path_has_the_rows_of_the_reduction(made: Any) -> None:
    """Regressors along the path of this gyro's drift, mount by mount, against those from the angles that were read."""
    _, fits, model = made
    expected = {m: model._path(m) for m in (2, 4)}
    half = fits[0][0].X.shape[0] // 2
    for j, c in enumerate("xy"):
        X = fits[j][0].X
        for rows, m in ((slice(0, half), 2), (slice(half, None), 4)):
            track = model.track(expected[m], 432.0)
            found = track.design(model.site, design.drift.terms_2dof(c, 9))
            assert np.abs(found - X[rows]).max() < 8e-3  # capture takes 0.4 s: 0.34 deg here, nothing in a day


@pytest.mark.long
def test_noise_of_the_readings_is_that_of_the_pickoffs(session: Any) -> None:
    """Pickoff noise alone, 5e-8 V/sqrt(Hz): scatter of 72 rates over what the covariance says of them."""
    values = {**FAST, "gyro.white_x": 0.0, "gyro.white_y": 0.0, "gyro.markov_x": 0.0, "gyro.markov_y": 0.0}
    record = session.run(values, 5)
    system = load_system(NAME).with_values(values)
    with observed_fits() as fits:
        system.reduce(record)
    model = design.TestModel.of(system, record)
    for c, (fit, _) in zip("xy", fits, strict=True):
        V = model.covariance(c, fit.t_start, fit.t_end, np.zeros_like(fit.t_start))
        scatter = math.sqrt(float(fit.est.residual @ fit.est.residual) / (72 - 9))
        assert scatter / math.sqrt(np.mean(np.diag(V))) == pytest.approx(1.0, abs=0.25)


@pytest.mark.long
def test_mounts_that_are_proposed_can_be_run_and_take_the_time_that_was_promised(
    session: Any, made: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For all coefficients in 500 s: the best pair, and several mounts for a short time each, which promise more."""
    monkeypatch.setattr(design, "TIMES", 16)
    record, _, model = made
    wanted = dict.fromkeys((n for c in "xy" for n in design.drift.terms_2dof(c, 9)), 1e-8)
    choices = model.proposals(wanted, 500.0, "A")
    assert len(choices) == design.PROPOSED
    pair, best = choices[:2]
    assert len(pair.label.split()) == 3 and len(best.label.split()) > 4 and best.least < best.start < 200.0
    values = {**FAST, **best.options(best.start)}
    system = load_system(NAME).with_values(values)
    system.refuse()
    again = session.run(values, 3)
    assert last_time(again) == pytest.approx(500.0, rel=0.03) and last_time(record) > 870.0
    with observed_fits() as fits:
        system.reduce(again)
    promised = model._merit(*_set_of(model, best), wanted, "A")[0]  # a trend of the drift is among the unknowns
    reached = []
    for c, (fit, _) in zip("xy", fits, strict=True):
        V = model.covariance(c, fit.t_start, fit.t_end, np.zeros_like(fit.t_start))
        X = np.column_stack([fit.X, (fit.t_start + fit.t_end) / 2.0 / model.day])
        reached += list(np.diag(np.linalg.inv(X.T @ np.linalg.solve(V, X)))[:9] / 1e-16)
    assert promised == pytest.approx(np.mean(reached), rel=0.05)


def _set_of(model: Any, choice: Any) -> tuple[Any, Any, Any]:
    mounts = [int(m) for m in choice.label.split()[1:]]
    known = [model._information(model._path(m), choice.start) if m in mounts else None for m in range(1, 13)]
    there = np.array([[m in mounts for m in range(1, 13)]])
    order = np.array([mounts.index(m) if m in mounts else 99.0 for m in range(1, 13)])
    return there, known, model._before(there, order, choice.start)


def test_the_time_in_which_the_table_settles_counts_towards_gimbal_lock() -> None:
    """Mount 12 reaches the lock (78.5 deg of inner angle) where the Earth has turned by 78.5 deg: 5.22 h."""
    system = load_system(NAME).with_values({"mounts": "12 1 2 4", "time": "5.1h", "window": "600s"})
    system.refuse()
    with pytest.raises(InvalidConfigurationError, match="mount 12: gimbal lock"):
        system.with_values({"settle": "20min"}).refuse()
