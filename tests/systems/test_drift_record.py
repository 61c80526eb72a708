"""The drift record: truth of a simulated gyro, files of a laboratory, several columns, long records, refusals."""

from __future__ import annotations

import importlib
import json
import math
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gyrobench.bench import Bench
from gyrobench.engine.session import Session
from gyrobench.record import block_means
from gyrobench.record.record import Record
from gyrobench.reduction.series.deviations import deviations
from gyrobench.reduction.series.noise_coefficients import Estimate, NoiseCoefficients, fit
from gyrobench.result import DriftRecordResult
from gyrobench.system.system import System, load_system

NAME = "drift_record"
DPH = math.pi / 648000.0
Command = Callable[..., tuple[int, str, str]]
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


def test_the_report_finds_the_noise_of_the_gyro(run: Record, result: DriftRecordResult) -> None:
    """N = sqrt(white^2 + (k meter)^2): both are white in the current; K and Q are set; B and R are none.

    The loop passes angle noise of a correlation time of 0.2 s to a few percent.
    """
    p = run.run.parameters
    N = math.hypot(p["gyro.white"], p["gyro.k"] * p["rebalance.meter"])
    truth = {"N": N / (math.radians(1.0) / 60.0), "B": 0.0, "K": 0.3, "R": 0.0, "Q": 0.02}
    for name, true in truth.items():
        c = result[name]
        assert c.truth == pytest.approx(true, abs=1e-12)
        assert c.interval[0] <= true * 1.02 and c.interval[1] >= true * 0.98, name
    assert result["N"].u < 0.2 * truth["N"] and result["Q"].u < 0.1 * 0.02 and not result["K"].no_value
    assert result["B"].no_value and "not determined, below" in result["B"].no_value
    (column,) = result.columns
    assert [d.kind for d in column.deviations] == ["Allan", "modified Allan", "Hadamard"]
    # 1/2 <(difference of neighbours)^2> of the windows in deg/h, Earth rate along the input axis left out: no effect
    y = -p["gyro.k"] * run.windows["mean"] / DPH
    assert column.deviations[0].dev[0] == pytest.approx(math.sqrt(0.5 * np.mean(np.diff(y) ** 2)))
    assert not result.warnings
    assert [result[n].verdict for n in ("N", "B", "K")] == ["inconclusive", "pass", "fail"], "by the interval"


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
    (slope,) = a.tables["regression"][0].rows
    assert slope[0] == "temperature" and slope[1] == pytest.approx(0.03, abs=2.0 * slope[2]) and slope[2] < 0.003
    (line,) = a.tables["spectrum"][0].rows
    assert line[1] == pytest.approx(0.3 / (2 * np.pi), abs=3 * line[2]) and line[3] == pytest.approx(
        0.05, abs=3 * line[4]
    )
    assert not b.tables["spectrum"] and b.tables["regression"][0].rows[0][-1] == "not significant, left in"
    facts = {row[0]: row[1] for row in b.tables["acquisition"][0].rows}
    assert facts["gaps"] == 1 and facts["samples missing in gaps"] == 101 and "sin(π f T)" in b.texts["acquisition"][0]


