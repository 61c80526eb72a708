"""Foreign FMUs that cannot run here, or not as they are: said in words before the run."""

from __future__ import annotations

import json
import math
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import pytest
from archives import LAG, write_archive
from commanding import Command
from fmpy import platform, platform_tuple

from gyrobench.engine.session import Session, run
from gyrobench.packaging.validate import validate
from gyrobench.system.binding import SocketMismatchError
from gyrobench.system.system import InvalidConfigurationError, Slot, System, load_system
from gyrobench.system.wiring import WiringError
from gyrobench.workflow.fit_mapping import write_mapping

Foreign = Callable[..., Path]
Change = Callable[..., Path]
FOREIGN = Path(__file__).parents[1] / "foreign"
MAPS = {"gyro": FOREIGN / "vendor_gyro.toml"}
MAPS3 = {"gyro": FOREIGN / "vendor_gyro3.toml"}
SHORT = {"dwell": 0.2, "turns": 0.01, "table.index_rate": 2.0}


@pytest.fixture
def change(foreign: Foreign, tmp_path: Path) -> Change:
    """Return an FMU of tests/foreign with texts of its description, and names of its files, replaced."""

    def changed(
        name: str, *texts: tuple[str, str], files: tuple[str, str] = ("", ""), more: tuple[str, ...] = ()
    ) -> Path:
        path = tmp_path / f"{name}.fmu"
        with zipfile.ZipFile(foreign(name)) as old, zipfile.ZipFile(path, "w") as new:
            for entry in old.namelist():
                data = old.read(entry)
                if entry == "modelDescription.xml":
                    text = data.decode()
                    for a, b in texts:
                        assert a in text
                        text = text.replace(a, b)
                    data = text.encode()
                if kept := entry.replace(*files) if files[0] else entry:
                    new.writestr(kept, data)
            for entry in more:
                new.writestr(entry, "")
        return path

    return changed


def refused(system: System, part: Path, maps: dict[str, Path] = MAPS, step: float | None = None) -> str:
    """Return why a run with this gyro is refused; nothing of it is loaded."""
    with pytest.raises((InvalidConfigurationError, WiringError, SocketMismatchError)) as caught:
        run(system, {"gyro": part}, maps, SHORT, step=step)
    return str(caught.value)


def told(system: System, part: Path, maps: dict[str, Path] = MAPS) -> list[str]:
    """Return what is said of this gyro before the run."""
    with Session(system, {"gyro": part}, maps) as session:
        return [n for n in session.prepare(SHORT)[2].notes if n.startswith("gyro: ") and "SHA-256" not in n]


@pytest.mark.long
def test_a_fixed_internal_step(small: System, change: Change, command: Command) -> None:
    """1 ms is no multiple of 0.4 ms: it would run at steps of its own, silently at another time."""
    kind = '<CoSimulation modelIdentifier="vendor_gyro3"'
    part = change("vendor_gyro3", (kind, f'{kind} fixedInternalStepSize="4e-4"'))
    assert refused(small, part, MAPS3).endswith(
        "gyro: vendor_gyro3.fmu works at fixed steps of 0.0004 s (fixedInternalStepSize), of which the communication "
        "step of 0.001 s is no multiple; give --step 0.0008 or 0.0012"
    )
    assert "give --step 0.0004 or 0.0008" in refused(small, part, MAPS3, step=1e-4)
    assert run(small, {"gyro": part}, MAPS3, SHORT, step=8e-4).complete
    words = ("fixed_position", "--part", f"gyro={part}", "--map", f"gyro={MAPS3['gyro']}")
    code, _, err = command("run", *words)
    assert code == 2 and "is no multiple; give --step" in err
    code, out, _ = command("show", *words, "--json")
    assert code == 0 and any("a run is refused: gyro: vendor_gyro3.fmu works at" in n for n in json.loads(out)["notes"])


