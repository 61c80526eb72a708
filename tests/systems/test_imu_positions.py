"""Positions and turns of an inertial measurement unit: the reduction against a world in plain numpy and scipy, the
co-simulation, what a plan does not see, mistakes that are named, errors of the set-up.  [IMU-POSITIONS]"""

from __future__ import annotations

import importlib
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imu_world import EDGES, FACES, Unit, World, plan
from scipy.spatial.transform import Rotation
from stated import with_sizes

import gyrobench as gb
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.system import load_system
from gyrobench.system.values import InvalidValueError

room = type(load_system("imu_positions")).__module__
reduction: Any = importlib.import_module(".reduction", room)
geometry: Any = importlib.import_module(".geometry", room)
budget: Any = importlib.import_module(".budget", room)
tables: Any = importlib.import_module(".tables", room)
ARCSEC = math.pi / 648000.0
G0 = 9.80665
GYRO, ACC = 3e-6, 5e-4  # noise densities, rad/s/sqrt(Hz), m/s2/sqrt(Hz)


def setup(world: World, **more: Any) -> Any:
    site = {"latitude": world.latitude, "gravity": world.gravity, "earth_rate": 7.2921159e-5}
    return budget.ImuSetup(**with_sizes({**site, "nuisances": False, **more}))


def white(rng: np.random.Generator) -> Any:
    def noise_of(t0: Any, t1: Any) -> Any:
        size = 1.0 / np.sqrt(t1 - t0)[:, None]
        return GYRO * size * rng.normal(size=(t0.size, 3)), ACC * size * rng.normal(size=(t0.size, 3))

    return noise_of


def estimates(result: Any) -> dict[str, float]:
    return {c.name: c.estimate * tables.SCALES[c.unit] for c in result.coefficients}


def test_felt_is_that_of_a_plain_world() -> None:
    """Rate and specific force of windows at rest, of half turns and of three turns, set-up errors on; with 720 sums a
    turn the world is exact to 1e-6 of the ripple, whole turns to rounding."""
    error = geometry.SetUp(turned=(1e-3, -2e-3, 3e-3), squareness=1.5e-3, mount=(2e-3, 1e-3, -1e-3))
    world = World(0.9, 9.81, Rotation.from_rotvec(error.mount), Rotation.from_rotvec(error.turned), error.squareness)
    plans = [(0.3, -2.0, 0.0, 0.0, 5.0, 2), (0.2, 0.7, 1.0, 0.0, math.pi, 1), (0.2, 0.7, 0.0, -2.0, 3.0 * math.pi, 2)]
    none = Unit(np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3)))
    w = world.windows(plans, none)
    omega, force = geometry.Motion.of(w).felt(0.9, 9.81, 7.2921159e-5, error)
    # the instrument turned by a vector of its own axes: both agree to second order in 1e-3
    assert np.abs(omega - np.array([w[f"mean_g{a}"] for a in "xyz"]).T).max() < 1e-11 + 3e-6
    assert np.abs(force - np.array([w[f"mean_a{a}"] for a in "xyz"]).T).max() < 2e-5
    exact = World(0.9, 9.81)
    w = exact.windows(plans, none)
    omega, force = geometry.Motion.of(w).felt(0.9, 9.81, 7.2921159e-5)
    assert np.abs(omega - np.array([w[f"mean_g{a}"] for a in "xyz"]).T).max() < 1e-9
    assert np.abs(force - np.array([w[f"mean_a{a}"] for a in "xyz"]).T).max() < 2e-5


@pytest.mark.parametrize("seed", range(3))
def test_recovers_a_random_unit_without_noise(seed: int) -> None:
    rng = np.random.default_rng(seed)
    world, unit = World(rng.uniform(-1.2, 1.2)), Unit.drawn(rng, 0.02)
    result = reduction.reduce(world.windows(plan(), unit), setup(world))
    truth = unit.coefficients()
    for n, value in estimates(result).items():
        assert value == pytest.approx(truth[n], abs=3e-9 if n[0] == "S" else 1e-8), n
    assert len(result.coefficients) == 33


