"""What a system sees of its parts: values of the user, of the FMU in the slot, of its mapping file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench.packaging import load_part
from gyrobench.system.binding import SocketMismatchError
from gyrobench.system.configurable import InvalidConfigurationError
from gyrobench.system.mapping_files import load_mapping
from gyrobench.system.parameters import defaults, resolve
from gyrobench.system.part_files import resolve_parts
from gyrobench.system.part_values import PartValues
from gyrobench.system.system import System, load_system
from gyrobench.system.values import nest
from gyrobench.system.wiring import assemble

Foreign = Callable[[str], Path]
FOREIGN = Path(__file__).parents[1] / "foreign"
VENDOR = FOREIGN / "vendor_gyro.toml"
DPH_MA = np.pi / 180 / 3600 / 1e-3  # deg/h/mA


def seen(system: System, parts: Mapping[str, Path] | None = None, maps: Mapping[str, Path] | None = None) -> PartValues:
    """What ``system.parameters`` is called with when these FMUs are in the slots."""
    asked: list[PartValues] = []

    class Watch(type(system)):  # type: ignore[misc]
        def parameters(self, parts: PartValues) -> dict[str, Any]:
            asked.append(parts)
            return dict(super().parameters(parts))

    watched = Watch()
    watched.__dict__.update(vars(system))
    paths, _ = resolve_parts(watched, parts or {}, "native", None, [])
    assembly = assemble(watched, paths, maps)
    _, everything, notes = resolve(assembly, watched, 1, defaults(assembly))
    asked[0].__dict__["everything"], asked[0].__dict__["said"] = everything, notes
    return asked[0]


def test_values_of_the_part_until_the_user_sets_others(small: System) -> None:
    parts = seen(small)
    own = nest({s.name: s.start for s in load_part("floated_gyro").layout})
    assert parts["gyro.k"] == own["k"]
    assert parts["gyro.mount"] == [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    assert "gyro.k" in parts and "gyro.kk" not in parts
    assert seen(small.with_values({"gyro.k": "20deg/h/mA"}))["gyro.k"] == pytest.approx(20 * DPH_MA, rel=1e-14)
    one = seen(small.with_values({"gyro.mount[1,1]": 0.5}))
    assert one["gyro.mount"] == [[0.5, 0, 0], [0, 1, 0], [0, 0, 1]]


def test_raw_start_values_count_below_those_of_the_user(small: System) -> None:
    small.raw = {"gyro.H": 0.25}  # type: ignore[misc]
    assert seen(small)["gyro.H"] == 0.25
    assert seen(small.with_values({"gyro.H": 0.3}))["gyro.H"] == 0.3


def test_what_the_system_sets_unless_the_user_does(small: System) -> None:
    parts = seen(small.with_values({"gyro.H": 0.3, "gyro.mount[1,1]": 0.5}))
    assert parts.given("gyro.J", 1e-4) == 1e-4
    assert parts.all_given({"gyro.H": 0.1, "gyro.C": 0.2}) == {"gyro.H": 0.3, "gyro.C": 0.2}
    assert parts.given("gyro.mount", np.eye(3)) == [[0.5, 0, 0], [0, 1, 0], [0, 0, 1]]


def test_foreign_part_through_its_mapping(small: System, foreign: Foreign) -> None:
    slot = {"gyro": foreign("vendor_gyro")}
    parts = seen(small, slot, {"gyro": VENDOR})
    assert parts["gyro.k"] == pytest.approx(20 * DPH_MA, rel=1e-14)  # 20 deg/h/mA, its start value
    assert parts.notes == []
    assert seen(small.with_values({"gyro.k": 0.1}), slot, {"gyro": VENDOR})["gyro.k"] == 0.1


def test_what_a_foreign_part_lacks(small: System, foreign: Foreign) -> None:
    parts = seen(small, {"gyro": foreign("vendor_gyro")}, {"gyro": VENDOR})
    assert parts["gyro.H"] == load_part("floated_gyro")._by_name["H"].start
    (note,) = parts.notes
    assert note.startswith("gyro has no parameter 'H': the design takes 0.2 (SI), the value of floated_gyro; ")
    assert "[parameters.H] with name or value" in note
    assert parts.get("gyro.nowhere", 3.0) == 3.0
    assert parts.notes[1].startswith(
        "gyro has no parameter 'nowhere': the design takes 3 (SI), the value of the system"
    )
    with pytest.raises(InvalidConfigurationError, match=r"gyro: the FMU has no parameter 'nowhere', which the design"):
        parts["gyro.nowhere"]
    with pytest.raises(InvalidConfigurationError, match=r"table2.x: no slot 'table2'; slots: site, sequencer"):
        parts["table2.x"]


def test_notes_of_a_design_reach_the_run(foreign: Foreign) -> None:
    class Design(type(load_system("tumble_single_axis"))):  # type: ignore[misc]
        def parameters(self, parts: PartValues) -> dict[str, Any]:
            return {**super().parameters(parts), "rebalance.K_p": parts["gyro.H"]}

    system = Design()
    parts = seen(system, {"gyro": foreign("vendor_gyro")}, {"gyro": VENDOR})
    assert parts.__dict__["everything"]["rebalance.K_p"] == 0.2
    assert any("gyro has no parameter 'H'" in n for n in parts.__dict__["said"])


def test_value_that_the_mapping_file_states(small: System, foreign: Foreign, tmp_path: Path) -> None:
    file = tmp_path / "gyro.toml"
    text = VENDOR.read_text()
    file.write_text(text + 'H = { value = 0.15 }\nK_sg = { value = 9.5, unit = "V/rad" }\nmass = { value = [1, 2] }\n')
    parts = seen(small, {"gyro": foreign("vendor_gyro")}, {"gyro": file})
    assert (parts["gyro.H"], parts["gyro.K_sg"], parts["gyro.mass"]) == (0.15, 9.5, [1, 2])
    assert parts.notes == []
    assert parts.__dict__["everything"]["gyro.H"] == 0.15  # run.json says it too
    file.write_text(text + 'H = { value = "much" }\nK_sg = { value = 1, unit = "degF" }\n')
    assert load_mapping(file)
    with pytest.raises(SocketMismatchError) as caught:
        seen(small, {"gyro": foreign("vendor_gyro")}, {"gyro": file})
    assert "parameters.H: value much: must be a number or a list of numbers" in str(caught.value)
    assert "parameters.K_sg: unit 'degF' has no factor to SI" in str(caught.value)


def test_system_without_fmus_sees_the_parts_it_is_made_with() -> None:
    system = load_system("tumble_single_axis")
    parts = PartValues(system)
    assert parts["gyro.H"] == 0.2
    assert parts.notes == []
    assert system.parameters(parts)["site.latitude"] == system["latitude"]
