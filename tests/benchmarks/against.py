"""Compare this tree with a commit: ``python tests/benchmarks/against.py [commit] [--systems NAME ...] [--rounds 3]``.

Without a commit: with the state whose figures the pages quote, the last commit of docs/figures.toml.

- records: every standard system runs with seed 7 in both trees, by the command of each; columns are compared bit for
  bit.  reference.csv of every part is compared byte for byte.
- speed: whole commands, by their processor time with that of their children, and part_speed.py, of each tree in turn,
  so that a busy machine slows both; the least of the rounds counts.

Exit code 1 when a column or a reference differs.  The commit is checked out into a folder of its own for the time.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

ROOT = Path(__file__).parents[2]
SEED = 7
COMMANDS = {
    "all native FMUs, built cold": ("build", "--all"),
    "tumble, command to report": ("run", "tumble_single_axis", "--force"),
    "platform_three_axis, command to report": ("run", "platform_three_axis", "--force"),
    "servo_polar, command to report": ("run", "servo_polar", "--force"),
    "list": ("list",),
}


class Tree:
    """A checkout: its commands run with its own modules and its own built FMUs."""

    def __init__(self, folder: Path, work: Path) -> None:
        self.folder, self.out = folder, work / "runs"
        self.environment = {**os.environ, "PYTHONPATH": str(folder), "GYROBENCH_CACHE": str(work / "cache")}
        project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))
        module, _, function = project["project"]["scripts"]["gyrobench"].partition(":")
        self.start = f"import sys; from {module} import {function} as f; sys.argv[0] = 'gyrobench'; sys.exit(f())"

    def gyrobench(self, *arguments: str) -> None:
        command = [sys.executable, "-c", self.start, *arguments]
        done = subprocess.run(command, cwd=self.folder, env=self.environment, capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"gyrobench {' '.join(arguments)} in {self.folder}:\n{done.stdout}{done.stderr}")

    def record(self, system: str) -> dict[str, np.ndarray]:
        """Every column of the tables of a run."""
        folder = self.out / system
        self.gyrobench("run", system, "--seed", str(SEED), "--out", str(folder))
        found = {}
        for file in sorted(folder.glob("*.parquet")):
            table = pq.read_table(file)
            found.update({f"{file.stem}.{n}": table.column(n).to_numpy() for n in table.column_names})
        return found

    def commands(self) -> dict[str, float]:
        """Processor seconds of whole commands, in their own folder."""
        found = {}
        for what, words in COMMANDS.items():
            out = () if words == ("list",) else ("--out", str(self.out / words[-2]))
            before = sum(os.times()[2:4])
            self.gyrobench(*words, *out)
            found[what] = sum(os.times()[2:4]) - before
        return found

    def speed(self) -> dict[str, float]:
        """us a step of every part."""
        script = self.folder / "tests" / "benchmarks" / "part_speed.py"
        command = [sys.executable, str(script)]
        done = subprocess.run(
            command, cwd=self.folder, env=self.environment, capture_output=True, text=True, check=True
        )
        return {m[1]: float(m[2]) for m in re.finditer(r"^(\w+)\s+(\d+\.\d+)$", done.stdout, re.M)}


def differing(old: dict[str, np.ndarray], new: dict[str, np.ndarray]) -> list[str]:
    """Columns that are not the same bit for bit, with the largest difference over the column's largest value."""
    found = [f"{n}: only in one of the trees" for n in sorted(old.keys() ^ new.keys())]
    for name in sorted(old.keys() & new.keys()):
        a, b = old[name], new[name]
        if a.shape == b.shape and a.dtype == b.dtype and a.tobytes() == b.tobytes():
            continue
        if a.shape != b.shape or a.dtype.kind != "f":
            found.append(f"{name}: {a.dtype}{a.shape} became {b.dtype}{b.shape}")
        else:
            found.append(f"{name}: {np.nanmax(np.abs(a - b)) / max(np.nanmax(np.abs(a)), 1e-300):.2g}")
    return found


def compare_records(old: Tree, new: Tree, systems: list[str]) -> int:
    worse = 0
    for name in systems:
        a, b = old.record(name), new.record(name)
        wrong = differing(a, b)
        worse += bool(wrong)
        print(
            f"{name:26s} {len(a):3d} columns {'differ: ' + '; '.join(wrong) if wrong else 'the same bit for bit'}",
            flush=True,
        )
    parts = {p.parent.name for t in (old, new) for p in (t.folder / "components").glob("*/reference.csv")}
    for part in sorted(parts):
        files = [t.folder / "components" / part / "reference.csv" for t in (old, new)]
        if not (all(f.is_file() for f in files) and files[0].read_bytes() == files[1].read_bytes()):
            worse += 1
            print(f"{part}: reference.csv differs")
    print(f"{len(parts)} references compared")
    return worse


def compare_speed(old: Tree, new: Tree, rounds: int) -> None:
    measures = {"s of processor time": Tree.commands, "us a step of 1 ms": Tree.speed}
    for unit, measure in measures.items():
        least: list[dict[str, float]] = [{}, {}]
        for _ in range(rounds):
            for best, tree in zip(least, (old, new), strict=True):
                for what, took in measure(tree).items():
                    best[what] = min(took, best.get(what, took))
        print(f"\n{unit:40s} before    now  ratio")
        common = [p for p in least[0] if p in least[1]]
        pairs = [(least[0][what], least[1][what]) for what in common]
        if measure is Tree.speed:
            common.append("mean")
            pairs.append((float(np.mean([a for a, _ in pairs])), float(np.mean([b for _, b in pairs]))))
        for what, (a, b) in zip(common, pairs, strict=True):
            print(f"{what:40s} {a:7.4f} {b:7.4f}  {b / a:.3f}", flush=True)


def last_quoted() -> str:
    """Return the commit that wrote docs/figures.toml last."""
    command = ["git", "log", "-1", "--format=%H", "--", "docs/figures.toml"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False).stdout.strip()
    return found or sys.exit("no history here to compare with: name a commit in a clone")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit", nargs="?", help="default: the state whose figures the pages quote")
    parser.add_argument("--systems", nargs="*", help="of these systems only; without a name: speed alone")
    parser.add_argument("--rounds", type=int, default=3, help="of the measurement of speed; 0: none")
    given = parser.parse_args()
    commit = given.commit or last_quoted()
    print(f"before: {commit}")
    with tempfile.TemporaryDirectory() as place:
        other = Path(place) / "before"
        subprocess.run(["git", "worktree", "add", "--detach", "-q", str(other), commit], cwd=ROOT, check=True)
        try:
            old, new = Tree(other, Path(place) / "a"), Tree(ROOT, Path(place) / "b")
            every = sorted(
                f.parent.name for f in (other / "systems").glob("*/system.py") if "(Suite)" not in f.read_text()
            )
            systems = every if given.systems is None else given.systems
            worse = compare_records(old, new, systems) if systems else 0
            if given.rounds:
                compare_speed(old, new, given.rounds)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(other)], cwd=ROOT, check=True)
    raise SystemExit(1 if worse else 0)


if __name__ == "__main__":
    main()