@pytest.mark.long
def test_co_simulation_recovers_the_unit() -> None:
    """Noise off: the coefficients are those of the part, to the trapezoid of the sampler over turning windows."""
    unit = Unit.drawn(np.random.default_rng(5))
    values: dict[str, Any] = {
        "imu.gyro_bias": unit.bg.tolist(), "imu.gyro_scale": unit.Sg.tolist(), "imu.g_sensitivity": unit.G.tolist(),
        "imu.acc_bias": unit.ba.tolist(), "imu.acc_scale": unit.Sa.tolist(), "positions": 6, "dwell": 4.0,
        "settle": 1.0, "turns": 1, "rate": 1.0, "nuisances": "none",
        **{f"imu.{a}_{n}": 0.0 for a in "xyz" for n in ("gyro", "acc")},
    }  # fmt: skip
    run = gb.load("imu_positions", values).run(seed=1, check_step=False)
    truth = unit.coefficients()
    found = estimates(run.result)
    assert set(found) == set(truth)
    for n, value in found.items():
        size = {"S": 2e-8, "b": 1e-8 if n[1] == "g" else 1e-7, "G": 1e-8}[n[0]]
        assert value == pytest.approx(truth[n], abs=size), n


@pytest.mark.long
def test_intervals_hold_the_truth() -> None:
    """24 runs, 33 coefficients: noise of the population (white, Gauss-Markov or both), whole skeleton; the share of 792
    intervals, those of a run being related, within 0.92 .. 0.98.  tests/benchmarks/imu_positions.py counts more."""
    hits = total = 0
    for seed in range(24):
        rng = np.random.default_rng(100 + seed)
        world, unit = World(rng.uniform(-1.2, 1.2)), Unit.drawn(rng)
        w = world.windows(plan(FACES + EDGES), unit, white(rng))
        truth = unit.coefficients()
        for c in reduction.reduce(w, setup(world)).coefficients:
            low, high = (x * tables.SCALES[c.unit] for x in c.interval)
            hits += low <= truth[c.name] <= high
            total += 1
    assert total == 24 * 33 and 0.92 < hits / total < 0.98


def test_plan_without_turns_says_what_it_does_not_see() -> None:
    system = load_system("imu_positions")
    system.set("turns", "0")
    assert "Sg_xx, Sg_yx, Sg_zx" in system.warnings()[0] and "any axis" in system.warnings()[0]
    rng = np.random.default_rng(3)
    world, unit = World(), Unit.drawn(rng, 0.01)
    w = world.windows(plan(rate=0.0), unit, white(rng))
    result = reduction.reduce(w, setup(world, u_gyro_scale=0.01, truth=unit.coefficients()))
    names = {c.name for c in result.coefficients}
    assert not any(n.startswith("Sg") for n in names) and {"bg_x", "G_xx", "Sa_xx"} <= names
    assert any("not estimable: Sg_xx" in r.text for r in result.reasons)
    # 1 % of the Earth rate, some 0.1 deg/h at this latitude, is in u of the bias beside 0.02 deg/h of noise
    bias = next(c for c in result.coefficients if c.name == "bg_z")
    assert bias.u > 0.07 and any("not shown by the plan" in line.source for line in result.budget)


def test_one_axis_of_turns() -> None:
    rng = np.random.default_rng(4)
    world, unit = World(), Unit.drawn(rng)
    w = world.windows(plan(axes="xz"), unit, white(rng))
    names = {c.name for c in reduction.reduce(w, setup(world)).coefficients}
    assert {"Sg_xx", "Sg_yz"} <= names and not {"Sg_xy", "Sg_yy"} & names


MISTAKES = {
    "accelerometers: x and y are exchanged": lambda w: w | {"mean_ax": w["mean_ay"], "mean_ay": w["mean_ax"]},
    "accelerometers: the sign of z is reversed; so labelled the triad is left-handed": lambda w: (
        w | {"mean_az": -w["mean_az"]}
    ),
    "accelerometers: the sign of x and y and z is reversed (all of them": lambda w: (
        w | {f"mean_a{a}": -w[f"mean_a{a}"] for a in "xyz"}
    ),
    "the axes are labelled otherwise: x reads y, y reads −x, z reads z: the columns": lambda w: (
        w | {"mean_ax": w["mean_ay"], "mean_ay": -w["mean_ax"]}
    ),
    "accelerometers: readings in g were taken for m/s²": lambda w: (
        w | {f"mean_a{a}": w[f"mean_a{a}"] / G0 for a in "xyz"}
    ),
    "gyros: y and z are exchanged": lambda w: w | {"mean_gz": w["mean_gy"], "mean_gy": w["mean_gz"]},
    "gyros: readings in °/s were taken for rad/s": lambda w: (
        w | {f"mean_g{a}": np.degrees(w[f"mean_g{a}"]) for a in "xyz"}
    ),
}


