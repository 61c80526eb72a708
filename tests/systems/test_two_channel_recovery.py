"""Two-channel tumble: random gyros at random latitudes through the whole dynamic co-simulation"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from two_channels import DPH, LOOP, NAME, NAMES, RATE, SHORT, gyro, latitude, load, quasi_static, quiet

from gyrobench.engine.session import Session, run
from gyrobench.record.record import Record
from gyrobench.result import Result

LIMIT = 1e-6  # deg/h per g^n


@pytest.fixture(scope="module")
def ran(session: Session) -> Callable[..., Record]:
    """Runs, each once: values and seed -> record."""
    made: dict[str, Record] = {}

    def run(values: dict[str, Any], seed: int = 1) -> Record:
        key = repr((sorted(values.items()), seed))
        if key not in made:
            made[key] = session.run(values, seed=seed)
        return made[key]

    return run


def stating(record: Record, **options: float) -> Record:
    """The record of a run in which these are stated."""
    return Record(record.windows, {}, record.run.replace(options={**record.run.options, **options}))


def errors(result: Result, values: dict[str, Any]) -> dict[str, float]:
    """Estimate minus truth, deg/h per g^n."""
    return {c.name: c.estimate - values[f"gyro.{c.name}"] / DPH for c in result.coefficients}


@pytest.mark.parametrize("model", ["simple", "nine"])
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.long
def test_random_gyros_at_random_latitudes(session: Session, model: str, seed: int) -> None:
    """Every error is below 1e-6 deg/h, and is that of the loops' lag as worked out in two_channels.quasi_static."""
    rng = np.random.default_rng(seed)
    values = {**SHORT, **quiet(load()), **gyro(rng, model), "latitude": latitude(rng), "model": model}
    record = session.run(values)
    system = load().with_values(values)
    result: Result = system.reduce(record)
    found = errors(result, values)
    predicted = errors(system.reduce(quasi_static(record, values, lag=True)), values)
    ideal = errors(system.reduce(quasi_static(record, values, lag=False)), values)
    assert sorted(found) == sorted(NAMES[model])
    largest = max(abs(v) for v in predicted.values())
    for c in result.coefficients:
        assert abs(found[c.name]) < LIMIT, c.name
        assert abs(ideal[c.name]) < 1e-9
        assert found[c.name] == pytest.approx(predicted[c.name], abs=0.1 * largest), c.name
        assert c.closed == pytest.approx(c.estimate, abs=LIMIT)
        assert c.truth == pytest.approx(values[f"gyro.{c.name}"] / DPH, rel=1e-12)


def test_lag_of_the_unbalance_by_hand(session: Session) -> None:
    """Simple model, turning at -n against the Earth: w_x = -Dx_x gamma c cos theta, w_y = -Dy_y gamma c sin theta in
    mount 1.  With 1/b = 1e-3 s2 the currents read Dx_x too large by n (n Dx_x + omega_z Dy_y)/b, and omega_z = W - n in
    mount 1, n - W in mount 2, where w_y is reversed too: n2 (Dx_x - Dy_y)/b.
    """
    rng = np.random.default_rng(50)
    values = {**SHORT, **quiet(load()), **gyro(rng, "simple"), "model": "simple"}
    found = errors(load().with_values(values).reduce(session.run(values)), values)
    x, y = (values[f"gyro.{n}"] / DPH for n in ("Dx_x", "Dy_y"))
    size = LOOP * RATE**2
    small = 0.01 * size * (abs(x) + abs(y))  # W beside n, and scale factors that are not 17.2 deg/h/mA
    assert found["Dx_x"] == pytest.approx(size * (x - y), abs=small)
    assert found["Dy_y"] == pytest.approx(size * (y - x), abs=small)
    assert abs(found["Dx_0"]) < 1e-9 and abs(found["Dy_z"]) < 1e-9


@pytest.mark.long
def test_both_senses_several_turns_and_tilt(session: Session) -> None:
    rng = np.random.default_rng(20)
    values = {**SHORT, **quiet(load()), **gyro(rng), "latitude": latitude(rng)}
    values |= {"turns": 2, "both_senses": True, "tilt": True}
    angle = 2e-5
    values["gyro.mount"] = [[1.0, 0.0, angle], [0.0, 1.0, 0.0], [-angle, 0.0, 1.0]]  # x towards z
    result = load().with_values(values).reduce(session.run(values))
    for c in result.coefficients:
        if c.name.startswith("ε"):
            assert c.estimate == pytest.approx(np.degrees(angle) * 3600 if "xz" in c.name else 0.0, abs=1e-3)
        else:
            assert abs(c.estimate - c.truth) < 1e-4, c.name  # the tilted gyro's gravity: angle times the coefficients
    assert any("turn to turn" in t.name for t in result.tests)
    labels = [s.label for s in result.series]
    assert sum("with the Earth" in t for t in labels) == sum("against the Earth" in t for t in labels) == 4


