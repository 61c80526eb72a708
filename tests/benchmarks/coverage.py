"""How often the 95 % intervals contain the true value: every test system, random gyros, latitudes and noise.

    python tests/benchmarks/coverage.py [SYSTEM ...] --runs 1000 [--noise population] [--seed 1] [--markdown] [--write]

Each run draws true coefficients, a latitude and an instrument's noise, runs the whole dynamic co-simulation (FMUs, loop
or servo, sampler) on a shortened plan and reduces the record; nothing is quasi-static.  What is counted is whether the
printed interval holds the printed truth.

Noise: by default drawn from the population that the reduction takes for granted (gyrobench.reduction.estimation.noise):
white alone, Gauss-Markov alone, or both, with a correlation time from 0.3 windows to half the record; where data are
differences of readings, with errors of the readings too.  Windows are shortened, so the sizes are scaled: the parts get
the densities that give a window the drawn shares.  ``--noise`` takes one instrument instead, a corner of the
population; there intervals may hold the truth more or less often than 95 %.  README.md here has the figures.

Each count is a campaign, on all cores; campaigns/*.toml are the same in files, which keep their rows and go on where
they were:

    gyrobench campaign tests/benchmarks/campaigns/tumble_single_axis.toml --out FOLDER
"""

from __future__ import annotations

import argparse
import math
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from coverage_draws import (
    ARCSEC,
    DPH,
    G0,
    Noise,
    Rng,
    Values,
    accelerometer,
    attitude,
    exposed,
    floated,
    latitude,
    on_springs,
    pulses,
    simple_channels,
    supplied,
    torquer,
    two_channels,
)

import gyrobench as gb
from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.reduction.estimation import noise, noise_mixture_fit
from gyrobench.system.system import load_system

SCRIPT = "tests/benchmarks/coverage.py"


#: Corners of the population: correlation time in windows, share, reading.
CORNERS = {
    "white": (1.0, 0.0, 0.0),
    "markov-1": (1.0, 1.0, 0.0),
    "markov-5": (5.0, 1.0, 0.0),
    "both-3": (3.0, 0.5, 0.0),
    "hidden-8": (8.0, 0.3, 0.0),
    "slow-8": (8.0, 1.0, 0.0),
    "slow-20": (20.0, 0.5, 0.0),
    "slow-1000": (1000.0, 1.0, 0.0),
}


# ---------------------------------------------------------------------------------------------- noise of the parts
def of_gyro(n: Noise, _: Values, size: float = 0.02 * DPH) -> Values:
    return {"gyro.white": n.white(size), "gyro.markov": n.markov(size), "gyro.markov_tau": n.tau, "gyro.pickoff": 5e-9}


def of_two_channels(n: Noise, _: Values) -> Values:
    size = 0.02 * DPH
    each = {"white": n.white(size), "markov": n.markov(size), "pickoff": 5e-9}
    return {"gyro.markov_tau": n.tau, **{f"gyro.{k}_{c}": v for k, v in each.items() for c in "xy"}}


def of_accelerometer(n: Noise, _: Values) -> Values:
    size = 20e-6 * G0
    own = {"white": n.white(size), "markov": n.markov(size), "markov_tau": n.tau}
    return {f"accelerometer.{k}": v for k, v in own.items()}


def of_encoder(n: Noise, values: Values) -> Values:
    """Errors of the angle readings are quanta."""
    return {**of_gyro(n, values), "table.quantum": n.error(0.02 * DPH) * math.sqrt(12.0)}


def of_encoder_2dof(n: Noise, values: Values) -> Values:
    return {**of_two_channels(n, values), "table.quantum": n.error(0.02 * DPH) * math.sqrt(12.0)}


def of_two_encoders(n: Noise, values: Values) -> Values:
    quantum = n.error(0.02 * DPH) * math.sqrt(12.0)
    return {**of_two_channels(n, values), "outer.quantum": quantum, "inner.quantum": quantum}


def of_pickoff(dwell: float, size: float) -> Callable[[Noise, Values], Values]:
    """Errors of the voltage readings are white noise over the dwell; H = C in the standard gyro."""

    def values(n: Noise, drawn: Values) -> Values:
        gain = drawn.get("gyro.K_sg", 10.0)  # V per rad of the case
        return {**of_gyro(n, drawn, size), "gyro.pickoff": gain * n.error(size) * math.sqrt(dwell)}

    return values


