"""The drift record: truth of a simulated gyro, files of a laboratory, several columns, long records, refusals."""

from __future__ import annotations

import importlib
import json
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from commanding import Command

from gyrobench.engine.session import Session
from gyrobench.record import block_means
from gyrobench.record.record import Record
from gyrobench.reduction.noise_model.fit import fit_noise
from gyrobench.reduction.series.deviations import deviations
from gyrobench.result import DriftRecordResult, Table
from gyrobench.system.system import System, load_system

NAME = "drift_record"
DPH = math.pi / 648000.0
P: Any = importlib.import_module(".preparation", type(load_system(NAME)).__module__)


def load() -> System:
    return load_system(NAME)


def write(file: Path, columns: dict[str, np.ndarray], head: str = "") -> Path:
    rows = (",".join(f"{v:.9g}" for v in row) for row in zip(*columns.values(), strict=True))
    file.write_text("\n".join([*head.splitlines(), ",".join(columns), *rows, ""]), encoding="utf-8")
    return file


def reduce(file: Path, **values: str) -> DriftRecordResult:
    system = load()
    result = system.reduce(system.read_measured(file, values))
    assert isinstance(result, DriftRecordResult)
    return result


def tabled(result: DriftRecordResult, section: str, id: str) -> Table:
    (found,) = [t for t in result.columns[0].tables[section] if t.id == id]
    return found


def walk_and_white(n: int, N: float, K: float, seed: int) -> np.ndarray:
    """Means over 1 s, deg/h: white noise of density N, deg/h/sqrt(Hz), and a random walk, K in deg/h/sqrt(h)."""
    rng = np.random.default_rng(seed)
    return rng.normal(scale=N, size=n) + np.cumsum(rng.normal(scale=K / 60.0, size=n))


# ------------------------------------------------------------------------------------------- run
@pytest.fixture(scope="module")
def run() -> Record:
    with Session(NAME) as session:
        values = {"duration": 2500.0, "gyro.walk": 0.3 * DPH / 60.0, "gyro.flicker": 0.0}
        return session.run(values, seed=5)


@pytest.fixture(scope="module")
def result(run: Record) -> DriftRecordResult:
    limits = {"N": (None, 0.018 / 60.0), "B": (None, 1.0), "K": (None, 1e-6)}
    found = load().reduce(run, limits)
    assert isinstance(found, DriftRecordResult)
    return found


@pytest.mark.long
def test_the_report_finds_the_noise_of_the_gyro(run: Record, result: DriftRecordResult) -> None:
    """N = sqrt(white^2 + (k meter)^2): both are white in the current; K and Q are set; B and R are none.

    The loop passes angle noise of a correlation time of 0.2 s to a few percent.  2500 s do not tell a random walk from
    Gauss-Markov drift: K has a bound.
    """
    p = run.run.parameters
    N = math.hypot(p["gyro.white"], p["gyro.k"] * p["rebalance.meter"])
    truth = {"N": N / (math.radians(1.0) / 60.0), "B": 0.0, "K": 0.3, "R": 0.0, "Q": 0.02}
    for name, true in truth.items():
        c = result[name]
        assert c.truth == pytest.approx(true, abs=1e-12)
        assert c.interval[0] <= true * 1.02 and c.interval[1] >= true * 0.98, name
    assert result["N"].u < 0.2 * truth["N"] and result["Q"].u < 0.1 * 0.02
    assert "does not tell a random walk from slow Gauss-Markov drift" in result["K"].no_value
    assert result["K"].interval[1] < 3.0 * 0.3
    assert result["B"].no_value.endswith("°/h (95 %)") and "; below " in result["B"].no_value
    assert all(row[-1] == "inside" for row in tabled(result, "deviations", "agreement").rows)
    (column,) = result.columns
    assert [d.kind for d in column.deviations] == ["Allan", "modified Allan", "Hadamard"]
    # 1/2 <(difference of neighbours)^2> of the windows in deg/h, Earth rate along the input axis left out: no effect
    y = -p["gyro.k"] * run.windows["mean"] / DPH
    assert column.deviations[0].dev[0] == pytest.approx(math.sqrt(0.5 * np.mean(np.diff(y) ** 2)))
    assert not result.warnings
    assert [result[n].verdict for n in ("N", "B", "K")] == ["inconclusive", "pass", "inconclusive"], "by the interval"


