"""The look of the figures, and the way from a matplotlib figure to a clean SVG.

Colours are Okabe-Ito; a line style or a marker is always the second cue.  Text is drawn as outlines,
so that a figure looks the same on every machine.
"""

from __future__ import annotations

import contextlib
import io
import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from gyrobench.report.fonts import Font, MissingFontError, fonts_for
from gyrobench.report.language import in_use
from gyrobench.report.numbers import MINUS, superscript, write_number

MM = 1.0 / 25.4
WIDE = 170 * MM  # the text width of A4, inch
HALF = 82 * MM

INK = "#1f2328"  # text, axes
MUTED = "#5b6168"  # second text
GRID = "#d5d9de"
BLUE = "#0072b2"
VERMILION = "#d55e00"
GREEN = "#009e73"
PURPLE = "#cc79a7"
ORANGE = "#e69f00"
SKY = "#56b4e9"
SHADE = "#eef1f4"
PAPER = "#fdfdfd"  # behind labels that cross lines
CYCLE = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
MARKERS = "os^Dv<"
PLAIN = (1e-4, 1e6)  # the largest number of an axis that needs no power of ten
ALIKE = 1e-5  # of the largest number: a range that is shorter is counted from a number within it

# in HTML the neutral colours follow the reader's light or dark setting
THEMED = {
    INK: "var(--ink)",
    MUTED: "var(--muted)",
    GRID: "var(--grid)",
    SHADE: "var(--shade)",
    PAPER: "var(--page)",
    BLUE: "var(--blue)",
    VERMILION: "var(--vermilion)",
    GREEN: "var(--green)",
    PURPLE: "var(--purple)",
}

_RC: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.spines.left": False,
    "axes.spines.bottom": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "xtick.bottom": False,  # the grid marks the place
    "ytick.left": False,
    "xtick.major.size": 0.0,
    "ytick.major.size": 0.0,
    "xtick.minor.size": 0.0,
    "ytick.minor.size": 0.0,
    "text.color": INK,
    "axes.labelcolor": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.titlelocation": "left",
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
    "lines.linewidth": 1.2,
    "lines.markersize": 3.0,
    "hatch.linewidth": 0.6,
    "text.parse_math": False,
    "axes.formatter.use_mathtext": False,
    "svg.hashsalt": "gyrobench",
    "svg.fonttype": "path",
    "path.simplify": True,
}


@contextmanager
def styled() -> Iterator[None]:
    """Matplotlib with the report's style; the caller's settings come back afterwards."""
    import matplotlib

    with matplotlib.rc_context({**_RC, "font.family": ["DejaVu Sans", *_fonts()]}):
        yield


def _fonts() -> list[str]:
    """Return the families for the language of the page, so that texts have their size when they are placed."""
    language = in_use()
    if language is None:
        return []
    return _added(fonts_for(language.catalogue.texts.values(), None, language.catalogue.code))


def _added(fonts: Sequence[Font]) -> list[str]:
    from matplotlib.font_manager import fontManager

    for font in fonts:
        fontManager.addfont(str(font.path))
    return [font.family for font in fonts]


def figure(width: float, height_mm: float, **grid: Any) -> tuple[Any, Any]:
    """Return a figure without a window, and its axes (an array of two dimensions)."""
    from matplotlib.figure import Figure
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    fig = Figure(figsize=(width, height_mm * MM), layout=ConstrainedLayoutEngine(w_pad=0.02, h_pad=0.02))
    fig.patch.set_visible(False)
    axes = fig.subplots(squeeze=False, **grid)
    for ax in axes.flat:
        ax.patch.set_visible(False)
    return fig, axes


def chart(width: float, height_mm: float) -> tuple[Any, Any]:
    """Return a figure without a window that has one pair of axes, and these."""
    fig, axes = figure(width, height_mm)
    return fig, axes[0, 0]


