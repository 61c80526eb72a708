"""How often the 95 % intervals of imu_positions contain the true value: random units, sites, noise, eight ways.

    python tests/benchmarks/imu_positions.py [WAY ...] [--runs 300] [--seed 1]

The records are made in plain numpy and scipy (tests/support/imu_world.py), which shares nothing with the reduction.

table    12 positions and turns about three axes; noise of window means of the population for which intervals are made
         (gyrobench.reduction.estimation.noise)
set_up   the same on a table and in a mount that are off by what is stated, or is not (set_up_unstated)
thermal  six positions and turns, six times, while the temperature goes 40 K up and down; the same noise, or white
         noise alone (thermal_white)
unknown  24 attitudes by hand, 3 s each, the turns between them sampled at 100 Hz; noise of a small unit, white,
         Gauss-Markov (0.3 positions to half the record) or both
up_down  an axis up and down, 120 s each at 20 Hz; noise of the population in pieces of 6 s; in half of the runs each
         position leans by 2 mrad, which is stated
"""

from __future__ import annotations

import argparse
import importlib
import math
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats
from scipy.signal import lfilter
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).parents[1] / "systems"))
from imu_world import EARTH, EDGES, FACES, Unit, World, handled, own_axes, plan, poses

from gyrobench.reduction.estimation.noise import sample_instrument
from gyrobench.system.system import load_system

room = type(load_system("imu_positions")).__module__
reduction: Any = importlib.import_module(".reduction", room)
budget: Any = importlib.import_module(".budget", room)
tables: Any = importlib.import_module(".tables", room)
Rng = np.random.Generator
DPH = math.pi / 648000.0
LEAN = 2e-3  # rad
EVERYWHERE = {"type_b.unstated", "arrangement.unstated", "noise.unbounded"}


def correlated(t0: Any, t1: Any, tau: float) -> Any:
    """Covariance (n, n) of means of a Gauss-Markov process of unit variance over windows one after the other."""
    length = t1 - t0
    own = 2.0 * (tau / length - (tau / length) ** 2 * -np.expm1(-length / tau))
    weight = tau / length * -np.expm1(-length / tau)
    gap = t0[None, :] - t1[:, None]
    upper = np.where(gap >= -1e-9, np.exp(-np.maximum(gap, 0.0) / tau), 0.0) * np.outer(weight, weight)
    return np.diag(own) + upper + upper.T


def noise_of(rng: Rng, t0: Any, t1: Any, size: float, own: Any = slice(None)) -> Any:
    """Noise (n,) of the population of window means of standard deviation ``size`` for the usual window; own: those that
    the instrument's record has.
    """
    length, usual = t1 - t0, float(np.median((t1 - t0)[own]))
    tau, share, _ = sample_instrument(rng, t0[own], t1[own])
    one = float(correlated(np.zeros(1), np.array([usual]), tau)[0, 0])
    covariance = size**2 * ((1.0 - share) * np.diag(usual / length) + share / one * correlated(t0, t1, tau))
    return np.linalg.cholesky(covariance) @ rng.normal(size=t0.size)


def triads(rng: Rng, moving: Any, gyro: float = 0.15 * DPH, accelerometer: float = 1.3e-4) -> Any:
    """Noise of three gyros and three accelerometers, which are read where the case does not move."""
    rest = np.flatnonzero(~moving)

    def noise(t0: Any, t1: Any) -> Any:
        each = ((gyro, slice(None)), (accelerometer, rest))
        return tuple(np.column_stack([noise_of(rng, t0, t1, size, own) for _ in "xyz"]) for size, own in each)

    return noise


def moving_in(phases: Any) -> Any:
    """Whether the case moves in each window of a plan."""
    return np.concatenate([np.full(count, bool(rx or ry)) for _, _, rx, ry, _, count in phases])


def series_of(rng: Rng, n: int, step: float, window: float, size: float) -> Any:
    """Noise of three gyros (n, 3) whose means over ``window`` (s) have the standard deviation ``size``: white,
    Gauss-Markov or both.
    """
    share = float(rng.choice([0.0, 1.0, rng.uniform()]))
    tau = math.exp(rng.uniform(math.log(0.3 * window), math.log(0.5 * n * step)))
    return size * _series(rng, n, step, window, tau, share)


