"""Hu 1981, chapters 1 to 4: gyros, drift tests, reduction."""

from __future__ import annotations

import math
from pathlib import Path

from example import Example

from gyrobench import drift, units
from gyrobench.reduction.estimation.repeatability import statistics
from gyrobench.system.system import load_system

#: Table 3-1: seven days; printed mean; printed sigma, about it
DAYS = {
    "k_x": ((108000, 108060, 108060, 108060, 108050, 108020, 108010), 108037, 26.3),
    "k_y": ((104000, 103940, 104030, 104150, 104150, 104000, 103980), 104036, 82.6),
    "R_x": ((-802, -806, -804, -800, -800, -801, -806), -803, 2.6),
    "u_x": ((-12604, -12621, -12624, -12613, -12612, -12604, -12608), -12612, 7.9),
    "u_zx": ((11078, 11073, 11071, 11070, 11068, 11071, 11069), 11071, 3.3),
    "R_y": ((5830, 5831, 5832, 5836, 5836, 5832, 5837), 5833, 2.9),
    "u_y": ((-7734, -7731, -7720, -7724, -7720, -7721, -7726), -7725, 5.2),
    "u_zy": ((11074, 11081, 11066, 11101, 11036, 11088, 11080), 11075, 19.1),
}
BOOK = Path(__file__).parents[2] / "systems" / "torquer_scale_factor" / "book_table.csv"
#: current (mA), printed linearity (%)
LINEARITY = ((1, "0.08"), (5, "0.01"), (10, "-0.03"), (20, "-0.06"), (40, "0.01"), (60, "0.01"), (80, "-0.01"),
             (100, "0"))  # fmt: skip
#: r / log2 r as printed for r = 2 .. 10
RADIX = ("2.00", "1.88", "2.00", "2.15", "2.31", "2.49", "2.67", "2.82", "3.01")


def introduction() -> list[Example]:
    """A floated gyro of H = 2e6 g.cm2/s and 250 g that drifts by a thousandth of the Earth's rate."""
    H, rate, mass = 0.2, units.factor("mERU"), 0.25
    per_metre = drift.from_physical(H, mass, {"l_I": 1.0})["D_S"] * 980.0 / 980.665  # the source's g, 980 cm/s2
    place = "chapter 1, example"
    return [
        Example(place, "1 meru", "0.01541", "°/h", "`units.convert`",
                units.convert(1.0, "mERU", "deg/h"), "E1", "0.015041"),
        Example(place, "torque H ω_d of 1 meru", "0.145", "dyn·cm", "`units.factor`", H * rate * 1e7),
        Example(place, "offset l of the mass for 1 meru", "≈6e-7", "cm", "`drift.from_physical`",
                rate / per_metre * 100.0),
    ]  # fmt: skip


def eight_positions() -> list[Example]:
    """Means and standard deviations of Table 3-1; the third u_zy read as 11066."""
    rows = []
    by = "`repeatability.statistics`"
    for name, (values, mean, sigma) in DAYS.items():
        erratum = "E19" if name == "u_zy" else ""
        rows.append(
            Example("Table 3-1", f"mean of {name}", str(mean), "relative", by, statistics(values).mean, erratum)
        )
        found = statistics(values, about=float(mean)).sigma
        odd = "no reading of the rows gives it (E19)" if name in ("u_y", "u_zy") else ""
        rows.append(Example("Table 3-1", f"σ of {name}", str(sigma), "relative", by, found, why=odd))
    return rows


def torquer() -> list[Example]:
    """The table after A3-6, through the system that reduces such a file."""
    system = load_system("torquer_scale_factor")
    result = system.reduce(system.read_measured(BOOK, {}))
    by = "`gyrobench reduce torquer_scale_factor`"
    mean = next(c.estimate for c in result.coefficients if c.name == "K")
    rows = [Example("A3-6, table", "mean scale factor K", "17.171", "°/h/mA", by, mean)]
    for (current, printed), row in zip(LINEARITY, result.tables[0].rows, strict=True):
        odd = ("E49", "-0.01") if current == 5 else ("", "")
        found = 0.0 if abs(row[5]) < 1e-9 else row[5]
        rows.append(Example("A3-6, table", f"linearity at {current} mA", printed, "%", by, found, *odd))
    return rows


def transform() -> list[Example]:
    """Operations of a fast transform by its radix."""
    rows = []
    for r, printed in enumerate(RADIX, 2):
        found = r / math.log2(r)
        right = {3: "1.89", 6: "2.32", 9: "2.84"}.get(r, "")
        rows.append(Example("4.2, table", f"r/log₂r for r = {r}", printed, "1", "arithmetic", found,
                            "ER20" if right else "", right))  # fmt: skip
    return rows


def readings() -> list[Example]:
    """What is a result without its data."""
    why = "the currents that it comes from are not printed"
    return [Example("Table 3-2", "ten coefficients of three tumbles", "30 numbers", "–", "–", math.nan, why=why)]


def examples() -> list[Example]:
    """Return the worked numbers of these chapters, in order."""
    return [*introduction(), *eight_positions(), *torquer(), *transform(), *readings()]
