"""The platform that follows the Earth: closed forms against integration, drift in the co-simulation, budget."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from gyrobench.engine.session import Session
from gyrobench.reduction.loops.slow_drift import slow_drift
from gyrobench.system.system import InvalidConfigurationError, load_system
from gyrobench.units import ARCMIN, DPH, EARTH_RATE

NAME = "platform_following"
closed: Any = importlib.import_module(".closed", type(load_system(NAME)).__module__)
size: Any = importlib.import_module(".size", type(load_system(NAME)).__module__)
QUIET = {
    f"{g}.{n}_{c}": 0.0 for g in ("gyro_a", "gyro_b") for n in ("turn_on", "markov", "white", "pickoff") for c in "xy"
}
PERFECT = {**QUIET, "mounting": 0.0, "torquer": 0.0, "residual": 0.0, "quantum": 0.0, "time": 20.0}


def drifts(s: Session, **values: Any) -> tuple[np.ndarray, Any]:
    result = s.system.with_values({}).reduce(s.run({**PERFECT, **values}))
    c = {c.name: c for c in result.coefficients}
    return np.array([c[f"drift {a}"].estimate for a in "xyz"]) * DPH, result


def test_where_a_drift_leads_by_integration() -> None:
    """e' = delta - w x e by solve_ivp, for an hour and for a day; small and without a rate it is delta t."""
    rng = np.random.default_rng(2)
    for time in (3600.0, 86400.0):
        delta, w = rng.normal(size=3) * 1e-7, np.array([-1.6e-5, 8.2e-5, 8.4e-5])
        wanted = solve_ivp(
            lambda t, e, d=delta, w=w: d - np.cross(w, e), (0.0, time), np.zeros(3), rtol=1e-10, atol=1e-14
        )
        assert closed.led(delta, w, time) == pytest.approx(wanted.y[:, -1], rel=1e-6, abs=1e-10)
    assert closed.led(delta, np.zeros(3), 10.0) == pytest.approx(10.0 * delta)


def test_drift_is_that_of_two_frames() -> None:
    """The meaning of e: a platform at w + delta in its axes, a frame at w; the rotation between them after an hour."""
    w, delta, h = np.array([-1.6e-5, 8.2e-5, 8.4e-5]), np.array([2e-8, -3e-8, 5e-8]), 3600.0
    frame, platform = (Rotation.from_rotvec(x * h) for x in (w, w + delta))
    apart = (frame.inv() * platform).as_rotvec()  # in the axes of the frame
    assert apart == pytest.approx(closed.led(delta, w, h), rel=1e-3)


def test_sensitivities_by_differences() -> None:
    place = closed.MovingPlace(0.8, 5e3, 200.0, 100.0)
    step = 1e-6
    by_latitude = (closed.MovingPlace(0.8 + step, 5e3, 200.0, 100.0).rate() - place.rate()) / step
    assert place.by_latitude() == pytest.approx(by_latitude, rel=1e-2, abs=2e-7)
    east, north = place.by_velocity()
    assert east == pytest.approx(closed.MovingPlace(0.8, 5e3, 201.0, 100.0).rate() - place.rate(), rel=1e-9)
    assert north == pytest.approx(closed.MovingPlace(0.8, 5e3, 200.0, 101.0).rate() - place.rate(), rel=1e-9)


def test_a_perfect_platform_follows_a_swaying_base(session: Session) -> None:
    """Aircraft in moderate turbulence, 225 m/s: what is left is the step, far below 1e-4 deg/h."""
    found, _ = drifts(session, base=5)
    assert np.max(np.abs(found)) < 1e-4 * DPH
    assert session.run({**PERFECT, "base": 5}).channels["motion.angle[2]"].std() > 0.005  # it does sway


