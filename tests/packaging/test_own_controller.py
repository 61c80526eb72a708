"""Controllers in a file of the user's own: the same law in C, in Python and as stock part; its FMU; every mistake."""

from __future__ import annotations

import re
import subprocess
import zipfile
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gyrobench.commands.cli import app
from gyrobench.component import ComponentError
from gyrobench.engine.session import Session
from gyrobench.errors import GyrobenchError
from gyrobench.linear.crossovers import crossovers
from gyrobench.linear.sampled_model import sampled_step
from gyrobench.packaging import build, load_part
from gyrobench.packaging.compiler import system_compiler
from gyrobench.packaging.instance import Fmu, InstanceError, Plain
from gyrobench.packaging.own_controller import allow
from gyrobench.packaging.own_controller.c_law import SIGNATURE
from gyrobench.packaging.validate import validate
from gyrobench.system.binding import SocketMismatchError
from gyrobench.system.configurable import InvalidConfigurationError

H = 5e-4  # s, communication step
DECLARED = """\
 @input     u             [V]      gyro signal
 @input     test          [V]      test signal
 @output    v             [V]      voltage of the torque motor
 @output    e             [V]      signal inside the loop
 @output    saturated     [1]      1 while v is limited
 @parameter K = 20        [1]      gain
 @parameter corner = 12.5 [1/s]    corner of the integral part
 @parameter v_max = 27    [V]      largest voltage
 @state     sum           [V]      integral part
"""
C = f"""/*
{DECLARED}*/
{SIGNATURE}
{{
    const double K = parameter[0], corner = parameter[1], v_max = parameter[2];
    const double e = input[0] + input[1];
    const double y = state[0] + K * e;
    const double limited = y > v_max ? v_max : y < -v_max ? -v_max : y;
    state[0] = state[0] + K * corner * dt * e;
    output[0] = -limited;
    output[1] = e;
    output[2] = limited != y;
}}
"""
PYTHON = f'''class Pi:
    """
{DECLARED}    """

    def step(self, inputs, dt):
        e = inputs.u + inputs.test
        y = self.sum + self.K * e
        limited = min(max(y, -self.v_max), self.v_max)
        self.sum = self.sum + self.K * self.corner * dt * e
        return {{"v": -limited, "e": e, "saturated": limited != y}}
'''
#: one output, one state, one parameter, for the mistakes
SMALL = " @input u [V] a\n @output v [V] b\n @output w[2] [V] c\n @state x = 1 [V] d\n @parameter K = 2 [1] e\n"


def named(folder: Path, name: str, text: str) -> str:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    allow(file)
    return str(file)


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    folder = tmp_path_factory.mktemp("own")
    return {"c": named(folder, "pi.c", C), "python": named(folder, "pi.py", PYTHON)}


def played(part: Plain | Fmu, signal: np.ndarray) -> list[list[float]]:
    rows = []
    for k, x in enumerate(signal):
        part.set({"u": float(x)})
        part.step(k * H, H)
        rows.append(part.get(["v", "e", "saturated"]))
    return rows


def started(file: str, **parameters: float) -> Plain:
    part = Plain(load_part(file), "slot")
    if parameters:
        part.set(parameters)
    part.initialize()
    return part


def test_a_pi_in_c_and_in_python_is_the_stock_part_bit_for_bit(files: dict[str, str]) -> None:
    """Against stabilizer_lti with x+ = x + K corner h r, y = x + K r; random inputs, some beyond the limit of 27 V."""
    signal = np.random.default_rng(1).normal(0.0, 0.7, 300)
    stock = Plain(load_part("stabilizer_lti"), "stock")
    stock.set({"Ts": H, "n": 1, "D": 20.0, "A[1,1]": 1.0, "B[1]": 20.0 * 12.5 * H, "C[1]": 1.0})
    stock.initialize()
    found = [played(part, signal) for part in (stock, started(files["c"]), started(files["python"]))]
    assert found[0] == found[1] == found[2]
    assert 10 < sum(row[2] for row in found[0]) < 290
    slow = started(files["c"], Ts=3.0 * H)
    rows = played(slow, signal[:7])
    assert rows[0] == rows[1] == [0.0, 0.0, 0.0]  # the first sample is at 3 H, the next at 6 H
    assert rows[2] == rows[3] == rows[4] and rows[5] == rows[6] and rows[2][1] == signal[2] and rows[5][1] == signal[5]
    gain = 20.0 * 12.5 * (3.0 * H)
    assert slow.get(["sum"]) == [gain * signal[2] + gain * signal[5]]


