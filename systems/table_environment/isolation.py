"""What a foundation leaves of the motion of the ground: transmissibilities, and the table of a run.  [ENV-FOUNDATION]

With s = 2 pi i f, d and w = 2 pi frequency of the mount, the law of `foundation_active` and E = (tau s + 1)(s + w_0)2

    passive  T = (2 d w s + w2)/(s2 + 2 d w s + w2)
    active   T = (2 d w s + w2) E/((s2 + 2 d w s + w2) E + A s4 + (A w_0 + B) s3)

Tilt: T of a passive mount with the rocking mode, of either foundation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.record import Record
from gyrobench.reduction.toolkit import Table
from gyrobench.units import ARCSEC, G0

PERSON = 70.0  # kg
#: motions of Hu 1981, section 5.6: name, period (s), size, unit; "tilt": a lean of the ground
MOTIONS = (
    ("free oscillation of the Earth", 2700.0, 5.5e-10, "g"),
    ("surface wave", 20.0, 1e-4, "g"),
    ("microseism", 7.0, 0.8e-6, "g"),
    ("body wave", 5.0, 1.6e-6, "g"),
    ("microseism", 4.0, 6e-6, "g"),
    ("traffic", 0.5, 1e-5, "g"),
    ("machines", 0.05, 1e-2, "g"),
    ("tilt of a day", 86400.0, 1.0, "″"),
    ("tilt by passing loads", 0.5, 0.1, "″"),
)


def mount(f: Any, frequency: float, damping: float) -> Any:
    """Return T of a mount without servo at f (Hz), complex."""
    s, w = 2j * np.pi * np.asarray(f, dtype=float), 2.0 * math.pi * frequency
    held = 2.0 * damping * w * s + w * w
    return held / (s * s + held)


def servo(p: Mapping[str, float]) -> tuple[float, float, float]:
    """Return A, B, tau of the servo of `foundation_active`."""
    w, w_c = (2.0 * math.pi * p[n] for n in ("frequency", "corner"))
    A = (p["frequency"] / p["corner"]) ** 2 - 1.0
    B = 2.0 * p["corner_damping"] * w_c * (1.0 + A) - 2.0 * p["damping"] * w
    return A, B, A / (2.0 * math.pi * p["servo_band"])


def along(f: Any, p: Mapping[str, float]) -> Any:
    """Return T along an axis at f (Hz), of parameters by the names of the part; a servo where it has a corner."""
    if "corner" not in p:
        return mount(f, p["frequency"], p["damping"])
    s, w, w_c = (2j * np.pi * np.asarray(f, dtype=float), *(2.0 * math.pi * p[n] for n in ("frequency", "corner")))
    A, B, tau = servo(p)
    w_0, held = 0.25 * w_c, 2.0 * p["damping"] * w * s + w * w
    E = (tau * s + 1.0) * (s + w_0) ** 2
    return held * E / ((s * s + held) * E + A * s**4 + (A * w_0 + B) * s**3)


def follows(f: Any, p: Mapping[str, float], g: float) -> Any:
    """Return the way of an active block against still ground per slow tilt of that ground, m/rad: its accelerometers
    take the gravity of the lean for an acceleration.

        x = -K g q/((1 + K) s2 + 2 d w s + w2)      K = (A (s + w_0) + B) s/((s + w_0)2 (tau s + 1))
    """
    s, w, w_c = (2j * np.pi * np.asarray(f, dtype=float), *(2.0 * math.pi * p[n] for n in ("frequency", "corner")))
    A, B, tau = servo(p)
    K = (A * (s + 0.25 * w_c) + B) * s / ((s + 0.25 * w_c) ** 2 * (tau * s + 1.0))
    return -K * g / ((1.0 + K) * s * s + 2.0 * p["damping"] * w * s + w * w)


def leans(p: Mapping[str, float], person: float, g: float, f: float) -> float:
    """Return the amplitude of the tilt (rad) by a person who walks on the block with the frequency f (Hz)."""
    w = 2.0 * math.pi * p["rock_frequency"]
    s = 2j * math.pi * f
    return float(
        p["floor"] * person * g * p["reach"] / p["inertia"] / abs(s * s + 2.0 * p["rock_damping"] * w * s + w * w)
    )


def noise(f: Array, run: Mapping[str, Any], axis: int) -> Array:
    """Return the one-sided density, (m/s2)2/Hz, of the ground's noise along an axis; part `ground_motion`."""
    total = np.zeros_like(f)
    for peak in ("seismic", "local"):
        rms = float(run.get(f"site.{peak}_{'enu'[axis]}", 0.0))
        f_0, d = (float(run.get(f"site.{peak}_{n}", x)) for n, x in (("frequency", 1.0), ("damping", 0.3)))
        total += rms**2 * (4.0 * d * f_0 / math.pi) * f**2 / ((f_0**2 - f**2) ** 2 + (2.0 * d * f_0 * f) ** 2)
    return total


