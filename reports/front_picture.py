"""The picture of the README, the top of the report of a tumble:  python reports/front_picture.py

Runs the test, takes a picture of report.html in headless Chromium and writes reports/tumble_single_axis.png, with the
version of gyrobench and the command in its metadata: tests/test_documentation.py compares them.
"""

from __future__ import annotations

import importlib.metadata
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image, PngImagePlugin

FILE = Path(__file__).with_name("tumble_single_axis.png")
COMMAND = ("run", "tumble_single_axis", "--set", "latitude=45.75deg", "--seed", "7")
WIDTH, HEIGHT = 1240, 1990  # pixels


def written_by() -> dict[str, str]:
    """Return what the metadata of a picture of this version say."""
    return {"gyrobench": importlib.metadata.version("gyrobench"), "command": " ".join(("gyrobench", *COMMAND))}


def screenshot(page: Path, picture: Path) -> None:
    """Write the top of a page as a PNG file."""
    browser = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
    if browser is None:
        sys.exit("no chromium on the path: the picture is taken in a headless browser")
    size = f"--window-size={WIDTH},{HEIGHT}"
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", size, f"--screenshot={picture}"]
    subprocess.run([browser, *options, page.as_uri()], check=True, capture_output=True, timeout=120)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        run = Path(folder) / "run"
        command = [sys.executable, "-m", "gyrobench", *COMMAND, "--out", str(run)]
        subprocess.run(command, check=True, capture_output=True, cwd=folder)
        screenshot(run / "report.html", Path(folder) / "top.png")
        text = PngImagePlugin.PngInfo()
        for name, value in written_by().items():
            text.add_text(name, value)
        colours = Image.open(Path(folder) / "top.png").convert("RGB").quantize(64, dither=Image.Dither.NONE)
        colours.save(FILE, optimize=True, pnginfo=text)
    print(FILE.name, f"{FILE.stat().st_size // 1000} kB, {written_by()['gyrobench']}")


if __name__ == "__main__":
    main()
