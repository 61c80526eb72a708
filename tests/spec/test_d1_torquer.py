"""TEST-TORQUER: the table of Hu 1981, its errata, refusals, recovery of a made torquer."""

from __future__ import annotations

import importlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from reducing import named

from gyrobench.record.csv_reader import DataError
from gyrobench.reduction.estimation.verdict import conclude
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import load_system

system = load_system("torquer_scale_factor")
R: Any = importlib.import_module(".reduction", type(system).__module__)
BOOK = Path(__file__).parents[2] / "systems" / "torquer_scale_factor" / "book_table.csv"
DPH = math.pi / 180 / 3600
CURRENTS = (1, 5, 10, 20, 40, 60, 80, 100)
PRINTED_K = (17.184, 17.169, 17.166, 17.160, 17.172, 17.173, 17.170, 17.171)


@pytest.fixture(scope="module")
def book() -> Any:
    return system.reduce(system.read_measured(BOOK, {}))


@pytest.mark.long
def test_printed_table(book: Any) -> None:
    """[LIN-TABLE] K = 17.1706 (printed 17.171); linearity with K = 17.171."""
    assert named(book)["K"].estimate == pytest.approx(17.170625, abs=1e-9)
    assert named(book)["K"].unit == "°/h/mA"
    assert round(named(book)["K"].estimate, 3) == 17.171
    rows = book.tables[0].rows
    assert [r[0] for r in rows] == pytest.approx(CURRENTS)
    assert [r[3] for r in rows] == pytest.approx(PRINTED_K)
    column = [round(r[5], 3) for r in rows]
    assert column == [0.076, -0.012, -0.029, -0.064, 0.006, 0.012, -0.006, 0.0]
    assert [r[4] for r in rows] == pytest.approx([(k / 17.170625 - 1) * 100 for k in PRINTED_K])
    assert any("computed, not measured" in w for w in book.warnings)
    json.dumps(book.as_dict(), allow_nan=False)


def test_errata(book: Any) -> None:
    """E48: K = -omega/i would be negative, the printed K is not.  E49: 5 mA is -0.01 %, printed +0.01 %."""
    assert named(book)["K"].estimate > 0 > -named(book)["K"].estimate
    printed = (0.08, 0.01, -0.03, -0.06, 0.01, 0.01, -0.01, 0.0)
    column = [r[5] for r in book.tables[0].rows]
    for n, (mine, theirs) in enumerate(zip(column, printed, strict=True)):
        assert (abs(mine - theirs) < 0.006) == (n != 1)
    assert column[1] == pytest.approx(-0.0116, abs=1e-4)


def made(
    K: float = 17.0, cubic: float = 0.0, drift: float = 0.3, noise: float = 0.0, seed: int = 1
) -> dict[str, np.ndarray]:
    """Rows of a torquer K (1 + cubic (i/100 mA)^2), deg/h/mA, with drift in deg/h and marks ``noise`` (rad) off."""
    i = np.array(CURRENTS, dtype=float)
    theta = np.radians(np.where(i <= 20, 10.0, 100.0))
    rate = K * (1 + cubic * (i / 100) ** 2) * i * DPH
    error = np.random.default_rng(seed).normal(size=(2, i.size)) * noise / theta
    plus, minus = (rate + drift * DPH) * (1 + error[0]), (rate - drift * DPH) * (1 + error[1])
    return {"current": i * 1e-3, "rate_plus": plus, "rate_minus": minus, "range_plus": theta, "range_minus": theta}


def test_drift_cancels_and_is_reported() -> None:
    """[SF-APP1]"""
    c = named(R.Reduction.reduce(made(drift=0.3)))
    assert c["K"].estimate == pytest.approx(17.0, rel=1e-12)
    assert c["K_LS"].estimate == pytest.approx(17.0, rel=1e-12)
    assert c["drift"].estimate == pytest.approx(0.3, rel=1e-9)


def test_cubic_torquer() -> None:
    r = R.Reduction.reduce(made(cubic=1e-3, noise=1e-5))
    c = named(r)
    assert c["K_3/K_1"].estimate == pytest.approx(0.1, abs=3 * c["K_3/K_1"].u) and c["K_3/K_1"].u < 0.005
    assert r.tests[0].p < 1e-4 and "depends on the current" in r.tests[0].finding
    assert c["K_1"].estimate == pytest.approx(17.0, abs=4 * c["K_1"].u)


