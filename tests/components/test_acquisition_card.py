"""The acquisition card against closed forms: RC step, codes, sampling, the figures of Xia 2008."""

from __future__ import annotations

import math
from functools import partial

import pytest
from wired import BENCH, begun

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

H = 1e-4


started = partial(begun, "acquisition_card")


def test_the_quantum_of_the_source():
    """14 bits over +-5 V are 10 V / 2^14 = 0.610 mV; Xia 2008 prints 0.6 mV."""
    part = started(f_c=0.0)
    for k, (z, codes) in enumerate(
        ((3.04e-4, 0), (3.06e-4, 1), (-3.06e-4, -1), (0.01, 16), (9.0, 8191), (-9.0, -8192))
    ):
        part.z = z
        part.do_step(k * H, H)
        assert part.estimate == codes * 10.0 / 2**14
        assert part.overload == (1.0 if abs(z) > 5.0 else 0.0)


@pytest.mark.parametrize("gain", [1.0, 2.5])
def test_rc_step(gain):
    """A step of 0.8 behind 720 Hz: 0.8 (1 - exp(-2 pi 720 t)), to half a code, of which the gain makes less."""
    part = started(gain=gain, bits=24)
    part.z = 0.8
    for k in range(12):
        part.do_step(k * H, H)
        true = 0.8 * (1.0 - math.exp(-2.0 * math.pi * 720.0 * (k + 1) * H))
        assert part.estimate == pytest.approx(true, abs=0.51 * 5.0 / 2**23 / gain)
    assert part.latency == pytest.approx(1.0 / (2.0 * math.pi * 720.0), rel=1e-12)


def test_samples_are_held_for_a_period():
    part = started(f_c=0.0, period=4 * H, bits=32)
    seen = []
    for k in range(10):
        part.z = k + 1.0
        part.do_step(k * H, H)
        seen.append(round(part.estimate))
    assert seen == [0, 0, 0, 4, 4, 4, 4, 5, 5, 5]  # limited to 5 V
    assert part.latency == pytest.approx(2 * H)


def test_refused():
    part = load_part("acquisition_card", BENCH)(period=2.5e-4)
    part.initialize()
    with pytest.raises(ComponentError, match="not a multiple"):
        part.do_step(0.0, 1e-4)
