"""The polar servo test with the live estimator: its end is least squares over the record; the hours saved."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from polar_drift import Day, Noise
from servoing import DAY50, DPH, held, polar_harmonics

from gyrobench.engine.session import Session
from gyrobench.system.system import InvalidConfigurationError, load_system

NAME = "servo_polar"
LIVE = {
    **DAY50, "route": "combination", "nuisances": "none", "wanted": 0.002 * DPH,
    "gyro.markov_tau": 60.0, "gyro.markov": 0.004 * DPH,
    # pickoff noise of 5e-8 V/sqrt(Hz) over 10 V/rad, through the loop: what the mean NIS of a noise-free drift asks for
    "coefficients.sigma": 9.5e-8,
}  # fmt: skip
WIDE = np.full(5, 20.0 * DPH)
COLUMNS = [f"live_{kind}_{n}" for kind in ("value", "sd") for n in ("A0", "A1", "B1", "A2", "B2")]


@pytest.fixture(scope="module")
def live() -> Any:
    """Record and result of a day of 1723 s, S and N, with the standard noise of the gyro."""
    system = load_system(NAME)
    system.request("coefficients")
    with Session(system) as session:
        record = session.run(LIVE, seed=3)
    return record, system.with_values(LIVE).reduce(record)


def of(result: Any, title: str) -> list[dict[str, Any]]:
    table = next(t for t in result.tables if t.title.startswith(f"Live estimate: {title}"))
    return [dict(zip(table.columns, row, strict=True)) for row in table.rows]


@pytest.mark.long
def test_end_values_are_generalized_least_squares_over_the_record(live: Any) -> None:
    """Of each mount by itself, all windows at once, with the noise of the gyro: to 1e-5 of the standard deviations."""
    record, _ = live
    windows, rows = held(record)
    z = windows.rate + earth(record)
    noise = Noise(tau=60.0, rms=0.004 * DPH, white=0.0178 * DPH, sigma=9.5e-8)
    phases = record.windows["phase"][rows]
    for phase in np.unique(phases):
        mine = phases == phase
        start, end = windows.angle_start[mine], windows.angle_end[mine]
        X = np.column_stack([np.ones(start.size), *(mean(f, k, start, end) for k in (1, 2) for f in (np.cos, np.sin))])
        R = Day(windows.t_start[mine], windows.t_end[mine]).covariance(noise)
        P = np.linalg.inv(X.T @ np.linalg.solve(R, X) + np.diag(WIDE**-2.0))
        expected, sd = P @ (X.T @ np.linalg.solve(R, z[mine])), np.sqrt(np.diag(P))
        last = {c: record.windows[c][rows][mine][-1] for c in COLUMNS}
        found = np.array(list(last.values()))
        assert (np.abs(found[:5] - expected) / sd).max() < 1e-5
        assert found[5:] == pytest.approx(sd, rel=1e-5)


def earth(record: Any) -> np.ndarray:
    """Earth rate along the table axis: -W in mount S, +W in N."""
    labels = {r.phase: r.label for r in record.run.plan}
    _, rows = held(record)
    W = record.run.parameters["site.earth_rate"]
    return np.array([-W if labels[p] == "polar S" else W for p in record.windows["phase"][rows].tolist()])


def mean(f: Any, k: int, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Of f(k angle) over an even turn, by eight points."""
    x, weight = np.polynomial.legendre.leggauss(8)
    return np.asarray(f(k * ((start + end)[:, None] + (end - start)[:, None] * x) / 2.0) @ weight / 2.0)


def test_truth_is_within_the_stated_deviations(live: Any) -> None:
    """Within four of them, at the stop and at the end."""
    record, result = live
    for mount in ("polar S", "polar N"):
        true = polar_harmonics(record, mount)
        for row in of(result, "drift over the angle"):
            if row["mount"] == mount:
                for when in ("then", "end"):
                    off = row[f"{when} / (°/h)"] - true[row["term"]] / DPH
                    assert abs(off) < 4.0 * row[f"u {when} / (°/h)"], (mount, row["term"], when)