def svg(fig: Any, key: str, zoom: Any = None) -> str:
    """Return the figure as an SVG element that can stand inside a page: ids prefixed by ``key``, no style of its own.

    ``zoom`` is the axes whose x axis the page's script may zoom; its limits, as the numbers there, are written into
    the element.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    _in_language(fig)
    _name_the_powers(fig)
    _in_any_script(fig)
    buffer = io.StringIO()  # not by savefig, which draws everything twice
    canvas: Any = FigureCanvasSVG(fig)
    canvas.print_svg(buffer, metadata={"Date": None, "Creator": None})
    text = clean_svg(buffer.getvalue(), key)
    if zoom is not None:
        offset, power = _left_out(*zoom.get_xlim())
        low, high = (float(v - offset) / 10.0**power for v in zoom.get_xlim())
        text = text.replace("<svg ", f'<svg data-x0="{low!r}" data-x1="{high!r}" ', 1)
    return text


def _in_language(fig: Any) -> None:
    """Say the texts of a figure, its named ticks too, in the language of the page."""
    from matplotlib.text import Text
    from matplotlib.ticker import FixedFormatter, FuncFormatter

    language = in_use()
    if language is None:
        return
    for axis in (axis for ax in fig.axes for axis in (ax.xaxis, ax.yaxis)):
        named = axis.get_major_formatter()
        if isinstance(named, FixedFormatter | FuncFormatter):
            axis.set_major_formatter(FuncFormatter(lambda x, pos, named=named: language.text(named(x, pos))))
    for text in fig.findobj(Text):
        text.set_text(language.text(text.get_text()))


def _name_the_powers(fig: Any) -> None:
    """Put what the numbers of a linear axis leave out into its label; those of a logarithmic axis have their power.

    A power of ten, and a number that all have in common: "time − 1700000000 / (10⁻³ s)".  Matplotlib would write both
    over the axis, alone.
    """
    from matplotlib.ticker import FuncFormatter, LogFormatter, NullFormatter, ScalarFormatter

    for axis in (axis for ax in fig.axes for axis in (ax.xaxis, ax.yaxis)):
        numbers = axis.get_major_formatter()
        if isinstance(numbers, LogFormatter):
            axis.set_major_formatter(FuncFormatter(lambda v, _: write_number(float(v), significant=2).text))
            axis.set_minor_formatter(NullFormatter())
        elif isinstance(numbers, ScalarFormatter):
            numbers.offset, power = _left_out(*axis.get_view_interval())
            numbers.set_scientific(power != 0)
            numbers.set_powerlimits((power, power))
            axis.offsetText.set_visible(False)
            if not axis.get_tick_params().get("labelbottom" if axis is axis.axes.xaxis else "labelleft", True):
                continue  # of axes that are one, the last has the numbers
            if label := axis.get_label_text():
                axis.set_label_text(_with_power(label, numbers.offset, power))
            elif numbers.offset or power:  # a channel has its name as title
                title = axis.axes.get_title(loc="left")
                axis.axes.set_title(_with_power(title, numbers.offset, power), loc="left", pad=3)


def _left_out(low: float, high: float) -> tuple[float, int]:
    """Return the offset and the power of ten that the numbers of an axis with these limits leave out."""
    low, high, offset = min(low, high), max(low, high), 0.0
    if high - low < ALIKE * max(-low, high):
        place = 10.0 ** math.ceil(math.log10(high - low))
        offset = place * round(0.5 * (low + high) / place)
    largest = max(abs(low - offset), abs(high - offset))
    return offset, 0 if PLAIN[0] <= largest < PLAIN[1] else 3 * math.floor(math.log10(largest) / 3.0)


def _with_power(label: str, offset: float, power: int) -> str:
    """Return the label of an axis ("rate / (°/h)") whose numbers leave out an offset and a power of ten."""
    if not offset and not power:
        return label
    name, slash, unit = label.rpartition(" / ") if " / " in label else (label, "", "1")
    if offset:
        name += f" {MINUS if offset > 0.0 else '+'} {abs(offset):.15g}"
    if not power:
        return f"{name}{slash}{unit if slash else ''}"
    factor = f"10{superscript(power)}"
    return axis_label(name, factor if unit == "1" else f"{factor} {unit.removeprefix('(').removesuffix(')')}")


def said(text: str) -> str:
    """Return a text in the language of the page."""
    language = in_use()
    return language.text(text) if language else text


def _in_any_script(fig: Any) -> None:
    """Give the texts of a figure the fonts of the machine where DejaVu Sans lacks a character (names of runs)."""
    from matplotlib.text import Text

    language = in_use()
    texts = [t for t in fig.findobj(Text) if not t.get_text().isascii()]
    with contextlib.suppress(MissingFontError):  # the PDF says which, a page shows the name beside the figure
        others = _added(fonts_for((t.get_text() for t in texts), None, language.catalogue.code if language else ""))
        for text in texts if others else []:
            text.set_fontfamily(list(dict.fromkeys([*text.get_fontfamily(), *others])))


def clean_svg(text: str, key: str) -> str:
    """Strip prologue, metadata, comments and global style; make ids unique; round coordinates."""
    text = text[text.index("<svg") :]
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.S)
    text = re.sub(r"<metadata>.*?</metadata>\s*", "", text, flags=re.S)
    text = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>\s*", "", text, flags=re.S)
    text = re.sub(r'\bid="', f'id="{key}-', text)
    text = re.sub(r'href="#', f'href="#{key}-', text)
    text = re.sub(r"url\(#", f"url(#{key}-", text)
    text = re.sub(r"(?<![\d(])(\d+\.\d\d)\d+", lambda m: m[1], text)  # not in "scale(0.015625)"
    text = re.sub(r"\n\s*", "\n", text)
    return text.replace("<svg ", '<svg stroke-linejoin="round" ', 1)


def themed(svg_text: str) -> str:
    """Return the SVG with neutral colours replaced by the page's CSS variables."""
    for colour, variable in THEMED.items():
        svg_text = svg_text.replace(colour, variable)
    return svg_text


