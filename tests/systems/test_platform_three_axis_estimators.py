"""Estimators on the three axes of a platform: three instances, one behind each gyro, on request."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gyrobench.engine.session import Session
from gyrobench.reduction.loops import margins
from gyrobench.system.system import load_system

pytestmark = pytest.mark.long

NAME = "platform_three_axis"
SHORT = {"sweeps": False, "hold": 5.0, "swing": 0.0}
AXES = ("pitch", "roll", "azimuth")


def ride(part: str = "", axes: str = "xyz", **values: Any) -> Any:
    system = load_system(NAME)
    parts = {f"estimator_{a}": part for a in axes} if part else {}
    for slot in parts:
        system.request(slot)
    with Session(system, parts) as session:
        return session.run({**SHORT, **values}, seed=4)


@pytest.fixture(scope="module")
def plain() -> Any:
    return ride()


@pytest.fixture(scope="module")
def filtered() -> Any:
    return ride("estimator_kalman_rate")


def test_no_estimator_in_the_three_slots_is_no_slot(plain: Any) -> None:
    """Bit for bit: the wires from the gyros to the decoupler go through them."""
    through = ride("estimator_none")
    assert all((through.channels[n] == x).all() for n, x in plain.channels.items())
    for k, axis in enumerate("xyz", 1):
        assert (through.channels[f"estimator_{axis}.estimate"] == through.channels[f"gyro_{axis}.u"]).all(), k


def test_kalman_filters_quieten_all_three_motors(plain: Any, filtered: Any) -> None:
    """Five times the crossover wide: the noise of the motor voltages at rest falls by more than five, the steps of the
    loads stay as large.
    """
    rest = plain.channels["time"] > plain.channels["time"][-1] - 5.0
    for k, axis in enumerate(AXES, 1):
        before, after = (np.std(r.channels[f"{axis}.v"][rest]) for r in (plain, filtered))
        assert after < before / 5.0, axis
        angle = f"platform.attitude[{k}]"
        moved, now = (float(np.abs(r.channels[angle]).max()) for r in (plain, filtered))
        assert now == pytest.approx(moved, rel=0.05)
    p = filtered.run.parameters
    assert p["estimator_y.Ts"] == 1e-4 and p["estimator_y.R"] == pytest.approx(p["gyro_y.pickoff"] ** 2 / 1e-4)


def test_one_axis_alone(plain: Any) -> None:
    """Asked for on y.  T2 at an azimuth of 30 degrees gives x and y to pitch and roll in the shares cos, sin: with y
    quiet cos 30 = 0.866 and sin 30 = 0.5 of their noise are left (and a little of y); azimuth has z alone.
    """
    one = ride("estimator_kalman_robust", "y")
    assert not [n for n in one.run.parameters if n.startswith(("estimator_x", "estimator_z"))]
    rest = plain.channels["time"] > plain.channels["time"][-1] - 5.0
    ratio = [np.std(one.channels[f"{a}.v"][rest]) / np.std(plain.channels[f"{a}.v"][rest]) for a in AXES]
    assert ratio == pytest.approx([0.866, 0.5, 1.0], abs=0.03)


def test_phase_that_the_filters_cost(plain: Any, filtered: Any) -> None:
    """Steady filter of value and slope, w = 5 wc: (sqrt2 w s + w2)/(s2 + sqrt2 w s + w2) at s = j wc, i.e. x = 1/5:

        atan(sqrt2 x) - atan(sqrt2 x/(1 - x2)) = 15.79 - 16.42 = -0.63 degrees, gain (1 + 2 x2)/|...| = 1.038

    so the loop crosses some 4 % higher, where its own phase differs a little: margins within 0.5 degrees of -0.63.
    """
    span, found = margins.grid(1.0, 100.0), []
    for record in (plain, filtered):
        models = [record.run.linear.loops[axis].discrete for axis in AXES]
        one = [margins.margins(span, margins.model_response(model, span)[:, 0, 0]) for model in models]
        found.append([(m.phase, m.crossover) for m in one])
    for before, after in zip(*found, strict=True):
        assert after[0] - before[0] == pytest.approx(-0.63, abs=0.5)
        assert after[1] / before[1] == pytest.approx(1.037, abs=0.01)
