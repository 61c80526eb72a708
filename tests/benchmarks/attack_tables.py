"""As attack_models.py: tests in which a table turns, or a head of accelerometers; nothing of the bench is imported."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from attack_models import (
    ARCSEC,
    CHECKED,
    DPH,
    EIGHT,
    NINE,
    TWO,
    Array,
    Model,
    Rng,
    W,
    attitude,
    coefficients,
    drift,
    noise,
    place,
    pole,
    table,
)

EAST, NORTH, UP = np.eye(3)


def turned(axis: int, angle: float) -> Array:
    """Return the matrix of components in axes that are turned about their first or second one."""
    c, s = math.cos(angle), math.sin(angle)
    if axis == 0:
        return np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def held(rng: Rng, latitude: float, g: float, truth: dict[str, float], plan: list[tuple[str, Array, int, float]],
         size: float) -> list[list[float]]:  # fmt: skip
    """Return rows phase, t, t, angle, angle of a table that its gyro holds: d theta/dt = -w_E,x + w_d.  (5.0)

    plan: attitude, its axes at angle 0, windows and their length.  Each window has a drift of its own, rms ``size``;
    each reading an error of 0.1 arcsec.
    """
    edges, t = [], 0.0
    for _, _, n, length in plan:
        edges.append(t + length * np.arange(n + 1))
        t = edges[-1][-1] + 600.0
    every = noise(rng, np.concatenate([e[:-1] for e in edges]), np.concatenate([e[1:] for e in edges]), size)
    rows: list[list[float]] = []
    for phase, ((_, C0, n, length), at) in enumerate(zip(plan, edges, strict=True), 1):
        earth, angles = -W * float(C0[0] @ pole(latitude)), [0.0]
        for k in range(n):
            extra = earth + every[len(rows) + k]
            rate = partial(one_rate, C0=C0, g=g, truth=truth, extra=extra)
            x = angles[-1]
            for _ in range(2):
                x = rk4(rate, x, length / 2.0)
            angles.append(x)
        read = np.array(angles) + 0.1 * ARCSEC * rng.standard_normal(n + 1)
        rows += [[float(phase), at[k], at[k + 1], read[k], read[k + 1]] for k in range(n)]
    return rows


def one_rate(a: float, C0: Array, g: float, truth: dict[str, float], extra: float) -> float:
    return extra + drift(truth, EIGHT, -(turned(0, a) @ C0)[:, 2] * g)


def rk4(rate, x, h: float):  # type: ignore[no-untyped-def]
    """Return x after h of dx/dt = rate(x), Runge and Kutta."""
    a = rate(x)
    b = rate(x + 0.5 * h * a)
    c = rate(x + 0.5 * h * b)
    return x + h * (a + 2.0 * b + 2.0 * c + rate(x + h * c)) / 6.0


ANGLES = "phase,t_start [s],t_end [s],angle_start [rad],angle_end [rad]"


def servo_polar(rng: Rng) -> tuple[str, dict[str, float]]:
    """5.4: a day each with x against and along the pole, and two dwells with x east."""
    latitude, g, lines = place(rng)
    truth, p = coefficients(rng, EIGHT), pole(latitude)
    plan = [
        ("x east, y up", np.array([EAST, UP, np.cross(EAST, UP)]), 15, 120.0),
        ("x east, y down", np.array([EAST, -UP, np.cross(EAST, -UP)]), 15, 120.0),
        ("polar S", np.array([-p, -EAST, np.cross(-p, -EAST)]), 144, 600.0),
        ("polar N", np.array([p, -EAST, np.cross(p, -EAST)]), 144, 600.0),
    ]
    rows = held(rng, latitude, g, truth, plan, 0.004 * DPH)
    lines += ["# route = dwells", *(f"# phase {j} = {name}" for j, (name, *_) in enumerate(plan, 1))]
    return table(lines, ANGLES, rows), truth


def servo_vertical_level(rng: Rng) -> tuple[str, dict[str, float]]:
    """5.1, 5.2: x down and up, x level towards east and west with y or z up or down, each twice."""
    latitude, g, lines = place(rng)
    truth = coefficients(rng, EIGHT)
    plan = [("x down", np.array([-UP, EAST, np.cross(-UP, EAST)]), 15, 120.0),
            ("x up", np.array([UP, EAST, np.cross(UP, EAST)]), 15, 120.0)]  # fmt: skip
    for name, x in (("east", EAST), ("west", -EAST)):
        for sense, v in (("up", UP), ("down", -UP)):
            plan.append((f"x {name}, y {sense}", np.array([x, v, np.cross(x, v)]), 12, 120.0))
            plan.append((f"x {name}, z {sense}", np.array([x, np.cross(v, x), v]), 12, 120.0))
    plan = [*plan, *plan]
    rows = held(rng, latitude, g, truth, plan, 0.01 * DPH)
    lines += [f"# phase {j} = {name}" for j, (name, *_) in enumerate(plan, 1)]
    seen = ("D_F", "D_I", "D_S", "D_II", "D_SS")  # level and vertical attitudes have one of X, Y, Z alone
    return table(lines, ANGLES, rows), {n: truth[n] for n in seen}


def two_rates(a: Array, base: Array, earth: Array, g: float, truth: dict[str, float], extra: Array) -> Array:
    """Return the rates of outer and inner angle, solved from SERVO2-KIN."""
    (sx, cx), (sy, cy) = ((math.sin(v), math.cos(v)) for v in a)
    A = np.array([[cy, sx * sy, -cx * sy], [0.0, cx, sx], [sy, -cy * sx, cx * cy]])
    down = -(A @ base)[:, 2] * g
    wx, wy = (drift(truth, TWO[c], down) + e for c, e in zip("xy", extra, strict=True))
    outer = (wx - earth[0] * cy - earth[1] * sx * sy + earth[2] * cx * sy) / cy
    return np.array([outer, wy - earth[1] * cx - earth[2] * sx])


def servo_two_axis(rng: Rng) -> tuple[str, dict[str, float]]:
    """5.6: gyro axes A(theta_x, theta_y) base; a day each in mounts 2 (E, U) and 4 (N, U)."""
    latitude, g, lines = place(rng, 35.0, 55.0)
    truth = {n: v for c in "xy" for n, v in coefficients(rng, TWO[c]).items()}
    rows: list[list[float]] = []
    length, n = 600.0, 144
    for phase, X in enumerate((EAST, NORTH), 1):
        base = np.array([X, UP, np.cross(X, UP)])
        earth = W * base @ pole(latitude)
        start = (phase - 1) * (n * length + 900.0)
        t = start + length * np.arange(n + 1)
        extra = np.column_stack([noise(rng, t[:-1], t[1:], 0.004 * DPH) for _ in "xy"])
        angles = [np.zeros(2)]
        for k in range(n):
            rate = partial(two_rates, base=base, earth=earth, g=g, truth=truth, extra=extra[k])
            x = angles[-1]
            for _ in range(3):
                x = rk4(rate, x, length / 3.0)
            angles.append(x)
        read = np.array(angles) + 0.1 * ARCSEC * rng.standard_normal((n + 1, 2))
        rows += [
            [float(phase), t[k], t[k + 1], read[k, 0], read[k + 1, 0], read[k, 1], read[k + 1, 1]] for k in range(n)
        ]
    lines += ["# terms = 9", "# phase 1 = mount 2", "# phase 2 = mount 4"]
    head = "phase,t_start [s],t_end [s],outer_start [rad],outer_end [rad],inner_start [rad],inner_end [rad]"
    return table(lines, head, rows), truth


def open_loop_drift(rng: Rng) -> tuple[str, dict[str, float]]:
    """3, 4.0: the float sees H/C (w_x cos - w_z sin - w_d); a hand steps the case past the null between readings.

    The truth is the mean drift along the way, first to last reading.
    """
    latitude, g, lines = place(rng, 0.0, 80.0)
    C0, truth = attitude(rng), coefficients(rng, NINE)
    gain, slope = float(rng.uniform(0.8, 1.5)), float(rng.uniform(5.0, 15.0))
    n, dwell, every, h = 31, 2.0, 24.0, 0.5
    t0 = every * np.arange(n)
    extra = noise(rng, t0[:-1], t0[1:], 0.02 * DPH)
    a, b, rows, means = 0.0, 20.0 * ARCSEC * gain, [], []
    for k in range(n):
        read, total, count = [], 0.0, 0
        for j in range(round(every / h)):
            C = turned(0, a) @ C0
            earth, wd = W * C @ pole(latitude), drift(truth, NINE, -C[:, 2] * g)
            now = wd + (extra[min(k, n - 2)])
            b += gain * (earth[0] * math.cos(b) - earth[2] * math.sin(b) - now) * h
            if j < dwell / h:
                read.append(slope * b)
            if j == dwell / h:  # the hand steps the case, at once
                rows.append([t0[k], t0[k] + dwell, a + 0.1 * ARCSEC * rng.standard_normal(), float(np.mean(read))])
                ahead = (earth[0] - now) * (every - dwell)
                step = -b / gain - ahead + (-1.0) ** (k + 1) * 20.0 * ARCSEC
                a, b = a + step, b + gain * step
            total, count = total + wd, count + 1
        means.append(total / count)
    lines += [f"# attitude = {C0.tolist()}", f"# float_gain = {gain!r}"]
    return table(lines, "t_start [s],t_end [s],angle [rad],u [V]", rows), {"ω_d": float(np.mean(means[:-1])) / DPH}


# -------------------------------------------------------------------------------------------------- other instruments
def accelerometer_four(rng: Rng) -> tuple[str, dict[str, float]]:
    """D4 1, 2.1: U = K_F + K_I a_I + K_O a_O + K_IO a_I a_O + K_II a_I2 at b = alpha + D(alpha)."""
    g = float(rng.uniform(9.781, 9.831))
    unit = g / 9.80665
    sizes = {"K_F": 4e-3, "K_I": 0.0, "K_O": 2e-5, "K_IO": 3e-5, "K_II": 2e-5}
    K = [{k: v * rng.standard_normal() for k, v in sizes.items()} | {"K_I": rng.uniform(1.2, 1.4)} for _ in range(4)]
    waves = {k: 3.0 * ARCSEC * rng.standard_normal(2) for k in range(2, 12)} | {
        1: 10.0 * ARCSEC * rng.standard_normal(2)
    }
    rows: list[list[float]] = []
    for j in range(24):
        alpha = 2.0 * math.pi * j / 24.0
        b = alpha + sum(c * math.cos(k * alpha) + s * math.sin(k * alpha) for k, (c, s) in waves.items())
        volts = []
        for i, of in enumerate(K):
            aI, aO = math.sin(b + i * math.pi / 2.0) * unit, math.cos(b + i * math.pi / 2.0) * unit
            ideal = of["K_F"] + of["K_I"] * aI + of["K_O"] * aO + of["K_IO"] * aI * aO + of["K_II"] * aI * aI
            volts.append(ideal + 3e-6 * rng.standard_normal())
        rows.append([j + 1.0, 30.0 * j, 30.0 * j + 10.0, alpha, alpha, *volts])
    u = 0.1 * ARCSEC
    known = [float(waves[1][j] + u * rng.standard_normal()) for j in range(2)]
    lines = [f"# gravity = {g!r} m/s2", "# points = 24", "# arrangement = checked",
             *(f"# D1{n} = {v!r} rad" for n, v in zip("cs", known, strict=True)), f"# u_D1 = {u!r} rad"]  # fmt: skip
    head = "phase,t_start [s],t_end [s],angle_start [rad],angle_end [rad],mean [V],mean_2 [V],mean_3 [V],mean_4 [V]"
    return table(lines, head, rows), {f"{k},{i}": float(v) for i, of in enumerate(K, 1) for k, v in of.items()}


def table_rate_test(rng: Rng) -> tuple[str, dict[str, float]]:
    """The servo makes the counts follow a command whose clock is off; the scale errs once and twice a turn.

    The table moves about the command; its true angle is the count before rounding less the error of the scale there.
    A mean rate is that from the end of the first window to the end of the last, as the test says.
    """
    quantum, clock = 0.18 * ARCSEC, float(rng.uniform(-20.0, 20.0)) * 1e-6
    sizes = {1: 0.4 * ARCSEC, 2: 0.2 * ARCSEC}
    scale = {n: u / math.sqrt(2.0) * rng.standard_normal(2) for n, u in sizes.items()}
    jitter = float(rng.uniform(0.03, 0.3)) * ARCSEC
    rows: list[list[float]] = []
    truth, t, at, phase = {"time base": clock * 1e6}, 0.0, float(rng.uniform(0.0, 6.0)), 0
    for rate in (1.0, 15.04, 200.0, 1999.9):
        errors = []
        for sense in (1.0, -1.0):
            phase += 1
            w = sense * rate * W
            edges = at + (1.0 + clock) * w * 60.0 * np.arange(4)
            stands = edges + jitter * rng.standard_normal(4)
            counts = quantum * np.round(stands / quantum)
            e = [sum(c * math.cos(n * x) + s * math.sin(n * x) for n, (c, s) in scale.items()) for x in edges]
            errors.append(((stands[3] - e[3]) - (stands[1] - e[1])) / (120.0 * w) - 1.0)
            rows += [
                [phase, t + 60.0 * k, t + 60.0 * k + 60.0, w, counts[k], counts[k + 1], 0.0, jitter] for k in range(3)
            ]
            t, at = t + 300.0, edges[3]
        truth[f"error {rate:.6g} ERU"] = float(np.mean(errors)) * 1e6
    head = "phase,t_start [s],t_end [s],rate [rad/s],angle_start [rad],angle_end [rad],error [rad],error_std [rad]"
    lines = [f"# quantum = {quantum!r} rad", *(f"# u_angle{n} = {u!r} rad" for n, u in sizes.items()), "# u_cycle = 0"]
    return table([*lines, CHECKED[1]], head, rows), truth


MODELS: dict[str, Model] = {
    "servo_polar": servo_polar,
    "servo_vertical_level": servo_vertical_level,
    "servo_two_axis": servo_two_axis,
    "open_loop_drift": open_loop_drift,
    "accelerometer_four": accelerometer_four,
    "table_rate_test": table_rate_test,
}
