"""Blocks that are missing in a record whose times go on, and what only looks like it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from own_loops import PLACES, H, odd_multisine, random_platform
from scipy import signal

from gyrobench.identification.identify_loop import identify_record
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.identification.missing_blocks import missing_blocks

UNITS = {"excitation": "N.m", "input": "N.m", "output": "rad/s"}
PERIOD = 4000  # samples


def test_a_block_that_noise_hides_is_in_doubt() -> None:
    """Of a sweep with as much noise as response nothing is seen in the output; the end of a whole sweep is no jump."""
    r = signal.chirp(np.arange(30000) * H, 1.0, 30.0, 150.0, method="logarithmic")
    loop, rng = random_platform(np.random.default_rng(3)), np.random.default_rng(5)
    _, y = loop.run(r, PLACES[0], np.zeros(r.size), np.zeros(r.size))
    u, y = loop.run(r, PLACES[0], 0.0 * r, y.std() * rng.standard_normal(r.size))
    whole = LoopRecord("own", H, r, u, y, PLACES[0], UNITS)
    keep = np.r_[0:9_300, 11_000 : r.size]
    cut = replace(whole, **{n: getattr(whole, n)[keep] for n in ("r", "u", "y")})
    assert missing_blocks(cut) == ([], [9_300]) and missing_blocks(whole) == ([], [])
    assert any("the excitation jumps 9.3 s after the first sample" in n for n in identify_record(cut).notes)


def test_an_excitation_that_jumps_of_itself_has_nothing_missing() -> None:
    """Steps, a sweep that begins late, another multisine: the output does not follow within the sample."""
    rng = np.random.default_rng(4)
    late = np.r_[np.zeros(3000), signal.chirp(np.arange(27000) * H, 1.0, 27.0, 150.0, phi=50.0)]
    two = np.r_[np.tile(odd_multisine(PERIOD, rng, 1.0, 150.0), 4), np.tile(odd_multisine(PERIOD, rng, 1.0, 150.0), 3)]
    for seed, r in enumerate((np.repeat([0.0, 1.0, -1.0, 0.5], 5000), late, two)):
        loop, noise = random_platform(np.random.default_rng(seed)), 1e-3 * rng.standard_normal(r.size)
        assert not missing_blocks(LoopRecord("own", H, r, *loop.run(r, PLACES[0], noise, noise), PLACES[0], UNITS))[0]