@pytest.mark.long
def test_each_error_makes_the_drift_of_the_closed_form(session: Session) -> None:
    """Torquers e w; residual d on each axis; latitude dw/dL; velocity dw/dv; mounting: R w = w_believed, by hand."""
    place = closed.MovingPlace(45.75 * np.pi / 180.0, 0.0, 200.0, 100.0)
    w = place.rate()
    east, north = place.by_velocity()
    cases = {
        "torquer": (1e-3, 1e-3 * w),
        "residual": (0.05 * DPH, np.full(3, 0.05 * DPH)),
        "latitude_error": (2 * ARCMIN, 2 * ARCMIN * place.by_latitude()),
        "velocity_error": (3.0, 3.0 * (east + north)),
    }
    for name, (value, wanted) in cases.items():
        found, result = drifts(session, **{name: value})
        assert found == pytest.approx(wanted, rel=3e-3, abs=2e-4 * DPH), name
        truth = [next(c for c in result.coefficients if c.name == f"drift {a}").truth for a in "xyz"]
        assert np.array(truth) * DPH == pytest.approx(found, rel=3e-3, abs=2e-4 * DPH)
    found, _ = drifts(session, mounting=5 * ARCMIN)
    turn = np.full(3, 5 * ARCMIN)
    a, b = Rotation.from_rotvec(turn).as_matrix(), Rotation.from_rotvec(-turn).as_matrix()
    rows = np.array(
        [
            (np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0.0]]) @ b)[1],
            *(np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0.0]]) @ a)[:2],
        ]
    )
    assert found == pytest.approx(np.linalg.solve(rows, w) - w, rel=3e-3, abs=2e-4 * DPH)


@pytest.mark.long
def test_slow_drift_is_in_the_interval(session: Session) -> None:
    """Drift that 20 s cannot tell from a constant: the interval holds the constant one, and is not many times too wide.

    The mean over T << tau has nearly the whole rms.  The noise of the record alone is 0.006 deg/h: without the share of
    the slow drift 15 errors are some ten u of that each.
    """
    rms = 0.06
    slow = {f"{g}.markov_{c}": rms * DPH for g in ("gyro_a", "gyro_b") for c in "xy"}
    slow |= {f"{g}.markov_tau": 2000.0 for g in ("gyro_a", "gyro_b")}
    white = {f"{g}.white_{c}": 0.0178 * DPH for g in ("gyro_a", "gyro_b") for c in "xy"}
    z = []
    for seed in range(5):
        record = session.run({**PERFECT, **slow, **white, "residual": 0.05 * DPH}, seed=seed)
        c = {c.name: c for c in session.system.with_values({}).reduce(record).coefficients}
        z += [c[f"drift {a}"].z for a in "xyz"]
        assert all(rms < c[f"drift {a}"].u < 1.5 * rms for a in "xyz")
        assert all(abs(c[n].z) < 4.0 for n in ("drift", "tilt 1 h", "heading 1 h"))
    assert np.max(np.abs(z)) < 4.0 and 0.5 < np.std(z) < 1.5


def test_the_interval_of_a_size_holds_it() -> None:
    """2000 vectors of 2 and 3 elements, from 0 to 10 of their noise, which differs by direction up to ten times."""
    rng = np.random.default_rng(11)
    for elements in (2, 3):
        held = []
        for _ in range(1000):
            spread = 10.0 ** rng.uniform(-0.5, 0.5, elements)
            m = rng.normal(size=elements) * 10.0 ** rng.uniform(-1.5, 1.0)
            low, high = size.size_of(m + spread * rng.standard_normal(elements), np.diag(spread**2))[1]
            held.append(low <= np.linalg.norm(m) <= high)
        assert 0.93 < np.mean(held) < 0.985
    assert size.size_of(np.zeros(2), np.eye(2))[1][0] == 0.0
    assert size.size_of(np.array([300.0, 400.0]), np.eye(2))[1] == pytest.approx((500.0 - 1.96, 500.0 + 1.96), abs=1e-3)


