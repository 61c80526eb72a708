"""Hu 1981, chapters 5 and 6: turntables, loops, surroundings."""

from __future__ import annotations

import math

import numpy as np
from example import Example, part, room

from gyrobench import drift, units
from gyrobench.bench import standard_folder
from gyrobench.design.aerostatic import AerostaticBearing
from gyrobench.engine.session import Session
from gyrobench.packaging import load_part
from gyrobench.units import ARCSEC, DEG, DPH, G0
from gyrobench.units import EARTH_RATE as ERU

GCM = units.factor("g.cm")
SITE = 42.36 * DEG  # of the laboratory whose sensitivities the source lists


def bearings() -> list[Example]:
    """Drag and unbalance of an air bearing; its stiffness."""
    film = {"air_gap": 2e-4, "air_thrust_gap": 2e-4, "air_length": 0.158, "air_inner": 0.075, "air_outer": 0.125}
    drag = part("bearing_air", **film, air_diameter=0.25, rate=DEG, of=lambda p: -p.M / GCM)
    pull = part("bearing_air", **film, air_unbalance=20.0 * 5e-4, air_gravity=G0, air_elevation=15.0 * DEG,
                angle=0.5 * math.pi, of=lambda p: p.M / GCM)  # fmt: skip
    stiff = AerostaticBearing().tilt_stiffness() / G0 * ARCSEC
    why = "p_0, gap and holes are misprinted or missing; with 6 bar, 20 µm, 24 holes of 0.2 mm a row (ET23)"
    return [
        Example("5.4, example of 5-33, 5-34", "viscous torque, D = 2 r_2", "4.26e-2", "g·cm", "`bearing_air`", drag,
                "ET7"),
        Example("5.4, example of 5-36", "largest torque of an unbalance at 15°", "≈700", "g·cm", "`bearing_air`", pull,
                "ET8", "966"),
        Example("5.4, example of 5-30", "angular stiffness", "7", "kg·m/″", "`AerostaticBearing`", stiff, why=why),
        Example("5.4", "angular stiffness of the inner axis", "54", "kg·m/″", "`AerostaticBearing`", stiff, why=why),
    ]  # fmt: skip


def ripple() -> tuple[float, float]:
    """Return largest and mean error (arcsec) of an angle reader with one-phase excitation at 1 rad/s and 2 kHz."""
    made = load_part("inductosyn", standard_folder())
    clean = {f"encoder_{n}": 0.0 for n in ("eccentricity", "tilt", "pitch", "d0", "de", "e3", "e5", "reading")}
    clock = 2e8
    p = made(mode=1, phases=1, f_0=2000.0, f_T=clock, f_c=7.2e6, quantum=2.0 * math.pi / (720.0 * clock / 2000.0),
             rate_max=2.0, loop_type=0, **clean)  # fmt: skip
    p.angle, p.rate = 0.0, 1.0
    p.initialize()
    h, seen = 2e-5, []
    for k in range(round(2.0 * math.pi / 720.0 / h)):  # a cycle of the fine count at 1 rad/s
        p.angle = (k + 1) * h
        p.do_step(k * h, h)
        seen.append((p.angle - p.angle_read) / ARCSEC)
    return max(seen), float(np.mean(seen))


