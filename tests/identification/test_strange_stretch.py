"""Records of random excitation that are not of one loop all along, and clean ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from own_loops import PLACES, H, SampledLoop, odd_multisine, random_platform
from scipy import signal

from gyrobench.identification.identify_loop import identify_record
from gyrobench.identification.loop_doubts import CHANGED
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.identification.strange_stretch import STRANGE, is_random, strange_stretch

UNITS = {"excitation": "N.m", "input": "N.m", "output": "rad/s"}
BAND = (1.0, 150.0)  # Hz


def random_record(
    seed: int, noise: float, quiet: bool, samples: int = 30_000
) -> tuple[SampledLoop, LoopRecord, np.ndarray]:
    """Return a loop under random excitation, and the noise of its sensor; quiet: the input is recorded as computed."""
    rng = np.random.default_rng(seed)
    loop = random_platform(rng)
    r = signal.lfilter(*signal.butter(2, 0.3), rng.standard_normal(samples))
    u, y = loop.run(r, PLACES[0], 0.0 * r, 0.0 * r)
    sensor = noise * y.std() * rng.standard_normal(samples)
    u, y = loop.run(r, PLACES[0], 0.0 * r, sensor)
    u = u + (0.0 if quiet else noise) * u.std() * rng.standard_normal(samples)
    return loop, LoopRecord("random", H, r, u, y, PLACES[0], UNITS), sensor


def without(record: LoopRecord, first: int, count: int) -> LoopRecord:
    keep = np.r_[0:first, first + count : record.r.size]
    return replace(record, **{n: getattr(record, n)[keep] for n in ("r", "u", "y")})


@pytest.mark.parametrize("noise", [0.001, 0.1])
def test_a_second_lost_under_random_excitation_is_seen_and_nothing_passes(noise: float) -> None:
    """The controller of the record is exact: its states do not fit at sample 12000, by the samples' times 12 s."""
    _, whole, _ = random_record(8, noise, quiet=True)
    assert not strange_stretch(whole)
    found = identify_record(without(whole, 12_000, 1000), BAND)
    assert any(n.startswith(STRANGE) and "12 s" in n for n in found.notes) and found.dependent == STRANGE


def test_a_second_lost_is_seen_in_an_output_that_stands_above_its_noise() -> None:
    _, whole, _ = random_record(8, 0.01, quiet=False)
    assert not strange_stretch(whole) and "output" in strange_stretch(without(whole, 12_000, 1000))


def test_whole_periods_that_are_missing_are_seen_though_the_excitation_goes_on() -> None:
    rng = np.random.default_rng(3)
    r = np.tile(odd_multisine(2000, rng, *BAND), 12)
    u, y = random_platform(rng).run(r, PLACES[0], 0.1 * rng.standard_normal(r.size), 0.0 * r)
    whole = LoopRecord("periods", H, r, u, y, PLACES[0], UNITS)
    assert not strange_stretch(whole) and strange_stretch(without(whole, 9_000, 4000))


@pytest.mark.long
def test_a_gain_that_changes_in_the_middle_is_seen() -> None:
    """The controller's gain is 1.3 times as large from the middle on: no sample is strange, the halves are."""
    loop, whole, sensor = random_record(8, 0.01, quiet=True)
    other = SampledLoop(loop.b, loop.a, 1.3 * loop.m, loop.n)
    assert other.stable()
    u, y = other.run(whole.r, PLACES[0], 0.0 * whole.r, sensor)
    late = np.arange(whole.r.size) >= whole.r.size // 2
    changed = replace(whole, u=np.where(late, u, whole.u), y=np.where(late, y, whole.y))
    assert any(n.startswith(CHANGED) for n in identify_record(changed, BAND).notes)
    assert not any(n.startswith((CHANGED, STRANGE)) for n in identify_record(whole, BAND).notes)


def test_sweeps_steps_and_sines_are_not_random() -> None:
    """What is left over of them changes along the record: they are not asked."""
    t = np.arange(30_000) * H
    sweep, steps = signal.chirp(t, 1.0, 30.0, 150.0), np.repeat([0.0, 1.0, -1.0], 10_000)
    sines = np.concatenate([np.sin(2.0 * np.pi * f * t[:10_000]) for f in (3.0, 20.0, 80.0)])
    _, whole, _ = random_record(8, 0.1, quiet=True)
    assert is_random(whole) and not any(is_random(replace(whole, r=r)) for r in (sweep, steps, sines))
