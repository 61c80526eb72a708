"""The certificate of a lot: control charts of its coefficients, and the certificate of a whole campaign."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gyrobench.bench import UsageError
from gyrobench.campaign.analysis.lots import control_limits
from gyrobench.campaign.execution.store import Campaign
from gyrobench.campaign.site.site_figures import control_lines
from gyrobench.report.certificate_page import Certified, chosen
from gyrobench.report.laboratory import Laboratory
from gyrobench.report.page_model import Picture, Text, pictures
from gyrobench.report.style import BLUE, HALF, VERMILION, axis_label, chart, styled, svg
from gyrobench.result import Limit
from gyrobench.workflow.certificate import write_certificate

HOW = (
    "Control charts of the instruments in the order of the table: median and limits from the median moving range, "
    "outside of which 0.27 % of a normal lot lie (dashed); bars: U; dotted: limits of the specification."
)


def certify_campaign(campaign: Campaign) -> list[Path]:
    """Write the certificate of a campaign of measured files into its folder; return its paths.

    Raises UsageError where a file has no report: a lot is certified whole or not at all.
    """
    frame = campaign.table()
    lacking = frame[(frame["state"] != "done") | frame["report"].isna()]
    if len(lacking):
        names = ", ".join(Path(str(d)).name for d in lacking["data"].fillna(lacking["run"]))
        raise UsageError(f"no certificate: {len(lacking)} of {len(frame)} files have no report: {names}")
    if campaign.local is None:
        raise UsageError(f"{campaign.url}: not a folder of this machine; a certificate is made of reports that are")
    folders = [campaign.local / Path(str(report)).parent for report in frame.sort_values("data")["report"]]
    return write_certificate(folders, out=campaign.local, charts=control_charts)


def control_charts(of: Sequence[Certified], laboratory: Laboratory) -> list[Any]:
    """Return a control chart of each coefficient that the profile shows, none for a lot too small for limits."""
    drawn = []
    with styled():
        for k, c in enumerate(chosen(of[0], laboratory), 1):
            members = [m.report.result[c.name] if c.name in m.report.result.names else None for m in of]
            y = np.array([np.nan if m is None or m.no_value else m.estimate for m in members])
            half = np.array([np.nan if m is None or m.no_value else m.k * m.u for m in members])
            if (found := control_limits(y[np.isfinite(y)])) is not None:
                drawn.append(_chart(f"control-{k}", c.name, c.unit, y, half, found, c.limit))
    return [Text(HOW), *pictures(*drawn)] if drawn else []


def _chart(
    key: str, name: str, unit: str, y: Any, half: Any, found: tuple[float, float, float], limit: Limit | None
) -> Picture:
    centre, low, high = found
    fig, ax = chart(HALF, 45)
    control_lines(ax, {"centre": centre, "low": low, "high": high})
    ax.errorbar(np.arange(1, len(y) + 1), y, yerr=half, fmt="o", color=BLUE, markersize=2.8, elinewidth=0.8)
    bottom, top = ax.get_ylim()
    for end in limit or ():
        if end is not None and bottom - (top - bottom) < end < top + (top - bottom):
            ax.axhline(end, color=VERMILION, linewidth=0.9, linestyle=":")
    ax.set_xlabel("instrument")
    ax.set_ylabel(axis_label(name, unit))
    ax.locator_params(axis="x", nbins=6, integer=True)
    beyond = int(((y < low) | (y > high)).sum())
    caption = f"{name}: {beyond} beyond the control limits."
    return Picture(key, svg(fig, key), caption, f"Control chart of {name}", half=True)
