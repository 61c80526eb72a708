"""The page of a tuned loop, and tuning from Python."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gyrobench as gb
from gyrobench.report.loop_plane import disk, nichols
from gyrobench.report.numbers import minus
from gyrobench.report.style import chart
from gyrobench.tuning.tuning_page import page


@pytest.fixture(scope="module")
def tuned():
    return gb.tune(
        "platform_single_axis",
        ["phase margin=45deg", "disk margin=0.6", "bandwidth>5Hz", "S at 1Hz<-15dB", "peak T<3dB"],
        ["platform.J=±10%"],
        "pi+lead",
    )


@pytest.mark.parametrize("margin", [0.2, 0.5, 1.2])
def test_a_disk_is_where_S_is_as_far_from_one_half(margin: float) -> None:
    ring = disk(margin)
    assert np.abs(1.0 / (1.0 + ring) - 0.5) == pytest.approx(np.full(ring.size, 1.0 / margin), rel=1e-9)


@pytest.mark.long
def test_tuning_from_python_runs(tuned) -> None:
    """The settings are those of gb.load; the loop of the run has the nominal margin that was promised."""
    assert tuned.had and tuned.proven and "tuned (pi+lead" in str(tuned)
    run = gb.load("platform_single_axis", tuned.settings, hold="20s").run(check_step=False)
    promised = next(w.nominal for w in tuned.wishes if w.wish.name == "phase margin")
    assert run.result["PM"].estimate == pytest.approx(np.degrees(promised), abs=1.0)


@pytest.mark.long
def test_the_page_of_a_loop_that_was_not_measured_shows_no_points(tuned) -> None:
    """Few sines that stand out are no measurement; a load step within three times the noise is not seen."""
    first = tuned.proofs[0]
    lost = replace(first, wishes=(), why_not="1 of 23 test sines stand above the noise",
                   step=replace(first.step, noise=float(np.abs(first.step.angle).max()) / 2.9))  # fmt: skip
    found = page(replace(tuned, proofs=(lost,)))
    assert "load-step" not in [p.key for p in found.pictures]
    assert "is not seen" in repr(found)
    marks = {p.key: p.svg.count("<use") for p in page(tuned).pictures}  # ticks, and points
    assert [marks[p.key] - p.svg.count("<use") > 0 for p in found.pictures] == [True] * 4
    assert "load-step" in [p.key for p in page(replace(tuned, proofs=(replace(lost, step=first.step),))).pictures]


def test_points_at_the_edge_of_a_nichols_plot_are_whole_and_those_beyond_it_not_drawn() -> None:
    fig, ax = chart(60.0, 60.0)
    ax.plot([-90.0, -90.0, -90.0], [40.0, 41.0, 0.0], marker="o", linestyle="")
    nichols(fig, ax, [])
    assert ax.lines[0].get_ydata().tolist() == [40.0, 0.0] and not ax.lines[0].get_clip_on()


@pytest.mark.long
def test_the_page_says_what_was_wanted_and_what_came(tuned, tmp_path: Path) -> None:
    written = tuned.write(tmp_path)
    assert {p.name for p in written.values()} == {"tuning.json", "tuning.html", "tuning.pdf"}
    assert json.loads(written["json"].read_text())["proven"] is True
    html = written["html"].read_text(encoding="utf-8")
    for w in tuned.wishes:
        assert w.wish.name in html and minus(w.wish.shown(w.worst)) in html
    assert "Every wish is fulfilled over the whole spread" in html
    assert tuned.command.split(" --set")[0] in html
    assert written["pdf"].read_bytes().startswith(b"%PDF")
    names = [p.key for p in page(tuned).pictures]
    assert names == ["nichols", "nyquist", "sensitivities", "open-loop", "load-step"]
    assert all(f'id="{n}-' in html for n in names)
    assert not re.search(r"\bnan\b|\binf\b", re.sub(r"<svg.*?</svg>", "", html, flags=re.S))
