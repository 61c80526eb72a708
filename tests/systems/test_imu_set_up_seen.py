"""Errors of table, site and clock that an inertial unit's residuals show together; what they do not show is asked for.

[IMU-POSITIONS]
"""

from __future__ import annotations

import importlib
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imu_world import EDGES, FACES, Unit, World, handled, plan, poses
from stated import with_sizes

import gyrobench as gb
from gyrobench.system.system import load_system

room = type(load_system("imu_positions")).__module__
reduction: Any = importlib.import_module(".reduction", room)
budget: Any = importlib.import_module(".budget", room)
DEG = math.pi / 180.0
GYRO, ACC = 5e-8, 3e-6  # rad/s and m/s2, of a window: 0.01 deg/h, 0.3 ug


def lagging(places: list[Any], size: float) -> list[Any]:
    """Where a table stands that lags behind what it reads, by ``size`` against the way each axis was turned last."""
    out, before, way = [], places[0][:2], [0.0, 0.0]
    for x, y, rx, ry, length, count in places:
        for k, (new, rate) in enumerate(((x, rx), (y, ry))):
            way[k] = float(np.sign(rate or new - before[k])) or way[k]
        out.append((x - size * way[0], y - size * way[1], rx, ry, length, count))
        before = x + rx * length * count, y + ry * length * count
    return out


def said(stated: dict[str, float], seed: int = 4, stretched: float = 1.0, lag: float = 0.0) -> dict[str, str]:
    """Reasons of a record of 18 positions and turns at 0.7 rad of latitude, its times longer by a factor, on a table
    that lags behind its angles.
    """
    rng = np.random.default_rng(seed)
    quiet = lambda t0, t1: tuple(s * rng.normal(size=(t0.size, 3)) for s in (GYRO, ACC))  # noqa: E731
    places, unit = plan((*EDGES, *FACES)), Unit.drawn(np.random.default_rng(3), 3e-4)
    w = World().windows(lagging(places, lag), unit, quiet)
    read = World().windows(places, unit)
    w |= {n: read[n] for n in w if n.startswith(("outer", "inner"))}
    w |= {n: stretched * w[n] for n in ("t_start", "t_end")}
    site = {"latitude": 0.7, "gravity": 9.805, "earth_rate": 7.2921159e-5, "nuisances": False, **stated}
    return {r.id: r.text for r in reduction.reduce(w, budget.ImuSetup(**with_sizes(site))).reasons}


def test_a_latitude_that_no_single_gyro_shows_is_named() -> None:
    """0.1 deg changes the level Earth rate by 15.04 sin(0.7) x 0.1 deg = 0.017 deg/h, 1.7 standard deviations of a
    window; with the vertical one, which the g-sensitivity takes, G_kk are off by 3 to 10 u.  What a time base does has
    the same shape: 15.04 x 1e-3 of the level rate are cot(0.7) x 1e-3 rad = 245 arcsec of latitude."""
    assert "table.off" not in said({})
    off = said({"latitude": 0.7 + 0.1 * DEG})
    assert "residuals.contradict" not in off
    assert (
        "latitude, 3" in off["table.off"] and "or as well with" in off["table.off"] and "time base" in off["table.off"]
    )
    late = said({}, stretched=1.001)["table.off"]
    assert "time base, 0.0" in late and "latitude, −" in late
    assert "time_base = 0.0" in late and " 1'" in late


def test_a_hysteresis_of_the_table_is_named() -> None:
    """Both axes stand 5 arcsec behind: 10 arcsec between both ways, which put Sa 5 u off without a word in a third of
    the records; the positions themselves were named as contradicting, or nothing."""
    off = said({}, lag=5.0 * DEG / 3600.0)["table.off"]
    found = re.findall(r"hysteresis of the (outer|inner) angle, −(\d\.\d+)″", off)
    assert {axis for axis, _ in found} == {"outer", "inner"} and all(float(v) == pytest.approx(5.0, abs=0.3)
                                                                     for _, v in found)  # fmt: skip
    assert "inner.angle.hysteresis = -" in off


@pytest.mark.long
def test_a_right_record_shows_none() -> None:
    assert not any("table.off" in said({}, seed) for seed in range(10, 20))


def written(path: Path, head: str, columns: dict[str, Any]) -> Path:
    rows = "\n".join(",".join(f"{v:.12g}" for v in row) for row in np.column_stack(list(columns.values())).tolist())
    site = "# latitude = 40.10704566deg\n# gravity = 9.805m/s2\n# type_b = none\n"
    path.write_text(f"{site}{head}{','.join(columns)}\n{rows}\n", encoding="utf-8")
    return path


