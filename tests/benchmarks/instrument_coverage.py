"""How often the 95 % intervals of the tests of rate gyros and inertial units contain the true value.

    python tests/benchmarks/instrument_coverage.py TEST [--runs 300] [--seed 1] [--unstated] [--population]

Each run draws instrument, noise and errors of the set-up by the function of the test's name, runs the whole
co-simulation on a shortened plan and reduces it.  --unstated: the errors of the set-up are simulated, but nobody states
them.  --population: instruments without noise, to whose readings that of the population is added for which intervals
are made (gyrobench.reduction.estimation.noise), of twenty records for each instrument; of the tests in READINGS.
"""

from __future__ import annotations

import argparse
import logging
import math
import sys
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from held import Held, found, stated
from imu_positions import noise_of
from scipy.spatial.transform import Rotation

from gyrobench.engine.session import Session
from gyrobench.frames import G0
from gyrobench.record.record import Record
from gyrobench.result import Coefficient

DEG = math.pi / 180.0
DPH = DEG / 3600.0
ARCMIN = DEG / 60.0
Drawn = dict[str, Any]
#: a short sweep of a table that vibrates
SWEEP = {"points": 14, "lowest": 2.0, "dwell": 0.3, "periods": 12, "settle": 0.3}


def coning_test(rng: np.random.Generator) -> Drawn:
    """Gyros with errors of 100 ppm to 0.1 %, white noise, in half of the runs each a wandering bias and a case or a
    table that is off; filter, output rate and algorithm by chance.
    """
    size, white = 10.0 ** rng.uniform(-4.0, -3.0), 0.01 * DEG / 60.0 * 10.0 ** rng.uniform(-0.5, 0.7)
    mount, twist = ARCMIN * rng.integers(2), 0.1 * DPH * rng.integers(2)
    samples = int(rng.integers(1, 3))
    values: Drawn = {
        "readings": 4, "cycles": 2, "window": 1.0, "frequencies": "3 8 20", "half_angle": rng.uniform(0.2, 0.7) * DEG,
        "axis": "xyz"[rng.integers(3)], "samples": samples, "coning": bool(samples == 1 and rng.integers(2)),
        "bandwidth": float(rng.uniform(60.0, 300.0)), "u_mount": mount, "u_twist": twist,
        "imu.gyro_scale": rng.normal(0.0, size, (3, 3)).tolist(),
        "imu.mount": Rotation.from_rotvec(mount * rng.normal(size=3)).as_matrix().tolist(),
        "table.twist": twist * rng.normal(),
    }  # fmt: skip
    values |= {f"imu.{a}_gyro": white for a in "xyz"}
    values |= {f"imu.{a}_gyro_bias": white / 5.0 * rng.integers(2) for a in "xyz"}
    return values | {"imu.gyro_bias_tau": float(10.0 ** rng.uniform(1.0, 3.0))}


def sculling_test(rng: np.random.Generator) -> Drawn:
    """Instruments with errors of 100 ppm to 0.1 %, white noise, in half of the runs each a wandering bias and a motion
    that is not the stated one; filters, output rate, algorithm and lever arm by chance.
    """
    size, white = 10.0 ** rng.uniform(-4.0, -3.0), 50e-6 * G0 * 10.0 ** rng.uniform(-1.0, 0.5)
    gain, phase = 0.01 * rng.integers(2), 0.5 * DEG * rng.integers(2)
    values: Drawn = {
        "readings": 4, "cycles": 2, "window": 1.0, "frequencies": "3 8 20", "angle": rng.uniform(0.2, 0.7) * DEG,
        "vibration": rng.uniform(3.0, 10.0), "axis": "xyz"[rng.integers(3)], "samples": int(rng.integers(1, 3)),
        "sculling": bool(rng.integers(2)), "size": float(0.02 * rng.normal() * rng.integers(2)),
        "bandwidth": float(rng.uniform(60.0, 300.0)), "acc_bandwidth": float(rng.uniform(60.0, 300.0)),
        "u_angle": gain, "u_vibration": gain, "u_phase": phase, "table.angle_gain": gain * rng.normal(),
        "table.force_gain": gain * rng.normal(), "table.phase_error": phase * rng.normal(),
        "imu.gyro_scale": rng.normal(0.0, size, (3, 3)).tolist(),
        "imu.acc_scale": rng.normal(0.0, size, (3, 3)).tolist(),
    }  # fmt: skip
    values |= {f"imu.{a}_acc": white for a in "xyz"}
    values |= {f"imu.{a}_acc_bias": white / 5.0 * rng.integers(2) for a in "xyz"}
    return values | {"imu.acc_bias_tau": float(10.0 ** rng.uniform(1.0, 3.0))}