@dataclass(frozen=True)
class Case:
    """A system on a shortened plan."""

    system: str
    values: Values
    truth: Callable[[Rng], Values]
    latitude: Callable[[Rng], float]
    noise: Callable[[Noise, Values], Values] = of_gyro
    attitude: bool = False

    def drawn(self, rng: Rng) -> Values:
        found = {**self.values, **self.truth(rng), "latitude": self.latitude(rng)}
        return {**found, "attitude": attitude(rng)} if self.attitude else found


TURNING: Values = {"rate": 0.15, "windows": 24, "dwell": 17.5, "settle": 2.0}
STOPPING: Values = {"stops": 24, "stop_dwell": 1.75, "windows": 24, "dwell": 17.5, "settle": 2.0,
                    "table.index_rate": 1.0, "table.acceleration": 1.0}  # fmt: skip
FAST: Values = {"table.acceleration": 20.0}
CASES = {
    "tumble_single_axis": Case("tumble_single_axis", TURNING, floated, latitude(12.0, 78.0)),
    "tumble_single_axis, supplies": Case("tumble_single_axis", TURNING, supplied(130.0), latitude(12.0, 78.0)),
    "tumble_single_axis, stops": Case("tumble_single_axis", STOPPING, floated, latitude(12.0, 78.0)),
    "tumble_two_channel, nine": Case(
        "tumble_two_channel", {**TURNING, **FAST}, two_channels, latitude(20.0, 70.0), of_two_channels
    ),
    "tumble_two_channel, simple": Case(
        "tumble_two_channel", {**TURNING, **FAST, "model": "simple"}, simple_channels, latitude(20.0, 70.0),
        of_two_channels,
    ),
    "tumble_two_axis": Case(
        "tumble_two_axis",
        {"dwell": 3.0, "settle": 2.0, "inner_rate": 0.05, "rebalance.i_max": 1.0, "table.index_rate[1]": 1.0,
         "table.acceleration": [1.0, 1.0]},
        floated, latitude(12.0, 78.0),
    ),
    "eight_position": Case(
        "eight_position", {"dwell": 1.5, "settle": 1.5, "readings": 2}, lambda rng: two_channels(rng, 10),
        latitude(0.0, 70.0), of_two_channels,
    ),
    "table_environment": Case(
        "table_environment", {"dwell": 225.0, "readings": 90, "tilting": 100.0 * ARCSEC, "settle": 2.0}, exposed,
        latitude(0.0, 70.0),
    ),
    "fixed_position": Case("fixed_position", {"dwell": 60.0}, floated, latitude(0.0, 85.0), attitude=True),
    "fixed_position, supplies": Case(
        "fixed_position", {"dwell": 60.0}, supplied(60.0), latitude(0.0, 85.0), attitude=True
    ),
    "fixed_position, supplies in steps": Case(
        "fixed_position", {"dwell": 60.0}, supplied(60.0, "step"), latitude(0.0, 85.0), attitude=True
    ),
    "fixed_position, supplies with ripple": Case(
        "fixed_position", {"dwell": 60.0}, supplied(60.0, "swing"), latitude(0.0, 85.0), attitude=True
    ),
    "servo_vertical_level, supplies": Case(
        "servo_vertical_level", {"dwell": 80.0, "cycles": 1, "settle": 2.0}, supplied(550.0), latitude(0.0, 70.0),
        of_encoder,
    ),
    "open_loop_drift": Case(
        "open_loop_drift", {"wait": 2.0, "dwell": 0.1}, floated, latitude(0.0, 85.0), of_pickoff(0.1, 0.02 * DPH),
        attitude=True,
    ),
    "accelerometer_multipoint": Case(
        "accelerometer_multipoint", {"dwell": 1.0, "settle": 1.0}, accelerometer, latitude(0.0, 85.0), of_accelerometer
    ),
    "accelerometer_multipoint, 12": Case(
        "accelerometer_multipoint", {"dwell": 1.0, "settle": 1.0, "points": 12, "mounts": "a"}, accelerometer,
        latitude(0.0, 85.0), of_accelerometer,
    ),
    "servo_vertical_level": Case(
        "servo_vertical_level", {"dwell": 80.0, "cycles": 1, "settle": 2.0}, floated, latitude(0.0, 70.0), of_encoder
    ),
    "servo_polar": Case(
        "servo_polar",
        {"site.earth_rate": 500.0 * frames.EARTH_RATE, "cage.i_max": 1.0, "time": 172.4, "window": 4.8, "dwell": 48.0,
         "settle": 2.0},
        floated, latitude(12.0, 78.0), of_encoder,
    ),
    "servo_two_axis": Case(
        "servo_two_axis",
        {"site.earth_rate": 500.0 * frames.EARTH_RATE, "cage_x.i_max": 10.0, "cage_y.i_max": 10.0, "time": 172.8,
         "window": 2.4, "settle": 2.0},
        two_channels, latitude(30.0, 68.0), of_two_encoders,
    ),
    "servo_two_axis, levelled": Case(
        "servo_two_axis",
        {"levelled": True, "mounts": "1 2 8", "time": 60.0, "window": 1.0, "settle": 2.0},
        two_channels, latitude(0.0, 80.0), of_two_encoders,
    ),
    "pickoff_scale_factor": Case(
        "pickoff_scale_factor", {}, lambda rng: {**floated(rng), "gyro.K_sg": rng.uniform(8.0, 10.0)},
        latitude(0.0, 85.0), of_pickoff(0.1, 0.1 * DPH),
    ),
    "torquer_scale_factor": Case(
        "torquer_scale_factor",
        {"currents": "5 10 20 40 70 100", "range": "0.5deg", "range_large": "5deg", "windows": 10},
        torquer, latitude(0.0, 85.0), of_encoder,
    ),
    "rebalance_loop_test": Case(
        "rebalance_loop_test", {"gate": 0.5, "rest": 20, "readings": 6, "settle": 1.5}, pulses, latitude(0.0, 85.0)
    ),
}  # fmt: skip

