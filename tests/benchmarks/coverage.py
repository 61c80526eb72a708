"""How often the 95 % intervals contain the true value: every test system, random gyros, latitudes and noise.

    python tests/benchmarks/coverage.py [SYSTEM ...] --runs 1000 [--noise population] [--seed 1] [--markdown] [--write]

Each run draws true coefficients, a latitude and an instrument's noise, runs the whole dynamic co-simulation (FMUs, loop
or servo, sampler) on a shortened plan and reduces the record; nothing is quasi-static.  What is counted is whether the
printed interval holds the printed truth.

Noise: by default drawn from the population that the reduction takes for granted (gyrobench.reduction.estimation.noise):
white alone, Gauss-Markov alone, or both, with a correlation time from 0.3 windows to half the record; where data are
differences of readings, with errors of the readings too.  Windows are shortened, so the sizes are scaled: the parts get
the densities that give a window the drawn shares.  ``--noise`` takes one instrument instead, a corner of the
population, or flicker, alone or with as much white noise; there intervals may hold the truth more or less often than
95 %.  README.md here has the figures.

Each count is a campaign, on all cores; in a file it keeps its rows and goes on where it was, another case by the names
of system and case:

    gyrobench campaign tests/benchmarks/campaigns/tumble_single_axis.toml --out FOLDER
"""

from __future__ import annotations

import argparse
import re
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

import gyrobench as gb
from gyrobench.engine.session import Session
from gyrobench.reduction.estimation import noise, noise_mixture_fit
from gyrobench.system.system import load_system

sys.path.insert(0, str(Path(__file__).parent))  # a campaign loads this file by its path

from coverage_cases import ALL, ASKED, CORNERS, Case, Noise, Values

SCRIPT = "tests/benchmarks/coverage.py"


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
            noisy = Noise(tau * window if tau > 0.0 else tau, share, reading, window)
        drawn = case.drawn(rng)
        found.append({**drawn, **case.noise(noisy, drawn), "seed": seed * 1_000_000 + run})
    return found


def rows(case: str, runs: int, seed: int = 1, noise: str = "population") -> list[Values]:
    """The table of a campaign, as in campaigns/tumble_single_axis.toml."""
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


def key(case: str) -> str:
    """Name of a case in docs/figures.toml."""
    return f"coverage.{re.sub('[, ]+', '_', case)}"


def write(case: str, found: dict[str, Count], runs: int, corner: str) -> None:
    """Write the coverage of a case into docs/figures.toml, by coefficient where there are several."""
    import quoted  # not where a campaign loads this file for its rows

    shares = {name: f"{c.hits / c.runs:.3f}" for name, c in found.items()}
    value = shares if len(shares) > 1 else next(iter(shares.values()))
    name = key(case) + (f"_{corner}" if corner != "population" else "")
    words = [SCRIPT, f'"{case}"' if "," in case else case, f"--runs {runs}"]
    words += [f"--noise {corner}"] if corner != "population" else []
    quoted.record(name, value, "share of 95 % intervals that contain the true value", *words)


def write_ends() -> None:
    """Write the lowest and the highest share of all cases that are in docs/figures.toml."""
    import quoted

    recorded = quoted.figures.load()
    entries = [recorded[k]["value"] for case in ALL if (k := key(case)) in recorded]
    shares = [float(share) for e in entries for share in (e.values() if isinstance(e, dict) else [e])]
    for which, share in (("lowest", min(shares)), ("highest", max(shares))):
        unit = f"{which} share of 95 % intervals that contain the true value, all tests"
        quoted.record(f"coverage.{which}", f"{share:.2f}", unit, SCRIPT)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("system", nargs="*", help=", ".join(ALL | ASKED))
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--noise", default="population", choices=["population", *CORNERS])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, help="default: one for each core")
    parser.add_argument("--write", action="store_true", help="write docs/figures.toml, of 300 runs or more")
    parser.add_argument("--markdown", action="store_true", help="one line of a table for each system")
    given = parser.parse_args()
    unknown = [n for n in given.system if not any(c == n or c.startswith(f"{n},") for c in ALL | ASKED)]
    if unknown:
        parser.error(f"{', '.join(unknown)} unknown; there are {', '.join(ALL | ASKED)}")
    if given.write and given.runs < 300:
        parser.error("--write needs 300 runs or more")
    bad = []
    for name, case in (ALL | ASKED if given.system else ALL).items():
        if given.system and not any(name == n or name.startswith(f"{n},") for n in given.system):
            continue
        began = time.monotonic()
        found = coverage(case, given.runs, given.seed, given.noise, workers=given.workers)
        took = time.monotonic() - began
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
    if given.write and given.noise == "population":
        write_ends()
    print("\nall between 0.93 and 0.97" if not bad else f"\noutside 0.93..0.97: {', '.join(bad)}", file=sys.stderr)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