@pytest.mark.parametrize("said", MISTAKES)
def test_mistakes_are_named(said: str) -> None:
    rng = np.random.default_rng(6)
    world = World()
    w = MISTAKES[said](world.windows(plan(), Unit.drawn(rng), white(rng)))
    with pytest.raises(ReductionError) as error:
        reduction.reduce(w, setup(world))
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("visits", "0 0; 90 0; 180 0; -90 0; 45 0; 135 0", "directions of gravity: rank"),
        ("visits", "0 0; 90 0; 180 0", "positions for 4 unknowns of an instrument: at least 5"),
        ("positions", "7", "positions = 7: 6, 12, 18, 20, 24, 26, 36 are possible"),
        ("rate_axes", "xw", "rate_axes = xw: letters of xyz are expected"),
        ("visits", "0 up", "visits, visit 1"),
    ],
)
def test_refused_before_the_run(option: str, value: str, said: str) -> None:
    chosen = gb.load("imu_positions", {"turns": 0 if option == "visits" else 1, option: value})
    with pytest.raises((InvalidConfigurationError, InvalidValueError)) as error:
        chosen.run(seed=1)
    assert said in str(error.value)


@pytest.mark.parametrize(
    ("values", "source"),
    [
        ({"square": 20.0 * ARCSEC}, "table.square"),
        ({"case": Rotation.from_rotvec([20.0 * ARCSEC, 0.0, 0.0])}, "mount.1"),
        ({"case": Rotation.from_rotvec([0.0, -30.0 * ARCSEC, 0.0])}, "mount.2"),
        ({"table": Rotation.from_rotvec([0.0, 20.0 * ARCSEC, 0.0])}, "outer.axis.level"),
        ({"table": Rotation.from_rotvec([0.0, 0.0, 40.0 * ARCSEC])}, "outer.axis.azimuth"),
        ({"table": Rotation.from_rotvec([20.0 * ARCSEC, 0.0, 0.0])}, "outer.angle.zero"),
        ({"gravity": 9.805 - 1e-4}, "gravity"),
        ({"latitude": 0.7 - 1e-3}, "latitude"),
    ],
)
def test_errors_of_the_set_up_shift_as_the_budget_says(values: Any, source: str) -> None:
    """What an error does to the data, by a world that has it, is the line of the budget, to second order of 1e-4."""
    known = {"mount.2": -30.0 * ARCSEC, "outer.axis.azimuth": 40.0 * ARCSEC, "gravity": 1e-4, "latitude": 1e-3}
    size = known.get(source, 20.0 * ARCSEC)
    unit, exact = Unit.drawn(np.random.default_rng(8)), World()
    off = World(**{"latitude": 0.7, "gravity": 9.805, **values})
    clean, wrong = (reduction.Reduction(w.windows(plan(), unit), setup(exact)) for w in (exact, off))
    largest = 0.0
    for name in reduction.Reduction.names:
        data = [test.of_channel(name).regression().y for test in (clean, wrong)]
        channel = clean.of_channel(name)
        effect = next(e for e in channel.effects(channel.fitted()) if e.id == source)
        assert effect.error is not None
        largest = max(largest, float(np.abs(data[1] - data[0]).max()))
        second = size**2 * (1.0 if name[0] == "g" else 10.0)  # order, times 1 rad/s, g
        least = 1e-3 * float(np.abs(size * effect.error).max()) + second
        assert data[1] - data[0] == pytest.approx(size * effect.error, abs=least)
    assert largest > 1e-9


def test_angles_between_the_axes_do_not_see_the_mount() -> None:
    unit, world = Unit.drawn(np.random.default_rng(9)), World(case=Rotation.from_rotvec([1e-3, -2e-3, 1.5e-3]))
    found = {}
    for name, w in (("straight", World()), ("turned", world)):
        table = next(t for t in reduction.reduce(w.windows(plan(), unit), setup(w)).tables if t.id == "imu.angles")
        found[name] = np.array([row[2] for row in table.rows])
    assert found["turned"] == pytest.approx(found["straight"], abs=0.01)  # arcsec; misalignments differ by 400"
    row = (np.eye(3) + unit.Sa)[[0, 1]]
    true = (
        math.degrees(math.acos(row[0] @ row[1] / np.linalg.norm(row[0]) / np.linalg.norm(row[1]))) * 3600.0 - 324000.0
    )
    assert found["straight"][3] == pytest.approx(true, abs=0.01)


