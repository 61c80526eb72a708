"""Figures of an identified loop: L, S and T, the plant, Nichols, Nyquist, the lines of nonlinearity."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from gyrobench.arrays import Array
from gyrobench.identification.identification import LoopIdentification
from gyrobench.identification.ratios import MeasuredResponse
from gyrobench.report import loop_plane
from gyrobench.report.style import BLUE, GREEN, HALF, MUTED, VERMILION, WIDE, axis_label, chart, figure, svg, zero_line

LINE: dict[str, Any] = {"color": BLUE, "linewidth": 1.2, "zorder": 3}
DOTS: dict[str, Any] = {"color": BLUE, "marker": "o", "linestyle": "", "markersize": 2.2, "zorder": 4}
BAND: dict[str, Any] = {"color": BLUE, "alpha": 0.25, "linewidth": 0, "zorder": 1}
FULL = 120  # points, up to which each has a bar of its own
LOWEST = 1e-12


def decibel(x: Array) -> Array:
    """Return gains in dB."""
    return np.asarray(20.0 * np.log10(np.maximum(x, LOWEST)))


def open_loop(t: LoopIdentification) -> str:
    """Return gain and phase of L over frequency, points with intervals and the curve through them."""
    fig, axes = figure(WIDE * 0.8, 96, nrows=2, sharex=True)
    g = t.responses["L"]
    turn = _bode(axes, g, _known(t))
    size, phase, f = decibel(np.abs(t.curve.L)), np.degrees(np.unwrap(np.angle(t.curve.L))), t.curve.f
    near = np.interp(f, g.f[_known(t)], turn)
    phase = phase + 360.0 * np.round(np.median((near - phase) / 360.0)) if f.size else phase
    size, phase = (np.where(t.curve.sound, x, np.nan) for x in (size, phase))
    axes[0, 0].semilogx(f, size, color=VERMILION, linewidth=0.9, zorder=5, label="curve through the points")
    axes[1, 0].semilogx(f, phase, color=VERMILION, linewidth=0.9, zorder=5)
    _about_limits(axes)
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2, handlelength=1.6)
    return svg(fig, "open-loop")


def plant(t: LoopIdentification) -> str:
    """Return gain and phase of the plant over frequency."""
    fig, axes = figure(WIDE * 0.8, 96, nrows=2, sharex=True)
    unit, factor = t.plant_unit
    turn = _bode(axes, t.responses["P"], t.responses["P"].determined, factor)
    if t.fit is not None:
        size, phase = decibel(factor * np.abs(t.fit.value)), np.degrees(np.unwrap(np.angle(t.fit.value)))
        measured = np.interp(t.fit.f, t.f[t.responses["P"].determined], turn)
        phase = phase + 360.0 * np.round(np.median((measured - phase) / 360.0))
        for ax, y in zip(axes[:, 0], (size, phase), strict=True):
            ax.semilogx(
                t.fit.f, y, color=VERMILION, linewidth=1.0, zorder=5, label="model" if ax is axes[0, 0] else None
            )
        fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2, handlelength=1.6)
    axes[0, 0].set_ylabel(f"|P| / dB re {unit}")
    axes[1, 0].set_xlabel(axis_label("frequency", "Hz"))
    return svg(fig, "plant")


def _known(t: LoopIdentification) -> NDArray[np.bool_]:
    return t.responses["L"].determined


def _bode(axes: Any, g: MeasuredResponse, which: NDArray[np.bool_], factor: float = 1.0) -> Array:
    """Draw points with intervals; return their phase, unwrapped, degrees."""
    f, value = g.f[which], g.value[which]
    low, high = (decibel(factor * x[which]) for x in g.gain())
    below, above = (np.degrees(x[which]) for x in g.phase())
    size, turn = decibel(factor * np.abs(value)), np.degrees(np.unwrap(np.angle(value)))
    if f.size:
        turn = turn - 360.0 * np.ceil(turn[int(np.argmin(np.abs(size)))] / 360.0)
    for ax, y, a, b in ((axes[0, 0], size, low, high), (axes[1, 0], turn, turn + below, turn + above)):
        ax.semilogx(f, y, **DOTS, label="measured, 95 %" if ax is axes[0, 0] else None)
        if f.size <= FULL:
            ax.vlines(f, a, b, color=BLUE, linewidth=0.9, zorder=2)
        else:
            ax.fill_between(f, a, b, **BAND)
    axes[0, 0].set_ylim(max(-100.0, float(size.min(initial=0.0)) - 10.0), float(size.max(initial=0.0)) + 10.0)
    axes[1, 0].set_ylim(float(turn.min(initial=0.0)) - 30.0, float(turn.max(initial=0.0)) + 30.0)
    axes[0, 0].set_ylabel(axis_label("|L|", "dB"))
    axes[1, 0].set(ylabel=axis_label("phase", "°"), xlabel=axis_label("frequency", "Hz"))
    return np.asarray(turn)


def _about_limits(axes: Any) -> None:
    zero_line(axes[0, 0])
    axes[1, 0].axhline(-180.0, color=MUTED, linewidth=0.8, zorder=1)


def sensitivities(t: LoopIdentification) -> str:
    """Return |S| and |T| over frequency, with intervals."""
    fig, axes = figure(WIDE * 0.8, 92, nrows=2, sharex=True)
    for ax, name, dense in ((axes[0, 0], "S", t.curve.S), (axes[1, 0], "T", 1.0 - t.curve.S)):
        g = t.responses[name]
        which = g.determined
        low, high = (decibel(x[which]) for x in g.gain())
        ax.semilogx(g.f[which], decibel(np.abs(g.value[which])), **DOTS, label="measured, 95 %")
        if int(which.sum()) <= FULL:
            ax.vlines(g.f[which], low, high, color=BLUE, linewidth=0.9, zorder=2)
        else:
            ax.fill_between(g.f[which], low, high, **BAND)
        seen = np.where(t.curve.sound, decibel(np.abs(dense)), np.nan)
        ax.semilogx(t.curve.f, seen, color=VERMILION, linewidth=0.9, zorder=5, label="curve through the points")
        zero_line(ax)
        ax.set_ylabel(axis_label(f"|{name}|", "dB"))
        bottom = float(decibel(np.abs(g.value[which])).min(initial=0.0))
        ax.set_ylim(max(-80.0, bottom - 5.0), max(6.0, float(decibel(np.abs(dense)).max(initial=0.0)) + 4.0))
    axes[1, 0].set_xlabel(axis_label("frequency", "Hz"))
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=2, handlelength=1.6)
    return svg(fig, "sensitivities")


def _disks(t: LoopIdentification) -> list[loop_plane.Disk]:
    return [("disk margin", m.value, GREEN) for m in t.margins if m.name == "disk margin" and 0.0 < m.value < 1.99]


def nyquist(t: LoopIdentification) -> str:
    """Return L near the critical point, with the circles that hold 95 % of each point's gain and phase."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle

    fig, ax = chart(HALF, 78)
    g = t.responses["L"]
    which = _known(t) & (np.abs(g.value) < 8.0)
    circles = [Circle((c.real, c.imag), r) for c, r in zip(g.center[which], g.radius[which], strict=True)]
    ax.add_collection(PatchCollection(circles, facecolor=BLUE, alpha=0.18, linewidth=0, zorder=1))
    ax.plot(g.value.real[which], g.value.imag[which], **DOTS, label="measured, 95 %")
    seen = np.where(t.curve.sound, t.curve.L, np.nan)
    ax.plot(seen.real, seen.imag, color=VERMILION, linewidth=0.9, zorder=5, label="curve")
    return loop_plane.nyquist(fig, ax, _disks(t))


