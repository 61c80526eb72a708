"""TEST-8POS: frames, formulas and their errata, least squares, compliance, Table 3-1, refusals."""

from __future__ import annotations

import importlib
import itertools
import json
import math
from typing import Any

import numpy as np
import pytest
from reducing import named
from scipy import stats
from stated import with_sizes

from gyrobench import drift, frames
from gyrobench.reduction.estimation import noise, repeatability
from gyrobench.reduction.estimation.linear_fit import fit
from gyrobench.reduction.setup.window_checks import ReductionError
from gyrobench.system.system import load_system

system = load_system("eight_position")
PACKAGE = type(system).__module__
R: Any = importlib.import_module(".reduction", PACKAGE)
P: Any = importlib.import_module(".positions", PACKAGE)
M: Any = importlib.import_module(".model", PACKAGE)
DPH, KU = math.pi / 648000.0, math.pi / 648000.0 / 1e-3
W = frames.EARTH_RATE
E, N, U = np.eye(3)
#: POS8-FRAMES by hand: x, y, z of every position
BOOK = {1: (E, N, U), 2: (N, -E, U), 3: (-E, -N, U), 4: (-N, E, U), 5: (U, E, N), 6: (-E, U, N), 7: (-U, -E, N), 8: (E, -U, N)}  # fmt: skip  # noqa: E501
NAMES = ("k_x", "k_y", "R_x", "R_y", "u_x", "u_y", "u_zx", "u_zy")


def latitudes(rng: np.random.Generator, n: int) -> list[float]:
    return [float(math.radians(rng.uniform(0.0, 79.0)) * rng.choice([-1.0, 1.0])) for _ in range(n)]


def torque_balance(
    p: dict[str, float], phi: float, compliance: Any = None
) -> tuple[dict[int, float], dict[int, float]]:
    """Currents (A) of each position by the torques on the rotor, nothing of the reduction in it.

    The torquers and the disturbances keep H = H z turning with the case: torque = omega x H, so that torque about x is
    +H omega_y and about y -H omega_x.  Disturbances over H: M_x/H = R_x - u_zx g_y + u_y g_z, M_y/H = R_y - u_x g_z +
    u_zy g_x with g the direction of gravity, K_ij (m^2 g^2 K'_ij/H) of GYRO-STATIC-TORQUE.
    """
    K = compliance if compliance is not None else np.zeros((3, 3))
    k = lambda i, j: float(K["xyz".index(i), "xyz".index(j)])  # noqa: E731
    I_x, I_y = {}, {}
    for n, axes in BOOK.items():
        C = np.array(axes)
        w, (x, y, z) = C @ (W * np.array([0.0, math.cos(phi), math.sin(phi)])), C @ -U
        M_x = p["R_x"] - p["u_zx"] * y + p["u_y"] * z - k("z", "x") * x * y + (k("y", "y") - k("z", "z")) * y * z
        M_x += k("y", "x") * x * z - k("z", "y") * y * y + k("y", "z") * z * z
        M_y = p["R_y"] - p["u_x"] * z + p["u_zy"] * x + k("z", "y") * x * y - k("x", "y") * y * z
        M_y += (k("z", "z") - k("x", "x")) * x * z + k("z", "x") * x * x - k("x", "z") * z * z
        I_x[n], I_y[n] = (w[1] - M_x) / p["k_x"], (w[0] + M_y) / p["k_y"]
    return I_x, I_y


def gyro(rng: np.random.Generator) -> dict[str, float]:
    found = {n: float(rng.uniform(-2.0, 2.0) * DPH) for n in NAMES[2:]}
    return found | {n: float(rng.uniform(10.0, 20.0) * KU) for n in NAMES[:2]}