def test_its_linear_model_is_that_of_its_equations(files: dict[str, str]) -> None:
    for file in files.values():
        part = load_part(file)("pi")
        part.initialize()
        step = sampled_step(part, ["u"], ["v"], H)
        assert step is not None
        z = np.exp(2j * np.pi * 10.0 * H)  # y = C x+ + D u, x+ = A x + B u
        x = np.linalg.solve(z * np.eye(len(step.a)) - step.a, step.b)
        response = complex((step.c @ x * z + step.d)[0, 0])
        assert response == pytest.approx(-(20.0 + 0.125 / (z - 1.0)), rel=1e-6)


@pytest.mark.parametrize("kind, fmi", [("c", 2), ("c", 3), ("python", 2)])
def test_its_fmu_is_valid_and_does_the_same(files: dict[str, str], tmp_path: Path, kind: str, fmi: int) -> None:
    path = build(files[kind], fmi=fmi, out=tmp_path)
    assert validate(path) == []
    signal = np.random.default_rng(2).normal(0.0, 0.7, 30)
    fmu = Fmu(path)
    try:
        fmu.initialize()
        expected = played(started(files["c"]), signal)
        assert played(fmu, signal[:20]) == expected[:20]
        kept = fmu.save(fmu.get_state())
        fmu.set_state(fmu.load(kept))
        for k in range(20, 30):
            fmu.set({"u": float(signal[k])})
            fmu.step(k * H, H)
            assert fmu.get(["v", "e", "saturated"]) == expected[k]
    finally:
        fmu.free()


def test_the_sources_of_its_fmu_compile_as_the_description_says(files: dict[str, str], tmp_path: Path) -> None:
    compiler = system_compiler()
    if compiler is None:
        pytest.skip("no C compiler")
    with zipfile.ZipFile(build(files["c"], out=tmp_path)) as archive:
        archive.extractall(tmp_path / "fmu")
    description = (tmp_path / "fmu" / "modelDescription.xml").read_text(encoding="utf-8")
    units = re.findall(r'<File name="([^"]+)"', description)
    assert units == ["fmi2.c", "controller.c"]
    sources = tmp_path / "fmu" / "sources"
    command = [*compiler, "-std=c11", "-O0", "-shared", "-fPIC", "-Wl,--no-undefined", *units, "-o", "x.so", "-lm"]
    assert subprocess.run(command, cwd=sources, capture_output=True, text=True, check=False).stderr == ""