def test_hours_saved_are_those_of_the_record(live: Any) -> None:
    """The first window with all five at 0.002 deg/h or below; the rest of the mount's plan is saved."""
    record, result = live
    _, rows = held(record)
    w = {n: x[rows] for n, x in record.windows.items()}
    total = 0.0
    for row in of(result, "time to"):
        phase = next(r.phase for r in record.run.plan if r.label == row["mount"])
        mine = w["phase"] == phase
        ready = np.all([w[c][mine] <= 0.002 * DPH for c in COLUMNS[5:]], axis=0)
        t = w["t_end"][mine] - w["t_start"][mine][0]
        assert 0 < np.argmax(ready) < ready.size - 1
        assert row["reached after / h"] == pytest.approx(t[np.argmax(ready)] / 3600.0)
        assert row["saved / h"] == pytest.approx((t[-1] - t[np.argmax(ready)]) / 3600.0)
        assert row["consistent"] == "yes" and 0.6 < row["mean NIS"] < 1.5
        total += row["saved / h"]
    caption = next(t.caption for t in result.tables if t.title.startswith("Live estimate: time"))
    assert caption.startswith("Standard deviation wanted of mean and harmonics: 0.002 °/h.")
    assert any(f"would have saved {total:.1f} h of" in s for s in result.summary)


def test_coefficients_had_it_stopped(live: Any) -> None:
    """Those of the record cut there by hand, beside those of the whole; less is known of every one."""
    record, result = live
    w, cut = record.windows, np.ones(record.windows["phase"].size, dtype=bool)
    for phase in np.unique(w["phase"]):
        rows = np.flatnonzero((w["phase"] == phase) & (np.max([w[c] for c in COLUMNS[5:]], axis=0) <= 0.002 * DPH))
        if rows.size:
            cut[(w["phase"] == phase) & (np.arange(cut.size) > rows[0])] = False
    part = {n: x[cut] for n, x in w.items() if not n.startswith("live_")}
    assert part["phase"].size < w["phase"].size - 50
    expected = {c.name: c for c in load_system(NAME).reduce(type(record)(part, {}, record.run)).coefficients}
    rows = of(result, "coefficients, had")
    assert [r["coefficient"] for r in rows] == [c.name for c in result.coefficients] == list(expected)
    for row, c in zip(rows, result.coefficients, strict=True):
        assert (row["whole plan"], row["u"]) == (c.estimate, c.u)
        assert row["left then"] == expected[c.name].estimate and row["u then"] == expected[c.name].u > c.u


def test_stopped_too_early_to_be_estimable(live: Any) -> None:
    """Left after one window (no filter says so): the table says why there is nothing to compare."""
    record, _ = live
    windows = {**record.windows, "live_may_stop": np.ones(record.windows["phase"].size)}
    result = load_system(NAME).reduce(type(record)(windows, {}, record.run))
    table = next(t for t in result.tables if "had the test been left" in t.title)
    assert table.caption.startswith("Not estimable")
    assert table.rows[0][0].startswith("phase 2 (polar S) has 1 windows: at least 8 are needed; phase 4")


@pytest.mark.long
def test_what_is_not_reached_is_said(live: Any) -> None:
    """may_stop never set in mount N: nothing is saved there, and the summary names it."""
    record, _ = live
    phase = next(r.phase for r in record.run.plan if r.label == "polar N")
    windows = {**record.windows, "live_may_stop": record.windows["live_may_stop"] * (record.windows["phase"] != phase)}
    result = load_system(NAME).with_values(LIVE_OPTIONS).reduce(type(record)(windows, {}, record.run))
    north = next(r for r in of(result, "time to") if r["mount"] == "polar N")
    assert north["saved / h"] is None and north["reached after / h"] is None
    assert any("the wanted uncertainty was not reached in polar N" in s for s in result.summary)


LIVE_OPTIONS = {n: v for n, v in LIVE.items() if "." not in n and n != "nuisances"}


def test_without_the_slot_nothing_is_said(live: Any) -> None:
    record, result = live
    windows = {n: x for n, x in record.windows.items() if not n.startswith("live_")}
    plain = load_system(NAME).reduce(type(record)(windows, {}, record.run))
    assert not [t for t in plain.tables if t.title.startswith("Live")]
    assert not [s for s in plain.summary if "live" in s]
    assert [c.estimate for c in plain.coefficients] == [c.estimate for c in result.coefficients]


def test_wanted_of_nothing_is_refused() -> None:
    with pytest.raises(InvalidConfigurationError, match="wanted = 0: no estimate reaches"):
        load_system(NAME).with_values({"wanted": 0.0}).refuse()


def test_the_estimator_is_told_the_noise_of_the_gyro(live: Any) -> None:
    p = live[0].run.parameters
    assert p["coefficients.tau"] == p["gyro.markov_tau"] == 60.0 and p["coefficients.rms"] == p["gyro.markov"]
    assert p["coefficients.white"] == p["gyro.white"] and p["coefficients.wanted"] == [0.002 * DPH] * 5
    assert not [n for n in live[0].run.notes if "coefficients" in n]
