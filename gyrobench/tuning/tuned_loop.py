"""A tuned loop: its controller as values and as a command, what came of each wish, its proof, and its text."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from gyrobench import units
from gyrobench.arrays import Array
from gyrobench.record.frequency_response import Complex
from gyrobench.reduction.loops.loop_measures import Point
from gyrobench.report.plain_text import align_columns
from gyrobench.tuning.proof import Proof, ProvenWish
from gyrobench.tuning.sight_allowance import COLUMNS, AllowedSource
from gyrobench.tuning.spread import Range
from gyrobench.tuning.structures import Controller, ControllerStructure
from gyrobench.tuning.trade import Trade
from gyrobench.tuning.wishes import Wish

#: what is said of each source of a jitter
ALLOWED = "what each may be at most with this controller and all others as they are"


@dataclass(frozen=True)
class WishResult:
    """worst: over the spread, at the point ``at``; nominal: with all parts as they are."""

    wish: Wish
    nominal: float
    worst: float
    at: Mapping[str, float]

    @property
    def ratio(self) -> float:
        return self.wish.ratio(self.worst)


@dataclass(frozen=True)
class LoopTuning:
    """settings: for --set, beside those that were ``given``; part: in the slot of the stabilizer, "" for its own.

    swaps, maps: parts and mapping files of other slots that were given.

    reasons: why what is wanted cannot be had, else ().  loops: L over f (Hz) at each point of the spread, nominal
    first.  best: the largest worst ratio of got to wanted that was found, from which quietness was bought.
    """

    system: str
    structure: ControllerStructure
    given: Mapping[str, Any]
    part: str
    settings: Mapping[str, Any]
    controller: Controller
    spread: tuple[Range, ...]
    points: tuple[Mapping[str, float], ...]
    wishes: tuple[WishResult, ...]
    proofs: tuple[Proof, ...]
    f: Array = field(repr=False)
    loops: Complex = field(repr=False)
    swaps: Mapping[str, str] = field(default_factory=dict)
    maps: Mapping[str, str] = field(default_factory=dict)
    seconds: float = 0.0
    evaluations: int = 0
    reasons: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    slot: str = "stabilizer"  # of the controller
    loop: str = ""  # name of the loop, of a system with several
    trade: Trade | None = None
    best: float = 0.0
    allowed: tuple[AllowedSource, ...] = ()  # sources of a wanted jitter

    @property
    def name(self) -> str:
        """Return the system, and the loop where it has several."""
        return f"{self.system}, loop {self.loop}" if self.loop else self.system

    @property
    def had(self) -> bool:
        """True where every wish is fulfilled over the whole spread, by the linear model."""
        return all(w.ratio >= 1.0 for w in self.wishes)

    @property
    def proven(self) -> bool:
        """True where it was, and the co-simulation does not contradict."""
        return self.had and bool(self.proofs) and all(p.holds for p in self.proofs)

    @property
    def measured(self) -> tuple[Point, ...]:
        """Return L of the co-simulation at nominal values; none where it was not measured."""
        return self.proofs[0].points if self.proofs and not self.proofs[0].why_not else ()

    @property
    def command(self) -> str:
        """Return the command that runs the system with this controller."""
        parts = {**self.swaps, **({self.slot: self.part} if self.part else {})}
        named = [("part", parts), ("map", self.maps), ("set", {**self.given, **self.settings})]
        words = [f"--{option} {shlex.quote(f'{n}={_text(v)}')}" for option, values in named for n, v in values.items()]
        return " ".join(["gyrobench run", self.system, *words])

    def as_dict(self) -> dict[str, Any]:
        """Return plain JSON values; unlimited margins are null."""
        return {
            "system": self.system,
            "loop": self.loop,
            "structure": self.structure.name,
            "had": self.had,
            "proven": self.proven,
            "controller": {
                "num": list(self.controller.num), "den": list(self.controller.den),
                "values": {k: float(v) for k, v in self.controller.values.items()},
            },
            "settings": {n: _text(v) for n, v in self.settings.items()},
            "part": self.part,
            "command": self.command,
            "wishes": [
                {
                    "name": w.wish.name, "wanted": w.wish.value, "unit": w.wish.unit or "factor",
                    "nominal": _finite(w.nominal), "worst": _finite(w.worst), "at": dict(w.at),
                }
                for w in self.wishes
            ],
            "proofs": [
                {
                    "at": dict(p.values), "holds": p.holds, "why_not": p.why_not, "sines": p.counted,
                    "wishes": [
                        _measured(w)
                        for w in p.wishes
                    ],
                }
                for p in self.proofs
            ],
            "sources": [
                {
                    "name": a.source, "jitter": a.jitter * 1e-6, "factor": _finite(a.factor or math.nan),
                    "quantity": a.set_by.name, "now": a.set_by.now, "most": a.most, "unit": a.set_by.unit,
                }
                for a in self.allowed
            ],
            "trade": _trade(self.trade),
            "reasons": list(self.reasons),
            "notes": list(self.notes),
            "seconds": self.seconds,
            "evaluations": self.evaluations,
        }  # fmt: skip

    def text(self) -> str:
        """Return all of it as a text."""
        return "\n".join(_lines(self))


def _trade(trade: Trade | None) -> dict[str, Any] | None:
    if trade is None:
        return None
    return {
        "wishes": [w.name for w in trade.wishes],
        "points": [[_finite(p.first), _finite(p.second), p.others] for p in trade.points],
    }


def _measured(w: ProvenWish) -> dict[str, Any]:
    return {
        "name": w.wish.name, "value": _finite(w.value), "U": _finite(w.U), "model": _finite(w.expected),
        "verdict": w.verdict,
    }  # fmt: skip


def _finite(x: float) -> float | None:
    return float(x) if math.isfinite(x) else None


def _text(value: Any) -> str:
    if isinstance(value, list | tuple):
        return f"[{', '.join(_text(v) for v in value)}]"
    return value if isinstance(value, str) else f"{value:.9g}"


def where(at: Mapping[str, float], spread: tuple[Range, ...]) -> str:
    """Return a point of the spread as text."""
    unit = {r.name: r.unit for r in spread}
    return ", ".join(f"{n} = {_shown(v, unit[n])}" if n in unit else n for n, v in at.items()) or "nominal"


def range_text(r: Range) -> str:
    """Return a range as text."""
    return f"{r.name} {_shown(r.low, r.unit)} to {_shown(r.high, r.unit)}"


def _shown(value: float, unit: str) -> str:
    return units.format_quantity(float(f"{value:.4g}"), unit).replace(f" {unit}", f" {units.display(unit)}")


def _lines(t: LoopTuning) -> list[str]:
    state = "tuned" if t.proven else "tuned, but not proven in co-simulation" if t.had else "cannot be had"
    over = ", ".join(range_text(r) for r in t.spread)
    lines = [
        f"{t.name}: {state} ({t.structure.name}, {t.evaluations} controllers judged in {t.seconds:.1f} s)",
        f"over {over}: {len(t.points)} points" if over else "at nominal values",
        "",
    ]
    rows = [["wish", "worst case", "nominal", "worst at"]]
    rows += [
        [str(w.wish), w.wish.shown(w.worst) + ("" if w.ratio >= 1.0 else "  !"), w.wish.shown(w.nominal),
         where(w.at, t.spread)]
        for w in t.wishes
    ]  # fmt: skip
    lines += align_columns(rows, {0, 1, 2, 3}, "  ")
    for p in t.proofs:
        lines += ["", f"co-simulation, {where(p.values, t.spread)}:"]
        if p.why_not:
            lines.append(f"  not measured: {p.why_not}")
        for w in p.wishes:
            end = " (as far as sines above the noise reach)" if w.bound else ""
            end += f"  ! {w.verdict}" if w.verdict else ""
            end += "" if w.agrees else f"  ! the linear model says {w.wish.shown(w.expected)}"
            lines.append(f"  {w.wish.name}: {measured_text(w)}{end}")
        if p.limits:
            lines.append(f"  at its limit in the test sines: {p.limits}")
        if p.step is not None:
            lines.append(f"  {p.step}")
    if t.allowed:
        allowed = align_columns([COLUMNS, *(a.row for a in t.allowed)], set(range(len(COLUMNS))), "  ")
        lines += ["", f"jitter by source, and {ALLOWED}:", *allowed]
    if t.trade is not None:
        a, b = t.trade.wishes
        lines += ["", f"trade, worst case of the linear models: {a.name}, {b.name}"]
        lines += [
            f"  {a.shown(p.first)}, {b.shown(p.second)}" + ("" if p.others else "  ! other wishes are not fulfilled")
            for p in t.trade.points
        ]
    lines += [f"\nwhy: {t.reasons[0]}", *(f"     {r}" for r in t.reasons[1:])] if t.reasons else []
    lines += ["", *(f"note: {n}" for n in t.notes)] if t.notes else []
    values = ", ".join(f"{n} = {v:.5g}" for n, v in t.controller.values.items())
    title = "controller" if t.had else "the best that was found"
    return [*lines, "", f"{title}: {values}", "", t.command]


def measured_text(w: ProvenWish) -> str:
    """Return a measured wish as text, with its expanded uncertainty."""
    if w.bound:
        return f"{w.wish.shown(w.value)} or more"
    return w.wish.shown(w.value, w.U if math.isfinite(w.value) else 0.0)
