"""Do the intervals of every test method hold the truth 95 times of a hundred?  Few runs, made quickly.

tests/benchmarks/coverage.py counts on co-simulations with noise.  Here each system runs without noise for three random
instruments; then noise of the population, drawn with its exact covariance, is added to what the windows read, and the
same reducer reduces that.  In a quarter of the runs of tests/benchmarks/coverage_of_reducers.py, which are enough to
find out intervals for 90 % or 99 %, 0.95 must be among the possible coverages: what is grossly wrong fails.
"""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import counting
import numpy as np
import pytest

from gyrobench.engine.session import Session
from gyrobench.record.record import Record
from gyrobench.reduction.estimation import noise
from gyrobench.system.system import load_system

_spec = importlib.util.spec_from_file_location(
    "coverage_of_systems", Path(__file__).parents[1] / "benchmarks" / "coverage.py"
)
assert _spec is not None and _spec.loader is not None
benchmark: Any = importlib.util.module_from_spec(_spec)
sys.modules["coverage_of_systems"] = benchmark
_spec.loader.exec_module(benchmark)
cases: Any = sys.modules["coverage_cases"]

Array = np.ndarray[Any, Any]
SIZE = 1e-7  # rad/s, standard deviation of a window: 0.02 deg/h
RATES = Callable[[Array, Array], Array]  # noise of means over windows [t0, t1]


def sampler(rng: np.random.Generator, n: Any, size: float) -> RATES:
    """Draws means of both noises: covariance N2/T of the white one plus sigma2 times that of the process."""

    def draw(t0: Array, t1: Array) -> Array:
        C = np.diag(n.white(size) ** 2 / (t1 - t0)) + n.markov(size) ** 2 * noise.process_covariance(t0, t1, n.tau)
        out: Array = np.linalg.cholesky(C + 1e-12 * size**2 * np.eye(t0.size)) @ rng.standard_normal(t0.size)
        return out

    return draw


# ---------------------------------------------------------------------------------- noise of what is read
def current(w: dict[str, Array], p: dict[str, Any], rng: np.random.Generator, n: Any) -> dict[str, Array]:
    return {"mean": w["mean"] + sampler(rng, n, SIZE)(w["t_start"], w["t_end"]) / p["gyro.k"]}


def currents(w: dict[str, Array], p: dict[str, Any], rng: np.random.Generator, n: Any) -> dict[str, Array]:
    draw = sampler(rng, n, SIZE)
    return {f"mean_{c}": w[f"mean_{c}"] + draw(w["t_start"], w["t_end"]) / p[f"gyro.k_{c}"] for c in "xy"}


def acceleration(w: dict[str, Array], p: dict[str, Any], rng: np.random.Generator, n: Any) -> dict[str, Array]:
    return {"mean": w["mean"] + sampler(rng, n, 2e-4)(w["t_start"], w["t_end"]) / p["accelerometer.scale"]}


def walk(w: dict[str, Array], rng: np.random.Generator, n: Any, along: Any = 1.0) -> tuple[Array, Array]:
    """Rates, times ``along``, add up to angles from stretch to stretch of the windows; neighbours share a reading and
    its error.  Readings at both ends of the windows, less the true angles.
    """
    t0, t1 = w["t_start"], w["t_end"]
    way = sampler(rng, n, SIZE)(t0, t1) * (t1 - t0) * along
    start, end, true = np.empty_like(t0), np.empty_like(t0), 0.0
    for j in range(t0.size):
        new = j == 0 or t0[j] - t1[j - 1] > 1e-6
        start[j] = n.error(SIZE) * rng.standard_normal() if new else end[j - 1]
        true = 0.0 if new else true + way[j - 1]
        end[j] = true + way[j] + n.error(SIZE) * rng.standard_normal()
    return start, end


def angle(w: dict[str, Array], p: dict[str, Any], rng: np.random.Generator, n: Any) -> dict[str, Array]:
    start, end = walk(w, rng, n)
    return {"angle_start": w["angle_start"] + start, "angle_end": w["angle_end"] + end}


