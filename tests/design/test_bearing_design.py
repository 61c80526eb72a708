"""The bearing as a result: page, values for the part, and what is refused."""

from __future__ import annotations

import json
import math
import re
import tomllib
from pathlib import Path

import pytest

from gyrobench.bench import UsageError, standard_folder
from gyrobench.design.aerostatic import AerostaticBearing, BearingError
from gyrobench.design.bearing_design import BearingDesign, design_bearing
from gyrobench.design.bearing_page import write_bearing
from gyrobench.packaging import load_part
from gyrobench.units import parse_quantity


@pytest.fixture(scope="module")
def designed() -> BearingDesign:
    return design_bearing({"orifices": "24", "supply": "600kPa"}, "1e9N/m", "500N")


def test_gap_and_eccentricity_are_those_asked_for(designed: BearingDesign) -> None:
    b = designed.bearing
    assert b.stiffness() == pytest.approx(1e9, rel=1e-6) and b.orifices == 24
    assert b.load(designed.eccentricity) == pytest.approx(500.0, rel=1e-9)
    assert designed.eccentricity == pytest.approx(500.0 / 1e9 / b.gap, rel=1e-2)  # it is a spring while eps is small


def test_the_gap_is_printed(designed: BearingDesign) -> None:
    """It is what --stiffness finds: in the file for the part in m, for a reader in um."""
    gap = parse_quantity(tomllib.loads(designed.toml())["bearing"]["air_gap"], "m")
    assert f"gap  {gap * 1e6:.3g} µm" in str(designed).splitlines()


def test_the_stiffest_gap(designed: BearingDesign) -> None:
    """A neighbour on either side is softer."""
    best = designed.bearing.stiffest()
    for factor in (0.97, 1.03):
        neighbour = AerostaticBearing(gap=factor * best.gap)
        assert neighbour.stiffness() < best.stiffness()


def test_the_part_takes_the_values(designed: BearingDesign) -> None:
    """The viscous torque of the part is that of the design plus its thrust faces, by hand."""
    values = tomllib.loads(designed.toml())["bearing"]
    part = load_part("bearing_air", standard_folder())()
    for name, value in values.items():
        number = parse_quantity(value, part.declarations[name].unit) if isinstance(value, str) else value
        setattr(part, name, number)
    part.initialize()
    part.rate = 0.1
    part.do_step(0.0, 1e-3)
    faces = 1.837e-5 * math.pi * (0.125**4 - 0.075**4) / 2e-5
    torque = -0.1 * (designed.viscous + faces)
    assert pytest.approx(torque, rel=1e-6) == part.M


@pytest.mark.long
def test_page(designed: BearingDesign, tmp_path: Path) -> None:
    written = write_bearing(designed, tmp_path)
    assert {p.name for p in written.values()} == {"bearing.json", "bearing.html", "bearing.pdf", "bearing.toml"}
    assert json.loads(written["json"].read_text())["stiffness"] == pytest.approx(1e9, rel=1e-6)
    html = written["html"].read_text(encoding="utf-8")
    assert all(f'id="{n}-' in html for n in ("general", "load", "stiffness", "slope"))
    assert "1000 N/µm" in html
    assert "gyrobench run table_servo_loop --set @bearing.toml" in re.sub("</?span[^>]*>", "", html)
    assert not re.search(r"\bnan\b|\binf\b", re.sub(r"<svg.*?</svg>", "", html, flags=re.S))
    assert written["pdf"].read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("values", "stiffness", "load", "said"),
    [
        ({"orifice_": "1mm"}, None, "0", "unknown"),
        ({}, None, "20m", "does not convert"),
        ({"gap": "20um"}, "1e9N/m", "0", "leave --set gap"),
        ({"orifices": "8.5"}, None, "0", "integer"),
        ({}, None, "1e6N", "carries"),
        ({}, None, "-1N", "must be >= 0"),
        ({}, "1e12N/m", "0", "gaps up to"),
    ],
)
def test_refused(values: dict[str, str], stiffness: str | None, load: str, said: str) -> None:
    with pytest.raises((UsageError, BearingError), match=said):
        design_bearing(values, stiffness, load)