def vibration_rectification(rng: np.random.Generator) -> Drawn:
    """Gyro and accelerometer with coefficients by chance, white noise and, in half of the runs each, flicker, a control
    accelerometer that is off, a case that leans by 3 mrad, one way only.
    """
    gain, axis = 0.01 * rng.integers(2), int(rng.integers(3))
    lean = 3e-3 * rng.integers(2)
    white, ug = 0.01 * DEG * 10.0 ** rng.uniform(-1.5, 0.0), 1e-6 * G0
    noise = 70.0 * ug * 10.0 ** rng.uniform(-1.0, 0.3)
    return {
        "levels": "0 0.8 1.2 1.6", "readings": 3, "window": 1.0, "settle": 1.0, "axis": "xyz"[axis], "u_gain": gain,
        "ways": "up down" if rng.integers(2) else "up", "table.read_gain": gain * rng.normal(), "gyro.white": white,
        "u_lean": lean, **{f"table.lean_{way}": (lean * rng.normal(size=3)).tolist() for way in ("up", "down")},
        "gyro.flicker_x": white / 3.0 * rng.integers(2), "accelerometers.white": noise,
        f"accelerometers.{'xyz'[axis]}_flicker": noise / 3.0 * rng.integers(2),
        "gyro.g": (rng.uniform(-20.0, 20.0, (2, 3)) * DPH / G0).tolist(),
        "gyro.g2": (rng.uniform(-5.0, 5.0, (2, 3)) * DPH / G0**2).tolist(),
        "accelerometers.square": rng.uniform(-1e-4, 1e-4) / G0,
        "accelerometers.cubic": rng.uniform(-1e-5, 1e-5) / G0**2 * rng.integers(2),
        "accelerometers.scale": rng.normal(0.0, 1e-3, 3).tolist(),
    }  # fmt: skip


def turn_on_repeatability(rng: np.random.Generator) -> Drawn:
    """Turn-ons on one to five days, one exponential or two, in half of the runs a rate in both senses."""
    days = int(rng.integers(1, 6))
    tau = float(rng.uniform(10.0, 40.0))
    values: Drawn = {
        "days": days, "turn_ons": int(rng.integers(3, 6)), "dwell": 300.0, "window": 5.0, "limit": 0.3 * DPH,
        "rate": 0.02 * rng.integers(2), "gyro.optical": 0.0,
        "gyro.electronics": 0.003 * DEG / 60.0 * rng.uniform(1.0, 5.0),
        "switched.between_turn_ons": rng.uniform(0.0, 0.5) * DPH, "switched.between_days": rng.uniform(0.0, 0.5) * DPH,
        "switched.warm_1": rng.uniform(1.0, 5.0) * DPH, "switched.tau_1": tau,
        "switched.warm_2": rng.uniform(1.0, 5.0) * DPH * rng.integers(2), "switched.tau_2": 4.0 * tau,
    }  # fmt: skip
    return values | ({"switched.scale_warm": rng.uniform(1e-4, 1e-3)} if values["rate"] else {})