def nichols(t: LoopIdentification) -> str:
    """Return gain over phase of L."""
    fig, ax = chart(HALF, 78)
    g = t.responses["L"]
    for value, style in ((g.value[_known(t)], {**DOTS, "label": "measured"}),
                         (t.curve.L, {"color": VERMILION, "linewidth": 0.9, "label": "curve"})):  # fmt: skip
        size, turn = decibel(np.abs(value)), np.degrees(np.unwrap(np.angle(value)))
        if size.size:
            turn = turn - 360.0 * np.ceil(turn[int(np.argmin(np.abs(size)))] / 360.0)
        ax.plot(turn, size, **style)
    return loop_plane.nichols(fig, ax, _disks(t))


def distortion(t: LoopIdentification) -> str:
    """Return the output's amplitude at excited lines and at those that are left out; "" where there are none."""
    if not t.distortions:
        return ""
    fig, ax = chart(WIDE * 0.8, 62)
    unit = t.record.shown["output"]
    from gyrobench import units

    factor = units.unit(unit).factor
    excited = t.excited_output
    ax.loglog(t.f, np.maximum(excited, LOWEST) / factor, **DOTS, label="excited")
    for d, marker, colour in zip(t.distortions, "^v", (VERMILION, GREEN), strict=False):
        style = {"marker": marker, "linestyle": "", "markersize": 3.2, "color": colour, "alpha": 0.8}
        ax.loglog(d.f, np.maximum(d.size, LOWEST) / factor, **style, label=f"{d.kind}, left out")
    ax.set(xlabel=axis_label("frequency", "Hz"), ylabel=axis_label("output, amplitude", units.display(unit)))
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper left", ncols=3, handlelength=1.4)
    return svg(fig, "distortion")
