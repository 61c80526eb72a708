"""Another maker's platform in the slot: a C FMU with its own names and units, mapped by a file, beside ours."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from gimballed import DEG, STILL, measures

from gyrobench.engine.run_errors import RunError
from gyrobench.engine.session import Session

Foreign = Callable[[str], Path]
NAME = "platform_three_gimbal"
MAPPING = Path(__file__).parents[1] / "foreign" / "vendor_platform.toml"
#: the same truth in both, given in SI; a lag of 4 ms lets the integrators differ
SAME = {
    **STILL, "roll": 60 * DEG, "azimuth": 0.4, "hold": 2.0,
    "platform.rate_gain": 0.8, "platform.lag": 4e-3, "platform.drag": 150.0, "platform.rate_max": 4.0,
}  # fmt: skip


@pytest.fixture(scope="module")
def both(foreign: Foreign) -> dict[str, tuple[Any, Any, Any]]:
    """Record, result, and the record with half the step."""
    found = {}
    for kind in ("ours", "vendor"):
        parts = {"platform": foreign("vendor_platform")} if kind == "vendor" else {}
        maps = {"platform": MAPPING} if kind == "vendor" else {}
        with Session(NAME, parts, maps) as s:
            record = s.run(SAME, seed=2)
            found[kind] = (record, s.system.with_values(SAME).reduce(record), s.run(SAME, seed=2, step=2.5e-4))
    return found


def apart(both: Any, name: str, record: int = 0) -> float:
    ours, theirs = (both[k][record].channels for k in ("ours", "vendor"))
    return float(np.max([np.abs(theirs[f"{name}[{k}]"] - ours[f"{name}[{k}]"]) for k in (1, 2, 3)]))


@pytest.mark.long
def test_the_vendors_platform_does_what_ours_does(both: Any) -> None:
    """The same plan on both, the whole run: they differ by what the integration explains, and by that.

    The vendor's servos are exact; ours are RK4, whose last stage, where the rates are read, has 1 - x + x2/2 - x3/4 for
    exp(-x), x = h / lag = 1/8: x3/12 + x4/24 of what a step changes, and 50 N.m change the rate by 50/150 rad/s; it
    dies away with the lag, and up to 4 steps lie between the step and the next sample.  The angles differ by less than
    1e-6 rad in 1 rad, by the midpoint rule and a delay of that rate: with h2.
    """
    ours, theirs = (both[k][0].channels for k in ("ours", "vendor"))
    assert theirs["time"] == pytest.approx(ours["time"])
    at_once = (1.0 / 8**3 / 12 + 1.0 / 8**4 / 24) / 3.0
    assert math.exp(-4.0 / 8.0) * at_once < apart(both, "platform.theta_dot") < 1.02 * at_once
    assert apart(both, "platform.theta_dot", 2) < apart(both, "platform.theta_dot") / 5.0
    for name in ("platform.theta", "platform.attitude"):
        assert apart(both, name) < 1e-6
        assert apart(both, name) / apart(both, name, 2) == pytest.approx(4.0, rel=0.1)
    assert np.ptp(ours["platform.theta[2]"]) > 1.0 and np.ptp(ours["platform.attitude[2]"]) > 0.01
    for name in ("gyro_b.u_x", "pitch.e", "roll.e", "azimuth.e"):
        assert np.max(np.abs(theirs[name] - ours[name])) < 2e-6 < 1e-4 * np.ptp(ours[name])  # V
    assert np.array_equal(theirs["platform.lock"], ours["platform.lock"])


def test_a_platform_that_takes_no_acceleration_of_the_base_fits(foreign: Foreign, tmp_path: Path) -> None:
    """The mapping without alpha_b: the rest is wired."""
    mapping = tmp_path / "vendor.toml"
    head, rest = MAPPING.read_text(encoding="utf-8").split("[alpha_b]")
    mapping.write_text(head + "[f_b]" + rest.split("[f_b]")[1], encoding="utf-8")
    with Session(NAME, {"platform": foreign("vendor_platform")}, {"platform": mapping}) as s:
        wired = {c.input.variable for c in s.assembly.connections if c.target == "platform"}
        assert {"BASE_X", "LOAD_Z"} <= wired and not wired & {"BACC_X", "BACC_Y", "BACC_Z"}


@pytest.mark.long
def test_measures_of_the_vendors_platform(both: Any) -> None:
    """The channels follow rate_gain: stiffness drag feedback = 150 40 = 6000 N.m/rad.  There is no linear model of the
    vendor's, which is said, and margins without it."""
    ours, theirs = (both[k][1] for k in ("ours", "vendor"))
    a, b = measures(ours), measures(theirs)
    for axis in ("pitch", "roll", "azimuth"):
        assert b[f"S {axis}"] == pytest.approx(6000.0, rel=1.5e-3)  # the gyros are out of true by 9e-4
        assert b[f"S {axis}"] == pytest.approx(a[f"S {axis}"], rel=1e-6)
        assert b[f"f_c {axis}"] == pytest.approx(a[f"f_c {axis}"], rel=1e-3)
        assert b[f"PM {axis}"] == pytest.approx(a[f"PM {axis}"], abs=0.1)
    assert b["rate gain"] == pytest.approx(1.0001, rel=1e-5)
    assert "No linear model for comparison: the FMU in slot platform" in theirs.warnings[-1]
    assert not any("No linear model" in w for w in ours.warnings)
    assert theirs.provenance["parts"]["platform"]["name"] == "Vendor TGP-3"


def test_gimbal_lock_of_the_vendors_platform(foreign: Foreign) -> None:
    """It knows no allow_lock: it refuses, and its own words arrive."""
    with (
        Session(NAME, {"platform": foreign("vendor_platform")}, {"platform": MAPPING}) as s,
        pytest.raises(RunError, match=r"gimbal lock at -89\.9\d+ deg of roll"),
    ):
        s.run({**STILL, "hold": 1.0})


def test_without_its_mapping_every_missing_connector_is_named(
    command: Command, foreign: Foreign, tmp_path: Path
) -> None:
    code, out, err = command("run", NAME, "--part", f"platform={foreign('vendor_platform')}", "--out", tmp_path / "run")
    assert code == 2 and out == ""
    for connector in ("v", "M_load", "omega_b", "theta", "omega", "attitude", "lock"):
        assert f"'{connector}" in err, connector
    for offered in ("CMD_PITCH", "ANG_ROLL", "RATE_AZ"):
        assert offered in err
    assert not (tmp_path / "run").exists()