#: counted here alone, without a short count among the tests
ALONE = {
    "servo_polar, y axis": Case(
        "servo_polar",
        {"channel": "y", "site.earth_rate": 500.0 * frames.EARTH_RATE, "cage.i_max": 1.0, "lock.i_max": 10.0,
         "time": 172.4, "window": 4.8, "dwell": 48.0, "settle": 2.0},
        two_channels, latitude(12.0, 78.0), of_encoder_2dof,
    ),
    "position_sensitivity": Case(
        "position_sensitivity", {"dwell": 10.0, "settle": 1.0}, on_springs, latitude(0.0, 85.0), of_two_channels,
        attitude=True,
    ),
}  # fmt: skip
ALL = CASES | ALONE


# ---------------------------------------------------------------------------------------------- counting
@contextmanager
def seen_windows() -> Iterator[list[tuple[Any, Any, bool]]]:
    """What the reducer gives the fit: t0, t1 and whether the data are differences of readings."""
    found: list[tuple[Any, Any, bool]] = []
    inner = noise_mixture_fit.fit

    def fit(X: Any, y: Any, names: Any, t0: Any, t1: Any, *more: Any, **named: Any) -> Any:
        found.append((t0, t1, more[1] if len(more) > 1 else named.get("readings", False)))
        return inner(X, y, names, t0, t1, *more, **named)

    noise_mixture_fit.fit = fit
    try:
        yield found
    finally:
        noise_mixture_fit.fit = inner


@dataclass
class Count:
    """Of one coefficient: intervals that hold the truth, intervals, and errors over u."""

    hits: int
    runs: int
    z: list[float]

    def bounds(self, level: float = 0.95) -> tuple[float, float]:
        """Clopper-Pearson bounds of the coverage."""
        a, h, n = (1.0 - level) / 2.0, self.hits, self.runs
        low = float(stats.beta.ppf(a, h, n - h + 1)) if h else 0.0
        return low, float(stats.beta.ppf(1.0 - a, h + 1, n - h)) if h < n else 1.0


def draws(case: Case, runs: int, seed: int = 1, corner: str = "population") -> list[Values]:
    """What each run of a case is given: values and a seed."""
    rng = np.random.default_rng(seed)
    system = load_system(case.system)
    for name in {"channel", "levelled"} & set(case.values):  # they decide which slots there are
        system.set(name, case.values[name])
    probe = case.drawn(rng)
    for slot in system.on_request:
        if any(n.startswith(f"{slot}.") for n in probe):
            system.request(slot)
    with Session(system) as session, seen_windows() as seen:
        load_system(case.system).with_values(probe).reduce(session.run(probe, seed=1))
    t0, t1, readings = seen[0]
    window = float(np.median(t1 - t0))
    found = []
    for run in range(runs):
        if corner == "population":
            noisy = Noise(*noise.sample_instrument(rng, t0, t1, readings), window)
        else:
            tau, share, reading = CORNERS[corner]
            noisy = Noise(tau * window, share, reading, window)
        drawn = case.drawn(rng)
        found.append({**drawn, **case.noise(noisy, drawn), "seed": seed * 1_000_000 + run})
    return found


