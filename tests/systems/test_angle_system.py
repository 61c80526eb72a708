"""The angle system test: random readers in co-simulation, both ways of separation, lags, slips, readouts, refusals."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gyrobench.engine.session import Session
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.system.system import System, load_system
from systems.angle_system_test.reduction import Reduction

NAME = "angle_system_test"
ARCSEC = math.pi / 648000.0
ERU = 7.2921159e-5


def measured(session: Session, values: dict[str, Any]) -> Any:
    return load_system(NAME).with_values(values).reduce(session.run(values))


def random_system(seed: int) -> dict[str, Any]:
    """Random scales, loops, excitation and clocks, method and rates of the default plan."""
    rng = np.random.default_rng(seed)
    values: dict[str, Any] = {"method": str(rng.choice(["two_heads", "reversal"]))}
    for slot in ("reader", "reference"):
        for name in ("eccentricity", "tilt", "pitch", "interpolation"):
            values[f"{slot}.encoder_{name}"] = float(10.0 ** rng.uniform(-1.3, 0.3)) * ARCSEC
            values[f"{slot}.encoder_{name}_phase"] = float(rng.uniform(-math.pi, math.pi))
        for name in ("d0", "de", "e3", "e5"):
            values[f"{slot}.encoder_{name}"] = float(rng.normal(0.0, 0.2)) * ARCSEC * 360.0
    values["reader.loop_type"] = int(rng.integers(0, 3))
    values["reader.loop_K_v"] = float(10.0 ** rng.uniform(2.5, 3.5))
    values["reader.phases"] = int(rng.integers(1, 3))
    values["reader.shifter_slope"] = float(rng.uniform(0.0, 1.5))
    values["gate.clock"], values["inverse.clock"] = (float(x) for x in rng.normal(0.0, 5e-6, 2))
    return values


def covered(runs: int, first: int = 0) -> dict[str, float]:
    """Return the share of runs whose 95 % interval contains the true value, by kind of coefficient, of 1."""
    inside: dict[str, list[bool]] = {}
    with Session(NAME) as session:
        for k in range(first, first + runs):
            values = random_system(k)
            result = load_system(NAME).with_values(values).reduce(session.run(values, seed=k))
            for c in result.coefficients:
                if c.truth is not None:
                    kind = c.name if not c.name.startswith(("cos", "sin", "ref")) else c.name.split("_")[0]
                    inside.setdefault(kind, []).append(c.interval[0] <= c.truth <= c.interval[1])
    return {kind: float(np.mean(v)) for kind, v in inside.items()}


# ---------------------------------------------------------------------------------------------- reduction
class Ideal:
    """Windows made from the equations of a reading, without a part: rounding off, errors of order 1, 2 and 720."""

    head = math.radians(50.1)

    def __init__(self, **changes: float) -> None:
        self.delay, self.ripple, self.clock = 1.6e-3, 3e-5, 2e-5
        self.slip_at: tuple[int, ...] = ()
        self.__dict__.update(changes)

    def own(self, t: Any) -> Any:
        return (3.0 * np.sin(t + 0.4) - 0.7 * np.cos(2 * t) + 0.2 * np.sin(720 * t) - 0.1 * np.cos(360 * t)) * ARCSEC

    def other(self, t: Any) -> Any:
        return (1.1 * np.cos(t) + 0.5 * np.sin(12 * t)) * ARCSEC

    def windows(self, system: System) -> dict[str, Any]:
        """Readings at the positions of the plan and at its rates; a gate of 1 s and a degree read before each."""
        columns: dict[str, list[float]] = {}
        now = 0.0
        for k, p in enumerate(system.plan().phases, 1):
            rate = p.target if p.mode == "rate" else 0.0
            turns = np.arange(1, round(p.travel / p.window)) * p.window if rate else np.array([0.0])
            for j, turned in enumerate(turns):
                theta = math.copysign(turned, rate) if rate else p.target
                t = now + turned / abs(rate) if rate else now
                lag = rate * self.delay - rate * self.ripple * math.cos(720 * theta)
                row = {"phase": k, "t_start": t + 0.01, "t_end": t + 0.02, "reference": theta + self.other(theta) + 0.3}
                row["reading"] = theta + self.own(theta) - lag + (j in self.slip_at) * math.radians(0.5)
                row["reading_2"] = theta + self.own(theta + self.head) - lag
                row |= dict.fromkeys(("t_reading", "t_reference"), t)
                for name, length in (("gate", 1.0), ("inverse", math.radians(1.0) / max(abs(rate), 1e-9))):
                    start = theta - rate * length
                    counted = rate * length + self.own(theta) - self.own(start)
                    counted += rate * self.ripple * (math.cos(720 * theta) - math.cos(720 * start))
                    if name == "inverse":  # the time of an exact degree: longer where less is read
                        length *= 1.0 + (rate * length - counted) / (rate * length) if rate else 1.0
                        counted = math.copysign(math.radians(1.0), rate)
                    row |= {f"{name}_number": 2.0 * (j + 1), f"{name}_start": t - length, f"{name}_end": t}
                    row[f"{name}_rate"] = counted / length / (1.0 + self.clock) if rate else 0.0
                for name, x in row.items():
                    columns.setdefault(name, []).append(float(x))
            now = columns["t_end"][-1] + 1.0
        return {name: np.array(v) for name, v in columns.items()}


@pytest.fixture(scope="module")
def document(session: Session) -> Any:
    """The run.json of a run, whose plan and options the ideal readings follow."""
    return session.run({}).run


def reduce(windows: Any, run: Any) -> Any:
    return Reduction.reduce(windows, Reduction.setup_of(run))


@pytest.mark.long
def test_ideal_readings_return_the_harmonics(document: Any) -> None:
    """Orders by hand: 3" sin(t + 0.4) is 3 sin 0.4 in the cosine, 3 cos 0.4 in the sine."""
    result = reduce(Ideal().windows(load_system(NAME)), document)
    expected = {
        "cos_1": 3.0 * math.sin(0.4), "sin_1": 3.0 * math.cos(0.4), "cos_2": -0.7, "sin_2": 0.0, "sin_720": 0.2,
        "cos_360": -0.1, "cos_720": 0.0, "sin_1440": 0.0, "ref_cos_1": 1.1, "ref_sin_1": 0.0, "ref_sin_12": 0.5,
        "delay": 1600.0, "ripple": 30.0, "clock_gate": 20.0, "clock_inverse": 20.0, "head": 0.0,
    }  # fmt: skip
    for name, value in expected.items():
        # the angle of a wave is that of the reference, whose error of 1 arcsec is 3.5e-3 rad of order 720
        near = 2e-3 if name[:3] in ("cos", "sin", "ref") else 0.02
        assert result[name].estimate == pytest.approx(value, abs=near), name
    # the constant of the reference's 0.3 rad
    assert result["zero"].estimate == pytest.approx(-0.3 / ARCSEC, abs=2e-3)


