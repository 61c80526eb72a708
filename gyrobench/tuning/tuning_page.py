"""The page of a tuned loop, in HTML and PDF: wishes and what came, figures, proof, controller, command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gyrobench.bench import Bench
from gyrobench.report import FORMATS
from gyrobench.report.numbers import minus
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
    remarks,
    text_cell,
)
from gyrobench.report.report_files import write_files
from gyrobench.report.style import styled
from gyrobench.tuning import tuning_figures as draw
from gyrobench.tuning.proof import ProvenWish
from gyrobench.tuning.sight_allowance import COLUMNS
from gyrobench.tuning.trade import Trade
from gyrobench.tuning.tuned_loop import ALLOWED, LoopTuning, measured_text, range_text, where

NAMES = {kind: f"tuning.{kind}" for kind in FORMATS}


def write_tuning(tuned: LoopTuning, folder: Path) -> dict[str, Path]:
    """Write tuning.json, tuning.html, tuning.pdf into a folder; as :func:`gyrobench.report.report_files.write`."""
    return write_files(tuned.as_dict(), lambda: page(tuned), folder, FORMATS, NAMES, Bench.find().folder)


def page(t: LoopTuning) -> Page:
    """Return the page."""
    report_id = document_id(t.as_dict())
    over = "; ".join(range_text(r) for r in t.spread) or "none"
    head = [
        ("Report", report_id),
        ("System", t.name),
        ("Structure", t.structure.name),
        ("Spread", over),
        ("Set", ", ".join(f"{n} = {v}" for n, v in t.given.items()) or "nothing"),
    ]
    with styled():
        sections = [
            Section("Wishes", "wishes", [Text(summary(t)), _wishes(t), *remarks(t.reasons)]),
            *([Section("Jitter by source", "sources", [_sources(t)])] if t.allowed else []),
            *([Section("Trade of two wishes", "trade", _trade(t.trade))] if t.trade else []),
            Section("Margins", "margins", _margins(t)),
            Section("Sensitivities and open loop", "responses", _responses(t)),
            Section("Proof in co-simulation", "proof", [*_proofs(t), *_step(t), *_notes(t)]),
            Section("Controller", "controller", _controller(t)),
            Section("Method", "method", _method(t)),
        ]
    return Page(f"Tuned loop: {t.name}", report_id, head, sections, what="Tuning").finish()


def summary(t: LoopTuning) -> str:
    """Return the answer in a sentence."""
    where_ = f"over the whole spread ({len(t.points)} points of it)" if t.spread else "at nominal values"
    if t.proven:
        return f"Every wish is fulfilled {where_}, and the co-simulation does not contradict."
    if t.had:
        return f"The linear model fulfils every wish {where_}; the co-simulation does not confirm it, see the proof."
    return f"What is wanted cannot be had {where_} with this structure; shown is the best compromise that was found."


def _wishes(t: LoopTuning) -> PageTable:
    rows = []
    for w in t.wishes:
        good = w.ratio >= 1.0
        wanted, worst, nominal = (minus(w.wish.shown(x)) for x in (w.wish.value, w.worst, w.nominal))
        cells = [w.wish.name, ("≥ " if w.wish.least else "≤ ") + wanted, worst, nominal, where(w.at, t.spread),
                 "fulfilled" if good else "not fulfilled"]  # fmt: skip
        marks = ["strong", "", "", "", "", "pass" if good else "fail"]
        rows.append(Row([text_cell(c, m) for c, m in zip(cells, marks, strict=True)]))
    heads = columns("measure", "wanted", "worst case", "nominal", "worst at", "", wide=["worst at"])
    return PageTable(heads, rows, "Wishes, with the worst case of the linear models over the spread.")


def _sources(t: LoopTuning) -> PageTable:
    rows = [Row([text_cell(c, "" if k else "strong") for k, c in enumerate(a.row)]) for a in t.allowed]
    where_ = "worst case of the linear models over the spread" if t.spread else "by the linear model"
    caption = (
        f"Jitter by source, and {ALLOWED}: {where_}. Factor: on the amplitude of the source. Cut: its peaks would meet "
        "the limit of the voltage."
    )
    return PageTable(columns(*COLUMNS, wide=["at most"]), rows, caption)


def _trade(trade: Trade) -> list[Any]:
    a, b = trade.wishes
    rows = [
        Row([text_cell(minus(a.shown(p.first)), "strong"), text_cell(minus(b.shown(p.second))),
             text_cell("fulfilled" if p.others else "not fulfilled", "pass" if p.others else "fail")])
        for p in trade.points
    ]  # fmt: skip
    caption = "Best of one wish for what is left of the other, worst case of the linear models over the spread."
    return [
        *pictures(Picture("trade", draw.trade(trade), caption, f"trade of {a.name} and {b.name}", half=True)),
        PageTable(columns(a.name, b.name, "other wishes"), rows, "The points of the figure."),
    ]


def _margins(t: LoopTuning) -> list[Any]:
    return pictures(
        Picture("nichols", draw.nichols(t), "Gain over phase of L; inside a dashed curve the disk margin is smaller.",
                "Nichols plot of the open loop", half=True),
        Picture("nyquist", draw.nyquist(t), "L near −1. The disks are what the disk margins keep free.",
                "Nyquist plot of the open loop", half=True),
    )  # fmt: skip


def _responses(t: LoopTuning) -> list[Any]:
    both = (
        Picture("sensitivities", draw.sensitivities(t), "S = 1/(1 + L) and T = L/(1 + L), and what was wanted.",
                "gain of S and T over frequency"),
        Picture("open-loop", draw.open_loop(t), "Open loop L, step and delays of the co-simulation in it.",
                "Bode plot of the open loop"),
    )  # fmt: skip
    return [*pictures(both[0]), *pictures(both[1])]


def _proofs(t: LoopTuning) -> list[Any]:
    rows: list[Row] = []
    for p in t.proofs:
        if p.why_not:
            cells = where(p.values, t.spread), "all", p.why_not, ""
            rows.append(Row([*(text_cell(x) for x in cells), text_cell("not measured", "warn")]))
        rows += [Row(_proven(where(p.values, t.spread), w)) for w in p.wishes]
    if not rows:
        return [Text("No run was made.")]
    heads = columns("point", "measure", "co-simulation (95 %)", "linear model", "", wide=["point"])
    caption = (
        "Measured with test sines in the co-simulation, noise, friction and limits as they are. The interval holds the "
        "noise and what the interpolation between the sines does. Or more: sines above the noise reach no further. Not "
        "told: noise leaves open whether the wish is kept."
    )
    return [PageTable(heads, rows, caption)]


def _proven(point: str, w: ProvenWish) -> list[Any]:
    state = ("not told", "warn") if not w.told else (w.verdict, "fail") if w.verdict else ("holds", "pass")
    if not w.verdict and not w.agrees:
        state = ("holds, unlike the linear model", "warn")
    cells = [point, w.wish.name, minus(measured_text(w)), minus(w.wish.shown(w.expected))]
    return [*(text_cell(c) for c in cells), text_cell(state[0], state[1])]


def _step(t: LoopTuning) -> list[Any]:
    steps = [p.step for p in t.proofs if p.step is not None]
    load = steps[0].torque if steps else 0.0
    caption = f"Angle of the platform after a load of {load:g} N·m, in the co-simulation, with its noise."
    return pictures(Picture("load-step", draw.load_step(t), caption, "platform angle after a load step"))


def _notes(t: LoopTuning) -> list[Any]:
    hidden = [f"{where(p.values, t.spread)}: {p.step}" for p in t.proofs if p.step and not p.step.seen]
    limited = [f"{where(p.values, t.spread)}: at its limit in the test sines: {p.limits}" for p in t.proofs if p.limits]
    return remarks([*hidden, *limited, *t.notes])


def _controller(t: LoopTuning) -> list[Any]:
    rows = [Row([text_cell(n), text_cell(f"{v:.6g}")]) for n, v in t.controller.values.items()]
    parts = [("numerator", t.controller.num), ("denominator", t.controller.den)]
    rows += [
        Row([text_cell(f"{n}, rising powers of s"), text_cell(", ".join(f"{x:.9g}" for x in p))]) for n, p in parts
    ]
    heads = columns("value", "", wide=[""])
    return [
        PageTable(heads, rows, "Controller G(s), SI; v = −G e."),
        Text("The system runs with it by:"),
        Text(t.command),
    ]


def _method(t: LoopTuning) -> list[Any]:
    names = {w.wish.name: w.wish for w in t.wishes}
    from gyrobench.tuning.wishes import MEASURES

    meant = [f"{n}: {MEASURES[n][2]}." if n in MEASURES else f"{n}: |S| there." for n in names]
    text = (
        "The linear models come from the Jacobians of the parts, with the communication step, the order of the parts "
        "and every inserted delay in them. The search maximizes the smallest ratio of what is got to what is wanted, "
        f"over all wishes and points of the spread; {t.evaluations} controllers were judged. Limits, dry friction that "
        "slides and noise are not in the linear models; they are in the proof."
    )
    return [Text(text), BulletList(meant), Text("Seiler 2020; Skogestad 2005, sections 2.4.5 and 2.8.2.", quiet=True)]