def test_half_of_a_fixed_internal_step(change: Change, tmp_path: Path, command: Command) -> None:
    """The step check cannot run; the record stays and says so."""
    kind = '<CoSimulation modelIdentifier="vendor_gyro3"'
    part = change("vendor_gyro3", (kind, f'{kind} fixedInternalStepSize="1e-3"'))
    component = LAG.format("g", "").replace("lag.fmu", "gyro.fmu")
    link = '<ssd:Connection startElement="g" startConnector="V_PICKOFF" endElement="g" endConnector="I_TORQUE"/>'
    path = write_archive(tmp_path / "x.ssp", {"resources/gyro.fmu": part}, component, link)
    words = ("run", path, "--step", "1ms", "--coupling", "parallel", "--out", tmp_path / "run")
    code, _, err = command(*words, default_check=True)
    assert code == 0, err
    said = "The effect of the communication step is not known: step check: x refuses to run: g: gyro.fmu works "
    assert said in err
    assert any(n.startswith(said) for n in json.loads((tmp_path / "run" / "run.json").read_text())["notes"])
    assert command(*words, "--check-step", "--force")[0] == 3


def test_an_execution_tool(small: System, change: Change) -> None:
    kind = '<CoSimulation modelIdentifier="vendor_gyro"'
    part = change("vendor_gyro", (kind, f'{kind} needsExecutionTool="true"'), ('guid="', 'generationTool="RIG" guid="'))
    said = "gyro: vendor_gyro.fmu needs a program on this machine (needsExecutionTool): RIG"
    assert said in told(small, part)


def test_binaries_of_other_platforms(small: System, change: Change) -> None:
    own = f"binaries/{platform}/"
    other = change("vendor_gyro", files=(own, "binaries/vxworks/"))
    assert refused(small, other).endswith(f"vendor_gyro.fmu: it has no binary for {platform}; there are vxworks")
    sources = change("vendor_gyro", files=(f"{own}vendor_gyro.so", ""), more=("sources/all.c",))
    assert refused(small, sources).endswith(
        f"it has no binary for {platform}; there are none; it has its sources: fmpy compile"
    )
    three = change("vendor_gyro3", files=(f"binaries/{platform_tuple}/", "binaries/riscv64-linux/"))
    assert f"it has no binary for {platform_tuple}; there are riscv64-linux" in refused(small, three, MAPS3)


def test_a_library_of_another_name(small: System, change: Change) -> None:
    part = change("vendor_gyro", files=("vendor_gyro.so", "RIG7.so"))
    assert refused(small, part).endswith(
        f"its library for {platform} is RIG7.so; by its modelIdentifier it would be vendor_gyro.so"
    )


class Two(System):
    title = "two lags"
    slots: ClassVar = {n: Slot("Rebalance", "lag") for n in "ab"}
    open: ClassVar = ("a.u", "b.u")
    stop = 0.1


def test_once_per_process(change: Change, tmp_path: Path) -> None:
    kind = '<CoSimulation modelIdentifier="lag"'
    part = change("lag", (kind, f'{kind} canBeInstantiatedOnlyOncePerProcess="true"'))
    (tmp_path / "m.toml").write_text('[i]\nname = "y"\n[i_read]\nname = "y"\n')
    maps = dict.fromkeys("ab", tmp_path / "m.toml")
    with pytest.raises(InvalidConfigurationError, match=r"a, b: lag\.fmu can be instantiated once per process only"):
        run(Two(), dict.fromkeys("ab", part), maps)


def test_one_communication_step(small: System, change: Change) -> None:
    texts = ('canHandleVariableCommunicationStepSize="true"', 'canHandleVariableCommunicationStepSize="false"')
    part = change("vendor_gyro", texts, ("<ModelVariables>", '<DefaultExperiment stepSize="2e-3"/><ModelVariables>'))
    said = "vendor_gyro.fmu is made for one communication step, 0.002 s by its default experiment; this run has 0.001 s"
    assert f"gyro: {said}" in told(small, part)
    same = change("vendor_gyro", texts, ("<ModelVariables>", '<DefaultExperiment stepSize="1e-3"/><ModelVariables>'))
    assert not any("made for" in n for n in told(small, same))