def test_a_reading_off_by_a_cycle_is_named_and_taken_out(document: Any) -> None:
    system = load_system(NAME)
    clean = reduce(Ideal().windows(system), document)
    result = reduce(Ideal(slip_at=(5,)).windows(system), document)
    table = next(t for t in result.tables if t.id == "readings.slipped")
    assert [(n, at) for _, n, at in table.rows] == [(1, "a rate")] * 6  # the sixth reading at each of six rates
    assert any("6 readings are off by whole fine cycles of 0.5°" in w for w in result.warnings)
    assert result["sin_1"].estimate == pytest.approx(clean["sin_1"].estimate, abs=2e-3)
    assert "clock_gate" not in result.names


def test_a_wrong_rate_of_the_table_is_in_the_budget(session: Session) -> None:
    """A table that is faster by 1e-5 than known makes both clocks look slow by that: the budget says so, with sign."""
    record = session.run({"u_rate": 1e-5})
    result = reduce(record.windows, record.run)
    slower = [
        p.model_copy(update={"target": p.target / (1 + 1e-5)}) if p.mode == "rate" else p for p in record.run.plan
    ]
    moved = reduce(record.windows, record.run.model_copy(update={"plan": slower}))
    lines = {b.coefficient: b for b in result.budget if b.id == "table.rate"}
    for name in ("clock_gate", "clock_inverse"):
        assert moved[name].estimate - result[name].estimate == pytest.approx(-10.0, rel=1e-2)
        assert lines[name].sensitivity == pytest.approx(-1e6, rel=1e-6)  # in 1e-6, for a relative error of 1
        assert lines[name].contribution == pytest.approx(10.0, rel=1e-6)


# ------------------------------------------------------------------------------------------ co-simulation
@pytest.fixture(scope="module")
def runs(session: Session) -> list[Any]:
    return [measured(session, random_system(k)) for k in range(12)]


@pytest.mark.long
def test_random_systems_come_back(runs: list[Any]) -> None:
    """All coefficients with a true value, two heads and reversal: z of rms about 1, none far off."""
    z = np.concatenate([[c.z for c in r.coefficients if c.z is not None] for r in runs])
    assert z.size > 300 and 0.85 < math.sqrt(np.mean(z**2)) < 1.15 and np.abs(z).max() < 4.2
    u = [r["sin_1"].u for r in runs]
    assert max(u) < 0.04  # a fifth of a count
    inside = np.mean(
        [c.interval[0] <= c.truth <= c.interval[1] for r in runs for c in r.coefficients if c.z is not None]
    )
    assert 0.92 < inside < 0.98


