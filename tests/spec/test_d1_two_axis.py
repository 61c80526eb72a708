"""TEST-TUMBLE2-SDF: geometry, ratios, recovery, condition, errata, refusals."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
import two_axis as T
from bad_records import cut, differs, message, put

from gyrobench import drift, frames

DPH = T.DPH
NAMES = drift.terms(9)


def random_truth(seed: int, names: tuple[str, ...] = NAMES) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    return dict(zip(names, rng.uniform(0.1, 1.0, len(names)) * rng.choice([-1, 1], len(names)) * DPH, strict=True))


# ------------------------------------------------------------------------------------------ geometry
@pytest.mark.parametrize("latitude", [0.0, 33.0, -61.0])
def test_positions(latitude: float) -> None:
    """[TUM2AX-GEOM] the table part's attitude is R_x(n th) R_y(m th) C0; gamma of 3-47..3-49; IA normal to p."""
    phi, m, n = math.radians(latitude), 5, 1
    c, s = math.cos(phi), math.sin(phi)
    theta = np.linspace(0.0, 2.0 * math.pi, 41)
    C = T.geometry.attitude(phi, m * theta, n * theta)
    for j, t in enumerate(theta):
        np.testing.assert_allclose(C[j], T.attitude(phi, m * t, n * t), atol=1e-14)
        gamma = [
            -c * math.cos(m * t),
            -c * math.sin(m * t) * math.sin(n * t) - s * math.cos(n * t),
            -c * math.sin(m * t) * math.cos(n * t) + s * math.sin(n * t),
        ]
        np.testing.assert_allclose(-C[j] @ frames.U, gamma, atol=1e-14)
    np.testing.assert_allclose(C[:, 0] @ frames.pole(phi), 0.0, atol=1e-14)


def test_ratios_with_twelve_frequencies() -> None:
    """[TUM2AX-RATIO] 5:1 and 1:5 are the smallest, frequencies 1..12; nothing with m, n <= 4."""
    good = []
    for m in range(1, 9):
        for n in range(1, 9):
            if math.gcd(m, n) == 1 and not T.geometry.harmonic_problems(0.8, m, n, 99):
                good.append((m, n))
    assert {(5, 1), (1, 5)} <= set(good) and not any(m <= 4 and n <= 4 for m, n in good)
    assert min(m + n for m, n in good) == 6
    for m, n in ((5, 1), (1, 5)):
        assert sorted(map(abs, T.geometry.frequencies(m, n))) == list(range(1, 13))
        assert T.geometry.harmonic_problems(0.8, m, n, 25) == []
        assert "24 positions; " in T.geometry.harmonic_problems(0.8, m, n, 24)[0]
    assert "at least 33" in T.geometry.harmonic_problems(0.8, 7, 1, 32)[0]  # highest frequency 2 (7 + 1) = 16
    assert T.geometry.harmonic_problems(0.8, 7, 1, 33) == []
    assert "divide by sin φ" in T.geometry.harmonic_problems(0.0, 5, 1, 36)[0]


# ------------------------------------------------------------------------------------------ recovery
@pytest.mark.parametrize("latitude", [12.0, 45.75, -33.0, 78.0])
@pytest.mark.parametrize(("m", "n", "positions"), [(5, 1, 25), (1, 5, 36), (7, 1, 40), (2, 1, 36), (3, 2, 36)])
def test_recovery(latitude: float, m: int, n: int, positions: int) -> None:
    """[TUM2AX-REDUCE, TUM2AX-LS] both ways to 1e-9 of the largest; no closed value where the frequencies collide."""
    truth = random_truth(int(latitude) + m + 90)
    s = T.setup(latitude, m=m, n=n, truth=truth)
    r = T.reduction.Reduction.reduce(T.record(s, truth, positions), s)
    scale = max(abs(c.truth) for c in r.coefficients)
    assert [c.name for c in r.coefficients] == list(NAMES) and r.rank == 9
    for c in r.coefficients:
        assert abs(c.estimate - c.truth) < 1e-9 * scale, c.name
        if max(m, n) >= 5:
            assert abs(c.closed - c.truth) < 1e-9 * scale, c.name
        else:
            assert c.closed is None
    assert any("No closed-form estimates" in w for w in r.warnings) == (max(m, n) < 5)


def test_equator_needs_least_squares() -> None:
    truth = random_truth(3)
    s = T.setup(0.0, truth=truth)
    r = T.reduction.Reduction.reduce(T.record(s, truth), s)
    assert all(abs(c.estimate - c.truth) < 1e-9 and c.closed is None for c in r.coefficients)
    assert "divide by sin φ" in message(T.reduction, T.record(s, truth), T.setup(0.0, harmonic=True))