def rows(I_x: dict[int, float], I_y: dict[int, float], cycles: int = 2, readings: int = 2) -> dict[str, np.ndarray]:
    """Readings of 6 s after 10 s of settling; the same current in each of them."""
    position = np.array([n for _ in range(cycles) for n in BOOK for _ in range(readings)])
    cycle = np.repeat(np.arange(1, cycles + 1), 8 * readings)
    index = np.arange(position.size)
    t0 = 6.0 * index + 10.0 * (index // readings + 1)
    return {
        "position": position, "cycle": cycle, "t_start": t0, "t_end": t0 + 6.0,
        "mean_x": np.array([I_x[n] for n in position]), "mean_y": np.array([I_y[n] for n in position]),
    }  # fmt: skip


def setup(phi: float = math.radians(45.75), **changes: Any) -> Any:
    return R.EightPositionSetup(**with_sizes({"latitude": phi, "gravity": 9.80665, **changes}))


def si(c: Any) -> float:
    return float(c.estimate) * (KU if c.name.startswith("k") else DPH)


# ------------------------------------------------------------------------------------------ geometry and formulas
def test_frames() -> None:
    """[POS8-FRAMES] The positions are those of Hu 1981 and right-handed."""
    for n, axes in BOOK.items():
        assert np.array_equal(P.ATTITUDES[n], np.array(axes))
        frames.check_rotation(P.ATTITUDES[n], str(n))


@pytest.mark.parametrize("seed", range(6))
def test_recovery_from_ideal_currents(seed: int) -> None:
    """[POS8-MODEL+REDUCE] Closed formulas, six unknowns and four give all eight back, north and south."""
    rng = np.random.default_rng(seed)
    for phi in latitudes(rng, 4):
        p = gyro(rng)
        I_x, I_y = torque_balance(p, phi)
        closed = P.closed(I_x, I_y, W, phi)
        for n in NAMES:
            assert closed[n] == pytest.approx(p[n], rel=1e-9, abs=1e-9 * DPH), n
        assert all(np.ptp(v) < 1e-9 * DPH for v in P.estimates(I_x, I_y, W, phi).values())
        for terms in (4, 6):
            found = named(R.Reduction.reduce(rows(I_x, I_y), setup(phi, terms=terms)))
            for n in NAMES:
                assert si(found[n]) == pytest.approx(p[n], rel=1e-9, abs=1e-9 * DPH), (n, terms)
                assert found[n].closed == pytest.approx(found[n].estimate, rel=1e-9, abs=1e-9)


def test_e17_printed_signs_fail() -> None:
    """I_y of positions 3, 4, 7, 8 is printed with a leading minus: with it neither k_y nor u_x comes out."""
    phi, p = math.radians(45.75), gyro(np.random.default_rng(4))
    I_x, I_y = torque_balance(p, phi)
    printed = {n: -v if n in (3, 4, 7, 8) else v for n, v in I_y.items()}
    closed = P.closed(I_x, printed, W, phi)
    for n in ("k_y", "R_y", "u_x", "u_zy"):
        assert abs(closed[n] / p[n] - 1.0) > 0.01, n


def test_e18_printed_indices_fail() -> None:
    """3-11 prints I_x8 and I_x3 in u_zx, I_y6 in u_zy; right are I_x6, I_x8 and I_y5."""
    phi, p = math.radians(45.75), gyro(np.random.default_rng(5))
    I_x, I_y = torque_balance(p, phi)
    Ws = W * math.sin(phi)
    right = (Ws - p["R_x"] - p["k_x"] * I_x[6], Ws + p["R_x"] + p["k_x"] * I_x[8], Ws + p["R_y"] - p["k_y"] * I_y[5])
    printed = (Ws - p["R_x"] - p["k_x"] * I_x[8], Ws + p["R_x"] + p["k_x"] * I_x[3], Ws + p["R_y"] - p["k_y"] * I_y[6])
    for a, b, n in zip(right, printed, ("u_zx", "u_zx", "u_zy"), strict=True):
        assert a == pytest.approx(p[n], rel=1e-9)
        assert abs(b - p[n]) > 0.1 * DPH


def book_design(channel: str, phi: float) -> np.ndarray:
    """[POS8-LS] rows [omega/W, -1, -g_z, g_y] and [omega/W, 1, -g_z, g_x], from the axes by hand."""
    out = []
    for axes in BOOK.values():
        C = np.array(axes)
        w, g = C @ np.array([0.0, math.cos(phi), math.sin(phi)]), C @ -U
        out.append([w[1], -1.0, -g[2], g[1]] if channel == "x" else [w[0], 1.0, -g[2], g[0]])
    return np.array(out)


def test_condition_and_rank_over_latitude() -> None:
    """[POS8-POLE] 2.6 at 0, 4.3 at 45.75, 6.3 at 60, 18.6 at 80 degrees; rank 3 at the pole; as the model's design."""
    for degrees, condition in ((0.0, 2.6), (45.75, 4.3), (60.0, 6.3), (80.0, 18.6)):
        phi = math.radians(degrees)
        d = M.directions(np.arange(1, 9), phi)
        for c in "xy":
            A = book_design(c, phi)
            own = np.column_stack([M.rate(c, d, 1.0), -M.drift_columns(c, d, 4)])
            assert np.allclose(own, A, atol=1e-15)
            assert np.linalg.cond(A) == pytest.approx(condition, abs=0.06)
    assert np.linalg.matrix_rank(book_design("x", math.pi / 2), tol=1e-9) == 3


@pytest.mark.usefixtures("fewer_weights")
def test_uncertainty_factors() -> None:
    """sigma(R) = 0.5, sigma(u_x), sigma(u_y) = 0.71, sigma(k)/k = 1/(sqrt 2 W cos phi) of sigma_omega, by four
    unknowns and one reading in each position; the reduction gives them with the estimated sigma.
    """
    phi, rng = math.radians(45.75), np.random.default_rng(6)
    covariance = np.linalg.inv(book_design("x", phi).T @ book_design("x", phi))
    assert np.sqrt(covariance[2, 2]) == pytest.approx(0.71, abs=0.005)
    p = gyro(rng) | {n: 1e-6 * DPH for n in NAMES[2:]}  # then R/k and R have the same factor
    I_x, I_y = torque_balance(p, phi)
    w = rows(I_x, I_y, cycles=20, readings=1)
    sigma = 0.01 * DPH
    for c in "xy":
        w[f"mean_{c}"] = w[f"mean_{c}"] + rng.normal(size=160) * sigma / p[f"k_{c}"]
    found = named(R.Reduction.reduce(w, setup(phi, terms=4, nuisances=False)))  # weighed set-up effects widen u
    size = 0.01 / math.sqrt(20.0)  # of a position's mean, deg/h
    for c, (constant, unbalance) in {"x": ("R_x", "u_y"), "y": ("R_y", "u_x")}.items():
        assert found[constant].u == pytest.approx(0.5 * size, rel=0.15)
        assert found[unbalance].u == pytest.approx(0.71 * size, rel=0.15)
        k = found[f"k_{c}"]
        assert k.u / k.estimate == pytest.approx(size * DPH / (math.sqrt(2.0) * W * math.cos(phi)), rel=0.15)


def test_compliance() -> None:
    """[POS8-QUAD] k, R, u_zx, u_zy stay, u_x becomes u_x - K_xz g^2 and u_y becomes u_y - K_yz g^2; single values of
    u_z part by twice the compliance; four unknowns are biased.
    """
    phi, rng = math.radians(-33.0), np.random.default_rng(7)
    p, K = gyro(rng), np.random.default_rng(8).normal(size=(3, 3)) * 0.1 * DPH
    I_x, I_y = torque_balance(p, phi, K)
    found = named(R.Reduction.reduce(rows(I_x, I_y), setup(phi)))
    shifted = p | {"u_x": p["u_x"] - K[0, 2], "u_y": p["u_y"] - K[1, 2]}
    for n in NAMES:
        assert si(found[n]) == pytest.approx(shifted[n], rel=1e-9, abs=1e-9 * DPH), n
    single = P.estimates(I_x, I_y, W, phi)
    assert single["u_zx"][0] - single["u_zx"][1] == pytest.approx(-2.0 * K[2, 1], rel=1e-6)
    assert single["u_zy"][0] - single["u_zy"][1] == pytest.approx(-2.0 * K[2, 0], rel=1e-6)
    assert si(found["Dy_yy − Dy_xx"]) == pytest.approx(-K[2, 1], rel=1e-9)  # D(y)_yy = -K_zy, D(x)_xx = -K_zx
    assert si(found["Dx_xx − Dx_yy"]) == pytest.approx(-K[2, 0], rel=1e-9)
    four = named(R.Reduction.reduce(rows(I_x, I_y), setup(phi, terms=4)))
    assert abs(si(four["R_x"]) - p["R_x"]) > 0.2 * abs(K[2, 1])


def test_coefficients_of_the_general_gyro() -> None:
    """All twenty coefficients of gyrobench.drift, k i = omega - omega_d: what each unknown then is (model.truth)."""
    rng, phi, g = np.random.default_rng(9), math.radians(52.0), 9.79
    D = {n: float(rng.normal() * DPH) for c in "xy" for n in drift.NAMES_2DOF[c]}
    k = {"x": 17.0 * KU, "y": 16.0 * KU}
    I: dict[str, dict[int, float]] = {"x": {}, "y": {}}  # noqa: E741
    for n, axes in BOOK.items():
        C = np.array(axes)
        w, X = C @ (W * np.array([0.0, math.cos(phi), math.sin(phi)])), C @ -U * g / 9.80665
        parts = {c: {m: v for m, v in D.items() if m[1] == c} for c in "xy"}
        I["x"][n] = (w[1] - float(drift.drift(X, parts["y"]))) / k["x"]
        I["y"][n] = (w[0] - float(drift.drift(X, parts["x"]))) / k["y"]
    result = R.Reduction.reduce(rows(I["x"], I["y"]), setup(phi, gravity=g, truth={**D, "k_x": k["x"], "k_y": k["y"]}))
    assert len(result.coefficients) == 12
    for c in result.coefficients:
        assert c.truth is not None
        assert c.estimate == pytest.approx(c.truth, rel=1e-9, abs=1e-9), c.name
    table = next(t for t in result.tables if t.title == "As drift coefficients")
    g0 = g / 9.80665
    by = {r[0]: r[1] for r in table.rows}
    assert by["Dx_x"] == pytest.approx(D["Dx_x"] / DPH, abs=1e-9)
    assert by["Dy_z − γ (Dy_zz − Dy_xx)"] == pytest.approx((D["Dy_z"] - g0 * (D["Dy_zz"] - D["Dy_xx"])) / DPH, abs=1e-9)
    json.dumps(result.as_dict(), allow_nan=False)


# ------------------------------------------------------------------------------------------ Table 3-1
TABLE = {
    "kx": ([108000, 108060, 108060, 108060, 108050, 108020, 108010], 108037, 26.3),
    "ky": ([104000, 103940, 104030, 104150, 104150, 104000, 103980], 104036, 82.6),
    "Rx": ([-802, -806, -804, -800, -800, -801, -806], -803, 2.6),
    "ux": ([-12604, -12621, -12624, -12613, -12612, -12604, -12608], -12612, 7.9),
    "uzx": ([11078, 11073, 11071, 11070, 11068, 11071, 11069], 11071, 3.3),
    "Ry": ([5830, 5831, 5832, 5836, 5836, 5832, 5837], 5833, 2.9),
    "uy": ([-7734, -7731, -7720, -7724, -7720, -7721, -7726], -7725, 5.2),
    "uzy": ([11074, 11081, 11006, 11101, 11036, 11088, 11080], 11075, 19.1),
}


def test_table_3_1() -> None:
    """[T3-1-MEAN, T3-1-SIGMA] All means but u_zy; sigma with n - 1 about the rounded mean of all but u_y and u_zy."""
    for name, (values, mean, sigma) in TABLE.items():
        assert (abs(repeatability.statistics(values).mean - mean) < 0.5) == (name != "uzy"), name
        found = repeatability.statistics(values, about=mean).sigma
        assert (abs(found - sigma) < 0.06) == (name not in ("uy", "uzy")), name


def test_e19() -> None:
    """[T3-1-ERR] u_zy: 11006 contradicts the mean, 11066 restores it; sigma of u_y, u_zy is not 5.2, 19.1."""
    values = [11066 if v == 11006 else v for v in TABLE["uzy"][0]]
    assert repeatability.statistics(values).mean == pytest.approx(11075, abs=0.5)
    assert repeatability.statistics(values).sigma == pytest.approx(20.5, abs=0.06)
    assert repeatability.statistics(TABLE["uy"][0]).sigma == pytest.approx(5.6, abs=0.05)


@pytest.mark.long
def test_days_together() -> None:
    """Mean, sigma and t interval over the days; the printed unbalance is stable, the scale factor is not the truth."""
    rng, phi = np.random.default_rng(10), math.radians(45.75)
    p, each = gyro(rng), {}
    R_x = [p["R_x"] + v * DPH for v in (0.1, -0.2, 0.3, 0.0)]
    for day, constant in enumerate(R_x):
        w = rows(*torque_balance(p | {"R_x": constant}, phi), cycles=3)
        for c in "xy":
            w[f"mean_{c}"] = w[f"mean_{c}"] + rng.normal(size=48) * 0.003 * DPH / p[f"k_{c}"]
        each[f"{day + 1}"] = R.Reduction.reduce(w, setup(phi))
    result = repeatability.combine_days(each)
    c = named(result)["R_x"]
    values = [named(r)["R_x"].estimate for r in each.values()]
    assert c.estimate == pytest.approx(np.mean(values))
    assert c.u_a == pytest.approx(np.std(values, ddof=1) / 2.0)
    assert c.interval[1] - c.estimate == pytest.approx(stats.t.ppf(0.975, 3) * c.u_a)
    tests = {t.name: t.p for t in result.tests}
    assert tests["day to day, R_x"] < 1e-6 and tests["day to day, u_zy"] > 1e-4
    assert "R_x" in result.summary[0]
    table = result.tables[0]
    assert [r[0] for r in table.rows] == ["1", "2", "3", "4", "mean", "σ (n − 1)", "u within a day"]
    assert table.rows[5][2] == pytest.approx(np.std(values, ddof=1))
    json.dumps(result.as_dict(), allow_nan=False)
    with pytest.raises(ReductionError, match="at least two"):
        repeatability.combine_days({"1": each["1"]})


# ------------------------------------------------------------------------------------------ uncertainty
@pytest.mark.parametrize("colour", ["white", "Gauss-Markov"])
@pytest.mark.long
def test_intervals_cover(colour: str) -> None:
    """20 records of 3 cycles with 2 readings each: of 20 intervals of coverage 0.93 fewer than 13 hold the truth with
    probability 1e-4, for each of the twelve; all 240 together are held to the same risk, which finds out intervals of
    0.7 of their width.  tests/benchmarks/coverage.py eight_position counts many.
    """
    rng, phi, runs = np.random.default_rng(11), math.radians(45.75), 20
    p = gyro(rng)
    w = rows(*torque_balance(p, phi), cycles=3, readings=2)
    n = w["position"].size
    size = np.eye(n)
    if colour == "Gauss-Markov":
        size = np.linalg.cholesky(0.3 * np.eye(n) + 0.7 * noise.process_covariance(w["t_start"], w["t_end"], 40.0))
    hits: dict[str, int] = {}
    for _ in range(runs):
        noisy = {
            **w,
            **{f"mean_{c}": w[f"mean_{c}"] + size @ rng.normal(size=n) * 0.01 * DPH / p[f"k_{c}"] for c in "xy"},
        }
        for c in R.Reduction.reduce(noisy, setup(phi)).coefficients:
            if c.name.startswith(("ε", "σ", "trend")):  # a set-up effect that chance has joined
                continue
            true = p.get(c.name, 0.0) / (KU if c.name.startswith("k") else DPH)
            hits[c.name] = hits.get(c.name, 0) + (c.interval[0] <= true <= c.interval[1])
    assert len(hits) == 12
    assert min(hits.values()) >= int(stats.binom.ppf(1e-4, runs, 0.93)), hits
    assert sum(hits.values()) >= int(stats.binom.ppf(1e-4, 12 * runs, 0.93)), hits


def test_sensitivities() -> None:
    """Latitude: -tan phi relative in k.  Position 5 turned by eps about z: x sees +W s... by direct recalculation.
    Ten arcsec at most W eps = 7.3e-4 deg/h.
    """
    phi, p = math.radians(45.75), gyro(np.random.default_rng(12)) | {n: 0.0 for n in NAMES[2:]}
    arcsec = math.pi / 648000.0
    I_x, I_y = torque_balance(p, phi)
    result = R.Reduction.reduce(
        rows(I_x, I_y), setup(phi, u_latitude=10 * arcsec, u_attitude=10 * arcsec, u_mount=10 * arcsec)
    )
    lines = {(b.source, b.coefficient): b for b in result.budget}
    k = named(result)["k_x"]
    assert lines["latitude", "k_x"].contribution == pytest.approx(k.estimate * math.tan(phi) * 10 * arcsec, rel=1e-4)
    assert 10 * arcsec * W / DPH == pytest.approx(7.3e-4, rel=0.01)
    # R_x = mean of 5 and 7; x current, rate along y.  In 5 (y = E) a turn about x mixes z = N: W c eps, about z
    # x = U: W s eps; so it is in 7; together W eps sqrt(c^2 + s^2)/sqrt 2
    assert lines["attitude of each position", "R_x"].contribution == pytest.approx(7.29e-4 / math.sqrt(2.0), rel=0.01)


@pytest.mark.long
def test_attitude_shift_as_predicted() -> None:
    """Each position turned by 20 arcsec about each axis, one at a time: what the reduction gives is what the
    sensitivities say, to second order.
    """
    rng, phi = np.random.default_rng(13), math.radians(38.0)
    p, s = gyro(rng), setup(math.radians(38.0))
    I_x, I_y = torque_balance(p, phi)
    w = rows(I_x, I_y)
    plain, eps = named(R.Reduction.reduce(w, s)), 20.0 * math.pi / 648000.0
    position = w["position"]
    d = M.directions(position, phi)
    for n, axis in itertools.product((1, 4, 5, 6), "xyz"):
        turned = M.turned(axis, eps, (n,))
        C = turned[n]
        omega, g = C @ (W * np.array([0.0, math.cos(phi), math.sin(phi)])), C @ -U
        M_x = p["R_x"] - p["u_zx"] * g[1] + p["u_y"] * g[2]
        moved = named(R.Reduction.reduce(rows({**I_x, n: (omega[1] - M_x) / p["k_x"]}, I_y), s))
        lin = M.linear("x", w["mean_x"], d, s)
        found = fit([str(j) for j in range(6)], lin.X, lin.y, w["t_start"], w["t_end"], [], "", "", DPH)
        found = M.reported(found, M.quantities("x", s, {}), s, lin.k0)
        change = found.gain @ M.attitude_error("x", s, found, lin, position, turned)
        for j, name in enumerate(("k_x", "R_x", "u_y", "u_zx")):
            scale = KU if name == "k_x" else DPH
            shift = (moved[name].closed - plain[name].closed) * scale  # all readings weigh alike
            # second order: W eps^2 = 1.4e-7 deg/h
            assert shift == pytest.approx(change[j], rel=1e-3, abs=2e-6 * scale), (n, axis, name)


# ------------------------------------------------------------------------------------------ refusals
def ideal(phi: float = math.radians(45.75)) -> dict[str, np.ndarray]:
    return rows(*torque_balance(gyro(np.random.default_rng(14)), phi))


def refused(w: dict[str, np.ndarray], **changes: Any) -> str:
    with pytest.raises(ReductionError) as error:
        R.Reduction.reduce(w, setup(**changes))
    return str(error.value)


def test_refusals() -> None:
    w = ideal()
    assert "to 85° north or south" in refused(w, phi=math.radians(86.0))
    assert "to 85° north or south" in refused(w, phi=math.radians(-89.0))
    for n in BOOK:
        mine = w["position"] != n
        assert f"position {n} missing" in refused({k: v[mine] for k, v in w.items()})
    assert "I_x1 = I_x3" in refused({**w, "mean_x": np.full(32, 1e-4)})
    assert "I_y2 = I_y4" in refused({**w, "mean_y": np.where(w["position"] > 4, 2e-4, 1e-4)})
    assert "negative" in refused({**w, "mean_x": -w["mean_x"]})
    assert "1 cycle" in refused({k: v[:16] for k, v in w.items()})
    assert R.Reduction.reduce({k: v[:16] for k, v in w.items()}, setup(sigma=False)).repeatability == {}
    assert "y current: flagged" in refused({**w, "flagged_y": np.eye(32)[3]})
    assert "non-finite" in refused({**w, "mean_x": np.where(np.arange(32) == 5, np.nan, w["mean_x"])})
    assert "time does not increase" in refused({**w, "t_start": w["t_start"][::-1], "t_end": w["t_end"][::-1]})
    assert "gravity 9.6" in refused(w, gravity=9.6)
    assert "column mean_y is missing" in refused({k: v for k, v in w.items() if k != "mean_y"})
    noise_only = {**w, "mean_x": np.random.default_rng(1).normal(size=32) * 1e-4}
    assert "I_x1 = I_x3" in refused(noise_only) or "negative" in refused(noise_only)


def test_warning_beyond_80_degrees() -> None:
    phi = math.radians(82.0)
    result = R.Reduction.reduce(ideal(phi), setup(phi))
    assert any("beyond 80°" in w for w in result.warnings)
    assert not any("beyond 80°" in w for w in R.Reduction.reduce(ideal(), setup()).warnings)