def axis_label(name: str, unit: str) -> str:
    """ "drift rate / (°/h)", "table angle / °", "share / 1"."""
    unit = unit or "1"
    return f"{name} / ({unit})" if "/" in unit or " " in unit else f"{name} / {unit}"


def zero_line(ax: Any) -> None:
    ax.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1)


def degree_ticks(ax: Any, unit: str) -> None:
    """Ticks at 0, 90, 180 ... where the axis is an angle of about one turn or more."""
    from matplotlib.ticker import MultipleLocator

    low, high = ax.get_xlim()
    if unit == "°" and high - low > 150.0:
        turns = (high - low) / 360.0
        ax.xaxis.set_major_locator(MultipleLocator(90.0 if turns < 2.5 else 360.0 * max(1, round(turns / 6))))


def time_axis(seconds: Sequence[float]) -> tuple[float, str]:
    """Divisor and unit in which a time span is readable: s, min, h or d."""
    span = (max(seconds) - min(seconds)) if len(seconds) else 0.0
    for limit, divisor, unit in ((300.0, 1.0, "s"), (2 * 3600.0, 60.0, "min"), (72 * 3600.0, 3600.0, "h")):
        if span <= limit:
            return divisor, unit
    return 86400.0, "d"


def envelope(x: Any, y: Any, buckets: int = 1500) -> tuple[list[float], list[float]]:
    """Min-max envelope of a long record: every bucket keeps its smallest and its largest sample, in order.

    Records of at most ``4 * buckets`` samples come back whole.  No extreme is ever lost.
    """
    import numpy as np

    xs, ys = np.asarray(x, float), np.asarray(y, float)
    if len(xs) <= 4 * buckets:
        return xs.tolist(), ys.tolist()
    keep: list[int] = []
    for part in np.array_split(np.arange(len(xs)), buckets):
        finite = part[np.isfinite(ys[part])]
        if len(finite):
            keep += sorted({int(finite[np.argmin(ys[finite])]), int(finite[np.argmax(ys[finite])])})
    return xs[keep].tolist(), ys[keep].tolist()


def span_labels(ax: Any, spans: Sequence[tuple[float, float, str]]) -> None:
    """Shade every second span of the x axis and write its label above, in rows so that none overlap."""
    fig = ax.figure
    fig.get_layout_engine().execute(fig)
    renderer = fig.canvas.get_renderer() if hasattr(fig.canvas, "get_renderer") else None
    low, high = ax.get_xlim()
    width = ax.get_window_extent(renderer).width
    ends: list[float] = []
    for k, (start, end, label) in enumerate(spans):
        if k % 2 == 0:
            ax.axvspan(start, end, color=SHADE, linewidth=0, zorder=0)
        text = ax.annotate(
            said(label), (0, 1), xycoords="axes fraction", ha="left", va="bottom", color=MUTED, gid=f"spanlabel-{k}"
        )
        size = text.get_window_extent(renderer).width
        left = (0.5 * (start + end) - low) / (high - low) * width - 0.5 * size
        left = min(max(left, 0.0), max(width - size, 0.0))
        row = next((r for r, e in enumerate(ends) if e + 6 < left), len(ends))
        if row == len(ends):
            ends.append(0.0)
        ends[row] = left + size
        text.xy = (left / width, 1.0)
        text.set_position((left / width, 1.0))
        text.xyann = (left / width, 1.02 + row * 12.0 / max(ax.get_window_extent(renderer).height * 72 / fig.dpi, 1))