def test_any_positions_will_do_for_least_squares() -> None:
    """Scattered angles, both read: the harmonic route says why not."""
    truth = random_truth(5)
    s = T.setup(truth=truth)
    w = T.record(s, truth)
    rng = np.random.default_rng(1)
    outer, inner = rng.uniform(0, 6.28, 36).repeat(2), rng.uniform(0, 6.28, 36).repeat(2)
    for a, v in (("outer", outer), ("inner", inner)):
        w[f"{a}_start"] = w[f"{a}_end"] = v
    C = [T.attitude(s.latitude, a, b) for a, b in zip(outer, inner, strict=True)]
    xyz = np.array([-c @ frames.U for c in C]) * s.gravity / frames.G0
    w["mean"] = -drift.drift(xyz, truth) / s.k
    r = T.reduction.Reduction.reduce(w, s)
    assert all(abs(c.estimate - c.truth) < 1e-9 for c in r.coefficients)
    assert any("the inner angle is not 1/5 of the outer" in t and "not equally spaced" in t for t in r.warnings)


def test_opposite_polarity_and_cycles() -> None:
    truth = random_truth(6)
    s = T.setup(truth=truth, polarity="book")
    w = T.record(s, truth, 30, each=1, cycles=2)
    w["mean"] = -w["mean"]
    r = T.reduction.Reduction.reduce(w, s)
    assert all(abs(c.estimate - c.truth) < 1e-9 and abs(c.closed - c.truth) < 1e-9 for c in r.coefficients)
    rng = np.random.default_rng(2)
    w = T.record(T.setup(), truth, 30, cycles=2, noise=lambda: rng.normal() * 0.01 * DPH)
    names = {t.name: t.p for t in T.reduction.Reduction.reduce(w, T.setup()).tests}
    assert names["cycle to cycle"] > 1e-3 and names["harmonics of the positions"] > 1e-3
    w["mean"][60:] += 0.03 * np.cos(w["outer_start"][60:]) * DPH / T.K  # D_I of the second cycle
    names = {t.name: t.p for t in T.reduction.Reduction.reduce(w, T.setup()).tests}
    assert names["cycle to cycle"] < 1e-3


# ------------------------------------------------------------------------------------------ condition
@pytest.mark.parametrize(("m", "n", "expected"), [
    (5, 1, (6.9, 6.6, 7.2, 27)), (2, 1, (16, 15, 28, 282)), (3, 2, (9.1, 7.5, 8.3, 27)),
])  # fmt: skip
def test_condition_numbers(m: int, n: int, expected: tuple[float, ...]) -> None:
    """[TUM2AX-LS] N = 36 at 0, 20, 45.75 and 70 degrees."""
    for latitude, value in zip((0.0, 20.0, 45.75, 70.0), expected, strict=True):
        found = np.linalg.cond(T.geometry.design(math.radians(latitude), m, n, 36))
        assert abs(found - value) <= (0.05 if value < 10 else 0.5), (latitude, found)


@pytest.mark.parametrize("latitude", [0.0, 20.0, 45.75, 70.0])
def test_one_to_one_has_rank_eight(latitude: float) -> None:
    assert np.linalg.matrix_rank(T.geometry.design(math.radians(latitude), 1, 1, 36), tol=1e-9) == 8
    (text,) = T.geometry.refusals(math.radians(latitude), 1, 1, 36)
    assert "rank 8 of 9, not estimable: " in text
    s = T.setup(latitude, m=1, n=1)
    assert "rank 8" in message(T.reduction, T.record(s, random_truth(1)), s)


def test_rank_at_the_pole() -> None:
    for m, n in ((5, 1), (1, 5), (2, 1), (3, 2)):
        assert np.linalg.matrix_rank(T.geometry.design(math.pi / 2, m, n, 36), tol=1e-9) == 5
    found = T.geometry.refusals(-math.pi / 2, 5, 1, 36)
    assert "rank 5 of 9" in found[0] and "85°" in found[1]
    assert "condition" in T.geometry.refusals(math.radians(85.1), 5, 1, 36)[0]
    assert T.geometry.refusals(math.radians(85.0), 5, 1, 36) == T.geometry.refusals(0.0, 5, 1, 9 + 16) == []


