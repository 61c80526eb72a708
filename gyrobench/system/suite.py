"""A suite: several tests of one instrument, each a system of its own, with one report.

    class DriftTestSuite(Suite):
        title = "Drift tests of one gyro"
        sets = {"floated": "tumble_single_axis servo_polar"}
        options = {"tests": Option("floated", str, "..."), **Suite.about}
        shared = ("torquer scale factor", "latitude")

A value goes to every test that has it: ``gyro.D_I`` to all with a slot gyro, ``latitude`` to all with this option; with
the test's name before it to this one alone: ``servo_polar.turns``, ``servo_polar.table.tilt[1]``.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

from gyrobench.bench import Bench, nearest
from gyrobench.system.parameters import slot_seed
from gyrobench.system.system import InvalidConfigurationError, Option, System, load_system
from gyrobench.system.values import InvalidValueError


class Suite(System):
    """Base class of the suites.  Each test runs as a system of its own with a seed of its own: noise is drawn anew, and
    so is what is drawn when a gyro is switched on.  Parameters of the instrument are the same in all tests, unless a
    value is given for one of them.
    """

    item: ClassVar[str] = "gyro"  # the slot of what is tested: the same socket and part in all tests
    sets: ClassVar[Mapping[str, str]] = {}  # word -> names of tests, for the option tests
    shared: ClassVar[tuple[str, ...]] = ()  # sources of type B that are one and the same error in all tests
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
        """Keeps a value for the tests; whether it fits is seen in :meth:`members`.  Raises InvalidValueError."""
        if name in self.options:
            super().set(name, value)
        else:
            self.passed[name] = value

    def with_values(self, values: Mapping[str, Any]) -> System:
        copy = type(self)()
        copy.name, copy.folder, copy.values = self.name, self.folder, dict(self.values)
        copy.passed, copy.given = dict(self.passed), list(self.given)
        for name, value in values.items():
            copy.set(name, value)
        return copy

    def tests(self) -> list[str]:
        """Names of the tests, in their order."""
        words = self["tests"].replace(",", " ").split()
        return [name for word in words for name in self.sets.get(word, word).split()]

    def members(self, bench: Path | None = None) -> dict[str, System]:
        """The tests with their values set.

        Raises InvalidConfigurationError for tests that do not exist, that are named twice or are not of one instrument,
        and InvalidValueError for a value that goes to none of them.
        """
        names = self.tests()
        known = {n for n in Bench.find(bench).systems() if n != self.name}
        wrong = [f"no test '{n}'; {nearest(n, [*self.sets, *sorted(known)])}" for n in names if n not in known]
        wrong += [f"{n}: named twice" for n in dict.fromkeys(names) if names.count(n) > 1]
        if len(set(names)) < 2:
            wrong.append(f"{len(set(names))} test: at least two are needed to compare methods")
        if wrong:
            raise InvalidConfigurationError(self.name, wrong)
        found = {n: load_system(n, bench) for n in names}
        self._one_instrument(found)
        given = self.given_to(found)
        for name, system in found.items():
            for key, value in given[name].items():
                system.set(key, value)
        return found

    def _one_instrument(self, members: Mapping[str, System]) -> None:
        bare = [n for n, s in members.items() if self.item not in s.slots]
        if bare:
            problem = f"{', '.join(bare)}: no slot {self.item}, so no test of a {self.item}"
            raise InvalidConfigurationError(self.name, [problem])
        kinds: dict[tuple[str, str], list[str]] = {}
        for name, system in members.items():
            slot = system.slots[self.item]
            socket = slot.socket if isinstance(slot.socket, str) else slot.socket.name
            kinds.setdefault((socket, slot.part), []).append(name)
        if len(kinds) > 1:
            said = "; ".join(f"{', '.join(names)}: {part} ({socket})" for (socket, part), names in kinds.items())
            raise InvalidConfigurationError(
                self.name, [f"the tests are not of one {self.item}: {said}; leave out the tests of the other"]
            )

    def given_to(self, members: Mapping[str, System]) -> dict[str, dict[str, Any]]:
        """test -> the values that go to it.  Raises InvalidValueError for one that goes to none."""
        found: dict[str, dict[str, Any]] = {n: {} for n in members}
        alone: dict[str, dict[str, Any]] = {n: {} for n in members}
        for key, value in self.passed.items():
            first, dot, rest = key.partition(".")
            if dot and first in members:
                slot = rest.partition(".")[0]
                if rest not in members[first].options and slot not in members[first].slots:
                    raise InvalidValueError(f"{key}: {first} has no option {rest} and no slot {slot}")
                alone[first][rest] = value
                continue
            fits = [n for n, s in members.items() if (first in s.slots if dot else key in s.options)]
            if not fits:
                slots = sorted({x for s in members.values() for x in s.slots})
                options = sorted({x for s in members.values() for x in s.options} | set(self.options))
                what = f"no slot '{first}'; {nearest(first, [*members, *slots])}" if dot else nearest(key, options)
                raise InvalidValueError(f"{key}: no test of the suite takes it: {what}")
            for n in fits:
                found[n][key] = value
        return {n: {**found[n], **alone[n]} for n in members}

    def swaps(self, members: Mapping[str, System], given: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
        """test -> parts, mapping files or isolated slots that go to it: to all with the slot.

        Raises InvalidValueError for a slot that no test has.
        """
        for slot in given:
            if not any(slot in s.slots for s in members.values()):
                raise InvalidValueError(f"no test of the suite has a slot '{slot}'")
        return {n: {slot: v for slot, v in given.items() if slot in s.slots} for n, s in members.items()}

    def seed_of(self, seed: int, name: str) -> int:
        """The seed of one test; with it the test alone gives the same record."""
        return slot_seed(seed, name)
