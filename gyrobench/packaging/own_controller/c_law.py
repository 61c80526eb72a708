"""A controller in C: one function, checked, compiled for this process, and called from the C of its part.

void step(const double *input, double *output, double *state, const double *parameter, double dt);
"""

from __future__ import annotations

import ctypes
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from gyrobench.bench import display_path
from gyrobench.component.composition import ComponentError
from gyrobench.packaging import compiler
from gyrobench.packaging.own_controller.declared_ports import Declarations
from gyrobench.user_code import UserCodeError

SIGNATURE = "void step(const double *input, double *output, double *state, const double *parameter, double dt)"
NAME = "controller_step"  # what step is called in the library of an FMU
UNIT = "controller.c"  # its file there
#: names that the FMU's own files give to functions which its units share: see instance.h
SHARED = (
    "new_instance", "reset", "tell", "wrong", "missing", "unsettable", "tune_values", "freshen", "run", "derivative",
    "get_state", "set_state", "save", "load", "model", "guid",
)  # fmt: skip
GUARDS = 4  # numbers behind the outputs and behind the states that must stay as they are
GUARD = 0x7FF8_6779_726F_0C01  # a NaN that no arithmetic makes: in outputs before the call, and in the guards
TRIED = (0.01, -0.3, 0.7, 0.01)  # values of the inputs in the trial: the last answer must be the first
SLOWEST = 10.0  # s for the calls of the trial


def c_unit(text: str, file: str) -> str:
    """Return the C file that is compiled: the user's, behind the names that keep it apart from the FMU's own."""
    renamed = "\n".join(f"#define {n} own_{n}" for n in SHARED)
    head = (
        "#ifdef CONTROLLER_ALONE\n#ifdef _WIN32\n__declspec(dllexport)\n#else\n"
        '__attribute__((visibility("default")))\n#endif\n'
        f"#else\n#define step {NAME}\n{renamed}\n#endif\n"
    )
    return f'{head}{SIGNATURE};\n#line 1 "{file}"\n{text}'


def check_text(text: str, path: Path) -> None:
    """Refuse what a single file of C must not have.  Raises UserCodeError."""
    for number, line in enumerate(text.splitlines(), 1):
        if m := re.match(r'\s*#\s*include\s*"([^"]*)"', line):
            raise UserCodeError(
                f'{display_path(path)}:{number}: #include "{m[1]}": a controller is one file; it includes headers of '
                "the C library alone (<math.h>), so that its FMU can carry it"
            )


def compile_alone(text: str, path: Path, declared: Declarations, library: Path) -> None:
    """Compile the function for this process, and try it in another one.  Raises UserCodeError, CompilerError."""
    shown = display_path(path)
    if compiler.command(compiler.this_platform()) is None:
        raise UserCodeError(
            f"{shown}: a controller in C takes a C compiler: install cc, gcc or clang, or `pip install "
            "gyrobench[cross]`"
        )
    with tempfile.TemporaryDirectory(dir=library.parent) as folder:
        source = Path(folder) / UNIT
        source.write_text("#define CONTROLLER_ALONE\n" + c_unit(text, path.name), encoding="utf-8")
        made = Path(folder) / library.name
        try:
            compiler.compile_library(source, made, (), compiler.this_platform())
        except compiler.CompilerError as error:
            raise UserCodeError(f"{shown}: the C compiler refuses it:\n{_told(str(error), path, shown)}") from None
        _try(made, shown, declared)
        made.replace(library)


def _told(message: str, path: Path, shown: str) -> str:
    """Return what the compiler says of the user's file: without the lines about what the bench puts before it."""
    lines: list[str] = []
    foreign = False
    for line in message.splitlines()[1:]:
        foreign = (foreign and line.startswith(" ")) or f"{UNIT}:" in line
        if not foreign:
            lines.append(f"{shown}{line.removeprefix(path.name)}" if line.startswith(f"{path.name}:") else line)
    if "conflicting types for" in message:
        lines.append(f"write {SIGNATURE}")
    return "\n".join(lines)


TRIAL = """
import ctypes, json, sys
library, name, inputs, outputs, start, parameters, tried = json.loads(sys.argv[1])
step = getattr(ctypes.CDLL(library), name)
def call(u):
    x = (ctypes.c_double * (len(start) + 4))(*start)
    y = (ctypes.c_double * (outputs + 4))()
    step((ctypes.c_double * (inputs + 1))(*[u] * inputs), y, x,
         (ctypes.c_double * (len(parameters) + 1))(*parameters), ctypes.c_double(1e-3))
    return bytes(y)[:8 * outputs] + bytes(x)[:8 * len(start)]
first, *_, again = map(call, tried)
sys.exit(0 if again == first else 9)
"""