@pytest.mark.long
def test_each_rate_is_read_within_its_u(runs: list[Any]) -> None:
    """Deviation of gates and degrees from the rate of the table: that of the clock drawn, within 4 u each."""
    for k, result in enumerate(runs):
        table = next(t for t in result.tables if t.id == "rate_readouts")
        assert len(table.rows) == 12  # two readouts, three rates, both ways
        drawn = {"gates": random_system(k)["gate.clock"], "degrees": random_system(k)["inverse.clock"]}
        for readout, rate, deviation, u, in_eru in table.rows:
            assert abs(deviation + drawn[readout] * 1e6) < 4.0 * u
            assert in_eru == pytest.approx(u * 1e-6 * abs(rate), rel=1e-9)


def test_lag_of_type_1_against_type_2(session: Session) -> None:
    """K_v = 2 pi 100 1/s: 1/K_v = 1591.55 us; type 2 none."""
    one = measured(session, {"reader.loop_type": 1})["delay"]
    two = measured(session, {"reader.loop_type": 2})["delay"]
    assert one.estimate == pytest.approx(1e6 / (200 * math.pi), abs=3 * one.u) and one.u < 1.0
    assert abs(two.estimate) < 3 * two.u


@pytest.mark.long
def test_stamps_at_the_second_crossing_are_a_quarter_period_late(session: Session) -> None:
    """Half a period at most, all fine angles alike: T_0/4 = 104.17 us at 2.4 kHz; in the middle none."""
    late = measured(session, {"reader.mode": 0, "reader.stamp": 0})["delay"]
    right = measured(session, {"reader.mode": 0})["delay"]
    assert late.estimate == pytest.approx(104.17, abs=8.0)
    assert abs(right.estimate) < 3 * right.u < 3.0


def test_one_phase_excitation_lags_and_ripples(session: Session) -> None:
    """s/(2 w) = 1/(4 pi 2400) = 33.157 us both, as the mean and the amplitude of 5-57."""
    result = measured(session, {"reader.phases": 1, "reader.mode": 0})
    for name in ("delay", "ripple"):
        assert result[name].estimate == pytest.approx(33.157, abs=3.5 * result[name].u) and result[name].u < 1.5


def test_coarse_errors_within_the_limit_never_slip_and_beyond_it_are_named(session: Session) -> None:
    good = measured(session, {"reader.mode": 0, "reader.coarse_zero": math.radians(0.199)})
    assert good.summary[-1] == "No reading is off by a fine cycle."
    bad = measured(session, {"reader.mode": 0, "reader.coarse_zero": math.radians(0.215)})
    table = next(t for t in bad.tables if t.id == "readings.slipped")
    n = sum(len(s.x) for s in bad.series) - 83  # a position has two rows
    assert 0.06 < len(table.rows) / n < 0.25  # 0.15 of all angles, 0.015 deg of each 0.1 deg
    assert all(abs(row[1]) == 1 for row in table.rows)
    assert abs(bad["sin_1"].z) < 4.0  # and the calibration stands
    limits = {"sin_1": (-10.0, 10.0)}
    assert conclude(good, None, limits).verdict == "pass"
    assert conclude(bad, None, limits).verdict == "inconclusive" and "ambiguous" in bad.withheld[-1]


def test_a_diametral_head_separates_odd_orders_only(session: Session) -> None:
    result = measured(session, {"head": math.pi})
    assert [n for n in result.names if n.startswith(("cos", "sin"))] == ["cos_1", "sin_1"]
    assert abs(result["ref_sin_2 - sin_2"].z) < 4.0
    assert any("Not estimable for the reader: order 2, 12, 360, 720, 1440." in w for w in result.warnings)


# ---------------------------------------------------------------------------------------------- refusals
@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"method": "three_heads"}, "method = three_heads: two_heads or reversal"),
        ({"rates": "20 fast"}, "numbers of Earth rates"),
        ({"rates": "2000"}, "at most 1999.9 Earth rates"),
        ({"positions": 20}, "20 positions: at least 30"),
        ({"positions": 90, "rates": "1 2 3 4 5"}, "100 phases: at most 99"),
        ({"rates": "nan"}, "at most 1999.9 Earth rates"),
        ({"head": math.radians(5.0)}, "nearly the same eccentricity error"),
        ({"rates": "1999.9", "reader.rate_max": 0.13}, "1999.9 ERU exceed reader.rate_max = 0.13 rad/s"),
        ({"gate": 2.0}, "gate = 2 s must be 0.1, 1, 10, 100 or 1000 s"),
        ({"reader.f_T": 24.0005e6}, "whole number of counts"),
    ],
)
def test_refusals(session: Session, values: dict[str, Any], said: str) -> None:
    with pytest.raises(Exception, match=said):
        session.run(values)
