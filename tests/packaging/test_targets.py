"""For every part: plain class, native FMU and Python FMU are one thing."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import pytest
from toybench import TOYS

from gyrobench.bench import Bench, standard_folder
from gyrobench.component import Component
from gyrobench.packaging import build, compiler, load_part, reference
from gyrobench.packaging.instance import Fmu, InstanceError, Unzipped
from gyrobench.packaging.reference import Reference, compare, read_reference, run_reference, write_reference
from gyrobench.units import base_unit, convert, unit


def reference_of(part: str) -> Path:
    return Bench(standard_folder()).part_folder(part) / "reference.csv"


def variables(cls: type[Component], *sections: str) -> list[str]:
    return [s.name for s in cls.layout if s.section in sections]


# ------------------------------------------------------------------------------------ the same run
# Bit for bit, of every part in all four targets: test_parts_have_no_problems in test_validate.py.
def test_reference_run_is_rich(part: str) -> None:
    """Every noise port is on, every input moves or is a switch of its part, and the outputs move."""
    cls, r = load_part(part), read_reference(reference_of(part))
    for n in cls.noises:
        assert r.parameters.get(n.name, n.start) > 0.0
    assert r.version == cls.version, "write the reference run again"
    if r.inputs:
        assert sum(len(set(x)) > 1 for x in r.inputs.values()) >= len(r.inputs) / 3
        assert sum(len(set(x)) > 1 for x in r.outputs.values()) >= len(r.outputs) / 2


def test_writing_again_changes_nothing(part: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the outputs that are there: the plain class gives them again in test_parts_have_no_problems."""
    folder = tmp_path / part
    folder.mkdir()
    copy = folder / "reference.csv"
    copy.write_bytes(reference_of(part).read_bytes())
    columns = read_reference(copy).outputs

    def run(one: Any, r: Reference, outputs: list[str]) -> list[list[float]]:
        return [[columns[n][k] for n in outputs] for k in range(len(r.time))]

    monkeypatch.setattr(reference, "run", run)
    assert write_reference(part, copy).read_bytes() == reference_of(part).read_bytes()


def test_a_difference_is_told(tmp_path: Path) -> None:
    path = write_reference("lag", tmp_path / "reference.csv", parameters={"seed": 5}, bench=TOYS, rows=20)
    for how in ("plain", "native"):
        assert run_reference(path, how, part="lag", bench=TOYS) == []
    lines = path.read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("time"))
    cells = lines[head + 8].split(",")
    cells[-3] = repr(float(cells[-3]) + 1.0)
    lines[head + 8] = ",".join(cells)
    path.write_text("\n".join(lines) + "\n")
    (problem,) = run_reference(path, "native", part="lag", bench=TOYS)
    assert problem.startswith("native: direct at t = 0.007 s is ") and "(1 of 20 rows differ)" in problem
    path.write_text("time,u\n0,1\n")
    with pytest.raises(ValueError, match="is not a reference file"):
        run_reference(path, part="lag", bench=TOYS)


def test_a_build_copies_what_has_changed(tmp_path: Path) -> None:
    """A file that is the part's FMU stays as it is; one that was written to, or is another part's, does not."""
    path = build("lag", out=tmp_path, bench=TOYS)
    number, content = path.stat().st_ino, path.read_bytes()
    assert build("lag", out=tmp_path, bench=TOYS) == path
    assert path.stat().st_ino == number  # a file that is written takes the place of the old one
    path.write_bytes(content[:-1] + b"x")
    assert build("lag", out=tmp_path, bench=TOYS).read_bytes() == content
    path.write_bytes(build("noisy", out=tmp_path, bench=TOYS).read_bytes())
    assert build("lag", out=tmp_path, bench=TOYS).read_bytes() == content


# -------------------------------------------------------------------------------------- description
def test_sources_say_how_to_build(part: str, fmu: Callable) -> None:
    """FMI 3: a build description (the standard's own checks of all FMUs are those of test_validate)."""
    (one,) = fmpy.model_description.read_build_description(str(fmu(part, "native", 3)))
    assert [f for s in one.sourceFileSets for f in s.sourceFiles] == ["fmi3.c"]


