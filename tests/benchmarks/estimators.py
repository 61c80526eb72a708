"""NEES and NIS of every Kalman filter of the bench on series drawn from its own model, 1,000 runs of each.

    python tests/benchmarks/estimators.py            # all; three minutes of CPU
    python tests/benchmarks/estimators.py --runs 200 lti coefficients
    python tests/benchmarks/estimators.py --days 40  # instead: the live estimate of servo_polar, shortened days

NEES: mean of error' P^-1 error at the end of a run over its degrees of freedom; NIS: of all innovations of all runs.
The attitude filters run in attitude_estimator, the drift compensator in drift_compensation: those of the others are
drawn here.  Parts that state a standard deviation without being a Kalman filter are counted elsewhere: north finders
and the alignment of a platform in north_finder.py and platform_alignment.py.
Each should be 1; the bounds of 99 % are those of chi-square.  Rows "wrong: ..." are told a wrong model.
"""

from __future__ import annotations

import importlib
import math
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from scipy import linalg, stats

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

import polar_drift
from asked import asked
from estimating import (
    AIDED,
    AR3,
    SIGMA2,
    aided_model,
    aided_series,
    autoregressive,
    companion,
    kalman_of_many,
    padded,
    play,
    rate_model,
)
from polar_drift import DPH, PRIOR, Day, Noise

from gyrobench.engine.session import Session
from gyrobench.packaging.instance import make
from gyrobench.system.system import load_system

Array = np.ndarray[Any, Any]
#: NEES of each run, its degrees of freedom, sum of NIS of each run, their number
Count = tuple[Array, int, Array, int]
SIGMA, T, STEPS = 1.643e-3, 1e-3, 120


def scalar(part: str, runs: int, draw: Callable[[], tuple[Array, Array]], skip: int = 40, **told: Any) -> Count:
    """A filter of one estimate; NIS without the first readings, so that the start is forgotten."""
    one, nees, nis = make(f"estimator_{part}", "native"), [], []
    for _ in range(runs):
        x, z = draw()
        found = play(f"estimator_{part}", z, ["estimate", "variance", "nis"], instance=one, **told)
        nees.append((found[-1, 0] - x[-1]) ** 2 / found[-1, 1])
        nis.append(found[skip:, 2].sum())
    one.free()
    return np.array(nees), 1, np.array(nis), len(found) - skip


def slope(rng: np.random.Generator, n: int = STEPS) -> tuple[Array, Array]:
    """Value and slope at q = 0.5, P0 = 1."""
    F, G = rate_model(0.5, T)
    state, root, x = rng.normal(size=2), linalg.cholesky(G, lower=True), np.empty(n)
    for k in range(n):
        state = F @ state + root @ rng.normal(size=2)
        x[k] = state[0]
    return x, x + rng.normal(size=n) * SIGMA


def level(rng: np.random.Generator) -> tuple[Array, Array]:
    x = rng.normal() + np.cumsum(rng.normal(size=STEPS)) * math.sqrt(1e-3) * SIGMA
    return x, x + rng.normal(size=STEPS) * SIGMA


def drift(rng: np.random.Generator) -> tuple[Array, Array]:
    x = autoregressive(rng, STEPS, SIGMA2)
    return x, x + rng.normal(size=STEPS) * math.sqrt(SIGMA2)


def wild(rng: np.random.Generator) -> tuple[Array, Array]:
    """The level; one reading in 20 off by 30 sigma, not the last ones."""
    x, z = level(rng)
    off = (rng.random(STEPS) < 0.05) & (np.arange(STEPS) < STEPS - 2)
    return x, z + 30.0 * SIGMA * rng.choice([-1.0, 1.0], STEPS) * off


