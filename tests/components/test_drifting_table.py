"""Table that the drift of its gyro turns: statistics of drift and angle, torquer, records.  [COMP-RANDOM-DRIFT]"""

from __future__ import annotations

import math

import numpy as np
import pytest
from native_parts import make

DPH = ARCSEC = math.pi / 648000.0
RMS, TAU = 0.01 * DPH, 3600.0


def played(n, outputs, h=10.0, **given):
    one = make("drifting_table", "native")
    try:
        one.set({k: float(v) for k, v in given.items()})
        one.initialize(0.0)
        rows = []
        for k in range(n):
            one.step(k * h, h)
            rows.append(one.get(outputs))
        return np.array(rows)
    finally:
        one.free()


@pytest.mark.parametrize("step", [0.2, 2.0])
def test_drift_and_free_angle_as_the_theory_has_them(step):
    """rms; angle after T: rms sqrt(2 tau (T - tau (1 - exp(-T/tau)))), 114 arcsec after 6 h; at two steps."""
    T, n = 3600.0, 80
    got = played(360 * n, ["M", "theta_free", "restart"], reading=0.0, length=T, step=step, lag=5.0)
    assert np.flatnonzero(got[:, 2]).tolist() == list(range(359, 360 * n, 360))
    u = math.sqrt(TAU / (360 * n * 10.0))  # relative, of the rms of a drift with correlation time tau
    assert np.sqrt(np.mean(got[:, 0] ** 2)) == pytest.approx(RMS, rel=4.0 * u)
    last = got[358::360, 1]  # one step before the restart
    theory = RMS * math.sqrt(2.0 * TAU * (T - TAU * (1.0 - math.exp(-T / TAU))))
    assert np.sqrt(np.mean(last**2)) == pytest.approx(theory, rel=4.0 * math.sqrt(1.5 / (2.0 * n)))
    six = 21600.0
    assert RMS * math.sqrt(2.0 * TAU * (six - TAU * (1.0 - math.exp(-6.0)))) / ARCSEC == pytest.approx(114.0, abs=0.5)


def test_torquer_and_lag():
    """Without drift: alpha = k (1 + k_error) i t, theta = alpha less rate * lag (1 - exp(-t/lag))."""
    k = 17.2e3 * DPH
    one = make("drifting_table", "native")
    one.set({"drift": 0.0, "reading": 0.0, "k_error": 0.02, "lag": 4.0, "i": 1e-6})
    one.initialize(0.0)
    for n in range(3):
        one.step(10.0 * n, 10.0)
    alpha, theta, free = one.get(["alpha", "theta", "theta_free"])
    one.free()
    rate = k * 1.02e-6
    assert alpha == pytest.approx(rate * 30.0, rel=1e-12)
    assert theta == pytest.approx(rate * (30.0 - 4.0 * (1.0 - math.exp(-7.5))), rel=1e-12)
    assert free == 0.0


def test_reading_in_quanta_with_its_noise():
    got = played(4000, ["theta_read", "theta"], reading=2.0 * ARCSEC, quantum=1.0 * ARCSEC, length=1e6)
    assert np.allclose(np.round(got[:, 0] / ARCSEC), got[:, 0] / ARCSEC, atol=1e-9)
    # variance 4 + 1/12 arcsec2, standard error of it 2.2 %
    assert np.var((got[:, 0] - got[:, 1]) / ARCSEC) == pytest.approx(4.0 + 1.0 / 12.0, rel=0.08)
