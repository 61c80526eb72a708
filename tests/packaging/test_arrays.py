"""FMI 3.0: a declared vector or matrix is one variable with dimensions, in the description and in calls."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
from toybench import TOYS

from gyrobench.packaging import build, load_part


def described(path: Path) -> Any:
    return fmpy.read_model_description(str(path), validate=False)


def test_every_declaration_is_one_variable(part: str, fmu: Callable) -> None:
    """Of the elements that FMI 2 has: the same starts, dependencies of the arrays that they are elements of."""
    two, three = described(fmu(part, "native", 2)), described(fmu(part, "native", 3))
    cls = load_part(part)
    arrays = {}  # of FMI 2, by the array or scalar of FMI 3; ModelStructure likewise
    for s, v in zip(cls.layout, two.modelVariables, strict=True):
        name = f"der({s.decl.name})" if s.section == "derivative" else s.decl.name
        arrays.setdefault(name, []).append((s, v))
    of = {v.name: name for name, elements in arrays.items() for _, v in elements}
    time, *variables = three.modelVariables
    assert time.valueReference == 0
    assert [v.name for v in variables] == list(arrays)
    for v in variables:
        elements = arrays[v.name]
        assert tuple(v.shape or ()) == elements[0][0].decl.shape
        assert v.valueReference == elements[0][0].reference + 1
        starts = [e.start for _, e in elements]
        assert (v.start.split() if v.start is not None else [None] * len(starts)) == starts
        assert {(e.unit, e.causality, e.min, e.max) for _, e in elements} == {(v.unit, v.causality, v.min, v.max)}
    for one, other in ((two.outputs, three.outputs), (two.initialUnknowns, three.initialUnknowns)):
        known = {u.variable.name: {d.name for d in u.dependencies} for u in other}
        assert len(known) == len(other)
        found: dict[str, set[str]] = {}
        for u in one:
            found.setdefault(of[u.variable.name], set()).update(of[d.name] for d in u.dependencies)
        assert found == known


class Calls:
    """fmi3GetFloat64 and fmi3SetFloat64 of an instance, with any numbers of values."""

    def __init__(self, one: Any) -> None:
        self.one = one
        self.library, self.handle = one.fmu.dll, ctypes.c_void_p(one.fmu.component)

    def _call(self, name: str, references: list[int], values: Any) -> int:
        self.one.messages.clear()
        numbers = (ctypes.c_uint * len(references))(*references)
        sizes = ctypes.c_size_t(len(references)), ctypes.c_size_t(len(values))
        return int(getattr(self.library, name)(self.handle, numbers, sizes[0], values, sizes[1]))

    def get(self, references: list[int], n: int) -> tuple[int, list[float]]:
        values = (ctypes.c_double * n)(*[-7.0] * n)
        return self._call("fmi3GetFloat64", references, values), list(values)

    def set(self, references: list[int], values: list[float]) -> int:
        return self._call("fmi3SetFloat64", references, (ctypes.c_double * len(values))(*values))


def test_arrays_and_scalars_in_one_call(instance: Callable) -> None:
    """Values one after the other, a matrix row by row; what does not fit is refused and changes nothing."""
    one = instance("lag", "native-fmi3", toy=True)
    references = {v.name: v.valueReference for v in one.description.modelVariables}
    tau, mix, u, v = (references[n] for n in ("tau", "mix", "u", "v"))
    calls = Calls(one)
    assert calls.get([mix, 0, u, tau], 8) == (0, [1.0, 0.5, 0.0, 1.0, 0.0, 0.0, 0.0, 2e-3])
    assert calls.set([u, tau, mix], [3.0, 4.0, 5e-3, 1.0, 2.0, 3.0, 4.0]) == 0
    assert calls.get([tau, mix, u, v], 9) == (0, [5e-3, 1.0, 2.0, 3.0, 4.0, 3.0, 4.0, 0.0, 0.0])
    for n in (1, 3):
        assert calls.set([u], [9.0] * n) == 3
        assert one.messages == [f"slot: {n} values for variables of 2 values"]
        assert calls.get([u], n) == (3, [-7.0] * n)
    assert calls.set([tau, u + 1], [1.0, 9.0]) == 3  # the second element has no reference of its own
    assert one.messages == [f"slot: no variable has the value reference {u + 1}"]
    assert calls.set([0], [1.0]) == 3  # nor is the time set
    assert calls.get([tau, u, 0], 4) == (0, [5e-3, 3.0, 4.0, 0.0])


def test_a_part_and_its_arrays_in_fmpy(tmp_path: Path) -> None:
    """simulate_fmu with vectors as inputs, start values and outputs gives the numbers of the FMI 2.0 FMU."""
    files = {fmi: build("lag", fmi=fmi, out=tmp_path, bench=TOYS) for fmi in (2, 3)}
    t = np.linspace(0.0, 0.02, 21)
    u = np.column_stack([np.sin(300.0 * t), 0.1 * np.cos(500.0 * t)])
    mix = np.array([[1.0, 0.25], [-0.5, 2.0]])
    inputs = {
        2: np.rec.fromarrays([t, *u.T], names=["time", "u[1]", "u[2]"]),
        3: np.array(list(zip(t, u, strict=True)), dtype=[("time", float), ("u", float, 2)]),
    }
    starts: dict[int, dict[str, Any]] = {
        2: {f"mix[{i + 1},{j + 1}]": mix[i, j] for i in range(2) for j in range(2)},
        3: {"mix": " ".join(map(str, mix.ravel()))},
    }
    outputs = {2: ["y[1]", "y[2]", "v[1]", "v[2]", "x"], 3: ["y", "v", "x"]}
    time: dict[str, Any] = {"stop_time": 0.02, "output_interval": 1e-3}
    found = {
        n: fmpy.simulate_fmu(str(files[n]), **time, input=inputs[n], start_values=starts[n], output=outputs[n])
        for n in (2, 3)
    }
    assert found[3]["y"].shape == (21, 2)
    assert np.ptp(found[3]["y"]) > 0.1
    for name in ("y", "v"):
        for k in range(2):
            np.testing.assert_array_equal(found[3][name][:, k], found[2][f"{name}[{k + 1}]"])
    np.testing.assert_array_equal(found[3]["x"], found[2]["x"])
