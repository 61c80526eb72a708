"""Bundles of wires: one line lays several wires between two slots, as single wires would."""

from typing import ClassVar

import pytest

from gyrobench.system.part_files import resolve_parts
from gyrobench.system.system import Slot, System, load_system
from gyrobench.system.wire_text import WiringError, parse_wires
from gyrobench.system.wiring import Assembly, assemble

SINGLE = """
    site.f -> table.f_local
    site.omega -> table.omega_local
    table.omega -> gyro.omega        # comments stay possible
    table.f -> gyro.f
    gyro.u -> rebalance.u
    gyro.x[2] -> rebalance.limit[1]
"""
BUNDLES = """
    site -> table: f=f_local omega=omega_local
    table -> gyro: omega f
    gyro -> rebalance: u x[2]=limit[1]
"""


def test_bundles_are_the_single_wires_in_their_order():
    assert parse_wires(BUNDLES) == parse_wires(SINGLE)
    assert parse_wires("a -> b: y") == [("a", "y", "b", "y")] == parse_wires("a.y -> b.y")


@pytest.mark.parametrize(
    "line",
    ["a -> b", "a -> b:", "a.x -> b: y", "a -> b.y: x", "a -> : x", "-> b: x", "a -> b: x=", "a -> b: =y", "a b: x",
     "a -> b: x=y=z", "a.x", "a.x -> b", "a.x b.y", "a -> b -> c: x", "a -> b: x -> y", "a -> b: x: y"],
)  # fmt: skip
def test_a_line_that_is_neither_is_refused_with_what_to_write(line):
    with pytest.raises(WiringError) as error:
        parse_wires(f"site.f -> table.f_local\n{line}")
    (problem,) = error.value.problems
    assert problem.startswith(f"'{line}': must read 'slot.output -> slot.input' or 'slot -> slot: ")


def assembled(system: System) -> Assembly:
    return assemble(system, resolve_parts(system, {}, "native", None, [])[0])


def bundled(single: System) -> System:
    """The same system with its wires in bundles, slot pair by slot pair."""
    pairs: dict[tuple[str, str], list[str]] = {}
    for a, x, b, y in parse_wires(single.wires):
        pairs.setdefault((a, b), []).append(x if x == y else f"{x}={y}")
    text = "\n".join(f"{a} -> {b}: {' '.join(names)}" for (a, b), names in pairs.items())
    assert text.count("->") < len(parse_wires(single.wires))
    other = single.with_values({})
    other.wires = text  # type: ignore[misc]
    return other


@pytest.mark.parametrize("name", ["tumble_single_axis", "stabilizer_sdf", "platform_three_axis"])
def test_order_cuts_and_connections_are_those_of_the_single_wires(name):
    single = load_system(name)
    first, second = assembled(single), assembled(bundled(single))
    assert first.order.order == second.order.order
    assert {c.wire for c in first.order.cuts} == {c.wire for c in second.order.cuts}
    assert {(c.wire, c.output.variable, c.input.variable, c.gain) for c in first.connections} == {
        (c.wire, c.output.variable, c.input.variable, c.gain) for c in second.connections
    }


def test_a_misfit_in_a_bundle_names_its_wire():
    class Wrong(System):
        slots: ClassVar = {"site": Slot("Site", "site"), "table": Slot("Table", "table_rate")}
        wires = "site -> table: f=f_local omega=f_local speed"

    with pytest.raises(WiringError) as error:
        assembled(Wrong())
    said = "\n".join(error.value.problems)
    assert "site.omega -> table.f_local" in said and "site has no output 'speed'" in said