def readers() -> list[Example]:
    """Counts of the angle reader, and what its error makes of a rate."""
    made = load_part("inductosyn", standard_folder())
    p = made()
    p.initialize()
    one = made(f_0=2000.0, f_T=10e6, f_c=7.2e6, quantum=1e-4 * DEG)
    one.initialize()
    largest, mean = ripple()
    coarse = 360.0 * 2400.0 / 4.32e6
    return [
        Example("5.4", "angle of a pulse", "0.18", "″", "`inductosyn`", p.quantum / ARCSEC),
        Example("5.4", "angle of a coarse count, clock of 4.32 MHz", "0.1", "°", "`inductosyn`", coarse, "ET13", "0.2"),
        Example("5.4", "error of a rate of 1 ERU over 10 s", "<0.14", "%", "`inductosyn`, one count in 10 s",
                100.0 * p.quantum / (10.0 * ERU)),
        Example("5.5, 5-46", "largest fine count", "5000", "1", "`inductosyn`", one.N),
        Example("5.5, 5-46", "angle of a fine count, f_T 10 MHz, f_0 2 kHz", "1e-4", "°", "`inductosyn`",
                2.0 * math.pi / one.turn / DEG, "ET15"),
        Example("5.5, 5-47", "largest coarse count", "3600", "1", "`inductosyn`", one.n_c),
        Example("5.5, 5-47", "angle of a coarse count", "0.1", "°", "`inductosyn`", 360.0 / one.n_c),
        Example("5.5, example of 5-58", "largest error at 1 rad/s and 2 kHz", "≈8", "″", "`inductosyn`", largest,
                "ET12", "16.4"),
        Example("5.5, example of 5-58", "mean error at 1 rad/s and 2 kHz", "≈8", "″", "`inductosyn`", mean),
        Example("5.5, two-1", "quantum behind a multiplier of 10⁴", "0.36", "″", "`units.convert`",
                units.convert(360.0 / 360.0 / 1e4, "deg", "arcsec")),
        Example("5.5, two-1", "time of 0.036° of 2.5 kHz", "40", "ns", "`units.convert`",
                0.036 / 360.0 / 2500.0 * 1e9),
    ]  # fmt: skip


def rates() -> list[Example]:
    """Orientation, evenness and rate mode of a table."""
    budgets = room("table_environment", "budgets")
    at = lambda angle, sense: float(budgets.misalignment_rate(np.array([[angle * ARCSEC]]), 10.0, sense)[0]) / DPH  # noqa: E731
    mean = lambda angle: 0.5 * (at(angle, 1) + at(angle, -1))  # noqa: E731
    by = "`table_environment`, `misalignment_rate`"
    total = budgets.combine(budgets.parse(budgets.RATE_MODE, "rad"), 1)
    friction, inertia = 6000.0 * GCM, 2.61e4 * GCM
    left = friction / (inertia * 2.0 * math.pi * 50.0)
    rows = [
        Example("5.5, 5-60", "allowed tilt of the axis, n = 10, against the Earth", "1.5", "″", by, 1e-3 / at(1.0, -1)),
        Example("5.7", "allowed error of the alignment, n = 10", "1.4", "″", by, 1e-3 / mean(1.0)),
        Example("5.5, 5-61", "angle in a degree for η = 1e-5", "0.036", "″", "`units.convert`",
                1e-5 * units.convert(1.0, "deg", "arcsec")),
        Example("5.5, 5-61", "angle in a degree for η = 1e-4", "0.36", "″", "`units.convert`",
                1e-4 * units.convert(1.0, "deg", "arcsec")),
        Example("5.5, 5-61", "position error of an intermittent two-axis tumble", "16", "″", "–", math.nan,
                why="neither the gyro nor the source of it is stated"),
        Example("5.5, two-1", "rate error of a tachometer loop", "31.6", "°/h", "`controller_analog`: M/(J ω_b)",
                left / DPH, why="with 2.61e4 g·cm·s² (ET14)"),
        Example("5.5, two-1", "the same over 10 ERU", "21.6", "%", "`units.convert`",
                31.6 * DPH / (10.0 * ERU) * 100.0, "ET14", "21.0"),
        Example("5.5, two-1", "root of the squares of five angle errors", "1.27", "″", "`table_environment`, `combine`",
                total.rss / ARCSEC, "ET21", "1.47"),
        Example("5.5, two-1", "the same over a degree", "0.04", "%", "`table_environment`, `combine`",
                total.rss / DEG * 100.0),
        Example("5.5, example of 5-73", "time for 1e-4 °/h with 1e-6 ° a pulse", "0.01", "s", "`rebalance_pulse`: N/T",
                units.convert(1e-6 / 1e-4, "h", "s"), "ET17", "36"),
        Example("5.5, after 5-74", "1 % of a bias of 1 °/h", "0.01", "°/h", "`units.convert`", 0.01),
    ]  # fmt: skip
    for angle, printed, odd in ((5.0, "≈0.004", ()), (2.0, "0.0012", ("ET20", "0.0015")), (1.0, "0.0007", ())):
        rows.append(Example("5.8, list", f"rate of a misalignment of {angle:g}″, n = 10", printed, "°/h", by,
                            mean(angle), *odd))  # fmt: skip
    rows += [
        Example("5.8, list", "rate of a misalignment of 1.5″, n + 1", "0.0012", "°/h", by, at(1.5, 1)),
        Example("5.8, item 11", "drift by 10″ at −0.37 °/h a degree", "0.001", "°/h", "`units.convert`",
                0.37 * units.convert(10.0, "arcsec", "deg")),
    ]  # fmt: skip
    return rows