def laboratory(folder: Path, w: dict[str, Any], world: World) -> Any:
    """A laboratory's file of the windows, read."""
    units = {"phase": "", **dict.fromkeys(("t_start", "t_end"), " [s]"), **dict.fromkeys(geometry.ANGLES, " [rad]")}
    units |= {f"mean_g{a}": " [rad/s]" for a in "xyz"} | {f"mean_a{a}": " [m/s2]" for a in "xyz"}
    rows = "\n".join(",".join(f"{v:.15g}" for v in row) for row in np.column_stack([w[n] for n in units]).tolist())
    path = folder / "lab.csv"
    head = f"# latitude = {math.degrees(world.latitude):.12g}deg\n# gravity = {world.gravity}m/s2\n"
    path.write_text(f"{head}{','.join(n + u for n, u in units.items())}\n{rows}\n", encoding="utf-8")
    system = load_system("imu_positions")
    assert system.measured_data is not None
    return system.measured_data.read(system, path, {})


def exchanged(w: dict[str, Any]) -> dict[str, Any]:
    """The angles of the first two positions exchanged."""
    out = dict(w)
    for n in geometry.ANGLES:
        out[n] = w[n].copy()
        out[n][w["phase"] == 1], out[n][w["phase"] == 2] = w[n][w["phase"] == 2], w[n][w["phase"] == 1]
    return out


LABELS = {
    "outer and inner angle exchanged": lambda w: (
        w
        | {a.replace("outer", "inner"): w[a] for a in geometry.ANGLES[:2]}
        | {a.replace("inner", "outer"): w[a] for a in geometry.ANGLES[2:]}
    ),
    "the outer rotation reversed": lambda w: w | {a: -w[a] for a in geometry.ANGLES[:2]},
    "the inner rotation reversed": lambda w: w | {a: -w[a] for a in geometry.ANGLES[2:]},
    "positions 1 and 2 exchanged": exchanged,
}


