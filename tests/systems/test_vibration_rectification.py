"""Vibration test: the shaker's moments, random instruments that come back, files, mistakes.  [TEST-RECTIFICATION]"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from scipy.spatial.transform import Rotation
from stated import with_sizes

from gyrobench.component import ComponentError
from gyrobench.engine.session import Session
from gyrobench.packaging import load_part
from gyrobench.reduction.toolkit import ReductionError
from gyrobench.system.system import load_system
from systems.vibration_rectification.reduction import Reduction, VibrationSetup

NAME = "vibration_rectification"
DPH = math.pi / 648000.0
G0 = 9.80665
SHORT: dict[str, Any] = {"levels": "0 0.8 1.5", "cycles": 1, "readings": 2, "window": 1.0, "settle": 1.0,
                         "nuisances": "none"}  # fmt: skip


QUIET = {
    n: 0.0
    for n in load_system(NAME).noises
    if not n.startswith("gyro.") or n[5:] in load_part("gyro_vibratory").declarations
}


# ------------------------------------------------------------------------------------------------ the shaker
@pytest.mark.parametrize("lines", [1, 12])
def test_moments_of_the_vibration(lines: int) -> None:
    """Over `repeat`: mean 0, mean square level2, mean cube 0, whatever the phases; the control has its gain."""
    table = load_part("vibration_table")(seed=7, lines=lines, repeat=1.0, ramp=0.1, read_gain=0.01, control=0.0)
    table.initialize()
    table.level_wanted = 3.0
    seen = []
    for k in range(2400):
        table.do_step(k * 5e-4, 5e-4)
        seen.append((table.f[2] - table.f_local[2], table.f_control))
    s, control = np.array(seen[400:]).T
    assert np.mean(s) == pytest.approx(0.0, abs=1e-12)
    assert np.mean(s**2) == pytest.approx(9.0, rel=1e-12)
    assert np.mean(s**3) == pytest.approx(0.0, abs=1e-10)
    assert control == pytest.approx(1.01 * s, abs=1e-12)


def test_the_table_leans_otherwise_up_and_down() -> None:
    """By scipy: axes of the case that are turned see vectors turned back; quaternion 1 + lean/2, by its norm."""
    leans = {1.0: [0.01, 0.02, 0.3], -1.0: [0.1, -0.2, 0.0]}
    table = load_part("vibration_table")(lean_up=leans[1.0], lean_down=leans[-1.0])
    table.initialize()
    table.omega_local = [1.0, 2.0, 3.0]
    for way, lean in leans.items():
        face = np.array([[0.0, 0.0, way], [1.0, 0.0, 0.0], [0.0, way, 0.0]])
        table.face = face.tolist()
        table.do_step(0.0, 5e-4)
        back = Rotation.from_quat([*(0.5 * np.array(lean)), 1.0]).inv()
        assert np.array(table.omega) == pytest.approx(face @ back.apply([1.0, 2.0, 3.0]), rel=1e-12)
        assert np.array(table.f) == pytest.approx(face @ back.apply([0.0, 0.0, G0]), rel=1e-12)


def test_frequencies_that_fall_together_are_refused() -> None:
    with pytest.raises(ComponentError, match="too short to tell the frequencies"):
        load_part("vibration_table")(low=20.0, high=30.0, repeat=0.5).initialize()


# ------------------------------------------------------------------------------------------------ runs
@pytest.mark.parametrize("axis", "xyz")
def test_random_instruments_come_back(session: Session, axis: str) -> None:
    """Noise off; coefficients by chance, those across the vibration too; by hand from the parameters."""
    rng = np.random.default_rng("xyz".index(axis))
    k = "xyz".index(axis)
    g = rng.uniform(-20.0, 20.0, (2, 3)) * DPH / G0
    g2 = rng.uniform(-5.0, 5.0, (2, 3)) * DPH / G0**2
    square, cube = rng.uniform(-1e-4, 1e-4) / G0, rng.uniform(-1e-5, 1e-5) / G0**2
    bias, scale = rng.normal(0.0, 1e-3 * G0, 3), rng.normal(0.0, 1e-3, 3)
    values = {
        "gyro.g": g.tolist(), "gyro.g2": g2.tolist(), "gyro.bias": [30.0 * DPH, 0.0], "accelerometers.square": square,
        "accelerometers.cubic": cube, "accelerometers.bias": bias.tolist(), "accelerometers.scale": scale.tolist(),
    }  # fmt: skip
    record = session.run({**SHORT, "axis": axis, **QUIET, **values})
    found = {c.name: c for c in load_system(NAME).with_values({**SHORT, "axis": axis}).reduce(record).coefficients}
    ug = 1e-6 * G0
    true = {
        "b_g": 30.0, "G": g[0, k] / DPH * G0, "G2": g2[0, k] / DPH * G0**2, "b_a": bias[k] / ug,
        "S": scale[k] * 1e6, "K2": square * G0 * 1e6, "K3": cube * G0**2 * 1e6,
    }  # fmt: skip
    for name, value in true.items():
        assert found[name].estimate == pytest.approx(value, rel=1e-4, abs=2e-3), name
    for name in set(true) - {"b_g"}:
        assert found[name].truth == pytest.approx(true[name], rel=1e-9), name


@pytest.mark.long
def test_a_control_accelerometer_that_reads_too_much(session: Session) -> None:
    """By 1 %: K2 seems 2 % too small where the level makes it; the report's table of shifts says so."""
    values = {**SHORT, "ways": "up"}
    record = session.run({**values, **QUIET, "table.read_gain": 0.01})
    result = load_system(NAME).with_values(values).reduce(record)
    found = {c.name: c for c in result.coefficients}
    assert set(found) == {"b_g", "G2", "b_a", "K2"}
    shift = {row[0]: row[-3] for t in result.tables if t.id.startswith("budget.predicted") for row in t.rows}
    for name, true in (("K2", 50.0), ("G2", 5.0)):
        assert found[name].truth == pytest.approx(true, rel=1e-9)
        assert found[name].estimate == pytest.approx(true / 1.01**2, rel=1e-4)
        assert found[name].estimate - true == pytest.approx(shift[name], rel=0.03)


