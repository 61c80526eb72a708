"""Charts of the studio: what they take long for keeps nothing else waiting."""

from __future__ import annotations

import asyncio
import threading
from pathlib import Path

import pytest

from gyrobench.studio.job_process import store

chart = pytest.importorskip("gyrobench.studio.chart", reason="the studio's packages are not installed")


def test_pages_do_not_wait_for_long_charts() -> None:
    """More charts than the loop has threads, all at work: what a page asks of a thread still comes."""
    free = threading.Event()

    async def busy() -> int:
        charts = [asyncio.create_task(chart.drawn(free.wait)) for _ in range(100)]
        await asyncio.sleep(0.0)
        page = await asyncio.wait_for(asyncio.to_thread(lambda: 7), 30.0)
        assert not any(c.done() for c in charts)
        free.set()
        assert all(await asyncio.gather(*charts))
        return page

    try:
        assert asyncio.run(busy()) == 7
    finally:
        free.set()  # or the threads outlive the test


def test_signals_so_far_have_their_units(tmp_path: Path) -> None:
    """1 mrad is 1e-3 180/pi = 0.0572958 deg; a current of 2e-6 A is 2 uA; a value that is missing stays a gap."""
    content = {"names": ["a", "i", "n"], "units": ["rad", "A", ""], "time": [0.0, 1.0]}
    store(tmp_path / "live", {**content, "values": [[0.0, 1e-3], [2e-6, None], [1.0, 2.0]]})
    options = chart._live(tmp_path / "live", 0, "en")
    assert [t["text"] for t in options["title"]] == ["a, °", "i, µA", "n, 1"]
    data = [s["data"] for s in options["series"]]
    assert data[0] == [[0.0, 0.0], [1.0, pytest.approx(0.0572958, rel=1e-6)]]
    assert data[1] == [[0.0, pytest.approx(2.0)], [1.0, None]] and data[2] == [[0.0, 1.0], [1.0, 2.0]]
