"""Inputs with mistakes no one thinks of, by the hundred thousand: tracebacks, hangs, memory, files written elsewhere.

    python tests/benchmarks/fuzz.py [KIND ...] [--inputs 200000]

Kinds and changes: tests/support/fuzzing.py; "stored" turns one bit of a stored file.  Every process works in a folder
of its own; the tree of the bench and the home folder are looked at before and after.
"""

from __future__ import annotations

import argparse
import collections
import os
import resource
import sys
import tempfile
import time
import warnings
from multiprocessing import Pool
from pathlib import Path

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS), str(TESTS / "support")]
BUILT = TESTS.parent / "fmus"  # where the FMUs belong that the attacks are made from
#: share of the inputs; the others read in some ms, these in some tenths of a second
RARE = {"numbers": 0.01, "ssp": 0.05, "environment": 0.0005}


def attacked(job: tuple[str, int, int]) -> tuple[str, int, float, float, list[str]]:
    """Return kind, inputs, longest time, memory in MB, tracebacks."""
    kind, first, count = job
    warnings.simplefilter("ignore")
    slowest, faults = 0.0, []
    home = os.getcwd()
    with tempfile.TemporaryDirectory() as name:
        os.environ["GYROBENCH_CACHE"] = str(Path(name) / "cache")
        from fuzzing import attacks

        os.chdir(name)
        attack = attacks(Path(name), kind)[kind]
        for seed in range(first, first + count):
            begun = time.perf_counter()
            fault = attack(seed)
            slowest = max(slowest, time.perf_counter() - begun)
            if fault:
                faults.append(f"{kind} {seed}: {fault.strip().splitlines()[-1]}")
        os.chdir(home)
    return kind, count, slowest, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0, faults


def tree(*folders: Path) -> set[tuple[str, float]]:
    """Return the files of folders (of the home folder its first level) with their times."""
    files = [f for folder in folders for f in (folder.iterdir() if folder == Path.home() else folder.rglob("*"))]
    passed = ("__pycache__", "/.git/", str(BUILT))
    return {(str(f), f.lstat().st_mtime) for f in files if not any(p in str(f) for p in passed)}


def main() -> int:
    from test_fuzz import INPUTS

    kinds = list(INPUTS)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("kind", nargs="*", default=kinds)
    parser.add_argument("--inputs", type=int, default=200_000)
    parser.add_argument("--first", type=int, default=100_000, help="first seed")
    given = parser.parse_args()
    before = tree(TESTS.parent, Path.home())
    usual = given.inputs / sum(RARE.get(k, 1.0) for k in given.kind)
    jobs = []
    for kind in given.kind:
        left, first = round(usual * RARE.get(kind, 1.0)), given.first
        while left > 0:
            jobs.append((kind, first, min(left, 1000)))
            first, left = first + 1000, left - 1000
    total: dict[str, list[float]] = collections.defaultdict(lambda: [0, 0.0, 0.0, 0])
    with Pool() as pool:
        for kind, count, slowest, memory, faults in pool.imap_unordered(attacked, jobs):
            t = total[kind]
            total[kind] = [t[0] + count, max(t[1], slowest), max(t[2], memory), t[3] + len(faults)]
            print(*faults, sep="\n", end="\n" if faults else "")
    print("kind        inputs  tracebacks  longest / s  memory / MB")
    for kind, (count, slowest, memory, bad) in total.items():
        print(f"{kind:<12}{count:6.0f}{bad:12.0f}{slowest:13.2f}{memory:13.0f}")
    written = sorted(name for name, _ in tree(TESTS.parent, Path.home()) - before)
    print(f"files written elsewhere: {', '.join(written) or 'none'}")
    return int(bool(written) or any(t[3] or t[1] > 20.0 or t[2] > 2048.0 for t in total.values()))


if __name__ == "__main__":
    sys.exit(main())
