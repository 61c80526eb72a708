"""Systems and lessons that run in the pages of the site: exported as web pages, and the page that lists them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import gyrobench as gb
from gyrobench.workflow.lessons import lessons

#: system -> parameters with a slider, and what to look for
LIVE = {
    "tumble_single_axis": (
        ("gyro.D_F", "gyro.D_I", "gyro.D_SS"),
        "D_F lifts the whole curve of the rebalance current, D_I swings it once a turn, D_SS twice.",
    ),
    "servo_polar": (
        ("gyro.D_F", "gyro.D_I"),
        "The servo turns the table against the Earth; the drift is what is left.",
    ),
    "rebalance_loop_test": (("gyro.C",), "Damping of the float and the step response of the rebalance loop."),
    "stabilizer_sdf": (("gyro.D_F", "gyro.C"), "The platform turns at the drift rate of its gyro."),
    "platform_single_axis": (
        ("platform.J", "platform.friction"),
        "Friction carries the base's motion onto the platform.",
    ),
    "vertical_gyro": (("gyro.H",), "Erection to the vertical: a larger H takes longer and is moved less."),
}
PAGE = "live.md"
#: lessons of the site
TAUGHT = ("drift", "tumble", "random_walk", "stiffness", "keyhole")


def export_live(folder: Path) -> list[str]:
    """Export the systems into a folder, a page each; return the problems."""
    folder.mkdir(parents=True, exist_ok=True)
    commands = {}
    for name, (sliders, _) in LIVE.items():
        exposed = [word for slider in sliders for word in ("--expose", slider)]
        commands[name] = ["export", name, "--to", "html", *exposed]
    for name in TAUGHT:
        commands |= {f"{name}-{code}": ["learn", name, "--language", code] for code in ("en", "zh")}
    problems = []
    for file, words in commands.items():
        command = [sys.executable, "-m", "gyrobench", *words, "--out", str(folder / f"{file}.html")]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        problems += [f"{file}: {done.stderr.strip()}"] if done.returncode else []
    return problems


def live_page() -> str:
    """Return the page that lists them, Markdown."""
    lines = [
        "# Systems that run in this browser",
        "",
        "Each opens a page of its own that runs the co-simulation here, as WebAssembly, with sliders and live curves;",
        "nothing is sent anywhere, and a saved page runs without network.",
        "`gyrobench export SYSTEM --to html` makes one of any system ([how](docs/guides/run_elsewhere.md)).",
        "",
        "| system | sliders | look for |",
        "|---|---|---|",
    ]
    for name, (sliders, words) in LIVE.items():
        title = gb.load(name).system.title
        link = f'<a href="live/{name}.html">{title}</a>'
        lines.append(f"| {link} | {', '.join(f'`{s}`' for s in sliders)} | {words} |")
    lines += ["", "Lessons, each with a question, a closed formula beside the simulation, and an exercise:", ""]
    for item in lessons():
        if item.name in TAUGHT:
            en, zh = (
                f'<a href="live/{item.name}-{code}.html">{item.texts(code)["title"]}</a>' for code in ("en", "zh")
            )
            lines.append(f"- {item.texts()['question']} {en}, {zh}")
    return "\n".join([*lines, ""])
