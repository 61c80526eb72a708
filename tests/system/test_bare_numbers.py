"""A number without a unit that is far outside the usual size is questioned before anything runs."""

from __future__ import annotations

import re
import shlex
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from gyrobench.bench import Bench, standard_folder
from gyrobench.system.configurable import Option, load_configurable
from gyrobench.system.parameters import defaults, resolve
from gyrobench.system.part_files import resolve_parts
from gyrobench.system.system import System, load_system
from gyrobench.system.values import InvalidValueError
from gyrobench.system.wiring import assemble

Foreign = Callable[[str], Path]
FOREIGN = Path(__file__).parents[1] / "foreign"
ROOT = Path(__file__).parents[2]


def resolved(system: System, values: Mapping[str, Any], parts: Any = None, maps: Any = None) -> dict[str, Any]:
    system = system.with_values(values)  # with the slots that the values ask for
    paths, _ = resolve_parts(system, parts or {}, "native", None, [])
    assembly = assemble(system, paths, maps)
    return resolve(assembly, system, 1, defaults(assembly))[1]


@pytest.mark.parametrize("value", ["0.9", " +0.9 ", "9e-1"])
def test_drift_coefficient_without_its_unit(small: System, value: str) -> None:
    """0.9 rad/s for each g would turn the gyro over; it ended after 25 s in "saturated"."""
    with pytest.raises(InvalidValueError) as caught:
        resolved(small, {"gyro.D_I": value})
    assert str(caught.value) == (
        "gyro.D_I = 0.9: without a unit this is 0.9 rad/s/g, that is 1.86e+05 deg/h/g, 2.1e+05 times the usual "
        "4.36e-06 rad/s/g; write 0.9deg/h/g, or 0.9rad/s/g if that is meant"
    )


@pytest.mark.parametrize(
    "name, value, write",
    [
        ("gyro.k", "17.2", "17.2deg/h/mA, or 17.2rad/s/A"),  # 206 times the usual, and right in another unit
        ("gyro.turn_on", "0.1", "0.1deg/h, or 0.1rad/s"),  # default 0: the largest of the part in rad/s
        ("rebalance.i_max", "50", "50mA, or 50A"),
        ("gyro.H", "5000", "5000N.m.s if"),  # no everyday unit makes it usual
    ],
)
def test_what_to_write(small: System, name: str, value: str, write: str) -> None:
    with pytest.raises(InvalidValueError, match=f"^{name} = .*; write {write}"):
        resolved(small, {name: value})


@pytest.mark.parametrize(
    "name, value",
    [
        ("gyro.D_I", "0.9rad/s"), ("gyro.D_I", "0.9rad/s/g"), ("gyro.D_I", "-9deg/h/g"), ("gyro.D_I", "-0.004"),
        ("gyro.k", "17.2deg/h/mA"), ("gyro.k", "17.2rad/s/A"), ("gyro.k", "0.8"), ("gyro.H", "0"), ("gyro.terms", "5"),
        ("gyro.mount", "[[0, 1, 0], [-1, 0, 0], [0, 0, 1]]"), ("table.base", "[[0,1,0],[-1,0,0],[0,0,1]]"),
        ("gyro.markov_tau", "86400"), ("sampler.step", "10"),
    ],
)  # fmt: skip
def test_what_is_not_questioned(small: System, name: str, value: str) -> None:
    """A unit says what is meant; what may be usual passes; numbers of unit 1 have no usual size."""
    resolved(small, {name: value})


def test_numbers_of_python_are_si(small: System) -> None:
    resolved(small, {"gyro.D_I": 0.9, "gyro.k": 17.2})


def test_array_is_questioned_by_its_elements() -> None:
    system = load_system("platform_three_axis")
    resolved(system, {"platform.I_r": "[8, 9, 7]"})
    with pytest.raises(InvalidValueError, match=r"^platform.I_r\[2\] = 9000: without a unit this is 9000 kg.m2"):
        resolved(system, {"platform.I_r": "[8, 9000, 7]"})
    with pytest.raises(InvalidValueError, match=r"^gyro.mass\[2\] = 3000"):
        Option([1.0, 2.0], "kg").parse("gyro.mass", "[1, 3000]")


def test_foreign_part_is_asked_in_si(small: System, foreign: Foreign) -> None:
    """Its own unit is deg/h/mA; a bare number is SI as everywhere."""
    vendor: Any = {"gyro": foreign("vendor_gyro")}, {"gyro": FOREIGN / "vendor_gyro.toml"}
    with pytest.raises(InvalidValueError, match=r"gyro.k = 20: without a unit this is 20 rad/s/A"):
        resolved(small, {"gyro.k": "20"}, *vendor)
    resolved(small, {"gyro.k": "20deg/h/mA"}, *vendor)


def test_options() -> None:
    time, base = Option("10min", "s"), Option("1deg", "rad", "", 0.0)
    assert time.parse("dwell", "86400") == 86400.0
    assert base.parse("base", "1.5") == 1.5  # rad, and a large swing
    with pytest.raises(InvalidValueError, match=r"^base = 60: without a unit this is 60 rad, .*; write 60arcmin, or"):
        base.parse("base", "60")
    with pytest.raises(InvalidValueError, match=r"^dwell = 1e\+06: .* times the usual 600 s; write 1e\+06s if"):
        time.parse("dwell", "1e6")
    assert time.parse("dwell", "1e6s") == 1e6
    assert Option(0.0, "rad").parse("offset", "500") == 500.0  # nothing tells its usual size


def documented() -> list[tuple[str, dict[str, str], dict[str, str]]]:
    """System, values and parts of every ``gyrobench run`` in the README files and the guides."""
    found = []
    systems = Bench(standard_folder()).systems()
    files = (f for pattern in ("*.md", "docs/**/*.md", "*/*/README.md") for f in ROOT.glob(pattern))
    printed = {c.strip() for f in files for c in re.findall(r"gyrobench run ([^`\n#]+)", f.read_text("utf-8"))}
    for command in sorted(printed):
        words = shlex.split(command.replace("...", ""))
        pairs = {option: dict[str, str]() for option in ("--set", "--part")}
        for option, word in pairwise(words):
            if option in pairs and "=" in word:
                name, _, value = word.partition("=")
                pairs[option][name] = value
        if words and words[0] in systems and pairs["--set"]:
            found.append((words[0], pairs["--set"], pairs["--part"]))
    return found


@pytest.mark.long
def test_no_documented_command_is_questioned() -> None:
    commands = documented()
    assert len(commands) > 20
    for name, values, parts in commands:
        system = load_configurable(name)
        if isinstance(system, System):
            own = {slot: part for slot, part in parts.items() if part in Bench(standard_folder()).parts()}
            foreign = parts.keys() - own.keys()
            known = {
                n: v
                for n, v in values.items()
                if n.partition(".")[0] not in foreign and n not in ("profile", "program", "path")
            }
            resolved(system, known, own)