def asked_for(path: Path) -> str:
    return next(r.text for r in gb.reduce("imu_positions", path).result.reasons if r.id == "arrangement.unstated")


def test_what_a_table_does_not_show_is_asked_for(tmp_path: Path) -> None:
    """Gravity is in Sa_ii, the clock in Sg_ii, a case turned on its plate in Sa_xy and Sg_xy: no residual has them."""
    rng = np.random.default_rng(4)
    quiet = lambda t0, t1: tuple(s * rng.normal(size=(t0.size, 3)) for s in (GYRO, ACC))  # noqa: E731
    w = World().windows(plan((*EDGES, *FACES), count=2), Unit.drawn(np.random.default_rng(3), 3e-4), quiet)
    units = {n: " [rad]" for n in w if n.startswith(("outer", "inner"))} | {"phase": ""}
    units |= {n: " [rad/s]" if "_g" in n else " [m/s2]" for n in w if n.startswith("mean")}
    text = asked_for(written(tmp_path / "lab.csv", "", {n + units.get(n, " [s]"): v for n, v in w.items()}))
    for said in ("gravity, or the accelerometers, wrong by 0.1 % (Sa_", "the times wrong by 0.1 % (Sg_",
                 "the case turned by 1° on its plate (Sg_xy"):  # fmt: skip
        assert said in text


@pytest.mark.long
def test_what_a_log_by_hand_does_not_show_is_asked_for_and_no_more(tmp_path: Path) -> None:
    """Each mistake is made in means and samples alike: gyros exchanged or reversed against the accelerometers are
    refused by name, and so not asked for; in the means alone, without turns, they had passed for unseen."""
    rng = np.random.default_rng(5)
    series = handled(Unit.drawn(rng, 3e-4), poses(rng, 16), rng, gyro=1e-7, acc=1e-5, rest=2.5)
    names = ["time [s]", *(f"g{a} [rad/s]" for a in "xyz"), *(f"a{a} [m/s2]" for a in "xyz")]
    columns = dict(zip(names, np.column_stack(series).T, strict=True))
    text = asked_for(written(tmp_path / "log.csv", "# attitudes = unknown\n", columns))
    wrong = ("the gyros, or their times, wrong by 2 % (Sg_", "gravity, or the accelerometers, wrong by 0.1 % (Sa_")
    for said in ("the accelerometers reversed", *wrong, "the latitude of the other sign (G_"):
        assert said in text
    assert "exchanged" not in text and "the gyros reversed" not in text and "rotation" not in text


def test_time_series_of_a_table(tmp_path: Path) -> None:
    """Eleven samples of each window of 15 s, at rest and of a turn of 24 deg/s; ``phase`` numbers positions and turns.
    The columns are those of the windows, ``mean_gx`` (it was asked for as mean_gx_gx).
    """
    rng, unit = np.random.default_rng(4), Unit.drawn(np.random.default_rng(3))
    w = World().windows(plan(rate=2.0 * math.pi / 15.0), unit)
    part, names = np.arange(11) / 10.0, [f"mean_{k}{a}" for k in "ga" for a in "xyz"]
    kept = slice(None, -1)  # the end of a window is the beginning of the next one, but for the last of a phase
    rows: list[Any] = []
    for k in range(w["phase"].size):
        ends = k + 1 == w["phase"].size or w["phase"][k + 1] != w["phase"][k]
        at = part if ends else part[kept]
        moving = [w[f"{n}_start"][k] + at * (w[f"{n}_end"][k] - w[f"{n}_start"][k]) for n in ("t", "outer", "inner")]
        noise = [s * rng.normal(size=(3, at.size)) for s in (1e-7, 1e-5)]
        read = np.array([w[n][k] for n in names])[:, None] + np.vstack(noise)
        rows.append(np.vstack([np.full(at.size, w["phase"][k]), *moving, read]))
    columns = ["phase", "time [s]", "outer [rad]", "inner [rad]", *[f"{n} [rad/s]" for n in names[:3]]]
    columns += [f"{n} [m/s2]" for n in names[3:]]
    head = "# window = 15s\n# samples = means\n"
    file = written(tmp_path / "series.csv", head, dict(zip(columns, np.hstack(rows), strict=True)))
    c = {x.name: x for x in gb.reduce("imu_positions", file).result.coefficients}
    tables: Any = importlib.import_module(".tables", room)
    truth = {n: v for n, v in unit.coefficients().items() if n in c}
    assert len(truth) == 33
    assert all(
        abs(c[n].estimate * tables.SCALES[c[n].unit] - v) < 5.0 * c[n].u * tables.SCALES[c[n].unit]
        for n, v in truth.items()
    )
