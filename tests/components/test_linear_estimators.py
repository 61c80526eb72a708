"""The filters of any linear model, white and coloured noise of the readings, and the one for wild readings."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from estimating import AR3, SIGMA2, companion, kalman_of_many, padded, play, rate_model, rms
from scipy import linalg, stats

from gyrobench.component import ComponentError
from gyrobench.packaging import load_part

Array = np.ndarray[Any, Any]
XHAT, P_DIAG = ([f"{n}[{k}]" for k in range(1, 7)] for n in ("xhat", "P_diag"))
STATES = [*XHAT, *P_DIAG, "nis", "nis_dof"]


def covariance(rng: np.random.Generator, n: int) -> Array:
    root = rng.normal(size=(n, n))
    return root @ root.T


def model(rng: np.random.Generator, n: int, m: int) -> dict[str, Array]:
    """A random one; A has eigenvalues up to 0.98."""
    A = rng.normal(size=(n, n))
    return {
        "A": 0.98 * A / np.abs(np.linalg.eigvals(A)).max(),
        "C": rng.normal(size=(m, n)),
        "W": covariance(rng, n),
        "V": covariance(rng, m) + 0.1 * np.eye(m),
        "x0": rng.normal(size=n),
        "P0": covariance(rng, n),
    }


def built(part: str, n: int, m: int, **matrices: Any) -> Any:
    one = load_part(part)(n=n, m=m, **{k: v.tolist() for k, v in padded(**matrices).items()})
    one.initialize()
    return one


# ------------------------------------------------------------------------------------- estimator_lti
@pytest.mark.parametrize(("n", "m"), [(6, 3), (3, 2), (1, 1)])
def test_lti_is_the_matrix_filter(n: int, m: int) -> None:
    """State, variances and nis, each reading missing now and then by itself."""
    rng = np.random.default_rng(10 * n + m)
    given = model(rng, n, m)
    z = 3.0 * rng.normal(size=(80, m))
    valid = rng.random(size=z.shape) > 0.25
    found = play("estimator_lti", z, STATES, valid=valid, n=n, m=m, **padded(**given))
    expected = kalman_of_many(z, **given, valid=valid)
    assert found[:, :n] == pytest.approx(np.array([x for x, _, _ in expected]), abs=1e-11)
    assert found[:, 6 : 6 + n] == pytest.approx(np.array([np.diag(P) for _, P, _ in expected]), rel=1e-10)
    assert found[:, 12] == pytest.approx([e for _, _, e in expected], rel=1e-9, abs=1e-12)
    assert (found[:, 13] == valid.sum(axis=1)).all() and not found[:, n:6].any()


@pytest.mark.parametrize("part", ["estimator_lti", "estimator_coloured"])
def test_three_states_are_the_same_numbers_with_a_fourth_beside_them(part: str) -> None:
    """Up to three states are computed in matrices of their size, more in those of six: sums without the zeros."""
    rng = np.random.default_rng(33)
    given, z = model(rng, 3, 3), rng.normal(size=(120, 3))
    if part == "estimator_coloured":
        given["psi"] = np.diag([0.8, 0.5, 0.2])
    valid = rng.random(size=z.shape) > 0.1
    wide = {name: np.zeros((4, 4)) for name in ("A", "W", "P0")} | {"C": np.zeros((3, 4)), "x0": np.zeros(4)}
    for name, place in wide.items():
        place[tuple(slice(0, k) for k in given[name].shape)] = given[name]
    found = [
        play(part, z, STATES, valid=valid, n=n, m=3, **padded(**{**given, **more})) for n, more in ((3, {}), (4, wide))
    ]
    assert np.array_equal(*found) and found[0][-1].all(where=[*[True] * 3, *[False] * 9, True, True])


def test_lti_ends_at_the_riccati_equation() -> None:
    rng = np.random.default_rng(5)
    given = model(rng, 4, 2)
    found = play("estimator_lti", np.zeros((300, 2)), P_DIAG, n=4, m=2, **padded(**given))[-1, :4]
    prior = linalg.solve_discrete_are(given["A"].T, given["C"].T, given["W"], given["V"])
    S = given["C"] @ prior @ given["C"].T + given["V"]
    after = prior - prior @ given["C"].T @ np.linalg.solve(S, given["C"] @ prior)
    assert found == pytest.approx(np.diag(after), rel=1e-9)


def test_three_axes_in_one_instance_are_three_instances() -> None:
    """Value and slope of each axis, different noise: the readings of one axis change nothing on another."""
    rng = np.random.default_rng(3)
    z, valid = rng.normal(size=(60, 3)), rng.random(size=(60, 3)) > 0.2
    q, R = (0.5, 2.0, 8.0), (1e-6, 2e-6, 3e-6)
    F, Gs = rate_model(1.0, 1e-3)[0], [rate_model(x, 1e-3)[1] for x in q]
    given = {
        "A": linalg.block_diag(F, F, F), "W": linalg.block_diag(*Gs), "V": np.diag(R), "P0": np.eye(6),
        "C": np.eye(6)[::2],
    }  # fmt: skip
    names = [f"{n}[{k}]" for k in (1, 2, 3) for n in ("estimates", "variances", "innovations")]
    found = play("estimator_lti", z, names, valid=valid, n=6, m=3, **padded(**given))
    for axis in range(3):
        names = ["estimate", "variance", "innovation"]
        alone = play("estimator_kalman_rate", z[:, axis], names, valid=valid[:, axis], q=q[axis], R=R[axis])
        assert found[:, 3 * axis : 3 * axis + 3] == pytest.approx(alone, rel=1e-9, abs=1e-13)


LEVEL = {"A": [[1.0]], "C": [[1.0]], "W": [[1e-3]], "V": [[1.0]], "P0": [[1.0]]}


@pytest.mark.parametrize(
    ("n", "m", "change", "text"),
    [
        (2, 1, {"A": np.eye(2), "W": np.diag([1.0, -1e-6]), "C": [[1, 0]], "P0": np.eye(2)}, "W is not a covariance"),
        (2, 1, {"A": 0.5 * np.eye(2), "W": [[1, 2], [2, 1]], "C": [[1, 0]]}, "W is not a covariance"),
        (2, 1, {"A": 0.5 * np.eye(2), "W": [[1, 0.2], [0, 1]], "C": [[1, 0]]}, "W is not a covariance"),
        (2, 1, {"A": 0.5 * np.eye(2), "W": [[0, 0.2], [0.2, 1]], "C": [[1, 0]]}, "W is not a covariance"),
        (1, 1, {"P0": [[-1.0]]}, "P0 is not a covariance"),
        (1, 1, {"V": [[0.0]]}, "V must be symmetric and positive definite"),
        (1, 2, {"C": [[1.0], [1.0]], "V": [[1, 1], [1, 1]]}, "V must be symmetric and positive definite"),
        (1, 1, {"V": np.eye(2)}, "V has numbers beyond m = 1 readings"),
        (1, 1, {"A": np.eye(2)}, "A, C, W, x0 or P0 has numbers beyond n = 1 states or m = 1 readings"),
        (1, 1, {"C": [[0.0]]}, "do not see a state that does not die away"),
    ],
)
def test_lti_refusals(n: int, m: int, change: dict[str, Any], text: str) -> None:
    built("estimator_lti", 1, 1, **LEVEL)
    with pytest.raises(ComponentError, match=text):
        built("estimator_lti", n, m, **(LEVEL | change))


@pytest.mark.parametrize("part", ["estimator_lti", "estimator_coloured"])
def test_two_readings_that_are_one_to_rounding(part: str) -> None:
    """P0 = 1 seen twice with a noise of 1e-14: the second pivot of S is 2e-14, rounding.  Said, not left out."""
    given = {**LEVEL, "C": [[1.0], [1.0]], "V": 1e-14 * np.eye(2), "W": [[1e-20]]}
    one = built(part, 1, 2, **given, **({"psi": 0.1 * np.eye(2)} if part == "estimator_coloured" else {}))
    with pytest.raises(ComponentError, match="the same innovation to rounding"):
        one.do_step(0.0, 1e-3)


def test_unobservable_unstable_modes_are_refused_and_no_others() -> None:
    """Against the eigenvectors (Popov, Belevitch, Hautus): an unseen mode with an eigenvalue of 1 or more."""
    rng = np.random.default_rng(9)
    seen = [0, 0]
    for _ in range(120):
        n, hidden = int(rng.integers(2, 7)), int(rng.integers(0, 3))
        hidden = min(hidden, n - 1)
        blocks = rng.normal(size=(n, n))
        values = rng.choice([0.3, 0.9, 1.0, 1.2, -1.0], size=n)
        blocks = np.triu(blocks, 1) * 0.3 + np.diag(values)
        blocks[: n - hidden, n - hidden :] = 0.0  # the last states do not reach the first, which alone are read
        C = np.hstack([rng.normal(size=(1, n - hidden)), np.zeros((1, hidden))])
        base = np.linalg.qr(rng.normal(size=(n, n)))[0]
        A, C = base @ blocks @ base.T, C @ base.T
        unseen = any(
            np.linalg.svd(np.vstack([A - x * np.eye(n), C]), compute_uv=False)[-1] < 1e-9
            for x in values
            if abs(x) >= 1.0
        )
        seen[unseen] += 1
        given = {"A": A, "C": C, "W": np.eye(n), "V": [[1.0]], "P0": np.eye(n)}
        if unseen:
            with pytest.raises(ComponentError, match="do not see a state"):
                built("estimator_lti", n, 1, **given)
        else:
            built("estimator_lti", n, 1, **given)
    assert min(seen) > 20


# ------------------------------------------------------------------------------- estimator_coloured
def coloured(rng: np.random.Generator) -> dict[str, Array]:
    """n = 3, m = 2, psi not diagonal."""
    given = model(rng, 3, 2)
    return {**given, "psi": np.array([[0.8, 0.2], [-0.1, 0.6]]), "V": covariance(rng, 2)}


def augmented(given: dict[str, Array]) -> dict[str, Array]:
    """The same with v among the states, and readings without noise."""
    m = len(given["C"])
    P_v = linalg.solve_discrete_lyapunov(given["psi"], given["V"])
    return {
        "A": linalg.block_diag(given["A"], given["psi"]), "C": np.hstack([given["C"], np.eye(m)]),
        "W": linalg.block_diag(given["W"], given["V"]), "V": np.zeros((m, m)),
        "x0": np.append(given["x0"], np.zeros(m)),
        "P0": linalg.block_diag(given["P0"], P_v),
    }  # fmt: skip


def test_coloured_is_the_augmented_filter() -> None:
    """Estimates and variances, instants without a reading included: they are bridged exactly."""
    rng = np.random.default_rng(21)
    given = coloured(rng)
    z = 3.0 * rng.normal(size=(100, 2))
    there = rng.random(100) > 0.3
    both = np.column_stack([there, there])
    both[5] = [True, False]  # one missing reading makes the instant one without
    found = play("estimator_coloured", z, STATES, valid=both, n=3, m=2, **padded(**given))
    there[5] = False
    expected = kalman_of_many(z, **augmented(given), valid=np.column_stack([there, there]))
    assert found[:, :3] == pytest.approx(np.array([x[:3] for x, _, _ in expected]), abs=1e-10)
    assert found[:, 6:9] == pytest.approx(np.array([np.diag(P)[:3] for _, P, _ in expected]), rel=1e-9)
    assert found[:, 12] == pytest.approx([e for _, _, e in expected], rel=1e-7, abs=1e-10)
    assert (found[:, 13] == 2.0 * there).all()


def test_coloured_is_the_augmented_part_beside_it() -> None:
    """estimator_lti with v among its states and a reading noise that is next to nothing."""
    given = {"A": [[0.99]], "C": [[1.0]], "W": [[0.02]], "V": [[0.19]], "psi": [[0.9]], "P0": [[1.0]], "x0": [0.3]}
    z = np.random.default_rng(4).normal(size=60)
    alone = play("estimator_coloured", z, ["estimate", "variance"], n=1, **padded(**given))
    more = {**augmented({k: np.array(v) for k, v in given.items()}), "V": np.array([[1e-9]])}
    found = play("estimator_lti", z, ["xhat[1]", "P_diag[1]"], n=2, **padded(**more))
    assert alone == pytest.approx(found, abs=2e-8)


def test_equal_time_constants_leave_the_error_of_the_start() -> None:
    """psi = A: H = 0.  P after the first reading is P0' (1 - P0'/(P0' + P_v)), P0' = 0.81 + W; then it follows

    P <- 0.81 P + W - W2/(W + V)        which the readings do not make smaller than by W2/(W + V)
    """
    W, V = 0.01, 0.19
    given = {"A": [[0.9]], "C": [[1.0]], "W": [[W]], "V": [[V]], "psi": [[0.9]], "P0": [[1.0]]}
    found = play("estimator_coloured", np.ones(4), "variance", n=1, **padded(**given))
    P = (0.81 + W) * (1.0 - (0.81 + W) / (0.81 + W + V / 0.19))
    for variance in found:
        assert variance == pytest.approx(P, rel=1e-12)
        P = 0.81 * P + W - W * W / (W + V)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"psi": [[1.0]]}, "psi must have its eigenvalues within the unit circle"),
        ({"psi": [[-1.2]]}, "psi must have its eigenvalues within the unit circle"),
        ({"V": [[-1.0]]}, "V is not a covariance"),
        ({"V": [[0.0]], "W": [[0.0]], "A": [[0.5]]}, "C W C' \\+ V must be positive definite"),
        ({"psi": 0.5 * np.eye(2)}, "V or psi has numbers beyond m = 1 readings"),
    ],
)
def test_coloured_refusals(change: dict[str, Any], text: str) -> None:
    good = {**LEVEL, "psi": [[0.9]]}
    built("estimator_coloured", 1, 1, **good)
    with pytest.raises(ComponentError, match=text):
        built("estimator_coloured", 1, 1, **(good | change))


# --------------------------------------------------------------------------- estimator_kalman_robust
ROBUST, SIGMA = "estimator_kalman_robust", 1.643e-3
WALK = {"q": 0.0, "P0_slope": 0.0, "walk": 1e-3 * SIGMA**2 / 1e-3}


def walking(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    x = rng.normal() + np.cumsum(rng.normal(size=n)) * math.sqrt(1e-3) * SIGMA
    return x, x + rng.normal(size=n) * SIGMA


def test_without_wild_readings_it_is_the_plain_filter() -> None:
    _, z = walking(np.random.default_rng(1), 500)
    names = ["estimate", "variance", "innovation", "nis"]
    found = play(ROBUST, z, [*names, "wild_count"], probability=1.0 - 1e-9, **WALK)
    assert (found[:, :4] == play("estimator_kalman_rate", z, names, **WALK)).all() and found[-1, 4] == 0.0


@pytest.mark.parametrize("p", [0.5, 0.95, 0.999, 1.0 - 1e-9])
def test_gate_is_the_quantile(p: float) -> None:
    assert play(ROBUST, [0.0], "gate", probability=p)[0] == pytest.approx(stats.chi2.ppf(p, 1), rel=1e-6)


def test_ordinary_readings_pass_as_often_as_stated() -> None:
    """20 000 readings of the model itself at p = 0.99: 200 are called wild, standard deviation 14."""
    _, z = walking(np.random.default_rng(2), 20000)
    found = play(ROBUST, z, ["wild_count", "nis"], probability=0.99, **WALK)
    assert abs(found[-1, 0] - 200.0) < 3.3 * 14.0
    assert np.mean(found[:, 1] > stats.chi2.ppf(0.99, 1)) == found[-1, 0] / 20000


def test_a_wild_reading_moves_the_value_by_P_g_over_y_and_leaves_the_variance() -> None:
    """K y = P/(y2/g) y = P g / y; of P it takes the share P/(y2/g), here 1e-5."""
    _, z = walking(np.random.default_rng(3), 400)
    z[-1] += 1.0
    names = ["estimate", "variance", "innovation", "gate", "wild"]
    before, after = play(ROBUST, z, names, **WALK)[-2:]
    P = before[1] + 1e-3 * SIGMA**2
    assert after[4] == 1.0 and before[4] == 0.0
    assert after[0] - before[0] == pytest.approx(P * after[3] / after[2], rel=1e-6)
    assert after[1] == pytest.approx(P * (1.0 - P * after[3] / after[2] ** 2), rel=1e-9)


def test_missing_and_wild_readings() -> None:
    """One reading in 20 off by 30 sigma to either side, one in 10 missing: the error is that of the filter which knows
    which they are, to 5 %; the plain filter's is several times as large.
    """
    rng = np.random.default_rng(4)
    x, z = walking(rng, 6000)
    there, wild = rng.random(x.size) > 0.1, rng.random(x.size) < 0.05
    z = z + 30.0 * SIGMA * rng.choice([-1.0, 1.0], x.size) * wild
    error = {
        "robust": rms((play(ROBUST, z, valid=there, **WALK) - x)[200:]),
        "knows": rms((play("estimator_kalman_rate", z, valid=there & ~wild, **WALK) - x)[200:]),
        "plain": rms((play("estimator_kalman_rate", z, valid=there, **WALK) - x)[200:]),
    }
    assert error["robust"] < 1.05 * error["knows"] and error["plain"] > 3.0 * error["robust"]


def test_a_change_of_the_signal_is_followed_and_counted() -> None:
    """A step of 50 sigma: the fifth reading beyond the gate is believed; without patience it takes ever so long."""
    _, z = walking(np.random.default_rng(5), 500)
    z[300:] += 50.0 * SIGMA
    found = play(ROBUST, z, ["estimate", "restarts", "wild_count"], **WALK)
    assert found[303, 1] == 0.0 and found[304, 1] == 1.0 and found[-1, 1] == 1.0
    assert abs(found[304, 0] - z[304]) < 6.0 * SIGMA
    assert abs(found[-1, 0] - z[400:].mean()) < 1.5 * SIGMA
    never = play(ROBUST, z, ["estimate", "restarts"], patience=0, **WALK)
    assert never[-1, 1] == 0.0 and abs(never[330, 0] - z[330]) > 30.0 * SIGMA


# ------------------------------------------------------------------------------------- statsmodels
def statsmodels_filter(z: Array, given: dict[str, Array]) -> tuple[Array, Array]:
    """Filtered states and variances (k, n) of statsmodels; NaN marks missing readings."""
    from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

    n, m = len(given["A"]), len(given["C"])
    kf = KalmanFilter(k_endog=m, k_states=n, design=given["C"], obs_cov=given["V"], transition=given["A"],
                      selection=np.eye(n), state_cov=given["W"])  # fmt: skip
    kf.bind(np.ascontiguousarray(z))
    A = given["A"]  # statsmodels begins with the prediction of the first reading
    kf.initialize_known(A @ given["x0"], A @ given["P0"] @ A.T + given["W"])
    found = kf.filter()
    return found.filtered_state.T, np.array([np.diag(P) for P in np.moveaxis(found.filtered_state_cov, 2, 0)])


def test_against_statsmodels() -> None:
    """estimator_lti with readings missing one by one; estimator_coloured with the noise among the states there."""
    rng = np.random.default_rng(31)
    z, valid = 2.0 * rng.normal(size=(60, 2)), rng.random(size=(60, 2)) > 0.2
    given = model(rng, 3, 2)
    states, variances = statsmodels_filter(np.where(valid, z, np.nan), given)
    found = play("estimator_lti", z, STATES, valid=valid, n=3, m=2, **padded(**given))
    assert found[:, :3] == pytest.approx(states, abs=1e-11) and found[:, 6:9] == pytest.approx(variances, rel=1e-10)
    valid[:, 1] = valid[:, 0]
    given = coloured(rng)
    states, variances = statsmodels_filter(np.where(valid, z, np.nan), augmented(given))
    found = play("estimator_coloured", z, STATES, valid=valid, n=3, m=2, **padded(**given))
    assert found[:, :3] == pytest.approx(states[:, :3], abs=1e-10)
    assert found[:, 6:9] == pytest.approx(variances[:, :3], rel=1e-8)


# -------------------------------------------------------------------------------------- consistency
@pytest.mark.parametrize("part", ["lti", "coloured"])
def test_nees_and_nis_of_the_state(part: str) -> None:
    """150 runs of the model itself: NEES of the whole state by the filter's own covariance (here its oracle's, which
    the tests above hold equal) and nis within their 99.9 % chi-square bounds.
    """
    rng = np.random.default_rng(61)
    given = coloured(rng) if part == "coloured" else model(rng, 3, 2)
    oracle = augmented(given) if part == "coloured" else given
    steps, runs = 25, 150
    roots = {k: np.linalg.cholesky(given[k]) for k in ("W", "V", "P0")}
    P = kalman_of_many(np.zeros((steps, 2)), **oracle)[-1][1][:3, :3]
    nees, nis = [], []
    from native_parts import make

    one = make(f"estimator_{part}", "native")
    for _ in range(runs):
        x = given["x0"] + roots["P0"] @ rng.normal(size=3)
        v = np.linalg.cholesky(linalg.solve_discrete_lyapunov(given["psi"], given["V"])) @ rng.normal(size=2) \
            if part == "coloured" else None  # fmt: skip
        z = np.empty((steps, 2))
        for k in range(steps):
            x, nu = given["A"] @ x + roots["W"] @ rng.normal(size=3), roots["V"] @ rng.normal(size=2)
            v = nu if v is None or part == "lti" else given["psi"] @ v + nu
            z[k] = given["C"] @ x + v
        found = play(f"estimator_{part}", z, [*XHAT[:3], "nis"], n=3, m=2, instance=one, **padded(**given))
        error = found[-1, :3] - x
        nees.append(error @ np.linalg.solve(P, error))
        nis.append(found[:, 3].sum())
    one.free()
    for values, dof in ((nees, 3), (nis, 2 * steps)):
        low, high = stats.chi2.ppf([0.0005, 0.9995], dof * runs) / runs
        assert low < np.mean(values) < high


def test_coloured_noise_taken_white_is_seen_by_nees() -> None:
    """An AR(1) noise of 0.9 over a slow level, given to the white filter with its whole variance: NEES far above 1."""
    rng = np.random.default_rng(7)
    v = np.zeros(8000)
    for k in range(1, v.size):
        v[k] = 0.9 * v[k - 1] + rng.normal() * math.sqrt(0.19)
    x = np.cumsum(rng.normal(size=v.size)) * 0.05
    level = {"A": [[1.0]], "C": [[1.0]], "W": [[0.0025]], "P0": [[1.0]]}
    names = ["estimate", "variance"]
    right = play("estimator_coloured", x + v, names, n=1, **padded(**level, V=[[0.19]], psi=[[0.9]]))[100:]
    wrong = play("estimator_lti", x + v, names, n=1, **padded(**level, V=[[1.0]]))[100:]
    assert np.mean((right[:, 0] - x[100:]) ** 2 / right[:, 1]) == pytest.approx(1.0, abs=0.25)
    assert np.mean((wrong[:, 0] - x[100:]) ** 2 / wrong[:, 1]) > 4.0


def test_ar_drift_as_a_linear_model() -> None:
    """EST-KF-AR is a case of it: the companion matrices give what the part for them gives."""
    z = np.random.default_rng(8).normal(size=50) * 2e-3
    F, G = companion(AR3, SIGMA2)
    names = ["estimate", "variance", "nis"]
    given = padded(A=F, W=G, C=np.eye(1, 3), V=[[SIGMA2]], P0=1e-4 * np.eye(3))
    found = play("estimator_lti", z, names, n=3, **given)
    assert found == pytest.approx(play("estimator_kalman_ar", z, names), rel=1e-9, abs=1e-18)