def test_inputs_of_types_that_nothing_feeds(small: System, change: Change) -> None:
    blob = '<Binary name="image" valueReference="900" causality="input"><Start value="00"/></Binary></ModelVariables>'
    part = change("vendor_gyro3", ("</ModelVariables>", blob))
    assert "gyro: inputs of types that are not connected, at their start: image" in told(small, part, MAPS3)


def test_other_interfaces(small: System, change: Change) -> None:
    exchange = ("CoSimulation modelIdentifier", "ModelExchange modelIdentifier")
    no_variable = (' canHandleVariableCommunicationStepSize="true"', "")
    part = change("vendor_gyro", exchange, no_variable)
    assert "has no co-simulation interface; the engines run FMI 2.0 and 3.0 co-simulation" in refused(small, part)


def test_units(small: System, change: Change) -> None:
    """A unit of the FMU's own is one where its BaseUnit is there; else the mapping has to say what it is."""
    assert validate(change("vendor_gyro")) == []  # deg/h as "dph"
    bare = change("vendor_gyro", ('<BaseUnit rad="1" s="-1" factor="4.84813681109535993590e-6"/>', ""))
    (problem,) = validate(bare)
    assert "W_IA: unit 'dph': unknown symbol 'dph'" in problem
    said = refused(small, bare)
    assert "omega[1]: unit 'dph' of W_IA is not known and has no BaseUnit; give unit = " in said


def test_fit_proposes_the_only_output_and_the_parameters(change: Change, tmp_path: Path, command: Command) -> None:
    """One output, whose name says nothing; of the parameters k, which the test reads, and a bias by its unit."""
    part = change("vendor_gyro", ("V_PICKOFF", "OUT7"))
    code, text, err = command("fit", part, "--slot", "servo_polar.gyro")
    assert code == 0 and err == ""
    assert '[u]                       # pickoff voltage\nname = "OUT7"\n' in text
    parameters = text.partition("[parameters]\n")[2].splitlines()
    assert parameters[0].startswith('K_sg = { name = "SENS", unit = "V/rad" }  # pickoff gain')
    assert any(x.startswith('D_F = { name = "BIAS" }  # ') and "in dph, as the FMU declares" in x for x in parameters)
    (left,) = [x for x in parameters if x.startswith("# H = ")]
    assert left.startswith('# H = { value = 0.2, unit = "N.m.s" }  # spin angular momentum: the test needs it')
    whole = tmp_path / "whole.toml"  # with the values of the bench's part for what the FMU has not
    whole.write_text(re.sub(r"^# (\w+ = \{)", r"\1", text, flags=re.M))
    with Session(load_system("servo_polar"), {"gyro": part}, {"gyro": whole}) as session:
        values = session.prepare()[2].parameters
    assert (values["gyro.H"], values["gyro.k"], values["gyro.K_sg"]) == (0.2, 20.0, 1e4)


@pytest.mark.parametrize("name", ["D_I", "DI"])
def test_fit_proposes_nothing_per_acceleration(change: Change, name: str) -> None:
    """In deg/h/g: D_I by its own name, no other coefficient, whose power of g0 its unit does not tell."""
    factor = math.radians(1.0) / 3600.0 / 9.80665
    g = f'<Unit name="dphg"><BaseUnit rad="1" s="1" m="-1" factor="{factor!r}"/></Unit></UnitDefinitions>'
    plain = 'name="MU_I" valueReference="13" causality="parameter" variability="fixed"><Real start="0"'
    named = plain.replace("MU_I", name).replace('start="0"', 'unit="dphg" start="2"')
    part = change("vendor_gyro", ("</UnitDefinitions>", g), (plain, named))
    text, _ = write_mapping(part, "fixed_position.gyro", None)
    assert 'D_F = { name = "BIAS" }' in text and f'"{name}"' not in text


def test_fit_takes_no_angle_for_a_ratio(foreign: Foreign) -> None:
    text, _ = write_mapping(foreign("vendor_platform"), "platform_single_axis.platform", None)
    assert "START_ROLL" not in text and "# k_t = { value = 1.0" in text
