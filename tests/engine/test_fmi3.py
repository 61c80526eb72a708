"""FMI 3.0 co-simulation FMUs in slots: every type, arrays, early return, own builds; equal records in both engines."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest
from fmpy.validation import validate_fmu

from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session, run
from gyrobench.exchange.container import export_container
from gyrobench.exchange.ssp_export import ExportError, export_ssp
from gyrobench.exchange.ssp_import import read_ssp
from gyrobench.packaging import build
from gyrobench.system import sockets
from gyrobench.system.system import Slot, System, load_system
from gyrobench.system.values import InvalidValueError

Foreign = Callable[[str], Path]
FOREIGN = Path(__file__).parents[1] / "foreign"
QUICK = {"dwell": 0.2, "turns": 0.02, "table.index_rate": 1.0}
TYPES = ("Float64", "Float32", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64", "Boolean")


class Pair(System):
    """The outputs of one FMU into the inputs of another, type by type."""

    title = "pair"
    slots: ClassVar = {n: Slot("Any", "types3") for n in "ab"}
    wires = "\n".join([*(f"a.o_{t} -> b.i_{t}" for t in TYPES), "a.o_Float64 -> b.vector[2]"])
    step = 0.01
    stop = 0.5
    channels = (*(f"a.o_{t}" for t in TYPES), *(f"b.copy[{k}]" for k in range(1, 12)), "b.sum", "a.calls")
    channel_period = 0.01


class Narrow(Pair):
    """A number that the input's type does not hold."""

    wires = "a.o_Int32 -> b.i_Int8"
    channels = ("b.sum",)


@pytest.fixture(autouse=True)
def any_socket(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sockets.SOCKETS, "Any", sockets.Socket("Any", "any FMU", ()))


def pair(foreign: Foreign, system: type[System] = Pair, engine: str = "native", **more: Any) -> Any:
    return run(system(), parts={n: foreign("types3") for n in "ab"}, engine=engine, **more)


@pytest.mark.long
def test_foreign_fmus_are_valid(foreign: Foreign) -> None:
    assert validate_fmu(str(foreign("types3"))) == []
    assert validate_fmu(str(foreign("vendor_gyro3"))) == []


@pytest.mark.long
def test_every_type_and_arrays_that_are_wired_in_part(foreign: Foreign) -> None:
    found = pair(foreign, child=True)
    assert pair(foreign).same_data(found)
    assert pair(foreign, engine="reference").same_data(found)
    k = np.arange(51.0)
    single = (0.1 * k).astype(np.float32).astype(float)  # what a float holds of k/10
    expected = (
        0.1 * k, single, -k, 200 + k, -30000 - k, 60000 + k, k - 2**31, 2**32 - 1 - k, k - 2.0**53,
        2.0**53 - 1 - k, k % 2,
    )  # fmt: skip
    for n, (t, column) in enumerate(zip(TYPES, expected, strict=True), 1):
        np.testing.assert_array_equal(found.channels[f"a.o_{t}"], column, err_msg=t)
        np.testing.assert_array_equal(found.channels[f"b.copy[{n}]"], column, err_msg=t)
    # the elements that no wire feeds stay at their start values 1 and 3; the second is a float
    np.testing.assert_array_equal(found.channels["b.sum"], 1.0 + 10.0 * single + 300.0)


def test_elements_of_arrays_are_set_one_by_one(foreign: Foreign) -> None:
    both = [pair(foreign, engine=e, values={"b.vector[3]": 5.0}) for e in ("native", "reference")]
    assert both[0].same_data(both[1])
    assert both[0].channels["b.sum"][0] == 501.0  # 1 + 10 * 0 + 100 * 5
    with pytest.raises(InvalidValueError, match=r"a has no parameter 'vektor\[3\]'"):
        pair(foreign, values={"a.vektor[3]": 5.0})


def test_early_return_goes_on_with_the_rest_of_the_step(foreign: Foreign) -> None:
    for engine in ("native", "reference"):
        found = pair(foreign, engine=engine, values={"a.pieces": 3})
        assert found.channels["a.calls"].tolist() == [3 * k for k in range(51)]
        assert found.channels["a.o_Int8"].tolist() == [-k for k in range(51)]


@pytest.mark.parametrize("engine", ["native", "reference"])
@pytest.mark.parametrize(
    ("system", "values", "words"),
    [
        (Pair, {"a.more": 3.0}, "a: getInt64 failed: a value that Int64 does not hold (-9007199254740992 to"),
        (Narrow, {}, "b: setInt8 failed: a value that Int8 does not hold (-128 to 127)"),
        (Pair, {"a.stuck": True}, "a: doStep failed at t = 0.05 s: it returns early and makes no progress"),
        (Pair, {"b.end_at": 0.1}, "b: doStep failed at t = 0.1 s: the FMU asks for the end of the simulation"),
    ],
)
def test_what_ends_a_run(
    foreign: Foreign, engine: str, system: type[System], values: dict[str, Any], words: str
) -> None:
    with pytest.raises(RunError) as caught:
        pair(foreign, system, engine, values=values)
    assert words in str(caught.value)


