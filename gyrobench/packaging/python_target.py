"""The Python target: the part's own class behind pythonfmu, with a runtime of four files.

pythonfmu shares ``sys.modules`` between the FMUs of a process: every file in ``resources`` therefore
carries a name that is unique to the part and its content.  Our modelDescription replaces pythonfmu's.
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path

from gyrobench.component import Component

PACKAGE = Path(__file__).parent.parent
RUNTIME = ("component", "declare", "numerics", "math")

SLAVE = '''\
"""Python FMU of {cls} {version}: the plain part behind the FMI calls."""
import traceback

from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status

from {unique}.model import {cls} as Part


class {cls}(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.part = Part(self.instance_name)
        self.t0 = 0.0

    def told(self, action, *args):
        """Runs an action; its refusal, or the traceback of a fault, goes to the log."""
        try:
            return action(*args)
        except Exception as e:
            text = str(e) if type(e).__name__ == "PartError" else traceback.format_exc()
            self.log(text, Fmi2Status.error)
            raise

    def setup_experiment(self, start_time, stop_time=None, tolerance=None):
        self.t0 = start_time

    def exit_initialization_mode(self):
        self.told(self.part.initialize, self.t0)

    def do_step(self, current_time, step_size):
        try:
            self.told(self.part.do_step, current_time, step_size)
        except Exception:
            return False
        return True

    def read(self, vrs):
        part, layout = self.part, self.part.layout
        if any(layout[v].section == "output" for v in vrs):
            self.told(part._refresh)
        return [part._at(layout[v]) for v in vrs]

    def write(self, vrs, values):
        part, layout = self.part, self.part.layout
        for v, x in zip(vrs, values):
            if part._running and layout[v].section == "parameter":
                self.log(f"{{part.instance}}: {{layout[v].name}}: a parameter is fixed once initialization "
                         "has ended: reset first", Fmi2Status.error)
                raise ValueError(layout[v].name)
            part._put(layout[v], x)

    get_real = read
    set_real = set_integer = set_boolean = write

    def get_integer(self, vrs):
        return [round(x) for x in self.read(vrs)]

    def get_boolean(self, vrs):
        return [x != 0.0 for x in self.read(vrs)]

    def reset(self):
        self.part.reset()

    def _get_fmu_state(self):
        return self.part.get_state()

    def _set_fmu_state(self, state):
        self.part.set_state(state)
'''


def renamed(text: str, unique: str) -> str:
    """Imports of gyrobench become imports of the FMU's own runtime package."""
    text = re.sub(r"^from gyrobench import", f"from {unique} import", text, flags=re.M)
    return re.sub(r"^(from|import) gyrobench\.", rf"\1 {unique}.", text, flags=re.M)


def resources(cls: type[Component], guid: str) -> tuple[str, dict[str, str]]:
    """(module name, files under resources/).  Raises ValueError if the model imports what it cannot carry."""
    unique = f"gb_{cls.__name__.lower()}_{guid.replace('-', '')[:12]}"
    model = Path(inspect.getfile(cls)).read_text(encoding="utf-8")
    for module in re.findall(r"^(?:from|import) gyrobench\.([\w.]+)", model, flags=re.M):
        if module not in RUNTIME:
            raise ValueError(
                f"{inspect.getfile(cls)} imports gyrobench.{module}: a part uses gyrobench.component and "
                "gyrobench.math only, so that its Python FMU can carry them"
            )
    runtime = {n: (PACKAGE / f"{n}.py").read_text(encoding="utf-8") for n in RUNTIME}
    files = {f"{unique}/{n}.py": renamed(t, unique) for n, t in {**runtime, "model": model}.items()}
    files[f"{unique}/__init__.py"] = ""
    module = f"{unique}_slave"
    files[f"{module}.py"] = SLAVE.format(cls=cls.__name__, version=cls.version, unique=unique)
    return module, files
