"""The intermittent tumble: a table that rests at equally spaced angles, simulated and written from the equations."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tumble as T
from commanding import Command
from tumbling import DPH, STOPPING, errors, gyro, latitude, load, quiet

from gyrobench.engine.session import Session
from gyrobench.exchange.external_record import shortest_window
from gyrobench.reduction.estimation import noise
from gyrobench.result import Result
from gyrobench.workflow.saved_run import lacking_phases

NAME = "tumble_single_axis"


def reduced_run(session: Session, values: dict[str, Any], seed: int = 1) -> Result:
    system = load().with_values(values)
    result: Result = system.reduce(session.run(values, seed=seed))
    return result


# ------------------------------------------------------------------------------------------- simulated
@pytest.mark.parametrize("seed", range(3))
def test_random_gyros_at_random_latitudes(session: Session, seed: int) -> None:
    """Noise off: at rest the loop has no lag, so what is left is rounding."""
    rng = np.random.default_rng(seed)
    values = {**STOPPING, **quiet(load()), **gyro(rng), "latitude": latitude(rng)}
    result = reduced_run(session, values)
    for name, off in errors(result, values).items():
        assert abs(off) < 1e-9, name
    for c in result.coefficients:
        assert c.closed == pytest.approx(c.estimate, abs=1e-9), c.name


def test_turns_in_both_senses(session: Session) -> None:
    """Two turns of 12 stops each way: 24 stops a phase, the table back where it was; turns are told apart."""
    rng = np.random.default_rng(4)
    values = {**STOPPING, "stops": 12, "windows": 12, "turns": 2, "both_senses": True, "stop_dwell": 1.0}
    values = {**values, **gyro(rng), "latitude": latitude(rng), "gyro.markov": 0.0}
    record = session.run(values, seed=3)
    result = load().with_values(values).reduce(record)
    w, modes = record.windows, {row.phase: row.mode for row in record.run.plan}
    assert [modes[p] for p in sorted(modes)] == ["index", "step", "step", "index", "step", "step"]
    assert lacking_phases(record) == []
    for p in (2, 3, 5, 6):
        angles = w["angle_start"][w["phase"] == p]
        assert angles.size == 24
        assert np.diff(angles) == pytest.approx(np.full(23, (-1.0 if p in (2, 5) else 1.0) * math.pi / 6.0), abs=1e-9)
    assert w["angle_end"][w["phase"] == 3][-1] == pytest.approx(w["angle_start"][w["phase"] == 2][0], abs=1e-9)
    table = next(t for t in result.tables if t.id == "harmonics_of_each_turn")
    assert [row[1] for row in table.rows] == [1, 2] * 4
    for c in result.coefficients:
        assert abs(c.estimate - values[f"gyro.{c.name}"] / DPH) < 5.0 * c.u, c.name


def test_plan_of_72_stops_needs_no_more_phases() -> None:
    """The plan of 146 rests has four phases; a dwell has windows of the length of those at the stops."""
    system = load().with_values({"stops": 72, "stop_dwell": 60.0, "dwell": 630.0, "settle": 5.0})
    plan = system.plan()
    assert [p.stops for p in plan.phases] == [1, 72, 1, 72]
    assert plan.problems() == []
    assert plan.duration() == pytest.approx(2 * (635.0 + 72 * 65.0))
    assert plan.phases[0].window == pytest.approx(63.0)  # 630/10: ten windows are nearest to 60 s
    assert shortest_window(system) == pytest.approx(60.0)


@pytest.mark.parametrize(("values", "text"), [
    ({"stops": 11}, "stops = 11: 12 to 72 stops a turn are possible"),
    ({"stops": 24, "stop_dwell": 0.0}, "stop_dwell = 0: nothing is averaged"),
])  # fmt: skip
def test_refused_plans(values: dict[str, Any], text: str) -> None:
    assert any(text in p for p in load().with_values(values).check())


# ------------------------------------------------------------------------------------------- written from the equations
EARTH, G, SCALE = 7.292115e-5, 9.8067, 17.2 * math.pi / 648000.0 / 1e-3
TRUE = {"F": -0.31, "I": 0.92, "O": 0.12, "S": -0.67, "II": -0.052, "SS": 0.043, "IO": 0.031, "OS": -0.022, "IS": 0.147}


def at(mount: str, theta: np.ndarray[Any, Any], phi: float) -> tuple[np.ndarray[Any, Any], ...]:
    """X, Y, Z of Hu 1981, eq. 3-13, 3-15, 3-17, 3-19 over theta = -(table angle), and minus the Earth rate along O."""
    g, one = G / 9.80665, np.ones_like(theta)
    c, s = math.cos(phi), math.sin(phi)
    if mount.startswith("static"):
        sense = -1.0 if mount == "static 3" else 1.0
        return 0.0 * one, sense * g * one, 0.0 * one, sense * EARTH * s * one
    sense = -1.0 if mount == "mount 1" else 1.0
    return -g * c * np.sin(theta), sense * g * s * one, sense * g * c * np.cos(theta), sense * EARTH * one


def windows(
    stops: int = 24, each: int = 2, dwell: float = 300.0, rest: int = 8, rate: float = 0.0, tilt: float = 0.0,
    phi: float = math.radians(45.75), true: dict[str, float] = TRUE,
) -> dict[str, np.ndarray[Any, Any]]:  # fmt: skip
    """Means of an ideal gyro, rad/s and A.  rate: of a table that turns in place of resting, in Earth rates, with
    ``stops`` windows a turn.  tilt: of the input axis towards the output axis, rad.
    """
    rows, t, turned = [], 0.0, 0.0
    for number, mount in enumerate(("static 3", "mount 1", "static 4", "mount 2"), 1):
        length = dwell / each
        turning = mount.startswith("mount") and rate > 0.0
        count = (stops if turning else stops * each) if mount.startswith("mount") else rest
        for k in range(count):
            first = turned + 2.0 * math.pi / stops * (k if turning else k // each) if mount[0] == "m" else turned
            last, long = first, length
            if turning:
                last, long = first + 2.0 * math.pi / stops, 2.0 * math.pi / stops / (rate * EARTH)
            t += 11.0 if not turning and k % each == 0 else 0.0
            theta = np.linspace(first, last, 41)
            X, Y, Z, across = at(mount, theta, phi)
            d = true["F"] + true["I"] * X + true["O"] * Y + true["S"] * Z + true["II"] * X * X + true["SS"] * Z * Z
            d = d + true["IO"] * X * Y + true["OS"] * Y * Z + true["IS"] * X * Z
            # the output axis is -sense P; the table's own rate about P is -rate
            along = -(across - np.sign(across) * (rate * EARTH if turning else 0.0)) * tilt
            i = (along - d * DPH) / SCALE
            mean = (np.sum(i[1:-1]) + (i[0] + i[-1]) / 2.0) / 40.0 if turning else i[0]
            rows.append([number, t, t + long, -first, -last, mean])
            t += long
        turned += 2.0 * math.pi if mount == "mount 1" else 0.0
    names = ("phase", "t_start", "t_end", "angle_start", "angle_end", "mean")
    return {n: np.array([r[j] for r in rows]) for j, n in enumerate(names)}


def text(w: dict[str, np.ndarray[Any, Any]], stops: str = "24", statement: str = "type_b = none") -> str:
    head = ["# latitude = 45.75deg", "# gravity = 9.8067m/s2", "# k = 17.2deg/h/mA", f"# {statement}"]
    head += [f"# stops = {stops}"] if stops else []
    head += [f"# phase {k} = {n}" for k, n in enumerate(("static 3", "mount 1", "static 4", "mount 2"), 1)]
    head += ["phase,t_start [s],t_end [s],angle_start [deg],angle_end [deg],mean [mA]"]
    columns = [w["phase"], w["t_start"], w["t_end"], *(np.degrees(w[f"angle_{e}"]) for e in ("start", "end"))]
    rows = zip(*columns, w["mean"] * 1e3, strict=True)
    return "\n".join([*head, *(f"{p:.0f}," + ",".join(f"{v:.12g}" for v in r) for p, *r in rows)]) + "\n"


def reduced(file: Path) -> Result:
    system = load()
    assert system.measured_data is not None
    result: Result = system.reduce(system.measured_data.read(system, file, {}))
    return result


@pytest.mark.parametrize(("stops", "each"), [(12, 1), (24, 2), (72, 1)])
def test_a_file_from_the_equations(tmp_path: Path, stops: int, each: int) -> None:
    """White noise of 1e-7 deg/h lets the noise be estimated; the twelfth digit of the file is far below."""
    w = windows(stops, each)
    w["mean"] += np.random.default_rng(1).normal(size=w["mean"].size) * 1e-7 * DPH / SCALE
    file = tmp_path / "lab.csv"
    file.write_text(text(w, str(stops)), encoding="utf-8")
    result = reduced(file)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(TRUE[c.name[2:]], abs=6e-7), c.name
        assert c.closed == pytest.approx(c.estimate, abs=6e-7), c.name
    assert "at rest" in result.method


def test_stops_not_equally_spaced(tmp_path: Path) -> None:
    """Without four of its stops least squares holds, the harmonics of the source do not and are left out."""
    w = windows(24, 2)
    w["mean"] += np.random.default_rng(1).normal(size=w["mean"].size) * 1e-7 * DPH / SCALE
    keep = ~((w["phase"] == 2) & (w["angle_start"] < -5.2))
    file = tmp_path / "lab.csv"
    file.write_text(text({n: v[keep] for n, v in w.items()}), encoding="utf-8")
    result = reduced(file)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(TRUE[c.name[2:]], abs=6e-7), c.name
        assert c.closed is None


def test_a_time_series(command: Command, tmp_path: Path) -> None:
    """A sample every 10 s with the phase in each, 0 in the moves: windows are those of stop_dwell."""
    w = windows(12, 1, 120.0, 1)
    lines = text(w, "12").splitlines()[:-15]
    head = [x for x in lines if x.startswith("#")] + ["# stop_dwell = 120s", "# windows = 12", "# settle = 1s"]
    rows = ["time [s],phase,angle [deg],current [mA]"]
    scatter = np.random.default_rng(5).normal(size=(w["mean"].size, 13)) * 1e-6 * DPH / SCALE
    for k in range(w["mean"].size):
        for j in range(13):
            row = (w["t_start"][k] + 10.0 * j, math.degrees(w["angle_start"][k]), (w["mean"][k] + scatter[k, j]) * 1e3)
            rows.append(f"{row[0]:.6f},{w['phase'][k]:.0f},{row[1]:.10f},{row[2]:.14g}")
        rows.append(f"{w['t_end'][k] + 5.0:.6f},0,{math.degrees(w['angle_start'][k]) - 7.0:.6f},0.1")
    file = tmp_path / "series.csv"
    file.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    result = reduced(file)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(TRUE[c.name[2:]], abs=1e-5), c.name


# ------------------------------------------------------------------------------------------- refused files
def still(w: dict[str, np.ndarray[Any, Any]]) -> dict[str, np.ndarray[Any, Any]]:
    return {**w, "angle_start": 0.0 * w["angle_start"], "angle_end": 0.0 * w["angle_end"]}


def hurried(w: dict[str, np.ndarray[Any, Any]]) -> dict[str, np.ndarray[Any, Any]]:
    """The windows reach from the end of the one before, over the moves."""
    return {**w, "t_start": np.concatenate([[0.0], w["t_end"][:-1]])}


@pytest.mark.parametrize(("content", "words"), [
    (text(windows(), ""), ["does not move", "state stops = N"]),
    (text(still(windows()), ""), ["does not move, expected a turning table (rate 0?)\n"]),
    (text(windows(72, 1, rate=10.0), "24"), ["turns by 5° in a window", "of a turning table state stops = 0"]),
    (text(still(windows())), ["rests at 1 angles of the circle, at least 5"]),
    (text(hurried(windows())), ["the table moves by 15° at t = ", "in no time, expected windows at rest alone"]),
    (text(windows(), "100"), ["stops", "100", "72"]),
])  # fmt: skip
def test_refused_files(command: Command, tmp_path: Path, content: str, words: list[str]) -> None:
    file = tmp_path / "lab.csv"
    file.write_text(content, encoding="utf-8")
    code, _, err = command("reduce", "tumble_single_axis", "--data", file)
    assert code == 2, err
    for word in words:
        assert word in err + "\n"


# ------------------------------------------------------------------------------------------- against the continuous one
#: a turn of either takes 8616 s; of a stop, 11 s are lost in moving and settling
TURN_TIME = 2.0 * math.pi / (10.0 * EARTH)
EQUAL = {"stops": 24, "each": 3, "dwell": TURN_TIME / 24.0 - 11.0, "rest": 10}


TURNING: dict[str, Any] = {"stops": 72, "each": 1, "dwell": 120.0, "rest": 10, "rate": 10.0}


def noisy(w: dict[str, np.ndarray[Any, Any]], seed: int, size: float = 0.003) -> dict[str, np.ndarray[Any, Any]]:
    """White drift, ``size`` deg/h in a window of 120 s."""
    scatter = size * np.sqrt(120.0 / (w["t_end"] - w["t_start"]))
    return {**w, "mean": w["mean"] + np.random.default_rng(seed).normal(size=w["mean"].size) * scatter * DPH / SCALE}


@pytest.mark.long
def test_continuous_and_intermittent_agree(tmp_path: Path) -> None:
    """The same gyro in equal time: the differences are within what both state."""
    file = tmp_path / "lab.csv"
    results = []
    for w, stops, seed in ((windows(**EQUAL), "24", 1), (windows(**TURNING), "", 2)):
        file.write_text(text(noisy(w, seed), stops), encoding="utf-8")
        results.append({c.name: c for c in reduced(file).coefficients})
    for name, c in results[0].items():
        other = results[1][name]
        assert abs(c.estimate - other.estimate) < 3.0 * math.hypot(c.u, other.u), name
        assert abs(c.estimate - TRUE[name[2:]]) < 3.5 * c.u, name


def known_noise(
    w: dict[str, np.ndarray[Any, Any]], mode: str, share: float, tilt: bool = False
) -> np.ndarray[Any, Any]:
    """u of the nine coefficients under noise that is known: ``share`` of the variance of a window of 120 s is slow, of
    3000 s, the rest white.
    """
    rows = {**w, "phase": w["phase"].astype(int), "std": 0.0 * w["mean"]}
    s = T.setup(gravity=G, modes={1: "dwell", 2: mode, 3: "dwell", 4: mode}, tilt=tilt)
    test = T.reduction.Reduction(rows, s)
    test.terms = T.NAMES
    X, t0, t1 = test.design(test.turning), w["t_start"], w["t_end"]
    white = np.diag((1.0 - share) * 120.0 / (t1 - t0) + 1e-9)
    C = white + share * noise.process_covariance(t0, t1, 3000.0)
    u: np.ndarray[Any, Any] = np.sqrt(np.diag(np.linalg.inv(X.T @ np.linalg.solve(C, X))))
    return u


@pytest.mark.parametrize(("share", "low", "high"), [(0.0, 1.013, 1.018), (0.5, 0.97, 1.02), (1.0, 0.49, 1.05)])
def test_which_noise_is_seen_better_by_which(share: float, low: float, high: float) -> None:
    """Ratio of u in equal time, intermittent to continuous.

    White noise: a turn averages 348 s of every 359 s, sqrt(359/348) = 1.016.  Slow drift alone cannot follow a move of
    15 degrees in 11 s: D_I, D_IO, D_OS, D_IS have half the u.  As much white noise in a window takes that away.
    """
    ratio = known_noise(windows(**EQUAL), "step", share) / known_noise(windows(**TURNING), "rate", share)
    assert np.all((low < ratio) & (ratio < high))
    if share == 1.0:
        assert ratio[[1, 6, 7, 8]] == pytest.approx([0.53, 0.53, 0.53, 0.50], abs=0.01)


@pytest.mark.long
def test_tilt_of_the_input_axis(tmp_path: Path) -> None:
    """60" towards the output axis: at rest it brings W sin 60" = 0.0044 deg/h, in turns of 10 W 9 times as much.

    Both find it; the closed formulas read D_O too large by eps W sin(phi)/gamma = 0.0031 deg/h/g.  u(eps) from the
    means of the mounts against the dwells: at rest the tilt is hardly another thing than D_O.
    """
    file, tilt = tmp_path / "lab.csv", math.pi / 10800.0
    for w, stops in ((windows(**EQUAL, tilt=tilt), "24"), (windows(**TURNING, tilt=tilt), "")):
        file.write_text(text(noisy(w, 3, 1e-5), stops).replace("# type_b", "# tilt = yes\n# type_b"), encoding="utf-8")
        found = {c.name: c for c in reduced(file).coefficients}
        assert found["ε_IO"].estimate == pytest.approx(60.0, abs=5.0 * found["ε_IO"].u)
        assert found["D_O"].estimate == pytest.approx(TRUE["O"], abs=5.0 * found["D_O"].u)
        off = tilt * EARTH * math.sin(math.radians(45.75)) / (G / 9.80665) / DPH
        assert found["D_O"].closed == pytest.approx(TRUE["O"] + off, abs=1e-4)
    both = [known_noise(w, mode, 0.0, True) for w, mode in ((windows(**EQUAL), "step"), (windows(**TURNING), "rate"))]
    ratio = both[0] / both[1]
    assert ratio[[2, 9]] == pytest.approx([2.28, 19.9], abs=0.05)  # D_O, eps
    assert np.delete(ratio, [2, 9]) == pytest.approx(np.full(8, 1.016), abs=0.003)
