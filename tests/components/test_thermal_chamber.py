"""thermal_chamber against an integration of its equations by scipy.  [IMU-THERMAL]"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from wired import Native

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

#: start, (target, rate K/s, soak s): corners at whole seconds: 100, 150, 350, 400 s
PROGRAM = (5.0, [(25.0, 0.2, 50.0), (-15.0, 0.2, 50.0)])


def program(t: Any) -> Any:
    return np.interp(t, [0.0, 100.0, 150.0, 350.0, 400.0], [5.0, 25.0, 25.0, -15.0, -15.0])


def chamber(**more: Any) -> Any:
    start, segments = PROGRAM
    padded = [*segments, *[(0.0, 0.1, 0.0)] * 14]
    targets, ramps, soaks = ([s[k] for s in padded] for k in range(3))
    return Native("thermal_chamber", start_at=start, segments=2, targets=targets, ramps=ramps, soaks=soaks, **more)


@pytest.mark.parametrize(("lag", "tau"), [(20.0, 70.0), (40.0, 40.0), (60.0, 10.0)])
def test_air_and_instrument_follow(lag: float, tau: float) -> None:
    part = chamber(lag=lag, tau=tau, share=[0.1, -0.2, 0.0])
    part.initialize()
    got = []
    for k in range(450):
        part.do_step(float(k), 1.0)
        got.append((part.program, part.room, part.temperature, *part.dT))

    def slopes(t: float, x: Any) -> Any:
        return [(program(t) - x[0]) / lag, (x[0] - x[1]) / tau]

    truth = []
    x = np.array([5.0, 5.0])
    for k in range(450):  # second by second: the program is linear within each
        x = solve_ivp(slopes, (k, k + 1.0), x, rtol=1e-11, atol=1e-12).y[:, -1]
        truth.append([program(k + 1.0), *x, 0.1 * (x[0] - x[1]), -0.2 * (x[0] - x[1]), 0.0])
    # what is read after the step k is that of its end, or of the step before where a part samples first
    late = min((0, 1), key=lambda n: np.abs(np.array(got)[n:, 0] - np.array(truth)[: 450 - n, 0]).max())
    assert np.abs(np.array(got)[late:] - np.array(truth)[: 450 - late]).max() < 1e-8


def test_end_of_the_program_is_told() -> None:
    part = chamber()
    part.initialize()
    for k in range(420):
        part.do_step(float(k), 1.0)
        assert part.finished == (1.0 if k > 401 else part.finished)
    assert part.finished == 1.0 and part.program == -15.0


def test_a_ramp_of_no_rate_is_refused() -> None:
    with pytest.raises(ComponentError, match="a segment that changes needs one"):
        load_part("thermal_chamber")(ramps=[0.0] * 16).initialize()
