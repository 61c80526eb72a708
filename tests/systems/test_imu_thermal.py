"""Bias and scale factor of an IMU over the temperature: a world in plain numpy comes back, a chamber is run through, a
compensator with what was found proves itself in a second cycle.  [IMU-THERMAL]"""

from __future__ import annotations

import importlib
import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imu_world import FACES, Heat, Unit, World, plan
from stated import with_sizes

import gyrobench as gb
from gyrobench.bench import UsageError
from gyrobench.commands.arguments import read_settings
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import load_system
from gyrobench.workflow.fitted_values import write_fitted

room = type(load_system("imu_positions")).__module__
reduction: Any = importlib.import_module(".reduction", room)
geometry: Any = importlib.import_module(".geometry", room)
budget: Any = importlib.import_module(".budget", room)
tables: Any = importlib.import_module(".tables", room)
thermal: Any = importlib.import_module(".thermal", room)
compensation: Any = importlib.import_module(".compensation", room)
DPH = math.pi / 648000.0
CYCLE = [*plan(FACES, rate=0.0, dwell=40.0, count=2), *plan((), rate=1.0, turns=2)]


def program(end: float) -> Any:
    """Smooth: 0, +40, -40, 0 K, the corners rounded as by a lag."""

    def temperature(t: Any) -> Any:
        x = np.asarray(t) / end
        return 40.0 * np.interp(x, np.linspace(0.0, 1.0, 2001), SMOOTH)

    return temperature


x = np.linspace(0.0, 1.0, 2001)
corners = np.interp(x, [0.0, 0.2, 0.3, 0.65, 0.75, 0.95, 1.0], [0.0, 1.0, 1.0, -1.0, -1.0, 0.0, 0.0])
kernel = np.exp(-np.arange(400) / 60.0)
SMOOTH = np.convolve(np.concatenate([np.zeros(399), corners]), kernel / kernel.sum(), mode="valid")


def heated(seed: int, cycles: int = 6, noise: Any = None) -> tuple[Any, dict[str, float]]:
    """Windows of a unit that is taken through the temperatures, and its coefficients."""
    rng = np.random.default_rng(seed)
    world, unit = World(), Unit.drawn(rng)
    gyros, accelerometers = Heat.drawn(rng, 20.0 * DPH, 5e-4), Heat.drawn(rng, 2e-3 * 9.8, 5e-4)
    w = world.windows(CYCLE * cycles, unit, noise)
    temperature = program(float(w["t_end"][-1]))
    t0, t1 = w["t_start"], w["t_end"]
    exact = world.windows(CYCLE * cycles, Unit(*(np.zeros(s) for s in (3, (3, 3), (3, 3), 3, (3, 3)))))
    for heat, kind in ((gyros, "g"), (accelerometers, "a")):
        inputs = np.array([exact[f"mean_{kind}{a}"] for a in "xyz"]).T
        for a, more in zip("xyz", heat.means(t0, t1, temperature, inputs).T, strict=True):
            w[f"mean_{kind}{a}"] = w[f"mean_{kind}{a}"] + more
    fine = t0[:, None] + (t1 - t0)[:, None] * (np.arange(40) + 0.5) / 40.0
    w["temperature"] = temperature(fine).mean(axis=1)
    return w, unit.coefficients() | gyros.coefficients("g") | accelerometers.coefficients("a")


def setup(**more: Any) -> Any:
    site = {"latitude": 0.7, "gravity": 9.805, "earth_rate": 7.2921159e-5, "nuisances": False}
    return budget.ImuSetup(**with_sizes({**site, "thermal": (3, 2, 10.0, 0.0), **more}))


@pytest.mark.long
def test_a_world_in_plain_numpy_comes_back() -> None:
    """No noise; what is left comes from a temperature that only the means of windows tell, 1.4 K a window at 4 K/min:
    below 0.03 of a thermal effect at 40 K (20 deg/h, 2 mg, 500 ppm)."""
    w, truth = heated(1)
    found = {c.name: c.estimate * tables.SCALES[c.unit] for c in reduction.reduce(w, setup()).coefficients}
    assert set(found) == set(truth) and len(found) == 75
    for n, value in found.items():
        kind, ending = n[:2], n.partition("_")[0][2:]
        gyro = kind[1] == "g" or n[0] == "G"
        size = {"b": 20.0 * DPH if gyro else 2e-3 * 9.8, "S": 5e-4, "G": 20.0 * DPH}[n[0]]
        power = {"T": 40.0, "T2": 40.0**2, "T3": 40.0**3, "R": 1.0 / 30.0}.get(ending, 1.0)
        assert abs(value - truth[n]) * power < 0.03 * size, n