def ground() -> list[Example]:
    """Waves, tilts and what a sensor makes of them."""

    def wave(amplitude: float, period: float) -> float:
        given = [[amplitude, 0.0, 0.0]] + [[0.0] * 3] * 7
        quiet = dict.fromkeys((f"{k}_{a}" for k in ("seismic", "local") for a in "enu"), 0.0)
        return part("ground_motion", displacement=given, period=[period] * 8, phase=[0.5 * math.pi] * 8, **quiet,
                    of=lambda p: abs(p.a[0]) / G0)  # fmt: skip

    def tilted(axis: int, what: str, along: int) -> float:
        """Change of f or omega along an axis per arcsec of tilt about another one."""
        given = [[ARCSEC if k == axis else 0.0 for k in range(3)]] + [[0.0] * 3] * 7
        quiet = dict.fromkeys((f"{k}_{a}" for k in ("seismic", "local") for a in "enu"), 0.0)
        slow = {"period": [1e6] * 8, "phase": [0.5 * math.pi] * 8, "latitude": SITE, **quiet}
        with_, flat = (
            part("ground_motion", tilt_amplitude=t, **slow, of=lambda p: getattr(p, what)[along])
            for t in (given, [[0.0] * 3] * 8)
        )
        return abs(with_ - flat)

    by = "`ground_motion`"
    rows = [
        Example("5.6", "body wave, 1e-3 cm in 5 s", "1.6e-6", "g", by, wave(1e-5, 5.0)),
        Example("5.6", "surface wave, 1 cm in 20 s", "≈1.0e-4", "g", by, wave(1e-2, 20.0)),
        Example("5.6", "free oscillation, 1 mm in 45 min", "≈1e-9", "g", by, wave(1e-3, 2700.0)),
        Example("5.6", "microseism, 0.001 cm in 7 s", "0.8e-6", "g", by, wave(1e-5, 7.0)),
        Example("5.6", "microseism, 0.03 cm in 4.5 s", "6e-6", "g", by, wave(3e-4, 4.5), "ET19", "6.0e-5"),
        Example("Table 5-4", "gravity by a tilt", "4.8e-6", "g/″", by, tilted(0, "f", 1) / G0),
        Example("Table 5-4", "Earth's rate by a tilt about north, up to east", "3.3e-6", "ERU/″", by,
                tilted(1, "omega", 0) / ERU),
        Example("Table 5-4", "Earth's rate by a tilt about east, north to up", "3.6e-6", "ERU/″", by,
                tilted(0, "omega", 2) / ERU),
        Example("Table 5-4", "Earth's rate by a turn about up, north to east", "3.6e-6", "ERU/″", by,
                tilted(2, "omega", 0) / ERU),
        Example("5.6.2", "rate of 1 ″/s", "67e-8", "ERU", "`units.convert`", units.convert(1.0, "arcsec/s", "ERU"),
                "ET19", "0.0665"),
        Example("5.6.2", "rate by an angular acceleration", "20e-6", "ERU/(″/s²)", "`floated_gyro`: J/H", math.nan,
                why="J and H of the sensor are not printed; it means J/H = 3.0e-4 s"),
    ]  # fmt: skip
    return rows


def surroundings() -> dict[str, float]:
    """Return the levels that `table_environment` finds for 1e-9 ERU, by cause, from a run without noise: SI."""
    with Session("table_environment") as session:
        quiet = dict.fromkeys(session.system.noises, 0.0)
        given = {**quiet, "gyro.D_IO": 0.0, "dwell": 1200.0, "readings": 60}
        result = session.system.reduce(session.run(given, seed=1, step=5e-3))
    rows = next(t for t in result.tables if t.id == "budget.surroundings").rows[:6]
    levels = [row[7] for row in rows]
    return dict(zip(("rate", "east", "north", "temperature", "difference", "field"),
                    np.array(levels) * [ARCSEC, ARCSEC, ARCSEC, 1e-3, 1e-3, 1e-6], strict=True))  # fmt: skip


