"""One figure of each system's report, for the README:  python reports/gallery.py [SYSTEM ...]

Runs each system (some minutes in all), takes a figure out of its report.html and puts it, on white, into
reports/gallery/<system>.svg.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from gyrobench.report.style import THEMED

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


def figure(system: str) -> str:
    """The SVG of one figure of a system's report, a file of its own."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "gyrobench", "run", system, "--out", folder, "--force"]
        subprocess.run(command, check=True, capture_output=True, cwd=HERE.parent)
        page = (Path(folder) / "report.html").read_text(encoding="utf-8")
    svg = next(picture for picture, caption in FIGURE.findall(page) if SHOWN.get(system, "") in caption)
    for colour, variable in THEMED.items():
        svg = svg.replace(variable, colour)
    svg = svg.replace("<svg ", '<svg style="background: white" ', 1)
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
