"""Physical parameters of a measured plant, multisines, wanted margins, two amplitudes."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from commanding import Command
from own_loops import PLACES, H, margins_of, odd_multisine, random_platform
from scipy import linalg

import gyrobench as gb
from gyrobench.commands.arguments import parse_settings
from gyrobench.identification.amplitude import difference
from gyrobench.identification.identify_loop import identify_record
from gyrobench.identification.loop_margins import Margin
from gyrobench.identification.loop_record import LoopRecord
from gyrobench.identification.plant_fit import fit_plant, parse_fit
from gyrobench.identification.plant_model import PlantModel
from gyrobench.identification.ratios import MeasuredResponse
from gyrobench.identification.wanted_margins import parse_wanted

UNITS = {"excitation": "N.m", "input": "N.m", "output": "rad/s"}
ALL = ["J", "viscous", "delay", "mode", "held"]


def record_of(seed: int, amplitude: float = 1.0, cubic: float = 0.0) -> tuple:
    rng = np.random.default_rng(seed)
    loop, at = random_platform(rng), PLACES[seed % 3]
    r = amplitude * np.tile(odd_multisine(4000, rng, 1.0, 150.0), 8)
    u, y = loop.run(r, at, np.zeros(r.size), np.zeros(r.size))
    torque, sensor = (0.1 / amplitude * x.std() * rng.standard_normal(r.size) for x in (u, y))
    u, y = loop.run(r, at, torque, sensor)
    return loop, LoopRecord("own", H, r, u - cubic * u**3, y, at, UNITS)


@pytest.fixture(scope="module")
def platforms() -> list[tuple]:
    cases = [record_of(seed) for seed in range(10)]
    return [(loop, record, identify_record(record)) for loop, record in cases
            if loop.stable() and margins_of(loop, 1.0, 150.0)["peak S"] < 4.0]  # fmt: skip


# ------------------------------------------------------------------------------------------- parameters
@pytest.mark.long
def test_parameters_of_random_platforms(platforms: list[tuple]) -> None:
    """Truth that the fit does not know: J, friction, delay, mode, of the sampled plant: held by 95 % intervals."""
    z, lacking = [], 0
    for loop, record, found in platforms:
        fit = fit_plant(record, found.responses["P"], ALL)
        lacking += fit.lacks
        z += [(fit.values[n] - v) / fit.u(n) for n, v in loop.truth.items()]
        assert fit.values["J"] == pytest.approx(loop.truth["J"], rel=0.02)
    assert len(platforms) > 6 and lacking <= 1
    assert np.mean(np.abs(z) < 1.96) > 0.85 and 0.6 < np.std(z) < 1.4


@pytest.mark.long
def test_noise_of_a_line_does_not_decide_on_its_weight() -> None:
    """200 lines of 15 %, each weighted by its own gain, would make it low by several u; the mean of z is 0 here.

    P = y/u with complex Gaussian noise in both, its size known as from 43 periods (chi-squared of 42 degrees).  Mean of
    60 records within three of its u, standard deviation within four of its own.
    """
    rng, f = np.random.default_rng(5), np.linspace(1.0, 60.0, 200)
    truth = {"J": 0.05, "viscous": 0.8}
    g = 1.0 / (2j * np.pi * f * truth["J"] + truth["viscous"])
    z = []
    for _ in range(60):
        y, u = (1.0 + 0.106 * (rng.standard_normal(200) + 1j * rng.standard_normal(200)) * s for s in (0.9, 0.43589))
        size = 0.106 * np.sqrt(rng.chisquare(42, 200) / 42.0)  # one part of y/u - 1, of y = 1
        plant = MeasuredResponse(f, g * y / u, size / np.abs(y), np.full(200, 42.0), g, np.zeros(200))
        record = LoopRecord("own", H, np.zeros(9), np.zeros(9), np.zeros(9), "plant input", UNITS)
        fit = fit_plant(record, plant, list(truth))
        z.append([(fit.values[n] - v) / fit.u(n) for n, v in truth.items()])
    assert np.all(np.abs(np.mean(z, axis=0)) < 3.0 / np.sqrt(60.0))
    assert np.all(np.abs(np.std(z, axis=0) - 1.0) < 0.28) and np.mean(np.abs(z) > 1.96) < 0.11


def test_a_wild_line_does_not_pull() -> None:
    """One line of 200 is off by a factor of three, as its own noise says: it moves J by less than a third of u."""
    rng, f = np.random.default_rng(6), np.linspace(1.0, 60.0, 200)
    g = 1.0 / (2j * np.pi * f * 0.05 + 0.8)
    value = g * (1.0 + 0.01 * (rng.standard_normal(200) + 1j * rng.standard_normal(200)))
    record = LoopRecord("own", H, np.zeros(9), np.zeros(9), np.zeros(9), "plant input", UNITS)
    fits = []
    for factor, u in ((1.0, 0.01), (3.0, 0.25)):
        value[40] *= factor
        size = np.where(np.arange(200) == 40, u, 0.01)
        plant = MeasuredResponse(f, value.copy(), size, np.full(200, 42.0), g, np.zeros(200))
        fits.append(fit_plant(record, plant, ["J", "viscous"]))
    assert abs(fits[1].values["J"] - fits[0].values["J"]) < fits[0].u("J") / 3.0


@pytest.mark.long
def test_what_the_model_lacks_is_said(platforms: list[tuple]) -> None:
    loop, record, found = platforms[0]
    fit = fit_plant(record, found.responses["P"], ["J", "viscous", "delay", "held"])  # without the mode
    assert fit.lacks and "lack of fit" in fit.sentence and "lack of fit" in fit.toml("own")
    assert fit.worst[1] == pytest.approx(loop.truth["mode_f"], rel=0.15)
    good = fit_plant(record, found.responses["P"], ALL)
    assert fit.u("J") > good.u("J")


@pytest.mark.parametrize("kind", ["N.m", "A", "V"])
@pytest.mark.parametrize("turns", [0, 1])
def test_the_model_is_that_of_its_state_space(kind: str, turns: int) -> None:
    """States w, i, mode q and q', angle: C (s - A)^-1 B, and for a held input C (z - F)^-1 g, with F, g by expm."""
    v = {"J": 0.05, "viscous": 0.1, "k_t": 0.4, "k_e": 0.3, "R": 2.0, "L": 2e-3, "delay": 3e-4, "mode_f": 42.0,
         "mode_damping": 0.02, "mode_share": 0.2}  # fmt: skip
    w0 = 2.0 * math.pi * v["mode_f"]
    A, B = np.zeros((5, 5)), np.zeros(5)
    rate = np.array([1.0, 0.0, 0.0, v["mode_share"] / v["J"], 0.0])  # w and the share of q'
    A[0, 0] = -v["viscous"] / v["J"]
    A[2, 3], A[3, 2], A[3, 3] = 1.0, -w0 * w0, -2.0 * v["mode_damping"] * w0
    A[4] = rate
    if kind == "V":  # L i' = u - R i - k_e rate; the torque k_t i moves w and q
        A[1, 1], A[0, 1], A[3, 1] = -v["R"] / v["L"], v["k_t"] / v["J"], v["k_t"]
        A[1] -= v["k_e"] / v["L"] * rate
        B[1] = 1.0 / v["L"]
    else:
        torque = v["k_t"] if kind == "A" else 1.0
        B[0], B[3] = torque / v["J"], torque
    C = np.eye(5)[4] if turns else rate
    f = np.array([0.7, 5.0, 41.0, 43.0, 130.0])
    late = np.exp(-2j * np.pi * f * v["delay"])
    expected = [C @ np.linalg.solve(2j * np.pi * x * np.eye(5) - A, B) for x in f] * late
    assert PlantModel(kind, turns).response(v, f) == pytest.approx(expected, rel=1e-6)
    both = linalg.expm(np.block([[A, B[:, None]], [np.zeros((1, 6))]]) * H)
    expected = [
        C @ np.linalg.solve(np.exp(2j * np.pi * x * H) * np.eye(5) - both[:5, :5], both[:5, 5]) for x in f
    ] * late
    assert PlantModel(kind, turns, held=H).response(v, f) == pytest.approx(expected, rel=1e-6)


