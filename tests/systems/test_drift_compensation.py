"""Compensation of random drift: figures of the method, consistency, mismatches, refusals.  [COMP-RANDOM-DRIFT]"""

from __future__ import annotations

import importlib
import math
from typing import Any, ClassVar

import numpy as np
import pytest

from gyrobench.engine.session import run
from gyrobench.record.record import Record
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import InvalidConfigurationError, Slot, System, load_system

NAME = "drift_compensation"
DPH = ARCSEC = math.pi / 648000.0
H = 10.0


def made(seed: int = 1, **values: Any) -> Any:
    """Options; a parameter of a part as table__k_error."""
    system = load_system(NAME)
    given = {k.replace("__", "."): v for k, v in values.items()}
    record = run(system, values=given, seed=seed)
    return record, system.reduce(record)


@pytest.fixture(scope="module")
def with_angle() -> Any:
    return made(records=60)


@pytest.fixture(scope="module")
def rate_only() -> Any:
    return made(records=60, T_c=0.0)


def closed_form() -> Any:
    system = load_system(NAME)
    return importlib.import_module(".closed_form", type(system).__module__)


def test_figures_of_the_method() -> None:
    """After 6 h: 114 arcsec, 2.45 with u = M (1.75 after 3 h), 0.24 with T_c = 300 s; 0.00194 deg/h."""
    c = closed_form()
    m = c.CompensatedDrift(0.01 * DPH, 3600.0, 1.0, 0.2 * ARCSEC)
    rate, both = (c.expected(m, m, H, 2160, T_c) for T_c in (0.0, 300.0))
    assert rate.free[-1] / ARCSEC == pytest.approx(114.0, abs=0.5)
    assert rate.angle[-1] / ARCSEC == pytest.approx(2.45, abs=0.1)
    assert rate.angle[1080] / ARCSEC == pytest.approx(1.75, abs=0.1)
    assert both.angle[-1] / ARCSEC == pytest.approx(0.24, abs=0.01)
    assert rate.rate[-1] / DPH == pytest.approx(0.00195, abs=2e-5)
    assert both.error[-1] == pytest.approx(both.stated[-1], rel=1e-9)


@pytest.mark.long
def test_the_figures_come_out_of_the_co_simulation(with_angle: Any, rate_only: Any) -> None:
    for result, low, high in ((with_angle[1], 0.2, 0.28), (rate_only[1], 2.0, 2.9)):
        for c in result.coefficients:
            if c.closed is not None:
                assert abs(c.estimate - c.closed) < 4.0 * c.u, c.name
        assert low < result["angle"].estimate < high
        assert 90.0 < result["angle free"].estimate < 140.0
        assert result["error"].estimate == pytest.approx(0.00195, rel=0.03)
    assert with_angle[1]["angle"].estimate < 0.2 * rate_only[1]["angle"].estimate
    # the same drift in both runs: its figure without compensation is the same
    assert with_angle[1]["angle free"].estimate == rate_only[1]["angle free"].estimate


def test_consistent_with_and_without_the_angle(with_angle: Any, rate_only: Any) -> None:
    """NEES 3, NIS 1, intervals from the scatter of the records."""
    for _, result in (with_angle, rate_only):
        for name, truth in (("NEES", 3.0), ("NIS", 1.0)):
            c = result[name]
            assert abs(c.estimate - truth) < 4.0 * c.u and c.u < 0.02 * truth
        assert not [t for t in result.tests if "inconsistent" in t.finding]
        assert result.warnings == []


def test_prediction_without_the_torquer_is_out_by_hundreds() -> None:
    """ER40: the filter of (6-31), printed without u, in a loop of its own: NEES about 980 instead of 3."""
    c = closed_form()
    Phi, Q, B = c.CompensatedDrift(0.01, 3600.0, 1.0, 0.2).sampled(H)  # deg/h is arcsec/s: arcsec
    rng, n = np.random.default_rng(15), 200
    L = np.linalg.cholesky(Q + 1e-18 * np.eye(3))
    found = []
    for told in (1.0, 0.0):
        x, e = np.zeros((n, 3)), np.zeros((n, 3))
        x[:, 0] = 0.01 * rng.normal(size=n)
        P, u = np.diag([1e-4, 1e-12, 1e-12]), np.zeros(n)
        for _ in range(2160):
            x = x @ Phi.T + np.outer(u, B) + rng.normal(size=(n, 3)) @ L.T
            e, P = e @ Phi.T + told * np.outer(u, B), Phi @ P @ Phi.T + Q
            K = P[:, 2] / (P[2, 2] + 0.04)
            e = e + np.outer(x[:, 2] + 0.2 * rng.normal(size=n) - e[:, 2], K)
            A = np.eye(3) - np.outer(K, [0.0, 0.0, 1.0])
            P = A @ P @ A.T + 0.04 * np.outer(K, K)
            u = e[:, 0]
        d = x - e
        found.append(float(np.mean(np.einsum("ni,ni->n", d, np.linalg.solve(P, d.T).T))))
    assert 2.4 < found[0] < 3.6
    assert 800.0 < found[1] < 1200.0


