"""Parts and systems of a user with mistakes that no line of theirs reports: an error that names the file."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from commanding import Command

from gyrobench import user_code

PART = '''from gyrobench.component import Component, Input, Output
class P(Component):
    """A part."""
    version = "1.0"
    x = Input(0.0, "1", "in")
    y = Output("1", "out")
    def outputs(self):
        self.y = self.x
'''
SYSTEM = '''from gyrobench.system.configurable import Option
from gyrobench.system.system import Slot, System
class S(System):
    """A system."""
    title = "t"
    slots = {"site": Slot("Site", "site")}
    options = {"a": Option(1.0, "s", "time")}
    wires = ""
'''
PARTS = {
    "version": (PART.replace('"1.0"', "5"), r"model.py: P.version = 5: a text is expected"),
    "unit": (PART.replace('"1", "in"', '5, "in"'), "model.py:5: TypeError: unit 5, description 'in': texts are"),
    "docstring": (PART.replace('"""A part."""', "__doc__ = 5"), "model.py: P.__doc__ is no text"),
    "long sum": (PART.replace("= self.x", "= " + " + ".join(["self.x"] * 3000)), "RecursionError: .*part it"),
    "null byte": (PART + "\0", "model.py: cannot be used: .*null bytes"),
    "end of the program": (PART + "raise SystemExit(4)\n", r"model.py: ends the program \(SystemExit: 4\)"),
    "endless loop": (
        PART + "while True:\n    pass\n",
        r"model.py:(9|10): still running after 0.5 s: a loop without an end",
    ),
}
SYSTEMS = {
    "title": (SYSTEM.replace('"t"', "5"), "system.py: S.title = 5: a text is expected"),
    "slots": (SYSTEM.replace('{"site": Slot("Site", "site")}', "3"), "S.slots = 3: a dictionary is expected"),
    "slot": (SYSTEM.replace('Slot("Site", "site")', "3"), "system.py: cannot be used: AttributeError"),
    "options": (SYSTEM.replace('Option(1.0, "s", "time")', "3"), r"S.options\['a'\] = 3: not a Option"),
    "wires": (SYSTEM.replace('wires = ""', "wires = 5"), "S.wires = 5: a text is expected"),
    "channels": (SYSTEM + '    channels = "site.g"\n', "S.channels = 'site.g': a list of texts is expected"),
    "step": (SYSTEM + '    step = "fast"\n', "S.step = 'fast': a number is expected"),
    "sum": (SYSTEM + "    n = " + " + ".join(["title"] * 6000) + "\n", "RecursionError: .*part it"),
    "null byte": (SYSTEM + "\0", "system.py: cannot be used: .*null bytes"),
    "end of the program": (SYSTEM + "raise SystemExit(4)\n", r"system.py: ends the program \(SystemExit: 4\)"),
}


def bench(folder: Path, room: str, text: str) -> None:
    for name in ("components", "systems", "reports"):
        (folder / name).mkdir()
    own = folder / room / "own"
    own.mkdir()
    (own / ("model.py" if room == "components" else "system.py")).write_text(text)


@pytest.mark.parametrize("case", PARTS)
def test_a_part(case: str, tmp_path: Path, gyrobench: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    if case == "endless loop":
        monkeypatch.setattr(user_code, "LONGEST", 0.5)
    text, message = PARTS[case]
    bench(tmp_path, "components", text)
    code, _, err = gyrobench("build", "own")
    assert code == 2 and err.startswith("gyrobench: ")
    assert re.search(message, err), err


@pytest.mark.parametrize("case", SYSTEMS)
def test_a_system(case: str, tmp_path: Path, gyrobench: Command) -> None:
    text, message = SYSTEMS[case]
    bench(tmp_path, "systems", text)
    code, _, err = gyrobench("show", "own")
    assert code == 2 and err.startswith("gyrobench: ")
    assert re.search(message, err), err
