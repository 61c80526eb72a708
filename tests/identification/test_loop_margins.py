"""Margins of curves that are known, with their intervals."""

from __future__ import annotations

import numpy as np
import pytest

from gyrobench.identification.loop_curve import LoopCurve
from gyrobench.identification.loop_margins import margins


def touching(peak: float, u: float) -> LoopCurve:
    """L = (5 Hz / f + bump) e^(-j f / 60 Hz - j pi/2), bump: `peak` - 1/6 at 30 Hz; crosses 1 at 5 Hz."""
    f = np.geomspace(1.0, 100.0, 2000)
    bump = (peak - 1.0 / 6.0) * np.exp(-(((f - 30.0) / 2.0) ** 2))
    L = (5.0 / f + bump) * np.exp(-1j * (f / 60.0 + 0.5 * np.pi))
    S = 1.0 / (1.0 + L)
    of_S = u * np.abs(S * (1.0 - S))  # the same relative u of L everywhere
    known = np.ones(f.size, bool)
    return LoopCurve(f, S, of_S, np.gradient(S, f), np.zeros((60, f.size), complex), known)


@pytest.mark.parametrize(("peak", "sees"), [(1.02, True), (0.97, True), (0.9, False)])
def test_a_peak_that_may_cross_1_is_in_the_intervals(peak: float, sees: bool) -> None:
    """u = 0.02: a peak of 1.02 is above by 1 u and told by none, one of 0.97 below by 1.5 u, one of 0.9 by 5 u.

    At 5 Hz the phase margin is pi/2 - 5/60 = 85 degrees and the delay margin that over 2 pi 5 Hz, 47 ms; at 30 Hz they
    would be pi/2 - 1/2 = 61 degrees and 5.7 ms.
    """
    found, why = margins(touching(peak, 0.02))
    of = {m.name: m for m in found}
    assert of["phase margin"].value == pytest.approx(np.pi / 2.0 - 5.0 / 60.0, rel=1e-3)
    assert of["delay margin"].value == pytest.approx((np.pi / 2.0 - 5.0 / 60.0) / (10.0 * np.pi), rel=1e-3)
    assert ((np.pi / 2.0 - 0.5) in of["phase margin"]) is sees
    assert ((np.pi / 2.0 - 0.5) / (60.0 * np.pi) in of["delay margin"]) is sees
    assert any(w.startswith("about 30 Hz |L| is not told from 1") for w in why) is sees