@pytest.mark.long
@pytest.mark.parametrize("axis", "xy")
def test_a_lean_is_predicted(session: Session, axis: str) -> None:
    """Turned about east, north, up by 2, 1, 3 mrad up and by 1, −3, 1 mrad down: what the gyro and the accelerometer
    are off by is in the table of shifts, but for products of the leans."""
    more = {"table.lean_up": [2e-3, 1e-3, 3e-3], "table.lean_down": [1e-3, -3e-3, 1e-3], "gyro.g": [[0.0] * 3] * 2}
    values = {**SHORT, "axis": axis}
    result = load_system(NAME).with_values(values).reduce(session.run({**values, **QUIET, **more}))
    found = {c.name: c for c in result.coefficients}
    shift = {row[0]: row[-3] for t in result.tables if t.id.startswith("budget.predicted") for row in t.rows}
    for name, size in (("b_g", 3e-3), ("G", 3e-3), ("b_a", 1.0), ("S", 1.0)):
        c = found[name]
        assert abs(shift[name]) > size and c.estimate - (c.truth or 0.0) == pytest.approx(shift[name], abs=size / 20.0)


@pytest.mark.parametrize("limit", ["gyro.range_max", "accelerometers.range_max"])
def test_clipping_is_refused(session: Session, limit: str) -> None:
    values = {**SHORT, "ways": "up"}
    with pytest.raises(ReductionError, match="flagged windows"):
        load_system(NAME).with_values(values).reduce(session.run({**values, limit: 1e-5}))


# ------------------------------------------------------------------------------------------------ files
def rows(noise: float = 1.0, up: tuple[float, ...] = (1.0, -1.0)) -> list[list[float]]:
    """t0, t1, up, level (g), rate (deg/h), force (g), by hand: axis y (no Earth rate), 4 + 12 f + 3 (f2 + s2) deg/h."""
    rng = np.random.default_rng(3)
    out, t = [], 0.0
    for way in up:
        for s in (0.0, 1.0, 2.0, 3.0) * 2:
            rate = 4.0 + 12.0 * way + 3.0 * (1.0 + s * s) + noise * 0.1 * rng.normal()
            force = way + 2e-3 + 5e-4 * way + 8e-5 * (1.0 + s * s) + 1e-6 * (way + 3.0 * way * s * s)
            out.append([t, t + 10.0, way, s, rate, force + noise * 2e-6 * rng.normal()])
            t += 12.0
    return out