# ------------------------------------------------------------------------------------------ errata
@pytest.mark.parametrize(("latitude", "m", "n"), [(41.0, 5, 1), (-25.0, 1, 5)])
def test_corrected_and_printed_formulas(latitude: float, m: int, n: int) -> None:
    """[TUM2AX-REDUCE, TUM2AX-ERR, E30-E34] amplitudes by hand from a fine Fourier sum, printed forms that fail."""
    truth = random_truth(9)
    s = T.setup(latitude, m=m, n=n, gravity=frames.G0)
    w = T.record(s, truth, 72, each=1)
    D = {k: v / DPH for k, v in truth.items()}
    theta, y = w["outer_start"] / m, -s.k * w["mean"] / DPH
    A, B = np.zeros(13), np.zeros(13)
    A[0] = y.mean()
    for j, f in enumerate(T.geometry.frequencies(m, n), 1):  # orthogonal: twelve different frequencies, 72 points
        A[j], B[j] = 2 * np.mean(y * np.cos(f * theta)), 2 * np.mean(y * np.sin(f * theta))
    hand = T.closed.expected(D, s.latitude, frames.G0)
    np.testing.assert_allclose([A, B], hand, atol=1e-11)
    np.testing.assert_allclose(T.closed.amplitudes(theta, y, m, n), [A, B], atol=1e-11)
    phi = s.latitude
    c, sn, s2 = math.cos(phi), math.sin(phi), math.sin(2 * phi)
    # the model's own lines, written down again
    assert A[0] == pytest.approx(D["D_F"] + D["D_II"] * c * c / 2 + D["D_SS"] * (c * c / 4 + sn * sn / 2))
    assert A[2] == pytest.approx(-D["D_O"] * c / 2 + D["D_IO"] * s2 / 4) and A[5] == pytest.approx(-D["D_I"] * c)
    assert B[6] == pytest.approx(D["D_OS"] * (c * c / 4 - sn * sn / 2)) and B[3] == pytest.approx(D["D_S"] * sn)
    assert T.closed.separate(A, B, phi, frames.G0) == pytest.approx(D, abs=1e-10)
    # E30: signs of cos(m + 2n), cos(2m - n), the sine of 2n, names of the linear terms
    assert differs(-D["D_SS"] * s2 / 4, A[10]) and differs(-D["D_IO"] * c * c / 4, A[7])
    assert differs(D["D_OS"] * (c * c - sn * sn) / 4, B[6])
    assert differs(-D["D_I"] * c / 2 + D["D_IS"] * s2 / 4, B[2])
    # E31: A0 with -1/4, B7 with -1/4, D_x in A2, D_xx in A4, D_x in B3
    assert differs(D["D_F"] + D["D_II"] * c * c / 2 + D["D_SS"] * (sn * sn / 2 - c * c / 4), A[0])
    assert differs(-D["D_IS"] * c * c / 4, B[7]) and differs(-D["D_I"] * c / 2 + D["D_IO"] * s2 / 4, A[2])
    assert differs(-D["D_II"] * c * c / 8, A[4]) and differs(D["D_I"] * sn, B[3])
    # E32 D_0, E33 D_z, E34 D_zz
    assert differs(A[0] + A[9] + 3 * (A[4] + A[12]) - A[6], D["D_F"])
    assert differs(-(B[8] / sn - (B[2] + B[4]) / c) / 2, D["D_S"])
    assert differs((A[10] - A[12]) / s2 - 2 * (A[4] + A[12]) / c**2, D["D_SS"])


def test_consistency_of_the_harmonics_is_shown() -> None:
    """What the model ties together differs by noise only; a gyro that goes with the positions otherwise shows it."""
    truth = random_truth(11)
    s = T.setup()
    w = T.record(s, truth)
    (table,) = [t for t in T.reduction.Reduction.reduce(w, s).tables if t.title == "Consistency of the harmonics"]
    assert len(table.rows) == 8 and all(abs(row[2]) < 1e-9 for row in table.rows)
    w["mean"] = w["mean"] - 0.01 * DPH * np.sin(w["outer_start"]) / s.k  # B5 of a gyro has no cause in the model
    rng = np.random.default_rng(1)
    w["mean"] += rng.normal(size=72) * 1e-3 * DPH / s.k
    r = T.reduction.Reduction.reduce(w, s)
    (table,) = [t for t in r.tables if t.title == "Consistency of the harmonics"]
    assert {row[0]: row[2] for row in table.rows}["B5"] == pytest.approx(0.01, abs=1e-3)
    assert {t.name: t.p for t in r.tests}["harmonics of the positions"] < 1e-6