def test_a_thermometer_that_stood_still_is_named() -> None:
    """The temperature of a room, 0.3 (sin 14 - sin 11) = 0.597 K: refused before as 'rank 13 for 14 coefficients'."""
    w = World().windows(CYCLE, Unit.drawn(np.random.default_rng(3)))
    w["temperature"] = 0.3 * np.sin(np.arange(len(w["phase"])))
    with pytest.raises(ReductionError, match=r"changes by 0\.597 K in all.*was that of the room read"):
        reduction.reduce(w, setup())


def white(seed: int) -> Any:
    rng = np.random.default_rng(seed)

    def noise(t0: Any, t1: Any) -> Any:
        return tuple(s / np.sqrt(t1 - t0)[:, None] * rng.normal(size=(t0.size, 3)) for s in (3e-5, 5e-3))

    return noise


@pytest.mark.long
def test_intervals_hold_the_truth() -> None:
    """White noise, four units of 75 coefficients, those of a unit being related; the benchmark counts more."""
    hits = total = 0
    for seed in range(4):
        w, truth = heated(100 + seed, 3, white(300 + seed))
        for c in reduction.reduce(w, setup()).coefficients:
            low, high = (v * tables.SCALES[c.unit] for v in c.interval)
            hits += low <= truth[c.name] <= high
            total += 1
    assert total == 300 and 0.9 < hits / total < 0.99


@pytest.mark.long
def test_a_hysteresis_of_another_width_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """30 K, stated as 10 K: bH and bT of both triads were off by ten u, and the residuals ordinary in 5 of 6 units."""
    drawn = Heat.drawn
    monkeypatch.setattr(Heat, "drawn", lambda *a: replace(drawn(*a), width=30.0))
    w, _ = heated(900, 6, white(700))
    for width in (10.0, 30.0):
        found = reduction.reduce(w, setup(thermal=(3, 2, width, 0.0)))
        said = [r.text for r in found.reasons if r.id == "residuals.contradict"]
        assert any("another width than is stated" in t for t in said) == (width == 10.0)


def _of_gyro(seed: int, bias: float, scale: float, axes: float = 0.0, **more: Any) -> Any:
    """Result of the gyro x, six cycles: a bias (rad/s) by (T/40 K)^4, a scale factor by (T/40 K)^3, an input axis that
    leans towards y by T/40 K (rad), beside what the model has; and its true values.
    """
    w, truth = heated(seed, 6, white(seed))
    exact = World().windows(CYCLE * 6, Unit(*(np.zeros(s) for s in (3, (3, 3), (3, 3), 3, (3, 3)))))
    T = w["temperature"] / 40.0
    w["mean_gx"] = w["mean_gx"] + bias * T**4 + scale * T**3 * exact["mean_gx"] + axes * T * exact["mean_gy"]
    return reduction.Reduction(w, setup(**more)).of_channel("gx").result(), truth


@pytest.mark.long
def test_powers_beyond_the_orders() -> None:
    """8 deg/h by T^4 and 100 ppm by T^3 at 40 K: bgT2 was 6 to 15 u off, SgT 14 to 18, the residuals ordinary in five
    of six.  Weighed by the data, they leave both in 3 u, and where they are not there u is wider.
    """
    for bias, scale in ((8.0 * DPH, 0.0), (0.0, 1e-4), (0.0, 0.0)):
        result, truth = _of_gyro(20, bias, scale, nuisances=True)
        for c in result.coefficients:
            if c.name in truth:
                si = tables.SCALES[c.unit]
                assert abs(c.estimate * si - truth[c.name]) < 3.5 * c.u * si, (c.name, bias, scale)
        names = {c.name for c in result.coefficients}
        assert ("bgT4_x" in names, "SgT3_x" in names) == (bias > 0.0, scale > 0.0)
    with pytest.raises(UsageError, match="bgT4_x, powers of the temperature that the part does not have"):
        compensation.values_of(_of_gyro(20, 8.0 * DPH, 0.0, nuisances=True)[0])