def test_a_laboratorys_file(command: Command, tmp_path: Path) -> None:
    head = "# latitude = 0deg\n# gravity = 9.80665\n# axis = y\n# type_b = none\n"
    names = "t_start [s],t_end [s],up,level [g],rate [deg/h],force [g]\n"
    file = tmp_path / "levels.csv"
    file.write_text(head + names + "\n".join(",".join(f"{v:.10g}" for v in row) for row in rows()) + "\n")
    code, _, err = command("reduce", NAME, "--data", str(file), "--out", str(tmp_path / "r"))
    assert code == 0, err
    result = json.loads((tmp_path / "r" / "result.json").read_text())
    (asked,) = (r["text"] for r in result["reasons"] if r["id"] == "arrangement.unstated")
    assert "a lean of the instruments by 1° with the axis up (" in asked
    assert "the rate reversed (G2 by" in asked and "the axis x of the gyro to the north" in asked
    found = {c["name"]: c for c in result["coefficients"]}
    for name, value in {"b_g": 4.0, "G": 12.0, "G2": 3.0, "b_a": 2000.0, "S": 500.0, "K2": 80.0, "K3": 1.0}.items():
        low, high = found[name]["interval"]
        assert low < value < high, name
        assert high - low < 0.5 * max(abs(value), 3.0), name


def reduced(table: list[list[float]], setup: dict[str, Any] | None = None, **columns: Any) -> Any:
    names, units = ("t_start", "t_end", "up", "level", "rate", "force"), (1.0, 1.0, 1.0, G0, DPH, G0)
    windows = {n: np.array(v) * u for n, v, u in zip(names, zip(*table, strict=True), units, strict=True)} | columns
    said = with_sizes({"axis": "y", "latitude": 0.0, "gravity": G0, **(setup or {})})
    return Reduction.reduce(windows, VibrationSetup(**said))