def rows(case: str, runs: int, seed: int = 1, noise: str = "population") -> list[Values]:
    """The table of a campaign in campaigns/*.toml."""
    return draws(ALL[case], runs, seed, noise)


def coverage(case: Case, runs: int, seed: int = 1, corner: str = "population", **how: Any) -> dict[str, Count]:
    """Counts of each coefficient whose truth is known; how: out, workers ... of a campaign."""
    asked = {"system": case.system, "table": draws(case, runs, seed, corner), "check_step": False, "keep": "none"}
    return counts(gb.campaign(asked, **how))


def counts(frame: Any) -> dict[str, Count]:
    """Counts in the rows of a campaign.  A run without a result is none of them, and is an error here."""
    failed = frame[frame["state"] != "done"]
    assert failed.empty, failed["reason"].tolist()[:3]
    found = {}
    for name in [c.removesuffix(".truth") for c in frame.columns if c.endswith(".truth")]:
        low, high, truth, value, u = (frame[f"{name}.{k}"] for k in ("lo", "hi", "truth", "estimate", "u"))
        known = truth.notna()
        if known.any():
            hits = ((low <= truth) & (truth <= high))[known].sum()
            found[name] = Count(int(hits), int(known.sum()), ((value - truth) / u)[known].tolist())
    return found


def write(case: str, found: dict[str, Count], runs: int, corner: str) -> None:
    """Write the coverage of a case into docs/figures.toml, by coefficient where there are several."""
    import quoted  # not where a campaign loads this file for its rows

    shares = {name: f"{c.hits / c.runs:.3f}" for name, c in found.items()}
    value = shares if len(shares) > 1 else next(iter(shares.values()))
    key = f"coverage.{case.replace(', ', '_')}" + (f"_{corner}" if corner != "population" else "")
    words = [SCRIPT, f'"{case}"' if "," in case else case, f"--runs {runs}"]
    words += [f"--noise {corner}"] if corner != "population" else []
    quoted.record(key, value, "share of 95 % intervals that contain the true value", *words)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("system", nargs="*", help=", ".join(ALL))
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--noise", default="population", choices=["population", *CORNERS])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, help="default: one for each core")
    parser.add_argument("--write", action="store_true", help="write docs/figures.toml, of 300 runs or more")
    parser.add_argument("--markdown", action="store_true", help="one line of a table for each system")
    given = parser.parse_args()
    unknown = [n for n in given.system if not any(c == n or c.startswith(f"{n},") for c in ALL)]
    if unknown:
        parser.error(f"{', '.join(unknown)} unknown; there are {', '.join(ALL)}")
    if given.write and given.runs < 300:
        parser.error("--write needs 300 runs or more")
    bad = []
    shares: list[float] = []
    for name, case in ALL.items():
        if given.system and not any(name == n or name.startswith(f"{n},") for n in given.system):
            continue
        began = time.monotonic()
        found = coverage(case, given.runs, given.seed, given.noise, workers=given.workers)
        took = time.monotonic() - began
        shares += [c.hits / c.runs for c in found.values()]
        if given.write:
            write(name, found, given.runs, given.noise)
        if given.markdown:
            parts = ", ".join(f"{n} {c.hits / c.runs:.3f}" for n, c in found.items())
            print(f"| {name} | {given.noise} | {given.runs} | {parts} |", flush=True)
        else:
            print(f"\n{name}, {given.noise}: {given.runs} runs in {took:.0f} s")
            print(f"{'coefficient':<24}{'coverage':>9}   95 % bounds       rms of z")
        for n, c in found.items():
            low, high = c.bounds()
            inside = 0.93 <= c.hits / c.runs <= 0.97
            if not inside:
                bad.append(f"{name} {n}")
            if not given.markdown:
                rms = float(np.sqrt(np.mean(np.square(c.z))))
                note = "" if inside else "  OUTSIDE"
                print(f"{n:<24}{c.hits / c.runs:>9.3f}   {low:.3f} .. {high:.3f}   {rms:9.2f}{note}", flush=True)
    if given.write and not given.system and given.noise == "population":
        import quoted

        for which, share in (("lowest", min(shares)), ("highest", max(shares))):
            unit = f"{which} share of 95 % intervals that contain the true value, all tests"
            quoted.record(f"coverage.{which}", f"{share:.2f}", unit, SCRIPT)
    print("\nall between 0.93 and 0.97" if not bad else f"\noutside 0.93..0.97: {', '.join(bad)}", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
