"""The Python target: the part's own class behind pythonfmu, with copies of gyrobench.component and gyrobench.errors.

pythonfmu shares ``sys.modules`` between the FMUs of a process: every file in ``resources`` therefore
carries a name that is unique to the part and its content.  Our modelDescription replaces pythonfmu's.

Limits of its host (0.7.0): a failure is fmi2Fatal, not fmi2Error (the message in the log is that of the native
FMU, and the instance can still be reset and freed); the GUID given at instantiation is not looked at; there are no
directional derivatives.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from gyrobench.component import Component
from gyrobench.packaging.loading import ROOM, BuildError, sources
from gyrobench.packaging.tuning import tuning

TOOL = Path(__file__).parent.parent
RUNTIME = (*sorted((TOOL / "component").rglob("*.py")), TOOL / "errors.py")  # what a Python FMU may carry of gyrobench
BLOCK = re.compile(r"\bgyrobench\.component\.blocks\.(\w+)")
BLOCKS = re.compile(r"\bgyrobench\.component(?:\.blocks import\b| import .*\bblocks\b)")

SLAVE = '''\
"""Python FMU of {cls} {version}: the plain part behind the FMI calls."""
import ctypes
import functools
import traceback

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from {unique}.component import ComponentError
from {unique}.model import {cls} as Part

Part._tunable, Part._derived = frozenset({tunable}), {derived}


def logged(call):
    """Write the refusal of a call, or the traceback of a fault, to the FMI log, even if logging is off.

    pythonfmu 0.7.0 answers an exception with fmi2Fatal and drops its references to instance, class and log,
    but uses them again when the instance is reset or freed: each is given one reference more.
    """

    @functools.wraps(call)
    def guarded(self, *args):
        try:
            return call(self, *args)
        except Exception as e:
            text = str(e) if isinstance(e, ComponentError) else f"{{self.instance_name}}: {{traceback.format_exc()}}"
            if self.logger:  # the C++ object: a pointer to its methods, then the bool "logging is on"
                ctypes.c_bool.from_address(self.logger + ctypes.sizeof(ctypes.c_void_p)).value = True
            self.log(text.replace("%", "%%"), Fmi2Status.error)  # the logger takes a printf format
            for held in (self, type(self), self.log_queue):
                ctypes.pythonapi.Py_IncRef(ctypes.py_object(held))
            raise

    return guarded


class {cls}(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.logger = kwargs.get("logger", 0)
        self.part = Part(self.instance_name)
        self.t0 = 0.0

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        self.t0 = start_time

    @logged
    def exit_initialization_mode(self):
        self.part.initialize(self.t0)

    @logged
    def do_step(self, current_time, step_size):
        self.part.do_step(current_time, step_size)
        return True  # False would be fmi2Discard, which a master may take for the planned end of the run

    @logged
    def get_real(self, vrs):
        return self.part.read(vrs)

    @logged
    def get_integer(self, vrs):
        return [round(x) for x in self.part.read(vrs)]

    @logged
    def get_boolean(self, vrs):
        return [x != 0.0 for x in self.part.read(vrs)]

    @logged
    def set_real(self, vrs, values):
        self.part.write(vrs, values)

    set_integer = set_boolean = set_real

    @logged
    def get_string(self, vrs):
        raise ComponentError(f"{{self.instance_name}}: this FMU has no string variables")

    def set_string(self, vrs, values):
        self.get_string(vrs)

    @logged
    def _get_fmu_state(self):
        return self.part.get_state()

    @logged
    def _set_fmu_state(self, state):
        self.part.set_state(state)
'''


def renamed(text: str, unique: str) -> str:
    """Return a file whose imports of gyrobench and of other parts are those of the FMU's own runtime package."""
    text = re.sub(r"^(\s*)(from|import) gyrobench\b", rf"\1\2 {unique}", text, flags=re.M)
    return re.sub(rf"^(\s*)from {ROOM}\b", rf"\1from {unique}.{ROOM}", text, flags=re.M)


def _runtime(parts: Iterable[str]) -> dict[str, str]:
    """Return the files of :data:`RUNTIME` by name, but for the blocks that parts of these texts do not use."""
    texts = {f.relative_to(TOOL).as_posix(): f.read_text(encoding="utf-8") for f in RUNTIME}
    blocks = {n.removeprefix("component/blocks/").removesuffix(".py"): n for n in texts if "/blocks/" in n}
    used, new = {"__init__"}, list(parts)
    while new:
        text = new.pop()
        named = set(blocks if BLOCKS.search(text) else BLOCK.findall(text)) - used
        used |= named
        new += [texts[blocks[n]] for n in named if n in blocks]
    return {n: text for n, text in texts.items() if n not in {blocks[b] for b in blocks.keys() - used}}


def resources(cls: type[Component], guid: str) -> tuple[str, dict[str, str]]:
    """Return (module name, files under resources/).  Raises BuildError if the model imports what it cannot carry."""
    unique = f"gb_{cls.__name__.lower()}_{guid.replace('-', '')[:12]}"
    texts: dict[str, str] = {}
    for name, path in sources(cls).items():
        text = path.read_text(encoding="utf-8")
        for module in re.findall(r"^(?:from|import) gyrobench\.([\w.]+)", text, flags=re.M):
            if module.split(".")[0] != "component":
                raise BuildError(
                    f"{path} imports gyrobench.{module}: a part uses gyrobench.component only, so that its Python FMU "
                    "can carry it"
                )
        texts[f"{name.replace('.', '/')}.py"] = text
    texts = _runtime(texts.values()) | texts
    files = {f"{unique}/{n}": renamed(t, unique) for n, t in texts.items()}
    files[f"{unique}/__init__.py"] = ""
    module = f"{unique}_slave"
    tuned = tuning(cls)
    files[f"{module}.py"] = SLAVE.format(
        cls=cls.__name__, version=cls.version, unique=unique, tunable=sorted(tuned.tunable), derived=tuned.derived
    )
    return module, files
