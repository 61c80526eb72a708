"""The bench of estimators: spec figures through the co-simulation, consistency, ranking, refusals, commands."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commanding import Command
from reducing import named

from gyrobench import report
from gyrobench.engine.run_errors import ParameterRefusedError
from gyrobench.engine.session import Session, run
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.report.comparison_page import comparison
from gyrobench.system.system import InvalidConfigurationError, load_system
from gyrobench.system.values import InvalidValueError

NAME = "estimator_bench"


SESSIONS: dict[str, Session] = {}


@pytest.fixture(scope="module", autouse=True)
def closed() -> Iterator[None]:
    yield
    while SESSIONS:
        SESSIONS.popitem()[1].close()


@cache
def result(part: str, benchmark: str = "sine", seed: int = 1, **values: Any) -> Any:
    system = load_system(NAME)
    more = {f"estimator.{k}": v for k, v in values.items()}
    if part not in SESSIONS:
        SESSIONS[part] = Session(NAME, {"estimator": f"estimator_{part}"})
    record = SESSIONS[part].run({"benchmark": benchmark, **more}, seed=seed)
    return system.with_values({"benchmark": benchmark}).reduce(record)


def test_an_estimator_that_is_not_consistent_is_a_finding_not_a_wrong_result() -> None:
    """A sine is smoother than the filter is ready for, so its NEES is below 1 (0.75): 1 is what it is asked, not what
    the measure should have found.  Nothing says that the coefficients cannot be used; the tests say what is found.
    """
    r = result("kalman_rate")
    assert not [reason for reason in r.reasons if reason.id == "truth.missed"]
    assert named(r)["NEES"].estimate == pytest.approx(0.75, abs=0.06) and named(r)["NEES"].truth is None
    assert any(reason.id == "estimator.consistency:NEES" for reason in r.reasons)


@pytest.mark.parametrize(
    ("part", "values", "dB", "gain"),
    [
        ("none", {}, 0.0, 1.0),
        ("kalman_rate", {"q": 0.02}, -12.4, 1.015),
        ("kalman_rate", {"q": 0.1}, -10.9, 1.007),
        ("kalman_rate", {"q": 0.5}, -9.3, 1.004),
        ("kalman_rate", {"q": 2.0}, -7.9, 1.002),
        ("kalman_rate", {"q": 8.0}, -6.5, 1.002),
        ("sage_husa", {"form": 1}, -7.8, 1.002),
        ("kalman_ar", {"R": 3.3697e-6}, 8.6, 0.389),
    ],
)
def test_sine(part: str, values: dict[str, float], dB: float, gain: float) -> None:
    """BENCH-DYN-SINE: error within 0.4 dB, gain within 0.5 %, phase within 0.4 degrees."""
    c = named(result(part, **values))
    assert c["error re raw"].estimate == pytest.approx(dB, abs=0.4)
    assert c["gain"].estimate == pytest.approx(gain, abs=max(0.005, 4.0 * c["gain"].u))
    assert abs(c["phase"].estimate) < 0.4
    if part in ("none", "kalman_rate"):
        assert c["noise re raw"].estimate == pytest.approx(c["error re raw"].estimate, abs=0.5)


@pytest.mark.parametrize(
    ("moments", "J", "delay", "late", "now"),
    [(4, 3, 49, -9.6, 2.7), (4, 5, 217, -15.8, 14.7), (1, 3, 7, -10.7, -9.1), (1, 5, 31, -16.9, -1.4)],
)
def test_sine_through_the_wavelet(moments: int, J: int, delay: int, late: float, now: float) -> None:
    """EST-WAVELET-ONLINE: both error columns, and the delay as stated (the fit finds it within its uncertainty)."""
    r = result("wavelet", moments=moments, J=J)
    c = named(r)
    assert c["late error re raw"].estimate == pytest.approx(late, abs=0.8)
    assert c["error re raw"].estimate == pytest.approx(now, abs=0.8)
    assert c["delay"].closed == pytest.approx(delay)
    assert c["delay"].estimate == pytest.approx(delay, abs=4.0 * c["delay"].u)
    assert any("phase margin" in w for w in r.warnings)


def test_level() -> None:
    """BENCH-DRIFT-LL: 15.1 dB by the Riccati equation; the filter is what it says; AR(3) over it is not."""
    r = result("kalman_rate", "level")
    c, tests = named(r), {t.name: t for t in r.tests}
    assert c["error re raw"].estimate == pytest.approx(-15.07, abs=3.5 * c["error re raw"].u)
    assert tests["NEES"].finding.startswith("consistent") and tests["NIS"].finding.startswith("consistent")
    assert tests["Ljung-Box, innovations"].p > 0.001
    assert not r.warnings
    wrong = result("kalman_ar", "level")
    assert named(wrong)["error re raw"].estimate > 0.0
    assert any("understates" in w for w in wrong.warnings) and any("not white" in w for w in wrong.warnings)


@pytest.mark.long
def test_ar3() -> None:
    """BENCH-DRIFT-AR3: error variance of the Riccati equation, 1.912e-6; consistent; nothing beats it."""
    r = result("kalman_ar", "ar3")
    c = named(r)
    assert c["error"].estimate == pytest.approx(math.sqrt(1.912e-6), abs=3.5 * c["error"].u)
    assert all(t.finding.startswith(("consistent", "white")) for t in r.tests)
    for part in ("none", "moving_average", "alpha_beta_gamma", "sage_husa", "wavelet", "kalman_rate"):
        assert named(result(part, "ar3"))["error"].estimate > c["error"].estimate


@pytest.mark.parametrize("part", ["kalman_ar", "kalman_rate"])
@pytest.mark.long
def test_consistency_counted(part: str) -> None:
    """On their own model NEES and NIS stay within their 99.9 % bounds for ten seeds of twenty (mean: one in fifty)."""
    benchmark = {"kalman_ar": "ar3", "kalman_rate": "level"}[part]
    found = [t for seed in range(3, 13) for t in result(part, benchmark, seed).tests if t.name in ("NEES", "NIS")]
    assert sum(not t.finding.startswith("consistent") for t in found) <= 1
    assert len(found) == 20


@pytest.mark.parametrize("seed", [1, 2])
def test_noise_that_changes(seed: int) -> None:
    """The adaptive filter follows within 10 % and beats the fixed one of the same q."""
    own, fixed = named(result("sage_husa", "change", seed)), named(result("kalman_rate", "change", seed))
    assert own["R̂/R"].estimate == pytest.approx(1.0, abs=0.1)
    assert own["error"].estimate == pytest.approx(1.54e-3, rel=0.06)
    assert fixed["error"].estimate == pytest.approx(1.99e-3, rel=0.05)


def test_sage_husa_on_constant_noise_is_no_better() -> None:
    own, plain = named(result("sage_husa", "level")), named(result("kalman_rate", "level"))
    assert own["error"].estimate > plain["error"].estimate - own["error"].u
    assert own["R̂/R"].estimate == pytest.approx(1.0, abs=0.05)


@pytest.mark.long
def test_ranked_by_error_not_by_smoothness() -> None:
    """The wavelet of six levels has the least noise by far, and the largest error: it comes last."""
    runs = {
        "wavelet": result("wavelet", moments=4, J=6),
        "average": result("moving_average"),
        "none": result("none"),
        "rate": result("kalman_rate", q=0.02),
    }
    quiet = sorted(runs, key=lambda n: named(runs[n])["noise re raw"].estimate)
    assert quiet[0] == "wavelet" and quiet[-1] == "none"
    ranking = comparison(list(runs.items()))["ranking"]
    assert ranking["name"] == "error"
    assert [list(runs)[e["run"]] for e in ranking["order"]] == ["rate", "average", "none", "wavelet"]
    assert ranking["order"][0]["over_best"] == 1.0 and ranking["order"][3]["over_best"] > 20.0
    assert [e["apart"] for e in ranking["order"]] == [None, True, True, True]


def test_both_engines_agree_bit_for_bit() -> None:
    values = {"benchmark": "level", "samples": 2500, "skip": 0}
    records = [
        run(load_system(NAME), {"estimator": "estimator_sage_husa"}, values=values, engine=e)
        for e in ("native", "reference")
    ]
    assert records[0].same_data(records[1])


def test_readings_reach_the_estimator_in_their_own_step() -> None:
    """No estimator at all: the estimate is the reading of the same row."""
    r = run(load_system(NAME), {"estimator": "estimator_none"}, values={"samples": 10000, "skip": 0})
    assert (r.channels["estimator.estimate"] == r.channels["source.z"]).all()
    assert r.run.delays == {}


def test_what_is_known_is_set_where_the_part_has_it() -> None:
    values = {"benchmark": "level", "estimator.walk": 1e-9, "samples": 2500, "skip": 0}
    known = run(load_system(NAME), values=values).run
    p = known.parameters
    assert p["estimator.Ts"] == 5.0 and p["estimator.R"] == 2.70e-6 and p["estimator.q"] == 0.0
    assert p["estimator.walk"] == 1e-9  # the user's word before the benchmark's
    none = run(load_system(NAME), {"estimator": "estimator_none"}, values={"benchmark": "level"}).run
    assert "estimator.Ts" not in none.parameters and none.notes == known.notes == []


# --------------------------------------------------------------------------------------- refusals
def test_refusals() -> None:
    system = load_system(NAME)
    with pytest.raises(InvalidConfigurationError, match="benchmark = sin: one of sine, change, level, ar3"):
        system.with_values({"benchmark": "sin"}).refuse()
    with pytest.raises(
        InvalidConfigurationError, match="samples = 9000, of which 3000 are skipped: at least 10000 must be left"
    ):
        system.with_values({"samples": 9000}).refuse()
    with (
        Session(system) as session,
        pytest.raises(InvalidValueError, match="runs at the sampling period of its benchmark"),
    ):
        session.run(step=5e-4)


@pytest.mark.parametrize(
    ("part", "values", "text"),
    [
        ("kalman_ar", {"phi[1]": 0.7466, "phi[2]": 0.5044, "phi[3]": 0.2538}, "arburg .* returns a = -phi"),
        ("sage_husa", {"b": 1.0}, "b = 1 1 must be < 1"),
        ("wavelet", {"J": 9}, "J = 9 1 must be <= 6"),
        ("alpha_beta_gamma", {"alpha": 2.5}, "unstable"),
    ],
)
def test_parts_refuse_before_the_first_step(part: str, values: dict[str, float], text: str) -> None:
    more = {f"estimator.{k}": v for k, v in values.items()}
    with pytest.raises(ParameterRefusedError, match=text):
        run(load_system(NAME), {"estimator": f"estimator_{part}"}, values=more)


@pytest.mark.long
def test_sampling_period_that_does_not_fit_names_both(command: Command, tmp_path: Path) -> None:
    code, _, err = command("run", NAME, "--set", "estimator.Ts=1.5ms", "--out", tmp_path / "r")
    assert code == 3 and "Traceback" not in err
    assert "Ts = 0.0015 s must be a whole multiple of the communication step, 0.001 s" in err


def test_records_that_cannot_be_reduced() -> None:
    system = load_system(NAME).with_values({"benchmark": "level", "samples": 2600, "skip": 100})
    record = run(system)
    short = {k: v[:301] for k, v in record.channels.items()}
    whole, record.channels = record.channels, short
    with pytest.raises(ReductionError, match="200 samples: at least 400 are needed"):
        system.reduce(record)
    record.channels = {k: v for k, v in whole.items() if k != "source.truth"}
    with pytest.raises(ReductionError, match=r"channel source\.truth is missing"):
        system.reduce(record)
    record.channels = {**whole, "source.truth": whole["source.truth"] * 0.0}
    with pytest.raises(ReductionError, match="the truth is constant: an estimate of zero would rank first"):
        system.reduce(record)
    record.channels = {**whole, "source.z": whole["source.truth"]}
    with pytest.raises(ReductionError, match="the readings equal the truth: there is no noise to reduce"):
        system.reduce(record)
    record.channels = {**whole, "estimator.estimate": whole["estimator.estimate"] * math.nan}
    with pytest.raises(ReductionError, match="estimate is not finite at 2500 samples"):
        system.reduce(record)


# --------------------------------------------------------------------------------------- commands
@pytest.mark.long
def test_swap_and_compare(command: Command, tmp_path: Path) -> None:
    for part in ("none", "kalman_rate", "wavelet"):
        words = ["--part", f"estimator=estimator_{part}", "--out", tmp_path / part, "--json"]
        code, out, err = command("run", NAME, *words)
        assert code == 0, err
        doc = json.loads(out)
        assert doc["ranked_by"] == "error" and "note: " not in err
    code, _, err = command("compare", *(tmp_path / p for p in ("none", "kalman_rate", "wavelet")), "--out", tmp_path)
    assert code == 0, err
    doc = json.loads((tmp_path / "comparison.json").read_text())
    assert [doc["runs"][e["run"]]["instrument"] for e in doc["ranking"]["order"]] == [
        "EstimatorKalmanRate",
        "EstimatorWavelet",
        "EstimatorNone",
    ]
    html = (tmp_path / "comparison.html").read_text()
    assert html.index("Ranking by error") < html.index("Components, parameters and settings that differ")


@pytest.mark.long
def test_errors_and_innovations_stand_under_their_names_over_the_whole_time(tmp_path: Any) -> None:
    """57 s are evaluated (3 s are skipped); the extremes of both are in their figures, which are no residuals of a fit.

    2 sigma of the innovations: sqrt(y^2/NIS) of each.
    """
    record = run(load_system(NAME), {"estimator": "estimator_kalman_rate"}, values={"benchmark": "sine"}, seed=1)
    r = load_system(NAME).reduce(record)
    figures = {f.name: f for f in r.responses}
    late = record.channels["time"] > 3.0 + 5e-4
    error = (record.channels["estimator.estimate"] - record.channels["source.truth"])[late]
    innovation = record.channels["estimator.innovation"][late]
    for name, values in (("error", error), ("innovation", innovation)):
        figure = figures[name]
        assert figure.kind == "time" and figure.x[0] < 3.2 and figure.x[-1] > 59.9
        assert max(figure.y) == values.max() and min(figure.y) == values.min()
        upper, lower = (np.array(curve.y) for curve in figure.curves[1:])
        share = np.mean(np.abs(values) < np.interp(record.channels["time"][late], figure.curves[1].x, upper))
        assert np.all(upper == -lower) and 0.94 < share < 0.985  # it overstates its variance
    assert r.series == []
    html = report.write(r, tmp_path, ("html",))["html"].read_text(encoding="utf-8")
    assert "Errors and innovations" in html and "Autocorrelation of the innovations" in html
    assert ">Residuals<" not in html and "fitted model" not in html


# ------------------------------------------------------------------------------- latency is optional
def test_an_estimator_that_states_no_latency(foreign: Callable[[str], Path], tmp_path: Path) -> None:
    """Another maker's lag of 5 ms: y' = (u - y)/T, exact for u held over the step.  It delays a sine of 1 Hz by

        discrete pole a = exp(-0.2), zero-order hold: delay (a / (1 - a)) 1 ms = 4.517 ms for slow signals (measured).

    There is no latency to hold the delay against, no late error, and nothing else is missing.
    """
    mapping = tmp_path / "lag.toml"
    mapping.write_text('[z]\nname = "u"\n\n[estimate]\nname = "y"\n', encoding="utf-8")
    with Session(load_system(NAME), {"estimator": foreign("lag")}, {"estimator": mapping}) as session:
        record = session.run({"estimator.T": 5e-3, "samples": 20000})
        assert "estimator.latency" not in record.channels
        found = named(session.system.with_values({"samples": 20000}).reduce(record))
    assert found["delay"].closed is None and "late error re raw" not in found and "phase" in found
    a = math.exp(-0.2)
    assert found["delay"].estimate == pytest.approx(a / (1.0 - a), abs=4.0 * found["delay"].u)


@pytest.mark.parametrize(
    ("benchmark", "same"), [("sine", "kalman_rate"), ("level", "kalman_rate"), ("ar3", "kalman_ar")]
)
@pytest.mark.parametrize("part", ["lti", "coloured"])
def test_the_filters_of_any_model_get_the_model_of_the_benchmark(part: str, benchmark: str, same: str) -> None:
    """Swapped in with nothing else said, they are the filter made for it (white readings: psi = 0)."""
    found, expected = (named(result(p, benchmark)) for p in (part, same))
    for name in ("error", "NEES", "NIS"):
        assert found[name].estimate == pytest.approx(expected[name].estimate, rel=1e-5), name


def test_a_gate_costs_nothing_where_no_reading_is_wild() -> None:
    robust, plain = (named(result(p, "level")) for p in ("kalman_robust", "kalman_rate"))
    assert robust["error re raw"].estimate == pytest.approx(plain["error re raw"].estimate, abs=0.05)
