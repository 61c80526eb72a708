"""TEST-TUMBLE1-SDF: recovery, errata, refusals, folding; test_d1_tumble_result.py has the rest."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import tumble as T
from bad_records import cut, differs, message, put

from gyrobench import drift, frames
from gyrobench.reduction.drift import harmonic

DPH = T.DPH
NAMES = T.NAMES


# ------------------------------------------------------------------------------------------ recovery
@pytest.mark.parametrize("latitude", [12.0, 45.75, -33.0, 78.0])
@pytest.mark.parametrize(("turn", "rate"), [(72, -10.0), (25, 7.0), (12, -10.0)])
def test_least_squares_and_closed_formulas_recover_to_1e_9(latitude: float, turn: int, rate: float) -> None:
    truth = T.random_truth(int(latitude) + turn + 90)
    s = T.setup(latitude, truth=truth)
    r = T.reduction.Reduction.reduce(T.record(s, truth, turn=turn, rate=rate), s)
    for c in r.coefficients:
        assert abs(c.estimate - c.truth) < 1e-9 * abs(c.truth), c.name
        assert abs(c.closed - c.truth) < 1e-9 * abs(c.truth), c.name
    assert [c.name for c in r.coefficients] == list(NAMES)
    assert r.rank == 9


def test_averaging_windows_are_allowed_for() -> None:
    """[AVG-SINC] 30 degree windows damp the second harmonic by 4.5 %; regressors at mid angle would show it."""
    assert np.sinc(2 * math.radians(30) / (2 * math.pi)) == pytest.approx(0.9549, abs=1e-4)
    truth = {**dict.fromkeys(NAMES, 0.0), "D_IS": DPH}
    s = T.setup(truth=truth)
    w = T.record(s, truth, turn=12)
    assert T.reduction.Reduction.reduce(w, s).coefficients[-1].estimate == pytest.approx(1.0, rel=1e-9)
    middle = (w["angle_start"] + w["angle_end"]) / 2
    w2 = {**w, "angle_start": middle - 1e-3, "angle_end": middle + 1e-3}
    damped = next(c for c in T.reduction.Reduction.reduce(w2, s).coefficients if c.name == "D_IS")
    assert damped.estimate == pytest.approx(0.9549, abs=2e-3)


def test_opposite_polarity() -> None:
    """Current of Hu 1981, k i = omega_d - omega_IA: the same coefficients from the negated current."""
    truth = T.random_truth(4)
    s = T.setup(truth=truth)
    w = T.record(s, truth)
    w["mean"] = -w["mean"]
    r = T.reduction.Reduction.reduce(w, T.setup(truth=truth, polarity="book"))
    assert all(abs(c.estimate - c.truth) < 1e-9 for c in r.coefficients)


def test_uncertainties_follow_the_formulas_of_the_method() -> None:
    """[TUM1-UNC] sigma = sigma_s = 1, N = 36 at 45.75 deg: closed-form factors 0.239 0.333 0.685 1.512 0.707; LS D_y
    0.160.

    With one dwell window the statics carry sigma_s; least squares does not do worse than the closed formulas.
    """
    from gyrobench.reduction.estimation.regression import least_squares

    s = T.setup(gravity=frames.G0)
    phi = s.latitude
    rows = [frames.to_face(-frames.U, s.faces[p], s.base, a) for p in (2, 4) for a in np.radians(np.arange(0, 360, 10))]
    rows += [frames.to_face(-frames.U, s.faces[p], s.base, 0.0) for p in (1, 3)]
    X = drift.regressors(np.array(rows), NAMES)
    fit = least_squares(X, np.zeros(74), NAMES)
    u = dict(zip(NAMES, np.sqrt(np.diag(fit.gain @ fit.gain.T)), strict=True))
    c, s2 = math.cos(phi), math.sin(2 * phi)
    assert u["D_I"] == pytest.approx(1 / (6 * c), rel=1e-6) and u["D_I"] == pytest.approx(0.239, abs=1e-3)
    assert u["D_IO"] == pytest.approx(2 / (6 * s2), rel=1e-6) and u["D_IO"] == pytest.approx(0.333, abs=1e-3)
    assert u["D_IS"] == pytest.approx(2 / (6 * c * c), rel=1e-6) and u["D_IS"] == pytest.approx(0.685, abs=1e-3)
    assert u["D_II"] == pytest.approx(math.sqrt(6 / 36 + 2) / (2 * c * c), rel=1e-3)
    assert u["D_F"] == pytest.approx(1 / math.sqrt(2), rel=1e-3)
    assert u["D_O"] == pytest.approx(0.160, abs=1e-3)


# ------------------------------------------------------------------------------------------ errata
@pytest.fixture(scope="module")
def amplitudes() -> tuple[dict[str, float], dict[str, float], float, float, dict[str, float]]:
    """A0 A1 B1 A2 B2 of both mounts, the dwells and the truth, in deg/h, at 41 deg and g = g0."""
    truth = T.random_truth(9)
    s = T.setup(41.0, gravity=frames.G0, truth=truth)
    w = T.record(s, truth)
    y = -s.k * w["mean"] / DPH

    def mount(p: int) -> dict[str, float]:
        f = harmonic.fit(-w["angle_start"][w["phase"] == p], -w["angle_end"][w["phase"] == p], y[w["phase"] == p])
        return dict(zip(f.names, f.beta.tolist(), strict=True))

    y3, y4 = (float(y[w["phase"] == p].mean()) for p in (1, 3))
    return mount(2), mount(4), y3, y4, {n: v / DPH for n, v in truth.items()}


def test_corrected_formulas(amplitudes: Any) -> None:
    """[TUM1-REDUCE] amplitudes and their separation."""
    one, two, y3, y4, D = amplitudes
    phi = math.radians(41.0)
    c, s, s2 = math.cos(phi), math.sin(phi), math.sin(2 * phi)
    expected_one = {
        "A0": D["D_F"] - D["D_O"] * s + 0.5 * (D["D_II"] + D["D_SS"]) * c * c,
        "A1": -D["D_S"] * c + 0.5 * D["D_OS"] * s2, "B1": -D["D_I"] * c + 0.5 * D["D_IO"] * s2,
        "A2": 0.5 * (D["D_SS"] - D["D_II"]) * c * c, "B2": 0.5 * D["D_IS"] * c * c,
    }  # fmt: skip
    expected_two = {
        "A0": D["D_F"] + D["D_O"] * s + 0.5 * (D["D_II"] + D["D_SS"]) * c * c,
        "A1": D["D_S"] * c + 0.5 * D["D_OS"] * s2, "B1": -D["D_I"] * c - 0.5 * D["D_IO"] * s2,
        "A2": 0.5 * (D["D_SS"] - D["D_II"]) * c * c, "B2": -0.5 * D["D_IS"] * c * c,
    }  # fmt: skip
    assert one == pytest.approx(expected_one, abs=1e-11)
    assert two == pytest.approx(expected_two, abs=1e-11)
    assert T.closed.formulas(one, two, y3, y4, phi, frames.G0) == pytest.approx(D, abs=1e-10)


def test_printed_formulas_fail(amplitudes: Any) -> None:
    """E20, E21: harmonic subscripts.  E22: D_z = (A12-A21)/.., D_xz = 2 B22/..  E23: D_y without k."""
    one, two, y3, y4, D = amplitudes
    phi, k = math.radians(41.0), 17.2
    c, s2 = math.cos(phi), math.sin(2 * phi)

    assert differs(-D["D_I"] * c + 0.5 * D["D_OS"] * s2, one["A1"])  # E20: D_x in the cosine of 3-14
    assert differs(0.5 * D["D_II"] * c * c, one["B2"])  # E20: D_xx in the sine of the double angle
    assert differs(-D["D_I"] * c + 0.5 * D["D_OS"] * s2, one["B1"])  # E21: D_yz in B11
    assert differs(-0.5 * D["D_II"] * c * c, two["B2"])  # E21: D_xx in B22
    assert differs(-0.5 * D["D_IS"] * c * c, one["B2"])  # E21: -1/2 in both B21 and B22
    assert differs((two["A1"] - one["A2"]) / (2 * c), D["D_S"])  # E22
    assert differs(2 * two["B2"] / (c * c), D["D_IS"])  # E22; 2 B21 and -2 B22 are right:
    assert 2 * one["B2"] / (c * c) == pytest.approx(D["D_IS"], rel=1e-9)
    assert -2 * two["B2"] / (c * c) == pytest.approx(D["D_IS"], rel=1e-9)
    assert differs((y4 / k - y3 / k) / 2, D["D_O"])  # E23: currents without the scale factor
    assert (y4 - y3) / 2 == pytest.approx(D["D_O"], rel=1e-9)


# ------------------------------------------------------------------------------------------ D_OO
def test_d_oo_is_refused_without_fold_and_folds_exactly_with_it() -> None:
    """[TUM1-YY, RANK-1g-FOLD] D_F + D_OO gamma^2, D_II - D_OO, D_SS - D_OO; the others unbiased."""
    truth = T.random_truth(2, drift.NAMES)
    s = T.setup(truth=truth)
    w = T.record(s, truth)
    assert "cannot be told from D_F, D_II and D_SS; set fold" in message(T.reduction, w, s)
    r = T.reduction.Reduction.reduce(w, T.setup(truth=truth, fold=True))
    g2 = (9.8 / frames.G0) ** 2
    D = {n: v / DPH for n, v in truth.items()}
    expected = {
        "D_F + γ² D_OO": D["D_F"] + g2 * D["D_OO"], "D_I": D["D_I"], "D_O": D["D_O"], "D_S": D["D_S"],
        "D_II − D_OO": D["D_II"] - D["D_OO"], "D_SS − D_OO": D["D_SS"] - D["D_OO"], "D_IO": D["D_IO"],
        "D_OS": D["D_OS"], "D_IS": D["D_IS"],
    }  # fmt: skip
    assert {c.name: c.estimate for c in r.coefficients} == pytest.approx(expected, abs=1e-10)
    assert {c.name: c.truth for c in r.coefficients} == pytest.approx(expected, abs=1e-10)
    assert any("D_OO is folded" in text and "centrifuge" in text for text in r.warnings)


def test_ten_terms() -> None:
    truth = T.random_truth(2, drift.NAMES)
    s = T.setup(terms=10)
    assert "ten terms have rank 9" in message(T.reduction, T.record(s, truth), s)
    r = T.reduction.Reduction.reduce(T.record(s, truth), T.setup(terms=10, fold=True, truth=truth))
    assert all(abs(c.estimate - c.truth) < 1e-10 for c in r.coefficients)


def test_fewer_terms() -> None:
    truth = {n: v for n, v in T.random_truth(3).items() if n in drift.terms(4)}
    s = T.setup(terms=4, truth=truth)
    r = T.reduction.Reduction.reduce(T.record(s, truth), s)
    assert [c.name for c in r.coefficients] == ["D_F", "D_I", "D_S", "D_IS"]
    assert all(abs(c.estimate - c.truth) < 1e-10 for c in r.coefficients)
    full = T.random_truth(3)
    r = T.reduction.Reduction.reduce(T.record(T.setup(), full), T.setup(terms=8, truth=full))
    assert any("D_O is simulated but not in the 8-term model" in text for text in r.warnings)


# ------------------------------------------------------------------------------------------ refusals
def test_singular_latitudes_name_what_is_lost() -> None:
    """[TUM1-SING] rank 7 at the equator (D_xy, D_yz lost), rank 2 at the poles; refused below 5 and above 85 deg."""
    equator = T.refusals.refusals(0.0)[0]
    assert "rank 7 of 9" in equator and "D_IO" in equator and "D_OS" in equator
    for sign in (1, -1):
        pole = T.refusals.refusals(sign * math.pi / 2)[0]
        assert "rank 2 of 9" in pole and all(n in pole for n in ("D_I", "D_S", "D_II", "D_SS", "D_IO", "D_OS", "D_IS"))
    assert "least determined: " in T.refusals.refusals(math.radians(-4.9))[0]
    assert "least determined: " in T.refusals.refusals(math.radians(85.1))[0]
    assert "outside −90..90" in T.refusals.refusals(1.6)[0]
    assert "outside" in T.refusals.refusals(math.nan)[0]
    assert T.refusals.refusals(math.radians(5.0)) == T.refusals.refusals(math.radians(-85.0)) == []
    s = T.setup()
    assert "rank 7 of 9" in message(T.reduction, T.record(s, T.random_truth(1)), T.setup(0.0))


def bad(change: Any) -> str:
    s = T.setup()
    w = T.record(s, T.random_truth(1), turn=12, dwell=3)
    change(w)
    return message(T.reduction, w, s)


@pytest.mark.parametrize(("change", "text"), [
    (put("mean", 7, math.nan), "column mean: non-finite number in window 8"),
    (put("angle_end", 3, math.inf), "column angle_end: non-finite number in window 4"),
    (lambda w: w.pop("mean"), "column mean is missing"),
    (lambda w: cut(w, np.arange(0)), "no windows"),
    (lambda w: cut(w, np.r_[0, 1, 1, 2:30]), "duplicate windows: window 3"),
    (lambda w: cut(w, np.r_[0, 2, 1, 3:30]), "time does not increase.*window 3"),
    (put("t_end", 4, 0.0), "windows without length.*window 5"),
    (put("flagged", 9, 3), "flagged windows .saturated torquer.* window 10"),
    (lambda w: cut(w, w["phase"] != 1), "phase 1 .static 3. is missing"),
    (lambda w: cut(w, w["phase"] != 4), "phase 4 .mount 2. is missing"),
    (lambda w: w.__setitem__("phase", np.where(w["phase"] == 4, 9, w["phase"])), "phase 9 is in the record"),
    (lambda w: w.__setitem__("angle_end", w["angle_start"]), "does not move, expected a turning table"),
])  # fmt: skip
def test_bad_records(change: Any, text: str) -> None:
    import re

    assert re.search(text, bad(change)), bad(change)


def test_few_windows_a_turn() -> None:
    s = T.setup()
    w = T.record(s, T.random_truth(1), turn=4, turns=5)
    assert "4 windows a turn, at least 5" in message(T.reduction, w, s)


def test_one_mount_or_no_dwells() -> None:
    s = T.setup()
    w = T.record(s, T.random_truth(1), turn=36)
    no_dwell = T.setup(faces={p: f for p, f in s.faces.items() if p in (2, 4)})
    keep = {n: v[np.isin(w["phase"], (2, 4))] for n, v in w.items()}
    assert "no dwells with the output axis vertical" in message(T.reduction, keep, no_dwell)
    assert "D_F cannot be told from D_II + D_SS" in message(T.reduction, keep, no_dwell)
    one = T.setup(faces={p: f for p, f in s.faces.items() if p != 4})
    keep = {n: v[w["phase"] != 4] for n, v in w.items()}
    assert "only one mount" in message(T.reduction, keep, one)


@pytest.mark.parametrize(("changes", "text"), [
    ({"terms": 7}, "7-term model unknown; there are 3, 4, 5, 8, 9, 10"),
    ({"k": 0.0}, "scale factor k = 0"), ({"k": math.nan}, "scale factor k = nan"),
    ({"gravity": 980.0}, "outside 9.7..9.9"), ({"polarity": "ieee"}, "polarity 'ieee' unknown"),
    ({"base": np.diag([1.0, 1.0, -1.0])}, "table base: determinant is -1"),
])  # fmt: skip
def test_bad_setup(changes: dict[str, Any], text: str) -> None:
    s = T.setup()
    assert text in message(T.reduction, T.record(s, T.random_truth(1), turn=12, dwell=3), T.setup(**changes))


def test_mount_that_is_no_rotation() -> None:
    s = T.setup()
    faces = {**s.faces, 2: np.array([[1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]])}
    assert "mount of mount 1: determinant is -1" in message(
        T.reduction, T.record(s, T.random_truth(1), turn=12), T.setup(faces=faces)
    )


def test_all_problems_at_once() -> None:
    s = T.setup()
    text = message(T.reduction, {"phase": np.array([1])}, T.setup(0.0, terms=7, k=-1.0))
    assert all(part in text for part in ("rank 7", "7-term", "k = -1", "is missing"))
    assert s.turns(2) and not s.turns(1)
    assert T.setup(modes=None).turns(2) and not T.setup(modes=None).turns(3)


def test_partial_turns_have_no_closed_formulas() -> None:
    truth = T.random_truth(6)
    s = T.setup(truth=truth)
    w = T.record(s, truth)
    keep = np.ones(w["phase"].size, dtype=bool)
    keep[np.flatnonzero(w["phase"] == 2)[-9:]] = False
    r = T.reduction.Reduction.reduce({n: v[keep] for n, v in w.items()}, s)
    assert all(c.closed is None for c in r.coefficients)
    assert any("covers 315°, no whole turns" in text for text in r.warnings)
    assert all(abs(c.estimate - c.truth) < 1e-9 for c in r.coefficients)


def test_other_attitudes_have_no_closed_formulas() -> None:
    """Mounts turned by 20 degrees about the input axis: general attitudes go by least squares."""
    truth = T.random_truth(6)
    tilt = frames.rotation([1, 0, 0], math.radians(20)).T
    s0 = T.setup()
    s = T.setup(truth=truth, faces={p: tilt @ f for p, f in s0.faces.items()})
    r = T.reduction.Reduction.reduce(T.record(s, truth), s)
    assert all(abs(c.estimate - c.truth) < 1e-8 for c in r.coefficients)
    assert r.coefficients[0].closed is None and any("attitudes of Hu 1981; least squares only" in x for x in r.warnings)