@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.long
def test_sources_build_by_themselves(fmu: Callable, tmp_path: Path, fmi: int) -> None:
    """The one file that is named is one unit, without an option of the build's own: the same bits."""
    path = fmu("floated_gyro", "native", fmi)
    files = Unzipped(
        fmpy.read_model_description(str(path), validate=False), Path(fmpy.extract(str(path), str(tmp_path)))
    )
    (library,) = (tmp_path / "binaries").glob("*/floated_gyro.*")
    built = library.read_bytes()
    cc = compiler.command(compiler.this_platform())
    assert cc is not None
    options = ("-O1", "-ffp-contract=off", "-fPIC", "-shared", "-o", str(library), f"fmi{fmi}.c", "-lm")
    subprocess.run([*cc, *options], cwd=tmp_path / "sources", check=True)
    assert library.read_bytes() != built
    one = Fmu(path, like=files)
    assert compare(read_reference(reference_of("floated_gyro")), one, "from its sources") == []
    one.free()


def test_description(part: str, target: str, fmu: Callable) -> None:
    """Units known and spelled out, starts, bounds and causalities as declared, structure complete."""
    cls = load_part(part)
    d = fmpy.read_model_description(str(fmu(part, target)), validate=False)  # against the schema: test_validate
    by_name = {v.name: v for v in d.modelVariables}
    assert list(by_name) == [s.name for s in cls.layout]
    units = {u.name: u for u in d.unitDefinitions}
    for s in cls.layout:
        v = by_name[s.name]
        assert v.description == (s.decl.doc or None)
        assert v.causality == (s.section if s.section in ("parameter", "input", "output") else "local")
        if v.type == "Real":
            unit(v.unit)
            known = base_unit(v.unit)
            assert (units[v.unit].baseUnit is not None) == (known is not None)
            offered = {u.name: float(u.factor) for u in units[v.unit].displayUnits}
            assert v.displayUnit is None or v.displayUnit in offered
            for name, factor in offered.items():
                assert factor == pytest.approx(convert(1.0, v.unit, name), rel=1e-15)
        if s.section in ("parameter", "input", "state"):
            assert v.start is not None
            for bound, given in ((s.decl.min, v.min), (s.decl.max, v.max)):
                assert given is None or bound is None or float(given) == bound
    unknowns = variables(cls, "output")
    assert [u.variable.name for u in d.outputs] == unknowns
    assert {u.variable.name for u in d.derivatives} == set(variables(cls, "derivative"))
    assert {u.variable.name for u in d.initialUnknowns} == set(unknowns) | set(variables(cls, "derivative"))
    co = d.coSimulation
    assert co.canGetAndSetFMUstate and co.canSerializeFMUstate
    assert co.providesDirectionalDerivative == (target == "native")


@pytest.mark.parametrize("fmi", [2, 3])
def test_other_tools_show_degrees(fmu: Callable, fmi: int) -> None:
    """A drift in deg/h, a signal of rate in deg/s; the values themselves are SI: 0.5 deg/h are 2.42e-6 rad/s."""
    d = fmpy.read_model_description(str(fmu("floated_gyro", "native", fmi)), validate=False)
    by_name = {v.name: v for v in d.modelVariables}
    shown = {n: by_name[n].displayUnit for n in ("D_I", "i", "float_angle")}
    assert shown == {"D_I": "deg/h", "i": None, "float_angle": "deg"}
    assert by_name["omega[1]" if fmi == 2 else "omega"].displayUnit == "deg/s"
    (offered,) = (u.displayUnits for u in d.unitDefinitions if u.name == "rad/s")
    per_hour = next(float(u.factor) for u in offered if u.name == "deg/h")
    assert 0.5 / per_hour == pytest.approx(2.42e-6, rel=2e-3)


# --------------------------------------------------------------------------------------------- state
def play(one: Any, r: Reference, rows: range, names: list[str]) -> list[list[float]]:
    """Return the outputs after each row, then the values of all names."""
    got = []
    for k in rows:
        one.set({n: x[k] for n, x in r.inputs.items()})
        one.step(r.time[k], r.step)
        got.append(one.get(list(r.outputs)))
    return [*got, one.get(names)]


def test_state_and_reset_restore_a_run(part: str, form: str, instance: Callable) -> None:
    """From a state in memory, from its bytes in another instance, and after reset: the same bits."""
    r = read_reference(reference_of(part))
    cls = load_part(part)
    names = variables(cls, "output", "state", "discrete")
    n = len(r.time) // 6
    first, between, second = range(n), range(n, 2 * n), range(2 * n, 3 * n)

    def begin(one: Any) -> None:
        one.set(r.parameters)
        one.set({k: x[0] for k, x in r.inputs.items()})
        one.initialize()

    one = instance(part, form)
    begin(one)
    begun = play(one, r, first, names)
    play(one, r, between, names)
    state = one.get_state()
    data = one.save(state)
    told = play(one, r, second, names)
    one.set_state(state)
    assert play(one, r, second, names) == told
    one.set_state(state)
    assert one.save(one.get_state()) == data

    other = instance(part, form, "other")
    begin(other)
    other.set_state(other.load(data))
    assert play(other, r, second, names) == told

    one.reset()
    starts = {s.name: s.start for s in cls.layout if s.section in ("parameter", "input", "state")}
    assert one.get(list(starts)) == list(starts.values())
    begin(one)
    assert play(one, r, first, names) == begun