FUNCTION = f"/*\n{SMALL}*/\n{SIGNATURE}\n"  # its head is line 8
MISTAKES_IN_C = {
    "double x;": "no output is declared; write a line for each in a comment: @output v",
    "// @inptu u [V] x\n": ":1: @inptu: did you mean @input?",
    "// @input u gyro signal\n": ":1: @input u: its unit is missing; write @input u [V]",
    "// @input u [mV] gyro signal\n": ":1: @input u: [mV] is not SI; a controller computes in SI: write [V]",
    "// @input u [furlong] gyro signal\n": ":1: @input u: unit 'furlong'",
    "\n// @output step [V] x\n": ":2: @output step: the name is taken",
    "// @output v [V] x\n// @output v [V] x\n": ":2: @output v: declared twice",
    "// @output v[0] [V] x\n": "an array has one element or more",
    "// @output v = 3 [V] x\n": "only parameters and states have a start",
    "// @parameter K [1] x\n": "its value is missing",
    "// @parameter K = two [1] x\n": "K = two: not a number in SI",
    "// @parameter K = inf [1] x\n": "must be finite",
    "// @state x[3] = [1, 2] [1] x\n": "2 numbers for 3",
    "// @output v[300] [V] x\n": "300 numbers in @output; 200 are allowed",
    f"{FUNCTION}{{\n    output[0] = input[0]\n}}\n": ":10:",
    f"/*\n{SMALL}*/\nvoid step(double x) {{ }}\n": "write void step(const double *input",
    f"/*\n{SMALL}*/\nvoid stepp(double x) {{ }}\n": "there is no function step; write void step(",
    f"{FUNCTION}{{ double f(double); output[0] = f(1.0); }}": "f() is called, and there is no such function",
    f"{FUNCTION}{{ static double k; output[0] = k += 1.0; }}": "gives different outputs for the same inputs and state",
    f"{FUNCTION}{{ *(volatile double *)0 = 1.0; }}": "step() crashes (status -11)",
    f'#include "own.h"\n{FUNCTION}{{ }}': ':1: #include "own.h": a controller is one file',
}
MISTAKES_WHILE_IT_RUNS = {  # of C: the same words in this process and in the FMU
    "output[0] = 1.0;": "step() does not set output[1], w[1]",
    "output[0] = output[1] = output[2] = output[3] = 0.0;": "step() writes beyond output[2]: 3 declared",
    "output[0] = output[1] = output[2] = state[1] = 0.0;": "step() writes beyond state[0]: 1 declared",
    "output[0] = output[1] = 0.0; output[2] = 1.0 / (dt - dt);": "step() leaves output[2], w[2], = inf",
    "output[0] = output[1] = output[2] = 0.0; state[0] = (dt - dt) / 0.0;": "step() leaves state[0], x, = nan",
}
STEP = "    def step(self, inputs, dt):\n        "
MISTAKES_IN_PYTHON = {
    "    def go(self):\n        return 1\n": "0 classes with a method step(self, inputs, dt); one is expected",
    "    def step(self, u):\n        return 1\n": ":9: write step(self, inputs, dt)",
    f"{STEP}return 1 2\n": ":10: invalid syntax",
    f"{STEP}return inputs.uu, [1, 2]\n": ":10: AttributeError: no input 'uu' is declared; did you mean u?",
    f"{STEP}return 1 / 0\n": ":10: ZeroDivisionError",
    f"{STEP}pass\n": "step() returns nothing for 2; declared are: v, w",
    f"{STEP}return 1, [1, 2], 3\n": "step() returns 3 values for 2; declared are: v, w",
    f"{STEP}return 1, [1, 2, 3]\n": "step() returns 3 numbers for w[2]",
    f"{STEP}return 1, 'no'\n": "step() returns w = 'no': 2 numbers expected",
    f"{STEP}return {{'v': 1, 'ww': 2}}\n": "step() returns 'ww'; did you mean w?",
    f"{STEP}return {{'v': 1}}\n": "step() does not return w",
    f"{STEP}return 1, [1, float('nan')]\n": "step() returns w[2] = nan",
    f"{STEP}self.old = dt * inputs.u\n        return 1, [1, 2]\n": "changes self.old, which is not declared",
    f"    past = []\n{STEP}self.past.append(1)\n        return len(self.past), [1, 2]\n": "gives different outputs",
    f"    def __init__(self):\n        self.past = []\n{STEP}self.past.append(1)\n        return 1, [1, 2]\n":
        "step() changes self.past, which is not declared; write its line: @state past",
}  # fmt: skip


