"""The systems of a bench as one looks for them: by purpose."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

from gyrobench.bench import Bench, standard_folder
from gyrobench.system.loop_plan import LoopPlan
from gyrobench.system.suite import Suite
from gyrobench.system.system import System
from gyrobench.workflow.inputs import load_test
from gyrobench.workflow.user_errors import user_message

GYRO, DATA, LOOP, LEARN = "I have an instrument", "I have data", "I design a loop", "I learn"
PURPOSES = (GYRO, DATA, LOOP, LEARN)
FEW = 6  # slots: a system that can be seen at a glance


@dataclass(frozen=True)
class GalleryEntry:
    """A system of the gallery.

    problem: why it does not load, "" where it does.  picture: a figure of its report, where the bench has one.
    measured: it reduces measured data; designs: its shortest plan can be asked for.
    """

    name: str
    title: str
    summary: str
    purposes: tuple[str, ...]
    slots: int
    suite: bool
    problem: str = ""
    picture: Path | None = None
    measured: bool = False
    designs: bool = False


def picture_of(bench: Bench, name: str) -> Path | None:
    """Return the picture of a system in reports/gallery; None where there is none."""
    files = (root / "reports" / "gallery" / f"{name}.svg" for root in (bench.folder, standard_folder()))
    return next((f for f in files if f.is_file()), None)


def purposes_of(test: System | Suite) -> tuple[str, ...]:
    """Return the purposes that a system serves, from what it declares."""
    if isinstance(test, Suite):
        return (GYRO,)
    found = []
    loop = bool(test.loops) or isinstance(test.plan(), LoopPlan)
    if (test.windows is not None and not loop) or (test.measured_data is not None and not test.loops):
        found.append(GYRO)
    if test.measured_data is not None:
        found.append(DATA)
    if not found:
        found.append(LOOP)
    if 0 < len(test.slots) <= FEW:
        found.append(LEARN)
    return tuple(found)


def entry(bench: Bench, name: str) -> GalleryEntry:
    """Return a system of the bench as the gallery shows it."""
    picture = picture_of(bench, name)
    try:
        test = load_test(name)
        first = (type(test).__doc__ or "").strip().partition("\n\n")[0]
        summary = " ".join(first.split()).partition("  [")[0].partition(" [")[0]
        slots = 0 if isinstance(test, Suite) else len(test.slots)
        suite, title = isinstance(test, Suite), test.title or name
        measured = isinstance(test, System) and test.measured_data is not None
        designs = isinstance(test, Suite) or bool(test.protocol)
        return GalleryEntry(
            name, title, summary, purposes_of(test), slots, suite, picture=picture, measured=measured, designs=designs
        )
    except Exception as error:  # of the user's code: the others are shown all the same
        return GalleryEntry(name, name, "", (), 0, False, user_message(error), picture)


def gallery(bench: Bench) -> list[GalleryEntry]:
    """Return all systems of the bench, by title; one whose file has not changed is loaded once."""
    found = (_known(bench, n, (f / "system.py").stat().st_mtime_ns) for n, f in bench.systems().items())
    return sorted(found, key=lambda e: e.title.lower())


@functools.lru_cache(maxsize=1024)
def _known(bench: Bench, name: str, _changed: int) -> GalleryEntry:
    return entry(bench, name)