def test_a_model_that_leaves_out_what_follows_the_temperature_is_named() -> None:
    """Not weighed (nuisances = none): a scale factor of 100 ppm by T^3, an axis that leans by 1 mrad at 40 K."""
    for scale, axes, named in ((1e-4, 0.0, "thermal.scale"), (0.0, 1e-3, "thermal.axes"), (0.0, 0.0, "")):
        result, _ = _of_gyro(1, 0.0, scale, axes)
        assert {t.id for t in result.tests if t.id.startswith("thermal.") and (t.p or 0.0) < 1e-3} == {named} - {""}
        assert any(r.id == "residuals.contradict" for r in result.reasons) == bool(named)


@pytest.mark.parametrize(("cycles", "said"), [(4, True), (6, False)])
def test_few_temperatures_of_the_scale_factor_are_said(cycles: int, said: bool) -> None:
    """A gyro is turned once a cycle: four scale factors are S, ST, ST2 and either one power more or a hysteresis.  One
    of 50 ppm was named SgT3, with SgT 13 u off and ordinary residuals; six tell them apart."""
    w, _ = heated(20, cycles, white(20))
    at = reduction.Reduction(w, setup(nuisances=True))
    way = at.of_channel("gx").thermal.way
    w["mean_gx"] = w["mean_gx"] + 5e-5 * way * at.kinematics.felt[0][:, 0]
    result = at.of_channel("gx").result()
    named = {r.id for r in result.reasons} & {"thermal.few", "residuals.contradict"}
    assert named == ({"thermal.few"} if said else {"residuals.contradict"})
    names = next((r.names for r in result.reasons if r.id == "thermal.few"), ())
    assert set(names) >= ({"SgT_x", "SgT2_x"} if said else set())


def test_temperatures_that_need_not_go_through_the_hysteresis_are_said() -> None:
    """80 K of the program times 0.2: 15 K, of which a hysteresis of 15 K makes a straight line, in bT (17 u off); where
    2 K are stated as its width 15 K go through it.
    """
    w, _ = heated(20, 4, white(20))
    w["temperature"] = 0.2 * w["temperature"]
    for width, said in ((10.0, True), (2.0, False)):
        result = reduction.reduce(w, setup(thermal=(3, 2, width, 0.0)))
        names = [set(r.names) for r in result.reasons if r.id == "thermal.narrow"]
        assert len(names) == said
        assert not said or ({"bgT_x", "bgH_x", "baR_z"} <= names[0] and not {"bg_x", "bgT2_x", "SgT_x"} & names[0])


def test_the_noise_of_a_thermometer_is_not_a_rate_of_change() -> None:
    """20 mK of noise in means over 20 s: their differences over 40 s are 0.04 K/min, those over turns of 6 s more; a
    program of 0.5 K/min and the spline through all means have it to 0.07 (it was 0.11).
    """
    w = World().windows(CYCLE * 7, Unit.drawn(np.random.default_rng(1)))
    t0, t1 = w["t_start"], w["t_end"]
    temperature = program(float(t1[-1]))
    slope = 0.14 * (temperature(t1) - temperature(t0)) / (t1 - t0)
    fine = t0[:, None] + (t1 - t0)[:, None] * (np.arange(40) + 0.5) / 40.0
    noise = 0.02 * np.random.default_rng(2).normal(size=t0.size)
    w["temperature"] = 0.14 * temperature(fine).mean(axis=1) + noise
    found = thermal.Thermal.of(w, 0.0, 10.0, (3, 2)).slope
    assert 60.0 * np.std(found - slope) < 0.07 and 60.0 * np.std(slope) > 0.4


