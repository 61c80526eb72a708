"""Two power gyros on one platform: polynomial and limit, coupling, loops in the co-simulation, refusals."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest
from gimballed import session as with_methods

from gyrobench.reduction.loops import margins
from gyrobench.system.loop_plan import LoopPhase, LoopPlan
from gyrobench.system.system import InvalidConfigurationError, load_system
from gyrobench.units import ARCSEC

NAME = "stabilizer_power_two_axis"
closed: Any = importlib.import_module(".closed", type(load_system(NAME)).__module__)
DEFAULT = {"H": 10.0, "J_x": 0.5, "J_y": 0.02, "C_x": 10.0, "C_y": 2.0, "K_m": 100.0}
STILL = {"platform.white": 0.0, "drift": 0.0}


def matrix(p: Any) -> Any:
    """The eight real states a, w, b, r of both axes with the motors -K_m c, written from the equations of the part."""
    A = np.zeros((8, 8))  # a_x, a_y, w_x, w_y, b_1, b_2, r_1, r_2
    A[0, 2] = A[1, 3] = A[4, 6] = A[5, 7] = 1.0
    c1, c2 = np.zeros(8), np.zeros(8)
    c1[[4, 1]], c2[[5, 0]] = [1.0, -1.0], [1.0, 1.0]
    d1, d2 = np.zeros(8), np.zeros(8)
    d1[[6, 3]], d2[[7, 2]] = [1.0, -1.0], [1.0, 1.0]
    unit = np.eye(8)
    A[2] = (-p.C_x * unit[2] - p.H * unit[6] - p.C_y * d2 - p.K_m * c1) / p.J_x
    A[3] = (-p.C_x * unit[3] - p.H * unit[7] + p.C_y * d1 - p.K_m * c2) / p.J_x
    A[6] = (p.H * unit[2] - p.C_y * d1) / p.J_y
    A[7] = (p.H * unit[3] - p.C_y * d2) / p.J_y
    return A


def test_the_complex_polynomial_has_the_roots_of_the_eight_states() -> None:
    """Its three roots and their conjugates, and two zeros: where the platform points is free at the start."""
    rng = np.random.default_rng(3)
    for _ in range(30):
        p = closed.TwoAxes(*10.0 ** rng.uniform([0, -1, -2, -1, -1, 1], [1.5, 1, -1, 1.5, 1, 3]))
        eight = np.linalg.eigvals(matrix(p))
        roots = np.roots(p.polynomial())
        for root in (*roots, *roots.conj()):
            assert np.min(np.abs(eight - root)) < 1e-6 * np.max(np.abs(eight))
        assert np.sum(np.abs(eight) < 1e-6 * np.max(np.abs(eight))) >= 2


def test_the_limit_is_where_a_root_crosses() -> None:
    """200 random sets: stable just below the limit, not above it; the default one 1344 N.m/rad, 1440 of one axis."""
    rng, seen = np.random.default_rng(6), 0
    for _ in range(200):
        values = 10.0 ** rng.uniform([0, -1, -2, 0, -1], [1.5, 1, -1, 1.5, 1])
        p = closed.TwoAxes(*values, 1.0)
        limit = p.limit()
        if not np.isfinite(limit) or not closed.TwoAxes(*values, 1e-3 * limit).stable():
            continue
        seen += 1
        assert closed.TwoAxes(*values, 0.999 * limit).stable() and not closed.TwoAxes(*values, 1.001 * limit).stable()
    assert seen > 100
    assert closed.TwoAxes(**DEFAULT).limit() == pytest.approx(1344.36, abs=0.01)
    assert closed.one_axis_limit(10.0, 0.5, 0.02, 10.0, 2.0) == pytest.approx(1440.0)


def test_compliance_is_that_of_the_states_and_real_at_rest() -> None:
    p = closed.TwoAxes(**DEFAULT)
    B = np.zeros(8)
    B[2] = 1.0 / p.J_x
    for w in (0.3, 5.0, 80.0):
        found = np.linalg.solve(1j * w * np.eye(8) - matrix(p), B)
        both = [p.compliance(1j * w), np.conj(p.compliance(-1j * w))]  # of a real load: (T(s) + T*(s*))/2 about x
        assert found[0] == pytest.approx((both[0] + both[1]) / 2.0, rel=1e-6)
        assert found[1] == pytest.approx((both[0] - both[1]) / 2j, rel=1e-6)
    assert p.compliance(0.0) == pytest.approx(p.steady()) == pytest.approx(2.0 / (10.0 * 100.0))


@pytest.fixture(scope="module")
def session() -> Any:
    load = [
        LoopPhase(f"load about {a}", "torque", "step", k, 1.0, settle=3.0, dwell=1.5) for k, a in ((1, "x"), (2, "y"))
    ]
    servo = LoopPhase("servo torque", "torque", "constant", 3, 0.02, settle=3.0, dwell=1.5)
    plan = LoopPlan([*load, servo, LoopPhase("drift", "hold", settle=3.0, dwell=2.0)])
    with with_methods(NAME, plan=lambda self: plan) as s:
        yield s


def test_measures_beside_the_closed_forms(session: Any) -> None:
    """Without noise: lean, platform, largest angle about the other axis, servo rate; the drift and its truth."""
    c = {c.name: c for c in session.system.reduce(session.run(STILL)).coefficients}
    for name in ("K_m x", "K_m y", "α* x", "α* y", "servo rate x"):
        assert c[name].estimate == pytest.approx(c[name].closed, rel=2e-4), name
    for name in ("cross x", "cross y"):
        assert c[name].estimate == pytest.approx(c[name].closed, rel=2e-3) and c[name].closed == pytest.approx(
            51.75, abs=0.01
        )
    assert c["servo rate y"].estimate == pytest.approx(0.0, abs=0.01)
    c = {c.name: c for c in session.system.reduce(session.run({"platform.white": 0.0, "drift": "3deg/h"})).coefficients}
    assert c["drift x"].estimate == pytest.approx(3.0, rel=1e-3) and c["drift x"].truth == pytest.approx(3.0)


def test_u_of_the_largest_angle_is_that_of_the_random_walk(session: Any) -> None:
    """The platform turns as the gyro of the other axis drifts: N sqrt(t) after t, 0.123 s to the peak by hand."""
    c = {c.name: c for c in session.system.reduce(session.run({"drift": 0.0})).coefficients}
    walk = 8.63e-8 * np.sqrt(0.123) / ARCSEC
    for name in ("cross x", "cross y"):
        assert walk * 0.6 < c[name].u < walk * 1.7, name


def test_linear_model_of_the_parts(session: Any) -> None:
    """A load about x, by the Jacobians of the parts: the closed form about x and y."""
    model = session.prepare(STILL)[2].linear.closed.continuous
    p = closed.TwoAxes(**DEFAULT)
    f = np.array([0.2, 2.0, 15.0])
    s = 2j * np.pi * f
    both = p.compliance(s), np.conj(p.compliance(-s))
    for k, wanted in ((1, (both[0] + both[1]) / 2.0), (2, (both[0] - both[1]) / 2j)):
        found = margins.excitation_response(model, "torque", 1, f"platform.attitude[{k}]", f)
        np.testing.assert_allclose(found, wanted, rtol=1e-5)


@pytest.mark.parametrize(("share", "grows"), [(0.97, False), (1.03, True)])
def test_limit_in_the_co_simulation(session: Any, share: float, grows: bool) -> None:
    """Decays below the limit of both, grows above it, though one axis alone would bear 7 % more.

    The delay of a step costs 0.6 % of it (17.4 Hz, 0.1 ms).
    """
    limit = closed.TwoAxes(**DEFAULT).limit()
    record = session.run({**STILL, "K_m": share * limit, "allow_unstable": True})
    t, y = record.channels["time"], record.channels["platform.attitude[2]"]
    early, late = (np.ptp(y[(t > a) & (t < a + 0.2)]) for a in (3.1, 4.2))
    assert (late > early) == grows


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"K_m": 1400.0}, r"stable up to 1344 N\.m/rad \(one alone up to 1440\)"),
        ({"K_m": 0.0}, "K_m = 0 N.m/rad: must be > 0"),
        ({"load": 20.0}, "leans the gyro"),
    ],
)
def test_refuses(values: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=says):
        load_system(NAME).with_values(values).refuse()
