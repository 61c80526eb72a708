"""The page of an identified loop, in HTML and PDF: margins, responses, nonlinearity, method."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.bench import Bench
from gyrobench.identification import identification_figures as draw
from gyrobench.identification.identification import LoopIdentification
from gyrobench.identification.loop_record import PLANT_INPUT, PLANT_OUTPUT
from gyrobench.identification.plant_fit import shown_values
from gyrobench.identification.plant_model import PARAMETERS
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

NAMES = {kind: f"identification.{kind}" for kind in FORMATS}
SHOWN = 30  # frequencies of the table


def write_identification(found: LoopIdentification, folder: Path) -> dict[str, Path]:
    """Write identification.json, .html and .pdf into a folder; as :func:`gyrobench.report.report_files.write`."""
    return write_files(found.as_dict(), lambda: page(found), folder, FORMATS, NAMES, Bench.find().folder)


def page(t: LoopIdentification) -> Page:
    """Return the page."""
    told = {k: v for k, v in t.as_dict().items() if k != "seconds"}
    report_id = document_id(told)
    head = [
        ("Report", report_id),
        ("File", t.record.name),
        ("Record", f"{t.record.length:.6g} s at {1.0 / t.record.step:.6g} Hz"),
        ("Measured", t.method),
        ("Excitation", f"enters at the {t.record.at}"),
    ]
    with styled():
        sections = [
            Section(
                "Margins",
                "margins",
                [_margins(t), *_verdicts(t), *remarks(t.notes), *(_near(t) if t.record.closed else [])],
            ),
            *(_loop(t) if t.record.closed else []),
            Section("Plant", "plant-section", _plant(t)),
            *([Section("Nonlinearity", "nonlinearity", _distortion(t))] if t.distortions else []),
            Section("Responses", "responses", [_responses(t)]),
            Section("Method", "method", _method(t)),
        ]
    return Page(f"Identified loop: {t.record.name}", report_id, head, sections, what="Identification").finish()


def _margins(t: LoopIdentification) -> Any:
    if not t.margins:
        return Text("No margins could be measured.")
    rows = []
    for m in t.margins:
        interval = f"{m.shown(m.low)} to {m.shown(m.high)}"
        rows.append(Row([text_cell(m.name, "strong"), text_cell(minus(m.shown(m.value))), text_cell(minus(interval)),
                         text_cell(f"{m.f:.4g} Hz")]))  # fmt: skip
    caption = "Margins of the loop with their 95 % coverage intervals, and the frequency at which each is."
    return PageTable(columns("measure", "value", "95 %", "at", wide=["measure"]), rows, caption)


def _verdicts(t: LoopIdentification) -> list[Any]:
    if not t.verdicts:
        return []
    rows = [Row([text_cell(minus(str(v.wanted)), "strong"), text_cell(v.verdict, v.verdict), text_cell(v.why)])
            for v in t.verdicts]  # fmt: skip
    caption = "What is wanted: it passes where the whole interval does, unless the loop depends on its amplitude."
    return [PageTable(columns("wanted", "verdict", "", wide=[""]), rows, caption)]


def _near(t: LoopIdentification) -> list[Any]:
    if not t.record.closed:
        return []
    return pictures(
        Picture("nichols", draw.nichols(t), "Gain over phase of L; inside the dashed curve the disk margin is smaller.",
                "Nichols plot of the open loop", half=True),
        Picture("nyquist", draw.nyquist(t), "L near −1, each point with the circle that holds 95 % of gain and phase.",
                "Nyquist plot of the open loop", half=True),
    )  # fmt: skip


def _loop(t: LoopIdentification) -> list[Section]:
    return [
        Section("Open loop", "open-loop-section", _open_loop(t)),
        Section("Sensitivities", "sensitivities-section", _sensitivities(t)),
    ]


def _open_loop(t: LoopIdentification) -> list[Any]:
    caption = "Open loop L = 1/S − 1, with 95 % coverage intervals at each frequency."
    return pictures(Picture("open-loop", draw.open_loop(t), caption, "Bode plot of the open loop"))


def _sensitivities(t: LoopIdentification) -> list[Any]:
    caption = "S = x/r, x the signal behind the summing point, and T = 1 − S, with 95 % coverage intervals."
    return pictures(Picture("sensitivities", draw.sensitivities(t), caption, "gain of S and T over frequency"))


def _plant(t: LoopIdentification) -> list[Any]:
    caption = "Plant P: output over input, both as they answer to the excitation, with 95 % coverage intervals."
    return [*_parameters(t), *pictures(Picture("plant", draw.plant(t), caption, "Bode plot of the plant"))]


def _parameters(t: LoopIdentification) -> list[Any]:
    if t.fit is None:
        return []
    rows = [
        Row([text_cell(name, "strong"), text_cell(PARAMETERS[name][1]), text_cell(value), text_cell(interval)])
        for name, value, interval in shown_values(t.fit)
    ]
    heads = columns("parameter", "", "value", "95 %", wide=[""])
    caption = "Physical parameters of the plant, by weighted least squares over all frequencies."
    sentence = f"{t.fit.sentence[:1].upper()}{t.fit.sentence[1:]}."
    return [PageTable(heads, rows, caption), BulletList([sentence], warn=True) if t.fit.lacks else Text(sentence)]


def _distortion(t: LoopIdentification) -> list[Any]:
    rows = [
        Row([
            text_cell(d.kind), text_cell(str(d.count)),
            text_cell(minus(f"{_db(d.level):.3g} dB") if d.level else "none"),
            text_cell(minus(f"{_db(d.floor):.3g} dB")), text_cell("< 0.001" if d.p < 1e-3 else f"{d.p:.2g}"),
            text_cell("significant" if d.significant else "not seen", "warn" if d.significant else ""),
        ])
        for d in t.distortions
    ]  # fmt: skip
    heads = columns("harmonics left out", "lines", "distortion", "noise", "p", "", wide=["harmonics left out"])
    caption = (
        "What the harmonics hold that the excitation leaves out, rms over that of the excited ones: beside noise, and "
        "the noise itself. Odd ones also fall on the excited lines. A small p is evidence against a linear loop."
    )
    picture = Picture("distortion", draw.distortion(t), "Amplitudes of the output.", "amplitudes at all harmonics")
    return [PageTable(heads, rows, caption), *pictures(picture)]


def _db(x: float) -> float:
    return 20.0 * float(np.log10(max(x, 1e-9)))


def _responses(t: LoopIdentification) -> PageTable:
    unit, factor = t.plant_unit
    shown = ("L", "S", "P") if t.record.closed else ("P",)
    which = np.flatnonzero(t.responses[shown[0]].determined)
    if which.size > SHOWN:
        even = np.geomspace(t.f[which[0]], t.f[which[-1]], SHOWN)
        which = which[np.unique([int(np.argmin(np.abs(t.f[which] - x))) for x in even])]
    rows = []
    for k in which:
        cells = [f"{t.f[k]:.4g}"]
        for name in shown:
            g, scale = t.responses[name], factor if name == "P" else 1.0
            cells += [f"{_db(scale * abs(g.value[k])):.2f}", f"{np.degrees(np.angle(g.value[k])):.1f}"]
            if name == shown[0]:
                cells.append(f"{_db(1.0 + 1.96 * g.u[k]):.2g}")
        rows.append(Row([text_cell(minus(c)) for c in cells]))
    first = [("|L|", "dB"), ("phase", "°"), ("U of L", "dB"), ("|S|", "dB"), ("phase", "°")] if t.record.closed else []
    last = [] if t.record.closed else [("U of P", "dB")]
    heads = columns(("frequency", "Hz"), *first, (f"|P| re {unit}", "dB"), ("phase of P", "°"), *last)
    return PageTable(heads, rows, "Responses at some of the frequencies; all are in identification.json.", small=True)


def _method(t: LoopIdentification) -> list[Any]:
    enters = {
        PLANT_INPUT: "u = v + r, with v of the controller: x = u",
        PLANT_OUTPUT: "the controller gets y + r: x = y + r",
    }.get(t.record.at, "the controller gets r − y: x = r − y")
    how = (
        "The spectrum of the whole record has the excitation in every so many bins; noise, drift and the transient are "
        "read from those between, as a parabola in frequency and what is left of it."
        if t.period
        else "In each band of frequency the response and the transient are parabolas in frequency; the rest is noise."
    )
    text = (
        f"The excitation r enters where {enters}. {how} The responses of u and y to r hold no bias from the noise that "
        "circulates in the loop; S = x/r, L = 1/S − 1, P = y/u, with the covariance of the noise of both. Margins come "
        "from a curve through the points, as smooth as the noise allows to say."
    )
    limits = [
        "All signals are taken at the same instants. An excitation that is held between samples while an analogue loop "
        "goes on needs a sampling rate of a hundred times the crossover.",
        "Noise that grows or fades along the record, and a loop that changes within it, are not modelled; of a "
        "periodic or random excitation, halves and stretches that differ are said.",
    ]
    sources = "Pintelon 2012, chapters 2, 4 and 7; Fieller 1954; McKelvey 2012; Seiler 2020."
    return [Text(text), BulletList(limits), Text(sources, quiet=True)]