def _try(library: Path, shown: str, declared: Declarations) -> None:
    """Call it in a process of its own: it must end, and give the same for the same.  Raises UserCodeError."""
    start, parameters = ([x for d in declared.of(k) for x in d.start] for k in ("state", "parameter"))
    numbers = [len(declared.shown("input")), len(declared.shown("output")), start, parameters]
    command = [sys.executable, "-I", "-c", TRIAL, json.dumps([str(library), "step", *numbers, TRIED])]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=SLOWEST, check=False)
    except subprocess.TimeoutExpired:
        raise UserCodeError(f"{shown}: step() still runs after {SLOWEST:g} s: a loop without an end?") from None
    if done.returncode == 0:
        return
    if done.returncode == 9:
        raise UserCodeError(
            f"{shown}: step() gives different outputs for the same inputs and state: it keeps something in a static or "
            "global variable; declare it as @state and keep it in state[]"
        )
    if "undefined symbol: step" in done.stderr or "not found" in done.stderr:
        raise UserCodeError(f"{shown}: there is no function step; write {SIGNATURE}")
    if undefined := re.search(r"undefined symbol: (\w+)", done.stderr):
        raise UserCodeError(f"{shown}: {undefined[1]}() is called, and there is no such function")
    counts = ", ".join(f"{k}: {len(declared.shown(k))}" for k in ("input", "output", "state", "parameter"))
    raise UserCodeError(
        f"{shown}: step() crashes (status {done.returncode}); does it go beyond its arrays? declared numbers: {counts}"
    )


class CLaw:
    """One sample of the controller, by the library of this process: as PythonLaw of gyrobench.component."""

    def __init__(self, library: Path, file: str, declared: Declarations) -> None:
        self.file = file
        self.outputs, self.states = declared.shown("output"), declared.shown("state")
        self.step = ctypes.CDLL(str(library)).step
        self.step.restype = None

    def __call__(self, inputs: Any, state: Any, parameters: Any, dt: float) -> list[float]:
        ny, nx = len(self.outputs), len(self.states)
        guard = ctypes.c_double.from_buffer_copy(GUARD.to_bytes(8, sys.byteorder))
        y, x = _guarded(guard, ny), _guarded(guard, nx)
        x[:nx] = [float(v) for v in state][:nx]
        given = ((ctypes.c_double * len(v))(*map(float, v)) for v in (inputs, parameters))
        u, p = given
        self.step(u, y, x, p, ctypes.c_double(dt))
        same = bytes(guard)
        for what, box, n in (("output", y, ny), ("state", x, nx)):
            if bytes(box)[8 * n :] != same * GUARDS:
                raise ComponentError(f"{self.file}: step() writes beyond {what}[{n - 1}]: {n} declared")
        for k, name in enumerate(self.outputs):
            if bytes(y)[8 * k : 8 * k + 8] == same:
                raise ComponentError(f"{self.file}: step() does not set output[{k}], {name}")
        for what, box, names in (("output", y, self.outputs), ("state", x, self.states)):
            for k, name in enumerate(names):
                if box[k] * 0.0 != 0.0:
                    raise ComponentError(f"{self.file}: step() leaves {what}[{k}], {name}, = {box[k]:g}")
        return [*y[:ny], *x[:nx]]


def _guarded(guard: ctypes.c_double, n: int) -> Any:
    return (ctypes.c_double * (n + GUARDS)).from_buffer_copy(bytes(guard) * (n + GUARDS))


GLUE = """\
/* {file} stands in {unit}; what it writes is checked here. */
void {step}(const double *input, double *output, double *state, const double *parameter, double dt);

static inline void law_(Part *part, double inputs[{nu}], double state[{nx1}], double parameters[{np}], double dt,
                        double out_[{n}]) {{
    static const char *const named[] = {{{names}}};
    static const uint64_t guard = UINT64_C({guard:#x});
    double y[{ny} + {guards}], x[{nx} + {guards}];
    int i;
    for (i = 0; i < {ny} + {guards}; i++) memcpy(&y[i], &guard, sizeof guard);
    for (i = 0; i < {nx} + {guards}; i++) memcpy(&x[i], &guard, sizeof guard);
    for (i = 0; i < {nx}; i++) x[i] = state[i];
    {step}(inputs, y, x, parameters, dt);
    for (i = 0; i < {guards}; i++) {{
        if (memcmp(&y[{ny} + i], &guard, sizeof guard) != 0)
            fail(part, "{file}: step() writes beyond output[{ylast}]: {ny} declared (t = %.9g s)", part->n.v.t);
        if (memcmp(&x[{nx} + i], &guard, sizeof guard) != 0)
            fail(part, "{file}: step() writes beyond state[{xlast}]: {nx} declared (t = %.9g s)", part->n.v.t);
    }}
    for (i = 0; i < {ny}; i++) {{
        if (memcmp(&y[i], &guard, sizeof guard) == 0)
            fail(part, "{file}: step() does not set output[%d], %s (t = %.9g s)", i, named[i], part->n.v.t);
        out_[i] = y[i];
    }}
    for (i = 0; i < {nx}; i++) out_[{ny} + i] = x[i];
    for (i = 0; i < {n}; i++)
        if (!isfinite(out_[i]))
            fail(part, "{file}: step() leaves %s[%d], %s, = %g (t = %.9g s)", i < {ny} ? "output" : "state",
                 i < {ny} ? i : i - {ny}, named[i], plain(out_[i]), part->n.v.t);
    if (part->failed) memset(out_, 0, {n} * sizeof *out_);
}}"""


def glue(file: str, declared: Declarations) -> str:
    """Return the C function of the part that calls the user's, and refuses what it must not do."""
    ny, nx = len(declared.shown("output")), len(declared.shown("state"))
    return GLUE.format(
        file=file, unit=UNIT, step=NAME, guard=GUARD, guards=GUARDS, ny=ny, nx=nx, n=ny + nx, ylast=ny - 1,
        xlast=nx - 1, nu=max(1, len(declared.shown("input"))), nx1=max(1, nx),
        np=max(1, len(declared.shown("parameter"))),
        names=", ".join(f'"{name}"' for k in ("output", "state") for name in declared.shown(k)),
    )  # fmt: skip