def test_what_the_filter_believes_wrongly_is_said_and_computed() -> None:
    """A torquer 30 % off and a servo lag ten times the believed one: closed forms follow, NEES or NIS does not hold."""
    _, result = made(records=30, table__k_error=0.3, table__lag=10.0)
    for name in ("angle", "rate"):
        c = result[name]
        assert abs(c.estimate - c.closed) < 4.0 * c.u
    assert any("NEES" in w and "model of drift, table or torquer" in w for w in result.warnings)


def test_torquer_at_its_limit_is_said() -> None:
    _, result = made(records=10, compensator__u_max="0.008deg/h")
    assert any("at its limit in" in w for w in result.warnings)
    assert result["torquer"].estimate < 0.008


def test_step_does_not_change_the_figures() -> None:
    """Half the communication step, readings every 10 s still: statistics within their u."""
    system = load_system(NAME)
    system.step = 5.0
    record = run(system, values={"records": 30}, seed=3)
    result = system.reduce(record)
    assert abs(result["NEES"].estimate - 3.0) < 4.0 * result["NEES"].u
    assert abs(result["angle"].estimate - result["angle"].closed) < 4.0 * result["angle"].u


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"length": 21605.0}, "must be a whole multiple of Ts = 10 s"),
        ({"length": 900.0}, "at least 100 readings"),
        ({"tau": 0.0}, "tau = 0: must be > 0"),
        ({"Ts": 15.0, "length": 21600.0}, "Ts = 15 s: must be a whole multiple of the step"),
    ],
)
def test_refused(values: dict[str, float], words: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=words):
        run(load_system(NAME), values=values)


def test_short_records_are_warned_of_and_a_record_of_two_is_refused(with_angle: Any) -> None:
    system = load_system(NAME)
    assert "shorter than three correlation times" in system.with_values({"length": 7200.0}).warnings()[0]
    record, _ = with_angle
    kept = np.asarray(record.channels["time"]) < 2.5 * 21600.0
    short = Record(channels={n: np.asarray(x)[kept] for n, x in record.channels.items()}, run=record.run)
    with pytest.raises(ReductionError, match="2 whole records"):
        system.reduce(short)


class FloatOnServoTable(System):
    """A floated gyro that nulls its own table, the compensator on its torquer: no quick form of either."""

    title = "Compensation of a floated gyro on its servo table"
    slots: ClassVar[dict[str, Slot]] = {
        "table": Slot("ServoTable", "table_servo"),
        "gyro": Slot("SdfGyro", "floated_gyro"),
        "compensator": Slot(type(load_system(NAME)).slots["compensator"].socket, "drift_compensator"),
    }
    wires = """
        table -> gyro: omega alpha f
        gyro.u -> table.u
        table.angle_read -> compensator.z
        compensator.i -> gyro.i
    """
    raw: ClassVar[dict[str, float]] = {
        "table.mode": 3.0,
        **{f"table.face[{i},{j}]": float((i, j) in ((1, 3), (2, 1), (3, 2))) for i in (1, 2, 3) for j in (1, 2, 3)},
    }
    channels = ("table.angle", "gyro.drift", "compensator.estimate", "compensator.u")
    step = 5e-4
    stop = 300.0

    def parameters(self, parts: Any) -> dict[str, Any]:
        gyro = {"H": 0.04, "J": 3e-5, "C": 0.03, "K_sg": 10.0}
        off = ("white", "pickoff", "D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS")
        silent = dict.fromkeys(off, 0.0)
        table = dict(zip(("H_g", "J_g", "C_g", "K_g"), gyro.values(), strict=True))
        believed = {"Ts": 1.0, "tau": 100.0, "rms": 10.0 * DPH, "sigma": 0.06 * ARCSEC, "lag": 0.05, "T_c": 10.0}
        return {
            **{f"gyro.{n}": x for n, x in {**gyro, **silent, "markov": 10.0 * DPH, "markov_tau": 100.0}.items()},
            **{f"table.{n}": x for n, x in {**table, "capture": 0, "quantum": 0.2 * ARCSEC}.items()},
            **{f"compensator.{n}": x for n, x in {**believed, "u_max": 100.0 * DPH, "k": parts["gyro.k"]}.items()},
        }


@pytest.mark.long
def test_a_floated_gyro_on_its_servo_table_is_compensated() -> None:
    """Sign and size of the current hold for the real loop: rate and angle are those of the closed form."""
    found = {}
    for name, limit in (("with", 100.0 * DPH), ("without", 1e-6 * DPH)):
        system = FloatOnServoTable()
        system.set("compensator.u_max", limit)
        c = run(system, seed=3).channels
        late = np.asarray(c["time"]) > 60.0
        found[name] = {n: np.asarray(x)[late] for n, x in c.items()}
    m = closed_form().CompensatedDrift(10.0 * DPH, 100.0, 0.05, 0.06 * ARCSEC)
    expected = closed_form().expected(m, m, 1.0, 300, 10.0)
    rms = lambda x: float(np.sqrt(np.mean(np.square(x))))  # noqa: E731
    assert np.array_equal(found["with"]["gyro.drift"], found["without"]["gyro.drift"])
    assert rms(found["without"]["table.angle"]) > 100.0 * rms(found["with"]["table.angle"])
    assert rms(found["with"]["table.angle"]) == pytest.approx(expected.angle[-1], rel=0.3)
    left = found["with"]["gyro.drift"] - found["with"]["compensator.u"]
    assert rms(left) == pytest.approx(expected.rate[-1], rel=0.3)
