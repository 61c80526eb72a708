"""Shell completion: names of the bench, settings and slots of a system."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable
from typing import TYPE_CHECKING

from gyrobench.bench import Bench

if TYPE_CHECKING:
    from gyrobench.system.suite import Suite
    from gyrobench.system.system import Slot, System


def _starting(names: Iterable[str], incomplete: str) -> list[str]:
    return [n for n in names if n.startswith(incomplete)]


def complete_system(incomplete: str) -> list[str]:
    """Return the systems of the bench."""
    return _starting(Bench.find().systems(), incomplete)


def complete_part(incomplete: str) -> list[str]:
    """Return the parts of the bench."""
    return _starting(Bench.find().parts(), incomplete)


def complete_copy(incomplete: str) -> list[str]:
    """Return parts and systems of the bench."""
    bench = Bench.find()
    return _starting(dict.fromkeys([*bench.parts(), *bench.systems()]), incomplete)


def complete_specification(incomplete: str) -> list[str]:
    """Return the acceptance specifications of the bench."""
    return _starting(Bench.find().specifications(), incomplete)


def complete_setting(incomplete: str) -> list[str]:
    """Return "option=" for each option of the system named before; after "slot." the parameters of its part."""
    test = _named_before()
    slots = _slots(test)
    slot, dot, _ = incomplete.partition(".")
    if test is None or (dot and slot not in slots):
        return []
    if not dot:
        return _starting([*(f"{o}=" for o in test.options), *(f"{s}." for s in slots)], incomplete)
    from gyrobench.component import Noise, Parameter
    from gyrobench.packaging import load_part

    part = load_part(slots[slot].part, Bench.find().folder)
    names = (n for n, d in part.declarations.items() if isinstance(d, Parameter | Noise))
    return _starting((f"{slot}.{name}=" for name in names), incomplete)


def complete_slot(incomplete: str) -> list[str]:
    """Return "slot=" for each slot of the system named before."""
    return _starting((f"{s}=" for s in _slots(_named_before())), incomplete)


def _slots(test: System | Suite | None) -> dict[str, Slot]:
    """Return the slots of a system, those on request too; none of a suite."""
    return {} if test is None or not hasattr(test, "all_slots") else test.all_slots()


def _named_before() -> System | Suite | None:
    """Return the system or suite that the command line names; None where it names none, or one that does not load.

    The words are those that the shell gives: an option that has no value yet keeps the parser from reading them.
    """
    line = os.environ.get("COMP_WORDS") or os.environ.get("_TYPER_COMPLETE_ARGS") or ""
    known = Bench.find().systems()
    name = next((word for word in line.split() if word in known), None)
    if name is not None:
        with contextlib.suppress(Exception):  # the command itself reports why it does not load
            from gyrobench.workflow.inputs import load_test

            return load_test(name)
    return None
