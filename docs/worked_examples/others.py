"""Xia 2008, Dong 2014 and GSP ch. 5."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from example import Example, room

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.reduction.series import normality, orders, stationarity
from gyrobench.units import ARCMIN, DEG

#: Table 3.4.2 and 3.4.4: coefficients as printed, variance, SBC, FPE
MODELS: dict[int, tuple[tuple[float, ...], str, str, str]] = {
    1: ((0.4947,), "4.0617e-6", "-2.1298e5", "4.0623e-6"),
    2: ((0.6612, 0.3366), "3.6016e-6", "-2.1502e5", "3.6025e-6"),
    3: ((0.7466, 0.5044, 0.2538), "3.3697e-6", "-2.1615e5", "3.3710e-6"),
    4: ((0.7956, 0.6017, 0.3979, 0.1930), "3.2440e-6", "-2.1679e5", "3.2459e-6"),
    5: ((0.8268, 0.6661, 0.4953, 0.3217, 0.1617), "3.1592e-6", "-2.1724e5", "3.1615e-6"),
    6: ((0.8493, 0.7108, 0.5641, 0.4142, 0.2766, 0.1390), "3.0982e-6", "-2.1756e5", "3.1007e-6"),
}
RIGHT = {1: "4.0627e-6", 2: "3.6029e-6", 3: "3.3712e-6"}  # FPE (EX31)
LENGTH = 17157  # values behind the tables (EX6)
#: Table 1: K_F, K_IO, K_II of four sensors, first harmonic unknown and known; K_I
UNKNOWN = ((-8.142e-4, -3.093e-5, -1.552e-5), (-4.131e-3, 2.774e-5, 1.325e-5), (-9.397e-4, -1.661e-5, 2.682e-5),
           (-1.3e-3, -2.877e-5, 4.92e-6))  # fmt: skip
KNOWN = (("-8.336e-4", "-2.849e-5", "3.91e-6"), ("-4.133e-3", "7.93e-6", "1.573e-5"), ("-9.20e-4", "-1.905e-5",
         "7.41e-6"), ("-1.2999e-3", "-9.327e-6", "2.48e-6"))  # fmt: skip
SCALE = (1.2993698, 1.3245304, 1.297999, 1.29999)


def symbols(n1: int, n2: int, runs: int) -> Array:
    """Return a sequence of n1 true and n2 false values in so many runs."""
    out: list[bool] = []
    left = {True: n1, False: n2}
    for k in range(runs):
        kind = k % 2 == 0
        rest = sum(1 for j in range(k + 1, runs) if (j % 2 == 0) == kind)
        take = left[kind] - rest if rest == 0 else 1
        out += [kind] * take
        left[kind] -= take
    return np.array(out)


def statistics_of_drift() -> list[Example]:
    """Runs, trend and normality of a day of drift."""
    rows = []
    for n1, n, runs, printed, what in (
        (97, 200, 69, "4.5282", "means"), (89, 200, 33, "9.5859", "variances"),
        (45, 100, 53, "0.50767", "means, residuals"), (42, 100, 44, "1.1803", "variances, residuals"),
    ):  # fmt: skip
        z = abs(stationarity.runs_test(symbols(n1, n - n1, runs)).z)
        rows.append(Example("3.1.2.1, 3.4.3", f"U of {runs} runs of {n} {what}, {n1} above", printed, "1",
                            "`stationarity.runs_test`", z))  # fmt: skip
    signs = np.where(symbols(100, 99, 118), 1.0, -1.0)
    y = np.concatenate([[0.0], np.cumsum(signs * (1.0 + 1e-3 * np.arange(199)))])
    error, block = normality.standard_errors(LENGTH)[0], normality.standard_errors(200)[1]
    rows += [
        Example("3.1.2.2", "u of 118 runs up and down of 200 means", "-2.3141", "1", "`stationarity.up_down_runs`",
                stationarity.up_down_runs(y).z, "EX8", "-2.527"),
        Example("3.1.1", "values of 24 h at 5 s", "27500", "1", "`units.convert`",
                units.convert(1.0, "day", "s") / 5.0, "EX6", "17280"),
        Example("Table 3.4.1", "standard error of the skewness", "0.018699", "1", "`normality.standard_errors`", error),
        Example("Table 3.4.1", "0.0082 over it", "0.43853", "1", "`normality.standard_errors`", 0.0082 / error),
        Example("Table 3.4.1", "standard error of the kurtosis, n = 200", "0.3422", "1", "`normality.standard_errors`",
                block),
        Example("Table 3.4.1", "0.14473 over that of the mean of 85 blocks", "0.42293", "1",
                "`normality.standard_errors`", 0.14473 / (block / math.sqrt(85.0)), "EX12", "3.9"),
    ]  # fmt: skip
    return rows


def models() -> list[Example]:
    """Autoregressions of the drift: Levinson's recursion, variances, criteria."""
    rows = []
    for (_, (before, variance, _, _)), (p, (now, next_, _, _)) in pairwise(MODELS.items()):
        last, old = now[-1], float(variance) if p != 4 else 3.3696e-6
        odd = "EX30" if p == 4 else ""
        rows += [
            Example("Table 3.4.2", f"first coefficient of AR({p}) from AR({p - 1})", f"{now[0]:.4f}", "1",
                    "Levinson's recursion, a = −φ", before[0] + last * before[-1], "EX14", within=1e-4),
            Example("Table 3.4.2", f"variance of AR({p}) from that of AR({p - 1})", next_, "1", "Levinson's recursion",
                    old * (1.0 - last**2), odd, within=5e-11 + old * last * 1e-4),
        ]  # fmt: skip
    for p, (_, variance, sbc, fpe) in MODELS.items():
        _, found, final = orders.criteria(float(variance), LENGTH, p)
        other = "−2.1298e5 with n = 17158, which does not give the others" if p == 1 else ""
        right = RIGHT.get(p, "")
        rows += [
            Example("Table 3.4.4", f"SBC of AR({p})", sbc, "1", f"`orders.criteria`, n = {LENGTH}", found, why=other,
                    within=LENGTH * 5e-11 / float(variance)),
            Example("Table 3.4.4", f"FPE of AR({p})", fpe, "1", f"`orders.criteria`, n = {LENGTH}", final,
                    "EX31" if right else "", right, within=5e-11),
        ]  # fmt: skip
    series = np.diff(np.random.default_rng(53).normal(size=LENGTH + 1))  # what the tables are those of (EX17)
    gone = "the record is not printed"
    rows += [
        Example("Table 3.4.3", "LB(6) of the differences", "44.91", "1", "`orders.ljung_box`, made record",
                round(orders.ljung_box(series, 6).q, -2), why="r_1 = −0.4947 alone makes 4200 (EX15)"),
        Example("4.2.2", "noise taken away by the filter", "10", "dB", "`estimator_kalman_ar`", math.nan,
                why="8.2 dB at rest, 3.0 dB at the highest frequency; by neither sign (EX19)"),
        Example("Table 4.3.2", "standard deviations by wavelet and level", "44 numbers", "–", "`estimator_wavelet`",
                math.nan, why=f"{gone}; σ 2^(−J/2) for every wavelet (EX29)"),
        Example("4.3.3", "thresholds by level", "11 numbers", "–", "`estimator_wavelet`", math.nan, why=gone),
        Example("4.4.1", "step of 14 bits over ±5 V", "≈0.6", "mV", "arithmetic", 10.0 / 2**14 * 1e3),
    ]  # fmt: skip
    return rows


