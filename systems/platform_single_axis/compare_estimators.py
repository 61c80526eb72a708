"""Compare the estimators of the bench in the loop of the platform, at one phase margin and in pairs of equal seed.

    python systems/platform_single_axis/compare_estimators.py --out FOLDER
    python systems/platform_single_axis/compare_estimators.py --out FOLDER --estimators estimator_wavelet:sym4

Every estimator is set to the same phase lag at 10 Hz.  What is left of the differences (none has no lag, averages and
wavelets come in steps) is taken out by the crossover of the loop, moved until the measured phase margin is the one
wanted.  Then each candidate rides with the same seeds; FOLDER/comparison.html ranks them.
"""

from __future__ import annotations

import argparse
import cmath
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import linalg, optimize

import gyrobench as gb
from gyrobench.arrays import Array
from gyrobench.component.blocks import wavelet_bank

NAMES = (
    "none", "moving_average", "alpha_beta_gamma", "kalman_ar", "kalman_rate", "kalman_robust", "sage_husa", "wavelet",
    "aided", "wavelet:bior1.5", "wavelet:db4", "wavelet:sym4", "wavelet:coif4", "wavelet:running",
)  # fmt: skip
SYSTEM, FREQUENCY, LAG = "platform_single_axis", 10.0, 8.0  # Hz, degrees
MARGIN, SEARCHED = 55.0, (3.0, 20.0)  # degrees; Hz
NOISE, STEP = 3e-4, 5e-4  # A/sqrt(Hz), s
CORRELATION = 5.0  # s, of the rate in the autoregressive filter: long against a period of the crossover


def response(F: Array, K: Array, f: float, step: float) -> complex:
    """Return estimate over reading of x = (I - K H) F x + K z, H = [1 0 ...], at f Hz."""
    H = np.eye(1, F.shape[0])
    back = (np.eye(F.shape[0]) - K @ H) @ F * cmath.exp(-2j * math.pi * f * step)
    return complex((H @ np.linalg.solve(np.eye(F.shape[0]) - back, K))[0, 0])


def kalman_gain(F: Array, Q: Array, R: float) -> Array:
    """Return the gain of the steady state, from the Riccati equation of the predicted covariance."""
    H = np.eye(1, F.shape[0])
    P = linalg.solve_discrete_are(F.T, H.T, Q, np.array([[R]]))
    return np.asarray(P @ H.T / (P[0, 0] + R))


def rate_response(q: float, R: float, f: float, step: float) -> complex:
    """Return that of estimator_kalman_rate, also with a gate or aided, and of estimator_sage_husa whose R is right."""
    T = step
    F = np.array([[1.0, T], [0.0, 1.0]])
    return response(F, kalman_gain(F, q * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]]), R), f, T)


def autoregressive_response(Q: float, R: float, f: float, step: float) -> complex:
    """Return that of estimator_kalman_ar of order 1 with a correlation time of CORRELATION."""
    F = np.array([[math.exp(-step / CORRELATION)]])
    return response(F, kalman_gain(F, np.array([[Q]]), R), f, step)


def tracking_gains(theta: float) -> tuple[float, float, float]:
    """Return alpha, beta, gamma with three poles at theta."""
    return 1.0 - theta**3, 1.5 * (1.0 - theta) ** 2 * (1.0 + theta), 2.0 * (1.0 - theta) ** 3


def tracking_response(theta: float, f: float, step: float) -> complex:
    """Return that of estimator_alpha_beta_gamma."""
    T, (alpha, beta, gamma) = step, tracking_gains(theta)
    F = np.array([[1.0, T, 0.5 * T * T], [0.0, 1.0, T], [0.0, 0.0, 1.0]])
    return response(F, np.array([[alpha], [beta / T], [0.5 * gamma / T**2]]), f, T)