def test_a_twin_is_values_of_a_platform(platforms: list[tuple], tmp_path: Path) -> None:
    """What is found in amperes with a stated torque constant goes back by --set @FILE, and the system takes it."""
    loop, record, _ = platforms[0]
    current = LoopRecord("own", H, record.r, record.u / 0.4, record.y, record.at, {**UNITS, "input": "A"})
    plant = identify_record(LoopRecord("own", H, record.r / 0.4, record.u / 0.4, record.y, "plant input",
                                       {**UNITS, "excitation": "A", "input": "A"})).responses["P"]  # fmt: skip
    fit = fit_plant(current, plant, ["J", "viscous", "delay", "mode", "held", "k_t=0.4N.m/A"])
    assert fit.values["J"] == pytest.approx(loop.truth["J"], rel=0.02)
    twin = tmp_path / "twin.toml"
    twin.write_text(fit.toml("own"), encoding="utf-8")
    values = parse_settings([f"@{twin}"])
    assert set(values) == {"platform.J", "platform.viscous", "platform.k_t"}
    gb.load("platform_single_axis", values)
    with pytest.raises(gb.GyrobenchError, match=r"J and k_t act alike.*--fit (J|k_t)="):
        fit_plant(current, plant, ["J", "k_t", "viscous=0N.m.s/rad", "delay"])
    with pytest.raises(gb.GyrobenchError, match="with an input in A k_t must be named"):
        fit_plant(current, plant, ["J", "viscous"])
    with pytest.raises(gb.GyrobenchError, match="R has no effect"):
        fit_plant(current, plant, ["J", "viscous", "k_t=1N.m/A", "R"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("identify", "loop.csv", "--fit", "J", "--twin", "loop.csv"), "--twin loop.csv: a file of values ends in"),
        (("identify", "loop.csv", "--fit", "J", "--twin", "."), "--twin .: a file of values ends in .toml"),
        (("multisine", "loop.csv", "--band", "1Hz..9Hz", "--peak", "1A"), "loop.csv: the file exists; choose another"),
        (("multisine", "r.xlsx", "--band", "1Hz..9Hz", "--peak", "1A"), "FILE r.xlsx: an excitation ends in .csv"),
    ],
)
def test_no_record_is_written_over(gyrobench: Command, tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    """The help of identify calls record and twin FILE alike; the one is taken for the other."""
    record = tmp_path / "loop.csv"
    record.write_text("time [s],excitation [A],input [A],output [deg/s]\n0,1,2,3\n", encoding="utf-8")
    before = record.read_bytes()
    code, out, err = gyrobench(*words)
    assert code == 2 and message in err and out == "" and "Traceback" not in err
    assert record.read_bytes() == before and list(tmp_path.iterdir()) == [record]


@pytest.mark.parametrize(
    ("texts", "words"),
    [
        (["beauty"], "no such parameter"),
        (["J=3m"], "--fit J=3m: "),
        (["J", "J=3kg.m2"], "J: named twice"),
        (["mode=3"], "no such parameter"),
        (["J=3kg.m2"], "every parameter is known"),
    ],
)
def test_what_cannot_be_fitted(texts: list[str], words: str) -> None:
    with pytest.raises(gb.GyrobenchError, match=words):
        parse_fit(texts)


# ------------------------------------------------------------------------------------------- multisines
def test_a_multisine(tmp_path: Path) -> None:
    """Odd lines of one amplitude in the band, three of each four; the peak as asked for, the crest factor below 1.7."""
    made = gb.multisine("0.5Hz..100Hz", "0.2N.m", period="2s")
    assert np.abs(made.signal).max() == pytest.approx(0.2) and made.crest < 1.7
    size = np.abs(np.fft.rfft(made.signal)) * 2.0 / 2000
    assert np.all(made.lines % 2 == 1) and made.lines[0] >= 1 and made.lines[-1] <= 200
    assert size[made.lines] == pytest.approx(np.full(made.lines.size, size[made.lines[0]]), rel=1e-9)
    assert np.delete(size, made.lines) == pytest.approx(0.0, abs=1e-12)
    odd = np.arange(1, 200, 2)
    missing = np.setdiff1d(odd, made.lines)
    assert missing.size == 25 and np.all(np.bincount(np.searchsorted(odd, missing) // 4) == 1)
    lines = made.write(tmp_path / "r.csv", 3).read_text().splitlines()
    assert lines[:2] == ["# period = 2s", "time [s],excitation [N.m]"] and len(lines) == 2 + 6000
    assert "crest factor" in str(made)


def test_a_multisine_at_the_clock_of_the_laboratory(gyrobench: Command) -> None:
    """Two periods of 2 s at 2.5 kHz are 10,000 samples, 0.4 ms apart; 10 mA are 10 in the file and 0.01 A in SI."""
    code, out, _ = gyrobench("multisine", "r.csv", "--band", "1Hz..100Hz", "--peak", "10mA", "--period", "2s",
                             "--rate", "2.5kHz", "--periods", "2")  # fmt: skip
    assert code == 0 and "period 2 s" in out and "peak 10 mA" in out
    assert Path("r.csv").read_text().splitlines()[1] == "time [s],excitation [mA]"
    time, excitation = np.loadtxt("r.csv", delimiter=",", skiprows=2).T
    assert time == pytest.approx(4e-4 * np.arange(10_000), rel=1e-12)
    assert excitation[:5000] == pytest.approx(excitation[5000:], abs=1e-12)
    assert np.abs(excitation).max() == pytest.approx(10.0)
    made = gb.multisine("1Hz..100Hz", "10mA")
    assert np.abs(made.signal).max() == pytest.approx(0.01) and made.rms == pytest.approx(0.01 / made.crest)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (("0.5Hz..600Hz", "1V"), "600 Hz needs a rate of 1500 Hz"),
        (("10Hz..12Hz", "1V"), "at least 12 are needed"),
        (("10Hz", "1V"), r"write LOW\.\.HIGH"),
        (("1Hz..50Hz", "1beauty"), "beauty"),
        (("50Hz..1Hz", "1V"), "the band must rise"),
        (("1Hz..50Hz", "1V", "0.9999s", "999Hz"), "not a whole number"),
        (("1Hz..50Hz", "1V", "-4s"), "period, rate and peak must be above 0"),
        (("1Hz..50Hz", "1V", "4s", "0Hz"), "period, rate and peak must be above 0"),
    ],
)
def test_multisines_that_cannot_be(given: tuple[str, ...], words: str) -> None:
    with pytest.raises(gb.GyrobenchError, match=words):
        gb.multisine(*given)


# --------------------------------------------------------------------------------------- what is wanted
def test_verdicts() -> None:
    """The interval 0.68 rad to 0.72 rad is 39.0 to 41.3 degrees; a factor of 2 is 6.02 dB."""
    margins = [Margin("phase margin", 0.7, 0.68, 0.72, 5.0, "rad"), Margin("peak S", 2.0, 1.9, 2.1, 9.0, "factor")]
    for text, verdict in (
        ("phase margin=38deg", "pass"), ("phase margin=40deg", "inconclusive"), ("phase margin=42deg", "fail"),
        ("peak S<7dB", "pass"), ("peak S<6dB", "inconclusive"), ("peak S=5dB", "fail"),
        ("gain margin=6dB", "inconclusive"),
    ):  # fmt: skip
        (wanted,) = parse_wanted([text])
        assert wanted.verdict(margins, "").verdict == verdict, text
        assert wanted.verdict(margins, "friction").verdict == verdict.replace("pass", "inconclusive")
    for text, words in (("beauty=3", "no measure"), ("phase margin<40deg", "more is better; write >"),
                        ("peak S", "write M"),
                        ("disk margin=-1", "above 0"), ("gain margin=6deg", "a factor, or dB")):  # fmt: skip
        with pytest.raises(gb.GyrobenchError, match=re.escape(words)):
            parse_wanted([text])


@pytest.mark.long
def test_a_loop_that_depends_on_its_amplitude_passes_nothing(platforms: list[tuple], tmp_path: Path) -> None:
    """The same loop at a tenth of the excitation; then with a cubic of the input that is a tenth as large there."""
    _, record, found = platforms[0]
    assert difference(found.curve, identify_record(record_of(0, 0.5)[1]).curve) is None

    def written(name: str, amplitude: float, cubic: float) -> Path:
        _, made = record_of(3, amplitude, cubic)
        table = np.column_stack([H * np.arange(made.r.size), made.r, made.u, made.y])
        head = f"# excitation enters at = {made.at}\ntime [s],excitation [N.m],input [N.m],output [rad/s]"
        np.savetxt(tmp_path / name, table, fmt="%.9g", delimiter=",", header=head, comments="")
        return tmp_path / name

    large, small = written("large.csv", 1.0, 0.05), written("small.csv", 0.3, 0.05)
    lone = gb.identify(small, want=["phase margin=5deg"])
    assert str(lone.verdicts[0]).endswith("pass")
    both = gb.identify(small, want=["phase margin=5deg"], against=large)
    assert both.verdicts[0].verdict == "inconclusive" and both.notes[0].startswith(
        "nonlinear: against large.csv, 3.33 times"
    )
    assert record.at == PLACES[0]
