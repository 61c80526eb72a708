"""Time from switch-on to a heading that is ready, by latitude, grade of the sensors and positions:

    python reports/platform_alignment_times.py [FILE]

Error model of systems/platform_alignment/plans.py, with the settings that are ready first, heading 90 deg at switch-on;
a line ends where the standard deviation is not reached within an hour.  Written to
reports/gallery/platform_alignment_times.svg.
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
from systems.platform_alignment import planning, plans

DEG, ARCMIN = math.pi / 180.0, math.pi / 10800.0
LATITUDES = {"0°": 0.0, "45°": 45.0 * DEG, "70°": 70.0 * DEG}
COLOURS = {"precise": "#3b7d3a", "navigation": "#1b6ca8", "tactical": "#c2571a"}
LONGEST = 3600.0


def ready(latitude: float, sensors: plans.Sensors, positions: int, wanted: float) -> float:
    """Return the time to be ready, s; NaN where it is not reached."""
    given = plans.Settings(
        latitude, positions=positions, coarse_time=0.0, fast_frequency=0.0, fast_time=-1.0, slow_frequency=0.0
    )
    settings = planning.designed(given, sensors, wanted, math.pi / 2.0, LONGEST)
    found = planning.ready_after(*planning.predicted(settings, sensors, math.pi / 2.0, LONGEST), wanted)
    return math.nan if found is None else found


def main() -> None:
    target = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent / "gallery/platform_alignment_times.svg")
    wanted = np.geomspace(0.5, 100.0, 20) * ARCMIN
    figure, axes = plt.subplots(1, 3, figsize=(11, 4.2), sharey=True, layout="constrained")
    for axis, (name, latitude) in zip(axes, LATITUDES.items(), strict=True):
        for grade, colour in COLOURS.items():
            for positions, style in ((1, "-"), (2, "--")):
                times = [ready(latitude, plans.GRADES[grade], positions, float(w)) / 60.0 for w in wanted]
                axis.semilogx(wanted / ARCMIN, times, style, color=colour, linewidth=1.4)
        axis.set_title(f"latitude {name}", fontsize=10)
        axis.set_xlabel("standard deviation wanted / ′")
        axis.grid(True, which="both", linewidth=0.3, alpha=0.5)
        axis.set_ylim(0.0, 25.0)
    axes[0].set_ylabel("time to be ready / min")
    handles = [plt.Line2D([], [], color=c, label=g) for g, c in COLOURS.items()]
    handles += [
        plt.Line2D([], [], color="0.2", linestyle=s, label=n) for s, n in (("-", "one position"), ("--", "two"))
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=5, fontsize=8, frameon=False)
    save(figure, target, "alignment")
    print(target)


if __name__ == "__main__":
    main()