@pytest.mark.long
def test_intervals_cover() -> None:
    """Constant mark error: sd of K_n is K e/(sqrt2 Theta), so ten times smaller over 100 than over 10 degrees."""
    runs = 400
    hits = dict.fromkeys(("K", "K_LS", "K_1", "K_3/K_1", "drift"), 0)
    truth = {"K": 17.0, "K_LS": 17.0, "K_1": 17.0, "K_3/K_1": 0.0, "drift": 0.3}
    ratio = []
    for seed in range(runs):
        c = named(R.Reduction.reduce(made(noise=1e-4, seed=seed)))
        for n in hits:
            hits[n] += c[n].interval[0] <= truth[n] <= c[n].interval[1]
        ratio.append((c["K_LS"].estimate - 17.0) / (c["K"].estimate - 17.0))
    for n, h in hits.items():
        assert abs(h / runs - 0.95) < 3.3 * math.sqrt(0.95 * 0.05 / runs), (n, h / runs)
    assert np.median(np.abs(ratio)) < 0.5  # weighing pays


def test_ammeter() -> None:
    plain, with_b = (
        named(R.Reduction.reduce(made(noise=1e-5), R.TorquerSetup(sizes={"u_current": u})))["K"] for u in (0.0, 1e-4)
    )
    assert with_b.u == pytest.approx(math.hypot(plain.u, 17.0e-4), rel=1e-3)
    limits = {"K": (16.9, 17.1), "linearity": (-1e-6, 1e-6)}
    r = conclude(R.Reduction.reduce(made(noise=1e-5), R.TorquerSetup(sizes={"u_current": 1e-4})), None, limits)
    assert named(r)["K"].verdict == "pass" and r.verdict in ("fail", "inconclusive")


@pytest.mark.parametrize(("change", "text"), [
    ({"rate_minus": None}, "rate_minus is missing.*one sense alone"),
    ({"rate_plus": np.full(8, np.nan)}, "row 1: rate_plus is no finite number .both senses"),
    ({"current": np.r_[0.0, CURRENTS[1:]] * 1e-3}, "row 1: current 0 mA: give the magnitude, larger than zero"),
    ({"current": -np.array(CURRENTS) * 1e-3}, "row 1: current -1 mA"),
    ({"rate_minus": -np.ones(8)}, "give magnitudes"),
    ({"range_minus": np.full(8, 0.5)}, "row 1: ranges 10° and 28.6.*same angle range"),
    ({"range_minus": None}, "belong together"),
    ({"current": np.full(8, 1e-3)}, "same current twice"),
    ({"current": np.ones(3)}, "different length"),
])  # fmt: skip
def test_refusals(change: dict[str, Any], text: str) -> None:
    rows = {**made(), **change}
    with pytest.raises(ReductionError, match=text):
        R.Reduction.reduce({n: v for n, v in rows.items() if v is not None})


def test_two_currents_are_too_few() -> None:
    with pytest.raises(ReductionError, match="2 currents: at least 3"):
        R.Reduction.reduce({n: v[:2] for n, v in made().items()})


@pytest.mark.long
def test_files(tmp_path: Path) -> None:
    """Wrong units and missing columns are refused by name; other units of the same kind are converted."""
    text = BOOK.read_text("utf-8")
    bad = tmp_path / "bad.csv"
    bad.write_text(text.replace("rate_plus [deg/h]", "rate_plus [mA]"), "utf-8")
    with pytest.raises(DataError, match=r"'rate_plus': wrong unit \[mA\]"):
        load_system("torquer_scale_factor").read_measured(bad, {})
    good = tmp_path / "good.csv"
    good.write_text(text.replace("rate_plus [deg/h]", "rate_plus [arcsec/s]"), "utf-8")
    s = load_system("torquer_scale_factor")
    r = s.reduce(s.read_measured(good, {"u_current": "0.01%"}))
    assert named(r)["K"].estimate == pytest.approx(17.170625, abs=1e-9) and len(r.budget) == 2
    assert r.provenance["title"].startswith("Torquer of a floated gyro")
    assert "current [mA]" in s.measured_data.template
