"""Heading after minutes by the data sheets of rate gyros, at 45 degrees of latitude:

    python reports/heading_after.py [--write]

Closed forms of systems/north_finder/after.py with the figures as printed: random walk, bias instability, bias.  Prints
the table; --write: into docs/heading_after_minutes.md, and the figure reports/gallery/heading_after.svg.
"""

from __future__ import annotations

import math
import sys
from dataclasses import dataclass
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("svg")
import matplotlib.pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[1]))
from gyrobench import units
from gyrobench.bench import Bench, standard_folder
from gyrobench.units import DEG, DPH
from gyrobench.workflow.instruments import Instrument, find_instrument
from gyrobench.workflow.sheet_values import FLOOR
from reports.gallery import save
from systems.north_finder.after import RandomErrors, heading, in_words, position, reached_after, running

PAGE = standard_folder() / "docs" / "heading_after_minutes.md"
PICTURE = standard_folder() / "reports" / "gallery" / "heading_after.svg"
LATITUDE, MINUTES, GOAL = 45.0 * DEG, 5.0, 1.0 * DEG
GRAVITY = 9.806  # m/s2, at 45 degrees
NORTH = units.EARTH_RATE * math.cos(LATITUDE)
MOST = 0.5  # rad, beyond which a standard deviation of a heading says nothing
COLOURS = {"laser": "#1b6ca8", "fibre": "#c2571a", "vibrating": "#3b7d3a"}


@dataclass(frozen=True)
class Sheet:
    """A data sheet, its random errors, and which of them it states."""

    name: str
    printed: Instrument
    errors: RandomErrors
    bias: bool
    floor: bool

    @classmethod
    def of(cls, name: str) -> Sheet | None:
        """Return a sheet of a rate gyro that states its white noise; None of others."""
        sheet = find_instrument(name)
        if sheet.density is None:
            return None
        bias, limit, floor = sheet.si("bias"), sheet.limit("bias"), sheet.si("bias_instability")
        size = bias or (limit or 0.0) / math.sqrt(3.0)  # of a limit what one believes
        errors = RandomErrors(sheet.density, size, (floor or 0.0) / FLOOR)
        return cls(name, sheet, errors, size > 0.0, floor is not None)

    def after(self, minutes: float, two: bool) -> float:
        """Return the standard deviation of the heading, rad."""
        return heading(self.errors, LATITUDE, 60.0 * minutes, two=two)

    def stated_bias(self) -> str:
        """Return the cell of the bias: rms at switch-on, or the limit that the sheet gives."""
        limit = self.printed.limit("bias")
        if limit is not None:
            return f"≤ {plain(limit / DPH)}"
        return plain(self.errors.bias / DPH) if self.bias else "–"

    def row(self) -> list[str]:
        """Return the cells of the table."""
        one, two = (self.after(MINUTES, both) for both in (False, True))
        time = reached_after(self.errors, LATITUDE, GOAL)
        drift = RandomErrors(self.errors.white, 0.0, self.errors.flicker)
        growth = running(drift, 0.0, 60.0 * MINUTES, 600.0, LATITUDE)
        far = position(drift, None, GRAVITY, 60.0 * MINUTES, 600.0)
        metres = f"{'' if self.floor else '≥ '}{plain(float(f'{far:.2g}'))}"
        alone = "lost" if self.errors.bias > NORTH else degrees(one, at_best=not self.bias)
        words = in_words(time)
        if time and not self.floor:
            words = words.replace("after", "not before")
        return [
            self.name, f"{self.errors.white / DEG * 60.0:.3g}",
            f"{self.errors.flicker * FLOOR / DPH:.3g}" if self.floor else "–",
            self.stated_bias(), alone, degrees(two, at_best=not self.floor),
            words, degrees(growth, at_best=not self.floor), metres,
        ]  # fmt: skip


def degrees(x: float, *, at_best: bool = False) -> str:
    """Return an angle of the table; at_best: a figure that counts is not on the sheet."""
    return "none" if x > MOST else f"{'≥ ' if at_best else ''}{x / DEG:.2g}"


def plain(x: float) -> str:
    """Return a number of three digits or more, without an exponent."""
    return f"{x:.0f}" if x >= 1000.0 else f"{x:.3g}"


def sheets() -> list[Sheet]:
    """Return the sheets of rate gyros, the least heading after the time first."""
    found = [s for n in Bench(standard_folder()).instruments() if (s := Sheet.of(n))]
    return sorted(found, key=lambda s: s.after(MINUTES, True))