def test_a_temperature_that_goes_by_the_level_is_named() -> None:
    """1 K per g2 and 0.5 deg/h/K: G2 was 3.5 for 3 deg/h/g2, 129 u off.  Of two repetitions at temperatures that
    differ by 2 K the temperature is weighed, and G2 comes back.
    """
    table = rows()
    level = np.array([row[3] for row in table])
    for more, named in ((0.0, True), (2.0, False)):
        T = level**2 + more * (np.arange(level.size) // 4 % 2)
        heated = [[*row[:4], row[4] + 0.5 * t, row[5]] for row, t in zip(table, T, strict=True)]
        result = reduced(heated, temperature=293.0 + T)
        assert any(r.id == "temperature.aliased" and "aliased with b_g, G2" in r.text for r in result.reasons) == named
        G2 = next(c for c in result.coefficients if c.name == "G2")
        assert (abs(G2.estimate - 3.0) > 10.0 * G2.u) == named


def test_a_lean_by_itself_up_and_down_is_in_u() -> None:
    """1 mrad about each axis.  A level gyro sees 15.041 °/h times a turn about north or up, whatever the latitude, and
    12 °/h/g times gravity along two axes across: 15.04 and 17.0 m°/h in each way, mean and half difference of two ways
    1/√2 of √(15.04² + 16.97²) = 16.03 m°/h.  The accelerometer lacks c = (x² + y²)/2 in each way, of mean and standard
    deviation 1e-6: both ways the mean has mean square 1 + 1/2, the half difference 0 + 1/2; one way alone 1 + 1."""
    for latitude in (0.2, 1.1):
        one = {"u_lean": 1e-3, "latitude": latitude}
        u = {c.name: c.u for c in reduced(rows(0.0), one).coefficients}
        assert u["b_g"] == pytest.approx(16.03e-3, rel=1e-3) and u["G"] == pytest.approx(16.03e-3, rel=1e-3)
        assert u["b_a"] == pytest.approx(math.sqrt(0.5), rel=1e-3) and u["S"] == pytest.approx(math.sqrt(1.5), rel=1e-3)
        assert u["G2"] < 1e-9 and u["K2"] < 1e-6
        u = {c.name: c.u for c in reduced(rows(0.0, (1.0,)), one).coefficients}
        assert u["b_a"] == pytest.approx(math.sqrt(2.0), rel=1e-3)


def test_gyro_or_accelerometer_alone_and_one_way() -> None:
    table = rows(0.0, (1.0,))
    both = {c.name: c.estimate for c in reduced(table).coefficients}
    assert both["K2"] == pytest.approx(80.0 + 3.0 * 1.0, rel=1e-6)  # 3 K3 f at f = 1 g
    assert both["G2"] == pytest.approx(3.0, rel=1e-6)


def test_mistakes_are_named() -> None:
    swapped = [[*row[:2], -row[2], *row[3:]] for row in rows()]
    (reason,) = [r for r in reduced(swapped).reasons if r.id == "force.factor"]
    assert "accelerometer" in reason.text and "up and down" in reason.text  # it was called a gyro
    assert any("levels are needed" in p for p in problems([row for row in rows() if row[3] < 1.5]))
    assert any("up: 1" in p for p in problems([[*row[:2], 2.0, *row[3:]] for row in rows()]))


def shaken(drift: float = 0.0, late: float = 0.0) -> list[list[float]]:
    """Four readings of each level; force drifts by ``drift`` g over the record, a level lacks ``late`` of its step."""
    rng, out, t, before = np.random.default_rng(11), list[list[float]](), 0.0, 0.0
    for way in (1.0, -1.0):
        for s in (0.0, 1.0, 2.0, 3.0) * 2:
            for j in range(4):
                s2 = s * s + (before - s * s) * late * math.exp(-j)
                rate = 4.0 + 12.0 * way + 3.0 * (1.0 + s2) + 0.1 * rng.normal()
                force = way + 2e-3 + 5e-4 * way + 8e-5 * (1.0 + s2) + 1e-6 * (way + 3.0 * way * s2)
                force += drift * (t / 1000.0 - 0.5)
                out.append([t, t + 6.0, way, s, rate, force + 2e-6 * rng.normal()])
                t += 8.0
            before = s * s
    return out


def test_a_level_that_was_not_reached_is_named() -> None:
    """A fifth of the step is missing in the first reading: G2 was 2.36 °/h/g², 11 u from 3; K2 62.6 µg/g², from 80."""
    for late in (0.0, 0.2):
        p = [t.p or 0.0 for t in reduced(shaken(late=late)).tests if t.id.startswith("level.late")]
        assert len(p) == 2 and (max(p) < 1e-3 if late else min(p) > 0.01)
    assert any("wait longer" in r.text for r in reduced(shaken(late=0.2)).reasons if r.id == "residuals.contradict")


def test_a_force_that_drifts() -> None:
    """50 µg over the record, up before down: S was off by half of it, 25 ppm, without a trend."""
    found = {c.name: c for c in reduced(shaken(drift=5e-5)).coefficients}
    low, high = found["S"].interval
    assert low < 500.0 < high and high - low < 25.0


def problems(table: list[list[float]]) -> list[str]:
    with pytest.raises(ReductionError) as caught:
        reduced(table)
    return str(caught.value).splitlines()


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"axis": "w"}, "x, y or z"),
        ({"low": 250.0}, "below high"),
        ({"high": 900.0}, "nine communication steps"),
        ({"window": 0.2}, "20 periods"),
    ],
)
def test_refused(values: dict[str, Any], said: str) -> None:
    assert any(said in p for p in load_system(NAME).with_values(values).check())


def test_a_gyro_that_was_not_turned_over_is_named() -> None:
    """Axis x at 45°: the vertical Earth rate, 10.64 °/h, changes its sign with the axis, and a gyro that stood still
    reads the same.  One that turned over and reads it, and 12 °/h/g, does not."""
    flat = [[*row[:4], 4.0 + 3.0 * row[3] ** 2 + 0.1 * k % 0.3, row[5]] for k, row in enumerate(rows())]
    turned = [[*row[:4], row[4] + 10.64 * row[2], row[5]] for row in rows()]
    for table, said in ((flat, True), (turned, False)):
        found = reduced(table, {"axis": "x", "latitude": math.pi / 4.0})
        assert any("was it not turned over" in r.text for r in found.reasons if r.id == "gyro.same") == said