@pytest.mark.long
def test_a_channel_of_a_run(run: Record, result: DriftRecordResult, tmp_path: Path, command: Command) -> None:
    """The windows of a folder: the current with its scale is the rate, and the coefficients are those of the run."""
    folder = run.save(tmp_path / "run")
    scale = f"{math.degrees(run.run.parameters['gyro.k']):.12g}deg/s/A"
    code, out, said = command(
        "reduce", NAME, "--data", folder, "--set", "channel=mean", "--set", f"scale={scale}",
        "--set", "type_b=none", "--out", tmp_path / "out", "--json",
    )  # fmt: skip
    assert code == 0, said
    for c in json.loads(out)["coefficients"]:
        expected = result[c["name"]]
        if c["name"] != "R":  # turned round: rate = k i here, omega_IA - k i there
            assert c["interval"] == pytest.approx(expected.interval, rel=1e-3, abs=1e-12)
    assert json.loads(out)["provenance"]["data"]["file"] == "run"
    record = load().read_measured(folder, {"channel": "gyro.drift"})  # one of its channels, sampled every 10 s
    assert np.allclose(record.windows["gyro.drift"], run.channels["gyro.drift"])


# ------------------------------------------------------------------------------------------- files
@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_columns_lines_gaps_and_temperature(tmp_path: Path) -> None:
    """Two gyros in one file: one in deg/s with a line and a temperature, one as angle; a gap in both."""
    n = 6000
    t = np.arange(n, dtype=float)
    T = 20.0 + 2.0 * np.sin(2.0 * np.pi * t / n * 1.5)
    x = 5.0 + walk_and_white(n, 0.02, 0.0, 1) + 0.05 * np.sin(0.3 * t) + 0.03 * (T - 20.0)
    y = walk_and_white(n, 0.1, 0.0, 4)
    keep = (t < 4000) | (t > 4100)
    columns = {"time [s]": t, "x [deg/s]": x / 3600.0, "y [arcsec]": np.cumsum(y), "temperature [degC]": T}
    result = reduce(write(tmp_path / "r.csv", {k: v[keep] for k, v in columns.items()}), type_b="none")
    assert result["N x"].interval[0] < 0.02 / 60.0 < result["N x"].interval[1] and result["N x"].u < 1e-5
    assert result["N y"].interval[0] < 0.1 / 60.0 < result["N y"].interval[1]
    a, b = result.columns
    slope, change = a.tables["regression"][0].rows
    assert change[0] == "d(temperature)/dt" and change[-1] == "not significant, left in"
    assert slope[0] == "temperature" and slope[1] == pytest.approx(0.03, abs=2.0 * slope[2]) and slope[2] < 0.003
    (line,) = a.tables["spectrum"][0].rows
    assert line[1] == pytest.approx(0.3 / (2 * np.pi), abs=3 * line[2]) and line[3] == pytest.approx(
        0.05, abs=3 * line[4]
    )
    assert not b.tables["spectrum"] and b.tables["regression"][0].rows[0][-1] == "not significant, left in"
    facts = {row[0]: row[1] for row in b.tables["acquisition"][0].rows}
    assert facts["gaps"] == 1 and facts["samples missing in gaps"] == 101 and "sin(π f T)" in b.texts["acquisition"][0]


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_lines_are_taken_out_where_they_are(tmp_path: Path) -> None:
    """A line is in the deviations of the record; taken out, over a gap too, it is not: its phase is right."""
    n = 4000
    t = np.arange(n, dtype=float)
    keep = (t < 2500) | (t > 2700)
    x = 0.01 * walk_and_white(n, 1.0, 0.0, 3) + np.sin(2 * np.pi * 0.03 * t + 1.0)
    file = write(tmp_path / "r.csv", {"time [s]": t[keep], "rate [deg/h]": x[keep]})
    out = reduce(file)
    k = out.columns[0].deviations[0].tau.index(16.0)
    assert deviations(x, 1.0)["allan"].deviation[k] > 0.2
    assert out.columns[0].deviations[0].dev[k] == pytest.approx(0.01 / 4.0, rel=0.2)
    assert out["N"].interval[0] < 0.01 / 60.0 < out["N"].interval[1]


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_means_of_a_long_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where means are held, deviations are those of every sample, and the coefficients those of the same noise."""
    n = 8192
    x = walk_and_white(n, 0.02, 0.2, 4)
    file = write(tmp_path / "r.csv", {"time [s]": np.arange(n, dtype=float), "rate [deg/h]": x})
    whole = fit_noise(x, 1.0)  # deg/h, s
    monkeypatch.setattr(block_means, "MOST", 2048)
    record = load().read_measured(file, {})
    assert record.run.series is not None and record.run.series["factor"] == 4 and len(record.windows["rate"]) == 2048
    assert np.allclose(record.windows["rate"] / DPH, x.reshape(-1, 4).mean(axis=1), rtol=1e-7)
    record.save(tmp_path / "run")
    means = load().reduce(Record.load(tmp_path / "run"))
    assert isinstance(means, DriftRecordResult)
    expected = deviations(x, 1.0)["allan"]
    assert np.allclose(means.columns[0].deviations[0].tau, expected.tau)
    assert np.allclose(means.columns[0].deviations[0].dev, expected.deviation, rtol=1e-6)
    assert means["N"].interval[0] < whole["N"].value / 60.0 < means["N"].interval[1]
    assert means["K"].interval[0] <= whole["K"].value * 60.0 < means["K"].interval[1]
    assert means["N"].interval[0] < 0.02 / 60.0 < means["N"].interval[1]
    assert means["K"].interval[0] < 0.2 < means["K"].interval[1]


@pytest.mark.long
def test_a_gauss_markov_drift_is_reported_as_a_filter_takes_it(tmp_path: Path) -> None:
    """0.05 deg/h rms of 20 s under white noise of 0.02 deg/h in 1 s: N, variance, tau and driving density; no B, no K.

    sqrt(q) = 0.05 sqrt(2/20) = 0.0158 deg/h/sqrt(s); phi of 1 s = exp(-1/20) = 0.951, sigma(w) = 0.05 sqrt(1 - phi2).
    """
    rng = np.random.default_rng(6)
    n, a = 6000, math.exp(-1.0 / 20.0)
    g = np.zeros(n)
    for k in range(1, n):
        g[k] = a * g[k - 1] + math.sqrt(1.0 - a * a) * 0.05 * rng.normal()
    x = g + rng.normal(scale=0.02, size=n)
    result = reduce(write(tmp_path / "r.csv", {"time [s]": np.arange(n, dtype=float), "rate [deg/h]": x}))
    (row,) = tabled(result, "model", "gauss_markov").rows
    _, variance, sigma, low, high, tau, shortest, longest, density, phi, w, finding = row
    assert low < 0.05 < high and shortest < 20.0 < longest and finding == "determined"
    assert variance == pytest.approx(sigma**2) and density == pytest.approx(sigma * math.sqrt(2.0 / tau))
    assert density == pytest.approx(0.0158, rel=0.1) and phi == pytest.approx(math.exp(-1.0 / tau))
    assert w == pytest.approx(sigma * math.sqrt(1.0 - phi**2))
    assert result["N"].interval[0] < 0.02 / 60.0 < result["N"].interval[1]
    assert all(result[name].no_value.startswith("not determined: slow drift here is Gauss-Markov") for name in "BK")
    assert not result.warnings
    others = tabled(result, "model", "other_models").rows
    assert [row[0] for row in others] == ["MA(1)", "ARMA(1,1)", "ARMA(1,1)"] + ["ARIMA(3,1,0)"] * 3
    assert all(row[4] < row[2] < row[5] for row in others)


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_a_deviation_that_only_falls_bounds_the_least_one_from_above(tmp_path: Path) -> None:
    """White noise alone: no minimum, so no time of it, and nothing below which it cannot be."""
    rate = 0.1 * np.random.default_rng(3).standard_normal(4000)
    found = reduce(write(tmp_path / "r.csv", {"time [s]": np.arange(4000.0), "rate [deg/h]": rate}))["B_min"]
    assert found.no_value and found.interval[0] == 0.0 < found.interval[1] < 0.1 and " at " not in found.meaning


def test_a_warm_up_is_taken_out_and_told(tmp_path: Path) -> None:
    """6 exp(-t/400 s) deg/h in white noise of 1 deg/h a second: u of the size is near sqrt(2/400) = 0.07 and more."""
    n, rng = 6000, np.random.default_rng(1)
    t = np.arange(float(n))
    x = rng.normal(size=n) + 6.0 * np.exp(-t / 400.0)
    result = reduce(write(tmp_path / "r.csv", {"time [s]": t, "rate [deg/h]": x}))
    (said,) = [r.text for r in result.reasons if r.id == "drift_record.settling"]
    found = re.search(r"by −(\S+) ± (\S+) °/h with a time constant of (\S+) ± (\S+) s", said)
    assert found is not None
    size, u, tau, u_tau = map(float, found.groups())
    assert 0.07 < u < 0.3 and abs(size - 6.0) < 3.0 * u
    assert 10.0 < u_tau < 60.0 and abs(tau - 400.0) < 3.0 * u_tau
    assert result["K"].no_value and all(row[-1] == "inside" for row in tabled(result, "deviations", "agreement").rows)


@pytest.mark.long
def test_what_a_curve_that_is_no_noise_leaves_is_doubted(tmp_path: Path) -> None:
    """White noise of 1 and ln(1 + 100 t/T)/2, nearly an exponential: what that leaves is a ramp, which no verdict may
    rest on; N is that of the white noise.
    """
    n, rng = 20_000, np.random.default_rng([78, 1])
    t = np.arange(float(n))
    x = rng.normal(size=n) + 0.5 * np.log1p(100.0 * t / n)
    system = load()
    file = write(tmp_path / "r.csv", {"time [s]": t, "rate [deg/h]": x}, "# type_b = none")
    result = system.reduce(system.read_measured(file, {}), {"N": (None, 0.1), "R": (None, 1e3)})
    assert isinstance(result, DriftRecordResult)
    (doubt,) = [r for r in result.reasons if r.id == "drift_record.curve" and r.severity == "doubt"]
    assert doubt.names == ("K", "R") and "settles or has few cycles" in doubt.text
    assert not result["R"].no_value and result["R"].verdict == "inconclusive" and result["N"].verdict == "pass"
    assert any(text.startswith("K and R are of the one drift curve") for text in result.columns[0].texts["deviations"])


@pytest.mark.long
def test_steps_and_wild_samples_are_taken_out_and_told(tmp_path: Path) -> None:
    """A step of one standard deviation of a sample, and a thousandth of samples off by 20 of them.

    With both left in N2 is 1 + 0.001 400 = 1.4 times the noise's, N 18 % high; the step makes a walk of K 6 times the
    true one.  One sample more may be called wild by chance.
    """
    n, rng = 20_000, np.random.default_rng(7)
    x = walk_and_white(n, 1.0, 60.0 * 1e-3, 7)
    wild = rng.choice(n, 20, replace=False)
    x[wild] += 20.0 * rng.choice([-1.0, 1.0], size=20)
    x[12_000:] += 1.0
    result = reduce(write(tmp_path / "r.csv", {"time [s]": np.arange(n, dtype=float), "rate [deg/h]": x}))
    assert result["N"].interval[0] < 1.0 / 60.0 < 1.01 * result["N"].interval[1] and result["N"].u < 0.02 / 60.0
    assert 60.0 * 1e-3 < result["K"].interval[1] < 4.0 * 60.0 * 1e-3
    told = {r.id: r.text for r in result.reasons}
    assert re.match(r"2[01] samples are wild.* with them", told["drift_record.wild"])
    assert re.search(r"steps by (0\.[89]|1\.[012])\d* °/h at (11|12)\d\d\d s", told["drift_record.step"])
    # the deviation of the record as it was, with both, is that of the model and of what was taken out
    assert all(row[-1] == "inside" for row in tabled(result, "deviations", "agreement").rows)


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_nothing_is_stated_that_the_deviation_contradicts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A model whose deviation is not the record's gives no coefficient and no verdict, and says what it is not."""
    agreement = importlib.import_module("gyrobench.reduction.noise_model.agreement")
    monkeypatch.setattr(agreement, "ENOUGH", 1.1)
    x = walk_and_white(3000, 1.0, 0.0, 2)
    file = write(tmp_path / "r.csv", {"time [s]": np.arange(3000.0), "rate [deg/h]": x})
    system = load()
    result = system.reduce(system.read_measured(file, {}), {"N": (None, 1.0)})
    assert all(c.no_value.startswith("not determined: the deviation of the best model") for c in result.coefficients)
    assert result["N"].verdict not in ("pass", "fail") and math.isnan(result["N"].interval[0])
    assert "drift_record.misfit" in {r.id for r in result.reasons} and "No coefficient is stated" in result.summary[0]


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_a_coarse_counter(tmp_path: Path) -> None:
    """15.36 counts of 0.5 arcsec a sample: two steps in three are the same, and none is a reset or wild.

    Q is that of rounding, 0.5/sqrt 12 = 0.144 arcsec.  Neighbouring errors are correlated by r = 6/pi2 exp(-2 pi2 0.09)
    cos(2 pi 0.36) = -0.066: at half the sampling rate, where Q is told from white noise, its power is 1 - 2 r = 1.13
    times that of independent ones, Q up to 6 % larger.
    """
    n = 4000
    angle = np.cumsum(15.36 + 0.3 * np.random.default_rng(6).normal(size=n))  # counts
    columns = {"n": np.floor(angle) % 65536, "u [V]": np.ones(n), "case [degC]": 20.0 + np.arange(n) / n}
    file = write(tmp_path / "r.csv", columns, "# scale = 0.5arcsec\n# sampling = 2Hz")
    result = reduce(file, type_b="none")
    facts = {row[0]: row[1] for row in result.columns[0].tables["acquisition"][0].rows}
    assert facts["resets of the angle or counter"] == 0 and facts["turns or overflows unwrapped"] == 0
    assert facts["resolution of the values"] == pytest.approx(0.5) and facts["gaps"] == 0
    assert result["Q"].interval[0] < 1.06 * 0.5 / math.sqrt(12.0) and result["Q"].interval[1] > 0.5 / math.sqrt(12.0)
    assert result["Q"].u < 0.1 * 0.5 / math.sqrt(12.0)
    assert not [w for w in result.warnings if "standard deviations from the median" in w]
    said = result.columns[0].texts["acquisition"]
    assert said[0].startswith("Columns of the file that were not used: u. ") and "sin(π f T)" in said[1]
    (temperature,) = result.columns[0].tables["regression"][0].rows
    assert temperature[0] == "case"  # by its unit


