"""Heading and level after a time: closed forms against the processes of the parts, sheets, the page.  [NORTH-AFTER]"""

from __future__ import annotations

import importlib
import math

import numpy as np
import pytest

from gyrobench import units
from gyrobench.component.blocks.random_drift import INNER, OUTER, RATIO, RELAXATIONS
from gyrobench.system.system import load_system
from gyrobench.workflow.instruments import find_instrument, parameters, with_instruments
from systems.north_finder.after import RandomErrors, heading, in_words, level, position, reached_after, running, table
from systems.north_finder.reduction import NorthFinderSetup, Reduction

DEG = math.pi / 180.0
DPH = DEG / 3600.0


def of_bank(tau: float, begin: tuple[float, float], end: tuple[float, float], n: int = 600) -> float:
    """Return the covariance of two means of the flicker of the parts with B = 1, by sums of its relaxations."""
    a, b = (np.linspace(*x, n, endpoint=False) + (x[1] - x[0]) / (2 * n) for x in (begin, end))
    lag = np.abs(a[:, None] - b[None, :])
    weights = np.full(RELAXATIONS, INNER)
    weights[[0, -1]] = OUTER
    return float(sum(w * w * np.exp(-lag / (tau / RATIO**j)).mean() for j, w in enumerate(weights)))


def test_flicker_is_that_of_the_parts() -> None:
    """Mean of 300 s from the start, and its change from 60 s to the 300 s after them, of a bank up to 1e5 s."""
    only = RandomErrors(0.0, flicker=1.0)
    assert only.mean(300.0) == pytest.approx(of_bank(1e5, (0.0, 300.0), (0.0, 300.0)), rel=0.05)
    first, second = (0.0, 60.0), (60.0, 360.0)
    change = sum(s * of_bank(1e5, x, y) for s, x, y in ((1, first, first), (1, second, second), (-2, first, second)))
    assert only.change(60.0, 300.0) == pytest.approx(change, rel=0.05)
    assert only.change(50.0, 50.0) == pytest.approx(2.0 * 2.0 * math.log(2.0) / math.pi, rel=1e-12)


def test_walk_and_markov_by_simulation() -> None:
    """Means of sampled paths, 4000 of each: within 5 standard errors."""
    rng, h, n = np.random.default_rng(2), 0.5, 400
    walk = np.cumsum(rng.normal(0.0, math.sqrt(h), (4000, n)), axis=1)
    markov = np.empty((4000, n))
    markov[:, 0] = rng.normal(size=4000)
    a = math.exp(-h / 30.0)
    for k in range(1, n):
        markov[:, k] = a * markov[:, k - 1] + math.sqrt(1.0 - a * a) * rng.normal(size=4000)
    one = {"walk": RandomErrors(0.0, walk=1.0), "markov": RandomErrors(0.0, markov=1.0, markov_tau=30.0)}
    for name, path in (("walk", walk), ("markov", markov)):
        whole, half = path[:, :200].mean(axis=1), path[:, 200:].mean(axis=1)
        assert one[name].mean(100.0) == pytest.approx(whole.var(), rel=0.12)  # 5 (2/4000)^0.5
        assert one[name].change(100.0, 100.0) == pytest.approx((half - whole).var(), rel=0.12)


def test_the_earth_rate_turns_the_errors_of_the_axes_into_each_other() -> None:
    """Across the Earth's rate W, after 6 h, Wt = 1.575: a random walk from nothing (T -> 0) makes
    int_0^t 2 (1 - cos W v)/W2 dv = 2 (t - sin(W t)/W)/W2 for t3/3 along it; white noise t + T (2 sin(W t/2)/(W T))2.
    """
    W, t, T = units.EARTH_RATE, 6.0 * 3600.0, 300.0
    walk = RandomErrors(0.0, walk=1.0)
    assert walk.turned(1.0, t, W) == pytest.approx(2.0 * (t - math.sin(W * t) / W) / W**2, rel=1e-3)
    white = RandomErrors(1.0)
    assert white.turned(T, t, W) == pytest.approx(t + (2.0 * math.sin(0.5 * W * t) / W) ** 2 / T, rel=1e-4)
    for each in (RandomErrors(0.0, flicker=1.0), walk, RandomErrors(0.0, markov=1.0, markov_tau=50.0), white):
        assert each.turned(T, 600.0, 0.0) == pytest.approx(600.0**2 * each.change(T, 600.0), rel=2e-3)
    # of a bias that has changed by then the vertical at 45 deg has sinc2(W t/2) = 0.815 by half: 0.908 of variance
    kept = running(white, 0.0, 1e-3, t, 45.0 * DEG) / running(white, 0.0, 1e-3, t)
    assert kept**2 == pytest.approx(0.5 * (1.0 + (math.sin(0.5 * W * t) / (0.5 * W * t)) ** 2), rel=1e-4)
    assert 1.0 > running(walk, 0.0, T, 600.0, 45.0 * DEG) / running(walk, 0.0, T, 600.0) > 0.9995


