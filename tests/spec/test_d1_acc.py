"""TEST-ACC-MULTI: closed formulas, least squares, what few positions see, uncertainties."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from multipoint import KS, estimates, module, polynomial, reading, reduced, windows

from gyrobench.reduction.setup.window_checks import ReductionError

C, MODEL = module("closed"), module("model")
UG = 1e-6


def harmonics(k: dict[str, float], mount: str, zero: float, gamma: float, n: int) -> dict[str, float]:
    angle = 2.0 * math.pi * np.arange(n) / n
    y = np.array([reading(k, mount, a, zero, gamma) for a in angle])
    found: dict[str, float] = C.harmonics(angle, y)
    return found


def test_harmonics_by_hand() -> None:
    """theta_0 = 0, gamma = 1: sin^2 = (1 - cos 2t)/2, sin^3 = (3 sin - sin 3t)/4, sin cos = sin 2t/2, so k0 + k2/2,
    B1 = -k1 - 3/4 k3, A2 = -k2/2, B3 = k3/4, and B2 = k5/2 (X Z = sin cos) or -k4/2 (X Y = -sin cos).
    """
    k = {"k0": 1.0, "k1": 10.0, "k2": 2.0, "k3": 4.0, "k4": 6.0, "k5": 8.0}
    for mount, b2 in (("a", 4.0), ("b", -3.0)):
        h = harmonics(k, mount, 0.0, 1.0, 8)
        expected = {"A0": 2.0, "A1": 0.0, "B1": -13.0, "A2": -1.0, "B2": b2, "A3": 0.0, "B3": 1.0}
        assert h == pytest.approx(expected, abs=1e-13)


@pytest.mark.parametrize("seed", range(6))
def test_closed_formulas_return_the_truth(seed: int) -> None:
    """[ACC-EXACT] exact for any theta_0, gravity and number of positions from 7."""
    rng = np.random.default_rng(seed)
    k, gamma = polynomial(rng), float(rng.uniform(0.99, 1.01))
    for n in (7, 8, 12, 24):
        for mount, cross in (("a", "k5"), ("b", "k4")):
            zero = float(rng.uniform(-0.017, 0.017))
            found = C.formulas(harmonics(k, mount, zero, gamma, n), mount, gamma)
            # the first harmonic of k3 sin^3 has the phase theta_0 too, so theta_0 itself is exact
            assert found.pop("theta0") == pytest.approx(zero, abs=1e-13)
            assert found == pytest.approx({c: k[c] for c in ("k0", "k1", "k2", "k3", cross)}, abs=1e-13)


def test_printed_form_needs_a_small_zero_angle() -> None:
    """[ACC] 3-46 with A, B for a, b: below 1 ug at 2e-4 rad with the default terms, off by some ug at 1 degree."""
    k = {"k0": 50 * UG, "k1": 1.0, "k2": 20 * UG, "k3": 20 * UG, "k4": 20 * UG, "k5": 20 * UG}

    def worst(zero: float) -> float:
        h = harmonics(k, "a", zero, 1.0, 24)
        printed = {
            "k0": h["A0"] + h["A2"], "k1": -(h["B1"] + 3 * h["B3"]), "k2": -2 * h["A2"], "k3": 4 * h["B3"],
            "k5": 2 * h["B2"],
        }  # fmt: skip
        return max(abs(v - k[n]) for n, v in printed.items())

    assert worst(2e-4) < 1 * UG
    assert worst(0.017) > 100 * UG  # k1 (1 - cos)


@pytest.mark.parametrize("seed", range(6))
def test_least_squares_return_the_truth(seed: int) -> None:
    """Ideal input, both mounts and one: 1e-9 relative; equally spaced positions need not be."""
    rng = np.random.default_rng(100 + seed)
    k, gamma = polynomial(rng), float(rng.uniform(0.99, 1.008))
    zeros = {"a": float(rng.uniform(-0.017, 0.017)), "b": float(rng.uniform(-0.017, 0.017))}
    scale = float(rng.uniform(5e3, 2e4))
    for mounts in (("a", "b"), ("a",), ("b",)):
        mine = {m: zeros[m] for m in mounts}
        seen = [n for n in KS if n not in [c for m, c in (("a", "k5"), ("b", "k4")) if m not in mounts]]
        uneven = sorted(rng.uniform(0.0, 2.0 * math.pi, 15).tolist())
        for data in (windows(k, mine, gamma, 8, scale=scale), windows(k, mine, gamma, 24, scale=scale),
                     windows(k, mine, gamma, 0, scale=scale, angles=uneven)):  # fmt: skip
            r = reduced(data, gamma, mine, scale, truth=k, zeros=mine)
            found = estimates(r)
            expected = {**{n: k[n] for n in seen}, **{f"θ₀ {m}": z for m, z in mine.items()}}
            assert found == pytest.approx(expected, abs=1e-12, rel=1e-10)
            closed = {c.name: c.closed for c in r.coefficients}
            if len(data["mean"]) == 15 * len(mine):
                assert not any(closed.values()) and any("not equally spaced" in w for w in r.warnings)
            else:
                assert all(c.closed == pytest.approx(c.estimate, abs=1e-6) for c in r.coefficients)
            json.dumps(r.as_dict(), allow_nan=False)


def test_cubic_term_aliases_into_k1_with_four_points() -> None:
    """[ACC-4PT] 1.02 and 2e-5 give 1.02002; k3 is not reported, and the name says so."""
    k = {**dict.fromkeys(KS, 0.0), "k0": 1e-4, "k1": 1.02, "k3": 2e-5}
    r = reduced(windows(k, {"a": 0.0}, 1.0, 4, turns=2), 1.0, {"a": 0.0})
    found = estimates(r)
    assert found["k1 + k3γ²"] == pytest.approx(1.02002, abs=1e-12)
    assert not any(n.startswith("k3") for n in found) and any("Four positions" in w for w in r.warnings)


@pytest.mark.parametrize("seed", range(4))
def test_four_points_give_the_combinations(seed: int) -> None:
    """By hand: opposite positions average to k0 + k2 g2 s2 + q g2 s c and k0 + k2 g2 c2 - q g2 s c with q = k5 (a) or
    -k4 (b), s, c of theta_0.  Their difference is (k2 - q tan 2 theta_0) g2 cos 2 theta_0, and k0' follows.
    """
    rng = np.random.default_rng(seed)
    k, gamma = polynomial(rng), 1.003
    zeros = {"a": 0.011, "b": -0.016}
    for mounts in (("a",), ("b",), ("a", "b")):
        mine = {m: zeros[m] for m in mounts}
        r = reduced(windows(k, mine, gamma, 4, turns=2), gamma, mine, truth=k, zeros=mine)
        found = list(estimates(r).values())
        q = {"a": k["k5"], "b": -k["k4"]}
        k0 = np.mean([k["k0"] + q[m] * gamma**2 * math.tan(2 * z) / 2 for m, z in mine.items()])
        k2 = np.mean([k["k2"] - q[m] * math.tan(2 * z) for m, z in mine.items()])
        # k3 turns theta_0 by k3 gamma2 s c2 (4e-6 rad), which goes into k2' with 4 theta_0 k2: 5e-11; both mounts share
        # one k1' and k2', though each has its own
        assert found[0] == pytest.approx(k0, abs=1e-9) and found[2] == pytest.approx(k2, abs=1e-9)
        assert found[1] == pytest.approx(k["k1"] + k["k3"] * gamma**2, abs=2e-4 * 2 * 0.016**2)
        assert found[3:] == pytest.approx(list(mine.values()), abs=4e-6)
        for c in r.coefficients[:3]:
            assert c.truth == pytest.approx(c.estimate, abs=1e-3) and c.closed == pytest.approx(c.estimate, abs=1e-3)


def test_seven_points_are_needed() -> None:
    """[ACC-MINPTS] the design of three harmonics has rank 6 with six positions, 7 with seven."""
    for n, rank in ((6, 6), (7, 7)):
        t = 2 * math.pi * np.arange(n) / n
        X = np.column_stack([np.ones(n), *(f(h * t) for h in (1, 2, 3) for f in (np.cos, np.sin))])
        assert np.linalg.matrix_rank(X) == rank
    k = polynomial(np.random.default_rng(0))
    with pytest.raises(ReductionError, match="three harmonics need at least 7"):
        reduced(windows(k, {"a": 0.0}, 1.0, 5, turns=4), 1.0, {"a": 0.0})
    with pytest.raises(ReductionError, match="rank 5 for 6 coefficients; not estimable: k3"):
        reduced(windows(k, {"a": 0.0}, 1.0, 6, turns=4), 1.0, {"a": 0.0})


def test_six_points_off_the_axes_are_enough() -> None:
    """Of three harmonics the model lacks the cosine of the third: 30, 90 ... degrees determine its six unknowns."""
    k = polynomial(np.random.default_rng(0))
    angles = [math.radians(30.0 + 60.0 * j) for j in range(6)] * 3
    r = reduced(windows(k, {"a": 1e-3}, 1.0, 0, angles=angles), 1.0, {"a": 1e-3})
    by = {c.name: c for c in r.coefficients}
    for name in ("k0", "k2", "k3", "k5"):
        assert by[name].estimate == pytest.approx(1e6 * k[name], abs=1e-3)
    assert by["k1"].estimate == pytest.approx(k["k1"], abs=1e-9)


@pytest.mark.parametrize("n", [8, 12, 24])
def test_uncertainties_are_those_of_the_method(n: int) -> None:
    """sigma(k1) = sigma sqrt(20/N)/g, (k0) sqrt(3/N), (k2) sqrt(8/N)/g2, (k3) sqrt(32/N)/g3, (k4, k5) sqrt(8/N)/g2:
    of the design that the reduction fits, and the scatter of the closed formulas.
    """
    rng = np.random.default_rng(n)
    gamma, k = 1.005, {**dict.fromkeys(KS, 2e-5), "k1": 1.0}
    factor = {
        "k0": math.sqrt(3), "k1": math.sqrt(20) / gamma, "k2": math.sqrt(8) / gamma**2, "k3": math.sqrt(32) / gamma**3,
        "k5": math.sqrt(8) / gamma**2,
    }  # fmt: skip
    data = windows(k, {"a": 0.0}, gamma, n)
    visits = MODEL.visits(data, MODEL.MultipointSetup(gravity=gamma * 9.80665, scale=9806.65, mounts={1: "a"}))
    model = MODEL.Polynomial(["a"], False)
    at, one = {"a": 0.0}, np.array([0.0, 1.0, 0.0, 0.0, 0.0])  # k1 = 1
    X = np.column_stack([model.columns(visits, at, gamma), model.slopes(visits, at, gamma, one)])
    for name, v in zip(model.terms, np.diag(np.linalg.inv(X.T @ X)), strict=False):
        assert math.sqrt(v) == pytest.approx(factor[name] / math.sqrt(n), rel=1e-4), name
    found = []
    angle = 2 * math.pi * np.arange(n) / n
    ideal = np.array([reading(k, "a", a, 0.0, gamma) for a in angle])
    for _ in range(400):
        y = ideal + 2e-6 * rng.normal(size=n)
        found.append(C.formulas(C.harmonics(angle, y), "a", gamma))
    for name, f in factor.items():
        scatter = float(np.std([x[name] for x in found], ddof=1))
        assert scatter == pytest.approx(f * 2e-6 / math.sqrt(n), rel=0.1), name


def test_effects_are_those_of_the_model() -> None:
    """lambda by 1e-6: every k by 1e-6 of itself; gravity by 1e-6: k1 by -1e-6; meter zero of 1 nA at 1 g/mA: 1 ug in
    k0; head errors of 1 arcsec: 4.85 ug at each position, sqrt(8/N) of it in k5.
    """
    k = {**dict.fromkeys(KS, 0.0), "k1": 1.0}
    more = {"u_scale": 1e-6, "u_gravity": 9.80665e-6, "u_current": 1e-9, "u_angle": math.pi / 648000.0}
    r = reduced(windows(k, {"a": 0.0, "b": 0.0}, 1.0, 12), 1.0, {"a": 0.0, "b": 0.0}, **more)
    lines = {(b.source, b.coefficient): b.contribution for b in r.budget}
    assert lines["scale λ", "k1"] == pytest.approx(1e-6) and lines["gravity", "k1"] == pytest.approx(1e-6)
    assert lines["zero of the current meter", "k0"] == pytest.approx(1.0)
    # mount a alone: rms of 2/N sum cos e sin 2t; the same for b with its own sum: cos^2 sin^2 2t averages to 1/4
    assert lines["positions of the head", "k5"] == pytest.approx(4.848 * 4 / math.sqrt(12) * 0.5, rel=1e-3)


REFUSED: list[tuple[dict[str, Any], dict[str, Any], str]] = [
    ({"points": 3}, {}, "at least 4 are needed"),
    ({"points": 8, "zeros": {"a": 0.02}}, {}, r"mount a: θ₀ = 1.146°.*mistake of the mount"),
    ({"points": 8}, {"scale": 0.0}, "scale λ = 0"),
    ({"points": 8}, {"scale": math.nan}, "scale λ = nan"),
    ({"points": 8}, {"scale": -9806.65}, "scale λ = -9806.65"),
    ({"points": 8, "gamma": 1.05}, {}, "lies outside 9.7..9.9"),
    ({"points": 0, "angles": [0.0, 1.5, 3.2, 4.7]}, {}, "4 positions must be 0°, 90°, 180° and 270°"),
    ({"points": 0, "angles": [0.0, 0.0, 1.5, 1.5, 3.2, 4.7, 6.0]}, {}, "5 positions a turn"),
]


@pytest.mark.parametrize(("made", "setup", "match"), REFUSED)
def test_refused(made: dict[str, Any], setup: dict[str, Any], match: str) -> None:
    made = {"zeros": {"a": 0.0}, "gamma": 1.0, **made}
    data = windows({**dict.fromkeys(KS, 1e-5), "k1": 1.0}, **made)
    with pytest.raises(ReductionError, match=match):
        reduced(data, made["gamma"], made["zeros"], **setup)


def test_refused_records() -> None:
    k = {**dict.fromkeys(KS, 1e-5), "k1": 1.0}
    good = windows(k, {"a": 0.0}, 1.0, 8)
    for change, match in (
        ({"mean": -good["mean"]}, "turn its sign round"),
        ({"angle_end": good["angle_end"] + 1e-3}, "row 1: the head moved by 0.0573°"),
        ({"phase": good["phase"] + 4}, "phase 5: its mount is not given"),
        ({"flagged": np.eye(8)[3]}, "flagged windows .* window 4"),
        ({"mean": np.where(np.arange(8) == 2, np.nan, good["mean"])}, "non-finite number in window 3"),
        ({"mean": np.zeros(8)}, "no accelerometer was read"),
    ):
        with pytest.raises(ReductionError, match=match):
            reduced({**good, **change}, 1.0, {"a": 0.0})