def sensor() -> list[Example]:
    """The sensor of Tables 5-5 and 5-7: sensitivities, and levels at which each makes 1e-9 ERU."""
    g = {"D_I": 0.1, "D_S": 0.1, "D_IS": 1e-3, "D_II": 5e-5, "D_SS": 5e-5}  # ERU per g, per g squared
    one = lambda names, *at: float(drift.drift(np.array(at), {n: g[n] for n in names}))  # noqa: E731
    by, run, level = "`drift.drift`", "`gyrobench run table_environment`", 1e-9
    at, fahrenheit, gauss = surroundings(), 1.0 / 1.8, 1e-4
    return [
        Example("Table 5-5", "1 µg along the input axis", "0.1e-6", "ERU", by, one(["D_I"], 1e-6, 0.0, 0.0)),
        Example("Table 5-5", "square, along the input axis", "50e-6", "ERU/g²", by, one(["D_II"], 1.0, 0.0, 0.0),
                "ET19"),
        Example("Table 5-5", "square, 1 g along input and spin axis each", "1e-3", "ERU/g²", by,
                one(["D_IS", "D_II", "D_SS"], 1.0, 0.0, 1.0), "ET24"),
        Example("5.6.2", "random drift of 1e-8 ERU", "1.5e-7", "°/h", "`units.convert`",
                units.convert(1e-8, "ERU", "deg/h")),
        Example("Table 5-7", "tilt about north at 45.75°", "3e-4", "″", run, at["north"] / ARCSEC),
        Example("Table 5-7", "rate", "≈1e-8", "″/s", run, at["rate"] / ARCSEC),
        Example("Table 5-7", "angular acceleration", "5e-5", "″/s²", "1e-9 ERU over 20e-6", level / 20e-6),
        Example("Table 5-7", "acceleration", "1e-2", "µg", by, level / one(["D_I"], 1e-6, 0.0, 0.0)),
        Example("Table 5-7", "vibration, rms", "1e-3", "g", by,
                math.sqrt(level / one(["D_IS"], 1.0, 0.0, 1.0)), "ET19"),
        Example("Table 5-7", "mean temperature", "≈3e-6", "°F", run, at["temperature"] / fahrenheit),
        Example("Table 5-7", "temperature difference", "1e-6", "°F", run, at["difference"] / fahrenheit),
        Example("Table 5-7", "mean field, and its change", "≈3e-5", "G", run, at["field"] / gauss),
        Example("Table 5-7", "difference of the field, and its change", "≈3e-6", "G", "1e-9 ERU over 400e-6",
                level / 400e-6),
    ]  # fmt: skip


def foundations() -> list[Example]:
    """Frequencies from which on a mount of 3.5 Hz, and the servo of an active foundation, take motion away."""
    isolation = room("table_environment", "isolation")
    f = np.geomspace(0.01, 20.0, 20_000)
    passive = np.abs(isolation.along(f, {"frequency": 3.5, "damping": 0.1}))
    servo = {"frequency": 0.5, "damping": 0.1, "corner": 0.04, "corner_damping": 0.7, "servo_band": 30.0}
    active = np.abs(isolation.along(f, servo))
    mount, held = (float(f[1 + np.flatnonzero(gain > 1.0)[-1]]) for gain in (passive, math.sqrt(2.0) * active))
    parts, place = ("`foundation_passive`", "`foundation_active`"), "5.6, three"
    return [
        Example(place, "a mount of 3.5 Hz takes away what is above", "5", "Hz", parts[0], mount),
        Example(place, "servos respond from 0.03 to 0.05 Hz on", "<0.05", "Hz", parts[1], held),
    ]


def capture() -> list[Example]:
    """Return of a servo table to null from 2 degrees."""
    with Session("table_capture") as session:
        result = session.system.reduce(session.run({}, seed=1))
    found = next(c.estimate for c in result.coefficients if c.name == "t_null")
    return [Example("5.3, end", "time to null from 2°", "<5", "s", "`gyrobench run table_capture`", found)]


def examples() -> list[Example]:
    """Return the worked numbers of these chapters, in order."""
    return [*capture(), *bearings(), *readers(), *rates(), *ground(), *sensor(), *foundations()]
