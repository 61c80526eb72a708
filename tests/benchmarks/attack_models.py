"""Measured records written from the equations of the specification alone: nothing of the bench is imported here.

    text, truth = MODELS["fixed_position"](rng)          # a file as a laboratory writes it; name -> true value

Every record has another instrument, latitude, gravity, plan and noise.  Drift in precession sign, X, Y, Z = -f/g0
along input, output and spin axis, current k i = rate - drift.  Earth, gyro and table are integrated in time where the
specification gives derivatives.  Sections of D1 and D4 are named with each model.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

W, G0 = 7.2921159e-5, 9.80665
DEG, ARCSEC = math.pi / 180.0, math.pi / 648000.0
DPH = ARCSEC  # 1 deg/h = 1 arcsec/s
Rng = np.random.Generator
Array = np.ndarray
Model = Callable[[Rng], tuple[str, dict[str, float]]]
NINE = {  # of one axis: powers of X, Y, Z
    "D_F": (0, 0, 0), "D_I": (1, 0, 0), "D_O": (0, 1, 0), "D_S": (0, 0, 1), "D_II": (2, 0, 0), "D_SS": (0, 0, 2),
    "D_IO": (1, 1, 0), "D_IS": (1, 0, 1), "D_OS": (0, 1, 1),
}  # fmt: skip
EIGHT = {n: p for n, p in NINE.items() if n != "D_O"}
CHANNELS = {c: ("0", "x", "y", "z", 2 * c, "zz", "xy", "xz", "yz") for c in "xy"}  # of two degrees of freedom
TWO = {
    c: {f"D{c}_{n}": (n.count("x"), n.count("y"), n.count("z")) for n in names} for c, names in CHANNELS.items()
}  # fmt: skip
SIZES = (0.5, 1.2, 0.1)  # deg/h per g^n


def coefficients(rng: Rng, terms: dict[str, tuple[int, int, int]]) -> dict[str, float]:
    """Return a random instrument, deg/h per g^n."""
    return {n: float(rng.uniform(-1.0, 1.0)) * SIZES[sum(p)] for n, p in terms.items()}


def drift(truth: dict[str, float], terms: dict[str, tuple[int, int, int]], down: Array) -> float:
    """Return the drift, rad/s; down: X, Y, Z."""
    x, y, z = (float(v) for v in down)
    return DPH * sum(truth[n] * x**a * y**b * z**c for n, (a, b, c) in terms.items())


def place(rng: Rng, low: float = 25.0, high: float = 65.0) -> tuple[float, float, list[str]]:
    """Return latitude, gravity over g0, and their lines; the record says nothing of type B."""
    latitude = float(rng.uniform(low, high) * rng.choice([-1.0, 1.0])) * DEG
    g = float(rng.uniform(9.781, 9.831))
    return latitude, g / G0, [f"# latitude = {latitude!r} rad", f"# gravity = {g!r} m/s2", *CHECKED]


CHECKED = ["# type_b = none", "# arrangement = checked"]


def pole(latitude: float) -> Array:
    return np.array([0.0, math.cos(latitude), math.sin(latitude)])


def noise(rng: Rng, t0: Array, t1: Array, size: float) -> Array:
    """Return means of a drift over windows: white, Gauss-Markov or both, each mean of rms size.

    Correlation time: half a window to 30 windows, no more than half the record; what is slower is a constant of it.
    """
    window = float(np.median(t1 - t0))
    h = window / 8.0
    t = np.arange(t0[0], t1[-1] + h, h)
    share = float(rng.choice([0.0, 1.0, rng.uniform(0.1, 0.9)]))
    longest = min(30.0 * window, 0.5 * float(t1[-1] - t0[0]))
    tau = 0.5 * window * (longest / (0.5 * window)) ** rng.uniform()
    keep = math.exp(-h / tau)
    x = np.empty(t.size)
    x[0] = rng.standard_normal()
    for k, kick in enumerate(math.sqrt(1.0 - keep * keep) * rng.standard_normal(t.size - 1), 1):
        x[k] = keep * x[k - 1] + kick
    r = window / tau
    x /= math.sqrt(2.0 * (r - 1.0 + math.exp(-r)) / (r * r))  # its mean over a window has variance 1
    total = np.concatenate([[0.0], np.cumsum(0.5 * (x[1:] + x[:-1]) * h)])
    slow = (np.interp(t1, t, total) - np.interp(t0, t, total)) / (t1 - t0)
    white = rng.standard_normal(t0.size) * np.sqrt(window / (t1 - t0))
    return np.asarray(size * (math.sqrt(share) * slow + math.sqrt(1.0 - share) * white))


def table(lines: list[str], head: str, rows: list[list[float]]) -> str:
    return "\n".join([*lines, head, *(",".join(repr(float(v)) for v in row) for row in rows), ""])


def attitude(rng: Rng) -> Array:
    """Return a random rotation, rows: axes of the gyro in east, north, up."""
    q, r = np.linalg.qr(rng.standard_normal((3, 3)))
    q = q * np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0.0 else -q


# ------------------------------------------------------------------------------------ torque rebalance (D1 sec. 4)
def fixed_position(rng: Rng) -> tuple[str, dict[str, float]]:
    """4.0: i = (w_IA - w_d)/k in one attitude."""
    latitude, g, lines = place(rng, 0.0, 80.0)
    C, k = attitude(rng), float(rng.uniform(15.0, 19.0)) * DPH * 1e3
    truth = coefficients(rng, NINE)
    rate, wd = float(C[0] @ pole(latitude)) * W, drift(truth, NINE, -C[:, 2] * g)
    n = int(rng.integers(20, 60))
    t0 = 70.0 * np.arange(n)
    i = (rate - wd - noise(rng, t0, t0 + 60.0, 0.01 * DPH)) / k
    lines += [f"# k = {k!r} rad/s/A", f"# attitude = {C.tolist()}"]
    rows = [[a, a + 60.0, v] for a, v in zip(t0, i, strict=True)]
    return table(lines, "t_start [s],t_end [s],mean [A]", rows), {"ω_d": wd / DPH}


def tumble_two_axis(rng: Rng) -> tuple[str, dict[str, float]]:
    """4.6: C = R_x(inner) R_y(outer) C0 with y along the pole and z west; the input axis sees no Earth rate."""
    latitude, g, lines = place(rng)
    k, truth = float(rng.uniform(15.0, 19.0)) * DPH * 1e3, coefficients(rng, NINE)
    p = pole(latitude)
    z = np.array([-1.0, 0.0, 0.0])
    C0 = np.array([np.cross(p, z), p, z])
    n, each = 36, 3
    rows, t, down = [], 0.0, []
    for place_ in range(n):
        b, a = 2.0 * math.pi * 5.0 * place_ / n, 2.0 * math.pi * place_ / n
        R_y = np.array([[math.cos(b), 0.0, -math.sin(b)], [0.0, 1.0, 0.0], [math.sin(b), 0.0, math.cos(b)]])
        R_x = np.array([[1.0, 0.0, 0.0], [0.0, math.cos(a), math.sin(a)], [0.0, -math.sin(a), math.cos(a)]])
        down.append(-(R_x @ R_y @ C0)[:, 2] * g)
        for _ in range(each):
            rows.append([place_ + 1.0, t, t + 60.0, b, b, a, a])
            t += 61.0
        t += 30.0
    t0, t1 = (np.array([row[j] for row in rows]) for j in (1, 2))
    e = noise(rng, t0, t1, 0.01 * DPH)
    for row, x in zip(rows, e, strict=True):
        row.append(-(drift(truth, NINE, down[int(row[0]) - 1]) + x) / k)
    lines += [f"# k = {k!r} rad/s/A", "# m = 5", "# n = 1"]
    head = "phase,t_start [s],t_end [s],outer_start [rad],outer_end [rad],inner_start [rad],inner_end [rad],mean [A]"
    return table(lines, head, rows), truth


def tumble_two_channel(rng: Rng) -> tuple[str, dict[str, float]]:
    """4.5: z along the axis, which is the pole, turned against the Earth at ten times its rate, and two dwells."""
    latitude, g, lines = place(rng)
    truth = {n: v for c in "xy" for n, v in coefficients(rng, TWO[c]).items()}
    k = {c: float(rng.uniform(15.0, 19.0)) * DPH * 1e3 for c in "xy"}
    p, east, up = pole(latitude), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    mounts = {
        "mount 1": np.array([-east, np.cross(p, -east), p]),
        "mount 2": np.array([-east, np.cross(-p, -east), -p]),
        "static 3": np.array([east, up, np.cross(east, up)]),
        "static 4": np.array([east, -up, np.cross(east, -up)]),
    }
    order = [str(x) for x in rng.permutation(list(mounts))]
    rows, t, seen = [], 0.0, []
    for phase, name in enumerate(order, 1):
        C0, turning = mounts[name], name.startswith("mount")
        n = 2 * 36 if turning else 20
        length = 2.0 * math.pi / 36.0 / (10.0 * W) if turning else 120.0
        angle = 0.0
        for _ in range(n):
            end = angle - 2.0 * math.pi / 36.0 if turning else 0.0
            some = []
            for a in np.linspace(angle, end, 9):  # Simpson over the window
                turned = C0 @ rotation(p, a).T if turning else C0
                down = -turned[:, 2] * g
                earth = W * turned @ p
                some.append([earth[j] - drift(truth, TWO[c], down) for j, c in enumerate("xy")])
            mean = np.array([1, 4, 2, 4, 2, 4, 2, 4, 1]) @ np.array(some) / 24.0
            rows.append([float(phase), t, t + length, angle, end])
            seen.append(mean)
            angle, t = end, t + length
        t += 60.0
    t0, t1 = (np.array([row[j] for row in rows]) for j in (1, 2))
    e = np.column_stack([noise(rng, t0, t1, 0.015 * DPH) for _ in "xy"])
    for row, (x, y) in zip(rows, np.array(seen) - e, strict=True):
        row += [y / k["x"], x / k["y"]]  # the torquer about x balances the drift about y
    lines += ["# model = nine", *(f"# k_{c} = {v!r} rad/s/A" for c, v in k.items())]
    lines += [f"# phase {j} = {name}" for j, name in enumerate(order, 1)]
    head = "phase,t_start [s],t_end [s],angle_start [rad],angle_end [rad],mean_x [A],mean_y [A]"
    return table(lines, head, rows), truth


def rotation(axis: Array, angle: float) -> Array:
    """Return the matrix that turns a vector about an axis (Rodrigues)."""
    K = np.array([[0.0, -axis[2], axis[1]], [axis[2], 0.0, -axis[0]], [-axis[1], axis[0], 0.0]])
    out: Array = np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * K @ K
    return out


def eight_position(rng: Rng) -> tuple[str, dict[str, float]]:
    """4.1, 4.2: k_x i_x = w_y - R_x + u_zx Y - u_y Z, k_y i_y = w_x + R_y - u_x Z + u_zy X in eight attitudes."""
    latitude, _, lines = place(rng)
    E, N, U = np.eye(3)
    axes = ((E, N), (N, -E), (-E, -N), (-N, E), (U, E), (-E, U), (-U, -E), (E, -U))
    k = {c: float(rng.uniform(15.0, 19.0)) * DPH * 1e3 for c in "xy"}
    truth = {n: float(rng.uniform(-1.0, 1.0)) for n in ("R_x", "R_y", "u_x", "u_y", "u_zx", "u_zy")}
    rows, t = [], 0.0
    for cycle in range(1, 9):
        for position, (x, y) in enumerate(axes, 1):
            C = np.array([x, y, np.cross(x, y)])
            (X, Y, Z), earth = -C[:, 2], W * C @ pole(latitude)
            about_x = earth[1] + DPH * (-truth["R_x"] + truth["u_zx"] * Y - truth["u_y"] * Z)
            about_y = earth[0] + DPH * (truth["R_y"] - truth["u_x"] * Z + truth["u_zy"] * X)
            rows.append([float(cycle), float(position), t, t + 60.0, about_x, about_y])
            t += 90.0
    t0, t1 = (np.array([row[j] for row in rows]) for j in (2, 3))
    for j, c in ((4, "x"), (5, "y")):
        for row, e in zip(rows, noise(rng, t0, t1, 0.01 * DPH), strict=True):
            row[j] = (row[j] - e) / k[c]
    head = "cycle,position,t_start [s],t_end [s],mean_x [A],mean_y [A]"
    return table(lines, head, rows), {**truth, **{f"k_{c}": v / DPH / 1e3 for c, v in k.items()}}


MODELS: dict[str, Model] = {
    "fixed_position": fixed_position,
    "tumble_two_axis": tumble_two_axis,
    "tumble_two_channel": tumble_two_channel,
    "eight_position": eight_position,
}
