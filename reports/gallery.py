"""One figure of each system's report, for the README:  python reports/gallery.py [SYSTEM ...]

Runs each system (some minutes in all), takes a figure out of its report.html and puts it, without a background and in
colours that read on light and dark pages, into reports/gallery/<system>.svg.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from gyrobench.report.style import BLUE, GRID, INK, MUTED, ORANGE, PAPER, PURPLE, SHADE, THEMED

HERE = Path(__file__).parent
FIGURE = re.compile(r'<figure class="picture.*?(<svg.*?</svg>).*?<figcaption>(.*?)</figcaption>', re.S)
# system -> words of the caption of its figure, where it is not the first one
SHOWN = {
    "angle_system_test": "first minus second reading",
    "drift_record": "Allan deviation",
    "gimbal_stabilization": "density of the line of sight",
    "gimbal_tracking": "density of the tracking error",
    "gyro_magnetic_compass": "low-pass",
    "platform_four_gimbal": "Angles",
    "platform_single_axis": "Isolation",
    "platform_three_axis": "open loop",
    "stabilizer_floated_2dof": "open loop",
    "stabilizer_power_2dof": "open loop",
    "stabilizer_power_two_axis": "platform α_x",
    "table_environment": "Recorded channels",
    "table_supervision": "Recorded channels",
    "table_rate_test": "largest change of rate",
}
#: colour of a figure -> one that reads on white and on #14171a, or lets the page through
ON_ANY_PAGE = {
    INK: "#767676", MUTED: "#767676", GRID: "#80808060", SHADE: "#80808020", PAPER: "#80808000",
    BLUE: "#2a86c8", PURPLE: "#c06a98", ORANGE: "#c08300",
    "#000000": "#767676", "#b0b0b0": "#80808060", "#ffffff": "none",  # of matplotlib's own style
    "#1b6ca8": "#2a86c8", "#3b7d3a": "#4b914a", "#4c4c4c": "#767676", "#333333": "#767676", "#999999": "#868686",
}  # fmt: skip


def on_any_page(svg: str) -> str:
    """Return a picture of its own, for a page of any colour."""
    for colour, shown in ON_ANY_PAGE.items():
        svg = svg.replace(colour, shown)
    return svg.replace("<svg ", f'<svg fill="{ON_ANY_PAGE[INK]}" ', 1)


def save(figure: Any, target: Path, salt: str) -> None:
    """Save a figure of matplotlib as a picture for a page of any colour; salt: its ids are the same each time."""
    import matplotlib.pyplot as plt

    plt.rcParams["svg.hashsalt"] = salt
    figure.savefig(target, metadata={"Date": None})
    target.write_text(on_any_page(target.read_text(encoding="utf-8")), encoding="utf-8")


def figure(system: str) -> str:
    """The SVG of one figure of a system's report, a file of its own."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "gyrobench", "run", system, "--out", folder, "--force"]
        subprocess.run(command, check=True, capture_output=True, cwd=HERE.parent)
        page = (Path(folder) / "report.html").read_text(encoding="utf-8")
    svg = next(picture for picture, caption in FIGURE.findall(page) if SHOWN.get(system, "") in caption)
    for colour, variable in THEMED.items():
        svg = svg.replace(variable, colour)
    svg = on_any_page(svg)
    return svg if "xmlns=" in svg else svg.replace("<svg ", '<svg xmlns="http://www.w3.org/2000/svg" ', 1)


def main() -> None:
    every = sorted(p.parent.name for p in (HERE.parent / "systems").glob("*/system.py"))
    (HERE / "gallery").mkdir(exist_ok=True)
    for system in sys.argv[1:] or every:
        path = HERE / "gallery" / f"{system}.svg"
        path.write_text(figure(system) + "\n", encoding="utf-8")
        print(path.relative_to(HERE.parent), f"{path.stat().st_size // 1000} kB", flush=True)


if __name__ == "__main__":
    main()