VALUES: dict[str, Any] = {
    "chamber.tau": 60.0, "chamber.lag": 20.0, "dwell": 10.0, "windows": 1, "turns": 1, "rate": 1.0, "cycles": 5,
    "nuisances": "none",
    "imu.gyro_bias_T": [2e-6, -1e-6, 5e-7], "imu.gyro_bias_T2": [2e-8, 1e-8, 0.0], "imu.gyro_hysteresis": [2e-5] * 3,
    "imu.gyro_scale_T": [2e-5, -1e-5, 0.0], "imu.acc_bias_T": [5e-4, -3e-4, 2e-4], "imu.acc_bias_T3": [1e-7, 0.0, 0.0],
    "imu.acc_ramp": [0.05, 0.0, -0.05], "imu.acc_scale_T": [3e-5, 1e-5, -2e-5], "imu.acc_scale_T2": [2e-7, 0.0, 0.0],
}  # fmt: skip


@pytest.fixture(scope="module")
def first() -> Any:
    return gb.load("imu_positions", VALUES).run(seed=1, check_step=False)


@pytest.mark.long
def test_a_unit_in_the_chamber(first: Any) -> None:
    temperature = np.asarray(first.record.channels["chamber.temperature"])
    assert temperature.max() > 35.0 and temperature.min() < -35.0 and abs(temperature[-1]) < 15.0
    z = np.array([(c.estimate - c.truth) / c.u for c in first.result.coefficients if c.truth is not None])
    assert z.size == 75 and np.abs(z).max() < 4.5 and 0.7 < np.sqrt(np.mean(z**2)) < 1.4


@pytest.mark.long
def test_the_compensation_holds_in_a_second_cycle(first: Any, tmp_path: Path) -> None:
    """With what was found in a part, another run: the temperature terms are gone within both intervals; none of it was
    so before."""
    files = write_fitted(load_system("imu_positions"), first.result, first.record, "imu_compensator", tmp_path)
    held = json.loads(files[1].read_text(encoding="utf-8"))["parameters"]
    assert held["acc_bias_T"]["unit"] == "m/s2/K" and len(held["acc_bias_T"]["value"]) == 3
    found = gb.load("imu_positions", VALUES | read_settings(files[0])).run(seed=2, check_step=False).result
    before = {c.name: c for c in first.result.coefficients}
    z = {c.name: c.estimate / math.hypot(c.u, before[c.name].u) for c in found.coefficients}
    assert (
        len(z) == 75 and max(map(abs, z.values())) < 4.5 and 0.6 < np.sqrt(np.mean(np.square(list(z.values())))) < 1.4
    )
    assert abs(before["bgT_x"].estimate) > 20.0 * before["bgT_x"].u
    assert abs(before["SaT_x"].estimate) > 20.0 * before["SaT_x"].u
    assert all(c.truth is None for c in found.coefficients)  # what is left of a polynomial over another is none


@pytest.mark.long
def test_a_laboratory_reads_its_thermometer_in_degrees(tmp_path: Path) -> None:
    w, truth = heated(5, 3, white(5))
    names = ["phase", "t_start", "t_end", *geometry.ANGLES, *(f"mean_{k}{a}" for k in "ga" for a in "xyz")]
    units = ["", " [s]", " [s]", *[" [rad]"] * 4, *[" [rad/s]"] * 3, *[" [m/s2]"] * 3]
    head = ",".join([n + u for n, u in zip(names, units, strict=True)] + ["temperature [degC]"])
    rows = np.column_stack([*(w[n] for n in names), w["temperature"] + 25.0])
    path = tmp_path / "lab.csv"
    said = "# latitude = 40.10704566deg\n# gravity = 9.805m/s2\n# thermal = true\n# reference = 25degC\n"
    path.write_text(said + head + "\n" + "\n".join(",".join(f"{v:.15g}" for v in r) for r in rows.tolist()) + "\n")
    system = load_system("imu_positions")
    record = system.read_measured(path, {})
    found = {c.name: c for c in reduction.Reduction.of_record(record).coefficients}
    for name in ("baT_x", "bgT_y", "SaT_z"):
        c, si = found[name], tables.SCALES[found[name].unit]
        assert abs(c.estimate * si - truth[name]) < 4.5 * c.u * si
    del record.windows["temperature"]
    with pytest.raises(ReductionError, match="the record has no column temperature"):
        system.reduce(record)