def angles(w: dict[str, Array], p: dict[str, Any], rng: np.random.Generator, n: Any) -> dict[str, Array]:
    """Of two axes: the outer one turns the gyro about x by the cosine of the inner angle."""
    found = {}
    secant = 1.0 / np.cos((w["inner_start"] + w["inner_end"]) / 2.0)
    for axis, along in (("outer", secant), ("inner", 1.0)):
        start, end = walk(w, rng, n, along)
        found |= {f"{axis}_start": w[f"{axis}_start"] + start, f"{axis}_end": w[f"{axis}_end"] + end}
    return found


def voltage(w: dict[str, Array], p: dict[str, Any], rng: np.random.Generator, n: Any) -> dict[str, Array]:
    """A free float adds the rates up between the middles of the readings."""
    t = (w["t_start"] + w["t_end"]) / 2.0
    way = np.concatenate([[0.0], np.cumsum(sampler(rng, n, SIZE)(t[:-1], t[1:]) * np.diff(t))])
    gain = p["gyro.K_sg"] * p["gyro.H"] / p["gyro.C"]
    return {"mean": w["mean"] + gain * (way + n.error(SIZE) * rng.standard_normal(t.size))}


READ: dict[str, tuple[Any, int]] = {  # what is read, runs of the benchmark
    "tumble_single_axis": (current, 75),
    "tumble_single_axis, stops": (current, 75),
    "tumble_two_channel, nine": (currents, 56),
    "tumble_two_channel, simple": (currents, 80),
    "tumble_two_axis": (current, 75),
    "eight_position": (currents, 62),
    "fixed_position": (current, 280),
    "open_loop_drift": (voltage, 280),
    "accelerometer_multipoint": (acceleration, 75),
    "accelerometer_multipoint, 12": (acceleration, 125),
    "servo_vertical_level": (angle, 87),
    "servo_polar": (angle, 75),
    "servo_two_axis": (angles, 44),
    "pickoff_scale_factor": (voltage, 217),
    "torquer_scale_factor": (angle, 205),
    "table_environment": (current, 97),
    "rebalance_loop_test": (current, 136),
}


#: of the benchmark alone: slots that a case has beside those of its system, or readings that the loop holds at 0
RUN_ONLY = {
    "tumble_single_axis, supplies", "fixed_position, supplies", "fixed_position, supplies in steps",
    "fixed_position, supplies with ripple", "servo_vertical_level, supplies", "servo_two_axis, levelled",
}  # fmt: skip


def test_every_case_is_here() -> None:
    assert set(READ) | RUN_ONLY == set(cases.CASES)


def ratios(name: str, runs: int) -> Array:
    """Errors over half widths (runs, coefficients)."""
    case, read = cases.CASES[name], READ[name][0]
    system, rng = load_system(case.system), np.random.default_rng(7)
    records = []
    with Session(case.system) as session, benchmark.seen_windows() as seen:
        known = {f"{slot}.{name}" for slot, b in session.assembly.bindings.items() for name in b.parameters}
        for _ in range(3):
            values = {**case.drawn(rng), **{name: 0.0 for name in system.noises if name in known}}
            records.append((system.with_values(values), session.run(values)))
        records[0][0].reduce(records[0][1])
    t0, t1, readings = seen[0]
    window = float(np.median(t1 - t0))
    ratio = []
    for run in range(runs):
        drawn, record = records[run % 3]
        n = cases.Noise(*noise.sample_instrument(rng, t0, t1, readings), window)
        read_so = read(record.windows, record.run.parameters, rng, n)
        result = drawn.reduce(Record({**record.windows, **read_so}, {}, record.run))
        ratio.append(
            [2.0 * (c.estimate - c.truth) / (c.interval[1] - c.interval[0]) for c in result.coefficients if c.truth]
        )
    most = max(len(r) for r in ratio)  # a curved torquer has no K_LS
    return np.array([r + [np.nan] * (most - len(r)) for r in ratio])


@pytest.mark.parametrize("name", list(READ))
@pytest.mark.long
def test_intervals_cover(name: str) -> None:
    low, high = counting.bounds(ratios(name, READ[name][1] // 4))
    assert low <= 0.95 <= high, f"coverage {low:.3f} .. {high:.3f}"