def test_the_mean_of_slow_drift_by_sampling() -> None:
    """6000 processes each, walked in steps of tau/100: turn-on and Gauss-Markov, flicker, walk that began before."""
    rng, h, n, count = np.random.default_rng(8), 1.0, 100, 6000
    t = np.arange(40.0, 40.0 + n + 1)

    def markov(rms: float, tau: float) -> np.ndarray:
        a = np.exp(-h / tau)
        x, total = rms * rng.standard_normal(count), np.zeros(count)
        for _ in range(n):
            x = a * x + rms * np.sqrt(1.0 - a * a) * rng.standard_normal(count)
            total += x / n
        return total

    found = float(np.std(3.0 * rng.standard_normal(count) + markov(2.0, 100.0)))
    given = {"g.turn_on_x": 3.0, "g.markov_x": 2.0, "g.markov_tau": 100.0}
    assert slow_drift(given, "g", "_x", t) == pytest.approx(found, rel=0.03)
    walks = np.cumsum(0.5 * rng.standard_normal((count, 140)), axis=1)[:, 40:].mean(axis=1)
    assert slow_drift({"g.walk": 0.5}, "g", "", t) == pytest.approx(float(np.std(walks)), rel=0.03)
    steady = slow_drift({"g.flicker": 1.0, "g.flicker_tau": 1e12}, "g", "", t)  # twelve constants: 5.59 B2
    assert steady < np.sqrt(5.59) and slow_drift({"g.flicker": 1.0}, "g", "", t) < steady
    assert slow_drift({}, "g", "_x", t) == 0.0


def test_budget_by_hand_and_in_the_report(session: Session) -> None:
    """At rest at 45 deg: torquers 1e-4 of 10.63 deg/h about y and z; mounting u sqrt(w_y2 + w_z2) about x, 3 arcmin."""
    place = closed.MovingPlace(np.pi / 4.0, 0.0, 0.0, 0.0)
    u = {"mounting": 3 * ARCMIN, "torquer": 1e-4, "drift": 0.01 * DPH, "latitude": ARCMIN, "velocity": 1.0}
    lines = {line.source: line.drift / DPH for line in closed.budget(place, u, 1e-3 * DPH)}
    half = EARTH_RATE * np.sqrt(0.5) / DPH
    assert lines["scale factors of the torquers"] == pytest.approx([0.0, 1e-4 * half, 1e-4 * half])
    assert lines["mounting of the gyros"] == pytest.approx(3 * ARCMIN * np.array([np.sqrt(2.0), 1.0, 1.0]) * half)
    assert lines["resolution of the command"] == pytest.approx([1e-3 / np.sqrt(12.0)] * 3)
    assert lines["latitude"] == pytest.approx(ARCMIN * half * np.array([0.0, 1.0, 1.0]))
    _, result = drifts(session)
    table = next(t for t in result.tables if t.kind == "following.budget")
    assert [row[0] for row in table.rows][-2:] == ["root sum of squares", "measured"] and len(table.rows) == 8
    squares = sum(np.array(row[3:]) ** 2 for row in table.rows[:6])
    assert np.array(table.rows[6][3:]) == pytest.approx(np.sqrt(squares))


def test_the_budget_is_the_scatter_of_random_errors() -> None:
    """1000 instruments: gyros turned at random, torquers, drifts, beliefs; rms of the drift against the sum."""
    rng, n = np.random.default_rng(4), 1000
    place = closed.MovingPlace(0.8, 0.0, 200.0, 100.0)
    w = place.rate()
    u = {"mounting": 3 * ARCMIN, "torquer": 1e-4, "drift": 0.01 * DPH, "latitude": ARCMIN, "velocity": 1.0}
    east, north = place.by_velocity()
    found = np.zeros((n, 3))
    for k in range(n):
        off = rng.normal(size=(3, 3)) * u["mounting"]  # of each row on its own
        rows = np.eye(3) + np.array([np.cross(off[j], np.eye(3)[j]) for j in range(3)])
        v = rng.normal(size=2) * u["velocity"]
        believed = w + place.by_latitude() * rng.normal() * u["latitude"] + east * v[0] + north * v[1]
        command = (1.0 + rng.normal(size=3) * u["torquer"]) * believed + rng.normal(size=3) * u["drift"]
        found[k] = np.linalg.solve(rows, command) - w
    total = np.sqrt(sum(line.drift**2 for line in closed.budget(place, u, 0.0)))
    assert found.std(axis=0) == pytest.approx(total, rel=0.08)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"latitude": "80deg", "north": 200.0, "time": 7200.0}, "north has no direction to follow"),
        ({"feedback": 200.0}, "wants a crossover up to"),
    ],
)
def test_refuses(values: dict[str, Any], says: str) -> None:
    with pytest.raises(InvalidConfigurationError, match=says):
        load_system(NAME).with_values(values).refuse()