@pytest.mark.usefixtures("no_arma")
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
def test_means_of_a_long_record(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where means are held, deviations are those of every sample, and the coefficients those of the same noise."""
    n = 8192
    x = walk_and_white(n, 0.02, 0.2, 4)
    file = write(tmp_path / "r.csv", {"time [s]": np.arange(n, dtype=float), "rate [deg/h]": x})
    whole = fit(x, 1.0)  # deg/h, s
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
    assert means["N"].interval[0] < whole.N.value / 60.0 < means["N"].interval[1]
    assert means["K"].interval[0] < whole.K.value * 60.0 < means["K"].interval[1]
    assert means["N"].interval[0] < 0.02 / 60.0 < means["N"].interval[1]
    assert means["K"].interval[0] < 0.2 < means["K"].interval[1]


def test_noise_that_the_terms_do_not_describe(tmp_path: Path) -> None:
    """A Gauss-Markov drift of 20 s, ten times the white noise there: the spectrum says so, and what would be right."""
    rng = np.random.default_rng(5)
    n, a = 6000, math.exp(-1.0 / 20.0)
    g = np.zeros(n)
    for k in range(1, n):
        g[k] = a * g[k - 1] + math.sqrt(1.0 - a * a) * 0.05 * rng.normal()
    x = g + rng.normal(scale=0.02, size=n)
    result = reduce(write(tmp_path / "r.csv", {"time [s]": np.arange(n, dtype=float), "rate [deg/h]": x}))
    assert any("The spectrum is not that of the five terms" in w for w in result.warnings), result.warnings
    assert any("correlation time" in s for s in result.columns[0].texts["model"])
    (others,) = [t for t in result.columns[0].tables["model"] if t.id == "other_models"]
    assert [row[0] for row in others.rows] == ["MA(1)", "ARMA(1,1)", "ARMA(1,1)"] + ["ARIMA(3,1,0)"] * 3
    assert all(row[4] < row[2] < row[5] for row in others.rows)


@pytest.mark.usefixtures("no_arma")
def test_a_coarse_counter(tmp_path: Path) -> None:
    """15.36 counts of 0.5 arcsec a sample: two steps in three are the same, and none is a reset or wild.

    Q is that of rounding, 0.5/sqrt 12 = 0.144 arcsec.
    """
    n = 4000
    angle = np.cumsum(15.36 + 0.3 * np.random.default_rng(6).normal(size=n))  # counts
    columns = {"n": np.floor(angle) % 65536, "u [V]": np.ones(n), "case [degC]": 20.0 + np.arange(n) / n}
    file = write(tmp_path / "r.csv", columns, "# scale = 0.5arcsec\n# sampling = 2Hz")
    result = reduce(file, type_b="none")
    facts = {row[0]: row[1] for row in result.columns[0].tables["acquisition"][0].rows}
    assert facts["resets of the angle or counter"] == 0 and facts["turns or overflows unwrapped"] == 0
    assert facts["resolution of the values"] == pytest.approx(0.5) and facts["gaps"] == 0
    assert result["Q"].interval[0] < 0.5 / math.sqrt(12.0) < result["Q"].interval[1]
    assert not [w for w in result.warnings if "standard deviations from the median" in w]
    said = result.columns[0].texts["acquisition"]
    assert said[0].startswith("Columns of the file that were not used: u. ") and "sin(π f T)" in said[1]
    (temperature,) = result.columns[0].tables["regression"][0].rows
    assert temperature[0] == "case"  # by its unit


def test_what_is_just_determined_is_said_with_the_figure() -> None:
    """3.3 u: in the table beside the estimate, and in a warning with what the counts say; 5 u, or nothing: not."""
    reduction = importlib.import_module(".reduction", type(load()).__module__)
    description = importlib.import_module(".description", type(load()).__module__)
    just, clear, none = Estimate(1.0, 0.4, 1.6, True), Estimate(-1.0, -1.4, -0.6, True), Estimate(0.0, 0.0, 1.0, False)
    noise = NoiseCoefficients(clear, just, none, clear, just)
    assert [getattr(noise, n).just_determined for n in "NBKRQ"] == [False, True, False, False, True]
    meanings = {n: reduction._coefficient(SimpleNamespace(noise=noise), n, False, None, 0.0).meaning for n in "NBKRQ"}
    assert [n for n, words in meanings.items() if words.endswith("; just determined")] == ["B", "Q"]
    none = np.zeros(600)
    quiet = SimpleNamespace(clean=none, rate=none, stretch=none, name="rate")
    (said,) = description.warnings(quiet, noise, SimpleNamespace(series=None, options={}))
    assert said.text.startswith(
        "B, Q: just determined, below 4 u: of such estimates at least one interval in four misses"
    )


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


def test_what_is_warned_of(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A wild value, rounding coarser than the noise, aliasing, a converter at its limit: read, and said."""
    description = importlib.import_module(".description", type(load()).__module__)
    n = 2000
    t, x = np.arange(n) * 0.1, np.random.default_rng(8).normal(size=n)
    files = {
        "wild": (np.where(t == 50.0, 3.0e4, x), "", "more than 20 standard deviations from the median, the first"),
        "rounded": (10.0 * np.round(x / 25.0 + (t > 100.0)), "", "rounded to 10 °/h, more than twice the noise"),
        "folded": (x, "# bandwidth = 100Hz", "N² is up to 14 dB too large. Sample every 0.004 s"),
        "step": (x + 5.0 * (t > 120.0), "", "a step, which is not in the model"),
        "limit": (np.clip(x, -0.5, 0.5), "", "stay at the largest or smallest value"),
    }
    monkeypatch.setattr(P, "describe", lambda x, step: None)  # of the warnings nothing needs the models
    for name, (values, head, words) in files.items():
        file = write(tmp_path / "r.csv", {"time [s]": t, "rate [deg/h]": values}, head)
        record = load().read_measured(file, {})
        p = P.prepare("rate", P.columns_of(record), False)
        noise = fit(np.random.default_rng(9).normal(size=600), 0.1)
        assert any(words in w.text for w in description.warnings(p, noise, record.run)), name


def test_short_runs_are_refused(command: Command, tmp_path: Path) -> None:
    code, _, said = command("run", NAME, "--set", "duration=100s", "--out", tmp_path / "out")
    assert code == 2 and "100 samples of 1 s; at least 512 are needed" in said


def test_stretches_and_single_gaps() -> None:
    """A gap cuts; samples missing all over are bridged by means over those that are there."""
    x = np.random.default_rng(7).normal(size=10000)
    x[4000:4100] = np.nan
    values, first, averaged = P.longest_stretch(x)
    assert (first, averaged) == (4100, 1) and np.array_equal(values, x[4100:])
    x[::50] = np.nan
    values, first, averaged = P.longest_stretch(x)
    assert averaged == 2 and first == 4100 and values.size == 2950
    assert values[25] == x[4151] and values[26] == pytest.approx((x[4152] + x[4153]) / 2.0)


def test_readme_lists_the_options() -> None:
    text = (Bench.find().system_folder(NAME) / "README.md").read_text("utf-8")
    rows = {m[1]: m[0] for m in re.finditer(r"^\| `(\w+)` \| [^|]* \| [^|]+ \| .*$", text, re.M)}
    for name, option in load().options.items():
        unit = option.unit if isinstance(option.unit, str) else option.unit.__name__
        cells = [c.strip() for c in rows.pop(name).strip("|").split("|")]
        assert cells[2:] == [unit, option.doc], name
        assert option.parse(name, cells[1]) == option.parse(name, option.default), name
