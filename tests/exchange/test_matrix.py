"""A system in all other tools, compared after reduction, and what a tool cannot do.

All systems: tests/benchmarks/matrix.py.
"""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from typing import Any

import pytest
from exported import CANNOT, at_step, differences, effects, left_over, numbers, prefixes, record_in, same, scales
from masters import PeerError, run_in

from gyrobench.bench import Bench, standard_folder
from gyrobench.engine.session import run
from gyrobench.exchange.container import export_container
from gyrobench.exchange.ssp_export import export_ssp
from gyrobench.system.suite import Suite, load_test
from gyrobench.system.system import System, load_system

pytestmark = pytest.mark.long

GUIDE = standard_folder() / "docs" / "guides" / "run_elsewhere.md"
SYSTEM, VALUES = "stabilizer_sdf", {"time": 2.0, "command": 1e-4}  # a factor of 12 between its parts; 3,100 steps


def needs(module: str) -> None:
    if importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed")


@pytest.fixture(scope="module")
def system() -> System:
    return at_step(SYSTEM, VALUES)


@pytest.fixture(scope="module")
def own(system: System) -> dict[str, Any]:
    """Return the bench's run and its measures; the scale of each is its u with noise."""
    record = run(system)
    result = system.reduce(record)
    return {"record": record, "result": result, "scale": scales(result, at_step(SYSTEM, VALUES, noise=True))}


def test_a_container_gives_the_record_bit_for_bit(system: System, own: dict[str, Any], tmp_path: Path) -> None:
    """So does the one FMU: tests/exchange/test_system_fmu.py."""
    needs("fmu_manipulation_toolbox")
    export_container(system, tmp_path / "one.fmu")
    record, _ = record_in("FMU in FMPy", tmp_path / "one.fmu", system, own["record"])
    assert len(record.channels["time"]) > 300
    assert same(record, own["record"])


def test_tools_that_couple_in_parallel(system: System, own: dict[str, Any], tmp_path: Path) -> None:
    """The difference to the bench is that of what the step does to the measures here and there, to first order."""
    needs("libcosimpy")
    half = at_step(SYSTEM, VALUES, system.step / 2)
    export_ssp(system, tmp_path / "h.ssp")
    export_ssp(half, tmp_path / "half.ssp")
    own_half = run(half)
    found = system.reduce(record_in("libcosimpy", tmp_path / "h.ssp", system, own["record"])[0])
    at_half = half.reduce(record_in("libcosimpy", tmp_path / "half.ssp", half, own_half)[0])
    ours, theirs, scale = numbers(own["result"]), numbers(found), own["scale"]
    assert len(ours) >= 8 and ours.keys() == theirs.keys()
    gain = ours["rate gain"].estimate
    assert theirs["rate gain"].estimate == pytest.approx(gain, rel=5e-3)  # a factor that is lost makes it 12 times less
    of_step = effects(own["result"], half.reduce(own_half)), effects(found, at_half)
    share, name = left_over(ours, of_step[0], theirs, of_step[1], scale)
    assert share < 0.1, name
    for tool, module in (("FMPy simulate_ssp", "fmpy"), ("ecospy", "ecospy")):
        if importlib.util.find_spec(module) is not None:
            same_coupling = system.reduce(record_in(tool, tmp_path / "h.ssp", system, own["record"])[0])
            off, name = differences(numbers(same_coupling), theirs, scale)
            assert off < 0.2, f"{tool}: {name}"  # of u; what the first step with other inputs leaves


def test_what_a_tool_cannot(tmp_path: Path) -> None:
    """FMPy takes sampler_2.x for a parameter of sampler, and all inputs are 0 in its first step: the guide says so."""
    systems = [s for n in Bench(standard_folder()).systems() if not isinstance(s := load_test(n), Suite)]
    assert {s.name for s in systems if prefixes(s)} == CANNOT["KeyError"]
    for why, names in CANNOT.items():
        line = next(row for row in GUIDE.read_text("utf-8").splitlines() if "simulate_ssp" in row and why in row)
        assert set(re.findall(r"`(\w+)`", line)) & {s.name for s in systems} == names
    for name, output, words in (
        ("accelerometer_four", ("sampler", "count"), "KeyError"),
        ("gyro_magnetic_compass", ("exciter", "done"), "sensor: output psi is nan"),
        ("servo_vertical_level", ("sampler", "count"), "stand: mount = 0 must be a whole number from 1"),
    ):
        system = load_system(name)
        export_ssp(system, tmp_path / f"{name}.ssp")
        with pytest.raises(PeerError, match=words):
            run_in("FMPy simulate_ssp", tmp_path / f"{name}.ssp", {"x": output}, system.step, 10)