# ------------------------------------------------------------------------------------------ folding, set-up
def test_d_oo_folds() -> None:
    truth = random_truth(2, drift.NAMES)
    w = T.record(T.setup(), truth)
    assert "set fold" in message(T.reduction, w, T.setup(truth=truth))
    r = T.reduction.Reduction.reduce(w, T.setup(truth=truth, fold=True))
    oo, g2 = truth["D_OO"] / DPH, (9.8 / frames.G0) ** 2
    extra = {"D_F + γ² D_OO": ("D_F", g2), "D_II − D_OO": ("D_II", -1.0), "D_SS − D_OO": ("D_SS", -1.0)}
    assert set(extra) <= {c.name for c in r.coefficients}
    for c in r.coefficients:
        name, share = extra.get(c.name, (c.name, 0.0))
        assert c.estimate == pytest.approx(truth[name] / DPH + share * oo, abs=1e-9)
        assert c.truth == pytest.approx(c.estimate, abs=1e-9)


@pytest.mark.parametrize(("axis", "which"), [(0, "input"), (1, "output"), (2, "spin")])
def test_tilted_gyro_shifts_as_the_budget_says(axis: int, which: str) -> None:
    """Turned by 20 arcsec against the plate: estimates change by what the budget names, sign apart (with noise, and
    more of it than tilt, or the noise model would be one of the tilt itself).
    """
    truth, size = random_truth(12), math.radians(20.0 / 3600.0)
    s = T.setup(truth=truth, u_mount=size, nuisances=False)  # the budget is of one model
    turned = frames.rotation(np.eye(3)[axis], size)
    found = []
    for rotation in (None, turned):
        rng = np.random.default_rng(4)
        w = T.record(s, truth, noise=lambda rng=rng: rng.normal() * 0.01 * DPH, turned=rotation)
        found.append(T.reduction.Reduction.reduce(w, s))
    noisy, tilted = found
    shift = {c.name: d.estimate - c.estimate for c, d in zip(noisy.coefficients, tilted.coefficients, strict=True)}
    lines = {b.coefficient: b.contribution for b in noisy.budget if f"its {which} axis" in b.source}
    assert lines and max(lines.values()) > 1e-5
    for name, value in lines.items():
        assert abs(shift[name]) == pytest.approx(value, rel=0.1, abs=0.03 * max(lines.values())), name


# ------------------------------------------------------------------------------------------ refusals
@pytest.mark.parametrize(("change", "text"), [
    (put("mean", 7, math.nan), "column mean: non-finite number in window 8"),
    (lambda w: w.pop("inner_end"), "column inner_end is missing"),
    (lambda w: cut(w, np.arange(0)), "no windows"),
    (lambda w: cut(w, np.r_[0, 2, 1, 3:30]), "time does not increase.*window 3"),
    (put("flagged", 9, 3), "flagged windows .saturated torquer.* window 10"),
    (put("inner_end", 5, 0.5), "row 6: the inner axis moves by .*at rest only"),
    (put("outer_end", 2, 0.5), "row 3: the outer axis moves"),
    (lambda w: cut(w, np.arange(16)), "8 different positions for 9 coefficients"),
])  # fmt: skip
def test_bad_records(change: Any, text: str) -> None:
    s = T.setup()
    w = T.record(s, random_truth(1))
    change(w)
    assert re.search(text, message(T.reduction, w, s)), message(T.reduction, w, s)


def test_bad_setups() -> None:
    w = T.record(T.setup(), random_truth(1))
    assert "gravity 8 m/s²" in message(T.reduction, w, T.setup(gravity=8.0))
    assert "scale factor k = -1" in message(T.reduction, w, T.setup(k=-1.0))
    assert "polarity 'left'" in message(T.reduction, w, T.setup(polarity="left"))
    assert "up to 85°" in message(T.reduction, w, T.setup(86.0)) and "outside −90..90" in message(
        T.reduction, w, T.setup(100.0)
    )
    refuse = T.geometry.refusals
    assert "common divisor 2; 3:1 is the same path" in refuse(0.8, 6, 2, 36)[0]
    assert "8 positions for 9 coefficients" in refuse(0.8, 5, 1, 8)[0]
    assert "at least 1" in refuse(0.8, 5, 0, 36)[0] and "outside" in refuse(2.0, 5, 1, 36)[0]
    (weak,) = T.geometry.cautions(math.radians(80.0), 2, 1, 36)
    assert weak.startswith("Condition") and "least determined: " in weak