@pytest.mark.parametrize("text", MISTAKES_IN_C)
def test_a_mistake_in_c_is_named_with_its_line(text: str, tmp_path: Path) -> None:
    with pytest.raises(GyrobenchError) as error:
        load_part(named(tmp_path, "my.c", text))
    assert "my.c" in str(error.value) and MISTAKES_IN_C[text] in str(error.value), error.value
    assert "controller" not in str(error.value).replace("a controller is", "").replace("a controller comp", "")


@pytest.mark.parametrize("text", MISTAKES_IN_PYTHON)
def test_a_mistake_in_python_is_named_with_its_line(text: str, tmp_path: Path) -> None:
    with pytest.raises(GyrobenchError) as error:
        load_part(named(tmp_path, "my.py", f'class My:\n    """\n{SMALL}    """\n{text}'))
    assert "my.py" in str(error.value) and MISTAKES_IN_PYTHON[text] in str(error.value), error.value


def test_a_law_that_misbehaves_is_refused_in_the_words_of_its_file(tmp_path: Path) -> None:
    for k, (body, words) in enumerate(MISTAKES_WHILE_IT_RUNS.items()):
        file = named(tmp_path, f"my{k}.c", f"{FUNCTION}{{ {body} }}\n")
        with pytest.raises((ComponentError, InstanceError), match=re.escape(f"my{k}.c: {words}")):
            started(file).step(0.0, H)
        if k % 2:
            continue
        fmu = Fmu(build(file, out=tmp_path), "slot")
        fmu.initialize()
        with pytest.raises(InstanceError, match=re.escape(f"slot: my{k}.c: {words}")):
            fmu.step(0.0, H)
        fmu.free()


def test_only_what_the_user_names_is_compiled(tmp_path: Path) -> None:
    """The parts of a campaign, of a request in the browser, of a stored run do not come by the command line."""
    file = tmp_path / "evil.c"
    file.write_text(f"/*\n @output v [V] x\n*/\n{SIGNATURE} {{ output[0] = 0.0; }}\n")
    with pytest.raises(GyrobenchError, match="compiled only where you name it yourself"):
        load_part(str(file))
    script = tmp_path / "evil.py"
    script.write_text("raise SystemExit('executed')\n")
    with pytest.raises(GyrobenchError, match="compiled only where you name it yourself"):
        load_part(str(script))


@pytest.mark.long
def test_in_a_system_it_keeps_its_values_and_its_inputs_are_those_of_the_slot(
    files: dict[str, str], tmp_path: Path
) -> None:
    """The design of the system sets K of its own part to hundreds; the loop crosses by the K of the file."""
    with Session("platform_single_axis", {"stabilizer": files["c"]}) as session:
        document = session.prepare()[2]
        assert document.parameters["stabilizer.K"] == 20.0
        assert session.prepare({"stabilizer.K": 15.0})[2].parameters["stabilizer.K"] == 15.0
        assert document.linear is not None and document.linear.loops["stabilizer"].discrete is not None
        ((f, margin),) = crossovers(document.linear.loops["stabilizer"].discrete, 10.0)
        assert f == pytest.approx(9.70, abs=0.04) and margin == pytest.approx(65.1, abs=1.0)  # measured: 9.70, 65.1
        assert "compiled apart" in session._obstacle()
    misprinted = named(tmp_path, "my.c", C.replace("@input     test ", "@input     tset "))
    with pytest.raises(InvalidConfigurationError, match=r"input tset, which nothing .* gives; did you mean test"):
        Session("platform_single_axis", {"stabilizer": misprinted})
    lacking = named(tmp_path, "less.c", C.replace("@output    e ", "@output    ee "))
    with pytest.raises(SocketMismatchError, match=r"e: missing \(output, V: the signal inside the loop"):
        Session("platform_single_axis", {"stabilizer": lacking})
    words = ["sweep", "platform_single_axis", "--part", f"stabilizer={files['c']}", "--over", "crossover=8,9 Hz"]
    refused = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "sweep")])
    assert refused.exit_code != 0 and "workers compile no files: gyrobench build" in str(refused.exception)
