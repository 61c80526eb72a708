"""Compare this tree with a commit: ``python tests/benchmarks/against.py COMMIT [--systems NAME ...] [--rounds 3]``.

- records: every standard system runs with seed 7 in both trees, by the command of each; columns are compared bit for
  bit.  reference.csv of every part is compared byte for byte.
- speed: part_speed.py of each tree, in turn, so that a busy machine slows both; the least of the rounds counts.

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
    least: list[dict[str, float]] = [{}, {}]
    for _ in range(rounds):
        for best, tree in zip(least, (old, new), strict=True):
            for part, us in tree.speed().items():
                best[part] = min(us, best.get(part, us))
    print(f"{'part':24s} before    now  ratio   (us a step of 1 ms)")
    common = [p for p in least[0] if p in least[1]]
    for part in common:
        a, b = least[0][part], least[1][part]
        print(f"{part:24s} {a:.4f} {b:.4f}  {b / a:.3f}")
    a, b = (float(np.mean([best[p] for p in common])) for best in least)
    print(f"{'mean':24s} {a:.4f} {b:.4f}  {b / a:.3f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("commit")
    parser.add_argument("--systems", nargs="*", help="of these systems only; without a name: none")
    parser.add_argument("--rounds", type=int, default=3, help="of the measurement of speed; 0: none")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        other = Path(place) / "before"
        subprocess.run(["git", "worktree", "add", "--detach", "-q", str(other), given.commit], cwd=ROOT, check=True)
        try:
            old, new = Tree(other, Path(place) / "a"), Tree(ROOT, Path(place) / "b")
            every = sorted(
                f.parent.name for f in (other / "systems").glob("*/system.py") if "(Suite)" not in f.read_text()
            )
            worse = compare_records(old, new, every if given.systems is None else given.systems)
            if given.rounds:
                compare_speed(old, new, given.rounds)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", str(other)], cwd=ROOT, check=True)
    raise SystemExit(1 if worse else 0)


if __name__ == "__main__":
    main()