def accelerometers() -> list[Example]:
    """Table 1 from its columns without the first harmonic of the head; standard deviations of Table 2."""
    geometry, chain = (room("accelerometer_four", m) for m in ("geometry", "chain"))
    alpha = 2.0 * np.pi * np.arange(24) / 24.0
    first = np.column_stack([np.cos(alpha), np.sin(alpha)]) @ np.array([1.5e-5, -1.9e-6])
    rows = [Example("2.2", "1e-4 rad", "20.63", "″", "`units.convert`", units.convert(1e-4, "rad", "arcsec"))]
    for sensor, (off, on, K_I) in enumerate(zip(UNKNOWN, KNOWN, SCALE, strict=True), 1):
        tangent = K_I * geometry.axes(sensor, alpha)[1]
        shift = np.linalg.lstsq(chain.design(sensor, alpha, 1.0), tangent * first, rcond=None)[0]
        for name, before, printed, d in zip(("K_F", "K_IO", "K_II"), off, on, shift[[0, 3, 4]], strict=True):
            found = before - float(d)
            why = "printed with too few digits (EA8)" if (sensor, name) == (4, "K_F") else ""
            rows.append(Example("Table 1", f"{name} of sensor {sensor}, B_w to B_z", printed, "V",
                                "`accelerometer_four`, `chain.design`", found, "" if why else "EA8", why=why,
                                within=K_I * 5e-8))  # fmt: skip
    X = chain.design(1, alpha, 1.0)
    factor = np.sqrt(np.diag(np.linalg.inv(X.T @ X)))
    table = (("K_F", "9.9e-5"), ("K_I", "8.1e-6"), ("K_O", "8.1e-6"), ("K_IO", "1.6e-5"), ("K_II", "1.6e-5"))
    for (name, printed), share in zip(table, factor, strict=True):
        odd = ("EA10", "9.9e-6") if name == "K_F" else ()
        rows.append(Example("Table 2", f"σ of {name} of sensor 1, U = 2.8e-5", printed, "V",
                            "`accelerometer_four`, `chain.design`", 2.8e-5 * float(share), *odd))  # fmt: skip
    return rows


