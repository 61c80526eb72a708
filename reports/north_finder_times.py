"""Total time of north finding to a heading of 0.06 deg, 1' and 10", by latitude, method and gyro:

    python reports/north_finder_times.py [FILE]

Closed forms of systems/north_finder/plans.py (white noise, heading 60 deg from north, moves of the head counted);
written to reports/gallery/north_finder_times.svg.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[1]))
from reports.gallery import save
from systems.north_finder import plans

DEG = math.pi / 180.0
GOALS = {"0.06° (1 mil)": 0.06 * DEG, "1′": DEG / 60.0, "10″": DEG / 360.0}
#: density of the white noise, rad/s/sqrt(Hz), from deg/sqrt(h): 1 deg/sqrt(h) = 60 deg/h/sqrt(Hz)
GYROS = {"0.005 °/√h": 0.005, "0.0005 °/√h": 0.0005, "0.00005 °/√h": 0.00005}
STYLES = {"two": ":", "four": "-", "tilt": "-.", "strapdown two": "--"}


def main() -> None:
    target = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent / "gallery" / "north_finder_times.svg"
    latitudes = np.arange(0.0, 76.0, 2.5)
    figure, axes = plt.subplots(1, 3, figsize=(11, 4.2), sharey=True, layout="constrained")
    for axis, (goal, sigma) in zip(axes, GOALS.items(), strict=True):
        for colour, walk in zip(("#1b6ca8", "#c2571a", "#3b7d3a"), GYROS.values(), strict=True):
            density = walk * 60.0 * DEG / 3600.0
            for method, style in STYLES.items():
                lost = plans.overhead(method, 12, False, 0.5, 1e-3)
                times = [plans.total_time(method, sigma, density, x * DEG, 60.0 * DEG, lost) for x in latitudes]
                axis.semilogy(latitudes, times, style, color=colour, linewidth=1.3)
        axis.set_title(f"standard deviation {goal}", fontsize=10)
        axis.set_xlabel("latitude / °")
        axis.grid(True, which="major", linewidth=0.4, alpha=0.5)
        axis.set_xlim(0.0, 75.0)
        for time, words in ((60.0, "1 min"), (300.0, "5 min"), (3600.0, "1 h"), (86400.0, "1 d")):
            axis.axhline(time, color="0.6", linewidth=0.5)
            box = {"facecolor": "white", "edgecolor": "none", "pad": 0.5, "alpha": 0.8}
            axis.text(1.0, time, words, fontsize=7, color="0.3", va="center", bbox=box, zorder=5)
    axes[0].set_ylabel("total time / s")
    keys = [plt.Line2D([], [], color="0.2", linestyle=s, label=m) for m, s in STYLES.items()]
    grades = [
        plt.Line2D([], [], color=c, label=g) for c, g in zip(("#1b6ca8", "#c2571a", "#3b7d3a"), GYROS, strict=True)
    ]
    figure.legend(handles=[*keys, *grades], loc="outside lower center", ncols=7, fontsize=8, frameon=False)
    save(figure, target, "north")
    print(target)


if __name__ == "__main__":
    main()
