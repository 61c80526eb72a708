"""Pictures of the gallery stand on light and dark pages: no ground of their own, colours that read on both."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from gyrobench.bench import standard_folder

PICTURES = sorted((standard_folder() / "reports" / "gallery").glob("*.svg"))
PAGES = ("#ffffff", "#14171a")  # of reports, light and dark
TEXT = "#767676"


def luminance(colour: str) -> float:
    """Return the relative luminance of sRGB by WCAG 2.1."""
    parts = [int(colour[k : k + 2], 16) / 255.0 for k in (1, 3, 5)]
    red, green, blue = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(first: str, second: str) -> float:
    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)


def test_the_contrast_is_that_of_wcag() -> None:
    assert contrast("#000000", "#ffffff") == pytest.approx(21.0)  # (1 + 0.05)/0.05
    assert contrast("#ffffff", "#767676") == pytest.approx(4.54, abs=0.005)  # the darkest grey of 4.5 usually quoted
    assert min(contrast(TEXT, page) for page in PAGES) > 3.9


@pytest.mark.parametrize("file", PICTURES, ids=lambda p: p.stem)
def test_a_picture_reads_on_light_and_dark_pages(file: Path) -> None:
    text = file.read_text(encoding="utf-8")
    assert "background" not in text and f'fill="{TEXT}"' in text and "var(" not in text
    colours = set(re.findall(r"#[0-9a-f]{6}\b", text))
    assert TEXT in colours
    assert [c for c in sorted(colours) if min(contrast(c, page) for page in PAGES) < 3.0] == []