def _series(rng: Rng, n: int, step: float, window: float, tau: float, share: float) -> Any:
    own = float(correlated(np.zeros(1), np.array([window]), tau)[0, 0])
    decay = math.exp(-step / tau)
    shocks = rng.normal(size=(n, 3)) * math.sqrt(1.0 - decay**2)
    shocks[0] = rng.normal(size=3)
    slow = lfilter([1.0], [1.0, -decay], shocks, axis=0) * math.sqrt(share / own)
    return slow + rng.normal(size=(n, 3)) * math.sqrt((1.0 - share) * window / step)


def of_table(rng: Rng) -> tuple[Any, dict[str, float]]:
    world, unit = World(rng.uniform(-1.2, 1.2)), Unit.drawn(rng)
    places = plan(FACES + EDGES)
    windows = world.windows(places, unit, triads(rng, moving_in(places)))
    said = budget.ImuSetup(latitude=world.latitude, gravity=world.gravity, earth_rate=EARTH)
    return reduction.reduce(windows, said), unit.coefficients()


def of_file(head: str, time_of: Any, gyro: Any, acc: Any) -> Any:
    heads = "time [s]," + ",".join([f"g{a} [rad/s]" for a in "xyz"] + [f"a{a} [m/s2]" for a in "xyz"])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        np.savetxt(path, np.column_stack([time_of, gyro, acc]), "%.12g", ",", header=head + heads, comments="")
        system = load_system("imu_positions")
        assert system.measured_data is not None
        return reduction.Reduction.of_record(system.measured_data.read(system, path, {}))


def of_set_up(rng: Rng, stated: bool = True) -> tuple[Any, dict[str, float]]:
    """A table and a mount that are off by what is stated: 20" level, azimuth, right angle, case; 30 ug gravity."""
    arcsec = math.pi / 648000.0
    size = 20.0 * arcsec
    level, azimuth, square = rng.normal(size=3) * size
    case = Rotation.from_rotvec(rng.normal(size=3) * size)
    gravity, latitude = 9.805, rng.uniform(-1.2, 1.2)
    off = rng.normal() * 3e-4
    table = Rotation.from_rotvec([0.0, level, azimuth])
    world, unit = World(latitude, gravity + off, case, table, float(square)), Unit.drawn(rng)
    places = plan(FACES + EDGES)
    windows = world.windows(places, unit, triads(rng, moving_in(places)))
    sizes = {"u_axis": size, "u_square": size, "u_mount": size, "u_gravity": 3e-4} if stated else {}
    said = budget.ImuSetup(latitude=latitude, gravity=gravity, earth_rate=EARTH, sizes=sizes)
    return reduction.reduce(windows, said), unit.coefficients()


def of_set_up_unstated(rng: Rng) -> tuple[Any, dict[str, float]]:
    """The same errors, nothing stated: what the intervals are without."""
    return of_set_up(rng, False)


def of_thermal(rng: Rng) -> tuple[Any, dict[str, float]]:
    """Six positions and turns, six times, 40 K up and down; noise of a small unit, as that of the table."""
    from test_imu_thermal import CYCLE, heated, setup

    noise = triads(rng, np.tile(moving_in(CYCLE), 6), 3e-5 / math.sqrt(6.3), 5e-3 / math.sqrt(20.0))
    windows, truth = heated(int(rng.integers(1 << 30)), noise=noise)
    return reduction.reduce(windows, setup()), truth


def of_thermal_white(rng: Rng) -> tuple[Any, dict[str, float]]:
    """The same with white noise alone."""
    from test_imu_thermal import heated, setup, white

    windows, truth = heated(int(rng.integers(1 << 30)), noise=white(int(rng.integers(1 << 30))))
    return reduction.reduce(windows, setup()), truth


def of_hand(rng: Rng) -> tuple[Any, dict[str, float]]:
    unit, latitude = Unit.drawn(rng, 0.01), rng.uniform(-1.2, 1.2)
    t, gyro, acc = handled(unit, poses(rng, 24), rng, rest=3.0, turn=1.5, latitude=latitude, gravity=9.805)
    gyro, acc = gyro + series_of(rng, len(t), 0.01, 2.5, 3.0 * DPH), acc + series_of(rng, len(t), 0.01, 2.5, 6.3e-4)
    head = f"# attitudes = unknown\n# latitude = {math.degrees(latitude):.12g}deg\n# gravity = 9.805m/s2\n"
    return of_file(head, t, gyro, acc), own_axes(unit)