# ------------------------------------------------------------------------------------------- refusals, words
@pytest.mark.parametrize(
    ("columns", "head", "words"),
    [
        (
            {"time [s]": np.arange(300.0), "rate [deg/h]": np.sin(np.arange(300.0) ** 2)},
            "",
            "300 samples; at least 512",
        ),
        ({"rate [deg/h]": np.arange(600.0)}, "", "no sampling rate is given"),
        ({"time [s]": np.arange(600.0), "c": np.arange(600.0)}, "# counts = total", "must be 'cumulative' or 'increm"),
        ({"time [s]": np.arange(600.0), "rate [deg/h]": np.arange(600.0)}, "# samples = few", "must be 'means'"),
        ({"time [s]": np.arange(600.0), "rate [deg/h]": np.arange(600.0)}, "# sampling = 3V", "sampling"),
    ],
)
def test_what_is_refused(
    tmp_path: Path, command: Command, columns: dict[str, np.ndarray], head: str, words: str
) -> None:
    file = write(tmp_path / "r.csv", columns, head)
    code, _, said = command("reduce", NAME, "--data", file, "--out", tmp_path / "out")
    assert code == 2 and words in said and "Traceback" not in said, said
    assert not (tmp_path / "out" / "report.html").exists()


@pytest.mark.long
def test_what_is_warned_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wild value, rounding coarser than the noise, aliasing, a converter at its limit: read, and said."""
    description = importlib.import_module(".description", type(load()).__module__)
    n = 4000
    t, x = np.arange(n) * 0.1, np.random.default_rng(8).normal(size=n)
    files = {
        "wild": (np.where(t == 50.0, 3.0e4, x), "", "A sample is wild, beyond what the noise around makes, at 50 s"),
        "rounded": (10.0 * np.round(x / 25.0 + (t > 100.0)), "", "rounded to 10 °/h, more than twice the noise"),
        "folded": (x, "# bandwidth = 100Hz", "N² is up to 14 dB too large. Sample every 0.004 s"),
        "step": (x + 5.0 * (t > 120.0), "", "a step, which no noise of the rest makes"),
        "limit": (np.clip(x, -0.5, 0.5), "", "are at the largest or smallest value"),
        "one-sided": (np.minimum(x, 1.5), "", "are at the largest or smallest value"),
        "held": (np.repeat(np.random.default_rng(9).normal(size=3000), 3)[: t.size], "",
                 " rows, values of a slower record that were held or interpolated. No coeffic"),
        "quarter": (np.where(t < 0.25 * t[-1], 0.7, 1.0) * x, "", "The noise is not the same all along the record"),
    }  # fmt: skip
    monkeypatch.setattr(P, "describe", lambda x, step: None)  # of the warnings nothing needs the models
    for name, (values, head, words) in files.items():
        file = write(tmp_path / "r.csv", {"time [s]": t, "rate [deg/h]": values}, head)
        record = load().read_measured(file, {})
        p = P.prepare("rate", P.columns_of(record), False, True, name != "rounded")
        assert any(words in r.text for r in description.warnings(p, record.run)), name


def test_short_runs_are_refused(command: Command, tmp_path: Path) -> None:
    code, _, said = command("run", NAME, "--set", "duration=100s", "--out", tmp_path / "out")
    assert code == 2 and "100 samples of 1 s; at least 512 are needed" in said


@pytest.mark.usefixtures("no_arma")
@pytest.mark.long
def test_missing_samples_are_completed_and_long_gaps_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    """A gap of more than a thousand samples ends a stretch; the samples missing in the longest one are as its noise."""
    monkeypatch.setattr(P, "describe", lambda x, step: None)
    n = 10_000
    x = np.random.default_rng(7).normal(size=n)
    x[3000:4100] = np.nan
    x[::20] = np.nan
    columns = P.Columns(np.arange(float(n)), {"rate": x}, {}, {}, 1.0)
    p = P.prepare("rate", columns, False)
    assert p.first in (4100, 4101) and p.stretch.size == n - p.first and np.isfinite(p.stretch).all()
    there = np.isfinite(x[p.first :])
    assert p.stretch[there] == pytest.approx(x[p.first :][there], abs=1e-9)
    assert np.std(p.stretch[~there]) == pytest.approx(1.0, abs=4.0 / math.sqrt(2.0 * np.count_nonzero(~there)))
    assert p.noise.treatment.filled == np.count_nonzero(~there) + np.count_nonzero(np.isnan(x[1:3000]))


def test_an_interval_of_one_value_is_not_written() -> None:
    """The least Allan deviation "at 48 (48 to 48) s" is at 48 s."""
    tables: Any = importlib.import_module(".noise_tables", type(load_system(NAME)).__module__)
    assert tables.range_text(SimpleNamespace(value=48.0, low=48.0, high=48.0)) == "48"
    assert tables.range_text(SimpleNamespace(value=25.3, low=24.1, high=27.0)) == "25.30 (24.10 to 27.00)"  # u = 0.74


def test_a_drift_that_is_in_few_models_is_no_reason() -> None:
    """White noise of 4000 samples; some models have a process of ten: that is not what the slow drift here is."""
    tables: Any = importlib.import_module(".noise_tables", type(load_system(NAME)).__module__)
    model = fit_noise(np.random.default_rng([5, 0]).normal(size=4000), 1.0, means=False)
    assert [g.tau.determined for g in model.processes] == [False]
    assert tables.absent("B", model) == "not determined: the record is too short or other noise covers it"
