"""The figure of the guide on errors of the set-up:  python docs/guides/errors_of_the_set_up/figure.py

One record of a table whose axis is 60″ off the pole about east, reduced in five ways: the drift D_I about the input
axis with its 95 % interval, beside the true one.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt

import gyrobench as gb

FILE = Path(__file__).with_suffix(".png")
HEAD = "".join(f"# phase {k} = {p}\n" for k, p in enumerate(("static 3", "mount 1", "static 4", "mount 2"), 1))
BELIEFS = {"latitude": "45.75deg", "k": "17.2deg/h/mA", "u_remount": "0"}
AXIS = "table.axis.pole.east"
WAYS = {
    "nothing stated": {"nuisances": "none", "type_b": "none"},
    "weighed by the data": {"type_b": "none"},
    "stated: u_axis = 60″": {"nuisances": "none", "u_axis": "60arcsec"},
    "measured: 60(3)″, taken out": {"nuisances": "none", "corrections": f"{AXIS} = 60(3) arcsec"},
    "measured, but the wrong sign": {"nuisances": "none", "corrections": f"{AXIS} = -60(3) arcsec"},
}


def record(folder: Path) -> Path:
    """Write the record of the tilted table as a laboratory's file, and return its path."""
    run = gb.load("tumble_single_axis", {"table.tilt[1]": "60arcsec"}).run(seed=5, check_step=False)
    run.record.to_csv(folder)
    file = folder / "lab.csv"
    file.write_text(HEAD + (folder / "windows.csv").read_text(encoding="utf-8"), encoding="utf-8")
    return file


def main() -> None:
    with tempfile.TemporaryDirectory() as name:
        file = record(Path(name))
        found = {way: gb.reduce("tumble_single_axis", file, **BELIEFS, **values).result for way, values in WAYS.items()}
    plt.rcParams["font.size"] = 9
    figure, axes = plt.subplots(figsize=(7.2, 2.6), layout="constrained")
    for row, result in enumerate(found.values()):
        c = result["D_I"]
        axes.errorbar(c.estimate, row, xerr=1.96 * c.u, fmt="o", color="#1f4e79", capsize=3, markersize=4)
    axes.axvline(-0.9, color="#b0413e", linewidth=1.0)
    axes.text(-0.9, -0.75, "true", color="#b0413e", ha="center", va="bottom")
    axes.set_yticks(range(len(found)), list(found))
    axes.set_ylim(len(found) - 0.5, -0.8)
    axes.set_xlabel("D_I / (°/h/g), 95 % intervals")
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(FILE, dpi=150)
    for way, result in found.items():
        print(f"{way:30} {result['D_I'].estimate:.4f} {result['D_I'].u:.4f} {[r.id for r in result.reasons]}")


if __name__ == "__main__":
    main()