def tuned(name: str, f: float, lag: float, step: float, variance: float) -> dict[str, float]:
    """Return the parameters of an estimator that lags by ``lag`` degrees at f Hz, or as near as its steps allow.

    name: of its part; "estimator_wavelet:sym4" is that of another wavelet, "estimator_wavelet:running" the one whose
    thresholds follow the noise.  step: its sampling period, s.  variance: of a reading.  {} without a parameter.
    """

    def solved(of: Callable[[float], complex], low: float, high: float) -> float:
        return float(optimize.brentq(lambda x: math.degrees(cmath.phase(of(x))) + lag, low, high, xtol=1e-9))

    delay = lag / (360.0 * f) / step  # in readings
    follows = [math.log((2.0 * math.pi * f * x) ** 4 * variance * step) for x in (1.0, 30.0)]  # natural frequencies
    if name in ("estimator_kalman_rate", "estimator_kalman_robust", "estimator_sage_husa", "estimator_aided"):
        return {"q": math.exp(solved(lambda x: rate_response(math.exp(x), variance, f, step), *follows))}
    if name == "estimator_alpha_beta_gamma":
        theta = solved(lambda x: tracking_response(x, f, step), 0.5, 1.0 - 2.0 * math.pi * f * step)
        return dict(zip(("alpha", "beta", "gamma"), tracking_gains(theta), strict=True))
    if name == "estimator_kalman_ar":
        logs = [math.log(variance * (2.0 * math.pi * f * step * x) ** 2) for x in (1.0, 30.0)]
        Q = math.exp(solved(lambda x: autoregressive_response(math.exp(x), variance, f, step), *logs))
        return {"p": 1, "phi[1]": math.exp(-step / CORRELATION), "phi[2]": 0.0, "phi[3]": 0.0, "Q": Q}
    if name == "estimator_moving_average":
        return {"N": max(1, round(1.0 + 2.0 * delay))}
    part, _, kind = name.partition(":")
    if part == "estimator_wavelet":  # Haar, if nothing is said
        running = kind == "running"
        number = 1 if running or not kind else wavelet_bank.NAMES.index(kind) + 1
        late = 0.5 * (wavelet_bank.taps(number) + wavelet_bank.short_taps(number)) - 1.0  # readings, of one level
        levels = range(1, 6 if kind == "coif4" else 7)
        J = min(levels, key=lambda J: abs(late * (2.0**J - 1.0) - delay))
        return {"wavelet": number, "J": J, "running": running}
    return {}


def experiment(part: str, crossover: float, hold: str) -> gb.Experiment:
    """Return the test of an estimator at this crossover, Hz."""
    parts = {"estimator": part.partition(":")[0]}
    test = gb.load(SYSTEM, parts=parts, contest=True, reading_noise=NOISE, hold=hold, crossover=crossover)
    for name, value in tuned(part, FREQUENCY, LAG, STEP, NOISE**2 / STEP).items():
        test.set(f"estimator.{name}", value)
    return test


def at_margin(part: str) -> float:
    """Return the crossover to ask for (Hz) at which the measured phase margin is MARGIN; it falls with the crossover.

    A loop without a crossover that can be measured is taken for unstable.
    """

    def beyond(crossover: float) -> float:
        margin = experiment(part, crossover, "10s").run(1, check_step=False).result["PM"].estimate
        return margin - MARGIN if math.isfinite(margin) else -MARGIN

    return float(optimize.brentq(beyond, *SEARCHED, xtol=0.03))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder of the runs and of the comparison")
    parser.add_argument("--seeds", type=int, default=8, help="runs of each estimator")
    parser.add_argument("--hold", default="40s", help="length of each ride")
    parser.add_argument(
        "--estimators", nargs="+", default=[f"estimator_{n}" for n in NAMES], help="names, as in tuned()"
    )
    arguments: Any = parser.parse_args()
    runs, names = [], []
    for part in arguments.estimators:
        crossover = at_margin(part)
        test = experiment(part, crossover, arguments.hold)
        for seed in range(1, arguments.seeds + 1):
            folder = arguments.out / part.replace(":", "_") / str(seed)
            runs.append(test.run(seed, check_step=False, out=folder, force=True))
            names.append(f"{part}/{seed}")
        print(f"{part}: crossover {crossover:.2f} Hz, {arguments.seeds} runs in {arguments.out / part}", flush=True)
    comparison = gb.compare(*runs, names=names)
    print("\n".join(comparison.document["summary"]), "", *comparison.write(arguments.out).values(), sep="\n")


if __name__ == "__main__":
    main()
