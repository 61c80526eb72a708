"""TEST-TUMBLE1-2DOF-A, -B: geometry, recovery, condition, errata, refusals, folding."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest
import tumble_2dof as T
from bad_records import cut, differs, message, put

from gyrobench import drift, frames
from gyrobench.reduction.drift import harmonic

DPH = T.DPH
SIMPLE = tuple(n for c in "xy" for n in T.geometry.terms("simple", c))
NINE = tuple(n for c in "xy" for n in T.geometry.terms("nine", c))
NAMES = {"simple": SIMPLE, "nine": NINE}


def random_truth(seed: int, names: tuple[str, ...] = NINE) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    return dict(zip(names, rng.uniform(0.1, 1.0, len(names)) * rng.choice([-1, 1], len(names)) * DPH, strict=True))


def deg_per_h(windows: Any, s: Any, channel: str, phase: int) -> Any:
    """Amplitudes over theta of the drift of a channel, deg/h: omega_IA = 0 in the turns."""
    mine = windows["phase"] == phase
    other = "yx"["xy".index(channel)]
    y = -s.k[other] * windows[f"mean_{other}"][mine] / DPH
    f = harmonic.fit(-windows["angle_start"][mine], -windows["angle_end"][mine], y)
    return dict(zip(f.names, f.beta.tolist(), strict=True))


# ------------------------------------------------------------------------------------------ geometry
@pytest.mark.parametrize("latitude", [12.0, -45.75, 78.0])
def test_specific_force_and_rates_of_the_mounts(latitude: float) -> None:
    """[TUM2A-GEOM, TUM2B-GEOM] gamma of 4.4 and 4.5; no rate along x and y in the turns, W sin(phi) in the dwells."""
    phi = math.radians(latitude)
    c, s = math.cos(phi), math.sin(phi)
    theta = np.radians(np.arange(0.0, 360.0, 10.0))
    co, si, one = c * np.cos(theta), c * np.sin(theta), np.ones(36)
    expected = {
        ("simple", "mount 1"): [co, si, -s * one],
        ("simple", "mount 2"): [co, -si, s * one],
        ("nine", "mount 1"): [si, -co, -s * one],
        ("nine", "mount 2"): [si, co, s * one],
    }
    base = frames.polar_base(phi)
    for (model, name), gamma in expected.items():
        face = frames.check_rotation(T.geometry.faces(model, phi)[name], name)
        found = np.array([frames.to_face(-frames.U, face, base, -a) for a in theta])
        np.testing.assert_allclose(found, np.array(gamma).T, atol=1e-15)
        pole = np.array([frames.to_face(frames.pole(phi), face, base, -a) for a in theta])
        np.testing.assert_allclose(pole[:, :2], 0.0, atol=1e-15)
    for name, up in (("static 3", 1.0), ("static 4", -1.0)):
        face = T.geometry.faces("nine", phi)[name]
        np.testing.assert_allclose(frames.to_face(frames.U, face, base, 0.0), [0.0, up, 0.0], atol=1e-15)
        np.testing.assert_allclose(
            frames.to_face(frames.pole(phi), face, base, 0.0), [0.0, up * s, -up * c], atol=1e-15
        )


# ------------------------------------------------------------------------------------------ recovery
@pytest.mark.parametrize("model", ["simple", "nine"])
@pytest.mark.parametrize("latitude", [12.0, 45.75, -33.0, 78.0])
@pytest.mark.parametrize(("turn", "rate"), [(72, -10.0), (12, 7.0)])
def test_least_squares_and_closed_formulas_recover(model: str, latitude: float, turn: int, rate: float) -> None:
    """[TUM2A, TUM2B-REDUCE, TUM2B-LS] both ways, 1e-9 of the largest coefficient; the nine-term formulas divide by
    sin^2 phi and sin^2 2 phi and lose a digit (1e-8).
    """
    names = NAMES[model]
    truth = random_truth(int(latitude) + turn + 90, names)
    s = T.setup(latitude, model, truth=truth)
    r = T.reduction.Reduction.reduce(T.record(s, truth, turn=turn, rates=(rate,)), s)
    scale = max(abs(c.truth) for c in r.coefficients)
    assert sorted(c.name for c in r.coefficients) == sorted(names) and r.rank == len(names)
    for c in r.coefficients:
        assert c.truth == pytest.approx(truth[c.name] / DPH, rel=1e-12)
        assert abs(c.estimate - c.truth) < 1e-9 * scale, c.name
        assert abs(c.closed - c.truth) < (1e-9 if model == "simple" else 1e-8) * scale, c.name


def test_channels_measure_each_other() -> None:
    """i_y carries the x channel and i_x the y channel, each with its own scale factor."""
    truth = {**dict.fromkeys(NINE, 0.0), "Dx_0": DPH}
    s = T.setup(truth=truth)
    w = T.record(s, truth)
    turning = w["phase"] == 2
    assert w["mean_y"][turning] == pytest.approx(-DPH / T.K["y"]) and w["mean_x"][turning] == pytest.approx(0.0)
    found = {c.name: c.estimate for c in T.reduction.Reduction.reduce(w, s).coefficients}
    assert found == pytest.approx({n: v / DPH for n, v in truth.items()}, abs=1e-9)


@pytest.mark.parametrize("model", ["simple", "nine"])
def test_opposite_polarity(model: str) -> None:
    truth = random_truth(4, NAMES[model])
    w = T.record(T.setup(model=model), truth)
    w["mean_x"], w["mean_y"] = -w["mean_x"], -w["mean_y"]
    r = T.reduction.Reduction.reduce(w, T.setup(model=model, truth=truth, polarity="book"))
    assert all(abs(c.estimate - c.truth) < 1e-9 for c in r.coefficients)


@pytest.mark.long
def test_symbols_of_the_simple_model() -> None:
    """[MEAS-REBALANCE] k_x i_x = w_y - R_x + u_zx g_y - u_y g_z - Q_x g_y g_z, k_y i_y = w_x + R_y - u_x g_z
    + u_zy g_x + Q_y g_x g_z: currents made from these lines (gamma = 1) give the eight numbers of the table back.
    """
    rng = np.random.default_rng(7)
    symbols = dict(zip(T.closed.BOOK, rng.normal(size=8).tolist(), strict=True))
    s = T.setup(33.0, "simple", gravity=frames.G0)
    w = T.record(s, dict.fromkeys(SIMPLE, 0.0), turn=3600)  # geometry only; windows of 0.1 degree
    keep = np.arange(0, 7200, 100)
    w = {n: v[keep] for n, v in w.items()}
    for j, (p, a) in enumerate(zip(w["phase"], (w["angle_start"] + w["angle_end"]) / 2, strict=True)):
        gx, gy, gz = T.in_face(-frames.U, s, int(p), np.array([a]))[0]
        b = symbols
        w["mean_x"][j] = (-b["R_x"] + b["u_zx"] * gy - b["u_y"] * gz - b["Q_x"] * gy * gz) * DPH / T.K["x"]
        w["mean_y"][j] = (b["R_y"] - b["u_x"] * gz + b["u_zy"] * gx + b["Q_y"] * gx * gz) * DPH / T.K["y"]
    r = T.reduction.Reduction.reduce(w, s)
    (table,) = [t for t in r.tables if t.title == "Quantities of Hu 1981"]
    for row in table.rows:
        assert row[2] == pytest.approx(symbols[row[0]], abs=1e-6)  # windows of finite width: 1 - sinc(0.1 deg)


@pytest.mark.long
def test_tilt_of_the_measuring_axes_needs_both_senses() -> None:
    """x or y tilted towards z by eps sees eps (W + table rate), of opposite sign in the mounts: at one rate that is
    Dx_z, wrong by eps (W + rate)/(gamma sin phi); with both senses it is found and does no harm.
    """
    truth, tilt = random_truth(8), (3e-4, -2e-4)
    phi, gamma = math.radians(45.75), 9.8 / frames.G0
    s = T.setup(truth=truth)
    found = {c.name: c for c in T.reduction.Reduction.reduce(T.record(s, truth, tilt=tilt), s).coefficients}
    # mount 1: omega_z = W - 10 W, Z = -gamma s; y = omega_d - eps omega_z there
    expected = tilt[0] * -9.0 * frames.EARTH_RATE / (gamma * math.sin(phi)) / DPH
    assert found["Dx_z"].closed - found["Dx_z"].truth == pytest.approx(expected, rel=1e-9)
    # least squares: both records under the same white noise, larger than the misfit, so that they are weighed alike
    noise = np.random.default_rng(1).normal(0.0, 0.1 * DPH, (2, 164))
    moved = []
    for w in (T.record(s, truth), T.record(s, truth, tilt=tilt)):
        noisy = {**w, "mean_x": w["mean_x"] + noise[0] / s.k["y"], "mean_y": w["mean_y"] + noise[1] / s.k["x"]}
        moved.append({c.name: c.estimate for c in T.reduction.Reduction.reduce(noisy, s).coefficients}["Dx_z"])
    assert moved[1] - moved[0] == pytest.approx(expected, rel=0.05)
    assert found["Dx_x"].closed == pytest.approx(found["Dx_x"].truth, abs=1e-9)
    both = T.setup(truth=truth, tilt=True)
    r = T.reduction.Reduction.reduce(T.record(s, truth, rates=(-10.0, 10.0), tilt=tilt), both)
    for c in r.coefficients:
        if c.name.startswith("ε"):
            size = tilt["xy".index(c.name[2])]
            assert c.estimate == pytest.approx(math.degrees(size) * 3600.0, rel=1e-6)
        else:
            assert abs(c.estimate - c.truth) < 1e-9, c.name
    assert "turns in both senses" in message(T.reduction, T.record(s, truth), both)


def test_terms_outside_the_simple_model_shift_it_as_predicted() -> None:
    """By hand: Dx_xx X2 = Dx_xx gamma2 c2 (1 + cos 2 theta)/2 goes to the constant with half, Dx_zz Z2 with s2."""
    truth = {**random_truth(5, SIMPLE), "Dx_xx": 0.05 * DPH, "Dx_zz": -0.03 * DPH, "Dy_x": 0.1 * DPH}
    s = T.setup(52.0, "simple", truth=truth)
    r = T.reduction.Reduction.reduce(T.record(s, truth), s)
    shift = {c.name: c.estimate - c.truth for c in r.coefficients}
    gamma2, phi = (9.8 / frames.G0) ** 2, math.radians(52.0)
    hand = gamma2 * (0.05 * math.cos(phi) ** 2 / 2.0 - 0.03 * math.sin(phi) ** 2)
    (constant,) = [c for c in r.coefficients if c.name == "Dx_0"]
    assert constant.closed - constant.truth == pytest.approx(hand, rel=1e-9)
    tables = [t for t in r.tables if t.title.startswith("Terms left out")]
    assert len(tables) == 2
    for t in tables:
        for name, predicted, _ in t.rows:
            assert shift[name] == pytest.approx(predicted, abs=3e-4)  # of the likeliest noise model alone
    assert any("Dx_xx, Dx_zz is simulated but not in the simple model" in text for text in r.warnings)
    tests = {t.name: t.p for t in r.tests}
    assert tests["harmonics 2 and higher, x channel"] < 1e-6


# ------------------------------------------------------------------------------------------ condition
@pytest.mark.parametrize(("latitude", "x", "y"), [
    (5.0, 935, 947), (20.0, 60, 62), (45.75, 15.7, 20.0), (60.0, 14.8, 28.4), (80.0, 131, 229),
])  # fmt: skip
def test_condition_numbers(latitude: float, x: float, y: float) -> None:
    """[TUM2B-SING] N = 36 a mount and the two dwells."""
    for channel, expected in (("x", x), ("y", y)):
        found = np.linalg.cond(T.geometry.design("nine", channel, math.radians(latitude)))
        assert abs(found - expected) <= (0.5 if expected > 50 else 0.05)  # the digits of TUM2B-SING


def test_rank_at_the_equator_and_the_poles() -> None:
    """[TUM2B-SING] 5/5 at 0, 4/4 at 90 degrees; the simple model keeps 2 of 4 at both."""
    for latitude, rank in ((0.0, 5), (90.0, 4)):
        for channel in "xy":
            X = T.geometry.design("nine", channel, math.radians(latitude))
            assert np.linalg.matrix_rank(X, tol=1e-9) == rank
            assert np.linalg.matrix_rank(T.geometry.design("simple", channel, math.radians(latitude)), tol=1e-9) == 2


def test_latitudes() -> None:
    refused = T.geometry.refusals
    (equator,) = refused(0.0, "nine")
    assert "x channel: rank 5 of 9" in equator and "y channel: rank 5 of 9" in equator and "Dx_z" in equator
    (pole,) = refused(-math.pi / 2, "nine")
    assert "rank 4 of 9" in pole and "Dx_x" in pole and "Dy_y" in pole
    (simple,) = refused(0.0, "simple")
    assert "x channel: rank 2 of 4, not estimable: Dx_xz; Dx_z" in simple
    for latitude in (9.9, -80.1, 5.0):
        (text,) = refused(math.radians(latitude), "nine")
        assert "10° to 80°" in text and "x channel: condition" in text and "least determined: " in text
    for latitude in (10.0, -10.0, 80.0, 45.0):
        assert refused(math.radians(latitude), "nine") == refused(math.radians(latitude), "simple") == []
    assert "outside −90..90" in refused(1.6, "nine")[0] and "no such model" in refused(0.5, "eight")[0]
    for latitude, text in ((19.9, "sin φ"), (-70.1, "cos φ")):
        (caution,) = T.geometry.cautions(math.radians(latitude))
        assert "outside 20° to 70°" in caution and text in caution
    assert T.geometry.cautions(math.radians(20.0)) == T.geometry.cautions(math.radians(-70.0)) == []


# ------------------------------------------------------------------------------------------ errata
def test_corrected_and_printed_simple_model() -> None:
    """[TUM2A, TUM2A-ERR, E24] 3-23, 3-25: every linear term has the opposite sign in print, u_x without sin phi; the
    printed separation would return -u.
    """
    truth = random_truth(9, SIMPLE)
    s = T.setup(41.0, "simple", gravity=frames.G0, truth=truth)
    w = T.record(s, truth)
    phi = math.radians(41.0)
    c, n, s2 = math.cos(phi), math.sin(phi), math.sin(2 * phi)
    D = {b: sign * truth[name] / DPH for b, (name, sign) in T.closed.BOOK.items()}
    x1, x2, y1, y2 = (
        {k: -v for k, v in deg_per_h(w, s, channel, p).items()} for channel in "yx" for p in (1, 2)
    )  # torquer rates k i = -omega_d
    assert x1["A0"] == pytest.approx(-D["R_x"] + D["u_y"] * n)
    assert x1["B1"] == pytest.approx(D["u_zx"] * c + D["Q_x"] * s2 / 2)
    assert x2["A0"] == pytest.approx(-D["R_x"] - D["u_y"] * n)
    assert x2["B1"] == pytest.approx(-D["u_zx"] * c + D["Q_x"] * s2 / 2)
    assert y1["A0"] == pytest.approx(D["R_y"] + D["u_x"] * n)
    assert y1["A1"] == pytest.approx(D["u_zy"] * c - D["Q_y"] * s2 / 2)
    assert y2["A0"] == pytest.approx(D["R_y"] - D["u_x"] * n)
    assert y2["A1"] == pytest.approx(D["u_zy"] * c + D["Q_y"] * s2 / 2)
    both = T.closed.simple("y", x1, x2, phi, frames.G0) | T.closed.simple("x", y1, y2, phi, frames.G0)
    assert both == pytest.approx(D, abs=1e-10)
    # printed
    assert differs(-D["R_x"] - D["u_y"] * n, x1["A0"])
    assert differs(-D["u_zx"] * c + D["Q_x"] * s2 / 2, x1["B1"])
    assert differs(D["R_y"] - D["u_x"], y1["A0"]) and differs(D["R_y"] - D["u_x"] * n, y1["A0"])
    assert differs(-D["u_zy"] * c - D["Q_y"] * s2 / 2, y1["A1"])


def test_corrected_and_printed_nine_term_model() -> None:
    """[TUM2B-REDUCE, TUM2B-ERR, E25-E29, E54] amplitudes by hand, and printed forms that fail."""
    truth = random_truth(10)
    s = T.setup(41.0, gravity=frames.G0, truth=truth)
    w = T.record(s, truth)
    phi = math.radians(41.0)
    c, n, s2 = math.cos(phi), math.sin(phi), math.sin(2 * phi)
    D = {k: v / DPH for k, v in truth.items()}
    found = {ch: [deg_per_h(w, s, ch, p) for p in (2, 4)] for ch in "xy"}
    for k, up in ((0, -1.0), (1, 1.0)):  # upper sign: mount 1
        for ch, own, side in (("x", "xx", -1.0), ("y", "yy", 1.0)):
            d = f"D{ch}_"
            hand = {
                "A0": D[d + "0"] + up * D[d + "z"] * n + D[d + own] * c * c / 2 + D[d + "zz"] * n * n,
                "A1": up * D[d + "y"] * c + D[d + "yz"] * s2 / 2,
                "B1": D[d + "x"] * c + up * D[d + "xz"] * s2 / 2,
                "A2": side * D[d + own] * c * c / 2,
                "B2": up * D[d + "xy"] * c * c / 2,
            }
            assert found[ch][k] == pytest.approx(hand, abs=1e-11)
    dwell = {}
    for ch in "xy":
        other = "yx"["xy".index(ch)]
        rate = {1: 0.0, 3: 0.0} if ch == "x" else {1: frames.EARTH_RATE * n, 3: -frames.EARTH_RATE * n}
        dwell[ch] = [float(np.mean(rate[p] - s.k[other] * w[f"mean_{other}"][w["phase"] == p])) / DPH for p in (1, 3)]
        expected = {k: v for k, v in D.items() if k.startswith(f"D{ch}")}
        assert T.closed.nine(ch, *found[ch], *dwell[ch], phi, frames.G0) == pytest.approx(expected, abs=1e-9)
    one, two = found["x"]
    # E25: D(x)_x in the constant, D(x)_xx in cosine and sine
    assert differs(D["Dx_0"] - D["Dx_x"] * n + D["Dx_xx"] * c * c / 2 + D["Dx_zz"] * n * n, one["A0"])
    assert differs(-D["Dx_y"] * c + D["Dx_xx"] * s2 / 2, one["A1"])
    assert differs(D["Dx_x"] * c - D["Dx_xx"] * s2 / 2, one["B1"])
    assert differs(-D["Dx_xx"] * c * c / 2, one["B2"])
    # E26: minus before the brackets of the x current (y channel); E27: C22 = -1/2
    assert differs(-(-D["Dy_y"] * c + D["Dy_yz"] * s2 / 2), found["y"][0]["A1"])
    assert differs(-D["Dy_yy"] * c * c / 2, found["y"][1]["A2"])
    # E28: D(x)_y over g cos phi; E29: D(x)_zz over 2 g2 sin 2 phi, the same for D(y)_zz
    assert differs((two["A1"] - one["A1"]) / c, D["Dx_y"])
    top = one["A0"] + two["A0"] + one["A2"] + two["A2"] - sum(dwell["x"])
    assert differs(top / (2 * s2), D["Dx_zz"]) and top / (2 * n * n) == pytest.approx(D["Dx_zz"], rel=1e-8)
    # E54: mount 1 in the sum of the static mounts 3 and 4
    assert differs(0.5 * (dwell["x"][0] + one["A0"]), D["Dx_0"])
    assert 0.5 * sum(dwell["x"]) == pytest.approx(D["Dx_0"], abs=1e-9)
    one, two = found["y"]
    top = one["A0"] + two["A0"] - one["A2"] - two["A2"] - sum(dwell["y"])
    more = 4 * (one["A2"] + two["A2"]) / s2**2
    assert differs(top / (2 * s2) + more, D["Dy_zz"])
    assert top / (2 * n * n) + more == pytest.approx(D["Dy_zz"], rel=1e-8)


# ------------------------------------------------------------------------------------------ inseparable squares
def test_cross_squares_are_refused_without_fold_and_fold_exactly_with_it() -> None:
    """[RANK-1g-FOLD] X2 + Y2 + Z2 = gamma2: Dx_yy Y2 and Dy_xx X2 go into the constant and the other squares."""
    truth = {**random_truth(2), "Dx_yy": 0.2 * DPH, "Dy_xx": -0.3 * DPH}
    w = T.record(T.setup(), truth)
    text = message(T.reduction, w, T.setup(truth=truth))
    assert "Dx_yy = 0.2 °/h/g²" in text and "Dy_xx = -0.3 °/h/g²" in text and "set fold" in text
    r = T.reduction.Reduction.reduce(w, T.setup(truth=truth, fold=True))
    g2 = (9.8 / frames.G0) ** 2
    folded = {
        "Dx_0 + γ² Dx_yy": truth["Dx_0"] / DPH + 0.2 * g2, "Dx_xx − Dx_yy": truth["Dx_xx"] / DPH - 0.2,
        "Dx_zz − Dx_yy": truth["Dx_zz"] / DPH - 0.2, "Dy_0 + γ² Dy_xx": truth["Dy_0"] / DPH - 0.3 * g2,
        "Dy_yy − Dy_xx": truth["Dy_yy"] / DPH + 0.3, "Dy_zz − Dy_xx": truth["Dy_zz"] / DPH + 0.3,
    }  # fmt: skip
    for c in r.coefficients:
        expected = folded.get(c.name, truth.get(c.name, math.nan) / DPH)
        assert c.estimate == pytest.approx(expected, abs=1e-9) and c.truth == pytest.approx(expected, abs=1e-10)
    assert sum("is folded" in text and "centrifuge" in text for text in r.warnings) == 2
    ten = drift.terms_2dof("x", 10)
    face, base = T.geometry.faces("nine", 0.8), frames.polar_base(0.8)
    rows = [frames.to_face(-frames.U, face[m], base, a) for m in face for a in np.arange(0.0, 6.28, 0.2)]
    assert np.linalg.matrix_rank(drift.regressors(np.array(rows), ten), tol=1e-9) == 9


# ------------------------------------------------------------------------------------------ refusals
@pytest.mark.parametrize(("change", "text"), [
    (put("mean_y", 7, math.nan), "column mean_y: non-finite number in window 8"),
    (put("angle_end", 3, math.inf), "column angle_end: non-finite number in window 4"),
    (lambda w: w.pop("mean_x"), "column mean_x is missing"),
    (lambda w: cut(w, np.arange(0)), "no windows"),
    (lambda w: cut(w, np.r_[0, 2, 1, 3:30]), "time does not increase.*window 3"),
    (put("flagged", 9, 3), "flagged windows .saturated torquer.* window 10"),
    (lambda w: cut(w, w["phase"] != 1), "phase 1 .static 3. is missing"),
    (lambda w: cut(w, w["phase"] != 4), "phase 4 .mount 2. is missing"),
    (lambda w: w.__setitem__("phase", np.where(w["phase"] == 4, 9, w["phase"])), "phase 9 is in the record"),
    (lambda w: w.__setitem__("angle_end", w["angle_start"]), "does not move, expected a turning table"),
])  # fmt: skip
def test_bad_records(change: Any, text: str) -> None:
    s = T.setup()
    w = T.record(s, random_truth(1), turn=12, dwell=3)
    change(w)
    assert re.search(text, message(T.reduction, w, s)), message(T.reduction, w, s)


def test_bad_setups() -> None:
    w = T.record(T.setup(), random_truth(1), turn=12, dwell=3)
    assert "gravity 8 m/s²" in message(T.reduction, w, T.setup(gravity=8.0))
    assert "scale factor k_y = -1" in message(T.reduction, w, T.setup(k={"x": 1.0, "y": -1.0}))
    assert "polarity 'left'" in message(T.reduction, w, T.setup(polarity="left"))
    assert "rank 5 of 9" in message(T.reduction, w, T.setup(0.0))
    one = {p: f for p, f in T.setup().faces.items() if p != 4}
    part = {n: v[w["phase"] != 4] for n, v in w.items()}
    assert "only one mount" in message(T.reduction, part, T.setup(faces=one))
    one = {p: f for p, f in T.setup().faces.items() if p != 3}
    part = {n: v[w["phase"] != 3] for n, v in w.items()}
    assert "only one dwell with the y axis vertical" in message(T.reduction, part, T.setup(faces=one))
    few = T.record(T.setup(), random_truth(1), turn=4, dwell=3)
    assert "4 windows a turn, at least 5" in message(T.reduction, few, T.setup())