@pytest.mark.long
def test_halving_the_step_and_engines(session: Session) -> None:
    """Half the step changes nothing that matters; both engines give the same record."""
    hasty = {
        "rate": 3.0,
        "windows": 6,
        "dwell": 0.6,
        "settle": 0.3,
        "table.acceleration": 20.0,
        "table.index_rate": 3.0,
    }
    hasty |= {"rebalance_x.i_max": 100.0, "rebalance_y.i_max": 100.0, "gyro.u_max": 100.0}
    native = run(NAME, values=hasty, seed=7, engine="native")
    assert native.same_data(run(NAME, values=hasty, seed=7, engine="reference"))
    values = {**SHORT, **quiet(load())}
    whole, half = (load().reduce(session.run(values, step=h)) for h in (1e-3, 5e-4))
    for a, b in zip(whole.coefficients, half.coefficients, strict=True):
        assert a.estimate == pytest.approx(b.estimate, abs=1e-7)


@pytest.mark.parametrize(("source", "option", "arcsec"), [
    ("table axis off the pole, about east", "u_axis", 60.0),
    ("table axis off the pole, about p × east", "u_axis", 60.0),
    ("gyro turned about its x axis", "u_mount", 1.0), ("gyro turned about its y axis", "u_mount", 1.0),
])  # fmt: skip
@pytest.mark.long
def test_set_up_errors_shift_as_the_budget_predicts(
    ran: Callable[..., Record], source: str, option: str, arcsec: float
) -> None:
    """Put into the parts, they move the coefficients, with sign, by what the budget names, within 10 %.  (A seed whose
    noise is taken for white with and without the error: else the weights change too, by less than 0.2 u.)
    """
    size = float(np.radians(arcsec / 3600.0))
    values = {**SHORT, "nuisances": "none"}  # the budget is of one model
    more: dict[str, Any] = {
        "table axis off the pole, about east": {"table.tilt[1]": size},
        "table axis off the pole, about p × east": {"table.tilt[2]": size},
        "gyro turned about its x axis": {"gyro.mount": [[1, 0, 0], [0, np.cos(size), np.sin(size)],
                                                        [0, -np.sin(size), np.cos(size)]]},
        "gyro turned about its y axis": {"gyro.mount": [[np.cos(size), 0, -np.sin(size)], [0, 1, 0],
                                                        [np.sin(size), 0, np.cos(size)]]},
    }[source]  # fmt: skip
    plain, off = (load().reduce(stating(ran({**values, **v}, 33), **{option: size})) for v in ({}, more))
    lines = {b.coefficient: b.sensitivity * size for b in plain.budget if b.source == source}
    largest = max(map(abs, lines.values()))
    assert largest > 4e-3  # W times 60 arcsec is 0.0044 deg/h, the table rate times 1 arcsec 0.015 deg/h
    for a, b in zip(plain.coefficients, off.coefficients, strict=True):
        shift = b.estimate - a.estimate
        assert shift == pytest.approx(lines.get(a.name, 0.0), rel=0.1, abs=0.05 * largest), a.name


@pytest.mark.parametrize(("order", "row"), [(1, 0), (1, 1), (2, 0), (2, 1)])
@pytest.mark.long
@pytest.mark.usefixtures("fewer_weights")
def test_encoder_harmonic_shifts_as_the_budget_predicts(ran: Callable[..., Record], order: int, row: int) -> None:
    """The table's angle read too large by E sin(n theta) or E cos(n theta): the coefficients move, with sign, by what
    the budget of the run without it says, to 10 % of the largest; a coefficient of 1 deg/h/g by some E times it.
    White noise of 3e-10 rad/s in a window keeps the weights as they are.
    """
    error = 1e-5
    values = {
        "nuisances": "none",
        **SHORT,
        **quiet(load()),
        **gyro(np.random.default_rng(4)),
        "gyro.white_x": 1e-9,
        "gyro.white_y": 1e-9,
    }
    wrong = {f"table.encoder_amplitude[{order}]": error, f"table.encoder_phase[{order}]": row * np.pi / 2.0}
    plain, off = (load().reduce(stating(ran({**values, **v}), **{f"u_angle{order}": error})) for v in ({}, wrong))
    source = f"angle error, {('once', 'twice')[order - 1]} a turn"
    told = np.sum([b.changes[row] for b in plain.type_b if source in b.source], axis=0)  # one for each channel
    shift = np.array([b.estimate - a.estimate for a, b in zip(plain.coefficients, off.coefficients, strict=True)])
    assert 0.1 * error < np.max(np.abs(told)) < 10.0 * error
    assert np.max(np.abs(shift - told)) < 0.1 * np.max(np.abs(told)), (shift, told)
