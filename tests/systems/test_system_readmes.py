"""The README of each system: what its table of options says is what the system declares; what every README has."""

from __future__ import annotations

import re

import pytest

from gyrobench.bench import Bench, standard_folder
from gyrobench.system.system import load_system

SYSTEMS = sorted(n for n in Bench(standard_folder()).systems() if n != "drift_test_suite")
TABLE = re.compile(r"^\| option \| default \| unit \| meaning \|\n\|---\|---\|---\|---\|\n((?:\|.*\n)+)", re.M)
SHARED = "shared_options.md"
LINK = re.compile(rf"\(../../docs/{SHARED}\)\): ([^.]+)\.")
#: their table and this link have all options, in the words of the declarations
WHOLE = {
    "accelerometer_four", "accelerometer_multipoint", "drift_record", "eight_position", "fixed_position",
    "imu_positions", "open_loop_drift", "pickoff_scale_factor", "rate_table_test", "servo_polar", "servo_two_axis",
    "servo_vertical_level", "torquer_scale_factor", "tumble_single_axis", "tumble_two_axis", "tumble_two_channel",
}  # fmt: skip
#: they leave most options to docs/systems.md, which lists all
PART = {
    "platform_single_axis", "platform_three_axis", "stabilizer_power_2dof", "table_position_test", "table_rate_test",
}  # fmt: skip


def rows_of(text: str) -> list[str]:
    """Return the rows of the tables of options in a page."""
    return "".join(TABLE.findall(text)).splitlines()


SHARED_ROWS = {row.split("`")[1]: row for row in rows_of((standard_folder() / "docs" / SHARED).read_text("utf-8"))}


@pytest.mark.parametrize("name", SYSTEMS)
def test_readme(name: str) -> None:
    system = load_system(name)
    assert system.folder is not None
    text = (system.folder / "README.md").read_text("utf-8")
    shared = [n for names in LINK.findall(text) for n in re.findall(r"`(\w+)`", names)]
    listed = set()
    for row in [*rows_of(text), *(SHARED_ROWS[n] for n in shared)]:
        names, default, unit, meaning = (c.strip() for c in row.strip("|").split("|"))
        for each in re.findall(r"`(\w+)`", names):
            option = system.options[each]
            listed.add(each)
            declared = option.unit if isinstance(option.unit, str) else option.unit.__name__
            assert not unit or declared in unit.split(", "), each
            assert meaning == option.doc or (name not in WHOLE and each not in shared), each
            if re.match(r"[-\d]|true$|false$", default) and "," not in names:
                parsed, real = (option.parse(each, d) for d in (default, option.default))
                assert parsed == (pytest.approx(real, rel=1e-3) if isinstance(real, float) else real), each
    assert listed == set(system.options) or name not in WHOLE
    code = " ".join(re.findall(r"`([^`\n]+)`", text))
    unnamed = {o for o in system.options if not re.search(rf"\b{o}\b", code)}
    assert not unnamed or name in PART, f"options that the README does not name: {sorted(unnamed)}"
    assert re.search(r"^## (Not modelled|Limits|What comes out)$", text, re.M)
