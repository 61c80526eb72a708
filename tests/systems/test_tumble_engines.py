"""Both engines, order and delays, initial outputs, and the step: point by point on the tumble itself."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from tumbling import DPH, NAME, SHORT, drift_in, gyro, load, quiet

from gyrobench import frames
from gyrobench.engine.reference_engine import initial_state, initialize
from gyrobench.engine.session import Session, run
from gyrobench.system.parameters import resolve
from gyrobench.system.wire_text import parse_wires

#: A tumble of some 13,000 steps, for the slow engine: turns of 2.1 s, six windows each.
HASTY = {"rate": 3.0, "windows": 6, "dwell": 0.6, "settle": 0.3, "table.acceleration": 20.0}


@pytest.mark.long
def test_engines_give_bit_equal_records(tmp_path: Path) -> None:
    """All noise on, all parts native: windows and channels of both engines are the same bytes."""
    found = {e: run(NAME, values=HASTY, seed=7, engine=e, out=tmp_path / e) for e in ("native", "reference")}
    native, reference = found["native"], found["reference"]
    assert native.run.engine == "native" and reference.run.engine == "reference"
    assert native.run.steps == reference.run.steps > 5000
    assert len(native.windows["mean"]) == 2 * 6 + 2 * round(0.6 / 0.35)
    assert native.windows["mean"].std() > 0.0
    assert native.same_data(reference)
    for key in ("order", "cuts", "delays", "parameters", "plan"):
        assert getattr(native.run, key) == getattr(reference.run, key)


@pytest.mark.long
def test_order_cuts_and_delays_are_the_same_everywhere(command: Command, tmp_path: Path) -> None:
    """``show``, run.json, result.json and the HTML report state one order, the same cuts and the same delays."""
    values = [w for k, v in SHORT.items() for w in ("--set", f"{k}={v}")]
    code, out, _ = command("show", NAME, "--json")
    assert code == 0
    shown = json.loads(out)
    assert shown["order"][0] == "site" and set(shown["order"]) == set(load().slots)
    assert shown["cuts"] and shown["delays"]
    code, text, _ = command("show", NAME)
    assert code == 0
    wires = [f"{a}.{x} -> {b}.{y}" for a, x, b, y in parse_wires(load().wires)]
    delayed = [w for w in wires if any(line.strip().startswith(w) and "one step delay" in line
                                       for line in text.splitlines())]  # fmt: skip
    assert delayed == [w for w in wires if w in shown["delays"]]
    # a cut wire runs against the execution order, all others with it
    place = {slot: k for k, slot in enumerate(shown["order"])}
    for w in wires:
        source, target = (end.split(".")[0] for end in w.split(" -> "))
        assert (place[source] >= place[target]) == (w in delayed), w

    code, _, err = command("run", NAME, *values, "--out", tmp_path, pages=True)
    assert code == 0, err
    recorded = json.loads((tmp_path / "run.json").read_text("utf-8"))
    reported = json.loads((tmp_path / "result.json").read_text("utf-8"))["provenance"]
    for key in ("order", "cuts", "delays"):
        assert shown[key] == recorded[key] == reported[key]
    page = (tmp_path / "report.html").read_text("utf-8").replace("&gt;", ">").replace("&#8594;", "→")
    for w in delayed:
        assert w in page or w.replace("->", "→") in page, w


def test_gyro_sees_gravity_and_earth_rate_before_the_first_step(session: Session) -> None:
    """Phase 1 is static 3, at angle 0: input axis east, output axis up.  So f = (0, g, 0) and the Earth rate has
    only the parts W sin(phi) along O and -W cos(phi) along S = E x U = -N.  Without propagation both would be 0
    and the table's face the unit matrix.
    """
    system = load().with_values({"latitude": np.radians(30.0), **quiet(load())})
    starts, _, _ = resolve(session.assembly, system, 1, session.base)
    program, instances = session.program, session.instances
    program.out[:] = 0.0
    try:
        for slot in program.order:
            instances[slot].instantiate()
            instances[slot].set_start(starts[slot])
        initialize(program, instances, 0.0)
        first = initial_state(program, instances, 0.0)
        reference = {v.name: v.valueReference for v in session.assembly.descriptions["gyro"].modelVariables}
        names = [f"{x}[{k}]" for x in ("f", "omega") for k in (1, 2, 3)]
        seen: Any = instances["gyro"].fmu.getReal([reference[n] for n in names])  # type: ignore[attr-defined]
    finally:
        for instance in instances.values():
            instance.free()
    assert first.k == 0
    g, W = frames.normal_gravity(np.radians(30.0)), frames.EARTH_RATE
    np.testing.assert_allclose(seen[:3], [0.0, g, 0.0], rtol=0, atol=4e-15)
    np.testing.assert_allclose(seen[3:], [0.0, W / 2.0, -W * np.sqrt(3.0) / 2.0], rtol=0, atol=1e-19)


@pytest.mark.parametrize("engine", ["native", "reference"])
@pytest.mark.long
def test_first_row_of_the_channels_is_the_settled_start(engine: str) -> None:
    """The drift recorded at t = 0 is that of the first attitude: D_F + D_O (-g/g0), with f not yet seen it would be
    D_F alone.
    """
    values = gyro(np.random.default_rng(5))
    record = run(NAME, values={**quiet(load()), **HASTY, **values}, engine=engine)
    phi = load()["latitude"]
    expected = drift_in("static 3", values, phi, frames.normal_gravity(phi))
    hand = values["gyro.D_F"] - values["gyro.D_O"] * frames.normal_gravity(phi) / frames.G0
    assert expected == pytest.approx(hand, rel=1e-12)
    assert record.channels["time"][0] == 0.0
    assert record.channels["gyro.drift"][0] == pytest.approx(hand, rel=1e-12)
    assert abs(hand - values["gyro.D_F"]) > 0.4 * DPH


@pytest.mark.long
def test_halving_the_step_changes_nothing_that_matters(command: Command, tmp_path: Path) -> None:
    """Far below a tenth of u: exchanging u and i every 1 ms or 0.5 ms only moves the fast poles of the loop; the
    coefficients (tumbling.lag) do not depend on the step to that order.  The report says by how much.
    """
    values = [w for k, v in SHORT.items() for w in ("--set", f"{k}={v}")]
    code, out, err = command("run", NAME, *values, "--check-step", "--out", tmp_path)
    assert code == 0, err
    result = json.loads((tmp_path / "result.json").read_text("utf-8"))
    check = result["step_check"]
    assert check["step"] == 1e-3
    assert [r["name"] for r in check["rows"]] == [c["name"] for c in result["coefficients"]]
    for row in check["rows"]:
        assert row["u"] > 1e-4  # deg/h per g^n: noise is on
        assert row["ratio"] == abs(row["change"]) / row["u"] < 1e-3, row
    assert check["worst"] == max(r["ratio"] for r in check["rows"])
    assert "the effect of the communication step is in u, at most" in out
    lines = {b["coefficient"]: b["contribution"] for b in result["budget"] if b["source"] == "coupling step"}
    assert lines == {r["name"]: pytest.approx(abs(r["change"]) / 3**0.5) for r in check["rows"]}
