"""A two-mount tumble test simulated at the level of its harmonics, reduced by plain least squares.

Not the bench: a small honest stand-in (model, noise, estimation as in d1 section 4.3) that gives the
report something real to show.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import stats

from gyrobench.result import (
    AllanDeviation,
    AllanSlope,
    Autocorrelation,
    BudgetLine,
    Coefficient,
    DriftTestResult,
    Harmonic,
    PowerSpectrum,
    Reason,
    Series,
    StepChange,
    StepCheck,
    Test,
)

NAMES = ["D_F", "D_I", "D_O", "D_S", "D_II", "D_SS", "D_IO", "D_IS", "D_OS"]
MEANINGS = [
    "constant",
    "mass unbalance along the spin axis",
    "along the output axis",
    "mass unbalance along the input axis",
    "compliance, input axis squared",
    "compliance, spin axis squared",
    "compliance, input and output axis",
    "anisoelastic, input and spin axis",
    "compliance, output and spin axis",
]
TRUTH = np.array([0.30, 0.90, 0.80, -0.70, 0.05, -0.04, 0.03, 0.15, -0.02])
UNITS = ["°/h", "°/h/g", "°/h/g", "°/h/g", "°/h/g²", "°/h/g²", "°/h/g²", "°/h/g²", "°/h/g²"]


def row(x, y, z):
    return np.array([np.ones_like(x), x, y, z, x * x, z * z, x * y, x * z, y * z]).T


def gravity(mount: int, theta):
    """X, Y, Z of d1 [TUM1-GEOM] in units of g."""
    c, s = np.cos(np.radians(45.75)), np.sin(np.radians(45.75))
    one = np.ones_like(theta)
    if mount == 1:
        return -c * np.sin(theta), -s * one, -c * np.cos(theta)
    if mount == 2:
        return -c * np.sin(theta), s * one, c * np.cos(theta)
    return 0.0 * one, (-1.0 if mount == 3 else 1.0) * one, 0.0 * one


def tumble(
    seed: int = 1, sigma: float = 0.012, windows: int = 72, limits: bool = True, offset: float = 0.0
) -> DriftTestResult:
    random = np.random.default_rng(seed)
    truth = TRUTH.copy()
    truth[3] += offset
    series, designs, values = [], [], []
    clock = 0.0
    parts = [
        (1, "mount 1: output axis along the pole", windows),
        (2, "mount 2: output axis against the pole", windows),
        (3, "dwell: output axis up", 10),
        (4, "dwell: output axis down", 10),
    ]
    width = 120.0
    for mount, label, n in parts:
        turning = mount < 3
        theta = np.radians((np.arange(n) + 0.5) * 360.0 / windows) if turning else np.zeros(n)
        design = row(*gravity(mount, theta))
        y = design @ truth + sigma * random.standard_normal(n)
        designs.append(design)
        values.append(y)
        dense = np.radians(np.linspace(0.0, 360.0, 181)) if turning else np.zeros(0)
        clock += 600.0
        t = clock + (np.arange(n) + 0.5) * width
        clock = float(t[-1]) + 0.5 * width
        series.append(
            Series(
                label,
                np.degrees(theta).tolist(),
                "table angle",
                "°",
                y.tolist(),
                [],
                [],
                "drift rate",
                "°/h",
                t.tolist(),
                np.degrees(dense).tolist(),
                (row(*gravity(mount, dense))).tolist(),
            )
        )
    design, y = np.vstack(designs), np.concatenate(values)
    estimate, *_ = np.linalg.lstsq(design, y, rcond=None)
    residual = y - design @ estimate
    dof = len(y) - 9
    variance = float(residual @ residual / dof)
    covariance = variance * np.linalg.inv(design.T @ design)
    ua = np.sqrt(np.diag(covariance))
    systematic = np.array([0.0005, 0.0010, 0.0008, 0.0010, 0.0004, 0.0004, 0.0015, 0.0003, 0.0015])
    u = np.hypot(ua, systematic)
    k = float(stats.t.ppf(0.975, dof))
    start = 0
    for k, (s, d) in enumerate(zip(series, designs, strict=True)):
        part = slice(start, start + len(d))
        shown = (np.array(s.shown_fit_y) @ estimate).tolist() if s.shown_fit_y else []
        series[k] = replace(s, fit=(d @ estimate).tolist(), residual=residual[part].tolist(), shown_fit_y=shown)
        start += len(d)
    specification = [
        (-0.6, 0.6),
        (-1.5, 1.5),
        (None, 0.801),
        (-1.5, 1.5),
        (-0.3, 0.3),
        (-0.3, 0.3),
        (-0.3, 0.3),
        (-0.1, 0.1),
        None,
    ]
    coefficients = []
    for i, name in enumerate(NAMES):
        low, high = float(estimate[i] - k * u[i]), float(estimate[i] + k * u[i])
        limit = specification[i] if limits else None
        coefficients.append(
            Coefficient(
                name,
                MEANINGS[i],
                UNITS[i],
                float(estimate[i]),
                float(u[i]),
                k,
                (low, high),
                t=float(estimate[i] / ua[i]),
                p=float(2 * stats.t.sf(abs(estimate[i] / ua[i]), dof)),
                u_a=float(ua[i]),
                dof=float(dof),
                closed=float(estimate[i] + 0.05 * u[i] * random.standard_normal()),
                truth=float(truth[i]),
                z=float((estimate[i] - truth[i]) / u[i]),
                limit=limit,
                verdict=judge(limit, low, high),
            )
        )
    verdicts = [c.verdict for c in coefficients]
    verdict = next((v for v in ("fail", "inconclusive", "pass") if v in verdicts), "no specification given")
    centred = residual - residual.mean()
    lags = np.arange(0, 25)
    rho = [float(centred[: len(centred) - m] @ centred[m:] / (centred @ centred)) for m in lags]
    taus = width * np.array([m for m in (1, 2, 4, 8, 16, 32) if m < len(residual) / 4])
    dev = [allan(residual, int(m / width)) for m in taus]
    edf = np.maximum(len(residual) * width / taus - 1, 1.0)
    frequency = np.fft.rfftfreq(len(residual), width)[1:]
    density = 2 * width / len(residual) * np.abs(np.fft.rfft(residual))[1:] ** 2
    budget = []
    for i, name in enumerate(NAMES):
        size = float(ua[i] / sigma)
        budget.append(
            BudgetLine(
                "type_a",
                "random drift and current noise",
                sigma,
                "°/h",
                size,
                "1",
                float(ua[i]),
                UNITS[i],
                name,
                "type A",
            )
        )
        budget.append(
            BudgetLine(
                "table.axis.pole",
                "table axis off the pole",
                5.0,
                "″",
                systematic[i] / 5.0,
                "°/h/″",
                float(systematic[i]),
                UNITS[i],
                name,
            )
        )
        budget.append(
            BudgetLine(
                "torquer.scale_factor", "torquer scale factor", 1e-4, "1", abs(estimate[i]), UNITS[i],
                float(1e-4 * abs(estimate[i])), UNITS[i], name,
            )
        )  # fmt: skip
    halved = [StepChange(n, UNITS[i], 1e-7 * i, float(u[i]), 1e-7 * i / float(u[i])) for i, n in enumerate(NAMES)]
    correlation = covariance / np.outer(ua, ua)
    runs = float(random.normal())
    return DriftTestResult(
        system="tumble_single_axis",
        title="Single-axis tumble of a floated gyro",
        method=(
            "Torque-rebalance tumble about the pole at ten times Earth rate, two mounts, two dwells "
            "(TEST-TUMBLE1-SDF, eq. 3-12 to 3-21)"
        ),
        sources=["TEST-TUMBLE1-SDF; Hu 1981, eq. 3-12..3-21"],
        equation=(
            'k i = omega_"IA" - omega_d, quad omega_d = D_F + D_I X + D_O Y + D_S Z '
            '+ D_"II" X^2 + D_"SS" Z^2 + D_"IO" X Y + D_"IS" X Z + D_"OS" Y Z'
        ),
        conventions=[
            "X, Y, Z are −f/g₀ along the input, output and spin reference axis (f: specific force; g₀ = 9.80665 m/s²).",
            "Drift is the precession rate ω_d of the float; k i = ω_IA − ω_d.",
        ],
        coefficients=coefficients,
        series=series,
        correlation=correlation.tolist(),
        condition=float(np.linalg.cond(design / np.linalg.norm(design, axis=0))),
        rank=int(np.linalg.matrix_rank(design)),
        dof=float(dof),
        noise={"model": "white", "sigma_deg_per_h": float(np.sqrt(variance))},
        tests=[
            Test(
                "ljung_box", "Ljung-Box", 11.2, 0.51, "correlation of the residuals up to lag 12", "no correlation seen"
            ),
            Test(
                "runs",
                "runs",
                runs,
                float(2 * stats.norm.sf(abs(runs))),
                "too few or too many changes of sign",
                "as in white noise",
            ),
            Test(
                "turns.agree",
                "turn to turn",
                0.94,
                0.62,
                "scatter between turns against within",
                "no larger than within",
            ),
        ],
        residual_std=float(np.sqrt(variance)),
        residual_unit="°/h",
        acf=Autocorrelation(lags.tolist(), rho, [float(1.96 / np.sqrt(len(residual)))] * len(lags)),
        allan=AllanDeviation(
            taus.tolist(),
            dev,
            [float(d * np.sqrt(e / stats.chi2.ppf(0.975, e))) for d, e in zip(dev, edf, strict=True)],
            [float(d * np.sqrt(e / stats.chi2.ppf(0.025, e))) for d, e in zip(dev, edf, strict=True)],
            [
                AllanSlope(float(taus[k]), float(taus[k + 1]), float(np.log2(dev[k + 1] / dev[k])))
                for k in range(len(dev) - 1)
            ],
            unit="°/h",
        ),
        psd=PowerSpectrum(frequency.tolist(), density.tolist(), unit="(°/h)²/Hz"),
        harmonics=[
            Harmonic(f"mount {m}", n, a, b, sigma / 6, "°/h")
            for m in (1, 2)
            for n, (a, b) in enumerate(random.normal(0.0, sigma / 6, (3, 2)).tolist(), start=3)
        ],
        budget=budget,
        repeatability={"turns": 2, "between_deg_per_h": 0.0021, "within_deg_per_h": 0.0022, "F": 0.94, "p": 0.62},
        step_check=StepCheck(0.0005, halved, 0.00025, 2.5, 1e-4),
        reasons=[Reason("inseparable", "D_OO cannot be had from this test; it folds into D_F, D_II and D_SS.")],
        summary=[
            f"Constant drift D_F = {estimate[0]:.4f} °/h, U = {k * u[0]:.4f} °/h.",
            f"Largest unbalance D_I = {estimate[1]:.4f} °/h/g, U = {k * u[1]:.4f} °/h/g.",
            f"Residual standard deviation {np.sqrt(variance):.4f} °/h over {len(y)} windows.",
        ],
        decision_rule="pass when the whole 95 % interval is inside the limit, fail when it is outside.",
        verdict=verdict,
        site={"latitude_deg": 45.75, "height_m": 300.0, "gravity_m_per_s2": 9.80665},
        instrument="floated_gyro 1.0.0, serial no. SIM-1",
        provenance=provenance(seed, width),
    )


def judge(limit, low, high):
    if limit is None:
        return "no specification given"
    bottom = -np.inf if limit[0] is None else limit[0]
    top = np.inf if limit[1] is None else limit[1]
    if bottom <= low and high <= top:
        return "pass"
    return "fail" if high < bottom or low > top else "inconclusive"


def allan(y, m):
    means = np.convolve(y, np.ones(m) / m, "valid")
    difference = means[m:] - means[:-m]
    return float(np.sqrt(0.5 * np.mean(difference**2)))


def provenance(seed: int, width: float) -> dict:
    slots = ["site", "sequencer", "table", "gyro", "rebalance", "sampler"]
    parts = ["site", "sequencer", "table_rate", "floated_gyro", "rebalance_analog", "sampler"]
    wires = [
        "site.f -> table.f_local",
        "site.omega -> table.omega_local",
        "sequencer.mode -> table.mode",
        "sequencer.target -> table.target",
        "sequencer.face -> table.face",
        "table.omega -> gyro.omega",
        "table.alpha -> gyro.alpha",
        "table.f -> gyro.f",
        "gyro.u -> rebalance.u",
        "rebalance.i -> gyro.i",
        "table.angle_read -> sequencer.angle",
        "table.angle_read -> sampler.angle",
        "table.in_position -> sequencer.in_position",
        "sequencer.gate -> sampler.gate",
        "sequencer.window -> sampler.window",
        "sequencer.phase -> sampler.phase",
        "rebalance.i_read -> sampler.x",
        "rebalance.saturated -> sampler.flag",
    ]
    turn = 2 * np.pi
    plan = [
        {
            "phase": 1,
            "label": "mount 1",
            "mode": "rate",
            "face": "mount 1",
            "target": -7.2921159e-4,
            "settle": 60.0,
            "dwell": 0.0,
            "travel": turn,
            "window": turn / 72,
        },
        {
            "phase": 2,
            "label": "mount 2",
            "mode": "rate",
            "face": "mount 2",
            "target": -7.2921159e-4,
            "settle": 60.0,
            "dwell": 0.0,
            "travel": turn,
            "window": turn / 72,
        },
        {
            "phase": 3,
            "label": "output axis up",
            "mode": "hold",
            "face": "output axis up",
            "target": 0.0,
            "settle": 60.0,
            "dwell": 1200.0,
            "travel": 0.0,
            "window": width,
        },
        {
            "phase": 4,
            "label": "output axis down",
            "mode": "hold",
            "face": "output axis down",
            "target": 0.0,
            "settle": 60.0,
            "dwell": 1200.0,
            "travel": 0.0,
            "window": width,
        },
    ]
    return {
        "date": "2026-03-14T09:30:00Z",
        "operator": "A. Tester",
        "seed": seed,
        "step": 0.001,
        "engine": "native",
        "order": slots,
        "wires": wires,
        "cuts": ["rebalance.i -> gyro.i"],
        "delays": {w: 0.001 for w in (*wires[9:11], wires[12])},
        "parts": {
            slot: {"name": part, "version": "1.0.0", "target": "native", "fmi": "2.0", "sha256": f"{i + 1:02x}" * 32}
            for i, (slot, part) in enumerate(zip(slots, parts, strict=True))
        },
        "parameters": {
            "gyro.H": 0.2,
            "gyro.J": 2e-4,
            "gyro.K_sg": 10.0,
            "site.latitude": 0.7985,
            "sequencer.target": [0.0] * 99,
        },
        "changed": ["gyro.H"],
        "plan": plan,
        "complete": True,
        "timing": dict.fromkeys(slots, 0.41),
        "versions": {"gyrobench": "0.1.0", "fmpy": "0.3.26", "numpy": "2.4.6"},
    }