def matrices(part: str, rng: np.random.Generator, runs: int, wrong: bool = False) -> Count:
    """n = 3, m = 2, the model of EST-KF-COLOURED (drawn once); wrong: coloured noise told to be white, of the same
    covariance.
    """
    fixed = np.random.default_rng(20240623)
    A, drive, C = (
        0.8 * np.eye(3) + 0.15 * fixed.normal(size=(3, 3)),
        fixed.normal(size=(3, 2)),
        fixed.normal(size=(2, 3)),
    )
    root = {
        "W": drive @ np.diag(np.sqrt([0.5, 0.3])), "V": np.linalg.cholesky([[0.4, 0.1], [0.1, 0.3]]),
        "P0": math.sqrt(2.0) * np.eye(3),
    }  # fmt: skip
    given = {"A": A, "C": C, "x0": fixed.normal(size=3), **{k: r @ r.T for k, r in root.items()}}
    psi = np.array([[0.7, 0.1], [0.0, 0.5]]) if part == "coloured" else np.zeros((2, 2))
    P_v, n, m = linalg.solve_discrete_lyapunov(psi, given["V"]), 3, 2
    full = {
        "A": linalg.block_diag(given["A"], psi), "C": np.hstack([given["C"], np.eye(m)]),
        "W": linalg.block_diag(given["W"], given["V"]), "V": np.zeros((m, m)),
        "x0": np.append(given["x0"], np.zeros(m)),
        "P0": linalg.block_diag(given["P0"], P_v),
    }  # fmt: skip
    told = {**given, "V": P_v} if wrong else {**given, **({"psi": psi} if part == "coloured" else {})}
    used = "lti" if wrong else part
    steps = 30
    P = kalman_of_many(np.zeros((steps, m)), **(told if wrong else full))[-1][1][:n, :n]
    names = [*(f"xhat[{k}]" for k in (1, 2, 3)), "nis"]
    one, nees, nis, stationary = make(f"estimator_{used}", "native"), [], [], np.linalg.cholesky(P_v)
    for _ in range(runs):
        x, v, z = given["x0"] + root["P0"] @ rng.normal(size=n), stationary @ rng.normal(size=m), np.empty((steps, m))
        for k in range(steps):
            x, v = given["A"] @ x + root["W"] @ rng.normal(size=2), psi @ v + root["V"] @ rng.normal(size=m)
            z[k] = given["C"] @ x + v
        found = play(f"estimator_{used}", z, names, n=n, m=m, instance=one, **padded(**told))
        error = found[-1, :n] - x
        nees.append(error @ np.linalg.solve(P, error))
        nis.append(found[:, n].sum())
    one.free()
    return np.array(nees), n, np.array(nis), steps * m


def coefficients(rng: np.random.Generator, runs: int, **wrong: float) -> Count:
    """A day of windows of 100 s, the noise of EST-KF-COEFF; five coefficients and w (where it is believed in)."""
    day, noise = Day.of(), Noise()
    belief = Noise(**{**vars(noise), **wrong})
    x, z = polar_drift.draw(day, noise, rng, runs)
    _, P = polar_drift.least_squares(day, belief, z[0])
    size = 5 if wrong else 6
    names = [*(f"A[{k}]" for k in range(1, 6)), "w", "mean_nis"]
    one = polar_drift.instance()
    found = np.array([polar_drift.play(one, day, row, names, belief, **polar_drift.priors(PRIOR))[-1] for row in z])
    one.free()
    error = (found[:, :6] - x)[:, :size]
    nees = np.sum(error * np.linalg.solve(P[:size, :size], error.T).T, axis=1)
    return nees, size, found[:, 6] * day.t0.size, day.t0.size