def of_up_down(rng: Rng) -> tuple[Any, dict[str, float]]:
    unit, latitude, n = Unit.drawn(rng), rng.uniform(-1.2, 1.2), 2400
    unit.Sa = unit.Sa * np.eye(3)
    rows = np.concatenate([np.arange(n), np.arange(n) + n + 400])
    start = rows[::120] / 20.0  # of the pieces
    t = rows / 20.0
    lean = LEAN * rng.integers(2)
    force, rate = [], []
    for sign in (1.0, -1.0):  # axes of the case in east, north, up: x upright but for a lean of its own
        case = Rotation.from_rotvec(lean * rng.normal(size=3)) * Rotation.from_euler("Y", -sign * np.pi / 2.0)
        force.append(case.inv().apply([0.0, 0.0, 9.805]))
        rate.append(case.inv().apply(EARTH * np.array([0.0, math.cos(latitude), math.sin(latitude)])))
    f, w = (np.repeat(v, n, axis=0) for v in (force, rate))
    of_gyro, of_acc = (
        _series(rng, 2 * n + 400, 0.05, 6.0, *sample_instrument(rng, start, start + 6.0)[:2])[rows] for _ in range(2)
    )
    gyro = w @ (np.eye(3) + unit.Sg).T + f @ unit.G.T / 9.80665 + unit.bg + 0.2 * DPH * of_gyro
    acc = f @ (np.eye(3) + unit.Sa).T + unit.ba + 4.5e-4 * of_acc
    head = f"# attitudes = up_down\n# latitude = {math.degrees(latitude):.12g}deg\n# gravity = 9.805m/s2\n"
    truth = unit.coefficients()
    earth = EARTH * math.sin(latitude)
    truth["hg_x"] = float(unit.G[0, 0] * 9.805 / 9.80665 + (1.0 + unit.Sg[0, 0]) * earth)
    truth["Sa_xx"] = float(unit.Sa[0, 0])
    return of_file(f"{head}# u_mount = {lean:g}rad\n", t, gyro, acc), truth


WAYS: dict[str, Callable[[Rng], tuple[Any, dict[str, float]]]] = {
    "table": of_table, "set_up": of_set_up, "set_up_unstated": of_set_up_unstated, "thermal": of_thermal,
    "thermal_white": of_thermal_white, "unknown": of_hand, "up_down": of_up_down,
}  # fmt: skip


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("way", nargs="*", choices=[[], *WAYS], default=[])
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    for way in given.way or list(WAYS):
        hits: dict[str, list[bool]] = {}
        z: dict[str, list[float]] = {}
        said: Counter[str] = Counter()
        began = time.monotonic()
        for run in range(given.runs):
            result, truth = WAYS[way](np.random.default_rng([given.seed, run]))
            said.update({r.id for r in result.reasons if r.severity != "condition"} - EVERYWHERE)
            for c in result.coefficients:
                if c.name not in truth:
                    continue
                low, high = (x * tables.SCALES[c.unit] for x in c.interval)
                kind = c.name.split("_")[0]
                hits.setdefault(kind, []).append(low <= truth[c.name] <= high)
                z.setdefault(kind, []).append(
                    (c.estimate * tables.SCALES[c.unit] - truth[c.name]) / c.u / tables.SCALES[c.unit]
                )
        print(f"\n{way}: {given.runs} runs in {time.monotonic() - began:.0f} s")
        print(f"records with: {dict(said)}")
        for kind, found in hits.items():
            n, h = len(found), sum(found)
            low, high = stats.beta.ppf(0.025, h, n - h + 1), stats.beta.ppf(0.975, h + 1, n - h) if h < n else 1.0
            rms = float(np.sqrt(np.mean(np.square(z[kind]))))
            print(f"{kind:<6}{n:>7} intervals {h / n:>8.3f}   {low:.3f} .. {high:.3f}   rms of z {rms:.2f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