def test_what_fades_after_turning_over_asks_a_verdict_to_hold_with_it() -> None:
    """1 °/h that fades in 60 s of a position of 256 s puts G 7 u off, since noise that drifts explains it as well; the
    intervals with exponentials hold G, and those of a record without it are of its own width."""
    table = shaken()
    turned = next(row[0] for row in table if row[2] < 0.0)
    heat = [(t >= turned) * math.exp(-(t + 3.0 - turned) / 60.0) for t, *_ in table]
    heated = [[*row[:4], row[4] + x, row[5]] for row, x in zip(table, heat, strict=True)]
    for rows, holds in ((table, True), (heated, False)):
        result = reduced(rows)
        G = next(c for c in result.coefficients if c.name == "G")
        assert (abs(G.estimate - 12.0) < 3.0 * G.u) == holds
        low, high = next(r for r in result.reasons if r.id == "turned.fades" and "G" in r.intervals).intervals["G"]
        assert low < 12.0 < high and high - low < 1.0


def test_a_fourth_power_of_the_level_asks_a_verdict_to_hold_with_it() -> None:
    """0.02 °/h/g⁴ beside 3 °/h/g² put G2 10 u off, and of half of the records the tests together did not contradict:
    the interval with the power in the model holds it, and the report says so from 0.01 on."""
    table = shaken()
    more = [[*row[:4], row[4] + 0.02 * row[3] ** 4, row[5]] for row in table]
    for rows_, severity in ((table, "condition"), (more, "warning")):
        result = reduced(rows_)
        reason = next(r for r in result.reasons if r.id == "level.fourth.with" and "G2" in r.intervals)
        low, high = reason.intervals["G2"]
        assert reason.severity == severity and low < 3.0 < high and high - low < 0.5
    G2 = next(c for c in result.coefficients if c.name == "G2")
    assert G2.estimate - 3.0 > 5.0 * G2.u


def of(result: Any, name: str, id: str) -> tuple[float, float, float]:
    """Return estimate less truth over u of b_g (4) or G2 (3), and the interval that a verdict must hold for too."""
    c = next(x for x in result.coefficients if x.name == name)
    low, high = next(r for r in result.reasons if r.id == id and name in r.intervals).intervals[name]
    return (c.estimate - {"b_g": 4.0, "G2": 3.0}[name]) / c.u, low, high


def test_a_term_linear_in_the_level_asks_a_verdict_to_hold_with_it() -> None:
    """0.1 °/h/g beside 3 °/h/g²: the line of least squares of x in 1 and x² at 0, 1, 2, 3 has the slope 0.306, so
    G2 is 0.03 °/h/g² too large, 6 u, and no test of the residuals contradicts.  Of levels without it the interval is
    as wide as that with a fourth power."""
    table = shaken()
    more = [[*row[:4], row[4] + 0.1 * row[3], row[5]] for row in table]
    for rows_, off in ((table, False), (more, True)):
        result = reduced(rows_)
        z, low, high = of(result, "G2", "level.linear.with")
        assert (z > 5.0) == off and low < 3.0 < high and high - low < 0.1
        assert not any(r.severity in ("error", "doubt") for r in result.reasons)


def test_heat_of_the_vibration_asks_a_verdict_to_hold_with_it() -> None:
    """0.2 °/h/g² (T' = (s² - T)/400 s, a sum of exact steps of 1 s): b_g was 9 u off as a drift of the noise."""
    table, warm = shaken(), 0.0
    hot = []
    for row in table:
        read = []
        for _ in range(8):  # a reading of 6 s every 8 s
            warm += (0.2 * row[3] ** 2 - warm) * -math.expm1(-1.0 / 400.0)
            read.append(warm)
        hot.append([*row[:4], row[4] + float(np.mean(read[:6])), row[5]])
    for rows_, off in ((table, False), (hot, True)):
        z, low, high = of(reduced(rows_), "b_g", "level.heat.with")
        assert (z > 5.0) == off and low < 4.0 < high and high - low < 0.5
    ids = {r.id for r in reduced(hot, temperature=np.linspace(293.0, 300.0, len(hot))).reasons}
    assert "level.linear.with" in ids and "level.heat.with" not in ids