def expected(run: Mapping[str, Any], p: Mapping[str, float] | None, axis: int) -> float:
    """Return the rms (m/s2) of the ground's noise along an axis, behind a foundation where p is given."""
    f = np.geomspace(1e-5, 2e3, 40_000)
    density = noise(f, run, axis) * (1.0 if p is None else np.abs(along(f, p)) ** 2)
    return math.sqrt(float(np.trapezoid(density * f, np.log(f))))


def parameters(run: Mapping[str, Any]) -> dict[str, float]:
    """Return what of the run belongs to its foundation."""
    return {n.removeprefix("foundation."): v for n, v in run.items() if n.startswith("foundation.")}


def tables(record: Record, g: float) -> list[Table]:
    """Return what a foundation leaves: of the source's motions and a person, and of the noise of this run."""
    run = record.run.parameters
    p = parameters(run)
    if "rock_frequency" not in p:
        return []
    rows: list[list[Any]] = []
    for name, period, size, unit in MOTIONS:
        f = 1.0 / period
        factor = abs(mount(f, p["rock_frequency"], p["rock_damping"]) if unit == "″" else along(f, p))
        rows.append([name, period, size, float(factor), size * float(factor), unit])
    walker = p["person"] or PERSON
    size = leans(p, walker, g, 1.0 / p["period"]) / ARCSEC
    rows.append(
        [f"person of {walker:g} kg, walking {p['reach']:g} m from the middle", p["period"], None, None, size, "″"]
    )
    caption = (
        "Motions of Hu 1981, section 5.6 (the tilts: an arc second, and a tenth), times the transmissibility of this "
        f"foundation; of the person's weight {100.0 * p['floor']:g} % reach the block."
    )
    head = ["motion", "period / s", "ground", "factor", "table", "unit"]
    return [Table("foundation", "What the foundation leaves", caption, head, rows), *_measured(record, p, run)]


def _measured(record: Record, p: Mapping[str, float], run: Mapping[str, Any]) -> list[Table]:
    """Return rms of the noise in the channels beside that of the ground's spectrum and the transmissibility."""
    c, rows = record.channels, []
    if "site.local_e" not in run:
        return []
    for axis, name in enumerate(("east", "north", "up")):
        columns = (f"site.a[{axis + 1}]", f"foundation.a_block[{axis + 1}]")
        if any(n not in c for n in columns) or expected(run, None, axis) == 0.0:
            continue
        below, above = (float(np.std(c[n])) for n in columns)
        of_theory = [expected(run, q, axis) for q in (None, p)]
        rows.append([name, *(x / G0 * 1e6 for x in (below, of_theory[0], above, of_theory[1])), above / below])
    if not rows:
        return []
    caption = (
        "Standard deviations of the accelerations, in the channels of this run and by spectrum and transmissibility. "
        "In the channels, not in the spectrum: how an active foundation follows a lean of the ground or by a person."
    )
    head = ["axis", "ground / µg", "by spectrum / µg", "table / µg", "by spectrum / µg", "ratio"]
    return [Table("foundation.run", "Noise of the ground in this run", caption, head, rows)]