def rate_table_test(rng: np.random.Generator) -> Drawn:
    """Scale factor error, asymmetry, cubic, hysteresis, bias, latitude, white noise from 0.002 to 0.06 deg/sqrt(s) and,
    in half of the runs each, a random walk, flicker, a table axis that leans by 1 mrad and an input axis that leans by
    3 mrad (standard deviations).
    """
    white = 0.02 * DEG * 10.0 ** rng.uniform(-1.0, 0.5)
    axis, mount = 1e-3 * rng.integers(2), 3e-3 * rng.integers(2)
    return {
        "cycles": 2, "steps": 5, "dwell": 0.6, "settle": 0.2, "windows": 2, "table.acceleration": 50.0,
        "latitude": rng.uniform(-1.4, 1.4), "gyro.scale": [rng.uniform(-0.01, 0.01), 0.0],
        "gyro.asymmetry": rng.uniform(-3e-3, 3e-3), "gyro.cubic": rng.uniform(-3e-3, 3e-3) / (100.0 * DEG) ** 2,
        "gyro.hysteresis": rng.uniform(0.0, 0.05) * DEG, "gyro.bias": [rng.uniform(-1.0, 1.0) * DEG, 0.0],
        "gyro.white": white, "gyro.walk_x": white * 10.0 ** rng.uniform(-3.0, -1.0) * rng.integers(2),
        "gyro.flicker_x": white * 10.0 ** rng.uniform(-1.5, 0.0) * rng.integers(2), "u_axis": axis, "u_mount": mount,
        "table.tilt": (axis * rng.normal(size=2)).tolist(),
        "gyro.mount": Rotation.from_rotvec(mount * rng.normal(size=3)).as_matrix().tolist(),
    }  # fmt: skip


def gyro_bandwidth(rng: np.random.Generator, part: str) -> Drawn:
    """Filter, loop, split, output rate and scale factor, white noise of gyro and reading and, in half of the runs each,
    flicker, a random walk, errors of gain and lag of the reading.
    """
    white = 0.02 * DEG * 10.0 ** rng.uniform(-1.0, 0.5)
    gain, lag = 3e-3 * rng.integers(2), 5e-5 * rng.integers(2)
    values: Drawn = {
        **SWEEP, "highest": 150.0, "u_gain": gain, "u_lag": lag, "table.read_gain": gain * rng.normal(),
        "table.read_lag": lag * rng.normal(), "table.reading": white * rng.integers(2),
        "gyro.scale": [rng.uniform(-0.02, 0.02), 0.0],
        "gyro.walk_x": white * 10.0 ** rng.uniform(-3.0, -1.0) * rng.integers(2),
        "gyro.flicker_x": white * 10.0 ** rng.uniform(-1.5, 0.0) * rng.integers(2),
    }  # fmt: skip
    if part == "gyro_fog":
        return {**values, "gyro.optical": 0.0, "gyro.electronics": white}
    values |= {"gyro.white": white, "gyro.bandwidth": rng.uniform(25.0, 90.0)}
    values["gyro.period"] = rng.uniform(5e-4, 4e-3) * rng.integers(2)
    if part == "gyro_vibratory":
        values |= {"gyro.loop": rng.uniform(30.0, 150.0), "gyro.split": rng.uniform(-200.0, 200.0)}
    return values


def gyro_dynamics(rng: np.random.Generator, part: str) -> Drawn:
    """Momentum, inertia, damping, stiffnesses (or none) and drift of the gyro, white noise of pickoff and reading, the
    axis and, in half of the runs each, flicker and a random walk of the drift, an error of the gain of the reading.
    """
    gain, C, white = 3e-3 * rng.integers(2), rng.uniform(0.12, 0.3), 8.6e-8 * 10.0 ** rng.uniform(-0.5, 1.0)
    values: Drawn = {
        **SWEEP, "steps": 6, "hold": 0.15, "axis": ("input", "input", "output")[rng.integers(3)],
        "u_gain": gain, "table.read_gain": gain * rng.normal(),
        "table.reading": 1e-6 * 10.0 ** rng.uniform(-1.0, 1.0) * rng.integers(2),
        "gyro.H": C * rng.uniform(0.6, 1.5), "gyro.C": C, "gyro.J": C * rng.uniform(0.6e-3, 1.8e-3),
        "gyro.white": white, "gyro.pickoff": 5e-8 * 10.0 ** rng.uniform(0.0, 1.5),
        "gyro.flicker": 1e-8 * 10.0 ** rng.uniform(-1.0, 1.0) * rng.integers(2),
        "gyro.walk": white * 10.0 ** rng.uniform(-2.0, -1.0) * rng.integers(2),
    }  # fmt: skip
    if part == "compliant_gyro":
        values |= {"gyro.K_I": rng.uniform(200.0, 800.0), "gyro.K_O": rng.uniform(800.0, 4000.0)}
    return values


