"""Fitting FMUs into sockets: units, signs, names, and what a misfit says."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import pytest
from fmpy import read_model_description

from gyrobench.system.binding import SocketMismatchError, fit
from gyrobench.system.mapping_files import load_mapping
from gyrobench.system.sockets import SOCKETS, element_names, socket

Foreign = Callable[[str], Path]
FOREIGN = Path(__file__).parents[1] / "foreign"
DPH = math.pi / 180 / 3600


def test_element_names() -> None:
    assert element_names("u", ()) == ["u"]
    assert element_names("f", (3,)) == ["f[1]", "f[2]", "f[3]"]
    assert element_names("C", (2, 2)) == ["C[1,1]", "C[1,2]", "C[2,1]", "C[2,2]"]


def test_vendor_gyro_fits_through_its_mapping(foreign: Foreign) -> None:
    description = read_model_description(str(foreign("vendor_gyro")))
    binding = fit(socket("SdfGyro"), description, load_mapping(FOREIGN / "vendor_gyro.toml"), "gyro")
    # connector = gain * variable: deg/h declared by BaseUnit, load in g with the other sign, mA declared, mV mapped
    assert binding.inputs["omega[2]"].variable == "W_OA"
    assert binding.inputs["omega[2]"].gain == pytest.approx(DPH, rel=1e-15)
    assert binding.inputs["f[1]"].gain == -9.80665
    assert binding.inputs["i"].gain == 1e-3
    assert binding.outputs["u"].gain == 1e-3
    assert binding.parameters["k"].gain == pytest.approx(DPH / 1e-3, rel=1e-14)  # rad/s per A
    assert binding.parameters["T_FLOAT"].gain == 1e-3  # unmapped: own name, SI by its unit
    inputs = ["alpha", "dT", "v_float", "temperature", "B", "dB"]
    inputs += ["wheel_frequency", "wheel_voltage", "wheel_phase", "pickoff_excitation", "torquer_excitation"]
    assert binding.absent == [*inputs, "drift", "b", "M_react", "h_I", "M_I", "saturated"]


def test_misfit_names_everything(foreign: Foreign) -> None:
    description = read_model_description(str(foreign("vendor_gyro")))
    with pytest.raises(SocketMismatchError) as caught:
        fit(socket("SdfGyro"), description, {"omega": {"names": ["W_IA", "W_OA", "BIAS"]}, "i": {"name": "I_TORQ"},
                                             "pickoff": "V_PICKOFF"}, "gyro")  # fmt: skip
    found = "\n".join(caught.value.problems)
    assert "slot gyro" in str(caught.value)
    assert "omega[3]: wrong causality: BIAS is parameter, must be input" in found
    assert "inputs of the same dimension: W_SRA [dph]" in found
    assert "f[1]: missing (input, m/s2: specific force" in found
    assert "i: missing (input, A" in found
    assert "nearest names: I_TORQUE" in found
    assert "u: missing (output, V" in found
    assert "[pickoff]: socket SdfGyro has no such connector" in found
    assert len(caught.value.problems) == 7  # omega[3], f[1..3], i, u, pickoff


def test_wrong_unit_and_wrong_type(foreign: Foreign) -> None:
    vendor = read_model_description(str(foreign("vendor_gyro")))
    mapping = load_mapping(FOREIGN / "vendor_gyro.toml")
    with pytest.raises(SocketMismatchError, match=r"i: wrong unit: I_TORQUE is in V, the socket needs A") as caught:
        fit(socket("SdfGyro"), vendor, {**mapping, "i": {"name": "I_TORQUE", "unit": "V"}})
    assert len(caught.value.problems) == 1
    with pytest.raises(SocketMismatchError, match=r"unit 'furlong' of ACC_IA is not known"):
        fit(socket("SdfGyro"), vendor, {**mapping, "f": {**mapping["f"], "unit": "furlong"}})
    with pytest.raises(SocketMismatchError, match=r"factor 0.0 in the mapping"):
        fit(socket("SdfGyro"), vendor, {**mapping, "u": {"name": "V_PICKOFF", "unit": "mV", "factor": 0}})
    lag = read_model_description(str(foreign("lag")))
    with pytest.raises(SocketMismatchError, match=r"i: wrong type: count is Integer, must be Real"):
        fit(socket("Rebalance"), lag, {"i": "count", "i_read": "y"})


def test_unit_not_declared_is_taken_as_si_with_a_warning(foreign: Foreign) -> None:
    lag = read_model_description(str(foreign("lag")))
    binding = fit(socket("Rebalance"), lag, {"i": "y", "i_read": "y", "saturated": "odd"})
    assert any("u declares no unit; taken as V" in w for w in binding.warnings)
    assert binding.outputs["saturated"].kind == "Boolean"


def test_mapping_file_that_cannot_be_read(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("[u\nname=")
    with pytest.raises(SocketMismatchError, match=r"bad\.toml"):
        load_mapping(tmp_path / "bad.toml")


def test_every_socket_has_a_meaning_for_each_connector() -> None:
    for s in SOCKETS.values():
        assert s.meaning
        assert all(c.meaning and c.causality in ("input", "output") for c in s.connectors)


def test_quantity_is_compared_where_both_sides_declare_one(foreign: Foreign) -> None:
    """The vendor's FMU declares none and fits; a quantity the bench does not know says nothing."""
    description = read_model_description(str(foreign("vendor_gyro")))
    mapping = load_mapping(FOREIGN / "vendor_gyro.toml")
    angle = socket("SdfGyro").standing_for({"u": "angle"})
    u = next(v for v in description.modelVariables if v.name == "V_PICKOFF")
    for quantity in (None, "angle", "Angle", "ElectricPotential"):
        u.quantity = quantity
        assert fit(angle, description, mapping, "gyro").outputs["u"].variable == "V_PICKOFF"
    u.quantity = "rate"
    assert fit(socket("SdfGyro"), description, mapping, "gyro").outputs["u"].variable == "V_PICKOFF"
    with pytest.raises(SocketMismatchError, match="V_PICKOFF is for an angular rate, here the pickoff voltage stands"):
        fit(angle, description, mapping, "gyro")
