"""A two-axis table that the torquers of its gyro keep level: composite drift of each mount, refusals, a record."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from servoing_two_axes import DPH, NAME, QUIET, geometry, gyro

from gyrobench import frames
from gyrobench.engine.session import Session
from gyrobench.system.system import InvalidConfigurationError, load_system

SHORT: dict[str, Any] = {**QUIET, "levelled": True, "mounts": "1 2 8", "time": 24.0, "window": 2.0, "settle": 90.0}


@pytest.fixture(scope="module")
def session() -> Iterator[Session]:
    system = load_system(NAME)
    system.set("levelled", True)
    with Session(system) as prepared:
        yield prepared


@pytest.fixture(scope="module")
def run(session: Session) -> tuple[dict[str, Any], Any]:
    """A random gyro with torquers of its own, at a random latitude."""
    rng = np.random.default_rng(8)
    latitude = float(math.radians(rng.uniform(20.0, 70.0)))
    values = {**SHORT, **gyro(rng), "latitude": latitude, "gyro.k_x": 0.07, "gyro.k_y": 0.09, "u_scale_factor": 1e-3}
    return values, session.run(values)


def test_drift_of_each_mount_by_hand(run: tuple[dict[str, Any], Any]) -> None:
    """(X, Y, Z) = -f/g0 is -g/g0 along the axis that points up: mount 1 is Z, 2 is Y, 8 is X.  What is left, 2e-4 of
    the g terms, is the angle at which the table comes to rest: omega_d / (0.1 1/s), up to 10 arcsec.
    """
    values, record = run
    g = frames.normal_gravity(values["latitude"], 0.0) / frames.G0
    D = {n.removeprefix("gyro."): v / DPH for n, v in values.items() if n.startswith("gyro.D")}
    x, y = (lambda n: D.get(f"Dx_{n}", 0.0)), (lambda n: D.get(f"Dy_{n}", 0.0))
    expected = {
        "ω_dx_1": x(0) - g * x("z") + g * g * x("zz"), "ω_dy_1": y(0) - g * y("z") + g * g * y("zz"),
        "ω_dx_2": x(0) - g * x("y"), "ω_dy_2": y(0) - g * y("y") + g * g * y("yy"),
        "ω_dx_8": x(0) - g * x("x") + g * g * x("xx"), "ω_dy_8": y(0) - g * y("x"),
    }  # fmt: skip
    result = load_system(NAME).reduce(record)
    assert {c.name for c in result.coefficients} == set(expected)
    for c in result.coefficients:
        assert c.estimate == pytest.approx(expected[c.name], abs=2e-4), c.name
        assert c.estimate == pytest.approx(c.truth, abs=1e-6), c.name  # of the angles that are left
        assert c.closed == pytest.approx(c.estimate, abs=1e-6)


def test_torquers_take_the_earth_out(run: tuple[dict[str, Any], Any]) -> None:
    """Both angles stay within 1 arcmin where the Earth alone would turn them by up to 28 arcmin; the rate by the
    torquers is that of the Earth less the drift, and the scale factor costs 1e-3 of it.
    """
    values, record = run
    result = load_system(NAME).reduce(record)
    table = next(t for t in result.tables if t.id == "mounts")
    found = {c.name: c for c in result.coefficients}
    for row in table.rows:
        mount = int(row[0].split()[1])
        earth = geometry.base(mount, values["latitude"]) @ frames.earth_rate_local(
            values["latitude"], frames.EARTH_RATE
        )
        assert max(abs(row[4]), abs(row[5])) < 60.0
        for k, c in enumerate("xy"):
            by_torquer = earth[k] / DPH - found[f"ω_d{c}_{mount}"].estimate
            assert row[6 + k] == pytest.approx(by_torquer, abs=0.05 * abs(found[f"ω_d{c}_{mount}"].estimate) + 1e-3)
            name = f"torquer.{'y' if c == 'x' else 'x'}.scale_factor"
            line = next(b for b in result.budget if b.id == name and b.coefficient == f"ω_d{c}_{mount}")
            assert line.contribution == pytest.approx(1e-3 * abs(row[6 + k]), rel=2e-3, abs=1e-9)


def test_a_scale_factor_that_is_wrong(session: Session, run: tuple[dict[str, Any], Any]) -> None:
    """Stated 1e-3 too large: the drift comes out too small by 1e-3 of the torquer's rate."""
    _, record = run
    off = load_system(NAME).reduce(record.__class__(record.windows, {}, record.run.replace(
        options={**record.run.options, "k_y": 0.09 * 1.001})))  # fmt: skip
    plain = load_system(NAME).reduce(record)
    rate = {f"ω_dx_{row[0].split()[1]}": row[6] for t in plain.tables if t.id == "mounts" for row in t.rows}
    for a, b in zip(plain.coefficients, off.coefficients, strict=True):
        assert b.estimate - a.estimate == pytest.approx(-1e-3 * rate.get(a.name, 0.0), abs=1e-6)


def test_refusals(session: Session) -> None:
    for more, said in (
        ({"cage_x.i_max": 1e-4, "mounts": "3"}, "leaves no room"),
        ({"window": 20.0}, "too few windows"),
        ({"mounts": "13"}, "numbers 1 to 12"),
    ):
        with pytest.raises(InvalidConfigurationError, match=said):
            session.run({**SHORT, **more})


@pytest.mark.long
def test_a_laboratory(run: tuple[dict[str, Any], Any], tmp_path: Path, command: Command) -> None:
    values, record = run
    w, plan = record.windows, {row.phase: row.label for row in record.run.plan if row.mode == "servo"}
    names = (
        "phase",
        "t_start",
        "t_end",
        "outer_start",
        "outer_end",
        "inner_start",
        "inner_end",
        "current_x",
        "current_y",
    )
    head = ["# latitude = {!r} rad".format(values["latitude"]), "# type_b = none", "# nuisances = none"]
    head += [f"# phase {p} = {label}" for p, label in plan.items()]
    units = "phase,t_start [s],t_end [s],outer_start [rad],outer_end [rad],inner_start [rad],inner_end [rad]"
    rows = [",".join(repr(float(w[n][k])) for n in names) for k in range(len(w["phase"])) if int(w["phase"][k]) in plan]

    def reduce(*extra: str) -> tuple[int, str, str]:
        text = "\n".join([*head, *extra, f"{units},current_x [A],current_y [A]", *rows]) + "\n"
        (tmp_path / "lab.csv").write_text(text, encoding="utf-8")
        return command("reduce", NAME, "--data", tmp_path / "lab.csv", "--out", tmp_path / "out", "--force")

    torquers = ("# k_x = 0.07 rad/s/A", "# k_y = 0.09 rad/s/A")
    code, _, err = reduce(*torquers)
    assert code == 2 and "state levelled = true" in err
    code, _, err = reduce("# levelled = true")
    assert code == 2 and "k_y, k_x unknown" in err
    code, _, err = reduce("# levelled = true", *torquers)
    assert code == 0, err
    found = json.loads((tmp_path / "out" / "result.json").read_text("utf-8"))["coefficients"]
    for c, expected in zip(found, load_system(NAME).reduce(record).coefficients, strict=True):
        assert c["estimate"] == pytest.approx(expected.estimate, abs=1e-9), c["name"]
