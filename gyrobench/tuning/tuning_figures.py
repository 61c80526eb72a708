"""Figures of a tuned loop: Nichols, Nyquist, open loop, S and T with what is wanted of them, load step."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from gyrobench.arrays import Array
from gyrobench.record.frequency_response import Complex
from gyrobench.report import loop_plane
from gyrobench.report.style import BLUE, GREEN, HALF, MUTED, VERMILION, WIDE, axis_label, chart, figure, svg, zero_line
from gyrobench.tuning.robustness import FLOOR
from gyrobench.tuning.trade import Trade
from gyrobench.tuning.tuned_loop import LoopTuning
from gyrobench.tuning.wishes import JITTER

SPAN = 40.0  # figures over frequency show so much about the crossover
LINE: dict[str, Any] = {"color": BLUE, "linewidth": 1.4, "zorder": 3}
OTHER: dict[str, Any] = {"color": MUTED, "linewidth": 0.5, "alpha": 0.6, "zorder": 2}
DOTS: dict[str, Any] = {"color": VERMILION, "marker": "o", "linestyle": "", "markersize": 3.2, "zorder": 4}


def margin_disks(t: LoopTuning) -> list[tuple[str, float, str]]:
    """Return the disks to show: name, margin, colour."""
    from gyrobench.tuning.robustness import peak

    reached = min(1.0 / peak(t.f, np.abs(1.0 / (1.0 + L) - 0.5)) for L in t.loops)
    wanted = [w.wish.value for w in t.wishes if w.wish.name == "disk margin"]
    shown = [("worst case", reached, GREEN)] if reached < 1.99 else []
    return [*((f"wanted {x:.3g}", x, VERMILION) for x in wanted), *((f"{n} {x:.3g}", x, c) for n, x, c in shown)]


def near(t: LoopTuning) -> tuple[float, float]:
    """Return the range of frequencies that the figures show, Hz."""
    size = np.abs(t.loops[0])
    crossed = t.f[np.flatnonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))]
    middle = float(crossed[-1]) if crossed.size else float(np.sqrt(t.f[0] * t.f[-1]))
    return max(float(t.f[0]), middle / SPAN), min(float(t.f[-1]), middle * SPAN)


def _inside(t: LoopTuning) -> Array:
    low, high = near(t)
    return np.asarray((t.f >= low) & (t.f <= high))


def _named(t: LoopTuning) -> list[loop_plane.Disk]:
    return [(f"disk, {name}", margin, colour) for name, margin, colour in margin_disks(t)]


def nyquist(t: LoopTuning) -> str:
    """Return L near the critical point, with the disks that it must not enter."""
    fig, ax = chart(HALF, 78)
    for k, L in reversed(list(enumerate(t.loops))):
        ax.plot(L.real, L.imag, **(OTHER if k else LINE), label="nominal" if k == 0 else "spread" if k == 1 else None)
    if t.measured:
        at = np.array([p.value for p in t.measured])
        ax.plot(at.real, at.imag, **DOTS, label="co-simulation")
    return loop_plane.nyquist(fig, ax, _named(t))


def nichols(t: LoopTuning) -> str:
    """Return gain over phase of L, the disks in these coordinates."""
    fig, ax = chart(HALF, 78)
    pick = _inside(t)
    for k, L in reversed(list(enumerate(t.loops))):
        size, turn = _polar(L[pick], t.f[pick])
        ax.plot(turn, size, **(OTHER if k else LINE), label="nominal" if k == 0 else "spread" if k == 1 else None)
    if t.measured:
        _, size, turn = _measured(t)
        ax.plot(turn, size, **DOTS, label="co-simulation")
    return loop_plane.nichols(fig, ax, _named(t))


def _measured(t: LoopTuning) -> tuple[Array, Array, Array]:
    """Return frequencies (Hz), |L| (dB) and phase (degrees, near that of the model) of the co-simulation."""
    f, L = np.array([p.f for p in t.measured]), np.array([p.value for p in t.measured])
    turn, there = np.degrees(np.angle(L)), np.interp(f, t.f, _polar(t.loops[0], t.f)[1])
    return f, 20.0 * np.log10(np.abs(L)), turn + 360.0 * np.round((there - turn) / 360.0)


def _polar(L: Complex, f: Array) -> tuple[Array, Array]:
    """Return |L| in dB and the phase in degrees, unwrapped, between -360 and 0 at the crossover."""
    size, turn = 20.0 * np.log10(np.maximum(np.abs(L), 1e-300)), np.degrees(np.unwrap(np.angle(L)))
    at = turn[int(np.argmin(np.abs(size)))]
    return size, turn - 360.0 * math.ceil(at / 360.0)


def open_loop(t: LoopTuning) -> str:
    """Return gain and phase of L over frequency, with the points that the co-simulation measured."""
    fig, axes = figure(WIDE * 0.8, 92, nrows=2, sharex=True)
    pick = _inside(t)
    for k, L in reversed(list(enumerate(t.loops))):
        size, turn = _polar(L, t.f)
        for ax, y in zip(axes[:, 0], (size, turn), strict=True):
            ax.semilogx(t.f[pick], y[pick], **(OTHER if k else LINE), label=_of(k))
    if t.measured:
        f, size, turn = _measured(t)
        axes[0, 0].plot(f, size, **DOTS, label="co-simulation, nominal")
        axes[1, 0].plot(f, turn, **DOTS)
    zero_line(axes[0, 0])
    axes[1, 0].axhline(-180.0, color=MUTED, linewidth=0.8, zorder=1)
    axes[0, 0].set_ylabel(axis_label("|L|", "dB"))
    axes[1, 0].set(ylabel=axis_label("phase", "°"), xlabel=axis_label("frequency", "Hz"), xlim=near(t))
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper left", ncols=3, handlelength=1.6)
    return svg(fig, "open-loop")


def _of(k: int) -> str | None:
    return "nominal" if k == 0 else "spread" if k == 1 else None


def sensitivities(t: LoopTuning) -> str:
    """Return |S| and |T| over frequency with the bounds that the wishes set."""
    fig, axes = figure(WIDE * 0.8, 92, nrows=2, sharex=True)
    pick = _inside(t)
    f = t.f[pick]
    for k, L in reversed(list(enumerate(t.loops))):
        S = 1.0 / (1.0 + L[pick])
        for ax, y in zip(axes[:, 0], (np.abs(S), np.abs(L[pick] * S)), strict=True):
            ax.semilogx(f, 20.0 * np.log10(np.maximum(y, 1e-12)), **(OTHER if k else LINE), label=_of(k))
    top, bottom = axes[:, 0]
    for w in (w.wish for w in t.wishes):
        style: dict[str, Any] = {"color": VERMILION, "linestyle": "--", "linewidth": 1.0}
        if w.name == "bandwidth":
            low = f[f <= w.value]
            bound = np.maximum(low / np.hypot(low, w.value), FLOOR)
            top.plot(low, 20.0 * np.log10(bound), **style, label="wanted")
        elif w.name in ("peak S", "peak T"):
            ax = top if w.name == "peak S" else bottom
            ax.axhline(20.0 * math.log10(w.value), **style, label="wanted")
        elif w.f and w.name != JITTER:
            top.plot([w.f], [20.0 * math.log10(w.value)], "v", color=VERMILION, markersize=6, label="wanted", zorder=5)
    if t.measured:
        at, S = np.array([p.f for p in t.measured]), np.array([1.0 / (1.0 + p.value) for p in t.measured])
        top.plot(at, 20.0 * np.log10(np.abs(S)), **DOTS, label="co-simulation")
        bottom.plot(at, 20.0 * np.log10(np.abs(1.0 - S)), **DOTS)
    for ax, name in ((top, "|S|"), (bottom, "|T|")):
        zero_line(ax)
        ax.set_ylabel(axis_label(name, "dB"))
        ax.set_ylim(max(-90.0, ax.get_ylim()[0]), max(6.0, ax.get_ylim()[1]))
    bottom.set(xlabel=axis_label("frequency", "Hz"), xlim=near(t))
    handles = dict(zip(*reversed(top.get_legend_handles_labels()), strict=True))
    fig.legend(handles.values(), handles.keys(), loc="outside upper left", ncols=4, handlelength=1.6)
    return svg(fig, "sensitivities")


def trade(t: Trade) -> str:
    """Return one wish over the other, and where both are fulfilled."""
    fig, ax = chart(HALF, 78)
    points = [p for p in t.points if math.isfinite(p.first) and math.isfinite(p.second)]
    xy = np.array([[w.printed(v)[0] for w, v in zip(t.wishes, (p.first, p.second), strict=True)] for p in points])
    if len(points):
        ax.plot(*xy.T, **LINE, marker="o", markersize=3.2, label="best that was found")
        bad = np.array([not p.others for p in points])
        ax.plot(*xy[bad].T, **DOTS, label="other wishes not fulfilled" if bad.any() else None)
    for k, (wish, line) in enumerate(zip(t.wishes, (ax.axvline, ax.axhline), strict=True)):
        line(wish.printed(wish.value)[0], color=GREEN, linestyle="--", linewidth=1.0, label="" if k else "wanted")
    names = [axis_label(w.name, w.printed(w.value)[1].strip()) for w in t.wishes]
    ax.set(xlabel=names[0], ylabel=names[1])
    fig.legend(*ax.get_legend_handles_labels(), loc="outside upper left", ncols=2, handlelength=1.8)
    return svg(fig, "trade")


def load_step(t: LoopTuning) -> str:
    """Return the platform's angle after a step of torque in the co-simulation; "" where none is seen."""
    shown = [(p.values, p.step) for p in t.proofs if p.step is not None and p.step.seen]
    if not shown:
        return ""
    fig, ax = chart(WIDE * 0.8, 56)
    styles = LINE, {"color": VERMILION, "linewidth": 1.0, "linestyle": "--", "zorder": 4}
    for (at, step), style in zip(shown, styles, strict=False):
        ax.plot(step.t, 1e6 * step.angle, **style, label="worst point" if at else "nominal")
    zero_line(ax)
    ax.set(xlabel=axis_label("time", "s"), ylabel=axis_label("platform angle", "µrad"))
    if len(shown) > 1 or shown[0][0]:
        fig.legend(*ax.get_legend_handles_labels(), loc="outside upper left", ncols=2, handlelength=1.8)
    return svg(fig, "load-step")
