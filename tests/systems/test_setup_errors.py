"""What is set past an option or past the method is a simulated set-up error: named before the run, in the report and in
result.json; and a simulated result that misses its truth says so first.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from commanding import Command
from tumbling import NAME, SHORT, load

from gyrobench.engine.session import Session
from gyrobench.record.run_document import PartInfo, RunDocument, SetupError
from gyrobench.reduction.estimation.truth_check import missed_truth, set_values
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.result import Coefficient, LoopResult, Reason
from gyrobench.system.parameters import defaults, resolve
from gyrobench.system.part_files import resolve_parts
from gyrobench.system.setup_errors import setup_errors
from gyrobench.system.system import load_system
from gyrobench.system.wiring import Assembly, assemble

Foreign = Callable[[str], Path]
MAPPING = Path(__file__).parents[1] / "foreign" / "vendor_gyro.toml"
DEG = 0.017453292519943295
SHORTENED = [w for k, v in SHORT.items() for w in ("--set", f"{k}={v!r}")]
SOUTH = "site.latitude = −33.86°, while plan and reduction assume 45.75° (option latitude)"


def assembled(name: str, gyro: Path | None = None) -> Assembly:
    """The FMUs of a system bound and ordered, as a session has them; none is loaded."""
    system, notes = load_system(name), list[str]()
    paths, _ = resolve_parts(system, {"gyro": gyro} if gyro else {}, "native", None, notes)
    return assemble(system, paths, {"gyro": MAPPING} if gyro else None)


def found(name: str, values: Mapping[str, Any], gyro: Path | None = None) -> dict[str, SetupError]:
    """Set-up errors of a run with these values, by parameter, as its run.json holds them; nothing is run."""
    assembly = assembled(name, gyro)
    system, base = assembly.system.with_values(values), defaults(assembly)
    parameters = resolve(assembly, system, 1, base)[1]
    return {e.parameter: e for e in setup_errors(assembly, system, 1, base, parameters)}


@pytest.mark.parametrize("gyro", ["ours", "vendor"])
@pytest.mark.long
def test_a_site_that_the_test_does_not_know(
    command: Command, foreign: Foreign, tmp_path: Path, caplog: pytest.LogCaptureFixture, gyro: str
) -> None:
    """The case: only the site goes south.  A foreign gyro changes nothing of it."""
    part = ["--part", f"gyro={foreign('vendor_gyro')}", "--map", f"gyro={MAPPING}"] if gyro == "vendor" else []
    folder = tmp_path / "run"
    words = [*SHORTENED, "--set", "site.latitude=-33.86deg", "--set", "gyro.D_I=0.9deg/h/g", *part]
    code, out, err = command("run", NAME, *words, "--out", folder, pages=True, figures=gyro == "ours")
    assert code == 0, err
    told = [line for line in caplog.messages if "set-up error" in line]
    assert told == [f"{NAME}: simulated set-up error: {SOUTH}. To change the whole test: --set latitude=-33.86deg."]

    first = next(line for line in out.splitlines() if line.startswith("warning: ") and "misses the simulated" in line)
    assert "D_I (z = −" in first and f"set-up error {SOUTH}" in first
    assert ("part Vendor RIG-7 in slot gyro" in first) == (gyro == "vendor")

    result = json.loads((folder / "result.json").read_text("utf-8"))
    assert max(abs(c["z"]) for c in result["coefficients"]) > 1000.0
    assert "misses the simulated truth" in result["warnings"][0]
    assert "gyro.D_I = 4.36332e-06 (SI)" in result["warnings"][0]
    (error,) = result["provenance"]["setup_errors"]
    assert error["value"] == pytest.approx(-33.86 * DEG) and error["assumed"] == pytest.approx(45.75 * DEG)
    page = re.sub(r"</?span[^>]*>", "", (folder / "report.html").read_text("utf-8"))
    assert page.index("misses the simulated truth") < page.index('<h2 id="setup-errors">') < page.index("Table 1.")
    assert f"<li>{SOUTH}. To change the whole test: --set latitude=-33.86deg.</li>" in page
    assert (folder / "report.pdf").stat().st_size > 10_000


@pytest.mark.long
def test_the_same_by_the_option_is_no_error(command: Command, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    code, out, err = command(
        "run", NAME, *SHORTENED, "--set", "latitude=-33.86deg", "--out", tmp_path / "run", pages=True, figures=False
    )
    assert code == 0 and "set-up error" not in caplog.text + err and "misses" not in out
    run = json.loads((tmp_path / "run" / "run.json").read_text("utf-8"))
    assert "setup_errors" not in run
    assert "setup-errors" not in (tmp_path / "run" / "report.html").read_text("utf-8")


def test_a_parameter_that_agrees_with_its_option_is_no_error() -> None:
    assert not found(NAME, {"site.latitude": "45.75deg"})
    assert not found(NAME, {"latitude": "-33.86deg", "site.latitude": "-33.86deg"})
    assert list(found(NAME, {"latitude": "-33.86deg", "site.latitude": "-33.87deg"})) == ["site.latitude"]


def test_parameters_of_an_instrument_and_designs_are_no_errors(foreign: Foreign) -> None:
    values = {"gyro.D_I": "0.9deg/h/g", "gyro.k": "20deg/h/mA"}
    assert not found(NAME, {**values, "rebalance.K_p": 3.0, "table.tilt[1]": "1arcmin"})
    assert not found(NAME, values, foreign("vendor_gyro"))


def test_what_the_method_assumes() -> None:
    """Mounts and bases that the user turns: no option makes the test know of them."""
    turned = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    errors = found(NAME, {"gyro.mount": turned, "table.base[1,1]": 0.5})
    assert list(errors) == ["table.base", "gyro.mount"]
    assert errors["gyro.mount"].value == turned and errors["gyro.mount"].assumed[0] == [1.0, 0.0, 0.0]
    assert errors["table.base"].value[0][0] == 0.5 and errors["table.base"].assumed[0][0] == 1.0
    assert "No option changes what they assume" in errors["gyro.mount"].sentence()


@pytest.mark.long
def test_options_of_other_systems_own_what_they_set() -> None:
    """A servo test has the latitude in two parts, the two-axis table one element of an array."""
    assert list(found("servo_polar", {"stand.latitude": "45deg"})) == ["stand.latitude"]
    assert list(found("servo_polar", {"site.latitude": "45deg", "stand.latitude": "45deg"})) == [
        "site.latitude", "stand.latitude"
    ]  # fmt: skip
    (error,) = found("tumble_two_axis", {"table.index_rate": [0.01, 0.002]}).values()
    assert (error.parameter, error.value, error.option) == ("table.index_rate[2]", 0.002, "inner_rate")
    assert list(found("torquer_scale_factor", {"source.slew": 0.2})) == ["source.slew"]
    assert list(found("servo_two_axis", {"inner.base": [[1.0, 0, 0], [0, 1, 0], [0, 0, 1]]})) == ["inner.base"]


@pytest.mark.long
def test_every_owned_and_assumed_parameter_exists() -> None:
    from gyrobench.bench import Bench, standard_folder
    from gyrobench.system.suite import Suite, load_test

    for name in Bench(standard_folder()).systems():
        if isinstance(load_test(name), Suite):
            continue
        assembly = assembled(name)
        for parameter in (*assembly.system.owned(), *assembly.system.assumed):
            if parameter.endswith("?"):  # of other parts than the standard one
                continue
            slot, _, element = parameter.partition(".")
            names = assembly.bindings[slot].parameters
            assert element in names or any(n.startswith(element + "[") for n in names), f"{name}: {parameter}"


# ------------------------------------------------------------------------------------------ the truth
def result_of(*z: float | None) -> LoopResult:
    coefficients = [
        Coefficient(f"c{k}", "", "1", 1.0 + (x or 0.0), 1.0, 2.0, (0.0, 2.0), truth=1.0, z=x) for k, x in enumerate(z)
    ]
    return LoopResult(
        system="", title="", method="", sources=[], conventions=[], coefficients=coefficients, responses=[],
    )  # fmt: skip


@pytest.mark.parametrize(("z", "named"), [((5.1, -2.0), ["c0"]), ((0.0, -6.0, 7.0, None), ["c2", "c1"])])
def test_an_estimate_far_from_its_truth_is_said_first(z: tuple[float | None, ...], named: list[str]) -> None:
    another = replace(result_of(*z), reasons=[Reason("another", "another")])
    (missed,) = missed_truth(another, [])
    assert missed.severity == "error" and missed.blocks == ("pass", "fail")
    places = [missed.text.index(f"{n} (z = ") for n in named]
    assert places == sorted(places) and missed.text.count("(z = ") == len(named)
    assert "No value was set" in missed.text
    result = conclude(replace(another, reasons=[*another.reasons, missed]))
    assert result.warnings == [missed.text, "another"]


def test_what_must_not_be_used_does_not_pass() -> None:
    """The latitude of the site is off by 4.25 deg: D_I is missed by some 2,000 u, inside of limits that are wide."""
    system = load()
    system.set("site.latitude", "50deg")
    with Session(system) as session:
        result = system.reduce(session.run(SHORT, 3), {"D_I": (-5.0, 5.0), "D_O": (-5.0, 5.0)})
    assert abs(result["D_I"].z or 0.0) > 500.0 and any("do not use" in w for w in result.warnings)
    assert (result["D_I"].verdict, result["D_O"].verdict, result.verdict) == ("inconclusive",) * 3


def test_an_estimate_near_its_truth_is_not() -> None:
    assert missed_truth(result_of(4.99, -5.0, None), ["gyro.k = 1"]) == []


def test_what_was_set_may_explain_it() -> None:
    error = SetupError(
        parameter="site.latitude", value=-33.86 * DEG, assumed=45.75 * DEG, unit="rad", option="latitude"
    )
    run = RunDocument(
        changed=["gyro: part", "site.latitude", "gyro.D_I", "rate", "both_senses", "u_axis", "type_b"],
        parts={"gyro": PartInfo(name="RIG-7")}, parameters={"gyro.D_I": 2e-6},
        options={"rate": 0.02, "both_senses": True, "u_axis": 1e-5, "type_b": "none"}, setup_errors=[error],
    )  # fmt: skip
    assert set_values(run) == [
        f"set-up error {SOUTH}", "part RIG-7 in slot gyro", "gyro.D_I = 2e-06 (SI)", "rate = 0.02 (SI)", "both_senses",
    ]  # fmt: skip


def test_default_tumble_is_within_its_uncertainty() -> None:
    with Session(load()) as session:
        result = session.system.reduce(session.run(SHORT, 3))
    assert missed_truth(result, []) == [] and not any(r.id == "truth.missed" for r in result.reasons)
