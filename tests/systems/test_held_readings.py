"""Loops whose reading is held from sample to sample, or rounded: margins as measured, as modelled and by hand."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import pytest

from gyrobench.engine.session import Session
from gyrobench.system.loop_plan import sweep
from gyrobench.system.system import load_system

TONES = (0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 2.0)  # of the crossover


def margins(name: str, crossover: float, loop: str, parts: Mapping[str, str], values: Mapping[str, Any]) -> list[Any]:
    """Return crossover and phase margin of a loop from test sines alone, without noise."""
    system: Any = load_system(name)
    axis = f"loop {loop}" if loop != "stabilizer" else "loop"
    amplitude = 5e-3 if name == "gimbal_stabilization" else 1e-3
    amplitude = 5e-3 if name == "gimbal_stabilization" else 5e-2  # large beside a code
    sines = sweep(axis, "test", [crossover * x for x in TONES], amplitude, axis=1, settle=0.5, periods=20)
    system.phases = lambda: sines
    with Session(system, parts) as session:
        quiet = dict.fromkeys((n for n in system.noises if n.partition(".")[0] in session.assembly.bindings), 0.0)
        result = system.reduce(session.run(quiet | dict(values), seed=1))
    assert not [r.id for r in result.reasons if r.id == "loop.disagrees"]
    key = "" if loop == "stabilizer" else f" {loop}"
    return [result[f"f_c{key}"], result[f"PM{key}"]]


@pytest.mark.long
@pytest.mark.parametrize("period", [1e-3, 5e-3])
def test_gyro_that_gives_a_sample_each_period(period: float) -> None:
    """A reading held for T instead of the step h is (T - h)/2 older: the phase margin falls by 360 deg f (T - h)/2.

    A record each millisecond sees it at ages of 0, h, ... less half a millisecond on average: the crossover was 2.3 %
    too high.  The gain falls by (pi f T)^2/6, 0.6 % for 5 ms; an output word of 20 arcsec/s takes nothing.
    """
    crossover, margin = margins(
        "gimbal_stabilization", 12.0, "pitch", {}, {"gyro.flicker_x": 0.0, "gyro.flicker_y": 0.0}
    )
    f, pm = margins("gimbal_stabilization", 12.0, "pitch", {}, {
        "gyro.flicker_x": 0.0, "gyro.flicker_y": 0.0, "gyro.period": period, "gyro.resolution": 1e-6,
    })  # fmt: skip
    lost = 360.0 * f.estimate * 0.5 * (period - 2e-4)
    assert pm.estimate == pytest.approx(margin.estimate - lost, abs=0.15)
    assert f.estimate == pytest.approx(crossover.estimate * (1.0 - (math.pi * 12.0 * period) ** 2 / 6.0), rel=3e-3)
    assert (f.closed, pm.closed) == (pytest.approx(f.estimate, rel=1e-3), pytest.approx(pm.estimate, abs=0.1))


@pytest.mark.long
@pytest.mark.parametrize("period", [0.0, 2e-3])
def test_card_in_front_of_the_controller(period: float) -> None:
    """The slope of a converter is 0 between two codes: its linear model, through which no loop came back, has none."""
    values = {"estimator.period": period}
    f, pm = margins("platform_single_axis", 10.0, "stabilizer", {"estimator": "acquisition_card"}, values)
    assert f.closed == pytest.approx(f.estimate, rel=2e-3)
    assert pm.closed == pytest.approx(pm.estimate, abs=0.15)