def stabilizers() -> list[Example]:
    """Transient and nutation of a power gyro; the satellite."""
    power, closed = room("stabilizer_power_2dof", "reduction"), room("stabilizer_sdf", "closed")
    by = "`stabilizer_power_2dof`"
    held = closed.StabilizedAxis(J0=1e6, J=10.0, H=1e4, C=62.5, K=0.0, M=10.0)
    sprung = closed.StabilizedAxis(J0=1e6, J=10.0, H=1e4, C=62.5, K=100.0, M=10.0)
    end = np.array([0.0, 100.0])
    return [
        Example("5.1.2, 5-13", "time of the transient, H = 10, K = 0.1", "0.31", "s", by, power.transient(10.0, 0.1),
                "EG1", "314"),
        Example("5.1.2, 5-13", "time of the transient, H = 10, K_m = 100", "0.31", "s", by,
                power.transient(10.0, 100.0)),
        Example("5.1.2, 5-12", "what is left then", "0.043", "1", by,
                1.0 - float(power.lean(power.transient(10.0, 100.0), 1.0, 100.0, 10.0)) * 100.0, "EG2"),
        Example("5.1.2, 5-17", "nutation over the spin rate, J_x = J_y = 1.5 J", "0.66", "1", by,
                power.nutation(1.0, 1.5, 1.5, 0.0, 0.0) * 2.0 * math.pi),
        Example("5.1.4, example", "error of the rate-integrating gyro after 100 s", "≈6", "′", "`stabilizer_sdf`",
                closed.line(held)[1] * 100.0 / ARCMIN, "EG11", "2.15"),
        Example("5.1.4, example", "error of the rate gyro after 100 s", "1.5", "°", "`stabilizer_sdf`",
                10.0 * 100.0**2 / (2.0 * sprung.inertia) / DEG, "EG13", "1.43"),
        Example("5.1.4, example", "the same, with the transient", "1.5", "°", "`stabilizer_sdf`",
                float(closed.rate(sprung, end)[0][-1]) / DEG, "EG13", "1.44"),
        Example("5.1.4, example", "i_g = H cos β/C", "1.6e2", "1", "`stabilizer_sdf`", held.H / held.C),
    ]  # fmt: skip
