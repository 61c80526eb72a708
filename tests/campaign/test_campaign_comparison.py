"""Two campaigns: what differs beyond chance is named, what chance does is not; pairs, shared seeds, the command."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest
import synthetic_campaign as synthetic
from commanding import Command
from scipy import stats

from gyrobench.bench import UsageError
from gyrobench.campaign.analysis.campaign_comparison import compare_campaigns
from gyrobench.campaign.analysis.intervals import effective_runs

AXES = [{"name": "latitude", "kind": "grid", "unit": "°"}, {"name": "seed", "kind": "seed", "unit": ""}]


def campaign(name: str, seed: Any, latitude: Any, estimate: Any, u: Any = 0.1, **more: Any) -> Any:
    """Return what stands for a stored campaign of a measure m whose truth is 0."""
    n = len(estimate)
    u = np.broadcast_to(u, n)
    rows = pd.DataFrame(
        {
            "state": "done", "verdict": None, "data": None, "seed": seed, "in.latitude": latitude,
            "m.estimate": estimate, "m.u": u, "m.lo": estimate - 2.0 * u, "m.hi": estimate + 2.0 * u, "m.truth": 0.0,
            **more,
        }
    )  # fmt: skip
    definition = {"system": "s", "options": {}, "parts": {}, "versions": {}}
    return SimpleNamespace(name=name, url=name, axes=AXES, units={}, definition=definition, table=lambda: rows)


def clear(doc: Any) -> set[str]:
    return {f"{t['name']}.{t['quantity']}" for t in doc["tests"] if t["beyond_chance"]}


def test_pairs_show_what_common_noise_hides() -> None:
    rng = np.random.default_rng(3)
    noise, seeds, at = rng.normal(0.0, 0.1, 60), np.arange(60), np.zeros(60)
    a = campaign("a", seeds, at, noise)
    b = campaign("b", seeds[::-1], at, noise[::-1] + 0.01 + 0.002 * rng.normal(size=60))
    doc = compare_campaigns(a, b)
    assert doc["pairs"] == 60
    assert clear(doc) == {"m.error"}
    test = next(t for t in doc["tests"] if t["quantity"] == "error")
    x, y = a.table()["m.estimate"].to_numpy(), b.table().sort_values("seed")["m.estimate"].to_numpy()
    oracle = stats.ttest_rel(y, x)
    assert test["p"] == pytest.approx(oracle.pvalue)
    assert (test["low"], test["high"]) == pytest.approx(tuple(oracle.confidence_interval()))
    others = compare_campaigns(a, campaign("c", seeds + 100, at, b.table()["m.estimate"].to_numpy()))
    assert others["pairs"] == 0 and not clear(others)
    assert "do not form pairs" in others["answer"][0]
    welch = next(t for t in others["tests"] if t["quantity"] == "error")
    assert welch["p"] == pytest.approx(stats.ttest_ind(y, x, equal_var=False).pvalue)


def test_spread_u_and_coverage_are_told_apart() -> None:
    rng = np.random.default_rng(5)
    seeds, at = np.arange(300), np.zeros(300)
    noise = rng.normal(0.0, 0.1, 300)
    a = campaign("a", seeds, at, noise)
    assert clear(compare_campaigns(a, campaign("b", seeds, at, 1.5 * noise))) == {"m.spread", "m.coverage"}
    doc = compare_campaigns(a, campaign("c", seeds, at, noise, 0.05))
    assert clear(doc) == {"m.u", "m.coverage"}
    assert next(t for t in doc["tests"] if t["quantity"] == "u")["change"] == pytest.approx(0.5)
    coverage = next(t for t in doc["tests"] if t["quantity"] == "coverage")
    lost = int(((np.abs(noise) <= 0.2) & (np.abs(noise) > 0.1)).sum())  # McNemar: only these pairs differ
    assert coverage["p"] == pytest.approx(0.5 ** (lost - 1))


def test_noise_that_settings_share_is_counted_once() -> None:
    """Four seeds at fifty latitudes: what the four do to both campaigns is no evidence two hundred runs strong."""
    rng = np.random.default_rng(8)
    seeds, at = np.tile(np.arange(4), 50), np.repeat(np.arange(50.0), 4)
    own = np.array([0.05, -0.05, 0.1, -0.1])
    other = own + np.array([0.06, -0.02, 0.07, 0.02])
    x, y = own[seeds] + 0.001 * rng.normal(size=200), other[seeds]
    doc = compare_campaigns(campaign("a", seeds, at, x), campaign("b", seeds, at, y))
    test = next(t for t in doc["tests"] if t["quantity"] == "error")
    assert stats.ttest_rel(x, y).pvalue < 1e-4
    by_seed = [np.array([v[seeds == s].mean() for s in range(4)]) for v in (x, y)]
    assert test["p"] == pytest.approx(stats.ttest_rel(*by_seed).pvalue)
    assert not clear(doc)


def test_equal_campaigns_differ_in_few_comparisons() -> None:
    rng = np.random.default_rng(11)
    seeds, at = np.arange(40), np.zeros(40)
    alarms = 0
    for k in range(60):
        x, y = rng.standard_t(6, (2, 40))
        alarms += bool(
            clear(compare_campaigns(campaign("a", seeds, at, x), campaign("b", seeds + 50 * (k % 2), at, y)))
        )
    assert alarms <= 8  # 3 expected at most; more than 8 of 60 with a probability of 0.002


def test_hits_that_go_together_count_as_few_runs() -> None:
    rng = np.random.default_rng(12)
    cluster = np.repeat(np.arange(40), 25)
    alike = (rng.random(40) < 0.8)[cluster]
    assert effective_runs(alike, cluster) == pytest.approx(40, rel=0.1)
    independent = rng.random(1000) < 0.8
    assert effective_runs(independent, cluster) > 600
    assert effective_runs(independent, np.zeros(1000, int)) == 1.0


def test_command_compares_campaigns(command: Command, tmp_path: Path) -> None:
    a, b = (synthetic.sweep(tmp_path / name, 40, seed) for name, seed in (("a", 1), ("b", 1)))
    code, out, _ = command("compare", a, b, "--out", tmp_path / "same")
    assert code == 0
    assert "All of them are identical to the last bit." in out
    c = synthetic.sweep(tmp_path / "c", 40, 2)
    code, out, _ = command("compare", a, c, "--out", tmp_path / "other", "--json")
    assert code == 0
    assert json.loads(out)["pairs"] == 0
    assert (tmp_path / "other" / "comparison.pdf").is_file()
    assert "Measures" in (tmp_path / "other" / "comparison.html").read_text(encoding="utf-8")
    (tmp_path / "run").mkdir()
    code, _, err = command("compare", a, tmp_path / "run")
    assert code == 2 and "not a campaign" in err
    assert command("compare", a, b, c)[0] == 2


def test_nothing_in_common_is_refused() -> None:
    a = campaign("a", [1, 2], [0.0, 0.0], np.zeros(2))
    b = campaign("b", [1, 2], [0.0, 0.0], np.zeros(2))
    b.units = {"m.estimate": "°/h"}
    with pytest.raises(UsageError, match="nothing to compare"):
        compare_campaigns(a, b)