def test_a_level_that_acts_against_gravity_asks_a_verdict_to_hold_with_it() -> None:
    """Clipping takes 0.15 µg/g⁴ towards zero, up and down: K3 was 15 u below 1 µg/g³.  A G that rises with the level,
    0.02 °/h/g³: G was 0.02 times the mean square of the levels, 3.5 g², too large.  With the column of it both hold.
    """
    table = shaken()
    more = [[*r[:4], r[4] + r[2] * 0.02 * r[3] ** 2, r[5] - r[2] * 1.5e-7 * r[3] ** 4] for r in table]
    for rows_, severity in ((table, "condition"), (more, "warning")):
        result = reduced(rows_)
        c = {x.name: x for x in result.coefficients}
        for name, true, most in (("G", 12.0, 0.3), ("K3", 1.0, 3.0)):
            reason = next(r for r in result.reasons if r.id == "level.odd.with" and name in r.intervals)
            low, high = reason.intervals[name]
            assert reason.severity == severity and low < true < high and high - low < most
        assert (abs(c["K3"].estimate - 1.0) > 3.0 * c["K3"].u) == (severity == "warning")


def test_an_axis_that_was_turned_over_once_is_said(tmp_path: Path) -> None:
    """A bias that is another one from then on is half in the bias and half in G, whatever the noise: 20 °/h make 10.
    With the first position once more it is a drift between positions, and u of G 15 times as large."""
    head = "# latitude = 0deg\n# gravity = 9.80665\n# axis = y\n"
    names = "t_start [s],t_end [s],up,level [g],rate [deg/h],force [g]\n"
    system = load_system(NAME)
    for ways, said in (((1.0, -1.0), True), ((1.0, -1.0, 1.0), False)):
        table = rows(up=ways)
        moved = [[*r[:4], r[4] + 20.0 * (k >= 8), r[5]] for k, r in enumerate(table)]
        file = tmp_path / f"{len(ways)}.csv"
        file.write_text(head + names + "\n".join(",".join(f"{v:.10g}" for v in row) for row in moved) + "\n")
        assert system.measured_data is not None
        result = Reduction.from_record(system.measured_data.read(system, file, {}))
        assert any(r.id == "turned.once" for r in result.reasons) == said
        G = next(c for c in result.coefficients if c.name == "G")
        assert (abs(G.estimate - 12.0) > 10.0 * G.u) == said
        if said:
            assert G.estimate == pytest.approx(12.0 - 10.0, abs=0.3)


def test_a_bias_that_jumps_is_named_at_a_level_and_at_a_turn(tmp_path: Path) -> None:
    """2 deg/h, 20 standard deviations.  Up, down and up hold it as slow drift: at the first reading down G is off by
    half of it (4 u, b_g 7 u), and no drift is within a position; among the readings down it is the level of the record.
    """
    head = "# latitude = 0deg\n# gravity = 9.80665\n# axis = y\n"
    names = "t_start [s],t_end [s],up,level [g],rate [deg/h]\n"
    system = load_system(NAME)
    assert system.measured_data is not None
    for at, said in ((99, ""), (8, "turned.jump"), (16, "turned.jump"), (12, "level.shift")):
        moved = [[*r[:4], r[4] + 2.0 * (k >= at)] for k, r in enumerate(rows(up=(1.0, -1.0, 1.0)))]
        file = tmp_path / f"{at}.csv"
        file.write_text(head + names + "\n".join(",".join(f"{v:.10g}" for v in row) for row in moved) + "\n")
        reasons = {r.id: r for r in Reduction.from_record(system.measured_data.read(system, file, {})).reasons}
        assert [i for i in ("turned.jump", "level.shift") if i in reasons] == ([said] if said else [])
        if said:
            words = "Equal positions differ by 2" if "turn" in said else "From row 13 on the level of the record"
            assert words in reasons[said].text and reasons[said].blocks == ("pass", "fail")
