"""Error budget of the three-axis platform: each source against a run in which it is switched off, or alone."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gyrobench.engine.session import Session, run
from gyrobench.system.loop_plan import LoopPhase
from gyrobench.system.system import load_system

pytestmark = pytest.mark.long

GYROS = ("gyro_x", "gyro_y", "gyro_z")
TERMS = ("D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS", "white", "markov", "pickoff")
IDEAL = {f"{g}.{n}": 0.0 for g in GYROS for n in TERMS}
AXES = (1, 2, 3)
DRY = {f"platform.friction[{k}]": 0.02 for k in AXES} | {"platform.presliding": 5e-4}
BASE_Y, BASE_Z, COMMAND = "base about y, 0.7 Hz", "base about z, 0.9 Hz", "command about z, 1 Hz"


def ridden(*phases: LoopPhase, wires: str = "", **values: Any) -> tuple[Any, dict[tuple[str, str], Any]]:
    """Result, and (motion, source) -> row of the budget, of these phases without noise of the gyros."""
    (found,) = each(1, *phases, wires=wires, **values)
    return found


def each(runs: int, *phases: LoopPhase, wires: str = "", **values: Any) -> list[tuple[Any, dict[tuple[str, str], Any]]]:
    """The same of runs with the seeds 1, 2, ..."""
    system: Any = load_system("platform_three_axis")
    system.phases = lambda: list(phases)
    if wires:
        system.wires = wires
    with Session(system) as session:
        results = [system.reduce(session.run({**IDEAL, **values}, seed=seed)) for seed in range(1, runs + 1)]
    return [(r, {(x[0], x[1]): x[2:] for t in r.tables if t.kind == "budget.sources" for x in t.rows}) for r in results]


def swing(axis: int, f: float, size: float = 0.08) -> LoopPhase:
    return LoopPhase(f"base {axis}", "motion", "sine", axis, size, f, settle=5.0, dwell=4.0 / f)


COMMANDED = LoopPhase("command z", "command", "sine", 3, 0.3, 1.0, settle=5.0, dwell=4.0)


@pytest.fixture(scope="module")
def whole() -> tuple[Any, dict[tuple[str, str], Any]]:
    return ridden(swing(2, 0.7), swing(3, 0.9), COMMANDED, **DRY)


def test_shares_add_up_and_the_whole_is_what_was_measured(whole: Any) -> None:
    result, rows = whole
    for motion in (BASE_Y, BASE_Z, COMMAND):
        share = [r[1] for (name, _), r in rows.items() if name == motion and r[1] is not None]
        assert sum(share) == pytest.approx(100.0, abs=1e-6)
        assert rows[motion, "measured"][0] == pytest.approx(rows[motion, "together"][0], rel=0.1)
    assert {s for m, s in rows if m == BASE_Y} >= {"viscous friction", "dry friction"}
    assert any("carried over by reaction of the gimbals" in s for s in result.summary)


@pytest.mark.parametrize(("source", "name"), [("viscous friction", "viscous"), ("dry friction", "friction")])
def test_friction_switched_off_takes_its_share(whole: Any, source: str, name: str) -> None:
    """What the budget says would be left is what a run without the source measures."""
    _, rows = whole
    _, less = ridden(swing(2, 0.7), **{**DRY, **{f"platform.{name}[{k}]": 0.0 for k in AXES}})
    measured = less[BASE_Y, "measured"][0]
    assert measured == pytest.approx(rows[BASE_Y, source][2], rel=0.1)
    assert rows[BASE_Y, "measured"][0] > 1.3 * measured


def test_reaction_of_the_gimbals_alone(whole: Any) -> None:
    """Without friction it is all that is left of the base about z: tan(pitch) (I_ry + I_fz) heading'' about roll."""
    _, rows = whole
    _, less = ridden(swing(3, 0.9), **{f"platform.viscous[{k}]": 0.0 for k in AXES})
    assert less[BASE_Z, "measured"][0] == pytest.approx(rows[BASE_Z, "reaction of the gimbals"][0], rel=0.1)


def test_output_axes_switched_off_take_their_share() -> None:
    """Gyros that do not get the angular acceleration have no output-axis coupling; bearings without friction."""
    free = {f"platform.viscous[{k}]": 0.0 for k in AXES}
    result, rows = ridden(COMMANDED, **free)
    wires = load_system("platform_three_axis").wires
    _, less = ridden(COMMANDED, wires=re.sub(r"(platform -> gyro_.: omega) alpha f", r"\1 f", wires), **free)
    measured = less[COMMAND, "measured"][0]
    assert measured == pytest.approx(rows[COMMAND, "output axes of the gyros"][2], rel=0.1)
    assert rows[COMMAND, "measured"][0] > 1.5 * measured
    assert any("the most of all, by output axes of the gyros" in s for s in result.summary)


@pytest.mark.parametrize(
    ("source", "noise", "seeds", "scatter"),
    [("white drift of the gyros", "white", 6, 0.16), ("noise of the pickoffs", "pickoff", 1, 0.1)],
)
def test_noise_of_one_source(source: str, noise: str, seeds: int, scatter: float) -> None:
    """A hold of 4 s at rest: the mean square of three axes and six seeds; of a random walk about mean and slope nearly
    all is in a few independent parts an axis, so it scatters by about sqrt(2/(3 6 4)) = 17 %, the rms by 8."""
    values = {f"{g}.{noise}": 2e-6 for g in GYROS}
    found = each(seeds, LoopPhase("drift", "hold", settle=1.0, dwell=4.0), **values)
    squares = [rows["drift", "measured"][0] ** 2 for _, rows in found]
    rows = found[-1][1]
    assert rows["drift", source][0] == pytest.approx((sum(squares) / seeds) ** 0.5, rel=scatter)
    assert rows["drift", source][1] == pytest.approx(100.0)


def test_budget_of_a_recorded_ride(tmp_path: Path) -> None:
    """Three sines an axis that do not close, with dry friction: computed for Hann's window, as measured."""
    t = np.arange(0.0, 31.0, 0.25)
    rng = np.random.default_rng(3)

    def wave(f: float) -> np.ndarray:
        parts = [1.5 / k * np.sin(2.0 * np.pi * f * k * t + rng.uniform(0.0, 6.0)) for k in (1.0, 1.7, 2.3)]
        return np.asarray(np.sum(parts, axis=0) * np.clip(t / 5.0, 0.0, 1.0))

    file = tmp_path / "ride.csv"
    columns = np.column_stack([t, wave(0.13), 2.0 * wave(0.11), wave(0.07)])
    np.savetxt(file, columns, delimiter=",", header="time [s],pitch [deg],roll [deg],heading [deg]", comments="")
    system = load_system("platform_three_axis")
    result = system.reduce(run(system, values={**IDEAL, **DRY, "profile": str(file), "hold": "25s"}, seed=1))
    rows = next(t for t in result.tables if t.kind == "budget.sources").rows
    angle = {r[1]: r[2] for r in rows if r[0] == "ride"}
    assert angle["together"] == pytest.approx(angle["measured"], rel=0.02)
    assert rows[0][1] == "dry friction" and any("carried over by dry friction (" in s for s in result.summary)