DRAWN: dict[str, Callable[..., Drawn]] = {
    f.__name__: f
    for f in (
        coning_test, sculling_test, rate_table_test, gyro_bandwidth, gyro_dynamics, turn_on_repeatability,
        vibration_rectification,
    )
}  # fmt: skip
#: gyros of a test that is counted with several
PARTS = {
    "gyro_bandwidth": ("gyro_mems", "gyro_vibratory", "gyro_fog"),
    "gyro_dynamics": ("compliant_gyro", "floated_gyro"),
}


#: readings of a test and the standard deviation of their noise, SI
READINGS = {
    "coning_test": {f"drift_{a}": 0.02 * DPH for a in "xyz"},
    "sculling_test": {"acceleration": 1e-5 * G0},
    "rate_table_test": {"mean": 0.05 * DEG},
    "vibration_rectification": {"rate": 2.0 * DPH, **{f"force_{a}": 2e-5 * G0 for a in "xyz"}},
}
RECORDS = 20


def of_population(session: Session, test: str, values: Drawn, seed: int) -> list[Sequence[Coefficient]]:
    """Return the coefficients of the records of one instrument."""
    known = {f"{slot}.{name}" for slot, b in session.assembly.bindings.items() for name in b.parameters}
    record = session.run({**values, **{n: 0.0 for n in session.system.noises if n in known}}, seed=seed)
    system = session.system.with_values({n: v for n, v in values.items() if "." not in n})
    t0, t1 = (np.asarray(record.windows[n], dtype=float) for n in ("t_start", "t_end"))
    rng, out = np.random.default_rng(seed), []
    for _ in range(RECORDS):
        windows = dict(record.windows)
        for name, size in READINGS[test].items():
            windows[name] = windows[name] + noise_of(rng, t0, t1, size)
        out.append(system.reduce(Record(windows, {}, record.run)).coefficients)
    return out


def named(test: str, name: str, axis: str) -> str:
    """Return the name under which a measure is counted."""
    if test == "gyro_dynamics":
        return f"{name} ({axis})"
    return name.split("(")[0].replace(f"_{axis}", "_along")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("test", choices=sorted(DRAWN))
    parser.add_argument("--runs", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--unstated", action="store_true")
    parser.add_argument("--population", action="store_true")
    given = parser.parse_args()
    logging.getLogger("gyrobench").setLevel(logging.ERROR)  # a line for each simulated error
    rng = np.random.default_rng(given.seed)
    held = Held()
    parts: tuple[str, ...] = PARTS.get(given.test, ())
    for k, own in enumerate([(p,) for p in parts] or [()]):
        with Session(given.test, dict(zip(["gyro"], own, strict=False))) as session:
            for run in range(given.runs // max(1, len(parts)) // (RECORDS if given.population else 1)):
                values = stated(DRAWN[given.test](rng, *own), given.unstated)
                seed = 100_000 * given.seed + 10_000 * k + run
                every = of_population(session, given.test, values, seed) if given.population else [
                    found(session, values, seed)]  # fmt: skip
                for c in (c for each in every for c in each):
                    held.count(named(given.test, c.name, values.get("axis", "-")), c)
    return int(held.show(18) > 0)


if __name__ == "__main__":
    sys.exit(main())
