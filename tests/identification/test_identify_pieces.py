"""Pieces of identification: distortion against noise, sharp poles, regions of ratios, periods."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from own_loops import PERIOD, PLACES, UNITS, H, margins_of, odd_multisine, random_platform
from scipy import signal

from gyrobench.identification.distortion import distortions, with_distortion
from gyrobench.identification.identify_loop import identify_record
from gyrobench.identification.line_spectrum import LineAmplitudes, find_period, misfit
from gyrobench.identification.loop_curve import _sharp
from gyrobench.identification.loop_record import LoopRecord, read_loop
from gyrobench.identification.ratios import ratio
from gyrobench.record.csv_reader import DataError


# --------------------------------------------------------------------------------------------- pieces
def noise_alone(lines: int, dof: int, rng: np.random.Generator) -> LineAmplitudes:
    """Return lines of nothing but noise, each with a variance of its own degrees of freedom, 1 in the mean."""
    z = (rng.standard_normal((lines, 3)) + 1j * rng.standard_normal((lines, 3))) * np.sqrt(0.5)
    cov = np.zeros((lines, 3, 3), complex)
    cov[:, [0, 1, 2], [0, 1, 2]] = rng.chisquare(2 * dof, (lines, 3)) / (2 * dof)
    return LineAmplitudes(np.arange(1.0, 2.0 * lines + 1.0, 2.0), z, cov, np.full(lines, float(dof)))


def test_noise_is_not_taken_for_distortion() -> None:
    """Ratios of 2 and 2 d degrees of freedom have a mean of d/(d - 1): with many lines noise alone was "nonlinear"."""
    rng, seen = np.random.default_rng(6), 0
    for _ in range(200):
        excited, omitted = noise_alone(300, 12, rng), noise_alone(300, 12, rng)
        strong = replace(excited, z=excited.z + 100.0)
        seen += sum(d.significant for d in distortions(strong, omitted, 1.0))
        wider = with_distortion(strong, omitted, 1.0)
        new, own = (np.einsum("nkk->nk", x.cov).real[:, 1:] for x in (wider, strong))
        assert np.all(np.mean(new / own, axis=1) >= 1.0 - 1e-12)  # of input and output together not below the noise
    assert seen <= 3


def test_a_pole_sharper_than_the_lines_is_not_of_the_loop() -> None:
    """Ten points from -1 to 1, 0.22 apart: a pole among them whose imaginary part is below 0.022 is none of theirs."""
    d = np.linspace(-1.0, 1.0, 10)[None, :]
    for pole, sharp in ((0.1 + 0.01j, True), (0.1 - 0.01j, True), (0.1 + 0.05j, False), (1.5 + 0.01j, False)):
        other = -0.5 + 3.0j
        theta = np.zeros((1, 6), complex)
        theta[0, 4:] = -1.0 / pole - 1.0 / other, 1.0 / (pole * other)  # (1 - d/p1)(1 - d/p2)
        assert _sharp(theta, d)[0] == sharp
    assert not _sharp(np.zeros((1, 6), complex), d)[0]


def test_a_line_that_noise_has_moved_makes_no_resonance() -> None:
    """A record in which a line at 3.25 Hz is 3.6 u off: the disk margin was 1.26 +- 0.09 of a loop with 1.60."""
    rng = np.random.default_rng(71028)
    loop = random_platform(rng)
    r = np.tile(odd_multisine(PERIOD, rng, 1.0, 150.0), 15)
    u, y = loop.run(r, PLACES[0], np.zeros(r.size), np.zeros(r.size))
    torque = signal.lfilter([1.0], [1.0, -0.98], rng.standard_normal(r.size))
    torque *= 0.1 * u.std() / torque.std()
    sensor = 0.1 * y.std() * (rng.standard_normal(r.size) + 0.002 * np.cumsum(rng.standard_normal(r.size)))
    record = LoopRecord("own", H, r, *loop.run(r, PLACES[0], torque, sensor), PLACES[0], UNITS)
    found = identify_record(record, (1.0, 150.0))
    disk = found["disk margin"]
    true = margins_of(loop, found.f[0], found.f[-1])["disk margin"]
    assert abs(disk.value - true) < disk.high - disk.low


def test_the_region_of_a_ratio() -> None:
    """z = (1, 2, 4), var u = 0.02, var y = 0.08, cov = 0: y/u = 2 with var/2 = (0.08 + 4 * 0.02)/2/4 = 0.02.

    u is that of a part, relative: sqrt(0.02)/2.  Fieller with q2: left = 4 - 0.02 q2, centre = 8/left, radius2 =
    centre2 - (16 - 0.08 q2)/left.
    """
    cov = np.zeros((1, 3, 3), complex)
    cov[0, 1, 1], cov[0, 2, 2] = 0.02, 0.08
    lines = LineAmplitudes(np.ones(1), np.array([[1.0, 2.0, 4.0 + 0j]]), cov, np.array([1e9]))
    g = ratio(lines, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    q2 = 1.959964**2 / 2.0
    left = 4.0 - 0.02 * q2
    assert g.value[0] == 2.0
    assert g.u[0] == pytest.approx(np.sqrt(0.02) / 2.0)
    assert g.center[0] == pytest.approx(8.0 / left)
    assert g.radius[0] ** 2 == pytest.approx((8.0 / left) ** 2 - (16.0 - 0.08 * q2) / left, rel=1e-6)
    small = LineAmplitudes(np.ones(1), np.array([[1.0, 0.1, 4.0 + 0j]]), cov, np.array([1e9]))
    assert not ratio(small, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0)).determined[0]


def test_periods_are_found() -> None:
    rng = np.random.default_rng(2)
    r = odd_multisine(1000, rng, 1.0, 100.0)
    assert find_period(np.tile(r, 5)) == 1000
    assert find_period(np.tile(r, 5) + 0.005 * rng.standard_normal(5000)) == 1000
    assert find_period(rng.standard_normal(5000)) == 0
    assert find_period(np.ones(500)) == 0
    t = np.arange(6003) / 1000.3  # a period of 1000.3 samples
    slow = sum(np.sin(2 * np.pi * k * t + k * k) for k in (1, 3, 5, 7, 11))
    assert misfit(slow, 1000) == pytest.approx(0.3, abs=0.02)


@pytest.mark.parametrize(
    ("lines", "advised"),
    [
        (["gimbal 1;;;", "", "time [s];excitation [A];input [A];output [V]", "0;0.1;0.2;0.3"], ["skip = 2", "';'"]),
        (["Zeit,Anregung,Eingang,Ausgang", "0,0.1,0.2,0.3"], ["skip = 0", "','"]),
        (["0,0.1,0.2,0.3"], ["names = false", "from = ITS NUMBER"]),
        (["time [s],excitation [A]", "0,0.1"], []),  # what is missing is in no other layout
    ],
)
def test_a_file_of_another_layout_is_shown_its_map(tmp_path: Path, lines: list[str], advised: list[str]) -> None:
    file = tmp_path / "loop.csv"
    file.write_text("\n".join([*lines[:-1], *(lines[-1].replace("0", f"{k}", 1) for k in range(20))]), encoding="utf-8")
    with pytest.raises(DataError, match=r"column 'input \[unit\]' is missing|numbers, where names") as error:
        read_loop(file)
    said = " ".join(a.shell for a in error.value.advice).replace('"', "'")
    assert bool(said) == bool(advised) and all(words in said for words in advised)
