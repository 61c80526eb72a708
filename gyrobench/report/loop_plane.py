"""Frames of Nyquist and Nichols plots: the critical point, disks that L must not enter, axes, legend."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gyrobench.record.frequency_response import Complex
from gyrobench.report.style import INK, SHADE, axis_label, svg, zero_line

Disk = tuple[str, float, str]  # label, disk margin, colour
CRITICAL: dict[str, Any] = {"color": INK, "markersize": 7, "markeredgewidth": 1.2, "zorder": 6}


def disk(margin: float) -> Complex:
    """Return the circle in the plane of L on which |S - 1/2| = 1/margin; L must stay outside."""
    far, near = -(2.0 + margin) / (2.0 - margin), -(2.0 - margin) / (2.0 + margin)
    return np.asarray(0.5 * (far + near) + 0.5 * (near - far) * np.exp(2j * np.pi * np.linspace(0.0, 1.0, 361)))


def _within(ax: Any) -> None:
    """Let markers at an edge be whole, and those beyond it not be drawn."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    for line in ax.lines:
        if line.get_linestyle() == "None" and line.get_zorder() < CRITICAL["zorder"]:
            x, y = line.get_data()
            pick = (x >= left) & (x <= right) & (y >= low) & (y <= high)
            line.set(data=(x[pick], y[pick]), clip_on=False)


def nyquist(fig: Any, ax: Any, disks: Sequence[Disk]) -> str:
    """Return the figure whose axes show L near the critical point, with what it must not enter."""
    for label, margin, colour in disks:
        ring = disk(margin)
        ax.fill(ring.real, ring.imag, color=SHADE, zorder=0)
        ax.plot(ring.real, ring.imag, "--", color=colour, linewidth=1.0, label=label)
    ax.plot([-1.0], [0.0], "+", **CRITICAL)
    zero_line(ax)
    ax.set(xlim=(-3.2, 1.2), ylim=(-2.4, 2.4), xlabel="Re L", ylabel="Im L", aspect="equal")
    _within(ax)
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper left", ncols=2, handlelength=1.6)
    return svg(fig, "nyquist")


def nichols(fig: Any, ax: Any, disks: Sequence[Disk]) -> str:
    """Return the figure whose axes show gain over phase of L, the disks in these coordinates."""
    for label, margin, colour in disks:
        ring = disk(margin)
        x, y = np.degrees(np.unwrap(np.angle(-ring))) - 180.0, 20.0 * np.log10(np.abs(ring))
        ax.fill(x, y, color=SHADE, zorder=0)
        ax.plot(x, y, "--", color=colour, linewidth=1.0, label=label)
    ax.plot([-180.0], [0.0], "+", **CRITICAL)
    zero_line(ax)
    ax.set(xlabel=axis_label("phase of L", "°"), ylabel=axis_label("|L|", "dB"), ylim=(-40.0, 40.0), xlim=(-360.0, 0.0))
    ax.set_xticks([-360, -270, -180, -90, 0])
    _within(ax)
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper left", ncols=2, handlelength=1.6)
    return svg(fig, "nichols")