def verdicts(every: list[Sheet]) -> list[str]:
    """Return which sheets reach the goal, by the figures that they state."""

    def named(chosen: list[Sheet]) -> str:
        return ", ".join(s.name for s in chosen) or "none"

    two = [s for s in every if s.after(MINUTES, True) <= GOAL]
    rest = [s for s in every if s not in two]
    later = [s for s in rest if s.floor and reached_after(s.errors, LATITUDE, GOAL)]
    never = [s for s in rest if s.floor and s not in later]
    open_ones = [s for s in rest if not s.floor]
    one = [s for s in every if s.bias and s.after(MINUTES, False) <= GOAL]
    lost = [s for s in every if s.errors.bias > NORTH]
    goal = f"{GOAL / DEG:g}°"
    return [
        f"- {goal} after {MINUTES:g} min in two positions: {named(two)}. Later: {named(later)}. Never, in a day, by "
        f"the bias instability: {named(never)}. Not in {MINUTES:g} min, and later only as far as an instability that "
        f"the sheet does not print lets them: {named(open_ones)}.",
        f"- {goal} after {MINUTES:g} min in one position, of those that state a bias: {named(one)}.",
        f"- No heading at all in one position, a bias above the horizontal Earth rate of {NORTH / DPH:.2f} °/h: "
        f"{named(lost)}.",
    ]


def table(every: list[Sheet]) -> list[str]:
    """Return the lines of the page that are made."""
    head = [
        "sheet", "N / (°/√h)", "instability / (°/h)", "bias / (°/h)", f"one position, {MINUTES:g} min / °",
        f"two positions, {MINUTES:g} min / °", f"{GOAL / DEG:g}° in two positions", "growth in 10 min / °",
        "position in 10 min / m",
    ]  # fmt: skip
    lines = [head, ["---"] * len(head), *(s.row() for s in every)]
    return [*verdicts(every), "", *(f"| {' | '.join(cells)} |" for cells in lines)]


def draw(every: list[Sheet]) -> None:
    """Write the figure."""
    minutes = np.geomspace(0.1, 120.0, 60)
    figure, axes = plt.subplots(1, 2, figsize=(11, 4.6), sharey=True, layout="constrained")
    for axis, two in zip(axes, (False, True), strict=True):
        shown, ends = [s for s in every if two or s.bias], []
        for s in shown:
            sigma = np.array([s.after(float(m), two) for m in minutes]) / DEG
            sigma[sigma > MOST / DEG] = math.nan
            colour = COLOURS[s.printed.kind]
            axis.loglog(minutes, sigma, "-" if s.floor or not two else "--", color=colour, linewidth=1.1)
            if np.isfinite(sigma[-1]):
                ends.append((float(sigma[-1]), s.name, colour))
        low = 0.0
        for y, name, colour in sorted(ends):
            low = max(y, 1.27 * low)  # one label above the other
            axis.annotate(name, (120.0, y), (140.0, low), fontsize=6.5, color=colour, va="center",
                          arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.4})  # fmt: skip
        axis.axhline(GOAL / DEG, color="0.5", linewidth=0.6)
        axis.axvline(MINUTES, color="0.5", linewidth=0.6)
        axis.set_title("one position: the bias stays" if not two else "two positions: the bias goes out", fontsize=10)
        axis.set_xlabel("time of readings / min")
        axis.set_xlim(0.1, 400.0)
        axis.grid(True, which="major", linewidth=0.4, alpha=0.5)
    axes[0].set_ylabel(f"standard deviation of the heading at {LATITUDE / DEG:g}° / °")
    keys = [plt.Line2D([], [], color=c, label=k) for k, c in COLOURS.items()]
    keys.append(plt.Line2D([], [], color="0.3", linestyle="--", label="bias instability not stated"))
    figure.legend(handles=keys, loc="outside lower center", ncols=4, fontsize=8, frameon=False)
    save(figure, PICTURE, "heading")


def main() -> None:
    every = sheets()
    made = "\n".join(table(every))
    print(made)
    if "--write" in sys.argv:
        before, _, _ = PAGE.read_text(encoding="utf-8").partition("<!-- table -->")
        PAGE.write_text(f"{before}<!-- table -->\n{made}\n", encoding="utf-8")
        draw(every)


if __name__ == "__main__":
    main()
