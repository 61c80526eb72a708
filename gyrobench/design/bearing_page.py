"""The page of a designed bearing: figures of merit, general curves, load and stiffness, values for the part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.bench import Bench
from gyrobench.design.aerostatic import flow_function
from gyrobench.design.bearing_design import FULL, UNITS, BearingDesign, rows
from gyrobench.files import write_whole
from gyrobench.report import FORMATS
from gyrobench.report.page_model import (
    BulletList,
    Page,
    PageTable,
    Picture,
    Row,
    Section,
    Text,
    columns,
    document_id,
    pictures,
    text_cell,
)
from gyrobench.report.report_files import write_files
from gyrobench.report.style import BLUE, HALF, MUTED, VERMILION, axis_label, chart, styled, svg
from gyrobench.units import display

NAMES = {kind: f"bearing.{kind}" for kind in FORMATS}
SIGMAS = (0.1, 0.2, 0.3, 0.5, 0.7)
METHOD = (
    "Orifice and gap pass the same mass: (B² − s²)/(s ψ(B)) = 12 μ n l Φ A/(π R h³ √(p_a ρ_a)), B = p_d/p_0, "
    "s = p_a/p_0, ψ choked below 0.528. The pressures under the shaft, each orifice with its own gap "
    "h = h_0 (1 − ε cos α), carry the load. Against tilt, with rows a quarter of the length from the ends, K_w L²/16. "
    "Flow round the circumference, the thrust bearing and pneumatic hammer are left out."
)
LEFT = 0.1  # end of the axis of the restriction


def write_bearing(design: BearingDesign, folder: Path) -> dict[str, Path]:
    """Write bearing.json, bearing.html, bearing.pdf and bearing.toml; return the path of each."""
    written = write_files(design.as_dict(), lambda: page(design), folder, FORMATS, NAMES, Bench.find().folder)
    values = folder / "bearing.toml"
    write_whole(values, design.toml().encode())
    return {**written, "toml": values}


def page(d: BearingDesign) -> Page:
    """Return the page."""
    report_id = document_id(d.as_dict())
    given = [Row([text_cell(n), text_cell(f"{getattr(d.bearing, n):.6g} {display(u) if u != '1' else ''}".rstrip())])
             for n, u in UNITS.items()]  # fmt: skip
    found = [Row([text_cell(n), text_cell(v, "strong")]) for n, v in rows(d)]
    warned = [BulletList(list(d.bearing.warnings()), warn=True)] if d.bearing.warnings() else []
    with styled():
        sections = [
            Section("Result", "result", [PageTable(columns("figure", "", wide=[""]), found, "The bearing."), *warned]),
            Section("Load and stiffness", "curves", _curves(d)),
            Section("Bearing", "bearing", [PageTable(columns("value", "", wide=[""]), given, "What it is made of.")]),
            Section("Values for the part", "values", [
                Text("bearing.toml has the journal for the part bearing_air, and so for its FMU:"),
                Text("gyrobench run table_servo_loop --set @bearing.toml"),
            ]),
            Section("Method", "method", [
                Text(METHOD),
                Text("Hu 1981, eq. 5-22 to 5-30, 5-33.", quiet=True),
            ]),
        ]  # fmt: skip
    head = [("Report", report_id), ("Bearing", f"{d.bearing.diameter * 1e3:g} mm x {d.bearing.length * 1e3:g} mm")]
    return Page("Aerostatic bearing", report_id, head, sections, what="Bearing").finish()


def _curves(d: BearingDesign) -> list[Any]:
    return [
        *pictures(
            Picture("general", general(d), "Pressure behind an orifice over the restriction; marked: this bearing.",
                    "general curves of orifice bearings", half=True),
            Picture("load", load_curve(d), "Load over eccentricity; marked: the load asked for.",
                    "load over eccentricity", half=True),
        ),
        *pictures(
            Picture("stiffness", stiffness_curve(d), "Stiffness of the centred shaft; marked: this bearing.",
                    "stiffness over gap", half=True),
            Picture("slope", slope_curve(d), "Stiffness over eccentricity.", "stiffness over eccentricity", half=True),
        ),
    ]  # fmt: skip


def restriction(beta: float, sigma: float) -> float:
    """Return xi = (B2 - s2)/(s psi(B)), the general equation (5-26)."""
    return (beta * beta - sigma * sigma) / (sigma * flow_function(beta))


def general(d: BearingDesign) -> str:
    """Return B over xi for several s (Hu 1981, fig. 5-23)."""
    (fig, ax), b = chart(HALF, 70), d.bearing
    own = b.ambient / b.supply
    for s in [own, *(s for s in SIGMAS if abs(s - own) > 0.04)]:
        beta = np.linspace(s + 1e-4, 1.0 - 1e-4, 200)
        look: dict[str, Any] = {"color": BLUE, "linewidth": 1.6, "zorder": 3} if s == own else {"color": MUTED}
        ax.semilogx([restriction(x, s) for x in beta], beta, **look)
        start = float(np.interp(LEFT, [restriction(x, s) for x in beta], beta))
        ax.annotate(f"s = {s:.3g}", (LEFT, start), xytext=(2, 9), textcoords="offset points", fontsize=7)
    beta_0 = b.pressure_ratio(b.gap)
    ax.plot([restriction(beta_0, own)], [beta_0], "o", color=VERMILION, zorder=4)
    ax.set_xlim(LEFT, 300.0)
    return _drawn(fig, ax, "general", ("restriction ξ", "1"), ("pressure ratio B", "1"), (0.1, 1, 10, 100))


def load_curve(d: BearingDesign) -> str:
    """Return W over eps (Hu 1981, fig. 5-24)."""
    fig, ax = chart(HALF, 70)
    eps = np.linspace(0.0, FULL, 37)
    ax.plot(eps, [d.bearing.load(float(e)) for e in eps], color=BLUE)
    ax.plot([d.eccentricity], [d.load], "o", color=VERMILION)
    return _drawn(fig, ax, "load", ("eccentricity ε", "1"), ("load W", "N"))


def stiffness_curve(d: BearingDesign) -> str:
    """Return K_w of the centred shaft over the gap."""
    fig, ax = chart(HALF, 70)
    gaps = np.geomspace(3e-6, 1e-4, 41)
    ax.semilogx(gaps * 1e6, [replace(d.bearing, gap=float(h)).stiffness() * 1e-6 for h in gaps], color=BLUE)
    ax.plot([d.bearing.gap * 1e6], [d.bearing.stiffness() * 1e-6], "o", color=VERMILION)
    return _drawn(fig, ax, "stiffness", ("gap", "µm"), ("stiffness", "N/µm"), (3, 5, 10, 20, 50, 100))


def slope_curve(d: BearingDesign) -> str:
    """Return dW/de over eps."""
    (fig, ax), b, step = chart(HALF, 70), d.bearing, 1e-3
    eps = np.linspace(0.0, FULL - step, 37)
    slope = [(b.load(float(e) + step) - b.load(float(e))) / (step * b.gap) * 1e-6 for e in eps]
    ax.plot(eps, slope, color=BLUE)
    return _drawn(fig, ax, "slope", ("eccentricity ε", "1"), ("stiffness dW/de", "N/µm"))


def _drawn(fig: Any, ax: Any, name: str, x: tuple[str, str], y: tuple[str, str], ticks: Sequence[float] = ()) -> str:
    """Return the SVG of a curve; x, y: quantity and unit of the axes; ticks: of a logarithmic one."""
    if ticks:
        ax.set_xticks(ticks, [str(t) for t in ticks])
        ax.set_xticks([], minor=True)
    ax.set_xlabel(axis_label(*x))
    ax.set_ylabel(axis_label(*y))
    return svg(fig, name)