@pytest.mark.parametrize("said", LABELS)
@pytest.mark.long
def test_mistaken_angles_of_a_file_are_named(said: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(10)
    world, places = World(), (*EDGES[4:], *EDGES[:4], *FACES)
    w = LABELS[said](world.windows(plan(places), Unit.drawn(rng), white(rng)))
    with pytest.raises(ReductionError) as error:
        reduction.Reduction.from_record(laboratory(tmp_path, w, world))
    assert said in str(error.value)


def stayed(w: dict[str, Any]) -> dict[str, Any]:
    """The case stood in position 4 while position 5 was written down."""
    out = dict(w)
    for a in "xyz":
        for n in (f"mean_g{a}", f"mean_a{a}"):
            out[n] = w[n].copy()
            out[n][w["phase"] == 5] = w[n][w["phase"] == 4]
    return out


def left_out(w: dict[str, Any]) -> dict[str, Any]:
    """Position 7 was left out: the readings of 8 to 18 were written beside the angles of 7 to 17."""
    kept = {n: v[w["phase"] != 18] for n, v in w.items()}
    for a in "xyz":
        for n in (f"mean_g{a}", f"mean_a{a}"):
            kept[n] = np.where(kept["phase"] < 7, kept[n], w[n][w["phase"] != 7])
    return kept


FORGOTTEN = {
    "position 5 forgotten (the case stayed in position 4)": stayed,
    "position 7 forgotten (from it on the next ones were read)": left_out,
}


@pytest.mark.parametrize("said", FORGOTTEN)
@pytest.mark.long
def test_a_forgotten_position_is_named(said: str, tmp_path: Path) -> None:
    rng = np.random.default_rng(10)
    world, places = World(), (*EDGES[4:], *FACES, *EDGES[:4])
    w = FORGOTTEN[said](world.windows(plan(places, rate=0.0), Unit.drawn(rng), white(rng)))
    try:  # refused where the readings are not those of three axes, otherwise a reason that takes the verdicts
        result = reduction.Reduction.from_record(laboratory(tmp_path, w, world))
        told = " ".join(r.text for r in result.reasons if r.id == "handling.error")
    except ReductionError as error:
        told = str(error)
    assert said in told


@pytest.mark.long
def test_a_file_gives_what_its_windows_give(tmp_path: Path) -> None:
    rng = np.random.default_rng(12)
    world, unit = World(), Unit.drawn(rng)
    w = world.windows(plan(), unit, white(rng))
    file = estimates(reduction.Reduction.from_record(laboratory(tmp_path, w, world)))
    own = estimates(reduction.reduce(w, setup(world, nuisances=True)))
    assert file == pytest.approx(own, rel=1e-6, abs=1e-12)


@pytest.mark.long
def test_position_that_is_off_contradicts_the_model(tmp_path: Path) -> None:
    """One position a degree off: the constants of the phases differ by more than the noise, and nothing passes."""
    rng = np.random.default_rng(13)
    world = World()
    w = world.windows(plan(), Unit.drawn(rng), white(rng))
    for n in geometry.ANGLES[:2]:
        w[n] = np.where(w["phase"] == 8, w[n] + math.radians(1.0), w[n])
    result = reduction.Reduction.from_record(laboratory(tmp_path, w, world))
    assert any(r.id.startswith("residuals.contradict") and "constants of the phases" in r.text for r in result.reasons)


def test_an_axis_that_leans_up_and_down_is_in_the_scale_factor() -> None:
    """x leans by 8 mrad towards z both ways, no other error: it reads cos 8e-3 - 1 = -32 ppm too little, z 8 mg.  z
    may have a bias of it as well; noise alone leaves 0.5 ppm.
    """
    rng, n, g, lean = np.random.default_rng(4), 40, World().gravity, 8e-3
    sign, start = np.repeat([1.0, -1.0], n), 3.0 * np.arange(2 * n)
    read = {"x": g * math.cos(lean) * sign, "y": np.zeros(2 * n), "z": np.full(2 * n, g * math.sin(lean))}
    w = {"phase": np.repeat([1, 2], n), "t_start": start, "t_end": start + 3.0}
    w |= {f"mean_a{a}": v + 3e-5 * rng.normal(size=2 * n) for a, v in read.items()}
    w |= {f"mean_g{a}": 1e-6 * rng.normal(size=2 * n) for a in "xyz"}
    updown: Any = importlib.import_module(".updown", room)
    world = World()
    found = next(c for c in updown.UpDownReduction.reduce(w, setup(world)).coefficients if c.name == "Sa_xx")
    assert found.estimate == pytest.approx(-32.0, abs=3.0)
    assert found.interval[0] < 0.0 < found.interval[1] and found.u == pytest.approx(32.0 / math.sqrt(3.0), rel=0.1)


def test_the_error_of_the_table_is_named_that_the_accelerometers_show() -> None:
    """Axes 60" out of the right angle and a table 60" out of level, of a record that states neither: both are named as
    large as they are.  The right angle is in Sg_yx and Sg_yz of the gyros, whose residuals show nothing: no verdict.
    With these as corrections nothing is left; a position that was read 300 µg too large is no such error."""
    rng = np.random.default_rng(8)
    table = Rotation.from_rotvec([0.0, 60.0 * ARCSEC, 0.0])
    world, unit, places = World(0.7, 9.805, table=table, square=60.0 * ARCSEC), Unit.drawn(rng), plan(FACES + EDGES)
    windows = world.windows(places, unit, white(rng))
    result = reduction.reduce(windows, setup(world))
    off = next(r for r in result.reasons if r.id == "table.off")
    found = {n: float(v) for n, v in re.findall(r"([a-z.]+) = ([-\d.]+)\(", off.text)}
    assert found == {"table.square": pytest.approx(60.0, abs=3.0), "outer.axis.level": pytest.approx(60.0, abs=6.0)}
    assert off.severity == "error" and off.blocks == ("pass", "fail") and not off.names
    corrected = reduction.reduce(windows, setup(world, corrections=off.text.split("'")[1]))
    assert not any(r.id in ("table.off", "residuals.contradict") for r in corrected.reasons)
    truth, values = unit.coefficients(), {c.name: c for c in corrected.coefficients}
    for n in ("Sg_yx", "Sg_yz"):
        assert abs(values[n].estimate * tables.SCALES[values[n].unit] - truth[n]) < 3.0 * ARCSEC
    bumped = World(0.7, 9.805).windows(places, unit, white(rng))
    bumped["mean_ax"] = bumped["mean_ax"] + np.where(bumped["phase"] == 5, 3e-3, 0.0)
    reasons = {r.id for r in reduction.reduce(bumped, setup(world)).reasons}
    assert "residuals.contradict" in reasons and "table.off" not in reasons
