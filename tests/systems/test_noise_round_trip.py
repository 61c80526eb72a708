"""Noise of a record into a simulated gyro and back: the file of values, and the gyro that runs with it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from gyrobench.bench import UsageError
from gyrobench.commands.arguments import read_settings
from gyrobench.engine.session import Session
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.series.deviations import deviations
from gyrobench.reduction.series.gyro_noise import gyro_noise, slow_density
from gyrobench.reduction.series.noise_coefficients_table import TERMS
from gyrobench.result import Coefficient
from gyrobench.system.system import load_system
from gyrobench.workflow.gyro_values import write_gyro_values
from systems.drift_record.preparation import truth_of

Array = NDArray[np.float64]
DPH = math.pi / 648000.0
SAMPLES = 1500  # of 1 s
#: deg/h and s
TRUE = {"N": 0.012, "B": 0.006, "K": 3e-4, "Q": 0.02}
PARAMETERS = {"N": "white", "B": "flicker", "K": "walk", "R": "ramp", "Q": "quantization"}


def measured(rng: np.random.Generator) -> Array:
    """Return a rate in rad/s, from the equations: flicker by its spectrum, over a record 8 times as long."""
    m = 8 * SAMPLES
    f = np.fft.rfftfreq(m)
    density = np.concatenate([[0.0], 1.0 / (2.0 * math.pi * f[1:])])
    spectrum = np.sqrt(density * m / 2.0) * (rng.normal(size=f.size) + 1j * rng.normal(size=f.size))
    flicker = np.fft.irfft(spectrum, m)[:SAMPLES]
    walk = np.cumsum(rng.normal(size=SAMPLES))
    angle = np.diff(rng.normal(size=SAMPLES + 1))
    rate = TRUE["N"] * rng.normal(size=SAMPLES) + TRUE["B"] * flicker + TRUE["K"] * walk + TRUE["Q"] * angle
    out: Array = DPH * rate
    return out


def only(**known: float) -> dict[str, float]:
    """Return coefficients of which the others are none."""
    return {term: known.get(term, 0.0) for term in TERMS}


def reported(
    noise: Mapping[str, float], processes: Sequence[tuple[float, float]] = (), column: str = ""
) -> tuple[list[Coefficient], SimpleNamespace]:
    """Return the coefficients and the tables of a column as the report of a drift record has them."""
    found = []
    for term, (unit, si, meaning) in TERMS.items():
        name, x = f"{term} {column}".strip(), noise[term] / si
        if x:
            found.append(Coefficient(name, meaning, unit, x, 0.0, 2.0, (0.5 * x, 2.0 * x)))
        else:
            found.append(
                Coefficient(name, meaning, unit, math.nan, math.nan, 2.0, (0.0, 1.0), no_value="not determined")
            )
    terms = [[term, noise[term] / si, unit, ""] for term, (unit, si, _) in TERMS.items() if noise[term]]
    rows = [[k, 0.0, sigma / DPH, 0.0, 0.0, tau] for k, (sigma, tau) in enumerate(processes, 1)]
    tables = [SimpleNamespace(id="terms", rows=terms), SimpleNamespace(id="gauss_markov", rows=rows)]
    return found, SimpleNamespace(unit="°/h", tables={"model": tables})


def written(
    path: Path, *columns: tuple[list[Coefficient], SimpleNamespace], part: str = "floated_gyro"
) -> Mapping[str, str]:
    t = np.arange(float(SAMPLES))
    run = SimpleNamespace(data=SimpleNamespace(file="gyro 7.csv"), series=None)
    record: Any = SimpleNamespace(windows={"t_start": t, "t_end": t + 1.0}, run=run)
    result: Any = SimpleNamespace(system="drift_record", coefficients=[c for found, _ in columns for c in found],
                                  warnings=["the test line"], columns=[c for _, c in columns])  # fmt: skip
    write_gyro_values(result, record, part, path)
    return read_settings(path)


@pytest.mark.long
def test_record_gyro_record(tmp_path: Path) -> None:
    """The gyro is given the whole model of a record, a white noise that is not determined alone, too: what it was given
    lies in the intervals of its own record, and the Allan deviations agree.
    """
    rate = measured(np.random.default_rng(2))
    first = fit_noise(rate, 1.0)
    assert not first["N"].determined and first.terms["N"] > 0.0
    values = written(tmp_path / "floated_gyro.toml", reported(first.terms))
    system = load_system("fixed_position").with_values({"readings": SAMPLES, "dwell": SAMPLES})
    with Session(system) as session:
        record = session.run({**values, "rebalance.meter": 0.0}, seed=4)
    given = record.run.parameters
    simulated = -float(given["gyro.k"]) * np.asarray(record.windows["mean"], dtype=float)
    again = fit_noise(simulated, 1.0)
    for name, parameter in PARAMETERS.items():
        e, true = again[name], float(given[f"gyro.{parameter}"])
        assert e.low <= true <= e.high, name
        assert true == pytest.approx(first.terms[name], rel=1e-12), name
    assert again["Q"].determined
    was, now = (deviations(x, 1.0, ("allan",))["allan"] for x in (rate, simulated))
    assert now.deviation[:6] / was.deviation[:6] == pytest.approx(1.0, abs=0.12)  # to 32 s; 0.05 here


def test_what_is_not_determined_is_off(tmp_path: Path) -> None:
    """N alone is known: the others are 0, Gauss-Markov drift and pickoff noise too; flicker lasts for the record."""
    noise = only(N=2e-7)
    expected = {"white": 2e-7, "flicker_tau": 1e5, "quantization_tau": 0.2, **dict.fromkeys(
        ("flicker", "walk", "ramp", "quantization", "markov", "pickoff"), 0.0)}  # fmt: skip
    assert gyro_noise(noise, 1.0, 1500.0) == expected
    assert gyro_noise(noise, 10.0, 1e6) == {**expected, "flicker_tau": 1e6, "quantization_tau": 2.0}
    text = written(tmp_path / "v.toml", reported(noise))
    assert {n.removeprefix("gyro."): float(x) for n, x in text.items()} == pytest.approx(expected, rel=1e-12)
    head = (tmp_path / "v.toml").read_text().partition("[gyro]")[0]
    assert "# Noise of gyro 7.csv (1500 s)" in head and "# Warning of the reduction: the test line" in head


def test_the_largest_gauss_markov_process_goes_into_the_gyro(tmp_path: Path) -> None:
    """0.5 deg/h of 200 s into the gyro, 0.1 deg/h of 20 s into the comment: the gyro has one process."""
    noise = only(N=2e-7)
    text = written(tmp_path / "v.toml", reported(noise, [(0.1 * DPH, 20.0), (0.5 * DPH, 200.0)]))
    assert float(text["gyro.markov"]) == pytest.approx(0.5 * DPH) and float(text["gyro.markov_tau"]) == 200.0
    assert "the largest of 2 processes" in (tmp_path / "v.toml").read_text("utf-8")


def test_flicker_of_a_fast_record_goes_to_half_its_sampling_rate() -> None:
    """100 Hz for ten minutes: B2/(2 pi f) from 1/600 to 50 Hz within 1.5 %; with the 1e5 s of slow ones a fifth at 50.

    There w tau_11 = 7.49: 2 0.588 7.49/57.1 + 2 0.441 30.0/898 + 0.007 = 0.19.  A longer record than the 5.7 decades
    that a gyro has keeps its length.
    """
    noise = only(B=2e-7)
    f = np.geomspace(1.0 / 600.0, 50.0, 40)
    values = gyro_noise(noise, 0.01, 600.0)
    assert values["flicker_tau"] == pytest.approx(0.11 * 4.0**11 * 0.01)
    flicker = slow_density(values, f) * 2.0 * math.pi * f / 4e-14
    assert flicker == pytest.approx(np.ones(f.size), abs=0.015)
    slow = slow_density({**values, "flicker_tau": 1e5}, f) * 2.0 * math.pi * f / 4e-14
    assert slow[-1] == pytest.approx(0.19, abs=0.005) and slow[0] == pytest.approx(1.0, abs=0.015)
    assert gyro_noise(noise, 0.01, 1e4)["flicker_tau"] == 1e4


def test_channels(tmp_path: Path) -> None:
    """A gyro with two channels takes one column for both, or two in their order; one with one channel takes one."""
    a, b = (only(N=x) for x in (1e-7, 3e-7))
    both = written(tmp_path / "v.toml", reported(a, (), "p"), reported(b, (), "q"), part="gyro_2dof")
    assert [float(both[f"gyro.white_{c}"]) for c in "xy"] == pytest.approx([1e-7, 3e-7])
    assert {"gyro.flicker_tau", "gyro.quantization_tau", "gyro.markov_y"} <= set(both)
    one = written(tmp_path / "v.toml", reported(a), part="gyro_2dof")
    assert one["gyro.white_x"] == one["gyro.white_y"]
    load_system("eight_position").with_values(both)
    with pytest.raises(UsageError, match=r"columns p, q; floated_gyro has 1 channel: choose by --set channel=NAME"):
        written(tmp_path / "v.toml", reported(a, (), "p"), reported(b, (), "q"))
    with pytest.raises(UsageError, match="--fit-to site: it has no parameters white, flicker"):
        written(tmp_path / "v.toml", reported(a), part="site")
    with pytest.raises(UsageError, match=r"drift_record gives no coefficients N, B, K, R, Q"):
        written(tmp_path / "v.toml", (reported(a)[0][:2], reported(a)[1]))
    found, column = reported(a)
    column.tables["model"] = []
    with pytest.raises(UsageError, match="no noise model describes the record"):
        written(tmp_path / "v.toml", (found, column))


@pytest.mark.parametrize("tau, true", [(999.0, 3e-9), (1250.0, 5e-9)])
def test_the_truth_of_k_has_processes_slower_than_a_tenth_of_the_record(tau: float, true: float) -> None:
    """Of 10,000 s; sigma = 1e-7 of 1250 s: sigma sqrt(2/tau) = 4e-9, and 3, 4, 5."""
    run = SimpleNamespace(parameters={"gyro.walk": 3e-9, "gyro.markov": 1e-7, "gyro.markov_tau": tau}, options={})
    windows = {"t_start": np.array([0.0, 5000.0]), "t_end": np.array([5000.0, 10000.0])}
    record: Any = SimpleNamespace(run=run, windows=windows, channels={})
    assert truth_of(record)["K"] == pytest.approx(true)
