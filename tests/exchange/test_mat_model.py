"""State space as a MATLAB file, read back by SciPy: a part by hand, a system against what a run keeps."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
from scipy.io import loadmat

from gyrobench.exchange.mat_model import export_mat, export_part_mat
from gyrobench.exchange.ssp_export import ExportError
from gyrobench.packaging import load_part
from gyrobench.system.system import load_system
from gyrobench.system.values import InvalidValueError


def read(path: Path) -> dict[str, Any]:
    return loadmat(str(path), simplify_cells=True)


def test_a_floated_gyro(tmp_path: Path) -> None:
    """Current to pickoff: u / i = -K_sg H k / (J s (s + C/J)), C/J = 0.4/4e-4 = 1000 1/s; per step of 1 ms e^-1."""
    export_part_mat(load_part("floated_gyro"), "gyro", tmp_path / "g.mat", {"J": "4e-4", "C": "0.4", "k": "0.1"})
    m = read(tmp_path / "g.mat")
    c, d, point = m["continuous"], m["discrete"], m["operating_point"]
    assert (c["Ts"], d["Ts"]) == (0.0, 1e-3)
    assert dict(zip(c["inputs"], c["input_units"], strict=True))["i"] == "A"
    assert [*zip(c["states"], c["state_units"], strict=True)] == [("float_angle", "rad"), ("float_rate", "rad/s")]
    j, k = list(c["inputs"]).index("i"), list(c["outputs"]).index("u")
    pickoff = control.ss(c["A"], c["B"][:, [j]], c["C"][[k]], c["D"][[k]][:, [j]])
    s = 30.0j
    assert pickoff(s) == pytest.approx(-10.0 * 0.2 * 0.1 / (4e-4 * s * (s + 1000.0)), rel=1e-12)
    assert sorted(abs(np.linalg.eigvals(d["A"]))) == pytest.approx([np.exp(-1.0), 1.0], rel=1e-12)
    assert m["about"].startswith("Single-degree-of-freedom floated")
    assert set(c["states"]) < set(point["names"]) and len(point["values"]) == len(point["units"]) == len(point["names"])


def test_the_point_is_where_inputs_are_set(tmp_path: Path) -> None:
    """u = 2 mV, K_p = 5 A/V: 10 mA."""
    export_part_mat(load_part("rebalance_analog"), "r", tmp_path / "r.mat", {"K_p": "5", "u": "2mV"})
    m = read(tmp_path / "r.mat")
    point = dict(zip(m["operating_point"]["names"], m["operating_point"]["values"], strict=True))
    assert point["u"] == 2e-3 and point["i"] == pytest.approx(5 * 2e-3)


@pytest.mark.parametrize(
    ("values", "error", "words"),
    [
        ({"Q": "1"}, InvalidValueError, "Q: no parameter or input of gyro"),
        ({"J": "1deg"}, InvalidValueError, "'deg' (rad) does not convert to 'kg.m2'"),
        ({"J": "200"}, InvalidValueError, "times the usual 0.0002 kg.m2"),
        ({"omega": "[1e-3, 2e-3, 0, 0]"}, InvalidValueError, "omega: 3 values are expected"),
        ({"J": "-1e-4"}, ExportError, "J = -0.0001 kg.m2 must be > 0"),
    ],
)
def test_what_is_refused(tmp_path: Path, values: dict[str, str], error: type[Exception], words: str) -> None:
    with pytest.raises(error, match=re.escape(words)):
        export_part_mat(load_part("floated_gyro"), "gyro", tmp_path / "g.mat", values)
    assert not (tmp_path / "g.mat").exists()


def test_a_system_has_its_loops(tmp_path: Path) -> None:
    """The loop crosses 0 dB where the system was asked to; the closed loop does not grow."""
    system = load_system("platform_single_axis")
    assert export_mat(system, tmp_path / "s.mat") == []
    m = read(tmp_path / "s.mat")
    ((name, wanted),) = system.crossovers().items()
    loop = m["loops"][name]
    assert loop["break_at"] == system.loops[name]
    c = loop["continuous"]
    opened = control.ss(c["A"], c["B"].reshape(-1, 1), c["C"].reshape(1, -1), np.reshape(c["D"], (1, 1)))
    _, phase, _, crossover = control.margin(opened)
    closed, stepped = m["closed"]["continuous"], m["closed"]["discrete"]
    assert np.linalg.eigvals(closed["A"]).real.max() < 1e-9 and abs(np.linalg.eigvals(stepped["A"])).max() < 1.0 + 1e-9
    assert stepped["Ts"] == system.step and closed["inputs"].size == np.shape(closed["B"])[1]
    assert crossover / (2.0 * np.pi) == pytest.approx(wanted, rel=0.02)
    assert 20.0 < phase < 90.0


def test_a_system_without_a_linear_model_says_why(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="mat: tumble_single_axis has no linear model: "):
        export_mat(load_system("tumble_single_axis"), tmp_path / "t.mat")
