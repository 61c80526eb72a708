"""A suite: several tests of one instrument, each a system of its own, with one report.

    class DriftTestSuite(Suite):
        title = "Drift tests of one gyro"
        sets = {"floated": "tumble_single_axis servo_polar"}
        options = {"tests": Option("floated", str, "..."), **Suite.about}
        shared = ("torquer.scale_factor", "latitude")

A value goes to every test that has it: ``gyro.D_I`` to all with a slot gyro, ``latitude`` to all with this option; with
the test's name before it to this one alone: ``servo_polar.turns``, ``servo_polar.table.tilt[1]``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from gyrobench.bench import Bench, suggest_names
from gyrobench.system.configurable import Configurable, InvalidConfigurationError, Option, load_configurable
from gyrobench.system.loop_plan import LoopPlan
from gyrobench.system.parameters import slot_seed
from gyrobench.system.system import System, load_system
from gyrobench.system.values import InvalidValueError


class Suite(Configurable):
    """Base class of the suites.  Each test runs as a system of its own with a seed of its own: noise is drawn anew, and
    so is what is drawn when a gyro is switched on.  Parameters of the instrument are the same in all tests, unless a
    value is given for one of them.
    """

    item: ClassVar[str] = "gyro"  # the slot of what is tested: the same socket and part in all tests
    sets: ClassVar[Mapping[str, str]] = {}  # word -> names of tests, for the option tests
    shared: ClassVar[tuple[str, ...]] = ()  # ids of sources that are one and the same error in all tests
    method: ClassVar[str] = ""
    sources: ClassVar[tuple[str, ...]] = ()
    conventions: ClassVar[tuple[str, ...]] = ()
    about: ClassVar[Mapping[str, Option]] = {
        "instrument": Option("", str, "type and number of the instrument, for the report"),
        "laboratory": Option("", str, "name and address of the laboratory, for the report"),
        "customer": Option("", str, "for whom the tests were made, for the report"),
        "operator": Option("", str, "who made the tests, for the report"),
        "conditions": Option("", str, "temperature, warm-up and the like, for the report"),
        "equipment": Option("", str, "current meter, encoder, clock and their calibration, for the report"),
    }

    def __init__(self) -> None:
        super().__init__()
        self.passed: dict[str, Any] = {}  # values for the tests, as given

    def set(self, name: str, value: Any) -> None:
        """Set an option, or keep a value for the tests; whether it fits is seen in :meth:`members`."""
        if name in self.options:
            super().set(name, value)
        else:
            self.passed[name] = value

    def tests(self) -> list[str]:
        """Names of the tests, in their order."""
        words = self["tests"].replace(",", " ").split()
        return [name for word in words for name in self.sets.get(word, word).split()]

    def members(self, bench: Path | None = None) -> dict[str, System]:
        """Return the tests with their values set.

        Raises InvalidConfigurationError for tests that do not exist, that are named twice or are not of one instrument,
        and InvalidValueError for a value that goes to none of them.
        """
        names = self.tests()
        known = {n for n in Bench.find(bench).systems() if n != self.name}
        problems = [f"no test '{n}'; {suggest_names(n, [*self.sets, *sorted(known)])}" for n in names if n not in known]
        problems += [f"{n}: named twice" for n in dict.fromkeys(names) if names.count(n) > 1]
        if len(set(names)) < 2:
            problems.append(f"{len(set(names))} test: at least two are needed to compare methods")
        if problems:
            raise InvalidConfigurationError(self.name, problems)
        members = {n: load_system(n, bench) for n in names}
        self._require_one_instrument(members)
        given = self.given_to(members)
        for name, system in members.items():
            for key, value in given[name].items():
                system.set(key, value)
        return members

    def _require_one_instrument(self, members: Mapping[str, System]) -> None:
        """Raise InvalidConfigurationError for tests that are not drift tests of one and the same instrument."""
        without = [n for n, s in members.items() if self.item not in s.slots]
        if without:
            problem = f"{', '.join(without)}: no slot {self.item}, so not a test of a {self.item}"
            raise InvalidConfigurationError(self.name, [problem])
        loops = [n for n, s in members.items() if isinstance(s.plan(), LoopPlan)]
        if loops:
            problem = f"{', '.join(loops)}: a test of a loop; a suite compares drift tests"
            raise InvalidConfigurationError(self.name, [problem])
        kinds: dict[tuple[str, str], list[str]] = {}
        for name, system in members.items():
            slot = system.slots[self.item]
            socket = slot.socket if isinstance(slot.socket, str) else slot.socket.name
            kinds.setdefault((socket, slot.part), []).append(name)
        if len(kinds) > 1:
            parts = "; ".join(f"{', '.join(names)}: {part} ({socket})" for (socket, part), names in kinds.items())
            raise InvalidConfigurationError(
                self.name, [f"the tests are not of one {self.item}: {parts}; leave out the tests of the other"]
            )

    def given_to(self, members: Mapping[str, System]) -> dict[str, dict[str, Any]]:
        """Return the values that go to each test.  Raises InvalidValueError for one that goes to none."""
        to_all: dict[str, dict[str, Any]] = {n: {} for n in members}
        to_one: dict[str, dict[str, Any]] = {n: {} for n in members}
        for key, value in self.passed.items():
            first, dot, rest = key.partition(".")
            if dot and first in members:
                slot = rest.partition(".")[0]
                if rest not in members[first].options and slot not in members[first].all_slots():
                    raise InvalidValueError(f"{key}: {first} has no option {rest} and no slot {slot}")
                to_one[first][rest] = value
                continue
            takers = [n for n, s in members.items() if (first in s.all_slots() if dot else key in s.options)]
            if not takers:
                slots = sorted({x for s in members.values() for x in s.all_slots()})
                options = sorted({x for s in members.values() for x in s.options} | set(self.options))
                hint = suggest_names(first, [*members, *slots]) if dot else suggest_names(key, options)
                missing = f"no slot '{first}'; " if dot else ""
                raise InvalidValueError(f"{key}: no test of the suite takes it: {missing}{hint}")
            for n in takers:
                to_all[n][key] = value
        return {n: {**to_all[n], **to_one[n]} for n in members}

    def swaps(self, members: Mapping[str, System], given: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """Return the parts or mapping files that go to each test: to all with the slot.

        Raises InvalidValueError for a slot that no test has.
        """
        for slot in given:
            if not any(slot in s.all_slots() for s in members.values()):
                raise InvalidValueError(f"no test of the suite has a slot '{slot}'")
        return {n: {slot: v for slot, v in given.items() if slot in s.all_slots()} for n, s in members.items()}

    def seed_of(self, seed: int, name: str) -> int:
        """The seed of one test; with it the test alone gives the same record."""
        return slot_seed(seed, name)


def load_test(name: str, bench: Path | None = None) -> System | Suite:
    """Return the system or suite ``name`` of a bench with its default values; raises as load_configurable."""
    test = load_configurable(name, bench)
    assert isinstance(test, System | Suite)  # there are no other kinds
    return test