def at_the_stop(rng: np.random.Generator, runs: int) -> Count:
    """The five coefficients when the filter first says that the test may stop, 0.003 deg/h wanted: a chosen moment."""
    day, noise = Day.of(), Noise()
    x, z = polar_drift.draw(day, noise, rng, runs)
    names, wanted = [*(f"A[{k}]" for k in range(1, 6)), "may_stop"], {f"wanted[{k}]": 0.003 * DPH for k in range(1, 6)}
    one, covariances, nees = polar_drift.instance(), {}, []
    for true, row in zip(x, z, strict=True):
        found = polar_drift.play(one, day, row, names, noise, **polar_drift.priors(PRIOR), **wanted)
        if found[:, 5].any():
            k = int(np.argmax(found[:, 5])) + 1
            if k not in covariances:
                covariances[k] = polar_drift.least_squares(Day(day.t0[:k], day.t1[:k]), noise, row[:k])[1][:5, :5]
            error = found[k - 1, :5] - true[:5]
            nees.append(error @ np.linalg.solve(covariances[k], error))
    one.free()
    print(f"  stopped in {len(nees)} of {runs} runs, after {min(covariances)} to {max(covariances)} windows of 864")
    return np.array(nees), 5, np.zeros(0), 0


def aided(rng: np.random.Generator, runs: int) -> Count:
    """80 readings, every eighth with an angle; rate and drift at the end, their covariance from the matrices."""
    F, Q = aided_model()
    P, R = np.diag([1.0, AIDED["P0_slope"], AIDED["drift"] ** 2, 0.0]), [AIDED["R"], AIDED["sigma_angle"] ** 2]
    first, rows = True, np.array([[1.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
    for k in range(1, 81):
        P = F @ P @ F.T + Q
        if first:  # the angle begins with its first reading, and nothing is known of the drift before
            P[3], P[:, 3] = 0.0, 0.0
        for j in range(1 + (k % 8 == 0)):
            if j and first:
                first, P[3, 3] = False, R[1]
                continue
            gain = P @ rows[j] / (rows[j] @ P @ rows[j] + R[j])
            gain[2] *= not first
            L = np.eye(4) - np.outer(gain, rows[j])
            P = L @ P @ L.T + R[j] * np.outer(gain, gain)
    P, one, nees, nis = P[np.ix_([0, 2], [0, 2])], make("estimator_aided", "native"), [], []
    for _ in range(runs):
        X, z, angle = aided_series(rng, 80, 8)
        one.set({**AIDED, "T_c": 0.0})
        one.initialize(0.0)
        total = 0.0
        for k, (reading, a) in enumerate(zip(z.tolist(), angle.tolist(), strict=True)):
            new = math.isfinite(a)
            one.set({"z": reading, "angle": a if new else 0.0, "angle_new": float(new)})
            one.step(k * AIDED["Ts"], AIDED["Ts"])
            total += one.get(["nis"])[0]
        error = np.array(one.get(["estimate", "b"])) - X[-1, [0, 2]]
        nees.append(error @ np.linalg.solve(P, error))
        nis.append(total)
        one.reset()
    one.free()
    return np.array(nees), 2, np.array(nis), 80


def ended(channels: Any, name: str, row: int) -> Array:
    """A vector of three at a sample of a record."""
    return np.array([channels[f"{name}[{k}]"][row] for k in (1, 2, 3)])


def attitude(part: str, rocking: str, rng: np.random.Generator, runs: int) -> Count:
    """Attitude and biases after a minute of rest and one of rocking; NIS of the readings of one step a second."""
    system = load_system("attitude_estimator")
    reduction = importlib.import_module(".reduction", type(system).__module__)
    short = {"phases": "rest rocking", "rest": 60.0, "cycles": 6, "rocking": rocking}
    nees, nis, used = [], [], []
    with Session(system.with_values(short), parts={"estimator": part}) as session:
        for seed in rng.integers(1, 2**31, runs):
            c = session.run({}, seed=int(seed)).channels
            inside = np.flatnonzero(c["exciter.gate"] > 0.5)
            last = int(inside[-1])
            turned = reduction.attitude_errors(
                ended(c, "estimator.angle", last)[None], ended(c, "motion.angle", last)[None]
            )
            error = np.append(turned[0], reduction.true_bias(c)[last] - ended(c, "estimator.bias", last))
            pairs = [[f"estimator.covariance[{min(i, j)},{max(i, j)}]" for j in range(1, 7)] for i in range(1, 7)]
            scale = np.array([1.0] * 3 + [1e-6] * 3)  # numbers near 1
            P = np.array([[c[name][last] for name in row] for row in pairs]) / np.outer(scale, scale)
            nees.append(error / scale @ np.linalg.solve(P, error / scale))
            nis.append(c["estimator.nis"][inside].sum())
            used.append(c["estimator.used"][inside].sum())
    return np.array(nees), 6, np.array(nis), round(float(np.mean(used)))


def compensated(rng: np.random.Generator, runs: int) -> Count:
    """Records of 6 h: drift, commanded angle and table angle at the end of each; the filter compensates its drift."""
    system = load_system("drift_compensation").with_values({"records": runs})
    reduction = importlib.import_module(".reduction", type(system).__module__)
    with Session(system) as session:
        c = session.run({}, seed=int(rng.integers(1, 2**31))).channels
    rows = reduction.whole_records(c, float(system["length"]), float(system["Ts"]))
    last, scale = rows[:, -1], np.array([system["rms"], system["sigma"], system["sigma"]])
    names = (("M", "estimate"), ("alpha", "alpha"), ("theta", "theta"))
    error = np.column_stack([c[f"table.{x}"][last] - c[f"compensator.{y}"][last] for x, y in names]) / scale
    pairs = [[f"compensator.covariance[{min(i, j)},{max(i, j)}]" for j in (1, 2, 3)] for i in (1, 2, 3)]
    P = np.array([[c[name][last] for name in row] for row in pairs]).transpose(2, 0, 1)
    nees = np.einsum("ni,ni->n", error, np.linalg.solve(P, error[..., None])[..., 0])
    return nees, 3, np.asarray(c["compensator.nis"])[rows].sum(axis=1), rows.shape[1]


def averaged(rng: np.random.Generator, runs: int) -> Count:
    """Means of ten angle readings across zero; the part states no innovation."""
    one, nees = make("angle_averager", "native"), []
    one.set({"Ts": 0.1, "sigma": 1e-5})
    one.initialize(0.0)
    for k, e in enumerate(1e-5 * rng.normal(size=10 * runs)):
        one.set({"z": float(e % (2.0 * math.pi))})
        one.step(0.1 * k, 0.1)
        if k % 10 == 9:
            mean, sd = one.get(["estimate", "sd"])
            nees.append((((mean + math.pi) % (2.0 * math.pi) - math.pi) / sd) ** 2)
    one.free()
    return np.array(nees), 1, np.zeros(0), 0


def cases(runs: int) -> Iterator[tuple[str, Callable[[np.random.Generator], Count]]]:
    level_model = {"q": 0.0, "P0_slope": 0.0, "walk": 1e-3 * SIGMA**2 / T, "R": SIGMA**2}
    F, G = companion(AR3, SIGMA2)
    start = float(linalg.solve_discrete_lyapunov(F, G)[0, 0])
    husa = {"R0": SIGMA**2, "q": 0.5, "b": 0.99, "skip": 1500}  # form 1 starts at y2 - P0 and takes ever so long
    yield "kalman_ar", lambda rng: scalar("kalman_ar", runs, lambda: drift(rng), P0=start)
    yield "kalman_rate, slope", lambda rng: scalar("kalman_rate", runs, lambda: slope(rng))
    yield "kalman_rate, level", lambda rng: scalar("kalman_rate", runs, lambda: level(rng), **level_model)
    yield "kalman_robust, level", lambda rng: scalar("kalman_robust", runs, lambda: level(rng), **level_model)
    yield "kalman_robust, wild", lambda rng: scalar("kalman_robust", runs, lambda: wild(rng), **level_model)
    yield "wrong: kalman_rate, wild", lambda rng: scalar("kalman_rate", runs, lambda: wild(rng), **level_model)
    yield "sage_husa, form 1", lambda rng: scalar("sage_husa", runs, lambda: slope(rng, 2000), form=1, **husa)
    yield "sage_husa, form 2", lambda rng: scalar("sage_husa", runs, lambda: slope(rng, 2000), form=2, **husa)
    yield "lti", lambda rng: matrices("lti", rng, runs)
    yield "coloured", lambda rng: matrices("coloured", rng, runs)
    yield "wrong: coloured as white", lambda rng: matrices("coloured", rng, runs, wrong=True)
    yield "coefficients", lambda rng: coefficients(rng, runs)
    yield "coefficients, at the stop", lambda rng: at_the_stop(rng, runs)
    yield "aided", lambda rng: aided(rng, runs)
    yield "drift_compensator", lambda rng: compensated(rng, runs)
    yield "angle_averager", lambda rng: averaged(rng, runs)
    yield "attitude_mekf, rocking 20 deg", lambda rng: attitude("attitude_mekf", "20deg", rng, runs)
    yield "attitude_kalman, rocking 1 deg", lambda rng: attitude("attitude_kalman", "1deg", rng, runs)
    yield "wrong: attitude_kalman, 20 deg", lambda rng: attitude("attitude_kalman", "20deg", rng, max(runs // 10, 1))
    yield "wrong: coefficients, w white", lambda rng: coefficients(rng, runs, rms=0.0, white=0.05 * DPH)
    yield "wrong: coefficients, tau / 2", lambda rng: coefficients(rng, runs, tau=900.0)
    yield "wrong: coefficients, tau x 2", lambda rng: coefficients(rng, runs, tau=3600.0)


def live_days(days: int, seed: int) -> None:
    """Count how often 95 % of the live estimate hold the truth, at the end and at the stop: days of 1723 s."""
    from servoing import DAY50, polar_harmonics

    names, held = ("A0", "A1", "B1", "A2", "B2"), {"end": [], "stop": []}  # type: ignore[var-annotated]
    values = {**DAY50, "route": "combination", "wanted": 0.002 * DPH, "coefficients.sigma": 9.5e-8}
    system, nis = load_system("servo_polar"), []
    system.request("coefficients")
    with Session(system) as session:
        for k in range(days):
            record = session.run({**values, "gyro.markov_tau": 60.0, "gyro.markov": 0.004 * DPH}, seed=seed + k)
            w = record.windows
            for row in record.run.plan:
                if row.label not in ("polar S", "polar N"):
                    continue
                rows, true = np.flatnonzero(w["phase"] == row.phase), polar_harmonics(record, row.label)
                nis.append(w["live_mean_nis"][rows[-1]])
                for name, at in (("end", rows[-1]), ("stop", rows[w["live_may_stop"][rows] > 0.5][0])):
                    error = [(w[f"live_value_{n}"][at] - true[n]) / w[f"live_sd_{n}"][at] for n in names]
                    held[name].append(np.array(error))
    for name, errors in held.items():
        inside = np.mean(np.abs(errors) < 1.96, axis=0)
        print(f"{name:5s} {len(errors)} mounts: held {inside.min():.3f} to {inside.max():.3f}, "
              f"mean square {np.mean(np.square(errors)):.3f}")  # fmt: skip
    print(f"NIS {np.mean(nis):.3f}")


def main() -> None:
    given = asked(
        __doc__, "names", runs=1000, seed=1, days=(0, "count the live estimate of servo_polar in so many days")
    )
    if given.days:
        live_days(given.days, given.seed)
        return
    print(f"{'filter':30s} {'NEES':>7s} {'99 % of':>9s} {'chi-sq.':>7s} {'NIS':>7s} {'99 % of':>9s} {'chi-sq.':>7s}")
    for name, count in cases(given.runs):
        if given.names and not any(word in name for word in given.names):
            continue
        nees, dof, nis, readings = count(np.random.default_rng(given.seed))
        line = f"{name:30s}"
        for values, k in ((nees, dof), (nis, readings)):
            if not values.size:
                continue
            low, high = stats.chi2.ppf([0.005, 0.995], k * values.size) / (k * values.size)
            line += f" {values.mean() / k:7.3f} {low:9.3f} {high:7.3f}"
        print(line, flush=True)


if __name__ == "__main__":
    main()
