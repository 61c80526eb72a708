"""Records of inertial units that scull, or that a chamber heats, from the equations; as attack_records has them."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
sys.path.insert(0, str(Path(__file__).parents[1] / "systems"))
import test_imu_thermal
from attack_records import G0, Array, Rng, Written, chance, spoiled, thermometer
from imu_world import Heat, Unit, World
from instrument_sheets import UNITS
from scipy import signal
from scipy.spatial.transform import Rotation
from test_imu_thermal import CYCLE

DPH = math.pi / 648000.0  # rad/s


# ------------------------------------------------------------------------------------------------ sculling
def rise(f: float, theta: float, a: float, T: float, filters: tuple[float, float], own: bool, pairs: bool,
         z: float, g: float, phase: float = 0.0) -> float:  # fmt: skip
    """Mean vertical acceleration that a user computes, g: samples at 1/128 of an interval, filtered by SciPy, summed to
    increments, each update rotated by the matrix of its half-way angle and the coning-free angle about one axis.
    """
    h = T / 128.0
    n = round(20.0 / (f * h)) + 128 * 100
    t = np.arange(n) * h
    angle, w = theta * np.sin(2.0 * math.pi * f * t), 2.0 * math.pi * f
    turning = -w * w * angle
    shake = a * np.sin(w * t + phase)
    fy = np.cos(angle) * shake + np.sin(angle) * g - turning * z
    fz = np.cos(angle) * g - np.sin(angle) * shake
    rate = w * theta * np.cos(w * t)
    read = []
    for x, band in ((rate, filters[0]), (fy, filters[1]), (fz, filters[1])):
        if band:
            sos = signal.butter(2, band, fs=1.0 / h, output="sos")
            x = signal.sosfilt(sos, x, zi=signal.sosfilt_zi(sos) * x[0])[0]
        read.append(x)
    d, ey, ez = (signal.convolve(x, np.array([0.5, 0.5]), "valid") * h for x in read)  # trapezoids
    m = d.size // 256 * 256
    d, ey, ez = (x[:m].reshape(-1, 128) for x in (d, ey, ez))
    p, vy, vz = (x.sum(axis=1) for x in (d, ey, ez))
    if own:  # the increments are in the axes of their begin, but for half the turn: integrals of 1/2 (a x dv + v x da)
        before = [np.cumsum(x, axis=1) - 0.5 * x for x in (d, ey, ez)]
        vy = vy + 0.5 * np.sum(-before[0] * ez + before[2] * d, axis=1)
        vz = vz + 0.5 * np.sum(before[0] * ey - before[1] * d, axis=1)
    if pairs:
        p1, p2 = p.reshape(-1, 2).T
        (y1, y2), (z1, z2) = vy.reshape(-1, 2).T, vz.reshape(-1, 2).T
        p = p1 + p2
        vy = y1 + y2 + 2.0 / 3.0 * (-p1 * z2 + z1 * p2)
        vz = z1 + z2 + 2.0 / 3.0 * (p1 * y2 - y1 * p2)
    begin = np.concatenate([[0.0], np.cumsum(p)[:-1]])
    step = T * (2 if pairs else 1)
    skip = int(8.0 / (f * step))  # until the filters are steady
    phases = w * step * np.arange(begin.size - skip)
    X = np.column_stack([np.ones(phases.size), *(q(k * phases) for k in (1, 2, 3, 4) for q in (np.cos, np.sin))])

    def mean(x: Array) -> float:
        return float(np.linalg.lstsq(X, x[skip:], rcond=None)[0][0])

    begin -= mean(begin)  # it started at rest: what the filters then made of a jump of the rate is not there
    q = np.where(np.abs(p) > 1e-6, p, 1e-6)
    s1, s2 = (1.0 - np.cos(q)) / q, 1.0 - np.sin(q) / q  # the integral of a turn about one axis
    uy, uz = vy - s1 * vz - s2 * vy, vz + s1 * vy - s2 * vz
    return (mean(np.sin(begin) * uy + np.cos(begin) * uz) / step - g) / G0


def sculling(rng: Rng, fault: str) -> Written:
    """Readings in motion and at rest between: what the user computes, a bias, noise."""
    T, own, pairs = chance(rng, 2e-3, 2e-2), bool(rng.integers(2)), bool(rng.integers(2))
    pairs = pairs and not own
    filters = tuple(chance(rng, 20.0, 400.0) * int(rng.integers(4) > 0) for _ in range(2))
    z, g = 0.05 * rng.normal() * int(rng.integers(2)), rng.uniform(9.77, 9.83)
    noise, bias = chance(rng, 1.0, 100.0), 300.0 * rng.normal()  # ug
    fs = sorted({round(chance(rng, 1.0, 0.2 / T), 2) for _ in range(3)})
    theta, a = chance(rng, 0.2, 10.0), chance(rng, 0.5, 30.0) * rng.choice([-1.0, 1.0])
    phase = rng.uniform(0.1, 0.5) if fault == "phase" else 0.0
    heat, warm, tau = chance(rng, 3.0, 100.0) * noise * (fault == "heat"), 0.0, chance(rng, 30.0, 600.0)
    expected = {f: 1e6 * rise(f, math.radians(theta), a, T, filters, own, pairs, z, g, phase) for f in fs}
    rows, t = [], 0.0
    for f in [x for each in fs for x in (0.0, each)] * int(rng.integers(1, 4)) + [0.0]:
        for _ in range(int(rng.integers(3, 7))):
            warm += ((f > 0.0) - warm) * -math.expm1(-10.0 / tau)
            rows.append([t, t + 10.0, f, theta * (f > 0.0), a * (f > 0.0),
                         bias + expected.get(f, 0.0) + heat * warm + noise * rng.normal()])  # fmt: skip
            t += 10.0
        t += 5.0
    c = np.array(rows).T
    y = spoiled(rng, fault, c[0], c[5], noise)
    stated = {"interval": T, "bandwidth": filters[0], "acc_bandwidth": filters[1], "size": z}
    if fault == "other filter":
        stated["acc_bandwidth"] = 0.3 * filters[1]
    if fault == "lever":
        stated["size"] = z + 0.1
    names = ("t_start [s]", "t_end [s]", "frequency [Hz]", "angle [deg]", "vibration [m/s2]", "acceleration [ug]")
    columns = dict(zip(names, [*c[:5], y], strict=True))
    if fault in ("frozen", "swapped"):
        columns["temperature [degC]"] = thermometer(rng, fault, 25.0 + 0.0 * c[0], 30.0 + c[2])
    if fault == "peak to peak":
        columns["vibration [m/s2]"] = 2.0 * c[4]
    if fault == "full angle":
        columns["angle [deg]"] = 2.0 * c[3]
    if fault == "rad/s":
        columns["frequency [Hz]"] = 2.0 * math.pi * c[2]
    if fault == "sign":
        columns["acceleration [ug]"] = -y
    if fault == "antiphase":
        columns["vibration [m/s2]"] = -c[4]
    units = {"interval": "s", "bandwidth": "Hz", "acc_bandwidth": "Hz", "size": "m"}
    head = "".join(f"# {n} = {v:.9g}{units[n]}\n" for n, v in stated.items())
    head += f"# sculling = {str(own).lower()}\n# samples = {2 if pairs else 1}\n# gravity = {g:.9g}m/s2\n"
    factor = 2.0 * math.pi if fault == "rad/s" else 1.0
    truth = {f"d({factor * f:g} Hz)": v for f, v in expected.items()}
    return Written(head, columns, truth if fault in ("jump", "period", "heat") else truth | {"b": bias})


# ------------------------------------------------------------------------------------------------ chamber
def chamber(rng: Rng, fault: str) -> Written:
    """Six positions and turns, six times, 40 K up and down, by tests/support/imu_world.py."""
    world = World(rng.uniform(-1.2, 1.2), rng.uniform(9.77, 9.83))
    unit, t_end = Unit.drawn(rng, chance(rng, 1e-4, 1e-2)), 0.0
    heats = {k: Heat.drawn(rng, size, 5e-4) for k, size in (("g", 20.0 * DPH), ("a", 0.02))}
    table = Rotation.from_rotvec([0.0, 1e-3, 0.0]) if fault == "leans" else world.table
    w = World(world.latitude, world.gravity, table=table).windows(CYCLE * 6, unit)
    t0, t1 = w["t_start"], w["t_end"]
    t_end = float(t1[-1])
    program = test_imu_thermal.program(t_end)
    if fault == "steps":  # soaks, with ramps of minutes between

        def program(t: Array) -> Array:
            return 40.0 * np.interp(np.asarray(t) / t_end, np.linspace(0.0, 1.0, 14)[1:-1].repeat(2)
                                    + np.tile([-5e-3, 5e-3], 12), np.sin(np.arange(13)).repeat(2)[1:-1])  # fmt: skip

    blind = Unit(*(np.zeros(s) for s in (3, (3, 3), (3, 3), 3, (3, 3))))
    exact = world.windows(CYCLE * 6, blind)
    noise = {"g": 3e-5 * chance(rng, 1.0, 10.0), "a": 5e-3 * chance(rng, 1.0, 10.0)}
    middle, felt = 0.5 * (t0 + t1), program
    if fault == "late":  # the thermometer is that of the chamber; the unit follows
        t = np.arange(t0[0] - 1.0, t_end + 5.0, 5.0)
        a = -math.expm1(-5.0 / chance(rng, 30.0, 600.0))
        unit_T = signal.lfilter([a], [1.0, a - 1.0], program(t))

        def felt(x: Array) -> Array:
            return np.interp(x, t, unit_T)

    size = chance(rng, 1.0, 100.0)
    for kind, heat in heats.items():
        inputs = np.array([exact[f"mean_{kind}{a}"] for a in "xyz"]).T
        if fault == "width":
            heat.width = 30.0
        more = heat.means(t0, t1, felt, inputs)
        for k, a in enumerate("xyz"):
            one = noise[kind] / math.sqrt(float(np.median(t1 - t0)))
            y = w[f"mean_{kind}{a}"] + more[:, k] + noise[kind] / np.sqrt(t1 - t0) * rng.normal(size=t0.size)
            if fault == "fourth":
                y = y + size * one * (program(middle) / 40.0) ** 4
            if fault == "axes":
                y = y + size * one / np.ptp(inputs) * inputs[:, (k + 1) % 3] * program(middle) / 40.0
            if fault not in ("frozen", "swapped", "clipped"):
                y = spoiled(rng, fault, middle, y, one)
            w[f"mean_{kind}{a}"] = y
    if fault == "clipped":  # a gyro at the end of its range in the turns
        w["mean_gx"] = np.clip(w["mean_gx"], -0.98, 0.98)
    fine = t0[:, None] + (t1 - t0)[:, None] * (np.arange(40) + 0.5) / 40.0
    T = program(fine).mean(axis=1)
    if fault == "gain":
        T = 0.8 * T
    if fault == "own heat":  # the unit's thermometer is warmer by what the unit makes, which the turns change
        T = T + 2.0 * (np.abs(w["mean_gx"]) > 0.1)
    if fault == "positions":
        rows = [np.flatnonzero(w["phase"] == 12 * 2 + k) for k in (1, 3)]
        for n in [f"mean_{k}{a}" for k in "ga" for a in "xyz"]:
            w[n][rows[0]], w[n][rows[1]] = w[n][rows[1]].copy(), w[n][rows[0]].copy()
    if fault == "exchanged":
        w["mean_gx"], w["mean_gy"] = w["mean_gy"], w["mean_gx"]
    if fault == "sign":
        w["mean_az"] = -w["mean_az"]
    if fault == "gravity":
        world.gravity += 0.02
    columns = {n + u: np.asarray(w[n], dtype=float) for n, u in UNITS.items()}
    columns["temperature [degC]"] = 25.0 + thermometer(rng, fault, T, 40.0 * np.sin(3.0 * np.arange(T.size) / T.size))
    head = f"# latitude = {math.degrees(world.latitude):.9g}deg\n# gravity = {world.gravity:.9g}m/s2\n"
    head += "# thermal = true\n# reference = 25degC\n"
    truth = unit.coefficients() | heats["g"].coefficients("g") | heats["a"].coefficients("a")
    if fault in ("jump", "period"):
        truth = {n: v for n, v in truth.items() if n[:2] not in ("bg", "ba") or "_" not in n[2:3]}
    return Written(head, columns, {n: v / si_of(n) for n, v in truth.items()})


def si_of(name: str) -> float:
    """Return the unit in which a coefficient is printed, SI."""
    kind, ending, along = name[:2], name.partition("_")[0][2:], name.partition("_")[2]
    if name[0] == "b":
        return (DPH if kind[1] == "g" else 1e-6 * G0) * (60.0 if ending == "R" else 1.0)
    if name[0] == "G":
        return DPH
    return 1e-6 if ending or along[0] == along[1] else math.pi / 648000.0
