"""Position loop around a tachometer loop, and the RC network of the single loop: closed forms, by hand and measured."""

from __future__ import annotations

import importlib
import math
from typing import Any

import control
import numpy as np
import pytest
from gimballed import session as with_methods
from scipy.optimize import fsolve

from gyrobench.reduction.loops import margins
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "stabilizer_floated_2dof"
closed: Any = importlib.import_module(".closed", type(load_system(NAME)).__module__)
STILL = {f"gyro.{n}_{c}": 0.0 for n in ("turn_on", "markov", "white", "pickoff") for c in "xy"} | {
    f"gyro.D{c}_{k}": 0.0 for c in "xy" for k in ("0", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz")
}
RATE, POSITION = 2.0 * math.pi * 40.0, 2.0 * math.pi * 10.0
#: J 0.5: D = J RATE; K = J POSITION sqrt(POSITION2 + RATE2), |L| = 1 at POSITION
DEFAULT = {"J": 0.5, "D": 0.5 * RATE, "K": 0.5 * POSITION * math.hypot(POSITION, RATE)}


@pytest.fixture(scope="module")
def run() -> Any:
    """Load step and two sines of the base, without noise; and the linear models."""
    sines = [LoopPhase(f"{f} Hz", "motion", "sine", 1, 1e-3, f, settle=1.0, dwell=1.0) for f in (1.0, 5.0)]
    plan = LoopPlan([LoopPhase("load step", "torque", "step", 1, 1.0, settle=0.5, dwell=1.0), *sines])
    with with_methods(NAME, parts={"stabilizer": "stabilizer_double_loop"}, plan=lambda self: plan) as s:
        values = {**STILL, "loops": "double", "viscous": 0.0}
        record = s.run(values)
        yield s.prepare(values)[2].linear, record, s.system.reduce(record)


def test_closed_form_against_control() -> None:
    """Margins of K (1 + wi/s)/(s (J s + D)) by python-control, with and without integral; the slope by differences."""
    for integral in (0.0, 12.0):
        p = closed.DoubleLoop(**DEFAULT, integral=integral)
        num, den = ([p.K, p.K * integral], [p.J, p.D, 0.0, 0.0]) if integral else ([p.K], [p.J, p.D, 0.0])
        loop = control.tf(num, den)
        _, pm, _, w = control.margin(loop)
        assert p.margin() == pytest.approx((w, pm), rel=1e-6)
        ends = [20.0 * math.log10(abs(p.gain(1j * w * x))) for x in (0.999, 1.001)]
        assert p.slope(w) == pytest.approx((ends[1] - ends[0]) / math.log10(1.001 / 0.999), rel=1e-4)
        for share in (0.9, 1.1):
            q = closed.DoubleLoop(p.J, p.D, p.K, share * p.D / p.J)
            roots = np.roots([q.J, q.D, q.K, q.K * q.integral])
            assert q.stable() == bool(np.max(roots.real) < 0.0) == (share < 1.0)


def test_gains_put_the_crossovers_where_asked() -> None:
    for integral in (0.0, 8.0):
        K_p, K_v = closed.double_gains(0.5, 0.1, 10.0, RATE, POSITION, integral)
        assert 0.1 * K_v / 0.5 == pytest.approx(RATE)  # |k K_v / (J s)| = 1
        p = closed.DoubleLoop(0.5, 0.1 * K_v, 0.1 * K_v * K_p * 10.0, integral)
        assert abs(p.gain(1j * POSITION)) == pytest.approx(1.0, rel=1e-12)


def test_the_loop_of_the_parts_is_the_closed_form(run: Any) -> None:
    f = np.array([0.5, 2.0, 10.0, 40.0])
    found = margins.model_response(run[0].loops["stabilizer"].continuous, f)[:, 0, 0]
    np.testing.assert_allclose(found, closed.DoubleLoop(**DEFAULT).gain(2j * np.pi * f), rtol=1e-6)


def test_load_and_base_in_the_co_simulation(run: Any) -> None:
    """theta* = M/K; the base comes through the tachometer, D s/(J s2 + D s + K)."""
    result = run[2]
    c = {c.name: c for c in result.coefficients}
    assert c["S"].closed == pytest.approx(DEFAULT["K"]) and c["S"].estimate == pytest.approx(DEFAULT["K"], rel=2e-3)
    ratio = next(r for r in result.responses if r.name == "isolation")
    wanted = np.abs(closed.DoubleLoop(**DEFAULT).isolation(2j * np.pi * np.array(ratio.x), 0.0))
    np.testing.assert_allclose(ratio.y, wanted, rtol=5e-3)
    assert np.all(np.array(ratio.y) > 0.05)  # the network alone, without friction, lets nothing through


def test_rc_network_by_the_divider() -> None:
    """The default times are a passive network; its response is that of the divider Z2/(Z1 + Z2), and back again."""
    times = (0.2, 2.0, 0.03, 0.003)
    R1, C1, R2 = closed.rc_values(*times, 1e-5)
    assert pytest.approx((177.3e3, 0.03 / 177.3e3, 20e3)) == (R1, C1, R2)  # R1 C2 = 2.003 - 0.23 s, R2 C2 = 0.2 s
    s = 2j * np.pi * np.geomspace(0.01, 100.0, 30)
    z1, z2 = R1 / (1.0 + R1 * C1 * s), R2 + 1.0 / (1e-5 * s)
    wanted = (1.0 + times[0] * s) * (1.0 + times[2] * s) / (1.0 + times[1] * s) / (1.0 + times[3] * s)
    np.testing.assert_allclose(z2 / (z1 + z2), wanted, rtol=1e-9)
    assert closed.rc_times(R1, C1, R2, 1e-5) == pytest.approx(times, rel=1e-9)
    assert closed.rc_values(0.2, 2.0, 0.03, 0.004, 1e-5) is None  # T1 T2 is not tau1 tau2: no passive one


def test_rc_values_set_the_loop() -> None:
    """R1 100 kOhm, C1 0.2 uF, R2 10 kOhm, C2 10 uF: T1, T2 are the roots of x2 - (0.1 + 0.02 + 1) x + 0.002."""
    system = load_system(NAME).with_values({"R1": "100kOhm", "C1": "0.2uF", "R2": "10kOhm", "C2": "10uF"})
    times = system.times()
    small, large = np.sort(fsolve(lambda x: x * x - 1.12 * x + 0.002, [0.0, 1.0]))
    assert [times[n] for n in ("tau1", "T1", "tau2", "T2")] == pytest.approx([0.1, large, 0.02, small], rel=1e-6)


def test_the_table_of_the_network_in_the_report() -> None:
    sine = LoopPhase("10 Hz", "test", "sine", 1, 1e-3, 10.0, settle=1.0, dwell=0.5)
    with with_methods(NAME, plan=lambda self: LoopPlan([sine])) as s:
        table = next(t for t in s.system.reduce(s.run(STILL)).tables if t.kind == "loop.rc")
    assert [row[1] for row in table.rows] == pytest.approx([177.3, 0.16920, 20.0, 10.0], rel=1e-4)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"R1": 1e3}, "R1: an RC network has R1, C1, R2, C2"),
        ({"loops": "triple"}, "loops = triple: must be one of single, double"),
        ({"position_loop": 50.0}, "must be slower than rate_loop"),
        ({"integral": 11.0}, "must be below position_loop"),
    ],
)
def test_refuses(values: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=says):
        load_system(NAME).with_values(values).refuse()


def test_a_part_with_a_tachometer_takes_the_double_loop() -> None:
    system = load_system(NAME)
    system.place("stabilizer", "stabilizer_double_loop")
    assert system["loops"] == "double" and system.crossovers() == {"stabilizer": 10.0}


@pytest.mark.long
def test_noise_is_in_the_largest_angle() -> None:
    """Four runs with noise beside one without: the pickoff moves the platform slowly, within the loop's bandwidth."""
    hold = LoopPhase("drift", "hold", settle=0.5, dwell=4.0)
    plan = LoopPlan([LoopPhase("load step", "torque", "step", 1, 1.0, settle=0.5, dwell=1.0), hold])
    with with_methods(NAME, parts={"stabilizer": "stabilizer_double_loop"}, plan=lambda self: plan) as s:

        def largest(values: dict[str, float], seed: int = 0) -> Any:
            result = s.system.reduce(s.run({"loops": "double", **values}, seed=seed))
            return next(c for c in result.coefficients if c.name == "θ_max")

        still = largest({n: 0.0 for n in STILL if ".D" not in n}).estimate
        z = [(c.estimate - still) / c.u for c in (largest({}, seed) for seed in range(4))]
    assert max(map(abs, z)) < 4.0 and math.hypot(*z) > 0.2