@pytest.mark.long
def test_own_builds_give_the_record_of_fmi_2(small: System, tmp_path: Path) -> None:
    """All parts, whose vectors are arrays then, and some of them beside parts of FMI 2."""
    every: dict[str, Path | str] = {slot: build(s.part, fmi=3, out=tmp_path) for slot, s in small.slots.items()}
    two = run(small, values=QUICK, seed=5)
    for parts in (every, {slot: every[slot] for slot in ("gyro", "rebalance", "sampler")}):
        for engine in ("native", "reference"):
            three = run(small, values=QUICK, seed=5, parts=parts, engine=engine)
            assert three.same_data(two)
            assert three.run.parts["gyro"].fmi == "3.0"
            assert three.run.order == two.run.order


@pytest.mark.long
def test_arrays_of_own_builds_that_are_wired_and_set_in_part(tmp_path: Path) -> None:
    """A platform on three axes: wires from and to single elements; of a matrix one element set."""
    system = load_system("platform_three_axis")
    system.step, system.stop, system.done = 5e-4, 0.5, None
    values = {"gyro_x.mount[1,2]": 0.0, "platform.I_a[2]": 0.55}
    every: dict[str, Path | str] = {slot: build(s.part, fmi=3, out=tmp_path) for slot, s in system.slots.items()}
    two = run(system, values=values, seed=5)
    for engine in ("native", "reference"):
        assert run(system, values=values, seed=5, parts=every, engine=engine).same_data(two)


@pytest.mark.long
def test_a_vendors_gyro_with_arrays(small: System, foreign: Foreign) -> None:
    """The FMI 3.0 gyro is the FMI 2.0 one but for its floats, which hold 24 bits of the load and the current."""
    maps = {"gyro": FOREIGN / "vendor_gyro3.toml"}
    values = {**QUICK, "gyro.D_I": "0.9deg/h", "gyro.D_S": "0.4deg/h", "rebalance.meter": 0.0}
    new = run(small, {"gyro": foreign("vendor_gyro3")}, maps, values, seed=5)
    assert new.same_data(run(small, {"gyro": foreign("vendor_gyro3")}, maps, values, seed=5, engine="reference"))
    old = run(small, {"gyro": foreign("vendor_gyro")}, {"gyro": FOREIGN / "vendor_gyro.toml"}, values, seed=5)
    np.testing.assert_allclose(new.windows["mean"], old.windows["mean"], rtol=1e-6, atol=1e-9)
    assert not new.same_data(old)  # a float is not a double
    # events every 0.7 ms cut the steps of 1 ms: the exact solution with held inputs is the same, up to the cross term
    early = run(small, {"gyro": foreign("vendor_gyro3")}, maps, {**values, "gyro.T_EVENT": "0.7ms"}, seed=5)
    np.testing.assert_allclose(early.windows["mean"], new.windows["mean"], rtol=1e-6, atol=1e-9)
    assert not early.same_data(new)


@pytest.mark.long
def test_arrays_in_an_archive(small: System, foreign: Foreign, tmp_path: Path) -> None:
    """Elements of arrays are connectors of their names; the archive reads back with the same connections."""
    parts, maps = {"gyro": foreign("vendor_gyro3")}, {"gyro": FOREIGN / "vendor_gyro3.toml"}
    notes = export_ssp(small, tmp_path / "v.ssp", parts, maps, {"gyro.D_S": "0.4deg/h"})
    assert "gyro: elements of arrays (FMI 3.0) are connectors, which few importers take" in notes
    archive = read_ssp(tmp_path / "v.ssp", 1e-3)
    assert archive.raw["gyro.MU[3]"] == pytest.approx(0.4, rel=1e-14)
    with Session(small, parts, maps) as a, Session(archive) as b:
        links = [
            {(c.source, c.output.variable, c.target, c.input.variable): c.gain for c in s.assembly.connections}
            for s in (a, b)
        ]
    assert ("table", "omega[2]", "gyro", "W[2]") in links[0]
    assert links[0] == pytest.approx(links[1], rel=1e-15)


@pytest.mark.long
def test_an_archive_of_own_builds_gives_the_values_of_fmi_2(small: System, tmp_path: Path) -> None:
    """Start values of inputs, parameters and wires, element by element: the same channels."""
    found = []
    for fmi in (2, 3):
        parts: dict[str, Path | str] = {n: build(s.part, fmi=fmi, out=tmp_path) for n, s in small.slots.items()}
        export_ssp(small, tmp_path / "s.ssp", parts, values=QUICK, seed=5)
        found.append(run(read_ssp(tmp_path / "s.ssp", 1e-3)))
    names = [n for n in found[0].channels if "[" in n]
    assert {"site.f[3]", "table.omega[1]"} <= set(names)
    assert found[1].same_data(found[0])


@pytest.mark.long
def test_a_container_of_arrays_is_refused(small: System, tmp_path: Path) -> None:
    pytest.importorskip("fmu_manipulation_toolbox")
    parts: dict[str, Path | str] = {n: build(small.slots[n].part, fmi=3, out=tmp_path) for n in ("gyro", "sampler")}
    with pytest.raises(ExportError, match=r"container: gyro: has arrays \(FMI 3.0\); the toolbox"):
        export_container(small, tmp_path / "c.fmu", parts)
    export_container(small, tmp_path / "c.fmu", {"sampler": parts["sampler"]})  # no arrays, FMI 3.0