def test_position_by_hand_and_by_integration() -> None:
    """White noise N of a gyro for a minute after T: g2 N2 (t5/20 + t6/(36 T)), of an accelerometer N2 (t3/3 +
    t4/(4 T)), the 84 minutes not yet felt.  Then 20 minutes against 3000 paths of x'' = g (theta - x/R) + a,
    theta' = e.
    """
    g, t, T = 9.8, 60.0, 300.0
    white = RandomErrors(1e-6)
    tilted = g**2 * 1e-12 * (t**5 / 20.0 + t**6 / (36.0 * T))
    moved = 1e-6 * (t**3 / 3.0 + t**4 / (4.0 * T))
    assert position(white, None, g, T, t) ** 2 == pytest.approx(tilted, rel=2e-3)
    assert position(white, RandomErrors(1e-3), g, T, t) ** 2 == pytest.approx(tilted + moved, rel=2e-3)
    rng, h, paths = np.random.default_rng(4), 2.0, 3000
    noise = {
        "gyro": RandomErrors(1e-6, walk=3e-9), "force": RandomErrors(1e-4, markov=1e-5, markov_tau=100.0),
    }  # fmt: skip
    n, begin = round((T + 1200.0) / h), round(T / h)
    e = 1e-6 * rng.normal(size=(paths, n)) / math.sqrt(h)
    e += np.cumsum(3e-9 * math.sqrt(h) * rng.normal(size=(paths, n)), axis=1)
    a, slow, keep = 1e-4 * rng.normal(size=(paths, n)) / math.sqrt(h), rng.normal(size=paths), math.exp(-h / 100.0)
    for k in range(n):
        a[:, k] += 1e-5 * slow
        slow = keep * slow + math.sqrt(1.0 - keep**2) * rng.normal(size=paths)
    e, a = (x[:, begin:] - x[:, :begin].mean(axis=1)[:, None] for x in (e, a))
    theta, x, v = np.zeros(paths), np.zeros(paths), np.zeros(paths)
    for k in range(n - begin):
        v += h * (g * (theta + 0.5 * h * e[:, k] - x / 6371008.8) + a[:, k])
        theta += h * e[:, k]
        x += h * v
    found = position(noise["gyro"], noise["force"], g, T, 1200.0)
    assert float(np.sqrt(np.mean(x**2))) == pytest.approx(found, rel=0.07)  # 5/sqrt(6000), and half a step


def test_by_hand() -> None:
    """At 45°: 0.01 °/h of bias, 0.012 °/√h, 300 s; two positions N/(A √T); 1 mg of level; ten minutes alone."""
    latitude, T, north = 45.0 * DEG, 300.0, units.EARTH_RATE * math.cos(45.0 * DEG)
    gyro = RandomErrors(0.012 * DEG / 60.0, 0.01 * DPH)
    white = 0.012 * math.sqrt(12.0)  # °/h after a twelfth of an hour
    assert heading(gyro, latitude, T, two=False) == pytest.approx(math.hypot(0.01, white) * DPH / north, rel=1e-12)
    assert heading(gyro, latitude, T) == pytest.approx(white * DPH / north, rel=1e-12)
    assert level(RandomErrors(0.0, 9.80665e-3), 9.80665, T) == pytest.approx(1e-3)
    tilted = heading(gyro, latitude, T, two=False, tilt=1e-3)
    assert tilted == pytest.approx(math.hypot(heading(gyro, latitude, T, two=False), 1e-3), rel=1e-12)
    # random walk of ten minutes, 0.012 °/√h (1/6 h)^0.5, and what five leave in the bias, twice as long
    alone = 0.012 * math.sqrt(1.0 / 6.0) * DEG
    assert running(gyro, 0.0, T, 600.0) == pytest.approx(alone * math.sqrt(3.0), rel=1e-12)
    goal = reached_after(gyro, latitude, 1.0 * DEG)
    assert goal == pytest.approx((0.012 * DEG / 60.0 / north / DEG) ** 2, rel=0.01)
    assert reached_after(RandomErrors(0.0, flicker=DPH), latitude, DEG) is None  # 0.66/√2 °/h of 10.6: 2.5°
    assert [in_words(x) for x in (None, 90.0, 600.0, 36000.0)] == ["never", "after 90 s", "after 10 min", "after 10 h"]


@pytest.mark.parametrize(("sheet", "stated"), [("kvh1750", 0.012), ("gg1320", 0.0035), ("stim300", 0.15)])
def test_a_sheet_runs_without_density(sheet: str, stated: float) -> None:
    """The noise of fibre, laser and vibrating gyros is found where each kind has it, and is that of the sheet."""
    own = parameters(find_instrument(sheet))
    rate = RandomErrors.of(own)
    assert rate is not None and rate.white == pytest.approx(stated * DEG / 60.0)
    rows = table({f"gyro.{n}": v for n, v in own.items()}, 0.8, 9.8)[0].rows
    assert rows[0][1] is None or rows[0][1] >= rows[-1][1]
    # a gyro whose noise follows from its physics states none
    assert RandomErrors.of({"electronics": 0.0, "optical": 1.0}) is None
    system = load_system("north_finder")
    assert any("density" in p for p in system.check_parameters({"gyro.electronics": 0.0, "gyro.optical": 1.0}))


def test_a_bias_beyond_the_earth_rate_gives_no_heading_in_one_position() -> None:
    """mpu6050: within 20 °/s, u 41570 °/h, of a horizontal Earth rate of 10.6 °/h; ln200: 1 °/h, three times less."""
    for sheet, u, lost in (("mpu6050", 20.0 * 3600.0 / math.sqrt(3.0), True), ("ln200", 1.0, False)):
        _, values = with_instruments(sheet, {}, load_system("north_finder"))
        assert values["u_bias"] == pytest.approx(u * DPH)
        setup = NorthFinderSetup(latitude=45.0 * DEG, gravity=9.8, method="strapdown", sizes=values)
        assert any("take the method strapdown two" in p for p in Reduction({}, setup).problems()) == lost


def test_the_page_is_what_its_script_makes() -> None:
    script = importlib.import_module("reports.heading_after")
    text = script.PAGE.read_text(encoding="utf-8")
    assert text.split("<!-- table -->\n")[1] == "\n".join(script.table(script.sheets())) + "\n"
