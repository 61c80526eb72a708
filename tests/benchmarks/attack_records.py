"""Records of turned, vibrated and warming instruments from the equations, in plain numpy, and what spoils them.

A fault changes the physics or the laboratory, not the columns, where that is possible; its size is by chance, of one
noise of a reading to a hundred.  Units: those of the columns; truth in those of the report.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

Rng = np.random.Generator
Array = np.ndarray
EARTH, G0 = 15.0410686, 9.80665  # deg/h, m/s2


@dataclass
class Written:
    head: str
    columns: dict[str, Array]
    truth: dict[str, float]


def chance(rng: Rng, low: float, high: float) -> float:
    """Log-uniform."""
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def markov(rng: Rng, t: Array, tau: float) -> Array:
    """Gauss-Markov process of unit variance at rising times."""
    x = np.empty(t.size)
    x[0] = rng.normal()
    for k in range(1, t.size):
        a = math.exp(-(t[k] - t[k - 1]) / tau)
        x[k] = a * x[k - 1] + math.sqrt(1.0 - a * a) * rng.normal()
    return x


def spoiled(rng: Rng, fault: str, t: Array, y: Array, noise: float) -> Array:
    """Readings with the faults that every record may have; noise: of one reading."""
    size, record = noise * chance(rng, 1.0, 100.0), t[-1] - t[0]
    if fault == "coloured":
        return y + noise * chance(rng, 0.3, 5.0) * markov(rng, t, chance(rng, 0.02, 0.5) * record)
    if fault == "drift":
        return y + size * ((t - t[0]) / record - 0.5)
    if fault == "period":
        return y + size * np.sin(2.0 * math.pi * t / record + rng.uniform(0.0, 2.0 * math.pi))
    if fault == "jump":
        return y + size * (np.arange(t.size) >= rng.integers(t.size // 5, 4 * t.size // 5))
    if fault == "coarse":
        word = noise * chance(rng, 2.0, 30.0)
        return word * np.round(y / word)
    if fault == "clipped":
        return np.clip(y, *np.quantile(y, [0.0, rng.uniform(0.7, 0.97)]))
    return y


def thermometer(rng: Rng, fault: str, T: Array, other: Array) -> Array:
    """What is read of a temperature T; swapped: another channel was."""
    read = {"frozen": np.full(T.size, T[0]), "swapped": other}.get(fault, T)
    return read + 0.02 * rng.normal(size=T.size)


# ------------------------------------------------------------------------------------------------ rate table
def stepped(rng: Rng, fault: str) -> Written:
    """rate = w + b + e w + a abs(w)/2 + c w (w/R)2 + h d, deg/s, rates in even, geometric or any steps."""
    R, n, cycles, each = chance(rng, 10.0, 1000.0), int(rng.integers(3, 13)), int(rng.integers(1, 5)), 2
    up = R * np.sort(np.append([rng.uniform(0.1, 0.95, n - 1), np.geomspace(0.05, 1.0, n)[:-1]][rng.integers(2)], 1.0))
    way = [*up, *up[-2::-1], 0.0]
    table = np.array([0.0, *([*way, *(-w for w in way)] * cycles)])
    latitude, noise = rng.uniform(-80.0, 80.0), R * chance(rng, 1e-7, 1e-4)
    earth = EARTH / 3600.0 * math.sin(math.radians(latitude))
    e, a, c = rng.normal() * 1e-3, *(noise / R * chance(rng, 1.0, 300.0) * rng.choice([-1.0, 1.0], 2))
    h, b, length = noise * chance(rng, 0.1, 100.0), 1e-3 * R * rng.normal(), chance(rng, 1.0, 20.0)
    size, tau = noise * chance(rng, 1.0, 300.0), chance(rng, 30.0, 2000.0)
    d = np.repeat(np.sign(np.diff(table, prepend=table[0])), each)
    rate = np.repeat(table, each)
    t = 1.5 * length * np.arange(rate.size)
    w, warm, x = rate + earth, np.zeros(rate.size), rate / R
    for k in range(1, rate.size):
        warm[k] = x[k] ** 2 + (warm[k - 1] - x[k] ** 2) * math.exp(-1.5 * length / tau)
    y = w + b + e * w + a * np.abs(w) / 2.0 + c * w * (w / R) ** 2 + h * d
    y += size * {"square": x**2, "fifth": x**5, "heat": x * warm}.get(fault, 0.0 * x)
    if fault == "dead band":
        y -= size * np.sign(w)
    y = spoiled(rng, fault, t, y + noise * rng.normal(size=y.size), noise)
    columns = {"t_start [s]": t, "t_end [s]": t + length, "rate [deg/s]": rate, "mean [deg/s]": y}
    truth = {"e": 1e6 * e, "a": 1e6 * a, "c": 1e6 * c, "h": 3600.0 * h, "b": 3600.0 * b}
    if fault in ("drift", "jump", "period"):
        del truth["b"]  # there is not one
    return Written(f"# latitude = {latitude:.9g}deg\n", columns, {n: float(v) for n, v in truth.items()})


# ------------------------------------------------------------------------------------------------ shaker
def shaken(rng: Rng, fault: str, one_way: bool = False) -> Written:
    """rate = w + b_g + G f + G2 f2, force = f + b_a + S f + K2 f2 + K3 f3 of f = +-g + vibration, sample by sample."""
    axis = "xyz"[rng.integers(3)]
    gravity, latitude = rng.uniform(9.77, 9.83), rng.uniform(-80.0, 80.0)
    top, steps = chance(rng, 1.0, 20.0), int(rng.integers(3, 6))
    levels = np.concatenate([[0.0], np.sort(top * np.append(rng.uniform(0.2, 0.9, steps - 2), 1.0))])
    repeats, cycles, ways = int(rng.integers(2, 5)), int(rng.integers(1, 4)), ([1] if one_way else [1, -1])
    if fault == "turned jump":
        ways = ways * 2
    noise = {"g": chance(rng, 0.02, 0.5), "a": chance(rng, 2e-6, 1e-4)}  # deg/h, g
    b, G, G2 = rng.normal() * 20.0, rng.normal() * 10.0, rng.normal() * 2.0
    ba, S, K2, K3 = rng.normal() * 3e-3, rng.normal() * 1e-3, rng.normal() * 5e-5, rng.normal() * 5e-6
    lean = rng.uniform(0.02, 0.1) if fault == "leans" else 0.0  # rad, one way alone
    linear = chance(rng, 1.0, 100.0) / top if fault == "linear" else 0.0
    heat = chance(rng, 3.0, 100.0) / top**2 if fault.startswith("heat") else 0.0
    tau, turned = chance(rng, 30.0, 600.0), chance(rng, 1.0, 100.0)
    limit = rng.uniform(0.5, 0.95) * (1.0 + 3.0 * top)
    rows, warm, t = [], 0.0, 0.0
    for k, way in enumerate(ways):
        for s in list(levels) * cycles:
            for _ in range(repeats):
                half = rng.normal(size=1000)
                x = np.concatenate([half, -half])
                f = way * math.cos(lean * (way < 0)) * gravity / G0 + s * x / np.std(x)
                if fault == "clipped":  # of the samples, at the ends of a range
                    f = np.clip(f, -limit, limit)
                warm += (heat * s * s - warm) * -math.expm1(-12.0 / tau)
                w = EARTH * math.sin(math.radians(latitude)) * way if axis == "x" else 0.0
                if fault == "heading" and axis != "x":  # up x stays; x is not east by 20 deg
                    w = EARTH * math.cos(math.radians(latitude)) * math.sin(0.35) * way
                more = linear * s + warm + (turned * (k % 2) if fault == "turned jump" and k < 3 else 0.0)
                rate = w + b + G * f.mean() + G2 * np.mean(f**2) + noise["g"] * (more + rng.normal())
                force = f.mean() + ba + S * f.mean() + K2 * np.mean(f**2) + K3 * np.mean(f**3)
                rows.append([t, t + 10.0, way, s, rate, force + noise["a"] * (more + rng.normal()), 25.0 + warm])
                t += 12.0
            t += 10.0
        t += 300.0
        warm *= math.exp(-300.0 / tau)
    c = np.array(rows).T
    rate = spoiled(rng, "" if fault == "clipped" else fault, c[0], c[4], noise["g"])
    force = spoiled(rng, "" if fault == "clipped" else fault, c[0], c[5], noise["a"])
    head = f"# latitude = {latitude:.9g}deg\n# gravity = {gravity:.9g}m/s2\n# axis = {axis}\n"
    columns = {"t_start [s]": c[0], "t_end [s]": c[1], "up": c[2], "level [g]": c[3], "rate [deg/h]": rate,
               "force [g]": force}  # fmt: skip
    if fault in ("heat seen", "frozen", "swapped"):
        columns["temperature [degC]"] = thermometer(rng, fault, c[6], 40.0 + c[3])
    if fault == "peak":
        columns["level [g]"] = math.sqrt(2.0) * c[3]
    if fault == "not turned":
        columns["rate [deg/h]"], columns["force [g]"] = (np.where(c[2] < 0.0, y[0] + 0.0 * y, y) for y in (rate, force))
        columns["rate [deg/h]"] = np.where(c[2] < 0.0, np.resize(rate[c[2] > 0.0], rate.size), rate)
        columns["force [g]"] = np.where(c[2] < 0.0, np.resize(force[c[2] > 0.0], rate.size), force)
    if fault == "ways exchanged":
        columns["up"] = -c[2]
    if fault == "gravity":
        head = head.replace(f"{gravity:.9g}m/s2", f"{gravity + 0.05:.9g}m/s2")
    truth = {"b_g": b, "G": G, "G2": G2, "b_a": ba * 1e6, "S": S * 1e6, "K2": K2 * 1e6, "K3": K3 * 1e6}
    if fault == "heat seen":  # that of the mean temperature
        truth["b_g"] += noise["g"] * np.mean(c[6] - 25.0)
        truth["b_a"] += 1e6 * noise["a"] * np.mean(c[6] - 25.0)
    if fault in ("jump", "period", "turned jump"):
        del truth["b_g"], truth["b_a"]  # there is not one
    if one_way:
        truth = {"G2": G2, "K2": 1e6 * (K2 + 3.0 * K3 * gravity / G0)}
    return Written(head, columns, truth)


def shaken_one_way(rng: Rng, fault: str) -> Written:
    return shaken(rng, fault, True)


# ------------------------------------------------------------------------------------------------ warm-up
def warming(rng: Rng, fault: str) -> Written:
    """y = b_day + b_on + sum A exp(-t/tau) + 0.1 deg/h/K (T - 20 degC), means over readings sample by sample."""
    days, each, length = int(rng.integers(1, 5)), int(rng.integers(3, 6)), chance(rng, 3.0, 20.0)
    count, n = days * each, int(rng.integers(20, 80))
    span = n * length
    taus = np.array([chance(rng, 0.02, 0.05), chance(rng, 0.08, 0.15)]) * span
    sizes = rng.uniform(1.0, 30.0, 2) * np.array([1.0, rng.integers(2)])
    noise, limit = chance(rng, 0.01, 0.3), 0.2
    on, between, mean = rng.uniform(0.0, 0.5), rng.uniform(0.0, 0.5), 20.0 * rng.normal()
    late = chance(rng, 0.3, 3.0) * length if fault == "late" else 0.0
    bend = chance(rng, 3.0, 100.0) * noise
    of_day = between * rng.normal(size=days)
    T_on = 20.0 + 3.0 * rng.normal(size=count)
    rows, bias = [], []
    for k in range(count):
        b = mean + of_day[k // each] + on * rng.normal() + 0.1 * (T_on[k] - 20.0)
        bias.append(b - 0.1 * (T_on[k] - 20.0))
        start = 10.0 * span * k
        cold = rng.uniform(0.3, 1.0) if fault == "began warm" and k % each else 1.0
        for j in range(n):
            fine = (j + (np.arange(40) + 0.5) / 40.0) * length
            curve = cold * sum(a * np.exp(-fine / x) for a, x in zip(sizes, taus, strict=True))
            if fault == "diffusion":  # heat into a half-space
                curve = sizes[0] * np.minimum(1.0, np.sqrt(0.01 * span / fine))
            elif fault == "third":
                curve = curve + bend * np.exp(-fine / (1.5 * span))
            elif fault == "within":  # a room that warms by the same in each turn-on
                curve = curve + bend * fine / span
            T = T_on[k] + (bend / 0.1 * fine.mean() / span if fault == "within" else 0.0)
            since = fine.mean() + late
            rows.append([start + since - length / 2, start + since + length / 2, k + 1, 1 + k // each, since,
                         b + curve.mean() + noise * rng.normal(), T])  # fmt: skip
    c = np.array(rows).T
    y = spoiled(rng, fault, c[0], c[5], noise)
    if fault == "clipped":
        y = np.minimum(c[5], np.quantile(c[5], 0.95))
    columns = dict(zip(("t_start [s]", "t_end [s]", "turn_on", "day", "since [s]"), c, strict=False))
    columns["mean [deg/h]"] = y
    if fault in ("frozen", "swapped", "seen"):
        columns["temperature [degC]"] = thermometer(rng, fault, c[6], 30.0 + rng.normal() * (c[0] / c[0][-1]))
    if fault == "lost":  # readings that were not written, the times of the later ones closed up
        keep = rng.random(c[0].size) > 0.1
        rank = np.concatenate([np.arange(np.count_nonzero(m)) for m in (keep[c[2] == k + 1] for k in range(count))])
        columns = {name: v[keep] for name, v in columns.items()}
        columns["since [s]"] = (rank + 0.5) * length
        columns["t_start [s]"] = 10.0 * span * (columns["turn_on"] - 1) + rank * length
        columns["t_end [s]"] = columns["t_start [s]"] + length
    there = sizes > 0.0
    truth = {"b": float(np.mean(bias)) + (float(np.mean(0.1 * (T_on - 20.0)))), "A": float(sizes.sum()), "σ_on": on}
    if fault == "third":
        del truth["A"]
    if fault in ("diffusion", "within"):
        truth = {"b": truth["b"]} if fault == "diffusion" else {}
    if fault in ("jump", "drift", "period"):
        del truth["b"]  # there is not one
    if np.count_nonzero(there) == 1:
        truth["τ"] = float(taus[there][0])
    elif "A" in truth:
        truth |= {"A_1": sizes[0], "A_2": sizes[1], "τ_1": taus[0], "τ_2": taus[1]}
    return Written(f"# limit = {limit}deg/h\n", columns, {n: float(v) for n, v in truth.items()})