def test_a_state_of_another_part_is_refused(form: str, instance: Callable) -> None:
    lag, noisy = (instance(n, form, toy=True) for n in ("lag", "noisy"))
    for one in (lag, noisy):
        one.initialize()
    data = lag.save(lag.get_state())
    with pytest.raises(InstanceError, match=r"not a state of this FMU|a state of Lag 1\.2\.3 is not one of this part"):
        noisy.set_state(noisy.load(data))
    noisy.step(0.0, 1e-3)


# ---------------------------------------------------------------------------------------- instances
STEPS = {"optical_tracker": 30, "gyro_vibratory_carrier": 1}  # until the first image is there; many periods a step


@pytest.mark.long
def test_a_thousand_native_instances(part: str, fmu: Callable, instance: Callable) -> None:
    """All alive at once, each with a seed or a time of its own, stepped in turn; ten are looked at."""
    like = instance(part, "native")
    library = ctypes.CDLL(str(like.folder / "binaries" / fmpy.platform / f"{part}{fmpy.sharedLibraryExtension}"))
    make, doubles, references = library.fmi2Instantiate, ctypes.c_double, ctypes.c_uint
    make.restype = ctypes.c_void_p
    guid = like.description.guid.encode()
    ids = [make(b"i%d" % k, 1, guid, b"", None, 0, 0) for k in range(1000)]
    assert all(ids) and len(set(ids)) == 1000
    for name in ("SetupExperiment", "EnterInitializationMode", "ExitInitializationMode", "DoStep", "FreeInstance"):
        getattr(library, f"fmi2{name}").restype = ctypes.c_int
    cls = load_part(part)
    outputs = variables(cls, "output")
    vrs = (references * len(outputs))(*(like.variables[n].valueReference for n in outputs))
    seeded = bool(cls.noises)

    def start(c: int, seed: int) -> None:
        handle = ctypes.c_void_p(c)
        if seeded:
            reference = (references * 1)(like.variables["seed"].valueReference)
            assert library.fmi2SetInteger(handle, reference, ctypes.c_size_t(1), (ctypes.c_int * 1)(seed)) == 0
        assert library.fmi2SetupExperiment(handle, 0, doubles(0), doubles(0), 0, doubles(0)) == 0
        assert library.fmi2EnterInitializationMode(handle) == 0
        assert library.fmi2ExitInitializationMode(handle) == 0

    for k, c in enumerate(ids):
        start(c, k)
    steps = STEPS.get(part, 5)
    for n in range(steps):
        for c in ids:
            assert library.fmi2DoStep(ctypes.c_void_p(c), doubles(n * 1e-3), doubles(1e-3), 1) == 0
    seen = set()
    for k in range(0, 1000, 111):
        values = (doubles * len(outputs))()
        assert library.fmi2GetReal(ctypes.c_void_p(ids[k]), vrs, ctypes.c_size_t(len(outputs)), values) == 0
        alone = instance(part, "plain")
        if seeded:
            alone.set({"seed": k})
        alone.initialize()
        for n in range(steps):
            alone.step(n * 1e-3, 1e-3)
        assert alone.get(outputs) == list(values)
        seen.add(tuple(values))
    noisy = any(n.start > 0.0 for n in cls.noises)  # by default
    assert len(seen) == (10 if noisy else 1)
    for c in ids:
        library.fmi2FreeInstance(ctypes.c_void_p(c))


@pytest.mark.long
def test_a_thousand_python_instances(fmu: Callable, instance: Callable) -> None:
    path = fmu("rebalance_analog", "python")
    like = instance("rebalance_analog", "python")
    many = [Fmu(path, f"i{k}", like=like) for k in range(1000)]
    for k, one in enumerate(many):
        one.set({"seed": k})
        one.initialize()
    for n in range(3):
        for one in many:
            one.step(n * 1e-3, 1e-3)
    assert len({one.get(["i_read"])[0] for one in many}) == 1000
    for one in many:
        one.free()
    like.initialize()
    like.step(0.0, 1e-3)
